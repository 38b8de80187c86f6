"""A position in which all loops are closed, and what closing them showed."""

from __future__ import annotations

from dataclasses import dataclass, field

from mbody.kernels.layout import Work
from mbody.system.rank import Rank

__all__ = ["ClosedPosition"]


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
