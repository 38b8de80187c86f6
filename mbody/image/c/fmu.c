/* Co-simulation units: one binary for all models of a machine, built once with the kernels (`mbody
 * compile --fmu`).  The model is resources/model.image, an image of mbody.  This file has what FMI 2.0
 * (fmi2.c) and FMI 3.0 (fmi3.c) share.
 *
 * What modelDescription.xml says for it:
 *   value references      entries of the image: numbers are parameters (variability "tunable";
 *                         "fixed" is right too), inputs are inputs, measures are outputs, own states
 *                         outputs that begin at their start; all Real, or Float64, and in SI.  The
 *                         time has INT32_MAX.
 *   guid                  {sixteen hexadecimal digits of the image's checksum}; any, where it has
 *   (instantiationToken)  none.
 *   CoSimulation          canHandleVariableCommunicationStepSize, canGetAndSetFMUstate,
 *                         canSerializeFMUstate; and canNotUseMemoryManagementFunctions.
 *
 * Parameters may change at any communication point: the motion then begins anew from its position
 * and speeds, fitted to the new numbers.  Inputs keep their value during a step; where they change,
 * the motion goes on as it is.  Where it goes no further, a step is Discard.
 */
#include "fmu.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A time that is nearer than this part to another one is the same. */
static const double SAME_TIME = 1e-9;
/* Tolerances that an importer may ask for; others are as good as none. */
static const double FINEST = 1e-14, COARSEST = 0.1;
/* The value reference of the time. */
static const uint32_t TIME_REFERENCE = INT32_MAX;

Status unit_report(const Unit *unit, Status status, const char *sentence) {
  static const char *const category[] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};
  unit->tell(unit, status, category[status], sentence);
  return status;
}

/* The status of what a function of mbody.h has returned. */
static Status status_of(const Unit *unit, int code) {
  static const Status status[] = {OK, WARNING, DISCARD, DISCARD, DISCARD, ERROR};
  return code ? unit_report(unit, status[code], mbody_message(unit->model)) : OK;
}

void unit_free(Unit *unit) {
  if (!unit) return;
  mbody_free(unit->model);
  free(unit->name);
  free(unit->original);
  free(unit->entries);
  free(unit->values);
  free(unit);
}

/* Why a model is not one for this unit; empty where it is. */
static void check(const Unit *unit, const char *guid, char *message, size_t room) {
  char own[24];
  unsigned long long sum = (unsigned long long)mbody_checksum(unit->model);
  snprintf(own, sizeof own, "{%016llx}", sum);
  if (sum && guid && strcmp(guid, own))
    snprintf(message, room, "modelDescription.xml is that of another model: its guid is %.80s, that of the image %s", guid, own);
  else if (!mbody_array(unit->model, "advance.times", NULL))
    snprintf(message, room, "the image has no free motion, which a unit for co-simulation needs");
}

Unit *unit_open(Unit *unit, const char *name, const char *guid, const char *folder) {
  static const char file[] = "model.image";
  char message[700] = "";
  size_t length = strlen(folder);
  char *path = malloc(length + sizeof file + 1);
  unit->name = malloc(strlen(name ? name : "") + 1);
  if (unit->name) strcpy(unit->name, name ? name : "");
  if (path) {
    int ends = length && (folder[length - 1] == '/' || folder[length - 1] == '\\');
    sprintf(path, "%s%s%s", folder, ends ? "" : "/", file);
    unit->model = mbody_open_file(path, message, sizeof message);
  }
  free(path);
  if (unit->model) {
    size_t bytes = mbody_state_bytes(unit->model), count = (size_t)mbody_entry_count(unit->model) + 1;
    int64_t factors = 0, seconds = 0;
    check(unit, guid, message, sizeof message);
    unit->factors = mbody_array(unit->model, "si.factors", &factors);
    const double *second = mbody_array(unit->model, "si.second", &seconds);
    unit->second = seconds == 1 ? *second : 1.0;
    if (factors < 1 || factors > (int64_t)count) unit->factors = NULL;
    unit->scaled = unit->factors ? (int)factors : 0;
    unit->original = malloc(bytes);
    unit->entries = malloc(count * sizeof *unit->entries);
    unit->values = malloc(count * sizeof *unit->values);
    if (unit->name && unit->entries && unit->values && unit->original && !mbody_save(unit->model, unit->original, bytes) && !message[0])
      return unit;
  }
  unit_report(unit, ERROR, message[0] ? message : "there is no memory for the unit");
  unit_free(unit);
  return NULL;
}

