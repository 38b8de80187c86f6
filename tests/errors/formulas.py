"""Formulas, parameters and units."""

import pint

from mbody import AngleDriver, Body, Force, Mechanism, ModelError, Spring, Torque
from mbody.laws import ConstantSpeed, Table, compile_formula
from mbody.quantities import FormulaError, Scope, convert, read
from mbody.quantities.units import DIMENSIONS
from tests.errors.models import crank_alone

#: Text that is no formula.
TEXTS = {
    "nothing": "",
    "too long": "1+" * 1001,
    "too many operations": "1+" * 301 + "1",
    "nested too deep": "(" * 41 + "1",
    "a foreign sign": "3 & 4",
    "a decimal comma": "3,5",
    "a function that is none": "sinus(3)",
    "a comma in no function": "a, b",
    "a bracket that was not opened": "3)",
    "a function that is none behind a number": "3 sinus(2)",
    "a unit before a bracket": "3 m (2)",
    "a function behind a number": "3 sin(2)",
    "a quote alone": '"',
    "an open bracket": "(3",
    "an open function": "sin(3",
    "a sign for a number": "3 * / 4",
    "a huge number": "1e999",
    "a function of one number": "atan2(1)",
    "a power of a unit": "3 m^12",
    "a unit after a raised digit": "3² m",
}

#: Lengths that are none: formulas whose units do not fit.
UNITS = {
    "a mass": "3 kg",
    "an area": "3 m^2",
    "a stiffness": "3 N/m",
    "what has no name": "3 m^5",
    "a plain number beside a length": "5 in + 2",
    "a unit twice": "(3 m) m",
    "a unit for the whole power": "0.5*3^2 m",
    "a length to a parameter": "(2 m)^a",
    "a root of an angle": "log(3 m)*1 m",
    "a division by zero": "1 m/0",
}

#: What is often meant by what is written: text, and the field that takes it.
COMMON_MISTAKES = {
    "pounds": ("weight", "3 lb"),
    "kilograms for a weight": ("weight", "3 kg"),
    "pounds force": ("mass", "3 lbf"),
}

#: Formulas of time that are no angle.
LAWS = {
    "a length": "25 m/s*t",
    "a time beside an angle": "60 deg + 25*t",
    "a sine of a time": "2 rad*sin(5 s*t)",
    "a stretch": "2*x",
    "a stretch and time": "2*x*t",
    "a parameter that is not there": "q*t",
    "an infinite part": "t + 1/(1 - 1)",
    "too long for the machine": "+".join(["sin(t)"] * 100),
}

#: Parameters that are none.
PARAMETERS = {
    "not a dict": [("a", 1.0)],
    "no name": {"2a": 1.0},
    "a name of formulas": {"sin": 1.0},
    "a list": {"a": [1.0]},
    "nan": {"a": float("nan")},
    "no formula": {"a": "3 +"},
    "a parameter of time": {"a": "3*t"},
    "a ring": {"a": "2*b", "b": "3*c", "c": "a"},
    "another parameter": {"a": "2*q"},
    "an infinite parameter": {"a": "1/0"},
}


def scaled(**parameters):
    """A mechanism with parameters whose body is as long as the text says."""

    def add(text):
        machine = Mechanism("m", parameters=parameters)
        machine.add(Body("b", points={"A": (text, 0)}))

    return add


def parameter_m(value=2.0):
    machine = Mechanism("m", parameters={"m": value})
    machine.add(Body("crank"))
    return machine


def by_itself(text, argument):
    """What the compiler of formulas says of a variable that is not its own."""
    try:
        compile_formula(read(text, None), Scope(), DIMENSIONS[argument])
    except FormulaError as error:
        raise ModelError(str(error)) from error


def spring(law):
    crank_alone().add(Spring("s", "ground", "crank.A", law=law))


def motor(law):
    crank_alone().add(AngleDriver("motor", "crank", law))


