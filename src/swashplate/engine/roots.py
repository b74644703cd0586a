"""Equations traced by CasADi with their roots left as symbols, to be found in loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from swashplate.engine.graph import Expression, Graph
from swashplate.extras import library
from swashplate.physics.backend import CasadiBackend, Residual


def require_casadi() -> Any:
    """CasADi, or what to do without it.

    Raises:
        MissingLibraryError: where it is not installed.
    """
    return library("casadi", what="computing a model")


@dataclass(frozen=True)
class Root:
    """A root that is found by Newton's method in a loop, in symbols.

    Attributes:
        start: the first guess. guess: what `value` and `slope`, the residual and its derivative, are functions of.
        root: stands for the solution wherever it is used. steps: at most.
    """

    start: Expression
    guess: Expression
    value: Expression
    slope: Expression
    root: Expression
    steps: int


@dataclass(frozen=True)
class Looped:
    """A CasADi function whose roots are found in loops.

    Attributes:
        function: of (state, input, surrounding, parameter, guesses, roots); its outputs are those that are wanted, then
            starts, values and slopes of the roots, each as a column.
        steps: of each root, at most; later roots may depend on earlier ones.
    """

    function: Graph = field(repr=False)
    steps: tuple[int, ...] = ()


class Looping(CasadiBackend):
    """Leaves roots as symbols. C can then end the search when the guess no longer moves, instead of unrolling it."""

    def __init__(self, casadi: Any) -> None:
        super().__init__()
        self.roots: list[Root] = []
        self._casadi = casadi

    def newton(self, residual: Residual, start: Expression, *, steps: int) -> Expression:
        guess, root = (self._casadi.SX.sym(f"{name}{len(self.roots)}") for name in ("guess", "root"))
        value, slope = residual(guess)
        self.roots.append(Root(start, guess, value, slope, root, steps))
        return root

    def looped(self, given: Sequence[Expression], results: Sequence[Expression]) -> Looped:
        """A function of `given` whose outputs are `results` and what the roots need."""

        def column(*entries: Expression) -> Expression:
            return self._casadi.vertcat(self._casadi.SX(0, 1), *entries)

        symbols = [column(*(getattr(root, name) for root in self.roots)) for name in ("guess", "root")]
        sought = [column(*(getattr(root, name) for root in self.roots)) for name in ("start", "value", "slope")]
        inputs, outputs = [*given, *symbols], [*results, *sought]
        function = self._casadi.Function("f", inputs, [self._casadi.densify(o) for o in outputs], {"cse": True})
        return Looped(function, tuple(root.steps for root in self.roots))
