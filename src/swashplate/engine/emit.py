"""C99, written from statements and templates: here alone.

A template (`templates/*.c`, `*.h`) is a file with blanks. What fills them is printed from a traced function's
statements in one of three forms, each with loops for its roots: Newton's method until the guess no longer moves, where
every other back end takes as many steps as its worst case.

* Scalars (`print_statements`, `print_searches`): one constant for each operation, stores at the end. CasADi's own
  printer wraps them in pointer tests and unused arguments that a strict compiler refuses. Roots that do not depend on
  each other are sought in one loop, so that a processor works on the one while the other waits for a quotient.
* Lanes (`print_lanes`, `print_lane_searches`): every number is an array over vehicles side by side, with selects
  instead of branches and sines as polynomials, so that a compiler fills its vectors. A lane whose root has settled
  stays as it is, so that a flight does not depend on its neighbours.
* Tangents (`Tangents`): forward differentiation, a vector of directions at a time (Griewank and Walther 2008, ch. 3).
  Roots are found as numbers; how they move follows from the residual there (implicit function theorem). Where two
  numbers are equal, the slope of the larger or smaller one is the mean of both.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from itertools import chain

from swashplate.engine.graph import Graph
from swashplate.engine.statements import (
    BINARY,
    COMPARED,
    FORMS,
    LIBRARY,
    Precision,
    Search,
    Statement,
    Statements,
    literal,
    searches,
    statements,
)
from swashplate.errors import ExportError

REAL: dict[Precision, str] = {"double": "double", "single": "float"}

_KEYWORDS = frozenset({
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else",
    "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long", "register",
    "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch", "typedef", "union",
    "unsigned", "void", "volatile", "while",
})  # fmt: skip


def comment_text(text: str) -> str:
    """Text for a comment or a string of C: printable ASCII that starts and ends nothing.

    Quotes, backslashes, trigraphs and the marks of comments are what could, and are replaced.
    """
    printable = "".join(c if " " <= c <= "~" else " " if c.isspace() else "?" for c in text)
    printable = printable.replace("\\", "|").replace('"', "'")
    for mark in ("*/", "/*", "??", "//"):
        while mark in printable:
            printable = printable.replace(mark, " ".join(mark))
    return " ".join(printable.split())


def identifier(text: str) -> str:
    """A C identifier from a model's name: what is not a letter or a digit becomes `_`.

    Raises:
        ExportError: where nothing is left of it.
    """
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_")
    if not name:
        raise ExportError(f"'{text}' gives no name that C could use.", channel="--name", hint="Give --name heli.")
    return f"model_{name}" if name[0].isdigit() or name in _KEYWORDS else name


def print_array(name: str, values: Iterable[float], precision: Precision, *, kind: str) -> str:
    """The definition of a constant array; an empty one gets one zero, since C has no empty arrays."""
    numbers = [literal(value, precision) for value in values] or ["0"]
    lines = [", ".join(numbers[i : i + 6]) for i in range(0, len(numbers), 6)]
    return f"const {kind} {name}[{len(numbers)}] = {{\n  " + ",\n  ".join(lines) + "\n};\n"


@lru_cache(maxsize=16)
def _template(name: str) -> str:
    return resources.files("swashplate.engine").joinpath("templates", name).read_text(encoding="utf-8")


def fill_template(name: str, blanks: Mapping[str, object]) -> str:
    """A template with its blanks filled.

    Args:
        name: of the file.
        blanks: what stands for @WORD@, by word; @NAME.c@ and @NAME.h@ are templates themselves, with the same blanks.
    """

    def part(blank: re.Match[str]) -> str:
        inner = blank[1].endswith((".c", ".h"))
        return fill_template(blank[1], blanks).rstrip("\n") if inner else str(blanks[blank[1]])

    return re.sub(r"@([\w.]+)@", part, _template(name))


def _line(s: Statement, real: str, precision: Precision) -> str:
    of = s.reads
    if s.operation in BINARY:
        text = f"{of[0]} {BINARY[s.operation]} {of[1]}"
    elif s.operation in COMPARED:
        text = f"{of[0]} {COMPARED[s.operation]} {of[1]} ? 1 : 0"
    elif s.operation in LIBRARY:
        text = f"{LIBRARY[s.operation]}{'f' if precision == 'single' else ''}({', '.join(of)})"
    else:
        text = FORMS[s.operation].format(*of)
    return f"const {real} {s.name} = {text};"


def print_graph(
    function: Graph, *, real: str, precision: Precision, inputs: Sequence[str], outputs: Sequence[str]
) -> str:
    """Statements in C that compute a CasADi function.

    Args:
        function: traced on SX; sparse outputs store their nonzeros only.
        real: the type's name.
        precision: of constants and of the C library's functions.
        inputs: names of the arrays it reads, in order.
        outputs: names of the arrays it writes. They may be those it reads: all stores come last.

    Raises:
        ExportError: as `statements`.
    """
    return print_statements(statements(function, precision=precision, inputs=inputs), real, precision, outputs)


def print_statements(code: Statements, real: str, precision: Precision, outputs: Sequence[str]) -> str:
    """Statements in C, then stores of the outputs into arrays of these names."""
    lines = [f"  {_line(s, real, precision)}" for s in code.body]
    stores = [f"  {outputs[o]}[{place}] = {text};" for (o, place), text in code.outputs.items()]
    return "\n".join([*lines, *stores]) + "\n"


SETTLED: dict[Precision, float] = {"double": 1e-8, "single": 1e-4}
"""Relative change of a step after which the error, of the order of its square, is below rounding."""


def print_searches(
    code: Statements, steps: Sequence[int], *, real: str, precision: Precision, outputs: Sequence[str]
) -> str:
    """Statements in C that compute a function with roots.

    They read and write an array `root`, and read `known`: where it is not zero, `root` holds guesses, and a search that
    does not settle from there begins again where it begins otherwise.

    Args:
        code: of a function with roots (`roots.Looped`).
        steps: of each root, at most.
        real, precision, outputs: as for `print_graph`.
    """
    count, n = len(steps), len(outputs)
    lines: list[str] = []
    for search in searches(code, count, first=n):
        lines += [f"  {_line(_by_root_name(s), real, precision)}" for s in search.before]
        if search.sought:
            lines += _loop(search, steps, real, precision)
    stores = [f"  {outputs[o]}[{p}] = {_root_name(t)};" for (o, p), t in code.outputs.items() if o < n]
    head = [f"  {real} {', '.join(f'root{i} = root[{i}]' for i in range(count))};", "  int step;"]
    kept = [f"  root[{i}] = root{i};" for i in range(count)]
    return "\n".join([*head, *lines, *kept, *stores]) + "\n"


def _root_name(text: str) -> str:
    """A root or its guess is a number of its own."""
    return re.sub(r"^(root|guess)\[(\d+)\]$", r"root\2", text)


def _by_root_name(s: Statement) -> Statement:
    """A statement that reads roots and guesses so."""
    return replace(s, reads=tuple(map(_root_name, s.reads)))


def _loop(search: Search, steps: Sequence[int], real: str, precision: Precision) -> list[str]:
    sought = search.sought
    size = "fabsf" if precision == "single" else "fabs"
    small = literal(SETTLED[precision], precision)
    settled = " && ".join(f"{size}(move{i}) <= {small} * {size}(root{i})" for i in sought)
    most = max(steps[i] for i in sought)
    begin = " ".join(f"root{i} = {_root_name(start)};" for i, start in zip(sought, search.start, strict=True))
    quotients = zip(sought, search.value, search.slope, strict=True)
    return [
        f"  for (step = known ? -{most} : 0; step < {most}; ++step) {{",
        f"    if (step == 0) {{ {begin} }}",
        *(f"    {_line(_by_root_name(s), real, precision)}" for s in search.inside),
        *(f"    const {real} move{i} = {_root_name(value)} / {_root_name(slope)};" for i, value, slope in quotients),
        *(f"    root{i} -= move{i};" for i in sought),
        f"    if ({settled}) break;",
        "  }",
    ]


LANES: dict[Precision, int] = {"double": 16, "single": 32}
"""In a block: some vectors of any processor, and all arrays of a step stay in the first cache."""
INTEGER: dict[Precision, str] = {"double": "long long", "single": "int"}
"""As wide as a number."""
_TURNING = {"SIN": "sine", "COS": "cosine", "TAN": "tangent"}
"""Polynomials (`templates/turned_*.h`): those of fdlibm (Sun Microsystems 1993) in double precision and of Cephes
(Moshier 1989) in single, after reduction to +-pi/4 in three parts (Cody and Waite 1980), of which the third moves a
float64 angle of 1,000 rad by 1e-18 and is left out there; within 2e-16 (1e-7) to 1,000 rad."""


def _of_lane(text: str) -> str:
    """An entry of an array is one of a lane; a guess is the lane's own."""
    text = re.sub(r"\bguess\[(\d+)\]", r"guess\1", text)
    return re.sub(r"\b(x|w|p|cp|c|root)\[(\d+)\]", r"\1[\2][l]", text)


