"""Which parameters an identification may move: free, fixed, bounded, tied, or held by a prior."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from graphlib import CycleError, TopologicalSorter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from swashplate.errors import IdentificationError
from swashplate.identification.expressions import Expression, parse_tie
from swashplate.vehicles.vehicle import Vehicle


@dataclass(frozen=True)
class Free:
    """One parameter that an identification may move.

    Attributes:
        name: its name on the card.
        scale: a change of the order that matters, in the parameter's unit.
        mean, sigma: prior (None: the data alone decides), in the parameter's unit.
        start: first guess (None: the card's value).
        source: where the prior comes from.
    """

    name: str
    scale: float
    mean: float | None = None
    sigma: float | None = None
    start: float | None = None
    source: str = ""


@dataclass(frozen=True)
class Choice:
    """A ready set of free parameters and ties.

    Attributes:
        name: what the user calls it.
        description: what it is for.
        free: the parameters to move.
        ties: "name = expression" each.
        fixed: values that the choice sets for the equations' switches.
    """

    name: str
    description: str
    free: tuple[Free, ...]
    ties: tuple[str, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()


_PAPER_TIES = ("a_beta_u = a_alpha_v", "a_beta_v = a_alpha_u", "a_beta_q = a_alpha_p")
_LINEAR_TIES = (
    "a_beta_u_linear = a_alpha_v_linear",
    "a_beta_v_linear = a_alpha_u_linear",
    "a_beta_q_linear = a_alpha_p_linear",
)
_CARD = "the published card, half its value"
_LAG = "the published card, 0.3 rad"

CHOICES: dict[str, Choice] = {
    "flight": Choice(
        "flight",
        "the six parameters that the paper identifies in flight (Fankhauser et al., sec. IV-B)",
        (
            Free("a_alpha_v", 0.0125),
            Free("a_alpha_u", 0.0125),
            Free("a_alpha_p", 0.012),
            Free("tau_f_upper", 1.0),
            Free("o_zeta_upper", 0.1),
            Free("o_zeta_lower", 0.1),
        ),
        _PAPER_TIES,
    ),
    "full": Choice(
        "full",
        "what a slow flight can tell: servo and bar effectiveness, lags, linear flap-back, rotor and heave damping",
        (
            Free("linkage_lower", 0.0678, 0.1355, 0.0678, source=_CARD),
            Free("tau_f_lower", 0.04, 0.08, 0.04, source=_CARD),
            Free("o_zeta_lower", 0.3, -0.0094, 0.3, source=_LAG),
            Free("o_zeta_upper", 0.3, -0.1789, 0.3, source=_LAG),
            Free("tau_f_upper", 0.8, 1.6, 0.8, source=_CARD),
            Free("hub_stiffness_upper", 0.0542, 0.1084, 0.0542, source=_CARD),
            Free("a_alpha_p_linear", 0.02, 0.021, 0.021, 0.021, "16 / (gamma Omega), gamma about 3.2"),
            Free("a_alpha_v_linear", 0.02, 0.021, 0.021, 0.021, "flap-back of both rotors, 2 x 0.0103 rad s/m"),
            Free("a_alpha_u_linear", 0.02, 0.0, 0.021, source="at most the flap-back"),
            Free("gyroscopic", 0.5, 0.5, 0.5, 0.5, "between none and that of rigid rotors"),
            Free("damping_r", 8.8e-4, 8.8e-4, 8.8e-4, 8.8e-4, "2 (k_Q Omega) of both rotors"),
            Free("damping_w", 0.3, 0.3, 0.3, 0.3, "momentum theory in hover"),
            Free("inertia_zz", 1.4e-4, 2.7786e-4, 1.4e-4, source=_CARD),
            Free("tau_drive_upper", 0.09, 0.185, 0.09, source=_CARD),
            Free("tau_drive_lower", 0.06, 0.115, 0.06, source=_CARD),
        ),
        (*_PAPER_TIES, *_LINEAR_TIES),
        (("bar_heading_transport", 1.0),),
    ),
}


@dataclass(frozen=True)
class Layout:
    """How a row of free numbers becomes the equations' parameters, without any number: compiled code depends on this.

    Attributes:
        parameters: the equations' named tuple type.
        free: names of the free parameters, in the row's order.
        ties: tied names and their expressions, in an order in which each uses only what stands before.
    """

    parameters: Any
    free: tuple[str, ...]
    ties: tuple[tuple[str, Expression], ...]

    def values(self, card: Any, row: Any) -> Any:
        """The equations' parameters for the card's numbers (in their order) and a row of free ones (traceable)."""
        numbers = {name: card[i] for i, name in enumerate(self.parameters._fields)}
        for place, name in enumerate(self.free):
            numbers[name] = row[place]
        for name, expression in self.ties:
            numbers[name] = expression(numbers)
        return self.parameters(**numbers)


@dataclass(frozen=True)
class Parameterization:
    """Free parameters and ties of a vehicle, with the card that gives all other numbers.

    Attributes:
        vehicle: whose parameters they are.
        free: the parameters to move, in the row's order.
        ties: tied names and their expressions, in an order in which each uses only what stands before.
    """

    vehicle: Vehicle
    free: tuple[Free, ...]
    ties: tuple[tuple[str, Expression], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(free.name for free in self.free)

    @property
    def layout(self) -> Layout:
        return Layout(self.vehicle.parameters, self.names, self.ties)

    @property
    def card_row(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """The card's numbers in the equations' order."""
        return np.array(self.vehicle.values(), dtype=np.float64)

    def starts(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """First guesses in the card's units."""
        card = self.vehicle.card.values()
        return np.array([card[f.name] if f.start is None else f.start for f in self.free], dtype=np.float64)

    def bounds(self) -> tuple[np.ndarray[Any, np.dtype[np.float64]], np.ndarray[Any, np.dtype[np.float64]]]:
        """What physics allows, in the card's units (infinite where the card is silent)."""
        entries = [self.vehicle.card.parameters[f.name] for f in self.free]
        low = [-np.inf if entry.lower is None else entry.lower for entry in entries]
        high = [np.inf if entry.upper is None else entry.upper for entry in entries]
        return np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)

    def identified(self, row: ArrayLike) -> dict[str, float]:
        """Names and values of everything that moved, tied parameters too."""
        moved = self.layout.values(self.card_row, np.asarray(row))
        return {name: float(getattr(moved, name)) for name in (*self.names, *(name for name, _ in self.ties))}

    def without(self, names: Iterable[str]) -> Parameterization:
        """The same with some parameters fixed at the card."""
        dropped = set(names)
        return replace(self, free=tuple(free for free in self.free if free.name not in dropped))


