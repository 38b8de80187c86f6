"""Arguments of the commands for engines and other machines."""

from __future__ import annotations

import argparse

from mbody.cli.common_arguments import (
    add_angle,
    add_assembly,
    add_instants,
    add_json,
    add_model,
    add_output,
    table_place,
)

__all__ = ["add_bearings", "add_cam", "add_flywheel", "add_internal", "add_motor", "add_shaking"]


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
    add_assembly(command)
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
    add_assembly(command)
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
    add_output(command, "draw the diagrams; ends in .svg, .png or .pdf")
    add_instants(command)
    add_assembly(command)
    add_json(command)


def add_cam(command: argparse.ArgumentParser) -> None:
    """Of `mbody cam`."""
    add_model(command)
    command.add_argument("--joint", metavar="NAME", help="of several cams, the joint of one")
    limit = "of the pressure angle, such as 30: the base radius that it needs is found"
    command.add_argument("--limit", metavar="ANGLE", help=limit)
    table = "write contour, pitch curve and radius of curvature as a table; - prints it"
    command.add_argument("--csv", type=table_place, metavar="FILE", help=table)
    command.add_argument("--points", metavar="N", help="how many, both ends included (361)")
    add_instants(command)
    add_assembly(command)
    add_angle(command)
    add_json(command)


def add_motor(command: argparse.ArgumentParser) -> None:
    """Of `mbody motor`."""
    add_model(command)
    command.add_argument(
        "--speed", metavar="SPEEDS", required=True, help="of its curve, such as '0 rpm,3000 rpm'"
    )
    peak = "greatest torques at these speeds, such as '6 N*m,5 N*m'"
    command.add_argument("--peak", metavar="TORQUES", required=True, help=peak)
    lasting = "torques that may last, at the same speeds"
    command.add_argument("--continuous", metavar="TORQUES", required=True, help=lasting)
    command.add_argument("--inertia", metavar="J", default="0", help="of its rotor (0)")
    command.add_argument("--driver", metavar="NAME", help="of several, the one that it drives")
    ratio = "speed of the motor by that of the driver; by default that of the least rms torque"
    command.add_argument("--ratio", metavar="I", help=ratio)
    command.add_argument("--efficiency", metavar="E", default="1", help="of the gear (1)")
    command.add_argument("--rest", metavar="TIME", default="0", help="rest after each cycle (0)")
    add_instants(command)
    add_assembly(command)
    add_json(command)


def add_bearings(command: argparse.ArgumentParser) -> None:
    """Of `mbody bearings`."""
    add_model(command)
    names = "revolute joints, with commas; all without it"
    command.add_argument("--joint", action="append", default=[], metavar="NAMES", help=names)
    kind = "ball (default), roller, or the exponent of life itself"
    command.add_argument("--kind", metavar="KIND", default="ball", help=kind)
    command.add_argument(
        "--rating",
        action="append",
        default=[],
        metavar="NAME=C",
        help="basic dynamic load rating of a bearing, such as 'A=12 kN'; again for more",
    )
    classes = "print the load spectra too, in so many classes of force"
    command.add_argument("--spectrum", metavar="N", help=classes)
    command.add_argument("--to", metavar="TIME", help="of the free motion until that time")
    add_instants(command)
    add_assembly(command)
    add_json(command)
