"""Motions in which something strikes, sticks or opens: led by C, without Python."""

import json
import math
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Mechanism, Revolute, SimulationSettings, gallery
from mbody.image.arena import MODULE, browser_core
from mbody.image.model_image import to_image
from mbody.kernels.advance import BEGUN, IMPACT
from tests.support import embedded
from tests.support.embedded import ADVANCE, GOOD, Model

pytestmark = embedded.needs_core


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return embedded.door(tmp_path_factory.mktemp("door"))


def without_events(machine):
    """Instants of events change the steps, and images have none."""
    machine.simulation = replace(machine.simulation, events=())
    return machine


def happened(model):
    """Times of impacts, and of changes of modes, that a motion of an image has met."""
    count = int(model.numbers("motion.happened")[0])
    events = np.array(model.numbers("motion.events")[: 3 * count]).reshape(-1, 3)
    return [events[events[:, 1] == code, 0] for code in (IMPACT, BEGUN)]


def present_places(model, coordinates):
    return np.array(model.page(ADVANCE, 0, None)[:coordinates])


@pytest.mark.parametrize(
    ("name", "until", "impacts"),
    [("bouncing_ball", 1.5, 2), ("woodpecker", 0.3, 2), ("braking_vehicle", 1.0, 0)],
)
def test_c_meets_the_events_of_simulate(library, name, until, impacts):
    machine = without_events(gallery.load(name))
    own = mbody.simulate(machine, until, instants=2)
    model = Model(library, to_image(machine).content)
    assert model.start(0.0, until) == GOOD
    assert model.advance(until) == GOOD, model.sentence
    strikes, changes = happened(model)
    expected = [one.t for one in own.events if one.name == "impact"]
    assert len(expected) >= impacts
    # the engine is the same; that of simulate eliminates only rows that are on
    assert strikes == pytest.approx(expected, rel=1e-9)
    assert set(np.round(changes, 6)) >= {round(one.t, 6) for one in own.events if one.t > 0.0}
    n = own.system.coordinates
    size = np.abs(own.record.table(slice(0, n))[-1]).max()
    assert present_places(model, n) == pytest.approx(
        own.record.table(slice(0, n))[-1], abs=1e-8 * size
    )


def hinged(**pin):
    """An arm that falls on a pin with limits, or with clearance."""
    machine = Mechanism("hinged", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("arm", mass=1.0, inertia=0.1, cg=(0.5, 0.0), points={"I": (0.0, 0.0)}),
        Revolute("pin", "ground.O", "arm.I", **pin),
        mbody.Gravity("g", y=-9.81),
    )
    start = {"arm": dict.fromkeys(("x", "y", "angle", "vx", "vy", "omega"), 0.0)}
    machine.simulation = SimulationSettings(0.6, start=start, rtol=1e-9)
    return machine


@pytest.mark.parametrize("pin", [{"limits": (-0.3, 0.3)}, {"clearance": 0.01}])
def test_joints_with_limits_and_play_are_led_by_c(library, pin):
    own = mbody.simulate(hinged(**pin), 0.6, instants=2)
    model = Model(library, to_image(hinged(**pin), analyses=("free",)).content)
    assert model.start(0.0, 0.6) == GOOD and model.advance(0.6) == GOOD, model.sentence
    expected = [one.t for one in own.events if one.name == "impact"]
    assert expected and happened(model)[0] == pytest.approx(expected, rel=1e-9)
    last = own.record.table(slice(0, own.system.coordinates))[-1]
    assert present_places(model, len(last)) == pytest.approx(last, abs=1e-8)


def leg():
    """A five-bar leg above a floor, whose cranks inputs turn."""
    machine = Mechanism(
        "leg", ground={"F": (0.0, -0.33)}, ground_shapes={"floor": {"line": {"point": "F"}}}
    )
    machine.add(mbody.Gravity("g", y=-9.81))
    ends = {"A": (-0.05, 0.0), "B": (0.05, 0.0)}
    machine.add(Body("hip", mass=3.0, inertia=0.05, points=ends))
    for name, guess in {"l1": 225.0, "r1": -45.0, "l2": -54.0, "r2": 234.0}.items():
        mass, inertia, length = (0.4, 0.002, 0.15) if name[1] == "1" else (0.3, 0.004, 0.25)
        own = {"mass": mass, "inertia": inertia, "cg": (0.5 * length, 0.0)}
        points = {"I": (0.0, 0.0), "O": (length, 0.0)}
        machine.add(Body(name, points=points, guess=math.radians(guess), **own))
    upright = [mbody.Marker(body, (0.0, 0.0), 0.5 * math.pi) for body in ("ground", "hip")]
    pins = {"A": ("hip.A", "l1.I"), "B": ("hip.B", "r1.I"), "K": ("l1.O", "l2.I")}
    pins |= {"L": ("r1.O", "r2.I"), "P": ("l2.O", "r2.O")}
    machine.add(mbody.Prismatic("guide", *upright))
    machine.add(*(Revolute(name, *places) for name, places in pins.items()))
    for name, crank in (("u1", "l1"), ("u2", "r1")):
        machine.add(mbody.Input(name, "0 N*m"), mbody.Torque(f"t{name}", crank, "hip", value=name))
    machine.add(Contact("foot", "ground.floor", "l2.O", friction=0.8))
    machine.simulation = SimulationSettings(1.0, rtol=1e-9)
    return machine


