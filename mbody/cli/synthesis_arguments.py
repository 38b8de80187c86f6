"""The arguments of `mbody synthesize`, `mbody cognates` and `mbody atlas`."""

from __future__ import annotations

import argparse

from mbody.cli.common_arguments import (
    add_json,
    add_model,
    add_output,
    model_file,
)

__all__ = ["add_atlas", "add_cognates", "add_synthesize"]


def add_atlas(command: argparse.ArgumentParser) -> None:
    """Add the arguments of `mbody atlas`."""
    command.add_argument("--to", metavar="FILE", required=True, help="where it is written")
    command.add_argument(
        "--kind", metavar="KIND", default="four_bar", help="four_bar (default) or slider_crank"
    )
    command.add_argument("--count", metavar="N", help="how many curves (4000)")
    command.add_argument("--seed", metavar="N", help="of the random shapes (0)")


def add_cognates(command: argparse.ArgumentParser) -> None:
    """Add the arguments of `mbody cognates`."""
    add_model(command)
    command.add_argument(
        "--point", metavar="NAME", required=True, help="of the coupler, such as coupler.P"
    )
    add_output(
        command, "where the cognates are written: cognate.toml, cognate-2.toml", kind=model_file
    )
    add_json(command)


def add_synthesize(command: argparse.ArgumentParser) -> None:
    """Add the arguments to the command."""
    command.add_argument(
        "points",
        metavar="FILE",
        help="a table (CSV) with columns x, y and maybe timing: a path; x, y, angle: poses; "
        "input, output: a function; numbers may have units, plain angles are in degrees",
    )
    command.add_argument("--kind", metavar="KIND", help="four_bar (default) or slider_crank")
    command.add_argument(
        "--model",
        metavar="MODEL",
        help="another mechanism, a model file or a gallery model, whose numbers in --by are sought",
    )
    command.add_argument(
        "--point",
        metavar="NAME",
        help="of a model: the point of the path, such as coupler.P, or the output of the function, "
        "such as rocker.angle",
    )
    command.add_argument(
        "--span", metavar="LOW:HIGH", help="of a model: the range of its driver, by default a turn"
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
    command.add_argument("--units", metavar="NAME", help="the unit system (SI)")
    command.add_argument("--ground", metavar="LENGTH", help="of a four-bar for a function (1)")
    command.add_argument(
        "--atlas", metavar="FILE", help="of a closed path: start from the curves of this atlas"
    )
    command.add_argument("--full-turn", action="store_true", help="the crank must turn round")
    command.add_argument("--defective", action="store_true", help="keep designs with defects too")
    for name, metavar, text in (
        ("count", "N", "how many designs at most (5)"),
        ("search", "N", "how many designs are tried for a path"),
        ("seed", "N", "of the random designs (0)"),
    ):
        command.add_argument(f"--{name}", metavar=metavar, help=text)
    add_output(
        command, "where the designs are written: design.toml, design-2.toml, …", kind=model_file
    )
    command.add_argument("--json", action="store_true", help="print data instead of text")
