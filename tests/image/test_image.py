"""Images: the native core on the bytes of a model gives what mbody gives."""

import functools
import itertools
import math
import warnings

import numpy as np
import pytest

import mbody
from mbody import cli, gallery
from mbody.analysis.initial.initial_state import initial_state_of
from mbody.core import selection
from mbody.core.selection import source_hash
from mbody.errors import ModelError, SolveError
from mbody.image.model_image import to_image
from tests.support.gallery_tables import tables

pytestmark = pytest.mark.skipif(
    selection.chosen().name != "native", reason="an image runs on machine code"
)
if selection.chosen().name == "native":
    from tests.support.image_loader import DONE, STEPS, Loaded

#: Fewer instants than lanes pay for: kinetostatics takes the scalar path, as an image does.
FEW = 41
#: Sums of the same numbers in another order, and a first step that differs in the last bit: two
#: motions of a few hundred steps that are not chaotic stay together to this part.
NEAR = 1e-12
#: What may open, stick or strike, whose images are led in `tests/image/test_image_contacts.py`.
ACTING = ("bouncing_ball", "braking_vehicle", "pile_of_discs", "rolling_ball", "sliding_ladder")
ACTING += ("geneva_drive", "stick_slip", "woodpecker")
MODELS = tuple(name for name in gallery.names() if name not in ACTING)
#: Over a whole turn it jams: mbody has no forces there, an image does not look at that.
JAMS = ("toggle_press",)
DRIVEN = tuple(name for name in MODELS if "drivers" in tables(name) and name not in JAMS)
FREE = ("norton_fourbar", "free_fourbar", "double_pendulum", "andrews_squeezer")

every = pytest.mark.parametrize("name", MODELS)


@functools.cache
def system(name):
    return mbody.assemble(gallery.load(name))


