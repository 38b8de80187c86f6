"""First positions by coordinates that are prescribed, where more are than are free: the nearest
position that joints and drivers allow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.singular.prescribed_values import Prescribed
from mbody.analysis.singular.singular_positions import singular
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.system.rank import dense, shortest
from mbody.system.system import System

__all__ = ["Fitted", "fitted_note", "fitted_places", "misplaced"]

Array = np.ndarray

#: Corrections, and what they end with, in model lengths and radians.
CORRECTIONS, CLOSED = 30, 1e-14
#: A singular value below this part of the greatest is zero: near a singular position as well.
ZERO = 1e-6
#: Places may be changed by so much, in model lengths and radians: a start with four digits.
SAID = 1e-3
#: Changes below this are rounding of numbers with all their digits.
REPORTED = 1e-9
#: At a singular position rows with a singular value below `ZERO` stay open: corrections end so far
#: beside it, in model lengths and radians.
UNSURE = 1e-4
#: Places that a sentence names.
NAMED = 4


@dataclass(frozen=True, eq=False)
class Fitted:
    """The nearest position to what is prescribed.

    Attributes
    ----------
    q : array (coordinates + 3,)
        The position, the ground last.
    off : array (spots,)
        What is prescribed less what it is there, in model lengths and radians.
    """

    q: Array
    off: Array

    @property
    def near(self) -> bool:
        """Whether what is prescribed differs by no more than rounding of digits."""
        return bool(np.abs(self.off).max(initial=0.0) <= SAID)


def fitted_places(
    system: System, work: Work, prescribed: Sequence[Prescribed], first: Array
) -> Fitted | None:
    """The nearest position to what is prescribed, from a first one (coordinates + 3,); None where
    the loops do not close near it.

    Parameters
    ----------
    work : Work
        A workspace, its signals set.
    """
    n = system.coordinates
    scale = system.coordinate_units
    work.q[:, 0] = first
    wanted = np.array([one.value / one.unit(system) for one in prescribed])
    for _ in range(CORRECTIONS):
        q = work.q[:n, 0]
        phi, G = dense(system, work)
        if not np.isfinite(G).all():
            return None
        off = wanted - np.array([one.at(system, q) for one in prescribed])
        P = np.array([one.row(system, q) for one in prescribed]).reshape(-1, n)
        u, sizes, vt = np.linalg.svd(G)
        rank = int((sizes > ZERO * sizes.max(initial=1e-300)).sum())
        step = -vt[:rank].T @ ((u.T @ phi)[:rank] / sizes[:rank])
        free = vt[rank:]
        step = step + shortest(P @ free.T, off - P @ step, ZERO) @ free
        length = float(np.abs(step).max(initial=0.0))
        work.q[:n, 0] += scale * step * min(1.0, 0.5 / max(length, 1e-300))
        if length <= CLOSED * (1.0 + float(np.abs(q / scale).max())):
            break
    open_ = float(np.abs(dense(system, work)[0]).max(initial=0.0))
    if not open_ <= 1e-10:
        return None
    q = work.q[:, 0].copy()
    off = wanted - np.array([one.at(system, q[:n]) for one in prescribed])
    found = Fitted(q, off)
    if open_ <= CLOSED * (1.0 + float(np.abs(q[:n] / scale).max())):
        return found
    return _at_singular(system, work, prescribed, found) or found


def _at_singular(
    system: System, work: Work, prescribed: Sequence[Prescribed], found: Fitted
) -> Fitted | None:
    """The singular position beside one at which corrections ended, where it has what is prescribed
    as well: rounding decides on which branch, and with which gap, they end.
    """
    n = system.coordinates
    own = system.work()
    own.q[:], own.signal[:], own.time[:] = work.q, work.signal, work.time
    here = singular(system, own, 0.0, UNSURE)
    if here is None:
        return None
    q = found.q.copy()
    q[:n] = here.rows.scale * here.x
    moved = np.array([one.at(system, q[:n]) - one.at(system, found.q[:n]) for one in prescribed])
    off = found.off - moved
    worse = float((np.abs(off) - np.abs(found.off)).max(initial=0.0))
    return Fitted(q, off) if worse <= REPORTED else None


def fitted_note(system: System, prescribed: Sequence[Prescribed], found: Fitted) -> tuple[str, ...]:
    """By how much places were changed, where that is more than rounding."""
    worst = int(np.abs(found.off).argmax())
    size = abs(float(found.off[worst]))
    if size <= REPORTED:
        return ()
    spot = prescribed[worst]
    unit = "deg" if spot.key == "angle" else system.mechanism.units.length
    change = np.degrees(size) if spot.key == "angle" else size * system.length
    return (
        f"the places of the start were fitted to joints and drivers: by {change:.2g} {unit} at "
        f"most, of {spot.name}",
    )


def misplaced(system: System, prescribed: Sequence[Prescribed], found: Fitted) -> SolveError:
    """The sentence of places that joints and drivers do not allow together."""
    order = np.argsort(-np.abs(found.off))
    wrong = [int(n) for n in order if abs(found.off[n]) > 0.1 * SAID]
    parts = []
    for n in wrong[:NAMED]:
        spot = prescribed[n]
        value = spot.value - spot.unit(system) * float(found.off[n])
        given = np.degrees(spot.value) if spot.key == "angle" else spot.value
        parts.append(f"{spot.with_value(system, value)} (not {given:.7g})")
    more = f" and {len(wrong) - NAMED} more" if len(wrong) > NAMED else ""
    return SolveError(
        "the places of the start do not fit together: the nearest position that joints and drivers "
        f"allow has {', '.join(parts)}{more}; correct them, or leave out places that follow from "
        "others",
        prescribed[wrong[0]].body,
    )
