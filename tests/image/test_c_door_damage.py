"""Images that are damaged: each is a sentence, never a crash."""

import shutil
import subprocess

import pytest

from mbody import gallery
from mbody.core.selection import linker
from mbody.image.model_image import to_image
from tests.support import embedded
from tests.support.embedded import DOOR, Model, Refused, sealed, words_of

pytestmark = embedded.needs_core

#: Opens an image of which every word from FIRST to LAST is changed, one after the other and in
#: several ways, and one that is cut off at many places; prints how many were refused and opened.
PROGRAM = r"""
#include "mbody.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static long refused, opened, silent;

static void attempt(const char *image, size_t bytes) {
  char message[700];
  /* of its own size, so that a checker of memory sees every byte too far */
  char *own = malloc(bytes ? bytes : 1);
  memcpy(own, image, bytes);
  mbody_model *model = mbody_open(own, bytes, message, sizeof message);
  if (model) {
    opened++;
    for (int n = -1; n <= mbody_entry_count(model); n++) {
      volatile double value = mbody_number(model, n) + mbody_measure(model, 2, 0, n);
      (void)value;
      if (strlen(mbody_name(model, n)) > 1000 || strlen(mbody_unit(model, n)) > 1000) silent++;
    }
    mbody_find_measure(model, "nothing");
    mbody_free(model);
  } else {
    refused++;
    if (strlen(message) < 20) silent++;
  }
  free(own);
}

int main(int count, char **words) {
  static char image[4000000];
  FILE *file = fopen(words[1], "rb");
  if (count < 4 || !file) return 1;
  size_t bytes = fread(image, 1, sizeof image, file);
  fclose(file);
  long first = atol(words[2]), last = atol(words[3]);
  for (long n = first; n < last; n++) {
    int64_t *word = (int64_t *)(void *)(image + 8 * n), old = *word;
    int64_t others[] = {0, -1, old + 1, old + 8, (int64_t)-(uint64_t)old, old ^ ((int64_t)1 << 20),
                        old ^ ((int64_t)1 << 40), INT64_MAX, INT64_MIN, (int64_t)bytes / 8};
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
      if (others[k] == old) continue;
      *word = others[k];
      attempt(image, bytes);
    }
    *word = old;
  }
  if (first == 0) {
    for (size_t n = 0; n < bytes; n += n < 300 ? 1 : bytes / 150) attempt(image, n);
  }
  printf("%ld %ld %ld\n", refused, opened, silent);
  return 0;
}
"""


@pytest.fixture(scope="module")
def image():
    return to_image(gallery.load("double_pendulum"), instants=5).content


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return embedded.door(tmp_path_factory.mktemp("door"))


@pytest.fixture(scope="module")
def attempts(tmp_path_factory):
    """The program, with the compiler's checks of memory where it has them."""
    folder = tmp_path_factory.mktemp("damage")
    source = folder / "damage.c"
    source.write_text(PROGRAM)
    checks = ["-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    own = linker()
    if not (own and shutil.which(own[0]) and _links(own, checks, folder)):
        checks = []
    program = folder / "damage"
    embedded.compiled([source, DOOR / "mbody.c"], program, f"-I{DOOR}", *checks)

    def run(content, first, last):
        file = folder / "it.img"
        file.write_bytes(content)
        command = [program, file, str(first), str(last)]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-3000:]
        return [int(word) for word in done.stdout.split()]

    return run


def _links(compiler, checks, folder):
    empty = folder / "empty.c"
    empty.write_text("int main(void) { return 0; }\n")
    command = [*compiler, *checks, str(empty), "-o", str(folder / "empty")]
    return subprocess.run(command, capture_output=True).returncode == 0


def test_what_is_no_image_is_a_sentence(library, image):
    words = words_of(image)
    format_, hash_ = words.copy(), words.copy()
    format_[1], hash_[9] = 7, 0
    cases = {
        "it has 0 bytes": b"",
        "does not begin with 'mbodyimg'": b"\0" * 4096,
        "has format 7": format_.tobytes(),
        "for kernels of other sources (00000000 ": hash_.tobytes(),
        f"{len(image) - 8} bytes, it should have {len(image)}": image[:-8],
        f"{len(image) + 8} bytes, it should have": image + b"\0" * 8,
    }
    for sentence, content in cases.items():
        with pytest.raises(Refused) as refused:
            Model(library, content)
        assert sentence in str(refused.value)
    Model(library, image)


def test_a_call_with_wrong_arguments_is_a_sentence(library, image):
    """The arrays of `measures` end within the image; a bundle's place is none outside."""
    words = words_of(image)
    table = words[words[5] : words[5] + 5 * words[6]].reshape(-1, 5)
    calls = [row for row in table.tolist() if row[0] == 4]
    for _, offset, count, name, _ in calls:
        text = image[name : image.index(b"\0", name)].decode()
        if not text.endswith("measures"):
            continue
        for n in (3, count - 1):  # counts of instants and of measures
            wrong = words.copy()
            wrong[offset // 8 + n] = 1 << 40
            with pytest.raises(Refused, match=f"arguments of its call '{text}' are wrong"):
                Model(library, wrong.tobytes())


@pytest.mark.slow
def test_an_image_with_a_checksum_shows_every_change(library, image, attempts):
    good = sealed(image)
    assert Model(library, good).checksum() == int(words_of(good)[13]) % 2**64
    wrong = words_of(good).copy()
    wrong[len(wrong) // 3] ^= 1 << 52
    with pytest.raises(Refused, match="damaged: its checksum"):
        Model(library, wrong.tobytes())
    words = words_of(good)
    refused, opened, silent = attempts(good, len(words) // 2, len(words) // 2 + 300)
    assert refused > 2000 and opened == silent == 0


def test_no_damage_crashes(image, attempts):
    """Header, entries and relocations, every word; and images that are cut off anywhere."""
    words = words_of(image)
    moved, table = int(words[3]), int(words[5])
    refused, opened, silent = attempts(image, 0, 16)
    # words 13–15 say nothing yet, and 7 and 8 place a text that nobody reads
    assert refused > 450 and opened < 40 and silent == 0
    refused, opened, silent = attempts(image, table, table + 5 * int(words[6]))
    assert refused > 1000 and silent == 0
    refused, opened, silent = attempts(image, moved, moved + int(words[4]))
    assert refused > 1000 and silent == 0


def test_no_damaged_argument_crashes(image, attempts):
    words = words_of(image)
    table = words[words[5] : words[5] + 5 * words[6]].reshape(-1, 5)
    for kind, offset, count, _, _ in table.tolist():
        if kind == 4:
            refused, _, silent = attempts(image, offset // 8, offset // 8 + count)
            assert refused > 3 * count and silent == 0
