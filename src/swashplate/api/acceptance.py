"""`Acceptance`: what a trial of an autopilot's binary found, line by line with a verdict, as text, JSON and a page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from swashplate import atomic
from swashplate.api.truth_beside import TruthBeside, at_three
from swashplate.links.ardupilot.trial import TrialLine
from swashplate.reporting.case_parts import bode_overlay
from swashplate.reporting.html import write_page
from swashplate.reporting.sections_responses import parameter_table
from swashplate.reporting.structure import Block, Cell, Points, Report, Section, Table
from swashplate.shown import Shown
from swashplate.text_table import text_table

ACCEPTANCE_FILES = ("report.html", "acceptance.json")
"""What `save` writes."""


@dataclass(frozen=True, repr=False)
class Acceptance(Shown):
    """A trial of a SITL binary.

    Attributes:
        binary: that was tried. version: as it says. vehicle: that it flew.
        command: how it was started.
        lines: what was looked at, in order.
        truth: estimates beside the vehicle's own linearisation; None where it came to no log.
        log: the DataFlash log; None where there is none.
        folder: where the binary ran.
        real_time: simulated seconds a second.
    """

    binary: str
    version: str
    vehicle: str
    command: tuple[str, ...]
    lines: tuple[TrialLine, ...]
    truth: TruthBeside | None
    log: Path | None
    folder: Path
    real_time: float

    @property
    def problems(self) -> tuple[str, ...]:
        """Lines that did not pass; empty where it is accepted."""
        return tuple(
            f"{line.what}: {line.found}{f' (expected {line.expected})' if line.expected else ''}."
            for line in self.lines
            if line.passed is False
        )

    @property
    def passed(self) -> bool:
        """Whether every line that is judged passed."""
        return not self.problems

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        beside = {}
        if self.truth is not None:
            beside = {
                f"{output}/{input}": [
                    {"frequency_hz": f, **{name: {"gain_db": g, "phase_deg": p} for name, (g, p) in values.items()}}
                    for f, values in at_three(curves)
                ]
                for (output, input), curves in self.truth.curves.items()
            }
        return {
            "binary": self.binary,
            "version": self.version,
            "vehicle": self.vehicle,
            "command": list(self.command),
            "passed": self.passed,
            "lines": [line._asdict() for line in self.lines],
            "truth_beside_estimate": beside,
            "models": [] if self.truth is None else self.truth.models,
            "structures": {
                axes: {each.name: [each.value, each.sigma, each.unit] for each in estimates}
                for axes, estimates in ({} if self.truth is None else self.truth.structures).items()
            },
            "remarks": [] if self.truth is None else self.truth.remarks,
            "log": None if self.log is None else str(self.log),
            "real_time": self.real_time,
            "problems": list(self.problems),
        }

    def save(self, folder: str | Path) -> Path:
        """Write report.html and acceptance.json into a folder, which may be the one where the binary ran."""
        place = atomic.make_folder(Path(folder))
        write_page(place / ACCEPTANCE_FILES[0], self.page())
        atomic.write_json(place / ACCEPTANCE_FILES[1], self.to_document())
        return place

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        tone, word = ("good", "Accepted") if self.passed else ("bad", "Not accepted")
        judged = [line for line in self.lines if line.passed is not None]
        failed = [line.what for line in judged if line.passed is False]
        rows = tuple(
            (Cell(line.what), Cell(line.found), Cell(line.expected), Cell(*_said(line.passed))) for line in self.lines
        )
        steps = Table("Every step and its verdict", ("what", "found", "expected", "verdict"), rows)
        sections = [Section("steps", "Steps", (steps,))]
        if self.truth is not None and self.truth.curves:
            blocks: tuple[Block, ...] = (
                _beside(self.truth.curves),
                bode_overlay(self.truth.curves, whose="Truth and estimates"),
            )
            sections.append(Section("truth", "Truth beside estimate", blocks))
            models: list[Block] = [Points(tuple(self.truth.models))]
            for axes, estimates in self.truth.structures.items():
                models.append(replace(parameter_table(estimates), caption=f"Parameters of {axes} by fit-ss"))
            sections.append(Section("models", "Models that were fitted", tuple(models), folded=True))
            if self.truth.remarks:
                remarks = (Points(tuple(dict.fromkeys(self.truth.remarks))),)
                sections.append(Section("remarks", "What the estimates warn of", remarks, folded=True))
        command = Points((" ".join(self.command), f"run in {self.folder}", f"log: {self.log or 'none'}"))
        sections.append(Section("command", "How it was started", (command,), folded=True))
        return Report(
            title=title or f"Acceptance of {Path(self.binary).name} with {self.vehicle}",
            banners=((tone, f"{word}: {len(judged) - len(failed)} of {len(judged)} lines pass."),),
            summary=(
                ("Binary", f"{self.binary}, {self.version}", "plain"),
                ("Vehicle", self.vehicle, "plain"),
                ("Verdict", f"{word}; {len(failed)} of {len(judged)} lines fail", tone),
                *((("Fails", "; ".join(failed), tone),) if failed else ()),
                ("Speed", f"{self.real_time:.1f} times real time", "plain"),
            ),
            picture=None,
            sections=tuple(sections),
        )

    def __repr__(self) -> str:
        rows = [(_said(line.passed)[0], line.what, line.found, line.expected) for line in self.lines]
        head = f"{self.binary}, {self.version}, with {self.vehicle}: {'pass' if self.passed else 'FAIL'}"
        parts = [head, text_table(("verdict", "what", "found", "expected"), rows, left=(0, 1, 2, 3))]
        if self.truth is not None and self.truth.curves:
            table = _beside(self.truth.curves)
            body = [[cell.words for cell in row] for row in table.rows]
            parts.append(f"{table.caption}\n{text_table(table.columns, body)}")
        parts.append(f"{self.real_time:.1f} times real time; log: {self.log or 'none'}")
        return "\n\n".join(parts)


def _said(passed: bool | None) -> tuple[str, bool, str]:
    """Word, whether it is a number, and tone of a verdict's cell."""
    return {True: ("pass", False, "good"), False: ("FAIL", False, "bad"), None: ("not judged", False, "quiet")}[passed]


def _beside(pairs: Mapping[tuple[str, str], Mapping[str, Any]]) -> Table:
    names = list(dict.fromkeys(name for curves in pairs.values() for name in curves))
    rows = []
    for (output, input), curves in pairs.items():
        for frequency, values in at_three(curves):
            cells = [_polar(values.get(name)) for name in names]
            rows.append((Cell(f"{output} / {input}"), Cell(f"{frequency:.2f}", number=True), *cells))
    columns = ("response", "Hz", *(f"{name} [dB, deg]" for name in names))
    return Table(
        "Gain and phase of rates [rad/s] and specific force [m/s²] per unit of the mixer's command",
        columns,
        tuple(rows),
    )


def _polar(value: tuple[float, float] | None) -> Cell:
    if value is None or value[0] != value[0]:
        return Cell("-", number=True)
    return Cell(f"{value[0]:.2f}, {value[1]:.1f}", number=True)
