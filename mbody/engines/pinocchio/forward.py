"""Forward dynamics by Pinocchio: accelerations from loads and efforts.

If all loops are closed by pins and welds and every body has inertia, the accelerations are computed
by `constraintDynamics` of Pinocchio with its proximal solver. Otherwise M, the bias forces and the
constraint rows are from Pinocchio, and the saddle-point system [M Jᵀ; J 0] is solved here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbody.engines.cut_constraints import ConstraintRow, constraint_rows
from mbody.engines.load_forces import gravity_of
from mbody.engines.pinocchio.inverse import Inverse
from mbody.engines.pinocchio.model import Instant, PinocchioModel, placement
from mbody.engines.spanning_tree import marker_frame
from mbody.model.joints import Fixed, Revolute

__all__ = ["Forward", "Undetermined"]

Array = np.ndarray

#: Of the proximal solver: absolute and relative accuracy, regularisation, iterations. Empty rows of
#: planar loops need the regularisation; without it Pinocchio returns NaN.
PROXIMAL = (1e-14, 1e-14, 1e-10, 100)
#: Eigenvalues of the scaled M and singular values of the scaled saddle-point matrix below this part
#: count as zero.
NONE = 1e-11
EPSILON = float(np.finfo(float).eps)


class Undetermined(Exception):
    """The accelerations are not determined; the text is the reason."""


class Forward:
    """Accelerations at the instants of a run, and in any other state.

    Parameters
    ----------
    inverse : Inverse
        The same mechanism, whose loads act here too.
    """

    def __init__(self, inverse: Inverse) -> None:
        self.inverse, self.system, self.tree = inverse, inverse.system, inverse.tree
        self.twin = PinocchioModel(self.system, self.tree, lumped=True)
        pin = self.twin.pin
        self.pinned = all(type(joint) in (Revolute, Fixed) for joint in inverse.loop_joints)
        self.models, self.datas = (
            pin.StdVec_RigidConstraintModel(),
            pin.StdVec_RigidConstraintData(),
        )
        if self.pinned:
            for joint in inverse.loop_joints:
                self.models.append(self._loop(joint))
                self.datas.append(self.models[-1].createData())
        self.proximal = pin.ProximalSettings(*PROXIMAL)
        pin.initConstraintDynamics(self.twin.model, self.twin.data, self.models, self.datas)
        self.scale = np.where(self.twin.turns, 1.0, self.system.length)

    def _loop(self, joint: Any) -> Any:
        """A cut joint as Pinocchio's own constraint."""
        pin, twin = self.twin.pin, self.twin
        ends = []
        for side in ("i", "j"):
            carrier, place = twin.placed[getattr(joint, side).body]
            ends += [carrier, place * placement(marker_frame(self.system, joint, side))]
        kind = pin.ContactType.CONTACT_6D if isinstance(joint, Fixed) else None
        kind = kind or pin.ContactType.CONTACT_3D
        return pin.RigidConstraintModel(kind, twin.model, *ends, pin.ReferenceFrame.LOCAL)

    def now(self, q: Array, v: Array, t: float) -> Instant:
        """Kinematics without accelerations."""
        return self.twin.at(q, v, np.zeros_like(q), gravity_of(self.system, t))

    def gravity(self, t: float, part: float = 1.0) -> None:
        """Sets the gravity of a time, or another part of it."""
        self.twin.model.gravity.linear = np.array([*(part * gravity_of(self.system, t)), 0.0])

    def at(self, k: int) -> tuple[Array, float]:
        """Accelerations of the tree (freedoms,) at an instant of the run under its efforts, and
        their rounding error: ε times the condition, times the accelerations by the loads alone
        [rad/time², lengths by the model length].
        """
        inverse = self.inverse
        t = float(inverse.run.t[k])
        now = self.now(inverse.q[k], inverse.v[k], t)
        efforts = self.load_efforts(now, inverse.acting(now, k), t)
        for driver in self.system.drivers:
            (row,) = constraint_rows(self.system, driver, now.bodies)
            efforts += float(inverse.run.effort(driver.name)[k]) * row.jacobian
        return self.solved(now, efforts)

    def load_efforts(self, now: Instant, acting: dict[str, Array], t: float) -> Array:
        """Generalised forces of the loads, with those of a rotating plane."""
        efforts = np.zeros(self.twin.model.nv)
        for name, wrench in acting.items():
            efforts += wrench @ now.bodies[name].jacobian
        inverse = self.inverse
        if inverse.spin is not None:
            # the part of the bias forces by the rotation
            twin, q = inverse.twin, now.q[self.twin.columns]
            speed = inverse.plane_speed(twin, q, t)
            still = np.zeros_like(q)
            bias = [
                twin.pin.nonLinearEffects(
                    twin.model, twin.data, twin.full(q), twin.full(still, plane)
                )[twin.columns]
                for plane in (speed, 0.0)
            ]
            efforts[self.twin.columns] -= bias[0] - bias[1]
        return efforts

    def solved(
        self, now: Instant, efforts: Array, driven: Sequence[tuple[ConstraintRow, float]] = ()
    ) -> tuple[Array, float]:
        """Accelerations under efforts, with given accelerations of drivers; and their rounding
        error.

        Raises
        ------
        Undetermined
            Where bodies without inertia have free accelerations.
        """
        pin, twin, size = self.twin.pin, self.twin, self.scale
        M = np.array(pin.crba(twin.model, twin.data, now.q))
        M = (np.triu(M) + np.triu(M, 1).T) * np.outer(size, size)
        top = float(np.abs(M).max(initial=0.0)) or 1.0
        bias = np.array(pin.nonLinearEffects(twin.model, twin.data, now.q, now.v))
        rows = [
            (row, 0.0)
            for joint in self.inverse.loop_joints
            for row in constraint_rows(self.system, joint, now.bodies)
        ]
        rows += driven
        unit = np.array([1.0 if row.torque else self.system.length for row, _ in rows])
        J = np.array([row.jacobian * size for row, _ in rows]).reshape(len(rows), len(size))
        J /= unit[:, None]
        u, s, vt = np.linalg.svd(np.block([[M / top, J.T], [J, np.zeros((len(J), len(J)))]]))
        kept = s > NONE * s.max(initial=0.0)
        if np.abs(vt[~kept][:, : len(size)]).max(initial=0.0) > 1e-6:
            raise Undetermined("free accelerations of bodies without inertia")
        wanted = np.array([change - row.change for row, change in rows]) / unit
        right = np.concatenate([(efforts - bias) * size / top, wanted])
        condition = float(s[kept].max(initial=1.0) / s[kept].min(initial=1e300))
        rounding = EPSILON * condition * float(np.abs(right).max(initial=0.0))
        if self.pinned and not driven and self.massive(M / top):
            return self.proximal_solved(now, efforts), rounding
        x = np.zeros(len(right))
        K = (u * s) @ vt
        for _ in range(2):  # the second is a refinement
            x += vt[kept].T @ ((u[:, kept].T @ (right - K @ x)) / s[kept])
        return (x[: len(size)] * size)[twin.columns], rounding

    @staticmethod
    def massive(M: Array) -> bool:
        """Whether every motion of the tree has inertia."""
        return bool(np.linalg.eigvalsh(M).min(initial=1.0) > NONE)

    def proximal_solved(self, now: Any, efforts: Array) -> Array:
        """Accelerations by Pinocchio's own solver; `now` has its q and v."""
        twin = self.twin
        a = twin.pin.constraintDynamics(
            twin.model,
            twin.data,
            now.q,
            now.v,
            efforts,
            self.models,
            self.datas,
            self.proximal,
        )
        return np.array(a)[twin.columns]
