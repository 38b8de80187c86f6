"""Saved results: what is loaded is what was saved, or there is one sentence, soon."""

import io
import json
import os
import zipfile
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import ModelError, gallery
from mbody.engineering import close_loops
from mbody.files.saved import OWNER, packed, unpacked
from mbody.model.simulation import EVEN, METHODS
from tests.fuzz.properties import guarded
from tests.support import driven_contacts


def swung(**options):
    return mbody.simulate(gallery.load("simple_pendulum"), 0.5, instants=4, **options)


def refused(path, *words):
    with pytest.raises(ModelError) as caught:
        guarded(lambda: mbody.load_run(path))
    told = str(caught.value)
    assert "\n" not in told and all(word in told for word in words), told


@pytest.fixture
def path(tmp_path):
    """A saved motion."""
    mbody.save_run(swung(), tmp_path / "run.npz")
    return tmp_path / "run.npz"


def resealed(path, change):
    """The same file with its arrays changed, by somebody who seals it anew."""
    arrays = unpacked(path, OWNER)
    change(arrays)
    path.write_bytes(packed(arrays, OWNER))


def test_what_is_saved_comes_back(tmp_path):
    driven = gallery.load("norton_fourbar")
    runs = [
        swung(),
        mbody.kinetostatics(driven, t=[0.0, 0.01]),
        mbody.kinetostatics(gallery.load("parallel_cranks"), t=[0.0, 0.1]),
        close_loops(driven),
        mbody.simulate(driven, 0.02, release={"motor": 0.01}, instants=4),
    ]
    for run in runs:
        mbody.save_run(run, tmp_path / "run.npz")
        again = mbody.load_run(tmp_path / "run.npz")
        for name in ("t", "regularization", "dependencies", "notes", "status", "stats", "analysis"):
            assert np.array_equal(getattr(again, name), getattr(run, name)), name
        table = run.record.table(slice(None))
        assert again.record.table(slice(None)).tobytes() == table.tobytes()
        assert again.mechanism == run.mechanism


@pytest.mark.parametrize(
    "closed",
    [{"hinge": [[0], False]}, {"foot": [[9], False]}, {"foot": [[-1], False]}, {"foot": 0}],
)
def test_contacts_that_are_closed_fit_the_mechanism(tmp_path, closed):
    run = mbody.statics(mbody.from_toml(driven_contacts.HELD_LADDER))
    mbody.save_run(run, tmp_path / "run.npz")

    def change(arrays):
        header = json.loads(arrays["header"].tobytes())
        header["closed"] |= closed
        arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)

    resealed(tmp_path / "run.npz", change)
    refused(tmp_path / "run.npz", "'closed'")


def test_a_motion_with_limits_goes_on_from_a_file(tmp_path):
    door = mbody.Mechanism("door", ground={"hinge": (0.0, 0.0)})
    door.add(
        mbody.Body("door", mass=20.0, inertia=6.0, cg=(0.45, 0.0), points={"hinge": (0.0, 0.0)}),
        mbody.Revolute(
            "hinge", "ground.hinge", "door.hinge", limits=(0.0, "110 deg"), restitution=0.4
        ),
        mbody.TorsionSpring("closer", "door", stiffness=8.0, free_angle=-0.5),
    )
    start = {"door": {"angle": "100 deg", "omega": 1.5}}
    door.simulation = mbody.SimulationSettings(until=2.0, start=start)
    first = mbody.simulate(door, 1.0)
    mbody.save_run(first, tmp_path / "run.npz")
    again = mbody.load_run(tmp_path / "run.npz")
    assert again.mode("hinge_low") == first.mode("hinge_low")
    one, other = (mbody.simulate(door, 2.0, start=run) for run in (first, again))
    assert (one["door"].angle == other["door"].angle).all()
    assert mbody.from_toml(mbody.to_toml(first.mechanism)) == door


