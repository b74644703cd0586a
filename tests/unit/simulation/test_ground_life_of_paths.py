"""Life on the ground on the paths beside the links: exported C, which the live page flies too, and FMU.

Each is given the same rows of inputs: 120 s parked with the servos stirred at random (less in the short form), rotors
spooled up, a hop where the vehicle can without an autopilot (the coaxial), down, stopped, and all of it again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from exported import compiled
from swashplate.compiler import compiler
from swashplate.export.model_c import model_code
from swashplate.export.traced import Traced, trace_vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.standing import at_rest, standing

DT = 0.01
Flown = Callable[[Vehicle, np.ndarray, Path], np.ndarray]
"""State rows at every row of inputs, from rest."""


def schedule(made: Vehicle, parked: float) -> tuple[np.ndarray, dict[str, slice]]:
    """Rows of inputs, and where of two rounds the vehicle is parked, hops and has come to rest again."""
    low, high = np.array(made.input_limits).T
    names, random = made.input_names, np.random.default_rng(3)
    motors = [k for k, name in enumerate(names) if name.startswith(("motor", "throttle"))]
    still = np.where([name.startswith("servo") for name in names], 0.0, np.clip(0.0, low, high))
    rows, places = [], {}

    def hold(power: float, seconds: float) -> None:
        row = still.copy()
        row[motors] = power
        rows.extend([row] * round(seconds / DT))

    powers = ((0.3, 2.0), (0.6, 1.2), (0.45, 2.0)) if "motor_lower" in names else ((1.0, 12.0),)
    for round_ in (1, 2):
        begun = len(rows)
        for _ in range(round(2.0 * parked)):
            row = random.uniform(low, high)
            row[motors] = 0.0
            rows.extend([row] * round(0.5 / DT))
        places[f"parked {round_}"] = slice(begun + (len(rows) - begun) // 2, len(rows))
        begun = len(rows)
        for power, seconds in powers:
            hold(power, seconds)
        places[f"turning {round_}"] = slice(begun, len(rows))
        hold(0.0, 3.0 if len(powers) > 1 else 60.0)
        places[f"down {round_}"] = slice(len(rows) - 50, len(rows))
    return np.array(rows), places


def lives(name: str, path: Flown, folder: Path, *, parked: float) -> None:
    made = standing(sp.vehicle(name))
    inputs, places = schedule(made, parked)
    rows = path(made, inputs, folder)
    assert np.isfinite(rows).all()
    body, rotors = rows[:, :12], [k for k, each in enumerate(made.state_names) if each.startswith("omega")]
    for where, part in places.items():
        seen = body[part]
        if where.startswith("parked"):
            # A rotor runs down for minutes; so long, stirred blades rock the body by a part of a millimetre.
            still = np.ptp(rows[part][:, rotors], axis=0).max() < 1e-3 * np.abs(rows[:, rotors]).max()
            assert np.ptp(seen[:, :3], axis=0).max() < (1e-4 if still else 1e-3), f"it creeps, {where}"
            assert np.ptp(seen[:, 6:9], axis=0).max() < (1e-3 if still else 1e-2), f"it turns, {where}"
            assert still or where != "parked 1"
        if where.startswith("turning") and name == "coax":
            assert seen[0, 2] - seen[:, 2].min() > 0.05, f"it does not lift off, {where}"
        if not where.startswith("turning"):
            assert seen[:, 2] == pytest.approx(body[0, 2], abs=0.005), where
            assert np.abs(seen[:, 6:8]).max() < math.radians(2.0), where
    tilts = [k for k, each in enumerate(made.state_names) if each in ("a1", "b1", "alpha_lower", "beta_lower")]
    assert not tilts or np.abs(rows[:, tilts]).max() < math.radians(12.0)


def traced(made: Vehicle) -> Traced:
    """Starts where it stands; no trim has rotors at rest, so one is made."""
    flying = sp.vehicle(made.card.vehicle) if made.name == "coax" else made
    hover = sp.trim(flying, **({} if made.name == "coax" else {"height": 5.0}))
    parked = replace(hover, state=at_rest(made, hover.environment), inputs=np.zeros(len(made.input_names)))
    return trace_vehicle(made, parked, name="parked")


def exported_c(made: Vehicle, inputs: np.ndarray, folder: Path) -> np.ndarray:
    """Steps of 0.5 ms, as `stepping_c` takes them."""
    pytest.importorskip("casadi", reason="the extra 'model' is not installed")
    if compiler() is None:
        pytest.skip("no C compiler")
    model = traced(made)
    code = compiled(model_code(model), folder)
    start, s, p = (np.array([v.start for v in kind]) for kind in (model.states, model.surroundings, model.parameters))
    finer = np.repeat(inputs, 20, axis=0)
    return code.fly(start, np.vstack([finer, finer[-1:]]), DT / 20, s, p)[:-1:20]


def fmu(made: Vehicle, inputs: np.ndarray, folder: Path) -> np.ndarray:
    """As a simulator steps it, with the unit's own inner step."""
    pytest.importorskip("casadi", reason="the extra 'model' is not installed")
    fmpy = pytest.importorskip("fmpy")
    from swashplate.export.fmu import fmu as unit
    from swashplate.export.fmu import fmu_platform

    if compiler() is None or fmu_platform() is None:
        pytest.skip("no C compiler for FMI")
    (folder / "parked.fmu").write_bytes(unit(traced(made), version="0.1")[0])
    result: Any = fmpy.simulate_fmu(
        str(folder / "parked.fmu"),
        stop_time=(len(inputs) - 1) * DT,
        step_size=DT,
        output_interval=DT,
        output=list(made.state_names),
        input=_signals(made, inputs),
    )
    return np.stack([result[name] for name in made.state_names], axis=1)[: len(inputs)]


