"""The arguments of the command, and the function that each command calls.

Nothing heavy is imported before a command runs, so that help is there at once.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NoReturn

from mbody._version import __version__
from mbody.cli.streams import UsageError
from mbody.cli.synthesize import add_linkages

# -- Arguments that several commands take ------------------------------------------------------

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


def add_statics(command: argparse.ArgumentParser) -> None:
    """Options of analyses at rest: model, released drivers, time."""
    add_model(command)
    command.add_argument(
        "--free", action="append", default=[], metavar="DRIVER", help="a driver to release"
    )
    command.add_argument("--t", metavar="TIME", help="when laws are evaluated, by default 0")


def add_csv(command: argparse.ArgumentParser, table: str) -> None:
    """A table of comma-separated values, marked for spreadsheets."""
    command.add_argument("--csv", type=table_place, metavar="FILE", help=table)
    mark = "mark the file of --csv, so that spreadsheets show its units rightly"
    command.add_argument("--excel", action="store_true", help=mark)


def add_tables(command: argparse.ArgumentParser) -> None:
    """Files of histories."""
    add_csv(command, "write all histories as a table; - prints it")
    command.add_argument("--npz", metavar="FILE", help="write all histories as NumPy arrays")


# -- Arguments of the commands for designers ---------------------------------------------------


def add_sensitivity(command: argparse.ArgumentParser) -> None:
    """Of `mbody sensitivity`."""
    add_model(command)
    what = "a measure or a formula, such as 'peak(A.force)'"
    command.add_argument("measure", metavar="MEASURE", help=what)
    names = "numbers such as crank.A.x, with commas; by default all"
    command.add_argument("--by", action="append", default=[], metavar="NAMES", help=names)
    add_analysis(command)
    add_instants(command)
    add_angle(command)
    add_json(command)


def add_optimize(command: argparse.ArgumentParser) -> None:
    """Of `mbody optimize`."""
    add_model(command)
    command.add_argument("name", metavar="NAME", nargs="?", help="one task; all without it")
    aim = "a quantity, such as 'peak(A.force)', in place of the tasks of the file; twice: a front"
    command.add_argument("--minimize", action="append", default=[], metavar="FORMULA", help=aim)
    command.add_argument(
        "--maximize", action="append", default=[], metavar="FORMULA", help="the same, greatest"
    )
    command.add_argument(
        "--by",
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH",
        help="a number and its bounds, such as b=90:150 or 'crank.A.x=30 mm:50 mm'; again for more",
    )
    command.add_argument(
        "--subject-to",
        action="append",
        default=[],
        metavar="RELATION",
        help="a limit at all instants, such as 'peak(motor.effort) <= 20 N*m'; again for more",
    )
    kinds = "kinetostatics, kinematics, statics or simulate"
    command.add_argument("--analysis", metavar="NAME", help=kinds)
    command.add_argument(
        "--over", metavar="WHAT", help="a whole turn: 'turn', or which driver is to make it"
    )
    command.add_argument("--turns", metavar="N", help="of a cycle of several turns, with --over")
    command.add_argument("--until", metavar="TIME", help="of simulate: the last time")
    command.add_argument("--starts", metavar="N", help="searches (8)")
    command.add_argument("--seed", metavar="N", help="of their starts (0)")
    add_output(command, "write the best model (.toml)", kind=model_file)
    table = "write the numbers as a table; - prints it"
    add_csv(command, table)
    add_json(command)


def add_balance(command: argparse.ArgumentParser) -> None:
    """Of `mbody balance`."""
    add_model(command)
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
    add_instants(command)
    add_output(command, "write the balanced model (.toml)", kind=model_file)
    add_json(command)


def add_tolerances(command: argparse.ArgumentParser) -> None:
    """Of `mbody tolerances`."""
    add_model(command)
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
    add_analysis(command)
    add_instants(command)
    add_angle(command)
    add_json(command)


def add_fit(command: argparse.ArgumentParser) -> None:
    """Of `mbody fit`."""
    add_model(command)
    command.add_argument(
        "data",
        nargs="+",
        metavar="DATA",
        help="CSV files of measured runs, with headings: t or the drivers, then measures or "
        "formulas, with a unit in brackets, as in 'slider.x [mm]'",
    )
    names = "the unknown numbers, such as crank.A.x, with commas; by default those of [fit]"
    command.add_argument("--by", action="append", default=[], metavar="NAMES", help=names)
    shifted = "columns with an unknown constant, as of an encoder, with commas"
    command.add_argument("--offset", action="append", default=[], metavar="NAMES", help=shifted)
    kinds = "kinetostatics, kinematics, statics or simulate; by default as the model is driven"
    command.add_argument("--analysis", metavar="NAME", help=kinds)
    add_json(command)


def add_assemblies(command: argparse.ArgumentParser) -> None:
    """Of `mbody assemblies`."""
    add_model(command)
    command.add_argument(
        "--at",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="position of a driver or its body (crank=60, in degrees), or t=0.1",
    )
    command.add_argument(
        "--driver", metavar="NAME", help="of several, the one whose circuits are followed"
    )
    add_output(command, "draw all of them; ends in .svg, .png or .pdf")
    add_angle(command)
    add_json(command)


def add_transmission(command: argparse.ArgumentParser) -> None:
    """Of `mbody transmission`."""
    add_model(command)
    what = "the output body, or one of its points"
    command.add_argument("--output", metavar="BODY", required=True, help=what)
    command.add_argument("--driver", metavar="NAME", help="of several, the one that drives it")
    through = "of several joints or contacts, the one (or the group) that drives it"
    command.add_argument("--joint", metavar="NAME", help=through)
    add_instants(command)
    add_assembly(command)
    add_angle(command)
    add_json(command)


# -- Arguments of the commands for engines and other machines ----------------------------------


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
    add_csv(command, table)
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


# -- Arguments of the commands that draw and report --------------------------------------------


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
        ("against", "ENGINES", "of the cross-check; by default all that are installed"),
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


# -- The arguments of `mbody synthesize`, `mbody cognates` and `mbody atlas` -------------------


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


EXAMPLES = """\
examples:
  mbody kinetostatics norton_fourbar              all forces of a textbook four-bar
  mbody kinetostatics mine.toml --at crank=60     at one position
  mbody kinetostatics mine.toml --over turn --csv turn.csv
  mbody statics mine.toml --set load=120 --json   as data, for scripts
  mbody simulate mine.toml --to 10 --csv run.csv  free motion over time
  mbody sweep mine.toml --vary load=1:9:50 --measure 'peak(A.force)'
  mbody sensitivity mine.toml 'peak(A.force)' --over turn   which length changes it most
  mbody tolerances mine.toml 'peak(A.force)' --over turn --scatter 'crank.A.x=0.1 mm'
  mbody fit mine.toml run.csv --by crank.A.x,rod.mass   from measured histories
  mbody synthesize path.csv -o design.toml        four-bars whose coupler passes points
  mbody cognates mine.toml --point coupler.P      others with the same coupler curve
  mbody solve mine.toml brake                     the unknowns of its table [solve.brake]
  mbody report mine.toml -o mine.html             the engineer's document
  mbody freebody mine.toml --at crank=60          every link alone, with its forces
  mbody assemblies mine.toml --at crank=60        every way in which it closes
  mbody transmission mine.toml --output rocker    transmission angle, mechanical advantage
  mbody poles mine.toml --at crank=60             instant centres of all pairs of bodies
  mbody balance mine.toml --on 'crank=3 in' -o balanced.toml   counterweights
  mbody shaking mine.toml --turns 2 --shafts 1,2  shaking force by order, balance shafts
  mbody internal mine.toml --body rod --over turn -o rod.svg   bending moment, stress
  mbody flywheel mine.toml --coefficient 0.02     the flywheel for a steady speed
  mbody motor mine.toml --speed '0 rpm,3000 rpm' --peak '6 N*m,5 N*m' --continuous '2 N*m,1.6 N*m'
  mbody bearings mine.toml --rating 'A=12 kN'     equivalent loads and lives
  mbody cam mine.toml --limit 30 --csv contour.csv   pressure angle, undercut, contour
  mbody derive mine.toml --at crank=60            its equations, in symbols and with numbers
  mbody exercise mine.toml --vary a=40:60 --count 30 --seed 7 --key key.md > sheet.md
  mbody crosscheck mine.toml --against pinocchio  a cross-check, by another engine
  mbody draw mine.toml --forces -o mine.svg       a picture with its forces
  mbody plot mine.toml motor.effort -o effort.png over the cycle
  mbody view norton_fourbar --open                a page on which it moves
  mbody animate mine.toml -o mine.gif             a film of it
  mbody explain spring                            the fields of an element, with an example
  mbody import linkage.linkage2 -o mine.toml      from another program's file
  mbody new fourbar --lengths 40,120,80,100       a commented file to begin with
  mbody show norton_fourbar > mine.toml           a file to begin with
