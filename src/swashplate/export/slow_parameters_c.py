"""A filter of slow parameters as C99: the very filter that Python runs, without allocation.

Needs the extra `model`. CasADi traces how the mean moves, the slopes of it and what sensors show. What becomes of the
covariance is written in loops here: over the slopes that are not zero, one half of what is symmetric, reading after
reading (the same numbers, since the readings' noises do not depend on each other: Bar-Shalom, Li and Kirubarajan 2001,
sec. 7.4). `SlowCode` says what a step costs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.engine.c_text import identifier, words
from swashplate.engine.law import print_function
from swashplate.export.controller_c import operations_of
from swashplate.export.regression_c import CYCLES
from swashplate.extras import library
from swashplate.filtering import observer
from swashplate.filtering.matrix_operations import Matrices
from swashplate.filtering.observer import Numbers, ObserverEstimate
from swashplate.identification.recursive.fourier_regression import EARLY, LATE
from swashplate.identification.recursive.slow_parameters import SlowPlan

_TERMS = 4
"""Of the series for the exponential of the slopes, as in `held_series`."""


@dataclass(frozen=True)
class SlowCode:
    """C of a filter of slow parameters, and what it costs.

    Attributes:
        name: what its functions begin with.
        source: the text of the .c file.
        memory_bytes: kept between steps. work_bytes: of temporaries.
        operations: arithmetic operations and calls of one step, its most.
    """

    name: str
    source: str
    memory_bytes: int
    work_bytes: int
    operations: int

    def load(self, *, rate: float, megahertz: float) -> float:
        """Share of a processor's time at `CYCLES` an operation; rate [Hz], clock [MHz]."""
        return CYCLES * rate * self.operations / (1e6 * megahertz)


def slow_parameters_code(plan: SlowPlan, *, name: str = "slow") -> SlowCode:
    """The C of a filter of slow parameters, in double precision.

    Args:
        plan: what it works with.
        name: what its functions and constants begin with.

    Raises:
        MissingLibraryError: where CasADi is not installed.
    """
    library("casadi", what="C code")
    own, called = plan.observer, identifier(name)
    function, slopes, seen = _traced(plan)
    printed, _ = print_function(function, "double")
    N, m, depth = len(own.names), own.inputs + 1, 1 + max(own.delays)
    sizes = {"ESTIMATED": N, "INPUTS": m, "CHANNELS": len(own.channels), "SENSORS": len(own.sensors), "DEPTH": depth}
    sizes |= {"MOVES": own.moves, "SLOPES": len(slopes), "SEEN": len(seen), "TERMS": _TERMS}
    sizes |= {"WORK": max(int(function.sz_w()), 1), "WHOLE": max(int(function.sz_iw()), 1)}
    sizes |= {"ARGUMENTS": max(int(function.sz_arg()), 4), "RESULTS": max(int(function.sz_res()), 4)}
    defines = "\n".join(f"#define {key} {value}" for key, value in sizes.items())
    powers = _powers(slopes, own.moves)
    tables = _tables(plan) + _covariance_tables(plan.numbers, own.dt, slopes, seen, powers)
    kept = 2 * own.moves * N + len(slopes) + len(seen) + 2 * len(own.channels) + 3 * N + len(own.sensors) + m
    return SlowCode(
        name=called,
        source=_heading(plan, called) + printed + "\n" + defines + "\n" + tables + _BODY.replace("NAME", called),
        memory_bytes=8 * (N + N * N + depth * m) + 8,
        work_bytes=8 * (kept + sizes["WORK"]) + 4 * (sizes["WHOLE"] + sizes["WHOLE"] % 2),
        operations=operations_of(function) + _loops(N, slopes, seen, powers),
    )


class _Apart(Matrices):
    """The observer's operations, with its covariance left to the loops: only its slopes are traced."""

    slopes: Any
    seen: Any
    innovations: Any

    def propagated(self, A: Any, J: Any, P: Any, process: Any, dt: float, /) -> Any:
        self.slopes = A
        return P

    def updated(self, H: Any, mean: Any, covariance: Any, innovations: Any, measurement: Any, /) -> Any:
        self.seen, self.innovations = H, innovations
        return mean, covariance, covariance


Entries = list[tuple[int, int]]
"""Row and column of everything that is not zero, column after column."""


