/* See mbody.h.  The bytes of an image are described in docs/images.md.
 *
 * A model is one block of memory: the bytes of the image, then what this file adds (`Shell`, and
 * copies of positions).  A state is a copy of the block.
 */
#include "mbody.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#endif

/* The kernels, and the hash of their sources in hexadecimal. */
typedef int32_t Kernel(const int64_t *arguments, int64_t *results);
Kernel mbody_set_numbers_words, mbody_measures_words, mbody_close_at_words, mbody_follow_words,
    mbody_begin_motion_words, mbody_runge_kutta_words, mbody_advance_motion_words;
#ifdef MBODY_SHARED_CORE /* Windows: the kernels are in a DLL */
__declspec(dllimport)
#endif
extern const char mbody_sources[];

enum { FORMAT = 1, HEADER = 16, ENTRY = 5, HASH_BYTES = 32, LINE = 64, SENTENCE = 640 };
/* words of the header */
enum { MAGIC, VERSION, BYTES, MOVED, MOVED_COUNT, TABLE, TABLE_COUNT, TEXT, TEXT_BYTES, HASH, SUM = 13 };
/* mbody/kernels/step_state.py: slots, and what the integrator returns */
enum { TIME = 0, NEXT, STEPS, DELIVERED = 6, LAST_STEP_ALLOWED = 18, ARTIFICIAL_ENERGY = 24, ARTIFICIAL_LIMIT, SLOTS = 36 };
enum { DONE, MORE, STEP_VANISHED, NOT_FINITE, STIFF, LAST_STEP, SINGULAR_AHEAD, BRANCH_UNCERTAIN };
/* mbody/kernels/advance.py: what comes next, and what has happened */
enum { STARTING = 5, JUMPED };
enum {
  NOT_QUIET = 9, ZERO, IMPACT, COLLISION, DECIDED, CONTINUED, NO_IMPACT, NO_MODES, NO_COLLISION, INDEFINITE, POLE,
  IMPACTS_WITHOUT_END, CHANGES_WITHOUT_END, ROOM, UNBROKEN
};
/* mbody/kernels/continuation.py: progress, what `follow` returns, what the path parameter is */
enum { INSTANTS, REACHED, UNBALANCED = 4, BRANCH_UNSURE = 6, PROGRESS = 7 };
enum { STUCK = 1, LOST = 2 };
enum { BY_TIME, BY_DRIVER, BY_INSTANT };
/* mbody/kernels/image_calls.py: what `begin_motion` returns */
enum { BEGUN, OPEN, NO_VALUE, MASSLESS };
/* Reactions may leave this part of the loads unbalanced, as in mbody/analysis/driven/path_following.py. */
static const double UNBALANCED_PART = 1e-7;

/* The calls of an image, with the arguments of each: B bundle, 1 2 3 array with so many axes,
 * d number, i integer; and the kernel for what may open, stick or strike, which takes two bundles. */
enum {
  DRIVEN_NUMBERS, FREE_NUMBERS, CLOSE, TURN, TURN_MEASURES, STEP, STEP_MEASURES,
  BEGIN, ADVANCE, ADVANCE_MEASURES, RUN, RUN_MEASURES, CALLS
};
static const struct { const char *name, *form; Kernel *kernel, *contact; } CALL[CALLS] = {
  {"numbers.driven", "BBB", mbody_set_numbers_words, NULL},
  {"numbers.free", "BBB", mbody_set_numbers_words, NULL},
  {"close", "BBd1dd", mbody_close_at_words, NULL},
  {"turn", "BBBB", mbody_follow_words, NULL},
  {"turn.measures", "BB132", mbody_measures_words, NULL},
  {"step", "BBBB", mbody_follow_words, NULL},
  {"step.measures", "BB132", mbody_measures_words, NULL},
  {"begin", "BBBBB2i", mbody_begin_motion_words, NULL},
  {"advance", "BBBBBBdi", mbody_runge_kutta_words, mbody_advance_motion_words},
  {"advance.measures", "BB132", mbody_measures_words, NULL},
  {"run", "BBBBBBdi", mbody_runge_kutta_words, mbody_advance_motion_words},
  {"run.measures", "BB132", mbody_measures_words, NULL},
};
/* The motions: their call, and the names of their arrays. */
static const struct { const char *name; int call; const char *times, *pages; } MOTION[4] = {
  {"turn", TURN, "t", "output"},
  {"step", STEP, "t", "output"},
  {"advance", ADVANCE, "times", "pages"},
  {"run", RUN, "times", "pages"},
};

typedef struct { double *at; int64_t count; } Array;
typedef struct { Array times, pages, measured, progress, nearest, s, given, chords, work, reach; } Motion;

/* What a state has beside the image. */
typedef struct {
  int64_t position_old, home_old, motion_old; /* numbers changed since closed, or begun */
  int64_t inputs_old;                         /* inputs changed since the last evaluation */
  int64_t begun, kept[4];                     /* a motion has begun; instants of each motion */
} Shell;

struct mbody_model {
  char *raw, *memory;
  int64_t bytes, block, rows, numbers, measures;
  int64_t *number_entry;
  uint64_t sum;
  int64_t *call[CALLS];
  Kernel *kernel[CALLS];
  Motion motion[4];
  Array q, close_t, close_given, start_times, start_q, start_v, start_own, begin_page, goes_on, state, y, until[4];
  /* Of what may open, stick or strike: what comes next, the record of the present instant, the
   * numbers that it was made with, what has happened, and which contact point was struck last */
  Array stage, page, made_with, events, happened, struck;
  Shell *shell;
  /* the first position of the turn; time and drivers there; copies while a call may fail */
  double *home, *home_given, home_t, reach, first, span;
  double *old_q, *old_numbers, *old_start, *old_y, old_state[SLOTS];
  char message[SENTENCE];
};

static int say(char *to, size_t room, int code, const char *text, va_list values) {
  if (to && room) vsnprintf(to, room, text, values);
  return code;
}

/* A sentence into the model's message; the code. */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
static int because(mbody_model *model, int code, const char *text, ...) {
  va_list values;
  va_start(values, text);
  say(model->message, sizeof model->message, code, text, values);
  va_end(values);
  return code;
}

/* ---- reading an image ------------------------------------------------------------------------ */

static int64_t *words(const mbody_model *model) { return (int64_t *)(void *)model->memory; }

