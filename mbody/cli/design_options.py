"""Options of the commands for designers: what changes a quantity, what is best, what balances."""

from __future__ import annotations

import argparse

from mbody.cli.options import driven_option, instants_options, json_option, model_options

__all__ = ["balance_options", "optimize_options", "sensitivity_options"]


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
