"""Axial force, shear force and bending moment along a link, and the stress that they make."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.free_body import Wrench, free_body
from mbody.core import tolerances as tol
from mbody.core.presentation import Presented
from mbody.errors import ModelError
from mbody.model.body import Body, CrossSection, as_section
from mbody.model.element import Marker, listed, unknown_name, whole_number
from mbody.model.joints import Revolute
from mbody.model.loads import Gravity
from mbody.model.numbers import number_in
from mbody.quantities.formula import Number
from mbody.solution.declared_result import Heading, ItemTable, Sentence, Value, data_only
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import check_forces
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution
from mbody.system.system import Locked

# -- Loads of bearings: their spectrum, and the equivalent load of their life ------------------

Array = np.ndarray

#: Exponents of life by the kind of bearing (ISO 281).
EXPONENTS = {"ball": 3.0, "roller": 10.0 / 3.0}
REVOLUTION = 2.0 * math.pi


def lasting(life: float | None, size: float) -> str | None:
    """A life in other units; None where it is not known."""
    if life is None:
        return None
    return f"{size * life:.5g}" if math.isfinite(life) else "endless"


@dataclass(frozen=True, eq=False)
class BearingLoad(Inherited, Presented):
    """The load of a bearing over a cycle.

    Attributes
    ----------
    force, speed : arrays (instants,)
        Magnitude of the joint's force [force]; speed of its two bodies against each other, without
        its sign [rad/time].
    equivalent : float
        Constant load with the same life: P = (∫ F^p |ω| dt / ∫ |ω| dt)^{1/p} [force].
    in_time : float
        The same by time in place of revolutions, (∫ F^p dt / T)^{1/p}.
    greatest, mean : float
        [force]
    revolutions : float
        Of the bearing in the cycle, to and fro counted alike.
    cycle : float
        How long the cycle is [time].
    exponent : float
        p.
    life : float or None
        L₁₀ in revolutions, 10⁶ (C/P)^p; None without the bearing's rating.
    time : float or None
        The same in units of time of the mechanism.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0)
    >>> run = mbody.kinetostatics(machine, turn=True)
    >>> found = bearing_load(run, "A", "roller")
    >>> float(found.force.max()) == found.greatest, found.life
    (True, None)
    """

    force: Array
    speed: Array
    equivalent: float
    in_time: float
    greatest: float
    mean: float
    revolutions: float
    cycle: float
    exponent: float
    life: float | None
    time: float | None
    t: Array

    declared = (
        Heading("BEARING LOAD"),
        Value("equivalent", "equivalent", "force"),
        Value("in_time", "by time", "force"),
        Value("greatest", "greatest", "force"),
        Value("mean", "mean", "force"),
        Value("revolutions", "turns a cycle"),
        Value("cycle", "", "time"),
        "exponent life",
        Value("", "life, 10⁶ rev", "text", lambda one: lasting(one.life, 1e-6)),
        Value("time", "", "time"),
    )

    def spectrum(self, classes: int = 10) -> list[tuple[float, float, float, float]]:
        """The load spectrum: of equal classes of force (from, to, share of revolutions, share of
        time).

        Raises
        ------
        ModelError
            For a number of classes that is none.
        """
        if isinstance(classes, bool) or not isinstance(classes, int) or not 1 <= classes <= 10_000:
            raise ModelError(f"a spectrum has 1 to 10000 classes, not {classes!r}")
        edges = np.linspace(0.0, self.greatest or 1.0, classes + 1)
        middle = 0.5 * (self.force[1:] + self.force[:-1])
        lasting = np.diff(self.t)
        rotations = 0.5 * (self.speed[1:] + self.speed[:-1]) * lasting
        shares = [
            np.histogram(middle, edges, weights=weights / (weights.sum() or 1.0))[0]
            for weights in (rotations, lasting)
        ]
        rows = zip(edges[:-1], edges[1:], *shares, strict=True)
        return [(float(a), float(b), float(r), float(s)) for a, b, r, s in rows]


def _spectrum_of(load: BearingLoad) -> Callable[[Any], Any]:
    return lambda found: load.spectrum(found.classes)


@dataclass(frozen=True, eq=False, repr=False)
class BearingLoads(Presented):
    """Loads of several bearings over one cycle; ``print`` shows them.

    Attributes
    ----------
    run : Solution
    loads : dict
        A `BearingLoad` by joint.
    classes : int
        Of the spectra in its data; of those in its text, if they are wanted there.
    spectra : bool
        Whether its text has them.
    """

    run: Any
    loads: dict[str, BearingLoad]
    classes: int = 10
    spectra: bool = False

    analysis_name = "bearings"

    @property
    def about_text(self) -> str:
        """How long the cycle is, and the exponent of life."""
        one = next(iter(self.loads.values()))
        unit = self.run.mechanism.units.time
        return f"bearings over {one.cycle:.6g} {unit}, exponent of life {one.exponent:.4g}"

    @property
    def declared(self) -> tuple[Any, ...]:
        """The bearings, and the spectra of each."""
        hour = self.run.mechanism.units.unit("time").factor / 3600.0
        hours = Value("", "life, h", "text", lambda one: lasting(one.time, hour))
        spectrum = Value(
            "spectrum", "", ("force", "force", "", ""), lambda one: one.spectrum(self.classes)
        )
        tables = [
            ItemTable(
                "",
                (
                    Value("", f"{name}: from", "force", lambda row: row[0]),
                    Value("", "to", "force", lambda row: row[1]),
                    Value("", "of revolutions", "share", lambda row: row[2]),
                    Value("", "of time", "share", lambda row: row[3]),
                ),
                value=_spectrum_of(one),
            )
            for name, one in self.loads.items()
            if self.spectra
        ]
        return ItemTable(
            "bearings", (*BearingLoad.declared, hours, spectrum), "BEARING", "loads"
        ), *tables

    status = property(lambda self: self.run.status)
    doubts = property(lambda self: self.run.doubts)
    notes = property(lambda self: self.run.notes)


@inherits
def bearing_load(
    run: Solution, joint: str, kind: str | float = "ball", rating: Number | None = None
) -> BearingLoad:
    """Equivalent load, load spectrum and life of the bearing in a revolute joint.

    P = (∫ F^p |ω| dt / ∫ |ω| dt)^{1/p},  L₁₀ = 10⁶ (C/P)^p revolutions

    Parameters
    ----------
    run : Solution
        With forces, over a cycle of time.
    joint : str
        A revolute joint.
    kind : "ball", "roller" or float
        p = 3, 10/3, or the exponent itself.
    rating : float or str, optional
        Basic dynamic load rating C of the bearing [force].

    Returns
    -------
    BearingLoad

    Raises
    ------
    ModelError
        For a joint that is no revolute, one instant, a kind or a rating that is none.

    Notes
    -----
    The load is the radial force of the plane. Integrals are trapezoidal sums over the instants,
    exact to high order over a periodic cycle at equal steps. Small oscillation, lubrication and
    axial loads are beyond the basic rating life.

    Source: ISO 281; ISO 76; SKF, *Rolling bearings*, mean load over duty intervals.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0)
    >>> run = mbody.kinetostatics(machine, turn=True)
    >>> found = bearing_load(run, "A", "ball", rating=5000.0)
    >>> found.mean < found.equivalent < found.greatest
    True
    """
    run = as_solution(run)
    check_forces(run, "loads of bearings")
    revolutes = [one.name for one in run.mechanism.joints if isinstance(one, Revolute)]
    if joint not in revolutes:
        raise unknown_name("revolute joint", joint, revolutes)
    exponent = EXPONENTS.get(kind, 0.0) if isinstance(kind, str) else float(kind)
    if not 1.0 <= exponent <= 20.0:
        raise ModelError(
            f"bearing '{joint}' is 'ball', 'roller', or its exponent from 1 to 20, not {kind!r}",
            joint,
        )
    if len(run) < 2 or not np.ptp(run.t) > 0.0:
        raise ModelError(
            f"the load of bearing '{joint}' is of a cycle of time, this is one instant: analyse a "
            "turn, or several times",
            joint,
        )
    element: Any = run.mechanism[joint]
    force = np.asarray(run.reaction(joint).magnitude)
    rates = [
        np.zeros(len(run)) if body == "ground" else np.asarray(run[body].omega)
        for body in (element.i.body, element.j.body)
    ]
    speed = np.abs(rates[1] - rates[0])
    cycle = float(run.t[-1] - run.t[0])
    travel = float(np.trapezoid(speed, run.t))
    size = float(force.max())
    shares = (force / size) ** exponent if size else force
    in_time = size * (float(np.trapezoid(shares, run.t)) / cycle) ** (1.0 / exponent)
    equivalent = in_time
    if travel > 0.0:
        equivalent = size * (float(np.trapezoid(shares * speed, run.t)) / travel) ** (1 / exponent)
    life = time = None
    if rating is not None:
        capacity = number_in(run.mechanism, rating, "force", joint, "rating")
        if not capacity > 0.0:
            raise ModelError(f"the rating of bearing '{joint}' is above 0, not {capacity:g}", joint)
        life = 1e6 * (capacity / equivalent) ** exponent if equivalent else math.inf
        time = life * REVOLUTION * cycle / travel if travel else math.inf
    mean = float(np.trapezoid(force, run.t)) / cycle
    return BearingLoad(
        force,
        speed,
        equivalent,
        in_time,
        size,
        mean,
        travel / REVOLUTION,
        cycle,
        exponent,
        life,
        time,
        run.t,
        **inherited(run),
    )


# -- Mass distribution along the bar of a link, and its weight and inertia up to a cut ---------


@dataclass(frozen=True, eq=False)
class LinkMass(Locked):
    """A mass along a line, or in one place of it.

    `mass`, `place`, `across`, `inertia`: Its mass centre is `place` along the bar and `across` it
      [length].
    `length`: Of the bar.
    `density` (3,): λ(s) = Σ density[k] s^k [mass/length]; None where it is a lump at its mass
      centre.
    """

    mass: float
    place: float
    across: float
    inertia: float
    length: float
    density: Array | None

    def moments(self, s: Array, after: Array) -> tuple[Array, Array, Array]:
        """∫ λ dσ, ∫ λ (σ − place) dσ, ∫ λ (σ − place)² dσ from the beginning to cuts at s; a lump
        is counted where the cut lies after it, or just after it (`after`).
        """
        if self.density is None:
            passed = np.where(after, self.place <= s, self.place < s).astype(float)
            return self.mass * passed, 0.0 * passed, self.inertia * passed
        cut = np.clip(s, 0.0, self.length)
        found = []
        polynomial = np.polynomial.Polynomial(self.density)
        distance = np.polynomial.Polynomial([-self.place, 1.0])
        for _ in range(3):
            whole = polynomial.integ()
            found.append(np.asarray(whole(cut) - whole(0.0)))
            polynomial = polynomial * distance
        return found[0], found[1], found[2]


def link_mass(
    mass: float, inertia: float, place: float, across: float, length: float, lump: bool
) -> LinkMass:
    """The mass of a link along its bar, 0 … length: a density of second degree that has its mass,
    mass centre and inertia, which is constant for a uniform rod; a lump where that is not possible.
    """
    density = None
    half = 0.5 * length
    if not lump and mass > 0.0 and inertia > 0.0:
        off = place - half
        mean = mass / length
        # of Legendre's polynomials on −1 … 1: the mass, its first and its second moment
        first = 1.5 * mass * off / half**2
        second = (inertia + mass * off**2) / half**3
        square = (second - mean * 2.0 / 3.0) * 15.0 / 4.0
        of_x = np.array([mean - 0.5 * square, first, 1.5 * square])
        places = [-1.0, 1.0]
        if of_x[2] > 0.0 and abs(first) < 2.0 * of_x[2]:
            places.append(-first / (2.0 * of_x[2]))
        if (
            min(np.polynomial.polynomial.polyval(x, of_x) for x in places)
            > -tol.DENSITY_NEGATIVE_ROUNDING * mean
        ):
            x = np.polynomial.Polynomial([-1.0, 1.0 / half])
            density = np.zeros(3)
            made = np.polynomial.Polynomial(of_x)(x).coef
            density[: made.size] = made
    return LinkMass(mass, place, across, inertia, length, density)


# -- Points of a bar at which forces act -------------------------------------------------------


@dataclass(frozen=True)
class Bar:
    """The line of a bar in link axes, from its first point to its second.

    `along`: Its points.
    `x`, `y`: Its beginning [length].
    `cos`, `sin`: Its direction.
    """

    along: tuple[str, str]
    x: float
    y: float
    cos: float
    sin: float
    length: float

    def coordinates(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Along and across the bar, of a place in link axes."""
        dx, dy = x - self.x, y - self.y
        return self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx

    def components(self, angle: Array, fx: Array, fy: Array) -> tuple[Array, Array]:
        """Along and across the bar, of vectors in world axes, at angles of the link."""
        c, s = np.cos(angle), np.sin(angle)
        ux, uy = c * self.cos - s * self.sin, s * self.cos + c * self.sin
        return ux * fx + uy * fy, ux * fy - uy * fx


