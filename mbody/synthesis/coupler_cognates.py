"""Cognates: other four-bars and slider-cranks whose coupler draws the same curve.

With the crank O₁A, the rocker O₂B, the point P of the coupler and λ = (P − A)/(B − A), a constant,
three four-bars draw the curve of P (Roberts 1875, Chebyshev 1878). Their pivots are O₁, O₂ and
O₃ = O₁ + λ (O₂ − O₁), and

    about O₁ and O₃:  O₁A′ = AP,  A′P = O₁A,  A′C′ = λ O₁A,  O₃C′ = λ O₂B,
    about O₂ and O₃:  O₂B″ = BP,  B″P = O₂B,  B″C″ = (1 − λ) O₂B,  O₃C″ = (1 − λ) O₁A,

so that each of their links turns as a link of the first one. Of a slider-crank the pin B goes along
a line; the one about O₁ has C′ = O₁ + λ (B − O₁) on the line turned and stretched by λ, the other
two have links without end.
"""

from __future__ import annotations

import cmath
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from mbody.analysis.driven.driven import kinematics
from mbody.analysis.driven.transmission import grashof_class
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core.presentation import Presented
from mbody.core.tolerances import SYNTHESIS_POINT_MET
from mbody.errors import ModelError
from mbody.files.model import save
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.element import Marker, listed, takes_one_design
from mbody.model.joints import Joint, PinSlot, Prismatic, Revolute
from mbody.model.mechanism import Mechanism
from mbody.solution.declared_result import ItemTable, Sentence, Value
from mbody.solution.solution import Solution
from mbody.system.system import System


@dataclass(frozen=True, eq=False, repr=False)
class Cognate(Presented):
    """One mechanism with the same coupler curve.

    Attributes
    ----------
    mechanism : Mechanism
        Its driver follows the law of the first one: P is at the same place at the same time.
    lengths : dict
        Of its links, and of the ground; of a slider-crank without the guide.
    turning : dict
        Of each link the link of the first mechanism that turns as it does.
    grashof : str
        Its class; empty of slider-cranks.

    Examples
    --------
    >>> import mbody
    >>> first = mbody.synthesis.cognates(mbody.gallery.load("hoekens"), "coupler.P").first
    >>> first.mechanism.name[:7]
    'Hoekens'
    """

    mechanism: Mechanism
    lengths: dict[str, float]
    turning: dict[str, str]
    grashof: str = ""

    declared = (
        Value("name", value=lambda one: one.mechanism.name),
        "lengths turning grashof",
    )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the mechanism to a model file; see `mbody.save`."""
        save(self.mechanism, path)

    def __repr__(self) -> str:
        return f"Cognate({self.mechanism.name}{f': {self.grashof}' if self.grashof else ''})"


class CognateList(list[Cognate], Presented):
    """The cognates of a mechanism.

    Attributes
    ----------
    first : Cognate
        The mechanism itself, with the same numbers.
    notes : tuple of str

    Examples
    --------
    >>> import mbody
    >>> len(mbody.synthesis.cognates(mbody.gallery.load("hoekens"), "coupler.P"))
    2
    """

    def __init__(self, first: Cognate, found: Iterator[Cognate], notes: tuple[str, ...]) -> None:
        super().__init__(found)
        self.first, self.notes = first, notes

    @property
    def mechanism(self) -> Mechanism:
        """The first one."""
        return self.first.mechanism

    @property
    def declared(self) -> tuple[Any, ...]:
        """Lengths and classes, and which links turn alike."""
        lengths = [Value("", key, "length", _length(key)) for key in self.first.lengths]
        columns = (*lengths, Value("", "class", "text", "grashof"))
        title = "FOUR-BAR" if "ground" in self.first.lengths else "SLIDER-CRANK"
        rows = {"the first": self.first} | {f"cognate {n}": one for n, one in enumerate(self, 1)}
        said = [
            f"links of cognate {n} turn as those of the first: "
            + ", ".join(f"{key} as {other}" for key, other in one.turning.items())
            for n, one in enumerate(self, 1)
        ]
        table = ItemTable("", columns, title, lambda found: rows)
        return table, Sentence(lambda found: [*said, *found.notes])


def _length(key: str) -> Callable[[Cognate], float]:
    return lambda one: one.lengths[key]


@dataclass(frozen=True)
class _Loop:
    """The first mechanism: vectors of links in their axes, places in the world's."""

    system: System
    crank: str
    coupler: str
    rocker: str
    pivots: tuple[complex, complex]
    vectors: tuple[complex, complex, complex]
    p: complex
    angles: tuple[float, float, float]
    guide: float | None = None

    @property
    def ratio(self) -> complex:
        """λ."""
        return self.p / self.vectors[1]

    def angle(self, body: str) -> float:
        """Place of a link of the first mechanism."""
        return self.angles[(self.crank, self.coupler, self.rocker).index(body)]


