"""`swash replay`: look at a logged flight in the browser, with a model's prediction beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import live, options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.links.live.replay import Replay


def replay(
    flight: options.FlightName,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            help="A model file or a vehicle's name: its prediction is shown too.",
            autocompletion=options._vehicle_names,
        ),
    ] = None,
    ahead: Annotated[
        float, typer.Option("--ahead", help="Seconds after which the prediction starts again.", min=0.1, max=60.0)
    ] = 2.0,
    posterior: given.Posterior = None,
    draws: given.Draws = 8,
    hold_missing: Annotated[
        bool,
        typer.Option("--hold-missing", help="Hold the model's inputs that the log lacks at hover; the page says so."),
    ] = False,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    as_logged: options.AsLogged = False,
    port: live.Port = 8018,
    host: live.Host = "127.0.0.1",
    allow_remote: live.Remote = False,
    open_page: live.Open = False,
    quiet: options.Quiet = False,
) -> None:
    """Replay a flight: scrub through it in the browser."""
    import swashplate as sp
    from swashplate.cli.console import progress
    from swashplate.cli.reading import asked, read

    chosen = None if model is None else given.vehicle_of(model, None, None)
    if posterior is not None and chosen is None:
        raise SwashError("is of no model: give it with --model.", channel="--posterior")
    with progress(quiet=quiet) as line:

        def prepared() -> Replay:
            line.say("reading the flight")
            how = asked(mapping, unit, drop_bad_stamps, as_logged)
            log = read(flight, how=how)
            # A simulation's true states have no outliers, and what looks like one is a maneuver.
            clean = log.provenance.simulated and "phi" in log
            logged = log.condition(rate=rate, cutoff=cutoff, outliers=not clean, trim_ground=not clean)
            line.say("predicting (compiling takes longest the first time)" if chosen else "preparing")
            drawn = () if chosen is None or posterior is None else given.drawn(chosen, posterior, count=draws)
            shown = sp.replay(logged, model=chosen, draws=drawn, ahead=ahead, hold_missing=hold_missing)
            for note in shown.notes:
                typer.echo(note, err=True)
            return shown

        sp.show_replay(
            prepared,
            host=host,
            port=port,
            allow_remote=allow_remote,
            open_page=open_page,
            say=line.say,
            ready=lambda address: live.told(address, quiet=quiet),
        )
