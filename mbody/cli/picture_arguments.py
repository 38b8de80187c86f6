"""Arguments of the commands that draw and report."""

from __future__ import annotations

import argparse

from mbody.cli.common_arguments import (
    add_assembly,
    add_instants,
    add_model,
    add_output,
    add_paths,
    add_picture_file,
    add_vary,
)

__all__ = ["add_animate", "add_draw", "add_freebody", "add_plot", "add_report", "add_view"]


def add_freebody(command: argparse.ArgumentParser) -> None:
    """Of `mbody freebody`."""
    add_model(command)
    add_instants(command)
    add_assembly(command)
    command.add_argument("--to", metavar="TIME", help="of the free motion until that time")
    command.add_argument(
        "--bodies",
        action="append",
        default=[],
        metavar="NAMES",
        help="which links, with commas between them; by default all",
    )
    add_output(command, "ends in .svg, .png or .pdf (MODEL.svg)")


def add_report(command: argparse.ArgumentParser) -> None:
    """Of `mbody report`."""
    add_model(command)
    add_instants(command)
    add_assembly(command)
    command.add_argument("--to", metavar="TIME", help="of the free motion until that time")
    for option, names, text in (
        ("sections", "NAMES", "what it contains, in order, with commas; by default everything"),
        ("without", "NAMES", "sections that are left out"),
        ("plot", "QUANTITY", "what is plotted; by default efforts, forces and measures"),
        ("polar", "JOINTS", "whose forces are drawn as vectors"),
        ("against", "ENGINES", "of the second opinion; by default all that are installed"),
        ("compare", "NAME=VALUE", "another design, beside this one, as of --set"),
    ):
        command.add_argument(f"--{option}", action="append", default=[], metavar=names, help=text)
    command.add_argument("--title", metavar="TEXT", help="of the document")
    command.add_argument("--open", action="store_true", help="open it in the browser")
    add_output(command, "ends in .html, .md, .tex or .pdf (MODEL.html)")


def add_draw(command: argparse.ArgumentParser) -> None:
    """Of `mbody draw`."""
    add_model(command)
    add_instants(command)
    add_assembly(command)
    command.add_argument("--forces", action="store_true", help="draw the joint forces too")
    add_paths(command)
    command.add_argument("--to", metavar="TIME", help="the free motion until that time")
    command.add_argument(
        "--positions", metavar="N", help="N equal steps of the turn or of the motion"
    )
    command.add_argument(
        "--strip", action="store_true", help="several positions beside each other, not overlaid"
    )
    command.add_argument(
        "--series", action="store_true", help="a file for each position, at one scale"
    )
    command.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="BODIES",
        help="draw only these links, with commas between them",
    )
    command.add_argument(
        "--poles", action="store_true", help="draw all instant centres, and the lines to find them"
    )
    command.add_argument(
        "--polygons", action="store_true", help="the velocity and the acceleration polygon beside"
    )
    for option, names, text in (
        ("centrodes", "BODIES", "the fixed and the moving centrode of bodies against the ground"),
        ("inflection", "BODIES", "inflection circles of bodies"),
        ("curvature", "POINT", "the path of a point and its circle of curvature"),
    ):
        command.add_argument(f"--{option}", action="append", default=[], metavar=names, help=text)
    add_picture_file(command)


def _moving(command: argparse.ArgumentParser) -> None:
    add_model(command)
    add_instants(command)
    add_assembly(command)
    command.add_argument("--to", metavar="TIME", help="the last time, such as 10 or '2 min'")
    add_vary(command, "designs that are shown with one another, or NAME=1,2,3")
    command.add_argument(
        "--show",
        metavar="WHAT",
        help="with commas: names, forces, velocities, accelerations, paths, centres, ghosts",
    )
    add_paths(command)


def add_view(command: argparse.ArgumentParser) -> None:
    """Of `mbody view`."""
    _moving(command)
    command.add_argument(
        "--plot",
        action="append",
        default=[],
        metavar="QUANTITY",
        help="a diagram of a measure or a formula, such as B.force; by default the measures",
    )
    kind = command.add_mutually_exclusive_group()
    kind.add_argument(
        "--live",
        action="store_true",
        help="the page solves the model again while one drags and changes it; builds the core for "
        "browsers where it is missing (once)",
    )
    kind.add_argument(
        "--recorded", action="store_true", help="the page plays the recorded motion only"
    )
    command.add_argument("--open", action="store_true", help="open the page in the browser")
    add_output(command, "ends in .html (MODEL.html by default), or in .json for the web component")


def add_animate(command: argparse.ArgumentParser) -> None:
    """Of `mbody animate`."""
    _moving(command)
    command.add_argument("--duration", metavar="S", help="seconds of the film")
    command.add_argument("--rate", metavar="N", help="frames a second (25)")
    command.add_argument("--width", metavar="PX", help="pixels (640)")
    add_output(command, "ends in .gif (MODEL.gif by default), .webp, .apng, .svg or .mp4")


def add_plot(command: argparse.ArgumentParser) -> None:
    """Of `mbody plot`."""
    add_model(command)
    command.add_argument(
        "quantities",
        nargs="*",
        metavar="QUANTITY",
        help="a measure of the model, or a formula such as motor.effort, B.force, coupler.P.y; "
        "without any, all measures; a unit in brackets behind it, as in 'B.force [kN]'",
    )
    add_instants(command)
    add_assembly(command)
    command.add_argument("--to", metavar="TIME", help="the free motion until that time")
    command.add_argument("--x", metavar="QUANTITY", help="what it is plotted over")
    command.add_argument("--log", metavar="AXES", help="logarithmic axes: x, y or xy")
    command.add_argument(
        "--no-modes",
        action="store_true",
        help="without the bars that say what is open, sticks, slides or rolls",
    )
    add_vary(command, "several designs, overlaid; more than six are a band")
    for kind, text in (
        ("polar", "magnitudes of joint forces over the angle of the crank"),
        ("hodograph", "the curves of the tips of joint forces"),
        ("path", "the path of a point, y over x"),
    ):
        names = "POINT" if kind == "path" else "JOINTS"
        command.add_argument(f"--{kind}", action="append", default=[], metavar=names, help=text)
    command.add_argument("--axes", metavar="BODY", help="the link in whose axes a hodograph is")
    add_picture_file(command)
