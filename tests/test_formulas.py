"""Formulas and parameters: the grammar against Python's own, units against pint, dependants."""

import copy
import itertools
import math
import operator
import pickle
import re

import numpy as np
import pint
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mbody import (
    AngleDriver,
    Body,
    Force,
    Mechanism,
    ModelError,
    Revolute,
    assemble,
    kinetostatics,
    polar,
)
from mbody.files.model.read import built
from mbody.files.model.write import as_data
from mbody.laws import ConstantAcceleration, Rise, Table
from mbody.quantities import (
    FUNCTIONS,
    FormulaError,
    Parameters,
    Scope,
    Valued,
    evaluate,
    parse,
    parse_unit,
    read,
)
from mbody.quantities.deferred import formulas_in, is_pending
from mbody.quantities.tree import Binary, Measured, Name, Negative, Plain
from mbody.quantities.units import DIMENSIONS, known, name_of, unit_system
from tests.linkages import random_linkage, times_within
from tests.test_errors import says

Q = pint.UnitRegistry().Quantity
SI = unit_system("SI")
ROUNDED = 2.3e-16  # one rounding


def worth(text, system="SI", **names):
    """Value of a formula; names are plain numbers, or texts with units."""
    scope = Scope(unit_system(system))
    known = {
        key: evaluate(parse(own), scope) if isinstance(own, str) else Valued(own)
        for key, own in names.items()
    }
    return evaluate(parse(text), Scope(unit_system(system), known))


# -- the grammar ------------------------------------------------------------------------------

WORDS = ("a", "b", "k_2", "Θ", "l2")
VALUES = dict(zip(WORDS, map(np.float64, (1.7, -0.3, 12.0, 0.02, 3.5)), strict=True))


class Number:
    """A double that Python's grammar puts together; powers are NumPy's, as ours are."""

    def __init__(self, value):
        self.value = np.float64(value)

    def __neg__(self):
        return Number(-self.value)

    def __pos__(self):
        return self

    def __pow__(self, other):
        return Number(np.power(np.asarray(self.value), other.value))


def _joining(name):
    apply = getattr(np.float64, name)
    return lambda self, other: Number(apply(self.value, other.value))


for name in ("__add__", "__sub__", "__mul__", "__truediv__"):
    setattr(Number, name, _joining(name))


def _called(function):
    return lambda *given: Number(function(*(part.value for part in given)))


COMPUTE = {
    **{
        name: _called(getattr(np, name))
        for name in ("sin", "cos", "tan", "sqrt", "abs", "exp", "log", "hypot")
    },
    **{"min": _called(np.minimum), "max": _called(np.maximum), "pi": Number(np.pi), "F": Number},
}
NUMERAL = re.compile(r"(?<![\w.])((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")
ONE = [name for name, count in FUNCTIONS.items() if count == 1 and name in COMPUTE]
TWO = [name for name, count in FUNCTIONS.items() if count == 2 and name in COMPUTE]
numerals = st.sampled_from(["2", "3.", ".5", "0.25", "1e2", "7E-1", "10", "1.5e+1", "0"])


def grown(inside):
    """Texts put together without brackets: what binds tighter is for the grammar to say."""
    operators = st.sampled_from(["+", "-", "*", "/", "^", "**", " + ", " - ", " * ", " / ", " ^ "])
    return st.one_of(
        st.tuples(inside, operators, inside).map("".join),
        st.tuples(st.sampled_from(["-", "+", "- "]), inside).map("".join),
        inside.map(lambda text: f"({text})"),
        st.tuples(st.sampled_from(ONE), inside).map(lambda p: f"{p[0]}({p[1]})"),
        st.tuples(st.sampled_from(TWO), inside, inside).map(lambda p: f"{p[0]}({p[1]}, {p[2]})"),
    )


texts = st.recursive(numerals | st.sampled_from([*WORDS, "pi"]), grown, max_leaves=8)


