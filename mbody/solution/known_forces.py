"""What is known of forces, and so of all that is made of them.

Of the same motion other forces are taken that no equation excludes. What changes with them is not
unique, whatever it is made by: a formula of histories, or any function of a result. A third set,
which differs from the first by rounding, says which changes count.
"""

from __future__ import annotations

import contextlib
import contextvars
import functools
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, ParamSpec, TypeVar

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.presentation import present
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.laws import MeasuredFormula
from mbody.model.element import listed
from mbody.model.simulation import Measure
from mbody.solution.contact_forces import acting_contacts, friction_pairs
from mbody.solution.doubts import Doubt
from mbody.solution.histories import Reaction, Record, with_fields
from mbody.solution.shared_forces import free_parts, moved_within, no_limits, primitive_numbers
from mbody.solution.solution import Solution
from mbody.system.rank import jacobian

Array = np.ndarray
P = ParamSpec("P")
R = TypeVar("R")

#: Elements that a note names.
NAMED = 8
#: Instants of all designs at which other forces are sought in balance, at most.
BALANCED = 1000


@dataclass(frozen=True, eq=False, repr=False)
class OtherForces(Solution):
    """The same motion with other forces. `asked`: Elements whose forces were read."""

    asked: set[str] = field(default_factory=set)

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """As of the result."""
        self.asked.add(joint)
        return super().reaction(joint, on)

    def effort(self, driver: str) -> Array:
        """As of the result."""
        self.asked.add(driver)
        return super().effort(driver)

    def contact(self, joint: str) -> Array:
        """As of the result."""
        self.asked.add(joint)
        return super().contact(joint)

    def known_of(self, quantity: Any, plain: Any = None) -> tuple[str, ...]:
        """Nothing."""
        return ()


#: What is known of the uniqueness of forces that are changed, by what is said.
KNOWN: dict[str, tuple[bool | None, ...]] = {
    "open": (False,),
    "unknown": (None,),
    "uncertain": (True, False, None),
}
#: Whether nothing is looked at, as while derivatives of others are sought.
_silent: contextvars.ContextVar[bool] = contextvars.ContextVar("silent", default=False)


@contextlib.contextmanager
def without_notes() -> Iterator[None]:
    """Nothing is looked at within."""
    token = _silent.set(True)
    try:
        yield
    finally:
        _silent.reset(token)


def known_of(run: Solution, quantity: Any, plain: Any = None) -> tuple[str, ...]:
    """Sentences about the forces that a quantity is made of; see `Solution.known_of`. `plain`: What
    the quantity is of this result, where that was found.
    """
    if _silent.get() or not _may_be_open(run):
        return ()
    read, name = _function(quantity)
    found = list[str]()
    every = _others(run)
    plain = read(run) if plain is None else plain
    rounded: Any = None
    for other, kind in every:
        one = with_fields(other, asked=set())
        try:
            changed = read(one)
            rounded = read(_rounded(run)) if rounded is None else rounded
            differs = _differ(plain, changed, rounded)
        except (ModelError, SolveError, ArithmeticError, ValueError):
            differs = True  # with other forces it cannot be found
        if differs:
            found.append(_sentence(run, kind, one.asked, name))
    return tuple(found)


def inherits(function: Callable[P, R]) -> Callable[P, R]:
    """The function of a result whose own result, an `Inherited` or `Several`, has notes of what is
    known of the forces that it is made of.
    """

    @functools.wraps(function)
    def found(*args: P.args, **more: P.kwargs) -> R:
        made: Any = function(*args, **more)
        given: Any = function
        run = next((one for one in (*args, *more.values()) if isinstance(one, Solution)), None)
        if run is None:
            return made

        def again(other: Solution) -> Any:
            own = [other if one is run else one for one in args]
            named = {key: other if one is run else one for key, one in more.items()}
            return given(*own, **named)

        return with_notes(made, run.known_of(again, made))

    return found


