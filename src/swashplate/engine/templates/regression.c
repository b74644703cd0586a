#include "@NAME@.h"
#include <math.h>

#define CHANNELS @UPPER@_CHANNELS
#define UNKNOWNS @UPPER@_UNKNOWNS
#define LINES @UPPER@_LINES
#define SUMS @UPPER@_SUMS
#define WINDOW @UPPER@_WINDOW
#define ZERO @ZERO@
#define ONE @ONE@
#define TWO @TWO@
#define HALF @HALF@
#define THREE_HALVES @THREE_HALVES@
#define TURN_RE @TURN_RE@
#define TURN_IM @TURN_IM@
#define KEEP @KEEP@
#define KEEP_SQUARED @KEEP_SQUARED@
#define HALF_STEP @HALF_STEP@
#define SHORTEST @SHORTEST@
#define LONGEST @LONGEST@
#define LEAST_PIVOT @LEAST_PIVOT@
#define LEAST_LEFT @LEAST_LEFT@
#define LEAST_FREEDOM @LEAST_FREEDOM@
#define FIRST @FIRST@
#define AROUND @AROUND@
#define DERIVATIVE @DERIVATIVE@
#define REAL @REAL@
#define SQRT @SQRT@

static const int held[CHANNELS] = {@HELD@};
static const int column[UNKNOWNS] = {@COLUMNS@};
static const @REAL@ known[CHANNELS] = {@KNOWN@};
static const @REAL@ omega[LINES] = {@OMEGA@};
static const @REAL@ factors[CHANNELS + 1][LINES][2] = {
  @FACTORS@};

/* Recursive Fourier regression, after the constants that stand above. No allocation; of the C library only sqrt.
 *
 * Sums of a step are those of swashplate's Python, operation by operation (Morelli 2000, J. Guidance 23(5)); bounds are
 * Morelli and Klein's (1997) for residuals that are not independent, written in frequency.
 * Do not compile with -ffast-math: a sample that is no number would not be seen.
 */

static void turn(const REAL by[2], REAL value[2]) {
  const REAL re = value[0] * by[0] - value[1] * by[1];
  value[1] = value[0] * by[1] + value[1] * by[0];
  value[0] = re;
}

void @NAME@_begin(@NAME@_memory *e) {
  int i, k;
  for (i = 0; i < SUMS; ++i)
    for (k = 0; k < LINES; ++k) e->sums[i][k][0] = e->sums[i][k][1] = ZERO;
  for (k = 0; k < WINDOW; ++k) e->window[k][0] = e->window[k][1] = ZERO;
  e->turned[0] = ONE;
  e->turned[1] = ZERO;
  e->begun = 0;
}

int @NAME@_step(@NAME@_memory *e, REAL elapsed, const REAL sample[CHANNELS]) {
  const REAL base[2] = {TURN_RE, TURN_IM};
  REAL before[CHANNELS], begin[2], end[2], then[2] = {ONE, ZERO}, here[2] = {ONE, ZERO}, back;
  int i, m, ran = e->begun;
  for (i = 0; i < CHANNELS; ++i) {
    if (!(sample[i] - sample[i] == ZERO)) { /* NaN or infinite: frozen, and a new stretch follows */
      e->begun = 0;
      return 0;
    }
  }
  for (i = 0; i < CHANNELS; ++i) {
    before[i] = e->last[i];
    e->last[i] = sample[i];
  }
  e->begun = 1;
  if (!ran || !(SHORTEST < elapsed && elapsed < LONGEST)) return 0;
  begin[0] = end[0] = e->turned[0];
  begin[1] = end[1] = e->turned[1];
  turn(base, end);
  back = THREE_HALVES - HALF * (end[0] * end[0] + end[1] * end[1]);
  e->turned[0] = end[0] = end[0] * back;
  e->turned[1] = end[1] = end[1] * back;
  for (m = 0; m < WINDOW; ++m) {
    const int k = m - FIRST;
    e->window[m][0] = KEEP_SQUARED * e->window[m][0] + HALF_STEP * (then[0] + here[0]);
    e->window[m][1] = KEEP_SQUARED * e->window[m][1] + HALF_STEP * (then[1] + here[1]);
    if (k >= 0 && k < LINES) {
      int part;
      for (part = 0; part < 2; ++part) {
        const REAL a = then[part], b = here[part];
        for (i = 0; i < CHANNELS; ++i) {
          const REAL added = held[i] ? before[i] * a : HALF_STEP * (before[i] * a + sample[i] * b);
          e->sums[i][k][part] = KEEP * e->sums[i][k][part] + added;
        }
        e->sums[CHANNELS][k][part] = KEEP * e->sums[CHANNELS][k][part] + a;
        e->sums[CHANNELS + 1][k][part] = KEEP * e->sums[CHANNELS + 1][k][part] + (sample[0] * b - before[0] * a);
      }
    }
    turn(begin, then);
    turn(end, here);
  }
  return 1;
}

