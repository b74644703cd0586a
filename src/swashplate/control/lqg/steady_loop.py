"""A linear-quadratic controller with its steady observer about a trim, as one sampled loop.

The observer is taken steady, with every sensor heard at every sample and its noise raised so that the information per
second stays; late sensors and late commands are chains of samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.sampled_loop import SampledLoop
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.optimal import steady_filter, typical
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.engine.law import REFERENCES
from swashplate.errors import ControllerError
from swashplate.filtering import observer
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.filtering.sampled_observer_model import SampledObserverModel, sampled_observer_model
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.trim import Trim

Truth = Callable[[Array], SampledObserverModel]
"""What an aircraft is with further delays of its inputs [s]."""
_LOWEST = 0.02
"""rad/s."""


class SteadyLoop(NamedTuple):
    """A controller with its steady observer about a trim, and what it controls.

    Attributes:
        known, truth: the observer's model, and the aircraft.
        plant: (A, B, H) of the truth without disturbances and biases.
        compensator: (A, B, C, D) from readings to commands.
        covariance: of the estimates.
        loop: all of it, from sample to sample.
    """

    known: SampledObserverModel
    truth: SampledObserverModel
    plant: tuple[Array, Array, Array]
    compensator: tuple[Array, Array, Array, Array]
    covariance: Array
    loop: SampledLoop


class Watched:
    """A steady observer about a trim, found once for any gains.

    Args:
        plan, numbers, model, place, where: as in `analyse_loop`.
    """

    def __init__(
        self, plan: ObserverPlan, numbers: Numbers, model: LinearModel, *, place: bool, where: str = ""
    ) -> None:
        self.plan, self.model, self.place = plan, model, place
        self.known = sampled_observer_model(plan, numbers, model, without=() if place else ("x", "y"))
        self.covariance = np.zeros_like(self.known.F)
        self.gain: Array | None = None
        self.trouble: ControllerError | None = None
        if plan.sensors:
            try:
                self._watch(where)
            except ControllerError as error:
                self.trouble = error

    def _watch(self, where: str) -> None:
        known = self.known
        scale = np.array([typical(n.split(" ")[-1] if n.startswith(("dist", "bias")) else n) for n in known.names])
        self.gain, P = steady_filter(
            known.F, known.H, known.process, known.noise, known.names, scale=scale, where=where
        )
        self.covariance = P - self.gain @ known.H @ P

    def compensator(self, gains: Array) -> tuple[Array, Array, Array, Array]:
        """(A, B, C, D) from readings (without an observer from states) to commands.

        Raises:
            ControllerError: where no steady observer exists, with the direction.
        """
        if self.trouble is not None:
            raise self.trouble
        K, C = _gains(self.plan, self.model, gains, self.known, self.place)
        return _compensator(self.known, K, C, self.gain, self.plan.dt)

    def sensitivities(self, gains: Array, *, points: int = 160) -> tuple[Array, Complex]:
        """1 / (1 + L) over frequency [rad/s], shapes (n,) and (n, inputs, inputs), opened at the inputs.

        Where no steady observer exists, of the loops fed with the states.
        """
        known, plan = self.known, self.plan
        w = np.geomspace(_LOWEST, np.pi * plan.rate * 0.999, points)
        z = np.exp(1j * w / plan.rate)
        fed = replace(known, H=np.zeros((0, len(known.names)))) if self.gain is None else known
        K, C = _gains(plan, self.model, gains, known, self.place)
        A, B, H = _plant(fed)
        L = -response(z, *_compensator(known, K, C, self.gain, plan.dt)) @ response(z, A, B, H, None)
        return w, np.linalg.inv(np.eye(plan.inputs) + L)


def crossovers(w: Array, S: Complex) -> Array:
    """Highest frequency at which each loop's gain is one, the others closed [rad/s]; 0 where it never is."""
    above = np.abs(1.0 / np.einsum("kii->ki", S) - 1.0) >= 1.0
    last = np.where(above.any(axis=0), len(w) - 1 - np.argmax(above[::-1], axis=0), 0)
    return np.where(above.any(axis=0), w[last], 0.0)