SCENARIOS = {
    **{name: lambda text=text: Body("b", mass=text) for name, text in TEXTS.items()},
    **{name: lambda text=text: scaled(a=2.0)(text) for name, text in UNITS.items()},
    **{
        f"meant: {name}": lambda key=key, text=text: Body("b", **{key: text})
        for name, (key, text) in COMMON_MISTAKES.items()
    },
    "a unit that is a parameter": lambda: parameter_m().add(Force("F", "crank", value="m*(3 N*m)")),
    "a unit that measures the same as a parameter": lambda: parameter_m("2 m").add(
        Torque("T", "crank", value="3 N*m")
    ),
    "a guess by no parameter": lambda: Mechanism("m").add(Body("b", guess="2*q")),
    "a number of a law": lambda: motor(ConstantSpeed("60 deg", "25 kg")),
    "a law of a stretch by itself": lambda: by_itself("2*t", "length"),
    "a quantity of nothing mechanical": lambda: Body("b", mass=pint.UnitRegistry()("3 candela")),
    **{f"a law of {name}": lambda text=text: motor(text) for name, text in LAWS.items()},
    "a force for a stretch": lambda: spring("20 N/m^2*x"),
    "a table of another dimension": lambda: motor(Table([0, 1], ["0 deg", "3 kg"])),
    **{
        f"parameters: {name}": lambda given=given: Mechanism("m", parameters=given)
        for name, given in PARAMETERS.items()
    },
    "a conversion": lambda: convert(3.0, "lbf", "kg"),
    "a conversion from no unit": lambda: convert(3.0, "m*0", "mm"),
}

