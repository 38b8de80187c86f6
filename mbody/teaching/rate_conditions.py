"""Equations of rates of what vectors do not go through: teeth, wheels, cams, couplings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.coupling import Coupling, CouplingTerm
from mbody.model.joints import Gear, RackPinion, Rolling
from mbody.solution.checks import loaded
from mbody.system.rank import jacobian
from mbody.teaching.notation import Equation, Factor, Symbol, Term, vanishing
from mbody.teaching.vector_loops import edges, relative_motion

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["Condition", "conditions"]

#: A coefficient of a row that is no greater (of an angle: than this part of the model length) is 0.
SMALL = 1e-12


@dataclass(frozen=True)
class Condition:
    """The equations of rates, and of accelerations where they are written out, of one element.

    Attributes
    ----------
    element : str
    words : str
        What it says.
    equations : tuple of Equation
    """

    element: str
    words: str
    equations: tuple[Equation, ...]


def conditions(solution: Solution, instant: int, floor: float) -> list[Condition]:
    """One of every gear pair, rack, rolling wheel, cam, coupling and other joint that is no side of
    a vector loop.

    Parameters
    ----------
    solution : Solution
        Of one design.
    instant : int
        Which of its instants.
    floor : float
        Rates that are no more are rounding: 0.
    """
    found = _Conditions(solution, instant, floor)
    machine, through = solution.mechanism, {one.name for one in edges(solution)}
    rest = []
    for joint in machine.joints:
        loose = solution.analysis == "simulate" and joint.can_separate
        if isinstance(joint, (Gear, Rolling)) and not loose:
            wheels = isinstance(joint, Gear) or joint.on_radius is not None
            rest.append(found.wheels(joint) if wheels else found.line(joint))
        elif isinstance(joint, RackPinion) and not loose:
            rest.append(found.line(joint))
        elif joint.name not in through and joint.rows and not loose:
            rest.append(found.rows(joint))
    rest += [found.rows(contact) for contact in machine.contacts if contact.closed]
    return [one for one in [*rest, *map(found.coupling, machine.couplings)] if one.equations]


class _Conditions:
    def __init__(self, solution: Solution, instant: int, floor: float) -> None:
        self.run, self.k, self.floor = solution, instant, floor
        self.links = ["ground", *(body.name for body in solution.mechanism.bodies)]
        self.at = solution.system.numbers

    def _rate(self, body: str, order: int) -> Symbol:
        """ω or α of a body."""
        h = self.run[body]
        value = float((h.omega, h.alpha)[order][self.k])
        index = (str(self.links.index(body) + 1),)
        return Symbol("ωα"[order], index, vanishing(value, self.floor))

    def wheels(self, joint: Any) -> Condition:
        """R_i (ω_i − ω_c) + R_j (ω_j − ω_c) = 0, ω_c of the line of centres."""
        radii = [float(radius) for radius in joint.radii(self.at)]
        way = relative_motion(self.run, joint.i, joint.j, self.k)
        square = float(way.d @ way.d)
        rate = float(way.d[0] * way.rate[1] - way.d[1] * way.rate[0]) / square
        second = float(way.d[0] * way.second[1] - way.d[1] * way.second[0]) / square
        second -= 2.0 * float(way.d @ way.rate) / square * rate
        equations = []
        for order, (name, value) in enumerate((("rates", rate), ("accelerations", second))):
            line = Symbol("ωα"[order], (joint.name,), vanishing(value, self.floor))
            terms = []
            for body, radius in zip(joint.bodies, radii, strict=True):
                index = (joint.name, str(self.links.index(body) + 1))
                size = Factor(Symbol("ρ", index, radius))
                if body != "ground":
                    terms.append(Term(1, [size, Factor(self._rate(body, order))]))
                terms.append(Term(-1, [size, Factor(line)]))
            equations.append(Equation(name, terms))
        words = (
            f"Pitch circles of {joint.name} roll on each other; ρ are their radii, negative of a "
            "wheel in a ring, and ω and α with its name those of the line of centres."
        )
        return Condition(joint.name, words, tuple(equations))

    def line(self, joint: Any) -> Condition:
        """ṡ + ρ (ω_j − ω_i) = 0, s along the line."""
        radius = float(self.at[f"{joint.name}.radius"])
        i, j = joint.bodies
        size = Factor(Symbol("ρ", (joint.name,), radius))
        _, *rates = self._travel(joint.i, joint.j, float(self.at.angle(joint, "i")))
        equations = []
        for order, name in enumerate(("rates", "accelerations")):
            s = Symbol("s", (joint.name,), rates[order], order + 1)
            terms = [Term(1, [Factor(s)])]
            terms += [
                Term(sign, [size, Factor(self._rate(body, order))])
                for body, sign in ((j, 1), (i, -1))
                if body != "ground"
            ]
            equations.append(Equation(name, terms))
        words = f"The circle of {joint.name} with the radius ρ rolls on a line, along which s is."
        return Condition(joint.name, words, tuple(equations))

    def _travel(self, i: Any, j: Any, beta: float) -> tuple[float, float, float]:
        """Of the place on j along the marker on i, and its derivatives."""
        way = relative_motion(self.run, i, j, self.k)
        h = self.run[i.body]
        angle = float(h.angle[self.k]) + beta
        w, alpha = float(h.omega[self.k]), float(h.alpha[self.k])
        u = np.array([np.cos(angle), np.sin(angle)])
        n = np.array([-u[1], u[0]])
        rate = float(u @ way.rate + w * (n @ way.d))
        second = float(
            u @ way.second + 2.0 * w * (n @ way.rate) + alpha * (n @ way.d) - w * w * (u @ way.d)
        )
        floor = self.floor * self.run.system.length
        return float(u @ way.d), vanishing(rate, floor), vanishing(second, floor)

    def coupling(self, coupling: Coupling) -> Condition:
        """Σ c ẋ = 0 and Σ c ẍ = 0."""
        rates: list[Term] = []
        seconds: list[Term] = []
        for n, part in enumerate(coupling.parts):
            factor = float(self.at[f"{coupling.name}.{n}.factor"])
            c = Factor(Symbol("c", (coupling.name, str(n + 1)), factor))
            if part.ends:
                index = (coupling.name, str(n + 1))
                for order, (terms, value) in enumerate(
                    zip((rates, seconds), self._length(coupling, n, part), strict=True)
                ):
                    terms.append(Term(1, [c, Factor(Symbol("s", index, value, order + 1))]))
                continue
            i, j = part.bodies
            for order, terms in enumerate((rates, seconds)):
                terms += [
                    Term(sign, [c, Factor(self._rate(body, order))])
                    for body, sign in ((j, 1), (i, -1))
                    if body != "ground"
                ]
        words = f"The coordinates of {coupling.name}, each times its factor c, have a constant sum."
        equations = (Equation("rates", rates), Equation("accelerations", seconds))
        return Condition(coupling.name, words, equations)

    def _length(self, coupling: Coupling, n: int, part: CouplingTerm) -> tuple[float, float]:
        """Rate and acceleration of a distance or a displacement."""
        assert part.ends
        if part.coordinate:
            return self._travel(*part.ends, float(self.at.angle(coupling, f"{n}.i")))[1:]
        way = relative_motion(self.run, *part.ends, self.k)
        r = float(np.hypot(*way.d))
        rate = float(way.d @ way.rate) / r
        across = float(way.d[0] * way.rate[1] - way.d[1] * way.rate[0]) / r
        second = float(way.d @ way.second) / r + across * across / r
        floor = self.floor * self.run.system.length
        return vanishing(rate, floor), vanishing(second, floor)

    def rows(self, joint: Any) -> Condition:
        """Σ J q̇ = 0 of its rows, the numbers J as the analysis has them at this position."""
        system = self.run.system
        G = jacobian(system, loaded(self.run, self.k))[1]
        own = np.flatnonzero(np.isin(system.row_table[0], system.primitives_of[joint.name]))
        equations = tuple(
            Equation("rates", list(self._row(joint, G[row], n))) for n, row in enumerate(own, 1)
        )
        words = (
            f"The rows of {joint.name} by rates: J are their derivatives by the coordinates of the "
            "mass centres at this position."
        )
        return Condition(joint.name, words, equations)

    def _row(self, joint: Any, row: np.ndarray, n: int) -> Iterator[Term]:
        # the coordinate of a stop is of any bodies
        for body in joint.bodies or self.links:
            if body == "ground":
                continue
            h, b = self.run[body], self.run.system.bodies[body]
            index, link = (joint.name, str(n)), str(self.links.index(body) + 1)
            floor = self.floor * self.run.system.length
            for axis, values in (("x", h.vx), ("y", h.vy)):
                J = Symbol("J", (*index, link + axis), float(row[3 * b + "xy".index(axis)]))
                v = Symbol("v", (link + axis,), vanishing(float(values[self.k]), floor))
                if abs(J.value) > SMALL:
                    yield Term(1, [Factor(J), Factor(v)])
            J = Symbol("J", (*index, link), float(row[3 * b + 2]))
            if abs(J.value) > SMALL * self.run.system.length:
                yield Term(1, [Factor(J), Factor(self._rate(body, 0))])
