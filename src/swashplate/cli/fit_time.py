"""`swash fit-time`: state-space models from records in time."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import flying, options


def fit_time(
    structure: Annotated[
        str,
        typer.Argument(metavar="STRUCTURE", help="A model file with start values (of `swash fit-ss`, say), or a name."),
    ],
    log: Annotated[list[str], typer.Argument(metavar="LOG...", help="Flights; FILE@5-30 takes seconds 5 to 30.")],
    out: options.OutFolder = None,
    method: Annotated[
        str,
        typer.Option(
            "--method",
            help="output-error; in gusts filter-error (gain of the noise) or prediction-error (free gain).",
        ),
    ] = "output-error",
    outputs: Annotated[
        str | None,
        typer.Option("--outputs", help="Channels to fit, separated by commas; all of the model's by default."),
    ] = None,
    biases: Annotated[str | None, typer.Option("--biases", help="Outputs with a constant bias in each record.")] = None,
    shifts: Annotated[
        bool, typer.Option("--shifts/--no-shifts", help="Estimate constants in the states' rates.")
    ] = True,
    start: flying.Start = None,
    fix: flying.Fix = None,
    iterations: Annotated[int, typer.Option("--iterations", help="Largest number of iterations.", min=1)] = 80,
    gusts: Annotated[
        str | None, typer.Option("--gusts", help="Of filter-error: white (usual) or lasting, in the air of u, v, w.")
    ] = None,
    horizon: options.HorizonAhead = None,
    hold_out: options.HoldOut = None,
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
    """Fit a state-space model, delays included, to records in time by maximum likelihood, and verify it on others.

    Writes report.html, model.toml, fit.json and verification.json to --out; without --hold-out the records of the fit
    are shown, and marked as no hold-out.
    """
    import swashplate as sp
    from swashplate.cli.reading import asked, read_all

    begun, names = sp.structure(structure), flying.renamed(rename, option="--rename")
    first, held = options.numbers_by_name(start, option="--start"), options.fixed_values(fix)
    how = asked(mapping, unit, drop_bad_stamps, as_logged)
    flying.carried_out(
        lambda say: sp.fit_time(
            begun,
            read_all(log, how=how),
            method=method,
            outputs=flying.names(outputs) or None,
            biases=flying.names(biases),
            shifts=shifts,
            start=first,
            fixed=held,
            iterations=iterations,
            gusts=gusts,
            horizon=options.seconds_ahead(horizon),
            hold_out=read_all(hold_out, how=how),
            rate=rate,
            cutoff=cutoff,
            names=names,
            say=say,
        ),
        out=out,
        json=json,
        quiet=quiet,
    )
