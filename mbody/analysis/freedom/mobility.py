"""The analysis `mobility`: how many ways a mechanism can move, which, and what holds it twice."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.analysis.freedom.free_motions import FreeMotion, components, free_motions
from mbody.analysis.freedom.one_sided import one_sided
from mbody.analysis.freedom.single_design import single_design, single_time
from mbody.analysis.position.assembly_analysis import DEAD, closed
from mbody.analysis.position.closed_position import ClosedPosition
from mbody.core.presentation import present
from mbody.kernels.layout import Work
from mbody.model.body import Guesses
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.remarks import left_out, remarks
from mbody.quantities.units import UnitSystem
from mbody.solution.heading import heading, unit_symbols
from mbody.system.rank import DENSE, Rank, dense, rank_of, too_large
from mbody.system.system import System

__all__ = ["Count", "Mobility", "mobility"]

#: Part of a dependency below which a row has no part in it.
SMALL = 1e-6
#: Rows up to which positions nearby are looked at.
LOOKED = 300
#: Step to a position nearby, in model lengths and radians, and how many are tried.
NEARBY, TRIES = 0.05, 6
#: Iterations by which joints are closed again, and what counts as closed.
SETTLE, SETTLED = 40, 1e-12


@dataclass(frozen=True)
class Count:
    """Degrees of freedom by formula and by rank, of the joints alone or with the drivers fixed.

    Attributes
    ----------
    rows : int
        Scalar constraints.
    gruebler : int
        3·bodies − rows: what Grübler's formula counts.
    rank : int or None
        Independent rows at the closed position; None where it was not computed.
    rank_nearby : int or None
        The greatest rank at closed positions nearby; more than `rank` where this one is singular.
    freedom, redundant : int or None
        Degrees of freedom and rows too many, here: freedom = gruebler + redundant.
    """

    rows: int
    gruebler: int
    rank: int | None
    rank_nearby: int | None

    @property
    def freedom(self) -> int | None:
        """Degrees of freedom by the rank."""
        return None if self.rank is None else self.gruebler + self.rows - self.rank

    @property
    def redundant(self) -> int | None:
        """Rows beyond the independent ones."""
        return None if self.rank is None else self.rows - self.rank

    @property
    def singular(self) -> bool:
        """Whether the rank is lower here than at positions nearby."""
        return None not in (self.rank, self.rank_nearby) and self.rank != self.rank_nearby


@dataclass(frozen=True, eq=False)
class Mobility:
    """What `mobility` found; ``print`` shows it, `data` makes a plain dict of it.

    Attributes
    ----------
    mechanism : str
        Title.
    units : UnitSystem
        Of the rates.
    t : float
        Time at which the drivers were taken.
    bodies, joints, couplings, drivers, loops : int
        Moving links; independent loops, of joints, and of couplings between bodies that are joined
        without them.
    of_joints, driven : Count
        Without the drivers, and with the drivers fixed.
    redundant : dict
        By joint, where some can be spared: how many of its rows could be removed without setting
        anything free. Of several joints that share one dependency any one is meant, not all.
    motions, driven_motions : tuple of FreeMotion or None
        Free motions without the drivers and with the drivers fixed; None where they were not
        computed.
    one_sided : dict
        Names by kind of what holds in one sense only: "contacts", "ropes", "stops", "freewheels",
        "limits" of joints, counted as open; "joints" that can separate, counted as closed.
    notes : tuple of str
        Singular positions, loose parts and what was not computed, as sentences.

    Examples
    --------
    >>> import mbody
    >>> found = mbody.mobility(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> found.of_joints.freedom, found.driven.freedom, found.redundant
    (1, 0, {})
    """

    mechanism: str
    units: UnitSystem
    t: float
    bodies: int
    joints: int
    couplings: int
    drivers: int
    loops: int
    of_joints: Count
    driven: Count
    redundant: dict[str, int]
    motions: tuple[FreeMotion, ...] | None = field(repr=False)
    driven_motions: tuple[FreeMotion, ...] | None = field(repr=False)
    one_sided: dict[str, tuple[str, ...]] = field(default_factory=dict, repr=False)
    notes: tuple[str, ...] = ()

    @property
    def freedom(self) -> int | None:
        """Degrees of freedom with the drivers fixed; None where the rank was not computed."""
        return self.driven.freedom

    def data(self) -> dict[str, Any]:
        """Everything as a plain dict of numbers, text, lists and dicts, ready for JSON."""
        plain = dataclasses.asdict(self)
        for name in ("mechanism", "units", "notes"):
            del plain[name]
        plain = heading(self.mechanism, "check", unit_symbols(self.units), self) | plain
        for name in ("of_joints", "driven"):
            count: Count = getattr(self, name)
            plain[name] |= {
                "freedom": count.freedom,
                "redundant": count.redundant,
                "singular": count.singular,
            }
        for name in ("motions", "driven_motions"):
            found = getattr(self, name)
            plain[name] = None if found is None else [motion.data() for motion in found]
        return plain

    def __str__(self) -> str:
        return str(present("sheet", self))


def mobility(
    model: Mechanism | System,
    t: float = 0.0,
    *,
    guess: Guesses | None = None,
) -> Mobility:
    """Degrees of freedom, redundant constraints and free motions: Grübler's count and the truth.

    Grübler: F = 3·bodies − rows. True at a closed position: F = 3·bodies − rank Φ_q.

    Parameters
    ----------
    model : Mechanism or System
        With or without drivers.
    t : float
        Time at which the laws of the drivers are taken.
    guess : mapping, optional
        By body, instead of its own guess: angle [rad], or (x, y, angle) of the link axes.

    Returns
    -------
    Mobility
        Counts without the drivers and with the drivers fixed, rows that can be spared by joint,
        free motions in words.

    Raises
    ------
    ModelError
        For a time or guess that is none, or a batch of designs.
    SolveError
        When the loops cannot close: with the smallest gap and where.

    Notes
    -----
    The rank is found by a singular value decomposition, up to 1500 rows; beyond, it is given where
    elimination shows all rows to be independent. Up to 300 rows positions nearby distinguish a
    singular position from redundant constraints.

    Examples
    --------
    >>> import mbody
    >>> report = mobility(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> report.of_joints.freedom, report.freedom
    (1, 0)
    >>> report.motions[0].words.partition(" (")[0]
    'crank turns about O2, coupler and rocker follow'
    """
    system = single_design("mobility", model)
    time = single_time("mobility", system, t)
    return _Report(system, closed(system, time, {}, guess), time).mobility()


def _loops(mechanism: Mechanism) -> int:
    """Independent loops: a coupling closes one where it joins nothing that was apart."""
    parts = [len(components(mechanism, n)) for n in range(len(mechanism.couplings) + 1)]
    closed = sum(one == other for one, other in pairwise(parts))
    return len(mechanism.joints) - len(mechanism.bodies) - 1 + parts[0] + closed


class _Report:
    """Puts the report of one closed position together."""

    def __init__(self, system: System, start: ClosedPosition, t: float) -> None:
        self.system, self.start, self.t = system, start, t
        self.mechanism = system.mechanism
        self.work: Work = start.work
        self.joint_rows = system.rows - len(system.drivers)
        self.notes = [*start.notes, *remarks(self.mechanism, self.system.plans)]
        self.notes += left_out(self.mechanism, "mobility")

    def mobility(self) -> Mobility:
        """Counts, ranks, motions and sentences."""
        mechanism = self.mechanism
        parts = components(mechanism)
        self.notes += [f"not joined to the ground: {listed(part)}" for part in parts[1:]]
        ranks = self._ranks()
        joints, driven = ranks or (None, None)
        nearby = self._nearby(*ranks) if ranks else (None, None)
        of_joints = self._count(self.joint_rows, joints, nearby[0])
        with_drivers = self._count(self.system.rows, driven, nearby[1])
        if ranks:
            self._say_singular(of_joints, with_drivers)
            self._say_repeated(*ranks, with_drivers)
        motions = self._motions(joints)
        return Mobility(
            mechanism=mechanism.name,
            units=mechanism.units,
            t=self.t,
            bodies=len(mechanism.bodies),
            joints=len(mechanism.joints),
            couplings=len(mechanism.couplings),
            drivers=len(mechanism.drivers),
            loops=_loops(mechanism),
            of_joints=of_joints,
            driven=with_drivers,
            redundant=self._spared(joints) if joints else {},
            motions=motions,
            driven_motions=motions if driven is joints else self._motions(driven),
            one_sided=one_sided(mechanism),
            notes=tuple(self.notes),
        )

    def _ranks(self) -> tuple[Rank, Rank] | None:
        """Of the joints alone, and with the drivers; None for a mechanism too large."""
        if too_large(self.system):
            self.notes.append(
                f"{self.system.rows} rows of {self.system.coordinates} coordinates are too many "
                f"for a rank report (up to {DENSE} rows): free motions are not listed"
            )
            return None
        G = dense(self.system, self.work)[1]
        joints = rank_of(G[: self.joint_rows], DEAD)
        return joints, rank_of(G, DEAD) if self.system.drivers else joints

    def _count(self, rows: int, found: Rank | None, nearby: int | None) -> Count:
        rank = found.rank if found else None
        if found is None and not self.start.regularization:
            rank = nearby = rows  # elimination met no dependent row
        return Count(rows, self.system.coordinates - rows, rank, nearby)

    def _motions(self, found: Rank | None) -> tuple[FreeMotion, ...] | None:
        if found is None:
            return None
        return free_motions(self.system, self.work.q[:, 0], found.motions)

    def _spared(self, joints: Rank) -> dict[str, int]:
        """By joint, how many of its rows the others imply: its part in the dependencies."""
        primitive = self.system.row_table[0][: self.joint_rows]
        found = {}
        for joint in (*self.mechanism.joints, *self.mechanism.couplings):
            part = joints.dependencies[:, np.isin(primitive, self.system.primitives_of[joint.name])]
            count = int(np.linalg.matrix_rank(part, tol=SMALL)) if part.size else 0
            if count:
                found[joint.name] = count
        return found

    # -- positions nearby ---------------------------------------------------------------------

    def _nearby(self, joints: Rank, driven: Rank) -> tuple[int | None, int | None]:
        """The greatest ranks at closed positions nearby, to which the joints let it move."""
        best = joints.rank, driven.rank
        if not driven.redundant or not joints.free:
            return best  # no higher rank is possible, or there is no other position
        if driven.rows > LOOKED:
            return None, None
        scale = self.system.coordinate_units
        here, random = self.work.q.copy(), np.random.default_rng(0)
        size, reached = len(scale), False
        for _ in range(TRIES):
            step = random.normal(size=joints.free) @ joints.motions
            self.work.q[:size, 0] = here[:size, 0] + NEARBY * scale * step / np.linalg.norm(step)
            closes = self._settle(scale)
            far = np.linalg.norm((self.work.q[:size, 0] - here[:size, 0]) / scale)
            if closes and far > 0.2 * NEARBY:
                G = dense(self.system, self.work)[1]
                ranks = rank_of(G[: self.joint_rows], DEAD).rank, rank_of(G, DEAD).rank
                best = max(best[0], ranks[0]), max(best[1], ranks[1])
                reached = True
        self.work.q[:] = here
        if not reached:
            self.notes.append(
                "the free motion is infinitesimal: the joints allow it to first order, but no "
                "position nearby; the structure is shaky"
            )
        return best

    def _settle(self, scale: np.ndarray) -> bool:
        """Close the joints from the position in the workspace; whether they close."""
        rows = self.joint_rows
        for _ in range(SETTLE):
            phi, G = dense(self.system, self.work)
            if np.abs(phi[:rows]).max() < SETTLED:
                return True
            # what is nearly dependent is left alone
            step = np.linalg.lstsq(G[:rows], -phi[:rows], rcond=1e-4)[0]
            self.work.q[: len(scale), 0] += scale * step
        return False

    # -- sentences ----------------------------------------------------------------------------

    def _say_singular(self, joints: Count, driven: Count) -> None:
        if joints.singular:
            self.notes.append(
                f"singular position, a change point: the rank of the joints is {joints.rank} here "
                f"and {joints.rank_nearby} nearby; branches of the motion meet"
            )
        elif driven.singular:
            names = listed(driver.name for driver in self.mechanism.drivers)
            self.notes.append(
                f"singular position, a dead centre: with the drivers fixed the rank is "
                f"{driven.rank} here and {driven.rank_nearby} nearby; {names} cannot drive it "
                "through here"
            )

    def _say_repeated(self, joints: Rank, driven: Rank, count: Count) -> None:
        """Name drivers that repeat what joints and other drivers impose."""
        if count.singular or driven.redundant == joints.redundant:
            return
        part = np.abs(driven.dependencies[:, self.joint_rows :]).max(axis=0)
        pairs = zip(self.mechanism.drivers, part, strict=True)
        names = [driver.name for driver, size in pairs if size > SMALL]
        surplus = driven.redundant - joints.redundant
        self.notes.append(
            f"drivers repeat each other or the joints ({listed(names)}): remove {surplus} of them"
        )