/* Σ (2n + 1) word n, modulo 2⁶⁴, without the word of the checksum: no single change leaves it. */
static uint64_t sum_of(const char *data, int64_t count, int64_t without) {
  uint64_t sum = 0, word;
  for (int64_t n = 0; n < count; n++) {
    if (n == without) continue;
    memcpy(&word, data + 8 * n, 8);
    sum += (uint64_t)(2 * n + 1) * word;
  }
  return sum ? sum : 1;
}

/* What no other check has seen: a number, or a text. */
static int check_sum(mbody_model *model) {
  if ((uint64_t)words(model)[SUM] == model->sum) return MBODY_GOOD;
  return because(model, MBODY_REFUSED, "the image is damaged: its checksum is not that of its bytes");
}

/* Whether `count` words from a byte offset on lie within the image. */
static int within(const mbody_model *model, int64_t offset, int64_t count) {
  return offset >= 0 && offset % 8 == 0 && offset <= model->bytes && count >= 0 &&
         count <= (model->bytes - offset) / 8;
}

static int is_text(const mbody_model *model, int64_t offset) {
  if (offset < 0 || offset >= model->bytes) return 0;
  return memchr(model->memory + offset, 0, (size_t)(model->bytes - offset)) != NULL;
}

static const int64_t *entry_at(const mbody_model *model, int64_t n) {
  return words(model) + words(model)[TABLE] + ENTRY * n;
}

static const char *text_at(const mbody_model *model, int64_t n, int which) {
  return model->memory + entry_at(model, n)[which];
}

static int64_t find(const mbody_model *model, int kind, const char *name) {
  for (int64_t n = 0; name && n < words(model)[TABLE_COUNT]; n++)
    if (entry_at(model, n)[0] == kind && !strcmp(text_at(model, n, 3), name)) return n;
  return -1;
}

/* Header: lengths, places of the lists, hash of the sources. */
static int check_header(mbody_model *model, int64_t bytes) {
  const int64_t *word = words(model);
  static const char magic[] = "mbodyimg";
  char hash[2 * HASH_BYTES + 1] = "";
  const unsigned char *made = (const unsigned char *)(word + HASH);
  if (bytes < 8 * HEADER || memcmp(word, magic, 8))
    return because(model, MBODY_REFUSED, "this is no image of mbody: it does not begin with '%s'", magic);
  if (word[VERSION] != FORMAT)
    return because(model, MBODY_REFUSED,
                   "the image has format %" PRId64 ", this program reads format %d: export it with "
                   "the mbody that this program was made with", word[VERSION], FORMAT);
  if (word[BYTES] != bytes || bytes % 8)
    return because(model, MBODY_REFUSED,
                   "the image has %" PRId64 " bytes, it should have %" PRId64 ": it was cut off",
                   bytes, word[BYTES]);
  model->bytes = bytes;
  model->sum = sum_of(model->memory, bytes / 8, SUM);
  for (int n = 0; n < HASH_BYTES; n++) snprintf(hash + 2 * n, 3, "%02x", made[n]);
  if (strncmp(hash, mbody_sources, sizeof hash - 1))
    return because(model, MBODY_REFUSED,
                   "the image is for kernels of other sources (%.8s … instead of %.8s …): export "
                   "it, and compile the kernels, with one version of mbody", hash, mbody_sources);
  if (word[MOVED] < HEADER || word[TABLE] < HEADER || word[MOVED] > bytes / 8 ||
      word[TABLE] > bytes / 8 || !within(model, 8 * word[MOVED], word[MOVED_COUNT]) ||
      word[TABLE_COUNT] < 0 || word[TABLE_COUNT] > bytes / (8 * ENTRY) ||
      !within(model, 8 * word[TABLE], ENTRY * word[TABLE_COUNT]) || !within(model, word[TEXT], 0) ||
      word[TEXT_BYTES] < 0 || word[TEXT_BYTES] > bytes - word[TEXT])
    return because(model, MBODY_REFUSED, "the image is damaged: a list lies outside its %" PRId64 " bytes", bytes);
  return MBODY_GOOD;
}

/* Every word of the list becomes an address. */
static int relocate(mbody_model *model) {
  int64_t *word = words(model), *list = word + word[MOVED], count = word[MOVED_COUNT];
  int64_t table = word[TABLE], table_end = table + ENTRY * word[TABLE_COUNT];
  for (int64_t n = 0; n < count; n++) {
    int64_t which = list[n], offset;
    int own = which >= word[MOVED] && which < word[MOVED] + count;
    if (which < HEADER || which >= model->bytes / 8 || own || (which >= table && which < table_end))
      return because(model, MBODY_REFUSED, "the image is damaged: relocation %" PRId64 " is of no word of its data", n);
    offset = word[which];
    if (offset < 0 || offset > model->bytes)
      return because(model, MBODY_REFUSED,
                     "the image is damaged: word %" PRId64 " points outside its %" PRId64 " bytes",
                     which, model->bytes);
    word[which] = offset + (int64_t)(intptr_t)model->memory;
  }
  return MBODY_GOOD;
}

/* The arguments of a call: addresses within the image, arrays that fit. */
static int check_call(mbody_model *model, int64_t entry, const char *form) {
  int64_t at = entry_at(model, entry)[1] / 8, last = model->bytes / 8;
  const int64_t *word = words(model);
  for (; *form; form++) {
    int64_t size = 1, axes = *form >= '1' && *form <= '3' ? *form - '0' : 0, offset;
    if (at + 1 + axes > last) return 0;
    offset = word[at] - (int64_t)(intptr_t)model->memory;
    if (*form == 'd' || *form == 'i') {
      at++;
      continue;
    }
    if (!within(model, offset, 1)) return 0;
    for (int64_t n = 1; n <= axes; n++) {
      if (word[at + n] < 0 || (word[at + n] && size > last / word[at + n])) return 0;
      size *= word[at + n];
    }
    if (!within(model, offset, size)) return 0;
    at += 1 + axes;
  }
  return 1;
}

