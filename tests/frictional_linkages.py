"""Random linkages with friction in all joints, against dense equations from many starts.

``python -m tests.frictional_linkages [--count N] [--seed S] [--jobs J]`` prints the counts, and
what disagrees: one to three loops of pins and sliders, with a gear, a cam or a pin in a slot on the
crank, friction
from little to more than moves. At each of three instants

    certified   friction is certain to be unique: the dense equations have this solution alone;
    followed    they have this one, to which the solution without friction can be followed, and
                perhaps others;
    jams        from the solution without friction they cannot be followed to all of it, but to the
                part at which mbody says that it jams.
"""

from __future__ import annotations

import argparse
import collections
import multiprocessing
import sys
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import mbody
from mbody.laws import Harmonic
from tests.support.frictional import dense_at, difference, followed_part, with_changes
from tests.support.linkages import random_linkage, times_within

__all__ = ["PARTS", "Instant", "Linkage", "examined", "frictional_linkage"]

#: Attachments to the crank, the first of them none.
KINDS = ("plain", "gear", "cam", "slot")
COEFFICIENTS = (0.05, 0.2, 0.6, 1.5, 3.0)
#: What rounding may make of forces, and of efforts that were followed.
FORCES, EFFORTS = 1e-10, 1e-8
#: The parts of friction at which both end are found by steps that are halved down to 1e-11 of all
#: of it; the least that occur are some thousandths of it.
PARTS = 1e-8
#: A part of friction above which it is all of it.
WHOLE = 1.0 - PARTS


@dataclass(frozen=True)
class Linkage:
    """A random linkage at three instants, and the coefficient of its friction."""

    seed: int
    kind: str
    mu: float
    run: Any


@dataclass(frozen=True)
class Instant:
    """What was found at an instant, and what disagrees with it: "" where nothing does."""

    seed: int
    kind: str
    found: str
    solutions: int
    wrong: str = ""

    def __str__(self) -> str:
        return f"seed {self.seed}, {self.kind}, {self.found}: {self.wrong}"


def frictional_linkage(seed: int) -> Linkage:
    """That of a seed."""
    rng = np.random.default_rng([seed, 19])
    kind = KINDS[int(rng.integers(len(KINDS)))]
    mu = float(rng.choice(COEFFICIENTS))
    loops, sliders = int(rng.integers(1, 4)), bool(rng.integers(2))
    machine, turn = random_linkage(seed, loops, sliders=sliders)
    attach(machine, kind, rng)
    radius, length = float(rng.choice([0.02, 0.1, 0.3])), float(rng.choice([0.1, 0.5]))
    height = float(rng.choice([0.0, 0.05]))

    def change(element: Any) -> dict[str, Any]:
        if isinstance(element, mbody.Revolute):
            return {"friction": mu, "pin_radius": radius}
        if isinstance(element, mbody.Prismatic):
            return {"friction": mu, "length": length, "height": height or None}
        return {"friction": mu} if isinstance(element, mbody.PinSlot) else {}

    machine = with_changes(machine, change)
    times = times_within(machine, turn, 5)[[0, 2, 4]]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return Linkage(seed, kind, mu, mbody.kinetostatics(machine, times))


def attach(machine: mbody.Mechanism, kind: str, rng: np.random.Generator) -> None:
    """Give the crank, which turns about the origin, a gear, a cam or a pin in a slot, with a load
    on what it drives.
    """
    centre = next(
        marker
        for joint in machine.joints
        for marker in (joint.i, joint.j)
        if joint.name == "J0" and marker.body == "L1"
    )
    mu = float(rng.choice([0.05, 0.15]))
    load = float(rng.uniform(-10.0, 10.0))
    if kind == "gear":
        teeth: dict[str, Any] = {"friction": mu, "pressure_angle": "20 deg"}
        if rng.random() < 0.5:
            teeth = {"efficiency": float(rng.uniform(0.6, 0.95))}
        machine.add(
            mbody.Body("wheel", mass=1.0, inertia=0.1, guess=(-0.9, 0.0, 0.0)),
            mbody.Revolute("W", mbody.Marker("ground", (-0.9, 0.0)), "wheel"),
            mbody.Gear("mesh", centre, "wheel", radius_i=0.6, radius_j=0.3, **teeth),
            mbody.Torque("driven", "wheel", value=load),
        )
    elif kind == "cam":
        up = 0.5 * np.pi
        roller = {"roller": 0.05, "pin_radius": 0.02} if rng.random() < 0.5 else {}
        machine.add(
            mbody.Body("tappet", mass=0.5, inertia=0.01, guess=(0.02, 0.35, 0.0)),
            mbody.Prismatic(
                "T", mbody.Marker("ground", (0.02, 0.0), up), mbody.Marker("tappet", (0.0, 0.0), up)
            ),
            mbody.CamFollower(
                "cam",
                centre,
                "tappet",
                Harmonic(mean=0.05, amplitude=0.05, frequency=1.0, phase=float(rng.uniform(0, 6))),
                base_radius=0.2,
                friction=mu,
                **roller,
            ),
            mbody.Force("driven", "tappet", 10.0 * abs(load), angle=-up),
        )
    elif kind == "slot":
        machine.add(
            mbody.Body("lever", mass=1.0, inertia=0.2, guess=(0.0, -1.5, 0.5 * np.pi)),
            mbody.Revolute("S", mbody.Marker("ground", (0.0, -1.5)), "lever"),
            mbody.PinSlot("slot", "lever", _pin_of(machine, centre)),
            mbody.Torque("driven", "lever", value=load),
        )


