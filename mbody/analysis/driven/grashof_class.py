"""Grashof's class of four-bar loops, in words."""

from __future__ import annotations

from itertools import combinations

from mbody.model.element import listed
from mbody.system.system import System

__all__ = ["four_bar_loops", "grashof_class", "inversion"]

#: Lengths whose sums differ by less than this part of them are at a change point.
EQUAL = 1e-9


def grashof_class(ground: float, crank: float, coupler: float, rocker: float) -> str:
    """The class of a four-bar by the lengths of its fixed link, its driven link, the coupler and
    the output link.

    Shortest and longest link together shorter than the other two: some link turns all the way round
    (Grashof 1883); which one is fixed decides the inversion.

    >>> grashof_class(3.5, 1, 3, 2)
    'Grashof: crank-rocker'
    >>> grashof_class(8, 6, 18, 12)
    'not Grashof: triple rocker'
    """
    word = inversion(ground, crank, coupler, rocker)
    return f"{'not Grashof' if word == 'triple rocker' else 'Grashof'}: {word}"


def inversion(ground: float, crank: float, coupler: float, rocker: float) -> str:
    """The word of that class alone.

    >>> inversion(4, 1, 3, 3.5), inversion(1, 3, 3, 3.5)
    ('crank-rocker', 'double crank')
    """
    lengths = sorted((ground, crank, coupler, rocker))
    short, long = lengths[0] + lengths[3], lengths[1] + lengths[2]
    if abs(short - long) <= EQUAL * (short + long):
        return "change point"
    if short > long:
        return "triple rocker"
    kinds = {ground: "double crank", coupler: "double rocker", rocker: "rocker-crank"}
    return ({crank: "crank-rocker"} | kinds)[lengths[0]]


def four_bar_loops(system: System) -> list[tuple[str, str]]:
    """Loops of four pins of one design, by their four links, and Grashof's class of each.

    The fixed link is the ground where it is among them, else the first; then the link that a driver
    turns, else the first of the description.
    """
    pins: dict[frozenset[str], list[tuple[str, complex, str, complex]]] = {}
    for joint in system.mechanism.joints:
        if joint.pin:
            ends = [complex(*map(float, system.numbers.place(joint, side))) for side in "ij"]
            entry = joint.i.body, ends[0], joint.j.body, ends[1]
            pins.setdefault(frozenset(joint.bodies), []).append(entry)
    bodies = ["ground", *(body.name for body in system.mechanism.bodies)]
    driven = {driver.bodies[1] for driver in system.drivers}
    order = sorted(bodies[1:], key=lambda name: name not in driven)
    found, seen = [], set()
    for fixed in bodies:
        for first, last in combinations(order, 2):
            for middle in order:
                links = fixed, first, middle, last
                sides = [frozenset((links[k], links[(k + 1) % 4])) for k in range(4)]
                if len(set(links)) < 4 or frozenset(links) in seen:
                    continue
                if not all(side in pins for side in sides):
                    continue
                places = [
                    dict(zip((one[0], one[2]), (one[1], one[3]), strict=True))
                    for one in (pins[side][0] for side in sides)
                ]
                lengths = [abs(places[k][links[k]] - places[k - 1][links[k]]) for k in range(4)]
                if min(lengths) > 0.0:
                    seen.add(frozenset(links))
                    words = grashof_class(lengths[0], lengths[1], lengths[2], lengths[3])
                    found.append((listed(links), words))
    return found
