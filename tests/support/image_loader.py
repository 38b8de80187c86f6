"""A loader of images that knows their bytes (docs/images.md) and the `_words` entries of the native
core, and nothing else of mbody.
"""

from __future__ import annotations

import ctypes
import json
import math

import numpy as np

from mbody.core import native, native_builder, selection
from mbody.core.interface import KERNELS
from mbody.kernels import (  # noqa: F401  (they enter their kernels)
    continuation,
    image_calls,
    number_program,
    runge_kutta,
)

NUMBER, MEASURE, CALL, ARRAY = 1, 3, 4, 5
#: Which kernel a call is of, by the last part of its name; how many results that has.
OF = {
    "driven": ("set_numbers", 1),
    "free": ("set_numbers", 1),
    "close": ("close_at", 3),
    "turn": ("follow", 1),
    "step": ("follow", 1),
    "measures": ("measures", 0),
    "begin": ("begin_motion", 1),
    "advance": ("runge_kutta", 1),
    "run": ("runge_kutta", 1),
}
#: Slots of motion.state, and codes of the integrator (mbody/kernels/step_state.py).
TIME, STEPS, DELIVERED, LAST_STEP_ALLOWED = 0, 2, 6, 18
DONE, MORE, LAST_STEP = 0, 1, 5


def entry(kernel: str):
    """The `_words` entry of a kernel of the native core."""
    choice = selection.chosen()
    if choice.library is not None:
        opened = ctypes.CDLL(str(choice.file))
    else:
        file = native.file_of(KERNELS[kernel])
        if not file.exists():
            native_builder.build([KERNELS[kernel]])
        opened = ctypes.CDLL(str(file))
    found = opened[f"mbody_{kernel}_words"]
    found.argtypes, found.restype = [ctypes.c_void_p, ctypes.c_void_p], ctypes.c_int32
    return found


class Loaded:
    """An image in memory, relocated."""

    def __init__(self, content: bytes) -> None:
        raw = np.zeros(len(content) + 64, dtype=np.uint8)
        skip = -raw.ctypes.data % 64
        self.raw, self.bytes = raw, raw[skip : skip + len(content)]
        self.bytes[:] = np.frombuffer(content, dtype=np.uint8)
        words = self.words = self.bytes.view(np.int64)
        base = self.base = self.bytes.ctypes.data
        assert content[:8] == b"mbodyimg" and words[1] == 1 and words[2] == len(content)
        for n in words[words[3] : words[3] + words[4]]:
            words[n] += base
        self.numbers, self.measures, self.calls, self.arrays = {}, {}, {}, {}
        self.units = {}
        table = words[words[5] : words[5] + 5 * words[6]].reshape(-1, 5)
        for kind, offset, count, name_at, unit_at in table.tolist():
            name, unit = self._text(name_at), self._text(unit_at)
            if kind == NUMBER:
                self.numbers[name] = self.bytes[offset : offset + 8].view(np.float64)
                self.units[name] = unit
            elif kind == MEASURE:
                self.measures[name], self.units[name] = count, unit
            elif kind == CALL:
                self.calls[name] = base + offset
            elif kind == ARRAY:
                self.arrays[name] = self.bytes[offset : offset + 8 * count].view(np.float64)
        text = self.bytes[words[7] : words[7] + words[8]].tobytes()
        self.manifest = json.loads(text.decode())
        self.sources = self.bytes[72:104].tobytes().hex()

    def _text(self, at):
        end = at + int(np.flatnonzero(self.bytes[at:] == 0)[0])
        return self.bytes[at:end].tobytes().decode()

    def __getitem__(self, name):
        return self.arrays[name]

    def workspace(self, analysis, part):
        """Rows of par or mass of a workspace: the first two arrays of its table, each a record of
        nine words whose third is the count and whose fifth the place of its numbers.
        """
        table = self._at(self._at(self.calls[f"numbers.{analysis}"], 3)[2], 18)
        count, place = table[9 * (part == "mass") :][[2, 4]]
        return self._at(place, count).view(np.float64)

    def _at(self, address, count):
        first = int(address) - self.base
        return self.bytes[first : first + 8 * int(count)].view(np.int64)

    def call(self, name):
        """Call a kernel: its result, or all of them."""
        kernel, count = OF[name.rpartition(".")[2]]
        results = np.zeros(max(count, 1), dtype=np.int64)
        assert entry(kernel)(self.calls[name], results.ctypes.data) == 0
        if count == 3:
            return bool(results[0]), bool(results[1]), float(results[2:].view(np.float64)[0])
        return int(results[0])

    def set(self, numbers, analysis):
        """Change numbers by name; what the program returns."""
        for name, value in numbers.items():
            self.numbers[name][0] = value
        return self.call(f"numbers.{analysis}")

    def close(self, t=0.0, given=None):
        """Close the loops; whether they do."""
        self["close.t"][0] = t
        if len(self["close.given"]):
            self["close.given"][:] = math.nan if given is None else given
        return self.call("close")[0]

    def output(self, name):
        """What is kept of every instant of a call, and what is measured of it."""
        rows = self["page.rows"].size
        pages = self[f"{name}.output" if name in ("turn", "step") else f"{name}.pages"]
        self.call(f"{name}.measures")
        found = self[f"{name}.measured"].reshape(-1, len(self.measures))
        return pages.reshape(-1, rows), {n: found[:, k] for n, k in self.measures.items()}

    def advance(self, until):
        """Go on until a time, which is kept; how it ended."""
        self["advance.until"][0] = self["advance.times"][0] = until
        state = self["motion.state"]
        state[DELIVERED] = state[LAST_STEP_ALLOWED] = 0.0
        return self.integrate("advance")

    def run(self):
        """The whole motion from the start."""
        assert self.call("begin") == 0
        if self["run.times"][0] <= self["start.times"][0]:
            rows = self["page.rows"].size
            self["run.pages"][:rows] = self["begin.page"]
            self["motion.state"][DELIVERED] = 1.0
        return self.integrate("run")

    def integrate(self, name):
        while True:
            code = self.call(name)
            if code == LAST_STEP:
                self["motion.state"][LAST_STEP_ALLOWED] = 1.0
            elif code != MORE:
                return code
