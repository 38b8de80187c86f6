"""Shapes, contacts and ropes that do not fit, and motions that nothing decides."""

from mbody import (
    Between,
    Body,
    Contact,
    Fixed,
    Gravity,
    Mechanism,
    Rope,
    Simulator,
    assemble,
    from_toml,
    simulate,
)
from mbody.engineering import linearize

SQUARE = {"A": (0.0, 0.0), "B": (1.0, 0.0), "C": (1.0, 1.0), "D": (0.0, 1.0)}


def shaped(**shape):
    return lambda: Body("wheel", points={"O": (0.0, 0.0)} | SQUARE, shapes={"rim": shape})


def contact(i="ground.floor", j="wheel.rim", **numbers):
    return lambda: Contact("foot", i, j, **numbers)


def resting(*more, y=0.5, i="ground.floor", j="wheel.rim", radius=0.5, **numbers):
    """A wheel on a floor, with a contact between them."""
    shapes = {
        "floor": {"line": {"point": "O"}},
        "wall": {"segment": ("L", "R")},
        "bore": {"ring": "O", "radius": 2.0},
        "block": {"polygon": ("P", "Q", "S", "T")},
    }
    points = {"O": (0.0, 0.0), "L": (-1.0, 0.0), "R": (1.0, 0.0)}
    points |= {"P": (-1.0, -1.0), "Q": (1.0, -1.0), "S": (1.0, 0.0), "T": (-1.0, 0.0)}
    made = Mechanism("rest", ground=points, ground_shapes=shapes)
    wheel = {"rim": {"disc": "C", "radius": radius}, "box": {"polygon": ("A", "B", "E")}}
    corners = {"C": (0.0, 0.0), "A": (-0.2, -0.2), "B": (0.2, -0.2), "E": (0.0, 0.2)}
    made.add(Body("wheel", mass=1.0, inertia=0.1, points=corners, shapes=wheel, guess=(0, y, 0)))
    made.add(Contact("foot", i, j, **numbers), *more, Gravity("gravity", y=-9.81))
    return made


def followed(*more, **how):
    return lambda: simulate(resting(*more, **how), 0.01)


def many():
    """Each of a hundred discs with each other."""
    made = Mechanism("gravel")
    for n in range(100):
        shape = {"rim": {"disc": "C", "radius": 0.1}}
        made.add(Body(f"stone{n}", mass=1.0, points={"C": (0.0, 0.0)}, shapes=shape))
    made.add(Between("pile", "stone*.rim", "stone*.rim"))
    assemble(made)


def striking():
    """A wheel a hair above the floor."""
    made = resting(y=1.5)
    run = simulate(made, (2.0 / 9.81) ** 0.5 * (1.0 - 1e-12))
    linearize(made, at=run)


def designs(**values):
    named = {name.replace("_", ".", 1): value for name, value in values.items()}
    return lambda: assemble(resting(static=0.5)).with_values(named)


def tight():
    made = resting()
    made.add(Rope("leash", "ground.O", "wheel.C", length=0.4))
    simulate(made, 0.1)


FILE = """
[ground]
points = { O = [0, 0] }
shapes = { floor = { plane = "O" } }
[bodies.ball]
mass = 1
"""

SCENARIOS = {
    "shapes in a list": lambda: Body("wheel", shapes=["rim"]),
    "a shape of no kind": shaped(circle="O"),
    "a shape of a file of no kind": lambda: from_toml(FILE),
    "a disc without a radius": shaped(disc="O"),
    "a disc with a length": shaped(disc="O", radius=1.0, length=2.0),
    "a disc of radius zero": shaped(disc="O", radius=0.0),
    "a disc about a point that is not there": shaped(disc="Q", radius=1.0),
    "an arc of one end": shaped(disc="O", radius=1.0, begin="30 deg"),
    "an arc that ends before it begins": shaped(ring="O", radius=1.0, begin=1.5, end=0.5),
    "a disc as large as its ring": followed(y=0.0, i="ground.bore", radius=2.0),
    "a line without a point": shaped(line="O"),
    "a segment of one point": shaped(segment=("A",)),
    "a polygon of two points": shaped(polygon=("A", "B")),
    "a polygon of text": shaped(polygon="ABC"),
    "a shape with the name of a point": lambda: Body(
        "wheel", points={"O": (0.0, 0.0)}, shapes={"O": {"disc": "O", "radius": 1.0}}
    ),
    "a contact with a body": contact(j="wheel"),
    "a contact of a body with itself": contact("wheel.O", "wheel.rim"),
    "a contact with a negative coefficient": contact(friction=-0.1),
    "a contact that sticks less than it slides": contact(friction=0.3, static=0.2),
    "a contact that gains energy": contact(restitution=1.2),
    "a contact by a law that there is not": contact(law="hertz"),
    "designs of a contact that stick less than they slide": designs(foot_friction=[0.1, 0.7]),
    "designs of a contact that gain energy": designs(foot_restitution=[0.5, 1.5]),
    "a contact with a shape that is not there": lambda: resting(j="wheel.tyre"),
    "a contact with a body that is not there": lambda: resting(j="car.rim"),
    "a contact of two points": lambda: resting(i="ground.O", j="wheel.C"),
    "a group that fits nothing": lambda: resting(Between("pile", "stone*.rim", "ground.floor")),
    "a group of very many contacts": many,
    "a rope of a body to itself": lambda: Rope("leash", "wheel.C", "wheel.A", length=1.0),
    "a rope without a length": lambda: Rope("leash", "ground.O", "wheel.C", length=0.0),
    "a disc that overlaps the floor": followed(y=0.4),
    "a disc that overlaps a wall": followed(y=0.4, i="ground.wall"),
    "a disc that overlaps a block": followed(y=-0.5, i="ground.block", j="wheel.C"),
    "a disc that leaves its ring": followed(y=1.9, i="ground.bore"),
    "a rope that is too short": tight,
    "a contact between bodies that are welded": followed(
        Fixed("weld", "ground.O", "wheel.C"), y=0.0, radius=0.01, i="ground.wall", j="wheel.E"
    ),
    "a contact by steps of one length": lambda: simulate(
        resting(), 0.01, method="generalized-alpha", step=0.001
    ),
    "a contact led step by step by another method": lambda: Simulator(
        resting(), method="rattle", step=0.01
    ),
    "a mode of what has none": lambda: Simulator(resting()).mode("door"),
    "linear equations where something strikes": striking,
    "the mode of a contact that there is not": lambda: simulate(resting(), 0.01).mode("hand"),
    "the reaction of a contact on another body": lambda: simulate(resting(), 0.01).reaction(
        "foot", on="car"
    ),
}
