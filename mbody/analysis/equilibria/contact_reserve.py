"""How much more friction of closed contacts could take at rest positions, by a linear program."""

from __future__ import annotations

import numpy as np

from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.solution.contact_ranges import ContactLimits, RestingContacts

__all__ = ["ContactReserve"]


class ContactReserve:
    """The reserve of contacts at positions of a manifold: not negative where normal forces that
    press, and friction within its limits, balance all loads.
    """

    def __init__(self, manifold: Manifold) -> None:
        self.manifold = manifold
        self.limits = ContactLimits(manifold.system, manifold.work)

    def __bool__(self) -> bool:
        return True

    def at(self, place: Place) -> float:
        """The same at a place of a single free motion."""
        return self(place, place.motions[0])

    def __call__(self, place: Place, along: Array) -> float:
        """The reserve at a place [force·length]; the tangent `along` does not matter."""
        manifold = self.manifold
        load = manifold.force(place.q)
        manifold.rows(place.q)
        forces = RestingContacts(self.limits, manifold.work, load / manifold.scale)
        return forces.reserve() * float(np.abs(load).max(initial=0.0))
