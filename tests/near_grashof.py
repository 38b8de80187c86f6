"""Random linkages that come near another branch, against their closed forms: `python -m` this.

A crank drives dyads (two links and the pin between them), one after the other: four-, six- and
eight-bars. The pin of a dyad lies where two circles meet, on one side or on the other for good, so
that every instant has a closed form. One dyad, or two alike that would flip together, is stretched
or folded at some angle of the crank but for a margin of 1e-8 … 1e-2 of the crank's length. Each
motion is followed through a whole turn, alone and in batches on lanes, and every body's angle is
compared: a dyad nearer to the other side than to its own has left its branch.
"""

from __future__ import annotations

import argparse
import functools
import math
import sys
import time
import warnings
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

import mbody
from mbody import AngleDriver, Body, Mechanism, Revolute, SolveError
from mbody.laws import ConstantSpeed
from mbody.system.system import System

INSTANTS = (5, 13, 37, 361)
SPEED = 2.0
MARGINS = (-8.0, -2.0)
#: Angles by which the closed forms are looked at for their extremes.
TURN = np.linspace(0.0, 2.0 * math.pi, 1441)

#: Dyads of each topology: where they hang, (body, point) twice. With "alike" the second is as the
#: first; "twin" is a second rod beside the first coupler, which makes a row redundant.
TOPOLOGIES: dict[str, list[tuple[str, str]]] = {
    "four-bar": [("crank.A", "ground.Q1")],
    "six-bar on the coupler": [("crank.A", "ground.Q1"), ("b1.C", "ground.Q2")],
    "six-bar on the rocker": [("crank.A", "ground.Q1"), ("r1.C", "ground.Q2")],
    "six-bar of two on the crank": [("crank.A", "ground.Q1"), ("crank.A", "ground.Q2")],
    "six-bar alike": [("crank.A", "ground.Q1"), ("crank.A", "ground.Q2")],
    "eight-bar on couplers": [
        ("crank.A", "ground.Q1"),
        ("b1.C", "ground.Q2"),
        ("b2.C", "ground.Q3"),
    ],
    "eight-bar on rockers": [
        ("crank.A", "ground.Q1"),
        ("r1.C", "ground.Q2"),
        ("r2.C", "ground.Q3"),
    ],
    "eight-bar alike": [("crank.A", "ground.Q1"), ("crank.A", "ground.Q2"), ("r1.C", "ground.Q3")],
    "four-bar, twin": [("crank.A", "ground.Q1")],
    "six-bar on the rocker, twin": [("crank.A", "ground.Q1"), ("r1.C", "ground.Q2")],
}


@functools.cache
def system_of(topology: str) -> System:
    """The topology with numbers that are to be replaced."""
    dyads = TOPOLOGIES[topology]
    ground = {"O": (0.0, 0.0)} | {f"Q{n + 1}": (1.0 + n, 0.5) for n in range(len(dyads))}
    made = Mechanism(topology, ground=ground)
    made.add(Body("crank", points={"A": (1.0, 0.0)}, guess=0.0))
    made.add(Revolute("O", "ground.O", "crank"))
    for n, (one, other) in enumerate(dyads, 1):
        for name in (f"b{n}", f"r{n}"):
            made.add(Body(name, points={"J": (1.0, 0.0), "C": (0.5, 0.5)}, guess=0.0))
        made.add(Revolute(f"P{n}", one, f"b{n}"), Revolute(f"R{n}", other, f"r{n}"))
        made.add(Revolute(f"J{n}", f"b{n}.J", f"r{n}.J"))
    if topology.endswith("twin"):
        made.add(Body("twin", points={"J": (1.0, 0.0)}, guess=0.0))
        made.add(Revolute("T1", "crank.A", "twin"), Revolute("T2", "twin.J", "r1.J"))
    made.add(AngleDriver("motor", "crank", ConstantSpeed(0.0, SPEED)))
    return mbody.assemble(made)


@dataclass
class Dyad:
    """Two links: lengths, side, and the points C on each of them."""

    lengths: tuple[float, float]
    side: int
    points: tuple[complex, complex]


