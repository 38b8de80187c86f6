"""MJCF and URDF: the bodies of a spatial model that moves in one plane.

MuJoCo itself compiles the file (defaults, classes, inertias of shapes, frames), so that what counts
here is what MuJoCo simulates. All bodies have the axes of the plane at the model's reference
position, where all joints are at 0.
"""

from __future__ import annotations

import importlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol
from xml.etree.ElementTree import Element as Node

import numpy as np

from mbody.core.tolerances import FILE_AXES_PARALLEL, FILE_GRAVITY_IN_PLANE
from mbody.errors import ModelError, SolveError
from mbody.exchange.imported import Imported, origin, refusal, seen
from mbody.files.model import in_units
from mbody.model.body import Body
from mbody.model.coupling import AngleCoupling, CouplingTerm, LengthCoupling
from mbody.model.element import Element, Marker
from mbody.model.joints import Fixed, PinSlot, Prismatic, Revolute
from mbody.model.loads import Gravity, TorsionDamper, TorsionSpring
from mbody.model.mechanism import Mechanism

# -- The plane in which a spatial model moves: all hinges across it, all slides in it ----------

Array = np.ndarray


@dataclass(frozen=True)
class Plane:
    """Two axes of unit length, and the normal that they turn about.

    The normal is chosen so that the x axis of the plane is that of the file, or else its y axis.
    """

    x: Array
    y: Array

    @property
    def normal(self) -> Array:
        """The direction about which angles are counter-clockwise."""
        return np.cross(self.x, self.y)

    def flat(self, vector: Array) -> tuple[float, float]:
        """The two components of a vector in the plane."""
        return float(vector @ self.x), float(vector @ self.y)

    def sign(self, axis: Array) -> float:
        """1 where a hinge turns counter-clockwise about its axis, −1 where clockwise."""
        return 1.0 if axis @ self.normal > 0.0 else -1.0

    def rotation_angle(self, matrix: Array) -> float:
        """The angle of a rotation about the normal."""
        x, y = self.flat(matrix @ self.x)
        return float(np.arctan2(y, x))

    def lies_in(self, axis: Array) -> bool:
        """Whether a direction lies in the plane."""
        return abs(float(axis @ self.normal)) <= FILE_AXES_PARALLEL

    def is_across(self, axis: Array) -> bool:
        """Whether a direction is the normal or its opposite."""
        return float(np.hypot(*self.flat(axis))) <= FILE_AXES_PARALLEL


def plane_of(hinges: list[Any], slides: list[Any], gravity: Array) -> Plane:
    """The plane of a model. `hinges`, `slides`, `gravity` (3,)."""
    if hinges:
        normal = hinges[0]
    else:
        others = [*slides[1:], gravity, np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])]
        normal = next(
            n for n in (np.cross(slides[0], v) for v in others) if n @ n > FILE_AXES_PARALLEL**2
        )
    normal = normal / np.linalg.norm(normal)
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = up - (up @ normal) * normal
    y /= np.linalg.norm(y)
    x = np.cross(y, normal)
    main = 0 if abs(x[0]) > FILE_AXES_PARALLEL else 1
    return Plane(x if x[main] > 0.0 else -x, y)


def check_axes(plane: Plane, name: str, axis: Array, *, hinge: bool) -> None:
    """Refuse a joint that leaves the plane."""
    fits = plane.is_across(axis) if hinge else plane.lies_in(axis)
    if not fits:
        given = ", ".join(f"{part:.4g}" for part in axis)
        across = ", ".join(f"{part:.4g}" for part in plane.normal)
        what = "is not parallel to" if hinge else "is not across"
        raise refusal(
            name,
            f"its axis ({given}) {what} the hinges' axis ({across}): only mechanisms that move in "
            "one plane are read",
        )


# -- Joints and constraints of a spatial model in its plane ------------------------------------

HINGE, SLIDE, FREE = 3, 2, 0
CONNECT, WELD, JOINT = 0, 1, 2