"""


class _Parser(argparse.ArgumentParser):
    """Errors are raised, so that they are reported like all others.

    `commands`: Of the whole command, its commands by name.
    """

    commands: Mapping[str, _Parser] = MappingProxyType({})

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """The arguments; of those that a command does not have the sentence names its help, and
        the option that is spelled most like one.
        """
        found, unknown = self.parse_known_args(args, namespace)
        if unknown:
            own = self.commands.get(found.command, self)
            own.error(f"unrecognized arguments: {' '.join(unknown)}{own.suggestion(unknown)}")
        return found

    def suggestion(self, words: Sequence[str]) -> str:
        """The question which option of this command was meant, where one is spelled nearly so."""
        from mbody.core.other_words import meant

        options = re.findall(r"--[a-z-]+", self.format_usage())
        for word in words:
            bare = [one.removeprefix("--") for one in options]
            if similar := meant(word.partition("=")[0].removeprefix("--"), bare, 0.8):
                return f": did you mean --{similar}?"
        return ""

    def error(self, message: str) -> NoReturn:
        """Raise what the arguments lack; of a command that there is not, which one is meant."""
        from mbody.core.other_words import meant

        if wrong := re.match(r"argument command: invalid choice: '(.*?)' \(choose", message):
            close = meant(wrong[1], self.commands)
            hint = f"did you mean {close}?" if close else "mbody --help lists them"
            raise UsageError(f"there is no command '{wrong[1][:60]}': {hint}")
        message = message if len(message) <= 300 else f"{message[:297]}..."
        raise UsageError(f"{message} (see {self.prog} --help)")


def parser() -> argparse.ArgumentParser:
    """The whole command; `answer` of what it parses names the function in `mbody.cli` to call."""
    root = _Parser(
        prog="mbody",
        description="Planar multibody dynamics: motion and every joint force.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    root.add_argument("--version", action="version", version=f"mbody {__version__}")
    commands = root.add_subparsers(dest="command", metavar="command", parser_class=_Parser)
    root.commands = commands.choices

    def command(name: str, text: str, answer: str) -> argparse.ArgumentParser:
        made = commands.add_parser(name, help=text, description=text, allow_abbrev=False)
        made.set_defaults(answer=answer)
        return made

    for name, description in (
        ("kinematics", "positions, velocities and accelerations"),
        ("kinetostatics", "the motion, every joint force and every effort (inverse dynamics)"),
        ("statics", "every joint force and effort at rest"),
    ):
        _analysis(command(name, description, "analyse.analyse"))
    run = command("simulate", "free motion under loads, over time", "analyse.simulate")
    add_model(run)
    run.add_argument("--to", metavar="TIME", help="the last time, such as 10 or '2 min'")
    run.add_argument("--rtol", metavar="R", help="error of a step, as a part (1e-8)")
    run.add_argument(
        "--method",
        metavar="NAME",
        help="dop853 (default), dopri5, radau5 (stiff), generalized-alpha, rattle, rattle4, "
        "moreau (many contacts)",
    )
    run.add_argument("--step", metavar="H", help="length of the steps of methods that have one")
    run.add_argument("--instants", metavar="N", help="how many instants are kept (201)")
    run.add_argument("--every", metavar="DT", help="or how far they are apart")
    run.add_argument(
        "--input",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="history of an input, again for more: '2 N*m', '3 N*m*sin(2 rad/s*t)' or @FILE.csv "
        "with columns t and u",
    )
    run.add_argument("--from", dest="begun", metavar="FILE", help="go on from a saved result")
    run.add_argument("--save", metavar="FILE", help="keep the whole result, to go on from")
    add_angle(run)
    add_json(run)
    add_tables(run)
    _sweep(command("sweep", "one analysis of many designs", "design.sweep"))
    ranked = "which number changes a measured quantity most"
    add_sensitivity(command("sensitivity", ranked, "design.sensitivity"))
    best = "the numbers at which a quantity is least or greatest, within limits"
    add_optimize(command("optimize", best, "design.optimize"))
    spread = "the band of a measured quantity whose numbers scatter"
    add_tolerances(command("tolerances", spread, "design.tolerances"))
    add_fit(command("fit", "numbers of a model from measured histories", "design.fit"))
    found = "mechanisms for a path, a function or poses"
    add_synthesize(command("synthesize", found, "synthesize.synthesize"))
    same = "other four-bars and slider-cranks with the same coupler curve"
    add_cognates(command("cognates", same, "synthesize.cognates"))
    add_atlas(command("atlas", "coupler curves to start a synthesis from", "synthesize.atlas"))
    random = "a data set of random linkages with motion and forces"
    add_linkages(command("linkages", random, "synthesize.linkages"))
    solve = command(
        "solve", "the questions of a model: unknowns that meet conditions", "design.solve"
    )
    add_model(solve)
    solve.add_argument("name", metavar="NAME", nargs="?", help="one question; all without it")
    add_angle(solve)
    add_json(solve)
    check = command(
        "check", "count degrees of freedom, find redundant rows and free motions", "analyse.check"
    )
    add_model(check)
    add_json(check)
    equilibrium = command(
        "equilibrium",
        "rest positions of what is free, and whether they are stable",
        "analyse.equilibrium",
    )
    add_statics(equilibrium)
    add_angle(equilibrium)
    add_json(equilibrium)
    modes = command(
        "modes", "frequencies, damping and shapes of small motions about rest", "analyse.modes"
    )
    add_statics(modes)
    add_json(modes)
    cut_free = "free-body diagrams: every link alone with its forces"
    add_freebody(command("freebody", cut_free, "pictures.freebody"))
    every = "every way in which it closes, circuits and dead centres"
    add_assemblies(command("assemblies", every, "analyse.assemblies"))
    through = "transmission angle, mechanical advantage and velocity ratio over the cycle"
    add_transmission(command("transmission", through, "analyse.transmission"))
    disc = "a cam: pressure angle, curvature, undercut, contour and least base circle"
    add_cam(command("cam", disc, "machines.cam"))
    _poles(command("poles", "instant centres of all pairs of bodies", "pictures.poles"))
    balance = "counterweights and springs that balance"
    add_balance(command("balance", balance, "design.balance"))
    orders = "shaking force and moment by order, and balance shafts"
    add_shaking(command("shaking", orders, "machines.shaking"))
    even = "fluctuation of the energy over a cycle, and the flywheel for it"
    add_flywheel(command("flywheel", even, "machines.flywheel"))
    drive = "a motor and its gear against the torque and speed of a driver"
    add_motor(command("motor", drive, "machines.motor"))
    lasting = "loads of bearings over a cycle, their spectra and lives"
    add_bearings(command("bearings", lasting, "machines.bearings"))
    inside = "axial force, shear force, bending moment and stress along a link"
    add_internal(command("internal", inside, "pictures.internal"))
    derive = command("derive", "the equations in symbols and with numbers", "learn.derive")
    add_model(derive)
    add_instants(derive)
    add_assembly(derive)
    derive.add_argument("--to", metavar="TIME", help="of the free motion at that time")
    derive.add_argument(
        "--form", choices=("text", "markdown", "latex"), default="text", help="how it is written"
    )
    add_output(derive, "by default it is printed", kind=printed)
    add_report(
        command("report", "the engineer's document, for screen and paper", "pictures.report")
    )
    cross = command(
        "crosscheck", "results compared with those of other engines", "analyse.crosscheck"
    )
    add_model(cross)
    cross.add_argument(
        "--against",
        metavar="ENGINES",
        help="which, such as pinocchio,pymunk; by default all that are installed",
    )
    add_json(cross)
    add_draw(command("draw", "a picture of the mechanism at one instant", "pictures.draw"))
    add_plot(command("plot", "diagrams of quantities over the cycle", "pictures.plot"))
    add_view(command("view", "a page on which the mechanism moves", "pictures.view"))
    add_animate(command("animate", "a film of the mechanism in motion", "pictures.animate"))
    _import(command("import", "a model from another program's file", "export.import_file"))
    _export(command("export", "the model for another program", "export.export"))
    add_json(command("models", "the models of the gallery", "analyse.models"))
    show = command("show", "print the file of a model", "analyse.show")
    show.add_argument("model", metavar="MODEL", help=MODEL)
    drawn = command("exercise", "questions with round numbers, and a key", "learn.exercise")
    add_model(drawn)
    add_vary(drawn, "a parameter of the model that differs between exercises", "NAME=LOW:HIGH")
    drawn.add_argument("--count", metavar="N", default="1", help="how many exercises (1)")
    drawn.add_argument("--seed", metavar="S", default="0", help="the same seed, the same sheet (0)")
    drawn.add_argument("--key", metavar="FILE", help="write the worked solutions (Markdown)")
    add_output(drawn, "by default the sheet is printed", kind=printed)
    new = command("new", "a commented model file to begin with", "learn.new")
    new.add_argument(
        "kind",
        metavar="KIND",
        nargs="?",
        help="fourbar, slidercrank, sixbar, gears, cam or pendulum; all kinds without it",
    )
    new.add_argument("--lengths", metavar="LENGTHS", help="all of its lengths, with commas")
    new.add_argument(
        "--units",
        metavar="SYSTEM",
        help="units of plain numbers and of the results: mm-N-s (default), SI, in-lbf-s …",
    )
    add_output(new, "KIND.toml by default; - prints it")
    explain = command("explain", "an element: its fields, units and an example", "learn.explain")
    explain.add_argument(
        "element", metavar="ELEMENT", nargs="?", help="such as spring; all kinds without it"
    )
    command("schema", "print the JSON Schema of model files, for editors", "analyse.schema")
    installed = "what is installed, and where the kernels are kept"
    add_json(command("doctor", installed, "compile.doctor"))
    command("demo", "a textbook four-bar: all forces, and the book's answers beside", "learn.demo")
    libraries = command(
        "compile",
        "the kernels as libraries: for other machines, C programs and co-simulation",
        "compile.compile_libraries",
    )
    libraries.add_argument(
        "--target",
        action="append",
        metavar="NAME",
        help="host (default), x86-64-v2, x86-64-v3, x86-64-v4, aarch64, windows, macos; the first "
        "decides how the kernels are optimised; wasm32: for browsers",
    )
    forms = libraries.add_mutually_exclusive_group()
    forms.add_argument(
        "--images",
        action="store_true",
        help="an object file of the kernels that images call, for C programs to link",
    )
    forms.add_argument(
        "--fmu",
        action="store_true",
        help="the binary of co-simulation units (FMI 2.0 and 3.0), one for all models",
    )
    libraries.add_argument(
        "-o", "--out", default=".", metavar="FOLDER", help="where they go; for wasm32 a file, too"
    )
    command("warmup", "compile all kernels, once on a machine", "compile.warmup")
    return root


def _poles(command: argparse.ArgumentParser) -> None:
    add_model(command)
    add_instants(command)
    add_assembly(command)
    command.add_argument("--to", metavar="TIME", help="of the free motion at that time")
    add_angle(command)
    add_json(command)


def _import(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "file",
        metavar="FILE",
        help="of PMKS (text, .pmks or an address), Linkage (.linkage2), pylinkage (JSON), MuJoCo "
        "(MJCF) or a URDF: recognised by what is in it",
    )
    command.add_argument(
        "--units",
        metavar="SYSTEM",
        help="units of the model, such as SI; numbers of files without units are in these (mm-N-s)",
    )
    add_output(command, "by default it is printed", kind=printed)


def _export(command: argparse.ArgumentParser) -> None:
    add_model(command)
    command.add_argument(
        "--to",
        choices=("mjcf", "dxf", "image", "fmu"),
        required=True,
        help="mjcf: model files of MuJoCo, in SI units; dxf: links and contours of cams, for CAD; "
        "image: bytes on which the compiled core runs without Python; fmu: a unit of "
        "co-simulation, in SI units and rad; builds its binaries where they are missing (once)",
    )
    command.add_argument("--width", metavar="LENGTH", help="of bars in a drawing, such as '20 mm'")
    command.add_argument("--hole", metavar="LENGTH", help="diameter of holes in a drawing")
    command.add_argument("--fmi", choices=("3.0", "2.0"), help="the version of FMI of a unit (3.0)")
    add_output(command, "by default text is printed", kind=printed)
    command.add_argument(
        "--instants", metavar="N", help="how many of a turn (361) and of a free motion in an image"
    )


def _analysis(command: argparse.ArgumentParser) -> None:
    add_model(command)
    add_instants(command)
    add_assembly(command)
    add_angle(command)
    if not command.prog.endswith("kinematics"):
        command.add_argument(
            "--equations",
            action="store_true",
            help="print the system of equations with its numbers",
        )
        command.add_argument(
            "--efficiency",
            metavar="OUTPUT",
            help="work given, useful on that load or driver, and lost in joints",
        )
    add_json(command)
    add_tables(command)


def _sweep(command: argparse.ArgumentParser) -> None:
    add_model(command)
    add_vary(command, "a number that differs between designs, or NAME=1,2,3; several make a grid")
    command.add_argument(
        "--measure",
        action="append",
        default=[],
        metavar="FORMULA",
        help="what is measured of each, such as 'peak(A.force)'; by default the model's measures",
    )
    add_analysis(command)
    add_instants(command)
    command.add_argument(
        "--to", metavar="FOLDER", help="keep the answers there, to be continued later"
    )
    line = "write a line for each design; - prints it"
    add_csv(command, line)
    add_angle(command)
    add_json(command)
