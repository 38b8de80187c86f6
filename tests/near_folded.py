"""Random four-bars that move freely past another branch: `python -m tests.near_folded --count N`.

The crank is the shortest link and turns fully, but for a margin of 1e-8 … 1e-2 of its length the
dyad of coupler and rocker would be stretched or folded once a turn (near-parallelograms among
them). It then stays on one side of the line from the crank's pin to the rocker's bearing for good,
which is the closed form of a branch. Motions are followed alone, by all methods and tolerances, and
on lanes; one that is on the other side without a doubt has left its branch unsaid.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter

import numpy as np

import mbody
from mbody import Body, Gravity, Mechanism, Revolute, SimulationSettings, SolveError
from mbody.solution.solution import Solution

#: Method, tolerance or step, and how often it is drawn.
WAYS = [
    *[("dop853", rtol) for rtol in (1e-4, 1e-6, 1e-8) for _ in range(3)],
    *[("dopri5", 1e-4), ("dopri5", 1e-6), ("radau5", 1e-4), ("radau5", 1e-6)],
    *[("rattle", 1e-3), ("rattle4", 2e-3), ("generalized-alpha", 1e-3)],
]
EVEN = ("rattle", "rattle4", "generalized-alpha")
UNTIL, INSTANTS = 5.0, 251


def lengths(random: np.random.Generator) -> tuple[float, float, float, float]:
    """Crank, coupler, rocker, ground: s + l < p + q by the margin alone."""
    margin = 10.0 ** random.uniform(-8.0, -2.0)
    longer, other = np.sort(random.uniform(1.1, 4.0, 2))[::-1]
    kind = random.integers(4)
    if kind == 3:  # nearly a parallelogram
        return 1.0 - margin, other, 1.0, other
    # the longest of three is as long as the margin lets it be
    longest = longer + other - 1.0 - margin
    return (1.0, *np.roll([longest, longer, other], kind))


def machine(
    links: tuple[float, float, float, float], side: int, crank: float, speed: float, gravity: bool
) -> Mechanism:
    """A four-bar on the side ±1 of the line AQ, its crank at an angle and a rate to begin with."""
    a, b, c, d = links
    x, y = a * math.cos(crank), a * math.sin(crank)
    reach = math.hypot(d - x, y)
    inner = math.acos(np.clip((b * b + reach * reach - c * c) / (2.0 * b * reach), -1.0, 1.0))
    coupler = math.atan2(-y, d - x) + side * inner
    rocker = math.atan2(y + b * math.sin(coupler), x + b * math.cos(coupler) - d)
    made = Mechanism("near another branch", ground={"O": (0.0, 0.0), "Q": (d, 0.0)})
    for name, length, angle in (
        ("crank", a, crank),
        ("coupler", b, coupler),
        ("rocker", c, rocker),
    ):
        made.add(
            Body(
                name,
                mass=length,
                inertia=length**3 / 12.0,
                cg=(0.5 * length, 0.0),
                points={"B": (length, 0.0)},
                guess=angle,
            )
        )
    made.add(
        Revolute("O", "ground.O", "crank"),
        Revolute("A", "crank.B", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("Q", "ground.Q", "rocker"),
    )
    if gravity:
        made.add(Gravity("gravity", y=-2.0))
    made.simulation = SimulationSettings(UNTIL, start={"crank": {"angle": crank, "omega": speed}})
    return made


def drawn(random: np.random.Generator) -> tuple[Mechanism, int]:
    """A four-bar, and its side."""
    side = int(random.choice([-1, 1]))
    crank = random.uniform(0.5, math.pi - 0.5) * random.choice([-1.0, 1.0])
    speed = random.uniform(3.0, 8.0) * random.choice([-1.0, 1.0])
    made = machine(lengths(random), side, crank, speed, bool(random.integers(2)))
    return made, side


def sides(run: Solution) -> np.ndarray:
    """On which side the dyad is at every instant: of AQ, from A to B (instants,)."""
    a, b, q = run.point("crank.B"), run.point("coupler.B"), run.point("ground.Q")
    return np.sign((q.x - a.x) * (b.y - a.y) - (q.y - a.y) * (b.x - a.x))


def verdict(made: Mechanism, side: int, method: str, fine: float) -> str:
    """How a motion ends: right, right in doubt, left in doubt, LEFT unsaid, or refused."""
    how = {"step": fine} if method in EVEN else {"rtol": fine}
    try:
        run = mbody.simulate(made, method=method, instants=INSTANTS, **how)
    except SolveError:
        return "refused"
    right = bool((sides(run) == side).all())
    if run.doubts:
        return "right, in doubt" if right else "left, in doubt"
    return "right" if right else "LEFT"


def survey(count: int, seed: int, tell: bool = False) -> Counter[tuple[str, str]]:
    """Verdicts by method, of so many motions."""
    random = np.random.default_rng(seed)
    found: Counter[tuple[str, str]] = Counter()
    for n in range(count):
        made, side = drawn(random)
        method, fine = WAYS[int(random.integers(len(WAYS)))]
        how = verdict(made, side, method, fine)
        found[method, how] += 1
        if tell and how != "right":
            print(f"{n}: {method} {fine:g}: {how}", flush=True)
    return found


def main() -> int:
    """Count the verdicts."""
    parser = argparse.ArgumentParser(prog="tests.near_folded", description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    found = survey(given.count, given.seed, tell=True)
    for (method, how), number in sorted(found.items()):
        print(f"{method:18s} {how:16s} {number}")
    left = sum(number for (_, how), number in found.items() if how == "LEFT")
    print(f"{left} of {given.count} left their branch unsaid")
    return 1 if left else 0


if __name__ == "__main__":
    sys.exit(main())
