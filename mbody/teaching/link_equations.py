"""Newton's and Euler's equations of every body, in symbols with numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.free_body import Wrench, free_body
from mbody.sheets.names import force_names, forces_on
from mbody.teaching.notation import Equation, Factor, Symbol, Term, vanishing

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["LinkEquations", "link_equations"]


@dataclass(frozen=True)
class LinkEquations:
    """Newton's and Euler's equations of one body.

    Attributes
    ----------
    number : int
        Of the link, the ground being 1.
    body : str
    equations : tuple of Equation
        ΣFx, ΣFy and ΣM about the mass centre.
    meanings : dict
        By symbol of a force or torque the element and what it is.
    """

    number: int
    body: str
    equations: tuple[Equation, Equation, Equation]
    meanings: dict[str, tuple[str, str]]


def link_equations(solution: Solution, body: str, instant: int, floor: float) -> LinkEquations:
    """The equations of one body: Σ of all that acts on it = m a, I α.

    Parameters
    ----------
    solution : Solution
        Of an analysis with forces, of one design.
    body : str
        A moving body.
    instant : int
        Which of its instants.
    floor : float
        Forces that are no more are rounding: 0; torques by the model length.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1), speed=2.0))
    >>> found = link_equations(run, "coupler", 0, 0.0)
    >>> for equation in found.equations:
    ...     print(*(text for text, _ in equation.line()))
    -F32x + F43x = m3 a3x
    -F32y + F43y = m3 a3y
    -R23x F32y + R23y F32x + R43x F43y - R43y F43x = I3 α3
    """
    return _Link(solution, body, instant, floor).found()


class _Link:
    """Collects the terms of one body."""

    def __init__(self, solution: Solution, body: str, instant: int, floor: float) -> None:
        self.run, self.body, self.k = solution, body, instant
        self.machine, self.floor = solution.mechanism, floor
        self.number = 2 + [one.name for one in self.machine.bodies].index(body)
        self.whole, self.on = force_names(self.machine), forces_on(self.machine, body)
        self.driven = {self.whole[one.name][0] for one in self.machine.drivers if one.angular}
        self.sums: tuple[list[Term], list[Term], list[Term]] = ([], [], [])
        self.meanings: dict[str, tuple[str, str]] = {}
        at = solution[body]
        self.centre = float(at.x[instant]), float(at.y[instant])

    def found(self) -> LinkEquations:
        turning = {driver.name for driver in self.machine.drivers if driver.angular}
        wrenches = free_body(self.run, self.body, self.k)
        touching = Counter(one.cause for one in wrenches if one.kind == "contact")
        counted: Counter[str] = Counter()
        for wrench in wrenches:
            if wrench.kind == "contact" and touching[wrench.cause] > 1:
                # a contact that touches at several places has a force at each
                counted[wrench.cause] += 1
                self._force(wrench, by_name=False, place=str(counted[wrench.cause]))
            elif wrench.kind == "joint":
                self._joint(wrench)
            elif wrench.kind == "driver" and wrench.cause in turning:
                self._torque(wrench, *self._named(wrench.cause))
            elif wrench.kind == "driver":
                self._force(wrench, by_name=True)
            elif wrench.kind != "inertia":
                self._force(wrench, by_name=False)
        lines = zip(("ΣFx", "ΣFy", "ΣM"), self.sums, self._right(), strict=True)
        x, y, m = (Equation(name, left, right) for name, left, right in lines)
        return LinkEquations(self.number, self.body, (x, y, m), self.meanings)

    def _right(self) -> Iterator[list[Term]]:
        if self.run.analysis == "statics":
            yield from ([], [], [])
            return
        index, at, b = str(self.number), self.run[self.body], self.run.system.bodies[self.body]
        mass, _, inertia = (float(part) for part in self.run.system.mass[3 * b : 3 * b + 3, 0])
        m, i = Symbol("m", (index,), mass), Symbol("I", (index,), inertia)
        for axis, values in (("x", at.ax), ("y", at.ay)):
            a = Symbol("a", (index + axis,), float(values[self.k]))
            yield [Term(1, [Factor(m), Factor(a)])]
        yield [Term(1, [Factor(i), Factor(Symbol("α", (index,), float(at.alpha[self.k])))])]

    def _named(self, element: str) -> tuple[tuple[str, ...], int]:
        """Index of an unknown as in `Solution.equations`, and its sign on this body."""
        name, on = self.whole[element]
        return _index(name), 1 if on == self.body else -1

    def _joint(self, wrench: Wrench) -> None:
        joint: Any = self.machine[wrench.cause]
        if joint.unknowns == ("N", "T") and not joint.rubs:
            self._guided(wrench, joint)
        else:
            # of some joints the equations say whether they have a torque, of others its size does
            known = joint.unknowns and not joint.rubs
            self._force(wrench, True, "T" in joint.unknowns if known else None)

    def _meaning(self, symbol: Symbol, wrench: Wrench, sign: int, what: str) -> None:
        """What an unknown is, said where it is on this body with its own sign."""
        if sign > 0:
            at = f"on {self.body} by {wrench.cause}, {what}"
            self.meanings[symbol.text] = (wrench.cause, at)

    def _arms(self, wrench: Wrench, index: tuple[str, ...]) -> tuple[Symbol, Symbol]:
        x, y = (
            vanishing(place - centre, 1e-12 * self.run.system.length)
            for place, centre in zip((wrench.x, wrench.y), self.centre, strict=True)
        )
        return Symbol("R", _along("x", index), x), Symbol("R", _along("y", index), y)

    def _guided(self, wrench: Wrench, joint: Any) -> None:
        """A slider: the force normal to its guide, and a torque."""
        index, sign = self._named(joint.name)
        guide = self.run[joint.i.body].angle[self.k] + self.run.system.numbers.angle(joint, "i")
        angle = Symbol("φ", (joint.name,), float(guide))
        size = -np.sin(angle.value) * wrench.fx + np.cos(angle.value) * wrench.fy
        force = Symbol("N", index, vanishing(sign * size, self.floor))
        x, y = self._arms(wrench, self._seen(joint.name))
        cos, sin = Factor(angle, "cos"), Factor(angle, "sin")
        self.sums[0].append(Term(-sign, [Factor(force), sin]))
        self.sums[1].append(Term(sign, [Factor(force), cos]))
        if x.value or y.value:
            self.sums[2].append(Term(sign, [Factor(x), Factor(force), cos]))
            self.sums[2].append(Term(sign, [Factor(y), Factor(force), sin]))
        self._meaning(force, wrench, sign, "normal to the guide")
        self._torque(wrench, index, sign)

    def _seen(self, element: str) -> tuple[str, ...]:
        """Index of an arm on this body."""
        return _index(self.on[element])

    def _torque(self, wrench: Wrench, index: tuple[str, ...], sign: int) -> None:
        floor = self.floor * self.run.system.length
        torque = Symbol("T", index, vanishing(sign * wrench.torque, floor))
        self.sums[2].append(Term(sign, [Factor(torque)]))
        self._meaning(torque, wrench, sign, "torque")

    def _force(
        self, wrench: Wrench, by_name: bool, torque: bool | None = None, place: str = ""
    ) -> None:
        """Two components at their place, and a torque; without `torque` where it is not zero.
        `place`: the number of the place, of several.
        """
        element = wrench.cause
        if by_name:
            (index, sign), seen = self._named(element), self._seen(element)
        else:
            index, sign = (element + place, str(self.number)), 1
            seen = index
        x, y = self._arms(wrench, seen)
        parts = []
        for axis, value in (("x", wrench.fx), ("y", wrench.fy)):
            parts.append(Symbol("F", _along(axis, index), vanishing(sign * value, self.floor)))
        # what is no joint has the components that it has; a joint has both
        shown = [by_name or bool(part.value) for part in parts]
        for n, part in enumerate(parts):
            if shown[n]:
                self.sums[n].append(Term(sign, [Factor(part)]))
                self._meaning(part, wrench, sign, f"along {'xy'[n]}")
        if x.value or y.value:
            if shown[1]:
                self.sums[2].append(Term(sign, [Factor(x), Factor(parts[1])]))
            if shown[0]:
                self.sums[2].append(Term(-sign, [Factor(y), Factor(parts[0])]))
        if torque is None:
            torque = abs(wrench.torque) > self.floor * self.run.system.length
        if torque:
            # a driver and the friction of a pin between the same links: the joint is named as well
            shared = by_name and f"T{index[0]}" in self.driven and len(index) == 1
            self._torque(wrench, (*index, element) if shared else index, sign)


def _along(axis: str, index: tuple[str, ...]) -> tuple[str, ...]:
    """The index of a component: the axis is behind the numbers of links, else by itself.

    >>> _along("x", ("14", "slot")), _along("y", ("spring", "3"))
    (('14x', 'slot'), ('spring', '3', 'y'))
    """
    if index[0][0] in "0123456789(":
        return (index[0] + axis, *index[1:])
    return (*index, axis)


def _index(name: str) -> tuple[str, ...]:
    """The index of a textbook name.

    >>> _index("F32"), _index("F14,slot"), _index("T(12,3),motor")
    (('32',), ('14', 'slot'), ('(12,3)', 'motor'))
    """
    found = re.fullmatch(r"[A-Z](\d\d|\(\d+,\d+\))(?:,(.*))?", name)
    assert found, name
    return (found[1], found[2]) if found[2] else (found[1],)
