"""MJCF and URDF: the bodies of a spatial model that moves in one plane.

MuJoCo itself compiles the file (defaults, classes, inertias of shapes, frames), so that what counts
here is what MuJoCo simulates. All bodies have the axes of the plane at the model's reference
position, where all joints are at 0.
"""

from __future__ import annotations

import importlib
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element as Node

import numpy as np

from mbody.core.tolerances import FILE_GRAVITY_IN_PLANE, FILE_PLACES_SAME
from mbody.errors import ModelError, SolveError
from mbody.exchange import planar_forces
from mbody.exchange.imported import Imported, origin, plain_name, refusal, seen
from mbody.exchange.planar_forces import Plane, Spatial, check_axes, check_fields, plane_of
from mbody.files.model import in_units
from mbody.model.body import Body
from mbody.model.contact import Contact
from mbody.model.coupling import AngleCoupling, CouplingTerm, LengthCoupling
from mbody.model.element import Element, Marker
from mbody.model.joints import Distance, Fixed, PinSlot, Prismatic, Revolute
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism
from mbody.model.touching_shapes import Disc, Line, Polygon

# -- Contacts between the shapes of a spatial model, in its plane ------------------------------
#
# A plane across it is a line, a sphere or a cylinder across it a disc, a box a polygon, a capsule
# in it the discs of its ends. What else may touch is named, and refused where it touches at the
# reference position.

PLANE, SPHERE, CAPSULE, CYLINDER, BOX = 0, 2, 3, 5, 6
WELD = 1
#: Pairs that a note names.
NAMED = 8


@dataclass(frozen=True)
class GeomOutline:
    """A shape in the plane: "line", "disc", "polygon", or "ends", the discs of a capsule.

    `points`: In space. `radius`: Of discs. `direction`: Of a line, in the plane.
    `along`: Where it lies along the normal, from and to; of a sphere both are its centre.
    """

    kind: str
    points: tuple[np.ndarray, ...]
    radius: float = 0.0
    direction: float = 0.0
    along: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class GeomPair:
    """Two shapes that may touch, by their numbers in the file."""

    first: int
    second: int
    friction: float
    margin: float
    rolling: float
    adhesion: float


def outline_of(space: Spatial, geom: int) -> GeomOutline | None:
    """A shape in the plane, None of one that has no outline for contacts."""
    model, data, plane = space.model, space.data, space.plane
    at, kind = data.geom_xpos[geom].copy(), int(model.geom_type[geom])
    axes, size = data.geom_xmat[geom].reshape(3, 3).T, model.geom_size[geom]
    z = float(at @ plane.normal)
    across, lies = plane.is_across(axes[2]), plane.lies_in(axes[2])
    if kind == PLANE and lies:
        x, y = plane.flat(axes[2])
        return GeomOutline("line", (at,), direction=math.atan2(-x, y))
    if kind == SPHERE:
        return GeomOutline("disc", (at,), float(size[0]), along=(z, z))
    if kind in (CYLINDER, CAPSULE) and across:
        return GeomOutline(
            "disc", (at,), float(size[0]), along=(z - float(size[1]), z + float(size[1]))
        )
    if kind == CAPSULE and lies:
        ends = tuple(at + sign * size[1] * axes[2] for sign in (-1.0, 1.0))
        return GeomOutline("ends", ends, float(size[0]), along=(z, z))
    if (
        kind == BOX
        and (n := next((n for n in range(3) if plane.is_across(axes[n])), None)) is not None
    ):
        u, v = (n + 1) % 3, (n + 2) % 3
        sides = ((1, 1), (-1, 1), (-1, -1), (1, -1))
        corners = tuple(at + a * size[u] * axes[u] + b * size[v] * axes[v] for a, b in sides)
        if plane.sign(axes[n]) < 0.0:
            corners = corners[::-1]
        return GeomOutline("polygon", corners, along=(z - float(size[n]), z + float(size[n])))
    return None


