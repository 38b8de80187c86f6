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
from mbody.files.saved import OWNER, packed, unpacked
from mbody.model.body import Guess
from mbody.model.loads import CustomLoad
from mbody.solution.histories import Record
from tests.errors.command import said
from tests.errors.models import by_rocker, four_bar
from tests.errors.results import batch
from tests.solution.test_law_doubts import ram


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


def on_from_a_stop():
    """The last design of a batch that was stopped in its first, to go on."""

    def interrupt(t):
        if t > 0.5:
            raise KeyboardInterrupt

    designs = assemble(swing()).with_values({"bob.mass": [1.0, 2.0]})
    run = simulate(designs, 500.0, instants=501, progress=interrupt)
    simulate(designs, float(run.design(0).t[-1]) + 0.1, start=run).design(1)


def garbled():
    Path("run.npz").write_text("nothing of use")
    load_run("run.npz")


SCENARIOS = {
    "a method of a simulation that there is not": lambda: SimulationSettings(1.0, method="euler"),
    "a method without its step": go(method="rattle"),
    "a step of nothing": go(method="rattle", step=0.0),
    "a step that is no number": lambda: SimulationSettings(1.0, method="rattle", step="0.1 +"),
    "loads too stiff for explicit steps": go(bushed(), until=10.0),
    "a release that is no table": go(release="motor"),
    "a release of a simulation that is no table": lambda: SimulationSettings(1.0, release="motor"),
    "a release of what is no driver": go(release={"bob": 0.5}),
    "a release in metres": go(four_bar(), release={"motor": "3 m"}),
    "too many bodies for an implicit method": go(beads(), method="radau5"),
    "a batch that is saved": lambda: save_run(batch(), "run.npz"),
    "a saved result that there is not": lambda: load_run("nowhere.npz"),
    "a saved result that is none": lambda: at_home(garbled),
    "a saved result that is a folder": lambda: load_run("."),
    "a saved result that is a number": lambda: load_run(3.5),
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
    "a description of instants and every": lambda: SimulationSettings(1.0, instants=5, every=0.1),
    "more instants than memory holds": crowded,
    "a saved result of another time": saved(format=0),
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
    "no last time": lambda: simulate(swing()),
    "a last time in metres": go(until="3 m"),
    "a last time before the first": go(until=-1.0),
    "an endless motion": go(until=math.inf),
    "a tolerance of nothing": go(rtol=0.0),
    "motions that all fail": lambda: simulate(
        assemble(four_bar(motor=False)).with_values({"coupler.B.x": [9.0, 10.0]}), 1.0
    ),
    "a start that is none": go(start=3),
    "a start in other units": lambda: simulate(
        swing(), 1.0, start=simulate(swing(units="mm-N-s"), 0.1)
    ),
    "a start of a design that was not begun": on_from_a_stop,
    "a start of a batch": lambda: simulate(four_bar(motor=False), 1.0, start=batch()),
    "a start of other bodies": lambda: simulate(swing(), 1.0, start=close_loops(four_bar())),
    "a start that does not fit": lambda: simulate(
        four_bar(motor=False, lengths=(1.0, 0.5, 0.5, 3.5)), 1.0, start=close_loops(four_bar())
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
    "every endless": go(every=math.nan),
    "every some metres": go(every="3 m"),
    "a motion of nothing with mass": go(loose()),
    "a motion of what has no inertia": go(turned()),
    "a motion into a dead centre": lambda: simulate(by_rocker(1.8, 2.0), 5.0),
    "a start that is no table": lambda: SimulationSettings(1.0, 3),
    "a start of a body that is no table": lambda: SimulationSettings(1.0, {"bob": 3.0}),
    "a start of what there is not": lambda: SimulationSettings(1.0, {"bob": {"speed": 3.0}}),
    "a start that other parameters make no number": unfounded,
    "a start of no body": begun(rod={"angle": 0.1}),
    "a start of a body in other units": begun(bob={"angle": "3 kg"}),
    "a rate without a place": begun(bob={"vx": 1.0}),
    "rates that contradict each other": lambda: simulate(contradicting()),
    "a last time of a file": file("[simulate]\nuntil = '3 m'\n"),
    "steps that vanish beyond a stroke": lambda: ram(1.0, 0.8, "1", until=0.4),
}

SENTENCES = r"""
a method of a simulation that there is not | ModelError | - | there is no method 'euler' (there are: dop853, dopri5, radau5, generalized-alpha, rattle, rattle4, moreau)
a method without its step | ModelError | - | the method 'rattle' has steps of one length: give step, in s
a step of nothing | ModelError | - | step is 0 s: give a positive time, for at most 1e+09 steps
a step that is no number | ModelError | - | simulation: step: '0.1 +' ends where a number is expected
loads too stiff for explicit steps | SolveError | - | the loads are too stiff for explicit steps: at t = … s the step has shrunk to 1.7e-06 s, the end would take 6e+06 more; ask for the method 'radau5'
a release that is no table | ModelError | - | release must be a table such as {"motor": 2.0}, not 'motor'
a release of a simulation that is no table | ModelError | - | simulation: release must be a table such as {"motor": 2.0}, not 'motor'
a release of what is no driver | ModelError | - | there is no driver 'bob' to release (there are: none)
a release in metres | ModelError | simulation | 'simulation': release.motor: '3 m' is a length (m), where a time (s) is wanted
too many bodies for an implicit method | ModelError | - | the method 'radau5' takes dense matrices, of at most 300 bodies, not of 301: take dop853, or rattle4 for long runs
a batch that is saved | ModelError | - | a batch of designs cannot be saved: save one, of system.design(n)
a saved result that there is not | ModelError | - | cannot read 'nowhere.npz' (No such file or directory): give a file of save_run
a saved result that is none | ModelError | - | 'run.npz' is no saved result that can be used: it was not written by save_run, or was cut or changed since; save the result anew
a saved result that is a folder | ModelError | - | '.' is no saved result that can be used: it is no ordinary file; save the result anew
a saved result that is a number | ModelError | - | a path must be text or path-like, not 3.5
a saved result of another model | ModelError | - | 'run.npz' is no saved result that can be used: its model is none: 'mechanism' has no bodies: add at least one Body; save the result anew
a saved result of a method that there is not | ModelError | - | 'run.npz' is no saved result that can be used: the state that the motion of 'swing' is to go on from is damaged: there is no method 'euler'; simulate anew, from its beginning; save the result anew
a start at positions that are no numbers | ModelError | - | start has positions or rates at its last instant that are no finite numbers: give a motion that was found
a start without an instant | ModelError | - | start has no instant to begin from: give a motion that has one
a state that is no number | ModelError | - | the state that the motion of 'swing' is to go on from is damaged: 'state' holds what is no finite number; simulate anew, from its beginning
progress that is a number | ModelError | - | progress must be True or a function of the time reached, not 5
a motion without an end at the command | ModelError | - | simulate needs the last time: give --to TIME, or the file a table [simulate] with until = …
steps of a method that has none at the command | ModelError | - | the method 'dop853' chooses its steps by rtol: leave out --step, or take one of generalized-alpha, rattle, rattle4, moreau
a method without its step at the command | ModelError | - | the method 'rattle' has steps of one length: give --step H, in s
a description of instants and every | ModelError | - | simulation: give instants or every, not both
more instants than memory holds | ModelError | - | 1000000000 instants of 'four-bar' take 616 GB, this machine has 16 GB of memory: ask for fewer of them
a saved result of another time | ModelError | - | 'run.npz' is no saved result that can be used: it is of format 0, this version reads 2; save the result anew
loads that jump to and fro | SolveError | - | the loads jump to and fro at t = 0.0608754 s: the last 10000 steps were 5e-09 s each, the end would take 3e+07 more; smooth what jumps, as dry friction and valves do where rates change their sign
a step too long for what moves | SolveError | - | the equations of a step of 'rattle' have no solution at t = 0 s: 8 s is too long there, or the loads jump or grow without bound; take shorter steps, or the method 'dop853'
a motion without any mass | SolveError | - | no body of 'light' has mass, so that no loads set it in motion: give masses, or follow its drivers by kinetostatics
an event of no text | ModelError | - | event: of must be text, not 3
an event that cannot be read | ModelError | - | event 'turn': 'bob.omega +' ends where a number is expected
an event of no direction | ModelError | bob.omega | event 'bob.omega': direction is 2: give 1 (rising), -1 (falling) or 0 (both)
an event that stops perhaps | ModelError | bob.omega | event 'bob.omega': stop must be true or false, not 'maybe'
events that are none | ModelError | - | events takes a list of Event, not 'bob.omega'
an event twice | ModelError | - | 'bob.omega' names two events: give each its own name
an event by the name of a body | ModelError | bob | event 'bob': the name is taken by a Body: choose another
an event of nothing | ModelError | rod.omega | event 'rod.omega': 'rod.omega': there is no body 'rod' (there are: 'ground', 'bob')
no last time | ModelError | - | simulate needs the last time: give until
a last time in metres | ModelError | simulate | 'simulate': until: '3 m' is a length (m), where a time (s) is wanted
a last time before the first | ModelError | - | until is -1 s, the motion begins at 0 s: give a later time
an endless motion | ModelError | simulate | 'simulate': until is inf, it must be finite
a tolerance of nothing | ModelError | - | rtol is 0.0: give a number from 1e-14 to 0.1
motions that all fail | SolveError | A | design 0 of the batch: loops do not close at t = 0 s: the smallest gap is 2.5 m at 'A' (between 'crank' and 'coupler'): check lengths, or give a better guess
a start that is none | ModelError | - | start must be a Solution, not 3
a start in other units | ModelError | - | start is in mm-N-s, 'swing' in SI: ask for both in the same units
a start of a design that was not begun | SolveError | - | the batch was stopped before this design began: analyse it alone
a start of a batch | ModelError | - | start is a batch of designs: give one, of system.design(n)
a start of other bodies | ModelError | - | start has no body 'bob': give a motion of the same bodies
a start that does not fit | SolveError | - | the start does not fit 'four-bar': its loops do not close near it; give a motion of this mechanism, or its own guesses
a load that grows without bound | SolveError | push | the motion ends at t = 1 s: the value of load 'push': '1/(1 - t/(1 s))^2*1 N' has no value at 1: evaluate it elsewhere, or choose a formula that has one there, for example with max or min
a motion that runs away | SolveError | - | the steps vanish at t = 0.0166667 s: the loads jump there, grow without bound, or are too stiff; smooth them, or ask for less accuracy
a start and a guess | ModelError | - | start says positions and rates: leave out guess and rates
instants and every | ModelError | - | give one of instants, every and times
times beyond the end | ModelError | - | times must lie between 0 and 1 s
times that are none | ModelError | - | times must be numbers, in s, not ['soon']
every nothing | ModelError | - | every is 0: give a positive time, for at most 1e7 instants
every endless | ModelError | simulate | 'simulate': every is nan, it must be finite
every some metres | ModelError | simulate | 'simulate': every: '3 m' is a length (m), where a time (s) is wanted
a motion of nothing with mass | SolveError | flag | the motion of 'flag' is not determined: it is free and has no mass; give it mass and inertia, or guide it by a joint
a motion of what has no inertia | SolveError | flag | the motion of 'flag' is not determined: it is free to turn, loads turn it, and it has no inertia; give it one, or hold its angle
a motion into a dead centre | SolveError | motor | the motion cannot go on at t = 0.418116 s: 'motor' leads 'rocker' into a dead centre, where rates and forces at 'O2', 'A', 'O4', 'B' grow without bound; stop it before, or drive another body
a start that is no table | ModelError | - | simulation: start must be a table such as {"crank": {"angle": 0.5}}, not 3
a start of a body that is no table | ModelError | - | simulation: start.bob must be a table of angle, omega, x, vx, y, vy, not 3.0
a start of what there is not | ModelError | - | simulation: start.bob has no 'speed' (it has: angle, omega, x, vx, y, vy)
a start that other parameters make no number | ModelError | - | simulation: start.bob.angle: 'acos(a)' evaluates to nan, it must be finite
a start of no body | ModelError | - | simulation: there is no body 'rod' to start (there are: bob)
a start of a body in other units | ModelError | simulation | 'simulation': start.bob.angle: '3 kg' is a mass (kg), where an angle (rad) is wanted
a rate without a place | ModelError | - | simulation: start.bob has vx without x: say where it begins, or give a guess
rates that contradict each other | SolveError | O2 | the rates of the start do not fit 'O2', 'A', 'B', 'O4': the nearest velocities that fit have crank.omega = 3.38369 rad/s, rocker.omega = 1.00939 rad/s, not 1, 9; give those, or leave out rates that follow from others
a last time of a file | ModelError | - | model: line 6: simulate.until: '3 m' is a length (m), where a time (s) is wanted
steps that vanish beyond a stroke | SolveError | ram | …steps vanish…'ram': it is up to…
"""
