"""Unknowns and the conditions that they are to meet."""

from unittest import mock

from mbody import (
    AngleDriver,
    Body,
    Force,
    Mechanism,
    Revolute,
    Torque,
    from_toml,
    makers,
    solve_for,
)
from mbody.model.simulation import Question, Unknown
from tests.errors.command import said
from tests.errors.models import four_bar

#: What no question is.
QUESTIONS = {
    "an unknown that is no text": lambda: Unknown(3),
    "an unknown without a name": lambda: Unknown(""),
    "a start that is no number": lambda: Unknown("brake", start=[1]),
    "a unit that is none": lambda: Unknown("brake", unit="2 +"),
    "no unknown": lambda: Question([]),
    "an unknown twice": lambda: Question(["brake", "brake"]),
    "unknowns that are a number": lambda: Question(3),
    "an option that is none": lambda: Question({"brake": {"begin": 3.0}}),
    "a condition that is no text": lambda: Question("brake", [3]),
    "greatest that is no text": lambda: Question("brake", greatest=3),
    "greatest and least": lambda: Question("brake", greatest="A.fx", least="A.fx"),
    "an analysis that is none": lambda: Question("brake", analysis="dynamics"),
    "several instants": lambda: Question("brake", at={"t": [0.0, 1.0]}),
}


def braked(**more):
    return four_bar(Torque("brake", "rocker", value=1.0), **more)


def ask(*args, machine=None, **more):
    return lambda: solve_for(machine or braked(), *args, **more)


def hopeless():
    """No value of the unknowns makes it later; two starts show that as well as a dozen."""
    few = mock.patch.multiple("mbody.inverse.extremum", STARTS=1, SAMPLES=2)
    with few:
        solve_for(braked(), ["motor.rate", "brake"], side_conditions="t >= 1 s", least="A.force")


def arm():
    """Two links with a motor each."""
    machine = Mechanism("arm")
    machine.add(
        *(Body("one", mass=1.0, cg=(0.5, 0.0), points={"A": (1.0, 0.0)}), Body("two", mass=1.0)),
        Revolute("O", "ground", "one"),
        Revolute("A", "one.A", "two"),
        AngleDriver("shoulder", "one", 0.3),
        AngleDriver("elbow", "two", 0.4),
        Force("push", "two", 1.0),
    )
    return machine


def model(text):
    return lambda: from_toml(
        '[bodies]\narm = { mass = 1 }\n[joints]\nO = { revolute = ["ground", "arm"] }\n'
        '[drivers]\nmotor = { angle = "arm", law = 0 }\n' + text
    )


BOUNDED = "abs(A.fx) <= 3 N"

