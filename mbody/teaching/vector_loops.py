"""Loops of a mechanism as vectors from joint to joint, with their motion at one instant."""

from __future__ import annotations

import cmath
import functools
import math
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbody.core.tolerances import LENGTH_NONE, PRINTED_NONE_FINE
from mbody.model.coupling import Coupling, CouplingTerm
from mbody.model.driver import DistanceDriver
from mbody.model.element import Marker
from mbody.model.joints import Distance, Gear, RackPinion, Rolling
from mbody.reports.writers import escaped
from mbody.solution.checks import loaded
from mbody.summaries.text_table import number
from mbody.system.rank import jacobian

if TYPE_CHECKING:
    from mbody.solution.solution import Solution


# -- Equations as lists of terms, each a product of symbols with values ------------------------

#: An equation, or a part of it: pieces of text and LaTeX, between which a line may be broken.
Line = list[tuple[str, str]]

_GREEK = {"θ": r"\theta", "ω": r"\omega", "α": r"\alpha", "φ": r"\varphi", "ρ": r"\rho"}
_DOTS = ("", "\N{COMBINING DOT ABOVE}", "\N{COMBINING DIAERESIS}")
_ACCENTS = ("", r"\dot", r"\ddot")
#: Names as of points, O2, and numbers of links with an axis, 32x.
_SHORT = re.compile(r"[A-Za-z]\d?|(\d{1,2}|\(\d+,\d+\))[xy]?")


@dataclass(frozen=True)
class Symbol:
    """A quantity with its value.

    `letter`: One letter, Latin or Greek.
    `index`: Its parts; short ones are written together, as in F32x, others in brackets.
    `value`: In the units of the mechanism, an angle in rad.
    `dots`: How often it is differentiated by time.
    """

    letter: str
    index: tuple[str, ...]
    value: float
    dots: int = 0

    @property
    def short(self) -> bool:
        """Whether the parts of the index need no commas between them."""
        return all(_SHORT.fullmatch(part) for part in self.index)

    @property
    def text(self) -> str:
        """The symbol in plain text.

        >>> Symbol("F", ("32x",), 1.0).text, Symbol("r", ("pin", "B"), 1.0, dots=1).text
        ('F32x', 'ṙ(pin,B)')
        """
        letter = unicodedata.normalize("NFC", self.letter + _DOTS[self.dots])
        if self.short:
            return letter + "".join(self.index)
        if self.index[0][0] in "0123456789(":
            return letter + ",".join(self.index)
        return f"{letter}({','.join(self.index)})"

    @property
    def rich(self) -> str:
        """The symbol in marked-up text, with an index.

        >>> Symbol("F", ("32x",), 1.0).rich
        'F_{32x}'
        """
        text = self.text
        return f"{text[0]}_{{{text[1:]}}}"

    @property
    def latex(self) -> str:
        r"""In LaTeX.

        >>> print(Symbol("ω", ("3",), 1.0).latex, Symbol("r", ("a_1", "B"), 1.0, dots=2).latex)
        \omega_{3} \ddot{r}_{\mathrm{a\_1},B}
        """
        letter = _GREEK.get(self.letter, self.letter)
        if self.dots:
            letter = f"{_ACCENTS[self.dots]}{{{letter}}}"
        if not self.index:
            return letter
        parts = [
            part if _SHORT.fullmatch(part) else rf"\mathrm{{{escaped(part)}}}"
            for part in self.index
        ]
        return f"{letter}_{{{('' if self.short else ',').join(parts)}}}"


