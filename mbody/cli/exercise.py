"""`mbody exercise MODEL`: a sheet of questions and its key."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mbody.cli.models import model_in, named_values, path_of
from mbody.cli.option_values import low_and_high, whole_number
from mbody.cli.streams import message
from mbody.cli.usage import UsageError

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism

__all__ = ["exercise"]


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
