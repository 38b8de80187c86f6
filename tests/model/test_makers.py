"""Makers take text with units and quantities, as elements do."""

import math

import pint
import pytest

import mbody
from mbody import Body, Mechanism
from mbody.makers import bar, four_bar, slider_crank

Q = pint.Quantity


def alike(one: Mechanism, other: Mechanism) -> None:
    """The same description but for rounding, of conversion."""
    assert [e.name for e in one] == [e.name for e in other]
    for body in one.bodies:
        theirs = other[body.name]
        assert (body.mass, body.inertia) == pytest.approx((theirs.mass, theirs.inertia), rel=1e-14)
        assert body.guess.angle == pytest.approx(theirs.guess.angle, abs=1e-14)
        for name, point in body.points.items():
            assert point == pytest.approx(theirs.points[name], rel=1e-14)
    for place in one.ground.points:
        assert one.ground.points[place] == pytest.approx(other.ground.points[place], rel=1e-14)
    laws = [machine["motor"].law.derivatives(0.5) for machine in (one, other)]
    assert laws[0] == pytest.approx(laws[1], rel=1e-14)


def test_a_four_bar_with_units():
    plain = four_bar(0.04, 0.12, 0.08, 0.1, masses=(0.5, 3.0, 2.0), start=1.0, speed=math.pi)
    text = four_bar(
        "40 mm",
        Q(12, "cm"),
        "80 mm",
        0.1,
        masses=["500 g", 3, Q(2000.0, "g")],
        start="180 deg / pi",
        speed="30 rpm",
    )
    alike(text, plain)
    crossed = four_bar("1 in", "3 in", "2 in", "3.5 in", crossed=True, units="in-lbf-s")
    alike(crossed, four_bar(1, 3, 2, 3.5, crossed=True, units="in-lbf-s"))


def test_a_slider_crank_with_units():
    plain = slider_crank(50.0, 200.0, offset=10.0, masses=(1e-3, 2e-3, 0.0), units="mm-N-s")
    text = slider_crank(
        "5 cm", "0.2 m", offset="10 mm", masses=("1 kg", "2 kg", 0), start="60 deg", units="mm-N-s"
    )
    alike(text, plain)


def test_numbers_of_a_bar_follow_parameters():
    machine = Mechanism("rods", units="mm-N-s", parameters={"a": "30 mm", "m": "2 kg"})
    machine.add(bar("rod", "2*a", mass="m", points={"P": ("a", 0.0)}), bar("twin", 60.0, mass=2e-3))
    rod, twin = machine.bodies
    assert (rod.mass, rod.inertia) == pytest.approx((twin.mass, twin.inertia), rel=1e-14)
    assert rod.cg == twin.cg == (30.0, 0.0)
    assert rod.points["B"] == (60.0, 0.0) and rod.points["P"] == (30.0, 0.0)
    system = mbody.assemble(machine).with_values(a=60.0)
    assert system.values["rod.inertia"] == pytest.approx(4.0 * twin.inertia)
    assert system.values["rod.cg.x"] == 60.0


def test_a_bar_of_quantities():
    machine = Mechanism("a rod")
    machine.add(bar("rod", Q(2.0, "m"), mass=Q(3.0, "kg")))
    assert isinstance(machine["rod"], Body)
    assert machine["rod"].inertia == pytest.approx(1.0, rel=1e-15)
