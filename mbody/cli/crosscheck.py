"""`mbody crosscheck MODEL`: its results compared with those of other engines."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.analyse import exit_status
from mbody.cli.models import model_of
from mbody.cli.usage import UsageError

__all__ = ["crosscheck"]


def crosscheck(args: Any) -> int:
    """Check a model against other engines; 1 where one of them differs."""
    from mbody.engines.crosscheck import crosscheck as checked

    against = None
    if args.against is not None:
        against = [name.strip() for name in args.against.split(",") if name.strip()]
        if not against:
            raise UsageError("--against takes names of engines with commas between them")
    report = checked(model_of(args), against)
    text = json.dumps(report.data(), ensure_ascii=False, allow_nan=False) if args.json else report
    print(text)
    return exit_status(report)
