"""Corruptions of what is kept in files: saved results, and folders of sweeps.

Of a saved result either everything comes back as it was or there is one sentence; of what was
changed and sealed anew, as only somebody could who means it, what is accepted can be worked with.
A folder of a sweep gives the numbers of the sweep to the last bit, or one sentence.
"""

import contextlib
import copy
import functools
import io
import json
import shutil
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any
from unittest import mock

import numpy as np

import mbody
from mbody import ModelError, SolveError, gallery, makers
from mbody.engineering import close_loops
from mbody.files.saved import OPEN_SEAL, OWNER, packed, seal, unpacked
from mbody.sweeps import Uniform, monte_carlo
from tests.fuzz import KEPT, corpus, properties
from tests.fuzz.plain import Report, progress

#: Designs of a piece of the sweep, and of all.
PIECE, COUNT = 64, 200
NUMBERS = (
    *(float("nan"), float("inf"), -float("inf"), 0.0, -0.0, -1.0, 1e300, -1e300, 5e-324),
    *(1e-300, 1.0, 1e9, 0.5),
)


# -- corruptions of bytes ---------------------------------------------------------------------


def spoilt(random: Random, raw: bytes, other: bytes) -> bytes:
    """Bytes with one to three changes, as disks, transfers and hands make them."""
    for _ in range(random.choice((1, 1, 2, 3))):
        raw = CHANGES[random.choice(list(CHANGES))](random, raw, other)
    return raw


def flip(random: Random, raw: bytes, other: bytes) -> bytes:
    made = bytearray(raw)
    for _ in range(random.choice((1, 1, 1, 4, 64))):
        if made:
            made[random.randrange(len(made))] ^= 1 << random.randrange(8)
    return bytes(made)


def cut(random: Random, raw: bytes, other: bytes) -> bytes:
    place = random.choice((random.randrange(len(raw) + 1), max(0, len(raw) - random.randrange(99))))
    return raw[:place] if random.random() < 0.8 else raw[place:]


def blank(random: Random, raw: bytes, other: bytes) -> bytes:
    low = random.randrange(len(raw) + 1)
    size = min(len(raw) - low, random.choice((1, 8, 512, 4096)))
    return raw[:low] + bytes([random.choice((0, 255))]) * size + raw[low + size :]


def exchange(random: Random, raw: bytes, other: bytes) -> bytes:
    size = random.choice((8, 64, 512))
    if len(raw) < 2 * size:
        return raw[::-1]
    i, j = sorted(random.randrange(len(raw) - size + 1) for _ in "ij")
    if j - i < size:
        return raw[:i] + raw[i + size :]
    return raw[:i] + raw[j : j + size] + raw[i + size : j] + raw[i : i + size] + raw[j + size :]


def splice(random: Random, raw: bytes, other: bytes) -> bytes:
    i, j = random.randrange(len(raw) + 1), random.randrange(len(other) + 1)
    kind = random.randrange(3)
    if kind == 0:
        return raw[:i] + other[j:]
    piece = other[j : j + random.choice((8, 100, 4096))]
    return raw[:i] + piece + raw[i + len(piece) * (kind - 1) :]


CHANGES: dict[str, Callable[[Random, bytes, bytes], bytes]] = {
    "flip": flip,
    "cut": cut,
    "blank": blank,
    "exchange": exchange,
    "splice": splice,
}


# -- saved results ----------------------------------------------------------------------------


@functools.cache
def saved() -> tuple[bytes, ...]:
    """Files of results of every kind."""
    swing, free = gallery.load("simple_pendulum"), gallery.load("free_fourbar")
    driven = gallery.load("norton_fourbar")
    runs = (
        mbody.simulate(free, 0.3, instants=5),
        mbody.simulate(free, 0.1, method="rattle", step=0.01, instants=3),
        mbody.simulate(free, 0.05, method="radau5", instants=3),
        mbody.simulate(gallery.load("bouncing_ball"), 1.5, instants=4),
        mbody.simulate(swing, 0.5, instants=3, events=[mbody.Event("pendulum.omega")]),
        mbody.simulate(driven, 0.02, release={"motor": 0.01}, instants=4),
        mbody.kinetostatics(driven, t=[0.0, 0.01]),
        mbody.kinetostatics(gallery.load("parallel_cranks"), t=[0.0, 0.1]),
        mbody.kinematics(driven, turn=True, instants=5),
        close_loops(free),
    )
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for run in runs:
            path = Path(folder, "run.npz")
            mbody.save_run(run, path)
            found.append(path.read_bytes())
    return tuple(found)


