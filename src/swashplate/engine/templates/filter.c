#include <math.h>
#include <string.h>

@vectors.h@

enum { N = @N@, M = @M@, W = M + 4, P = @P@, G = @G@, Y = @Y@, S = @S@, A = @A@, D = @D@, R = @R@, CP = @CP@, C = @C@ };
static const int pushed[D] = {@PUSHED@};
static const double fractions[4] = {0, 0.5, 0.5, 1}, weights[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};

/* k: the rates at the predicted state, where they are measured. */
static void correct(const double *s, const double *y, const double *g, const double *w, const double *p, const double *k,
                    double *nu, double *corrected, double *acting, double *rest) {
  (void)w, (void)p, (void)k, (void)rest;
@CORRECT@}

static void correct_moved(const double *s, const double *y, const double *g, const double *w, const double *p,
                          const double *k, double *nu, double *corrected, double *acting, double *rest, const vec *ds,
                          const vec *dg, const vec *dp, const vec *dk, vec *dnu, vec *dcorrected, vec *dacting,
                          vec *drest) {
  (void)w, (void)p, (void)k, (void)rest, (void)dp, (void)dk, (void)drest;
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

static void driving(const double *row, const double *acting, double *w) {
  memcpy(w, row, W * sizeof *w);
  if (@WINDY@) w[M] += acting[6], w[M + 1] += acting[7];
}

/* What drives at a stage: held, or straight from w to `then`. */
static void at_stage(const double *w, const double *then, int j, double *v) {
  for (int i = 0; i < W; ++i) v[i] = @LINEAR@ ? w[i] + fractions[j] * (then[i] - w[i]) : w[i];
}

/* root: of each of the four stages. */
static void step(double *x, const double *w, const double *then, const double *push, const double *p, const double *cp,
                 double dt, double (*root)[R]) {
  double at[N], k[N] = {0}, sum[N] = {0}, c[C], v[W];
  at_stage(w, then, 0, v), of_inputs(v, p, cp, c);
  for (int j = 0; j < 4; ++j) {
    if (@LINEAR@ && j) at_stage(w, then, j, v), of_inputs(v, p, cp, c);
    for (int i = 0; i < N; ++i) at[i] = x[i] + fractions[j] * dt * k[i];
    if (j) memcpy(root[j], root[j - 1], sizeof root[j]);
    moving(at, v, p, cp, c, root[j], j, k);
    for (int i = 0; i < D; ++i) k[pushed[i]] += push[i];
    for (int i = 0; i < N; ++i) sum[i] += weights[j] * dt * k[i];
  }
  for (int i = 0; i < N; ++i) x[i] += sum[i];
}

static void step_moved(double *x, const double *w, const double *then, const double *push, const double *p,
                       const double *cp, double dt, double (*root)[R], vec *dx, const vec *dw, const vec *dpush,
                       const vec *dp, const vec *dcp) {
  double at[N], k[N] = {0}, sum[N] = {0}, c[C], v[W];
  vec dat[N], dk[N] = {0}, dsum[N] = {0}, dc[C];
  at_stage(w, then, 0, v), of_inputs_moved(v, p, cp, c, dw, dp, dcp, dc);
  for (int j = 0; j < 4; ++j) {
    if (@LINEAR@ && j) at_stage(w, then, j, v), of_inputs_moved(v, p, cp, c, dw, dp, dcp, dc);
    for (int i = 0; i < N; ++i) at[i] = x[i] + fractions[j] * dt * k[i], dat[i] = dx[i] + fractions[j] * dt * dk[i];
    moving_moved(at, v, p, cp, c, root[j], k, dat, dw, dp, dcp, dc, dk);
    for (int i = 0; i < D; ++i) k[pushed[i]] += push[i], dk[pushed[i]] += dpush[i];
    for (int i = 0; i < N; ++i) sum[i] += weights[j] * dt * k[i], dsum[i] += weights[j] * dt * dk[i];
  }
  for (int i = 0; i < N; ++i) x[i] += sum[i], dx[i] += dsum[i];
}

/* V of `count` rows of so many numbers from row `first` on, side by side; zeros beyond the last. */
static void gathered(vec *to, const double *rows, long size, long first, long count) {
  for (long i = 0; i < size; ++i)
    for (int l = 0; l < V; ++l) to[i][l] = first + l < count ? rows[(first + l) * size + i] : 0;
}

void run_along(long n, double dt, const double *start, const double *g, const double *p, const double *readings,
               const double *rows, double *innovations, double *states, double *roots);
void run_moved(long n, double dt, const double *start, const double *g, const double *p, const double *readings,
               const double *rows, const double *roots, long first, long count, const double *d_start,
               const double *d_g, const double *d_p, long arriving, long late, const double *d_commands, double *out,
               long marks, const long *at, double *d_states);
void run_steps(long rows, double dt, long each, double *x, const double *w, const double *push, const double *p);
void run_rates(long rows, const double *x, const double *w, const double *p, double *k);
void rates_and_slopes(long rows, const double *x, const double *w, const double *p, double *k, double *by_x,
                      double *by_w);
int directions(void);
int roots(void);

/* Innovations (n, Y) and corrected states (n, S); roots (n, 4, R) for `run_moved`. */
void run_along(long n, double dt, const double *start, const double *g, const double *p, const double *readings,
               const double *rows, double *innovations, double *states, double *roots) {
  double s[S], acting[A], rest[S - N + 1], w[W], then[W], cp[CP], c[C], k[N] = {0}, root[R];
  memcpy(s, start, sizeof s);
  of_card(p, cp);
  for (long i = 0; i < n; ++i) {
    const double *row = rows + i * W, *next = i + 1 < n ? row + W : row;
    if (@RATED@) of_inputs(row, p, cp, c), moving(s, row, p, cp, c, root, 0, k);
    correct(s, readings + i * Y, g, row, p, k, innovations + i * Y, states + i * S, acting, rest);
    memcpy(s, states + i * S, N * sizeof *s);
    memcpy(s + N, rest, (S - N) * sizeof *s);
    driving(row, acting, w), driving(next, acting, then);
    step(s, w, then, acting, p, cp, dt, (double (*)[R])(roots + i * 4 * R));
  }
}

/* Slopes of the innovations (count, n, Y) along V directions from `first` on; commands of directions `arriving` and the
   `late` - 1 after it move (late, n, M). Slopes of the corrected states at the samples `at` (count, marks, S). */
void run_moved(long n, double dt, const double *start, const double *g, const double *p, const double *readings,
               const double *rows, const double *roots, long first, long count, const double *d_start,
               const double *d_g, const double *d_p, long arriving, long late, const double *d_commands, double *out,
               long marks, const long *at, double *d_states) {
  long mark = 0;
  double s[S], corrected[S], acting[A], rest[S - N + 1], w[W], then[W], cp[CP], nu[Y], c[C], k[N] = {0}, root[R];
  vec ds[S], dcorrected[S], dacting[A], drest[S - N + 1], dw[W], dcp[CP], dnu[Y], dg[G], dp[P], dc[C], dk[N];
  memset(dw, 0, sizeof dw);
  memcpy(s, start, sizeof s);
  gathered(ds, d_start, S, first, count);
  gathered(dg, d_g, G, first, count);
  gathered(dp, d_p, P, first, count);
  of_card_moved(p, cp, dp, dcp);
  for (long i = 0; i < n; ++i) {
    const double *row = rows + i * W, *next = i + 1 < n ? row + W : row;
    if (@RATED@) {
      memset(dw, 0, sizeof dw);
      of_inputs(row, p, cp, c), moving(s, row, p, cp, c, root, 0, k);
      of_inputs_moved(row, p, cp, c, dw, dp, dcp, dc), moving_moved(s, row, p, cp, c, root, k, ds, dw, dp, dcp, dc, dk);
    }
    correct_moved(s, readings + i * Y, g, row, p, k, nu, corrected, acting, rest, ds, dg, dp, dk, dnu, dcorrected, dacting,
                  drest);
    for (int l = 0; l < V && first + l < count; ++l)
      for (int o = 0; o < Y; ++o) out[((first + l) * n + i) * Y + o] = dnu[o][l];
    for (; mark < marks && at[mark] == i; ++mark)
      for (int l = 0; l < V && first + l < count; ++l)
        for (int j = 0; j < S; ++j) d_states[((first + l) * marks + mark) * S + j] = dcorrected[j][l];
    memcpy(s, corrected, N * sizeof *s), memcpy(ds, dcorrected, N * sizeof *ds);
    memcpy(s + N, rest, (S - N) * sizeof *s), memcpy(ds + N, drest, (S - N) * sizeof *ds);
    driving(row, acting, w), driving(next, acting, then);
    for (int l = 0; l < V; ++l) {
      const long place = first + l - arriving;
      for (int j = 0; j < M; ++j) dw[j][l] = place >= 0 && place < late ? d_commands[(place * n + i) * M + j] : 0;
    }
    for (int j = 6; @WINDY@ && j < A; ++j) dw[M + j - 6] = dacting[j];
    step_moved(s, w, then, acting, p, cp, dt, (double (*)[R])(roots + i * 4 * R), ds, dw, dacting, dp, dcp);
  }
}

/* States (rows, N) one sample later, under commands and air (rows, W) and push (rows, D); numbers of all, or of
   `each`. */
void run_steps(long rows, double dt, long each, double *x, const double *w, const double *push, const double *p) {
  double cp[CP], root[4][R];
  for (long i = 0; i < rows; ++i) {
    if (!i || each) of_card(p + i * each * P, cp);
    step(x + i * N, w + i * W, w + i * W, push + i * D, p + i * each * P, cp, dt, root);
  }
}

/* Rates k (N), and their slopes by the states (N, N) and by `count` of what drives them from `from` on (N, count). */
static void slopes_at(const double *x, const double *w, const double *p, const double *cp, int from, int count, double *k,
                      double *by_x, double *by_w) {
  double c[C], root[R];
  vec dx[N], dw[W], dp[P], dcp[CP], dc[C], dk[N];
  of_inputs(w, p, cp, c), moving(x, w, p, cp, c, root, 0, k);
  memset(dp, 0, sizeof dp), memset(dcp, 0, sizeof dcp);
  for (int first = 0; first < N + count; first += V) {
    memset(dx, 0, sizeof dx), memset(dw, 0, sizeof dw);
    for (int l = 0; l < V && first + l < N + count; ++l)
      if (first + l < N) dx[first + l][l] = 1;
      else dw[from + first + l - N][l] = 1;
    of_inputs_moved(w, p, cp, c, dw, dp, dcp, dc);
    moving_moved(x, w, p, cp, c, root, k, dx, dw, dp, dcp, dc, dk);
    for (int i = 0; i < N; ++i)
      for (int l = 0; l < V && first + l < N + count; ++l)
        if (first + l < N) by_x[i * N + first + l] = dk[i][l];
        else by_w[i * count + first + l - N] = dk[i][l];
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
  double cp[CP];
  for (long i = 0; i < rows; ++i) {
    of_card(p + i * P, cp);
    slopes_at(x + i * N, w + i * W, p + i * P, cp, 0, W, k + i * N, by_x + i * N * N, by_w + i * N * W);
  }
}
@BEYOND@
int directions(void) { return V; }
int roots(void) { return R; }