def test_a_leg_is_led_by_c_as_by_a_simulator(library):
    """Inputs change each millisecond: it falls, lands and stands on its foot."""
    sim, model = mbody.Simulator(leg()), Model(library, to_image(leg()).content)
    inputs = [model.find_input(name) for name in (b"u1", b"u2")]
    angles = [model.find_measure(name) for name in (b"l1.angle", b"r1.angle")]
    rates = [model.find_measure(name) for name in (b"l1.omega", b"r1.omega")]
    assert model.start(0.0, 1.0) == GOOD
    held = [sim["l1"].angle, sim["r1"].angle]
    for n in range(1, 301):
        for k, (entry, name, crank) in enumerate(
            zip(inputs, ("u1", "u2"), ("l1", "r1"), strict=True)
        ):
            sim.inputs[name] = -80.0 * (sim[crank].angle - held[k]) - 2.0 * sim[crank].omega
            angle, rate = (model.measure(ADVANCE, 0, part[k]) for part in (angles, rates))
            assert model.set_input(entry, -80.0 * (angle - held[k]) - 2.0 * rate) == GOOD
        sim.step(1e-3)
        assert model.advance(1e-3 * n) == GOOD, model.sentence
    assert sim.mode("foot") == "stick"
    strikes, _ = happened(model)
    assert len(strikes) == sum(one.name == "impact" for one in sim.events) > 0
    last = sim.q
    assert present_places(model, len(last)) == pytest.approx(last, abs=1e-7)


OPENED = """
import {{ readFileSync }} from "node:fs";
import * as mbody from "{module}";
const core = await mbody.Core.load(await WebAssembly.compile(readFileSync("{core}")));
const model = core.open(new Uint8Array(readFileSync("{image}")));
"""
SCRIPT = """
model.start({{ t: 0, until: {until} }});
const motion = model.advance({until});
console.log(JSON.stringify({{ q: Array.from(motion.position(0)), events: model.events }}));
"""


def run_in_node(folder, machine, program):
    """What a program prints that leads `model`, the image of a machine."""
    image, script = folder / "image", folder / "lead.mjs"
    image.write_bytes(to_image(machine).content)
    opened = OPENED.format(module=MODULE, core=browser_core(), image=image)
    script.write_text(opened + program, "utf-8")
    done = subprocess.run(["node", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.browser
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
@pytest.mark.parametrize(
    ("name", "until"), [("bouncing_ball", 1.5), ("woodpecker", 0.3), ("braking_vehicle", 1.0)]
)
def test_node_meets_the_events_of_simulate(tmp_path, name, until):
    machine = without_events(gallery.load(name))
    own = mbody.simulate(machine, until, instants=2)
    found = run_in_node(tmp_path, machine, SCRIPT.format(until=until))
    struck = [(one.t, next(iter(one.impulses))) for one in own.events if one.name == "impact"]
    met = [(one["t"], one["contact"]) for one in found["events"] if one["kind"] == "impact"]
    assert [one for _, one in met] == [one for _, one in struck]
    assert [t for t, _ in met] == pytest.approx([t for t, _ in struck], rel=1e-9)
    n = own.system.coordinates
    last = own.record.table(slice(0, n))[-1]
    assert found["q"] == pytest.approx(last, abs=1e-8 * np.abs(last).max())


LED = """
const cranks = {{ u1: "l1", u2: "r1" }};
const start = model.start({{ t: 0, until: 1 }});
let {{ angles, rates }} = {first};
const held = {{ ...angles }};
for (let n = 1; n <= {steps}; n++) {{
  for (const u in cranks) model.set({{ [u]: -80 * (angles[u] - held[u]) - 2 * rates[u] }});
  const motion = model.advance(1e-3 * n);
  for (const u in cranks) {{
    angles[u] = motion.measure(`${{cranks[u]}}.angle`)[0];
    rates[u] = motion.measure(`${{cranks[u]}}.omega`)[0];
  }}
}}
const q = Array.from(model.advance({last}).position(0));
console.log(JSON.stringify({{ q, events: model.events }}));
"""


@pytest.mark.browser
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_a_leg_is_led_by_node_as_by_a_simulator(tmp_path):
    sim = mbody.Simulator(leg())
    cranks = {"u1": "l1", "u2": "r1"}
    held = {u: sim[crank].angle for u, crank in cranks.items()}
    first = {"angles": held, "rates": {u: sim[crank].omega for u, crank in cranks.items()}}
    for _ in range(300):
        for u, crank in cranks.items():
            sim.inputs[u] = -80.0 * (sim[crank].angle - held[u]) - 2.0 * sim[crank].omega
        sim.step(1e-3)
    sim.step(1e-3)
    found = run_in_node(tmp_path, leg(), LED.format(steps=300, last=0.301, first=json.dumps(first)))
    strikes = [one for one in found["events"] if one["kind"] == "impact"]
    assert len(strikes) == sum(one.name == "impact" for one in sim.events) > 0
    assert found["q"] == pytest.approx(sim.q, abs=1e-7)
