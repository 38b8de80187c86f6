"""A mechanism at given driver values as vectors, slides and rods between directions.

A direction is the angle of a body or of a massless rod. Drivers of angles, slides, welds, gears and
couplings of angles are linear rows between directions; they are solved first, so that every
direction is ρ α + offset with one unknown angle α, or known. What is left are pairs: two places
that coincide, a place on a line of another body, or two places at a distance.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.position.assembly_analysis import set_driver_values
from mbody.core.tolerances import BOX_FACTOR_NONE, DIRECTION_SAME
from mbody.model.primitives import ConstraintPrimitive
from mbody.system.system import System


class NotCovered(Exception):
    """A clause that names the part without polynomial equations for the certified search."""


@dataclass(frozen=True)
class Pair:
    """Places of two bodies, from the mass centres in link axes as complex numbers.

    `kind`: "pin", "slide" or "rod".
    `i`, `j`: Bodies; the ground is the last.
    `value`: Length of a rod; of a slide the coordinate of the place on j along `axis`.
    `axis`: Unit vector on i across which the place on j slides.
    `rod`: Direction of a rod.
    `free`: Whether `value` is unknown: that of a driver of a length which is released.
    """

    kind: str
    i: int
    j: int
    position_i: complex
    position_j: complex
    value: float = 0.0
    axis: complex = 0j
    rod: int = -1
    free: bool = False

    @property
    def rows(self) -> int:
        """Number of equations."""
        return 2 if self.kind == "pin" else 1


class Linkage:
    """Directions and pairs of one design, its drivers at given values but for one released, seen
    from a base, by default the ground. A driver of an angle that is released leaves its row out,
    one of a length has an unknown value.

    `bodies`: Number of moving bodies; index of the ground.
    `names`: Of the bodies, the ground last.
    `variable`: By direction: the unknown angle that it follows, named by one of its directions; -1
      where it is known.
    `ratio`, `offset`: ρ, and the constant [rad].
    `meshed`: Directions that gears or couplings turn: their angles count up to rotations by teeth.

    Raises NotCovered for cams, own joints, rolling on lines, couplings of lengths, formulas of
    positions.
    """

    def __init__(
        self,
        system: System,
        driver_values: dict[str, float],
        t: float = 0.0,
        released: str = "",
        base: str = "ground",
    ) -> None:
        self.system, self.released = system, released
        self.names = [*(body.name for body in system.mechanism.bodies), "ground"]
        self.bodies = len(self.names) - 1
        # another base and the ground change places: a kinematic inversion
        self.index = dict(system.bodies)
        own = self.index[base]
        self.index[base], self.index["ground"] = self.bodies, own
        self.names[own], self.names[-1] = "ground", base
        self.pairs: list[Pair] = []
        self.meshed: set[int] = set()
        self._forms: list[tuple[dict[int, float], float]] = [
            ({k: 1.0}, 0.0) for k in range(self.bodies)
        ]
        self._forms.append(({}, 0.0))
        work = system.work()
        self.driver_values = set_driver_values(system, work, t, driver_values)
        found = self._primitives()
        wheels: list[tuple[Any, ConstraintPrimitive]] = []
        for e, (element, primitive) in found.items():
            value = float(work.signal[system.layout.primitive_signal[e], 0])
            if primitive.kind == "gear":
                wheels.append((element, primitive))
            else:
                self._enter(element, primitive, value)
        points = _CoincidentPlaces(self.pairs, system.length)
        for element, primitive in wheels:
            self._mesh(element, primitive, points)
        if self.meshed and base != "ground":
            raise NotCovered("gears or couplings turn beside a driver between two moving links")
        self._finish()

    def _primitives(self) -> dict[int, tuple[Any, ConstraintPrimitive]]:
        """LoopRows that are always on, with their elements, by their index."""
        system = self.system
        made = {one.name: one.primitives(system.numbers) for one in system.mechanism.constraints}
        dependent = {d.name for d in system.drivers} - {d.name for d in system.independent_drivers}
        found = {}
        for e, (element, part) in enumerate(system.owners):
            if element.name in dependent:
                raise NotCovered(f"driver '{element.name}' follows positions")
            own = made.get(element.name, [])
            # beyond those of the element are rows of friction and of contacts, which begin off
            left_out = element.name == self.released and own[part].kind == "angle"
            if part < len(own) and not own[part].active_set and not left_out:
                found[e] = element, own[part]
        return found

    def _enter(self, element: Any, primitive: ConstraintPrimitive, value: float) -> None:
        kind, p = primitive.kind, [float(number) for number in primitive.parameters]
        i, j = self.index[primitive.i], self.index[primitive.j]
        free = element.name == self.released
        if kind == "angle":
            self._relate({i: -1.0, j: 1.0}, value - p[0], element)
        elif kind == "sum" and all(part.kind == "angle" for part in primitive.parts):
            self._couple(element, primitive, p)
        elif kind in ("revolute", "prismatic", "coordinate", "distance"):
            positions = complex(p[0], p[1]), complex(p[2], p[3])
            if kind == "prismatic":
                self._relate({i: -1.0, j: 1.0}, -p[6], element)
            if kind == "revolute":
                self.pairs.append(Pair("pin", i, j, *positions))
            elif kind == "distance":
                if value <= 0.0 and not free:
                    raise NotCovered(f"the length of '{element.name}' is {value:g}")
                rod = len(self._forms)
                self._forms.append(({rod: 1.0}, 0.0))
                self.pairs.append(Pair("rod", i, j, *positions, value, rod=rod, free=free))
            else:
                axis = complex(p[4], p[5])
                self.pairs.append(Pair("slide", i, j, *positions, value, axis, free=free))
        else:
            raise NotCovered(f"'{element.name}' is a {type(element).__name__}")

    def _couple(self, element: Any, primitive: ConstraintPrimitive, p: list[float]) -> None:
        factors: dict[int, float] = {}
        for n, part in enumerate(primitive.parts):
            for name, sign in ((part.i, -1.0), (part.j, 1.0)):
                k = self.index[name]
                factors[k] = factors.get(k, 0.0) + sign * p[1 + 7 * n]
        self._relate(factors, p[0], element, modulo=True)
        self.meshed |= set(factors) - {self.bodies}

    def _mesh(self, wheels: Any, primitive: ConstraintPrimitive, points: _CoincidentPlaces) -> None:
        """ρ_i θ_i + ρ_j θ_j + phase is the direction of the line of centres."""
        p = [float(number) for number in primitive.parameters]
        i, j = self.index[primitive.i], self.index[primitive.j]
        positions = complex(p[0], p[1]), complex(p[2], p[3])
        rods = [one for one in self.pairs if one.kind == "rod" and (one.i, one.j) == (i, j)]
        rods = [
            one
            for one in rods
            if abs(one.position_i - positions[0]) + abs(one.position_j - positions[1]) == 0.0
        ]
        if rods:
            carrier, rotation = rods[0].rod, 0.0
        else:
            line = points.line((i, positions[0]), (j, positions[1]))
            if line is None:
                raise NotCovered(f"no body carries both centres of '{wheels.name}'")
            carrier, rotation = line
        factors, direction = self._forms[carrier]
        if not factors:  # a known direction: within half a revolution of the phase, as in closing
            rotation = p[6] + math.remainder(rotation + direction - p[6], 2.0 * math.pi) - direction
        row = {carrier: -1.0}
        for body, factor in ((i, p[4]), (j, p[5])):
            row[body] = row.get(body, 0.0) + factor
        self._relate(row, rotation - p[6], wheels, modulo=True)
        self.meshed |= {i, j} - {self.bodies}

    def _relate(
        self, factors: dict[int, float], value: float, element: Any, modulo: bool = False
    ) -> None:
        """Solve Σ factor · direction = value for one of the unknowns that it has."""
        row: dict[int, float] = {}
        for k, factor in factors.items():
            terms, constant = self._forms[k]
            value -= factor * constant
            for v, c in terms.items():
                row[v] = row.get(v, 0.0) + factor * c
        row = {v: c for v, c in row.items() if abs(c) > BOX_FACTOR_NONE}
        if not row:
            if abs(math.remainder(value, 2.0 * math.pi)) > DIRECTION_SAME and not modulo:
                raise NotCovered(f"'{element.name}' contradicts angles that others impose")
            if modulo:
                raise NotCovered(f"'{element.name}' repeats angles that others impose")
            return
        pivot = min(row, key=lambda v: (abs(abs(row[v]) - 1.0), -v))
        others = {v: -c / row[pivot] for v, c in row.items() if v != pivot}
        own = value / row[pivot]
        for k, (terms, constant) in enumerate(self._forms):
            if pivot not in terms:
                continue
            factor = terms[pivot]
            new = {v: c for v, c in terms.items() if v != pivot}
            for v, c in others.items():
                new[v] = new.get(v, 0.0) + factor * c
            new = {v: c for v, c in new.items() if abs(c) > BOX_FACTOR_NONE}
            self._forms[k] = new, constant + factor * own

    def _finish(self) -> None:
        self.variable, self.ratio, self.offset = [], [], []
        for k, (terms, constant) in enumerate(self._forms):
            if len(terms) > 1:
                raise NotCovered(f"the angle of '{self.names[k]}' is made of two unknown ones")
            v, ratio = next(iter(terms.items()), (-1, 0.0))
            self.variable.append(v)
            self.ratio.append(ratio)
            self.offset.append(constant)

    def angle(self, direction: int, angles: dict[int, float]) -> float:
        """A direction [rad] by the unknown angles."""
        v = self.variable[direction]
        return self.offset[direction] + (self.ratio[direction] * angles[v] if v >= 0 else 0.0)

    def poses(self, states: list[State]) -> np.ndarray:
        """Coordinates of the mass centres, the ground last: (states, 3·bodies + 3)."""
        found = np.zeros((len(states), 3 * self.bodies + 3))
        for row, (angles, places) in zip(found, states, strict=True):
            for b in range(self.bodies):
                rotation = math.remainder(self.angle(b, angles), 2.0 * math.pi)
                row[3 * b : 3 * b + 3] = places[b].real, places[b].imag, rotation
        return found


#: Unknown angles by name and places of bodies, as far as they are known.
State = tuple[dict[int, float], dict[int, complex]]


class _CoincidentPlaces:
    """Places of bodies that pins keep together."""

    def __init__(self, pairs: list[Pair], length: float) -> None:
        self.step = 1e-9 * length
        # dictionaries in place of sets, whose order is that of hashes of numbers
        self.coincident: dict[tuple[int, int, int], dict[tuple[int, complex], None]] = {}
        for pair in pairs:
            if pair.kind == "pin":
                whole = self._coincident_with(pair.i, pair.position_i) | self._coincident_with(
                    pair.j, pair.position_j
                )
                for body, position in whole:
                    self.coincident[self._key(body, position)] = whole

    def _key(self, body: int, position: complex) -> tuple[int, int, int]:
        return body, round(position.real / self.step), round(position.imag / self.step)

    def _coincident_with(self, body: int, position: complex) -> dict[tuple[int, complex], None]:
        return self.coincident.get(self._key(body, position), {(body, position): None})

    def line(
        self, one: tuple[int, complex], other: tuple[int, complex]
    ) -> tuple[int, float] | None:
        """A body that carries both places, and the direction from one to the other in its axes."""
        theirs = dict(iter(self._coincident_with(*other)))
        for body, position in sorted(self._coincident_with(*one), key=lambda place: -place[0]):
            if body in theirs and abs(theirs[body] - position) > self.step:
                return body, cmath.phase(theirs[body] - position)
        return None


# -- Assur groups, in an order in which they can be solved -------------------------------------
# A perfect matching of rows and unknowns directs the graph of both, and the groups are its strong
# components: they do not depend on the matching (Sljoka, Shai and Whiteley 2011). Where there are
# more rows than unknowns, whatever a row to spare can be exchanged with is one group (the
# overdetermined part of Dulmage and Mendelsohn), for it is not known beforehand which row to omit.

#: Why such linkages are searched without a certificate.
TOO_FEW = "its joints are too few for its links"


class TooFewRows(Exception):
    """LoopRows that cannot determine all unknowns, whatever their numbers are."""


@dataclass(frozen=True)
class Group:
    """Bodies whose places, and angles, the pairs determine together.

    `angles`: Unknown angles, by the names of `Linkage.variable`.
    """

    bodies: tuple[int, ...]
    angles: tuple[int, ...]
    pairs: tuple[int, ...]


def assur_groups(linkage: Linkage, known: int = -1) -> list[Group]:
    """The groups of a linkage, in the order of solution, one angle taken as known."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import maximum_bipartite_matching

    names, rows = _pattern(linkage, known)
    if not names:
        return []
    pattern = np.zeros((len(rows), len(names)), dtype=np.int8)
    for r, (_, columns) in enumerate(rows):
        pattern[r, columns] = 1
    match = maximum_bipartite_matching(csr_matrix(pattern), perm_type="column")
    matched = np.flatnonzero(match >= 0)
    if len(matched) < len(names):
        raise TooFewRows
    graph = np.zeros((len(names), len(names)), dtype=np.int8)
    graph[match[matched]] |= pattern[matched]
    spare = np.flatnonzero(match < 0)
    if spare.size:
        _join(graph, _exchangeable(pattern, match, spare))
    # x and y of a body, and both rows of a pin, are solved at one time
    for n in range(0, 2 * linkage.bodies, 2):
        _join(graph, np.array([n, n + 1]))
    for k, (p, _) in enumerate(rows[1:], 1):
        if rows[k - 1][0] == p and match[k] >= 0 and match[k - 1] >= 0:
            _join(graph, match[k - 1 : k + 1])
    return _ordered(linkage, names, rows, pattern, match, graph)