def steady_loop(
    plan: ObserverPlan,
    numbers: Numbers,
    model: LinearModel,
    gains: Array,
    *,
    place: bool,
    truth: Truth | None = None,
    where: str = "",
) -> SteadyLoop:
    """The parts of a loop; arguments as in `analyse_loop`."""
    watched = Watched(plan, numbers, model, place=place, where=where)
    compensator = watched.compensator(gains)
    believed = np.array(plan.delays) * plan.dt

    def as_believed(further: Array) -> SampledObserverModel:
        without = () if place else ("x", "y")
        return sampled_observer_model(plan, numbers, model, without=without, delays=(believed + further).tolist())

    def sampled_with(further: Array) -> tuple[SampledObserverModel, SampledLoop]:
        real = (truth or as_believed)(further)
        A, B, H = _plant(real)
        Ac, Bc, Cc, Dc = compensator
        names = tuple(real.names[i] for i in real.driven)
        blind = (np.zeros((plan.inputs, len(REFERENCES))), np.zeros((len(Ac), len(REFERENCES))))
        parts = (names, model.inputs, plan.rate, A, B, np.hstack([Dc @ H, Cc]), np.hstack([Bc @ H, Ac]), *blind)
        return real, SampledLoop(*parts, later=lambda extra: sampled_with(further + extra)[1])

    real, loop = sampled_with(np.zeros(plan.inputs))
    return SteadyLoop(watched.known, real, _plant(real), compensator, watched.covariance, loop)


def observed_loop(controller: Lqg, *, at: int = 0, on: Aircraft | None = None, where: str = "") -> SampledLoop:
    """The loop with the steady observer in it; it is given no references. Arguments as in `analyse`.

    Raises:
        ControllerError: where no steady observer exists, or the aircraft is another one than the controller can fly.
    """
    return steady_loop_of(controller, at, on, where).loop


def steady_loop_of(controller: Lqg, at: int, on: Aircraft | None, where: str = "") -> SteadyLoop:
    f = controller.feedback
    return steady_loop(
        controller.plan,
        controller.numbers,
        linearize(controller.vehicle, trim_of(controller, at)),
        np.asarray(f.gains)[at],
        place=float(f.place) > 0.5,
        truth=None if on is None else seen_of(controller, on),
        where=where or controller.vehicle.card.where,
    )


def seen_of(controller: Lqg, on: Aircraft) -> Truth:
    """The aircraft as the controller's sensors and inputs have it, for further delays of the inputs [s].

    Raises:
        ControllerError: where the inputs are not the same, or another aircraft is flown without sensors.
    """
    designed, plan = controller.vehicle, controller.plan
    if on.vehicle.input_names != designed.input_names or not (
        plan.sensors or on.vehicle.state_names == designed.state_names
    ):
        raise ControllerError("was designed on an aircraft with other inputs or states.", where=designed.name)
    theirs = replace(plan, equations=equations_of(on.vehicle), period=0)
    fade, process = observer.process_noise(theirs, controller.unrest)
    row = parameter_row(on.vehicle, on.trim.environment)
    numbers = Numbers(row, fade, process, observer.measurement_noise(theirs))
    model = linearize(on.vehicle, on.trim)
    base = np.array([on.delays.get(name, 0.0) for name in designed.input_names])
    without = () if float(controller.feedback.place) > 0.5 else ("x", "y")

    def later(further: Array) -> SampledObserverModel:
        return sampled_observer_model(theirs, numbers, model, without=without, delays=(base + further).tolist())

    return later


def trim_of(controller: Lqg, at: int) -> Trim:
    f = controller.feedback
    return replace(
        controller.start,
        state=np.asarray(f.states)[at],
        inputs=np.asarray(f.inputs)[at],
        speed=float(np.asarray(f.speeds)[at]),
    )


def _gains(
    plan: ObserverPlan, linear: LinearModel, gains: Array, model: SampledObserverModel, place: bool
) -> tuple[Array, Array]:
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


def _plant(model: SampledObserverModel) -> tuple[Array, Array, Array]:
    m = list(model.driven)
    H = model.H[:, m] if model.H.size else np.eye(len(model.names))[list(model.vehicle)][:, m]
    return model.F[np.ix_(m, m)], model.G[m], H


def _compensator(
    model: SampledObserverModel, K: Array, C: Array, L: Array | None, dt: float
) -> tuple[Array, Array, Array, Array]:
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


def response(z: Complex, A: Array, B: Array, C: Array, D: Array | None) -> Any:
    """C (z - A)^-1 B + D over the frequencies, by the Schur form: one decomposition for all of them."""
    T, U = scipy.linalg.schur(A, output="complex")
    right, left = U.conj().T @ B, C @ U
    poles, along, rest = np.diag(T).copy(), np.diag_indices_from(T), np.asfortranarray(-T)
    if np.isin(z, poles).any():
        raise np.linalg.LinAlgError("a frequency is a pole of the system.")
    values = np.empty((len(z), len(C), B.shape[1]), dtype=np.complex128)
    for value, one in zip(z, values, strict=True):
        rest[along] = value - poles
        one[:] = left @ scipy.linalg.blas.ztrsm(1.0, rest, right)  # `solve_triangular` takes twice as long around it
    return values if D is None else values + D
