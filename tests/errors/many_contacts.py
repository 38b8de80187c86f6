"""Motions by steps with impulses: what does not fit, shapes that cannot be, overlap."""

from dataclasses import replace

import numpy as np

import mbody

CORNERS = {"A": (0.0, 0.0), "B": (1.0, 0.0), "C": (0.2, 0.2), "D": (0.0, 1.0)}


def floored(*more, **body):
    shapes = {"floor": {"line": {"point": "O"}}}
    machine = mbody.Mechanism("blocks", ground={"O": (0.0, 0.0)}, ground_shapes=shapes)
    own = {"mass": 1.0, "inertia": 0.1, "points": {"C": (0.0, 0.0)}, "guess": (0.0, 1.0, 0.0)}
    machine.add(mbody.Body("block", **(own | body)), mbody.Gravity("gravity", y=-9.81), *more)
    return machine


UNDER = mbody.Contact("under", "ground.floor", "block.C")
GROUP = mbody.Between("group", "ground.floor", "block.C")


def stepped(*more, until=0.1, options=None, **body):
    machine = floored(*(more or (UNDER,)), **body)
    return lambda: mbody.simulate(
        machine, until, method="moreau", **({"step": 1e-2} | (options or {}))
    )


def of_other_sizes():
    """A motion that goes on from a state of another size."""
    machine = floored(UNDER)
    run = mbody.simulate(machine, 0.1, method="moreau", step=1e-2)
    contacts, pull, *rest = run.restart.own
    restart = replace(run.restart, own=(contacts, np.append(pull, 0.0), *rest))
    mbody.simulate(machine, 0.2, start=replace(run, restart=restart), method="moreau", step=1e-2)


def released():
    machine = mbody.Mechanism("crank")
    machine.add(mbody.Body("crank", mass=1.0, inertia=0.1), mbody.Revolute("O", "ground", "crank"))
    machine.add(mbody.AngleDriver("motor", "crank", 1.0))
    mbody.simulate(machine, 0.1, method="moreau", step=1e-2, release={"motor": 0.05})


def led():
    mbody.Simulator(floored(), method="moreau", step=1e-2)


def rough():
    machine = mbody.Mechanism("crank")
    machine.add(mbody.Body("crank", mass=1.0, inertia=0.1))
    machine.add(mbody.Revolute("O", "ground", "crank", friction=0.1, pin_radius="10 mm"))
    mbody.simulate(machine, 0.1, method="moreau", step=1e-2)


def many_corners():
    points = {f"P{n}": (float(n), 0.0) for n in range(2001)}
    shapes = {"hull": {"polygon": list(points)}}
    group = mbody.Between("group", "ground.floor", "block.hull")
    stepped(group, points=points, shapes=shapes)()


def other_contact():
    run = stepped(GROUP)()
    run.stepped.touching(0, "there")


def other_side():
    run = stepped(GROUP)()
    run.reaction("group", on="block")


SCENARIOS = {
    "impulses of another size": of_other_sizes,
    "steps with impulses and events": stepped(options={"events": [mbody.Event("block.y")]}),
    "steps with impulses and a driver that is released": released,
    "steps with impulses and friction in a joint": rough,
    "steps with impulses that a program leads on": led,
    "a polygon that bends inwards, in steps with impulses": stepped(
        mbody.Between("group", "ground.floor", "block.plate"),
        points=CORNERS,
        shapes={"plate": {"polygon": ["A", "B", "C", "D"]}},
    ),
    "a polygon of too many corners": many_corners,
    "an arc, in steps with impulses": stepped(
        mbody.Between("group", "ground.floor", "block.sole"),
        shapes={"sole": {"disc": "C", "radius": 1.0, "begin": "200 deg", "end": "340 deg"}},
    ),
    "two groups that bring the same shapes together": stepped(
        GROUP, mbody.Between("again", "ground.floor", "block.*")
    ),
    "shapes that overlap when steps with impulses begin": stepped(
        mbody.Between("group", "ground.floor", "block.rim"),
        shapes={"rim": {"disc": "C", "radius": 1.2}},
    ),
    "a group of shapes of one body": lambda: floored(mbody.Between("group", "block.C", "block.*")),
    "places of a contact that there is not": other_contact,
    "the force of a group on one body": other_side,
}

SENTENCES = r"""
impulses of another size | ModelError | - | the state that the motion of 'blocks' is to go on from is damaged: 'own' is of other sizes; simulate anew, from its beginning
steps with impulses and events | ModelError | - | the method 'moreau' locates no events ('block.y'): take dop853, or leave them out
steps with impulses and a driver that is released | ModelError | - | the method 'moreau' releases no drivers ('motor'): take dop853
steps with impulses and friction in a joint | ModelError | O | the method 'moreau' has friction in contacts, not in joints ('O'): take dop853, or leave out the friction of joints
steps with impulses that a program leads on | ModelError | - | the method 'moreau' steps whole motions, in simulate: take another one where a program leads the motion on
a polygon that bends inwards, in steps with impulses | ModelError | block | 'block': plate is a polygon that bends inwards: the method 'moreau' takes convex ones, give it as several of them
a polygon of too many corners | ModelError | block | 'block': hull has 2001 corners: give at most 2000
an arc, in steps with impulses | ModelError | block | 'block': sole is an arc: the method 'moreau' takes whole circles; give segments along it, or follow the motion by 'dop853'
two groups that bring the same shapes together | ModelError | again | 'group' and 'again' both bring together 'ground.floor' and 'block.C': give each pair of shapes one group
shapes that overlap when steps with impulses begin | ModelError | group | the shapes 'ground.floor' and 'block.rim' of contact 'group' overlap at the beginning by 0.2 m, at (0, -0.1) m: begin where they are apart, or touch
a group of shapes of one body | ModelError | group | 'group': no two shapes of different bodies fit 'block.C' and 'block.*' (there are: 'block.C', 'ground.floor', 'ground.O')
places of a contact that there is not | ModelError | there | there is no contact 'there' (there are: 'group')
the force of a group on one body | ModelError | - | group 'group' is between 'ground.floor' and 'block.C', not 'block'
"""
