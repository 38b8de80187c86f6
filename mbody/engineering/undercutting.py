"""Undercutting of a cam: where, by how much, and with which base circle or roller there is none."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.engineering.cam_limits import CamPlace, cam_places, named_cam
from mbody.model.closed_mechanism import with_element
from mbody.model.joints import CamFollower
from mbody.model.mechanism import Mechanism
from mbody.sheets.text_table import Column, even, number, paragraph, table, title
from mbody.solution.doubts import Inherited, heading, unit_symbols
from mbody.system.assembler import assemble
from mbody.system.read_only import lock
from mbody.system.system import System

Array = np.ndarray

#: A size that is none, and one without end, by the greatest radius of the profile.
NOTHING, ENDLESS = 1e-9, 1e6
#: How often the limit between two sizes is halved: to the last bit.
HALVED = 60


@dataclass(frozen=True, kw_only=True, eq=False)
class CamUndercut(Inherited):
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

    def __post_init__(self) -> None:
        lock(self)

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """As plain values, ready for JSON; what is infinite or undefined is null."""
        turn = np.degrees if angle == "deg" else np.asarray
        symbols = unit_symbols(self.mechanism.units, angle)
        value = self.least.value
        return heading(self.mechanism.name, "cam undercut", symbols, self) | {
            "joint": self.joint.name,
            "undercut": self.undercut,
            "ranges": turn(self.ranges).tolist(),
            "least_radius": {
                "value": value if math.isfinite(value) else None,
                "psi": float(turn(self.least.psi)),
            },
            "roller": self.roller,
            "base_radius": self.base_radius,
            "least_base_radius": self.least_base,
            "greatest_roller": self.greatest_roller,
        }

    def __str__(self) -> str:
        return _sheet(self)


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
    rho = R + R2 if cam.flat else _convex(R, R1, R2)
    base, least_base, greatest = float(R.min()) - roller, 0.0, None
    if cam.flat:
        least_base = base - float(rho.min())
    elif roller > 0.0:
        least_base = base + _least_raise(R, R1, R2, roller)
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
        least_base=least_base if least_base > NOTHING * float(R.max()) else 0.0,
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


def _convex(R: Array, R1: Array, R2: Array) -> Array:
    """Radius of curvature of a pitch curve, inf where it is straight or hollow."""
    bend = R * R + 2.0 * R1 * R1 - R * R2
    speed = (R * R + R1 * R1) ** 1.5
    return np.divide(speed, bend, out=np.full(len(R), np.inf), where=bend > 0.0)


def _limit(keeps: Callable[[float], bool], low: float, high: float) -> float:
    """Between a size that does not keep a condition and one that does, where it begins to."""
    for _ in range(HALVED):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if keeps(middle) else (middle, high)
    return high


def _least_raise(R: Array, R1: Array, R2: Array, roller: float) -> float:
    """How much a pitch curve has to be raised, or may be lowered (negative), to be nowhere bent
    more sharply than the roller.
    """

    def keeps(by: float) -> bool:
        return bool(_convex(R + by, R1, R2).min() > roller)

    down = roller - float(R.min())  # the contour shrinks to its centre
    if keeps(0.0):
        return down if keeps(down) else _limit(keeps, down, 0.0)
    up = roller
    while not keeps(up):
        up *= 2.0
    return _limit(keeps, 0.0, up)


def _greatest_roller(lift: Array, R1: Array, R2: Array) -> float | None:
    """The greatest roller on the pitch curve that is as far as it outside a contour: (R less the
    roller). None where even a knife edge would be bent.
    """

    def cuts(size: float) -> bool:
        return bool(_convex(lift + size, R1, R2).min() <= size)

    if lift.min() <= 0.0 or cuts(0.0):
        return None
    high = float(lift.max())
    while not cuts(high):
        high *= 2.0
        if high > ENDLESS * float(lift.max()):
            return math.inf
    return _limit(cuts, 0.0, high)


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


def _sheet(found: CamUndercut) -> str:
    """An undercut as text, at most 100 characters wide."""
    unit, cam = found.mechanism.units.length, found.joint
    kind = "flat face" if cam.flat else "roller" if found.roller else "knife edge"
    words = f"cam '{cam.name}', {kind}: undercut"
    lines = [*title(found.mechanism.name, words, found.mechanism.units), ""]
    if not found.undercut:
        lines += paragraph(f"'{cam.name}' undercuts nowhere")
    for low, high in np.degrees(found.ranges).tolist():
        where = f"from ψ = {low:.2f} to {high:.2f} deg"
        lines += paragraph(f"'{cam.name}' undercuts its {kind} {where}")
    curve = "contour" if cam.flat else "pitch curve"
    rows = [("base radius", number(found.base_radius), unit, "")]
    if found.roller:
        rows.append(("radius of the roller", number(found.roller), unit, ""))
    if math.isfinite(found.least.value):
        psi = f"{math.degrees(found.least.psi):.3f}"
        rows.append((f"least radius of the {curve}", number(found.least.value), unit, psi))
    if cam.flat or found.roller:
        rows.append(("least base radius without undercut", number(found.least_base), unit, ""))
    if found.roller:
        size = found.greatest_roller
        greatest = ("none", "") if size is None else (number(size), unit)
        if size is None or math.isfinite(size):
            rows.append(("greatest roller without undercut", *greatest, ""))
    what, cells, units, where_at = zip(*rows, strict=True)
    lines += [
        "",
        *table(
            [
                Column("CAM", what, text=True),
                Column("", cells),
                Column("unit", units, text=True),
                Column("at ψ", where_at, "deg"),
            ]
        ),
    ]
    return "\n".join(even(lines))
