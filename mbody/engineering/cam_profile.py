"""The profile of a cam for the motion that its follower is to make."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.core.bracket import last_place
from mbody.core.presentation import Presented
from mbody.core.tolerances import CAM_CIRCLE_ENDLESS, CAM_CIRCLE_NONE, TABLE_CLOSES
from mbody.engineering.cam_limits import AT, CamPlace, cam_places, named_cam
from mbody.errors import ModelError
from mbody.laws import Law, Table
from mbody.model.closed_mechanism import with_element
from mbody.model.joints import CamFollower
from mbody.model.joints.cam import least_raise, pitch_radius
from mbody.model.mechanism import Mechanism
from mbody.solution.declared_result import Heading, Sentence, Value
from mbody.solution.doubts import Inherited
from mbody.system.assembler import assemble
from mbody.system.system import System

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
