"""Formulas: the grammar against Python's own, values over arrays."""

import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mbody.quantities import FUNCTIONS, FormulaError, Scope, Valued, evaluate, parse, read
from mbody.quantities.units import DIMENSIONS, unit_system
from tests.support.formulas import worth

SI = unit_system("SI")
ROUNDED = 2.3e-16  # one rounding


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


@given(st.text(max_size=30))
def test_any_text_is_a_formula_or_a_sentence(text):
    try:
        found = worth(text)
    except FormulaError as error:
        assert str(error) and "\n" not in str(error).replace(repr(text), "")
    else:
        assert np.ndim(found.value) == 0


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
    with pytest.raises(FormulaError, match="evaluates to inf"):
        read("1 m^2/(a - 2 m)", DIMENSIONS["length"]).value(scope)