@dataclass
class Linkage:
    """Numbers of one linkage; places are complex numbers."""

    topology: str
    start: float
    margin: float
    ground: list[complex] = field(default_factory=list)
    dyads: list[Dyad] = field(default_factory=list)
    near: int = 0

    def places(self, angle: np.ndarray, flipped: int | None = None) -> dict[str, np.ndarray]:
        """Angle and place of C of all links at angles of the crank, `flipped` on its other side."""
        found = {"crank": angle, "crank.A": np.exp(1j * angle)}
        for n, (dyad, (one, _)) in enumerate(
            zip(self.dyads, TOPOLOGIES[self.topology], strict=False)
        ):
            p, r = found[one], self.ground[n]
            b, c = dyad.lengths
            apart = np.abs(r - p)
            side = dyad.side * (-1 if flipped == n else 1)
            cosine = (b * b + apart**2 - c * c) / (2.0 * b * apart)
            first = np.angle(r - p) + side * np.arccos(np.clip(cosine, -1.0, 1.0))
            pin = p + b * np.exp(1j * first)
            second = np.angle(pin - r)
            found |= {f"b{n + 1}": first, f"r{n + 1}": second}
            found[f"b{n + 1}.C"] = p + dyad.points[0] * np.exp(1j * first)
            found[f"r{n + 1}.C"] = r + dyad.points[1] * np.exp(1j * second)
        return found

    def values(self) -> dict[str, float]:
        """By name, as the system takes them."""
        told = {"motor.law.value": self.start}
        for n, (place, dyad) in enumerate(zip(self.ground, self.dyads, strict=True), 1):
            told |= {f"ground.Q{n}.x": place.real, f"ground.Q{n}.y": place.imag}
            for name, length, point in zip("br", dyad.lengths, dyad.points, strict=True):
                told[f"{name}{n}.J.x"] = length
                told |= {f"{name}{n}.C.x": point.real, f"{name}{n}.C.y": point.imag}
        if self.topology.endswith("twin"):
            told["twin.J.x"] = self.dyads[0].lengths[0]
        return told

    def guess(self) -> dict[str, float]:
        """Angles at the start."""
        at = self.places(np.array([self.start]))
        found = {name: float(at[name][0]) for name in at if "." not in name}
        if self.topology.endswith("twin"):
            found["twin"] = found["b1"]
        return found


def _lengths(
    rng: np.random.Generator, least: float, most: float, margin: float | None
) -> tuple[float, float]:
    """Lengths of a dyad whose ends come as near as `least` and as far as `most`: stretched or
    folded there but for the margin, or comfortable.
    """
    room = rng.uniform(0.15, 0.6)
    if margin is None or rng.random() < 0.5:
        whole = most + margin if margin is not None else most * (1.0 + room)
        differ = least * rng.uniform(-0.8, 0.8)
    else:
        differ = (least - margin) * rng.choice([-1.0, 1.0])
        whole = most * (1.0 + room)
    return 0.5 * (whole + differ), 0.5 * (whole - differ)


def linkage(rng: np.random.Generator, topology: str, margin: float) -> Linkage:
    """A random one whose crank turns all the way round, near another branch but for the margin."""
    dyads = TOPOLOGIES[topology]
    alike = topology.endswith("alike")
    while True:
        made = Linkage(topology, rng.uniform(0.0, 2.0 * math.pi), margin)
        near = made.near = 0 if alike else int(rng.integers(len(dyads)))
        around = TURN
        for n, (one, _) in enumerate(dyads):
            if alike and n == 1:
                made.ground.append(made.ground[0])
                made.dyads.append(made.dyads[0])
                continue
            first = one == "crank.A"
            place = complex(*rng.uniform(-3.0, 3.0, 2))
            ends = np.exp(1j * around) if first else made.places(around)[one]
            apart = np.abs(place - ends)
            if apart.min() < 0.3:
                break
            least, most = float(apart.min()), float(apart.max())
            if first:
                least, most = abs(abs(place) - 1.0), abs(place) + 1.0
            elif n == near:
                least, most = _extremes(made, one, place, around, apart)
            lengths = _lengths(rng, least, most, margin if n == near else None)
            if min(lengths) < 0.1:
                break
            points = rng.uniform(0.2, 1.5, (2, 2)) @ np.array([1.0, 1j])
            made.ground.append(place)
            made.dyads.append(Dyad(lengths, int(rng.choice([-1, 1])), tuple(points.tolist())))
            # close to where this one bends sharply it is looked at closely
            if n == near:
                span = np.abs(place - (np.exp(1j * TURN) if first else made.places(TURN)[one]))
                for at in (TURN[span.argmin()], TURN[span.argmax()]):
                    steps = np.concatenate([[0.0], np.geomspace(1e-7, 0.01, 200)])
                    around = np.concatenate([around, at + steps, at - steps])
        else:
            return made


def _extremes(
    made: Linkage, one: str, place: complex, around: np.ndarray, apart: np.ndarray
) -> tuple[float, float]:
    """Least and greatest distance of a point of a link, by ternary search about the coarse ones."""

    def at(angle: float) -> float:
        return float(np.abs(place - made.places(np.array([angle]))[one])[0])

    found = []
    for sign, n in ((1.0, int(apart.argmin())), (-1.0, int(apart.argmax()))):
        low, high = around[n] - 0.005, around[n] + 0.005
        for _ in range(60):
            a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
            if sign * at(a) < sign * at(b):
                high = b
            else:
                low = a
        found.append(at(0.5 * (low + high)))
    return found[0], found[1]


def left_at(made: Linkage, angles: dict[str, np.ndarray]) -> np.ndarray | None:
    """Instants at which a link is elsewhere than its closed form says, None where there is none.

    The other side of a dyad is no nearer than twice its way from being stretched; a quarter of that
    way, and 1e-7 for what rounding makes there, is the tolerance.
    """
    own = made.places(angles["crank"])
    bad = np.zeros(len(angles["crank"]), dtype=bool)
    for n in range(len(made.dyads)):
        other = made.places(angles["crank"], flipped=n)
        for name in (f"b{n + 1}", f"r{n + 1}"):
            apart = np.abs(np.exp(1j * own[name]) - np.exp(1j * other[name]))
            off = np.abs(np.exp(1j * angles[name]) - np.exp(1j * own[name]))
            bad |= ~(off <= np.minimum(0.25 * apart + 1e-7, 1e-4))
    return np.flatnonzero(bad) if bad.any() else None


