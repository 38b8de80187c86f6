"""Model files in other units."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import gallery
from mbody.files.model import in_units
from mbody.model.numbers import number_in
from mbody.model.simulation import Instants
from mbody.quantities.units import unit_system
from tests.support.gallery_tables import tables
from tests.support.linkages import random_linkage, times_within
from tests.support.model_files import says_in_file


def ratio(dimension, old, new):
    return float(unit_system(old).unit(dimension).ratio / unit_system(new).unit(dimension).ratio)


def compare(run, other, tolerance):
    """Efforts, reactions and motion of one mechanism in two unit systems."""
    old, new = run.mechanism.units, other.mechanism.units
    force, torque, length = (ratio(key, old, new) for key in ("force", "torque", "length"))
    greatest = max(run.reaction(joint.name).magnitude.max() for joint in run.mechanism.joints)
    for driver in run.mechanism.drivers:
        a, b = run.effort(driver.name), other.effort(driver.name)
        size = torque if driver.rows == "a" else force
        arm = run.system.length if driver.rows == "a" else 1.0
        assert_allclose(b, a * size, atol=tolerance * size * max(np.abs(a).max(), greatest * arm))
    for joint in run.mechanism.joints:
        a, b = run.reaction(joint.name), other.reaction(joint.name)
        for key, size, arm, sure in zip(
            ("fx", "fy", "torque"), (force, force, torque), (1.0, 1.0, run.system.length), a.unique,
            strict=True,
        ):  # fmt: skip
            if sure:
                one, two = getattr(a, key), getattr(b, key)
                assert_allclose(two, one * size, atol=tolerance * size * greatest * arm)
    rate = ratio("frequency", old, new)
    for body in run.mechanism.bodies:
        a, b = run[body.name], other[body.name]
        for key, size in (("x", length), ("angle", 1.0), ("vy", length * rate),
                          ("alpha", rate**2)):  # fmt: skip
            one = getattr(a, key)
            scale = np.abs(one).max() + (run.system.length if key == "x" else 1.0)
            assert_allclose(getattr(b, key), one * size, atol=tolerance * size * scale)


#: Loops are closed to a last correction of 1e-12 of the size at most, mostly to rounding.
CLOSED = 1e-12


def at_its_instants(machine):
    ask = machine.ask
    if ask.over:
        return mbody.kinetostatics(machine, turn=True, instants=13)
    return mbody.kinetostatics(
        machine, t=[number_in(machine, t, "time", "ask", "t") for t in ask.at["t"]]
    )


@pytest.mark.parametrize("name", [n for n in gallery.names() if "ask" in tables(n)])
def test_the_gallery_in_other_units(name):
    machine = gallery.load(name)
    run = at_its_instants(machine)
    for units in ("SI", "in-lbf-s", "cm-kN-s"):
        other = in_units(machine, units)
        assert other.units.name == units
        compare(run, at_its_instants(other), 20 * CLOSED)
        back = in_units(other, machine.units)
        compare(run, at_its_instants(back), 20 * CLOSED)
        assert back.units == machine.units and back.measures == machine.measures
        assert {k: len(v) for k, v in back.ask.at.items()} == {
            k: len(v) for k, v in machine.ask.at.items()
        }


@pytest.mark.parametrize("seed", range(5))
def test_linkages_in_other_units(seed):
    machine, turn = random_linkage(seed, 2, sliders=seed % 2 == 0, extras=seed > 1)
    times = times_within(machine, 0.6 * turn, 4)
    run = mbody.kinetostatics(machine, t=times)
    for units in ("mm-N-s", "ft-lbf-s", "mm-N-ms"):
        other = in_units(machine, units)
        there = mbody.kinetostatics(other, t=times * ratio("time", "SI", units))
        compare(run, there, 50 * CLOSED)  # two closures, times the condition of the loops
        compare(run, mbody.kinetostatics(in_units(other, "SI"), t=times), 50 * CLOSED)


def test_a_batch_of_units_for_laws_and_parameters():
    """Laws with units go along; parameters of any dimension, also where one is called as a unit."""
    machine = mbody.Mechanism(
        "m",
        units="SI",
        parameters={"f": "5 Hz", "m": "2 kg", "T": "3 N*(1 m)", "rho": "5 g/cm^3", "q": "sqrt(2 m)",
                    "n": 3.0, "k": "2 N*(1 m)/(1 rad)"},
    )  # fmt: skip
    machine.add(
        mbody.Body("b", mass="m", points={"A": ("q^2/2", 1)}), mbody.Revolute("O", "ground", "b")
    )
    machine.add(mbody.AngleDriver("d", "b", "0.5 rad*sin(2*pi*f*t)"))
    machine.add(
        mbody.Torque("M", "b", value="T*cos(n*f*t)"),
        mbody.Spring("s", "ground", "b.A", law="0.009 N/mm*x"),
    )
    machine.ask = Instants(at={"t": [0.1, "50 ms", "0.2"]})
    other = in_units(machine, "mm-N-ms")
    assert [v for v in other.ask.at["t"]] == [100.0, 50.0, 200.0]
    assert other["b"].points["A"] == pytest.approx((1000.0, 1000.0), rel=1e-15)
    for name, old in machine.parameters.scope().names.items():
        new = other.parameters.scope().names[name]
        size = ratio(old.dimension, "SI", "mm-N-ms") if old.dimension else 1.0
        assert new.dimension == old.dimension
        assert new.value == pytest.approx(old.value * size, rel=2e-15)
    assert other["d"].law(30.0) == pytest.approx(machine["d"].law(0.03), rel=1e-14)
    assert other["M"].value(30.0) == pytest.approx(1000 * machine["M"].value(0.03), rel=1e-14)
    assert other["s"].law(20.0) == pytest.approx(machine["s"].law(0.02), rel=1e-14)
    assert in_units(machine, "SI") is machine


@pytest.mark.parametrize(
    ("law", "units"),
    [("5*sin(x)", "mm-N-s"), ("5 N*sin(x)", "mm-N-s"), ("5 N*cos(2*tan(x))", "in-lbf-s")],
)
def test_plain_laws_do_not_change_their_meaning(law, units):
    machine = mbody.Mechanism("m")
    machine.add(mbody.Body("b"), mbody.Spring("s", "ground", "b", law=law))
    with says_in_file("is of plain numbers, which cannot be taken to other units"):
        in_units(machine, units)


# 1 in = 0.0254 m, 1 lbf = 4.4482216152605 N, 386 in/s² = 9.8044 m/s²; exact, all of it
NORTON_SI = """
name  = "Norton, example 11-3, told in SI units"
units = "SI"
g     = "9.8044 m/s^2"

