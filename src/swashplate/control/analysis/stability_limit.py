"""How much delay a CoaX stands with and without its bar, over the rate of its sensors and the speed of its servos.

Two answers for each rate and servo, of the cyclic loops with motors closed. A controller that was designed without
knowing of a delay: where does it become unstable? And one that is designed for the delay: up to where does it keep a
disc margin in both loops at once? Weights are the usual ones throughout: a slow chain is asked for as much as a fast.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from swashplate.control.lqg.analysis import Analysis, analyse_loop
from swashplate.control.lqg.design import design, design_states, regulated
from swashplate.control.lqg.weights import bryson
from swashplate.errors import ControllerError
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.filtering.sensor_suite import suite
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import LinearModel, linearize

SERVOS = ("servo_roll", "servo_pitch")


@dataclass(frozen=True)
class Limit:
    """One rate and servo.

    Attributes:
        rate: of sensors and controller [Hz].
        servo: time constant of the servos [s].
        unaware: delay at which a loop designed without it becomes unstable [s].
        aware: largest delay for which a loop designed for it keeps the disc margin [s]; NaN where none does.
        disc: margin of the loops without delay.
        place: how far it strays from its place in assumed gusts, without delay [m, one sigma along each axis].
    """

    rate: float
    servo: float
    unaware: float
    aware: float
    disc: float
    place: float


def with_servos(model: LinearModel, time_constant: float) -> LinearModel:
    """The model with a first-order lag in front of each servo input; the same model for none."""
    if time_constant <= 0.0:
        return model
    n, m = model.B.shape
    moved = [model.inputs.index(name) for name in SERVOS]
    A = np.zeros((n + 2, n + 2))
    A[:n, :n], A[:n, n:] = model.A, model.B[:, moved]
    A[n:, n:] = -np.eye(2) / time_constant
    B = np.zeros((n + 2, m))
    B[:n] = model.B
    B[:n, moved] = 0.0
    for i, j in enumerate(moved):
        B[n + i, j] = 1.0 / time_constant
    G = np.vstack([model.G, np.zeros((2, model.G.shape[1]))])
    states = (*model.states, *(f"{name} actuator" for name in SERVOS))
    return replace(model, A=A, B=B, G=G, C=np.eye(n + 2), D=np.zeros((n + 2, m)), states=states)


def limit(vehicle: Vehicle, *, rate: float, servo: float, disc: float = 0.5, longest: float = 0.4) -> Limit:
    """The two limits for one rate and servo; the second to one sample.

    Args:
        vehicle: with or without its bar.
        rate: of gyros, motion capture and controller [Hz].
        servo: time constant [s].
        disc: margin to be kept: 0.5 stands 28 deg or a factor of 1.67 in both loops at once.
        longest: delay beyond which is not searched [s].
    """
    base = design(vehicle, sensors=suite(f"gyro@{rate:g},mocap@{rate:g}+0ms"), rate=rate)
    model = with_servos(linearize(vehicle, base.start), servo)
    free = _loop(base.plan, base.numbers, model, vehicle, 0)
    held, lost = (0 if free.margins.together.alpha >= disc else -1), int(longest * rate) + 1
    while lost - held > 1 and held >= 0:
        tried = (held + lost) // 2
        if _kept(base.plan, base.numbers, model, vehicle, tried, disc):
            held = tried
        else:
            lost = tried
    aware = held / rate if held >= 0 else float("nan")
    return Limit(rate, servo, free.margins.delay, aware, free.margins.together.alpha, free.spread["x"])


def _kept(plan: ObserverPlan, numbers: Numbers, model: LinearModel, vehicle: Vehicle, delay: int, disc: float) -> bool:
    try:
        return _loop(plan, numbers, model, vehicle, delay).margins.together.alpha >= disc
    except ControllerError:
        return False


def _loop(plan: ObserverPlan, numbers: Numbers, model: LinearModel, vehicle: Vehicle, delay: int) -> Analysis:
    """The cyclic loops of a controller that knows of this delay of the servos [samples]."""
    late = replace(plan, delays=tuple(delay if name in SERVOS else 0 for name in vehicle.input_names))
    names = (*model.states, *design_states(vehicle, late.delays)[plan.n :])
    Q, R = bryson(vehicle, names)
    gains = regulated(model, late, "place", Q, R, where=vehicle.name)
    return analyse_loop(
        late, numbers, model, gains, place=True, opened=SERVOS, points=120, exact=False, where=vehicle.name
    )