def parameterize(
    vehicle: Vehicle,
    free: str | Sequence[str | Free] = "full",
    *,
    ties: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
) -> Parameterization:
    """Free parameters, ties and priors, checked against the vehicle's card.

    Args:
        vehicle: whose parameters they are.
        free: a ready choice ("flight": the paper's six; "full") or parameter names.
        ties: "name = expression" each, beside those of the choice; one here replaces the choice's for the same name.
        fixed: values held for parameters that are not to move, whatever the choice says of them.
        priors: mean and standard deviation by name; a prior here replaces the choice's.

    Raises:
        IdentificationError: for a name that the card does not have, one that is both free and tied, a prior on one
            that is not free, ties that go round in a circle, or a value that physics forbids.
        ExpressionError: for a tie that does not parse.
    """
    held = dict(fixed or {})
    if isinstance(free, str) and free in CHOICES:
        choice = CHOICES[free]
        if not {item.name for item in choice.free} <= set(vehicle.parameter_names):
            raise IdentificationError(
                f"the ready choice '{free}' is for another kind of vehicle.",
                where=vehicle.name,
                hint="Name the free parameters, e.g. --free hub_stiffness,blade_inertia,wake_distortion.",
            )
        given = {parse_tie(text)[0] for text in ties} | held.keys()
        wanted = list(choice.free)
        texts = [*(text for text in choice.ties if parse_tie(text)[0] not in given), *ties]
        vehicle = vehicle.with_values(dict(choice.fixed))
    else:
        names = [free] if isinstance(free, str) else list(free)
        wanted, texts = [_as_free(vehicle, item) for item in names], list(ties)
    _known(vehicle, held)
    for name, value in held.items():
        _possible(vehicle, name, value, "fixed")
    vehicle = vehicle.with_values(held)
    wanted = [item for item in wanted if item.name not in held]
    _known(vehicle, [f.name for f in wanted])
    wanted = _with_priors(vehicle, wanted, priors or {})
    tied = [parse_tie(text) for text in texts]
    for name, expression in tied:
        _known(vehicle, [name, *expression.names])
    _once([f.name for f in wanted], [name for name, _ in tied], held)
    if not wanted:
        raise IdentificationError("no parameter is free.", hint=f"Ready choices: {', '.join(CHOICES)}.")
    table = Parameterization(vehicle, tuple(wanted), _in_order(dict(tied)))
    _check_ties(table)
    return table


