"""The commands that draw: drawings, plots, films, free bodies, internal loads, poles, reports."""

from __future__ import annotations

import itertools
import math
import shlex
import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import answered, assembly_of, exit_status, head_of, print_data, question
from mbody.cli.design import note_plain, values_of
from mbody.cli.interrupts import interrupt
from mbody.cli.parser import equal_steps, given, model_of, named_values, path_of
from mbody.cli.streams import UsageError, message
from mbody.core.tolerances import LENGTH_NONE
from mbody.errors import ModelError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.engineering.instant_centres import InstantCentre, InstantCentres
    from mbody.model.mechanism import Mechanism
    from mbody.model.simulation import Instants
    from mbody.solution.solution import Solution
    from mbody.views.page import Viewer


# -- The commands `mbody export` and `mbody import`: files of other programs -------------------


def export(args: Any) -> int:
    """Write a model for another program; what that lacks is reported."""
    if args.fmi is not None and args.to != "fmu":
        raise UsageError(f"--fmi goes with --to fmu, not with --to {args.to}: leave it out")
    if args.to != "dxf" and (args.width or args.hole):
        raise UsageError(f"--width and --hole go with --to dxf, not with --to {args.to}")
    if args.to == "image":
        return _image(args)
    _refuse_instants(args)
    if args.to == "dxf":
        return _dxf(args)
    return _fmu(args) if args.to == "fmu" else _mjcf(args)


def _refuse_instants(args: Any) -> None:
    if args.instants is not None:
        what = {"fmu": "a unit", "dxf": "a drawing of parts"}.get(args.to, "a file of MuJoCo")
        raise UsageError(f"--instants goes with --to image: {what} has no instants")


def _mjcf(args: Any) -> int:
    """Write a model for MuJoCo."""
    from mbody.engines.mjcf import to_mjcf

    made = to_mjcf(model_of(args), fix_drivers=args.fix_drivers)
    missing = [f"not in the file: '{one.element}': {one.why}" for one in made.not_expressible]
    return _write(args.output, made.text, [*missing, *made.notes])


def _dxf(args: Any) -> int:
    """Write a drawing of all parts."""
    from mbody.exchange import to_dxf

    made = to_dxf(model_of(args), args.width, args.hole)
    return _write(args.output, made.text, made.notes)


def _image(args: Any) -> int:
    """Write the image of a model."""
    if args.output is None:
        raise UsageError("an image is binary, it cannot be printed: name its file with -o FILE")
    from mbody.image.model_image import to_image

    made = to_image(model_of(args), **given(args, "instants", "analyses"))
    return _write(args.output, made.content, made.notes, f": {len(made.content)} bytes")


def _fmu(args: Any) -> int:
    """Write a unit of co-simulation."""
    if args.output is None:
        raise UsageError("a unit is binary, it cannot be printed: name its file with -o FILE")
    from pathlib import Path

    from mbody.image.fmu import VERSIONS, to_fmu

    made = to_fmu(model_of(args), args.fmi or VERSIONS[0], name=Path(args.output).stem)
    machines = ", ".join(made.platforms)
    size = f": {len(made.content)} bytes, with binaries for {machines}"
    return _write(args.output, made.content, made.notes, size)


def _write(output: str | None, content: str | bytes, notes: Sequence[str], more: str = "") -> int:
    """Write a file, or print its text, and say the notes on it; `more`: what it contains."""
    from mbody.files.tables import writing

    if output is None:
        print(content, end="", flush=True)
    else:
        with writing(output, binary=isinstance(content, bytes)) as file:
            file.write(content)
    for note in notes:
        message(f"mbody: {note}")
    if output is not None:
        message(f"wrote {output}{more}")
    return 0


# -- `mbody import FILE -o model.toml` ---------------------------------------------------------


def import_file(args: Any) -> int:
    """Write a model file from another program's; what was assumed or left out is reported."""
    from mbody.exchange import import_model
    from mbody.files.model import save, to_toml

    made = import_model(args.file, args.units)
    if args.output is None:
        print(to_toml(made.mechanism), end="", flush=True)
    else:
        save(made.mechanism, args.output)
    for note in made.notes:
        message(f"mbody: {note}")
    if args.output is not None:
        message(f"wrote {args.output}: {made.mechanism.name}, from a file of {made.form}")
    return 0


def freebody(args: Any) -> int:
    """Write the free-body diagrams of a model."""
    from mbody.views import save
    from mbody.views.free_bodies import draw_free_bodies, force_peak

    output = _picture_file(args, "-freebody")
    mechanism = model_of(args)
    run = motion_or_driven(args, mechanism)
    instants = list(range(len(run)))
    if not args.at and len(run) > 1:
        instants = [force_peak(run)]
        message("mbody: at the instant of the greatest joint force; choose others with --at")
    save(draw_free_bodies(run, args.bodies or None, instants), output)
    message(f"wrote {output}")
    return 0


