/* Co-simulation units, FMI 2.0: one binary for all models of a machine, built once with the kernels
 * (`mbody compile --fmu`).  The model is resources/model.bin, an image of mbody.
 *
 * What modelDescription.xml says for it:
 *   valueReference  entry of the image: numbers are parameters (variability "tunable"; "fixed" is
 *                   right too), measures are outputs, inputs are inputs; all Real.
 *   guid            {sixteen hexadecimal digits of the image's checksum}; any, where it has none.
 *   CoSimulation    canHandleVariableCommunicationStepSize, canGetAndSetFMUstate,
 *                   canSerializeFMUstate, canBeInstantiatedOnlyOncePerProcess="false",
 *                   canNotUseMemoryManagementFunctions="true".
 *
 * Parameters may change at any communication point: the motion then begins anew from its position
 * and speeds, fitted to the new numbers.  Where it goes no further, fmi2DoStep is Discard, and
 * fmi2LastSuccessfulTime is the time that is reached.
 */
#include "mbody.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define OUT __declspec(dllexport)
#else
#define OUT __attribute__((visibility("default")))
#endif

/* fmi2TypesPlatform.h and fmi2FunctionTypes.h, as far as they are needed */
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef int fmi2Boolean;
typedef const char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
enum { fmi2ModelExchange, fmi2CoSimulation };
enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated };
typedef struct {
  void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
  void *(*allocateMemory)(size_t, size_t);
  void (*freeMemory)(void *);
  void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
  fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;

/* What a unit has beside its model; a state carries it too. */
typedef struct {
  double start, stop, time;
  int begun, ended, waiting; /* waiting: parameters that are not allowed beside the others, yet */
} Course;

typedef struct {
  mbody_model *model;
  const fmi2CallbackFunctions *callbacks;
  char *name;
  char *original; /* the state when it was instantiated */
  int *entries;   /* parameters that wait for others */
  double *values;
  Course course;
} Unit;

/* A time that is nearer than this part to another one is the same. */
static const double SAME_TIME = 1e-9;

static const char *const CATEGORY[] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};

/* Reports a sentence to the importer; the status. */
static fmi2Status report(Unit *unit, fmi2Status status, const char *sentence) {
  const fmi2CallbackFunctions *callbacks = unit->callbacks;
  if (callbacks && callbacks->logger)
    callbacks->logger(callbacks->environment, unit->name ? unit->name : "", status, CATEGORY[status], "%s", sentence);
  return status;
}

/* The status of what a function of mbody.h has returned. */
static fmi2Status status_of(Unit *unit, int code) {
  static const fmi2Status status[] = {fmi2OK, fmi2Warning, fmi2Discard, fmi2Discard, fmi2Discard, fmi2Error};
  return code ? report(unit, status[code], mbody_message(unit->model)) : fmi2OK;
}

/* Place of a file: the URI without its scheme and host; %XX are decoded. */
static void place(const char *uri, const char *name, char *path, size_t room) {
  size_t n = 0;
  if (!strncmp(uri, "file:", 5)) {
    uri += 5;
    if (!strncmp(uri, "//", 2)) {
      uri += 2;
      while (*uri && *uri != '/') uri++; /* the host */
    }
    if (uri[0] == '/' && uri[1] && uri[2] == ':') uri++; /* a drive's letter */
  }
  for (; *uri && n + strlen(name) + 2 < room; uri++) {
    char digits[3] = {0, 0, 0}, *end = digits;
    if (*uri == '%' && uri[1] && uri[2]) {
      memcpy(digits, uri + 1, 2);
      path[n] = (char)strtol(digits, &end, 16);
    }
    if (end == digits + 2) uri += 2;
    else path[n] = *uri;
    n++;
  }
  if (n && path[n - 1] != '/') path[n++] = '/';
  strcpy(path + n, name);
}

OUT const char *fmi2GetTypesPlatform(void) { return "default"; }
OUT const char *fmi2GetVersion(void) { return "2.0"; }

OUT void fmi2FreeInstance(fmi2Component component) {
  Unit *unit = component;
  if (!unit) return;
  mbody_free(unit->model);
  free(unit->name);
  free(unit->original);
  free(unit->entries);
  free(unit->values);
  free(unit);
}

