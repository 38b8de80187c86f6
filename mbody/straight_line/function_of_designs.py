"""The function of many designs: what `follow_designs` of the kernels does, for one topology."""

# mypy: disallow-any-unimported=False, disallow-untyped-calls=False

from __future__ import annotations

from typing import Any

from llvmlite import ir

from mbody.straight_line.code_interface import COLUMNS, WORDS_OF_DESIGNS
from mbody.straight_line.instructions import SHARED, constant
from mbody.straight_line.whole_function import FLOATS, I32, I64, OWN, FunctionWriter


class DesignsWriter(FunctionWriter):
    """Designs side by side, which share the instants; rows that are wanted are kept."""

    words = WORDS_OF_DESIGNS
    addresses = dict.fromkeys(("par", "mass", "q", "steps", "initial", "output", "failed"), FLOATS)
    addresses |= dict.fromkeys(("kept", "groups"), I64.as_pointer())

    def _memory(self) -> None:
        super()._memory()
        rows = sum(len(self.pieces[name].results) for name in self.groups)
        self.page = self._variable(self.number, rows)

    def _whole(self) -> None:
        with self._loop(self.word["designs"], self.lanes) as low:
            self._designs(low)

    def _designs(self, low: Any) -> None:
        """As many designs as there are lanes, from `low` on; the last lanes repeat the last one."""
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
                    number = b.load(self._at(self.word[name], b.add(begin, design)))
                    value = b.insert_element(value, number, ir.Constant(I32, lane))
                self._store(value, self._at(self.own[name], row))
        self._begin()
        with self._loop(self.word["instants"]) as k:
            self._instant(k)
            self._keep(low, k)
        failed = self._load(self.newton["failed"])
        for lane in range(self.lanes):
            design = b.add(low, ir.Constant(I64, lane))
            with b.if_then(b.icmp_signed("<", design, count)):
                b.store(self._lane(failed, lane), self._at(self.word["failed"], design))

    def _load_step(self, k: Any) -> None:
        b = self.b
        begin = b.mul(k, ir.Constant(I64, len(COLUMNS)))
        self.step = {
            name: b.load(self._at(self.word["steps"], b.add(begin, ir.Constant(I64, n))))
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
        """The wanted rows of an instant: the groups to which they belong onto a page, and from it
        into the output.
        """
        b = self.b
        for n, name in enumerate(self.groups):
            flag = b.load(self._at(self.word["groups"], n))
            with b.if_then(b.icmp_signed("!=", flag, ir.Constant(I64, 0))):
                for row, value in self._piece(name).items():
                    self._store(value, self._at(self.page, int(row)))
        designs, instants = self.word["designs"], self.word["instants"]
        with self._loop(self.word["count"]) as n:
            row = b.load(self._at(self.word["kept"], n))
            value = self._load(self._at(self.page, row))
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
        self.b.store(self._lane(value, lane), self._at(self.word["output"], place))
