"""Why a number of rest positions is uncertain near a place: a load jumps, or no stiffness."""

from __future__ import annotations

import numpy as np

from mbody.analysis.position.many_positions import ManyPositions
from mbody.analysis.position.tangent_space import Manifold, Place

__all__ = ["directionless_loads", "jumping_loads", "without_stiffness"]

#: Distances to both sides at which loads are compared, in model lengths and radians: the lesser is
#: further than a finest cell of a chart is long, so that a jump in it lies between.
FAR, NEAR = 1e-2, 1e-3
#: The change of a load over the lesser, as a part of that over the greater, from which on it jumps:
#: that of a smooth load is their ratio.
JUMPS = 0.5
#: Distances, likewise, to where what is left out at the very place where its ends meet is there.
BESIDE, FURTHER = 1e-8, 1e-5
#: A change below this part of the greatest load is none.
NONE = 1e-6
#: A stiffness below this part of the greatest, or of how fast loads change, is none to first order:
#: as far beside a double zero as a finest cell is long it is about 1e-4.
SOFT = 1e-3


def jumping_loads(manifold: Manifold, place: Place) -> list[str]:
    """Names of the loads whose force jumps at a place, as of a spring whose ends meet there."""
    many, ways = ManyPositions(manifold), manifold.scale * place.motions
    changes = []
    for step in (NEAR, FAR):
        sides = [many.loads(place.q + sign * step * ways) for sign in (1.0, -1.0)]
        changes.append(np.abs(sides[0] - sides[1]).max(axis=(0, 2), initial=0.0))
    least = NONE * manifold.largest(place.q)
    jumps = (changes[0] > JUMPS * changes[1]) & (changes[0] > least)
    loads = manifold.system.mechanism.loads
    return [load.name for load, own in zip(loads, jumps, strict=True) if own]


def directionless_loads(manifold: Manifold, place: Place) -> list[str]:
    """Names of the loads that are left out at this very place, and are there beside it: where the
    ends of a spring meet, its force has no direction.
    """
    many, ways = ManyPositions(manifold), manifold.scale * place.motions
    near, far = (
        np.abs(many.loads(np.concatenate([place.q + step * ways, place.q - step * ways])))
        .max(axis=2, initial=0.0)
        .max(axis=0, initial=0.0)
        for step in (BESIDE, FURTHER)
    )
    here = np.abs(many.loads(place.q[None]))[0].max(axis=1, initial=0.0)
    # a load that vanishes smoothly is as much smaller as it is nearer
    gone = (here < JUMPS * near) & (near > JUMPS * far)
    loads = manifold.system.mechanism.loads
    return [load.name for load, own in zip(loads, gone, strict=True) if own]


def without_stiffness(manifold: Manifold, place: Place) -> bool:
    """Whether nothing drives it back to first order along some free motion."""
    K = manifold.stiffness(place)
    if not (K.size and np.isfinite(K).all()):
        return False
    sizes = np.linalg.svd(K, compute_uv=False)
    return bool(sizes[-1] <= SOFT * max(float(sizes[0]), manifold.scale_of(place)))
