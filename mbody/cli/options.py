"""Options that several commands have."""

from __future__ import annotations

import argparse

__all__ = [
    "MODEL",
    "angle_option",
    "driven_option",
    "instants_options",
    "json_option",
    "model_options",
]

MODEL = "a model file (TOML, or JSON by its ending), or the name of a gallery model"


def model_options(command: argparse.ArgumentParser) -> None:
    """The model, other values of its parameters, units of results."""
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


def json_option(command: argparse.ArgumentParser) -> None:
    """Data in place of text."""
    command.add_argument("--json", action="store_true", help="print data instead of text")


def angle_option(command: argparse.ArgumentParser) -> None:
    """The unit of angles."""
    command.add_argument(
        "--angle",
        choices=("deg", "rad"),
        help="unit of angles, without it deg in --json and rad in --csv",
    )


def instants_options(command: argparse.ArgumentParser) -> None:
    """The instants of a driven analysis."""
    command.add_argument(
        "--at",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="position of a driver or its body (crank=60, in degrees; rates by its law), or t=0.1; "
        "several values with commas",
    )
    command.add_argument(
        "--over", metavar="WHAT", help="a whole turn: 'turn', or which driver is to make it"
    )
    command.add_argument(
        "--instants", metavar="N", help="how many of a turn, both ends included (361)"
    )


def driven_option(command: argparse.ArgumentParser) -> None:
    """Which driven analysis."""
    names = "kinetostatics (default), kinematics, statics"
    command.add_argument("--analysis", metavar="NAME", default="kinetostatics", help=names)
