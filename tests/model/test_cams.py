"""Cams and their followers against closed forms and the oracle; where undercutting begins."""

import math
import re

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    CamFollower,
    Force,
    Gravity,
    Marker,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    Spring,
    Torque,
)
from mbody.engines.oracle import Reference
from mbody.files.model import in_units
from mbody.laws import Cam, ConstantSpeed, Dwell, Harmonic, Rise, Table
from mbody.quantities import deg
from tests.support.agreement import assert_agrees
from tests.support.model_text import model_from, text_from

# closed loops leave 1e-13 of their size, forces the same times a condition below 10
CLOSE = 1e-12
TURN = 2.0 * math.pi
#: Rise 120°, dwell 30°, return 90°, dwells of 60° before and after.
PROGRAM = Cam(
    [
        *(Dwell(deg(60.0)), Rise("cycloidal", 0.02, 0.0, deg(120.0))),
        *(Dwell(deg(30.0)), Rise("3-4-5", -0.02, 0.0, deg(90.0))),
    ],
    period=TURN,
)
UP = deg(90.0)


def tappet(law=PROGRAM, *, offset=0.0, speed=10.0, stiffness=200.0, **contact):
    """A follower on a vertical guide above its cam, whose line of 0 points at it at the start."""
    machine = Mechanism("tappet")
    machine.add(
        Body("cam", mass=1.0, inertia=1e-3),
        Body("tappet", mass=0.5),
        Revolute("O", "ground", "cam"),
        Prismatic("guide", Marker("ground", (offset, 0.0), UP), Marker("tappet", (0.0, 0.0), UP)),
        CamFollower("contact", Marker("cam", (0.0, 0.0), UP), "tappet", law, **contact),
        AngleDriver("motor", "cam", ConstantSpeed(0.0, speed)),
        Spring("spring", Marker("ground", (offset, 0.3)), "tappet", stiffness, free_length=0.3),
    )
    return machine


@pytest.mark.parametrize("instants", [25, 721])  # the scalar path, and lanes
@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("follower", [{"flat": True}, {"roller": 0.01}, {}])
def test_a_translating_follower_moves_by_its_lift_law(follower, clockwise, instants):
    speed = -10.0 if clockwise else 10.0
    machine = tappet(speed=speed, base_radius=0.04, clockwise=clockwise, **follower)
    run = mbody.kinetostatics(machine, turn=True, instants=instants)
    s, v, a = PROGRAM.derivatives(np.mod(np.abs(run["cam"].angle), TURN))
    tappet_ = run["tappet"]
    assert tappet_.y == pytest.approx(0.04 + follower.get("roller", 0.0) + s, abs=CLOSE)
    assert tappet_.vy == pytest.approx(10.0 * v, abs=10.0 * CLOSE)
    assert tappet_.ay == pytest.approx(100.0 * a, abs=100.0 * CLOSE)
    # the cam lifts against inertia and spring; its torque has no other work to do
    lifting = 0.5 * tappet_.ay + 200.0 * tappet_.y
    contact = run.reaction("contact")
    top = np.abs(lifting).max()
    assert contact.fy == pytest.approx(lifting, abs=1e-10 * top)
    assert run.effort("motor") == pytest.approx(lifting * 10.0 * v / speed, abs=1e-10 * top)
    assert np.abs(contact.torque).max() < 1e-10 * top * 0.1
    # a roller is pushed along the normal of its pitch curve, whose slope is s′/R
    slope = 0.0 if "flat" in follower else v / tappet_.y
    assert run.contact("contact") == pytest.approx(lifting * np.hypot(1.0, slope), abs=1e-10 * top)
    assert not run.notes


def polar_circle(e, r):
    """Polar equation of a circle of radius r whose centre lies at e on the line of 0."""
    return mbody.laws.Function(
        lambda x: e * np.cos(x) + np.sqrt(r * r - (e * np.sin(x)) ** 2), scale=0.5
    )


