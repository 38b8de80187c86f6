"""How far a driver can go: dead centres in closed form."""

import math

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    DistanceDriver,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    SolveError,
    driver_range,
    gallery,
    makers,
)
from mbody.analysis.driven import dead_centres
from mbody.analysis.driven.dead_centres import DriverRange
from mbody.laws import ConstantSpeed

pytestmark = pytest.mark.processor

# x is flat at its turning point: what remains is rounding of some radians or lengths
EXACT = 1e-12


def side(a, b, c):
    """Angle between sides a and b of a triangle whose third one is c."""
    return math.acos((a * a + b * b - c * c) / (2.0 * a * b))


@pytest.mark.parametrize("start", [60.0, 90.0, 180.0, 270.0, 311.0])
def test_a_crank_that_only_swings(start):
    """6, 18, 12 on 8: coupler and rocker fold at arccos(2/3) to either side."""
    limits = driver_range(makers.four_bar(6, 18, 12, 8, start=math.radians(start)))
    toggle = math.acos(2.0 / 3.0)
    assert math.degrees(toggle) == pytest.approx(48.18968510422142, abs=1e-13)
    assert list(limits) == pytest.approx([toggle, 2.0 * math.pi - toggle], abs=EXACT)
    assert limits.start == pytest.approx(math.radians(start)) and not limits.unlimited


@pytest.mark.parametrize("crossed", [False, True])
@pytest.mark.parametrize(
    "lengths", [(2.0, 3.0, 4.0, 5.5), (5.0, 4.0, 3.0, 3.5), (4.0, 2.0, 3.0, 4.5)], ids=str
)
def test_rocking_four_bars(lengths, crossed):
    """Coupler and rocker stretched at one angle, folded at another, and the mirror of both."""
    a, b, c, d = lengths
    stretched = side(a, d, b + c)
    low = side(a, d, abs(b - c)) if abs(a - d) < abs(b - c) else -stretched
    limits = driver_range(makers.four_bar(*lengths, start=1.0, crossed=crossed))
    assert list(limits) == pytest.approx([low, stretched], abs=EXACT)


def test_random_four_bars():
    """The diagonal from crank pin to rocker pivot stays between |b − c| and b + c."""
    rng, checked = np.random.default_rng(0), 0
    while checked < 100:
        a, b, c, d = rng.uniform(1.0, 6.0, 4).tolist()
        start = float(rng.uniform(-math.pi, math.pi))
        diagonal = math.sqrt(a * a + d * d - 2.0 * a * d * math.cos(start))
        if not abs(b - c) + 0.05 < diagonal < b + c - 0.05:
            continue
        low = side(a, d, abs(b - c)) if abs(b - c) > abs(a - d) else None
        high = side(a, d, b + c) if b + c < a + d else None
        wanted = [-math.inf, math.inf]
        if low and high:
            wanted = [low, high] if start > 0.0 else [-high, -low]
        elif high:
            wanted = [-high, high]
        elif low:
            start %= 2.0 * math.pi
            wanted = [low, 2.0 * math.pi - low]
        limits = driver_range(makers.four_bar(a, b, c, d, start=start))
        assert list(limits) == pytest.approx(wanted, abs=EXACT)
        checked += 1


def test_where_branches_meet_in_the_dead_centre():
    """Peaucellier's rhombus of 3 on arms of 5 goes flat where OP = 5 − 3 = 2 · 1.5 cos(θ/2); the
    scissors fold where the jack's ends, 1 and 1.6 from the foot, are in line.
    """
    # extrapolated by a polynomial of degree 12 over a range ten times what is left
    limits = driver_range(gallery.load("peaucellier"))
    flat = 2.0 * math.acos(2.0 / 3.0)
    assert list(limits) == pytest.approx([-flat, flat], abs=1e-9)
    assert list(driver_range(gallery.load("scissor_lift"))) == pytest.approx([0.6, 2.6], abs=1e-9)


STARTS = (0.3, 1.0, math.pi / 3.0, math.pi / 2.0, 4.0)


# of the crossed branch from 90 deg on, rounding of another machine may stop it 2e-7 before a turn
@pytest.mark.parametrize(
    ("start", "crossed"),
    [(one, crossed) for one in STARTS for crossed in (False, True) if one != 0.5 * math.pi]
    + [(0.5 * math.pi, False)],
)
def test_change_points_are_no_ends(start, crossed):
    """A parallelogram goes through its positions in line, and so does its crossed branch."""
    assert driver_range(makers.four_bar(1, 3, 1, 3, start=start, crossed=crossed)).unlimited


@pytest.mark.parametrize("name", ["hoekens", "norton_fourbar", "quick_return", "watt_sixbar"])
def test_what_turns_right_round(name):
    limits = driver_range(gallery.load(name))
    assert limits.unlimited and list(limits) == [-math.inf, math.inf]
    assert str(limits) == "'crank' can turn all the way round"


def press(start=3.3, speed=0.0):
    driven = makers.slider_crank(1.0, 3.0, start=0.7)
    machine = Mechanism("press", ground={"O": (0.0, 0.0), "guide": (0.0, 0.0)})
    ram = CoordinateDriver("ram", "ground.O", "slider.B", ConstantSpeed(start, speed))
    machine.add(*driven.bodies, *driven.joints, ram)
    return machine