@dataclass(frozen=True, eq=False)
class BarForces:
    """The forces on a bar but for its weight and inertia: arrays (instants, forces).

    `place`: Along the bar, where they act or where the rigid arm to them begins [length].
    `axial`, `across`: Forces along and across the bar.
    `couple`: About that place of the bar.
    `weight` (instants, 2): By gravity, along and across the bar.
    """

    causes: tuple[str, ...]
    place: Array
    axial: Array
    across: Array
    couple: Array
    weight: Array


def bar_of(run: Solution, body: str, along: Any = None) -> Bar:
    """The bar of a link: along two of its points, by default those of its section, else the places
    of its two joints.
    """
    known = [one.name for one in run.mechanism.bodies]
    if body not in known:
        raise unknown_name("moving body", body, known)
    link: Any = run.mechanism[body]
    line = tuple(along or ()) if not isinstance(along, str) else tuple(along.split(","))
    if not line and link.section is not None:
        line = link.section.along
    line = line or _ends(run, link)
    if len(line) != 2 or not set(line) <= set(link.points):
        raise ModelError(
            f"'{body}' is a bar along two of its points (there are: {listed(link.points)}), not "
            f"{listed(line)}",
            body,
        )
    at = run.system.numbers
    (ax, ay), (bx, by) = (map(float, at.point(f"{body}.{name}")) for name in line)
    length = float(np.hypot(bx - ax, by - ay))
    if not length > tol.POINT_SAME * run.system.length:
        raise ModelError(
            f"'{line[0]}' and '{line[1]}' of '{body}' are one place: a bar goes along two", body
        )
    return Bar((line[0], line[1]), ax, ay, (bx - ax) / length, (by - ay) / length, length)


