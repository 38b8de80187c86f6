"""Straight-line code as functions of machine code: of one motion, and of many designs at once."""

from __future__ import annotations

from typing import Any

from llvmlite import ir

from mbody.kernels.continuation import BY_DRIVER
from mbody.straight_line.pieces import COLUMNS, WORDS_OF_DESIGNS, WORDS_OF_MOTION
from mbody.straight_line.whole_function import (
    FLOATS,
    I32,
    I64,
    OWN,
    SHARED,
    FunctionWriter,
    constant,
)

# mypy: disallow-any-unimported=False, disallow-untyped-calls=False


ONE_MORE = ir.Constant(I64, 1)
#: What the caller's arrays begin at: a number.
CALLERS = 8
#: Side of the squares by which a buffer is transposed.
SIDE = 4


class MotionWriter(FunctionWriter):
    """Pieces of one motion side by side, each with instants of its own; all rows are kept."""

    words = WORDS_OF_MOTION
    addresses = dict.fromkeys(("small", "initial", "output"), FLOATS)

    def _all_lanes(self) -> None:
        self.worst, self.when = self._variable(self.number), self._variable(self.number)
        self.rows_kept = sum(len(self.pieces[name].results) for name in self.groups)
        # rows of the last instants, as many as there are lanes: (rows, instants)
        self.buffer = self._variable(self.number, self.lanes * self.rows_kept)
        with self._loop(self.word["lanes"], self.lanes) as low:
            self.low = low
            self._lanes()

    def _lanes(self) -> None:
        """Code for as many pieces as it has lanes, from `low` on."""
        for name in (*OWN, "q"):
            with self._loop(len(self.described.initial[name])) as row:
                self._store(self._theirs(name, row), self._element(self.own[name], row))
        self._store(self.zero, self.worst)
        self._store(self.zero, self.when)
        self._begin()
        with self._loop(self.word["instants"]) as k:
            self._instant(k)
            self._remember_worst(k)
            self._keep(k)
        self._keep_remaining()
        for n, variable in enumerate((self.newton["failed"], self.worst, self.when)):
            self._put("found", n, self._load(variable))

    def _lane_address(self, name: str, row: Any) -> Any:
        """Place of the numbers of these lanes in a row of the caller's."""
        row = ir.Constant(I64, row) if isinstance(row, int) else row
        place = self.b.add(self.b.mul(row, self.word["lanes"]), self.low)
        address = self.b.add(self.word[name], self.b.mul(place, ir.Constant(I64, 8)))
        return self.b.inttoptr(address, self.number.as_pointer())

    def _theirs(self, name: str, row: Any) -> Any:
        return self._load(self._lane_address(name, row), CALLERS)

    def _put(self, name: str, row: Any, value: Any) -> None:
        self._store(value, self._lane_address(name, row), CALLERS)

    def _load_step(self, k: Any) -> None:
        b = self.b
        none, first = ir.Constant(I64, 0), ir.Constant(I64, 1)
        before = b.select(b.icmp_signed(">", k, none), b.sub(k, first), none)
        earlier = b.select(b.icmp_signed(">", before, none), b.sub(before, first), none)
        here, last, second = (self._theirs("s", n) for n in (k, before, earlier))
        back = b.fsub(last, second)
        there = b.fcmp_unordered("!=", back, self.zero)
        self.step = {
            "here": here,
            "time": self._theirs("t", k),
            "h": b.fsub(here, last),
            "back": back,
            "seen": self._where(b.icmp_signed(">", k, none)),
            "seen_twice": self._where(b.icmp_signed(">", k, first)),
            "back_safe": b.select(there, back, self.one),
            "quintic": b.select(there, self.one, self.zero),
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
        """All rows of an instant into the buffer; a full one into the output, and the last instant
        into the ends.
        """
        b = self.b
        place = b.and_(k, ir.Constant(I64, self.lanes - 1))
        for name in self.groups:
            for row, value in self._piece(name).items():
                at = b.add(place, ir.Constant(I64, self.lanes * int(row)))
                self._store(value, self._element(self.buffer, at))
        last = b.sub(self.word["instants"], ONE_MORE)
        with b.if_else(b.icmp_signed("==", k, last)) as (then, otherwise):
            with then, self._loop(self.rows_kept) as row:
                at = b.add(place, b.mul(row, ir.Constant(I64, self.lanes)))
                self._put("ends", row, self._load(self._element(self.buffer, at)))
            with otherwise, b.if_then(b.icmp_signed("==", place, ir.Constant(I64, self.lanes - 1))):
                self._transpose(b.sub(k, place))

    def _transpose(self, first: Any) -> None:
        """A full buffer into the output (rows, lanes, instants), from instant `first` on: by
        squares that fit into the registers of most processors.
        """
        b = self.b
        with self._loop(self.rows_kept) as row:
            buffer = b.mul(row, ir.Constant(I64, self.lanes))
            lanes = [b.add(self._output_place(row, lane), first) for lane in range(self.lanes)]
            for low in range(0, self.lanes, SIDE):
                for begin in range(0, self.lanes, SIDE):
                    square = []
                    for n in range(begin, begin + SIDE):
                        numbers = self._numbers(
                            self._element(self.buffer, b.add(buffer, _number(n)))
                        )
                        square.append(b.load(self._side(numbers, _number(low)), align=8 * SIDE))
                    for n, value in enumerate(transposed(b, square)):
                        place = b.add(lanes[low + n], _number(begin))
                        b.store(value, self._side(self.word["output"], place), align=CALLERS)

    def _numbers(self, place: Any) -> Any:
        return self.b.bitcast(place, FLOATS)

    def _side(self, numbers: Any, place: Any) -> Any:
        """So many numbers side by side from a place on."""
        return self.b.bitcast(
            self._element(numbers, place), ir.VectorType(SHARED, SIDE).as_pointer()
        )

    def _keep_remaining(self) -> None:
        """The instants of a buffer that did not become full into the output."""
        b = self.b
        kept = b.sub(self.word["instants"], ONE_MORE)
        count = b.and_(kept, ir.Constant(I64, self.lanes - 1))
        first = b.sub(kept, count)
        with self._loop(self.rows_kept) as row, self._loop(count) as n:
            buffer = b.add(b.mul(row, ir.Constant(I64, self.lanes)), n)
            value = self._load(self._element(self.buffer, buffer))
            for lane in range(self.lanes):
                place = b.add(self._output_place(row, lane), b.add(first, n))
                b.store(self._lane(value, lane), self._element(self.word["output"], place))

    def _output_place(self, row: Any, lane: int) -> Any:
        """Beginning of a lane of the output: (rows, lanes, stride)."""
        b = self.b
        lanes = b.add(b.mul(row, self.word["lanes"]), b.add(self.low, ir.Constant(I64, lane)))
        return b.mul(lanes, self.word["stride"])


def transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Columns of rows as rows of columns, the transpose: by pairs, then fours, and so on."""
    rows, count, width = list(rows), len(rows), 1
    while width < count:
        # of two blocks side by side the second of one changes places with the first of the other
        low = [n if not n & width else count + n - width for n in range(count)]
        high = [n + width if not n & width else count + n for n in range(count)]
        for n in range(count):
            if not n & width:
                one, other = rows[n], rows[n + width]
                rows[n] = builder.shuffle_vector(one, other, _mask(low))
                rows[n + width] = builder.shuffle_vector(one, other, _mask(high))
        width *= 2
    return rows


def _mask(places: list[int]) -> Any:
    return ir.Constant(ir.VectorType(I32, len(places)), places)


def _number(value: int) -> Any:
    return ir.Constant(I64, value)


# -- The function of many designs: what `follow_designs` of the kernels does, for one topology -

# mypy: disallow-any-unimported=False, disallow-untyped-calls=False


class DesignsWriter(FunctionWriter):
    """Designs side by side, which share the instants; rows that are wanted are kept."""

    words = WORDS_OF_DESIGNS
    addresses = dict.fromkeys(("par", "mass", "q", "steps", "initial", "output", "failed"), FLOATS)
    addresses |= dict.fromkeys(("kept", "groups"), I64.as_pointer())

    def _memory(self) -> None:
        super()._memory()
        rows = sum(len(self.pieces[name].results) for name in self.groups)
        self.buffer = self._variable(self.number, rows)

    def _all_lanes(self) -> None:
        with self._loop(self.word["designs"], self.lanes) as low:
            self._designs(low)

    def _designs(self, low: Any) -> None:
        """Code for as many designs as it has lanes, from `low` on; the last lanes repeat the last
        one.
        """
        b, count = self.b, self.word["designs"]
        last = b.sub(count, ir.Constant(I64, 1))
        members = []
        for lane in range(self.lanes):
            design = b.add(low, ir.Constant(I64, lane))
            members.append(b.select(b.icmp_signed("<", design, count), design, last))
        for name in (*OWN, "q"):
            with self._loop(len(self.described.initial[name])) as row:
                begin, value = b.mul(row, count), ir.Constant(self.number, ir.Undefined)
                for lane, design in enumerate(members):
                    number = b.load(self._element(self.word[name], b.add(begin, design)))
                    value = b.insert_element(value, number, ir.Constant(I32, lane))
                self._store(value, self._element(self.own[name], row))
        self._begin()
        with self._loop(self.word["instants"]) as k:
            self._instant(k)
            self._keep(low, k)
        failed = self._load(self.newton["failed"])
        for lane in range(self.lanes):
            design = b.add(low, ir.Constant(I64, lane))
            with b.if_then(b.icmp_signed("<", design, count)):
                b.store(self._lane(failed, lane), self._element(self.word["failed"], design))

    def _load_step(self, k: Any) -> None:
        b = self.b
        begin = b.mul(k, ir.Constant(I64, len(COLUMNS)))
        self.step = {
            name: b.load(self._element(self.word["steps"], b.add(begin, ir.Constant(I64, n))))
            for n, name in enumerate(COLUMNS)
        }

    def _predict(self, k: Any) -> None:
        b = self.b
        with b.if_then(b.fcmp_ordered(">", self.step["seen"], constant(SHARED, 0.0))):
            three = b.fcmp_ordered(">", self.step["three"], constant(SHARED, 0.0))
            with b.if_else(b.and_(three, b.load(self.by_three))) as (then, otherwise):
                with then:
                    self._piece("three")
                with otherwise:
                    self._piece("two")

    def _keep(self, low: Any, k: Any) -> None:
        """The wanted rows of an instant: the groups to which they belong into a buffer, and from it
        into the output.
        """
        b = self.b
        for n, name in enumerate(self.groups):
            flag = b.load(self._element(self.word["groups"], n))
            with b.if_then(b.icmp_signed("!=", flag, ir.Constant(I64, 0))):
                for row, value in self._piece(name).items():
                    self._store(value, self._element(self.buffer, int(row)))
        designs, instants = self.word["designs"], self.word["instants"]
        with self._loop(self.word["count"]) as n:
            row = b.load(self._element(self.word["kept"], n))
            value = self._load(self._element(self.buffer, row))
            first = b.add(b.mul(b.add(b.mul(n, designs), low), instants), k)
            whole = b.icmp_signed("<=", b.add(low, ir.Constant(I64, self.lanes)), designs)
            with b.if_else(whole) as (then, otherwise):
                with then:
                    for lane in range(self.lanes):
                        self._put(value, lane, first, instants)
                with otherwise:
                    for lane in range(self.lanes):
                        inside = b.add(low, ir.Constant(I64, lane))
                        with b.if_then(b.icmp_signed("<", inside, designs)):
                            self._put(value, lane, first, instants)

    def _put(self, value: Any, lane: int, first: Any, instants: Any) -> None:
        place = self.b.add(first, self.b.mul(instants, ir.Constant(I64, lane)))
        self.b.store(self._lane(value, lane), self._element(self.word["output"], place))