@dataclass(frozen=True)
class Factor:
    """A symbol in a product: itself, its square, or a function of it.

    `function`: "", "cos" or "sin", or "exp" of i times an angle.
    """

    symbol: Symbol
    function: str = ""
    power: int = 1

    @property
    def value(self) -> complex:
        """The number; it is real but of "exp"."""
        x = self.symbol.value
        if self.function == "exp":
            return cmath.exp(1j * x)
        functions = {"": float, "cos": math.cos, "sin": math.sin}
        return float(functions[self.function](x) ** self.power)

    @property
    def symbols(self) -> tuple[str, str]:
        """Text and LaTeX in symbols."""
        text, latex = self.symbol.text, self.symbol.latex
        if self.function == "exp":
            return f"e^(i {text})", rf"e^{{\mathrm{{i}}\,{latex}}}"
        if self.function:
            return f"{self.function} {text}", rf"\{self.function} {latex}"
        return (f"{text}²", f"{latex}^2") if self.power == 2 else (text, latex)

    @property
    def numbers(self) -> tuple[str, str]:
        """Text and LaTeX with the number; angles in degrees."""
        if self.function:
            degrees = round(math.degrees(self.symbol.value), 4) + 0.0
            text = f"{degrees:.4f}".rstrip("0").rstrip(".")
            return f"{self.function} {_bracketed(text)}°".replace(")°", "°)"), (
                rf"\{self.function}({text}^\circ)"
            )
        text, latex = _bracketed(number(self.symbol.value)), _typeset(self.symbol.value)
        return (f"{text}²", f"{latex}^2") if self.power == 2 else (text, latex)


@dataclass(frozen=True)
class Term:
    """A signed product of factors.

    `sign`: 1 or -1.
    `times`: A whole number before them.
    """

    sign: int
    factors: Sequence[Factor]
    times: int = 1

    @property
    def value(self) -> complex:
        """Its number, real but of vectors."""
        found: complex = math.prod((factor.value for factor in self.factors), start=self.times)
        return self.sign * found

    def piece(self, numbers: bool, first: bool) -> tuple[str, str]:
        """Text and LaTeX, with the sign before it."""
        parts = [factor.numbers if numbers else factor.symbols for factor in self.factors]
        if self.times != 1:
            parts.insert(0, (str(self.times), str(self.times)))
        between = ("·", r" \cdot ") if numbers else (" ", r"\,")
        text, latex = (sign.join(part[n] for part in parts) for n, sign in enumerate(between))
        if first and self.sign > 0:
            # a negative number that begins a line needs no brackets
            return re.sub(r"^\((-[^)]*)\)", r"\1", text), re.sub(r"^\((-[^)]*)\)", r"\1", latex)
        sign = "-" if self.sign < 0 else "+"
        return (sign + text, sign + latex) if first else (f"{sign} {text}", f"{sign} {latex}")


@dataclass(frozen=True)
class Equation:
    """Σ left = Σ right.

    `name`: What it is, such as "ΣFx".
    `left`, `right`: Without any of them 0 is written.
    """

    name: str
    left: Sequence[Term]
    right: Sequence[Term] = ()

    @property
    def residual(self) -> float:
        """Left less right side, its magnitude where it is one of vectors."""
        found = sum(t.value for t in self.left) - sum(t.value for t in self.right)
        return abs(found)

    @property
    def size(self) -> float:
        """Magnitude of the greatest term."""
        return max((abs(t.value) for t in (*self.left, *self.right)), default=0.0)

    def line(self, numbers: bool = False) -> Line:
        """The equation in symbols, or with its numbers."""
        return [*self._side(self.left, numbers), *_equals(self._side(self.right, numbers))]

    def _side(self, terms: Sequence[Term], numbers: bool) -> Line:
        return [t.piece(numbers, first=not n) for n, t in enumerate(terms)] or [("0", "0")]

    @property
    def symbols(self) -> Iterator[Symbol]:
        """All symbols, in order."""
        for t in (*self.left, *self.right):
            for factor in t.factors:
                yield factor.symbol


def _equals(side: Line) -> Line:
    (text, latex), *others = side
    return [(f"= {text}", f"= {latex}"), *others]


def vanishing(value: float, floor: float) -> float:
    """The value, 0 where it is at most `floor`, which is rounding beside others of its kind."""
    return 0.0 if abs(value) <= floor else float(value)


def _bracketed(text: str) -> str:
    return f"({text})" if text.startswith("-") else text


