"""Units: exact ratios against pint, consistent systems, sentences."""

import itertools
import math
import pickle
from fractions import Fraction

import numpy as np
import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mbody
from mbody.laws import ConstantSpeed
from mbody.quantities import FormulaError, Scope, convert, evaluate, parse, parse_unit, read
from mbody.quantities.units import (
    DIMENSIONS,
    NUMBER,
    SYMBOLS,
    UNIT_SYSTEMS,
    known,
    pint_unit,
    unit_system,
)
from tests.errors.test_errors import says
from tests.support.cases import each

pytestmark = pytest.mark.processor

PINT = pint.LazyRegistry(kwargs={"non_int_type": Fraction})
ROUNDED = 2.3e-16  # one rounding of a double, half a unit of its last digit

# how pint says what it does not read as we do
SAID = {
    **{'"': "inch", "'": "foot", "inches": "inch", "feet": "foot", "miles": "mile"},
    **{"lbs": "pound", "lbm": "pound", "slugs": "slug", "blob": "slinch", "blobs": "slinch"},
    **{"sec": "second", "°": "degree", "degrees": "degree", "kp": "kilogram_force"},
    **{"rev": "revolution"},
    **{"ozf": "ounce_force", "Nm": "N*m", "Nmm": "N*mm", "kNm": "kN*m", "mph": "mile/hour"},
    **{"hp": "550*foot*pound_force/second", "um": "micrometer"},
    **{"uH": "microhenry", "uF": "microfarad", "mohm": "milliohm", "kohm": "kiloohm"},
    **{"m\u03a9": "milliohm", "k\u03a9": "kiloohm", "m\u2126": "milliohm", "k\u2126": "kiloohm"},
    **{"\u03a9": "ohm", "\u2126": "ohm"},
}
SYSTEMS = [*UNIT_SYSTEMS, "cm-kN-s", "mm-kgf-ms", "yd-ozf-min", "mm-kg-s", "cgs", "m-t-s"]


def value(text, dimension=None, system="SI"):
    wanted = None if dimension is None else DIMENSIONS[dimension]
    return read(text, wanted).value(Scope(unit_system(system)))


# -- symbols ----------------------------------------------------------------------------------


@each("symbol", SYMBOLS)
def test_ratios_are_those_of_pint(symbol):
    unit = SYMBOLS[symbol]
    theirs = PINT(SAID.get(symbol, symbol)) * Fraction(1)
    powers = dict(theirs.dimensionality)
    names = {"[length]": "meter", "[mass]": "kilogram", "[time]": "second"}
    names |= {"[current]": "ampere", "[temperature]": "kelvin"}
    theirs = theirs.to({names[key]: power for key, power in powers.items()} or "radian")
    if unit.pi:  # pint has π to fifty digits
        assert float(theirs.m) == pytest.approx(unit.factor, rel=2 * ROUNDED)
    else:
        assert Fraction(theirs.m) == unit.ratio
    d = unit.dimension
    ours = {"[length]": d.length, "[mass]": d.mass, "[time]": d.time}
    ours |= {"[current]": d.current, "[temperature]": d.temperature}
    assert {key: power for key, power in ours.items() if power} == powers
    # a radian is one for pint: ours is an angle where pint's has a radian
    root = dict(PINT(SAID.get(symbol, symbol)).to_root_units().unit_items())
    assert root.get("radian", 0) == d.angle


def test_a_unit_is_known_by_its_symbol():
    assert known("kN").factor == 1000.0
    assert known("stone") is None
    assert pint_unit("stone").ratio == 14 * Fraction("0.45359237")
    for text in ("nonsense", "", "a b", "1", "x" * 41, "candela", "mole", "degC", "mm^2", "µ"):
        assert pint_unit(text) is None


