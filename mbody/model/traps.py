"""Traps: numbers that are allowed and hardly ever meant. A note names the number, its unit, what it
comes to and what was likely meant.

Judged are ratios to the mechanism's own sizes, and the earth's gravity by its value. What is said
plainly brings no note: a number with its unit, ``cg = [0, 0]``, ``inertia = 0``, a point or a shape
that shows how large a body is.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any, NamedTuple

from mbody.laws import Constant, ConstantAcceleration, ConstantSpeed, Polynomial
from mbody.laws.expression import Expression
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.element import Marker, Polar, listed
from mbody.model.joints import Joint
from mbody.model.loads import CentrifugalField, Force, Gravity
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named
from mbody.quantities import Formula
from mbody.quantities.formula import LeftOut
from mbody.quantities.units import DIMENSIONS, UNIT_SYSTEMS, UnitSystem, unit_system

#: Bodies up to which each has a note of its own.
EACH = 8
#: Two numbers are one by this part: of the mechanism's size, of a weight or an acceleration, and of
#: an angle by so many radians.
SAME, SAME_GRAVITY, SAME_ANGLE = 1e-4, 0.02, 2e-3
#: A plain speed [rad/time] looks like revolutions per minute from here on, if it is so round; a
#: plain angle [rad] above a turn like degrees, if it is: of a direction, of what counts turns.
SPEED, ROUND, HALF_DEGREE, DEGREES = 110.0, 10.0, 0.5, 15.0
#: Lengths of a link by which its mass centre may lie outside of its points; and the part by which
#: one that was left out, or that is read in other axes, may.
FAR, OUTSIDE = 10.0, 0.1
#: Radii of gyration in lengths: the greatest of a link, of what may be a wheel, and the least.
LINK, WHEEL, POINT = 1.5, 25.0, 0.01
#: Density of steel [kg/m³]. The most that a body may weigh, in steel cubes of the mechanism's size,
#: a link in cubes of its length; the least, that of a wire of a 5000th of its length in diameter.
STEEL, CUBES, LINK_CUBES, WIRE = 7850.0, 10.0, 3.0, math.pi / 4.0 / 5000.0**2
#: Ratio of masses by length in which a link may stand to the others.
UNLIKE = 300.0
#: A unit of mass above so many kilograms, and the plain masses in it that are seldom meant.
HEAVY, MUCH = 100, 0.1
#: Last part of names of numbers that may be angles.
ANGLES = {"angle", "free_angle", "low", "high", "law", "value", "c0"}
#: Laws whose value and rate at t = 0 were given as numbers.
GIVEN = (Constant, ConstantSpeed, ConstantAcceleration, Polynomial, Expression)

Place = tuple[float, float]


def traps(mechanism: Mechanism) -> Iterator[str]:
    """The notes of all kinds.

    >>> from mbody import Gravity, makers
    >>> machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), units="mm-N-s")
    >>> machine.add(Gravity("gravity", y=-9.81))
    >>> next(traps(machine))[:46]
    "'gravity' is -9.81 mm/s², 0.001 of the earth's"
    """
    seen = _Seen(mechanism)
    for kind in (_gravity, _weights, _speeds, _degrees, _turned_twice, _centres, _plain_masses):
        yield from kind(seen)
    for kind in (_forgotten, _masses, _inertias, _without_length, _same_places, _plain_forces):
        yield from kind(seen)


def of_each(found: Mapping[str, str], whole: str) -> list[str]:
    """The notes on some bodies; of many one that counts them, names the first and goes on with
    what is to be said of all.

    >>> of_each({f"rod{n}": "" for n in range(9)}, "have no length")[0][:30]
    "9 bodies have no length ('rod0"
    """
    if len(found) <= EACH:
        return list(found.values())
    does, _, tail = whole.partition(":")
    return [f"{len(found)} bodies {does} ({listed(found)}){':' if tail else ''}{tail}"]


# -- Sizes and places of a description ---------------------------------------------------------


class _Pin(NamedTuple):
    """A pin on one of its bodies: its point and place there, the other body and the place on it."""

    joint: Joint
    point: Any
    place: Place
    other: str
    opposite: Place


class _Seen:
    """A mechanism with what the notes ask of it."""

    def __init__(self, machine: Mechanism) -> None:
        self.machine, self.units, self.scope = machine, machine.units, machine.parameters.scope()
        self.bodies = {body.name: body for body in machine.bodies}
        self.points = {one.name: _outline(one) for one in (*machine.bodies, machine.ground)}
        self.pins: dict[str, list[_Pin]] = {name: [] for name in self.points}
        self.other: dict[str, list[Joint]] = {name: [] for name in self.points}
        self.coupled = {name for one in machine.couplings for name in one.bodies}
        near: dict[str, set[str]] = {name: set() for name in self.points}
        for joint in machine.joints:
            for one, two in ((joint.i, joint.j), (joint.j, joint.i)):
                place = self.place(one)
                self.points[one.body].append(place)
                if joint.pin:
                    pin = _Pin(joint, one.point, place, two.body, self.place(two))
                    self.pins[one.body].append(pin)
                else:
                    self.other[one.body].append(joint)
        for element in (*machine.joints, *machine.couplings):
            for name in element.bodies:
                near[name].update(element.bodies)
        #: Extent of a body's points and shapes.
        self.lengths = {name: _span(points) for name, points in self.points.items()}
        #: Bodies that are joined, part by part, and the size of the part that a body belongs to.
        self.parts: list[list[str]] = []
        self.sizes: dict[str, float] = {}
        for name in self.bodies:
            if name not in self.sizes:
                self._take_part(name, near)

    def _take_part(self, name: str, near: Mapping[str, set[str]]) -> None:
        """The bodies that are joined to one, and their size: the greatest extent of a body, or of
        the pins on the fixed link.
        """
        found, todo = {name}, [name]
        while todo:
            new = near[todo.pop()] - found - {"ground"}
            found |= new
            todo += new
        held = [pin.opposite for one in found for pin in self.pins[one] if pin.other == "ground"]
        size = max([_span(held), *map(self.reach, found)])
        self.parts.append([one for one in self.bodies if one in found])
        self.sizes |= dict.fromkeys(found, size)

    def place(self, marker: Marker) -> Place:
        """Coordinates of a marker in the axes of its body."""
        body: Any = self.machine[marker.body]
        point = marker.point
        return _xy(body.points[point] if isinstance(point, str) else point)

    def plain(self, name: str) -> bool:
        """Whether a number was given without a unit."""
        formula = self.machine.formulas.get(name)
        return formula is None or not formula.has_units(self.scope)

    def mass(self, body: Body) -> float:
        return body.mass or (body.weight or 0.0) / self.machine.g

    def text(self, value: float, dimension: str, name: str = "") -> str:
        """A number with its unit; that of this name as it was given."""
        given = self.machine.formulas.get(name)
        if given is not None and given.literal and not self.plain(name):
            return given.text
        return f"{value:.5g} {self.units.of(dimension)}"

    def heaviness(self, name: str) -> str:
        """A body's mass or weight, as it was given."""
        key = "weight" if self.bodies[name].weight else "mass"
        value = self.text(getattr(self.bodies[name], key) or 0.0, key, f"{name}.{key}")
        return f"a {key} of {value}"

    def reach(self, name: str) -> float:
        """Extent of a body with its mass centre."""
        return _span([*self.points[name], _xy(self.bodies[name].cg)])

    def is_link(self, name: str) -> bool:
        """Whether a body is held by pins at different places."""
        return len({pin.place for pin in self.pins[name]}) > 1

    def floats(self, name: str) -> bool:
        """Whether it is a link between others, on pins alone, and hardly a wheel."""
        alone = not self.other[name] and name not in self.coupled
        return alone and self.is_link(name) and all(p.other != "ground" for p in self.pins[name])

    def guided(self, name: str) -> bool:
        """Whether joints keep its angle, so that it has no use for an inertia."""
        return any(one.parallel and "ground" in one.bodies for one in self.other[name])

    def drawn(self, name: str) -> bool:
        """Whether its axes are those of a drawing: its pins have the coordinates that they have on
        the other bodies, and are not all at the origin.
        """
        least = SAME * self.sizes[name]
        here = all(math.dist(pin.place, pin.opposite) <= least for pin in self.pins[name])
        return here and any(math.hypot(*pin.place) > least for pin in self.pins[name])


