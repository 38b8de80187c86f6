"""The cross-check: other engines agree where we are right, and differ where we are not."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest

import mbody
from mbody.engineering import close_loops
from mbody.engines.balance import CrosscheckResult, Row
from mbody.engines.crosscheck import ALWAYS, Crosscheck
from mbody.engines.independent_reading import evaluated
from mbody.model.body import SecondMoments
from mbody.model.loads import CentrifugalField, CustomLoad
from mbody.quantities.formula import float_or_formula
from tests.support.cases import first_fast
from tests.support.linkages import random_linkage, times_within
from validation.crosschecks import PAGE, row

pytest.importorskip("pinocchio")


FORCES = ("fx", "fy", "torque", "effort")


def check(model, **more):
    return mbody.crosscheck(model, "pinocchio", **more)


def found(report, engine="pinocchio"):
    return {row.quantity: row for row in report.opinions[engine].rows}


def differing(report, engine="pinocchio"):
    return {row.quantity for row in report.opinions[engine].rows if row.verdict != "agrees"}


def told(report):
    return [
        f"{name}: {row.quantity}: {row.ours} / {row.theirs}: {row.difference} > {row.expected}"
        for name, result in report.opinions.items()
        for row in result.rows
        if row.verdict != "agrees"
    ]


# -- agreement ----------------------------------------------------------------------------------


@first_fast("name", mbody.gallery.names(), 5)
def test_every_model_of_the_gallery_agrees_as_the_page_tells(name):
    machine = mbody.gallery.load(name)
    short = name == "n_windows_40"  # 81 bodies: the same quantities, at fewer instants
    ours = mbody.simulate(machine, until=0.2, instants=3) if short else None
    report = check(machine, ours=ours)
    assert report.agrees is not False, told(report)
    page = PAGE.read_text("utf-8")
    for engine in (*ALWAYS, "pinocchio"):
        result = report.opinions[engine]
        assert result.rows or result.not_expressible  # motors and formulas are ours alone
        line = row(name, engine, result)
        assert line in page, f"python -m validation.crosschecks writes the page anew: {line}"


@first_fast("seed", range(20), 4)
def test_random_mechanisms_of_one_to_four_loops(seed):
    loops = 1 + seed % 4
    machine, turn = random_linkage(seed, loops, sliders=seed % 3 == 1, extras=seed % 2 == 1)
    ours = mbody.kinetostatics(machine, times_within(machine, turn, 9))
    report = check(machine, ours=ours)
    assert report.agrees, told(report)
    forces = [row for row in found(report).values() if row.quantity.split(".")[-1] in FORCES]
    assert max(row.difference for row in forces) < 1e-8


@pytest.mark.parametrize("seed", range(6))
def test_rest_is_checked_too(seed):
    machine, _ = random_linkage(seed, 1 + seed % 3, sliders=seed % 2 == 1)
    report = check(machine, ours=mbody.statics(machine))
    assert report.agrees, told(report)
    assert not any("by the forces" in quantity for quantity in found(report))


def test_a_rod_and_a_pin_in_a_slot_are_expressed():
    """Constraints of one row: Pinocchio has no such joint, but its tree carries their forces."""
    machine = mbody.Mechanism("slotted lever", ground={"C": (2.0, 0.0)})
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=0.1, cg=(0.3, 0.1), points={"P": (0.5, 0.0)}),
        mbody.Body("lever", mass=2.0, inertia=0.4, cg=(1.0, 0.0), guess=math.pi),
        mbody.Body("bob", mass=1.5, inertia=0.2, points={"E": (0.7, 0.0)}, guess=0.5),
        mbody.Revolute("O", "ground", "crank"),
        mbody.Revolute("C", "ground.C", "lever"),
        mbody.PinSlot("slot", "lever", "crank.P"),
        mbody.Revolute("B", "crank.P", "bob"),
        mbody.Distance("rod", "ground.C", "bob.E", length=2.0),
        mbody.Gravity("gravity", y=-9.81),
        mbody.AngleDriver("motor", "crank", mbody.laws.ConstantSpeed(0.3, 5.0)),
    )
    report = check(machine, ours=mbody.kinetostatics(machine, turn="motor", instants=41))
    assert report.agrees, told(report)
    assert not report.opinions["pinocchio"].not_expressible
    assert {"slot.fx", "rod.fy", "motor.effort"} <= set(found(report))


@pytest.mark.parametrize("kind", ["distance", "coordinate"])
def test_drivers_of_a_length(kind):
    machine = mbody.Mechanism("lift", ground={"C": (1.0, 0.0)})
    machine.add(
        mbody.Body(
            "arm", mass=3.0, inertia=0.5, cg=(0.6, 0.1), points={"P": (1.2, 0.0)}, guess=0.9
        ),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Gravity("gravity", y=-9.81),
        mbody.DistanceDriver("ram", "ground.C", "arm.P", mbody.laws.Polynomial([1.0, 0.2, 0.1]))
        if kind == "distance"
        else mbody.CoordinateDriver(
            "ram", "ground.C", "arm.P", mbody.laws.Polynomial([-0.2, -0.2, 0.1])
        ),
    )
    report = check(machine, ours=mbody.kinetostatics(machine, np.linspace(0.0, 0.8, 5)))
    assert report.agrees, told(report)
    assert found(report)["ram.effort"].difference < 1e-12


def test_a_plane_that_turns_is_turned():
    """SlenderRod arms in a turning plane: the centrifugal moment is Pinocchio's own, in space."""
    machine = mbody.Mechanism("arm")
    machine.add(
        mbody.Body(
            "arm", mass=2.0, inertia=0.3, cg=(0.5, 0.1), spread=SecondMoments(0.18, 0.12, 0.05)
        ),
        mbody.Revolute("O", mbody.Marker("ground", (0.3, 0.0)), "arm"),
        CentrifugalField("field", mbody.Marker("ground", (0.0, 0.0), math.pi / 2), momentum=4.0),
        mbody.AngleDriver("motor", "arm", mbody.laws.Harmonic(0.4, 0.6, 3.0)),
    )
    report = check(machine, ours=mbody.kinetostatics(machine, np.linspace(0.0, 2.0, 9)))
    assert report.agrees, told(report)
    assert not report.opinions["pinocchio"].notes


