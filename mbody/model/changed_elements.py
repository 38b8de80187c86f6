"""A mechanism with other numbers in some of its elements."""

from __future__ import annotations

from collections.abc import Iterable

from mbody.model.closed_mechanism import with_others
from mbody.model.element import Element
from mbody.model.mechanism import Mechanism

__all__ = ["with_changed"]


def with_changed(machine: Mechanism, elements: Iterable[Element], keys: Iterable[str]) -> Mechanism:
    """The mechanism with other elements in the place of those of their names. Their numbers that
    begin with one of the keys, such as ``"mass"``, follow no formulas any more; others do.

    >>> from dataclasses import replace
    >>> from mbody import makers
    >>> machine = makers.four_bar(1, 3, 2, 3.5)
    >>> with_changed(machine, [replace(machine["crank"], mass=2.0)], ["mass"])["crank"].mass
    2.0
    """
    new = list(elements)
    made = with_others(machine, set(), new)
    changed = tuple(f"{element.name}.{key}" for element in new for key in keys)
    kept = {k: formula for k, formula in machine.formulas.items() if not k.startswith(changed)}
    made.formulas = kept if changed else dict(machine.formulas)
    return made.copied()
