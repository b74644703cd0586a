"""What a linear-quadratic controller will do before it flies: modes, margins and expected spread, from linear algebra.

The observer is taken steady here, with every sensor heard at every sample and its noise raised so that the information
per second stays; late sensors and late commands are chains of samples. Everything is sampled; nothing is flown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from swashplate.control.lqg import Lqg
from swashplate.control.lqg_design import typical
from swashplate.control.margins import Margins, margins
from swashplate.control.observer import DISTURBED, Numbers, Plan
from swashplate.control.optimal import steady_filter
from swashplate.control.seen import Seen, seen
from swashplate.errors import ControllerError
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.trim import Trim

Array = NDArray[np.float64]
_LOWEST = 0.02
"""rad/s."""
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
        delay: the same further delay in every opened loop that makes it unstable [s].
    """

    modes: NDArray[np.complex128]
    margins: Margins
    spread: dict[str, float]
    uncertainty: dict[str, float]
    delay: float


def analyse(controller: Lqg, *, at: int = 0, points: int = 240, where: str = "") -> Analysis:
    """Modes, margins and spread about the trim with the number `at`.

    Raises:
        ControllerError: where the loop is not stable, or no steady observer exists (with the direction).
    """
    f = controller.feedback
    trim = _trim_of(controller, at)
    return analyse_loop(
        controller.plan,
        controller.numbers,
        linearize(controller.vehicle, trim),
        np.asarray(f.gains)[at],
        place=float(f.place) > 0.5,
        points=points,
        where=where or controller.vehicle.card.path or controller.vehicle.name,
    )


def analyse_loop(
    plan: Plan,
    numbers: Numbers,
    model: LinearModel,
    gains: Array,
    *,
    place: bool,
    later: Sequence[int] | None = None,
    opened: Sequence[str] | None = None,
    points: int = 240,
    where: str = "",
) -> Analysis:
    """The same for a gain over `lqg_design.design_states` and a linear model.

    Args:
        plan, numbers: the observer.
        model: its columns may end in actuators' states.
        gains: (inputs, states with late commands and integrals).
        place: whether a place is held.
        later: delays of the real inputs in samples, where they are not those that the controller believes in.
        opened: inputs at which the loop is opened, all where not given; the others stay closed.
        points: of the frequency grid.
        where: the model's name.
    """
    parts = steady_loop(plan, numbers, model, gains, place=place, later=later, where=where)
    known, truth, plant, compensator, P = parts
    closed, entering = _closed(plant, compensator, bool(plan.sensors))
    values = np.linalg.eigvals(closed).astype(np.complex128)
    values = values[np.abs(values) > 1e-8]
    modes = np.asarray(np.log(values) * plan.rate, dtype=np.complex128)
    modes = modes[np.argsort(-modes.real, kind="stable")]
    if modes[0].real >= 0.0:
        raise ControllerError(
            f"the loop at {plan.rate:g} Hz has a growing mode at {modes[0].real:+.3g} "
            f"+- {abs(modes[0].imag):.3g}j 1/s.",
            where=where,
            hint="Ask for less (larger allowed deviations), run it faster, or cut the delays.",
        )
    w = np.geomspace(_LOWEST, np.pi * plan.rate * 0.999, points)
    z = np.exp(1j * w / plan.rate)
    A, B, H = plant
    loop = -_response(z, *compensator) @ _response(z, A, B, H, None)
    if opened is not None:
        kept = [model.inputs.index(name) for name in opened]
        inner = np.linalg.inv(np.eye(plan.inputs) + loop)[:, kept][:, :, kept]
        loop = np.linalg.inv(inner) - np.eye(len(kept))
    labels = tuple(opened or model.inputs)
    moved = [j for j in range(len(labels)) if np.any(np.abs(loop[:, j, j]) > 1e-12)]
    loop, names = loop[:, moved][:, :, moved], tuple(labels[j] for j in moved)
    return Analysis(
        modes,
        margins(w, loop, names),
        _spread(truth, closed, entering),
        {n: float(np.sqrt(max(P[i, i], 0.0))) for i, n in enumerate(known.names)} if plan.sensors else {},
        _delay_margin(w, loop),
    )


class SteadyLoop(NamedTuple):
    """A controller with its steady observer about a trim, and what it controls.

    Attributes:
        known, truth: the observer's model, and the aircraft (other delays).
        plant: (A, B, H) of the truth without disturbances and biases.
        compensator: (A, B, C, D) from readings to commands.
        covariance: of the estimates.
    """

    known: Seen
    truth: Seen
    plant: tuple[Array, Array, Array]
    compensator: tuple[Array, Array, Array, Array]
    covariance: Array


