"""Arguments of the commands for engines and other machines."""

from __future__ import annotations

import argparse

from mbody.cli.common_arguments import add_instants, add_json, add_model

__all__ = ["add_flywheel", "add_shaking"]


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
    add_json(command)
