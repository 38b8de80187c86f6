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
    "a comma in brackets": "(a, b)",
    "a unit that is none": "3 lbz",
    "a unit like no other": "3 quux7",
    "a function that is none": "sinus(3)",
    "a comma in no function": "a, b",
    "a bracket that was not opened": "3)",
    "a function that is none behind a number": "3 sinus(2)",
    "a unit before a bracket": "3 m (2)",
    "a function behind a number": "3 sin(2)",
    "two numbers": "3 4",
    "a quote alone": '"',
    "an open bracket": "(3",
    "an open function": "sin(3",
    "an end too soon": "3 +",
    "a sign for a number": "3 * / 4",
    "a huge number": "1e999",
    "a function of two numbers": "sin(1, 2)",
    "a function of one number": "atan2(1)",
    "a function of three numbers": "clamp(1, 2)",
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
    "a length beside a time": "5 in - 2 s",
    "a unit twice": "(3 m) m",
    "a power of a length": "2^(3 m)",
    "a unit for the whole power": "0.5*3^2 m",
    "a length to a parameter": "(2 m)^a",
    "a sine of a length": "sin(3 m)*1 m",
    "a root of an angle": "log(3 m)*1 m",
    "unequal sides": "hypot(3 m, 4 s)",
    "a name that stands for nothing": "2*q",
    "time": "2*t + 1/t",
    "a division by zero": "1 m/0",
}

#: What is often meant by what is written: text, and the field that takes it.
MEANT = {
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
        for name, (key, text) in MEANT.items()
    },
    "a unit that is a parameter": lambda: parameter_m().add(Force("F", "crank", value="m*(3 N*m)")),
    "a unit that measures the same as a parameter": lambda: parameter_m("2 m").add(
        Torque("T", "crank", value="3 N*m")
    ),
    "a guess by no parameter": lambda: Mechanism("m").add(Body("b", guess="2*q")),
    "a number of a law": lambda: motor(ConstantSpeed("60 deg", "25 kg")),
    "a law of time by itself": lambda: by_itself("2*x", "time"),
    "a law of a stretch by itself": lambda: by_itself("2*t", "length"),
    "no parameters": lambda: scaled()("2*q"),
    "a quantity of nothing mechanical": lambda: Body("b", mass=pint.UnitRegistry()("3 candela")),
    **{f"a law of {name}": lambda text=text: motor(text) for name, text in LAWS.items()},
    "time in the law of a spring": lambda: spring("2 N/m*t"),
    "a force for a stretch": lambda: spring("20 N/m^2*x"),
    "a table of another dimension": lambda: motor(Table([0, 1], ["0 deg", "3 kg"])),
    "a table of no parameter": lambda: motor(Table([0, 1], ["q", 1])),
    **{
        f"parameters: {name}": lambda given=given: Mechanism("m", parameters=given)
        for name, given in PARAMETERS.items()
    },
    "a conversion": lambda: convert(3.0, "lbf", "kg"),
    "a conversion from no unit": lambda: convert(3.0, "m*0", "mm"),
    "a conversion to nothing": lambda: convert(3.0, "lbf", "2"),
    "a conversion to an unknown unit": lambda: convert(3.0, "lbf", "newtn"),
}
