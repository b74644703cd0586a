"""What a linear-quadratic controller will do before it flies: modes, margins and expected spread, from linear algebra.

The observer is taken steady here, with every sensor heard at every sample and its noise raised so that the information
per second stays; late sensors and late commands are chains of samples. Everything is sampled; nothing is flown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from swashplate.control import observer
from swashplate.control.lqg import Lqg, late_inputs
from swashplate.control.lqg_design import typical
from swashplate.control.margins import Margins, margins
from swashplate.control.matrices import JaxMatrices
from swashplate.control.observer import DISTURBED, Numbers, Plan
from swashplate.control.optimal import delayed, sampled, steady_filter
from swashplate.errors import ControllerError
from swashplate.simulation.compilation import QUICK_TO_COMPILE
from swashplate.simulation.dynamics import enable_double_precision
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim

Array = NDArray[np.float64]
_LOWEST = 0.02
"""rad/s."""


@dataclass(frozen=True)
class Seen:
    """The sampled model that an observer works with about a trim.

    Attributes:
        F, G: of states, disturbances, biases, late readings and waiting commands.
        H: outputs.
        process, noise: covariances per sample; the noise of a sensor that is heard every k-th time is k times its own.
        names: of its states.
        vehicle: places of the vehicle's states in it; all but disturbances and biases follow the vehicle.
        moved: places of what a truth without disturbances and biases has.
    """

    F: Array
    G: Array
    H: Array
    process: Array
    noise: Array
    names: tuple[str, ...]
    vehicle: tuple[int, ...]
    moved: tuple[int, ...]


def seen(controller: Lqg, trim: Trim, *, without: Sequence[str] = ()) -> Seen:
    """The observer's linear model about a trim, some states left out (a place that nothing sees)."""
    plan, numbers = controller.plan, controller.numbers
    model = linearize(controller.vehicle, trim)
    n, nb = plan.n, len(plan.biases)
    own = n + 6 + nb
    A = np.zeros((own, own))
    A[:n, :n] = model.A
    for i, name in enumerate(DISTURBED):
        A[model.states.index(name), n + i] = 1.0
    A[n : n + 6, n : n + 6] = -np.diag(np.asarray(numbers.fade))
    B = np.zeros((own, plan.inputs))
    B[:n] = model.B
    F, G = sampled(A, B, plan.dt)
    H = outputs(plan, numbers, trim)[:, :own]
    names = [*model.states, *(f"disturbance {d}" for d in DISTURBED), *(f"bias {b}" for b in plan.biases)]
    process = np.asarray(numbers.process)[:own]
    F, H, added = _late_readings(F, H, plan)
    G = np.vstack([G, np.zeros((len(added), plan.inputs))])
    names += added
    F, G, waiting = delayed(F, G, plan.delays)
    H = np.hstack([H, np.zeros((H.shape[0], len(waiting)))])
    names += [f"{model.inputs[j]} {ago} ago" for j, ago in waiting]
    every = [at.every for s, at in zip(plan.sensors, plan.sampling, strict=True) for _ in s.channels]
    noise = np.diag(np.asarray(numbers.measurement) * every)
    full = np.zeros(len(names))
    full[:own] = process
    kept = [i for i, name in enumerate(names) if name not in without]
    names = [names[i] for i in kept]
    vehicle = tuple(names.index(name) for name in model.states if name not in without)
    unmoved = {f"disturbance {d}" for d in DISTURBED} | {f"bias {b}" for b in plan.biases}
    moved = tuple(i for i, name in enumerate(names) if name not in unmoved)
    return Seen(F[np.ix_(kept, kept)], G[kept], H[:, kept], np.diag(full[kept]), noise, tuple(names), vehicle, moved)


def _late_readings(F: Array, H: Array, plan: Plan) -> tuple[Array, Array, list[str]]:
    """The model with chains of samples for readings that arrive late."""
    channel, names = 0, []
    for sensor, at in zip(plan.sensors, plan.sampling, strict=True):
        rows = slice(channel, channel + len(sensor.channels))
        channel = rows.stop
        for step in range(at.late):
            size, m = F.shape[0], len(sensor.channels)
            larger = np.zeros((size + m, size + m))
            larger[:size, :size], larger[size:, :size] = F, H[rows]
            wider = np.hstack([H, np.zeros((H.shape[0], m))])
            wider[rows] = 0.0
            wider[rows, size:] = np.eye(m)
            F, H = larger, wider
            names += [f"{sensor.kind}.{name} {step + 1} ago" for name in sensor.channels]
    return F, H, names


def outputs(plan: Plan, numbers: Numbers, trim: Trim) -> Array:
    """Slopes of all channels by everything estimated, about a trim."""
    enable_double_precision()
    if not plan.sensors:
        return np.zeros((0, len(plan.names)))
    e = np.zeros((len(plan.names), 1))
    e[: plan.n, 0] = trim.state
    w = np.array([*trim.inputs, float(trim.environment.voltage)])[:, None]
    made = Numbers(*(jnp.asarray(part) for part in numbers))
    return np.asarray(_outputs(plan, made, jnp.asarray(e), jnp.asarray(w)), dtype=np.float64)


@partial(jax.jit, static_argnums=0, compiler_options=QUICK_TO_COMPILE)
def _outputs(plan: Plan, numbers: Numbers, e: Any, w: Any) -> Any:
    M = JaxMatrices()
    return M.linearised(lambda e, w: observer.shown(plan, numbers, e, w, M.xp), e, w)[1]


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


