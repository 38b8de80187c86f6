"""Bad input is answered by a sentence: the element, the number with its unit, the remedy."""

import contextlib
import dataclasses
import math

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    ConstantSpeed,
    CoordinateDriver,
    CustomJoint,
    CustomLoad,
    Damper,
    Distance,
    DistanceDriver,
    Fixed,
    Force,
    Gravity,
    Guess,
    Marker,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    SecondMoments,
    Slender,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
    polar,
)
from mbody.elements import Element

NAN, INF = math.nan, math.inf


@contextlib.contextmanager
def says(error, *words, element=...):
    """The block ends in that error, its sentence holds every word, and it is about `element`."""
    with pytest.raises(error) as caught:
        yield caught
    sentence = str(caught.value)
    missing = [word for word in words if word not in sentence]
    assert not missing, f"{missing} not in: {sentence}"
    assert "\n" not in sentence
    if element is not ...:
        assert caught.value.element == element


# -- numbers: every field of every element, found by introspection ----------------------------

PLACES = {"i": "a.P", "j": "b.Q"}
EXAMPLES = {
    Body: {},
    Revolute: PLACES,
    Prismatic: PLACES,
    Fixed: PLACES,
    Distance: {**PLACES, "length": 1.0},
    CustomJoint: PLACES,
    AngleDriver: {"body": "a", "law": 1.0},
    DistanceDriver: {**PLACES, "law": 1.0},
    CoordinateDriver: {**PLACES, "law": 1.0},
    Force: {"at": "a.P", "value": 1.0},
    Torque: {"body": "a", "value": 1.0},
    Gravity: {"y": -9.81},
    Spring: {**PLACES, "stiffness": 1.0},
    Damper: {**PLACES, "coefficient": 1.0},
    TorsionSpring: {"body": "a", "stiffness": 1.0},
    TorsionDamper: {"body": "a", "coefficient": 1.0},
    CustomLoad: PLACES,
}


def fields(kind):
    return [
        pytest.param(cls, field, id=f"{cls.__name__}.{field.name}")
        for cls in EXAMPLES
        for field in dataclasses.fields(cls)
        if kind(field)
    ]


def is_number(field):
    return "dimension" in field.metadata or "law" in field.metadata


def is_place(field):
    return "place" in field.metadata


def make(cls, **changes):
    return cls(**{"name": "it", **EXAMPLES[cls], **changes})


def test_every_public_element_is_an_example():
    public = {getattr(mbody, name) for name in mbody.__all__ if name != "testing"}
    elements = {cls for cls in public if isinstance(cls, type) and issubclass(cls, Element)}
    assert elements == set(EXAMPLES)


@pytest.mark.parametrize("value", [NAN, INF, -INF, np.float64(NAN)])
@pytest.mark.parametrize(("cls", "field"), fields(is_number))
def test_numbers_are_finite(cls, field, value):
    with says(ModelError, f"'it': {field.name} is {float(value)}, it must be finite", element="it"):
        make(cls, **{field.name: value})


@pytest.mark.parametrize("value", [[1.0], (1.0, 2.0), 1j, True, {}, b"1", object()])
@pytest.mark.parametrize(("cls", "field"), fields(is_number))
def test_numbers_are_numbers(cls, field, value):
    with says(ModelError, f"'it': {field.name}", "must be", "number", repr(value), element="it"):
        make(cls, **{field.name: value})


@pytest.mark.parametrize(("cls", "field"), fields(is_number))
def test_none_is_only_for_what_may_be_left_out(cls, field):
    if field.default is None:
        if field.name in EXAMPLES[cls]:
            with says(ModelError, "'it' has neither", "give one", element="it"):
                make(cls, **{field.name: None})
        else:
            assert getattr(make(cls, **{field.name: None}), field.name) is None
        return
    with says(ModelError, f"'it': {field.name}", "not None", element="it"):
        make(cls, **{field.name: None})


@pytest.mark.parametrize("value", [NAN, 3, None, ("a", "P"), Marker(None, "P"), Marker([], "P")])
@pytest.mark.parametrize(("cls", "field"), fields(is_place))
def test_places_are_places(cls, field, value):
    with says(ModelError, f"'it': {field.name} must be a place such as", '"crank.A"', element="it"):
        make(cls, **{field.name: value})


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("", ("is ''", "must name a body")),
        ("a.", ("is 'a.'", '"crank.A"')),
        (Marker("a", (NAN, 0.0)), (".x is nan", "finite")),
        (Marker("a", polar(1.0, INF)), (".angle is inf", "finite")),
        (Marker("a", ([1], 0.0)), (".x must be a number (length), not [1]",)),
        (Marker("a", 5), ("must be a pair (x, y) or polar(r, angle), not 5",)),
        (Marker("a", "P", NAN), (".angle is nan", "finite")),
        (Marker("a", "P", "30 kg"), (".angle: '30 kg' is a mass (kg), where an angle",)),
    ],
)
@pytest.mark.parametrize(("cls", "field"), fields(is_place))
def test_places_have_finite_numbers(cls, field, place, words):
    with says(ModelError, f"'it': {field.name}", *words, element="it"):
        make(cls, **{field.name: place})


