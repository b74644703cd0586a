"""`swash combine`: arithmetic on frequency responses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import flying, options

if TYPE_CHECKING:
    from swashplate.identification.responses.frequency_response import FrequencyResponse

FILES = (flying.RESPONSES, "responses.json", "report.html")


def combine(
    operation: Annotated[
        str, typer.Argument(metavar="OPERATION", help="product, ratio, inverse, negative, closed or broken.")
    ],
    responses: Annotated[
        list[str],
        typer.Argument(
            metavar="RESPONSES...", help="One or two: responses.nc or its folder; FILE:OUTPUT/INPUT takes a pair."
        ),
    ],
    out: options.OutFolder = None,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Multiply, divide, invert, negate frequency responses, close or open a loop, with errors and coherence.

    closed: L / (1 + L) of a broken loop L with negative feedback. broken: L = T / (1 - T) of the closed one. Writes
    responses.nc, responses.json and report.html to --out, for fit-tf and compare.
    """
    import swashplate as sp
    from swashplate.atomic import write_json
    from swashplate.cli.console import as_json
    from swashplate.cli.outputs import folder_when_complete, told
    from swashplate.errors import SwashError

    if len(responses) > 2:
        raise SwashError(f"are {len(responses)}; it takes one or two.", channel="RESPONSES")
    combined = sp.combine(operation, *(_one(text) for text in responses))  # it says which  # pyrefly: ignore[bad-argument-type]
    with folder_when_complete(out, ours=FILES) as folder:
        if folder is not None:
            combined.save(folder / flying.RESPONSES)
            write_json(folder / "responses.json", combined.as_dict())
            sp.report(combined, path=folder / "report.html")
    if json:
        typer.echo(as_json(combined.as_dict()))
    elif not quiet:
        typer.echo(repr(combined))
        if out is not None:
            typer.echo(f"\n{told(out, FILES)}")


def _one(text: str) -> FrequencyResponse:
    """The responses in a file or folder, or one pair of them."""
    path, pair = Path(text), ""
    if not path.exists() and ":" in text:
        name, _, pair = text.rpartition(":")
        path = Path(name)
    responses = flying.load_responses(path)
    output, _, input = pair.partition("/")
    return responses.select((output.strip(),), (input.strip(),)) if pair else responses
