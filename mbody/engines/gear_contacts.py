"""Constraints of gears, racks, wheels, cams and couplings, checked by the motion of their bodies.

The constraints are differentiated by hand: the rate and the acceleration of each must vanish for
the histories of a result and the numbers of the description. Δ goes from the place on i to that on
j.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.engines.independent_reading import law_by_formula, reading
from mbody.model.element import Marker
from mbody.model.joints import CamFollower, Gear, RackPinion, Rolling
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["MESHING", "Rates", "constraint_rates"]

Array = np.ndarray
#: First and second derivative, arrays (instants,), and the sizes of their terms.
Rates = tuple[Array, Array, Array, Array]

#: Joints whose constraint rates are computed here.
MESHING = (Gear, RackPinion, Rolling, CamFollower)


def constraint_rates(system: System, run: Solution, element: Any) -> list[Rates]:
    """Rate and acceleration of every constraint row of a joint of `MESHING` or a coupling.

    >>> import mbody
    >>> made = mbody.gallery.load("planetary_train")
    >>> run = mbody.kinetostatics(made)
    >>> rows = constraint_rates(run.system, run, made.joints[-1])
    >>> bool(abs(rows[0][0]) <= 1e-12 * rows[0][2])
    True
    """
    if isinstance(element, MESHING):
        return _of_joint(_Pair(system, run, element, element.i, element.j), element)
    parts = [_of_term(system, run, element, n) for n in range(len(element.parts))]
    first, second, size, sizes = (sum(some) for some in zip(*parts, strict=True))
    return [(first, second, size, sizes)]


class _Pair:
    """Two places in the world: Δ and its derivatives, and the rotation of both bodies."""

    def __init__(self, system: System, run: Solution, element: Any, i: Marker, j: Marker) -> None:
        self.run, self.at, self.element = run, reading(system), element
        self.angle_i, self.w_i, self.a_i = self.turning(i.body)
        self.angle_j, self.w_j, self.a_j = self.turning(j.body)
        near, far = self.place("i", i), self.place("j", j)
        self.d, self.v, self.a = (b - a for a, b in zip(near, far, strict=True))

    def turning(self, body: str) -> tuple[Array, Array, Array]:
        one = self.run[body]
        return one.angle, one.omega, one.alpha

    def place(self, side: str, marker: Marker) -> tuple[Array, Array, Array]:
        """Place, velocity, acceleration (2, instants)."""
        one = self.run[marker.body]
        x, y = self._arm(side)
        c, s = np.cos(one.angle), np.sin(one.angle)
        r = np.array([c * x - s * y, s * x + c * y])
        across = np.array([-r[1], r[0]])
        return (
            np.array([one.x, one.y]) + r,
            np.array([one.vx, one.vy]) + one.omega * across,
            np.array([one.ax, one.ay]) + one.alpha * across - one.omega**2 * r,
        )

    def _arm(self, side: str) -> tuple[float, float]:
        return self.at.arm(self.element, side)

    def beta(self, side: str) -> float:
        """Direction of a marker on its body."""
        return self.at.angle(self.element, side)

    def along(self, angle: Array, w: Array, alpha: Array) -> tuple[Array, Array, Array, Array]:
        """Derivatives of u·Δ, where u turns at the rate w, and the sizes of the terms."""
        u = np.array([np.cos(angle), np.sin(angle)])
        t = np.array([-u[1], u[0]])
        ud, uv, ua = (_dot(u, part) for part in (self.d, self.v, self.a))
        td, tv = _dot(t, self.d), _dot(t, self.v)
        first, second = uv + w * td, ua + 2.0 * w * tv + alpha * td - w * w * ud
        size = np.hypot(*self.v) + np.abs(w) * np.hypot(*self.d)
        sizes = np.hypot(*self.a) + 2.0 * np.abs(w) * np.hypot(*self.v)
        return first, second, size, sizes + (np.abs(alpha) + w * w) * np.hypot(*self.d)

    def apart(self) -> Rates:
        """Derivatives of |Δ|."""
        length = np.hypot(*self.d)
        e = self.d / length
        first = _dot(e, self.v)
        second = _dot(e, self.a) + (_dot(self.v, self.v) - first * first) / length
        return first, second, np.hypot(*self.v), np.hypot(*self.a) + _dot(self.v, self.v) / length

    def polar(self) -> tuple[Array, Array]:
        """Derivatives of the direction of Δ."""
        square = _dot(self.d, self.d)
        turned = self.d[0] * self.v[1] - self.d[1] * self.v[0]
        more = self.d[0] * self.a[1] - self.d[1] * self.a[0]
        return turned / square, more / square - 2.0 * _dot(self.d, self.v) * turned / square**2


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=0))


def _of_joint(pair: _Pair, joint: Any) -> list[Rates]:
    w, alpha = pair.w_j - pair.w_i, pair.a_j - pair.a_i
    number = pair.at.values
    if isinstance(joint, CamFollower):
        return [_cam(pair, joint)]
    if isinstance(joint, Gear) or joint.__dict__.get("on_radius") is not None:
        keys = ("radius_i", "radius_j") if isinstance(joint, Gear) else ("on_radius", "radius")
        ri, rj = (float(number[f"{joint.name}.{key}"]) for key in keys)
        if joint.internal:  # internal gear: the contact is on the other side of its centre
            ri, rj = (ri, -rj) if ri > rj else (-ri, rj)
        # rolling: the line of centres turns by R ψ = r_i θ_i + r_j θ_j
        first, second = pair.polar()
        whole = ri + rj
        rolled = whole * first - ri * pair.w_i - rj * pair.w_j
        change = whole * second - ri * pair.a_i - rj * pair.a_j
        size = np.abs(ri * pair.w_i) + np.abs(rj * pair.w_j)
        sizes = np.abs(ri * pair.a_i) + np.abs(rj * pair.a_j) + size * size / abs(whole)
        rows = [(rolled, change, size, sizes)]
        return rows if isinstance(joint, Gear) else [pair.apart(), *rows]
    radius = float(number[f"{joint.name}.radius"])
    line = pair.angle_i + pair.beta("i")
    first, second, size, sizes = pair.along(line, pair.w_i, pair.a_i)
    sizes = sizes + radius * (np.abs(alpha) + w * w)
    rows = [(first + radius * w, second + radius * alpha, size + radius * np.abs(w), sizes)]
    if isinstance(joint, Rolling):
        rows.append(pair.along(line + 0.5 * math.pi, pair.w_i, pair.a_i))
    return rows


def _cam(pair: _Pair, joint: CamFollower) -> Rates:
    """|Δ| or n·Δ, less the profile at its angle."""
    sense = 1.0 if joint.clockwise else -1.0
    profile = law_by_formula(joint.profile)
    if joint.flat:
        face = pair.angle_j + pair.beta("j") + 0.5 * math.pi
        rates = pair.along(face, pair.w_j, pair.a_j)
        angle = face
        turned, more = pair.w_j - pair.w_i, pair.a_j - pair.a_i
    else:
        rates = pair.apart()
        angle = np.arctan2(pair.d[1], pair.d[0])
        turned, more = pair.polar()
        turned, more = turned - pair.w_i, more - pair.a_i
    place = (sense * (angle - pair.angle_i - pair.beta("i"))) % (2.0 * math.pi)
    table = np.array([profile.derivatives(float(x)) for x in place])
    f1, f2 = sense * table[:, 1], table[:, 2]
    first, second, size, sizes = rates
    lift, change = f1 * turned, f2 * turned**2 + f1 * more
    sizes = sizes + np.abs(f2 * turned**2) + np.abs(f1 * more)
    return first - lift, second - change, size + np.abs(lift), sizes


def _of_term(system: System, run: Solution, coupling: Any, n: int) -> Rates:
    """Derivatives of one term of a coupling, times its factor."""
    term = coupling.parts[n]
    factor = float(reading(system)[f"{coupling.name}.{n}.factor"])
    if term.angle is not None:
        one, base = run[term.angle], run[term.relative_to]
        w, alpha = one.omega - base.omega, one.alpha - base.alpha
        # at uniform rotation the accelerations are rounding, compared with ω²
        rates: Rates = w, alpha, np.abs(w), np.abs(alpha) + w * w
    else:
        pair = _TermPair(system, run, coupling, n)
        if term.distance is not None:
            rates = pair.apart()
        else:
            line = pair.angle_i + pair.beta("i")
            rates = pair.along(line, pair.w_i, pair.a_i)
    first, second, size, sizes = rates
    return factor * first, factor * second, abs(factor) * size, abs(factor) * sizes


class _TermPair(_Pair):
    """The two places of a term of a coupling."""

    def __init__(self, system: System, run: Solution, coupling: Any, n: int) -> None:
        self.n = n
        term = coupling.parts[n]
        super().__init__(system, run, coupling, *term.ends)

    def _arm(self, side: str) -> tuple[float, float]:
        return self.at.arm(self.element, f"{self.n}.{side}")

    def beta(self, side: str) -> float:
        """Direction of a marker on its body."""
        return self.at.angle(self.element, f"{self.n}.{side}")
