"""A log as it is taken to work: contradictions stop it, other problems go with it into every report."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from swashplate.flights.consistency import UNCHECKED, refuse_inconsistent
from swashplate.flights.flight import Flight
from swashplate.flights.inspect import problems
from swashplate.flights.provenance import Problem


def checked(flight: Flight, used: Collection[str] | None = None) -> Flight:
    """The flight with the problems of its channels in its provenance (`Provenance.problems`).

    Args:
        used: the channels that are worked on; what is wrong with others is neither told nor stops anything. None: all.
            Where the user takes the log as it is, a wrong scale is a problem like others.

    Raises:
        FlightError: channels that contradict each other, as `refuse_inconsistent` says.
    """
    taken = any(step.operation == UNCHECKED for step in flight.history)
    told = [Problem(str(finding), () if taken else finding.scale) for finding in refuse_inconsistent(flight, used=used)]
    if used is not None:
        kept = {home: data[[n for n in data.data_vars if n in used]] for home, data in flight.streams.items()}
        flight, whole = flight.with_streams({home: data for home, data in kept.items() if data.data_vars}), flight
    else:
        whole = flight
    told += [Problem(text) for text in problems(flight, whole)]
    before = whole.provenance.problems
    return replace(whole, provenance=replace(whole.provenance, problems=tuple(dict.fromkeys((*before, *told)))))
