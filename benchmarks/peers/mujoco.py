"""MuJoCo: hinges of a tree, loops by `connect`, which are springs of the solver.

Its manual lets a constraint be as stiff as the step allows: solref = (−k, −b) with k = 0.5/h² and
b = 0.1 √k, solimp 0.9999, which were the most exact of those tried (critical damping is 2 to 3.5
times less so). RK4 is its integrator of the highest order; all steps are made in one call of C.
Contacts are such springs as well, with elliptic cones; only rims and boxes touch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.frame import Engine
from benchmarks.planar import GROUND, Planar, Tree, absolute

__all__ = ["engine", "model_of", "pose_of", "start_of"]

#: Radius of what stands for a point [m]; the wall is as much lower.
POINT = 1e-5
#: Stiffness and damping, by a unit of what the contact has to move, for a restitution.
Law = Callable[[float], tuple[float, float]]
RIGID = [0.9999, 0.9999, 0.001, 0.5, 2.0]


def model_of(
    machine: Planar, tree: Tree, step: float, integrator: str = "RK4", law: Law | None = None
) -> Any:
    """The compiled model; joint angles of zero have all axes along x. Without a law nothing
    touches.
    """
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep = step
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    spec.option.gravity = [0.0, machine.gravity, 0.0]
    spec.option.tolerance = 1e-15
    spec.option.iterations = 20
    if law is None:
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    spec.compiler.degree = False
    made = {GROUND: spec.worldbody}

    def at(body: int, point: tuple[float, float]) -> list[float]:
        own = (0.0, 0.0) if body == GROUND else tree.on_own[body]
        return [point[0] - own[0], point[1] - own[1], 0.0]

    def site(body: int, point: tuple[float, float], name: str) -> str:
        made[body].add_site(name=name, pos=at(body, point))
        return name

    for body in tree.order:
        parent, (x, y) = tree.parent[body], tree.on_own[body]
        link = made[parent].add_body(name=f"b{body}", pos=at(parent, tree.on_parent[body]))
        own = float(machine.inertia[body])
        link.mass, link.ipos, link.inertia = (
            machine.mass[body],
            [-x, -y, 0.0],
            [own / 2, own / 2, own],
        )
        link.explicitinertial = True
        for number in range(2 if body in tree.loose else 0):
            if (body, number) not in machine.held:
                along = [float(number == n) for n in range(3)]
                kind = mujoco.mjtJoint.mjJNT_SLIDE
                link.add_joint(name=f"{'xy'[number]}{body}", type=kind, axis=along)
        if (body, 2) not in machine.held:
            link.add_joint(name=f"j{body}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
        made[body] = link
    for i, j, stiffness in machine.twists:
        assert tree.parent[j] == i
        spec.joint(f"j{j}").stiffness = [stiffness, 0.0, 0.0]
    k = 0.5 / step**2
    for n, (i, j, on_i, on_j) in enumerate(tree.loops):
        loop = spec.add_equality(type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_SITE)
        loop.name1, loop.name2 = site(i, on_i, f"l{n}i"), site(j, on_j, f"l{n}j")
        loop.solref = [-k, -0.1 * math.sqrt(k)]
        loop.solimp = RIGID
    for n, (i, j, on_i, on_j, stiffness, free) in enumerate(machine.springs):
        tendon = spec.add_tendon(name=f"s{n}", stiffness=stiffness, springlength=[free, free])
        tendon.wrap_site(site(i, on_i, f"s{n}i"))
        tendon.wrap_site(site(j, on_j, f"s{n}j"))
    if law is not None:
        touch(machine, tree, spec, made, law)
    return spec.compile()


def touch(machine: Planar, tree: Tree, spec: Any, made: dict[int, Any], law: Law) -> None:
    """The wall, rims and boxes, and pairs of them with springs by the law."""
    import mujoco

    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100.0
    spec.option.iterations = 100
    apart = {"contype": 0, "conaffinity": 0}
    low = 0.0 if all(rim.radius for rim in machine.rims) else POINT
    (x, y), (nx, ny) = machine.wall
    half = math.sqrt(0.5)  # from the axis z to the normal
    wall = spec.worldbody.add_geom(name="wall", type=mujoco.mjtGeom.mjGEOM_PLANE, **apart)
    wall.pos, wall.size = [x - low * nx, y - low * ny, 0.0], [9.0, 9.0, 1.0]
    wall.quat = [half, -half * ny, half * nx, 0.0]

    def pair(one: str, other: str, friction: float, restitution: float) -> None:
        k, b = law(restitution)
        both = spec.add_pair(geomname1=one, geomname2=other, solref=[-k, -b], solimp=RIGID)
        both.condim, both.friction = (3 if friction else 1), [friction, friction, 0.0, 0.0, 0.0]

    for n, rim in enumerate(machine.rims):
        (px, py), (ox, oy) = rim.place, tree.on_own[rim.body]
        end = made[rim.body].add_geom(name=f"rim{n}", type=mujoco.mjtGeom.mjGEOM_SPHERE, **apart)
        end.pos, end.size = [px - ox, py - oy, 0.0], [rim.radius or POINT, 0.0, 0.0]
        pair("wall", f"rim{n}", rim.friction, rim.restitution)
    for n, box in enumerate(machine.boxes):
        solid = made[box.body].add_geom(name=f"box{n}", type=mujoco.mjtGeom.mjGEOM_BOX, **apart)
        solid.size = [0.5 * box.width, 0.5 * box.height, 0.5 * box.width]
        for other in ("wall", *([f"box{n - 1}"] if n else [])):
            pair(other, f"box{n}", box.friction, 0.0)


def start_of(machine: Planar, tree: Tree, model: Any) -> Any:
    """The state at the start."""
    import mujoco

    data = mujoco.MjData(model)
    angle, rate = machine.relative(tree)
    start = {f"j{body}": (q, v) for body, q, v in zip(tree.order, angle, rate)}
    for body in tree.loose:
        for number, axis in enumerate("xy"):
            start[f"{axis}{body}"] = machine.pose[body, number], machine.rate[body, number]
    for n in range(model.njnt):
        joint = model.joint(n)
        data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]] = start[joint.name]
    for body, torque in machine.torques:
        while body != GROUND:
            data.qfrc_applied[model.joint(f"j{body}").dofadr[0]] += torque
            body = tree.parent[body]
    return data


def pose_of(machine: Planar, tree: Tree, model: Any, data: Any) -> np.ndarray:
    """x, y and angle of the mass centres."""
    import mujoco

    mujoco.mj_kinematics(model, data)
    turned = [(body, 2) not in machine.held for body in tree.order]
    joints = [model.joint(f"j{body}").qposadr[0] for body in np.array(tree.order)[turned]]
    relative = np.zeros(len(tree.order))
    relative[turned] = data.qpos[joints]
    at = [model.body(f"b{body}").id for body in range(machine.bodies)]
    return np.column_stack([data.xipos[at][:, :2], absolute(tree, relative)])


def engine(machine: Planar, until: float, counts: Sequence[int], integrator: str = "RK4") -> Engine:
    """So many steps of equal length."""
    import mujoco

    tree = machine.tree()
    models: dict[int, Any] = {}

    def prepare(count: int) -> Callable[[], Any]:
        if count not in models:
            models[count] = model_of(machine, tree, until / count, integrator)
        model = models[count]
        data = start_of(machine, tree, model)

        def run() -> Any:
            mujoco.mj_step(model, data, nstep=count)
            return model, data

        return run

    def state(found: Any) -> tuple[np.ndarray, np.ndarray]:
        model, data = found
        joints = [model.joint(f"j{body}") for body in tree.order]
        q = np.array([data.qpos[joint.qposadr[0]] for joint in joints])
        v = np.array([data.qvel[joint.dofadr[0]] for joint in joints])
        return absolute(tree, q), absolute(tree, v)

    return Engine(f"MuJoCo {integrator}", list(counts), prepare, state)
