"""What a linear-quadratic controller will do before it flies: modes, margins and expected spread, from linear algebra.

The observer is taken steady here, with every sensor heard at every sample and its noise raised so that the information
per second stays; late sensors and late commands are chains of samples. Everything is sampled; nothing is flown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.margins import Margins
from swashplate.control.analysis.stability import margins_at, modes_of
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.steady_loop import Truth, response, seen_of, steady_loop, steady_loop_of, trim_of
from swashplate.errors import ControllerError
from swashplate.filtering.disturbances import DISTURBED
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.filtering.sampled_observer_model import SampledObserverModel
from swashplate.simulation.linearize import LinearModel, linearize

_SHOWN_AS = {"range": ("z", -1.0), "height": ("z", -1.0)}
"""Readings that show a state under another name, and their sign."""


@dataclass(frozen=True)
class Analysis:
    """A controller about one trim.

    Attributes:
        modes: of the closed loop, least stable first [1/s].
        margins: at the inputs.
        spread: standard deviation of the vehicle's states under the assumed unrest and sensors, by name.
        uncertainty: of the estimates, by name (empty without sensors).
    """

    modes: NDArray[np.complex128]
    margins: Margins
    spread: dict[str, float]
    uncertainty: dict[str, float]


def analyse(
    controller: Lqg, *, at: int = 0, on: Aircraft | None = None, points: int = 240, where: str = ""
) -> Analysis:
    """Modes, margins and spread about the trim with the number `at`.

    Args:
        controller: with or without sensors.
        at: number of the trim.
        on: what flies; the controller's own model, as late as it was designed for, where not given. Another one needs
            a controller with sensors: they read the same of both.
        points: of the frequency grid.
        where: named in messages.

    Raises:
        ControllerError: where the loop is not stable, or no steady observer exists (with the direction).
    """
    f = controller.feedback
    return analyse_loop(
        controller.plan,
        controller.numbers,
        linearize(controller.vehicle, trim_of(controller, at)),
        np.asarray(f.gains)[at],
        place=float(f.place) > 0.5,
        truth=None if on is None else seen_of(controller, on),
        points=points,
        where=where or controller.vehicle.card.path or controller.vehicle.name,
    )


def analyse_loop(
    plan: ObserverPlan,
    numbers: Numbers,
    model: LinearModel,
    gains: Array,
    *,
    place: bool,
    truth: Truth | None = None,
    opened: Sequence[str] | None = None,
    points: int = 240,
    exact: bool = True,
    where: str = "",
) -> Analysis:
    """The same for a gain over `lqg_design.design_states` and a linear model.

    Args:
        plan, numbers: the observer.
        model: its columns may end in actuators' states.
        gains: (inputs, states with late commands and integrals).
        place: whether a place is held.
        truth: the aircraft, where it is not as the controller believes.
        opened: inputs at which the loop is opened, all where not given; the others stay closed.
        points: of the frequency grid.
        exact: delay margins by eigenvalues, as in `stability.margins_at`.
        where: the model's name.
    """
    known, real, plant, compensator, P, loop = steady_loop(
        plan, numbers, model, gains, place=place, truth=truth, where=where
    )
    modes = modes_of(loop)
    if modes[0].real >= 0.0:
        raise ControllerError(
            f"the loop at {plan.rate:g} Hz has a growing mode at {modes[0].real:+.3g} "
            f"+- {abs(modes[0].imag):.3g}j 1/s.",
            where=where,
            hint="Ask for less (larger allowed deviations), run it faster, or cut the delays.",
        )
    closed, entering = _closed(plant, compensator, bool(plan.sensors))
    return Analysis(
        modes,
        margins_at(loop, opened, points=points, exact=exact),
        _spread(real, closed, entering),
        {n: float(np.sqrt(max(P[i, i], 0.0))) for i, n in enumerate(known.names)} if plan.sensors else {},
    )


def sensitivity(
    controller: Lqg, frequencies: Array, state: str, *, at: int = 0, on: Aircraft | None = None
) -> NDArray[np.complex128] | None:
    """What is left of a disturbance added to a state wherever a sensor shows it: (state + disturbance) / disturbance.

    Args:
        controller: with or without sensors.
        frequencies: [rad/s], below Nyquist's.
        state: its name; a height by sonar or pressure counts as z.
        at: number of the trim.
        on: what flies, as in `analyse`.

    Returns:
        One number per frequency; None where no sensor shows the state.
    """
    plan = controller.plan
    parts = steady_loop_of(controller, at, on)
    names = [parts.truth.names[i] for i in parts.truth.driven]
    if state not in names:
        return None
    (_, B, _), (_, Bc, _, Dc) = parts.plant, parts.compensator
    closed, _ = _closed(parts.plant, parts.compensator, bool(plan.sensors))
    drive, shown = np.zeros(closed.shape[0]), False
    for i, (channel, samples) in enumerate(_channels(plan, parts.truth)):
        name, sign = _SHOWN_AS.get(channel.split(".")[-1], (channel.split(".")[-1], 1.0))
        if name != state:
            continue
        shown = True
        if samples:  # it enters the chain of samples that are on their way
            drive[names.index(f"{channel} 1 ago")] += sign
        else:
            drive += sign * np.concatenate([B @ Dc[:, i], Bc[:, i]])
    if not shown:
        return None
    pick = np.zeros((1, closed.shape[0]))
    pick[0, names.index(state)] = 1.0
    z = np.exp(1j * np.asarray(frequencies) / plan.rate)
    return np.asarray(1.0 + response(z, closed, drive[:, None], pick, None)[:, 0, 0], dtype=np.complex128)


def _channels(plan: ObserverPlan, model: SampledObserverModel) -> list[tuple[str, int]]:
    """Of every reading its channel and how many samples late it is; without sensors the states."""
    if not plan.sensors:
        return [(model.names[i], 0) for i in model.vehicle]
    return [
        (f"{s.kind}.{name}", at.delay) for s, at in zip(plan.sensors, plan.sampling, strict=True) for name in s.channels
    ]


def _closed(
    plant: tuple[Array, Array, Array], compensator: tuple[Array, Array, Array, Array], noisy: bool
) -> tuple[Array, tuple[Array, Array]]:
    """The closed loop's matrix, and how process noise (on the plant) and measurement noise enter it."""
    A, B, H = plant
    Ac, Bc, Cc, Dc = compensator
    closed = np.block([[A + B @ Dc @ H, B @ Cc], [Bc @ H, Ac]])
    by_process = np.vstack([np.eye(A.shape[0]), np.zeros((Ac.shape[0], A.shape[0]))])
    by_noise = np.vstack([B @ Dc, Bc]) if noisy else np.zeros((closed.shape[0], 0))
    return closed, (by_process, by_noise)


def _spread(model: SampledObserverModel, closed: Array, entering: tuple[Array, Array]) -> dict[str, float]:
    """Standard deviations of the vehicle's states: white noise, and disturbing accelerations as they are coloured."""
    by_process, by_noise = entering
    m = list(model.driven)
    d = [model.names.index(f"disturbance {name}") for name in DISTURBED]
    fade, push = model.F[np.ix_(d, d)], model.F[np.ix_(m, d)]
    size = closed.shape[0]
    joined = np.block([[closed, by_process @ push], [np.zeros((6, size)), fade]])
    noise = np.zeros((size + 6, size + 6))
    noise[:size, :size] = by_process @ model.process[np.ix_(m, m)] @ by_process.T + by_noise @ model.noise @ by_noise.T
    noise[size:, size:] = model.process[np.ix_(d, d)]
    P = scipy.linalg.solve_discrete_lyapunov(joined, noise, method="bilinear")
    return {model.names[m[i]]: float(np.sqrt(max(P[i, i], 0.0))) for i in range(len(m)) if m[i] in model.vehicle}
