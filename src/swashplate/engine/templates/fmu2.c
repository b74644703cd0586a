/* The functions of FMI 2.0 for co-simulation around one exported model.
 *
 * Written from the standard (Functional Mock-up Interface 2.0.4, sections 2 and 4). The model comes in by fmu_model.h,
 * which names its functions model_*, its sizes N_* and its identity MODEL_*. Value references run through states,
 * their derivatives, inputs, surroundings, parameters, outputs and the length of an internal step, in this order.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmu_model.h"

typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef unsigned int fmi2ValueReference;
typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef struct {
  void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
  void *(*allocateMemory)(size_t, size_t);
  void (*freeMemory)(void *);
  void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
  fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

#ifdef FMI2_FUNCTION_PREFIX
#define PASTED(a, b) a##b
#define PASTE(a, b) PASTED(a, b)
#define API(name) PASTE(FMI2_FUNCTION_PREFIX, name)
#else
#define API(name) name
#endif
#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

enum {
  AT_DERIVATIVES = N_STATES,
  AT_INPUTS = AT_DERIVATIVES + N_STATES,
  AT_SURROUNDINGS = AT_INPUTS + N_INPUTS,
  AT_PARAMETERS = AT_SURROUNDINGS + N_SURROUNDINGS,
  AT_OUTPUTS = AT_PARAMETERS + N_PARAMETERS,
  AT_STEP = AT_OUTPUTS + N_OUTPUTS,
  N_REALS
};

/* Everything that a flight changes: what a saved state holds. One longer than needed, since some models lack a kind. */
typedef struct {
  fmi2Real time;
  fmi2Real step;
#ifdef MODEL_LATE
  int newest, count; /* what the inputs were: a ring of times and values */
  fmi2Real past_time[N_PAST];
  fmi2Real past[N_PAST][N_INPUTS];
#endif
  fmi2Real x[N_STATES + 1];
  fmi2Real u[N_INPUTS + 1];
  fmi2Real s[N_SURROUNDINGS + 1];
  fmi2Real p[N_PARAMETERS + 1];
} State;

typedef struct {
  State now;
  fmi2Boolean finite;
  fmi2CallbackFunctions calls;
  char *name;
} Instance;

static void say(Instance *at, fmi2Status status, const char *text) {
  if (at->calls.logger) {
    at->calls.logger(at->calls.componentEnvironment, at->name, status, "logStatusError", "%s", text);
  }
}

static void start(Instance *at) {
  memset(&at->now, 0, sizeof at->now);
  memcpy(at->now.x, model_start_x, N_STATES * sizeof(fmi2Real));
  memcpy(at->now.u, model_start_u, N_INPUTS * sizeof(fmi2Real));
  memcpy(at->now.s, model_start_s, N_SURROUNDINGS * sizeof(fmi2Real));
  memcpy(at->now.p, model_start_p, N_PARAMETERS * sizeof(fmi2Real));
  at->now.step = MODEL_STEP;
  at->finite = 1;
}

#ifdef MODEL_LATE
/* The inputs at the beginning of an internal step; steps too short to be kept apart share an entry. */
static void remember(State *now, fmi2Real time) {
  if (now->count == 0 || time >= now->past_time[now->newest] + MODEL_LATE / (N_PAST - 2)) {
    now->newest = (now->newest + 1) % N_PAST;
    now->past_time[now->newest] = time;
    if (now->count < N_PAST) ++now->count;
  }
  memcpy(now->past[now->newest], now->u, N_INPUTS * sizeof(fmi2Real));
}

/* What the equations see of the inputs: each as it was one delay ago, and at its start before that. */
static const fmi2Real *seen(const State *now, fmi2Real time, fmi2Real *u) {
  int i, k;
  for (i = 0; i < N_INPUTS; ++i) {
    u[i] = model_delays[i] > 0 ? model_start_u[i] : now->u[i];
    for (k = 0; model_delays[i] > 0 && k < now->count; ++k) {
      const int at = (now->newest - k + N_PAST) % N_PAST;
      if (now->past_time[at] <= time - model_delays[i] + 1e-9) {
        u[i] = now->past[at][i];
        break;
      }
    }
  }
  return u;
}
#else
static void remember(State *now, fmi2Real time) {
  (void)now;
  (void)time;
}

static const fmi2Real *seen(const State *now, fmi2Real time, fmi2Real *u) {
  (void)time;
  (void)u;
  return now->u;
}
#endif

