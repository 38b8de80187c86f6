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
    "no exercises": lambda: four_bars({"a": ("30", "50")}, 0),
    "exercises between words": lambda: four_bars({"a": ("low", "high")}),
    "exercises between units": lambda: four_bars({"a": ("3 cm", "50 mm")}),
    "exercises the wrong way round": lambda: four_bars({"a": ("50", "30")}),
    "exercises that cannot be built": lambda: four_bars({"a": ("300", "400")}),
    "figures in no folder": lambda: ExerciseSheet((), None, None).save_figures("/dev/null/x"),
    "a derivation in another form": lambda: run().derivation("word"),
    "a derivation of designs": lambda: derivation(batch()),
    "an element nearly so called": lambda: element_reference("sprng"),
    "an element like no other": lambda: element_reference("qqqq"),
    "a new model of no kind": lambda: new_model("robot"),
    "a new model with too few lengths": lambda: new_model("fourbar", [1, 2]),
    "a new model with a length that is none": lambda: new_model("pendulum", ["long"]),
    "a new model with a length that is a command": lambda: new_model("pendulum", ['1"; x']),
    "a new model with a negative length": lambda: new_model("fourbar", [-1, 2, 3, 4]),
}