@settings(max_examples=400)
@given(texts)
def test_arithmetic_is_that_of_python(text):
    """Precedence, association and every function, by `eval` of the same text."""
    # a minus on a power's exponent is one thing for both; so is a - -b
    pythons = NUMERAL.sub(r"F(\1)", text.replace("^", "**"))
    with np.errstate(all="ignore"):
        names = {name: Number(own) for name, own in VALUES.items()}
        expected = eval(pythons, {**COMPUTE, **names}).value
    found = worth(text, **VALUES)
    assert found.dimension is None
    np.testing.assert_array_equal(found.value, expected)  # the same roundings in the same order
    spread = " ".join(re.findall(r"\*\*|[\w.]+(?<=e)[+-]\d+|[\w.]+|\S", text))
    if "e+" not in text and "E-" not in text:
        assert parse(spread) == parse(text)


def test_precedence_by_hand():
    for text, expected in {
        "2*a^2": 2 * 1.7**2,
        "-a^2": -(1.7**2),
        "(-a)^2": 1.7**2,
        "2^3^2": 512.0,
        "(2^3)^2": 64.0,
        "2^-1": 0.5,
        "8/4/2": 1.0,
        "8 - 4 - 2": 2.0,
        "2 - -3": 5.0,
        "a²": 1.7**2,
        "2·a−1": 2 * 1.7 - 1,
        "-2²": -4.0,
        "+a": 1.7,
        "10⁰ + 2⁵": 33.0,
        "1/4*a": 0.25 * 1.7,
        "pi": math.pi,
    }.items():
        assert worth(text, a=1.7).value == pytest.approx(expected, rel=ROUNDED), text


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("20 lbf/in", "20*(1 lbf)/(1 in)"),
        ("20 lbf / in", "20*(1 lbf)/(1 in)"),
        ("1/4 in", "0.25*(1 in)"),
        ("1 / 4 in", "(1/4)/(1 in)"),
        ("3/8 in^2", "0.375*(1 in)*(1 in)"),
        ("12 in-lbf", "12*(1 in)*(1 lbf)"),
        ("12 lbf in", "12*(1 in)*(1 lbf)"),
        ("12 lbf·in", "12*(1 in)*(1 lbf)"),
        ("5 kg·m²", "5*(1 kg)*(1 m)^2"),
        ("5 kg*m**2", "5*(1 kg)*(1 m)^2"),
        ("5 N*m*s^-1", "5*(1 N)*(1 m)/(1 s)"),
        ("-40 rad/s^2", "-(40*(1 rad)/(1 s)^2)"),
        ("2*3 mm^2", "6*(1 mm)*(1 mm)"),
        ("(2 mm)^2", "4*(1 mm)*(1 mm)"),
        ("10 m/2 s", "5*(1 m)/(1 s)"),
        ("10 m/(2 s)", "5*(1 m)/(1 s)"),
        ('0.25"', "0.25*(1 in)"),
        ("6'", "6*(1 ft)"),
        ("90°", "90*(1 deg)"),
        ("1 rev/min", "1*(1 rev)/(1 min)"),
        ("2 mm - 1 s*m/s", "(2*(1 mm)) - (1*(1 m))"),
        ("N*m", "1*(1 N)*(1 m)"),
        ("60 deg/s", "60*(1 deg)/(1 s)"),
        ("3 furlong", "3*(1 furlong)"),
        ("5 min", "300*(1 s)"),
        ("min(3, 5) mm", "3*(1 mm)"),
        ("sqrt(4) in", "2*(1 in)"),
    ],
)
def test_units_bind_tighter_than_arithmetic(text, same):
    found, expected = worth(text), worth(same)
    assert found.dimension == expected.dimension
    assert found.value == pytest.approx(expected.value, rel=6 * ROUNDED)  # a few more products


