"""The commands for learning: `derive`, `explain`, `exercise`, `new`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status
from mbody.cli.option_values import (
    low_and_high,
    model_in,
    model_of,
    named_values,
    path_of,
    whole_number,
)
from mbody.cli.pictures import motion_or_driven
from mbody.cli.streams import UsageError, message

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism


def derive(args: Any) -> int:
    """Print the equations of one instant in symbols, then with numbers."""
    from mbody.files.writing import writing
    from mbody.teaching import derivation_as

    run = motion_or_driven(args, model_of(args))
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
    return exit_status(run, shown=False)


# -- `mbody explain ELEMENT`: what a kind of element is ----------------------------------------


def explain(args: Any) -> int:
    """Print the fields of an element with units, meaning and an example; without one all kinds."""
    from mbody.teaching.element_reference import element_reference, reference_overview

    if args.element is None:
        print(reference_overview())
    else:
        print(*element_reference(args.element), sep="\n\n")
    return 0


# -- `mbody exercise MODEL`: a sheet of questions and its key ----------------------------------


def exercise(args: Any) -> int:
    """Print the sheet, and write its figures and the key."""
    from mbody.files.model import in_units
    from mbody.files.writing import writing
    from mbody.teaching.exercises import exercises

    path, fixed = path_of(args.model), named_values(args.set, "--set")
    bounds = {}
    for name, text in named_values(args.vary, "--vary").items():
        bounds[name] = low_and_high(name, text)
    if not bounds:
        raise UsageError("choose what differs between exercises: --vary NAME=LOW:HIGH")

    def make(values: Mapping[str, str]) -> Mechanism:
        machine = model_in(path, {**fixed, **values})
        return in_units(machine, args.units) if args.units else machine

    count, seed = (whole_number(f"--{name}", getattr(args, name)) for name in ("count", "seed"))
    found = exercises(make, bounds, count, seed)
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
