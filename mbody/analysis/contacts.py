"""Contacts over the instants: those that would have to pull, and wheels that come apart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mbody.analysis.closure import MISFIT, misfit
from mbody.ends import ends
from mbody.joints import Joint
from mbody.solution import Solution

__all__ = ["check_fits", "pulled", "unfit"]

#: Part of the greatest force of a contact below which its pull is rounding.
ROUNDING = 1e-9


def pulled(solution: Solution) -> list[str]:
    """A sentence for each contact that presses nowhere on the other body at some instant.

    A contact is kept by its rows whatever its force; whether it would be kept is for its sign to
    say.
    """
    if not solution.has_forces:
        return []
    found = []
    for joint in solution.mechanism.joints:
        if type(joint).normal is Joint.normal:
            continue
        press = np.asarray(solution.contact(joint.name))
        reaction = solution.reaction(joint.name)
        floor = ROUNDING * float(np.fmax.reduce(reaction.magnitude, axis=None, initial=0.0))
        low = press < -floor
        if low.any():
            found.append(_told(solution, joint, press, int(low.sum())))
    return found


def check_fits(solution: Solution) -> None:
    """Refuse wheels that do not fit at some instant, of any design.

    Raises
    ------
    SolveError
        With the distance that is wrong, and when.
    """
    for joint, found, wanted, far in _distances(solution):
        wrong = np.argwhere(far)
        if len(wrong):
            first = tuple(wrong[0].tolist())
            where = _when(solution, first)
            raise misfit(solution.system, joint, found[first], wanted[first], f" {where}")


def unfit(solution: Solution) -> np.ndarray:
    """Which designs of a batch have wheels that do not fit at some instant: (designs,)."""
    wrong = np.zeros(solution.record.count, dtype=bool)
    for _, _, _, far in _distances(solution):
        wrong |= far.any(axis=-1)
    return wrong


def _distances(solution: Solution) -> Iterator[tuple[Joint, np.ndarray, np.ndarray, np.ndarray]]:
    """Of every joint whose place others hold: its distance, what it should be, and whether it is
    far from that.
    """
    for joint in solution.mechanism.joints:
        if joint.held:
            at, d, *_ = ends(solution, joint)
            found, wanted = np.broadcast_arrays(np.hypot(*d), joint.apart(at))
            yield joint, found, wanted, np.abs(found - wanted) > MISFIT * solution.system.length


def _when(solution: Solution, where: tuple[int, ...]) -> str:
    """An instant, and of a batch the design."""
    when = f"at t = {solution.t[where[-1]]:.6g} {solution.mechanism.units.time}"
    return f"in design {where[0]} {when}" if len(where) == 2 else when


def _told(solution: Solution, joint: Joint, press: np.ndarray, count: int) -> str:
    units = solution.mechanism.units
    where = np.unravel_index(int(press.argmin()), press.shape)
    when = _when(solution, tuple(int(n) for n in where))
    if press.size > 1:
        when = f"at {count} of {press.size} instants, most {when}"
    return (
        f"contact '{joint.name}' would have to pull '{joint.j.body}' with {-press.min():.6g} "
        f"{units.force} {when}: '{joint.j.body}' would leave '{joint.i.body}' there; press it on "
        "harder"
    )