def _typeset(value: float) -> str:
    r"""A number in LaTeX.

    >>> print(_typeset(-1.5e-7))
    (-1.5 \cdot 10^{-7})
    """
    text = number(value)
    base, sign, power = text.partition("e")
    return _bracketed(rf"{base} \cdot 10^{{{int(power)}}}" if sign else base)


Array = np.ndarray


@dataclass(frozen=True)
class LoopVector:
    """A vector of a loop: r e^{iθ} with its derivatives.

    `kind`: "link", between two joints of a body; "slide", the displacement along a guide; "offset",
      across it; "rod", between two places.
    `index`: Of its symbols.
    `body`: The body that it turns with, of a slide that of the guide; empty for a rod.
    `r`, `r_rate`, `r_second`: Length, of a slide a displacement of either sign, and its
      derivatives.
    `angle`, `rate`, `second`: θ [rad] and its derivatives.
    `varies`: Whether the length does.
    """

    kind: str
    index: tuple[str, ...]
    body: str
    r: float
    angle: float
    rate: float
    second: float
    r_rate: float = 0.0
    r_second: float = 0.0
    varies: bool = False


@dataclass(frozen=True)
class VectorLoop:
    """A closed chain of bodies; the signed vectors from joint to joint sum to zero.

    `bodies`, `joints`: In the order in which they are passed, a joint leading to the next body.
    `vectors` (sign, LoopVector)
    """

    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    vectors: tuple[tuple[int, LoopVector], ...]


class _Step(NamedTuple):
    """A joint passed from one of its bodies to the other."""

    joint: Any
    left: str
    entered: str

    def back(self) -> _Step:
        return _Step(self.joint, self.entered, self.left)


def edges(solution: Solution) -> list[Any]:
    """The joints, and drivers of a distance, that vectors go through: pins, welds, slides, slots,
    rods, rolling wheels; in a free motion without those that have play.
    """
    machine, found = solution.mechanism, []
    for joint in machine.joints:
        rolls = isinstance(joint, Rolling)
        known = joint.coincident or "travel" in joint.coordinates or isinstance(joint, Distance)
        loose = solution.analysis == "simulate" and joint.can_separate
        if (known or rolls) and not loose:
            found.append(joint)
    return [*found, *(one for one in machine.drivers if isinstance(one, DistanceDriver))]


def vector_loops(solution: Solution, instant: int = 0) -> list[VectorLoop]:
    """The fundamental loops of a mechanism, shortest first: as many as joints close chains.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> [(sign, "".join(v.index)) for sign, v in vector_loops(run)[0].vectors]
    [(1, 'O2A'), (1, 'AB'), (-1, 'O4B'), (-1, 'O2O4')]
    """
    (found,) = loops_of_instants(solution, [instant])
    return found


def loops_of_instants(solution: Solution, instants: Iterable[int]) -> Iterable[list[VectorLoop]]:
    """`vector_loops` at instants in turn; what holds for all of them is found once."""
    chains, histories = _chains(solution), _LoopHistories(solution)
    for instant in instants:
        walk = _Walk(histories, instant, chains)
        yield [
            VectorLoop(
                tuple(step.left for step in chain),
                tuple(step.joint.name for step in chain),
                tuple(walk.vectors(chain)),
            )
            for chain in chains
        ]


def _chains(solution: Solution) -> list[list[_Step]]:
    """Fundamental cycles of the graph of bodies and joints, by a tree of shortest paths."""
    joints = edges(solution)
    routes: dict[str, list[_Step]] = {}
    used: set[str] = set()
    for root in ("ground", *(body.name for body in solution.mechanism.bodies)):
        if root in routes:
            continue
        routes[root], waiting = [], [root]
        for body in waiting:
            for step in _steps_from(body, joints):
                if step.entered not in routes:
                    routes[step.entered] = [*routes[body], step]
                    waiting.append(step.entered)
                    used.add(step.joint.name)
    found = []
    for joint in joints:
        if joint.name not in used:
            i, j = joint.bodies
            there, back = routes[i], routes[j]
            while there and back and there[0] == back[0]:
                there, back = there[1:], back[1:]
            found.append([*there, _Step(joint, i, j), *(step.back() for step in reversed(back))])
    return sorted(found, key=len)


