"""Every number of every result has the same digits where lengths, masses and times are multiplied
by powers of two: no tolerance is a length, a mass or a time.

Notes on plausible numbers (`mbody.model.traps`) ask which units are meant, and are left out.
"""

import contextlib
import dataclasses
import functools
import re
from fractions import Fraction

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.files.model import in_units
from mbody.model import traps
from mbody.model.numbers import number_in
from tests.campaign.invariance import own_units
from tests.campaign.scenes import random_scene
from tests.support.gallery_runs import asked

#: Exponents of length, mass and time; odd, so that no root of such a factor is one.
SCALES = {"larger": (21, -9, 7), "smaller": (-39, 31, -27)}
#: What belongs to the model or to a process, and what is kept by numbers' bytes.
LEFT_OUT = {"mechanism", "system", "stats", "_ends"}
NUMBER = re.compile(r"[-−]?\d+(\.\d+)?([eE][-−+]?\d+)?")


def text_of(sentence):
    """A sentence without its numbers and units."""
    return NUMBER.sub("#", re.sub(r"\b[lft]u\d+", "unit", sentence))


def digits(value, path, found, seen):
    """found[path] ← mantissas of all numbers of a result, sentences, flags."""
    if isinstance(value, str):
        found[path] = text_of(value)
    elif isinstance(value, float):  # NumPy's too
        found[path] = repr(np.frexp(value)[0])
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fc":
        parts = value.view(float) if value.dtype.kind == "c" else value
        found[path] = (value.shape, (np.frexp(parts)[0] + 0.0).tobytes())
    elif value is None or isinstance(value, (bool, int, np.generic, np.ndarray)):
        found[path] = repr(value)
    elif isinstance(value, (list, tuple)):
        for n, one in enumerate(value):
            digits(one, f"{path}[{n}]", found, seen)
    elif isinstance(value, dict):
        for key, one in value.items():
            if key not in LEFT_OUT:
                digits(one, f"{path}[{key!r}]", found, seen)
    elif type(value).__module__.startswith("mbody") and id(value) not in seen:
        seen[id(value)] = value
        if isinstance(value, (mbody.Mechanism, mbody.System)):
            return
        parts = dict(getattr(value, "__dict__", {}))
        if dataclasses.is_dataclass(value):
            parts |= {f.name: getattr(value, f.name, None) for f in dataclasses.fields(value)}
        digits(parts, path, found, seen)


def answer(machine, analysis):
    """Mantissas of all that a result has, by where it is."""
    try:
        run = analysis(machine)
    except mbody.ModelError as error:
        return {"refused": text_of(str(error))}
    found = {}
    digits(run, "", found, {})
    if isinstance(run, mbody.Solution):
        for body in run:
            for key in ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha"):
                digits(np.asarray(getattr(run[body], key)), f"{body}.{key}", found, {})
        for joint in machine.joints if run.has_forces else ():
            reaction = run.reaction(joint.name)
            for key in ("fx", "fy", "torque"):
                digits(np.asarray(getattr(reaction, key)), f"{joint.name}.{key}", found, {})
        digits(run.energy, "energy", found, {})
    return found


def free(machine):
    return [driver.name for driver in machine.drivers]


def moved(method):
    """A part of the motion that a model asks for."""

    def run(machine):
        until = number_in(machine, machine.simulation.until, "time", "simulate", "until")
        even = {"step": until / 1024.0} if method in ("rattle", "generalized-alpha") else {}
        return mbody.simulate(machine, until / 8.0, instants=9, method=method, **even)

    return run


ANALYSES = {
    "kinetostatics": asked,
    "statics": lambda machine: asked(machine, mbody.statics),
    "assembly modes": mbody.assembly_modes,
    "circuits": mbody.circuits,
    "dead centres": mbody.dead_centres,
    "driver range": mbody.driver_range,
    "equilibrium": lambda machine: mbody.equilibrium(machine, free=free(machine)),
    "modes": lambda machine: mbody.modes(machine, free=free(machine)),
    "mobility": mbody.mobility,
    **{name: moved(name) for name in ("dop853", "dopri5", "radau5", "rattle", "generalized-alpha")},
}
CASES = [
    ("quick_return", "kinetostatics"),
    ("stephenson_sixbar", "statics"),
    ("toggle_press", "kinetostatics"),
    ("slider_crank", "assembly modes"),
    ("quick_return", "circuits"),
    ("toggle_press", "dead centres"),
    ("mud_pump_sixbar", "driver range"),
    ("double_pendulum", "equilibrium"),
    ("porter_governor", "modes"),
    ("mud_pump", "mobility"),
    ("sliding_ladder", "dop853"),
    ("woodpecker", "dop853"),
    ("mud_pump_motor", "dop853"),
    ("bouncing_ball", "dopri5"),
    ("cart_pole", "dopri5"),
    ("double_pendulum", "rattle"),
]


@contextlib.contextmanager
def both(name, scale):
    """A model of the gallery in units of its own, and in others."""
    machine, one = gallery.load(name), Fraction(1)
    length, mass, time = (Fraction(2) ** power for power in scale)
    with (
        own_units(machine.units, one, one) as here,
        own_units(machine.units, length, mass, time) as there,
    ):
        first = in_units(machine, here)
        yield first, in_units(first, there)


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
@pytest.mark.parametrize(("name", "analysis"), CASES)
def test_every_number_has_the_same_digits(monkeypatch, name, analysis, scale):
    monkeypatch.setattr(traps, "traps", lambda machine: iter(()))
    with both(name, scale) as (first, second):
        assert_same_digits(*(answer(one, ANALYSES[analysis]) for one in (first, second)))


def assert_same_digits(ours, theirs):
    assert ours.keys() == theirs.keys()
    assert {key for key, value in ours.items() if theirs[key] != value} == set()


@pytest.mark.parametrize("seed", [2, 32, 33, 50, 55, 64, 190])
def test_scenes_of_contact_have_the_same_digits(monkeypatch, seed):
    """Stops of angles beside gaps, pins that stick, forces that no equation decides."""
    monkeypatch.setattr(traps, "traps", lambda machine: iter(()))
    found = []
    for length in (1.0, 2.0**40):
        scene = random_scene(seed).scaled(length, 1.0, 1.0)
        run = functools.partial(mbody.simulate, until=scene.until, instants=5)
        found.append(answer(scene.mechanism(f"scene {seed}"), run))
    assert_same_digits(*found)
