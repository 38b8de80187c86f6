"""pylinkage: the JSON of its mechanisms.

Joints have an id, a type (ground, revolute, prismatic, tracker) and their drawn position; links
have the ids of their joints, and a type (ground, link, driver, arc_driver). A prismatic joint runs
on a line of the ground; a tracker is a point at a distance and an angle from two joints of a link.
Source: src/pylinkage/mechanism/serialization.py of github.com/HugoFara/pylinkage.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import unquote_plus

from mbody.core.tolerances import FILE_PLACES_SAME, TINY
from mbody.errors import ModelError
from mbody.exchange.imported import (
    GROUND,
    DrawnLinkage,
    Imported,
    Place,
    back_and_forth,
    letters,
    number_of,
    refusal,
    seen,
)
from mbody.laws import ConstantSpeed

# -- PMKS (Planar Mechanism Kinematic Simulator): its lines of text, its address, its JSON -----
#
# A line is a joint: the links, the type, x and y at the drawn position, the angle of a slide, and
# four signs, the last of which marks the driven joint: ``ground,input,R,0,0,0,tfft``. R is a pin, P
# a slide, RP a pin of all further links in a slot of the first, G the place where two wheels touch.
# A joint of one link is a point of it. Source: ConvertTextToData and the class Joint of
# github.com/DesignEngrLab/PMKS, and its PMKSFileFormat.md.

FORM = "PMKS"
TYPES = ("R", "P", "RP", "G")
#: Settings of pictures and of PMKS's own search, which a model does not need.
LOOKS = {"e", "f", "ts", "set"}
LOOKS_OF_JSON = {
    "AngleIncrement", "MaxSmoothingError", "FixedTimeStep", "TargetShape", "AxisThickness",
    "AxisOpacity", "GridOpacity", "NumberMinorPerUnit", "GridSize", "ScaleFactor", "ViewBox",
    "CurrentTime", "EndTime", "StartTime", "AccelFactor", "VelocityFactor", "VectorPenThickness",
    "JointSize", "JointPenThickness",
}  # fmt: skip
JOINT_KEYS = ("Links", "TypeOfJoint", "X", "Y", "Angle", "Name")
KNOWN = {"Joints", "Links", "Name", "DrivingIndex", "InputSpeed"} | LOOKS_OF_JSON

#: The line that begins a table of a model file.
_TABLE = re.compile(r"^\s*\[{1,2}[\w.\"' -]+\]{1,2}\s*(#.*)?$", re.MULTILINE)


@dataclass
class _LineJoint:
    """One joint of a file; angle in rad."""

    label: str
    links: list[str]
    type: str
    at: Place
    angle: float
    driven: bool = False

    @property
    def name(self) -> str:
        return f"the joint {self.label} ({', '.join(self.links)})"


def is_pmks_text(text: str) -> bool:
    """Whether a text may be lines or an address of PMKS. A line with a sign of equality is none of
    a joint, as ``P = { force = 5, at = "coupler.P" }`` of a model file, and no line is where a
    table begins, as ``[bodies.crank]``: the words of a model's comments may be those of joints.

    >>> is_pmks_text("ground,crank,R,0,0"), is_pmks_text("P = { force = 5 }")
    (True, False)
    >>> is_pmks_text("[ground]  # a pin, R, at 0, 0")
    False
    """
    if _TABLE.search(text):
        return False
    lines = [line for line in _lines(text) if "=" not in line]
    return "mech=" in text or any(_type_at(_words(line)) for line in lines)


def is_pmks_json(data: Mapping[str, Any]) -> bool:
    """Whether data of a JSON file are those of PMKS."""
    joints = data.get("Joints")
    return isinstance(joints, list) and any("TypeOfJoint" in _dict(one) for one in joints)


def pmks_from_text(text: str, name: str, units: str) -> Imported:
    """The linkage of lines, or of an address such as ``http://…?mech=ground,input,R,0,0|…``."""
    _check_one(text)
    settings: dict[str, str] = {}
    joints: list[_LineJoint] = []
    for number, line in enumerate(_lines(text), 1):
        key, equals, value = line.partition("=")
        if equals:
            settings[key.strip().lower()] = value.strip()
            continue
        joints.append(_from_line(line, number, letters(len(joints))))
    title = settings.pop("name", "") or name
    made = DrawnLinkage(title, FORM, units)
    driven = settings.pop("d", None)
    speed = settings.pop("s", None)
    if looks := sorted(settings):
        made.notes.append(f"settings of PMKS that a model does not have: {', '.join(looks)}")
    if any(joint.angle for joint in joints):
        made.notes.append("the angles of slides are read in degrees; the file has no unit of them")
    _choose(joints, driven)
    return _built(made, joints, speed)


def _check_one(text: str) -> None:
    """Refuse a file of several addresses."""
    if (several := text.count("mech=")) > 1:
        raise ModelError(
            f"the file has {several} mechanisms of PMKS (mech=): keep one of them in a file"
        )


