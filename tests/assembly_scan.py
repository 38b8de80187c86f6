"""Assembly modes of random linkages against Newton's method from many random poses.

    python -m tests.assembly_scan --count 200             # some 40 minutes
    python -m tests.assembly_scan --count 20 --first 7 --starts 400

Pins, slides, slots, rods, gears and redundant rows, up to three loops in one group, take turns.
Newton's method (`tests.support.assembly_cases.Exhaustive`) has equations of its own; where it finds
fewer modes than are proven it goes on from more poses. A mode that it finds and the search does not
is a wrong certificate. Beside every dead centre that is certified the modes are counted again,
1e-9 rad before and beyond it.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

import mbody
from mbody import AngleDriver, Body, Marker, Mechanism, Prismatic, Revolute
from tests.support.assembly_cases import (
    CHAINS,
    Exhaustive,
    geared,
    redundant,
    slider_sixbar,
    slotted,
    structure,
)

__all__ = ["KINDS", "Compared", "compare"]

#: Random poses at first, and at most, where fewer modes are found than are proven.
STARTS, MOST = 300, 9600
#: From a dead centre [rad].
BESIDE = 1e-9
#: A mode that is none: what its equations may leave, relative to the model length.
CLOSED = 1e-12


def sliding(kind: str, count: int) -> Callable[[int], Mechanism]:
    """Structures of a chain in which slides take the place of `count` pins."""

    def made(seed: int) -> Mechanism:
        rng = np.random.default_rng([seed, count])
        pinned = structure(*CHAINS[kind], seed)
        joints = list(pinned.joints)
        chosen = {joints[k].name for k in rng.permutation(len(joints))[:count]}
        angles = {"ground": 0.0} | {body.name: body.guess.angle for body in pinned.bodies}
        machine = Mechanism("slides", ground=dict(pinned.ground.points))
        machine.add(*pinned.bodies)
        for joint in joints:
            if joint.name not in chosen:
                machine.add(joint)
                continue
            line = float(rng.uniform(-3.0, 3.0))
            i, j = (
                Marker(side.body, side.point, angle=line - angles[side.body])
                for side in (joint.i, joint.j)
            )
            machine.add(Prismatic(joint.name, i, j))
        return machine

    return made


def watt(seed: int) -> Mechanism:
    """Two four-bars in series, a ternary link between them."""
    r = np.random.default_rng(seed).uniform
    machine = Mechanism("Watt", ground={"O2": (0, 0), "O4": (float(r(2, 4)), 0), "O6": (6, 0)})
    machine.add(
        Body("crank", points={"A": (float(r(0.5, 2)), 0)}),
        Body("coupler", points={"B": (float(r(2, 4)), 0)}),
        Body("rocker", points={"B": (float(r(1, 3)), 0), "C": (float(r(1, 2)), float(r(-2, 2)))}),
        Body("rod", points={"D": (float(r(1.5, 4)), 0)}),
        Body("output", points={"D": (float(r(1, 3)), 0)}),
        Revolute("O2", "ground.O2", "crank"),
        Revolute("A", "crank.A", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker"),
        Revolute("C", "rocker.C", "rod"),
        Revolute("D", "rod.D", "output.D"),
        Revolute("O6", "ground.O6", "output"),
        AngleDriver("motor", "crank", float(r(-3, 3))),
    )
    return machine


def stephenson(seed: int) -> Mechanism:
    """Stephenson III driven at the dyad's side: the other links are one group of two loops."""
    r = np.random.default_rng(seed).uniform
    machine = Mechanism(
        "Stephenson", ground={"O2": (0, 0), "O4": (float(r(2, 4)), 0), "O6": (0, 3)}
    )
    machine.add(
        Body("first", points={"A": (float(r(0.5, 2)), 0)}),
        Body("coupler", points={"B": (float(r(2, 4)), 0), "P": (float(r(0, 3)), float(r(-2, 2)))}),
        Body("rocker", points={"B": (float(r(1, 3)), 0)}),
        Body("rod", points={"P": (float(r(1.5, 4)), 0)}),
        Body("crank", points={"Q": (float(r(0.5, 2)), 0)}),
        Revolute("O2", "ground.O2", "first"),
        Revolute("A", "first.A", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker"),
        Revolute("P", "coupler.P", "rod.P"),
        Revolute("Q", "crank.Q", "rod"),
        Revolute("O6", "ground.O6", "crank"),
        AngleDriver("motor", "crank", float(r(-3, 3))),
    )
    return machine


def block_on_link(seed: int) -> Mechanism:
    """A crank whose block slides along a rocker, and a rod from the rocker to a slider."""
    r = np.random.default_rng(seed).uniform
    machine = Mechanism("block on a link", ground={"O2": (0, float(r(1, 3))), "O4": (0, 0)})
    machine.add(
        Body("crank", points={"A": (float(r(0.5, 2)), 0)}),
        Body("block"),
        Body("rocker", points={"C": (float(r(1, 4)), float(r(-1, 1)))}),
        Body("rod", points={"D": (float(r(1, 4)), 0)}),
        Body("slider"),
        Revolute("O2", "ground.O2", "crank"),
        Revolute("A", "crank.A", "block"),
        Prismatic("slide", Marker("rocker", (0.0, float(r(-0.5, 0.5))), 0.0), "block"),
        Revolute("O4", "ground.O4", "rocker"),
        Revolute("C", "rocker.C", "rod"),
        Revolute("D", "rod.D", "slider"),
        Prismatic("guide", Marker("ground", (0.0, float(r(2, 4))), 0.0), "slider"),
        AngleDriver("motor", "crank", float(r(-3, 3))),
    )
    return machine


#: Of every kind how a linkage is made from a seed.
KINDS: dict[str, Callable[[int], Mechanism]] = {
    "triad": lambda seed: structure(*CHAINS["triad"], seed),
    "serial tetrad": lambda seed: structure(*CHAINS["tetrad serial"], seed),
    "quaternary tetrad": lambda seed: structure(*CHAINS["tetrad quaternary"], seed),
    "triad with a slide": sliding("triad", 1),
    "triad with two slides": sliding("triad", 2),
    "serial tetrad with a slide": sliding("tetrad serial", 1),
    "quaternary tetrad with a slide": sliding("tetrad quaternary", 1),
    "slot": slotted,
    "slider six-bar": slider_sixbar,
    "Watt's six-bar": watt,
    "Stephenson's six-bar": stephenson,
    "block on a link": block_on_link,
    "gears": geared,
    "redundant rows": redundant,
}


class Compared:
    """What was found of one linkage.

    Attributes
    ----------
    found, exhaustive : int
        Modes of the search, and of Newton's method.
    complete : bool
    boxes : int
    seconds : float
        Processor time of the search.
    wrong : list of str
        Sentences; empty where the search is right.
    dead : int
        Dead centres beside which modes were counted.
    """

    def __init__(self, machine: Mechanism, starts: int = STARTS, most: int = MOST) -> None:
        self.wrong: list[str] = []
        begun = time.process_time()
        modes = mbody.assembly_modes(machine)
        self.seconds = time.process_time() - begun
        self.found, self.complete, self.boxes = len(modes), modes.complete, modes.boxes
        worst = max((mode.residual for mode in modes), default=0.0)
        if worst > CLOSED:
            self.wrong.append(f"a mode is open by {worst:.1e}")
        other, self.exhaustive = Exhaustive(machine), 0
        while True:
            self.exhaustive = max(self.exhaustive, other.count(starts, seed=starts))
            if self.exhaustive >= self.found or 4 * starts > most:
                break
            starts *= 4
        if self.exhaustive > self.found:
            proven = "proven" if self.complete else "not proven"
            self.wrong.append(f"{self.found} modes, {proven}, of {self.exhaustive}")
        self.dead = self._beside_dead_centres(machine) if machine.drivers else 0

    def _beside_dead_centres(self, machine: Mechanism) -> int:
        found = mbody.dead_centres(machine)
        (driver,) = machine.drivers
        if not found.complete:
            return 0
        values = found.values
        for value in values.tolist():
            if _apart(value, values) < 100.0 * BESIDE:
                continue
            sides = [
                mbody.assembly_modes(machine, {driver.name: value + away})
                for away in (-BESIDE, BESIDE)
            ]
            counts = [len(modes) for modes in sides]
            if not all(modes.complete for modes in sides):
                self.wrong.append(f"not proven 1e-9 rad beside {math.degrees(value):.6f} deg")
            elif counts[0] == counts[1] or (counts[0] - counts[1]) % 2:
                self.wrong.append(f"{counts[0]} and {counts[1]} at {math.degrees(value):.6f} deg")
        return len(values)


def _apart(value: float, values: np.ndarray) -> float:
    others = values[values != value] - value
    turned = np.abs(np.angle(np.exp(1j * others)))
    return float(turned.min(initial=math.pi))


def compare(kind: str, seed: int, starts: int = STARTS, most: int = MOST) -> Compared:
    """A linkage of a kind by both routes."""
    return Compared(KINDS[kind](seed), starts, most)


def main(words: Sequence[str] | None = None) -> int:
    """Compare; 1 where the search is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("--most", type=int, default=MOST)
    args = parser.parse_args(words)
    names = list(KINDS)
    totals = {"linkages": 0, "modes": 0, "complete": 0, "wrong": 0, "fewer": 0, "dead": 0}
    costs = []
    for n in range(args.count):
        kind, seed = names[n % len(names)], args.first + n // len(names)
        one = compare(kind, seed, args.starts, args.most)
        totals["linkages"] += 1
        totals["modes"] += one.found
        totals["complete"] += one.complete
        totals["wrong"] += bool(one.wrong)
        totals["fewer"] += one.exhaustive < one.found
        totals["dead"] += one.dead
        costs.append(one.seconds)
        note = "; ".join(one.wrong) or ("" if one.complete else "not complete")
        if one.exhaustive < one.found:
            note = f"{note} (Newton's method found {one.exhaustive})".strip()
        print(
            f"{kind:32} {seed:5}  {one.found:3} modes {one.boxes:6} boxes "
            f"{one.seconds:7.3f} s {one.dead:3} dead centres  {note}",
            flush=True,
        )
    totals |= {"median_s": float(np.median(costs)), "greatest_s": float(np.max(costs))}  # type: ignore[dict-item]
    print(json.dumps(totals))
    return int(totals["wrong"] > 0)


if __name__ == "__main__":
    sys.exit(main())