@each(
    ("text", "dimension", "expected"),
    [
        ("5 arcmin", "angle", 5 * math.pi / 180 / 60),
        ("2 arcminute", "angle", 0.0005817764173314432),
        ("3 mrad", "angle", 0.003),
        ("6 arcsec/s", "angular velocity", math.pi / 180 / 600),
        ("4 cycle/s", "angular velocity", 8 * math.pi),
        ("2 mile/hour", "velocity", 2 * 1609.344 / 3600),
        ("3 dyne", "force", 3e-5),
        ("2 stone", "mass", 28 * 0.45359237),
        ("7 N*m/rad", "torsion stiffness", 7.0),
        ("9 N m/deg", "torsion stiffness", 9 * 180 / math.pi),
        ("5 Nm", "torque", 5.0),
        ("1/4 in", "length", 0.00635),
        ('0.25"', "length", 0.00635),
        ("12 in-lbf", "torque", 12 * 0.0254 * 4.4482216152605),
        ("5 kg·m²", "inertia", 5.0),
        ("5 kg*m^2", "inertia", 5.0),
        ("3 m/s²", "acceleration", 3.0),
        ("2 kg*m⁻", "inertia", None),
        ("8 N·s²/m⁴", "density", 8.0),
        ("90°", "angle", math.pi / 2),
        ("5 A", "current", 5.0),
        ("1.5 kV", "voltage", 1500.0),
        ("2 \u03a9", "resistance", 2.0),
        ("2 \u2126", "resistance", 2.0),
        ("3 V/A", "resistance", 3.0),
        ("40 mH", "inductance", 0.04),
        ("4 V*s/A", "inductance", 4.0),
        ("7 µF", "capacitance", 7e-6),
        ("0.2 N*m/A", "motor constant", 0.2),
        ("0.2 V*s/rad", "motor constant", 0.2),
        ("0.2 V s", "motor constant", 0.2),
        ("12 V / (1000 rpm)", "motor constant", 12.0 * 3.0 / (100.0 * math.pi)),
        ("300 K", "temperature", 300.0),
        ("5 millivolt", "voltage", 0.005),
        ("5 degR", "temperature", 5.0 * 5.0 / 9.0),
        ("3 l/min", "volume flow", 5e-5),
    ],
)
def test_texts_of_quantities(text, dimension, expected):
    if expected is None:
        with pytest.raises(FormulaError):
            value(text, dimension)
    else:  # a product of two roundings
        assert value(text, dimension) == pytest.approx(expected, rel=4 * ROUNDED)


# -- systems ----------------------------------------------------------------------------------


@each("name, length, mass, time", [("mm-kg-s", "mm", "kg", "s"), ("cgs", "cm", "gram", "s"),
                                   ("mks", "m", "kg", "s"), ("mm-t-s", "mm", "tonne", "s"),
                                   ("mm-kg-ms", "mm", "kg", "ms")])  # fmt: skip
def test_systems_by_mass_have_the_force_that_follows(name, length, mass, time):
    system = unit_system(name)
    force = (PINT(f"{mass}*{length}/{time}**2") * Fraction(1)).to("N").m
    assert system.unit("force").ratio == Fraction(force) == SYMBOLS[system.force].ratio
    assert system.unit("mass").ratio == SYMBOLS[system.mass].ratio


@each("name", SYSTEMS)
def test_systems_are_consistent(name):
    system = unit_system(name)
    ratio = {key: system.unit(key).ratio for key in DIMENSIONS}
    assert ratio["force"] == ratio["mass"] * ratio["length"] / ratio["time"] ** 2
    assert ratio["torque"] == ratio["force"] * ratio["length"]
    assert ratio["inertia"] == ratio["mass"] * ratio["length"] ** 2
    assert ratio["power"] == ratio["torque"] / ratio["time"]
    assert ratio["angle"] == ratio["number"] == ratio["current"] == ratio["temperature"] == 1
    assert ratio["voltage"] == ratio["power"]
    assert ratio["inductance"] == ratio["resistance"] * ratio["time"] == ratio["torque"]
    assert ratio["capacitance"] * ratio["resistance"] == ratio["time"]
    assert ratio["motor constant"] == ratio["torque"]
    for key, symbol in (("length", system.length), ("force", system.force), ("time", system.time)):
        assert ratio[key] == SYMBOLS[symbol].ratio
    g = Fraction("9.80665") * ratio["time"] ** 2 / ratio["length"]
    assert system.g == pytest.approx(float(g), rel=ROUNDED)
    assert pickle.loads(pickle.dumps(system)) == system == unit_system(system)


