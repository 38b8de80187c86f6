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
    "no speed": lambda: ConstantSpeed(0, math.inf),
    "text that is no formula": lambda: Constant("3 +"),
    "no coefficients": lambda: Polynomial([]),
    "coefficients as text": lambda: Polynomial("1, 2"),
    "no coefficients in a row": lambda: Polynomial([[]]),
    "a table of unequal columns": lambda: Table([0, 1], [0, 1, 2]),
    "a table of one point": lambda: Table([0], [0]),
    "a table that stands still": lambda: Table([0, 2, 2, 3], [0, 1, 2, 3]),
    "a table that does not close": lambda: Table([0, 1], [0, 1], periodic=True),
    "a table of another end": lambda: Table([0, 1], [0, 1], end="free"),
    "a table of lines with an end": lambda: Table(
        [0, 1], [0, 1], end="natural", interpolation="linear"
    ),
    "a table asked outside": lambda: Table([0, 0.1, 0.2], [1, 2, 4])(np.array([0.1, 0.31, 0.5])),
    "a rise of another shape": lambda: Rise("quintic", 1, 0, 1),
    "a rise at once": lambda: Rise("3-4-5", 1, 0, 0),
    "a negative dwell": lambda: Dwell(-1),
    "a cam that stays up": lambda: Cam([UP], 2),
    "a cam without a rise": lambda: Cam([Dwell(1)], 2),
    "a cam of something else": lambda: Cam([Constant(1)], 2),
    "a cam of no list": lambda: Cam(3, 2),
    "a cam of no period": lambda: Cam([], 0),
    "a cam that lasts too long": lambda: Cam([UP, Rise("3-4-5", -1, 0, 1.5)], 2),
    "a cam that overlaps": lambda: Cam([UP, Rise("3-4-5", -1, -0.5, 1)], 2),
    "a cam of two bases": lambda: Cam([UP, Rise("3-4-5", -1, 0, 1, 1)], 2),
    "no rate": lambda: Function(math.sin, rate=1),
    "no scale": lambda: Function(math.sin, scale=0),
    "a function that gives nothing": lambda: Function(lambda t: None)(0.5),
    "asked at nan": lambda: Constant(1)(math.nan),
    "asked before it is in a mechanism": lambda: ConstantSpeed("60 deg", "25 rad/s")(0.5),
    "no law": lambda: as_law(True),
    "a class of laws": lambda: as_law(Harmonic),
    **{
        f"asked for more: {name}": lambda asked=asked: times_of(*asked)
        for name, asked in NOT_REACHED.items()
    },
    # -- programs of formulas, as from a pickle
    "another operation": lambda: Expression("t", (99,), ()),
    "too few constants": lambda: Expression("t", (0, 1), ()),
    "no numbers": lambda: Expression("t", (7,), ()),
    "numbers left": lambda: Expression("t", (0, 0), ()),
    "too many operations": lambda: Expression("t", (0,) + (7,) * 200, ()),
    "no text": lambda: Expression(3, (0,), ()),
}

