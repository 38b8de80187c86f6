"""Forty models with one trap each, what silences the note, and mechanisms that bring none."""

import math
import time

import pytest

import mbody
from mbody import AngleDriver, Body, Force, Gravity, Mechanism, Revolute, Spring, gallery
from mbody.files.model.other_units import in_units
from mbody.laws import ConstantSpeed
from mbody.model.traps import traps
from mbody.quantities.units import unit_system

FOUR_BAR = """
units = "{units}"
[ground]
points = {{ O2 = [0, 0], O4 = [300, 0] }}
[bodies]
crank   = {{ {crank}, points = {{ O2 = [0, 0], A = [100, 0] }}, guess = 60 }}
coupler = {{ {coupler}, points = {{ A = [0, 0], B = [280, 0] }}, guess = 20 }}
rocker  = {{ {rocker}, points = {{ O4 = [0, 0], B = [200, 0] }}, guess = 100 }}
[joints]
O2 = {{ revolute = ["ground.O2", "crank.O2"] }}
A  = {{ revolute = ["crank.A", "coupler.A"] }}
B  = {{ revolute = ["coupler.B", "rocker.B"] }}
O4 = {{ revolute = ["ground.O4", "rocker.O4"] }}
{joints}
[drivers.motor]
angle = "crank"
law   = {law}
{loads}
[gravity]
{gravity}
"""
WELL = {
    "units": "mm-N-s",
    "crank": 'mass = "1 kg", inertia = "900 kg*mm^2", cg = [50, 0]',
    "coupler": 'mass = "2 kg", inertia = "9000 kg*mm^2", cg = [140, 0]',
    "rocker": 'mass = "1.5 kg", inertia = "5000 kg*mm^2", cg = [100, 0]',
    "joints": "",
    "law": '{ constant_speed = { value = 60, speed = "120 rpm" } }',
    "loads": "",
    "gravity": 'y = "-9.81 m/s^2"',
}


def four_bar(**changes):
    return mbody.from_toml(FOUR_BAR.format(**WELL | changes))


def speed(text):
    return {"law": f"{{ constant_speed = {{ value = 60, speed = {text} }} }}"}