def _xy(point: Any) -> Place:
    """Cartesian coordinates of a point."""
    if isinstance(point, Polar):
        return point.r * math.cos(point.angle), point.r * math.sin(point.angle)
    return float(point[0]), float(point[1])


def _outline(body: Body) -> list[Place]:
    """A body's points, and as many around them as a round shape reaches."""
    found = [_xy(point) for point in body.points.values()]
    for shape in body.shapes.values():
        r = getattr(shape, "radius", 0.0)
        found += [(-r, -r), (r, r)] if r else []
    return found


def _box(points: Iterable[Place]) -> tuple[Place, Place]:
    x, y = zip(*points, strict=True)
    return (min(x), min(y)), (max(x), max(y))


def _span(points: list[Place]) -> float:
    """Diagonal of the box around points."""
    return math.dist(*_box(points)) if points else 0.0


def _beyond(place: Place, points: list[Place]) -> float:
    """How far a place is from that box."""
    low, high = _box(points)
    return math.hypot(*(max(a - c, c - b, 0.0) for a, b, c in zip(low, high, place, strict=True)))


def _left_out(body: Body) -> bool:
    """Whether nobody gave its mass centre."""
    return not isinstance(body.cg, Polar) and isinstance(body.cg[0], LeftOut)


def _pair(place: Place) -> str:
    return f"[{place[0]:.5g}, {place[1]:.5g}]"


