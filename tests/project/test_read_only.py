"""Nothing that a result hands out can change it."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

import mbody
from mbody import Gravity, Spring, engineering, makers
from mbody.solution.solution import Solution


def machine():
    made = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    made.add(Gravity("weight", y=-9.81), Spring("spring", "ground", "rocker.B", stiffness=20.0))
    return made


def driven():
    return mbody.kinetostatics(machine(), turn=True)


def free():
    return mbody.simulate(machine().without("motor"), 0.05, instants=5)


def batch():
    return mbody.kinetostatics(
        mbody.assemble(machine()).with_values({"crank.mass": [1.0, 2.0]}), t=[0.0, 0.1]
    )


def arrays_of(value, name=""):
    """Every array in a result, a dict or a tuple of them, by its name; not those of a motion that
    it is made of, which `handed_out` looks at.
    """
    if isinstance(value, Solution):
        return
    if isinstance(value, np.ndarray):
        yield name, value
    elif isinstance(value, dict):
        for key, part in value.items():
            yield from arrays_of(part, f"{name}[{key}]")
    elif isinstance(value, (tuple, list)):
        for n, part in enumerate(value):
            yield from arrays_of(part, f"{name}[{n}]")
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from arrays_of(getattr(value, field.name), f"{name}.{field.name}")


def handed_out(run):
    yield from arrays_of(run.t, "t")
    yield from arrays_of(run["coupler"], "body")
    yield from arrays_of(run["ground"], "ground")
    yield from arrays_of(run.point("coupler.B"), "point")
    yield from arrays_of(run.reaction("A"), "reaction")
    yield from arrays_of(run.reaction("O2", on="ground"), "reaction")
    yield from arrays_of(run.load("spring"), "load")
    yield from arrays_of(run.measure("coupler.angle"), "measure")
    yield from arrays_of(run.measure("t"), "measure of time")
    yield from arrays_of(run.momentum(), "momentum")
    yield from arrays_of(dict(run.system.values), "values")
    if run.mechanism.drivers:
        yield from arrays_of(run.effort("motor"), "effort")
        yield from arrays_of(run.driven("motor"), "driven")
        if not run.record.batch:
            yield from arrays_of(run.drive_states, "states")
    if run.energy is not None:
        yield from arrays_of(run.energy, "energy")


@pytest.mark.parametrize("make", [driven, free, batch])
@pytest.mark.parametrize("how", [lambda run: run, lambda run: pickle.loads(pickle.dumps(run))])
def test_histories_are_read_only(make, how):
    run = how(make())
    before = run.record.table(slice(None)).copy()
    for name, array in handed_out(run):
        with pytest.raises(ValueError, match="read-only"):
            array *= 180.0 / np.pi
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
        assert not array.flags.writeable, name
    np.testing.assert_array_equal(run.record.table(slice(None)), before)


def test_what_others_make_of_a_result_is_read_only():
    system = machine().without("motor")
    rest = mbody.equilibrium(system)
    small = mbody.modes(system)
    run = driven()
    swept = mbody.sweep(
        machine(), {"crank.mass": [1.0, 2.0]}, measure="peak(motor.effort)", turn=True
    )
    found = [
        *(arrays_of(one.stiffness, "stiffness") for one in rest),
        arrays_of([mode for at in small for mode in at.modes], "modes"),
        arrays_of(run.equations(), "equations"),
        arrays_of(engineering.shaking_force(run), "shaking force"),
        arrays_of(engineering.fluctuation(run), "fluctuation"),
        arrays_of(swept["peak(motor.effort)"], "sweep"),
        arrays_of(swept.axes, "axes"),
    ]
    seen = 0
    for name, array in (pair for group in found for pair in group):
        seen += 1
        assert not array.flags.writeable, name
    assert seen > 12


@pytest.mark.parametrize(
    "how", [lambda s: s, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))]
)
def test_values_of_a_system_refuse_to_be_assigned(how):
    system = how(mbody.assemble(machine()))
    changes = [
        lambda v: v.__setitem__("crank.mass", 3.0),
        lambda v: v.__delitem__("crank.mass"),
        lambda v: v.update(a=1),
        lambda v: v.pop("crank.mass"),
        lambda v: v.clear(),
        lambda v: v.setdefault("a", 1.0),
    ]
    for change in changes:
        with pytest.raises(TypeError, match="read-only"):
            change(system.values)
    assert dict(system.values) == system.values
    assert system.with_values({"crank.mass": 5.0}).values["crank.mass"] == 5.0
    assert system.values["crank.mass"] == 1.0
