"""Cams: pressure angle, curvature, contour, and the base circle that they need."""

from __future__ import annotations

import math

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.engineering.cam_contour import cam_curvature
from mbody.engineering.cam_places import cam_places, named_cam
from mbody.engineering.cam_result import CamAnalysis, CamPlace
from mbody.engineering.follower_path import follower_path
from mbody.engineering.relative_motion import check_moving, pose_at
from mbody.errors import ModelError, SolveError
from mbody.model.joints import CamFollower
from mbody.model.numbers import number_in
from mbody.quantities.types import Number
from mbody.solution.doubts import inherited
from mbody.solution.places import ends
from mbody.solution.solution import Solution, as_solution
from mbody.system.rank import dense

__all__ = ["cam_analysis"]

Array = np.ndarray

#: Instants of the turn in which base circles are tried.
FINE = 3601
#: The greatest pressure angle is searched between instants on finer grids.
ZOOMS, GRID = 5, 21
#: Of the swiftest coordinate, what does not move.
NONE = 1e-10


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
    The way that the follower can go is its motion when the cam is held and the contact released:
    along a guide, across an arm. On a guide tan φ = (s′ − e)/(s + √(R₀² − e²)) with R₀ the least
    radius of the pitch curve and e the offset. The radius of curvature of the contour is that of
    the pitch curve less the roller's; under a flat face h + h″. Base radii are searched with the
    motion of the follower kept, by its guide or arm; for others there is none, and a note.

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
    R, slope, _ = np.broadcast_arrays(*cam.radius(numbers, places))
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
        face=(float(slope.min()), float(slope.max())) if cam.flat else None,
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
    sense = -1.0 if cam.clockwise else 1.0
    ray = angle_j + 0.5 * math.pi if cam.flat else np.arctan2(d[1], d[0])
    psi = np.mod(sense * (angle_i - ray), math.tau)
    place = run.point(cam.j) if cam.roller else None
    if place is None:
        x, y = run.reaction_point(cam.name)
    else:
        x, y = place.x, place.y
    way = np.array([_way(run, cam, k, complex(x[k], y[k])) for k in range(len(run))])
    omega = run[cam.i.body].omega
    turning = np.where(np.abs(omega) > 0.0, np.sign(omega), sense)
    angle = np.angle(n / np.where(way == 0.0, np.nan, way))
    # either way along the same line
    angle = (angle + 0.5 * math.pi) % math.pi - 0.5 * math.pi
    return turning * angle, psi


def _way(run: Solution, cam: CamFollower, k: int, place: complex) -> complex:
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
        x, y, turn = along[first : first + 3]
        arm = (place - complex(*q[first : first + 2])) / system.length
        return complex(x, y) + 1j * turn * arm

    found = velocity(cam.j.body) - velocity(cam.i.body)
    return found if abs(found) > NONE else 0j


def _greatest(run: Solution, cam: CamFollower, pressure: Array, psi: Array) -> CamPlace | None:
    """The greatest angle of the instants, then between those on either side of it."""
    sizes = np.abs(pressure)
    if not np.isfinite(sizes).any():
        return None
    k = int(np.nanargmax(sizes))
    best = CamPlace(float(sizes[k]), float(psi[k]))
    leaders = run.system.leaders
    if len(leaders) != 1 or len(run) < 3:
        return best
    x = np.asarray(run.driven(leaders[0].name)[0], dtype=float)
    steps = np.diff(x)
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        return best
    low, high, pose = float(x[max(k - 1, 0)]), float(x[min(k + 1, len(x) - 1)]), pose_at(run, k)
    sign = math.copysign(1.0, steps[0])
    for _ in range(ZOOMS):
        values = np.linspace(low, high, GRID)
        try:
            near = kinematics(run.system, drive={leaders[0].name: (values, sign)}, guess=pose)
        except SolveError:
            return best
        found, where = _pressure(near, cam)
        n = int(np.nanargmax(np.abs(found)))
        if abs(found[n]) >= best.value:
            best = CamPlace(float(abs(found[n])), float(where[n]))
        low, high = float(values[max(n - 1, 0)]), float(values[min(n + 1, GRID - 1)])
        pose = pose_at(near, max(n - 1, 0))
    return best


def _fine(run: Solution) -> Solution:
    """The same motion at many instants and unit speed, where one driver makes it."""
    leaders = run.system.leaders
    if len(leaders) != 1 or len(run) < 2:
        return run
    x = np.asarray(run.driven(leaders[0].name)[0], dtype=float)
    if x[0] == x[-1]:
        return run
    values = np.linspace(x[0], x[-1], FINE)
    drive = {leaders[0].name: (values, math.copysign(1.0, x[-1] - x[0]))}
    return kinematics(run.system, drive=drive, guess=pose_at(run, 0))
