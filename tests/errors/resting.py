"""Rotating fields, rest positions and their curves."""

import math
from dataclasses import dataclass

from mbody import (
    AngleDriver,
    Body,
    CouplingTerm,
    Distance,
    Force,
    Gravity,
    LengthCoupling,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    Spring,
    Torque,
    TorsionSpring,
    assemble,
    equilibrium,
    kinetostatics,
    makers,
    modes,
)
from mbody.engineering import close_loops, equilibrium_curve, linearize, momentum
from mbody.model.body import SecondMoments
from mbody.model.loads import CentrifugalField, CustomLoad
from tests.errors.solving import free

AXIS = Marker("ground", (0.0, 0.0), 0.5 * math.pi)


def pendulum(*more, **own):
    """A rod that hangs from a pin; it weighs 19.62 N, half a metre from the pin."""
    machine = Mechanism("pendulum")
    own = {"mass": 2.0, "cg": (0.5, 0.0), "guess": -1.5, **own}
    machine.add(Body("rod", **own), Revolute("O", "ground", "rod"), Gravity("gravity", y=-9.81))
    machine.add(*more)
    return machine


def open_in_one():
    """Two four-bars under their weight; the coupler of the second is too long."""
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)).without("motor")
    machine.add(Gravity("gravity", y=-9.81))
    return assemble(machine).with_values({"coupler.B.x": [3.0, 9.0]})


def turning(spread, **own):
    return lambda: assemble(
        pendulum(CentrifugalField("field", AXIS, speed=3.0), spread=spread, **own)
    )


def slider(*more, end=0.0):
    """A block on a rail along x."""
    machine = Mechanism("slider")
    rail = Prismatic("rail", Marker("ground", (end, 0.0)), "block")
    machine.add(Body("block", mass=2.0, guess=(0.0, 0.0, 0.0)), rail, *more)
    return machine


def pulleys():
    """Two guided weights on one rope over two points; the heavier draws the other one up."""
    machine = Mechanism("pulleys", ground={"L": (-0.75, 0.0), "R": (0.75, 0.0)})
    for name, end, x, mass in (("a", "L", -0.75, 1.7), ("b", "R", 0.75, 2.6)):
        rail = Marker("ground", (x, 0.0), 0.5 * math.pi), Marker(name, (0.0, 0.0), 0.5 * math.pi)
        machine.add(Body(name, mass=mass, guess=(x, -2.0, 0.0)), Prismatic(f"rail{end}", *rail))
    ends = [
        CouplingTerm(1.0, distance=(f"ground.{end}", name))
        for end, name in (("L", "a"), ("R", "b"))
    ]
    machine.add(LengthCoupling("rope", ends, 4.0), Gravity("gravity", y=-9.81))
    return machine


def swing(*more):
    """A seat on two rods of equal length: it moves on a circle and never turns."""
    machine = Mechanism("swing", ground={"A": (0.0, 0.0), "B": (1.0, 0.0)})
    seat = Body("seat", mass=2.0, points={"A": (0.0, 0.0), "B": (1.0, 0.0)}, guess=(0.1, -1.0, 0.0))
    rods = (Distance(f"rod{key}", f"ground.{key}", f"seat.{key}", length=1.0) for key in "AB")
    machine.add(seat, *rods, *more)
    return machine


@dataclass(frozen=True)
class Whirl(CustomLoad):
    """A force of 1 N/m square to the way from the place on i: it drives round and round."""

    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, -j[1], j[0], 0.0


def spindle():
    """The spindle of a batch."""
    field = CentrifugalField("field", AXIS, speed=3.0)
    motor = AngleDriver("motor", "rod", 0.5)
    system = assemble(pendulum(field, motor, spread="point"))
    field.spindle(kinetostatics(system.with_values({"rod.mass": [1.0, 2.0]})))


