"""Impacts of free bodies by momentum alone: impulses within Coulomb's cones, and the energy."""

import contextlib
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear, nnls

from mbody.engines.oracle import Reference
from mbody.engines.oracle.contact_motion import OracleContacts

KEYS = ("x", "y", "angle"), ("vx", "vy", "omega")
#: Gaps up to this part of the bodies' size may take part.
CLOSED = 1e-7


def nearest_of_cone(columns: np.ndarray, goal: np.ndarray) -> tuple[np.ndarray, float]:
    """Parts ≥ 0 of columns of like length whose sum is nearest to a goal; its distance.

    What any method finds bounds the distance from above: where columns depend on each other, nnls
    before scipy 1.15 ends far from the nearest or not at all.
    """
    found = []
    with contextlib.suppress(np.linalg.LinAlgError, RuntimeError):
        found.append(nnls(columns, goal, maxiter=1000))
    if not found or found[0][1] > 1e-9 * np.linalg.norm(goal):
        x = lsq_linear(columns, goal, bounds=(0.0, np.inf), method="bvls", tol=1e-15).x
        found.append((x, float(np.linalg.norm(columns @ x - goal))))
    return min(found, key=lambda one: one[1])


@dataclass(frozen=True)
class ImpactCheck:
    """One impact of a run.

    `outside`: What of the change of momentum no impulses within the cones give, as a part of it, in
      the norm of energy.
    `size`: The change as a part of the greatest momentum of the motion, in that norm.
    `gained`: Kinetic energy that it gives, as a part of what impulses within the cones exchange.
    `energy`: That energy.
    """

    t: float
    name: str
    contact: str
    outside: float
    size: float
    gained: float
    energy: float


def check_impacts(run) -> list[ImpactCheck]:
    """Every impact of a motion of free bodies, from its rates before and after alone.

    The least of |M^−½ (M Δv − C λ)| with λ ≥ 0, of every place that touches both edges of its cone
    n ± μ t in C, of a rope that is taut its pull.
    """
    machine = run.mechanism
    assert not (machine.joints or machine.couplings or machine.drivers)
    places = OracleContacts(Reference(machine), machine.contacts)
    numbers = {one.name: one for one in machine.bodies}
    mass = np.array([m for b in numbers.values() for m in (b.mass, b.mass, b.inertia)], float)
    most = float(np.sqrt(2.0 * run.energy.kinetic.max()))
    found = []
    for event in run.events:
        if event.after is None or event.name not in ("impact", "rest"):
            continue
        q, before, after = (
            np.array([getattr(state[name], key)[0] for name in numbers for key in keys])
            for state, keys in (
                (event.state, KEYS[0]),
                (event.state, KEYS[1]),
                (event.after, KEYS[1]),
            )
        )
        m = len(places)
        rows, gaps = places.rows(q), places.gaps(q)
        edges = []
        for k in np.flatnonzero(gaps <= CLOSED * places.length()):
            one = places.candidates[k]
            cone = (0.0,) if one.kind == "rope" else (one.friction, -one.friction)
            edges += [rows[k] + part * rows[m + k] for part in cone]
        root = np.sqrt(mass)
        change = root * (after - before)
        C = np.array(edges).reshape(-1, len(mass)).T / root[:, None]
        sizes = np.linalg.norm(C, axis=0)
        whole = float(np.linalg.norm(change)) or 1.0
        impulses, outside = nearest_of_cone(C / sizes, change / whole)
        impulses *= whole / sizes
        rates = np.abs([edge @ before for edge in edges]) + np.abs([edge @ after for edge in edges])
        energy = float(0.5 * (after + before) @ (mass * (after - before)))
        exchanged = 0.5 * float(impulses @ rates) or 1.0
        told = event.t, event.name, event.contact
        found.append(ImpactCheck(*told, outside, whole / most, energy / exchanged, energy))
    return found
