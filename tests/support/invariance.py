"""Results by name of a linkage described anew, and their comparison.

Every number of a description is rounded anew by such a change, by 1e-16 of itself, and Newton's
last correction, up to 1e-12 of the coordinates, falls elsewhere. The linkages magnify either by
some tens to some hundreds in accelerations and forces: 1e-9 of the greatest number of its sort.
"""

import dataclasses
import functools
import math

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from mbody import Mechanism, kinetostatics, statics
from mbody.laws import Harmonic, Polynomial
from mbody.model.element import Polar
from tests.support.linkages import random_linkage, times_within

LINKAGES = [
    (2, 3, ()),
    (0, 3, ("sliders",)),
    (1, 3, ("extras",)),
    (0, 3, ("sliders", "extras")),
    (1, 4, ("sliders",)),
]
INSTANTS = 6
SAME = 1e-9

linkages = st.sampled_from(LINKAGES)
seeds = st.integers(0, 10**6)
lightly = settings(max_examples=8)


@functools.cache
def original(linkage):
    """(mechanism, times, its run, its run at rest)."""
    seed, loops, kind = linkage
    machine, turn = random_linkage(seed, loops, **dict.fromkeys(kind, True))
    t = times_within(machine, turn, INSTANTS)
    return machine, t, kinetostatics(machine, t), statics(machine, t)


def answers(run, names=lambda name: name):
    """{sort: {what: (instants,) or (instants, 2)}} of a run, names as the original has them."""
    found = {sort: {} for sort in ("place", "turn", "v", "w", "a", "alpha", "force", "torque")}
    for body in run:
        h, name = run[body], names(body)
        found["place"][name] = np.column_stack([h.x, h.y])
        found["v"][name] = np.column_stack([h.vx, h.vy])
        found["a"][name] = np.column_stack([h.ax, h.ay])
        found["turn"][name], found["w"][name], found["alpha"][name] = h.angle, h.omega, h.alpha
    for joint in run.mechanism.joints:
        part = run.reaction(joint.name)
        found["force"][names(joint.name)] = np.column_stack([part.fx, part.fy])
        found["torque"][names(joint.name)] = part.torque
    for driver in run.mechanism.drivers:
        found["torque"][names(driver.name)] = run.effort(driver.name)
    return found


def assert_same(found, wanted):
    for sort, parts in wanted.items():
        assert found[sort].keys() == parts.keys()
        top = max(np.abs(part).max() for part in parts.values())
        for name, part in parts.items():
            mine = found[sort][name]
            assert_allclose(mine, part, rtol=0, atol=SAME * top, err_msg=f"{sort} of {name}")


def rebuilt(machine, elements, **changes):
    """A mechanism of these elements."""
    more = {"units": machine.units, "g": machine.g, "ground": machine.ground.points} | changes
    copy = Mechanism(machine.name, **more)
    copy.add(*elements)
    return copy


def changed(element, marker):
    """A copy of an element with another marker for each of its own."""
    places = {key: marker(m) for key, m in element.places().items()}
    return dataclasses.replace(element, **places)


def pair(point):
    if isinstance(point, Polar):
        return np.array([point.r * math.cos(point.angle), point.r * math.sin(point.angle)])
    return np.array(point, dtype=float)


def rotation(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def numbered(law, change):
    """The same law with other numbers: change(name, number)."""
    return law.with_numbers({k: change(k, x) for k, x in law.numbers().items()})


def shifted(law, by):
    first = (
        "c0" if isinstance(law, Polynomial) else "mean" if isinstance(law, Harmonic) else "value"
    )
    return numbered(law, lambda name, x: x + by if name == first else x)
