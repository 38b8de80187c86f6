/* FMI 3.0 for co-simulation: the functions of the standard, by those of fmu.c. */
#include "fmu.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* fmi3PlatformTypes.h and fmi3FunctionTypes.h, as far as they are needed */
typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef const char *fmi3String;
typedef int fmi3Status;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);

static void tell(const Unit *unit, Status status, const char *category, const char *sentence) {
  fmi3LogMessageCallback log = (fmi3LogMessageCallback)unit->log;
  if (log) log(unit->environment, status, category, sentence);
}

OUT const char *fmi3GetVersion(void) { return "3.0"; }

OUT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String folder, bool visible,
                                             bool logging, bool events, bool early, const fmi3ValueReference needed[],
                                             size_t count, fmi3InstanceEnvironment environment,
                                             fmi3LogMessageCallback log, void (*intermediate)(void)) {
  Unit *unit = calloc(1, sizeof *unit);
  (void)visible, (void)events, (void)needed, (void)count, (void)intermediate;
  (void)logging; /* what is reported are reasons, and these always */
  if (!unit) return NULL;
  unit->tell = tell;
  unit->returns_early = early;
  unit->environment = environment;
  unit->log = (void (*)(void))log;
  return unit_open(unit, name, token, folder ? folder : "");
}

OUT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String folder, bool visible,
                                              bool logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
  (void)name, (void)token, (void)folder, (void)visible, (void)logging;
  if (log) log(environment, ERROR, "logStatusError", "this unit is one for co-simulation, not for model exchange");
  return NULL;
}

OUT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String folder, bool visible,
                                                   bool logging, fmi3InstanceEnvironment environment,
                                                   fmi3LogMessageCallback log, void (*clock)(void),
                                                   void (*lock)(void), void (*unlock)(void)) {
  (void)name, (void)token, (void)folder, (void)visible, (void)logging, (void)clock, (void)lock, (void)unlock;
  if (log) log(environment, ERROR, "logStatusError", "this unit is one for co-simulation, not for scheduled execution");
  return NULL;
}

OUT void fmi3FreeInstance(fmi3Instance instance) { unit_free(instance); }

OUT fmi3Status fmi3SetDebugLogging(fmi3Instance instance, bool on, size_t count, const fmi3String categories[]) {
  (void)instance, (void)on, (void)count, (void)categories;
  return OK;
}

OUT fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, bool given, double tolerance, double start, bool stops,
                                           double stop) {
  unit_experiment(instance, start, stops, stop, given, tolerance);
  return OK;
}

OUT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) { return unit_begin(instance); }
OUT fmi3Status fmi3Reset(fmi3Instance instance) { return unit_reset(instance); }

#define NOTHING(name)                         \
  OUT fmi3Status name(fmi3Instance instance) { \
    (void)instance;                           \
    return OK;                                \
  }
NOTHING(fmi3Terminate)
NOTHING(fmi3EnterStepMode)
NOTHING(fmi3EnterEventMode) /* inputs and parameters may jump there; the unit has no events of its own */
NOTHING(fmi3EvaluateDiscreteStates)

#define REFUSED(name, sentence) \
  OUT fmi3Status name(fmi3Instance instance) { return unit_report(instance, ERROR, sentence); }
REFUSED(fmi3EnterConfigurationMode, "this unit has no structural parameters")
REFUSED(fmi3ExitConfigurationMode, "this unit has no structural parameters")

OUT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, bool *again, bool *terminate, bool *nominals, bool *values,
                                        bool *defined, double *next) {
  (void)next;
  *again = *nominals = *values = *defined = false;
  *terminate = ((Unit *)instance)->course.ended;
  return OK;
}

/* ---- variables ------------------------------------------------------------------------------- */

static Status same_count(const Unit *unit, size_t count, size_t values) {
  return count == values ? OK : unit_report(unit, ERROR, "all variables of this unit are scalars: one value each");
}

OUT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference which[], size_t count, double values[], size_t n) {
  Status status = same_count(instance, count, n);
  return status ? status : unit_get(instance, which, count, values);
}

