"""`swash maneuver`: an excitation to fly, its rules checked, or designed for what is unknown of a model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import options
from swashplate.cli.usual_verb import usual
from swashplate.errors import SwashError

_CHECK = "check"

app = typer.Typer(
    cls=usual(_CHECK),
    help='Design an excitation to fly: check one that you describe (`swash maneuver "sweep:pitch,0.5-8Hz,60s"`), or '
    "let one be designed for what is unknown of a model.",
    rich_markup_mode=None,
    no_args_is_help=True,
)


@app.command(_CHECK, short_help="Check an excitation against the design rules, and write it.")
def maneuver(
    spec: Annotated[
        str,
        typer.Argument(metavar="SPEC", help='For example "sweep:pitch,0.5-8Hz,60s,0.1" or "doublet:roll,0.5s,0.2".'),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="The series as .csv; without it the rules are checked only."),
    ] = None,
    rate: Annotated[
        float, typer.Option("--rate", help="Rate of the series and of the log [Hz].", min=1.0, max=10000.0)
    ] = 100.0,
    noise: Annotated[
        float | None, typer.Option("--noise", help="Standard deviation of the output's noise, in its unit.", min=0.0)
    ] = None,
    gain: Annotated[
        float | None, typer.Option("--gain", help="Smallest ratio of output to input in the band.", min=0.0)
    ] = None,
    coherence: Annotated[float, typer.Option("--coherence", help="Required coherence in the whole band.")] = 0.8,
    bandwidth: Annotated[
        float | None,
        typer.Option("--bandwidth", help="Bandwidth of the response, or frequency of the mode of interest [Hz]."),
    ] = None,
    f180: Annotated[
        float | None, typer.Option("--f180", help="Frequency at which the response's phase is -180 deg [Hz].")
    ] = None,
    ardupilot: Annotated[
        bool, typer.Option("--ardupilot", help="A sweep on ArduPilot's schedule, and FILE.param with SID_ parameters.")
    ] = False,
    sid_axis: Annotated[
        int | None,
        typer.Option("--sid-axis", help="ArduPilot's SID_AXIS; by default the mixer, after the rate controller."),
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Design an excitation: check the rules, and write the series for an autopilot to fly."""
    import swashplate as sp
    from swashplate.cli.console import as_json, console
    from swashplate.cli.tables import table

    if out is not None and out.suffix.lower() != ".csv":
        raise SwashError(f"ends in '{out.suffix}', expected .csv.", where=out, channel="--out")
    if sid_axis is not None and not ardupilot:
        raise SwashError("is given without --ardupilot.", channel="--sid-axis", hint="Add --ardupilot.")
    planned = sp.plan_maneuver(
        spec,
        rate=rate,
        noise=noise,
        gain=gain,
        coherence=coherence,
        bandwidth=bandwidth,
        f180=f180,
        ardupilot=ardupilot,
        sid_axis=sid_axis,
    )
    written = () if out is None else planned.save(out)
    if json:
        typer.echo(as_json(planned.to_document() | {"written": [str(path) for path in written]}))
    elif not quiet:
        console().print(table(*planned.rows(), left=4))
        if planned.chirp is not None:
            typer.echo("\n" + planned.chirp.parameter_file().rstrip())
        if written:
            typer.echo(f"\nWritten: {', '.join(map(str, written))}")


