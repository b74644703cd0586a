
/* ---- predictions, with nothing measured any more ---- */
enum { NORTH = @NORTH@, EAST = @EAST@, NOSE = @HEADING@ };

/* What pushes, gusts and drifts together, and what drives. */
static void driving_ahead(const double *s, const double *row, double *acting, double *w) {
  for (int j = 0; j < A; ++j) acting[j] = s[N + j] + (j < D ? s[N + A + j] : 0);
  driving(row, acting, w);
}

/* A joined state with something added to it, of which horizontal parts turn with the nose. */
static void displaced(double *s, const double *added) {
  const double c = cos(s[NOSE]), si = sin(s[NOSE]);
  const int pairs[2][2] = {{NORTH, EAST}, {N + 6, N + 7}};
  for (int j = 0; j < S; ++j) s[j] += added[j];
  for (int q = 0; q < (@WINDY@ ? 2 : 1); ++q) {
    const int i = pairs[q][0], j = pairs[q][1];
    s[i] += (c - 1) * added[i] - si * added[j], s[j] += si * added[i] + (c - 1) * added[j];
  }
}

/* The same of row `i` of `rows` in every direction. */
static void gathered_row(vec *to, const double *from, long size, long rows, long i, long first, long count) {
  for (long j = 0; j < size; ++j)
    for (int l = 0; l < V; ++l) to[j][l] = first + l < count ? from[((first + l) * rows + i) * size + j] : 0;
}

void run_ahead(long rows, long count, double dt, const long *starts, const double *begin, const double *fade,
               const double *p, const double *series, long kicked, const double *kicks, double *states);
void run_ahead_moved(long rows, double dt, const long *starts, const double *begin, const double *fade, const double *p,
                     const double *series, long count, const double *d_begin, const double *d_fade, const double *d_p,
                     long arriving, long late, long n, const double *d_commands, long marks, const long *steps,
                     double *states, double *d_states);

/* States (rows, count, N) 1, 2, ... samples after the samples `starts`, where the joined ones are `begin` (rows, S);
   those are kicked after every sample (rows, count, S) where `kicked`. Rows of the series (n, W). */
void run_ahead(long rows, long count, double dt, const long *starts, const double *begin, const double *fade,
               const double *p, const double *series, long kicked, const double *kicks, double *states) {
  double s[S], acting[A], w[W], cp[CP], root[4][R];
  of_card(p, cp);
  for (long i = 0; i < rows; ++i) {
    memcpy(s, begin + i * S, sizeof s);
    for (long k = 0; k < count; ++k) {
      driving_ahead(s, series + (starts[i] + k) * W, acting, w);
      step(s, w, w, acting, p, cp, dt, root);
      for (int j = 0; j < A; ++j) s[N + j] *= fade[j];
      if (kicked) displaced(s, kicks + (i * count + k) * S);
      memcpy(states + (i * count + k) * N, s, N * sizeof *s);
    }
  }
}

/* The same after `steps` samples (rows, marks, N), and their slopes (count, rows, marks, N) along directions of what they
   begin with (count, rows, S), of fade (count, A), of the numbers (count, P) and of commands (late, n, M), as in
   `run_moved`. */
void run_ahead_moved(long rows, double dt, const long *starts, const double *begin, const double *fade, const double *p,
                     const double *series, long count, const double *d_begin, const double *d_fade, const double *d_p,
                     long arriving, long late, long n, const double *d_commands, long marks, const long *steps,
                     double *states, double *d_states) {
  double s[S], ahead[N], acting[A], w[W], cp[CP], root[4][R];
  vec ds[S], dacting[A], dw[W], dp[P], dcp[CP], dfade[A];
  memset(dw, 0, sizeof dw);
  of_card(p, cp);
  for (long first = 0; first < count; first += V) {
    gathered(dp, d_p, P, first, count), gathered(dfade, d_fade, A, first, count);
    of_card_moved(p, cp, dp, dcp);
    for (long i = 0; i < rows; ++i) {
      memcpy(s, begin + i * S, sizeof s);
      gathered_row(ds, d_begin, S, rows, i, first, count);
      for (long k = 0, mark = 0; mark < marks; ++k) {
        driving_ahead(s, series + (starts[i] + k) * W, acting, w);
        for (int j = 0; j < A; ++j) dacting[j] = j < D ? ds[N + j] + ds[N + A + j] : ds[N + j];
        for (int l = 0; l < V; ++l) {
          const long place = first + l - arriving;
          for (int j = 0; j < M; ++j)
            dw[j][l] = place >= 0 && place < late ? d_commands[(place * n + starts[i] + k) * M + j] : 0;
        }
        for (int j = 6; @WINDY@ && j < A; ++j) dw[M + j - 6] = dacting[j];
        if (@ROOTED@) memcpy(ahead, s, sizeof ahead), step(ahead, w, w, acting, p, cp, dt, root);
        step_moved(s, w, w, acting, p, cp, dt, root, ds, dw, dacting, dp, dcp);
        for (int j = 0; j < A; ++j) ds[N + j] = fade[j] * ds[N + j] + dfade[j] * s[N + j], s[N + j] *= fade[j];
        if (steps[mark] != k + 1) continue;
        memcpy(states + (i * marks + mark) * N, s, N * sizeof *s);
        for (int l = 0; l < V && first + l < count; ++l)
          for (int j = 0; j < N; ++j) d_states[(((first + l) * rows + i) * marks + mark) * N + j] = ds[j][l];
        ++mark;
      }
    }
  }
}