@pytest.mark.parametrize("name", ["", "  ", None, 3, NAN, ["A"], "crank.A"])
@pytest.mark.parametrize("cls", EXAMPLES, ids=lambda cls: cls.__name__)
def test_names_are_text_without_a_dot(cls, name):
    sentence = f"every {cls.__name__} needs a name, not {name!r}"
    with says(ModelError, "write 'crank_A'" if name == "crank.A" else sentence):
        make(cls, name=name)


@pytest.mark.parametrize(
    ("make_it", "words"),
    [
        (lambda: Body("b", mass=-1), ("'b': mass is -1", "must not be negative: give 0 or more")),
        (lambda: Body("b", weight=-2.5), ("'b': weight is -2.5", "0 or more")),
        (lambda: Body("b", inertia=-1e-3), ("'b': inertia is -0.001", "0 or more")),
        (lambda: Body("b", mass=1, weight=1), ("'b': give mass or weight, not both",)),
        (lambda: make(Damper, coefficient=-3), ("'it': coefficient is -3", "0 or more")),
        (lambda: make(TorsionDamper, coefficient=-3), ("'it': coefficient is -3", "0 or more")),
        (lambda: make(Spring, free_length=-3), ("'it': free_length is -3", "0 or more")),
        (lambda: make(Spring, stiffness=None), ("neither stiffness nor law: give one",)),
        (lambda: make(Spring, law=abs), ("both stiffness and law: give one",)),
        (lambda: make(TorsionDamper, law=abs), ("both coefficient and law: give one",)),
        (lambda: make(Distance, length=0), ("'it': length is 0", "positive", "Revolute")),
        (lambda: make(Distance, length=-2), ("'it': length is -2", "positive")),
        (lambda: make(Distance, length=abs), ("'it': length", "DistanceDriver")),
        (lambda: make(DistanceDriver, law=-1), ("'it': law is -1", "CoordinateDriver")),
        (lambda: make(Force, follows="yes"), ("'it': follows must be True or False, not 'yes'",)),
        (lambda: make(AngleDriver, law=ConstantSpeed), ("'it': law", "ConstantSpeed(...)")),
        (lambda: make(Torque, name="inertia"), ("'inertia'", "cause", "choose another name")),
        (lambda: Force.components("it", "a", "3", 4.0), ("'it': x", "'3'")),
        (lambda: Force.components("it", "a", 3.0, NAN), ("'it': y", "nan")),
        (lambda: Body("b", cg=(1.0, 2.0, 3.0)), ("'b': cg must be a pair",)),
        (lambda: Body("b", cg=(0.0, NAN)), ("'b': cg.y is nan", "finite")),
        (lambda: Body("b", points={"A": "x"}), ("'b': A must be a pair (x, y) or polar",)),
        (lambda: Body("b", points={"A": (INF, 0)}), ("'b': A.x is inf", "finite")),
        (lambda: Body("b", points={"A": polar([1], 0)}), ("'b': A.r must be a number",)),
        (lambda: Body("b", points=[(1, 2)]), ("'b': points must be a dict",)),
        (lambda: Body("b", points={"A.B": (1, 2)}), ("'A.B' is no name", "without a dot")),
        (lambda: Body("b", points={3: (1, 2)}), ("3 is no name", "text")),
        (lambda: Body("b", points={"cg": (1, 2)}), ("may not be 'cg'", "choose another")),
        (lambda: Body("b", guess="30 kg"), ("'b': guess.angle: '30 kg' is a mass",)),
        (lambda: Body("b", guess=(1, 2)), ("'b': guess must be an angle or (x, y, angle)",)),
        (lambda: Body("b", guess=Guess(x=NAN)), ("'b': guess.x is nan",)),
        (lambda: Body("b", spread=Slender(NAN)), ("'b': spread.angle is nan",)),
        (lambda: Body("b", spread=SecondMoments(1, NAN)), ("'b': spread.yy is nan",)),
        (lambda: Body("b", spread=SecondMoments(1, 1, 2)), ("'b': no mass", "xy²")),
        (lambda: Body("b", spread=np.ones(2)), ("'b': spread must be", "Slender(angle)")),
        (lambda: Body("b").at("Q"), ("'b' has no point 'Q' (it has: none)",)),
        (lambda: Body("b").at(1.0, "2 s"), ("'b': marker.y: '2 s' is a time",)),
        (lambda: Body("b").at(0.0, 0.0, angle=NAN), ("'b': marker angle is nan",)),
    ],
)
def test_one_element(make_it, words):
    with says(ModelError, *words):
        make_it()


@pytest.mark.parametrize(
    ("make_it", "what"),
    [
        (lambda: Revolute("A", "crank.A", "crank.B"), "'A' would join 'crank' to itself"),
        (lambda: Spring("s", "crank.A", "crank", stiffness=1.0), "'s' would join 'crank' to"),
        (lambda: CustomLoad("c", "crank.A", "crank"), "'c' would join 'crank' to itself"),
        (lambda: DistanceDriver("m", "crank.A", "crank", 1.0), "'m' would join 'crank'"),
        (lambda: AngleDriver("m", "crank", 0.0, relative_to="crank"), "'m' would drive 'crank'"),
        (lambda: AngleDriver("m", "ground", 0.0), "'m' would drive 'ground' relative to itself"),
        (lambda: Torque("t", "crank", by="crank", value=1.0), "'t' would turn 'crank' against"),
    ],
)
def test_two_bodies_are_needed(make_it, what):
    with says(ModelError, what, "two bodies"):
        make_it()


