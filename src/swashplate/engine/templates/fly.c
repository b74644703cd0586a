/* Flights of many vehicles with the same equations, LANES of them side by side: every number of a step is an array over
   the lanes. Without a law the inputs come from a table; with one they are decided every so many steps, may be added to,
   are cut to whole steps and to their limits, and act late. */
#include <math.h>
#include <string.h>

typedef @REAL@ real;
typedef @INTEGER@ whole;
enum {
  LANES = @LANES@, N = @STATES@, SEEN = @SEEN@, W = @DRIVING@, M = W - 4, P = @NUMBERS@, R = @ROOTS@, CP = @OF_CARD_COUNT@,
  C = @OF_INPUTS_COUNT@, REFERENCES = @REFERENCES@, MEASURED = @MEASURED@, MEMORY = @MEMORY@, DRAWS = @DRAWS@,
  TOLD = SEEN + 4 + DRAWS
};
#define CONTROLLED @CONTROLLED@
#define FELT @FELT@
#define QUATERNION @QUATERNION@
typedef real lanes[LANES] __attribute__((aligned(@ALIGNED@)));

/* Tables have one column for all vehicles or one each (..._wide says which). A row of `rows`, `asked` and `added` holds
   for `hold` steps; `held` 0: rows change linearly. Samples are kept every `keep` steps, the law decides every `every`
   steps. sent: room for depth rows of inputs. limits: lowest, highest, whole step (0: none) of each input. */
typedef struct {
  long samples, keep, hold, held, every, depth, first, last, total, rows_wide, numbers_wide, asked_wide, added_wide;
  double dt;
  const real *start, *numbers, *rows, *asked, *added, *limits, *before, *memory, *draws, *noise;
  const long *late, *place;
  real *sent, *states, *inputs;
} Flight;

@TURNED@#define sine(x) turned(x, 0)
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

#if QUATERNION
static void angles_of(const real *q, real *angles) {
@ANGLES@}
#endif

#if FELT
static void felt_at(const real *x, const real *w, const real *p, real *felt) {
  (void)x, (void)w, (void)p;
@FORCE@}
#endif

@LAW@

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

static void stored(real *to, lanes *from, int rows, const Flight *f, long first) {
  for (int i = 0; i < rows; ++i)
    for (int l = 0; l < LANES && first + l < f->last; ++l) to[i * f->total + first + l] = from[i][l];
}

/* What is shown of a state: with a quaternion, roll, pitch and yaw, whole turns counted on from the sample before. */
static void see(lanes *x, lanes *seen) {
#if QUATERNION
  for (int l = 0; l < LANES; ++l) {
    const real q[4] = {x[6][l], x[7][l], x[8][l], x[9][l]}, full = 2 * @PI@;
    real angles[3];
    angles_of(q, angles);
    for (int i = 0; i < 6; ++i) seen[i][l] = x[i][l];
    for (int i = 0; i < 3; ++i)
      seen[6 + i][l] = i == 1 ? angles[1] : seen[6 + i][l] + (real)remainder(angles[i] - seen[6 + i][l], full);
    for (int i = 9; i < SEEN; ++i) seen[i][l] = x[i + 1][l];
  }
#else
  memcpy(seen, x, SEEN * sizeof *seen);
#endif
}

#define STAGE(at, j, known) moving(at, w[j], p, cp, c[j], root, known, k)
#define EACH for (int i = 0; i < N; ++i) for (int l = 0; l < LANES; ++l)