def steady_loop(
    plan: Plan,
    numbers: Numbers,
    model: LinearModel,
    gains: Array,
    *,
    place: bool,
    later: Sequence[int] | None = None,
    where: str = "",
) -> SteadyLoop:
    """The parts of a loop; arguments as in `analyse_loop`."""
    known = seen(plan, numbers, model, without=() if place else ("x", "y"))
    truth = known
    if later is not None:
        truth = seen(replace(plan, delays=tuple(later)), numbers, model, without=() if place else ("x", "y"))
    K, C = _gains(plan, model, gains, known, place)
    plant = _plant(truth)
    L, P = None, np.zeros_like(known.F)
    if plan.sensors:
        scale = np.array([typical(n.split(" ")[-1] if n.startswith(("dist", "bias")) else n) for n in known.names])
        L, P = steady_filter(known.F, known.H, known.process, known.noise, known.names, scale=scale, where=where)
        P = P - L @ known.H @ P
    return SteadyLoop(known, truth, plant, _compensator(known, K, C, L, plan.dt), P)


def sensitivity(controller: Lqg, frequencies: Array, state: str, *, at: int = 0) -> NDArray[np.complex128] | None:
    """What is left of a disturbance added to a state wherever a sensor shows it: (state + disturbance) / disturbance.

    Args:
        controller: with or without sensors.
        frequencies: [rad/s], below Nyquist's.
        state: its name; a height by sonar or pressure counts as z.
        at: number of the trim.

    Returns:
        One number per frequency; None where no sensor shows the state.
    """
    plan, f = controller.plan, controller.feedback
    parts = steady_loop(
        plan,
        controller.numbers,
        linearize(controller.vehicle, _trim_of(controller, at)),
        np.asarray(f.gains)[at],
        place=float(f.place) > 0.5,
    )
    names = [parts.truth.names[i] for i in parts.truth.moved]
    if state not in names:
        return None
    (_, B, _), (_, Bc, _, Dc) = parts.plant, parts.compensator
    closed, _ = _closed(parts.plant, parts.compensator, bool(plan.sensors))
    drive, shown = np.zeros(closed.shape[0]), False
    for i, (channel, late) in enumerate(_channels(plan, parts.truth)):
        name, sign = _SHOWN_AS.get(channel.split(".")[-1], (channel.split(".")[-1], 1.0))
        if name != state:
            continue
        shown = True
        if late:  # it enters the chain of samples that are on their way
            drive[names.index(f"{channel} 1 ago")] += sign
        else:
            drive += sign * np.concatenate([B @ Dc[:, i], Bc[:, i]])
    if not shown:
        return None
    pick = np.zeros((1, closed.shape[0]))
    pick[0, names.index(state)] = 1.0
    z = np.exp(1j * np.asarray(frequencies) / plan.rate)
    return np.asarray(1.0 + _response(z, closed, drive[:, None], pick, None)[:, 0, 0], dtype=np.complex128)


def _channels(plan: Plan, model: Seen) -> list[tuple[str, int]]:
    """Of every reading its channel and how many samples late it is; without sensors the states."""
    if not plan.sensors:
        return [(model.names[i], 0) for i in model.vehicle]
    return [
        (f"{s.kind}.{name}", at.late) for s, at in zip(plan.sensors, plan.sampling, strict=True) for name in s.channels
    ]


def _delay_margin(w: Array, loop: Any) -> float:
    """Delay in all loops at which an eigenvalue of L e^(-jwT) becomes -1 (MacFarlane and Postlethwaite 1977)."""
    found = float("inf")
    values = np.linalg.eigvals(loop)
    sizes = np.log(np.sort(np.abs(values), axis=1))
    order = np.argsort(np.abs(values), axis=1)
    turned = np.mod(np.pi + np.angle(np.take_along_axis(values, order, axis=1)), 2.0 * np.pi)
    for size, phase in zip(sizes.T, turned.T, strict=True):
        for i in np.flatnonzero(np.diff(np.sign(size))):
            share = size[i] / (size[i] - size[i + 1])
            at = w[i] * (w[i + 1] / w[i]) ** share
            ends = np.unwrap(phase[i : i + 2])
            found = min(found, float(np.mod(ends[0] + share * (ends[1] - ends[0]), 2.0 * np.pi) / at))
    return found


def _trim_of(controller: Lqg, at: int) -> Trim:
    f = controller.feedback
    return replace(
        controller.start,
        state=np.asarray(f.states)[at],
        inputs=np.asarray(f.inputs)[at],
        speed=float(np.asarray(f.speeds)[at]),
    )


