"""The step of an LQG controller with its observer as C: the same step that Python runs, traced by CasADi.

The equations of the vehicle and their exact Jacobians become straight-line code, the covariance's algebra small loops
over fixed sizes; nothing is allocated, and of the C library only sin, cos, sqrt and atan2 are called.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from swashplate.control.kinds import TracedStep
from swashplate.control.lqg.controller import Lqg, true_readings
from swashplate.control.lqg.controller_step import Carried, lqg_step, sizes
from swashplate.control.lqg.law import LAW_MEMORY
from swashplate.filtering.matrix_operations import Scalars
from swashplate.filtering.observer import ObserverEstimate
from swashplate.physics.backend import Backend, CasadiBackend
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.closed_loop import REFERENCES


class CasadiMatrices:
    """The observer's matrix operations as CasADi expressions; see `swashplate.filtering.matrix_operations`."""

    looped = False

    def __init__(self) -> None:
        self.xp: Backend = CasadiBackend()
        self._made: dict[Any, Any] = {}

    def column(self, scalars: Sequence[Any], /) -> Any:
        import casadi

        return casadi.vertcat(*scalars)

    def scalars(self, column: Any, /) -> list[Any]:
        return [column[i] for i in range(column.shape[0])]

    def value(self, f: Scalars, x: Any, w: Any, /) -> Any:
        """Without the slopes, which a call would compute all the same."""
        import casadi

        key = (f.__code__, x.shape[0], w.shape[0], "value")
        if key not in self._made:
            xs, ws = casadi.SX.sym("x", x.shape[0]), casadi.SX.sym("w", w.shape[0])
            outputs = casadi.vertcat(*f(self.scalars(xs), self.scalars(ws)))
            self._made[key] = casadi.Function(f"swash_part{len(self._made)}", [xs, ws], [outputs])
        return self._made[key](x, w)

    def linearised(self, f: Scalars, x: Any, w: Any, /) -> tuple[Any, Any]:
        """Traced once per place in the program: the four stages of a Runge-Kutta step call one function."""
        import casadi

        key = (f.__code__, x.shape[0], w.shape[0])
        if key not in self._made:
            xs, ws = casadi.SX.sym("x", x.shape[0]), casadi.SX.sym("w", w.shape[0])
            outputs = casadi.vertcat(*f(self.scalars(xs), self.scalars(ws)))
            slopes = casadi.jacobian(outputs, xs)
            self._made[key] = casadi.Function(f"swash_part{len(self._made)}", [xs, ws], [outputs, slopes])
        return tuple(self._made[key](x, w))

    def stacked(self, parts: Sequence[Any], /) -> Any:
        import casadi

        return casadi.vertcat(*parts)

    def diagonal(self, values: Any, /) -> Any:
        import casadi

        return casadi.diag(casadi.DM(np.asarray(values)))


def lqg_function(controller: Lqg) -> Any:
    """`(memory, measured, reference) -> (memory, command)` as one CasADi function; `measured` ends in the voltage."""
    import casadi

    plan = controller.plan
    N, rows, sensors = sizes(plan)
    m, depth = plan.inputs, max(plan.delays) + 1
    readings = len(plan.channels) if plan.sensors else plan.n
    memory = casadi.MX.sym("memory", controller.inner_memory.size)
    measured, reference = casadi.MX.sym("measured", readings + 1), casadi.MX.sym("reference", len(REFERENCES))
    rest = memory[N + rows * rows :]
    given = [[rest[i * m + j] for j in range(m)] for i in range(depth)]
    counts = [rest[depth * m + i] for i in range(sensors)]
    law = [rest[depth * m + sensors + i] for i in range(LAW_MEMORY)]
    estimate = ObserverEstimate(memory[:N], casadi.reshape(memory[N : N + rows * rows], rows, rows))
    gains = [casadi.DM(np.asarray(each)) for each in controller.feedback.gains]
    feedback = controller.feedback._replace(gains=gains)
    numbers = controller.numbers
    if plan.period:  # columns of readings that are not due vanish from the code
        numbers = numbers._replace(steady=[casadi.sparsify(casadi.DM(np.asarray(each))) for each in numbers.steady])
    after, commands = lqg_step(
        plan,
        numbers,
        feedback,
        Carried(estimate, given, counts, law),
        measured[:readings],
        measured[readings],
        [reference[i] for i in range(len(REFERENCES))],
        CasadiMatrices(),
    )
    flat = [value for row in after.given for value in row] + after.counts + after.law
    covariance = [casadi.reshape(casadi.densify(after.estimate.covariance), rows * rows, 1)] if rows else []
    mean = [after.estimate.mean] if N else []
    result = casadi.vertcat(*mean, *covariance, *flat, *commands)
    return casadi.Function("swash_traced", [memory, measured, reference], [result])


def sensed_function(controller: Lqg, traced: TracedStep) -> Any:
    """The step of `lqg_function` behind the simulated sensors, as `SensedStep` flies it.

    Its memory has the sensors' behind it; `measured` is the body's state row, the specific force, the voltage and the
    draws.
    """
    import casadi

    plan = controller.plan
    nb, channels, body = len(plan.biases), len(plan.channels), len(RigidBody._fields)
    inner, depth = controller.inner_memory.size, controller.sensed.depth
    own, x, felt, drawn = (
        casadi.SX.sym(name, size)
        for name, size in (
            ("own", nb + 2 + depth * channels),
            ("x", body),
            ("felt", 3),
            ("drawn", controller.drawn),
        )
    )
    bias, count = own[:nb], own[nb + 1]
    now = casadi.vertcat(*true_readings(plan, x, felt, bias, CasadiBackend()))
    stored = casadi.vertcat(now, own[nb + 2 : nb + 2 + (depth - 1) * channels])
    queue = casadi.if_else(count < 0.5, casadi.repmat(now, depth, 1), stored)
    place = [at.late for s, at in zip(plan.sensors, plan.sampling, strict=True) for _ in s.channels]
    numbers = controller.numbers
    wander = np.asarray(numbers.process)[plan.n + 6 : plan.n + 6 + nb]
    noisy = [
        queue[late * channels + i] + np.sqrt(variance) * drawn[i]
        for i, (late, variance) in enumerate(zip(place, np.asarray(numbers.measurement), strict=True))
    ]
    wandered = [bias[i] + np.sqrt(wander[i]) * drawn[channels + i] for i in range(nb)]
    after = casadi.vertcat(*wandered, own[nb], count + 1.0, queue)
    sensing = casadi.Function("swash_sensed", [own, x, felt, drawn], [casadi.vertcat(*noisy), casadi.densify(after)])
    memory, reference = casadi.MX.sym("memory", inner + own.shape[0]), casadi.MX.sym("reference", len(REFERENCES))
    measured = casadi.MX.sym("measured", body + 3 + 1 + controller.drawn)
    y, carried = sensing(memory[inner:], measured[:body], measured[body : body + 3], measured[body + 4 :])
    stepped = traced.function(memory[:inner], casadi.vertcat(y, measured[body + 3]), reference)
    result = casadi.vertcat(stepped[:inner], carried, stepped[inner:])
    return casadi.Function("swash_traced", [memory, measured, reference], [result])


def measured_names(controller: Lqg) -> tuple[str, ...]:
    """What the measured row of the C holds."""
    plan = controller.plan
    return (*(plan.channels if plan.sensors else controller.vehicle.state_names), "voltage")