void unit_experiment(Unit *unit, double start, int stops, double stop, int given, double tolerance) {
  static const char *const name[] = {"motion.relative", "motion.absolute"};
  unit->course.start = unit->course.time = start;
  unit->course.stop = stops ? stop : NAN;
  for (int n = 0; n < 2 && given && tolerance >= FINEST && tolerance <= COARSEST; n++) {
    double *own = mbody_array(unit->model, name[n], NULL);
    if (own) *own = tolerance;
  }
}

/* What a number of the model is in SI. */
static double factor_of(const Unit *unit, int entry) {
  return entry < unit->scaled ? unit->factors[entry] : 1.0;
}

/* The parameters that wait are set now or never, and the motion is at the present time. */
static Status settle(Unit *unit) {
  Course *course = &unit->course;
  int count = course->waiting;
  course->waiting = 0;
  if (count) {
    int code = mbody_set_several(unit->model, unit->entries, unit->values, count);
    if (code) return status_of(unit, code);
  }
  if (!course->begun) {
    Status status = status_of(unit, mbody_start(unit->model, course->start / unit->second, course->stop / unit->second));
    course->begun = status <= WARNING;
    return status == DISCARD ? ERROR : status;
  }
  return course->ended ? OK : status_of(unit, mbody_advance(unit->model, mbody_now(unit->model)));
}

Status unit_begin(Unit *unit) {
  unit->course.begun = 0;
  unit->course.running = 1;
  return settle(unit);
}

Status unit_reset(Unit *unit) {
  memset(&unit->course, 0, sizeof unit->course);
  return status_of(unit, mbody_restore(unit->model, unit->original, mbody_state_bytes(unit->model)));
}

Status unit_step(Unit *unit, double now, double step) {
  Course *course = &unit->course;
  char sentence[160];
  if (!course->begun) return unit_report(unit, ERROR, "the unit is not initialized");
  if (course->ended) return unit_report(unit, DISCARD, "the motion has ended: set a state of before, or reset the unit");
  if (!(fabs(now - course->time) <= SAME_TIME * fmax(fabs(step), fabs(now)))) {
    snprintf(sentence, sizeof sentence, "the step begins at t = %.9g s, but the motion is at %.9g s", now, course->time);
    return unit_report(unit, ERROR, sentence);
  }
  if (!(step > 0.0)) {
    snprintf(sentence, sizeof sentence, "a step of %.9g s is none: it must be positive", step);
    return unit_report(unit, ERROR, sentence);
  }
  Status settled = course->waiting ? settle(unit) : OK;
  if (settled > WARNING) return settled;
  int code = mbody_advance(unit->model, (now + step) / unit->second);
  course->ended = code == MBODY_ENDED;
  course->time = course->ended ? mbody_now(unit->model) * unit->second : code <= MBODY_DOUBT ? now + step : course->time;
  Status status = status_of(unit, code);
  return status > settled ? status : settled;
}

/* ---- variables ------------------------------------------------------------------------------- */

static int entry_of(uint32_t reference) { return reference < INT32_MAX ? (int)reference : -1; }

Status unit_get(Unit *unit, const uint32_t which[], size_t count, double values[]) {
  Status worst = OK;
  int settled = 0;
  for (size_t k = 0; k < count; k++) {
    int entry = entry_of(which[k]), kind = mbody_kind(unit->model, entry);
    if (which[k] == TIME_REFERENCE) {
      values[k] = unit->course.time;
    } else if (kind == MBODY_NUMBER || kind == MBODY_INPUT) {
      values[k] = mbody_number(unit->model, entry);
      for (int n = 0; n < unit->course.waiting; n++)
        if (unit->entries[n] == entry) values[k] = unit->values[n];
      values[k] *= factor_of(unit, entry);
    } else if (kind == MBODY_MEASURE || kind == MBODY_STATE) {
      Status status = settled++ ? OK : settle(unit);
      worst = status > worst ? status : worst;
      values[k] = mbody_measure(unit->model, MBODY_ADVANCE, 0, entry) * factor_of(unit, entry);
    } else {
      char sentence[80];
      snprintf(sentence, sizeof sentence, "no variable has the value reference %lu", (unsigned long)which[k]);
      return unit_report(unit, ERROR, sentence);
    }
  }
  return worst;
}

