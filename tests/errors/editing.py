"""Edits of the drawing board that are refused."""

import functools

from mbody.edit.document import Document
from mbody.edit.edits import Editor

#: What the edits are of: a link that is pinned, one that hangs on it, one by itself.
TEXT = """\
units = "mm-N-s"
[parameters]
a = "30 mm"
[ground]
points = { O = [0, 0], Q = ["a", 5] }
[bodies]
crank = { points = { O = [0, 0], A = [40, 0], M = ["9*cos(45 deg)", 2] } }
rod = { points = { A = [0, 0], B = [120, 0] } }
ram = { points = { B = [200, 30] } }
wheel = {}
[joints]
O = { revolute = ["ground.O", "crank.O"] }
A = { revolute = ["crank.A", "rod.A"] }
hub = { revolute = ["ground", "wheel"] }
[loads]
F = { force = "3*a*(1 N/m)", at = "rod.B" }
"""
HELD = TEXT.replace("wheel = {}", 'wheel = { guess = { x = "a" } }')
HUNG = TEXT.replace("wheel = {}", "wheel = { points = { H = [0, 0] } }")
HUNG = HUNG.replace('"wheel"', '"wheel.H"')
ALONE = TEXT.partition("[bodies]")[0]


@functools.cache
def board(text):
    """The document of a text."""
    return Document(text)


def edit(do, model=TEXT, **arguments):
    """What an edit says."""
    state = board(model).state
    return lambda: Editor(model, state, "model", None).do({"do": do, **arguments})


def given(**fields):
    """A gear with these fields."""
    return edit("joint", kind="gear", fields=fields)


SENTENCES = """
an edit that there is not | EditError | - | there is no edit 'fly'
an empty field | EditError | rod | 'bodies.rod.points.B' is empty: give a value, or remove the entry
a field of a number | EditError | rod | 'bodies.rod.points.B.0' is no table for an entry
a whole table as a number | EditError | - | 'bodies' is a table of the file: set an entry of it
an entry that there is not | EditError | rod | there is no 'bodies.rod.mass' in the file
an entry that there is | EditError | rod | 'bodies.rod.points' is in the file already
a path of nothing | EditError | - | the path of an entry is empty: name its table and key
a place that is infinite | EditError | - | a place must have two finite numbers
the ground that is to turn | EditError | ground | the ground does not move: put the motor on a link
a torque on the ground | EditError | ground | the ground does not move: put the torque on a link
a guess of the ground | EditError | ground | the ground does not move: choose a link
a point of no link | EditError | lever | there is no link 'lever'
a point that there is not | EditError | rod | there is no point 'rod.Z'
a point twice | EditError | rod | 'rod' has a point 'A' already
a load twice | EditError | F | there is a 'F' already: choose another name
a link of one place | EditError | - | a link needs points at two places or more: draw it from one place to another
points that are one | EditError | crank | 'crank.A' and 'rod.A' are pinned to each other already
points of one link | EditError | rod | 'rod.B' and 'crank.A' are of 'rod': join two links
a pivot twice | EditError | crank | 'crank.O' is pinned to the ground already
no pivot | EditError | rod | 'rod.B' is not pinned to the ground
a name with a space | EditError | - | 'my rod' is no name: use letters, digits and _
a name that there is | EditError | crank | there is a 'crank' already: names are unique
another name of nothing | EditError | lever | there is no 'bodies.lever' in the file
a point by a formula of numbers | EditError | crank | 'crank.M' is given by the formula '9*cos(45 deg)', which has no parameter: give it numbers first
a point at the origin of the ground | EditError | wheel | 'wheel.H' is pinned to the origin of the ground: name a point there first
a direction from nothing | EditError | ram | 'ram' has no other point to keep a direction from
a parameter that is held | EditError | ground | 'ground.Q': parameter 'a' is used in a table, a program, a guess …
a parameter of a page without links | EditError | ground | 'ground.Q' is given by a: change these
an origin that is held | EditError | wheel | 'wheel' is the origin of its link: move another point of it
a parameter that moves it elsewhere | EditError | ground | 'ground.Q' cannot be moved there: its joints and parameters hold it
a kind that there is not | EditError | - | there is no kind of joints 'glue' (there are: …
a gear of nothing | EditError | - | 'gear' is missing: give the places or the number of that name
a slide of a pinned point | EditError | crank | 'crank.O' is pinned to 'ground': free it before it slides
a motor at no joint | EditError | Z | there is no joint 'Z'
a mirror of no length | EditError | - | a line to mirror in needs two places
a copy of nothing | EditError | - | nothing to copy: choose links
a name for a word | EditError | - | 'units' is no number that could have a name
a name that is a number's | EditError | a | 'a' is no new name: begin with a letter, choose another
modes of nothing | EditError | - | there are no assembly modes yet: draw a mechanism with a motor
a mode that there is not | EditError | - | there is no assembly mode 10: there are 1
a parameter that is in use | EditError | a | 'ground.points' is made of 'a': change it first
the deletion of nothing | EditError | lever | there is no 'lever' among the bodies of the file
a mirror image of a formula | EditError | - | the place ['a', 0] of the ground has a formula: name it a point
"""
DRIVEN = TEXT.replace("wheel = {}\n", "").replace('hub = { revolute = ["ground", "wheel"] }\n', "")
DRIVEN = (
    DRIVEN.replace(
        '["crank.A", "rod.A"] }', '["crank.A", "rod.A"] }\nW = { fixed = ["ground", "ram"] }'
    )
    + "[drivers]\nm = { angle = 'crank', law = 0 }\nn = { angle = 'rod', law = 0 }\n"
)
SLIDE = TEXT.replace(
    "[loads]", "S = { pin_slot = [{ body = 'ground', point = ['a', 0] }, 'ram.B'] }\n[loads]"
)