def _said(run: mbody.Solution) -> bool:
    """Whether the result reports that its branch is in doubt, is not that of the first design, or
    that it passed a change point.
    """
    told = ("change point", "another branch")
    return bool(run.doubts) or any(part in note for note in run.notes for part in told)


def alone(made: Linkage, instants: int, told=False) -> str:
    """How one linkage fares by itself: "followed", "said", "refused", or "LEFT"."""
    system = system_of(made.topology).with_values(made.values())
    try:
        run = mbody.kinematics(system, turn="motor", instants=instants, guess=made.guess())
    except SolveError as error:
        return f"refused ({error})" if told else "refused"
    left = left_at(made, {name: run[name].angle for name in made.guess() if name != "twin"})
    if left is None:
        return "said" if _said(run) else "followed"
    return "said" if _said(run) else "LEFT"


def together(
    rng: np.random.Generator, first: Linkage, count: int, instants: int, told=False
) -> list[str]:
    """How designs beside a linkage fare as a batch: other margins, lengths by 0.05 %."""
    several = [first]
    while len(several) < count:
        several.append(_beside(rng, first))
    found = batch_of(several, instants, told)
    if told:
        for n, outcome in enumerate(found):
            if outcome != "followed":
                print(f"{outcome}: design {n} of {count}, {instants} instants, {several[n]}")
    return found


def batch_of(several: list[Linkage], instants: int, told=False) -> list[str]:
    """How linkages of one topology fare as a batch."""
    own = [made.values() for made in several]
    values = {name: np.array([one[name] for one in own]) for name in own[0]}
    system = system_of(several[0].topology).with_values(values)
    times = np.linspace(0.0, 2.0 * math.pi / SPEED, instants)
    try:
        run = mbody.kinematics(system, times, guess=several[0].guess())
    except SolveError as error:
        return [f"refused ({error})" if told else "refused"] * len(several)
    names = [name for name in several[0].guess() if name != "twin"]
    angles = {name: run[name].angle for name in names}
    found = []
    for n, made in enumerate(several):
        left = left_at(made, {name: angles[name][n] for name in names})
        found.append("followed" if left is None else "said" if _said(run) else "LEFT")
    return found


def _beside(rng: np.random.Generator, first: Linkage) -> Linkage:
    """The same linkage, but for the links of the near dyad: longer by up to 0.05 % they are farther
    from being stretched, and as far from being folded.
    """
    made = Linkage(first.topology, first.start, first.margin, first.ground, near=first.near)
    for n, dyad in enumerate(first.dyads):
        alike = first.topology.endswith("alike") and n == 1
        longer = rng.uniform(0.0, 5e-4) if n == first.near or alike else 0.0
        b, c = dyad.lengths
        lengths = (b + longer * min(b, c), c + longer * min(b, c))
        made.dyads.append(Dyad(lengths, dyad.side, dyad.points))
    return made


def campaign(count: int, seed: int, batch: int = 16, told: bool = False) -> Counter[str]:
    """Outcomes by "topology, instants, alone or together: outcome" of so many linkages."""
    rng = np.random.default_rng(seed)
    found: Counter[str] = Counter()
    names = list(TOPOLOGIES)
    begun = time.time()
    for n in range(count):
        margin = 10.0 ** rng.uniform(*MARGINS)
        made = linkage(rng, names[n % len(names)], margin)
        for instants in INSTANTS:
            outcome = alone(made, instants, told)
            found[f"{made.topology}, {instants}, alone: {outcome}"] += 1
            if told and outcome != "followed":
                print(f"{outcome}: seed {seed}, linkage {n}, {instants} instants, {made}")
            if n % batch < len(names):
                several = together(rng, made, batch, instants, told)
                for outcome in several:
                    found[f"{made.topology}, {instants}, together: {outcome}"] += 1
                if told and set(several) != {"followed"}:
                    print(f"seed {seed}, linkage {n}, {instants} instants, beside {made}")
        if told and n % 500 == 499:
            print(f"{n + 1} linkages, {time.time() - begun:.0f} s")
    return found


def totals(found: Counter[str]) -> Counter[str]:
    """The outcomes alone."""
    whole: Counter[str] = Counter()
    for name, count in found.items():
        whole[name.split(": ")[1].split(" (")[0]] += count
    return whole


def main() -> int:
    """Print all outcomes; 1 where a linkage left its branch unsaid, or too few were followed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    found = campaign(asked.count, asked.seed, told=True)
    for name in sorted(found):
        print(f"{found[name]:8d}  {name}")
    whole = totals(found)
    print(dict(whole))
    return 1 if whole["LEFT"] or whole["followed"] < 0.999 * whole.total() else 0


if __name__ == "__main__":
    sys.exit(main())
