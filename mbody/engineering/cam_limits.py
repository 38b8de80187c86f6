"""Cams: pressure angle, curvature, contour, and the base circle that they need."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.driven import kinematics
from mbody.analysis.driven.transmission import greatest_between, pose_at
from mbody.core import tolerances as tol
from mbody.core.bracket import last_place, zero_between
from mbody.core.presentation import Presented
from mbody.core.tolerances import CAM_CIRCLE_ENDLESS, CAM_CIRCLE_NONE, TABLE_CLOSES
from mbody.engineering.instant_centres import check_moving
from mbody.errors import ModelError, brief
from mbody.laws import Law, Table
from mbody.model.element import listed
from mbody.model.joints import CamFollower, Prismatic, Revolute
from mbody.model.joints.cam import least_raise, pitch_radius
from mbody.model.mechanism import Mechanism
from mbody.model.model_notes import with_element
from mbody.model.numbers import number_in
from mbody.quantities.formula import Number
from mbody.solution.declared_result import ColumnTable, Heading, Sentence, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import ends
from mbody.solution.solution import Solution, as_solution
from mbody.system.assembler import assemble
from mbody.system.rank import dense
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.model.element import Numbers


# -- The contour of a cam: the curve that touches a roller, an edge or a flat face -------------


def cam_contour(
    joint: CamFollower, numbers: Numbers, psi: np.ndarray, *, pitch: bool = False
) -> np.ndarray:
    """Points of the contour in the axes of the cam's body. (n, 2) [length] at the angles `psi` (n,)
    [rad].

    The pitch curve of a roller is R e(χ) from the cam's centre, at χ = β ∓ ψ with β the direction
    of ψ = 0; the contour is inside it by the radius of the roller, along the normal. Under a flat
    face it is the envelope of the lines of the face, h e(χ) ∓ h′ e(χ + π/2).

    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("cam_follower"))
    >>> cam = system.mechanism["contact"]
    >>> cam_contour(cam, system.numbers, np.linspace(0.0, 2.0 * np.pi, 5)).shape
    (5, 2)
    """
    R, derivative, _ = np.broadcast_arrays(*joint.radius(numbers, psi))
    sign = -1.0 if joint.clockwise else 1.0
    ray = float(numbers.angle(joint, "i")) - sign * psi
    if pitch:
        along, across = R, np.zeros_like(R)
    elif joint.flat:
        along, across = R, -sign * derivative
    else:
        roller, lean = float(numbers[f"{joint.name}.roller"]), np.arctan2(sign * derivative, R)
        along, across = R - roller * np.cos(lean), -roller * np.sin(lean)
    c, s = np.cos(ray), np.sin(ray)
    from_centre = np.column_stack([along * c - across * s, along * s + across * c])
    return np.asarray(numbers.place(joint, "i"), dtype=float) + from_centre


def cam_curvature(
    joint: CamFollower, numbers: Numbers, psi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Radii of curvature (n,) of the pitch curve and of the contour [length], negative where they
    are hollow and infinite where they are straight; both those of the contour under a flat face.

    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("cam_follower"))
    >>> cam_curvature(system.mechanism["contact"], system.numbers, np.zeros(1))
    (array([50.]), array([40.]))
    """
    R, R1, R2 = np.broadcast_arrays(*joint.radius(numbers, psi))
    if joint.flat:
        return R + R2, R + R2
    curvature_term, speed = R * R + 2.0 * R1 * R1 - R * R2, (R * R + R1 * R1) ** 1.5
    pitch = np.divide(
        speed, curvature_term, out=np.full(R.shape, np.inf), where=curvature_term != 0.0
    )
    return pitch, pitch - float(numbers[f"{joint.name}.roller"])


# -- The named cam, and the sampled points of its profile --------------------------------------

#: Places of a revolution at which curvatures are computed: every twentieth of a degree.
PLACES = 7201


def named_cam(mechanism: Mechanism, name: str | None) -> CamFollower:
    """The cam of that name, by default the only one.

    >>> import mbody
    >>> named_cam(mbody.gallery.load("cam_follower"), None).name
    'contact'
    """
    cams = [one for one in mechanism.joints if isinstance(one, CamFollower)]
    known = listed(one.name for one in cams)
    if name is None and len(cams) == 1:
        return cams[0]
    for one in cams:
        if one.name == name:
            return one
    if not cams:
        raise ModelError(
            f"'{mechanism.name}' has no cam: there is no joint of the type CamFollower in it"
        )
    if name is None:
        raise ModelError(
            f"'{mechanism.name}' has {len(cams)} cams ({known}): name the joint of one"
        )
    raise ModelError(f"there is no cam {brief(name)} (there are: {known})", name)


def cam_places(cam: CamFollower) -> np.ndarray:
    """ψ (n,) over a revolution [rad], with both sides of the places where a derivative jumps."""
    law: Law = cam.profile
    jumps = np.mod(np.concatenate([law.turns(0.0), [0.0]]), math.tau)
    grid = np.linspace(0.0, math.tau, PLACES)[:-1]
    both = np.concatenate([grid, jumps - tol.CAM_JUMP_BESIDE, jumps + tol.CAM_JUMP_BESIDE])
    return np.unique(np.mod(both, math.tau))


