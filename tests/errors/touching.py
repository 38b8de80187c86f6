"""Shapes, contacts and ropes that do not fit, and motions that nothing decides."""

import math

import mbody
from mbody.engineering import linearize
from mbody.laws import Table

SQUARE = {"A": (0.0, 0.0), "B": (1.0, 0.0), "C": (1.0, 1.0), "D": (0.0, 1.0)}


def shaped(**shape):
    return lambda: mbody.Body("wheel", points={"O": (0.0, 0.0)} | SQUARE, shapes={"rim": shape})


def contact(i="ground.floor", j="wheel.rim", **numbers):
    return lambda: mbody.Contact("foot", i, j, **numbers)


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
    made = mbody.Mechanism("rest", ground=points, ground_shapes=shapes)
    wheel = {"rim": {"disc": "C", "radius": radius}, "box": {"polygon": ("A", "B", "E")}}
    corners = {"C": (0.0, 0.0), "A": (-0.2, -0.2), "B": (0.2, -0.2), "E": (0.0, 0.2)}
    made.add(
        mbody.Body("wheel", mass=1.0, inertia=0.1, points=corners, shapes=wheel, guess=(0, y, 0))
    )
    made.add(mbody.Contact("foot", i, j, **numbers), *more, mbody.Gravity("gravity", y=-9.81))
    return made


def curved(shape=None, j="wheel.rim", radius=0.1, analysis=None, guess=(1, 0.3, 0), **curves):
    """A wheel, or what is named, on a curve."""
    x = (0.0, 1.0, 2.0, 3.0)
    spline = {"interpolation": "spline"}
    tables = {"road": Table(x, (0.0, 0.2, 0.0, 0.2), **spline)} | curves

    def make():
        shapes = {"top": {"curve": "road", "point": "O"} | (shape or {})}
        made = mbody.Mechanism(
            "hill", ground={"O": (0.0, 0.0)}, ground_shapes=shapes, curves=tables
        )
        wheel = {"rim": {"disc": "C", "radius": radius}, "box": {"polygon": ("A", "B", "C")}}
        corners = {"C": (0.0, 0.0), "A": (-0.2, -0.2), "B": (0.2, -0.2)}
        made.add(
            mbody.Body("wheel", mass=1.0, inertia=0.1, points=corners, shapes=wheel, guess=guess),
            mbody.Contact("foot", "ground.top", j, friction=0.4),
            mbody.Gravity("gravity", y=-9.81),
        )
        if analysis is mbody.kinetostatics:
            made.add(mbody.CoordinateDriver("hand", "ground.O", "wheel.C", law=0.1))
            analysis(made)
        else:
            mbody.simulate(made, 0.01, method="moreau", step=0.001)

    return make


def circle(**how):
    """Tables of a circle, which ends where it begins."""
    t = tuple(0.25 * math.pi * n for n in range(9))
    x = tuple(round(math.cos(part), 12) for part in t)
    y = tuple(round(math.sin(part), 12) for part in t)
    how = {"interpolation": "spline"} | how
    return {"cx": Table(t, x, **how), "cy": Table(t, y, **how)}


def followed(*more, **how):
    return lambda: mbody.simulate(resting(*more, **how), 0.01)


def many():
    """Each of a hundred discs with each other."""
    made = mbody.Mechanism("gravel")
    for n in range(100):
        shape = {"rim": {"disc": "C", "radius": 0.1}}
        made.add(mbody.Body(f"stone{n}", mass=1.0, points={"C": (0.0, 0.0)}, shapes=shape))
    made.add(mbody.Between("pile", "stone*.rim", "stone*.rim"))
    mbody.assemble(made)


def striking():
    """A wheel a hair above the floor."""
    made = resting(y=1.5)
    run = mbody.simulate(made, (2.0 / 9.81) ** 0.5 * (1.0 - 1e-12))
    linearize(made, at=run)


def designs(**values):
    named = {name.replace("_", ".", 1): value for name, value in values.items()}
    return lambda: mbody.assemble(resting(static=0.5)).with_values(named)


def tight():
    made = resting()
    made.add(mbody.Rope("leash", "ground.O", "wheel.C", length=0.4))
    mbody.simulate(made, 0.1)


def steep():
    """A wheel that slides, and that a force lifts within 1e-40 m of where it begins."""
    rise = "8 N*(1 + wheel.x/sqrt(wheel.x^2 + (1e-40 m)^2))"
    made = resting(mbody.Force("lift", "wheel.C", rise, angle="90 deg"))
    start = {"wheel": {"x": 0.0, "y": 0.5, "angle": 0.0, "vx": 1.0, "vy": 0.0, "omega": 0.0}}
    made.simulation = mbody.SimulationSettings(1.0, start=start)
    sim = mbody.Simulator(made)
    sim.until(0.1)
    sim.step(0.1)


