"""The text of a formula's tree says the same tree."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mbody.quantities import Scope, evaluate, parse, text_of
from mbody.quantities.parse import Binary, Call, Measured, Name, Negative, Plain

units = st.sampled_from(["m", "in", "N*m", "rad/s^2", "in-lbf", "deg", "kg*m^2", "s^-1", "1/3 in"])


def _measured(node, unit):
    spelled = parse(f"2 {unit}") if unit != "1/3 in" else parse("1/3 in")
    return Measured(spelled.of if unit == "1/3 in" else node, spelled.unit, spelled.symbols)


any_trees = st.recursive(
    st.one_of(
        st.sampled_from([Name("a"), Name("t"), Name("pi"), Name("mm")]),
        st.builds(Plain, st.builds(Fraction, st.integers(0, 10**20), st.sampled_from(
            [1, 10, 8, 10**6, 10**18]))),
    ),
    lambda below: st.one_of(
        st.builds(Negative, below),
        st.builds(_measured, below, units),
        st.builds(Binary, st.sampled_from("+-*/^"), below, below),
        st.builds(lambda a: Call("sin", (a,)), below),
        st.builds(lambda a, b: Call("atan2", (a, b)), below, below),
    ),
    max_leaves=10,
)  # fmt: skip


@given(tree=any_trees)
@settings(max_examples=500)
def test_the_text_of_a_tree_says_the_same_tree(tree):
    assert parse(text_of(tree)) == tree, text_of(tree)


@pytest.mark.parametrize(
    ("text", "shorter"),
    [
        ("((a))+((b*c))", "a + b * c"),
        ("(a+b)*c", "(a + b) * c"),
        ("a-(b-c)", "a - (b - c)"),
        ("(a-b)-c", "a - b - c"),
        ("a/(b*c)", "a / (b * c)"),
        ("(a^b)^c", "(a^b)^c"),
        ("a^(b^c)", "a^b^c"),
        ("-(a^2)", "-a^2"),
        ("(-a)^2", "(-a)^2"),
        ("(2 m)^2", "(2 m)^2"),
        ("1/4 in", "0.25 in"),
        ("1/3 in", "1/3 in"),
        ("5 N*m*2", "5 N·m * 2"),
        ("(a) furlong", "(a) furlong"),
        ("1e300 + 0.001", "1e300 + 0.001"),
    ],
)
def test_texts_have_few_brackets(text, shorter):
    assert text_of(parse(text)) == shorter
    assert parse(shorter) == parse(text)


def test_the_text_of_a_number_that_no_decimals_write():
    tree = Plain(Fraction(1, 3))
    assert text_of(Binary("*", Name("a"), tree)) == "a * (1 / 3)"
    assert evaluate(parse(text_of(tree)), Scope()).value == 1 / 3
