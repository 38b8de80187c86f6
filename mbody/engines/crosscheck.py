"""The verb `crosscheck`: the same mechanism in other engines, and what they say of our result."""

from __future__ import annotations

import difflib
import importlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from mbody.analysis.driven.requests import asked_of
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.position.assembly_analysis import as_system
from mbody.engines.opinion import AGREES, Engine, Opinion
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.model.study import Instants
from mbody.solution.doubts import Doubt, status_of
from mbody.solution.heading import heading, unit_symbols
from mbody.solution.solution import Solution, as_solution

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.system.system import System

__all__ = ["ALWAYS", "ENGINES", "Crosscheck", "crosscheck", "installed"]

#: Where the function `opinion` of every engine lives; a new engine is a file and a line here.
ENGINES = {
    "balance": "mbody.engines.balance",
    "oracle": "mbody.engines.oracle.opinion",
    "pinocchio": "mbody.engines.pinocchio",
    "pymunk": "mbody.engines.pymunk",
    "mujoco": "mbody.engines.mujoco",
}
#: Those that need nothing but mbody, and are asked whoever else is.
ALWAYS = ("balance", "oracle")


@dataclass(frozen=True, eq=False)
class Crosscheck:
    """What other engines say of a result.

    Attributes
    ----------
    run : Solution
        The result.
    opinions : mapping
        An `Opinion` by the name of each engine.
    """

    run: Solution
    opinions: Mapping[str, Opinion]

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Those of the result, and one for each engine that differs."""
        found = list(self.run.doubts)
        for name, opinion in self.opinions.items():
            rows = [row.quantity for row in opinion.rows if row.verdict != AGREES]
            if rows:
                told = f"{name} differs in {listed(rows)}: see its rows"
                found.append(Doubt("solver", told))
        return tuple(found)

    @property
    def status(self) -> str:
        """Completed, or "doubtful: …" where the result is in doubt or an engine differs."""
        return status_of("completed", self.doubts)

    @property
    def notes(self) -> tuple[str, ...]:
        """Those of the result, and the messages of the doubts."""
        return tuple(dict.fromkeys((*self.run.notes, *(one.message for one in self.doubts))))

    @property
    def agrees(self) -> bool:
        """Whether no engine differs in any quantity."""
        return all(opinion.agrees for opinion in self.opinions.values())

    def data(self) -> dict[str, Any]:
        """The same as plain lists and texts, ready for JSON: the heading, ``"agrees"`` and
        ``"engines": {ENGINE: {"engine", "rows", "not_expressible", "notes"}}``; what is no finite
        number is null.
        """
        engines = {name: _finite(opinion.data()) for name, opinion in self.opinions.items()}
        mechanism, analysis = self.run.mechanism, self.run.analysis
        head = heading(mechanism.name, analysis, unit_symbols(mechanism.units), self)
        return head | {"agrees": self.agrees, "engines": engines}

    def __str__(self) -> str:
        from mbody.sheets.crosscheck import sheet

        return sheet(self)


def crosscheck(
    model: Mechanism | System,
    against: str | Sequence[str] | None = None,
    *,
    ours: Solution | None = None,
) -> Crosscheck:
    """Every answer checked by engines that share no code with mbody: a second opinion.

    Parameters
    ----------
    model : Mechanism or System
        Of one design: what the other engines build.
    against : str or list of str, optional
        Which of ``"pinocchio"``, ``"pymunk"``, ``"mujoco"``, in text with commas between them; by
        default every one that is installed. The balance of forces and power, and the dense oracle,
        are always asked.
    ours : Solution, optional
        The result to be judged, of kinetostatics, statics or simulate; by default what the
        mechanism itself asks: its free motion where it has a `simulation`, else kinetostatics.

    Returns
    -------
    Crosscheck
        ``print`` shows, for every engine and quantity, ours, theirs, the difference, the one that
        is expected of that engine, and why; and what the engine cannot express.

    Raises
    ------
    ModelError
        For an engine that there is not, a batch, or a result of another mechanism.
    SolveError
        For an engine that is not installed; as of the analysis.

    Notes
    -----
    A difference is a part of the greatest of its kind (all forces, all torques …) over the run.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> crosscheck(machine, "pinocchio").agrees
    True
    """
    names = _chosen(against)
    system = as_system(model)
    if system.batch is not None:
        raise ModelError("crosscheck takes one design: choose one of the batch with design(n)")
    if ours is not None:
        run = _checked(system, as_solution(ours))
    elif system.mechanism.simulation is not None:
        run = simulate(system)
    else:
        run = asked_of(system, "kinetostatics", system.mechanism.ask or Instants())
    found = {}
    for name in names:
        why = _broken(name) if against is None else ""
        found[name] = Opinion(name, (), (), (why,)) if why else _engine(name)(system, run)
    return Crosscheck(run, found)


def installed() -> tuple[str, ...]:
    """The engines that can be asked here, those of `ALWAYS` first."""
    others = [name for name in ENGINES if name not in ALWAYS]
    return (*ALWAYS, *(name for name in others if find_spec(ENGINES[name]) and find_spec(name)))


def _broken(name: str) -> str:
    """A sentence of an engine that is installed and cannot be loaded; else none."""
    if name not in ALWAYS:
        try:
            importlib.import_module(name)
        except ImportError as error:
            return f"not asked: it is installed, but cannot be loaded ({error})"
    return ""


def _engine(name: str) -> Engine:
    engine: Engine = importlib.import_module(ENGINES[name]).opinion
    return engine


def _chosen(against: Any) -> tuple[str, ...]:
    """The engines to be asked."""
    if against is None:
        return installed()
    if isinstance(against, str):
        against = [name.strip() for name in against.split(",")]
    if not isinstance(against, Sequence):
        raise ModelError(f"against takes names of engines ({listed(ENGINES)}), not {against!r}")
    wanted = list(against)
    for name in wanted:
        if name not in ENGINES:
            close = difflib.get_close_matches(str(name)[:60], ENGINES, 1)
            told = f"did you mean '{close[0]}'?" if close else f"there are: {listed(ENGINES)}"
            raise ModelError(f"there is no engine {brief(name)}: {told}")
    return tuple(dict.fromkeys((*ALWAYS, *wanted)))


def _checked(system: System, run: Solution) -> Solution:
    """A result that can be judged: of forces, one design, and of elements of the same names."""
    if not run.has_forces:
        raise ModelError(
            f"{run.analysis} finds no forces to be checked: give a result of kinetostatics, "
            "statics or simulate"
        )
    if run.record.batch:
        raise ModelError(
            f"crosscheck judges one design, this is a batch of {run.record.count}: analyse one of "
            "them, system.design(n)"
        )
    for kind in ("bodies", "joints", "couplings", "drivers", "loads"):
        own, other = (
            [element.name for element in getattr(one.mechanism, kind)] for one in (system, run)
        )
        if own != other:
            raise ModelError(
                f"the result is of another mechanism, its {kind} are {listed(other)}, not "
                f"{listed(own)}: analyse the same one"
            )
    return run


def _finite(value: Any) -> Any:
    """The same data, None for what is no finite number."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
