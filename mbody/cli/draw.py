"""`mbody draw MODEL` and `mbody plot MODEL QUANTITY …`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import assembly_of, question
from mbody.cli.freebody import motion_or_driven, named_bodies
from mbody.cli.models import model_of, named_values
from mbody.cli.streams import message
from mbody.cli.sweep import note_plain, values_of
from mbody.cli.usage import UsageError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution

__all__ = ["draw", "plot"]

#: Designs of one plot.
MOST = 1000
#: Positions that a motion is drawn at, and that a series may have.
POSITIONS, LONGEST = 5, 200


def draw(args: Any) -> int:
    """Write a picture of a model at the requested instants, or at equal steps of its motion."""
    from mbody.views import draw as drawn
    from mbody.views.backend import check_ending

    check_ending(args.output)
    count = _positions(args)
    mechanism = model_of(args)
    shown = {"paths": args.path, "only": named_bodies(args.only) or ()}
    marks = {
        "poles": args.poles,
        "polygons": args.polygons,
        "centrodes": named_bodies(args.centrodes) or (),
        "inflection": named_bodies(args.inflection) or (),
        "curvature": args.curvature,
    }
    wanted = question(args, mechanism.ask)
    plain = count is None and args.to is None and wanted is mechanism.ask and not args.assembly
    free = mechanism.simulation is not None and wanted is None
    if plain and (free or not (mechanism.drivers or args.forces)):
        return _written(drawn(mechanism, forces=args.forces, **shown, **marks), args.output)
    marked = any(marks.values())
    if marked and (args.series or args.strip):
        raise UsageError(
            "--poles, --polygons and the like draw one instant: name it with --at, or with --to "
            "the end of a free motion"
        )
    if marked and count is None and args.to is not None:
        count = 1
    run = _motion(args, mechanism, count)
    instants = _instants(args, run, count)
    if args.series:
        return _series(args, run, instants, shown)
    figure = drawn(run, instants, args.forces, strip=args.strip, **shown, **marks)
    return _written(figure, args.output)


def _positions(args: Any) -> int | None:
    """How many positions are wanted."""
    text = args.positions
    if text is None:
        return None
    if not (text.isascii() and text.isdigit()) or not 1 <= int(text[:9]) <= LONGEST:
        raise UsageError(f"--positions takes a whole number, 1 to {LONGEST}, not {text[:40]!r}")
    if args.at:
        raise UsageError("--positions are equal steps of the motion, --at names places: give one")
    return int(text)


def _motion(args: Any, mechanism: Mechanism, count: int | None) -> Solution:
    """The run of which instants are drawn."""
    from mbody.analysis.driven.requests import analyse_at
    from mbody.model.study import Instants
    from mbody.views.cycle import cycle

    if args.to is not None or (mechanism.simulation is not None and count is not None):
        return motion_or_driven(args, mechanism)
    wanted = question(args, mechanism.ask)
    if count is not None:
        wanted = cycle(mechanism, wanted)
        if wanted.over:
            wanted = Instants(over=wanted.over, instants=max(2, count + 1), turns=wanted.turns)
    analysis = "kinetostatics" if args.forces else "kinematics"
    return analyse_at(mechanism, analysis, wanted, assembly_of(args))


def _instants(args: Any, run: Solution, count: int | None) -> list[int]:
    """Which instants are drawn: all that were named, equal steps, else the first."""
    if args.at:
        if len(run) > LONGEST:
            raise UsageError(f"a picture shows at most {LONGEST} positions, not {len(run)}")
        return list(range(len(run)))
    if count is None:
        if args.to is None:
            return [0]
        count = POSITIONS
    turn = bool(run.mechanism.drivers) and args.to is None and len(run) == count + 1
    last = len(run) - 1
    # after a whole turn the first position comes again; of a motion the last is in full
    if count == 1 and not turn:
        return [last]
    steps = [round(n * last / (count if turn else count - 1)) for n in range(count)]
    forward = turn or args.strip or args.series
    return list(dict.fromkeys(steps if forward else steps[::-1]))


def _series(args: Any, run: Solution, instants: list[int], shown: Any) -> int:
    """A file for each instant, all of one scale and size."""
    from mbody.views.drawing import draw_series

    path = Path(args.output)
    digits = len(str(len(instants)))
    for n, figure in enumerate(draw_series(run, instants, args.forces, **shown), 1):
        _written(figure, str(path.with_name(f"{path.stem}-{n:0{digits}d}{path.suffix}")))
    return 0


def plot(args: Any) -> int:
    """Write diagrams over the turn, the time, or the requested instants."""
    from mbody.views.backend import check_ending

    check_ending(args.output)
    kinds = [kind for kind in ("polar", "hodograph", "path") if getattr(args, kind)]
    if len(kinds) > 1 or (kinds and (args.quantities or args.x or args.log or args.vary)):
        given = [f"--{kind}" for kind in kinds] or ["quantities"]
        raise UsageError(f"a figure is of one kind: give {given[0]} alone")
    if args.axes and not args.hodograph:
        raise UsageError("--axes goes with --hodograph")
    mechanism = model_of(args)
    if args.vary:
        return _written(_overlaid(args, mechanism), args.output)
    run = _cycled(args, mechanism)
    return _written(_figure(args, run), args.output)


def _figure(args: Any, run: Solution) -> Figure:
    """One kind of figure of one result."""
    from mbody.views import plot as plotted
    from mbody.views.polar import hodograph, path_plot, polar

    if args.polar:
        return polar(run, *named_bodies(args.polar) or ())
    if args.hodograph:
        joints = named_bodies(args.hodograph) or ()
        return hodograph(run, *joints, axes=args.axes or "ground")
    if args.path:
        return path_plot(run, *args.path)
    bars = not args.no_modes
    return plotted(run, *args.quantities, x=args.x or "", log=args.log or "", modes=bars)


def _cycled(args: Any, mechanism: Mechanism) -> Solution:
    from mbody.analysis.driven.requests import analyse_at
    from mbody.views.cycle import cycle

    free = mechanism.simulation is not None and not args.at and not args.over
    if args.to is not None or free:
        return motion_or_driven(args, mechanism)
    wanted = cycle(mechanism, question(args, mechanism.ask))
    return analyse_at(mechanism, "kinetostatics", wanted, assembly_of(args))


def _overlaid(args: Any, mechanism: Mechanism) -> Figure:
    """The curves of several designs."""
    from mbody.analysis.driven.requests import analyse_system_at
    from mbody.analysis.dynamics.simulate import simulate
    from mbody.sweeps.samples import drawn, grid
    from mbody.system.assembler import assemble
    from mbody.views import plot as plotted
    from mbody.views.cycle import cycle

    given = named_values(args.vary, "--vary")
    if len(given) > 1:
        raise UsageError("--vary takes one number in a plot: its designs are curves")
    name, text = next(iter(given.items()))
    note_plain(mechanism, given)
    whole, runs, labels = assemble(mechanism), [], []
    numbers = drawn(whole, grid({name: values_of(name, text)}))
    if len(numbers.values) > MOST:
        raise UsageError(f"a plot shows at most {MOST} designs, not {len(numbers.values)}")
    wanted = cycle(mechanism, question(args, mechanism.ask))
    for value in numbers.values[:, 0].tolist():
        system = whole.with_values({numbers.names[0]: value})
        free = args.to is not None or (mechanism.simulation is not None and not args.at)
        runs.append(
            simulate(system, args.to)
            if free
            else analyse_system_at(system, "kinetostatics", wanted)
        )
        labels.append(f"{name} = {value:.4g}")
    return plotted(runs, *args.quantities, x=args.x or "", log=args.log or "", labels=labels)


def _written(figure: Figure, path: str) -> int:
    from mbody.views import save

    save(figure, path)
    message(f"wrote {path}")
    return 0
