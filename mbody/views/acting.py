"""The forces and torques on one link at an instant, ready to be drawn: name, place, look."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.free_body import FreeBody, Wrench
from mbody.model.loads import Gravity
from mbody.sheets.text_table import force_floor, forces_on
from mbody.views.frame import rounded_number
from mbody.views.labels import symbolic
from mbody.views.style import DRIVE, FORCE, INK, LOAD

if TYPE_CHECKING:
    from mbody.views.pose import Pose


Array = np.ndarray

COLORS = {"joint": FORCE, "contact": FORCE, "coupling": FORCE, "driver": DRIVE, "load": LOAD}
COLORS["inertia"] = INK
#: What of the drawn scale is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Acting:
    """A force, or a torque, on a link.

    Attributes
    ----------
    gid, text : str
        Plain name, and the name in the notation of books.
    cause : str
        Of the joint, driver, coupling or load; "inertia".
    place : array (2,)
        Where it acts.
    force : array (2,), or None
        Of a torque there is none.
    torque : float
        Of a torque, counter-clockwise positive.
    color : str
    dashed : bool
        Whether it is d'Alembert's.
    wrench : Wrench
        From which it is.
    """

    gid: str
    text: str
    cause: str
    place: Array
    force: Array | None
    torque: float
    color: str
    dashed: bool
    wrench: Wrench

    def value(self, units: Any) -> tuple[str, str]:
        """The amount with its unit, and the direction."""
        if self.force is None:
            return f"{rounded_number(self.torque)} {units.of('torque')}", ""
        degrees = math.degrees(math.atan2(self.force[1], self.force[0])) % 360.0
        size = f"{rounded_number(float(np.hypot(*self.force)))} {units.of('force')}"
        return size, f"@ {round(degrees, 2) % 360.0:.2f}°"


def notation(name: str) -> str:
    r"""A name of `force_names`, as books write it.

    >>> notation("F32"), notation("F(12,3)"), notation("T12,motor"), notation("F_P")
    ('$F_{32}$', '$F_{12,3}$', '$T_{12,\\mathrm{motor}}$', '$F_{P}$')
    """
    parts = re.fullmatch(r"([A-Z])(\d\d|\(\d+,\d+\))(?:,(.*))?", name)
    if parts is None:
        return symbolic(name)
    index = parts[2].strip("()")
    if parts[3]:
        element = re.sub(r"([_$%#&{}])", r"\\\1", parts[3]).replace(" ", r"\ ")
        index += rf",\mathrm{{{element}}}"
    return f"${parts[1]}_{{{index}}}$"


def acting_on(free: FreeBody, pose: Pose) -> list[Acting]:
    """Everything on a link that is no rounding, forces before torques."""
    floor = force_floor(free.solution)
    names = forces_on(pose.mechanism, free.body)
    number = 2 + [body.name for body in pose.mechanism.bodies].index(free.body)
    forces, torques = [], []
    for wrench in free:
        x, y, torque = _placed(wrench, pose, free.body)
        force = np.array([wrench.fx, wrench.fy])
        name, twist = wrench_names(wrench, names, number, pose)
        look = (COLORS[wrench.kind], wrench.kind == "inertia", wrench)
        if wrench.force > max(floor, 0.0):
            gid, text = name
            forces.append(Acting(gid, text, wrench.cause, np.array([x, y]), force, 0.0, *look))
        if abs(torque) > max(floor * pose.system.length, ROUNDING * abs(wrench.torque)):
            gid, text = twist
            at = _pivot(wrench, pose, free.body, np.array([x, y]))
            torques.append(Acting(gid, text, wrench.cause, at, None, torque, *look))
    return [*forces, *torques]


def _placed(wrench: Wrench, pose: Pose, body: str) -> tuple[float, float, float]:
    """The place of a load on the body, where it has one, and the torque about it."""
    if wrench.kind != "load":
        return wrench.x, wrench.y, wrench.torque
    load: Any = pose.mechanism[wrench.cause]
    field = load.sides().get(body)
    if field is None:
        return wrench.x, wrench.y, wrench.torque
    x, y = map(float, pose.place(load, field))
    arm = (x - wrench.x) * wrench.fy - (y - wrench.y) * wrench.fx
    left = wrench.torque - arm
    return x, y, left if abs(left) > ROUNDING * (abs(arm) + abs(wrench.torque)) else 0.0


def _pivot(wrench: Wrench, pose: Pose, body: str, place: Array) -> Array:
    """Where a torque is drawn: about the pin on which the body turns, else at its place."""
    if wrench.kind not in ("driver", "load") or wrench.force > 0.0:
        return place
    ends = [name for name in pose.mechanism[wrench.cause].bodies if name != body]  # type: ignore[attr-defined]  # of a driver or a load
    return pose.pivot(ends[0] if ends else "", body)


def wrench_names(
    wrench: Wrench, names: dict[str, str], number: int, pose: Pose
) -> tuple[tuple[str, str], tuple[str, str]]:
    """The plain name and that of books, of the force and of the torque."""
    cause = wrench.cause
    if wrench.kind == "inertia":
        force = f"$-m_{{{number}}}\\,a_{{G{number}}}$"
        return ("-ma", force), ("-Ialpha", f"$-I_{{{number}}}\\,\\alpha_{{{number}}}$")
    if cause in names:
        plain, twist = names[cause], f"T{names[cause][1:]}"
        return (plain, notation(plain)), (twist, notation(twist))
    if isinstance(pose.mechanism[cause], Gravity):
        return ((f"{cause}", f"$m_{{{number}}}\\,g$"),) * 2
    return ((cause, symbolic(cause)),) * 2
