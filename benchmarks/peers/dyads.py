"""The solver of dyads that data sets of linkages are made with, written anew from its description.

A. Heyrani Nobari, A. Srivastava, D. Gutfreund, F. Ahmed, "LINKS: A dataset of a hundred million
planar linkage mechanisms for data-driven kinematic design" (2022): joints are found one after
another, each from two that are known and its distances to them, by the law of cosines, at all
angles of the crank at once in NumPy. Positions only.
"""

from __future__ import annotations

import numpy as np

__all__ = ["dyad_order", "dyad_positions"]


def dyad_order(
    links: list[list[int]], fixed: list[int], crank: list[int]
) -> list[tuple[int, int, int]]:
    """Joints in the order in which they can be found, each with two that are known before it.

    Raises
    ------
    ValueError
        For a linkage that is not of dyads.
    """
    known = {*fixed, *crank}
    beside: dict[int, set[int]] = {}
    for i, j in links:
        beside.setdefault(i, set()).add(j)
        beside.setdefault(j, set()).add(i)
    order, waiting = [], [joint for joint in beside if joint not in known]
    while waiting:
        for joint in waiting:
            there = sorted(beside[joint] & known)
            if len(there) >= 2:
                order.append((joint, there[0], there[1]))
                known.add(joint)
                waiting.remove(joint)
                break
        else:
            raise ValueError("this linkage is not of dyads")
    return order


def dyad_positions(
    joints: np.ndarray, links: list[list[int]], fixed: list[int], instants: int
) -> np.ndarray:
    """Positions (joints, instants, 2) over a turn of the first link, whose first joint is fixed;
    NaN where it does not close.
    """
    pivot, end = links[0]
    found = np.empty((len(joints), instants, 2))
    found[fixed] = joints[fixed, None]
    arm = joints[end] - joints[pivot]
    angle = np.arctan2(arm[1], arm[0]) + np.linspace(0.0, 2.0 * np.pi, instants)
    turning = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    found[end] = joints[pivot] + np.hypot(*arm) * turning
    for k, i, j in dyad_order(links, fixed, links[0]):
        a, b = np.hypot(*(joints[k] - joints[i])), np.hypot(*(joints[k] - joints[j]))
        first, own = joints[j] - joints[i], joints[k] - joints[i]
        side = np.sign(first[0] * own[1] - first[1] * own[0])
        d = found[j] - found[i]
        apart = np.sqrt(d[:, 0] ** 2 + d[:, 1] ** 2)
        with np.errstate(invalid="ignore"):
            c = (a * a + apart * apart - b * b) / (2.0 * a * apart)
            s = side * np.sqrt(1.0 - c * c)
        found[k, :, 0] = found[i, :, 0] + a * (c * d[:, 0] - s * d[:, 1]) / apart
        found[k, :, 1] = found[i, :, 1] + a * (s * d[:, 0] + c * d[:, 1]) / apart
    return found
