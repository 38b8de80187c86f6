"""Motions in dual numbers between changes of modes, and single instants with all rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral
from mbody.analysis.dynamics.initial_step import REFINEMENTS, coordinate_sizes
from mbody.analysis.dynamics.interruptions import held_inputs, without_held
from mbody.analysis.dynamics.own_states import own_sizes
from mbody.analysis.position.assembly_analysis import SOFT, raise_user_error
from mbody.core.dual_number import DualNumber
from mbody.core.duals import TANGENTS
from mbody.core.lanes import LANES, aligned
from mbody.derivatives.formula_jumps import held
from mbody.derivatives.mode_record import ModeStretch
from mbody.errors import SolveError
from mbody.kernels.free_duals import NEXT_LENGTH, T_NOW, FreeDuals, free_duals
from mbody.kernels.layout import Layout, Work, stand_ins
from mbody.kernels.step_state import DONE
from mbody.kernels.tableaus import order_8
from mbody.solution.restart import Way
from mbody.solution.solution import Solution
from mbody.system.rank import joint_rows

__all__ = ["DualMotion", "DualInstant", "Tangents"]

Array = np.ndarray

#: Steps from one instant to the next, at most.
STEPS = 20_000
#: A motion that ends so soon after a change, as a part of the time, ends at the change itself.
AT_ONCE = 1e-12


@dataclass(frozen=True, eq=False)
class Tangents:
    """Derivatives of all that a motion is made of but its state, by some directions.

    Attributes
    ----------
    par, mass : arrays (rows, directions)
        Of the numbers of the kernels.
    anchor, phases : arrays (rows that can be on or off, …), (phases, directions)
    held : array (inputs that keep their values, directions)
    resolved : array (directions,)
        Below which tangents do not count.
    """

    par: Array
    mass: Array
    anchor: Array
    phases: Array
    held: Array
    resolved: Array

    @property
    def count(self) -> int:
        """Directions."""
        return self.par.shape[1]

    def part(self, some: slice) -> Tangents:
        """Only some of the directions."""
        return Tangents(
            self.par[:, some],
            self.mass[:, some],
            self.anchor[:, some],
            self.phases[:, some],
            self.held[:, some],
            self.resolved[some],
        )

    def none(self) -> Tangents:
        """One direction, by which nothing changes."""
        return Tangents(*(0.0 * part[..., :1] for part in vars(self).values()))


@dataclass(frozen=True, eq=False)
class DualInstant:
    """One instant in dual numbers.

    Attributes
    ----------
    t : float
    y, slope : DualNumber (numbers,)
        The state, projected on the constraints, and its derivative.
    page : DualNumber (rows,)
        As of `mbody.kernels.driven_duals.keep_duals`.
    value, rate : DualNumber (switched,)
        Of the rows that can be on or off: Φ and its rate.
    block : DualNumber (switched, coordinates)
        Φ_q of these.
    joints : DualNumber (rows, coordinates)
        Φ_q of all others.
    par, signal, blocks, formula : DualNumber
        Of the workspace.
    """

    t: float
    y: DualNumber
    slope: DualNumber
    page: DualNumber
    value: DualNumber
    rate: DualNumber
    block: DualNumber
    joints: DualNumber
    par: DualNumber
    signal: DualNumber
    blocks: DualNumber
    formula: DualNumber


class DualMotion:
    """Motions of one system in dual numbers.

    Parameters
    ----------
    run : Solution
        Of `simulate`.
    way : Way
    rates, accelerations : arrays (coordinates,)
        With which it begins, for sizes.
    with_loads : bool
        Whether pages have what each load does.
    """

    def __init__(
        self, run: Solution, way: Way, rates: Array, accelerations: Array, with_loads: bool
    ) -> None:
        self.run, self.system, self.way = run, run.system, way
        system = self.system
        self.held = held_inputs(system)
        self.layout = without_held(system.runtime(), self.held)
        self.sided: dict[tuple[tuple[int, float], ...], tuple[Layout, dict[int, float]]] = {}
        self.uni = Unilateral(system)
        self.loads = len(system.mechanism.loads) if with_loads else 0
        self.first_load = system.page_rows + 1 + 3 * len(system.drivers)
        self.rows = self.first_load + self.loads * system.coordinates
        sizes = coordinate_sizes(system.length, rates, accelerations)
        self.scale = np.concatenate([sizes, own_sizes(system), [1.0]])
        light = stand_ins(system.layout, system.mass, system.length).any()
        self.regularization = SOFT * bool(run.regularization)
        self.refinements = 1 + REFINEMENTS if light or self.regularization else 0

    def followed(
        self, stretch: ModeStretch, begin: float, y: DualNumber, tangents: Tangents, times: Array
    ) -> DualNumber:
        """Pages (instants, rows) at rising times of a stretch, from a state `begin` on.

        Raises
        ------
        SolveError
            Where a user's function failed, or the steps vanish.
        """
        values = np.zeros((len(times), self.rows))
        changes = np.zeros((len(times), self.rows, tangents.count))
        for first in range(0, max(tangents.count, 1), TANGENTS):
            part = slice(first, min(first + TANGENTS, tangents.count))
            some = DualNumber(y.value, y.tangents[:, part])
            L, work = self._layout(stretch)[0], self._work(stretch, tangents.part(part))
            free = self._called(L, work, begin, some, tangents.resolved[part], times)
            output = np.asarray(free.output)
            values[:] = output[:, :, 0]
            changes[:, :, part] = output[:, :, 1 : 1 + part.stop - part.start]
        return DualNumber(values, changes)

    def at(
        self, stretch: ModeStretch, t: DualNumber, y: DualNumber, tangents: Tangents
    ) -> DualInstant:
        """One instant in the modes of a stretch; the time may have tangents, too."""
        parts = []
        for first in range(0, max(tangents.count, 1), TANGENTS):
            part = slice(first, min(first + TANGENTS, tangents.count))
            width = slice(1, 1 + part.stop - part.start)
            L, work = self._layout(stretch)[0], self._work(stretch, tangents.part(part))
            work.time[0, width] = t.tangents[part]
            some = DualNumber(y.value, y.tangents[:, part])
            now = np.array([t.value])
            free = self._called(L, work, float(t.value), some, tangents.resolved[part], now)
            parts.append(self._instant(work, free, width))
        if len(parts) == 1:
            return parts[0]
        names = [n for n in vars(parts[0]) if n != "t"]
        return DualInstant(
            parts[0].t, *(_beside([getattr(one, n) for one in parts]) for n in names)
        )

    def _instant(self, work: Work, free: FreeDuals, width: slice) -> DualInstant:
        uni, L = self.uni, self.layout
        nodes, rows, places, columns = uni.places
        lanes = np.r_[0, width]
        v = work.v[:, lanes]
        blocks = work.block[:, lanes]
        count, n3 = len(nodes), self.system.coordinates
        parts = uni.units[rows, None] * blocks[places]
        block = np.zeros((count, n3 + 3, len(lanes)))
        block[rows, columns] = parts
        moving = _product(_dual(parts), _dual(v[columns]))
        rate = np.zeros((count, len(lanes)))
        np.add.at(rate, rows, np.column_stack([moving.value, moving.tangents]))
        rate -= uni.units[:, None] * work.nu[2 * nodes][:, lanes]
        return DualInstant(
            t=float(free.t[0]),
            y=_dual(free.y[:-1, lanes]),
            slope=_dual(free.K[0][:-1, lanes]),
            page=_dual(free.output[0][:, lanes]),
            value=_dual(uni.units[:, None] * work.phi[2 * nodes][:, lanes]),
            rate=_dual(rate),
            block=_dual(block[:, :n3]),
            joints=_dual(joint_rows(self.system, blocks)),
            par=_dual(work.par[: len(self.system.par), lanes]),
            signal=_dual(work.signal[:, lanes]),
            blocks=_dual(blocks[: 12 * L.nodes]),
            formula=_dual(work.formula[:, lanes]),
        )

    def _layout(self, stretch: ModeStretch) -> tuple[Layout, dict[int, float]]:
        """The layout in which formulas are on the sides of a stretch, with what is held."""
        if not stretch.sides:
            return self.layout, {}
        key = tuple(sorted(stretch.sides.items()))
        if key not in self.sided:
            self.sided[key] = held(self.layout, stretch.sides)
        return self.sided[key]

    def _called(
        self, L: Layout, work: Work, begin: float, first: DualNumber, resolved: Array, times: Array
    ) -> FreeDuals:
        """The kernel from a state on."""
        system, method = self.system, order_8()
        # one row more than the state has: a constant, below which tangents are not resolved
        size, stages = system.state_count + 1, len(method.B)
        y, width = aligned(size, LANES), first.tangents.shape[1]
        y[:-1, 0], y[:-1, 1 : 1 + width] = first.value, first.tangents
        y[-1, 1 : 1 + width] = resolved
        state = np.zeros(4)
        state[T_NOW] = begin
        state[NEXT_LENGTH] = 1e-4 * max(float(times[-1]) - begin, 1e-12)
        free = FreeDuals(
            t=times,
            relative=self.way.rtol,
            absolute=self.way.atol,
            regularization=self.regularization,
            refinements=self.refinements,
            rows=system.page_rows,
            loads=self.loads,
            scale=self.scale,
            state=state,
            y=y,
            K=np.zeros((stages + 1, size, LANES)),
            stage=aligned(size, LANES),
            end=aligned(size, LANES),
            error=np.zeros((2, size, LANES)),
            output=np.zeros((len(times), self.rows, LANES)),
        )
        code = free_duals(L, work, method, free, STEPS)
        raise_user_error(system)
        if code != DONE or not np.isfinite(free.output).all():
            unit = system.mechanism.units.time
            if float(times[-1]) - begin <= AT_ONCE * float(times[-1]):
                raise SolveError(
                    f"the motion of '{system.mechanism.name}' ends, but for rounding, where "
                    f"something changes, at t = {times[-1]:.6g} {unit}, as by an impact: it has no "
                    "derivatives there; move its end"
                )
            raise SolveError(
                f"the derivatives of the motion of '{system.mechanism.name}' cannot be followed "
                f"beyond t = {state[T_NOW]:.6g} {unit}, it is stiff there: keep more "
                "instants, or take differences by sweep"
            )
        return free

    def _work(self, stretch: ModeStretch, tangents: Tangents) -> Work:
        """A workspace of dual numbers, with weights of free motion, in the modes of a stretch."""
        work = self.system.work(LANES, masses=True)
        work.memory[:, 1:] = 0.0
        width, L = slice(1, 1 + tangents.count), self.system.layout
        work.par[: len(tangents.par), width] = tangents.par
        work.mass[: len(tangents.mass), width] = tangents.mass
        # weights are inverses, 1/m with the change −dm/m², of shares of the masses; what stands in
        # for a missing mass does not change
        share = 1.0 / np.bincount(L.slot_body, minlength=L.bodies)[L.slot_body]
        own = work.mass.reshape(-1, 3, LANES)[L.slot_body] * share[:, None, None]
        weights = work.weight[: 3 * L.slots].reshape(L.slots, 3, LANES)
        there = np.abs(own[:, :, 0] * weights[:, :, 0] - 1.0) < 1e-9
        slopes = -own[:, :, width] * np.square(weights[:, :, :1])
        weights[:, :, width] = np.where(there[:, :, None], slopes, 0.0)
        for place, value in self._layout(stretch)[1].items():
            work.formula[place, 0] = value
        for name, value in stretch.inputs.items():
            work.signal[self.held[name], 0] = value
        work.signal[list(self.held.values()), width] = tangents.held
        if count := len(stretch.on):
            self.uni.set_rows(work, stretch.on, stretch.sense)
            work.anchor[:count, 0], work.anchor[:count, width] = stretch.anchor, tangents.anchor
            work.par[self.uni.phase_rows, 0] = stretch.phases
            work.par[self.uni.phase_rows, width] = tangents.phases
        return work


def _dual(lanes: Array) -> DualNumber:
    """Numbers (…, lanes) of a workspace."""
    return DualNumber(lanes[..., 0].copy(), lanes[..., 1:].copy())


def _product(a: DualNumber, b: DualNumber) -> DualNumber:
    """a b, of each pair; NumPy's chain rule costs more here."""
    tangents = a.tangents * b.value[..., None] + a.value[..., None] * b.tangents
    return DualNumber(a.value * b.value, tangents)


def _beside(parts: Sequence[DualNumber]) -> DualNumber:
    """The same numbers with the tangents of all parts."""
    return DualNumber(parts[0].value, np.concatenate([one.tangents for one in parts], axis=-1))
