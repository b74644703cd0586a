"""A recursive Fourier regression as C99: one file with its constants in front, for a small processor.

Memory is two structures of the caller's; nothing is allocated. The loops stand in `templates/regression.c`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.engine.emit import REAL, comment_text, fill_template, identifier
from swashplate.engine.statements import Precision, literal
from swashplate.errors import ExportError
from swashplate.identification.recursive import fourier_regression
from swashplate.identification.recursive.equation import BIAS
from swashplate.identification.recursive.fourier_regression import EARLY, LATE, RegressionPlan

CYCLES = 5
"""Of a Cortex-M7's clock that an operation is taken to cost, its loads and stores included: an assumption."""


@dataclass(frozen=True)
class RegressionCode:
    """C of a recursive regression, and what it costs.

    Attributes:
        name: what its functions begin with.
        header, source: the texts of the .h and .c files.
        memory_bytes: kept between steps. work_bytes: of an estimate, free between estimates. table_bytes: constants.
        step_operations, estimate_operations: additions, multiplications, divisions and roots of the longest step and
            of an estimate, counted from the loops.
    """

    name: str
    header: str
    source: str
    memory_bytes: int
    work_bytes: int
    table_bytes: int
    step_operations: int
    estimate_operations: int

    def files(self) -> dict[str, str]:
        """Texts by file name."""
        return {f"{self.name}.h": self.header, f"{self.name}.c": self.source}

    def load(self, *, rate: float, megahertz: float, every: int = 1) -> float:
        """Share of a processor's time, at `CYCLES` an operation.

        Args:
            rate: steps per second [Hz]. megahertz: of the processor's clock.
            every: steps per estimate.
        """
        return CYCLES * rate * (self.step_operations + self.estimate_operations / every) / (1e6 * megahertz)


def regression_code(
    plan: RegressionPlan, *, name: str = "regression", precision: Precision = "double"
) -> RegressionCode:
    """The C of a recursive regression.

    Args:
        plan: what it works with.
        name: what files, types and functions begin with.
        precision: of every number in it.

    Raises:
        ExportError: a name or a number that C cannot hold; a plan with instruments.
    """
    if plan.instruments:
        raise ExportError("are for Python only: its C is plain least squares.", channel="instruments")
    e, called, real = plan.equation, identifier(name), REAL[precision]
    channels, unknowns, lines = len(e.channels), len(e.names), plan.last - plan.first + 1
    turned = np.exp(-2j * np.pi * plan.spacing * plan.dt)
    constants = {
        "ZERO": 0.0,
        "ONE": 1.0,
        "TWO": 2.0,
        "HALF": 0.5,
        "THREE_HALVES": 1.5,
        "TURN_RE": float(turned.real),
        "TURN_IM": float(turned.imag),
        "KEEP": plan.keep,
        "KEEP_SQUARED": plan.keep**2,
        "HALF_STEP": 0.5 * plan.dt,
        "SHORTEST": EARLY * plan.dt,
        "LONGEST": LATE * plan.dt,
        "LEAST_PIVOT": fourier_regression.LEAST_PIVOT,
        "LEAST_LEFT": fourier_regression.LEAST_LEFT,
        "LEAST_FREEDOM": fourier_regression.LEAST_FREEDOM,
    }
    blanks = {
        "NAME": called,
        "UPPER": called.upper(),
        "REAL": real,
        "SQRT": "sqrt" if precision == "double" else "sqrtf",
        "CHANNELS": channels,
        "UNKNOWNS": unknowns,
        "LINES": lines,
        "SUMS": channels + 2,
        "WINDOW": 2 * plan.last + 1,
        "FIRST": plan.first,
        "AROUND": plan.around,
        "DERIVATIVE": int(e.derivative),
        **{key: literal(value, precision) for key, value in constants.items()},
        **_tables(plan, precision),
        **_about(plan),
    }
    size = 8 if precision == "double" else 4
    numbers = 2 * (channels + 2) * lines + 2 * (2 * plan.last + 1) + 2 + channels
    work = 2 * lines * (unknowns + 2) + 4 * unknowns**2 + 4 * unknowns
    return RegressionCode(
        name=called,
        header=fill_template("regression.h", blanks),
        source=fill_template("regression.c", blanks),
        memory_bytes=numbers * size + 8,
        work_bytes=work * size,
        table_bytes=(2 * (channels + 1) * lines + lines + channels) * size + 4 * (channels + unknowns),
        step_operations=_step_operations(plan),
        estimate_operations=_estimate_operations(plan),
    )


