"""The compiled core in a browser: the same answers as natively, from a model's image."""

import base64
import json
import re
from importlib.util import find_spec

import numpy as np
import pytest

import mbody
from mbody.image.arena import MODULE, browser_core
from mbody.image.model_image import to_image
from mbody.kernels import continuation, step_state
from mbody.solution.measures import measured
from tests.support.browser import browser, chromium
from tests.support.paths import ROOT

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="there is no chromium"),
    pytest.mark.skipif(
        find_spec("numba") is None or find_spec("ziglang") is None,
        reason="numba and ziglang build the core for browsers",
    ),
]

#: A page with the core; every model is opened by `open(name)`.
PAGE = """<!doctype html><meta charset="utf-8"><title>waiting</title><script type="module">
import * as mbody from "data:text/javascript;base64,{module}";
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const images = {images};
window.mbody = mbody;
window.bytes = (name) => bytes(images[name]);
const compiled = await WebAssembly.compile(bytes("{core}"));
window.imports = WebAssembly.Module.imports(compiled).length;
window.core = await mbody.Core.load(compiled);
window.open_ = (name) => core.open(bytes(images[name]));
window.text = (numbers) => {{
  const raw = new Uint8Array(numbers.buffer, numbers.byteOffset, numbers.byteLength);
  let found = "";
  for (let n = 0; n < raw.length; n += 8192) {{
    found += String.fromCharCode(...raw.subarray(n, n + 8192));
  }}
  return btoa(found);
}};
window.sentence = (f) => {{
  try {{ f(); return "no error"; }}
  catch (error) {{ return `${{error.name}}: ${{error.message}}`; }}
}};
document.title = "ready";
</script>"""
MODELS = ("norton_fourbar", "mud_pump", "free_fourbar", "planetary_train", "cam_follower")


def base64_of(content):
    return base64.b64encode(content).decode()


