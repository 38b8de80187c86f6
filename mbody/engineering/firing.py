"""Firing orders: at which angle of the crank each cylinder fires."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from mbody.errors import ModelError, brief

__all__ = ["firing_angles"]

#: A crank that is beside its dead centre by more than this part of a turn does not fit.
BESIDE = 1e-6


def firing_angles(
    order: str | Sequence[int],
    cylinders: int | None = None,
    *,
    turns: int = 2,
    cranks: Mapping[int, float] | None = None,
    intervals: Sequence[float] | None = None,
) -> dict[int, float]:
    """Angles of the crankshaft at which the cylinders fire, by their firing order.

    A table of the pressure in one cylinder over its cycle, p(x), x = 0 where it fires, serves all:
    of cylinder n it is p(θ − angle n), as ``area*gas(crank.angle - phase3)`` in a model file.

    Parameters
    ----------
    order : str or sequence of int
        Such as ``"1-5-3-6-2-4"``.
    cylinders : int, optional
        How many there are; by default those of the order.
    turns : int
        Of a cycle: 2 of a four-stroke engine, 1 of a two-stroke one.
    cranks : mapping, optional
        By cylinder, how far its own dead centre at the top comes after that of the first cylinder
        [rad]: of engines in line the angle by which its crank lags. Then it is checked that every
        cylinder fires at a dead centre of its own.
    intervals : sequence of float, optional
        From each firing to the next [rad], as many as there are cylinders; by default equal.

    Returns
    -------
    dict
        By cylinder, in the order in which they fire: its angle after that of the first that fires
        [rad].

    Raises
    ------
    ModelError
        For an order that does not name each cylinder once, intervals that are not one cycle, or
        cranks that do not fit.

    Examples
    --------
    >>> found = firing_angles("1-3-4-2")
    >>> {n: round(math.degrees(angle)) for n, angle in found.items()}
    {1: 0, 3: 180, 4: 360, 2: 540}
    >>> turn = math.pi
    >>> firing_angles("1-3-4-2", cranks={1: 0.0, 2: turn, 3: turn, 4: 0.0}) == found
    True
    """
    row = _order(order)
    count = len(row) if cylinders is None else cylinders
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise ModelError(f"a number of cylinders is a whole number from 1 on, not {cylinders!r}")
    missing = sorted(set(range(1, count + 1)) - set(row))
    strange = sorted(set(row) - set(range(1, count + 1)))
    twice = sorted({n for n in row if row.count(n) > 1})
    if missing or strange or twice:
        wrong = [
            f"cylinder {numbers[0]} {what}"
            for numbers, what in (
                (twice, "fires twice"),
                (strange, "is not there"),
                (missing, "does not fire"),
            )
            if numbers
        ]
        raise ModelError(
            f"the firing order {'-'.join(map(str, row))} does not fit {count} cylinders: "
            f"{', '.join(wrong)}; name each from 1 to {count} once"
        )
    if isinstance(turns, bool) or not isinstance(turns, int) or turns < 1:
        raise ModelError(f"a cycle has 2 turns or 1, or another whole number, not {turns!r}")
    cycle = 2.0 * math.pi * turns
    steps = [cycle / count] * count if intervals is None else [float(one) for one in intervals]
    if len(steps) != count or abs(sum(steps) - cycle) > BESIDE * cycle:
        raise ModelError(
            f"{len(steps)} intervals of {math.degrees(sum(steps)):.6g} deg in all do not make the "
            f"cycle of {count} cylinders, {360 * turns} deg: give one after each firing"
        )
    angles = [0.0]
    for step in steps[:-1]:
        angles.append(angles[-1] + step)
    found = dict(zip(row, angles, strict=True))
    if cranks is not None:
        _check_cranks(found, cranks)
    return found


def _order(order: str | Sequence[int]) -> list[int]:
    """The cylinders as they follow each other."""
    if isinstance(order, str):
        words = [word for word in re.split(r"[-–,\s]+", order.strip()) if word]
        if not words or not all(word.isascii() and word.isdigit() for word in words):
            raise ModelError(
                f"a firing order is numbers of cylinders such as '1-3-4-2', not {brief(order)}"
            )
        return [int(word) for word in words]
    row = list(order)
    if not row or not all(isinstance(n, int) and not isinstance(n, bool) for n in row):
        raise ModelError(f"a firing order is whole numbers such as [1, 3, 4, 2], not {row!r}")
    return row


def _check_cranks(found: Mapping[int, float], cranks: Mapping[int, float]) -> None:
    """Refuse a cylinder that would fire away from its dead centre."""
    if set(cranks) != set(found):
        raise ModelError(
            f"there are cranks of the cylinders {', '.join(map(str, sorted(cranks)))}, and the "
            f"firing order has {', '.join(map(str, sorted(found)))}: give one a cylinder"
        )
    first = next(iter(found))
    for n, angle in found.items():
        own = float(cranks[n]) - float(cranks[first])
        off = math.remainder(angle - own, 2.0 * math.pi)
        if abs(off) > BESIDE * 2.0 * math.pi:
            raise ModelError(
                f"cylinder {n} fires {math.degrees(angle):.6g} deg after cylinder {first}, where "
                f"its piston is {math.degrees(abs(off)):.6g} deg of the crank away from the dead "
                "centre: choose another firing order, or give the intervals"
            )