static int check_entries(mbody_model *model) {
  for (int64_t n = 0; n < words(model)[TABLE_COUNT]; n++) {
    const int64_t *entry = entry_at(model, n);
    int64_t kind = entry[0], count = kind == MBODY_ARRAY ? entry[2] : 1;
    int good = kind >= MBODY_NUMBER && kind <= MBODY_STATE && is_text(model, entry[3]) && is_text(model, entry[4]);
    if (kind != MBODY_MEASURE) /* of `page.rows` only the count means anything */
      good = good && (within(model, entry[1], count) || (entry[1] == 0 && entry[2] >= 0));
    if (!good)
      return because(model, MBODY_REFUSED, "the image is damaged: its entry %" PRId64 " is wrong", n);
    model->numbers += kind == MBODY_NUMBER;
    model->measures += kind == MBODY_MEASURE;
    for (int k = 0; kind == MBODY_CALL && k < CALLS; k++) {
      if (strcmp(text_at(model, n, 3), CALL[k].name)) continue;
      int contact = CALL[k].contact && entry[2] == 2;
      model->kernel[k] = contact ? CALL[k].contact : CALL[k].kernel;
      if (!check_call(model, n, contact ? "BB" : CALL[k].form))
        return because(model, MBODY_REFUSED, "the image is damaged: arguments of its call '%s' are wrong", CALL[k].name);
      model->call[k] = words(model) + entry[1] / 8;
    }
  }
  return MBODY_GOOD;
}

/* An array that a call needs, with at least so many numbers. */
static int need(mbody_model *model, Array *array, const char *owner, const char *name, int64_t least) {
  char whole[96];
  int64_t n;
  snprintf(whole, sizeof whole, "%s.%s", owner, name);
  n = find(model, MBODY_ARRAY, whole);
  if (n < 0 || entry_at(model, n)[2] < least || !within(model, entry_at(model, n)[1], entry_at(model, n)[2]))
    return because(model, MBODY_REFUSED, "the image is damaged: its array '%s' is missing or too short", whole);
  array->at = (double *)(void *)(model->memory + entry_at(model, n)[1]);
  array->count = entry_at(model, n)[2];
  return MBODY_GOOD;
}

static int find_arrays(mbody_model *model) {
  int wrong = 0;
  int64_t rows = find(model, MBODY_ARRAY, "page.rows");
  model->rows = rows < 0 ? 0 : entry_at(model, rows)[2];
  if (model->rows < 0 || model->rows > model->bytes / 8 || model->measures > model->bytes / 8)
    return because(model, MBODY_REFUSED, "the image is damaged: its pages have %" PRId64 " rows", model->rows);
  if (model->call[CLOSE] || model->call[TURN] || model->call[STEP]) {
    wrong |= need(model, &model->q, "driven", "q", 1);
    wrong |= need(model, &model->close_t, "close", "t", 1);
    wrong |= need(model, &model->close_given, "close", "given", 0);
    if (!model->call[CLOSE]) wrong |= because(model, MBODY_REFUSED, "the image is damaged: it has no call 'close'");
  }
  for (int m = 0; !wrong && m < 4; m++) {
    Motion *motion = &model->motion[m];
    const char *name = MOTION[m].name;
    if (!model->call[MOTION[m].call]) continue;
    wrong |= need(model, &motion->times, name, MOTION[m].times, 1);
    wrong |= need(model, &motion->pages, name, MOTION[m].pages, motion->times.count * model->rows);
    wrong |= need(model, &motion->measured, name, "measured", motion->times.count * model->measures);
    if (m <= MBODY_STEP) {
      wrong |= need(model, &motion->progress, name, "progress", PROGRESS);
      wrong |= need(model, &motion->nearest, name, "nearest", 0);
      wrong |= need(model, &motion->s, name, "s", motion->times.count);
      wrong |= need(model, &motion->given, name, "given", 6 * (m == MBODY_STEP) * model->close_given.count);
    } else {
      wrong |= need(model, &motion->work, name, "work", 0);
      wrong |= need(model, &model->until[m], name, "until", 1);
    }
    if (m != MBODY_STEP) continue;
    wrong |= need(model, &motion->reach, name, "reach", 1);
    wrong |= need(model, &motion->chords, name, "chords", 0);
    if (motion->times.count != 2)
      wrong |= because(model, MBODY_REFUSED, "the image is damaged: its step has not two instants");
  }
  if (!wrong && (model->call[BEGIN] || model->call[ADVANCE] || model->call[RUN])) {
    if (!model->call[BEGIN]) wrong |= because(model, MBODY_REFUSED, "the image is damaged: it has no call 'begin'");
    wrong |= need(model, &model->start_times, "start", "times", 2);
    wrong |= need(model, &model->start_q, "start", "q", 1);
    wrong |= need(model, &model->start_v, "start", "v", model->start_q.count);
    wrong |= need(model, &model->start_own, "start", "own", 0);
    wrong |= need(model, &model->begin_page, "begin", "page", model->rows);
    wrong |= need(model, &model->goes_on, "begin", "goes_on", 1);
    wrong |= need(model, &model->state, "motion", "state", SLOTS);
    wrong |= need(model, &model->y, "motion", "y", 2 * model->start_q.count + model->start_own.count);
  }
  if (!wrong && find(model, MBODY_ARRAY, "motion.stage") >= 0) {
    wrong |= need(model, &model->stage, "motion", "stage", 1);
    wrong |= need(model, &model->page, "motion", "page", model->rows);
    wrong |= need(model, &model->made_with, "motion", "numbers", model->numbers);
    wrong |= need(model, &model->events, "motion", "events", 3);
    wrong |= need(model, &model->happened, "motion", "happened", 1);
    wrong |= need(model, &model->struck, "motion", "struck", 1);
  }
  for (int64_t n = 0; n < words(model)[TABLE_COUNT]; n++) {
    const int64_t *entry = entry_at(model, n);
    if ((entry[0] == MBODY_MEASURE || entry[0] == MBODY_STATE) && (entry[2] < 0 || entry[2] >= model->measures))
      wrong |= because(model, MBODY_REFUSED, "the image is damaged: the place of '%s' is wrong", text_at(model, n, 3));
  }
  return wrong ? MBODY_REFUSED : MBODY_GOOD;
}

static void copy(double *to, const double *from, int64_t count) {
  if (count > 0) memcpy(to, from, (size_t)count * sizeof *to);
}

/* Memory for the bytes of an image and for what is added to it. */
static int take(mbody_model *model, const char *image, int64_t bytes) {
  int64_t aligned = (bytes + LINE - 1) / LINE * LINE;
  if (bytes < 8 * HEADER)
    return because(model, MBODY_REFUSED, "this is no image of mbody: it has %" PRId64 " bytes", bytes);
  model->bytes = bytes;
  /* copies of positions are no longer than the image that has them */
  model->raw = malloc((size_t)(2 * aligned + (int64_t)sizeof(Shell) + 2 * LINE));
  if (!model->raw) return because(model, MBODY_FAILED, "there is no memory for the image's %" PRId64 " bytes", bytes);
  model->memory = model->raw + LINE - (uintptr_t)model->raw % LINE;
  memcpy(model->memory, image, (size_t)bytes);
  memset(model->memory + bytes, 0, (size_t)(aligned - bytes));
  model->shell = (Shell *)(void *)(model->memory + aligned);
  memset(model->shell, 0, sizeof *model->shell);
  model->home = (double *)(void *)(model->shell + 1);
  return MBODY_GOOD;
}

