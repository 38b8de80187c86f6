/* A program without Python: a model changed, closed, turned and moved.
 *
 *     cc example.c mbody.c linux-x86-64-v3.o -lm -o example
 *     ./example IMAGE NUMBER VALUE MEASURE [SECONDS]
 *
 * Prints the measure over the turn, where the image has one, and along its free motion, where it
 * has one: 50 steps until SECONDS, as a control loop would make them; and when something was struck.
 */
#include "mbody.h"

#include <stdio.h>
#include <stdlib.h>

static int failed(const char *sentence) {
  fprintf(stderr, "%s\n", sentence);
  return EXIT_FAILURE;
}

int main(int count, char **words) {
  char message[512];
  if (count < 5) return failed("usage: example IMAGE NUMBER VALUE MEASURE [SECONDS]");

  mbody_model *model = mbody_open_file(words[1], message, sizeof message);
  if (!model) return failed(message);

  int number = mbody_find_number(model, words[2]);
  int measure = mbody_find_measure(model, words[4]);
  if (number < 0 || measure < 0) return failed("the image has no such number, or no such measure");

  printf("%s = %.17g %s\n", words[2], mbody_number(model, number), mbody_unit(model, number));
  if (mbody_set_number(model, number, atof(words[3]))) return failed(mbody_message(model));

  if (mbody_array(model, "turn.t", NULL)) {
    if (mbody_close_loops(model) >= MBODY_ENDED) return failed(mbody_message(model));
    if (mbody_turn(model) >= MBODY_ENDED) return failed(mbody_message(model));
    for (int k = 0; k < mbody_instants(model, MBODY_TURN); k++)
      printf("turn %.17g %.17g\n", mbody_time(model, MBODY_TURN, k),
             mbody_measure(model, MBODY_TURN, k, measure));
  }
  if (count > 5) {
    double seconds = atof(words[5]);
    if (mbody_start(model, 0.0, seconds) >= MBODY_ENDED) return failed(mbody_message(model));
    for (int k = 0; k <= 50; k++) {
      if (mbody_advance(model, seconds * k / 50.0) >= MBODY_ENDED) return failed(mbody_message(model));
      printf("motion %.17g %.17g\n", mbody_now(model), mbody_measure(model, MBODY_ADVANCE, 0, measure));
    }
    double *met = mbody_array(model, "motion.happened", NULL), *events = mbody_array(model, "motion.events", NULL);
    for (int k = 0; met && k < *met; k++)
      if (events[3 * k + 2] >= 0.0) printf("struck %.17g %g\n", events[3 * k], events[3 * k + 2]);
  }
  mbody_free(model);
  return EXIT_SUCCESS;
}
