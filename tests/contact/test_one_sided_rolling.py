"""Wheels that roll and may lift off, against closed forms, and contacts of the same shapes."""

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Force, Gravity, Mechanism, Rolling, SimulationSettings
from mbody.errors import ModelError

G, RADIUS, MASS, INERTIA = 9.81, 0.1, 2.0, 0.02  # a hoop


def hoop(start, until=1.0, friction=0.15, contact=False, **more):
    """A hoop over a floor: rolling that may lift off, or the contact of a disc with a line."""
    floor = {"floor": {"line": {"point": "O"}}}
    machine = Mechanism("hoop", ground={"O": (0.0, 0.0)}, ground_shapes=floor)
    rim = {"rim": {"disc": "C", "radius": RADIUS}}
    machine.add(
        Body("wheel", mass=MASS, inertia=INERTIA, points={"C": (0.0, 0.0)}, shapes=rim),
        Gravity("gravity", y=-G),
    )
    if contact:
        machine.add(Contact("road", "ground.floor", "wheel.rim", friction=friction, **more))
    else:
        own = {"radius": RADIUS, "one_sided": True, "friction": friction}
        machine.add(Rolling("road", "ground.O", "wheel.C", **(own | more)))
    own = {"x": 0.0, "y": RADIUS, "angle": 0.0, "vx": 0.0, "vy": 0.0, "omega": 0.0} | start
    machine.simulation = SimulationSettings(until=until, rtol=1e-11, start={"wheel": own})
    return machine


@pytest.mark.parametrize("start", [{"y": 0.5, "vx": 2.0}, {"vx": 1.0, "vy": 2.0, "omega": 30.0}])
def test_it_flies_and_strikes_as_a_contact_of_its_disc(start):
    more = {"restitution": 0.5, "static": 0.3}
    ours, theirs = (mbody.simulate(hoop(start, contact=kind, **more)) for kind in (False, True))
    assert len(ours.events) == len(theirs.events) > 3
    for a, b in zip(ours.events, theirs.events, strict=True):
        assert (a.name, a.contact) == (b.name, b.contact)
        assert float(a.t) == pytest.approx(float(b.t), abs=1e-11)
    for key in ("x", "y", "angle", "vx", "omega"):
        one, other = (getattr(run["wheel"], key) for run in (ours, theirs))
        np.testing.assert_allclose(one, other, atol=1e-9)
    assert list(ours.mode("road")) == list(theirs.mode("road"))


@pytest.mark.parametrize("friction", [2.0, 20.0, 200.0])
def test_it_leaves_the_wheel_that_it_rolls_down(friction):
    """A full wheel that rolls from rest at θ₀ leaves at cos θ = 4/7 cos θ₀; slipping begins just
    before, where μ N falls to what rolling takes, and the later the more friction there is.
    """
    machine = Mechanism("down", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("wheel", mass=2.0, inertia=0.5 * 2.0 * RADIUS**2, points={"C": (0.0, 0.0)}),
        Rolling(
            "road", "ground.O", "wheel.C", radius=RADIUS, on_radius=0.4, one_sided=True,
            friction=friction,
        ),
        Gravity("gravity", y=-G),
    )  # fmt: skip
    lean = 0.1
    start = {"x": 0.5 * math.sin(lean), "y": 0.5 * math.cos(lean), "angle": 0.0}
    machine.simulation = SimulationSettings(
        until=1.0, rtol=1e-11, start={"wheel": start | {"vx": 0.0, "vy": 0.0, "omega": 0.0}}
    )
    run = mbody.simulate(machine)
    slips, leaves = run.events
    assert (slips.name, leaves.name) == ("slip", "open")
    cosine = float(slips.state["wheel"].y[0]) / 0.5
    # m g sin θ/3 = μ N with N = m g (7 cos θ − 4 cos θ₀)/3
    sine = math.sqrt(1.0 - cosine**2)
    pressed = 7.0 * cosine - 4.0 * math.cos(lean)
    assert sine == pytest.approx(friction * pressed, rel=1e-7)
    wanted = 4.0 / 7.0 * math.cos(lean)
    assert float(leaves.state["wheel"].y[0]) / 0.5 == pytest.approx(wanted, abs=0.02 / friction)


def test_other_analyses_keep_it_and_say_where_it_would_pull():
    """Held by a driver under a force that lifts it more than it weighs."""
    machine = hoop({}, friction=0.8)
    machine.add(Force("lift", "wheel.C", 40.0, angle=math.pi / 2.0))
    machine.add(mbody.CoordinateDriver("way", "ground.O", "wheel.C", "1 m/s*t"))
    run = mbody.kinetostatics(machine, t=[0.0])
    assert run.reaction("road").fy[0] == pytest.approx(MASS * G - 40.0, abs=1e-10)
    assert any("road" in note for note in run.notes)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"one_sided": True}, "friction and one_sided go together"),
        ({"friction": 0.5}, "friction and one_sided go together"),
        ({"one_sided": True, "friction": 0.5, "static": 0.3}, "more than static"),
        ({"one_sided": True, "friction": 0.5, "resistance": 0.01}, "resistance goes with a joint"),
        ({"one_sided": True, "friction": 0.5, "restitution": 1.5}, "gain energy"),
        ({"restitution": 0.5}, "nothing strikes in it"),
    ],
)
def test_what_does_not_fit_is_a_sentence(fields, words):
    with pytest.raises(ModelError, match=words):
        Rolling("road", "ground.O", "wheel.C", radius=0.3, **fields)


@pytest.mark.parametrize(("mass", "r"), [(2.0, 0.3), (5e-4, 2e3)])
def test_a_wheel_without_inertia_rolls_at_once(mass, r):
    """No friction is needed to spin it: ω = −v/r from the first instant, then v̇ = g sin α."""
    a, v = -0.2, 1.5 * math.sqrt(r)
    ground = {"floor": {"line": {"point": "O", "angle": a}}}
    machine = Mechanism("wheel", ground={"O": (0.0, 0.0)}, ground_shapes=ground)
    machine.add(
        Body(
            "wheel",
            mass=mass,
            inertia=0.0,
            points={"C": (0.0, 0.0)},
            shapes={"rim": {"disc": "C", "radius": r}},
        ),
        Contact("road", "ground.floor", "wheel.rim", friction=0.5),
        Gravity("gravity", y=-G),
    )
    c, s = math.cos(a), math.sin(a)
    start = dict(x=-r * s, y=r * c, angle=0.0, vx=v * c, vy=v * s, omega=0.3 * v / r)
    machine.simulation = SimulationSettings(math.sqrt(r), {"wheel": start}, rtol=1e-9, instants=9)
    run = mbody.simulate(machine)
    wheel, along = run["wheel"], v - G * s * run.t
    assert not run.doubts and run.mode("road") == ["roll"] * 9
    assert any("rolls at once" in note for note in run.notes)
    assert np.hypot(wheel.vx, wheel.vy) == pytest.approx(along, rel=1e-6)
    assert wheel.omega == pytest.approx(-along / r, rel=1e-6)
    road = run.reaction("road", on="wheel")
    assert road.fx * c + road.fy * s == pytest.approx(0.0, abs=1e-6 * mass * G)
