"""`swash validate`: how well a model predicts flights that it was not fitted to."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import flying, options
from swashplate.errors import SwashError

FILES = ("report.html", "validation.json", "verification.json")


def validate(
    model: options.ModelName,
    flight: options.Flights,
    out: options.OutFolder = None,
    published: Annotated[
        str | None,
        typer.Option(
            "--published",
            help="The card to compare with (by default the one that it was identified from). Beside a state-space "
            "model a vehicle flies linearised in hover, as that model does; another model may be given too.",
        ),
    ] = None,
    horizons: Annotated[str, typer.Option("--horizons", help="Seconds ahead, separated by commas.")] = "0.5,1,2,5",
    every: Annotated[float, typer.Option("--every", help="Seconds between start points.", min=0.01)] = 0.1,
    calibration: Annotated[
        float,
        typer.Option(
            "--calibration", help="First seconds of each flight, from which delays and trims are estimated.", min=1.0
        ),
    ] = 5.0,
    close_loop: options.CloseLoop = "",
    posterior: Annotated[
        Path | None,
        typer.Option(
            "--posterior",
            metavar="FILE",
            help="A fit.json of this model: bands of predictions by models drawn from it, held against the flights.",
        ),
    ] = None,
    draws: Annotated[
        int | None, typer.Option("--draws", help="With --posterior: how many, 39, 79, 119 and so on.", min=39)
    ] = None,
    band: flying.BandOption = None,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    rename: flying.Rename = "",
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    as_logged: options.AsLogged = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Predict flights from many start points and judge the predictions, next to the card and naive predictors.

    A state-space model (of `swash fit-ss` or `swash fit-tf`) is flown along each flight's inputs instead; --band adds
    how it does within the band that it was fitted over.
    """
    import swashplate as sp
    from swashplate.cli.console import as_json, console, progress
    from swashplate.cli.outputs import folder_when_complete, told
    from swashplate.cli.reading import asked, conditioned, read_all
    from swashplate.cli.tables import bands_table, closed_table, floors_table, validation_table
    from swashplate.flights.overlap import check_disjoint
    from swashplate.identification.core.records import records

    how, limits = asked(mapping, unit, drop_bad_stamps, as_logged), flying.band(band)
    judged, other = sp.vehicle(model), None if published is None else sp.vehicle(published)
    names = flying.renamed(rename, option="--rename")
    closing = options.names(close_loop)
    if draws is not None and posterior is None:
        raise SwashError("is for --posterior.", channel="--draws", hint="Add --posterior fit.json.")
    drawn = () if posterior is None else given.drawn(judged, posterior, count=draws or 39)
    if judged.structure is not None:
        if closing or drawn:
            channel = "--close-loop" if closing else "--posterior"
            raise SwashError(f"'{model}' is a state-space model: it flies along the inputs.", channel=channel)
        linear = judged
        flying.carried_out(
            lambda say: sp.validate_linear(
                linear,
                read_all(flight, how=how),
                published=other,
                band=limits,
                rate=rate,
                cutoff=cutoff,
                names=names,
                say=say,
            ),
            out=out,
            json=json,
            quiet=quiet,
        )
        return
    if band is not None:
        raise SwashError(f"'{model}' is a vehicle, and a band is for state-space models.", channel="--band")
    ahead = tuple(options.numbers(horizons, option="--horizons"))
    if min(ahead) <= 0.0:
        raise SwashError(f"'{horizons}' are not all positive.", channel="--horizons")
    with progress(quiet=quiet or json) as line:
        line.say("reading flights")
        flights = conditioned(flight, rate=rate, cutoff=cutoff, how=how)
        check_disjoint(flights, flight)
        records(flights, judged)
        with folder_when_complete(out, ours=FILES) as folder:
            line.say("predicting (compiling takes longest the first time)")
            validation = sp.validate(
                judged,
                flights,
                published=other,
                horizons=ahead,
                every=every,
                calibration=calibration,
                close_loop=closing,
                draws=drawn,
                progress=lambda done, total: line.say("predicting", done=done, total=total),
            )
            assert isinstance(validation, sp.Validation)  # `records` has found the pose
            if folder is not None:
                line.say("writing the report")
                sp.report(validation, path=folder / "report.html")
                validation.save(folder / "validation.json")
    if json:
        typer.echo(as_json(validation.as_dict()))
    elif not quiet:
        screen = console()
        screen.print(validation_table(validation, width=screen.width))
        if validation.floors:
            typer.echo("\nWhat the model's scores stand beside")
            screen.print(floors_table(validation))
        if validation.loop_closed:
            typer.echo("\nWith the controller in the place of the recorded command")
            screen.print(closed_table(validation))
        if drawn:
            typer.echo(f"\nWhat the bands of {len(drawn)} drawn models hold [%]")
            screen.print(bands_table(validation))
        for words in (
            *(one.summary_text for one in validation.contacts),
            *(law.summary_text for law in validation.laws),
        ):
            typer.echo(f"\n{words}")
        typer.echo("\n" + "\n".join(f"{axis.axis}: {axis.level}. {axis.words}" for axis in validation.verdict))
        if out is not None:
            typer.echo(f"\n{told(out, FILES)}")