def cognates(model: Mechanism | System, point: str) -> CognateList:
    """The cognates of a four-bar (two), or of a slider-crank (one), for a point of its coupler.

    Parameters
    ----------
    model : Mechanism or System
        Of one design. Links beside the four-bar or slider-crank are left out.
    point : str
        The point of the coupler, such as ``"coupler.P"``.

    Returns
    -------
    CognateList
        Models without masses, whose point ``"coupler.P"`` draws the same curve. The link that turns
        as the driven one is driven by the same law, so that P is at the same place at the same
        time; where that is the coupler, another driver may be wanted.

    Raises
    ------
    ModelError
        For a point that is on no coupler, or at one of its pins (whose curve is a circle or a
        line), and a driver that is not an angle of one of the three links against the ground.
    SolveError
        As of `mbody.kinematics`.

    Notes
    -----
    Source: K. H. Hunt, *Kinematic Geometry of Mechanisms* (1978), 7.6; J. M. McCarthy and
    G. S. Soh, *Geometric Design of Linkages* (2011), 2.7.

    Examples
    --------
    >>> import mbody
    >>> found = cognates(mbody.gallery.load("hoekens"), "coupler.P")
    >>> [one.grashof for one in found]
    ['Grashof: double rocker', 'Grashof: crank-rocker']
    """
    system = as_system(model)
    takes_one_design("cognates", system.batch)
    run = kinematics(system, [0.0])
    loop = _loop_of(run, point)
    law = _law(loop)
    first = _first(loop)
    notes = ["the cognates have no masses and no loads"]
    left = [
        body.name
        for body in system.mechanism.bodies
        if body.name not in (loop.crank, loop.coupler, loop.rocker)
    ]
    if left:
        notes.append(f"without {listed(left)}, which {'is' if len(left) == 1 else 'are'} beside it")
    if loop.guide is not None:
        return CognateList(first, iter([_slider_cognate(loop, law)]), tuple(notes))
    return CognateList(first, _four_bar_cognates(loop, law), tuple(notes))


def _law(loop: _Loop) -> tuple[str, Any]:
    """The link that is driven, and the law of its driver."""
    drivers = loop.system.independent_drivers
    links = [loop.crank, loop.coupler, *([] if loop.guide is not None else [loop.rocker])]
    if len(drivers) == 1 and isinstance(drivers[0], AngleDriver):
        driver = drivers[0]
        if driver.bodies[0] == "ground" and driver.bodies[1] in links:
            return driver.bodies[1], driver.law
    raise ModelError(
        f"cognates: '{loop.system.mechanism.name}' must be driven by one angle against the "
        f"ground, of {listed(links)}: the cognates have the same driver"
    )