# -- Gravity, speeds and angles ----------------------------------------------------------------


def _fields(seen: _Seen) -> list[tuple[str, Place]]:
    """The constant gravities that are not zero."""
    laws: list[tuple[str, Any, Any]]
    laws = [(one.name, one.x, one.y) for one in seen.machine.loads if isinstance(one, Gravity)]
    both = [
        (name, x, y) for name, x, y in laws if isinstance(x, Constant) is isinstance(y, Constant)
    ]
    found = [(name, (x.value, y.value)) for name, x, y in both if isinstance(x, Constant)]
    return [(name, vector) for name, vector in found if any(vector)]


def _gravity(seen: _Seen) -> Iterator[str]:
    """In another unit of length, upwards, twice."""
    fields, own = _fields(seen), seen.units.g
    for name, (x, y) in fields:
        size, value = math.hypot(x, y), y if x == 0.0 else math.hypot(x, y)
        given = seen.machine.formulas.get(f"{name}.y")
        systems = list(map(unit_system, UNIT_SYSTEMS))
        alike = [one.length for one in systems if abs(size / one.g - 1.0) < SAME_GRAVITY]
        plain = seen.plain(f"{name}.x") and seen.plain(f"{name}.y")
        if plain and alike and seen.units.length not in alike:
            yield (
                f"'{name}' is {seen.text(value, 'acceleration')}, {size / own:.3g} of the earth's "
                f"{seen.text(own, 'acceleration')}: {value:g} {alike[0]}/s² are likely meant; "
                f'write the unit, as in "{value:g} {alike[0]}/s^2"'
            )
        if y > 0.0 and y >= abs(x) and not (given and given.text.lstrip().startswith("+")):
            up = seen.text(y, "acceleration")
            yield (
                f"'{name}' points upwards: its y is {up}, and the y axis goes up; weights need "
                f'y = -{up}; if it is meant, write its sign, as in "+{up}"'
            )
    for (one, (ax, ay)), (two, (bx, by)) in combinations(fields, 2):
        if ax * bx + ay * by > (1.0 - SAME_GRAVITY) * math.hypot(ax, ay) * math.hypot(bx, by):
            both = seen.text(math.hypot(ax + bx, ay + by), "acceleration")
            yield f"'{one}' and '{two}' add up to a gravity of {both}: leave one of them out"


