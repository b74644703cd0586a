"""A traced function in C whose roots are found by Newton's method in loops that end when the guess no longer moves.

Unrolled, as every other back end has it, the search always takes as many steps as its worst case. Roots that do not
depend on each other are sought in one loop, so that a processor works on the one while the other waits for a quotient.

Statements in C for many vehicles at once: every number of a step is an array over a block of lanes.

One loop over the lanes holds a whole evaluation of the equations, selects instead of branches, and sines as polynomials
(`KERNELS`), so that a compiler fills its vectors. Roots are sought in loops around loops over
lanes; a lane whose root has settled stays as it is, so that a flight does not depend on its neighbours.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

from swashplate.engine.c_expression import Precision, Statement, Statements, literal


class _Kernel(NamedTuple):
    """Half pi in three parts, the first two with trailing zeros; polynomials in r^2, highest power first."""

    half_pi: tuple[float, float, float]
    sine: tuple[float, ...]
    cosine: tuple[float, ...]


KERNELS = {
    "double": _Kernel(
        (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21),
        (
            1.58969099521155010221e-10,
            -2.50507602534068634195e-08,
            2.75573137070700676789e-06,
            -1.98412698298579493134e-04,
            8.33333333332248946124e-03,
            -1.66666666666666324348e-01,
        ),
        (
            -1.13596475577881948265e-11,
            2.08757232129817482790e-09,
            -2.75573143513906633035e-07,
            2.48015872894767294178e-05,
            -1.38888888888741095749e-03,
            4.16666666666666019037e-02,
        ),
    ),
    "single": _Kernel(
        (1.5703125, 4.837512969970703125e-4, 7.54978995489188216e-8),
        (-1.9515295891e-4, 8.3321608736e-3, -1.6666654611e-1),
        (2.443315711809948e-5, -1.388731625493765e-3, 4.166664568298827e-2),
    ),
}
"""Sine and cosine as polynomials: those of fdlibm (Sun Microsystems 1993) in double precision and of Cephes (Moshier
1989) in single, after reduction to +-pi/4 in three parts (Cody and Waite 1980); within 2e-16 (1e-7) to 1,000 rad."""
LANES: dict[Precision, int] = {"double": 16, "single": 32}
"""In a block: some vectors of any processor, and all arrays of a step stay in the first cache."""
WHOLE: dict[Precision, tuple[str, int, float]] = {
    "double": ("long long", 64, 1.5 * 2.0**52),
    "single": ("int", 32, 1.5 * 2.0**23),
}
"""The integer as wide as a number, its bits, and what rounds a number to a whole one when it is added."""
REDUCED: dict[Precision, int] = {"double": 2, "single": 3}
"""Parts of half pi that count: the third moves a float64 angle of 1,000 rad by 1e-18."""
_TURNING = {"SIN": "sine", "COS": "cosine", "TAN": "tangent"}


def horner(coefficients: Sequence[float], precision: Precision) -> str:
    text = literal(coefficients[0], precision)
    for coefficient in coefficients[1:]:
        text = f"({text} * z + {literal(coefficient, precision)})"
    return text


def _of_lane(text: str) -> str:
    """An entry of an array is one of a lane; a guess is the lane's own."""
    text = re.sub(r"\bguess\[(\d+)\]", r"guess\1", text)
    return re.sub(r"\b(x|w|p|cp|c|root)\[(\d+)\]", r"\1[\2][l]", text)


def _line(s: Statement, precision: Precision) -> str:
    if s.operation in _TURNING:
        return f"const real {s.name} = {_TURNING[s.operation]}({_of_lane(s.reads[0])});"
    return Statement(s.name, s.operation, tuple(map(_of_lane, s.reads))).text("real", precision)


def plain(code: Statements, out: str, precision: Precision) -> str:
    """One loop over the lanes."""
    lines = [_line(s, precision) for s in code.body]
    return _lane_loop(
        [*lines, *(f"{out}[{place}][l] = {_of_lane(text)};" for (_, place), text in code.outputs.items())]
    )


def _lane_loop(lines: Iterable[str], *, pragma: str = "", indent: str = "  ") -> str:
    body = "".join(f"{indent}  {line}\n" for line in lines)
    return f'{indent}_Pragma("omp simd{pragma}") for (int l = 0; l < LANES; ++l) {{\n{body}{indent}}}\n' if body else ""