# -- Limits of a cam: pressure angle, curvature, undercutting ----------------------------------


@dataclass(frozen=True)
class CamPlace:
    """A least or greatest value of a cam.

    Attributes
    ----------
    value : float
    psi : float
        Where on the cam: how far it has rotated since its line of 0 pointed at the follower [rad].

    >>> CamPlace(0.031, 4.03).value
    0.031
    """

    value: float
    psi: float


#: What a least or greatest value of a cam has as data, and beside it as text.
AT = Value("value"), Value("psi", "at ψ", "angle")
PRESSURE, WITHOUT_UNDERCUT = "greatest pressure angle", "least base radius without undercut"
_at = functools.partial(Value, dimension="length", columns=AT, missing="none")
_radius = functools.partial(Value, dimension="length", missing="straight")


def _of_roller(found: CamAnalysis) -> CamPlace | None:
    return found.pitch_sharpest if found.roller else None


@dataclass(frozen=True, kw_only=True, eq=False)
class CamAnalysis(Inherited, Presented):
    """A cam with its follower over a cycle; ``print`` shows it.

    Attributes
    ----------
    mechanism : Mechanism
    joint : CamFollower
    follower : str
        "roller", "knife edge" or "flat face", with "translating" or "swinging"
        before it where it is one on a guide or an arm of the ground.
    t, psi : arrays (instants,)
        How far the cam has rotated since its line of 0 pointed at the follower, 0 … 2π [rad].
    pressure_angle : array (instants,)
        Between the contact's normal and the direction in which the follower can go, positive where
        the normal leans to where the cam turns, as in a rise on a centred guide [rad]; NaN where
        the place of contact cannot go anywhere.
    curvature : array (instants,)
        Radius of curvature of the contour at the contact, negative where it is hollow, infinite
        where it is straight [length].
    greatest : CamPlace or None
        The greatest pressure angle without its sign, between the instants too [rad].
    sharpest : CamPlace
        Least radius of curvature of the contour, with a roller or a face (of a knife edge the pitch
        curve): how far the cam is from undercutting [length].
    pitch_sharpest : CamPlace
        Of the pitch curve, or of the contour under a flat face.
    hollow : CamPlace or None
        Least radius of its hollow parts, which a grinding wheel has to fit; None for a convex cam.
    base_radius, roller : float
        [length]
    needed : float or None
        The least base radius with which the pressure angle is nowhere above the limit, the motion
        of the follower being as it is; None without a limit, and where there is none.
    uncut : float or None
        The least base radius without undercutting, likewise; 0 where any will do.
    limit : float or None
        Of the pressure angle [rad].
    face : tuple of two floats or None
        How far the contact wanders along a flat face, from the foot of the normal through the
        cam's centre [length].

    >>> import mbody
    >>> from mbody.engineering import cam_analysis
    >>> run = mbody.kinematics(mbody.gallery.load("cam_follower"), turn=True)
    >>> cam_analysis(run).follower
    'translating roller'
    """

    mechanism: Mechanism = field(repr=False)
    joint: CamFollower
    follower: str
    t: Array = field(repr=False)
    psi: Array = field(repr=False)
    pressure_angle: Array = field(repr=False)
    curvature: Array = field(repr=False)
    greatest: CamPlace | None
    sharpest: CamPlace
    pitch_sharpest: CamPlace
    hollow: CamPlace | None
    base_radius: float
    roller: float
    needed: float | None
    uncut: float | None
    limit: float | None
    face: tuple[float, float] | None
    run: Any = field(repr=False)

    about_text = "cam '{0.joint.name}', {0.follower}"
    analysis_name = "cam"
    angle_unit = "deg"
    declared = (
        Heading("CAM"),
        Value("joint", value=lambda found: found.joint.name),
        Value("follower"),
        Value("base_radius", "base radius", "length"),
        Value("roller", dimension="length"),
        Value("", "radius of the roller", "length", lambda found: found.roller or None),
        Value("limit", "limit of the pressure angle", "angle"),
        Value("base_radius_for_limit", "base radius that keeps it", "length", "needed"),
        Value("greatest_pressure_angle", PRESSURE, "angle", "greatest", columns=AT),
        _at("least_radius_of_pitch_curve", value="pitch_sharpest"),
        _at("", "least radius of the pitch curve", value=_of_roller),
        _at("least_radius_of_curvature", "least radius of the contour, convex", value="sharpest"),
        _at("least_hollow_radius", "least radius of the contour, hollow", value="hollow"),
        Value("face", "contact along the face", "length"),
        Value("base_radius_without_undercut", WITHOUT_UNDERCUT, "length", "uncut"),
        ColumnTable(
            (
                Value("t", "t", "time"),
                Value("psi", "ψ", "angle"),
                Value("pressure_angle", "pressure angle", "angle"),
                _radius("radius_of_curvature", "radius of the contour", value="curvature"),
            )
        ),
    )

    def contour(self, points: int = 361) -> Array:
        """The cam as a table for its making, (points, 6): ψ [rad], x and y of the contour, x and y
        of the pitch curve, in the axes of the cam's body, and the radius of curvature of the
        contour [length].

        Raises
        ------
        ModelError
            For fewer than 4 points.
        """
        if isinstance(points, bool) or not isinstance(points, int) or not 4 <= points <= 10**6:
            raise ModelError(f"a contour has 4 to 1000000 points, not {brief(str(points))}")
        cam, numbers = self.joint, self.run.system.numbers
        psi = np.linspace(0.0, math.tau, points)
        edge = cam_contour(cam, numbers, psi)
        pitch = cam_contour(cam, numbers, psi, pitch=True)
        radius = cam_curvature(cam, numbers, psi)[1]
        return np.column_stack([psi, edge, pitch, radius])


