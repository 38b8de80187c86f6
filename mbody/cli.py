"""The command `mbody`."""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from mbody import __version__
from mbody.errors import ModelError, SolveError

if TYPE_CHECKING:
    from mbody.solution import Solution

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and give its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments, by default those of the process.

    Returns
    -------
    int
        0; 1 where an analysis could not give what was asked; 2 for a mechanism that is none. The
        sentence that says why goes to stderr.

    Raises
    ------
    SystemExit
        From argparse: for arguments it does not know, --help and --version.

    Examples
    --------
    >>> main([])  # doctest: +ELLIPSIS
    usage: mbody ...
    0
    """
    for stream in (sys.stdout, sys.stderr):
        # a terminal without Greek letters shows question marks, and no traceback
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    parser, commands = _parser()
    chosen = parser.parse_args(argv).command
    if chosen is None:
        parser.print_help()
        return 0
    try:
        commands[chosen]()
        sys.stdout.flush()
    except BrokenPipeError:
        # the reader has gone, as in `mbody demo | head`: nothing to say, and nowhere to say it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except ModelError as error:
        print(f"mbody: {error}", file=sys.stderr)
        return 2
    except SolveError as error:
        print(f"mbody: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> tuple[argparse.ArgumentParser, dict[str, Callable[[], None]]]:
    parser = argparse.ArgumentParser(
        prog="mbody", description="Planar multibody dynamics: motion and every joint force."
    )
    parser.add_argument("--version", action="version", version=f"mbody {__version__}")
    sub = parser.add_subparsers(dest="command", metavar="command")
    sub.add_parser("demo", help="a textbook four-bar: all forces, and the book's answers beside")
    sub.add_parser("warmup", help="compile all kernels, once on a machine")
    return parser, {"demo": _demo, "warmup": _warmup}


# -- mbody demo -------------------------------------------------------------------------------


def _demo() -> None:
    """Norton's four-bar, and the book's answers beside ours."""
    from mbody.analysis import kinetostatics
    from mbody.gallery.norton_fourbar import build

    print(*_comparison(kinetostatics(build("printed"))), "", sep="\n")
    print("With the exact masses, weight by g = 386 in/s²:\n")
    print(kinetostatics(build("exact")))


def _comparison(run: Solution) -> list[str]:
    """The book's answers, ours with its rounded masses, and the differences."""
    from mbody.gallery.norton_fourbar import GIVEN, PRINTED
    from mbody.io.text import Column, paragraph, table

    force, torque = (run.mechanism.units.of(kind) for kind in ("force", "torque"))
    rows: list[tuple[str, str, str, str, str, str]] = []
    for name, printed in PRINTED.items():
        ours = _answers(run, name)
        kinds = [("x", force), ("y", force), ("magnitude", force), ("direction", "deg")]
        if len(printed) == 1:
            kinds = [("", torque)]
        for (kind, unit), theirs, mine in zip(kinds, printed, ours, strict=True):
            difference, mark = mine - theirs, ""
            if abs(difference) > 0.005:
                mark = "differs"
                if kind == "direction":
                    mark = f"the book's own x and y give {_direction(*printed[:2]):.3f}"
            rows.append(
                (
                    f"{name} {kind}",
                    f"{theirs:.2f}",
                    f"{mine:.4f}",
                    f"{round(difference, 4) + 0.0:+.4f}",
                    unit,
                    mark,
                )
            )
    heads = ("THE BOOK", "printed", "mbody", "difference", "unit", "")
    columns = [
        Column(head, cells, text=head in ("THE BOOK", "unit", ""))
        for head, cells in zip(heads, zip(*rows, strict=True), strict=True)
    ]
    agree = sum(not row[-1] for row in rows)
    own = sum(row[-1].startswith("the book") for row in rows)
    masses = ", ".join(f"{mass:.3f}" for mass in GIVEN["printed"][1:])
    opening = (
        f"The book rounds the masses to {masses} {run.mechanism.units.mass}. With these, its "
        "answers beside ours:"
    )
    ending = (
        f"{agree} of {len(rows)} agree to the last printed digit; {own} printed "
        "directions do not follow from the book's own x and y."
    )
    return [*paragraph(opening), "", *table(columns), "", *paragraph(ending)]


def _answers(run: Solution, name: str) -> list[float]:
    """A torque, or components, magnitude and direction [deg] of a force, by its textbook name."""
    from mbody.io.parts import force_names

    element, on = next(
        (e, on) for e, (known, on) in force_names(run.mechanism).items() if known == name
    )
    if name.startswith("T"):
        return [float(run.effort(element)[0])]
    reaction = run.reaction(element, on)
    x, y = float(reaction.fx[0]), float(reaction.fy[0])
    return [x, y, float(reaction.magnitude[0]), _direction(x, y)]


def _direction(x: float, y: float) -> float:
    return math.degrees(math.atan2(y, x)) % 360.0


# -- mbody warmup -----------------------------------------------------------------------------


def _warmup() -> None:
    """Compile all kernels by using every analysis on small models."""
    from mbody._jit import compilations

    whole = time.perf_counter()
    for title, step in _steps():
        before, start = compilations(), time.perf_counter()
        print(f"{title} ...", end=" ", flush=True)
        step()
        seconds = time.perf_counter() - start
        print(f"{seconds:.1f} s, {compilations() - before} functions compiled", flush=True)
    seconds = time.perf_counter() - whole
    print(f"ready: {compilations()} functions compiled in {seconds:.1f} s; later runs load them")


def _steps() -> Iterator[tuple[str, Callable[[], object]]]:
    from mbody.analysis import close_loops, kinematics, kinetostatics, statics
    from mbody.assembler import assemble
    from mbody.gallery.norton_fourbar import build
    from mbody.laws import Function
    from mbody.loads import Torque

    model = build()
    times = [0.0, 0.01, 0.02]

    def batch() -> object:
        system = assemble(model).with_values({"crank.inertia": [0.4, 0.5, 0.6]})
        return kinetostatics(system, t=times).checks

    def hooks() -> object:
        machine = build()
        machine.add(Torque("brake", "crank", value=Function(lambda t: 1.0 + t)))
        return kinetostatics(machine, t=times)

    yield "kinematics", lambda: kinematics(model, t=times)
    yield "kinetostatics", lambda: kinetostatics(model, t=times)
    yield "a whole turn", lambda: kinetostatics(model, turn=True, instants=400)
    yield "statics", lambda: statics(model)
    yield "loops", lambda: close_loops(model)
    yield "residuals", lambda: kinetostatics(model).checks
    yield "breakdown by cause", lambda: kinetostatics(model).breakdown("motor")
    yield "batches of designs", batch
    yield "functions of the user", hooks
