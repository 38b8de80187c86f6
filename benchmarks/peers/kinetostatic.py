"""Norton's four-bar by inverse dynamics of a tree, cut at B, one position after another.

Pinocchio and MuJoCo know no reactions of loops here (`mj_inverse` with a `connect` gives none at
all): the force at the cut comes from a 2×2, and a second pass gives the forces of the other pins.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import mbody
from benchmarks.planar import Planar, planar
from validation.norton_fourbar import newton_euler as book

__all__ = ["mujoco_loop", "pinocchio_loop"]

FORCE = tuple(80.0 * f for f in (math.cos(math.radians(330.0)), math.sin(math.radians(330.0))))
TORQUE = 120.0
P = tuple(9.0 * f(math.radians(45.0)) + 3.0 * f(math.radians(100.0)) for f in (math.cos, math.sin))
Wrench = tuple[float, float, float]


def links() -> Planar:
    """The same links without loads."""
    machine = planar(mbody.assemble(mbody.gallery.load("free_fourbar")))
    machine.gravity = 0.0
    return machine


def given(run: mbody.Solution) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Relative angles, rates and accelerations of crank, coupler on crank, and rocker."""
    crank, coupler, rocker = (run[name] for name in ("crank", "coupler", "rocker"))
    found = [
        np.column_stack([f(crank), f(coupler) - f(crank), f(rocker)])
        for f in (lambda h: h.angle, lambda h: h.omega, lambda h: h.alpha)
    ]
    return list(zip(*found))


def cut(q: np.ndarray, tau: np.ndarray) -> tuple[float, Wrench, Wrench]:
    """The torque, and the wrenches of loads and cut on coupler (about A) and rocker (about O4)."""
    t2, t4 = q[0], q[2]
    t3 = t2 + q[1]
    ax, ay = book.a * math.cos(t2), book.a * math.sin(t2)
    c3, s3 = math.cos(t3), math.sin(t3)
    bx, by = book.b * c3, book.b * s3
    rx, ry = book.c * math.cos(t4), book.c * math.sin(t4)
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


def pinocchio_loop(system: mbody.System, run: mbody.Solution) -> Callable[[], Any]:
    """`rnea` twice a position."""
    import pinocchio as pin

    from benchmarks.peers.pinocchio import Pinocchio

    made = Pinocchio(links())
    model, data, motion = made.model, made.data, given(run)
    outside = pin.StdVec_Force()
    outside.extend([pin.Force.Zero() for _ in range(4)])

    def loop() -> Any:
        torques, forces = np.empty(len(motion)), np.empty((len(motion), 3, 6))
        for n, (q, v, a) in enumerate(motion):
            tau = pin.rnea(model, data, q, v, a)
            torques[n], *wrenches = cut(q, tau)
            for joint, (fx, fy, moment) in zip((2, 3), wrenches):
                angle = q[0] + q[1] if joint == 2 else q[2]
                c, s = math.cos(angle), math.sin(angle)
                outside[joint] = pin.Force(
                    np.array([c * fx + s * fy, c * fy - s * fx, 0.0, 0.0, 0.0, moment])
                )
            pin.rnea(model, data, q, v, a, outside)
            for joint in (1, 2, 3):
                forces[n, joint - 1] = data.f[joint].vector
        return forces, torques

    return loop


def mujoco_loop(system: mbody.System, run: mbody.Solution) -> Callable[[], Any]:
    """`mj_inverse`, then `mj_rnePostConstraint` with the cut's forces applied."""
    import mujoco

    from benchmarks.peers.mujoco import model_of

    machine = links()
    tree = machine.tree()._replace(loops=[])
    model = model_of(machine, tree, 1e-3)
    data, motion = mujoco.MjData(model), given(run)
    bodies = [model.body(f"b{body}").id for body in (1, 2)]

    def loop() -> Any:
        torques, forces = np.empty(len(motion)), np.empty((len(motion), *data.cfrc_int.shape))
        for n, (q, v, a) in enumerate(motion):
            data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
            data.xfrc_applied[:] = 0.0
            mujoco.mj_inverse(model, data)
            torques[n], *wrenches = cut(q, data.qfrc_inverse)
            for body, (fx, fy, moment) in zip(bodies, wrenches):
                # applied at the mass centre
                x, y = data.xipos[body, :2] - data.xpos[body, :2]
                data.xfrc_applied[body] = fx, fy, 0.0, 0.0, 0.0, moment - (x * fy - y * fx)
            mujoco.mj_rnePostConstraint(model, data)
            forces[n] = data.cfrc_int
        return forces, torques

    return loop
