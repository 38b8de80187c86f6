"""The lines of Aronhold and Kennedy, on which instant centres are constructed one after another.

The three centres of three bodies are on one line. From the centres that joints show (pins, guides,
pitch points of gears) every other one is where two such lines meet, if the mechanism can be solved
by lines alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.model.joints import Fixed, Gear, Prismatic, RackPinion, Revolute, Rolling

if TYPE_CHECKING:
    from mbody.engineering.instant_centres import InstantCentres
    from mbody.model.mechanism import Mechanism

__all__ = ["KennedyLine", "kennedy_lines", "shown_by_joints"]

Pair = frozenset[str]

#: Sine of the least angle at which two lines give a point.
CROSSING = 1e-6


@dataclass(frozen=True)
class KennedyLine:
    """A line through three centres.

    Attributes
    ----------
    pair : pair of str
        The bodies whose centre is sought.
    through : two pairs of str
        The bodies whose centres are known, both with the same third body.
    """

    pair: tuple[str, str]
    through: tuple[tuple[str, str], tuple[str, str]]


def shown_by_joints(mechanism: Mechanism) -> set[Pair]:
    """Pairs of bodies whose instant centre a joint shows: a pin, the normal of a guide, a pitch
    point, a point of rolling contact.

    >>> import mbody
    >>> len(shown_by_joints(mbody.makers.four_bar(1, 3, 2, 3.5)))
    4
    """
    kinds = Revolute, Prismatic, Fixed, Gear, RackPinion, Rolling
    return {frozenset(joint.bodies) for joint in mechanism.joints if isinstance(joint, kinds)}


def kennedy_lines(
    centres: InstantCentres, mechanism: Mechanism, instant: int = 0
) -> tuple[KennedyLine, ...]:
    """Two lines for every centre that follows from those before it, in the order of construction.

    Parameters
    ----------
    centres : InstantCentres
    mechanism : Mechanism
    instant : int
        By whose places lines are chosen that do not fall together.

    Returns
    -------
    tuple of KennedyLine
        Without centres that need more than lines, as in mechanisms of Stephenson's kind that are
        driven at a link which no four-bar contains.

    Examples
    --------
    >>> import mbody
    >>> from mbody.engineering import instant_centres
    >>> run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), [0.0])
    >>> lines = kennedy_lines(instant_centres(run), run.mechanism)
    >>> [line.pair for line in lines][::2]
    [('crank', 'rocker'), ('coupler', 'ground')]
    """
    pairs = [one.bodies for one in centres.pairs]
    at = {frozenset(one.bodies): one.homogeneous(centres.length)[instant] for one in centres.pairs}
    known = shown_by_joints(mechanism)
    found: list[KennedyLine] = []
    while True:
        new = []
        for i, j in pairs:
            if frozenset((i, j)) in known:
                continue
            lines = {}
            for k in centres.bodies:
                ends = frozenset((i, k)), frozenset((k, j))
                if k not in (i, j) and known.issuperset(ends):
                    lines[k] = np.cross(at[ends[0]], at[ends[1]])
            best, thirds = _crossing(lines)
            if best > CROSSING:
                new.append(frozenset((i, j)))
                found += [KennedyLine((i, j), ((i, k), (k, j))) for k in thirds]
        if not new:
            return tuple(found)
        known |= set(new)


def _crossing(lines: dict[str, np.ndarray]) -> tuple[float, tuple[str, ...]]:
    """The two lines that cross at the greatest angle, and its measure."""
    if len(lines) < 2:
        return 0.0, ()
    names, whole = list(lines), np.array(list(lines.values()))
    sizes = np.linalg.norm(whole, axis=1)
    units = whole / np.maximum(sizes, 1e-300)[:, None]
    apart = np.linalg.norm(np.cross(units[:, None], units[None, :]), axis=2)
    # lines through centres that are one point, or of which one is missing, are none
    sound = sizes > CROSSING
    apart = np.where(np.triu(sound[:, None] & sound, 1), apart, 0.0)
    one, other = np.unravel_index(int(np.argmax(apart)), apart.shape)
    best = float(apart[one, other])
    return best, (names[one], names[other]) if best > 0.0 else ()
