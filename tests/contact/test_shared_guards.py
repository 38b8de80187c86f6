"""The guard of forces that no equation decides, in the kernel that makes the steps."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

import mbody
from mbody import Body, Contact, Force, Gravity, Mechanism, SimulationSettings
from mbody.analysis.dynamics.integration import Integration
from mbody.kernels.contact_guards import BEGIN, SHARE
from mbody.kernels.step_state import NOT_QUIET, TIME, ZERO
from mbody.model.contact import OneSided
from tests.campaign.scene_checks import faults_of
from tests.campaign.scenes import random_scene
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
    codes, margins, own = [], {}, Integration._quiet_steps

    def steps(motion):
        codes.append(int(own(motion)))
        G = motion.active.guard_table
        for n in np.flatnonzero(G.kind[: G.count[0]] == SHARE):
            margins[float(motion.state[TIME])] = float(G.value[BEGIN, n])
        return codes[-1]

    monkeypatch.setattr(Integration, "_quiet_steps", steps)
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


# -- Contacts of one line: normal forces alone are shared ---------------------------------------

FEET, MASS, G, MU, PULL = {"A": -1.0, "B": 0.2, "C": 1.0}, 2.0, 9.81, 0.3, 20.0


def plank(order="ABC"):
    """A plank on three points of one line, pushed more and more a length above these."""
    points = {name: (x, 0.0) for name, x in FEET.items()} | {"T": (0.0, 1.0)}
    ground = {"floor": {"line": {"point": "O"}}}
    machine = Mechanism("plank", ground={"O": (0.0, 0.0)}, ground_shapes=ground)
    machine.add(
        Body("plank", mass=MASS, inertia=0.4, points=points),
        Gravity("gravity", y=-G),
        Force("push", "plank.T", f"{PULL} N/s*t", angle=0.0),
        *(Contact(name, "ground.floor", f"plank.{name}", friction=MU) for name in order),
    )
    start = {"plank": {"x": 0.0, "y": 0.0, "angle": 0.0}}
    machine.simulation = SimulationSettings(until=1.1, rtol=1e-12, start=start, instants=45)
    return machine


@pytest.mark.parametrize("order", [*itertools.permutations("ABC")])
def test_a_plank_on_three_points_slides_and_tips_in_any_order(order):
    """All three slide at once where the push is μ W, and only then, when its moment about the last
    one is that of the weight, the others open; the least forces of all instants are the greatest
    that the balance allows.
    """
    run, weight = mbody.simulate(plank("".join(order))), MASS * G
    assert run.status == "completed"
    found = sorted((one.name, one.contact) for one in run.events)
    assert found == [("open", "A"), ("open", "B"), *(("slip", name) for name in "ABC")]
    for one in run.events:
        expected = (MU if one.name == "slip" else 1.0) * weight / PULL
        assert one.t == pytest.approx(expected, rel=1e-9)
    share = np.array([run.contact(name) for name in FEET])
    for k in np.flatnonzero(run.t < weight / PULL):
        moment = PULL * run.t[k]  # of the push about the floor; the plank accelerates through it
        if run.t[k] > MU * weight / PULL:
            assert {run.mode(name)[k] for name in FEET} == {"slip+"}
        balance = [[1.0, 1.0, 1.0, 0.0], [*FEET.values(), 0.0]]
        keep = np.column_stack([-np.eye(3), np.ones(3)])
        best = linprog([0.0, 0.0, 0.0, -1.0], keep, np.zeros(3), balance, [weight, moment])
        if run.mode("A")[k] == "slip+":
            assert share[:, k].min() == pytest.approx(-best.fun, abs=1e-8 * weight)
        assert share[:, k].sum() == pytest.approx(weight, rel=1e-9)


def test_a_plank_goes_on_from_a_file_where_it_slides_on_three_points(tmp_path):
    """Modes of what has no row of its own are kept, too."""
    whole = mbody.simulate(plank(), rtol=1e-10)
    first = mbody.simulate(plank(), 0.6, rtol=1e-10)
    mbody.save_run(first, tmp_path / "first.npz")
    loaded = mbody.load_run(tmp_path / "first.npz")
    second = mbody.simulate(plank(), 1.1, start=loaded, rtol=1e-10)
    assert [one.name for one in second.events if one.t > 0.6] == ["open", "open"]
    assert second["plank"].x[-1] == pytest.approx(whole["plank"].x[-1], rel=1e-12)


def test_a_disc_in_a_corner_keeps_its_limits():
    """Both contacts press by the forces of the problem; friction of what would pull balances the
    disc, too, with normal forces below zero.
    """
    scene = random_scene(60788)
    run = mbody.simulate(scene.mechanism("corner"))
    assert not faults_of(scene, run) and not run.doubts


def test_modes_beyond_their_limits_are_doubted(monkeypatch):
    """Friction of |N| finds what pulls, as above: that is said."""
    own = OneSided.frictions

    def of_any_sign(contact, at):
        found = own(contact, at)
        return [replace(one, parameters=[*one.parameters[:4], 0.0, 0.0]) for one in found]

    monkeypatch.setattr(OneSided, "frictions", of_any_sign)
    run = mbody.simulate(random_scene(60788).mechanism("corner"))
    (doubt,) = (one for one in run.doubts if one.kind == "contact")
    assert doubt.t == 0.0 and "wall a rim" in doubt.elements
    assert run.status.startswith("doubtful: at t = 0 s what is decided of")