def _steps_from(body: str, joints: Sequence[Any]) -> Iterable[_Step]:
    for joint in joints:
        i, j = joint.bodies
        if body == i:
            yield _Step(joint, i, j)
        elif body == j:
            yield _Step(joint, j, i)


class Relative(NamedTuple):
    """From a place on i to one on j: the vector and its derivatives (2,), world axes."""

    d: Array
    rate: Array
    second: Array


class _LoopHistories:
    """The histories of places and bodies of a solution over all its instants, each made once."""

    def __init__(self, solution: Solution) -> None:
        self.system = solution.system
        self.point = functools.cache(solution.point)
        self.body = functools.cache(solution.__getitem__)


def relative_motion(
    solution: Solution | _LoopHistories, i: Marker, j: Marker, instant: int
) -> Relative:
    """Motion of the place on j from that on i at one instant."""
    p, q = solution.point(i), solution.point(j)
    parts = [
        np.array([getattr(q, x)[instant] - getattr(p, x)[instant] for x in pair])
        for pair in (("x", "y"), ("vx", "vy"), ("ax", "ay"))
    ]
    return Relative(*parts)


class _Walk:
    """Finds vectors of the loops at one instant."""

    def __init__(self, histories: _LoopHistories, instant: int, chains: list[list[_Step]]) -> None:
        self.run, self.k = histories, instant
        self.order = self._order(chains)
        # two bodies may be between the same two joints
        corners = {
            (frozenset((a.joint.name, b.joint.name)), a.entered)
            for chain in chains
            for a, b in zip(chain, [*chain[1:], chain[0]], strict=True)
        }
        self.shared = Counter(pair for pair, _ in corners)

    def _order(self, chains: list[list[_Step]]) -> dict[str, tuple[bool, int]]:
        """Vectors go from joints at the ground, then in the order in which loops pass them."""
        found: dict[str, tuple[bool, int]] = {}
        for chain in chains:
            for step in chain:
                grounded = "ground" in step.joint.bodies
                found.setdefault(step.joint.name, (not grounded, len(found)))
        return found

    def vectors(self, chain: list[_Step]) -> Iterable[tuple[int, LoopVector]]:
        """The signed vectors of one loop."""
        for n, step in enumerate(chain):
            sign = 1 if step.entered == step.joint.bodies[1] else -1
            for own in self._joint_vectors(step.joint):
                yield sign, own
            link = self._link(step, chain[(n + 1) % len(chain)])
            if link:
                yield link

    def _link(self, step: _Step, after: _Step) -> tuple[int, LoopVector] | None:
        """On the body between two joints."""
        here, there = step.joint, after.joint
        forward = self.order[here.name] <= self.order[there.name]
        first, last = (here, there) if forward else (there, here)
        body = step.entered
        p, q = (one.i if one.i.body == body else one.j for one in (first, last))
        relative = relative_motion(self.run, p, q, self.k).d
        if np.hypot(*relative) <= LENGTH_NONE * self.run.system.length:
            return None
        index: tuple[str, ...] = (first.name, last.name)
        if self.shared[frozenset(index)] > 1:
            index = (*index, body)
        angle = float(np.arctan2(relative[1], relative[0]))
        vector = LoopVector(
            "link", index, body, float(np.hypot(*relative)), angle, *self._angular_rates(body)
        )
        return (1 if forward else -1), vector

    def _angular_rates(self, body: str) -> tuple[float, float]:
        at = self.run.body(body)
        return float(at.omega[self.k]), float(at.alpha[self.k])

    def _joint_vectors(self, joint: Any) -> Iterable[LoopVector]:
        """Of a joint itself, from its place on i to that on j."""
        if joint.role == "joint" and joint.coincident:
            return
        relative = relative_motion(self.run, joint.i, joint.j, self.k)
        on_line = isinstance(joint, Rolling) and joint.on_radius is None
        if "travel" in joint_coordinates(joint) or on_line:
            yield from self._slide(joint, relative)
        else:
            yield self._rod(joint, relative)

    def _slide(self, joint: Any, relative: Relative) -> Iterable[LoopVector]:
        body = joint.i.body
        angle = float(self.run.body(body).angle[self.k] + self.run.system.numbers.angle(joint, "i"))
        u = np.array([np.cos(angle), np.sin(angle)])
        n = np.array([-u[1], u[0]])
        omega, alpha = self._angular_rates(body)
        s, across = float(u @ relative.d), float(n @ relative.d)
        yield LoopVector(
            "slide",
            (joint.name,),
            body,
            s,
            angle,
            omega,
            alpha,
            r_rate=float(u @ relative.rate + omega * across),
            r_second=float(
                u @ relative.second
                + 2.0 * omega * (n @ relative.rate)
                + alpha * across
                - omega**2 * s
            ),
            varies=True,
        )
        if isinstance(joint, Rolling):
            radius = float(self.run.system.numbers[f"{joint.name}.radius"])
            yield LoopVector(
                "offset", (joint.name, "n"), body, radius, angle + 0.5 * np.pi, omega, alpha
            )

    def _rod(self, joint: Any, relative: Relative) -> LoopVector:
        r = float(np.hypot(*relative.d))
        u = relative.d / r
        n = np.array([-u[1], u[0]])
        r_rate, omega = float(u @ relative.rate), float(n @ relative.rate) / r
        varies = isinstance(joint, DistanceDriver)
        return LoopVector(
            "rod",
            (joint.name,),
            "",
            r,
            float(np.arctan2(u[1], u[0])),
            omega,
            second=(float(n @ relative.second) - 2.0 * r_rate * omega) / r,
            r_rate=r_rate if varies else 0.0,
            r_second=float(u @ relative.second) + r * omega**2 if varies else 0.0,
            varies=varies,
        )


