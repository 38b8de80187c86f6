"""Functions, joints and loads of the user's own."""

import math
from dataclasses import dataclass
from typing import ClassVar

from mbody import Body, Mechanism, assemble, kinematics, kinetostatics, simulate, solve_for
from mbody.laws import Function
from mbody.model.element import number_field
from mbody.model.joints import CustomJoint
from mbody.model.loads import CustomLoad
from tests.errors.models import by_law, four_bar, no_oil, with_own

#: Where a user's function may be.
KINDS = ["driver", "load", "spring", "custom load", "custom joint"]


@dataclass(frozen=True)
class Cable(CustomLoad):
    length: float = number_field("length", 1.0, sign="positive")


@dataclass(frozen=True)
class Plain(CustomLoad):
    k: float = 3.0


class Remembers(CustomLoad):
    """A load that answers from earlier calls."""

    asked: ClassVar = [0.0]

    def physics(self, i, j, p, t):
        self.asked[0] += 1.0
        return 0.0, 0.0, 0.0, 0.0, 0.0, self.asked[0]


class Loose(CustomJoint):
    """A pin by the mass centre of j whose γ or Φ_q or ν is wrong."""

    rows = "ll"
    wrong = ""

    def physics(self, i, j, p, t):
        x, y = j[3] * p[2] - j[4] * p[3], j[4] * p[2] + j[3] * p[3]
        w = -(j[7] ** 2) if self.wrong == "γ" else j[7] ** 2
        blocks = (-1, 0, 0, 0, -1, 0, 1, 0, y if self.wrong == "Φ_q" else -y, 0, 1, x)
        nu = 1.0 if self.wrong == "ν" else 0.0
        return (j[0] + x - i[0], j[1] + y - i[1]), blocks, (nu, 0), (w * x, w * y)


class LooseRates(Loose):
    wrong = "Φ_q"


class LooseTimes(Loose):
    wrong = "ν"


class LooseChange(Loose):
    wrong = "γ"


def loose(kind):
    machine = Mechanism("loose")
    machine.add(Body("bob", mass=1.0, inertia=0.2, cg=(1.0, 0.0)), kind("own", "ground", "bob"))
    return lambda: simulate(machine, 1.0)


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
    "a plain field that is to be changed": lambda: assemble(
        four_bar(Plain("own", "ground.O2", "rocker.B"))
    ).with_values({"own.k": 2.0}),
    "a plain field that is to be found": lambda: solve_for(
        four_bar(Plain("own", "ground.O2", "rocker.B")), "own.k", "motor.effort = 0"
    ),
    "a load that remembers": lambda: kinetostatics(
        four_bar(Remembers("own", "ground.O2", "rocker.B"))
    ),
    "a joint of wrong rates": loose(LooseRates),
    "a joint of wrong times": loose(LooseTimes),
    "a joint of wrong changes": loose(LooseChange),
    "a function that fails on the way": lambda: kinematics(by_law(LATE), t=[0.0, 0.25, 0.75]),
    "a function that fails in a turn": lambda: kinematics(by_law(LATE), turn=True),
    "a function that fails at once in a turn": lambda: kinematics(by_law(no_oil), turn=True),
}