def _ends(run: Solution, link: Body) -> tuple[str, ...]:
    """Names of the points at which a link has its joints, one a place."""
    at = run.system.numbers
    found: dict[str, tuple[float, float]] = {}
    centre = at.point(f"{link.name}.cg")
    for joint in run.mechanism.joints:
        for key, place in (("i", joint.i), ("j", joint.j)):
            if place.body == link.name:
                x, y = (
                    float(c + offset) for c, offset in zip(centre, at.arm(joint, key), strict=True)
                )
                names = [
                    name
                    for name in link.points
                    if _distance((x, y), at.point(f"{link.name}.{name}"))
                    <= tol.POINT_SAME * run.system.length
                ]
                for name in names[:1]:
                    found.setdefault(name, (x, y))
    if len(found) != 2:
        raise ModelError(
            f"the direction of the bar '{link.name}' is open: it has joints at "
            f"{listed(found) if found else 'no named point'}; say along which two points it "
            'goes, such as section = { rectangle = ["20 mm", "8 mm"], along = ["A", "B"] }',
            link.name,
        )
    return tuple(found)


def _distance(a: Any, b: Any) -> float:
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))


def forces_on(run: Solution, body: str, bar: Bar) -> BarForces:
    """All forces on a link at all instants, moved to its bar."""
    rows = [free_body(run, body, k) for k in range(len(run))]
    history = run[body]
    gravity = {load.name for load in run.mechanism.loads if isinstance(load, Gravity)}
    causes = list(
        dict.fromkeys(
            (w.cause, w.kind, n)
            for row in rows
            for w, n in _numbered(row)
            if w.kind != "inertia" and w.cause not in gravity
        )
    )
    index = {key: k for k, key in enumerate(causes)}
    shape = len(run), len(causes)
    x, y, fx, fy, torque = (np.zeros(shape) for _ in range(5))
    weight = np.zeros((len(run), 2))
    x[:], y[:] = history.x[:, None], history.y[:, None]
    for k, row in enumerate(rows):
        for w, n in _numbered(row):
            if w.cause in gravity:
                weight[k] += w.fx, w.fy
            elif w.kind != "inertia":
                m = index[w.cause, w.kind, n]
                x[k, m], y[k, m], fx[k, m], fy[k, m] = w.x, w.y, w.fx, w.fy
                torque[k, m] = w.torque
    for m, (cause, kind, _) in enumerate(causes):
        if kind in ("load", "driver", "coupling"):
            px, py = _acting_at(run, body, cause)
            torque[:, m] += (x[:, m] - px) * fy[:, m] - (y[:, m] - py) * fx[:, m]
            x[:, m], y[:, m] = px, py
    # places in link axes, then along the bar
    c, s = np.cos(history.angle)[:, None], np.sin(history.angle)[:, None]
    origin = run.point(Marker(body, (0.0, 0.0)))
    dx, dy = x - origin.x[:, None], y - origin.y[:, None]
    place, off = bar.coordinates(c * dx + s * dy, c * dy - s * dx)
    axial, across = bar.components(history.angle[:, None], fx, fy)
    down = np.stack(bar.components(history.angle, *weight.T), axis=-1)
    return BarForces(
        tuple(cause for cause, _, _ in causes), place, axial, across, torque - off * axial, down
    )


