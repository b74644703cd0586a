"""What an identified model is verified on: another log, another part of the same log, or nothing that is unseen."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.excitation import excitations
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep
from swashplate.links.logs.bins import gaps
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.opened import Opened

AROUND = 1.0
"""s that are taken before and after a sweep."""
_SHORTEST = 8.0  # s
_MOVES = 0.1  # of the input's spread in the sweep: a part in which it moves less tells nothing


class Part(NamedTuple):
    """A part of a log that is verified on, in words, and whether the fit has not seen it."""

    read: Read
    start: float
    stop: float
    description: str
    unseen: bool
    flight: Flight


def part_of(flight: Flight, sweep: Sweep) -> tuple[float, float]:
    """The sweep with a second around it [s], to the millisecond: as a command names it."""
    return (
        round(max(flight.start, sweep.start - AROUND), 3),
        round(min(flight.stop, sweep.stop + AROUND), 3),
    )


def hold_out(opened: Opened, sweep: Sweep, input: str, output: str, others: Sequence[Opened]) -> Part:
    """The best that there is: another log with both channels, else the longest other part, else the sweep itself."""
    flight = opened.ready
    begin, end = part_of(flight, sweep)
    spread = _spread(flight, input, begin, end)
    for other in others:
        apart = other.flight is not None and other.flight.provenance.sha256 != flight.provenance.sha256
        if apart and other.flight is not None and input in other.flight and output in other.flight:
            stretch = _longest(other.flight, input, output, [], _MOVES * spread)
            if stretch:
                description = f"another log, {other.read.file}, {stretch[0]:.1f} to {stretch[1]:.1f} s"
                return Part(other.read, *stretch, description, True, other.flight)
    stretch = _longest(flight, input, output, [(begin, end)], _MOVES * spread)
    if stretch:
        description = f"another part of the log, {stretch[0]:.1f} to {stretch[1]:.1f} s"
        return Part(opened.read, *stretch, description, True, flight)
    description = (
        "the sweep itself, which the fit has seen: this is NO verification. No other part of the open logs has "
        f"{input} moved from outside for {_SHORTEST:g} s; open a log with such a part, and it is used."
    )
    return Part(opened.read, begin, end, description, False, flight)


def _spread(flight: Flight, name: str, start: float, stop: float) -> float:
    time, values = flight.time(name), flight.values(name)
    inside = (time >= start) & (time <= stop) & np.isfinite(values)
    return float(np.std(values[inside])) if inside.any() else 0.0


def _longest(
    flight: Flight, input: str, output: str, taken: Sequence[tuple[float, float]], least: float
) -> tuple[float, float] | None:
    """The longest stretch [s] without a gap in either channel, outside `taken`, in which the input moves enough.

    Something from outside must move it there: where another input was swept, a loop only answers, and a model of this
    input alone explains nothing.
    """
    edges = {flight.time(name)[k] for name in (input, output) for k in (0, -1)}
    for name in (input, output):
        time, breaks = flight.time(name), gaps(flight.time(name))
        edges |= set(time[breaks].tolist()) | set(time[breaks - 1].tolist())
    edges |= {edge for pair in taken for edge in pair}
    low = max(float(flight.time(name)[0]) for name in (input, output))
    high = min(float(flight.time(name)[-1]) for name in (input, output))
    rising = sorted(float(edge) for edge in edges if low <= edge <= high)
    stretches = []
    for start, stop in pairwise(rising):
        free = not any(start < end and begin < stop for begin, end in taken)
        gapless = all(_is_gapless(flight.time(name), start, stop) for name in (input, output))
        if stop - start >= _SHORTEST and free and gapless and _spread(flight, input, start, stop) > least:
            stretches.append((round(start + 0.001, 3), round(stop - 0.001, 3)))
    stretches.sort(key=lambda pair: pair[0] - pair[1])
    return next((pair for pair in stretches if _is_excited(flight.between(*pair), input, output)), None)


def _is_excited(part: Flight, input: str, output: str) -> bool:
    return any(one.outside for one in excitations(part, [input], outputs=[output]))


def _is_gapless(time: Array, start: float, stop: float) -> bool:
    """Whether the channel has samples all along and no gap between."""
    inside = time[(time >= start) & (time <= stop)]
    return inside.size > 10 and not gaps(inside).size