def _picture_file(args: Any, kind: str = "") -> str:
    """Where a picture is written: by default beside the user, named after the model."""
    from mbody.views.labels import check_ending

    output = str(args.output or f"{path_of(args.model).stem}{kind}.svg")
    check_ending(output)
    return output


def motion_or_driven(args: Any, mechanism: Mechanism, forces: bool = True) -> Solution:
    """The driven analysis at the requested instants; of what nothing drives its free motion."""
    from mbody.analysis.driven.driven import analyse_at
    from mbody.analysis.dynamics.simulate import simulate
    from mbody.model.numbers import number_in

    wanted = question(args, mechanism.ask)
    to = getattr(args, "to", None)
    if to is not None and (args.at or args.over):
        raise UsageError("--to follows the free motion, --at and --over are driven: give one")
    if to is not None or (mechanism.simulation is not None and wanted is mechanism.ask):
        if args.assembly is not None:
            raise UsageError("--assembly is of driven analyses: this is a free motion")
        return simulate(mechanism, to)
    if wanted is not None and _of_free_motion(mechanism, wanted):
        times = sorted({number_in(mechanism, one, "time", "--at", "t") for one in wanted.at["t"]})
        return simulate(mechanism, times[-1], times=times)
    analysis = "kinetostatics" if forces else "kinematics"
    return analyse_at(mechanism, analysis, wanted, assembly_of(args))


def _of_free_motion(mechanism: Mechanism, wanted: Instants | None) -> bool:
    """Whether instants are times of the motion of what nothing drives."""
    asked = wanted is not None and set(wanted.at) == {"t"}
    return asked and mechanism.simulation is not None and not mechanism.drivers


# -- `mbody internal MODEL --body LINK`: internal loads and stress along a link ----------------


def internal(args: Any) -> int:
    """Print the greatest internal loads of a link, and draw their diagrams."""
    from mbody.engineering import internal_loads
    from mbody.views.labels import check_ending

    if args.output:
        check_ending(args.output)
    along = None if args.along is None else [word.strip() for word in args.along.split(",")]
    if along is not None and len(along) != 2:
        raise UsageError(f"--along takes two points such as A,B, not {args.along[:60]!r}")
    run = motion_or_driven(args, model_of(args))
    found = internal_loads(run, args.body, along, lumped=args.lumped, **given(args, "places"))
    if args.output:
        from mbody.views import save
        from mbody.views.plotting import internal_diagram

        save(internal_diagram(found), args.output)
        message(f"wrote {args.output}")
    return answered(args, found)


# -- `mbody poles MODEL`: instant centres, and the polygons of velocities and accelerations ----


def poles(args: Any) -> int:
    """Print the instant centres of all pairs of bodies; as data the polygons too."""
    from mbody.engineering.instant_centres import (
        acceleration_polygon,
        instant_centres,
        velocity_polygon,
    )
    from mbody.solution.declared_result import declared_data

    run = motion_or_driven(args, model_of(args), forces=False)
    found = instant_centres(run)
    if args.json:
        units = run.mechanism.data_units.with_angle(args.angle, "rad")
        polygons = velocity_polygon(run), acceleration_polygon(run)
        data = head_of(run.mechanism, "poles", found, units) | {
            "t": units.converted(run.t, "time").tolist(),
            "centres": found.data(units),
            "collinearity": found.collinearity(),
            "sentences": [found.sentences(k) for k in range(len(run))],
            "polygons": [declared_data(one, units) for one in polygons],
        }
        print_data(data)
    else:
        # of a model's own instants the first, of a motion the last, of those that are named all
        instants = [len(run) - 1] if args.to is not None else range(len(run))
        for k in instants if args.at or args.over or args.to is not None else [0]:
            print(_table(run, found, k))
    return exit_status(found, printed=args.json)


def _table(run: Solution, found: InstantCentres, k: int) -> str:
    from mbody.summaries.text_table import Column, paragraph, table, with_unit

    units = run.mechanism.shown
    floor = LENGTH_NONE * run.system.length / units.size("length")
    lines = table(
        [
            Column("CENTRE", [found.symbol(one) for one in found.pairs], text=True),
            Column("of the links", [" and ".join(one.bodies) for one in found.pairs], text=True),
            Column("x", _places(found, "x", k, floor), units.of("length")),
            Column("y", _places(found, "y", k, floor), units.of("length")),
            Column("", [_note(one, k) for one in found.pairs], text=True),
        ]
    )
    head = [f"{run.mechanism.name}: t = {with_unit(run.t[k], 'time', units)}", ""]
    said = [line for text in (*found.sentences(k), *found.notes) for line in paragraph(text)]
    return "\n".join([*head, *lines, "", *said, *([""] if said else [])])