def _lane_line(s: Statement, precision: Precision) -> str:
    if s.operation in _TURNING:
        return f"const real {s.name} = {_TURNING[s.operation]}({_of_lane(s.reads[0])});"
    return _line(replace(s, reads=tuple(map(_of_lane, s.reads))), "real", precision)


def print_lanes(code: Statements, out: str, precision: Precision) -> str:
    """One loop over the lanes."""
    lines = [_lane_line(s, precision) for s in code.body]
    return _lane_loop(
        [*lines, *(f"{out}[{place}][l] = {_of_lane(text)};" for (_, place), text in code.outputs.items())]
    )


def _lane_loop(lines: Iterable[str], *, pragma: str = "", indent: str = "  ") -> str:
    body = "".join(f"{indent}  {line}\n" for line in lines)
    return f'{indent}_Pragma("omp simd{pragma}") for (int l = 0; l < LANES; ++l) {{\n{body}{indent}}}\n' if body else ""


def print_lane_searches(code: Statements, steps: Sequence[int], precision: Precision) -> str:
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
        outer, inner = (number, False), (number, True)
        stores = [f"kept_{s.name}[l] = {s.name};" for s in search.before if s.name in crossing]
        if search is order[-1]:
            stores += [f"rates[{place}][l] = {_of_lane(text)};" for place, text in rates.items()]
        lines.append(
            _lane_loop([*taken(read[outer], outer), *(_lane_line(s, precision) for s in search.before), *stores])
        )
        if search.sought:
            begin, inside = taken(search.start, inner), [*_reads(search.inside), *search.value, *search.slope]
            lines.append(_searched(search, steps, begin, taken(inside, inner), precision))
    return "".join(lines)