def pmks_from_json(data: Mapping[str, Any], name: str, units: str) -> Imported:
    """The linkage of a ``.pmks`` file."""
    joints = []
    for n, one in enumerate(data["Joints"]):
        joints.append(_from_table(_dict(one), letters(n)))
    made = DrawnLinkage(str(data.get("Name") or name), FORM, units)
    others = sorted(str(key) for key in data if key not in KNOWN)
    if others:
        made.notes.append(f"not taken from the file: {', '.join(map(seen, others))}")
    for joint, one in zip(joints, data["Joints"], strict=True):
        made.note_keys(joint.name, one, JOINT_KEYS)
    for link in data.get("Links") or ():
        more = sorted(k for k in _dict(link) if k in ("Mass", "MomentOfInertia", "CenterOfMass"))
        if more:
            whose = seen(_dict(link).get("Name"))
            made.notes.append(f"not taken of the link {whose}: {', '.join(more)}")
    if any(joint.angle for joint in joints):
        made.notes.append("the angles of slides are read in radians; the file has no unit of them")
    driven = data.get("DrivingIndex")
    _choose(joints, None if driven is None else str(driven))
    speed = data.get("InputSpeed")
    return _built(made, joints, None if speed is None else str(speed))


def _dict(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}


def _lines(text: str) -> list[str]:
    """The lines of joints and settings, however the text is parted."""
    if "mech=" in text and ("&" in text or "%" in text or re.match(r"\s*https?:", text)):
        text = unquote_plus(re.split(r"[?#]", text, maxsplit=1)[-1])
        parts = [part for part in text.split("&") if part.strip()]
        settings = [part for part in parts if not part.strip().startswith("mech=")]
        found: list[str] = []
        for part in settings:
            if part.startswith("set="):
                pieces = part[4:].split("|")
                found += [f"{piece[0]}={piece[1:]}" for piece in pieces if len(piece) > 1]
            else:
                found.append(part)
        for part in parts:
            if part.strip().startswith("mech="):
                found += part.strip()[5:].split("|")
    else:
        found = re.split(r"[\n\r|]+", text)
    plain = (re.sub(r"^\s*mech\s*=", "", line, flags=re.IGNORECASE).strip() for line in found)
    return [line for line in plain if line]


def _words(line: str) -> list[str]:
    return [word for word in re.split(r"[,\s]+", line) if word]


def _type_at(words: list[str]) -> int:
    """The place of the type in a line, 0 where there is none."""
    found = [n for n, word in enumerate(words) if word.upper() in TYPES]
    return found[-1] if found else 0


def _from_line(line: str, number: int, label: str) -> _LineJoint:
    words = _words(line)
    place = _type_at(words)
    if not place or len(words) < place + 3:
        raise refusal(
            f"line {number} of the joints, {seen(line)}",
            "a joint is written as links, type (R, P, RP or G), x, y and, of a slide, its angle: "
            "ground,input,R,0,0",
        )
    element = f"the joint {label} ({', '.join(words[:place])})"
    x, y = (number_of(words[place + n], element, what) for n, what in ((1, "x"), (2, "y")))
    fields = words[place + 3 :]
    angle = 0.0
    if fields and re.fullmatch(r"[-+]?[\d.]+(e[-+]?\d+)?", fields[0], re.IGNORECASE):
        angle = math.radians(number_of(fields.pop(0), element, "the angle"))
    signs = (
        [sign in "t+" for sign in fields[0]]
        if fields and re.fullmatch("[tf+-]+", fields[0])
        else [word.lower() == "true" for word in fields]
    )
    joint = _joint(label, words[:place], words[place], (x, y), angle)
    joint.driven = len(signs) > 3 and signs[3]
    return joint


def _from_table(one: Mapping[str, Any], label: str) -> _LineJoint:
    links = one.get("Links")
    links = [str(link) for link in links] if isinstance(links, list) else []
    element = f"the joint {label} ({', '.join(links)})"
    if not links:
        raise refusal(f"the joint {label}", "it has no Links")
    x, y = (number_of(one.get(key), element, key) for key in ("X", "Y"))
    angle = one.get("Angle")
    inclined = angle not in (None, "NaN", "")
    inclination = number_of(angle, element, "Angle") if inclined else 0.0
    return _joint(label, links, str(one.get("TypeOfJoint")), (x, y), inclination)


def _joint(label: str, links: list[str], kind: str, at: Place, angle: float) -> _LineJoint:
    made = _LineJoint(label, [_link_name(link) for link in links], kind.upper(), at, angle)
    if made.type not in TYPES:
        raise refusal(made.name, f"its type is {seen(kind)}; the types are R, P, RP and G")
    if made.type in ("R", "G"):
        made.angle = 0.0
    if len(set(made.links)) < len(made.links):
        raise refusal(made.name, "it names a link twice")
    if len(made.links) > 2 and made.type in ("P", "G"):
        raise refusal(made.name, f"a joint of the type {made.type} has two links")
    return made


def _link_name(word: str) -> str:
    """The ground has several names."""
    low = word.strip().lower()
    return GROUND if low in ("0", "gnd", "grnd") or low.startswith("ground") else word.strip()