SCENARIOS = {
    "an edit that there is not": edit("fly"),
    "an empty field": edit("set", path=["bodies", "rod", "points", "B"], text=" "),
    "a field of a number": edit("set", path=["bodies", "rod", "points", "B", "0", "x"], text="1"),
    "a whole table as a number": edit("set", path=["bodies"], text="1"),
    "an entry that there is not": edit("unset", path=["bodies", "rod", "mass"]),
    "an entry that there is": edit("add", path=["bodies", "rod"], key="points", text="{}"),
    "a path of nothing": edit("set", path=[], text="1"),
    "a place that is infinite": edit("move", place="rod.B", xy=[1e999, 0]),
    "the ground that is to turn": edit("motor", body="ground"),
    "a torque on the ground": edit("torque", body="ground", torque=1),
    "a guess of the ground": edit("guess", body="ground"),
    "a point of no link": edit("point", body="lever", xy=[0, 0]),
    "a point that there is not": edit("ground", place="rod.Z"),
    "a point twice": edit("point", body="rod", xy=[0, 0], name="A"),
    "a load twice": edit("force", place="rod.B", force=1, name="F"),
    "a link of one place": edit("link", at=[{"xy": [0, 0]}]),
    "points that are one": edit("join", place="crank.A", to="rod.A"),
    "points of one link": edit("join", place="rod.B", to="crank.A"),
    "a pivot twice": edit("ground", place="crank.O"),
    "no pivot": edit("unground", place="rod.B"),
    "a name with a space": edit("rename", path=["bodies", "rod"], to="my rod"),
    "a name that there is": edit("rename", path=["bodies", "rod"], to="crank"),
    "another name of nothing": edit("rename", path=["bodies", "lever"], to="arm"),
    "a point by a formula of numbers": edit("move", place="crank.M", xy=[1, 1]),
    "a point at the origin of the ground": edit("move", HUNG, place="wheel.H", xy=[1, 1]),
    "a direction from nothing": edit("move", place="ram.B", xy=[1, 1], along=True),
    "a parameter that is held": edit("move", HELD, place="ground.Q", xy=[35, 5]),
    "a parameter of a page without links": edit("move", ALONE, place="ground.Q", xy=[1, 1]),
    "an origin that is held": edit("move", place="wheel", xy=[9, 9]),
    "a parameter that moves it elsewhere": edit("move", place="ground.Q", xy=[30, 50]),
    "a kind that there is not": edit("joint", kind="glue", fields={}),
    "a gear of nothing": given(radius_i=2),
    "a slide of a pinned point": edit("slider", place="crank.O"),
    "a motor at no joint": edit("motor", joint="Z"),
    "a mirror of no length": edit("mirror", names=[["bodies", "rod"]], line=[[1, 1], [1, 1]]),
    "a copy of nothing": edit("copy", names=[["joints", "A"]], by=[1, 1]),
    "a name for a word": edit("parameter", path=["units"], name="x"),
    "a name that is a number's": edit(
        "parameter", path=["bodies", "crank", "points", "A", 0], name="a"
    ),
    "modes of nothing": edit("mode", ALONE, index=0),
    "a mode that there is not": edit("mode", DRIVEN, index=9),
    "a parameter that is in use": edit("delete", names=[["parameters", "a"]]),
    "the deletion of nothing": edit("delete", names=[["bodies", "lever"]]),
    "a mirror image of a formula": edit(
        "mirror", SLIDE, names=[["bodies", "ram"]], line=[[0, 0], [0, 1]]
    ),
}
