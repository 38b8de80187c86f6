"""The pieces of which the code is made: what kernels do between two decisions, recorded.

The kernels' own functions run as plain Python on recorded numbers, with the index lists of one
topology: loops over lists become lists of operations, and what is constant is folded. What depends
on numbers (how often Newton's method corrects, which pivots are taken, by how many places one
predicts) lies between the pieces and is written in `mbody.straight_line.whole_function`.

A row of a workspace is named (field, number). A piece begins with all rows as the pieces before it
leave them, known constants among them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from mbody.core.recorded_numbers import NumberRecording, Untraceable
from mbody.kernels.constraints import body_rotations, rows
from mbody.kernels.continuation import predict, predict_by_three
from mbody.kernels.continuation_lanes import LanePath, conclude, newton_square, prescribe
from mbody.kernels.forces import signals
from mbody.kernels.layout import PER_PRIMITIVE, keep_primitive
from mbody.kernels.square_lu import factor_square

# -- Interface between straight-line code and its callers --------------------------------------

#: Name of the function, as `mbody.core.selection.Library.function` looks it up.
ENTRY = "mbody_straight_line_np"
#: Numbers of a step, which designs share, while each piece of a motion has its own: path parameter,
#: time; the step and the one before it, whether there are such; the one before for predictions, the
#: way to the third place, and whether two places predict; rate and acceleration of the one driver;
#: the square of the accepted correction.
STEP = (
    "here", "time", "h", "back", "seen", "seen_twice", "back_safe", "longer", "quintic", "rate",
    "acceleration", "small",
)  # fmt: skip
#: The columns of the table of steps: these numbers, and whether three places may predict.
COLUMNS = (*STEP, "three")
#: Arguments of the function of designs, words of eight bytes: numbers of designs and instants;
#: addresses of parameters, masses and first positions, each (rows, designs), of the table of steps
#: (instants, columns), of first numbers of rows, of the rows that are kept, and how many they are;
#: of which groups of outputs are needed, of the output (kept, designs, instants), of the failed
#: designs.
WORDS_OF_DESIGNS = (
    "designs", "instants", "par", "mass", "q", "steps", "initial", "kept", "count", "groups",
    "output", "failed",
)  # fmt: skip
#: Arguments of the function of one motion: numbers of lanes, a multiple of those of the code, and
#: of instants of a lane;
#: addresses of parameters, masses and first positions, each (rows, lanes), of path parameters and
#: times (instants, lanes), of rates and accelerations of the one driver (2·instants, lanes), of the
#: square of the accepted correction, of first numbers of rows; how many numbers of the output a
#: lane has; addresses of the output (rows, lanes, that many) of all instants but the last of each
#: lane, of those last ones (rows, lanes), and of what is found of each lane, as
#: `LanesOutput.found` has it.
WORDS_OF_MOTION = (
    "lanes", "instants", "par", "mass", "q", "s", "t", "given", "small", "initial", "stride",
    "output", "ends", "found",
)  # fmt: skip
#: Workspaces of the two choices of pivots.
FACTORS = ("first factor", "second factor")
#: What first numbers of rows the code relies on, the structure of blocks; others are given to it.
STRUCTURAL = (0.0, 1.0, -1.0)
#: How the builder ends where there is no straight-line code.
NONE = 3


# -- Instants and prescribed driver values of all lanes ----------------------------------------


@dataclass(frozen=True, eq=False)
class LaneInstants:
    """The fields of `LanePath`; kernels take that one, which takes time to make."""

    mode: int
    s: np.ndarray
    t: np.ndarray
    given: np.ndarray
    position_norm: float
    with_forces: bool
    at_rest: bool

    @functools.cached_property
    def path(self) -> LanePath:
        """Instants of the lanes as a bundle for kernels."""
        names = LanePath.fields
        return LanePath(**{name: getattr(self, name) for name in names})


Row = tuple[str, int]


@dataclass(frozen=True)
class Description:
    """A topology, as the builder gets it.

    `layout`: The index lists of `mbody.kernels.layout.Layout`.
    `squares`: One or two choices of pivots, as `mbody.kernels.square_lu.Square`.
    `path`: ``mode``, ``with_forces`` and ``at_rest`` of `LanePath`, and ``pieces``: whether lanes
      are pieces of one motion, else designs.
    `initial`: First numbers of the workspace, by field: arrays (rows,); NaN where lanes differ.
    """

    layout: Any
    squares: tuple[Any, ...]
    path: Any
    initial: dict[str, np.ndarray]


@dataclass(frozen=True)
class Piece:
    """Recorded operations of a piece of the code, and its results.

    `recording`: Inputs are rows, and ("step", name) for numbers of a step, ("newton", name) for
      what Newton's method leaves.
    `stored`: Recorded number of every row that it changes.
    `results`: Further numbers that it gives, by name.
    """

    recording: NumberRecording
    stored: dict[Row, Any]
    results: dict[str, Any]


class _PieceRecorder:
    """Runs the kernels' functions, and keeps what is known of every row."""

    def __init__(self, described: Description, known: dict[Row, float]) -> None:
        self.described, self.known = described, known
        self.fields = {name: len(first) for name, first in described.initial.items()}

    def piece(self, run: Callable[..., dict[str, Any] | None]) -> Piece:
        """The piece that `run` is, called with the workspace, those of both factors, and what gives
        the other inputs by name.
        """
        unknown = [
            (name, n)
            for name, count in self.fields.items()
            for n in range(count)
            if (name, n) not in self.known
        ]
        others = [("step", name) for name in STEP]
        others += [("newton", name) for name in ("first", "residual", "growth", "failed")]
        recording = NumberRecording([*unknown, *others], finite=True)
        arrays = {name: self._rows(name, count, recording) for name, count in self.fields.items()}
        before = {name: array.copy() for name, array in arrays.items()}
        work = SimpleNamespace(**{n: a for n, a in arrays.items() if not n.endswith(" factor")})
        factors = []
        for name, square in zip(FACTORS, self.described.squares, strict=False):
            numbers = len(square.target) + len(square.fill)
            factors.append(SimpleNamespace(factor=arrays[name][:numbers], x=arrays[name][numbers:]))
        results = run(work, factors, recording.inputs.__getitem__) or {}
        stored = {}
        for name, array in arrays.items():
            for n in range(len(array)):
                if array[n, 0] is not before[name][n, 0]:
                    stored[name, n] = array[n, 0]
        self._learn(recording, stored)
        return Piece(recording, stored, results)

    def _rows(self, name: str, count: int, recording: NumberRecording) -> np.ndarray:
        array = np.empty((count, 1), dtype=object)
        for n in range(count):
            known = self.known.get((name, n))
            array[n, 0] = recording.inputs[name, n] if known is None else recording.constant(known)
        return array

    def _learn(self, recording: NumberRecording, stored: dict[Row, Any]) -> None:
        for row, number in stored.items():
            value = recording.value_of(number)
            if value is not None and np.isfinite(value):
                self.known[row] = value
            else:
                self.known.pop(row, None)