def test_gears_cams_and_wheels_are_in_the_balance():
    """Pinocchio has none of them; with our forces applied nothing may be left in free joints."""
    for name, kind in (("planetary_train", "Gear"), ("vehicle", "Rolling")):
        report = check(mbody.gallery.load(name))
        missing = report.opinions["pinocchio"].not_expressible
        assert any(kind in one.why for one in missing)
        assert found(report)["balance"].difference < 1e-11


def table():
    """Two pairs of slides on one another: loops that only sliding joints close."""
    upright = math.pi / 2
    machine = mbody.Mechanism("table")
    machine.add(
        mbody.Body("a", mass=1.0, inertia=0.1, guess=(0.3, 0.0, 0.0)),
        mbody.Body("b", mass=2.0, inertia=0.2, guess=(0.3, 0.4, 0.0)),
        mbody.Body("c", mass=1.0, inertia=0.1, guess=(0.0, 0.4, 0.0)),
        mbody.Prismatic("x1", "ground", "a"),
        mbody.Prismatic("y1", at("a", upright), at("b", upright)),
        mbody.Prismatic("x2", "c", "b"),
        mbody.Prismatic("y2", at("ground", upright), at("c", upright)),
        mbody.Gravity("gravity", y=-9.81),
        mbody.CoordinateDriver("dx", "ground", "b", mbody.laws.Polynomial([0.3, 1.0, 2.0])),
        mbody.CoordinateDriver(
            "dy", at("ground", upright), "b", mbody.laws.Polynomial([0.4, -1.0, 1.0])
        ),
    )
    return machine, mbody.kinetostatics(machine, [0.0, 0.1, 0.2])


def at(body, angle):
    return mbody.Marker(body, (0.0, 0.0), angle)


def frame():
    """A frame welded twice, that a torque of time turns."""
    machine = mbody.Mechanism("frame")
    machine.add(
        mbody.Body("a", mass=1.0, inertia=0.1, guess=0.0),
        mbody.Body("b", mass=2.0, inertia=0.2, cg=(0.2, 0.3), guess=0.0),
        mbody.Revolute("O", "ground", "a"),
        mbody.Fixed("w1", mbody.Marker("a", (1.0, 0.0)), "b"),
        mbody.Fixed("w2", mbody.Marker("a", (1.0, 1.0)), mbody.Marker("b", (0.0, 1.0))),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Torque("T", "a", value="3 N*m*(1 + t/(1 s))"),
    )
    return machine, mbody.simulate(machine, 0.5, instants=5)


