"""What an ordinary flight tells, as the page shows it: incidents, step responses, noise, filters, the next sweep."""

from __future__ import annotations

from typing import Any

import numpy as np

from swashplate.flights.aircraft_kind import aircraft_kind
from swashplate.flights.review.review import LoopReview, review
from swashplate.links.logs import code_lines
from swashplate.links.logs.opened import Opened

_LINES = 600
"""Lines of a spectrum that are drawn."""


def review_of(opened: Opened) -> dict[str, Any]:
    """The review of a log, kept with it.

    Raises:
        SwashError: where the log is not ready.
    """
    flight = opened.ready
    kind = aircraft_kind(flight)
    findings = review(flight, swept=opened.inspection.sweeps if opened.inspection else None)
    return {
        "tells": findings.tells,
        "vehicle": findings.vehicle,
        "made_for": kind.made_for if kind is not None else "",
        "lists": [[heading, list(lines)] for heading, lines in findings.lists()],
        "incidents": [
            {"kind": each.kind, "start": each.start, "stop": each.stop, "text": each.text}
            for each in findings.incidents
        ],
        "loops": [_loop(each) for each in findings.loops],
        "noise": [_noise(each) for each in findings.noise],
        "next": [_next(each) for each in findings.next],
        "about_next": findings.about_next,
        "code": code_lines.reviewed(opened.read).to_document(),
    }


def _loop(loop: LoopReview) -> dict[str, Any]:
    step = loop.step
    answer = None
    if step is not None:
        answer = {"time": step.time, "response": step.response, "low": step.low, "high": step.high}
    return {"axis": loop.axis, "words": str(loop), "step": answer}


def _noise(noise: Any) -> dict[str, Any]:
    """Spectra of at most so many lines; of a group of lines the largest stays."""
    frequency, columns = np.asarray(noise.frequency), [np.asarray(noise.after), np.asarray(noise.before)]
    if frequency.size > _LINES:
        begins = np.unique(np.linspace(0, frequency.size, _LINES, endpoint=False, dtype=int))
        frequency, columns = frequency[begins], [np.fmax.reduceat(column, begins) for column in columns]
    return {
        "channel": noise.channel,
        "words": str(noise),
        "notch": "" if noise.notch is None else str(noise.notch),
        "parameters": {} if noise.notch is None else dict(noise.notch.parameters),
        "frequency": frequency,
        "after": columns[0],
        "before": columns[1],
    }


def _next(sweep: Any) -> dict[str, Any]:
    return {"axis": sweep.axis, "words": str(sweep), "parameters": dict(sweep.parameters)}
