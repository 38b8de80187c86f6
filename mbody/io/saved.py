"""Results kept whole in a file, and taken up again: `save_run`, `load_run`."""

from __future__ import annotations

import json
import zipfile
from dataclasses import fields
from typing import Any

import numpy as np

from mbody.assembler import assemble, with_numbers_of
from mbody.doubts import as_doubt
from mbody.energy import Energy
from mbody.errors import ModelError
from mbody.events import Occurrence
from mbody.histories import Record
from mbody.io.files import writing
from mbody.io.model import from_text, to_text
from mbody.restart import Restart, Way
from mbody.solution import Solution, as_solution
from mbody.system import System

__all__ = ["load_run", "save_run"]

#: Of what a file tells; another one is refused.
FORMAT = 1
#: What reading a file raises that holds something else.
UNREADABLE = (ValueError, KeyError, TypeError)
ENERGIES = tuple(part.name for part in fields(Energy) if part.name != "by")
ARRAYS = tuple(part.name for part in fields(Restart) if part.name not in ("way", "own", "released"))


def save_run(run: Solution, path: Any) -> None:
    """Write a result with its mechanism, so that `load_run` gives the same and a motion goes on
    bit for bit.

    Parameters
    ----------
    run : Solution
        Of one design, of kinematics, kinetostatics, statics, close_loops or simulate.
    path : str or path
        Usually ends in ``.npz``; read by NumPy without pickles.

    Raises
    ------
    ModelError
        For a batch, for functions in Python, which no file can hold, and where nothing can be
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
    told: dict[str, Any] = {
        "format": FORMAT,
        "model": to_text(run.mechanism, as_json=True),
        "values": {name: float(value) for name, value in run.system.values.items()},
        "analysis": run.analysis,
        "soft": run.soft,
        "dependencies": run.dependencies,
        "notes": run.notes,
        "status": run.status,
        "ending": run.ending,
        "doubts": [doubt.data() for doubt in run.doubts],
        "let_go": dict(run.released),
        "stats": run.stats,
    }
    if run.energy is not None:
        arrays |= {f"energy.{name}": getattr(run.energy, name) for name in ENERGIES}
        told["works"] = list(run.energy.by)
        arrays |= {f"work.{n}": part for n, part in enumerate(run.energy.by.values())}
    told["events"] = [[one.name, one.t, one.after is not None] for one in run.events]
    for n, one in enumerate(run.events):
        arrays[f"event.{n}"] = one.state.record.table(slice(None))
        if one.after is not None:
            arrays[f"after.{n}"] = one.after.record.table(slice(None))
    if run.restart is not None:
        way = run.restart.way
        told["way"] = [way.method, way.rtol, way.atol, way.step]
        told["released"] = run.restart.released
        arrays |= {f"restart.{name}": getattr(run.restart, name) for name in ARRAYS}
        arrays |= {f"own.{n}": part for n, part in enumerate(run.restart.own)}
    arrays["told"] = np.frombuffer(json.dumps(told).encode(), dtype=np.uint8)
    with writing(path, binary=True) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def load_run(path: Any) -> Solution:
    """The result that `save_run` wrote.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    ModelError
        For a file that there is not, or that is no saved result.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
        told = json.loads(arrays["told"].tobytes())
        known = told["format"]
    except OSError as error:
        reason = error.strerror or str(error)
        raise ModelError(f"cannot read '{path}' ({reason}): give a file of save_run") from None
    except (*UNREADABLE, AttributeError, zipfile.BadZipFile, EOFError):
        raise ModelError(f"'{path}' is no saved result: give a file of save_run") from None
    if known != FORMAT:
        raise ModelError(f"'{path}' is of format {known}, this version reads {FORMAT}: save anew")
    mechanism = from_text(told["model"], is_json=True)
    system = with_numbers_of(assemble(mechanism), told["values"])
    try:
        return _solution(system, told, arrays)
    except UNREADABLE:
        raise ModelError(
            f"'{path}' is a saved result of which a part is missing: save it anew"
        ) from None


def _solution(system: System, told: dict[str, Any], arrays: dict[str, np.ndarray]) -> Solution:
    energy = restart = None
    if "works" in told:
        by = {name: arrays[f"work.{n}"] for n, name in enumerate(told["works"])}
        energy = Energy(**{name: arrays[f"energy.{name}"] for name in ENERGIES}, by=by)
    if "way" in told:
        own = tuple(arrays[f"own.{n}"] for n in range(sum(key[:4] == "own." for key in arrays)))
        parts = {name: arrays[f"restart.{name}"] for name in ARRAYS}
        restart = Restart(Way(*told["way"]), **parts, own=own, released=tuple(told["released"]))
    soft, analysis = told["soft"], told["analysis"]

    def instants(name: str, t: Any) -> Solution:
        record = Record([arrays[name][:, :, None]], len(arrays[name]), batch=False)
        return Solution(system, analysis, np.atleast_1d(t), record, None, soft=soft)

    events = tuple(
        Occurrence(name, t, instants(f"event.{n}", t), instants(f"after.{n}", t) if after else None)
        for n, (name, t, after) in enumerate(told["events"])
    )
    return Solution(
        system=system,
        analysis=analysis,
        t=arrays["t"],
        record=Record([np.ascontiguousarray(arrays["pages"][:, :, None])], len(arrays["t"]), False),
        given=arrays.get("given"),
        soft=soft,
        dependencies=told["dependencies"],
        notes=tuple(told["notes"]),
        status=told.get("ending", told["status"]),
        doubts=tuple(as_doubt(one) for one in told.get("doubts", ())),
        released=told.get("let_go", {}),
        stats=told["stats"],
        energy=energy,
        events=events,
        restart=restart,
    )
