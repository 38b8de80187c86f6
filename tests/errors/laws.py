"""Laws of motion and force."""

import math

import numpy as np

from mbody.laws import (
    Cam,
    Constant,
    ConstantAcceleration,
    ConstantSpeed,
    Dwell,
    Expression,
    Function,
    Harmonic,
    Polynomial,
    Rise,
    Table,
    as_law,
    times_of,
)

PI = math.pi
ACCELERATED = ConstantAcceleration(0.0, 25.0, -40.0)
UP, DOWN = Rise("3-4-5", 1, 0, 1), Rise("3-4-5", -1, 0, 1)
CAM = Cam([Rise("cycloidal", 2.0, 0.5, 1.0), Rise("4-5-6-7", -2.0, 0.5, 1.0)], period=4.0)

#: Laws that do not reach the requested values: law, values, start.
NOT_REACHED = {
    "turns back": (ACCELERATED, [7.0, 9.0], 0.0),
    "past": (ACCELERATED, [5.0, 7.8], 0.5),
    "other way": (ACCELERATED, [0.0, -1.0], 0.0),
    "stays": (Constant(2.0), [3.0], 0.0),
    "a polynomial that stays": (Polynomial([2.0]), [3.0], 0.0),
    "a polynomial that turns back": (Polynomial([0.0, 3.0, 0.0, -1.0]), [0.0, 2.5], 0.0),
    "a polynomial that runs the other way": (Polynomial([0.0, -3.0, 0.0, 1.0]), [0.0, 2.5], 0.0),
    "a harmonic that turns back": (Harmonic(1.0, 2.0, PI, 0.0), [1.0, 3.5], 0.0),
    "a harmonic that stays": (Harmonic(1.0, 0.0, PI, 0.0), [1.0, 3.5], 0.0),
    "a table that ends": (Table([0, 1, 2], [0, 1, 4]), [0.0, 5.0], 0.0),
    "a rise that ends": (Rise("3-4-5", 2, 1, 1), [0.0, 5.0], 0.0),
    "a cam that turns back": (CAM, [0.0, 2.5], 0.0),
    "a function that turns back": (Function(math.sin), [0.0, 1.5], 0.0),
    "a function that runs the other way": (Function(math.cos), [1.0, 1.5], 0.0),
    "a function that comes to rest": (Function(math.tanh), [0.0, 1.5], 0.0),
    "values up and down": (ACCELERATED, [1.0, 3.0, 2.0], 0.0),
    "values that are nan": (ACCELERATED, [1.0, math.nan], 0.0),
    "an infinite start": (ACCELERATED, [1.0], math.inf),
}

SCENARIOS = {
    "no number": lambda: Constant(math.nan),
    "no speed": lambda: ConstantSpeed(0, math.inf),
    "a list": lambda: ConstantAcceleration(0, 0, [3]),
    "true": lambda: Constant(True),
    "no frequency": lambda: Harmonic(0, 1, np.nan, 0),
    "text that is no formula": lambda: Constant("3 +"),
    "no coefficients": lambda: Polynomial([]),
    "a coefficient that is nan": lambda: Polynomial([1, math.nan]),
    "coefficients as text": lambda: Polynomial("1, 2"),
    "coefficients in rows": lambda: Polynomial([[1, 2]]),
    "no coefficients in a row": lambda: Polynomial([[]]),
    "a table of unequal columns": lambda: Table([0, 1], [0, 1, 2]),
    "a table of one point": lambda: Table([0], [0]),
    "a table that stands still": lambda: Table([0, 2, 2, 3], [0, 1, 2, 3]),
    "a table to infinity": lambda: Table([0, 1, math.inf], [0, 1, 2]),
    "a table of nan": lambda: Table([0, 1], [0, math.nan]),
    "a table that does not close": lambda: Table([0, 1], [0, 1], periodic=True),
    "a table of another end": lambda: Table([0, 1], [0, 1], end="free"),
    "a table of another outside": lambda: Table([0, 1], [0, 1], outside="wrap"),
    "a table of another interpolation": lambda: Table([0, 1], [0, 1], interpolation="cubic"),
    "a table of lines with an end": lambda: Table(
        [0, 1], [0, 1], end="natural", interpolation="linear"
    ),
    "a table asked outside": lambda: Table([0, 0.1, 0.2], [1, 2, 4])(np.array([0.1, 0.31, 0.5])),
    "a rise of another shape": lambda: Rise("quintic", 1, 0, 1),
    "a rise at once": lambda: Rise("3-4-5", 1, 0, 0),
    "an infinite rise": lambda: Rise("3-4-5", math.inf, 0, 1),
    "a negative dwell": lambda: Dwell(-1),
    "a dwell of none": lambda: Dwell(None),
    "a cam that stays up": lambda: Cam([UP], 2),
    "a cam without a rise": lambda: Cam([Dwell(1)], 2),
    "a cam of something else": lambda: Cam([Constant(1)], 2),
    "a cam of no list": lambda: Cam(3, 2),
    "a cam of no period": lambda: Cam([], 0),
    "a cam that lasts too long": lambda: Cam([UP, Rise("3-4-5", -1, 0, 1.5)], 2),
    "a cam that overlaps": lambda: Cam([UP, Rise("3-4-5", -1, -0.5, 1)], 2),
    "a cam of two bases": lambda: Cam([UP, Rise("3-4-5", -1, 0, 1, 1)], 2),
    "no function": lambda: Function(3),
    "no rate": lambda: Function(math.sin, rate=1),
    "no scale": lambda: Function(math.sin, scale=0),
    "a function that gives nothing": lambda: Function(lambda t: None)(0.5),
    "a function that gives nan": lambda: Function(lambda t: math.nan)(0.5),
    "asked at nan": lambda: Constant(1)(math.nan),
    "asked before it is in a mechanism": lambda: ConstantSpeed("60 deg", "25 rad/s")(0.5),
    "bytes": lambda: as_law(b"3"),
    "points that are no table": lambda: as_law(([0, 1], [0, 1])),
    "no law": lambda: as_law(True),
    "nan": lambda: as_law(math.nan),
    "a class of laws": lambda: as_law(Harmonic),
    "another class": lambda: as_law(float),
    **{
        f"asked for more: {name}": lambda asked=asked: times_of(*asked)
        for name, asked in NOT_REACHED.items()
    },
    # -- programs of formulas, as from a pickle
    "an empty program": lambda: Expression("t", (), ()),
    "another operation": lambda: Expression("t", (99,), ()),
    "too few constants": lambda: Expression("t", (0, 1), ()),
    "too few numbers": lambda: Expression("t", (0, 19), ()),
    "no numbers": lambda: Expression("t", (7,), ()),
    "numbers left": lambda: Expression("t", (0, 0), ()),
    "too many operations": lambda: Expression("t", (0,) + (7,) * 200, ()),
    "a constant that is nan": lambda: Expression("t", (1,), (math.nan,)),
    "no text": lambda: Expression(3, (0,), ()),
}