def contacts(space: Spatial) -> list[Element]:
    """The contacts of all pairs of shapes that may touch and have outlines."""
    if space.is_off("CONTACT"):
        return []
    found: list[Element] = []
    left: list[GeomPair] = []
    outlines = [outline_of(space, geom) for geom in range(space.model.ngeom)]
    for pair in _pairs(space):
        i, j = outlines[pair.first], outlines[pair.second]
        fits = _fit(pair, i, j)
        if fits is None:
            left.append(pair)
        elif fits:
            _check(space, pair)
            found += _contacts_of(space, pair, i, j)
    _examine_reference(space, left)
    if found:
        given = space.model.geom_solref[:, 0] < 0.0, space.model.geom_solref[:, 1] < 1.0
        if np.any(given[0] | given[1]):
            space.notes.append(
                "contacts are rigid and do not rebound here; those of the file give way, and may "
                "rebound (solref)"
            )
    return found


def _fit(pair: GeomPair, i: GeomOutline | None, j: GeomOutline | None) -> bool | None:
    """Whether two outlines can touch in the plane; None where that is no contact of outlines."""
    if i is None or j is None:
        return None
    kinds = {i.kind, j.kind}
    if kinds == {"line"}:
        return False
    if "line" in kinds:
        return True
    if "ends" in kinds or (kinds == {"polygon"} and pair.margin):
        return None
    gap = max(i.along[0] - j.along[1], j.along[0] - i.along[1])
    size = max(i.radius, j.radius, pair.margin)
    points = i.along[0] == i.along[1] and j.along[0] == j.along[1]
    if gap <= (FILE_PLACES_SAME * size if points else 0.0):
        return True
    reach = sum(one.radius for one in (i, j) if one.along[0] == one.along[1])
    return False if gap >= reach + pair.margin else None


def _check(space: Spatial, pair: GeomPair) -> None:
    """Refuse what a contact here has not."""
    names = " and ".join(seen(space.name("GEOM", one)) for one in (pair.first, pair.second))
    moving = [space.model.geom_surfacevel[one] for one in (pair.first, pair.second)]
    for value, why in (
        (np.any(moving), "a surface that moves"),
        (pair.adhesion, "adhesion"),
        (pair.rolling and pair.friction, "friction of rolling"),
    ):
        if value:
            raise refusal(f"the contact of the shapes {names}", f"it has {why}, which is not read")


def _pairs(space: Spatial) -> Iterator[GeomPair]:
    """All pairs of shapes between which MuJoCo looks for contacts, by its own rules."""
    model, root = space.model, np.asarray(space.model.body_weldid)
    body = np.asarray(model.geom_bodyid)
    given = set()
    for n in range(model.npair):
        one, other = int(model.pair_geom1[n]), int(model.pair_geom2[n])
        given.add((min(one, other), max(one, other)))
        friction = model.pair_friction[n]
        if root[body[one]] == root[body[other]]:
            continue
        rows = int(model.pair_dim[n])
        yield GeomPair(
            one,
            other,
            0.0 if rows == 1 else float(max(friction[:2])),
            float(model.pair_margin[n]),
            float(max(friction[3:])) if rows == 6 else 0.0,
            float(model.pair_adhesion[n]),
        )
    excluded = {int(n) for n in model.exclude_signature}
    above = root[np.asarray(model.body_parentid)[root]]
    types = np.asarray(model.geom_contype), np.asarray(model.geom_conaffinity)
    filtered = not space.is_off("FILTERPARENT")
    welded = set() if space.is_off("EQUALITY") else _welded(space)
    for one in range(model.ngeom):
        a = int(root[body[one]])
        for other in range(one + 1, model.ngeom):
            b = int(root[body[other]])
            if a == b or (one, other) in given:
                continue
            if not (types[0][one] & types[1][other] or types[0][other] & types[1][one]):
                continue
            if filtered and a and b and (above[a] == b or above[b] == a):
                continue
            if (min(a, b), max(a, b)) in welded:
                continue
            bodies = sorted((int(body[one]), int(body[other])))
            if (bodies[0] << 16) + bodies[1] in excluded:
                continue
            yield _of_geoms(space, one, other)


def _welded(space: Spatial) -> set[tuple[int, int]]:
    """Bodies that a constraint of the file keeps together, which do not move against each other."""
    model, found = space.model, set()
    for n in np.flatnonzero((model.eq_type == WELD) & (model.eq_active0 != 0)):
        first, second = int(model.eq_obj1id[n]), int(model.eq_obj2id[n])
        if model.eq_objtype[n] == int(space.mujoco.mjtObj.mjOBJ_SITE):
            first, second = (int(model.site_bodyid[site]) for site in (first, second))
        a, b = space.root(first), space.root(second)
        found.add((min(a, b), max(a, b)))
    return found


