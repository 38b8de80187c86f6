"""Units of fields: every number of every element and law takes text and quantities."""

import math

import numpy as np
import pint
import pytest

from mbody import (
    AngleDriver,
    Body,
    Force,
    Input,
    Marker,
    Mechanism,
    ModelError,
    Rolling,
    Spring,
    Torque,
)
from mbody.laws import (
    Cam,
    Constant,
    ConstantAcceleration,
    ConstantSpeed,
    Dwell,
    Harmonic,
    Polynomial,
    Rise,
    Table,
)
from mbody.makers import polar
from mbody.model.body import Guess, SecondMoments, SlenderRod
from mbody.quantities.units import DIMENSIONS, name_of, of_quantity, unit_system
from tests.errors.test_errors import EXAMPLES, fields, is_number, make, says
from tests.support.cases import each

pytestmark = pytest.mark.processor
Q = pint.Quantity
ROUNDED = 2.3e-16  # one rounding of a double, half a unit of its last digit


#: What has a greatest value, below 3.
LIMITED = {"efficiency": 0.3, "restitution": 0.3, "pressure_angle": 0.3, "curvature": 0.3}
#: What a number is given with: friction has its radius, what sticks has what slides.
WITH = {
    ("Revolute", "restitution"): {"clearance": 0.01},
    ("Prismatic", "restitution"): {"limits": (0.0, 1.0)},
    ("PinSlot", "restitution"): {"clearance": 0.01},
    ("Distance", "restitution"): {"one_sided": "push"},
    ("CamFollower", "restitution"): {"one_sided": True},
    ("Gear", "restitution"): {"backlash": 0.01},
    ("RackPinion", "restitution"): {"backlash": 0.01},
    ("Revolute", "friction"): {"pin_radius": 0.01},
    ("Revolute", "static"): {"friction": 0.1, "pin_radius": 0.01},
    ("Revolute", "stribeck"): {"friction": 0.1, "static": 0.2, "pin_radius": 0.01},
    ("Prismatic", "height"): {"friction": 0.1, "length": 1.0},
    ("CamFollower", "pin_radius"): {"friction": 0.1, "roller": 5.0},
    ("Gear", "friction"): {"pressure_angle": 0.3},
    ("RackPinion", "friction"): {"pressure_angle": 0.3},
    ("Gear", "module"): {"pressure_angle": 0.3, "friction": 0.1},
    ("RackPinion", "module"): {"pressure_angle": 0.3, "friction": 0.1},
    ("Rolling", "restitution"): {"one_sided": True, "friction": 0.1},
    ("Rolling", "friction"): {"one_sided": True},
    ("Rolling", "static"): {"one_sided": True, "friction": 0.1},
    ("Clutch", "stribeck"): {"static": 2.0},
    ("BandBrake", "stribeck"): {"static": 2.0},
    ("BandBrake", "static"): {"force": 1.0},
    ("Belt", "stribeck"): {"static": 2.0},
    ("Belt", "static"): {"tension": 1.0},
    ("FrictionForce", "stribeck"): {"static": 2.0},
    ("Clutch", "static"): {"torque": 1.0},
    ("FrictionForce", "static"): {"force": 1.0},
    ("Contact", "friction"): {"static": 4.0},
    ("", "static"): {"friction": 0.1},
    ("", "stribeck"): {"friction": 0.1, "static": 0.2},
}


def dimension_name(field):
    return field.metadata.get("dimension") or field.metadata["law"]


def said(name):
    """How a sentence names a dimension."""
    first = name_of(DIMENSIONS[name])
    return f"{'an' if first[0] in 'aei' else 'a'} {first} ("


def wrong_for(name):
    return ("3 s", "time") if name in ("mass", "inertia") else ("3 kg", "mass")


@each("quantity", [False, True])
@each(("cls", "field"), fields(is_number))
def test_a_wrong_dimension_is_a_sentence(cls, field, quantity):
    if cls is Input:
        pytest.skip("an input measures what its value says")
    text, got = wrong_for(dimension_name(field))
    given = Q(3.0, text[2:]) if quantity else text
    changes = {field.name: given}
    name = dimension_name(field)
    wanted = "a plain number" if name == "number" else said(name)
    words = (f"'it': {field.name}: ", f"is {said(got)}", f"where {wanted}")
    with says(ModelError, *words, "wanted", element="it"):
        make(cls, **changes)