def moving(code: Statements, steps: Sequence[int], precision: Precision) -> str:
    """The rates: loops over lanes between searches, with arrays for what one makes and another reads."""
    order = searches(code, len(steps), first=1)
    rates = {place: text for (output, place), text in code.outputs.items() if output == 0}
    home: dict[str, tuple[int, bool]] = {}
    for number, search in enumerate(order):
        home |= {s.name: (number, False) for s in search.before}
        home |= {s.name: (number, True) for s in search.inside}
    parts = [(number, inner) for number in range(len(order)) for inner in (False, True)]
    read = {
        (number, inner): [*_reads(search.inside), *search.start, *search.value, *search.slope]
        if inner
        else [*_reads(search.before), *(rates.values() if search is order[-1] else ())]
        for number, search in enumerate(order)
        for inner in (False, True)
    }
    crossing = {name for part in parts for name in read[part] if home.get(name, part) != part}

    def taken(names: Iterable[str], part: tuple[int, bool]) -> list[str]:
        """What a loop reads of earlier ones."""
        asked = dict.fromkeys(name for name in names if home.get(name, part) != part)
        return [f"const real {name} = kept_{name}[l];" for name in asked]

    lines = [f"  lanes kept_{name};\n" for name in sorted(crossing)]
    for number, search in enumerate(order):
        plain, inner = (number, False), (number, True)
        told = [f"kept_{s.name}[l] = {s.name};" for s in search.before if s.name in crossing]
        if search is order[-1]:
            told += [f"rates[{place}][l] = {_of_lane(text)};" for place, text in rates.items()]
        lines.append(_lane_loop([*taken(read[plain], plain), *(_line(s, precision) for s in search.before), *told]))
        if search.sought:
            begin, inside = taken(search.start, inner), [*_reads(search.inside), *search.value, *search.slope]
            lines.append(_searched(search, steps, begin, taken(inside, inner), precision))
    return "".join(lines)


def _reads(made: Iterable[Statement]) -> Iterable[str]:
    return chain.from_iterable(s.reads for s in made)


def _searched(search: Search, steps: Sequence[int], begin: list[str], taken: list[str], precision: Precision) -> str:
    """Newton's method on every lane until all have settled, from the guesses in `root` where `known` is not 0."""
    most, size = max(steps[i] for i in search.sought), "fabsf" if precision == "single" else "fabs"
    small = literal(SETTLED[precision], precision)
    lines = [*taken, *(f"const real guess{i} = root[{i}][l];" for i in search.sought)]
    lines += [_line(s, precision) for s in search.inside]
    calm, lost = [], []
    for i, start, value, slope in zip(search.sought, search.start, search.value, search.slope, strict=True):
        begin.append(f"root[{i}][l] = settled[l] ? root[{i}][l] : {_of_lane(start)};")
        lines.append(f"const real move{i} = {_of_lane(value)} / {_of_lane(slope)}, next{i} = guess{i} - move{i};")
        lines.append(f"root[{i}][l] = settled[l] ? guess{i} : next{i};")
        calm.append(f"({size}(move{i}) <= {small} * {size}(next{i}))")
        lost.append(f"(move{i} != move{i})")
    lines.append(f"settled[l] |= ({' & '.join(calm)}) | ((step >= 0) & ({' | '.join(lost)}));")
    lines.append("left |= 1 - settled[l];")
    return f"""  {{
    whole settled[LANES] = {{0}}, left;
    for (int step = known ? -{most} : 0; step < {most}; ++step) {{
      left = 0;
      if (step == 0) {{
{_lane_loop(begin, indent="        ")}      }}
{_lane_loop(lines, pragma=" reduction(|:left)", indent="      ")}      if (!left) break;
    }}
  }}
"""


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
        lines += [f"  {named(s).text(real, precision)}" for s in search.before]
        if search.sought:
            lines += _loop(search, steps, real, precision)
    stores = [f"  {outputs[o]}[{p}] = {renamed(t)};" for (o, p), t in code.outputs.items() if o < n]
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


def renamed(text: str) -> str:
    """A root or its guess is a number of its own."""
    return re.sub(r"^(root|guess)\[(\d+)\]$", r"root\2", text)


def named(s: Statement) -> Statement:
    """A statement that reads roots and guesses so."""
    return Statement(s.name, s.operation, tuple(map(renamed, s.reads)))


def _loop(search: Search, steps: Sequence[int], real: str, precision: Precision) -> list[str]:
    sought = search.sought
    size = "fabsf" if precision == "single" else "fabs"
    small = literal(SETTLED[precision], precision)
    settled = " && ".join(f"{size}(move{i}) <= {small} * {size}(root{i})" for i in sought)
    most = max(steps[i] for i in sought)
    begin = " ".join(f"root{i} = {renamed(start)};" for i, start in zip(sought, search.start, strict=True))
    quotients = zip(sought, search.value, search.slope, strict=True)
    return [
        f"  for (step = known ? -{most} : 0; step < {most}; ++step) {{",
        f"    if (step == 0) {{ {begin} }}",
        *(f"    {named(s).text(real, precision)}" for s in search.inside),
        *(f"    const {real} move{i} = {renamed(value)} / {renamed(slope)};" for i, value, slope in quotients),
        *(f"    root{i} -= move{i};" for i in sought),
        f"    if ({settled}) break;",
        "  }",
    ]
