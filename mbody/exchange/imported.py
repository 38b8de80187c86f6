"""What comes of reading another program's file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism

__all__ = ["Imported"]


@dataclass(frozen=True)
class Imported:
    """A model from another program's file.

    Attributes
    ----------
    mechanism : Mechanism
        What was read.
    form : str
        The format of the file, such as ``"PMKS"``.
    notes : tuple of str
        What was assumed where the file does not say it, and all that it has and the model has not.
    """

    mechanism: Mechanism
    form: str
    notes: tuple[str, ...] = ()
