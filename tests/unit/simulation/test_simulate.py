"""The compiled loop: order of accuracy, repeatability, batches, divergence, bad input."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from swashplate.api.simulate_batch import simulate_batch
from swashplate.arrays import Array
from swashplate.engine import fly as engine_fly
from swashplate.engine.equations import Equations, equations_of
from swashplate.errors import DivergenceError, FlightError, SwashError, TrimError
from swashplate.flights.flight import Flight
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.sensors import Sensors
from swashplate.simulation.trim import trim


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return vehicle("coax")


def excited(coax: Vehicle, samples: int, rate: float = 100.0) -> dict[str, object]:
    """Hover inputs with smooth servo and voltage changes."""
    time = np.arange(samples) / rate
    moving = {"servo_pitch": 0.1 * np.sin(3.0 * time), "servo_roll": 0.05 * np.cos(2.0 * time)}
    return {**trim(coax).commands(), **moving, "voltage": 12.22 - 0.02 * time, "wind_north": 0.3 * np.sin(time)}


def fly_by_scipy(
    vehicle: Vehicle, inputs: dict[str, object], start: dict[str, float], *, rate: float, held: bool
) -> Array:
    """The states (samples, states) by another program: SciPy's method of order 8 on the equations as they stand."""
    given = {name: np.asarray(values, dtype=float) for name, values in inputs.items()}
    n = max(values.size for values in given.values())
    names = (*vehicle.input_names, "wind_north", "voltage")
    rows = np.stack([np.broadcast_to(given[name], n) for name in names], axis=1)
    par, xp, count = vehicle.values(), FloatBackend(), len(vehicle.input_names)
    states = [np.array([start[name] for name in vehicle.state_names])]
    for now, after in pairwise(rows):

        def rates(t: float, x: Array, now: Array = now, after: Array = after) -> Array:
            row = (now if held else now + t * rate * (after - now)).tolist()
            air = Environment(wind_north=row[count], voltage=row[count + 1])
            return np.array(vehicle.rates(x.tolist(), row[:count], par, air, xp))

        states.append(solve_ivp(rates, (0.0, 1.0 / rate), states[-1], method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1])
    return np.array(states)


def largest_difference(a: Flight, b: Flight, names: tuple[str, ...]) -> float:
    return float(np.max(np.abs(a.array(names) - b.array(names))))


def test_hover_stays_where_it_is(coax: Vehicle) -> None:
    flight = simulate_open_loop(coax, {**trim(coax).commands(), "servo_roll": np.zeros(201)})
    assert flight.provenance.simulated
    assert largest_difference(flight, flight.between(0.0, 0.0).with_streams(flight.streams), coax.state_names) == 0.0
    moved = flight.array(coax.state_names) - trim(coax).state
    assert np.max(np.abs(moved)) < 1e-9


@pytest.mark.proof
@pytest.mark.parametrize("interpolation", ["held", "linear"])
def test_the_fixed_step_converges_with_order_four(coax: Vehicle, interpolation: str) -> None:
    """Against Dormand-Prince of order 8: halving the step divides the error by 16.

    Without terms such as p |p|, whose second derivative jumps at zero: no method keeps its order across that.
    """
    rough = [name for name in coax.parameter_names if name.startswith(("a_alpha", "a_beta", "drag"))]
    smooth = coax.with_values(dict.fromkeys(rough, 0.0))
    inputs = excited(coax, 16, rate=20.0)
    how: dict[str, Any] = {"rate": 20.0, "interpolation": interpolation}
    start = {**trim(coax).states(), "p": 0.5, "q": -0.3, "r": 0.2, "u": 0.7, "phi": 0.1}
    truth = fly_by_scipy(smooth, inputs, start, rate=20.0, held=interpolation == "held")
    errors = [
        np.max(
            np.abs(simulate_open_loop(smooth, inputs, start=start, **how, substeps=n).array(coax.state_names) - truth)
        )
        for n in (4, 8, 16)
    ]
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / np.array(errors[1:])), 4.0, atol=0.2)


@pytest.mark.parametrize("interpolation", ["held", "linear"])
def test_the_usual_step_is_accurate(coax: Vehicle, interpolation: str) -> None:
    """10 ms with the card's own non-smooth terms: far below what a motion-capture system resolves."""
    inputs = excited(coax, 51)
    truth = fly_by_scipy(coax, inputs, trim(coax).states(), rate=100.0, held=interpolation == "held")
    flight = simulate_open_loop(coax, inputs, start=trim(coax), interpolation=interpolation)
    found = dict(zip(coax.state_names, truth[-1], strict=True))
    for names, most in ((("x", "y", "z"), 1e-6), (("phi", "theta", "psi", "p", "q", "r"), 1e-5)):
        assert max(abs(flight.values(name)[50] - found[name]) for name in names) < most
    assert abs(found["q"]) > 0.01


def test_the_same_call_gives_the_same_bits(coax: Vehicle) -> None:
    inputs = excited(coax, 201)
    first, second = (simulate_open_loop(coax, inputs, sensors=Sensors(), seed=3) for _ in range(2))
    other = simulate_open_loop(coax, inputs, sensors=Sensors(), seed=4)
    np.testing.assert_array_equal(first.values("x"), second.values("x"))
    assert not np.array_equal(first.values("x")[:50], other.values("x")[:50])
    with pytest.raises(SwashError, match="need a seed"):
        simulate_open_loop(coax, inputs, sensors=Sensors())


