"""What can be the name of an element or of one of its points."""

from __future__ import annotations

from typing import Any

from mbody.errors import ModelError

__all__ = ["check_name"]

LONGEST_NAME = 200


def check_name(name: Any, what: str) -> None:
    """Refuse what cannot be the name of an element."""
    if not isinstance(name, str) or not name.strip():
        raise ModelError(f"every {what} needs a name, not {name!r}")
    if len(name) > LONGEST_NAME:
        raise ModelError(
            f"the name '{name[:20]}…' has {len(name)} characters: give at most {LONGEST_NAME}",
            name[:LONGEST_NAME],
        )
    if not name.isprintable():
        raise ModelError(f"the name {name!r} has characters that cannot be printed: leave them out")
    if "." in name:
        raise ModelError(
            f"'{name}': a name may not hold a dot, which parts body and point: write "
            f"'{name.replace('.', '_')}'",
            name,
        )
