"""Order of the pieces, shared by the functions of designs and of one motion.

They do what `mbody.kernels.continuation_lanes` does, for one topology: the same predictions,
corrections and tests in the same order. Rows of the workspace that pass from one piece to another
are variables, which LLVM keeps in registers; the numbers of the lanes and the places behind are in
memory.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from llvmlite import ir

from mbody.compiler.numba_lanes import (
    extreme,
    if_odd,
    intrinsic,
    negate_if_two,
    select_ordered,
    sincos_near_zero,
)
from mbody.compiler.targets import Target
from mbody.core.interface import FASTMATH
from mbody.core.recorded_numbers import NumberRecording, Untraceable
from mbody.core.tolerances import PIVOT_GROWTH_LARGE
from mbody.kernels.continuation_lanes import ITERATIONS
from mbody.straight_line.pieces import ENTRY, STRUCTURAL, Description, Piece, Row

# -- LLVM instructions of recorded numbers: of lanes, and of what all lanes share --------------

# mypy: disallow-any-unimported=False, disallow-untyped-calls=False


SHARED = ir.DoubleType()

_BINARY = {"add": "fadd", "subtract": "fsub", "multiply": "fmul", "divide": "fdiv"}
_EXTREME = {"minimum": extreme("<"), "maximum": extreme(">")}
_UNARY = {"sqrt": intrinsic("sqrt"), "absolute": intrinsic("fabs")}
_FLAGS = tuple(FASTMATH)
#: Sine and cosine as the kernels have them, as plain Python.
sincos = sincos_near_zero.py_func


class _Emitted:
    """A number that writes instructions for what is computed with it."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _with(self, name: str, *operands: Any) -> _Emitted:
        values = [
            constant(self.value.type, one) if isinstance(one, float) else one.value
            for one in operands
        ]
        return _Emitted(self.builder, getattr(self.builder, name)(*values, flags=_FLAGS))

    def __add__(self, other: Any) -> _Emitted:
        return self._with("fadd", self, other)

    def __radd__(self, other: Any) -> _Emitted:
        return self._with("fadd", other, self)

    def __sub__(self, other: Any) -> _Emitted:
        return self._with("fsub", self, other)

    def __rsub__(self, other: Any) -> _Emitted:
        return self._with("fsub", other, self)

    def __mul__(self, other: Any) -> _Emitted:
        return self._with("fmul", self, other)

    def __rmul__(self, other: Any) -> _Emitted:
        return self._with("fmul", other, self)

    def if_odd(self, x: _Emitted, y: _Emitted) -> _Emitted:
        return _Emitted(self.builder, if_odd(self.builder, self.value, x.value, y.value))

    def negate_if_two(self, x: _Emitted) -> _Emitted:
        return _Emitted(self.builder, negate_if_two(self.builder, self.value, x.value))


def lanes_of(target: Target) -> int:
    """Number of lanes: numbers in the widest registers of a processor, four where these hold two or
    are not known.

    With more, a number takes several registers, of which there are too few: eight lanes in
    registers of four take up to a fifth longer than four.
    """
    return 8 if "+avx512f" in target.features or target.cpu == "x86-64-v4" else 4


def numbers_of(lanes: int) -> Any:
    """The type of numbers side by side, one of each lane."""
    return ir.VectorType(SHARED, lanes)


def constant(kind: Any, value: float) -> Any:
    """A constant of a type."""
    return ir.Constant(kind, [value] * kind.count if _of_lanes(kind) else value)


def in_all_lanes(builder: Any, value: Any, kind: Any) -> Any:
    """A shared number in every lane, as a number of that type."""
    if value.type == kind:
        return value
    place = ir.IntType(32)
    undefined = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(undefined, value, ir.Constant(place, 0))
    same = ir.Constant(ir.VectorType(place, kind.count), [0] * kind.count)
    return builder.shuffle_vector(first, undefined, same)


def _of_lanes(kind: Any) -> bool:
    return isinstance(kind, ir.VectorType)


def instructions(
    builder: Any,
    recording: NumberRecording,
    targets: Iterable[Any],
    read: Callable[[Hashable], Any],
    kind: Any,
) -> Callable[[Any], Any]:
    """Instructions of all that these recorded numbers need; `read` gives the value of an input.

    Returns the function from a target to its value in all lanes, a number of the type `kind`.
    """
    values: dict[int, Any] = {}
    sines: dict[int, tuple[Any, Any]] = {}
    for place in recording.needed(list(targets)):
        name, *operands = recording.made[place]
        if name == "constant":
            values[place] = float(operands[0])
        elif name == "input":
            values[place] = read(operands[0])
        elif name in ("sin", "cos"):
            if operands[0] not in sines:
                angle = _Emitted(builder, values[operands[0]])
                sines[operands[0]] = tuple(one.value for one in sincos(angle))
            values[place] = sines[operands[0]][name == "cos"]
        else:
            values[place] = _operation(builder, name, [values[one] for one in operands])

    def of(target: Any) -> Any:
        value = values[recording.place_of(target)]
        return _in_lanes(builder, kind, value)

    return of