def _reads(block: Iterable[Statement]) -> Iterable[str]:
    return chain.from_iterable(s.reads for s in block)


def _searched(search: Search, steps: Sequence[int], begin: list[str], taken: list[str], precision: Precision) -> str:
    """Newton's method on every lane until all have settled, from the guesses in `root` where `known` is not 0."""
    most, size = max(steps[i] for i in search.sought), "fabsf" if precision == "single" else "fabs"
    small = literal(SETTLED[precision], precision)
    lines = [*taken, *(f"const real guess{i} = root[{i}][l];" for i in search.sought)]
    lines += [_lane_line(s, precision) for s in search.inside]
    calm, lost = [], []
    for i, start, value, slope in zip(search.sought, search.start, search.value, search.slope, strict=True):
        begin.append(f"root[{i}][l] = settled[l] ? root[{i}][l] : {_of_lane(start)};")
        lines.append(f"const real move{i} = {_of_lane(value)} / {_of_lane(slope)}, next{i} = guess{i} - move{i};")
        lines.append(f"root[{i}][l] = settled[l] ? guess{i} : next{i};")
        calm.append(f"({size}(move{i}) <= {small} * {size}(next{i}))")
        lost.append(f"(move{i} != move{i})")
    lines.append(f"settled[l] |= ({' & '.join(calm)}) | ((step >= 0) & ({' | '.join(lost)}));")
    lines.append("left |= 1 - settled[l];")
    blanks = {
        "MOST": most,
        "BEGIN": _lane_loop(begin, indent="        "),
        "MOVE": _lane_loop(lines, pragma=" reduction(|:left)", indent="      "),
    }
    return fill_template("lane_search.c", blanks)


