"""`mbody simulate MODEL`: free motion over time."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mbody.analysis.dynamics.progress import shown
from mbody.cli.analyse import check_forms, exit_status, write
from mbody.cli.interrupts import interrupt
from mbody.cli.models import model_of, named_values
from mbody.cli.option_values import whole_number
from mbody.cli.streams import message
from mbody.cli.usage import UsageError
from mbody.errors import ModelError
from mbody.model.numbers import number_in

__all__ = ["simulate"]


def simulate(args: Any) -> int:
    """Simulate the motion and print it; 1 if it was stopped or is in doubt."""
    from mbody.analysis.dynamics.simulate import simulate as simulated

    check_forms(args)
    mechanism = model_of(args)
    options: dict[str, Any] = {"progress": _progress(args, _last(mechanism, args.to))}
    if args.rtol is not None:
        options["rtol"] = _number(args.rtol, "--rtol")
    if args.method is not None:
        options["method"] = args.method
    if args.step is not None:
        options["step"] = number_in(mechanism, args.step, "time", "simulate", "--step")
    if args.every is not None:
        options["every"] = number_in(mechanism, args.every, "time", "simulate", "--every")
    if args.instants is not None:
        options["instants"] = whole_number("--instants", args.instants)
    if args.input:
        given = named_values(args.input, "--input")
        options["inputs"] = {name: _history(name, text) for name, text in given.items()}
    if args.begun is not None:
        from mbody.files.saved import load_run

        options["start"] = load_run(args.begun)
    run = simulated(mechanism, args.to, **options)
    interrupt.done()
    write(run, args)
    if args.save is not None:
        from mbody.files.saved import save_run

        save_run(run, args.save)
        message(f"wrote {args.save}: {len(run)} instants")
    if args.json:
        print(json.dumps(run.data(args.angle or "deg"), ensure_ascii=False, allow_nan=False))
    elif args.csv != "-":
        print(run)
    return exit_status(run, shown=args.json or args.csv != "-")


def _history(name: str, text: str) -> Any:
    """A history as text, or the rows t and u of a file."""
    if not text.startswith("@"):
        return text
    from mbody.files.model.beside import columns

    path = Path(text[1:])
    try:
        return columns(path.name, path.parent)
    except ModelError as error:
        why = str(error).replace(" beside the model", "")
        raise ModelError(f"--input {name}: {why}", name) from None


def _last(mechanism: Any, to: Any) -> float:
    """When the motion is to end; the analysis refuses a motion without one."""
    args = to if to is not None or mechanism.simulation is None else mechanism.simulation.until
    return 0.0 if args is None else number_in(mechanism, args, "time", "simulate", "until")


def _number(text: str, option: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{option} takes a number, not {text[:40]!r}") from None


def _progress(args: Any, until: float) -> Callable[[float], None]:
    """A function that shows the time reached on a terminal, and stops the motion at Ctrl-C."""
    shows = not args.json and sys.stderr is not None and sys.stderr.isatty()
    show = shown(until) if shows else None

    def progress(t: float) -> None:
        interrupt.mark()
        if show is not None:
            show(t)

    return progress
