/* A filter of constant gain along a record, and its slopes along V directions. Numbers g: of the equations (P), constants
   in the rates (N) and in the outputs (Y), the gain (N, Y). An output is a state, a rate or a part of the force. */
#include <math.h>
#include <string.h>

@VECTORS@
enum { N = @STATES@, W = @DRIVING@, P = @NUMBERS@, Y = @OUTPUTS@, R = @ROOTS@, G = P + N + Y + N * Y };
static const int seen[Y] = {@SEEN@};
static const double fractions[4] = {0, 0.5, 0.5, 1}, weights[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};

static void moving(const double *x, const double *w, const double *p, double *root, int known, double *k) {
  (void)x, (void)w, (void)p, (void)root, (void)known;
@MOVING@}

static void moving_moved(const double *x, const double *w, const double *p, const double *root, double *k,
                         const vec *dx, const vec *dp, vec *dk) {
  (void)x, (void)w, (void)p, (void)root, (void)dx, (void)dp;
@MOVING_MOVED@}

static void force_moved(const double *x, const double *w, const double *p, double *f, const vec *dx, const vec *dp,
                        vec *df) {
  (void)x, (void)w, (void)p, (void)f, (void)dx, (void)dp, (void)df;
@FORCE_MOVED@}

static void rates(const double *x, const double *w, const double *g, double *root, int known, int moved, double *k,
                  const vec *dx, const vec *dg, vec *dk) {
  if (@ROOTED@ || !moved) moving(x, w, g, root, known, k);
  if (moved) moving_moved(x, w, g, root, k, dx, dg, dk);
  for (int i = 0; i < N; ++i) k[i] += g[P + i], dk[i] += dg[P + i];
}

void run(long n, double dt, const double *start, const double *g, const double *rows, const double *readings, long first,
         long count, const double *d_start, const double *d_g, double *errors, double *states, double *d_errors,
         double *d_states);
int directions(void);

/* Errors (n, Y), corrected states (n, N), and slopes (count, n, ...) from direction `first` on; none where count is 0. */
void run(long n, double dt, const double *start, const double *g, const double *rows, const double *readings, long first,
         long count, const double *d_start, const double *d_g, double *errors, double *states, double *d_errors,
         double *d_states) {
  const double *bias = g + P + N, *gain = bias + Y;
  double x[N], at[N], k[N] = {0}, sum[N], w[W], told[2 * N + 3], root[R];
  vec dx[N], dat[N], dk[N] = {0}, dsum[N], dtold[2 * N + 3], dg[G];
  memcpy(x, start, sizeof x);
  memset(dtold, 0, sizeof dtold);
  for (int l = 0; l < V; ++l) {
    const int here = first + l < count;
    for (int i = 0; i < N; ++i) dx[i][l] = here ? d_start[(first + l) * N + i] : 0;
    for (int i = 0; i < G; ++i) dg[i][l] = here ? d_g[(first + l) * G + i] : 0;
  }
  for (long t = 0; t < n; ++t) {
    const double *now = rows + t * W, *then = t + 1 < n ? now + W : now;
    double *e = errors + t * Y;
    memcpy(told, x, sizeof x), memcpy(dtold, dx, sizeof dx);
    if (@RATED@) rates(x, now, g, root, 0, count > 0, told + N, dx, dg, dtold + N);
    force_moved(x, now, g, told + 2 * N, dx, dg, dtold + 2 * N);
    for (int o = 0; o < Y; ++o) {
      const vec de = -dtold[seen[o]] - dg[P + N + o];
      e[o] = readings[t * Y + o] - told[seen[o]] - bias[o];
      for (int i = 0; i < N; ++i)
        x[i] += gain[i * Y + o] * e[o], dx[i] += gain[i * Y + o] * de + e[o] * dg[P + N + Y + i * Y + o];
      for (int l = 0; l < V && first + l < count; ++l) d_errors[((first + l) * n + t) * Y + o] = de[l];
    }
    memcpy(states + t * N, x, sizeof x);
    for (int l = 0; l < V && first + l < count; ++l)
      for (int i = 0; i < N; ++i) d_states[((first + l) * n + t) * N + i] = dx[i][l];
    memset(sum, 0, sizeof sum), memset(dsum, 0, sizeof dsum);
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < N; ++i) at[i] = x[i] + fractions[j] * dt * k[i], dat[i] = dx[i] + fractions[j] * dt * dk[i];
      for (int i = 0; i < W; ++i) w[i] = now[i] + fractions[j] * (then[i] - now[i]);
      rates(at, w, g, root, j || @RATED@, count > 0, k, dat, dg, dk);
      for (int i = 0; i < N; ++i) sum[i] += weights[j] * dt * k[i], dsum[i] += weights[j] * dt * dk[i];
    }
    for (int i = 0; i < N; ++i) x[i] += sum[i], dx[i] += dsum[i];
  }
}

int directions(void) { return V; }
