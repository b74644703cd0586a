"""A linear model as a vehicle: the identified matrices about a trim, with the kinematics that they leave out.

    dx/dt = A (x - x0) + B (u - u0)

holds for the states that the model has; place and heading, which it has not, follow from velocity, attitude and rates
exactly (Stevens, Lewis and Johnson 2016, eqs 1.3-18 and 1.4-4). Every entry that is not zero is a number of the card,
`p_by_b` for the effect of b on dp/dt, so that a card with its sigmas can be varied like any other; x0 and u0 are
`trim_theta`, `trim_lateral` and so on, zero where the file counts deviations.
"""

from __future__ import annotations

from collections import Counter, namedtuple
from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple

from swashplate.errors import CardError
from swashplate.models.card import Card
from swashplate.models.traits import Traits
from swashplate.models.usual_axes import usual_axes
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Named
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector, body_to_local, euler_rates
from swashplate.physics.rigid_body import BODY_UNITS, RigidBody

NAME = "linear"
NEEDED = ("u", "v", "w", "phi", "theta", "p", "q", "r")
"""States without which a model does not say how it flies."""
_OPTIONS = ("states", "state_units", "inputs", "input_units", "low", "high")
SIZE = "rotor_radius"
"""Option that a card may have: how large it is drawn [m]."""
TRAITS = Traits(
    roles={
        **dict.fromkeys(("a", "b", "a1", "b1", "alpha_lower", "beta_lower"), "flapping"),
        **dict.fromkeys(("c", "d", "eta_bar", "zeta_bar"), "bar"),
    },
    linear=True,
    remark="A linear model: deviations from one trim, without ground, wind or battery.",
    about="A linear model: deviations from one trim, trusted near it only. It has no ground, wind or battery; its "
    "input delays are flown, to 2 ms; height counts from an arbitrary level; size and rotor speed are only drawn.",
    wind=False,
    ground=False,
)


class Structure(NamedTuple):
    """Which numbers stand where: what compiled code depends on.

    Attributes:
        states: of the model, without those that only kinematics gives.
        inputs: names.
        entries: (row's state, column's state or input) of every number, in the card's order.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    entries: tuple[tuple[str, str], ...]


class LinearState(NamedTuple):
    """A rigid body (None where the model is not enough to fly), and what else the model has."""

    body: RigidBody | None
    inner: Any


def entry_name(row: str, column: str) -> str:
    """The card's name of an entry of A or B."""
    return f"{row}_by_{column}"


def entry_unit(row: str, column: str) -> str:
    """Unit of an entry from those of its row and column."""
    above, below = ("" if u == "1" else u for u in (row, column))
    return f"{above or '1'}/s" + (f"/({below})" if below else "")


@cache
def tuple_type(name: str, fields: tuple[str, ...]) -> Any:
    return namedtuple(name, fields)


def linear(card: Card) -> Vehicle:
    """The linear vehicle of a card.

    Raises:
        CardError: naming an option or number that is missing, unknown or does not fit.
    """
    where = card.where
    absent = sorted(set(_OPTIONS) - set(card.options))
    if absent or set(card.options) - {*_OPTIONS, SIZE}:
        raise CardError(
            f"has {', '.join(card.options)}; expected {', '.join(_OPTIONS)}, and perhaps {SIZE}.",
            where=where,
            channel="options",
        )
    states, inputs = tuple(card.options["states"]), tuple(card.options["inputs"])
    twice = sorted(name for name, count in Counter((*states, *inputs)).items() if count > 1)
    if twice:
        raise CardError(f"has {', '.join(twice)} more than once.", where=where, channel="options")
    units = dict(zip(states, card.options["state_units"], strict=True))
    grounded = _not_flying(states, units)
    trims = tuple(f"trim_{name}" for name in (*states, *inputs))
    columns = (*states, *inputs)
    entries = []
    for name in card.parameters:
        if name not in trims:
            row, _, column = name.partition("_by_")
            if row not in states or column not in columns:
                raise CardError("is no entry of the model.", where=where, channel=name)
            entries.append((row, column))
    for name in trims:
        if name not in card.parameters:
            raise CardError("is missing.", where=where, channel=name, hint=f"Add [parameters.{name}].")
    layout = Structure(states, inputs, tuple(entries))
    body_names = () if grounded else RigidBody._fields
    inner = tuple(name for name in states if name not in body_names)
    template = tuple_type("Inner", inner)(*(0.0,) * len(inner)) if inner else None
    names = (*(entry_name(*e) for e in entries), *trims)
    limits = tuple(zip(map(float, card.options["low"]), map(float, card.options["high"]), strict=True))
    return Vehicle(
        card=card,
        state=LinearState(None if grounded else RigidBody(*(0.0,) * 12), template),
        inputs=tuple_type("Inputs", inputs),
        parameters=tuple_type("Parameters", names),
        state_names=(*body_names, *inner),
        state_units=(*BODY_UNITS[: len(body_names)], *(units[name] for name in inner)),
        input_names=inputs,
        input_units=tuple(card.options["input_units"]),
        input_limits=limits,
        derivatives=partial(derivatives, structure=layout),
        specific_force=partial(specific_force, structure=layout),
        traits=replace(TRAITS, no_trim=grounded, rest=_rest) if grounded else replace(TRAITS, axes=usual_axes(inputs)),
    )


