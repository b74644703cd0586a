"""The multirotor against independent routes: by hand, by conservation laws, by its mirror image, by its C export."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from exported import compiled
from swashplate.compiler import compiler
from swashplate.errors import CardError
from swashplate.export.model_c import model_code
from swashplate.export.traced import trace_vehicle
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight, Provenance, stream
from swashplate.identification.core.records import POSE, Record, records
from swashplate.identification.time.beginning import FilterNumbers, begun, seen_at_start
from swashplate.models.card import Card, Parameter, packaged_cards
from swashplate.models.catalogue import from_card
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.frames import Euler, Vector, body_to_local
from swashplate.physics.inflow import momentum_inflow

XP = FloatBackend()
STATE = [0.1, -0.2, -1.0, 0.7, -0.5, 0.3, 0.2, -0.1, 0.6, 0.8, -0.6, 0.4]  # a body that moves in every way
RESISTANCE = {"battery_resistance": (0.08, "ohm"), "tau_battery": (0.05, "s"), "drive_efficiency": (0.4, "1")}

WARMING = {"o_cold": (60.0, "rad/s"), "tau_warm": (10.0, "s")}


def crazyflie(**values: float) -> Vehicle:
    return sp.vehicle("crazyflie").with_values(values)


def _with(more: dict[str, tuple[float, str]], **options: str) -> Vehicle:
    card = packaged_cards()["crazyflie"]
    added = {key: Parameter(value, unit, "test", "assumed") for key, (value, unit) in more.items()}
    return from_card(replace(card, options={**card.options, **options}, parameters={**card.parameters, **added}))


def with_resistance() -> Vehicle:
    return _with(RESISTANCE, battery="resistance")


def with_warming() -> Vehicle:
    return _with(WARMING, motors="warming")


def rates(vehicle: Vehicle, x: Any, u: Any, env: Environment | None = None) -> np.ndarray:
    return np.array(vehicle.rates(x, u, vehicle.values(), env or Environment(voltage=3.7), XP))


@pytest.mark.parametrize(("name", "voltage"), [("crazyflie", 3.7), ("x8", 22.2)])
def test_hover_by_hand_is_a_trim(name: str, voltage: float) -> None:
    vehicle = sp.vehicle(name)
    par = vehicle.values()
    states, inputs = vehicle.traits.hover(par, voltage, XP)  # type: ignore[misc]
    x = [states.get(state, 0.0) for state in vehicle.state_names]
    assert np.max(np.abs(rates(vehicle, x, inputs, Environment(voltage=voltage)))) < 1e-10
    if name == "crazyflie":  # four rotors alike: a quarter of the weight each
        omega = math.sqrt(par.mass * LABORATORY_GRAVITY / (4.0 * par.k_thrust))
        assert states["omega_1"] == pytest.approx(omega, rel=1e-12)
        assert inputs[0] == pytest.approx((omega - par.o_drive) / par.k_drive, rel=1e-12)


def test_a_rotor_that_is_weaker_turns_faster_in_hover() -> None:
    vehicle = crazyflie(gain_2=0.8)
    states, inputs = vehicle.traits.hover(vehicle.values(), 3.7, XP)  # type: ignore[misc]
    x = [states.get(state, 0.0) for state in vehicle.state_names]
    assert np.max(np.abs(rates(vehicle, x, inputs))) < 1e-10
    assert states["omega_2"] == pytest.approx(states["omega_4"] / math.sqrt(0.8), rel=1e-12)


def test_half_the_voltage_needs_twice_the_command() -> None:
    vehicle = crazyflie()
    full, half = (vehicle.traits.hover(vehicle.values(), volts, XP)[1][0] for volts in (4.0, 2.0))  # type: ignore[misc]
    assert half == pytest.approx(2.0 * full, rel=1e-12)


def test_rotors_are_slower_together_than_one_against_another() -> None:
    """With `tau_shared` what is common dies away with both time constants, differences with one."""
    vehicle = crazyflie(tau_drive=0.04, tau_shared=0.03)
    par = vehicle.values()
    command = [0.6] * 4
    steady = par.k_drive * 0.6 + par.o_drive  # at the nominal voltage
    alike, apart = np.full(4, 40.0), np.array([40.0, -40.0, 25.0, -25.0])
    for away, tau in ((alike, 0.07), (apart, 0.04)):
        found = rates(vehicle, [*[0.0] * 12, *(steady + away)], command)[12:16]
        np.testing.assert_allclose(found, -away / tau, rtol=1e-9)
    none = rates(crazyflie(tau_drive=0.04), [*[0.0] * 12, *(steady + alike)], command)[12:16]
    np.testing.assert_allclose(none, -alike / 0.04, rtol=1e-9)


def test_angular_momentum_stays_where_no_air_acts() -> None:
    """Rotors that speed up, in a tumbling body without air: what they gain the body loses, about every axis."""
    none = dict.fromkeys(("k_thrust", "k_torque", "thrust_damping", "rotor_drag", "flap_back"), 0.0)
    card = sp.vehicle("crazyflie").card
    vehicle = from_card(
        replace(card, parameters={k: replace(v, lower=None) for k, v in card.parameters.items()})
    ).with_values({"inertia_drive": 5e-7})
    vehicle = replace(vehicle, card=vehicle.card.with_values(none))
    par, u = vehicle.values(), (0.9, 0.2, 0.7, 0.1)
    senses = vehicle.card.options["senses"]

    def momentum(x: np.ndarray) -> np.ndarray:
        spin = par.inertia_drive * sum(s * omega for s, omega in zip(senses, x[12:16], strict=True))
        own = Vector(par.inertia_xx * x[9], par.inertia_yy * x[10], par.inertia_zz * x[11] + spin)
        return np.array(body_to_local(own, Euler(*x[6:9]), XP))

    x, dt = np.array([*STATE, 300.0, 900.0, 1500.0, 700.0]), 1e-3
    before = momentum(x)
    for _ in range(100):
        k1 = rates(vehicle, x, u)
        k2 = rates(vehicle, x + 0.5 * dt * k1, u)
        k3 = rates(vehicle, x + 0.5 * dt * k2, u)
        k4 = rates(vehicle, x + dt * k3, u)
        x = x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    assert np.max(np.abs(x[12:16] - (300.0, 900.0, 1500.0, 700.0))) > 300.0  # the rotors did speed up
    assert momentum(x) == pytest.approx(before, rel=1e-6)


def test_the_airs_forces_take_the_power_that_they_cost() -> None:
    """d/dt of kinetic and potential energy = thrust and drag at each rotor's own velocity, and its shaft's moments."""
    vehicle = crazyflie()
    par, env, u = vehicle.values(), Environment(voltage=3.7), (0.5, 0.6, 0.4, 0.7)
    x = np.array([*STATE, 1500.0, 1700.0, 1600.0, 1800.0])
    dx = rates(vehicle, x, u, env)
    energy = par.mass * x[3:6] @ dx[3:6] - par.mass * LABORATORY_GRAVITY * dx[2]
    energy += par.inertia_xx * x[9] * dx[9] + par.inertia_yy * x[10] * dx[10] + par.inertia_zz * x[11] * dx[11]
    expected = 0.0
    for i, (omega, sense) in enumerate(zip(x[12:16], vehicle.card.options["senses"], strict=True), start=1):
        arm = np.array([getattr(par, f"rotor_{i}_{axis}") for axis in "xyz"])
        at = x[3:6] + np.cross(x[9:12], arm)
        expected += -par.k_thrust * omega**2 * at[2] - par.thrust_damping * omega * at[2] ** 2
        expected += -par.rotor_drag * omega * (at[0] ** 2 + at[1] ** 2)
        expected += par.flap_back * omega * (x[10] * at[0] - x[9] * at[1])
        expected += -sense * x[11] * (par.k_torque * omega**2 + par.inertia_drive * dx[11 + i])
    assert energy == pytest.approx(expected, rel=1e-12)


def test_a_mirrored_vehicle_flies_the_mirrored_flight() -> None:
    vehicle = crazyflie(gain_1=0.9, inertia_drive=2e-7)
    card = vehicle.card
    turned = {name: -p.value for name, p in card.parameters.items() if name.startswith("rotor_") and name[-1] == "y"}
    mirrored = from_card(
        replace(card.with_values(turned), options={**card.options, "senses": [-s for s in card.options["senses"]]})
    )
    sign = np.array([1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1, 1, 1, 1])
    x, u = np.array([*STATE, 1500.0, 1700.0, 1600.0, 1800.0]), (0.5, 0.6, 0.4, 0.7)
    wind = Environment(voltage=3.7, wind_north=0.4, wind_east=0.3)
    expected = sign * rates(vehicle, x, u, wind)
    found = rates(mirrored, sign * x, u, wind._replace(wind_east=-0.3))
    assert np.max(np.abs(found - expected)) < 1e-9 * np.max(np.abs(expected))


@pytest.mark.parametrize(("name", "solidity", "card_says"), [("crazyflie", 0.19, 3.5e-6), ("x8", 0.09, 1.8e-3)])
def test_thrust_damping_is_of_the_size_that_momentum_theory_gives(name: str, solidity: float, card_says: float) -> None:
    """The slope of thrust by sink in hover from the toolkit's own inflow, blades with a lift slope of 5."""
    vehicle = sp.vehicle(name)
    par = vehicle.values()
    omega = vehicle.traits.hover(par, par.voltage_nominal, XP)[0]["omega_1"]  # type: ignore[misc]
    scale = par.air_density * math.pi * par.rotor_radius**4
    CT, loss = par.k_thrust / scale, 5.0 * solidity / 4.0
    free = CT + loss * math.sqrt(CT / 2.0)

    def thrust(sink: float) -> float:
        mu_z = sink / (omega * par.rotor_radius)
        lam0 = momentum_inflow(free + loss * mu_z, loss, mu_z, 0.0, XP)
        return float((free + loss * mu_z - loss * lam0) * scale * omega**2)

    # Climbing: sink meets the recirculation's term.
    slope = (thrust(0.0) - thrust(-0.02)) / 0.02 / omega
    assert card_says == pytest.approx(slope, rel=0.15)


