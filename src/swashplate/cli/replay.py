"""`swash replay`: look at a logged flight in the browser, with a model's prediction beside it, or film it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import live, options
from swashplate.cli.reading import Reading
from swashplate.errors import SwashError


def replay(
    flight: options.FlightName,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            help="A model file or a vehicle's name: its prediction flies along.",
            autocompletion=options._vehicle_names,
        ),
    ] = None,
    ahead: Annotated[
        float, typer.Option("--ahead", help="Seconds after which the prediction starts anew.", min=0.1, max=60.0)
    ] = 2.0,
    video: Annotated[
        Path | None, typer.Option("--video", metavar="FILE", help="Write a film (.mp4) instead of opening a page.")
    ] = None,
    frames: Annotated[
        Path | None, typer.Option("--frames", metavar="DIR", help="Write numbered pictures instead, for a paper.")
    ] = None,
    frame_rate: Annotated[float, typer.Option("--frame-rate", help="Pictures per second.", min=1.0, max=100.0)] = 25.0,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    port: live.Port = 8018,
    host: live.Host = "127.0.0.1",
    allow_remote: live.Remote = False,
    open_page: live.Open = False,
    quiet: options.Quiet = False,
) -> None:
    """Replay a flight: scrub through it in the browser, or film it."""
    from swashplate.cli.console import progress
    from swashplate.cli.reading import read

    filming = video is not None or frames is not None
    if video is not None and frames is not None:
        raise SwashError("and --frames are one too many.", channel="--video", hint="Give one of them.")
    if video is not None and not video.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=video.parent, channel="--video", hint="Make it first.")
    if frames is not None and frames.exists() and not frames.is_dir():
        raise SwashError("is a file, expected a folder.", where=frames, channel="--frames")
    chosen = None if model is None else given.vehicle_of(model, None, None)
    listening = None
    if not filming:
        live.need_live_extra()
        from swashplate.links.live import server

        listening = server.listen(host, port, allow_remote=allow_remote)
    try:
        how = Reading(mapping, options.assignments(unit, option="--unit"), drop_bad_stamps)
        with progress(quiet=quiet) as line:
            line.say("reading the flight")
            log = read(flight, how=how)
            if not filming:
                server.check_page()
            # A simulation's true states have no outliers, and what looks like one is a maneuver.
            clean = log.provenance.simulated and "phi" in log
            logged = log.condition(rate=rate, cutoff=cutoff, outliers=not clean, trim_ground=not clean)
            from swashplate.links.live.replay import as_json
            from swashplate.links.live.replay import replay as prepare
            from swashplate.simulation.compilation import enable_compilation_cache

            enable_compilation_cache()
            line.say("predicting (compiling takes longest the first time)" if chosen else "preparing")
            shown = prepare(logged, model=chosen, ahead=ahead)
            if filming:
                from swashplate.links.live import film

                def told(done: int, total: int) -> None:
                    line.say("drawing", done=done, total=total)

                if video is not None:
                    count = film.write_film(shown, video, rate=frame_rate, tell=told)
                else:
                    assert frames is not None
                    count = film.write_pictures(shown, frames, rate=frame_rate, tell=told)
        if listening is None:
            if not quiet:
                typer.echo(f"Written: {video or frames} ({count} pictures, {count / frame_rate:.1f} s)")
            return
        live.announce(server.address_of(listening), open_page=open_page, quiet=quiet)
        server.serve(server.replay_app(as_json(shown), remote=allow_remote), listening)
    finally:
        if listening is not None:
            listening.close()
