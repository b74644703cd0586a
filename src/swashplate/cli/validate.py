"""`swash validate`: how well a model predicts flights that it was not fitted to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import flying, options
from swashplate.cli.reading import Reading

if TYPE_CHECKING:
    from swashplate.models.linear.state_space import StateSpaceModel

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
        float, typer.Option("--calibration", help="Seconds at each start that tell delays and trims.", min=1.0)
    ] = 5.0,
    band: flying.BandOption = None,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    rename: flying.Rename = "",
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Predict flights from many start points and judge the predictions, next to the card and naive predictors.

    A state-space model (of `swash fit-ss` or `swash fit-tf`) is flown along each flight's inputs instead; --band adds
    how it does within the band that it was fitted over.
    """
    from swashplate.atomic import write_text
    from swashplate.cli.console import as_json, console, progress
    from swashplate.cli.outputs import folder_when_complete
    from swashplate.cli.reading import check_disjoint, conditioned
    from swashplate.cli.tables import floors_table, validation_table
    from swashplate.errors import SwashError
    from swashplate.models.catalogue import vehicle as find
    from swashplate.models.linear.state_space_file import is_state_space

    channels = flying.renamed(rename, option="--rename")
    how = Reading(mapping, options.assignments(unit, option="--unit"), drop_bad_stamps, channels)
    if is_state_space(model):
        limits = flying.band(band)
        _verify(
            model, published, flight, band=limits, out=out, rate=rate, cutoff=cutoff, how=how, json=json, quiet=quiet
        )
        return
    if band is not None:
        raise SwashError(f"'{model}' is a vehicle, and a band is for state-space models.", channel="--band")
    ahead = tuple(options.numbers(horizons, option="--horizons"))
    if min(ahead) <= 0.0:
        raise SwashError(f"'{horizons}' are not all positive.", channel="--horizons")
    aircraft, card = find(model), None if published is None else find(published)
    with progress(quiet=quiet or json) as line:
        line.say("reading flights")
        flights = conditioned(flight, rate=rate, cutoff=cutoff, how=how)
        check_disjoint(flights, flight)

        import swashplate as sp
        from swashplate.identification.core.records import records

        records(flights, aircraft)
        with folder_when_complete(out, ours=FILES) as folder:
            line.say("predicting (compiling takes longest the first time)")
            validation = sp.validate(
                aircraft,
                flights,
                published=card,
                horizons=ahead,
                every=every,
                calibration=calibration,
                progress=lambda done, total: line.say("predicting", done=done, total=total),
            )
            assert isinstance(validation, sp.Validation)  # `records` has found the pose
            if folder is not None:
                line.say("writing the report")
                sp.report(validation, path=folder / "report.html")
                write_text(folder / "validation.json", as_json(validation.as_dict()) + "\n")
    if json:
        typer.echo(as_json(validation.as_dict()))
    elif not quiet:
        screen = console()
        screen.print(validation_table(validation, width=screen.width))
        if validation.floors:
            typer.echo("\nWhat the model's scores stand beside")
            screen.print(floors_table(validation))
        for one in validation.contacts:
            typer.echo(f"\n{one.words}")
        typer.echo("\n" + "\n".join(f"{axis.axis}: {axis.level}. {axis.words}" for axis in validation.verdict))
        if out is not None:
            typer.echo(f"\nReport: {out / 'report.html'}")


def _other(name: str) -> StateSpaceModel:
    """What an identified model is compared with: another model, or a vehicle linearised in hover."""
    import swashplate as sp
    from swashplate.identification.time.linearised_model import model_of

    aircraft = sp.vehicle(name)
    if aircraft.structure is not None:
        return aircraft.structure
    return model_of(sp.linearize(aircraft), name=f"{aircraft.name}, linearised in hover")


def _verify(
    model: str,
    other: str | None,
    flights: list[str],
    *,
    band: tuple[float, float] | None,
    out: Path | None,
    rate: float,
    cutoff: float,
    how: Reading,
    json: bool,
    quiet: bool,
) -> None:
    """A linear model along recorded inputs, biases and shifts solved for."""
    from swashplate.atomic import write_text
    from swashplate.cli.console import as_json, progress
    from swashplate.cli.outputs import folder_when_complete
    from swashplate.identification.responses.response_warnings import damaged
    from swashplate.models.linear.state_space_file import structure
    from swashplate.reporting.response_report import response_report
    from swashplate.reporting.sections_responses import ResponseMaterial
    from swashplate.validation.verification import verify_inside

    identified, compared = structure(model), None if other is None else _other(other)
    with progress(quiet=quiet or json) as line, folder_when_complete(out, ours=FILES) as folder:
        line.say("flying the model along the inputs")
        inputs, outputs = identified.inputs, identified.outputs
        flown = flying.flown(flights, inputs, rate=rate, cutoff=cutoff, how=how, also=outputs)
        found = verify_inside(identified, flown, band=band)
        rival = None
        if compared is not None:
            channels = (compared.inputs, compared.outputs)
            rival = verify_inside(
                compared,
                flying.flown(flights, channels[0], rate=rate, cutoff=cutoff, how=how, also=channels[1]),
                band=band,
            )
        if folder is not None:
            response_report(ResponseMaterial(verification=found, rival=rival), path=folder / "report.html")
            write_text(folder / "verification.json", as_json(found.as_dict()) + "\n")
    if json:
        typer.echo(as_json(found.as_dict()))
    elif not quiet:
        typer.echo(repr(found))
        if rival is not None:
            typer.echo(f"\n{rival!r}")
        if out is not None:
            typer.echo(f"\nReport: {out / 'report.html'}")
    flying.end_with(damaged(found.flights))
