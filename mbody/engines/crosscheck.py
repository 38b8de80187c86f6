"""The function `crosscheck`: the same mechanism in other engines, and how they differ from our
result.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.driven import analyse_system_at
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core.other_words import meant
from mbody.core.presentation import Presented
from mbody.engines import balance
from mbody.engines.balance import AGREES, CrosscheckResult, Engine, Inexpressible
from mbody.errors import ModelError, brief
from mbody.model.element import listed, takes_one_design
from mbody.model.simulation import Instants
from mbody.model.stop import Stop
from mbody.quantities.output_units import OutputUnits
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.declared_result import Value
from mbody.solution.doubts import Doubt, status_of
from mbody.solution.histories import one_design
from mbody.solution.solution import Solution, as_solution

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.system.system import System


#: Where the function `crosscheck_result` of every engine lives; a new engine is a file and a line
#: here.
ENGINES = {
    "balance": "mbody.engines.balance",
    "oracle": "mbody.engines.oracle.oracle_crosscheck",
    "pinocchio": "mbody.engines.pinocchio",
    "pymunk": "mbody.engines.pymunk",
    "mujoco": "mbody.engines.mujoco",
}
#: Engines that need nothing but mbody; they are always used.
ALWAYS = ("balance", "oracle")
#: Of the others, those with contacts of rigid bodies, in motions over time.
TOUCHING = ("pymunk", "mujoco")
#: Why only balances are checked of motions in steps.
IMPULSIVE = "its steps with impulses have errors of their own: check a motion by events"


@dataclass(frozen=True, eq=False, repr=False)
class Crosscheck(Presented):
    """Cross-checks of a result by other engines.

    `run`: The result.
    `opinions`: A `CrosscheckResult` by the name of each engine.
    """

    run: Solution
    opinions: Mapping[str, CrosscheckResult]

    analysis_name = "{0.run.analysis}"
    declared = (*("agrees", "not_compared"), Value("engines", value="opinions"))

    @property
    def compared_in(self) -> OutputUnits:
        """The units of all rows: those of the model, where results may have others."""
        return OutputUnits(self.run.mechanism.units)

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Those of the result, and one for each engine that differs."""
        found = list(self.run.doubts)
        for name, result in self.opinions.items():
            rows = [row.quantity for row in result.rows if row.verdict != AGREES]
            if rows:
                message = f"{name} differs in {listed(rows)}: see its rows"
                found.append(Doubt("solver", message))
        return tuple(found)

    @property
    def status(self) -> str:
        """Completed, or "doubtful: …" where the result is in doubt or an engine differs."""
        return status_of("completed", self.doubts)

    @property
    def notes(self) -> tuple[str, ...]:
        """Those of the result, the messages of the doubts, and what was not compared."""
        own = [one.message for one in self.doubts]
        if self.agrees is None:
            own.append(f"nothing differs, but no other engine compared {listed(self.not_compared)}")
        return tuple(dict.fromkeys((*self.run.notes, *own)))

    @property
    def agrees(self) -> bool | None:
        """False where an engine differs; True where every quantity was compared by one without
        formulas of mbody; None where nothing differs, but some were not, those of `not_compared`.
        """
        if not all(result.agrees for result in self.opinions.values()):
            return False
        return None if self.not_compared else True

    @functools.cached_property
    def not_compared(self) -> tuple[str, ...]:
        """What no engine compared but the balance, or one by formulas of mbody: bodies (their
        motion), joints, drivers, couplings and contacts (their forces, where they are unique),
        loads (their laws), states and controllers, by name.
        """
        return not_compared(self.run, self.opinions)

    def __repr__(self) -> str:
        engines = ", ".join(f"{name} {result.verdict}" for name, result in self.opinions.items())
        return f"Crosscheck({self.run.mechanism.name!r}: {engines})"


def crosscheck(
    model: Mechanism | System,
    against: str | Sequence[str] | None = None,
    *,
    ours: Solution | None = None,
) -> Crosscheck:
    """Check a result by engines that share no code with mbody: a cross-check.

    Parameters
    ----------
    model : Mechanism or System
        Of one design; the other engines model it.
    against : str or list of str, optional
        Which of ``"pinocchio"``, ``"pymunk"``, ``"mujoco"``, in text with commas between them; by
        default all that are installed. The balance of forces and power, and the dense oracle, are
        always used.
    ours : Solution, optional
        The result to check, of kinetostatics, statics or simulate; by default the analysis of the
        model itself: its free motion where it has a `simulation`, else kinetostatics.

    Returns
    -------
    Crosscheck
        ``print`` shows, for every engine and quantity, our value, theirs, the difference, the
        expected difference and its reason; and what the engine cannot model.

    Raises
    ------
    ModelError
        For an unknown engine, a batch, or a result of another mechanism.
    SolveError
        For an engine that is not installed; as of the analysis.

    Notes
    -----
    Differences are relative to the greatest value of their kind (all forces, all torques …) in the
    run.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> crosscheck(machine, "pinocchio").agrees
    True
    """
    names = _names_of(against)
    system = as_system(model)
    takes_one_design("crosscheck", system.batch)
    if ours is not None:
        run = _checkable(system, as_solution(ours))
    elif system.mechanism.simulation is not None:
        run = simulate(system)
    else:
        run = analyse_system_at(system, "kinetostatics", system.mechanism.ask or Instants())
    if any(one.closed for one in run.mechanism.contacts):
        system = run.system  # its contacts are closed
    found = {}
    for name in names:
        why = _loading_error(name) if against is None else ""
        missing = () if name in ALWAYS else balance.without_counterpart(system.mechanism)
        if name not in ALWAYS and not (name in TOUCHING and run.analysis == "simulate"):
            missing += balance.contacts_without_counterpart(system.mechanism)
        if name not in ALWAYS and run.analysis == "simulate":
            missing += balance.separating(system.mechanism)
            missing += balance.unsupported_states(system.mechanism) if name in TOUCHING else ()
        if name != "balance" and run.stepped is not None:
            why = IMPULSIVE
            missing = (Inexpressible("motion", why),)
        if why or missing:
            found[name] = CrosscheckResult(name, (), missing, (why,) if why else ())
        else:
            found[name] = _engine(name)(system, run)
    return Crosscheck(run, found)


