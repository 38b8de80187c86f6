"""PMKS (Planar Mechanism Kinematic Simulator): its lines of text, its address, its JSON.

A line is a joint: the links, the type, x and y at the drawn position, the angle of a slide, and
four signs, the last of which marks the driven joint: ``ground,input,R,0,0,0,tfft``. R is a pin, P a
slide, RP a pin of all further links in a slot of the first, G the place where two wheels touch. A
joint of one link is a point of it. Source: ConvertTextToData and the class Joint of
github.com/DesignEngrLab/PMKS, and its PMKSFileFormat.md.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote_plus

from mbody.errors import ModelError
from mbody.exchange.imported import (
    GROUND,
    DrawnLinkage,
    Imported,
    Place,
    letters,
    number_of,
    refusal,
    seen,
)

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