SCENARIOS = {
    "shapes in a list": lambda: mbody.Body("wheel", shapes=["rim"]),
    "a shape of no kind": shaped(circle="O"),
    "a disc without a radius": shaped(disc="O"),
    "a disc of radius zero": shaped(disc="O", radius=0.0),
    "a disc about a point that is not there": shaped(disc="Q", radius=1.0),
    "an arc of one end": shaped(disc="O", radius=1.0, begin="30 deg"),
    "an arc that ends before it begins": shaped(ring="O", radius=1.0, begin=1.5, end=0.5),
    "a disc as large as its ring": followed(y=0.0, i="ground.bore", radius=2.0),
    "a line without a point": shaped(line="O"),
    "a polygon of two points": shaped(polygon=("A", "B")),
    "a polygon of text": shaped(polygon="ABC"),
    "a shape with the name of a point": lambda: mbody.Body(
        "wheel", points={"O": (0.0, 0.0)}, shapes={"O": {"disc": "O", "radius": 1.0}}
    ),
    "a contact with a body": contact(j="wheel"),
    "a contact of a body with itself": contact("wheel.O", "wheel.rim"),
    "a contact by a law that there is not": contact(law="hertz"),
    "designs of a contact that gain energy": designs(foot_restitution=[0.5, 1.5]),
    "a contact with a shape that is not there": lambda: resting(j="wheel.tyre"),
    "a polygon on a curve": curved(j="wheel.box"),
    "a curve of three names": curved({"curve": ("a", "b", "c")}),
    "a curve that is not there": curved({"curve": "street"}),
    "a curve with corners": curved(road=Table((0.0, 1.0), (0.0, 1.0), interpolation="linear")),
    "a curve without end": curved(
        road=Table((0, 1, 2), (0, 1, 0), interpolation="spline", periodic=True)
    ),
    "two curves of other numbers": curved(
        {"curve": ("road", "y")}, y=Table((0.0, 1.0), (0.0, 1.0), interpolation="spline")
    ),
    "a curve with a cusp": curved(
        {"curve": ("px", "py")},
        px=Table((0.0, 1.0, 2.0), (0.0, 1.0, 0.0), interpolation="spline"),
        py=Table((0.0, 1.0, 2.0), (0.0, 1.0, 0.0), interpolation="spline"),
    ),
    "a curve that ends where it begins": curved({"curve": ("cx", "cy")}, **circle()),
    "a disc that touches a curve at two places": curved(radius=2.0),
    "a wheel that rolls around a curve": curved(
        {"curve": ("cx", "cy")},
        analysis=mbody.kinetostatics,
        guess=(0.1, -0.894, 0),
        **circle(periodic=True),
    ),
    "a curve by steps with impulses": curved(),
    "a group of very many contacts": many,
    "a rope without a length": lambda: mbody.Rope("leash", "ground.O", "wheel.C", length=0.0),
    "a disc that overlaps a wall": followed(y=0.4, i="ground.wall"),
    "a disc that overlaps a block": followed(y=-0.5, i="ground.block", j="wheel.C"),
    "a disc that leaves its ring": followed(y=1.9, i="ground.bore"),
    "a rope that is too short": tight,
    "a contact between bodies that are welded": followed(
        mbody.Fixed("weld", "ground.O", "wheel.C"), y=0.0, radius=0.01, i="ground.wall", j="wheel.E"
    ),
    "a contact led step by step by another method": lambda: mbody.Simulator(
        resting(), method="rattle", step=0.01
    ),
    "an impulse of a contact that there is not": lambda: (
        mbody.simulate(resting(y=0.5001), 0.01).events[0].impulse("hand")
    ),
    "a mode of what has none": lambda: mbody.Simulator(resting()).mode("door"),
    "linear equations where something strikes": striking,
    "a load that jumps where a motion begins": steep,
    "the reaction of a contact on another body": lambda: mbody.simulate(resting(), 0.01).reaction(
        "foot", on="car"
    ),
}

