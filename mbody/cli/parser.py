"""The arguments of the command, and the function that each command calls.

Nothing heavy is imported before a command runs, so that help is there at once.
"""

from __future__ import annotations

import argparse
from typing import NoReturn

from mbody._version import __version__
from mbody.cli.design_options import (
    balance_options,
    fit_options,
    optimize_options,
    sensitivity_options,
    tolerances_options,
)
from mbody.cli.options import (
    MODEL,
    angle_option,
    driven_option,
    instants_options,
    json_option,
    model_options,
)
from mbody.cli.synthesis_arguments import atlas_arguments, synthesize_arguments
from mbody.cli.usage import UsageError

__all__ = ["parser"]

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
  mbody solve mine.toml brake                     the unknowns of its table [solve.brake]
  mbody report mine.toml -o mine.html             the engineer's document
  mbody freebody mine.toml --at crank=60          every link alone, with its forces
  mbody assemblies mine.toml --at crank=60        every way in which it closes
  mbody poles mine.toml --at crank=60             instant centres of all pairs of bodies
  mbody balance mine.toml --on 'crank=3 in' -o balanced.toml   counterweights
  mbody crosscheck mine.toml --against pinocchio  a second opinion, by another engine
  mbody draw mine.toml --forces -o mine.svg       a picture with its forces
  mbody plot mine.toml motor.effort -o effort.png over the cycle
  mbody view norton_fourbar --open                a page on which it moves
  mbody animate mine.toml -o mine.gif             a film of it
  mbody show norton_fourbar > mine.toml           a file to begin with
