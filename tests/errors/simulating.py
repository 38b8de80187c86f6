"""Free motion over time."""

import contextlib
import json
import math
import tempfile
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np

from mbody import (
    AngleDriver,
    Body,
    Damper,
    Event,
    Force,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Spring,
    Torque,
    assemble,
    from_toml,
    gallery,
    kinematics,
    load_run,
    save_run,
    simulate,
)
from mbody.engineering import close_loops
from mbody.files.arrays import packed, unpacked
from mbody.files.saved import OWNER
from mbody.model.body import Guess
from mbody.model.loads import CustomLoad
from mbody.solution.histories import Record
from tests.errors.command import said
from tests.errors.models import by_rocker, four_bar
from tests.errors.results import batch


def swing(*more, units="SI", **body):
    machine = Mechanism("swing", units=units)
    own = {"mass": 1.0, "inertia": 0.1, "cg": (0.5, 0.0), "guess": 0.2} | body
    machine.add(Body("bob", **own), Revolute("O", "ground", "bob"), Gravity("gravity", y=-9.81))
    machine.add(*more)
    return machine


def loose():
    """A link without mass that nothing holds from turning."""
    return swing(Body("flag"), Revolute("F", "bob", "flag"))


def turned():
    """A flag whose mass is a point, and a torque on it."""
    flag = Body("flag", mass=1.0), Revolute("F", "bob", "flag")
    return swing(*flag, Torque("wind", "flag", value=1.0))


class Driving(CustomLoad):
    """Pushes the faster the faster it goes: for ever faster in a finite time."""

    def physics(self, i, j, p, t):
        """v³ along x on body j."""
        return 0.0, 0.0, 0.0, 30.0 * j[5] ** 3, 0.0, 0.0


class Failing(CustomLoad):
    """Fails after a while."""

    def physics(self, i, j, p, t):
        """Nothing of use."""
        if t > 0.5:
            raise ZeroDivisionError("too late")
        return (0.0,) * 6


def unfounded():
    machine = Mechanism("swing", parameters={"a": 0.5})
    machine.add(Body("bob", mass=1.0, guess=0.2), Revolute("O", "ground", "bob"))
    machine.simulation = SimulationSettings(1.0, {"bob": {"angle": "acos(a)"}})
    simulate(assemble(machine).with_values(a=2.0))


def begun(until=1.0, **start):
    machine = swing()
    machine.simulation = SimulationSettings(until, start)
    return lambda: simulate(machine)


def file(text):
    return lambda: from_toml(
        '[bodies]\nbob = { mass = 1 }\n[joints]\nO = { revolute = ["ground", "bob"] }\n' + text
    )


def go(machine=None, until=1.0, **options):
    return lambda: simulate(machine or swing(), until, **options)


def runaway():
    machine = Mechanism("slide")
    machine.add(Body("block", mass=1.0), Prismatic("guide", "ground", "block"))
    machine.add(Driving("wind", "ground", "block"))
    machine.simulation = SimulationSettings(5.0, {"block": {"x": 0.0, "vx": 1.0}})
    return machine


def contradicting():
    machine = four_bar(motor=False)
    machine.simulation = SimulationSettings(
        1.0, {"crank": {"angle": 1.0, "omega": 1.0}, "rocker": {"omega": 9.0}}
    )
    return machine


def watched(*events, machine=None):
    return lambda: simulate(machine or swing(), 1.0, events=events)


def falling(*more):
    """A ball in the air, at rest 1 m up."""
    machine = Mechanism("ball")
    machine.add(Body("ball", mass=1.0, guess=(0.0, 1.0, 0.0)), Gravity("gravity", y=-9.81), *more)
    return machine


def bushed():
    """A rod on a spring with a damper so stiff that explicit steps would be a millionth of it."""
    machine = Mechanism("bushed")
    machine.add(Body("rod", mass=1.0, inertia=0.1, cg=(0.5, 0.0), guess=Guess(0.0, 0.0, 0.0)))
    far = Marker("ground", (0.0, 1.0))
    machine.add(Spring("bushing", far, "rod", 1e10, free_length=1.0), Damper("d", far, "rod", 1e6))
    machine.add(Gravity("gravity", y=-9.81))
    return machine


def beads():
    """Many bodies, each on its own pin."""
    machine = Mechanism("beads")
    for n in range(301):
        machine.add(Body(f"b{n}", mass=1.0, inertia=1.0), Revolute(f"j{n}", "ground", f"b{n}"))
    return machine


