"""A filter along a record in C, with its slopes: the same equations, traced by CasADi, differentiated in print.

Each sample is a correction, a straight line of statements, and a Runge-Kutta step of the vehicle. A run keeps the roots
that it found; slopes go along the same run again, some directions at a time.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from swashplate.engine.c_expression import printed, statements
from swashplate.engine.c_loops import looped
from swashplate.engine.c_split import ROOTS, split
from swashplate.engine.c_tangents import VECTORS, Tangents
from swashplate.engine.roots import require_casadi
from swashplate.engine.trace import traced_rates
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterGain, FilterState, StochasticModel
from swashplate.filtering.nuisance import Nuisance
from swashplate.physics.backend import CasadiBackend

_FOUND = ("nu", "corrected", "acting", "rest")


def filter_source(model: StochasticModel) -> str:
    """C of `run_along`, `run_moved`, `run_steps`, `run_steps_moved` and `rates_and_slopes`.

    Raises:
        ExportError: for equations that CasADi cannot trace or that are not printed as C.
        MissingLibraryError: without CasADi.
    """
    vehicle = model.vehicle
    n, m = len(vehicle.state_names), len(vehicle.input_names)
    correct = correction(model)
    corrected = statements(correct, precision="double", inputs=["s", "y", "g"])
    of_sample = Tangents({"s": ("ds", None), "g": ("dg", None)})
    correcting = [*of_sample.body(corrected.body), *of_sample.stores(corrected, dict(enumerate(_FOUND)))]
    rates = traced_rates(model.equations)
    whole = statements(rates.function, precision="double", inputs=["x", "w", "p", *(name[:-1] for name in ROOTS)])
    of_card, rest = split(whole, moving=("x[", "w[", *ROOTS), fixed="cp")
    of_inputs, rest = split(rest)
    driven = frozenset(range(m + 3))  # not the voltage
    arrays: dict[str, tuple[str, frozenset[int] | None]] = {"p": ("dp", None)}
    card = Tangents(arrays)
    card_lines = [*card.body(of_card.body), *card.stores(of_card, {0: "cp"})]
    arrays |= {"w": ("dw", driven), "cp": ("dcp", None)}
    inputs = Tangents(arrays)
    input_lines = [*inputs.body(of_inputs.body), *inputs.stores(of_inputs, {0: "c"})]
    moving = Tangents(arrays | {"x": ("dx", None), "c": ("dc", None)})
    if rates.steps:
        plain = looped(rest, rates.steps, real="double", precision="double", outputs=["k"])
        lines, stored = moving.rooted(rest, len(rates.steps))
    else:
        plain, lines, stored = printed(rest, "double", "double", ["k"]), moving.body(rest.body), rest
    blanks = {
        "VECTORS": VECTORS,
        "N": str(n),
        "M": str(m),
        "P": str(len(vehicle.parameter_names) + 2),
        "G": str(correct.size1_in(2)),
        "Y": str(model.n_outputs),
        "S": str(correct.size1_in(0)),
        "A": str(model.n_gusts),
        "WINDY": str(int(model.windy)),
        "R": str(max(1, len(rates.steps))),
        "CP": str(max(1, len(of_card.outputs))),
        "C": str(max(1, len(of_inputs.outputs))),
        "PUSHED": ", ".join(map(str, model.disturbed)),
        "CORRECT": printed(corrected, "double", "double", _FOUND),
        "CORRECT_MOVED": _indented(correcting),
        "OF_CARD": printed(of_card, "double", "double", ["cp"]),
        "OF_CARD_MOVED": _indented(card_lines),
        "OF_INPUTS": printed(of_inputs, "double", "double", ["c"]),
        "OF_INPUTS_MOVED": _indented(input_lines),
        "MOVING": plain,
        "MOVING_MOVED": _indented([*lines, *moving.stores(stored, {0: "k"})]),
    }
    return re.sub(r"@(\w+)@", lambda blank: blanks[blank[1]], _SOURCE)


def _indented(lines: list[str]) -> str:
    return "".join(f"  {line}\n" for line in lines)


class _Symbols(CasadiBackend):
    """Expressions side by side are a column."""

    def __init__(self, casadi: Any) -> None:
        super().__init__()
        self.arrays = self
        self.stack = self.concatenate = lambda parts: casadi.vertcat(*parts)


def correction(model: StochasticModel) -> Any:
    """(predicted, reading, given) to (innovation, corrected, acting, what of the state goes on by itself).

    `given` is the gain row by row, `Nuisance`, what is left of gusts after a sample, and how the line turns.
    """
    casadi = require_casadi()
    xp = _Symbols(casadi)
    n, g, line = len(model.vehicle.state_names), model.n_gusts, model.n_line
    ends = np.cumsum([n, g, N_DISTURBANCES, line]).tolist()
    sizes = [ends[-1] * model.n_outputs, len(Nuisance._fields), g, line * line]
    s, y, given = (
        casadi.SX.sym(a, size) for a, size in zip("syg", (ends[-1], model.n_outputs, sum(sizes)), strict=True)
    )
    rows, nuisance, fade, turn = casadi.vertsplit(given, [0, *np.cumsum(sizes).tolist()])
    K = casadi.reshape(rows, model.n_outputs, ends[-1]).T
    x, gust, drift, shaken = casadi.vertsplit(s, [0, *ends])
    by_state, by_gust, by_drift, by_line = casadi.vertsplit(K, [0, *ends])
    gain = FilterGain(by_state, by_gust, by_drift, None, by_line)
    state = FilterState(x, gust, drift, shaken if model.lined else ())
    after, innovation = model.correct(state, y, gain, Nuisance(*casadi.vertsplit(nuisance)), xp)
    left = after.line if model.lined else casadi.SX(0, 1)
    turned = casadi.reshape(turn, line, line).T @ left if model.lined else left
    results = [
        innovation,
        casadi.vertcat(after.x, after.gust, after.drift, left),
        model.acting(after, xp),
        casadi.vertcat(fade * after.gust, after.drift, turned),
    ]
    return casadi.Function("f", [s, y, given], [casadi.densify(result) for result in results], {"cse": True})


_SOURCE = """#include <math.h>
#include <string.h>