@functools.cache
def made(name):
    """The image of a model, few instants."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return to_image(system(name), FEW)


def loaded(name):
    return Loaded(made(name).content)


def apart(found, wanted, size=None):
    """The greatest difference as a part of the greatest number."""
    size = np.abs(wanted).max(initial=0.0) if size is None else size
    return float(np.abs(found - wanted).max(initial=0.0)) / (size or 1.0)


def others(image, seed=0):
    """All changeable numbers, each a little off; nothing that must not be negative is zero."""
    shaken, here = np.random.default_rng(seed), {}
    for name, at in image.numbers.items():
        value = float(at[0]) * (1.0 + 1e-3 * shaken.standard_normal())
        here[name] = value if value else 1e-4 * abs(shaken.standard_normal())
    return here


# -- bytes ------------------------------------------------------------------------------------


@pytest.mark.slow
@every
def test_an_image_is_laid_out_as_the_page_says(name):
    content = made(name).content
    words = np.frombuffer(content, dtype=np.int64)
    assert len(content) % 8 == 0 and not words[14:16].any()
    plain = [int(word) % 2**64 for word in words]
    plain[13] = 0
    assert int(words[13]) % 2**64 == sum((2 * n + 1) * w for n, w in enumerate(plain)) % 2**64
    assert content[72:104].hex() == source_hash()
    moved = words[words[3] : words[3] + words[4]]
    assert len(set(moved.tolist())) == len(moved) and moved.min() >= 16
    places = words[moved]
    assert places.min() >= 128 and places.max() <= len(content) and not (places % 8).any()
    image = Loaded(content)
    assert set(image.arrays["page.rows"].shape) == {image.manifest["rows"]}
    for array, at in image.arrays.items():
        if "." in array and array.rpartition(".")[2] in ("output", "pages", "measured", "q"):
            inside = at.ctypes.data - image.base
            assert array.endswith(".q") or inside % 64 == 0, array


@pytest.mark.slow
@every
def test_the_manifest_names_what_is_there(name):
    image = loaded(name)
    manifest, values = image.manifest, system(name).values
    numbers = [one["name"] for one in manifest["numbers"] if not one["follows"]]
    assert numbers == list(image.numbers) and manifest["length"] == system(name).length
    assert set(numbers) | set(manifest["not_changeable"]) == set(values)
    assert not set(numbers) & set(manifest["not_changeable"])
    assert {k: float(v[0]) for k, v in image.numbers.items()} == {k: values[k] for k in numbers}
    assert [one["name"] for one in manifest["measures"]] == list(image.measures)
    assert sorted(image.measures.values()) == list(range(len(image.measures)))
    parts = {call.partition(".")[2] or call for call in image.calls}
    assert parts <= {"driven", "free", "close", "turn", "step", "measures", "begin", "advance"} | {
        "run"
    }
    assert ("turn" in image.calls) == ("driven" in manifest["analyses"])
    assert ("run" in image.calls) == ("free" in manifest["analyses"])


# -- numbers ----------------------------------------------------------------------------------


@pytest.mark.slow
@every
def test_changed_numbers_are_those_of_the_system(name):
    """Each operation is the same function of the same C library: the same bits, but for powers and
    angles of other vector units, hence 1e-14.
    """
    image = loaded(name)
    for seed in range(2):
        new = others(image, seed)
        wanted = system(name).with_values(new)
        for analysis in image.manifest["analyses"]:
            assert image.set(new, analysis) == -1
            for part in ("par", "mass"):
                found, rows = image.workspace(analysis, part), getattr(wanted, part)[:, 0]
                assert np.allclose(found, rows, rtol=1e-14, atol=1e-14 * np.abs(rows).max())


def test_a_number_that_is_not_allowed_changes_nothing():
    image = loaded("norton_fourbar")
    before = image.workspace("driven", "mass").copy()
    names = list(image.numbers)
    for bad in (-1.0, math.nan, math.inf):
        assert image.set({"crank.weight": bad}, "driven") == names.index("crank.weight")
        assert np.array_equal(image.workspace("driven", "mass"), before)
    assert image.set({"crank.weight": 0.0}, "driven") == -1
    with pytest.raises(ModelError, match=r"crank\.weight"):
        system("norton_fourbar").with_values({"crank.weight": -1.0})


def test_numbers_that_follow_are_not_allowed_to_break_their_rules():
    machine = gallery.load("simple_pendulum")
    own = mbody.Mechanism("rod", parameters={"a": 2.0, "b": 1.0})
    own.add(mbody.Body("rod", mass="a - b", cg=(0.5, 0.0)))
    own.add(mbody.Revolute("O", "ground", "rod"), mbody.Gravity("gravity", y=-9.81))
    image = Loaded(to_image(own).content)
    assert machine is not None and image.manifest["not_changeable"].keys() >= {"rod.mass"}
    assert image.set({"b": 1.5}, "free") == -1
    assert image.workspace("free", "mass")[0] == 0.5
    assert image.set({"b": 2.5}, "free") == len(image.numbers)
    assert image.workspace("free", "mass")[0] == 0.5
    with pytest.raises(ModelError, match=r"rod\.mass"):
        mbody.assemble(own).with_values({"b": 2.5})


# -- driven motion ----------------------------------------------------------------------------


def turned(name, values=None, t=None):
    """The turn of kinetostatics, or the motion at times, on the scalar path."""
    own = system(name) if values is None else system(name).with_values(values)
    if t is not None:
        return mbody.kinetostatics(own, t)
    angular = [driver.name for driver in own.drivers if driver.angular]
    if len(angular) == 1:
        return mbody.kinetostatics(own, turn=angular[0], instants=FEW)
    simulation = own.mechanism.simulation
    last = 1.0 if simulation is None else float(initial_last(own))
    return mbody.kinetostatics(own, np.linspace(0.0, last, FEW))


def initial_last(own):
    from mbody.analysis.dynamics.options import last_time

    return last_time(own, None)


@pytest.mark.parametrize("name", DRIVEN)
def test_a_turn_has_the_bits_of_kinetostatics(name):
    image = loaded(name)
    try:
        run = turned(name)
    except SolveError as error:
        # a dead centre is in the way: what was computed before it
        assert image.call("turn") == 1
        run, done = error.solution, int(image["turn.progress"][0])
        assert done == len(run)
    else:
        assert image.call("turn") == 0
    pages, measured = image.output("turn")
    assert np.array_equal(pages[: len(run)], run.record.table(slice(None)))
    forces = max(np.abs(run.reaction(one.name).magnitude).max() for one in run.mechanism.joints)
    for key, found in measured.items():
        if key.endswith(".misfit"):
            assert np.abs(found).max() < 1e-12 * system(name).length
            continue
        wanted = run.measure(key)
        # torques of joints that transmit none are rounding of the forces, and accelerations of
        # drivers that have none are rounding of the square of the speed
        size = max(np.abs(wanted).max(), 1e-3 * forces * system(name).length)
        if key.endswith(".acceleration"):
            size = max(size, np.square(run.measure(key.replace("acceleration", "rate"))).max())
        assert apart(found[: len(run)], wanted, size) < NEAR, key


@pytest.mark.parametrize("name", DRIVEN)
def test_a_turn_with_other_numbers_is_that_of_the_changed_system(name):
    image = loaded(name)
    new = others(image)
    assert image.set(new, "driven") == -1
    begin = begun(image, new)
    closed = image.close(*begin)
    try:
        run = changed(name, image, new)
    except SolveError as error:
        # what mbody refuses does not close, or is stuck; or its wheels do not fit, which the
        # manifest says
        assert not closed or image.call("turn") == 1 or "does not fit" in str(error), error
        if "does not fit" in str(error):
            assert image.call("turn") == 0
            off = [v for k, v in image.output("turn")[1].items() if k.endswith(".misfit")]
            assert np.abs(off).max() > 1e-6 * system(name).length
        return
    assert closed and image.call("turn") == 0
    pages, wanted = image.output("turn")[0], run.record.table(slice(None))
    for rows in parts(name):
        # a quantity is as exact as the motion is: accelerations and forces by their own size
        assert apart(pages[:, rows], wanted[:, rows]) < 1e-9


def by_time(image):
    return image.manifest["driven"]["path parameters"]["turn"] == "time"


def begun(image, new):
    """Time and values of the drivers at the first instant of the turn."""
    return float(image["turn.t"][0]), None if by_time(image) else float(image["turn.s"][0])


def changed(name, image, new):
    """The same motion of the changed system."""
    own = system(name).with_values(new)
    if by_time(image):
        return mbody.kinetostatics(own, image["turn.t"].copy())
    (driver,) = own.drivers
    return mbody.kinetostatics(own, drive={driver.name: image["turn.s"].copy()})


def parts(name):
    """Rows of a page that are measured by one size: q, v, a, forces."""
    n = system(name).coordinates
    return slice(0, n), slice(n, 2 * n), slice(2 * n, 3 * n), slice(3 * n, None)


def test_loops_that_do_not_close_are_said_to_be_open():
    image = loaded("norton_fourbar")
    q = image["driven.q"].copy()
    length = float(image.numbers["coupler.B.x"][0])
    assert image.set({"coupler.B.x": 20.0 * length}, "driven") == -1
    assert not image.close()
    with pytest.raises(SolveError):
        mbody.kinematics(system("norton_fourbar").with_values({"coupler.B.x": 20.0 * length}))
    image["driven.q"][:] = q
    assert image.set({"coupler.B.x": length}, "driven") == -1 and image.close()


@pytest.mark.parametrize("off", [1e-7, 1e-5, 1e-3, 0.1])
def test_redundant_loops_with_a_gap_are_open(off):
    """Newton's method with regularized rows rests at the smallest gap."""
    image = loaded("parallel_cranks")
    assert image.manifest["driven"]["redundant"] and image.close()
    image.set({"coupler.A2.x": float(image.numbers["coupler.A2.x"][0]) + off}, "driven")
    assert not image.close()


