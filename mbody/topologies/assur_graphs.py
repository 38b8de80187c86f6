"""Random Assur groups of bars: graphs that no smaller group is part of.

Joints of a group are new, or pins: joints that there are. The least without a dyad is a triangle of
three new joints with a bar from each to a pin. A bar is split: a new joint on it, held by a third
bar to another joint (Henneberg 1911). Each new joint has two bars that hold it, and such bars lead
from each new joint to all others, so that no part of the group is a group of its own (Servatius,
Shai & Whiteley, "Combinatorial characterization of the Assur graphs from engineering", European
Journal of Combinatorics 31, 2010).
"""

from __future__ import annotations

import numpy as np

__all__ = ["LARGEST_GROUP", "LEAST_GROUP", "assur_bars"]

#: New joints of the groups.
LEAST_GROUP, LARGEST_GROUP = 3, 5


def assur_bars(first: int, size: int, random: np.random.Generator) -> list[tuple[int, int]]:
    """The bars (joint, joint), 2·size of them, of a random group of the joints from `first` on, on
    joints before: three or more new joints, and three or more before.

    >>> bars = assur_bars(3, 4, np.random.default_rng(0))
    >>> len(bars), sorted({joint for bar in bars for joint in bar if joint >= 3})
    (8, [3, 4, 5, 6])
    """
    pins = random.choice(first, 3, replace=False).tolist()
    a, b, c = range(first, first + 3)
    bars = [(a, b), (b, c), (c, a), *zip((a, b, c), pins, strict=True)]
    for new in range(first + 3, first + size):
        n = int(random.integers(len(bars)))
        # u is new; where v is a pin, the third bar must lead to a new joint
        u, v = max(bars[n]), min(bars[n])
        others = [k for k in range(0 if v >= first else first, new) if k not in (u, v)]
        third = int(random.choice(others))
        bars[n] = (u, new)
        bars += [(new, v), (new, third)]
    return bars