def test_units_behind_names_and_brackets():
    names = {"a": 2.0, "b": 3.0, "l": "15 in"}
    assert worth("(a+b) mm", **names).value == 0.005
    assert worth("a mm", **names).value == 0.002
    assert worth("2*a deg", **names).value == pytest.approx(math.radians(4.0), rel=ROUNDED)
    assert worth("sqrt(a*b + 3) in", **names).value == pytest.approx(0.0762, rel=2 * ROUNDED)
    assert worth("-a lbf/in", **names).dimension == DIMENSIONS["stiffness"]
    assert worth("l/2", **names).value == pytest.approx(0.1905, rel=ROUNDED)
    for text in ("l mm", "(l + 1 mm) m", "(l/1 s) s"):
        with pytest.raises(FormulaError, match="already: leave the unit out"):
            worth(text, **names)
    # a parameter that is called as a unit: the word right behind a number is the unit
    assert worth("2*m + m", m=3.0).value == 9.0
    assert worth("2 m", m=3.0).dimension == DIMENSIONS["length"]
    # and so is what is joined to it without a space; apart it is the parameter
    assert worth("2 N*m", m=3.0).dimension == DIMENSIONS["torque"]
    assert worth("20 N/m", m=3.0).dimension == DIMENSIONS["stiffness"]
    assert worth("20 N/m", m="3 kg").value == 20.0
    assert worth("20 N / m", m="4 kg") == Valued(5.0, DIMENSIONS["acceleration"])
    assert worth("20 N * m", m=3.0) == Valued(60.0, DIMENSIONS["force"])
    # a length that is called m cannot be told from metres by what comes out
    with pytest.raises(FormulaError, match=r"'m' in 'N·m' is a unit, and a parameter that"):
        worth("2 N*m", m="3 m")


def test_trees():
    assert parse("1.5 lbf") == Measured(Plain(parse("1.5").value), known("lbf"), ("lbf",))
    assert parse("-a") == Negative(Name("a"))
    assert parse("a + b*c") == Binary("+", Name("a"), Binary("*", Name("b"), Name("c")))
    assert parse("a^b^c") == Binary("^", Name("a"), Binary("^", Name("b"), Name("c")))
    assert parse("crank.A.x") == Name("crank.A.x")
    assert parse_unit("1/s") == Binary("/", Plain(1), parse("1 s"))
    assert parse("1/3 in").of == Plain(parse("1").value / 3)  # exact, as a fraction


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "it is empty: give a number"),
        ("  ", "it is empty"),
        ("2 +", "ends where a number is wanted"),
        ("(2", "lacks a ')'"),
        ("sin(2", "lacks a ')'"),
        ("2)", "a '(' is missing"),
        ("* 2", "has '*' where a number is wanted"),
        ("2 3", "an operator is missing before '3'"),
        ("2 aaa", "there is no unit 'aaa'"),
        ("5 kgm", "there is no unit 'kgm'"),
        ("3,5 mm", "a decimal point is wanted, not a comma"),
        ("a, b", "the ',' stands in no function"),
        ("sine(2)", "there is no function 'sine' (there are: sin, "),
        ("sin(1, 2)", "sin takes one number, not 2"),
        ("atan2(1)", "atan2 takes two numbers, not 1"),
        ("5 mm^a", "the power of the unit 'mm' must be one digit"),
        ("5 mm^12", "must be one digit"),
        ("2 $", "holds '$', which no formula has"),
        ("__import__('os')", "no function '__import__'"),
        ("a.__class__", None),
        ("a[0]", "holds '['"),
        ("1e999999999", "no number that a computer holds"),
        ("9" * 401, "no number that a computer holds"),
        ("(" * 41 + "1" + ")" * 41, "nested more than 40 deep"),
        ("-" * 41 + "1", "nested more than 40 deep"),
        ("+".join(["a"] * 302), "has 301 operations, at most 200"),
        ("a" * 2001, "2001 characters long, at most 2000"),
        ('"', "without a number"),
        ("a = 2", "holds '='"),
        ("2 % 3", "holds '%'"),
        ("1_000", "there is no unit '_000'"),
    ],
)
def test_what_is_no_formula(text, words):
    if words is None:  # a name that nothing has
        with pytest.raises(FormulaError, match="there is no parameter"):
            worth(text)
        return
    with pytest.raises(FormulaError) as caught:
        parse(text)
    assert words in str(caught.value)
    assert len(str(caught.value)) < 300


