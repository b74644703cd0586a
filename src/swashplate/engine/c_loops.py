"""A traced function in C whose roots are found by Newton's method in loops that end when the guess no longer moves.

Unrolled, as every other back end has it, the search always takes as many steps as its worst case. Roots that do not
depend on each other are sought in one loop, so that a processor works on the one while the other waits for a quotient.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from swashplate.engine.c_expression import Statement, Statements
from swashplate.engine.c_text import Precision, literal

SETTLED: dict[Precision, float] = {"double": 1e-8, "single": 1e-4}
"""Relative change of a step after which the error, of the order of its square, is below rounding."""


def looped(code: Statements, steps: Sequence[int], *, real: str, precision: Precision, outputs: Sequence[str]) -> str:
    """Statements in C that compute a function with roots.

    They read and write an array `root`, and read `known`: where it is not zero, `root` holds guesses, and a search that
    does not settle from there begins again where it begins otherwise.

    Args:
        found: of a `traced.Looped` function.
        steps: of each root, at most.
        real, precision, outputs: as for `c_expression.body`.
    """
    count, n = len(steps), len(outputs)
    lines: list[str] = []
    for search in searches(code, count, first=n):
        lines += [f"  {_named(s).text(real, precision)}" for s in search.before]
        if search.sought:
            lines += _loop(search, steps, real, precision)
    stores = [f"  {outputs[o]}[{p}] = {_renamed(t)};" for (o, p), t in code.outputs.items() if o < n]
    head = [f"  {real} {', '.join(f'root{i} = root[{i}]' for i in range(count))};", "  int step;"]
    kept = [f"  root[{i}] = root{i};" for i in range(count)]
    return "\n".join([*head, *lines, *kept, *stores]) + "\n"


@dataclass(frozen=True)
class Search:
    """Roots that are sought in one loop, after those that they depend on.

    Attributes:
        before: statements that can be evaluated once the earlier searches have ended, in order.
        sought: numbers of the roots; none for what comes after the last search.
        inside: statements of the loop.
        start, value, slope: texts of each root sought: the first guess, the residual and its derivative.
    """

    before: tuple[Statement, ...]
    sought: tuple[int, ...]
    inside: tuple[Statement, ...]
    start: tuple[str, ...]
    value: tuple[str, ...]
    slope: tuple[str, ...]


def searches(code: Statements, count: int, *, first: int) -> list[Search]:
    """A function with `count` roots in the order of its searches; outputs `first` and the next two are the roots'."""
    start, value, slope = ([code.outputs[first + k, i] for i in range(count)] for k in range(3))
    needs = _needs(code.body, count)
    rounds = _rounds([*zip(start, value, slope, strict=True)], needs, count)

    def known_after(name: str) -> int:
        """How many rounds of loops come before a text can be evaluated."""
        roots, _ = needs.get(name, (frozenset(), frozenset()))
        return max((rounds[r] for r in roots), default=0)

    made = []
    for number in range(max(rounds, default=0) + 1):
        sought = tuple(i for i in range(count) if rounds[i] == number + 1)
        texts = (tuple(t[i] for i in sought) for t in (start, value, slope))
        before = tuple(s for s in code.body if not needs[s.name][1] and known_after(s.name) == number)
        made.append(Search(before, sought, tuple(s for s in code.body if needs[s.name][1] & set(sought)), *texts))
    return made


_Needs = dict[str, tuple[frozenset[int], frozenset[int]]]


def _needs(body: Sequence[Statement], count: int) -> _Needs:
    """Which roots and which guesses every statement depends on."""
    nothing: frozenset[int] = frozenset()
    known: _Needs = {f"root[{i}]": (frozenset({i}), nothing) for i in range(count)}
    known |= {f"guess[{i}]": (nothing, frozenset({i})) for i in range(count)}
    for s in body:
        of = [known.get(name, (nothing, nothing)) for name in s.reads]
        known[s.name] = (nothing.union(*(a for a, _ in of)), nothing.union(*(b for _, b in of)))
    return known


def _rounds(texts: Sequence[tuple[str, str, str]], needs: _Needs, count: int) -> list[int]:
    """The loop, from 1, in which each root is sought: after those that it depends on."""
    rounds: list[int] = []
    for i in range(count):
        before = frozenset().union(*(needs.get(text, (frozenset(), frozenset()))[0] for text in texts[i]))
        rounds.append(1 + max((rounds[r] for r in before), default=0))
    return rounds


def _renamed(text: str) -> str:
    for kind in ("root", "guess"):
        if text.startswith(f"{kind}["):
            return f"root{text[len(kind) + 1 : -1]}"
    return text


def _named(s: Statement) -> Statement:
    return Statement(s.name, s.operation, tuple(map(_renamed, s.reads)))


def _loop(search: Search, steps: Sequence[int], real: str, precision: Precision) -> list[str]:
    sought = search.sought
    size = "fabsf" if precision == "single" else "fabs"
    small = literal(SETTLED[precision], precision)
    settled = " && ".join(f"{size}(move{i}) <= {small} * {size}(root{i})" for i in sought)
    most = max(steps[i] for i in sought)
    begin = " ".join(f"root{i} = {_renamed(start)};" for i, start in zip(sought, search.start, strict=True))
    quotients = zip(sought, search.value, search.slope, strict=True)
    return [
        f"  for (step = known ? -{most} : 0; step < {most}; ++step) {{",
        f"    if (step == 0) {{ {begin} }}",
        *(f"    {_named(s).text(real, precision)}" for s in search.inside),
        *(f"    const {real} move{i} = {_renamed(value)} / {_renamed(slope)};" for i, value, slope in quotients),
        *(f"    root{i} -= move{i};" for i in sought),
        f"    if ({settled}) break;",
        "  }",
    ]
