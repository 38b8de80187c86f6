"""Forces of one sense over the instants: contacts that would have to pull, ropes that would have to
push; and wheels that come apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.position.assembly_analysis import MISFIT, misfit
from mbody.model.contact import Rope
from mbody.model.coupling import Coupling
from mbody.model.joints import Joint
from mbody.model.one_sided_constraint import OneSided
from mbody.solution.contact_forces import least_pressing, pressing_force
from mbody.solution.places import ends
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = [
    "OneSidedForce",
    "check_fits",
    "one_sided_force",
    "low_between",
    "one_sided",
    "pulled",
    "unfit",
]

Array = np.ndarray

#: Parts of an interval in which a least force is sought.
CLOSER = 8
#: Part of the greatest force of a contact below which its pull is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class OneSidedForce:
    """The force with which a contact or a rope holds, over further instants of a motion.

    Attributes
    ----------
    t, force, size : arrays (instants,)
        Times; the force, negative where it would have to be of the other sense; its greatest
        component, by which rounding is judged.
    """

    t: Array
    force: Array
    size: Array


def one_sided(system: System) -> list[Joint | Coupling | OneSided]:
    """Contacts of joints and those that are closed for good, and ropes: couplings of distances
    whose factors are all of one sign, with angles of drums. A belt of angles alone is stretched
    beforehand, and a displacement has no sense.
    """
    machine = system.mechanism
    found: list[Joint | Coupling | OneSided] = [
        joint for joint in machine.joints if type(joint).normal is not Joint.normal
    ]
    found += [one for one in machine.contacts if one.closed]
    return found + [one for one in machine.couplings if _sense(system, one)]


def _sense(system: System, coupling: Coupling) -> float:
    """The factor of a single part of a rope, of which the effort times it pushes; 0 of what is no
    rope.
    """
    parts = coupling.parts
    if not coupling.lengths or any(term.coordinate for term in parts):
        return 0.0
    names = [f"{coupling.name}.{n}.factor" for n, term in enumerate(parts) if term.distance]
    factors = [np.ravel(system.values[name]) for name in names]
    every = np.concatenate(factors) if factors else np.zeros(1)
    if (every > 0.0).all():
        return float(every.min())
    return float(every.max()) if (every < 0.0).all() else 0.0


def one_sided_force(solution: Solution, element: Any) -> OneSidedForce:
    """The force of a one-sided element at the instants of a solution."""
    if element.role == "coupling":
        pull = -_sense(solution.system, element) * solution.effort(element.name)
        return OneSidedForce(solution.t, pull, np.abs(pull))
    if element.role == "contact":
        press = least_pressing(solution, element)
        return OneSidedForce(solution.t, press, _greatest(solution))
    press = np.asarray(solution.contact(element.name))
    return OneSidedForce(solution.t, press, solution.reaction(element.name).magnitude)


def _greatest(solution: Solution) -> Array:
    """The greatest force of all closed contacts, by which rounding is judged: (instants,)."""
    closed = [one for one in solution.mechanism.contacts if one.closed]
    every = [np.abs(pressing_force(solution, one)) for one in closed]
    return np.asarray(np.max(every, axis=0))


def pulled(solution: Solution, between: Mapping[str, OneSidedForce] | None = None) -> list[str]:
    """A sentence for each contact that presses nowhere on the other body at some instant, and each
    rope that would have to push.

    Their rows keep them whatever their force; whether they would be kept is for its sign to say.
    `between`, by the names of the elements, are forces at further instants of one design.
    """
    if not solution.has_forces:
        return []
    found = []
    for element in one_sided(solution.system):
        history = one_sided_force(solution, element)
        shown = history.force
        t, force, size = np.broadcast_to(history.t, shown.shape), shown, history.size
        if between is not None and element.name in between:
            more = between[element.name]
            t, force = np.append(t, more.t), np.append(force, more.force)
            size = np.append(size, more.size)
        floor = ROUNDING * float(np.fmax.reduce(size, axis=None, initial=0.0))
        if (force < -floor).any():
            found.append(_sentence(solution, element, t, force, floor))
    return found


def low_between(t: Array, force: Array) -> Array:
    """Times beside each least sample from which the force may fall below zero between samples. A
    parabola through three falls by an eighth of what the higher neighbour rises, at most; eight
    times that is examined.

    >>> low_between(np.arange(5.0), np.array([3.0, 1.0, 0.4, 1.0, 3.0]))[:3]
    array([1.125, 1.25 , 1.375])
    """
    left, middle, right = force[:-2], force[1:-1], force[2:]
    least = (middle <= left) & (middle <= right) & (middle < np.maximum(left, right) - middle)
    at = np.flatnonzero(least) + 1
    parts = np.arange(1, CLOSER) / CLOSER
    ways = [t[k, None] + parts * (t[k + 1] - t[k])[:, None] for k in (at - 1, at)]
    return np.asarray(np.concatenate(ways, axis=1).ravel())


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
            where = _when(solution, float(solution.t[first[-1]]), first)
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
        if joint.spaced:
            found, wanted = np.broadcast_arrays(*joint.fit(*ends(solution, joint)))
            yield joint, found, wanted, np.abs(found - wanted) > MISFIT * solution.system.length


def _when(solution: Solution, t: float, where: tuple[int, ...]) -> str:
    """An instant, and of a batch the design."""
    when = f"at t = {t:.6g} {solution.mechanism.units.time}"
    return f"in design {where[0]} {when}" if len(where) == 2 else when


def _pressing(element: Joint | Coupling | OneSided) -> str:
    """What it holds with: a force, or a torque."""
    return element.quantities()["contact"] if isinstance(element, OneSided) else "force"


def _sentence(
    solution: Solution,
    element: Joint | Coupling | OneSided,
    t: Array,
    force: Array,
    floor: float,
) -> str:
    """The sentence of a force of the wrong sense: the greatest, and the first instant of it."""
    units = solution.mechanism.units
    where = np.unravel_index(int(force.argmin()), force.shape)
    when = _when(solution, float(t[where]), tuple(int(n) for n in where))
    shown = one_sided_force(solution, element).force
    count = int((shown < -floor).sum())
    if not count:
        when = f"between the instants, most {when}"
    elif shown.size > 1:
        when = f"at {count} of {shown.size} instants, most {when}"
    first = float(t[force < -floor].min())
    if first < float(t[where]) and not solution.record.batch:
        when = f"{when}, first at t = {first:.6g} {units.time}"
    size = f"{-float(force.min()):.6g} {units.of(_pressing(element))}"
    if element.role == "coupling" or isinstance(element, Rope):
        return (
            f"rope '{element.name}' would have to push with {size} {when}: it would be slack "
            "there; load it more, or take it off where it is slack"
        )
    if len(element.bodies) < 2:
        return (
            f"stop '{element.name}' would have to pull with {size} {when}: what it measures would "
            "leave it there; press it on harder"
        )
    i, j = element.bodies[:2]
    return (
        f"contact '{element.name}' would have to pull '{j}' with {size} {when}: '{j}' would leave "
        f"'{i}' there; press it on harder"
    )
