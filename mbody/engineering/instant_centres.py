"""Instant centres of velocity of all pairs of bodies, and the centrodes that they trace."""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.engineering.motion_polygons import (
    AT_REST,
    at_unit_speed,
    check_moving,
    motion_that_begins,
    relative_motion,
)
from mbody.errors import ModelError
from mbody.model.joints import Fixed, Gear, Prismatic, RackPinion, Revolute, Rolling
from mbody.solution.declared_result import Value, data_only, declared_data
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution, as_solution
from mbody.system.read_only import Locked

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.quantities.output_units import OutputUnits


Array = np.ndarray

#: What is said of instants at which nothing moves yet.
BEGINNING = "the instant centres are those that it begins with, from accelerations"


@dataclass(frozen=True, eq=False)
class InstantCentre(Locked, Presented):
    """The instant centre of one pair of bodies: arrays (instants,).

    Attributes
    ----------
    bodies : pair of str
    x, y : arrays
        Its place, world axes; NaN where it is at infinity or there is none.
    direction : array
        Where it is at infinity the angle [rad] of the line towards it, across the sliding, from
        −π/2 to π/2; NaN elsewhere.
    kind : tuple of str
        "finite", "infinite" (the bodies slide on each other without turning), or "none" (they do
        not move against each other).
    permanence : str
        "fixed" where a pin or a slide on the ground keeps it, "permanent" where one between two
        moving bodies does, else "instantaneous".

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.slider_crank(1.0, 3.0, speed=1.0), [0.2])
    >>> pole = mbody.engineering.instant_centres(run)["slider", "ground"]
    >>> pole.kind, pole.permanence
    (('infinite',), 'fixed')
    """

    bodies: tuple[str, str]
    x: Array
    y: Array
    direction: Array
    kind: tuple[str, ...]
    permanence: str

    declared = (
        Value("bodies"),
        *data_only("x", "y", dimension="length"),
        Value("direction", "", "angle"),
        *data_only("kind", "permanence"),
    )

    def homogeneous(self, length: float = 1.0) -> Array:
        """(X, Y, W) of unit length, places by `length`: (instants, 3); NaN where there is none."""
        infinite = np.array([kind == "infinite" for kind in self.kind])
        x = np.where(infinite, np.cos(self.direction), self.x / length)
        y = np.where(infinite, np.sin(self.direction), self.y / length)
        found = np.column_stack([x, y, np.where(infinite, 0.0, 1.0)])
        return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


