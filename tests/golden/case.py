"""A golden case: named numbers that a function computes, and how far two runs of it are apart."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
FROZEN = Path(__file__).parent / "frozen"

RELATIVE = 1e-10
"""How far a number may be from its frozen value, relative to the value."""
ELSEWHERE = 1e-5
"""The same on another machine than the one that froze it, for light cases: between processors with other instructions
their numbers were up to 7e-7 apart (`CHANGED.md`)."""
SMALL = 1e-14
"""Floor of a single number, in its own unit: below it a number is rounding. A list holds one quantity (else it goes
through `apart`), and its floor is RELATIVE times its largest entry."""

Value = float | bool | str | None | list[Any]
Values = dict[str, Value]

ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}
"""Of every run, as the Makefile's target `unit` has it: another order of summation is another last digit."""


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        name: also of its file in `frozen`.
        compute: gets an empty folder for its files and returns the numbers.
        light: True for what `make test` runs too (a few seconds together, little compiled).
        data: folders of the shared data that it reads; without them it cannot run.
        needs: modules of optional packages.
    """

    name: str
    compute: Callable[[Path], Values]
    light: bool
    data: tuple[str, ...]
    needs: tuple[str, ...]


CASES: dict[str, Case] = {}


def case(*, light: bool = False, data: Sequence[str] = (), needs: Sequence[str] = ()) -> Callable[[Any], Any]:
    """Registers a function as a case under its own name."""

    def register(function: Callable[[Path], Values]) -> Callable[[Path], Values]:
        CASES[function.__name__] = Case(function.__name__, function, light, tuple(data), tuple(needs))
        return function

    return register


def thinned(values: Any, most: int = 24) -> list[float]:
    """At most so many entries of an array, evenly over it, the last one among them; complex ones as pairs."""
    array = np.asarray(values)
    array = array.ravel()
    if np.iscomplexobj(array):
        array = np.column_stack([array.real, array.imag]).ravel()
    if array.size > most:
        array = array[np.unique(np.linspace(0, array.size - 1, most).round().astype(int))]
    return [float(v) for v in array]


def named(prefix: str, values: Mapping[str, Any], keys: Iterable[str] | None = None) -> Values:
    """Entries of a mapping under "prefix.key"."""
    return {f"{prefix}.{key}": values[key] for key in (keys or values)}


def apart(prefix: str, values: Iterable[Any]) -> Values:
    """Entries of a list as numbers of their own: "prefix.0", "prefix.1", ..."""
    return {f"{prefix}.{k}": float(value) for k, value in enumerate(values)}


def flat(document: Any, *, prefix: str = "", without: Sequence[str] = (), most: int = 24) -> Values:
    """A JSON document as names and numbers: "a.b[2].c"; lists of numbers, matrices too, are thinned."""
    if isinstance(document, Mapping):
        found: Values = {}
        for key, value in document.items():
            if key not in without:
                path = f"{prefix}.{key}" if prefix else str(key)
                found |= flat(value, prefix=path, without=without, most=most)
        return found
    if isinstance(document, list | tuple):
        try:
            array = np.array(document, dtype=float)
        except (TypeError, ValueError):
            array = None
        if array is not None and array.size:
            return {prefix: thinned(array, most)}
        found = {f"{prefix}.size": float(len(document))}
        for index, value in enumerate(document):
            found |= flat(value, prefix=f"{prefix}[{index}]", without=without, most=most)
        return found
    if isinstance(document, bool | str) or document is None:
        return {prefix: document}
    return {prefix: float(document)}


def plain(values: Mapping[str, Any]) -> Values:
    """Arrays to lists, NumPy's numbers to Python's; what is not finite becomes a text (JSON has no such numbers)."""

    def one(value: Any) -> Any:
        if isinstance(value, np.ndarray | list | tuple):
            return [one(v) for v in np.asarray(value).tolist()] if not _texts(value) else [str(v) for v in value]
        if isinstance(value, bool | str | np.bool_) or value is None:
            return bool(value) if isinstance(value, np.bool_) else value
        number = float(value)
        return number if math.isfinite(number) else str(number)

    return {name: one(value) for name, value in values.items()}


def _texts(value: Any) -> bool:
    return len(value) > 0 and all(isinstance(v, str) for v in value)


def floor_of(value: Value) -> float:
    """Below this a difference counts as rounding: see `SMALL`."""
    if isinstance(value, list):
        numbers = [abs(v) for v in value if isinstance(v, int | float)]
        return max(RELATIVE * max(numbers, default=0.0), 1e-300)
    return SMALL


@dataclass(frozen=True)
class Deviation:
    """How far one number is from its frozen value: `size` in allowed deviations (1: just allowed)."""

    name: str
    frozen: Any
    now: Any
    size: float

    @property
    def relative(self) -> float:
        """Of the frozen value."""
        try:
            return abs(self.now - self.frozen) / abs(self.frozen)
        except (TypeError, ZeroDivisionError):
            return math.inf if self.size else 0.0

    def __str__(self) -> str:
        return f"{self.name}: frozen {self.frozen!r}, now {self.now!r} (relative {self.relative:.1e})"


def deviations(frozen: Values, now: Values, *, relative: float = RELATIVE) -> list[Deviation]:
    """Of every number, worst first; a missing, new or different kind of entry is infinitely far."""
    found = []
    for name in [*frozen, *(n for n in now if n not in frozen)]:
        if name not in frozen or name not in now:
            found.append(Deviation(name, frozen.get(name, "nothing"), now.get(name, "nothing"), math.inf))
            continue
        old, new = frozen[name], now[name]
        floor = floor_of(old) * relative / RELATIVE
        if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
            found += [_one(f"{name}[{i}]", *pair, floor, relative) for i, pair in enumerate(zip(old, new, strict=True))]
        else:
            found.append(_one(name, old, new, floor, relative))
    return sorted(found, key=lambda d: -d.size)


def _one(name: str, old: Any, new: Any, floor: float, relative: float) -> Deviation:
    if type(old) is not type(new) or not isinstance(old, float):
        return Deviation(name, old, new, 0.0 if old == new and type(old) is type(new) else math.inf)
    size = abs(new - old) / (relative * abs(old) + floor)
    return Deviation(name, old, new, math.inf if math.isnan(size) else size)