/* What the path parameter of a motion is: the first word of its path's bundle. */
static int64_t mode_of(const mbody_model *model, int call) {
  const int64_t *path = (const int64_t *)(intptr_t)model->call[call][2];
  return path[0];
}

/* What the first position is, and memory for what may have to be restored. */
static int remember(mbody_model *model) {
  int64_t n = model->q.count, m = model->start_q.count, d = model->close_given.count, k = 0;
  int64_t whole = 2 * m + model->start_own.count; /* numbers of a state of the free motion */
  double *spare = malloc((size_t)(2 * n + 2 + d + model->numbers + 2 * whole) * sizeof *spare);
  model->number_entry = malloc((size_t)(model->numbers + 1) * sizeof *model->number_entry);
  model->old_q = spare; /* freed through this pointer */
  if (!spare || !model->number_entry) return because(model, MBODY_FAILED, "there is no memory for the model");
  model->home_given = spare + n;
  model->old_numbers = model->home_given + d;
  model->old_start = model->old_numbers + model->numbers;
  model->old_y = model->old_start + whole;
  model->block = (model->bytes + LINE - 1) / LINE * LINE + (int64_t)sizeof(Shell) + 8 * n;
  if (n) {
    copy(model->home, model->q.at, n);
    copy(model->home_given, model->close_given.at, d);
    model->home_t = model->close_t.at[0];
  }
  if (m) {
    model->first = model->start_times.at[0];
    model->span = model->start_times.at[1] - model->first;
  }
  if (model->call[TURN] && d == 1 && mode_of(model, TURN) == BY_DRIVER) model->home_given[0] = model->motion[MBODY_TURN].s.at[0];
  if (model->call[STEP]) {
    model->reach = model->motion[MBODY_STEP].reach.at[0];
    for (int64_t c = 0; c < d; c++) model->close_given.at[c] = model->motion[MBODY_STEP].given.at[3 * c];
  }
  for (int64_t e = 0; e < words(model)[TABLE_COUNT]; e++)
    if (entry_at(model, e)[0] == MBODY_NUMBER) model->number_entry[k++] = e;
  return MBODY_GOOD;
}

mbody_model *mbody_open(const void *image, size_t bytes, char *message, size_t room) {
  mbody_model *model = calloc(1, sizeof *model);
  int code = MBODY_FAILED;
  if (message && room) message[0] = 0;
  if (!model) {
    if (message && room) snprintf(message, room, "there is no memory for the model");
    return NULL;
  }
  if (!image || bytes > (size_t)INT64_MAX / 4)
    code = because(model, MBODY_REFUSED, "there is no image");
  else if (!(code = take(model, image, (int64_t)bytes)) && !(code = check_header(model, (int64_t)bytes)) &&
           !(code = relocate(model)) && !(code = check_entries(model)) && !(code = find_arrays(model)) &&
           !(code = check_sum(model)))
    code = remember(model);
  if (!code) return model;
  if (message && room) snprintf(message, room, "%s", model->message);
  mbody_free(model);
  return NULL;
}

static FILE *opened(const char *path) {
#ifdef _WIN32
  wchar_t wide[4096];
  return MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, 4096) ? _wfopen(wide, L"rb") : NULL;
#else
  return fopen(path, "rb");
#endif
}

mbody_model *mbody_open_file(const char *path, char *message, size_t room) {
  FILE *file = path ? opened(path) : NULL;
  mbody_model *model = NULL;
  char *image = NULL;
  long bytes = -1;
  if (file && !fseek(file, 0, SEEK_END)) bytes = ftell(file);
  if (bytes >= 0 && !fseek(file, 0, SEEK_SET)) image = malloc((size_t)bytes + 1);
  if (image && fread(image, 1, (size_t)bytes, file) == (size_t)bytes)
    model = mbody_open(image, (size_t)bytes, message, room);
  else if (message && room)
    snprintf(message, room, "the file %s cannot be read", path ? path : "");
  free(image);
  if (file) fclose(file);
  return model;
}

void mbody_free(mbody_model *model) {
  if (!model) return;
  free(model->raw);
  free(model->old_q);
  free(model->number_entry);
  free(model);
}

/* ---- entries --------------------------------------------------------------------------------- */

const char *mbody_message(const mbody_model *model) { return model->message; }

const char *mbody_manifest(const mbody_model *model, size_t *bytes) {
  if (bytes) *bytes = (size_t)words(model)[TEXT_BYTES];
  return model->memory + words(model)[TEXT];
}

uint64_t mbody_checksum(const mbody_model *model) { return (uint64_t)words(model)[SUM]; }
int mbody_entry_count(const mbody_model *model) { return (int)words(model)[TABLE_COUNT]; }

int mbody_kind(const mbody_model *model, int entry) {
  return entry >= 0 && entry < mbody_entry_count(model) ? (int)entry_at(model, entry)[0] : 0;
}
const char *mbody_name(const mbody_model *model, int entry) {
  return mbody_kind(model, entry) ? text_at(model, entry, 3) : "";
}
const char *mbody_unit(const mbody_model *model, int entry) {
  return mbody_kind(model, entry) ? text_at(model, entry, 4) : "";
}
int mbody_find_number(const mbody_model *model, const char *name) { return (int)find(model, MBODY_NUMBER, name); }
int mbody_find_measure(const mbody_model *model, const char *name) { return (int)find(model, MBODY_MEASURE, name); }
int mbody_find_input(const mbody_model *model, const char *name) { return (int)find(model, MBODY_INPUT, name); }
int mbody_find_state(const mbody_model *model, const char *name) { return (int)find(model, MBODY_STATE, name); }

/* ---- numbers --------------------------------------------------------------------------------- */

static double *number_at(const mbody_model *model, int64_t entry) {
  return (double *)(void *)(model->memory + entry_at(model, entry)[1]);
}

/* A call of a kernel; `results` has three words. */
static int run(mbody_model *model, int call, int64_t *results) {
  if (!model->call[call])
    return because(model, MBODY_REFUSED, "this image has no '%s': its model is not for that analysis", CALL[call].name);
  results[0] = 0;
  if (model->kernel[call](model->call[call], results))
    return because(model, MBODY_FAILED, "the kernel of '%s' failed", CALL[call].name);
  return MBODY_GOOD;
}