def _numbered(row: Any) -> list[tuple[Wrench, int]]:
    """Forces with how many of the same cause came before: a contact may have several."""
    count: dict[str, int] = {}
    found = []
    for w in row:
        found.append((w, count.get(w.cause, 0)))
        count[w.cause] = found[-1][1] + 1
    return found


def _acting_at(run: Solution, body: str, name: str) -> tuple[Array, Array]:
    """Point at which a load or a driver acts on a body, world axes: at its place there; a couple at
    the pin that joins its two bodies; else at the mass centre.
    """
    element: Any = run.mechanism[name]
    own = [
        value
        for field in dataclasses.fields(element)
        if isinstance(value := getattr(element, field.name), Marker) and value.body == body
    ]
    if len(own) == 1:
        at = run.point(own[0])
        return at.x, at.y
    others = set(element.bodies) - {body} or {"ground"}
    for joint in run.mechanism.joints:
        ends = {joint.i.body: joint.i, joint.j.body: joint.j}
        if isinstance(joint, Revolute) and body in ends and others & ends.keys():
            at = run.point(ends[body])
            return at.x, at.y
    return run[body].x, run[body].y


#: Places along a bar, unless the caller says how many.
PLACES = 101
#: Most of them.
MOST = 100_001
#: Places across a section at which stresses are combined, with the outer fibres and the middle.
ACROSS = 41


