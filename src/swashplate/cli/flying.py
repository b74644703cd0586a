"""What the verbs on linear models share: their options, finding responses, showing a study, saying what is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli.guard import Exit, complain
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.api.linear_study import LinearStudy
    from swashplate.identification.responses.frequency_response import FrequencyResponse

RESPONSES = "responses.nc"

BandOption = Annotated[str | None, typer.Option("--band", metavar="LOW-HIGH", help="Limits in Hz, for example 0.1-10.")]
BandsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--band",
        metavar="[PAIR=]LOW-HIGH",
        help="Limits in Hz: 0.1-10 for all, p/lateral=0.5-12 for a pair, collective=0.3-5 for a channel. Repeatable.",
    ),
]
Without = Annotated[
    list[str] | None,
    typer.Option(
        "--without", metavar="PAIR", help="Do not fit r/collective, or all of a channel (collective). Repeatable."
    ),
]
Responses = Annotated[
    Path, typer.Argument(metavar="RESPONSES", help="What `swash respond` wrote: the file responses.nc or its folder.")
]
ResponsesLast = Annotated[
    Path | None,
    typer.Argument(metavar="RESPONSES", help="What `swash respond` wrote: the file responses.nc or its folder."),
]
Rename = Annotated[
    str,
    typer.Option(
        "--rename", help="NAME=CHANNEL, by commas: the log's CHANNEL as the model's NAME, for example az=az_sid."
    ),
]
Start = Annotated[list[str] | None, typer.Option("--start", metavar="NAME=VALUE", help="Start value of a parameter.")]
Fix = Annotated[list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter at a value.")]
Coherence = Annotated[float, typer.Option("--coherence", help="Smallest coherence that is used.", min=0.0, max=1.0)]


def band(text: str | None, *, option: str = "--band") -> tuple[float, float] | None:
    """`0.1-10` (also with Hz) as two rising numbers."""
    if text is None:
        return None
    try:
        low, high = (float(part) for part in text.lower().removesuffix("hz").replace(",", "-").split("-"))
    except ValueError:
        low = high = float("nan")
    if not 0.0 < low < high < float("inf"):
        raise SwashError(f"'{text}' is not LOW-HIGH in Hz.", channel=option, hint=f"Example: {option} 0.1-10")
    return low, high


def bands(texts: Sequence[str] | None) -> tuple[tuple[float, float] | None, dict[str, tuple[float, float]]]:
    """Repeated `--band 0.1-10` and `--band p/lateral=0.5-12` as the band of all pairs and those of some."""
    whole, some = [], {}
    for text in texts or ():
        name, equals, limits = text.rpartition("=")
        edges = band(limits)
        assert edges is not None
        if not equals:
            whole.append(edges)
        elif not name.strip() or name.strip() in some:
            raise SwashError(f"'{text}' gives no pair, or one that is given twice.", channel="--band")
        else:
            some[name.strip()] = edges
    if len(whole) > 1:
        raise SwashError(
            "two bands are given for all pairs.", channel="--band", hint="Say which pair: --band p/lateral=0.5-12"
        )
    return (whole[0] if whole else None), some


def names(text: str | None) -> tuple[str, ...]:
    """Names separated by commas."""
    return tuple(part.strip() for part in (text or "").split(",") if part.strip())


def renamed(text: str, *, option: str) -> dict[str, str]:
    """`p,az=az_sid` as names of the result and the log's channels behind them."""
    pairs = {}
    for part in names(text):
        name, _, source = part.partition("=")
        name, source = name.strip(), source.strip() or name.strip()
        if not name or not source or name in pairs:
            raise SwashError(f"'{part}' is no new CHANNEL or NAME=CHANNEL.", channel=option)
        pairs[name] = source
    return pairs


def structures_and_responses(structure: str, responses: Path | None, *, search: bool) -> tuple[tuple[str, ...], Path]:
    """`STRUCTURE RESPONSES` as the structures and the place; a search may have the responses alone."""
    if responses is not None:
        return (names(structure) if search else (structure,)), responses
    if not search:
        raise SwashError(
            "a structure and responses are needed.",
            channel=structure,
            hint="swash fit-ss compose:body+flap RESPONSES, or swash fit-ss --search RESPONSES.",
        )
    return (), Path(structure)


def load_responses(path: Path) -> FrequencyResponse:
    """The responses in a file, or in a folder that `swash respond` wrote."""
    from swashplate.identification.responses.frequency_response import FrequencyResponse

    return FrequencyResponse.load(path / RESPONSES if path.is_dir() else path)


def carried_out(
    make: Callable[[Callable[..., None]], LinearStudy],
    *,
    out: Path | None,
    json: bool,
    quiet: bool,
) -> None:
    """Do what is asked, write its files where `--out` says, show it, and end with what could not be computed.

    A fit that is stopped is kept as far as it came; the exit code is then 128 and the signal's number.
    The folder is made first: a place that cannot be written to is found before an hour of computing.
    """
    from swashplate.api.linear_study import LinearStudy
    from swashplate.cli.console import as_json, progress
    from swashplate.cli.outputs import folder_when_complete, told
    from swashplate.identification.core.stopping import stoppable

    with (
        stoppable() as stop,
        progress(quiet=quiet or json) as line,
        folder_when_complete(out, ours=LinearStudy.files) as folder,
    ):
        made = make(line.say)
        if folder is not None:
            line.say("writing the report")
            made.write(folder)
    for words in made.remarks:
        typer.echo(words, err=True)
    if json:
        typer.echo(as_json(made.to_document()))
    elif not quiet:
        typer.echo(repr(made))
        if out is not None:
            typer.echo(f"\n{told(out, LinearStudy.files)}")
    end_with(made.problems, code=stop.code or Exit.INPUT)


def end_with(problems: Sequence[str], *, code: int = Exit.INPUT) -> None:
    """An exit code with one line where something could not be computed; the rest has been written and marked."""
    if problems:
        complain(" ".join(problems))
        raise typer.Exit(code)
