"""The HFB-320 as Jategaonkar (2015, eqs 5.86 to 5.89) writes it: an aeroplane with its own states and sensors.

Constants: the data's columns.md. His numbers and where he starts: RVJategaonkar_codes_2ed/chapter07/mDefCase04.m and
chapter05/mDefCase04.m (same source as the table of the unstable aircraft).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from swashplate.flights.flight import Flight, stream
from swashplate.models.card import Card, Parameter
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector

MASS, TILT, V0, CHORD, AREA, TURN, ARM = 7472.0, 0.0524, 104.67, 1.215, 4.028e-3, 8.0027e-4, -7.0153e-6
"""Mass [kg], engine's tilt [rad], speed [m/s] and chord [m] of reference, S/m, Sc/Iy, thrust's arm over Iy."""

AIR = Environment(air_density=0.792, gravity=9.80665)

PUBLISHED = {
    "CD0": 0.122688, "CDV": -0.0644969, "CDa": 0.320055, "CL0": -0.0929113, "CLV": 0.148726, "CLa": 4.32785,
    "Cm0": 0.111905, "CmV": 0.00395154, "Cma": -0.967854, "Cmq": -34.7098, "Cmde": -1.52913,
}  # fmt: skip
"""His filter error estimates."""

PUBLISHED_GUSTS = (0.358553, 2.42099e-3, 4.47607e-4, 1.73778e-3)
"""Intensities of the white noise on the rates of V, alpha, theta and q that he found with them."""

PUBLISHED_VARIANCES = (
    0.01758668956825, 9.9020743e-7, 1.9774013e-7, 3.3836151e-7, 3.168412236e-5, 4.1909760875e-4, 0.0202031037228,
)  # fmt: skip
"""Variances of his innovations, in the order of `OUTPUTS`."""

FIRST = (106.023, 0.111685, 0.104887, -3.32659e-3)
"""State at which he starts his filter."""

START = {
    "CD0": 5.67516e-3, "CDV": 7.72612e-3, "CDa": 0.674256, "CL0": -0.318267, "CLV": 0.260317, "CLa": 5.37576,
    "Cm0": 0.0498218, "CmV": 0.0189182, "Cma": -0.498586, "Cmq": -25.8439, "Cmde": -0.990687,
}  # fmt: skip
"""His start values."""

OUTPUTS = ("V", "alpha", "theta", "q", "qdot", "ax", "az")


class State(NamedTuple):
    """Speed [m/s], angle of attack, pitch attitude [rad], pitch rate [rad/s]."""

    V: Any
    alpha: Any
    theta: Any
    q: Any


class Inputs(NamedTuple):
    """Elevator [rad] and measured thrust [N]."""

    elevator: Any
    thrust: Any


Parameters = NamedTuple("Parameters", [(name, Any) for name in PUBLISHED])  # type: ignore[misc]


def coefficients(state: State, inputs: Inputs, par: Any) -> tuple[Any, Any, Any]:
    """Drag, lift and pitching moment."""
    v = state.V / V0
    moment = par.Cm0 + par.CmV * v + par.Cma * state.alpha + par.Cmq * CHORD * state.q / V0 + par.Cmde * inputs.elevator
    return (
        par.CD0 + par.CDV * v + par.CDa * state.alpha,
        par.CL0 + par.CLV * v + par.CLa * state.alpha,
        moment,
    )


def derivatives(state: State, inputs: Inputs, par: Any, env: Environment, xp: Backend) -> State:
    drag, lift, moment = coefficients(state, inputs, par)
    pressure, thrust = 0.5 * env.air_density * state.V**2, inputs.thrust / MASS
    climb, along = state.alpha - state.theta, state.alpha + TILT
    return State(
        -AREA * pressure * drag + thrust * xp.cos(along) + env.gravity * xp.sin(climb),
        state.q + (-AREA * pressure * lift - thrust * xp.sin(along) + env.gravity * xp.cos(climb)) / state.V,
        state.q,
        TURN * pressure * moment + ARM * inputs.thrust,
    )


def specific_force(state: State, inputs: Inputs, par: Any, env: Environment, xp: Backend) -> Vector:
    drag, lift, _ = coefficients(state, inputs, par)
    force, thrust = AREA * 0.5 * env.air_density * state.V**2, inputs.thrust / MASS
    s, c = xp.sin(state.alpha), xp.cos(state.alpha)
    ahead, down = force * (lift * s - drag * c), force * (-lift * c - drag * s)
    return Vector(ahead + thrust * np.cos(TILT), 0.0 * state.V, down - thrust * np.sin(TILT))


def hfb320(numbers: dict[str, float] = START) -> Vehicle:
    """The aeroplane with his start values, or others."""
    card = Card(
        vehicle="hfb320",
        title="HFB-320, longitudinal motion",
        trust="one flight about 104 m/s",
        options={},
        parameters={name: Parameter(value, "1", "mDefCase04.m", "published") for name, value in numbers.items()},
    )
    return Vehicle(
        card=card,
        state=State(V0, 0.1, 0.1, 0.0),
        inputs=Inputs,
        parameters=Parameters,
        state_names=State._fields,
        state_units=("m/s", "rad", "rad", "rad/s"),
        input_names=Inputs._fields,
        input_units=("rad", "N"),
        input_limits=((-0.5, 0.5), (0.0, 4e4)),
        derivatives=derivatives,
        specific_force=specific_force,
    )


def flight(columns: dict[str, Any]) -> Flight:
    """The record's columns as a flight at 10 Hz."""
    own = dict.fromkeys(("V", "alpha", "qdot", "thrust"), "1")
    time = np.arange(len(columns["V"])) * 0.1
    return Flight({"uniform": stream(time, columns, {n: u for n, u in own.items() if n in columns})})
