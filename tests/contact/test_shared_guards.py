"""The guard of forces that no equation decides, in the kernel that makes the steps."""

import math

import numpy as np
import pytest

import mbody
from mbody.analysis.dynamics.contact_motion import EventIntegration
from mbody.kernels.contact_guards import BEGIN, SHARE
from mbody.kernels.step_state import NOT_QUIET, TIME, ZERO
from tests.contact.test_shared_forces import Held
from tests.support import contact_models as models

WEIGHT, FIRST, GROWTH, TILT = 200.0, 60.0, 40.0, 1.0


def test_the_margin_of_a_ladder_is_that_of_a_program(monkeypatch):
    """A ladder that sticks at both ends while a force pushes its foot to the wall more and more:
    its greatest least margin is that of a linear program over the laws of contact alone, and the
    kernel finds by itself where it is zero.
    """
    text = models.LADDER[: models.LADDER.index("[simulate]")]
    text = text.replace("mass = 1", f"mass = {WEIGHT / 9.81!r}")
    machine = mbody.from_toml(text.replace('"1/3"', repr(WEIGHT / 9.81 / 3.0)))
    force = f"{FIRST} N + {GROWTH} N/s*t"
    machine.add(mbody.Force("hold", "ladder.A", force, angle=math.pi))
    c, s = math.cos(TILT), math.sin(TILT)
    start = {"ladder": {"x": c, "y": s, "angle": math.pi - TILT}}
    machine.simulation = mbody.SimulationSettings(until=2.0, rtol=1e-13, start=start)
    codes, margins, own = [], {}, EventIntegration._quiet_steps

    def steps(motion):
        codes.append(int(own(motion)))
        G = motion.guard_table
        for n in np.flatnonzero(G.kind[: G.count[0]] == SHARE):
            margins[float(motion.state[TIME])] = float(G.value[BEGIN, n])
        return codes[-1]

    monkeypatch.setattr(EventIntegration, "_quiet_steps", steps)
    for until in (0.1, 0.7, 1.5, 2.0):
        run = mbody.simulate(machine, until, instants=2)
    assert ZERO in codes and NOT_QUIET not in codes
    slips = next(one.t for one in run.events if one.name == "slip")
    assert sorted(margins) == pytest.approx([0.1, 0.7, 1.5, slips])
    friction = [one.friction for one in machine.contacts]
    places, normals = [(2.0 * c, 0.0), (0.0, 2.0 * s)], [(0.0, 1.0), (1.0, 0.0)]
    for t, found in margins.items():
        push = FIRST + GROWTH * t
        held = Held(places, normals, friction, (c, s), (-push, -WEIGHT), -push * s)
        least = -held.program(None, margin=True).fun * held.size
        assert found == pytest.approx(least, abs=1e-8 * WEIGHT)
        assert t == slips or found > 1.0
