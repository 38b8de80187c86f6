"""The arguments of the command, and the function that each command calls.

Nothing heavy is imported before a command runs, so that help is there at once.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NoReturn

from mbody._version import __version__
from mbody.cli.streams import UsageError

# -- What - and standard output by its names are, as the file of an option ---------------------


def table_place(path: str) -> str:
    """Where a table goes: standard output by any of its names is printed to, once."""
    return "-" if path == "/dev/stdout" else path


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


#: Kinds of files, as the declarations below name them.
KINDS = {"table": table_place, "text": printed, "model": model_file}

#: The commands: name, function in `mbody.cli` and what it is for; below it its arguments, or @ and
#: the name of arguments that several have. An argument has its names, the name of its value (a
#: switch has none), and maybe {…}, which values there are; ... may be given again; ! must be given;
#: ? or * may be left out; + one or more; =… by default; <…> of `KINDS`; ->… its name in the
#: function; or: not with the one above it. Lines that are indented more go on with the help.
COMMANDS = """\
@model
    model MODEL: a model file (TOML, or JSON by its ending), or the name of a gallery model
    --set NAME=VALUE ...: another value for a parameter of the model, such as --set 'load=12 lbf'
    --units SYSTEM: units of the results: SI, mm-N-s, in-lbf-s, ft-lbf-s, or such as cm-kN-s
@instants
    --at NAME=VALUE ...: position of a driver or its body (crank=60, in degrees; rates by its law),
        or t=0.1; several values with commas, or in equal steps as LOW:HIGH:COUNT
        (crank=0:360:25)
    --over WHAT: a whole turn: 'turn', or which driver is to make it
    --instants N: how many of a turn, both ends included (361)
    --turns N: how many whole turns (1), 2 of a four-stroke engine
@assembly
    --assembly MODE: the assembly mode at the first instant, by its name or number in mbody
        assemblies, such as open
@angle
    --angle {deg,rad}: unit of angles, without it deg in --json and rad in --csv
@json
    --json: print data instead of text
@paths
    --path POINT ...: draw the path of a point, such as coupler.P
@analysis
    --analysis NAME =kinetostatics: kinetostatics (default), kinematics, statics
@excel
    --excel: mark the file of --csv, so that spreadsheets show its units rightly
@tables
    --csv FILE <table>: write all histories as a table; - prints it
    @excel
    --npz FILE: write all histories as NumPy arrays
@driven
    @model @instants @assembly
@moving
    @driven
    --to TIME: the last time, such as 10 or '2 min'
    --vary NAME=LOW:HIGH:COUNT ...: designs that are shown with one another, or NAME=1,2,3
    --show WHAT: with commas: names, forces, velocities, accelerations, paths, centres, ghosts
    @paths
kinematics analyse.analyse: positions, velocities and accelerations
    @driven @angle @json @tables
kinetostatics analyse.analyse: the motion, every joint force and every effort (inverse dynamics)
    @driven @angle
    --equations: print the system of equations with its numbers
    --efficiency OUTPUT: work given, useful on that load or driver, and lost in joints
    @json @tables
statics analyse.analyse: every joint force and effort at rest
    @driven @angle
    --equations: print the system of equations with its numbers
    --efficiency OUTPUT: work given, useful on that load or driver, and lost in joints
    @json @tables
simulate analyse.simulate: free motion under loads, over time
    @model
    --to TIME: the last time, such as 10 or '2 min'
    --rtol R: error of a step, as a part (1e-8)
    --method NAME: dop853 (default), dopri5, radau5 (stiff), generalized-alpha, rattle, rattle4,
        moreau (many contacts)
    --step H: length of the steps of methods that have one
    --instants N: how many instants are kept (201)
    --every DT: or how far they are apart
    --input NAME=VALUE ...: history of an input, again for more: '2 N*m', '3 N*m*sin(2 rad/s*t)' or
        @FILE.csv with columns t and u
    --from FILE ->begun: go on from a saved result
    --save FILE: keep the whole result, to go on from
    @angle @json @tables
sweep design.sweep: one analysis of many designs
    @model
    --vary NAME=LOW:HIGH:COUNT ...: a number that differs between designs, or NAME=1,2,3; several
        make a grid
    --measure FORMULA ...: what is measured of each, such as 'peak(A.force)'; by default the model's
        measures
    @analysis @instants
    --to FOLDER: keep the answers there, to be continued later
    --csv FILE <table>: write a line for each design; - prints it
    @excel @angle @json
