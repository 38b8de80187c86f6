"""Springs that balance weights and other loads in all positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import analyse_with
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core.least_squares import nonnegative
from mbody.core.presentation import Presented
from mbody.core.tolerances import FORCE_NONE_BALANCE, SINGULAR_VALUE_ZERO, SPRING_PUSHED
from mbody.errors import ModelError, brief
from mbody.model.closed_mechanism import with_changed
from mbody.model.element import listed, takes_one_design, unknown_name
from mbody.model.loads import Spring, TorsionSpring
from mbody.model.mechanism import Mechanism
from mbody.solution.declared_result import Heading, Sentence, Value
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

Array = np.ndarray

STILL = " does not move: what it holds need not be balanced"


@dataclass(frozen=True, eq=False, repr=False)
class SpringBalance(Inherited, Presented):
    """Stiffnesses, and what they do.

    Attributes
    ----------
    stiffness : dict
        By name of the spring, [force/length] or of a torsion spring [force·length]; none is
        negative.
    complete : bool
        Whether no effort is left in any of the positions.
    left : float
        Effort that is left, root of the mean square, as a part of what it was without the springs.
    reason : str
        Why it is not complete; empty where it is.
    before, after : dict
        By driver that moves the effort that the loads need at rest, without and with the springs:
        arrays (instants,).
    run : Solution
        The positions with springs, of `statics`.
    mechanism : Mechanism
        The description with these springs.
    system : System
        The same with the numbers of the system that was given.

    Examples
    --------
    >>> import mbody
    >>> arm = mbody.Mechanism("arm", ground={"top": (0, 0.4)})
    >>> arm.add(mbody.Body("arm", mass=2.0, inertia=0, cg=(0.5, 0), points={"P": (0.3, 0)}))
    >>> arm.add(mbody.Revolute("O", "ground", "arm"), mbody.Gravity("g", y=-9.81))
    >>> arm.add(mbody.AngleDriver("hold", "arm", mbody.laws.ConstantSpeed(0.0, 1.0)))
    >>> spring = mbody.Spring("spring", "ground.top", "arm.P", stiffness=1.0, free_length=0)
    >>> found = mbody.engineering.spring_balance(arm, [spring], turn=True)
    >>> round(float(abs(found.before["hold"]).max()), 6), found.complete
    (9.81, True)
    """

    stiffness: dict[str, float] = field(default_factory=dict)
    complete: bool = False
    left: float = 0.0
    reason: str = ""
    before: dict[str, Array] = field(default_factory=dict)
    after: dict[str, Array] = field(default_factory=dict)
    run: Any = None
    mechanism: Any = None
    system: Any = None

    analysis_name = "balance"
    declared = (
        Heading("SPRING", "stiffness"),
        Value("stiffness", "{}", lambda found: found.dimensions),
        "complete left reason",
        Heading("GREATEST EFFORT"),
        Value(
            "peaks",
            "{}",
            lambda found: found.dimensions,
            floor=lambda found: (
                FORCE_NONE_BALANCE
                * max((one["before"] for one in found.peaks.values()), default=0.0)
            ),
            columns=(Value("before", "before"), Value("after", "after")),
        ),
        Sentence(
            lambda found: (
                "complete balance"
                if found.complete
                else f"{100.0 * found.left:.3g} % is left (rms)"
            )
        ),
    )

    @property
    def peaks(self) -> dict[str, dict[str, float]]:
        """The greatest effort of every driver before and after."""
        rows = {"before": self.before, "after": self.after}
        return {
            name: {when: float(np.abs(row[name]).max(initial=0.0)) for when, row in rows.items()}
            for name in self.before
        }

    @property
    def dimensions(self) -> dict[str, str]:
        """What the stiffness of every spring and the effort of every driver measures."""
        efforts = {one.name: one.angular for one in self.mechanism.drivers}
        springs = {name: isinstance(self.mechanism[name], Spring) for name in self.stiffness}
        return {name: "torque" if angular else "force" for name, angular in efforts.items()} | {
            name: "stiffness" if straight else "torsion stiffness"
            for name, straight in springs.items()
        }

    def __repr__(self) -> str:
        how = "complete" if self.complete else f"{self.left:.3g} left"
        return f"SpringBalance({listed(self.stiffness)}: {how})"


def spring_balance(
    model: Mechanism | System,
    springs: Sequence[str | Spring | TorsionSpring],
    against: Sequence[str] | None = None,
    **options: Any,
) -> SpringBalance:
    """Stiffnesses of springs that balance weights and other loads completely, or best: static
    balancing, gravity compensation.

    Parameters
    ----------
    model : Mechanism or System
        Driven, of one design; with a `Gravity`, or other loads that are to be balanced.
    springs : list
        Names of springs of the mechanism, or `Spring` and `TorsionSpring` elements to be added.
        Their places, free lengths (or angles) and preloads are kept, their stiffnesses are found.
    against : list of str, optional
        Names of the loads that are to be balanced; by default all others.
    **options
        The positions: ``t``, ``drive``, ``turn``, ``instants``, ``guess`` as of `statics`, or
        ``at``, ``over`` as of `Instants`; by default those of the mechanism.

    Returns
    -------
    SpringBalance
        Stiffnesses, efforts before and after, what is left, and the mechanism with the springs.

    Raises
    ------
    ModelError
        For a spring or a load that there is not, a spring with a law of its own, loads that need no
        effort, fewer positions than springs, and a batch.
    SolveError
        As of `statics`.

    Notes
    -----
    The effort of every driver at rest is linear in the stiffnesses: e = e₀ + Σ k_i e_i. That with
    the least mean square over the positions and k ≥ 0 is a problem of non-negative least squares
    (Lawson and Hanson); it is zero everywhere where the potential energy of loads and springs
    is the same in all positions. Efforts of drivers of lengths count by the model length.
    Friction is left out, and drivers that stand still in all positions.

    Source: J. L. Herder, *Energy-free systems*, thesis, Delft 2001: of an arm with a spring of no
    free length, k a b = m g l.

    Examples
    --------
    >>> import mbody
    >>> from math import pi
    >>> arm = mbody.Mechanism("arm", ground={"top": (0, 0.4)})
    >>> arm.add(
    ...     mbody.Body("arm", mass=2.0, inertia=0, cg=(0.5, 0), points={"P": (0.3, 0)}),
    ...     mbody.Revolute("O", "ground", "arm"),
    ...     mbody.AngleDriver("hold", "arm", mbody.laws.ConstantSpeed(0.0, 1.0)),
    ...     mbody.Gravity("g", y=-9.81),
    ... )
    >>> spring = mbody.Spring("spring", "ground.top", "arm.P", stiffness=1.0, free_length=0)
    >>> found = mbody.engineering.spring_balance(arm, [spring], turn=True)
    >>> round(found.stiffness["spring"], 9), found.complete
    (81.75, True)
    """
    described, names = _described(model, springs)
    system = _system(model, described)
    loads = _loads(system, names, against)
    empty = {f"{name}.stiffness": 0.0 for name in names}
    run = analyse_with(system.with_values(empty), "statics", options, "spring_balance")
    moving = [one for one in system.independent_drivers if np.ptp(run.driven(one.name)[0]) > 0.0]
    drivers = [one.name for one in moving]
    if len(run.t) * len(drivers) < len(names):
        raise ModelError(
            f"spring_balance: {len(names)} stiffnesses need at least as many efforts of drivers "
            f"that move, and there are {len(run.t) * len(drivers)}: analyse more positions, as "
            "with turn=True"
        )
    before = {name: _effort(run, name, [*loads, *names]) for name in drivers}
    sizes = [1.0 if getattr(one, "angular", False) else system.length for one in moving]
    present = _row(before, sizes)
    if not present.any():
        raise ModelError(
            f"spring_balance: without springs {listed(drivers)} needs no effort in these "
            "positions: there is nothing to balance"
        )
    columns = _columns(run, names, drivers, sizes, options)
    columns = _without_rounding(system, columns, names)
    found, notes = _solved(columns, present, names)
    still = [one.name for one in system.independent_drivers if one not in moving]
    if still:
        notes.append(listed(still) + STILL)
    stiffness = dict(zip(names, found, strict=True))
    made = with_changed(
        described,
        [replace(described[name], stiffness=k) for name, k in stiffness.items()],  # type: ignore[call-arg]
        ["stiffness"],
    )
    whole = system.with_values({f"{name}.stiffness": k for name, k in stiffness.items()})
    last = analyse_with(whole, "statics", options, "spring_balance")
    after = {name: _effort(last, name, [*loads, *names]) for name in drivers}
    left = float(np.linalg.norm(_row(after, sizes)) / np.linalg.norm(present))
    complete = left <= FORCE_NONE_BALANCE
    reason = "" if complete else _reason(left, stiffness, columns, present)
    return SpringBalance(
        stiffness=stiffness,
        complete=complete,
        left=left,
        reason=reason,
        before=before,
        after=after,
        run=last,
        mechanism=made,
        system=whole,
        **inherited(last, of=drivers, notes=[*notes, *([reason] if reason else [])]),
    )


# -- the question ------------------------------------------------------------------------------


def _described(
    model: Mechanism | System, springs: Sequence[str | Spring | TorsionSpring]
) -> tuple[Mechanism, list[str]]:
    """The description with the springs that are new, and the names of all that are meant."""
    machine = model if isinstance(model, Mechanism) else as_system(model).mechanism
    if isinstance(springs, str | Spring | TorsionSpring):
        springs = [springs]
    if not isinstance(springs, Sequence) or not springs:
        raise ModelError(
            'spring_balance: springs must be names such as ["spring"], or Spring elements, not '
            f"{brief(springs)}"
        )
    made, names = machine.copied(), []
    for one in springs:
        if isinstance(one, Spring | TorsionSpring):
            made.add(one)
            names.append(one.name)
        else:
            names.append(_known(machine, one))
    for name in names:
        if names.count(name) > 1:
            raise ModelError(f"spring_balance: '{name}' is given twice: give it once", name)
        if made[name].law is not None:  # type: ignore[attr-defined]
            raise ModelError(
                f"'{name}' has a law of its own, spring_balance finds stiffnesses: give it one in "
                "its place",
                name,
            )
    return made, names


def _known(machine: Mechanism, name: Any) -> str:
    there = [one.name for one in machine.loads if isinstance(one, Spring | TorsionSpring)]
    if name not in there:
        known = f"there are: {listed(there)}" if there else "there are none: give Spring elements"
        raise ModelError(f"spring_balance: there is no spring {brief(name)} ({known})", str(name))
    return str(name)


def _system(model: Mechanism | System, described: Mechanism) -> System:
    """The system of the description with the numbers that were given."""
    system = assemble(described)
    if isinstance(model, System):
        takes_one_design("spring_balance", model.batch)
        others = {k: v for k, v in model.values.items() if system.values[k] != v}
        system = system.with_values(others) if others else system
    return system


def _loads(system: System, springs: list[str], against: Sequence[str] | None) -> list[str]:
    """The loads that are to be balanced."""
    there = [one.name for one in system.mechanism.loads if one.name not in springs]
    if against is None:
        return there
    wanted = [against] if isinstance(against, str) else list(against)
    for name in wanted:
        if name not in there:
            raise unknown_name("spring_balance: load", name, there, use=" to balance")
    return wanted


# -- linear equations ----------------------------------------------------------------------------


def _effort(run: Solution, driver: str, loads: Sequence[str]) -> Array:
    """Effort of a driver due to some loads, (instants,)."""
    parts = run.breakdown(driver)
    return np.asarray(sum((parts[name] for name in loads), np.zeros(len(run.t))))


def _row(efforts: dict[str, Array], sizes: list[float]) -> Array:
    """Efforts of all drivers at all instants, of torques; the ends of a revolution count half."""
    weights = np.ones(len(next(iter(efforts.values()))))
    if len(weights) > 1:
        weights[[0, -1]] = np.sqrt(0.5)
    return np.concatenate(
        [weights * size * one for size, one in zip(sizes, efforts.values(), strict=True)]
    )


def _columns(
    run: Solution, names: list[str], drivers: list[str], sizes: list[float], options: Any
) -> Array:
    """Efforts by each spring at unit stiffness, without preload: (rows, springs)."""
    plain = {f"{name}.stiffness": 1.0 for name in names}
    plain |= {f"{name}.preload": 0.0 for name in names}
    one = analyse_with(run.system.with_values(plain), "statics", options, "spring_balance")
    return np.column_stack(
        [_row({d: _effort(one, d, [name]) for d in drivers}, sizes) for name in names]
    )


def _without_rounding(system: System, columns: Array, names: list[str]) -> Array:
    """The columns, zero of springs that act on no driver: that keep their lengths, or have none."""
    machine, rows = system.mechanism, len(columns)
    # a unit stiffness gives a torque of the square of a length at most, or of an angle
    size = [1.0 if isinstance(machine[n], TorsionSpring) else system.length**2 for n in names]
    acts = np.linalg.norm(columns, axis=0) > SINGULAR_VALUE_ZERO * np.sqrt(rows) * np.array(size)
    return np.where(acts, columns, 0.0)


def _solved(columns: Array, present: Array, names: list[str]) -> tuple[list[float], list[str]]:
    """Non-negative stiffnesses, and what is to be said of them."""
    sizes = np.linalg.norm(columns, axis=0)
    notes = [
        f"'{name}' acts on no driver: its stiffness is of no effect"
        for name, size in zip(names, sizes, strict=True)
        if not size
    ]
    scaled = columns / np.where(sizes > 0.0, sizes, 1.0)
    _, values, directions = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    alike = directions[int((values > SINGULAR_VALUE_ZERO * values.max()).sum()) :]
    several = [
        n
        for n in np.flatnonzero(sizes)
        if np.abs(alike[:, n]).max(initial=0.0) > SINGULAR_VALUE_ZERO
    ]
    if several:
        names = [names[n] for n in several]
        notes.append(f"other stiffnesses of {listed(names)} do as much: they act alike")
    return nonnegative(columns, -present).tolist(), notes


def _reason(left: float, stiffness: dict[str, float], columns: Array, present: Array) -> str:
    """Why something is left."""
    head = f"springs {listed(stiffness)} leave {100.0 * left:.3g} % of the effort (rms)"
    pushing = [name for name, k in stiffness.items() if k == 0.0]
    free = np.linalg.lstsq(columns, -present, rcond=SINGULAR_VALUE_ZERO)[0]
    residual = float(np.linalg.norm(present + columns @ free) / np.linalg.norm(present))
    if pushing and residual < SPRING_PUSHED * left:
        return (
            f"{head}: {listed(pushing)} would have to push, which would leave "
            f"{100.0 * residual:.3g} %: other places may do it"
        )
    return f"{head}: other places or free lengths may leave less"
