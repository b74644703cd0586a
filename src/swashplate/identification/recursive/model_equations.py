"""Regression equations of a linear model: the rows whose derivatives are linear in what is free."""

from __future__ import annotations

from collections.abc import Collection

from swashplate.identification.recursive.equation import BIAS, RegressionEquation, regression_equation
from swashplate.models.linear.state_space import Element, StateSpaceModel


def model_equations(
    model: StateSpaceModel, channels: Collection[str]
) -> tuple[tuple[RegressionEquation, ...], tuple[str, ...]]:
    """The equations that a stream can estimate, and for every other state why it is left out, in words.

    What is held in the model is known; every equation has a constant of its own. Delays are the model's.

    Args:
        model: with matrices of named expressions.
        channels: that the stream has.
    """
    equations, left_out = [], []
    numbers = model.numbers()
    for row, state in enumerate(model.states):
        terms, why = _terms(model, row, channels)
        if state not in channels:
            why = f"{state} is not in the stream"
        if why or not terms:
            left_out.append(f"{state}: {why or 'nothing in it is free'}.")
            continue
        text = " + ".join([*terms, BIAS]).replace("+ -", "- ")
        used = {term.partition("*")[2] for term in terms}
        known = {n: model.delays.get(f"{state}_dot/{n}", model.delays.get(n)) for n in model.inputs if n in used}
        late = {n: float(expression(numbers)) for n, expression in known.items() if expression is not None}
        equations.append(regression_equation(f"{state}_dot = {text}", delays=late))
    return tuple(equations), tuple(left_out)


def _terms(model: StateSpaceModel, row: int, channels: Collection[str]) -> tuple[list[str], str]:
    """Terms of a state's row, and why it is none that a stream can estimate ("" where it is)."""
    terms: list[str] = []
    free = 0
    for e in model.elements:
        if e.row != row or e.matrix not in ("M", "F", "G"):
            continue
        if e.matrix == "M":
            if e.column != row or _factor(model, e) != 1.0:
                return [], "derivatives of several states stand in it"
            continue
        channel = (model.states if e.matrix == "F" else model.inputs)[e.column]
        factor = _factor(model, e)
        if factor == 0.0:
            continue
        if channel not in channels:
            return [], f"{channel} is not in the stream"
        if factor is None and e.expression.text not in model.free:
            return [], f"'{e.expression.text}' is not one free parameter"
        if factor is None and any(term.startswith(f"{e.expression.text}*") for term in terms):
            return [], f"{e.expression.text} stands in it twice"
        free += factor is None
        terms.append(f"{e.expression.text if factor is None else repr(factor)}*{channel}")
    return (terms if free else []), ""


def _factor(model: StateSpaceModel, element: Element) -> float | None:
    """The number that an entry is; None where something free stands in it."""
    waiting, seen = set(element.expression.names), set()
    while waiting:
        name = waiting.pop()
        seen.add(name)
        if name in model.free:
            return None
        tie = model.parameters[name].tie
        waiting |= set() if tie is None else set(tie.names) - seen
    return float(element.expression(model.numbers()))
