"""The readable sheet of modes: what ``print(mbody.modes(machine))`` shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.sheets.names import ROUNDING, certified, title
from mbody.sheets.text_table import Column, even, number, numbers, paragraph, table

if TYPE_CHECKING:
    from mbody.analysis.linear.modes import Mode, Modes, ModesAt

__all__ = ["sheet"]

#: Positions, modes of each, and leaders of a mode that are shown.
SHOWN, MODES, LEADERS = 6, 20, 4


def sheet(found: Modes) -> str:
    """Modes as text, at most 100 characters wide.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.Mechanism("pendulum")
    >>> machine.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)))
    >>> machine.add(mbody.Revolute("O", "ground", "rod"))
    >>> machine.add(mbody.Gravity("gravity", y=-9.81))
    >>> print(sheet(mbody.modes(machine)).splitlines()[7].split()[:4])
    ['1', 'oscillates', '4.42945', '0.704968']
    """
    count = len(found)
    counted = f"{count} rest position{'' if count == 1 else 's'}"
    when = f"modes at t = {number(found.t)} {found.units.time}: {counted}"
    lines = title(found.mechanism, when, found.units)
    for n, one in enumerate(list(found)[:SHOWN], 1):
        lines += ["", *paragraph(f"{one.stability}, at {_where(one)}", f"REST {n}   ")]
        lines += _table(found, one)
        lines += [line for note in one.notes for line in paragraph(note, "NOTE   ")]
    if count > SHOWN:
        lines.append(f"and {count - SHOWN} more")
    return "\n".join(even([*lines, *certified(found)]))


def _where(one: ModesAt) -> str:
    """The position by its leaders: their angles, or places of what slides."""
    solution, words = one.linear.solution, []
    length = solution.mechanism.units.length
    leaders = {motion.leader: motion for motion in reversed(one.linear.motions)}
    motions = sorted(leaders.values(), key=one.linear.motions.index)
    for motion in motions[:LEADERS]:
        body, name = solution[motion.leader], motion.leader
        if motion.turns:
            degrees = round(float(np.degrees(body.angle[-1])) % 360.0, 3) % 360.0
            words.append(f"{name} {degrees:.3f}°")
        else:
            floor = ROUNDING * solution.system.length
            x, y = (0.0 if abs(part[-1]) <= floor else float(part[-1]) for part in (body.x, body.y))
            words.append(f"{name} ({number(x)}, {number(y)}) {length}")
    more = len(motions) - LEADERS
    return ", ".join(words) + (f" and {more} more" if more > 0 else "")


def _table(found: Modes, one: ModesAt) -> list[str]:
    shown = one.modes[:MODES]
    if not shown:
        return ["no mode: nothing that is free has inertia"]
    time = found.units.time
    cycles = "Hz" if time == "s" else f"1/{time}"
    frequencies, turning = [m.frequency for m in shown], [bool(m.frequency) for m in shown]
    swinging = [cell if on else "" for cell, on in zip(numbers(frequencies), turning, strict=True)]
    hertz = [m.hertz for m in shown]
    often = [cell if on else "" for cell, on in zip(numbers(hertz), turning, strict=True)]
    damped = any(m.damping_ratio and m.frequency for m in shown)
    ratios = [number(m.damping_ratio) if m.frequency else "" for m in shown]
    decaying = [m.decay_rate for m in shown]
    rates = [cell if x else "" for cell, x in zip(numbers(decaying), decaying, strict=True)]
    columns = [
        Column("MODE", [str(n) for n in range(1, len(shown) + 1)], text=True, whole=True),
        Column("", [m.words for m in shown], text=True, whole=True),
        Column("frequency", swinging, f"rad/{time}"),
        Column("", often, cycles),
        Column("damping ratio", ratios if damped else [""] * len(shown)),
        Column("decay rate", rates, f"1/{time}"),
        Column("shape", [_shape(one, m) for m in shown], text=True),
    ]
    lines = table(columns)
    return [*lines, f"and {len(one) - MODES} more"] if len(one) > MODES else lines


def _names(one: ModesAt) -> list[str]:
    """The leaders, and what they do where one leads several motions."""
    names = list(one.linear.leaders)
    for n, motion in enumerate(one.linear.motions):
        if one.linear.leaders.count(motion.leader) > 1:
            x, y, turn = np.abs(motion.rates[motion.leader])
            names[n] = f"{'θ' if turn > 0.5 else 'x' if x > y else 'y'} of {motion.leader}"
    return names


def _shape(one: ModesAt, mode: Mode) -> str:
    """Leaders with their parts, such as "a 1 : b -1.41"; where they lag, their phases."""
    parts = []
    for name, part in list(zip(_names(one), mode.amplitudes, strict=True))[:LEADERS]:
        if abs(part.imag) <= 1e-6:
            parts.append(f"{name} {round(float(part.real), 6) + 0.0:.3g}")
        else:
            degrees = float(np.degrees(np.angle(part)))
            parts.append(f"{name} {abs(part):.3g} @ {degrees:.0f}°")
    return " : ".join(parts) + (" …" if len(mode.amplitudes) > LEADERS else "")
