"""Impacts by momentum alone: every one within its cones, and none gives energy without a doubt."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody.analysis.dynamics.contact_log import ContactLog
from mbody.laws import ConstantSpeed
from tests.support.impact_cones import check_impacts

G = 9.81


def floored(name, *elements, until, start, gravity=G):
    made = mbody.Mechanism(
        name, ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    made.add(*elements, *([mbody.Gravity("gravity", y=-gravity)] if gravity else []))
    made.simulation = mbody.SimulationSettings(until, start)
    return made


def kane(law="newton", size=1.0, mass=1.0, e=0.98, along=0.736):
    """A bar that strikes on its end so that friction turns the sliding round."""
    angle = 1.03
    bar = mbody.Body("bar", mass=mass, inertia=mass * size**2 / 6.32, points={"E": (-size, 0.0)})
    end = mbody.Contact("end", "ground.floor", "bar.E", friction=0.43, restitution=e, law=law)
    y = size * (math.sin(angle) + 0.1)
    start = {"x": 0.0, "y": y, "angle": angle, "vx": along * size, "vy": -size}
    return floored("bar", bar, end, until=0.2, start={"bar": start}, gravity=0.0)


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("mass", [1e-6, 1.0, 1e6])
def test_newtons_law_may_gain_energy_which_is_said(size, mass):
    """What it gives is the kinetic energy by the rates before and after (Kane's paradox)."""
    run = mbody.simulate(kane(size=size, mass=mass))
    (check,) = check_impacts(run)
    assert check.outside < 1e-12
    assert check.energy == pytest.approx(0.16621 * mass * size**2, rel=1e-4)
    assert run.status.startswith("doubtful: ")
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.elements) == ("energy", ("end",))
    assert doubt.t == pytest.approx(0.1, abs=1e-9)
    assert f"{check.energy:.3g}" in doubt.message
    assert run.energy.lost["end"][-1] == pytest.approx(-check.energy, rel=1e-9)


def test_steps_with_impulses_say_it():
    run = mbody.simulate(kane(), method="moreau", step=1e-3)
    (doubt,) = run.doubts
    assert (doubt.kind, doubt.elements) == ("energy", ("end",))
    assert doubt.t == pytest.approx(0.1, abs=2e-3)
    assert not mbody.simulate(kane(e=0.0), method="moreau", step=1e-3).doubts


def test_only_what_is_connected_is_taken_together():
    """What a great box loses beside it does not hide what the bar gains."""
    bar = kane()
    corners = {"A": (-1.0, -1.0), "B": (1.0, -1.0), "C": (1.0, 1.0), "D": (-1.0, 1.0)}
    shape = {"box": {"polygon": ("A", "B", "C", "D")}}
    box = mbody.Body("box", mass=900.0, inertia=600.0, points=corners, shapes=shape)
    bar.add(box, mbody.Contact("foot", "ground.floor", "box.box", friction=0.2))
    start = {**bar.simulation.start, "box": {"x": 9.0, "y": 1.04, "vx": 3.0, "vy": -0.4}}
    bar.simulation = replace(bar.simulation, start=start)
    run = mbody.simulate(bar, method="moreau", step=1e-3)
    assert [one.elements for one in run.doubts] == [("end",)]


def boxes(rng, scale):
    """Some boxes and discs that are thrown at the floor and at each other, one on a rope."""
    made, start = [], {}
    for n in range(3):
        x, y = (n * 1.1 + 0.2) * scale, (0.9 + 0.3 * n) * scale
        a, b = (rng.uniform(0.2, 0.4, 2) * scale).tolist()
        mass = 10.0 ** rng.uniform(-3.0, 3.0)
        corners = {"A": (-a, -b), "B": (a, -b), "C": (a, b), "D": (-a, b), "O": (0.0, 0.0)}
        round_one = n == 1
        shape = {"disc": "O", "radius": a} if round_one else {"polygon": ("A", "B", "C", "D")}
        inertia = mass * a * a * rng.uniform(0.3, 0.6)
        made.append(
            mbody.Body(f"b{n}", mass=mass, inertia=inertia, points=corners, shapes={"s": shape})
        )
        made.append(
            mbody.Contact(
                f"c{n}",
                "ground.floor",
                f"b{n}.s",
                friction=rng.uniform(0.1, 0.9),
                restitution=rng.choice([0.0, 0.4, 0.8]),
            )
        )
        speeds = (rng.normal(size=2) * math.sqrt(G * scale)).tolist()
        start[f"b{n}"] = {"x": x, "y": y, "angle": rng.uniform(-1.0, 1.0) * (not round_one)}
        start[f"b{n}"] |= {"vx": speeds[0], "vy": -abs(speeds[1]), "omega": rng.normal()}
    made.append(mbody.Rope("leash", "ground.O", "b2.A", length=3.6 * scale))
    return floored("boxes", *made, until=math.sqrt(scale), start=start)