def with_notes(made: R, notes: tuple[str, ...]) -> R:
    """What was made, with further notes."""
    old: Any = made
    every = tuple(dict.fromkeys((*old.notes, *notes)))
    if len(every) == len(old.notes):
        return made
    if not is_dataclass(made):
        old.notes = every  # a `Several`
        return made
    found: R = replace(old, notes=every)
    return found


def not_unique(names: Sequence[str], of: str = "") -> str:
    """What is said of a quantity that is made of forces which are not unique."""
    return (
        f"the forces of {listed(names, NAMED)}, of which {repr(of) if of else 'this'} is made, are "
        "not unique: others that balance the bodies as well give other numbers"
    )


def every_force(run: Solution) -> list[Any]:
    """All reactions and efforts of a result; none where it has no forces."""
    if not run.has_forces:
        return []
    machine = run.mechanism
    found: list[Any] = [run.reaction(one.name) for one in machine.joints]
    found += [run.reaction(one.name) for one in acting_contacts(run)]
    return found + [run.effort(one.name) for one in (*machine.drivers, *machine.couplings)]


def open_elements(run: Solution, known: Collection[bool | None] = (False,)) -> list[str]:
    """Joints, contacts, drivers and couplings with forces of which it is so `known` whether they
    are unique; by default those that are not.
    """
    machine = run.mechanism
    names = [
        one.name
        for one in (*machine.joints, *acting_contacts(run), *machine.groups)
        if any(part in known for part in run.reaction(one.name).unique or (None,))
    ]
    efforts = (*machine.drivers, *machine.couplings)
    return names + [one.name for one in efforts if run.unique_effort(one.name) in known]


def open_forces_note(run: Solution) -> list[str]:
    """A note of the forces of a motion that are not unique."""
    names = open_elements(run)
    if not names:
        return []
    return [
        f"the forces of {listed(names, NAMED)} are not unique: those that keep all limits best are "
        "given; run.range gives their ends"
    ]


def followed_forces(run: Solution) -> list[Doubt]:
    """A doubt of each load and state that follows forces which are not unique: what it gives is one
    of many.
    """
    if not run.system.measures_forces or not _may_be_open(run) or run.record.batch:
        return []
    from mbody.solution.measures import formula_history

    machine = run.mechanism
    laws = [
        (one.name, field, law)
        for one in (*machine.loads, *machine.described_states)
        for field, law in vars(one).items()
        if isinstance(law, MeasuredFormula)
    ]
    return [
        Doubt(
            "validity",
            f"'{name}' follows '{law.text}', which is made of forces that are not unique, so that "
            "it is one of many: take off the rows that repeat, or measure what they leave unique",
            elements=(name,),
        )
        for name, field, law in laws
        if run.known_of(functools.partial(formula_history, law=law, name=f"{name}.{field}"))
    ]


def _may_be_open(run: Solution) -> bool:
    """Whether anything may not be unique."""
    if not run.has_forces or type(run.record) is not Record:
        return False
    touches = run.stepped is not None and len(run.stepped.which)
    open_ = run.regularization or run.shared is not None or run.dependencies is not None
    return bool(touches or open_ or (run.analysis != "simulate" and friction_pairs(run.system)))


def _function(quantity: Any) -> tuple[Callable[[Solution], Any], str]:
    """A quantity as a function of a result, and its name."""
    if isinstance(quantity, Measure):
        return lambda one: one.measure(quantity), quantity.of
    if not isinstance(quantity, str):
        return quantity, getattr(quantity, "name", "")

    def read(one: Solution) -> Any:
        machine = one.mechanism
        named = quantity not in machine.measures
        if named and (quantity in machine or machine.contacts_of(quantity)):
            role = machine.element_or_group(quantity).role
            if role in ("joint", "contact"):
                return one.reaction(quantity)
            if role in ("driver", "coupling"):
                return one.effort(quantity)
        return one.measure(quantity)

    return read, quantity