def light():
    """A driven link, neither it nor any other with mass."""
    machine = Mechanism("light")
    machine.add(
        Body("link"), Revolute("O", "ground", "link"), AngleDriver("motor", "link", "1 rad/s*t")
    )
    return machine


def at_home(act):
    """Run in an empty folder, for sentences that name a path."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return act()


def saved(without="", arrays=None, **told):
    """A file of a saved result, some of it changed or left out, and sealed anew."""

    def read():
        save_run(simulate(swing(), 0.1, instants=2), "run.npz")
        parts = unpacked("run.npz", OWNER)
        text = json.loads(parts["header"].tobytes()) | told
        parts["header"] = np.frombuffer(json.dumps(text).encode(), dtype=np.uint8)
        parts.pop(without, None)
        Path("run.npz").write_bytes(packed(parts | (arrays or {}), OWNER))
        load_run("run.npz")

    return lambda: at_home(read)


def unsealed():
    """A file of which one bit was changed."""
    save_run(simulate(swing(), 0.1, instants=2), "run.npz")
    raw = bytearray(Path("run.npz").read_bytes())
    raw[len(raw) // 2] ^= 1
    Path("run.npz").write_bytes(raw)
    load_run("run.npz")


def crowded():
    """Very many instants, on a machine of a known size."""
    with mock.patch("mbody.analysis.driven.time_grid.memory", lambda: 16e9):
        kinematics(four_bar(), turn=True, instants=10**9)


def lost_state():
    """To go on from a state that is no number."""
    run = simulate(swing(), 0.1, instants=2)
    state = np.full_like(run.restart.state, np.nan)
    simulate(swing(), 0.2, start=replace(run, restart=replace(run.restart, state=state)))


def lost_positions():
    """To go on from positions that are no numbers."""
    run = simulate(swing(), 0.1, instants=2)
    block = np.full_like(run.record.blocks[0], np.nan)
    simulate(swing(), 0.2, start=replace(run, record=Record([block], 2, batch=False)))


def garbled():
    Path("run.npz").write_text("nothing of use")
    load_run("run.npz")


SCENARIOS = {
    "a method that there is not": go(method="euler"),
    "a method of a simulation that there is not": lambda: SimulationSettings(1.0, method="euler"),
    "a step for a method that adapts its own": go(method="radau5", step=0.1),
    "a method without its step": go(method="rattle"),
    "a step of nothing": go(method="rattle", step=0.0),
    "a step that is no number": lambda: SimulationSettings(1.0, method="rattle", step="0.1 +"),
    "loads too stiff for explicit steps": go(bushed(), until=10.0),
    "a release that is no table": go(release="motor"),
    "a release of a simulation that is no table": lambda: SimulationSettings(1.0, release="motor"),
    "a release of what is no driver": go(release={"bob": 0.5}),
    "a release of a driver that there is not": go(four_bar(), release={"engine": 0.5}),
    "a release in metres": go(four_bar(), release={"motor": "3 m"}),
    "too many bodies for an implicit method": go(beads(), method="radau5"),
    "a batch that is saved": lambda: save_run(batch(), "run.npz"),
    "a saved result that there is not": lambda: load_run("nowhere.npz"),
    "a saved result that is none": lambda: at_home(garbled),
    "a saved result that was changed": lambda: at_home(unsealed),
    "a saved result that is a folder": lambda: load_run("."),
    "a saved result that is a number": lambda: load_run(3.5),
    "a saved result with a time of its own": saved(arrays={"t": np.array([0.0, math.nan])}),
    "a saved result of another model": saved(model="{}"),
    "a saved result of a method that there is not": saved(way=["euler", 1e-8, 1e-8, 0.0]),
    "a start at positions that are no numbers": lost_positions,
    "a start without an instant": lambda: simulate(
        swing(), 0.2, start=simulate(swing(), 0.1, instants=2).take([])
    ),
    "a state that is no number": lost_state,
    "progress that is a number": lambda: simulate(swing(), 0.1, progress=5),
    "a motion without an end at the command": said(["simulate", "norton_fourbar"]),
    "steps of a method that has none at the command": said(
        ["simulate", "simple_pendulum", "--to", "1", "--step", "0.1"]
    ),
    "a method without its step at the command": said(
        ["simulate", "simple_pendulum", "--to", "1", "--method", "rattle"]
    ),
    "an end before the beginning at the command": said(
        ["simulate", "simple_pendulum", "--to", "-1"]
    ),
    "a description of instants and every": lambda: SimulationSettings(1.0, instants=5, every=0.1),
    "more instants than memory holds": crowded,
    "a saved result of another time": saved(format=0),
    "a saved result of which a part is missing": saved("restart.y"),
    "loads that jump to and fro": lambda: simulate(
        gallery.load("mud_pump"), 0.2, release={"motor": 0.05}
    ),
    "a step too long for what moves": go(until=40.0, method="rattle", step=8.0),
    "a motion without any mass": go(light()),
    "an event of no text": lambda: Event(3),
    "an event that cannot be read": lambda: Event("bob.omega +", name="turn"),
    "an event of no direction": lambda: Event("bob.omega", direction=2),
    "an event that stops perhaps": lambda: Event("bob.omega", stop="maybe"),
    "events that are none": watched("bob.omega"),
    "an event twice": watched(Event("bob.omega"), Event("bob.omega")),
    "an event by the name of a body": watched(Event("bob.omega", name="bob")),
    "an event of nothing": watched(Event("rod.omega")),
    "an event where a load has no value": watched(
        Event("ball.y"),
        machine=falling(Force("push", "ball", "1e-30 N*sqrt((t/(1 s) - 0.4515)^2 - 1e-8)")),
    ),
    "no last time": lambda: simulate(swing()),
    "a last time in metres": go(until="3 m"),
    "a last time before the first": go(until=-1.0),
    "an endless motion": go(until=math.inf),
    "a tolerance of nothing": go(rtol=0.0),
    "a batch of motions": lambda: simulate(
        assemble(swing()).with_values({"bob.mass": [1.0, 2.0]}), 1.0
    ),
    "a start that is none": go(start=3),
    "a start in other units": lambda: simulate(
        swing(), 1.0, start=simulate(swing(units="mm-N-s"), 0.1)
    ),
    "a start of a batch": lambda: simulate(four_bar(motor=False), 1.0, start=batch()),
    "a start of other bodies": lambda: simulate(swing(), 1.0, start=close_loops(four_bar())),
    "a start that does not fit": lambda: simulate(
        four_bar(motor=False, lengths=(1.0, 0.5, 0.5, 3.5)), 1.0, start=close_loops(four_bar())
    ),
    "a start at which a load has no value": lambda: simulate(
        swing(Force("push", "bob", "sqrt(-1 - t/(1 s))*1 N")), 1.0, start=close_loops(swing())
    ),
    "a load that grows without bound": go(
        swing(Force("push", "bob", "1/(1 - t/(1 s))^2*1 N")), until=2.0
    ),
    "a motion that runs away": lambda: simulate(runaway()),
    "a start and a guess": lambda: simulate(
        swing(), 1.0, start=close_loops(swing()), guess={"bob": 0.1}
    ),
    "instants and every": go(instants=3, every=0.1),
    "times beyond the end": go(times=[0.0, 2.0]),
    "times that are none": go(times=["soon"]),
    "every nothing": go(every=0.0),
    "every no number": go(every="now"),
    "every endless": go(every=math.nan),
    "every some metres": go(every="3 m"),
    "one instant": go(instants=1),
    "a motion of nothing with mass": go(loose()),
    "a motion of what has no inertia": go(turned()),
    "a motion into a dead centre": lambda: simulate(by_rocker(1.8, 2.0), 5.0),
    "a load without a value at first": go(swing(Force("push", "bob", "sqrt(-1 - t/(1 s))*1 N"))),
    "a load without a value later": go(swing(Force("push", "bob", "sqrt(0.5 - t/(1 s))*1 N"))),
    "a load that fails": go(swing(Failing("failing", "ground", "bob"))),
    "a start that is no table": lambda: SimulationSettings(1.0, 3),
    "a start of a body that is no table": lambda: SimulationSettings(1.0, {"bob": 3.0}),
    "a start of what there is not": lambda: SimulationSettings(1.0, {"bob": {"speed": 3.0}}),
    "a start that is no number": lambda: SimulationSettings(1.0, {"bob": {"angle": "3 +"}}),
    "a start that other parameters make no number": unfounded,
    "a start of no body": begun(rod={"angle": 0.1}),
    "a start of a body in other units": begun(bob={"angle": "3 kg"}),
    "a rate without a place": begun(bob={"vx": 1.0}),
    "rates that contradict each other": lambda: simulate(contradicting()),
    "a model without a last time": said(["simulate", "norton_fourbar"]),
    "a tolerance that is no number": said(["simulate", "free_fourbar", "--rtol", "fine"]),
    "instants that are none": said(["simulate", "free_fourbar", "--instants", "many"]),
    "a start of a file": file("[simulate]\nuntil = 1\nstart = { rod = { angle = 3 } }\n"),
    "a last time of a file": file("[simulate]\nuntil = '3 m'\n"),
}
