"""Cams against the closed forms of textbooks: pressure angle, curvature, base circle, profile."""

import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, CamFollower, Marker, Mechanism, Prismatic, Revolute
from mbody.engineering import cam_analysis, cam_profile
from mbody.laws import Cam, ConstantSpeed, Dwell, Rise
from mbody.quantities import deg
from tests.support.frictional import cam_drive

TURN = 2.0 * math.pi
UP = deg(90.0)
BASE, ROLLER, LIFT = 0.04, 0.01, 0.02
#: Sums of a few numbers of the size of a cam.
CLOSE = 1e-11
#: A spline through points a quarter of a degree apart: the fourth derivative by 5/384 h⁴; its
#: second derivative has an error of h²/12 of the fourth, some 40 times the lift: 7e-5 of the lift.
SPLINE, BENT = 1e-8, 1e-4
SHAPES = ("cycloidal", "harmonic", "3-4-5", "4-5-6-7")


def program(shape, lift=LIFT):
    return Cam(
        [
            *(Rise(shape, lift, 0.0, deg(130.0)), Dwell(deg(30.0))),
            *(Rise(shape, -lift, 0.0, deg(110.0)),),
        ],
        period=TURN,
    )


def translating(profile, offset=0.0, speed=3.0, line=UP, **contact):
    machine = Mechanism("tappet")
    machine.add(
        Body("cam", mass=1.0, inertia=1e-3),
        Body("tappet", mass=0.5),
        Revolute("O", "ground", "cam"),
        Prismatic("guide", Marker("ground", (offset, 0.0), UP), Marker("tappet", (0.0, 0.0), UP)),
        CamFollower("contact", Marker("cam", (0.0, 0.0), line), "tappet", profile, **contact),
        AngleDriver("motor", "cam", ConstantSpeed(0.0, speed)),
    )
    return machine


def swinging(profile, arm, distance, radius, **contact):
    """The pivot on the right of the cam; at the start the roller is at the angle of the base."""
    inner = math.acos((arm**2 + distance**2 - radius**2) / (2.0 * arm * distance))
    line = np.angle(distance - arm * np.exp(-1j * inner))
    machine = Mechanism("arm", ground={"P": (distance, 0.0)})
    machine.add(
        Body("cam", mass=1.0, inertia=1e-3),
        Body("arm", mass=0.5, inertia=1e-4, points={"R": (-arm, 0.0)}, guess=-inner),
        Revolute("O", "ground", "cam"),
        Revolute("P", "ground.P", "arm"),
        CamFollower("contact", Marker("cam", (0.0, 0.0), line), "arm.R", profile, **contact),
        AngleDriver("motor", "cam", ConstantSpeed(0.0, 3.0)),
    )
    return machine


def lifted(law, theta):
    return np.array([law.derivatives(float(x)) for x in np.mod(theta, TURN)]).T


def greatest(of, law):
    """The greatest value of `of(s, s′, s″)` over a turn: at 2001 places, and around those that are
    greater than their neighbours at places a hundred times as dense.
    """
    theta, step = np.linspace(0.0, TURN, 2001, retstep=True)
    found = of(*lifted(law, theta))
    high = found >= found.max() - 0.05 * np.ptp(found)
    peaks = np.flatnonzero(high & (found >= np.roll(found, 1)) & (found > np.roll(found, -1)))
    near = (theta[peaks, None] + np.linspace(-step, step, 201)).ravel()
    return max(found.max(), of(*lifted(law, near)).max())


