"""Bad input is answered by a sentence wherever it is; tests/errors has the sentences."""

import contextlib
import dataclasses
import math

import numpy as np
import pytest

import mbody
from mbody.model import joints, loads
from mbody.model.element import Element
from mbody.model.joints import CustomJoint
from mbody.model.loads import (
    Actuator,
    CentrifugalField,
    CustomLoad,
    DCMotor,
    HydraulicCylinder,
    InductionMotor,
    PistonPressure,
    ReciprocatingCylinder,
    Tyre,
)
from tests.errors import describing
from tests.errors.catalogue import told
from tests.errors.models import crank_alone
from tests.support.cases import each

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
    mbody.Body: {},
    mbody.Revolute: PLACES,
    mbody.Prismatic: PLACES,
    mbody.Fixed: PLACES,
    mbody.Distance: {**PLACES, "length": 1.0},
    mbody.Gear: {**PLACES, "radius_i": 2.0, "radius_j": 1.0},
    mbody.CamFollower: {**PLACES, "profile": 1.0},
    mbody.PinSlot: PLACES,
    mbody.RackPinion: {**PLACES, "radius": 1.0},
    mbody.Rolling: {**PLACES, "radius": 1.0},
    mbody.BandBrake: {
        **PLACES,
        **{"radius": 1.0, "wrap": 1.0, "friction": 0.1, "lever": 1.0, "arm": 20.0},
    },
    mbody.Belt: {
        **PLACES,
        **{"tension": 1.0, "radius_i": 1.0, "radius_j": 2.0, "distance": 8.0, "friction": 0.1},
    },
    mbody.Clutch: PLACES,
    mbody.FrictionForce: PLACES,
    CustomJoint: PLACES,
    mbody.AngleCoupling: {"terms": [mbody.CouplingTerm(1.0, angle="a")]},
    mbody.LengthCoupling: {"terms": [mbody.CouplingTerm(1.0, distance=("a.P", "b.Q"))]},
    mbody.AngleDriver: {"body": "a", "law": 1.0},
    mbody.DistanceDriver: {**PLACES, "law": 1.0},
    mbody.CoordinateDriver: {**PLACES, "law": 1.0},
    mbody.Force: {"at": "a.P", "value": 1.0},
    mbody.Torque: {"body": "a", "value": 1.0},
    mbody.Gravity: {"y": -9.81},
    CentrifugalField: {"speed": 1.0},
    mbody.Spring: {**PLACES, "stiffness": 1.0},
    mbody.Damper: {**PLACES, "coefficient": 1.0},
    mbody.TorsionSpring: {"body": "a", "stiffness": 1.0},
    mbody.TorsionDamper: {"body": "a", "coefficient": 1.0},
    PistonPressure: {**PLACES, "cycle": "a", "head_area": 1.0, "head": 1.0},
    ReciprocatingCylinder: {
        **PLACES,
        **{"area": 1.0, "near": 0.0, "far": 1.0, "clearance": 0.1, "delivery": 5.0},
        **{"bulk_modulus": 100.0, "ambient": 1.0},
    },
    CustomLoad: PLACES,
    DCMotor: {
        "body": "a",
        **{"voltage": 1.0, "resistance": 1.0, "inductance": 1.0, "constant": 1.0},
    },
    InductionMotor: {
        "body": "a",
        **{"breakdown_torque": 1.0, "breakdown_slip": 0.2, "synchronous": 100.0},
    },
    Actuator: {**PLACES, "push": 1.0},
    HydraulicCylinder: {
        **PLACES,
        **{"bore": 0.05, "rod": 0.03, "closed": 0.3, "stroke": 0.2, "flow": 1e-3, "drop": 1e5},
        **{"supply": 1e7, "bulk_modulus": 1e9, "dead_volume": 1e-5},
    },
    Tyre: {
        **{"i": "ground", "j": "b.Q", "radius": 0.3, "stiffness": 1e5, "friction": 0.9},
        **{"steepness": 10.0, "relaxation": 0.3},
    },
    mbody.Input: {},
    mbody.Contact: {"i": "a.P", "j": "b.rim"},
    mbody.Between: {"i": "a.*", "j": "b.*"},
    mbody.Rope: {"i": "a.P", "j": "b.Q", "length": 1.0},
    mbody.Stop: {"of": "a.x + 9 m"},
    mbody.Freewheel: {"i": "a.P", "j": "b.Q"},
    mbody.State: {"rate": "1"},
    mbody.Quantity: {"formula": "1"},
    mbody.Controller: {"function": max, "every": 1.0, "sets": ["u"]},
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
    found = [getattr(mbody, name) for name in mbody.__all__]
    for module in (joints, loads):
        found += vars(module).values()
    elements = {cls for cls in found if isinstance(cls, type) and issubclass(cls, Element)}
    assert elements - {joints.Joint, loads.Load} == set(EXAMPLES)


