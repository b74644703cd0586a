"""What parts would be worth to a fitted structure, foreseen from slopes at its own numbers, without a fit of each.

Every part and derivative that is not there is put in so that it does next to nothing. How each response would move with
its numbers is then known, and a least-squares step says how far the misfit would fall with some of them: a score test
(Rao 1948). What brings most is taken first, and what the later ones make idle is taken out again (Draper and Smith
1998, ch. 15): so a part is foreseen beside whatever could stand for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.frequency.linear_start import TIED, from_relative
from swashplate.identification.frequency.response_cost import Target, log_error
from swashplate.identification.frequency.state_space_search import pairs_of
from swashplate.identification.frequency.structure_score import hidden, robust, scatter, score
from swashplate.models.linear import composition
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.structure_parts import DERIVATIVES, PARTS, number

_FAINT = 1e-3
"""Share of its usual number that a part is put in with: enough to see what its other numbers would do."""

_TOLD = 1e-4
"""Share of a slope that the others must leave of it; below, its number cannot be told from theirs."""


@dataclass(frozen=True)
class Foreseen:
    """Some parts, and what they would bring.

    Attributes:
        parts: to be added. gain: points of the score, less what their numbers cost.
    """

    parts: tuple[str, ...]
    gain: float


class Foresight:
    """Slopes of a fitted composed structure with everything that it lacks.

    Args:
        model: composed, with fitted numbers. targets: what it was fitted to.
        offered: parts that may be added, besides every derivative. spread: of the scatter (`structure_score`).
    """

    def __init__(
        self, model: StateSpaceModel, targets: Sequence[Target], *, offered: Iterable[str], spread: float
    ) -> None:
        self._points, self._spread = sum(t.omega.size for t in targets), spread
        parts = composition.parts_of(str(model.document["composed"]))
        twin = self._twin(model, parts, offered)
        free = (*model.free, *(name for group in self.numbers.values() for name in group))
        errors, slopes = _weighed(twin, free, targets)
        size = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
        slopes = slopes / size
        known, errors = _basis(slopes[:, : len(model.free)]), errors
        self._errors = errors - known @ (known.T @ errors)
        rest = slopes[:, len(model.free) :]
        rest = rest - known @ (known.T @ rest)
        acts = np.linalg.norm(rest, axis=0) > _TOLD
        places = np.cumsum([0, *(len(group) for group in self.numbers.values())])
        self._columns = {
            name: rest[:, a:b][:, acts[a:b]] for name, a, b in zip(self.numbers, places, places[1:], strict=False)
        }
        self._columns = {name: columns for name, columns in self._columns.items() if columns.size}

    def _twin(self, model: StateSpaceModel, present: tuple[str, ...], offered: Iterable[str]) -> StateSpaceModel:
        """The model with everything that it lacks, of which each does next to nothing; and whose numbers are whose."""
        parts = list(present)
        for name in offered:
            if name not in parts and not composition.nonsense([*parts, name]):
                parts.append(name)
        added = [name for name in parts if name not in present]
        others = [name for name in DERIVATIVES if name not in present]
        derivatives = [name for name in others if not composition.nonsense([*present, name])]
        pairs = composition.pairs_of(str(model.document["composed"]))
        widest = structure(composition.PREFIX + "+".join([*parts, *derivatives, *pairs]))
        twin = from_relative(widest, model)
        taken = set(model.parameters)
        self.numbers: dict[str, tuple[str, ...]] = {}
        for name in (*added, *derivatives):
            group = (name,) if name not in PARTS else tuple(n for n in _numbers_of(name) if n in twin.free)
            self.numbers[name] = tuple(n for n in group if n not in taken)
            taken |= set(group)
        faint = {
            n: twin.parameters[n].value + _FAINT * (number(n).value or 1.0)
            for part in added
            for n in PARTS[part].absent
        }
        if "bar" in added:  # the paddles are driven as the blades are
            faint |= {bar: twin.parameters[blade].value for bar, blade in (("Clon", "Alon"), ("Dlat", "Blat"))}
        held = {n: p.value for n, p in model.parameters.items() if n in twin.parameters and not p.free}
        return twin.with_values(faint).with_values(held, free=False)

    def proposals(self) -> list[Foreseen]:
        """What is worth its numbers, the best first: all that is, derivatives alone, each part with derivatives."""
        derivatives = [name for name in self._columns if name not in PARTS]
        parts = [name for name in self._columns if name in PARTS]
        chosen = [self._chosen((), list(self._columns)), self._chosen((), derivatives)]
        chosen += [self._chosen((name,), derivatives) for name in parts]
        unique = {one.parts: one for one in chosen if one.gain > 0.0}
        return sorted(unique.values(), key=lambda one: -one.gain)

    def gain(self, names: Sequence[str]) -> float:
        """What some of these parts together would bring."""
        columns = [self._columns[name] for name in names if name in self._columns]
        if not columns:
            return 0.0
        basis = _basis(np.concatenate(columns, axis=1))
        fall = float(np.sum((basis.T @ self._errors) ** 2))
        return self._worth(fall, names)

    def _worth(self, fall: float, names: Sequence[str]) -> float:
        """Points of the score that a fall of the misfit brings, less what the numbers of these parts cost."""
        numbers = sum(self._columns[name].shape[1] for name in names if name in self._columns)
        return -score(-fall, numbers, hidden=hidden(names), spread=self._spread, points=self._points)

    def _chosen(self, forced: tuple[str, ...], pool: Sequence[str]) -> Foreseen:
        """Forward from the forced ones, the best of the pool first, and back."""
        names = list(forced)
        gain = self.gain(names)
        while True:
            basis = _basis(np.concatenate([self._columns[n] for n in names], axis=1)) if names else None
            errors = self._errors if basis is None else self._errors - basis @ (basis.T @ self._errors)
            best, most = "", 0.0
            for name in pool:
                if name in names or not self._beside(name, names):
                    continue
                columns = self._columns[name]
                left = columns if basis is None else columns - basis @ (basis.T @ columns)
                span = _basis(left[:, np.linalg.norm(left, axis=0) > _TOLD])
                fall = float(np.sum((span.T @ errors) ** 2))
                more = self._worth(fall, [name])
                if more > most:
                    best, most = name, more
            if not best:
                break
            names.append(best)
        while len(names) > len(forced):
            gain = self.gain(names)
            without = {n: self.gain([other for other in names if other != n]) for n in names if n not in forced}
            idle = max(without, key=lambda n: without[n])
            if without[idle] <= gain:
                break
            names.remove(idle)
        return Foreseen(composition.in_order(names), self.gain(names))

    def _beside(self, name: str, names: Sequence[str]) -> bool:
        """Whether a part of the pool may stand beside those that are chosen."""
        return name not in PARTS or not any(n in PARTS and name in PARTS[n].excludes for n in names)


def worths(model: StateSpaceModel, targets: Sequence[Target], *, spread: float) -> dict[str, float]:
    """Points of the score by which each part and derivative of a fitted composed structure is worth its numbers.

    Args:
        model: composed, with fitted numbers. targets: what it was fitted to. spread: of the scatter.
    """
    points = sum(t.omega.size for t in targets)
    _, slopes = _weighed(model, model.free, targets)
    size = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    covariance = np.linalg.pinv((slopes / size).T @ (slopes / size), hermitian=True)
    worth = {}
    for name in composition.parts_of(str(model.document["composed"])):
        absent = PARTS[name].absent if name in PARTS else {name: TIED.get(name, 0.0)}
        at = [model.free.index(n) for n in absent if n in model.free]
        if at:
            away = np.array([model.parameters[model.free[k]].value - absent[model.free[k]] for k in at]) * size[at]
            rise = float(away @ np.linalg.pinv(covariance[np.ix_(at, at)], hermitian=True) @ away)
            count = len(_numbers_of(name)) if name in PARTS else 1
            worth[name] = score(rise, -count, hidden=-hidden([name]), spread=spread, points=points)
    return worth


def _numbers_of(part: str) -> list[str]:
    """Every parameter of a part's equations, its gains and its other numbers."""
    texts = [t for side in (PARTS[part].equations, PARTS[part].left) for terms in side.values() for t in terms.values()]
    return list(dict.fromkeys(name for text in texts for name in sorted(Expression(text).names)))


def _weighed(model: StateSpaceModel, free: Sequence[str], targets: Sequence[Target]) -> tuple[Array, Array]:
    """Errors of the logarithms over their scatter, robustly weighed, and their slopes by the numbers."""
    values = np.array([model.parameters[n].value for n in free])
    responses, slopes = model.sensitivities(tuple(free), values, pairs_of(model, targets))
    errors, by = [], []
    for h, slope, t in zip(responses, slopes, targets, strict=True):
        error, spread = log_error(h, t.measured), scatter(t)
        weight = np.sqrt(robust(np.abs(error) / spread)) / spread
        errors.append(weight * error)
        by.append(weight[:, None] * slope / h[:, None])
    error, slope = np.concatenate(errors), np.concatenate(by)
    return np.concatenate([error.real, error.imag]), np.concatenate([slope.real, slope.imag])


def _basis(columns: Array) -> Array:
    """An orthonormal basis of what the columns span."""
    if columns.shape[1] == 0:
        return columns
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    left, values, _ = np.linalg.svd(columns / size, full_matrices=False)
    return np.asarray(left[:, values > _TOLD * values[0]])
