"""A position in which all loops are closed, and what closing them showed."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field

from mbody.kernels.layout import Work
from mbody.model.body import Guesses
from mbody.system.rank import Rank
from mbody.system.system import System


@dataclass
class ClosedPosition:
    """A closed position with what was found on the way.

    Attributes
    ----------
    work : Work
        Workspace at the position, its factor valid.
    regularization : float
        Proximal term for the rows: zero unless some are redundant.
    ratio : float
        Least pivot as a part of its diagonal.
    straight : bool
        Whether the way from the guess led straight there, without a singular position.
    rank : Rank or None
        Rank report, where one was made.
    notes : list of str
        Sentences for the user.
    """

    work: Work
    regularization: float = 0.0
    ratio: float = 1.0
    straight: bool = True
    rank: Rank | None = None
    notes: list[str] = field(default_factory=list)


# -- First positions that a system was closed in before: the same numbers, guesses and driver
#    values lead to the same one, and closing loops takes as long as hundreds of instants of a
#    motion ------------------------------------------------------------------------------------

#: Positions that a system keeps, the last ones.
KEPT = 16


def position_key(
    system: System, t: float, drive: Mapping[str, float], guess: Guesses | None
) -> Hashable | None:
    """What a first position depends on beside the system; None where it may be another one each
    time, with functions of the user, or cannot be compared.
    """
    if system.batch is not None or system.has_user_code:
        return None
    key = (t, *drive.items()), tuple((guess or {}).items())
    try:
        hash(key)
    except TypeError:  # a guess that is a list or an array
        return None
    return key


def kept_position(system: System, key: Hashable | None) -> ClosedPosition | None:
    """The position that was kept by that key, in a workspace of its own."""
    found = None if key is None else system.closed_positions.get(key)
    if found is None:
        return None
    return ClosedPosition(
        found.work.copied(), found.regularization, found.ratio, found.straight, found.rank
    )


def keep_position(system: System, key: Hashable | None, found: ClosedPosition) -> None:
    """Keep a position; one of which something was said is not kept, so that it is said again."""
    if key is None or found.notes:
        return
    positions = system.closed_positions
    # of a list, which is made at once: other threads may keep positions meanwhile
    for old in list(positions)[: max(len(positions) - KEPT + 1, 0)]:
        positions.pop(old, None)
    positions[key] = ClosedPosition(
        found.work.copied(), found.regularization, found.ratio, found.straight, found.rank
    )