SENTENCES = r"""
no speed | ModelError | - | ConstantSpeed: speed must be a finite number, it is inf
text that is no formula | ModelError | - | Constant: value: '3 +' ends where a number is expected
no coefficients | ModelError | - | Polynomial: coefficients is empty; give at least the constant term
coefficients as text | ModelError | - | Polynomial: coefficients must be numbers, not '1, 2'
no coefficients in a row | ModelError | - | Polynomial: coefficients must be one row of numbers, it has the shape (1, 0)
a table of unequal columns | ModelError | - | Table: x has 2 points and y has 3; give as many
a table of one point | ModelError | - | Table: at least 2 points are needed, there is 1
a table that stands still | ModelError | - | Table: x must increase from point to point, but x[2] = 2 follows x[1] = 2: sort the points and drop repeated ones
a table that does not close | ModelError | - | Table: a periodic table must end where it begins, but y[0] = 0 and y[-1] = 1: repeat the first point one period later as the last
a table of another end | ModelError | - | Table: end must be one of natural, not-a-knot, clamped, not 'free'
a table of lines with an end | ModelError | - | Table: end = 'natural' is for a spline, not for interpolation = 'linear': leave out end, or choose interpolation = 'spline'
a table asked outside | ModelError | - | Table: the table covers 0 to 0.2, but 0.31 was requested: add points, or choose outside="hold" or "line"
a rise of another shape | ModelError | - | Rise: shape must be one of cycloidal, harmonic, 3-4-5, 4-5-6-7, parabolic, modified-trapezoidal, modified-sine, not 'quintic'
a rise at once | ModelError | - | Rise: duration must be positive, it is 0: a fall is a rise of negative height
a negative dwell | ModelError | - | Dwell: duration must be positive, it is -1
a cam that stays up | ModelError | - | Cam: the program ends +1 from where it began: the heights of its rises and returns must add up to 0
a cam without a rise | ModelError | - | Cam: the program has no rise; use Constant for a law without motion
a cam of something else | ModelError | - | Cam: segments[0] must be a Rise or a Dwell, not Constant(value=1.0)
a cam of no list | ModelError | - | Cam: segments must be a list of Rise and Dwell, not 3
a cam of no period | ModelError | - | Cam: period must be positive, it is 0
a cam that lasts too long | ModelError | - | Cam: the segments last 2.5 in all, longer than the period 2
a cam that overlaps | ModelError | - | Cam: segments[1] starts 0.5 before the segment before it ends; start counts from that end
a cam of two bases | ModelError | - | Cam: segments[1] has base = 1, but the level is taken from the segment before it: leave base out
no rate | ModelError | - | Function: rate must be a function of one number, not 1
no scale | ModelError | - | Function: scale must be positive, it is 0
a function that gives nothing | ModelError | - | Function: <lambda> returned None at x = 0.5; it must return one finite number
asked at nan | ModelError | - | Constant: evaluated at x = nan; x must be finite
asked before it is in a mechanism | ModelError | - | ConstantSpeed: its numbers are text, which has a value only in a mechanism: add the element with this law to one and evaluate it there
no law | ModelError | - | a law must be a number, a law such as ConstantSpeed(0, 10), or a function of one number, not True; for points use Table(x, y)
a class of laws | ModelError | - | a law is made from its numbers: Harmonic(...), not the class Harmonic itself
asked for more: turns back | ModelError | - | the law turns back at t = 0.625 where it has reached 7.8125; it does not reach 9: request values before that, or change the law or the start
asked for more: past | ModelError | - | the law is at 7.5 at t = 0.5, already past 5: start earlier, or from a later value
asked for more: other way | ModelError | - | the law goes in the other direction from t = 0, where it is 0: it does not reach -1; request values before that, or change the law or the start
asked for more: stays | ModelError | - | the law stays at 2 from t = 0: it does not reach 3; request values before that, or change the law or the start
asked for more: a polynomial that stays | ModelError | - | the law stays at 2 from t = 0: it does not reach 3; request values before that, or change the law or the start
asked for more: a polynomial that turns back | ModelError | - | the law turns back at t = 1 where it has reached 2; it does not reach 2.5: request values before that, or change the law or the start
asked for more: a polynomial that runs the other way | ModelError | - | the law goes in the other direction from t = 0, where it is 0: it does not reach 2.5; request values before that, or change the law or the start
asked for more: a harmonic that turns back | ModelError | - | the law turns back at t = 0.5 where it has reached 3; it does not reach 3.5: request values before that, or change the law or the start
asked for more: a harmonic that stays | ModelError | - | the law stays at 1 from t = 0: it does not reach 3.5; request values before that, or change the law or the start
asked for more: a table that ends | ModelError | - | the law goes no further than 4, at t = 2; it does not reach 5: request values before that, or change the law or the start
asked for more: a rise that ends | ModelError | - | the law goes no further than 2, at t = 2; it does not reach 5: request values before that, or change the law or the start
asked for more: a cam that turns back | ModelError | - | the law turns back at t = 2 where it has reached 2; it does not reach 2.5: request values before that, or change the law or the start
asked for more: a function that turns back | ModelError | - | the law turns back at t = 1.5708 where it has reached 1; it does not reach 1.5: request values before that, or change the law or the start
asked for more: a function that runs the other way | ModelError | - | the law goes in the other direction from t = 0, where it is 1: it does not reach 1.5; request values before that, or change the law or the start
asked for more: a function that comes to rest | ModelError | - | the law goes no further than 1, at t = 1024; it does not reach 1.5: request values before that, or change the law or the start, or give a larger scale
asked for more: values up and down | ModelError | - | the values must all increase or all decrease, but 2 follows 3: request each stretch separately
asked for more: values that are nan | ModelError | - | times_of: values[1] must be a finite number, it is nan
asked for more: an infinite start | ModelError | - | times_of: t0 must be a finite number, it is inf
another operation | ModelError | - | Expression: program must contain indices of operations, not (99,)
too few constants | ModelError | - | Expression: the program takes 1 constants, there are 0
no numbers | ModelError | - | Expression: the program uses a number that is not on the stack
numbers left | ModelError | - | Expression: the program leaves 2 numbers, not one
too many operations | ModelError | - | Expression: the program has 201 operations and a stack of 1 numbers, at most 200 and 32 are possible
no text | ModelError | - | Expression: text must be the formula, not 3
"""
