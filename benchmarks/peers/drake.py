"""Drake: joint angles of a tree; loops have no joint in its continuous plants, so trees alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.frame import timed
from benchmarks.planar import GROUND, Planar, absolute

__all__ = ["task"]


def task(machine: Planar) -> tuple[Callable[[], float], np.ndarray]:
    """Seconds of one `EvalTimeDerivatives`, and the angular accelerations that it gives."""
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import (
        FixedOffsetFrame,
        RevoluteJoint,
        RotationalInertia,
        SpatialInertia,
    )

    plant, tree, made = MultibodyPlant(0.0), machine.tree(), {}
    made[GROUND] = plant.world_body()
    plant.mutable_gravity_field().set_gravity_vector([0.0, machine.gravity, 0.0])
    for body in tree.order:
        parent, (x, y) = tree.parent[body], tree.on_own[body]
        m, own = float(machine.mass[body]), float(machine.inertia[body])
        central = RotationalInertia(own / 2, own / 2, own)
        about = SpatialInertia.MakeFromCentralInertia(m, [-x, -y, 0.0], central)
        made[body] = plant.AddRigidBody(f"b{body}", about)
        px, py = tree.on_parent[body]
        if parent != GROUND:
            px, py = px - tree.on_own[parent][0], py - tree.on_own[parent][1]
        frame = plant.AddFrame(
            FixedOffsetFrame(f"f{body}", made[parent].body_frame(), RigidTransform([px, py, 0.0]))
        )
        plant.AddJoint(RevoluteJoint(f"j{body}", frame, made[body].body_frame(), [0.0, 0.0, 1.0]))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    angle, rate = machine.relative(tree)
    joints = [plant.GetJointByName(f"j{body}") for body in tree.order]
    for joint, q, v in zip(joints, angle, rate):
        joint.set_angle(context, q)
        joint.set_angular_rate(context, v)
    start = plant.GetPositionsAndVelocities(context).copy()
    n = machine.bodies
    relative = np.empty(n)
    slopes = plant.EvalTimeDerivatives(context).CopyToVector()[n:]
    for k, joint in enumerate(joints):
        relative[k] = slopes[joint.velocity_start()]
    times = max(3, 2000 // n)

    def evaluate() -> None:
        for _ in range(times):
            plant.SetPositionsAndVelocities(context, start)  # what was computed no longer counts
            plant.EvalTimeDerivatives(context)

    return lambda: timed(evaluate)[0] / times, absolute(tree, relative)