class Spatial(Protocol):
    """A compiled spatial model, its plane and names."""

    mujoco: Any
    model: Any
    data: Any
    plane: Plane
    names: dict[int, str]
    notes: list[str]

    def name(self, kind: str, index: int) -> str:
        """The name of an object."""

    def root(self, body: int) -> int:
        """The body that carries a body."""

    def moving(self) -> list[int]:
        """The bodies that move against their carriers."""

    def offset(self, body: int, at: np.ndarray) -> tuple[float, float]:
        """A point of space in the plane axes of a body."""

    def place(self, body: int, label: str, at: np.ndarray) -> str:
        """A named point of a body."""


def joints_of(space: Spatial) -> list[Element]:
    """The joints between bodies and their parents, with springs and dampers."""
    found: list[Element] = []
    for body in space.moving():
        start = int(space.model.body_jntadr[body])
        joints = list(range(start, start + int(space.model.body_jntnum[body])))
        found += _joint(space, body, joints)
        for n in joints:
            found += _torsion(space, body, n)
    return found


def _parent(space: Spatial, body: int) -> str:
    return space.names[space.root(int(space.model.body_parentid[body]))]


def _joint(space: Spatial, body: int, joints: list[int]) -> list[Element]:
    """The joint of a body: that of its one or two freedoms, none where it is free in the plane."""
    model = space.model
    kinds = tuple(int(model.jnt_type[n]) for n in joints)
    parent = int(model.body_parentid[body])
    label = space.name("JOINT", joints[0])
    at = space.data.xanchor[joints[-1]]
    if kinds == (HINGE,):
        ends = space.place(parent, label, at), space.place(body, label, at)
        more = _limits(space, joints[0], 1.0) | _viscous(space, joints[0])
        return [Revolute(label, *ends, **more)]
    if kinds in ((SLIDE,), (SLIDE, HINGE)):
        i = _marker(space, parent, label, at, joints[0])
        more = _limits(space, joints[0], 1.0) | _viscous(space, joints[0])
        if kinds == (SLIDE, HINGE):
            return [PinSlot(label, i, space.place(body, label, at), **more)]
        return [Prismatic(label, i, _marker(space, body, label, at, joints[0]), **more)]
    if kinds == (HINGE, SLIDE):
        at = space.data.xanchor[joints[0]]
        if _limited(space, joints[1]) or model.dof_damping[model.jnt_dofadr[joints[1]]]:
            space.notes.append(
                f"not taken: limits and damping of the joint {space.name('JOINT', joints[1])}"
            )
        slot = _marker(space, body, label, at, joints[1])
        return [PinSlot(label, slot, space.place(parent, label, at))]
    if sorted(kinds) in ([FREE], [SLIDE, SLIDE, HINGE]):
        _note_free(space, joints)
        return []
    if kinds == (SLIDE, SLIDE):
        _note_free(space, joints)
        name, base = space.names[body], _parent(space, body)
        return [AngleCoupling(label, [CouplingTerm(1.0, angle=name, relative_to=base)])]
    raise refusal(
        f"the body {seen(space.name('BODY', body))}",
        "its joints are no combination that is read: a hinge, a slide, both, or two slides and a "
        "hinge; put a body between them",
    )


def _note_free(space: Spatial, joints: list[int]) -> None:
    model = space.model
    for n in joints:
        dof = int(model.jnt_dofadr[n])
        if _limited(space, n) or model.dof_damping[dof] or model.jnt_stiffness[n]:
            what = f"limits, damping and stiffness of the joint {space.name('JOINT', n)}"
            if model.jnt_type[n] == HINGE and not _limited(space, n):
                continue  # they are torsion springs and dampers
            space.notes.append(f"not taken: {what}")


def _marker(space: Spatial, body: int, label: str, at: np.ndarray, joint: int) -> Marker:
    """A place with the direction of a slide."""
    x, y = space.plane.flat(space.data.xaxis[joint])
    dotted = space.place(body, label, at)
    carrier, _, point = dotted.rpartition(".")
    return Marker(carrier, point, float(np.arctan2(y, x)))


def _limited(space: Spatial, joint: int) -> bool:
    return bool(space.model.jnt_limited[joint])


def _reference(space: Spatial, joint: int) -> float:
    """The value of a joint's coordinate at the reference position."""
    return float(space.model.qpos0[space.model.jnt_qposadr[joint]])