/* Runge and Kutta's classical step of order 4; w and c at its begin, middle and end. */
static void stepped(lanes *restrict x, lanes (*w)[W], lanes (*c)[C], lanes *p, lanes *cp, int held, real dt) {
  lanes at[N], sum[N], k[N], root[R];
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

#if CONTROLLED
static real cut(real v, real low, real high, real unit) {
  if (unit > 0) v = unit * (real)nearbyint(v / unit);
  return v < low ? low : v > high ? high : v;
}

/* What the law of every lane commands now. */
static void decided(const Flight *f, long k, long first, lanes *x, lanes *seen, lanes *w, lanes *p,
                    real (*memory)[MEMORY + 1], lanes *command) {
  const long turn = k / f->every, row = k / f->hold;
  for (int l = 0; l < LANES; ++l) {
    const long who = first + l < f->last ? first + l : f->last - 1;
    real told[TOLD], measured[MEASURED + 1], asked[REFERENCES];
    for (int i = 0; i < SEEN; ++i) told[i] = seen[i][l];
    if (f->noise) for (int i = 0; i < SEEN; ++i) told[i] += f->noise[(turn * SEEN + i) * f->total + who];
#if FELT
    real xs[N], ws[W], ps[P];
    for (int i = 0; i < N; ++i) xs[i] = x[i][l];
    for (int i = 0; i < W; ++i) ws[i] = w[i][l];
    for (int i = 0; i < P; ++i) ps[i] = p[i][l];
    felt_at(xs, ws, ps, told + SEEN);
#else
    (void)x, (void)p;
    for (int i = 0; i < 3; ++i) told[SEEN + i] = 0;
#endif
    told[SEEN + 3] = w[W - 1][l];
    for (int i = 0; i < DRAWS; ++i) told[SEEN + 4 + i] = f->draws[(turn * DRAWS + i) * f->total + who];
    for (int i = 0; i < MEASURED; ++i) measured[i] = told[f->place[i]];
    for (int i = 0; i < REFERENCES; ++i)
      asked[i] = f->asked[(row * REFERENCES + i) * f->asked_wide + (f->asked_wide == 1 ? 0 : who)];
    law(memory[l], measured, asked, command, l);
  }
}
#endif

/* How far the begin, middle or end (j) of a step is from one row of a table to the next. */
static inline __attribute__((unused)) real share(long step, int j, long hold) {
  return ((real)step + (real)j / 2) / (real)hold;
}

static void flown(const Flight *f, long first) {
  lanes x[N], seen[SEEN], w[3][W], p[P], cp[CP], c[3][C];
  gathered(x, f->start, N, f->total, first, f->last);
  gathered(p, f->numbers, P, f->numbers_wide, first, f->last);
  memset(w, 0, sizeof w);
#if QUATERNION
  gathered(seen, f->start + N * f->total, SEEN, f->total, first, f->last);
#endif
#if CONTROLLED
  real memory[LANES][MEMORY + 1];
  lanes command[M], *sent = (lanes *)f->sent;
  long newest = 0;
  for (int l = 0; l < LANES; ++l)
    for (int i = 0; i < MEMORY; ++i)
      memory[l][i] = f->memory[i * f->total + (first + l < f->last ? first + l : f->last - 1)];
  for (long ago = 0; ago < f->depth; ++ago) gathered(sent + ago * M, f->before, M, 1, first, f->last);
  gathered(w[0], f->before, M, 1, first, f->last);
#endif
  of_card(p, cp);
  for (long k = 0; k < f->samples; ++k) {
    const long row = k / f->hold, kept = k / f->keep;
    see(x, seen);
    if (k % f->keep == 0) stored(f->states + kept * SEEN * f->total, seen, SEEN, f, first);
#if CONTROLLED
    gathered(w[0] + M, f->rows + row * 4 * f->rows_wide, 4, f->rows_wide, first, f->last);
    if (k % f->every == 0) decided(f, k, first, x, seen, w[0], p, memory, command);
    newest = (newest + f->depth - 1) % f->depth;
    for (int j = 0; j < M; ++j)
      for (int l = 0; l < LANES; ++l) {
        const long who = first + l < f->last ? first + l : f->last - 1;
        const real more = f->added[(row * M + j) * f->added_wide + (f->added_wide == 1 ? 0 : who)];
        sent[newest * M + j][l] = cut(command[j][l] + more, f->limits[j], f->limits[M + j], f->limits[2 * M + j]);
        w[0][j][l] = sent[(newest + f->late[j * f->total + who]) % f->depth * M + j][l];
      }
    if (k % f->keep == 0) stored(f->inputs + kept * M * f->total, w[0], M, f, first);
#else
    if (f->held) {
      if (k % f->hold == 0) gathered(w[0], f->rows + row * W * f->rows_wide, W, f->rows_wide, first, f->last);
    } else if (k + 1 < f->samples) {
      lanes ends[2][W];
      for (int e = 0; e < 2; ++e)
        gathered(ends[e], f->rows + (row + e) * W * f->rows_wide, W, f->rows_wide, first, f->last);
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < W; ++i)
          for (int l = 0; l < LANES; ++l)
            w[j][i][l] = ends[0][i][l] + share(k % f->hold, j, f->hold) * (ends[1][i][l] - ends[0][i][l]);
    }
#endif
    if (k + 1 == f->samples) break;
    if (CONTROLLED || !f->held || k % f->hold == 0)
      for (int j = 0; j < (f->held ? 1 : 3); ++j) of_inputs(w[j], p, cp, c[j]);
    stepped(x, w, c, p, cp, (int)f->held, (real)f->dt);
  }
}

void fly(const Flight *f);

/* Vehicles first to last of total. */
void fly(const Flight *f) {
  for (long first = f->first; first < f->last; first += LANES) flown(f, first);
}
