"""MuJoCo: hinges of a tree, loops by `connect`, which are springs of the solver.

Its manual lets a constraint be as stiff as the step allows: solref = (−k, −b) with k = 0.5/h² and
b = 0.1 √k, solimp 0.9999, which were the most exact of those tried (critical damping is 2 to 3.5
times less so). RK4 is its integrator of the highest order; all steps are made in one call of C.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.frame import Engine
from benchmarks.planar import GROUND, Planar, Tree, absolute

__all__ = ["engine", "model_of"]


def model_of(machine: Planar, tree: Tree, step: float, integrator: str = "RK4") -> Any:
    """The compiled model; joint angles of zero have all axes along x."""
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep = step
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    spec.option.gravity = [0.0, machine.gravity, 0.0]
    spec.option.tolerance = 1e-15
    spec.option.iterations = 20
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
        link.add_joint(name=f"j{body}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
        made[body] = link
    k = 0.5 / step**2
    for n, (i, j, on_i, on_j) in enumerate(tree.loops):
        loop = spec.add_equality(type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_SITE)
        loop.name1, loop.name2 = site(i, on_i, f"l{n}i"), site(j, on_j, f"l{n}j")
        loop.solref = [-k, -0.1 * math.sqrt(k)]
        loop.solimp = [0.9999, 0.9999, 0.001, 0.5, 2.0]
    for n, (i, j, on_i, on_j, stiffness, free) in enumerate(machine.springs):
        tendon = spec.add_tendon(name=f"s{n}", stiffness=stiffness, springlength=[free, free])
        tendon.wrap_site(site(i, on_i, f"s{n}i"))
        tendon.wrap_site(site(j, on_j, f"s{n}j"))
    return spec.compile()


def start_of(machine: Planar, tree: Tree, model: Any) -> Any:
    """The state at the start."""
    import mujoco

    data = mujoco.MjData(model)
    angle, rate = machine.relative(tree)
    for body, q, v in zip(tree.order, angle, rate):
        joint = model.joint(f"j{body}")
        data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]] = q, v
    for body, torque in machine.torques:
        while body != GROUND:
            data.qfrc_applied[model.joint(f"j{body}").dofadr[0]] += torque
            body = tree.parent[body]
    return data


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
