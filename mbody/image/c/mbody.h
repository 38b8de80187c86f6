/* mbody without Python: models as images, run by the compiled kernels.
 *
 * `mbody export MODEL --to image -o FILE` writes an image: the memory of an assembled mechanism.
 * `mbody compile --images -o FOLDER` writes the kernels as an object file, with this header and
 * mbody.c.  A program is
 *
 *     cc program.c mbody.c linux-x86-64-v3.o -lm
 *
 * Units are those of the model, with angles in radians: SI where it has no others.  `mbody_unit`
 * has the unit of each number and measure, the manifest those of lengths, times and so on.
 *
 * Threads.  There is no global state.  One model is for one thread at a time; any number of models
 * may be used by as many threads at once.
 *
 * Errors.  A function that can fail returns one of the codes below; the sentence is in
 * `mbody_message` of the model (`mbody_open`, which may have no model to give, writes it into the
 * caller's buffer).
 */
#ifndef MBODY_H
#define MBODY_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What a function returns. */
enum {
  MBODY_GOOD = 0,    /* done */
  MBODY_DOUBT = 1,   /* done, but the message says what makes the result doubtful */
  MBODY_ENDED = 2,   /* the mechanism goes no further: loops that do not close, a dead centre … */
  MBODY_REFUSED = 3, /* not possible with this image or value; nothing has changed */
  MBODY_UNFIT = 4,   /* numbers that are right one by one, but not together; nothing has changed */
  MBODY_FAILED = 5   /* a kernel failed, or there is no memory */
};

/* What an entry of an image is. */
enum { MBODY_NUMBER = 1, MBODY_INPUT = 2, MBODY_MEASURE = 3, MBODY_CALL = 4, MBODY_ARRAY = 5, MBODY_STATE = 6 };

/* The motions of an image.  Each keeps instants of its own. */
enum {
  MBODY_TURN = 0,    /* a whole turn of the driver, or the times of the model */
  MBODY_STEP = 1,    /* a driver moved from one value to another: two instants, at rest */
  MBODY_ADVANCE = 2, /* the free motion: one instant, the present one */
  MBODY_RUN = 3      /* a whole free motion */
};

/* A model: one image, opened. */
typedef struct mbody_model mbody_model;

/* ---- opening and closing ----------------------------------------------------------------------
 *
 * mbody_open        A model from the bytes of an image, which are copied.  The magic word, the
 *                   format, the length, every offset, the hash of the kernels' sources and the
 *                   checksum are checked.  NULL where something is wrong; then the sentence is in
 *                   `message`, which has `room` bytes.
 * mbody_open_file   The same, from a file; `path` is UTF-8.
 * mbody_free        Ends a model; NULL is allowed.
 * mbody_message     The sentence of the last call that returned another code than MBODY_GOOD.
 * mbody_manifest    The description of the model: JSON in UTF-8, `*bytes` long, not ended by a
 *                   zero.  It names numbers, measures, bodies and rows of pages in order.
 * mbody_checksum    The checksum of the image as exported.
 */
mbody_model *mbody_open(const void *image, size_t bytes, char *message, size_t room);
mbody_model *mbody_open_file(const char *path, char *message, size_t room);
void mbody_free(mbody_model *model);
const char *mbody_message(const mbody_model *model);
const char *mbody_manifest(const mbody_model *model, size_t *bytes);
uint64_t mbody_checksum(const mbody_model *model);

/* ---- entries ----------------------------------------------------------------------------------
 *
 * Numbers, inputs, measures and states are entries of the image, counted from zero.  The entry of a name
 * is the same whenever the same image is opened.
 *
 * mbody_entry_count       How many entries there are.
 * mbody_kind          MBODY_NUMBER, MBODY_MEASURE …; 0 where there is no such entry.
 * mbody_name          Name of an entry; "" where there is none.
 * mbody_unit          Unit of an entry; "" where it has none.
 * mbody_find_number   Entry of the number of this name, such as "crank.length"; −1: none.
 * mbody_find_measure  Entry of the measure of this name; −1: none.
 * mbody_find_input    Entry of the input of this name; −1: none.
 * mbody_find_state    Entry of the own state of this name; −1: none.
 */
int mbody_entry_count(const mbody_model *model);
int mbody_kind(const mbody_model *model, int entry);
const char *mbody_name(const mbody_model *model, int entry);
const char *mbody_unit(const mbody_model *model, int entry);
int mbody_find_number(const mbody_model *model, const char *name);
int mbody_find_measure(const mbody_model *model, const char *name);
int mbody_find_input(const mbody_model *model, const char *name);
int mbody_find_state(const mbody_model *model, const char *name);

