"""`swash`: the verbs, and nothing heavy until one of them runs."""

from __future__ import annotations

import os
import signal
import sys
from typing import Annotated, NoReturn

import typer

from swashplate.cli import (
    bench,
    campaign,
    combine,
    compare,
    control,
    data,
    decouple,
    demo,
    derivatives,
    export,
    fit_ss,
    fit_tf,
    fit_time,
    identify,
    inspect,
    link,
    live,
    maneuver,
    open,
    plot,
    reconstruct,
    replay,
    respond,
    rotor_speed,
    simulate,
    stitch,
    structures,
    track,
    trim,
    validate,
    vehicles,
)
from swashplate.cli.guard import Guarded
from swashplate.cli.terminal import over
from swashplate.systems import HANGUP

app = typer.Typer(
    name="swash",
    cls=Guarded,
    help="From a small helicopter's flight log to a validated model.",
    rich_markup_mode=None,  # plain help: rich takes longer to load than everything else that --help needs
    pretty_exceptions_enable=False,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        import platform

        from swashplate.extras import version_of

        told = ", ".join(f"{name} {version_of(name)}" for name in ("casadi", "numpy", "scipy"))
        typer.echo(f"swashplate {version_of('swashplate')} (Python {platform.python_version()}, {told})")
        raise typer.Exit


@app.callback()
def root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the full traceback of an error (or set SWASHPLATE_DEBUG=1).")
    ] = False,
) -> None:
    """From a small helicopter's flight log to a validated model. Without a verb, a page to try it on opens."""
    if context.invoked_subcommand is None:
        open.open_(port=None, open_page=True)


app.command("identify", short_help="Identify a vehicle from flights, with a report.")(identify.identify)
app.command("validate", short_help="Predict flights with a model and judge the predictions.")(validate.validate)
app.command("respond", short_help="Frequency responses from logs of sweeps.")(respond.respond)
app.command("fit-tf", short_help="Fit transfer functions to frequency responses.")(fit_tf.fit_tf)
app.command("fit-ss", short_help="Fit a state-space model to frequency responses.")(fit_ss.fit_ss)
app.command("fit-time", short_help="Fit a state-space model to records in time.")(fit_time.fit_time)
app.command("track", short_help="Estimate along a log, sample by sample as on board.")(track.track)
app.command("simulate", short_help="Fly a maneuver and save the flight.")(simulate.simulate)
app.command("open", short_help="Look at any log in the browser: one page for all of it.")(open.open_)
app.command("live", short_help="Fly a model in the browser, in real time.")(live.live)
app.command("replay", short_help="Look at a logged flight beside a model's prediction.")(replay.replay)
app.command("decouple", short_help="Design the decoupling controller of a coaxial helicopter.")(decouple.decouple)
app.command("inspect", short_help="Show what is in a log and what is wrong with it.")(inspect.inspect)
app.command("plot", short_help="Draw logs over time or frequency, also several over each other.")(plot.plot)
app.command("rotor-speed", short_help="Measure rotor speed from vibration in a log.")(rotor_speed.rotor_speed)
app.command("reconstruct", short_help="Find biases and scale factors of a flight's sensors, and remove them.")(
    reconstruct.reconstruct
)
app.command("trim", short_help="Find a vehicle's steady flight, at one speed or over a range.")(trim.trim)
app.command("linearize", short_help="Linear models and modes about steady flight.")(trim.linearize)
app.command("stitch", short_help="One model from linear models at several speeds.")(stitch.stitch)
app.command("combine", short_help="Multiply, divide, invert responses; close or open a loop.")(combine.combine)
app.command("compare", short_help="Responses, models or fits side by side.")(compare.compare)
app.command("derivatives", short_help="Stability and control derivatives, by contributor.")(derivatives.derivatives)
app.command("export", short_help="Write a model as C, an FMU, an S-function, .mat or JSON.")(export.export)
app.add_typer(bench.app, name="bench")
app.add_typer(campaign.app, name="campaign")
app.add_typer(maneuver.app, name="maneuver")
app.add_typer(link.app, name="link")
app.add_typer(control.app, name="control")
app.add_typer(vehicles.app, name="vehicles")
app.add_typer(structures.app, name="structures")
app.add_typer(data.app, name="data")
app.command("demo", short_help="Run the main job on real or simulated flights.")(demo.demo)


def _open_closed_streams() -> None:
    """Nothing in the place of standard streams that are closed (`>&-`): else the next file would be one of them."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # the system gives the lowest free number, which is the stream's own
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode))


def _clean_up_when_interrupted() -> None:
    """From now on: a verb begins. Before, `swashplate.__main__` ends at once."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as in the background of a shell
        signal.signal(signal.SIGINT, signal.default_int_handler)


def main() -> NoReturn:
    """The console script. A polite kill ends as an interrupt does: temporary files are removed."""
    _open_closed_streams()
    sys.stdout, sys.stderr = over(sys.stdout), over(sys.stderr)
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # the compiler's remarks to its own developers
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    if HANGUP is not None and signal.getsignal(HANGUP) is signal.SIG_DFL:  # `nohup` ignores it
        signal.signal(HANGUP, lambda number, _: sys.exit(128 + number))
    app(prog_name="swash", obj=_clean_up_when_interrupted)  # also as `python -m swashplate`: help speaks of swash
    raise AssertionError("typer ends the process itself")
