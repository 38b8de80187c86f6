"""Teaching: derivations and what is made of them."""

from mbody.teaching import derivation
from tests.errors.results import batch, run

SCENARIOS = {
    "a derivation in another form": lambda: run().derivation("word"),
    "a derivation of designs": lambda: derivation(batch()),
}
