"""One law of every kind, and some Python functions."""

import math

import numpy as np

from mbody.laws import (
    SHAPES,
    Cam,
    Constant,
    ConstantAcceleration,
    ConstantSpeed,
    Dwell,
    Function,
    Harmonic,
    Polynomial,
    Rise,
    Table,
)

PI = math.pi
KNOTS = np.array([0.0, 0.1, 0.25, 0.3, 0.55, 0.7, 1.0])
CAM = Cam(
    [
        Rise("cycloidal", 3.0, 0.0, 1.0, base=-1.0),
        Dwell(0.5),
        Rise("modified-sine", -1.0, 0.0, 0.5),
        Rise("4-5-6-7", -2.0, 0.25, 1.0),
    ],
    period=4.0,
)


def named_function(t):
    return math.exp(-t) * math.sin(3.0 * t)


def broken_function(t):
    raise RuntimeError(f"the valve table has no entry for {t:g}")


EXAMPLES = [
    Constant(3.0),
    ConstantSpeed(1.0, -2.0),
    ConstantAcceleration(60.0, 25.0, -40.0),
    Polynomial([1.0, -2.0, 0.5, 3.0, -0.25]),
    Harmonic(1.0, 2.0, 3.0, 0.4),
    Table(KNOTS, np.cos(3.0 * KNOTS), outside="line"),
    Table(KNOTS, np.sin(2.0 * PI * KNOTS), periodic=True),
    *[Rise(shape, -2.0, 0.2, 0.7, 1.5) for shape in SHAPES],
    CAM,
    Function(named_function),
]
IDS = [f"{type(e).__name__}-{i}" for i, e in enumerate(EXAMPLES)]
