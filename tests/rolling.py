"""A vehicle of two states in roll that is no helicopter, the same as a state-space model, and a flight in gusts."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from swashplate.flights.flight import Flight, stream
from swashplate.models.card import Card, Parameter
from swashplate.models.traits import PhysicalEffect
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector


class Roll(NamedTuple):
    """Roll rate [rad/s] and the lag of what drives it [rad]."""

    p: Any
    b: Any


class Stick(NamedTuple):
    """Lateral stick [1]."""

    stick: Any


class Numbers(NamedTuple):
    """What the equations need."""

    Lb: Any
    tau: Any
    A: Any


def rates(state: Roll, inputs: Stick, par: Numbers, env: Environment, xp: Backend) -> Roll:
    del env, xp
    return Roll(par.Lb * state.b, (par.A * inputs.stick - state.b) / par.tau - state.p)


def force(state: Roll, inputs: Stick, par: Numbers, env: Environment, xp: Backend) -> Vector:
    del inputs, par, xp
    return Vector(0.0 * state.p, env.gravity * state.b, 0.0 * state.p)


TRUTH = {"Lb": 60.0, "tau": 0.2, "A": 0.5}


def rolling() -> Vehicle:
    start = {"Lb": 45.0, "tau": 0.3, "A": 0.4}
    parameters = {n: Parameter(v, "1", "a test", "assumed", lower=0.01) for n, v in start.items()}
    return Vehicle(
        card=Card("roll", "two states in roll", "nowhere", {}, parameters),
        state=Roll(0.0, 0.0),
        inputs=Stick,
        parameters=Numbers,
        state_names=Roll._fields,
        state_units=("rad/s", "rad"),
        input_names=Stick._fields,
        input_units=("1",),
        input_limits=((-1.0, 1.0),),
        derivatives=rates,
        specific_force=force,
    )


SAME = """
kind = "state-space"
name = "roll"
[states]
p = "rad/s"
b = "rad"
[inputs]
stick = "1"
[equations]
p = {b = "Lb"}
b = {p = "-1", b = "-1 / tau", stick = "A / tau"}
[outputs.p]
of = {p = "1"}
[outputs.pdot]
rates = {p = "1"}
[outputs.ay]
of = {b = "9.81"}
[parameters]
Lb = {value = 45.0}
tau = {value = 0.3}
A = {value = 0.4}
"""


OUTPUTS_OF_ROLL = ("p", "pdot", "ay")


class BiasedNumbers(NamedTuple):
    """The same, and where the stick stands that does nothing."""

    Lb: Any
    tau: Any
    A: Any
    offset: Any


def biased_rates(state: Roll, inputs: Stick, par: BiasedNumbers, env: Environment, xp: Backend) -> Roll:
    return rates(state, Stick(inputs.stick + par.offset), Numbers(par.Lb, par.tau, par.A), env, xp)


def biased() -> Vehicle:
    """`rolling` with a stick that may stand off centre; at zero the equations are the same."""
    usual = rolling()
    numbers = {**usual.card.parameters, "offset": Parameter(0.0, "1", "a test", "assumed")}
    card = Card("roll", "two states in roll", "nowhere", {}, numbers)
    return replace(usual, card=card, parameters=BiasedNumbers, derivatives=biased_rates)


OFF_CENTRE = PhysicalEffect("stick that stands off centre", {"offset": 0.0})


@lru_cache(maxsize=16)
def gusty(seed: int = 11, offset: float = 0.0) -> Flight:
    """Six seconds at 50 Hz in gusts that act on the roll rate."""
    random, dt, n = np.random.default_rng(seed), 0.02, 300
    stick = np.sign(np.sin(2.0 * np.arange(n) * dt)) * 0.2 + 0.05 * random.standard_normal(n)
    x, rows = np.zeros(2), []
    for k in range(n):
        dx = np.array(rates(Roll(*x), Stick(stick[k] + offset), Numbers(**TRUTH), Environment(), None))  # type: ignore[arg-type]
        rows.append([x[0], dx[0], 9.81 * x[1]])
        for _ in range(20):
            dx = np.array(rates(Roll(*x), Stick(stick[k] + offset), Numbers(**TRUTH), Environment(), None))  # type: ignore[arg-type]
            x = x + dt / 20 * dx + np.array([0.5, 0.01]) * np.sqrt(dt / 20) * random.standard_normal(2)
    seen = np.array(rows) + random.standard_normal((n, 3)) * [0.01, 0.3, 0.02]
    columns = {"stick": stick, "p": seen[:, 0], "pdot": seen[:, 1], "ay": seen[:, 2]}
    return Flight({"uniform": stream(np.arange(n) * dt, columns, {"stick": "1"})})
