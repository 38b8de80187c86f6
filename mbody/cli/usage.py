"""What is wrong with a command line."""

from __future__ import annotations

__all__ = ["UsageError"]


class UsageError(ValueError):
    """The command was not understood."""

    element: str | None = None