# -- Followers on a guide or an arm, their motion kept, over base circles of other radii -------

#: How many base circles are tried.
TRIED = 400
#: The greatest base circle of a follower on a guide, by the greatest radius of the pitch curve.
GREATEST = 30.0


@dataclass(frozen=True, eq=False)
class FollowerPath:
    """The path of a follower's place beside its cam, whose centre is the origin; the cam turns
    counter-clockwise by θ, a cam that turns clockwise is mirrored.

    `place` (n,): Of the roller's centre, the knife edge, or the place in the face [length].
    `first`, `second` (n,): Derivatives by θ of the follower's coordinate: of its travel along the
      guide [length], of its angle on the arm [1].
    `along`: Direction of the guide; 0 on an arm.
    `pivot`: Of the arm.
    `normal` (n,): Of a flat face.
    `roller`: [length]

    >>> theta = np.linspace(0.0, 2.0 * np.pi, 361)
    >>> place = 1j * (0.05 + 0.01 * (1.0 - np.cos(theta)))
    >>> first, second = 0.01 * np.sin(theta), 0.01 * np.cos(theta)
    >>> path = FollowerPath(place, first, second, 1j, 0j, None, 0.01)
    >>> round(path.base_radius(), 9)
    0.04
    """

    place: Array
    first: Array
    second: Array
    along: complex
    pivot: complex
    normal: Array | None
    roller: float

    def shifted(self, by: float) -> FollowerPath:
        """The path of another point of the guide [length] or the arm [rad]."""
        if self.along:
            return replace(self, place=self.place + by * self.along)
        rotation = complex(math.cos(by), math.sin(by))
        normal = None if self.normal is None else self.normal * rotation
        return replace(self, place=self.pivot + (self.place - self.pivot) * rotation, normal=normal)

    def base_radius(self) -> float:
        """Radius of the base circle [length]."""
        if self.normal is not None:
            return float(self._support()[0].min())
        return float(np.abs(self.place).min()) - self.roller

    def pressure_angle(self) -> Array:
        """Between the contact's normal and the direction of the follower [rad], 0 … π/2."""
        n = self.normal
        if n is None:
            p1 = self._pitch()[0]
            n, at = 1j * p1 / np.abs(p1), self.place
        else:
            h, derivative, _ = self._support()
            at = h * n + derivative * 1j * n
        direction = self.along if self.along else 1j * (at - self.pivot)
        with np.errstate(invalid="ignore", divide="ignore"):
            angle: Array = np.arccos(
                np.minimum(np.abs((n * np.conj(direction)).real) / np.abs(direction), 1.0)
            )
        return angle

    def clearance(self) -> float:
        """Least radius of curvature of the contour [length]; where it is not positive the cam is
        undercut, or is no cam: -inf where the follower runs faster around it than it turns."""
        if self.normal is not None:
            return float(self._support()[2].min())
        p1, p2 = self._pitch()
        around = (1j * p1 * np.conj(self.place)).real
        if not around.min() > 0.0:
            return -math.inf
        curvature_term = -(np.conj(p1) * p2).imag
        convex = curvature_term > 0.0
        if not convex.any():
            return math.inf
        return float((np.abs(p1[convex]) ** 3 / curvature_term[convex]).min()) - self.roller

    def least_base(self, limit: float | None = None) -> float | None:
        """The least base circle without undercutting, and, with a limit, of a pressure angle
        nowhere above it [rad]; 0 where every one will do, None where there is none.
        """
        if self.along:
            # from beside the cam's centre outwards: closer near it, where most happens
            travel = (self.place * np.conj(self.along)).real
            out = math.copysign(1.0, float(travel.mean()))
            low, high = -float((out * travel).min()), GREATEST * float(np.abs(self.place).max())
            shifts = out * (low + (high - low) * np.linspace(0.0, 1.0, TRIED) ** 2)
        else:
            # all positions of the arm on its side of the line to the cam's centre
            start = float(np.angle((self.place - self.pivot).mean() / -self.pivot))
            out = math.copysign(1.0, start)
            shifts = out * np.linspace(0.0, math.pi, TRIED + 2)[1:-1] - start
        worst = self._excess(limit)
        tried = [(worst(self.shifted(s)), s) for s in shifts.tolist()]
        if tried[0][0] <= 0.0:
            return self.shifted(tried[0][1]).base_radius()
        for (before, low), (here, high) in itertools.pairwise(tried):
            if here <= 0.0 < before:
                good = zero_between(
                    lambda s: -worst(self.shifted(s)), (low, high), (-before, -here)
                ).above
                base = self.shifted(good).base_radius()
                return base if base > tol.CAM_CIRCLE_NONE * float(np.abs(self.place).max()) else 0.0
        return None

    def _excess(self, limit: float | None) -> Callable[[FollowerPath], float]:
        """By how much the limits are exceeded, -1 where they are kept."""

        def excess(path: FollowerPath) -> float:
            if not path.base_radius() > 0.0 or not path.clearance() > 0.0:
                return math.inf
            if limit is None:
                return -1.0
            return float(path.pressure_angle().max()) - limit

        return excess

    def _pitch(self) -> tuple[Array, Array]:
        """Derivatives of the pitch curve in the cam's axes by θ, rotated back into the ground's."""
        if self.along:
            rate, second = self.along * self.first, self.along * self.second
        else:
            relative = self.place - self.pivot
            rate, second = (
                1j * relative * self.first,
                1j * relative * self.second - relative * self.first**2,
            )
        return rate - 1j * self.place, second - 2j * rate - self.place

    def _support(self) -> tuple[Array, Array, Array]:
        """h, its derivative by the direction of n in the cam's axes, and the radius h + h″."""
        n: Any = self.normal
        h = (np.conj(n) * self.place).real
        if self.along:
            c = (np.conj(n) * self.along).real
            return h, -c * self.first, h + c * self.second
        over, across = (np.conj(n) * self.pivot).real, (np.conj(1j * n) * self.pivot).real
        # dχ/dθ = x′ − 1
        slope = self.first - 1.0
        rate, rate2 = across * self.first, across * self.second - over * self.first**2
        return h, rate / slope, h + (rate2 * slope - rate * self.second) / slope**3


