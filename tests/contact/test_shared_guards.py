"""The guard of forces that no equation decides, in the kernel that makes the steps."""

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Force, Gravity, Mechanism, SimulationSettings
from mbody.analysis.dynamics.contact_motion import ContactIntegration
from mbody.kernels.contact_guards import BEGIN, SHARE
from mbody.kernels.step_state import NOT_QUIET, TIME, ZERO


def test_what_is_shared_slips_where_no_forces_hold_it(monkeypatch):
    """A growing force pulls a block on two feet along the floor: each carries m g / 2, the greatest
    least margin of their friction is half of μ m g - F, and both slip where that is zero.
    """
    mass, friction, growth = 2.0, 0.4, 3.0
    shapes = {"floor": {"line": {"point": "O"}}}
    machine = Mechanism("block", ground={"O": (0.0, 0.0)}, ground_shapes=shapes)
    triangle = {"s": {"polygon": ["a", "b", "c"]}}
    corners = {"a": (-0.3, 0.0), "b": (0.3, 0.0), "c": (0.0, 0.3)}
    machine.add(
        Body("b", mass=mass, inertia=0.1, cg=(0.0, 0.1), points=corners, shapes=triangle),
        Contact("feet", "ground.floor", "b.s", friction=friction),
        Force("pull", "b.a", f"{growth} N/s*t", angle=0.0),
        Gravity("g", y=-9.81),
    )
    codes, margins, own = set(), [], ContactIntegration._quiet_steps

    def steps(motion):
        code, G = own(motion), motion.guard_table
        codes.add(int(code))
        for n in np.flatnonzero(G.kind[: G.count[0]] == SHARE):
            margins.append((motion.state[TIME], G.value[BEGIN, n]))
        return code

    monkeypatch.setattr(ContactIntegration, "_quiet_steps", steps)
    start = {"b": dict(x=0.0, y=0.1, angle=0.0, vx=0.0, vy=0.0, omega=0.0)}
    machine.simulation = SimulationSettings(until=4.0, start=start, rtol=1e-10)
    run = mbody.simulate(machine, 4.0)
    slips = [one.t for one in run.events if one.name == "slip"]
    assert slips == pytest.approx([friction * mass * 9.81 / growth], rel=1e-12)
    t, found = np.array(margins).T
    load = friction * mass * 9.81
    assert found == pytest.approx(0.5 * (load - growth * t), abs=1e-10 * load)
    assert ZERO in codes and NOT_QUIET not in codes
