"""Names of assembly modes: open and crossed of two links and a slider, else numbers.

Two links between known pins, P on the driver's side and Q, are *open* where their common pin lies
to the left of the way from P to Q, else *crossed*: of a four-bar with the ground's pivots from left
to right these are the open and the crossed circuit of textbooks (Norton, *Design of Machinery*,
chapter 4). A link and a slider are *open* where the slider is on the positive side of the guide's
x axis, seen from the known pin. A mode of several groups joins their names.
"""

from __future__ import annotations

import cmath

import numpy as np

from mbody.analysis.assemblies.linkage import Linkage, Pair
from mbody.analysis.assemblies.solution_order import Group

__all__ = ["mode_names"]

NAMES = {True: "open", False: "crossed"}


def mode_names(
    linkage: Linkage, groups: list[Group], choices: list[tuple[int, ...]], poses: np.ndarray
) -> list[str]:
    """A name for each pose (modes, coordinates + 3); `choices` are its roots of every group."""
    free = [n for n, group in enumerate(groups) if group.angles or any(c[n] for c in choices)]
    distances = _distances(linkage)
    found = []
    for choice, pose in zip(choices, poses, strict=True):
        parts = []
        for n in free:
            side = _side(linkage, groups[n], pose, distances)
            parts.append(str(choice[n] + 1) if side is None else NAMES[side])
        found.append("-".join(parts) or "1")
    return found if len(set(found)) == len(found) else [str(n + 1) for n in range(len(found))]


def _side(linkage: Linkage, group: Group, pose: np.ndarray, distances: list[float]) -> bool | None:
    """Whether a group of two links, or of a link and a slider, is open."""
    pairs = [linkage.pairs[p] for p in group.pairs]
    slides = [pair for pair in pairs if pair.kind == "slide"]
    outer: list[tuple[float, int, complex]] = []
    inner: complex | None = None
    for pair in pairs:
        inside = [b for b in (pair.i, pair.j) if b in group.bodies]
        i, j = _world(pose, pair.i, pair.arm_i), _world(pose, pair.j, pair.arm_j)
        if pair.kind == "pin" and len(inside) == 2:
            inner = i
        elif pair.kind != "slide" and len(inside) == 1:
            known = pair.j if pair.i in group.bodies else pair.i
            outer.append((distances[known], known, j if known == pair.j else i))
            if pair.kind == "rod":
                inner = i if known == pair.j else j
        elif pair.kind == "rod":
            return None
    if inner is None or len(pairs) > 3:
        return None
    if len(outer) == 2 and not slides:
        (_, _, p), (_, _, q) = sorted(outer, key=lambda one: one[:2])
        return bool(((q - p).conjugate() * (inner - p)).imag > 0.0)
    if len(outer) == 1 and len(slides) == 1 and _keeps_direction(linkage, group, slides[0]):
        slide = slides[0]
        along = -1j * slide.axis * cmath.exp(1j * float(pose[3 * slide.i + 2]))
        return bool((along.conjugate() * (inner - outer[0][2])).real > 0.0)
    return None


def _keeps_direction(linkage: Linkage, group: Group, slide: Pair) -> bool:
    return all(linkage.variable[b] not in group.angles for b in (slide.i, slide.j))


def _world(pose: np.ndarray, body: int, arm: complex) -> complex:
    x, y, angle = (float(part) for part in pose[3 * body : 3 * body + 3])
    return complex(x, y) + arm * cmath.exp(1j * angle)


def _distances(linkage: Linkage) -> list[float]:
    """How many pairs lead from a driven body to every other one, the ground left out."""
    found = [np.inf] * (linkage.bodies + 1)
    names = {name: n for n, name in enumerate(linkage.names)}
    here = {names[d.bodies[1]] for d in linkage.system.drivers} - {linkage.bodies}
    step = 0.0
    while here:
        for b in here:
            found[b] = step
        step += 1.0
        near = {b for pair in linkage.pairs for b in (pair.i, pair.j) if {pair.i, pair.j} & here}
        here = {b for b in near if b < linkage.bodies and found[b] == np.inf}
    return found