PLAIN = {
    "crank": "mass = 1, inertia = 0.001, cg = [50, 0]",
    "coupler": "mass = 2, inertia = 0.009, cg = [140, 0]",
}
WEIGHT = """[loads.W]
at = { body = "coupler", point = [140, 0] }
angle = -90
"""
ACCELERATED = '{ constant_acceleration = { value = 60, speed = 600, acceleration = "1 rad/s^2" } }'
#: Changes of the four-bar that are one trap each, and words of the note: number, unit, meaning.
TRAPS = {
    "gravity in m, file in mm": (
        {"gravity": "y = -9.81"}, "-9.81 mm/s², 0.001 of the earth's 9806.6 mm/s²: -9.81 m/s²",
    ),
    "gravity in ft, file in mm": ({"gravity": "y = -32.2"}, "-32.2 mm/s²"),
    "gravity aslant": ({"gravity": "x = 6.94\ny = -6.94"}, "9.8146 mm/s²"),
    "gravity of a parameter": (
        {"gravity": 'y = "-g"\n[parameters]\ng = 9.81'}, "-9.81 m/s² are likely meant",
    ),
    "gravity upwards": ({"gravity": 'y = "9.81 m/s^2"'}, "points upwards: its y is 9810 mm/s²"),
    "gravity twice": (
        {"loads": '[loads]\nearth = { gravity = [0, "-9.81 m/s^2"] }'},
        "'earth' and 'gravity' add up to a gravity of 19620 mm/s²",
    ),
    "a weight as a force": (
        {"loads": f"{WEIGHT}force = 19.62"},
        "'W', 19.62 N, is the weight of 'coupler', which 'gravity' gives it already",
    ),
    "120 for rpm": (speed("120"), "120 rad/s, which are 1146 rpm"),
    "-3000 for rpm": (speed("-3000"), "-3000 rad/s, which are -28648 rpm"),
    "a polynomial of rpm": ({"law": "{ polynomial = [0, 1500] }"}, "1500 rad/s"),
    "rpm of a parameter": (
        speed('"n"') | {"loads": "[parameters]\nn = 1450"}, "1450 rad/s, which are 13846 rpm",
    ),
    "accelerated from rpm": (
        {"law": ACCELERATED}, "600 rad/s, which are 5730 rpm",
    ),
    "cg in metres for mm": (
        {"coupler": 'mass = "2 kg", inertia = "9000 kg*mm^2", cg = [14000, 0]'},
        "cg of 'coupler' is [14000, 0] mm, 49 times its length 280 mm outside",
    ),
    "mass forgotten": (
        {"coupler": 'inertia = "9000 kg*mm^2", cg = [140, 0]'},
        "'coupler' has an inertia of 9000 kg*mm^2 and no mass",
    ),
    "mass and cg forgotten": (
        {"rocker": 'inertia = "5000 kg*mm^2"'}, "inertia of 5000 kg*mm^2 and no mass",
    ),
    "one link without mass": (
        {"coupler": "cg = [140, 0]"}, "'coupler' has no mass, while the other links, 'crank'",
    ),
    "mass without inertia": (
        {"rocker": 'mass = "1.5 kg", cg = [100, 0]'}, "'rocker' has a mass and no inertia",
    ),
    "weight without inertia": (
        {"rocker": 'weight = "15 N", cg = [100, 0]'}, "'rocker' has a weight and no inertia",
    ),
    "mg for kg": (
        {"coupler": 'mass = "2 mg", inertia = "9000 mg*mm^2", cg = [140, 0]'},
        "'coupler' has a mass of 2 mg",
    ),
    "g for kg": (
        {"rocker": 'mass = "1500 kg", inertia = "5e6 kg*mm^2", cg = [100, 0]'},
        "'rocker' has a mass of 1500 kg",
    ),
    "t for kg": (
        {"coupler": 'mass = "2 t", inertia = "9e6 kg*mm^2", cg = [140, 0]'},
        "'coupler' has a mass of 2 t, 11.6 steel cubes of its length, 280 mm",
    ),
    "plain masses in t": (
        {"coupler": "mass = 2, inertia = 9000, cg = [140, 0]"}, "2 t, which is 2000 kg",
    ),
    "inertia in kg m² for kg mm²": (
        {"coupler": 'mass = "2 kg", inertia = "9 kg*m^2", cg = [140, 0]'},
        "an inertia of 9 kg*m^2 with a mass of 2 kg is a radius of gyration of 2121.3 mm, 7.58",
    ),
    "inertia of a crank in kg m²": (
        {"crank": 'mass = "1 kg", inertia = "9 kg*m^2", cg = [50, 0]'},
        "9 kg*m^2 with a mass of 1 kg is a radius of gyration of 3000 mm, 30 times its length",
    ),
    "inertia too small": (
        {"rocker": 'mass = "1.5 kg", inertia = "5 g*mm^2", cg = [100, 0]'},
        "5 g*mm^2 with a mass of 1.5 kg is a radius of gyration of 0.057735 mm",
    ),
    "a pin given twice": (
        {"joints": 'A_again = { revolute = ["coupler.A", "crank.A"] }'},
        "'A' and 'A_again' are one joint",
    ),
    "a spring in a pin": (
        {"loads": '[loads.s]\nspring = ["crank.A", "coupler.A"]\nstiffness = 2\nfree_length = 9'},
        "'s' has no length: it goes between the two places that 'A' joins",
    ),
    "a plain force beside masses": (
        {"units": "mm-kg-s", "loads": '[loads.push]\nforce = 120\nat = "rocker.B"\nangle = 0'},
        "'push.value' is 120 mN: in units 'mm-kg-s' the unit of force is the mN; write the unit, "
        "as in '120 N'",
    ),
    "no free length": (
        {"loads": '[loads.s]\nspring = ["ground.O4", "crank.A"]\nstiffness = 2'},
        "'s' has no free_length, which is taken as 0 mm",
    ),
}  # fmt: skip


def test_what_is_well_said_brings_nothing():
    assert not list(traps(four_bar()))


