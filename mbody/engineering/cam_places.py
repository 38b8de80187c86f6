"""Which cam is meant, and the places of its profile that are looked at."""

from __future__ import annotations

import math

import numpy as np

from mbody.errors import ModelError, brief
from mbody.laws import Law
from mbody.model.element import listed
from mbody.model.joints import CamFollower
from mbody.model.mechanism import Mechanism

__all__ = ["cam_places", "named_cam"]

#: Places of a turn at which curvatures are computed: every twentieth of a degree.
PLACES = 7201
#: Beside a place where a profile's second derivative jumps [rad].
BESIDE = 1e-9


def named_cam(mechanism: Mechanism, name: str | None) -> CamFollower:
    """The cam of that name, by default the only one.

    Raises
    ------
    ModelError
        For a name that no cam has, and where there are several, or none.

    >>> import mbody
    >>> named_cam(mbody.gallery.load("cam_follower"), None).name
    'contact'
    """
    cams = [one for one in mechanism.joints if isinstance(one, CamFollower)]
    known = listed(one.name for one in cams)
    if name is None and len(cams) == 1:
        return cams[0]
    for one in cams:
        if one.name == name:
            return one
    if not cams:
        raise ModelError(
            f"'{mechanism.name}' has no cam: there is no joint of the type CamFollower in it"
        )
    if name is None:
        raise ModelError(
            f"'{mechanism.name}' has {len(cams)} cams ({known}): name the joint of one"
        )
    raise ModelError(f"there is no cam {brief(name)} (there are: {known})", name)


def cam_places(cam: CamFollower) -> np.ndarray:
    """ψ (n,) over a turn [rad], with both sides of the places where a derivative jumps."""
    law: Law = cam.profile
    jumps = np.mod(np.concatenate([law.turns(0.0), [0.0]]), math.tau)
    grid = np.linspace(0.0, math.tau, PLACES)[:-1]
    both = np.concatenate([grid, jumps - BESIDE, jumps + BESIDE])
    return np.unique(np.mod(both, math.tau))
