"""The command line."""

from mbody.cli import command

#: Words of the command that it refuses.
WORDS = {
    "arrays that are printed": ["simulate", "free_fourbar", "--npz", "-"],
    "no model": ["kinematics"],
    "an option that is not there": ["kinematics", "hoekens", "--fast"],
    "a model that is not there": ["kinematics", "hoekns"],
    "a model like no other": ["kinematics", "robot"],
    "a file that is not there": ["kinematics", "none.toml"],
    "a folder": ["kinematics", "."],
    "no value": ["kinematics", "hoekens", "--at", "crank"],
    "a value that is a name": ["kinematics", "hoekens", "--at", "crank=fast"],
    "a value that is no formula": ["kinematics", "hoekens", "--at", "crank=3 +"],
    "a value that is a mass": ["kinematics", "hoekens", "--at", "crank=3 kg"],
    "a driver that is not there": ["kinematics", "hoekens", "--at", "crunk=3"],
    "a value twice": ["kinematics", "hoekens", "--at", "crank=3", "--at", "crank=4"],
    "at and over": ["kinematics", "hoekens", "--at", "t=1", "--over", "turn"],
    "instants of a turn at one position": [
        *("kinematics", "norton_fourbar", "--at", "crank=3", "--instants", "3"),
    ],
    "an option nearly as it is": ["kinematics", "hoekens", "--instant", "12"],
    "one instant": ["kinematics", "hoekens", "--over", "turn", "--instants", "1"],
    "negative instants": ["kinematics", "hoekens", "--over", "turn", "--instants", "-3"],
    "a turn of a body without a motor": ["kinematics", "hoekens", "--over", "rocker"],
    "a parameter that is not there": ["kinematics", "hoekens", "--set", "foo=1"],
    "a parameter that is no formula": ["kinematics", "hoekens", "--set", "a=4 mm +"],
    "a unit system that is not there": ["kinematics", "hoekens", "--units", "parsec"],
    "a file that cannot be written": ["kinematics", "hoekens", "--csv", "/no/where.csv"],
    "a length that is to turn": ["kinematics", "scissor_lift", "--over", "turn"],
    "a turn of nothing that drives": ["kinematics", "simple_pendulum", "--over", "turn"],
    "a limit that is no angle": ["cam", "cam_follower", "--limit", "30 +"],
    "points of no table": ["cam", "cam_follower", "--points", "73"],
    "a balanced model that is printed": ["balance", "slider_crank", "--on", "crank=0.3", "-o", "-"],
    "bearings of what has none": ["bearings", "pile_of_discs"],
    "a gear ratio in words": [
        *("motor", "norton_fourbar", "--speed", "0,100", "--peak", "9,9"),
        *("--continuous", "3,3", "--ratio", "high"),
    ],
    "steps without a count": ["kinematics", "hoekens", "--at", "crank=0:360"],
    "steps of two units": ["kinematics", "hoekens", "--at", "crank=0 deg:1 rad:5"],
    "steps of words": ["kinematics", "hoekens", "--at", "t=now:then:5"],
    "one step": ["kinematics", "hoekens", "--at", "crank=0:360:1"],
    "equations of a turn": ["kinetostatics", "hoekens", "--over", "turn", "--equations"],
}
#: The same of commands that write text alone: they have no --json.
WRITERS = {
    "exercises without what differs": ["exercise", "norton_fourbar"],
    "exercises of a step": ["exercise", "hoekens", "--vary", "a=3"],
    "exercises by a word": ["exercise", "hoekens", "--vary", "a=3:4", "--count", "many"],
    "a new model over a file": ["new", "fourbar", "-o", "/dev/null"],
}


def said(words):
    """What the command does, but for telling its errors."""
    return lambda: command._run(words)


SCENARIOS = {
    "a rest of what is held": said(["equilibrium", "norton_fourbar"]),
    **{name: said(words) for name, words in (WORDS | WRITERS).items()},
    "a contour and its data at one place": said(["cam", "cam_follower", "--json", "--csv", "-"]),
    "two forms at one place": said(["kinematics", "norton_fourbar", "--json", "--csv", "-"]),
}
