"""A vehicle's flight in C for many of its kind at once: every number of a step is an array over a block of lanes.

One loop over the lanes holds a whole evaluation of the equations, selects instead of branches, and sines as polynomials
(those of `simulation.trigonometry`), so that a compiler fills its vectors. Roots are sought in loops around loops over
lanes; a lane whose root has settled stays as it is, so that a flight does not depend on its neighbours.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import chain

from swashplate.engine.c_expression import Statement, Statements, statements
from swashplate.engine.c_loops import SETTLED, Search, searches
from swashplate.engine.c_split import ROOTS, split
from swashplate.engine.c_text import REAL, Precision, literal
from swashplate.engine.equations import Equations
from swashplate.engine.trace import traced_rates
from swashplate.simulation.trigonometry import KERNELS

LANES: dict[Precision, int] = {"double": 16, "single": 32}
"""In a block: some vectors of any processor, and all arrays of a step stay in the first cache."""
_WHOLE: dict[Precision, tuple[str, int, float]] = {
    "double": ("long long", 64, 1.5 * 2.0**52),
    "single": ("int", 32, 1.5 * 2.0**23),
}
"""The integer as wide as a number, its bits, and what rounds a number to a whole one when it is added."""
_REDUCED: dict[Precision, int] = {"double": 2, "single": 3}
"""Parts of half pi that count: the third moves a float64 angle of 1,000 rad by 1e-18."""
_TURNING = {"SIN": "sine", "COS": "cosine", "TAN": "tangent"}


def lane_code(equations: Equations, precision: Precision) -> str:
    """C of `fly_lanes`, which flies vehicles `first` to `last` of `total`; rows as in `simulation.batch.trajectories`.

    Args:
        equations: of which vehicle.
        precision: of all numbers.

    Raises:
        ExportError: for equations that CasADi cannot trace or that are not printed as C; without CasADi.
    """
    traced = traced_rates(equations)
    function, steps = traced.function, traced.steps
    code = statements(function, precision=precision, inputs=["x", "w", "p", *(name[:-1] for name in ROOTS)])
    of_card, rest = split(code, moving=("x[", "w[", *ROOTS), fixed="cp")
    of_inputs, rest = split(rest)
    whole, bits, rounding = _WHOLE[precision]
    kernel = KERNELS["float64" if precision == "double" else "float32"]
    blanks = {
        "REAL": REAL[precision],
        "WHOLE": whole,
        "BITS": str(bits),
        "ROUNDING": literal(rounding, precision),
        "PER_TURN": literal(0.63661977236758134308, precision),
        "REDUCED": " ".join(f"- turns * {literal(h, precision)}" for h in kernel.half_pi[: _REDUCED[precision]]),
        "SINE": _horner(kernel.sine, precision),
        "COSINE": _horner(kernel.cosine, precision),
        "LANES": str(LANES[precision]),
        **{f"N_{name}": str(function.size1_in(i)) for i, name in enumerate(("STATES", "DRIVING", "NUMBERS"))},
        "N_ROOTS": str(max(1, len(steps))),
        "N_CP": str(max(1, len(of_card.outputs))),
        "N_C": str(max(1, len(of_inputs.outputs))),
        "OF_CARD": _plain(of_card, "cp", precision),
        "OF_INPUTS": _plain(of_inputs, "c", precision),
        "MOVING": _moving(rest, steps, precision),
    }
    return re.sub(r"@(\w+)@", lambda blank: blanks[blank[1]], _SOURCE)


def _horner(coefficients: Sequence[float], precision: Precision) -> str:
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


def _plain(code: Statements, out: str, precision: Precision) -> str:
    """One loop over the lanes."""
    lines = [_line(s, precision) for s in code.body]
    return _loop([*lines, *(f"{out}[{place}][l] = {_of_lane(text)};" for (_, place), text in code.outputs.items())])


def _loop(lines: Iterable[str], *, pragma: str = "", indent: str = "  ") -> str:
    body = "".join(f"{indent}  {line}\n" for line in lines)
    return f'{indent}_Pragma("omp simd{pragma}") for (int l = 0; l < LANES; ++l) {{\n{body}{indent}}}\n' if body else ""


def _moving(code: Statements, steps: Sequence[int], precision: Precision) -> str:
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
        lines.append(_loop([*taken(read[plain], plain), *(_line(s, precision) for s in search.before), *told]))
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
{_loop(begin, indent="        ")}      }}
{_loop(lines, pragma=" reduction(|:left)", indent="      ")}      if (!left) break;
    }}
  }}
"""


