"""The command line."""

from mbody import gallery
from mbody.cli import command

#: Words of the command that it refuses.
WORDS = {
    "arrays that are printed": ["simulate", "free_fourbar", "--npz", "-"],
    "a spreadsheet as CSV": ["statics", "toggle_press", "--csv", "run.xlsx"],
    "a spreadsheet of designs": ["sweep", "toggle_press", "--csv", "run.xlsx"],
    "a table of no known ending": ["statics", "toggle_press", "-o", "run.pdf"],
    "a table twice": ["statics", "toggle_press", "-o", "run.csv", "--csv", "run.csv"],
    "two systems of units": ["statics", "toggle_press", "--units", "SI,mm-N-s"],
    "an option that is not there": ["kinematics", "hoekens", "--fast"],
    "a value twice": ["kinematics", "hoekens", "--at", "crank=3", "--at", "crank=4"],
    "at and over": ["kinematics", "hoekens", "--at", "t=1", "--over", "turn"],
    "one instant": ["kinematics", "hoekens", "--over", "turn", "--instants", "1"],
    "a parameter that is no formula": ["kinematics", "hoekens", "--set", "a=4 mm +"],
    "a unit system that is not there": ["kinematics", "hoekens", "--units", "parsec"],
    "a file that cannot be written": ["kinematics", "hoekens", "--csv", "/no/where.csv"],
    "a length that is to turn": ["kinematics", "scissor_lift", "--over", "turn"],
    "a limit that is no angle": ["cam", "cam_follower", "--limit", "30 +"],
    "points of no table": ["cam", "cam_follower", "--points", "73"],
    "a balanced model that is printed": ["balance", "slider_crank", "--on", "crank=0.3", "-o", "-"],
    "bearings of what has none": ["bearings", "pile_of_discs"],
    "a cost in words": [
        *("tolerances", "hoekens", "P.x", "--scatter", "a=0.1 mm", "--cost", "a=dear")
    ],
    "conditions of nothing": ["solve", "hoekens", "--conditions", "motor.effort = 0"],
    "a question besides that of the file": ["solve", "vehicle", "brake", "--unknowns", "front"],
    "steps of words": ["kinematics", "hoekens", "--at", "t=now:then:5"],
    "equations of a turn": ["kinetostatics", "hoekens", "--over", "turn", "--equations"],
}
WORDS |= {
    "a number of an element that others make": [
        *("kinematics", "bouncing_ball", "--set", "floor.gap.c0=1")
    ]
}
#: The same of commands that write text alone: they have no --json.
WRITERS = {
    "exercises without what differs": ["exercise", "norton_fourbar"],
    "exercises of a step": ["exercise", "hoekens", "--vary", "a=3"],
    "a new model over a file": ["new", "fourbar", "-o", "/dev/null"],
}


def said(words):
    """What the command does, but for telling its errors."""
    return lambda: command._run(words)


SCENARIOS = {
    "a number of an element as a parameter": lambda: gallery.load("hoekens", {"crank.A.x": 1}),
    "a rest of what is held": said(["equilibrium", "norton_fourbar"]),
    **{name: said(words) for name, words in (WORDS | WRITERS).items()},
    "a contour and its data at one place": said(["cam", "cam_follower", "--json", "--csv", "-"]),
    "a mark without a file": said(["kinetostatics", "hoekens", "--csv", "-", "--excel"]),
    "two forms at one place": said(["kinematics", "norton_fourbar", "--json", "--csv", "-"]),
}

SENTENCES = r"""
a number of an element as a parameter | ModelError | crank.A.x | hoekens.toml: there is no parameter 'crank.A.x' (there are: 'a'): numbers of elements are changed by sweep and optimize
a rest of what is held | SolveError | - | nothing is free in 'Four-bar: dynamic force analysis': joints and drivers fix every body; use statics, or release a driver, --free motor
arrays that are printed | UsageError | - | --npz takes a file: it cannot be printed
a spreadsheet as CSV | UsageError | - | --csv writes text, and 'run.xlsx' is a file of a spreadsheet: take --xlsx run.xlsx; with --excel they read CSV too
a spreadsheet of designs | UsageError | - | --csv writes text, and 'run.xlsx' is a file of a spreadsheet: name it .csv; with --excel they read CSV too
a table of no known ending | UsageError | - | -o writes a table by its ending, .xlsx, .csv, .npz, .json or .parquet, which 'run.pdf' has not; pictures are of mbody freebody, report and view
a table twice | UsageError | - | give -o run.csv or --csv, not both
two systems of units | UsageError | - | --units takes one unit system, units of quantities, or both, as in 'SI', 'mass=kg,power=W' or 'SI,power=kW', not 'SI,mm-N-s'
an option that is not there | UsageError | - | kinematics has no option --fast (see mbody kinematics --help)
a value twice | ModelError | crank | --at gives 'crank' twice: give it once
at and over | UsageError | - | give --at or --over, not both
one instant | ModelError | - | --instants must be a whole number from 2 to 1000000, not 1
a parameter that is no formula | ModelError | a | hoekens.toml: parameter 'a': '4 mm +' ends where a number is expected
a unit system that is not there | ModelError | - | there is no unit system 'parsec': choose one of 'SI', 'mm-N-s', 'in-lbf-s', 'ft-lbf-s', or name a length, a force and a time, as in 'cm-kN-s'
a file that cannot be written | ModelError | - | cannot write '/no/where.csv' (No such file or directory): choose a folder that exists and may be written to
a length that is to turn | ModelError | cylinder | driver 'cylinder' drives no angle, it cannot turn: give its lengths with --at cylinder=…, or times with --at t=…
a limit that is no angle | ModelError | - | --limit: '30 +' ends where a number is expected
points of no table | UsageError | - | --points goes with --csv
a balanced model that is printed | UsageError | - | argument -o/--output: the model goes to a file, results are printed: give -o a name, such as design.toml (see mbody balance --help)
bearings of what has none | ModelError | - | 'Pile of discs that friction holds' has no revolute joint: there is no bearing in it
a cost in words | UsageError | - | --cost a takes a number, not 'dear'
conditions of nothing | UsageError | - | choose what is to be found: --unknowns NAMES
a question besides that of the file | UsageError | - | --unknowns makes a question of its own: leave out 'brake'
steps of words | UsageError | - | --at t takes LOW:HIGH:COUNT, two numbers of one unit and a count from 2 to 1000000, as in 0:360:25, or values with commas, not 'now:then:5'
equations of a turn | ModelError | - | --equations shows one instant: choose it with --at
a number of an element that others make | ModelError | floor | 'floor.gap.c0' is made of other numbers of 'floor' here: change these, or give it a parameter
exercises without what differs | UsageError | - | choose what differs between exercises: --vary NAME=LOW:HIGH
exercises of a step | UsageError | - | a: bounds are LOW:HIGH, not '3'
a new model over a file | ModelError | - | '/dev/null' is there already: choose another file with -o
a contour and its data at one place | UsageError | - | --json and --csv - print to the same place: give --csv a file
a mark without a file | UsageError | - | --excel goes with --csv FILE: it marks a file for spreadsheets
two forms at one place | UsageError | - | --json and --csv - print to the same place: give --csv a file
"""