def _not_flying(states: tuple[str, ...], units: Mapping[str, str]) -> str:
    """Why a model does not say how a body flies; "" where it does."""
    if lost := [name for name in NEEDED if name not in states]:
        return f"has no equation for {', '.join(lost)}: that is not enough to fly"
    for name, unit in zip(RigidBody._fields, BODY_UNITS, strict=True):
        if units.get(name, unit) != unit:
            return f"has {name} in {units[name]}, and a body is flown in SI units and radians"
    return ""


def _rest(card: Card) -> dict[str, float]:
    """The states that deviations count from."""
    return {name: card.parameters[f"trim_{name}"].value for name in card.options["states"]}


def named_states(state: LinearState) -> dict[str, Any]:
    parts = [part._asdict() for part in state if part is not None]
    return {name: value for part in parts for name, value in part.items()}


def _rates(state: LinearState, inputs: Named, par: Named, structure: Structure) -> dict[str, Any]:
    """A (x - x0) + B (u - u0), by state."""
    here = named_states(state) | inputs._asdict()
    away = {name: here[name] - getattr(par, f"trim_{name}") for name in (*structure.states, *structure.inputs)}
    rates: dict[str, Any] = dict.fromkeys(structure.states, 0.0)
    for row, column in structure.entries:
        rates[row] = rates[row] + getattr(par, entry_name(row, column)) * away[column]
    return rates


def derivatives(
    state: LinearState, inputs: Named, par: Named, env: Environment, xp: Backend, *, structure: Structure
) -> LinearState:
    """Time derivative of the whole state; wind, air and voltage are not in such a model."""
    del env
    body = state.body
    if body is None:
        rates = _rates(state, inputs, par, structure)
        return LinearState(None, type(state.inner)(*(rates[n] for n in state.inner._fields)))
    place = body_to_local(body.velocity, body.attitude, xp)
    turned = euler_rates(body.rates, body.attitude, xp)
    pose_rates = dict(zip(("x", "y", "z"), place, strict=True)) | {"psi": turned.psi}
    rates = pose_rates | _rates(state, inputs, par, structure)
    inner = None if state.inner is None else type(state.inner)(*(rates[n] for n in state.inner._fields))
    return LinearState(RigidBody(*(rates[n] for n in RigidBody._fields)), inner)


def specific_force(
    state: LinearState, inputs: Named, par: Named, env: Environment, xp: Backend, *, structure: Structure
) -> Vector:
    """What accelerometers at the centre of gravity read [m/s^2]: dV/dt + omega x V0 - g, to first order like the model.

    Gravity's share is that about the trim's attitude, so that it and the model's own g theta cancel exactly.
    """
    if state.body is None:
        raise CardError(f"has no motion of a whole body ({', '.join(NEEDED)}): nothing tells what accelerometers read.")
    rates = _rates(state, inputs, par, structure)
    start = Euler(par.trim_phi, par.trim_theta, 0.0)
    turning = state.body.rates.cross(Vector(par.trim_u, par.trim_v, par.trim_w))
    roll, pitch = state.body.phi - start.phi, state.body.theta - start.theta
    g, cf, sf = env.gravity, xp.cos(start.phi), xp.sin(start.phi)
    ct, st = xp.cos(start.theta), xp.sin(start.theta)
    return Vector(
        rates["u"] + turning.x + g * (st + ct * pitch),
        rates["v"] + turning.y - g * (sf * ct + cf * ct * roll - sf * st * pitch),
        rates["w"] + turning.z - g * (cf * ct - sf * ct * roll - cf * st * pitch),
    )
