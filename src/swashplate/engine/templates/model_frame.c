#include <math.h>

typedef @TYPE@ @REAL@;
#define @NAME@_n_states @N_STATES@
void @NAME@_rates(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *rates);
void @NAME@_step(@REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ dt);

@model_rates.c@

@model_step.c@

static void tell(const @REAL@ *x, const @REAL@ *rates, const @REAL@ *g, @REAL@ *told) {
@TOLD@}

void @NAME@_frame(@REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, const @REAL@ *g, @REAL@ dt, int steps,
                  @REAL@ *told);

/* Steps under held inputs, and what is told of where they lead. */
void @NAME@_frame(@REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, const @REAL@ *g, @REAL@ dt, int steps,
                  @REAL@ *told) {
  @REAL@ rates[@NAME@_n_states];
  int i;
  for (i = 0; i < steps; ++i) @NAME@_step(x, u, s, p, dt);
  @NAME@_rates(x, u, s, p, rates);
  tell(x, rates, g, told);
}