def _pin_of(machine: mbody.Mechanism, centre: mbody.Marker) -> mbody.Marker:
    """The other pin of the crank."""
    return next(
        marker
        for joint in machine.joints
        for marker in (joint.i, joint.j)
        if marker.body == "L1" and joint.name != "J0"
    )


def examined(linkage: Linkage, rng: np.random.Generator, starts: int = 12) -> Iterator[Instant]:
    """What is found at each instant, against the dense equations from so many starts."""
    run, jams = linkage.run, {jam.t: jam for jam in linkage.run.friction.jams}
    for k in range(len(run)):
        dense = dense_at(run, k)
        # what is certain to be unique needs fewer of them
        tries = (starts + 1) // 2 if run.friction.certified[k] else starts
        found = dense.solutions(rng, tries)
        jam = jams.get(float(run.t[k]))
        if jam is not None:
            name, wrong = "jams", _jams(linkage, k, found)
        elif run.friction.certified[k]:
            name, wrong = "certified", _certified(run, k, len(found))
        else:
            name, wrong = "followed", _followed(run, k, dense, found)
        yield Instant(linkage.seed, linkage.kind, name, len(found), wrong)


def _certified(run: Any, k: int, count: int) -> str:
    if count != 1:
        return f"{count} solutions"
    off = difference(run, k)
    return "" if off < FORCES else f"forces differ by {off:.1e}"


def _followed(run: Any, k: int, dense: Any, found: list[Any]) -> str:
    row = dense.reference.rows["motor"]
    ours = float(run.effort("motor")[k])
    theirs = [-float(one.lam[row][0]) for one in found]
    allowed = EFFORTS * (abs(ours) + float(np.abs(dense.right).max()))
    if not any(abs(one - ours) <= allowed for one in theirs):
        return f"effort {ours:.9g}, dense {theirs}"
    part = followed_part(run, k)
    return "" if part >= WHOLE else f"dense ends at {part:.6f} of friction"


def _jams(linkage: Linkage, k: int, found: list[Any]) -> str:
    jam = next(one for one in linkage.run.friction.jams if one.t == float(linkage.run.t[k]))
    part, ours = followed_part(linkage.run, k), _part(linkage, jam)
    if abs(part - ours) > PARTS * ours:
        return f"it jams at {ours:.10f} of friction, dense at {part:.10f}"
    return ""


def _part(linkage: Linkage, jam: Any) -> float:
    """The part of friction at which it jams, by the coefficient of the joint that is named."""
    joint: Any = linkage.run.mechanism[jam.joint]
    whole = joint.friction if joint.friction is not None else 1.0 - joint.efficiency
    return float(jam.coefficient / whole)


def _counted(instants: Iterable[Instant]) -> int:
    """Print the counts and what disagrees; how many do."""
    counts: collections.Counter[str] = collections.Counter()
    wrong = []
    for one in instants:
        counts[one.found] += 1
        counts[f"{one.found} ({one.kind})"] += 1
        if one.found != "jams" and one.solutions > 1:
            counts["followed, of several solutions"] += 1
        if one.found == "jams" and one.solutions:
            counts["jams, with solutions apart from the path"] += 1
        if one.wrong:
            wrong.append(str(one))
            print(f"\r{one}", file=sys.stderr)
    for name, count in sorted(counts.items()):
        print(f"{count:6d} {name}")
    print(f"{len(wrong):6d} disagree", *wrong, sep="\n")
    return len(wrong)


def main(arguments: list[str] | None = None) -> int:
    """Examine, print the counts, and exit with 1 where something disagrees."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.frictional_linkages", description=__doc__
    )
    parser.add_argument("--count", type=int, default=1000, help="linkages")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    asked = parser.parse_args(arguments)
    seeds = range(asked.seed, asked.seed + asked.count)

    def every(found: Iterable[list[Instant]]) -> Iterator[Instant]:
        for n, instants in enumerate(found, start=1):
            yield from instants
            print(f"\r{n}", end="", file=sys.stderr)

    if asked.jobs == 1:
        return 1 if _counted(every(map(_of_seed, seeds))) else 0
    with multiprocessing.get_context("spawn").Pool(asked.jobs) as pool:
        return 1 if _counted(every(pool.imap(_of_seed, seeds, chunksize=5))) else 0


def _of_seed(seed: int) -> list[Instant]:
    return list(examined(frictional_linkage(seed), np.random.default_rng(seed)))


if __name__ == "__main__":
    sys.exit(main())
