"""Joints and constraints of a spatial model in its plane."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from mbody.exchange.drawn_linkage import refusal, seen
from mbody.exchange.plane_of_joints import Plane
from mbody.model.coupling import AngleCoupling, CouplingTerm, LengthCoupling
from mbody.model.element import Element, Marker
from mbody.model.joints import Fixed, PinSlot, Prismatic, Revolute
from mbody.model.loads import TorsionDamper, TorsionSpring

__all__ = ["Spatial", "couplings", "joints_of"]

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


def _limits(space: Spatial, joint: int, sense: float) -> dict[str, Any]:
    if not _limited(space, joint):
        return {}
    if space.model.jnt_type[joint] == HINGE:
        sense *= space.plane.sense(space.data.xaxis[joint])
    low, high = (float(v) - _reference(space, joint) for v in space.model.jnt_range[joint])
    return {"limits": (low, high) if sense > 0.0 else (-high, -low)}


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
        rest = float(model.qpos_spring[model.jnt_qposadr[joint]]) - _reference(space, joint)
        rest *= space.plane.sense(space.data.xaxis[joint])
        found.append(TorsionSpring(f"{name}_spring", **ends, stiffness=stiffness, free_angle=rest))
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
        angle = space.plane.turned(first @ relative.reshape(3, 3) @ second.T)
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
        sense = space.plane.sense(space.data.xaxis[joint])
        base = space.names[space.root(parent)]
        return CouplingTerm(sense * factor, angle=space.names[body], relative_to=base)
    if model.jnt_type[joint] != SLIDE:
        raise refusal(f"the joint {seen(space.name('JOINT', joint))}", "it cannot be coupled")
    label, at = space.name("JOINT", joint), space.data.xanchor[joint]
    i = _marker(space, parent, label, at, joint)
    return CouplingTerm(factor, coordinate=(i, _marker(space, body, label, at, joint)))
