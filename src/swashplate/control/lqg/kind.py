"""Linear-quadratic controllers among the kinds: file, loop, C, another vehicle, and how it differs from their own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.judged_loop import Aircraft, JudgedLoop, judged_with_states
from swashplate.control.analysis.margins import Margins
from swashplate.control.kinds import ControllerKind, TracedStep
from swashplate.control.lqg.analysis import sensitivity
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.file import lqg_document, lqg_from
from swashplate.control.lqg.steady_loop import observed_loop
from swashplate.engine.equations import parameter_row
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.trim import Trim

_COMPARED = ("p", "q", "r", "w")
"""States whose answers to an input are compared."""
_NAMED = 4
"""Numbers of the card that are named, those that differ most."""
_ALIKE = 1e-9


def differences(controller: Lqg, flying: Aircraft, margins: Margins | None) -> tuple[str, ...]:
    """What differs; empty where the controller was designed on what flies.

    Args:
        controller: with the model of its design.
        flying: who flies, where, how late.
        margins: of the loop; the answers to an input are compared at its crossover, at 5 rad/s where there is none.
    """
    vehicle = flying.vehicle
    listed = [*_numbers(controller, flying), *_options(controller, flying), *_delays(controller, flying)]
    if not listed and controller.vehicle.name == vehicle.name:
        return ()
    designed = controller.vehicle.card.title
    head = f"The controller was designed on another model ('{designed}') than the one flown ('{vehicle.card.title}')."
    return (head, *listed, *_answers(controller, flying, margins))


def _numbers(controller: Lqg, flying: Aircraft) -> list[str]:
    """Numbers of the card that differ, where the equations are the same."""
    designed, theirs = controller.vehicle.card.values(), flying.vehicle.card.values()
    if controller.vehicle.name != flying.vehicle.name:
        return [f"Equations: '{controller.vehicle.name}' against '{flying.vehicle.name}'."]
    apart = {}
    for name in sorted(designed.keys() | theirs.keys()):
        a, b = designed.get(name, 0.0), theirs.get(name, 0.0)
        size = max(abs(a), abs(b))
        if size and abs(a - b) > _ALIKE * size:
            apart[name] = abs(a - b) / size
    most = sorted(apart, key=lambda name: -apart[name])[:_NAMED]
    listed = ", ".join(f"{name} {designed.get(name, 0.0):.4g} against {theirs.get(name, 0.0):.4g}" for name in most)
    rest = f" and {len(apart) - _NAMED} more" if len(apart) > _NAMED else ""
    return [f"Numbers of the card (design against flown): {listed}{rest}."] if apart else []


def _options(controller: Lqg, flying: Aircraft) -> list[str]:
    designed, theirs = controller.vehicle.card.options, flying.vehicle.card.options
    if controller.vehicle.name != flying.vehicle.name:
        return []
    names = [name for name in sorted(designed.keys() | theirs.keys()) if designed.get(name) != theirs.get(name)]
    listed = ", ".join(f"{name} {designed.get(name)!r} against {theirs.get(name)!r}" for name in names)
    return [f"Options (design against flown): {listed}."] if names else []


def _delays(controller: Lqg, flying: Aircraft) -> list[str]:
    """Inputs that are later than was designed for, or earlier by more than a sample."""
    names = []
    for name, believed in controller.delays.items():
        real = flying.delays.get(name, 0.0)
        if real > believed + _ALIKE or real < believed - 1.0 / controller.rate:
            names.append(f"{name} {1e3 * believed:.3g} against {1e3 * real:.3g} ms")
    return [f"Delays (design against flown): {', '.join(names)}."] if names else []


def _answers(controller: Lqg, flying: Aircraft, margins: Margins | None) -> list[str]:
    """Relative difference of the answers in p, q, r and w to each input, delays included, at its crossover."""
    at = int(np.argmin(np.abs(np.asarray(controller.feedback.speeds) - flying.trim.speed)))
    start = controller.start
    own_trim = replace(
        start,
        state=np.asarray(controller.feedback.states)[at],
        inputs=np.asarray(controller.feedback.inputs)[at],
        speed=float(np.asarray(controller.feedback.speeds)[at]),
    )
    designed, theirs = linearize(controller.vehicle, own_trim), linearize(flying.vehicle, flying.trim)
    crossovers = {a.name: a.crossover for a in margins.axes} if margins is not None else {}
    apart = []
    for name in designed.inputs:
        w = crossovers.get(name, float("nan"))
        w = w if np.isfinite(w) else 5.0
        a = _answer(designed, name, w, controller.delays.get(name, 0.0))
        b = _answer(theirs, name, w, flying.delays.get(name, 0.0))
        size = float(np.linalg.norm(a))
        if size > 0.0:
            apart.append(f"{name} {100.0 * float(np.linalg.norm(b - a)) / size:.0f} % at {w:.3g} rad/s")
    return [f"Answers of p, q, r and w to the inputs differ by: {', '.join(apart)}."] if apart else []


def _answer(model: LinearModel, name: str, w: float, delay: float) -> NDArray[np.complex128]:
    n = len(model.states)
    column = model.B[:, model.inputs.index(name)]
    states = np.linalg.solve(1j * w * np.eye(n) - model.A, column.astype(complex))
    picked = [states[model.states.index(state)] for state in _COMPARED]
    return np.asarray(np.array(picked) * np.exp(-1j * w * delay), dtype=np.complex128)


def flown_on(controller: Lqg, vehicle: Vehicle, trim: Trim) -> Lqg:
    """The controller with its deviations counted from another vehicle's trim, and that vehicle's limits.

    The observer goes on predicting with the linear model; states of the same name start at the trim's.

    Args:
        controller: designed on a linear model, with sensors (another vehicle has other states to be fed with).
        vehicle: with the same inputs in the same order.
        trim: where it flies.

    Raises:
        ControllerError: where the inputs are not the same, or it has no sensors.
    """
    if not controller.plan.sensors:
        raise ControllerError(
            "is fed with the linear model's states, which another vehicle does not have.",
            where=controller.vehicle.card.title,
            hint="Design it with --method lqg: sensors read the same of both.",
        )
    designed = about(controller.vehicle, trim)
    numbers = designed.card.values()
    named = {name: numbers.get(f"trim_{name}", 0.0) for name in designed.state_names}
    state = np.array([trim.states().get(name, value) for name, value in named.items()])
    limits = np.array(vehicle.input_limits)
    feedback = controller.feedback._replace(
        states=state[None], inputs=np.array(trim.inputs)[None], low=limits[:, 0], high=limits[:, 1]
    )
    return replace(
        controller,
        vehicle=designed,
        feedback=feedback,
        numbers=controller.numbers._replace(parameters=parameter_row(designed, trim.environment)),
        start=replace(trim, state=state, state_names=designed.state_names),
    )


def about(vehicle: Vehicle, trim: Trim) -> Vehicle:
    """A linear vehicle about another vehicle's trim: where it flies, deviations count from there.

    Args:
        vehicle: linear.
        trim: of the vehicle that is to be flown; states of the same name move, others keep theirs.

    Raises:
        ControllerError: where the inputs are not the same.
    """
    if trim.input_names != vehicle.input_names:
        raise ControllerError(
            f"has the inputs {', '.join(vehicle.input_names)}, the aircraft {', '.join(trim.input_names)}.",
            where=vehicle.card.title,
        )
    at_trim = {**trim.states(), **trim.commands()}
    names = {f"trim_{n}": at_trim[n] for n in (*vehicle.card.options["states"], *vehicle.input_names) if n in at_trim}
    return vehicle.with_values(names, source="derived: the trim that it is flown at", status="derived")


_OBSERVED = (
    "With an observer, modes, margins and disturbance rejection are those of its steady filter about the flown "
    "vehicle; a disturbance is added to a state in every sensor that shows it. It takes no pilot's command, so there "
    "is no bandwidth; the steps are flown with its noisy sensors."
)
_POINTS = 400
"""Of the frequency grid with an observer."""


class LqgKind(ControllerKind[Lqg]):
    """With sensors (LQG) or fed with the states (LQR)."""

    takes_stick = False
    own_sensors = True

    def about(self, controller: Lqg, vehicle: Vehicle, trim: Trim, *, seed: int = 0) -> Lqg:
        designed = controller.vehicle
        if designed.traits.linear and not vehicle.traits.linear:
            return replace(flown_on(controller, vehicle, trim), seed=seed)
        if designed.name != vehicle.name:
            raise ControllerError(f"is for '{designed.name}', not for '{vehicle.name}'.", where=designed.card.title)
        return controller.starting_at(trim, seed=seed)

    def judged(self, controller: Lqg, flying: Aircraft) -> JudgedLoop:
        if not controller.plan.sensors:
            return judged_with_states(controller, flying)
        at = int(np.argmin(np.abs(np.asarray(controller.feedback.speeds) - flying.trim.speed)))
        place = float(controller.feedback.place) > 0.5

        def left(frequencies: Array, state: str) -> Complex | None:
            return sensitivity(controller, frequencies, state, at=at, on=flying)

        return JudgedLoop(
            observed_loop(controller, at=at, on=flying, where=flying.vehicle.name),
            ("psi", "z", *(("x", "y") if place else ("ahead", "right"))),
            left,
            points=_POINTS,
            notes=(_OBSERVED,),
        )

    def differences(self, controller: Lqg, flying: Aircraft, margins: Margins | None) -> tuple[str, ...]:
        return differences(controller, flying, margins)

    def to_document(self, controller: Lqg) -> dict[str, Any]:
        return lqg_document(controller)

    def from_document(self, document: dict[str, Any], path: str) -> Lqg:
        return lqg_from(document, path)

    def traced(self, controller: Lqg) -> TracedStep:
        vehicle, plan = controller.vehicle, controller.plan
        return TracedStep(
            controller.graph(),
            tuple(controller.inner_memory.tolist()),
            "estimates, their covariance, commands given, counts, integrals and speeds",
            (*(plan.channels if plan.sensors else vehicle.state_names), "voltage"),
            vehicle.input_names,
            f"{vehicle.name}, LQG, designed on: {vehicle.card.title}",
        )


KIND = LqgKind()
