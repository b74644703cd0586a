/* Of the rates what no state moves, c. */
static void fixed(const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *c) {
@FIXED@}

/* The rates, given c. root: what is found by iteration, from the guesses in it where known is not 0. */
static void moving(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, const @REAL@ *c,
                   @REAL@ *root, int known, @REAL@ *rates) {
@MOVING@}

void @NAME@_rates(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *rates) {
  @REAL@ c[@N_CONSTANTS@], root[@N_ROOTS@] = {0};
  fixed(u, s, p, c);
  moving(x, u, s, p, c, root, 0, rates);
}
