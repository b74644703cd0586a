"""What a designed maneuver may be for beside parameters: a prediction or a margin, and how parameters move it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.stability import margins_of
from swashplate.control.kinds import kind_of
from swashplate.errors import ManeuverError
from swashplate.models.vehicle import Vehicle
from swashplate.registry import listed
from swashplate.simulation.closed_loop import flown_delays
from swashplate.simulation.controller import Controller
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim, trim

MARGIN = "margin"
"""The disc margin of all loops of the controller that flies, together."""
_SHAPE = "Write OUTPUT/INPUT@HZ or OUTPUT/INPUT@LOW-HIGH, for example q/pitch@0.5-3, or 'margin'."
_LINES = 3
_STEP = 1e-3
"""Share of a parameter's value, for slopes by differences; ten times as much for a margin, which has kinks."""
_POINTS = 3000
"""Frequencies at which a margin is looked for: on a coarse grid it jumps by as much as a percent moves it."""
_DECIBEL, _DEGREES = 20.0 / np.log(10.0), 180.0 / np.pi

Made = Callable[[Vehicle, Trim], Controller]


@dataclass(frozen=True)
class ManeuverAim:
    """Numbers of a model that a flight is to make certain.

    Attributes:
        names: of the numbers, with their units, (k,).
        units: what a slope of one is in them, (k,): an error of a whole response, or a disc margin of one.
        slopes: by the relative change of each unknown, of each draw, (draws, k, p).
    """

    names: tuple[str, ...]
    units: Array
    slopes: Array


def aim_of(text: str, models: Sequence[Vehicle], unknown: Sequence[str], controller: Made) -> ManeuverAim:
    """What an aim is of the draws of a prior.

    Args:
        text: "q/pitch@0.5-3": how a state answers an axis or an input at one frequency or in a band [Hz], gain and
            phase; or "margin".
        models: the draws.
        unknown: what may be different from the models.
        controller: what flies; its margins are those of a model's controller on vehicles with other numbers.

    Raises:
        ManeuverError: a text that is none, a name that the vehicle does not have, a loop without margins, or numbers
            that none of the unknowns changes.
    """
    made: list[Array] = []
    of_loop = text.strip() == MARGIN
    step = 10.0 * _STEP if of_loop else _STEP
    for model in models:
        numbers = _margin(model, controller) if of_loop else _response(model, text)
        here, values = 1.0 if of_loop else numbers(model), [model.numbers[name].value for name in unknown]
        steps = [step * (abs(value) or 1.0) for value in values]
        moved = [
            (numbers(model.with_values({n: v + s})) - numbers(model.with_values({n: v - s}))) / (2.0 * step * here)
            for n, v, s in zip(unknown, values, steps, strict=True)
        ]
        by = np.stack(moved, axis=-1)
        made.append(by.real if of_loop else np.concatenate([by.real, by.imag]))
    slopes = np.stack(made)
    if not np.max(np.abs(slopes)) > 1e-6:
        raise ManeuverError(f"does not depend on {', '.join(unknown)}.", channel=f"aim {text}")
    if of_loop:
        return ManeuverAim(("disc margin",), np.ones(1), slopes)
    at = [f"{text.partition('@')[0].strip()} {f:.3g} Hz" for f in _frequencies(text)]
    names = (*(f"{one} dB" for one in at), *(f"{one} deg" for one in at))
    return ManeuverAim(names, np.repeat([_DECIBEL, _DEGREES], len(at)), slopes)


def _response(vehicle: Vehicle, text: str) -> Callable[[Vehicle], Complex]:
    frequencies = _frequencies(text)
    output, _, axis = (part.strip() for part in text.partition("@")[0].partition("/"))
    if output not in vehicle.state_names:
        raise ManeuverError("is no state of it.", where=vehicle.name, channel=f"aim {output or text}", hint=_SHAPE)
    ways = {name: {name: 1.0} for name in vehicle.input_names} | dict(vehicle.stick_axes)
    if axis not in ways:
        raise ManeuverError(
            "is no axis and no input of it.",
            where=vehicle.name,
            channel=f"aim {axis or text}",
            hint=f"There are {listed(ways)}.",
        )
    along = np.array([ways[axis].get(name, 0.0) for name in vehicle.input_names])

    def numbers(one: Vehicle) -> Complex:
        response = linearize(one).response(2.0 * np.pi * frequencies)[:, one.index(output)] @ along
        if not np.all(np.abs(response) > 0.0):
            raise ManeuverError(f"{output} does not answer {axis}.", where=one.name, channel=f"aim {text}")
        return np.asarray(response, dtype=np.complex128)

    return numbers


def _frequencies(text: str) -> Array:
    low, dash, high = text.partition("@")[2].strip().lower().removesuffix("hz").partition("-")
    try:
        ends = float(low), float(high if dash else low)
    except ValueError:
        raise ManeuverError(f"'{text}' has no frequencies.", channel="aim", hint=_SHAPE) from None
    if not 0.0 < ends[0] <= ends[1] < np.inf:
        raise ManeuverError(f"'{text}': expected frequencies above zero that rise.", channel="aim")
    return np.geomspace(*ends, _LINES) if ends[0] < ends[1] else np.array(ends[:1])


def _margin(model: Vehicle, controller: Made) -> Callable[[Vehicle], Complex]:
    law = controller(model, trim(model))

    def numbers(one: Vehicle) -> Complex:
        late = dict(zip(one.input_names, flown_delays(one, law).tolist(), strict=True))
        judged = kind_of(law).judged(law, Aircraft(one, trim(one), late))
        alpha = margins_of(judged.loop, points=_POINTS, where=one.name).together.alpha
        return np.array([alpha], dtype=np.complex128)

    return numbers
