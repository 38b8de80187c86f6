"""Stops, limits of joints, and joints that separate."""

import mbody
from mbody.laws import Table2
from tests.errors.simulating import file, swing


def stopped(of):
    return lambda: mbody.simulate(swing(mbody.Stop("floor", of)), 1.0)


def stopped_by_table():
    table = Table2([0.0, 4.0], [0.0, 4.0], [[1.0, 1.0], [1.0, 1.0]])
    machine = mbody.Mechanism("tabled", curves={"wall": table})
    machine.add(mbody.Body("bob", mass=1.0), mbody.Stop("floor", "wall(bob.x, bob.y)"))
    mbody.simulate(machine, 1.0)


def led(*more):
    """A block that a driver leads into a stop."""
    machine = mbody.Mechanism("led")
    machine.add(
        mbody.Body("block", mass=1.0),
        mbody.Prismatic("guide", "ground", "block"),
        mbody.CoordinateDriver("motor", "ground", "block", "1 m - 2 m/s*t"),
        *more,
    )
    return machine


def limited(angle=0.0, other=""):
    """A pendulum whose pin has limits."""
    machine = mbody.Mechanism("limited")
    machine.add(
        mbody.Body("bob", mass=1.0, inertia=0.1, cg=(0.5, 0.0)),
        mbody.Revolute("A", "ground", "bob", limits=("-60 deg", 1.0)),
        mbody.Gravity("gravity", y=-9.81),
    )
    if other:
        machine.add(mbody.Body(other, mass=1.0))
    machine.simulation = mbody.SimulationSettings(1.0, {"bob": {"angle": angle}})
    return machine


SCENARIOS = {
    "a stop with a restitution in metres": lambda: swing(mbody.Stop("floor", "bob.angle", "3 m")),
    "a stop of no text": lambda: mbody.Stop("floor", 3.0),
    "a stop that cannot be read": lambda: mbody.Stop("floor", "bob.angle +"),
    "a stop of an area": stopped("bob.x^2 - 4 m^2"),
    "a stop of what is not there": stopped("rod.angle"),
    "a stop of a number and an angle": stopped("bob.angle + 3 m"),
    "a stop by a table of two variables": stopped_by_table,
    "a stop of time alone": stopped("1 s - t"),
    "a start beyond a stop": stopped("bob.angle - 1 rad"),
    "a stop of what a driver leads": lambda: mbody.simulate(
        led(mbody.Stop("wall", "block.x", 0.5)), 1.0
    ),
    "the reaction of a stop": lambda: mbody.simulate(
        swing(mbody.Stop("floor", "bob.angle + 9 rad")), 0.1
    ).reaction("floor"),
    "limits that are no pair": lambda: mbody.Revolute("A", "ground", "bob", limits=2.0),
    "limits without an end": lambda: mbody.Revolute("A", "ground", "bob", limits=(None, None)),
    "limits in the wrong order": lambda: mbody.Revolute("A", "ground", "bob", limits=(1.0, -1.0)),
    "limits in metres": lambda: mbody.Revolute("A", "ground", "bob", limits=("1 m", "2 m")),
    "a restitution of limits that gains energy": lambda: mbody.Revolute(
        "A", "ground", "bob", limits=(0.0, 1.0), restitution=1.5
    ),
    "a restitution of what nothing strikes": lambda: mbody.Revolute(
        "A", "ground", "bob", restitution=0.5
    ),
    "a start beyond a limit": lambda: mbody.simulate(limited(-1.5), 1.0),
    "a freewheel of no direction": lambda: mbody.Freewheel(
        "hub", "ground", "bob", clockwise="left"
    ),
    "a bar that neither pushes nor pulls": lambda: mbody.Distance(
        "bar", "ground.O", "bob.P", length=1.0, one_sided="both"
    ),
    "a wheel that may lift off without friction": lambda: mbody.Rolling(
        "road", "ground", "wheel", radius=0.3, one_sided=True
    ),
    "backlash beside losses": lambda: mbody.Gear(
        "mesh", "sun", "planet", radius_i=1.0, radius_j=2.0, backlash=0.1, efficiency=0.9
    ),
    "a body by the name of a limit": lambda: mbody.simulate(limited(0.0, "A_low"), 1.0),
    "limits by steps with impulses": lambda: mbody.simulate(
        limited(), 1.0, method="moreau", step=0.01
    ),
    "limits by steps of one length": lambda: mbody.simulate(
        limited(), 1.0, method="rattle4", step=0.01
    ),
    "a stop of a file": file("[contacts]\nfloor = { stop = 'bob.vx', restitution = 0.5 }\n"),
}