def crane():
    """A driven trolley with a free load, in millimetres."""
    machine = mbody.Mechanism("crane", units="mm-N-s")
    machine.add(
        mbody.Body("cart", mass=1.0, guess=(0.0, 0.0, 0.0)),
        mbody.Body("bob", mass=2.0, inertia=20.0, cg=(300.0, 0.0), guess=-1.0),
        mbody.Prismatic("rail", "ground", "cart"),
        mbody.Revolute("O", "cart", "bob"),
        mbody.Gravity("gravity", y=-9810.0),
        mbody.CoordinateDriver("push", "ground", "cart", mbody.laws.Harmonic(0.0, 100.0, 5.0)),
        mbody.TorsionDamper("drag", "bob", "cart", coefficient=5.0),
    )
    return machine, mbody.simulate(machine, 2.0, instants=21, rtol=1e-10)


def wheel():
    """A wheel that rolls down a slope."""
    machine = mbody.Mechanism("wheel")
    machine.add(
        mbody.Body("w", mass=2.0, inertia=0.1, guess=(0.0, 0.3, 0.0)),
        mbody.Rolling("road", at("ground", -0.1), "w", radius=0.3),
        mbody.Gravity("gravity", y=-9.81),
    )
    return machine, mbody.simulate(machine, 1.0, instants=5)


class Drag(CustomLoad):
    """Only its Python knows it."""

    def physics(self, i, j, p, t):
        """Against the speed of body j."""
        return 0.0, 0.0, 0.0, -0.1 * j[5], -0.1 * j[6], 0.0


def dragged():
    """A load of the user's own."""
    machine = mbody.gallery.load("norton_fourbar")
    machine.add(Drag("drag", "ground.O4", "coupler.P"))
    return machine, mbody.kinetostatics(machine, [0.0, 0.01])


def given():
    """Values of the driver instead of its law."""
    machine = mbody.gallery.load("norton_fourbar")
    turns = np.linspace(1.0, 1.5, 5)
    drive = {"motor": (turns, 3.0, np.linspace(0.0, 9.0, 5))}
    return machine, mbody.kinetostatics(machine, drive=drive)


@pytest.mark.parametrize("made", [table, frame, crane, wheel, dragged, given])
def test_mechanisms_of_every_make(made):
    machine, ours = made()
    report = check(machine, ours=ours)
    assert report.agrees, told(report)
    over_time = {quantity for quantity in found(report) if quantity.endswith("over time")}
    assert bool(over_time) == (made in (frame, crane))


@pytest.mark.parametrize("seed", range(4))
def test_free_motions_of_random_mechanisms(seed):
    """The motor released: Pinocchio follows the motion, all loads made by its own kinematics."""
    driven, _ = random_linkage(seed, 1 + seed, sliders=seed % 2 == 1, extras=seed > 1)
    machine = driven.without("motor")
    start = close_loops(machine)
    ours = mbody.simulate(machine, 0.3, start=start, rtol=1e-9, instants=7)
    report = check(machine, ours=ours)
    assert report.agrees, told(report)
    assert any(quantity.endswith("over time") for quantity in found(report))


def test_numbers_that_a_system_has_changed():
    """Pinocchio builds what the system says; the oracle, which reads the description, declines."""
    system = mbody.assemble(mbody.gallery.load("norton_fourbar")).with_values({"crank.A.x": 5.5})
    ours = mbody.kinetostatics(system)
    report = check(system, ours=ours)
    assert report.agrees and report.opinions["oracle"].not_expressible
    described = check(system.mechanism, ours=ours)
    assert differing(described) and differing(described, "oracle")


def test_a_position_that_is_none_differs():
    """Of a crank that is too long for the other links the oracle closes no loop."""
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    wrong = mbody.makers.four_bar(1, 9, 8, 3.5, masses=(1, 3, 2), speed=10.0)
    report = check(machine, ours=mbody.kinetostatics(wrong))
    assert differing(report) and differing(report, "oracle")


