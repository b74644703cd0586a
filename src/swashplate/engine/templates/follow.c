
/* ---- a gain that follows what is flown, for wind ---- */
enum { L = S - N, SV = (S + V - 1) / V, NV = (N + V - 1) / V, U = @AHEAD@, H = @HEADING@,
       Q = @NUISANCES@, CA = @STILL_AIR@, LED = @LED@, FROM = @FROM@, TILL = @TILL@ };
static const double unexcited[N] = {@UNEXCITED@};
/* States on which rates depend, between FROM and TILL. */
static const int leading[LED] = {@LEADING@};
static const double away[4] = {@AWAY@}, shares[4] = {@SHARES@};

/* Of the rates what no wind moves, and the rest. */
static void in_still_air(const double *x, const double *w, const double *p, const double *cp, double *ca) {
  (void)x, (void)w, (void)p, (void)cp, (void)ca;
@IN_STILL_AIR@}

static void in_wind(const double *x, const double *w, const double *p, const double *cp, const double *ca, double *root,
                    int known, double *k) {
  (void)x, (void)w, (void)p, (void)cp, (void)ca, (void)root, (void)known;
@IN_WIND@}

/* to += the sum of a[k] rows[k], numbers `apart` from each other and rows so many vectors, of which `width` count: up to
   four at a time, so that sums stay in registers. few: most of the numbers are zero. */
static inline __attribute__((always_inline)) void gather(vec *to, const double *a, int apart, int few, const vec *rows,
                                                         int stride, int count, int width) {
  int v = 0;
  for (; v + 4 <= width; v += 4) {
    vec s0 = to[v], s1 = to[v + 1], s2 = to[v + 2], s3 = to[v + 3];
#pragma GCC unroll 4
    for (int k = 0; k < count; ++k) {
      const vec *row = rows + k * stride + v;
      const double by = a[k * apart];
      if (!few || by != 0) s0 += by * row[0], s1 += by * row[1], s2 += by * row[2], s3 += by * row[3];
    }
    to[v] = s0, to[v + 1] = s1, to[v + 2] = s2, to[v + 3] = s3;
  }
  for (; v + 3 <= width; v += 3) {
    vec s0 = to[v], s1 = to[v + 1], s2 = to[v + 2];
#pragma GCC unroll 4
    for (int k = 0; k < count; ++k) {
      const vec *row = rows + k * stride + v;
      const double by = a[k * apart];
      if (!few || by != 0) s0 += by * row[0], s1 += by * row[1], s2 += by * row[2];
    }
    to[v] = s0, to[v + 1] = s1, to[v + 2] = s2;
  }
  for (; v + 2 <= width; v += 2) {
    vec s0 = to[v], s1 = to[v + 1];
#pragma GCC unroll 4
    for (int k = 0; k < count; ++k) {
      const vec *row = rows + k * stride + v;
      const double by = a[k * apart];
      if (!few || by != 0) s0 += by * row[0], s1 += by * row[1];
    }
    to[v] = s0, to[v + 1] = s1;
  }
  for (; v + 1 <= width; v += 1) {
    vec s0 = to[v];
#pragma GCC unroll 4
    for (int k = 0; k < count; ++k) {
      const vec *row = rows + k * stride + v;
      const double by = a[k * apart];
      if (!few || by != 0) s0 += by * row[0];
    }
    to[v] = s0;
  }
}

/* What a state s shows (Y), and its slopes (Y, S). */
static void sense(const double *s, const double *g, double *y, double *by_s) {
  (void)g;
@SENSE@}

/* The state and its covariance after a reading (no number: none), the innovation nu (Y) and its covariance (Y, Y). */
static void corrected(double *s, vec P[S][SV], const double *y, const double *nuisance, const double *sensors, double *nu,
                      double *covariance) {
  double expected[Y], by_s[Y * S], low[Y][Y], left[Y];
  vec seen[Y][SV];
  memset(by_s, 0, sizeof by_s), memset(seen, 0, sizeof seen);
  sense(s, nuisance, expected, by_s);
  for (int o = 0; o < Y; ++o) {
    const int read = y[o] == y[o];
    nu[o] = read ? y[o] - expected[o] : 0;
    for (int j = 0; j < N; ++j)
      if ((by_s[o * S + j] *= read) != 0) gather(seen[o], by_s + o * S + j, 1, 0, P[j], SV, 1, SV);
  }
  for (int q = 0; q < Y; ++q) {
    for (int o = 0; o < Y; ++o) covariance[o * Y + q] = o == q ? sensors[o] : 0;
    for (int j = 0; j < N; ++j)
      if (by_s[q * S + j] != 0)
        for (int o = 0; o < Y; ++o) covariance[o * Y + q] += seen[o][j / V][j % V] * by_s[q * S + j];
  }
  for (int o = 0; o < Y; ++o) {  /* Cholesky's factor, and what it makes of the rest */
    left[o] = nu[o];
    for (int q = 0; q < o; ++q) {
      double sum = covariance[o * Y + q];
      for (int r = 0; r < q; ++r) sum -= low[o][r] * low[q][r];
      low[o][q] = sum / low[q][q];
      left[o] -= low[o][q] * left[q];
      for (int v = 0; v < SV; ++v) seen[o][v] -= low[o][q] * seen[q][v];
    }
    double pivot = covariance[o * Y + o];
    for (int r = 0; r < o; ++r) pivot -= low[o][r] * low[o][r];
    low[o][o] = sqrt(pivot), left[o] /= low[o][o];
    for (int v = 0; v < SV; ++v) seen[o][v] *= 1 / low[o][o];
  }
  for (int i = 0; i < S; ++i) {
    double back[Y];
    for (int o = 0; o < Y; ++o) back[o] = -seen[o][i / V][i % V], s[i] -= back[o] * left[o];
    gather(P[i], back, 1, 0, seen[0], SV, Y, SV);
  }
}

