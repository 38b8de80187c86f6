"""Results kept whole in a file, and taken up again: `save_run`, `load_run`."""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import stat
import struct
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields
from itertools import chain
from pathlib import Path
from typing import IO, Any

import numpy as np

from mbody.analysis.contact.closed_contacts import reclosed
from mbody.analysis.contact.unilateral import with_contacts_of_joints
from mbody.analysis.driven.driven import ANALYSES
from mbody.analysis.dynamics.restart import check_restart, finite
from mbody.analysis.freedom.mobility import released
from mbody.errors import ModelError, SolveError, brief
from mbody.files.model import Limits
from mbody.files.model.read import from_json
from mbody.files.model.write import to_json
from mbody.files.tables import writing
from mbody.kernels.step_state import PROGRESS
from mbody.model.joint_limits import JointContact
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.doubts import KINDS, as_doubt
from mbody.solution.energy import Energy
from mbody.solution.histories import BranchDistance, EventRecord, Record
from mbody.solution.solution import (
    ActiveSet,
    IntegrationSettings,
    ModalState,
    Restart,
    Solution,
    as_solution,
)
from mbody.solution.stepped_contacts import SteppedContacts
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of

# -- Arrays of plain numbers in one sealed file: a zip of ``.npy`` members, as NumPy reads them
#
# The members are not compressed, so that none can be larger than the file that it comes in.

# -- Seals: digests that a file carries of all its bytes, so that what was changed is never read
# The seal of a file is the SHA-256 of what it belongs to and of every byte of it but the seal
# itself. What was cut, changed, or copied to where it does not belong does not fit its seal.

MARK = b"sha256:"
SIGNS = 64
ZEROS = b"0" * SIGNS
#: Place of a seal.
OPEN_SEAL = MARK + ZEROS
#: Bytes that are read at once.
CHUNK = 1 << 20


def seal(content: bytes, owner: str) -> bytes:
    """Content with its seal in the place of the last open one.

    >>> whole = seal(b"numbers " + OPEN_SEAL, "sweep 0")
    >>> sealed(whole, "sweep 0"), sealed(whole, "sweep 1"), sealed(whole[:-1], "sweep 0")
    (True, False, False)
    """
    place = content.rindex(OPEN_SEAL) + len(MARK)
    return content[:place] + _digest([content], owner) + content[place + SIGNS :]


def sealed(content: bytes, owner: str) -> bool:
    """Whether a content is whole, unchanged, and of that owner."""
    place = content.rfind(MARK) + len(MARK)
    if place < len(MARK):
        return False
    before, given, after = content[:place], content[place : place + SIGNS], content[place + SIGNS :]
    return given == _digest([before, ZEROS, after], owner)


def sealed_at_the_end(file: IO[bytes], owner: str) -> bool:
    """Whether an open file ends with its own seal, checked in little memory."""
    size = file.seek(0, 2) - SIGNS
    if size < len(MARK):
        return False
    file.seek(size - len(MARK))
    tail = file.read()
    if not tail.startswith(MARK):
        return False
    file.seek(0)
    return tail[len(MARK) :] == _digest(chain(_chunks(file, size), [ZEROS]), owner)


def _chunks(file: IO[bytes], size: int) -> Iterator[bytes]:
    while size > 0 and (part := file.read(min(size, CHUNK))):
        size -= len(part)
        yield part


def _digest(parts: Iterable[bytes], owner: str) -> bytes:
    made = hashlib.sha256(owner.encode() + b"|")
    for part in parts:
        made.update(part)
    return made.hexdigest().encode()


#: Kinds of numbers, and dimensions of arrays.
ARRAY_KINDS, DEEPEST = ("<f8", "|u1"), 4
#: What zipfile and NumPy raise of bytes that they did not write.
BROKEN = (
    zipfile.BadZipFile,
    NotImplementedError,
    ValueError,
    KeyError,
    TypeError,
    EOFError,
    RuntimeError,
    OverflowError,
    struct.error,
    SyntaxError,
    MemoryError,
)


class Unreadable(ValueError):
    """A file that cannot be read; the message says why."""