def joint_coordinates(joint: Any) -> tuple[str, ...]:
    """Names of the free coordinates of a joint; a driver has none."""
    return tuple(joint.coordinates) if joint.role == "joint" else ()


# -- Equations of the loops: Σ r e^{iθ} = 0, its two lines, and their derivatives --------------


@dataclass(frozen=True)
class VectorSymbols:
    """The symbols of a vector; derivatives that are zero by its kind are None.

    `rate`, `second`: ω and α of what it turns with; None where that is the ground.
    `r_rate`, `r_second`: None where the length is constant.
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

    `vector`: Σ r e^{iθ} = 0.
    `positions`, `velocities`, `accelerations`: Along x and y.
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
    """The symbols of a vector with its numbers."""
    links = ["ground", *(body.name for body in solution.mechanism.bodies)]
    index, length = vector.index, solution.system.length
    link_index: tuple[str, ...] = index
    if vector.body:
        link_index = (str(links.index(vector.body) + 1),)
    # a body between the same joints as another one is told apart by its number
    if vector.kind == "link" and len(index) > 2:
        index = (*index[:2], *link_index)
    letter = "s" if vector.kind == "slide" else "r"
    rotates = vector.body != "ground"

    def known(letter: str, index: tuple[str, ...], value: float, dots: int = 0) -> Symbol:
        return Symbol(letter, index, vanishing(value, floor), dots)

    rates = length * floor
    return VectorSymbols(
        r=Symbol(letter, index, vector.r),
        angle=Symbol("θ", index, vector.angle),
        rate=known("ω", link_index, vector.rate) if rotates else None,
        second=known("α", link_index, vector.second) if rotates else None,
        r_rate=Symbol(letter, index, vanishing(vector.r_rate, rates), 1) if vector.varies else None,
        r_second=(
            Symbol(letter, index, vanishing(vector.r_second, rates), 2) if vector.varies else None
        ),
    )


def loop_equations(solution: Solution, loop: VectorLoop, floor: float = 0.0) -> LoopEquations:
    """The equations of a loop in symbols with numbers.

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
    across, across_sign = Factor(one.angle, ("sin", "cos")[axis]), (-1, 1)[axis]
    r, rate, second = one.r, one.rate, one.second
    if order == 0:
        return [Term(sign, [Factor(r), along])]
    found = []
    if order == 1:
        if one.r_rate:
            found.append(Term(sign, [Factor(one.r_rate), along]))
        if rate:
            found.append(Term(sign * across_sign, [Factor(r), Factor(rate), across]))
        return found
    if one.r_second:
        found.append(Term(sign, [Factor(one.r_second), along]))
    if rate and second:
        if one.r_rate:
            found.append(Term(sign * across_sign, [Factor(one.r_rate), Factor(rate), across], 2))
        found.append(Term(-sign, [Factor(r), Factor(rate, power=2), along]))
        found.append(Term(sign * across_sign, [Factor(r), Factor(second), across]))
    return found