OUT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference which[], size_t count, const double values[], size_t n) {
  Status status = same_count(instance, count, n);
  return status ? status : unit_set(instance, which, count, values);
}

static Status none(const Unit *unit, size_t count) {
  return count ? unit_report(unit, ERROR, "all variables of this unit are Float64") : OK;
}

#define OF_NUMBERS(get, set, type)                                                                            \
  OUT fmi3Status get(fmi3Instance instance, const fmi3ValueReference which[], size_t count, type values[], size_t n) { \
    (void)which, (void)values, (void)n;                                                                       \
    return none(instance, count);                                                                             \
  }                                                                                                           \
  OUT fmi3Status set(fmi3Instance instance, const fmi3ValueReference which[], size_t count, const type values[], size_t n) { \
    (void)which, (void)values, (void)n;                                                                       \
    return none(instance, count);                                                                             \
  }
OF_NUMBERS(fmi3GetFloat32, fmi3SetFloat32, float)
OF_NUMBERS(fmi3GetInt8, fmi3SetInt8, int8_t)
OF_NUMBERS(fmi3GetUInt8, fmi3SetUInt8, uint8_t)
OF_NUMBERS(fmi3GetInt16, fmi3SetInt16, int16_t)
OF_NUMBERS(fmi3GetUInt16, fmi3SetUInt16, uint16_t)
OF_NUMBERS(fmi3GetInt32, fmi3SetInt32, int32_t)
OF_NUMBERS(fmi3GetUInt32, fmi3SetUInt32, uint32_t)
OF_NUMBERS(fmi3GetInt64, fmi3SetInt64, int64_t)
OF_NUMBERS(fmi3GetUInt64, fmi3SetUInt64, uint64_t)
OF_NUMBERS(fmi3GetBoolean, fmi3SetBoolean, bool)
OF_NUMBERS(fmi3GetString, fmi3SetString, fmi3String)

#define OF_BYTES(name, sizes, type)                                                                            \
  OUT fmi3Status name(fmi3Instance instance, const fmi3ValueReference which[], size_t count, sizes bytes[], type values[], size_t n) { \
    (void)which, (void)bytes, (void)values, (void)n;                                                           \
    return none(instance, count);                                                                              \
  }
OF_BYTES(fmi3GetBinary, size_t, const uint8_t *)
OF_BYTES(fmi3SetBinary, const size_t, const uint8_t *const)

#define OF_CLOCKS(name, type)                                                                           \
  OUT fmi3Status name(fmi3Instance instance, const fmi3ValueReference which[], size_t count, type values[]) { \
    (void)which, (void)values;                                                                          \
    return none(instance, count);                                                                       \
  }
OF_CLOCKS(fmi3GetClock, bool)
OF_CLOCKS(fmi3SetClock, const bool)
OF_CLOCKS(fmi3GetShiftDecimal, double)
OF_CLOCKS(fmi3SetShiftDecimal, const double)
OF_CLOCKS(fmi3SetIntervalDecimal, const double)

#define OF_FRACTIONS(name, type)                                                                                         \
  OUT fmi3Status name(fmi3Instance instance, const fmi3ValueReference which[], size_t count, type counters[], type ticks[]) { \
    (void)which, (void)counters, (void)ticks;                                                                            \
    return none(instance, count);                                                                                        \
  }
OF_FRACTIONS(fmi3GetShiftFraction, uint64_t)
OF_FRACTIONS(fmi3SetShiftFraction, const uint64_t)
OF_FRACTIONS(fmi3SetIntervalFraction, const uint64_t)

OUT fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference which[], size_t count, double values[], int qualifiers[]) {
  (void)which, (void)values, (void)qualifiers;
  return none(instance, count);
}

OUT fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference which[], size_t count,
                                       uint64_t counters[], uint64_t ticks[], int qualifiers[]) {
  (void)which, (void)counters, (void)ticks, (void)qualifiers;
  return none(instance, count);
}