def _traced(plan: SlowPlan) -> tuple[Any, Entries, Entries]:
    """(mean, driving, readings, due) -> (mean one sample later, slopes of its rates, innovations, slopes of what is
    seen), and where these slopes stand."""
    import casadi

    own, M = plan.observer, _Apart()
    N = len(own.names)
    names = {"mean": N, "driving": own.inputs + 1, "readings": len(own.channels), "due": len(own.sensors)}
    mean, driving, y, due = given = [casadi.MX.sym(name, size) for name, size in names.items()]
    flags = [due[i] for i in range(len(own.sensors))]
    begun = ObserverEstimate(mean, casadi.MX(N, N))
    before = observer.predicted(own, plan.numbers, begun, driving, flags, M)
    observer.corrected(own, plan.numbers, before, y, flags, driving, M)
    told = [before.mean, M.slopes, M.innovations, M.seen]
    function = casadi.Function(
        "swash_traced", given, [casadi.densify(told[0]), told[1], casadi.densify(told[2]), told[3]]
    )
    return function, _entries(M.slopes), _entries(M.seen)


def _entries(matrix: Any) -> Entries:
    return list(zip(*matrix.sparsity().get_triplet(), strict=True))


def _powers(slopes: Entries, moves: int) -> list[NDArray[np.bool_]]:
    """Where the series for the exponential is not zero, after each of its terms."""
    given = np.zeros((moves, moves), dtype=bool)
    given[tuple(np.array(slopes).T)] = True
    powers = [np.eye(moves, dtype=bool) | given]
    for _ in range(1, _TERMS):
        powers.append(np.eye(moves, dtype=bool) | (given.astype(int) @ powers[-1].astype(int) > 0))
    return powers


def _loops(N: int, slopes: Entries, seen: Entries, powers: list[NDArray[np.bool_]]) -> int:
    """Arithmetic operations of the loops in `_BODY`."""
    last = powers[-1].sum(axis=1)
    moves, channels = len(last), 1 + max(row for row, _ in seen)
    series = 2 * len(slopes) + sum(1 + 2 * int(p.sum(axis=1)[k]) for p in powers[:-1] for _, k in slopes)
    left = 2 * N * int(last.sum())
    right = sum(2 * int(last[j]) for i in range(moves) for j in range(i + 1))
    updates = len(seen) * (2 * N + 4) + channels * (2 + 3 * N + N * (N + 1))
    return series + left + right + N + updates + N


def _covariance_tables(
    numbers: Numbers, dt: float, slopes: Entries, seen: Entries, powers: list[NDArray[np.bool_]]
) -> str:
    def table(kind: str, name: str, values: Any) -> str:
        return f"static const {kind} {name}[] = {{{', '.join(map(str, values))}}};\n"

    runs: list[tuple[int, int]] = []
    first: list[int] = []
    for power in powers:
        for row in power:
            first.append(len(runs))
            edges = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(int), [0]])))
            runs += list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    order = sorted(range(len(seen)), key=lambda e: seen[e])
    channels = len(np.asarray(numbers.measurement))
    begins = [sum(seen[e][0] < channel for e in order) for channel in range(channels + 1)]
    return "".join(
        [
            f"#define SAMPLE {dt!r}\n",
            table("unsigned char", "slope_row", (row for row, _ in slopes)),
            table("unsigned char", "slope_column", (column for _, column in slopes)),
            "/* Of every row of the series, power after power: its runs of columns, from one and up to another. */\n",
            table("unsigned short", "row_first", [*first, len(runs)]),
            table("unsigned char", "run_from", (begin for begin, _ in runs)),
            table("unsigned char", "run_to", (end for _, end in runs)),
            table("unsigned char", "seen_first", begins),
            table("unsigned char", "seen_place", order),
            table("unsigned char", "seen_column", (seen[e][1] for e in order)),
            table("double", "process", (repr(float(v)) for v in np.ravel(np.asarray(numbers.process)))),
            table("double", "measurement", (repr(float(v)) for v in np.ravel(np.asarray(numbers.measurement)))),
        ]
    )


def _heading(plan: SlowPlan, name: str) -> str:
    own = plan.observer
    vehicle = own.equations.vehicle
    return f"""/* Slow parameters of {words(vehicle.card.called)}: {words(", ".join(plan.unknown))}.
 *
 * inputs     {", ".join(vehicle.input_names)}, battery voltage, as commanded from now on
 * readings   {", ".join(own.channels)}, every {own.dt:g} s
 *
 * Call {name}_begin once and {name}_step with every sample and the seconds since the one before. It returns 0 while
 * it is frozen (an input that is no number, a gap, a clock that jumped). The parameters are
 * {name}_memory.estimate[{plan.places.start}] and on, their covariance stands behind all {len(own.names)} estimates,
 * row after row. Not with -ffast-math; one caller at a time.
 */
"""