static void transform(const @NAME@_memory *e, int channel, int k, REAL value[2]) {
  value[0] = e->sums[channel][k][0];
  value[1] = e->sums[channel][k][1];
  turn(factors[channel][k], value);
}

static void rows(const @NAME@_memory *e, @NAME@_work *w) {
  int i, k;
  for (k = 0; k < LINES; ++k) {
    REAL z[2], part[2];
    transform(e, 0, k, z);
    if (DERIVATIVE) {
      part[0] = e->sums[CHANNELS + 1][k][0] - omega[k] * z[1];
      z[1] = e->sums[CHANNELS + 1][k][1] + omega[k] * z[0];
      z[0] = part[0];
    }
    for (i = 0; i < CHANNELS; ++i) {
      if (known[i] != ZERO) {
        transform(e, i, k, part);
        z[0] -= known[i] * part[0];
        z[1] -= known[i] * part[1];
      }
    }
    w->left[k][0] = z[0];
    w->left[k][1] = z[1];
    for (i = 0; i < UNKNOWNS; ++i) {
      if (column[i] < CHANNELS) {
        transform(e, column[i], k, w->right[k][i]);
      } else {
        transform(e, CHANNELS, k, w->right[k][i]);
      }
    }
  }
}

/* Inverse of the scaled normal equations by their Cholesky factor; 0 where a pivot says that they are singular. */
static int inverted(@NAME@_work *w) {
  int i, j, k;
  for (i = 0; i < UNKNOWNS; ++i) {
    for (j = 0; j <= i; ++j) {
      REAL sum = w->normal[i][j];
      for (k = 0; k < j; ++k) sum -= w->lower[i][k] * w->lower[j][k];
      if (i > j) {
        w->lower[i][j] = sum / w->lower[j][j];
      } else {
        if (!(sum > LEAST_PIVOT)) return 0;
        w->lower[i][i] = SQRT(sum);
      }
    }
  }
  for (j = 0; j < UNKNOWNS; ++j) { /* the factor's inverse, over the normal equations */
    for (i = 0; i < UNKNOWNS; ++i) {
      REAL sum = i == j ? ONE : ZERO;
      for (k = j; k < i; ++k) sum -= w->lower[i][k] * w->normal[k][j];
      w->normal[i][j] = i < j ? ZERO : sum / w->lower[i][i];
    }
  }
  for (i = 0; i < UNKNOWNS; ++i) {
    for (j = 0; j < UNKNOWNS; ++j) {
      w->inverse[i][j] = ZERO;
      for (k = i > j ? i : j; k < UNKNOWNS; ++k) w->inverse[i][j] += w->normal[k][i] * w->normal[k][j];
    }
  }
  return 1;
}

