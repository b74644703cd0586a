"""A model's equations at the samples of a record, traceable: defects, errors, their slopes, and a filter along a path.

The defect is Hermite and Simpson's: a cubic between two samples whose rate half way is the equations' own (Hargraves
and Paris 1987), of fourth order in the step.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from swashplate.identification.core.banded_least_squares import Chain
from swashplate.identification.core.parameters import Layout
from swashplate.identification.time.vehicle_likelihood import FORCES, measurable
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.simulation.compilation import QUICK_TO_COMPILE
from swashplate.simulation.dynamics import Equations, row_force, row_rates

_DIFFUSE = 1e3
"""Sizes of a state by which the filter's first guess may be wrong."""

Numbers = Mapping[str, jax.Array]
Pair = tuple[jax.Array, jax.Array]


Rates = Callable[[jax.Array, jax.Array], jax.Array]
"""From a state and what drives it."""
Seen = Callable[[jax.Array, jax.Array, jax.Array], jax.Array]
"""From a state, its rate and what drives it."""


class Predictor(Protocol):
    """A model's equations as hashable functions of rows."""

    def driving(self, given: Numbers, numbers: jax.Array) -> jax.Array:
        """What drives it, (2 n - 1, n_driving): at every sample and half way between."""
        ...

    def functions(self, given: Numbers, numbers: jax.Array) -> tuple[Rates, Seen]:
        """Rates and outputs, both without constants."""
        ...


@dataclass(frozen=True)
class VehiclePredictor:
    """Any vehicle's equations, their free parameters first in the row."""

    equations: Equations
    layout: Layout
    outputs: tuple[str, ...]

    def driving(self, given: Numbers, numbers: jax.Array) -> jax.Array:
        w = given["driving"]
        return jnp.zeros((2 * len(w) - 1, w.shape[1])).at[::2].set(w).at[1::2].set(0.5 * (w[:-1] + w[1:]))

    def functions(self, given: Numbers, numbers: jax.Array) -> tuple[Rates, Seen]:
        free = numbers[: len(self.layout.free)]
        p = jnp.concatenate([jnp.stack(list(self.layout.values(given["card"], free))), given["constants"]])
        equations, force = row_rates(self.equations, padded=False), row_force(self.equations)
        known = measurable(self.equations.vehicle)
        rows = jnp.array([known.index(name) for name in self.outputs])
        felt = any(name in FORCES for name in self.outputs)

        def rates(x: jax.Array, w: jax.Array) -> jax.Array:
            values: jax.Array = equations(x, w, p)
            return values

        def seen(x: jax.Array, dx: jax.Array, w: jax.Array) -> jax.Array:
            return jnp.concatenate([x, dx, force(x, w, p)] if felt else [x, dx])[rows]

        return rates, seen


@dataclass(frozen=True)
class StructurePredictor:
    """A state-space model, its free parameters first in the row; inputs are late by their delays."""

    key: Hashable
    model: StateSpaceModel = field(compare=False, repr=False)
    outputs: tuple[str, ...]
    delays: tuple[Expression | None, ...]

    def _values(self, numbers: jax.Array) -> dict[str, Any]:
        return self.model.numbers(dict(zip(self.model.free, numbers, strict=False)))

    def driving(self, given: Numbers, numbers: jax.Array) -> jax.Array:
        values, t = self._values(numbers), given["time"]
        half = jnp.zeros(2 * t.size - 1).at[::2].set(t).at[1::2].set(0.5 * (t[:-1] + t[1:]))
        columns = [
            jnp.interp(half - (0.0 if late is None else late(values)), t, u)
            for late, u in zip(self.delays, given["driving"].T, strict=True)
        ]
        return jnp.stack(columns, axis=1)

    def functions(self, given: Numbers, numbers: jax.Array) -> tuple[Rates, Seen]:
        model, values = self.model, self._values(numbers)
        n, m, k = len(model.states), len(model.inputs), len(model.outputs)

        def matrix(name: str, rows: int, columns: int) -> jax.Array:
            entries: list[list[Any]] = [[float(name == "M" and i == j) for j in range(columns)] for i in range(rows)]
            for e in model.elements:
                if e.matrix == name:
                    entries[e.row][e.column] = e.expression(values)
            return jnp.array(entries, dtype=float)

        F, G = matrix("F", n, n), matrix("G", n, m)
        if any(e.matrix == "M" for e in model.elements):
            F, G = jnp.split(jnp.linalg.solve(matrix("M", n, n), jnp.concatenate([F, G], axis=1)), [n], axis=1)
        shown = jnp.array([model.outputs.index(o) for o in self.outputs])
        H0, H1, D = (matrix(name, k, columns)[shown] for name, columns in (("H0", n), ("H1", n), ("D", m)))
        return (lambda x, w: F @ x + G @ w), (lambda x, dx, w: H0 @ x + H1 @ dx + D @ w)


NOWHERE = -1
"""Place of a number that is not estimated: the zero that stands behind the row."""


@dataclass(frozen=True)
class CollocationPlan:
    """What compiled code depends on; places are those in the row."""

    model: Predictor
    dt: float
    shift: tuple[int, ...]
    bias: tuple[int, ...]