SENTENCES = r"""
shapes in a list | ModelError | wheel | 'wheel': shapes must be a dict such as {"rim": {"disc": "O", "radius": 0.3}}, not ['rim']
a shape of no kind | ModelError | wheel | 'wheel': rim is {'circle': 'O'}, no shape: give one of 'disc', 'ring', 'segment', 'line', 'polygon', 'curve', such as {"disc": "O", "radius": 0.3}
a disc without a radius | ModelError | wheel | 'wheel': rim: a disc needs 'radius'
a disc of radius zero | ModelError | wheel | 'wheel': rim.radius is 0, it must be positive: a shape without radius is a point, which a contact names by itself
a disc about a point that is not there | ModelError | wheel | 'wheel': rim names point 'Q', which the body has not (it has: 'O', 'A', 'B', 'C', 'D'): add it to its points
an arc of one end | ModelError | wheel | 'wheel': rim has begin or end alone: an arc goes from begin to end, counter-clockwise; a whole circle has neither
an arc that ends before it begins | ModelError | wheel | 'wheel': rim goes from 85.9437 deg to 28.6479 deg: end must be above begin, by less than a turn; a whole circle has neither
a disc as large as its ring | ModelError | foot | 'foot': the disc 'wheel.rim' of radius 2 m is not within the ring 'ground.bore' of radius 2 m: give it a smaller one
a line without a point | ModelError | wheel | 'wheel': rim: line must be { point = …, angle = … }, not 'O'
a polygon of two points | ModelError | wheel | 'wheel': rim needs at least 3 points of different names, not ('A', 'B')
a polygon of text | ModelError | wheel | 'wheel': rim must list its points by name, not 'ABC'
a shape with the name of a point | ModelError | wheel | 'wheel': the name of shape 'O' is taken by a point or a number of the body: choose another
a contact with a body | ModelError | foot | 'foot': j is 'wheel', it must name a shape or a point of a body: "ground.floor" or "ladder.A"
a contact of a body with itself | ModelError | foot | 'foot' would be between 'wheel' and itself: give shapes of two bodies
a contact by a law that there is not | ModelError | foot | 'foot': law is 'hertz': give one of poisson, newton
designs of a contact that gain energy | ModelError | foot | 'foot': restitution is 1.5, which would gain energy: give 0 to 1
a contact with a shape that is not there | ModelError | foot | 'foot' refers to shape 'tyre' of 'wheel', which is not there (it has the shapes 'rim', 'box' and the points 'C', 'A', 'B', 'E'): name one of these, or add it to the body
a polygon on a curve | ModelError | foot | 'foot': a curve and a polygon do not touch: points and discs touch lines, segments, polygons and discs, and rings from within; of segments and polygons the corners do; curves are touched by points and whole discs
a curve of three names | ModelError | ground | 'ground': top.curve is ('a', 'b', 'c'): name one curve of the mechanism, y of x, or two, x and y of one number
a curve that is not there | ModelError | ground | 'ground': top names the curve 'street', which is not there (there are: 'road'): add it to the curves of the mechanism
a curve with corners | ModelError | road | the curve 'road' is no smooth contour: give a table with interpolation = "spline"
a curve without end | ModelError | road | the curve 'road' is periodic, a contour of one curve has two ends: give as many periods as there are, or x and y as two curves of a closed one
two curves of other numbers | ModelError | road | the curves 'road' and 'y' make no contour: give x and y at the same numbers, both periodic where it is closed
a curve with a cusp | ModelError | px | the contour of 'px' and 'py' stands still at a point, or has a cusp: give points that follow each other along it
a curve that ends where it begins | ModelError | cx | the contour of 'cx' and 'cy' ends where it begins: give both tables periodic = true
a disc that touches a curve at two places | ModelError | foot | 'foot': the disc 'wheel.rim' of radius 2 m would touch 'ground.top' at two places: the curve lets a radius of up to 1.231 m by, at (2.66667, 0.0395062) m from its point; give a smaller disc, or a curve with wider hollows
a wheel that rolls around a curve | ModelError | - | a wheel that rolls without slip on a closed curve is followed by simulate alone: where it is does not say how often it went round
a curve by steps with impulses | ModelError | ground | 'ground': top is a curve: the method 'moreau' takes straight edges and circles; give segments along it, or follow the motion by 'dop853'
a group of very many contacts | ModelError | pile | 'pile' would be more than 2000 contacts, 100 shapes with 100: every pair is watched by itself; simulate by the method "moreau", which looks at those that are near, or name fewer shapes
a rope without a length | ModelError | leash | 'leash': length is 0, it must be positive: give more than 0
a disc that overlaps a wall | ModelError | foot | the shapes 'ground.wall' and 'wheel.rim' of contact 'foot' overlap by 0.1 m at the beginning, at (0, 0.4) m: begin with them apart, or touching
a disc that overlaps a block | ModelError | foot | the shapes 'ground.block' and 'wheel.C' of contact 'foot' overlap by 0.5 m at the beginning, at (0, -0.5) m: begin with them apart, or touching
a disc that leaves its ring | ModelError | foot | the shapes 'ground.bore' and 'wheel.rim' of contact 'foot' overlap by 0.4 m at the beginning, at (0, 1.9) m: begin with them apart, or touching
a rope that is too short | ModelError | leash | rope 'leash' is 0.1 m too short at the beginning: begin with its ends nearer to each other, or give it more length
a contact between bodies that are welded | ModelError | foot | contact 'foot' is between 'ground' and 'wheel', which joint 'weld' ties to each other: leave out one of them
a contact led step by step by another method | ModelError | foot | 'foot' of 'rest' may open, stick or slide, which the method 'rattle' does not decide: follow the motion by simulate with dop853, dopri5 or radau5, or leave out contacts and friction
an impulse of a contact that there is not | ModelError | hand | there is no contact 'hand' (there are: 'foot')
a mode of what has none | ModelError | door | 'door' is no contact, rope or joint with friction (there are: 'foot'): give a joint friction, as in friction=0.1
linear equations where something strikes | SolveError | - | linearize of 'rest': something strikes at t = 0.451524 s, so that there are no linear equations; take an instant beside it
a load that jumps where a motion begins | SolveError | - | the motion of 'rest' has ended: at t = 0 s, steps do not show what happens at 'foot': smooth loads that jump there; set an earlier state, or reset it
the reaction of a contact on another body | ModelError | - | contact 'foot' is between 'ground' and 'wheel', not 'car'
"""
