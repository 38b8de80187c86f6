"""Files that are written back keep what did not change: comments, order, formulas and units."""

import difflib

import mbody
from mbody import gallery
from mbody.files.model.read import built
from mbody.files.model.write import as_data
from mbody.model.model_notes import with_numbers
from tests.support.cases import first_fast

MACHINE = """\
# a slider-crank
units = "mm-N-s"  # plain numbers

[ground]
points = { O = [0, 0] }
[bodies]
crank = { mass = "1 kg", inertia = "800 kg*mm^2", points = { O = [0, 0], A = ["40 mm", 0] } }  # it
rod.mass = "2 kg"  # weighed
rod.inertia = 0
rod.cg = [50, 0]
rod.points = { A = [0, 0], "B" = [120, 0] }
piston = { mass = "0.5 kg", inertia = 0 }
[joints]  # by the words of a textbook
O = { pin = ["ground.O", "crank.O"] }
A = { hinge = ["crank.A", "rod.A"] }
B = { pin = ["rod.B", "piston"], friction = 0.1, pin_radius = "5 mm" }
guide = { slider = ["ground.O", "piston"] }
[drivers.motor]
angle = "crank"
law = "600 rpm * t"  # turns
"""


def saved(machine, folder):
    file = folder / "written.toml"
    mbody.save(machine, file)
    again = mbody.load(file)
    assert as_data(again)["bodies"].keys() == as_data(machine)["bodies"].keys()
    return file.read_text("utf-8"), again


def changed_lines(before, after):
    """Lines that are gone, and those that are new."""
    lines = [*difflib.ndiff(before.splitlines(), after.splitlines())]
    return [[line[2:] for line in lines if line[0] == sign] for sign in "-+"]


@first_fast("name", gallery.names(), 9)
def test_a_model_that_did_not_change_is_its_file(name, tmp_path):
    text = gallery.path(name).read_text("utf-8")
    for beside in gallery.path(name).parent.glob("*.csv"):
        (tmp_path / beside.name).write_bytes(beside.read_bytes())
    assert saved(gallery.load(name), tmp_path)[0] == text


@first_fast("name", gallery.names(), 9)
def test_a_model_of_the_gallery_keeps_its_comments(name, tmp_path):
    """A note behind every line but those of long texts; guesses, a title and units are changed."""
    text = gallery.path(name).read_text("utf-8")
    for beside in gallery.path(name).parent.glob("*.csv"):
        (tmp_path / beside.name).write_bytes(beside.read_bytes())
    lines = text.split("\n")
    if '"""' not in text:
        lines = [f"{line}  # {n}" if line.strip() else line for n, line in enumerate(lines)]
    text = "\n".join(lines)
    machine = mbody.from_toml(text, folder=tmp_path)
    data = as_data(machine)
    for body in data["bodies"].values():
        body["guess"] = {"angle": "12.5 deg", "x": 0.5, "y": 0.25}
    data |= {"name": "another", "output_units": {"mass": "kg"}}
    other = built(data)
    vars(other)["file_text"] = text
    written, again = saved(other, tmp_path)
    assert as_data(again) == as_data(other)
    gone, new = changed_lines(text, written)
    assert all("guess" in line or "name" in line or "{" in line for line in gone)
    assert len(gone) <= len(data["bodies"]) + 1
    assert len(new) <= len(data["bodies"]) + 4


def test_a_number_keeps_its_unit(tmp_path):
    machine = mbody.from_toml(MACHINE)
    made = with_numbers(machine, {"crank.mass": 0.0015, "crank.inertia": 0.9, "crank.A.x": 41.5})
    written, again = saved(made, tmp_path)
    gone, new = changed_lines(MACHINE, written)
    assert len(gone) == len(new) == 1 and new[0].endswith("# it")
    assert '"1.5 kg"' in new[0] and '"900 kg*mm^2"' in new[0] and '"41.5 mm"' in new[0]
    assert again["crank"] == made["crank"]


def test_words_of_kinds_dotted_keys_and_what_is_added_or_gone(tmp_path):
    machine = mbody.from_toml(MACHINE)
    data = as_data(machine)
    data["joints"]["B"]["friction"] = 0.25
    del data["joints"]["B"]["pin_radius"], data["joints"]["B"]["friction"]
    data["bodies"]["rod"]["guess"] = "15 deg"
    del data["bodies"]["rod"]["cg"]
    data["measures"] = {"x": "piston.x"}
    data["note"] = "more"
    other = built(data)
    vars(other)["file_text"] = MACHINE
    written, again = saved(other, tmp_path)
    assert as_data(again) == as_data(other)
    gone, new = changed_lines(MACHINE, written)
    assert [line.partition(" ")[0] for line in gone] == ["rod.cg", "B"]
    assert {'rod.guess  = "15 deg"', 'note  = "more"'} <= set(new)
    assert written.count("pin = ") == 2 and "hinge" in written and "[measures]" in written


def test_what_cannot_be_changed_in_place_is_written_anew(tmp_path):
    machine = mbody.from_toml(MACHINE)
    data = as_data(machine)
    data["bodies"]["rod"] = {"mass": "2 kg", "points": {"A": [0, 0], "B": [90, 0]}}
    del data["drivers"]
    other = built(data)
    vars(other)["file_text"] = MACHINE
    assert as_data(saved(other, tmp_path)[1]) == as_data(other)
    mbody.save(machine, tmp_path / "a.json")
    assert as_data(mbody.load(tmp_path / "a.json")) == as_data(machine)