@app.command("design", short_help="Design the excitation that determines unknown parameters best, within limits.")
def design(
    for_: Annotated[str, typer.Option("--for", metavar="MODEL", help="A vehicle's name, or a card or model file.")],
    unknown: Annotated[
        str, typer.Option("--unknown", metavar="NAMES", help="Parameters to determine, separated by commas.")
    ],
    limits: Annotated[
        str,
        typer.Option(
            "--limits",
            metavar="NAME=VALUE,...",
            help="Some of amplitude [1], attitude [deg], rate [deg/s], place [m], battery [s], seconds; by default "
            "attitude=20,rate=120,place=3,seconds=30.",
        ),
    ] = "",
    band: Annotated[str, typer.Option("--band", metavar="LOW-HIGH", help="Frequencies [Hz].")] = "0.3-8",
    axes: Annotated[
        str | None, typer.Option("--axes", help="Of roll, pitch, yaw, heave, by commas; all that the vehicle has.")
    ] = None,
    aim: Annotated[
        str | None,
        typer.Option(
            "--aim",
            metavar="TEXT",
            help="Determine this instead of the parameters themselves: q/pitch@0.5-3 (response of a state to an axis, "
            "in Hz), or margin (disc margin of --controller).",
        ),
    ] = None,
    controller: Annotated[
        Path | None,
        typer.Option("--controller", metavar="FILE", help="Controller that flies (.toml); else a hold of hover."),
    ] = None,
    criterion: Annotated[
        str | None,
        typer.Option("--criterion", help="D (minimum volume of the errors, default) or A (minimum sum of squares)."),
    ] = None,
    robust: Annotated[
        str,
        typer.Option("--robust", help="Optimise for the average over draws of the prior, or for the worst of them."),
    ] = "average",
    spread: Annotated[
        float, typer.Option("--spread", help="Possible relative error of the unknown parameters.", min=0.0, max=0.9)
    ] = 0.3,
    draws: Annotated[int, typer.Option("--draws", help="Number of draws of the prior.", min=1, max=100)] = 5,
    rate: Annotated[float, typer.Option("--rate", help="Rate of the series and of the log [Hz].", min=20.0)] = 100.0,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the draws.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="The series as .csv, the flight card beside it as .txt."),
    ] = None,
    script: Annotated[
        Path | None,
        typer.Option("--script", metavar="FILE.lua", help="Write a script with which ArduPilot flies it as angles."),
    ] = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Design a multisine for unknown parameters, in the closed loop, and compare it with a sweep and a 3-2-1-1.

    Prints the expected bounds of each, how they improve with each second, and a flight card. The bounds are for the
    noise that the model's own identification found, or else for that of usual indoor flights. If no maneuver within
    the limits determines all parameters, the exit code is 2, and the reason is printed.
    """
    import swashplate as sp
    from swashplate.api.controllers import from_file
    from swashplate.cli.console import as_json, console, progress
    from swashplate.cli.tables import table

    if out is not None and out.suffix.lower() != ".csv":
        raise SwashError(f"ends in '{out.suffix}', expected .csv.", where=out, channel="--out")
    if script is not None and script.suffix.lower() != ".lua":
        raise SwashError(f"ends in '{script.suffix}', expected .lua.", where=script, channel="--script")
    asked = _limits(limits)
    with progress(quiet=quiet or json) as line:
        made = sp.design_maneuver(
            sp.vehicle(for_),
            [name.strip() for name in unknown.split(",") if name.strip()],
            limits=asked,
            band=_band(band),
            axes=None if axes is None else [axis.strip() for axis in axes.split(",") if axis.strip()],
            aim=aim,
            controller=None if controller is None else from_file(controller),
            criterion=criterion,
            robust=robust,
            spread=spread,
            draws=draws,
            rate=rate,
            seed=seed,
            say=line.say,
        )
    written = () if out is None else made.save(out)
    if script is not None:
        from swashplate.api.maneuver_script import maneuver_script
        from swashplate.atomic import write_text

        written = (*written, write_text(script, maneuver_script(made)))
    if json:
        typer.echo(as_json(made.to_document() | {"written": [str(path) for path in written]}))
    elif not quiet:
        console().print(table(*made.rows(), left=1))
        typer.echo("\nWhat each second buys")
        console().print(table(*made.seconds_rows()))
        typer.echo("\n" + made.card())
        if written:
            typer.echo(f"\nWritten: {', '.join(map(str, written))}")


@app.command("need", short_help="Say how far the next flight must move, and what else it must have.")
def need(
    validation: Annotated[
        Path, typer.Argument(metavar="FILE", help="validation.json of `swash identify --hold-out` or `swash validate`.")
    ],
    fit: Annotated[float, typer.Option("--fit", help="Prediction fit that the flight is to show [%].")] = 70.0,
    ahead: Annotated[float, typer.Option("--ahead", help="Seconds ahead.")] = 1.0,
    json: options.Json = False,
) -> None:
    """Say what the next flight must have for a model to show what it can.

    The error of a prediction hardly changes from flight to flight, so each channel must move by that error over the
    share that may be missed. Axes whose command only answered the motion need an excitation of their own.
    """
    import swashplate as sp
    from swashplate.cli.console import as_json

    excitation = sp.needed_excitation(validation, fit=fit, horizon=ahead)
    typer.echo(as_json(excitation.to_document()) if json else repr(excitation))


def _limits(text: str) -> dict[str, float]:
    pairs = [_limit(item) for item in text.split(",") if item.strip()]
    twice = [name for k, (name, _) in enumerate(pairs) if name in dict(pairs[:k])]
    if twice:
        raise SwashError(f"says {', '.join(twice)} twice.", channel="--limits")
    return dict(pairs)


def _limit(item: str) -> tuple[str, float]:
    name, equals, value = item.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise SwashError(
            f"is '{item.strip()}', expected NAME=VALUE" + ("" if equals else ", e.g. attitude=15") + ".",
            channel="--limits",
        ) from None


def _band(text: str) -> tuple[float, float]:
    low, _, high = text.strip().lower().removesuffix("hz").partition("-")
    try:
        return float(low), float(high)
    except ValueError:
        raise SwashError(f"is '{text}', expected LOW-HIGH, e.g. 0.3-8.", channel="--band") from None