/* The variance of a' x, where a has these entries at these places. */
static double variance(vec P[S][SV], const int *at, const double *a, int count) {
  double sum = 0;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) sum += a[i] * a[j] * P[at[i]][at[j] / V][at[j] % V];
  return sum;
}

/* Rates, and dt times their slopes by every state (a row each): those by the air speed ahead and to the right without
   what the air itself does, since the air goes along. */
static void slopes_in_moving_air(const double *s, const double *w, const double *p, const double *cp, double dt,
                                 const double *north, const double *east, double *k, vec by_x[N][NV]) {
  static const vec dp[P], dcp[CP];
  double c[C], root[R];
  vec dx[N], dw[W], dc[C], dk[N];
  of_inputs(w, p, cp, c);
  if (@ROOTED@) moving(s, w, p, cp, c, root, 0, k);
  memset(by_x, 0, N * sizeof *by_x);
  for (int first = 0; first < LED; first += V) {
    memset(dx, 0, sizeof dx), memset(dw, 0, sizeof dw);
    for (int l = 0; l < V && first + l < LED; ++l) {
      const int at = leading[first + l];
      dx[at][l] = 1;
      if (at == U || at == U + 1) dw[M][l] = north[at - U], dw[M + 1][l] = east[at - U];
    }
    of_inputs_moved(w, p, cp, c, dw, dp, dcp, dc);
    moving_moved(s, w, p, cp, c, root, k, dx, dw, dp, dcp, dc, dk);
    for (int l = 0; l < V && first + l < LED; ++l) {
      double *row = (double *)by_x[leading[first + l]];
      for (int i = 0; i < N; ++i) row[i] = dt * dk[i][l];
    }
  }
}

