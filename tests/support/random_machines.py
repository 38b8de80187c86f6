"""Random mechanisms of every element and law, as hypothesis draws them."""

import math

import numpy as np
from hypothesis import strategies as st

import mbody
from mbody.laws import (
    SHAPES,
    Cam,
    ConstantAcceleration,
    ConstantSpeed,
    Dwell,
    Harmonic,
    Polynomial,
    Rise,
    Table,
)
from mbody.makers import polar
from mbody.model.body import Guess, SecondMoments, SlenderRod
from mbody.model.loads import CentrifugalField
from mbody.model.simulation import Instants, Measure

ODD = ("crank", "a b", "Kurbel-Ö", "曲柄", 'quo"te', "it's", "back\\slash", "#1", "a=b", "[x]")
ODD += ("{y}", "-", "1", "true", "inf", "2024-01-01", "😀", "a,b", "x: y", " led", "'", "$schema")
EXTREME = (5e-324, 1e308, -0.0, 0.0, 1 / 3, 0.1, -2.5e-300, 1e15, 1e16, 123456789.0, 2.0**60)
NAMES = ("P", "tip", "Spitze ü", '"', "p-1", "#", "x", "9")
numbers = st.one_of(st.sampled_from(EXTREME), st.floats(allow_nan=False, allow_infinity=False))
positive = st.one_of(
    st.sampled_from([x for x in EXTREME if x > 0.0]), st.floats(5e-324, 1e308, exclude_min=False)
)
small = st.floats(-100.0, 100.0)
angles = st.one_of(
    st.integers(-720, 720).map(math.radians),
    st.sampled_from([math.radians(22.5), 1 / 3, 5e-324, 1e308, -0.0, 2.0]),
    st.floats(-10.0, 10.0),
)
PARAMETERS = {"a": 2.5, "l": "15 in", "phi": "30 deg", "half": "l/2", "F": "3 lbf", "T": "2 s"}
LENGTHS = st.sampled_from(["l/2", "half + 1 mm", "3 in", "2*a", "hypot(l, half)", "1/4 in"])
TURNS = st.sampled_from(["phi", "2*phi + 1 deg", "60 deg", "0.5 rad", "atan2(l, half)", "0.3*a"])


def mixed(plain, text):
    return st.one_of(plain, plain, text)


lengths, turns = mixed(numbers, LENGTHS), mixed(angles, TURNS)
points = st.one_of(st.tuples(lengths, lengths), st.builds(polar, lengths, turns))


@st.composite
def tables(draw, x, y):
    count = draw(st.integers(4, 9))
    ends = np.cumsum(draw(st.lists(st.floats(0.01, 5.0), min_size=count, max_size=count)))
    values = draw(st.lists(y, min_size=count, max_size=count))
    periodic = draw(st.booleans())
    if periodic:
        values[-1] = values[0]
    outside = draw(st.sampled_from(["error", "hold", "line"]))
    between = draw(st.sampled_from([None, "linear", "pchip", "spline"]))
    end = None
    if between in (None, "spline"):
        end = draw(st.sampled_from([None, "natural", "not-a-knot", "clamped"]))
    return Table(ends, values, periodic, end, outside, between)


@st.composite
def cams(draw):
    rise = draw(st.floats(0.1, 9.0))
    shape, other = draw(st.sampled_from(SHAPES)), draw(st.sampled_from(SHAPES))
    first = Rise(shape, rise, draw(st.floats(0.0, 1.0)), 0.5, draw(small))
    rest = [Dwell(draw(st.floats(0.1, 1.0)))] if draw(st.booleans()) else []
    return Cam([first, *rest, Rise(other, -rise, 0.0, 1 / 3)], 4.0)


def laws(value, texts):
    """Every kind of law, with numbers of its values drawn from `value`."""
    return st.one_of(
        value,
        st.builds(ConstantSpeed, value, numbers),
        st.builds(ConstantAcceleration, value, numbers, mixed(numbers, st.just("a"))),
        st.lists(numbers, min_size=1, max_size=5).map(Polynomial),
        st.builds(Harmonic, value, numbers, numbers, turns),
        tables(small, small),
        st.builds(Rise, st.sampled_from(SHAPES), value, numbers, positive, value),
        cams(),
        st.sampled_from(texts),
    )


angle_laws = laws(turns, ["60 deg + 25 rad/s*t", "phi*sin(3 rad/s*t)", "0.3*sin(2*t)", "a*t^2"])
length_laws = laws(lengths, ["l + 3 mm/s*t", "half*(1 + sin(t/(1 s)))", "2 + sin(3*t)", "exp(t)"])
force_laws = laws(mixed(numbers, st.just("F")), ["F*sin(5 rad/s*t)", "80*t^2 + 1", "9 N*cos(a*t)"])
speed_laws = laws(numbers, ["300 rpm", "2 rad/s + 3 rad/s^2*t", "a*sin(t)"])
momentum_laws = laws(numbers, ["3 kg*m^2/s", "F*l*t", "2*t"])
torque_laws = laws(numbers, ["F*l*sin(5 rad/s*t)", "t", "2 N*m*cos(3*t)"])
of_length = laws(numbers, ["3*x + 2*x^3", "20 N/mm*x", "F*atan(x/l)/(1 rad)"])
of_rate = laws(numbers, ["3*x", "F*x/(1 m/s)", "tan(0.1*x)"])
of_angle = laws(numbers, ["F*l*sin(x)", "2*x", "max(x, 0)"])


