"""`swash fit-ss`: state-space models from frequency responses."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import flying, options


def fit_ss(
    structure: Annotated[
        str,
        typer.Argument(
            metavar="STRUCTURE",
            help="compose:body+flap+..., a ready structure (swash structures list) or a model file; with --search "
            "several by commas, or none.",
        ),
    ],
    responses: flying.ResponsesLast = None,
    search: Annotated[
        bool, typer.Option("--search", help="Try structures, drop the worst early, choose one and say why.")
    ] = False,
    out: options.OutFolder = None,
    start: flying.Start = None,
    start_from: Annotated[
        str | None,
        typer.Option(
            "--start-from",
            metavar="SOURCE",
            help="Start from a vehicle's linearisation in hover, or from models of `swash fit-tf`, by commas.",
        ),
    ] = None,
    fix: flying.Fix = None,
    band: flying.BandsOption = None,
    without: flying.Without = None,
    coherence: flying.Coherence = 0.6,
    reduce: Annotated[
        bool, typer.Option("--reduce", help="Remove parameters that the responses do not determine.")
    ] = False,
    starts: Annotated[int, typer.Option("--starts", help="Number of starting points.", min=1)] = 4,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the starting points.", min=0)] = 0,
    gains: Annotated[
        bool, typer.Option("--gains", help="Also suggest rate-loop gains, ArduPilot's or Rotorflight's.")
    ] = False,
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
    """Fit a state-space model, with accuracy figures, and verify it in time on flights that the fit has not seen.

    Writes report.html, model.toml, fit.json and (with --hold-out) verification.json to --out.
    Exit code 2 if a fit fails or --gains are refused: the reason is said.
    """
    import swashplate as sp
    from swashplate.cli.reading import asked, read_all

    named, place = flying.structures_and_responses(structure, responses, search=search)
    begun, (limits, own) = [sp.structure(name) for name in named], flying.bands(band)
    measured = flying.load_responses(place)
    first, held = options.numbers_by_name(start, option="--start"), options.fixed_values(fix)
    names, how = flying.renamed(rename, option="--rename"), asked(mapping, unit, drop_bad_stamps)
    flying.carried_out(
        lambda say: sp.fit_ss(
            begun,
            measured,
            search=search,
            start=first,
            start_from=flying.names(start_from) or None,
            fixed=held,
            band=limits,
            bands=own,
            without=tuple(without or ()),
            least_coherence=coherence,
            reduce=reduce,
            starts=starts,
            seed=seed,
            gains=gains,
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
