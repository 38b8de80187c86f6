"""How often intervals of a fit contain the truth: `python -m tests.fit_coverage --trials 10000`.

Each trial draws a slider-crank, crank angles of an encoder over a turn, a linear encoder on the
slider with noise and an unknown zero, and fits crank, rod and zero from a start some per cent away.
Of 95 % intervals 95 % must contain the true numbers: with n trials but for √(0.95·0.05/n).
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import mbody

UNKNOWNS = ("crank.A.x", "rod.B.x", "slider.x offset")
CONFIDENCE = 0.95
INSTANTS = 36


def trial(rng):
    """Which unknowns lie in their intervals, and the fit."""
    crank, noise = rng.uniform(0.05, 0.2), 10.0 ** rng.uniform(-5.0, -3.5)
    rod, zero = crank * rng.uniform(2.2, 4.5), rng.uniform(-0.01, 0.01)
    angle = np.sort(rng.uniform(0.0, 2.0 * math.pi, INSTANTS))
    # the closed form, so that nothing of the fit is in its data
    x = crank * np.cos(angle) + np.sqrt(rod**2 - (crank * np.sin(angle)) ** 2)
    data = {"motor": angle, "slider.x [mm]": 1e3 * (x + zero + noise * rng.normal(size=INSTANTS))}
    near = rng.uniform(0.97, 1.03, 2)
    machine = mbody.makers.slider_crank(crank * near[0], rod * near[1])
    found = mbody.fit(
        machine, data, UNKNOWNS[:2], "kinematics", offsets=["slider.x"], confidence=CONFIDENCE
    )
    truth = dict(zip(UNKNOWNS, (crank, rod, 1e3 * zero), strict=True))
    inside = {name: low <= truth[name] <= high for name, (low, high) in found.intervals.items()}
    return inside, found


def campaign(first, last, seed=0):
    """How many trials have each unknown in its interval, and how many have settled."""
    counts = Counter()
    for n in range(first, last):
        inside, found = trial(np.random.default_rng([seed, n]))
        counts.update(name for name, hit in inside.items() if hit)
        counts["settled"] += found.status == "completed"
    return counts


def main(arguments=None):
    """Print the parts; 1 where one is not between 94 and 96 %."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    args = parser.parse_args(arguments)
    began, step = time.monotonic(), 100
    firsts = range(0, args.trials, step)
    lasts = [min(n + step, args.trials) for n in firsts]
    seeds = [args.seed] * len(lasts)
    total = Counter()
    with ProcessPoolExecutor(args.processes) as pool:
        for done, counts in enumerate(pool.map(campaign, firsts, lasts, seeds), 1):
            total += counts
            if done % 10 == 0:
                print(f"{done * step} trials after {time.monotonic() - began:.0f} s", flush=True)
    good = total["settled"] == args.trials
    for name in UNKNOWNS:
        share = total[name] / args.trials
        error = math.sqrt(CONFIDENCE * (1.0 - CONFIDENCE) / args.trials)
        print(f"{name:20} {100.0 * share:.2f} % in the 95 % interval (± {100.0 * error:.2f})")
        good &= 0.94 <= share <= 0.96
    print(f"{total['settled']} of {args.trials} settled")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