@st.composite
def machines(draw):
    """A mechanism of two bodies and a random choice of all that a file can hold."""
    names = draw(st.permutations(ODD))
    one, two, *rest = names
    texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
    machine = mbody.Mechanism(
        draw(texts),
        units=draw(st.sampled_from(["SI", "mm-N-s", "in-lbf-s", "cm-kN-s"])),
        g=draw(st.one_of(st.none(), st.floats(1e-3, 1e5), st.just("9.81 m/s^2"))),
        ground={key: draw(points) for key in draw(st.sets(st.sampled_from(NAMES)))},
        parameters=PARAMETERS,
        source=draw(texts),
        note=draw(texts),
    )
    for name in (one, two):
        mass = draw(st.sampled_from(["mass", "weight", None]))
        inertia = st.sampled_from(["a", "3 kg*m^2"])
        spread = st.one_of(
            st.sampled_from([None, "point", SecondMoments(2.0, 1 / 3, 0.1)]),
            st.builds(SlenderRod, angles),
        )
        guess = st.one_of(
            st.none(), angles, st.tuples(numbers, numbers, turns), st.builds(Guess, x=numbers)
        )
        machine.add(
            mbody.Body(
                name,
                inertia=draw(mixed(st.one_of(st.just(-0.0), positive), inertia)),
                cg=draw(points),
                points={key: draw(points) for key in draw(st.sets(st.sampled_from(NAMES)))},
                guess=draw(guess),
                spread=draw(spread),
                **({mass: draw(mixed(positive, st.just("a")))} if mass else {}),
            )
        )

    def place(name):
        bodies = machine[name].points if name != "ground" else machine.ground.points
        where = st.one_of(points, st.just((0.0, 0.0)))
        if bodies:
            where = st.one_of(where, st.sampled_from(sorted(bodies)))
        marker = st.builds(mbody.Marker, st.just(name), where, st.one_of(st.just(0.0), turns))
        return draw(marker)

    def pair():
        i, j = draw(st.permutations([one, two, "ground"]))[:2]
        return {"i": place(i), "j": place(j)}

    def bodies():
        return dict(zip(("body", "by"), draw(st.permutations([one, two, "ground"])), strict=False))

    def stiff(key, strategy, more):
        if draw(st.booleans()):
            return {"law": draw(strategy)}
        return {key: draw(numbers.map(abs)), **{k: draw(v) for k, v in more.items()}}

    other = st.sampled_from([two, "ground"])
    apart = mixed(positive, st.just("l + t*a m/s"))
    kinds = (
        lambda: mbody.Revolute(rest.pop(), **pair()),
        lambda: mbody.Prismatic(rest.pop(), **pair()),
        lambda: mbody.Fixed(rest.pop(), **pair()),
        lambda: mbody.Distance(rest.pop(), **pair(), length=draw(mixed(positive, st.just("l")))),
        lambda: mbody.AngleDriver(rest.pop(), one, draw(angle_laws), draw(other)),
        lambda: mbody.DistanceDriver(rest.pop(), **pair(), law=draw(apart)),
        lambda: mbody.CoordinateDriver(rest.pop(), **pair(), law=draw(length_laws)),
        lambda: mbody.Force(
            rest.pop(), place(one), draw(force_laws), draw(turns), draw(st.booleans())
        ),
        lambda: mbody.Torque(rest.pop(), **bodies(), value=draw(torque_laws)),
        lambda: mbody.Gravity(
            draw(st.sampled_from(["gravity", rest.pop()])), draw(small), draw(small)
        ),
        lambda: CentrifugalField(rest.pop(), place("ground"), draw(speed_laws)),
        lambda: CentrifugalField(
            rest.pop(),
            place("ground"),
            momentum=draw(momentum_laws),
            inertia=draw(numbers.map(abs)),
        ),
        lambda: mbody.Spring(
            rest.pop(), **pair(), **stiff("stiffness", of_length, {"preload": numbers})
        ),
        lambda: mbody.Damper(rest.pop(), **pair(), **stiff("coefficient", of_rate, {})),
        lambda: mbody.TorsionSpring(
            rest.pop(), **bodies(), **stiff("stiffness", of_angle, {"free_angle": turns})
        ),
        lambda: mbody.TorsionDamper(
            rest.pop(), **bodies(), **stiff("coefficient", of_rate_angle, {})
        ),
    )
    for make in draw(st.lists(st.sampled_from(kinds), min_size=1, max_size=6)):
        element = make()
        if element.name not in machine:
            machine.add(element)
    machine.measures |= draw(
        st.dictionaries(
            st.sampled_from(ODD),
            st.sampled_from([Measure("t*2"), Measure("t", "ms"), Measure("half + t*l/T", "ft")]),
            max_size=3,
        )
    )
    drivers = [d.name for d in machine.drivers]
    if drivers:
        angular = machine[drivers[0]].rows == "a"
        asks = [
            Instants(over="turn", instants=9),
            Instants(over=drivers[0]),
            Instants(at={"t": [0, "T/2", "30 ms"]}),
        ]
        asks += [Instants(at={drivers[0]: [draw(angles), "0.25", "phi" if angular else "l"]})]
        machine.ask = draw(st.sampled_from([None, *asks]))
    return machine


of_rate_angle = laws(numbers, ["2*x", "F*l*x/(1 rad/s)"])
