"""Options of the commands for designers: what changes a quantity, what is best, what balances."""

from __future__ import annotations

import argparse

from mbody.cli.options import driven_option, instants_options, json_option, model_options

__all__ = [
    "balance_options",
    "fit_options",
    "optimize_options",
    "sensitivity_options",
    "tolerances_options",
]


def sensitivity_options(command: argparse.ArgumentParser) -> None:
    """Of `mbody sensitivity`."""
    model_options(command)
    what = "a measure or a formula, such as 'peak(A.force)'"
    command.add_argument("measure", metavar="MEASURE", help=what)
    names = "numbers such as crank.A.x, with commas; by default all"
    command.add_argument("--by", action="append", default=[], metavar="NAMES", help=names)
    driven_option(command)
    instants_options(command)
    json_option(command)


def optimize_options(command: argparse.ArgumentParser) -> None:
    """Of `mbody optimize`."""
    model_options(command)
    command.add_argument("name", metavar="NAME", nargs="?", help="one task; all without it")
    command.add_argument("-o", "--output", metavar="FILE", help="write the best model (.toml)")
    command.add_argument("--csv", metavar="FILE", help="write the numbers as a table")
    json_option(command)


def balance_options(command: argparse.ArgumentParser) -> None:
    """Of `mbody balance`."""
    model_options(command)
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
    instants_options(command)
    command.add_argument("-o", "--output", metavar="FILE", help="write the balanced model (.toml)")
    json_option(command)


def tolerances_options(command: argparse.ArgumentParser) -> None:
    """Of `mbody tolerances`."""
    model_options(command)
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
    driven_option(command)
    instants_options(command)
    json_option(command)


def fit_options(command: argparse.ArgumentParser) -> None:
    """Of `mbody fit`."""
    model_options(command)
    command.add_argument(
        "data",
        nargs="+",
        metavar="DATA",
        help="CSV files of measured runs, with headings: t or the drivers, then measures or "
        "formulas, with a unit in brackets, as in 'slider.x [mm]'",
    )
    names = "the unknown numbers, such as crank.A.x, with commas"
    command.add_argument("--by", action="append", default=[], metavar="NAMES", help=names)
    shifted = "columns with an unknown constant, as of an encoder, with commas"
    command.add_argument("--offset", action="append", default=[], metavar="NAMES", help=shifted)
    kinds = "kinetostatics, kinematics, statics or simulate; by default as the model is driven"
    command.add_argument("--analysis", metavar="NAME", help=kinds)
    json_option(command)