def _weights(seen: _Seen) -> Iterator[str]:
    """Weights that are forces beside gravity, and weights that no gravity makes forces."""
    machine, fields = seen.machine, _fields(seen)
    for load in machine.loads:
        law = getattr(load, "value", None)
        if type(load) is not Force or not isinstance(law, Constant) or load.at.body == "ground":
            continue
        name, body = load.at.body, seen.bodies[load.at.body]
        force = law.value * math.cos(load.angle), law.value * math.sin(load.angle)
        near = math.dist(seen.place(load.at), _xy(body.cg)) <= OUTSIDE * seen.sizes[name]
        for field, (x, y) in fields if near and not load.follows else ():
            mass = seen.mass(body)
            weight = mass * math.hypot(x, y)
            if weight and math.dist(force, (mass * x, mass * y)) <= SAME_GRAVITY * weight:
                yield (
                    f"'{load.name}', {seen.text(abs(law.value), 'force')}, is the weight of "
                    f"'{name}', which '{field}' gives it already: leave one of them out"
                )
    given = [(body.name, body.weight) for body in machine.bodies if body.weight]
    acts = any(isinstance(one, Gravity | CentrifugalField) for one in machine.loads)
    if given and not acts and isinstance(machine.g, LeftOut):
        more = "" if len(given) == 1 else f", {len(given) - 1} more have theirs"
        yield (
            f"'{given[0][0]}' has a weight of {seen.text(given[0][1], 'force')}{more}, and there "
            "is no gravity: weights are masses alone; add gravity, y = "
            f"{seen.text(-machine.g, 'acceleration')}, or, if it is left out on purpose, give g, "
            "by which weights become masses"
        )


def _speeds(seen: _Seen) -> Iterator[str]:
    """Plain speeds that look like revolutions per minute."""
    unit, found = seen.units.time, []
    for one in seen.machine.drivers:
        law: Any = getattr(one, "law", None)
        keys = ("law", "law.speed", "law.c1")
        if (
            one.angular
            and isinstance(law, GIVEN)
            and all(seen.plain(f"{one.name}.{key}") for key in keys)
        ):
            found.append((f"'{one.name}'", float(law.derivatives(0.0)[1])))
    settings = seen.machine.simulation
    for name, start in (settings.start if settings else {}).items():
        found.append((f"'{name}' at the start", start.get("omega", 0.0)))
    for name, value in found:
        if isinstance(value, Formula) or abs(value) < SPEED or value % ROUND:
            continue
        yield (
            f"the speed of {name} is {value:g} rad/{unit}, which are {value * 30 / math.pi:.0f} "
            f'rpm: write the unit, "{value:g} rpm" or "{value:g} rad/{unit}"'
        )


def _degrees(seen: _Seen) -> Iterator[str]:
    """Plain angles in radians that look like degrees."""
    found = [
        (f"{body.name}.guess.angle", body.guess.angle, HALF_DEGREE)
        for body in seen.machine.bodies
        if body.guess.angle is not None
    ]
    for element in seen.machine:
        for name, value in element.numbers().items():
            if not isinstance(value, float) or abs(value) < 2.0 * math.pi or value % HALF_DEGREE:
                continue
            if name.rpartition(".")[2] not in ANGLES or not seen.plain(name):
                continue
            if dimension_named(seen.machine, name) == DIMENSIONS["angle"]:
                turns = {"law", "limits", "free_angle"} & set(name.split("."))
                found.append((name, value, DEGREES if turns else HALF_DEGREE))
    for name, value, step in found:
        if abs(value) >= 2.0 * math.pi and value % step == 0.0 and seen.plain(name):
            owner, _, key = name.partition(".")
            yield (
                f"'{owner}': {key} is {value:g} rad, {value / (2.0 * math.pi):.4g} turns, for "
                f'plain angles are radians here: write the unit, "{value:g} deg" or '
                f'"{value:g} rad"'
            )


def _turned_twice(seen: _Seen) -> Iterator[str]:
    """Bodies that are drawn at an angle and driven to the same angle."""
    for one in seen.machine.drivers:
        law: Any = getattr(one, "law", None)
        if type(one) is not AngleDriver or one.relative_to != "ground":
            continue
        name, value = one.body, float(law(0.0)) if isinstance(law, GIVEN) else 0.0
        pins = [pin.place for pin in seen.pins[name] if pin.other == "ground"]
        ends = [pin.place for pin in seen.pins[name] if pin.other != "ground"]
        ends = ends or list(map(_xy, seen.bodies[name].points.values()))
        if len(pins) != 1 or seen.bodies[name].guess.angle is not None or len(ends) > 2:
            continue
        for x, y in ends:
            dx, dy = x - pins[0][0], y - pins[0][1]
            angle = math.atan2(dy, dx)
            along = math.hypot(dx, dy) <= SAME * seen.sizes[name] or abs(angle) < SAME_ANGLE
            off = abs(math.remainder(value - angle, 2.0 * math.pi))
            upright = abs(math.sin(2.0 * angle)) < SAME_ANGLE
            if along or off > SAME_ANGLE or (upright and not seen.drawn(name)):
                continue
            drawn, more, whole = map(math.degrees, (angle, value, angle + value))
            yield (
                f"'{name}' is drawn at {drawn:.4g}° and '{one.name}' turns it by {more:.4g}° from "
                f"there, to {whole:.4g}°: begin at 0°, or draw it along x; if it is meant, give "
                f"'{name}' its guess, \"{more:.4g} deg\""
            )
            break