def follower_path(run: Solution, joint: CamFollower) -> FollowerPath | None:
    """The path of a follower on a guide or an arm of the ground, about a cam with a fixed centre
    that turns at all instants; None for others.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.gallery.load("cam_follower"), turn=True)
    >>> path = follower_path(run, run.mechanism["contact"])
    >>> round(path.base_radius(), 9), path.along
    (40.0, (6.123233995736766e-17+1j))
    """
    follower = joint.j.body
    guides = [
        one
        for one in run.mechanism.joints
        if set(one.bodies) == {"ground", follower} and isinstance(one, Prismatic | Revolute)
    ]
    centre, place = run.point(joint.i), run.point(joint.j)
    middle, seen = centre.x + 1j * centre.y, place.x + 1j * place.y
    size = float(np.abs(seen - middle).max())
    moved = float(np.abs(middle - middle[0]).max())
    omega, alpha = run[joint.i.body].omega, run[joint.i.body].alpha
    steady = np.abs(omega).min() > tol.CAM_CIRCLE_NONE * np.abs(omega).max(initial=0.0)
    if (
        len(guides) != 1
        or moved > tol.CAM_CIRCLE_NONE * size
        or not steady
        or np.ptp(np.sign(omega))
    ):
        return None
    (guide,) = guides
    p = seen - middle
    v, a = place.vx + 1j * place.vy, place.ax + 1j * place.ay
    numbers = run.system.numbers
    mirror = bool(omega[0] < 0.0)
    side = "i" if guide.i.body == "ground" else "j"
    along, pivot = 0j, 0j
    if isinstance(guide, Prismatic):
        along = complex(np.exp(1j * float(numbers.angle(guide, side))))
        x1, x2 = (v * np.conj(along)).real, (a * np.conj(along)).real
    else:
        pivot = complex(*map(float, numbers.place(guide, side))) - complex(middle[0])
        x1, x2 = run[follower].omega, run[follower].alpha
    normal: Any = None
    if joint.flat:
        normal = 1j * np.exp(1j * (run[follower].angle + float(numbers.angle(joint, "j"))))
    # by the angle of a cam that turns counter-clockwise
    first, second = x1 / np.abs(omega), (x2 - x1 * alpha / omega) / omega**2
    if mirror:
        p, along, pivot = np.conj(p), along.conjugate(), pivot.conjugate()
        normal = None if normal is None else np.conj(normal)
        if isinstance(guide, Revolute):
            first, second = -first, -second
    roller = 0.0 if joint.flat else float(numbers[f"{joint.name}.roller"])
    return FollowerPath(p, first, second, along, pivot, normal, roller)


#: Instants of the revolution in which base circles are tried.
FINE = 3601


