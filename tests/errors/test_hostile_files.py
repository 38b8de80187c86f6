"""Hostile files, tables and arguments: a sentence, soon, and in little memory."""

import json
import os
import socket
import subprocess
import sys

import pytest

from mbody import Mechanism, ModelError, cli
from mbody.files.model import load, save
from tests.errors.test_hostile import BODY, HEX, LONG, entries, law
from tests.fuzz.properties import guarded, sentence
from tests.support.paths import ROOT

# -- files ----------------------------------------------------------------------------------------


def not_read(path, *words):
    with pytest.raises(ModelError) as caught:
        guarded(lambda: load(path))
    sentence(caught.value)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_files_that_are_none(tmp_path):
    not_read(tmp_path / "none.toml", "there is no file")
    not_read(tmp_path, "is a folder")
    not_read(tmp_path / ("x" * 5000), "cannot be read")
    not_read("a\0b", "cannot be read")
    not_read("\ud800", "cannot be read")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(256)) * 100)
    not_read(binary, "is no text: byte 129 is not UTF-8")
    large = tmp_path / "large.toml"
    with large.open("wb") as stream:
        stream.truncate(100_000_000)
    not_read(large, "has more than 6 MB")
    utf16 = tmp_path / "utf16.toml"
    utf16.write_bytes("name = 'x'".encode("utf-16"))
    not_read(utf16, "is no text")


@pytest.mark.skipif(os.name != "posix", reason="files of Unix")
def test_files_that_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    not_read(tmp_path / "pipe.toml", "is no ordinary file")
    not_read("/dev/zero", "is no ordinary file")
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    not_read(tmp_path / "zero.toml", "is no ordinary file")
    (tmp_path / "ring.toml").symlink_to("ring.toml")
    not_read(tmp_path / "ring.toml", "cannot be read")
    with socket.socket(socket.AF_UNIX) as there:
        os.chdir(tmp_path)
        there.bind("s.toml")
        not_read(tmp_path / "s.toml", "is no ordinary file")
    secret = tmp_path / "secret.toml"
    secret.write_text("")
    secret.chmod(0)
    if not os.access(secret, os.R_OK):  # root reads everything
        not_read(secret, "may not be read: change its permissions")


def test_a_file_that_cannot_be_written(tmp_path):
    with pytest.raises(ModelError, match="cannot be written"):
        save(Mechanism("\ud800"), tmp_path / "x.toml")
    with pytest.raises(ModelError, match="cannot be written"):
        save(Mechanism(), tmp_path / "no" / "x.toml")


# -- tables beside a model ------------------------------------------------------------------------


def table(folder, name):
    """Read a model in `folder` that names a table."""
    model = folder / "model.toml"
    model.write_text(law(f"{{ table = {{ file = {json.dumps(name)} }} }}"))
    return load(model)


@pytest.mark.parametrize(
    "name",
    [
        "../secret.csv",
        "sub/../../secret.csv",
        "/etc/passwd",
        "/dev/zero",
        "link.csv",
        "up/secret.csv",
    ],
)
def test_tables_elsewhere(tmp_path, name):
    folder = tmp_path / "models"
    (folder / "sub").mkdir(parents=True)
    (tmp_path / "secret.csv").write_text("0,0\n1,1\n")
    if os.name == "posix":
        (folder / "link.csv").symlink_to(tmp_path / "secret.csv")
        (folder / "up").symlink_to(tmp_path)
    with pytest.raises(ModelError, match=r"lies outside the folder of the model|there is no file"):
        table(folder, name)


TABLES = {
    "empty": ("", "at least 2 points"),
    "one column": ("1\n2\n", "row 1 has no two numbers"),
    "two heads": ("x,y\nx,y\n1,2\n", "row 2 has no two numbers: ['x', 'y']"),
    "nan": ("0,0\n1,nan\n", "row 2 has no two numbers"),
    "1e400": ("0,0\n1,1e400\n", "row 2 has no two numbers"),
    "NUL": ("\0" * 1_000_000, "has no two numbers"),
    "not sorted": ("1,0\n0,0\n", "increase"),
    "too large": ("1,1\n" * 2_600_000, "larger than 10 MB"),
    "rows": ("1,1\n" * 2_400_000, "more than 100000 rows"),
    "blank rows": ("\n" * 9_000_000, "more than 100000 rows"),
    "commas": (",\n" * 4_000_000, "more than 100000 rows"),
    "one long row": ("11," * 3_300_000, "row"),
    "a quote without end": ('"' + "1\n" * 4_000_000, "no text of comma-separated values"),
}


@pytest.mark.parametrize("case", TABLES)
def test_tables(tmp_path, case):
    text, words = TABLES[case]
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(ModelError) as caught:
        guarded(lambda: table(tmp_path, "t.csv"))
    sentence(caught.value)
    assert words in str(caught.value)