@given(st.text(max_size=30))
def test_any_text_is_a_formula_or_a_sentence(text):
    try:
        found = worth(text)
    except FormulaError as error:
        assert str(error) and "\n" not in str(error).replace(repr(text), "")
    else:
        assert np.ndim(found.value) == 0


# -- dimensions -------------------------------------------------------------------------------

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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("5 in + 2", "it adds a length (m) and a plain number: give every number its unit"),
        ("5 in - 2 s", "it subtracts a length (m) and a time (s)"),
        ("2^(3 m)", "an exponent is a length (m), it must be a plain number"),
        ("(2 m)^a", "the power of a length (m) must be a number that is written out"),
        ("sin(2 m)", "'sin' takes an angle, not a length (m)"),
        ("asin(2 m)", "'asin' takes a plain number, not a length (m)"),
        ("exp(2 s)", "'exp' takes a plain number, not a time (s)"),
        ("hypot(3 m, 4)", "it gives 'hypot' a length (m) and a plain number"),
        ("atan2(1 m, 1 s)", "it gives 'atan2' a length (m) and a time (s)"),
        ("asin(0.5) + 1", "it adds an angle (rad) and a plain number"),
        ("b + 1 mm", "it adds a plain number and a length (m)"),
        ("no*2", "there is no parameter 'no' (there are: 'a', 'b')"),
        ("x + 1", "'x' stands only in laws of a stretch, an angle or a rate"),
    ],
)
def test_dimensions_that_do_not_fit(text, words):
    with pytest.raises(FormulaError) as caught:
        worth(text, a=2.0, b=3.0)
    assert words in str(caught.value)


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
    """5 Hz is no 5 rad/s where it stands alone; in a product a radian is one, as in books."""
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


def test_no_value_is_a_sentence():
    for text in ("1/0", "log(0)", "sqrt(-1)", "0/0", "1e300*1e300", "-1/0"):
        with pytest.raises(FormulaError, match=r"comes to .*, it must be finite"):
            read(text, DIMENSIONS["length"])


# -- arrays -----------------------------------------------------------------------------------


@settings(max_examples=150)
@given(texts, st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=4))
def test_arrays_are_the_numbers_one_by_one(text, column):
    tree = parse(text)
    whole = evaluate(tree, Scope(names={**_named(VALUES), "a": Valued(np.array(column))}))
    each = [
        evaluate(tree, Scope(names={**_named(VALUES), "a": Valued(np.float64(x))})).value
        for x in column
    ]
    # NumPy's vector functions may round otherwise than its scalar ones, a few units each
    found = np.broadcast_to(whole.value, len(column))
    finite = np.isfinite(each) & (np.abs(each) < 1e6)
    assume(not re.search(r"(sin|cos|tan|exp|\^|\*\*).*(sin|cos|tan|exp|\^|\*\*)", text))
    np.testing.assert_allclose(found[finite], np.array(each)[finite], rtol=1e-9, atol=1e-9)


def _named(values):
    return {name: Valued(value) for name, value in values.items()}


def test_formulas_over_a_batch():
    a = np.array([1.0, 2.0, 4.0])
    scope = Scope(SI, {"a": Valued(a, DIMENSIONS["length"])})
    formula = read("2*a + 1 cm", DIMENSIONS["length"])
    np.testing.assert_array_equal(formula.value(scope), 2 * a + 0.01)
    with pytest.raises(FormulaError, match="comes to inf"):
        read("1 m^2/(a - 2 m)", DIMENSIONS["length"]).value(scope)


# -- parameters -------------------------------------------------------------------------------

CHAIN = {"a": 2.0, "b": "3*a", "c": "a + b", "d": "c^2 - b", "e": "d/c"}


def by_python(given):
    """The same chain by Python, from the first to the last."""
    known = {}
    for name in "abcde":
        own = given[name]
        known[name] = eval(own.replace("^", "**"), {}, known) if isinstance(own, str) else own
    return known


def test_the_order_of_parameters_does_not_matter():
    expected = by_python(CHAIN)
    for order in itertools.permutations(CHAIN):
        scope = Parameters({name: CHAIN[name] for name in order}, SI).scope()
        assert {name: scope.names[name].value for name in CHAIN} == expected