@dataclass(frozen=True, eq=False)
class InstantCentres(Inherited):
    """The instant centres of all pairs of bodies, the ground among them.

    ``centres["coupler", "ground"]`` is one of them, in either order of the names.

    Attributes
    ----------
    pairs : tuple of InstantCentre
        n (n − 1)/2 of n bodies, in the order of the description, the ground last.
    length : float
        The model length, to which places that are one are compared.
    units : OutputUnits or None
        Of places in sentences; None for those of the model.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.3])
    >>> len(mbody.engineering.instant_centres(run).pairs)
    6
    """

    pairs: tuple[InstantCentre, ...] = field(default=())
    length: float = 1.0
    units: OutputUnits | None = field(default=None, repr=False)

    def __getitem__(self, names: tuple[str, str]) -> InstantCentre:
        found = None if isinstance(names, str) else self._by_bodies.get(frozenset(names))
        if found is not None:
            return found
        known = ", ".join(dict.fromkeys(f"'{name}'" for one in self.pairs for name in one.bodies))
        raise ModelError(
            f"there is no instant centre of {names!r}: give two of the bodies {known}, as in "
            'centres["coupler", "ground"]'
        )

    def __len__(self) -> int:
        return len(self.pairs)

    @functools.cached_property
    def _numbers(self) -> dict[str, int]:
        return {name: number for number, name in enumerate(self.bodies, 1)}

    @functools.cached_property
    def _by_bodies(self) -> dict[frozenset[str], InstantCentre]:
        return {frozenset(one.bodies): one for one in self.pairs}

    @functools.cached_property
    def bodies(self) -> tuple[str, ...]:
        """All bodies in the order of their numbers: the ground is link 1."""
        names = dict.fromkeys(name for one in self.pairs for name in one.bodies)
        return ("ground", *(name for name in names if name != "ground"))

    def symbol(self, one: InstantCentre) -> str:
        """The letter I with the numbers of both links, as in books: I13, I2,10."""
        numbers = sorted(self._numbers[name] for name in one.bodies)
        return "I" + ("," if numbers[-1] > 9 else "").join(map(str, numbers))

    def coincident(self, instant: int = 0) -> list[list[InstantCentre]]:
        """Centres that are one point at an instant, those of two at least together."""
        groups: list[list[InstantCentre]] = []
        firsts = np.empty(len(self.pairs), dtype=complex)
        for one in self.pairs:
            if one.kind[instant] != "finite":
                continue
            place = complex(one.x[instant], one.y[instant])
            others = firsts[: len(groups)]
            size = np.maximum(np.abs(others), max(self.length, abs(place)))
            alike = np.flatnonzero(np.abs(others - place) <= tol.POINT_SAME * size)
            if len(alike):
                groups[alike[0]].append(one)
            else:
                firsts[len(groups)] = place
                groups.append([one])
        return [group for group in groups if len(group) > 1]

    def sentences(self, instant: int = 0) -> list[str]:
        """Sentences on centres at infinity, on coincident centres, and on bodies that move as one.

        Examples
        --------
        >>> import mbody
        >>> run = mbody.kinematics(mbody.gallery.load("slider_crank"), [0.1])
        >>> print(instant_centres(run).sentences()[0])
        I14 is at infinity, towards 90°: the motion of slider against ground is parallel to 0°
        """
        found = []
        for one in self.pairs:
            i, j = sorted(one.bodies, key=self._numbers.__getitem__, reverse=True)
            if one.kind[instant] == "infinite":
                towards = float(one.direction[instant])
                across = towards + (0.5 if towards <= 0.0 else -0.5) * np.pi
                where = f"{self.symbol(one)} is at infinity, towards {_degrees(towards)}"
                found.append(
                    f"{where}: the motion of {i} against {j} is parallel to {_degrees(across)}"
                )
            elif one.kind[instant] == "none":
                found.append(f"there is no {self.symbol(one)}: {i} does not move against {j}")
        for group in self.coincident(instant):
            first = group[0]
            names = sorted(self.symbol(one) for one in group)
            x, y = (round(float(v[instant]) / self.length, 12) for v in (first.x, first.y))
            size = 1.0 if self.units is None else self.units.size("length")
            x, y = (part * self.length / size + 0.0 for part in (x, y))
            place = f"({x:.6g}, {y:.6g})"
            found.append(f"{', '.join(names[:-1])} and {names[-1]} are one point, {place}")
        return found

    def collinearity(self) -> float:
        """How far the three centres of any three bodies are from one line (Aronhold and Kennedy's
        theorem): the greatest |det| of their homogeneous coordinates, scaled to unit vectors.
        """
        at = {frozenset(one.bodies): one.homogeneous() for one in self.pairs}
        names = list(dict.fromkeys(name for one in self.pairs for name in one.bodies))
        worst = 0.0
        for three in itertools.combinations(names, 3):
            sides = [at[frozenset(pair)] for pair in itertools.combinations(three, 2)]
            for rows in zip(*sides, strict=True):
                if np.isfinite(rows).all():
                    worst = max(worst, abs(float(np.linalg.det(np.array(rows)))))
        return worst

    def data(self, units: OutputUnits | None = None) -> list[dict[str, Any]]:
        """Plain lists of all centres, for JSON; in units of the model, or in others."""
        return [{"symbol": self.symbol(one)} | declared_data(one, units) for one in self.pairs]


def instant_centres(run: Solution) -> InstantCentres:
    """Instant centres of velocity (poles) of all pairs of bodies.

    The instant centre of two bodies is the point at which both have the same velocity: with the
    velocity v(P) = u + ω k × P of each it is (−Δu_y : Δu_x : Δω) in homogeneous coordinates.

    Parameters
    ----------
    run : Solution
        Of one design, with velocities: kinematics, kinetostatics or simulate. Where the only driver
        is at rest, the centres are those of a motion at unit speed; where a motion begins from
        rest, those that it begins with, from accelerations. A note says so.

    Returns
    -------
    InstantCentres

    Raises
    ------
    ModelError
        For a batch, an analysis without velocities, or a mechanism of which nothing moves.

    Notes
    -----
    By Aronhold and Kennedy's theorem the three centres of three bodies are on one line:
    `InstantCentres.collinearity` says how nearly.

    Source: Uicker, Pennock, Shigley: *Theory of Machines and Mechanisms*, 3.12 to 3.15.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), [0.0])
    >>> pole = instant_centres(run)["coupler", "ground"]
    >>> round(float(pole.x[0]), 6), round(float(pole.y[0]), 6)
    (13.148531, 22.773924)
    """
    run = as_solution(run)
    check_moving(run, "instant centres are")
    found = _by_rates(run)
    if found is None:
        found = _by_rates(at_unit_speed(run))
    if found is None:
        raise ModelError(
            f"nothing moves in '{run.mechanism.name}', so that there are no instant centres: give "
            "a driver a speed, or take instants at which it moves"
        )
    return found