OUT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference which, size_t *count) {
  (void)which, (void)count;
  return unit_report(instance, ERROR, "this unit lists no dependencies of its variables");
}

OUT fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference which, size_t elements[],
                                           fmi3ValueReference on[], size_t others[], int kinds[], size_t count) {
  (void)which, (void)elements, (void)on, (void)others, (void)kinds, (void)count;
  return unit_report(instance, ERROR, "this unit lists no dependencies of its variables");
}

#define OF_DERIVATIVES(name)                                                                             \
  OUT fmi3Status name(fmi3Instance instance, const fmi3ValueReference unknown[], size_t unknowns,        \
                      const fmi3ValueReference known[], size_t knowns, const double seed[], size_t seeds, \
                      double found[], size_t count) {                                                    \
    (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)seed, (void)seeds, (void)found, (void)count; \
    return unit_report(instance, ERROR, "this unit gives no derivatives");                               \
  }
OF_DERIVATIVES(fmi3GetDirectionalDerivative)
OF_DERIVATIVES(fmi3GetAdjointDerivative)

OUT fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference which[], size_t count,
                                        const int32_t orders[], double values[], size_t n) {
  (void)which, (void)orders, (void)values, (void)n;
  return count ? unit_report(instance, ERROR, "this unit gives no derivatives") : OK;
}

/* ---- states ---------------------------------------------------------------------------------- */

OUT fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state) { return unit_save(instance, state); }
OUT fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state) { return unit_restore(instance, state); }

OUT fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state) {
  (void)instance;
  if (state) {
    free(*state);
    *state = NULL;
  }
  return OK;
}

OUT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *bytes) {
  (void)state;
  *bytes = unit_state_bytes(instance);
  return OK;
}

OUT fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, uint8_t to[], size_t bytes) {
  return unit_serialize(instance, state, to, bytes);
}

OUT fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const uint8_t from[], size_t bytes, fmi3FMUState *state) {
  return unit_deserialize(instance, from, bytes, state);
}

/* ---- steps ----------------------------------------------------------------------------------- */

OUT fmi3Status fmi3DoStep(fmi3Instance instance, double now, double step, bool final, bool *event, bool *terminate,
                          bool *early, double *reached) {
  Unit *unit = instance;
  Status status = unit_step(unit, now, step);
  (void)final;
  *event = *early = false;
  *terminate = unit->course.ended;
  *reached = unit->course.time;
  /* the motion ends within the step: an importer that allows it hears so at the time that is reached */
  *early = unit->returns_early && status == DISCARD && unit->course.ended;
  return *early ? WARNING : status;
}

/* ---- of the other kinds of units, which importers look up all the same ------------------------ */

#define OTHER(name, ...)                                                                                  \
  OUT fmi3Status name(fmi3Instance instance, __VA_ARGS__) {                                               \
    (void)a, (void)b;                                                                                     \
    return unit_report(instance, ERROR, "this unit is one for co-simulation alone");                      \
  }
REFUSED(fmi3EnterContinuousTimeMode, "this unit is one for co-simulation alone")
OTHER(fmi3SetContinuousStates, const double a[], size_t b)
OTHER(fmi3GetContinuousStates, double a[], size_t b)
OTHER(fmi3GetContinuousStateDerivatives, double a[], size_t b)
OTHER(fmi3GetNominalsOfContinuousStates, double a[], size_t b)
OTHER(fmi3GetEventIndicators, double a[], size_t b)
OTHER(fmi3ActivateModelPartition, fmi3ValueReference a, double b)

OUT fmi3Status fmi3SetTime(fmi3Instance instance, double time) {
  (void)time;
  return unit_report(instance, ERROR, "this unit is one for co-simulation alone");
}

OUT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, bool final, bool *event, bool *terminate) {
  (void)final, (void)event, (void)terminate;
  return unit_report(instance, ERROR, "this unit is one for co-simulation alone");
}

OUT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count) {
  (void)instance;
  *count = 0;
  return OK;
}

OUT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count) {
  (void)instance;
  *count = 0;
  return OK;
}
