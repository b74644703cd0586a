"""`swash track`: a log replayed as a stream, and what an estimator on board would have known."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import flying, options
from swashplate.errors import SwashError


def track(
    log: options.FlightName,
    equation: Annotated[
        list[str] | None,
        typer.Option(
            "--equation", metavar="TEXT", help="As 'p_dot = Lp*p + La*aileron - 9.81*theta + bias'. Repeatable."
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option("--model", help="A linear model whose rows replace --equation; or a vehicle, with --unknown."),
    ] = None,
    out: options.OutFolder = None,
    rate: Annotated[
        float | None, typer.Option("--rate", help="Samples a second [Hz]; the log's own if not given.", min=1.0)
    ] = None,
    band: Annotated[
        str | None,
        typer.Option(
            "--band",
            metavar="LOW-HIGH",
            help="Frequencies that are used [Hz]; 0.1-2.5 if not given, or to a fifth of the rate.",
        ),
    ] = None,
    spacing: Annotated[
        float | None, typer.Option("--spacing", help="Distance between them [Hz]; HIGH / 25 by default.", min=1e-4)
    ] = None,
    memory: Annotated[
        float | None, typer.Option("--memory", help="Time constant of forgetting [s]; none by default.")
    ] = None,
    held: Annotated[
        str | None,
        typer.Option("--held", help="Channels that are constant between samples (commands), separated by commas."),
    ] = None,
    instrument: Annotated[
        str | None,
        typer.Option(
            "--instrument",
            help="Commands that no controller gives, by commas: with them strong gusts do not bias the coefficients.",
        ),
    ] = None,
    delay: Annotated[
        list[str] | None, typer.Option("--delay", metavar="NAME=SECONDS", help="A channel acts this late. Repeatable.")
    ] = None,
    unknown: Annotated[
        str | None,
        typer.Option(
            "--unknown", metavar="NAMES", help="Parameters of the vehicle, separated by commas, for example mass."
        ),
    ] = None,
    spread: Annotated[
        float, typer.Option("--spread", help="Possible relative error of the parameters at the start.")
    ] = 0.2,
    wander: Annotated[
        float, typer.Option("--wander", help="Possible relative change of the parameters in a second.")
    ] = 0.02,
    every: Annotated[float, typer.Option("--every", help="Time between two estimates [s].", min=0.001)] = 0.2,
    c_code: Annotated[Path | None, typer.Option("--c", metavar="DIR", help="Write the estimators as C99 here.")] = None,
    rename: flying.Rename = "",
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Estimate coefficients of equations of motion along a log, sample by sample as on board, with bounds over time.

    Equations go through recursive Fourier regression (no derivative is taken, nothing is filtered), parameters of a
    vehicle through an extended Kalman filter. Gaps, NaN values and jumps of the clock hold the estimate, and are
    reported. Writes report.html and track.json to --out. Examples:

    swash track flight.csv --equation "q_dot = Mq*q + Md*servo_pitch + bias" --held servo_pitch --out tracked

    swash track flight.nc --model coax --unknown mass --out tracked
    """
    import swashplate as sp
    from swashplate.api.track import Tracking
    from swashplate.cli.console import as_json, progress
    from swashplate.cli.outputs import folder_when_complete, place_of
    from swashplate.cli.reading import asked, read

    names = flying.names(unknown)
    if names and model is None:
        raise SwashError("is of a vehicle: give --model too.", channel="--unknown")
    if (model is None) == (not equation):
        raise SwashError("is wanted, or --model: one of the two.", channel="--equation")
    with (
        progress(quiet=quiet or json) as line,
        folder_when_complete(out, ours=Tracking.files) as folder,
    ):
        tracking = sp.track(
            read(log, how=asked(mapping, unit, drop_bad_stamps)),
            (sp.vehicle(model) if names else sp.structure(model)) if model is not None else equation or (),
            rate=rate,
            band=flying.band(band),
            spacing=spacing,
            memory=memory,
            held=flying.names(held),
            instruments=flying.names(instrument),
            delays=options.numbers_by_name(delay, option="--delay"),
            unknown=names,
            spread=spread,
            wander=wander,
            every=every,
            names=flying.renamed(rename, option="--rename"),
            say=line.say,
        )
        if folder is not None:
            tracking.write(folder)
    code = None if c_code is None else tracking.code()
    written = [] if code is None or c_code is None else code.save(c_code)
    if json:
        typer.echo(as_json(tracking.to_document()))
    elif not quiet:
        typer.echo(repr(tracking))
        for note in code.notes if code is not None else ():
            typer.echo(f"\n{note}")
        made = () if out is None else dict.fromkeys(str(place_of(out, name, Tracking.files)) for name in Tracking.files)
        files = [*map(str, written), *made]
        if files:
            typer.echo(f"\nWritten: {', '.join(files)}")
    flying.end_with(tracking.problems)
