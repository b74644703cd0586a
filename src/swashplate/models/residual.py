"""A linear residual: accelerations that a vehicle's equations leave out, linear in its motion and commands.

The accelerations of u, v, p and q by those states, roll, pitch and the inputs; those of w and r by w, r and the inputs.
The coefficients stand on the card as `residual_ROW_COLUMN`, with `residual_at_INPUT`, the input from which each counts.
So what has one is an ordinary vehicle: simulation, linearisation, controllers, exporters and the filter of a fit take
it as they take any. Together with the gusts of that filter, which fade and are driven by the innovations, it is an
autoregression with exogenous inputs on the innovations (ARX; Ljung 1999, sec. 4.2).

A residual of errors ahead has the autopilot's answers in it, and an autopilot holds its heading: there r follows psi
too, counted from where a record or a simulation begins (`facing`). No aircraft does so by itself.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter
from swashplate.models.vehicle import Derivatives, Vehicle
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector

PREFIX = "residual_"
_AT, _AHEAD = f"{PREFIX}at_", f"{PREFIX}ahead"
MOTION = {"u": "m/s", "v": "m/s", "w": "m/s", "phi": "rad", "theta": "rad", "p": "rad/s", "q": "rad/s", "r": "rad/s"}
"""The states that it depends on, and their units."""
_LEVEL, _TURNING = ("u", "v", "phi", "theta", "p", "q"), ("w", "r")
ROWS = {"u": _LEVEL, "v": _LEVEL, "w": _TURNING, "p": _LEVEL, "q": _LEVEL, "r": _TURNING}
"""The accelerations that it adds, and the states that each depends on; each depends on every input too."""
HEADING = "psi"
"""On what r depends beside, where errors some time ahead were fitted."""
_ROWS_AHEAD = {**ROWS, "r": (*_TURNING, HEADING)}
_COUNTED_HEADING = f"{_AT}{HEADING}"


def coefficients(vehicle: Vehicle) -> dict[str, tuple[str, str]]:
    """The coefficients of a vehicle's residual, whether it has one or not: row and column by name, row after row."""
    return _coefficients(vehicle, heading=_COUNTED_HEADING in vehicle.card.parameters)


def _coefficients(vehicle: Vehicle, *, heading: bool) -> dict[str, tuple[str, str]]:
    rows = _ROWS_AHEAD if heading else ROWS
    pairs = ((row, column) for row, states in rows.items() for column in (*states, *vehicle.input_names))
    return {f"{PREFIX}{row}_{column}": (row, column) for row, column in pairs}


def counted_from(vehicle: Vehicle) -> dict[str, float]:
    """By input, the value from which the residual of a vehicle counts it."""
    return {name: vehicle.card.parameters[f"{_AT}{name}"].value for name in vehicle.input_names}


def facing(vehicle: Vehicle, heading: float) -> Vehicle:
    """The vehicle with the heading [rad] from which its residual counts, where it counts one."""
    counted = _COUNTED_HEADING in vehicle.card.parameters
    return vehicle.with_values({_COUNTED_HEADING: heading}) if counted else vehicle


def heading_counted(vehicle: Vehicle) -> float:
    """That heading [rad]; 0 where it counts none."""
    return vehicle.card.values().get(_COUNTED_HEADING, 0.0)


def has_residual(card: Card) -> bool:
    return any(name.startswith(PREFIX) for name in card.parameters)


def without_residual(card: Card) -> Card:
    """The card of the equations alone."""
    kept = {name: entry for name, entry in card.parameters.items() if not name.startswith(PREFIX)}
    return replace(card, parameters=kept)


def refuse_predictor(vehicle: Vehicle, purpose: str) -> None:
    """Refuses a vehicle whose residual was fitted to errors some time ahead.

    Such a residual has seen commands that answer gusts, and has learnt that the autopilot will do so: it predicts
    flights under that autopilot. Another controller would be designed for damping that is not the aircraft's.

    Raises:
        CardError: naming the purpose, and what to do.
    """
    ahead = vehicle.card.parameters.get(_AHEAD)
    if ahead is not None and ahead.value > 0.0:
        raise CardError(
            f"has a residual that was fitted to errors {ahead.value:g} s ahead on recorded commands: it knows how the "
            f"autopilot of those flights answers gusts, and serves for predictions, not for {purpose}.",
            where=vehicle.card.where,
            channel="residual",
            hint="Identify with --residual and without --horizon, or without --residual.",
        )


def with_residual(vehicle: Vehicle, about: Mapping[str, float], *, ahead: float = 0.0) -> Vehicle:
    """The vehicle with a residual whose coefficients are still zero.

    Args:
        vehicle: a rigid body, without a residual.
        about: by input, the value from which it counts.
        ahead: seconds ahead of the errors that it will be fitted to; 0: innovations.

    Raises:
        CardError: for what has one already, lacks a state, or is a linear model.
    """
    _suited(vehicle)
    columns = {**MOTION, HEADING: "rad", **dict(zip(vehicle.input_names, vehicle.input_units, strict=True))}
    note = "a linear residual: no physics"

    def entry(value: float, unit: str) -> Parameter:
        return Parameter(value, unit, "before the fit of the residual", "assumed", note=note)

    entries = {
        name: entry(0.0, f"({MOTION[row]}/s) / ({columns[column]})")
        for name, (row, column) in _coefficients(vehicle, heading=ahead > 0.0).items()
    }
    counted = {name: about[name] for name in vehicle.input_names} | ({HEADING: 0.0} if ahead > 0.0 else {})
    entries |= {f"{_AT}{name}": entry(value, columns[name]) for name, value in counted.items()}
    entries[_AHEAD] = entry(ahead, "s")
    return joined(vehicle, replace(vehicle.card, parameters={**vehicle.card.parameters, **entries}))