def _tables(plan: SlowPlan) -> str:
    own = plan.observer
    names = own.equations.vehicle.state_names

    def row(values: object) -> str:
        return ", ".join(repr(float(v)) for v in np.ravel(np.asarray(values)))

    state_of = [c.partition(".")[2] for c in own.channels]
    seen = [str(names.index(name) if name in names else -1) for name in state_of]
    sensor = [str(i) for i, s in enumerate(own.sensors) for _ in s.channels]
    return f"""#define SLOW {plan.places.start}
#define SLOWS {len(plan.unknown)}
#define SHORTEST {EARLY * own.dt!r}
#define LONGEST {LATE * own.dt!r}
static const double start[ESTIMATED] = {{{row(plan.start.mean)}}};
static const double spread[ESTIMATED] = {{{row(np.diag(plan.start.covariance))}}};
static const int late[INPUTS] = {{{", ".join([*map(str, own.delays), "0"])}}};
static const int seen[CHANNELS] = {{{", ".join(seen)}}};
static const int sensor_of[CHANNELS] = {{{", ".join(sensor)}}};
"""


_BODY = """
typedef struct {
  double estimate[ESTIMATED + ESTIMATED * ESTIMATED], given[DEPTH][INPUTS];
  int begun;
} NAME_memory_t;

typedef struct {
  double series[2][MOVES][ESTIMATED], slopes[SLOPES], seen[SEEN], news[CHANNELS], readings[CHANNELS];
  double after[ESTIMATED], moved[ESTIMATED], shown[ESTIMATED], due[SENSORS], driving[INPUTS], traced[WORK];
  int whole[WHOLE];
} NAME_work_t;

NAME_memory_t NAME_memory;
static NAME_work_t w;

int NAME_begin(void);
int NAME_step(double elapsed, const double inputs[INPUTS], const double readings[CHANNELS]);

static int number(double x) { return x - x == 0.0; }

/* States where the sensors say, as unknown as at the start; the slow parameters as they are known. */
static void begin_anew(const double readings[CHANNELS]) {
  double *x = NAME_memory.estimate, *P = x + ESTIMATED;
  int i, j;
  for (i = 0; i < ESTIMATED; ++i) {
    const int slow = i >= SLOW && i < SLOW + SLOWS;
    if (!slow) x[i] = start[i];
    for (j = 0; j < ESTIMATED; ++j) {
      if (!(slow && j >= SLOW && j < SLOW + SLOWS)) P[i * ESTIMATED + j] = i == j ? spread[i] : 0.0;
    }
  }
  for (i = 0; i < CHANNELS; ++i)
    if (seen[i] >= 0 && number(readings[i])) x[seen[i]] = readings[i];
}

int NAME_begin(void) {
  int i;
  for (i = 0; i < ESTIMATED * ESTIMATED; ++i) NAME_memory.estimate[ESTIMATED + i] = 0.0;
  for (i = 0; i < SLOWS; ++i) {
    NAME_memory.estimate[SLOW + i] = start[SLOW + i];
    NAME_memory.estimate[ESTIMATED + (SLOW + i) * (ESTIMATED + 1)] = spread[SLOW + i];
  }
  NAME_memory.begun = 0;
  return SLOWS;
}

/* The covariance one sample later, P -> F P F' + Q, F by the series of the slopes; its lower half. */
static void led(double *P) {
  double(*F)[ESTIMATED] = w.series[0], (*T)[ESTIMATED] = w.series[1], (*swap)[ESTIMATED];
  const unsigned short *first = row_first;
  int term, i, j, k, e, q;
  for (i = 0; i < MOVES; ++i)
    for (j = 0; j < MOVES; ++j) F[i][j] = i == j ? 1.0 : 0.0;
  for (e = 0; e < SLOPES; ++e) F[slope_row[e]][slope_column[e]] += SAMPLE / TERMS * w.slopes[e];
  for (term = TERMS - 1; term > 0; --term, first += MOVES) {
    for (i = 0; i < MOVES; ++i)
      for (j = 0; j < MOVES; ++j) T[i][j] = i == j ? 1.0 : 0.0;
    for (e = 0; e < SLOPES; ++e) {
      const double by = SAMPLE / term * w.slopes[e];
      i = slope_row[e];
      k = slope_column[e];
      for (q = first[k]; q < first[k + 1]; ++q)
        for (j = run_from[q]; j < run_to[q]; ++j) T[i][j] += by * F[k][j];
    }
    swap = F;
    F = T;
    T = swap;
  }
  for (i = 0; i < MOVES; ++i) {
    for (j = 0; j < ESTIMATED; ++j) T[i][j] = 0.0;
    for (q = first[i]; q < first[i + 1]; ++q)
      for (k = run_from[q]; k < run_to[q]; ++k)
        for (j = 0; j < ESTIMATED; ++j) T[i][j] += F[i][k] * P[k * ESTIMATED + j];
  }
  for (i = 0; i < MOVES; ++i) {
    for (j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (q = first[j]; q < first[j + 1]; ++q)
        for (k = run_from[q]; k < run_to[q]; ++k) sum += T[i][k] * F[j][k];
      P[i * ESTIMATED + j] = sum;
    }
  }
  for (i = MOVES; i < ESTIMATED; ++i)
    for (j = 0; j < MOVES; ++j) P[i * ESTIMATED + j] = T[j][i];
  for (i = 0; i < ESTIMATED; ++i) P[i * (ESTIMATED + 1)] += process[i];
}

/* What one reading after the other tells; the lower half of the covariance is used and changed. */
static void told(double *P) {
  int c, i, j, q;
  for (i = 0; i < ESTIMATED; ++i) w.moved[i] = 0.0;
  for (c = 0; c < CHANNELS; ++c) {
    double spread_of = measurement[c], news = w.news[c], by;
    for (i = 0; i < ESTIMATED; ++i) w.shown[i] = 0.0;
    for (q = seen_first[c]; q < seen_first[c + 1]; ++q) {
      j = seen_column[q];
      for (i = 0; i < ESTIMATED; ++i)
        w.shown[i] += w.seen[seen_place[q]] * P[i > j ? i * ESTIMATED + j : j * ESTIMATED + i];
    }
    for (q = seen_first[c]; q < seen_first[c + 1]; ++q) {
      spread_of += w.seen[seen_place[q]] * w.shown[seen_column[q]];
      news -= w.seen[seen_place[q]] * w.moved[seen_column[q]];
    }
    by = 1.0 / spread_of;
    news *= by;
    for (i = 0; i < ESTIMATED; ++i) {
      const double gain = by * w.shown[i];
      w.moved[i] += news * w.shown[i];
      for (j = 0; j <= i; ++j) P[i * ESTIMATED + j] -= gain * w.shown[j];
    }
  }
}

int NAME_step(double elapsed, const double inputs[INPUTS], const double readings[CHANNELS]) {
  double *x = NAME_memory.estimate, *P = x + ESTIMATED;
  const double *arg[ARGUMENTS];
  double *res[RESULTS];
  int i, j;
  for (i = 0; i < INPUTS; ++i) {
    if (!number(inputs[i])) {
      NAME_memory.begun = 0;
      return 0;
    }
  }
  if (!NAME_memory.begun || !(SHORTEST < elapsed && elapsed < LONGEST)) {
    begin_anew(readings);
    for (i = 0; i < DEPTH; ++i)
      for (j = 0; j < INPUTS; ++j) NAME_memory.given[i][j] = inputs[j];
    NAME_memory.begun = 1;
    return 0;
  }
  for (i = 0; i < SENSORS; ++i) w.due[i] = 1.0;
  for (i = 0; i < CHANNELS; ++i) {
    w.readings[i] = readings[i];
    if (!number(readings[i])) {
      w.readings[i] = 0.0;
      w.due[sensor_of[i]] = 0.0;
    }
  }
  for (j = 0; j < INPUTS; ++j) w.driving[j] = NAME_memory.given[late[j]][j];
  arg[0] = x;
  arg[1] = w.driving;
  arg[2] = w.readings;
  arg[3] = w.due;
  res[0] = w.after;
  res[1] = w.slopes;
  res[2] = w.news;
  res[3] = w.seen;
  swash_traced(arg, res, w.whole, w.traced, 0);
  led(P);
  told(P);
  for (i = 0; i < ESTIMATED; ++i) {
    x[i] = w.after[i] + w.moved[i];
    for (j = 0; j < i; ++j) P[j * ESTIMATED + i] = P[i * ESTIMATED + j];
  }
  for (i = DEPTH - 1; i > 0; --i)
    for (j = 0; j < INPUTS; ++j) NAME_memory.given[i][j] = NAME_memory.given[i - 1][j];
  for (j = 0; j < INPUTS; ++j) NAME_memory.given[0][j] = inputs[j];
  return 1;
}
"""
