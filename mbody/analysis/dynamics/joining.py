"""Several motions, each of which goes on from the one before, as one result."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbody.errors import ModelError
from mbody.kernels.output import PER_PRIMITIVE
from mbody.solution.certificate import as_reported, changed
from mbody.solution.energy import account, causes
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["SAME_PARTS", "joined", "phase_rows", "same_motion", "sizes", "stops_of", "then"]

Array = np.ndarray

#: What a motion depends on; what else a description has may differ.
SAME_PARTS: tuple[str, ...] = ("units", "ground", "bodies", "joints", "couplings", "drivers")
SAME_PARTS += ("loads", "curves", "states", "controllers")

#: Part of its size by which a state may be apart from the one that it goes on from: it is projected
#: on the constraints again, which are satisfied to rounding.
SAME_STATE = 1e-9


def stops_of(run: Solution) -> list[str]:
    """Names of the stops whose impacts are in the account of energy."""
    known = causes(run.system)
    return [name for name in (run.energy.by if run.energy else ()) if name not in known]


def sizes(run: Solution, state: Array) -> Array:
    """What differences of positions and rates (2·coordinates,) are compared with."""
    length, n = max(run.system.length, 1.0), run.system.coordinates
    greatest = [np.abs(part).max(initial=0.0) for part in (state[:n], state[n:])]
    return np.repeat(length + np.array(greatest), n)


def same_motion(one: System, other: System) -> bool:
    """Whether motions of two systems are of the same mechanism; inputs may have other histories."""
    if one is other:
        return True
    inputs = {each.name for system in (one, other) for each in system.mechanism.inputs}
    ours, theirs = (
        {k: v for k, v in system.values.items() if k.partition(".")[0] not in inputs}
        for system in (one, other)
    )
    names = [[(each.name, each.dimension) for each in s.mechanism.inputs] for s in (one, other)]
    return (
        names[0] == names[1]
        and all(
            getattr(one.mechanism, part) == getattr(other.mechanism, part) for part in SAME_PARTS
        )
        and ours.keys() == theirs.keys()
        and all(np.array_equal(ours[name], theirs[name]) for name in ours)
    )


def then(first: Solution, *later: Solution) -> Solution:
    """Motions that follow each other as one; see `Solution.then`.

    Raises
    ------
    ModelError
        For what is no motion of one mechanism, and where one does not begin where the other ended.
    """
    runs = [first, *later]
    for run in runs:
        if not isinstance(run, Solution) or run.analysis != "simulate":
            what = run.analysis if isinstance(run, Solution) else type(run).__name__
            raise ModelError(
                f"then joins motions of simulate, not a result of {what}: simulate it with "
                "start=run"
            )
        if not len(run):
            raise ModelError("then joins motions that have instants: one of them has none")
    for before, after in itertools.pairwise(runs):
        unit = before.mechanism.units.time
        if not same_motion(before.system, after.system):
            raise ModelError(
                f"'{after.mechanism.name}' is not the mechanism of the motion before, or has other "
                "numbers: join motions of one system, whose inputs alone may differ"
            )
        end, begin = float(before.t[-1]), float(after.t[0])
        rows = slice(0, 2 * before.system.coordinates)
        left, right = before.record.table(rows)[-1], after.record.table(rows)[0]
        apart = float((np.abs(left - right) / sizes(before, left)).max(initial=0.0))
        if begin != end or not apart <= SAME_STATE:
            how = (
                f"begins at t = {begin:.6g} {unit}, the one before ends at {end:.6g} {unit}"
                if begin != end
                else f"begins at t = {begin:.6g} {unit} in another position or at other rates, "
                f"{apart:.2g} of their size apart"
            )
            raise ModelError(
                f"a motion {how}: simulate it with start=run, and keep its first instant"
            )
    if not later:
        return first
    stops = list(dict.fromkeys(name for run in runs for name in stops_of(run)))
    whole = joined(runs[-1].system, runs, runs[-1].released, stops)
    known = all(run.begun for run in runs)
    return changed(whole, begun=tuple(one for run in runs for one in run.begun) if known else ())


def joined(
    system: System,
    found: Sequence[Solution],
    released: Mapping[str, float],
    stops: Sequence[str],
    times: Array | None = None,
) -> Solution:
    """One result of all phases, of which these times are kept, or all; a released driver has no
    effort.
    """
    last = found[-1]
    whole = causes(system, stops)
    t, pages, works, kept = [], [], [], []
    before = np.zeros(len(whole))
    for run in found:
        keep = np.ones(len(run), dtype=bool) if times is None else np.isin(run.t, times)
        if run is last:
            keep[-1] = True
        else:
            keep &= run.t < run.t[-1]
        names = causes(run.system, stops)
        places = [whole.index(name) for name in names]
        work = np.tile(before, (len(run), 1))
        for place, name in zip(places, names, strict=True):
            work[:, place] += run.energy.by.get(name, 0.0) if run.energy else 0.0
        before = work[-1].copy()
        t.append(run.t[keep])
        pages.append(_widened(system, run)[keep])
        works.append(work[keep])
        kept.append(keep)
    output, gained = np.concatenate(pages), np.concatenate(works)
    certified = [as_reported(run) for run in found]
    stats = {
        key: sum((run.stats or {}).get(key, 0) for run in found)
        for run in found
        for key in run.stats or {}
    }
    nearest = min(
        (run.branch for run in found if run.branch is not None),
        key=lambda one: one.least,
        default=None,
    )
    return replace(
        last,
        system=system,
        t=np.concatenate(t),
        record=Record([output], len(output), batch=False),
        energy=account(system, output[:, :, 0], gained, stops),
        status=certified[-1].status,
        doubts=tuple(dict.fromkeys(doubt for one in certified for doubt in one.doubts)),
        notes=tuple(dict.fromkeys(note for one in certified for note in one.notes)),
        stats=stats,
        released=released,
        events=tuple(one for run in found for one in run.events),
        branch=nearest,
        modes={
            name: [
                word
                for run, keep in zip(found, kept, strict=True)
                for word in _kept(run, name, keep)
            ]
            for name in last.modes
        },
    )


def _kept(run: Solution, name: str, keep: Array) -> list[str]:
    """The modes of a contact at the instants that are kept."""
    return [run.modes[name][k] for k in np.flatnonzero(keep).tolist()]


def phase_rows(system: System, part: System) -> tuple[Array, Array]:
    """Rows of the pages of the whole system, and those of a phase without some of its drivers that
    they are.
    """
    n3 = 3 * system.coordinates
    here = {(element.name, number): e for e, (element, number) in enumerate(system.owners)}
    each = np.arange(PER_PRIMITIVE)
    whole, own = [np.arange(n3)], [np.arange(n3)]
    for rows, one_of in ((whole, system), (own, part)):
        for some in (one_of.friction_rows, one_of.own_rows):
            rows.append(np.arange(some.start, some.stop))
    for e, (element, number) in enumerate(part.owners):
        whole.append(n3 + PER_PRIMITIVE * here[element.name, number] + each)
        own.append(n3 + PER_PRIMITIVE * e + each)
    return np.concatenate(whole), np.concatenate(own)


def _widened(system: System, run: Solution) -> Array:
    """Pages of a phase as those of the whole system."""
    block = run.record.blocks[0]
    wide = np.zeros((len(run), system.page_rows, 1))
    whole, own = phase_rows(system, run.system)
    wide[:, whole] = block[:, own]
    return wide
