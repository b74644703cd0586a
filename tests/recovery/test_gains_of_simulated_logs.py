"""From logs to gains, many at once: good logs get some, no log with a fault does, and no gain has the wrong sign."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

import swashplate as sp
from flown_logs import KINDS, Flown, logs
from proof_page import leave
from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.errors import FlightError

MIX = (
    "good",
    "good",
    "no sweep",
    "good",
    "stick reversed",
    "good",
    "gyro reversed",
    "good",
    "degrees as radians",
    "good",
)


def judged(one: Flown, *, known: bool) -> tuple[Suggestion | None, str]:
    """What comes of a log as a user goes on with it: the gains of roll, or the error that stopped it.

    Args:
        known: whether what moved the input is judged too; otherwise it is called a sweep, and the rest stands alone.
    """
    names = ["mixer_roll", "p", *(["sid_target"] if one.recorded else [])]
    try:
        records = sp.uniform_records(one.flight, names, rate=min(one.rate, 100.0))
        references = ["sid_target"] if one.recorded else []
        responses = sp.respond(records, inputs="mixer_roll", outputs="p", references=references)
        if not known:
            told = {"mixer_roll": {"kind": "sweep", "words": ""}}
            responses = replace(responses, settings={**responses.settings, "excitation": told})
        study = sp.fit_tf(responses, input="mixer_roll", form="0/2", gains=True)
    except FlightError as error:  # channels that contradict each other go no further
        return None, error.problem
    (roll,) = study.material.gains
    return roll, roll.refused


@pytest.mark.parametrize("count", [len(MIX), pytest.param(300, marks=pytest.mark.proof)])
def test_good_logs_get_gains_and_no_log_with_a_fault_does(count: int) -> None:
    kinds = tuple(MIX[k % len(MIX)] for k in range(count))
    flown = [one for k in range(0, count, 100) for one in logs(kinds[k : k + 100], seed=k)]
    given, of, reasons = Counter[str](), Counter(kinds), dict[str, str]()
    for one in flown:
        for known in (True, False):
            roll, refused = judged(one, known=known)
            if roll is not None and roll.parameters:
                given[one.kind] += known
                assert one.kind == "good", (one.flight.provenance.source, known)
                assert all(value >= 0.0 for value in roll.parameters.values())
                assert roll.parameters["ATC_RAT_RLL_P"] > 0.0
            elif one.kind == "good":
                reasons[one.flight.provenance.source] = refused
    if count > 100:
        rows = [[kind, of[kind], given[kind]] for kind in KINDS]
        sound = given["good"] >= 0.95 * of["good"] and not any(given[kind] for kind in KINDS if kind != "good")
        leave(
            "gains-of-logs",
            {
                "title": "Gains from simulated logs",
                "text": "Logs of loops of all speeds, at several rates, with coupled axes, from the log to the "
                "gains. At least 95 % of the good ones must get gains, and none of the others.",
                "columns": ["log", "of", "gains"],
                "rows": rows,
                "passed": bool(sound),
            },
        )
    assert set(of) == set(KINDS)
    assert given["good"] >= 0.95 * of["good"], reasons
