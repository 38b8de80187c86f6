"""Arguments that several commands take."""

from __future__ import annotations

import argparse
from collections.abc import Callable

__all__ = [
    "MODEL",
    "add_analysis",
    "add_angle",
    "add_assembly",
    "add_instants",
    "add_json",
    "add_model",
    "add_output",
    "add_paths",
    "add_picture_file",
    "add_resting",
    "add_tables",
    "add_vary",
    "model_file",
    "printed",
    "table_place",
]

MODEL = "a model file (TOML, or JSON by its ending), or the name of a gallery model"


def add_model(command: argparse.ArgumentParser) -> None:
    """The model, other values of its parameters, and units of the results."""
    command.add_argument("model", metavar="MODEL", help=MODEL)
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="another value for a parameter of the model, such as --set 'load=12 lbf'",
    )
    command.add_argument(
        "--units",
        metavar="SYSTEM",
        help="units of the results: SI, mm-N-s, in-lbf-s, ft-lbf-s, or such as cm-kN-s",
    )


def add_instants(command: argparse.ArgumentParser) -> None:
    """Which instants of a driven analysis."""
    command.add_argument(
        "--at",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="position of a driver or its body (crank=60, in degrees; rates by its law), or t=0.1; "
        "several values with commas, or in equal steps as LOW:HIGH:COUNT (crank=0:360:25)",
    )
    command.add_argument(
        "--over", metavar="WHAT", help="a whole turn: 'turn', or which driver is to make it"
    )
    command.add_argument(
        "--instants", metavar="N", help="how many of a turn, both ends included (361)"
    )
    command.add_argument(
        "--turns", metavar="N", help="how many whole turns (1), 2 of a four-stroke engine"
    )


def add_assembly(command: argparse.ArgumentParser) -> None:
    """Which assembly mode a driven analysis begins in."""
    command.add_argument(
        "--assembly",
        metavar="MODE",
        help="the assembly mode at the first instant, by its name or number in mbody assemblies, "
        "such as open",
    )


def add_json(command: argparse.ArgumentParser) -> None:
    """Data in place of text."""
    command.add_argument("--json", action="store_true", help="print data instead of text")


def add_angle(command: argparse.ArgumentParser) -> None:
    """The unit of angles."""
    command.add_argument(
        "--angle",
        choices=("deg", "rad"),
        help="unit of angles, without it deg in --json and rad in --csv",
    )


def table_place(path: str) -> str:
    """Where a table goes: standard output by any of its names is printed to, once."""
    return "-" if path == "/dev/stdout" else path


def add_output(
    command: argparse.ArgumentParser,
    about: str,
    *,
    required: bool = False,
    kind: Callable[[str], str | None] = str,
) -> None:
    """The file that is written; `about` says which endings there are, or what happens without.
    `kind`: what - is, as `printed` or `model_file`.
    """
    command.add_argument("-o", "--output", metavar="FILE", type=kind, required=required, help=about)


def printed(path: str) -> str | None:
    """A file of text; standard output by any of its names is no file, and the text is printed.

    >>> printed("-"), printed("a.md")
    (None, 'a.md')
    """
    return None if table_place(path) == "-" else path


def model_file(path: str) -> str:
    """A file of a model that is written beside what is printed.

    >>> model_file("design.toml")
    'design.toml'
    """
    if table_place(path) == "-":
        raise argparse.ArgumentTypeError(
            "the model goes to a file, results are printed: give -o a name, such as design.toml"
        )
    return path


def add_picture_file(command: argparse.ArgumentParser, *, required: bool = True) -> None:
    """The file of a picture."""
    add_output(command, "ends in .svg, .png or .pdf", required=required)


def add_paths(command: argparse.ArgumentParser) -> None:
    """Points whose paths are drawn."""
    command.add_argument(
        "--path",
        action="append",
        default=[],
        metavar="POINT",
        help="draw the path of a point, such as coupler.P",
    )


def add_vary(
    command: argparse.ArgumentParser, about: str, form: str = "NAME=LOW:HIGH:COUNT"
) -> None:
    """Numbers that differ between designs."""
    command.add_argument("--vary", action="append", default=[], metavar=form, help=about)


def add_analysis(command: argparse.ArgumentParser) -> None:
    """Which driven analysis."""
    names = "kinetostatics (default), kinematics, statics"
    command.add_argument("--analysis", metavar="NAME", default="kinetostatics", help=names)


def add_resting(command: argparse.ArgumentParser) -> None:
    """What is free at rest."""
    add_model(command)
    command.add_argument(
        "--free", action="append", default=[], metavar="DRIVER", help="a driver to release"
    )
    command.add_argument("--t", metavar="TIME", help="when laws are evaluated, by default 0")


def add_tables(command: argparse.ArgumentParser) -> None:
    """Files of histories."""
    command.add_argument(
        "--csv",
        type=table_place,
        metavar="FILE",
        help="write all histories as a table; - prints it",
    )
    command.add_argument("--npz", metavar="FILE", help="write all histories as NumPy arrays")