sensitivity design.sensitivity: which number changes a measured quantity most
    @model
    measure MEASURE: a measure or a formula, such as 'peak(A.force)'
    --by NAMES ...: numbers such as crank.A.x, with commas; by default all
    @analysis @instants @angle @json
optimize design.optimize: the numbers at which a quantity is least or greatest, within limits
    @model
    name NAME ?: one task; all without it
    --minimize FORMULA ...: a quantity, such as 'peak(A.force)', in place of the tasks of the file;
        twice: a front
    --maximize FORMULA ...: the same, greatest
    --by NAME=LOW:HIGH ...: a number and its bounds, such as b=90:150 or 'crank.A.x=30 mm:50 mm';
        again for more
    --subject-to RELATION ...: a limit at all instants, such as 'peak(motor.effort) <= 20 N*m';
        again for more
    --analysis NAME: kinetostatics, kinematics, statics or simulate
    --over WHAT: a whole turn: 'turn', or which driver is to make it
    --turns N: of a cycle of several turns, with --over
    --until TIME: of simulate: the last time
    --starts N: searches (8)
    --seed N: of their starts (0)
    -o --output FILE <model>: write the best model (.toml)
    --csv FILE <table>: write the numbers as a table; - prints it
    @excel @json
tolerances design.tolerances: the band of a measured quantity whose numbers scatter
    @model
    measure MEASURE: a measure or a formula that is one number, such as 'peak(A.force)'
    --scatter NAME=WIDTH ...: a number and its tolerance ±, three deviations of a normal
        distribution, such as 'crank.A.x=0.1 mm', or 'uniform 0.1 mm', 'triangular 0.1 mm';
        again for more
    --within LOW:HIGH: the band in which it must stay: the loosest tolerances are found
    --count N =10000: random designs (10000)
    --seed N =0: of the random designs (0)
    @analysis @instants @angle @json
fit design.fit: numbers of a model from measured histories
    @model
    data DATA +: CSV files of measured runs, with headings: t or the drivers, then measures or
        formulas, with a unit in brackets, as in 'slider.x [mm]'
    --by NAMES ...: the unknown numbers, such as crank.A.x, with commas; by default those of [fit]
    --offset NAMES ...: columns with an unknown constant, as of an encoder, with commas
    --analysis NAME: kinetostatics, kinematics, statics or simulate; by default as the model is
        driven
    @json
synthesize synthesize.synthesize: mechanisms for a path, a function or poses
    points FILE: a table (CSV) with columns x, y and maybe timing: a path; x, y, angle: poses;
        input, output: a function; numbers may have units, plain angles are in degrees
    --kind KIND: four_bar (default) or slider_crank
    --model MODEL: another mechanism, a model file or a gallery model, whose numbers in --by are
        sought
    --point NAME: of a model: the point of the path, such as coupler.P, or the output of the
        function, such as rocker.angle
    --span LOW:HIGH: of a model: the range of its driver, by default a turn
    --by NAME=LOW:HIGH ...: bounds of a number, such as crank.A.x=10:40, again for more
    --subject-to CONDITION ...: on the motion, such as 'min(coupler.P.y) >= 20 mm', again for more
    --units NAME: the unit system (SI)
    --ground LENGTH: of a four-bar for a function (1)
    --atlas FILE: of a closed path: start from the curves of this atlas
    --full-turn: the crank must turn round
    --defective: keep designs with defects too
    --count N: how many designs at most (5)
    --search N: how many designs are tried for a path
    --seed N: of the random designs (0)
    -o --output FILE <model>: where the designs are written: design.toml, design-2.toml, …
    @json
cognates synthesize.cognates: other four-bars and slider-cranks with the same coupler curve
    @model
    --point NAME !: of the coupler, such as coupler.P
    -o --output FILE <model>: where the cognates are written: cognate.toml, cognate-2.toml
    @json
atlas synthesize.atlas: coupler curves to start a synthesis from
    --to FILE !: where it is written
    --kind KIND =four_bar: four_bar (default) or slider_crank
    --count N: how many curves (4000)
    --seed N: of the random shapes (0)
linkages synthesize.linkages: a data set of random linkages with motion and forces
    --count N: how many linkages (1000)
    --nodes K: joints of each (8)
    --seed S: of the random numbers (0)
    --instants N: positions of each (200)
    --threads N: by default as many as there are cores
    --groups NAMES: of dyads,sliders,triads,assur, by default all
    --turn DEG: turn of the crank [deg] (360)
    --speed RATE: of the crank [rad/s] (1)
    --scheduler ADDRESS: of a Dask cluster, such as tcp://10.0.0.5:8786
    --part K/N: the K-th of N parts, each a process of its own (1/1)
    --to FOLDER !: goes on where one is begun