def packed(arrays: Mapping[str, np.ndarray], owner: str) -> bytes:
    """The bytes of a file of named arrays, with the seal of `owner` at its end.

    >>> raw = packed({"t": np.arange(3.0)}, "test")
    >>> raw[-71:-64]
    b'sha256:'
    """
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as file:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(array), allow_pickle=False)
            file.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue())
        file.comment = OPEN_SEAL
    return seal(stream.getvalue(), owner)


def unpacked(path: Any, owner: str) -> dict[str, np.ndarray]:
    """The arrays of such a file, in no more memory than the file has bytes."""
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise Unreadable("it is no ordinary file")
    with Path(path).open("rb") as file:
        if not sealed_at_the_end(file, owner):
            raise Unreadable("it was not written by save_run, or was cut or changed since")
        try:
            with zipfile.ZipFile(file) as members:
                return _members(members, file.seek(0, 2))
        except BROKEN as error:
            raise Unreadable(f"its parts cannot be read: {str(error)[:80]}") from None


def _members(file: zipfile.ZipFile, size: int) -> dict[str, np.ndarray]:
    infos = file.infolist()
    if sum(info.file_size for info in infos) > size:
        raise Unreadable("its parts are larger than the file")
    if any(info.compress_type != zipfile.ZIP_STORED for info in infos):
        raise Unreadable("its parts are compressed, which save_run does not do")
    names = [info.filename.removesuffix(".npy") for info in infos]
    if len(set(names)) < len(names):
        raise Unreadable("it has one part twice")
    return {name: _array(name, file.read(info)) for name, info in zip(names, infos, strict=True)}


def _array(name: str, raw: bytes) -> np.ndarray:
    """An array of plain numbers; its header claims no more than there is."""
    stream = io.BytesIO(raw)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise Unreadable(f"the header of '{name[:40]}' is of another version")
    shape, by_columns, kind = np.lib.format.read_array_header_1_0(stream)
    body = raw[stream.tell() :]
    if (
        kind.str not in ARRAY_KINDS
        or by_columns
        or len(shape) > DEEPEST
        or min(shape, default=0) < 0
    ):
        raise Unreadable(f"'{name[:40]}' is no array of plain numbers")
    count = 1
    for part in shape:
        count *= part
    if count * kind.itemsize != len(body):
        raise Unreadable(f"'{name[:40]}' does not have the size of its header")
    if count == 0:
        return np.zeros(shape, dtype=kind)
    return np.frombuffer(body, dtype=kind).reshape(shape).copy()


# -- The parts of a saved result, checked one by one: kinds, sizes, finite numbers -------------

#: Numbers that a float can have.
MOST = 1e300


def want(sound: bool, what: str) -> None:
    """Refuse a part that is not as it must be."""
    if not sound:
        raise Unreadable(what)


def array(
    arrays: Mapping[str, np.ndarray],
    name: str,
    shape: tuple[int | None, ...],
    *,
    open: bool = False,
    finite: bool = True,
) -> np.ndarray:
    """An array of floats of that shape, None where any size will do; finite, but that `open` ones
    may lack numbers (NaN), as at an instant that has no answer. Where not `finite`, others judge.
    """
    want(name in arrays, f"'{name}' is missing")
    found = arrays[name]
    sizes = zip(found.shape, shape, strict=False)
    fits = found.ndim == len(shape) and all(size is None or own == size for own, size in sizes)
    want(fits and found.dtype == np.float64, f"'{name}' is of another size or kind")
    sound = ~np.isinf(found) if open else np.isfinite(found)
    want(not finite or bool(sound.all()), f"'{name}' holds what is no finite number")
    return found


def read_records(
    arrays: Mapping[str, np.ndarray], name: str, system: System, count: int, analysis: str
) -> np.ndarray:
    """Kept records of so many instants: (instants, rows)."""
    rows = system.record_rows
    return array(arrays, name, (count, rows), open=analysis != "simulate")


