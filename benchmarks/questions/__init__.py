"""One question a file: `TITLE`, and `measure(scope)`, which returns rows."""

from __future__ import annotations

#: In the order of the page.
QUESTIONS = (
    "fourbar",
    "andrews",
    "windows",
    "chains",
    "long_chain",
    "bodies",
    "piles",
    "contacts",
    "evaluations",
    "control_loop",
    "many_at_once",
    "positions",
    "new_linkages",
    "sweeps",
    "cold_start",
    "memory",
)