def test_a_long_table(tmp_path):
    (tmp_path / "t.csv").write_text("t,s\n" + "".join(f"{n},{n % 7}\n" for n in range(90_000)))
    assert len(table(tmp_path, "t.csv")["m"].law.x) == 90_000


# -- the command ----------------------------------------------------------------------------------

#: Runs a command and writes on the last line of stdout how much memory it had, in kB.
MEASURED = """\
import sys
from mbody.cli import main
status = main(sys.argv[1:])
with open("/proc/self/status") as told:
    print("\\nkB", next(line.split()[1] for line in told if line.startswith("VmHWM")))
sys.exit(status)
"""
COMMANDS = {
    "many keys": "".join(f"k{n} = 1\n" for n in range(48_000)),
    "one bare word": "a" * 900_000,
    "a huge number": f"name = {HEX}\n",
    "lists in lists": "name = " + "[" * 100_000,
    "a call": "[bodies.a]\nmass = \"__import__('os').system('id')\"\n",
    "many units that are none": entries("parameters", '"1 zN"', 40_000),
    "many operations": entries("loads", f'{{ force = "{"+".join("t" * 190)}" }}', 1000),
    "many wrong joints": entries("joints", '{ revolute = ["x", "y"] }'),
    "a long body": f'{BODY}[joints]\nj = {{ revolute = ["a", "{LONG}"] }}\n',
    "half a character": '{"name": "\\ud800"}',
    "a table outside": law('{ table = { file = "/dev/zero" } }'),
    "a large table": law('{ table = { file = "large.csv" } }'),
    "many bodies and a slip": entries("bodies", "{}", 45_000) + "[loads]\nf = { torqe = 1 }\n",
}


linux = pytest.mark.skipif(sys.platform != "linux", reason="memory as Linux tells it")


def command(folder, *arguments, limit=300):
    """Status, stdout and stderr of the command in its own process; its memory is limited."""
    run = [sys.executable, "-X", "utf8", "-c", MEASURED, *map(str, arguments)]
    more = {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(
        run, cwd=folder, env={**os.environ, **more}, capture_output=True, timeout=60
    )
    out, _, used = done.stdout.decode().rpartition("\nkB ")
    assert float(used) / 1024 < limit, f"{used} kB"
    return done.returncode, out, done.stderr.decode()


@pytest.mark.slow
@linux
@pytest.mark.parametrize("case", COMMANDS)
def test_the_command_refuses_in_a_sentence(tmp_path, case):
    text = COMMANDS[case]
    file = tmp_path / ("model.json" if text.startswith("{") else "model.toml")
    file.write_text(text)
    (tmp_path / "large.csv").write_text("1,1\n" * 2_400_000 if case == "a large table" else "")
    status, out, err = command(tmp_path, "kinematics", file.name)
    assert (status, out) == (2, ""), err
    assert err.startswith("mbody: model") and "Traceback" not in err
    assert len(err) < 20_000


@pytest.mark.slow
@linux
def test_the_command_and_files_that_are_none(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "large.toml").touch()
    os.truncate(tmp_path / "large.toml", 100_000_000)
    for name in ("pipe.toml", "large.toml", "no.toml", ".", "/dev/zero", "/dev/stdin"):
        status, out, err = command(tmp_path, "kinematics", name)
        assert (status, out) == (2, ""), name
        assert err.startswith("mbody: ") and err.count("\n") == 1, err


@linux
def test_very_many_free_bodies_take_no_dense_matrix(tmp_path):
    (tmp_path / "model.toml").write_text(entries("bodies", "{}", 2000))
    status, _, err = command(tmp_path, "kinematics", "model.toml", limit=500)
    assert status == 1 and "6000 degrees left" in err


@pytest.mark.parametrize(
    "arguments",
    [
        ("--set", "a"),
        ("--set", "a=1e400"),
        ("--set", f"{'x' * 50_000}=1"),
        ("--at", "motor=" + "1," * 5000),
        ("--at", "t=nan"),
        ("--at", "t=__import__('os')"),
        ("--at", f"{'x' * 50_000}=1"),
        ("--over", "x" * 50_000),
        ("--over", "turn", "--instants", "9" * 5000),
        ("--over", "turn", "--instants", "²"),
        ("--units", "x" * 50_000),
        ("--units", "m-m-m"),
        ("x" * 50_000,),
    ],
    ids=lambda arguments: " ".join(arguments)[:20],
)
def test_arguments_of_the_command(arguments, capsys):
    status = cli.main(["kinematics", "slider_crank", *arguments])
    captured = capsys.readouterr()
    assert status == 2 and captured.out == ""
    assert captured.err.startswith("mbody: ") and captured.err.count("\n") == 1
    assert len(captured.err) < 20_000
