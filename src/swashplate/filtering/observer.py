"""The observer: an extended Kalman filter on a vehicle's nonlinear equations, one pure step per sample.

Estimated are the vehicle's states, six disturbing accelerations (first-order Gauss-Markov: gusts, and what the model
does not know), the sensors' biases, and, for sensors whose readings arrive late, the readings at the time they were
taken (Roumeliotis and Burdick 2002, stochastic cloning), so that a late reading corrects the past that it belongs to.
The mean moves by a Runge-Kutta step, the covariance by the exponential of the exact Jacobian in the step's middle;
the update eliminates reading after reading and inverts no matrix (Bar-Shalom, Li and Kirubarajan 2001, secs 5.2, 7.4).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import Equations
from swashplate.engine.graph import Expression, Row
from swashplate.engine.slopes import slopes_of
from swashplate.errors import ControllerError
from swashplate.filtering.disturbances import DISTURBED, Unrest, on_axes
from swashplate.filtering.matrix_operations import Matrices
from swashplate.filtering.sensor_suite import BIASED, Suite, biased, readings
from swashplate.models.nesting import rebuild
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector
from swashplate.physics.rigid_body import RigidBody

_BODY = len(RigidBody._fields)


@dataclass(frozen=True)
class Sampling:
    """When a sensor is heard, in samples of the controller: every so many, so many late, with so many readings kept."""

    every: int
    delay: int

    @property
    def kept(self) -> int:
        return -(-self.delay // self.every)

    @property
    def arrives(self) -> int:
        return self.delay % self.every


@dataclass(frozen=True)
class ObserverPlan:
    """What compiled code of an observer depends on: everything but numbers.

    Attributes:
        equations: of the vehicle.
        sensors: the suite.
        rate: steps per second [Hz].
        delays: of each input, in samples.
        period: samples after which constant gains of the observer repeat; 0 where it finds its gains as it flies.
        slow: parameters of the vehicle that are estimated too, as states that wander slowly; not with constant gains.
    """

    equations: Equations
    sensors: Suite
    rate: float
    delays: tuple[int, ...]
    period: int = 0
    slow: tuple[str, ...] = ()

    @property
    def dt(self) -> float:
        return 1.0 / self.rate

    @property
    def n(self) -> int:
        return len(self.equations.vehicle.state_names)

    @property
    def moves(self) -> int:
        """How many of what is estimated the equations move or are moved by: states, disturbances, slow parameters."""
        return self.n + len(DISTURBED) + len(self.slow)

    @property
    def inputs(self) -> int:
        return len(self.equations.vehicle.input_names)

    @property
    def biases(self) -> tuple[str, ...]:
        return biased(self.sensors)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the measurements, e.g. "flow.u", in the order of the measured row."""
        return tuple(f"{sensor.kind}.{name}" for sensor in self.sensors for name in sensor.channels)

    @property
    def sampling(self) -> tuple[Sampling, ...]:
        return tuple(
            Sampling(round(self.rate / s.rate), int(np.ceil(s.delay * self.rate - 1e-9))) for s in self.sensors
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Everything that is estimated."""
        delayed = [
            f"{sensor.kind}.{name} {i + 1} ago"
            for sensor, at in zip(self.sensors, self.sampling, strict=True)
            for i in range(at.kept)
            for name in sensor.channels
        ]
        return (
            *self.equations.vehicle.state_names,
            *(f"disturbance {name}" for name in DISTURBED),
            *(f"parameter {name}" for name in self.slow),
            *(f"bias {name}" for name in self.biases),
            *delayed,
        )

    def checked(self) -> ObserverPlan:
        """The plan itself where every sensor fits the controller's rate.

        Raises:
            ControllerError: naming the sensor.
        """
        for sensor in self.sensors:
            ratio = self.rate / sensor.rate
            if ratio < 1.0 - 1e-9 or abs(ratio - round(ratio)) > 1e-6:
                raise ControllerError(
                    f"gives {sensor.rate:g} readings per second; "
                    f"the controller's {self.rate:g} Hz is no whole multiple.",
                    channel=sensor.kind,
                    hint=f"Run the controller at {sensor.rate * max(1, round(ratio)):g} Hz or change the sensor.",
                )
        return self


class Numbers(NamedTuple):
    """Numbers of an observer.

    Attributes:
        parameters: of the vehicle, and air density and gravity behind them, a row.
        fade: 1 / time constant of the disturbances, six [1/s].
        process: variance that a sample adds to each estimate.
        measurement: variance of each channel.
        steady: constant gains through a cycle, (period, N, channels); None where the observer finds them as it flies.
    """

    parameters: Scalar
    fade: Scalar
    process: Scalar
    measurement: Scalar
    steady: Scalar = None


class ObserverEstimate(NamedTuple):
    """Estimates, a column (N, 1), and their covariance (N, N), or (0, 0) with constant gains."""

    mean: Scalar
    covariance: Scalar


def process_noise(plan: ObserverPlan, unrest: Unrest) -> tuple[Array, Array]:
    """(1 / time constants of the disturbances, variance per sample of everything estimated; slow parameters stay)."""
    u, dt = unrest, plan.dt
    fade = 1.0 / np.array(on_axes(u.force_time, u.force_time, u.moment_time, u.moment_time))
    vehicle = plan.equations.vehicle
    white = {**dict.fromkeys("uvw", u.jolt), **dict.fromkeys("pq", u.twist), "r": u.twist_yaw}
    inner = {"body": 0.0, "flapping": u.flapping, "bar": u.bar, "rotor speed": u.speed, "other": u.other}
    states = [white.get(n, inner[role]) ** 2 * dt for n, role in zip(vehicle.state_names, vehicle.roles, strict=True)]
    spread = u.spread**2 * (1.0 - np.exp(-2.0 * fade * dt))
    wander = [BIASED[name][1] ** 2 * dt for name in plan.biases]
    waiting = len(plan.names) - plan.moves - len(wander)
    # A stored reading is not disturbed; the last digit keeps the covariance positive in rounding.
    return fade, np.array([*states, *spread, *[0.0] * len(plan.slow), *wander, *[0.0] * waiting])


def measurement_noise(plan: ObserverPlan) -> Array:
    return np.array([sigma**2 for sensor in plan.sensors for sigma in sensor.sigma])


def start_variance(plan: ObserverPlan, unrest: Unrest) -> Array:
    """Variances before the first reading, of states, disturbances, slow parameters (none) and biases."""
    states = zip(plan.equations.vehicle.roles, plan.equations.vehicle.state_units, strict=True)
    usual = {"m": 0.05, "m/s": 0.05, "rad": 0.01, "rad/s": 0.02}
    first = [4.0 if role == "rotor speed" else usual.get(unit, 0.01) ** 2 for role, unit in states]
    spread = unrest.spread**2
    return np.array([*first, *spread, *[0.0] * len(plan.slow), *(BIASED[name][0] ** 2 for name in plan.biases)])


# ---- scalar functions --------------------------------------------------------------------------------------------
def _surrounded(plan: ObserverPlan, numbers: Scalar, e: Row, voltage: Scalar) -> tuple[Scalar, Environment]:
    vehicle = plan.equations.vehicle
    count = len(vehicle.parameter_names)
    slow = dict(zip(plan.slow, e[plan.moves - len(plan.slow) : plan.moves], strict=True))
    parameters = vehicle.parameters(
        *(slow[name] if name in slow else numbers[i] for i, name in enumerate(vehicle.parameter_names))
    )
    return parameters, Environment(voltage=voltage, air_density=numbers[count], gravity=numbers[count + 1])


def moving(plan: ObserverPlan, numbers: Numbers, e: Row, w: Row, xp: Backend) -> list[Scalar]:
    """Rates of everything estimated; `w` is the inputs and the voltage."""
    vehicle, n = plan.equations.vehicle, plan.n
    parameters, around = _surrounded(plan, numbers.parameters, e, w[plan.inputs])
    rates = vehicle.rates(e[:n], w[: plan.inputs], parameters, around, xp)
    pushed = dict(zip(DISTURBED, e[n : n + 6], strict=True))
    rates = [
        rate + pushed[name] if name in pushed else rate for name, rate in zip(vehicle.state_names, rates, strict=True)
    ]
    fading = [-numbers.fade[i] * e[n + i] for i in range(6)]
    return [*rates, *fading, *[0.0] * (len(e) - n - 6)]


def shown(plan: ObserverPlan, numbers: Numbers, e: Row, w: Row, xp: Backend) -> list[Scalar]:
    """What every sensor would read now of an estimate, channel by channel."""
    vehicle, n = plan.equations.vehicle, plan.n
    body = RigidBody(*e[:_BODY])
    bias = dict(zip(plan.biases, e[plan.moves : plan.moves + len(plan.biases)], strict=True))
    force = Vector(0.0, 0.0, 0.0)
    if any(sensor.kind == "imu" for sensor in plan.sensors):
        parameters, around = _surrounded(plan, numbers.parameters, e, w[plan.inputs])
        commands = vehicle.inputs(*w[: plan.inputs])
        nested = rebuild(vehicle.state, list(e[:n]))
        force = vehicle.specific_force(nested, commands, parameters, around, xp) + Vector(*e[n : n + 3])
    return [value for sensor in plan.sensors for value in readings(sensor, body, force, bias, xp).values()]


def pieces(plan: ObserverPlan) -> list[tuple[Sampling, slice, int]]:
    """Of each sensor its sampling, its channels, and where its kept readings begin."""
    placed, channel, place = [], 0, plan.moves + len(plan.biases)
    for sensor, at in zip(plan.sensors, plan.sampling, strict=True):
        m = len(sensor.channels)
        placed.append((at, slice(channel, channel + m), place))
        channel, place = channel + m, place + m * at.kept
    return placed


def arriving(plan: ObserverPlan, numbers: Numbers, e: Row, w: Row, xp: Backend) -> list[Scalar]:
    """What should arrive now: fresh readings, and for late sensors the oldest one kept."""
    now = shown(plan, numbers, e, w, xp)
    for at, part, place in pieces(plan):
        if at.kept:
            m = part.stop - part.start
            now[part] = list(e[place + m * (at.kept - 1) : place + m * at.kept])
    return now


def keeping(plan: ObserverPlan, numbers: Numbers, e: Row, w: Row, xp: Backend) -> list[Scalar]:
    """Estimates with the readings taken now put in store; `w` ends in a flag per sensor: 1 where it takes one."""
    now, after = shown(plan, numbers, e, w, xp), list(e)
    for number, (at, part, place) in enumerate(pieces(plan)):
        m, taken = part.stop - part.start, w[plan.inputs + 1 + number]
        for i in reversed(range(m * at.kept)):
            fresh = now[part.start + i] if i < m else e[place + i - m]
            after[place + i] = taken * fresh + (1.0 - taken) * e[place + i]
    return after


OfObserver = Callable[[ObserverPlan, Numbers, Row, Row, Backend], list[Scalar]]
"""`shown`, `keeping`."""


def linearised_at(of: OfObserver, plan: ObserverPlan, numbers: Numbers, e: Array, w: Array) -> tuple[Array, Array]:
    """Value (m,) and slopes by what is estimated (m, N) at estimates (N,) under a driving row."""
    listed = Numbers(*(None if part is None else np.asarray(part).tolist() for part in numbers))
    slopes = slopes_of(lambda e, w, _, xp: of(plan, listed, e, w, xp), (len(e), len(w), 0), where="the observer")
    return slopes(e, w, np.zeros(0))[:2]


# ---- the filter --------------------------------------------------------------------------------------------------
def corrected(
    plan: ObserverPlan,
    numbers: Numbers,
    estimate: ObserverEstimate,
    y: Scalar,
    due: Row,
    w: Scalar,
    M: Matrices,
) -> tuple[ObserverEstimate, Expression, Expression]:
    """The estimate after the readings that are due, the innovations (channels, 1) and their covariance.

    Args:
        plan, numbers: the observer.
        estimate: predicted.
        y: readings, a column; those not due may be anything finite.
        due: per sensor 1 or 0.
        w: inputs and voltage, a column.
        M: the operations.
    """
    xp = M.xp
    flags = [flag for flag, sensor in zip(due, plan.sensors, strict=True) for _ in sensor.channels]
    first = plan.inputs + 1

    def heard(e: Row, w: Row) -> list[Scalar]:
        """What arrives now; zero, whatever is estimated, of what does not."""
        now = arriving(plan, numbers, e, w[:first], xp)
        return [flag * value for flag, value in zip(w[first:], now, strict=True)]

    expected, H = M.linearised(heard, estimate.mean, M.column([*M.scalars(w), *flags]))
    innovations = M.column(innovations_of(plan, M.column(flags) * y, expected, M))
    mean, covariance, spread = M.updated(H, *estimate, innovations, numbers.measurement)
    return ObserverEstimate(mean, covariance), innovations, spread


def innovations_of(plan: ObserverPlan, y: Scalar, expected: Scalar, M: Matrices) -> list[Scalar]:
    """Readings less what was expected, headings the short way round."""
    away = M.scalars(y - expected)
    for i, name in enumerate(plan.channels):
        if name.endswith(".psi"):
            away[i] = M.xp.atan2(M.xp.sin(away[i]), M.xp.cos(away[i]))
    return away


def predicted(
    plan: ObserverPlan, numbers: Numbers, estimate: ObserverEstimate, w: Scalar, taken: Sequence[Scalar], M: Matrices
) -> ObserverEstimate:
    """The estimate one sample later.

    Args:
        plan, numbers, estimate, M: as in `corrected`.
        w: inputs that act during the sample and the voltage, a column.
        taken: per sensor 1 where it takes a reading now.
    """
    xp, dt = M.xp, plan.dt
    begin, P = estimate
    moves, fixed = plan.moves, plan.moves + len(plan.biases)

    def rates(e: Row, w: Row) -> list[Scalar]:
        return moving(plan, numbers, e, w, xp)

    x = begin[:moves, :]
    change = M.change(rates, x, w, dt)
    _, A = M.linearised(rates, x + 0.5 * change, w)
    mean, J = [x + change, begin[moves:fixed, :]], None
    if any(at.kept for at in plan.sampling):

        def kept(e: Row, w: Row) -> list[Scalar]:
            return keeping(plan, numbers, e, w, xp)[fixed:]

        readings, J = M.linearised(kept, begin, M.column([*M.scalars(w), *taken]))
        mean.append(readings)
    return ObserverEstimate(M.stacked(mean), M.propagated(A, J, P, numbers.process, dt))