@each("value", [NAN, INF, -INF, np.float64(NAN)])
@each(("cls", "field"), fields(is_number))
def test_numbers_are_finite(cls, field, value):
    with says(
        mbody.ModelError, f"'it': {field.name} is {float(value)}, it must be finite", element="it"
    ):
        make(cls, **{field.name: value})


@each("value", [[1.0], (1.0, 2.0), 1j, True, {}, b"1", object()])
@each(("cls", "field"), fields(is_number))
def test_numbers_are_numbers(cls, field, value):
    with says(
        mbody.ModelError, f"'it': {field.name}", "must be", "number", repr(value), element="it"
    ):
        make(cls, **{field.name: value})


@each(("cls", "field"), fields(is_number))
def test_none_is_only_for_what_may_be_left_out(cls, field):
    if field.default is None:
        if field.name in EXAMPLES[cls]:
            with says(mbody.ModelError, "'it' has neither", "give one", element="it"):
                make(cls, **{field.name: None})
        else:
            assert getattr(make(cls, **{field.name: None}), field.name) is None
        return
    with says(mbody.ModelError, f"'it': {field.name}", "not None", element="it"):
        make(cls, **{field.name: None})


@each("value", [NAN, 3, None, ("a", "P"), mbody.Marker(None, "P"), mbody.Marker([], "P")])
@each(("cls", "field"), fields(is_place))
def test_places_are_places(cls, field, value):
    with says(
        mbody.ModelError, f"'it': {field.name} must be a place such as", '"crank.A"', element="it"
    ):
        make(cls, **{field.name: value})


@each("name", describing.PLACES)
@each(("cls", "field"), fields(is_place))
def test_places_are_the_same_everywhere(cls, field, name):
    sentence = told(describing.SCENARIOS[name]).sentence
    with says(
        mbody.ModelError, sentence.replace("'it': i", f"'it': {field.name}", 1), element="it"
    ):
        make(cls, **{field.name: describing.PLACES[name]})


@each("name", ["", "  ", None, 3, NAN, ["A"], "crank.A"])
@each("cls", EXAMPLES)
def test_names_are_text_without_a_dot(cls, name):
    sentence = f"every {cls.__name__} needs a name, not {name!r}"
    with says(mbody.ModelError, "write 'crank_A'" if name == "crank.A" else sentence):
        make(cls, name=name)


@each("value", [None, 3, NAN, "", mbody.Body, []])
@each(("cls", "field"), [(mbody.AngleDriver, "body"), (mbody.AngleDriver, "relative_to"),
                                            (mbody.Torque, "body"), (mbody.TorsionSpring, "by")])  # fmt: skip
def test_bodies_are_named(cls, field, value):
    with says(mbody.ModelError, f"'it': {field} must name a body, not {value!r}", element="it"):
        make(cls, **{field: value})


# -- the mechanism ----------------------------------------------------------------------------


@each("name", describing.ADDED)
def test_what_is_refused_is_not_added(name):
    machine = crank_alone()
    with says(mbody.ModelError, told(describing.SCENARIOS[f"adding {name}"]).sentence):
        machine.add(describing.ADDED[name])
    assert [e.name for e in machine] == ["crank"]


def test_all_are_added_or_none():
    machine = crank_alone()
    with says(mbody.ModelError, "'A' refers to body 'nobody'", element="A"):
        machine.add(mbody.Body("rod"), mbody.Revolute("A", "rod", "nobody"), mbody.Body("slider"))
    assert "rod" not in machine and len(list(machine)) == 1
    machine.add(mbody.Body("rod"), mbody.Revolute("A", "rod", "crank.A"))
    assert [element.name for element in machine] == ["crank", "rod", "A"]