@functools.cache
def held(raw: bytes) -> dict[str, np.ndarray]:
    """The arrays of a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "run.npz")
        path.write_bytes(raw)
        return unpacked(path, OWNER)


def swapped(random: Random, raw: bytes, other: bytes) -> bytes:
    """The members of a zip, one of them renamed, left out or taken from another file; no seal."""
    room = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(raw)) as ours, zipfile.ZipFile(io.BytesIO(other)) as theirs:
        members = {name: ours.read(name) for name in ours.namelist()}
        one, two = (random.choice(list(members)) for _ in range(2))
        kind = random.randrange(4)
        if kind == 0:
            members[one], members[two] = members[two], members[one]
        elif kind == 1:
            members[one] = theirs.read(random.choice(theirs.namelist()))
        elif kind == 2:
            del members[one]
        else:
            members[one] = flip(random, members[one], b"")
        pack = random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
        with zipfile.ZipFile(room, "w", pack) as made:
            for name, content in members.items():
                made.writestr(name, content)
            if random.random() < 0.5:
                made.comment = ours.comment
    return room.getvalue()


def edited(random: Random, raw: bytes, other: bytes) -> bytes:
    """Arrays or words changed, and all sealed anew."""
    arrays = dict(held(raw))
    told = json.loads(arrays["header"].tobytes())
    for _ in range(random.choice((1, 1, 2, 4))):
        kind = random.random()
        name = random.choice([key for key in arrays if key != "header"])
        if kind < 0.4 and arrays[name].size and arrays[name].dtype == np.float64:
            made = arrays[name].copy()
            made.reshape(-1)[random.randrange(made.size)] = random.choice(NUMBERS)
            arrays[name] = made
        elif kind < 0.5:
            arrays[name] = reshaped(random, arrays[name])
        elif kind < 0.6:
            two = random.choice(list(arrays))
            arrays[name], arrays[two] = arrays[two], arrays[name]
        elif kind < 0.65 and len(arrays) > 2:
            del arrays[name]
        else:
            words(random, told)
    if arrays["header"].dtype == np.uint8:
        arrays["header"] = np.frombuffer(json.dumps(told).encode(), dtype=np.uint8)
    return packed(arrays, OWNER)


def reshaped(random: Random, array: np.ndarray) -> np.ndarray:
    made = array.reshape(-1)
    kind = random.randrange(8)
    if kind < 5:
        return (
            made[: len(made) // 2],
            np.concatenate([made, made]),
            made[None],
            np.zeros(0),
            made,
        )[kind]
    return np.zeros(array.shape, dtype=(np.float32, complex, np.int64)[kind - 5])


def words(random: Random, told: dict[str, Any]) -> None:
    """One change of what a file says of itself, somewhere."""
    table: Any = told
    key = random.choice(list(table))
    while isinstance(table[key], dict | list) and table[key] and random.random() < 0.7:
        table = table[key]
        key = random.choice(list(table) if isinstance(table, dict) else range(len(table)))
    if random.random() < 0.2 and isinstance(table, dict):
        del table[key]
    elif isinstance(table[key], float) and random.random() < 0.6:
        table[key] = random.choice(NUMBERS)
    else:
        table[key] = copy.deepcopy(random.choice(corpus.VALUES))


def forged(random: Random, raw: bytes, other: bytes) -> bytes:
    """Bytes changed below the seal, which is made anew: headers of members and of the zip."""
    body = raw[: -len(OPEN_SEAL)]
    return seal(flip(random, body, other) + OPEN_SEAL, OWNER)


def check_saved(raw: bytes, original: bytes, is_sealed: bool, folder: Path) -> bool:
    """Load a file; whether it was taken for a result."""
    path = folder / "run.npz"
    path.write_bytes(raw)
    try:
        run = mbody.load_run(path)
    except ModelError as error:
        one_sentence(error)
        return False
    if not is_sealed:
        ours, theirs = held(original), unpacked(path, OWNER)
        assert ours.keys() == theirs.keys(), "another set of parts was accepted"
        for name, part in ours.items():
            assert part.tobytes() == theirs[name].tobytes(), f"another '{name}' was accepted"
        return True
    with contextlib.suppress(ModelError, SolveError), np.errstate(all="ignore"):
        run.data()
        assert str(run)
    with contextlib.suppress(ModelError, SolveError), np.errstate(all="ignore"):
        if run.analysis == "simulate":
            last = float(run.t[-1])
            mbody.simulate(run.mechanism, last + 0.01, start=run, instants=2)
    return True


def one_sentence(error: Exception) -> None:
    properties.sentence(error)
    assert "\n" not in str(error), f"more than one sentence: {str(error)[:300]}"


# -- folders of sweeps ------------------------------------------------------------------------


def swept(folder: Path | None) -> Any:
    """A small sweep of several pieces."""
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    samples = monte_carlo({"crank.A.x": Uniform(0.02)}, COUNT, seed=3)
    measure = {"pin": "peak(A.force)", "effort": "motor.effort"}
    with mock.patch("mbody.sweeps.run._piece", lambda job, far: PIECE):
        return mbody.sweep(machine, samples, measure=measure, to=folder, t=[0.0, 0.1], threads=1)


@functools.cache
def reference() -> tuple[dict[str, bytes], dict[str, bytes]]:
    """The numbers of the sweep in memory, and the files of its folder."""
    found = swept(None)
    numbers = {name: found[name].tobytes() for name in found.names}
    with tempfile.TemporaryDirectory() as folder:
        swept(Path(folder))
        files = {path.name: path.read_bytes() for path in Path(folder).iterdir()}
    return numbers, files


def changed(random: Random) -> dict[str, bytes]:
    """The files of the folder after something happened to them."""
    files = dict(reference()[1])
    for _ in range(random.choice((1, 1, 2, 3))):
        one, two = random.choice(list(files)), random.choice(list(files))
        kind = random.random()
        if kind < 0.55:
            files[one] = spoilt(random, files[one], files[two])
        elif kind < 0.7:
            files[one], files[two] = files[two], files[one]
        elif kind < 0.8:
            files[one] = files[two]
        elif kind < 0.9 and len(files) > 1:
            del files[one]
        elif "sweep.json" in files:
            files["sweep.json"] = manifest(random, files["sweep.json"])
    return files


def manifest(random: Random, raw: bytes) -> bytes:
    try:
        told = json.loads(raw)
        words(random, told)
    except (ValueError, RecursionError, IndexError, TypeError, KeyError):
        return b"{}"
    return json.dumps(told).encode()


def check_folder(files: dict[str, bytes], folder: Path) -> bool:
    """Go on with the sweep in a folder; whether it was gone on with."""
    where = folder / "sweep"
    shutil.rmtree(where, ignore_errors=True)
    where.mkdir()
    for name, content in files.items():
        (where / name).write_bytes(content)
    try:
        found = swept(where)
    except ModelError as error:
        one_sentence(error)
        return False
    assert found.done.all() and not found.failures
    for name, numbers in reference()[0].items():
        assert found[name].tobytes() == numbers, f"other numbers of '{name}'"
    return True


# -- runs -------------------------------------------------------------------------------------


def made(kind: str, random: Random) -> Any:
    """One input of a kind: files of a folder, or bytes with those that they were made of."""
    if kind == "folder":
        return changed(random)
    raw, other = random.choice(saved()), random.choice(saved())
    if kind == "saved":
        change = swapped if random.random() < 0.25 else spoilt
    else:
        change = forged if random.random() < 0.25 else edited
    return change(random, raw, other), raw


def check(kind: str, seed: str, folder: Path) -> bool:
    """Whether the corruption of a seed was taken; an error where a property is broken."""
    given, found = made(kind, Random(seed)), [False]

    def run() -> None:
        if kind == "folder":
            found[0] = check_folder(given, folder)
        else:
            found[0] = check_saved(*given, kind == "resealed", folder)

    properties.guarded(run)
    return found[0]


def fuzz(runs: int, seed: int, report: Report, kinds: list[str]) -> None:
    """So many corruptions; number n of a seed is always the same."""
    weights = [KEPT[kind] for kind in kinds]
    saved(), reference()  # nobody waits for these within an input
    with tempfile.TemporaryDirectory() as folder:
        for n in progress(runs, report):
            own = f"{seed}:{n}"
            kind = Random(own).choices(kinds, weights)[0]
            attempt = functools.partial(check, kind, own, Path(folder))
            report.count(kind, attempt, own, own.encode(), "seed")