@dataclass(frozen=True, eq=False)
class Stress(Inherited):
    """Stresses along a bar by beam theory: arrays (instants, places) [force/area].

    Attributes
    ----------
    upper, lower : arrays
        Normal stress in the outer fibres on the left and the right of the bar's direction; tension
        is positive.
    shear : array
        The greatest shear stress, at the neutral axis.
    equivalent : array
        The greatest by von Mises across the section.

    >>> import mbody
    >>> machine = mbody.Mechanism("a rod that turns")
    >>> rod = mbody.makers.bar("rod", 2.0, mass=3.0, ends=("O", "P"))
    >>> machine.add(rod, mbody.Revolute("O", "ground", "rod.O"))
    >>> machine.add(mbody.AngleDriver("motor", "rod", mbody.laws.ConstantSpeed(0.0, 10.0)))
    >>> found = internal_loads(mbody.kinetostatics(machine), "rod", ("O", "P"))
    >>> stress = found.stress(mbody.model.body.RectangleSection(0.02, 0.01))
    >>> round(float(stress.upper[0, 0]), 3) == round(float(found.axial[0, 0]) / 2e-4, 3)
    True
    """

    upper: Array
    lower: Array
    shear: Array
    equivalent: Array


def _rounding(found: InternalLoads) -> dict[str, float]:
    """Below which a load is rounding beside the greatest force."""
    greatest = found.greatest()
    size = tol.PRINTED_NONE_FINE * max(abs(greatest[key][0]) for key in ("axial", "shear"))
    return {"axial": size, "shear": size, "bending": size * found.length}