"""


class _Parser(argparse.ArgumentParser):
    """Errors are raised, so that they are reported like all others."""

    def error(self, message: str) -> NoReturn:
        """Raise what the arguments lack."""
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
    run = command("simulate", "free motion under loads, over time", "simulate.simulate")
    model_options(run)
    run.add_argument("--to", metavar="TIME", help="the last time, such as 10 or '2 min'")
    run.add_argument("--rtol", metavar="R", help="error of a step, as a part (1e-8)")
    run.add_argument(
        "--method",
        metavar="NAME",
        help="dop853 (default), dopri5, radau5 (stiff), generalized-alpha, rattle, rattle4",
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
    angle_option(run)
    json_option(run)
    _tables(run)
    _sweep(command("sweep", "one analysis of many designs", "sweep.sweep"))
    ranked = "which number changes a measured quantity most"
    sensitivity_options(command("sensitivity", ranked, "sensitivity.sensitivity"))
    best = "the numbers at which a quantity is least or greatest, within limits"
    optimize_options(command("optimize", best, "optimize.optimize"))
    spread = "the band of a measured quantity whose numbers scatter"
    tolerances_options(command("tolerances", spread, "tolerances.tolerances"))
    fit_options(command("fit", "numbers of a model from measured histories", "fit.fit"))
    synthesize_arguments(
        command("synthesize", "mechanisms for a path, a function or poses", "synthesize.synthesize")
    )
    atlas_arguments(command("atlas", "coupler curves to start a synthesis from", "atlas.atlas"))
    solve = command(
        "solve", "the questions of a model: unknowns that meet conditions", "solve.solve"
    )
    model_options(solve)
    solve.add_argument("name", metavar="NAME", nargs="?", help="one question; all without it")
    angle_option(solve)
    json_option(solve)
    check = command(
        "check", "count degrees of freedom, find redundant rows and free motions", "about.check"
    )
    model_options(check)
    json_option(check)
    rest = command(
        "equilibrium",
        "rest positions of what is free, and whether they are stable",
        "about.equilibrium",
    )
    _resting(rest)
    angle_option(rest)
    json_option(rest)
    modes = command(
        "modes", "frequencies, damping and shapes of small motions about rest", "about.modes"
    )
    _resting(modes)
    json_option(modes)
    cut_free = "free-body diagrams: every link alone with its forces"
    _freebody(command("freebody", cut_free, "freebody.freebody"))
    every = "every way in which it closes, circuits and dead centres"
    _assemblies(command("assemblies", every, "assemblies.assemblies"))
    _poles(command("poles", "instant centres of all pairs of bodies", "poles.poles"))
    balance_options(
        command("balance", "counterweights and springs that balance", "balance.balance")
    )
    _report(command("report", "the engineer's document, for screen and paper", "report.report"))
    cross = command(
        "crosscheck",
        "results compared with those of other engines",
        "crosscheck.crosscheck",
    )
    model_options(cross)
    cross.add_argument(
        "--against",
        metavar="ENGINES",
        help="which, such as pinocchio,pymunk; by default all that are installed",
    )
    json_option(cross)
    _draw(command("draw", "a picture of the mechanism at one instant", "draw.draw"))
    _plot(command("plot", "diagrams of quantities over the cycle", "draw.plot"))
    _view(command("view", "a page on which the mechanism moves", "moving.view"))
    _animate(command("animate", "a film of the mechanism in motion", "moving.animate"))
    _export(command("export", "the model for another program", "export.export"))
    json_option(command("models", "the models of the gallery", "about.models"))
    show = command("show", "print the file of a model", "about.show")
    show.add_argument("model", metavar="MODEL", help=MODEL)
    command("schema", "print the JSON Schema of model files, for editors", "about.schema")
    json_option(
        command("doctor", "what is installed, and where the kernels are kept", "doctor.doctor")
    )
    command("demo", "a textbook four-bar: all forces, and the book's answers beside", "demo.demo")
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
    command("warmup", "compile all kernels, once on a machine", "warmup.warmup")
    return root


def _resting(command: argparse.ArgumentParser) -> None:
    model_options(command)
    command.add_argument(
        "--free", action="append", default=[], metavar="DRIVER", help="a driver to release"
    )
    command.add_argument("--t", metavar="TIME", help="when laws are model_of, by default 0")


def _freebody(command: argparse.ArgumentParser) -> None:
    model_options(command)
    instants_options(command)
    command.add_argument("--to", metavar="TIME", help="of the free motion until that time")
    command.add_argument(
        "--bodies",
        action="append",
        default=[],
        metavar="NAMES",
        help="which links, with commas between them; by default all",
    )
    command.add_argument(
        "-o", "--output", metavar="FILE", help="ends in .svg, .png or .pdf (MODEL.svg)"
    )


def _poles(command: argparse.ArgumentParser) -> None:
    model_options(command)
    instants_options(command)
    command.add_argument("--to", metavar="TIME", help="of the free motion until that time")
    json_option(command)


def _assemblies(command: argparse.ArgumentParser) -> None:
    model_options(command)
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
    command.add_argument(
        "-o", "--output", metavar="FILE", help="draw all of them; ends in .svg, .png or .pdf"
    )
    angle_option(command)
    json_option(command)


def _report(command: argparse.ArgumentParser) -> None:
    model_options(command)
    instants_options(command)
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
    command.add_argument(
        "-o", "--output", metavar="FILE", help="ends in .html, .md, .tex or .pdf (MODEL.html)"
    )


def _output(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "-o", "--output", metavar="FILE", required=True, help="ends in .svg, .png or .pdf"
    )


def _draw(command: argparse.ArgumentParser) -> None:
    model_options(command)
    instants_options(command)
    command.add_argument("--forces", action="store_true", help="draw the joint forces too")
    command.add_argument(
        "--path",
        action="append",
        default=[],
        metavar="POINT",
        help="draw the path of a point, such as coupler.P",
    )
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
    _output(command)


def _moving(command: argparse.ArgumentParser) -> None:
    model_options(command)
    instants_options(command)
    command.add_argument("--to", metavar="TIME", help="the last time, such as 10 or '2 min'")
    command.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH:COUNT",
        help="designs that are shown with one another, or NAME=1,2,3",
    )
    command.add_argument(
        "--show",
        metavar="WHAT",
        help="with commas: names, forces, velocities, accelerations, paths, centres, ghosts",
    )
    command.add_argument(
        "--path",
        action="append",
        default=[],
        metavar="POINT",
        help="show the path of a point, such as coupler.P",
    )


def _view(command: argparse.ArgumentParser) -> None:
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
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="ends in .html (MODEL.html by default), or in .json for the web component",
    )


def _animate(command: argparse.ArgumentParser) -> None:
    _moving(command)
    command.add_argument("--duration", metavar="S", help="seconds of the film")
    command.add_argument("--rate", metavar="N", help="frames a second (25)")
    command.add_argument("--width", metavar="PX", help="pixels (640)")
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="ends in .gif (MODEL.gif by default), .webp, .apng, .svg or .mp4",
    )


def _export(command: argparse.ArgumentParser) -> None:
    model_options(command)
    command.add_argument(
        "--to",
        choices=("mjcf", "image", "fmu"),
        required=True,
        help="mjcf: model files of MuJoCo, in SI units; image: bytes on which the compiled core "
        "runs without Python; fmu: a unit of co-simulation, in SI units and rad; builds its "
        "binaries where they are missing (once)",
    )
    command.add_argument("--fmi", choices=("3.0", "2.0"), help="the version of FMI of a unit (3.0)")
    command.add_argument("-o", "--output", metavar="FILE", help="by default text is printed")
    command.add_argument(
        "--instants", metavar="N", help="how many of a turn (361) and of a free motion in an image"
    )


def _plot(command: argparse.ArgumentParser) -> None:
    model_options(command)
    command.add_argument(
        "quantities",
        nargs="*",
        metavar="QUANTITY",
        help="a measure of the model, or a formula such as motor.effort, B.force, coupler.P.y; "
        "without any, all measures; a unit in brackets behind it, as in 'B.force [kN]'",
    )
    instants_options(command)
    command.add_argument("--to", metavar="TIME", help="the free motion until that time")
    command.add_argument("--x", metavar="QUANTITY", help="what it is plotted over")
    command.add_argument("--log", metavar="AXES", help="logarithmic axes: x, y or xy")
    command.add_argument(
        "--no-modes",
        action="store_true",
        help="without the bars that say what is open, sticks, slides or rolls",
    )
    command.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH:COUNT",
        help="several designs, overlaid; more than six are a band",
    )
    for kind, text in (
        ("polar", "magnitudes of joint forces over the angle of the crank"),
        ("hodograph", "the curves of the tips of joint forces"),
        ("path", "the path of a point, y over x"),
    ):
        names = "POINT" if kind == "path" else "JOINTS"
        command.add_argument(f"--{kind}", action="append", default=[], metavar=names, help=text)
    command.add_argument("--axes", metavar="BODY", help="the link in whose axes a hodograph is")
    _output(command)


def _analysis(command: argparse.ArgumentParser) -> None:
    model_options(command)
    instants_options(command)
    angle_option(command)
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
    json_option(command)
    _tables(command)


def _sweep(command: argparse.ArgumentParser) -> None:
    model_options(command)
    command.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH:COUNT",
        help="a number that differs between designs, or NAME=1,2,3; several make a grid",
    )
    command.add_argument(
        "--measure",
        action="append",
        default=[],
        metavar="FORMULA",
        help="what is measured of each, such as 'peak(A.force)'; by default the model's measures",
    )
    driven_option(command)
    instants_options(command)
    command.add_argument(
        "--to", metavar="FOLDER", help="keep the answers there, to be continued later"
    )
    command.add_argument("--csv", metavar="FILE", help="write a line for each design")
    json_option(command)


def _place(path: str) -> str:
    """Where a table goes: standard output by any of its names is printed to, once."""
    return "-" if path == "/dev/stdout" else path


def _tables(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--csv", type=_place, metavar="FILE", help="write all histories as a table; - prints it"
    )
    command.add_argument("--npz", metavar="FILE", help="write all histories as NumPy arrays")