def test_no_byte_may_change(path):
    raw = path.read_bytes()
    for place in range(0, len(raw), 97):
        made = bytearray(raw)
        made[place] ^= 4
        path.write_bytes(made)
        refused(path, "cut or changed")
    for size in (0, 1, 70, 71, len(raw) // 2, len(raw) - 1):
        path.write_bytes(raw[:size])
        refused(path, "was not written by save_run, or was cut or changed since")
    path.write_bytes(raw + b"\0")
    refused(path, "cut or changed")
    path.write_bytes(raw)
    mbody.load_run(path)


@pytest.mark.parametrize("number", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["t", "pages", "energy.kinetic", "restart.y", "restart.state"])
def test_what_is_no_number_is_refused(path, name, number):
    def change(arrays):
        arrays[name] = arrays[name].copy()
        arrays[name].reshape(-1)[0] = number

    resealed(path, change)
    refused(path, f"'{name}' holds what is no finite number")


SIZES = {
    "too few instants": lambda arrays: arrays.update(t=arrays["t"][:-1]),
    "too few rows": lambda arrays: arrays.update(pages=arrays["pages"][:, :-1].copy()),
    "one dimension": lambda arrays: arrays.update(pages=arrays["pages"].reshape(-1)),
    "small numbers": lambda arrays: arrays.update(t=arrays["t"].astype(np.float32)),
    "no state": lambda arrays: arrays.update({"restart.state": np.zeros(3)}),
    "a part of a method that has none": lambda arrays: arrays.update({"own.0": np.zeros(3)}),
    "no pages": lambda arrays: arrays.pop("pages"),
    "no words": lambda arrays: arrays.pop("header"),
    "words of numbers": lambda arrays: arrays.update(header=np.zeros(3)),
}


@pytest.mark.parametrize("case", SIZES)
def test_sizes_fit_the_mechanism(path, case):
    resealed(path, SIZES[case])
    refused(path, "save the result anew")


WORDS = [
    ("values", {}),
    ("values", []),
    ("values", {"g": None}),
    ("model", "{"),
    ("model", 3),
    ("analysis", "magic"),
    ("regularization", "much"),
    ("dependencies", {"O": [True]}),
    ("notes", "none"),
    ("status", None),
    ("stats", {"steps": 0.5}),
    ("works", ["gravity", "brake"]),
    ("events", [["a", 0.1, True]]),
    ("events", [3]),
    ("way", ["dop853"]),
    ("way", ["dop853", -1.0, 1e-8, 0.0]),
    ("way", ["rattle", 1e-8, 1e-8, 0.0]),
    ("released_at", {"motor": 0.1}),
    ("format", 1),
]


@pytest.mark.parametrize(("key", "value"), WORDS)
def test_words_fit_the_mechanism(path, key, value):
    def change(arrays):
        told = json.loads(arrays["header"].tobytes()) | {key: value}
        arrays["header"] = np.frombuffer(json.dumps(told).encode(), dtype=np.uint8)

    resealed(path, change)
    refused(path, "save the result anew")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["state", "y", "slope", "scale", "gained", "powers", "own"])
def test_no_state_hangs_a_motion(method, name):
    """Every number that a motion carries on, lost: one sentence at once."""
    machine = gallery.load("free_fourbar")
    step = {"step": 0.01} if method in EVEN else {}
    run = mbody.simulate(machine, 0.1, method=method, instants=3, **step)
    if run.restart is None:
        pytest.skip("the method keeps no state to go on from")
    part = getattr(run.restart, name)
    if name == "own":
        if not part:
            pytest.skip("the method carries nothing of its own")
        lost = tuple(np.where(np.arange(p.size).reshape(p.shape) == 0, np.inf, p) for p in part)
    else:
        lost = np.full_like(part, np.nan)
    spoilt = replace(run, restart=replace(run.restart, **{name: lost}))
    with pytest.raises(ModelError, match="is to go on from is damaged"):
        guarded(
            lambda: mbody.simulate(machine, 0.2, start=spoilt, method=method, instants=2, **step)
        )


def test_a_state_of_another_time_is_refused():
    """Going on from long before would take for ever."""
    run = swung()
    state = run.restart.state.copy()
    state[0] = -1e9
    spoilt = replace(run, restart=replace(run.restart, state=state))
    with pytest.raises(ModelError, match="its time is -1e"):
        guarded(lambda: mbody.simulate(run.mechanism, 1.0, start=spoilt))


# -- hostile files ----------------------------------------------------------------------------


def bomb(compression, shape, content):
    """A sealed file with a member whose header says more than there is, or that is compressed."""
    from mbody.files.saved import OPEN_SEAL, seal

    room, member = io.BytesIO(), io.BytesIO()
    head = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(member, head)
    with zipfile.ZipFile(room, "w", compression) as file:
        file.writestr("t.npy", member.getvalue() + content)
        file.comment = OPEN_SEAL
    return seal(room.getvalue(), OWNER)


def test_a_file_takes_no_more_memory_than_it_has_bytes(tmp_path):
    path = tmp_path / "bomb.npz"
    path.write_bytes(bomb(zipfile.ZIP_DEFLATED, (8_000_000,), bytes(64_000_000)))
    assert path.stat().st_size < 100_000
    refused(path, "larger than the file")
    path.write_bytes(bomb(zipfile.ZIP_DEFLATED, (4,), np.random.default_rng(1).bytes(32)))
    refused(path, "compressed")
    for shape in [(10**12,), (10**6, 10**6), (-1, -4), (2**63,), (4, 10**30, 0)]:
        path.write_bytes(bomb(zipfile.ZIP_STORED, shape, bytes(32)))
        refused(path, "save the result anew")


@pytest.mark.skipif(os.name != "posix", reason="files of Unix")
def test_files_that_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe.npz")
    refused(tmp_path / "pipe.npz", "is no ordinary file")
    refused("/dev/zero", "is no ordinary file")
    refused(tmp_path, "is no ordinary file")
    refused(tmp_path / ("x" * 5000), "cannot read")
    refused(tmp_path / "none.npz", "No such file")
    with (tmp_path / "huge.npz").open("wb") as file:
        file.truncate(10**12)
    refused(tmp_path / "huge.npz", "cut or changed")
