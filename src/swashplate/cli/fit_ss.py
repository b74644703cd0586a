"""`swash fit-ss`: state-space models from frequency responses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import flying, options
from swashplate.cli.reading import Reading

if TYPE_CHECKING:
    from swashplate.identification.responses.frequency_response import FrequencyResponse
    from swashplate.models.linear.state_space import StateSpaceModel

FILES = ("report.html", "fit.json", "model.toml", "verification.json")


def fit_ss(
    structure: Annotated[
        str,
        typer.Argument(
            metavar="STRUCTURE",
            help="A model file, or a ready structure: six_dof, six_dof_coupled, hybrid, eleven_state, "
            "thirteen_state, coaxial, rotor_body, heave, yaw.",
        ),
    ],
    responses: flying.Responses,
    out: options.OutFolder = None,
    start: Annotated[
        list[str] | None, typer.Option("--start", metavar="NAME=VALUE", help="Start value of a parameter.")
    ] = None,
    start_from: Annotated[
        str | None,
        typer.Option(
            "--start-from",
            metavar="SOURCE",
            help="Start from a vehicle's linearisation in hover, or from models of `swash fit-tf`, by commas.",
        ),
    ] = None,
    fix: Annotated[
        list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter at a value.")
    ] = None,
    band: flying.BandOption = None,
    coherence: flying.Coherence = 0.6,
    reduce: Annotated[bool, typer.Option("--reduce", help="Take out what the responses do not tell.")] = False,
    starts: Annotated[int, typer.Option("--starts", help="Starting points that are followed.", min=1)] = 4,
    seed: Annotated[int, typer.Option("--seed", help="Of the starting points.", min=0)] = 0,
    gains: Annotated[bool, typer.Option("--gains", help="Also suggest ArduPilot rate-loop gains.")] = False,
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
    """
    from swashplate.api.gains import suggest_gains
    from swashplate.atomic import write_text
    from swashplate.cli.console import as_json, progress
    from swashplate.cli.gain_lines import gain_words
    from swashplate.cli.outputs import folder_when_complete
    from swashplate.identification.frequency.start_values import at_flown_trim
    from swashplate.identification.frequency.state_space_fit import fit_state_space
    from swashplate.identification.responses.response_warnings import damaged
    from swashplate.models.linear.state_space_file import structure as find
    from swashplate.models.linear.state_space_file import to_toml
    from swashplate.reporting.response_report import response_report
    from swashplate.reporting.sections_responses import ResponseMaterial
    from swashplate.validation.structure_reduction import reduce as reduced
    from swashplate.validation.verification import verify_inside

    model = find(structure)
    found, limits = flying.load_responses(responses), flying.band(band)
    channels = {**found.settings.get("channels", {}), **flying.renamed(rename, option="--rename")}
    how = Reading(mapping, options.assignments(unit, option="--unit"), drop_bad_stamps, channels)
    with progress(quiet=quiet or json) as line, folder_when_complete(out, ours=FILES) as folder:
        if start_from is not None:
            line.say("finding start values")
            model = _started(model, start_from, found, seed=seed)
        model = flying.with_given(at_flown_trim(model, found), start, fix)
        line.say("fitting")
        fit = fit_state_space(
            model,
            found,
            band=limits,
            least_coherence=coherence,
            starts=starts,
            seed=seed,
            progress=lambda i, cost: line.say("fitting", note=f"iteration {i}, cost {cost:.5g}"),
        )
        flights = []
        if hold_out:
            wanted = (*model.inputs, *(t for t in model.outputs if t in found.outputs))
            flights = flying.flown(hold_out, wanted, rate=rate, cutoff=cutoff, how=how)
        if reduce:
            fit = reduced(
                fit, hold_out=flights, progress=lambda i, cost: line.say("reducing", note=f"step {i}, J_ave {cost:.4g}")
            )
        verification = None
        if hold_out:
            line.say("flying the model along what the fit has not seen")
            verification = flying.seen_before(verify_inside(fit.model, flights, band=limits), found.sources)
        advice = suggest_gains(fit, found) if gains else ()
        if folder is not None:
            line.say("writing the report")
            material = ResponseMaterial(found, fit=fit, verification=verification, gains=advice)
            response_report(material, path=folder / "report.html")
            fit.save(folder / "fit.json")
            write_text(folder / "model.toml", to_toml(fit.model))
            if verification is not None:
                write_text(folder / "verification.json", as_json(verification.as_dict()) + "\n")
    if json:
        document = {"fit": fit.to_document(comparisons=False), "verification": verification and verification.as_dict()}
        typer.echo(as_json({**document, "gains": [s.as_dict() for s in advice]}))
    elif not quiet:
        typer.echo(repr(fit))
        if verification is not None:
            typer.echo(f"\n{verification!r}")
        typer.echo(gain_words(advice), nl=False)
        if out is not None:
            typer.echo(f"\nReport: {out / 'report.html'}")
    flying.end_with([*fit.problems, *damaged(verification.flights if verification else ())])


def _started(model: StateSpaceModel, source: str, responses: FrequencyResponse, *, seed: int) -> StateSpaceModel:
    """The model with start values from fitted transfer functions (files or their folders) or from a vehicle."""
    from swashplate.identification.frequency.start_values import from_linear_model, from_models
    from swashplate.models.linear.state_space_file import is_state_space
    from swashplate.models.linear.state_space_file import structure as find

    places = [Path(name) / "model.toml" if Path(name).is_dir() else Path(name) for name in flying.names(source)]
    if places and all(is_state_space(str(place)) for place in places):
        return from_models(model, [find(str(place)) for place in places], responses, seed=seed)
    import swashplate as sp

    return from_linear_model(model, sp.linearize(sp.vehicle(source)))