double mbody_number(const mbody_model *model, int entry) {
  int kind = mbody_kind(model, entry);
  return kind == MBODY_NUMBER || kind == MBODY_INPUT || kind == MBODY_STATE ? *number_at(model, entry) : NAN;
}

/* The numbers as they are into the kernels' own; −1, or the number that is not allowed. */
static int64_t put_numbers(mbody_model *model) {
  int64_t found[3] = {-1, 0, 0};
  for (int call = DRIVEN_NUMBERS; call <= FREE_NUMBERS; call++)
    if (model->call[call] && (run(model, call, found) || found[0] >= 0)) return found[0];
  return -1;
}

int mbody_set_several(mbody_model *model, const int *entries, const double *values, int count) {
  int64_t wrong;
  double value = NAN;
  for (int n = 0; n < count; n++)
    if (mbody_kind(model, entries[n]) != MBODY_NUMBER)
      return because(model, MBODY_REFUSED, "entry %d of the image is no number that can be set", entries[n]);
  if (count < 1) return MBODY_GOOD;
  for (int64_t n = 0; n < model->numbers; n++) model->old_numbers[n] = *number_at(model, model->number_entry[n]);
  for (int n = 0; n < count; n++) *number_at(model, entries[n]) = values[n];
  wrong = put_numbers(model);
  if (wrong < 0) {
    model->shell->position_old = model->shell->home_old = model->shell->motion_old = 1;
    return MBODY_GOOD;
  }
  if (wrong < model->numbers) value = *number_at(model, model->number_entry[wrong]);
  for (int64_t n = 0; n < model->numbers; n++) *number_at(model, model->number_entry[n]) = model->old_numbers[n];
  put_numbers(model);
  if (wrong >= model->numbers)
    return because(model, MBODY_UNFIT,
                   "%s = %.6g %s is not allowed beside the other numbers: the mechanism would have "
                   "no finite sizes", mbody_name(model, entries[count - 1]), values[count - 1],
                   mbody_unit(model, entries[count - 1]));
  return because(model, MBODY_REFUSED, "%s cannot be %.6g %s: it must be finite, and not too low",
                 text_at(model, model->number_entry[wrong], 3), value,
                 text_at(model, model->number_entry[wrong], 4));
}

int mbody_set_number(mbody_model *model, int entry, double value) {
  return mbody_set_several(model, &entry, &value, 1);
}

int mbody_set_input(mbody_model *model, int entry, double value) {
  if (mbody_kind(model, entry) != MBODY_INPUT) return because(model, MBODY_REFUSED, "entry %d of the image is no input", entry);
  double *at = number_at(model, entry), before = *at;
  if (value == before) return MBODY_GOOD;
  *at = value;
  if (put_numbers(model) >= 0) {
    *at = before;
    put_numbers(model);
    return because(model, MBODY_REFUSED, "the input %s cannot be %g: it must be finite", mbody_name(model, entry), value);
  }
  model->shell->inputs_old = 1;
  return MBODY_GOOD;
}

int mbody_set_start(mbody_model *model, int entry, double value) {
  if (mbody_kind(model, entry) != MBODY_STATE) return because(model, MBODY_REFUSED, "entry %d of the image is no state", entry);
  if (!isfinite(value))
    return because(model, MBODY_REFUSED, "the state %s cannot begin at %g: it must be finite", mbody_name(model, entry), value);
  *number_at(model, entry) = value;
  return MBODY_GOOD;
}

/* ---- driven motion --------------------------------------------------------------------------- */

static int close_here(mbody_model *model) {
  int64_t found[3] = {0, 0, 0};
  double *q = model->q.at, ratio;
  copy(model->old_q, q, model->q.count);
  int code = run(model, CLOSE, found);
  if (!code && !found[0]) {
    memcpy(&ratio, &found[2], sizeof ratio);
    code = because(model, MBODY_ENDED,
                   "the loops do not close at t = %.6g s with these numbers and drivers (least "
                   "pivot %.2g of its diagonal): change them back, or move the driver",
                   model->close_t.at[0], ratio);
  }
  if (code) copy(q, model->old_q, model->q.count);
  return code;
}

int mbody_close_loops(mbody_model *model) {
  int64_t found[3];
  int code = model->call[CLOSE] ? close_here(model) : run(model, CLOSE, found);
  if (!code) model->shell->position_old = 0;
  return code;
}

/* Follows the path of a motion from the present position, which may move. */
static int follow(mbody_model *model, int which) {
  Motion *motion = &model->motion[which];
  double *progress = motion->progress.at;
  int64_t found[3], none[3];
  memset(progress, 0, PROGRESS * sizeof *progress);
  memset(motion->nearest.at, 0, (size_t)motion->nearest.count * sizeof *progress);
  model->shell->kept[which] = 0;
  int code = run(model, MOTION[which].call, found);
  if (code) return code;
  if (found[0] == LOST)
    return because(model, MBODY_ENDED, "the loops do not close at the first position of the %s: close them", MOTION[which].name);
  model->shell->kept[which] = (int64_t)progress[INSTANTS];
  if (model->measures && (code = run(model, MOTION[which].call + 1, none))) return code;
  if (found[0] == STUCK)
    return because(model, MBODY_ENDED, "the %s ends at %.6g of %.6g: %s", MOTION[which].name, progress[REACHED],
                   motion->s.at[motion->s.count - 1],
                   progress[BRANCH_UNSURE] != 0.0 ? "two branches meet there, and which one is meant is not certain"
                                                  : "a dead centre, where the driver cannot move on");
  if (!(progress[UNBALANCED] < UNBALANCED_PART))
    return because(model, MBODY_DOUBT,
                   "the reactions leave %.2g of the loads unbalanced: the position is singular, or "
                   "it can still move", progress[UNBALANCED]);
  return MBODY_GOOD;
}

int mbody_turn(mbody_model *model) {
  Shell *shell = model->shell;
  int64_t found[3];
  int64_t n = model->q.count, d = model->close_given.count;
  if (!model->call[TURN]) return run(model, TURN, found);
  double *q = malloc((size_t)(n + d + 1) * sizeof *q), t = model->close_t.at[0];
  int code = MBODY_GOOD;
  if (!q) return because(model, MBODY_FAILED, "there is no memory for a turn");
  copy(q, model->q.at, n);
  copy(q + n, model->close_given.at, d);
  copy(model->q.at, model->home, n);
  if (shell->home_old) {
    model->close_t.at[0] = model->home_t;
    copy(model->close_given.at, model->home_given, d);
    code = close_here(model);
    model->close_t.at[0] = t;
    copy(model->close_given.at, q + n, d);
    if (!code) {
      copy(model->home, model->q.at, n);
      shell->home_old = 0;
    }
  }
  if (!code) code = follow(model, MBODY_TURN);
  copy(model->q.at, q, n);
  free(q);
  return code;
}