class Tangents:
    """Prints statements with their tangents.

    Args:
        arrays: of the inputs that move, by name: that of their tangents and which entries move (None: all).
    """

    def __init__(self, arrays: Mapping[str, tuple[str, frozenset[int] | None]]) -> None:
        self._arrays = dict(arrays)
        self._made: dict[str, str] = {}

    def of(self, text: str) -> str | None:
        """The tangent of a text, None where it does not move."""
        if text in self._made:
            return self._made[text]
        entry = re.fullmatch(r"(\w+)\[(\d+)\]", text)
        if entry is None or entry[1] not in self._arrays:
            return None
        name, places = self._arrays[entry[1]]
        return f"{name}[{entry[2]}]" if places is None or int(entry[2]) in places else None

    def body(self, block: Sequence[Statement]) -> list[str]:
        """Statements with their tangents."""
        lines = []
        for s in block:
            lines.append(_line(s, "double", "double"))
            tangent = _tangent(s, [self.of(text) for text in s.reads])
            if tangent is not None:
                lines.append(f"const vec d_{s.name} = {tangent};")
                self._made[s.name] = f"d_{s.name}"
        return lines

    def stores(self, code: Statements, outputs: Mapping[int, str]) -> list[str]:
        """Outputs, by number, and their tangents into arrays of these names, and those with a `d` in front."""
        lines = []
        for (output, place), text in code.outputs.items():
            if output in outputs:
                lines.append(f"{outputs[output]}[{place}] = {text};")
                lines.append(f"d{outputs[output]}[{place}] = {self.of(text) or '(vec){0}'};")
        return lines

    def rooted(self, code: Statements, count: int) -> tuple[list[str], Statements]:
        """A function with `count` roots that are known (an array `root`), and the function that reads them by name."""
        lines = [f"const double root{i} = root[{i}];" for i in range(count)]
        for search in searches(code, count, first=1):
            lines += self.body([_by_root_name(s) for s in search.before])
            lines += self.body([_by_root_name(s) for s in search.inside])
            for i, value, slope in zip(search.sought, search.value, search.slope, strict=True):
                tangent = self.of(_root_name(value))
                if tangent is not None:
                    lines.append(f"const vec d_root{i} = {tangent} * (-1 / {_root_name(slope)});")
                    self._made[f"root{i}"] = f"d_root{i}"
        return lines, Statements((), {place: _root_name(text) for place, text in code.outputs.items()})


def _tangent(s: Statement, tangents: Sequence[str | None]) -> str | None:
    """The tangent of a statement from those of what it reads."""
    first, second, factor = _SLOPES.get(s.operation, ("", "", ""))
    texts = {"t": s.name, "a": s.reads[0], "b": s.reads[-1]}
    parts = [form.format(d=d, **texts) for form, d in ((first, tangents[0]), (second, tangents[-1])) if form and d]
    total = " + ".join(parts)
    return f"({total}) * ({factor.format(**texts)})" if total and factor else total or None


_KINK = "kept({d} * ({a} == {b} ? 0.5 : 1.0), {a} %s {b})"
_SLOPES = {
    "ADD": ("{d}", "{d}", ""),
    "SUB": ("{d}", "(-{d})", ""),
    "MUL": ("{d} * {b}", "{d} * {a}", ""),
    "DIV": ("{d}", "({d} * (-{t}))", "1 / {b}"),
    "ATAN2": ("{d} * {b}", "{d} * (-{a})", "1 / ({a} * {a} + {b} * {b})"),
    "FMIN": (_KINK % "<=", _KINK % ">=", ""),
    "FMAX": (_KINK % ">=", _KINK % "<=", ""),
    "IF_ELSE_ZERO": ("", "kept({d}, {a} != 0)", ""),
    "SQ": ("{d}", "", "2 * {a}"),
    "TWICE": ("{d}", "", "2.0"),
    "NEG": ("{d}", "", "-1.0"),
    "INV": ("{d}", "", "-{t} * {t}"),
    "SQRT": ("{d}", "", "0.5 / {t}"),
    "SIN": ("{d}", "", "cos({a})"),
    "COS": ("{d}", "", "-sin({a})"),
    "TAN": ("{d}", "", "1 + {t} * {t}"),
    "FABS": ("{d}", "", "{a} > 0 ? 1.0 : {a} < 0 ? -1.0 : 0.0"),
    "ASSIGN": ("{d}", "", ""),
}
"""Of d, the tangent of the first and of the second number read, summed, and by what the sum is multiplied; comparisons
and signs have no slope."""