@given(st.dictionaries(st.sampled_from("abcde"), st.floats(0.5, 5.0)))
def test_parameters_of_other_values(values):
    scope = Parameters(CHAIN, SI).scope(values)
    expected = by_python({**CHAIN, **values})
    found = {name: scope.names[name].value for name in CHAIN}
    # a power of NumPy and one of Python may differ by an ulp, and a few follow on each other
    assert found == pytest.approx(expected, rel=1e-14)


def test_dimensions_of_parameters():
    given = {"l": "10 in", "w": "l/2", "f": "3 lbf", "k": "f/w", "phi": "atan2(w, l)", "n": 3}
    names = Parameters(given, unit_system("in-lbf-s")).scope().names
    known = {name: name_of(v.dimension) if v.dimension else "" for name, v in names.items()}
    assert known == {"l": "length", "w": "length", "f": "force", "k": "stiffness", "phi": "angle",
                     "n": ""}  # fmt: skip
    assert names["k"].value == pytest.approx(0.6, rel=2 * ROUNDED)
    assert names["phi"].value == math.atan2(5.0, 10.0)
    # another value does not change what it measures
    assert Parameters(given, SI).scope({"f": 5.0}).names["k"].dimension == DIMENSIONS["stiffness"]


def test_a_value_of_its_own_needs_no_formula():
    """b = 1/a at a = 0 has no value, and needs none where b is given."""
    scope = Parameters({"a": 1.0, "b": "1/a"}, SI).scope({"a": 0.0, "b": 5.0})
    assert scope.names["b"].value == 5.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"a": "b", "b": "a"}, ("made of each other", "give one of them a number")),
        ({"a": "a + 1"}, ("a → a", "made of each other")),
        ({"a": "b", "b": "2*c", "c": "sqrt(a)"}, ("the parameters", "→", "each other")),
        ({"a": "2*zz"}, ("parameter 'a'", "no parameter 'zz'")),
        ({"a": "5 in + 2"}, ("parameter 'a'", "adds a length")),
        ({"a": "1/0"}, ("parameter 'a'", "comes to inf")),
        ({"a": math.nan}, ("parameter 'a' is nan", "finite")),
        ({"a": None}, ("parameter 'a' must be a number, not None",)),
        ({"a": True}, ("parameter 'a' must be a number, not True",)),
        ({"a": "2*t"}, ("parameter 'a' is '2*t'", "only a law may change with 't'")),
        ({"sin": 2.0}, ("the name 'sin' is kept for formulas",)),
        ({"t": 2.0}, ("the name 't' is kept",)),
        ({"pi": 3.0}, ("the name 'pi' is kept",)),
        ({"a b": 2.0}, ("'a b' cannot name a parameter", "letters")),
        ({"2a": 2.0}, ("cannot name a parameter",)),
        ({"a.b": 2.0}, ("cannot name a parameter",)),
        ({"a·b": 2.0}, ("cannot name a parameter",)),
        ({"e\u0301": 2.0}, ("cannot name a parameter",)),
        ({"a" * 41: 2.0}, ("cannot name a parameter", "at most 40")),
        ({3: 2.0}, ("cannot name a parameter",)),
        ([("a", 2.0)], ("parameters must be a dict",)),
    ],
)
def test_parameters_that_do_not_serve(given, words):
    with says(ModelError, *words):
        Mechanism("m", parameters=given)


# -- systems with other values ------------------------------------------------------------------


