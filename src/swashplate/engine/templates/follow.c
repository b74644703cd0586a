
/* ---- a gain that follows what is flown, for wind ---- */
enum { L = S - N, SV = (S + V - 1) / V, NV = (N + V - 1) / V, U = @AHEAD@, H = @HEADING@,
       Q = @NUISANCES@, CA = @STILL_AIR@ };
static const double unexcited[N] = {@UNEXCITED@};
static const double away[4] = {@AWAY@}, shares[4] = {@SHARES@};

/* Of the rates what no wind moves, and the rest. */
static void in_still_air(const double *x, const double *w, const double *p, const double *cp, double *ca) {
  (void)x, (void)w, (void)p, (void)cp, (void)ca;
@IN_STILL_AIR@}

static void in_wind(const double *x, const double *w, const double *p, const double *cp, const double *ca, double *root,
                    int known, double *k) {
  (void)x, (void)w, (void)p, (void)cp, (void)ca, (void)root, (void)known;
@IN_WIND@}

/* to += the sum of a[k] rows[k], all so many vectors wide: up to four at a time, so that sums stay in registers. */
static inline void gather(vec *to, const double *a, const vec *rows, int count, int width) {
  int v = 0;
  for (; v + 4 <= width; v += 4) {
    vec s0 = to[v], s1 = to[v + 1], s2 = to[v + 2], s3 = to[v + 3];
    for (int k = 0; k < count; ++k) {
      const vec *row = rows + k * width + v;
      if (a[k] != 0) s0 += a[k] * row[0], s1 += a[k] * row[1], s2 += a[k] * row[2], s3 += a[k] * row[3];
    }
    to[v] = s0, to[v + 1] = s1, to[v + 2] = s2, to[v + 3] = s3;
  }
  for (; v + 3 <= width; v += 3) {
    vec s0 = to[v], s1 = to[v + 1], s2 = to[v + 2];
    for (int k = 0; k < count; ++k) {
      const vec *row = rows + k * width + v;
      if (a[k] != 0) s0 += a[k] * row[0], s1 += a[k] * row[1], s2 += a[k] * row[2];
    }
    to[v] = s0, to[v + 1] = s1, to[v + 2] = s2;
  }
  for (; v < width; ++v) {
    vec sum = to[v];
    for (int k = 0; k < count; ++k)
      if (a[k] != 0) sum += a[k] * rows[k * width + v];
    to[v] = sum;
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
    for (int j = 0; j < S; ++j)
      if ((by_s[o * S + j] *= read) != 0) gather(seen[o], by_s + o * S + j, P[j], 1, SV);
  }
  for (int q = 0; q < Y; ++q) {
    for (int o = 0; o < Y; ++o) covariance[o * Y + q] = o == q ? sensors[o] : 0;
    for (int j = 0; j < S; ++j)
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
    gather(P[i], back, seen[0], Y, SV);
  }
}

/* The variance of a' x, where a has these entries at these places. */
static double variance(vec P[S][SV], const int *at, const double *a, int count) {
  double sum = 0;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) sum += a[i] * a[j] * P[at[i]][at[j] / V][at[j] % V];
  return sum;
}