def _of_geoms(space: Spatial, one: int, other: int) -> GeomPair:
    """A pair with what MuJoCo makes of the numbers of its two shapes."""
    model, ranks = space.model, space.model.geom_priority
    used = (
        [one, other] if ranks[one] == ranks[other] else [max((one, other), key=ranks.__getitem__)]
    )
    friction = np.max(model.geom_friction[used], axis=0)
    margin = float(model.geom_margin[[one, other]].sum())
    if model.opt.enableflags & int(space.mujoco.mjtEnableBit.mjENBL_OVERRIDE):
        friction, margin = model.opt.o_friction[[0, 2, 3]], float(model.opt.o_margin)
    rows = int(max(model.geom_condim[used]))
    return GeomPair(
        one,
        other,
        0.0 if rows == 1 else float(friction[0]),
        margin,
        float(friction[2]) if rows == 6 else 0.0,
        float(model.geom_adhesion[used].sum()),
    )


def _contacts_of(
    space: Spatial, pair: GeomPair, i: GeomOutline | None, j: GeomOutline | None
) -> Iterator[Element]:
    """The contacts of a pair: one, of the ends of a capsule two."""
    assert i is not None and j is not None
    sides = [(pair.first, i), (pair.second, j)]
    if i.kind != "line" and (j.kind == "line" or i.kind == "polygon"):
        sides.reverse()  # a line first, and a disc before a polygon: it is grown by the margin
    (first, one), (second, other) = sides
    base = _shape(space, first, one, 0, pair.margin)
    label = f"{space.label('GEOM', first)}_{space.label('GEOM', second)}"
    for n in range(2 if other.kind == "ends" else 1):
        shape = _shape(space, second, other, n, 0.0)
        yield Contact(space.unique(label), base, shape, friction=pair.friction)


def _shape(space: Spatial, geom: int, outline: GeomOutline, n: int, margin: float) -> str:
    """The dotted name of a shape, grown by a margin; made where it is not there."""
    body = int(space.model.geom_bodyid[geom])
    root, label = space.root(body), space.label("GEOM", geom)
    radius, points, kind = outline.radius + margin, outline.points, outline.kind
    made: Any
    if kind == "line":
        heading = outline.direction
        normal = -math.sin(heading) * space.plane.x + math.cos(heading) * space.plane.y
        name = space.place(body, f"{label}_point", points[0] + margin * normal)
        made = Line(name.rpartition(".")[2], heading)
    elif kind == "polygon":
        names = [space.place(body, f"{label}_corner", at) for at in points]
        made = Polygon(tuple(name.rpartition(".")[2] for name in names))
    else:
        name = space.place(body, f"{label}_centre", points[n])
        made = Disc(name.rpartition(".")[2], radius)
    shapes, taken = space.shapes[root], space.points[root]
    for key, there in shapes.items():
        if there == made:
            return f"{space.names[root]}.{key}"
    key, count = label, 2
    while key in shapes or key in taken:
        key, count = f"{label}_{count}", count + 1
    shapes[key] = made
    return f"{space.names[root]}.{key}"


def _examine_reference(space: Spatial, left: list[GeomPair]) -> None:
    """Name the pairs that are not taken, and those that overlap at the reference position; refuse
    those that are not taken and touch there.
    """
    deepest: dict[str, float] = {}
    data, without = space.data, {(pair.first, pair.second): pair for pair in left}
    for n in range(data.ncon):
        contact = data.contact[n]
        one, other = sorted(int(geom) for geom in contact.geom)
        if contact.dist < -FILE_PLACES_SAME * float(space.model.stat.extent):
            names = f"{space.name('GEOM', one)} and {space.name('GEOM', other)}"
            deepest[names] = max(deepest.get(names, 0.0), -float(contact.dist))
        if contact.efc_address >= 0 and ((one, other) in without or (other, one) in without):
            names = " and ".join(seen(space.name("GEOM", geom)) for geom in (one, other))
            raise refusal(
                f"the shapes {names}",
                "they touch at the reference position, and the contact of such shapes is not read: "
                "planes across the plane of the motion with anything round or rectangular are, "
                "spheres, and cylinders and boxes along its normal",
            )
    space.notes += [
        f"the shapes {names} overlap by {depth:.4g} m at the reference position: begin elsewhere"
        for names, depth in deepest.items()
    ]
    if left:
        named = [
            "–".join(space.name("GEOM", geom) for geom in (pair.first, pair.second))
            for pair in left[:NAMED]
        ]
        more = f" and {len(left) - NAMED} more" if len(left) > NAMED else ""
        space.notes.append(
            f"contacts of these shapes are not taken, they pass through each other: "
            f"{', '.join(named)}{more}"
        )