def _limits(space: Spatial, joint: int, sign: float) -> dict[str, Any]:
    if not _limited(space, joint):
        return {}
    if space.model.jnt_type[joint] == HINGE:
        sign *= space.plane.sign(space.data.xaxis[joint])
    low, high = (float(v) - _reference(space, joint) for v in space.model.jnt_range[joint])
    return {"limits": (low, high) if sign > 0.0 else (-high, -low)}


def _viscous(space: Spatial, joint: int) -> dict[str, Any]:
    damping = float(space.model.dof_damping[space.model.jnt_dofadr[joint]])
    return {"viscous": damping} if damping else {}


def _torsion(space: Spatial, body: int, joint: int) -> list[Element]:
    """The spring of a hinge, and its damper where no pin has it; springs of slides are noted."""
    model, name = space.model, space.name("JOINT", joint)
    stiffness = float(np.ravel(model.jnt_stiffness[joint])[0])
    found: list[Element] = []
    if model.jnt_type[joint] != HINGE:
        if stiffness:
            space.notes.append(f"not taken: the spring of the joint {name}")
        return found
    ends = {"body": space.names[body], "by": _parent(space, body)}
    if stiffness:
        free_angle = float(model.qpos_spring[model.jnt_qposadr[joint]]) - _reference(space, joint)
        free_angle *= space.plane.sign(space.data.xaxis[joint])
        found.append(
            TorsionSpring(f"{name}_spring", **ends, stiffness=stiffness, free_angle=free_angle)
        )
    alone = model.body_jntnum[body] == 1
    if (damping := float(model.dof_damping[model.jnt_dofadr[joint]])) and not alone:
        found.append(TorsionDamper(f"{name}_damper", **ends, coefficient=damping))
    return found


def couplings(space: Spatial) -> list[Element]:
    """The constraints of <equality>."""
    model, found = space.model, []
    for n in range(model.neq):
        kind, name = int(model.eq_type[n]), space.name("EQUALITY", n)
        if not model.eq_active0[n]:
            space.notes.append(f"not taken: the constraint {name}, which is not active")
        elif kind == CONNECT:
            found.append(_connect(space, n, name))
        elif kind == WELD:
            found.append(_weld(space, n, name))
        elif kind == JOINT:
            found.append(_coupled(space, n, name))
        else:
            raise refusal(
                f"the constraint {seen(name)}", "of <equality>, connect, weld and joint are read"
            )
    return found


def _ends(space: Spatial, n: int, name: str, first: slice, second: slice) -> tuple[Any, ...]:
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


def _connect(space: Spatial, n: int, name: str) -> Element:
    bodies, places = _ends(space, n, name, slice(0, 3), slice(3, 6))
    ends = (space.place(b, name, at) for b, at in zip(bodies, places, strict=True))
    return Revolute(name, *ends)


def _weld(space: Spatial, n: int, name: str) -> Element:
    model, data = space.model, space.data
    bodies, places = _ends(space, n, name, slice(3, 6), slice(0, 3))
    angle = 0.0
    if model.eq_objtype[n] == space.mujoco.mjtObj.mjOBJ_BODY:
        relative = np.zeros(9)
        space.mujoco.mju_quat2Mat(relative, model.eq_data[n][6:10])
        first, second = (data.xmat[body].reshape(3, 3) for body in bodies)
        angle = space.plane.rotation_angle(first @ relative.reshape(3, 3) @ second.T)
    i, j = (space.place(b, name, at) for b, at in zip(bodies, places, strict=True))
    carrier, _, point = i.rpartition(".")
    return Fixed(name, Marker(carrier, point, angle), j)


def _coupled(space: Spatial, n: int, name: str) -> Element:
    """q₁ = c₀ + c₁ q₂ of two joints, from their reference position."""
    model = space.model
    first, second = int(model.eq_obj1id[n]), int(model.eq_obj2id[n])
    terms = [float(value) for value in model.eq_data[n][:5]]
    if any(terms[2:]):
        raise refusal(f"the constraint {seen(name)}", "its polycoef is no straight line")
    joints = [(first, 1.0)] + ([(second, -terms[1])] if second >= 0 else [])
    lengths = any(model.jnt_type[joint] == SLIDE for joint, _ in joints)
    parts = [_term(space, joint, factor) for joint, factor in joints]
    if lengths and model.jnt_type[first] == HINGE and second >= 0:
        # the first coordinate is an angle: its factor 1 rad is a length among lengths
        space.notes.append(f"the constraint {name} joins an angle and a length, in metres a radian")
    kind = LengthCoupling if lengths else AngleCoupling
    return kind(name, parts, value=terms[0])


