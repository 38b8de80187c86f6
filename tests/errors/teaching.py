"""Teaching: derivations and what is made of them."""

from mbody import from_toml
from mbody.teaching import derivation, element_reference, exercises, new_model
from mbody.teaching.exercises import ExerciseSheet
from tests.errors.results import batch, run


def four_bars(bounds, count=1):
    text = new_model("fourbar")
    return exercises(lambda values: from_toml(text, parameters=values), bounds, count)


SCENARIOS = {
    "exercises that do not differ": lambda: four_bars({}),
    "exercises between words": lambda: four_bars({"a": ("low", "high")}),
    "exercises the wrong way round": lambda: four_bars({"a": ("50", "30")}),
    "exercises that cannot be built": lambda: four_bars({"a": ("300", "400")}),
    "figures in no folder": lambda: ExerciseSheet((), None, None).save_figures("/dev/null/x"),
    "a derivation in another form": lambda: run().derivation("word"),
    "a derivation of designs": lambda: derivation(batch()),
    "an element like no other": lambda: element_reference("qqqq"),
    "a new model with too few lengths": lambda: new_model("fourbar", [1, 2]),
    "a new model with a length that is none": lambda: new_model("pendulum", ["long"]),
    "a new model with a length that is a command": lambda: new_model("pendulum", ['1"; x']),
    "a new model with a negative length": lambda: new_model("fourbar", [-1, 2, 3, 4]),
}

SENTENCES = r"""
exercises that do not differ | ModelError | - | exercises: nothing differs between them: give a parameter to vary
exercises between words | ModelError | a | exercises: 'a' must vary from one number to another of the same unit, as in 40:60 or 40 mm:60 mm, not 'low' to 'high'
exercises the wrong way round | ModelError | a | exercises: 'a' varies from 50 to 30: give the lower bound first
exercises that cannot be built | ModelError | - | exercises: of 174 drawn designs 0 can be built and turned with a transmission angle of at least 30 deg, 1 are wanted: vary within other bounds
figures in no folder | ModelError | - | cannot make the folder '/dev/null/x' for the figures (Not a directory)
a derivation in another form | ModelError | - | a derivation is written as text, markdown, latex, not as 'word'
a derivation of designs | ModelError | - | a derivation is of one design, this is a batch of 2 designs: take one of them, run.design(n)
an element like no other | ModelError | - | there is no element or law 'qqqq': mbody explain lists them
a new model with too few lengths | ModelError | - | 'fourbar' has 4 lengths (a, b, c, d of its file), not 2: give all of them
a new model with a length that is none | ModelError | - | the length l: there is no parameter 'long' (there are none)
a new model with a length that is a command | ModelError | - | the length l: '1"; x' contains ';', which is not allowed in a formula
a new model with a negative length | ModelError | - | the length a is -1 mm: it must be positive
"""
