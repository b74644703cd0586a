"""A state-space model as a person writes it: its equations, one a line, and its parameters with units and sources."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space import ModelParameter, StateSpaceModel
from swashplate.shown import Saved

_GIVEN = "the structure's file"


def equation_lines(model: StateSpaceModel) -> tuple[str, ...]:
    """The equations of states and outputs, and the delays: "tau_f da/dt = -tau_f q - a + Alon longitudinal"."""
    rates = [f"d{name}/dt" for name in model.states]
    lines = []
    for row in range(len(model.states)):
        left = _terms(model, row, ("M",), rates) or [rates[row]]
        if not any(e.matrix == "M" and e.row == e.column == row for e in model.elements) and left != [rates[row]]:
            left = [rates[row], *left]
        right = [*_terms(model, row, ("F",), model.states), *_terms(model, row, ("G",), model.inputs)]
        lines.append(f"{_sum(left)} = {_sum(right)}")
    for row, output in enumerate(model.outputs):
        terms = _terms(model, row, ("H0",), model.states) + _terms(model, row, ("H1",), rates)
        terms += _terms(model, row, ("D",), model.inputs)
        if terms != [output]:
            lines.append(f"{output} = {_sum(terms)}")
    lines += [f"{name} acts {expression.text} later" for name, expression in model.delays.items()]
    return tuple(lines)


def _terms(model: StateSpaceModel, row: int, matrices: Sequence[str], names: Sequence[str]) -> list[str]:
    entries = [e for e in model.elements if e.row == row and e.matrix in matrices]
    return [_term(e.expression, names[e.column]) for e in sorted(entries, key=lambda e: e.column)]


def _term(expression: Expression, name: str) -> str:
    text = ast.unparse(ast.parse(expression.text, mode="eval"))  # without brackets that are not needed
    sign, size = ("-", text[1:]) if text.startswith("-") else ("", text)
    if size in ("1", "1.0"):
        return f"{sign}{name}"
    return f"{text} {name}" if size.isidentifier() or _is_number(size) else f"({text}) {name}"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _sum(terms: Sequence[str]) -> str:
    if not terms:
        return "0"
    return terms[0] + "".join(f" - {t[1:]}" if t.startswith("-") else f" + {t}" for t in terms[1:])


@dataclass(frozen=True)
class WrittenStructure(Saved):
    """What `swash vehicle structures` prints.

    Attributes:
        model: the structure.
    """

    model: StateSpaceModel

    def to_document(self) -> dict[str, object]:
        """All of it as JSON types."""
        m = self.model
        return {
            "name": m.name,
            "title": m.title,
            "trust": m.trust,
            "states": {name: m.units.get(name, "") for name in m.states},
            "inputs": {name: m.units.get(name, "") for name in m.inputs},
            "outputs": {name: m.units.get(name, "") for name in m.outputs},
            "equations": list(equation_lines(m)),
            "parameters": {name: _as_dict(p) for name, p in m.parameters.items()},
        }

    def __repr__(self) -> str:
        m = self.model
        units: Mapping[str, str] = m.units
        lines = [m.title, f"Trust: {m.trust}"]
        for what, names in (("States", m.states), ("Inputs", m.inputs), ("Outputs", m.outputs)):
            lines.append(f"{what}: {', '.join(f'{n} [{units.get(n) or 1}]' for n in names)}")
        lines += ["", *(f"  {text}" for text in equation_lines(m)), ""]
        lines.append(f"  {len(m.free)} free parameters, {len(m.parameters) - len(m.free)} held or tied")
        lines.append(f"  {'parameter':<10}{'start':>10}  {'unit':<11}{'bounds':<16}where the start value is from")
        return "\n".join([*lines, *(_line(p) for p in m.parameters.values())])


def _as_dict(p: ModelParameter) -> dict[str, Any]:
    ends = {k: v for k, v in (("lower", p.lower), ("upper", p.upper)) if np.isfinite(v)}
    tie = {"tie": p.tie.text} if p.tie is not None else {}
    return {"value": p.value, "unit": p.unit, "free": p.free, "source": p.note or _GIVEN, **ends, **tie}


def _line(p: ModelParameter) -> str:
    ends = "" if np.isinf(p.lower) and np.isinf(p.upper) else f"{p.lower:g} to {p.upper:g}".replace("inf", "any")
    state = f"= {p.tie.text}; " if p.tie is not None else "" if p.free else "held; "
    return f"  {p.name:<10}{p.value:>10.5g}  {p.unit or '-':<11}{ends:<16}{state}{p.note or _GIVEN}"