# -- Joints and constraints of a spatial model in its plane ------------------------------------

CONNECT, BODY_WELD, JOINT, TENDON = 0, 1, 2, 3


def joints_of(space: Spatial, motors: dict[tuple[str, int], list[int]]) -> list[Element]:
    """The joints between bodies and their parents, with all that acts along their coordinates."""
    found: list[Element] = []
    for body in space.moving():
        start = int(space.model.body_jntadr[body])
        joints = list(range(start, start + int(space.model.body_jntnum[body])))
        made, own = _joint(space, body, joints)
        found += made
        for n in joints:
            for one in planar_forces.of_joint(space, n):
                found += planar_forces.elements_along(
                    space, one, n == own, motors.get(("JOINT", n), [])
                )
    return found


def _joint(space: Spatial, body: int, joints: list[int]) -> tuple[list[Element], int]:
    """The joint of a body, that of its one or two freedoms, none where it is free in the plane; and
    the joint of the file whose limits and damping it has.
    """
    model = space.model
    kinds = tuple(int(model.jnt_type[n]) for n in joints)
    parent, first = int(model.body_parentid[body]), joints[0]
    label, at = space.label("JOINT", first), space.data.xanchor[joints[-1]]
    if kinds == (planar_forces.HINGE,):
        ends = space.place(parent, label, at), space.place(body, label, at)
        return [Revolute(space.element("JOINT", first), *ends, **_range(space, first, 1.0))], first
    if kinds == (planar_forces.SLIDE,):
        i, j = (planar_forces.slide_marker(space, one, label, at, first) for one in (parent, body))
        return [Prismatic(space.element("JOINT", first), i, j, **_range(space, first, 1.0))], first
    if kinds in (
        (planar_forces.SLIDE, planar_forces.HINGE),
        (planar_forces.HINGE, planar_forces.SLIDE),
    ):
        slide = first if kinds[0] == planar_forces.SLIDE else joints[1]
        slot, pin, sign = planar_forces.slide_ends(space, slide)
        pin = f"{pin.body}.{pin.point}" if isinstance(pin, Marker) else pin
        made = PinSlot(space.element("JOINT", slide), slot, pin, **_range(space, slide, sign))
        return [made], slide
    if sorted(kinds) in (
        [planar_forces.FREE],
        [planar_forces.SLIDE, planar_forces.SLIDE, planar_forces.HINGE],
    ):
        return [], -1
    if kinds == (planar_forces.SLIDE, planar_forces.SLIDE):
        term = CouplingTerm(1.0, angle=space.names[body], relative_to=space.parent(body))
        return [AngleCoupling(space.element("JOINT", first), [term])], -1
    raise refusal(
        f"the body {seen(space.name('BODY', body))}",
        "its joints are no combination that is read: a hinge, a slide, both, or two slides and a "
        "hinge; put a body between them",
    )


def _range(space: Spatial, joint: int, sign: float) -> dict[str, Any]:
    """The limits and the damping of a joint, as attributes; `sign`: Of a slide."""
    if space.model.jnt_type[joint] == planar_forces.HINGE:
        sign *= space.plane.sign(space.data.xaxis[joint])
    found: dict[str, Any] = {}
    if limits := planar_forces.limits_of(space, joint):
        low, high = limits
        found["limits"] = (low, high) if sign > 0.0 else (-high, -low)
    if damping := planar_forces.damping_of(space, joint):
        found["viscous"] = damping
    return found


