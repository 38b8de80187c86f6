"""Loops that cannot close: the smallest gap and where it is, or the driver that is one too many."""

from __future__ import annotations

from typing import Any, NoReturn

import numpy as np

from mbody.errors import SolveError, angle_text
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import violation
from mbody.model.element import listed
from mbody.system.rank import Rank, dense, rank_of, smallest_gap, too_large
from mbody.system.system import System

__all__ = ["explain_gap", "refuse_near_redundant", "violations"]

#: Rows up to which the smallest gap is looked for, and joints at which: a second or two in all.
SEARCHED, CANDIDATES = 60, 8
#: Rows that are fixed are closed within this, in model lengths and radians.
SATISFIED = 1e-6
#: A gap below this, in model lengths and radians, is rounding of joints that fit.
ROUNDING = 1e-14
#: A gap below this, in model lengths and radians, may be an error of lengths that should agree;
#: rows are then dependent but for this part of the greatest singular value.
SLIGHT, NEARLY = 1e-3, 3e-3
#: How far beside a position the gap is looked at again; a row takes part in a dependency with this
#: part of the greatest; joints that are named.
BESIDE, TAKES_PART, NAMED = 0.1, 0.3, 6


def violations(system: System, work: Work) -> np.ndarray:
    """Size of every row of Φ at the position in the workspace, lengths by the model length."""
    primitive, row, is_angle = system.row_table
    violation(system.runtime(), work)
    phi = np.abs(work.phi[2 * system.layout.primitive_node[primitive] + row, 0])
    return np.where(is_angle, phi, phi / system.length)


def explain_gap(system: System, work: Work, start: np.ndarray, t: float) -> NoReturn:
    """Say which loop stays open and by how much, or which driver is one too many.

    Parameters
    ----------
    system, work
        The workspace as the last attempt to close left it.
    start : array (coordinates, 1)
        Where the search for the smallest gap begins.
    t : float
        Time, for the sentence.
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
    if phi[:joints].max(initial=0.0) < SATISFIED:
        _refuse_surplus(system, rank_of(dense(system, work)[1][:joints]))
        raise _out_of_reach(system, work, phi[joints:], t)
    # hold all joints but one: the gap there is what a user would measure
    width = {joint.name: phi[owners == joint.name].max() for joint in system.mechanism.joints}
    widest = sorted(width, key=lambda name: -width[name])[:CANDIDATES]
    found: list[tuple[float, Any]] = []
    for joint in (joint for joint in system.mechanism.joints if joint.name in widest):
        own = owners == joint.name
        work.q[:] = start
        phi = smallest_gap(system, work, ~own)
        if np.abs(phi[~own]).max(initial=0.0) < SATISFIED:
            found.append((float(np.linalg.norm(phi[own])) * system.length, joint))
    if not found:
        raise _gap_met(system, work, joints, t)
    least = min(size for size, _ in found)
    equal = [joint for size, joint in found if size < least * (1.0 + 1e-6)]
    # of joints with equal gaps the one between two moving bodies is named
    joint = min(equal, key=lambda joint: "ground" in (joint.i.body, joint.j.body))
    units = system.mechanism.units
    raise SolveError(
        f"loops do not close at t = {t:g} {units.time}: the smallest gap is {least:.4g} "
        f"{units.length} at '{joint.name}' (between '{joint.i.body}' and '{joint.j.body}'): check "
        "lengths, or give a better guess",
        joint.name,
    )


def refuse_near_redundant(system: System, work: Work, start: np.ndarray) -> None:
    """Refuse joints that repeat each other but for a small error of lengths: the loops then close
    at isolated positions only, where nothing moves, though a gap that small stays along a motion.

    Parameters
    ----------
    work : Work
        Whose signals are set; its position is left as it was.
    start : array (coordinates + 3, 1)
        Where the smallest gap is looked for.
    """
    size, drivers = system.coordinates, len(system.drivers)
    joints = system.rows - drivers
    if system.rows > SEARCHED or joints + max(1, drivers) <= size:
        return
    before = work.q.copy()
    work.q[:] = start
    scale = system.coordinate_units
    driven = np.arange(system.rows) >= joints
    try:
        if not np.isfinite(dense(system, work)[1]).all():  # a distance of 0
            return
        gap = np.abs(smallest_gap(system, work, driven)[:joints])
        if not ROUNDING < gap.max() < SLIGHT:
            return
        report = rank_of(dense(system, work)[1][:joints], NEARLY)
        if not report.redundant or report.free < max(1, drivers):
            return
        here, way = work.q.copy(), report.motions[0]
        for sign in (1.0, -1.0):  # where links are only stretched the gap opens fast
            work.q[:size] = here[:size] + sign * BESIDE * (scale * way)[:, None]
            beside = np.abs(_least(system, work, joints))
            moved = float(np.abs((work.q[:size] - here[:size])[:, 0] / scale).max())
            if moved < 0.3 * BESIDE * float(np.abs(way).max()) or beside.max() > SLIGHT:
                return
        part = np.abs(report.dependencies).max(axis=0)
    finally:
        work.q[:] = before
    names = dict.fromkeys(
        system.owners[system.row_table[0][n]][0].name
        for n in np.argsort(-part)
        if part[n] > TAKES_PART * part.max()
    )
    unit = system.mechanism.units.length
    most = float(gap.max()) * system.length
    raise SolveError(
        f"joints of '{system.mechanism.name}' nearly repeat each other "
        f"({listed(list(names), NAMED)}): all along the motion that they would allow a gap of "
        f"about {most:.2g} {unit} is left, so that the loops close at isolated positions only; "
        "make the lengths agree to all digits, or leave out the joint that is one too many",
        next(iter(names)),
    )


def _least(system: System, work: Work, joints: int) -> np.ndarray:
    """Move to the nearest position at which the joints, without drivers, are violated least."""
    scale = system.coordinate_units
    phi = np.zeros(joints)
    for _ in range(10):
        phi, G = dense(system, work)
        # dependent rows are left alone, so that the free motion is, too
        step = np.linalg.lstsq(G[:joints], -phi[:joints], rcond=NEARLY)[0]
        work.q[: len(scale), 0] += scale * step
        if np.abs(step).max() < 1e-12:
            break
    return np.asarray(dense(system, work)[0][:joints])


def _out_of_reach(system: System, work: Work, off: np.ndarray, t: float) -> SolveError:
    """The sentence for a driver that asks more than the links give; `off` (drivers,)."""
    n = int(off.argmax())
    driver, row = system.drivers[n], system.layout.driver_row[n]
    turns, units = driver.angular, system.mechanism.units
    requested, distance = float(work.signal[row, 0]), float(off[n])
    if turns:
        wanted, near = angle_text(requested), angle_text(float(f"{distance:.3g}"))
    else:
        wanted = f"{requested:.6g} {units.length}"
        near = f"{distance * system.length:.3g} {units.length}"
    return SolveError(
        f"driver '{driver.name}' cannot bring '{driver.bodies[1]}' to {wanted} at t = {t:g} "
        f"{units.time}: it comes within {near} where the links are stretched; check lengths and "
        "the law",
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
