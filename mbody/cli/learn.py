"""The commands for learning: `demo`, `derive`, `explain`, `exercise`, `new`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli import option_values
from mbody.cli.analyse import exit_status
from mbody.cli.pictures import motion_or_driven
from mbody.cli.streams import UsageError, message

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution


# -- `mbody demo`: Norton's four-bar, and the book's answers beside ours -----------------------

#: The book's answers: components, then magnitude and direction [deg], of forces on a link [lbf];
#: the driving torque [lbf·in].
PRINTED = {
    "F12": (-117.65, -107.84, 159.60, 222.52),
    "F32": (118.13, 100.34, 154.99, 40.35),
    "F43": (-1.34, 87.43, 87.44, 90.88),
    "F14": (-20.23, 77.71, 80.30, 104.59),
    "T12": (243.23,),
}


def demo(args: Any = None) -> int:
    """Norton's four-bar, and the book's answers beside ours."""
    from mbody.analysis.driven.driven import kinetostatics
    from mbody.gallery import load

    print(*_comparison(kinetostatics(load("norton_fourbar_printed"))), "", sep="\n")
    print("With the exact masses, weight by g = 386 in/s²:\n")
    print(kinetostatics(load("norton_fourbar")))
    print(f"\nSee it move, in a browser:  {_command()} view norton_fourbar --open")
    return 0


def _command() -> str:
    """How this command is called here."""
    import shutil
    import sys
    from pathlib import Path

    if shutil.which("mbody"):
        return "mbody"
    installed = Path(sys.executable).parent / "mbody"
    if not installed.exists():
        return f"{sys.executable} -m mbody"
    here = Path.cwd()
    return str(installed.relative_to(here) if installed.is_relative_to(here) else installed)


def _comparison(run: Solution) -> list[str]:
    """The book's answers, ours with its rounded masses, and the differences."""
    from mbody.summaries.text_table import Column, paragraph, table

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
    masses = ", ".join(f"{body.mass:.3f}" for body in run.mechanism.bodies)
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
    from mbody.summaries.text_table import force_names

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


# -- The commands for learning: `derive`, `explain`, `exercise`, `new` -------------------------


def derive(args: Any) -> int:
    """Print the equations of one instant in symbols, then with numbers."""
    from mbody.files.writing import writing
    from mbody.teaching import derivation_as

    run = motion_or_driven(args, option_values.model_of(args))
    # of a free motion the end, else the first instant
    instant = -1 if args.to is not None else 0
    if len(run) > 1 and args.to is None:
        message(f"mbody: the first of {len(run)} instants; choose another one with --at")
    text = derivation_as(run, args.form, instant).rstrip("\n")
    if args.output:
        with writing(args.output) as file:
            file.write(text + "\n")
        message(f"wrote {args.output}")
    else:
        print(text)
    return exit_status(run, printed=False)


# -- `mbody explain ELEMENT`: what a kind of element is ----------------------------------------


def explain(args: Any) -> int:
    """Print the fields of an element with units, meaning and an example; without one all kinds."""
    from mbody.teaching.element_reference import element_reference, reference_overview

    if args.element is None:
        print(reference_overview())
    else:
        table = reference_overview(args.element)
        print(*([table] if table else element_reference(args.element)), sep="\n\n")
    return 0


# -- `mbody exercise MODEL`: a sheet of questions and its key ----------------------------------


def exercise(args: Any) -> int:
    """Print the sheet, and write its figures and the key."""
    from mbody.files.writing import writing
    from mbody.teaching.exercises import exercises

    path, fixed = option_values.path_of(args.model), option_values.named_values(args.set, "--set")
    bounds = {}
    for name, text in option_values.named_values(args.vary, "--vary").items():
        bounds[name] = option_values.low_and_high(name, text)
    if not bounds:
        raise UsageError("choose what differs between exercises: --vary NAME=LOW:HIGH")

    def make(values: Mapping[str, str]) -> Mechanism:
        machine = option_values.model_in(path, {**fixed, **values})
        return option_values.in_units_of(machine, args.units) if args.units else machine

    found = exercises(make, bounds, **option_values.given(args, "count", "seed"))
    folder = f"{path.stem}_figures"
    files = found.save_figures(folder)
    sheet = found.sheet(folder)
    if args.output:
        with writing(args.output) as file:
            file.write(sheet)
        message(f"wrote {args.output}")
    else:
        print(sheet, end="")
    _say_figures(len(files), folder)
    if args.key:
        with writing(args.key) as file:
            file.write(found.worked())
        message(f"wrote {args.key}")
    return 0


def _say_figures(count: int, folder: str) -> None:
    message(f"wrote {count} figures in {folder}")


# -- `mbody new KIND`: a commented model file to begin with ------------------------------------


def new(args: Any) -> int:
    """Write a model file of a kind, or print all kinds with the names of their lengths."""
    from mbody.errors import ModelError
    from mbody.files.writing import writing
    from mbody.teaching.new_model import KINDS, new_model

    if args.kind is None:
        for kind, names in KINDS.items():
            print(f"{kind:<12} --lengths {','.join(names)}")
        return 0
    lengths = [part.strip() for part in args.lengths.split(",")] if args.lengths else []
    text = new_model(args.kind, lengths, args.units or "")
    if args.output == "-":
        print(text, end="")
        return 0
    path = Path(args.output or f"{args.kind}.toml")
    if path.exists():
        raise ModelError(f"'{path}' is there already: choose another file with -o")
    with writing(path) as file:
        file.write(text)
    message(f"wrote {path}")
    return 0