# -- Equations of rates of what vectors do not go through: teeth, wheels, cams, couplings ------


@dataclass(frozen=True)
class Condition:
    """The equations of rates, and of accelerations where they are written out, of one element.

    `words`: What it says.
    """

    element: str
    words: str
    equations: tuple[Equation, ...]


def conditions(solution: Solution, instant: int, floor: float) -> list[Condition]:
    """One of every gear pair, rack, rolling wheel, cam, coupling and other joint that is no side of
    a vector loop.
    """
    found = _Conditions(solution, instant, floor)
    machine, through = solution.mechanism, {one.name for one in edges(solution)}
    others = []
    for joint in machine.joints:
        loose = solution.analysis == "simulate" and joint.can_separate
        if isinstance(joint, (Gear, Rolling)) and not loose:
            wheels = isinstance(joint, Gear) or joint.on_radius is not None
            others.append(found.wheels(joint) if wheels else found.line(joint))
        elif isinstance(joint, RackPinion) and not loose:
            others.append(found.line(joint))
        elif joint.name not in through and joint.rows and not loose:
            others.append(found.rows(joint))
    others += [found.rows(contact) for contact in machine.contacts if contact.closed]
    return [one for one in [*others, *map(found.coupling, machine.couplings)] if one.equations]


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
        relative = relative_motion(self.run, joint.i, joint.j, self.k)
        square = float(relative.d @ relative.d)
        rate = float(relative.d[0] * relative.rate[1] - relative.d[1] * relative.rate[0]) / square
        second = (
            float(relative.d[0] * relative.second[1] - relative.d[1] * relative.second[0]) / square
        )
        second -= 2.0 * float(relative.d @ relative.rate) / square * rate
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
        relative = relative_motion(self.run, i, j, self.k)
        h = self.run[i.body]
        angle = float(h.angle[self.k]) + beta
        w, alpha = float(h.omega[self.k]), float(h.alpha[self.k])
        u = np.array([np.cos(angle), np.sin(angle)])
        n = np.array([-u[1], u[0]])
        rate = float(u @ relative.rate + w * (n @ relative.d))
        second = float(
            u @ relative.second
            + 2.0 * w * (n @ relative.rate)
            + alpha * (n @ relative.d)
            - w * w * (u @ relative.d)
        )
        floor = self.floor * self.run.system.length
        return float(u @ relative.d), vanishing(rate, floor), vanishing(second, floor)

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
        relative = relative_motion(self.run, *part.ends, self.k)
        r = float(np.hypot(*relative.d))
        rate = float(relative.d @ relative.rate) / r
        across = float(relative.d[0] * relative.rate[1] - relative.d[1] * relative.rate[0]) / r
        second = float(relative.d @ relative.second) / r + across * across / r
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
                if abs(J.value) > PRINTED_NONE_FINE:
                    yield Term(1, [Factor(J), Factor(v)])
            J = Symbol("J", (*index, link), float(row[3 * b + 2]))
            if abs(J.value) > PRINTED_NONE_FINE * self.run.system.length:
                yield Term(1, [Factor(J), Factor(self._rate(body, 0))])
