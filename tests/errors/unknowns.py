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
from mbody.model.study import Question, Unknown
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
    "a number that a load has not": ask("brake.size", "motor.effort = 0"),
    "a start in other units": ask(Unknown("brake", start="3 kg"), "motor.effort = 0"),
    "a unit of something else": ask({"brake": {"unit": "N"}}, "motor.effort = 0"),
    "bounds the wrong way round": ask(Unknown("brake", low=2.0, high=1.0), "motor.effort = 0"),
    "an inequality as a condition": ask("brake", "motor.effort <= 0"),
    "an equation as a side condition": ask("brake", "motor.effort = 0", side_conditions="A.fx = 0"),
    "half a condition": ask("brake", "motor.effort ="),
    "a condition of different things": ask("brake", "motor.effort = A.fx"),
    "a condition of what is not there": ask("brake", "engine.effort = 0"),
    "too few conditions": ask(["brake", "motor.rate"], "motor.effort = 0"),
    "nothing left to be greatest": ask(
        "brake", "motor.effort = 0", side_conditions=BOUNDED, greatest="A.fx"
    ),
    "nothing that bounds": ask(["brake", "motor.rate"], "motor.effort = 0", greatest="A.fx"),
    "too many side conditions": ask(
        ["brake", "motor.acceleration", "push"],
        machine=four_bar(Torque("brake", "rocker", value=1.0), Force("push", "coupler", 1.0)),
        side_conditions=[f"A.fx <= {n} N" for n in range(40)],
        greatest="A.fx",
    ),
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
    "a table of a question without unknowns": model("[solve.q]\nconditions = 'motor.effort = 0'"),
    "unknowns of a file that are a number": model("[solve.q]\nunknowns = 3"),
    "an unknown of a file that is not there": model(
        "[solve.q]\nunknowns = 'brake'\nconditions = 'motor.effort = 0'"
    ),
    "a condition of a file that is not there": model(
        "[solve.q]\nunknowns = 'motor.rate'\nconditions = 'brake.effort = 0'"
    ),
}