def couplings(space: Spatial) -> list[Element]:
    """The constraints of <equality>."""
    model, found = space.model, []
    for n in range(model.neq):
        kind, name = int(model.eq_type[n]), space.name("EQUALITY", n)
        if not model.eq_active0[n] or space.is_off("EQUALITY"):
            space.notes.append(f"not taken: the constraint {name}, which is not active")
        elif kind == CONNECT:
            found.append(_connect(space, n))
        elif kind == BODY_WELD:
            found.append(_weld(space, n))
        elif kind == JOINT:
            found.append(_coupled(space, n, name))
        elif kind == TENDON:
            found.append(_kept_tendon(space, n, name))
        else:
            raise refusal(
                f"the constraint {seen(name)}",
                "of <equality>, connect, weld, joint and tendon are read",
            )
    return found


def _ends(space: Spatial, n: int, first: slice, second: slice) -> tuple[Any, ...]:
    """The two bodies of a constraint, and its place on each, in space."""
    model, data = space.model, space.data
    objects = int(model.eq_obj1id[n]), int(model.eq_obj2id[n])
    if model.eq_objtype[n] == space.mujoco.mjtObj.mjOBJ_SITE:
        bodies = tuple(int(model.site_bodyid[one]) for one in objects)
        return bodies, tuple(data.site_xpos[one].copy() for one in objects)
    places = []
    for body, part in zip(objects, (first, second), strict=True):
        rotation = data.xmat[body].reshape(3, 3)
        places.append(data.xpos[body] + rotation @ model.eq_data[n][part])
    return objects, tuple(places)


def _connect(space: Spatial, n: int) -> Element:
    bodies, places = _ends(space, n, slice(0, 3), slice(3, 6))
    label = space.label("EQUALITY", n)
    ends = (space.place(b, label, at) for b, at in zip(bodies, places, strict=True))
    return Revolute(space.element("EQUALITY", n), *ends)


def _weld(space: Spatial, n: int) -> Element:
    model, data = space.model, space.data
    bodies, places = _ends(space, n, slice(3, 6), slice(0, 3))
    angle, label = 0.0, space.label("EQUALITY", n)
    if model.eq_objtype[n] == space.mujoco.mjtObj.mjOBJ_BODY:
        relative = np.zeros(9)
        space.mujoco.mju_quat2Mat(relative, model.eq_data[n][6:10])
        first, second = (data.xmat[body].reshape(3, 3) for body in bodies)
    else:
        relative = np.eye(3).ravel()
        sites = (int(model.eq_obj1id[n]), int(model.eq_obj2id[n]))
        first, second = (data.site_xmat[site].reshape(3, 3) for site in sites)
    angle = space.plane.rotation_angle(first @ relative.reshape(3, 3) @ second.T)
    i, j = (space.place(b, label, at) for b, at in zip(bodies, places, strict=True))
    carrier, _, point = i.rpartition(".")
    return Fixed(space.element("EQUALITY", n), Marker(carrier, point, angle), j)


def _coupled(space: Spatial, n: int, name: str) -> Element:
    """q₁ = c₀ + c₁ q₂ of two joints, from their reference position."""
    model = space.model
    first, second = int(model.eq_obj1id[n]), int(model.eq_obj2id[n])
    terms = [float(value) for value in model.eq_data[n][:5]]
    if any(terms[2:]) and second >= 0:
        raise refusal(f"the constraint {seen(name)}", "its polycoef is no straight line")
    joints = [(first, 1.0)] + ([(second, -terms[1])] if second >= 0 and terms[1] else [])
    parts = [planar_forces.joint_term(space, joint, factor) for joint, factor in joints]
    lengths = any(part.ends for part in parts)
    if lengths and model.jnt_type[first] == planar_forces.HINGE and second >= 0:
        # the first coordinate is an angle: its factor 1 rad is a length among lengths
        space.notes.append(f"the constraint {name} joins an angle and a length, in metres a radian")
    kind = LengthCoupling if lengths else AngleCoupling
    return kind(space.element("EQUALITY", n), parts, value=terms[0])