@pytest.mark.parametrize("trap", TRAPS)
def test_a_trap_in_a_four_bar(trap):
    changes, words = TRAPS[trap]
    machine = four_bar(**changes)
    found = [note for note in traps(machine) if words in note]
    assert len(found) == 1, list(traps(machine))
    others = [note for note in traps(machine) if note not in found]
    # masses and inertias of one link are out of proportion together
    assert len(others) <= ("mass" in found[0]), others


DRAWN = """
units = "mm-N-s"
[ground]
points = { O2 = [0, 0], O4 = [350, 0] }
[bodies]
crank   = { mass = "1 kg", inertia = "900 kg*mm^2", points = { O2 = [0, 0], A = [50, 86.6] } }
coupler.mass = "2 kg"
coupler.inertia = "9000 kg*mm^2"
coupler.cg = [180, 140]
coupler.points = { A = [50, 86.6], B = [310, 190] }
rocker.mass = "1 kg"
rocker.inertia = "4000 kg*mm^2"
rocker.cg = [330, 95]
rocker.points = { O4 = [350, 0], B = [310, 190] }
[joints]
O2 = { revolute = ["ground.O2", "crank.O2"] }
A  = { revolute = ["crank.A", "coupler.A"] }
B  = { revolute = ["coupler.B", "rocker.B"] }
O4 = { revolute = ["ground.O4", "rocker.O4"] }
[drivers.motor]
angle = "crank"
law   = 0
"""
IN_DRAWINGS = {
    "no cg of a coupler": (
        ("coupler.cg = [180, 140]\n", ""),
        "cg of 'coupler' is not given and is taken at [0, 0] mm, 99.998 mm outside of its points",
    ),
    "no cg of a rocker": (("rocker.cg = [330, 95]\n", ""), "310 mm outside of its points"),
    "cg in link axes": (
        ("cg = [180, 140]", "cg = [120, 0]"), "it seems to count from [50, 86.6]",
    ),
    "turned twice": (("law   = 0", "law   = 60"), "'crank' is drawn at 60° and 'motor' turns it"),
    "turned twice as it begins": (
        ("law   = 0", 'law = "60 deg + 1 rad/s*t"'), "turns it by 60° from there, to 120°",
    ),
}  # fmt: skip


@pytest.mark.parametrize("trap", IN_DRAWINGS)
def test_a_trap_in_a_drawing(trap):
    (before, after), words = IN_DRAWINGS[trap]
    assert before in DRAWN and not list(traps(mbody.from_toml(DRAWN)))
    (note,) = traps(mbody.from_toml(DRAWN.replace(before, after)))
    assert words in note


def pendulum(*more, units="SI", law=0.5, at="ground", **body):
    own = {"mass": 2.0, "inertia": 0.2, "cg": (0.5, 0.0), "points": {"P": (1.0, 0.0)}}
    machine = Mechanism("pendulum", units=units, ground={"Q": (0.0, 0.5)})
    machine.add(Body("arm", **own | body), Revolute("O", at, "arm"))
    machine.add(AngleDriver("motor", "arm", law), *more)
    return machine


def no_length():
    machine = Mechanism("rods", ground={"Q": (3.0, 0.0)})
    places = {"A": (0.0, 0.0), "B": (0.0, 0.0), "C": (1.0, 1.0)}
    machine.add(Body("crank", points={"A": (1, 0)}), Body("rod", points=places))
    machine.add(Body("other", points={"B": (1, 0)}), Body("third", points={"C": (1, 0)}))
    machine.add(Revolute("O", "ground", "crank"), Revolute("A", "crank.A", "rod.A"))
    machine.add(Revolute("B", "rod.B", "other.B"), Revolute("C", "rod.C", "third.C"))
    return machine


def all_in_grams():
    machine = mbody.makers.four_bar(0.1, 0.3, 0.2, 0.35, masses=(200, 600, 400))
    return machine


