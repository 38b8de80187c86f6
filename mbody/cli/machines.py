"""The commands for engines and machines: shaking, flywheels, motors, bearings, cams."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import answered, assembly_of, exit_status, print_data, question
from mbody.cli.option_values import given, model_of, named_values, plain_angle
from mbody.cli.pictures import motion_or_driven
from mbody.cli.streams import PRINTED, UsageError, check_printed, message, write_rows
from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.engineering import CamAnalysis, FlywheelProof
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution


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
    from mbody.model.study import Instants

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
    from mbody.engineering.bearing_loads import BearingLoads, bearing_load

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
    printed = args.csv == PRINTED
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
