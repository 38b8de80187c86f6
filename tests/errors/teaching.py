"""Teaching: derivations and what is made of them."""

from mbody.teaching import derivation, element_reference
from tests.errors.results import batch, run

SCENARIOS = {
    "a derivation in another form": lambda: run().derivation("word"),
    "a derivation of designs": lambda: derivation(batch()),
    "an element nearly so called": lambda: element_reference("sprng"),
    "an element like no other": lambda: element_reference("qqqq"),
}