[ground]
points = { O2 = [0, 0], O4 = ["482.6 mm", 0] }

[bodies.crank]
weight  = "6.67233242289075 N"
inertia = "0.0451939316110466800 kg*m^2"
cg      = { r = "76.2 mm", angle = "30 deg" }
points  = { O2 = [0, 0], A = ["0.127 m", 0] }

[bodies.coupler]
weight  = "34.25130643750585 N"
inertia = "0.16947724354142505 kg*m^2"
cg      = { r = "22.86 cm", angle = "45 deg" }
points  = { A = [0, 0], B = ["0.381 m", 0], P = [
    "228.6 mm*cos(45 deg) + 76.2 mm*cos(100 deg)",
    "228.6 mm*sin(45 deg) + 76.2 mm*sin(100 deg)",
] }
guess   = "25 deg"

[bodies.rocker]
weight  = "25.7996853685109 N"
inertia = "0.09038786322209336 kg*m^2"
cg      = ["127 mm", "0 m"]
points  = { O4 = [0, 0], B = ["0.254 m", 0] }
guess   = "110 deg"

[joints]
O2 = { revolute = ["ground.O2", "crank.O2"] }
A  = { revolute = ["crank.A", "coupler.A"] }
B  = { revolute = ["coupler.B", "rocker.B"] }
O4 = { revolute = ["ground.O4", "rocker.O4"] }

[drivers.motor]
angle = "crank"
law   = "60 deg + 25 rad/s*t - 20 rad/s^2*t^2"

[loads]
F_P = { force = "355.85772922084 N", at = "coupler.P", angle = "330 deg" }
T_4 = { torque = "13.5581794833140040 N*m", body = "rocker" }

[measures]
T12 = { of = "motor.effort", unit = "lbf*in" }
"""


def test_norton_in_si_is_norton_in_inches():
    """The same machine by two ways: the book's inches, and text in SI units by hand."""
    inches, metres = gallery.load("norton_fourbar"), mbody.from_toml(NORTON_SI)
    for t in ([0.0], [0.0, 0.1, 0.2]):
        book, ours = (mbody.kinetostatics(machine, t=t) for machine in (inches, metres))
        compare(book, ours, 1e-12)
        compare(ours, mbody.kinetostatics(in_units(inches, "SI"), t=t), 1e-12)
        compare(book, mbody.kinetostatics(in_units(metres, "in-lbf-s"), t=t), 1e-12)
    torque = mbody.kinetostatics(metres).effort("motor")[0]
    assert torque == pytest.approx(243.23759076122965 * 4.4482216152605 * 0.0254, rel=1e-12)
    told = mbody.kinetostatics(metres).data()["measures"]["T12"][0]
    assert told == pytest.approx(243.23759076122965, rel=1e-12)