def _by_rates(run: Solution) -> InstantCentres | None:
    """Those of the velocities of a run; None where nothing moves."""
    names = [*run, "ground"]
    begins = motion_that_begins(run)
    omega, u = {}, {}
    for name, one in ((name, run[name]) for name in names):
        rotation = omega[name] = np.where(begins, one.alpha, one.omega)
        vx, vy = np.where(begins, one.ax, one.vx), np.where(begins, one.ay, one.vy)
        u[name] = vx + rotation * one.y, vy - rotation * one.x
    length = run.system.length
    # the velocity scale of all motion, as a rate
    size = np.max([np.abs(w) + np.hypot(*u[n]) / length for n, w in omega.items()], axis=0)
    if not size.any():
        return None
    kept = _keeping(run)
    pairs = []
    for i, j in itertools.combinations(names, 2):
        dx, dy = u[j][0] - u[i][0], u[j][1] - u[i][1]
        rotation = omega[j] - omega[i]
        slides, rotates = (
            np.hypot(dx, dy) / length > tol.RATE_NONE_INSTANT_CENTRE * size,
            np.abs(rotation),
        )
        rotates = rotates > tol.RATE_NONE_INSTANT_CENTRE * np.maximum(
            size, np.hypot(dx, dy) / length
        )
        kind = np.where(rotates, "finite", np.where(slides, "infinite", "none"))
        rate = np.where(rotates, rotation, np.nan)
        across = np.arctan2(dx, -dy)
        found = InstantCentre(
            (i, j),
            -dy / rate,
            dx / rate,
            np.where(kind == "infinite", _line(across), np.nan),
            tuple(kind.tolist()),
            "instantaneous",
        )
        joint = kept.get(frozenset((i, j)))
        pairs.append(found if joint is None else _of_joint(run, joint, (i, j)))
    notes = [note for note in run.notes if note.endswith(AT_REST)]
    units = run.mechanism.shown
    if begins.any():
        times = [f"{t:.6g}" for t in units.converted(run.t[begins][:3], "time")]
        more = f" and {begins.sum() - 3} more instants" if begins.sum() > 3 else ""
        at = f"{', '.join(times)} {units.of('time')}{more}"
        notes.append(f"at t = {at} the motion begins from rest: {BEGINNING}")
    return InstantCentres(tuple(pairs), length, units, **inherited(run, notes=notes))


def _degrees(angle: float) -> str:
    return f"{round(np.degrees(angle), 4) + 0.0:.6g}°"


def _line(angle: Array) -> Array:
    """Directions of lines [rad], above −π/2 and up to π/2."""
    line_angle = np.remainder(angle, np.pi)
    return np.where(
        line_angle > 0.5 * np.pi + tol.DIRECTION_ROUNDING, line_angle - np.pi, line_angle
    )


def _keeping(run: Solution) -> dict[frozenset[str], Revolute | Prismatic]:
    """The pin or the slide of pairs that have one."""
    joints = [one for one in run.mechanism.joints if isinstance(one, Revolute | Prismatic)]
    return {frozenset(joint.bodies): joint for joint in reversed(joints)}


def _of_joint(run: Solution, joint: Revolute | Prismatic, pair: tuple[str, str]) -> InstantCentre:
    """The centre that a joint keeps: exact also where its bodies hardly move."""
    nothing = np.full(len(run), np.nan)
    permanence = "fixed" if "ground" in pair else "permanent"
    if isinstance(joint, Revolute):
        pin = run.point(joint.i)
        kind = ("finite",) * len(run)
        return InstantCentre(pair, pin.x.copy(), pin.y.copy(), nothing, kind, permanence)
    guide = run[joint.i.body].angle + float(run.system.numbers.angle(joint, "i"))
    kind = ("infinite",) * len(run)
    across = _line(guide + 0.5 * np.pi)
    return InstantCentre(pair, nothing, nothing.copy(), across, kind, permanence)


@dataclass(frozen=True, eq=False)
class Centrodes(Inherited):
    """The paths of the instant centre of two bodies, on both: arrays (instants,).

    The moving centrode rolls on the fixed one.

    Attributes
    ----------
    fixed_x, fixed_y : arrays
        In the axes of the body that is taken as fixed: from the origin of the ground, or from that
        body's mass centre in its own axes.
    moving_x, moving_y : arrays
        From the mass centre of the moving body, in its axes.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.slider_crank(1.0, 3.0, speed=1.0), [0.2, 0.4])
    >>> found = mbody.engineering.centrodes(run, "crank")  # turns about a pin: one point
    >>> bool(abs(found.fixed_x).max() < 1e-12)
    True
    """

    fixed_x: Array
    fixed_y: Array
    moving_x: Array
    moving_y: Array