SCENARIOS = {
    **QUESTIONS,
    "no mechanism": lambda: solve_for("four-bar", "brake", "motor.effort = 0"),
    "a number that is not there": ask("push", "motor.effort = 0"),
    "a start in other units": ask(Unknown("brake", start="3 kg"), "motor.effort = 0"),
    "a unit of something else": ask({"brake": {"unit": "N"}}, "motor.effort = 0"),
    "bounds the wrong way round": ask(Unknown("brake", low=2.0, high=1.0), "motor.effort = 0"),
    "an equation as a side condition": ask("brake", "motor.effort = 0", side_conditions="A.fx = 0"),
    "half a condition": ask("brake", "motor.effort ="),
    "a condition of different things": ask("brake", "motor.effort = A.fx"),
    "too few conditions": ask(["brake", "motor.rate"], "motor.effort = 0"),
    "nothing left to be greatest": ask(
        "brake", "motor.effort = 0", side_conditions=BOUNDED, greatest="A.fx"
    ),
    "nothing that bounds": ask(["brake", "motor.rate"], "motor.effort = 0", greatest="A.fx"),
    "no bound on that side": ask(
        ["brake"], side_conditions="motor.effort >= 0", greatest="motor.effort"
    ),
    "a greatest value at a dead centre": ask(
        {"motor.value": {"low": -0.5, "high": 3.0}},
        machine=makers.four_bar(2, 3, 1.5, 3.5, masses=(1, 1, 1), speed=5.0, start=0.5),
        greatest="motor.effort",
    ),
    "a greatest value that nothing bounds": ask(
        {"motor.rate": {"low": 1.0}}, least="-abs(motor.effort)", side_conditions="t >= 0 s"
    ),
    "one unknown that side conditions do not let be": ask(
        "motor.value", side_conditions="rocker.angle >= 300 deg", least="A.force"
    ),
    "an unknown that never can be analysed": ask(
        {"coupler.B.x": {"low": "50 m", "high": "60 m"}}, least="A.force"
    ),
    "several unknowns that nothing bounds": ask(
        ["motor.rate", "brake"], side_conditions="t >= 0 s", greatest="motor.effort"
    ),
    "several unknowns that side conditions do not let be": hopeless,
    "a solution beyond its bounds": ask(
        {"brake": {"low": "1e6 N*m", "high": "2e6 N*m"}}, "motor.effort = 0"
    ),
    "side conditions that exclude each other": ask(
        "brake", side_conditions=["A.fx >= 9 N", "A.fx <= -9 N"], greatest="A.fx"
    ),
    "a side condition that is broken": ask(
        "brake", "motor.effort = 0", side_conditions="motor.effort >= 5 N*m"
    ),
    "a mass below nothing": ask("crank.mass", "O2.fx = -1e5 N"),
    "an unknown that changes nothing": ask("brake", "crank.angle = 20 deg"),
    "conditions that hold always": ask("brake", "crank.x = crank.x"),
    "a place out of reach": ask("elbow.value", "two.x = 5 m", machine=arm()),
    "a place at which loops do not close": ask("motor.value", "rocker.y = 50 m"),
    "a model that asks nothing": said(["solve", "norton_fourbar"]),
    "a question that a model does not ask": said(["solve", "vehicle", "front_wheel"]),
    "an unknown of a file that is not there": model(
        "[solve.q]\nunknowns = 'brake'\nconditions = 'motor.effort = 0'"
    ),
}

