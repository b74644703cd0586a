
/* One period of a controller for the live page in one file: the law on what sensors read, its commands as late as they act,
   and the steps of physics until it decides again. Numbers are exchanged through the arrays below. */
@FLIGHT@
@TRACED@
enum {
  INPUTS = W - 4, PERIOD = @PERIOD@, DEPTH = @DEPTH@, CARRIED = @CARRIED@, ASKED = @ASKED@, GAINS = @GAINS@,
  DRAWN = @DRAWN@, CRAFTS = @CRAFTS@, HEARD = SEEN + 4 + DRAWN, BODY = @BODY@, PLACED = @PLACED@
};
typedef struct { double x[SEEN], past[DEPTH][INPUTS], carried[CARRIED + 1], inputs[INPUTS], read[SEEN]; } Craft;
static Craft crafts[CRAFTS];
static double card[CRAFTS][P], sensors[CRAFTS][PLACED + BODY], asked[ASKED], gains[GAINS + 1], around[4], added[INPUTS],
  limits[2][INPUTS], draws[DRAWN + BODY];
static int back[CRAFTS][PERIOD][INPUTS];

/* Where an array is: 0 to 6 of a craft (state, past commands, what the law carries, inputs, its card, its sensors, what
   they read), then those that all share. */
double *buffer(int which, int craft) {
  Craft *it = crafts + craft;
  double *own[] = {it->x, it->past[0], it->carried, it->inputs, card[craft], sensors[craft], it->read};
  double *all[] = {asked, gains, around, added, limits[0], draws};
  return which < 7 ? own[which] : all[which - 7];
}
int *delays(int craft) { return back[craft][0]; }

static void tracked(const double *x, const double *s, double *row) {
@SENSORS@}

/* What the sensors of a craft read where it is, without their noise. */
void sense(int which) {
  Craft *craft = crafts + which;
  int placed = 0;
  for (int j = 0; j < PLACED; ++j) placed |= sensors[which][j] != 0;
  memcpy(craft->read, craft->x, sizeof craft->x);
  if (placed) tracked(craft->x, sensors[which], craft->read);
}

#if QUATERNION
static void placed(const double *x, double *row) {
@PLACE@}
#endif

#if @FEELS@
static void felt_by(const double *x, const double *w, const double *p, double *felt) {
  (void)x, (void)w, (void)p;
@FORCE@}
#endif

static void decided_by(const double *carried, const double *heard, double *told) {
  double work[@LONGEST@];
  int whole[@WHOLES@];
  const double *arguments[@ARGUMENTS@] = {carried, heard, asked, gains};
  double *results[@RESULTS@] = {told};
  @NAME@(arguments, results, whole, work, 0);
}

static double limited(double v, double low, double high) { return v < low ? low : v > high ? high : v; }

void frame(int which) {
  Craft *craft = crafts + which;
  double heard[HEARD], rows[PERIOD + 1][W], start[N + SEEN], states[2][SEEN], told[CARRIED + INPUTS];
  memset(heard, 0, sizeof heard);
  sense(which);
  memcpy(heard, craft->read, sizeof craft->read);
  for (int j = 0; j < BODY; ++j) heard[j] += sensors[which][PLACED + j] * draws[DRAWN + j];
#if @FEELS@
  double acting[W];
  for (int j = 0; j < INPUTS; ++j) acting[j] = craft->past[DEPTH - 1 - back[which][PERIOD - 1][j]][j];
  memcpy(acting + INPUTS, around, sizeof around);
  felt_by(craft->x, acting, card[which], heard + SEEN);
#endif
  heard[SEEN + 3] = around[3];
  memcpy(heard + SEEN + 4, draws, DRAWN * sizeof *draws);
  decided_by(craft->carried, heard, told);
  memcpy(craft->carried, told, CARRIED * sizeof *told);
  memmove(craft->past[0], craft->past[1], (DEPTH - 1) * sizeof craft->past[0]);
  for (int j = 0; j < INPUTS; ++j)
    craft->inputs[j] = craft->past[DEPTH - 1][j] = limited(told[CARRIED + j] + added[j], limits[0][j], limits[1][j]);
  for (int k = 0; k <= PERIOD; ++k) {
    const int row = k < PERIOD ? k : PERIOD - 1;
    for (int j = 0; j < INPUTS; ++j) rows[k][j] = craft->past[DEPTH - 1 - back[which][row][j]][j];
    memcpy(rows[k] + INPUTS, around, sizeof around);
  }
#if QUATERNION
  placed(craft->x, start);
  memcpy(start + N, craft->x, sizeof craft->x);
#else
  memcpy(start, craft->x, sizeof craft->x);
#endif
  const Flight plan = {.samples = PERIOD + 1, .keep = PERIOD, .hold = 1, .held = 1, .every = 1, .depth = 1, .last = 1,
    .total = 1, .rows_wide = 1, .numbers_wide = 1, .asked_wide = 1, .added_wide = 1, .dt = @STEP@, .start = start,
    .numbers = card[which], .rows = rows[0], .states = states[0]};
  fly(&plan);
  memcpy(craft->x, states[1], sizeof craft->x);
}
