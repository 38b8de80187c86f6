"""Cross-check by MuJoCo: joint forces by its inverse dynamics, motions by its integrator."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np

from mbody.engines.balance import CrosscheckResult, Inexpressible, Row
from mbody.engines.mjcf import to_mjcf
from mbody.engines.mujoco.forces import contact_crosscheck, force_rows
from mbody.engines.mujoco.motion import Replay, motion_rows
from mbody.errors import ModelError, SolveError
from mbody.model.coupling import Coupling
from mbody.model.element import takes_one_design
from mbody.model.joints import Joint
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["crosscheck_result"]

#: Instants that are compared, evenly over the run; fewer for large systems of equations, since the
#: time grows with the cube of their size.
MOST, FEWEST, LARGE = 200, 9, 30


def crosscheck_result(system: System, run: Solution) -> CrosscheckResult:
    """Efforts, joint forces, accelerations and motions of the same mechanism by MuJoCo.

    `system`: Of one design; MuJoCo models it, from the file of `to_mjcf`.
    `run`: Of kinetostatics, statics or simulate.
    Raises ModelError for a batch, or a run without forces.
    Raises SolveError where MuJoCo is not installed.

    Notes
    -----
    MuJoCo's own constraints are soft, and its `mj_inverse` counts no force of a loop. So forces are
    found from its mass matrix, bias, passive forces and constraint Jacobian, and passed to its
    `mj_rnePostConstraint`, which returns the joint forces: these are accurate. Free motions are
    integrated by its Runge-Kutta method three times, with halved steps; the difference of the
    finest two is the error estimate.
    """
    try:
        importlib.import_module("mujoco")
    except ImportError:
        raise SolveError(
            "a cross-check by MuJoCo needs the package mujoco, which is not installed: "
            "pip install mujoco"
        ) from None
    takes_one_design("MuJoCo", system.batch or run.record.batch or None)
    if not run.has_forces:
        raise ModelError(
            f"{run.analysis} computes no forces to check: use kinetostatics, statics or simulate"
        )
    found = _result(system, run)
    fault = faulty_release(_version())
    return replace(found, notes=(fault, *found.notes)) if fault else found


def _result(system: System, run: Solution) -> CrosscheckResult:
    """The result, with all conditions checked."""
    if run.analysis == "simulate" and run.mechanism.contacts:
        return contact_crosscheck(system, run, f"MuJoCo {_version()}")
    made = to_mjcf(system, run.take([0]), smooth=True)
    refused = list(made.without)
    names = {one.name for one in system.mechanism if isinstance(one, (Joint, Coupling))}
    engine = f"MuJoCo {_version()}"
    if any(one.element in names for one in refused):
        return CrosscheckResult(
            engine, (), tuple(refused), ("without these constraints nothing can be compared",)
        )
    notes = []
    adopted = [load.name for load in run.mechanism.loads if load.name not in made.built]
    # these act on the bodies as wrenches; for a motion other reasons are given
    drivers = {driver.name for driver in system.drivers}
    refused = [one for one in refused if one.element not in drivers.union(adopted)]
    if adopted:
        notes.append(
            f"{', '.join(map(repr, adopted))}: not in MuJoCo, applied as the wrench from mbody"
        )
    notes += [note for note in made.notes if "angles" in note]
    most = max(FEWEST, int(MOST * min(1.0, (LARGE / len(made.columns)) ** 3)))
    run_seen = run
    if (count := len(run)) > most:
        run_seen = run.take(np.unique(np.linspace(0, count - 1, most).astype(int)))
        notes.append(f"forces are compared at {most} of {count} instants")
    rows: list[Row]
    rows, more = force_rows(Replay(made, run_seen))
    refused += more
    if run.analysis == "simulate":
        moved, cannot, more_notes = motion_rows(made, run, run_seen)
        rows, refused, notes = rows + moved, refused + cannot, notes + more_notes
    return CrosscheckResult(engine, tuple(rows), _once(refused), tuple(notes), tuple(adopted))


def _once(refused: list[Inexpressible]) -> tuple[Inexpressible, ...]:
    return tuple(dict.fromkeys(refused))


#: Releases with a fault that their successors' release notes name.
FAULTY_RELEASES = {"4.0.0": "its factorisation of sparse matrices is faulty"}


def faulty_release(version: str) -> str:
    """A sentence about a release of MuJoCo with a known fault, empty for others.

    >>> faulty_release("4.0.0")
    'MuJoCo 4.0.0: its factorisation of sparse matrices is faulty, as later release notes say'
    """
    fault = FAULTY_RELEASES.get(version)
    return f"MuJoCo {version}: {fault}, as later release notes say" if fault else ""


def _version() -> str:
    from importlib.metadata import version

    return version("mujoco")
