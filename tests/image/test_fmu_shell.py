"""The generic binary of co-simulation units: FMI 2.0 and 3.0, called as an importer calls it."""

import ctypes
import io
import itertools
import math
import shutil
import subprocess
import zipfile
from ctypes import CFUNCTYPE, byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import mbody
from mbody import gallery, makers
from mbody.image.fmu import PLATFORMS, SOURCES, to_fmu
from mbody.image.model_image import to_image
from tests.support import embedded
from tests.support.embedded import DOOR, sealed

pytestmark = embedded.needs_core

LINUX = PLATFORMS[0]
OK, WARNING, DISCARD, ERROR = range(4)
LAST_SUCCESSFUL_TIME, TERMINATED = 2, 3
# of the model that is used most, whose units are in, lbf, s
POUND = 4.4482216152605
# steps end at communication points: the tolerance of a step, 1e-8, over some ten steps
OTHER_STEPS = 1e-7

LOGGER = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p, c_char_p)


class Callbacks(ctypes.Structure):
    _fields_ = [(name, c_void_p) for name in ("logger", "allocate", "free", "finished", "data")]


@pytest.fixture(scope="module")
def binary(tmp_path_factory):
    out = tmp_path_factory.mktemp("binary") / "unit.so"
    return embedded.compiled([DOOR / n for n in SOURCES], out, "-shared", "-fvisibility=hidden")


@pytest.fixture(scope="module")
def image():
    return sealed(to_image(gallery.load("free_fourbar")).content)


def entries(image):
    """Value references by name, and which are parameters: all entries of kinds 1 and 3."""
    words = np.frombuffer(image, dtype=np.int64)
    table = words[words[5] : words[5] + 5 * words[6]].reshape(-1, 5).tolist()
    found = {}
    for n, (kind, _, _, name, _) in enumerate(table):
        if kind in (1, 3):
            found[image[name : image.index(b"\0", name)].decode()] = (n, kind == 1)
    return found


def guid(image):
    return f"{{{int(np.frombuffer(image, dtype=np.uint64)[13]):016x}}}"


class Unit:
    """An instance, as an importer of FMI 2.0 has it."""

    def __init__(self, binary, folder, image, guid_=None, kind=1, uri=None):
        self.said = []
        self.library = ctypes.CDLL(str(binary))
        self.references = entries(image)

        def hear(_, name, status, category, text, value):
            self.said.append((status, category.decode(), (value or text).decode()))

        self.logger = LOGGER(hear)
        self.callbacks = Callbacks(logger=ctypes.cast(self.logger, c_void_p))
        resources = folder / "resources of it"
        resources.mkdir(exist_ok=True)
        (resources / "model.image").write_bytes(image)
        self.library.fmi2Instantiate.restype = c_void_p
        self.component = self.library.fmi2Instantiate(
            c_char_p(b"one"),
            kind,
            c_char_p((guid(image) if guid_ is None else guid_).encode()),
            c_char_p((resources.as_uri() if uri is None else uri).encode()),
            byref(self.callbacks),
            0,
            0,
        )

    def call(self, name, *values):
        return getattr(self.library, f"fmi2{name}")(c_void_p(self.component), *values)

    def begin(self, start=0.0, stop=1.0):
        self.call("SetupExperiment", 0, c_double(0), c_double(start), 1, c_double(stop))
        assert self.call("EnterInitializationMode") == OK
        return self.call("ExitInitializationMode")

    def step(self, now, step):
        return self.call("DoStep", c_double(now), c_double(step), 1)

    def get(self, *names):
        which = (c_uint * len(names))(*(self.references[name][0] for name in names))
        values = (c_double * len(names))()
        assert self.call("GetReal", which, c_size_t(len(names)), values) == OK
        return list(values)

    def set(self, **values):
        names = [name.replace("__", ".") for name in values]
        which = (c_uint * len(names))(*(self.references[name][0] for name in names))
        numbers = (c_double * len(names))(*values.values())
        return self.call("SetReal", which, c_size_t(len(names)), numbers)

    @property
    def sentence(self):
        return self.said[-1][2]

    def __del__(self):
        if self.component:
            self.call("FreeInstance")


