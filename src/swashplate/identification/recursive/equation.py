"""An equation of motion that is linear in what is unknown, as text: `p_dot = Lp*p + La*aileron + bias`.

The left side is a channel or the derivative of one. Terms of the right side are COEFFICIENT*CHANNEL: a name is unknown,
a number is known. `bias` is an unknown constant.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from swashplate.errors import IdentificationError
from swashplate.flights.schema import channel
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
        lags = {n: float(expression(numbers)) for n, expression in known.items() if expression is not None}
        equations.append(regression_equation(f"{state}_dot = {text}", delays=lags))
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
    waiting, visited = set(element.expression.names), set()
    while waiting:
        name = waiting.pop()
        visited.add(name)
        if name in model.free:
            return None
        tie = model.parameters[name].tie
        waiting |= set() if tie is None else set(tie.names) - visited
    return float(element.expression(model.numbers()))


BIAS = "bias"
_DERIVATIVE = "_dot"
_NAME = r"[A-Za-z_][A-Za-z0-9_.]*"
_TERM = re.compile(
    rf"\s*(?P<sign>[+-]?)\s*(?:(?P<number>\d*\.?\d+(?:[eE][+-]?\d+)?)|(?P<name>{_NAME}))\s*\*\s*(?P<channel>{_NAME})\s*"
)
_CONSTANT = re.compile(rf"\s*\+?\s*{BIAS}\b\s*")
_EXAMPLE = "Example: 'p_dot = Lp*p + La*aileron + bias'"


@dataclass(frozen=True)
class RegressionEquation:
    """One equation, linear in its unknown coefficients.

    Attributes:
        text: as it was given.
        left: the channel on the left.
        derivative: whether its derivative is meant.
        regressors: channel by unknown coefficient, in order; without the constant.
        known: factor by channel of what is known on the right.
        bias: whether there is an unknown constant.
        delays: of channels [s]; those left out act at once.
    """

    text: str
    left: str
    derivative: bool
    regressors: Mapping[str, str]
    known: Mapping[str, float]
    bias: bool
    delays: Mapping[str, float]

    @property
    def names(self) -> tuple[str, ...]:
        """The unknown coefficients, `bias` last."""
        return (*self.regressors, *([BIAS] if self.bias else []))

    @property
    def channels(self) -> tuple[str, ...]:
        """Every channel it needs, once: the left side first."""
        return tuple(dict.fromkeys((self.left, *self.regressors.values(), *self.known)))


def regression_equation(text: str, *, delays: Mapping[str, float] | None = None) -> RegressionEquation:
    """Read an equation.

    Args:
        text: such as `w_dot = Zw*w + Zc*collective + 1.0*gravity_part + bias`.
        delays: seconds by channel; a channel of the right side acts that much later than it is logged.

    Raises:
        IdentificationError: text that is none, an unknown that stands twice, a delay of a channel that is not there.
    """
    left, equals, right = text.partition("=")
    left = left.strip()
    if not equals or not re.fullmatch(_NAME, left) or not right.strip():
        raise IdentificationError(f"'{text}' is no equation.", channel="equation", hint=_EXAMPLE)
    derivative = left.endswith(_DERIVATIVE)
    unknown: dict[str, str] = {}
    known: dict[str, float] = {}
    bias, at = False, 0
    while at < len(right):
        constant, term = _CONSTANT.match(right, at), _TERM.match(right, at)
        if at and right[at] not in "+-":
            term = constant = None
        if term is None and constant is not None and not bias:
            bias, at = True, constant.end()
            continue
        if term is None:
            raise IdentificationError(
                f"'{right[at:].strip()}' in '{text}' is no COEFFICIENT*CHANNEL.", channel="equation", hint=_EXAMPLE
            )
        channel, name = term["channel"], term["name"]
        if name is None:
            known[channel] = known.get(channel, 0.0) + float(f"{term['sign']}{term['number']}")
        elif term["sign"] == "-" or name in unknown or name == BIAS:
            why = "is subtracted, expected a sum" if term["sign"] == "-" else "stands twice"
            raise IdentificationError(f"{why}: '{text}'.", channel=name, hint=_EXAMPLE)
        else:
            unknown[name] = channel
        at = term.end()
    if not unknown and not bias:
        raise IdentificationError(f"nothing is unknown in '{text}'.", channel="equation", hint=_EXAMPLE)
    lags = dict(delays or {})
    for channel, seconds in lags.items():
        if not 0.0 <= seconds < math.inf:
            raise IdentificationError(f"is {seconds} s, expected 0 or more.", channel=f"delay of {channel}")
    return RegressionEquation(
        text=text.strip(),
        left=left.removesuffix(_DERIVATIVE) if derivative else left,
        derivative=derivative,
        regressors=unknown,
        known=known,
        bias=bias,
        delays=lags,
    )


def coefficient_unit(equation: RegressionEquation, name: str, units: Mapping[str, str]) -> str:
    """The unit of a coefficient, by the schema's units of its channels or else `units`; "" where none is known."""
    left = channel(equation.left).unit or units.get(equation.left, "")
    if equation.derivative and left:
        left = _PER_SECOND.get(left, f"({left})/s")
    if name == BIAS:
        return left
    other = equation.regressors[name]
    right = channel(other).unit or units.get(other, "")
    return "" if not (left and right) else left if right == "1" else f"({left})/({right})"


_PER_SECOND = {"1": "1/s", "m": "m/s", "rad": "rad/s", "m/s": "m/s^2", "rad/s": "rad/s^2"}