def _term(space: Spatial, joint: int, factor: float) -> CouplingTerm:
    model = space.model
    body = int(model.jnt_bodyid[joint])
    parent = int(model.body_parentid[body])
    if model.jnt_type[joint] == HINGE:
        sign = space.plane.sign(space.data.xaxis[joint])
        base = space.names[space.root(parent)]
        return CouplingTerm(sign * factor, angle=space.names[body], relative_to=base)
    if model.jnt_type[joint] != SLIDE:
        raise refusal(f"the joint {seen(space.name('JOINT', joint))}", "it cannot be coupled")
    label, at = space.name("JOINT", joint), space.data.xanchor[joint]
    i = _marker(space, parent, label, at, joint)
    return CouplingTerm(factor, coordinate=(i, _marker(space, body, label, at, joint)))


HINGE_JOINT, SLIDE_JOINT, FREE_JOINT = 3, 2, 0


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
    made = _Planar(mujoco, model, form).imported(title)
    fused = _fused(root, made.mechanism) if form == "URDF" else ()
    made = Imported(made.mechanism, form, (*made.notes, *fused))
    if units == "SI":
        return made
    return Imported(in_units(made.mechanism, units), form, made.notes)


def _fused(root: Node, mechanism: Mechanism) -> tuple[str, ...]:
    """Notes on elements of a URDF that MuJoCo does not keep: links fused with others, and loads."""
    gone = [n.get("name") or "?" for n in root.iterfind("link") if n.get("name") not in mechanism]
    notes = [f"links that are part of others or of the ground: {', '.join(gone)}"] if gone else []
    for word in ("mimic", "dynamics", "safety_controller"):
        having = [j.get("name") or "?" for j in root.iterfind("joint") if j.find(word) is not None]
        if having and word != "dynamics":
            notes.append(f"<{word}> is not taken of the joints {', '.join(having)}")
    for node in root:
        if node.tag not in ("link", "joint", "material", "mujoco"):
            notes.append(f"<{node.tag}> {seen(node.get('name') or '')} is not taken")
    return tuple(notes)