def check_header(header: Mapping[str, Any], system: System) -> None:
    """Refuse words about a result that are of another kind, or name what the system has not."""
    want(header["analysis"] in (*ANALYSES, "close_loops", "simulate"), "its analysis is unknown")
    want(
        _number(header["regularization"]) and header["regularization"] >= 0.0,
        "'regularization' is no number",
    )
    want(_texts(header["notes"]), "'notes' are no texts")
    want(isinstance(header["status"], str), "'status' is no text")
    want(isinstance(header["ending"], str), "'ending' is no text")
    want(isinstance(header["doubts"], list), "'doubts' are no list")
    want(all(_doubt(one) for one in header["doubts"]), "'doubts' are of another kind")
    branch = header["branch"]
    pair = isinstance(branch, list) and len(branch) == 2 and all(map(_number, branch))
    want(branch is None or pair, "'branch' is no distance with its instant")
    gone = header["released_at"]
    want(isinstance(gone, dict) and all(map(_number, gone.values())), "'released_at' are no times")
    stats = header["stats"]
    counts = isinstance(stats, dict) and all(type(n) is int for n in stats.values())
    want(stats is None or counts, "'stats' are no counts")
    open_parts = header["dependencies"]
    if open_parts is not None:
        machine = system.mechanism
        joints = {joint.name for joint in machine.joints}
        joints |= {one.name for one in machine.contacts if one.closed}
        want(
            isinstance(open_parts, dict) and joints <= {*open_parts}, "'dependencies' lack a joint"
        )
        # a reaction has three parts, an effort one
        three = joints | {one.name for one in machine.contacts}
        sizes = {name: 3 if name in three else 1 for name in open_parts}
        sound = all(_truths(part, sizes[name]) for name, part in open_parts.items())
        want(sound, "'dependencies' are no truths")
    events = header["events"]
    sound = isinstance(events, list) and all(_event(one) for one in events)
    want(sound, "'events' are no names, times and truths")
    for key in ("works", "lost"):
        want(key not in header or _texts(header[key]), f"'{key}' are no texts")
    if "modes" in header:
        modes, contacts = header["modes"], header.get("contacts", [])
        want(isinstance(modes, dict) and all(map(_texts, modes.values())), "'modes' are no texts")
        want(_texts(contacts) and len(contacts) == len(events), "'contacts' are not of the events")
        impulses = header.get("impulses", [{}] * len(events))
        sound = isinstance(impulses, list) and all(map(_impulses, impulses))
        want(sound and len(impulses) == len(events), "'impulses' are not of the events")
        shared = header.get("shared", [[]] * len(events))
        sound = isinstance(shared, list) and all(map(_texts, shared))
        want(sound and len(shared) == len(events), "'shared' are not of the events")
    if "way" in header:
        settings = header["way"]
        want(
            isinstance(settings, list) and len(settings) == 4 and isinstance(settings[0], str),
            "'way' is none",
        )
        want(all(_number(part) for part in settings[1:]), "'way' holds what is no number")
        drivers = {driver.name for driver in system.drivers}
        want(drivers >= {*gone}, "'released_at' names what is no driver")


#: Of the parts of a `ModalState` what each has in a row: words, numbers, numbers of elements.
MODAL: dict[str, tuple[Any, ...]] = {
    "modes": (str,),
    "pairs": (str,),
    "on": (float,),
    "anchor": (float,),
    "phases": (float,),
    "closed": (int,),
    "beyond": (int,),
    "page": (float,),
    "lost": (float,),
    "fresh": (str, int, float),
    "struck": (int, float),
}


def closed_places(found: Any) -> dict[str, tuple[tuple[int, ...], tuple[float, ...]]]:
    """By contact the numbers of its places that are closed, and where it rolls from; refuses what
    is of another kind.
    """
    parts: dict[str, tuple[tuple[int, ...], tuple[float, ...]]] = {}
    rows: dict[str, Any] = found if isinstance(found, dict) else {"": None}
    for name, row in rows.items():
        pair = isinstance(row, list) and len(row) == 2 and all(isinstance(x, list) for x in row)
        sound = pair and len(row[1]) in (0, 6) and all(_number(part) for part in row[1])
        sound = sound and all(type(n) is int and n >= 0 for n in row[0])
        want(sound, "'closed' is of another kind")
        parts[name] = tuple(row[0]), tuple(row[1])
    return parts


