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


def batch(analysis, *more):
    return lambda: analysis(assemble(pendulum()).with_values({"rod.mass": [1.0, 2.0]}), *more)


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
    "a field of a speed and a momentum": lambda: CentrifugalField(
        "field", AXIS, speed=3.0, momentum=2.0
    ),
    "a field about an axis that moves": lambda: CentrifugalField("field", "rod.A", speed=3.0),
    "a field on a body of unknown spread": turning(None),
    "a point with inertia": turning("point", inertia=0.2),
    "second moments that are another inertia": turning(SecondMoments(0.1, 0.2), inertia=0.2),
    "the spindle of a batch": spindle,
    "a driver that is not there lets go": lambda: equilibrium(pendulum(), free="motor"),
    # -- rest positions
    "rest positions of a batch": batch(equilibrium),
    "rest positions at two times": lambda: equilibrium(pendulum(), t=[0.0, 1.0]),
    "a start that is a number": lambda: equilibrium(pendulum(), starts=[0.5]),
    "rest positions of very many bodies": lambda: equilibrium(free(800)),
    "rest positions of very many free motions": lambda: equilibrium(free(42)),
    "rest positions of what is driven": lambda: equilibrium(
        pendulum(AngleDriver("motor", "rod", 0.5))
    ),
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
    "linear equations of a batch": lambda: linearize(
        assemble(pendulum()).with_values({"rod.mass": [1.0, 2.0]}), at=rest()
    ),
    "linear equations at all rest positions": lambda: linearize(
        pendulum(), at=equilibrium(pendulum())
    ),
    "linear equations at a batch": lambda: linearize(pendulum(), at=in_two()),
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
    "a curve of a batch": batch(equilibrium_curve, "gravity.y", (-9.0, -10.0)),
    "a curve along what is not there": curve("push.size", (0.0, 5.0)),
    "a curve over no span": curve("push.value", (3.0, 3.0)),
    "a curve over a number": curve("push.value", 3.0),
    "a curve that begins outside": curve(*SPAN, at=7.0),
    "a curve of one point": curve(*SPAN, points=1),
    "a curve that starts at a number": curve(*SPAN, start=0.5),
    "a curve that starts where nothing rests": curve("push.value", (12.0, 5.0), start={"rod": 0.1}),
    "a curve that starts where there is nothing": curve("push.value", (12.0, 5.0)),
}