def _places(found: InstantCentres, axis: str, k: int, floor: float) -> list[str]:
    """Cells of the places, empty where there is none."""
    from mbody.summaries.text_table import numbers

    size = 1.0 if found.units is None else found.units.size("length")
    values = [float(getattr(one, axis)[k]) / size for one in found.pairs]
    cells = iter(numbers([value for value in values if math.isfinite(value)] or [0.0], floor))
    return [next(cells) if math.isfinite(value) else "" for value in values]


def _note(one: InstantCentre, k: int) -> str:
    if one.kind[k] == "none":
        return "no relative motion"
    if one.kind[k] == "infinite":
        return (
            f"at infinity, towards {math.degrees(one.direction[k]) + 0.0:.3f}° ({one.permanence})"
        )
    return one.permanence


# -- `mbody draw MODEL` and `mbody plot MODEL QUANTITY …` --------------------------------------

#: Designs of one plot.
MOST = 1000
#: Positions that a motion is drawn at, and that a series may have.
POSITIONS, LONGEST = 5, 200


def draw(args: Any) -> int:
    """Write a picture of a model at the requested instants, or at equal steps of its motion."""
    from mbody.views import draw as drawn

    args.output = _picture_file(args)
    count = _positions(args)
    mechanism = model_of(args)
    options = {"paths": args.path, "only": args.only}
    marks = {
        "poles": args.poles,
        "polygons": args.polygons,
        "centrodes": args.centrodes,
        "inflection": args.inflection,
        "curvature": args.curvature,
    }
    wanted = question(args, mechanism.ask)
    plain = count is None and args.to is None and wanted is mechanism.ask and not args.assembly
    free = mechanism.simulation is not None and wanted is None
    if plain and (free or not (mechanism.drivers or args.forces)):
        return _written(drawn(mechanism, forces=args.forces, **options, **marks), args.output)
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
        return _series(args, run, instants, options)
    figure = drawn(run, instants, args.forces, strip=args.strip, **options, **marks)
    return _written(figure, args.output)


def _positions(args: Any) -> int | None:
    """Number of positions that are wanted."""
    count: int | None = args.positions
    if count is not None and not 1 <= count <= LONGEST:
        raise UsageError(f"--positions takes a whole number, 1 to {LONGEST}, not '{count}'")
    if count is not None and args.at:
        raise UsageError("--positions are equal steps of the motion, --at names places: give one")
    return count


def _motion(args: Any, mechanism: Mechanism, count: int | None) -> Solution:
    """The run of which instants are drawn."""
    from mbody.analysis.driven.driven import analyse_at
    from mbody.model.simulation import Instants
    from mbody.views.shapes import cycle

    wanted = question(args, mechanism.ask)
    free = mechanism.simulation is not None and count is not None
    if args.to is not None or free or _of_free_motion(mechanism, wanted):
        return motion_or_driven(args, mechanism)
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
    revolution = bool(run.mechanism.drivers) and args.to is None and len(run) == count + 1
    last = len(run) - 1
    # after a whole revolution the first position comes again; of a motion the last is in full
    if count == 1 and not revolution:
        return [last]
    steps = [round(n * last / (count if revolution else count - 1)) for n in range(count)]
    forward = revolution or args.strip or args.series
    return list(dict.fromkeys(steps if forward else steps[::-1]))


def _series(args: Any, run: Solution, instants: list[int], options: Any) -> int:
    """A file for each instant, all of one scale and size."""
    from mbody.views.drawing import draw_series

    path = Path(args.output)
    digits = len(str(len(instants)))
    for n, figure in enumerate(draw_series(run, instants, args.forces, **options), 1):
        _written(figure, str(path.with_name(f"{path.stem}-{n:0{digits}d}{path.suffix}")))
    return 0


def plot(args: Any) -> int:
    """Write diagrams over the turn, the time, or the requested instants."""
    args.output = _picture_file(args, "-plot")
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
    from mbody.views.plotting import hodograph, path_plot, polar

    if args.polar:
        return polar(run, *args.polar)
    if args.hodograph:
        return hodograph(run, *args.hodograph, axes=args.axes or "ground")
    if args.path:
        return path_plot(run, *args.path)
    bars = not args.no_modes
    return plotted(run, *args.quantities, x=args.x or "", log=args.log or "", modes=bars)