IN_PYTHON = {
    "a guess in degrees": (lambda: pendulum(guess=60), "guess.angle is 60 rad, 9.549 turns"),
    "a force in degrees": (
        lambda: pendulum(Force("F", "arm.P", 3.0, angle=330)), "'F': angle is 330 rad",
    ),
    "a driver in degrees": (lambda: pendulum(law=45), "'motor': law is 45 rad"),
    "a marker in degrees": (
        lambda: pendulum(at=mbody.Marker("ground", (0, 0), 30)), "'O': i.angle is 30 rad",
    ),
    "a speed in rpm": (
        lambda: pendulum(law=ConstantSpeed(0.0, 1500.0)), "1500 rad/s, which are 14324 rpm",
    ),
    "weights and no gravity": (
        lambda: pendulum(mass=None, weight=20.0), "'arm' has a weight of 20 N, and there is no",
    ),
    "gravity in inches": (
        lambda: pendulum(Gravity("g", y=-9.81), units="in-lbf-s", mass="2 lb", inertia="1 lb*in^2"),
        "-9.81 in/s², 0.0254 of the earth's 386.09 in/s²",
    ),
    "gravity in mm, model in m": (
        lambda: pendulum(Gravity("g", y=-9810.0)), "-9810 m/s², 1e+03 of the earth's",
    ),
    "two points at one place": (no_length, "points 'A' and 'B' of 'rod' are both at [0, 0] m"),
    "all masses in grams": (all_in_grams, "'coupler' has a mass of 600 kg, 2.83 steel cubes"),
}  # fmt: skip


@pytest.mark.parametrize("trap", IN_PYTHON)
def test_a_trap_in_python(trap):
    make, words = IN_PYTHON[trap]
    assert any(words in note for note in traps(make())), list(traps(make()))


def test_there_are_forty():
    assert len(TRAPS) + len(IN_DRAWINGS) + len(IN_PYTHON) >= 40


SILENT = [
    speed('"120 rad/s"'), speed('"3000 rpm"'), speed("25"), speed("157.08"),
    {"gravity": 'y = "-9.81 mm/s^2"'}, {"gravity": "y = -9810"}, {"gravity": "y = 0"},
    {"gravity": 'y = "+9.81 m/s^2"'}, {"gravity": "y = -1620"}, {"gravity": "x = 9810"},
    {"coupler": "mass = 0, cg = [140, 0]"}, {"rocker": 'mass = "1 kg", inertia = 0'},
    {"coupler": 'mass = 0, inertia = "9000 kg*mm^2", cg = [140, 0]'},
    {"coupler": "mass = 0.002, inertia = 9, cg = [140, 0]"},
    {"crank": 'mass = "5 kg", inertia = "0.1 kg*m^2"'},  # with a flywheel
    {"rocker": 'weight = "15 N", inertia = "5000 kg*mm^2", cg = [100, 0]'},
    {"loads": '[loads.s]\nspring = ["ground.O4", "crank.A"]\nstiffness = 2\nfree_length = 0'},
    {"loads": '[loads.W]\nforce = 40\nat = "coupler.B"\nangle = -90'},
]  # fmt: skip


@pytest.mark.parametrize("changes", SILENT, ids=str)
def test_it_is_not_said_where_it_is_plain(changes):
    assert not list(traps(four_bar(**changes)))


def test_a_plain_word_silences():
    origin = DRAWN.replace("cg = [180, 140]", "cg = [0, 0]")
    assert not list(traps(mbody.from_toml(origin)))
    meant = DRAWN.replace("law   = 0", "law   = 60").replace(
        "86.6] } }\ncoup", "86.6] }, guess = 60 }\ncoup"
    )
    assert not list(traps(mbody.from_toml(meant)))
    rim = 'shapes = { rim = { disc = "A", radius = 3000 } }'
    wheel = f'mass = "2 kg", inertia = "9 kg*m^2", cg = [140, 0], {rim}'
    assert not list(traps(four_bar(coupler=wheel)))
    assert not list(traps(pendulum(guess="60 rad", law="45 rad")))
    known = FOUR_BAR.format(**WELL).replace(
        "cg = [140, 0], points = { A", "cg = [14000, 0], points = { G = [14000, 0], A"
    )
    assert not [note for note in traps(mbody.from_toml(known)) if "cg of" in note]


