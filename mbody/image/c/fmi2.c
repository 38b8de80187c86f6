/* FMI 2.0 for co-simulation: the functions of the standard, by those of fmu.c. */
#include "fmu.h"

#include <stdlib.h>
#include <string.h>

/* fmi2TypesPlatform.h and fmi2FunctionTypes.h, as far as they are needed */
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef int fmi2Boolean;
typedef const char *fmi2String;
typedef int fmi2Status;
enum { fmi2ModelExchange, fmi2CoSimulation };
enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated };
typedef struct {
  void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
  void *(*allocateMemory)(size_t, size_t);
  void (*freeMemory)(void *);
  void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
  fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;

static void tell(const Unit *unit, Status status, const char *category, const char *sentence) {
  const fmi2CallbackFunctions *callbacks = unit->callbacks;
  if (callbacks && callbacks->logger)
    callbacks->logger(callbacks->environment, unit->name ? unit->name : "", status, category, "%s", sentence);
}

/* A folder from its URI, without scheme and host; %XX are decoded.  To be freed. */
static char *folder_of(const char *uri) {
  char *path = malloc(strlen(uri) + 1), *end = path;
  if (!path) return NULL;
  if (!strncmp(uri, "file:", 5)) {
    uri += 5;
    if (!strncmp(uri, "//", 2)) {
      uri += 2;
      while (*uri && *uri != '/') uri++; /* the host */
    }
    if (uri[0] == '/' && uri[1] && uri[2] == ':') uri++; /* a drive's letter */
  }
  for (; *uri; uri++) {
    char digits[3] = {0, 0, 0}, *read = digits;
    *end = *uri;
    if (*uri == '%' && uri[1] && uri[2]) {
      memcpy(digits, uri + 1, 2);
      char value = (char)strtol(digits, &read, 16);
      if (read == digits + 2) {
        *end = value;
        uri += 2;
      }
    }
    end++;
  }
  *end = 0;
  return path;
}

OUT const char *fmi2GetTypesPlatform(void) { return "default"; }
OUT const char *fmi2GetVersion(void) { return "2.0"; }

OUT fmi2Component fmi2Instantiate(fmi2String name, int kind, fmi2String guid, fmi2String where,
                                  const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
  Unit *unit = calloc(1, sizeof *unit);
  char *folder = where ? folder_of(where) : NULL;
  (void)visible;
  (void)logging; /* what is reported are reasons, and these always */
  if (unit) {
    unit->callbacks = callbacks;
    unit->tell = tell;
  }
  if (unit && kind != fmi2CoSimulation) {
    unit_report(unit, ERROR, "this unit is one for co-simulation, not for model exchange");
    unit_free(unit);
    unit = NULL;
  }
  if (unit) unit = unit_open(unit, name, guid, folder ? folder : "");
  free(folder);
  return unit;
}

OUT void fmi2FreeInstance(fmi2Component component) { unit_free(component); }

OUT fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean on, size_t count, const fmi2String categories[]) {
  (void)component, (void)on, (void)count, (void)categories;
  return OK;
}

OUT fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean given, double tolerance, double start,
                                   fmi2Boolean stops, double stop) {
  unit_experiment(component, start, stops, stop, given, tolerance);
  return OK;
}

OUT fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
  (void)component;
  return OK;
}

OUT fmi2Status fmi2ExitInitializationMode(fmi2Component component) { return unit_begin(component); }

OUT fmi2Status fmi2Terminate(fmi2Component component) {
  (void)component;
  return OK;
}

OUT fmi2Status fmi2Reset(fmi2Component component) { return unit_reset(component); }

OUT fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference which[], size_t count, double values[]) {
  return unit_get(component, which, count, values);
}

OUT fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference which[], size_t count, const double values[]) {
  return unit_set(component, which, count, values);
}

#define NONE(name, type)                                                                                   \
  OUT fmi2Status name(fmi2Component component, const fmi2ValueReference which[], size_t count, type values[]) { \
    (void)which, (void)values;                                                                             \
    return count ? unit_report(component, ERROR, "all variables of this unit are Real") : OK;              \
  }
NONE(fmi2GetInteger, int)
NONE(fmi2GetBoolean, fmi2Boolean)
NONE(fmi2GetString, fmi2String)
NONE(fmi2SetInteger, const int)
NONE(fmi2SetBoolean, const fmi2Boolean)
NONE(fmi2SetString, const fmi2String)

OUT fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknown[], size_t unknowns,
                                            const fmi2ValueReference known[], size_t knowns, const double dv[], double du[]) {
  (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)dv, (void)du;
  return unit_report(component, ERROR, "this unit gives no directional derivatives");
}

OUT fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                           const int order[], const double values[]) {
  (void)which, (void)order, (void)values;
  return count ? unit_report(component, ERROR, "this unit takes no derivatives of inputs") : OK;
}

OUT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                            const int order[], double values[]) {
  (void)which, (void)order, (void)values;
  return count ? unit_report(component, ERROR, "this unit gives no derivatives of outputs") : OK;
}

/* ---- states ---------------------------------------------------------------------------------- */

OUT fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state) { return unit_save(component, state); }
OUT fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state) { return unit_restore(component, state); }

OUT fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state) {
  (void)component;
  if (state) {
    free(*state);
    *state = NULL;
  }
  return OK;
}

OUT fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *bytes) {
  (void)state;
  *bytes = unit_state_bytes(component);
  return OK;
}

OUT fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, char to[], size_t bytes) {
  return unit_serialize(component, state, to, bytes);
}

OUT fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const char from[], size_t bytes, fmi2FMUstate *state) {
  return unit_deserialize(component, from, bytes, state);
}

/* ---- steps ----------------------------------------------------------------------------------- */

OUT fmi2Status fmi2DoStep(fmi2Component component, double now, double step, fmi2Boolean final) {
  (void)final;
  return unit_step(component, now, step);
}

OUT fmi2Status fmi2CancelStep(fmi2Component component) {
  return unit_report(component, ERROR, "steps of this unit cannot be cancelled");
}

OUT fmi2Status fmi2GetStatus(fmi2Component component, int kind, fmi2Status *value) {
  (void)kind, (void)value;
  return unit_report(component, DISCARD, "steps of this unit are never pending");
}

OUT fmi2Status fmi2GetRealStatus(fmi2Component component, int kind, double *value) {
  if (kind != fmi2LastSuccessfulTime) return unit_report(component, DISCARD, "there is no such status");
  *value = ((Unit *)component)->course.time;
  return OK;
}

OUT fmi2Status fmi2GetIntegerStatus(fmi2Component component, int kind, int *value) {
  (void)kind, (void)value;
  return unit_report(component, DISCARD, "there is no such status");
}

OUT fmi2Status fmi2GetBooleanStatus(fmi2Component component, int kind, fmi2Boolean *value) {
  if (kind != fmi2Terminated) return unit_report(component, DISCARD, "there is no such status");
  *value = ((Unit *)component)->course.ended;
  return OK;
}

OUT fmi2Status fmi2GetStringStatus(fmi2Component component, int kind, fmi2String *value) {
  (void)kind, (void)value;
  return unit_report(component, DISCARD, "there is no such status");
}