/* One sample later, averaged over what is not known of the air speed. fade (A), white (6), added (L). */
static void predicted(double *s, vec P[S][SV], const double *drives, double dt, const double *fade,
                      const double *white, const double *added, const double *p, const double *cp) {
  const double co = cos(s[H]), si = sin(s[H]), north[2] = {co, -si}, east[2] = {si, co};
  double acting[A], w[W], here[N], there[N], apart[N] = {0}, by_x[N * N], by_wind[N * 2], more[N][2], root[4][R], ca[CA];
  vec a[N][NV], h[N][NV], f[N][NV], f_turned[N][NV], g_turned[A][NV], both[A][SV], led[N][SV], scale[SV];
  double g[N][A];
  for (int j = 0; j < A; ++j) acting[j] = s[N + j] + (j < 6 ? s[N + A + j] : 0);
  driving(drives, acting, w);
  slopes_at(s, w, p, cp, M, 2, here, by_x, by_wind);
  in_still_air(s, w, p, cp, ca);
  memset(more, 0, sizeof more);
  for (int i = 0; i < 2; ++i) {
    const int at[3] = {U + i, N + 6, N + 7};
    const double entries[3] = {1, -north[i], -east[i]}, sure = @SURE@;
    const double known = variance(P, at, entries, 3), spread = sqrt(known > sure ? known : sure);
    for (int k = 0; k < 4; ++k) {
      double beside[W];
      memcpy(beside, w, sizeof beside);
      beside[M] -= away[k] * spread * north[i], beside[M + 1] -= away[k] * spread * east[i];
      in_wind(s, beside, p, cp, ca, root[0], 0, there);
      for (int j = 0; j < N; ++j) {
        apart[j] += shares[k] * (there[j] - here[j]);
        more[j][i] += shares[k] * away[k] / spread * there[j];
      }
    }
  }
  memset(a, 0, sizeof a), memset(g, 0, sizeof g);
  for (int i = 0; i < N; ++i) {
    for (int k = 0; k < 2; ++k) more[i][k] += by_wind[i * 2] * north[k] + by_wind[i * 2 + 1] * east[k];
    by_x[i * N + U] += more[i][0], by_x[i * N + U + 1] += more[i][1];
    by_wind[i * 2] -= more[i][0] * north[0] + more[i][1] * north[1];
    by_wind[i * 2 + 1] -= more[i][0] * east[0] + more[i][1] * east[1];
    for (int j = 0; j < N; ++j) a[i][j / V][j % V] = by_x[i * N + j];
  }
  /* f = e^(a dt) = 1 + dt a h, to fourth order; what is held acts by dt h. */
  for (int i = 0; i < N; ++i)
    for (int v = 0; v < NV; ++v) h[i][v] = 0.25 * dt * a[i][v];
  for (int order = 3; order > 0; --order) {
    for (int i = 0; i < N; ++i) h[i][i / V][i % V] += 1;
    for (int i = 0; i < N; ++i) {
      double row[N];
      for (int k = 0; k < N; ++k) row[k] = dt / order * by_x[i * N + k];
      memset(f[i], 0, sizeof f[i]);
      gather(f[i], row, h[0], N, NV);
    }
    if (order > 1) memcpy(h, f, sizeof h);
  }
  for (int i = 0; i < N; ++i) {
    f[i][i / V][i % V] += 1;
    for (int j = 0; j < 6; ++j) g[i][j] = dt * h[i][pushed[j] / V][pushed[j] % V];
    for (int k = 0; k < N; ++k)
      for (int j = 0; j < 2; ++j) g[i][6 + j] += dt * h[i][k / V][k % V] * by_wind[k * 2 + j];
  }
  memset(f_turned, 0, sizeof f_turned), memset(g_turned, 0, sizeof g_turned);
  for (int i = 0; i < N; ++i) {
    for (int k = 0; k < N; ++k) f_turned[k][i / V][i % V] = f[i][k / V][k % V];
    for (int j = 0; j < A; ++j) g_turned[j][i / V][i % V] = g[i][j];
  }
  /* led: the rows of the states, of all of them; disturbances go on by themselves. */
  for (int j = 0; j < A; ++j)
    for (int v = 0; v < SV; ++v) both[j][v] = j < 6 ? P[N + j][v] + P[N + A + j][v] : P[N + j][v];
  memset(led, 0, sizeof led);
  for (int i = 0; i < N; ++i) {
    gather(led[i], (const double *)f[i], P[0], N, SV);
    gather(led[i], g[i], both[0], A, SV);
  }
  for (int j = 0; j < SV * V; ++j) scale[j / V][j % V] = j >= N && j < N + A ? fade[j - N] : 1;
  for (int i = 0; i < S; ++i) {
    vec row[SV];
    for (int v = 0; v < SV; ++v) row[v] = i < N ? led[i][v] : P[i][v];
    if (i >= N && i < N + A)
      for (int v = 0; v < SV; ++v) row[v] *= fade[i - N];
    if (i < N) {
      vec state[NV];
      memset(state, 0, sizeof state);
      const double *mine = (const double *)led[i];
      double pushes[A];
      for (int j = 0; j < A; ++j) pushes[j] = mine[N + j] + (j < 6 ? mine[N + A + j] + white[j] * g[i][j] : 0);
      gather(state, mine, f_turned[0], N, NV);
      gather(state, pushes, g_turned[0], A, NV);
      state[i / V][i % V] += unexcited[i];
      for (int j = 0; j < N; ++j) row[j / V][j % V] = state[j / V][j % V];
    }
    for (int v = 0; v < SV; ++v) row[v] *= scale[v];
    memcpy(P[i], row, sizeof row);
  }
  for (int i = 0; i < L; ++i) P[N + i][(N + i) / V][(N + i) % V] += added[i];
  for (int i = 0; i < S; ++i)
    for (int j = 0; j < i; ++j) {
      const double one = P[i][j / V][j % V], other = P[j][i / V][i % V], even = 0.5 * (one + other);
      P[i][j / V][j % V] = P[j][i / V][i % V] = i >= N && j < N ? other : even;
    }
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