def analyse(controller: Lqg, *, at: int = 0, points: int = 240, where: str = "") -> Analysis:
    """Modes, margins and spread about the trim with the number `at`.

    Raises:
        ControllerError: where the loop is not stable, or no steady observer exists (with the direction).
    """
    plan, f = controller.plan, controller.feedback
    trim = controller.start if len(f.speeds) == 1 else _trim_of(controller, at)
    place = float(f.place) > 0.5
    without = () if place else ("x", "y")
    name = where or controller.vehicle.card.path or controller.vehicle.name
    model = seen(controller, trim, without=without)
    K, C = _gains(controller, at, model, place)
    plant = _plant(model)
    if plan.sensors:
        scale = np.array([typical(n.split(" ")[-1] if n.startswith(("dist", "bias")) else n) for n in model.names])
        L, P = steady_filter(model.F, model.H, model.process, model.noise, model.names, scale=scale, where=name)
        P = P - L @ model.H @ P
    else:
        L, P = None, np.zeros_like(model.F)
    compensator = _compensator(model, K, C, L, plan.dt)
    closed, entering = _closed(model, plant, compensator, L is not None)
    values = np.linalg.eigvals(closed).astype(np.complex128)
    values = values[np.abs(values) > 1e-8]
    modes = np.log(values) * plan.rate
    modes = modes[np.argsort(-modes.real, kind="stable")]
    if modes[0].real >= 0.0:
        raise ControllerError(
            f"the loop at {plan.rate:g} Hz has a growing mode at {modes[0].real:+.3g} +- {abs(modes[0].imag):.3g}j 1/s.",
            where=name,
            hint="Ask for less (larger allowed deviations), run it faster, or cut the delays.",
        )
    w = np.geomspace(_LOWEST, np.pi * plan.rate * 0.999, points)
    z = np.exp(1j * w / plan.rate)
    A, B, H = plant
    response = _response(z, A, B, H, None)
    loop = -_response(z, *compensator) @ response
    spread = _spread(model, closed, entering, plan)
    uncertainty = {n: float(np.sqrt(max(P[i, i], 0.0))) for i, n in enumerate(model.names)} if L is not None else {}
    moved = [j for j in range(plan.inputs) if np.any(np.abs(loop[:, j, j]) > 1e-12)]
    picked = loop[:, moved][:, :, moved]
    names = tuple(controller.vehicle.input_names[j] for j in moved)
    return Analysis(modes, margins(w, picked, names), spread, uncertainty)


def _trim_of(controller: Lqg, at: int) -> Trim:
    from dataclasses import replace

    f = controller.feedback
    return replace(
        controller.start,
        state=np.asarray(f.states)[at],
        inputs=np.asarray(f.inputs)[at],
        speed=float(np.asarray(f.speeds)[at]),
    )


def _gains(controller: Lqg, at: int, model: Seen, place: bool) -> tuple[Array, Array]:
    """Gains over the model's states and the four integrals, and what the integrals are fed with."""
    plan = controller.plan
    gains = np.asarray(controller.feedback.gains)[at]
    of = [*controller.vehicle.state_names]
    counts: dict[int, int] = {}
    for j in late_inputs(plan):
        counts[j] = counts.get(j, 0) + 1
        of.append(f"{controller.vehicle.input_names[j]} {counts[j]} ago")
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
    N, m = model.F.shape[0], model.G.shape[1]
    Ks, Kq = K[:, :N], K[:, N:]
    if L is None:
        # What it carries: waiting commands (the tail of the model's chain) and the integrals.
        pick = np.zeros((N, len(model.vehicle)))
        pick[list(model.vehicle), range(len(model.vehicle))] = 1.0
        chain = [i for i, name in enumerate(model.names) if name.endswith(" ago")]
        Fw, Gw = model.F[np.ix_(chain, chain)], model.G[chain]
        Kw = Ks[:, chain]
        A = np.block(
            [[Fw - Gw @ Kw, -Gw @ Kq], [np.zeros((4, len(chain))), np.eye(4)]]
        )
        B = np.vstack([-Gw @ Ks @ pick, dt * C @ pick])
        return A, B, np.hstack([-Kw, -Kq]), -Ks @ pick
    keep = np.eye(N) - L @ model.H
    Cu, Du = -Ks @ keep, -Ks @ L
    A = np.block([[model.F @ keep + model.G @ Cu, -model.G @ Kq], [dt * C @ keep, np.eye(4)]])
    B = np.vstack([model.F @ L + model.G @ Du, dt * C @ L])
    return A, B, np.hstack([Cu, -Kq]), Du


def _closed(model: Seen, plant: Any, compensator: Any, noisy: bool) -> tuple[Array, tuple[Array, Array]]:
    """The closed loop's matrix, and how process noise (on the plant) and measurement noise enter it."""
    A, B, H = plant
    Ac, Bc, Cc, Dc = compensator
    whole = np.block([[A + B @ Dc @ H, B @ Cc], [Bc @ H, Ac]])
    by_process = np.vstack([np.eye(A.shape[0]), np.zeros((Ac.shape[0], A.shape[0]))])
    by_noise = np.vstack([B @ Dc, Bc]) if noisy else np.zeros((whole.shape[0], 0))
    return whole, (by_process, by_noise)


def _spread(model: Seen, closed: Array, entering: tuple[Array, Array], plan: Plan) -> dict[str, float]:
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
    return {
        model.names[m[i]]: float(np.sqrt(max(P[i, i], 0.0))) for i in range(len(m)) if m[i] in model.vehicle
    }


def _response(z: Any, A: Array, B: Array, C: Array, D: Array | None) -> Any:
    """C (z - A)^-1 B + D over the frequencies, by the Schur form: one decomposition for all of them."""
    T, U = scipy.linalg.schur(A, output="complex")
    right, left = U.conj().T @ B, C @ U
    found = np.array(
        [left @ scipy.linalg.solve_triangular(value * np.eye(len(T)) - T, right, check_finite=False) for value in z]
    )
    return found if D is None else found + D