# -- Mass centres, masses and inertias ---------------------------------------------------------


def _centres(seen: _Seen) -> Iterator[str]:
    """Mass centres that were left out of a drawing, or are far from their link."""
    missing: dict[str, str] = {}
    for name, body in seen.bodies.items():
        points, cg = seen.points[name], _xy(body.cg)
        if not seen.mass(body) or not points:
            continue
        length, gap = seen.lengths[name], _beyond(cg, points)
        away, at = seen.text(gap, "length"), f"{_pair(cg)} {seen.units.length}"
        drawn = seen.drawn(name) and gap > OUTSIDE * (length or seen.sizes[name])
        first = seen.pins[name][0].place if drawn else cg
        if drawn and _left_out(body):
            missing[name] = (
                f"cg of '{name}' is not given and is taken at {at}, {away} outside of its points, "
                "which are in the axes of a drawing: give it there, or write cg = [0, 0]"
            )
        elif drawn and length and any(cg) and _in_link_axes(cg, points, first):
            yield (
                f"cg of '{name}' is {at}, {away} outside of its points: these are in the axes of a "
                f"drawing, and it seems to count from {_pair(first)}; give it in their axes"
            )
        elif not _left_out(body) and length and gap > FAR * length:
            yield (
                f"cg of '{name}' is {at}, {gap / length:.3g} times its length "
                f"{seen.text(length, 'length')} outside of its points: is it in another unit? If "
                "it is meant, give the body a point there"
            )
    yield from of_each(
        missing,
        "have no cg, which is taken at [0, 0], outside of their points: these are in the axes of a "
        "drawing; give each cg there, or write cg = [0, 0]",
    )


def _in_link_axes(cg: Place, points: list[Place], first: Place) -> bool:
    """Whether a mass centre is within the points if it counts from their first pin, along the axes
    of the drawing or along the link.
    """
    end = max(points, key=lambda one: math.dist(one, first))
    x, y = (b - a for a, b in zip(first, end, strict=True))
    c, s = x / math.hypot(x, y), y / math.hypot(x, y)
    turned = (c * cg[0] - s * cg[1], s * cg[0] + c * cg[1])
    places = [(first[0] + dx, first[1] + dy) for dx, dy in (cg, turned)]
    return any(_beyond(place, points) <= OUTSIDE * _span(points) for place in places)


def _plain_masses(seen: _Seen) -> list[str]:
    """Plain masses in a unit of hundreds of kilograms, which are seldom meant."""
    one, unit = float(seen.units.unit("mass").ratio), seen.units.of("mass")
    if one < HEAVY:
        return []
    pound = seen.units.length in ("in", "ft")
    other, ratio = ("lb", 0.45359237) if pound else ("kg", 1.0)
    found = {
        name: f"body '{name}' has a mass of {mass:g} {unit}, which is "
        f"{mass * one / ratio:.4g} {other}: write the unit, as in '{mass:g} {other}', if it "
        "is meant otherwise"
        for name, mass in ((body.name, body.mass or 0.0) for body in seen.machine.bodies)
        if mass >= MUCH and seen.plain(f"{name}.mass")
    }
    return of_each(
        found,
        f"have plain masses, which are in {unit}: write the unit, as in '{MUCH:g} {other}', if "
        "they are meant otherwise",
    )