def recorded_pieces(described: Description) -> tuple[dict[str, Piece], dict[Row, float]]:
    """The pieces by name, and the rows that are constant throughout with their values."""
    initial = {
        (name, n): float(value)
        for name, first in described.initial.items()
        if name not in ("par", "mass", "q", "past", "time")
        for n, value in enumerate(first)
        if value in STRUCTURAL
    }
    # the ground does not move
    n3 = 3 * described.layout.bodies
    initial |= {("q", n): 0.0 for n in range(n3, len(described.initial["q"]))}
    if described.layout.friction_kind.shape[0] > 0:
        raise Untraceable("which pairs slide depends on numbers")
    # once with nothing known, for the rows that a step changes: of those nothing is known before it
    first = _pieces(_PieceRecorder(described, {}), set())
    stored_rows = {row for piece in first.values() for row in piece.stored}
    repeated = {row for name, piece in first.items() if _repeats(name) for row in piece.stored}
    beginning = _PieceRecorder(described, dict(initial))
    prologue = beginning.piece(_prologue(described))
    settled = {row: value for row, value in beginning.known.items() if row not in stored_rows}
    pieces = _pieces(_PieceRecorder(described, dict(settled)), repeated)
    return {"prologue": prologue, **pieces}, settled


def _repeats(name: str) -> bool:
    """Whether a piece belongs to Newton's method."""
    return name.startswith(("position", "factor", "newton"))


def _prologue(described: Description) -> Callable[..., None]:
    """Constant signals."""
    L = described.layout

    def run(W: Any, factors: Any, given: Any) -> None:
        signals(L, W, 0.0, L.signal_law.shape[0])

    return run