def _residuals(plan: CollocationPlan, given: Numbers, numbers: jax.Array) -> tuple[Any, Any, jax.Array]:
    """The defect of two states and the error of one as functions, and what drives them."""
    row = jnp.append(numbers, 0.0)
    shift, bias = row[jnp.array(plan.shift)], row[jnp.array(plan.bias)]
    equations, seen = plan.model.functions(given, numbers)

    def rates(x: jax.Array, w: jax.Array) -> jax.Array:
        return equations(x, w) + shift

    def defect(x: jax.Array, after: jax.Array, w: jax.Array) -> jax.Array:
        f, g = rates(x, w[0]), rates(after, w[2])
        middle = rates(0.5 * (x + after) + plan.dt / 8.0 * (f - g), w[1])
        return after - x - plan.dt / 6.0 * (f + 4.0 * middle + g)

    def error(x: jax.Array, w: jax.Array, y: jax.Array) -> jax.Array:
        return y - seen(x, rates(x, w), w) - bias

    return defect, error, plan.model.driving(given, numbers)


def _both(plan: CollocationPlan, given: Numbers, numbers: jax.Array, x: jax.Array) -> tuple[jax.Array, jax.Array]:
    defect, error, w = _residuals(plan, given, numbers)
    triples = jnp.stack([w[:-2:2], w[1::2], w[2::2]], axis=1)
    return jax.vmap(defect)(x[:-1], x[1:], triples), jax.vmap(error)(x, w[::2], given["outputs"])


def _traced_local(plan: CollocationPlan, given: Numbers, numbers: jax.Array, x: jax.Array) -> Chain:
    defect, error, w = _residuals(plan, given, numbers)
    triples = jnp.stack([w[:-2:2], w[1::2], w[2::2]], axis=1)
    before, after = jax.vmap(jax.jacfwd(defect, argnums=(0, 1)))(x[:-1], x[1:], triples)
    here = jax.vmap(jax.jacfwd(error))(x, w[::2], given["outputs"])
    parts: Any = (*_both(plan, given, numbers, x), before, after, here)
    return Chain(*parts)


chain_at = jit(static_argnums=0, compiler_options=QUICK_TO_COMPILE)(_traced_local)


@jit(static_argnums=0, compiler_options=QUICK_TO_COMPILE)
def moved_by_numbers(plan: CollocationPlan, given: Numbers, numbers: jax.Array, x: jax.Array, ways: jax.Array) -> Any:
    """How defects and errors at a path move along ways of the numbers, (n_ways, ...) each."""
    return jax.vmap(lambda way: jax.jvp(lambda p: _both(plan, given, p, x), (numbers,), (way,))[1])(ways)


@jit(static_argnums=(0, 4), compiler_options=QUICK_TO_COMPILE)
def rate_slopes(plan: CollocationPlan, given: Numbers, numbers: jax.Array, x: jax.Array, sample: int) -> jax.Array:
    """Slopes of the rates by the states (s, s) at a sample's inputs."""
    w = plan.model.driving(given, numbers)[2 * sample]
    slopes: jax.Array = jax.jacfwd(plan.model.functions(given, numbers)[0])(x, w)
    return slopes


class Innovations(NamedTuple):
    """Innovations one output after the other and their variances; one-step errors and their variances; (n, o) each."""

    innovation: Any
    variance: Any
    error: Any
    spread: Any


def _traced_filter(
    plan: CollocationPlan, given: Numbers, numbers: jax.Array, noise: jax.Array, x: jax.Array
) -> Innovations:
    """A Kalman filter of what is left of the path, linear along it, its first guess diffuse.

    Outputs are taken in one by one, which their independent errors allow, in Joseph's form (Simon 2006, sec. 6.1).
    """
    local = _traced_local(plan, given, numbers, x)
    s = x.shape[1]
    q, r = jnp.exp(noise[:s]), jnp.exp(noise[s:])
    gathered = jnp.broadcast_to(jnp.diag(q * jnp.sqrt(plan.dt)), (len(local.w), s, s))
    right = jnp.concatenate([-local.before, gathered, -local.w[:, :, None]], axis=2)
    moved = jnp.linalg.solve(local.after, right)
    moved = jnp.concatenate([moved, jnp.zeros_like(moved[:1])])  # nothing comes after the last
    first = jnp.diag((_DIFFUSE * given["size"]) ** 2)

    def step(carry: Pair, now: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[Pair, Innovations]:
        (d, P), (v, c, move) = carry, now
        before = v + c @ d, jnp.sum((c @ P) * c, axis=1) + r**2  # any of this sample's outputs is taken in

        def taken(carry: Pair, one: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[Pair, Pair]:
            (d, P), (v, c, r) = carry, one
            across = P @ c
            variance = c @ across + r**2
            innovation, gain = v + c @ d, -across / variance
            kept = jnp.eye(s) + jnp.outer(gain, c)
            P = kept @ P @ kept.T + r**2 * jnp.outer(gain, gain)
            return (d + gain * innovation, P), (innovation, variance)

        (d, P), seen = jax.lax.scan(taken, (d, P), (v, c, r))
        phi, spread, offset = move[:, :s], move[:, s : 2 * s], move[:, -1]
        return (phi @ d + offset, phi @ P @ phi.T + spread @ spread.T), Innovations(*seen, *before)

    samples: Any = (local.v, local.here, moved)
    innovations: Innovations = jax.lax.scan(step, (jnp.zeros(s), first), samples)[1]
    return innovations


innovations_along = jit(static_argnums=0, compiler_options=QUICK_TO_COMPILE)(_traced_filter)


@jit(static_argnums=0, compiler_options=QUICK_TO_COMPILE)
def innovations_moved(plan: CollocationPlan, given: Numbers, at: Pair, x: jax.Array, ways: Pair) -> Pair:
    """Innovations and variances along ways of numbers and noise, (n_ways, n, o) each, the path held."""

    def along(way: Pair) -> Pair:
        moved: Innovations = jax.jvp(lambda p: _traced_filter(plan, given, p[0], p[1], x), (at,), (way,))[1]
        return moved.innovation, moved.variance

    return jax.vmap(along)(ways)
