"""Arguments of the commands for designers: what changes a quantity, what is best, what balances."""

from __future__ import annotations

import argparse

from mbody.cli.common_arguments import (
    add_analysis,
    add_angle,
    add_assembly,
    add_instants,
    add_json,
    add_model,
    add_output,
    model_file,
    table_place,
)

__all__ = [
    "add_assemblies",
    "add_balance",
    "add_fit",
    "add_optimize",
    "add_sensitivity",
    "add_tolerances",
    "add_transmission",
]


def add_sensitivity(command: argparse.ArgumentParser) -> None:
    """Of `mbody sensitivity`."""
    add_model(command)
    what = "a measure or a formula, such as 'peak(A.force)'"
    command.add_argument("measure", metavar="MEASURE", help=what)
    names = "numbers such as crank.A.x, with commas; by default all"
    command.add_argument("--by", action="append", default=[], metavar="NAMES", help=names)
    add_analysis(command)
    add_instants(command)
    add_angle(command)
    add_json(command)


def add_optimize(command: argparse.ArgumentParser) -> None:
    """Of `mbody optimize`."""
    add_model(command)
    command.add_argument("name", metavar="NAME", nargs="?", help="one task; all without it")
    aim = "a quantity, such as 'peak(A.force)', in place of the tasks of the file; twice: a front"
    command.add_argument("--minimize", action="append", default=[], metavar="FORMULA", help=aim)
    command.add_argument(
        "--maximize", action="append", default=[], metavar="FORMULA", help="the same, greatest"
    )
    command.add_argument(
        "--by",
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH",
        help="a number and its bounds, such as b=90:150 or 'crank.A.x=30 mm:50 mm'; again for more",
    )
    command.add_argument(
        "--subject-to",
        action="append",
        default=[],
        metavar="RELATION",
        help="a limit at all instants, such as 'peak(motor.effort) <= 20 N*m'; again for more",
    )
    kinds = "kinetostatics, kinematics, statics or simulate"
    command.add_argument("--analysis", metavar="NAME", help=kinds)
    command.add_argument(
        "--over", metavar="WHAT", help="a whole turn: 'turn', or which driver is to make it"
    )
    command.add_argument("--turns", metavar="N", help="of a cycle of several turns, with --over")
    command.add_argument("--until", metavar="TIME", help="of simulate: the last time")
    command.add_argument("--starts", metavar="N", help="searches (8)")
    command.add_argument("--seed", metavar="N", help="of their starts (0)")
    add_output(command, "write the best model (.toml)", kind=model_file)
    table = "write the numbers as a table; - prints it"
    command.add_argument("--csv", type=table_place, metavar="FILE", help=table)
    add_json(command)


def add_balance(command: argparse.ArgumentParser) -> None:
    """Of `mbody balance`."""
    add_model(command)
    command.add_argument(
        "--on",
        action="append",
        default=[],
        metavar="LINK=RADIUS",
        help="a link that gets a counterweight, such as 'crank=3 in', or from a point of it, "
        "'rocker.O4=5 in'; again for more",
    )
    names = "springs of the model whose stiffnesses are found, with commas"
    command.add_argument("--springs", action="append", default=[], metavar="NAMES", help=names)
    add_instants(command)
    add_output(command, "write the balanced model (.toml)", kind=model_file)
    add_json(command)


def add_tolerances(command: argparse.ArgumentParser) -> None:
    """Of `mbody tolerances`."""
    add_model(command)
    what = "a measure or a formula that is one number, such as 'peak(A.force)'"
    command.add_argument("measure", metavar="MEASURE", help=what)
    command.add_argument(
        "--scatter",
        action="append",
        default=[],
        metavar="NAME=WIDTH",
        help="a number and its tolerance ±, three deviations of a normal distribution, such as "
        "'crank.A.x=0.1 mm', or 'uniform 0.1 mm', 'triangular 0.1 mm'; again for more",
    )
    band = "the band in which it must stay: the loosest tolerances are found"
    command.add_argument("--within", metavar="LOW:HIGH", help=band)
    command.add_argument("--count", metavar="N", default="10000", help="random designs (10000)")
    command.add_argument("--seed", metavar="N", default="0", help="of the random designs (0)")
    add_analysis(command)
    add_instants(command)
    add_angle(command)
    add_json(command)


def add_fit(command: argparse.ArgumentParser) -> None:
    """Of `mbody fit`."""
    add_model(command)
    command.add_argument(
        "data",
        nargs="+",
        metavar="DATA",
        help="CSV files of measured runs, with headings: t or the drivers, then measures or "
        "formulas, with a unit in brackets, as in 'slider.x [mm]'",
    )
    names = "the unknown numbers, such as crank.A.x, with commas; by default those of [fit]"
    command.add_argument("--by", action="append", default=[], metavar="NAMES", help=names)
    shifted = "columns with an unknown constant, as of an encoder, with commas"
    command.add_argument("--offset", action="append", default=[], metavar="NAMES", help=shifted)
    kinds = "kinetostatics, kinematics, statics or simulate; by default as the model is driven"
    command.add_argument("--analysis", metavar="NAME", help=kinds)
    add_json(command)


def add_assemblies(command: argparse.ArgumentParser) -> None:
    """Of `mbody assemblies`."""
    add_model(command)
    command.add_argument(
        "--at",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="position of a driver or its body (crank=60, in degrees), or t=0.1",
    )
    command.add_argument(
        "--driver", metavar="NAME", help="of several, the one whose circuits are followed"
    )
    add_output(command, "draw all of them; ends in .svg, .png or .pdf")
    add_angle(command)
    add_json(command)


def add_transmission(command: argparse.ArgumentParser) -> None:
    """Of `mbody transmission`."""
    add_model(command)
    what = "the output body, or one of its points"
    command.add_argument("--output", metavar="BODY", required=True, help=what)
    command.add_argument("--driver", metavar="NAME", help="of several, the one that drives it")
    through = "of several joints or contacts, the one (or the group) that drives it"
    command.add_argument("--joint", metavar="NAME", help=through)
    add_instants(command)
    add_assembly(command)
    add_angle(command)
    add_json(command)
