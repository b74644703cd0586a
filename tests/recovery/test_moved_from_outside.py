"""Was an input moved from outside? Both kinds of error counted over simulated flights whose truth is known.

The rules of `flights/excitation.py` and their numbers were worked out on seeds below 40000; the proof counts others.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

import proof_page
from simulated_loops import LOGGED, Case, Flown, drawn, fly
from swashplate.flights.excitation import CONTROLLER, UNKNOWN, excitations

MOSTLY = 0.5
"""Share of the command's variance that must come from outside for the excitation to be one."""


def verdict(flown: Flown) -> str:
    """Whether the right thing is said of a flight: "right", "unknown" or "wrong"."""
    name = "mixer_roll" if flown.case.autopilot else "command"
    (found,) = excitations(flown.flight, [name], outputs=["p"])
    if found.kind == UNKNOWN:
        return "unknown"
    return "right" if found.outside == bool(flown.case.shape) else "wrong"


def cases(first: int, count: int) -> list[Case]:
    """Half without excitation, a third of each half with the set-points in the log."""
    return [drawn(first + i, answer=i % 2 == 0, autopilot=i % 3 == 2) for i in range(count)]


def told(flown: list[Flown]) -> list[Flown]:
    """Those whose truth is one thing or the other: nothing from outside, or most of it."""
    return [one for one in flown if not one.case.shape or one.outside >= MOSTLY]


def test_two_dozen_flights_are_told_apart() -> None:
    flown = told(fly([replace(case, seconds=30.0) for case in cases(50_000, 24)]))
    assert {bool(one.case.shape) for one in flown} == {True, False}
    said = [(verdict(one), one.case) for one in flown]
    assert [case for word, case in said if word == "wrong"] == []
    assert sum(word == "unknown" for word, _ in said) <= 1


@pytest.mark.proof
def test_four_hundred_flights_are_told_apart() -> None:
    flown = [one for first in (60_000, 61_000, 62_000, 63_000) for one in told(fly(cases(first, 120)))]
    counts = Counter((bool(one.case.shape), one.case.autopilot, one.case.log, verdict(one)) for one in flown)
    rows, shares, wrong = [], [], []
    for outside, what in ((True, "from outside"), (False, "a controller's answer")):
        total = {word: sum(n for (o, *_, w), n in counts.items() if (o, w) == (outside, word)) for word in WORDS}
        shares.append(100.0 * total["right"] / sum(total.values()))
        wrong.append(100.0 * total["wrong"] / sum(total.values()))
        for autopilot, log in ((False, "commands and motion"), (True, "set-points too")):
            for rate in LOGGED:
                numbers = [counts[outside, autopilot, rate, word] for word in WORDS]
                rows.append([what, log, f"{rate:g}", sum(numbers), *numbers])
    passed = min(shares) >= 95.0
    proof_page.leave(
        "moved_from_outside",
        {
            "title": "Was an input moved from outside, or is it a controller's answer?",
            "text": f"{len(flown)} simulated flights of 40 s in gusts: no loop, loops fast and slow (P, PI, PID with "
            "attitude and speed loops, 50 to 400 Hz, filters, delays, sensor noise), sweeps, 3-2-1-1, doublets, steps, "
            "multisines and hands, at the mixer, at the rate's and at the attitude's set-point. A third of the logs "
            f"has sensors of its own with white and slow noise. From outside: {shares[0]:.1f} % right, {wrong[0]:.1f} "
            f"% wrong; answers: {shares[1]:.1f} % right, {wrong[1]:.1f} % wrong (95 % right wanted). The others cannot "
            "be told, and are treated as answers.",
            "columns": ["moved", "the log holds", "rate [Hz]", "flights", *WORDS],
            "rows": rows,
            "passed": passed,
        },
    )
    assert passed, (shares, wrong)


WORDS = ("right", "unknown", "wrong")


def test_what_is_right_is_not_said_by_default() -> None:
    """The mutation: the same flights with the truth turned round are nearly all wrong."""
    flown = told(fly([replace(case, seconds=30.0) for case in cases(50_000, 12)]))
    turned = [replace(one, case=replace(one.case, shape="" if one.case.shape else "sweep")) for one in flown]
    assert sum(verdict(one) == "wrong" for one in turned) >= len(turned) - 1
    assert CONTROLLER != UNKNOWN
