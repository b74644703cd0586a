"""Options of the main rotor against published derivatives: why they are off on the packaged cards."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.oracle.test_helicopter_published import AIR, AT_SPEED, KNOT, ROTOR, lynx_published

from swashplate.models.catalogue import vehicle
from swashplate.simulation.derivatives import derivative_table
from swashplate.simulation.trim import trim

pytestmark = pytest.mark.proof


def found(name: str, knots: int, options: dict[str, Any]) -> dict[str, float]:
    flown = vehicle(name, **options)
    card = flown.card.values()
    inertia = {f"inertia_{axis}": card[f"inertia_{axis}"] for axis in ("xx", "zz", "xz")}
    table = derivative_table(flown, trim(flown, environment=AIR, speed=knots * KNOT))
    primed = table.primed(**inertia)
    return {each: primed[each] for each in {*ROTOR.split(), *AT_SPEED.split()}}


@pytest.mark.parametrize(
    ("options", "hover", "fast"),
    [({}, 0.6, 2.1), ({"tip_loss": True}, 11.6, 14.0), ({"induced_factor": True}, 0.6, 2.2)],
)
def test_lynx(options: dict[str, Any], hover: float, fast: float) -> None:
    """Root mean square of the relative differences [%] over the main rotor's derivatives."""
    for knots, names, expected in ((0, ROTOR, hover), (60, AT_SPEED, fast)):
        ours, published = found("lynx", knots, options), lynx_published(knots)
        away = [ours[each] / published[each] - 1.0 for each in names.split() if published[each]]
        assert 100.0 * np.sqrt(np.mean(np.square(away))) == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize(
    ("options", "Xu", "Zw"),
    [({}, 0.904, 0.73), ({"tip_loss": True}, 0.939, 0.686), ({"induced_factor": True}, 0.904, 0.73)],
)
def test_r50(options: dict[str, Any], Xu: float, Zw: float, shared_data: Path) -> None:
    """Shares of Mettler's identified hover."""
    with (shared_data / "vehicles" / "derivs_mettler_r50.csv").open(encoding="utf-8") as lines:
        identified = {row["param"]: float(row["hover_SI"]) for row in csv.DictReader(lines)}
    ours = found("r50", 0, options)
    assert ours["Xu"] / identified["Xu"] == pytest.approx(Xu, abs=0.01)
    assert ours["Zw"] / identified["Zw"] == pytest.approx(Zw, abs=0.01)