int @NAME@_estimate(const @NAME@_memory *e, @NAME@_work *w, REAL values[UNKNOWNS], REAL covariance[UNKNOWNS][UNKNOWNS]) {
  const REAL length = e->window[0][0];
  REAL squares = ZERO, count, freedom;
  int i, j, k, l;
  if (!(length > ZERO)) return 0;
  rows(e, w);
  for (i = 0; i < UNKNOWNS; ++i) {
    w->moment[i] = ZERO;
    for (j = 0; j <= i; ++j) {
      REAL sum = ZERO;
      for (k = 0; k < LINES; ++k)
        sum += w->right[k][i][0] * w->right[k][j][0] + w->right[k][i][1] * w->right[k][j][1];
      w->normal[i][j] = sum;
    }
    for (k = 0; k < LINES; ++k)
      w->moment[i] += w->right[k][i][0] * w->left[k][0] + w->right[k][i][1] * w->left[k][1];
    if (!(w->normal[i][i] > ZERO)) return 0;
    w->size[i] = SQRT(w->normal[i][i]);
  }
  for (i = 0; i < UNKNOWNS; ++i)
    for (j = 0; j <= i; ++j) w->normal[i][j] /= w->size[i] * w->size[j];
  if (!inverted(w)) return 0;
  for (k = 0; k < LINES; ++k) {
    squares += (k ? TWO : ONE) * (REAL)(LINES - k) * (e->window[k][0] * e->window[k][0] + e->window[k][1] * e->window[k][1]);
  }
  count = (REAL)LINES * (REAL)LINES * length * length / squares;
  freedom = TWO * count - (REAL)UNKNOWNS;
  if (!(freedom > LEAST_FREEDOM)) return 0;
  for (i = 0; i < UNKNOWNS; ++i) {
    values[i] = ZERO;
    for (j = 0; j < UNKNOWNS; ++j) values[i] += w->inverse[i][j] * (w->moment[j] / w->size[j]);
    values[i] /= w->size[i];
  }
  for (k = 0; k < LINES; ++k) {
    REAL v[2];
    v[0] = w->left[k][0];
    v[1] = w->left[k][1];
    for (i = 0; i < UNKNOWNS; ++i) {
      v[0] -= w->right[k][i][0] * values[i];
      v[1] -= w->right[k][i][1] * values[i];
    }
    w->power[k] = v[0] * v[0] + v[1] * v[1];
  }
  for (k = 0; k < LINES; ++k) { /* what of a line's two numbers the coefficients leave */
    REAL taken = ZERO;
    for (i = 0; i < UNKNOWNS; ++i) {
      REAL re = ZERO, im = ZERO;
      for (j = 0; j < UNKNOWNS; ++j) {
        const REAL share = w->inverse[j][i] / w->size[j];
        re += w->right[k][j][0] * share;
        im += w->right[k][j][1] * share;
      }
      taken += (re * w->right[k][i][0] + im * w->right[k][i][1]) / w->size[i];
    }
    taken = ONE - taken * (REAL)LINES / (TWO * count);
    w->spare[k] = taken > LEAST_LEFT ? taken : LEAST_LEFT;
  }
  for (k = 0; k < LINES; ++k) { /* regressors, scaled and times the root of the residual's spectrum */
    REAL sum = ZERO, whole = ZERO, root;
    for (l = k - AROUND; l <= k + AROUND; ++l) {
      if (l >= 0 && l < LINES) {
        const REAL weight = ONE - (REAL)(l < k ? k - l : l - k) / (REAL)(AROUND + 1);
        sum += weight * w->power[l];
        whole += weight * w->spare[l];
      }
    }
    root = SQRT(sum / whole / length * (freedom / (freedom - TWO)));
    for (i = 0; i < UNKNOWNS; ++i) {
      w->right[k][i][0] *= root / w->size[i];
      w->right[k][i][1] *= root / w->size[i];
    }
  }
  for (i = 0; i < UNKNOWNS; ++i)
    for (j = 0; j < UNKNOWNS; ++j) w->middle[i][j] = ZERO;
  for (k = 0; k < LINES; ++k) {
    for (j = 0; j < UNKNOWNS; ++j) w->row[j][0] = w->row[j][1] = ZERO;
    for (l = 0; l < LINES; ++l) {
      const int m = k > l ? k - l : l - k;
      const REAL ar = e->window[m][0], ai = k < l ? -e->window[m][1] : e->window[m][1];
      const REAL tr = e->window[k + l + 2 * FIRST][0], ti = e->window[k + l + 2 * FIRST][1];
      const REAL sr = ar + tr, di = ti - ai, si = ai + ti, dr = ar - tr;
      for (j = 0; j < UNKNOWNS; ++j) { /* apart times the regressor and together times its conjugate */
        const REAL xr = w->right[l][j][0], xi = w->right[l][j][1];
        w->row[j][0] += sr * xr + di * xi;
        w->row[j][1] += si * xr + dr * xi;
      }
    }
    for (i = 0; i < UNKNOWNS; ++i)
      for (j = 0; j < UNKNOWNS; ++j)
        w->middle[i][j] += HALF * (w->right[k][i][0] * w->row[j][0] + w->right[k][i][1] * w->row[j][1]);
  }
  for (i = 0; i < UNKNOWNS; ++i) {
    for (j = 0; j < UNKNOWNS; ++j) {
      w->lower[i][j] = ZERO;
      for (k = 0; k < UNKNOWNS; ++k) w->lower[i][j] += w->inverse[i][k] * w->middle[k][j];
    }
  }
  for (i = 0; i < UNKNOWNS; ++i) {
    for (j = 0; j < UNKNOWNS; ++j) {
      REAL sum = ZERO;
      for (k = 0; k < UNKNOWNS; ++k) sum += w->lower[i][k] * w->inverse[k][j];
      covariance[i][j] = sum / (w->size[i] * w->size[j]);
    }
  }
  return 1;
}