@dataclass(frozen=True, eq=False, repr=False)
class InternalLoads(Inherited, Presented):
    """Axial force, shear force and bending moment of a link, at cuts along its bar.

    Attributes
    ----------
    body : str
    along : tuple of 2 str
        The points between which the bar goes.
    length : float
        Between them [length].
    place : array (places,)
        From the first point on [length]; twice where forces act: just before and just after.
    axial, shear, bending : arrays (instants, places)
        Tension positive [force]; shear positive where the part before the cut is pushed to the
        left of the bar's direction [force]; bending positive where it stretches the fibres on the
        right [force·length]: dM/ds = V.
    closure : float
        What is left behind the last place, of force and moment, as a part of the greatest: the
        error of the link's equilibrium.
    lumped : bool
        Whether the mass is a lump at its mass centre.
    section : CrossSection or None
    run : Solution

    >>> import mbody
    >>> machine = mbody.Mechanism("a rod that turns")
    >>> rod = mbody.makers.bar("rod", 2.0, mass=3.0, ends=("O", "P"))
    >>> machine.add(rod, mbody.Revolute("O", "ground", "rod.O"))
    >>> machine.add(mbody.AngleDriver("motor", "rod", mbody.laws.ConstantSpeed(0.0, 10.0)))
    >>> found = internal_loads(mbody.kinetostatics(machine), "rod", ("O", "P"))
    >>> found.closure < 1e-12, abs(float(found.axial[0, -1])) < 1e-9
    (True, True)
    """

    body: str
    along: tuple[str, str]
    length: float
    place: Array
    axial: Array
    shear: Array
    bending: Array
    closure: float
    lumped: bool
    section: CrossSection | None
    run: Any

    analysis_name = "internal"
    about_text = "'{0.body}' along {0.along[0]}–{0.along[1]}"
    declared = (
        "body along lumped closure",
        Value("t", "", "time", lambda found: found.run.t),
        Value("place", "", "length"),
        *data_only("axial", "shear", dimension="force"),
        Value("bending", "", "torque"),
        Value("stress", "", "pressure", lambda found: found.stress() if found.section else ...),
        Heading("BAR"),
        Value("length", "length", "length"),
        Heading("GREATEST"),
        Value(
            "greatest",
            {
                "axial": "axial force",
                "shear": "shear force",
                "bending": "bending moment",
                "stress": "equivalent stress",
            },
            {"axial": "force", "shear": "force", "bending": "torque", "stress": "pressure"},
            lambda found: {
                key: {"value": value, "place": place, "t": float(found.run.t[k])}
                for key, (value, place, k) in found.greatest().items()
            },
            floor=_rounding,
            columns=(
                Value("value"),
                Value("place", "at s", "length"),
                Value("t", "t", "time"),
            ),
        ),
        Sentence(lambda found: f"equilibrium {found.closure:.1e} (relative)"),
    )

    def stress(self, section: CrossSection | None = None) -> Stress:
        """Stress of the link's own section, or of another.

        σ = N/A ± M c/I,  τ = k V/A,  equivalent √(σ² + 3τ²) where both act.

        Raises
        ------
        ModelError
            Where there is no section.

        Notes
        -----
        Of straight beams, whose sections stay plane: not at pins, fillets and holes, where stresses
        concentrate, and not for short links. With η from −1 to 1 across the section σ is linear; τ
        falls to both sides as 1 − η² in rectangles and circles, as √(1 − η²) in thin tubes.
        """
        if section is not None:
            checked: Any = as_section(section, self.body, self.run.mechanism[self.body].points)
            sizes = {key: getattr(checked, key) for key in checked.sizes}
        elif self.section is None:
            raise ModelError(
                f"'{self.body}' has no section for its stress: give it one, such as section = "
                '{ rectangle = ["20 mm", "8 mm"] }',
                self.body,
            )
        else:
            checked = self.section
            values = self.run.system.values
            sizes = {key: float(values[f"{self.body}.section.{key}"]) for key in checked.sizes}
        area, second, fibre, factor = checked.properties(sizes)
        mean, bent = self.axial / area, self.bending * fibre / second
        shear = factor * self.shear / area
        squares = np.zeros(mean.shape)
        for eta in np.linspace(-1.0, 1.0, ACROSS):
            part = shear * (1.0 - eta * eta) ** checked.shear_profile
            squares = np.maximum(squares, (mean + eta * bent) ** 2 + 3.0 * part**2)
        equivalent = np.sqrt(squares)
        return Stress(
            mean - bent, mean + bent, shear, equivalent, **inherited(self, notes=self.notes)
        )

    def greatest(self) -> dict[str, tuple[float, float, int]]:
        """Of axial, shear, bending and, where there is a section, of the equivalent stress: the
        value of greatest size, its place, and its instant.
        """
        rows = {"axial": self.axial, "shear": self.shear, "bending": self.bending}
        if self.section is not None:
            rows["stress"] = self.stress().equivalent
        found = {}
        for key, values in rows.items():
            k, n = np.unravel_index(int(np.abs(values).argmax()), values.shape)
            found[key] = (float(values[k, n]), float(self.place[n]), int(k))
        return found

    def __repr__(self) -> str:
        return f"InternalLoads('{self.body}' along {self.along[0]}–{self.along[1]})"