def _forgotten(seen: _Seen) -> Iterator[str]:
    """Inertia without mass, one link of several without mass, mass without inertia."""
    left_out = [name for name, one in seen.bodies.items() if one.mass is one.weight is None]
    found: dict[str, str] = {}
    for part in seen.parts:
        links = [name for name in part if seen.is_link(name)]
        bare = [n for n in links if n in left_out and not seen.bodies[n].inertia]
        massive = [name for name in links if seen.mass(seen.bodies[name])]
        # a crank with many throws is often taken as balanced
        if len(bare) == 1 and 1 < len(massive) == len(links) - 1 and len(seen.pins[bare[0]]) == 2:
            yield (
                f"'{bare[0]}' has no mass, while the other links, {listed(massive)}, have theirs: "
                "give it, or write mass = 0"
            )
    for name, body in seen.bodies.items():
        cg, pins = _xy(body.cg), [pin.place for pin in seen.pins[name]]
        spins = any(math.dist(place, cg) <= SAME * seen.sizes[name] for place in pins)
        moves = seen.is_link(name) if _left_out(body) else not spins
        if body.inertia and name in left_out and moves and not seen.guided(name):
            inertia = seen.text(body.inertia, "inertia", f"{name}.inertia")
            yield (
                f"'{name}' has an inertia of {inertia} and no mass: it has no weight, and its mass "
                "centre moves without force; give its mass, or write mass = 0"
            )
        alone = isinstance(body.inertia, LeftOut) and body.spread is None
        extends = _span([point for point in seen.points[name] if point != cg])
        if alone and not seen.guided(name) and seen.mass(body) and (spins or extends):
            key = "weight" if body.weight else "mass"
            found[name] = (
                f"body '{name}' has a {key} and no inertia: it is taken as a point mass at its "
                "mass centre, I = 0; give its inertia, or write inertia = 0"
            )
    yield from of_each(
        found,
        "have a mass or weight and no inertia: they are taken as point masses at their mass "
        "centres, I = 0; give their inertias, or write inertia = 0",
    )


def _masses(seen: _Seen) -> Iterator[str]:
    """Masses out of all proportion to lengths, or to those of the other links."""
    for part in seen.parts:
        yield from _masses_of(seen, part)


@functools.lru_cache
def _steel(units: UnitSystem) -> float:
    """A unit of mass in a unit of volume, by the density of steel."""
    return float(units.unit("mass").ratio / units.unit("length").ratio ** 3) / STEEL