solve design.solve: the questions of a model: unknowns that meet conditions
    @model
    name NAME ?: one question; all without it
    @angle @json
check analyse.check: count degrees of freedom, find redundant rows and free motions
    @model @json
equilibrium analyse.equilibrium: rest positions of what is free, and whether they are stable
    @model
    --free DRIVER ...: a driver to release
    --t TIME: when laws are evaluated, by default 0
    @angle @json
modes analyse.modes: frequencies, damping and shapes of small motions about rest
    @model
    --free DRIVER ...: a driver to release
    --t TIME: when laws are evaluated, by default 0
    @json
freebody pictures.freebody: free-body diagrams: every link alone with its forces
    @driven
    --to TIME: of the free motion until that time
    --bodies NAMES ...: which links, with commas between them; by default all
    -o --output FILE: ends in .svg, .png or .pdf (MODEL.svg)
assemblies analyse.assemblies: every way in which it closes, circuits and dead centres
    @model
    --at NAME=VALUE ...: position of a driver or its body (crank=60, in degrees), or t=0.1
    --driver NAME: of several, the one whose circuits are followed
    -o --output FILE: draw all of them; ends in .svg, .png or .pdf
    @angle @json
transmission analyse.transmission: transmission angle, mechanical advantage and velocity ratio over
        the cycle
    @model
    --output BODY !: the output body, or one of its points
    --driver NAME: of several, the one that drives it
    --joint NAME: of several joints or contacts, the one (or the group) that drives it
    @instants @assembly @angle @json
cam machines.cam: a cam: pressure angle, curvature, undercut, contour and least base circle
    @model
    --joint NAME: of several cams, the joint of one
    --limit ANGLE: of the pressure angle, such as 30: the base radius that it needs is found
    --csv FILE <table>: write contour, pitch curve and radius of curvature as a table; -
        prints it
    @excel
    --points N: how many, both ends included (361)
    @instants @assembly @angle @json
poles pictures.poles: instant centres of all pairs of bodies
    @driven
    --to TIME: of the free motion at that time
    @angle @json
balance design.balance: counterweights and springs that balance
    @model
    --on LINK=RADIUS ...: a link that gets a counterweight, such as 'crank=3 in', or from a point of
        it, 'rocker.O4=5 in'; again for more
    --springs NAMES ...: springs of the model whose stiffnesses are found, with commas
    @instants
    -o --output FILE <model>: write the balanced model (.toml)
    @json
shaking machines.shaking: shaking force and moment by order, and balance shafts
    @model
    --about PLACE =ground: place on the ground of the moment
    --driver NAME: of several, whose orders they are
    --orders N =8: the last order (8)
    --shafts ORDERS: balance shafts for these orders, with commas: 1,2
    @instants @assembly @angle @json
flywheel machines.flywheel: fluctuation of the energy over a cycle, and the flywheel for it
    @model
    --coefficient C !: fluctuation of the speed, (greatest − least)/mean, such as 0.02
    --driver NAME: of several, the one of the shaft
    --simulate: prove it by the free motion with that flywheel
    @instants @assembly @angle @json
motor machines.motor: a motor and its gear against the torque and speed of a driver
    @model
    --speed SPEEDS !: of its curve, such as '0 rpm,3000 rpm'
    --peak TORQUES !: greatest torques at these speeds, such as '6 N*m,5 N*m'
    --continuous TORQUES !: torques that may last, at the same speeds
    --inertia J =0: of its rotor (0)
    --driver NAME: of several, the one that it drives
    --ratio I: speed of the motor by that of the driver; by default that of the least rms torque
    --efficiency E =1: of the gear (1)
    --rest TIME =0: rest after each cycle (0)
    @instants @assembly @json
bearings machines.bearings: loads of bearings over a cycle, their spectra and lives
    @model
    --joint NAMES ...: revolute joints, with commas; all without it
    --kind KIND =ball: ball (default), roller, or the exponent of life itself
    --rating NAME=C ...: basic dynamic load rating of a bearing, such as 'A=12 kN'; again for more
    --spectrum N: print the load spectra too, in so many classes of force
    --to TIME: of the free motion until that time
    @instants @assembly @json