class Unit3(Unit):
    """An instance, as an importer of FMI 3.0 has it."""

    def __init__(
        self, binary, folder, image, guid_=None, kind="CoSimulation", uri=None, early=False
    ):
        self.said = []
        self.library = ctypes.CDLL(str(binary))
        self.references = entries(image)

        def hear(_, status, category, text):
            self.said.append((status, category.decode(), text.decode()))

        self.logger = CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)(hear)
        (folder / "model.image").write_bytes(image)
        token = (guid(image) if guid_ is None else guid_).encode()
        place = str(folder if uri is None else uri).encode()
        make = getattr(self.library, f"fmi3Instantiate{kind}")
        make.restype = c_void_p
        given = [c_char_p(b"one"), c_char_p(token), c_char_p(place), False, False]
        if kind == "CoSimulation":
            given += [early, early, None, c_size_t(0)]
        self.component = make(*given, None, self.logger, None, None, None)

    def call(self, name, *values):
        name = name.replace("FMUstate", "FMUState").replace("DeSer", "Deser")
        return getattr(self.library, f"fmi3{name}")(c_void_p(self.component), *values)

    def begin(self, start=0.0, stop=1.0):
        given = (False, c_double(0), c_double(start), True, c_double(stop))
        assert self.call("EnterInitializationMode", *given) == OK
        return self.call("ExitInitializationMode")

    def step(self, now, step):
        event, ended, early = c_bool(True), c_bool(), c_bool(True)
        self.reached = c_double()
        given = map(byref, (event, ended, early, self.reached))
        status = self.call("DoStep", c_double(now), c_double(step), True, *given)
        self.ended, self.early = ended.value, early.value
        assert not event.value
        return status

    def get(self, *names):
        which = (c_uint * len(names))(*(self.references[name][0] for name in names))
        values, count = (c_double * len(names))(), c_size_t(len(names))
        assert self.call("GetFloat64", which, count, values, count) == OK
        return list(values)

    def set(self, **values):
        names = [name.replace("__", ".") for name in values]
        which = (c_uint * len(names))(*(self.references[name][0] for name in names))
        numbers, count = (c_double * len(names))(*values.values()), c_size_t(len(names))
        return self.call("SetFloat64", which, count, numbers, count)


@pytest.fixture(params=[Unit, Unit3], ids=["fmi2", "fmi3"])
def version(request):
    return request.param


@pytest.fixture
def unit(binary, tmp_path, image, version):
    made = version(binary, tmp_path, image)
    assert made.component, made.said
    return made


def course(unit, times):
    """Angle of the crank at these times, one after the other."""
    found = [unit.get("crank.angle")[0]]
    for a, b in itertools.pairwise(times):
        assert unit.step(a, b - a) == OK
        found += unit.get("crank.angle")
    return np.array(found)


def test_a_motion_is_that_of_simulate(unit):
    times = np.linspace(0.0, 1.0, 101)
    assert unit.begin() == OK
    found = course(unit, times)
    own = mbody.simulate(gallery.load("free_fourbar"), until=1.0, instants=101)["crank"].angle
    assert np.abs(found - own).max() < OTHER_STEPS * np.abs(own).max()
    assert unit.call("Terminate") == OK and not unit.said


def test_a_ball_bounces_as_in_simulate(binary, tmp_path, version):
    """Across impacts, and back to a state before one, as an importer that tries a step again."""
    ball = gallery.load("bouncing_ball")
    ball.simulation = replace(ball.simulation, events=())
    unit = version(binary, tmp_path, to_image(ball).content)
    assert unit.begin(0.0, 1.5) == OK
    run = mbody.simulate(ball, until=1.5, instants=31)
    assert sum(one.name == "impact" for one in run.events) == 2
    found, state = [], c_void_p()
    for n in range(30):
        assert unit.call("GetFMUstate", byref(state)) == OK
        for _ in range(2):
            assert unit.step(0.05 * n, 0.05) == OK, unit.said
            found.append(unit.get("ball.y")[0])
            if len(found) % 2:
                assert unit.call("SetFMUstate", state) == OK
    assert found[::2] == found[1::2]
    assert found[::2] == pytest.approx(run["ball"].y[1:], abs=OTHER_STEPS)


