"""Functions, joints and loads of the user's own."""

import math
from dataclasses import dataclass

from mbody import (
    Body,
    CustomJoint,
    CustomLoad,
    Function,
    assemble,
    kinematics,
    kinetostatics,
)
from mbody.elements import number_field
from tests.errors.models import by_law, four_bar, no_oil, with_own

#: Where a user's function may stand.
KINDS = ["driver", "load", "spring", "custom load", "custom joint"]


@dataclass(frozen=True)
class Cable(CustomLoad):
    length: float = number_field("length", 1.0, sign="positive")


def nothing():
    return 1.0


def own_joint():
    machine = four_bar(Body("pin"))
    machine.add(CustomJoint("own", "rocker.B", "pin"))
    return machine


def late(t):
    return 1.0 + t if t < 0.5 else no_oil()


LATE = Function(late, lambda t: 1.0, lambda t: 0.0)


def giving(kind, value):
    return lambda: kinetostatics(with_own(kind, lambda *_: value))


SCENARIOS = {
    **{
        f"an exception in a {kind}": lambda kind=kind: kinetostatics(with_own(kind, no_oil))
        for kind in KINDS
    },
    "a function that gives nothing": giving("driver", None),
    "a function that gives nan": giving("load", math.nan),
    "a function that gives text": giving("spring", "much"),
    "a load that gives nothing": giving("custom load", None),
    "a load that gives nan": giving("custom load", (math.nan,) * 6),
    "a load of two numbers": giving("custom load", (1.0, 2.0)),
    "a joint of two numbers": giving("custom joint", (1.0, 2.0)),
    "a load without physics": lambda: kinetostatics(
        four_bar(CustomLoad("own", "ground.O2", "rocker.B"))
    ),
    "a joint without physics": lambda: kinetostatics(own_joint()),
    "a function without an argument": lambda: kinematics(by_law(nothing)),
    "a number of one's own": lambda: Cable("own", "ground.O2", "rocker.B", 0.0),
    "another of one's own": lambda: assemble(
        four_bar(Cable("own", "ground.O2", "rocker.B", 2.0))
    ).with_values({"own.length": -1.0}),
    "a function that fails on the way": lambda: kinematics(by_law(LATE), t=[0.0, 0.25, 0.75]),
    "a function that fails in a turn": lambda: kinematics(by_law(LATE), turn=True),
    "a function that fails at once in a turn": lambda: kinematics(by_law(no_oil), turn=True),
}
