"""Equations of the loops: Σ r e^{iθ} = 0, its two lines, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mbody.teaching.notation import Equation, Factor, Symbol, Term, vanishing
from mbody.teaching.vector_loops import LoopVector, VectorLoop

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["LoopEquations", "VectorSymbols", "loop_equations", "vector_symbols"]


@dataclass(frozen=True)
class VectorSymbols:
    """The symbols of a vector; derivatives that are zero by its kind are None.

    Attributes
    ----------
    r, angle : Symbol
    rate, second : Symbol or None
        ω and α of what it turns with; None where that is the ground.
    r_rate, r_second : Symbol or None
        None where the length is constant.
    """

    r: Symbol
    angle: Symbol
    rate: Symbol | None
    second: Symbol | None
    r_rate: Symbol | None
    r_second: Symbol | None


@dataclass(frozen=True)
class LoopEquations:
    """All equations of one loop.

    Attributes
    ----------
    loop : VectorLoop
    vector : Equation
        Σ r e^{iθ} = 0.
    positions, velocities, accelerations : pairs of Equation
        Along x and y.
    """

    loop: VectorLoop
    vector: Equation
    positions: tuple[Equation, Equation]
    velocities: tuple[Equation, Equation]
    accelerations: tuple[Equation, Equation]

    @property
    def every(self) -> tuple[Equation, ...]:
        """The six scalar equations."""
        return (*self.positions, *self.velocities, *self.accelerations)


def vector_symbols(solution: Solution, vector: LoopVector, floor: float) -> VectorSymbols:
    """The symbols of a vector with its numbers.

    Parameters
    ----------
    solution : Solution
    vector : LoopVector
    floor : float
        Rates (and accelerations) that are no more are rounding: 0.
    """
    links = ["ground", *(body.name for body in solution.mechanism.bodies)]
    index, length = vector.index, solution.system.length
    turns: tuple[str, ...] = index
    if vector.body:
        turns = (str(links.index(vector.body) + 1),)
    # a body between the same joints as another one is told apart by its number
    if vector.kind == "link" and len(index) > 2:
        index = (*index[:2], *turns)
    letter = "s" if vector.kind == "slide" else "r"
    turning = vector.body != "ground"

    def known(letter: str, index: tuple[str, ...], value: float, dots: int = 0) -> Symbol:
        return Symbol(letter, index, vanishing(value, floor), dots)

    rates = length * floor
    return VectorSymbols(
        r=Symbol(letter, index, vector.r),
        angle=Symbol("θ", index, vector.angle),
        rate=known("ω", turns, vector.rate) if turning else None,
        second=known("α", turns, vector.second) if turning else None,
        r_rate=Symbol(letter, index, vanishing(vector.r_rate, rates), 1) if vector.varies else None,
        r_second=(
            Symbol(letter, index, vanishing(vector.r_second, rates), 2) if vector.varies else None
        ),
    )


def loop_equations(solution: Solution, loop: VectorLoop, floor: float = 0.0) -> LoopEquations:
    """The equations of a loop in symbols with numbers.

    Examples
    --------
    >>> import mbody
    >>> from mbody.teaching.vector_loops import vector_loops
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> found = loop_equations(run, vector_loops(run)[0])
    >>> " ".join(text for text, _ in found.positions[0].line())
    'rO2A cos θO2A + rAB cos θAB - rO4B cos θO4B - rO2O4 cos θO2O4 = 0'
    >>> found.positions[0].residual < 1e-12
    True
    """
    vectors = [(sign, vector_symbols(solution, one, floor)) for sign, one in loop.vectors]
    whole = Equation(
        "closure", [Term(s, [Factor(v.r), Factor(v.angle, "exp")]) for s, v in vectors]
    )
    positions, velocities, accelerations = (
        (_equation("x", vectors, order, 0), _equation("y", vectors, order, 1)) for order in range(3)
    )
    return LoopEquations(loop, whole, positions, velocities, accelerations)


def _equation(
    name: str, vectors: list[tuple[int, VectorSymbols]], order: int, axis: int
) -> Equation:
    terms = [term for sign, one in vectors for term in _terms(sign, one, order, axis)]
    return Equation(name, terms)


def _terms(sign: int, one: VectorSymbols, order: int, axis: int) -> list[Term]:
    """Parts of the derivative of that order of r e^{iθ} along x (0) or y (1)."""
    # along e^{iθ}, and along i e^{iθ}
    along = Factor(one.angle, ("cos", "sin")[axis])
    across, turned = Factor(one.angle, ("sin", "cos")[axis]), (-1, 1)[axis]
    r, rate, second = one.r, one.rate, one.second
    if order == 0:
        return [Term(sign, [Factor(r), along])]
    found = []
    if order == 1:
        if one.r_rate:
            found.append(Term(sign, [Factor(one.r_rate), along]))
        if rate:
            found.append(Term(sign * turned, [Factor(r), Factor(rate), across]))
        return found
    if one.r_second:
        found.append(Term(sign, [Factor(one.r_second), along]))
    if rate and second:
        if one.r_rate:
            found.append(Term(sign * turned, [Factor(one.r_rate), Factor(rate), across], 2))
        found.append(Term(-sign, [Factor(r), Factor(rate, power=2), along]))
        found.append(Term(sign * turned, [Factor(r), Factor(second), across]))
    return found
