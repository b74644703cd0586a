@HEADING@
#ifndef @GUARD@
#define @GUARD@

#ifdef __cplusplus
extern "C" {
#endif

typedef @TYPE@ @REAL@;

#define @NAME@_n_states @N_STATES@
#define @NAME@_n_inputs @N_INPUTS@
#define @NAME@_n_surroundings @N_SURROUNDINGS@
#define @NAME@_n_parameters @N_PARAMETERS@
#define @NAME@_n_outputs @N_OUTPUTS@

@ENUMS@

/* Where a flight may start: states, inputs and surroundings in steady flight, and the card's parameters. */
extern const @REAL@ @NAME@_start_x[];
extern const @REAL@ @NAME@_start_u[];
extern const @REAL@ @NAME@_start_s[];
extern const @REAL@ @NAME@_start_p[];

/* Derivatives of the states. Arguments everywhere: x states, u inputs, s surroundings, p parameters. */
void @NAME@_rates(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *rates);

/* What is measured beside the states. */
void @NAME@_outputs(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *outputs);

/* Derivatives of the rates by states, A, and by inputs, B; full matrices, row by row. */
void @NAME@_jacobians(const @REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ *A, @REAL@ *B);

/* One step of dt seconds: classical Runge-Kutta of order 4, inputs and surroundings held. x is replaced. */
void @NAME@_step(@REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ dt);

#ifdef __cplusplus
}
#endif

#endif
