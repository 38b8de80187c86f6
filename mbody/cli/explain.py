"""`mbody explain ELEMENT`: what a kind of element is."""

from __future__ import annotations

from typing import Any

__all__ = ["explain"]


def explain(args: Any) -> int:
    """Print the fields of an element with units, meaning and an example; without one all kinds."""
    from mbody.teaching.element_reference import element_reference, reference_overview

    if args.element is None:
        print(reference_overview())
    else:
        print(*element_reference(args.element), sep="\n\n")
    return 0
