"""Loops that cannot close: the smallest gap and its place, or a driver too many."""

from __future__ import annotations

from typing import Any, NoReturn

import numpy as np

from mbody.analysis.position.closed_position import SEARCHED, violations
from mbody.core import tolerances as tol
from mbody.errors import SolveError, angle_text
from mbody.kernels.layout import Work
from mbody.model.element import listed
from mbody.system.rank import Rank, dense, rank_of, smallest_gap
from mbody.system.system import System, too_large

#: Joints at which the smallest gap is looked for.
CANDIDATES = 8


def explain_gap(system: System, work: Work, start: np.ndarray, t: float) -> NoReturn:
    """Say which loop stays open and by how much, or which driver is one too many. `start`
    (coordinates + 3, 1): Where closing began; the workspace is where it ended.
    """
    owners = np.array([system.owners[e][0].name for e in system.row_table[0]])
    joints = len(owners) - len(system.drivers)
    if system.rows > SEARCHED:
        raise _gap_met(system, work, joints, t)
    # links in line could not fold: begin a little bent
    bodies = system.layout.bodies
    start = start.copy()
    start[2 : 3 * bodies : 3, 0] += 0.1 * np.sin(1.0 + np.arange(bodies))
    work.q[:] = start
    _check_directions(system, work, owners)
    phi = np.abs(smallest_gap(system, work, np.arange(len(owners)) < joints))
    if phi[:joints].max(initial=0.0) < tol.LOOP_OPEN_FIXED:
        _refuse_surplus(system, rank_of(dense(system, work)[1][:joints]))
        raise _driver_beyond_links(system, work, phi[joints:], t)
    # hold all joints but one: the gap there is what a user would measure
    width = {joint.name: phi[owners == joint.name].max() for joint in system.mechanism.joints}
    widest = sorted(width, key=lambda name: -width[name])[:CANDIDATES]
    found: list[tuple[float, Any]] = []
    for joint in (joint for joint in system.mechanism.joints if joint.name in widest):
        own = owners == joint.name
        work.q[:] = start
        phi = smallest_gap(system, work, ~own)
        if np.abs(phi[~own]).max(initial=0.0) < tol.LOOP_OPEN_FIXED:
            found.append((float(np.linalg.norm(phi[own])) * system.length, joint))
    if not found:
        raise _gap_met(system, work, joints, t)
    least = min(size for size, _ in found)
    equal = [joint for size, joint in found if size < least * (1.0 + tol.LOOP_GAPS_TIE)]
    # of joints with equal gaps the one between two moving bodies is named
    joint = min(equal, key=lambda joint: "ground" in (joint.i.body, joint.j.body))
    units = system.mechanism.units
    raise SolveError(
        f"loops do not close at t = {t:g} {units.time}: the smallest gap is {least:.4g} "
        f"{units.length} at '{joint.name}' (between '{joint.i.body}' and '{joint.j.body}'): check "
        "lengths, or give a better guess",
        joint.name,
    )


def _driver_beyond_links(system: System, work: Work, off: np.ndarray, t: float) -> SolveError:
    """The sentence for a driver that asks more than the links give; `off` (drivers,)."""
    n = int(off.argmax())
    driver, row = system.drivers[n], system.layout.driver_row[n]
    angular, units = driver.angular, system.mechanism.units
    requested, distance = float(work.signal[row, 0]), float(off[n])
    if angular:
        wanted, reachable = angle_text(requested), angle_text(float(f"{distance:.3g}"))
    else:
        wanted = f"{requested:.6g} {units.length}"
        reachable = f"{distance * system.length:.3g} {units.length}"
    return SolveError(
        f"driver '{driver.name}' cannot bring '{driver.bodies[1]}' to {wanted} at t = {t:g} "
        f"{units.time}: it comes within {reachable} where the links are stretched; check lengths "
        "and the law",
        driver.name,
    )


def _gap_met(system: System, work: Work, joints: int, t: float) -> SolveError:
    """The sentence where the smallest gap is not looked for: the gap at which closing ended."""
    if not too_large(system):
        _refuse_surplus(system, rank_of(np.nan_to_num(dense(system, work)[1][:joints])))
    primitive, _, is_angle = system.row_table
    phi = system.length * violations(system, work)
    phi = np.where(np.isfinite(phi) & ~is_angle, phi, 0.0)
    at = system.owners[int(primitive[int(phi.argmax())])][0].name
    units = system.mechanism.units
    return SolveError(
        f"loops of '{system.mechanism.name}' do not close at t = {t:g} {units.time}: the search "
        f"ended with a gap of {phi.max():.4g} {units.length} at '{at}': check lengths, or give a "
        "better guess",
        at,
    )


def _refuse_surplus(system: System, joints: Rank) -> None:
    """Refuse more drivers than the joints leave freedoms."""
    names = [driver.name for driver in system.drivers]
    if joints.free < len(names):
        more, freedom = "s"[: len(names) - 1], "degree" if joints.free == 1 else "degrees"
        raise SolveError(
            f"{len(names)} driver{more} ({listed(names)}) for {joints.free} {freedom} of freedom "
            f"of '{system.mechanism.name}': remove {len(names) - joints.free}",
            names[-1],
        )


def _check_directions(system: System, work: Work, owners: np.ndarray) -> None:
    """Refuse a first position at which a distance is measured between two places that coincide."""
    G = dense(system, work)[1]
    bad = np.flatnonzero(~np.isfinite(G).all(axis=1))
    if bad.size:
        element: Any = system.mechanism[str(owners[bad[0]])]
        bodies = [f"'{marker.body}'" for marker in element.places().values()]
        raise SolveError(
            f"'{element.name}' has no direction to begin with: two ends of it, on "
            f"{' and '.join(dict.fromkeys(bodies))}, are guessed to be at one place; give a guess "
            "for the bodies",
            element.name,
        )
