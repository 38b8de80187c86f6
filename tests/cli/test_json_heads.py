"""Every command that takes --json begins its answer alike, and its exit status follows from it."""

import json

import mbody
from mbody import cli
from mbody.cli.parser import verbs
from mbody.solution.doubts import KINDS, succeeded
from tests.support.cases import first_fast

HEAD = ["mbody", "model", "analysis", "units", "status", "doubts", "notes"]
DOUBTFUL = """
[bodies.bar]
mass = 1
[joints]
O = { revolute = ["ground", "bar"] }
[drivers]
motor = { angle = "bar", law = 0.5 }
[loads]
push = { torque = { table = { x = [1, 2], y = [0, 1], outside = "hold" } }, body = "bar" }
"""
OPTIMIZED = """
[optimize.torque]
minimize = "peak(motor.effort)"
by = { "coupler.cg.r" = [2, 12] }
over = "turn"
instants = 37
starts = 1
"""
#: Arguments of every command, and whether its answer is in doubt.
COMMANDS = {
    "kinematics": [("norton_fourbar", False)],
    "kinetostatics": [("norton_fourbar", False), ("doubtful.toml", True)],
    "statics": [("norton_fourbar", False)],
    "simulate": [("simple_pendulum --to 0.1", False)],
    "sweep": [("norton_fourbar --vary crank.weight=1,2 --measure peak(motor.effort)", False)],
    "synthesize": [("pairs.csv", False)],
    "solve": [("vehicle", False)],
    "optimize": [("torque.toml", False)],
    "check": [("norton_fourbar", False)],
    "equilibrium": [("simple_pendulum", False)],
    "modes": [("simple_pendulum", False)],
    "crosscheck": [("norton_fourbar --against pinocchio", False)],
    "models": [("", False)],
    "poles": [("norton_fourbar", False)],
    "transmission": [("norton_fourbar --output rocker", False)],
    "assemblies": [("norton_fourbar", False), ("flyball_governor", True)],
    "doctor": [("", False)],
    "sensitivity": [
        ("norton_fourbar peak(A.force)", False),
        ("toggle_press peak(knee.effort) --over turn", True),
    ],
    "cognates": [("hoekens --point coupler.P", False)],
    "cam": [("cam_follower", False)],
    "bearings": [("norton_fourbar", False)],
    "motor": [("norton_fourbar --speed 0,100 --peak 900,900 --continuous 300,300", False)],
    "flywheel": [("v_twin --coefficient 0.02", False)],
    "internal": [("norton_fourbar --body coupler", False)],
    "shaking": [("v_twin", False)],
    "balance": [("norton_fourbar --on crank=3 --on rocker=5", False)],
    "tolerances": [("norton_fourbar A.force --scatter crank.A.x=0.01 --count 20", False)],
    "fit": [("norton_fourbar run.csv --by crank.A.x --analysis kinematics", False)],
}
RUN = "motor [deg],rocker.angle [deg]\n60,104.41\n70,106.9\n80,109.8\n"


def commands_with_json() -> set[str]:
    return {name for name, verb in verbs().items() if "json" in verb.long_options()}


def test_every_command_is_here():
    assert set(COMMANDS) == commands_with_json()


@first_fast(
    ("command", "arguments", "doubtful"),
    [(name, *case) for name, cases in COMMANDS.items() for case in cases],
    17,
)
def test_heads(command, arguments, doubtful, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "doubtful.toml").write_text(DOUBTFUL, encoding="utf-8")
    described = mbody.to_toml(mbody.gallery.load("norton_fourbar"))
    (tmp_path / "torque.toml").write_text(described + OPTIMIZED, encoding="utf-8")
    (tmp_path / "pairs.csv").write_text("input, output\n40, 70\n60, 78\n90, 95\n")
    (tmp_path / "run.csv").write_text(RUN, encoding="utf-8")
    status = cli.main([command, *arguments.split(), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert list(told)[: len(HEAD)] == HEAD and "mechanism" not in told
    assert told["mbody"] == mbody.__version__
    assert told["model"] is None or isinstance(told["model"], str)
    assert isinstance(told["analysis"], str)
    assert all(isinstance(part, str) for pair in told["units"].items() for part in pair)
    assert all(isinstance(note, str) for note in told["notes"])
    for doubt in told["doubts"]:
        assert list(doubt) == ["kind", "t", "elements", "message"] and doubt["kind"] in KINDS
        assert doubt["message"] in told["notes"]
    assert bool(told["doubts"]) == told["status"].startswith("doubtful: ") == doubtful
    assert status == (0 if succeeded(told["status"]) else 1)
