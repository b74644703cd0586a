"""Which parameters an identification may move: free, fixed, bounded, tied, or held by a prior."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from graphlib import CycleError, TopologicalSorter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import IMAGINARY, Array
from swashplate.errors import CardError, ExpressionError, IdentificationError
from swashplate.filtering.disturbances import SEPARATE
from swashplate.filtering.nuisance import PUSHES, USUAL_PUSH, Nuisance
from swashplate.models.card import Card
from swashplate.models.linear.expressions import Expression, parse_tie
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.traits import Choice
from swashplate.models.traits import Free as Free
from swashplate.models.vehicle import Vehicle

FROM_CARD = "card: "
"""How the source of a prior that a card gave begins."""


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

    def value_slopes(self, card: Array, row: Array) -> Array:
        """Slopes of `values` by each free parameter (free, parameters), by complex steps (Squire and Trapp 1998)."""
        step = 1j * IMAGINARY * np.eye(len(self.free))
        slopes = [np.imag(np.array(self.values(card, row + one))) / IMAGINARY for one in step]
        return np.array(slopes).reshape(len(step), len(card))


@dataclass(frozen=True)
class Parameterization:
    """Free parameters and ties of a vehicle, with the card that gives all other numbers.

    Attributes:
        vehicle: whose parameters they are.
        free: the parameters to move, in the row's order.
        ties: tied names and their expressions, in an order in which each uses only what stands before.
        held: what is not free and stands at the value of the prior card.
        prior_card: whose correlations the priors have (None: they are independent).
        of_records: constants that every log has of its own, beside the usual ones.
        noises: numbers of the noise that yaw or heave have for themselves.
        switched: in words, what a ready choice set to another value than the card's.
    """

    vehicle: Vehicle
    free: tuple[Free, ...]
    ties: tuple[tuple[str, Expression], ...] = ()
    held: tuple[str, ...] = ()
    prior_card: Card | None = None
    of_records: tuple[Free, ...] = ()
    noises: tuple[str, ...] = ()
    switched: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(free.name for free in self.free)

    @property
    def switches(self) -> dict[str, list[str]]:
        """`switched` as a fit's settings have it; empty where there is nothing to say."""
        return {"set by the choice": list(self.switched)} if self.switched else {}

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
        values = self.layout.values(self.card_row, np.asarray(row))
        return {name: float(getattr(values, name)) for name in (*self.names, *(name for name, _ in self.ties))}

    @property
    def prior_correlations(self) -> tuple[tuple[int, int, float], ...]:
        """Places of free parameters whose priors come from one card together, and their correlation."""
        if self.prior_card is None:
            return ()
        places = [i for i, free in enumerate(self.free) if free.source.startswith(FROM_CARD)]
        names = [self.free[i].name for i in places]
        covariance = self.prior_card.covariance(names)
        sigma = np.sqrt(np.diag(covariance))
        return tuple(
            (places[i], places[j], float(covariance[i, j] / (sigma[i] * sigma[j])))
            for i in range(len(names))
            for j in range(i + 1, len(names))
            if covariance[i, j] != 0.0
        )

    def wider(self, names: Sequence[str]) -> Parameterization:
        """The same and more parameters, from the card's values and without priors."""
        return replace(self, free=(*self.free, *parameterize(self.vehicle, list(names)).free))

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
    prior_card: Card | None = None,
) -> Parameterization:
    """Free parameters, ties and priors, checked against the vehicle's card.

    Args:
        vehicle: whose parameters they are.
        free: a ready choice of the vehicle (`Vehicle.choices`; CoaX: "flight", "full", ...; helicopter: "rotor",
            "full") or parameter names. Among the names may be constants of every record ("trim_motor_upper") and
            numbers of the noise that yaw and heave have for themselves (`filtering.disturbances.SEPARATE`).
        ties: "name = expression" each, beside those of the choice; one here replaces the choice's for the same name.
        fixed: values held for parameters that are not to move, whatever the choice says of them.
        priors: mean and standard deviation by name; a prior here replaces the choice's.
        prior_card: what it says with status measured or identified and a sigma is the prior of what is free, with its
            correlations, and the value of what is not; `fixed`, ties and `priors` go before it.

    Raises:
        CardError: for a prior card of another vehicle, or one that measured nothing.
        IdentificationError: for a name that the card does not have, one that is both free and tied, a prior on one
            that is not free, ties that go round in a circle, or a value that physics forbids.
        ExpressionError: for a tie that does not parse.
    """
    held = dict(fixed or {})
    ready = vehicle.choices
    switched: tuple[str, ...] = ()
    if isinstance(free, str) and free not in ready and free not in vehicle.parameter_names:
        raise IdentificationError(
            f"'{vehicle.called}' has neither a ready choice nor a parameter '{free}'.",
            where=vehicle.card.where,
            hint=f"Ready here: {', '.join(ready) or 'none'}; or name the free parameters.",
        )
    if isinstance(free, str) and free in ready:
        choice = ready[free]
        given = {parse_tie(text)[0] for text in ties} | held.keys()
        wanted = list(choice.free)
        texts = [*(text for text in choice.ties if parse_tie(text)[0] not in given), *ties]
        switched = _switched(vehicle, choice, held)
        vehicle = vehicle.with_values(dict(choice.fixed))
    else:
        names = [free] if isinstance(free, str) else list(free)
        wanted, texts = [_as_free(vehicle, item) for item in names], list(ties)
    _known(vehicle, held)
    for name, value in held.items():
        _possible(vehicle, name, value, "fixed")
    vehicle = vehicle.with_values(held)
    wanted = [item for item in wanted if item.name not in held]
    _known(vehicle, [f.name for f in wanted if f.name not in _beside(vehicle)])
    taken: tuple[str, ...] = ()
    if prior_card is not None:
        vehicle, wanted, taken = _from_card(vehicle, wanted, prior_card, {*held, *(parse_tie(t)[0] for t in texts)})
    wanted = _with_priors(vehicle, wanted, priors or {})
    tied = [parse_tie(text) for text in texts]
    for name, expression in tied:
        _known(vehicle, [name, *expression.names])
    _once([f.name for f in wanted], [name for name, _ in tied], held)
    beside = [item for item in wanted if item.name in _beside(vehicle)]
    wanted = [item for item in wanted if item.name not in _beside(vehicle)]
    if not wanted:
        raise IdentificationError("no parameter is free.", hint=f"Ready choices: {', '.join(ready) or 'none'}.")
    table = Parameterization(
        vehicle,
        tuple(wanted),
        _in_order(dict(tied)),
        taken,
        prior_card,
        tuple(item for item in beside if item.name not in SEPARATE),
        tuple(item.name for item in beside if item.name in SEPARATE),
        switched,
    )
    _check_ties(table)
    return table


