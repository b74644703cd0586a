"""What trims, derivatives and linear models show of themselves."""

from __future__ import annotations

from swashplate.reporting.figures_fit import eigenvalues
from swashplate.reporting.speed_page import by_contributor, controls
from swashplate.reporting.structure import Block, Section, Text, tabulate
from swashplate.simulation.derivatives_over_speed import Derivatives
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.trim_curve import TrimCurve


def section_of_linear_model(model: LinearModel) -> Section:
    """Its modes, and itself in words."""
    return Section("modes", "Linear model", (eigenvalues({"model": model.modes()}), Text(repr(model))))


def section_of_trims(curve: TrimCurve) -> Section:
    """Controls over speed, and the trims as a table."""
    columns = curve.columns()
    rows = tuple(tuple(f"{v:.3f}" for v in row) for row in zip(*columns.values(), strict=True))
    remarks: tuple[Block, ...] = tuple(Text(text, tone="caution") for text in curve.remarks)
    title = f"Trims of {curve.vehicle.card.title}"
    return Section("trims", title, (*remarks, controls(curve), tabulate("Trims", columns, rows)))


def section_of_derivatives(derivatives: Derivatives, row: str = "M") -> Section:
    """What each part of the vehicle contributes, the wanted row first, and the table."""
    head, rows = derivatives.rows(derivatives.tables[0])
    title = f"Derivatives of {derivatives.vehicle.card.title} at {derivatives.trims[0].speed:g} m/s"
    table = tabulate("Derivatives", head, rows)
    others = tuple(by_contributor(derivatives, other) for other in "XYZLMN" if other != row)
    return Section("derivatives", title, (by_contributor(derivatives, row), *others, table))