SENTENCES = r"""
a stop with a restitution in metres | ModelError | floor | 'floor': restitution: '3 m' is a length (m), where a plain number is wanted
a stop of no text | ModelError | floor | stop 'floor': of must be text such as "ball.y - 20 mm", not 3.0
a stop that cannot be read | ModelError | floor | stop 'floor': 'bob.angle +' ends where a number is expected
a stop of an area | ModelError | floor | stop 'floor': 'bob.x^2 - 4 m^2' is an area (m²): give a length or an angle, as the square root of an area
a stop of what is not there | ModelError | floor | stop 'floor': there is no 'rod' to measure 'rod.angle' of (there are: 'ground', 'bob', 'O', 'gravity', 'floor'): add it before, or correct the name
a stop of a number and an angle | ModelError | floor | stop 'floor': it adds an angle (rad) and a length (m)
a stop by a table of two variables | ModelError | floor | stop 'floor': 'wall(bob.x, bob.y)' has no second derivative by its table of two variables: use smooth functions, or Tables of one variable
a stop of time alone | ModelError | floor | stop 'floor': '1 s - t' has no coordinate: name x, y or angle of a body or a point
a start beyond a stop | ModelError | floor | the motion begins beyond the stop 'floor': 'bob.angle - 1 rad' is -0.8 rad; begin where it is not negative
a stop of what a driver leads | SolveError | wall | nothing that strikes 'wall' is free to rebound: it follows drivers alone; take them off, or record when it is reached by an Event
the reaction of a stop | ModelError | floor | 'floor' is a stop of all bodies that it measures, it has no reaction between two: ask for its contact
limits that are no pair | ModelError | A | 'A': limits must be a pair (low, high), None for none, not 2.0
limits without an end | ModelError | A | 'A': limits has neither end: give one, or leave it out
limits in the wrong order | ModelError | A | 'A': limits are 1 and -1 rad: give the lesser first, and two that differ
limits in metres | ModelError | A | 'A': limits.low: '1 m' is a length (m), where an angle (rad) is wanted
a restitution of limits that gains energy | ModelError | A | 'A': restitution is 1.5, which would gain energy: give 0 to 1
a restitution of what nothing strikes | ModelError | A | 'A': restitution is 0.5, but nothing strikes in it: give limits or clearance too, or leave it out
a start beyond a limit | ModelError | A | joint 'A' begins at -85.9437 deg, beyond its limit of -60 deg ('A.limits.low'): begin within, or change the limit
a freewheel of no direction | ModelError | hub | 'hub': clockwise must be True or False, not 'left'
a bar that neither pushes nor pulls | ModelError | bar | 'bar': one_sided is 'both': give "push" for a strut, "pull" for what does not push
a wheel that may lift off without friction | ModelError | road | 'road': friction and one_sided go together: a wheel that may lift off rolls as far as its friction lets it, one that may not never slips; give both, or neither
backlash beside losses | ModelError | mesh | 'mesh': efficiency goes with a joint that always holds, not with backlash: leave out one of them
a body by the name of a limit | ModelError | A_low | the name 'A_low' is that of a limit of 'A': rename the Body of that name
limits by steps with impulses | ModelError | A | the method 'moreau' has contacts of shapes and ropes, no stops, limits and joints that separate ('A'): take dop853
limits by steps of one length | ModelError | A | 'A' of 'limited' may open, stick or slide, which the method 'rattle4' does not decide: follow the motion by simulate with dop853, dopri5 or radau5, or leave out contacts and friction
a stop of a file | ModelError | floor | model: line 6: contacts.floor: 'bob.vx' is no coordinate: take x, y and angle of bodies and points
"""