def cam_analysis(
    run: Solution, joint: str | None = None, *, limit: Number | None = None
) -> CamAnalysis:
    """Pressure angle over the cycle, radius of curvature, distance from undercutting, contour and
    least base circle of a cam with a roller, a knife edge or a flat face, on a guide, offset or
    not, on an arm, or on any link.

    Parameters
    ----------
    run : Solution
        Of a driven mechanism, such as ``mbody.kinematics(machine, turn=True)``.
    joint : str, optional
        Name of a `CamFollower`; by default the only one.
    limit : float or str, optional
        Of the pressure angle: a number is in rad; then the base radius that it needs is found.

    Returns
    -------
    CamAnalysis

    Raises
    ------
    ModelError
        For a joint that is no cam, a result without motion, a batch, and a limit that is no angle
        between 0 and 90°.

    Notes
    -----
    The direction in which the follower can go is its motion when the cam is held and the contact
    released: along a guide, across an arm. On a guide tan φ = (s′ − e)/(s + √(R₀² − e²)) with R₀
    the least radius of the pitch curve and e the offset. The radius of curvature of the contour is
    that of the pitch curve less the roller's; under a flat face h + h″. Base radii are searched
    with the motion of the follower kept, by its guide or arm; for others there is none, and a note.

    Source: Norton, *Design of Machinery*, chapter 8.

    Examples
    --------
    >>> import math
    >>> import mbody
    >>> run = mbody.kinematics(mbody.gallery.load("cam_follower"), turn=True)
    >>> found = cam_analysis(run, limit="25 deg")
    >>> round(math.degrees(found.greatest.value), 3), round(found.needed, 3)
    (21.942, 32.049)
    """
    run = as_solution(run)
    check_moving(run, "a cam is")
    cam = named_cam(run.mechanism, joint)
    numbers = run.system.numbers
    bound = None
    if limit is not None:
        bound = number_in(run.mechanism, limit, "angle", cam.name, "limit")
        if not 0.0 < bound < 0.5 * math.pi:
            raise ModelError(
                f"the limit of the pressure angle of '{cam.name}' is above 0 and below 90 deg, not "
                f"{math.degrees(bound):g} deg",
                cam.name,
            )
    pressure, psi = _pressure(run, cam)
    greatest = _greatest(run, cam, pressure, psi)
    places = cam_places(cam)
    pitch, contour = cam_curvature(cam, numbers, places)
    hollow = None
    if (contour < 0.0).any():
        hollow = _least(np.where(contour < 0.0, -contour, np.inf), places)
    R, derivative, _ = np.broadcast_arrays(*cam.radius(numbers, places))
    roller = 0.0 if cam.flat else float(numbers[f"{cam.name}.roller"])
    base = float(R.min()) - roller
    kind = "flat face" if cam.flat else "roller" if roller else "knife edge"
    path = follower_path(_fine(run), cam)
    notes, uncut, needed = [], None, None
    if path is None:
        notes.append(
            f"'{cam.name}': no base radii: its follower is not on one guide or pin of the ground, "
            "or its cam does not turn about a fixed centre"
        )
    else:
        kind = f"{'translating' if path.along else 'swinging'} {kind}"
        uncut = path.least_base()
        if bound is not None:
            needed = path.least_base(bound)
            if needed is None:
                notes.append(
                    f"'{cam.name}': no base circle keeps the pressure angle within "
                    f"{math.degrees(bound):g} deg: change the guide, the arm or the lift"
                )
    if greatest is None:
        notes.append(f"'{cam.name}': no pressure angle: the follower cannot move")
    return CamAnalysis(
        mechanism=run.mechanism,
        joint=cam,
        follower=kind,
        t=np.array(run.t),
        psi=psi,
        pressure_angle=pressure,
        curvature=cam_curvature(cam, numbers, psi)[1],
        greatest=greatest,
        sharpest=_least(np.where(contour > 0.0, contour, np.inf), places),
        pitch_sharpest=_least(np.where(pitch > 0.0, pitch, np.inf), places),
        hollow=hollow,
        base_radius=base,
        roller=roller,
        needed=needed,
        uncut=uncut,
        limit=bound,
        face=(float(derivative.min()), float(derivative.max())) if cam.flat else None,
        run=run,
        **inherited(run, notes=notes),
    )


def _least(values: Array, psi: Array) -> CamPlace:
    n = int(values.argmin())
    return CamPlace(float(values[n]), float(psi[n]))


def _pressure(run: Solution, cam: CamFollower) -> tuple[Array, Array]:
    """The pressure angle and ψ at every instant."""
    at, d, angle_i, angle_j = ends(run, cam)
    normal = cam.normal(at, d, angle_i, angle_j)
    n = np.broadcast_to(np.asarray(normal[0]) + 1j * np.asarray(normal[1]), len(run))
    sign = -1.0 if cam.clockwise else 1.0
    ray = angle_j + 0.5 * math.pi if cam.flat else np.arctan2(d[1], d[0])
    psi = np.mod(sign * (angle_i - ray), math.tau)
    place = run.point(cam.j) if cam.roller else None
    if place is None:
        x, y = run.reaction_point(cam.name)
    else:
        x, y = place.x, place.y
    directions = np.array(
        [_direction_of_motion(run, cam, k, complex(x[k], y[k])) for k in range(len(run))]
    )
    omega = run[cam.i.body].omega
    rotation_sign = np.where(np.abs(omega) > 0.0, np.sign(omega), sign)
    angle = np.angle(n / np.where(directions == 0.0, np.nan, directions))
    # either way along the same line
    angle = (angle + 0.5 * math.pi) % math.pi - 0.5 * math.pi
    return rotation_sign * angle, psi