@VECTORS@
enum { N = @N@, M = @M@, W = M + 4, P = @P@, G = @G@, Y = @Y@, S = @S@, A = @A@, R = @R@, CP = @CP@, C = @C@ };
static const int pushed[6] = {@PUSHED@};
static const double fractions[4] = {0, 0.5, 0.5, 1}, weights[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};

static void correct(const double *s, const double *y, const double *g, double *nu, double *corrected,
                    double *acting, double *rest) {
@CORRECT@}

static void correct_moved(const double *s, const double *y, const double *g, double *nu, double *corrected,
                          double *acting, double *rest, const vec *ds, const vec *dg, vec *dnu, vec *dcorrected,
                          vec *dacting, vec *drest) {
@CORRECT_MOVED@}

static void of_card(const double *p, double *cp) {
  (void)p, (void)cp;
@OF_CARD@}

static void of_card_moved(const double *p, double *cp, const vec *dp, vec *dcp) {
  (void)p, (void)cp, (void)dp, (void)dcp;
@OF_CARD_MOVED@}

static void of_inputs(const double *w, const double *p, const double *cp, double *c) {
  (void)w, (void)p, (void)cp, (void)c;
@OF_INPUTS@}

static void of_inputs_moved(const double *w, const double *p, const double *cp, double *c, const vec *dw, const vec *dp,
                            const vec *dcp, vec *dc) {
  (void)w, (void)p, (void)cp, (void)c, (void)dw, (void)dp, (void)dcp, (void)dc;
@OF_INPUTS_MOVED@}