def _masses_of(seen: _Seen, part: list[str]) -> Iterator[str]:
    to_steel = _steel(seen.units)
    mass = {name: seen.mass(seen.bodies[name]) for name in part}
    mass = {name: value for name, value in mass.items() if value}
    links, whole = [name for name in part if seen.is_link(name)], seen.sizes[part[0]]
    cubes = {n: m * to_steel / seen.lengths[n] ** 3 for n, m in mass.items() if seen.lengths[n]}
    solid = len(links) > 1 and all(cubes.get(name, 0.0) > 1.0 for name in links)
    own = {name: seen.lengths[name] if seen.floats(name) else whole for name in links}
    by_length = {name: mass[name] / length for name, length in own.items() if name in mass}
    middle = sorted(by_length.values())[len(by_length) // 2] if len(by_length) > 2 else math.nan
    for name, value in mass.items():
        ratio, cube = by_length.get(name, middle) / middle, cubes.get(name, 1.0)
        great = value * to_steel / whole**3 if links else 0.0
        heavy = name in links and (solid or (seen.floats(name) and cube > LINK_CUBES))
        if great > CUBES:
            size = seen.text(whole, "length")
            why = f"{great:.3g} steel cubes of the mechanism's size, {size}"
        elif heavy or cube < WIRE:
            wire = "less than a steel wire with a diameter of a 5000th of its length"
            why = wire if cube < WIRE else f"{cube:.3g} steel cubes of its length"
            why += f", {seen.text(seen.lengths[name], 'length')}"
        elif ratio > UNLIKE or ratio < 1.0 / UNLIKE:
            why = f"{ratio:.3g} times the other links, by their lengths"
        else:
            continue
        light = cube < WIRE or ratio < 1.0
        remedy = "write mass = 0" if light else "give it a point or a shape of its size"
        yield (
            f"'{name}' has {seen.heaviness(name)}, {why}: is it in another unit? If it is meant, "
            f"{remedy}"
        )


def _inertias(seen: _Seen) -> Iterator[str]:
    """Radii of gyration that no body of that size has."""
    for name, body in seen.bodies.items():
        mass, length = seen.mass(body), seen.lengths[name] or seen.reach(name)
        if not mass or not body.inertia or not length or seen.guided(name):
            continue
        k = math.sqrt(body.inertia / mass)
        most = LINK * length if seen.floats(name) else max(WHEEL * length, seen.sizes[name])
        if k > most or (k < POINT * length and seen.is_link(name)):
            inertia = seen.text(body.inertia, "inertia", f"{name}.inertia")
            remedy = "give it a point or a shape so far out" if k > most else "write inertia = 0"
            yield (
                f"'{name}': an inertia of {inertia} with {seen.heaviness(name)} is a radius of "
                f"gyration of {seen.text(k, 'length')}, {k / length:.3g} times its length, "
                f"{seen.text(length, 'length')}: is one of them in another unit? If it is meant, "
                f"{remedy}"
            )


# -- What has no length, and pins that are one -------------------------------------------------


def _without_length(seen: _Seen) -> Iterator[str]:
    """Links whose pins are all at one place, or two of them; springs without free length."""
    found = {}
    for name in seen.bodies:
        own = seen.pins[name]
        if len(own) > 1 and not seen.other[name] and not seen.is_link(name):
            joints = listed(pin.joint.name for pin in own)
            found[name] = (
                f"body '{name}' has no length: its joints {joints} are at one point of it; give "
                "its points their places"
            )
            continue
        first: dict[Place, _Pin] = {}
        # cranks of engines have pins behind each other
        for two in own if all(pin.other != "ground" for pin in own) else ():
            one = first.setdefault(two.place, two)
            if {type(one.point), type(two.point)} == {str} and one.point != two.point:
                yield (
                    f"points '{one.point}' and '{two.point}' of '{name}' are both at "
                    f"{_pair(one.place)} {seen.units.length}, with no length between joints "
                    f"'{one.joint.name}' and '{two.joint.name}': give them their places, or use "
                    "one point"
                )
    whole = "have no length: their joints are at one point of each; give their points their places"
    yield from of_each(found, whole)
    for load in seen.machine.loads:
        law = getattr(load, "law", None)
        if law is None and isinstance(getattr(load, "free_length", None), LeftOut):
            yield (
                f"'{load.name}' has no free_length, which is taken as 0 {seen.units.length}, so "
                "that it pulls at every length: give it, or write free_length = 0"
            )


def _same_places(seen: _Seen) -> Iterator[str]:
    """Pins at one place between the same two bodies, and loads between the places of a pin."""
    pins: dict[Any, str] = {}
    for one in (*seen.machine.joints, *seen.machine.loads):
        places = one.places()
        if places.keys() != {"i", "j"} or not getattr(
            one, "pin", getattr(one, "along_line", False)
        ):
            continue
        ends = frozenset((place.body, seen.place(place)) for place in places.values())
        if ends in pins and one.role == "load":
            yield (
                f"'{one.name}' has no length: it goes between the two places that "
                f"'{pins[ends]}' joins; give it other places"
            )
        elif ends in pins:
            yield (
                f"'{pins[ends]}' and '{one.name}' are one joint: both join "
                f"{listed(place.body for place in places.values())} at the same places; leave one "
                "of them out"
            )
        elif one.role == "joint":
            pins[ends] = one.name


def _plain_forces(seen: _Seen) -> Iterator[str]:
    """Plain forces in a system that is named by its mass, where newtons are often meant."""
    units = seen.units
    middle = (*units.name.split("-"), "", "")[1]
    if middle != units.mass or units.force in ("N", "lbf"):
        return
    for load in seen.machine.loads:
        for name, value in load.numbers().items():
            dimension = dimension_named(seen.machine, name) if value else None
            if dimension is not None and dimension.mass == 1 and seen.plain(name):
                unit, usual = units.of(dimension), units.of(dimension).replace(units.force, "N")
                yield (
                    f"'{name}' is {value:.5g} {unit}: in units '{units.name}' the unit of force "
                    f"is the {units.force}; write the unit, as in '{value:.5g} {usual}', if it is "
                    "meant otherwise"
                )
                return
