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


def remembering():
    """Its analysis, whatever was asked before."""
    Remembers.asked[0] = 0.0
    return kinetostatics(four_bar(Remembers("own", "ground.O2", "rocker.B")))


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
HALF = Function(
    lambda t: math.sin(2 * t), lambda t: math.cos(2 * t), lambda t: -4 * math.sin(2 * t)
)
FAST = Function(
    lambda t: 0.3 * math.sin(1e6 * t),
    lambda t: 3e5 * math.cos(1e6 * t),
    lambda t: -3e11 * math.sin(1e6 * t),
)


def giving(kind, value):
    return lambda: kinetostatics(with_own(kind, lambda *_: value))


SCENARIOS = {
    **{
        f"an exception in a {kind}": lambda kind=kind: kinetostatics(with_own(kind, no_oil))
        for kind in KINDS
    },
    "a load that gives nothing": giving("custom load", None),
    "a load that gives nan": giving("custom load", (math.nan,) * 6),
    "a joint of two numbers": giving("custom joint", (1.0, 2.0)),
    "a load without physics": lambda: kinetostatics(
        four_bar(CustomLoad("own", "ground.O2", "rocker.B"))
    ),
    "a joint without physics": lambda: kinetostatics(own_joint()),
    "another of one's own": lambda: assemble(
        four_bar(Cable("own", "ground.O2", "rocker.B", 2.0))
    ).with_values({"own.length": -1.0}),
    "a plain field that is to be changed": lambda: assemble(
        four_bar(Plain("own", "ground.O2", "rocker.B"))
    ).with_values({"own.k": 2.0}),
    "a plain field that is to be found": lambda: solve_for(
        four_bar(Plain("own", "ground.O2", "rocker.B")), "own.k", "motor.effort = 0"
    ),
    "a load that remembers": remembering,
    "a joint of wrong rates": loose(LooseRates),
    "a joint of wrong times": loose(LooseTimes),
    "a joint of wrong changes": loose(LooseChange),
    "a function that fails on the way": lambda: kinematics(by_law(LATE), t=[0.0, 0.25, 0.75]),
    "a function that fails in a turn": lambda: kinematics(by_law(LATE), turn=True),
    "a law of a wrong rate": lambda: kinematics(by_law(HALF), t=[0.1, 0.7]),
    "a law too fast to be followed": lambda: kinematics(by_law(FAST), t=[0.1, 0.7]),
    "a function that fails at once in a turn": lambda: kinematics(by_law(no_oil), turn=True),
}

SENTENCES = r"""
an exception in a driver | SolveError | motor | the function of 'motor' failed: ValueError: no oil
an exception in a load | SolveError | own | the function of 'own' failed: ValueError: no oil
an exception in a spring | SolveError | own | the function of 'own' failed: ValueError: no oil
an exception in a custom load | SolveError | own | the function of 'own' failed: ValueError: no oil
an exception in a custom joint | SolveError | own | the function of 'own' failed: ValueError: no oil
a load that gives nothing | SolveError | own | the function of 'own' failed: ValueError: physics returned nothing
a load that gives nan | SolveError | own | the function of 'own' failed: ValueError: physics gave a number that is not finite at t = 0
a joint of two numbers | SolveError | own | the function of 'own' failed: ValueError: physics gave 2 numbers, 18 are wanted
a load without physics | SolveError | own | the function of 'own' failed: NotImplementedError: CustomLoad needs a method physics(i, j, p, t)
a joint without physics | SolveError | own | the function of 'own' failed: NotImplementedError: CustomJoint needs a method physics(i, j, p, t)
another of one's own | ModelError | own.length | 'own.length' is -1 m, it must be positive: give more than 0
a plain field that is to be changed | ModelError | own.k | 'own.k' cannot be changed: Plain has it as a plain number; declare it as k: float = mbody.number_field("force", 3.0), with what it measures instead of "force"
a plain field that is to be found | ModelError | own.k | 'own.k' cannot be changed: Plain has it as a plain number; declare it as k: float = mbody.number_field("force", 3.0), with what it measures instead of "force"
a load that remembers | ModelError | own | the function of 'own' keeps a memory: called twice with the same arguments at t = 0 it returned 1 and then 4; it is called several times an instant, and at times that go back: its result must depend on its arguments alone; for a memory use a State, for a sampled controller a Controller
a joint of wrong rates | ModelError | own | the physics of 'own' gives Φ_q of row 0 as 0.0159218, but ∂Φ/∂θ of 'bob' is -0.0159218 by differences: correct it; mbody.testing.check_joint tries it further
a joint of wrong times | ModelError | own | the physics of 'own' gives ν of row 0 as 1, but −∂Φ/∂t is 0 by differences: correct it; mbody.testing.check_joint tries it further
a joint of wrong changes | ModelError | own | the physics of 'own' gives γ of row 0 as 0.61454, but Φ_q a − d²Φ/dt² is -0.61454 by differences: correct it; mbody.testing.check_joint tries it further
a function that fails on the way | SolveError | motor | the function of 'motor' failed: ValueError: no oil
a function that fails in a turn | SolveError | motor | the function of 'motor' failed: ValueError: no oil
a law of a wrong rate | SolveError | motor | 'motor': the rate that is given with the function of its law is no derivative of it: 0.980067 rad/s at t = 0.1 s, by differences of the function 1.96013 rad/s: correct rate, or leave it out
a law too fast to be followed | SolveError | motor | the function of 'motor' failed: 202001 calls did not lead the motion beyond x = …: the function varies too fast to be followed; give a smoother one
a function that fails at once in a turn | SolveError | motor | the function of 'motor' failed: ValueError: no oil
"""