def installed() -> tuple[str, ...]:
    """The engines that are available here, those of `ALWAYS` first."""
    others = [name for name in ENGINES if name not in ALWAYS]
    return (*ALWAYS, *(name for name in others if find_spec(ENGINES[name]) and find_spec(name)))


def _loading_error(name: str) -> str:
    """The reason why an installed engine cannot be loaded; empty if it can."""
    if name not in ALWAYS:
        try:
            importlib.import_module(name)
        except ImportError as error:
            return f"not used: it is installed, but cannot be loaded ({error})"
    return ""


def _engine(name: str) -> Engine:
    engine: Engine = importlib.import_module(ENGINES[name]).crosscheck_result
    return engine


def _names_of(against: Any) -> tuple[str, ...]:
    """The engines to use."""
    if against is None:
        return installed()
    if isinstance(against, str):
        against = [name.strip() for name in against.split(",")]
    if not isinstance(against, Sequence):
        raise ModelError(f"against takes names of engines ({listed(ENGINES)}), not {against!r}")
    wanted = list(against)
    for name in wanted:
        if name not in ENGINES:
            close = meant(name, ENGINES)
            hint = f"did you mean '{close}'?" if close else f"there are: {listed(ENGINES)}"
            raise ModelError(f"there is no engine {brief(name)}: {hint}")
    return tuple(dict.fromkeys((*ALWAYS, *wanted)))


def _checkable(system: System, run: Solution) -> Solution:
    """The result, if it can be checked: with forces, of one design, with the same element names."""
    if not run.has_forces:
        raise ModelError(
            f"{run.analysis} computes no forces to check: give a result of kinetostatics, "
            "statics or simulate"
        )
    one_design(run, "crosscheck checks one design")
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


# -- What was compared by an engine that has no formulas of mbody ------------------------------

#: Keys of rows that are of forces.
FORCES = ("fx", "fy", "force", "torque", "effort", "contact")


def not_compared(run: Solution, opinions: Mapping[str, CrosscheckResult]) -> tuple[str, ...]:
    """Names of bodies, joints, drivers, couplings, contacts, loads, states and controllers of which
    no engine compared anything of its own; the balance takes motion and forces from the result.
    """
    machine, moving = run.mechanism, run.analysis == "simulate"
    others = {name: one for name, one in opinions.items() if name != "balance" and one.rows}
    seen = {name: _subjects(one, moving and name == "pinocchio") for name, one in others.items()}
    moved = {name for one in seen.values() for name, forces in one if not forces}
    # of elements of which the engine took no force from the result
    pushed = {
        name
        for engine, subjects in seen.items()
        for name, forces in subjects
        if forces and name not in others[engine].adopted
    }
    missing = [body.name for body in machine.bodies if body.name not in moved]
    missing += [name for name in _with_forces(run) if name not in pushed]
    for load in machine.loads:
        if all(load.name in one.adopted for one in others.values()):
            missing.append(load.name)
    if moving:
        missing += [one.name for one in machine.states if one.name not in moved]
        missing += [one.name for one in machine.controllers]
    return tuple(missing)


def _subjects(result: CrosscheckResult, kinematics: bool) -> set[tuple[str, bool]]:
    """The elements and states that rows are about, and whether forces of them were compared. Rows
    of `kinematics` alone, of the motion that the result has, are left out.
    """
    found = set()
    for row in result.rows:
        name = row.quantity.partition(":")[0]
        owner, _, key = name.rpartition(".")
        key, _, told = key.partition(" ")
        if kinematics and key not in FORCES and told not in ("over time", "by the forces"):
            continue
        found.add((owner or name, key in FORCES))
        if told == "over time":
            found.add((f"{owner}.{key}".removeprefix("."), False))
    return found


def _with_forces(run: Solution) -> Iterable[str]:
    """Joints, couplings, drivers and contacts with a unique force."""
    machine, moving = run.mechanism, run.analysis == "simulate"
    for joint in machine.joints:
        if not (moving and joint.can_separate) and any(run.reaction(joint.name).unique or ()):
            yield joint.name
    for one in (*machine.couplings, *run.system.drivers):
        yield one.name
    for one in acting_contacts(run):
        force = run.reaction(one.name)
        if any((force.unique or (True, True))[:2]) and np.any((force.fx, force.fy)):
            yield one.name
    for one in machine.contacts:
        if isinstance(one, Stop) and moving and np.any(run.contact(one.name)):
            yield one.name
