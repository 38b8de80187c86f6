"""Pressures on pistons: over the cycle of a crank, and between valves.

Tolerances as in oracle_runs: forces 1e-10 of the greatest, where the pressures of a liquid are as
soft as the other loads are.
"""

import copy
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import engineering, makers
from mbody.core.lanes import LANES
from mbody.laws import ConstantSpeed, Table
from mbody.model.loads import PistonPressure, ReciprocatingCylinder
from tests.support.linkages import random_linkage, times_within
from tests.support.oracle_runs import assert_checked, assert_forces, assert_motion, forces_of

TURN = 2.0 * math.pi
ROUNDING = 1e-13  # some hundred roundings: one position of one loop
SWEEP = 1e-11  # a sweep accepts a last correction of 1e-12, × the condition of the loop
CYCLE = Table(
    np.linspace(0.0, TURN, 7),
    [1.0, 4.0, 2.0, 5.0, -1.0, 0.0, 1.0],
    periodic=True,
    interpolation="spline",
)
CYLINDER = {"area": 2.0, "near": 1.5, "far": -1.5, "clearance": 0.4, "suction": 0.3}


def engine(*loads, start=0.4, speed=7.0, **more):
    """A slider-crank with crank 1 and rod 4 whose slider loads push."""
    machine = makers.slider_crank(
        1.0, 4.0, masses=(1.0, 2.0, 3.0), start=start, speed=speed, **more
    )
    machine.add(*loads)
    return machine


def push(run, name):
    """Force of one load on the slider along x: what it makes of the driver's power, by the speed
    of the slider."""
    power = -run.breakdown("motor")[name] * run["crank"].omega
    return power / run["slider"].vx


# -- against the oracle -----------------------------------------------------------------------


def pressed(seed, loops, more):
    """A random linkage with its loads, a pressure and both kinds of cylinder besides."""
    linkage, turn = random_linkage(seed, loops, **more)
    machine = copy.copy(linkage)
    names = [body.name for body in machine.bodies]
    a, b, c = (mbody.Marker(name, (0.2, 0.1 * n), 0.5 * n) for n, name in enumerate(names[-3:]))
    ground = mbody.Marker("ground", (0.3, -0.2), 1.2)
    machine.add(
        PistonPressure("gas", a, b, "L1", 3.0, 2.0, head=CYCLE, rod="1 + 0.2*x", phase=0.3),
        PistonPressure("steam", ground, c, names[1], 2.0, head=CYCLE, phase=-2.0),
        ReciprocatingCylinder(
            "oil", c, a, opposite_area=1.0, delivery=2.0, bulk_modulus=2.0, **CYLINDER
        ),
        ReciprocatingCylinder(
            "air", ground, b, delivery=2.0, exponent=1.3, ambient=1.0, **CYLINDER
        ),
    )
    return machine, times_within(machine, turn, 241)


@pytest.mark.parametrize(
    "linkage",
    [(0, 3, {}), (1, 3, {"sliders": True}), (2, 4, {}), (1, 4, {"extras": True})],
    ids=str,
)
def test_kinetostatics_and_statics(linkage):
    from mbody.engines.oracle import Reference

    machine, t = pressed(*linkage)
    oracle, some = Reference(machine), slice(None, None, 40)
    # six steps between two instants that are compared
    q, v, a = (part[::5] for part in oracle.motion(t[::8]))
    run = mbody.kinetostatics(machine, t)
    assert run.record.blocks[0].shape[2] == LANES
    assert_motion(run, q, v, a, some)
    assert_forces(run, forces_of(oracle, q, v, a, t[some]), some)
    assert_checked(run)
    still, rest = np.zeros_like(q), mbody.statics(machine, t[some])
    assert_forces(rest, forces_of(oracle, q, still, still, t[some]))
    # each has a part in it
    for name in ("gas", "steam", "oil", "air"):
        assert np.abs(run.breakdown("motor")[name]).max() > 0.0


# -- over the cycle ---------------------------------------------------------------------------


