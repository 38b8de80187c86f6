"""`mbody export --to fmu`: what the units say of themselves, and what FMPy makes of them.

FMPy runs in an environment of its own, without mbody: that of `MBODY_FMPY` (its python), else this
one where it has fmpy.
"""

import importlib.util
import io
import json
import os
import subprocess
import sys
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest

import mbody
from mbody import cli, gallery
from mbody.image import fmu
from mbody.image import fmu as fmu_binaries
from mbody.image.fmu import PLATFORMS, SHELL, SOURCES
from mbody.image.model_image import si_unit
from mbody.laws import Table
from mbody.model.simulation import Measure
from tests.support import embedded
from tests.support.paths import ROOT

LINUX = PLATFORMS[0]
JUDGE = ROOT / "tests" / "support" / "fmpy_judge.py"
FMPY = os.environ.get("MBODY_FMPY") or (sys.executable if importlib.util.find_spec("fmpy") else "")
needs_fmpy = pytest.mark.skipif(not FMPY, reason="fmpy is not installed, see MBODY_FMPY")
#: What the issue wants of positions and rates, as a part of each quantity's greatest value.
NEAR = 1e-8
VERSIONS = pytest.mark.parametrize("version", fmu.VERSIONS)


def cart_pole():
    """A pole on a cart with a force as input, a state of its own, and formulas in its loads."""
    machine = mbody.Mechanism("cart pole", ground={"O": (0.0, 0.0)}, parameters={"k": 5.0})
    machine.add(
        mbody.Body("cart", mass=1.0, inertia=0.1),
        mbody.Body(
            "pole", mass=0.2, cg=(0.0, 0.5), inertia=0.0167, points={"A": (0, 0)}, guess=0.1
        ),
        mbody.Prismatic("rail", "ground.O", "cart"),
        mbody.Revolute("hinge", "cart", "pole.A"),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Input("u", "0 N"),
        mbody.State("integral", rate="pole.angle", start="0.3 rad*s"),
        mbody.Force("push", "cart", "u - 2*cart.vx - 0.1*integral"),
        mbody.TorsionSpring("spring", "pole", "ground", law="k*x + 0.2*pole.omega"),
    )
    machine.simulation = mbody.SimulationSettings(1.0, rtol=1e-9, instants=101)
    return machine


def pump():
    """The mud pump, driven by a torque that follows an input."""
    machine = gallery.load("mud_pump").without("motor")
    law = "u - 20000*(crank.omega - 6.8)"
    machine.add(mbody.Input("u", "500000 lbf*in"), mbody.Torque("drive", "crank", value=law))
    machine.simulation = mbody.SimulationSettings(0.05, {"crank": {"angle": 0.4, "omega": 6.8}})
    return machine


def fast_time():
    """A pendulum in mm, N and ms: times of the unit are in s all the same."""
    machine = mbody.Mechanism("fast", units="mm-N-ms")
    machine.add(
        mbody.Body("bob", mass="1 kg", cg=(100.0, 0.0), inertia="0 kg*m^2"),
        mbody.Revolute("O", "ground", "bob"),
        mbody.Gravity("gravity", y="-9.81 m/s^2"),
    )
    machine.simulation = mbody.SimulationSettings("0.5 s")
    return machine


@pytest.fixture(scope="module")
def binary(tmp_path_factory):
    if embedded.needs_core.args[0]:
        pytest.skip("units run on the native core")
    out = tmp_path_factory.mktemp("binary") / "unit.so"
    return embedded.compiled([SHELL / n for n in SOURCES], out, "-shared", "-fvisibility=hidden")


