"""`mbody view MODEL` and `mbody animate MODEL`: a mechanism in motion, as a page or a film."""

from __future__ import annotations

import itertools
import math
import re
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import assembly_of, question
from mbody.cli.interrupts import interrupt
from mbody.cli.models import model_of, named_values, path_of
from mbody.cli.streams import message
from mbody.cli.sweep import values_of
from mbody.cli.usage import UsageError
from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution
    from mbody.system.system import System
    from mbody.views.page import Viewer

__all__ = ["animate", "view"]

STEPS = re.compile(r"([-+0-9.eE]+)\s*([^:]*):([-+0-9.eE]+)\s*([^:]*):([0-9]{1,9})")


def view(args: Any) -> int:
    """Write a page on which the model moves."""
    path = args.output or f"{path_of(args.model).stem}.html"
    options: dict[str, Any] = {"plots": args.plot, "command": _command(args)}
    if args.path:
        options["paths"] = args.path
    if args.show is not None:
        options["show"] = _listed(args.show)
    _check_live(args)
    page = _page(args, _runs(args), options)
    interrupt.done()
    page.save(path)
    for note in page.notes:
        message(f"note: {note}")
    if path.lower().endswith(".json"):
        from mbody.views.page import MODULE

        message(
            f"wrote {path}, and {MODULE} beside it: a page shows it by <script type=module "
            f'src="{MODULE}"></script> <mbody-viewer src="{Path(path).name}"></mbody-viewer>'
        )
    else:
        message(f"wrote {path}")
    if args.open:
        import webbrowser

        webbrowser.open(Path(path).resolve().as_uri())
    return 0


def _check_live(args: Any) -> None:
    """Refuse a live page of designs that differ in more than parameters."""
    if args.live and (others := _no_parameters(args)):
        raise UsageError(
            f"--live solves the model file again: --vary takes its parameters, not '{others[0]}'"
        )


def _page(args: Any, runs: dict[str, Solution], options: dict[str, Any]) -> Viewer:
    """A page that solves the model again, where that is wanted, or possible without a build."""
    from mbody.image.webassembly import ready_core
    from mbody.live import live_view
    from mbody.views import view as viewed

    if args.live:
        return live_view(runs, **options)
    if args.recorded or _no_parameters(args):
        return viewed(runs, **options)
    if ready_core() is None:
        message("note: the page plays the recorded motion; with --live it solves the model again")
        return viewed(runs, **options)
    try:
        return live_view(runs, **options)
    except ModelError as error:
        page = viewed(runs, **options)
        page.notes.append(f"the page plays the recorded motion: {error}")
        return page


def animate(args: Any) -> int:
    """Write a film of the model."""
    from mbody.views import animate as animated

    path = args.output or f"{path_of(args.model).stem}.gif"
    options: dict[str, Any] = {}
    for name in ("duration", "rate"):
        if getattr(args, name) is not None:
            options[name] = _number(getattr(args, name), f"--{name}")
    if args.width is not None:
        options["width"] = int(_number(args.width, "--width"))
    if args.path:
        options["paths"] = args.path
    if args.show is not None:
        options["show"] = _listed(args.show)
    notes = animated(_runs(args), path, progress=_progress(), **options)
    interrupt.done()
    for note in notes:
        message(f"note: {note}")
    message(f"wrote {path}")
    return 0


def _runs(args: Any) -> dict[str, Solution]:
    """The motion of the model, or of each of its designs by name."""
    from mbody.views.motions import motion
    from mbody.views.page import check_designs

    varied = named_values(args.vary, "--vary")
    choices = [[(name, value) for value in _values(text)] for name, text in varied.items()]
    check_designs(math.prod(len(one) for one in choices))
    own, found = list(args.set), {}
    others = _no_parameters(args)
    for design in itertools.product(*choices):
        name = ", ".join(f"{key} = {value}" for key, value in design)
        args.set = own + [f"{key}={value}" for key, value in design if key not in others]
        mechanism: Mechanism = model_of(args)
        if args.to is not None and (args.at or args.over):
            raise UsageError("give --to, or --at or --over, not both")
        wanted = question(args, mechanism.ask)
        changed = {key: value for key, value in design if key in others}
        system = _with_values(mechanism, changed)
        found[name] = motion(system, wanted, args.to, lambda t: interrupt.mark(), assembly_of(args))
        interrupt.done()
    args.set = own
    return found


def _no_parameters(args: Any) -> list[str]:
    """What --vary changes that is no parameter of the model, as "crank.A.x"."""
    names = named_values(args.vary, "--vary")
    known = model_of(args).parameters if names else ()
    return [name for name in names if name not in known]


def _with_values(mechanism: Mechanism, values: dict[str, str]) -> System:
    """The system of a model with other numbers than its parameters."""
    from mbody.sweeps.samples import drawn, grid
    from mbody.system.assembler import assemble

    system = assemble(mechanism)
    if not values:
        return system
    made = drawn(system, grid({name: values_of(name, text) for name, text in values.items()}))
    return system.with_values(dict(zip(made.names, made.values[0].tolist(), strict=True)))


def _values(text: str) -> list[str]:
    """The values of a parameter: with commas, or from one to another in so many.

    >>> _values("6 in:8 in:3"), _values("1,2 mm")
    (['6 in', '7 in', '8 in'], ['1', '2 mm'])
    """
    if ":" not in text:
        return [part.strip() for part in text.split(",")]
    parts = STEPS.fullmatch(text.strip())
    if parts is None or int(parts[5]) < 1 or parts[2].strip() not in ("", parts[4].strip()):
        raise UsageError(
            f"--vary takes LOW:HIGH:COUNT in one unit, or values with commas, not {text[:60]!r}"
        )
    low, high, count = float(parts[1]), float(parts[3]), int(parts[5])
    step = (high - low) / max(count - 1, 1)
    return [f"{low + n * step:.12g} {parts[4]}".strip() for n in range(min(count, 1000))]


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]


def _number(text: str, option: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{option} takes a number, not {text[:40]!r}") from None


def _command(args: Any) -> str:
    """The command as it was given, for the reader of the page."""
    words = sys.argv[1:] if Path(sys.argv[0]).stem in ("mbody", "__main__") else []
    return shlex.join(["mbody", *words]) if words else f"mbody view {args.model}"


def _progress() -> Any:
    """Shows on a terminal how many frames are done, and lets Ctrl-C end the film."""
    shows = sys.stderr is not None and sys.stderr.isatty()

    def progress(done: int, of: int) -> None:
        interrupt.mark()
        if shows and (done % 5 == 0 or done == of):
            message(f"\rframe {done} of {of}", end="\n" if done == of else "")

    return progress