def centrodes(run: Solution, body: str, relative_to: str = "ground") -> Centrodes:
    """The fixed and the moving centrode of a body's motion.

    Parameters
    ----------
    run : Solution
        Of one design, with velocities.
    body : str
        The moving body.
    relative_to : str
        The body that is taken as fixed.

    Returns
    -------
    Centrodes
        NaN where both bodies do not turn against each other.

    Raises
    ------
    ModelError
        For a batch, an analysis without velocities, or a body that does not exist.

    Examples
    --------
    >>> import mbody
    >>> made = mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0)
    >>> run = mbody.kinematics(made, [0.0, 0.5, 1.0])
    >>> centrodes(run, "coupler").fixed_x.shape
    (3,)
    """
    run = as_solution(run)
    check_moving(run, "centrodes are")
    m = relative_motion(run, body, relative_to)
    pole = m.instant_centre(tol.RATE_NONE_INSTANT_CENTRE)
    moving = np.exp(-1j * m.angle) * (pole - m.place)
    return Centrodes(pole.real, pole.imag, moving.real, moving.imag, **inherited(run))


# -- Lines of Aronhold and Kennedy -------------------------------------------------------------
# The three centres of three bodies are on one line. From the centres that joints show (pins,
# guides, pitch points of gears) every other one is where two such lines meet, if the mechanism can
# be solved by lines alone.

Pair = frozenset[str]


@dataclass(frozen=True)
class KennedyLine:
    """A line through three centres.

    `pair`: The bodies whose centre is sought.
    `through`: The bodies whose centres are known, both with the same third body.
    """

    pair: tuple[str, str]
    through: tuple[tuple[str, str], tuple[str, str]]


def centres_of_joints(mechanism: Mechanism) -> set[Pair]:
    """Pairs of bodies whose instant centre a joint shows: a pin, the normal of a guide, a pitch
    point, a point of rolling contact.

    >>> import mbody
    >>> len(centres_of_joints(mbody.makers.four_bar(1, 3, 2, 3.5)))
    4
    """
    kinds = Revolute, Prismatic, Fixed, Gear, RackPinion, Rolling
    return {frozenset(joint.bodies) for joint in mechanism.joints if isinstance(joint, kinds)}


def kennedy_lines(
    centres: InstantCentres, mechanism: Mechanism, instant: int = 0
) -> tuple[KennedyLine, ...]:
    """Two lines for every centre that follows from those before it, in the order of construction.

    >>> import mbody
    >>> from mbody.engineering import instant_centres
    >>> run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), [0.0])
    >>> lines = kennedy_lines(instant_centres(run), run.mechanism)
    >>> [line.pair for line in lines][::2]
    [('crank', 'rocker'), ('coupler', 'ground')]
    """
    pairs = [one.bodies for one in centres.pairs]
    at = {frozenset(one.bodies): one.homogeneous(centres.length)[instant] for one in centres.pairs}
    known = centres_of_joints(mechanism)
    found: list[KennedyLine] = []
    while True:
        new = []
        for i, j in pairs:
            if frozenset((i, j)) in known:
                continue
            lines = {}
            for k in centres.bodies:
                ends = frozenset((i, k)), frozenset((k, j))
                if k not in (i, j) and known.issuperset(ends):
                    lines[k] = np.cross(at[ends[0]], at[ends[1]])
            best, thirds = _crossing(lines)
            if best > tol.LINES_PARALLEL:
                new.append(frozenset((i, j)))
                found += [KennedyLine((i, j), ((i, k), (k, j))) for k in thirds]
        if not new:
            return tuple(found)
        known |= set(new)


def _crossing(lines: dict[str, np.ndarray]) -> tuple[float, tuple[str, ...]]:
    """The two lines that cross at the greatest angle, and its measure."""
    if len(lines) < 2:
        return 0.0, ()
    names, whole = list(lines), np.array(list(lines.values()))
    sizes = np.linalg.norm(whole, axis=1)
    units = whole / np.maximum(sizes, tol.TINY)[:, None]
    sines = np.linalg.norm(np.cross(units[:, None], units[None, :]), axis=2)
    # lines through centres that are one point, or of which one is missing, are none
    sound = sizes > tol.LINES_PARALLEL
    sines = np.where(np.triu(sound[:, None] & sound, 1), sines, 0.0)
    one, other = np.unravel_index(int(np.argmax(sines)), sines.shape)
    best = float(sines[one, other])
    return best, (names[one], names[other]) if best > 0.0 else ()
