"""Results: what is asked of them, and where they are written to."""

import functools
import math
import sys
from unittest import mock

from mbody import (
    Body,
    CouplingTerm,
    Fixed,
    Gravity,
    LengthCoupling,
    Marker,
    Mechanism,
    Revolute,
    Spring,
    assemble,
    free_body,
    kinematics,
    kinetostatics,
    member_forces,
    statics,
)
from tests.errors.models import four_bar


@functools.cache
def run():
    return kinetostatics(four_bar())


@functools.cache
def motion():
    return kinematics(four_bar())


@functools.cache
def batch():
    system = assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]})
    return kinetostatics(system)


def belt():
    """A crank that a second wheel turns by a belt."""
    machine = four_bar(Body("wheel"), Revolute("W", "ground", "wheel"))
    terms = [CouplingTerm(0.2, angle="crank"), CouplingTerm(-0.1, angle="wheel")]
    machine.add(LengthCoupling("belt", terms))
    return kinetostatics(machine)


def welded(count):
    machine = Mechanism("welded")
    machine.add(*(Body(f"b{n}") for n in range(count)))
    machine.add(*(Fixed(f"w{n}", "ground", f"b{n}") for n in range(count)))
    return machine


def without_pandas():
    with mock.patch.dict(sys.modules, pandas=None):
        run().to_dataframe()


SCENARIOS = {
    "a body that is not there": lambda: run()["rod"],
    "a body that is a list": lambda: run()[["crank"]],
    "a joint that is not there": lambda: run().reaction("C"),
    "a joint that is a driver": lambda: run().reaction("motor"),
    "the wrong side of a joint": lambda: run().reaction("A", on="rocker"),
    "no side of a joint": lambda: run().reaction("A", on=2),
    "the reaction of a coupling": lambda: belt().reaction("belt"),
    "a pin that presses": lambda: run().contact("A"),
    "a driver that is not there": lambda: run().effort("engine"),
    "a driver that is a list": lambda: run().effort(["motor"]),
    "the motion of a driver that is not there": lambda: run().driven("motors"),
    "a point that is not there": lambda: run().point("coupler.P"),
    "a point of a body that is not there": lambda: run().point("bar.P"),
    "a point at nan": lambda: run().point(Marker("coupler", (math.nan, 0.0))),
    "inertia of a body that is not there": lambda: run().inertia("link"),
    "causes of a body": lambda: run().breakdown("crank"),
    "causes of a list": lambda: run().breakdown(["A"]),
    "forces of kinematics": lambda: motion().reaction("A"),
    "efforts of kinematics": lambda: motion().effort("motor"),
    "causes of kinematics": lambda: motion().breakdown("A"),
    "equations of kinematics": lambda: motion().equations(),
    "an instant that is not there": lambda: run().equations(3),
    "half an instant": lambda: run().equations(0.5),
    "equations of very many links": lambda: statics(welded(501)).equations(),
    "causes of a batch": lambda: batch().breakdown("A"),
    "equations of a batch": lambda: batch().equations(),
    "columns of a batch": lambda: batch().columns(),
    "data of a batch": lambda: batch().data(),
    "some instants of a batch": lambda: batch().take([0]),
    "a free body of kinematics": lambda: free_body(motion(), "crank"),
    "free bodies of a mechanism": lambda: member_forces(four_bar()),  # type: ignore[arg-type]
    "free bodies of a batch": lambda: member_forces(batch()),
    "a free body that is not there": lambda: free_body(run(), "rod"),
    "free bodies at an instant that is not there": lambda: member_forces(run(), 3),
    "a load that is not there": lambda: run().load("spring"),
    "a load on another body": lambda: kinetostatics(
        four_bar(Spring("spring", "ground.O2", "rocker.B", stiffness=1.0))
    ).load("spring", on="crank"),
    "gravity on no body": lambda: kinetostatics(four_bar(Gravity("weight", y=-9.81))).load(
        "weight"
    ),
    "where a driver of an angle acts": lambda: run().reaction_point("motor"),
    "a frame without pandas": without_pandas,
    "a folder that is not there": lambda: run().to_csv("/nowhere/run.csv"),
    "a folder for a file": lambda: run().to_csv("/"),
    "no path": lambda: run().to_csv(3),
}
