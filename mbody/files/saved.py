"""Results kept whole in a file, and taken up again: `save_run`, `load_run`."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from mbody.analysis.contact.closed_contacts import reclosed
from mbody.analysis.contact.unilateral import with_contacts_of_joints
from mbody.analysis.dynamics.restart_checks import check_restart, finite
from mbody.analysis.freedom.single_design import released
from mbody.errors import ModelError, SolveError, brief
from mbody.files.arrays import Unreadable, packed, unpacked
from mbody.files.model import Limits
from mbody.files.model.read import from_json
from mbody.files.model.write import to_json
from mbody.files.saved_parts import array, check_header, closed_places, modal_state, pages, want
from mbody.files.saved_stepped import stepped_arrays, stepped_contacts, stepped_header
from mbody.files.writing import writing
from mbody.kernels.step_state import PROGRESS
from mbody.model.joint_contacts import JointContact
from mbody.solution.doubts import as_doubt
from mbody.solution.energy import Energy
from mbody.solution.event_record import EventRecord
from mbody.solution.histories import BranchDistance, Record
from mbody.solution.restart import Restart, Way
from mbody.solution.solution import Solution, as_solution
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.system import System

__all__ = ["load_run", "save_run"]

#: Format of a file; another one is refused.
FORMAT = 2
#: Whose seal a file carries.
OWNER = "mbody saved result"
#: A model is no larger than the file that contains it, which was looked at as a whole.
UNLIMITED = Limits(*[math.inf] * 3)
#: Keys that its header must have.
NEEDED = (
    "model",
    "values",
    "analysis",
    "regularization",
    "dependencies",
    "notes",
    "status",
    "stats",
    "events",
    "ending",
    "doubts",
    "branch",
    "released_at",
)
OTHERWISE_KEPT = ("by", "lost", "rounding")
ENERGIES = tuple(part.name for part in fields(Energy) if part.name not in OTHERWISE_KEPT)
#: What a motion with controllers or inputs that jump goes on with; a file does not keep it.
SAMPLED = ("inputs", "sampled")
ELSEWHERE = ("way", "own", "modal", *SAMPLED)
ARRAYS = tuple(part.name for part in fields(Restart) if part.name not in ELSEWHERE)


def save_run(run: Solution, path: str | os.PathLike[str]) -> None:
    """Write a result with its mechanism, so that `load_run` gives the same and a motion goes on
    bit for bit.

    Parameters
    ----------
    run : Solution
        Of one design, of kinematics, kinetostatics, statics, close_loops or simulate.
    path : str or path
        Usually ends in ``.npz``; NumPy reads it, without pickles. It is not compressed and carries
        a seal, by which `load_run` sees whether anything in it was changed.

    Raises
    ------
    ModelError
        For a batch, for functions in Python, which no file can contain, and where nothing can be
        written.

    Examples
    --------
    >>> import mbody, tempfile
    >>> run = mbody.simulate(mbody.gallery.load("simple_pendulum"), 1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     mbody.save_run(run, f"{folder}/run.npz")
    ...     again = mbody.load_run(f"{folder}/run.npz")
    >>> bool((again["pendulum"].angle == run["pendulum"].angle).all())
    True
    """
    run = as_solution(run)
    if run.record.batch:
        raise ModelError("a batch of designs cannot be saved: save one, of system.design(n)")
    arrays = {"t": run.t, "pages": run.record.table(slice(None))}
    if run.given is not None:
        arrays["given"] = run.given
    header: dict[str, Any] = {
        "format": FORMAT,
        "model": to_json(run.mechanism),
        "values": {name: float(value) for name, value in run.system.values.items()},
        "analysis": run.analysis,
        "regularization": run.regularization,
        "dependencies": run.dependencies,
        "notes": run.notes,
        "status": run.status,
        "ending": run.ending,
        "doubts": [doubt.data() for doubt in run.doubts],
        "branch": None if run.branch is None else [run.branch.least, run.branch.t],
        "released_at": dict(run.released),
        "stats": run.stats,
    }
    if any(isinstance(one, JointContact) for one in run.mechanism.contacts):
        header["separated"] = run.analysis == "simulate"
    closed = [one for one in run.mechanism.contacts if one.closed]
    if closed:
        header["closed"] = {one.name: [list(one.closed), list(one.rolls_from)] for one in closed}
    if run.energy is not None:
        arrays |= {f"energy.{name}": getattr(run.energy, name) for name in ENERGIES}
        header["works"] = list(run.energy.by)
        arrays |= {f"work.{n}": part for n, part in enumerate(run.energy.by.values())}
        header["lost"] = list(run.energy.lost)
        header["energy_rounding"] = run.energy.rounding
        arrays |= {f"lost.{n}": part for n, part in enumerate(run.energy.lost.values())}
    if run.modes:
        header["modes"] = {name: list(modes) for name, modes in run.modes.items()}
        header["contacts"] = [one.contact for one in run.events]
    if run.stepped is not None:
        header["stepped"] = stepped_header(run.stepped)
        arrays |= stepped_arrays(run.stepped)
    header["events"] = [[one.name, one.t, one.after is not None] for one in run.events]
    for n, one in enumerate(run.events):
        arrays[f"event.{n}"] = one.state.record.table(slice(None))
        if one.after is not None:
            arrays[f"after.{n}"] = one.after.record.table(slice(None))
    # controllers are Python, which a file does not keep: it goes on from its last instant
    if run.restart is not None and not run.restart.sampled and not run.restart.inputs:
        way = run.restart.way
        header["way"] = [way.method, way.rtol, way.atol, way.step]
        if run.restart.modal is not None:
            header["modal"] = asdict(run.restart.modal)
        arrays |= {f"restart.{name}": getattr(run.restart, name) for name in ARRAYS}
        arrays |= {f"own.{n}": part for n, part in enumerate(run.restart.own)}
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    content = packed(arrays, OWNER)
    with writing(path, binary=True) as file:
        file.write(content)


def load_run(path: str | os.PathLike[str]) -> Solution:
    """The result that `save_run` wrote.

    Nothing is read of a file whose seal does not fit; then kinds, sizes and finiteness of every
    part are looked at, and that they fit the mechanism.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    ModelError
        For a file that there is not, that is no saved result, or that was changed since.

    Examples
    --------
    >>> import mbody, pathlib, tempfile
    >>> run = mbody.kinematics(mbody.makers.slider_crank(1.0, 3.0, speed=10.0), turn=True)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "turn.npz")
    ...     mbody.save_run(run, file)
    ...     bool((load_run(file)["rod"].omega == run["rod"].omega).all())
    True
    """
    try:
        arrays = unpacked(path, OWNER)
        header = _header(arrays)
        system = _system(header)
        return _solution(system, header, arrays)
    except TypeError:
        raise ModelError(f"a path must be text or path-like, not {brief(path)}") from None
    except OSError as error:
        reason = error.strerror or str(error)
        raise ModelError(f"cannot read '{path}' ({reason}): give a file of save_run") from None
    except Unreadable as error:
        raise ModelError(
            f"'{path}' is no saved result that can be used: {error}; save the result anew"
        ) from None


def _header(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The header of a file."""
    raw = arrays.get("header", np.zeros(0))
    want(raw.dtype == np.uint8 and raw.ndim == 1, "it has no header")
    try:
        header = json.loads(raw.tobytes())
    except (ValueError, RecursionError):
        raise Unreadable("its header is no JSON") from None
    want(isinstance(header, dict), "its header is no table")
    known = header.get("format")
    want(known == FORMAT, f"it is of format {str(known)[:20]}, this version reads {FORMAT}")
    missing = [key for key in NEEDED if key not in header]
    want(not missing, f"'{missing[0]}' is missing" if missing else "")
    return header


