"""What docs/real-flights.md says, read back for README and the pages that quote it: no number is typed twice."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swashplate.validation.validation import AxisVerdict

PAGE = Path(__file__).resolve().parents[2] / "docs" / "real-flights.md"
_DIRECTION = re.compile(r"^## (Learnt in \w+, predicting \w+)$", re.MULTILINE)
_VERDICT = re.compile(r"^\* (\w+): \*\*(.+?)\*\*\. (.+)$", re.MULTILINE)
_NUMBERS = re.compile(r"^(.+?) at ([\d.]+) s\.")


def directions(page: str) -> dict[str, list[AxisVerdict]]:
    """The verdicts of each direction, as `docs/site/real_flights.py` wrote them.

    Raises:
        ValueError: where the page no longer has the form that is read here.
    """
    from swashplate.validation.validation import AxisVerdict  # loads JAX: only where the verdicts are asked for
    from swashplate.validation.verdict import LEVELS

    parts = _DIRECTION.split(page)
    judgements = {
        title: [AxisVerdict(*match.groups()) for match in _VERDICT.finditer(body)]
        for title, body in zip(parts[1::2], parts[2::2], strict=True)
    }
    verdicts = [verdict for judged in judgements.values() for verdict in judged]
    if len(judgements) != 2 or not all(judgements.values()) or any(v.level not in LEVELS for v in verdicts):
        raise ValueError(f"{PAGE.name}: two directions with verdicts of {LEVELS} are expected, found {judgements}")
    return judgements


def trusted_text() -> str:
    """Both directions in the verdict's words, a line each."""
    from swashplate.validation.verdict import in_brief

    return "\n".join(
        f"* {title}: {in_brief(judged)}." for title, judged in directions(PAGE.read_text(encoding="utf-8")).items()
    )


def results_text() -> str:
    """Every axis in both directions: fit of the model, best rival, verdict."""
    judgements = directions(PAGE.read_text(encoding="utf-8"))
    rows = [f"| axis | {' | | '.join(judgements)} | |", "|" + " --- |" * 5]
    for axes in zip(*judgements.values(), strict=True):
        cells = [cell for verdict in axes for cell in (_numbers(verdict), f"**{verdict.level}**")]
        rows.append(f"| {axes[0].axis} | {' | '.join(cells)} |")
    return "\n".join(rows)


CLAIMS = {10: ("roll", "pitch", "horizontal"), 11: ("yaw", "heave")}
"""Axes on which docs/papers/coax.md judges the paper's Figs 8 and 9."""


def flights_claims_text() -> str:
    """Whether the real flights bear out what the CoaX's paper says of its Figs 8 and 9, by the axes' verdicts."""
    judged = [v for verdicts in directions(PAGE.read_text(encoding="utf-8")).values() for v in verdicts]
    lines = []
    for number, axes in CLAIMS.items():
        good = [v.level in ("good", "usable") for v in judged if v.axis in axes]
        lines.append(f"claim {number}: {'holds' if all(good) else 'holds in part' if any(good) else 'does not hold'}")
    return "```text\n" + "\n".join(lines) + "\n```"


def _numbers(verdict: AxisVerdict) -> str:
    match = _NUMBERS.match(verdict.words)
    if match is None:
        raise ValueError(f"{PAGE.name}: the verdict on {verdict.axis} does not begin with its numbers: {verdict.words}")
    return f"{match[1].replace('best rival ', '')} at {match[2]} s"