SENTENCES = r"""
nothing | ModelError | b | 'b': mass: it is empty: give a number
too long | ModelError | b | 'b': mass: it is 2002 characters long, at most 2000 are read
too many operations | ModelError | b | 'b': mass: '1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1+1...' has 301 operations, at most 200 are read
nested too deep | ModelError | b | 'b': mass: '(((((((((((((((((((((((((((((((((((((((((1' is nested more than 40 deep
a foreign sign | ModelError | b | 'b': mass: '3 & 4' contains '&', which is not allowed in a formula
a decimal comma | ModelError | b | 'b': mass: '3,5' is not a formula: write a decimal point, not a comma
a function that is none | ModelError | b | 'b': mass: 'sinus(3)': there is no function 'sinus' (there are: sin, cos, tan, asin, acos, atan, sqrt, abs, exp, log, sign, step, atan2, hypot, min, max, deadband, clamp)
a comma in no function | ModelError | b | 'b': mass: 'a, b' is not a formula: the ',' is not within a function
a bracket that was not opened | ModelError | b | 'b': mass: '3)' is not a formula: a '(' is missing
a function that is none behind a number | ModelError | b | 'b': mass: '3 sinus(2)' is not a formula: there is no function 'sinus' (there are: sin, cos, tan, asin, acos, atan, sqrt, abs, exp, log, sign, step, atan2, hypot, min, max, deadband, clamp)
a unit before a bracket | ModelError | b | 'b': mass: '3 m (2)' is not a formula: an operator is missing before '('
a function behind a number | ModelError | b | 'b': mass: '3 sin(2)' is not a formula: an operator is missing before 'sin'
a quote alone | ModelError | b | 'b': mass: '"' has a " without a number
an open bracket | ModelError | b | 'b': mass: '(3' lacks a ')'
an open function | ModelError | b | 'b': mass: 'sin(3' lacks a ')'
a sign for a number | ModelError | b | 'b': mass: '3 * / 4' has '/' where a number is expected
a huge number | ModelError | b | 'b': mass: '1e999' is too large or too small for a number of double precision
a function of one number | ModelError | b | 'b': mass: 'atan2(1)': atan2 takes two numbers, not 1
a power of a unit | ModelError | b | 'b': mass: '3 m^12': the power of the unit 'm' must be one digit
a unit after a raised digit | ModelError | b | 'b': mass: '3² m' is not a formula: put brackets before the unit, as in '(3²) m'
a mass | ModelError | b | 'b': A.x: '3 kg' is a mass (kg), where a length (m) is wanted
an area | ModelError | b | 'b': A.x: '3 m^2' is an area (m²), where a length (m) is wanted
a stiffness | ModelError | b | 'b': A.x: '3 N/m' is a stiffness (N/m), where a length (m) is wanted
what has no name | ModelError | b | 'b': A.x: '3 m^5' is a quantity in m⁵, where a length (m) is wanted
a plain number beside a length | ModelError | b | 'b': A.x: it adds a length (m) and a plain number: give every number its unit
a unit twice | ModelError | b | 'b': A.x: the part before 'm' is a length (m) already: leave the unit out
a unit for the whole power | ModelError | b | 'b': A.x: an exponent is a length (m), it must be a plain number; a unit goes with the number before it: did you mean '0.5 * (3^2) m'?
a length to a parameter | ModelError | b | 'b': A.x: the power of a length (m) must be a literal number
a root of an angle | ModelError | b | 'b': A.x: 'log' takes a plain number, not a length (m)
a division by zero | ModelError | b | 'b': A.x: '1 m/0' evaluates to inf, it must be finite
meant: pounds | ModelError | b | 'b': weight: '3 lb' is a mass (kg), where a force (N) is wanted: did you mean '3 lbf'?
meant: kilograms for a weight | ModelError | b | 'b': weight: '3 kg' is a mass (kg), where a force (N) is wanted: did you mean '3 kgf'?
meant: pounds force | ModelError | b | 'b': mass: '3 lbf' is a force (N), where a mass (kg) is wanted: did you mean '3 lb'?
a unit that is a parameter | ModelError | F | 'F': value: 'm*(3 N*m)' is a torque (N·m), where a force (N) is wanted; 'm' in 'N·m' is the unit, since it is joined to a unit without a space: write '* (m)' or '/ (m)' for the parameter
a unit that measures the same as a parameter | ModelError | T | 'T': value: 'm' in 'N·m' is a unit, and a parameter of the same dimension, a length (m): write '* (m)' for the parameter, or choose another name for it
a guess by no parameter | ModelError | b | 'b': guess: there is no parameter 'q' (there are none)
a number of a law | ModelError | motor | 'motor': law: speed: '25 kg' is a mass (kg), where an angular velocity (rad/s) is wanted
a law of a stretch by itself | ModelError | - | 't' is allowed only in laws of time
a quantity of nothing mechanical | ModelError | b | 'b': mass: '3 candela' is not a quantity of length, mass, time, angle, current or absolute temperature (K)
a law of a length | ModelError | motor | 'motor': law: '25 m/s*t' is a length (m), where an angle (rad) is wanted
a law of a time beside an angle | ModelError | motor | 'motor': law: it adds an angle (rad) and a time (s)
a law of a sine of a time | ModelError | motor | 'motor': law: 'sin' takes an angle, not a quantity in s²
a law of a stretch | ModelError | motor | 'motor': law: '2*x' is a formula of 'x', but the variable here is 't', a time (s)
a law of a stretch and time | ModelError | motor | 'motor': law: '2*x*t' is a formula of 'x', but the variable here is 't', a time (s)
a law of a parameter that is not there | ModelError | motor | 'motor': law: there is no parameter 'q' (there are none)
a law of an infinite part | ModelError | motor | 'motor': law: '1 / (1 - 1)' evaluates to inf, it must be finite
a law of too long for the machine | ModelError | motor | 'motor': law: 'sin(t)+sin(t)+sin(t)+sin(t)+sin(t)+sin(t)+sin(t)+sin(t)+s...' has 299 operations and a stack of 2 numbers, at most 200 and 32 are possible: define parts of it as parameters
a force for a stretch | ModelError | s | 's': law: '20 N/m^2*x' is a stiffness (N/m), where a force (N) is wanted
a table of another dimension | ModelError | motor | 'motor': law: y: '3 kg' is a mass (kg), where an angle (rad) is wanted
parameters: not a dict | ModelError | - | parameters must be a dict such as {"a": 2.0}, not [('a', 1.0)]
parameters: no name | ModelError | - | '2a' cannot name a parameter: a name begins with a letter, has letters, digits and _, and at most 40 characters
parameters: a name of formulas | ModelError | sin | the name 'sin' is reserved for formulas: choose another name for the parameter
parameters: a list | ModelError | a | parameter 'a' must be a number, not [1.0]
parameters: nan | ModelError | a | parameter 'a' is nan, it must be finite
parameters: no formula | ModelError | a | parameter 'a': '3 +' ends where a number is expected
parameters: a parameter of time | ModelError | a | parameter 'a' is '3*t', but only a law may change with 't'
parameters: a ring | ModelError | a | the parameters a → b → c → a depend on each other: give one of them a number
parameters: another parameter | ModelError | a | parameter 'a': there is no parameter 'q' (there are none)
parameters: an infinite parameter | ModelError | a | parameter 'a': '1/0' evaluates to inf, it must be finite
a conversion | ModelError | - | cannot convert: 'lbf' is a force (N), 'kg' is a mass (kg)
a conversion from no unit | ModelError | - | cannot convert: 'm*0' or 'mm' is not a unit
"""
