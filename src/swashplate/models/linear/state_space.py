"""`StateSpaceModel`: named states, inputs and outputs, and matrices whose entries are expressions of named parameters.

    M dx/dt = F x + G u(t - tau),    y = H0 x + H1 dx/dt + D u(t - tau)

A delay belongs to an input, to one response, or to one entry of G. Where entries of one input act at different times
the input is taken as several, one for each time (`wide`).

(Tischler and Remple 2012, eq. 13.1). The response and its derivatives (`sensitivities`) are exact.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import CardError
from swashplate.models.linear import late_entries, python_control, sensitivities
from swashplate.models.linear.expressions import Expression

UNMOVED = "unmoved"
"""Section of an identified model: what was fitted although nothing moved it from outside."""
MATRICES = ("M", "F", "G", "H0", "H1", "D")


@dataclass(frozen=True)
class ModelParameter:
    """One number of a model.

    Attributes:
        name, unit: what it is.
        value: start or estimate.
        free: whether a fit may move it.
        lower, upper: bounds.
        tie: what it is tied to, None where it stands for itself.
        dropped: value that it takes when a reduction drops it.
        note: anything a reader must know.
        cramer_rao: standard deviation of an identified value, as its fit bounds it; insensitivity: the same, were all
            others known (in its unit, NaN before a fit).
    """

    name: str
    value: float
    unit: str = ""
    free: bool = True
    lower: float = -np.inf
    upper: float = np.inf
    tie: Expression | None = None
    dropped: float = 0.0
    note: str = ""
    cramer_rao: float = float("nan")
    insensitivity: float = float("nan")


@dataclass(frozen=True)
class Element:
    """One entry of a matrix: an expression at a place."""

    matrix: str
    row: int
    column: int
    expression: Expression


@dataclass(frozen=True)
class StateSpaceModel:
    """A linear model with numbers.

    Attributes:
        name, title, trust: what it is and where it holds.
        states, inputs, outputs: names; units by name in `units`.
        parameters: by name, in the file's order.
        elements: entries of the matrices (M is the identity where nothing is said).
        delays: expressions [s] by input, by "output/input" (one response) or by "state_dot/input" (one entry of G).
        units: by state, input and output.
        document: the file's own structure, from which the model is written again.
    """

    name: str
    title: str
    trust: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: Mapping[str, ModelParameter]
    elements: tuple[Element, ...]
    delays: Mapping[str, Expression] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    document: Mapping[str, Any] = field(default_factory=dict, repr=False)

    # ---- numbers -----------------------------------------------------------------------------------------------
    @cached_property
    def tie_order(self) -> tuple[str, ...]:
        """Tied parameters, each after those that it uses.

        Raises:
            CardError: where ties run in a circle.
        """
        waiting = {name for name, p in self.parameters.items() if p.tie is not None}
        order: list[str] = []
        while waiting:
            ready = sorted(n for n in waiting if not (self._tie(n).names & waiting))
            if not ready:
                raise CardError("ties run in a circle.", where=self.name, channel=", ".join(sorted(waiting)))
            order += ready
            waiting -= set(ready)
        return tuple(order)

    def _tie(self, name: str) -> Expression:
        tie = self.parameters[name].tie
        assert tie is not None
        return tie

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Names that a fit moves, in the file's order."""
        return tuple(name for name, p in self.parameters.items() if p.free and p.tie is None)

    def numbers(self, changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Every parameter's value, ties followed (also for complex numbers)."""
        values: dict[str, Any] = {name: p.value for name, p in self.parameters.items()}
        values |= dict(changes or {})
        for name in self.tie_order:
            values[name] = self._tie(name)(values)
        return values

    def with_unmoved(self, inputs: Iterable[str]) -> StateSpaceModel:
        """A copy whose file names the inputs that nothing moved from outside in the data of a fit; gains refuse it."""
        document = {key: part for key, part in self.document.items() if key != UNMOVED}
        named = {name: 1.0 for name in inputs if name in self.inputs}
        return replace(self, document=document | ({UNMOVED: named} if named else {}))

    def with_values(self, values: Mapping[str, float], **changes: Any) -> StateSpaceModel:
        """A copy with other numbers; ties follow. `changes` go to each changed parameter (e.g. `free=False`).

        Raises:
            CardError: a name that the model does not have.
        """
        unknown = sorted(set(values) - set(self.parameters))
        if unknown:
            raise CardError(
                f"is no parameter of '{self.name}'; it has {', '.join(self.parameters)}.", channel=", ".join(unknown)
            )
        changed = {n: replace(self.parameters[n], value=float(v), **changes) for n, v in values.items()}
        new = replace(self, parameters={**self.parameters, **changed})
        tied = {n: float(v) for n, v in new.numbers().items() if new.parameters[n].tie is not None}
        return replace(
            new, parameters={**new.parameters, **{n: replace(new.parameters[n], value=v) for n, v in tied.items()}}
        )

    def with_bounds(self, bounds: Mapping[str, tuple[float, float]]) -> StateSpaceModel:
        """A copy whose parameters carry what a fit told of them, and nothing of earlier fits.

        Args:
            bounds: standard deviation and insensitivity by name [the parameter's unit].
        """
        nothing = (np.nan, np.nan)
        return replace(
            self,
            parameters={
                n: replace(p, cramer_rao=bounds.get(n, nothing)[0], insensitivity=bounds.get(n, nothing)[1])
                for n, p in self.parameters.items()
            },
        )

    @property
    def trim(self) -> dict[str, str]:
        """The held parameters that say where the model stands: by trimmed state, those of the file's [trim]."""
        named = {state: str(text) for state, text in self.document.get("trim", {}).items()}
        return {s: n for s, n in named.items() if n in self.parameters and n not in self.free and not self._tied(n)}

    def _tied(self, name: str) -> bool:
        return self.parameters[name].tie is not None

    def check_bounds(self, names: Iterable[str]) -> None:
        """That parameters lie within their own bounds.

        Raises:
            CardError: naming the parameter, its value and its bounds.
        """
        for name in names:
            p = self.parameters[name]
            if not p.lower <= p.value <= p.upper:
                raise CardError(
                    f"is given as {p.value:g}, expected {p.lower:g} to {p.upper:g}{f' {p.unit}' if p.unit else ''}.",
                    where=self.name,
                    channel=name,
                    hint="Give a value within the bounds of the model file, or change them there.",
                )

    def matrices(self) -> dict[str, Array]:
        """M, F, G, H0, H1 and D as numbers."""
        values = self.numbers()
        shapes = self.shapes
        matrices = {name: np.eye(*shapes[name]) if name == "M" else np.zeros(shapes[name]) for name in MATRICES}
        for e in self.elements:
            matrices[e.matrix][e.row, e.column] = float(e.expression(values))
        return matrices

    @property
    def shapes(self) -> dict[str, tuple[int, int]]:
        """Rows and columns of each matrix."""
        n, m, k = len(self.states), len(self.inputs), len(self.outputs)
        return {"M": (n, n), "F": (n, n), "G": (n, m), "H0": (k, n), "H1": (k, n), "D": (k, m)}

    def explicit(self) -> tuple[Array, Array, Array, Array]:
        """A, B, C, D of dx/dt = A x + B u, y = C x + D u (delays apart).

        Raises:
            CardError: where the left side M cannot be solved for the states' derivatives.
        """
        m = self.matrices()
        if self.states and np.linalg.cond(m["M"]) > 1e12:
            raise CardError(
                "the left side is singular: some state's derivative stands in no equation.", where=self.name
            )
        a, b = np.linalg.solve(m["M"], m["F"]), np.linalg.solve(m["M"], m["G"])
        return (
            np.asarray(a, dtype=np.float64),
            np.asarray(b, dtype=np.float64),
            np.asarray(m["H0"] + m["H1"] @ a, dtype=np.float64),
            np.asarray(m["D"] + m["H1"] @ b, dtype=np.float64),
        )

    @cached_property
    def entry_delays(self) -> dict[str, tuple[int, int]]:
        """The delays of single entries of G, each with its row and column."""
        return late_entries.places(self)

    @cached_property
    def wide(self) -> tuple[StateSpaceModel, tuple[int, ...]]:
        """The same model with one more input for every entry of G that has a delay of its own.

        Returns:
            The model, and for each of its inputs which input of this one drives it.
        """
        return late_entries.widened(self)

    def refuse_entry_delays(self, what: str) -> None:
        """Say that something holds no delays of single entries.

        Raises:
            CardError: where the model has any.
        """
        if self.entry_delays:
            raise CardError(
                f"is a delay of one entry of G, and {what} an input as a whole.",
                where=self.name,
                channel=", ".join(self.entry_delays),
                hint="Give the input one delay in [delays]; fits to responses and verification hold those of entries.",
            )

    def delay(self, output: str, input: str) -> float:
        """Delay of one response [s].

        Raises:
            CardError: where entries of that input have delays of their own.
        """
        if any(self.inputs[j] == input for _, j in self.entry_delays.values()):
            self.refuse_entry_delays("this needs the delay of")
        expression = self.delays.get(f"{output}/{input}", self.delays.get(input))
        return 0.0 if expression is None else float(expression(self.numbers()))

    def eigenvalues(self) -> Complex:
        """Of dx/dt = A x [1/s], fastest first."""
        values = np.linalg.eigvals(self.explicit()[0]).astype(np.complex128)
        return values[np.argsort(-np.abs(values), kind="stable")]

    def response(self, omega: Array) -> Complex:
        """H(j omega) with its delays, shape (n_f, n_outputs, n_inputs)."""
        if self.entry_delays:
            wide, owner = self.wide
            return np.asarray(wide.response(omega) @ late_entries.shares(owner))
        m, s = self.matrices(), 1j * np.asarray(omega)[:, None, None]
        x = np.linalg.solve(s * m["M"] - m["F"], np.broadcast_to(m["G"] + 0j, (len(omega), *m["G"].shape)))
        h = (m["H0"] + s * m["H1"]) @ x + m["D"]
        values = self.numbers()
        delays = {name: float(expression(values)) for name, expression in self.delays.items()}
        lag = np.array([[delays.get(f"{o}/{i}", delays.get(i, 0.0)) for i in self.inputs] for o in self.outputs])
        return np.asarray(h * np.exp(-s * lag), dtype=np.complex128)

    def to_control(self, *, pade: int | None = None) -> Any:
        """As `control.StateSpace` with named signals.

        Args:
            pade: order of the polynomials that stand for the delays; 0 leaves the delays out, None does so with a
                warning where there are any.

        Raises:
            SwashError: an order outside 0 to 12.
        """
        if self.entry_delays:
            wide, owner = self.wide
            return python_control.joined(wide.to_control(pade=pade), late_entries.shares(owner), inputs=self.inputs)
        numbers = self.numbers()
        return python_control.state_space(
            self.explicit(),
            states=self.states,
            inputs=self.inputs,
            outputs=self.outputs,
            delays={name: float(expression(numbers)) for name, expression in self.delays.items()},
            pade=pade,
            name=self.name,
        )

    # ---- sensitivities -----------------------------------------------------------------------------------------
    @cached_property
    def uses(self) -> dict[str, frozenset[str]]:
        """The parameters behind every parameter: itself, or those that its tie uses."""
        uses: dict[str, frozenset[str]] = {n: frozenset([n]) for n in self.parameters if n not in self.tie_order}
        for name in self.tie_order:
            uses[name] = frozenset().union(*(uses[used] for used in self._tie(name).names))
        return uses

    def sensitivities(
        self, free: tuple[str, ...], numbers: Array, pairs: list[tuple[int, int, Array]]
    ) -> tuple[list[Complex], list[Complex]]:
        """Responses of some pairs at their own frequencies, and their derivatives.

        Args:
            free: parameters that move, in the order of `numbers`.
            numbers: their values.
            pairs: (output index, input index, omega [rad/s]) each.

        Returns:
            Per pair the response (n,) and the slopes (n, len(free)).
        """
        if self.entry_delays:
            return late_entries.sensitivities(self, free, numbers, pairs)
        return sensitivities.of_pairs(self, free, numbers, pairs)

    def log_slopes(self, output: str, input: str, omega: Array, free: Sequence[str]) -> tuple[Complex, Complex]:
        """One response (n,) and the derivatives of its logarithm by named parameters, shape (n, n_free).

        Args:
            output, input: the pair. omega: [rad/s]. free: names of parameters.
        """
        pair = (self.outputs.index(output), self.inputs.index(input), omega)
        at = np.array([self.parameters[name].value for name in free])
        (h,), (slopes,) = self.sensitivities(tuple(free), at, [pair])
        with np.errstate(divide="ignore", invalid="ignore"):
            return h, slopes / h[:, None]

    def __repr__(self) -> str:
        head = f"{self.name}: {len(self.states)} states, inputs {', '.join(self.inputs)}"
        lines = [head, f"  {'parameter':<14}{'value':>12}{'sigma %':>8}{'I %':>8}  unit"]
        for p in self.parameters.values():
            size = abs(p.value) or 1.0
            known = np.isfinite(p.cramer_rao)
            cells = f"{100 * p.cramer_rao / size:>8.1f}{100 * p.insensitivity / size:>8.1f}" if known else " " * 16
            tie = f"  = {p.tie.text}" if p.tie is not None else "" if p.free else "  fixed"
            lines.append(f"  {p.name:<14}{p.value:>12.5g}{cells}  {p.unit}{tie}")
        return "\n".join(lines)
