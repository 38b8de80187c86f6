"""The function of one motion, cut into as many pieces as there are lanes: what `follow_lanes` of
the kernels does, for one topology.
"""

# mypy: disallow-any-unimported=False, disallow-untyped-calls=False

from __future__ import annotations

from typing import Any

from llvmlite import ir

from mbody.kernels.continuation import BY_DRIVER
from mbody.straight_line.code_interface import WORDS_OF_MOTION
from mbody.straight_line.instructions import LANES, NUMBER, SHARED, constant
from mbody.straight_line.whole_function import FLOATS, I64, ONE, OWN, ZERO, FunctionWriter

__all__ = ["MotionWriter"]

#: What the caller's arrays begin at: a number.
CALLERS = 8


class MotionWriter(FunctionWriter):
    """Pieces of one motion side by side, each with instants of its own; all rows are kept."""

    words = WORDS_OF_MOTION
    addresses = dict.fromkeys(("small", "initial"), FLOATS)

    def _whole(self) -> None:
        self.worst, self.when = self._variable(NUMBER), self._variable(NUMBER)
        with self._loop(self.word["lanes"], LANES) as low:
            self.low = low
            self._lanes()

    def _lanes(self) -> None:
        """As many pieces as lanes of the code, from `low` on."""
        for name in (*OWN, "q"):
            with self._loop(len(self.described.initial[name])) as row:
                self._store(self._theirs(name, row), self._at(self.own[name], row))
        self._store(ZERO, self.worst)
        self._store(ZERO, self.when)
        self._begin()
        with self._loop(self.word["instants"]) as k:
            self._instant(k)
            self._remember_worst(k)
            self._keep(k)
        for n, variable in enumerate((self.newton["failed"], self.worst, self.when)):
            self._put("found", n, self._load(variable))

    def _place(self, name: str, row: Any) -> Any:
        """Where a row of the caller's has the numbers of these lanes."""
        row = ir.Constant(I64, row) if isinstance(row, int) else row
        place = self.b.add(self.b.mul(row, self.word["lanes"]), self.low)
        address = self.b.add(self.word[name], self.b.mul(place, ir.Constant(I64, 8)))
        return self.b.inttoptr(address, NUMBER.as_pointer())

    def _theirs(self, name: str, row: Any) -> Any:
        return self._load(self._place(name, row), CALLERS)

    def _put(self, name: str, row: Any, value: Any) -> None:
        self._store(value, self._place(name, row), CALLERS)

    def _load_step(self, k: Any) -> None:
        b = self.b
        none, first = ir.Constant(I64, 0), ir.Constant(I64, 1)
        before = b.select(b.icmp_signed(">", k, none), b.sub(k, first), none)
        earlier = b.select(b.icmp_signed(">", before, none), b.sub(before, first), none)
        here, last, second = (self._theirs("s", n) for n in (k, before, earlier))
        back = b.fsub(last, second)
        there = b.fcmp_unordered("!=", back, ZERO)
        self.step = {
            "here": here,
            "time": self._theirs("t", k),
            "h": b.fsub(here, last),
            "back": back,
            "seen": self._where(b.icmp_signed(">", k, none)),
            "seen_twice": self._where(b.icmp_signed(">", k, first)),
            "back_safe": b.select(there, back, ONE),
            "quintic": b.select(there, ONE, ZERO),
            "small": b.load(self.word["small"]),
        }
        if self.described.path.mode == BY_DRIVER:
            row = b.mul(k, ir.Constant(I64, 2))
            for n, name in enumerate(("rate", "acceleration")):
                self.step[name] = self._theirs("given", b.add(row, ir.Constant(I64, n)))
        else:
            self.step |= dict.fromkeys(("rate", "acceleration"), constant(SHARED, 0.0))

    def _where(self, condition: Any) -> Any:
        """One where that is so, else zero; shared."""
        return self.b.select(condition, constant(SHARED, 1.0), constant(SHARED, 0.0))

    def _predict(self, k: Any) -> None:
        with self.b.if_then(self.b.icmp_signed(">", k, ir.Constant(I64, 0))):
            self._piece("two")

    def _remember_worst(self, k: Any) -> None:
        """The greatest inverse determinant of a block so far, and the instant of it."""
        b = self.b
        most, worst = self._load(self.newton["most"]), self._load(self.worst)
        greater = b.fcmp_unordered(">", most, worst)
        now = self._everywhere(b.sitofp(k, SHARED))
        self._store(b.select(greater, now, self._load(self.when)), self.when)
        self._store(b.select(greater, most, worst), self.worst)

    def _keep(self, k: Any) -> None:
        """All rows of an instant into the output (rows, instants, lanes)."""
        for name in self.groups:
            for row, value in self._piece(name).items():
                begin = self.b.mul(self.word["instants"], ir.Constant(I64, int(row)))
                self._put("output", self.b.add(begin, k), value)