def test_the_force_of_both_faces():
    """F = p_head A_head − p_rod A_rod along the marker's x axis."""
    gas = PistonPressure(
        *("gas", mbody.Marker("ground", (0.0, 0.0), math.pi), "slider.B", "crank", 0.5, 0.4),
        **{"head": CYCLE, "rod": "0.3 + sin(x)", "phase": 0.2},
    )
    run = mbody.kinetostatics(engine(gas), drive={"motor": (np.linspace(0.5, 2.5, 30), 7.0)})
    x = run["crank"].angle + 0.2
    wanted = -(0.5 * CYCLE(x) - 0.4 * (0.3 + np.sin(x)))
    assert_allclose(push(run, "gas"), wanted, rtol=SWEEP)
    # it acts on the frame as strongly: nothing but inertia shakes that
    inertia = sum(run.inertia(name)[0] for name in run)
    assert_allclose(engineering.shaking_force(run).fx, inertia, rtol=SWEEP)


@pytest.mark.parametrize("turns", [-2, -1, 1, 5])
def test_the_cycle_repeats(turns):
    gas = PistonPressure("gas", "ground", "slider.B", "crank", 1.0, head="5 - x")
    at = np.linspace(0.3, 6.2, 9)
    here, there = (
        mbody.kinetostatics(engine(gas), drive={"motor": (angle, 7.0)}).breakdown("motor")["gas"]
        for angle in (at, at + TURN * turns)
    )
    assert_allclose(there, here, rtol=0, atol=1e-12 * np.abs(here).max())


def test_a_second_cylinder_behind_the_first():
    """Its phase takes the angle back by what its crank is behind."""
    first = PistonPressure("gas", "ground", "slider.B", "crank", 1.0, head=CYCLE)
    second = PistonPressure("gas", "ground", "slider.B", "crank", 1.0, head=CYCLE, phase=-0.7)
    at = np.linspace(0.4, 2.6, 12)
    one = mbody.kinetostatics(engine(first), drive={"motor": (at, 7.0)})
    two = mbody.kinetostatics(engine(second), drive={"motor": (at + 0.7, 7.0)})
    assert_allclose(push(two, "gas"), push(one, "gas"), rtol=SWEEP)


def test_a_cycle_of_two_turns_goes_by_a_slower_shaft():
    machine = mbody.Mechanism("shafts")
    machine.add(
        mbody.Body("crank"),
        mbody.Body("cam"),
        mbody.Body("rider", mass=1.0),
        mbody.Revolute("A", "ground", "crank"),
        mbody.Revolute("B", mbody.Marker("ground", (3.0, 0.0)), "cam"),
        mbody.Gear("gear", "crank", "cam", radius_i=1.0, radius_j=2.0),
        mbody.Prismatic("guide", "ground", "rider"),
        mbody.Distance("rod", mbody.Marker("crank", (1.0, 0.0)), "rider", length=4.0),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(0.3, 1.0)),
        PistonPressure("gas", "ground", "rider", "cam", 1.0, head="x"),
    )
    run = mbody.kinetostatics(machine, t=np.linspace(0.0, 0.5, 3))
    x = np.mod(run["cam"].angle, TURN)
    assert_allclose(-run.breakdown("motor")["gas"] / run["rider"].vx, x, rtol=SWEEP)


FILE = """
units = "SI"
[bodies]
crank  = { points = { O = [0, 0], A = [1, 0] } }
rod    = { points = { A = [0, 0], B = [4, 0] } }
slider = { points = { B = [0, 0] } }
[joints]
O = { revolute = ["ground", "crank.O"] }
A = { revolute = ["crank.A", "rod.A"] }
B = { revolute = ["rod.B", "slider.B"] }
guide = { prismatic = ["ground", "slider.B"] }
[drivers]
motor = { angle = "crank", law = { constant_speed = { value = 0, speed = 7 } } }
[loads.gas]
piston_pressure = ["ground", "slider.B"]
cycle     = "crank"
head_area = "50 cm^2"
head      = { table = { file = "pressure.csv", periodic = true } }
[loads.ramp]
force = { table = { file = "time.csv", interpolation = "spline" } }
at    = "slider.B"
[loads.charge]
spring = [{ body = "ground", point = [-100, 0] }, "slider.B"]
law    = { table = { file = "place.csv", interpolation = "spline" } }
"""