def test_a_crank_is_dragged_in_steps():
    image, own = loaded("norton_fourbar"), system("norton_fourbar")
    begin = float(image["step.s"][0])
    way = begin + np.array([0.0, 0.2, 0.5, 0.4, 1.0, 1.7])
    for here, there in itertools.pairwise(way):
        image["step.s"][:] = here, there
        given = image["step.given"].reshape(2, 1, 3)
        given[:, 0, 0], given[:, 0, 1:] = (here, there), (2.0, -3.0)
        assert image.call("step") == 0
        pages, measured = image.output("step")
        run = mbody.kinetostatics(own, drive={"motor": (there, 2.0, -3.0)})
        wanted = run.record.table(slice(None))[0]
        assert apart(pages[1], wanted) < NEAR
        for key in ("motor.value", "motor.rate", "motor.acceleration", "motor.power", "A.force"):
            assert abs(measured[key][1] - run.measure(key)[0]) < NEAR * max(
                1.0, abs(run.measure(key)[0])
            )


# -- free motion ------------------------------------------------------------------------------


def simulated(name, times, values=None):
    """The motion of mbody at times, from the start of the description."""
    own = system(name)
    settings = own.mechanism.simulation
    start = None if settings is None else initial_state_of(own, settings)
    start = mbody.engineering.close_loops(own) if start is None else start
    own = own if values is None else own.with_values(values)
    return mbody.simulate(own, times[-1], start=start, times=times, method="dop853", events=())


@pytest.mark.parametrize("name", FREE)
def test_a_free_motion_has_the_steps_of_simulate(name):
    image = loaded(name)
    assert image.run() == DONE
    pages, measured = image.output("run")
    run = simulated(name, image["run.times"].copy())
    assert image["motion.state"][STEPS] == run.stats["steps"]
    n = 2 * system(name).coordinates
    # rounding of two compilations grows along a free motion: to some 1e-12 in the four-bar's 10 s
    assert apart(pages[:, :n], run.record.table(slice(0, n))) < 10.0 * NEAR
    for key in list(measured)[:40]:
        assert apart(measured[key], run.measure(key), 1.0 + np.abs(run.measure(key)).max()) < 1e-9


def test_a_state_that_was_saved_goes_on_with_the_same_bits():
    image = loaded("double_pendulum")
    assert image.call("begin") == 0 and image.advance(1.0) == DONE
    saved = image.bytes.copy()
    assert image.advance(2.0) == DONE
    first = image["advance.pages"].copy()
    image.bytes[:] = saved
    assert image.advance(2.0) == DONE
    assert np.array_equal(image["advance.pages"], first)


# -- what is refused --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ACTING)
def test_a_model_whose_contacts_act_has_a_free_motion(name):
    manifest = to_image(gallery.load(name)).manifest
    assert manifest["analyses"] == ["free"]
    assert all(one.name in manifest["free"]["contacts"] for one in gallery.load(name).contacts)


def test_a_model_without_masses_has_no_free_motion():
    manifest = made("static_fourbar").manifest
    assert manifest["analyses"] == ["driven"]
    assert any("give masses" in note for note in manifest["notes"])


def test_the_command_writes_an_image(tmp_path, capsys):
    file = tmp_path / "norton.img"
    words = ["export", "norton_fourbar", "--to", "image", "--instants", str(FEW), "-o", str(file)]
    assert cli.main(words) == 0
    assert file.read_bytes() == made("norton_fourbar").content
    assert "wrote" in capsys.readouterr().err