def _operation(builder: Any, name: str, operands: list[Any]) -> Any:
    kinds = (one.type for one in operands if not isinstance(one, float))
    kind = next(filter(_of_lanes, kinds), SHARED)
    values = [_in_lanes(builder, kind, one) for one in operands]
    if name in _BINARY:
        return getattr(builder, _BINARY[name])(*values, flags=_FLAGS)
    if name in _EXTREME:
        return _EXTREME[name](builder, *values)
    if name in _UNARY:
        return _UNARY[name](builder, *values)
    if name == "negative":
        return builder.fneg(*values)
    if name == "select_le":
        return select_ordered(builder, *values)
    raise Untraceable(f"{name} of lanes")


def _in_lanes(builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(value, float):
        return constant(kind, value)
    return in_all_lanes(builder, value, kind)


# mypy: disallow-any-unimported=False, disallow-untyped-calls=False


#: Fields whose rows are the lanes' own numbers.
OWN = ("par", "mass")

I1, I32, I64 = ir.IntType(1), ir.IntType(32), ir.IntType(64)
FLOATS = SHARED.as_pointer()


class FunctionWriter(ABC):
    """Writes the function into a module when it is made.

    `lanes`: Lanes side by side in a register.
    `number`: Of numbers of all these lanes; `zero` and `one` are such numbers.
    `initial`: The rows whose first numbers the function is given.
    """

    #: Arguments of the function, and what those are that are addresses.
    words: tuple[str, ...]
    addresses: dict[str, Any]

    def __init__(
        self,
        module: Any,
        described: Description,
        pieces: dict[str, Piece],
        settled: dict[Row, float],
        lanes: int,
    ) -> None:
        self.lanes, self.number = lanes, numbers_of(lanes)
        self.zero, self.one = constant(self.number, 0.0), constant(self.number, 1.0)
        self.described, self.pieces = described, pieces
        self.bodies = described.layout.bodies
        self.place_rows = 3 * len(described.initial["q"])
        self.groups = [one for one in pieces if one.startswith(("motion", "primitive", "others"))]
        self.passed = _passed(pieces)
        self.initial = sorted(
            row
            for row in self.passed
            if row not in settled and described.initial[row[0]][row[1]] not in STRUCTURAL
            if row[0] not in ("q", "time")
        )
        function = ir.Function(module, ir.FunctionType(I32, [I64.as_pointer()]), ENTRY)
        entry, start = (function.append_basic_block(name) for name in ("entry", "start"))
        # variables are made where the function begins: in a loop they would be made again and again
        self.entry, self.b = ir.IRBuilder(entry), ir.IRBuilder(start)
        self._arguments(function.args[0])
        self._memory()
        self._all_lanes()
        self.b.ret(ir.Constant(I32, 0))
        self.entry.branch(start)

    @abstractmethod
    def _all_lanes(self) -> None:
        """All lanes through all instants."""

    @abstractmethod
    def _load_step(self, k: Any) -> None:
        """The numbers of step k into `step`."""

    @abstractmethod
    def _predict(self, k: Any) -> None:
        """The place of instant k, where there is one behind."""

    # ------------------------------------------------------------------------------------------
    # Memory

    def _arguments(self, words: Any) -> None:
        self.word = {
            name: self.b.load(self.b.gep(words, [ir.Constant(I64, n)]))
            for n, name in enumerate(self.words)
        }
        for name, kind in self.addresses.items():
            self.word[name] = self.b.inttoptr(self.word[name], kind)

    def _memory(self) -> None:
        first = self.described.initial
        self.rows = {row: self._variable(self.number) for row in self.passed}
        self.own = {name: self._variable(self.number, len(first[name])) for name in (*OWN, "q")}
        self.past = self._variable(self.number, 3 * self.place_rows)
        self.at = {row: self._variable(I64) for row in ("last", "before", "second")}
        newton = ("first", "residual", "growth", "failed", "most")
        self.newton = {name: self._variable(self.number) for name in newton}
        # whether three places predict from now on; whether the pivots are the second choice
        self.by_three, self.other = self._variable(I1), self._variable(I1)

    def _variable(self, kind: Any, count: int = 1) -> Any:
        made = self.entry.alloca(kind, count)
        made.align = self._bytes(kind)
        return made

    def _element(self, memory: Any, place: Any) -> Any:
        place = ir.Constant(I64, place) if isinstance(place, int) else place
        return self.b.gep(memory, [place])

    def _bytes(self, kind: Any) -> int:
        """Size of a value in bytes, and its alignment in our own memory."""
        return 8 * self.lanes if kind == self.number else 8

    def _load(self, place: Any, align: int | None = None) -> Any:
        value = self.b.load(place)
        value.align = align or self._bytes(value.type)
        return value

    def _store(self, value: Any, place: Any, align: int | None = None) -> None:
        stored = self.b.store(value, place)
        stored.align = align or self._bytes(value.type)

    # ------------------------------------------------------------------------------------------
    # Loops and choices

    @contextmanager
    def _loop(self, stop: Any, step: int = 1) -> Iterator[Any]:
        """The code within, for numbers from zero on below `stop`."""
        stop = ir.Constant(I64, stop) if isinstance(stop, int) else stop
        counter = self._variable(I64)
        self.b.store(ir.Constant(I64, 0), counter)
        head, body, after = (self.b.append_basic_block(name) for name in ("head", "body", "after"))
        self.b.branch(head)
        self.b.position_at_end(head)
        number = self.b.load(counter)
        self.b.cbranch(self.b.icmp_signed("<", number, stop), body, after)
        self.b.position_at_end(body)
        yield number
        self.b.store(self.b.add(number, ir.Constant(I64, step)), counter)
        self.b.branch(head)
        self.b.position_at_end(after)

    def _any(self, lanes: Any) -> Any:
        """Whether any of the truth values of lanes is true."""
        bits = self.b.bitcast(lanes, ir.IntType(self.lanes))
        return self.b.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(self.lanes), 0))

    def _lane(self, value: Any, lane: int) -> Any:
        return self.b.extract_element(value, ir.Constant(I32, lane))

    def _greatest(self, value: Any) -> Any:
        """The greatest of all lanes; NaN where one is NaN."""
        found = self._lane(value, 0)
        for lane in range(1, self.lanes):
            other = self._lane(value, lane)
            chosen = self.b.select(self.b.fcmp_unordered(">", found, other), found, other)
            found = self.b.select(self.b.fcmp_unordered("uno", other, other), other, chosen)
        return found

    # ------------------------------------------------------------------------------------------
    # Pieces

    def _piece(self, name: str) -> dict[str, Any]:
        """The instructions of a piece; returns its further results."""
        piece = self.pieces[name]
        targets = {
            row: number
            for row, number in piece.stored.items()
            if row in self.rows or row[0] == "past"
        }
        needed = [*targets.values(), *piece.results.values()]
        value_of = instructions(self.b, piece.recording, needed, self._read, self.number)
        stored = {row: value_of(number) for row, number in targets.items()}
        results = {one: value_of(number) for one, number in piece.results.items()}
        for row, value in stored.items():
            self._store(value, self._past(row[1]) if row[0] == "past" else self.rows[row])
        return results

    def _read(self, name: Hashable) -> Any:
        assert isinstance(name, tuple)
        kind, which = name
        if kind == "step":
            return self.step[which]
        if kind == "newton":
            return self._load(self.newton[which])
        if kind in OWN:
            return self._load(self._element(self.own[kind], which))
        if kind == "past":
            return self._load(self._past(which))
        return self._load(self.rows[kind, which])

    def _past(self, row: int) -> Any:
        """A row of the places behind; the pieces have the last one at first, that before it as the
        third, and go on to the second.
        """
        which, offset = divmod(row, self.place_rows)
        begin = self.b.load(self.at[("last", "second", "before")[which]])
        return self._element(self.past, self.b.add(begin, ir.Constant(I64, offset)))

    # ------------------------------------------------------------------------------------------
    # Instants

    def _begin(self) -> None:
        """Constant signals, first numbers of all rows, no places behind."""
        b = self.b
        for row, variable in self.rows.items():
            if row[0] == "q":
                self._store(self._load(self._element(self.own["q"], row[1])), variable)
            elif row in self.initial:
                place = self._element(self.word["initial"], self.initial.index(row))
                self._store(self._everywhere(b.load(place)), variable)
            else:
                first = self.described.initial[row[0]][row[1]] if row[0] != "time" else 0.0
                self._store(constant(self.number, float(first)), variable)
        with self._loop(3 * self.place_rows) as row:
            self._store(self.zero, self._element(self.past, row))
        for n, name in enumerate(("last", "second", "before")):
            b.store(ir.Constant(I64, n * self.place_rows), self.at[name])
        b.store(ir.Constant(I1, 0), self.by_three)
        b.store(ir.Constant(I1, 0), self.other)
        self._store(self.zero, self.newton["failed"])
        self.step: dict[str, Any] = {}
        self._piece("prologue")

    def _everywhere(self, value: Any) -> Any:
        return in_all_lanes(self.b, value, self.number)

    def _instant(self, k: Any) -> None:
        """Predict, correct, judge."""
        b = self.b
        self._load_step(k)
        self._predict(k)
        self._piece("prescribe")
        self._correct(k)
        self._with_pivots(self._conclude)
        last, second = b.load(self.at["last"]), b.load(self.at["second"])
        b.store(b.load(self.at["before"]), self.at["second"])
        b.store(last, self.at["before"])
        b.store(second, self.at["last"])

    def _correct(self, k: Any) -> None:
        """Newton's method, until no lane that has not failed must be corrected any more."""
        b = self.b
        iteration = self._variable(I64)
        b.store(ir.Constant(I64, 0), iteration)
        again, after = b.append_basic_block("correct"), b.append_basic_block("corrected")
        b.branch(again)
        b.position_at_end(again)
        self._piece("position")
        self._factor()
        self._with_pivots(self._newton)
        number = b.load(iteration)
        residual = self._load(self.newton["residual"])
        at_first = b.icmp_signed("==", number, ir.Constant(I64, 0))
        with b.if_then(at_first):
            self._store(residual, self.newton["first"])
        small = self._everywhere(self.step["small"])
        open_ = b.and_(b.fcmp_unordered(">", residual, small), self._sound())
        more = self._any(open_)
        with b.if_then(b.and_(b.and_(at_first, more), b.icmp_signed(">", k, ir.Constant(I64, 2)))):
            b.store(ir.Constant(I1, 1), self.by_three)
        number = b.add(number, ir.Constant(I64, 1))
        b.store(number, iteration)
        fewer = b.icmp_signed("<", number, ir.Constant(I64, ITERATIONS))
        b.cbranch(b.and_(more, fewer), again, after)
        b.position_at_end(after)

    def _sound(self) -> Any:
        """Which lanes have not failed."""
        return self.b.fcmp_ordered("<=", self._load(self.newton["failed"]), self.zero)

    def _factor(self) -> None:
        """Factor by the present choice of pivots; by the other one where that loses figures."""
        if len(self.described.squares) == 1:
            self._store(self._piece("factor 0")["growth"], self.newton["growth"])
        else:
            self._with_pivots(self._better)

    def _better(self, now: int) -> None:
        b, other = self.b, 1 - now
        growth = self._piece(f"factor {now}")["growth"]
        self._store(growth, self.newton["growth"])
        worst = self._greatest(b.select(self._sound(), growth, self.zero))
        with b.if_then(b.fcmp_unordered(">", worst, constant(SHARED, PIVOT_GROWTH_LARGE))):
            others = self._piece(f"factor {other}")["growth"]
            best = self._greatest(b.select(self._sound(), others, self.zero))
            with b.if_then(b.fcmp_ordered("<", best, worst)):
                self._store(others, self.newton["growth"])
                b.store(ir.Constant(I1, other), self.other)

    def _with_pivots(self, write: Callable[[int], None]) -> None:
        """The code for the present choice of pivots."""
        if len(self.described.squares) == 1:
            write(0)
            return
        with self.b.if_else(self.b.load(self.other)) as (then, otherwise):
            with then:
                write(1)
            with otherwise:
                write(0)

    def _newton(self, n: int) -> None:
        self._store(self._piece(f"newton {n}")["residual"], self.newton["residual"])

    def _conclude(self, n: int) -> None:
        for name, value in self._piece(f"conclude {n}").items():
            self._store(value, self.newton[name])


def _passed(pieces: dict[str, Piece]) -> list[Row]:
    """Rows that one piece leaves to another: read where their own piece has not stored them."""
    found: set[Row] = set()
    seen = -1
    while len(found) != seen:
        seen = len(found)
        for piece in pieces.values():
            targets = [number for row, number in piece.stored.items() if _lasting(row, found)]
            for place in _inputs(piece.recording, [*targets, *piece.results.values()]):
                if place[0] not in ("step", "newton", "past", *OWN):
                    found.add(place)
    return sorted(found)


def _lasting(row: Row, passed: set[Row]) -> bool:
    return row in passed or row[0] == "past"


def _inputs(recording: NumberRecording, targets: list[Any]) -> Iterator[Row]:
    for place in recording.needed(targets):
        kind, *operands = recording.made[place]
        if kind == "input":
            yield operands[0]