def test_tables_beside_the_model(tmp_path):
    """Payloads by a CSV: over the cycle, over time, and over the place of the ram."""
    (tmp_path / "engine.toml").write_text(FILE, "utf-8")
    angle = np.linspace(0.0, 360.0, 37)
    bar = 5.0 + 3.0 * np.cos(np.radians(angle))
    t, x = np.linspace(0.0, 1.0, 21), np.linspace(102.0, 106.0, 21)
    for name, first, second in (
        ("pressure", angle, 1e5 * bar),
        ("time", t, 40.0 * t**2),
        ("place", x, 10.0 * (x - 104.0) ** 2),
    ):
        lines = "".join(f"{a!r},{b!r}\n" for a, b in zip(first.tolist(), second.tolist()))
        (tmp_path / f"{name}.csv").write_text(lines, "utf-8")
    machine = mbody.load(tmp_path / "engine.toml")
    run = mbody.kinetostatics(machine, t=np.linspace(0.05, 0.4, 9))
    # at the points, 10 deg apart, any interpolation has what the table says
    at = mbody.kinetostatics(machine, drive={"motor": (np.radians([30.0, 50.0, 300.0]), 7.0)})
    wanted = 50e-4 * 1e5 * (5.0 + 3.0 * np.cos(np.radians([30.0, 50.0, 300.0])))
    assert_allclose(push(at, "gas"), wanted, rtol=SWEEP)
    # a spline without corners has a parabola as it is
    assert_allclose(push(run, "ramp"), 40.0 * run.t**2, rtol=SWEEP)
    place = 100.0 + run["slider"].x
    assert_allclose(push(run, "charge"), -10.0 * (place - 104.0) ** 2, rtol=1e-9, atol=1e-9)
    assert mbody.from_toml(mbody.to_toml(machine)) == machine


# -- between valves ---------------------------------------------------------------------------

OIL = ReciprocatingCylinder(
    "oil", "ground", "slider.B", 2.0, near=5.0, far=3.0, clearance=0.5, suction=1.0, delivery=9.0,
    bulk_modulus=40.0, opposite_area=1.5,
)  # fmt: skip
AIR = ReciprocatingCylinder(
    "air", "ground", "slider.B", 2.0, near=5.0, far=3.0, clearance=0.1, suction=0.0, delivery=6.0,
    exponent=1.35, ambient=1.0,
)  # fmt: skip


def test_pressure_of_a_liquid():
    """p − p_s = K ln(V_max/V) on the way in, p_d − p = K ln(V/V_min) on the way out, and valves."""
    for x, h in ((3.2, 2.3), (3.3, 2.2), (4.0, 1.5), (4.9, 0.6)):
        inwards = min(1.0 + 40.0 * math.log(2.5 / h), 9.0)
        outwards = max(9.0 - 40.0 * math.log(h / 0.5), 1.0)
        assert OIL.pressure(x, 1.0) == pytest.approx(inwards, rel=ROUNDING)
        assert OIL.pressure(x, -1.0) == pytest.approx(outwards, rel=ROUNDING)
        # the other chamber is the same, seen from the other dead centre
        assert OIL.pressure(8.0 - x, -1.0, opposite=True) == pytest.approx(inwards, rel=ROUNDING)
    assert 1.0 < OIL.pressure(3.2, 1.0) < 9.0  # not all of them are at a valve


def test_pressure_of_a_gas():
    """(p + p₀) Vⁿ stays what it is at either end."""
    for x, h in ((3.2, 1.9), (4.0, 1.1), (4.9, 0.2)):
        inwards = min((2.1 / h) ** 1.35 - 1.0, 6.0)
        outwards = max(7.0 * (0.1 / h) ** 1.35 - 1.0, 0.0)
        assert AIR.pressure(x, 1.0) == pytest.approx(inwards, rel=ROUNDING)
        assert AIR.pressure(x, -1.0) == pytest.approx(outwards, rel=ROUNDING, abs=ROUNDING)


@pytest.mark.parametrize("load", [OIL, AIR], ids=["oil", "air"])
def test_pressure_does_not_jump_at_dead_centres(load):
    assert load.pressure(5.0, 1.0) == load.pressure(5.0, -1.0) == load.delivery
    assert load.pressure(3.0, 1.0) == load.pressure(3.0, -1.0) == load.suction
    assert load.pressure(5.5, -1.0) == load.delivery and load.pressure(2.5, 1.0) == load.suction