@each(("name", "dimension"), list(itertools.product(SYSTEMS, DIMENSIONS)))
def test_symbols_of_a_system_read_back(name, dimension):
    system = unit_system(name)
    if DIMENSIONS[dimension] == NUMBER:
        assert system.of(dimension) == ""
        return
    found = evaluate(parse_unit(system.of(dimension)), Scope(system))
    # in its own system a unit is one, to the last digit; a mass of three units is a quotient
    assert found.value == pytest.approx(1.0, rel=2 * ROUNDED)
    assert found.dimension == DIMENSIONS[dimension]
    assert convert(1.0, system.of(dimension), unit_system("SI").of(dimension)) == pytest.approx(
        float(system.unit(dimension).ratio), rel=4 * ROUNDED
    )


def test_a_custom_system_is_used():
    """1 kN on 1 kN·s²/cm accelerates at 1 cm/s²; the same in SI."""
    machine = mbody.Mechanism("m", units="cm-kN-s")
    machine.add(mbody.Body("b", mass="250 t", inertia="1 kg*m^2", points={"A": ("3 m", "1 in")}))
    b = machine["b"]
    assert b.mass == 2.5  # 2.5e5 kg over 1e5 kg a kN·s²/cm
    assert b.inertia == pytest.approx(1e-1, rel=ROUNDED)  # 1 kg·m² = 1 N·m·s² = 0.1 kN·cm·s²
    assert b.points["A"] == (300.0, 2.54)
    assert machine.units.of("torque") == "kN·cm" and machine.units.mass == "kN·s²/cm"


# -- exactness --------------------------------------------------------------------------------


@pytest.mark.parametrize("system", SYSTEMS)
@given(number=st.floats(-1e300, 1e300))
def test_a_number_in_its_own_unit_is_itself(system, number):
    own = unit_system(system)
    for dimension, unit in (("length", own.length), ("force", own.force), ("time", own.time)):
        found = value(f"{number!r} {unit}", dimension, system)
        assert found == number and math.copysign(1.0, found) == math.copysign(1.0, number)


@given(
    number=st.decimals(-(10**6), 10**6, allow_nan=False, places=6),
    pair=st.sampled_from(
        [
            *(("lbf", "force", "SI"), ("N", "force", "ft-lbf-s"), ("mm", "length", "in-lbf-s")),
            *(("slug", "mass", "mm-N-s"), ("psi", "pressure", "SI"), ("hp", "power", "ft-lbf-s")),
            *(("kip", "weight", "in-lbf-s"), ("h", "time", "SI"), ("mph", "velocity", "ft-lbf-s")),
        ]
    ),
)
def test_what_is_rational_is_rounded_once(number, pair):
    """Decimal times exact ratio of pint, one rounding: no double comes nearer."""
    symbol, dimension, system = pair
    one = PINT(SAID.get(symbol, symbol)) * Fraction(1)
    si = {"[length]": "meter", "[mass]": "kilogram", "[time]": "second"}
    ratio = one.to({si[key]: power for key, power in one.dimensionality.items()}).m
    exact = Fraction(number) * Fraction(ratio) / unit_system(system).unit(dimension).ratio
    assert value(f"{number:f} {symbol}", dimension, system) == float(exact)


@each(
    ("unit", "to", "expected"),
    [
        ("lbf in", "N m", 4.4482216152605 * 0.0254),
        ("rev/min", "rad/s", math.pi / 30),
        ("rpm", "deg/s", 6.0),
        ("Hz", "1/s", 1.0),
        ("1/min", "Hz", 1 / 60),
        ("kg/m^3", "N·s²/m⁴", 1.0),
        ("hp", "W", 745.69987158227022),
        ("mile/h", "km/h", 1.609344),
        ("psi", "kPa", 6.894757293168361),
        ("mm²", "m^2", 1e-6),
        ("arcmin", "deg", 1 / 60),
    ],
)
def test_convert(unit, to, expected):
    # NIST SP 811, appendix B; products of at most four rounded ratios
    assert convert(1.0, unit, to) == pytest.approx(expected, rel=1e-15)
    values = np.arange(6.0).reshape(2, 3)
    there = convert(values, unit, to)
    assert there.shape == (2, 3)
    np.testing.assert_allclose(convert(there, to, unit), values, rtol=1e-15)


# -- what was meant ---------------------------------------------------------------------------