int mbody_step_driver(mbody_model *model, int driver, double to) {
  Motion *step = &model->motion[MBODY_STEP];
  int64_t found[3], n = model->q.count, count = model->close_given.count, mode;
  double *given = step->given.at, *stands = model->close_given.at, whole = model->reach;
  if (!model->call[STEP]) return run(model, STEP, found);
  if (driver < 0 || driver >= count || !isfinite(to))
    return because(model, MBODY_REFUSED, "driver %d of %" PRId64 " cannot be moved to %g", driver, count, to);
  if (model->shell->position_old) {
    int code = mbody_close_loops(model);
    if (code) return code;
  }
  mode = mode_of(model, STEP);
  for (int64_t d = 0; d < count; d++) {
    double end = d == driver ? to : stands[d];
    if (isnan(stands[d]))
      return because(model, MBODY_REFUSED, "where driver %" PRId64 " stands is not known: write its value to 'close.given', and close the loops", d);
    given[3 * d] = stands[d];
    given[3 * (count + d)] = end;
    if (mode == BY_INSTANT && step->chords.count >= count) step->chords.at[d] = end - stands[d];
    if (mode == BY_DRIVER) {
      step->s.at[0] = stands[d];
      step->s.at[1] = end;
      whole = fmax(whole, 1.0 + fabs(end));
    }
  }
  step->times.at[0] = step->times.at[1] = model->close_t.at[0];
  step->reach.at[0] = whole;
  copy(model->old_q, model->q.at, n);
  int code = follow(model, MBODY_STEP);
  if (code > MBODY_DOUBT) {
    copy(model->q.at, model->old_q, n);
    return code;
  }
  stands[driver] = to;
  return code;
}

double mbody_driver(const mbody_model *model, int driver) {
  return driver >= 0 && driver < model->close_given.count ? model->close_given.at[driver] : NAN;
}

/* ---- free motion ----------------------------------------------------------------------------- */

static void empty(Array array) {
  if (array.count) memset(array.at, 0, (size_t)array.count * sizeof *array.at);
}

/* A page becomes the present instant of the free motion. */
static int show(mbody_model *model, double t, const double *page) {
  Motion *now = &model->motion[MBODY_ADVANCE];
  int64_t none[3];
  if (!model->call[ADVANCE]) return MBODY_GOOD;
  now->times.at[0] = t;
  if (page != now->pages.at) copy(now->pages.at, page, model->rows);
  model->shell->kept[MBODY_ADVANCE] = 1;
  return model->measures ? run(model, ADVANCE_MEASURES, none) : MBODY_GOOD;
}

/* Something has happened: when, a code, and the contact point that is struck, −1 of none. */
static void note(mbody_model *model, int64_t code) {
  double *count = model->happened.at;
  int64_t who = -1;
  if (3.0 * (*count + 1.0) > (double)model->events.count) return;
  double *event = model->events.at + 3 * (int64_t)*count;
  if (code == IMPACT) memcpy(&who, model->struck.at, sizeof who);
  event[0] = model->state.at[TIME];
  event[1] = (double)code;
  event[2] = (double)who;
  *count += 1.0;
}

/* Whether what has happened leaves the motion to go on; it is noted. */
static int goes_on(mbody_model *model, int64_t code) {
  if (code < ZERO || code > CONTINUED) return 0;
  if (code == IMPACT || code == COLLISION || code == CONTINUED) note(model, code);
  return 1;
}

/* The sentence of a motion that ends by what has happened. */
static int ended(mbody_model *model, int64_t code) {
  double t = model->state.at[TIME];
  switch (code) {
    case NO_IMPACT: return because(model, MBODY_ENDED, "at t = %.6g s an impact has no solution: friction wedges what would rebound, or drivers lead it from two sides", t);
    case NO_MODES: return because(model, MBODY_ENDED, "at t = %.6g s no accelerations are consistent with the friction", t);
    case NO_COLLISION: return because(model, MBODY_ENDED, "at t = %.6g s no accelerations and no impact are consistent with the friction", t);
    case INDEFINITE: return because(model, MBODY_ENDED, "at t = %.6g s masses touch that differ by more than numbers carry", t);
    case POLE: return because(model, MBODY_ENDED, "at t = %.6g s the forces of what slides grow without bound (Painlevé's paradox)", t);
    case IMPACTS_WITHOUT_END: return because(model, MBODY_ENDED, "at t = %.6g s impacts do not end", t);
    case CHANGES_WITHOUT_END: return because(model, MBODY_ENDED, "at t = %.6g s contacts and friction change their modes without end", t);
    case NOT_QUIET: return because(model, MBODY_ENDED, "after t = %.6g s steps do not show what they meet: this needs mbody itself", t);
    default: return because(model, MBODY_ENDED, "after t = %.6g s more touches than the image has memory for", t);
  }
}

/* Modes are decided: first ones, or those after forces have jumped. */
static int settle(mbody_model *model, int64_t stage) {
  int64_t found[3], call = model->call[ADVANCE] ? ADVANCE : RUN;
  int code;
  if (!model->stage.at) return MBODY_GOOD;
  memcpy(model->stage.at, &stage, sizeof stage);
  do {
    if ((code = run(model, (int)call, found))) return code;
    if (found[0] == CONTINUED || found[0] == UNBROKEN) {
      copy(model->begin_page.at, model->page.at, model->rows);
      return MBODY_GOOD;
    }
  } while (goes_on(model, found[0]));
  return ended(model, found[0]);
}

/* Whether a number is another one than the contacts of the image were made with. */
static int other_numbers(mbody_model *model) {
  for (int64_t n = 0; model->stage.at && n < model->numbers; n++) {
    int64_t entry = model->number_entry[n], input = 0;
    for (int64_t e = 0; e < words(model)[TABLE_COUNT]; e++)
      input |= entry_at(model, e)[0] == MBODY_INPUT && entry_at(model, e)[1] == entry_at(model, entry)[1];
    if (!input && *number_at(model, entry) != model->made_with.at[n])
      return because(model, MBODY_REFUSED, "%s is not what the contacts of this image were made with: export it again with the new number",
                     text_at(model, entry, 3));
  }
  return MBODY_GOOD;
}

