"""Which of the branches that meet in a singular position a motion takes, and how it begins there.

Velocities choose: a motion that moves goes on along the branch that its velocities belong to. One
that rests there, or moves along what several branches share, takes the branch on which the least
force has to be put against what the loads would do by themselves (Gauss's principle of least
constraint), and a doubt says that others are possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.dynamics.integrators import stepping
from mbody.analysis.dynamics.own_states import first_own_states
from mbody.analysis.position.tangent_space import Manifold
from mbody.analysis.singular.branch_sentences import nearest_words, place_words, undecided
from mbody.analysis.singular.branches import SAID, along, fits, frame, nearest, norm, onto, still
from mbody.analysis.singular.quadratic_cones import is_flat, tangent
from mbody.analysis.singular.singular_positions import SUSPECT, Singular, singular
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.state_derivative import initial_derivative
from mbody.kernels.step_state import BEST_CONDITIONING, TIME
from mbody.solution.doubts import Doubt
from mbody.solution.energy import causes
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["BranchStart", "choose_branch", "is_suspect"]

Array = np.ndarray

#: Rates below this part of the natural rate are rest.
STILL = 1e-9
#: Branches are equally good where their constraint differs by less than this part.
TIE = 1e-6
#: Further away than this from a singular position the rows determine the motion, though not all its
#: digits.
FAR = 1e-4
#: Forces below this part of the greatest are none.
NONE = 1e-8


@dataclass(frozen=True, eq=False)
class BranchStart:
    """How a motion begins in a singular position.

    Attributes
    ----------
    q, v, a : arrays (coordinates,)
        With their units.
    scale : array (coordinates,)
        Sizes of the coordinates.
    T0 : array (free, unknowns)
        What is free along the branch.
    away : float
        How far the start is from the singular position, in model lengths and radians.
    late : float
        How long ago the motion was there.
    growth : int
        Reactions grow as that power of one over the time since then; 0: they have a limit.
    """

    q: Array
    v: Array
    a: Array
    scale: Array
    T0: Array
    away: float
    late: float
    growth: int
    doubts: tuple[Doubt, ...] = ()


def is_suspect(system: System, start: Solution, t: float, q: Array, v: Array) -> bool:
    """Whether a closer look at a start is worth its time: rows depend on each other, or nearly."""
    if start.regularization:
        return True
    work, n = system.work(masses=True), system.coordinates
    page = np.empty((system.page_rows, 1))
    S = stepping(system.state_count, len(causes(system)), 0.0)
    S.y[:n], S.y[n : 2 * n], S.state[TIME] = q, v, t
    S.y[2 * n :] = first_own_states(system, start)
    initial_derivative(system.runtime(), work, S, 0, page)
    return not S.state[BEST_CONDITIONING] > SUSPECT


def choose_branch(
    system: System, start: Solution, state: tuple[float, Array, Array]
) -> BranchStart | None:
    """How a motion begins where its start is singular; None where it is not, or rests for good.

    Parameters
    ----------
    state : tuple (t, q, v)
        Time, positions and rates at the start.

    Raises
    ------
    SolveError
        For velocities that no motion has, or where branches are equally possible.
    """
    t, q, v = state
    if not system.rows or not is_suspect(system, start, t, q, v):
        return None
    work = system.work()
    work.time[:] = t
    laws_of_time(system.runtime(), work)
    work.q[: len(q), 0] = q
    here = singular(system, work, t)
    if here is None:
        return None
    inputs = work.signal[system.layout.input_row, 0]
    own = np.concatenate([first_own_states(system, start), inputs])
    return _Choice(system, here, (t, q, v), own).start()


class _Choice:
    def __init__(
        self, system: System, here: Singular, state: tuple[float, Array, Array], own: Array
    ) -> None:
        t, q, v = state
        self.system, self.here, self.t, self.v = system, here, t, v
        scale = here.rows.scale
        self.mass = system.mass[: system.coordinates, 0] * scale**2
        work: Work = system.work()
        work.time[:] = t
        laws_of_time(system.runtime(), work)
        work.q[: len(q), 0] = q
        manifold = Manifold(system, work, t, own)
        self.force = manifold.force(scale * here.x, v)
        top = max(manifold.largest(q), float(np.abs(self.force).max()))
        self.natural = float(np.sqrt(top / max(float(self.mass.max()), 1e-300)))

    def start(self) -> BranchStart | None:
        here, scale = self.here, self.here.rows.scale
        y = here.unknowns(self.v)
        if np.abs(self.v / scale).max() <= STILL * self.natural and here.steady:
            y = np.zeros(len(y))
        else:
            found = self._on_branch(y)
            if found is None:
                return None
            y = found
        branches = here.branches(y)
        spaces = [T for T in branches.spaces if fits(here, T)]
        if not spaces and norm(here.y) > FAR:
            return None
        if not spaces or (len(branches.odd) and y.any()):
            raise undecided(self.system, self.t)
        motions = [self._motion(T, y) for T in spaces]
        constraint = np.array([one[1] for one in motions])
        order = np.argsort(constraint)
        T, a = spaces[order[0]], motions[order[0]][0]
        # where second order does not decide there is no better way out either
        if any(self._motion(u[None], y)[1] < constraint[order[0]] for u in branches.odd):
            raise undecided(self.system, self.t)
        doubts: tuple[Doubt, ...] = ()
        if len(spaces) > 1 or len(branches.odd):
            far = [n for n in order[1:] if np.abs(motions[n][0] - a).max() > TIE * np.abs(a).max()]
            if not np.abs(a).max() > 0.0 and not far:
                return None
            tied = not far and len(spaces) > 1
            if tied or (
                far and constraint[far[0]] - constraint[order[0]] <= TIE * motions[order[0]][2]
            ):
                raise self._tied(len(spaces))
            doubts = (self._several(len(spaces), a),)
        if not y.any() and not np.abs(a).max() > 0.0:
            return None
        return self._begun(T, y, a, doubts)

    def _on_branch(self, y: Array) -> Array | None:
        """The velocities as those of a branch, where they differ from one by no more than rounding
        of digits, and by what the start is away from the singular position; None where the start is
        so far away that its rows determine the motion.
        """
        here = self.here
        away = norm(here.y)
        near = onto(here.A, y, here.clock)
        if near is not None and norm(near - y) <= (SAID + 10.0 * away) * norm(y):
            T = tangent(here.A, near)
            if not is_flat(here.A, T):
                return near
            if fits(here, T):
                free = still(T, here.clock)
                return np.asarray(near + (free @ (y - near)) @ free)
        if away > FAR:
            return None
        raise SolveError(
            f"no motion of '{self.system.mechanism.name}' has the velocities of the start at "
            f"{place_words(self.system, self.t)}: the position is singular, where joints allow "
            "those velocities to first order only"
            f"{nearest_words(self.system, here, nearest(here, y))}"
        )

    def _motion(self, T: Array, y: Array) -> tuple[Array, float, float]:
        """Accelerations (coordinates,) without units on a branch, their constraint, its size."""
        here = self.here
        bend = here.bend(T, y) if y.any() else np.zeros(len(self.mass))
        a = bend + self._along(still(T, here.clock) @ here.ways, bend)
        n = len(here.N)
        free = bend + self._along(here.N, bend) if n else bend
        off = a - free
        return a, float(off @ (self.mass * off)), float(free @ (self.mass * free)) or 1.0

    def _along(self, ways: Array, bend: Array) -> Array:
        """The accelerations along `ways` that the loads make, beside `bend`."""
        drive = ways @ (self.force - self.mass * bend)
        return np.asarray(
            np.linalg.lstsq((ways * self.mass) @ ways.T, drive, rcond=1e-12)[0] @ ways
        )

    def _begun(self, T: Array, y: Array, a: Array, doubts: tuple[Doubt, ...]) -> BranchStart:
        here, scale = self.here, self.here.rows.scale
        T0, place = still(T, here.clock), along(T, here)
        away, fast = norm(place), norm(y)
        q, ways = frame(here, T, place)
        v = (T @ y) @ ways
        left = here.N @ (self.force - self.mass * a)
        top = np.abs(here.N * self.force).max(initial=0.0) + np.abs(here.N * self.mass * a).max()
        growth = 0
        if np.abs(left).max(initial=0.0) > NONE * top:
            growth = 1 if y.any() else 2
        if growth:
            joints = tuple(joint.name for joint in self.system.mechanism.joints)
            why = (
                "the reactions grow without bound towards the singular position at "
                f"{place_words(self.system, self.t)}: they are not given there"
            )
            doubts = (*doubts, Doubt("incomplete", why, self.t, joints))
        late = away / fast * np.sign(place @ y) if fast and away else 0.0
        return BranchStart(scale * q, scale * v, scale * a, scale, T0, away, late, growth, doubts)

    # -- sentences ----------------------------------------------------------------------------

    def _tied(self, count: int) -> SolveError:
        return SolveError(
            f"the motion of '{self.system.mechanism.name}' is not determined at "
            f"{place_words(self.system, self.t)}: the position is singular, {count} branches of "
            "the motion meet there, and the loads drive it along several of them alike; give a "
            "rate that chooses the branch, or begin a little beside"
        )

    def _several(self, count: int, a: Array) -> Doubt:
        turning = np.abs(a.reshape(-1, 3)).max(axis=1)
        bodies = self.system.mechanism.bodies
        names = [bodies[n].name for n in np.flatnonzero(turning > 1e-6 * turning.max())]
        return Doubt(
            "singular",
            f"it begins in a singular position at {place_words(self.system, self.t)}, where "
            f"{count} branches of the motion meet that have its velocities; the one with the least "
            "constraint (Gauss) is taken: give a rate that chooses the branch, or begin a little "
            "beside",
            self.t,
            tuple(names),
        )