_SOURCE = """#include <math.h>

typedef @REAL@ real;
typedef @WHOLE@ whole;
#define LANES @LANES@
typedef real lanes[LANES] __attribute__((aligned(64)));

/* sin(x + quarter pi / 2): the nearest multiple of pi / 2 is taken away, its last two bits choose what is left. */
static inline __attribute__((unused)) real turned(real x, int quarter) {
  const real moved = x * @PER_TURN@ + @ROUNDING@, turns = moved - @ROUNDING@;
  const real r = x @REDUCED@, z = r * r;
  const real sine = r + r * z * @SINE@, cosine = 1 - z / 2 + z * z * @COSINE@;
  union { real number; whole bits; } of = {moved}, to;
  const whole odd = (whole)((unsigned @WHOLE@)of.bits << (@BITS@ - 1));
  const whole two = (whole)((unsigned @WHOLE@)of.bits << (@BITS@ - 2));
  const whole top = (whole)((unsigned @WHOLE@)1 << (@BITS@ - 1));
  to.number = (odd < 0) != (quarter != 0) ? cosine : sine;
  to.bits ^= (quarter ? two ^ odd : two) & top;
  return to.number;
}
#define sine(x) turned(x, 0)
#define cosine(x) turned(x, 1)
#define tangent(x) (turned(x, 0) / turned(x, 1))

static void of_card(lanes *restrict p, lanes *restrict cp) {
  (void)p, (void)cp;
@OF_CARD@}

static void of_inputs(lanes *restrict w, lanes *restrict p, lanes *restrict cp, lanes *restrict c) {
  (void)w, (void)p, (void)cp, (void)c;
@OF_INPUTS@}

static void moving(lanes *restrict x, lanes *restrict w, lanes *restrict p, lanes *restrict cp, lanes *restrict c,
                   lanes *restrict root, int known, lanes *restrict rates) {
  (void)x, (void)w, (void)p, (void)cp, (void)c, (void)root, (void)known;
@MOVING@}

/* Columns of a table with so many, or with one for all; the last lanes repeat the last column. */
static void gathered(lanes *restrict to, const real *restrict table, int rows, long width, long first, long last) {
  for (int i = 0; i < rows; ++i) {
    const real *row = table + i * width;
    if (width == 1) {
      for (int l = 0; l < LANES; ++l) to[i][l] = row[0];
    } else if (first + LANES <= last) {
      for (int l = 0; l < LANES; ++l) to[i][l] = row[first + l];
    } else {
      for (int l = 0; l < LANES; ++l) to[i][l] = row[first + l < last ? first + l : last - 1];
    }
  }
}

#define STAGE(at, j, known) moving(at, w[j], p, cp, c[j], root, known, k)
#define EACH for (int i = 0; i < @N_STATES@; ++i) for (int l = 0; l < LANES; ++l)

static void stepped(lanes *restrict x, lanes (*w)[@N_DRIVING@], lanes (*c)[@N_C@], lanes *p, lanes *cp, int held,
                    real dt) {
  lanes at[@N_STATES@], sum[@N_STATES@], k[@N_STATES@], root[@N_ROOTS@];
  const int middle = held ? 0 : 1, end = held ? 0 : 2;
  const real half = dt / 2, sixth = dt / 6;
  STAGE(x, 0, 0);
  EACH sum[i][l] = k[i][l], at[i][l] = x[i][l] + half * k[i][l];
  STAGE(at, middle, 1);
  EACH sum[i][l] += 2 * k[i][l], at[i][l] = x[i][l] + half * k[i][l];
  STAGE(at, middle, 1);
  EACH sum[i][l] += 2 * k[i][l], at[i][l] = x[i][l] + dt * k[i][l];
  STAGE(at, end, 1);
  EACH x[i][l] += sixth * (sum[i][l] + k[i][l]);
}

void fly_lanes(const real *start, const real *rows, const real *numbers, real dt, long steps, long keep, int held,
               long driven, long cards, long first, long last, long total, real *out);

/* driven, cards: columns of rows and of numbers, 1 or total. out: a table of states every keep steps. */
void fly_lanes(const real *start, const real *rows, const real *numbers, real dt, long steps, long keep, int held,
               long driven, long cards, long first, long last, long total, real *out) {
  for (; first < last; first += LANES) {
    lanes x[@N_STATES@], w[3][@N_DRIVING@], p[@N_NUMBERS@], cp[@N_CP@], c[3][@N_C@];
    gathered(x, start, @N_STATES@, total, first, last);
    gathered(p, numbers, @N_NUMBERS@, cards, first, last);
    of_card(p, cp);
    for (long step = 0; step < steps; ++step) {
      const real *row = rows + step * @N_DRIVING@ * driven;
      gathered(w[0], row, @N_DRIVING@, driven, first, last);
      of_inputs(w[0], p, cp, c[0]);
      if (!held) {
        gathered(w[2], row + @N_DRIVING@ * driven, @N_DRIVING@, driven, first, last);
        for (int i = 0; i < @N_DRIVING@; ++i)
          for (int l = 0; l < LANES; ++l) w[1][i][l] = (w[0][i][l] + w[2][i][l]) / 2;
        of_inputs(w[1], p, cp, c[1]);
        of_inputs(w[2], p, cp, c[2]);
      }
      stepped(x, w, c, p, cp, held, dt);
      if ((step + 1) % keep == 0) {
        real *to = out + ((step + 1) / keep - 1) * @N_STATES@ * total;
        for (int i = 0; i < @N_STATES@; ++i)
          for (int l = 0; l < LANES && first + l < last; ++l) to[i * total + first + l] = x[i][l];
      }
    }
  }
}
"""
