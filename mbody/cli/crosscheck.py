"""`mbody crosscheck MODEL`: what other engines say of its results."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.analyse import told_status
from mbody.cli.models import taken
from mbody.cli.usage import UsageError

__all__ = ["crosscheck"]


def crosscheck(asked: Any) -> int:
    """Check a model against other engines; 1 where one of them differs."""
    from mbody.engines.crosscheck import crosscheck as checked

    against = None
    if asked.against is not None:
        against = [name.strip() for name in asked.against.split(",") if name.strip()]
        if not against:
            raise UsageError("--against takes names of engines with commas between them")
    report = checked(taken(asked), against)
    told = json.dumps(report.data(), ensure_ascii=False, allow_nan=False) if asked.json else report
    print(told)
    return told_status(report)
