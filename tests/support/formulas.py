"""The value of a formula's text."""

from mbody.quantities import Scope, Valued, evaluate, parse
from mbody.quantities.units import unit_system


def worth(text, system="SI", **names):
    """Value of a formula; names are plain numbers, or texts with units."""
    scope = Scope(unit_system(system))
    known = {
        key: evaluate(parse(own), scope) if isinstance(own, str) else Valued(own)
        for key, own in names.items()
    }
    return evaluate(parse(text), Scope(unit_system(system), known))