def _kept_tendon(space: Spatial, n: int, name: str) -> Element:
    """The length of a tendon keeps its value: a rod, or a coupling of joints."""
    model = space.model
    what = f"the constraint {seen(name)}"
    tendon, change = int(model.eq_obj1id[n]), float(model.eq_data[n][0])
    if int(model.eq_obj2id[n]) >= 0:
        raise refusal(what, "the lengths of two tendons are not coupled here")
    if parts := planar_forces.tendon_terms(space, tendon, what):
        kind = LengthCoupling if any(part.ends for part in parts) else AngleCoupling
        return kind(space.element("EQUALITY", n), parts, value=change)
    ends = planar_forces.tendon_places(space, tendon, what)
    length = float(model.tendon_length0[tendon]) + change
    return Distance(space.element("EQUALITY", n), *ends, length=length)


def planar_bodies(path: Path, root: Node, units: str) -> Imported:
    """The mechanism of a file of MuJoCo, or of a URDF."""
    try:
        mujoco: Any = importlib.import_module("mujoco")
    except ImportError:
        raise SolveError(
            "files of MJCF and URDF are read by the package mujoco, which is not installed: "
            "pip install mujoco"
        ) from None
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        why = re.sub(r"\s+", " ", str(error)).strip()
        raise ModelError(f"MuJoCo does not read it: {why[:300]}") from None
    form = "MJCF" if root.tag == "mujoco" else "URDF"
    title = root.get("model") or root.get("name") or path.stem
    space = _Planar(mujoco, model, form)
    made = space.imported(title)
    if form == "URDF":
        made = Imported(made.mechanism, form, (*made.notes, *_of_urdf(root, space)))
    if units == "SI":
        return made
    return Imported(in_units(made.mechanism, units), form, made.notes)


#: Parts of a joint of a URDF that MuJoCo reads, or that do not move it.
JOINT_PARTS = ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic")


def _of_urdf(root: Node, space: _Planar) -> list[str]:
    """Notes on elements of a URDF that MuJoCo does not keep: links fused with others, and what is
    for controllers.
    """
    kept = {space.name("BODY", n) for n in range(1, space.model.nbody)}
    gone = [n.get("name") or "?" for n in root.iterfind("link") if n.get("name") not in kept]
    notes = [f"links that are part of others or of the ground: {', '.join(gone)}"] if gone else []
    parts: dict[str, list[str]] = {}
    for joint in root.iterfind("joint"):
        for part in joint:
            if part.tag not in JOINT_PARTS and isinstance(part.tag, str):
                parts.setdefault(f"<{part.tag}>", []).append(joint.get("name") or "?")
            for key in ("effort", "velocity") if part.tag == "limit" else ():
                if part.get(key):
                    parts.setdefault(f"the limit of {key}", []).append(joint.get("name") or "?")
    notes += [f"{what} is not taken of the joints {', '.join(own)}" for what, own in parts.items()]
    for node in root:
        if node.tag not in ("link", "joint", "material", "mujoco") and isinstance(node.tag, str):
            notes.append(f"<{node.tag}> {seen(node.get('name') or '')} is not taken")
    if np.any(space.gravity) and not any(one.get("gravity") for one in root.iter("option")):
        given = ", ".join(f"{part:g}" for part in space.gravity)
        notes.append(f"the file has no gravity: that of MuJoCo is taken, ({given}) m/s²")
    return notes


#: Words for kinds of objects, and names that points of bodies may not have.
KINDS = {"EQUALITY": "constraint", "GEOM": "shape"}
OF_BODIES = ("cg", "mass", "weight", "inertia", "spread", "section")