def _pattern(
    linkage: Linkage, known: int
) -> tuple[list[tuple[str, int]], list[tuple[int, list[int]]]]:
    """Names of the unknowns, and of every row its pair and the unknowns in it."""
    angles = sorted({v for v in linkage.variable if v not in (-1, known)})
    names = [(axis, b) for b in range(linkage.bodies) for axis in "xy"]
    names += [("angle", v) for v in angles if _bodies_of(linkage, v)]
    column = {name: k for k, name in enumerate(names)}
    rows = []
    for p, pair in enumerate(linkage.pairs):
        ends = [b for b in (pair.i, pair.j) if b < linkage.bodies]
        rotating = {linkage.variable[b] for b in ends} - {-1, known}
        angular = [column["angle", v] for v in sorted(rotating)]
        for axes in ("x", "y") if pair.kind == "pin" else ("xy",):
            places = [column[axis, b] for b in ends for axis in axes]
            rows.append((p, [*places, *angular]))
    return names, rows


def _bodies_of(linkage: Linkage, v: int) -> list[int]:
    """Bodies that turn with an unknown angle; a rod's own direction is no unknown of the count."""
    return [b for b in range(linkage.bodies) if linkage.variable[b] == v]


def _exchangeable(pattern: np.ndarray, match: np.ndarray, spare: np.ndarray) -> np.ndarray:
    """Unknowns of all rows that an alternating path leads to from a row to spare."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order

    count = len(match)
    owner = {int(c): r for r, c in enumerate(match) if c >= 0}
    after = np.zeros((count, count), dtype=np.int8)
    for r in range(count):
        for c in np.flatnonzero(pattern[r]):
            after[r, owner[int(c)]] = 1
    graph = csr_matrix(after)
    reached = {int(k) for r in spare for k in breadth_first_order(graph, int(r))[0]}
    return np.flatnonzero(pattern[sorted(reached)].any(axis=0))


def _join(graph: np.ndarray, columns: np.ndarray) -> None:
    """Make unknowns one component."""
    graph[columns, np.roll(columns, 1)] = 1


def _ordered(
    linkage: Linkage,
    names: list[tuple[str, int]],
    rows: list[tuple[int, list[int]]],
    pattern: np.ndarray,
    match: np.ndarray,
    graph: np.ndarray,
) -> list[Group]:
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(csr_matrix(graph), connection="strong")
    needs: dict[int, set[int]] = {k: set() for k in range(count)}
    for a, b in zip(*np.nonzero(graph), strict=True):
        if label[a] != label[b]:
            needs[int(label[a])].add(int(label[b]))
    order: list[int] = []
    while len(order) < count:
        order += [k for k in needs if k not in order and needs[k] <= set(order)]
    place = {k: n for n, k in enumerate(order)}
    # a pair belongs where the last of its unknowns is found
    position: dict[int, int] = {}
    for r, (p, _) in enumerate(rows):
        last = max((place[int(label[c])] for c in np.flatnonzero(pattern[r])), default=0)
        position[p] = max(position.get(p, 0), last)
    found = []
    for n, k in enumerate(order):
        own = [names[c] for c in np.flatnonzero(label == k)]
        found.append(
            Group(
                bodies=tuple(sorted({b for axis, b in own if axis == "x"})),
                angles=tuple(v for axis, v in own if axis == "angle"),
                pairs=tuple(sorted(p for p, where in position.items() if where == n)),
            )
        )
    return found