def test_a_slider_that_drives():
    limits = driver_range(press())
    assert list(limits) == pytest.approx([2.0, 4.0], abs=EXACT)
    assert str(limits) == "'slider' can move from 2 m to 4 m"


def test_a_cylinder_that_lifts_an_arm():
    """Its pin goes round on a circle of 2 about a place 3 away: 1 to 5."""
    machine = Mechanism("arm", ground={"C": (-3.0, 0.0)})
    machine.add(
        makers.bar("arm", 2.0, ends=("O", "P"), guess=1.0),
        Revolute("O", "ground", "arm.O"),
        DistanceDriver("jack", "ground.C", "arm.P", 4.0),
    )
    assert list(driver_range(machine, "jack")) == pytest.approx([1.0, 5.0], abs=EXACT)


def test_a_slide_without_an_end():
    machine = Mechanism("slide")
    machine.add(
        Body("block"),
        Prismatic("guide", "ground", "block"),
        CoordinateDriver("jack", "ground", "block", 0.5),
    )
    limits = driver_range(machine)
    assert limits.unlimited and str(limits) == "'block' can move without end"


def test_one_end_only():
    told = str(DriverRange("m", "arm", 0.0, -math.inf, 1.0))
    assert told == "'arm' can turn to 57.29577951 deg"


def two_arms(first, second):
    """A five-bar of links 2 on a ground of 3, driven at both arms."""
    machine = Mechanism("five-bar", ground={"A": (0.0, 0.0), "B": (3.0, 0.0)})
    machine.add(
        makers.bar("left", 2.0, ends=("A", "C"), guess=first),
        makers.bar("right", 2.0, ends=("B", "D"), guess=second),
        makers.bar("p", 2.0, ends=("C", "E"), guess=0.5),
        makers.bar("q", 2.0, ends=("D", "E"), guess=2.6),
        Revolute("A", "ground.A", "left.A"),
        Revolute("B", "ground.B", "right.B"),
        Revolute("C", "left.C", "p.C"),
        Revolute("D", "right.D", "q.D"),
        Revolute("E", "p.E", "q.E"),
        AngleDriver("one", "left", first),
        AngleDriver("two", "right", second),
    )
    return machine


@pytest.mark.parametrize("name", ["one", "left"])
def test_one_of_two_drivers(name):
    """The other driver is fixed: C stays within 4 of D, where p and q are stretched."""
    first, second = math.radians(100.0), math.radians(80.0)
    limits = driver_range(two_arms(first, second), name)
    D = 3.0 + 2.0 * np.exp(1j * second)
    spread = side(2.0, abs(D), 4.0)
    wanted = [np.angle(D) - spread, np.angle(D) + spread]
    assert wanted[0] < first < wanted[1]
    assert list(limits) == pytest.approx(wanted, abs=EXACT)
    assert limits.driver == "one" and limits.body == "left"


@pytest.mark.parametrize("mode", [{"turn": True}, {"t": [0.0, 0.4, 0.8]}])
def test_the_error_of_a_turn_says_both_ends(mode):
    machine = makers.four_bar(6, 18, 12, 8, start=math.pi / 2.0, speed=6.0)
    with pytest.raises(SolveError, match="'crank' can turn from") as caught:
        mbody.kinetostatics(machine, **mode)
    text = str(caught.value)
    numbers = [float(text.partition(word)[2].split()[0].strip("(")) for word in ("from ", " deg (")]
    assert numbers == pytest.approx([48.18968510, -48.18968510], abs=1e-6)
    assert "311.8103149 deg" in text and "dead centre at 311.8 deg" in text
    # inside of it, all is well
    run = mbody.kinetostatics(machine, drive={"motor": (np.radians([48.2, 90.0, 311.8]), 6.0)})
    assert run.checks.virtual_work < 1e-9


def test_the_position_that_was_asked_for_is_left_as_it_was():
    """The error of a later instant counts from where the driver began."""
    machine = press(3.3, 0.5)
    with pytest.raises(SolveError, match=r"'slider' can move from 2 to 4 m; drive"):
        mbody.kinematics(machine, t=np.linspace(0.0, 3.0, 7))


def test_a_large_mechanism_is_told_where_it_stopped(monkeypatch):
    """Beyond the size of dense matrices the place that the path reached is good to 1e-5."""
    monkeypatch.setattr(dead_centres, "LARGEST", 0)
    limits = driver_range(makers.four_bar(6, 18, 12, 8, start=math.pi / 2.0))
    toggle = math.acos(2.0 / 3.0)
    assert list(limits) == pytest.approx([toggle, 2.0 * math.pi - toggle], abs=1e-5)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: driver_range(two_arms(1.9, 1.2)), "has 2 drivers ('one', 'two')"),
        (lambda: driver_range(press(), "jack"), "no driver 'jack' (there are: 'ram')"),
        (lambda: driver_range(press(), t=math.nan), "one finite time, not nan"),
        (
            lambda: driver_range(mbody.assemble(press()).with_values({"rod.B.x": [3.0, 3.1]})),
            "driver_range takes one design",
        ),
    ],
)
def test_bad_questions(call, words):
    with pytest.raises(ModelError) as caught:
        call()
    assert words in str(caught.value)
