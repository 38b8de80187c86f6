"""Programs and libraries in C on the kernels of this machine, and `mbody.h` for ctypes."""

import ctypes
import subprocess
from ctypes import POINTER, c_char, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint64, c_void_p
from pathlib import Path

import numpy as np
import pytest

from mbody.core import native, native_builder
from mbody.core.selection import PACKAGE, chosen, linker
from mbody.image.arena import IMAGE_KERNELS

DOOR = PACKAGE / "image" / "c"
GOOD, DOUBT, ENDED, REFUSED, UNFIT, FAILED = range(6)
TURN, STEP, ADVANCE, RUN = range(4)

needs_core = pytest.mark.skipif(
    chosen().name != "native" or linker() is None, reason="C programs run on the native core"
)


def kernel_files():
    """Libraries with the kernels that images call; those that lack are built."""
    choice = chosen()
    if choice.library is not None:
        return [choice.library.file]
    found = {native.file_of(one): one for one in IMAGE_KERNELS}
    lacking = [one for file, one in found.items() if not file.exists()]
    if lacking:
        native_builder.build(lacking, processes=2)
    return list(found)


def compiled(sources, out, *options):
    """C sources with the kernels, as a program or, with -shared, as a library."""
    files = [str(file) for file in kernel_files()]
    paths = sorted({f"-Wl,-rpath,{Path(file).parent}" for file in files})
    whole = [*linker(), "-std=c99", "-O2", "-fPIC", *options, "-o", str(out), *map(str, sources)]
    done = subprocess.run([*whole, *files, *paths, "-lm"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


def door(folder):
    """mbody.c as a library, its functions with their types."""
    opened = ctypes.CDLL(str(compiled([DOOR / "mbody.c"], folder / "door.so", "-shared")))
    for name, result, *arguments in (
        ("open", c_void_p, c_char_p, c_size_t, POINTER(c_char), c_size_t),
        ("open_file", c_void_p, c_char_p, POINTER(c_char), c_size_t),
        ("free", None, c_void_p),
        ("message", c_char_p, c_void_p),
        ("manifest", c_void_p, c_void_p, POINTER(c_size_t)),
        ("checksum", c_uint64, c_void_p),
        ("entry_count", c_int, c_void_p),
        ("kind", c_int, c_void_p, c_int),
        ("name", c_char_p, c_void_p, c_int),
        ("unit", c_char_p, c_void_p, c_int),
        ("find_number", c_int, c_void_p, c_char_p),
        ("find_measure", c_int, c_void_p, c_char_p),
        ("find_input", c_int, c_void_p, c_char_p),
        ("find_state", c_int, c_void_p, c_char_p),
        ("number", c_double, c_void_p, c_int),
        ("set_number", c_int, c_void_p, c_int, c_double),
        ("set_several", c_int, c_void_p, POINTER(c_int), POINTER(c_double), c_int),
        ("set_input", c_int, c_void_p, c_int, c_double),
        ("set_start", c_int, c_void_p, c_int, c_double),
        ("close_loops", c_int, c_void_p),
        ("turn", c_int, c_void_p),
        ("step_driver", c_int, c_void_p, c_int, c_double),
        ("driver", c_double, c_void_p, c_int),
        ("start", c_int, c_void_p, c_double, c_double),
        ("advance", c_int, c_void_p, c_double),
        ("run", c_int, c_void_p),
        ("now", c_double, c_void_p),
        ("instants", c_int, c_void_p, c_int),
        ("time", c_double, c_void_p, c_int, c_int),
        ("measure", c_double, c_void_p, c_int, c_int, c_int),
        ("page", POINTER(c_double), c_void_p, c_int, c_int, POINTER(c_int)),
        ("array", POINTER(c_double), c_void_p, c_char_p, POINTER(c_int64)),
        ("state_bytes", c_size_t, c_void_p),
        ("save", c_int, c_void_p, c_void_p, c_size_t),
        ("restore", c_int, c_void_p, c_void_p, c_size_t),
    ):
        function = getattr(opened, f"mbody_{name}")
        function.restype, function.argtypes = result, arguments
    return opened


class Refused(Exception):
    """An image that was not opened; the sentence."""


class Model:
    """An image opened by C."""

    def __init__(self, library, image):
        self.library, message = library, ctypes.create_string_buffer(600)
        self.model = library.mbody_open(image, len(image), message, len(message))
        if not self.model:
            raise Refused(message.value.decode())

    def __getattr__(self, name):
        function = getattr(self.library, f"mbody_{name}")
        return lambda *values: function(self.model, *values)

    def __del__(self):
        if self.__dict__.get("model"):
            self.library.mbody_free(self.model)

    @property
    def sentence(self):
        return self.message().decode()

    def entry(self, name):
        found = self.find_number(name.encode())
        return found if found >= 0 else self.find_measure(name.encode())

    def change(self, name, value):
        return self.set_number(self.entry(name), value)

    def history(self, motion, name):
        """A measure at all instants."""
        entry = self.entry(name)
        return [self.measure(motion, k, entry) for k in range(self.instants(motion))]

    def times(self, motion):
        return [self.time(motion, k) for k in range(self.instants(motion))]

    def numbers(self, name):
        """An array of the image, to be written too."""
        count = c_int64()
        found = self.array(name.encode(), count)
        return (c_double * count.value).from_address(ctypes.addressof(found.contents))

    def saved(self):
        state = ctypes.create_string_buffer(self.state_bytes())
        assert self.save(state, len(state)) == GOOD
        return state


def words_of(content):
    return np.frombuffer(bytearray(content), dtype=np.int64)


def sealed(content):
    """With its checksum: Σ (2n + 1) word n modulo 2⁶⁴, in word 13."""
    words = words_of(content).view(np.uint64).copy()
    words[13] = 0
    words[13] = np.sum((2 * np.arange(len(words), dtype=np.uint64) + 1) * words)
    return words.tobytes()
