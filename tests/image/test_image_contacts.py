"""Motions in which something strikes, sticks or opens: led by C, without Python."""

import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.image.model_image import to_image
from mbody.image.webassembly import MODULE, browser_core
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
    [("bouncing_ball", 1.5, 2), ("braking_vehicle", 1.0, 0)],
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


SCRIPT = """
import {{ readFileSync }} from "node:fs";
import * as mbody from "{module}";
const core = await mbody.Core.load(await WebAssembly.compile(readFileSync("{core}")));
const model = core.open(new Uint8Array(readFileSync("{image}")));
model.start({{ t: 0, until: {until} }});
const motion = model.advance({until});
console.log(JSON.stringify({{ q: Array.from(motion.position(0)), events: model.events }}));
"""


@pytest.mark.browser
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
@pytest.mark.parametrize(("name", "until"), [("bouncing_ball", 1.5), ("braking_vehicle", 1.0)])
def test_node_meets_the_events_of_simulate(tmp_path, name, until):
    machine = without_events(gallery.load(name))
    own = mbody.simulate(machine, until, instants=2)
    image, script = tmp_path / "image", tmp_path / "lead.mjs"
    image.write_bytes(to_image(machine).content)
    script.write_text(
        SCRIPT.format(module=MODULE, core=browser_core(), image=image, until=until), "utf-8"
    )
    done = subprocess.run(["node", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    struck = [(one.t, next(iter(one.impulses))) for one in own.events if one.name == "impact"]
    met = [(one["t"], one["contact"]) for one in found["events"] if one["kind"] == "impact"]
    assert [one for _, one in met] == [one for _, one in struck]
    assert [t for t, _ in met] == pytest.approx([t for t, _ in struck], rel=1e-9)
    n = own.system.coordinates
    last = own.record.table(slice(0, n))[-1]
    assert found["q"] == pytest.approx(last, abs=1e-8 * np.abs(last).max())