/* An input, or the start of a state, which no other number decides about. */
static Status set_at_once(Unit *unit, int entry, int kind, double value) {
  if (kind == MBODY_INPUT) return status_of(unit, mbody_set_input(unit->model, entry, value));
  if (unit->course.running)
    return unit_report(unit, ERROR, "the motion has begun: a state can be set before only");
  return status_of(unit, mbody_set_start(unit->model, entry, value));
}

Status unit_set(Unit *unit, const uint32_t which[], size_t count, const double values[]) {
  int *waiting = &unit->course.waiting, before = *waiting;
  for (size_t k = 0; k < count; k++) {
    int entry = entry_of(which[k]), n = 0, kind = mbody_kind(unit->model, entry);
    double value = values[k] / factor_of(unit, entry);
    if (kind == MBODY_INPUT || kind == MBODY_STATE) {
      Status status = set_at_once(unit, entry, kind, value);
      if (status) return status;
      continue;
    }
    if (kind != MBODY_NUMBER) {
      char sentence[100];
      snprintf(sentence, sizeof sentence, "no variable that can be set has the value reference %lu", (unsigned long)which[k]);
      *waiting = before;
      return unit_report(unit, ERROR, sentence);
    }
    while (n < *waiting && unit->entries[n] != entry) n++;
    unit->entries[n] = entry;
    unit->values[n] = value;
    if (n == *waiting) ++*waiting;
  }
  if (!*waiting) return OK;
  int code = mbody_set_several(unit->model, unit->entries, unit->values, *waiting);
  if (code == MBODY_UNFIT) return OK; /* others may follow that fit; `settle` has the last word */
  *waiting = code ? before : 0;
  return status_of(unit, code);
}

/* ---- states ---------------------------------------------------------------------------------- */

/* A state is one block: the course, the values and entries that wait, the model. */
static size_t head_bytes(const Unit *unit) {
  size_t each = sizeof *unit->entries + sizeof *unit->values;
  return sizeof(Course) + (size_t)mbody_entry_count(unit->model) * each;
}

size_t unit_state_bytes(const Unit *unit) { return head_bytes(unit) + mbody_state_bytes(unit->model); }

Status unit_save(Unit *unit, void **state) {
  size_t head = head_bytes(unit), count = (size_t)mbody_entry_count(unit->model), waiting = (size_t)unit->course.waiting;
  if (!*state) *state = malloc(unit_state_bytes(unit));
  char *to = *state;
  if (!to) return unit_report(unit, ERROR, "there is no memory for a state");
  memset(to, 0, head);
  memcpy(to, &unit->course, sizeof unit->course);
  memcpy(to + sizeof unit->course, unit->values, waiting * sizeof *unit->values);
  memcpy(to + sizeof unit->course + count * sizeof *unit->values, unit->entries, waiting * sizeof *unit->entries);
  return status_of(unit, mbody_save(unit->model, to + head, mbody_state_bytes(unit->model)));
}

Status unit_restore(Unit *unit, const void *state) {
  size_t count = (size_t)mbody_entry_count(unit->model);
  const char *from = state, *values = from + sizeof unit->course, *entries = values + count * sizeof *unit->values;
  Course course;
  if (!state) return unit_report(unit, ERROR, "there is no state");
  memcpy(&course, from, sizeof course);
  if (course.waiting < 0 || (size_t)course.waiting > count) return unit_report(unit, ERROR, "the state is damaged");
  if (mbody_restore(unit->model, from + head_bytes(unit), mbody_state_bytes(unit->model)))
    return unit_report(unit, ERROR, mbody_message(unit->model));
  unit->course = course;
  memcpy(unit->values, values, (size_t)course.waiting * sizeof *unit->values);
  memcpy(unit->entries, entries, (size_t)course.waiting * sizeof *unit->entries);
  return OK;
}

Status unit_serialize(Unit *unit, const void *state, void *to, size_t bytes) {
  if (!state || bytes < unit_state_bytes(unit)) return unit_report(unit, ERROR, "there is no room for the state");
  memcpy(to, state, unit_state_bytes(unit));
  return OK;
}

Status unit_deserialize(Unit *unit, const void *from, size_t bytes, void **state) {
  if (bytes != unit_state_bytes(unit)) return unit_report(unit, ERROR, "the state is not one of this unit");
  if (!*state) *state = malloc(bytes);
  if (!*state) return unit_report(unit, ERROR, "there is no memory for a state");
  memcpy(*state, from, bytes);
  return OK;
}
