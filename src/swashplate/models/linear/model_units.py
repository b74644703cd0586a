"""Whether the parameters' units fit the equations where they stand.

Radians count as a number, and prefixes are no matter. What has no unit, and a bare number, fits everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

from swashplate.flights.base_units import base_units
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space import Element, StateSpaceModel

Powers = tuple[tuple[str, int], ...]


class _ClashError(Exception):
    """Two units are added that are not alike."""


@dataclass(frozen=True)
class _Unit:
    """Powers of base units as a number for expressions: products and quotients, sums of what is alike."""

    powers: Powers

    @staticmethod
    def of(text: str) -> _Unit | None:
        known = base_units(text)
        return None if known is None else _Unit(_sorted({n: p for n, p in known[1].items() if n != "rad"}))

    def times(self, other: _Unit, sign: int) -> _Unit:
        powers = dict(self.powers)
        for name, power in other.powers:
            powers[name] = powers.get(name, 0) + sign * power
        return _Unit(_sorted(powers))

    def __mul__(self, other: _Unit | float) -> _Unit:
        return self.times(other, 1) if isinstance(other, _Unit) else self

    __rmul__ = __mul__

    def __truediv__(self, other: _Unit | float) -> _Unit:
        return self.times(other, -1) if isinstance(other, _Unit) else self

    def __rtruediv__(self, other: float) -> _Unit:
        return _Unit(()).times(self, -1)

    def __add__(self, other: _Unit | float) -> _Unit:
        if isinstance(other, _Unit) and other != self:
            raise _ClashError
        return self

    __radd__ = __sub__ = __rsub__ = __add__

    def __neg__(self) -> _Unit:
        return self

    def __str__(self) -> str:
        above, below = (
            " ".join(n if abs(p) == 1 else f"{n}^{abs(p)}" for n, p in self.powers if s * p > 0) for s in (1, -1)
        )
        return (above or "1") + (f"/({below})" if " " in below else f"/{below}" if below else "")


def _sorted(powers: dict[str, int]) -> Powers:
    return tuple(sorted((name, power) for name, power in powers.items() if power))


def unit_words(model: StateSpaceModel) -> list[str]:
    """Entries whose unit is not what their equation asks for, in words; none where all fit or too little is known."""
    known = {name: unit for name, p in model.parameters.items() if p.unit and (unit := _Unit.of(p.unit)) is not None}
    wrong = [text for e in model.elements if (text := _entry_words(model, e, known))]
    return (
        [f"units do not fit: {'; '.join(wrong)}. Is a number in other units, or in the wrong place?"] if wrong else []
    )


def _entry_words(model: StateSpaceModel, e: Element, known: dict[str, _Unit]) -> str:
    rows = model.outputs if e.matrix in ("H0", "H1", "D") else model.states
    columns = model.inputs if e.matrix in ("G", "D") else model.states
    row, column = rows[e.row], columns[e.column]
    above, below, second = (_Unit.of(text) for text in (model.units.get(row, ""), model.units.get(column, ""), "s"))
    if (
        above is None
        or below is None
        or second is None
        or not model.units.get(row)
        or not e.expression.names <= set(known)
    ):
        return ""
    left = _left(model, e.row, known) if e.matrix in ("F", "G") else _Unit(())
    if left is None:
        return ""
    rates = {"F": -1, "G": -1, "H1": 1}.get(e.matrix, 0)
    wanted = (above * left / below).times(second, rates)
    try:
        unit = e.expression(known)
    except _ClashError:
        return f"{e.expression.text} adds what is not alike"
    if e.matrix == "M" or not isinstance(unit, _Unit) or unit == wanted:
        return ""
    return f"{e.expression.text} before {column} in the equation of {row} is {unit}, expected {wanted}"


def _left(model: StateSpaceModel, row: int, known: dict[str, _Unit]) -> _Unit | None:
    """What multiplies the state's own rate on the left side; None where that is not known."""
    factor: Expression | None = next(
        (e.expression for e in model.elements if e.matrix == "M" and e.row == e.column == row), None
    )
    if factor is None or not factor.names:
        return _Unit(())
    unit = factor(known) if factor.names <= set(known) else None
    return unit if isinstance(unit, _Unit) else None
