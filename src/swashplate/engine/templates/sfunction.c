/* A level-2 S-function around one exported model: Simulink's solver integrates its continuous states.
 *
 * Ports: in 1 the inputs, in 2 the surroundings (where the model has any); out 1 the states, out 2 the outputs.
 * Parameters: none, or one vector that replaces the card's numbers.
 * Written from the documented macros of simstruc.h; sfun_model.h names the model.
 */
#define S_FUNCTION_LEVEL 2
#include "sfun_model.h"
#include "simstruc.h"

#define SURROUNDED (N_SURROUNDINGS > 0)

static void gather(SimStruct *S, int port, int n, const real_T *otherwise, real_T *values) {
  int i;
  if (otherwise) {
    for (i = 0; i < n; ++i) values[i] = otherwise[i];
  } else {
    InputRealPtrsType found = ssGetInputPortRealSignalPtrs(S, port);
    for (i = 0; i < n; ++i) values[i] = *found[i];
  }
}

static const real_T *parameters(SimStruct *S) {
  return ssGetSFcnParamsCount(S) == 1 ? mxGetPr(ssGetSFcnParam(S, 0)) : model_start_p;
}

#define MDL_CHECK_PARAMETERS
static void mdlCheckParameters(SimStruct *S) {
  if (ssGetSFcnParamsCount(S) == 1 && mxGetNumberOfElements(ssGetSFcnParam(S, 0)) != N_PARAMETERS) {
    ssSetErrorStatus(S, "the parameter must be a vector with one number for each of the card's");
  }
}

static void mdlInitializeSizes(SimStruct *S) {
  ssSetNumSFcnParams(S, ssGetSFcnParamsCount(S) == 0 ? 0 : 1);
  if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) return;
  mdlCheckParameters(S);
  ssSetNumContStates(S, N_STATES);
  ssSetNumDiscStates(S, 0);
  if (!ssSetNumInputPorts(S, SURROUNDED ? 2 : 1)) return;
  ssSetInputPortWidth(S, 0, N_INPUTS);
  ssSetInputPortDirectFeedThrough(S, 0, 1);
  if (SURROUNDED) {
    ssSetInputPortWidth(S, 1, N_SURROUNDINGS);
    ssSetInputPortDirectFeedThrough(S, 1, 1);
  }
  if (!ssSetNumOutputPorts(S, 2)) return;
  ssSetOutputPortWidth(S, 0, N_STATES);
  ssSetOutputPortWidth(S, 1, N_OUTPUTS);
  ssSetNumSampleTimes(S, 1);
}

static void mdlInitializeSampleTimes(SimStruct *S) {
  ssSetSampleTime(S, 0, CONTINUOUS_SAMPLE_TIME);
  ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_INITIALIZE_CONDITIONS
static void mdlInitializeConditions(SimStruct *S) {
  real_T *x = ssGetContStates(S);
  int i;
  for (i = 0; i < N_STATES; ++i) x[i] = model_start_x[i];
}

static void mdlOutputs(SimStruct *S, int_T tid) {
  const real_T *x = ssGetContStates(S);
  real_T *states = ssGetOutputPortRealSignal(S, 0), *outputs = ssGetOutputPortRealSignal(S, 1);
  real_T u[N_INPUTS + 1], s[N_SURROUNDINGS + 1];
  int i;
  (void)tid;
  gather(S, 0, N_INPUTS, 0, u);
  gather(S, 1, N_SURROUNDINGS, SURROUNDED ? 0 : model_start_s, s);
  for (i = 0; i < N_STATES; ++i) states[i] = x[i];
  model_outputs(x, u, s, parameters(S), outputs);
}

#define MDL_DERIVATIVES
static void mdlDerivatives(SimStruct *S) {
  real_T u[N_INPUTS + 1], s[N_SURROUNDINGS + 1];
  gather(S, 0, N_INPUTS, 0, u);
  gather(S, 1, N_SURROUNDINGS, SURROUNDED ? 0 : model_start_s, s);
  model_rates(ssGetContStates(S), u, s, parameters(S), ssGetdX(S));
}

static void mdlTerminate(SimStruct *S) { (void)S; }

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
