"""Mechanisms of any size: chains, ladders, trees and hubs of equal rods; and an eight-bar."""

from __future__ import annotations

import math
from collections.abc import Callable

import mbody
from mbody import AngleDriver, Body, Gravity, Marker, Mechanism, Revolute, Torque
from mbody.laws import ConstantSpeed

__all__ = ["LENGTH", "MASS", "SHAPES", "chain", "eight_bar", "hub", "ladder", "tree"]

LENGTH, MASS, G = 0.1, 0.1, 9.81  # m, kg, m/s²


def rod(name: str, angle: float) -> Body:
    """A uniform rod from its end A, roughly at an angle."""
    return Body(
        name,
        mass=MASS,
        inertia=MASS * LENGTH**2 / 12.0,
        cg=(0.5 * LENGTH, 0.0),
        points={"A": (0.0, 0.0), "B": (LENGTH, 0.0)},
        guess=angle,
    )


def falling(name: str, bodies: list[Body], pins: list[Revolute]) -> Mechanism:
    """All of them under gravity, released at rest."""
    machine = Mechanism(name)
    machine.add(*bodies, *pins, Gravity("gravity", y=-G))
    return machine


def chain(count: int) -> Mechanism:
    """Rods in a row, released level."""
    ends = ["ground", *(f"b{n}.B" for n in range(count - 1))]
    pins = [Revolute(f"j{n}", end, f"b{n}.A") for n, end in enumerate(ends)]
    return falling(f"chain of {count}", [rod(f"b{n}", 0.0) for n in range(count)], pins)


def ladder(count: int) -> Mechanism:
    """Windows side by side, posts and beams, one loop each; they hang and swing.

    From 60° below the level, so that no singular position is met. An even count has one more rod
    at the last post.
    """
    windows = max(1, (count - 1) // 2)
    lean = math.radians(-60.0)
    posts = [rod(f"c{n}", lean) for n in range(windows + 1)]
    beams = [rod(f"b{n}", 0.0) for n in range(windows)]
    pins = [
        Revolute(f"g{n}", Marker("ground", (LENGTH * n, 0.0)), f"c{n}.A")
        for n in range(windows + 1)
    ]
    for n in range(windows):
        pins.append(Revolute(f"l{n}", f"c{n}.B", f"b{n}.A"))
        pins.append(Revolute(f"r{n}", f"c{n + 1}.B", f"b{n}.B"))
    if len(posts) + len(beams) < count:
        beams.append(rod("tail", lean))
        pins.append(Revolute("t", f"c{windows}.B", "tail.A"))
    return falling(f"ladder of {count}", [*posts, *beams], pins)


def tree(count: int) -> Mechanism:
    """Every rod carries two more at its end; released level."""
    ends = ["ground", *(f"b{(n - 1) // 2}.B" for n in range(1, count))]
    pins = [Revolute(f"j{n}", end, f"b{n}.A") for n, end in enumerate(ends)]
    bodies = [rod(f"b{n}", 0.0 if not n else 0.3 * (-1) ** n) for n in range(count)]
    return falling(f"tree of {count}", bodies, pins)


def hub(count: int) -> Mechanism:
    """Rods on the rim of a disc, in all directions."""
    disc = Body("disc", mass=1.0, inertia=1.0, guess=0.0)
    angles = [2.0 * math.pi * n / count for n in range(count)]
    places = [Marker("disc", mbody.makers.polar(1.0, angle)) for angle in angles]
    pins = [Revolute("O", "ground", "disc")]
    pins += [Revolute(f"j{n}", place, f"b{n}.A") for n, place in enumerate(places)]
    rods = [rod(f"b{n}", angle) for n, angle in enumerate(angles)]
    return falling(f"hub of {count}", [disc, *rods], pins)


#: By name.
SHAPES: dict[str, Callable[[int], Mechanism]] = {
    "chain": chain,
    "ladder": ladder,
    "tree": tree,
    "hub": hub,
}


def eight_bar() -> Mechanism:
    """Three four-bars in series, of which a crank drives the first: eight links, ten pins.

    Links are uniform bars from A to B [m, kg, rough angle in deg]; the crank turns fully, and no
    coupler is nearer than 46° to the line of its rocker.
    """
    ground = {"O2": (0.0, 0.0), "O4": (0.12, 0.0), "O6": (0.26, -0.03), "O8": (0.42, 0.0)}
    machine = Mechanism("eight-bar", ground=ground)
    for name, length, mass, angle, points in (
        ("crank", 0.04, 0.2, 0.0, {}),
        ("coupler", 0.11, 0.3, 40.0, {}),
        ("rocker", 0.08, 0.4, 75.0, {"C": (0.06, -0.03)}),
        ("link", 0.13, 0.3, 0.0, {}),
        ("middle", 0.09, 0.4, 80.0, {"E": (0.07, -0.03)}),
        ("second", 0.14, 0.3, 20.0, {}),
        ("output", 0.10, 0.4, 85.0, {}),
    ):
        guess = math.radians(angle)
        machine.add(mbody.makers.bar(name, length, mass=mass, points=points, guess=guess))
    machine.add(
        Revolute("O2", "ground.O2", "crank.A"),
        Revolute("A", "crank.B", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.A"),
        Revolute("C", "rocker.C", "link.A"),
        Revolute("D", "link.B", "middle.B"),
        Revolute("O6", "ground.O6", "middle.A"),
        Revolute("E", "middle.E", "second.A"),
        Revolute("F", "second.B", "output.B"),
        Revolute("O8", "ground.O8", "output.A"),
        AngleDriver("motor", "crank", ConstantSpeed(0.0, 20.0)),
        Torque("load", "output", value=-2.0),
    )
    return machine