def _sentence(run: Solution, kind: str, asked: set[str], name: str) -> str:
    every = open_elements(run, KNOWN[kind])
    names = [one for one in every if one in asked] or every
    if kind == "open":
        return not_unique(names, name)
    of = f"'{name}'" if name else "this"
    if kind == "uncertain":
        return (
            f"friction is not certain to have one solution: the forces of {listed(names, NAMED)}, "
            f"of which {of} is made, are those that follow from less and less friction"
        )
    return (
        f"whether the forces of {listed(names, NAMED)}, of which {of} is made, are unique was not "
        "examined: others may balance the bodies as well"
    )


# -- Other forces ------------------------------------------------------------------------------


def _others(run: Solution) -> list[tuple[OtherForces, str]]:
    """Results with other forces: "open" ones, which hold as well, and "unknown" ones."""
    kept = run.__dict__
    if "other_forces" not in kept:
        kept["other_forces"] = list(_made(run))
    found: list[tuple[OtherForces, str]] = kept["other_forces"]
    return found


def _made(run: Solution) -> Iterator[tuple[OtherForces, str]]:
    unknown = open_elements(run, KNOWN["unknown"])
    if unknown:
        yield _disturbed(run, "unknown"), "unknown"
    if run.analysis != "simulate" and run.friction and not run.friction.certified.all():
        yield _disturbed(run, "uncertain"), "uncertain"
    names = open_elements(run)
    if not names:
        return
    sets = run.shared.sets if run.shared is not None else ()
    places = len(run.t) * (run.record.count if run.record.batch else 1)
    forgotten = run.analysis == "simulate" and not run.regularization and not sets
    if unknown or forgotten or places > BALANCED:
        yield _disturbed(run, "open"), "open"
        return
    other = _with_record(run)
    if run.analysis == "simulate":
        _move_motion(run, other)
    else:
        present("move_forces", run, other)
    yield other, "open"


def _with_record(run: Solution) -> OtherForces:
    """The result with a record of its own."""
    blocks = [block.copy() for block in run.record.blocks]
    record = Record(blocks, run.record.count, batch=run.record.batch)
    parts = {one.name: getattr(run, one.name) for one in fields(Solution) if one.init}
    other = OtherForces(**{**parts, "record": record, **_report(run)})
    for name in ("pairs_at_rest", "rates_of_pairs", "open_forces"):
        if name in run.__dict__:
            other.__dict__[name] = run.__dict__[name]
    return other


def _report(run: Solution) -> dict[str, Any]:
    from mbody.solution.histories import reported_certificate

    said = reported_certificate(run)
    return {"status": said.status, "doubts": said.doubts, "notes": said.notes}


def _primitives(run: Solution) -> slice:
    first = 3 * run.system.coordinates
    return slice(first, first + PER_PRIMITIVE * len(run.system.owners))


def _rounded(run: Solution) -> OtherForces:
    """The result with forces that differ by rounding."""
    other, system = _with_record(run), run.system
    lengths = np.ones((len(system.owners), PER_PRIMITIVE))
    lengths[:, 4] = system.length
    primitive, number, turns = system.row_table
    lengths[primitive, number] = np.where(turns, system.length, 1.0)
    size = _greatest_force(run) * lengths.ravel()[:, None]
    for block in other.record.blocks:
        own = block[:, _primitives(run)]
        way = tol.FORCES_ROUNDED * np.cos(np.arange(own.size)).reshape(own.shape)
        with np.errstate(all="ignore"):  # of lanes that no design has
            own += way * (size + own)
    return _stepped(run, other, tol.FORCES_ROUNDED)


def _greatest_force(run: Solution) -> float:
    """The greatest force of a joint, contact or driver."""
    numbers = run.record.table(_primitives(run))
    forces = numbers.reshape(*numbers.shape[:-1], -1, PER_PRIMITIVE)[..., 2:4]
    return float(np.abs(forces[np.isfinite(forces)]).max(initial=0.0))


def _stepped(run: Solution, other: OtherForces, part: float) -> OtherForces:
    """The result with forces of contacts by steps with impulses changed by a part of them."""
    if run.stepped is None:
        return other
    numbers = run.stepped.numbers.copy()
    ways = np.cos(np.arange(len(numbers)))[:, None]
    numbers[:, 4:6] *= 1.0 + part * ways
    return with_fields(other, stepped=replace(run.stepped, numbers=numbers))


