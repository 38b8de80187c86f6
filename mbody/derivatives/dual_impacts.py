"""Velocities after an impact with their derivatives.

An impact solves problems of complementarity; which of their unknowns are not zero is known from
the motion, and with that it is a chain of linear systems. They are solved once more for every
direction with its tangents as tiny imaginary parts (complex step), which loses no figure.

Squire, Trapp: Using complex variables to estimate derivatives of real functions (1998).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.analysis.contact.complementarity import lemke
from mbody.analysis.contact.contact_laws import ClosedContacts, impact_impulses
from mbody.analysis.contact.unilateral import Unilateral
from mbody.core.dual_number import DualNumber, value
from mbody.derivatives.dual_motion import DualInstant

__all__ = ["ImpactDuals"]

Array = np.ndarray

#: Imaginary parts: their squares vanish.
TINY = 1e-30
#: An unknown of an impact below this part of the greatest is none, a complement too; where both
#: are none there is no derivative.
NONE = 1e-10
#: Rows that depend on others by less than this part are dependent.
DEPENDENT = 1e-9


class ImpactDuals:
    """The impacts of one system.

    Parameters
    ----------
    uni : Unilateral
    numbers : mapping
        Of the description by dotted name, dual ones among them.
    mass : DualNumber (coordinates,)
    """

    def __init__(self, uni: Unilateral, numbers: Mapping[str, Any], mass: DualNumber) -> None:
        self.uni, self.mass = uni, mass
        at: Any = numbers
        contacts = {one.name: one for one in uni.system.mechanism.contacts}
        self.friction = [contacts[one.name].coefficients(at)[0] for one in uni.touches]
        self.restitution = [contacts[one.name].restitution_of(at) for one in uni.touches]

    def velocities(self, now: DualInstant, closed: tuple[int, ...]) -> DualNumber | None:
        """Velocities (coordinates,) after an impact of closed touches at an instant; None where
        which of them take part is at its limit.
        """
        n = self.uni.system.coordinates
        supports: list[Array] = []
        rough = np.array([value(self.friction[one]) > 0.0 for one in closed], dtype=bool)

        def first(A: Array, b: Array) -> Array | None:
            z = lemke(A, b)
            if z is None:
                return None
            w = A @ z + b
            size = max(float(np.abs(z).max(initial=0.0)), 1e-300)
            fast = max(float(np.abs(b).max(initial=0.0)), 1e-300)
            tied = (z <= NONE * size) & (w <= NONE * fast)
            # friction of what does not press is none, whatever its complement
            tied[len(closed) :] &= np.tile(z[: len(closed)][rough] > NONE * size, 2)
            if tied.any():
                return None
            taken = np.flatnonzero(z > NONE * size)
            supports.append(taken[_independent(A[np.ix_(taken, taken)])])
            return z

        plain = self._after(now, closed, -1, first)
        if plain is None:
            return None
        tangents = np.zeros((n, now.y.tangents.shape[1]))
        for k in range(tangents.shape[1]):
            left = iter(supports)

            def again(A: Array, b: Array, left: Any = left) -> Array:
                taken, z = next(left), np.zeros(len(b), dtype=complex)
                z[taken] = np.linalg.solve(A[np.ix_(taken, taken)], -b[taken])
                return z

            found = self._after(now, closed, k, again)
            assert found is not None
            if not np.allclose(found.real, plain.real, rtol=0.0, atol=1e-9 * np.abs(plain).max()):
                return None
            tangents[:, k] = found.imag / TINY
        return DualNumber(plain.real, tangents)

    def _after(self, now: DualInstant, closed: tuple[int, ...], k: int, solve: Any) -> Array | None:
        """Velocities after the impact, with the tangents of direction k as imaginary parts."""
        uni, n, m = self.uni, self.uni.system.coordinates, len(closed)
        block, rate, joints, mass = (
            _with(one, k) for one in (now.block, now.rate, now.joints, self.mass)
        )
        W, rates = np.zeros((2 * m, n), dtype=block.dtype), np.zeros(2 * m, dtype=block.dtype)
        for place, number in enumerate(closed):
            touch = uni.touches[number]
            W[place] = touch.spot.sense * block[touch.normal]
            rates[place] = touch.spot.sense * rate[touch.normal]
            if touch.tangent >= 0:
                W[m + place], rates[m + place] = block[touch.tangent], rate[touch.tangent]
        Y = self._responses(joints, mass[:n], W)
        friction = _with_all([self.friction[one] for one in closed], k)
        restitution = _with_all([self.restitution[one] for one in closed], k)
        contacts = ClosedContacts(W @ Y, friction, np.where(friction.real > 0.0, 0.0, 1.0))
        newton = np.array([uni.touches[one].law == "newton" for one in closed])
        impulse = impact_impulses(contacts, rates, restitution, newton, solve=solve)
        if impulse is None:
            return None
        v = _with(now.y, k)[n : 2 * n]
        return np.asarray(v + Y @ impulse)

    def _responses(self, joints: Array, mass: Array, W: Array) -> Array:
        """How velocities change by an impulse along each row, (coordinates, rows), as far as joints
        allow: from [M Gᵀ; G 0], G of rows that do not depend on each other.
        """
        system, n = self.uni.system, len(mass)
        unit = system.coordinate_units
        G = system.row_units[:, None] * joints * unit
        if len(G):
            # the others follow from these
            G = G[_independent(G.real.T)]
        size = float(np.abs(mass.real * unit**2).max())
        inertia = np.diag(mass * unit**2) / size
        count = len(G)
        whole = np.block([[inertia, G.T], [G, np.zeros((count, count))]])
        right = np.vstack([(W * unit).T / size, np.zeros((count, len(W)))])
        return np.asarray(unit[:, None] * np.linalg.solve(whole, right)[:n])


def _independent(A: Array) -> Array:
    """Columns of A that do not depend on each other, ascending."""
    from scipy.linalg import qr

    if not A.size:
        return np.zeros(0, dtype=int)
    _, R, order = qr(A, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    return np.sort(order[: len(sizes)][sizes > DEPENDENT * max(float(sizes[0]), 1e-300)])


def _with(one: DualNumber, k: int) -> Array:
    """Values, with the tangents of direction k as imaginary parts; without any for k = −1."""
    if k < 0:
        return np.asarray(one.value)
    return np.asarray(one.value + 1j * TINY * one.tangents[..., k])


def _with_all(some: list[Any], k: int) -> Array:
    """The same of numbers of which some are dual."""
    plain = np.array([float(value(one)) for one in some])
    if k < 0:
        return plain
    parts = [one.tangents[k] if isinstance(one, DualNumber) else 0.0 for one in some]
    return np.asarray(plain + 1j * TINY * np.array(parts))
