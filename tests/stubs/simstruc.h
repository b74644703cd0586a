/* A stub of Simulink's simstruc.h, written for the tests from the documented names of its macros: enough to compile an
 * S-function and to drive it. It is not the original and proves nothing about Simulink itself. */
#ifndef SIMSTRUC_STUB_H
#define SIMSTRUC_STUB_H
#include <stddef.h>

typedef double real_T;
typedef int int_T;
typedef const real_T *const *InputRealPtrsType;
typedef struct {
  real_T *values;
  int n;
} mxArray;

typedef struct {
  int wanted_parameters, given_parameters;
  const mxArray *parameter[1];
  int continuous, discrete, inputs, outputs, in_width[2], out_width[2], feedthrough[2], sample_times;
  real_T sample_time, offset;
  const char *error;
  real_T x[64], dx[64], in[2][64], out[2][64];
  const real_T *in_pointers[2][64];
} SimStruct;

#define CONTINUOUS_SAMPLE_TIME 0.0
#define ssSetNumSFcnParams(S, n) ((S)->wanted_parameters = (n))
#define ssGetNumSFcnParams(S) ((S)->wanted_parameters)
#define ssGetSFcnParamsCount(S) ((S)->given_parameters)
#define ssGetSFcnParam(S, i) ((S)->parameter[i])
#define mxGetPr(a) ((a)->values)
#define mxGetNumberOfElements(a) ((a)->n)
#define ssSetErrorStatus(S, text) ((S)->error = (text))
#define ssSetNumContStates(S, n) ((S)->continuous = (n))
#define ssSetNumDiscStates(S, n) ((S)->discrete = (n))
#define ssSetNumInputPorts(S, n) ((S)->inputs = (n), 1)
#define ssSetNumOutputPorts(S, n) ((S)->outputs = (n), 1)
#define ssSetInputPortWidth(S, i, n) ((S)->in_width[i] = (n))
#define ssSetOutputPortWidth(S, i, n) ((S)->out_width[i] = (n))
#define ssSetInputPortDirectFeedThrough(S, i, on) ((S)->feedthrough[i] = (on))
#define ssSetNumSampleTimes(S, n) ((S)->sample_times = (n))
#define ssSetSampleTime(S, i, t) ((void)(i), (S)->sample_time = (t))
#define ssSetOffsetTime(S, i, t) ((void)(i), (S)->offset = (t))
#define ssGetContStates(S) ((S)->x)
#define ssGetdX(S) ((S)->dx)
#define ssGetInputPortRealSignalPtrs(S, i) ((InputRealPtrsType)(S)->in_pointers[i])
#define ssGetOutputPortRealSignal(S, i) ((S)->out[i])
#endif
