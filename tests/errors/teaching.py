"""Teaching: derivations and what is made of them."""

from mbody.teaching import derivation, element_reference, new_model
from tests.errors.results import batch, run

SCENARIOS = {
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
