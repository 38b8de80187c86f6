"""A table of two variables: bilinear, or piecewise bicubic by monotone slopes or splines."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import FixedLaw, FloatArray, Law, law_numbers, with_dimension
from mbody.laws.bicubic import surface
from mbody.laws.kernels import OUTSIDE
from mbody.laws.slopes import of_pchip, of_spline
from mbody.laws.table import Outside
from mbody.quantities import FormulaError
from mbody.quantities.deferred import is_pending
from mbody.quantities.types import Converted, NumberRow, required
from mbody.quantities.units import Dimension

__all__ = ["Table2"]

Patches = Literal["linear", "pchip", "spline"]

#: From the values, slopes and twists at the ends of an interval of length one to the coefficients
#: of the cubic through them (Hermite): rows f₀, f₁, f₀′, f₁′.
HERMITE = np.array([[1, 0, -3, 2], [0, 0, 3, -2], [0, 1, -2, 1], [0, 0, -1, 1]], dtype=float)


@dataclass(frozen=True, repr=False)
class Table2(FixedLaw):
    """A function of two variables through the points of a grid, such as the torque of an engine by
    speed and throttle.

    A mechanism has it by name, and formulas call it: ``Mechanism(curves={"engine": Table2(…)})``,
    ``Torque("drive", "crank", value="engine(crank.omega, throttle)")``.

    Parameters
    ----------
    x, y : array_like (m,), (n,)
        Places of the grid, m, n ≥ 2, strictly increasing.
    z : array_like (m, n)
        Values, a row for each x.
    interpolation : {"linear", "pchip", "spline"}
        Between the points: bilinear; bicubic patches with slopes that are monotone along every grid
        line where the points are; or a bicubic spline (not-a-knot) with continuous second
        derivatives. Along a grid line it is the `Table` of the points there.
    outside : {"error", "hold", "line"}
        Outside the grid: no value, that of the nearest edge, or the edge's tangent plane. A margin
        of 1e-9 of the range is always allowed.

    Raises
    ------
    ModelError
        For points that are no grid; later, when evaluated outside the range with "error".

    Notes
    -----
    A patch has 16 coefficients, from values, slopes and twists at its corners; the twist is the
    mean of the slopes along y of the slopes along x and of those along x of those along y, which
    for a spline are alike. Source: de Boor, J. Math. Phys. 41 (1962) 212, bicubic splines; slopes
    as of `Table`.

    >>> table = Table2([0, 1, 2], [0, 1, 2], [[0, 0, 0], [0, 1, 2], [0, 2, 4]])
    >>> table(1.5, 0.5), table.derivatives_at(1.5, 0.5)
    (0.75, (0.75, 0.5, 1.5))
    """

    kind: ClassVar[str] = "surface"

    x: Converted[tuple[float, ...], NumberRow] = required()
    y: Converted[tuple[float, ...], NumberRow] = required()
    z: Converted[tuple[tuple[float, ...], ...], Any] = required()
    interpolation: Patches = "linear"
    outside: Outside = "error"

    def _read_numbers(self) -> None:
        object.__setattr__(self, "x", law_numbers(self.x, "Table2", "x"))
        object.__setattr__(self, "y", law_numbers(self.y, "Table2", "y"))
        try:
            rows: Any = tuple(self.z)
        except TypeError:
            rows = ()
        if not rows or any(isinstance(row, str) or np.ndim(row) == 0 for row in rows):
            raise ModelError("Table2: z must be rows of numbers, one for each x")
        z = tuple(law_numbers(row, "Table2", f"z[{n}]") for n, row in enumerate(rows))
        object.__setattr__(self, "z", z)

    def _check(self) -> None:
        for field, choices in (
            ("interpolation", get_args(Patches)),
            ("outside", get_args(Outside)),
        ):
            if getattr(self, field) not in choices:
                raise ModelError(
                    f"Table2: {field} must be one of {', '.join(choices)}, "
                    f"not {getattr(self, field)!r}"
                )
        for name in "xy":
            places = np.asarray(getattr(self, name))
            if places.size < 2:
                raise ModelError(f"Table2: {name} needs at least 2 places, it has {places.size}")
            bad = np.flatnonzero(np.diff(places) <= 0.0)
            if bad.size:
                i = int(bad[0])
                raise ModelError(
                    f"Table2: {name} must increase from place to place, but {name}[{i + 1}] = "
                    f"{places[i + 1]:g} follows {name}[{i}] = {places[i]:g}: sort the grid"
                )
        if len(self.z) != len(self.x):
            raise ModelError(
                f"Table2: z has {len(self.z)} rows and x has {len(self.x)} places: give a row of z "
                "for each x"
            )
        for n, row in enumerate(self.z):
            if len(row) != len(self.y):
                raise ModelError(
                    f"Table2: z[{n}] has {len(row)} numbers and y has {len(self.y)} places: give a "
                    "number for each y"
                )

    def __repr__(self) -> str:
        size = f"{len(self.x)} × {len(self.y)} points"
        return f"Table2(<{size}>, interpolation={self.interpolation!r}, outside={self.outside!r})"

    def dimensioned(self, value: Dimension, argument: Dimension) -> Law:
        """It has two variables: an element's law cannot be one.

        Raises
        ------
        FormulaError
            Always.
        """
        raise FormulaError(
            "a Table2 has two variables: give it to the mechanism as one of its curves and call it "
            "in a formula, as in value = 'engine(crank.omega, throttle)'"
        )

    def of_dimensions(self, value: Dimension, x: Dimension, y: Dimension) -> Table2:
        """The same table with the units of its text checked.

        Raises
        ------
        FormulaError
            For a unit that does not fit.
        """
        wanted = {"x": x, "y": y, "z": value}
        pending = {name: of for name, of in wanted.items() if is_pending(getattr(self, name))}
        changed: Any = {n: with_dimension(getattr(self, n), of, n) for n, of in pending.items()}
        return replace(self, **changed)

    def table(self) -> FloatArray:
        """As `mbody.laws.bicubic.surface` reads it."""
        return self._table

    @cached_property
    def _table(self) -> FloatArray:
        x, y = np.asarray(self.x), np.asarray(self.y)
        patches = self._patches(x, y, np.asarray(self.z))
        head = [x.size, y.size, OUTSIDE.index(self.outside)]
        return np.concatenate([head, x, y, patches.ravel()])

    def _patches(self, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        """Coefficients (m − 1, n − 1, 4, 4) of uⁱ vʲ."""
        hx, hy = np.diff(x)[:, None], np.diff(y)[None, :]
        found = np.zeros((x.size - 1, y.size - 1, 4, 4))
        if self.interpolation == "linear":
            corner, along_x = z[:-1, :-1], (z[1:, :-1] - z[:-1, :-1]) / hx
            along_y = (z[:-1, 1:] - z[:-1, :-1]) / hy
            twist = (z[1:, 1:] - z[1:, :-1] - z[:-1, 1:] + z[:-1, :-1]) / (hx * hy)
            found[..., 0, 0], found[..., 1, 0] = corner, along_x
            found[..., 0, 1], found[..., 1, 1] = along_y, twist
            return found
        zx, zy = self._slopes(x, z.T).T, self._slopes(y, z)
        zxy = 0.5 * (self._slopes(y, zx) + self._slopes(x, zy.T).T)
        # at each corner f, f_u, f_v, f_uv of the unit square, (…, ends and slopes along x, along y)
        data = np.empty((*found.shape[:2], 4, 4))
        lower, upper = slice(None, -1), slice(1, None)
        for a, i in enumerate((lower, upper)):
            for b, j in enumerate((lower, upper)):
                data[..., a, b] = z[i, j]
                data[..., 2 + a, b] = zx[i, j] * hx
                data[..., a, 2 + b] = zy[i, j] * hy
                data[..., 2 + a, 2 + b] = zxy[i, j] * hx * hy
        power = np.arange(4)
        unit = HERMITE.T @ data @ HERMITE
        scale = hx[..., None, None] ** power[:, None] * hy[..., None, None] ** power
        return np.asarray(unit / scale)

    def _slopes(self, places: FloatArray, rows: FloatArray) -> FloatArray:
        """Slopes of each row at the places."""
        h = np.diff(places)
        chords = np.diff(rows, axis=1) / h
        if self.interpolation == "pchip":
            return np.array([of_pchip(h, chord, False) for chord in chords])
        return np.array([of_spline(h, chord, "not-a-knot") for chord in chords])

    def __call__(self, x: Any, y: Any) -> Any:  # type: ignore[override]
        """The value at (x, y), numbers or arrays; errors as `derivatives_at`."""
        return self.derivatives_at(x, y)[0]

    def derivatives_at(self, x: Any, y: Any) -> tuple[Any, Any, Any]:
        """(f, ∂f/∂x, ∂f/∂y) at (x, y), each a float or an array.

        Raises
        ------
        ModelError
            Outside the grid with outside = "error", and for a table with text, which has a value
            only in a mechanism.
        """
        if self.pending:
            raise ModelError(
                "Table2: its numbers are text, which has a value only in a mechanism: give it to "
                "one as a curve"
            )
        whole = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        rows = [one.reshape(-1) for one in whole]
        found = self.raw(*rows)
        bad = np.isnan(found[:, 0])
        if bad.any():
            raise ModelError(
                f"Table2: the table covers x from {self.x[0]:g} to {self.x[-1]:g} and y from "
                f"{self.y[0]:g} to {self.y[-1]:g}, but ({rows[0][bad][0]:g}, {rows[1][bad][0]:g}) "
                'was requested: add points, or choose outside="hold" or "line"'
            )
        f, fx, fy = (column.reshape(whole[0].shape) for column in found.T)
        return (f, fx, fy) if f.shape else (float(f), float(fx), float(fy))

    def raw(self, xs: FloatArray, ys: FloatArray | None = None) -> FloatArray:
        """f, ∂f/∂x, ∂f/∂y, (N, 3), at places (N,); NaN where it has no value."""
        assert ys is not None
        table = self.table()
        found = [surface(table, 0, float(x), float(y)) for x, y in zip(xs, ys, strict=True)]
        return np.array(found, dtype=float).reshape(-1, 3)
