"""Files to begin with: every kind is read, counted, analysed, and takes other lengths."""

import math
import tomllib

import numpy as np
import pytest

import mbody
from mbody.teaching import KINDS, new_model

OTHER = {
    "fourbar": [50, 120, 85, 105],
    "slidercrank": ["5 cm", 150, -10],
    "sixbar": [48, 112, 72, 118, 118, 82, 52, 62],
    "gears": [10, 30, 20, 50],
    "cam": [50, 8, 15],
    "pendulum": [0.5],
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("lengths", [False, True])
def test_a_kind_is_complete_and_runs(kind, lengths):
    machine = mbody.from_toml(new_model(kind, OTHER[kind] if lengths else ()))
    if kind == "pendulum":
        run = mbody.simulate(machine, 1.0)
    else:
        run = mbody.kinetostatics(machine, turn=True, instants=37)
        assert run.checks.virtual_work < 1e-9
    assert run.status == "completed" and not run.doubts
    assert machine.measures


@pytest.mark.parametrize("kind", KINDS)
def test_lengths_are_entered_and_comments_kept(kind):
    before, after = new_model(kind), new_model(kind, OTHER[kind])
    given = tomllib.loads(after)["parameters"]
    for name, length in zip(KINDS[kind], OTHER[kind], strict=True):
        unit = "m" if kind == "pendulum" else "mm"
        assert given[name] == (length if isinstance(length, str) else f"{length} {unit}")
    assert after.count("#") == before.count("#") >= 5
    unchanged = set(tomllib.loads(before)["parameters"]) - set(KINDS[kind])
    assert all(given[name] == tomllib.loads(before)["parameters"][name] for name in unchanged)
    # a comment stays in its column
    starts = tuple(f"{name} " for name in KINDS[kind])
    marks = [
        [line.find("#") for line in text.splitlines() if line.startswith(starts)]
        for text in (before, after)
    ]
    assert marks[0] == marks[1]


def test_lengths_are_those_of_the_mechanism():
    run = mbody.kinetostatics(mbody.from_toml(new_model("fourbar", OTHER["fourbar"])), turn=True)
    places = {name: run.point(name) for name in ("ground.O2", "crank.A", "rocker.B", "ground.O4")}
    ends = [np.array([p.x, p.y]) for p in places.values()]
    found = [np.hypot(*(q - p)) for p, q in zip(ends, [*ends[1:], ends[0]], strict=True)]
    for length, wanted in zip(found, (50.0, 120.0, 85.0, 105.0), strict=True):
        assert length == pytest.approx(wanted, rel=1e-9)


def test_a_pendulum_swings_by_its_length():
    """A uniform bar from 30 deg below the horizontal: energy at the bottom is m g l/2 (1 − sin 30°)
    less what the damper takes, none here."""
    text = new_model("pendulum", [0.5]).replace('"0.05 N*m*s/rad"', "0")
    run = mbody.simulate(mbody.from_toml(text), 2.0, instants=2001)
    fastest = np.abs(run["pendulum"].omega).max()
    square = 3.0 * 9.81 / 0.5 * (1.0 - math.sin(math.pi / 6))
    assert fastest == pytest.approx(math.sqrt(square), rel=1e-5)