/* One sample later, averaged over what is not known of the air speed. fade (A), white (6), added (L). */
static void predicted(double *s, vec P[S][SV], const double *drives, double dt, const double *fade,
                      const double *white, const double *added, const double *p, const double *cp) {
  const double co = cos(s[H]), si = sin(s[H]), north[2] = {co, -si}, east[2] = {si, co};
  double acting[A], w[W], here[N], there[N], apart[N] = {0}, by_air[2][N], by_wind[2][N], root[4][R], ca[CA];
  vec a[N][NV], f[N][NV], h[N][NV], g[A][NV], both[A][SV], led[N][SV], scale[SV];
  bits mixed;
  for (int j = 0; j < A; ++j) acting[j] = s[N + j] + (j < 6 ? s[N + A + j] : 0);
  driving(drives, acting, w);
  slopes_in_moving_air(s, w, p, cp, dt, north, east, here, a);
  in_still_air(s, w, p, cp, ca);
  memset(by_air, 0, sizeof by_air);
  for (int i = 0; i < 2; ++i) {
    const int at[3] = {U + i, N + 6, N + 7};
    const double entries[3] = {1, -north[i], -east[i]}, sure = @SURE@;
    const double known = variance(P, at, entries, 3), spread = sqrt(known > sure ? known : sure);
    for (int k = 0; k < 4; ++k) {
      const double share = shares[k], slope = dt * shares[k] * away[k] / spread;
      double beside[W];
      memcpy(beside, w, sizeof beside);
      beside[M] -= away[k] * spread * north[i], beside[M + 1] -= away[k] * spread * east[i];
      in_wind(s, beside, p, cp, ca, root[0], 0, there);
      for (int j = 0; j < N; ++j) apart[j] += share * (there[j] - here[j]), by_air[i][j] += slope * there[j];
    }
  }
  for (int i = 0; i < 2; ++i) {
    double *row = (double *)a[U + i];
    for (int j = 0; j < N; ++j) {
      row[j] += by_air[i][j];
      by_wind[i][j] = -(i ? by_air[0][j] * east[0] + by_air[1][j] * east[1]
                          : by_air[0][j] * north[0] + by_air[1][j] * north[1]);
    }
  }
  /* Transposed, e^(a dt) = 1 + f, f = a h, to fourth order; what is held acts by h. */
  memset(f, 0, sizeof f), memset(h, 0, sizeof h), memset(g, 0, sizeof g);
  for (int i = 0; i < N; ++i) h[i][i / V][i % V] = 1;
  for (int j = 0; j < LED; ++j)
    for (int v = 0; v < NV; ++v) h[leading[j]][v] += 0.25 * a[leading[j]][v];
  for (int order = 3; order > 0; --order) {
    for (int j = 0; j < LED; ++j) {
      const int i = leading[j];
      memset(f[i], 0, sizeof f[i]);
      gather(f[i], (const double *)a[i], 1, 1, h[0], NV, N, NV);
    }
    for (int j = 0; order > 1 && j < LED; ++j) {
      const int i = leading[j];
      for (int v = 0; v < NV; ++v) h[i][v] = 1.0 / order * f[i][v];
      h[i][i / V][i % V] += 1;
    }
  }
  for (int j = 0; j < 6; ++j)
    for (int v = 0; v < NV; ++v) g[j][v] = dt * h[pushed[j]][v];
  for (int j = 0; j < 2; ++j) gather(g[6 + j], by_wind[j], 1, 0, h[0], NV, N, NV);
  /* led: the rows of the states, of all of them; disturbances go on by themselves. */
  for (int j = 0; j < A; ++j)
    for (int v = 0; v < SV; ++v) both[j][v] = j < 6 ? P[N + j][v] + P[N + A + j][v] : P[N + j][v];
  for (int i = 0; i < N; ++i) {
    memcpy(led[i], P[i], sizeof led[i]);
    gather(led[i], (const double *)f[FROM] + i, NV * V, 0, P[FROM], SV, TILL - FROM, SV);
    gather(led[i], (const double *)g + i, NV * V, 0, both[0], SV, A, SV);
  }
  for (int l = 0; l < V; ++l) mixed[l] = l < N % V ? -1 : 0;
  for (int j = 0; j < SV * V; ++j) scale[j / V][j % V] = j >= N && j < N + A ? fade[j - N] : 1;
  for (int i = 0; i < N; ++i) {
    const int from = i / V;
    const double *mine = (const double *)led[i];
    double pushes[A];
    vec state[NV];
    for (int j = 0; j < A; ++j)
      pushes[j] = mine[N + j] + (j < 6 ? mine[N + A + j] + white[j] * ((const double *)g[j])[i] : 0);
    memcpy(state, led[i], sizeof state);
    gather(state + from, mine + FROM, 1, 0, f[FROM] + from, NV, TILL - FROM, NV - from);
    gather(state + from, pushes, 1, 0, g[0] + from, NV, A, NV - from);
    state[from][i % V] += unexcited[i];
    for (int v = N / V; v < SV; ++v) P[i][v] = led[i][v] * scale[v];
    for (int v = from; v < N / V; ++v) P[i][v] = state[v];
    if (N % V) P[i][N / V] = (vec)(((bits)state[N / V] & mixed) | ((bits)P[i][N / V] & ~mixed));
  }
  for (int i = N; i < S; ++i) {
    const double kept = i < N + A ? fade[i - N] : 1;
    for (int v = N / V; v < SV; ++v) P[i][v] *= kept * scale[v];
    P[i][i / V][i % V] += added[i - N];
  }
  for (int j = 0; j < N; ++j)
    for (int i = j + 1; i < S; ++i) ((double *)P[i])[j] = ((const double *)P[j])[i];
  step(s, w, w, acting, p, cp, dt, root);
  for (int i = 0; i < N; ++i) s[i] += dt * apart[i];
  for (int j = 0; j < A; ++j) s[N + j] *= fade[j];
}

void run_following(long rows, long n, double dt, const double *starts, const double *covariances, const double *nuisance,
                   const double *fade, const double *white, const double *added,
                   const double *sensors, const double *p, const double *readings, const double *drives,
                   double *innovations, double *spreads, double *states);

/* Rows of filters of one record: innovations (rows, n, Y), their covariances (rows, n, Y, Y), corrected states. */
void run_following(long rows, long n, double dt, const double *starts, const double *covariances, const double *nuisance,
                   const double *fade, const double *white, const double *added,
                   const double *sensors, const double *p, const double *readings, const double *drives,
                   double *innovations, double *spreads, double *states) {
  for (long r = 0; r < rows; ++r) {
    double s[S], cp[CP];
    vec covariance[S][SV];
    memset(covariance, 0, sizeof covariance);
    memcpy(s, starts + r * S, sizeof s);
    for (int i = 0; i < S; ++i)
      for (int j = 0; j < S; ++j) covariance[i][j / V][j % V] = covariances[(r * S + i) * S + j];
    of_card(p + r * P, cp);
    for (long t = 0; t < n; ++t) {
      const long at = r * n + t;
      corrected(s, covariance, readings + t * Y, nuisance + r * Q, sensors + r * Y, innovations + at * Y,
                spreads + at * Y * Y);
      memcpy(states + at * S, s, sizeof s);
      predicted(s, covariance, drives + at * W, dt, fade + r * A, white + r * 6,
                added + r * L, p + r * P, cp);
    }
  }
}