def _loop_of(run: Solution, point: str) -> _Loop:
    """The four-bar or slider-crank whose coupler has the point."""
    body, _, _ = str(point).partition(".")
    place = run.point(point)
    machine = run.mechanism
    if body == "ground":
        raise ModelError(f"cognates: '{point}' is on the ground: name a point of a coupler", point)
    grounded, sliding = [], []
    for joint in machine.joints:
        if not isinstance(joint, Revolute) or body not in joint.bodies:
            continue
        other = joint.j.body if joint.i.body == body else joint.i.body
        pins = [one for one in machine.joints if set(one.bodies) == {"ground", other}]
        if any(isinstance(one, Revolute) for one in pins):
            grounded.append((joint, other, next(one for one in pins if isinstance(one, Revolute))))
        elif any(isinstance(one, Prismatic) for one in pins):
            sliding.append((joint, other, next(one for one in pins if isinstance(one, Prismatic))))
    slots = [
        j for j in machine.joints if isinstance(j, PinSlot) and set(j.bodies) == {"ground", body}
    ]
    driven = {name for driver in machine.drivers for name in driver.bodies}
    grounded.sort(key=lambda one: one[1] not in driven)
    if len(grounded) == 2:
        made = _four_bar(run, body, grounded[0], grounded[1], _first_point(place))
    elif len(grounded) == 1 and len(sliding) == 1:
        made = _slider(
            run, body, grounded[0], sliding[0][0], sliding[0][2], sliding[0][1], _first_point(place)
        )
    elif len(grounded) == 1 and len(slots) == 1 and slots[0].i.body == "ground":
        made = _slider(run, body, grounded[0], slots[0], slots[0], body, _first_point(place))
    else:
        raise ModelError(
            f"cognates: '{body}' is no coupler of a four-bar or slider-crank: it needs pins to two "
            f"links that are pinned to the ground, or to one and to a slider; it has "
            f"{len(grounded)} and {len(sliding) + len(slots)}",
            body,
        )
    tolerance = SYNTHESIS_POINT_MET * abs(made.vectors[1])
    if min(abs(made.p), abs(made.p - made.vectors[1])) <= tolerance:
        raise ModelError(
            f"cognates: '{point}' is at a pin, whose path is a circle or a line: name another "
            f"point of '{body}'",
            point,
        )
    return made


def _first_point(history: Any) -> complex:
    return complex(float(history.x[0]), float(history.y[0]))


def _end(run: Solution, joint: Joint, body: str) -> complex:
    """Place of a joint on one of its bodies."""
    return _first_point(run.point(joint.i if joint.i.body == body else joint.j))


def _angles(run: Solution, names: tuple[str, ...]) -> tuple[float, ...]:
    return tuple(float(run[name].angle[0]) for name in names)


def _four_bar(run: Solution, coupler: str, first: Any, second: Any, p: complex) -> _Loop:
    (pin_a, crank, pivot_a), (pin_b, rocker, pivot_b) = first, second
    angles = _angles(run, (crank, coupler, rocker))
    a, b = _end(run, pin_a, coupler), _end(run, pin_b, coupler)
    o1, o2 = _end(run, pivot_a, "ground"), _end(run, pivot_b, "ground")
    unit = [cmath.exp(-1j * angle) for angle in angles]
    vectors = ((a - o1) * unit[0], (b - a) * unit[1], (b - o2) * unit[2])
    return _Loop(
        run.system,
        crank,
        coupler,
        rocker,
        (o1, o2),
        vectors,
        (p - a) * unit[1],
        (angles[0], angles[1], angles[2]),
    )


def _slider(
    run: Solution, coupler: str, first: Any, pin_b: Joint, guide: Joint, slider: str, p: complex
) -> _Loop:
    pin_a, crank, pivot = first
    angles = _angles(run, (crank, coupler, slider))
    a, b, o1 = _end(run, pin_a, coupler), _end(run, pin_b, coupler), _end(run, pivot, "ground")
    side = "i" if guide.i.body == "ground" else "j"
    line = float(run.system.numbers.angle(guide, side))
    unit = [cmath.exp(-1j * angle) for angle in angles]
    vectors = ((a - o1) * unit[0], (b - a) * unit[1], 0j)
    # of the guide the place of B, through which its line goes
    return _Loop(
        run.system,
        crank,
        coupler,
        slider,
        (o1, b),
        vectors,
        (p - a) * unit[1],
        (angles[0], angles[1], angles[2]),
        line,
    )


def _first(loop: _Loop) -> Cognate:
    """The mechanism itself."""
    a, b, c = (abs(vector) for vector in loop.vectors)
    turning = {one: one for one in (loop.crank, loop.coupler, loop.rocker)}
    if loop.guide is not None:
        return Cognate(loop.system.mechanism, {"crank": a, "rod": b}, turning)
    d = abs(loop.pivots[1] - loop.pivots[0])
    lengths = {"ground": d, "crank": a, "coupler": b, "rocker": c}
    return Cognate(loop.system.mechanism, lengths, turning, grashof_class(d, a, b, c))


