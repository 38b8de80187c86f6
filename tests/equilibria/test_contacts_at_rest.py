"""Statics and rest positions of bodies that lie on each other: bands of forces and of positions."""

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Mechanism, SimulationSettings, Stop
from tests.support import driven_contacts as models

G = 9.81


def test_band_of_a_force_that_holds_a_ladder():
    """Both contacts at their limits, one way or the other; references to all their digits."""
    run = mbody.statics(mbody.from_toml(models.HELD_LADDER))
    band = run.range("hold")
    # the driver pulls the foot to the wall, against x
    assert -float(band.high[0]) == pytest.approx(10.764630791962567, abs=1e-12)
    assert -float(band.low[0]) == pytest.approx(123.71708864639038, abs=1e-12)
    c, s = math.cos(1.0), math.sin(1.0)
    for way, end in ((1.0, band.high), (-1.0, band.low)):
        # the foot is about to move outwards or inwards, and the top down or up
        wall = 200.0 * c / (2.0 * s + way * 2.0 * c * 0.15)
        floor = 200.0 - way * 0.15 * wall
        assert float(end[0]) == pytest.approx(way * 0.25 * floor - wall, abs=1e-12)
    assert run.status == "completed"
    assert run.mode("foot") == ["stick"]


def test_band_of_a_force_that_holds_a_box():
    """W (sin α ∓ μ cos α), whatever the share of its corners."""
    run = mbody.statics(models.box(height=-0.25))
    band = run.range("pull")
    assert float(band.low[0]) == pytest.approx(15.195451311306424, abs=1e-12)
    assert float(band.high[0]) == pytest.approx(32.747102549113876, abs=1e-12)
    force = run.reaction("under")
    assert float(run.contact("under")[0]) == pytest.approx(50.0 * math.cos(0.5), abs=1e-12)
    assert float(np.hypot(force.fx, force.fy)[0]) == pytest.approx(50.0 * math.cos(0.5), abs=1e-12)


def test_a_box_that_would_tip_before_it_slides():
    """Drawn above μ h > a the band ends where the lower corner lifts: P h = W (a cos α + h′ sin α)
    about the upper one, h and h′ the heights of the hand and of the mass centre.
    """
    height = 1.2
    run = mbody.statics(models.box(mu=0.9, height=height))
    tips = 50.0 * (0.5 * math.cos(0.5) + 0.25 * math.sin(0.5)) / (height + 0.25)
    assert float(run.range("pull").high[0]) == pytest.approx(tips, abs=1e-11)
    assert tips < 50.0 * (math.sin(0.5) + 0.9 * math.cos(0.5))


def test_where_a_ladder_stands():
    """tan θ ≥ (1 − μ μ_w)/(2 μ); it does not lean on the other side of the wall."""
    found = mbody.equilibrium(mbody.from_toml(models.LADDER))
    least = math.atan((1.0 - 0.25 * 0.15) / 0.5)
    (stands,) = (band for band in found.bands if band.low["ladder"][1] > 0.0)
    ends = (stands.low["ladder"][2], stands.high["ladder"][2])
    angles = sorted(abs(math.remainder(one, math.tau)) for one in ends)
    assert angles == pytest.approx([0.5 * math.pi, math.pi - least], abs=1e-9)


