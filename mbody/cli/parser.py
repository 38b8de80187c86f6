"""The arguments of the command, and the function that each command calls.

Nothing heavy is imported before a command runs, so that help is there at once.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NoReturn

from mbody._version import __version__
from mbody.cli.common_arguments import (
    MODEL,
    add_analysis,
    add_angle,
    add_assembly,
    add_instants,
    add_json,
    add_model,
    add_output,
    add_resting,
    add_tables,
    add_vary,
    printed,
    table_place,
)
from mbody.cli.design_arguments import (
    add_assemblies,
    add_balance,
    add_fit,
    add_optimize,
    add_sensitivity,
    add_tolerances,
    add_transmission,
)
from mbody.cli.linkages import add_linkages
from mbody.cli.machine_arguments import (
    add_bearings,
    add_cam,
    add_flywheel,
    add_internal,
    add_motor,
    add_shaking,
)
from mbody.cli.picture_arguments import (
    add_animate,
    add_draw,
    add_freebody,
    add_plot,
    add_report,
    add_view,
)
from mbody.cli.synthesis_arguments import add_atlas, add_cognates, add_synthesize
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
  mbody crosscheck mine.toml --against pinocchio  a second opinion, by another engine
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

    Attributes
    ----------
    commands : mapping of str to _Parser
        Of the whole command, its commands by name.
    """

    commands: Mapping[str, _Parser] = MappingProxyType({})

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """The arguments; of those that a command does not have the sentence names its help, and
        the option that is spelled most like one.
        """
        found, rest = self.parse_known_args(args, namespace)
        if rest:
            own = self.commands.get(found.command, self)
            own.error(f"unrecognized arguments: {' '.join(rest)}{own.meant(rest)}")
        return found

    def meant(self, words: Sequence[str]) -> str:
        """The question which option of this command was meant, where one is spelled nearly so."""
        import difflib

        options = re.findall(r"--[a-z-]+", self.format_usage())
        for word in words:
            if near := difflib.get_close_matches(word.partition("=")[0], options, 1, 0.85):
                return f": did you mean {near[0]}?"
        return ""

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
    run = command("simulate", "free motion under loads, over time", "simulate.simulate")
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
    _sweep(command("sweep", "one analysis of many designs", "sweep.sweep"))
    ranked = "which number changes a measured quantity most"
    add_sensitivity(command("sensitivity", ranked, "sensitivity.sensitivity"))
    best = "the numbers at which a quantity is least or greatest, within limits"
    add_optimize(command("optimize", best, "optimize.optimize"))
    spread = "the band of a measured quantity whose numbers scatter"
    add_tolerances(command("tolerances", spread, "tolerances.tolerances"))
    add_fit(command("fit", "numbers of a model from measured histories", "fit.fit"))
    found = "mechanisms for a path, a function or poses"
    add_synthesize(command("synthesize", found, "synthesize.synthesize"))
    same = "other four-bars and slider-cranks with the same coupler curve"
    add_cognates(command("cognates", same, "cognates.cognates"))
    add_atlas(command("atlas", "coupler curves to start a synthesis from", "atlas.atlas"))
    random = "a data set of random linkages with motion and forces"
    add_linkages(command("linkages", random, "linkages.linkages"))
    solve = command(
        "solve", "the questions of a model: unknowns that meet conditions", "solve.solve"
    )
    add_model(solve)
    solve.add_argument("name", metavar="NAME", nargs="?", help="one question; all without it")
    add_angle(solve)
    add_json(solve)
    check = command(
        "check", "count degrees of freedom, find redundant rows and free motions", "about.check"
    )
    add_model(check)
    add_json(check)
    rest = command(
        "equilibrium",
        "rest positions of what is free, and whether they are stable",
        "about.equilibrium",
    )
    add_resting(rest)
    add_angle(rest)
    add_json(rest)
    modes = command(
        "modes", "frequencies, damping and shapes of small motions about rest", "about.modes"
    )
    add_resting(modes)
    add_json(modes)
    cut_free = "free-body diagrams: every link alone with its forces"
    add_freebody(command("freebody", cut_free, "freebody.freebody"))
    every = "every way in which it closes, circuits and dead centres"
    add_assemblies(command("assemblies", every, "assemblies.assemblies"))
    through = "transmission angle, mechanical advantage and velocity ratio over the cycle"
    add_transmission(command("transmission", through, "transmission.transmission"))
    disc = "a cam: pressure angle, curvature, undercut, contour and least base circle"
    add_cam(command("cam", disc, "cam.cam"))
    _poles(command("poles", "instant centres of all pairs of bodies", "poles.poles"))
    balance = "counterweights and springs that balance"
    add_balance(command("balance", balance, "balance.balance"))
    orders = "shaking force and moment by order, and balance shafts"
    add_shaking(command("shaking", orders, "shaking.shaking"))
    even = "fluctuation of the energy over a cycle, and the flywheel for it"
    add_flywheel(command("flywheel", even, "flywheel.flywheel"))
    drive = "a motor and its gear against the torque and speed of a driver"
    add_motor(command("motor", drive, "motor.motor"))
    lasting = "loads of bearings over a cycle, their spectra and lives"
    add_bearings(command("bearings", lasting, "bearings.bearings"))
    inside = "axial force, shear force, bending moment and stress along a link"
    add_internal(command("internal", inside, "internal.internal"))
    derive = command("derive", "the equations in symbols and with numbers", "derive.derive")
    add_model(derive)
    add_instants(derive)
    add_assembly(derive)
    derive.add_argument("--to", metavar="TIME", help="of the free motion at that time")
    derive.add_argument(
        "--form", choices=("text", "markdown", "latex"), default="text", help="how it is written"
    )
    add_output(derive, "by default it is printed", kind=printed)
    add_report(command("report", "the engineer's document, for screen and paper", "report.report"))
    cross = command(
        "crosscheck",
        "results compared with those of other engines",
        "crosscheck.crosscheck",
    )
    add_model(cross)
    cross.add_argument(
        "--against",
        metavar="ENGINES",
        help="which, such as pinocchio,pymunk; by default all that are installed",
    )
    add_json(cross)
    add_draw(command("draw", "a picture of the mechanism at one instant", "draw.draw"))
    add_plot(command("plot", "diagrams of quantities over the cycle", "draw.plot"))
    add_view(command("view", "a page on which the mechanism moves", "moving.view"))
    add_animate(command("animate", "a film of the mechanism in motion", "moving.animate"))
    _import(command("import", "a model from another program's file", "import_file.import_file"))
    _export(command("export", "the model for another program", "export.export"))
    add_json(command("models", "the models of the gallery", "about.models"))
    show = command("show", "print the file of a model", "about.show")
    show.add_argument("model", metavar="MODEL", help=MODEL)
    drawn = command("exercise", "questions with round numbers, and a key", "exercise.exercise")
    add_model(drawn)
    add_vary(drawn, "a parameter of the model that differs between exercises", "NAME=LOW:HIGH")
    drawn.add_argument("--count", metavar="N", default="1", help="how many exercises (1)")
    drawn.add_argument("--seed", metavar="S", default="0", help="the same seed, the same sheet (0)")
    drawn.add_argument("--key", metavar="FILE", help="write the worked solutions (Markdown)")
    add_output(drawn, "by default the sheet is printed", kind=printed)
    new = command("new", "a commented model file to begin with", "new.new")
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
    explain = command("explain", "an element: its fields, units and an example", "explain.explain")
    explain.add_argument(
        "element", metavar="ELEMENT", nargs="?", help="such as spring; all kinds without it"
    )
    command("schema", "print the JSON Schema of model files, for editors", "about.schema")
    installed = "what is installed, and where the kernels are kept"
    add_json(command("doctor", installed, "doctor.doctor"))
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
    command.add_argument("--csv", type=table_place, metavar="FILE", help=line)
    add_angle(command)
    add_json(command)
