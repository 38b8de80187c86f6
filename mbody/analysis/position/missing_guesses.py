"""Guesses that are missing: of the ways in which loops close, the one nearest to those given."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from mbody.analysis.position.initial_guess import placed, unguessed
from mbody.model.body import Guesses
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.analysis.position.closed_position import ClosedPosition

__all__ = ["nearest_to_guesses", "wrapped"]

Array = np.ndarray

#: By how much easier bodies without a guess move than the others while loops are closed.
EASE = 1e3
#: Starts that are tried, by the greatest number of coordinates.
TRIED = ((60, 8), (300, 2))
#: Positions whose coordinates agree to this, in model lengths and radians, are one.
SAME = 1e-5
#: A pivot below this part of its diagonal is that of a dead centre, where chance led.
DEAD = 1e-6
#: A body without a guess that is elsewhere by more [rad] is worth a note.
WORTH = 0.1
#: Bodies with a guess are as near to it in another position where they are off by less than so many
#: times as much, and so many radians.
TIMES, NEAR = 3.0, 0.3


def nearest_to_guesses(
    system: System,
    base: System,
    result: ClosedPosition,
    starts: tuple[Array, Array],
    guess: Guesses | None,
    values: Mapping[str, float],
    close: Callable[[Array], ClosedPosition | None],
) -> ClosedPosition:
    """Where bodies have no guess: the closed position in which those that have one are nearest to
    it, with a note where another one is about as near.

    Parameters
    ----------
    system, base : System
        What is closed, and the one design of it.
    result : ClosedPosition
        What was found with the link axes of such bodies parallel to those of the ground.
    starts : arrays (coordinates + 3,), (coordinates + 3, 1)
        That start, and the one from which it was found, another one where that led nowhere.
    guess, values
        As of `placed`.
    close : callable
        Closes the loops from a start, with the weights of the workspace.
    """
    first, start = starts
    count = next((tries for size, tries in TRIED if system.coordinates <= size), 0)
    names = unguessed(base, guess, values) if count else ()
    work, n = result.work, system.coordinates
    own = _scaled(system, work.q[:n, 0])
    if not names or np.abs(own - _scaled(system, first[:n])).max() < SAME:
        return result
    fixed = _fixed(base, guess or {})
    found = [work.q[:, 0].copy()]
    more = [first, placed(base, guess, values, aimed=True)]
    loose = (np.random.default_rng(seed) for seed in range(count))
    more += [placed(base, guess, values, loose=random) for random in loose]
    weight = work.weight.copy()
    easy = [b for b, body in enumerate(base.mechanism.bodies) if body.name not in fixed]
    slots = np.flatnonzero(np.isin(system.layout.slot_body, easy))
    work.weight[(3 * slots[:, None] + np.arange(3)).ravel()] *= EASE
    for other in more:
        if close(other[:, None]) is not None:
            q = work.q[:, 0].copy()
            if all(_apart(system, q, known) > SAME for known in found):
                found.append(q)
    work.weight[:] = weight
    off = np.array([_off(system, base, guess or {}, first, q) for q in found])
    dead = not result.regularization and result.ratio < DEAD and len(found) > 1
    off[0] += 2.0 * SAME * dead
    best = 0 if off[0] <= off.min() + SAME else int(off.argmin())
    again = None
    if best or not np.array_equal(start[:, 0], first):
        again = close(_unwound(system, found[best], names)[:, None])
        start = found[best][:, None]  # whole turns may matter
    result = again or close(start) or result
    _say_others(system, result, names, found, off, off[best])
    return result


def _fixed(system: System, guess: Guesses) -> set[str]:
    """Bodies whose angle is guessed, or driven against one of those or the ground."""
    machine = system.mechanism
    fixed = {"ground", *guess}
    fixed |= {body.name for body in machine.bodies if body.guess.angle is not None}
    before = 0
    while len(fixed) > before:
        before = len(fixed)
        for driver in machine.drivers:
            if driver.angular and fixed & set(driver.bodies):
                fixed |= set(driver.bodies)
    return fixed


def _scaled(system: System, q: Array) -> Array:
    """Coordinates in model lengths and radians: (bodies, 3)."""
    return (q[: system.coordinates] / system.coordinate_units).reshape(-1, 3)


def _difference(system: System, q: Array, other: Array) -> Array:
    """The same of two positions, without whole turns."""
    apart = _scaled(system, q) - _scaled(system, other)
    apart[:, 2] -= 2.0 * math.pi * np.round(apart[:, 2] / (2.0 * math.pi))
    return apart


def _apart(system: System, q: Array, other: Array) -> float:
    return float(np.abs(_difference(system, q, other)).max())


def _off(system: System, base: System, guess: Guesses, first: Array, q: Array) -> float:
    """By how much the bodies with a guess are off it, in radians and model lengths."""
    apart = _difference(system, q, first)
    total = 0.0
    for b, body in enumerate(base.mechanism.bodies):
        given = body.guess
        if body.name in guess or given.angle is not None:
            total += float(apart[b, 2] ** 2)
        if body.name not in guess and given.x is not None and given.y is not None:
            total += float(apart[b, 0] ** 2 + apart[b, 1] ** 2)
    return math.sqrt(total)


def _unwound(system: System, q: Array, names: tuple[str, ...]) -> Array:
    """A position with bodies without a guess at the turn nearest to an angle of 0."""
    q = q.copy()
    for name in names:
        angle = 3 * system.bodies[name] + 2
        q[angle] = wrapped(q[angle])
    return q


def _say_others(
    system: System,
    result: ClosedPosition,
    names: tuple[str, ...],
    found: list[Array],
    off: Array,
    least: float,
) -> None:
    """Note another position in which the bodies with a guess are about as near to it."""
    here = result.work.q[:, 0]
    for q, far in sorted(zip(found, off, strict=True), key=lambda pair: float(pair[1])):
        if far > TIMES * least + NEAR or _apart(system, q, here) <= SAME:
            continue
        difference = np.abs(_difference(system, q, here))
        if _other_teeth(system, difference):
            continue
        apart = difference[:, 2]
        name = max(names, key=lambda name: float(apart[system.bodies[name]]))
        if apart[system.bodies[name]] <= WORTH:
            continue
        now, then = (
            math.degrees(wrapped(float(p[3 * system.bodies[name] + 2]))) for p in (here, q)
        )
        result.notes.append(
            f"'{name}' has no guess and came out at {now:.1f} deg; the loops close with it at "
            f"{then:.1f} deg as well: give it a guess to choose"
        )
        return


def _other_teeth(system: System, difference: Array) -> bool:
    """Whether positions that differ by (bodies, 3) are one but for wheels, which turn about their
    mass centres while nothing else moves: other teeth mesh there, which no guess is needed for.
    """
    machine = system.mechanism
    wheels: set[str] = set()
    for one in (*machine.joints, *machine.couplings):
        if one.counts_turns and not getattr(one, "parallel", False):
            wheels.update(one.turn_bodies())
    others = [b for b, body in enumerate(machine.bodies) if body.name not in wheels]
    stay = difference[:, :2].max(initial=0.0) <= SAME
    return bool(stay and difference[others, 2].max(initial=0.0) <= SAME)


def wrapped(angle: float) -> float:
    """The angle [rad] within −π … π.

    >>> wrapped(2 * math.pi + 0.5)  # doctest: +ELLIPSIS
    0.5...
    """
    return math.remainder(angle, 2.0 * math.pi)