def _direction_of_motion(run: Solution, cam: CamFollower, k: int, place: complex) -> complex:
    """Where a place of the follower can go beside the cam, the contact released; 0 for nowhere."""
    system = run.system
    work = system.work()
    n = system.coordinates
    q = run.record.table(slice(None))[k, :n]
    work.q[:n, 0] = q
    work.time[:] = run.t[k]
    own = system.primitives_of[cam.name]
    kept = np.array([e not in own for e in system.row_table[0]])
    along = np.linalg.svd(dense(system, work)[1][kept])[2][-1]

    def velocity(body: str) -> complex:
        if body == "ground":
            return 0j
        first = 3 * system.bodies[body]
        x, y, rotation = along[first : first + 3]
        relative = (place - complex(*q[first : first + 2])) / system.length
        return complex(x, y) + 1j * rotation * relative

    found = velocity(cam.j.body) - velocity(cam.i.body)
    return found if abs(found) > tol.RATE_NONE_COORDINATE else 0j


def _greatest(run: Solution, cam: CamFollower, pressure: Array, psi: Array) -> CamPlace | None:
    """The greatest angle of the instants, then between those on either side of it."""
    sizes = np.abs(pressure)
    if not np.isfinite(sizes).any():
        return None
    k = int(np.nanargmax(sizes))
    best = CamPlace(float(sizes[k]), float(psi[k]))
    drivers = run.system.independent_drivers
    if not drivers:
        return best

    def sizes_of(finer: Solution, _: Array) -> tuple[Array, Array]:
        pressure, psi = _pressure(finer, cam)
        return np.abs(pressure), psi

    x = np.asarray(run.driven(drivers[0].name)[0], dtype=float)
    for value, place in greatest_between(run, x, k, sizes_of):
        if value >= best.value:
            best = CamPlace(value, place)
    return best


def _fine(run: Solution) -> Solution:
    """The motion at many instants and unit speed, where one driver makes it."""
    independent = run.system.independent_drivers
    if len(independent) != 1 or len(run) < 2:
        return run
    x = np.asarray(run.driven(independent[0].name)[0], dtype=float)
    if x[0] == x[-1]:
        return run
    values = np.linspace(x[0], x[-1], FINE)
    drive = {independent[0].name: (values, math.copysign(1.0, x[-1] - x[0]))}
    return kinematics(run.system, drive=drive, guess=pose_at(run, 0))


# -- The profile of a cam for the motion that its follower is to make --------------------------

#: Points of the table, both ends included: every quarter of a degree.
POINTS = 1441


def cam_profile(
    lift: Law,
    base_radius: float,
    *,
    roller: float = 0.0,
    offset: float = 0.0,
    arm: float | None = None,
    centre_distance: float | None = None,
) -> Table:
    """The profile of a `CamFollower`, without its `base_radius`, under a roller or a knife edge
    that is not led through the centre of its cam: offset on a guide, or on an arm.

    Parameters
    ----------
    lift : Law
        What the follower is to do, of the angle θ by which the cam has rotated counter-clockwise,
        over one revolution: the travel along the guide [length], or the angle of the arm, away from
        the cam [rad], from 0 on.
    base_radius, roller : float
        Of the base circle, above 0, and of the roller [length].
    offset : float
        Of the guide from the cam's centre [length], to the right of the direction of the lift.
    arm, centre_distance : float, optional
        Length of an arm, and the distance of its pivot from the cam's centre [length]; seen from
        the cam the pivot is then on the right of the roller.

    Returns
    -------
    Table
        R(ψ), the pitch curve by how far the cam has rotated since its line of 0 pointed at the
        follower; at θ = 0 it does. Give it as the `profile`; `roller` goes to the joint too.

    Raises
    ------
    ModelError
        For lengths between which no follower fits, and a lift at which the follower runs around the
        cam faster than it turns.

    Notes
    -----
    With d from the centre to the roller, d = (offset, S + s) on a guide, S = √((base_radius +
    roller)² − offset²): R = |d|, and ψ = θ − (∠d − ∠d₀). The table is a periodic cubic spline
    through points every quarter of a degree of θ: an error of some 1e-9 of the lift where its
    third derivative does not jump. Source: Norton, *Design of Machinery*, chapter 8.

    Examples
    --------
    >>> from mbody.laws import Harmonic
    >>> lift = Harmonic(mean=0.01, amplitude=-0.01, frequency=1.0, phase=np.pi / 2)
    >>> profile = cam_profile(lift, 0.04, roller=0.01, offset=0.02)
    >>> np.round(profile(np.array([0.0, 2.0 * np.pi])), 9)
    array([0.05, 0.05])
    """
    radius = float(base_radius) + float(roller)
    theta = np.linspace(0.0, math.tau, POINTS)
    s = np.broadcast_to(np.asarray(lift(theta), dtype=float), theta.shape)
    if not (base_radius > 0.0 and roller >= 0.0):
        raise ModelError(
            f"a cam has a base circle above 0 and a roller from 0 on, not {base_radius:g} and "
            f"{roller:g}"
        )
    if (arm is None) != (centre_distance is None):
        raise ModelError("a follower on an arm has an arm and a centre_distance: give both")
    if arm is None or centre_distance is None:
        if not abs(offset) < radius:
            raise ModelError(
                f"a guide at the offset {offset:g} passes the pitch circle of {radius:g}: give a "
                "smaller offset, or a greater base_radius"
            )
        d = offset + 1j * (math.sqrt(radius**2 - offset**2) + s)
    else:
        if not abs(centre_distance - arm) < radius < centre_distance + arm:
            raise ModelError(
                f"an arm of {arm:g} at the distance {centre_distance:g} does not reach a pitch "
                f"circle of {radius:g}: give an arm between {abs(centre_distance - radius):g} and "
                f"{centre_distance + radius:g}"
            )
        # the arm points from the pivot back at the cam, above the line of centres
        cosine = (arm**2 + centre_distance**2 - radius**2) / (2.0 * arm * centre_distance)
        d = centre_distance - arm * np.exp(-1j * (math.acos(cosine) + s))
    direction = np.unwrap(np.angle(d))
    psi = theta - (direction - direction[0])
    if not (np.diff(psi) > 0.0).all():
        n = int(np.diff(psi).argmin())
        raise ModelError(
            f"near {math.degrees(theta[n]):.4g} deg the follower runs around the cam faster than "
            "it turns: give a smaller lift, or a greater base_radius"
        )
    R = np.abs(d)
    if abs(R[-1] - R[0]) > TABLE_CLOSES * R.max():
        raise ModelError(
            f"the lift does not close: {s[0]:.6g} at 0 deg, {s[-1]:.6g} at 360 deg: give a law "
            "that repeats after one turn"
        )
    R[-1], psi[-1] = R[0], math.tau
    return Table(psi, R, periodic=True)


