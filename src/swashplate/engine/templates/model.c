#include "@NAME@.h"

#include <math.h>

@ARRAYS@
@model_rates.c@

void @NAME@_outputs(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *outputs) {
@OUTPUTS@}

static void slopes(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *A, @REAL@ *B) {
@JACOBIANS@}

void @NAME@_jacobians(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *A, @REAL@ *B) {
  int i;
  for (i = 0; i < @NAME@_n_states * @NAME@_n_states; ++i) A[i] = 0;
  for (i = 0; i < @NAME@_n_states * @NAME@_n_inputs; ++i) B[i] = 0;
  slopes(x, u, s, p, A, B);
}

@model_step.c@