def _gains(plan: Plan, linear: LinearModel, gains: Array, model: Seen, place: bool) -> tuple[Array, Array]:
    """Gains over the model's states and the four integrals, and what the integrals are fed with."""
    of = [
        *linear.states,
        *(f"{linear.inputs[j]} {ago} ago" for j, d in enumerate(plan.delays) for ago in range(1, d + 1)),
    ]
    K = np.zeros((plan.inputs, len(model.names) + 4))
    for column, name in enumerate(of):
        if name in model.names:
            K[:, model.names.index(name)] = gains[:, column]
    K[:, len(model.names) :] = gains[:, len(of) :]
    C = np.zeros((4, len(model.names)))
    for row, name in enumerate(("x", "y", "z", "psi") if place else ("u", "v", "z", "psi")):
        C[row, model.names.index(name)] = 1.0
    return K, C


def _plant(model: Seen) -> tuple[Array, Array, Array]:
    m = list(model.moved)
    H = model.H[:, m] if model.H.size else np.eye(len(model.names))[list(model.vehicle)][:, m]
    return model.F[np.ix_(m, m)], model.G[m], H


def _compensator(model: Seen, K: Array, C: Array, L: Array | None, dt: float) -> tuple[Array, Array, Array, Array]:
    """(A, B, C, D) from readings (states without sensors) to commands; its states: prediction and integrals."""
    N = model.F.shape[0]
    Ks, Kq = K[:, :N], K[:, N:]
    if L is None:
        # What it carries: waiting commands (the tail of the model's chain) and the integrals.
        pick = np.zeros((N, len(model.vehicle)))
        pick[list(model.vehicle), range(len(model.vehicle))] = 1.0
        chain = [i for i, name in enumerate(model.names) if name.endswith(" ago")]
        Fw, Gw = model.F[np.ix_(chain, chain)], model.G[chain]
        Kw = Ks[:, chain]
        A = np.block([[Fw - Gw @ Kw, -Gw @ Kq], [np.zeros((4, len(chain))), np.eye(4)]])
        B = np.vstack([-Gw @ Ks @ pick, dt * C @ pick])
        return A, B, np.hstack([-Kw, -Kq]), -Ks @ pick
    keep = np.eye(N) - L @ model.H
    Cu, Du = -Ks @ keep, -Ks @ L
    A = np.block([[model.F @ keep + model.G @ Cu, -model.G @ Kq], [dt * C @ keep, np.eye(4)]])
    B = np.vstack([model.F @ L + model.G @ Du, dt * C @ L])
    return A, B, np.hstack([Cu, -Kq]), Du


def _closed(plant: Any, compensator: Any, noisy: bool) -> tuple[Array, tuple[Array, Array]]:
    """The closed loop's matrix, and how process noise (on the plant) and measurement noise enter it."""
    A, B, H = plant
    Ac, Bc, Cc, Dc = compensator
    whole = np.block([[A + B @ Dc @ H, B @ Cc], [Bc @ H, Ac]])
    by_process = np.vstack([np.eye(A.shape[0]), np.zeros((Ac.shape[0], A.shape[0]))])
    by_noise = np.vstack([B @ Dc, Bc]) if noisy else np.zeros((whole.shape[0], 0))
    return whole, (by_process, by_noise)


def _spread(model: Seen, closed: Array, entering: tuple[Array, Array]) -> dict[str, float]:
    """Standard deviations of the vehicle's states: white noise, and disturbing accelerations as they are coloured."""
    by_process, by_noise = entering
    m = list(model.moved)
    d = [model.names.index(f"disturbance {name}") for name in DISTURBED]
    fade, push = model.F[np.ix_(d, d)], model.F[np.ix_(m, d)]
    size = closed.shape[0]
    whole = np.block([[closed, by_process @ push], [np.zeros((6, size)), fade]])
    noise = np.zeros((size + 6, size + 6))
    noise[:size, :size] = by_process @ model.process[np.ix_(m, m)] @ by_process.T + by_noise @ model.noise @ by_noise.T
    noise[size:, size:] = model.process[np.ix_(d, d)]
    P = scipy.linalg.solve_discrete_lyapunov(whole, noise, method="bilinear")
    return {model.names[m[i]]: float(np.sqrt(max(P[i, i], 0.0))) for i in range(len(m)) if m[i] in model.vehicle}


def _response(z: Any, A: Array, B: Array, C: Array, D: Array | None) -> Any:
    """C (z - A)^-1 B + D over the frequencies, by the Schur form: one decomposition for all of them."""
    T, U = scipy.linalg.schur(A, output="complex")
    right, left = U.conj().T @ B, C @ U
    found = np.array(
        [left @ scipy.linalg.solve_triangular(value * np.eye(len(T)) - T, right, check_finite=False) for value in z]
    )
    return found if D is None else found + D