def _cycled(args: Any, mechanism: Mechanism) -> Solution:
    from mbody.analysis.driven.driven import analyse_at
    from mbody.views.shapes import cycle

    free = mechanism.simulation is not None and not args.at and not args.over
    if args.to is not None or free:
        return motion_or_driven(args, mechanism)
    wanted = cycle(mechanism, question(args, mechanism.ask))
    return analyse_at(mechanism, "kinetostatics", wanted, assembly_of(args))


def _overlaid(args: Any, mechanism: Mechanism) -> Figure:
    """The curves of several designs."""
    from mbody.analysis.driven.driven import analyse_system_at
    from mbody.analysis.dynamics.simulate import simulate
    from mbody.sweeps.samples import drawn, grid
    from mbody.system.assembler import assemble
    from mbody.views import plot as plotted
    from mbody.views.shapes import cycle

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


# -- `mbody view MODEL` and `mbody animate MODEL`: a mechanism in motion, as a page or a film --


def view(args: Any) -> int:
    """Write a page on which the model moves."""
    path = args.output or f"{path_of(args.model).stem}.html"
    options: dict[str, Any] = {"plots": args.plot, "command": _view_command(args)}
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
    from mbody.image.arena import ready_core
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
    options = given(args, "duration", "rate", "width")
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
    from mbody.views.page import check_designs
    from mbody.views.shapes import motion

    varied = named_values(args.vary, "--vary")
    choices = [
        [(name, value) for value in equal_steps(f"--vary {name}", text)]
        for name, text in varied.items()
    ]
    check_designs(math.prod(len(one) for one in choices))
    own, found = list(args.set), {}
    for design in itertools.product(*choices):
        name = ", ".join(f"{key} = {value}" for key, value in design)
        args.set = own + [f"{key}={value}" for key, value in design]
        mechanism: Mechanism = model_of(args)
        if args.to is not None and (args.at or args.over):
            raise UsageError("give --to, or --at or --over, not both")
        wanted = question(args, mechanism.ask)
        found[name] = motion(
            mechanism, wanted, args.to, lambda t: interrupt.mark(), assembly_of(args)
        )
        interrupt.done()
    args.set = own
    return found


def _no_parameters(args: Any) -> list[str]:
    """Names in --vary that are no parameters of the model, as "crank.A.x"."""
    names = named_values(args.vary, "--vary")
    known = model_of(args).parameters if names else ()
    return [name for name in names if name not in known]


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]


def _view_command(args: Any) -> str:
    """The command as it was given, for the reader of the page."""
    words = sys.argv[1:] if Path(sys.argv[0]).stem in ("mbody", "__main__") else []
    return shlex.join(["mbody", *words]) if words else f"mbody view {args.model}"


def _progress() -> Any:
    """Shows on a terminal how many frames are done, and lets Ctrl-C end the film."""
    shows = sys.stderr is not None and sys.stderr.isatty()

    def progress(done: int, total: int) -> None:
        interrupt.mark()
        if shows and (done % 5 == 0 or done == total):
            message(f"\rframe {done} of {total}", end="\n" if done == total else "")

    return progress


# -- `mbody report MODEL`: the engineer's document ---------------------------------------------


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
        compared = {one.partition("=")[0].strip() for one in args.compare}
        kept = [one for one in args.set if one.partition("=")[0].strip() not in compared]
        other = model_of(Namespace(model=args.model, set=kept + args.compare, units=args.units))
    wanted = question(args, mechanism.ask)
    found = made(
        mechanism,
        args.sections,
        without=args.without,
        at=None if wanted is mechanism.ask else wanted,
        to=args.to,
        title=args.title or "",
        author=args.author or "",
        plots=args.plot,
        polar=args.polar,
        against=args.against or None,
        compare=other,
        labels=_labels(args),
        command=_repeating_command(args),
        assembly=assembly_of(args),
    )
    files = found.save(output)
    message(f"wrote {files[0]}" + (f" and {len(files) - 1} pictures" if len(files) > 1 else ""))
    if args.open:
        import webbrowser
        from pathlib import Path

        webbrowser.open(Path(files[0]).resolve().as_uri())
    return exit_status(found, printed=False)


def _labels(args: Any) -> tuple[str, str]:
    """Labels of two compared designs."""
    return ", ".join(args.set) or "as given", ", ".join(args.compare)


def _repeating_command(args: Any) -> str:
    """The command that makes the same report."""
    words = ["mbody", "report", args.model]
    for option in ("set", "at", "plot", "compare"):
        words += [word for value in getattr(args, option) for word in (f"--{option}", value)]
    for option, names in given(args, "sections", "without", "polar", "against").items():
        words += [f"--{option}", ",".join(names)] if names else []
    names = ("units", "over", "instants", "turns", "assembly", "to", "title", "author")
    for option, value in given(args, *names).items():
        words += [f"--{option}", str(value)]
    return shlex.join(words)
