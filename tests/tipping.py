"""A body that tips over: two states of one's own equations, unstable, flown under feedback in gusts."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from swashplate.flights.flight import Flight, stream
from swashplate.models.card import Card, Parameter
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector


class Tilt(NamedTuple):
    """Tilt [rad] and its rate [rad/s]."""

    theta: Any
    q: Any


class Stick(NamedTuple):
    """What turns it [1]."""

    stick: Any


class Numbers(NamedTuple):
    """What the equations need: tipping, damping, control power."""

    Mt: Any
    Mq: Any
    Md: Any


TRUTH = {"Mt": 4.0, "Mq": -0.8, "Md": 6.0}
"""Modes at +1.6 and -2.4 1/s: in the twelve seconds of a record what is left alone grows by a factor of 2e8."""

OUTPUTS = ("theta", "q")
GUST, NOISE = np.array([0.01, 0.4]), np.array([0.01, 0.03])


def rates(state: Tilt, inputs: Stick, par: Numbers, env: Environment, xp: Backend) -> Tilt:
    del env
    return Tilt(state.q, par.Mt * xp.sin(state.theta) + par.Mq * state.q + par.Md * inputs.stick)


def force(state: Tilt, inputs: Stick, par: Numbers, env: Environment, xp: Backend) -> Vector:
    del inputs, par, env, xp
    return Vector(0.0 * state.q, 0.0 * state.q, 0.0 * state.q)


def tipping(**values: float) -> Vehicle:
    """The vehicle; what is not given is zero."""
    parameters = {n: Parameter(values.get(n, 0.0), "1", "a test", "assumed") for n in TRUTH}
    return Vehicle(
        card=Card("tipping", "a body that tips over", "nowhere", {}, parameters),
        state=Tilt(0.0, 0.0),
        inputs=Stick,
        parameters=Numbers,
        state_names=Tilt._fields,
        state_units=("rad", "rad/s"),
        input_names=Stick._fields,
        input_units=("1",),
        input_limits=((-2.0, 2.0),),
        derivatives=rates,
        specific_force=force,
    )


def tipped(seed: int, *, seconds: float = 12.0, dt: float = 0.04, gust: float = 1.0, noise: float = 1.0) -> Flight:
    """A record at 25 Hz: steps and a sine on top of a feedback, straight between samples, gusts on both rates."""
    random, n, fine = np.random.default_rng(seed), round(seconds / dt), 20
    t, x, rows, xp = np.arange(n) * dt, np.zeros(2), [], FloatBackend()
    told = 0.35 * np.sign(np.sin(1.1 * t)) + 0.25 * np.sin(2.7 * t)
    stick = told.copy()
    for k in range(n):
        rows.append(x)
        after = min(k + 1, n - 1)
        if after > k:
            stick[after] = told[after] - 1.4 * x[0] - 0.5 * x[1]
        for i in range(fine):
            now = Stick(stick[k] + (stick[after] - stick[k]) * (i + 0.5) / fine)
            dx = np.array(rates(Tilt(*x), now, Numbers(**TRUTH), Environment(), xp))
            x = x + dt / fine * dx + gust * GUST * np.sqrt(dt / fine) * random.standard_normal(2)
    seen = np.array(rows) + noise * NOISE * random.standard_normal((n, 2))
    return Flight({"uniform": stream(t, {"stick": stick, "theta": seen[:, 0], "q": seen[:, 1]}, {"stick": "1"})})