@pytest.mark.parametrize("interpolation", ["held", "linear"])
def test_single_and_batched_flights_agree(coax: Vehicle, interpolation: str) -> None:
    """To 1e-11 of each state's largest value, over two seconds and with other masses and starts."""
    inputs, masses, rolls = excited(coax, 201), np.array([0.302, 0.31, 0.333]), np.array([0.0, 0.1, -0.1])
    varied = {"parameters": {"mass": masses}, "start": {"phi": rolls}}
    batch = simulate_batch(coax, inputs, **varied, interpolation=interpolation)
    for i in range(3):
        start = {"phi": float(rolls[i])}
        hover = {name: value for name, value in trim(coax).states().items() if name != "phi"}
        single = simulate_open_loop(
            coax.with_values({"mass": masses[i]}), inputs, start={**hover, **start}, interpolation=interpolation
        )
        scale = np.maximum(np.abs(single.array(coax.state_names)).max(axis=0), 1.0)
        apart = np.abs(batch.flight(i).array(coax.state_names) - single.array(coax.state_names)) / scale
        assert apart.max() < 1e-11


def test_single_precision_is_near(coax: Vehicle) -> None:
    inputs, masses = excited(coax, 201), {"mass": np.array([0.302, 0.31, 0.333])}
    double, single = (
        simulate_batch(coax, inputs, parameters=masses, precision=kind) for kind in ("float64", "float32")
    )
    assert single.states.dtype == np.float32
    assert 0.0 < np.max(np.abs(double["theta"] - single["theta"])[:101]) < 1e-5


def test_another_card_compiles_nothing(coax: Vehicle, monkeypatch: pytest.MonkeyPatch) -> None:
    inputs = excited(coax, 201)
    simulate_open_loop(coax, inputs)
    asked: list[Equations] = []
    flight_code = engine_fly.flight_code
    monkeypatch.setattr(engine_fly, "flight_code", lambda e, *a, **k: (asked.append(e), flight_code(e, *a, **k))[1])
    simulate_open_loop(vehicle("coax").with_values({"mass": 0.333}), inputs)
    assert not asked
    engine_fly._open_program.cache_clear()
    simulate_open_loop(vehicle("coax", mixing="as_printed"), inputs)
    assert asked
    assert equations_of(vehicle("coax", mixing="as_printed")) != equations_of(coax)


def test_a_flight_drives_its_own_simulation(coax: Vehicle) -> None:
    """What `simulate` returns is a flight like any other: its inputs give it again, also from other rates."""
    flight = simulate_open_loop(coax, excited(coax, 201))
    again = simulate_open_loop(coax, flight)
    assert largest_difference(flight, again, coax.state_names) == 0.0
    assert simulate_open_loop(coax, flight, rate=125.0).values("x").size == 251


def test_wind_carries_a_trimmed_vehicle(coax: Vehicle) -> None:
    """Hover in 1 m/s of wind is forward flight at 1 m/s in calm air."""
    windy = trim(coax, environment=Environment(wind_north=-1.0))
    calm = trim(coax, speed=1.0)
    assert windy.commands() == pytest.approx(calm.commands(), abs=1e-10)
    assert windy.states()["u"] == pytest.approx(0.0, abs=1e-12)


def test_divergence_says_when_and_what(coax: Vehicle) -> None:
    inputs = {**trim(coax).commands(), "servo_pitch": np.full(201, 1.0)}
    with pytest.raises(DivergenceError, match="left the flyable range after") as caught:
        simulate_open_loop(coax, {**inputs, "motor_upper": 1.0})
    assert caught.value.state in coax.state_names
    assert isinstance(caught.value.flight, Flight)
    assert caught.value.flight.stop == pytest.approx(caught.value.time)
    assert np.all(np.isfinite(caught.value.flight.array(("phi", "theta", "p", "q", "r"))))


def test_bad_input_is_named(coax: Vehicle) -> None:
    good = excited(coax, 21)
    with pytest.raises(FlightError, match="motor_upper: is missing"):
        simulate_open_loop(coax, {name: value for name, value in good.items() if name != "motor_upper"})
    with pytest.raises(FlightError, match="rudder: is not an input"):
        simulate_open_loop(coax, {**good, "rudder": 0.0})
    with pytest.raises(FlightError, match="servo_roll: is not a number at sample 4"):
        simulate_open_loop(coax, {**good, "servo_roll": np.where(np.arange(21) == 4, np.nan, 0.0)})
    with pytest.raises(FlightError, match="servo_roll: has 20 samples, others have 21"):
        simulate_open_loop(coax, {**good, "servo_roll": np.zeros(20)})
    with pytest.raises(TrimError, match="roll: is not a state"):
        simulate_open_loop(coax, good, start={"roll": 1.0})
    with pytest.raises(SwashError, match="rate is 0"):
        simulate_open_loop(coax, good, rate=0.0)
    with pytest.raises(FlightError, match="expected \\(n, 4\\)"):
        simulate_open_loop(coax, np.zeros((10, 3)))
    with pytest.raises(SwashError, match="number of vehicles is not given"):
        simulate_batch(coax, good)