def numbers(text):
    return np.frombuffer(base64.b64decode(text))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A browser that shows the page with the core and images of models."""
    images = {name: to_image(mbody.gallery.load(name)).content for name in MODELS}
    text = PAGE.format(
        module=base64_of(MODULE.read_bytes()),
        core=base64_of(browser_core().read_bytes()),
        images=json.dumps({name: base64_of(image) for name, image in images.items()}),
    )
    file = tmp_path_factory.mktemp("browser") / "page.html"
    file.write_text(text)
    with browser() as found:
        found.open(file)
        found.wait("document.title === 'ready'")
        yield found
        assert not found.problems and not found.requests


def run_in(page, name, call):
    """A motion in the browser: times, measured quantities by name, counts."""
    script = f"""(() => {{
      const model = open_("{name}"), motion = model.{call};
      const found = {{ t: text(motion.t), measured: text(motion.measured),
        names: model.measures, stats: motion.stats }};
      model.free();
      return found;
    }})()"""
    found = page.value(script)
    t = numbers(found["t"])
    columns = numbers(found["measured"]).reshape(len(t), -1).T
    return t, dict(zip(found["names"], columns, strict=True)), found["stats"]


def apart(found, run):
    """Greatest difference of any measured quantity, in parts of the greatest of its unit; of
    misfits, which only images measure, in parts of a unit.

    Left out are units in which everything is zero but for rounding, such as torques of joints
    without any: 1e-12 of the greatest number of all.
    """
    named = run.mechanism.measures
    misfits = {name for name in found if name.endswith(".misfit")}
    wanted = {name: measured(run, named.get(name, name)) for name in found.keys() - misfits}
    greatest: dict[str, float] = {}
    for values, _, unit in wanted.values():
        greatest[unit] = max(greatest.get(unit, 0.0), float(np.abs(values).max()))
    nothing = 1e-12 * max(greatest.values())
    off = [
        float(np.abs(found[name] - values).max()) / greatest[unit]
        for name, (values, _, unit) in wanted.items()
        if greatest[unit] > nothing
    ]
    return max(*off, *(float(np.abs(found[name]).max()) for name in misfits))


@pytest.mark.parametrize("name", ["norton_fourbar", "mud_pump", "planetary_train", "cam_follower"])
def test_a_turn_is_that_of_the_native_core(page, name):
    """Rounding of the last digits, as between two processors: 128-bit vectors without FMA."""
    t, found, stats = run_in(page, name, "turn()")
    run = mbody.kinetostatics(mbody.gallery.load(name), turn=True)
    assert len(t) == len(run.t) == stats["steps"] + 1
    assert apart(found, run) < 1e-12


def test_ten_seconds_of_a_free_motion_take_the_same_steps(page):
    """Rounding grows with a free motion, as between two processors: measured 5e-12 of the peaks in
    ten seconds, below 1e-12 in five.
    """
    t, found, stats = run_in(page, "free_fourbar", "run({ until: 10 })")
    run = mbody.simulate(mbody.gallery.load("free_fourbar"), 10.0, times=t)
    for name in ("steps", "rejected", "evaluations"):
        assert stats[name] == run.stats[name]
    assert apart(found, run) < 1e-11
    _, found, _ = run_in(page, "free_fourbar", "run({ until: 5 })")
    run = mbody.simulate(mbody.gallery.load("free_fourbar"), 5.0)
    assert apart(found, run) < 1e-12


def test_numbers_change_and_come_back(page):
    script = """(() => {
      const model = open_("norton_fourbar");
      const before = model.turn();
      const saved = model.save();
      model.set({ "coupler.weight": 2 * model.get("coupler.weight"), "coupler.cg.r": 4.5 });
      const changed = model.turn();
      model.restore(saved);
      const again = model.turn();
      return [text(before.measured), text(changed.measured), text(again.measured), model.measures];
    })()"""
    before, changed, again, names = page.value(script)
    assert before == again != changed
    system = mbody.assemble(mbody.gallery.load("norton_fourbar"))
    heavy = 2.0 * system.values["coupler.weight"]
    other = system.with_values({"coupler.weight": heavy, "coupler.cg.r": 4.5})
    run = mbody.kinetostatics(other, turn=True)
    columns = numbers(changed).reshape(len(run.t), -1).T
    assert apart(dict(zip(names, columns, strict=True)), run) < 1e-12


def test_steps_of_a_dragged_crank_meet_the_turn(page):
    script = """(() => {
      const model = open_("norton_fourbar"), turn = model.turn(), off = [];
      const history = (name) => turn.measure(`motor.${name}`);
      const [value, rate, bend, effort] = ["value", "rate", "acceleration", "effort"].map(history);
      model.close({ drive: { motor: value[0] } });
      for (let k = 30; k <= 360; k += 30) {
        const there = { rate: { motor: rate[k] }, acceleration: { motor: bend[k] } };
        const here = model.step({ motor: value[k] }, there);
        off.push(Math.abs(here.measure("motor.effort")[0] - effort[k]));
      }
      return [Math.max(...off), Math.max(...effort.map(Math.abs))];
    })()"""
    off, greatest = page.value(script)
    assert off < 1e-11 * greatest  # Newton ends within its tolerance on another way


def test_steps_of_a_motion_meet_its_run(page):
    script = """(() => {
      const model = open_("free_fourbar"), run = model.run({ until: 1 });
      model.start({ until: 1 });
      let last;
      for (let k = 1; k <= 100; k++) last = model.advance(0.01 * k);
      return [last.measure("crank.angle")[0], run.measure("crank.angle").at(-1), model.time];
    })()"""
    stepped, whole, t = page.value(script)
    assert t == 1.0
    # the steps are others: the tolerance of the image, 1e-9 by the description's default
    assert abs(stepped - whole) < 1e-7


def test_what_cannot_be_done_is_a_sentence(page):
    name = "open_('norton_fourbar')"
    cases = {
        f"{name}.set({{'coupler.weight': -1}})": "'coupler.weight' cannot be -1",
        f"{name}.set({{'coupler.weight': NaN}})": "'coupler.weight' cannot be NaN",
        f"{name}.set({{'crank.colour': 1}})": "no number or quantity 'crank.colour'",
        f"{name}.close({{ drive: {{ engine: 1 }} }})": "there is no driver 'engine'",
        f"{name}.turn().measure('crank.hue')": "no number or quantity 'crank.hue'",
        "open_('free_fourbar').turn()": "has no turn",
        "open_('free_fourbar').start({ until: -1 })": "give a later end",
        "core.open(bytes('norton_fourbar').subarray(0, 1000))": "it has 1000 of",
        "core.open(new Uint8Array(500))": "no image of mbody",
        "(() => { const b = bytes('norton_fourbar'); b[8] = 7; core.open(b); })()": "format 7",
        "(() => { const b = bytes('norton_fourbar'); b[75] ^= 1; core.open(b); })()": (
            "made for other kernels"
        ),
        f"((m) => {{ m.set({{ 'ground.O4.x': 500 }}); m.turn(); }})({name})": "do not close",
    }
    for call, part in cases.items():
        found = page.value(f"sentence(() => {call})")
        assert found.startswith("MbodyError: ") and part in found, f"{call}: {found}"


def test_a_refused_number_changes_nothing(page):
    script = """(() => {
      const model = open_("norton_fourbar"), before = model.get("coupler.weight");
      sentence(() => model.set({ "rocker.weight": 3, "coupler.weight": -1 }));
      const same = text(model.turn().measured) === text(open_("norton_fourbar").turn().measured);
      return [before, model.get("coupler.weight"), same];
    })()"""
    before, after, same = page.value(script)
    assert before == after and same


def test_the_program_of_the_page_runs(page):
    """docs/browser.md, with files from memory in place of those of a server."""
    text = (ROOT / "docs" / "browser.md").read_text("utf-8")
    (program,) = re.findall(r"```js\n(.*?)```", text, re.S)
    program = program.partition("\n\n")[2].partition("\n\n")[2]  # without loading
    script = f"""(() => {{
      const said = [], console = {{ log: (...words) => said.push(words.join(" ")) }};
      const model = open_("norton_fourbar");
      {program}
      return said;
    }})()"""
    peak, force, time = page.value(script)
    assert re.fullmatch(r"361 instants, peak \d+\.\d{3} lbf·in", peak)
    assert float(force) > 0.0 and float(time) == 1.0


def test_the_module_has_the_numbers_of_the_kernels(page):
    slots, codes, by_driver = page.value("[mbody.SLOTS, mbody.CODES, mbody.BY_DRIVER]")
    for name, value in (*slots.items(), *codes.items()):
        assert getattr(step_state, name) == value, name
    assert by_driver == continuation.BY_DRIVER


def test_the_core_is_small_and_needs_nothing(page):
    import gzip

    content = browser_core().read_bytes()
    assert len(gzip.compress(content, 9)) < 700_000
    assert page.value("imports") == 0