def _with_priors(vehicle: Vehicle, wanted: list[Free], priors: Mapping[str, tuple[float, float]]) -> list[Free]:
    for name, (mean, sigma) in priors.items():
        _known(vehicle, [name])
        if not (sigma > 0.0 and np.isfinite(mean)):
            raise IdentificationError(
                f"prior is {mean} with sigma {sigma}, expected a number and a positive one.", channel=name
            )
        if name not in {f.name for f in wanted}:
            raise IdentificationError(
                "has a prior but is not free.",
                channel=name,
                hint=f"Free are {', '.join(f.name for f in wanted) or 'none'}.",
            )
        wanted = [replace(f, mean=mean, sigma=sigma, source="given prior") if f.name == name else f for f in wanted]
    return wanted


def _once(free: list[str], tied: list[str], held: Iterable[str]) -> None:
    """That every name is free, tied or fixed once."""
    names = [*free, *tied, *held]
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise IdentificationError(
            f"{', '.join(doubled)} is given twice: a parameter is free, tied or fixed, once.",
            hint="Leave out one of them.",
        )


def _in_order(ties: Mapping[str, Expression]) -> tuple[tuple[str, Expression], ...]:
    """Ties in an order in which each uses only what stands before."""
    sorter = TopologicalSorter({name: expression.names for name, expression in ties.items()})
    try:
        order = list(sorter.static_order())
    except CycleError as error:
        raise IdentificationError(
            f"the ties go round in a circle: {' = '.join(reversed(error.args[1]))}.", hint="Leave one of them out."
        ) from None
    return tuple((name, ties[name]) for name in order if name in ties)


def _check_ties(table: Parameterization) -> None:
    """That every tie gives a possible number at the start."""
    with np.errstate(all="ignore"):
        try:
            values = table.identified(table.starts())
        except ZeroDivisionError:
            values = {}
    for name, expression in table.ties:
        _possible(table.vehicle, name, values.get(name, float("nan")), f"tied to '{expression.text}'")


def _possible(vehicle: Vehicle, name: str, value: float, how: str) -> None:
    entry = vehicle.card.parameters[name]
    low = -np.inf if entry.lower is None else entry.lower
    high = np.inf if entry.upper is None else entry.upper
    if not (np.isfinite(value) and low <= value <= high):
        raise IdentificationError(
            f"is {how}, which is {value:.4g} {entry.unit}; physics allows {low:g} to {high:g}.", channel=name
        )


def _as_free(vehicle: Vehicle, item: str | Free) -> Free:
    if isinstance(item, Free):
        return item
    known = {free.name: free for choice in CHOICES.values() for free in choice.free}
    if item in known:
        return replace(known[item], mean=None, sigma=None)
    _known(vehicle, [item])
    return Free(item, abs(vehicle.card.parameters[item].value) or 0.01)


def _known(vehicle: Vehicle, names: Iterable[str]) -> None:
    unknown = sorted(set(names) - set(vehicle.parameter_names))
    if unknown:
        raise IdentificationError(
            f"'{vehicle.name}' has no such parameter.",
            channel=", ".join(unknown),
            hint=f"Parameters are listed by 'swash vehicles show {vehicle.name}'.",
        )