def modal_state(found: Any) -> ModalState:
    """The modes that a motion goes on with; refuses what is of another kind."""
    parts = _modal_parts(found, ModalState)
    for name in ("groups", "shared"):
        rows = found[name]
        sound = isinstance(rows, list) and all(
            isinstance(row, list) and all(type(one) is int for one in row) for row in rows
        )
        want(sound and (name == "shared" or all(rows)), f"'modal.{name}' is of another kind")
        parts[name] = tuple(map(tuple, rows))
    return ModalState(**parts, end=ActiveSet(**_modal_parts(found["end"], ActiveSet)))


def _modal_parts(found: Any, kind: type) -> dict[str, Any]:
    """The parts that are rows of words and numbers."""
    names = {part.name for part in fields(kind)}
    want(isinstance(found, dict) and found.keys() == names, "'modal' has other parts")
    parts: dict[str, Any] = {}
    for name, kinds in MODAL.items():
        if name not in names:
            continue
        rows = found[name]
        if len(kinds) == 1 and isinstance(rows, list):
            rows = [[row] for row in rows]
        sound = isinstance(rows, list) and all(_row(row, kinds) for row in rows)
        want(sound, f"'modal.{name}' is of another kind")
        parts[name] = tuple(row[0] if len(kinds) == 1 else tuple(row) for row in rows)
    return parts


def _row(row: Any, kinds: tuple[Any, ...]) -> bool:
    return (
        isinstance(row, list)
        and len(row) == len(kinds)
        and all(type(one) is kind for one, kind in zip(row, kinds, strict=True))
    )


def _number(value: Any) -> bool:
    # a whole number may be too large for a float
    return type(value) in (int, float) and abs(value) < MOST


def _texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(part, str) for part in value)


def _truths(value: Any, count: int) -> bool:
    return isinstance(value, Sequence) and [type(part) for part in value] == [bool] * count


def _doubt(value: Any) -> bool:
    if not isinstance(value, dict) or value.keys() != {"kind", "t", "elements", "message"}:
        return False
    timed = value["t"] is None or _number(value["t"])
    words = value["kind"] in KINDS and isinstance(value["message"], str)
    return words and timed and _texts(value["elements"])


def _event(value: Any) -> bool:
    if not isinstance(value, list) or len(value) != 3:
        return False
    name, t, after = value
    return isinstance(name, str) and _number(t) and isinstance(after, bool)


def _impulses(value: Any) -> bool:
    if not isinstance(value, dict) or not all(isinstance(part, list) for part in value.values()):
        return False
    return all(len(part) == 2 and all(map(_number, part)) for part in value.values())


# -- Contacts of steps with impulses in saved results ------------------------------------------

#: Width of each table.
WIDTHS = {"which": 3, "numbers": 7}


def stepped_header(stepped: SteppedContacts) -> dict[str, Any]:
    """Names, and the one number."""
    return {"laws": stepped.laws, "shapes": stepped.shapes, "nearer": stepped.nearer}


def stepped_arrays(stepped: SteppedContacts) -> dict[str, np.ndarray]:
    """Its tables, of floats all."""
    names = ("first", "which", "numbers", "residuals")
    return {f"stepped.{name}": getattr(stepped, name).astype(float) for name in names}