@pytest.mark.parametrize("shape", SHAPES)
def test_a_centred_roller_has_the_pressure_angle_and_the_curvature_of_the_books(shape):
    law = program(shape)
    run = mbody.kinematics(
        translating(law, base_radius=BASE, roller=ROLLER), turn=True, instants=181
    )
    found = cam_analysis(run, limit=deg(25.0))
    assert found.follower == "translating roller"
    s, s1, s2 = lifted(law, run["cam"].angle)
    R = BASE + ROLLER + s
    # where the harmonic rise begins s″ jumps, s′ does not
    assert np.abs(found.pressure_angle - np.arctan(s1 / R)).max() < CLOSE
    inside = np.abs(np.diff(s2, append=s2[0])) < 0.02
    rho = (R**2 + s1**2) ** 1.5 / (R**2 + 2.0 * s1**2 - R * s2) - ROLLER
    assert np.abs(1.0 / found.curvature - 1.0 / rho)[inside].max() < CLOSE / BASE**2
    # the greatest and the least anywhere, by a search on the formula
    pitch = BASE + ROLLER
    steepest = greatest(lambda s, s1, _: np.arctan(np.abs(s1) / (pitch + s)), law)
    assert found.greatest.value == pytest.approx(steepest, abs=1e-9)

    def bent(s, s1, s2):
        """1/rho."""
        return ((pitch + s) ** 2 + 2.0 * s1**2 - (pitch + s) * s2) / np.hypot(pitch + s, s1) ** 3

    sharpest = 1.0 / greatest(bent, law)
    assert found.pitch_sharpest.value == pytest.approx(sharpest, rel=1e-6)
    assert found.sharpest.value == pytest.approx(sharpest - ROLLER, rel=1e-6)
    # s + S ≥ |s′|/tan φ: 3601 instants leave some 1e-6 of the peaks on either side
    needed = greatest(lambda s, s1, _: np.abs(s1) / math.tan(deg(25.0)) - s, law) - ROLLER
    assert found.needed == pytest.approx(needed, rel=1e-5)


@pytest.mark.parametrize("speed", [3.0, -3.0])
@pytest.mark.parametrize("offset", [0.012, -0.012])
def test_an_offset_guide_has_the_pressure_angle_of_the_books(offset, speed):
    law = program("cycloidal")
    profile = cam_profile(law, BASE, roller=ROLLER, offset=offset)
    start = math.acos(offset / (BASE + ROLLER))
    machine = translating(profile, offset, speed, line=start, roller=ROLLER)
    run = mbody.kinematics(machine, turn=True, instants=181)
    # the follower does what it was to do
    rest = math.sqrt((BASE + ROLLER) ** 2 - offset**2)
    s, s1, s2 = lifted(law, run["cam"].angle)
    assert np.abs(run["tappet"].y - rest - s).max() < SPLINE * LIFT * 10.0
    found = cam_analysis(run, limit=deg(25.0))
    wanted = np.arctan((s1 - offset) / (rest + s)) * math.copysign(1.0, speed)
    assert np.abs(found.pressure_angle - wanted).max() < 1e-5
    # of the pitch curve in the cam's axes, p = d e^(−iθ)
    d = offset + 1j * (rest + s)
    p1, p2 = 1j * s1 - 1j * d, 1j * s2 + 2.0 * s1 - d
    rho = -(np.abs(p1) ** 3) / (np.conj(p1) * p2).imag - ROLLER
    assert np.abs(1.0 / found.curvature - 1.0 / rho).max() * BASE < BENT * 10.0
    middle = greatest(lambda s, s1, _: np.abs(s1 - offset) / math.tan(deg(25.0)) - s, law)
    assert found.needed == pytest.approx(math.hypot(middle, offset) - ROLLER, rel=2e-5)


def test_an_arm_has_the_pressure_angle_of_its_geometry():
    """tan φ of an arm: from the instant centre of cam and arm on the line of their pivots."""
    arm, distance = 0.08, 0.1
    law = program("3-4-5", 0.25)
    profile = cam_profile(law, BASE, roller=ROLLER, arm=arm, centre_distance=distance)
    machine = swinging(profile, arm, distance, BASE + ROLLER, roller=ROLLER)
    run = mbody.kinematics(machine, turn=True, instants=181)
    s, s1, _ = lifted(law, run["cam"].angle)
    turned = run["arm"].angle - run["arm"].angle[0]
    assert np.abs(turned + s).max() < 1e-8
    found = cam_analysis(run, limit=deg(35.0))
    assert found.follower == "swinging roller"
    # ω_arm (I − P) = ω_cam (I − O) at the instant centre I; the normal goes through it
    ratio = -s1
    centre = -ratio * distance / (1.0 - ratio)
    place = run.point("arm.R").x + 1j * run.point("arm.R").y
    normal, way = place - centre, 1j * (place - distance)
    wanted = np.arccos(np.abs((normal * np.conj(way)).real) / np.abs(normal) / np.abs(way))
    assert np.abs(np.abs(found.pressure_angle) - wanted).max() < 1e-5
    # a cam with the base radius that was found has that greatest pressure angle
    again = cam_profile(law, found.needed, roller=ROLLER, arm=arm, centre_distance=distance)
    machine = swinging(again, arm, distance, found.needed + ROLLER, roller=ROLLER)
    proof = cam_analysis(mbody.kinematics(machine, turn=True, instants=361))
    assert proof.greatest.value == pytest.approx(deg(35.0), abs=2e-5)


