"""The commands for learning: `demo`, `derive`, `explain`, `exercise`, `new`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli import parser
from mbody.cli.analyse import answered, assembly_of, exit_status, print_data, question
from mbody.cli.parser import given, model_of, named_values, plain_angle
from mbody.cli.pictures import motion_or_driven
from mbody.cli.streams import PRINTED as STREAMS_PRINTED
from mbody.cli.streams import UsageError, check_printed, message, write_rows
from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.engineering import CamAnalysis, FlywheelProof
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution


# -- The commands for engines and machines: shaking, flywheels, motors, bearings, cams ---------


def shaking(args: Any) -> int:
    """Print the orders of the shaking force."""
    from mbody.engineering import balance_shafts, shaking_orders

    highest = {} if args.orders is None else {"highest": _positive_number(args.orders, "--orders")}
    orders = [_positive_number(part, "--shafts") for part in (args.shafts or "").split(",") if part]
    run = cycle_run(args, model_of(args))
    found = shaking_orders(run, args.about, args.driver, **highest)
    if orders:
        found = dataclasses.replace(found, shafts=balance_shafts(run, orders, args.driver))
    return answered(args, found, printed=True)


def cycle_run(args: Any, mechanism: Mechanism, analysis: str = "kinetostatics") -> Solution:
    """The requested cycle, else that of the model, else a turn of the driver."""
    from mbody.analysis.driven.driven import analyse_at
    from mbody.model.simulation import Instants

    wanted = question(args, mechanism.ask)
    if not args.at and (wanted is None or not wanted.over):
        wanted = Instants(over="turn")
    return analyse_at(mechanism, analysis, wanted, assembly_of(args))


def _positive_number(text: str, option: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or not value > 0.0:
        raise UsageError(f"{option} takes numbers above 0 such as 2, not {text[:40]!r}")
    return value


# -- `mbody flywheel MODEL --coefficient C`: the turning moment over a cycle, and its flywheel -


def flywheel(args: Any) -> int:
    """Print the fluctuation and the flywheel, and prove it by the free motion."""
    from mbody.engineering import size_flywheel

    run = cycle_run(args, model_of(args))
    found = size_flywheel(run, args.coefficient, args.driver)
    proof = found.simulated() if args.simulate else None
    if args.json:
        data = found.data(args.angle)
        if proof is not None:
            data["simulated"] = {"coefficient": proof.coefficient, "status": proof.status}
        print_data(data)
    else:
        print(found)
        if proof is not None:
            print(_line(proof))
    return exit_status(found, printed=args.json)


def _line(proof: FlywheelProof) -> str:
    return f"\nsimulated over a cycle: fluctuation of the speed {proof.coefficient:.6g}"


# -- `mbody motor MODEL`: a motor with its gear against what a driver asks of it ---------------


def motor(args: Any) -> int:
    """Print rms and peak torque, the inertia ratio, and the limit that is nearest."""
    from mbody.engineering import MotorCurve, motor_sizing

    curve = MotorCurve(
        _row(args.speed), _row(args.peak), _row(args.continuous), inertia=args.inertia
    )
    run = cycle_run(args, model_of(args))
    found = motor_sizing(run, curve, args.driver, **given(args, "ratio", "efficiency", "rest"))
    return answered(args, found)


def _row(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


# -- `mbody bearings MODEL`: loads of bearings over a cycle, their spectra and lives -----------

#: Classes of a spectrum that is data.
CLASSES = 10


def bearings(args: Any) -> int:
    """Print the equivalent load and the life of every bearing."""
    from mbody.engineering.internal_loads import BearingLoads, bearing_load

    ratings: dict[str, Any] = named_values(args.rating, "--rating")
    mechanism = model_of(args)
    # a rating for a joint that is no bearing is refused with those that there are
    wanted = [*dict.fromkeys([*(args.joint or _revolutes(mechanism)), *ratings])]
    kind = _kind(args.kind)
    run = motion_or_driven(args, mechanism) if args.to else cycle_run(args, mechanism)
    loads = {name: bearing_load(run, name, kind, ratings.get(name)) for name in wanted}
    classes = args.spectrum or CLASSES
    found = BearingLoads(run, loads, classes, spectra=bool(args.spectrum))
    return answered(args, found, printed=True)


def _revolutes(mechanism: Mechanism) -> list[str]:
    from mbody.model.joints import Revolute

    names = [one.name for one in mechanism.joints if isinstance(one, Revolute)]
    if not names:
        raise ModelError(f"'{mechanism.name}' has no revolute joint: there is no bearing in it")
    return names


def _kind(text: str) -> str | float:
    """The kind, or an exponent."""
    try:
        return float(text)
    except ValueError:
        return text


# -- `mbody cam MODEL`: pressure angle, curvature, contour and base circle of a cam ------------

#: Points of a contour.
POINTS = 361


def cam(args: Any) -> int:
    """Print what limits a cam, and write its contour."""
    from mbody.engineering import cam_analysis

    check_printed(args)
    printed = args.csv == STREAMS_PRINTED
    if args.points is not None and not args.csv:
        raise UsageError("--points goes with --csv")
    machine = model_of(args)
    try:
        run = cycle_run(args, machine, "kinematics")
    except ModelError:
        if _print_undercut(machine, args):
            return 1
        raise
    limit = None if args.limit is None else plain_angle("--limit", args.limit)
    found = cam_analysis(run, args.joint, limit=limit)
    if args.csv:
        _write(found, args, POINTS if args.points is None else args.points, args.angle or "rad")
    if args.json:
        print_data(found.data(args.angle))
    elif not printed:
        print(found)
    return exit_status(found, printed=not printed)


def _print_undercut(machine: Mechanism, args: Any) -> bool:
    """Print where a cam that is refused undercuts; whether that is why it was."""
    from mbody.engineering import cam_undercut

    try:
        found = cam_undercut(machine, args.joint)
    except ModelError:
        return False  # the first error says more
    if not found.undercut:
        return False
    if args.csv:
        message(f"mbody: '{found.joint.name}' undercuts: no contour is written")
    if args.json:
        print_data(found.data(args.angle))
    else:
        print(found)
    return True


def _write(found: CamAnalysis, args: Any, points: int, angle: str) -> None:
    from mbody.quantities.evaluate import degrees_of

    rows = found.contour(points)
    if angle == "deg":
        rows = rows.copy()
        rows[:, 0] = degrees_of(rows[:, 0])
    unit = found.mechanism.units.length
    names = ("x", "y", "pitch_x", "pitch_y", "radius_of_curvature")
    write_rows(args, [f"psi [{angle}]", *(f"{name} [{unit}]" for name in names)], rows.tolist())


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
    from mbody.files.tables import writing
    from mbody.teaching import derivation_as

    run = motion_or_driven(args, parser.model_of(args))
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
    from mbody.teaching.exercises import element_reference, reference_overview

    if args.element is None:
        print(reference_overview())
    else:
        table = reference_overview(args.element)
        print(*([table] if table else element_reference(args.element)), sep="\n\n")
    return 0


# -- `mbody exercise MODEL`: a sheet of questions and its key ----------------------------------


def exercise(args: Any) -> int:
    """Print the sheet, and write its figures and the key."""
    from mbody.files.tables import writing
    from mbody.teaching.exercises import exercises

    path, fixed = parser.path_of(args.model), parser.named_values(args.set, "--set")
    bounds = {}
    for name, text in parser.named_values(args.vary, "--vary").items():
        bounds[name] = parser.low_and_high(name, text)
    if not bounds:
        raise UsageError("choose what differs between exercises: --vary NAME=LOW:HIGH")

    def make(values: Mapping[str, str]) -> Mechanism:
        machine = parser.model_in(path, {**fixed, **values})
        return parser.in_units_of(machine, args.units) if args.units else machine

    found = exercises(make, bounds, **parser.given(args, "count", "seed"))
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
    from mbody.files.tables import writing
    from mbody.teaching.exercises import KINDS, new_model

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