def test_what_was_left_out_stays_left_out_in_a_file():
    for text in (
        DRAWN.replace("coupler.cg = [180, 140]\n", ""),
        DRAWN.replace("[180, 140]", "[0, 0]"),
    ):
        machine = mbody.from_toml(text)
        again = mbody.from_toml(mbody.to_toml(machine))
        assert list(traps(again)) == list(traps(machine)) and again == machine
    arms = [pendulum(mass=None, weight=20.0), pendulum(inertia=0.0), pendulum(cg=(0.0, 0.0))]
    arms.append(pendulum(Spring("s", "ground.Q", "arm.P", stiffness=2.0, free_length=0.0)))
    for machine in arms:
        assert list(traps(mbody.from_toml(mbody.to_toml(machine)))) == list(traps(machine))


@pytest.mark.parametrize("name", ["norton_fourbar", "watt_sixbar", "inline_six", "vehicle"])
@pytest.mark.parametrize("units", ["SI", "mm-N-s", "in-lbf-s", "ft-lbf-s"])
def test_units_change_nothing(name, units):
    made = in_units(gallery.load(name), units)
    assert not [note for note in traps(made) if "write the unit, as in" not in note]


REAL = {
    "a watch": """
        units = "mm-N-s"
        [bodies]
        balance.mass = "90 mg"
        balance.inertia = "1.4 mg*m^2/1000"
        balance.points = { O = [0, 0], pin = [1.1, 0] }
        fork.mass = "8 mg"
        fork.inertia = "20 mg*mm^2"
        fork.cg = [0.3, 0]
        fork.points = { O = [0, 0], horn = [3, 0] }
        [joints]
        O = { revolute = ["ground", "balance.O"] }
        F = { revolute = [{ body = "ground", point = [4.1, 0] }, "fork.O"] }
        [loads]
        hair = { torsion_spring = "balance", stiffness = "0.9 N*um/rad" }
        """,
    "a crane": """
        [ground]
        points = { O = [0, 0], C = [2, -1] }
        [bodies]
        boom.mass = "12 t"
        boom.inertia = "4e5 kg*m^2"
        boom.cg = [10, 0]
        boom.points = { O = [0, 0], C = [5, 0], T = [21, 0] }
        hook = { mass = "40 t", inertia = 5000 }
        [joints]
        O = { revolute = ["ground.O", "boom.O"] }
        T = { revolute = ["boom.T", "hook"] }
        [drivers]
        ram = { distance = ["ground.C", "boom.C"], law = "4 m + 0.05 m/s*t" }
        [gravity]
        y = -9.81
        """,
    "a turbocharger": """
        units = "mm-N-s"
        [bodies]
        rotor.mass = "110 g"
        rotor.inertia = "18 kg*mm^2"
        rotor.cg = [0.002, 0]
        rotor.points = { tip = [24, 0] }
        [joints]
        O = { revolute = ["ground", "rotor"] }
        [drivers]
        gas = { angle = "rotor", law = { constant_speed = { value = 0, speed = "120000 rpm" } } }
        """,
    "an arm in orbit": """
        [bodies]
        hub = { mass = 8000, inertia = 30000, points = { A = [1, 0] } }
        arm = { mass = 90, inertia = 300, cg = [3, 0], points = { A = [0, 0], B = [6, 0] } }
        [joints]
        A = { revolute = ["hub.A", "arm.A"] }
        """,
    "a pendulum on the moon": """
        [bodies]
        bob = { mass = 3, inertia = 0, cg = [0, -2] }
        [joints]
        O = { revolute = ["ground", "bob"] }
        [gravity]
        y = -1.62
        """,
    "a pendulum of a clock": """
        units = "cm-N-s"
        [bodies]
        rod.mass = "7 kg"
        rod.inertia = "200 kg*cm^2"
        rod.cg = [0, -95]
        rod.points = { O = [0, 0], crutch = [0, -15] }
        [joints]
        O = { revolute = ["ground", "rod.O"] }
        [gravity]
        y = "-9.81 m/s^2"
        """,
    "an engine": """
        units = "mm-N-s"
        [bodies]
        crank.mass = "9 kg"
        crank.inertia = "120000 kg*mm^2"
        crank.points = { O = [0, 0], A = [43, 0], B = [43, 0] }
        rod.mass = "600 g"
        rod.inertia = "2000 kg*mm^2"
        rod.cg = [40, 0]
        rod.points = { A = [0, 0], P = [144, 0] }
        other.mass = "600 g"
        other.inertia = "2000 kg*mm^2"
        other.cg = [40, 0]
        other.points = { A = [0, 0], P = [144, 0] }
        piston = { mass = "450 g" }
        second = { mass = "450 g" }
        [joints]
        O  = { revolute = ["ground", "crank.O"] }
        A  = { revolute = ["crank.A", "rod.A"] }
        B  = { revolute = ["crank.B", "other.A"] }
        P  = { revolute = ["rod.P", "piston"] }
        Q  = { revolute = ["other.P", "second"] }
        in = { prismatic = ["ground", "piston"] }
        at = { prismatic = [{ body = "ground", angle = 60 }, { body = "second", angle = 60 }] }
        [drivers]
        motor = { angle = "crank", law = { constant_speed = { value = 0, speed = "6000 rpm" } } }
        """,
    "a truss of nothing but statics": """
        [ground]
        points = { O = [0, 0], Q = [4, 0] }
        [bodies]
        a = { points = { O = [0, 0], T = [2, 3] } }
        b = { points = { Q = [4, 0], T = [2, 3] } }
        [joints]
        O = { revolute = ["ground.O", "a.O"] }
        Q = { revolute = ["ground.Q", "b.Q"] }
        T = { revolute = ["a.T", "b.T"] }
        [loads]
        W = { force = 500, at = "a.T", angle = -90 }
        """,
}


