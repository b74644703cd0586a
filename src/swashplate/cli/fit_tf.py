"""`swash fit-tf`: transfer functions from frequency responses."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import flying, options
from swashplate.cli.reading import Reading

FILES = ("report.html", "fit.json", "model.toml", "verification.json")


def fit_tf(
    responses: flying.Responses,
    input: Annotated[str, typer.Option("--input", help="The input channel.")],
    outputs: Annotated[
        str | None, typer.Option("--outputs", help="Output channels with shared poles; all where not given.")
    ] = None,
    form: Annotated[
        str | None,
        typer.Option("--form", help='Zeros/poles: "1/2", "0/1+1s" (integrator), "0/0" (gain and delay); else tried.'),
    ] = None,
    fix: Annotated[
        list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter, for example tau=0.05.")
    ] = None,
    band: flying.BandOption = None,
    coherence: flying.Coherence = 0.6,
    loop: Annotated[
        bool,
        typer.Option(
            "--margins", help="Margins, the responses taken as broken loops; bandwidth and phase delay of the attitude."
        ),
    ] = False,
    gains: Annotated[bool, typer.Option("--gains", help="Also suggest ArduPilot rate-loop gains.")] = False,
    hold_out: options.HoldOut = None,
    out: options.OutFolder = None,
    rate: options.Rate = 100.0,
    cutoff: options.Cutoff = 0.0,
    rename: flying.Rename = "",
    mapping: options.Mapping = None,
    unit: options.Units = None,
    drop_bad_stamps: options.BadStamps = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Fit transfer functions with a delay; without --form the usual structures are tried and one is suggested.

    Writes report.html, fit.json and (where it can be flown) model.toml to --out; --hold-out verifies it in time.
    """
    from swashplate.api.gains import suggest_gains
    from swashplate.atomic import write_text
    from swashplate.cli.console import as_json, progress
    from swashplate.cli.gain_lines import gain_words
    from swashplate.cli.outputs import folder_when_complete
    from swashplate.errors import IdentificationError
    from swashplate.identification.frequency.handling_readings import handling_lines, margin_lines
    from swashplate.identification.frequency.transfer_function_fit import as_state_space, fit_transfer_function, suggest
    from swashplate.identification.responses.response_warnings import damaged
    from swashplate.models.linear.state_space_file import to_toml
    from swashplate.reporting.response_report import response_report
    from swashplate.reporting.sections_responses import ResponseMaterial
    from swashplate.validation.verification import verify_inside

    found = flying.load_responses(responses)
    limits, wanted = flying.band(band), flying.names(outputs) or None
    channels = {**found.settings.get("channels", {}), **flying.renamed(rename, option="--rename")}
    how = Reading(mapping, options.assignments(unit, option="--unit"), drop_bad_stamps, channels)
    with progress(quiet=quiet or json) as line, folder_when_complete(out, ours=FILES) as folder:
        line.say("fitting")
        trials: tuple = ()  # type: ignore[type-arg]
        if form is None and not fix:
            best, trials = suggest(found, input=input, outputs=wanted, band=limits, least_coherence=coherence)
            fit = best.fit
        else:
            fit = fit_transfer_function(
                found,
                form or "1/2",
                input=input,
                outputs=wanted,
                band=limits,
                fixed=options.fixed_values(fix),
                least_coherence=coherence,
            )
        pairs = tuple(m.output for m in fit.model)
        model = verification = None
        try:
            model = as_state_space(fit)
        except IdentificationError as error:
            if hold_out:
                raise
            line.say(str(error))
        if hold_out and model is not None:
            line.say("flying the model along what the fit has not seen")
            flown = (*model.inputs, *model.outputs)
            flights = flying.flown(hold_out, flown, rate=rate, cutoff=cutoff, how=how)
            verification = flying.seen_before(verify_inside(model, flights, band=limits), found.sources)
        advice = suggest_gains(fit, found) if gains else ()
        if folder is not None:
            measured = found.select(pairs, (input,))
            material = ResponseMaterial(measured, (fit,), trials, verification=verification, gains=advice)
            response_report(material, path=folder / "report.html")
            fit.save(folder / "fit.json")
            if model is not None:
                write_text(folder / "model.toml", to_toml(model))
            if verification is not None:
                write_text(folder / "verification.json", as_json(verification.as_dict()) + "\n")
    read = (
        [*margin_lines(found, fit, fit.targets), *handling_lines(found.select(pairs, (input,)), (fit,))] if loop else []
    )
    if json:
        document = {
            "fit": fit.to_document(comparisons=False),
            "margins": [r.as_dict() for r in read],
            "gains": [s.as_dict() for s in advice],
            "verification": verification and verification.as_dict(),
        }
        typer.echo(as_json({**document, "tried": [{"form": t.form.text, "J": t.cost} for t in trials]}))
    elif not quiet:
        if trials:
            lines = [f"  {t.form.text:<10}{t.parameters:>3} parameters   J = {t.cost:8.1f}" for t in trials]
            typer.echo("Structures tried (zeros/poles):\n" + "\n".join(lines) + "\n")
        typer.echo(repr(fit))
        for line_of_margins in read:
            typer.echo(repr(line_of_margins))
        if verification is not None:
            typer.echo(f"\n{verification!r}")
        typer.echo(gain_words(advice), nl=False)
        if out is not None:
            typer.echo(f"\nReport: {out / 'report.html'}")
    flying.end_with(damaged(verification.flights if verification else ()))
