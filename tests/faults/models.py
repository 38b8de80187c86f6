"""Small mechanisms on which faults show: a four-bar, and one thing more on it each."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mbody
from mbody import laws
from mbody.laws import Harmonic
from mbody.makers import polar

__all__ = ["MODELS"]


def four_bar(law: Any = None) -> mbody.Mechanism:
    """Links with mass centres off their lines, under gravity."""
    made = mbody.Mechanism("faults", g=10.0, ground={"O": (0.0, 0.0), "Q": (3.5, 0.2)})
    made.add(
        mbody.Body(
            "crank", mass=1.0, inertia=0.2, cg=(0.4, 0.1), points={"A": (1.0, 0.0)}, guess=1.0
        ),
        mbody.Body(
            *("coupler",),
            mass=3.0,
            inertia=1.1,
            cg=(1.4, 0.3),
            points={"B": (3.0, 0.0), "P": (1.5, 0.7)},
            guess=0.2,
        ),
        mbody.Body(
            "rocker", mass=2.0, inertia=0.7, cg=(0.9, -0.2), points={"B": (2.0, 0.0)}, guess=1.3
        ),
        mbody.Revolute("O", "ground.O", "crank"),
        mbody.Revolute("A", "crank.A", "coupler"),
        mbody.Revolute("B", "coupler.B", "rocker.B"),
        mbody.Revolute("Q", "ground.Q", "rocker"),
        mbody.AngleDriver("motor", "crank", law or laws.ConstantAcceleration(1.0, 6.0, 5.0)),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


def loaded(*loads: Any) -> Callable[[], mbody.Mechanism]:
    """The four-bar under more loads."""

    def make() -> mbody.Mechanism:
        made = four_bar()
        made.add(*loads)
        return made

    return make


def polar_points() -> mbody.Mechanism:
    """A mass centre and a point by distance and angle."""
    made = mbody.Mechanism("polar")
    made.add(
        mbody.Body("arm", mass=2.0, inertia=0.3, cg=polar(0.5, 0.4), points={"P": polar(1.0, 0.9)}),
        mbody.Revolute("O", "ground", "arm"),
        mbody.AngleDriver("motor", "arm", laws.ConstantAcceleration(0.3, 4.0, 2.0)),
        mbody.Force("push", "arm.P", 5.0, angle=2.0),
    )
    return made


def units() -> mbody.Mechanism:
    """Numbers as text, in other units than those of the mechanism."""
    made = mbody.Mechanism("units", units="SI", parameters={"l": "12 in"})
    made.add(
        mbody.Body("arm", mass=2.0, inertia=0.3, cg=("l/2", 0), points={"A": ("l", 0)}),
        mbody.Revolute("O", "ground", "arm"),
        mbody.AngleDriver("motor", "arm", "30 deg + 5 deg*sin(4*t)"),
        mbody.Force("push", "arm.A", "12 lbf", angle="60 deg"),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


def weights() -> mbody.Mechanism:
    """Weights for masses."""
    made = mbody.Mechanism("weights", g=10.0)
    made.add(
        mbody.Body("arm", weight=20.0, inertia=0.3, cg=(0.5, 0.1)),
        mbody.Revolute("O", "ground", "arm"),
        mbody.AngleDriver("motor", "arm", laws.ConstantAcceleration(0.3, 4.0, 2.0)),
    )
    return made


def slider() -> mbody.Mechanism:
    """A block on a link that turns, driven along it."""
    made = mbody.Mechanism("slider")
    made.add(
        mbody.Body("arm", mass=2.0, inertia=0.3, cg=(0.5, 0.1)),
        mbody.Body("block", mass=1.0, inertia=0.1, cg=(0.1, 0.05), guess=0.3),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Prismatic(
            "guide", mbody.Marker("arm", (0.0, 0.2), 0.1), mbody.Marker("block", (0.0, 0.0), 0.1)
        ),
        mbody.AngleDriver("motor", "arm", laws.ConstantAcceleration(0.3, 4.0, 2.0)),
        mbody.CoordinateDriver("ram", "arm", "block", laws.ConstantSpeed(0.5, 0.7)),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


def rod() -> mbody.Mechanism:
    """A link hung by a massless rod, and a body welded on it at an angle."""
    made = mbody.Mechanism("rod", ground={"O": (0.0, 0.0), "Q": (3.5, 0.2)})
    made.add(
        mbody.Body(
            "crank", mass=1.0, inertia=0.2, cg=(0.4, 0.1), points={"A": (1.0, 0.0)}, guess=1.0
        ),
        mbody.Body(
            "rocker", mass=2.0, inertia=0.7, cg=(0.9, -0.2), points={"B": (2.0, 0.0)}, guess=1.3
        ),
        mbody.Body("tool", mass=0.5, inertia=0.1, cg=(0.3, 0.1), guess=1.8),
        mbody.Revolute("O", "ground.O", "crank"),
        mbody.Distance("rod", "crank.A", "rocker.B", length=3.0),
        mbody.Revolute("Q", "ground.Q", "rocker"),
        mbody.Fixed("weld", mbody.Marker("rocker", "B", 0.5), "tool"),
        mbody.AngleDriver("motor", "crank", laws.ConstantAcceleration(1.0, 6.0, 5.0)),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


def slot() -> mbody.Mechanism:
    """A crank's pin in the slot of a lever."""
    made = mbody.Mechanism("slot", ground={"O": (0.0, 0.0), "Q": (0.0, -2.0)})
    made.add(
        mbody.Body(
            "crank", mass=1.0, inertia=0.2, cg=(0.4, 0.1), points={"A": (1.0, 0.0)}, guess=1.0
        ),
        mbody.Body("lever", mass=2.0, inertia=0.7, cg=(0.9, -0.2), guess=1.4),
        mbody.Revolute("O", "ground.O", "crank"),
        mbody.Revolute("Q", "ground.Q", "lever"),
        mbody.PinSlot("slot", "lever", "crank.A"),
        mbody.AngleDriver("motor", "crank", laws.ConstantAcceleration(1.0, 6.0, 5.0)),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


def gears() -> mbody.Mechanism:
    """A planet on an arm about a fixed sun."""
    made = mbody.Mechanism("gears")
    made.add(
        mbody.Body(
            "arm", mass=1.0, inertia=0.2, cg=(0.4, 0.1), points={"C": (3.0, 0.0)}, guess=0.4
        ),
        mbody.Body("planet", mass=2.0, inertia=0.7, cg=(0.1, 0.05), guess=1.2),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Revolute("C", "arm.C", "planet"),
        mbody.Gear("mesh", "ground", "planet", radius_i=2.0, radius_j=1.0),
        mbody.AngleDriver("motor", "arm", laws.ConstantAcceleration(0.4, 6.0, 5.0)),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


def rack() -> mbody.Mechanism:
    """A rack on a slide below a pinion."""
    made = mbody.Mechanism("rack", ground={"O": (0.0, 0.5), "G": (0.0, 0.0)})
    made.add(
        mbody.Body("pinion", mass=1.0, inertia=0.2, cg=(0.1, 0.1), guess=0.3),
        mbody.Body("rack", mass=2.0, inertia=0.7, cg=(0.2, -0.1), guess=(0.1, 0.0, 0.0)),
        mbody.Revolute("O", "ground.O", "pinion"),
        mbody.Prismatic("guide", "ground.G", "rack"),
        mbody.RackPinion("mesh", "rack", "pinion", radius=0.5),
        mbody.AngleDriver("motor", "pinion", laws.ConstantAcceleration(0.3, 6.0, 5.0)),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Force("push", "rack", -30.0, angle=0.3),
    )
    return made


def cam() -> mbody.Mechanism:
    """A roller on an eccentric."""
    made = mbody.Mechanism("cam")
    made.add(
        mbody.Body("cam", mass=1.0, inertia=0.2, cg=(0.1, 0.1), guess=0.3),
        mbody.Body("follower", mass=2.0, inertia=0.7, guess=(0.0, 2.2, 0.0)),
        mbody.Revolute("O", "ground", "cam"),
        mbody.Prismatic(
            "guide",
            mbody.Marker("ground", (0.0, 0.0), math.pi / 2),
            mbody.Marker("follower", (0.0, 0.0), math.pi / 2),
        ),
        mbody.CamFollower(
            "contact",
            "cam",
            "follower",
            profile=Harmonic(0.0, 0.3, 2.0),
            base_radius=1.5,
            roller=0.5,
        ),
        mbody.AngleDriver("motor", "cam", laws.ConstantAcceleration(0.3, 6.0, 5.0)),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


def coupled() -> mbody.Mechanism:
    """A weight on a rope over a point, drawn by a slider: two distances add up to its length."""
    made = mbody.Mechanism("rope", ground={"P": (1.0, 3.0)})
    made.add(
        mbody.Body("cart", mass=1.0, inertia=0.1, guess=(3.0, 0.0, 0.0)),
        mbody.Body("weight", mass=2.0, inertia=0.1, guess=(0.0, -1.0, 0.0)),
        mbody.Prismatic("floor", "ground", "cart"),
        mbody.Prismatic(
            "shaft",
            mbody.Marker("ground", (0.0, 0.0), 0.5 * math.pi),
            mbody.Marker("weight", (0.0, 0.0), 0.5 * math.pi),
        ),
        mbody.LengthCoupling(
            "rope",
            terms=[
                mbody.CouplingTerm(2.0, distance=("ground.P", "cart")),
                mbody.CouplingTerm(1.0, distance=("ground.P", "weight")),
            ],
            value=11.4,
        ),
        mbody.CoordinateDriver("winch", "ground", "cart", laws.ConstantAcceleration(3.0, 0.6, 0.4)),
        mbody.Gravity("gravity", y=-9.81),
    )
    return made


MODELS: dict[str, Callable[[], mbody.Mechanism]] = {
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
    "spring": loaded(mbody.Spring("s", "crank.A", "rocker.B", stiffness=20.0, free_length=1.0)),
    "damper": loaded(mbody.Damper("d", "ground.Q", "coupler.P", coefficient=3.0)),
    "twist": loaded(mbody.TorsionSpring("s", "rocker", stiffness=9.0, free_angle=0.4)),
    "torque": loaded(mbody.Torque("t", "rocker", by="coupler", value=7.0)),
    "force": loaded(mbody.Force("f", "coupler.P", 11.0, angle=0.7, follows=True)),
}