def test_an_eccentric_circle_is_a_crank_and_connecting_rod():
    """A roller on a circle, offset guide: the slider of a crank e and a rod r + r_roller."""
    e, rod, offset, mass = 0.012, 0.05, 0.006, 0.5
    law = polar_circle(e, rod)
    machine = tappet(law, offset=offset, stiffness=1e-9, roller=0.01)
    run = mbody.kinetostatics(machine, turn=True, instants=181)
    slider = Mechanism("slider")
    slider.add(
        Body("crank", points={"A": (e, 0.0)}),
        Body("rod", points={"B": (rod, 0.0)}, guess=UP),
        Body("slider", mass=mass),
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.A", "rod"),
        Revolute("B", "rod.B", "slider"),
        Prismatic("guide", Marker("ground", (offset, 0.0), UP), Marker("slider", (0.0, 0.0), UP)),
        AngleDriver("motor", "crank", ConstantSpeed(UP, 10.0)),
    )
    wanted = mbody.kinetostatics(slider, turn=True, instants=181)
    assert run["tappet"].y == pytest.approx(wanted["slider"].y, abs=CLOSE)
    assert run["tappet"].ay == pytest.approx(wanted["slider"].ay, abs=1e3 * CLOSE)
    pin, contact = wanted.reaction("B"), run.reaction("contact")
    top = pin.magnitude.max()
    assert contact.fx == pytest.approx(pin.fx, abs=1e-9 * top)
    assert contact.fy == pytest.approx(pin.fy, abs=1e-9 * top)


def test_a_circle_seen_by_a_flat_face_is_harmonic():
    """The support function of a circle off its centre is a harmonic, whatever the face does."""
    e, r = 0.012, 0.05
    machine = Mechanism("swinging face", ground={"P": (0.12, 0.04)})
    circle = Harmonic(mean=r, amplitude=e, frequency=1.0, phase=UP)
    machine.add(
        Body("cam", points={"M": (e, 0.0)}),
        Body("lever", mass=0.3, inertia=0.01, cg=(-0.1, 0.0), guess=0.0),
        Revolute("O", "ground", "cam"),
        Revolute("P", "ground.P", "lever"),
        CamFollower("contact", "cam", "lever", circle, flat=True),
        AngleDriver("motor", "cam", ConstantSpeed(0.3, 12.0)),
        Torque("spring", "lever", value=4.0),
    )
    run = mbody.kinetostatics(machine, turn=True, instants=121)
    centre, angle = run.point("cam.M"), run["lever"].angle
    # the distance of the circle's centre from the face is the radius
    nx, ny = -np.sin(angle), np.cos(angle)
    away = nx * (0.12 - centre.x) + ny * (0.04 - centre.y)
    assert away == pytest.approx(r, abs=CLOSE)
    # and the force of contact goes through that centre, so that the cam's torque is F × OM
    contact = run.reaction("contact", on="cam")
    turning = centre.x * contact.fy - centre.y * contact.fx
    assert run.effort("motor") == pytest.approx(-turning, abs=1e-9 * np.abs(turning).max())


def mixed():
    """A cam on a carrier lifts a lever by a roller; a second cam, on the lever, pushes a face."""
    first = Harmonic(mean=0.6, amplitude=0.05, frequency=2.0, phase=0.4)
    second = Table(
        np.linspace(0.0, TURN, 13), 0.02 * np.sin(np.linspace(0, TURN, 13)), periodic=True
    )
    machine = Mechanism("cams on bodies that move", ground={"A": (0.0, 0.0), "B": (2.0, 0.3)})
    machine.add(
        Body("carrier", mass=2.0, inertia=0.5, cg=(0.1, 0.2), points={"C": (0.6, 0.1)}),
        Body("cam", mass=1.0, inertia=0.2, cg=(0.05, 0.02)),
        Body("lever", mass=1.5, inertia=0.8, cg=(-0.5, 0.1), points={"E": (-1.2, 0.1)}, guess=-0.3),
        Body("plate", mass=0.7, inertia=0.1, cg=(0.1, 0.2), guess=(2.2, 1.2, 0.0)),
        Revolute("A", "ground.A", "carrier"),
        Revolute("C", "carrier.C", "cam"),
        Revolute("B", "ground.B", "lever"),
        CamFollower("one", Marker("cam", (0.01, 0.02), 0.7), "lever.E", first, roller=0.05),
        Prismatic("guide", Marker("ground", (2.2, 0.0), 1.4), Marker("plate", (0.1, 0.0), 1.5)),
        CamFollower(
            "two",
            Marker("lever", (0.1, 0.0), -0.2),
            Marker("plate", (0.2, 0.1), 0.15),
            second,
            base_radius=0.4,
            flat=True,
            clockwise=True,
        ),
        AngleDriver("swing", "carrier", mbody.laws.ConstantAcceleration(0.2, 0.5, 0.1)),
        AngleDriver("motor", "cam", ConstantSpeed(0.1, 3.0), relative_to="carrier"),
        Gravity("gravity", y=-9.81),
        Force("push", "plate", 3.0, angle=-2.0),
        Torque("load", "lever", value=2.0),
    )
    return machine