def stepped_contacts(header: Any, arrays: Mapping[str, np.ndarray], n: int) -> SteppedContacts:
    """Stepped contacts of n instants from a file, checked."""
    names = ("laws", "shapes")
    sound = isinstance(header, dict) and all(
        isinstance(header.get(key), list) and all(isinstance(one, str) for one in header[key])
        for key in names
    )
    want(sound and isinstance(header.get("nearer"), float), "'stepped' is of another kind")
    first = array(arrays, "stepped.first", (n + 1,))
    count = int(first[-1])
    tables = {key: array(arrays, f"stepped.{key}", (count, w)) for key, w in WIDTHS.items()}
    which = tables["which"]
    steps = np.diff(first, prepend=0.0)
    whole = [(part == np.round(part)).all() for part in (first, which)]
    want(all(whole) and bool((steps >= 0.0).all()), "'stepped.first' holds no numbers of places")
    laws, shapes = len(header["laws"]), len(header["shapes"])
    known = (which[:, 0] >= 0) & (which[:, 0] < laws) & (which[:, 1:] < shapes).all(axis=1)
    want(bool(known.all()), "'stepped.which' names what there is not")
    return SteppedContacts(
        laws=tuple(header["laws"]),
        shapes=tuple(header["shapes"]),
        first=first.astype(np.int64),
        which=which.astype(np.int64),
        numbers=tables["numbers"],
        residuals=array(arrays, "stepped.residuals", (1, n, None)),
        nearer=header["nearer"],
    )


#: Format of a file; another one is refused.
FORMAT = 2
#: Whose seal a file carries.
OWNER = "mbody saved result"
#: A model is no larger than the file that contains it, which was looked at as a whole.
UNLIMITED = Limits(*[math.inf] * 3)
#: Keys that its header must have.
NEEDED = (
    "model", "values", "analysis", "regularization", "dependencies", "notes", "status", "stats",
    "events", "ending", "doubts", "branch", "released_at",
)  # fmt: skip
OTHERWISE_KEPT = ("by", "lost", "rounding")
ENERGIES = tuple(part.name for part in fields(Energy) if part.name not in OTHERWISE_KEPT)
#: What a motion with controllers or inputs that jump goes on with; a file does not keep it.
SAMPLED = ("inputs", "sampled")
ELSEWHERE = ("settings", "own", "modal", *SAMPLED)
ARRAYS = tuple(part.name for part in fields(Restart) if part.name not in ELSEWHERE)


def _open_parts(run: Solution) -> dict[str, list[bool]]:
    """What is not known to be determined: parts of reactions, efforts."""
    machine = run.mechanism
    found = {}
    for one in (*machine.joints, *acting_contacts(run)):
        parts = run.reaction(one.name).unique or (None,) * 3
        found[one.name] = [part is not True for part in parts]
    for each in (*machine.drivers, *machine.couplings):
        found[each.name] = [run.unique_effort(each.name) is not True]
    return found


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
        "dependencies": run.dependencies if run.shared is None else _open_parts(run),
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
        header["impulses"] = [{k: list(v) for k, v in one.impulses.items()} for one in run.events]
        header["shared"] = [list(one.shared) for one in run.events]
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
        settings = run.restart.settings
        header["way"] = [settings.method, settings.rtol, settings.atol, settings.step]
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
        settings = IntegrationSettings(header["way"][0], *map(float, header["way"][1:]))
        fixed: dict[str, Any] = {**parts, "own": own}
        modal = modal_state(header["modal"]) if "modal" in header else None
        restart = Restart(settings, **fixed, modal=modal)
        _check_restart(system, list(header["released_at"]), restart, float(t[-1]))
    if "given" in arrays:
        given = array(arrays, "given", (n, len(system.drivers), 3), open=True)

    def instants(name: str, when: Any) -> Solution:
        record = Record(
            [read_records(arrays, name, system, 1, analysis)[:, :, None]], 1, batch=False
        )
        return Solution(
            system, analysis, np.atleast_1d(when), record, None, regularization=regularization
        )

    contacts = header.get("contacts", [""] * len(header["events"]))
    impulses = header.get("impulses", [{}] * len(header["events"]))
    shared = header.get("shared", [[]] * len(header["events"]))
    events = tuple(
        EventRecord(
            name,
            t,
            instants(f"event.{n}", t),
            instants(f"after.{n}", t) if after else None,
            contacts[n],
            {contact: (float(a), float(b)) for contact, (a, b) in impulses[n].items()},
            shared=tuple(shared[n]),
        )
        for n, (name, t, after) in enumerate(header["events"])
    )
    block = np.ascontiguousarray(read_records(arrays, "pages", system, n, analysis)[:, :, None])
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