def _about(plan: RegressionPlan) -> dict[str, str]:
    """What the header says of it."""
    e = plan.equation
    return {
        "EQUATION": comment_text(e.text),
        "RATE": f"{1.0 / plan.dt:g}",
        "CHANNEL_NAMES": comment_text(", ".join(e.channels)),
        "UNKNOWN_NAMES": comment_text(", ".join(e.names)),
        "BAND": f"{plan.hertz[0]:g} to {plan.hertz[-1]:g} Hz, {plan.spacing:g} Hz apart",
        "FORGETS": "nothing" if np.isinf(plan.memory) else f"what is {plan.memory:g} s old counts e times less",
    }


def _tables(plan: RegressionPlan, precision: Precision) -> dict[str, str]:
    e = plan.equation

    def row(values: object) -> str:
        return ", ".join(literal(float(value), precision) for value in np.ravel(np.asarray(values)))

    places = [e.channels.index(name) for name in e.regressors.values()]
    factors = (", ".join(f"{{{row([f.real, f.imag])}}}" for f in channel) for channel in (*plan.factors, plan.hold))
    return {
        "HELD": ", ".join(str(int(name in plan.held)) for name in e.channels),
        "COLUMNS": ", ".join(map(str, [*places, *([len(e.channels)] if BIAS in e.names else [])])),
        "KNOWN": row([e.known.get(name, 0.0) for name in e.channels]),
        "OMEGA": row(2.0 * np.pi * plan.hertz),
        "FACTORS": ",\n  ".join(f"{{{each}}}" for each in factors),
    }


# ---- what it costs: the loops of templates/regression.c, read line by line -------------------------------------------
_TURN = 6
"""Operations of a complex product."""


def _step_operations(plan: RegressionPlan) -> int:
    e = plan.equation
    held = sum(name in plan.held for name in e.channels)
    smooth, lines, window = len(e.channels) - held, plan.last - plan.first + 1, 2 * plan.last + 1
    a_line = 2 * (3 * held + 6 * smooth + 2 + 5)
    return len(e.channels) + _TURN + 7 + window * (8 + 2 * _TURN) + lines * a_line


def _estimate_operations(plan: RegressionPlan) -> int:
    e = plan.equation
    n, k = plan.last - plan.first + 1, len(e.names)
    columns = len(e.names)
    known = sum(factor != 0.0 for factor in e.known.values())
    rows = n * (_TURN + 4 * e.derivative + known * (_TURN + 4) + columns * _TURN)
    gram = n * 4 * (k * (k + 1) // 2 + k) + k + k * (k + 1)
    below = sum(2 * j + 1 for i in range(k) for j in range(i + 1))
    inverse = sum(2 * (i - j) + 1 for j in range(k) for i in range(j, k)) + sum(
        2 * (i - j) for j in range(k) for i in range(j) if i > j
    )
    product = sum(2 * (k - max(i, j)) for i in range(k) for j in range(k))
    freedom = 6 * n + 6
    values = k * (3 * k + 1)
    residual = n * (4 * k + 3)
    near = sum(min(n - 1, at + plan.around) - max(0, at - plan.around) + 1 for at in range(n))
    taken = n * (5 * k * k + 5 * k + 4)
    spectrum = near * 6 + n * (6 + 4 * k)
    sandwich = n * n * (4 + 8 * k) + n * 5 * k * k + 4 * k**3 + 2 * k * k
    return rows + gram + below + inverse + product + freedom + values + residual + taken + spectrum + sandwich