internal pictures.internal: axial force, shear force, bending moment and stress along a link
    @model
    --body LINK !: the link
    --along A,B: two of its points, such as A,B; by default those of its section or of its two
        joints
    --lumped: take its mass as a lump at its mass centre
    --to TIME: of the free motion until that time
    -o --output FILE: draw the diagrams; ends in .svg, .png or .pdf
    @instants @assembly @json
derive learn.derive: the equations in symbols and with numbers
    @driven
    --to TIME: of the free motion at that time
    --form {text,markdown,latex} =text: how it is written
    -o --output FILE <text>: by default it is printed
report pictures.report: the engineer's document, for screen and paper
    @driven
    --to TIME: of the free motion until that time
    --sections NAMES ...: what it contains, in order, with commas; by default everything
    --without NAMES ...: sections that are left out
    --plot QUANTITY ...: what is plotted; by default efforts, forces and measures
    --polar JOINTS ...: whose forces are drawn as vectors
    --against ENGINES ...: of the cross-check; by default all that are installed
    --compare NAME=VALUE ...: another design, beside this one, as of --set
    --title TEXT: of the document
    --open: open it in the browser
    -o --output FILE: ends in .html, .md, .tex or .pdf (MODEL.html)
crosscheck analyse.crosscheck: results compared with those of other engines
    @model
    --against ENGINES: which, such as pinocchio,pymunk; by default all that are installed
    @json
draw pictures.draw: a picture of the mechanism at one instant
    @driven
    --forces: draw the joint forces too
    @paths
    --to TIME: the free motion until that time
    --positions N: N equal steps of the turn or of the motion
    --strip: several positions beside each other, not overlaid
    --series: a file for each position, at one scale
    --only BODIES ...: draw only these links, with commas between them
    --poles: draw all instant centres, and the lines to find them
    --polygons: the velocity and the acceleration polygon beside
    --centrodes BODIES ...: the fixed and the moving centrode of bodies against the ground
    --inflection BODIES ...: inflection circles of bodies
    --curvature POINT ...: the path of a point and its circle of curvature
    -o --output FILE !: ends in .svg, .png or .pdf
plot pictures.plot: diagrams of quantities over the cycle
    @model
    quantities QUANTITY *: a measure of the model, or a formula such as motor.effort, B.force,
        coupler.P.y; without any, all measures; a unit in brackets behind it, as in 'B.force
        [kN]'
    @instants @assembly
    --to TIME: the free motion until that time
    --x QUANTITY: what it is plotted over
    --log AXES: logarithmic axes: x, y or xy
    --no-modes: without the bars that say what is open, sticks, slides or rolls
    --vary NAME=LOW:HIGH:COUNT ...: several designs, overlaid; more than six are a band
    --polar JOINTS ...: magnitudes of joint forces over the angle of the crank
    --hodograph JOINTS ...: the curves of the tips of joint forces
    --path POINT ...: the path of a point, y over x
    --axes BODY: the link in whose axes a hodograph is
    -o --output FILE !: ends in .svg, .png or .pdf
view pictures.view: a page on which the mechanism moves
    @moving
    --plot QUANTITY ...: a diagram of a measure or a formula, such as B.force; by default the
        measures
    --live: the page solves the model again while one drags and changes it; builds the core for
        browsers where it is missing (once)
    or --recorded: the page plays the recorded motion only
    --open: open the page in the browser
    -o --output FILE: ends in .html (MODEL.html by default), or in .json for the web component
animate pictures.animate: a film of the mechanism in motion
    @moving
    --duration S: seconds of the film
    --rate N: frames a second (25)
    --width PX: pixels (640)
    -o --output FILE: ends in .gif (MODEL.gif by default), .webp, .apng, .svg or .mp4
import export.import_file: a model from another program's file
    file FILE: of PMKS (text, .pmks or an address), Linkage (.linkage2), pylinkage (JSON), MuJoCo
        (MJCF) or a URDF: recognised by what is in it
    --units SYSTEM: units of the model, such as SI; numbers of files without units are in these
        (mm-N-s)
    -o --output FILE <text>: by default it is printed
export export.export: the model for another program
    @model
    --to {mjcf,dxf,image,fmu} !: mjcf: model files of MuJoCo, in SI units; dxf: links and contours
        of cams, for CAD; image: bytes on which the compiled core runs without Python; fmu: a
        unit of co-simulation, in SI units and rad; builds its binaries where they are missing
        (once)
    --width LENGTH: of bars in a drawing, such as '20 mm'
    --hole LENGTH: diameter of holes in a drawing
    --fmi {3.0,2.0}: the version of FMI of a unit (3.0)
    -o --output FILE <text>: by default text is printed
    --instants N: how many of a turn (361) and of a free motion in an image
