"""Results of the designs of a batch, each of which was found alone, as one result."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

import numpy as np

from mbody.errors import ModelError, SolveError
from mbody.solution.doubts import (
    Inherited,
    joined_doubts,
    joined_notes,
    status_of,
)
from mbody.solution.energy import PLAIN, Energy
from mbody.solution.histories import BranchDistance, Record, failed_designs
from mbody.solution.shared_forces import forces_of_designs
from mbody.solution.solution import Solution
from mbody.solution.stepped_contacts import SteppedContacts
from mbody.system.system import System, with_numbers_of

Array = np.ndarray
T = TypeVar("T")

#: Of a design that was not begun when a batch was stopped.
NOT_BEGUN = "stopped: before it began"


def joined_ending(endings: Sequence[str]) -> str:
    """How a batch ended, by how its designs did: what befell some of them, the worst first.

    >>> joined_ending(["completed", "ended: 'down' at t = 1 s"])
    "ended: 1 of 2 designs, as design 1: 'down' at t = 1 s"
    """
    parts = [one.partition(": ") for one in endings]
    for word in ("failed", "stopped", "ended"):
        own = {
            n: sentence for n, (kind, sign, sentence) in enumerate(parts) if kind == word and sign
        }
        if own:
            return partial_ending(word, own, len(endings))
    return "completed"


def partial_ending(word: str, sentences: Mapping[int, object], count: int) -> str:
    """How a batch of so many designs ended, some of which did as these sentences or errors say.

    >>> partial_ending("failed", {2: "loops do not close", 3: "dead centre"}, 9)
    'failed: 2 of 9 designs, as design 2: loops do not close'
    >>> partial_ending("failed", {}, 9)
    'completed'
    """
    if not sentences:
        return "completed"
    first = min(sentences)
    return f"{word}: {len(sentences)} of {count} designs, as design {first}: {sentences[first]}"


def sound_designs(solution: Any) -> list[Any]:
    """The designs of a batch that did not fail."""
    failed = failed_designs(solution.reports)
    return [solution.design(n) for n in range(solution.record.count) if n not in failed]


class DesignFailures(dict[int, ModelError | SolveError]):
    """The error of each design that failed, by its number: of batches and of sweeps.

    >>> from mbody import SolveError
    >>> failures = DesignFailures()
    >>> with failures.of(2):
    ...     raise SolveError("loops do not close")
    >>> failures.sentences
    {2: 'loops do not close'}
    """

    @contextlib.contextmanager
    def of(self, design: int) -> Iterator[None]:
        """Within, an error is one of that design, and takes nothing from the others."""
        try:
            yield
        except (ModelError, SolveError) as error:
            self[design] = error.with_traceback(None)

    @property
    def sentences(self) -> dict[int, str]:
        """What each says, in the order of the designs."""
        return {n: str(error) for n, error in sorted(self.items())}

    def refuse_all(self, count: int) -> None:
        """Raise the error of the first where all of so many designs failed."""
        if len(self) < count:
            return
        error = self[0]
        if count == 1 or any(str(other) != str(error) for other in self.values()):
            error.args = (f"design 0 of the batch: {error}", *error.args[1:])
        raise error


@dataclass(frozen=True, eq=False, repr=False)
class DesignResults(Inherited, Generic[T]):
    """What an analysis found of each design of a batch, in their order; a design that failed takes
    nothing from the others, and raises its error where it is asked for.

    Attributes
    ----------
    system : System
        The batch.
    results : tuple
        What was found of each design, of one that failed the error.
    status, doubts, notes
        Of all designs: sentences name the designs that they are of.

    Examples
    --------
    >>> import mbody
    >>> swing = mbody.Mechanism("pendulum")
    >>> swing.add(mbody.Body("bob", mass=1.0, cg=(1.0, 0.0)), mbody.Revolute("O", "ground", "bob"))
    >>> swing.add(mbody.Gravity("gravity", y=-9.81))
    >>> designs = mbody.assemble(swing).with_values({"bob.mass": [1.0, 2.0]})
    >>> [len(each) for each in mbody.equilibrium(designs)]
    [2, 2]
    """

    system: System
    results: tuple[T | ModelError | SolveError, ...] = field(repr=False)

    def __len__(self) -> int:
        return len(self.results)

    def __iter__(self) -> Iterator[T]:
        return map(self.design, range(len(self)))

    def __getitem__(self, index: int) -> T:
        return self.design(index)

    def design(self, index: int) -> T:
        """The result of one design.

        Raises
        ------
        ModelError, SolveError
            Where it failed: the error of the analysis of that design alone.
        """
        self.system.design(index)  # refuses one that there is not
        found = self.results[index]
        if isinstance(found, (ModelError, SolveError)):
            raise found.with_traceback(None)
        return found

    @property
    def failures(self) -> dict[int, str]:
        """The sentence of each design that failed, by its number."""
        return {n: str(one) for n, one in enumerate(self.results) if isinstance(one, Exception)}

    def data(self, angle: str | None = None) -> list[Any]:
        """Plain values of every design, of one that failed its sentence as ``"error"``."""
        return [
            {"error": str(one)} if isinstance(one, Exception) else one.data(angle)  # type: ignore[attr-defined]  # results have data
            for one in self.results
        ]

    def __str__(self) -> str:
        return "\n\n".join(f"design {n}: {one}" for n, one in enumerate(self.results))

    def __repr__(self) -> str:
        name = self.system.mechanism.name
        return f"DesignResults({name!r}: {len(self)} designs, {self.status})"


def results_of_designs(
    analysis: Callable[..., Any], system: System, args: Sequence[Any], options: Mapping[str, Any]
) -> Any:
    """The analysis of each design of a batch, which takes nothing from the others where it fails,
    as one result: of motions and positions a `Solution`, of others `DesignResults`.
    """
    found, failures = list[Any](), DesignFailures()
    options = {name: one for name, one in options.items() if name != "model"}
    for n in range(int(system.batch or 0)):
        with failures.of(n):
            own = {name: _own(one, n) for name, one in options.items()}
            found.append(analysis(system.design(n), *args, **own))
        if n in failures:
            found.append(failures[n])
        elif isinstance(found[-1], Solution) and found[-1].ending.startswith("stopped:"):
            break
    return _joined(system, found, failures)


def _own(given: Any, n: int) -> Any:
    """What is given for a design: of the result of a batch its own, of rest positions the first."""
    several = isinstance(given, DesignResults)
    if not several and not (isinstance(given, Solution) and given.record.batch):
        return given
    own: Any = given.design(n)
    if several:
        return own.positions[0] if hasattr(own, "positions") else own
    if not len(own):
        raise SolveError("the batch was stopped before this design began: analyse it alone")
    return own


def _joined(system: System, found: Sequence[Any], failures: DesignFailures) -> Any:
    """The result of all designs, of those that failed their errors; an error where none has one."""
    failures.refuse_all(len(found))
    if any(isinstance(one, Solution) for one in found):
        return solution_of_designs(system, found)
    doubts = joined_doubts([getattr(one, "doubts", ()) for one in found])
    notes = [one if n in failures else getattr(one, "notes", ()) for n, one in enumerate(found)]
    ending = partial_ending("failed", failures, len(found))
    return DesignResults(
        system,
        tuple(found),
        status=status_of(ending, doubts),
        doubts=doubts,
        notes=tuple(joined_notes(notes)),
    )


# -- Motions and positions of all designs as one result ----------------------------------------


def solution_of_designs(system: System, found: Sequence[Any]) -> Solution:
    """The result of a batch, of the solutions of its designs and the errors of those that failed:
    at the instants that were asked for, NaN where a design has none, as after its end.
    """
    count, first = int(system.batch or 0), next(one for one in found if isinstance(one, Solution))
    if first.mechanism is not system.mechanism:
        system = with_numbers_of(first.system, system.values)
    each = [
        one if isinstance(one, Solution) else _nothing(system.design(n), first, one)
        for n, one in enumerate([*found, *[None] * (count - len(found))])
    ]
    par = np.hstack([one.system.par for one in each])
    asked = [begun.request.times for one in each for begun in one.initial_states]
    t = np.unique(np.concatenate(asked or [one.t for one in each]))
    places = [_Places(one, t) for one in each]
    failed = {n: one for n, one in enumerate(found) if isinstance(one, Exception)}
    endings = [one.ending for one in each]
    ended: list[tuple[str, ...]] = [(end,) if end.startswith("ended:") else () for end in endings]
    steps = [one.stepped for one in each]
    return Solution(
        system=replace(system, par=par),
        analysis=first.analysis,
        t=t,
        record=Record([place.block(system.record_rows) for place in places], count, batch=True),
        given=first.given,
        notes=tuple(joined_notes(ended)),
        status=partial_ending("failed", failed, count) if failed else joined_ending(endings),
        stats=_sums([one.stats or {} for one in each]),
        energy=_energies(places),
        events=tuple(
            replace(event, design=n) for n, one in enumerate(each) for event in one.events
        ),
        released=first.released,
        modes=_modes(places),
        stepped=_steps(steps, [(one.own, one.among) for one in places], len(t)),
        shared=forces_of_designs([place.shared() for place in places], len(t)),
        reports=tuple(
            error if isinstance(error, Exception) else one
            for error, one in itertools.zip_longest(found, each)
        ),
        **common_fields(each),
    )


def common_fields(each: Sequence[Any]) -> dict[str, Any]:
    """Fields of the result of a batch by those of its designs: what some rows leave open, and how
    near the nearest came to another branch.
    """
    dependent = [one.dependencies for one in each if one.dependencies is not None]
    names = {name: None for one in dependent for name in one}
    opened = {
        name: np.any([one[name] for one in dependent if name in one], axis=0).tolist()
        for name in names
    }
    nearest = [one.branch for one in each if isinstance(one.branch, BranchDistance)]
    return {
        "regularization": max(one.regularization for one in each),
        "dependencies": opened if dependent else None,
        "branch": min(nearest, key=lambda one: one.least, default=None),
    }


def _nothing(system: System, like: Solution, error: Exception | None) -> Solution:
    """A design that failed, or was not begun (None): it has no instants."""
    record = Record([np.zeros((0, system.record_rows, 1))], 0, batch=False)
    status = NOT_BEGUN if error is None else "failed"
    return Solution(system, like.analysis, np.zeros(0), record, None, status=status)


class _Places:
    """Where the instants of a design are among those of its batch. `among` (instants,): Those of
    the batch that it has; `own`: Which of its own these are.
    """

    def __init__(self, run: Solution, t: Array) -> None:
        self.run, self.count = run, len(t)
        self.own = np.flatnonzero(np.isin(run.t, t))
        self.among = np.searchsorted(t, run.t[self.own])

    def placed(self, values: Array | None) -> Array:
        """A history at the instants of the batch: (instants, …)."""
        if values is None:
            return np.full(self.count, np.nan)
        if len(values) == len(self.own) == self.count:
            return values
        found = np.full((self.count, *values.shape[1:]), np.nan)
        found[self.among] = values[self.own]
        return found

    def block(self, rows: int) -> Array:
        """Its rows: (instants, rows, 1)."""
        return self.placed(self.run.record.table(slice(0, rows)))[:, :, None]

    def words(self, given: Sequence[str]) -> list[str]:
        """Words of instants, "" where it has none."""
        found = [""] * self.count
        for n, k in zip(self.among.tolist(), self.own.tolist(), strict=True):
            found[n] = given[k] if given else ""
        return found

    def shared(self) -> Any:
        """Its open forces at the instants of the batch."""
        shared = self.run.shared
        if shared is None:
            return None
        sets: list[Any] = [None] * self.count
        for n, k in zip(self.among.tolist(), self.own.tolist(), strict=True):
            sets[n] = shared.sets[k]
        return replace(shared, sets=tuple(sets))


def _steps(
    each: Sequence[SteppedContacts | None], places: Sequence[tuple[Array, Array]], instants: int
) -> SteppedContacts | None:
    """Those of the designs of a batch at so many instants; `places`: of each design which of its
    own instants are kept, and where.
    """
    known = [one for one in each if one is not None]
    if not known:
        return None
    first, residuals = [0], np.full((len(each), instants, known[0].residuals.shape[2]), np.nan)
    parts, end = list[SteppedContacts](), 0
    for n, (one, (own, among)) in enumerate(zip(each, places, strict=True)):
        counts = np.zeros(instants, dtype=np.int64)
        if one is not None:
            part = one.take(own)
            parts.append(part)
            counts[among], residuals[n, among] = np.diff(part.first), part.residuals[0]
        first += (end + np.cumsum(counts)).tolist()
        end = first[-1]
    return replace(
        known[0],
        first=np.array(first, dtype=np.int64),
        which=np.concatenate([one.which for one in parts]),
        numbers=np.concatenate([one.numbers for one in parts]),
        residuals=residuals,
        nearer=max(one.nearer for one in known),
        designs=len(each),
    )


def _modes(places: Sequence[_Places]) -> dict[str, Any]:
    """What contacts and frictional joints do, a list of each design."""
    names = dict.fromkeys(name for one in places for name in one.run.modes)
    return {name: [one.words(one.run.modes.get(name, ())) for one in places] for name in names}


def _energies(places: Sequence[_Places]) -> Energy | None:
    """Accounts of energy, every part (designs, instants)."""
    accounts = [one.run.energy for one in places]
    known = next((one for one in accounts if one is not None), None)
    if known is None:
        return None
    each = list(zip(places, accounts, strict=True))

    def parts(part: str) -> dict[str, Array]:
        names = dict.fromkeys(name for one in accounts if one for name in getattr(one, part))
        return {
            name: np.array([at.placed(getattr(one, part, {}).get(name)) for at, one in each])
            for name in names
        }

    plain = {
        name: np.array([at.placed(getattr(one, name, None)) for at, one in each]) for name in PLAIN
    }
    rounding = max(one.rounding for one in accounts if one is not None)
    return Energy(**plain, by=parts("by"), lost=parts("lost"), rounding=rounding)


def _sums(each: Sequence[Mapping[str, int]]) -> dict[str, int] | None:
    """Counts of steps of all designs."""
    names = dict.fromkeys(name for one in each for name in one)
    return {name: sum(one.get(name, 0) for one in each) for name in names} or None
