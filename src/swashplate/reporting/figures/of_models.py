"""What trims, derivatives and linear models show of themselves; apart from `views`, for these need JAX."""

from __future__ import annotations

from typing import Any

from swashplate.errors import SwashError
from swashplate.reporting.figures_fit import eigenvalues
from swashplate.reporting.speed_page import by_contributor, controls
from swashplate.reporting.structure import Block, Cell, Section, Table, Text
from swashplate.simulation.derivatives_over_speed import Derivatives
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.trim_curve import TrimCurve


def section_of_model(shown: Any) -> Section:
    """What a trim curve, derivatives or a linear model show.

    Raises:
        SwashError: an object that is none of them.
    """
    if isinstance(shown, TrimCurve):
        return _of_trims(shown)
    if isinstance(shown, Derivatives):
        return _of_derivatives(shown)
    if isinstance(shown, LinearModel):
        return Section("modes", "Linear model", (eigenvalues({"model": shown.modes()}), Text(repr(shown))))
    raise SwashError("shows nothing.", channel=type(shown).__name__)


def _of_trims(curve: TrimCurve) -> Section:
    columns = curve.columns()
    rows = tuple(tuple(Cell(f"{v:.3f}", number=True) for v in row) for row in zip(*columns.values(), strict=True))
    told: tuple[Block, ...] = tuple(Text(text, tone="caution") for text in curve.remarks)
    title = f"Trims of {curve.vehicle.card.title}"
    return Section("trims", title, (*told, controls(curve), Table("Trims", tuple(columns), rows)))


def _of_derivatives(found: Derivatives, row: str = "M") -> Section:
    head, rows = found.rows(found.tables[0])
    title = f"Derivatives of {found.vehicle.card.title} at {found.trims[0].speed:g} m/s"
    table = Table("Derivatives", tuple(head), tuple(tuple(Cell(cell) for cell in line) for line in rows))
    others = tuple(by_contributor(found, other) for other in "XYZLMN" if other != row)
    return Section("derivatives", title, (by_contributor(found, row), *others, table))
