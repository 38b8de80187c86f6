"""Counterweights on links: what they add to the momentum and to the inertia forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.model.body import Body, SecondMoments, SlenderRod
from mbody.model.changed_elements import with_changed
from mbody.model.element import Marker
from mbody.model.mechanism import Mechanism
from mbody.solution.histories import PointHistory
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = [
    "Counterweight",
    "best_moments",
    "counterweight_columns",
    "link_columns",
    "link_moments",
    "weights_of_instants",
    "with_counterweights",
]

Array = np.ndarray

#: A singular value below this part of the greatest is rounding: positions are closed to 1e-13.
SINGULAR = 1e-9
#: Passes of Newton's method for the masses of the counterweights, which are not linear.
PASSES = 200
#: A change of the moments below this part of them ends the passes.
STILL = 1e-15


@dataclass(frozen=True)
class Counterweight:
    """A point mass on a link.

    Attributes
    ----------
    body : str
    at : str
        From where its radius counts, such as ``"crank"`` (the link's origin) or ``"crank.O2"``.
    radius : float
        [length]
    angle : float
        Its direction from there in link axes [rad].
    mass : float
        [mass]
    x, y : float
        Its place in link axes [length].
    moment : float
        First moment of mass, mass × radius [mass·length].
    """

    body: str
    at: str
    radius: float
    angle: float
    mass: float
    x: float
    y: float
    moment: float


# -- what is linear in masses and first moments --------------------------------------------------


def link_columns(run: Solution, of: str) -> Array:
    """Momentum ("v") or inertia force with opposite sign ("a") of links by m, m x, m y about their
    origins: (2 instants, 3 bodies).
    """
    columns = []
    for body in run.mechanism.bodies:
        columns += _columns(run, body.name, run.point(Marker(body.name, (0.0, 0.0))), of)
    return np.array(columns).T


def counterweight_columns(run: Solution, places: Sequence[Marker], of: str) -> Array:
    """The same of point masses by their m, m x, m y about places, in link axes."""
    columns = []
    for place in places:
        columns += _columns(run, place.body, run.point(place), of)
    return np.array(columns).T


def _columns(run: Solution, body: str, place: PointHistory, of: str) -> list[Array]:
    history = run[body]
    c, s, w = np.cos(history.angle), np.sin(history.angle), history.omega
    if of == "v":
        along, across, x, y = np.zeros_like(w), w, place.vx, place.vy
    else:
        # ë = α k × e − ω² e of a unit vector e of the link
        along, across, x, y = -w * w, history.alpha, place.ax, place.ay
    by_x = along * c - across * s, along * s + across * c
    by_y = -along * s - across * c, along * c - across * s
    return [np.concatenate(pair) for pair in ((x, y), by_x, by_y)]


def weights_of_instants(blocks: int, instants: int) -> Array:
    """Roots of the weights of rows of columns: the first and the last instant, which are one
    position of a turn, count half.
    """
    weights = np.ones(instants)
    weights[[0, -1]] = np.sqrt(0.5)
    return np.tile(weights, 2 * blocks)


def link_moments(system: System) -> Array:
    """m, m x, m y of every link about its origin, in link axes: (3 bodies,)."""
    found: list[float] = []
    for body in system.mechanism.bodies:
        mass = float(system.mass[3 * system.bodies[body.name], 0])
        x, y = (float(part) for part in system.numbers.point(f"{body.name}.cg"))
        found += [mass, mass * x, mass * y]
    return np.array(found)


# -- the best counterweights ---------------------------------------------------------------------


def best_moments(columns: Array, present: Array, radii: Array) -> Array:
    """First moments (counterweights, 2) with the least sum of squares of what is left.

    Minimises |present + Σ (v |s|/r + U s)| over the moments s of all counterweights, of mass |s|/r;
    where several are as good, those of least masses.

    Parameters
    ----------
    columns : array (rows, 3 counterweights)
        v, then the two columns of U, of each.
    present : array (rows,)
        What the links have.
    radii : array (counterweights,)

    Notes
    -----
    The equations are linear but for |s|, which counts only where the place moves: Newton's method
    on them, each pass a linear problem of least squares; from what it finds, where something is
    left, the method of Gauss and Newton with trust region goes on to the least.
    """
    # as many rows as there are unknowns have the same sums of squares
    small = np.asarray(np.linalg.qr(np.column_stack([columns, present]), mode="r"))
    v, ux, uy = (small[:, k:-1:3] for k in range(3))
    rest = small[:, -1]
    count = len(radii)

    def left(z: Array) -> Array:
        """z: moments by radius, that is masses with a direction, (counterweights, 2) in a row."""
        x, y = z.reshape(count, 2).T
        return np.asarray(rest + v @ np.hypot(x, y) + ux @ (radii * x) + uy @ (radii * y))

    def jacobian(z: Array) -> Array:
        x, y = z.reshape(count, 2).T
        size = np.hypot(x, y)
        size = np.where(size > 0.0, size, 1.0)
        parts = v * (x / size) + ux * radii, v * (y / size) + uy * radii
        return np.stack(parts, axis=-1).reshape(len(rest), 2 * count)

    z = np.zeros(2 * count)
    for _ in range(PASSES):
        slopes = jacobian(z)
        new = np.linalg.lstsq(slopes, slopes @ z - left(z), rcond=SINGULAR)[0]
        done = np.abs(new - z).max(initial=0.0) <= STILL * np.abs(new).max(initial=0.0)
        z = new
        if done:
            break
    if np.abs(left(z)).max(initial=0.0) > SINGULAR * np.abs(rest).max(initial=0.0):
        z = _least(left, jacobian, z, float(np.linalg.norm(rest)))
    return z.reshape(count, 2) * radii[:, None]


def _least(left: Any, jacobian: Any, start: Array, scale: float) -> Array:
    """The least sum of squares from two starts: what Newton's method found, and none at all."""
    from scipy.optimize import least_squares

    found = [
        least_squares(
            lambda z: left(z) / scale,
            begin,
            lambda z: jacobian(z) / scale,
            x_scale="jac",
            **{"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15},
        )
        for begin in (start, np.zeros_like(start))
    ]
    return np.asarray(min(found, key=lambda one: one.cost).x)


# -- a mechanism that has them -------------------------------------------------------------------


def with_counterweights(
    machine: Mechanism, system: System, weights: Mapping[str, Sequence[Counterweight]]
) -> Mechanism:
    """The mechanism with counterweights (by body) as parts of its links; masses, mass centres and
    inertias of these are numbers then and follow no formulas.
    """
    bodies = [_loaded(machine, system, name, own) for name, own in weights.items()]
    return with_changed(machine, bodies, ("mass", "weight", "inertia", "cg.", "spread."))


def _loaded(
    machine: Mechanism, system: System, name: str, weights: Sequence[Counterweight]
) -> Body:
    """A link with point masses: mass, mass centre, and inertia by the parallel axis theorem."""
    body: Any = machine[name]
    first = 3 * system.bodies[name]
    mass, _, inertia = (float(part) for part in system.mass[first : first + 3, 0])
    own = tuple(float(part) for part in system.numbers.point(f"{name}.cg"))
    parts = np.array([(mass, *own), *((one.mass, one.x, one.y) for one in weights)])
    total = parts[:, 0].sum()
    cg = parts[:, 0] @ parts[:, 1:] / total
    away = parts[:, 1:] - cg
    xx, yy = parts[:, 0] @ away**2
    xy = parts[:, 0] @ (away[:, 0] * away[:, 1])
    changes: dict[str, Any] = {"cg": (float(cg[0]), float(cg[1]))}
    changes["inertia"] = inertia + float(xx + yy)
    heavy = {"mass": float(total)}
    if body.weight is not None:
        heavy = {"weight": float(total) * machine.g}
    spread = body.spread
    if spread is not None:
        px, py, pxy = _spread(spread, inertia)
        moments = px + float(xx), py + float(yy), pxy + float(xy)
        changes["spread"] = SecondMoments(*moments)
    return replace(body, **heavy, **changes)


def _spread(spread: str | SlenderRod | SecondMoments, inertia: float) -> tuple[Any, Any, Any]:
    """∫x² dm, ∫y² dm, ∫xy dm about the mass centre."""
    if isinstance(spread, SecondMoments):
        return spread.xx, spread.yy, spread.xy
    if isinstance(spread, SlenderRod):
        c, s = np.cos(spread.angle), np.sin(spread.angle)
        return inertia * c * c, inertia * s * s, inertia * c * s
    return 0.0, 0.0, 0.0
