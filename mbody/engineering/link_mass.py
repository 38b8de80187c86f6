"""How the mass of a link lies along its bar, and what its weight and inertia do up to a cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.system.read_only import lock

__all__ = ["LinkMass", "link_mass"]

Array = np.ndarray

#: A density that is below zero by less than this part of its mean is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class LinkMass:
    """A mass along a line, or in one place of it.

    Attributes
    ----------
    mass, place, across, inertia : float
        Its mass centre is `place` along the bar and `across` it [length].
    length : float
        Of the bar.
    density : array (3,) or None
        λ(s) = Σ density[k] s^k [mass/length]; None where it is a lump at its mass centre.
    """

    mass: float
    place: float
    across: float
    inertia: float
    length: float
    density: Array | None

    def __post_init__(self) -> None:
        lock(self)

    def moments(self, s: Array, after: Array) -> tuple[Array, Array, Array]:
        """∫ λ dσ, ∫ λ (σ − place) dσ, ∫ λ (σ − place)² dσ from the beginning to cuts at s; a lump
        is counted where the cut lies after it, or just after it (`after`).
        """
        if self.density is None:
            passed = np.where(after, self.place <= s, self.place < s).astype(float)
            return self.mass * passed, 0.0 * passed, self.inertia * passed
        cut = np.clip(s, 0.0, self.length)
        found = []
        polynomial = np.polynomial.Polynomial(self.density)
        arm = np.polynomial.Polynomial([-self.place, 1.0])
        for _ in range(3):
            whole = polynomial.integ()
            found.append(np.asarray(whole(cut) - whole(0.0)))
            polynomial = polynomial * arm
        return found[0], found[1], found[2]


def link_mass(
    mass: float, inertia: float, place: float, across: float, length: float, lump: bool
) -> LinkMass:
    """The mass of a link along its bar, 0 … length: a density of second degree that has its mass,
    mass centre and inertia, which is constant for a uniform rod; a lump where that is not possible.
    """
    density = None
    half = 0.5 * length
    if not lump and mass > 0.0 and inertia > 0.0:
        off = place - half
        mean = mass / length
        # of Legendre's polynomials on −1 … 1: the mass, its first and its second moment
        first = 1.5 * mass * off / half**2
        second = (inertia + mass * off**2) / half**3
        square = (second - mean * 2.0 / 3.0) * 15.0 / 4.0
        of_x = np.array([mean - 0.5 * square, first, 1.5 * square])
        places = [-1.0, 1.0]
        if of_x[2] > 0.0 and abs(first) < 2.0 * of_x[2]:
            places.append(-first / (2.0 * of_x[2]))
        if min(np.polynomial.polynomial.polyval(x, of_x) for x in places) > -ROUNDING * mean:
            x = np.polynomial.Polynomial([-1.0, 1.0 / half])
            density = np.zeros(3)
            made = np.polynomial.Polynomial(of_x)(x).coef
            density[: made.size] = made
    return LinkMass(mass, place, across, inertia, length, density)