Array = np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class CamUndercut(Inherited, Presented):
    """Whether a cam undercuts its follower, of its profile alone; ``print`` shows it.

    Attributes
    ----------
    mechanism : Mechanism
    joint : CamFollower
    undercut : bool
    ranges : array (ranges, 2)
        ψ where the pitch curve is more sharply bent than the roller, of a flat face where the
        contour has no radius of curvature above 0, from and to, counted on beyond a turn [rad].
    least : CamPlace
        Least radius of curvature of the pitch curve where it is convex, of the contour under a flat
        face [length]; infinite where it is nowhere convex.
    roller : float
        Radius of the roller, 0 of others [length].
    base_radius : float
        Least radius of the contour that was described [length].
    least_base : float
        The least base radius with which this profile does not undercut: what `base_radius`, or the
        profile, has to be raised to is more than this [length].
    greatest_roller : float or None
        The greatest roller with which it does not, the base radius being what it is; where the
        profile is given with the roller, the pitch curve. None where none will do, and of a flat
        face or a knife edge [length].

    >>> import mbody
    >>> from mbody.engineering import cam_undercut
    >>> found = cam_undercut(mbody.gallery.load("cam_follower"))
    >>> found.undercut, round(found.least.value, 3)
    (False, 41.043)
    """

    mechanism: Mechanism = field(repr=False)
    joint: CamFollower
    undercut: bool
    ranges: Array
    least: CamPlace
    roller: float
    base_radius: float
    least_base: float
    greatest_roller: float | None

    about_text = "cam '{0.joint.name}', {0.kind}: undercut"
    analysis_name = "cam undercut"
    angle_unit = "deg"
    declared = (
        Sentence(lambda found: found.sentences),
        Heading("CAM"),
        Value("joint", value=lambda found: found.joint.name),
        Value("undercut"),
        Value("ranges", dimension="angle"),
        Value("base_radius", "base radius", "length"),
        Value("roller", dimension="length"),
        Value("", "radius of the roller", "length", lambda found: found.roller or None),
        Value("least_radius", "least radius of curvature", "length", "least", columns=AT),
        Value("least_base_radius", "", "length", "least_base"),
        Value(
            "",
            "least base radius without undercut",
            "length",
            lambda found: found.least_base if found.joint.flat or found.roller else None,
        ),
        Value("greatest_roller", "greatest roller without undercut", "length"),
    )

    @property
    def kind(self) -> str:
        """What follows it."""
        return "flat face" if self.joint.flat else "roller" if self.roller else "knife edge"

    @property
    def sentences(self) -> list[str]:
        """Where it undercuts."""
        name = f"'{self.joint.name}' undercuts"
        found = [
            f"{name} its {self.kind} from ψ = {low:.2f} to {high:.2f} deg"
            for low, high in np.degrees(self.ranges).tolist()
        ]
        if self.roller and self.greatest_roller is None:
            found.append("no roller rolls without undercutting")
        return found if self.undercut else [f"{name} nowhere", *found]