def _system(header: Mapping[str, Any]) -> System:
    """The mechanism of a file with its numbers."""
    model, values = header["model"], header["values"]
    want(isinstance(model, str), "its model is no text")
    try:
        system = assemble(from_json(model, limits=UNLIMITED), groups="stepped" in header)
        if header.get("separated"):
            system = with_contacts_of_joints(system)
        if "closed" in header:
            system = reclosed(system, closed_places(header["closed"]))
        numbers = isinstance(values, dict) and all(type(v) is float for v in values.values())
        want(numbers and values.keys() == system.values.keys(), "its numbers are not of its model")
        return with_numbers_of(system, values)
    except LookupError:
        raise Unreadable("'closed' names a contact, or a place, that is not there") from None
    except (ModelError, SolveError) as error:
        raise Unreadable(f"its model is none: {str(error).splitlines()[0][:200]}") from None


def _solution(
    system: System, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]
) -> Solution:
    check_header(header, system)
    energy = restart = given = None
    regularization, analysis = header["regularization"], header["analysis"]
    t = array(arrays, "t", (None,))
    n = len(t)
    if "works" in header:
        by = {name: array(arrays, f"work.{k}", (n,)) for k, name in enumerate(header["works"])}
        lost = {
            name: array(arrays, f"lost.{k}", (n,)) for k, name in enumerate(header.get("lost", ()))
        }
        plain = {name: array(arrays, f"energy.{name}", (n,)) for name in ENERGIES}
        rounding = header["energy_rounding"]
        want(type(rounding) is float and rounding >= 0.0, "'energy_rounding' is no such number")
        energy = Energy(**plain, by=by, lost=lost, rounding=rounding)
    if "way" in header:
        want(n > 0, "it has no instant to go on from")
        names = [f"own.{k}" for k in range(sum(key[:4] == "own." for key in arrays))]
        want(all(name in arrays for name in names), "a part of 'own' is missing")
        own = tuple(arrays[name] for name in names)
        parts = {
            name: array(arrays, f"restart.{name}", (None,), finite=name != "state")
            for name in ARRAYS
        }
        fits = len(parts["state"]) == PROGRESS and np.isfinite(finite(parts["state"])).all()
        want(bool(fits), "'restart.state' holds what is no finite number")
        way = Way(header["way"][0], *map(float, header["way"][1:]))
        fixed: dict[str, Any] = {**parts, "own": own}
        modal = modal_state(header["modal"]) if "modal" in header else None
        restart = Restart(way, **fixed, modal=modal)
        _check_restart(system, list(header["released_at"]), restart, float(t[-1]))
    if "given" in arrays:
        given = array(arrays, "given", (n, len(system.drivers), 3), open=True)

    def instants(name: str, when: Any) -> Solution:
        record = Record([pages(arrays, name, system, 1, analysis)[:, :, None]], 1, batch=False)
        return Solution(
            system, analysis, np.atleast_1d(when), record, None, regularization=regularization
        )

    contacts = header.get("contacts", [""] * len(header["events"]))
    events = tuple(
        EventRecord(
            name,
            t,
            instants(f"event.{n}", t),
            instants(f"after.{n}", t) if after else None,
            contacts[n],
        )
        for n, (name, t, after) in enumerate(header["events"])
    )
    block = np.ascontiguousarray(pages(arrays, "pages", system, n, analysis)[:, :, None])
    return Solution(
        system=system,
        analysis=analysis,
        t=t,
        record=Record([block], n, batch=False),
        given=given,
        regularization=regularization,
        dependencies=header["dependencies"],
        notes=tuple(header["notes"]),
        status=header["ending"],
        doubts=tuple(as_doubt(one) for one in header["doubts"]),
        branch=None if header["branch"] is None else BranchDistance(*header["branch"]),
        released=header["released_at"],
        stats=header["stats"],
        energy=energy,
        events=events,
        restart=restart,
        modes=header.get("modes", {}),
        stepped=stepped_contacts(header["stepped"], arrays, n) if "stepped" in header else None,
    )


def _check_restart(system: System, gone: list[str], restart: Restart, last: float) -> None:
    """Refuse a state that the motion, without the released drivers, cannot go on from."""
    try:
        check_restart(released(system, gone), restart, last)
    except (ModelError, SolveError) as error:
        raise Unreadable(str(error).splitlines()[0]) from None
