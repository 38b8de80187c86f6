"""The problem of contacts and rough joints at the present instant of a motion.

Forces and accelerations are those that the kernels found with some modes; how they change by forces
along the rows of what may open or rub follows from dense matrices of rows and masses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.friction_problem import FrictionProblem, Limits, Tangent, cone
from mbody.analysis.contact.joint_friction import JointFriction
from mbody.analysis.contact.unilateral import Unilateral
from mbody.analysis.dynamics.contact_impacts import responses_to, touch_rows
from mbody.analysis.dynamics.modal_motion import ModalMotion
from mbody.kernels.layout import Work
from mbody.kernels.output import PER_PRIMITIVE
from mbody.system.rank import dense
from mbody.system.system import System

__all__ = ["FrictionModel", "force_size", "joint_multipliers", "model_of"]

Array = np.ndarray

#: Singular values of the rows of joints below this part of the greatest are zero.
ZERO = 1e-9


@dataclass(frozen=True, eq=False)
class FrictionModel:
    """The problem, and whose its parts are.

    Attributes
    ----------
    problem : FrictionProblem
        Torques and angular accelerations by the model length.
    closed : list of int
        Touches of the normals.
    owners : list of int
        Of every tangent its touch, or the number of touches and that of its rough joint.
    """

    problem: FrictionProblem
    closed: list[int]
    owners: list[int]


def force_size(motion: ModalMotion) -> float:
    """The greatest force, or torque by unit length, at the present instant."""
    system, n = motion.system, motion.system.coordinates
    inertia = system.mass[:n, 0] * motion.K[0, n : 2 * n] / motion.scale[:n]
    forces = motion.page[3 * n : system.friction_rows.start]
    return max(float(np.abs(part).max(initial=0.0)) for part in (inertia, forces))


def joint_multipliers(system: System, work: Work, changes: Array, accelerations: Array) -> Array:
    """How the multipliers of all nodes change, (2 nodes, forces), by generalised forces `changes`
    (coordinates, forces) that change accelerations so: those of least norm where rows of joints are
    redundant.
    """
    _, G = dense(system, work)
    n = G.shape[1]
    left = changes - system.mass[:n] * accelerations
    scaled = np.linalg.pinv(G.T, rcond=ZERO) @ (left * system.coordinate_units[:, None])
    primitive, row, _ = system.row_table
    found = np.zeros((2 * system.layout.nodes, changes.shape[1]))
    found[2 * system.layout.primitive_node[primitive] + row] = system.row_units[:, None] * scaled
    return found


def _multipliers_at(system: System, page: Array, node: int) -> tuple[float, float]:
    """Both multipliers of a node by a page (rows,)."""
    e = int(np.flatnonzero(system.layout.primitive_node == node)[0])
    first = 3 * system.coordinates + PER_PRIMITIVE * e
    return float(page[first]), float(page[first + 1])


def _limits(
    law: JointFriction, at: tuple[float, float], change: Array, forces: Array, unit: float
) -> Limits:
    """Limits of a joint whose multipliers (2,) at `forces` are known, and their change (2, all)."""

    def limits(now: Array) -> tuple[Array, Array, Array, Array]:
        x, y = np.moveaxis(np.array(at) + (now - forces) @ change.T, -1, 0)
        found = list[Array]()
        for sense in (1.0, -1.0):
            size, by_x, by_y = (np.asarray(part)[..., None] for part in law.size(x, y, sense))
            found += [unit * size[..., 0], unit * (by_x * change[0] + by_y * change[1])]
        return found[0], found[2], found[1], found[3]

    return limits


def _lasting(uni: Unilateral) -> list[tuple[int, float]]:
    """Pairs that teeth press apart: their numbers and senses."""
    L, par = uni.layout, uni.system.par
    kinds = range(len(L.friction_kind))
    return [(f, float(par[int(L.friction_par[f]) + 4, 0])) for f in kinds if uni.presses_apart(f)]


def model_of(
    motion: ModalMotion, closed: Sequence[int], sliding: Array, resting: Array
) -> FrictionModel:
    """The problem at the state, derivative and page of a motion, whose modes may be any.

    Parameters
    ----------
    closed : list of int
        Touches that are closed and neither approach nor part.
    sliding : array (touches,)
        Signs of the rates of sliding, zero of those at rest.
    resting : array (rough joints,)
        The same of the rough joints.
    """
    uni, system, n = motion.uni, motion.system, motion.system.coordinates
    work, page, a = motion.work, motion.page[:, 0], motion.K[0, n : 2 * n]
    motion.load()
    rows = uni.read(work)
    touches = [uni.touches[k] for k in closed]
    m, count = len(closed), len(uni.touches)
    W, _ = touch_rows(uni, rows, list(closed))
    rough = [k for k in range(m) if touches[k].tangent >= 0 and touches[k].static > 0.0]
    # of every tangent its row among those that can be on or off, its pair, its sense, its owner
    pairs = [(one.tangent, one.pair, resting[k], count + k) for k, one in enumerate(uni.rough)]
    pairs += [(int(uni.layout.friction_tangent[f]), f, sense, -1) for f, sense in _lasting(uni)]
    unit = np.array([system.length if uni.angular[row] else 1.0 for row, *_ in pairs])
    tangent_rows = [row for row, *_ in pairs]
    every = np.vstack([W[:m], W[[m + k for k in rough]], unit[:, None] * rows.block[tangent_rows]])
    gamma = np.concatenate(
        [
            [one.spot.sense * rows.gamma[one.normal] for one in touches],
            [rows.gamma[touches[k].tangent] for k in rough],
            unit * rows.gamma[tangent_rows],
        ]
    )
    viscous = [
        system.par[int(uni.layout.friction_par[f]) + 3, 0] * rows.rate[row] for row, f, *_ in pairs
    ]
    forces = np.concatenate(
        [
            [uni.pressing(page, one) for one in touches],
            [-uni.multiplier(page, touches[k].tangent) for k in rough],
            [
                (v - uni.multiplier(page, row)) / u
                for (row, *_), v, u in zip(pairs, viscous, unit, strict=True)
            ],
        ]
    )
    Y = responses_to(uni, work, every)
    tangents = []
    for k in rough:
        one, sense = touches[k], sliding[closed[k]]
        tangents.append(cone(len(every), k, one.friction if sense else one.static, sense))
    if pairs:
        changes = joint_multipliers(system, work, every.T, Y)
    for (row, f, sense, _), u in zip(pairs, unit, strict=True):
        law = JointFriction(system, work, f, rows.rate[row] if sense else None)
        at, node = _multipliers_at(system, page, law.node), 2 * law.node
        limits = _limits(law, at, changes[node : node + 2], forces, 1.0 / u)
        tangents.append(Tangent(limits, sense, linear=law.by_law))
    D = every @ Y
    heavy = float(np.diag(D).max(initial=0.0)) * force_size(motion)
    owners = [closed[k] for k in rough] + [owner for *_, owner in pairs]
    problem = FrictionProblem(m, tuple(tangents), every @ a - gamma, D, forces, 1e-3 * heavy)
    return FrictionModel(problem, list(closed), owners)