def with_parameters(machine, values):
    """A linkage whose lengths share `s`, its masses `M`, its loads and speeds others."""

    def times(value, name):
        return f"{value!r}*{name}" if isinstance(value, (int, float)) else value

    def point(value):
        if isinstance(value, dict):
            return {**value, "r": times(value["r"], "s")}
        return [times(part, "s") for part in value]

    def place(value):
        if isinstance(value, dict) and not isinstance(value.get("point", ""), str):
            return {**value, "point": point(value["point"])}
        return value

    data = as_data(machine)
    for body in [data["ground"], *data["bodies"].values()]:
        body["points"] = {key: point(own) for key, own in body.get("points", {}).items()}
        for key in ("mass", "weight", "inertia"):
            if key in body:
                body[key] = times(body[key], "M")
        if "cg" in body:
            body["cg"] = point(body["cg"])
    for joint in data["joints"].values():
        kind = next(iter(joint))
        joint[kind] = [place(own) for own in joint[kind]]
        if "length" in joint:
            joint["length"] = times(joint["length"], "s")
    law = data["drivers"]["motor"]["law"]["constant_acceleration"]
    law["speed"] = f"{law['speed']!r}*w"
    for load in data.get("loads", {}).values():
        for kind in ("spring", "damper"):
            if kind in load:
                load[kind] = [place(own) for own in load[kind]]
        if "at" in load:
            load["at"] = place(load["at"])
        if "stiffness" in load:
            load["stiffness"] = times(load["stiffness"], "k")
        if "free_length" in load:
            load["free_length"] = times(load["free_length"], "s")
    data["parameters"] = {"s": "(r + 1)/2", "r": 1.0, "M": "M2/3", "M2": 3.0, "w": 1, "k": "M*w"}
    data["parameters"] |= values
    return built(data)


@pytest.mark.parametrize("seed", range(4))
def test_other_values_are_the_mechanism_described_anew(seed):
    machine, turn = random_linkage(seed, 2, sliders=seed % 2 == 0, extras=seed > 1)
    times = times_within(machine, 0.5 * turn, 5)
    base = with_parameters(machine, {})
    columns = {"r": np.array([0.9, 1.0, 1.3]), "M2": np.array([3.0, 4.0, 0.5]), "w": 1.25}
    system = assemble(base)
    batch = kinetostatics(system.with_values(columns), t=times)
    for n in range(3):
        values = {key: float(np.broadcast_to(own, 3)[n]) for key, own in columns.items()}
        anew = kinetostatics(with_parameters(machine, values), t=times)
        own = kinetostatics(system.with_values(values), t=times)
        # closed to 1e-12 of the size each, times the condition of the loops, below a hundred
        for one, tolerance in ((own, 1e-10), (anew, 1e-10)):
            scale = np.abs(anew.effort("motor")).max()
            np.testing.assert_allclose(
                batch.effort("motor")[n], one.effort("motor"), atol=tolerance * scale
            )
            for joint in machine.joints:
                a, b = batch.reaction(joint.name), one.reaction(joint.name)
                size = max(np.abs(b.magnitude).max(), 1.0)
                np.testing.assert_allclose(a.fx[n], b.fx, atol=tolerance * size)
                np.testing.assert_allclose(a.fy[n], b.fy, atol=tolerance * size)


def crank(**more):
    """A crank whose numbers follow parameters."""
    machine = Mechanism("m", parameters={"a": 2.0, "b": "3*a", "c": "a + b"}, **more)
    machine.add(
        Body("crank", mass="a", inertia="b", cg=("a/2", 0), points={"A": polar("c", "0.1*a")}),
        Revolute("O", "ground", "crank"),
        AngleDriver("motor", "crank", ConstantAcceleration("0.1*a", "b", 0.0)),
        Force("F", "crank.A", "a*sin(b*t)", angle="c"),
    )
    return machine


def test_numbers_follow_and_are_cut_off():
    system = assemble(crank())
    names = ("crank.mass", "crank.inertia", "crank.A.r", "motor.law.speed", "F.angle", "c")

    def have(system):
        return [float(system.values[name]) for name in names]

    assert have(system) == [2, 6, 8, 6, 8, 8]
    assert have(system.with_values(a=3.0)) == [3, 9, 12, 9, 12, 12]
    assert have(system.with_values(b=1.0)) == [2, 1, 3, 1, 3, 3]
    # b keeps the value that it was given, c goes on following
    assert have(system.with_values(b=1.0).with_values(a=4.0)) == [4, 1, 5, 1, 5, 5]
    # a number of its own leaves its parameter, then and later
    cut = system.with_values({"crank.mass": 7.0})
    assert have(cut) == [7, 6, 8, 6, 8, 8]
    assert have(cut.with_values(a=3.0)) == [7, 9, 12, 9, 12, 12]
    assert have(system.with_values({"crank.mass": 7.0, "a": 3.0})) == [7, 9, 12, 9, 12, 12]
    assert have(system) == [2, 6, 8, 6, 8, 8]
    law = system.with_values(a=3.0).law_of(system.mechanism["F"], "value")
    assert law(0.1) == pytest.approx(3.0 * math.sin(0.9), rel=4 * ROUNDED)


