"""`mbody linkages --to FOLDER`: a data set of random linkages with their motion and forces."""

from __future__ import annotations

import argparse
import math
from typing import Any

from mbody.cli.interrupts import interrupt
from mbody.cli.option_values import whole_number
from mbody.cli.streams import message
from mbody.cli.usage import UsageError

__all__ = ["add_linkages", "linkages"]


def add_linkages(command: argparse.ArgumentParser) -> None:
    """The arguments."""
    for name, metavar, text in (
        ("count", "N", "how many linkages (1000)"),
        ("nodes", "K", "joints of each (8)"),
        ("seed", "S", "of the random numbers (0)"),
        ("instants", "N", "positions of each (200)"),
        ("threads", "N", "by default as many as there are cores"),
    ):
        command.add_argument(f"--{name}", metavar=metavar, help=text)
    command.add_argument(
        "--groups", metavar="NAMES", help="of dyads,sliders,triads,assur, by default all"
    )
    command.add_argument("--turn", metavar="DEG", help="turn of the crank [deg] (360)")
    command.add_argument("--speed", metavar="RATE", help="of the crank [rad/s] (1)")
    command.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask cluster, such as tcp://10.0.0.5:8786"
    )
    command.add_argument(
        "--part", metavar="K/N", help="the K-th of N parts, each a process of its own (1/1)"
    )
    command.add_argument("--to", metavar="FOLDER", required=True, help="goes on where one is begun")


def linkages(args: Any) -> int:
    """Write a data set, or go on with one."""
    from mbody.analysis.dynamics.progress import counted
    from mbody.sweeps.threads import cores
    from mbody.topologies.dataset import LinkageSet, write_linkages

    names = ("count", "nodes", "seed", "instants", "threads")
    given = {name: whole_number(f"--{name}", getattr(args, name)) for name in names}
    options: dict[str, Any] = {name: n for name, n in given.items() if n is not None}
    threads = options.pop("threads", None) or cores()
    if args.groups is not None:
        options["groups"] = tuple(part.strip() for part in args.groups.split(",") if part.strip())
    if args.turn is not None:
        options["turn"] = math.radians(_number("--turn", args.turn))
    if args.speed is not None:
        options["speed"] = _number("--speed", args.speed)
    show = counted("linkages")

    def progress(done: int, of: int) -> None:
        interrupt.mark()
        show(done, of)

    what = LinkageSet(**({"count": 1000} | options))
    found = write_linkages(
        args.to,
        what,
        threads=threads,
        scheduler=args.scheduler,
        part=_part(args.part),
        progress=progress,
    )
    interrupt.done()
    if found.status != "completed":
        message(found.status)
    message(f"wrote {found.folder}: {found.done} of {found.count} linkages")
    return 0 if found.status == "completed" else 1


def _part(text: str | None) -> tuple[int, int]:
    own, _, parts = ("1/1" if text is None else text).partition("/")
    if not (own.isdecimal() and parts.isdecimal()):
        raise UsageError(f"--part takes numbers such as 3/16, not {str(text)[:40]!r}")
    return int(own), int(parts)


def _number(option: str, text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise UsageError(f"{option} takes a number, not {text[:40]!r}")
    return found