def _signals(made: Vehicle, inputs: np.ndarray) -> np.ndarray:
    table = np.zeros(len(inputs), dtype=[("time", float), *((name, float) for name in made.input_names)])
    table["time"] = np.arange(len(inputs)) * DT
    for k, name in enumerate(made.input_names):
        table[name] = inputs[:, k]
    return table


PATHS: dict[str, Flown] = {"C": exported_c, "FMU": fmu}


def test_a_coaxial_lives_on_the_ground(tmp_path: Path) -> None:
    """The short form: what is quick to compile."""
    lives("coax", exported_c, tmp_path, parked=4.0)


@pytest.mark.proof
@pytest.mark.parametrize("which", PATHS)
def test_a_coaxial_lives_two_minutes_on_the_ground(which: str, tmp_path: Path) -> None:
    lives("coax", PATHS[which], tmp_path, parked=120.0)


@pytest.mark.proof
@pytest.mark.parametrize("which", PATHS)
@pytest.mark.parametrize("name", ["raptor50", "helion", "xcell60"])
def test_a_helicopter_lives_two_minutes_on_the_ground(name: str, which: str, tmp_path: Path) -> None:
    lives(name, PATHS[which], tmp_path, parked=120.0)


@pytest.mark.proof
@pytest.mark.parametrize("which", PATHS)
@pytest.mark.parametrize("name", ["crazyflie", "x8", "coaxial15", "ingenuity", "lynx", "r50", "rmax"])
def test_every_other_vehicle_lives_two_minutes_on_the_ground(name: str, which: str, tmp_path: Path) -> None:
    lives(name, PATHS[which], tmp_path, parked=120.0)


def test_a_vehicle_that_sinks_into_the_ground_is_seen(tmp_path: Path) -> None:
    """What this contract is for: the same rows for the vehicle without ground."""

    def without(made: Vehicle, inputs: np.ndarray, folder: Path) -> np.ndarray:
        rows = np.zeros((len(inputs), len(made.state_names)))
        rows[:, 2] = np.cumsum(np.cumsum(np.full(len(inputs), 9.81 * DT**2)))
        return rows

    with pytest.raises(AssertionError, match="it creeps"):
        lives("coax", without, tmp_path, parked=1.0)
