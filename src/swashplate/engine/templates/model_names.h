#include "@NAME@.h"
#define model_step @NAME@_step
#define model_rates @NAME@_rates
#define model_outputs @NAME@_outputs
#define model_start_x @NAME@_start_x
#define model_start_u @NAME@_start_u
#define model_start_s @NAME@_start_s
#define model_start_p @NAME@_start_p
#define N_STATES @NAME@_n_states
#define N_INPUTS @NAME@_n_inputs
#define N_SURROUNDINGS @NAME@_n_surroundings
#define N_PARAMETERS @NAME@_n_parameters
#define N_OUTPUTS @NAME@_n_outputs