@each(
    ("text", "dimension", "meant"),
    [
        ("10 lb/in", "stiffness", "10 lbf/in"),
        ("10 lbs", "force", "10 lbf"),
        ("3 lbm", "weight", "3 lbf"),
        ("3 oz", "force", "3 ozf"),
        ("5 kg", "weight", "5 kgf"),
        ("12 in-lb", "torque", "12 in-lbf"),
        ("4 lbf", "mass", "4 lb"),
        ("4 kgf", "mass", "4 kg"),
        ("5 Hz", "angular velocity", "5 rev/s"),
        ("-5 Hz", "angular velocity", "-5 rev/s"),
        ("300 rpm", "angle", "300 rev"),
        ("30 deg", "angular velocity", "30 deg/s"),
        ("5 N m", "torsion stiffness", "5 N m/rad"),
        ("5 N*m/rad", "torque", "5 N*m"),
        ("3 N*m*s", "torsion damping", "3 N*m*s/rad"),
        ("9.81 m/s", "acceleration", "9.81 m/s^2"),
        ("40 rad/s", "angular acceleration", "40 rad/s^2"),
        ("9.81 m/s^2", "velocity", "9.81 m/s"),
        ("9.81 m", "velocity", "9.81 m/s"),
        ("9.81 m", "acceleration", "9.81 m/s^2"),
    ],
)
def test_guesses_of_what_was_meant(text, dimension, meant):
    with pytest.raises(FormulaError) as caught:
        read(text, DIMENSIONS[dimension])
    assert str(caught.value).endswith(f"is wanted: did you mean {meant!r}?")
    assert evaluate(parse(meant), Scope()).dimension == DIMENSIONS[dimension]


@pytest.mark.parametrize(
    ("text", "dimension"),
    [("5 s", "mass"), ("5 kg*m^3", "length"), ("2 Pa", "force"), ("1 J", "power")],
)
def test_no_guess_where_none_is_near(text, dimension):
    with pytest.raises(FormulaError, match=r"is wanted$"):
        read(text, DIMENSIONS[dimension])


def test_guesses_stand_in_the_sentence_of_the_element():
    with says(mbody.ModelError, "'s': stiffness", "a stiffness (N/m)", "did you mean '10 lbf/in'?"):
        mbody.Spring("s", "a", "b", stiffness="10 lb/in")
    with says(mbody.ModelError, "'s': stiffness", "torsion stiffness (N·m/rad)", "'5 N m/rad'"):
        mbody.TorsionSpring("s", "a", stiffness="5 N m")
    with says(mbody.ModelError, "'m': law: speed", "angular velocity (rad/s)", "'5 rev/s'"):
        mbody.AngleDriver("m", "a", ConstantSpeed(0, "5 Hz"))
    with says(mbody.ModelError, "'d': coefficient", "'3 N*m*s/rad'"):
        mbody.TorsionDamper("d", "a", coefficient="3 N*m*s")
    with says(mbody.ModelError, "'d': law: ", "is an angle (rad), where a length (m)"):
        mbody.DistanceDriver("d", "a", "b", "3 deg")


@pytest.mark.parametrize(
    ("system", "dimension", "symbol"),
    [
        ("SI", "voltage", "V"),
        ("SI", "resistance", "\u03a9"),
        ("m-N-s", "inductance", "H"),
        ("SI", "capacitance", "F"),
        ("SI", "motor constant", "N·m/A"),
        ("in-lbf-s", "current", "A"),
        ("in-lbf-s", "voltage", "lbf·in/s/A"),
        ("mm-N-s", "resistance", "N·mm/s/A²"),
        ("ft-lbf-s", "temperature", "K"),
    ],
)
def test_symbols_of_electrical_quantities(system, dimension, symbol):
    """A volt is a watt per ampere; where the unit of power is no watt, it is written out."""
    assert unit_system(system).of(dimension) == symbol


def test_a_frequency_is_no_angular_velocity_but_a_motor_constant_has_no_angle():
    """Only mechanical literals must say whether they are by the radian."""
    with pytest.raises(FormulaError, match="angular velocity"):
        value("5 Hz", "angular velocity")
    assert value("0.05 V*s/rad", "motor constant") == value("0.05 N*m/A", "motor constant")