def test_the_battery_gives_what_its_resistance_leaves() -> None:
    vehicle = with_resistance()
    par = vehicle.values()
    states, inputs = vehicle.traits.hover(par, 4.0, XP)  # type: ignore[misc]
    x = [states.get(state, 0.0) for state in vehicle.state_names]
    assert np.max(np.abs(rates(vehicle, x, inputs, Environment(voltage=4.0)))) < 1e-9
    power = 4.0 * par.k_torque * states["omega_1"] ** 3 / par.drive_efficiency
    terminal = 4.0 - states["voltage_sag"]
    assert states["voltage_sag"] == pytest.approx(par.battery_resistance * power / terminal, rel=1e-9)
    plain = crazyflie().traits.hover(crazyflie().values(), terminal, XP)  # type: ignore[misc]
    assert inputs == pytest.approx(plain[1], rel=1e-12)  # behind the resistance it is the same aircraft
    assert not vehicle.choices  # a log's voltage lies behind the resistance: nothing is offered to be fitted


def test_motors_that_warm_are_the_same_aircraft_in_a_long_hover() -> None:
    vehicle = with_warming()
    states, inputs = vehicle.traits.hover(vehicle.values(), 3.7, XP)  # type: ignore[misc]
    x = [states.get(state, 0.0) for state in vehicle.state_names]
    assert np.max(np.abs(rates(vehicle, x, inputs))) < 1e-10
    plain = crazyflie()
    assert inputs == plain.traits.hover(plain.values(), 3.7, XP)[1]  # type: ignore[misc]
    both = _with({**RESISTANCE, **WARMING}, battery="resistance", motors="warming")
    assert both.state_names[-2:] == ("voltage_sag", "warmth")
    states, inputs = both.traits.hover(both.values(), 4.0, XP)  # type: ignore[misc]
    x = [states.get(state, 0.0) for state in both.state_names]
    assert np.max(np.abs(rates(both, x, inputs, Environment(voltage=4.0)))) < 1e-9


