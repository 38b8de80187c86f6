"""The C door to images, `mbody.h`: a program without Python against mbody's own answers."""

import ctypes
import json
import math
import re
import shutil
import subprocess
import threading
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.image.model_image import to_image
from tests.support import embedded
from tests.support.cases import first_fast
from tests.support.embedded import (
    ADVANCE,
    DOOR,
    DOUBT,
    ENDED,
    GOOD,
    REFUSED,
    RUN,
    STEP,
    TURN,
    Model,
)

pytestmark = embedded.needs_core

# one path of code on both sides but for lanes, which solve by other factors: rounding times the
# condition of forces
CLOSE = 1e-12
# steps end at other instants: the tolerance of a step, 1e-8, over some ten steps
OTHER_STEPS = 1e-7


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    return embedded.door(tmp_path_factory.mktemp("door"))


@pytest.fixture(scope="session")
def images():
    names = ("slider_crank", "free_fourbar", "double_pendulum")
    return {name: to_image(gallery.load(name)).content for name in names}


@pytest.fixture
def crank(library, images):
    return Model(library, images["slider_crank"])


@pytest.fixture
def released(library, images):
    return Model(library, images["free_fourbar"])


def agree(found, expected, part):
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= part * np.abs(expected).max()


# ---- a program -----------------------------------------------------------------------------------


def lines(text, word):
    return np.array(
        [line.split()[1:] for line in text.splitlines() if line.startswith(word)], float
    )