models analyse.models: the models of the gallery
    @json
show analyse.show: print the file of a model
    model MODEL: a model file (TOML, or JSON by its ending), or the name of a gallery model
exercise learn.exercise: questions with round numbers, and a key
    @model
    --vary NAME=LOW:HIGH ...: a parameter of the model that differs between exercises
    --count N =1: how many exercises (1)
    --seed S =0: the same seed, the same sheet (0)
    --key FILE: write the worked solutions (Markdown)
    -o --output FILE <text>: by default the sheet is printed
new learn.new: a commented model file to begin with
    kind KIND ?: fourbar, slidercrank, sixbar, gears, cam or pendulum; all kinds without it
    --lengths LENGTHS: all of its lengths, with commas
    --units SYSTEM: units of plain numbers and of the results: mm-N-s (default), SI, in-lbf-s …
    -o --output FILE: KIND.toml by default; - prints it
explain learn.explain: an element: its fields, units and an example
    element ELEMENT ?: such as spring; all kinds without it
schema analyse.schema: print the JSON Schema of model files, for editors
doctor compile.doctor: what is installed, and where the kernels are kept
    @json
demo learn.demo: a textbook four-bar: all forces, and the book's answers beside
compile compile.compile_libraries: the kernels as libraries: for other machines, C programs and
        co-simulation
    --target NAME ...: host (default), x86-64-v2, x86-64-v3, x86-64-v4, aarch64, windows, macos; the
        first decides how the kernels are optimised; wasm32: for browsers
    --images: an object file of the kernels that images call, for C programs to link
    or --fmu: the binary of co-simulation units (FMI 2.0 and 3.0), one for all models
    -o --out FOLDER =.: where they go; for wasm32 a file, too
warmup compile.warmup: compile all kernels, once on a machine
"""

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
    shared: dict[str, list[str]] = {}
    for head, arguments in _declared():
        if head.startswith("@"):
            shared[head] = arguments
            continue
        words, _, text = head.partition(": ")
        name, answer = words.split()
        made = commands.add_parser(name, help=text, description=text, allow_abbrev=False)
        made.set_defaults(answer=answer)
        _add(made, arguments, shared)
    return root


def _declared() -> Iterator[tuple[str, list[str]]]:
    """Each head of `COMMANDS` with its arguments."""
    lines = re.sub(r"\n {8}", " ", COMMANDS).splitlines()
    heads = [n for n, line in enumerate(lines) if not line.startswith(" ")]
    for n, end in zip(heads, [*heads[1:], len(lines)], strict=True):
        yield lines[n], [line.strip() for line in lines[n + 1 : end]]


def _add(
    command: argparse.ArgumentParser, arguments: Sequence[str], shared: Mapping[str, list[str]]
) -> None:
    """Add declared arguments to a command."""
    either: Any = command
    for n, line in enumerate(arguments):
        if line.startswith("@"):
            for name in line.split():
                _add(command, shared[name], shared)
            continue
        if not line.startswith("or "):
            excludes = n + 1 < len(arguments) and arguments[n + 1].startswith("or ")
            either = command.add_mutually_exclusive_group() if excludes else command
        names, settings = _argument(line)
        either.add_argument(*names, **settings)


def _argument(line: str) -> tuple[list[str], dict[str, Any]]:
    """Names and settings of an argument, by its declaration."""
    head, _, text = line.removeprefix("or ").partition(": ")
    names: list[str] = []
    settings: dict[str, Any] = {"help": text}
    for word in head.split():
        if word.startswith("->"):
            settings["dest"] = word[2:]
        elif word.startswith("-") or not names:
            names.append(word)
        elif word == "...":
            settings |= {"action": "append", "default": []}
        elif word == "!":
            settings["required"] = True
        elif word in ("?", "*", "+"):
            settings["nargs"] = word
        elif word.startswith("="):
            settings["default"] = word[1:]
        elif word.startswith("<"):
            settings["type"] = KINDS[word[1:-1]]
        elif word.startswith("{"):
            settings["choices"] = tuple(word[1:-1].split(","))
        else:
            settings["metavar"] = word
    if len(settings) == 1 and names[0].startswith("-"):
        settings["action"] = "store_true"
    return names, settings