static void moving(const double *x, const double *w, const double *p, const double *cp, const double *c, double *root,
                   int known, double *k) {
  (void)x, (void)w, (void)p, (void)cp, (void)c, (void)root, (void)known;
@MOVING@}

static void moving_moved(const double *x, const double *w, const double *p, const double *cp, const double *c,
                         const double *root, double *k, const vec *dx, const vec *dw, const vec *dp, const vec *dcp,
                         const vec *dc, vec *dk) {
  (void)x, (void)w, (void)p, (void)cp, (void)c, (void)root, (void)dx, (void)dw, (void)dp, (void)dcp, (void)dc;
@MOVING_MOVED@}

static void driving(const double *u, const double *acting, double volts, double *w) {
  memcpy(w, u, M * sizeof *u);
  w[M] = @WINDY@ ? acting[6] : 0;
  w[M + 1] = @WINDY@ ? acting[7] : 0;
  w[M + 2] = 0;
  w[M + 3] = volts;
}

/* root: of each of the four stages. */
static void step(double *x, const double *w, const double *push, const double *p, const double *cp, double dt,
                 double (*root)[R]) {
  double at[N], k[N] = {0}, sum[N] = {0}, c[C];
  of_inputs(w, p, cp, c);
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < N; ++i) at[i] = x[i] + fractions[j] * dt * k[i];
    if (j) memcpy(root[j], root[j - 1], sizeof root[j]);
    moving(at, w, p, cp, c, root[j], j, k);
    for (int i = 0; i < 6; ++i) k[pushed[i]] += push[i];
    for (int i = 0; i < N; ++i) sum[i] += weights[j] * dt * k[i];
  }
  for (int i = 0; i < N; ++i) x[i] += sum[i];
}

static void step_moved(double *x, const double *w, const double *push, const double *p, const double *cp, double dt,
                       double (*root)[R], vec *dx, const vec *dw, const vec *dpush, const vec *dp, const vec *dcp) {
  double at[N], k[N] = {0}, sum[N] = {0}, c[C];
  vec dat[N], dk[N] = {0}, dsum[N] = {0}, dc[C];
  of_inputs_moved(w, p, cp, c, dw, dp, dcp, dc);
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < N; ++i) at[i] = x[i] + fractions[j] * dt * k[i], dat[i] = dx[i] + fractions[j] * dt * dk[i];
    moving_moved(at, w, p, cp, c, root[j], k, dat, dw, dp, dcp, dc, dk);
    for (int i = 0; i < 6; ++i) k[pushed[i]] += push[i], dk[pushed[i]] += dpush[i];
    for (int i = 0; i < N; ++i) sum[i] += weights[j] * dt * k[i], dsum[i] += weights[j] * dt * dk[i];
  }
  for (int i = 0; i < N; ++i) x[i] += sum[i], dx[i] += dsum[i];
}

/* V of `count` rows of so many numbers from row `first` on, side by side; zeros beyond the last. */
static void gathered(vec *to, const double *rows, long size, long first, long count) {
  for (long i = 0; i < size; ++i)
    for (int l = 0; l < V; ++l) to[i][l] = first + l < count ? rows[(first + l) * size + i] : 0;
}

/* The same of row `i` of `rows` in every direction. */
static void gathered_row(vec *to, const double *from, long size, long rows, long i, long first, long count) {
  for (long j = 0; j < size; ++j)
    for (int l = 0; l < V; ++l) to[j][l] = first + l < count ? from[((first + l) * rows + i) * size + j] : 0;
}

void run_along(long n, double dt, const double *start, const double *g, const double *p, const double *readings,
               const double *commands, const double *voltage, double *innovations, double *states, double *roots);
void run_moved(long n, double dt, const double *start, const double *g, const double *p, const double *readings,
               const double *commands, const double *voltage, const double *roots, long first, long count,
               const double *d_start, const double *d_g, const double *d_p, long arriving, long late,
               const double *d_commands, double *out, long marks, const long *at, double *d_states);