OUT fmi2Component fmi2Instantiate(fmi2String name, int kind, fmi2String guid, fmi2String where,
                                  const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
  char path[4096], message[700];
  Unit *unit = calloc(1, sizeof *unit);
  (void)visible;
  (void)logging; /* what is reported are reasons, and these always */
  if (!unit) return NULL;
  unit->callbacks = callbacks;
  message[0] = 0;
  unit->name = malloc(strlen(name ? name : "") + 1);
  if (unit->name) strcpy(unit->name, name ? name : "");
  if (kind != fmi2CoSimulation) {
    snprintf(message, sizeof message, "this unit is one for co-simulation, not for model exchange");
  } else if (!where) {
    snprintf(message, sizeof message, "the place of the resources is missing");
  } else {
    place(where, "model.bin", path, sizeof path);
    unit->model = mbody_open_file(path, message, sizeof message);
  }
  if (unit->model) {
    char own[24];
    snprintf(own, sizeof own, "{%016llx}", (unsigned long long)mbody_checksum(unit->model));
    if (mbody_checksum(unit->model) && guid && strcmp(guid, own))
      snprintf(message, sizeof message, "modelDescription.xml is that of another model: its guid is %.80s, that of the image %s", guid, own);
    else if (!mbody_array(unit->model, "advance.times", NULL))
      snprintf(message, sizeof message, "the image has no free motion, which a unit for co-simulation needs");
    size_t bytes = mbody_state_bytes(unit->model), count = (size_t)mbody_entry_count(unit->model) + 1;
    unit->original = malloc(bytes);
    unit->entries = malloc(count * sizeof *unit->entries);
    unit->values = malloc(count * sizeof *unit->values);
    if (!unit->name || !unit->entries || !unit->values || !unit->original || mbody_save(unit->model, unit->original, bytes))
      snprintf(message, sizeof message, "there is no memory for the unit");
  }
  if (!message[0]) return unit;
  report(unit, fmi2Error, message);
  fmi2FreeInstance(unit);
  return NULL;
}

OUT fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean on, size_t count, const fmi2String categories[]) {
  (void)component, (void)on, (void)count, (void)categories;
  return fmi2OK;
}

OUT fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean given, double tolerance, double start,
                                   fmi2Boolean stops, double stop) {
  Course *course = &((Unit *)component)->course;
  (void)given, (void)tolerance; /* that of the image holds */
  course->start = course->time = start;
  course->stop = stops ? stop : NAN;
  return fmi2OK;
}

/* The parameters that wait are set now or never, and the motion is at the present time. */
static fmi2Status settle(Unit *unit) {
  Course *course = &unit->course;
  int count = course->waiting;
  course->waiting = 0;
  if (count) {
    int code = mbody_set_several(unit->model, unit->entries, unit->values, count);
    if (code) return status_of(unit, code);
  }
  if (!course->begun) {
    fmi2Status status = status_of(unit, mbody_start(unit->model, course->start, course->stop));
    course->begun = status <= fmi2Warning;
    return status == fmi2Discard ? fmi2Error : status;
  }
  return course->ended ? fmi2OK : status_of(unit, mbody_advance(unit->model, mbody_now(unit->model)));
}

OUT fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
  (void)component;
  return fmi2OK;
}

OUT fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
  Unit *unit = component;
  unit->course.begun = 0;
  return settle(unit);
}

OUT fmi2Status fmi2Terminate(fmi2Component component) {
  (void)component;
  return fmi2OK;
}

OUT fmi2Status fmi2Reset(fmi2Component component) {
  Unit *unit = component;
  memset(&unit->course, 0, sizeof unit->course);
  return status_of(unit, mbody_restore(unit->model, unit->original, mbody_state_bytes(unit->model)));
}

/* ---- variables ------------------------------------------------------------------------------- */