def _choose(joints: list[_LineJoint], index: str | None) -> None:
    """Mark the driven joint: as signs or an index say, else the first that can be."""
    if index is not None and not any(joint.driven for joint in joints):
        given = number_of(index, "the file", "the index of the driven joint")
        if not 0 <= given < len(joints):
            raise refusal(
                "the file",
                f"the driven joint is number {given:g}, counted from 0, of {len(joints)}",
            )
        joints[int(given)].driven = True
    if not any(joint.driven for joint in joints):
        for joint in joints:
            if len(joint.links) > 1 and joint.type in ("R", "P"):
                joint.driven = True
                return


def _built(made: DrawnLinkage, joints: list[_LineJoint], speed: str | None) -> Imported:
    """The linkage of its joints."""
    _renamed(made, joints)
    rate = number_of(speed, "the file", "the speed") if speed is not None else 1.0
    unit = made.length_unit
    made.notes.append(f"the file has no unit of length: its numbers are read as {unit}")
    wheels = [joint for joint in joints if joint.type == "G" and len(joint.links) > 1]
    for joint in joints:
        if len(joint.links) == 1:
            made.point(joint.links[0], joint.label, joint.at)
            continue
        for n, pair in enumerate(zip(joint.links, joint.links[1:], strict=False)):
            if joint.type == "P":
                made.slide(joint.label, *pair, joint.at, joint.angle)
            elif joint.type == "RP" and n == 0:
                made.slot(joint.label, *pair, joint.at, joint.angle)
            elif joint.type != "G":
                made.pin(joint.label, *pair, joint.at)
    for joint in wheels:
        i, j = joint.links
        made.gears(joint.label, i, j, _centres(joint, joints), joint.at)
    driven = [one for one in joints if one.driven]
    if len(driven) > 1:
        marked = ", ".join(one.label for one in driven)
        raise refusal("the file", f"it marks {len(driven)} joints as driven ({marked}): keep one")
    for joint in driven:
        _driven(made, joint, rate, speed is not None)
    return made.imported()


def _renamed(made: DrawnLinkage, joints: list[_LineJoint]) -> None:
    """Give all moving links their names."""
    named = {GROUND: GROUND}
    for joint in joints:
        for n, link in enumerate(joint.links):
            if link not in named:
                named[link] = made.link(link)
            joint.links[n] = named[link]


def _centres(wheel: _LineJoint, joints: Iterable[_LineJoint]) -> tuple[Place, Place]:
    """The centres of two wheels: their pins on one carrier."""
    pins = [joint for joint in joints if joint.type == "R" and len(joint.links) > 1]
    i, j = wheel.links
    for first in pins:
        for second in pins:
            if first is second or i not in first.links or j not in second.links:
                continue
            if (set(first.links) & set(second.links)) - {i, j}:
                return first.at, second.at
    raise refusal(wheel.name, "its two wheels have no pins on one carrier, so they have no centres")


def _driven(made: DrawnLinkage, joint: _LineJoint, rate: float, given: bool) -> None:
    """The motor of the driven joint."""
    if len(joint.links) < 2 or joint.type not in ("R", "P"):
        raise refusal(joint.name, "it is the driven joint, which must be of the type R or P")
    base, link = joint.links[:2]
    if link == GROUND:
        base, link = link, base
    unit = "rad/s" if joint.type == "R" else f"{made.length_unit}/s"
    if given:
        made.notes.append(f"the speed, {rate:g}, is read in {unit}: the file has no unit of it")
    else:
        made.notes.append(f"the file has no speed: the joint {joint.label} has {rate:g} {unit}")
    if joint.type == "R":
        made.rotate(base, link, rate)
    else:
        made.push(joint.label, base, link, joint.at, joint.angle, rate)


LINKAGE_FORM = "pylinkage"
JOINTS = ("ground", "revolute", "prismatic", "tracker")
DRIVERS = ("driver", "arc_driver")
LINKS = ("ground", "link", *DRIVERS)
#: Keys that are read, and of what follows from the position.
LINKAGE_JOINT_KEYS = (
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
    made = DrawnLinkage(str(data.get("name") or name), LINKAGE_FORM, units)
    grounded = _grounded(data)
    joints: dict[str, _JsonJoint] = {}
    for one in data["joints"]:
        joint = _linkage_joint(_dict(one), grounded)
        if joint.id in joints:
            raise refusal(joint.name, "there are two of this id")
        joints[joint.id] = joint
        made.note_keys(joint.name, _dict(one), LINKAGE_JOINT_KEYS)
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


def _grounded(data: Mapping[str, Any]) -> set[str]:
    """Ids of joints that are on the ground whatever their type says."""
    found: set[str] = set()
    for link in map(_dict, data.get("links") or ()):
        if link.get("type") == "ground":
            found |= {str(one) for one in link.get("joints") or ()}
        elif link.get("motor_joint"):
            found.add(str(link["motor_joint"]))
    return found


def _linkage_joint(one: Mapping[str, Any], grounded: set[str]) -> _JsonJoint:
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