# -- faults ---------------------------------------------------------------------------------------


def faulty(machine, body):
    """A system whose body is 1 % heavier than described."""
    system = mbody.assemble(machine)
    name = f"{body}.weight" if f"{body}.weight" in system.values else f"{body}.mass"
    return system.with_values({name: 1.01 * system.values[name]})


@first_fast("seed", range(20), 5)
def test_a_hundredth_of_mass_is_caught_for_every_body(seed):
    machine, turn = random_linkage(seed, 1 + seed % 4, sliders=seed % 3 == 1)
    times = times_within(machine, turn, 5)
    for body in machine.bodies:
        if body.massless:
            continue
        report = check(machine, ours=mbody.kinetostatics(faulty(machine, body.name), times))
        for engine in ("balance", "oracle", "pinocchio"):
            assert differing(report, engine), f"{engine} does not see {body.name}"


def test_a_fault_of_inertia_moves_the_free_motion():
    machine = mbody.gallery.load("free_fourbar")
    wrong = mbody.assemble(machine).with_values({"rocker.inertia": 0.8 * 1.001})
    start = close_loops(machine, guess={"crank": math.radians(60.0)})
    ours = mbody.simulate(wrong, until=1.0, start=start, rtol=1e-10, instants=21)
    assert "crank.angle over time" in differing(check(machine, ours=ours))


# -- requests and reports -------------------------------------------------------------------------


def test_data_are_the_form_that_is_promised():
    bad = Row("A.fx", 1.0, math.nan, math.inf, 1e-9, "rounding")
    run = mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    data = Crosscheck(run, {"other": CrosscheckResult("other 1.0", (bad,))}).data()
    (row,) = data["engines"]["other"]["rows"]
    assert row["theirs"] is None and row["difference"] is None and row["verdict"] == "differs"
    assert data["agrees"] is False
    json.dumps(data, allow_nan=False)


@pytest.mark.slow
def test_the_command_prints_json_and_tells_by_its_status():
    command = [sys.executable, "-m", "mbody", "crosscheck", "norton_fourbar", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    data = json.loads(done.stdout)
    assert done.returncode == 0 and data["agrees"] is True
    assert set(data) >= {"model", "engines", "agrees"}
    for engine in (*ALWAYS, "pinocchio"):
        result = data["engines"][engine]
        keys = {"quantity", "ours", "theirs", "difference", "expected", "verdict"}
        assert all(keys <= set(row) for row in result["rows"])
        assert result["not_expressible"] == []


def test_an_engine_that_cannot_be_loaded_is_told(monkeypatch):
    """Of those that are installed: the others judge all the same."""
    monkeypatch.setattr(
        "mbody.engines.crosscheck.installed", lambda: ("balance", "oracle", "pinocchio")
    )
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    found = mbody.crosscheck(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0))
    assert found.agrees and found.opinions["oracle"].rows
    assert "cannot be loaded" in found.opinions["pinocchio"].notes[0]
    assert not found.opinions["pinocchio"].rows


def test_a_system_is_judged_with_the_numbers_that_it_has():
    """Not with those of the description: the torque follows the mass."""
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    system = mbody.assemble(machine).with_values({"coupler.mass": 5.0})
    found = mbody.crosscheck(system, "pinocchio")
    assert found.agrees
    assert found.run.effort("motor") == pytest.approx(mbody.kinetostatics(system).effort("motor"))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.0024 kg*m^2", 0.0024),  # m is the metre, though there is a parameter m
        ("5 N/m", 5.0),
        ("2 m*l", 6.0),  # l is no unit that continues one
        ("3 mm*l/m", 0.003 * 3.0 / 2.0),  # behind a parameter m is one, too
        ("4 kg * m", 8.0),  # a unit has no spaces
    ],
)
def test_a_unit_is_read_independently_of_parameters_of_its_name(text, value):
    """As the grammar of formulas says; the values are worked out by hand, m = 2 and l = 3."""
    machine = mbody.Mechanism("named as units", parameters={"m": 2.0, "l": 3.0})
    found, measured = evaluated(text, {"m": 2.0, "l": 3.0}, machine)
    assert found == pytest.approx(value, rel=1e-15) and measured
    assert float_or_formula(text, None).value(machine.parameters.scope()) == pytest.approx(found)