OUT fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference which[], size_t count, double values[]) {
  Unit *unit = component;
  fmi2Status worst = fmi2OK;
  int settled = 0;
  for (size_t k = 0; k < count; k++) {
    int entry = which[k] < 0x7fffffff ? (int)which[k] : -1, kind = mbody_kind(unit->model, entry);
    if (kind == MBODY_NUMBER) {
      values[k] = mbody_number(unit->model, entry);
      for (int n = 0; n < unit->course.waiting; n++)
        if (unit->entries[n] == entry) values[k] = unit->values[n];
    } else if (kind == MBODY_MEASURE) {
      fmi2Status status = settled++ ? fmi2OK : settle(unit);
      worst = status > worst ? status : worst;
      values[k] = mbody_measure(unit->model, MBODY_ADVANCE, 0, entry);
    } else {
      char sentence[80];
      snprintf(sentence, sizeof sentence, "no variable has the value reference %u", which[k]);
      return report(unit, fmi2Error, sentence);
    }
  }
  return worst;
}

OUT fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference which[], size_t count, const double values[]) {
  Unit *unit = component;
  int *waiting = &unit->course.waiting, before = *waiting;
  for (size_t k = 0; k < count; k++) {
    int entry = which[k] < 0x7fffffff ? (int)which[k] : -1, n = 0;
    if (mbody_kind(unit->model, entry) != MBODY_NUMBER) {
      char sentence[100];
      snprintf(sentence, sizeof sentence, "no variable that can be set has the value reference %u", which[k]);
      *waiting = before;
      return report(unit, fmi2Error, sentence);
    }
    while (n < *waiting && unit->entries[n] != entry) n++;
    unit->entries[n] = entry;
    unit->values[n] = values[k];
    if (n == *waiting) ++*waiting;
  }
  if (!*waiting) return fmi2OK;
  int code = mbody_set_several(unit->model, unit->entries, unit->values, *waiting);
  if (code == MBODY_UNFIT) return fmi2OK; /* others may follow that fit; `settle` has the last word */
  if (code == MBODY_GOOD) *waiting = 0;
  else *waiting = before;
  return status_of(unit, code);
}

#define NONE(name, type)                                                                                   \
  OUT fmi2Status name(fmi2Component component, const fmi2ValueReference which[], size_t count, type values[]) { \
    (void)which, (void)values;                                                                             \
    return count ? report(component, fmi2Error, "all variables of this unit are Real") : fmi2OK;           \
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
  return report(component, fmi2Error, "this unit gives no directional derivatives");
}

OUT fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                           const int order[], const double values[]) {
  (void)which, (void)order, (void)values;
  return count ? report(component, fmi2Error, "this unit takes no derivatives of inputs") : fmi2OK;
}

OUT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                            const int order[], double values[]) {
  (void)which, (void)order, (void)values;
  return count ? report(component, fmi2Error, "this unit gives no derivatives of outputs") : fmi2OK;
}

/* ---- states ---------------------------------------------------------------------------------- */

/* A state is one block: its size, the course, the waiting parameters, the model. */
static size_t state_bytes(const Unit *unit) {
  size_t each = sizeof *unit->entries + sizeof *unit->values;
  return sizeof(Course) + (size_t)mbody_entry_count(unit->model) * each + mbody_state_bytes(unit->model);
}

static fmi2Status put_state(Unit *unit, char *to) {
  size_t count = (size_t)mbody_entry_count(unit->model), waiting = (size_t)unit->course.waiting;
  memset(to, 0, state_bytes(unit) - mbody_state_bytes(unit->model));
  memcpy(to, &unit->course, sizeof unit->course);
  to += sizeof unit->course;
  memcpy(to, unit->values, waiting * sizeof *unit->values);
  to += count * sizeof *unit->values;
  memcpy(to, unit->entries, waiting * sizeof *unit->entries);
  to += count * sizeof *unit->entries;
  return status_of(unit, mbody_save(unit->model, to, mbody_state_bytes(unit->model)));
}

static fmi2Status take_state(Unit *unit, const char *from) {
  size_t count = (size_t)mbody_entry_count(unit->model);
  const char *values = from + sizeof unit->course, *entries = values + count * sizeof *unit->values;
  Course course;
  memcpy(&course, from, sizeof course);
  if (course.waiting < 0 || (size_t)course.waiting > count) return report(unit, fmi2Error, "the state is damaged");
  if (mbody_restore(unit->model, entries + count * sizeof *unit->entries, mbody_state_bytes(unit->model)))
    return report(unit, fmi2Error, mbody_message(unit->model));
  unit->course = course;
  memcpy(unit->values, values, (size_t)course.waiting * sizeof *unit->values);
  memcpy(unit->entries, entries, (size_t)course.waiting * sizeof *unit->entries);
  return fmi2OK;
}