def test_a_warmer_winding_costs_the_speed_that_its_circuit_says() -> None:
    """V = Ke w + R (1 + a dT) I with k_torque w^2 = Ke I, heated by I^2: speed and heat of the linear equations."""
    k_torque, Ke, R, copper, hover = 1e-10, 7e-4, 1.2, 0.0039, 2050.0
    rise = 30.0  # of the winding in a long hover [K]

    def speed(voltage: float, warmer: float) -> float:  # the positive root of the circuit
        b = R * (1.0 + copper * warmer) * k_torque / Ke
        return (-Ke + math.sqrt(Ke**2 + 4.0 * b * voltage)) / (2.0 * b)

    volts = Ke * hover + R * (1.0 + copper * rise) * k_torque / Ke * hover**2
    assert speed(volts, rise) == pytest.approx(hover, rel=1e-12)
    vehicle = with_warming().with_values({"o_cold": speed(volts, 0.0) - hover})
    par, half = vehicle.values(), 0.5
    states, inputs = vehicle.traits.hover(par, 3.7, XP)  # type: ignore[misc]
    x = np.array([states.get(state, 0.0) for state in vehicle.state_names])
    x[-1] = half
    faster = rates(vehicle, x, inputs)[12] * (
        par.tau_drive + par.tau_shared
    )  # towards the speed that the voltage holds
    assert faster == pytest.approx(speed(volts, half * rise) - hover, rel=0.03)
    x[12:16] *= 1.1
    heat = (1.1**2) ** 2  # current goes with torque, torque with the square of speed, heat with the square of current
    assert rates(vehicle, x, inputs)[-1] * par.tau_warm == pytest.approx(heat - half, rel=1e-9)


