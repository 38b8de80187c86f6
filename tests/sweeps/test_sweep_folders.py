"""Folders of sweeps: what is in them is of the sweep that reads it, or it is done again."""

import json
import os
import shutil
import threading
import time

import pytest
from numpy.testing import assert_array_equal

import mbody
from mbody import makers
from mbody.files.saved import OPEN_SEAL, seal, sealed
from mbody.files.tables import write_whole
from mbody.sweeps import Normal, monte_carlo
from mbody.sweeps import job as store
from mbody.sweeps.job import remove_abandoned
from tests.support.cases import first_fast

pytest.importorskip("pyarrow")

#: Designs of a piece in these tests, and of all.
PIECE, COUNT = 64, 200
MEASURE = {"pin": "peak(A.force)", "effort": "motor.effort"}


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch):
    monkeypatch.setattr("mbody.sweeps.run._piece", lambda job, far: PIECE)


def swept(to=None, seed=1, machine=None, **options):
    machine = machine or makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    samples = monte_carlo({"crank.A.x": Normal(tolerance=0.02)}, COUNT, seed=seed)
    options = {"t": [0.0, 0.1], "threads": 1, **options}
    return mbody.sweep(machine, samples, measure=MEASURE, to=to, **options)


def same(one, other):
    assert one.failures == other.failures and one.done.all() and other.done.all()
    for name in one.names:
        assert_array_equal(one[name], other[name])


