"""What limits a cam, with its sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.engineering.cam_contour import cam_contour, cam_curvature
from mbody.errors import ModelError, brief
from mbody.model.joints import CamFollower
from mbody.model.mechanism import Mechanism
from mbody.sheets.names import certified, title
from mbody.sheets.text_table import Column, angles, even, number, numbers, table
from mbody.solution.doubts import Inherited
from mbody.system.read_only import lock

__all__ = ["CamAnalysis", "CamPlace"]

Array = np.ndarray

#: Instants that are shown.
SHOWN = 13


@dataclass(frozen=True)
class CamPlace:
    """A least or greatest value of a cam.

    Attributes
    ----------
    value : float
    psi : float
        Where on the cam: how far it has turned since its line of 0 pointed at the follower [rad].

    >>> CamPlace(0.031, 4.03).value
    0.031
    """

    value: float
    psi: float


@dataclass(frozen=True, kw_only=True, eq=False)
class CamAnalysis(Inherited):
    """A cam with its follower over a cycle; ``print`` shows it.

    Attributes
    ----------
    mechanism : Mechanism
    joint : CamFollower
    follower : str
        "roller", "knife edge" or "flat face", with "translating" or "swinging"
        before it where it is one on a guide or an arm of the ground.
    t, psi : arrays (instants,)
        How far the cam has turned since its line of 0 pointed at the follower, 0 … 2π [rad].
    pressure_angle : array (instants,)
        Between the contact's normal and the way that the follower can go, positive where the
        normal leans to where the cam turns, as in a rise on a centred guide [rad]; NaN where the
        place of contact cannot go anywhere.
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

    def __post_init__(self) -> None:
        lock(self)

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

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """As plain values, ready for JSON; what is infinite or undefined is null."""
        turn = np.degrees if angle == "deg" else np.asarray

        def place(one: CamPlace | None, angular: bool = False) -> dict[str, float | None] | None:
            if one is None:
                return None
            value = float(turn(one.value)) if angular else one.value
            psi = float(turn(one.psi))
            return {"value": value if math.isfinite(value) else None, "psi": psi}

        return {
            "joint": self.joint.name,
            "follower": self.follower,
            "base_radius": self.base_radius,
            "roller": self.roller,
            "greatest_pressure_angle": place(self.greatest, angular=True),
            "least_radius_of_curvature": place(self.sharpest),
            "least_radius_of_pitch_curve": place(self.pitch_sharpest),
            "least_hollow_radius": place(self.hollow),
            "limit": None if self.limit is None else float(turn(self.limit)),
            "base_radius_for_limit": self.needed,
            "base_radius_without_undercut": self.uncut,
            "face": self.face,
            "t": self.t.tolist(),
            "psi": turn(self.psi).tolist(),
            "pressure_angle": _plain(turn(self.pressure_angle)),
            "radius_of_curvature": _plain(self.curvature),
        }

    def __str__(self) -> str:
        return _sheet(self)


def _plain(values: Array) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]


def _sheet(found: CamAnalysis) -> str:
    """A cam as text, at most 100 characters wide."""
    unit = found.mechanism.units.length
    words = f"cam '{found.joint.name}', {found.follower}"
    lines = [*title(found.mechanism.name, words, found.mechanism.units), ""]
    rows: list[tuple[str, str, str, str]] = [
        ("base radius", number(found.base_radius), unit, ""),
    ]
    if found.roller:
        rows.append(("radius of the roller", number(found.roller), unit, ""))
    if found.greatest is not None:
        rows.append(
            (
                "greatest pressure angle",
                f"{math.degrees(found.greatest.value):.4f}",
                "deg",
                _at(found.greatest),
            )
        )
    if found.roller:
        rows.append(_radius("least radius of the pitch curve", found.pitch_sharpest, unit))
    rows.append(_radius("least radius of the contour, convex", found.sharpest, unit))
    if found.hollow is not None:
        rows.append(_radius("least radius of the contour, hollow", found.hollow, unit))
    if found.face is not None:
        low, high = numbers(found.face)
        rows.append(("contact along the face, from", low.strip(), unit, ""))
        rows.append(("to", high.strip(), unit, ""))
    if found.uncut is not None:
        rows.append(("least base radius without undercut", number(found.uncut), unit, ""))
    if found.limit is not None and found.needed is not None:
        bound = f"base radius for a pressure angle of {math.degrees(found.limit):g} deg"
        rows.append((bound, number(found.needed), unit, ""))
    what, cells, units, where = zip(*rows, strict=True)
    lines += table(
        [
            Column("CAM", what, text=True),
            Column("", cells),
            Column("unit", units, text=True),
            Column("at ψ", where, "deg"),
        ]
    )
    last = len(found.t) - 1
    kept = sorted({round(n * last / (min(SHOWN, last + 1) - 1 or 1)) for n in range(SHOWN)})
    kept = [k for k in kept if k <= last]
    lines += [
        "",
        *table(
            [
                Column("t", numbers(found.t[kept]), found.mechanism.units.time),
                Column("ψ", angles(found.psi[kept]), "deg"),
                Column("pressure angle", _signed(found.pressure_angle[kept]), "deg"),
                Column("radius of the contour", _lengths(found.curvature[kept]), unit),
            ]
        ),
    ]
    if len(kept) <= last:
        lines.append(f"{len(kept)} of {last + 1} instants; all of them with --json")
    return "\n".join(even([*lines, *certified(found)]))


def _radius(words: str, place: CamPlace, unit: str) -> tuple[str, str, str, str]:
    if not math.isfinite(place.value):
        return words, "none", "", ""
    return words, number(place.value), unit, _at(place)


def _at(place: CamPlace) -> str:
    return f"{math.degrees(place.psi):.3f}"


def _signed(values: np.ndarray) -> list[str]:
    return [f"{math.degrees(v) + 0.0:.3f}" if math.isfinite(v) else "–" for v in values.tolist()]


def _lengths(values: np.ndarray) -> list[str]:
    finite = [value for value in values.tolist() if math.isfinite(value)]
    cells = iter(numbers(finite or [0.0]))
    return [next(cells) if math.isfinite(v) else "straight" for v in values.tolist()]
