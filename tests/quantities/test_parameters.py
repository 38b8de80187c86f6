"""Parameters: dependants, other values, weights, elements that wait for their mechanism."""

import copy
import itertools
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbody import AngleDriver, Body, Force, Mechanism, ModelError, Revolute, assemble, kinetostatics
from mbody.files.model.read import built
from mbody.files.model.write import as_data
from mbody.laws import ConstantAcceleration, Rise, Table
from mbody.makers import polar
from mbody.quantities import Parameters
from mbody.quantities.formula import formulas_in, is_pending
from mbody.quantities.units import DIMENSIONS, name_of, unit_system
from tests.errors.test_errors import says
from tests.support.linkages import random_linkage, times_within

SI = unit_system("SI")
ROUNDED = 2.3e-16  # one rounding


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
    with says(ModelError, "parameter 'T' is used in a table", "describe the mechanism again"):
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
        with says(ModelError, "parameter 'g0' is used in", "g of 'm'"):
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
        (Body("b", mass="-T"), ("'b': mass is '-T' = -1 kg", "not be negative")),
        (Body("b", points={"A": ("a/s", 0)}), ("'b': A.x", "a velocity")),
        (Body("b", guess="a"), ("'b'", "where an angle")),
        (Force("b", "ground", "a*t"), ("'b': value", "where a force")),
    ):
        with says(ModelError, *words, element="b"):
            machine.add(Body("good", inertia="T"), bad)
        assert not list(machine) and not machine.formulas and not machine.fixed_parameters