def pushed():
    """Two pendulums, of which one is pushed round and round."""
    system = assemble(pendulum(Torque("push", "rod", value=1.0)))
    return system.with_values({"push.value": [1.0, 12.0]})


def curve(*more, **options):
    machine = pendulum(Torque("push", "rod", value=0.0))
    return lambda: equilibrium_curve(machine, *more, **options)


def flag():
    """A pendulum with a link on it that has no mass, and that nothing holds from turning."""
    return pendulum(Body("flag"), Revolute("F", "rod", "flag"))


def feather():
    """A link on a spring, without mass."""
    machine = Mechanism("feather")
    machine.add(Body("link"), Revolute("O", "ground", "link"))
    machine.add(TorsionSpring("k", "ground", "link", 3.0))
    return machine


def flat():
    """Parallel cranks released where they lie flat on one line."""
    machine = Mechanism("flat", ground={"A": (0.0, 0.0), "B": (2.0, 0.0)})
    crank = {"mass": 1.0, "inertia": 0.1, "points": {"P": (1.0, 0.0)}, "guess": 0.0}
    machine.add(Body("a", **crank), Body("b", **crank), Body("bar", **crank | BAR))
    machine.add(Revolute("A", "ground.A", "a"), Revolute("B", "ground.B", "b"))
    machine.add(Revolute("C", "a.P", "bar"), Revolute("D", "bar.P", "b.P"))
    machine.add(Gravity("gravity", y=-9.81))
    return close_loops(machine)


BAR = {"points": {"P": (2.0, 0.0)}}


def rest(machine=None):
    return equilibrium(machine or pendulum())[0]


def in_two():
    """The motion of a batch."""
    motor = AngleDriver("motor", "rod", 0.5)
    return kinetostatics(assemble(pendulum(motor)).with_values({"rod.mass": [1.0, 2.0]}))


SPAN = ("push.value", (0.0, 5.0))

SCENARIOS = {
    "a rest where the ends of a spring meet": lambda: equilibrium(
        slider(Spring("s", "ground", "block", stiffness=1e-3, preload=-5.0), end=1.0)
    ),
    "a field without a speed": lambda: CentrifugalField("field", AXIS),
    "a field about an axis that moves": lambda: CentrifugalField("field", "rod.A", speed=3.0),
    "a field on a body of unknown spread": turning(None),
    "a point with inertia": turning("point", inertia=0.2),
    "second moments that are another inertia": turning(SecondMoments(0.1, 0.2), inertia=0.2),
    "the spindle of a batch": spindle,
    "a driver that is not there lets go": lambda: equilibrium(pendulum(), free="motor"),
    # -- rest positions
    "rest positions of a design that has none": lambda: equilibrium(pushed()).design(1),
    "rest positions at two times": lambda: equilibrium(pendulum(), t=[0.0, 1.0]),
    "a start that is a number": lambda: equilibrium(pendulum(), starts=[0.5]),
    "rest positions of very many bodies": lambda: equilibrium(free(800)),
    "rest positions of very many free motions": lambda: equilibrium(free(42)),
    "a torque that is too large": lambda: equilibrium(pendulum(Torque("push", "rod", value=12.0))),
    "a force without an end": lambda: equilibrium(slider(Force("push", "block", 3.0))),
    "weights that a rope draws into a pulley": lambda: equilibrium(pulleys()),
    "a force round and round": lambda: equilibrium(
        swing(Whirl("whirl", "ground.A", "seat"), Gravity("gravity", x=0.1))
    ),
    "a spring without a value at rest": lambda: equilibrium(
        pendulum(Spring("spring", "ground", "rod", law="log(x/(1 m) - 9) N"))
    ),
    # -- small motions
    "linear equations at all rest positions": lambda: linearize(
        pendulum(), at=equilibrium(pendulum())
    ),
    "linear equations at a batch": lambda: linearize(pendulum(), at=in_two()),
    "linear equations at a design that does not close": lambda: linearize(
        open_in_one(), at=close_loops(open_in_one())
    ).design(1),
    "linear equations at a design that does not rest": lambda: linearize(
        pushed(), at=equilibrium(pushed())
    ).design(1),
    "linear equations at another machine": lambda: linearize(slider(), at=rest()),
    "linear equations of very many bodies": lambda: linearize(free(800), at=close_loops(free(800))),
    "linear equations of what is driven": lambda: linearize(
        pendulum(AngleDriver("motor", "rod", -1.5)),
        at=kinetostatics(pendulum(AngleDriver("motor", "rod", -1.5))),
    ),
    "linear equations at what does not close": lambda: linearize(
        pendulum(AngleDriver("motor", "rod", 0.5)), at=rest()
    ),
    "linear equations where another machine rests": lambda: linearize(
        pendulum(Torque("push", "rod", value=5.0)), at=rest()
    ),
    "linear equations where branches meet": lambda: linearize(flat().mechanism, at=flat()),
    "a state matrix without inertia": lambda: linearize(feather(), at=rest(feather())).state_matrix,
    "modes at a time of their own": lambda: modes(pendulum(), at=rest(), t=1.0),
    "modes of a motion": lambda: modes(pendulum(), at=close_loops(pendulum())),
    "modes of what nothing moves": lambda: modes(flag()),
    "momentum about nowhere": lambda: momentum(close_loops(pendulum()), about="O2"),
    "momentum about three numbers": lambda: momentum(
        close_loops(pendulum()), about=(1.0, 2.0, 3.0)
    ),
    # -- curves
    "a curve over a number": curve("push.value", 3.0),
    "a curve that begins outside": curve(*SPAN, at=7.0),
    "a curve that starts at a number": curve(*SPAN, start=0.5),
    "a curve that starts where nothing rests": curve("push.value", (12.0, 5.0), start={"rod": 0.1}),
    "a curve that starts where there is nothing": curve("push.value", (12.0, 5.0)),
}