def files_of(made):
    with zipfile.ZipFile(io.BytesIO(made.content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def checked_by_fmpy(made, folder, **asked):
    """FMPy's answer."""
    unit, request, answer = (folder / name for name in ("it.fmu", "request.json", "answer.json"))
    unit.write_bytes(made.content)
    request.write_text(json.dumps(asked))
    line = [FMPY, str(JUDGE), *map(str, (unit, request, answer))]
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(line, capture_output=True, text=True, env=clean, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(answer.read_text())
    assert found["problems"] == [] and found["python"] == []
    assert found["same"] and 0 < found["state"] < 200_000
    return {name: np.array(column) for name, column in found["columns"].items()}


def unlike(columns, run, names):
    """The greatest part by which a unit and `simulate` differ."""
    worst = 0.0
    for name in names:
        factor = si_unit(run.system.mechanism.units.of("length")).factor
        factor = 1.0 if name.endswith(("angle", "omega", "integral")) else factor
        wanted = run.measure(name) * factor
        worst = max(worst, np.abs(columns[name] - wanted).max() / max(np.abs(wanted).max(), 1e-3))
    return worst


def held(t, u):
    return Table(t, u, interpolation="hold", outside="hold")


# -- judged by FMPy ---------------------------------------------------------------------------


@needs_fmpy
@VERSIONS
def test_a_cart_pole_with_a_force_as_input(binary, tmp_path, version):
    t = np.linspace(0.0, 2.0, 101)
    u = np.sin(5.0 * t) + 0.5 * np.sign(np.sin(11.0 * t))
    run = mbody.simulate(cart_pole(), 2.0, times=t, rtol=1e-12, inputs={"u": held(t, u)})
    names = ["cart.x", "cart.vx", "pole.angle", "pole.omega", "integral"]
    found = checked_by_fmpy(
        fmu.to_fmu(cart_pole(), version, binaries={LINUX: binary}),
        tmp_path,
        stop=2.0,
        step=0.02,
        tolerance=1e-12,
        input={"time": t.tolist(), "u": u.tolist()},
        outputs=names,
        events=version == "3.0",
    )
    assert unlike(found, run, names) < NEAR


@needs_fmpy
@VERSIONS
def test_a_pump_with_its_motor_from_standstill(binary, tmp_path, version):
    """The current is an auxiliary state that the motor brings; the energies are, too."""
    machine, t = gallery.load("mud_pump_motor"), np.linspace(0.0, 15.0, 301)
    run = mbody.simulate(machine, 15.0, times=t, rtol=1e-12)
    names = ["crank.angle", "crank.omega", "rotor.omega", "ram1.x", "ram1.vx"]
    own = ["motor.current", "motor.torque", "motor.rate", "motor.supplied", "motor.lost"]
    made = fmu.to_fmu(machine, version, binaries={LINUX: binary})
    asked = {"stop": 15.0, "step": 0.05, "tolerance": 1e-12, "outputs": [*names, *own]}
    found = checked_by_fmpy(made, tmp_path, **asked)
    assert unlike(found, run, names) < NEAR
    for name in own:
        wanted = run.measure(name)
        assert np.abs(found[name] - wanted).max() < NEAR * np.abs(wanted).max(), name


@needs_fmpy
@VERSIONS
def test_a_state_begins_where_it_is_set_and_parameters_are_taken(binary, tmp_path, version):
    changed = mbody.assemble(cart_pole()).with_values({"integral.start": 2.0, "k": 6.0})
    t = np.linspace(0.0, 1.0, 51)
    run = mbody.simulate(changed, 1.0, times=t, rtol=1e-12)
    names = ["cart.x", "pole.omega", "integral"]
    found = checked_by_fmpy(
        fmu.to_fmu(cart_pole(), version, binaries={LINUX: binary}),
        tmp_path,
        stop=1.0,
        step=0.02,
        tolerance=1e-12,
        start={"integral": 2.0, "k": 6.0},
        outputs=names,
    )
    assert found["integral"][0] == 2.0 and unlike(found, run, names) < NEAR


@needs_fmpy
@VERSIONS
def test_a_pump_with_a_torque_as_input(binary, tmp_path, version):
    """The input is given in N·m, the model has lbf·in; valves open and shut."""
    t = np.linspace(0.0, 0.05, 11)
    u = 500_000.0 + 50_000.0 * np.sign(np.sin(200.0 * t))
    run = mbody.simulate(pump(), 0.05, times=t, rtol=1e-12, inputs={"u": held(t, u)})
    names = ["crank.angle", "crank.omega", "ram1.x", "ram1.vx"]
    torque = (u * si_unit("lbf*in").factor).tolist()
    found = checked_by_fmpy(
        fmu.to_fmu(pump(), version, binaries={LINUX: binary}),
        tmp_path,
        stop=0.05,
        step=0.005,
        tolerance=1e-12,
        input={"time": t.tolist(), "u": torque},
        outputs=names,
    )
    assert unlike(found, run, names) < NEAR


@needs_fmpy
@VERSIONS
def test_times_of_a_unit_are_in_seconds(binary, tmp_path, version):
    t = np.linspace(0.0, 500.0, 51)
    run = mbody.simulate(fast_time(), 500.0, times=t, rtol=1e-12)
    made = fmu.to_fmu(fast_time(), version, binaries={LINUX: binary})
    asked = {"outputs": ["bob.angle", "bob.omega"], "stop": 0.5, "step": 0.01, "tolerance": 1e-12}
    found = checked_by_fmpy(made, tmp_path, **asked)
    assert np.abs(found["bob.angle"] - run["bob"].angle).max() < NEAR
    assert np.abs(found["bob.omega"] - 1e3 * run["bob"].omega).max() < 10.0 * NEAR


# -- what a unit says of itself ----------------------------------------------------------------


def variables(version, text):
    """Attributes of every variable by name, those of its type with them."""
    root = ElementTree.fromstring(text)
    found = {}
    for one in root.find("ModelVariables"):
        more = dict(one.find("Real").attrib) if version == "2.0" else {}
        found[one.get("name")] = dict(one.attrib) | more
    return root, found


@VERSIONS
def test_variables_are_those_of_the_model(version):
    made = fmu.to_fmu(cart_pole(), version, binaries={})
    root, found = variables(version, made.description)
    assert root.get("fmiVersion") == version and root.get("generationTool").startswith("mbody ")
    kinds = {
        "u": ("input", "continuous", "N", "0.0"),
        "k": ("parameter", "tunable", None, "5.0"),
        "pole.mass": ("parameter", "tunable", "kg", "0.2"),
        "pole.inertia": ("parameter", "tunable", "kg.m2", "0.0167"),
        "integral": ("output", "continuous", "s.rad", "0.3"),
        "pole.omega": ("output", "continuous", "rad/s", None),
        "hinge.fx": ("output", "continuous", "N", None),
        "push.force": ("output", "continuous", "N", None),
        "spring.torque": ("output", "continuous", "N.m", None),
        "time": ("independent", "continuous", "s", None),
    }
    keys = "causality", "variability", "unit", "start"
    for name, wanted in kinds.items():
        assert tuple(found[name].get(key) for key in keys) == wanted, name
    assert found["integral"]["initial"] == "exact"
    assert "integral.start" not in found and "u.value" not in found
    assert root.find("CoSimulation").get("modelIdentifier") == "cart_pole"
    derivatives = "providesDirectionalDerivative" + ("" if version == "2.0" else "s")
    assert root.find("CoSimulation").get(derivatives) == "false"
    times = root.find("DefaultExperiment").attrib
    assert [float(times[key]) for key in ("stopTime", "stepSize", "tolerance")] == [1, 0.01, 1e-9]


@VERSIONS
def test_units_are_si_and_shown_in_those_of_the_model(version):
    made = fmu.to_fmu(gallery.load("mud_pump"), version, binaries={})
    root, found = variables(version, made.description)
    shown = {}
    for unit in root.find("UnitDefinitions"):
        for one in unit.findall("DisplayUnit"):
            shown[unit.get("name"), one.get("name")] = float(one.get("factor"))
    assert shown["m", "in"] == pytest.approx(1.0 / 0.0254, rel=1e-14)
    assert float(found["r"]["start"]) == pytest.approx(0.1524, rel=1e-15)
    assert found["r"]["displayUnit"] == "in"
    assert found["motor.effort"]["unit"] == "N.m" and found["p_d"]["unit"] == "Pa"
    assert float(found["p_d"]["start"]) == pytest.approx(150e5, rel=1e-14)
    assert found["flow1"]["unit"] == "m3/s"
    assert all(" " not in one.get("unit", "") for one in found.values())


def test_equal_units_are_equal_bytes_and_carry_no_python(binary):
    one, two = (fmu.to_fmu(cart_pole(), "3.0", binaries={LINUX: binary}) for _ in range(2))
    assert one.content == two.content
    assert set(files_of(one)) == {
        "modelDescription.xml",
        "resources/model.image",
        "documentation/index.html",
        "binaries/x86_64-linux/cart_pole.so",
    }
    assert set(files_of(fmu.to_fmu(cart_pole(), "2.0", binaries={LINUX: binary}))) >= {
        "binaries/linux64/cart_pole.so"
    }


def test_a_parameter_and_a_measure_of_one_name_are_two_variables():
    machine = mbody.Mechanism("rod", parameters={"time": 0.5, "a": 1.0})
    machine.add(mbody.Body("rod", mass="a", cg=("time", 0.0)), mbody.Revolute("O", "ground", "rod"))
    machine.measures["a"] = Measure("rod.angle")
    _, found = variables("3.0", fmu.to_fmu(machine, "3.0", binaries={}).description)
    assert {"a", "a.output", "time", "time.parameter"} <= found.keys()
    assert found["a"]["start"] == "1.0" and found["time"]["causality"] == "independent"


def test_the_command_writes_a_unit(tmp_path, capsys, monkeypatch):
    library = tmp_path / "any.so"
    library.write_bytes(b"a library")
    monkeypatch.setattr(fmu, "fmu_binaries", lambda: {LINUX: library})
    out = tmp_path / "swing.fmu"
    words = ["export", "simple_pendulum", "--to", "fmu", "--fmi", "2.0", "-o", str(out)]
    assert cli.main(words) == 0
    assert "with binaries for x86_64-linux" in capsys.readouterr().err
    with zipfile.ZipFile(out) as archive:
        assert archive.read("binaries/linux64/swing.so") == b"a library"
        assert b'fmiVersion="2.0"' in archive.read("modelDescription.xml")


def test_binaries_of_other_kernels_are_not_taken(tmp_path):
    sources = fmu_binaries.source_hash().encode()
    (tmp_path / LINUX.file).write_bytes(b"of others")
    (tmp_path / PLATFORMS[2].file).write_bytes(b"MZ " + sources)
    assert list(fmu_binaries._binaries_in(tmp_path)) == [PLATFORMS[2]]
