"""Smooth contours of named curves, as the kernels of `mbody.laws.contour` take them."""

from __future__ import annotations

# mypy: disallow-untyped-calls=False
import functools
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mbody.core.bundle import Floats, Rows
from mbody.core.decorators import kernel
from mbody.core.tolerances import DISTANCE_TIE, POINT_SAME, POSITION_SAME
from mbody.errors import ModelError
from mbody.laws.base import FixedLaw
from mbody.laws.contour import NODE, NODES, WEIGHTS, foot, piece_at
from mbody.laws.table import Table

Array = np.ndarray

#: By how much a piece turns, at most [rad]; at how many places that is looked at.
TURN, LOOKED_AT = 0.25, 17


@kernel
def feet(tab: Floats, places: Rows, found: Rows) -> None:
    """What `foot` says of places (n, 2): found (n, 4)."""
    for n in range(places.shape[0]):
        a, b, c, d, _ = foot(tab, 0, places[n, 0], places[n, 1], -1)
        found[n, 0], found[n, 1], found[n, 2], found[n, 3] = a, b, c, d


@dataclass(frozen=True, eq=False, repr=False)
class Contour(FixedLaw):
    """A contour as the kernels take it: its pieces are rows of `PIECE` numbers."""

    kind: ClassVar[str] = "spline"  # of which the kernels take the table

    pieces: Array
    closed: bool

    def table(self) -> Array:
        """Head, pieces, tree: of every node the beginning, direction and length of the chord of its
        pieces, and how far these go from it.
        """
        return self._table

    @functools.cached_property
    def _table(self) -> Array:
        count = len(self.pieces)
        leaves = 1 << (count - 1).bit_length()
        head = [count, leaves, self.length, float(self.closed)]
        control = self._control()
        last = np.broadcast_to(control[-1, -1], (leaves - count, 4, 2))
        control = np.concatenate([control, last])
        levels = [np.zeros((1, NODE))]
        for nodes in (1 << n for n in range(leaves.bit_length())):
            own = control.reshape(nodes, -1, 2)
            chord = own[:, -1] - own[:, 0]
            size = np.hypot(*chord.T)
            u = chord / np.where(size > 0.0, size, 1.0)[:, None]
            off = own - own[:, :1]
            part = np.clip((off * u[:, None]).sum(axis=2), 0.0, size[:, None])
            far = np.hypot(*(off - part[:, :, None] * u[:, None]).transpose(2, 0, 1)).max(axis=1)
            # of rounding: no piece is farther than it seems
            far += DISTANCE_TIE * np.abs(own).max(axis=(1, 2))
            far[np.arange(nodes) * (leaves // nodes) >= count] = -np.inf
            levels.append(np.column_stack([own[:, 0], u, size, far]))
        return np.concatenate([head, self.pieces.ravel(), np.concatenate(levels).ravel()])

    def _control(self) -> Array:
        """Bézier's points of the pieces, within whose hull each is, (pieces, 4, 2)."""
        h = self.pieces[:, 8]
        found = []
        for o in (0, 4):
            a, b, c, d = (self.pieces[:, o + n] * h**n for n in range(4))
            found.append([a, a + b / 3.0, a + (2.0 * b + c) / 3.0, a + b + c + d])
        return np.array(found).transpose(2, 1, 0)

    @functools.cached_property
    def length(self) -> float:
        """Of the whole contour."""
        last = self.pieces[-1:]
        return float(last[0, 9] + _lengths(last)[0])

    def places(self, parts: int = 1) -> tuple[Array, Array]:
        """Places along it and its directions there, (n, 2): `parts` of every piece, and the end."""
        p = np.repeat(self.pieces, parts, axis=0)
        w = p[:, 8] * np.tile(np.arange(parts) / parts, len(self.pieces))
        p, w = np.vstack([p, p[-1:]]), np.append(w, p[-1, 8])
        x, y, dx, dy, _, _ = piece_at(p.T, 0, w)
        size = np.hypot(dx, dy)
        return np.column_stack([x, y]), np.column_stack([dx / size, dy / size])

    def feet(self, places: Any) -> Array:
        """What `foot` says of places (…, 2): (…, 4)."""
        given = np.ascontiguousarray(places, dtype=float)
        found = np.empty((given.size // 2, 4))
        feet(self.table(), given.reshape(-1, 2), found)
        return found.reshape(*given.shape[:-1], 4)

    def widest(self, radius: float) -> tuple[float, Array]:
        """The radius, or that of the greatest circle that touches every place of the contour and no
        other one where it is less; and where it touches.
        """
        at, t = self.places(2)
        n = np.column_stack([-t[:, 1], t[:, 0]])
        radii = np.full(len(at), radius)
        todo = np.arange(len(at))
        while todo.size:
            centre = at[todo] + radii[todo, None] * n[todo]
            D, _, phi, _ = self.feet(centre).T
            todo, centre, D, phi = _of(radii[todo] * (1.0 - POINT_SAME) > D, todo, centre, D, phi)
            d = centre - D[:, None] * np.column_stack([-np.sin(phi), np.cos(phi)]) - at[todo]
            ahead = 2.0 * (d * n[todo]).sum(axis=1)
            less = (d * d).sum(axis=1) / np.where(ahead > 0.0, ahead, np.inf)
            todo, less = _of(less < radii[todo] * (1.0 - POINT_SAME), todo, less)
            radii[todo] = less
        least = int(np.argmin(radii))
        return float(radii[least]), at[least]

    def end(self, last: bool) -> tuple[float, float]:
        """Where it ends, or begins."""
        x, y = self.places()[0][-1 if last else 0].tolist()
        return x, y

    def rolled(self, dx: Any, dy: Any, turned: Any, wheel: Any, radius: Any) -> Any:
        """How far a wheel has rolled along it, s − r φ + r (θ_j − θ_i), whose centre is (dx, dy)
        from its point.

        Raises ModelError for a closed contour.
        """
        if self.closed:
            raise ModelError(
                "a wheel that rolls without slip on a closed curve is followed by simulate alone: "
                "where it is does not say how often it went round"
            )
        c, s = np.cos(turned), np.sin(turned)
        place = np.broadcast_arrays(c * dx + s * dy, c * dy - s * dx)
        _, length, angle, _ = np.moveaxis(self.feet(np.stack(place, axis=-1)), -1, 0)
        return length - radius * angle + radius * (wheel - turned)

    def refuse_wide(self, contact: str, disc: str, curve: str, radii: Any, unit: str) -> None:
        """Refuse discs that would touch it at two places."""
        for radius in np.unique(np.ravel(radii)):
            least, (x, y) = self.widest(float(radius))
            if least < radius:
                raise ModelError(
                    f"'{contact}': the disc '{disc}' of radius {radius:g} {unit} would touch "
                    f"'{curve}' at two places: the curve lets a radius of up to {least:.4g} "
                    f"{unit} by, at ({x:.6g}, {y:.6g}) {unit} from its point; give a smaller "
                    "disc, or a curve with wider hollows",
                    contact,
                )


def _of(which: Array, *arrays: Array) -> tuple[Array, ...]:
    return tuple(array[which] for array in arrays)


def _lengths(pieces: Array) -> Array:
    """Lengths of pieces (n, 9 or more)."""
    found = np.zeros(len(pieces))
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        _, _, dx, dy, _, _ = piece_at(pieces.T, 0, node * pieces[:, 8])
        found += weight * pieces[:, 8] * np.hypot(dx, dy)
    return found


@functools.lru_cache(maxsize=16)
def contour_of(names: tuple[str, ...], laws: tuple[Any, ...]) -> Contour:
    """The contour of one named curve y(x), or of two, x and y of one number that both are of.

    Raises ModelError for curves that make no smooth contour.
    """
    named = " and ".join(f"'{name}'" for name in names)
    for name, law in zip(names, laws, strict=True):
        if not isinstance(law, Table) or law.interpolation not in (None, "spline"):
            raise ModelError(
                f"the curve '{name}' is no smooth contour: give a table with interpolation = "
                '"spline"',
                name,
            )
    closed = {law.periodic for law in laws}
    if len(laws) == 1 and True in closed:
        raise ModelError(
            f"the curve '{names[0]}' is periodic, a contour of one curve has two ends: give as "
            "many periods as there are, or x and y as two curves of a closed one",
            names[0],
        )
    if len(closed) == 2 or len({law.x for law in laws}) == 2:
        raise ModelError(
            f"the curves {named} make no contour: give x and y at the same numbers, both periodic "
            "where it is closed",
            names[0],
        )
    y = _cubics(laws[-1])
    x = _cubics(laws[0])
    knots = np.asarray(laws[0].x)
    if len(laws) == 1:
        x = np.zeros_like(y)
        x[:, 0], x[:, 1] = knots[:-1], 1.0
    pieces = _divided(np.column_stack([x, y, np.diff(knots)]))
    speed = np.hypot(*piece_at(pieces.T, 0, 0.5 * pieces[:, 8])[2:4])
    at_rest = np.hypot(pieces[:, 1], pieces[:, 5])
    if not min(speed.min(), at_rest.min()) > POSITION_SAME * speed.max():
        raise ModelError(
            f"the contour of {named} stands still at a point, or has a cusp: give points that "
            "follow each other along it",
            names[0],
        )
    x, y, _, _, _, _ = piece_at(pieces[-1], 0, pieces[-1, 8])
    lengths = _lengths(pieces)
    if True not in closed and math.hypot(x - pieces[0, 0], y - pieces[0, 4]) < (
        POINT_SAME * lengths.sum()
    ):
        raise ModelError(
            f"the contour of {named} ends where it begins: give both tables periodic = true",
            names[0],
        )
    _, _, dx, dy, _, _ = piece_at(pieces.T, 0, pieces[:, 8])
    bx, by = pieces[:, 1], pieces[:, 5]
    turns = np.arctan2(bx * dy - by * dx, bx * dx + by * dy)
    begin = np.append(0.0, np.cumsum(lengths)[:-1])
    angle = math.atan2(by[0], bx[0]) + np.append(0.0, np.cumsum(turns)[:-1])
    made = np.column_stack([pieces, begin, angle])
    return Contour(made, True in closed)


def _cubics(law: Table) -> Array:
    """Coefficients of the pieces of a spline, (pieces, 4)."""
    count = len(law.x)
    return law.table()[2 + count :].reshape(-1, 4)


def _divided(pieces: Array) -> Array:
    """Pieces that turn by no more than `TURN`."""
    w = np.linspace(0.0, 1.0, LOOKED_AT)[:, None] * pieces[:, 8]
    _, _, dx, dy, _, _ = piece_at(pieces.T, 0, w)
    turn = np.arctan2(dx[:-1] * dy[1:] - dy[:-1] * dx[1:], dx[:-1] * dx[1:] + dy[:-1] * dy[1:])
    parts = np.maximum(np.ceil(np.abs(turn).sum(axis=0) / TURN), 1.0).astype(int)
    p = np.repeat(pieces, parts, axis=0)
    h = np.repeat(pieces[:, 8] / parts, parts)
    w = h * np.concatenate([np.arange(n) for n in parts])
    x, y, dx, dy, ddx, ddy = piece_at(p.T, 0, w)
    return np.column_stack([x, dx, 0.5 * ddx, p[:, 3], y, dy, 0.5 * ddy, p[:, 7], h])