def test_a_flat_face_has_the_curvature_of_the_books():
    law = program("cycloidal")
    contact = {"flat": True, "base_radius": 0.09}
    machine = translating(law, **contact)
    face = machine["contact"]
    machine = Mechanism("flat")
    own = replace(face, j=Marker("tappet", (0.0, 0.0), 0.0))
    machine.add(*(own if one.name == "contact" else one for one in translating(law, **contact)))
    run = mbody.kinematics(machine, turn=True, instants=181)
    found = cam_analysis(run, limit=deg(5.0))
    s, _, s2 = lifted(law, run["cam"].angle)
    assert np.abs(found.curvature - (0.09 + s + s2)).max() < CLOSE
    assert np.abs(found.pressure_angle).max() < CLOSE
    sharpest = greatest(lambda s, _, s2: -(s + s2), law)
    assert found.sharpest.value == pytest.approx(0.09 - sharpest, rel=1e-6)
    assert found.uncut == pytest.approx(sharpest, rel=1e-5)
    ends = -greatest(lambda _, s1, __: -s1, law), greatest(lambda _, s1, __: s1, law)
    assert found.face == pytest.approx(ends, rel=1e-6)


@pytest.mark.parametrize("kind", ["roller", "flat", "edge"])
@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("arm", [False, True])
def test_base_circles_are_of_the_same_pressure_angles_and_curvatures(kind, clockwise, arm):
    """The path of the follower gives what the joint itself gives, by another way."""
    from mbody.engineering.cam_limits import follower_path

    run = mbody.kinematics(cam_drive(kind, arm, clockwise), turn=True, instants=241)
    found = cam_analysis(run)
    path = follower_path(run, run.mechanism["cam"])
    assert np.abs(path.pressure_angle() - np.abs(found.pressure_angle)).max() < 1e-7
    assert path.base_radius() == pytest.approx(found.base_radius, rel=1e-3)
    # 240 places of the pitch curve
    assert path.clearance() == pytest.approx(found.sharpest.value, rel=1e-3)


def test_the_contour_is_as_far_from_the_pitch_curve_as_the_roller_is_wide(tmp_path, capsys):
    from mbody.cli import main

    run = mbody.kinematics(mbody.gallery.load("cam_follower"), turn=True)
    table = cam_analysis(run).contour(721)
    gap = np.hypot(table[:, 1] - table[:, 3], table[:, 2] - table[:, 4])
    assert np.abs(gap - 10.0).max() < CLOSE * 10.0
    # the radius of curvature of the points themselves
    edge = table[:-1, 1] + 1j * table[:-1, 2]
    a, b, c = np.roll(edge, 1), edge, np.roll(edge, -1)
    area = ((b - a) * np.conj(c - a)).imag / 2.0
    bent = 4.0 * area / (np.abs(b - a) * np.abs(c - b) * np.abs(c - a))
    assert np.abs(bent - 1.0 / table[:-1, 5]).max() < 2e-3
    file = tmp_path / "cam.csv"
    assert main(["cam", "cam_follower", "--csv", str(file), "--points", "73", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["greatest_pressure_angle"]["value"] == pytest.approx(21.9416, abs=1e-4)
    with file.open() as text:
        rows = list(csv.reader(text))
    assert rows[0][0] == "psi [rad]"
    assert np.allclose(np.array(rows[1:], dtype=float)[:, 1:5], table[::10, 1:5], atol=1e-12)
