"""Balances of a solution: its momentum, and the equations of its forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from mbody.core.presentation import Presented
from mbody.errors import ModelError
from mbody.model.element import Marker
from mbody.solution.histories import Result
from mbody.system.read_only import Locked

Array = np.ndarray
#: A place: a point by name, or x and y in world axes.
PlaceLike: TypeAlias = "Marker | str | Sequence[float] | np.ndarray[Any, Any]"


@dataclass(frozen=True, eq=False)
class Momentum(Locked):
    """Momentum of a motion: arrays (instants,), of a batch with a first axis of designs.

    `x`, `y`: Of all bodies together, Σ m v, world axes [force·time].
    `angular`: About the place, counter-clockwise [force·length·time].
    `mass`: Of all bodies.
    `centre`: Mass centre of all bodies; nan where none has mass.
    """

    x: Array
    y: Array
    angular: Array
    mass: Any
    centre: tuple[Array, Array]


def momentum(run: Result, about: PlaceLike = (0.0, 0.0)) -> Momentum:
    """Linear and angular momentum of all bodies of a solution (impulse, moment of momentum).

    p = Σ m v,  L = Σ [(r_G − o) × m v + I ω]

    Parameters
    ----------
    run : Result
        Of an analysis that finds velocities.
    about : (x, y), Marker or str, optional
        The place o that the angular momentum is about: one at rest, by default the
        origin; or a place on a body, such as ``"crank.A"``, where it is at each instant.

    Returns
    -------
    Momentum
        `x`, `y`, `angular`, and the `mass` and `centre` of all bodies.

    Raises
    ------
    ModelError
        For a place that is none.

    Notes
    -----
    About a place that moves, velocities are still those of the world. The ground does not count.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0))
    >>> of_all = momentum(run)
    >>> x, y = of_all.centre
    >>> moved = momentum(run, about=(2.0, 0.0)).angular - of_all.angular
    >>> bool(abs(moved + 2.0 * of_all.y).max() < 1e-12)
    True
    """
    ox, oy = _reference_point(run, about)
    mass = run.system.mass[: run.system.coordinates]
    zero = np.zeros_like(run.record.take(0))
    x, y, angular, mx, my = (zero.copy() for _ in range(5))
    whole: Any = 0.0
    for name in run:
        body, b = run[name], run.system.bodies[name]
        own = mass[3 * b : 3 * b + 3]
        m, _, inertia = own[:, :, None] if run.system.batch is not None else own[:, 0]
        x += m * body.vx
        y += m * body.vy
        angular += m * ((body.x - ox) * body.vy - (body.y - oy) * body.vx) + inertia * body.omega
        mx += m * body.x
        my += m * body.y
        whole = whole + m
    with np.errstate(invalid="ignore"):
        centre = mx / whole, my / whole
    return Momentum(x, y, angular, whole, centre)


def _reference_point(run: Result, about: PlaceLike) -> tuple[Any, Any]:
    """Coordinates of the place: numbers, or arrays over the instants."""
    if isinstance(about, str | Marker):
        at = run.point(about)
        return at.x, at.y
    try:
        x, y = (float(part) for part in about)
    except (TypeError, ValueError):
        x = y = np.nan
    if not np.isfinite([x, y]).all():
        raise ModelError(f'about must be a place, such as (0.0, 0.0) or "crank.A", not {about!r}')
    return x, y


# -- The system of force equations of one instant, as arrays: Newton and Euler of every link ---


@dataclass(frozen=True, eq=False)
class Equations(Locked, Presented):
    """matrix · unknowns = right-hand side: Newton's and Euler's equations of every moving link.

    A row is Σ of what joints and drivers exert = m a − loads, moments about the mass centre. A
    column is what a unit of its unknown exerts on all links. ``print(run.equations())`` shows them.

    `rows`, `row_units`: ΣFx, ΣFy and ΣM of the links in the order of the description, and their
      units.
    `unknowns`, `units`, `meanings`: Names of the unknowns in the order of joints, couplings,
      drivers; their units; what each is.
    `matrix` (rows, unknowns): Square where constraints determine the motion and none is redundant.
    `rhs` (rows,): m a_Gx, m a_Gy and I_G α less what the loads exert.
    `values` (unknowns,): The solution: reactions and efforts.
    `rank`: Independent columns; where it is less than their number, values are not unique.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10))
    >>> system = run.equations()
    >>> system.unknowns
    ('F12x', 'F12y', 'F32x', 'F32y', 'F43x', 'F43y', 'F14x', 'F14y', 'T12')
    >>> bool(np.allclose(np.linalg.solve(system.matrix, system.rhs), system.values))
    True
    """

    rows: tuple[str, ...]
    row_units: tuple[str, ...]
    unknowns: tuple[str, ...]
    units: tuple[str, ...]
    meanings: tuple[str, ...]
    matrix: Array
    rhs: Array
    values: Array
    rank: int
    heading: tuple[str, ...] = field(repr=False)

    declared = ("rows", "row_units", "unknowns", "units", "matrix", "rhs", "values")

    @property
    def residual(self) -> Array:
        """matrix · values − rhs, (rows,)."""
        return self.matrix @ self.values - self.rhs
