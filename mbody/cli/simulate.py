"""`mbody simulate MODEL`: free motion over time."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import Any

from mbody.analysis.dynamics.progress import shown
from mbody.cli.analyse import check_forms, told_status, write
from mbody.cli.interrupts import stop
from mbody.cli.models import taken
from mbody.cli.streams import say
from mbody.cli.usage import UsageError

__all__ = ["simulate"]


def simulate(asked: Any) -> int:
    """Follow the motion and show it; 1 where it was stopped, or is in doubt."""
    from mbody.analysis.dynamics.simulate import simulate as followed

    check_forms(asked)
    mechanism = taken(asked)
    options: dict[str, Any] = {"progress": _progress(asked, _last(mechanism, asked.to))}
    if asked.rtol is not None:
        options["rtol"] = _number(asked.rtol, "--rtol")
    if asked.method is not None:
        options["method"] = asked.method
    if asked.step is not None:
        options["step"] = mechanism._number(asked.step, "time", "simulate", "--step")
    if asked.every is not None:
        options["every"] = mechanism._number(asked.every, "time", "simulate", "--every")
    if asked.instants is not None:
        if not (asked.instants.isascii() and asked.instants.isdigit()):
            raise UsageError(f"--instants takes a whole number, not {asked.instants[:40]!r}")
        options["instants"] = int(asked.instants)
    if asked.begun is not None:
        from mbody.files.saved import load_run

        options["start"] = load_run(asked.begun)
    run = followed(mechanism, asked.to, **options)
    stop.done()
    write(run, asked)
    if asked.save is not None:
        from mbody.files.saved import save_run

        save_run(run, asked.save)
        say(f"wrote {asked.save}: {len(run)} instants")
    if asked.json:
        print(json.dumps(run.data(asked.angle or "deg"), ensure_ascii=False, allow_nan=False))
    elif asked.csv != "-":
        print(run)
    return told_status(run, shown=asked.json or asked.csv != "-")


def _last(mechanism: Any, to: Any) -> float:
    """When the motion is to end; where nothing says so, the analysis refuses it."""
    asked = to if to is not None or mechanism.simulation is None else mechanism.simulation.until
    return 0.0 if asked is None else mechanism._number(asked, "time", "simulate", "until")


def _number(text: str, option: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{option} takes a number, not {text[:40]!r}") from None


def _progress(asked: Any, until: float) -> Callable[[float], None]:
    """What shows on a terminal, after a while, how far a motion is, and stops it at Ctrl-C."""
    shows = not asked.json and sys.stderr is not None and sys.stderr.isatty()
    show = shown(until) if shows else None

    def tell(t: float) -> None:
        stop.mark()
        if show is not None:
            show(t)

    return tell