OUT fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state) {
  Unit *unit = component;
  if (!*state) *state = malloc(state_bytes(unit));
  return *state ? put_state(unit, *state) : report(unit, fmi2Error, "there is no memory for a state");
}

OUT fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state) {
  return state ? take_state(component, state) : report(component, fmi2Error, "there is no state");
}

OUT fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state) {
  (void)component;
  if (state) {
    free(*state);
    *state = NULL;
  }
  return fmi2OK;
}

OUT fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *bytes) {
  (void)state;
  *bytes = state_bytes(component);
  return fmi2OK;
}

OUT fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, char to[], size_t bytes) {
  if (!state || bytes < state_bytes(component)) return report(component, fmi2Error, "there is no room for the state");
  memcpy(to, state, state_bytes(component));
  return fmi2OK;
}

OUT fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const char from[], size_t bytes, fmi2FMUstate *state) {
  if (bytes != state_bytes(component)) return report(component, fmi2Error, "the state is not one of this unit");
  if (!*state) *state = malloc(bytes);
  if (!*state) return report(component, fmi2Error, "there is no memory for a state");
  memcpy(*state, from, bytes);
  return fmi2OK;
}

/* ---- steps ----------------------------------------------------------------------------------- */

OUT fmi2Status fmi2DoStep(fmi2Component component, double now, double step, fmi2Boolean no_return) {
  Unit *unit = component;
  Course *course = &unit->course;
  char sentence[160];
  (void)no_return;
  if (!course->begun) return report(unit, fmi2Error, "the unit is not initialized");
  if (course->ended) return report(unit, fmi2Discard, "the motion has ended: set a state of before, or reset the unit");
  if (!(fabs(now - course->time) <= SAME_TIME * fmax(fabs(step), fabs(now)))) {
    snprintf(sentence, sizeof sentence, "the step begins at t = %.9g s, but the motion is at %.9g s", now, course->time);
    return report(unit, fmi2Error, sentence);
  }
  if (!(step > 0.0)) {
    snprintf(sentence, sizeof sentence, "a step of %.9g s is none: it must be positive", step);
    return report(unit, fmi2Error, sentence);
  }
  fmi2Status settled = course->waiting ? settle(unit) : fmi2OK;
  if (settled > fmi2Warning) return settled;
  int code = mbody_advance(unit->model, now + step);
  course->ended = code == MBODY_ENDED;
  course->time = course->ended ? mbody_now(unit->model) : code <= MBODY_DOUBT ? now + step : course->time;
  fmi2Status status = status_of(unit, code);
  return status > settled ? status : settled;
}

OUT fmi2Status fmi2CancelStep(fmi2Component component) {
  return report(component, fmi2Error, "steps of this unit cannot be cancelled");
}

OUT fmi2Status fmi2GetStatus(fmi2Component component, int kind, fmi2Status *value) {
  (void)kind, (void)value;
  return report(component, fmi2Discard, "steps of this unit are never pending");
}

OUT fmi2Status fmi2GetRealStatus(fmi2Component component, int kind, double *value) {
  if (kind != fmi2LastSuccessfulTime) return report(component, fmi2Discard, "there is no such status");
  *value = ((Unit *)component)->course.time;
  return fmi2OK;
}

OUT fmi2Status fmi2GetIntegerStatus(fmi2Component component, int kind, int *value) {
  (void)kind, (void)value;
  return report(component, fmi2Discard, "there is no such status");
}

OUT fmi2Status fmi2GetBooleanStatus(fmi2Component component, int kind, fmi2Boolean *value) {
  if (kind != fmi2Terminated) return report(component, fmi2Discard, "there is no such status");
  *value = ((Unit *)component)->course.ended;
  return fmi2OK;
}

OUT fmi2Status fmi2GetStringStatus(fmi2Component component, int kind, fmi2String *value) {
  (void)kind, (void)value;
  return report(component, fmi2Discard, "there is no such status");
}