SENTENCES = r"""
an unknown that is no text | ModelError | - | unknown: name must be text, not 3
an unknown without a name | ModelError | - | unknown: name is empty: name a number of the mechanism
a start that is no number | ModelError | brake | unknown 'brake': start: [1] is not a number
a unit that is none | ModelError | brake | unknown 'brake': '1 2 +' is not a formula: an operator is missing before '2'
no unknown | ModelError | - | question: there is no unknown: name what is to be found
an unknown twice | ModelError | - | question: brake, brake: name each unknown once
unknowns that are a number | ModelError | - | question: 3 is neither text nor a list of texts
an option that is none | ModelError | brake | unknown 'brake' has no 'begin' (it has: start, low, high, unit)
a condition that is no text | ModelError | - | question: conditions must be texts, not 3
greatest that is no text | ModelError | - | question: greatest must be text, not 3
greatest and least | ModelError | - | question: give greatest or least, not both
an analysis that is none | ModelError | - | question: analysis must be 'kinetostatics' or 'statics', not 'dynamics'
several instants | ModelError | - | question: at has several values: a question is of one instant
no mechanism | ModelError | - | solve_for takes a Mechanism, not 'four-bar'
a number that is not there | ModelError | push | there is no number 'push' to find (there are: 'motor.acceleration', 'brake', and those of bodies and the ground)
a start in other units | ModelError | brake | solve_for: 'brake': '3 kg' is a mass (kg), where a torque (N·m) is wanted
a unit of something else | ModelError | brake | unknown 'brake': cannot convert: 'N·m' is a torque (N·m), 'N' is a force (N)
bounds the wrong way round | ModelError | brake | solve_for: 'brake' goes from 2 to 1 N·m: give low, then high
an equation as a side condition | ModelError | - | 'A.fx = 0' is not an inequality such as 'road.fy >= 0'
half a condition | ModelError | - | 'motor.effort =' is not an equation such as 'motor.effort = 0': a side of it is empty
a condition of different things | ModelError | - | 'motor.effort = A.fx': 'motor.effort' is a torque (N·m), 'A.fx' is a force (N): give every number its unit
too few conditions | ModelError | - | 2 unknowns want as many conditions, there is 1: add or leave out some, or say what is to be greatest
nothing left to be greatest | ModelError | - | 1 unknowns and 1 conditions leave nothing to be greatest or least: leave out conditions, or ask without
nothing that bounds | ModelError | - | nothing bounds 'A.fx': give side conditions, or bounds of the unknowns
no bound on that side | SolveError | - | 'motor.effort' has no greatest value: the side conditions do not bound it; add one that does
a greatest value at a dead centre | SolveError | - | 'motor.effort' has no greatest value: it grows without bound where 'motor.value' reaches 106.602 deg, beyond which the mechanism cannot be analysed; add a side condition or a bound that keeps away from there
a greatest value that nothing bounds | SolveError | - | '-abs(motor.effort)' has no least value as far as was searched: it still falls at 'motor.rate' = 1e+06 rad/s; add a side condition or a bound
one unknown that side conditions do not let be | SolveError | - | no value of 'motor.value' from -1380 deg to 1500 deg meets all side conditions: the nearest breaks 'rocker.angle >= 300 deg' by 149 deg at motor.value = 204.979 deg; loosen it, or the bounds
an unknown that never can be analysed | SolveError | - | no value of 'coupler.B.x' was found that can be analysed and meets the conditions; the last trial said: loops do not close at t = 0 s: the smallest gap is 54.76 m at 'B' (between 'coupler' and 'rocker'): check lengths, or give a better guess
several unknowns that nothing bounds | SolveError | - | 'motor.effort' has no greatest value: the side conditions do not bound it; add one that does
several unknowns that side conditions do not let be | SolveError | - | nothing meets all conditions and side conditions together: where the others hold 't >= 1 s' is broken by 1 s at motor.rate = 1 rad/s, brake = 1 N·m; loosen one of them, or the bounds
a solution beyond its bounds | SolveError | - | 'motor.effort = 0' holds at 'brake' = 4.49573 N·m alone, beyond its bounds 1e+06 to 2e+06 N·m: widen them
side conditions that exclude each other | SolveError | - | nothing meets all conditions and side conditions together: where the others hold 'A.fx >= 9 N' is broken; loosen one of them, or the bounds
a side condition that is broken | SolveError | - | 'motor.effort >= 5 N*m' does not hold where the conditions do, at brake = 4.49573 N·m: it is short by 5 N·m; that limit is reached first: ask for what is greatest within the side conditions
a mass below nothing | SolveError | - | no value of 'crank.mass' was found that meets 'O2.fx = -1e5 N' ('O2.fx = -1e5 N' is off by 1e+05 at the start): give another start, or wider bounds; the last trial said: 'crank.mass' is -0.14678 kg, it must not be negative: give 0 or more
an unknown that changes nothing | SolveError | - | nothing meets 'crank.angle = 20 deg': no value of 'brake' changes that; take unknowns that they depend on
conditions that hold always | SolveError | - | 'crank.x = crank.x' holds for any 'brake': nothing determines it; take unknowns that they depend on
a place out of reach | SolveError | - | no value of 'elbow.value' was found that meets 'two.x = 5 m' ('two.x = 5 m' is off by 4.045 at the start): give another start, or wider bounds
a place at which loops do not close | SolveError | - | no value of 'motor.value' was found that meets 'rocker.y = 50 m' ('rocker.y = 50 m' is off by 49.01 at the start): give another start, or wider bounds
a model that asks nothing | ModelError | - | 'Four-bar: dynamic force analysis' has no questions: give --unknowns and --conditions, or its file a table [solve.NAME] with unknowns and conditions
a question that a model does not ask | ModelError | front_wheel | 'Vehicle: limiting traction and braking' has no question 'front_wheel' (it has: 'front_drive', 'rear_drive', 'all_drive', 'front_brake', 'rear_brake', 'all_brake')
an unknown of a file that is not there | ModelError | - | model: line 7: solve.q: there is no number 'brake' to find (there are: 'motor.acceleration', and those of bodies and the ground)
"""
