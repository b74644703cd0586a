"""A batch on a graphics card: the graph of a vehicle's rates as a JAX function over columns (extra `cuda`).

The only use of JAX in this package. It runs on any device that JAX computes on; on a processor `fly` is faster.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.engine.c_expression import Statement, statements
from swashplate.engine.c_text import Precision
from swashplate.engine.equations import Equations, equations_of
from swashplate.engine.fly import FlightPlan
from swashplate.engine.trace import unrolled_rates
from swashplate.errors import SwashError
from swashplate.extras import library
from swashplate.models.vehicle import Vehicle

_NAMES = ("x", "w", "p")


def fly_on_card(vehicle: Vehicle, plan: FlightPlan, *, precision: Precision = "single") -> NDArray[Any]:
    """States at the kept samples, shape (kept, states, vehicles), as of `fly`; Euler angles throughout.

    Args:
        vehicle: whose equations.
        plan: without a law, every row held for one step.
        precision: of all numbers.

    Raises:
        SwashError: for a plan with a law or with rows that hold longer.
        MissingLibraryError: without JAX.
    """
    if plan.steering is not None or plan.hold != 1 or not plan.held:
        raise SwashError("flies tables of held inputs only, a row a step.", channel="card")
    jax: Any = library("jax", what="A batch on a card")
    jax.config.update("jax_enable_x64", precision == "double")
    kept = (plan.steps_and_one - 1) // plan.keep
    dtype = np.float64 if precision == "double" else np.float32
    tables = [np.asarray(table, dtype) for table in (plan.start, plan.rows[: kept * plan.keep], plan.numbers)]
    later = batch_program(equations_of(vehicle), plan.keep)(*tables, dtype(plan.dt))
    return np.concatenate([tables[0][None], np.asarray(later)])


@lru_cache(maxsize=8)
def batch_program(equations: Equations, keep: int) -> Any:
    """A compiled function of states (n, vehicles), rows (steps, w, 1 or vehicles), numbers and step to later states."""
    jax: Any = library("jax", what="A batch on a card")
    rates = rates_by_jax(equations)

    def step(carry: tuple[Any, Any, Any], w: Any) -> tuple[Any, None]:
        x, p, dt = carry
        k1 = rates(x, w, p)
        k2 = rates(x + dt / 2 * k1, w, p)
        k3 = rates(x + dt / 2 * k2, w, p)
        k4 = rates(x + dt * k3, w, p)
        return (x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4), p, dt), None

    def kept(carry: tuple[Any, Any, Any], rows: Any) -> tuple[Any, Any]:
        carry, _ = jax.lax.scan(step, carry, rows)
        return carry, carry[0]

    def program(x: Any, rows: Any, p: Any, dt: Any) -> Any:
        return jax.lax.scan(kept, (x, p, dt), rows.reshape(-1, keep, *rows.shape[1:]))[1]

    return jax.jit(program)


def rates_by_jax(equations: Equations) -> Callable[[Any, Any, Any], Any]:
    """The rates of columns of states (n, vehicles) as JAX computes them, statement by statement of the graph."""
    jnp: Any = library("jax.numpy", what="A batch on a card")
    function = unrolled_rates(equations)
    code = statements(function, precision="double", inputs=_NAMES)
    wide = _operations(jnp)

    def rates(x: Any, w: Any, p: Any) -> Any:
        known: dict[str, Any] = {
            f"{name}[{i}]": column[i]
            for name, column in zip(_NAMES, (x, w, p), strict=True)
            for i in range(column.shape[0])
        }
        for s in code.body:
            known[s.name] = _evaluated(s, [_value(known, text) for text in s.reads], wide)
        told = [_value(known, code.outputs[0, i]) for i in range(function.size1_out(0))]
        return jnp.stack([jnp.broadcast_to(jnp.asarray(value, x.dtype), x.shape[1:]) for value in told])

    return rates


def _value(known: dict[str, Any], text: str) -> Any:
    return known[text] if text in known else float(text.strip("()"))


def _evaluated(s: Statement, of: Sequence[Any], wide: dict[str, Callable[..., Any]]) -> Any:
    return wide[s.operation](*of)


def _operations(jnp: Any) -> dict[str, Callable[..., Any]]:
    return {
        "ADD": lambda a, b: a + b,
        "SUB": lambda a, b: a - b,
        "MUL": lambda a, b: a * b,
        "DIV": lambda a, b: a / b,
        "NEG": lambda a: -a,
        "SQ": lambda a: a * a,
        "TWICE": lambda a: a + a,
        "INV": lambda a: 1.0 / a,
        "ASSIGN": lambda a: a,
        "SQRT": jnp.sqrt,
        "SIN": jnp.sin,
        "COS": jnp.cos,
        "TAN": jnp.tan,
        "FABS": jnp.abs,
        "ATAN2": jnp.arctan2,
        "SIGN": jnp.sign,
        "FMIN": jnp.minimum,
        "FMAX": jnp.maximum,
        "LT": lambda a, b: jnp.where(a < b, 1.0, 0.0),
        "LE": lambda a, b: jnp.where(a <= b, 1.0, 0.0),
        "EQ": lambda a, b: jnp.where(a == b, 1.0, 0.0),
        "NE": lambda a, b: jnp.where(a != b, 1.0, 0.0),
        "AND": lambda a, b: jnp.where((a != 0) & (b != 0), 1.0, 0.0),
        "OR": lambda a, b: jnp.where((a != 0) | (b != 0), 1.0, 0.0),
        "NOT": lambda a: jnp.where(a == 0, 1.0, 0.0),
        "IF_ELSE_ZERO": lambda a, b: jnp.where(a != 0, b, 0.0),
    }