def pieces(folder):
    found = sorted(folder.glob("designs-*.parquet"))
    assert len(found) == -(-COUNT // PIECE)
    return found


def again(folder, **options):
    """The sweep once more, and how many pieces it did."""
    calls = []
    found = swept(folder, progress=lambda done, of: calls.append(done), **options)
    return found, len(calls)


def test_a_folder_that_is_whole_is_read(tmp_path):
    swept(tmp_path)
    found, done = again(tmp_path)
    assert done == 0
    same(found, swept())


def test_another_sweep_does_not_take_over_pieces(tmp_path):
    """Without the manifest nothing but the pieces themselves says whose they are."""
    swept(tmp_path, seed=1)
    (tmp_path / "sweep.json").unlink()
    found, done = again(tmp_path, seed=2)
    assert done == 4
    same(found, swept(seed=2))


def test_a_lost_manifest_loses_no_piece(tmp_path):
    swept(tmp_path)
    (tmp_path / "sweep.json").unlink()
    found, done = again(tmp_path)
    assert done == 0
    same(found, swept())


def spoil_copy(files):
    shutil.copy(files[0], files[1])


def spoil_exchange(files):
    first = files[0].read_bytes()
    files[0].write_bytes(files[1].read_bytes())
    files[1].write_bytes(first)


def spoil_bit(files):
    raw = bytearray(files[1].read_bytes())
    raw[len(raw) // 2] ^= 1
    files[1].write_bytes(raw)


def spoil_cut(files):
    files[1].write_bytes(files[1].read_bytes()[:-100])


def spoil_number(files):
    """As a tool would that reads Parquet, changes a number and writes it with the metadata."""
    import pyarrow
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(files[1])
    changed = pyarrow.array(table["pin"].to_numpy() * 1.001)
    table = table.set_column(table.column_names.index("pin"), "pin", changed)
    pyarrow.parquet.write_table(table, files[1])


SPOILT = {
    "copied": (spoil_copy, 1),
    "exchanged": (spoil_exchange, 2),
    "one bit": (spoil_bit, 1),
    "cut": (spoil_cut, 1),
    "a number": (spoil_number, 1),
    "empty": (lambda files: files[1].write_bytes(b""), 1),
    "text": (lambda files: files[1].write_text("no table"), 1),
    "lost": (lambda files: files[1].unlink(), 1),
}


@first_fast("case", SPOILT, 2)
def test_a_piece_that_does_not_fit_is_done_again(tmp_path, case):
    spoil, count = SPOILT[case]
    swept(tmp_path)
    spoil(pieces(tmp_path))
    found, done = again(tmp_path)
    assert done == count
    same(found, swept())
    assert again(tmp_path)[1] == 0


def test_a_piece_of_monstrous_size_is_not_read(tmp_path):
    swept(tmp_path)
    with pieces(tmp_path)[1].open("r+b") as file:
        file.truncate(10**12)
    found, done = again(tmp_path)
    assert done == 1
    same(found, swept())


def test_what_changes_under_an_open_sweep_is_told(tmp_path):
    found = swept(tmp_path)
    spoil_bit(pieces(tmp_path))
    with pytest.raises(mbody.ModelError, match="was changed or deleted since the sweep wrote it"):
        found["pin"]


def test_what_decides_other_designs_is_of_the_sweep(tmp_path):
    """Formulas and guesses are in no number of the kernels."""
    text = """
    [parameters]
    r = 1
    [bodies.arm]
    mass = 1
    points = { A = ["%s", 0] }
    [joints]
    O = { revolute = ["ground", "arm"] }
    [drivers]
    motor = { angle = "arm", law = "10 rad/s*t" }
    [measures]
    x = "arm.A.x"
    """

    def arm(formula):
        machine = mbody.from_toml(text % formula)
        return mbody.sweep(machine, {"r": [1.0, 2.0]}, "kinematics", to=tmp_path, t=[0.0])

    assert arm("r")["x"].tolist() == [1.0, 2.0]
    with pytest.raises(mbody.ModelError, match="another sweep, with other model"):
        arm("r^2")


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[1]", b"null", b"\xff\xfe", b"[" * 100_000, b'{"model": NaN']
)
def test_a_damaged_manifest_is_told(tmp_path, content):
    swept(tmp_path)
    (tmp_path / "sweep.json").write_bytes(content)
    with pytest.raises(mbody.ModelError, match=r"sweep\.json' is damaged: delete it"):
        swept(tmp_path)


def test_an_edited_manifest_is_another_sweep(tmp_path):
    swept(tmp_path)
    path = tmp_path / "sweep.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"samples": "0" * 64}))
    with pytest.raises(mbody.ModelError, match="another sweep, with other samples"):
        swept(tmp_path)


def test_a_full_disk_is_told(tmp_path, monkeypatch):
    real = store.write_whole

    def full(path, content):
        if path.name.startswith("designs-000000064"):
            raise OSError(28, "No space left on device")
        real(path, content)

    with monkeypatch.context() as patch:
        patch.setattr(store, "write_whole", full)
        with pytest.raises(mbody.ModelError, match=r"cannot write a sweep to .*No space left"):
            swept(tmp_path)
    assert again(tmp_path)[1] == 3


def test_several_writers_of_one_piece(tmp_path):
    """Every write succeeds, and a reader never sees part of a file."""
    path, stop = tmp_path / "designs-000000000.parquet", threading.Event()
    contents = [seal(bytes([n]) * 200_000 + OPEN_SEAL, "one") for n in range(3)]
    write_whole(path, contents[0])
    failed, torn, reads = [], [], []

    def write(content):
        for _ in range(100):
            try:
                write_whole(path, content)
            except OSError as error:
                failed.append(error)

    def read():
        while not stop.is_set():
            reads.append(1)
            if not sealed(path.read_bytes(), "one"):
                torn.append(1)

    reader = threading.Thread(target=read)
    writers = [threading.Thread(target=write, args=(content,)) for content in contents]
    for thread in (reader, *writers):
        thread.start()
    for thread in writers:
        thread.join()
    stop.set()
    reader.join()
    assert reads and not failed and not torn
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_what_killed_writers_left_is_cleared_after_a_day(tmp_path):
    old, new = tmp_path / "designs-1.part", tmp_path / "designs-2.part"
    for path in (old, new):
        path.write_bytes(b"half")
    day = time.time() - 90_000
    os.utime(old, (day, day))
    remove_abandoned(tmp_path)
    assert not old.exists() and new.exists()


@pytest.mark.parametrize("name", ["error", "design"])
def test_names_that_the_table_has_itself(name):
    with pytest.raises(mbody.ModelError, match=f"a measure cannot have the name '{name}'"):
        mbody.sweep(makers.four_bar(1, 3, 2, 3.5), {"crank.A.x": [1.0]}, measure={name: "A.force"})