@pytest.mark.parametrize("seed", range(4))
def test_every_impact_is_within_its_cones(seed):
    rng = np.random.default_rng(seed)
    run = mbody.simulate(boxes(rng, 10.0 ** rng.uniform(-3.0, 3.0)), rtol=1e-9)
    checks = check_impacts(run)
    assert len(checks) > 3
    for check in checks:
        # a series of impacts that is taken to its end leaves what the loads did in that time
        assert check.outside * check.size < (1e-6 if check.name == "rest" else 1e-9), check
        assert check.outside < 1e-7 or check.name == "rest", check
        gained = check.gained * (check.size if check.name == "rest" else 1.0)
        assert gained < 1e-8, check
    assert not run.doubts


def test_a_light_rope_beside_heavy_boxes_goes_slack():
    """Its tension begins at rounding of their weights: what is taken for a little more than zero
    there is no load that swings. What impacts by Newton's law give is said of each.
    """
    rng = np.random.default_rng(142)
    poisson = boxes(rng, 10.0 ** rng.uniform(-6.0, 6.0))
    made = floored("newton", *poisson.bodies, until=1.0, start={})
    for one in poisson.contacts:
        own = {
            "law": "newton",
            "restitution": 0.95,
            "friction": min(0.5, float(getattr(one, "friction", 0.0))),
        }
        made.add(replace(one, **own) if isinstance(one, mbody.Contact) else one)
    made.simulation = poisson.simulation
    run = mbody.simulate(made)
    assert [one.name for one in run.events if one.contact == "leash"] == ["impact", "open"]
    gains = [check.t for check in check_impacts(run) if check.gained > 1e-7]
    assert [one.t for one in run.doubts] == pytest.approx(gains)


def test_a_planted_impulse_beyond_its_cone_is_seen():
    run = mbody.simulate(kane("poisson"))
    (event,) = run.events
    event.after.record.blocks[0][:, 3, 0] += 0.5
    (check,) = check_impacts(run)
    assert check.outside > 0.05


@pytest.mark.parametrize("wrong", [1.5, -1e-3])
def test_an_impact_that_its_impulses_do_not_explain_is_doubted(monkeypatch, wrong):
    check = ContactLog.check_impact

    def planted(log):
        log.active.memory.impact.jump[:] *= 1.0 + wrong
        check(log)

    monkeypatch.setattr(ContactLog, "check_impact", planted)
    run = mbody.simulate(kane("poisson"))
    assert (run.doubts[0].kind, run.doubts[0].elements) == ("energy", ("end",))
    assert "do not rely" in run.status


def test_a_stop_that_moves_gives_what_it_says():
    """It throws a mass: energy is given, and no doubt of it."""
    made = mbody.Mechanism("thrown")
    made.add(
        mbody.Body("mass", mass=2.0, inertia=1.0, guess=(0.5, 0.0, 0.0)),
        mbody.Prismatic("guide", "ground", "mass"),
        mbody.Stop("table", "mass.x - 3 m/s*t", restitution=0.5),
    )
    made.simulation = mbody.SimulationSettings(0.4, {"mass": {"x": 0.5}})
    run = mbody.simulate(made)
    assert run["mass"].vx[-1] == pytest.approx(4.5, rel=1e-12)
    assert run.energy.by["table.moving"][-1] == pytest.approx(2.0 * 4.5 * 3.0, rel=1e-12)
    assert run.status == "completed"


def test_a_driver_gives_what_holds_its_carriage_in_an_impact(monkeypatch):
    """A bob that hangs from a carriage strikes a wall: by the closed form of the pendulum."""
    mass, inertia, long, speed, kept = 2.0, 0.1, 0.5, 3.0, 0.4
    wall = {"wall": {"line": {"point": "W", "angle": math.pi / 2.0}}}
    made = mbody.Mechanism("carried", ground={"W": (1.0, 0.0)}, ground_shapes=wall)
    made.add(
        mbody.Body("carriage", mass=5.0, inertia=1.0, points={"P": (0.0, 0.5)}),
        mbody.Body("bob", mass=mass, inertia=inertia, points={"P": (0.0, long), "C": (0.0, 0.0)}),
        mbody.Prismatic("guide", "ground", "carriage"),
        mbody.Revolute("pin", "carriage.P", "bob.P"),
        mbody.CoordinateDriver("drive", "ground", "carriage", ConstantSpeed(0.0, speed)),
        mbody.Contact("hit", "ground.wall", "bob.C", restitution=kept),
    )
    made.simulation = mbody.SimulationSettings(0.35, {"bob": {"angle": 0.0, "omega": 0.0}})
    check, found = ContactLog.check_impact, []

    def kept_impact(log):
        found.extend(log.active.memory.impact.driven)
        check(log)

    monkeypatch.setattr(ContactLog, "check_impact", kept_impact)
    run = mbody.simulate(made)
    assert ([one.name for one in run.events], run.status) == (["impact"], "completed")
    # about the pin: (m l² + I) Δω = l Λ, of which the mass centre gets l Δω = (1 + e) v
    blow = (1.0 + kept) * speed * (mass * long**2 + inertia) / long**2
    assert abs(run.events[0].impulse("hit")[0]) == pytest.approx(blow, rel=1e-9)
    # the pin, and so the driver, gives the bob what the wall does beyond its change of momentum
    driver = blow - mass * (1.0 + kept) * speed
    assert found == [pytest.approx(driver * speed, rel=1e-9)]
