"""Statements in C together with how they move: forward differentiation, a vector of directions at a time.

Every statement is printed once as a number and, where something that it reads moves, once more as a `vec`: its slopes
along as many directions as the processor's vectors hold (Griewank and Walther 2008, ch. 3: vector forward mode). Roots
are found as numbers; how they move follows from the residual there (implicit function theorem). Where two numbers are
equal, the slope of the larger or smaller one is the mean of both.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from swashplate.engine.c_expression import Statement, Statements
from swashplate.engine.c_loops import named, renamed, searches


class Tangents:
    """Prints statements with their tangents.

    Args:
        arrays: of the inputs that move, by name: that of their tangents and which entries move (None: all).
    """

    def __init__(self, arrays: Mapping[str, tuple[str, frozenset[int] | None]]) -> None:
        self._arrays = dict(arrays)
        self._made: dict[str, str] = {}

    def of(self, text: str) -> str | None:
        """The tangent of a text, None where it does not move."""
        if text in self._made:
            return self._made[text]
        entry = re.fullmatch(r"(\w+)\[(\d+)\]", text)
        if entry is None or entry[1] not in self._arrays:
            return None
        name, places = self._arrays[entry[1]]
        return f"{name}[{entry[2]}]" if places is None or int(entry[2]) in places else None

    def body(self, made: Sequence[Statement]) -> list[str]:
        """Statements with their tangents."""
        lines = []
        for s in made:
            lines.append(s.text("double", "double"))
            moved = _moved(s, [self.of(text) for text in s.reads])
            if moved is not None:
                lines.append(f"const vec d_{s.name} = {moved};")
                self._made[s.name] = f"d_{s.name}"
        return lines

    def stores(self, code: Statements, outputs: Mapping[int, str]) -> list[str]:
        """Outputs, by number, and their tangents into arrays of these names, and those with a `d` in front."""
        lines = []
        for (output, place), text in code.outputs.items():
            if output in outputs:
                lines.append(f"{outputs[output]}[{place}] = {text};")
                lines.append(f"d{outputs[output]}[{place}] = {self.of(text) or '(vec){0}'};")
        return lines

    def rooted(self, code: Statements, count: int) -> tuple[list[str], Statements]:
        """A function with `count` roots that are known (an array `root`), and the function that reads them by name."""
        lines = [f"const double root{i} = root[{i}];" for i in range(count)]
        for search in searches(code, count, first=1):
            lines += self.body([named(s) for s in search.before])
            lines += self.body([named(s) for s in search.inside])
            for i, value, slope in zip(search.sought, search.value, search.slope, strict=True):
                moved = self.of(renamed(value))
                if moved is not None:
                    lines.append(f"const vec d_root{i} = {moved} * (-1 / {renamed(slope)});")
                    self._made[f"root{i}"] = f"d_root{i}"
        return lines, Statements((), {place: renamed(text) for place, text in code.outputs.items()})


def _moved(s: Statement, moved: Sequence[str | None]) -> str | None:
    """The tangent of a statement from those of what it reads."""
    t, a, b = s.name, s.reads[0], s.reads[-1]
    da, db = moved[0], moved[-1]
    if s.operation == "ADD":
        return _sum(da, db)
    if s.operation == "SUB":
        return _sum(da, db and f"(-{db})") if da is None else _sum(da, db, " - ")
    if s.operation == "MUL":
        return _sum(da and f"{da} * {b}", db and f"{db} * {a}")
    if s.operation == "DIV":
        over = _sum(da, db and f"({db} * (-{t}))")
        return over and f"({over}) * (1 / {b})"
    if s.operation == "ATAN2":
        over = _sum(da and f"{da} * {b}", db and f"{db} * (-{a})")
        return over and f"({over}) * (1 / ({a} * {a} + {b} * {b}))"
    if s.operation in ("FMIN", "FMAX"):
        first, second = ("<=", ">=") if s.operation == "FMIN" else (">=", "<=")
        even = f"({a} == {b} ? 0.5 : 1.0)"
        return _sum(da and f"kept({da} * {even}, {a} {first} {b})", db and f"kept({db} * {even}, {a} {second} {b})")
    if s.operation == "IF_ELSE_ZERO":
        return db and f"kept({db}, {a} != 0)"
    factor = _FACTORS.get(s.operation)
    return da and factor and f"{da} * ({factor.format(t=t, a=a)})"


_FACTORS = {
    "SQ": "2 * {a}",
    "TWICE": "2.0",
    "NEG": "-1.0",
    "INV": "-{t} * {t}",
    "SQRT": "0.5 / {t}",
    "SIN": "cos({a})",
    "COS": "-sin({a})",
    "TAN": "1 + {t} * {t}",
    "FABS": "{a} > 0 ? 1.0 : {a} < 0 ? -1.0 : 0.0",
    "ASSIGN": "1.0",
}
"""Slopes of functions of one number; comparisons and signs have none."""


def _sum(first: str | None, second: str | None, sign: str = " + ") -> str | None:
    return f"{first}{sign}{second}" if first and second else first or second