def cam_undercut(model: Mechanism | System, joint: str | None = None) -> CamUndercut:
    """Where a cam undercuts its follower, and the base circle or the roller that avoids it, by the
    profile alone: no motion is needed, so that it is found of cams that analyses refuse.

    Parameters
    ----------
    model : Mechanism or System
        Of one design.
    joint : str, optional
        Name of a `CamFollower`; by default the only one.

    Returns
    -------
    CamUndercut

    Raises
    ------
    ModelError
        For a joint that is no cam, a profile that does not close or is no radius, and whatever else
        is wrong with the mechanism.

    Notes
    -----
    A roller of radius r touches the whole profile where the radius of curvature of the convex parts
    of its pitch curve, (R² + R′²)^(3/2)/(R² + 2 R′² − R R″), is more than r; a flat face where
    h + h″ is positive. Curvatures are taken at every twentieth of a degree and on both sides of the
    places where the profile's second derivative jumps. Raising the base radius adds to R, or to h.
    A knife edge undercuts nothing: it has no radius.

    Source: Norton, *Design of Machinery*, section 8.7.

    Examples
    --------
    A roller of 40 mm on a base circle of 5 mm:

    >>> import mbody
    >>> numbers = {"roller": "40 mm", "base": "5 mm"}
    >>> found = cam_undercut(mbody.gallery.load("cam_follower", numbers))
    >>> found.undercut, round(found.least_base, 3), round(found.greatest_roller, 3)
    (True, 8.731, 26.308)
    """
    machine = model if isinstance(model, Mechanism) else model.mechanism
    cam = named_cam(machine, joint)
    psi = cam_places(cam)
    R, R1, R2, roller = _profile(model, cam, psi)
    rho = R + R2 if cam.flat else pitch_radius(R, R1, R2)
    base, least_base, greatest = float(R.min()) - roller, 0.0, None
    if cam.flat:
        least_base = base - float(rho.min())
    elif roller > 0.0:
        least_base = base + least_raise(R, R1, R2, roller)
        grows = cam.base_radius is not None
        greatest = _greatest_roller(R - roller, R1, R2) if grows else float(rho.min())
    undercut = bool(rho.min() <= roller) and (cam.flat or roller > 0.0)
    n = int(rho.argmin())
    return CamUndercut(
        mechanism=machine,
        joint=cam,
        undercut=undercut,
        ranges=_ranges(psi, rho <= roller) if undercut else np.zeros((0, 2)),
        least=CamPlace(float(rho[n]), float(psi[n])),
        roller=roller,
        base_radius=base,
        least_base=least_base if least_base > CAM_CIRCLE_NONE * float(R.max()) else 0.0,
        greatest_roller=greatest,
    )


def _profile(
    model: Mechanism | System, cam: CamFollower, psi: Array
) -> tuple[Array, Array, Array, float]:
    """R or h with its derivatives at the places ψ, and the roller's radius."""
    if isinstance(model, System):
        R, R1, R2 = np.broadcast_arrays(*cam.radius(model.numbers, psi))
        return R, R1, R2, 0.0 if cam.flat else float(model.numbers[f"{cam.name}.roller"])
    # knife edges on the same pitch curves, which an assembly does not refuse
    machine, made = model, model
    plain: dict[str, Any] = dict.fromkeys(("friction", "static", "stribeck", "pin_radius"))
    for one in (joint for joint in machine.joints if isinstance(joint, CamFollower)):
        base: Any = one.base_radius
        if base is not None:
            base = base + one.roller
        edge = replace(one, roller=0.0, flat=False, base_radius=base, **plain)
        made = with_element(made, edge)
    numbers = assemble(made).numbers
    smooth: Any = made[cam.name]
    R, R1, R2 = np.broadcast_arrays(*smooth.radius(numbers, psi))
    roller: Any = cam.roller
    return R, R1, R2, float(roller)


def _greatest_roller(lift: Array, R1: Array, R2: Array) -> float | None:
    """The greatest roller on the pitch curve that is as far as it outside a contour: (R less the
    roller). None where even a knife edge would be bent.
    """

    def cuts(size: float) -> bool:
        return bool(pitch_radius(lift + size, R1, R2).min() <= size)

    if lift.min() <= 0.0 or cuts(0.0):
        return None
    high = float(lift.max())
    while not cuts(high):
        high *= 2.0
        if high > CAM_CIRCLE_ENDLESS * float(lift.max()):
            return math.inf
    return last_place(cuts, high, 0.0)


def _ranges(psi: Array, cut: Array) -> Array:
    """From and to of the stretches of a closed circle of places where something is."""
    if cut.all():
        return np.array([[0.0, math.tau]])
    begin = np.flatnonzero(cut & ~np.roll(cut, 1))
    end = np.flatnonzero(cut & ~np.roll(cut, -1))
    if end[0] < begin[0]:
        end = np.roll(end, -1)
    start, stop = psi[begin], psi[end]
    return np.column_stack([start, np.where(stop < start, stop + math.tau, stop)])
