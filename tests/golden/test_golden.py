"""What the code computes against what it computed when the golden results were frozen: see `freeze.py`."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from .case import CASES, ELSEWHERE, FROZEN, RELATIVE, SMALL, Case, Deviation, deviations
from .freeze import compute, frozen, machine, missing

LIGHT = [name for name, case in CASES.items() if case.light]
HEAVY = [name for name, case in CASES.items() if not case.light]


NOT_YET: tuple[str, ...] = ()
"""Cases that nobody has frozen yet, from the commit before the move."""


def unjudged(case: Case) -> str:
    """Why a case cannot be judged here ("": it can): no data, no package, or a heavy one on another machine."""
    if case.name in NOT_YET:
        return f"{case.name} is not frozen yet"
    lacking, elsewhere = missing(case), differs(case.name)
    if lacking:
        return f"{case.name} needs {lacking}"
    if elsewhere and not case.light and not os.environ.get("SWASHPLATE_GOLDEN"):
        return f"another machine has other last digits (SWASHPLATE_GOLDEN=1 compares all the same): {elsewhere}"
    return ""


def runnable(case: Case) -> None:
    """Skips what cannot be judged here, with the reason."""
    reason = unjudged(case)
    if reason:
        pytest.skip(reason)


def differs(name: str) -> str:
    """What is not as on the machine that froze a case: its last digits are its own."""
    then, here = frozen(name)["machine"], machine()
    return ", ".join(
        f"{key} {here.get(key)} (frozen: {value})" for key, value in then.items() if here.get(key) != value
    )


def judged(name: str, values: dict[str, Any]) -> Deviation:
    """The worst deviation of a case; the test fails where it is not allowed."""
    allowed = ELSEWHERE if CASES[name].light and differs(name) else RELATIVE
    away = deviations(frozen(name)["values"], values, relative=allowed)
    worst, over = away[0], [d for d in away if d.size > 1.0]
    print(f"{name}: worst of {len(away)} numbers: {worst}")
    if over:
        lines = "\n".join(f"  {d}" for d in over[:20])
        where = differs(name)
        told = f"\nNot as on the machine that froze it: {where}" if where else ""
        pytest.fail(f"{name}: {len(over)} of {len(away)} numbers beyond {allowed:g}, worst first:\n{lines}{told}")
    return worst


@pytest.fixture(scope="module")
def light() -> dict[str, dict[str, Any]]:
    """All light cases that can run here, from one process."""
    return compute([name for name in LIGHT if not unjudged(CASES[name])])


@pytest.mark.parametrize("name", LIGHT)
def test_quick_results_are_the_frozen_ones(name: str, light: dict[str, dict[str, Any]]) -> None:
    runnable(CASES[name])
    judged(name, light[name]["values"])


@pytest.mark.proof
@pytest.mark.parametrize("name", HEAVY)
def test_results_are_the_frozen_ones(name: str) -> None:
    runnable(CASES[name])
    done = compute([name])[name]
    away = deviations(frozen(name)["values"], done["values"])
    note_for_the_page(name, away, done["seconds"])
    judged(name, done["values"])


def note_for_the_page(name: str, away: list[Deviation], seconds: float) -> None:
    """One row of docs/proof.md."""
    folder = os.environ.get("SWASHPLATE_PROOF")
    if not folder:
        return
    path = Path(folder) / "golden.json"
    page: dict[str, Any] = {
        "title": "Golden results",
        "text": "Every case computed again in a process with one thread, beside what was frozen before the house was "
        f"rebuilt; {RELATIVE:g} relative is allowed.",
        "columns": ["case", "numbers", "beyond", "worst, relative", "which", "seconds"],
        "rows": [],
        "passed": True,
    }
    if path.exists():
        page = json.loads(path.read_text(encoding="utf-8"))
    over, worst = [d for d in away if d.size > 1.0], away[0]
    page["rows"].append([name, len(away), len(over), f"{worst.relative:.1e}", worst.name, round(seconds)])
    page["passed"] = page["passed"] and not over
    path.write_text(json.dumps(page, indent=2), encoding="utf-8")


def test_every_case_is_frozen_and_every_frozen_file_is_a_case() -> None:
    assert {path.stem for path in FROZEN.glob("*.json")} == set(CASES) - set(NOT_YET)
    assert sum(path.stat().st_size for path in FROZEN.glob("*.json")) < 1_500_000


@pytest.mark.parametrize(
    "change",
    [
        {"mass": 0.3 * (1 + 3e-10)},
        {"mass": float("nan")},
        {"mass": "0.3"},
        {"row": [1.0, 1e-3, 2.1e-10]},
        {"row": [1.0, 1e-3]},
        {"verdict": "usable"},
        {"converged": 1.0},
        {"more": 1.0},
    ],
)
def test_a_changed_number_is_seen(change: dict[str, Any]) -> None:
    then = {"mass": 0.3, "row": [1.0, 1e-3, 0.0], "verdict": "good", "converged": True}
    away = deviations(then, then | change)
    assert away[0].size > 1.0
    assert away[0].name.partition("[")[0] == next(iter(change))
    assert sum(d.size > 1.0 for d in away) == 1


def test_rounding_is_let_through_and_a_missing_number_is_not() -> None:
    then = {"mass": 0.3, "row": [1.0, 1e-3, 0.0], "zero": 0.0}
    now = {"mass": 0.3 * (1 + 0.9e-10), "row": [1.0, 1e-3, 0.9e-10], "zero": 0.9 * SMALL}
    assert all(d.size < 1.0 for d in deviations(then, now))
    assert deviations(then, {k: v for k, v in now.items() if k != "row"})[0].size > 1.0


def test_light_cases_are_judged_on_every_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """There with more room for the last digits; a number that moved by more is seen all the same."""
    monkeypatch.delenv("SWASHPLATE_GOLDEN", raising=False)
    monkeypatch.setitem(globals(), "differs", lambda name: "processor")
    name = "trims_coax"
    values = frozen(name)["values"]
    assert "another machine" not in unjudged(CASES[name])
    assert missing(CASES[HEAVY[0]]) or "another machine" in unjudged(CASES[HEAVY[0]])
    place, old = next((n, v) for n, v in values.items() if isinstance(v, float) and v)
    judged(name, values | {place: old * (1.0 + 1e-7)})
    with pytest.raises(pytest.fail.Exception):
        judged(name, values | {place: old * (1.0 + 1e-4)})
