"""Places of a start fitted to contacts: what touches within rounding of digits touches exactly."""

from __future__ import annotations

import numpy as np

from mbody.analysis.contact.unilateral import Overlap, Unilateral, deepest_overlap
from mbody.core import tolerances as tol
from mbody.errors import ModelError
from mbody.kernels.layout import Work
from mbody.system.rank import dense, shortest
from mbody.system.system import too_large

Array = np.ndarray

#: Corrections at most.
CORRECTIONS = 30


def fit_contacts(uni: Unilateral, work: Work) -> str | None:
    """Move the position in a workspace, as little as may be, to where no shapes overlap by rounding
    and what touches has no gap; joints stay closed. A sentence where that is more than rounding,
    "" where it is not; None where the position stays as it is.
    """
    system = uni.system
    n, scale = system.coordinates, system.coordinate_units
    before = work.q[:n, 0].copy()
    touching, overlaps = set[int](), dict[str, str]()
    for _ in range(CORRECTIONS):
        rows = uni.read(work)
        gaps = uni.gaps(rows)
        found = deepest_overlap(uni, rows, work, tol.CONTACT_GAP_BEGINNING * system.length)
        if found is not None:
            k = found.contact_point
            if not found.depth * uni.unit_of(k) <= tol.START_CHANGE_ALLOWED * system.length:
                break
            touching.add(k)
            size = f"{found.depth:.2g} {system.mechanism.units.length}"
            if uni.angular[uni.contact_points[k].normal]:
                size = f"{np.degrees(found.depth):.2g} deg"
            overlaps.setdefault(found.contact, f"'{found.contact}', where {size} overlapped")
        near = np.abs(gaps) <= tol.CONTACT_GAP_BEGINNING * system.length
        within = uni.within_edges(rows, work, tol.CONTACT_GAP_BEGINNING * system.length, 0.0)
        touching |= set(np.flatnonzero(near & within & ~uni.one_way).tolist())
        own = sorted(touching)
        off = np.abs(gaps[own]).max(initial=0.0) > tol.GUARD_ROUNDING_GAP * system.length
        if not off or too_large(system):
            break
        normals = [uni.contact_points[k].normal for k in own]
        phi, G = dense(system, work)
        J = np.vstack([G, rows.block[normals] * scale / system.length])
        left = np.append(phi, rows.value[normals] / system.length)
        step = shortest(J, -left, tol.SINGULAR_VALUE_NEAR_SINGULAR)
        work.q[:n, 0] += scale * step
        if np.abs(step).max() <= tol.GUARD_ROUNDING_GAP:
            break
    if np.array_equal(work.q[:n, 0], before):
        return None
    if not overlaps:
        return ""
    return f"the places of the start were fitted to contacts: {', '.join(overlaps.values())}"


def refuse_overlap(uni: Unilateral, work: Work) -> None:
    """Refuse shapes that overlap at the beginning."""
    gap_tolerance = tol.CONTACT_GAP_BEGINNING * uni.system.length
    found = deepest_overlap(uni, uni.read(work), work, gap_tolerance)
    if found is not None:
        raise _overlap(uni, work, found)


def _overlap(uni: Unilateral, work: Work, found: Overlap) -> ModelError:
    machine = uni.system.mechanism
    j = uni.bodies[found.contact_point][1]
    x, y, angle = work.q[3 * j : 3 * j + 3, 0]
    ax, ay = (float(part) for part in uni.contact_points[found.contact_point].candidate.position)
    place = (
        float(x + np.cos(angle) * ax - np.sin(angle) * ay),
        float(y + np.sin(angle) * ax + np.cos(angle) * ay),
    )
    (one,) = (one for one in machine.contacts if one.name == found.contact)
    sentence = one.overlapping(found.depth, place, uni.system.values, machine.units)
    return ModelError(sentence, one.described_as)