def _four_bar_cognates(loop: _Loop, law: tuple[str, Any]) -> Iterator[Cognate]:
    """Those about the first and the third pivot, and about the third and the second."""
    (o1, o2), (a, b, c) = loop.pivots, loop.vectors
    ratio, complement = loop.ratio, 1.0 - loop.ratio
    third = o1 + ratio * (o2 - o1)
    crank, coupler, rocker = loop.crank, loop.coupler, loop.rocker
    turning = {"crank": coupler, "coupler": crank, "rocker": rocker}
    plane = {"A": 0j, "B": ratio * a, "P": a}
    yield _four_bar_cognate(loop, law, (o1, third), loop.p, plane, ratio * c, turning, 2)
    turning = {"crank": crank, "coupler": rocker, "rocker": coupler}
    plane = {"A": 0j, "B": -complement * c, "P": c - complement * c}
    yield _four_bar_cognate(loop, law, (third, o2), complement * a, plane, loop.p - b, turning, 3)


def _four_bar_cognate(
    loop: _Loop,
    law: tuple[str, Any],
    pivots: tuple[complex, complex],
    crank: complex,
    plane: dict[str, complex],
    rocker: complex,
    turning: dict[str, str],
    which: int,
) -> Cognate:
    """A four-bar of vectors in the axes of the links that its links turn as."""
    machine, driver = _with_crank(loop, law, pivots, crank, plane, turning, which)
    guess = loop.angle(turning["rocker"])
    machine.add(
        Body("rocker", points={"O": (0.0, 0.0), "B": _point(rocker)}, guess=guess),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O2", "ground.O2", "rocker.O"),
        driver,
    )
    lengths = abs(pivots[1] - pivots[0]), abs(crank), abs(plane["B"]), abs(rocker)
    named = dict(zip(("ground", "crank", "coupler", "rocker"), lengths, strict=True))
    return Cognate(machine, named, turning, grashof_class(*lengths))


def _slider_cognate(loop: _Loop, law: tuple[str, Any]) -> Cognate:
    """The slider-crank about the same pivot."""
    (o1, b0), (a, _, _) = loop.pivots, loop.vectors
    ratio = loop.ratio
    place = o1 + ratio * (b0 - o1)
    turning = {"crank": loop.coupler, "coupler": loop.crank}
    plane = {"A": 0j, "B": ratio * a, "P": a}
    machine, driver = _with_crank(loop, law, (o1, place), loop.p, plane, turning, 2)
    line = float(loop.guide or 0.0) + cmath.phase(ratio)
    machine.add(
        Body("slider", points={"B": (0.0, 0.0)}, guess=line),
        Revolute("B", "coupler.B", "slider.B"),
        Prismatic("guide", Marker("ground", "O2", angle=line), "slider.B"),
        driver,
    )
    return Cognate(machine, {"crank": abs(loop.p), "rod": abs(ratio * a)}, turning)


def _with_crank(
    loop: _Loop,
    law: tuple[str, Any],
    pivots: tuple[complex, complex],
    crank: complex,
    plane: dict[str, complex],
    turning: dict[str, str],
    which: int,
) -> tuple[Mechanism, AngleDriver]:
    """Crank and coupler of a cognate, its pivots O1 and O2 on the ground, and its driver."""
    first = loop.system.mechanism
    machine = Mechanism(
        f"{first.name}: cognate {which - 1}",
        units=first.units,
        ground={"O1": _point(pivots[0]), "O2": _point(pivots[1])},
    )
    points = {name: _point(vector) for name, vector in plane.items()}
    driven = next(name for name, other in turning.items() if other == law[0])
    machine.add(
        Body(
            "crank",
            points={"O": (0.0, 0.0), "A": _point(crank)},
            guess=loop.angle(turning["crank"]),
        ),
        Body("coupler", points=points, guess=loop.angle(turning["coupler"])),
        Revolute("O1", "ground.O1", "crank.O"),
        Revolute("A", "crank.A", "coupler.A"),
    )
    return machine, AngleDriver("motor", driven, law[1])


def _point(value: complex) -> tuple[float, float]:
    return float(value.real), float(value.imag)
