"""A filter of slow parameters as C99: the very step that Python runs, traced by CasADi, without allocation.

Needs the extra `export`. It costs what an extended Kalman filter with a vehicle's exact Jacobians costs: tens of
thousands of operations a step and more temporaries than many small processors have. `SlowCode` says how much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.control.lqg.traced import CasadiMatrices
from swashplate.export.c_text import identifier, words
from swashplate.export.controller_c import operations_of, printed_function
from swashplate.export.regression_c import CYCLES
from swashplate.extras import library
from swashplate.filtering import observer
from swashplate.filtering.observer import ObserverEstimate
from swashplate.identification.recursive.fourier_regression import EARLY, LATE
from swashplate.identification.recursive.slow_parameters import SlowPlan


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
    casadi = library("casadi", what="C code")
    own, called, M = plan.observer, identifier(name), CasadiMatrices()
    N, m, channels, sensors = len(own.names), own.inputs + 1, len(own.channels), len(own.sensors)
    estimate, driving = casadi.MX.sym("estimate", N + N * N), casadi.MX.sym("driving", m)
    y, due = casadi.MX.sym("readings", channels), casadi.MX.sym("due", sensors)
    begun = ObserverEstimate(estimate[:N], casadi.reshape(estimate[N:], N, N))
    flags = [due[i] for i in range(sensors)]
    before = observer.predicted(own, plan.numbers, begun, driving, flags, M)
    after, _, _ = observer.corrected(own, plan.numbers, before, y, flags, driving, M)
    result = casadi.vertcat(after.mean, casadi.reshape(casadi.densify(after.covariance), N * N, 1))
    function = casadi.Function("swash_traced", [estimate, driving, y, due], [result])
    printed, _ = printed_function(function, "double")
    depth = 1 + max(own.delays)
    sizes = {"ESTIMATED": N, "INPUTS": m, "CHANNELS": channels, "SENSORS": sensors, "DEPTH": depth}
    work = {"WORK": max(int(function.sz_w()), 1) + N + N * N, "WHOLE": max(int(function.sz_iw()), 1)}
    work |= {"ARGUMENTS": max(int(function.sz_arg()), 4), "RESULTS": max(int(function.sz_res()), 1)}
    defines = "\n".join(f"#define {key} {value}" for key, value in {**sizes, **work}.items())
    return SlowCode(
        name=called,
        source=_heading(plan, called) + printed + "\n" + defines + "\n" + _tables(plan) + _BODY.replace("NAME", called),
        memory_bytes=8 * (N + N * N + depth * m) + 8,
        work_bytes=8 * work["WORK"] + 4 * work["WHOLE"],
        operations=operations_of(function),
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

NAME_memory_t NAME_memory;

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

int NAME_step(double elapsed, const double inputs[INPUTS], const double readings[CHANNELS]) {
  static double work[WORK], y[CHANNELS], due[SENSORS], driving[INPUTS];
  static int iw[WHOLE];
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
  for (i = 0; i < SENSORS; ++i) due[i] = 1.0;
  for (i = 0; i < CHANNELS; ++i) {
    y[i] = readings[i];
    if (!number(readings[i])) {
      y[i] = 0.0;
      due[sensor_of[i]] = 0.0;
    }
  }
  for (j = 0; j < INPUTS; ++j) driving[j] = NAME_memory.given[late[j]][j];
  arg[0] = NAME_memory.estimate;
  arg[1] = driving;
  arg[2] = y;
  arg[3] = due;
  res[0] = work;
  swash_traced(arg, res, iw, work + ESTIMATED + ESTIMATED * ESTIMATED, 0);
  for (i = 0; i < ESTIMATED + ESTIMATED * ESTIMATED; ++i) NAME_memory.estimate[i] = work[i];
  for (i = DEPTH - 1; i > 0; --i)
    for (j = 0; j < INPUTS; ++j) NAME_memory.given[i][j] = NAME_memory.given[i - 1][j];
  for (j = 0; j < INPUTS; ++j) NAME_memory.given[0][j] = inputs[j];
  return 1;
}
"""
