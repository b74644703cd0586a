"""By how much what flies differs from the model that a controller was designed on, in words and numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.margins import Margins
from swashplate.control.lqg.controller import Lqg
from swashplate.simulation.linearize import LinearModel, linearize

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
    told = [*_numbers(controller, flying), *_options(controller, flying), *_delays(controller, flying)]
    if not told and controller.vehicle.name == vehicle.name:
        return ()
    own = controller.vehicle.card.title
    head = f"The controller was designed on another model ('{own}') than the one flown ('{vehicle.card.title}')."
    return (head, *told, *_answers(controller, flying, margins))


def _numbers(controller: Lqg, flying: Aircraft) -> list[str]:
    """Numbers of the card that differ, where the equations are the same."""
    own, theirs = controller.vehicle.card.values(), flying.vehicle.card.values()
    if controller.vehicle.name != flying.vehicle.name:
        return [f"Equations: '{controller.vehicle.name}' against '{flying.vehicle.name}'."]
    moved = {}
    for name in sorted(own.keys() | theirs.keys()):
        a, b = own.get(name, 0.0), theirs.get(name, 0.0)
        size = max(abs(a), abs(b))
        if size and abs(a - b) > _ALIKE * size:
            moved[name] = abs(a - b) / size
    most = sorted(moved, key=lambda name: -moved[name])[:_NAMED]
    listed = ", ".join(f"{name} {own.get(name, 0.0):.4g} against {theirs.get(name, 0.0):.4g}" for name in most)
    rest = f" and {len(moved) - _NAMED} more" if len(moved) > _NAMED else ""
    return [f"Numbers of the card (design against flown): {listed}{rest}."] if moved else []


def _options(controller: Lqg, flying: Aircraft) -> list[str]:
    own, theirs = controller.vehicle.card.options, flying.vehicle.card.options
    if controller.vehicle.name != flying.vehicle.name:
        return []
    names = [name for name in sorted(own.keys() | theirs.keys()) if own.get(name) != theirs.get(name)]
    listed = ", ".join(f"{name} {own.get(name)!r} against {theirs.get(name)!r}" for name in names)
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
    own, theirs = linearize(controller.vehicle, own_trim), linearize(flying.vehicle, flying.trim)
    crossovers = {a.name: a.crossover for a in margins.axes} if margins is not None else {}
    apart = []
    for name in own.inputs:
        w = crossovers.get(name, float("nan"))
        w = w if np.isfinite(w) else 5.0
        a = _answer(own, name, w, controller.delays.get(name, 0.0))
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
