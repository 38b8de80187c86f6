"""Which combinations of unknowns measured data determine, and which they leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.sheets.text_table import number

__all__ = ["Combination", "Identified", "OpenDirection", "identified"]

Array = np.ndarray

#: A part of a direction that is rounding.
ROUNDING = 1e-6


@dataclass(frozen=True)
class OpenDirection:
    """A change of unknowns that changes no datum.

    Attributes
    ----------
    direction : dict
        By unknown how much it changes, the first by 1.
    sentence : str
    """

    direction: dict[str, float]
    sentence: str

    def __str__(self) -> str:
        return self.sentence


@dataclass(frozen=True)
class Combination:
    """A sum of unknowns that the data determine, where they do not determine each of them.

    Attributes
    ----------
    terms : dict
        By unknown its factor.
    value, deviation : float
    """

    terms: dict[str, float]
    value: float
    deviation: float

    def __str__(self) -> str:
        return _sum(self.terms)

    def shown(self, values: Mapping[str, float]) -> float:
        """Its value, 0 where it is rounding beside the parts of the sum."""
        greatest = max(abs(factor * values[name]) for name, factor in self.terms.items())
        return 0.0 if abs(self.value) <= ROUNDING * greatest else self.value


@dataclass(frozen=True, eq=False)
class Identified:
    """What the derivatives of the data say of the unknowns.

    Attributes
    ----------
    rank : int
        How many combinations are determined.
    inverse : array (unknowns, unknowns)
        (JᵀJ)⁻¹, of the determined combinations alone where some are not.
    open : array of bool (unknowns,)
        Which take part in a direction that is not determined.
    pivots : tuple of int
        Unknowns that leave nothing open if they are held, one of each direction.
    undetermined : tuple of OpenDirection
    terms : tuple of dict
        Combinations that are determined, of those that take part.
    """

    rank: int
    inverse: Array
    open: Array
    pivots: tuple[int, ...]
    undetermined: tuple[OpenDirection, ...]
    terms: tuple[dict[str, float], ...]


def identified(
    jacobian: Array, names: Sequence[str], units: Mapping[str, str], sizes: Array, tolerance: float
) -> Identified:
    """The null space of J in words (base parameters of identification).

    Parameters
    ----------
    jacobian : array (data, unknowns)
        Divided by the deviations of the data.
    sizes : array (unknowns,)
        Of the unknowns, by which effects are compared.
    tolerance : float
        A singular value below this part of the greatest is zero, of columns of length 1.
    """
    effect = np.linalg.norm(jacobian, axis=0) * sizes
    none = effect <= tolerance * effect.max(initial=0.0)
    lengths = np.where(none, 1.0, np.linalg.norm(jacobian, axis=0))
    scaled = np.where(none, 0.0, jacobian / lengths)
    _, values, directions = np.linalg.svd(scaled, full_matrices=True)
    rank = int((values > tolerance * max(values.max(initial=0.0), 1e-300)).sum())
    kept = directions[:rank] / values[:rank, None]
    inverse = (kept.T @ kept) / np.outer(lengths, lengths)
    null, pivots = _reduced(directions[rank:])
    open_ones = (np.abs(null) > 0.0).any(axis=0)
    # from columns of length 1 to the units of the unknowns
    null = null / lengths
    found = []
    for row, pivot in zip(null, pivots, strict=True):
        row = row / row[pivot]
        parts = {names[pivot]: 1.0} | {
            names[k]: float(row[k]) for k in np.flatnonzero(row).tolist() if k != pivot
        }
        found.append(OpenDirection(parts, _said(parts, units)))
    terms = []
    for k in np.flatnonzero(open_ones).tolist():
        if k not in pivots:
            others = {
                names[p]: -float(row[k] / row[p]) for p, row in zip(pivots, null, strict=True)
            }
            terms.append({names[k]: 1.0} | {n: f for n, f in others.items() if f})
    return Identified(rank, inverse, open_ones, tuple(pivots), tuple(found), tuple(terms))


def _reduced(rows: Array) -> tuple[Array, list[int]]:
    """The same null space by rows of few entries: each has a pivot that the others lack."""
    rows, pivots = np.array(rows), []
    for n in range(len(rows)):
        left = np.abs(rows[n:])
        lead, pivot = divmod(int(np.argmax(left)), left.shape[1])
        rows[[n, n + lead]] = rows[[n + lead, n]]
        rows[n] /= rows[n, pivot]
        pivots.append(pivot)
        others = np.arange(len(rows)) != n
        rows[others] -= np.outer(rows[others, pivot], rows[n])
    return np.where(np.abs(rows) > ROUNDING, rows, 0.0), pivots


def _said(parts: Mapping[str, float], units: Mapping[str, str]) -> str:
    if len(parts) == 1:
        return f"'{next(iter(parts))}' changes no datum"
    changes = [f"'{name}' by {number(by)} {units[name]}".rstrip() for name, by in parts.items()]
    return f"changing {', '.join(changes[:-1])} and {changes[-1]} changes no datum"


def _sum(terms: Mapping[str, float]) -> str:
    """Such as "a − 2 b"."""
    text = ""
    for name, factor in terms.items():
        sign = ("− " if factor < 0.0 else "+ ") if text else ("−" if factor < 0.0 else "")
        size = "" if abs(factor) == 1.0 else f"{number(abs(factor))} "
        text += f"{' ' if text else ''}{sign}{size}{name}"
    return text