def test_ropes_and_limits_and_stops_hold():
    run = mbody.statics(models.lamp())
    left, right = (float(run.contact(name)[0]) for name in ("left", "right"))
    a, b = math.atan2(1.2, 0.8), math.atan2(1.2, 1.2)
    assert left * math.sin(a) + right * math.sin(b) == pytest.approx(5.0 * G, abs=1e-12)
    assert left * math.cos(a) == pytest.approx(right * math.cos(b), abs=1e-12)
    door = Mechanism("door", ground={"hinge": (0.0, 0.0)})
    door.add(
        Body("door", mass=20.0, inertia=6.0, cg=(0.45, 0.0), points={"hinge": (0.0, 0.0)}),
        mbody.Revolute("hinge", "ground.hinge", "door.hinge", limits=(0.0, "110 deg")),
        mbody.TorsionSpring("closer", "door", stiffness=8.0, free_angle=-0.5),
    )
    shut = mbody.statics(door)
    assert float(shut.contact("hinge_low")[0]) == pytest.approx(4.0, abs=1e-14)
    ball = Mechanism("ball")
    ball.add(
        Body("ball", mass=1.0, inertia=0.1, points={"C": (0, 0)}, guess=(0.0, 0.1, 0.0)),
        Stop("floor", "ball.y - 0.1 m"),
        mbody.CoordinateDriver("across", "ground", "ball.C", 0.0),
        mbody.AngleDriver("turn", "ball", 0.0),
        mbody.Gravity("gravity", y=-G),
    )
    lies = mbody.statics(ball)
    assert float(lies.contact("floor")[0]) == pytest.approx(G, abs=1e-14)
    for one, name in ((shut, "door"), (lies, "ball"), (run, "lamp")):
        check_balance(one, name)


def check_balance(run, body):
    """The free body of a link at rest is in balance."""
    x, y = float(run[body].x[0]), float(run[body].y[0])
    every = [
        (w.fx, w.fy, w.torque + (w.x - x) * w.fy - (w.y - y) * w.fx)
        for w in mbody.free_body(run, body)
    ]
    assert np.abs(np.sum(every, axis=0)).max() < 1e-12


def test_what_would_have_to_pull_is_said():
    door = Mechanism("door", ground={"hinge": (0.0, 0.0)})
    door.add(
        Body("door", mass=20.0, inertia=6.0),
        mbody.Revolute("hinge", "ground.hinge", "door", limits=(0.0, None)),
        mbody.Torque("wind", "door", value=6.0),
    )
    run = mbody.statics(door)
    assert "contact 'hinge_low' would have to pull 'door' with 6 N·m" in run.notes[-1]
    lifted = models.lamp()
    lifted.add(mbody.Force("lift", "lamp.P", 60.0, angle="90 deg"))
    notes = mbody.statics(lifted).notes
    assert sum("would have to push" in note for note in notes) == 2


def test_what_is_nearly_closed_is_closed_and_said():
    text = models.HELD_LADDER.replace("sin(1 rad) m", "1.001*sin(1 rad) m")
    run = mbody.statics(mbody.from_toml(text))
    assert any("open where the guess puts its bodies, and is closed" in n for n in run.notes)
    assert -float(run.range("hold").high[0]) == pytest.approx(10.764630791962567, abs=1e-9)


def test_what_is_far_stays_open_and_the_sentence_says_how_far():
    machine = mbody.from_toml(models.HELD_LADDER.replace('y = "sin(1 rad) m"', 'y = "3 m"'))
    with pytest.raises(mbody.SolveError, match=r"or begin with '\w+' touching, which is .* open"):
        mbody.statics(machine)
    with pytest.raises(mbody.SolveError, match="which decides whether friction of 'foot'"):
        mbody.statics(mbody.from_toml(models.LADDER))


def test_a_motion_goes_on_from_rest():
    """What statics found is where a motion begins; below the friction angle it stays."""
    machine = models.box(mu=0.6)
    rest = mbody.statics(machine)
    free = machine.without("pull")
    x, y, angle = (float(getattr(rest["box"], key)[0]) for key in ("x", "y", "angle"))
    free.simulation = SimulationSettings(until=1.0, start={"box": {"x": x, "y": y, "angle": angle}})
    run = mbody.simulate(free)
    assert run.mode("under")[-1] == "stick"
    assert float(np.ptp(run["box"].x)) < 1e-13