def _pieces(recorder: _PieceRecorder, repeated: set[Row]) -> dict[str, Piece]:
    """The pieces of a step, in the order in which they run; `repeated` are the rows that Newton's
    method changes, of which nothing is known before a correction.
    """
    described = recorder.described
    L, path, squares = described.layout, described.path, described.squares
    found: dict[str, Piece] = {}

    def three(W: Any, factors: Any, given: Any) -> None:
        h, back, longer = (given(("step", name)) for name in ("h", "back_safe", "longer"))
        predict_by_three(L, W, 0.0, h, back, longer, 0)

    def two(W: Any, factors: Any, given: Any) -> None:
        h, back, quintic = (given(("step", name)) for name in ("h", "back_safe", "quintic"))
        predict(L, W, 0.0, h, back, quintic, 0)

    def position(W: Any, factors: Any, given: Any) -> None:
        body_rotations(L, W, 0.0)
        rows(L, W, 0.0, True, None)

    def prescribed(W: Any, factors: Any, given: Any) -> None:
        W.time[0, 0] = given(("step", "time"))
        prescribe(L, W, 0.0, path, given(("step", "here")))

    found["three"] = recorder.piece(three)
    found["two"] = recorder.piece(two)
    found["prescribe"] = recorder.piece(prescribed)
    recorder.known = {row: value for row, value in recorder.known.items() if row not in repeated}
    found["position"] = recorder.piece(position)
    known = dict(recorder.known)
    after: list[dict[Row, float]] = []
    for n, square in enumerate(squares):
        recorder.known = dict(known)
        found[f"factor {n}"] = recorder.piece(_factor(square, n))
        found[f"newton {n}"] = recorder.piece(_newton(L, square, n))
        found[f"conclude {n}"] = recorder.piece(_conclude(L, path, square, n))
        after.append(recorder.known)
    recorder.known = {
        row: value for row, value in after[0].items() if all(k.get(row) == value for k in after)
    }
    for name, run in _outputs(L):
        found[name] = recorder.piece(run)
    return found


def _factor(square: Any, n: int) -> Callable[..., dict[str, Any]]:
    def run(W: Any, factors: Any, given: Any) -> dict[str, Any]:
        return {"growth": factor_square(square, W, 0.0, factors[n])}

    return run


def _newton(L: Any, square: Any, n: int) -> Callable[..., dict[str, Any]]:
    def run(W: Any, factors: Any, given: Any) -> dict[str, Any]:
        return {"residual": newton_square(L, square, W, 0.0, factors[n])}

    return run


def _conclude(L: Any, path: Any, square: Any, n: int) -> Callable[..., dict[str, Any]]:
    def run(W: Any, factors: Any, given: Any) -> dict[str, Any]:
        first, residual, growth, failed = (
            given(("newton", name)) for name in ("first", "residual", "growth", "failed")
        )
        newton = first, residual, growth, given(("step", "small")), failed
        way = tuple(given(("step", name)) for name in ("h", "back", "seen", "seen_twice"))
        rates = given(("step", "rate")), given(("step", "acceleration"))
        failed, most = conclude(L, square, W, 0.0, factors[n], path, (way, rates, 0), newton)
        return {"failed": failed, "most": most} if path.pieces else {"failed": failed}

    return run


def _outputs(L: Any) -> list[tuple[str, Callable[..., dict[str, Any]]]]:
    """Outputs of an instant, in groups, each row by its number as `keep` counts them."""
    n3 = 3 * L.bodies

    def motion(W: Any, factors: Any, given: Any) -> dict[str, Any]:
        kept = np.concatenate([array[:n3, 0] for array in (W.q, W.v, W.a)])
        return {str(n): number for n, number in enumerate(kept)}

    def primitive(e: int) -> Callable[..., dict[str, Any]]:
        first = 3 * n3 + PER_PRIMITIVE * e

        def run(W: Any, factors: Any, given: Any) -> dict[str, Any]:
            page = np.empty((PER_PRIMITIVE, 1), dtype=object)
            keep_primitive(L, W, 0.0, e, page, 0)
            return {str(first + n): page[n, 0] for n in range(PER_PRIMITIVE)}

        return run

    count = L.primitive_node.shape[0]
    others = 3 * n3 + PER_PRIMITIVE * count

    def remaining(W: Any, factors: Any, given: Any) -> dict[str, Any]:
        found = {str(others + n): W.own[n, 0] for n in range(L.owns)}
        for n in range(L.input_row.shape[0]):
            found[str(others + L.owns + n)] = W.signal[L.input_row[n], 0]
        return found

    primitives = [(f"primitive {e}", primitive(e)) for e in range(count)]
    return [("motion", motion), *primitives, ("others", remaining)]