void run_steps(long rows, double dt, long each, double *x, const double *w, const double *push, const double *p);
void run_steps_moved(long rows, long count, double dt, double *x, const double *w, const double *push, const double *p,
                     double *dx, const double *d_w, const double *d_push, const double *d_p);
void run_rates(long rows, const double *x, const double *w, const double *p, double *k);
void rates_and_slopes(long rows, const double *x, const double *w, const double *p, double *k, double *by_x,
                      double *by_w);
int directions(void);
int roots(void);

/* Innovations (n, Y) and corrected states (n, S); roots (n, 4, R) for `run_moved`. */
void run_along(long n, double dt, const double *start, const double *g, const double *p, const double *readings,
               const double *commands, const double *voltage, double *innovations, double *states, double *roots) {
  double s[S], acting[A], rest[S - N + 1], w[W], cp[CP];
  memcpy(s, start, sizeof s);
  of_card(p, cp);
  for (long i = 0; i < n; ++i) {
    correct(s, readings + i * Y, g, innovations + i * Y, states + i * S, acting, rest);
    memcpy(s, states + i * S, N * sizeof *s);
    memcpy(s + N, rest, (S - N) * sizeof *s);
    driving(commands + i * M, acting, voltage[i], w);
    step(s, w, acting, p, cp, dt, (double (*)[R])(roots + i * 4 * R));
  }
}

/* Slopes of the innovations (count, n, Y) along V directions from `first` on; commands of directions `arriving` and the
   `late` - 1 after it move (late, n, M). Slopes of the corrected states at the samples `at` (count, marks, S). */
void run_moved(long n, double dt, const double *start, const double *g, const double *p, const double *readings,
               const double *commands, const double *voltage, const double *roots, long first, long count,
               const double *d_start, const double *d_g, const double *d_p, long arriving, long late,
               const double *d_commands, double *out, long marks, const long *at, double *d_states) {
  long mark = 0;
  double s[S], corrected[S], acting[A], rest[S - N + 1], w[W], cp[CP], nu[Y];
  vec ds[S], dcorrected[S], dacting[A], drest[S - N + 1], dw[W], dcp[CP], dnu[Y], dg[G], dp[P];
  memset(dw, 0, sizeof dw);
  memcpy(s, start, sizeof s);
  gathered(ds, d_start, S, first, count);
  gathered(dg, d_g, G, first, count);
  gathered(dp, d_p, P, first, count);
  of_card_moved(p, cp, dp, dcp);
  for (long i = 0; i < n; ++i) {
    correct_moved(s, readings + i * Y, g, nu, corrected, acting, rest, ds, dg, dnu, dcorrected, dacting, drest);
    for (int l = 0; l < V && first + l < count; ++l)
      for (int o = 0; o < Y; ++o) out[((first + l) * n + i) * Y + o] = dnu[o][l];
    for (; mark < marks && at[mark] == i; ++mark)
      for (int l = 0; l < V && first + l < count; ++l)
        for (int j = 0; j < S; ++j) d_states[((first + l) * marks + mark) * S + j] = dcorrected[j][l];
    memcpy(s, corrected, N * sizeof *s), memcpy(ds, dcorrected, N * sizeof *ds);
    memcpy(s + N, rest, (S - N) * sizeof *s), memcpy(ds + N, drest, (S - N) * sizeof *ds);
    driving(commands + i * M, acting, voltage[i], w);
    for (int l = 0; l < V; ++l) {
      const long place = first + l - arriving;
      for (int j = 0; j < M; ++j) dw[j][l] = place >= 0 && place < late ? d_commands[(place * n + i) * M + j] : 0;
    }
    for (int j = 6; j < A; ++j) dw[M + j - 6] = dacting[j];
    step_moved(s, w, acting, p, cp, dt, (double (*)[R])(roots + i * 4 * R), ds, dw, dacting, dp, dcp);
  }
}

/* States (rows, N) one sample later, under commands and air (rows, W) and push (rows, 6); numbers of all, or of
   `each`. */
