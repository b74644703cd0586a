"""What the verbs on frequency responses share: reading logs for them, finding responses, saying what is missing."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import options
from swashplate.cli.guard import Exit, complain
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.cli.reading import Reading
    from swashplate.flights.flight import Flight
    from swashplate.identification.responses.frequency_response import FrequencyResponse
    from swashplate.models.linear.state_space import StateSpaceModel
    from swashplate.validation.verification import Verification

RESPONSES = "responses.nc"

BandOption = Annotated[str | None, typer.Option("--band", metavar="LOW-HIGH", help="Limits in Hz, for example 0.1-10.")]
Responses = Annotated[
    Path, typer.Argument(metavar="RESPONSES", help="What `swash respond` wrote: the file responses.nc or its folder.")
]
Rename = Annotated[
    str,
    typer.Option(
        "--rename", help="NAME=CHANNEL, by commas: the log's CHANNEL as the model's NAME, for example az=az_sid."
    ),
]
Coherence = Annotated[float, typer.Option("--coherence", help="Least coherence that counts.", min=0.0, max=1.0)]


def band(text: str | None, *, option: str = "--band") -> tuple[float, float] | None:
    """`0.1-10` (also with Hz) as two rising numbers."""
    if text is None:
        return None
    try:
        low, high = (float(part) for part in text.lower().removesuffix("hz").split("-"))
    except ValueError:
        low = high = float("nan")
    if not 0.0 < low < high < float("inf"):
        raise SwashError(f"'{text}' is not LOW-HIGH in Hz.", channel=option, hint=f"Example: {option} 0.1-10")
    return low, high


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


def with_names(flight: Flight, wanted: Mapping[str, str]) -> Flight:
    """The flight with channels under new names; a channel that had such a name makes way.

    Raises:
        FlightError: a channel that the flight does not have.
    """
    changed = {source: name for name, source in wanted.items() if name != source}
    if not changed:
        return flight
    for source in changed:
        flight.stream_of(source)
    streams = {
        home: data.drop_vars([n for n in changed.values() if n in data.data_vars]).rename(
            {source: name for source, name in changed.items() if source in data.data_vars}
        )
        for home, data in flight.streams.items()
    }
    return flight.with_streams({home: data for home, data in streams.items() if data.data_vars}).done(
        "rename", **changed
    )


def flown(
    texts: Sequence[str],
    channels: Sequence[str],
    *,
    rate: float,
    cutoff: float,
    how: Reading,
    also: Sequence[str] = (),
) -> list[Flight]:
    """Flights at one rate, with the streams that hold the channels (and those in `also` that are there) only.

    Nothing is cut at take-off and landing and no outlier is removed: sweeps are long, and what looks like an outlier to
    motion capture's rules is often a doublet. Channels that the log lacks are derived where attitude and place allow.
    Between samples goes a spline: lines would take 3 dB off a channel at a third of its rate.
    """
    from swashplate.cli.reading import read
    from swashplate.flights.consistency import refuse_inconsistent

    made = []
    for text in texts:
        flight = read(text, how=how)
        refuse_inconsistent(flight)  # whole: the streams that are left out below may be what shows a wrong unit
        logged = {name: source for name, source in how.channels.items() if source in flight}
        flight = with_names(flight, logged)
        whole = all(name in flight for name in channels)
        if whole:
            homes = {flight.stream_of(name) for name in (*channels, *also) if name in flight}
            flight = flight.with_streams({name: data for name, data in flight.streams.items() if name in homes})
        flight = flight.condition(
            rate=rate, cutoff=cutoff, outliers=False, trim_ground=False, derive=not whole, method="spline"
        )
        made.append(with_names(flight, {n: s for n, s in how.channels.items() if n not in logged}))
    return made


def with_given(model: StateSpaceModel, start: Sequence[str] | None, fix: Sequence[str] | None) -> StateSpaceModel:
    """The model with `--start NAME=VALUE` and, held, `--fix NAME=VALUE`.

    Raises:
        CardError: a name that the model does not have, or a value outside its bounds.
    """
    begun = options.assignments(start, option="--start").items()
    values = {name: options.numbers(value, option="--start", count=1)[0] for name, value in begun}
    held = options.fixed_values(fix)
    given = model.with_values(values).with_values(held, free=False)
    given.check_bounds((*values, *held))
    return given


def load_responses(path: Path) -> FrequencyResponse:
    """The responses in a file, or in a folder that `swash respond` wrote."""
    from swashplate.identification.responses.frequency_response import FrequencyResponse

    return FrequencyResponse.load(path / RESPONSES if path.is_dir() else path)


_PIECE = re.compile(r"(?P<source>.+) (?P<start>-?[\d.]+)-(?P<stop>-?[\d.]+) s")


def seen_before(verification: Verification, sources: Sequence[str]) -> Verification:
    """The verification, with a warning where a stretch lies in what the responses were made from."""
    fitted = [m for m in map(_PIECE.fullmatch, sources) if m]
    used = [
        trace.source
        for trace in verification.traces
        if (t := _PIECE.fullmatch(trace.source))
        and any(
            f["source"] == t["source"] and float(f["start"]) < float(t["stop"]) and float(t["start"]) < float(f["stop"])
            for f in fitted
        )
    ]
    if not used:
        return verification
    words = f"NOT A HOLD-OUT: the fit has seen {', '.join(used)}."
    return replace(verification, warnings=(words, *verification.warnings))


def end_with(problems: Sequence[str]) -> None:
    """Exit code 2 with one line where something could not be computed; the rest has been written and marked."""
    if problems:
        complain(" ".join(problems))
        raise typer.Exit(Exit.INPUT)
