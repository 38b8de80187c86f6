"""The arguments of `mbody synthesize`."""

from __future__ import annotations

import argparse

__all__ = ["synthesize_arguments"]


def synthesize_arguments(command: argparse.ArgumentParser) -> None:
    """Add the arguments to the command."""
    command.add_argument(
        "points",
        metavar="FILE",
        help="a table (CSV) with columns x, y and maybe timing: a path; x, y, angle: poses; "
        "input, output: a function; numbers may have units, plain angles are in degrees",
    )
    command.add_argument(
        "--kind", metavar="KIND", default="four_bar", help="four_bar (default) or slider_crank"
    )
    command.add_argument(
        "--by",
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH",
        help="bounds of a number, such as crank.A.x=10:40, again for more",
    )
    command.add_argument(
        "--subject-to",
        action="append",
        default=[],
        metavar="CONDITION",
        help="on the motion, such as 'min(coupler.P.y) >= 20 mm', again for more",
    )
    command.add_argument("--units", metavar="NAME", default="SI", help="the unit system (SI)")
    command.add_argument("--ground", metavar="LENGTH", help="of a four-bar for a function (1)")
    command.add_argument("--full-turn", action="store_true", help="the crank must turn round")
    command.add_argument("--defective", action="store_true", help="keep designs with defects too")
    for name, metavar, text in (
        ("count", "N", "how many designs at most (5)"),
        ("search", "N", "how many designs are tried for a path"),
        ("seed", "N", "of the random designs (0)"),
    ):
        command.add_argument(f"--{name}", metavar=metavar, help=text)
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="where the designs are written: design.toml, design-2.toml, …",
    )
    command.add_argument("--json", action="store_true", help="print data instead of text")