def _disturbed(run: Solution, kind: str) -> OtherForces:
    """The result with those forces changed that are so known, in no balance."""
    other, machine, names = _with_record(run), run.mechanism, open_elements(run, KNOWN[kind])
    first, greatest = _primitives(run).start, _greatest_force(run)
    for count, name in enumerate(names, start=1):
        element = machine.element_or_group(name)
        parts = [element.name, *(one.name for one in machine.contacts_of(name))]
        moved = [True] * 5
        if element.role in ("joint", "contact"):
            unique = run.reaction(name).unique or (None,) * 3
            moved[2:] = [one in KNOWN[kind] for one in unique]
        for e in (e for part in parts for e in run.system.primitives_of.get(part, ())):
            for n in np.flatnonzero(moved).tolist():
                row = first + PER_PRIMITIVE * e + n
                way = np.cos(float(count + n))
                for block in other.record.blocks:
                    with np.errstate(all="ignore"):
                        block[:, row] += way * (0.1 * np.abs(block[:, row]) + 0.01 * greatest)
    return _stepped(run, other, 0.1)


def _move_motion(run: Solution, other: OtherForces) -> None:
    """Other forces of a motion of `simulate`."""
    from mbody.solution.checks import loaded

    block, own = other.record.blocks[0], _primitives(run)
    sets = run.shared.sets if run.shared is not None else [None] * len(run.t)
    limits = no_limits(len(run.system.row_table[0]))
    redundant = run.dependencies is not None and any(map(any, run.dependencies.values()))
    for k, one in enumerate(sets):
        lane, place = divmod(k, len(block))
        if one is not None:
            block[place, own.start + one.rows, lane] += one.changes @ moved_within(
                one.parts, one.limits, one.forces
            )
        if not redundant:
            continue
        work = loaded(run, k)
        primitive, number, _ = run.system.row_table
        forces = block[place, own.start + PER_PRIMITIVE * primitive + number, lane]
        columns = -jacobian(run.system, work)[1].T
        parts = free_parts(columns, forces, np.ones(len(forces), bool), limits)
        if not parts:
            continue
        y = moved_within(parts, limits, forces)
        change = np.hstack([part.free for part in parts]) @ y
        whole = np.zeros((len(run.system.owners), 2))
        whole[primitive, number] = change
        block[place, own, lane] += primitive_numbers(run.system.layout, work, whole).ravel()


# -- Whether numbers differ --------------------------------------------------------------------


def _numbers(found: Any) -> Iterator[Array]:
    """All numbers of what a function gives, as arrays in their order."""
    if isinstance(found, Solution | str | bytes | type(None)):
        return
    if isinstance(found, dict):
        found = list(found.values())
    if isinstance(found, np.ndarray | np.number | int | float | complex):
        array = np.asarray(found)
        if array.dtype.kind in "fciub":
            yield array.astype(complex)
        elif array.dtype.kind == "O":
            yield from _numbers(array.ravel().tolist())
    elif isinstance(found, list | tuple | set | frozenset):
        for one in found:
            yield from _numbers(one)
    elif is_dataclass(found):
        for part in (one for one in fields(found) if not one.metadata.get("scale")):
            yield from _numbers(getattr(found, part.name))


def _differ(plain: Any, changed: Any, rounded: Any) -> bool:
    """Whether what other forces change is more than what rounding does."""
    every = [list(_numbers(one)) for one in (plain, changed, rounded)]
    if len({len(one) for one in every}) > 1:
        return True
    for a, b, c in zip(*every, strict=True):
        if not a.shape == b.shape == c.shape:
            return True
        if (np.isfinite(a) != np.isfinite(b)).any():
            return True
        there = np.isfinite(a) & np.isfinite(b) & np.isfinite(c)
        moved = np.abs(b - a)[there].max(initial=0.0)
        rounding = np.abs(c - a)[there].max(initial=0.0)
        if moved > tol.FORCES_CHANGE_COUNTS * rounding:
            return True
    return False
