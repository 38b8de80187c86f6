"""Four-bars of Norton's kind by inverse dynamics of a tree, cut at B, position after position.

Pinocchio and MuJoCo know no reactions of loops here (`mj_inverse` with a `connect` gives none at
all): the force at the cut comes from a 2×2, and a second pass gives the forces of the other pins.
Of mechanisms with several loops the forces at all cuts and of the driver are the solution of one
system of the size of the tree, for which Pinocchio has the Jacobian.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import mbody
from benchmarks.planar import Planar, Tree, planar
from validation.norton_fourbar import newton_euler as book

__all__ = ["LENGTHS", "cuts", "given", "links", "mujoco_loop", "pinocchio_loop"]

FORCE = tuple(80.0 * f for f in (math.cos(math.radians(330.0)), math.sin(math.radians(330.0))))
TORQUE = 120.0
P = tuple(9.0 * f(math.radians(45.0)) + 3.0 * f(math.radians(100.0)) for f in (math.cos, math.sin))
Wrench = tuple[float, float, float]
Motion = list[tuple[np.ndarray, np.ndarray, np.ndarray]]
#: Of crank, coupler and rocker, as in the book.
LENGTHS = (book.a, book.b, book.c)


def links(**varied: float) -> Planar:
    """The same links without loads; some of the numbers, by dotted names, may differ."""
    machine = planar(mbody.assemble(mbody.gallery.load("free_fourbar")).with_values(varied))
    machine.gravity = 0.0
    return machine


def given(run: mbody.Solution, tree: Tree) -> Motion:
    """Angles, rates and accelerations of the bodies against their parents, in the tree's order."""
    histories = [run[body.name] for body in run.system.mechanism.bodies]
    order, parents = tree.order, [tree.parent[body] for body in tree.order]

    def relative(of: list[np.ndarray]) -> np.ndarray:
        absolute = np.column_stack([*of, np.zeros(len(run.t))])
        return absolute[:, order] - absolute[:, parents]

    found = [
        relative([getattr(h, name) for h in histories]) for name in ("angle", "omega", "alpha")
    ]
    return list(zip(*found))


def cut(
    q: np.ndarray, tau: np.ndarray, lengths: tuple[float, float, float]
) -> tuple[float, Wrench, Wrench]:
    """The torque, and the wrenches of loads and cut on coupler (about A) and rocker (about O4)."""
    a, b, c = lengths
    t2, t4 = q[0], q[2]
    t3 = t2 + q[1]
    ax, ay = a * math.cos(t2), a * math.sin(t2)
    c3, s3 = math.cos(t3), math.sin(t3)
    bx, by = b * c3, b * s3
    rx, ry = c * math.cos(t4), c * math.sin(t4)
    px, py = c3 * P[0] - s3 * P[1], s3 * P[0] + c3 * P[1]
    load = px * FORCE[1] - py * FORCE[0]
    # (B − A) × F = τ of the coupler less its load; (B − O4) × F = T₄ − τ of the rocker
    m3, m4 = tau[1] - load, TORQUE - tau[2]
    determinant = -bx * ry + by * rx
    fx = (bx * m4 - rx * m3) / determinant
    fy = (by * m4 - ry * m3) / determinant
    # the moment about A of load and cut is τ of the coupler
    torque = tau[0] - tau[1] - (ax * (FORCE[1] + fy) - ay * (FORCE[0] + fx))
    on_coupler = (FORCE[0] + fx, FORCE[1] + fy, load + bx * fy - by * fx)
    on_rocker = (-fx, -fy, TORQUE - (rx * fy - ry * fx))
    return torque, on_coupler, on_rocker


def pinocchio_loop(
    machine: Planar, motion: Motion, lengths: tuple[float, float, float] = LENGTHS
) -> Callable[[], Any]:
    """`rnea` twice a position: forces (positions, 3, 2) at O2, A and O4, and torques."""
    import pinocchio as pin

    from benchmarks.peers.pinocchio import Pinocchio

    made = Pinocchio(machine)
    model, data = made.model, made.data
    outside = pin.StdVec_Force()
    outside.extend([pin.Force.Zero() for _ in range(4)])

    def loop() -> Any:
        torques, forces = np.empty(len(motion)), np.empty((len(motion), 3, 2))
        for n, (q, v, a) in enumerate(motion):
            tau = pin.rnea(model, data, q, v, a)
            torques[n], *wrenches = cut(q, tau, lengths)
            for joint, (fx, fy, moment) in zip((2, 3), wrenches):
                angle = q[0] + q[1] if joint == 2 else q[2]
                c, s = math.cos(angle), math.sin(angle)
                outside[joint] = pin.Force(
                    np.array([c * fx + s * fy, c * fy - s * fx, 0.0, 0.0, 0.0, moment])
                )
            pin.rnea(model, data, q, v, a, outside)
            for joint in (1, 2, 3):
                forces[n, joint - 1] = data.f[joint].linear[:2]
        return forces, torques

    return loop


def mujoco_loop(
    machine: Planar, motion: Motion, lengths: tuple[float, float, float] = LENGTHS
) -> Callable[[], Any]:
    """`mj_inverse`, then `mj_rnePostConstraint` with the cut's forces applied; gives the same."""
    import mujoco

    from benchmarks.peers.mujoco import model_of

    tree = machine.tree()._replace(loops=[])
    model = model_of(machine, tree, 1e-3)
    data = mujoco.MjData(model)
    bodies = [model.body(f"b{body}").id for body in (0, 1, 2)]

    def loop() -> Any:
        torques, forces = np.empty(len(motion)), np.empty((len(motion), 3, 2))
        for n, (q, v, a) in enumerate(motion):
            data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
            data.xfrc_applied[:] = 0.0
            mujoco.mj_inverse(model, data)
            torques[n], *wrenches = cut(q, data.qfrc_inverse, lengths)
            for body, (fx, fy, moment) in zip(bodies[1:], wrenches):
                # applied at the mass centre
                x, y = data.xipos[body, :2] - data.xpos[body, :2]
                data.xfrc_applied[body] = fx, fy, 0.0, 0.0, 0.0, moment - (x * fy - y * fx)
            mujoco.mj_rnePostConstraint(model, data)
            forces[n] = data.cfrc_int[bodies, 3:5]
        return forces, torques

    return loop


def cuts(machine: Planar, motion: Motion, driven: int = 0) -> Callable[[], np.ndarray]:
    """Forces at the cuts (positions, loops, 2) in axes of a link, by Pinocchio.

    τ of the tree = driver's torque on the driven body, which is pinned to the ground, + Jᵀ F.
    """
    import pinocchio as pin

    from benchmarks.peers.pinocchio import Pinocchio

    made = Pinocchio(machine)
    model, data, loops = made.model, made.data, made.constraints
    loads, count = made.tau, machine.bodies
    matrix = np.zeros((count, count))
    matrix[made.tree.order.index(driven), 0] = 1.0
    rows = [3 * loop + axis for loop in range(len(loops)) for axis in (0, 1)]

    def loop() -> np.ndarray:
        found = np.empty((len(motion), count))
        for n, (q, v, a) in enumerate(motion):
            tau = pin.rnea(model, data, q, v, a)
            pin.computeJointJacobians(model, data, q)
            for one, its in zip(loops, made.forces):
                one.calc(model, data, its)  # places of the loop, which the Jacobian reads
            jacobian = pin.getConstraintsJacobian(model, data, loops, made.forces)
            matrix[:, 1:] = jacobian[rows].T
            found[n] = np.linalg.solve(matrix, tau - loads)
        return found[:, 1:].reshape(len(motion), -1, 2)

    return loop