@pytest.mark.parametrize("name", REAL)
def test_real_mechanisms_bring_none(name):
    machine = mbody.from_toml("\n".join(line.strip() for line in REAL[name].splitlines()))
    assert not list(traps(machine))


def test_every_result_has_the_notes():
    """From one routine: driven and free motions, equilibria, what is made of them, JSON, text."""
    machine = four_bar(gravity="y = -9.81")
    (note,) = traps(machine)
    free = machine.without("motor")
    run = mbody.kinetostatics(machine, t=[0.0, 0.1])
    results = [
        run, mbody.kinematics(machine), mbody.statics(machine), mbody.mobility(machine),
        mbody.simulate(free, until=0.01), mbody.equilibrium(free), mbody.modes(free),
        mbody.assembly_modes(machine), mbody.dead_centres(machine), mbody.driver_range(machine),
        mbody.transmission(run, output="rocker"), mbody.free_body(run, "crank"),
        mbody.sweep(machine, {"crank.mass": [0.001, 0.002]}, measure="motor.effort", t=[0.0]),
        mbody.gradient(machine, "motor.effort", "crank.mass"), mbody.Simulator(free),
    ]  # fmt: skip
    for one in results:
        assert one.notes.count(note) == 1, one
    assert note in run.data()["notes"] and note[:40] in " ".join(str(run).split())
    assert note in mbody.report(machine).notes


def test_other_models_know_nothing_of_each_other():
    """A second mechanism of another scale beside the first changes no note."""
    machine = four_bar()
    small = Body("small", mass="1 mg", inertia="1 mg*mm^2", points={"A": (0, 0), "B": (2, 0)})
    machine.add(small, Revolute("small_pin", "ground", "small.A"))
    assert not list(traps(machine))


def test_thousands_of_bodies_cost_little():
    machine = Mechanism("chain")
    own = {"mass": 1.0, "inertia": 1 / 12, "cg": (0.5, 0.0), "points": {"A": (0, 0), "B": (1, 0)}}
    machine.add(*(Body(f"b{n}", **own) for n in range(1000)))
    places = ["ground", *(f"b{n}.B" for n in range(999))]
    machine.add(*(Revolute(f"J{n}", place, f"b{n}.A") for n, place in enumerate(places)))
    begin = time.process_time()
    assert not list(traps(machine))
    assert time.process_time() - begin < 1.0


def test_the_earths_gravity_is_known_by_value():
    for name in ("SI", "mm-N-s", "in-lbf-s", "ft-lbf-s", "cm-N-s"):
        for factor in (0.99, 1.0, 1.01):
            machine = Mechanism("m", units=name)
            machine.add(Gravity("g", y=-factor * unit_system(name).g))
            assert not list(traps(machine))
    assert math.isclose(unit_system("mm-N-s").g, 9806.65)