def test_a_batch_of_parameters():
    a = np.array([1.0, 2.0, 3.0])
    system = assemble(crank()).with_values(a=a)
    np.testing.assert_array_equal(system.values["F.angle"], 4 * a)
    one = system.design(2)
    assert one.values["crank.mass"] == 3.0 and one.values["b"] == 9.0
    with says(ModelError, "'crank.mass' is -1 kg, it must not be negative"):
        system.with_values(a=np.array([1.0, -1.0, 2.0]))
    with says(ModelError, "'b' has 2 values, others have 3"):
        system.with_values(b=np.ones(2))
    with says(ModelError, "there is no number 'z'"):
        system.with_values(z=1.0)
    with says(ModelError, "must be finite"):
        system.with_values(a=math.inf)


def test_a_parameter_without_a_value_is_a_sentence():
    machine = Mechanism("m", parameters={"a": 2.0, "b": "1/(a - 1)"})
    machine.add(Body("crank", mass="sqrt(a)", inertia="b"), Revolute("O", "ground", "crank"))
    machine.add(AngleDriver("motor", "crank", 0.0))
    system = assemble(machine)
    with says(ModelError, "parameter 'b'", "comes to inf"):
        system.with_values(a=1.0)
    with says(ModelError, "'crank.mass'", "comes to nan"):
        system.with_values(a=-1.0)


@pytest.mark.parametrize(
    "element",
    [
        Force("F", "crank", Table([0, "T"], [0, 1])),
        Force("F", "crank", Table([0, "T"], [0, 1]), angle="T"),  # in both a table and a number
        Body("b", guess="T"),
        Body("b", mass="T", guess="T"),
        AngleDriver("motor2", "crank", Rise("3-4-5", 1.0, "T", 1.0)),
    ],
    ids=["table", "table and number", "guess", "guess and number", "rise"],
)
def test_parameters_in_tables_are_fixed(element):
    machine = Mechanism("m", parameters={"T": 2.0})
    machine.add(Body("crank", mass=1.0), Revolute("O", "ground", "crank"))
    machine.add(AngleDriver("motor", "crank", 0.0))
    if element.name == "motor2":  # a rise has numbers that may change
        machine = Mechanism("m", parameters={"T": 2.0})
        machine.add(Body("crank", mass=1.0), Revolute("O", "ground", "crank"), element)
        system = assemble(machine).with_values(T=3.0)
        assert system.law_of(machine["motor2"])(3.5) == pytest.approx(0.5)
        return
    machine.add(element)
    assert machine.fixed_parameters == {"T"}
    if isinstance(element, Body):
        machine.add(Revolute("P", "crank", "b"), AngleDriver("m2", "b", 0.0))
    with says(ModelError, "parameter 'T' stands in a table", "describe the mechanism again"):
        assemble(machine).with_values(T=3.0)