class _Planar:
    """Planar bodies and joints of a compiled MuJoCo model."""

    def __init__(self, mujoco: Any, model: Any, form: str) -> None:
        self.mujoco, self.model, self.form = mujoco, model, form
        self.is_urdf = form == "URDF"
        self.data = mujoco.MjData(model)
        mujoco.mj_resetData(model, self.data)
        mujoco.mj_forward(model, self.data)
        self.notes = check_fields(mujoco, model, self.name)
        self.gravity = np.zeros(3) if self.is_off("GRAVITY") else np.array(model.opt.gravity)
        self.plane = self._plane()
        self._used = {"ground"}
        self._elements: dict[tuple[str, int], str] = {}
        self.names = {0: "ground"} | {n: self.element("BODY", n) for n in range(1, model.nbody)}
        self.points: dict[int, dict[str, tuple[float, float]]] = {
            body: {} for body in range(model.nbody)
        }
        self.shapes: dict[int, dict[str, Any]] = {body: {} for body in range(model.nbody)}

    def imported(self, title: str) -> Imported:
        model, plane = self.model, self.plane
        motors = planar_forces.motors_of(self)
        elements = joints_of(self, motors) + planar_forces.tendons(self, motors) + couplings(self)
        elements += (
            planar_forces.gravity_compensation(self) + planar_forces.drag(self) + contacts(self)
        )
        for site in range(model.nsite):
            name = self.label("SITE", site)
            self.place(int(model.site_bodyid[site]), name, self.data.site_xpos[site])
        made = Mechanism(
            title or "mechanism",
            ground=self.points[0],
            ground_shapes=self.shapes[0],
            note=origin(self.form, "its reference position"),
        )
        for body in self.moving():
            made.add(self._body(body))
        made.add(*elements)
        if any(g := plane.flat(self.gravity)):
            made.add(Gravity(self.unique("gravity"), x=g[0], y=g[1]))
        self._note_what_is_left_out()
        return Imported(made, self.form, tuple(self.notes))

    def name(self, kind: str, index: int) -> str:
        """The name of an object in its file, a number where it has none."""
        which = getattr(self.mujoco.mjtObj, f"mjOBJ_{kind}")
        return self.mujoco.mj_id2name(self.model, which, index) or f"{kind.lower()}{index}"

    def label(self, kind: str, index: int) -> str:
        """The same as a name of a point or a part of one."""
        return plain_name(self.name(kind, index)) or f"{kind.lower()}{index}"

    def unique(self, wanted: str) -> str:
        """A name that no element has yet."""
        name, n = wanted, 2
        while name in self._used:
            name, n = f"{wanted}_{n}", n + 1
        self._used.add(name)
        return name

    def element(self, kind: str, index: int) -> str:
        """The name of the element that an object is, of no other; a note where it is changed."""
        if (kind, index) not in self._elements:
            wanted, given = self.label(kind, index), self.name(kind, index)
            word = KINDS.get(kind, kind.lower())
            if wanted in self._used:
                wanted = f"{wanted}_{word}"
            name = self.unique(wanted)
            if name != given:
                what = "link" if self.is_urdf and kind == "BODY" else word
                self.notes.append(f"the {what} {seen(given)} is named {name}")
            self._elements[kind, index] = name
        return self._elements[kind, index]

    def is_off(self, feature: str) -> bool:
        """Whether a flag of the file switches a feature off."""
        bits = self.mujoco.mjtDisableBit
        off = int(getattr(bits, f"mjDSBL_{feature}"))
        if feature in ("EQUALITY", "FRICTIONLOSS", "LIMIT", "CONTACT"):
            off |= int(bits.mjDSBL_CONSTRAINT)
        return bool(self.model.opt.disableflags & off)

    def target_of(self, actuator: int) -> tuple[str, int]:
        """The joint or tendon of an actuator, another kind of object where it has none."""
        kinds = self.mujoco.mjtTrn
        kind = int(self.model.actuator_trntype[actuator])
        words = {kinds.mjTRN_JOINT: "JOINT", kinds.mjTRN_JOINTINPARENT: "JOINT"}
        words[kinds.mjTRN_TENDON] = "TENDON"
        named = {int(key): word for key, word in words.items()}
        return named.get(kind, ""), int(self.model.actuator_trnid[actuator][0])

    def on_joint(self, joint: int) -> list[int]:
        """The actuators of a joint."""
        return [a for a in range(self.model.nactuator) if self.target_of(a) == ("JOINT", joint)]

    def on_tendon(self, tendon: int) -> list[int]:
        """The actuators of a tendon."""
        return [a for a in range(self.model.nactuator) if self.target_of(a) == ("TENDON", tendon)]

    def constrained_tendons(self) -> list[int]:
        """The tendons whose length is kept."""
        kept = self.model.eq_type == TENDON
        return [int(n) for n in self.model.eq_obj1id[kept]]

    def root(self, body: int) -> int:
        """The body that carries a body: itself, or what it is fixed to."""
        return int(self.model.body_weldid[body])

    def parent(self, body: int) -> str:
        """The name of what the joints of a body are on."""
        return self.names[self.root(int(self.model.body_parentid[body]))]

    def moving(self) -> list[int]:
        """The bodies that move against their carriers."""
        return [body for body in range(1, self.model.nbody) if self.root(body) == body]

    def offset(self, body: int, at: np.ndarray) -> tuple[float, float]:
        """A point of space in the plane axes of a body."""
        body = self.root(body)
        origin = self.data.xpos[body] if body else np.zeros(3)
        return self.plane.flat(at - origin)

    def place(self, body: int, label: str, at: np.ndarray) -> str:
        """A named point of a body; the dotted name that it has."""
        body = self.root(body)
        flat, points = self.offset(body, at), self.points[body]
        label = f"{label}_" if label in OF_BODIES else label
        name, n = label, 2
        while points.get(name, flat) != flat or name in self.shapes[body]:
            name, n = f"{label}_{n}", n + 1
        points[name] = flat
        return f"{self.names[body]}.{name}"

    def _plane(self) -> Plane:
        model = self.model
        kinds, axes = model.jnt_type, self.data.xaxis
        hinges = [axes[n] for n in range(model.njnt) if kinds[n] == planar_forces.HINGE]
        slides = [axes[n] for n in range(model.njnt) if kinds[n] == planar_forces.SLIDE]
        if not hinges and not slides:
            raise ModelError(
                "it has no hinge and no slide, so nothing says in which plane it moves"
            )
        plane = plane_of(hinges, slides, model.opt.gravity)
        for n in range(model.njnt):
            name = f"the joint {seen(self.name('JOINT', n))}"
            if kinds[n] in (planar_forces.HINGE, planar_forces.SLIDE):
                check_axes(plane, name, axes[n], hinge=kinds[n] == planar_forces.HINGE)
            elif kinds[n] != planar_forces.FREE:
                raise refusal(name, "a ball joint leaves the plane")
        return plane

    def _body(self, body: int) -> Body:
        """A body with all that is fixed to it."""
        model, data, normal = self.model, self.data, self.plane.normal
        parts = [n for n in range(1, model.nbody) if self.root(n) == body]
        masses = model.body_mass[parts]
        mass = float(masses.sum())
        centre = masses @ data.xipos[parts] / mass if mass else data.xpos[body]
        inertia = 0.0
        for part in parts:
            along = data.ximat[part].reshape(3, 3).T @ normal
            off = np.hypot(*self.plane.flat(data.xipos[part] - centre))
            inertia += float(along**2 @ model.body_inertia[part] + model.body_mass[part] * off**2)
        if len(parts) > 1:
            inner = ", ".join(self.names[part] for part in parts[1:])
            self.notes.append(f"bodies that are part of {self.names[body]}: {inner}")
        return Body(
            self.names[body],
            mass=mass,
            inertia=inertia,
            cg=self.offset(body, centre),
            points=self.points[body],
            shapes=self.shapes[body],
            guess=(*self.plane.flat(data.xpos[body]), 0.0),
        )

    def _note_what_is_left_out(self) -> None:
        """All that the file has and the model has not."""
        model, notes = self.model, self.notes
        for n in np.flatnonzero(model.jnt_type == planar_forces.FREE):
            notes.append(
                f"the joint {self.name('JOINT', int(n))}, free in space, stays in the plane"
            )
        for kind, count, why in (
            ("SENSOR", model.nsensor, "measures take its place"),
            ("KEY", model.nkey, "start in [simulate] takes its place"),
        ):
            if count:
                names = ", ".join(self.name(kind, n) for n in range(count))
                notes.append(f"not taken: {kind.lower()} {names} ({why})")
        for bit in ("LIMIT", "FRICTIONLOSS", "SPRING", "DAMPER", "GRAVITY", "CONTACT"):
            if self.is_off(bit):
                notes.append(f"a flag of the file switches {bit.lower()} off: there is none")
        out = float(self.gravity @ self.plane.normal)
        if abs(out) > FILE_GRAVITY_IN_PLANE * float(np.linalg.norm(self.gravity)):
            notes.append(f"gravity across the plane, {out:.4g} m/s², does nothing")