def test_a_record_begins_with_motors_as_warm_as_its_time_says() -> None:
    """From time zero on the weight is carried: the same exponential as the equations have, integrated here."""
    vehicle = with_warming()
    par, settled = vehicle.values(), vehicle.traits.settled
    states, inputs = vehicle.traits.hover(par, 3.7, XP)  # type: ignore[misc]
    warmth, dt = 0.0, 0.01
    x = np.array([states.get(state, 0.0) for state in vehicle.state_names])
    for _ in range(600):
        x[-1] = warmth
        warmth += dt * rates(vehicle, x, inputs)[-1]
    told = settled(vehicle.inputs(*inputs), par, 3.7, None, 6.0)  # type: ignore[misc]
    assert told["warmth"] == pytest.approx(warmth, abs=1e-3)
    assert told["omega_1"] == pytest.approx(states["omega_1"] + par.o_cold * (1.0 - told["warmth"]), rel=1e-12)
    n = 200
    still, volts = np.zeros((n, len(POSE))), np.full(n, 3.7)
    piece = Record("made", 6.0 + dt * np.arange(n), np.tile(inputs, (n, 1)), still, volts, POSE, voltage_known=True)
    begin = seen_at_start(vehicle, piece)
    noises = (np.array(row, dtype=np.float64) for row in (par, Noise(), Nuisance(), inputs))
    first = begun(stochastic_model(vehicle, POSE, 0.01), FilterNumbers(*noises), begin)
    assert first.x[-1] == pytest.approx(told["warmth"], rel=1e-12)