void run_steps(long rows, double dt, long each, double *x, const double *w, const double *push, const double *p) {
  double cp[CP], root[4][R];
  for (long i = 0; i < rows; ++i) {
    if (!i || each) of_card(p + i * each * P, cp);
    step(x + i * N, w + i * W, push + i * 6, p + i * each * P, cp, dt, root);
  }
}

/* The same, with slopes of states (count, rows, N) along directions of commands and air (count, rows, W), of the push
   (count, rows, 6) and of the numbers (count, P), which are those of all. */
void run_steps_moved(long rows, long count, double dt, double *x, const double *w, const double *push, const double *p,
                     double *dx, const double *d_w, const double *d_push, const double *d_p) {
  double at[N], cp[CP], root[4][R];
  vec v[N], vw[W], vpush[6], vp[P], vcp[CP];
  for (long first = 0; first < count; first += V) {
    gathered(vp, d_p, P, first, count);
    of_card_moved(p, cp, vp, vcp);
    for (long i = 0; i < rows; ++i) {
      memcpy(at, x + i * N, sizeof at);
      step(at, w + i * W, push + i * 6, p, cp, dt, root);
      memcpy(at, x + i * N, sizeof at);
      gathered_row(v, dx, N, rows, i, first, count);
      gathered_row(vw, d_w, W, rows, i, first, count);
      gathered_row(vpush, d_push, 6, rows, i, first, count);
      step_moved(at, w + i * W, push + i * 6, p, cp, dt, root, v, vw, vpush, vp, vcp);
      for (int l = 0; l < V && first + l < count; ++l)
        for (int j = 0; j < N; ++j) dx[((first + l) * rows + i) * N + j] = v[j][l];
    }
  }
  run_steps(rows, dt, 0, x, w, push, p);
}

static void slopes_at(const double *x, const double *w, const double *p, double *k, double *by_x, double *by_w) {
  double c[C], cp[CP], root[R];
  vec dx[N], dw[W], dp[P], dcp[CP], dc[C], dk[N];
  of_card(p, cp), of_inputs(w, p, cp, c), moving(x, w, p, cp, c, root, 0, k);
  memset(dp, 0, sizeof dp), memset(dcp, 0, sizeof dcp);
  for (int first = 0; first < N + W; first += V) {
    memset(dx, 0, sizeof dx), memset(dw, 0, sizeof dw);
    for (int l = 0; l < V && first + l < N + W; ++l)
      if (first + l < N) dx[first + l][l] = 1;
      else dw[first + l - N][l] = 1;
    of_inputs_moved(w, p, cp, c, dw, dp, dcp, dc);
    moving_moved(x, w, p, cp, c, root, k, dx, dw, dp, dcp, dc, dk);
    for (int i = 0; i < N; ++i)
      for (int l = 0; l < V && first + l < N + W; ++l)
        if (first + l < N) by_x[i * N + first + l] = dk[i][l];
        else by_w[i * W + first + l - N] = dk[i][l];
  }
}

/* By row: the rates (N). */
void run_rates(long rows, const double *x, const double *w, const double *p, double *k) {
  double cp[CP], c[C], root[R];
  for (long i = 0; i < rows; ++i) {
    of_card(p + i * P, cp), of_inputs(w + i * W, p + i * P, cp, c);
    moving(x + i * N, w + i * W, p + i * P, cp, c, root, 0, k + i * N);
  }
}

/* By row: the rates (N), and their slopes by the states (N, N) and by inputs and wind (N, W). */
void rates_and_slopes(long rows, const double *x, const double *w, const double *p, double *k, double *by_x,
                      double *by_w) {
  for (long i = 0; i < rows; ++i)
    slopes_at(x + i * N, w + i * W, p + i * P, k + i * N, by_x + i * N * N, by_w + i * N * W);
}

int directions(void) { return V; }
int roots(void) { return R; }
"""