def test_communication_steps_may_be_of_any_length(unit):
    times = np.cumsum([0.0, 0.001, 0.2, 0.05, 0.3, 1e-9, 0.1])
    assert unit.begin() == OK
    found = course(unit, times)
    own = mbody.simulate(gallery.load("free_fourbar"), until=1.0, rtol=1e-10)
    last = np.interp(times[-1], own.t, own["crank"].angle)
    assert found[-1] == pytest.approx(last, abs=1e-3)  # interpolated
    assert unit.step(0.9, 0.1) == ERROR and "the motion is at" in unit.sentence
    assert unit.step(times[-1], -0.1) == ERROR and "must be positive" in unit.sentence


def test_parameters_before_and_between_steps(unit):
    weight = unit.get("rocker.weight")[0]
    assert unit.set(rocker__weight=2.0 * weight) == OK
    assert unit.get("rocker.weight") == [2.0 * weight]
    assert unit.begin() == OK
    found = course(unit, np.linspace(0.0, 0.5, 26))
    machine = mbody.assemble(gallery.load("free_fourbar"))
    heavy = machine.with_values({"rocker.weight": 2.0 * weight / POUND})
    own = mbody.simulate(heavy, until=0.5, instants=26)["crank"].angle
    assert np.abs(found - own).max() < OTHER_STEPS * np.abs(own).max()
    before = unit.get("crank.omega", "crank.angle")
    assert unit.set(rocker__weight=weight) == OK
    assert unit.get("crank.omega", "crank.angle") == pytest.approx(before, rel=1e-12)
    assert unit.step(0.5, 0.1) == OK
    assert unit.set(rocker__weight=math.nan) == DISCARD
    assert unit.said[-1][1] == "logStatusDiscard" and "rocker.weight cannot be nan" in unit.sentence
    assert unit.get("rocker.weight") == [weight]