SENTENCES = r"""
a rest where the ends of a spring meet | SolveError | block | no rest position of 'slider' was met: at (0, 0) m of 'block' the ends of 's' meet, where a force that does not vanish has no direction: no forces balance; begin beside it with starts
a field without a speed | ModelError | field | 'field' has neither speed nor momentum: give one of them
a field about an axis that moves | ModelError | field | 'field': its axis is on 'rod', which moves: the plane turns about an axis of the ground, give a place there
a field on a body of unknown spread | ModelError | rod | 'field' must know how the mass of 'rod' is spread in the plane: give Body('rod', spread=...) as "point", SlenderRod(angle) of a thin rod along that angle, or SecondMoments(xx, yy, xy)
a point with inertia | ModelError | rod | 'rod': its spread is "point", but its inertia is 0.2: give the inertia 0, or another spread
second moments that are another inertia | ModelError | rod | 'rod': xx + yy of its spread is 0.3, its inertia 0.2: in the plane both are the same moment about the mass centre, change one of them
the spindle of a batch | ModelError | field | the spindle of 'field' is of one design, this is a batch of 2 designs: analyse one of them, system.design(n)
a driver that is not there lets go | ModelError | motor | there is no driver 'motor' to release (drivers are: none)
rest positions of a design that has none | SolveError | rod | no rest position of 'pendulum' was met: what drives it is least at 0 deg of 'rod', where 2.19 N·m are left; begin elsewhere with starts, or change its loads
rest positions at two times | ModelError | - | equilibrium takes one time, not 2
a start that is a number | ModelError | - | starts must be guesses such as [{"crank": 0.3}, {"crank": 2.0}], not [0.5]
rest positions of very many bodies | SolveError | - | equilibrium of 'free': 1598 rows of 2400 coordinates are too many, it takes up to 1500 rows
rest positions of very many free motions | SolveError | - | equilibrium of 'free': 44 free motions are too many for its search, it takes up to 40: hold some of them by drivers
a torque that is too large | SolveError | rod | no rest position of 'pendulum' was met: what drives it is least at 0 deg of 'rod', where 2.19 N·m are left; begin elsewhere with starts, or change its loads
a force without an end | SolveError | block | no rest position of 'slider': its loads drive 'block' away without end; hold it, by a spring or a stop, or drive it
weights that a rope draws into a pulley | SolveError | a | no rest position of 'pulleys': its loads drive it from both sides to (-0.75, 0) m of 'a', where a distance is zero or a load jumps, so that no forces balance; put a stop there, or change its loads
a force round and round | SolveError | seat | no rest position of 'swing' was met: what drives it is least at (0, 1) m of 'seat', where 0.8 N are left; begin elsewhere with starts, or change its loads
a spring without a value at rest | SolveError | spring | load 'spring' has no value at t = 0 s: 'log(x/(1 m) - 9) N' has no finite value there; choose one that has, by max or min
linear equations at all rest positions | ModelError | - | at must be one rest position of equilibrium, or a Solution, not Equilibria
linear equations at a batch | ModelError | - | at is a batch of designs: give one, of system.design(n)
linear equations at a design that does not close | SolveError | A | loops do not close at t = 0 s: the smallest gap is 2.5 m at 'A' (between 'crank' and 'coupler'): check lengths, or give a better guess
linear equations at a design that does not rest | SolveError | rod | no rest position of 'pendulum' was met: what drives it is least at 0 deg of 'rod', where 2.19 N·m are left; begin elsewhere with starts, or change its loads
linear equations at another machine | ModelError | - | 'pendulum', of which an instant is given, has not the same bodies as 'slider'
linear equations of very many bodies | SolveError | - | linearize of 'free': 1598 rows of 2400 coordinates are too many for dense matrices
linear equations of what is driven | SolveError | - | nothing is free in 'pendulum', there are no small motions: release a driver, with free
linear equations at what does not close | ModelError | - | the instant that is given does not fit 'pendulum' at t = 0 s: its loops do not close there, or a load has no value; give a position of this mechanism
linear equations where another machine rests | SolveError | - | 'pendulum' does not rest where it is given: what drives it is 0.36 of the greatest load; look for rest positions of this very mechanism with equilibrium
linear equations where branches meet | SolveError | - | the position of 'flat' at t = 0 s is singular: branches of its motion meet, so that it has no linear equations; take an instant beside it
a state matrix without inertia | SolveError | - | 'feather' has a free motion without inertia, so that it has no state matrix: use its mass, damping and stiffness, or modes
modes at a time of their own | ModelError | - | at says the position and its time: leave out starts and t
modes of a motion | SolveError | - | modes are of a rest position, but 'pendulum' moves, or is not balanced, at t = 0 s: give one of equilibrium; linearize gives the state matrix of a motion
modes of what nothing moves | SolveError | flag | modes: the motion of 'flag' is not determined: it is free, and has neither inertia, nor a damper, nor a spring; give it one, or guide it by a joint
momentum about nowhere | ModelError | O2 | there is no body 'O2' (there are: 'rod', 'ground')
momentum about three numbers | ModelError | - | about must be a place, such as (0.0, 0.0) or "crank.A", not (1.0, 2.0, 3.0)
a curve over a number | ModelError | - | span must be two different numbers, where to begin first, not 3.0
a curve that begins outside | ModelError | - | at must be a number within the span 0 … 5, not 7.0
a curve that starts at a number | ModelError | - | start must be a rest position or a guess such as {"crank": 0.3}, not 0.5
a curve that starts where nothing rests | SolveError | - | there is no rest position of 'pendulum' near the start: look for one with equilibrium, and give it as start
a curve that starts where there is nothing | SolveError | rod | no rest position of 'pendulum' was met: what drives it is least at 0 deg of 'rod', where 2.19 N·m are left; begin elsewhere with starts, or change its loads
"""