def test_at_rest_it_counts_as_compressed():
    run = mbody.statics(engine(OIL), drive={"motor": 2.0})
    x = float(run["slider"].x[0])
    by_work = mbody.kinetostatics(
        engine(OIL), drive={"motor": (-2.0, 7.0)}
    )  # the slider goes out there
    assert float(by_work["slider"].vx[0]) > 0.0
    wanted = 2.0 * OIL.pressure(x, 0.0) - 1.5 * OIL.pressure(x, 0.0, opposite=True)
    assert OIL.pressure(x, 0.0) == OIL.pressure(x, 1.0)
    assert OIL.pressure(x, 0.0, opposite=True) == OIL.pressure(x, -1.0, opposite=True)
    torque = run.breakdown("motor")["oil"][0]
    # virtual work: T dθ = F dx, with dx/dθ from the moving run at the mirrored angle
    slope = -float(by_work["slider"].vx[0]) / 7.0
    assert torque == pytest.approx(wanted * slope, rel=SWEEP)


@pytest.mark.parametrize(
    ("load", "work"),
    [
        # ∮ p dV of each chamber: delivery and compression less expansion and suction
        (OIL, lambda: 3.5 * loop(40.0, 0.5, 2.5)),
        (AIR, lambda: 2.0 * gas_loop(1.35, 0.1, 2.1)),
    ],
    ids=["oil", "air"],
)
def test_work_of_a_turn(load, work):
    run = mbody.kinetostatics(engine(load, start=0.0), turn=True, instants=20001)
    done = float(np.trapezoid(run.effort("motor"), run["crank"].angle))
    # trapezoids of a function with corners: spacing² / 8 × the jumps of its slope, below 100
    assert done == pytest.approx(work(), abs=100.0 * (TURN / 20000) ** 2)


def loop(K, c, H, ps=1.0, pd=9.0):
    """Per area, of a liquid: the two curves are K apart in what they integrate to."""
    part = math.exp((pd - ps) / K)
    h1, h2 = H / part, c * part
    squeeze = (ps + K) * (H - h1) - K * h1 * math.log(H / h1)
    spread = (pd + K) * (h2 - c) - K * h2 * math.log(h2 / c)
    return pd * (h1 - c) + squeeze - spread - ps * (H - h2)


def gas_loop(n, c, H, ps=1.0, pd=7.0):
    """Per area, of a gas, absolute pressures: n/(n − 1) p V ((p_d/p_s)^((n−1)/n) − 1)."""
    drawn = H - c * (pd / ps) ** (1.0 / n)
    return n / (n - 1.0) * ps * drawn * ((pd / ps) ** ((n - 1.0) / n) - 1.0)


def test_a_double_acting_cylinder_is_two():
    numbers = {"suction": 1.0, "delivery": 9.0, "clearance": 0.5, "bulk_modulus": 40.0}
    both = mbody.kinetostatics(engine(OIL), t=np.linspace(0.0, 0.9, 50))
    each = mbody.kinetostatics(
        engine(
            ReciprocatingCylinder("one", "ground", "slider.B", 2.0, near=5.0, far=3.0, **numbers),
            ReciprocatingCylinder("two", "ground", "slider.B", 1.5, near=3.0, far=5.0, **numbers),
        ),
        t=both.t,
    )
    assert_allclose(each.effort("motor"), both.effort("motor"), rtol=0, atol=1e-10)


def test_designs_in_a_batch():
    system = mbody.assemble(engine(OIL))
    areas, drive = np.array([1.0, 2.0, 3.0]), {"motor": (np.linspace(0.1, 3.0, 12), 7.0)}
    batch = mbody.kinetostatics(
        system.with_values({"oil.area": areas, "oil.clearance": 0.6}), drive=drive
    )
    for area, effort in zip(areas, batch.effort("motor"), strict=True):
        one = system.with_values({"oil.area": float(area), "oil.clearance": 0.6})
        run = mbody.kinetostatics(one, drive=drive)
        assert_allclose(effort, run.effort("motor"), rtol=0, atol=1e-10)
        # the diagram has the changed numbers
        assert engineering.indicator(run, "oil").volume[0] == pytest.approx(
            area * (0.6 + 5.0 - run["slider"].x[0]), rel=ROUNDING
        )