def carrying(vehicle: Vehicle, card: Card) -> Vehicle:
    """A vehicle's equations with another card's numbers, and with the residual where that card has one.

    Args:
        vehicle: with a residual of its own or without; that on the card counts, and where it has none, none.

    Raises:
        CardError: where the card is for other equations, or its residual is incomplete.
    """
    vehicle = _without_residual(vehicle)
    carrier = vehicle.with_card(card)
    if not has_residual(card):
        return carrier
    # The equations' own card has what they fill in where another one is silent.
    return joined(vehicle, replace(card, parameters={**vehicle.card.parameters, **card.parameters}))


def _without_residual(vehicle: Vehicle) -> Vehicle:
    """The equations behind a residual."""
    rates, force = vehicle.derivatives, vehicle.specific_force
    if not isinstance(rates, partial) or rates.func is not _derivatives or not isinstance(force, partial):
        return vehicle
    base = rates.keywords["base"]
    added = vehicle.parameters._fields[len(base._fields) :]
    card = replace(vehicle.card, parameters={n: p for n, p in vehicle.card.parameters.items() if n not in added})
    of = {"derivatives": rates.keywords["of"], "specific_force": force.keywords["of"]}
    return replace(vehicle, card=card, parameters=base, **of)


def joined(vehicle: Vehicle, card: Card) -> Vehicle:
    """The vehicle with the residual that stands on a card.

    Raises:
        CardError: where a coefficient is missing, or is none of this vehicle's.
    """
    _suited(vehicle)
    heading = _COUNTED_HEADING in card.parameters
    counted = (*vehicle.input_names, *((HEADING,) if heading else ()))
    names = (*_coefficients(vehicle, heading=heading), *(f"{_AT}{name}" for name in counted), _AHEAD)
    on_card = [name for name in card.parameters if name.startswith(PREFIX)]
    for name in (*names, *on_card):
        if name not in on_card or name not in names:
            what = "is missing" if name in names else f"is no coefficient of '{vehicle.name}'"
            raise CardError(f"{what}.", where=card.where, channel=name, hint="Identify anew with --residual.")
    parameters = _wider(vehicle.parameters, names)
    rows = tuple((_ROWS_AHEAD if heading else ROWS).items())
    given = {"base": vehicle.parameters, "names": vehicle.input_names, "rows": rows}
    return replace(
        vehicle,
        card=card,
        parameters=parameters,
        derivatives=partial(_derivatives, of=vehicle.derivatives, **given),
        specific_force=partial(_specific_force, of=vehicle.specific_force, **given),
    )


def _suited(vehicle: Vehicle) -> None:
    lacking = [name for name in ("x", "y", "z", "psi", *MOTION) if name not in vehicle.state_names]
    why = ""
    if has_residual(vehicle.card):
        why = "has a residual already."
    elif lacking:
        why = f"cannot have a residual: it lacks {', '.join(lacking)}."
    elif vehicle.traits.linear or not hasattr(vehicle.state, "body"):
        why = "cannot have a residual: it is no rigid body with equations of its own."
    if why:
        raise CardError(why, where=vehicle.card.where, channel="residual")


@lru_cache(maxsize=64)
def _wider(parameters: Named, names: tuple[str, ...]) -> Any:
    """A tuple type with more fields; one for the same names, so that compiled code is shared."""
    return namedtuple(parameters.__name__, (*parameters._fields, *names))


_Rows = tuple[tuple[str, tuple[str, ...]], ...]


def residual(state: Named, inputs: Named, par: Named, *, names: tuple[str, ...], rows: _Rows) -> tuple[Scalar, ...]:
    """The accelerations of u, v, w [m/s^2] and p, q, r [rad/s^2] that the residual adds."""
    away = {name: value - getattr(par, f"{_AT}{name}") for name, value in zip(names, inputs, strict=True)}
    columns = {name: getattr(state.body, name) for name in MOTION} | away
    if hasattr(par, _COUNTED_HEADING):
        columns[HEADING] = state.body.psi - getattr(par, _COUNTED_HEADING)
    return tuple(
        sum(getattr(par, f"{PREFIX}{row}_{name}") * columns[name] for name in (*states, *away)) for row, states in rows
    )


def _derivatives(
    state: Named, inputs: Named, par: Named, env: Environment, xp: Backend, *, of: Derivatives, base: Any, names: Any,
    rows: _Rows,
) -> Any:  # fmt: skip
    """Time derivative of the whole state: the equations' own, and the residual's accelerations."""
    rates = of(state, inputs, base(*par[: len(base._fields)]), env, xp)
    added = dict(zip(ROWS, residual(state, inputs, par, names=names, rows=rows), strict=True))
    body = rates.body._replace(**{row: getattr(rates.body, row) + value for row, value in added.items()})
    return rates._replace(body=body)


def _specific_force(
    state: Named, inputs: Named, par: Named, env: Environment, xp: Backend, *, of: Derivatives, base: Any, names: Any,
    rows: _Rows,
) -> Vector:  # fmt: skip
    """What an accelerometer at the centre of gravity reads [m/s^2]: the residual's force is one that it feels."""
    x, y, z = of(state, inputs, base(*par[: len(base._fields)]), env, xp)
    ax, ay, az = residual(state, inputs, par, names=names, rows=rows)[:3]
    return Vector(x + ax, y + ay, z + az)
