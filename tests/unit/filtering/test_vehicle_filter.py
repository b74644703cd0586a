"""The filter of any vehicle's equations: C, the virtual machine and differences say the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import swashplate as sp
from hfb320 import AIR, OUTPUTS, hfb320
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.filtering import vehicle_filter
from swashplate.filtering.vehicle_filter import Ran, VehicleFilter
from swashplate.models.nesting import leaves
from swashplate.models.surroundings import environment_of


def case(name: str) -> tuple[sp.Vehicle, tuple[str, ...], Any]:
    if name == "hfb320":
        return hfb320(), OUTPUTS, AIR
    vehicle = sp.vehicle(name)  # its rates have roots
    return vehicle, ("u", "p", "pdot", "az"), environment_of(vehicle, None)


def ran(name: str, step: float = 0.0) -> Ran:
    """Twenty samples, along two directions where nothing is moved, otherwise with the first moved by so much."""
    vehicle, outputs, around = case(name)
    random = np.random.default_rng(0)
    n, m, n_t = len(vehicle.state_names), len(outputs), 20
    p, x = parameter_row(vehicle, around), np.array([*leaves(vehicle.state)], dtype=float)
    middle = np.array([sum(limits) / 2.0 for limits in vehicle.input_limits])
    air = [0.0, 0.0, 0.0, around.voltage or 0.0]
    rows = np.array([[*(middle + 0.01 * random.standard_normal(middle.size)), *air] for _ in range(n_t)])
    gain, rest = 1e-3 * random.standard_normal(n * m), 0.01 * random.standard_normal(n + m)
    numbers = np.concatenate([p, rest, gain])
    readings = 0.1 * random.standard_normal((n_t, m))
    starts = np.vstack([x, 1e-2 * random.standard_normal((2, n))])
    table = np.vstack([numbers, 1e-3 * random.standard_normal((2, numbers.size)) * np.maximum(np.abs(numbers), 0.01)])
    made = VehicleFilter(equations_of(vehicle), outputs, 0.01)
    if step:
        starts, table = (part[:1] + step * part[1:2] for part in (starts, table))
    return made.run(starts, table, rows, readings)


@pytest.mark.parametrize("name", ["hfb320", "raptor50"])
def test_the_slopes_are_those_of_the_run(name: str) -> None:
    found, h = ran(name), 1e-5
    high, low = ran(name, step=h), ran(name, step=-h)
    for slopes, above, below in (
        (found.errors_moved[0], high.errors, low.errors),
        (found.states_moved[0], high.states, low.states),
    ):
        size = np.max(np.abs(slopes), axis=0)
        assert np.all(np.abs(slopes - (above - below) / (2.0 * h)) <= 1e-5 * size + 1e-9)


@pytest.mark.parametrize("name", ["hfb320", "raptor50"])
def test_the_virtual_machine_says_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = ran(name)
    monkeypatch.setattr(vehicle_filter, "can_compile", lambda: False)
    virtual = ran(name)
    for part in ("errors", "states", "errors_moved", "states_moved"):
        one, other = getattr(compiled, part), getattr(virtual, part)
        assert np.max(np.abs(one - other)) <= 1e-11 * np.max(np.abs(one)), part
