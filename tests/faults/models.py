"""Small mechanisms on which faults show: a four-bar, and one thing more on it each."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from mbody import (
    AngleDriver,
    Body,
    CamFollower,
    CoordinateDriver,
    CouplingTerm,
    Damper,
    Distance,
    Fixed,
    Force,
    Gear,
    Gravity,
    LengthCoupling,
    Marker,
    Mechanism,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Spring,
    Torque,
    TorsionSpring,
    laws,
)
from mbody.laws import Harmonic
from mbody.makers import polar

__all__ = ["MODELS"]


def four_bar(law: Any = None) -> Mechanism:
    """Links with mass centres off their lines, under gravity."""
    made = Mechanism("faults", g=10.0, ground={"O": (0.0, 0.0), "Q": (3.5, 0.2)})
    made.add(
        Body("crank", mass=1.0, inertia=0.2, cg=(0.4, 0.1), points={"A": (1.0, 0.0)}, guess=1.0),
        Body(
            *("coupler",),
            mass=3.0,
            inertia=1.1,
            cg=(1.4, 0.3),
            points={"B": (3.0, 0.0), "P": (1.5, 0.7)},
            guess=0.2,
        ),
        Body("rocker", mass=2.0, inertia=0.7, cg=(0.9, -0.2), points={"B": (2.0, 0.0)}, guess=1.3),
        Revolute("O", "ground.O", "crank"),
        Revolute("A", "crank.A", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("Q", "ground.Q", "rocker"),
        AngleDriver("motor", "crank", law or laws.ConstantAcceleration(1.0, 6.0, 5.0)),
        Gravity("gravity", y=-9.81),
    )
    return made


def loaded(*loads: Any) -> Callable[[], Mechanism]:
    """The four-bar under more loads."""

    def make() -> Mechanism:
        made = four_bar()
        made.add(*loads)
        return made

    return make


def polar_points() -> Mechanism:
    """A mass centre and a point by distance and angle."""
    made = Mechanism("polar")
    made.add(
        Body("arm", mass=2.0, inertia=0.3, cg=polar(0.5, 0.4), points={"P": polar(1.0, 0.9)}),
        Revolute("O", "ground", "arm"),
        AngleDriver("motor", "arm", laws.ConstantAcceleration(0.3, 4.0, 2.0)),
        Force("push", "arm.P", 5.0, angle=2.0),
    )
    return made


def units() -> Mechanism:
    """Numbers as text, in other units than those of the mechanism."""
    made = Mechanism("units", units="SI", parameters={"l": "12 in"})
    made.add(
        Body("arm", mass=2.0, inertia=0.3, cg=("l/2", 0), points={"A": ("l", 0)}),
        Revolute("O", "ground", "arm"),
        AngleDriver("motor", "arm", "30 deg + 5 deg*sin(4*t)"),
        Force("push", "arm.A", "12 lbf", angle="60 deg"),
        Gravity("gravity", y=-9.81),
    )
    return made


def weights() -> Mechanism:
    """Weights for masses."""
    made = Mechanism("weights", g=10.0)
    made.add(
        Body("arm", weight=20.0, inertia=0.3, cg=(0.5, 0.1)),
        Revolute("O", "ground", "arm"),
        AngleDriver("motor", "arm", laws.ConstantAcceleration(0.3, 4.0, 2.0)),
    )
    return made


def slider() -> Mechanism:
    """A block on a link that turns, driven along it."""
    made = Mechanism("slider")
    made.add(
        Body("arm", mass=2.0, inertia=0.3, cg=(0.5, 0.1)),
        Body("block", mass=1.0, inertia=0.1, cg=(0.1, 0.05), guess=0.3),
        Revolute("O", "ground", "arm"),
        Prismatic("guide", Marker("arm", (0.0, 0.2), 0.1), Marker("block", (0.0, 0.0), 0.1)),
        AngleDriver("motor", "arm", laws.ConstantAcceleration(0.3, 4.0, 2.0)),
        CoordinateDriver("ram", "arm", "block", laws.ConstantSpeed(0.5, 0.7)),
        Gravity("gravity", y=-9.81),
    )
    return made


def rod() -> Mechanism:
    """A link hung by a massless rod, and a body welded on it at an angle."""
    made = Mechanism("rod", ground={"O": (0.0, 0.0), "Q": (3.5, 0.2)})
    made.add(
        Body("crank", mass=1.0, inertia=0.2, cg=(0.4, 0.1), points={"A": (1.0, 0.0)}, guess=1.0),
        Body("rocker", mass=2.0, inertia=0.7, cg=(0.9, -0.2), points={"B": (2.0, 0.0)}, guess=1.3),
        Body("tool", mass=0.5, inertia=0.1, cg=(0.3, 0.1), guess=1.8),
        Revolute("O", "ground.O", "crank"),
        Distance("rod", "crank.A", "rocker.B", length=3.0),
        Revolute("Q", "ground.Q", "rocker"),
        Fixed("weld", Marker("rocker", "B", 0.5), "tool"),
        AngleDriver("motor", "crank", laws.ConstantAcceleration(1.0, 6.0, 5.0)),
        Gravity("gravity", y=-9.81),
    )
    return made


def slot() -> Mechanism:
    """A crank's pin in the slot of a lever."""
    made = Mechanism("slot", ground={"O": (0.0, 0.0), "Q": (0.0, -2.0)})
    made.add(
        Body("crank", mass=1.0, inertia=0.2, cg=(0.4, 0.1), points={"A": (1.0, 0.0)}, guess=1.0),
        Body("lever", mass=2.0, inertia=0.7, cg=(0.9, -0.2), guess=1.4),
        Revolute("O", "ground.O", "crank"),
        Revolute("Q", "ground.Q", "lever"),
        PinSlot("slot", "lever", "crank.A"),
        AngleDriver("motor", "crank", laws.ConstantAcceleration(1.0, 6.0, 5.0)),
        Gravity("gravity", y=-9.81),
    )
    return made


