"""Dimensions of formulas, against pint."""

import math
import operator

import numpy as np
import pint
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mbody.quantities import FormulaError, Scope, Valued, read
from mbody.quantities.units import DIMENSIONS, unit_system
from tests.support.formulas import worth

Q = pint.Quantity
ROUNDED = 2.3e-16  # one rounding


UNITS = ("mm", "in", "m", "kg", "lb", "s", "min", "N", "lbf", "N*m", "m/s", "kg*m^2", "Pa")
measures = st.tuples(st.integers(1, 99), st.sampled_from(UNITS)).map(
    lambda p: (f"{p[0]} {p[1]}", Q(float(p[0]), p[1].replace("^", "**")))
)


APPLY = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}


def combined(inside):
    def join(parts):
        (a, x), sign, (b, y) = parts
        try:
            value = None if x is None or y is None else APPLY[sign](x, y)
        except (pint.DimensionalityError, ZeroDivisionError):
            value = None
        return f"({a}) {sign} ({b})", value

    def raise_to(parts):
        (a, x), power = parts
        try:
            return f"({a})^{power}", None if x is None else x**power
        except ZeroDivisionError:
            return f"({a})^{power}", None

    return st.one_of(
        st.tuples(inside, st.sampled_from("+-*/"), inside).map(join),
        st.tuples(inside, st.sampled_from([2, 3, -1])).map(raise_to),
    )


@settings(max_examples=300)
@given(st.recursive(measures, combined, max_leaves=6))
def test_arithmetic_of_quantities_is_that_of_pint(pair):
    text, expected = pair
    try:
        found = worth(text)
    except FormulaError:
        found = None
    if expected is None:  # pint: units that do not fit, or a division by zero
        # 1/(1/0) is 0 to IEEE 754, an error to pint
        assert found is None or not np.isfinite(found.value) or found.value == 0.0
        return
    assert found is not None
    names = {"[length]": "m", "[mass]": "kg", "[time]": "s"}
    powers = dict(expected.dimensionality)
    d = found.dimension
    ours = {"[length]": d.length, "[mass]": d.mass, "[time]": d.time}
    assert {k: v for k, v in ours.items() if v} == {k: v for k, v in powers.items() if v}
    size = expected.to({names[key]: power for key, power in powers.items()} or "").magnitude
    assume(math.isfinite(size) and math.isfinite(found.value))
    # differences may cancel: a dozen roundings of the greatest part, which is below 1e40 of it
    scale = worth(text.replace(" - ", " + ")).value
    assert found.value == pytest.approx(size, rel=1e-13, abs=1e-13 * abs(scale))


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("2 m + 3 cm", "length", 2.03),
        ("2 N*3 m", "torque", 6.0),
        ("6 m/(2 s)", "velocity", 3.0),
        ("sqrt(4 m^2)", "length", 2.0),
        ("(8 m^3)^(1/3)", "length", 2.0),
        ("(4 m^2)^0.5", "length", 2.0),
        ("(2 s)^-1", "frequency", 0.5),
        ("hypot(3 m, 400 cm)", "length", 5.0),
        ("min(3 m, 1 ft)", "length", 0.3048),
        ("max(3 m, 1 ft)", "length", 3.0),
        ("abs(-3 m)", "length", 3.0),
        ("sin(30 deg)", None, 0.5),
        ("9*cos(60 deg)", None, 4.5),
        ("9*cos(60 deg) m", "length", 4.5),
        ("(9*cos(60 deg)) m", "length", 4.5),
        ("clamp(3 m, 1 ft, 50 cm)", "length", 0.5),
        ("clamp(-3 m, 1 ft, 50 cm)", "length", 0.3048),
        ("clamp(0.4 m, 1 ft, 50 cm)", "length", 0.4),
        ("deadband(3 m, 50 cm)", "length", 2.5),
        ("deadband(-3 m, 50 cm)", "length", -2.5),
        ("deadband(0.4 m, 50 cm)", "length", 0.0),
        ("3*sign(-2 m)", None, -3.0),
        ("3*step(2 m - 2 m)", None, 3.0),
        ("3*step(-2 m)", None, 0.0),
        ("step(1 m) N", "force", 1.0),
        ("cos(1 rad) + 1", None, math.cos(1.0) + 1.0),
        ("2 m*sin(pi/6)", "length", 1.0),
        ("atan2(1 mm, 1 mm)", "angle", math.pi / 4),
        ("asin(0.5)", "angle", math.pi / 6),
        ("acos(0.5) + 30 deg", "angle", math.pi / 2),
        ("2*atan(1)", "angle", math.pi / 2),
        ("exp(2 m/(1 m))", "number", math.exp(2.0)),
        ("log(2 m/(1 cm))", "number", math.log(200.0)),
        ("3 rad*2 m", None, 6.0),
        ("2*pi*5 Hz", "frequency", 10 * math.pi),
        ("5 m / (2 m)", "number", 2.5),
    ],
)
def test_dimensions_of_formulas(text, dimension, expected):
    found = worth(text)
    assert found.value == pytest.approx(expected, rel=4 * ROUNDED)
    if dimension is not None:
        assert found.dimension == DIMENSIONS[dimension]
    elif "rad*" not in text:
        assert found.dimension is None


def test_plain_formulas_are_in_the_units_of_their_field():
    scope = Scope(
        unit_system("mm-N-s"), {"a": Valued(2.0), "b": Valued(0.01, DIMENSIONS["length"])}
    )
    length, angle = DIMENSIONS["length"], DIMENSIONS["angle"]
    assert read("2*a", length).value(scope) == 4.0
    assert read("30*a", angle).value(scope) == 60.0  # rad in Python
    assert read("30*a", angle, "deg").value(scope) == pytest.approx(math.radians(60), rel=ROUNDED)
    assert read("30 deg*a", angle, "deg").value(scope) == pytest.approx(math.radians(60))
    assert read("asin(a/4)", angle, "deg").value(scope) == pytest.approx(math.radians(30))
    assert read("2*b", length).value(scope) == 0.02  # what has a unit is in mm already
    with pytest.raises(FormulaError, match=r"'2\*b' is a length \(m\), where a mass"):
        read("2*b", DIMENSIONS["mass"]).value(scope)


def test_literals_are_held_to_the_angle_and_products_are_not():
    """5 Hz is no 5 rad/s by itself; in a product a radian is one, as in books."""
    omega, k = DIMENSIONS["angular velocity"], DIMENSIONS["torsion stiffness"]
    for text in ("5 Hz", "-5 Hz", "5/2 Hz", "(5) Hz"):
        with pytest.raises(FormulaError, match="a frequency"):
            read(text, omega)
    assert read("2*pi*5 Hz", omega).value(Scope()) == pytest.approx(10 * math.pi)
    assert read("20 m/s / (2 m)", omega).value(Scope()) == 10.0
    with pytest.raises(FormulaError, match="a torque"):
        read("5 N*m", k)
    assert read("2 N*(3 m)", k).value(Scope()) == 6.0
    with pytest.raises(FormulaError, match=r"is a velocity .* where an angular velocity"):
        read("2*5 m/s", omega)


def test_a_parameter_with_a_unit_as_an_exponent_is_one_sentence():
    """Nothing is offered where no unit stands behind the exponent: trying that had no end."""
    scope = Scope(names={"a": Valued(3.0, DIMENSIONS["length"])})
    with pytest.raises(FormulaError, match=r"a length \(m\), it must be a plain number$"):
        read("2^a + 1", DIMENSIONS["number"]).value(scope)