@pytest.mark.parametrize("value", [None, 3, NAN, "", Body, []])
@pytest.mark.parametrize(("cls", "field"), [(AngleDriver, "body"), (AngleDriver, "relative_to"),
                                            (Torque, "body"), (TorsionSpring, "by")])  # fmt: skip
def test_bodies_are_named(cls, field, value):
    with says(ModelError, f"'it': {field} must name a body, not {value!r}", element="it"):
        make(cls, **{field: value})


# -- the mechanism ----------------------------------------------------------------------------


def crank_alone():
    machine = Mechanism("m", ground={"O": (0.0, 0.0)})
    machine.add(Body("crank", points={"A": (1.0, 0.0)}))
    return machine


@pytest.mark.parametrize(
    ("element", "words"),
    [
        (Revolute("O", "ground.O", "rod"), ("'O'", "body 'rod'", "'ground', 'crank'", "first")),
        (Revolute("O", "ground.Q", "crank"), ("'O'", "point 'Q' of 'ground'", "it has: 'O'")),
        (Revolute("O", "ground.O", "crank.B"), ("'O'", "point 'B' of 'crank'", "it has: 'A'")),
        (
            Revolute("O", "ground.O", "crank.A.B"),
            (
                "'O'",
                "point 'A.B' of 'crank'",
            ),
        ),
        (Force("F", "rod.A", 1.0), ("'F'", "body 'rod'", "add bodies first")),
        (Torque("T", "rod", value=1.0), ("'T'", "body 'rod'", "add bodies first")),
        (Torque("T", "crank", by="rod", value=1.0), ("'T'", "body 'rod'", "add bodies first")),
        (AngleDriver("motor", "crank.A", 1.0), ("'motor'", "body 'crank.A'", "there are")),
        (AngleDriver("motor", "crank", 1.0, relative_to="rod"), ("'motor'", "body 'rod'")),
        (Spring("S", "ground.O", "crank.C", stiffness=1.0), ("'S'", "point 'C' of 'crank'")),
        (Body("crank"), ("name 'crank' is taken by a Body", "unique", "choose another")),
        (Gravity("crank", y=-9.81), ("name 'crank' is taken by a Body",)),
        (Body("ground"), ("name 'ground' is taken by a fixed link",)),
        ("crank", ("bodies, joints, drivers and loads, not 'crank'",)),
        (None, ("bodies, joints, drivers and loads, not None",)),
        (Body, ("not <class", "make one, Body(...)")),
        ([Body("rod")], ("one by one, add(*elements)",)),
    ],
)
def test_what_is_added(element, words):
    machine = crank_alone()
    with says(ModelError, *words):
        machine.add(element)
    assert [e.name for e in machine] == ["crank"]


def test_all_are_added_or_none():
    machine = crank_alone()
    with says(ModelError, "'A' refers to body 'nobody'", element="A"):
        machine.add(Body("rod"), Revolute("A", "rod", "nobody"), Body("slider"))
    assert "rod" not in machine and len(list(machine)) == 1
    machine.add(Body("rod"), Revolute("A", "rod", "crank.A"))
    assert [element.name for element in machine] == ["crank", "rod", "A"]


def test_long_lists_of_names_are_cut():
    machine = Mechanism("m")
    machine.add(*(Body(f"b{n}") for n in range(100)))
    with says(ModelError, "'ground', 'b0'", "'b6' and 93 more"):
        machine.add(Force("F", "x", 1.0))


@pytest.mark.parametrize(
    ("make_it", "words"),
    [
        (lambda: Mechanism("m", units="inch"), ("'inch'", "'in-lbf-s'", "choose one")),
        (lambda: Mechanism("m", units=["SI"]), ("no unit system ['SI']", "'SI'")),
        (lambda: Mechanism("m", g=-9.81), ("'m': g is -9.81 m/s²", "positive", "Gravity")),
        (lambda: Mechanism("m", g="9.81 m"), ("'m': g: '9.81 m' is a length", "'9.81 m/s^2'")),
        (lambda: Mechanism("m", g=NAN), ("'m': g is nan", "finite")),
        (lambda: Mechanism("m", ground=[(0, 0)]), ("'ground': points must be a dict",)),
        (lambda: Mechanism("m", ground={"O": (0, NAN)}), ("'ground': O.y is nan",)),
        (lambda: Mechanism(None), ("title", "text, not None")),
        (lambda: crank_alone()["rod"], ("'m' has no element 'rod' (it has: 'crank')",)),
        (lambda: crank_alone()[["rod"]], ("'m' has no element ['rod']",)),
    ],
)
def test_the_mechanism_itself(make_it, words):
    with says(ModelError, *words):
        make_it()