static fmi2Real *place(State *now, fmi2ValueReference reference) {
  if (reference < AT_DERIVATIVES) return &now->x[reference];
  if (reference < AT_INPUTS) return NULL;
  if (reference < AT_SURROUNDINGS) return &now->u[reference - AT_INPUTS];
  if (reference < AT_PARAMETERS) return &now->s[reference - AT_SURROUNDINGS];
  if (reference < AT_OUTPUTS) return &now->p[reference - AT_PARAMETERS];
  if (reference == AT_STEP) return &now->step;
  return NULL;
}

EXPORT const char *API(fmi2GetTypesPlatform)(void) { return "default"; }
EXPORT const char *API(fmi2GetVersion)(void) { return "2.0"; }

EXPORT fmi2Component API(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                          const fmi2CallbackFunctions *calls, fmi2Boolean visible,
                                          fmi2Boolean logging) {
  Instance *made = calloc(1, sizeof *made);
  (void)resources;
  (void)visible;
  (void)logging;
  if (!made) return NULL;
  if (calls) made->calls = *calls;
  made->name = calloc(strlen(name ? name : "") + 1, 1);
  if (!made->name) {
    free(made);
    return NULL;
  }
  strcpy(made->name, name ? name : "");
  if (type != fmi2CoSimulation || !guid || strcmp(guid, MODEL_GUID) != 0) {
    say(made, fmi2Error, "this binary is for co-simulation and belongs to another model description");
    free(made->name);
    free(made);
    return NULL;
  }
  start(made);
  return made;
}

EXPORT void API(fmi2FreeInstance)(fmi2Component c) {
  if (c) free(((Instance *)c)->name);
  free(c);
}

EXPORT fmi2Status API(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  (void)on;
  (void)n;
  (void)categories;
  return c ? fmi2OK : fmi2Error;
}

