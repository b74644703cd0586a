"""Flights by CasADi's virtual machine, where there is no C compiler: the loop of `templates/fly.c` on the same graphs.

It takes fifty times as long as compiled C, and compiles nothing.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of
from swashplate.engine.graph import Graph
from swashplate.engine.roots import require_casadi
from swashplate.engine.statements import Precision
from swashplate.engine.trace import traced_angles, traced_force, unrolled_rates
from swashplate.engine.tumbling import from_euler, tumbling
from swashplate.models.vehicle import Vehicle

if TYPE_CHECKING:
    from swashplate.engine.fly import FlightPlan, Steering

_PHI, _ANGLES = 6, 3


def fly_virtually(
    vehicle: Vehicle, plan: FlightPlan, precision: Precision, *, quaternion: bool
) -> tuple[NDArray[Any], NDArray[Any]]:
    """As `fly.fly`, with Euler angles or a quaternion; single precision is rounded at the end."""
    stepped = tumbling(vehicle) if quaternion else vehicle
    steering, total, samples = plan.steering, plan.vehicles, plan.steps_and_one
    shown = np.array(plan.start, dtype=np.float64)
    x = np.stack([from_euler(column) for column in shown.T], axis=1) if quaternion else shown.copy()
    states = np.empty((plan.kept, *shown.shape))
    inputs = np.empty((plan.kept, 0 if steering is None else len(steering.before), total))
    step = rk4_graph(equations_of(stepped)).map(total)
    p = np.broadcast_to(plan.numbers, (len(plan.numbers), total))
    loop = None if steering is None else _Loop(steering, equations_of(stepped), total)
    for k in range(samples):
        row = k // plan.hold
        shown = _as_shown(x, shown) if quaternion else x
        if k % plan.keep == 0:
            states[k // plan.keep] = shown
        if loop is not None:
            w0 = loop.driving(k, row, x, shown, plan.rows[row], p)
            w1 = w2 = w0
            if k % plan.keep == 0:
                inputs[k // plan.keep] = w0[: inputs.shape[1]]
        elif plan.held or k + 1 == samples:
            w0 = w1 = w2 = plan.rows[row]
        else:
            first, last = plan.rows[row], plan.rows[row + 1]
            share = [(k % plan.hold + part) / plan.hold for part in (0.0, 0.5, 1.0)]
            w0, w1, w2 = (first + s * (last - first) for s in share)
        if k + 1 == samples:
            break
        driven = [np.broadcast_to(w, (len(w), total)) for w in (w0, w1, w2)]
        x = np.asarray(step(x, *driven, p, plan.dt))
    dtype = np.float64 if precision == "double" else np.float32
    return states.astype(dtype), inputs.astype(dtype)


@lru_cache(maxsize=32)
def rk4_graph(equations: Equations) -> Graph:
    """A step of Runge and Kutta as a CasADi function of (x, w at its begin, middle and end, p, dt)."""
    casadi = require_casadi()
    rates = unrolled_rates(equations)
    x, w, p = (casadi.SX.sym(name, rates.size1_in(i)) for i, name in enumerate("xwp"))
    middle, end, dt = casadi.SX.sym("m", w.size1()), casadi.SX.sym("e", w.size1()), casadi.SX.sym("dt")
    k1 = rates(x, w, p)
    k2 = rates(x + 0.5 * dt * k1, middle, p)
    k3 = rates(x + 0.5 * dt * k2, middle, p)
    k4 = rates(x + dt * k3, end, p)
    return casadi.Function("step", [x, w, middle, end, p, dt], [x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


def _as_shown(x: Array, before: Array) -> Array:
    """States with roll, pitch and yaw in place of the quaternion, whole turns counted on from the sample before."""
    angles = np.asarray(_angles(x.shape[1])(x[_PHI : _PHI + 4]))
    full, last = 2.0 * np.pi, before[_PHI : _PHI + _ANGLES]
    counted = last + (angles - last) - full * np.round((angles - last) / full)
    counted[1] = angles[1]
    return np.concatenate([x[:_PHI], counted, x[_PHI + 4 :]])


@lru_cache(maxsize=8)
def _angles(total: int) -> Graph:
    return traced_angles().map(total)


class _Loop:
    """What a law decides, sample by sample."""

    def __init__(self, steering: Steering, equations: Equations, total: int) -> None:
        self._s, self._total = steering, total
        self._law = steering.law.function.map(total)
        self._felt = traced_force(equations).map(total) if steering.law.feels else None
        self._memory = np.array(steering.memory, dtype=np.float64)
        self._acting = np.repeat(steering.before[:, None], total, axis=1)
        self._sent = np.repeat(self._acting[None], int(steering.delay_steps.max(initial=0)) + 1, axis=0)
        self._command = np.zeros_like(self._acting)

    def driving(self, k: int, row: int, x: Array, shown: Array, around: Array, p: Array) -> Array:
        """Inputs as they act and surroundings, shape (inputs + 4, vehicles)."""
        s = self._s
        around = np.broadcast_to(around, (len(SURROUNDINGS), self._total))
        if k % s.every == 0:
            turn = k // s.every
            measured = shown if s.noise is None else shown + s.noise[turn]
            felt = np.zeros((3, self._total))
            if self._felt is not None:
                felt = np.asarray(self._felt(x, np.concatenate([self._acting, around]), p))
            every = np.concatenate([measured, felt, around[-1:], s.draws[turn]])
            asked = np.broadcast_to(s.asked[row], (s.asked.shape[1], self._total))
            after = np.asarray(self._law(self._memory, every[s.law.places], asked))
            self._memory, self._command = after[: s.law.memory], after[s.law.memory :]
        low, high, unit = s.limits[:, :, None]
        wanted = self._command + s.added[row]
        rounded = np.where(unit > 0.0, unit * np.rint(wanted / np.where(unit > 0.0, unit, 1.0)), wanted)
        self._sent = np.concatenate([np.clip(rounded, low, high)[None], self._sent[:-1]])
        self._acting = np.take_along_axis(self._sent, s.delay_steps[None], axis=0)[0]
        return np.concatenate([self._acting, around])
