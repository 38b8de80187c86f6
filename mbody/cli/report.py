"""`mbody report MODEL`: the engineer's document."""

from __future__ import annotations

import shlex
from argparse import Namespace
from typing import Any

from mbody.cli.analyse import assembly_of, exit_status, question
from mbody.cli.freebody import named_bodies
from mbody.cli.models import model_of, path_of
from mbody.cli.streams import message
from mbody.cli.usage import UsageError

__all__ = ["report"]


def report(args: Any) -> int:
    """Write the report of a model; 1 where its result is in doubt."""
    from mbody.reports.mechanism_report import check_format
    from mbody.reports.mechanism_report import report as made

    output = args.output or f"{path_of(args.model).stem}.html"
    check_format(output)
    if args.to is not None and (args.at or args.over):
        raise UsageError("--to follows the free motion, --at and --over are driven: give one")
    mechanism = model_of(args)
    other = None
    if args.compare:
        changed = {one.partition("=")[0].strip() for one in args.compare}
        kept = [one for one in args.set if one.partition("=")[0].strip() not in changed]
        other = model_of(Namespace(model=args.model, set=kept + args.compare, units=args.units))
    wanted = question(args, mechanism.ask)
    against = named_bodies(args.against)
    found = made(
        mechanism,
        named_bodies(args.sections) or (),
        without=named_bodies(args.without) or (),
        at=None if wanted is mechanism.ask else wanted,
        to=args.to,
        title=args.title or "",
        plots=args.plot,
        polar=named_bodies(args.polar) or (),
        against=against,
        compare=other,
        labels=_labels(args),
        command=_command(args),
        assembly=assembly_of(args),
    )
    files = found.save(output)
    message(f"wrote {files[0]}" + (f" and {len(files) - 1} pictures" if len(files) > 1 else ""))
    if args.open:
        import webbrowser
        from pathlib import Path

        webbrowser.open(Path(files[0]).resolve().as_uri())
    return exit_status(found, shown=False)


def _labels(args: Any) -> tuple[str, str]:
    """What two designs are called."""
    return ", ".join(args.set) or "as given", ", ".join(args.compare)


def _command(args: Any) -> str:
    """The command that makes the same report."""
    words = ["mbody", "report", args.model]
    for option in ("set", "at", "sections", "without", "plot", "polar", "against", "compare"):
        words += [word for value in getattr(args, option) for word in (f"--{option}", value)]
    for option in ("units", "over", "instants", "turns", "assembly", "to", "title"):
        if getattr(args, option) is not None:
            words += [f"--{option}", getattr(args, option)]
    return shlex.join(words)
