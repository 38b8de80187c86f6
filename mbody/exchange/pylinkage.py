"""pylinkage: the JSON of its mechanisms.

Joints have an id, a type (ground, revolute, prismatic, tracker) and their drawn position; links
have the ids of their joints, and a type (ground, link, driver, arc_driver). A prismatic joint runs
on a line of the ground; a tracker is a point at a distance and an angle from two joints of a link.
Source: src/pylinkage/mechanism/serialization.py of github.com/HugoFara/pylinkage.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mbody.core.tolerances import FILE_PLACES_SAME, TINY
from mbody.exchange.imported import (
    GROUND,
    DrawnLinkage,
    Imported,
    Place,
    back_and_forth,
    number_of,
    refusal,
    seen,
)
from mbody.laws import ConstantSpeed

FORM = "pylinkage"
JOINTS = ("ground", "revolute", "prismatic", "tracker")
DRIVERS = ("driver", "arc_driver")
LINKS = ("ground", "link", *DRIVERS)
#: Keys that are read, and of what follows from the position.
JOINT_KEYS = (
    "id", "name", "type", "position", "axis", "line_point", "slide_distance", "ref_joint1_id",
    "ref_joint2_id", "distance", "angle",
)  # fmt: skip
LINK_KEYS = (
    "id", "name", "type", "joints", "motor_joint", "angular_velocity", "initial_angle",
    "arc_start", "arc_end",
)  # fmt: skip
#: A revolution in 360 steps, where the file says no speed.
SPEED = math.tau / 360.0


@dataclass
class _JsonJoint:
    """One joint, and the links that have it."""

    id: str
    type: str
    at: Place
    data: Mapping[str, Any]
    links: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        return f"the joint {seen(self.id)}"


def is_pylinkage(data: Mapping[str, Any]) -> bool:
    """Whether data of a JSON file are those of a mechanism of pylinkage."""
    joints = data.get("joints")
    return isinstance(joints, list) and ("links" in data or any("type" in _dict(j) for j in joints))


def pylinkage_from_json(data: Mapping[str, Any], name: str, units: str) -> Imported:
    """The linkage of a file."""
    made = DrawnLinkage(str(data.get("name") or name), FORM, units)
    grounded = _grounded(data)
    joints: dict[str, _JsonJoint] = {}
    for one in data["joints"]:
        joint = _joint(_dict(one), grounded)
        if joint.id in joints:
            raise refusal(joint.name, "there are two of this id")
        joints[joint.id] = joint
        made.note_keys(joint.name, _dict(one), JOINT_KEYS)
    links = [_dict(one) for one in data.get("links") or ()]
    for one in links:
        made.note_keys(f"the link {seen(one.get('id'))}", one, LINK_KEYS)
    named = {str(one.get("id")): _link(made, one, joints) for one in links}
    for joint in joints.values():
        if joint.type == "tracker":
            _track(made, joint, joints)
        else:
            _join(made, joint)
    for one in links:
        if one.get("type") in DRIVERS:
            _driver(made, one, named[str(one.get("id"))], joints)
    others = sorted(str(key) for key in data if key not in ("name", "joints", "links", "ground"))
    if others:
        made.notes.append(f"not taken from the file: {', '.join(map(seen, others))}")
    made.notes.append(f"the file has no unit of length: its numbers are read as {made.length_unit}")
    return made.imported()


def _dict(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}


def _grounded(data: Mapping[str, Any]) -> set[str]:
    """Ids of joints that are on the ground whatever their type says."""
    found: set[str] = set()
    for link in map(_dict, data.get("links") or ()):
        if link.get("type") == "ground":
            found |= {str(one) for one in link.get("joints") or ()}
        elif link.get("motor_joint"):
            found.add(str(link["motor_joint"]))
    return found


def _joint(one: Mapping[str, Any], grounded: set[str]) -> _JsonJoint:
    id_ = str(one.get("id", one.get("name", "?")))
    kind = str(one.get("type", "revolute"))
    name = f"the joint {seen(id_)}"
    if kind not in JOINTS:
        raise refusal(
            name,
            f"its type is {seen(kind)}: files of pylinkage's mechanisms are read, with the types "
            f"{', '.join(JOINTS)}; write it by mechanism_to_json of pylinkage.mechanism",
        )
    position = one.get("position")
    if kind == "tracker" and not (isinstance(position, list) and None not in position):
        position = [0.0, 0.0]  # found from its joints
    if not isinstance(position, list) or len(position) != 2:
        raise refusal(name, "it has no position [x, y]")
    x, y = (number_of(value, name, "its position") for value in position)
    return _JsonJoint(id_, "ground" if id_ in grounded else kind, (x, y), one)


def _link(made: DrawnLinkage, one: Mapping[str, Any], joints: Mapping[str, _JsonJoint]) -> str:
    """The name of a link; its joints know it."""
    id_, kind = str(one.get("id", "?")), str(one.get("type", "link"))
    element = f"the link {seen(id_)}"
    if kind not in LINKS:
        raise refusal(element, f"its type is {seen(kind)}; the types are {', '.join(LINKS)}")
    members = []
    for ref in one.get("joints") or ():
        if str(ref) not in joints:
            raise refusal(element, f"it refers to the joint {seen(ref)}, which is not there")
        members.append(joints[str(ref)])
    fixed = {joint.at for joint in members if joint.type == "ground"}
    if kind == "ground" or len(fixed) > 1:
        if kind != "ground":
            made.notes.append(f"{element} has two joints on the ground: it is part of it")
        for joint in members:
            made.point(GROUND, joint.id, joint.at)
            if joint.type != "ground":
                joint.links.append(GROUND)
        return GROUND
    link = made.link(str(one.get("name") or id_))
    for joint in members:
        if joint.type != "tracker":
            made.point(link, joint.id, joint.at)
        joint.links.append(link)
    return link


def _join(made: DrawnLinkage, joint: _JsonJoint) -> None:
    """The pins of a joint, and its slot."""
    links = list(dict.fromkeys(joint.links))
    if joint.type == "ground" and GROUND not in links:
        links.insert(0, GROUND)
    if not links:
        made.notes.append(f"{joint.name} is on no link, it is left out")
    for link in links[1:]:
        made.pin(joint.id, links[0], link, joint.at)
    if joint.type != "prismatic" or not links:
        return
    axis, point = joint.data.get("axis", [1.0, 0.0]), joint.data.get("line_point", [0.0, 0.0])
    if not all(isinstance(pair, list) and len(pair) == 2 for pair in (axis, point)):
        raise refusal(joint.name, "its axis and its line_point must be pairs [x, y]")
    u = [number_of(value, joint.name, "its axis") for value in axis]
    p = [number_of(value, joint.name, "its line_point") for value in point]
    size = math.hypot(*u)
    if not size:
        raise refusal(joint.name, "its axis has no length")
    across = ((joint.at[1] - p[1]) * u[0] - (joint.at[0] - p[0]) * u[1]) / size
    if abs(across) > FILE_PLACES_SAME * max(math.hypot(*joint.at), math.hypot(*p), TINY):
        raise refusal(joint.name, f"it is {abs(across):g} beside its line")
    if GROUND not in links:
        made.slot(f"{joint.id}_line", GROUND, links[0], joint.at, math.atan2(u[1], u[0]))


def _track(made: DrawnLinkage, joint: _JsonJoint, joints: Mapping[str, _JsonJoint]) -> None:
    """A tracker is a point of the link that has its two joints, or that has itself."""
    refs = [joints.get(str(joint.data.get(f"ref_joint{n}_id"))) for n in (1, 2)]
    first, second = refs
    if first is None or second is None:
        for link in dict.fromkeys(joint.links):
            made.point(link, joint.id, joint.at)
        if not joint.links:
            made.notes.append(f"{joint.name} follows no joints, it is left out")
        return
    distance = number_of(joint.data.get("distance", 0.0), joint.name, "its distance")
    angle = number_of(joint.data.get("angle", 0.0), joint.name, "its angle")
    angle += math.atan2(second.at[1] - first.at[1], second.at[0] - first.at[0])
    at = first.at[0] + distance * math.cos(angle), first.at[1] + distance * math.sin(angle)
    shared = [link for link in first.links if link in second.links]
    if not shared and first.type == second.type == "ground":
        shared = [GROUND]
    if not shared:
        raise refusal(joint.name, f"no link has both {first.name} and {second.name}")
    made.point(shared[0], joint.id, at)


def _driver(
    made: DrawnLinkage, one: Mapping[str, Any], link: str, joints: Mapping[str, _JsonJoint]
) -> None:
    element = f"the driver {seen(one.get('id'))}"
    motor = joints.get(str(one.get("motor_joint")))
    members = [joints[str(ref)] for ref in one.get("joints") or ()]
    others = [joint for joint in members if joint is not motor and joint.type != "tracker"]
    if motor is None or link == GROUND or not others:
        raise refusal(element, "it needs a motor_joint on the ground and a joint that it drives")
    drawn = math.atan2(others[0].at[1] - motor.at[1], others[0].at[0] - motor.at[0])
    speed = number_of(one.get("angular_velocity", SPEED), element, "angular_velocity")

    def angle_from_drawn(key: str, angle: Any) -> float:
        """An angle of the file, counted from the drawn position."""
        return math.remainder(number_of(angle, element, key) - drawn, math.tau)

    made.notes.append(f"{element}: its speed in rad per step is read as rad/s")
    if one.get("type") == "driver":
        start = angle_from_drawn("initial_angle", one.get("initial_angle", drawn))
        made.rotate_by(
            GROUND, link, ConstantSpeed(0.0 if abs(start) < FILE_PLACES_SAME else start, speed)
        )
        return
    low = number_of(one.get("arc_start", 0.0), element, "arc_start")
    high = number_of(one.get("arc_end", math.pi), element, "arc_end")
    if high <= low or not speed:
        raise refusal(
            element, f"an arc of {high - low:g} rad at {speed:g} rad per step is no motion"
        )
    first = one.get("initial_angle")
    begun = low if first is None else number_of(first, element, "initial_angle")
    begun = min(max(begun, low), high)
    ends = [angle for angle in (high, low) if angle != begun]
    start = angle_from_drawn("initial_angle", begun) - begun
    places = [start + angle for angle in (begun, *ends, begun)]
    made.rotate_by(GROUND, link, back_and_forth(places, abs(speed)))
    made.notes.append(f"{element} swings between its two angles at constant speed")