def test_states_go_back_and_into_files(unit, binary, tmp_path, image, version):
    assert unit.begin() == OK and unit.step(0.0, 0.3) == OK
    state, size = c_void_p(), c_size_t()
    assert unit.call("GetFMUstate", byref(state)) == OK
    ends = []
    for _ in range(2):
        assert unit.call("SetFMUstate", state) == OK
        assert unit.step(0.3, 0.3) == OK
        ends.append(unit.get("crank.angle", "rocker.omega"))
    assert unit.call("SerializedFMUstateSize", state, byref(size)) == OK
    kept = ctypes.create_string_buffer(size.value)
    assert unit.call("SerializeFMUstate", state, kept, c_size_t(size.value)) == OK
    assert unit.call("FreeFMUstate", byref(state)) == OK and not state.value
    # another instance takes it from the bytes
    other, taken = version(binary, tmp_path, image), c_void_p()
    assert other.call("DeSerializeFMUstate", kept, size, byref(taken)) == OK
    assert other.call("SetFMUstate", taken) == OK and other.step(0.3, 0.3) == OK
    assert other.get("crank.angle", "rocker.omega") == ends[0] == ends[1]
    other.call("FreeFMUstate", byref(taken))
    kept[size.value // 2] = bytes([kept[size.value // 2][0] ^ 4])
    assert other.call("DeSerializeFMUstate", kept, size, byref(taken)) == OK
    assert other.call("SetFMUstate", taken) == ERROR and "damaged" in other.sentence
    other.call("FreeFMUstate", byref(taken))


def test_a_reset_unit_is_a_new_one(unit):
    times = np.linspace(0.0, 0.3, 16)
    ends = []
    for _ in range(2):
        assert unit.begin() == OK
        ends.append(course(unit, times).tolist())
        assert unit.set(rocker__weight=5.0) == OK
        assert unit.call("Reset") == OK
    assert ends[0] == ends[1] and unit.get("rocker.weight")[0] != 5.0


def test_a_motion_that_ends_is_discarded_with_a_reason(binary, tmp_path):
    """A crank that is driven past a position where its rod and slider have another branch."""
    unit = Unit(binary, tmp_path, to_image(gallery.load("slider_crank")).content)
    assert unit.begin() == OK
    assert unit.step(0.0, 0.07) == OK
    status = unit.step(0.07, 0.05)
    assert status == DISCARD and unit.said[-1][:2] == (DISCARD, "logStatusDiscard")
    assert "singular position" in unit.sentence
    reached, ended = c_double(), c_int()
    assert unit.call("GetRealStatus", LAST_SUCCESSFUL_TIME, byref(reached)) == OK
    assert unit.call("GetBooleanStatus", TERMINATED, byref(ended)) == OK
    assert 0.07 <= reached.value < 0.12 and ended.value == 1
    assert unit.step(reached.value, 0.01) == DISCARD and "has ended" in unit.sentence


def test_a_motion_that_ends_returns_early_where_that_is_allowed(binary, tmp_path):
    unit = Unit3(binary, tmp_path, to_image(gallery.load("slider_crank")).content, early=True)
    assert unit.begin() == OK and unit.step(0.0, 0.07) == OK and not unit.early
    assert unit.step(0.07, 0.05) == WARNING and unit.ended and unit.early
    assert "singular position" in unit.sentence and 0.07 <= unit.reached.value < 0.12
    # an event mode that follows says that the simulation is over
    flags = [c_bool() for _ in range(5)]
    assert unit.call("EnterEventMode") == OK
    assert unit.call("UpdateDiscreteStates", *map(byref, flags), byref(c_double())) == OK
    assert [flag.value for flag in flags] == [False, True, False, False, False]


def test_what_cannot_be_instantiated_says_why(binary, tmp_path, image):
    turned = sealed(to_image(makers.four_bar(1, 3, 2, 3.5, speed=1.0)).content)
    for sentence, made in (
        ("not for model exchange", Unit(binary, tmp_path, image, kind=0)),
        ("is that of another model", Unit(binary, tmp_path, image, guid_="{other}")),
        ("cannot be read", Unit(binary, tmp_path, image, uri="file:///nowhere/resources")),
        ("has no free motion", Unit(binary, tmp_path, turned)),
        ("does not begin with", Unit(binary, tmp_path, bytes(4096))),
    ):
        assert not made.component and sentence in made.sentence
        assert made.said[-1][:2] == (ERROR, "logStatusError")


def test_other_kinds_of_variables_and_derivatives_are_refused(binary, tmp_path, image):
    unit = Unit(binary, tmp_path, image)
    one, value = (c_uint * 1)(0), (c_int * 1)()
    for name in ("GetInteger", "GetBoolean", "SetInteger", "SetBoolean"):
        assert unit.call(name, one, c_size_t(1), value) == ERROR and "Real" in unit.sentence
        assert unit.call(name, one, c_size_t(0), value) == OK
    far = (c_uint * 1)(4_000_000_000)
    number = (c_double * 1)()
    assert unit.call("GetReal", far, c_size_t(1), number) == ERROR
    assert unit.call("SetReal", far, c_size_t(1), number) == ERROR
    assert "4000000000" in unit.sentence
    assert unit.step(0.0, 0.1) == ERROR and "not initialized" in unit.sentence
    assert unit.call("CancelStep") == ERROR


def test_a_whole_file(binary, tmp_path):
    """Packed, unpacked, and used by what modelDescription.xml says."""
    made = to_fmu(gallery.load("free_fourbar"), "2.0", name="swing", binaries={LINUX: binary})
    with zipfile.ZipFile(io.BytesIO(made.content)) as archive:
        archive.extractall(tmp_path / "it")
    image = (tmp_path / "it" / "resources" / "model.image").read_bytes()
    root = ElementTree.parse(tmp_path / "it" / "modelDescription.xml").getroot()
    name = root.find("CoSimulation").get("modelIdentifier")
    library = tmp_path / "it" / "binaries" / "linux64" / f"{name}.so"
    folder = tmp_path / "it" / "resources"
    unit = Unit(library, tmp_path, image, guid_=root.get("guid"), uri=folder.as_uri())
    assert unit.component and unit.begin() == OK
    for variable in root.iter("ScalarVariable"):
        reference, start = int(variable.get("valueReference")), variable.find("Real").get("start")
        if variable.get("causality") != "independent":
            assert unit.references[variable.get("name")] == (reference, start is not None)
        if start is not None:
            assert unit.get(variable.get("name")) == [float(start)]
    assert root.find("CoSimulation").get("canNotUseMemoryManagementFunctions") == "true"


def test_an_fmu_has_all_functions_and_shows_no_others(binary):
    library = ctypes.CDLL(str(binary))
    for name in (*FUNCTIONS, *FUNCTIONS_3):
        assert getattr(library, name)
    if shutil.which("nm"):
        command = ["nm", "-D", "--defined-only", str(binary)]
        lines = subprocess.run(command, capture_output=True, text=True).stdout.splitlines()
        seen = {line.split()[-1] for line in lines}
        own = {name for name in seen if not name.startswith("_")}
        assert own == {*FUNCTIONS, *FUNCTIONS_3}


#: Of FMI 2.0.4, for co-simulation (sections 2.1 and 4.2).
FUNCTIONS = [
    "fmi2GetTypesPlatform",
    "fmi2GetVersion",
    "fmi2SetDebugLogging",
    "fmi2Instantiate",
    "fmi2FreeInstance",
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2Terminate",
    "fmi2Reset",
    "fmi2GetReal",
    "fmi2GetInteger",
    "fmi2GetBoolean",
    "fmi2GetString",
    "fmi2SetReal",
    "fmi2SetInteger",
    "fmi2SetBoolean",
    "fmi2SetString",
    "fmi2GetFMUstate",
    "fmi2SetFMUstate",
    "fmi2FreeFMUstate",
    "fmi2SerializedFMUstateSize",
    "fmi2SerializeFMUstate",
    "fmi2DeSerializeFMUstate",
    "fmi2GetDirectionalDerivative",
    "fmi2SetRealInputDerivatives",
    "fmi2GetRealOutputDerivatives",
    "fmi2DoStep",
    "fmi2CancelStep",
    "fmi2GetStatus",
    "fmi2GetRealStatus",
    "fmi2GetIntegerStatus",
    "fmi2GetBooleanStatus",
    "fmi2GetStringStatus",
]

#: Of FMI 3.0: all of fmi3Functions.h, for importers look up those of other kinds of units too.
NAMES_3 = """
GetVersion SetDebugLogging InstantiateModelExchange InstantiateCoSimulation
InstantiateScheduledExecution FreeInstance EnterInitializationMode ExitInitializationMode
EnterEventMode Terminate Reset GetNumberOfVariableDependencies GetVariableDependencies
GetFMUState SetFMUState FreeFMUState SerializedFMUStateSize SerializeFMUState
DeserializeFMUState GetDirectionalDerivative GetAdjointDerivative EnterConfigurationMode
ExitConfigurationMode GetIntervalDecimal GetIntervalFraction GetShiftDecimal GetShiftFraction
SetIntervalDecimal SetIntervalFraction SetShiftDecimal SetShiftFraction EvaluateDiscreteStates
UpdateDiscreteStates EnterStepMode GetOutputDerivatives DoStep EnterContinuousTimeMode
SetContinuousStates GetContinuousStates GetContinuousStateDerivatives
GetNominalsOfContinuousStates GetEventIndicators ActivateModelPartition SetTime
CompletedIntegratorStep GetNumberOfEventIndicators GetNumberOfContinuousStates
"""
KINDS_3 = """
Float32 Float64 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Boolean String Binary Clock
"""
FUNCTIONS_3 = [f"fmi3{name}" for name in NAMES_3.split()]
FUNCTIONS_3 += [f"fmi3{way}{kind}" for way in ("Get", "Set") for kind in KINDS_3.split()]