/* What the motion begins or goes on with at a time. */
static int evaluated(mbody_model *model, double first) {
  int64_t found[3];
  int code = run(model, BEGIN, found);
  if (code) return code;
  if (found[0] == OPEN)
    return because(model, MBODY_ENDED, "the loops do not close near the position where the motion is to begin, at t = %.6g s", first);
  if (found[0] == NO_VALUE)
    return because(model, MBODY_ENDED, "the accelerations have no finite value at t = %.6g s: a load or a law has none there", first);
  if (found[0] == MASSLESS)
    return because(model, MBODY_ENDED, "a body has too little mass for this image: export it again with the new number");
  model->shell->inputs_old = 0;
  int64_t went_on;
  memcpy(&went_on, model->goes_on.at, sizeof went_on);
  if ((code = settle(model, went_on ? JUMPED : STARTING))) return code;
  return show(model, first, model->begin_page.at);
}

static int begin(mbody_model *model, double first, double last) {
  int refused = other_numbers(model);
  if (refused) return refused;
  if (model->stage.at) *model->happened.at = 0.0;
  model->start_times.at[0] = first;
  model->start_times.at[1] = last > first ? last : first + model->span;
  int code = evaluated(model, first);
  if (code) return code;
  model->shell->begun = 1;
  model->shell->motion_old = 0;
  return MBODY_GOOD;
}

/* The motion goes on with other inputs: the word tells the kernel so. */
static int take_inputs(mbody_model *model) {
  static const int64_t goes_on = 1, begins = 0;
  memcpy(model->goes_on.at, &goes_on, sizeof goes_on);
  int code = evaluated(model, model->state.at[TIME]);
  memcpy(model->goes_on.at, &begins, sizeof begins);
  return code;
}

int mbody_start(mbody_model *model, double first, double last) {
  int64_t found[3];
  if (!model->call[BEGIN]) return run(model, BEGIN, found);
  if (!isfinite(first)) return because(model, MBODY_REFUSED, "a motion cannot begin at t = %g", first);
  model->shell->begun = 0;
  model->shell->kept[MBODY_ADVANCE] = 0;
  empty(model->motion[MBODY_ADVANCE].work);
  empty(model->motion[MBODY_RUN].work);
  return begin(model, first, last);
}

double mbody_now(const mbody_model *model) { return model->shell->begun ? model->state.at[TIME] : NAN; }

/* Begins anew from the present position and speeds, with other numbers. */
static int renew(mbody_model *model) {
  int64_t n = model->start_q.count, m = model->start_own.count;
  double *y = model->y.at, last = model->start_times.at[1], now = model->state.at[TIME];
  copy(model->old_start, model->start_q.at, n);
  copy(model->old_start + n, model->start_v.at, n);
  copy(model->old_start + 2 * n, model->start_own.at, m);
  copy(model->old_y, y, 2 * n + m);
  copy(model->old_state, model->state.at, SLOTS);
  copy(model->start_q.at, y, n);
  copy(model->start_v.at, y + n, n);
  copy(model->start_own.at, y + 2 * n, m);
  int code = begin(model, now, last);
  copy(model->start_q.at, model->old_start, n);
  copy(model->start_v.at, model->old_start + n, n);
  copy(model->start_own.at, model->old_start + 2 * n, m);
  if (code) {
    copy(y, model->old_y, 2 * n + m);
    copy(model->state.at, model->old_state, SLOTS);
  }
  return code;
}

/* Loads that jump to and fro keep steps short for ever: where the mean of so many steps is below a
   tenth of the longest such mean, and more than PATIENT steps lie ahead, a motion ends. */
enum { JUDGED = 10000, PATIENT = 300000 };

/* The integrator to the end of its instants. */
static int integrate(mbody_model *model, int which) {
  double *state = model->state.at, until = model->until[which].at[0];
  int64_t found[3] = {MORE, 0, 0};
  double count = state[STEPS], since = state[TIME], longest = 0.0;
  int doubt = 0, code;
  state[LAST_STEP_ALLOWED] = 0.0;
  while (found[0] == MORE || found[0] == LAST_STEP) {
    if ((code = run(model, MOTION[which].call, found))) return code;
    if (goes_on(model, found[0])) {
      found[0] = MORE;
      continue;
    }
    if (found[0] == LAST_STEP) state[LAST_STEP_ALLOWED] = 1.0;
    if (found[0] == MORE && state[ARTIFICIAL_ENERGY] > state[ARTIFICIAL_LIMIT]) {
      state[ARTIFICIAL_LIMIT] *= 2.0;
      doubt = because(model, MBODY_DOUBT,
                      "the inertia of the free motion nearly vanishes at t = %.6g s: how it goes on "
                      "is not determined; give mass to the bodies that move there", state[TIME]);
    }
    if (found[0] == MORE && state[STEPS] - count >= JUDGED) {
      double mean = (state[TIME] - since) / (state[STEPS] - count), left = (until - state[TIME]) / mean;
      if (mean < 0.1 * longest && !(left < PATIENT))
        return because(model, MBODY_ENDED,
                       "the loads jump to and fro at t = %.6g s: the last %d steps were %.1g s each, "
                       "the end would take %.1g more; smooth what jumps", state[TIME], JUDGED, mean, left);
      longest = mean > longest ? mean : longest;
      count = state[STEPS];
      since = state[TIME];
    }
  }
  switch (found[0]) {
    case DONE: return doubt;
    case NOT_QUIET: case NO_IMPACT: case NO_MODES: case NO_COLLISION: case INDEFINITE: case POLE:
    case IMPACTS_WITHOUT_END: case CHANGES_WITHOUT_END: case ROOM:
      return ended(model, found[0]);
    case STIFF:
      return because(model, MBODY_ENDED, "the loads are too stiff for the method of this image: at t = %.6g s of %.6g s", state[TIME], until);
    case NOT_FINITE:
      return because(model, MBODY_ENDED, "the accelerations have no finite value after t = %.6g s", state[TIME]);
    case SINGULAR_AHEAD:
    case BRANCH_UNCERTAIN:
      return because(model, MBODY_ENDED, "a singular position follows t = %.6g s: which branch the motion takes needs mbody itself", state[TIME]);
    default:
      return because(model, MBODY_ENDED, "the steps vanish at t = %.6g s: the loads jump there, grow without bound, or are too stiff", state[TIME]);
  }
}

