"""`swash fit-tf`: transfer functions from frequency responses."""

from __future__ import annotations

from typing import Annotated

import typer

from swashplate.cli import flying, options


def fit_tf(
    responses: flying.Responses,
    input: Annotated[str, typer.Option("--input", help="The input channel.")],
    outputs: Annotated[
        str | None, typer.Option("--outputs", help="Output channels with shared poles; all by default.")
    ] = None,
    form: Annotated[
        str | None,
        typer.Option(
            "--form",
            help='Zeros/poles: "1/2", "0/1+1s" (integrator), "0/0" (gain and delay); by default the usual forms.',
        ),
    ] = None,
    fix: Annotated[
        list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter, for example tau=0.05.")
    ] = None,
    band: flying.BandOption = None,
    coherence: flying.Coherence = 0.6,
    loop: Annotated[
        bool,
        typer.Option(
            "--margins", help="Margins of the responses as open loops; bandwidth and phase delay of the attitude."
        ),
    ] = False,
    gains: Annotated[
        bool, typer.Option("--gains", help="Also suggest rate-loop gains, ArduPilot's or Rotorflight's.")
    ] = False,
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
    Exit code 2 if a fit fails or --gains are refused: the reason is said.
    """
    import swashplate as sp
    from swashplate.cli.reading import asked, read_all

    measured, limits, held = flying.load_responses(responses), flying.band(band), options.fixed_values(fix)
    names, how = flying.renamed(rename, option="--rename"), asked(mapping, unit, drop_bad_stamps)
    flying.carried_out(
        lambda say: sp.fit_tf(
            measured,
            input=input,
            outputs=flying.names(outputs) or None,
            form=form,
            fixed=held,
            band=limits,
            least_coherence=coherence,
            margins=loop,
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
