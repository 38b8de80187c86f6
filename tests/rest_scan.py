"""Rest positions of random linkages against independent scans of their potential energy.

    python -m tests.rest_scan --count 2000                 # four-bars, one freedom
    python -m tests.rest_scan --count 500 --freedom 2      # linkages of two freedoms

A linkage is described twice: as a model, whose rest positions `equilibrium` finds, and by closed
forms, whose potential energy V is scanned. Along the closed curve of a four-bar's positions every
change of sign of V' on a grid of 20 000 places is bisected; over two coordinates Newton's method
begins at every place of a grid.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody import SolveError, equilibrium
from tests.support.rest_linkages import FAMILIES, Linkage

Array = np.ndarray

#: Places along a closed curve, and along each of two coordinates.
FINE, COARSE = 20_000, 48
#: Parts of a cell of the grid along each coordinate where a spring is short, twice.
FINER = 5
#: Rest positions nearer than this [rad] or, of a double root, the root of what is left, are one.
SAME = 1e-5
#: A V'' or least eigenvalue below this part of the greatest is near a double root, whose place is
#: known to half the digits, and whose number of rests is a matter of rounding.
FLAT = 1e-7
#: A step of Newton's method [rad] after which further ones are rounding.
STILL = 1e-12
#: Linkages between two lines of progress.
EVERY = 25


# -- scans -----------------------------------------------------------------------------------------


def scan_curve(made: Linkage) -> tuple[list[float], bool]:
    """Places along the closed curve where V' = 0, and whether some are nearly double."""
    u = np.linspace(0.0, 2.0 * math.pi, FINE + 1)[:-1] + 1e-4 * math.sqrt(2.0)
    slope = made.slopes(u)[0]
    top = float(np.abs(slope).max())
    onward = np.roll(slope, -1)
    changes = np.flatnonzero(slope * onward <= 0.0)
    low, high, first = u[changes], u[changes] + 2.0 * math.pi / FINE, slope[changes]
    for _ in range(60):
        middle = 0.5 * (low + high)
        beyond = made.slopes(middle)[0] * first > 0.0
        low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
    found = (0.5 * (low + high)).tolist()
    # a touch between two places of the grid shows as a least |V'| that the parabola takes to zero
    before = np.roll(slope, 1)
    dips = (np.abs(slope) < np.abs(before)) & (np.abs(slope) < np.abs(onward))
    dips &= (slope * before > 0.0) & (slope * onward > 0.0)
    near = bool((np.abs(slope[dips]) < 1e-6 * top).any())
    return found, near


def _beside_short_springs(
    made: Linkage, u: Array, v: Array, cell: tuple[float, float]
) -> tuple[Array, Array]:
    """The places, and finer ones where a spring is short: there its direction changes quickly, and
    rest positions may be as near to each other as it is long.
    """
    size = max(math.hypot(*place) for _, place in made.weights.values())
    size = max([size, *(math.hypot(*end[1:]) for pair in made.springs for end in pair[:2])])
    parts = (np.arange(FINER) + 0.5) / FINER - 0.5
    a, b = (part.ravel() for part in np.meshgrid(parts, parts, indexing="ij"))
    us, vs, fine_u, fine_v = [u], [v], u, v
    for level in range(1, 3):
        lengths = made.lengths(fine_u, fine_v)
        reach = 2.0 * size * math.hypot(*cell) / FINER ** (level - 1)
        short = (lengths.min(axis=0) < reach) if len(lengths) else np.zeros(len(fine_u), bool)
        step = 1.0 / FINER ** (level - 1)
        fine_u = (fine_u[short][:, None] + step * cell[0] * a).ravel()
        fine_v = (fine_v[short][:, None] + step * cell[1] * b).ravel()
        us.append(fine_u)
        vs.append(fine_v)
    return np.concatenate(us), np.concatenate(vs)


def scan_surface(made: Linkage) -> tuple[list[tuple[float, ...]], bool]:
    """Coordinates where ∇V = 0, by Newton's method from every place of a grid."""
    side = np.linspace(0.0, 2.0 * math.pi, COARSE + 1)[:-1] + 0.0123
    first = np.linspace(-16.0, 16.0, 2 * COARSE) if made.slides else side
    u, v = (part.ravel() for part in np.meshgrid(first, side, indexing="ij"))
    u, v = _beside_short_springs(made, u, v, (first[1] - first[0], side[1] - side[0]))
    found: list[tuple[float, ...]] = []
    near = False
    ended: list[Array] = []
    for _ in range(25):
        r, H = made.slopes(u, v), made.curvature(u, v)
        det = H[0, 0] * H[1, 1] - H[0, 1] ** 2
        with np.errstate(all="ignore"):
            du = (H[1, 1] * r[0] - H[0, 1] * r[1]) / det
            dv = (H[0, 0] * r[1] - H[0, 1] * r[0]) / det
            step = np.hypot(du, dv)
            part = np.minimum(1.0, 0.3 / step)
        good = np.isfinite(du * part) & np.isfinite(dv * part)
        moved = np.array([u - part * du, v - part * dv])
        ended.append(moved[:, good & (step < STILL)])
        u, v = moved[:, good & ~(step < STILL)]
    u, v = np.concatenate([*ended, [u, v]], axis=1)
    r, H = made.slopes(u, v), made.curvature(u, v)
    settled = np.hypot(*r) < 1e-8 * np.abs(H).max(axis=(0, 1))
    ends = np.column_stack([u, v])[settled]
    alike = np.column_stack([u if made.slides else np.exp(1j * u), np.exp(1j * v)])[settled]
    for n in np.unique(np.round(alike, 6), axis=0, return_index=True)[1]:
        key = made.angles(*ends[n])
        if not any(apart(key, made.angles(*other)) < SAME for other in found):
            found.append((float(ends[n, 0]), float(ends[n, 1])))
    for one in found:
        H = made.curvature(*(np.array([x]) for x in one))[:, :, 0]
        sizes = np.abs(np.linalg.eigvalsh(H))
        near |= bool(sizes.min() < FLAT * sizes.max())
    return found, near


