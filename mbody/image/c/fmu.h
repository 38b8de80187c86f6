/* What co-simulation units of FMI 2.0 and 3.0 have in common; see fmu.c. */
#ifndef MBODY_FMU_H
#define MBODY_FMU_H

#include "mbody.h"

#ifdef _WIN32
#define OUT __declspec(dllexport)
#else
#define OUT __attribute__((visibility("default")))
#endif

/* fmi2Status and fmi3Status */
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;

typedef struct Unit Unit;
/* Gives a sentence to the importer. */
typedef void Tell(const Unit *unit, Status status, const char *category, const char *sentence);

/* What a unit has beside its model; a state carries it too. */
typedef struct {
  double start, stop, time;
  int running; /* the initialization is over */
  int begun, ended, waiting; /* waiting: parameters that are not allowed beside the others, yet */
} Course;

struct Unit {
  mbody_model *model;
  Tell *tell;
  const void *callbacks; /* of FMI 2.0 */
  void *environment;
  void (*log)(void); /* of FMI 3.0 */
  int returns_early; /* FMI 3.0: a step may end before its time */
  char *name;
  char *original; /* the state when it was instantiated */
  int *entries;   /* parameters that wait for others */
  double *values; /* in the units of the model */
  /* What a number of the model is in SI: of every entry, and of times. */
  const double *factors;
  double second;
  int scaled; /* entries that have a factor */
  Course course;
};

/* Opens `model.image` in a folder; completes `unit`, which is freed where NULL is returned. */
Unit *unit_open(Unit *unit, const char *name, const char *guid, const char *folder);
void unit_free(Unit *unit);

/* Reports a sentence; the status. */
Status unit_report(const Unit *unit, Status status, const char *sentence);

/* The times of the motion, and its tolerance where one is given. */
void unit_experiment(Unit *unit, double start, int stops, double stop, int given, double tolerance);
Status unit_begin(Unit *unit);
Status unit_reset(Unit *unit);
Status unit_step(Unit *unit, double now, double step);

Status unit_get(Unit *unit, const uint32_t which[], size_t count, double values[]);
Status unit_set(Unit *unit, const uint32_t which[], size_t count, const double values[]);

size_t unit_state_bytes(const Unit *unit);
Status unit_save(Unit *unit, void **state);
Status unit_restore(Unit *unit, const void *state);
Status unit_serialize(Unit *unit, const void *state, void *to, size_t bytes);
Status unit_deserialize(Unit *unit, const void *from, size_t bytes, void **state);

#endif
