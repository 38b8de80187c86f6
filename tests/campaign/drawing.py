"""Random linkages with a closed form: crank, link groups, wheels, racks and masses."""

from __future__ import annotations

import math

import numpy as np

from tests.campaign.linkage import Linkage, Unfit
from tests.campaign.parts import crank, lever, rack, slider, twin, two_links, weld, wheel


def random_linkage(seed: int, *, margin: float | None = None, loops: int | None = None) -> Linkage:
    """A random linkage of one or two drivers; the same seed draws the same.

    Parameters
    ----------
    seed : int
    margin : float, optional
        How near groups come to being flat, as a part of their size; by default ordinary margins of
        0.03 … 0.3.
    loops : int, optional
        Groups, by default one to eight, small ones more often.
    """
    for attempt in range(1000):
        rng = np.random.default_rng([seed, attempt])
        try:
            return _drawn(rng, margin, loops)
        except Unfit:
            continue
    raise AssertionError(f"seed {seed}: nothing fits")


def _drawn(rng: np.random.Generator, margin: float | None, loops: int | None) -> Linkage:
    of = Linkage(rng)
    speed = float(rng.uniform(1.0, 10.0)) * float(rng.choice([-1.0, 1.0]))
    rise = float(rng.uniform(-0.05, 0.05)) * speed**2 * float(rng.random() < 0.3)
    of.span = 2.0 * math.pi / abs(speed)
    places = [crank(of, 0.0, 0.0, float(rng.uniform(0.3, 0.8)), speed, rise)]
    if rng.random() < 0.2:
        ratio = float(rng.choice([-2.0, -1.0, 0.5, 1.0, 2.0]))
        x, y = rng.uniform(-2.0, 2.0, 2)
        places.append(crank(of, float(x), float(y), float(rng.uniform(0.2, 0.6)), ratio * speed))
    if loops is None:
        loops = int(
            rng.choice([1, 2, 3, 4, 5, 6, 7, 8], p=[0.3, 0.3, 0.14, 0.1, 0.05, 0.04, 0.04, 0.03])
        )
    for _ in range(loops):
        group(of, places, margin)
    for _ in range(int(rng.integers(0, 3))):
        extra(of)
    masses(of)
    return of


def group(of: Linkage, places: list[str], margin: float | None) -> None:
    """One more group on places that are there."""
    rng = of.rng
    near = margin if margin is not None else float(10.0 ** rng.uniform(-1.5, -0.5))
    p = str(rng.choice(places))
    bodies = [place for place in places if place.partition(".")[0] != p.partition(".")[0]]
    if bodies and rng.random() < 0.5:
        q = str(rng.choice(bodies))
    else:
        x, y = rng.uniform(-2.5, 2.5, 2)
        q = of.point("ground", f"Q{len(of.points['ground'])}", float(x), float(y))
    kind = str(rng.choice(["RRR", "RRR", "RRR", "RRD", "RRP", "RPR", "pin in slot"]))
    of.kinds.append(kind)
    if kind in ("RRR", "RRD"):
        places.append(two_links(of, p, q, near, rod=kind == "RRD"))
    elif kind == "RRP":
        places.append(slider(of, p, near))
    else:
        places.append(lever(of, p, q, block=kind == "RPR"))


def extra(of: Linkage) -> None:
    """Something that hangs on: a weld, a twin, a gear, a belt, a rack, a wheel."""
    rng = of.rng
    kind = str(rng.choice(["weld", "twin", "gear", "belt", "rack", "wheel"]))
    of.kinds.append(kind)
    hosts = [(name, key) for name, keys in of.points.items() if name != "ground" for key in keys]
    host, far = hosts[int(rng.integers(len(hosts)))]
    if kind == "weld":
        weld(of, host, far)
    elif kind == "twin":
        twin(of, host, far)
    elif kind in ("gear", "belt"):
        wheel(of, kind)
    else:
        rack(of, rolling=kind == "wheel")


def masses(of: Linkage) -> None:
    """Masses, inertias and mass centres; some links have none."""
    rng = of.rng
    for name in of.points:
        if name == "ground":
            continue
        of.values[f"{name}.cg.x"], of.values[f"{name}.cg.y"] = rng.uniform(-0.4, 0.6, 2).tolist()
        if name != "L1" and rng.random() < 0.15:
            continue
        of.values[f"{name}.mass"] = float(rng.uniform(0.2, 4.0))
        of.values[f"{name}.inertia"] = float(rng.uniform(0.02, 0.5))