/* ---- numbers ----------------------------------------------------------------------------------
 *
 * mbody_number       Value of a number or an input, start of a state; else not-a-number.
 * mbody_set_number   Another value.  MBODY_REFUSED where it is not allowed (a negative mass), and
 *                    MBODY_UNFIT where it is not allowed beside the other numbers; then the old
 *                    value stays.
 * mbody_set_several  Several numbers at once: all of them, or none.
 * mbody_set_input    Another value of an input.  A free motion that has begun goes on with it as
 *                    it is: only its accelerations are evaluated anew.
 * mbody_set_start    Where a state of the user's own begins: that of the next mbody_start.
 *
 * After a change the loops are closed anew by `mbody_close_loops`; a turn, a step or a motion
 * that finds them open with other numbers closes them first.  A free motion that has begun goes on
 * from its position and speeds, which are fitted to the new numbers.  Where something may open, stick
 * or strike a motion has the numbers of the image: it is refused with others, but for inputs.
 */
double mbody_number(const mbody_model *model, int entry);
int mbody_set_number(mbody_model *model, int entry, double value);
int mbody_set_several(mbody_model *model, const int *entries, const double *values, int count);
int mbody_set_input(mbody_model *model, int entry, double value);
int mbody_set_start(mbody_model *model, int entry, double value);

/* ---- driven motion ----------------------------------------------------------------------------
 *
 * A driven model stands at one position: when it is opened, at the first one of its turn.
 *
 * mbody_close_loops  Closes the loops at the time `close.t` and the drivers' values `close.given`
 *                    (arrays, see below; not-a-number: by the driver's law), from the present
 *                    position.  MBODY_ENDED where they do not close: the position stays.
 * mbody_turn         Follows the turn of the image, always from its own first position; the model
 *                    stands where it stood.  MBODY_ENDED at a dead centre, or where the branch is
 *                    not certain: the instants until there are kept.
 * mbody_step_driver  Moves a driver (counted from zero, as the manifest has them) from where it
 *                    stands to the value `to`, along its branch, at rest; the others stay.
 *                    MBODY_ENDED where the way ends before: the model stands where it stood.
 * mbody_driver       Where a driver stands; not-a-number where that is not known, which it is not
 *                    after it was closed by its law.
 */
int mbody_close_loops(mbody_model *model);
int mbody_turn(mbody_model *model);
int mbody_step_driver(mbody_model *model, int driver, double to);
double mbody_driver(const mbody_model *model, int driver);

/* ---- free motion ------------------------------------------------------------------------------
 *
 * mbody_start    Begins a free motion at the time `first`, near the position `start.q` and the
 *                speeds `start.v` (arrays, see below).  `last` is when it will presumably end:
 *                it gives the first step a scale; not-a-number: as in the image.  Measures and the
 *                page of MBODY_ADVANCE are those of the start.
 * mbody_advance  The motion until the time `until`, not before the present one.  Steps end
 *                there.  A program that calls it in short intervals has a control loop.
 *                MBODY_ENDED where it goes no further: the time that is reached is `mbody_now`.
 * mbody_run      A whole motion, begun anew: all instants `run.times` (array, ascending), with
 *                dense output between the integrator's steps.
 * mbody_now      The time of the free motion; not-a-number where none has begun.
 */
int mbody_start(mbody_model *model, double first, double last);
int mbody_advance(mbody_model *model, double until);
int mbody_run(mbody_model *model);
double mbody_now(const mbody_model *model);

/* ---- results ----------------------------------------------------------------------------------
 *
 * `motion` is MBODY_TURN, MBODY_STEP, MBODY_ADVANCE or MBODY_RUN; instants count from zero.
 *
 * mbody_instants  How many instants the last call for this motion has kept.
 * mbody_time      Time of an instant; not-a-number where there is none.
 * mbody_measure   A measure, or a state, at an instant; not-a-number where there is none.
 * mbody_page      All that is kept of an instant, `*rows` numbers: position (x, y, angle of every
 *                 body, as the manifest has them), velocity, acceleration, then five numbers a
 *                 primitive of a joint: two multipliers, force x, force y and torque on its second
 *                 body.  NULL where there is none; valid until the next call that moves the model.
 * mbody_array     An array of the image by name, `*count` numbers, which may be written: close.t,
 *                 close.given, start.q, start.v, run.times … ; NULL where the image has none.
 */
int mbody_instants(const mbody_model *model, int motion);
double mbody_time(const mbody_model *model, int motion, int instant);
double mbody_measure(const mbody_model *model, int motion, int instant, int entry);
const double *mbody_page(const mbody_model *model, int motion, int instant, int *rows);
double *mbody_array(mbody_model *model, const char *name, int64_t *count);

/* ---- the whole state --------------------------------------------------------------------------
 *
 * mbody_state_bytes  How many bytes a saved state has.
 * mbody_save         Writes the whole state, numbers and results with it, to `state`.  The bytes
 *                    may be kept in a file and restored by another process.  MBODY_REFUSED where
 *                    there is no room for them.
 * mbody_restore      Takes a state back that was saved of the same image.  MBODY_REFUSED where it
 *                    is of another one, or damaged; nothing has changed then.
 */
size_t mbody_state_bytes(const mbody_model *model);
int mbody_save(const mbody_model *model, void *state, size_t bytes);
int mbody_restore(mbody_model *model, const void *state, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
