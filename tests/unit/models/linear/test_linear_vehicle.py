"""A state-space file as a vehicle: equations and accelerometers are the file's, its delays go into the design."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from swashplate.control.kinds import load_controller, save_controller
from swashplate.control.lqg.analysis import analyse
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.design import design
from swashplate.control.lqg.kind import about, flown_on
from swashplate.errors import CardError, ControllerError, TrimError
from swashplate.export.linear import logged_delays, of_vehicle
from swashplate.filtering.sensor_suite import suite
from swashplate.models.linear.card_vehicle import linear
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse, structure, to_toml
from swashplate.models.nesting import rebuild
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import trim

AROUND = Environment(gravity=9.80665)


@pytest.fixture(scope="module")
def model() -> StateSpaceModel:
    return structure("thirteen_state")


@pytest.fixture(scope="module")
def flying(model: StateSpaceModel) -> Vehicle:
    return linear_vehicle(model)


def test_its_rates_and_accelerometers_are_the_files(model: StateSpaceModel, flying: Vehicle) -> None:
    random = np.random.default_rng(0)
    x, u = 0.1 * random.standard_normal(len(flying.state_names)), 0.1 * random.standard_normal(4)
    here = dict(zip(flying.state_names, x.tolist(), strict=True))
    A, B, C, D = model.explicit()
    own = np.array([here[name] for name in model.states])
    rates = dict(
        zip(
            flying.state_names,
            flying.rates(x.tolist(), u.tolist(), flying.values(), AROUND, FloatBackend()),
            strict=True,
        )
    )
    np.testing.assert_allclose([rates[name] for name in model.states], A @ own + B @ u, rtol=1e-12, atol=1e-13)
    force = flying.specific_force(
        rebuild(flying.state, x.tolist()), flying.inputs(*u.tolist()), flying.values(), AROUND, FloatBackend()
    )
    shown = dict(zip(model.outputs, C @ own + D @ u, strict=True))
    np.testing.assert_allclose(force, [shown["ax"], shown["ay"], shown["az"] - 9.80665], rtol=1e-12, atol=1e-12)


def test_its_linearisation_is_the_file_and_the_kinematics(model: StateSpaceModel, flying: Vehicle) -> None:
    hover = trim(flying)
    np.testing.assert_array_equal(hover.inputs, 0.0)
    found = linearize(flying, hover)
    rows = [found.states.index(name) for name in model.states]
    A, B, _, _ = model.explicit()
    np.testing.assert_allclose(found.A[np.ix_(rows, rows)], A, atol=1e-12)
    np.testing.assert_allclose(found.B[rows], B, atol=1e-12)
    for state, rate in (("x", "u"), ("y", "v"), ("z", "w"), ("psi", "r")):
        row = found.A[found.states.index(state)]
        assert row[found.states.index(rate)] == 1.0
        assert np.count_nonzero(row) == 1


def test_about_a_trim_it_rests_there(flying: Vehicle) -> None:
    hover = trim(flying)
    moved = hover.__class__(**{**vars(hover), "inputs": np.array([0.1, -0.2, 0.05, 0.3]), "state": hover.state + 0.0})
    there = about(flying, moved)
    rates = there.rates(moved.state.tolist(), moved.inputs.tolist(), there.values(), AROUND, FloatBackend())
    np.testing.assert_allclose(rates, 0.0, atol=1e-15)


def test_the_design_takes_the_identified_delays_and_holds_the_model(flying: Vehicle, tmp_path: Path) -> None:
    assert input_delays(flying) == dict.fromkeys(flying.input_names, 0.02)
    made = design(flying, sensors=suite("gyro@100,mocap@50+20ms"))
    assert made.plan.delays == (2, 2, 2, 2)
    found = analyse(made)
    assert found.margins.together.alpha > 0.4
    assert found.modes[0].real < -0.02
    save_controller(made, tmp_path / "c.toml")
    again = load_controller(tmp_path / "c.toml")
    assert isinstance(again, Lqg)
    for part, same in zip(again.feedback, made.feedback, strict=True):
        np.testing.assert_array_equal(part, same)
    fed = design(flying, allowed={"x": 0.3, "y": 0.3})  # as tightly as delays let it the step costs 22 mm of height
    flight = simulate_closed_loop(flying, fed, duration=8.0, reference={"x": 0.5}, rate=100.0)
    assert flight.values("x")[-1] == pytest.approx(0.5, abs=0.05)
    assert np.max(np.abs(flight.values("z"))) < 0.02
    with pytest.raises(ControllerError, match="is fed with the linear model's states"):
        flown_on(fed, flying, trim(flying))


def test_limits_are_the_files(model: StateSpaceModel) -> None:
    text = to_toml(model) + "\n[limits]\npedal = [-0.5, 0.25]\n"
    named = linear_vehicle(parse(text))
    assert dict(zip(named.input_names, named.input_limits, strict=True))["pedal"] == (-0.5, 0.25)
    assert named.input_limits[0] == (-1.0, 1.0)
    with pytest.raises(CardError, match=r"limits.pedal: is \[1.0\], expected \[low, high\]"):
        parse(text.replace("[-0.5, 0.25]", "[1.0]"))
    with pytest.raises(CardError, match="expected a range about the trim"):
        linear_vehicle(parse(text.replace("-0.5, 0.25", "0.5, 1.0")))


def test_a_state_that_is_an_input_too_is_refused(model: StateSpaceModel) -> None:
    card = linear_vehicle(model).card
    inputs = [card.options["states"][0], *card.options["inputs"][1:]]
    with pytest.raises(CardError, match="more than once"):
        linear(replace(card, options={**card.options, "inputs": inputs}))


def test_a_model_that_is_not_enough_to_fly_is_named() -> None:
    with pytest.raises(TrimError, match=r"has no equation for u, v, phi, theta, p, q, r: that is not enough to fly"):
        trim(linear_vehicle(structure("heave")))
    text = to_toml(structure("six_dof")).replace("[delays]", '[delays]\n"p/lateral" = "0.3"\n"q/lateral" = "0.1"')
    assert "p/lateral" in text
    with pytest.raises(CardError, match=r"p/lateral 0.3 s.*expected one delay of each input"):
        input_delays(linear_vehicle(parse(text)))


def raptor_file(raptor: Vehicle) -> StateSpaceModel:
    """The 13 states of a nonlinear helicopter about hover as a state-space file, 20 ms late."""
    import tomli_w

    found = linearize(raptor, trim(raptor))
    kept = [name for name in found.states if name not in ("x", "y", "z", "psi")]
    rows = [found.states.index(name) for name in kept]
    table = np.hstack([found.A[np.ix_(rows, rows)], found.B[rows]])
    columns = (*kept, *found.inputs)
    values = {
        f"{row}_{column}": float(table[i, j])
        for i, row in enumerate(kept)
        for j, column in enumerate(columns)
        if abs(table[i, j]) > 1e-12
    }
    units = dict(zip(raptor.state_names, raptor.state_units, strict=True))
    equations = {row: {c: f"{row}_{c}" for c in columns if f"{row}_{c}" in values} for row in kept}
    document = {
        "kind": "state-space",
        "name": "raptor",
        "states": {name: units[name] for name in kept},
        "inputs": dict.fromkeys(found.inputs, "rad"),
        "equations": equations,
        "outputs": {name: {"unit": "rad/s", "of": {name: "1"}} for name in "pqr"},
        "delays": dict.fromkeys(found.inputs, "tau"),
        "parameters": {name: {"value": value} for name, value in values.items()} | {"tau": {"value": 0.02}},
    }
    return parse(tomli_w.dumps(document))


@pytest.mark.proof
def test_a_design_on_thirteen_identified_states_holds_the_nonlinear_helicopter() -> None:
    raptor = vehicle_with_bar()
    made = design(linear_vehicle(raptor_file(raptor)), sensors=suite("gyro@100,mocap@100"))
    hover = trim(raptor)
    held = flown_on(made, raptor, hover)
    flight = simulate_closed_loop(
        raptor, held, duration=12.0, reference={"x": 1.0, "psi": 0.3}, start=hover, rate=500.0
    )
    end = flight.between(10.0, 12.0)
    assert np.max(np.abs(end.values("x") - 1.0)) < 0.05
    assert np.max(np.abs(end.values("psi") - 0.3)) < 0.03
    assert np.max(np.abs(flight.values("z"))) < 0.06  # measured 0.050; the bound of the design on its own equations


def vehicle_with_bar() -> Vehicle:
    from swashplate.models.catalogue import vehicle

    return vehicle("raptor50", bar=True, gyro=True)


def test_it_is_exported_with_the_files_units_and_delays(flying: Vehicle) -> None:
    out = of_vehicle(flying, trim(flying), name="m", delays=logged_delays(flying))
    assert {name: out.units[name] for name in flying.input_names} == dict.fromkeys(flying.input_names, "1")
    assert out.delays == dict.fromkeys(flying.input_names, 0.02)