EXPORT fmi2Status API(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean given, fmi2Real tolerance, fmi2Real begin,
                                           fmi2Boolean stops, fmi2Real stop) {
  (void)given;
  (void)tolerance;
  (void)stops;
  (void)stop;
  if (!c) return fmi2Error;
  ((Instance *)c)->now.time = begin;
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2EnterInitializationMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
EXPORT fmi2Status API(fmi2ExitInitializationMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
EXPORT fmi2Status API(fmi2Terminate)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }

EXPORT fmi2Status API(fmi2Reset)(fmi2Component c) {
  if (!c) return fmi2Error;
  start(c);
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2GetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
  Instance *at = c;
  State *now;
  fmi2Real rates[N_STATES + 1], outputs[N_OUTPUTS + 1], u[N_INPUTS + 1];
  int rated = 0, read = 0;
  size_t i;
  if (!at) return fmi2Error;
  now = &at->now;
  for (i = 0; i < n; ++i) {
    const fmi2Real *found = place(now, vr[i]);
    if (vr[i] >= N_REALS) {
      say(at, fmi2Error, "a value was asked for that there is none of");
      return fmi2Error;
    }
    if (found) {
      value[i] = *found;
    } else if (vr[i] < AT_INPUTS) {
      if (!rated) model_rates(now->x, seen(now, now->time, u), now->s, now->p, rates);
      rated = 1;
      value[i] = rates[vr[i] - AT_DERIVATIVES];
    } else {
      if (!read) model_outputs(now->x, seen(now, now->time, u), now->s, now->p, outputs);
      read = 1;
      value[i] = outputs[vr[i] - AT_OUTPUTS];
    }
  }
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2SetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
  Instance *at = c;
  size_t i;
  if (!at) return fmi2Error;
  for (i = 0; i < n; ++i) {
    fmi2Real *found = place(&at->now, vr[i]);
    if (!found || !isfinite(value[i]) || (vr[i] == AT_STEP && value[i] <= 0)) {
      say(at, fmi2Error, "a value was set that is calculated, unknown, not finite, or no length of a step");
      return fmi2Error;
    }
    *found = value[i];
  }
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2DoStep)(fmi2Component c, fmi2Real at_time, fmi2Real length, fmi2Boolean no_return) {
  Instance *at = c;
  fmi2Real count, h, u[N_INPUTS + 1];
  long i, n;
  (void)no_return;
  if (!at) return fmi2Error;
  if (!(length > 0) || !isfinite(length)) {
    say(at, fmi2Error, "a communication step must be longer than zero");
    return fmi2Error;
  }
  count = ceil(length / at->now.step - 1e-9); /* a whole number of steps but for rounding */
  if (!(count < 1e9)) {
    say(at, fmi2Error, "a communication step holds more than a thousand million internal steps");
    return fmi2Error;
  }
  n = count < 1 ? 1 : (long)count;
  h = length / (fmi2Real)n;
  for (i = 0; i < n; ++i) {
    const fmi2Real time = at_time + (fmi2Real)i * h;
    remember(&at->now, time);
    model_step(at->now.x, seen(&at->now, time, u), at->now.s, at->now.p, h);
  }
  for (i = 0; i < N_STATES; ++i) {
    if (!isfinite(at->now.x[i])) {
      if (at->finite) say(at, fmi2Error, "the states left the finite numbers");
      at->finite = 0;
      return fmi2Error;
    }
  }
  at->now.time = at_time + length;
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2CancelStep)(fmi2Component c) {
  (void)c;
  return fmi2Error;
}

/* Saved states. */
EXPORT fmi2Status API(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *state) {
  if (!c || !state) return fmi2Error;
  if (!*state) *state = calloc(1, sizeof(State));
  if (!*state) return fmi2Error;
  memcpy(*state, &((Instance *)c)->now, sizeof(State));
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state) {
  if (!c || !state) return fmi2Error;
  memcpy(&((Instance *)c)->now, state, sizeof(State));
  ((Instance *)c)->finite = 1;
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state) {
  if (!c || !state) return fmi2Error;
  free(*state);
  *state = NULL;
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size) {
  if (!c || !state || !size) return fmi2Error;
  *size = sizeof(State);
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  if (!c || !state || size < sizeof(State)) return fmi2Error;
  memcpy(bytes, state, sizeof(State));
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                               fmi2FMUstate *state) {
  if (!c || !state || size != sizeof(State)) return fmi2Error;
  if (!*state) *state = calloc(1, sizeof(State));
  if (!*state) return fmi2Error;
  memcpy(*state, bytes, sizeof(State));
  return fmi2OK;
}

/* There are real numbers only, no directional derivatives, and every step ends before it returns. */
#define NOTHING(name, kind)                                                                               \
  EXPORT fmi2Status API(name)(fmi2Component c, const fmi2ValueReference vr[], size_t n, kind value[]) {   \
    (void)c;                                                                                              \
    (void)vr;                                                                                             \
    (void)value;                                                                                          \
    return n == 0 ? fmi2OK : fmi2Error;                                                                   \
  }
NOTHING(fmi2GetInteger, fmi2Integer)
NOTHING(fmi2GetBoolean, fmi2Boolean)
NOTHING(fmi2GetString, fmi2String)
NOTHING(fmi2SetInteger, const fmi2Integer)
NOTHING(fmi2SetBoolean, const fmi2Boolean)
NOTHING(fmi2SetString, const fmi2String)

EXPORT fmi2Status API(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                                    const fmi2ValueReference known[], size_t m,
                                                    const fmi2Real change[], fmi2Real result[]) {
  (void)c;
  (void)unknown;
  (void)n;
  (void)known;
  (void)m;
  (void)change;
  (void)result;
  return fmi2Error;
}

EXPORT fmi2Status API(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                   const fmi2Integer order[], const fmi2Real value[]) {
  (void)c;
  (void)vr;
  (void)order;
  (void)value;
  return n == 0 ? fmi2OK : fmi2Error;
}

EXPORT fmi2Status API(fmi2GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                    const fmi2Integer order[], fmi2Real value[]) {
  (void)c;
  (void)vr;
  (void)order;
  (void)value;
  return n == 0 ? fmi2OK : fmi2Error;
}

EXPORT fmi2Status API(fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
  if (!c || kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = ((Instance *)c)->now.time;
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
  (void)c;
  (void)kind;
  (void)value;
  return fmi2Discard;
}

EXPORT fmi2Status API(fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
  (void)c;
  (void)kind;
  (void)value;
  return fmi2Discard;
}

EXPORT fmi2Status API(fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
  if (!c || kind != fmi2Terminated) return fmi2Discard;
  *value = !((Instance *)c)->finite;
  return fmi2OK;
}

EXPORT fmi2Status API(fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
  (void)c;
  (void)kind;
  (void)value;
  return fmi2Discard;
}
