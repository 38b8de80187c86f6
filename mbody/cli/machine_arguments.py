"""Arguments of the commands for engines and other machines."""

from __future__ import annotations

import argparse

from mbody.cli.common_arguments import add_angle, add_assembly, add_instants, add_json, add_model

__all__ = ["add_flywheel", "add_internal", "add_shaking"]


def add_shaking(command: argparse.ArgumentParser) -> None:
    """Of `mbody shaking`."""
    add_model(command)
    command.add_argument(
        "--about", metavar="PLACE", default="ground", help="place on the ground of the moment"
    )
    command.add_argument("--driver", metavar="NAME", help="of several, whose orders they are")
    command.add_argument("--orders", metavar="N", default="8", help="the last order (8)")
    command.add_argument(
        "--shafts", metavar="ORDERS", help="balance shafts for these orders, with commas: 1,2"
    )
    add_instants(command)
    add_angle(command)
    add_json(command)


def add_flywheel(command: argparse.ArgumentParser) -> None:
    """Of `mbody flywheel`."""
    add_model(command)
    command.add_argument(
        "--coefficient",
        metavar="C",
        required=True,
        help="fluctuation of the speed, (greatest − least)/mean, such as 0.02",
    )
    command.add_argument("--driver", metavar="NAME", help="of several, the one of the shaft")
    command.add_argument(
        "--simulate", action="store_true", help="prove it by the free motion with that flywheel"
    )
    add_instants(command)
    add_angle(command)
    add_json(command)


def add_internal(command: argparse.ArgumentParser) -> None:
    """Of `mbody internal`."""
    add_model(command)
    command.add_argument("--body", metavar="LINK", required=True, help="the link")
    line = "two of its points, such as A,B; by default those of its section or of its two joints"
    command.add_argument("--along", metavar="A,B", help=line)
    command.add_argument(
        "--lumped", action="store_true", help="take its mass as a lump at its mass centre"
    )
    command.add_argument("--to", metavar="TIME", help="of the free motion until that time")
    command.add_argument(
        "-o", "--output", metavar="FILE", help="draw the diagrams; ends in .svg, .png or .pdf"
    )
    add_instants(command)
    add_assembly(command)
    add_json(command)
