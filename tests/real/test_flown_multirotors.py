"""Betaflight's own SITL, as its user built it, flies each packaged multirotor by `accept_autopilot`: every line passes.

Then the firmware's own gains fly, their log gives gains, and these fly the same: what is better is named.

SWASHPLATE_BETAFLIGHT names the binary (2025.12 or later). Nothing of the firmware is in this project; without it the
proof is skipped.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

import proof_page
import swashplate as sp
from swashplate.api.acceptance import Acceptance
from swashplate.control.analysis.kept_margins import PEAK, PHASE_MARGIN
from swashplate.control.analysis.rate_gain_names import BETAFLIGHT, cli_lines
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import sweeps
from swashplate.links.betaflight.gains import AXES

BINARY = os.environ.get("SWASHPLATE_BETAFLIGHT", "")
pytestmark = [
    pytest.mark.proof,
    pytest.mark.skipif(not BINARY, reason="SWASHPLATE_BETAFLIGHT names no SITL of Betaflight"),
    pytest.mark.xdist_group("betaflight"),
]
"""Its ports cannot be moved."""
WIDE, JUDGED = (0.5, 20.0), (1.0, 15.0)
"""Hz of sweeps that hold every crossover, and where the models are fitted: below, the vehicle's own slow mode grows."""
BETTER = {
    "phase margin": ("phase margin ([0-9.-]+) deg", 1.0, PHASE_MARGIN),
    "largest sensitivity": ("sensitivity ([0-9.]+)", -1.0, PEAK),
    "disturbances rejected to": ("rejects to ([0-9.]+) rad/s", 1.0, None),
    "demand missed": ("misses ([0-9.]+) %", -1.0, None),
}
"""What is read off each log, whether more of it is better, and what is promised: a margin above it may be spent."""


@pytest.mark.parametrize("name", ["x8", "crazyflie"])
def test_every_line_passes_under_the_real_betaflight(name: str, tmp_path: Path) -> None:
    place = Path(os.environ.get("SWASHPLATE_PROOF", str(tmp_path))) / "firmware" / name
    found = sp.accept_autopilot(name, Path(BINARY), folder=place, timeout=60.0)
    assert found.log is not None
    lines = {line.what: line.found for line in found.lines}
    inspected = sp.read(found.log).inspect()
    told = ["its clock", "armed", "hover in ANGLE", "exchanges, lockstep"]
    proof_page.leave(
        f"firmware-{name}",
        {
            "title": f"Unmodified Betaflight flies {name}",
            "text": f"{found.version}, by `swash link accept` from a cold start; "
            f"{sum(line.passed is True for line in found.lines)} lines pass, {len(found.problems)} fail. "
            "The firmware is built outside this project.",
            "columns": ["what", "found"],
            "rows": [
                *([what, lines[what]] for what in told),
                *([f"{axis}: {what}", lines[f"{axis}: {what}"]] for axis in AXES for what in
                  ("clock of the log", "coherent", "response beside truth", "rate loop")),
                ["simulated seconds a second, beside other work", round(found.real_time, 1)],
                ["problems and incidents that inspect finds in the log", len(inspected.problems)],
            ],
            "passed": found.passed,
        },
    )  # fmt: skip
    assert found.problems == ()
    assert inspected.problems == ()


def suggested_lines(flight: Flight, swept: list[str]) -> list[str]:
    """Lines of the command line for every axis that the log shows well."""
    lines: list[str] = []
    for axis, (rate, command) in zip(AXES, BETAFLIGHT.values(), strict=True):
        stick = f"stick_{axis}"
        sweep = next((each for each in sweeps(flight) if each.channel == stick), None)
        if sweep is None or axis not in swept:
            continue
        records = sp.uniform_records([flight.between(sweep.start, sweep.stop)], (command, rate, stick), rate=200.0)
        responses = sp.respond(records, inputs=[command], outputs=[rate], references=(stick,), band=(0.5, 18.0))
        study = sp.fit_tf(responses, input=command, outputs=[rate], band=JUDGED, gains=True)
        for one in study.material.gains:
            assert not one.refused, one.words
            lines += cli_lines(one.parameters)
    return lines


def numbers(found: Acceptance, axis: str) -> dict[str, float]:
    words = next((line.found for line in found.lines if line.what == f"{axis}: rate loop"), "")
    return {what: float(hit[1]) for what, (form, *_) in BETTER.items() if (hit := re.search(form, words))}


@pytest.mark.parametrize("name", ["x8", "crazyflie"])
def test_gains_from_a_log_of_the_defaults_fly_better(name: str, tmp_path: Path) -> None:
    place = Path(os.environ.get("SWASHPLATE_PROOF", str(tmp_path))) / "firmware"
    stock, dump = tmp_path / "stock.txt", tmp_path / "gains.txt"
    stock.write_text("# as the firmware comes\n", encoding="utf-8")

    def fly(settings: Path, folder: str) -> Acceptance:
        return sp.accept_autopilot(
            name, Path(BINARY), folder=place / folder, timeout=60.0, band=WIDE, defaults=[settings]
        )

    before = fly(stock, f"{name}-stock")
    assert before.log is not None
    swept = [axis for axis in AXES if any(line.what == f"{axis}: coherent" and line.passed for line in before.lines)]
    lines = suggested_lines(sp.read(before.log), swept)
    dump.write_text("\n".join([*lines, "save"]) + "\n", encoding="utf-8")
    after = fly(dump, f"{name}-suggested")
    rows: list[list[str | float]] = []
    verdicts = {}
    for axis in swept:
        first, then = numbers(before, axis), numbers(after, axis)
        for what, (_, sign, promised) in BETTER.items():
            if what in first and what in then:
                word = "better" if sign * (then[what] - first[what]) > 0.0 else "worse"
                if word == "worse" and promised is not None and sign * (then[what] - promised) >= 0.0:
                    word = f"spent, {promised:g} is promised"
                verdicts[f"{axis}: {what}"] = word
                rows.append([f"{axis}: {what}", first[what], then[what], word])
    fell = "; ".join(line.found for line in before.lines if line.what == "flight")
    proof_page.leave(
        f"firmware-gains-{name}",
        {
            "title": f"Gains from a log of Betaflight's defaults, flown by {name}",
            "text": "The firmware's own gains fly sweeps of 0.5 to 20 Hz, their log gives gains (`fit_tf`), "
            "and these fly the same. Read off each log by itself: degrees, a ratio, rad/s, % of the demanded rate."
            f"{f' With the defaults: {fell}' if fell else ''} Loaded: `{'`, `'.join(lines)}`.",
            "columns": ["what", "defaults", "suggested", ""],
            "rows": rows,
            "passed": after.passed and "worse" not in verdicts.values(),
        },
    )
    assert after.problems == ()
    assert "worse" not in verdicts.values(), verdicts
    assert sum(word == "better" for word in verdicts.values()) >= 2 * len(swept) > 0