# -- weights ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("units", "g", "by_hand"),
    [
        ("in-lbf-s", 386, 386.0),
        ("in-lbf-s", "386 in/s^2", 386.0),
        ("in-lbf-s", "9.80665 m/s^2", 9.80665 / 0.0254),
        ("in-lbf-s", None, 9.80665 / 0.0254),
        ("SI", "32 ft/s^2", 32 * 0.3048),
        ("SI", "g0/2", 5.0),
    ],
)
def test_weights_become_masses_with_g(units, g, by_hand):
    machine = Mechanism("m", units=units, g=g, parameters={"g0": 10.0, "W": "3 lbf"})
    machine.add(Body("crank", weight="2*W"), Revolute("O", "ground", "crank"))
    machine.add(AngleDriver("motor", "crank", 0.0))
    weight = 6.0 if units == "in-lbf-s" else 6.0 * 4.4482216152605
    system = assemble(machine)
    assert machine.g == pytest.approx(by_hand, rel=2 * ROUNDED)
    assert system.mass[0, 0] == pytest.approx(weight / by_hand, rel=6 * ROUNDED)
    twice = system.with_values(W=2.0 * float(system.values["W"]))
    assert twice.mass[0, 0] == pytest.approx(2 * weight / by_hand, rel=6 * ROUNDED)
    if g == "g0/2":
        with says(ModelError, "parameter 'g0' stands in", "g of 'm'"):
            system.with_values(g0=5.0)


# -- elements that wait for a mechanism ---------------------------------------------------------


def test_an_element_waits_for_its_mechanism():
    body = Body("crank", mass="2*a", points={"A": ("a", 0)}, guess="30 deg")
    assert body.pending and [f.text for _, f in formulas_in(body)] == ["2*a", "a", "30 deg"]
    machine = Mechanism("m", parameters={"a": 1.5})
    machine.add(body)
    assert body.pending  # what the user made stays as it is
    made = machine["crank"]
    assert not made.pending and not is_pending(made)
    assert made.mass == 3.0 and made.points["A"] == (1.5, 0.0)
    assert made == Body("crank", mass=3.0, points={"A": (1.5, 0.0)}, guess=math.radians(30))
    assert {k: f.text for k, f in machine.formulas.items()} == {
        "crank.mass": "2*a",
        "crank.A.x": "a",
        "crank.guess.angle": "30 deg",
    }
    assert machine.fixed_parameters == set()


@pytest.mark.parametrize(
    "clone", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_what_waits_is_copied_pickled_and_compared(clone):
    for element in (
        Body("crank", mass="2*a", points={"A": polar("1 in", "a")}),
        Force("F", "crank.A", "80 lbf*sin(5 rad/s*t)", angle="30 deg"),
        AngleDriver("motor", "crank", ConstantAcceleration("60 deg", "a", 2.0)),
    ):
        other = clone(element)
        assert other == element and repr(other) == repr(element) and other.pending
        assert [f.tree for _, f in formulas_in(other)] == [f.tree for _, f in formulas_in(element)]
    machine = crank()
    again = clone(machine)
    assert again == machine and again.formulas == machine.formulas
    again.add(Body("more", mass="c"))
    assert again["more"].mass == 8.0 and again != machine
    assert assemble(clone(machine)).with_values(a=3.0).values["crank.mass"] == 3.0


def test_equality_knows_what_follows():
    """The same numbers, one following a parameter: not the same mechanism."""
    following, fixed = Mechanism("m", parameters={"a": 2.0}), Mechanism("m", parameters={"a": 2.0})
    following.add(Body("b", mass="a"))
    fixed.add(Body("b", mass=2.0))
    assert following["b"] == fixed["b"] and following != fixed
    assert Body("b", mass="2*a") != Body("b", mass="a*2")


def test_an_element_that_does_not_fit_changes_nothing():
    machine = Mechanism("m", parameters={"a": "2 mm", "T": 1.0})
    for bad, words in (
        (Body("b", mass="a"), ("'b': mass", "'a' is a length (m), where a mass (kg)")),
        (Body("b", mass="zz"), ("'b': mass", "no parameter 'zz'", "'a', 'T'")),
        (Body("b", mass="-T"), ("'b': mass is -1", "not be negative")),
        (Body("b", points={"A": ("a/s", 0)}), ("'b': A.x", "a velocity")),
        (Body("b", guess="a"), ("'b'", "where an angle")),
        (Force("b", "ground", "a*t"), ("'b': value", "where a force")),
    ):
        with says(ModelError, *words, element="b"):
            machine.add(Body("good", inertia="T"), bad)
        assert not list(machine) and not machine.formulas and not machine.fixed_parameters