int mbody_advance(mbody_model *model, double until) {
  Motion *motion = &model->motion[MBODY_ADVANCE];
  int64_t found[3];
  int code;
  if (!model->call[ADVANCE]) return run(model, ADVANCE, found);
  if (!model->shell->begun) return because(model, MBODY_REFUSED, "no motion has begun: call mbody_start first");
  if (!isfinite(until) || until < model->state.at[TIME])
    return because(model, MBODY_REFUSED, "the motion is at t = %.9g s and cannot go to %.9g s: restore a state, or start anew", model->state.at[TIME], until);
  if (model->shell->motion_old && (code = renew(model))) return code;
  if (model->shell->inputs_old && (code = take_inputs(model))) return code;
  if (until == model->state.at[TIME]) return MBODY_GOOD;
  double before = motion->times.at[0];
  model->until[MBODY_ADVANCE].at[0] = motion->times.at[0] = until;
  model->state.at[DELIVERED] = 0.0;
  code = integrate(model, MBODY_ADVANCE);
  if (code > MBODY_DOUBT) {
    motion->times.at[0] = before;
    return code;
  }
  int shown = show(model, until, motion->pages.at);
  return shown ? shown : code;
}

int mbody_run(mbody_model *model) {
  Motion *motion = &model->motion[MBODY_RUN];
  int64_t found[3], count = motion->times.count;
  if (!model->call[RUN]) return run(model, RUN, found);
  double *times = motion->times.at, last = times[count - 1];
  for (int64_t n = 0; n < count; n++)
    if (!isfinite(times[n]) || (n && times[n] <= times[n - 1]))
      return because(model, MBODY_REFUSED, "the times of the run must be finite and ascend: instant %" PRId64 " does not", n);
  double first = model->first <= times[0] ? model->first : times[0];
  model->shell->kept[MBODY_RUN] = 0;
  int code = mbody_start(model, first, last);
  if (code) return code;
  model->until[MBODY_RUN].at[0] = last;
  if (times[0] <= first) {
    copy(motion->pages.at, model->begin_page.at, model->rows);
    model->state.at[DELIVERED] = 1.0;
  }
  code = integrate(model, MBODY_RUN);
  int64_t kept = model->shell->kept[MBODY_RUN] = (int64_t)model->state.at[DELIVERED];
  int wrong = model->measures ? run(model, RUN_MEASURES, found) : MBODY_GOOD;
  if (!wrong && kept == count) wrong = show(model, last, motion->pages.at + (count - 1) * model->rows);
  return wrong ? wrong : code;
}

/* ---- results --------------------------------------------------------------------------------- */

int mbody_instants(const mbody_model *model, int motion) {
  return motion >= MBODY_TURN && motion <= MBODY_RUN ? (int)model->shell->kept[motion] : 0;
}

double mbody_time(const mbody_model *model, int motion, int instant) {
  if (instant < 0 || instant >= mbody_instants(model, motion)) return NAN;
  return model->motion[motion].times.at[instant];
}

double mbody_measure(const mbody_model *model, int motion, int instant, int entry) {
  int kind = mbody_kind(model, entry);
  if (instant < 0 || instant >= mbody_instants(model, motion) || (kind != MBODY_MEASURE && kind != MBODY_STATE)) return NAN;
  return model->motion[motion].measured.at[instant * model->measures + entry_at(model, entry)[2]];
}

const double *mbody_page(const mbody_model *model, int motion, int instant, int *rows) {
  if (rows) *rows = 0;
  if (instant < 0 || instant >= mbody_instants(model, motion)) return NULL;
  if (rows) *rows = (int)model->rows;
  return model->motion[motion].pages.at + instant * model->rows;
}

double *mbody_array(mbody_model *model, const char *name, int64_t *count) {
  int64_t n = find(model, MBODY_ARRAY, name);
  int there = n >= 0 && within(model, entry_at(model, n)[1], entry_at(model, n)[2]);
  if (count) *count = there ? entry_at(model, n)[2] : 0;
  return there ? (double *)(void *)(model->memory + entry_at(model, n)[1]) : NULL;
}

/* ---- the whole state ------------------------------------------------------------------------- */

enum { KEPT_HEAD = 4 }; /* words: magic, bytes, checksum of the image, checksum of the rest */
static const char KEPT[] = "mbodykpt";

size_t mbody_state_bytes(const mbody_model *model) { return (size_t)(8 * KEPT_HEAD + model->block); }

/* Adds to every relocated word of a copy of the block. */
static void shift(const mbody_model *model, char *block, int64_t by) {
  const int64_t *list = words(model) + words(model)[MOVED];
  for (int64_t n = 0; n < words(model)[MOVED_COUNT]; n++) {
    uint64_t word;
    memcpy(&word, block + 8 * list[n], 8);
    word += (uint64_t)by;
    memcpy(block + 8 * list[n], &word, 8);
  }
}

int mbody_save(const mbody_model *model, void *state, size_t bytes) {
  char *to = state;
  int64_t head[KEPT_HEAD] = {0, model->block, (int64_t)model->sum, 0};
  if (!state || bytes < mbody_state_bytes(model)) return MBODY_REFUSED;
  memcpy(to + 8 * KEPT_HEAD, model->memory, (size_t)model->block);
  shift(model, to + 8 * KEPT_HEAD, -(int64_t)(intptr_t)model->memory);
  memcpy(head, KEPT, 8);
  head[3] = (int64_t)sum_of(to + 8 * KEPT_HEAD, model->block / 8, -1);
  memcpy(to, head, sizeof head);
  return MBODY_GOOD;
}

int mbody_restore(mbody_model *model, const void *state, size_t bytes) {
  const char *from = state;
  int64_t head[KEPT_HEAD];
  if (!state || bytes < mbody_state_bytes(model))
    return because(model, MBODY_REFUSED, "the state has %zu bytes, one of this model has %zu", bytes, mbody_state_bytes(model));
  memcpy(head, from, sizeof head);
  if (memcmp(head, KEPT, 8) || head[1] != model->block || (uint64_t)head[2] != model->sum)
    return because(model, MBODY_REFUSED, "the state is not one of this image");
  if ((uint64_t)head[3] != sum_of(from + 8 * KEPT_HEAD, model->block / 8, -1))
    return because(model, MBODY_REFUSED, "the state is damaged: its checksum is not that of its bytes");
  memcpy(model->memory, from + 8 * KEPT_HEAD, (size_t)model->block);
  shift(model, model->memory, (int64_t)(intptr_t)model->memory);
  return MBODY_GOOD;
}