@each(("cls", "field"), fields(is_number))
def test_every_field_takes_text_and_quantities(cls, field):
    """3 units of its own in ft-lbf-s, in SI units: as text and as pint has it."""
    name = dimension_name(field)
    ours, si = unit_system("ft-lbf-s"), unit_system("SI")
    least = LIMITED.get(field.name, 3.0)
    size = least * float(ours.unit(name).ratio)
    text = f"{size!r} {si.of(name)}"
    said_to_pint = si.of(name).replace("·", "*").replace("²", "**2")
    either = {"stiffness", "coefficient", "mass", "weight", "speed"}
    alone = either if field.default is None else set()
    left_out = {key: None for key in EXAMPLES[cls] if key in alone and key != field.name}
    for given_as in (text, Q(size, said_to_pint)):
        beside = {"on_radius": 2.0} if (cls, field.name) == (Rolling, "phase") else {}
        if field.name == "exponent":
            beside = {"bulk_modulus": None}
        if field.name == "slew":
            beside = {"lag": 1.0}
        if (cls.__name__, field.name) == ("HydraulicCylinder", "rod"):
            beside = {"bore": 10.0}
        beside = beside or WITH.get((cls.__name__, field.name), {})
        beside = beside or WITH.get(("", field.name), {})
        element = make(cls, **{**left_out, **beside, field.name: given_as})
        assert element.pending
        machine = Mechanism("m", units="ft-lbf-s")
        rim = {"rim": {"disc": "P", "radius": 0.1}}
        machine.add(*(Body(body, points={"P": (0, 0), "Q": (0, 0)}, shapes=rim) for body in "ab"))
        machine.add(Input("u", 0.0), element)
        found = getattr(machine["it"], field.name)
        found = found.value if isinstance(found, Constant) else found
        assert not machine["it"].pending
        assert found == pytest.approx(least, rel=4 * ROUNDED)


LAWS = {
    Constant: {"value": 1.0},
    ConstantSpeed: {"value": 1.0, "speed": 1.0},
    ConstantAcceleration: {"value": 1.0, "speed": 1.0, "acceleration": 1.0},
    Harmonic: {"mean": 1.0, "amplitude": 1.0, "frequency": 1.0, "phase": 0.0},
    Rise: {"shape": "3-4-5", "height": 1.0, "start": 0.0, "duration": 1.0, "base": 0.0},
}
# of an angle by time
OF_ANGLE = {
    **dict.fromkeys(("value", "mean", "amplitude", "height", "base", "phase"), "angle"),
    **dict.fromkeys(("speed", "frequency"), "angular velocity"),
    **dict.fromkeys(("start", "duration"), "time"),
    "acceleration": "angular acceleration",
}
NUMBERS = [(law, key) for law, given in LAWS.items() for key in given if key != "shape"]


@each(("law", "key"), NUMBERS)
def test_every_number_of_a_law_takes_units(law, key):
    symbol = {"angle": "deg", "angular velocity": "deg/min", "time": "min"}.get(
        OF_ANGLE[key], "deg/min^2"
    )
    sizes = {"deg": math.pi / 180, "deg/min": math.pi / 10800, "min": 60.0}
    size = sizes.get(symbol, math.pi / 180 / 3600)
    for number in (f"3 {symbol}", Q(3.0, symbol)):
        machine = Mechanism("m")
        machine.add(Body("a"), AngleDriver("it", "a", law(**{**LAWS[law], key: number})))
        found = getattr(machine["it"].law, key)
        assert found == pytest.approx(3 * size, rel=4 * ROUNDED)


