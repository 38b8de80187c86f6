"""Internal loads of links and their stress, against closed forms and the link's own balance."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import makers
from mbody.engineering import internal_loads
from mbody.laws import ConstantAcceleration, ConstantSpeed
from mbody.model.body import RectangleSection, RoundSection, TubeSection
from tests.support.linkages import random_linkage, times_within

#: Equilibrium of a link by joint forces that are known to rounding.
BALANCED = 1e-12


def turning_rod(law, *more, mass=3.0, length=2.0):
    machine = mbody.Mechanism("a rod that turns")
    machine.add(
        makers.bar("rod", length, mass=mass, ends=("O", "P")),
        mbody.Revolute("O", "ground", "rod.O"),
        mbody.AngleDriver("motor", "rod", law),
        *more,
    )
    return machine


# -- closed forms ---------------------------------------------------------------------------------


def test_a_rod_that_turns_at_constant_speed():
    """N(s) = ½ m ω²/l (l² − s²): what is beyond the cut pulls."""
    m, length, w = 3.0, 2.0, 10.0
    run = mbody.kinetostatics(turning_rod(ConstantSpeed(0.4, w)))
    found = internal_loads(run, "rod", ("O", "P"))
    s = found.place
    assert s[0] == 0.0 and s[-1] == length and not found.lumped
    closed = 0.5 * m * w * w / length * (length**2 - s**2)
    assert_allclose(found.axial[0], closed, rtol=0, atol=BALANCED * closed[0])
    assert np.abs(found.shear).max() < BALANCED * closed[0]
    assert np.abs(found.bending).max() < BALANCED * closed[0]
    assert found.closure < BALANCED


def test_a_rod_that_is_accelerated():
    """The motor's couple bends the rod at its pin: V and M of an inertia load that grows as s.

    q = −m α s/l;  V(s) = m α (l² − s²)/(2 l),  M(s) = −∫ₛ V: −m α (2 l³ − 3 l² s + s³)/(6 l).
    """
    m, length, alpha = 3.0, 2.0, 7.0
    run = mbody.kinetostatics(turning_rod(ConstantAcceleration(0.0, 0.0, alpha)))
    found = internal_loads(run, "rod", ("O", "P"))
    s = found.place
    shear = m * alpha * (length**2 - s**2) / (2.0 * length)
    bending = -m * alpha * (2.0 * length**3 - 3.0 * length**2 * s + s**3) / (6.0 * length)
    size = float(np.abs(bending).max())
    assert_allclose(found.shear[0], shear, rtol=0, atol=BALANCED * size)
    assert_allclose(found.bending[0], bending, rtol=0, atol=BALANCED * size)
    # at the pin the whole torque of the motor, m l² α/3
    assert found.bending[0, 0] == pytest.approx(-m * length**2 * alpha / 3.0, rel=1e-12)
    assert found.bending[0, 0] == pytest.approx(-run.effort("motor")[0], rel=1e-12)


def test_a_beam_on_two_supports():
    """Its own weight and a force: q l²/8 and the moment F a b/l (Beer and Johnston)."""
    m, length, g, force, a = 4.0, 2.0, 9.81, 50.0, 0.5
    machine = mbody.Mechanism("beam", ground={"A": (0.0, 0.0), "B": (length, 0.0)})
    machine.add(
        mbody.Body(
            "beam",
            mass=m,
            inertia=m * length**2 / 12.0,
            cg=(length / 2.0, 0.0),
            points={"A": (0.0, 0.0), "B": (length, 0.0), "P": (a, 0.0)},
        ),
        mbody.Revolute("A", "ground.A", "beam.A"),
        mbody.PinSlot("B", mbody.Marker("ground", "B", 0.0), "beam.B"),
        mbody.Force("F", "beam.P", force, angle=-math.pi / 2.0),
        mbody.Gravity("g", y=-g),
    )
    found = internal_loads(mbody.statics(machine), "beam")
    assert found.along == ("A", "B")
    s, q = found.place, m * g / length
    b = length - a
    bending = (
        q * s * (length - s) / 2.0
        + np.where(s <= a, force * b * s, force * a * (length - s)) / length
    )
    assert_allclose(found.bending[0], bending, rtol=0, atol=BALANCED * bending.max())
    # the shear jumps by the force, just before and just after its place
    jump = np.flatnonzero(s == a)
    assert jump.size == 2
    assert np.diff(found.shear[0, jump])[0] == pytest.approx(-force, rel=1e-12)
    assert found.shear[0, 0] == pytest.approx(q * length / 2.0 + force * b / length, rel=1e-12)
    moving = internal_loads(mbody.kinetostatics(machine), "beam")
    assert_allclose(moving.bending, found.bending, rtol=0, atol=BALANCED * bending.max())


def test_a_coupler_that_is_flung():
    """A parallelogram's coupler translates: all of it has the acceleration r ω², and it is a simply
    supported beam under that load, as the side rod of a locomotive: M = q l²/8 in the middle.
    """
    r, length, m, w = 0.3, 1.5, 60.0, 25.0
    machine = makers.four_bar(r, length, r, length, masses=(0, m, 0), start=math.pi / 2.0, speed=w)
    run = mbody.kinetostatics(machine)
    found = internal_loads(run, "coupler", places=201)
    middle = int(np.abs(found.place - length / 2.0).argmin())
    q = m * r * w * w / length  # downwards is towards the crank's centre: the load is upwards
    assert found.bending[0, middle] == pytest.approx(-q * length**2 / 8.0, rel=1e-12)
    assert found.shear[0, 0] == pytest.approx(-q * length / 2.0, rel=1e-12)
    assert found.shear[0, -1] == pytest.approx(q * length / 2.0, rel=1e-12)


def test_a_connecting_rod_under_its_own_inertia():
    """The transverse load is −λ a_t, integrated twice by the trapezoidal rule on many places."""
    machine = makers.slider_crank(0.1, 0.4, masses=(0, 2, 3), speed=80.0, start=1.2)
    run = mbody.kinetostatics(machine)
    found = internal_loads(run, "rod", places=2001)
    s = np.linspace(0.0, 0.4, 20001)
    h = run["rod"]
    c, sn = math.cos(h.angle[0]), math.sin(h.angle[0])
    off = s - 0.2
    across = -sn * h.ax[0] + c * h.ay[0] + h.alpha[0] * off
    along = c * h.ax[0] + sn * h.ay[0] - h.omega[0] ** 2 * off
    load, pull = -2.0 / 0.4 * across, -2.0 / 0.4 * along
    pin = run.reaction("A", on="rod")
    v0 = -sn * pin.fx[0] + c * pin.fy[0]
    n0 = -(c * pin.fx[0] + sn * pin.fy[0])
    step = s[1]
    shear = v0 + np.concatenate([[0.0], np.cumsum((load[1:] + load[:-1]) / 2.0 * step)])
    axial = n0 - np.concatenate([[0.0], np.cumsum((pull[1:] + pull[:-1]) / 2.0 * step)])
    bending = np.concatenate([[0.0], np.cumsum((shear[1:] + shear[:-1]) / 2.0 * step)])
    # loads are linear in s: the rule is exact for the forces, and of the moment off by q h²/12 l
    size = float(np.abs(shear).max())
    assert_allclose(found.shear[0], np.interp(found.place, s, shear), rtol=0, atol=1e-6 * size)
    assert_allclose(found.axial[0], np.interp(found.place, s, axial), rtol=0, atol=1e-6 * abs(n0))
    assert_allclose(found.bending[0], np.interp(found.place, s, bending), rtol=0, atol=1e-6 * size)


# -- the balance of the whole link ----------------------------------------------------------------


@pytest.mark.parametrize(
    "linkage", [(0, 3, {}), (0, 3, {"sliders": True}), (1, 4, {"extras": True})], ids=str
)
def test_every_link_closes(linkage):
    """Loads of every kind, joints beside the bar, moving slots: behind the last place nothing is
    left, and the ends carry the joint forces.
    """
    seed, loops, more = linkage
    machine, turn = random_linkage(seed, loops, **more)
    run = mbody.kinetostatics(machine, times_within(machine, 0.9 * turn, 5))
    checked, worst = 0, 0.0
    for body in machine.bodies:
        names = list(body.points)
        pairs = [(a, b) for a in names for b in names if a < b]
        for pair in pairs[:2]:
            a, b = (run.system.numbers.point(f"{body.name}.{n}") for n in pair)
            if math.hypot(a[0] - b[0], a[1] - b[1]) < 1e-3:
                continue
            for lumped in (False, True):
                found = internal_loads(run, body.name, pair, lumped=lumped)
                worst = max(worst, found.closure)
                checked += 1
    assert worst < BALANCED
    assert checked >= 10


def test_a_mass_beside_the_bar_and_a_spring():
    """An arm across, weights and a spring: the moment at the clamp by hand."""
    machine = mbody.Mechanism("arm", ground={"T": (1.0, 1.0)})
    machine.add(
        mbody.Body(
            "arm",
            mass=2.0,
            inertia=0.05,
            cg=(0.5, 0.2),
            points={"O": (0.0, 0.0), "P": (1.0, 0.0), "Q": (0.7, -0.1)},
        ),
        mbody.Revolute("O", "ground", "arm.O"),
        mbody.AngleDriver("hold", "arm", ConstantSpeed(0.0, 0.0)),
        mbody.Gravity("g", y=-10.0),
        mbody.Spring("spring", "ground.T", "arm.P", stiffness=30.0, free_length=0.5),
        mbody.Force("push", "arm.Q", 8.0, angle=0.0),
        mbody.Torque("twist", "arm", value=3.0),
    )
    found = internal_loads(mbody.statics(machine), "arm", ("O", "P"))
    # beyond the clamp: 2·10 at 0.5, the spring's 15 up at 1, 8 along, 0.1 below the bar;
    # the couples of motor and load act at the pin: before the first place
    assert found.shear[0, 0] == pytest.approx(20.0 - 15.0, rel=1e-12)
    assert found.axial[0, 0] == pytest.approx(8.0, rel=1e-12)
    beyond = 20.0 * 0.5 - 15.0 * 1.0 - 8.0 * 0.1
    assert found.bending[0, 0] == pytest.approx(-beyond, rel=1e-12)
    assert found.closure < BALANCED


# -- masses ---------------------------------------------------------------------------------------


def test_a_link_with_heavy_ends_is_a_lump():
    """No density between the ends has the inertia of two masses at them: a note says so."""
    dumbbell = mbody.Body(
        "rod", mass=2.0, inertia=2.0, cg=(1.0, 0.0), points={"O": (0.0, 0.0), "P": (2.0, 0.0)}
    )
    machine = mbody.Mechanism("dumbbell")
    machine.add(
        dumbbell,
        mbody.Revolute("O", "ground", "rod.O"),
        mbody.AngleDriver("motor", "rod", ConstantSpeed(0.0, 3.0)),
    )
    found = internal_loads(mbody.kinetostatics(machine), "rod", ["O", "P"])
    assert found.lumped and "lump at its mass centre" in found.notes[-1]
    assert_allclose(found.axial[0], np.where(found.place < 1.0, 18.0, found.axial[0]), rtol=1e-12)
    assert found.axial[0, -1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("place", "inertia"), [(1.0, 1.0), (1.2, 0.9), (0.95, 0.85)])
def test_a_density_has_the_moments_of_the_link(place, inertia):
    from mbody.engineering.internal_loads import link_mass

    mass = link_mass(3.0, inertia, place, 0.0, 2.0, False)
    assert mass.density is not None
    s = np.linspace(0.0, 2.0, 200_001)
    density = np.polynomial.polynomial.polyval(s, mass.density)
    assert density.min() > -1e-9
    for power, wanted in ((0, 3.0), (1, 3.0 * place), (2, inertia + 3.0 * place**2)):
        assert np.trapezoid(density * s**power, s) == pytest.approx(wanted, rel=1e-9)


# -- stress ---------------------------------------------------------------------------------------


def clamped(section):
    """A rod turned by a motor, with a section: the clamp carries N, V and M."""
    rod = makers.bar("rod", 2.0, mass=3.0, ends=("O", "P"))
    from dataclasses import replace

    machine = mbody.Mechanism("clamped")
    machine.add(
        replace(rod, section=section),
        mbody.Revolute("O", "ground", "rod.O"),
        mbody.AngleDriver("motor", "rod", ConstantAcceleration(0.0, 4.0, 7.0)),
    )
    return mbody.kinetostatics(machine)


SECTIONS = {
    "rectangle": (
        RectangleSection(0.02, 0.008, ("O", "P")),
        1.6e-4,
        0.008 * 0.02**3 / 12,
        0.01,
        1.5,
    ),
    "round": (
        RoundSection("30 mm", ("O", "P")),
        math.pi * 0.03**2 / 4,
        math.pi * 0.03**4 / 64,
        0.015,
        4 / 3,
    ),
    "tube": (
        TubeSection(0.04, 0.03, ("O", "P")),
        math.pi * (0.04**2 - 0.03**2) / 4,
        math.pi * (0.04**4 - 0.03**4) / 64,
        0.02,
        4 / 3 * (0.04**2 + 0.04 * 0.03 + 0.03**2) / (0.04**2 + 0.03**2),
    ),
}


@pytest.mark.parametrize("kind", SECTIONS)
def test_stress_by_the_formula(kind):
    section, area, second, fibre, factor = SECTIONS[kind]
    found = internal_loads(clamped(section), "rod")
    stress = found.stress()
    n, v, m = found.axial[0, 0], found.shear[0, 0], found.bending[0, 0]
    # of a bent rod that turns counter-clockwise faster: the left side is in tension at the clamp
    assert m < 0.0 < stress.upper[0, 0]
    assert stress.upper[0, 0] == pytest.approx(n / area - m * fibre / second, rel=1e-12)
    assert stress.lower[0, 0] == pytest.approx(n / area + m * fibre / second, rel=1e-12)
    assert stress.shear[0, 0] == pytest.approx(factor * v / area, rel=1e-12)
    outer = max(abs(stress.upper[0, 0]), abs(stress.lower[0, 0]))
    middle = math.hypot(n / area, math.sqrt(3.0) * factor * v / area)
    assert stress.equivalent[0, 0] >= max(outer, middle) * (1.0 - 1e-12)
    assert stress.equivalent[0, 0] == pytest.approx(max(outer, middle), rel=0.05)
    other = found.stress(RoundSection(0.03))
    assert other.shear[0, 0] == pytest.approx(4 / 3 * v / (math.pi * 0.03**2 / 4), rel=1e-12)


def test_a_tube_is_between_a_circle_and_a_thin_ring():
    """V Q/(I t): 4/3 of a full circle, 2 of a thin ring; and A, I by other formulas."""
    full = RoundSection(0.04).properties({"diameter": 0.04})
    nearly = TubeSection(0.04, 1e-9).properties({"outer": 0.04, "inner": 1e-9})
    assert_allclose(nearly, full, rtol=1e-7)
    area, second, _, factor = TubeSection(1.0, 0.999).properties({"outer": 1.0, "inner": 0.999})
    assert factor == pytest.approx(2.0, rel=1e-3)
    assert area == pytest.approx(math.pi * 0.0005, rel=1e-3)
    assert second == pytest.approx(math.pi * 0.0005 / 8.0, rel=2e-3)


def test_sections_in_files():
    """They come back, follow parameters, and go into other units."""
    text = """
name = "arm"
units = "mm-N-s"
[parameters]
h = "20 mm"
[bodies]
arm = { mass = 1, points = { O = [0, 0], P = [100, 0] }, section = { rectangle = ["h", 8] } }
two = { points = { A = [0, 0], B = [9, 0] }, section = { tube = ["5 mm", 3], along = ["A", "B"] } }
pin = { section = { round = "0.5 in" } }
[joints]
O = { revolute = ["ground", "arm.O"] }
"""
    machine = mbody.from_toml(text)
    assert machine["arm"].section == RectangleSection(20.0, 8.0)
    assert machine["two"].section == TubeSection(5.0, 3.0, ("A", "B"))
    assert machine["pin"].section.diameter == pytest.approx(12.7)
    assert mbody.from_toml(mbody.to_toml(machine)) == machine
    assert 'section = { rectangle = ["h", 8' in mbody.to_toml(machine)
    values = mbody.assemble(machine).with_values(h=[10.0, 30.0]).values
    assert values["arm.section.height"].tolist() == [10.0, 30.0]
    assert mbody.files.model.in_units(machine, "SI")["two"].section.outer == pytest.approx(0.005)