@inherits
def internal_loads(
    run: Solution,
    body: str,
    along: Sequence[str] | str | None = None,
    *,
    places: int = PLACES,
    lumped: bool = False,
) -> InternalLoads:
    """Internal loads of a link: axial force, shear force and bending moment along its bar.

    N(s) = −Σ F_x,  V(s) = Σ F_y,  M(s) = Σ F_y (s − s_k) − Σ T_k  over all that acts before the cut

    Parameters
    ----------
    run : Solution
        Of kinetostatics, statics or simulate, of one design.
    body : str
        A link.
    along : pair of str, optional
        Two of its points; by default those of its section, else the places of its two joints.
    places : int
        At how many equal places it is cut, and just before and after every force besides.
    lumped : bool
        Whether its mass is taken as a lump at its mass centre.

    Returns
    -------
    InternalLoads

    Raises
    ------
    ModelError
        For an analysis without forces, a batch, a body that there is not, or a link whose direction
        is open.

    Notes
    -----
    The mass lies along the bar with a density of second degree that has the link's mass, mass
    centre and inertia: of a uniform rod it is constant. Where no such density is positive all
    along, as of a link with heavy ends, it is a lump, and a note says so. Every element takes its
    own weight and inertia force. A mass centre beside the bar is a mass parallel to it on rigid
    arms.

    Forces act at their places; those beside the bar by a rigid arm across it. Couples of motors and
    torques act at the pin that joins their two bodies, else at the mass centre; so do couplings.

    Source: F. P. Beer, E. R. Johnston, *Mechanics of Materials*, chapter 5; dynamic loads: R. L.
    Norton, *Design of Machinery*, chapter 11.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.Mechanism("a rod that turns")
    >>> rod = mbody.makers.bar("rod", 2.0, mass=3.0, ends=("O", "P"))
    >>> machine.add(rod, mbody.Revolute("O", "ground", "rod.O"))
    >>> machine.add(mbody.AngleDriver("motor", "rod", mbody.laws.ConstantSpeed(0.0, 10.0)))
    >>> found = internal_loads(mbody.kinetostatics(machine), "rod", ("O", "P"))
    >>> round(float(found.axial[0, 0]), 9)  # ½ m ω² l at the pin
    300.0
    """
    run = as_solution(run)
    check_forces(run, "internal loads")
    places = whole_number("places", places, 2, MOST)
    bar = bar_of(run, body, along)
    mass = _mass(run, body, bar, lumped)
    forces = forces_on(run, body, bar)
    place = _snapped(forces.place, bar.length)
    cuts, after = _cuts(bar, mass, place, places)
    # all of the mass and every force before a cut
    before = np.where(after, place[..., None] <= cuts, place[..., None] < cuts)
    n = -np.einsum("tk,tks->ts", forces.axial, before)
    v = np.einsum("tk,tks->ts", forces.across, before)
    moment_arms = (cuts - place[..., None]) * before
    m = np.einsum("tk,tks->ts", forces.across, moment_arms) - np.einsum(
        "tk,tks->ts", forces.couple, before
    )
    x, y, bent = _inertial_loads(run, body, bar, mass, forces.weight, cuts, after)
    n, v, m = n - x, v + y, m + bent
    size = max(float(np.abs(n).max()), float(np.abs(v).max()))
    moment_scale = max(float(np.abs(m).max()), size * bar.length)
    ends = (n[:, -1], size), (v[:, -1], size), (m[:, -1], moment_scale)
    closure = max((float(np.abs(end).max()) / by for end, by in ends if by), default=0.0)
    link: Any = run.mechanism[body]
    more = inherited(run)
    more["notes"] = (*more.get("notes", ()), *_notes(body, mass, lumped))
    inner = slice(1, -1)  # between just after the first force and just before the last
    return InternalLoads(
        body,
        bar.along,
        bar.length,
        cuts[inner],
        n[:, inner],
        v[:, inner],
        m[:, inner],
        closure,
        mass.density is None and mass.mass > 0.0,
        link.section,
        run,
        **more,
    )