def _switched(vehicle: Vehicle, choice: Choice, held: Mapping[str, float]) -> tuple[str, ...]:
    """In words, what a choice sets and the user does not, where the card says something else."""
    card = vehicle.card.values()
    return tuple(
        f"choice '{choice.name}' sets {name} = {value:g} (card: {card[name]:g})"
        for name, value in choice.fixed
        if name not in held and value != card[name]
    )


def _from_card(
    vehicle: Vehicle, wanted: list[Free], card: Card, settled: set[str]
) -> tuple[Vehicle, list[Free], tuple[str, ...]]:
    """What a prior card measured: priors of what is free, values of the rest; and the names of the rest."""
    vehicle.with_card(card)  # says where it is for another vehicle
    known = {
        name: entry
        for name, entry in card.parameters.items()
        if entry.status in ("measured", "identified") and entry.sigma is not None and name not in settled
    }
    if not any(entry.sigma for entry in known.values()):
        raise CardError(
            "has no parameter with status measured or identified and a sigma.",
            where=card.where,
            hint="Make one with 'swash bench' or 'swash identify', or give --prior NAME=MEAN,SIGMA.",
        )
    _known(vehicle, known)
    free = {item.name for item in wanted}
    entries = [
        replace(item, mean=known[item.name].value, sigma=known[item.name].sigma, start=known[item.name].value,
                source=f"{FROM_CARD}{known[item.name].source}") if item.name in known else item
        for item in wanted
    ]  # fmt: skip
    rest = tuple(name for name in known if name not in free)
    for name in rest:
        entry = known[name]
        vehicle = vehicle.with_values({name: entry.value}, status=entry.status, sigma=entry.sigma, source=entry.source)
    return vehicle, entries, rest


def _with_priors(vehicle: Vehicle, wanted: list[Free], priors: Mapping[str, tuple[float, float]]) -> list[Free]:
    for name, (mean, sigma) in priors.items():
        _known(vehicle, [] if name in _trims(vehicle) else [name])
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
        except ExpressionError:
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
    known = {free.name: free for choice in vehicle.choices.values() for free in choice.free}
    if item in _beside(vehicle):
        return known.get(item) or (Free(item, 1.0) if item in SEPARATE else trim_of_record(item))
    if item in known:
        return replace(known[item], mean=None, sigma=None)
    _known(vehicle, [item])
    return Free(item, abs(vehicle.card.parameters[item].value) or 0.01)


def trim_of_record(name: str, sigma: float | None = None) -> Free:
    """A trim or push that every record has of its own, about zero."""
    sigma = USUAL_PUSH.get(name, 0.05) if sigma is None else sigma
    return Free(name, 0.4 * sigma, 0.0, sigma, source="usual of a trim")


def _trims(vehicle: Vehicle) -> tuple[str, ...]:
    """Trims of the vehicle's inputs that a record can have, and pushes."""
    return (*(name for name in (f"trim_{i}" for i in vehicle.input_names) if name in Nuisance._fields), *PUSHES)


def _beside(vehicle: Vehicle) -> frozenset[str]:
    """What may be freed and stands on no card: trims of records, and noise of yaw's and heave's own."""
    return frozenset((*_trims(vehicle), *SEPARATE))


def _known(vehicle: Vehicle, names: Iterable[str]) -> None:
    unknown = sorted(set(names) - set(vehicle.parameter_names))
    if unknown:
        raise IdentificationError(
            f"'{vehicle.name}' has no such parameter.",
            channel=", ".join(unknown),
            hint=f"Parameters are listed by 'swash vehicle show {vehicle.name}'.",
        )


def parameter_table(model: Vehicle | StateSpaceModel) -> Mapping[str, Any]:
    """A model's parameters by name: of a vehicle they stand in its card."""
    return model.card.parameters if isinstance(model, Vehicle) else model.parameters


def bounds_of(model: Any, names: Sequence[str]) -> tuple[Array, Array]:
    """What physics allows of a model's parameters, (p,) each; infinite where nothing is said."""
    table = parameter_table(model)
    low, high = (
        np.array([usual if (bound := getattr(table[n], side)) is None else bound for n in names], dtype=np.float64)
        for side, usual in (("lower", -np.inf), ("upper", np.inf))
    )
    return low, high
