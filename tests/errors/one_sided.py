"""Stops, limits of joints, and joints that separate."""

from mbody import (
    Body,
    CoordinateDriver,
    Distance,
    Freewheel,
    Gear,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    Rolling,
    SimulationSettings,
    Stop,
    assemble,
    simulate,
)
from mbody.laws import Table2
from tests.errors.simulating import file, swing


def stopped(of):
    return lambda: simulate(swing(Stop("floor", of)), 1.0)


def stopped_by_table():
    table = Table2([0.0, 4.0], [0.0, 4.0], [[1.0, 1.0], [1.0, 1.0]])
    machine = Mechanism("tabled", curves={"wall": table})
    machine.add(Body("bob", mass=1.0), Stop("floor", "wall(bob.x, bob.y)"))
    simulate(machine, 1.0)


def led(*more):
    """A block that a driver leads into a stop."""
    machine = Mechanism("led")
    machine.add(
        Body("block", mass=1.0),
        Prismatic("guide", "ground", "block"),
        CoordinateDriver("motor", "ground", "block", "1 m - 2 m/s*t"),
        *more,
    )
    return machine


def limited(angle=0.0, other=""):
    """A pendulum whose pin has limits."""
    machine = Mechanism("limited")
    machine.add(
        Body("bob", mass=1.0, inertia=0.1, cg=(0.5, 0.0)),
        Revolute("A", "ground", "bob", limits=("-60 deg", 1.0)),
        Gravity("gravity", y=-9.81),
    )
    if other:
        machine.add(Body(other, mass=1.0))
    machine.simulation = SimulationSettings(1.0, {"bob": {"angle": angle}})
    return machine


SCENARIOS = {
    "a stop with a restitution in metres": lambda: swing(Stop("floor", "bob.angle", "3 m")),
    "a stop with a restitution of no number": lambda: Stop("floor", "bob.angle", "0.5 +"),
    "a stop that gives energy": lambda: Stop("floor", "bob.angle", 1.5),
    "a stop that gives energy by a formula": lambda: swing(Stop("floor", "bob.angle", "1 + 1")),
    "a stop of no text": lambda: Stop("floor", 3.0),
    "a stop that cannot be read": lambda: Stop("floor", "bob.angle +"),
    "a stop of an area": stopped("bob.x^2 - 4 m^2"),
    "a stop of what is not there": stopped("rod.angle"),
    "a stop of a number and an angle": stopped("bob.angle + 3 m"),
    "a stop by a table of two variables": stopped_by_table,
    "a stop of another design that gives energy": lambda: simulate(
        assemble(swing(Stop("floor", "bob.angle"))).with_values({"floor.restitution": 2.0}), 1.0
    ),
    "a stop of a velocity": stopped("bob.omega"),
    "a stop of time alone": stopped("1 s - t"),
    "a start beyond a stop": stopped("bob.angle - 1 rad"),
    "a stop of what a driver leads": lambda: simulate(led(Stop("wall", "block.x", 0.5)), 1.0),
    "the reaction of a stop": lambda: simulate(
        swing(Stop("floor", "bob.angle + 9 rad")), 0.1
    ).reaction("floor"),
    "limits that are no pair": lambda: Revolute("A", "ground", "bob", limits=2.0),
    "limits without an end": lambda: Revolute("A", "ground", "bob", limits=(None, None)),
    "limits in the wrong order": lambda: Revolute("A", "ground", "bob", limits=(1.0, -1.0)),
    "limits in metres": lambda: Revolute("A", "ground", "bob", limits=("1 m", "2 m")),
    "limits of a design in the wrong order": lambda: assemble(limited()).with_values(
        {"A.limits.low": 2.0}
    ),
    "a restitution of limits that gains energy": lambda: Revolute(
        "A", "ground", "bob", limits=(0.0, 1.0), restitution=1.5
    ),
    "a restitution of what nothing strikes": lambda: Revolute(
        "A", "ground", "bob", restitution=0.5
    ),
    "a start beyond a limit": lambda: simulate(limited(-1.5), 1.0),
    "a freewheel of no sense": lambda: Freewheel("hub", "ground", "bob", clockwise="left"),
    "a bar that neither pushes nor pulls": lambda: Distance(
        "bar", "ground.O", "bob.P", length=1.0, one_sided="both"
    ),
    "a wheel that may lift off without friction": lambda: Rolling(
        "road", "ground", "wheel", radius=0.3, one_sided=True
    ),
    "a wheel that may lift off with a resistance": lambda: Rolling(
        "road", "ground", "wheel", radius=0.3, one_sided=True, friction=0.8, resistance=0.01
    ),
    "backlash beside losses": lambda: Gear(
        "mesh", "sun", "planet", radius_i=1.0, radius_j=2.0, backlash=0.1, efficiency=0.9
    ),
    "a body by the name of a limit": lambda: simulate(limited(0.0, "A_low"), 1.0),
    "limits by steps with impulses": lambda: simulate(limited(), 1.0, method="moreau", step=0.01),
    "limits by steps of one length": lambda: simulate(limited(), 1.0, method="rattle4", step=0.01),
    "limits of a file that are no pair": file(
        "[joints.A]\nrevolute = ['ground', 'bob']\nlimits = 3\n"
    ),
    "a stop of a file": file("[contacts]\nfloor = { stop = 'bob.vx', restitution = 0.5 }\n"),
}