def test_warming_may_be_fitted_and_left_out_where_the_card_has_it() -> None:
    vehicle = with_warming()
    assert {"o_cold", "tau_warm"} <= {free.name for free in vehicle.choices["full"].free}
    assert not {"o_cold", "tau_warm"} & {free.name for free in crazyflie().choices["full"].free}
    assert "o_cold" in vehicle.traits.effects(vehicle.card)[-1].without
    heave = next(axis for axis in vehicle.traits.axes if axis.name == "heave")
    assert {"o_cold", "tau_warm"} <= set(heave.parameters)


def _broken(**changes: Any) -> Card:
    card = packaged_cards()["crazyflie"]
    return replace(card, options={**card.options, **changes})


@pytest.mark.parametrize(
    "changes", [{"senses": [1, 1, 2, -1]}, {"senses": "xx"}, {"battery": "big"}, {"motors": "hot"}, {"arms": 4}]
)
def test_wrong_options_are_named(changes: dict[str, Any]) -> None:
    with pytest.raises(CardError, match="senses"):
        from_card(_broken(**changes))


def test_rotors_that_cannot_turn_the_body_are_refused() -> None:
    # A quadrotor in x whose diagonal pairs turn alike has yaw; one whose side pairs do has not, besides roll.
    with pytest.raises(CardError, match="independently"):
        from_card(_broken(senses=[1, 1, 1, 1]))
    with pytest.raises(CardError, match="independently"):
        from_card(_broken(senses=[1, 1, -1, -1]))
    with pytest.raises(CardError, match="is missing"):
        from_card(_broken(senses=[1, -1, 1, -1, 1]))


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("kind", ["measured", "both"])
def test_exported_c_has_the_same_rates(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("casadi", reason="the extra 'model' is not installed")
    vehicle = sp.vehicle("crazyflie")
    if kind == "both":
        vehicle = _with({**RESISTANCE, **WARMING}, battery="resistance", motors="warming")
    env = Environment(wind_north=0.5, wind_east=-0.3, wind_down=0.1, air_density=1.15, gravity=9.80665, voltage=3.9)
    trim = sp.trim(vehicle, environment=env)
    model = trace_vehicle(vehicle, trim, name="multirotor")
    run = compiled(model_code(model), tmp_path)
    s, p = (np.array([v.start for v in getattr(model, part)]) for part in ("surroundings", "parameters"))
    rng = np.random.default_rng(1)
    for _ in range(5):
        x = trim.state + 0.1 * rng.standard_normal(trim.state.size) * np.maximum(1.0, np.abs(trim.state))
        u = np.clip(trim.inputs + 0.1 * rng.standard_normal(trim.inputs.size), 0.0, 1.0)
        (found,) = run.call("rates", x, u, s, p, out=(x.size,))
        np.testing.assert_allclose(found, rates(vehicle, x, u, env), rtol=1e-11, atol=1e-9)


def test_a_logged_voltage_keeps_the_sags_that_the_commands_are_shares_of() -> None:
    """Half a second of load: averaged away for a vehicle whose battery only runs down, kept for a multirotor."""
    t = np.arange(1000) * 0.01
    voltage = np.where((t > 5.0) & (t < 5.5), 3.2, 3.7)
    wave = 0.5 + 0.1 * np.sin(t)
    data: dict[str, np.ndarray] = {name: 0.01 * np.sin(t) for name in ("x", "y", "z", "phi", "theta", "psi")}
    data |= {f"motor_{i}": wave for i in (1, 2, 3, 4)} | {"voltage": voltage}
    flight = Flight({"uniform": stream(t, data)}, Provenance(source="made", sha256="", reader="", reader_version=""))
    vehicle = sp.vehicle("crazyflie")
    (record,) = records(flight, vehicle)
    assert record.voltage_known
    assert record.voltage[525] == pytest.approx(3.2, abs=0.02)
    slow = replace(vehicle, traits=replace(vehicle.traits, voltage_seconds=8.0))
    (record,) = records(flight, slow)
    assert record.voltage[525] > 3.6