def test_results_are_kept_and_written(tmp_path):
    machine = mbody.from_toml(models.HELD_LADDER)
    run = mbody.statics(machine)
    mbody.save_run(run, tmp_path / "run.npz")
    again = mbody.load_run(tmp_path / "run.npz")
    assert again.contact("foot") == run.contact("foot")
    assert again.range("hold").low == run.range("hold").low
    assert mbody.to_toml(run.mechanism) == mbody.to_toml(machine)
    data = run.data()
    assert data["modes"] == {"foot": ["stick"], "top": ["stick"]}
    assert set(data["reactions"]) == {"foot", "top"}
    assert data["ranges"]["efforts"]["hold"]["high"][0] == pytest.approx(-10.764630791962567)
    assert {"foot.fx [N]", "foot.contact [N]"} <= set(run.columns())
    assert "F12,foot" in str(run)


def test_other_engines_agree():
    for machine in (mbody.from_toml(models.HELD_LADDER), models.box(height=0.1), models.lamp()):
        found = mbody.crosscheck(machine, "balance,oracle", ours=mbody.statics(machine))
        assert found.agrees
        assert found.opinions["oracle"].rows


def three_discs():
    """Two discs on a floor and one on top of them, as groups of contacts."""
    pile = mbody.Mechanism("three discs", ground={"O": (0, 0)}, ground_shapes={"floor": LINE})
    places = {"a": (-0.05, 0.05), "b": (0.05, 0.05), "c": (0.0, 0.05 + 0.05 * np.sqrt(3.0))}
    for name, (x, y) in places.items():
        pile.add(
            mbody.Body(
                name, mass=2.0, inertia=2.5e-3, points={"C": (0, 0)},
                shapes={"rim": {"disc": "C", "radius": 0.05}}, guess=(x, y, 0.0),
            )
        )  # fmt: skip
    pile.add(mbody.Between("floor", "ground.floor", "*.rim", friction=0.6))
    pile.add(mbody.Between("discs", "*.rim", "*.rim", friction=0.6))
    pile.add(mbody.Gravity("gravity", y=-9.81))
    return pile


LINE = {"line": {"point": "O"}}


def test_a_group_of_contacts_is_measured_as_the_sum_of_its_contacts():
    """The floor carries all the weight, 6 kg · 9.81 N/kg, whatever is redundant."""
    run = mbody.statics(three_discs())
    assert run.measure("floor.contact")[0] == pytest.approx(58.86, rel=1e-12)
    reaction = run.reaction("floor")
    assert reaction.fy[0] == pytest.approx(58.86, rel=1e-12)
    # about the origin of the world, below the middle
    assert reaction.torque[0] == pytest.approx(0.0, abs=1e-9)
    assert reaction.on == "*.rim" and run.reaction("floor", on="ground.floor").fy[0] < 0.0
    assert run.contact("floor")[0] == pytest.approx(run.contact("floor_1")[0] * 2.0, rel=1e-9)


def test_the_summary_of_kinematics_has_what_touches_without_forces():
    run = mbody.kinematics(three_discs())
    text = str(run)
    assert "CONTACTS" in text and "greatest press" not in text
    with pytest.raises(mbody.ModelError, match="finds no forces"):
        run.reaction("floor")


@pytest.mark.parametrize("analysis", [mbody.kinematics, mbody.statics, mbody.kinetostatics])
def test_summaries_of_a_pile_of_the_gallery(analysis):
    """Whose measure is one of a group of contacts."""
    assert "carried" in str(analysis(mbody.gallery.load("pile_of_discs")))


def test_a_disc_in_a_bowl_rests_at_the_bottom_once():
    """It comes round to the same positions after four turns, further than one walk goes."""
    machine = models.rolling_disc(models.RING, 0.8 * math.sin(0.7), -0.8 * math.cos(0.7), 0.3)
    found = mbody.equilibrium(machine)
    assert found.status == "completed"
    assert [one.stability for one in found] == ["stable", "unstable"]
    assert found[0]["disc"].y[0] == pytest.approx(-0.8, abs=1e-12)
    # it rolls from 0.3 rad by (R − r)/r of 0.7 rad
    assert found[0]["disc"].angle[0] == pytest.approx(0.3 + 4.0 * 0.7, abs=1e-9)
    assert found[0].frequencies[0] == pytest.approx(math.sqrt(2.0 * G / (3.0 * 0.8)), rel=1e-9)
