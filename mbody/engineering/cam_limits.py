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
from mbody.core.bracket import zero_between
from mbody.core.presentation import Presented
from mbody.engineering.motion_polygons import check_moving
from mbody.errors import ModelError, brief
from mbody.laws import Law
from mbody.model.element import listed
from mbody.model.joints import CamFollower, Prismatic, Revolute
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.quantities.types import Number
from mbody.solution.declared_result import ColumnTable, Heading, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.histories import ends
from mbody.solution.solution import Solution, as_solution
from mbody.system.rank import dense

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

Array = np.ndarray


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
