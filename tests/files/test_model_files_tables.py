"""Tables beside the model file."""

import math
import os

import pytest

import mbody
from mbody import from_toml, to_toml
from tests.support.model_files import says_in_file

TABLED = """
[bodies.crank]
[joints]
O = { revolute = ["ground", "crank"] }
[drivers.motor]
angle = "crank"
law = { table = { file = "FILE" } }
"""


def tabled(folder, content, name="lift.csv", head=""):
    folder.mkdir(exist_ok=True)
    if content is not None:
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    (folder / "m.toml").write_text(head + TABLED.replace("FILE", name))
    return mbody.load(folder / "m.toml")["motor"].law


@pytest.mark.parametrize(
    "content",
    [
        "0,0\n1,30\n2,-90\n",
        "time,angle\n0,0\n1,30\n2,-90\n",
        "\ufefft,phi,remark\r\n\r\n 0 , 0 ,x\r\n1,3e1,y\r\n2,-90.0,z\r\n",
        '"t","phi"\n"0","0"\n"1","30"\n"2","-90"',
    ],
)
def test_tables_with_and_without_a_header(content, tmp_path):
    """The same points as in the model itself: plain angles are degrees, or what the file says."""
    inline = TABLED.replace('file = "FILE"', "x = [0, 1, 2], y = [0, 30, -90]")
    law = tabled(tmp_path, content)
    assert law == from_toml(inline)["motor"].law
    assert law.y == (0.0, math.radians(30.0), math.radians(-90.0))
    head = 'angle = "rad"\n'
    assert tabled(tmp_path, content, head=head) == from_toml(head + inline)["motor"].law
    machine = mbody.load(tmp_path / "m.toml")
    assert from_toml(to_toml(machine)) == machine


def test_tables_lie_below_the_model(tmp_path):
    (tmp_path / "secret.csv").write_text("0,0\n1,1\n")
    home = tmp_path / "home"
    (home / "data").mkdir(parents=True)
    good = "0,0\n1,1\n"
    assert tabled(home, good, "data/lift.csv").y[1] == math.radians(1.0)
    assert tabled(home, None, "data/../data/lift.csv").x == (0.0, 1.0)
    (home / "inside.csv").symlink_to(home / "data" / "lift.csv")
    assert tabled(home, None, "inside.csv").x == (0.0, 1.0)
    (home / "out.csv").symlink_to(tmp_path / "secret.csv")
    (home / "up").symlink_to(tmp_path)
    (home / "loop.csv").symlink_to(home / "loop.csv")
    os.mkfifo(home / "pipe.csv")
    outside = ("../secret.csv", "data/../../secret.csv", "out.csv", "up/secret.csv")
    for name in (*outside, str(tmp_path / "secret.csv"), str(home / "data" / "lift.csv")):
        with says_in_file("lies outside the folder of the model"):
            tabled(home, None, name)
    for name in ("no.csv", "data", "", ".", "loop.csv", "pipe.csv", "a\\\\u0000b", "x" * 300):
        with says_in_file("there is no file", "lies outside"):
            tabled(home, None, name)
    with says_in_file("a model from text has no folder"):
        from_toml(TABLED.replace("FILE", "data/lift.csv"))
    both = TABLED.replace('file = "FILE"', 'file = "data/lift.csv", x = [0, 1]')
    with says_in_file("give x and y, or the file that has them"):
        from_toml(both, folder=home)