def test_the_oracle_agrees_on_cams_of_every_kind():
    machine = mixed()
    oracle, t = Reference(machine), np.linspace(0.0, 1.6, 17)
    run = mbody.kinetostatics(machine, t=t)
    for k in (0, 5, 11, 16):
        assert_agrees(oracle, run, k)
    assert run.checks.virtual_work < 1e-11


def test_profiles_of_every_kind_of_law_are_one_profile():
    x = np.linspace(0.0, TURN, 721)
    laws = [
        Harmonic(0.05, 0.01, 1.0, UP),
        "0.05 m + 0.01 m*cos(x)",
        lambda x: 0.05 + 0.01 * np.cos(x),
        # a cubic spline of 720 intervals: error 5/384 h⁴ f⁗ = 8e-13
        Table(x, 0.05 + 0.01 * np.cos(x), periodic=True),
    ]
    runs = [mbody.kinetostatics(tappet(law, offset=0.01), turn=True, instants=50) for law in laws]
    wanted = 200.0 * runs[0]["tappet"].y + 0.5 * runs[0]["tappet"].ay
    for run in runs:
        assert run["tappet"].y == pytest.approx(runs[0]["tappet"].y, abs=1e-12)
        # its second derivative is off by h²/12 f⁗ = 6e-8 of 1, forces by as much
        assert run.reaction("contact").fy == pytest.approx(wanted, abs=1e-5)


def test_a_follower_that_would_leave_its_cam_is_told():
    run = mbody.kinetostatics(tappet(base_radius=0.04, stiffness=0.0), turn=True)
    # on its own it is pulled wherever the law decelerates upwards
    pulled = run["tappet"].ay < -1e-9
    assert (run.contact("contact")[pulled] < 0.0).all()
    assert len(run.notes) == 1
    # between the instants too, where it is a little more
    most = -mbody.kinetostatics(run.mechanism, turn=True, instants=36001).contact("contact").min()
    told = re.search(r"contact 'contact' would have to pull 'tappet' with (\S+) N", run.notes[0])
    assert -run.contact("contact").min() < float(told[1]) == pytest.approx(most, rel=1e-4)
    assert f"at {pulled.sum()} of 361 instants" in run.notes[0]
    assert "'tappet' would leave 'cam'" in run.notes[0]
    with pytest.raises(ModelError, match="'guide' is a Prismatic, no contact that presses"):
        run.contact("guide")


def test_undercutting_begins_where_the_radius_of_curvature_ends():
    # three lobes of height 2a on a base circle b: at their tops f″ = −9 a
    a, b = 0.01, 0.06
    law = Harmonic(mean=a, amplitude=a, frequency=3.0, phase=UP)
    # flat face: h + h″ = b + 2a − 9a there
    mbody.assemble(tappet(law, flat=True, base_radius=7.001 * a))
    with pytest.raises(ModelError, match="undercuts its flat follower") as caught:
        mbody.assemble(tappet(law, flat=True, base_radius=5.0 * a))
    assert "is -0.02 m at 0 deg: raise base_radius by more than 0.02 m" in str(caught.value)
    # roller r: the pitch curve has R²/(R + 9a) = r there, R = c + r, c = b + 2a: r (9a − c) = c²
    c = b + 2.0 * a
    edge = c * c / (9.0 * a - c)
    system = mbody.assemble(tappet(law, roller=edge - 1e-4, base_radius=b))
    with pytest.raises(ModelError, match="undercuts its roller of") as caught:
        system.with_values({"contact.roller": [0.02, 1.25 * edge]})
    # as much base as it says will do, a thousandth less will not
    more = float(str(caught.value).partition("more than ")[2].partition(" m")[0])
    roller = 1.25 * edge
    mbody.assemble(tappet(law, roller=roller, base_radius=b + 1.001 * more))
    with pytest.raises(ModelError, match="undercuts"):
        mbody.assemble(tappet(law, roller=roller, base_radius=b + 0.999 * more))


def test_files_keep_a_cam():
    machine = tappet(base_radius=0.04, roller=0.01, clockwise=True)
    for as_json in (False, True):
        text = text_from(machine, as_json)
        again = model_from(text, as_json)
        assert again == machine
    assert "cam_follower" in text
    inches = in_units(machine, "in-lbf-s")
    run, other = mbody.kinetostatics(machine, t=0.2), mbody.kinetostatics(inches, t=0.2)
    assert other["tappet"].y[0] * 0.0254 == pytest.approx(run["tappet"].y[0], rel=1e-12)
    assert other.contact("contact")[0] * 4.4482216152605 == pytest.approx(
        run.contact("contact")[0], rel=1e-9
    )