def apart(one: dict[str, float], other: dict[str, float]) -> float:
    """The greatest difference of two positions, whole turns left out."""
    return max(
        abs(one[k] - other[k])
        if k.endswith(".x")
        else abs(math.remainder(one[k] - other[k], 2 * math.pi))
        for k in one
    )


# -- the comparison --------------------------------------------------------------------------------


@dataclass
class Verdict:
    """What one linkage showed."""

    seed: int
    family: str
    truth: int = 0
    found: int = 0
    missing: int = 0
    extra: int = 0
    near: bool = False
    noted: bool = False
    error: str = ""
    seconds: float = 0.0


def judge(seed: int, freedom: int) -> Verdict:
    """Compare one random linkage with its scan."""
    families = FAMILIES[freedom]
    n = seed % len(families)
    made = families[n](np.random.default_rng([freedom, seed]))
    name = made.machine.name
    scanned = scan_curve(made) if freedom == 1 else scan_surface(made)
    truth = [made.angles(*np.atleast_1d(one)) for one in scanned[0]]
    begin = time.process_time()
    verdict = Verdict(seed, name, truth=len(truth), near=scanned[1])
    try:
        rests = equilibrium(made.machine)
    except SolveError as error:
        verdict.error = str(error)
        verdict.missing = len(truth)
        return verdict
    verdict.seconds = time.process_time() - begin
    verdict.found = len(rests)
    verdict.noted = bool(getattr(rests, "doubts", ()))
    mine = []
    for one in rests:
        key = {body.name: float(one[body.name].angle[0]) for body in made.machine.bodies}
        for body in made.machine.bodies:  # the link's own axes, not the mass centre
            cx, cy = body.cg
            c, s = math.cos(key[body.name]), math.sin(key[body.name])
            key[f"{body.name}.x"] = float(one[body.name].x[0]) - c * cx + s * cy
        mine.append(key)
    free = list(range(len(mine)))
    for one in truth:
        hits = [k for k in free if apart(one, mine[k]) < 1e-4]
        if hits:
            free.remove(hits[0])
        else:
            verdict.missing += 1
    verdict.extra = len(free)
    return verdict


def run(seeds: Sequence[int], freedom: int) -> list[Verdict]:
    """Compare many; how far it came goes to the standard error."""
    found: list[Verdict] = []
    for seed in seeds:
        found.append(judge(seed, freedom))
        if len(found) % EVERY == 0:
            wrong = [v.seed for v in found if (v.missing or v.extra) and not v.near]
            noted = sum(v.noted for v in found)
            print(
                f"{len(found)} of {len(seeds)}: {len(wrong)} disagree {wrong[-10:]}, {noted} noted",
                file=sys.stderr,
                flush=True,
            )
    return found


def summary(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """Counts of a campaign; linkages beside a double root are counted by themselves."""
    clear = [v for v in verdicts if not v.near]
    wrong = [v for v in clear if v.missing or v.extra]
    seconds = [v.seconds for v in clear]
    return {
        "linkages": len(verdicts),
        "beside a double root": len(verdicts) - len(clear),
        "agreed": len(clear) - len(wrong),
        "missing": sum(v.missing > 0 for v in clear),
        "missing and silent": sum(v.missing > 0 and not v.noted and not v.error for v in clear),
        "extra": sum(v.extra > 0 for v in clear),
        "refused": sum(bool(v.error) for v in clear),
        "noted": sum(v.noted for v in clear),
        "rest positions": sum(v.truth for v in clear),
        "seconds each": round(float(np.mean(seconds)), 4) if seconds else 0.0,
        "seconds at most": round(float(np.max(seconds)), 3) if seconds else 0.0,
        "seeds": [v.seed for v in wrong][:40],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--freedom", type=int, choices=(1, 2), default=1)
    asked = parser.parse_args()
    verdicts = run(range(asked.first, asked.first + asked.count), asked.freedom)
    print(json.dumps(summary(verdicts), indent=1))


if __name__ == "__main__":
    main()
