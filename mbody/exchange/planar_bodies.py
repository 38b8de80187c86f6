"""MJCF and URDF: the bodies of a spatial model that moves in one plane.

MuJoCo itself compiles the file (defaults, classes, inertias of shapes, frames), so that what counts
here is what MuJoCo simulates. All bodies have the axes of the plane at the model's reference
position, where all joints are at 0.
"""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element as Node

import numpy as np

from mbody.errors import ModelError, SolveError
from mbody.exchange.drawn_linkage import origin, refusal, seen
from mbody.exchange.imported import Imported
from mbody.exchange.planar_joints import couplings, joints_of
from mbody.exchange.plane_of_joints import Plane, check_axes, plane_of
from mbody.files.model import in_units
from mbody.model.body import Body
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism

__all__ = ["planar_bodies"]

HINGE, SLIDE, FREE = 3, 2, 0


def planar_bodies(path: Path, root: Node, units: str) -> Imported:
    """The mechanism of a file of MuJoCo, or of a URDF.

    Raises
    ------
    ModelError
        For what MuJoCo refuses, joints that leave the plane, and constraints that are not read.
    SolveError
        Where MuJoCo is not installed.
    """
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
    """What a URDF has and MuJoCo does not keep: links that it joins to others, and loads."""
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
    """What the bodies and joints of a compiled model are in its plane."""

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
        self._note_the_rest()
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
        names, taken = {0: "ground"}, {"ground", "gravity"}
        for body in range(1, self.model.nbody):
            wanted = self.name("BODY", body)
            while wanted in taken:
                wanted += "_"
            taken.add(wanted)
            names[body] = wanted
        return names

    def _plane(self) -> Plane:
        model = self.model
        kinds, axes = model.jnt_type, self.data.xaxis
        hinges = [axes[n] for n in range(model.njnt) if kinds[n] == HINGE]
        slides = [axes[n] for n in range(model.njnt) if kinds[n] == SLIDE]
        if not hinges and not slides:
            raise ModelError(
                "it has no hinge and no slide, so nothing says in which plane it moves"
            )
        plane = plane_of(hinges, slides, model.opt.gravity)
        for n in range(model.njnt):
            name = f"the joint {seen(self.name('JOINT', n))}"
            if kinds[n] in (HINGE, SLIDE):
                check_axes(plane, name, axes[n], hinge=kinds[n] == HINGE)
            elif kinds[n] != FREE:
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

    def _note_the_rest(self) -> None:
        """All that the file has and the model has not."""
        model, notes = self.model, self.notes
        for n in np.flatnonzero(model.jnt_type == FREE):
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
        if abs(out) > 1e-9 * float(np.linalg.norm(model.opt.gravity)):
            notes.append(f"gravity across the plane, {out:.4g} m/s², does nothing")
