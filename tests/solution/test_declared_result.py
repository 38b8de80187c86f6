"""What a result declares once is its data, in units for programs, and its text, for people."""

import json
import math
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

import mbody
from mbody.core.presentation import Presented
from mbody.solution.declared_result import (
    ColumnTable,
    Heading,
    IncludedResult,
    ItemTable,
    Sentence,
    Value,
    in_units,
    plain,
)
from mbody.solution.doubts import Inherited

KILOGRAM = 1e-3  # of the tonne that mm-N-s has


@dataclass(frozen=True)
class Disc(Presented):
    radius: float
    mass: float
    declared = (
        Heading("DISC"),
        Value("radius", "radius", "length"),
        Value("mass", "mass", "mass"),
    )


@dataclass(frozen=True)
class Shaft(Presented):
    """One of each part that a declaration has."""

    disc: Disc
    speed: float = 10.0
    angle: float = math.radians(60.0)
    nowhere: float = math.inf
    used: dict = field(default_factory=lambda: {"heat": 0.5, "speed": 1.25})
    mechanism: object = field(default_factory=lambda: mbody.Mechanism("shaft", units="mm-N-s"))
    analysis_name = "shafts"
    about_text = "at {0.speed:g}"
    declared = (
        IncludedResult("disc"),
        Heading("SHAFT"),
        Value("speed", "speed", "angular velocity"),
        Value("angle", "angle", "angle"),
        Value("inertia", "inertia", "mass·length²", lambda one: 2.0 * KILOGRAM),
        Value("nowhere", "nowhere"),
        Value("", "life", value="nowhere", missing="endless"),
        Value("absent", value=lambda one: ...),
        Value("used", "{} used", "share"),
        Value("", "rounding", "force", lambda one: 1e-9, floor=lambda one: 1e-6),
        ItemTable(
            "places",
            (Value("at", "at", "length"), Value("turn", "turn", "angle")),
            "PLACE",
            lambda one: {"A": {"at": 1.0, "turn": 0.5 * math.pi}, "B": {"at": 2.0, "turn": None}},
        ),
        ColumnTable((Value("t", "t", "time", lambda one: np.linspace(0.0, 1.0, 101)),)),
        Sentence(lambda one: ["it turns", ""]),
    )


def test_data_are_in_the_units_of_the_model():
    found = Shaft(Disc(3.0, KILOGRAM)).data()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    head = ["mbody", "model", "analysis", "units", "status", "doubts", "notes"]
    assert list(found)[:7] == head
    assert (found["model"], found["analysis"], found["units"]["mass"]) == ("shaft", "shafts", "t")
    assert (found["radius"], found["mass"], found["inertia"]) == (3.0, 1e-3, 2e-3)
    assert found["angle"] == math.radians(60.0)
    assert found["nowhere"] is None and "absent" not in found and "" not in found
    assert found["places"]["B"] == {"at": 2.0, "turn": None}
    assert len(found["t"]) == 101


def test_data_follow_the_units_that_are_chosen():
    machine = mbody.Mechanism(
        "shaft", units="mm-N-s", output_units={"mass": "kg", "length": "m", "angle": "deg"}
    )
    found = Shaft(Disc(3.0, KILOGRAM), mechanism=machine).data()
    assert (found["mass"], found["radius"]) == (1.0, 0.003)
    assert (found["angle"], found["places"]["A"]) == (60.0, {"at": 0.001, "turn": 90.0})
    assert (found["units"]["mass"], found["units"]["angle"]) == ("kg", "deg")
    again = Shaft(Disc(3.0, KILOGRAM), mechanism=machine).data("rad")
    assert (again["angle"], again["units"]["angle"]) == (math.radians(60.0), "rad")


def test_people_read_kilograms_degrees_and_revolutions_a_minute():
    lines = str(Shaft(Disc(3.0, KILOGRAM))).splitlines()
    cells = [line.split() for line in lines]
    for expected in (
        "shaft: at 10", "radius 3 mm", "mass 1 kg", "speed 10 rad/s", "95.493 rpm",
        "angle 60.000 deg", "inertia 2 kg·mm²", "life endless", "heat used 50 %",
        "speed used 125 %", "rounding 0 N", "A 1 90.000", "B 2 –", "it turns",
    ):  # fmt: skip
        assert expected.split() in cells, expected
    assert "nowhere" not in str(lines)
    assert lines[-3] == "13 of 101 instants; all of them with --json"


def test_doubts_and_notes_end_the_text():
    @dataclass(frozen=True, eq=False)
    class Noted(Inherited, Presented):
        declared = (Sentence(lambda one: "all is well"),)

    assert str(Noted(notes=("but look",))).splitlines() == ["all is well", "", "NOTE   but look"]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.array([[1.0, math.nan]]), [[1.0, None]]),
        (np.array([1.0 + 2.0j]), [[1.0, 2.0]]),
        (3.0 - 4.0j, [3.0, -4.0]),
        (np.float64(math.inf), None),
        (np.array([True, False]), [True, False]),
        ({"a": (1, "x", None)}, {"a": [1, "x", None]}),
    ],
)
def test_plain_values(value, expected):
    assert plain(value) == expected
    json.dumps(plain(value), allow_nan=False)


def test_a_product_is_read_by_its_factors_or_as_it_was_chosen():
    shown = mbody.Mechanism("m", units="mm-N-s", output_units={"inertia": "kg*m^2"}).shown
    assert in_units(shown, "mass·length", 2.0 * KILOGRAM) == (2.0, "kg·mm")
    value, symbol = in_units(shown, "mass·length²", 2e3 * 2.0)
    assert (round(float(value), 12), symbol) == (4.0, "kg·m²")
    assert in_units(SimpleNamespace(), "share", 0.5) == (0.5, "")