def gears() -> Mechanism:
    """A planet on an arm about a fixed sun."""
    made = Mechanism("gears")
    made.add(
        Body("arm", mass=1.0, inertia=0.2, cg=(0.4, 0.1), points={"C": (3.0, 0.0)}, guess=0.4),
        Body("planet", mass=2.0, inertia=0.7, cg=(0.1, 0.05), guess=1.2),
        Revolute("O", "ground", "arm"),
        Revolute("C", "arm.C", "planet"),
        Gear("mesh", "ground", "planet", radius_i=2.0, radius_j=1.0),
        AngleDriver("motor", "arm", laws.ConstantAcceleration(0.4, 6.0, 5.0)),
        Gravity("gravity", y=-9.81),
    )
    return made


def rack() -> Mechanism:
    """A rack on a slide below a pinion."""
    made = Mechanism("rack", ground={"O": (0.0, 0.5), "G": (0.0, 0.0)})
    made.add(
        Body("pinion", mass=1.0, inertia=0.2, cg=(0.1, 0.1), guess=0.3),
        Body("rack", mass=2.0, inertia=0.7, cg=(0.2, -0.1), guess=(0.1, 0.0, 0.0)),
        Revolute("O", "ground.O", "pinion"),
        Prismatic("guide", "ground.G", "rack"),
        RackPinion("mesh", "rack", "pinion", radius=0.5),
        AngleDriver("motor", "pinion", laws.ConstantAcceleration(0.3, 6.0, 5.0)),
        Gravity("gravity", y=-9.81),
        Force("push", "rack", -30.0, angle=0.3),
    )
    return made


def cam() -> Mechanism:
    """A roller on an eccentric."""
    made = Mechanism("cam")
    made.add(
        Body("cam", mass=1.0, inertia=0.2, cg=(0.1, 0.1), guess=0.3),
        Body("follower", mass=2.0, inertia=0.7, guess=(0.0, 2.2, 0.0)),
        Revolute("O", "ground", "cam"),
        Prismatic(
            "guide",
            Marker("ground", (0.0, 0.0), math.pi / 2),
            Marker("follower", (0.0, 0.0), math.pi / 2),
        ),
        CamFollower(
            "contact",
            "cam",
            "follower",
            profile=Harmonic(0.0, 0.3, 2.0),
            base_radius=1.5,
            roller=0.5,
        ),
        AngleDriver("motor", "cam", laws.ConstantAcceleration(0.3, 6.0, 5.0)),
        Gravity("gravity", y=-9.81),
    )
    return made


def coupled() -> Mechanism:
    """A weight on a rope over a point, drawn by a slider: two distances add up to its length."""
    made = Mechanism("rope", ground={"P": (1.0, 3.0)})
    made.add(
        Body("cart", mass=1.0, inertia=0.1, guess=(3.0, 0.0, 0.0)),
        Body("weight", mass=2.0, inertia=0.1, guess=(0.0, -1.0, 0.0)),
        Prismatic("floor", "ground", "cart"),
        Prismatic(
            "shaft",
            Marker("ground", (0.0, 0.0), 0.5 * math.pi),
            Marker("weight", (0.0, 0.0), 0.5 * math.pi),
        ),
        LengthCoupling(
            "rope",
            terms=[
                CouplingTerm(2.0, distance=("ground.P", "cart")),
                CouplingTerm(1.0, distance=("ground.P", "weight")),
            ],
            value=11.4,
        ),
        CoordinateDriver("winch", "ground", "cart", laws.ConstantAcceleration(3.0, 0.6, 0.4)),
        Gravity("gravity", y=-9.81),
    )
    return made


MODELS: dict[str, Callable[[], Mechanism]] = {
    "linkage": four_bar,
    "polar": polar_points,
    "units": units,
    "weights": weights,
    "sliders": slider,
    "extras": rod,
    "slot": slot,
    "gears": gears,
    "rack": rack,
    "cam": cam,
    "coupling": coupled,
    "harmonic": lambda: four_bar(Harmonic(1.0, 0.5, 4.0, 0.3)),
    "spring": loaded(Spring("s", "crank.A", "rocker.B", stiffness=20.0, free_length=1.0)),
    "damper": loaded(Damper("d", "ground.Q", "coupler.P", coefficient=3.0)),
    "twist": loaded(TorsionSpring("s", "rocker", stiffness=9.0, free_angle=0.4)),
    "torque": loaded(Torque("t", "rocker", by="coupler", value=7.0)),
    "force": loaded(Force("f", "coupler.P", 11.0, angle=0.7, follows=True)),
}