def test_tables_cams_and_polynomials_take_units():
    machine = Mechanism("m", units="mm-N-s")
    machine.add(Body("a", points={"P": (0, 0)}), Body("b"))
    cam = Cam([Rise("3-4-5", "1 kN", "0 s", "100 ms"), Dwell("1/60 min"),
               Rise("3-4-5", Q(-1.0, "kN"), 0, 0.1)], period=Q(0.1, "minute"))  # fmt: skip
    machine.add(
        Force("cam", "a.P", cam),
        Force("table", "a.P", Table(Q([0.0, 1.0, 2.0], "ms"), ["0 N", "1 kN", Q(1.0, "lbf")])),
        Torque("poly", "a", value=Polynomial(["1 N*m", "2 N*m/s", Q(3.0, "N*m/s**2")])),
        Spring("spring", "a", "b", law=Table([Q(0.0, "m"), "1 in"], [0, "4 kgf"])),
    )
    made = machine["cam"].value
    assert [s.duration for s in made.segments] == [0.1, 1.0, 0.1] and made.period == 6.0
    assert [made.segments[n].height for n in (0, 2)] == [1000.0, -1000.0]
    table = machine["table"].value
    np.testing.assert_allclose(table.x, [0, 1e-3, 2e-3], rtol=ROUNDED)
    np.testing.assert_allclose(table.y, [0, 1000, 4.4482216152605], rtol=2 * ROUNDED)
    np.testing.assert_allclose(machine["poly"].value.coefficients, [1e3, 2e3, 3e3], rtol=ROUNDED)
    np.testing.assert_allclose(machine["spring"].law.x, [0, 25.4], rtol=ROUNDED)
    np.testing.assert_allclose(machine["spring"].law.y, [0, 39.2266], rtol=ROUNDED)
    for make_it, words in (
        (lambda: Force("it", "a.P", Table([0, "1 mm"], [0, 1])), ("x", "a length", "a time")),
        (lambda: Force("it", "a.P", Table([0, 1], [0, "1 mm"])), ("y", "a length", "a force")),
        (lambda: Force("it", "a.P", Cam([Dwell("1 N")], 1.0)), ("duration", "a force", "a time")),
        (lambda: Torque("it", "a", value=Polynomial([0, "1 N*m"])), ("c1", "a torque", "a power")),
        (
            lambda: Force("it", "a.P", Table(Q([0, 1], "mol"), [0, 1])),
            ("x", "not a quantity of length"),
        ),
    ):
        with says(ModelError, *words):
            make_it()


@pytest.mark.parametrize("pints", [False, True], ids=["text", "pint"])
def test_places_guesses_and_spreads_take_units(pints):
    """Points, polar and not, markers with an angle, a rough pose, and how mass is spread."""
    to = (lambda text: Q(float(text.split()[0]), text.split()[1])) if pints else (lambda text: text)
    machine = Mechanism("m", units="mm-N-s", ground={"O": (to("1 m"), to("2 cm"))})
    body = Body(
        "a",
        mass=to("2 lb"),
        cg=polar(to("10 in"), to("30 deg")),
        points={"A": (to("1 ft"), 5.0), "B": polar(7.0, to("90 deg"))},
        guess=Guess(to("45 deg"), to("1 m"), 3.0),
        spread=SlenderRod(to("60 deg")),
    )
    other = Body("b", spread=SecondMoments(Q(2.0, "g*m**2") if pints else "2 g*m^2", 1.0))
    machine.add(body, other)
    machine.add(
        Force("F", Marker("a", (to("1 m"), 2.0), to("10 deg")), to("3 kN"), angle=to("20 deg"))
    )
    a, force = machine["a"], machine["F"]
    found = [
        *machine.ground.points["O"],
        *(a.mass, a.cg.r, a.cg.angle, *a.points["A"], a.points["B"].angle),
        *(a.guess.angle, a.guess.x, a.guess.y, a.spread.angle, machine["b"].spread.xx),
        *(*force.at.point, force.at.angle, force.value.value, force.angle),
    ]
    pi = math.pi
    expected = [1000, 20, 0.90718474e-3, 254, pi / 6, 304.8, 5, pi / 2, pi / 4, 1000, 3, pi / 3]
    expected += [2.0, 1000, 2, pi / 18, 3000, pi / 9]  # 2e-3 kg·m² are 2 t·mm²
    np.testing.assert_allclose(found, expected, rtol=4 * ROUNDED)


def test_quantities_without_a_dimension_are_plain():
    assert of_quantity(2.0) is None and of_quantity("2 m") is None
    machine = Mechanism("m", parameters={"n": Q(2.5, "dimensionless"), "w": Q(1.0, "rpm")})
    machine.add(Body("it", mass=Q(3, "dimensionless"), inertia="n"))
    assert (machine["it"].mass, machine["it"].inertia) == (3.0, 2.5)
    assert machine.parameters.scope().names["w"].value == pytest.approx(
        math.pi / 30, rel=4 * ROUNDED
    )
    assert name_of(machine.parameters.scope().names["w"].dimension) == "angular velocity"