def _mass(run: Solution, body: str, bar: Bar, lumped: bool) -> LinkMass:
    first = 3 * run.system.bodies[body]
    mass, _, inertia = (float(part) for part in run.system.mass[first : first + 3, 0])
    place, across = bar.coordinates(*map(float, run.system.numbers.point(f"{body}.cg")))
    return link_mass(mass, inertia, place, across, bar.length, lumped)


def _notes(body: str, mass: LinkMass, lumped: bool) -> tuple[str, ...]:
    if lumped or mass.density is not None or not mass.mass:
        return ()
    return (
        f"the mass of '{body}' is a lump at its mass centre: no mass along the bar alone has its "
        "inertia and its mass centre",
    )


def _snapped(place: Array, length: float) -> Array:
    """Places of forces; those that stand still are at one place, and at an end where they are near.

    Rounding of positions would make two places of one.
    """
    found = place.copy()
    for row in found.T:
        if np.ptp(row) <= tol.RATE_NONE * length:
            row[:] = row.mean()
            for end in (0.0, length):
                if abs(row[0] - end) <= tol.RATE_NONE * length:
                    row[:] = end
    return found


def _cuts(bar: Bar, mass: LinkMass, place: Array, places: int) -> tuple[Array, Array]:
    """Places of the cuts in ascending order, and whether each is just after what acts there."""
    lump = [mass.place] if mass.density is None and mass.mass > 0.0 else []
    low = min(0.0, float(place.min(initial=0.0)), *lump)
    high = max(bar.length, float(place.max(initial=bar.length)), *lump)
    fixed = [float(row[0]) for row in place.T if np.ptp(row) <= tol.RATE_NONE * bar.length]
    sharp = np.unique([low, high, *fixed, *lump])
    plain = np.setdiff1d(np.linspace(low, high, places), sharp)
    cuts = np.concatenate([sharp, sharp, plain])
    after = np.concatenate(
        [np.zeros(sharp.size, bool), np.ones(sharp.size, bool), np.ones(plain.size, bool)]
    )
    order = np.lexsort((after, cuts))
    return cuts[order], after[order]


def _inertial_loads(
    run: Solution, body: str, bar: Bar, mass: LinkMass, weight: Array, cuts: Array, after: Array
) -> tuple[Array, Array, Array]:
    """Force along and across the bar by inertia and weight of what is before the cuts, and the
    bending moment by them.
    """
    history = run[body]
    whole, first, second = mass.moments(cuts, after)
    still = run.analysis == "statics"
    zero = np.zeros(len(run))
    ax, ay = (zero, zero) if still else bar.components(history.angle, history.ax, history.ay)
    omega, alpha = (zero, zero) if still else (history.omega, history.alpha)
    gx, gy = (weight / mass.mass if mass.mass else 0.0 * weight).T
    x = np.outer(gx - ax, whole) + np.outer(omega**2, first)
    y = np.outer(gy - ay, whole) - np.outer(alpha, first)
    about = np.outer(gy - ay, first) - np.outer(alpha, second)
    return x, y, (cuts - mass.place) * y - about + mass.across * x