def test_indicator():
    """V = A h, the power −p V̇ is what the driver gives but for inertia, and what is delivered."""
    run = mbody.kinetostatics(engine(OIL, start=0.0), turn=True, instants=721)
    sides = [engineering.indicator(run, "oil", opposite=side) for side in (False, True)]
    x, v = run["slider"].x, run["slider"].vx
    for side, area, h, sign in zip(sides, (2.0, 1.5), (5.5 - x, x - 2.5), (-1.0, 1.0)):
        assert_allclose(side.volume, area * h, rtol=ROUNDING)
        assert_allclose(side.rate, area * sign * v, rtol=0, atol=1e-11)
        open_, shut = side.delivery > 0.0, side.pressure < 9.0
        assert (side.pressure[open_] == 9.0).all() and (side.delivery[shut] == 0.0).all()
        assert_allclose(side.delivery[open_], -side.rate[open_])
        assert (side.pressure[side.suction > 0.0] == 1.0).all() and (side.suction >= 0.0).all()
    given = run.breakdown("motor")["oil"] * run["crank"].omega
    whole = sides[0].power + sides[1].power
    assert_allclose(whole, given, rtol=0, atol=SWEEP * np.abs(given).max() * 40.0 / 0.5)
    # a whole-turn average has an instant's width at each opening
    delivered = float(np.trapezoid(sides[0].delivery, run.t))
    assert delivered == pytest.approx(2.0 * (2.5 / math.exp(0.2) - 0.5), abs=0.02)


def test_of_an_oscillating_cylinder():
    """A cylinder that turns with its piston: only what is along the line of stroke counts."""
    machine = mbody.Mechanism("oscillating", ground={"O": (0.0, 0.0), "C": (3.0, 0.0)})
    machine.add(
        makers.bar("crank", 1.0, ends=("O", "A")),
        mbody.Body("cylinder", points={"C": (0.0, 0.0)}, guess=3.0),
        mbody.Body("piston", mass=0.5, points={"A": (0.0, 0.0)}, guess=3.0),
        mbody.Revolute("O", "ground.O", "crank.O"),
        mbody.Revolute("A", "crank.A", "piston.A"),
        mbody.Revolute("C", "ground.C", "cylinder.C"),
        mbody.Prismatic("bore", "cylinder.C", "piston.A"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(0.5, 5.0)),
        ReciprocatingCylinder(
            *("oil", "cylinder.C", "piston.A", 2.0),
            **{"near": 2.0, "far": 4.0, "clearance": 0.5, "delivery": 9.0, "bulk_modulus": 40.0},
        ),
    )
    run = mbody.kinetostatics(machine, t=np.linspace(0.0, 1.2, 80))
    a = run["crank"].angle
    x = np.hypot(3.0 - np.cos(a), np.sin(a))
    v = 3.0 * np.sin(a) * 5.0 / x
    p = np.array([machine["oil"].pressure(*pair) for pair in zip(x, v)])
    given = run.breakdown("motor")["oil"] * 5.0
    assert_allclose(given, -2.0 * p * v, rtol=0, atol=1e-9 * np.abs(given).max())
    diagram = engineering.indicator(run, "oil")
    assert_allclose(diagram.rate, 2.0 * v, rtol=0, atol=1e-11 * 10.0)
    assert_allclose(diagram.volume, 2.0 * (0.5 + x - 2.0), rtol=1e-12)


def test_a_constant_pressure_is_a_force():
    push_ = mbody.Force("push", "slider.B", 6.0, angle=math.pi)
    gas = PistonPressure(
        "gas", mbody.Marker("ground", (0.0, 0.0), math.pi), "slider.B", "crank", 2.0, head=3.0
    )
    t = np.linspace(0.0, 0.9, 40)
    one, two = (mbody.kinetostatics(engine(load), t=t) for load in (push_, gas))
    assert_allclose(two.effort("motor"), one.effort("motor"), rtol=0, atol=1e-11)
    # the spring of a table does the same where its line is the line of stroke
    law = Table([90.0, 110.0], [6.0, 6.0])
    pull = mbody.Spring("pull", mbody.Marker("ground", (-100.0, 0.0)), "slider.B", law=law)
    three = mbody.kinetostatics(engine(pull), t=t)
    assert_allclose(three.effort("motor"), one.effort("motor"), rtol=0, atol=1e-9)