def test_the_example_gives_mbodys_own_numbers(tmp_path, images):
    program = embedded.compiled([DOOR / "example.c", DOOR / "mbody.c"], tmp_path / "example")
    image = tmp_path / "model.img"
    image.write_bytes(images["slider_crank"])
    command = [program, image, "rod", "1.1", "motor.effort", "0.1"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "rod = 1.2" in done.stdout
    turn, motion = lines(done.stdout, "turn"), lines(done.stdout, "motion")
    system = mbody.assemble(gallery.load("slider_crank")).with_values({"rod": 1.1})
    agree(turn[:, 1], mbody.kinetostatics(system, t=turn[:, 0]).effort("motor"), CLOSE)
    assert len(motion) == 51
    own = mbody.simulate(system, until=0.1, instants=51)
    agree(motion[:, 1], own.effort("motor"), OTHER_STEPS)


def test_the_example_tells_what_is_struck(tmp_path):
    program = embedded.compiled([DOOR / "example.c", DOOR / "mbody.c"], tmp_path / "example")
    machine, image = gallery.load("bouncing_ball"), tmp_path / "model.img"
    machine.simulation = replace(machine.simulation, events=())
    image.write_bytes(to_image(machine).content)
    mass = "ball.mass"
    value = str(mbody.assemble(machine).values[mass])
    done, other = (
        subprocess.run(
            [program, image, mass, given, "ball.y", "1.5"], capture_output=True, text=True
        )
        for given in (value, "7")
    )
    assert done.returncode == 0, done.stderr
    run = mbody.simulate(machine, until=1.5)
    struck = [one.t for one in run.events if one.name == "impact"]
    agree(lines(done.stdout, "struck")[:, 0], struck, OTHER_STEPS)
    assert "ball.mass is not what the contacts of this image were made with" in other.stderr


def test_the_example_says_what_is_wrong(tmp_path, images):
    program = embedded.compiled([DOOR / "example.c", DOOR / "mbody.c"], tmp_path / "example")
    image = tmp_path / "model.img"
    image.write_bytes(images["double_pendulum"])
    for words, sentence in (
        ([tmp_path / "none", "m", "1", "upper.angle"], "cannot be read"),
        ([image, "n", "1", "upper.angle"], "no such number"),
        ([image, "m", "nan", "upper.angle"], "m cannot be nan kg"),
        ([image, "m"], "usage"),
    ):
        done = subprocess.run([program, *words], capture_output=True, text=True)
        assert done.returncode == 1 and sentence in done.stderr


@first_fast("compiler", ["gcc", "clang", "zig"], 2)
def test_no_compiler_warns(tmp_path, compiler):
    if compiler == "zig":
        pytest.importorskip("ziglang")
        from mbody.core.selection import ZIG as command
    elif shutil.which(compiler):
        command = [compiler]
    else:
        pytest.skip(f"{compiler} is not installed")
    warnings = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]
    for name in ("mbody.c", "example.c", "fmu.c", "fmi2.c", "fmi3.c"):
        made = [*command, *warnings, "-O2", "-c", str(DOOR / name), "-o", str(tmp_path / "it.o")]
        done = subprocess.run(made, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


def test_the_header_is_one_of_cpp_too(tmp_path):
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        pytest.skip("no C++ compiler is installed")
    source = tmp_path / "it.cpp"
    source.write_text('#include "mbody.h"\nint main() { return mbody_open(0, 0, 0, 0) != 0; }\n')
    program = tmp_path / "it"
    embedded.compiled([DOOR / "mbody.c"], tmp_path / "door.so", "-shared")
    line = [compiler, "-Wall", "-Wextra", "-Werror", f"-I{DOOR}", str(source)]
    line += [str(tmp_path / "door.so"), f"-Wl,-rpath,{tmp_path}", "-o", str(program)]
    done = subprocess.run(line, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert subprocess.run([program]).returncode == 0


def test_every_function_is_documented():
    text = (DOOR / "mbody.h").read_text("utf-8")
    declared = set(re.findall(r"^\S.*\b(mbody_\w+)\(.*\);", text, re.MULTILINE))
    described = set(re.findall(r"^ \* (mbody_\w+)  ", text, re.MULTILINE))
    assert len(declared) == 35 and declared == described


# ---- driven motion -------------------------------------------------------------------------------


def test_a_turn_with_other_numbers(crank):
    assert crank.change("crank", 0.35) == crank.change("pressure", 2e5) == GOOD
    assert crank.turn() == GOOD
    values = {"crank": 0.35, "pressure": 2e5}
    system = mbody.assemble(gallery.load("slider_crank")).with_values(values)
    own = mbody.kinetostatics(system, t=np.array(crank.times(TURN)))
    agree(crank.history(TURN, "motor.effort"), own.effort("motor"), CLOSE)
    # a second turn begins where the first one did
    first = crank.history(TURN, "motor.effort")
    assert crank.turn() == GOOD and crank.history(TURN, "motor.effort") == first


def test_a_driver_is_moved_there_and_back(crank):
    here, before = crank.driver(0), list(crank.numbers("driven.q"))
    assert crank.step_driver(0, here + 1.0) == GOOD
    assert crank.driver(0) == here + 1.0 and crank.instants(STEP) == 2
    speed = crank.number(crank.entry("speed"))
    own = mbody.kinetostatics(gallery.load("slider_crank"), t=[0.0, 1.0 / speed])
    agree(crank.history(STEP, "slider.x"), own["slider"].x, CLOSE)
    assert crank.history(STEP, "slider.vx") == [0.0, 0.0]
    assert crank.step_driver(0, here + 30.0) == GOOD
    assert crank.step_driver(0, here) == GOOD
    agree(list(crank.numbers("driven.q")), before, CLOSE)


def test_the_manifest_is_json(crank):
    count = ctypes.c_size_t()
    place = crank.library.mbody_manifest(crank.model, count)
    manifest = json.loads(ctypes.string_at(place, count.value))
    assert manifest["drivers"] == ["motor"]
    rows = ctypes.c_int()
    assert crank.turn() == GOOD and crank.page(TURN, 3, rows)
    assert rows.value == manifest["rows"] and not crank.page(TURN, 361, rows)
    # pages begin with x, y, angle of every body in order
    body = manifest["bodies"].index("crank")
    assert crank.page(TURN, 3, rows)[3 * body + 2] == crank.history(TURN, "crank.angle")[3]


def test_loops_that_do_not_close_are_a_sentence(crank):
    before = list(crank.numbers("driven.q"))
    assert crank.change("rod", 0.05) == GOOD
    assert crank.step_driver(0, 1.5) == ENDED and "do not close" in crank.sentence
    assert list(crank.numbers("driven.q")) == before
    assert crank.turn() == ENDED
    assert crank.change("rod", 1.2) == GOOD
    assert crank.close_loops() == crank.turn() == GOOD
    assert crank.instants(TURN) == 361


def test_a_dead_centre_is_a_sentence(library):
    from mbody import makers

    rocker = makers.four_bar(3.0, 1.5, 2.5, 2.0, masses=(1.0, 1.0, 1.0), speed=1.0, start=0.6)
    model = Model(library, to_image(rocker).content)
    before = list(model.numbers("driven.q"))
    assert model.step_driver(0, 3.2) == ENDED
    assert "dead centre" in model.sentence and model.instants(STEP) == 1
    assert list(model.numbers("driven.q")) == before and model.driver(0) == pytest.approx(0.6)
    assert model.step_driver(0, 0.7) == GOOD


# ---- numbers -------------------------------------------------------------------------------------


def test_numbers_by_name_with_their_units(crank):
    entry = crank.entry("pressure")
    assert crank.number(entry) == 350000.0 and crank.unit(entry) == "N/m²".encode()
    assert crank.name(entry) == b"pressure" and crank.kind(entry) == 1
    assert crank.find_number(b"pressur") == crank.find_measure(b"pressure") == -1
    assert math.isnan(crank.number(10**6)) and crank.name(-1) == b""
    assert crank.find_input(b"torque") == -1
    assert crank.set_input(entry, 1.0) == REFUSED and "is no input" in crank.sentence


def test_a_number_that_is_not_allowed_keeps_the_old_one(library, images):
    pendulum = Model(library, images["double_pendulum"])
    for value in (math.nan, math.inf):
        assert pendulum.change("m", value) == REFUSED and "m cannot be" in pendulum.sentence
    assert pendulum.number(pendulum.entry("m")) == 1.0
    assert pendulum.change("upper.angle", 1.0) == REFUSED and "no number" in pendulum.sentence
    assert pendulum.start(0.0, 1.0) == pendulum.advance(0.2) == GOOD
    again = Model(library, images["double_pendulum"])
    assert again.start(0.0, 1.0) == again.advance(0.2) == GOOD
    assert pendulum.history(ADVANCE, "lower.angle") == again.history(ADVANCE, "lower.angle")


# ---- free motion ---------------------------------------------------------------------------------


def test_a_whole_run_has_the_bits_of_simulate(released):
    assert released.run() == GOOD
    own = mbody.simulate(gallery.load("free_fourbar"))
    assert released.times(RUN) == own.t.tolist()
    agree(released.history(RUN, "crank.angle"), own["crank"].angle, CLOSE)
    assert released.now() == own.t[-1]
    # the present instant is the last one
    assert released.history(ADVANCE, "crank.x") == released.history(RUN, "crank.x")[-1:]


def test_short_steps_make_the_same_motion(released):
    assert math.isnan(released.now())
    assert released.advance(0.1) == REFUSED and "mbody_start" in released.sentence
    assert released.start(0.0, 1.0) == GOOD
    found = [released.history(ADVANCE, "crank.angle")]
    for k in range(1, 101):
        assert released.advance(k / 100) == GOOD
        found.append(released.history(ADVANCE, "crank.angle"))
    own = mbody.simulate(gallery.load("free_fourbar"), until=1.0, instants=101)
    agree(np.ravel(found), own["crank"].angle, OTHER_STEPS)
    assert released.advance(0.5) == REFUSED and "cannot go to 0.5" in released.sentence
    assert released.advance(math.nan) == REFUSED


def test_a_number_changes_while_it_moves(library, images, released):
    weight = released.entry("rocker.weight")
    value = 2.0 * released.number(weight)
    assert released.start(0.0, 1.0) == released.advance(0.2) == GOOD
    state, before = list(released.numbers("motion.y")), released.history(ADVANCE, "crank.omega")
    assert released.set_number(weight, value) == released.advance(0.2) == GOOD
    agree(released.history(ADVANCE, "crank.omega"), before, CLOSE)  # the speeds stay
    assert released.advance(0.4) == GOOD
    # the same by hand: another model that begins there with the other number
    other = Model(library, images["free_fourbar"])
    half = len(state) // 2
    other.numbers("start.q")[:], other.numbers("start.v")[:] = state[:half], state[half:]
    assert other.set_number(weight, value) == GOOD
    assert other.start(0.2, 1.0) == other.advance(0.4) == GOOD
    agree(released.history(ADVANCE, "crank.angle"), other.history(ADVANCE, "crank.angle"), CLOSE)
    # and it is another motion than without the change
    plain = Model(library, images["free_fourbar"])
    assert plain.start(0.0, 1.0) == plain.advance(0.4) == GOOD
    gap = plain.history(ADVANCE, "crank.angle")[0] - released.history(ADVANCE, "crank.angle")[0]
    assert abs(gap) > 1e-3


def test_images_without_an_analysis_say_so(released):
    for call in (released.turn, released.close_loops, lambda: released.step_driver(0, 1.0)):
        assert call() == REFUSED and "not for that analysis" in released.sentence


# ---- states --------------------------------------------------------------------------------------


def test_a_state_is_restored_with_the_same_bits(library, images, released):
    assert released.start(0.0, 1.0) == released.advance(0.25) == GOOD
    state = released.saved()
    ends = []
    other = Model(library, images["free_fourbar"])
    for model in (released, released, other):
        assert model.restore(state, len(state)) == GOOD and model.now() == 0.25
        assert model.advance(0.5) == GOOD
        ends.append(list(model.numbers("motion.y")))
    assert ends[0] == ends[1] == ends[2]


def test_a_state_of_another_image_or_a_damaged_one_is_refused(library, images, released):
    state = released.saved()
    for at in (0, 8, 16, 24, 40, len(state) // 2, len(state) - 1):
        wrong = ctypes.create_string_buffer(bytes(state), len(state))
        wrong[at] = bytes([wrong[at][0] ^ 1])
        assert released.restore(wrong, len(wrong)) == REFUSED
        assert re.search("not one of this image|damaged", released.sentence)
    assert released.restore(state, len(state) - 1) == REFUSED and "bytes" in released.sentence
    assert Model(library, images["double_pendulum"]).restore(state, len(state)) == REFUSED


def test_models_in_threads_do_not_meet(library, images):
    """Each thread has its own; the bits are those of one thread."""

    def motion(found, n):
        model = Model(library, images["double_pendulum"])
        model.change("m", 1.0 + n)
        model.start(0.0, 1.0)
        for k in range(1, 51):
            assert model.advance(k / 50) == GOOD
        found[n] = list(model.numbers("motion.y"))

    alone, together = {}, {}
    for n in range(4):
        motion(alone, n)
    threads = [threading.Thread(target=motion, args=(together, n)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert alone == together and DOUBT == 1
