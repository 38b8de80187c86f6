"""Derivatives by differences of eight places: the independent route beside exact derivatives."""

import numpy as np

import mbody

PLACES = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
#: Fornberg, Generation of finite difference formulas (1988): the error is of the eighth power.
WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
#: Part of a number: longer steps of a pump cross the corners of its valves.
STEP = 2e-5


def step_of(system, name):
    """A step by which neither lengths nor angles change much."""
    size = abs(float(system.values[name]))
    unit = mbody.assemble(system.mechanism).length if name.endswith((".x", ".y")) else 0.0
    return STEP * (size or unit or 1.0)


def tables(system, name, analysis, t):
    """All rows of an analysis at the places of a number: (places, instants, rows)."""
    value, step = float(system.values[name]), step_of(system, name)
    runs = [analysis(system.with_values({name: value + k * step}), t=t) for k in PLACES]
    return np.array([run.record.table(slice(None)) for run in runs])


def difference(system, name, analysis, t):
    """The derivative of all rows by a number, (instants, rows)."""
    return np.tensordot(WEIGHTS, tables(system, name, analysis, t), 1) / step_of(system, name)
