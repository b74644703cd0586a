"""`swash fit-time`: state-space models from records in time."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import flying, options
from swashplate.cli.reading import Reading

FILES = ("report.html", "fit.json", "model.toml", "verification.json")


def fit_time(
    structure: Annotated[
        str,
        typer.Argument(metavar="STRUCTURE", help="A model file with start values (of `swash fit-ss`, say), or a name."),
    ],
    log: Annotated[list[str], typer.Argument(metavar="LOG...", help="Flights; FILE@5-30 takes seconds 5 to 30.")],
    out: options.OutFolder = None,
    method: Annotated[
        str, typer.Option("--method", help="output-error; filter-error or prediction-error in gusts.")
    ] = "output-error",
    outputs: Annotated[
        str | None,
        typer.Option("--outputs", help="Channels to fit, separated by commas; all of the model's by default."),
    ] = None,
    biases: Annotated[
        str | None, typer.Option("--biases", help="Outputs with a constant of their own in each record.")
    ] = None,
    shifts: Annotated[bool, typer.Option("--shifts/--no-shifts", help="Constants in the states' rates.")] = True,
    start: Annotated[
        list[str] | None, typer.Option("--start", metavar="NAME=VALUE", help="Start value of a parameter.")
    ] = None,
    fix: Annotated[
        list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter at a value.")
    ] = None,
    iterations: Annotated[int, typer.Option("--iterations", help="At most this many.", min=1)] = 80,
    horizon: options.HorizonAhead = None,
    hold_out: options.HoldOut = None,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    rename: flying.Rename = "",
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Fit a state-space model, delays included, to records in time by maximum likelihood, and verify it on others.

    Writes report.html, model.toml, fit.json and verification.json to --out; without --hold-out the records of the fit
    are shown, and marked as no hold-out.
    """
    from swashplate.atomic import write_text
    from swashplate.cli.console import as_json, progress
    from swashplate.cli.outputs import folder_when_complete
    from swashplate.identification.responses.response_warnings import damaged
    from swashplate.identification.time.linear_time_fit import fit_in_time
    from swashplate.models.linear.state_space_file import structure as find
    from swashplate.models.linear.state_space_file import to_toml
    from swashplate.reporting.response_report import response_report
    from swashplate.reporting.sections_responses import ResponseMaterial
    from swashplate.validation.verification import verify

    model = find(structure)
    wanted = flying.names(outputs) or model.outputs
    channels = flying.renamed(rename, option="--rename")
    how = Reading(mapping, options.assignments(unit, option="--unit"), drop_bad_stamps, channels)
    model = flying.with_given(model, start, fix)
    with progress(quiet=quiet or json) as line, folder_when_complete(out, ours=FILES) as folder:
        line.say("reading logs")
        flown = (*model.inputs, *wanted)
        flights = flying.flown(log, flown, rate=rate, cutoff=cutoff, how=how)
        line.say("fitting")
        fit = fit_in_time(
            model,
            flights,
            outputs=wanted,
            shifts=shifts,
            biases=flying.names(biases),
            method=method,
            iterations=iterations,
            horizon=options.seconds_ahead(horizon),
            progress=lambda i, cost: line.say("fitting", note=f"iteration {i}, cost {cost:.5g}"),
        )
        line.say("flying the model")
        unseen = flying.flown(hold_out, flown, rate=rate, cutoff=cutoff, how=how) if hold_out else flights
        verification = flying.seen_before(verify(fit.model, unseen, outputs=wanted), fit.settings["records"])
        if folder is not None:
            line.say("writing the report")
            response_report(ResponseMaterial(time_fit=fit, verification=verification), path=folder / "report.html")
            fit.save(folder / "fit.json")
            write_text(folder / "model.toml", to_toml(fit.model))
            write_text(folder / "verification.json", as_json(verification.as_dict()) + "\n")
    if json:
        typer.echo(as_json({"fit": fit.to_document(comparisons=False), "verification": verification.as_dict()}))
    elif not quiet:
        typer.echo(repr(fit))
        typer.echo(f"\n{verification!r}")
        if out is not None:
            typer.echo(f"\nReport: {out / 'report.html'}")
    flying.end_with(damaged([*flights, *(unseen if hold_out else [])]))