class _Planar:
    """Planar bodies and joints of a compiled MuJoCo model."""

    def __init__(self, mujoco: Any, model: Any, form: str) -> None:
        self.mujoco, self.model, self.form = mujoco, model, form
        self.data = mujoco.MjData(model)
        mujoco.mj_resetData(model, self.data)
        mujoco.mj_kinematics(model, self.data)
        self.notes: list[str] = []
        self.plane = self._plane()
        self.names = self._body_names()
        self.points: dict[int, dict[str, tuple[float, float]]] = {
            body: {} for body in range(model.nbody)
        }

    def imported(self, title: str) -> Imported:
        model, plane = self.model, self.plane
        self._refuse()
        elements = joints_of(self) + couplings(self)
        for site in range(model.nsite):
            name = self.name("SITE", site)
            self.place(self.root(int(model.site_bodyid[site])), name, self.data.site_xpos[site])
        made = Mechanism(
            title or "mechanism",
            ground=self.points[0],
            note=origin(self.form, "its reference position"),
        )
        for body in self.moving():
            made.add(self._body(body))
        made.add(*elements)
        g = plane.flat(model.opt.gravity)
        if any(g) and not model.opt.disableflags & self.mujoco.mjtDisableBit.mjDSBL_GRAVITY:
            made.add(Gravity("gravity" if "gravity" not in made else "weight", x=g[0], y=g[1]))
        self._note_what_is_left_out()
        return Imported(made, self.form, tuple(self.notes))

    def name(self, kind: str, index: int) -> str:
        """The name of an object, without dots; a number where it has none."""
        which = getattr(self.mujoco.mjtObj, f"mjOBJ_{kind}")
        name = self.mujoco.mj_id2name(self.model, which, index)
        return re.sub(r"\W+", "_", name) if name else f"{kind.lower()}{index}"

    def root(self, body: int) -> int:
        """The body that carries a body: itself, or what it is fixed to."""
        return int(self.model.body_weldid[body])

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
        name, n = label, 2
        while name in points and points[name] != flat:
            name, n = f"{label}_{n}", n + 1
        points[name] = flat
        return f"{self.names[body]}.{name}"

    def _body_names(self) -> dict[int, str]:
        names, used = {0: "ground"}, {"ground", "gravity"}
        for body in range(1, self.model.nbody):
            wanted = self.name("BODY", body)
            while wanted in used:
                wanted += "_"
            used.add(wanted)
            names[body] = wanted
        return names

    def _plane(self) -> Plane:
        model = self.model
        kinds, axes = model.jnt_type, self.data.xaxis
        hinges = [axes[n] for n in range(model.njnt) if kinds[n] == HINGE_JOINT]
        slides = [axes[n] for n in range(model.njnt) if kinds[n] == SLIDE_JOINT]
        if not hinges and not slides:
            raise ModelError(
                "it has no hinge and no slide, so nothing says in which plane it moves"
            )
        plane = plane_of(hinges, slides, model.opt.gravity)
        for n in range(model.njnt):
            name = f"the joint {seen(self.name('JOINT', n))}"
            if kinds[n] in (HINGE_JOINT, SLIDE_JOINT):
                check_axes(plane, name, axes[n], hinge=kinds[n] == HINGE_JOINT)
            elif kinds[n] != FREE_JOINT:
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
            guess=(*self.plane.flat(data.xpos[body]), 0.0),
        )

    def _refuse(self) -> None:
        model = self.model
        for body in range(1, model.nbody):
            if model.body_mocapid[body] >= 0:
                raise refusal(f"the body {seen(self.name('BODY', body))}", "it is moved by mocap")
        for tendon in range(model.ntendon):
            if model.tendon_limited[tendon] or model.tendon_frictionloss[tendon]:
                raise refusal(
                    f"the tendon {seen(self.name('TENDON', tendon))}",
                    "tendons with limits or friction are not read: a Distance, Rope or coupling "
                    "takes its place",
                )

    def _note_what_is_left_out(self) -> None:
        """All that the file has and the model has not."""
        model, notes = self.model, self.notes
        for n in np.flatnonzero(model.jnt_type == FREE_JOINT):
            notes.append(
                f"the joint {self.name('JOINT', int(n))}, free in space, stays in the plane"
            )
        for kind, count, why in (
            ("ACTUATOR", model.nu, "a driver or a load takes its place"),
            ("TENDON", model.ntendon, "a spring or a damper takes its place"),
            ("SENSOR", model.nsensor, "measures take its place"),
            ("KEY", model.nkey, "start in [simulate] takes its place"),
            ("FLEX", model.nflex, "bodies are rigid"),
        ):
            if count:
                names = ", ".join(self.name(kind, n) for n in range(count))
                notes.append(f"not taken: {kind.lower()} {names} ({why})")
        for field, what in (("dof_armature", "armature"), ("dof_frictionloss", "frictionloss")):
            having = [n for n in range(model.nv) if getattr(model, field)[n]]
            if having:
                names = ", ".join(self.name("JOINT", int(model.dof_jntid[n])) for n in having)
                notes.append(f"not taken: {what} of the joints {names}")
        for field, what in (("jnt_stiffnesspoly", "stiffness"), ("dof_dampingpoly", "damping")):
            if np.any(getattr(model, field, np.zeros(1))):
                notes.append(f"not taken: higher terms of the {what} of joints")
        if model.ngeom:
            notes.append("shapes (geoms) give masses alone: contacts between them are not taken")
        out = float(model.opt.gravity @ self.plane.normal)
        if abs(out) > FILE_GRAVITY_IN_PLANE * float(np.linalg.norm(model.opt.gravity)):
            notes.append(f"gravity across the plane, {out:.4g} m/s², does nothing")
