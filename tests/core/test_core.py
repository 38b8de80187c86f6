"""Which core runs the kernels, libraries that cannot be used, and what a kernel refuses."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.core import selection
from mbody.core import selection as library
from mbody.core.selection import (
    PACKAGE,
    LibraryError,
    best_levels,
    chosen,
    open_library,
    source_hash,
)
from mbody.errors import ModelError

pytestmark = pytest.mark.processor
native = pytest.mark.skipif(chosen().name != "native", reason="of the native core")
built_here = pytest.mark.skipif(
    chosen().name != "native" or chosen().library is not None, reason="kernels are not made here"
)

#: Analyses of every kind; prints a digest of each, which all cores must share.
DIGESTS = """
import hashlib, json, sys
import numpy as np
import mbody
from mbody.engineering import linearize
from mbody.gallery import load
from mbody.laws import Function
from mbody.model.loads import Torque
from mbody.sweeps import sweep

def digest(*arrays):
    whole = hashlib.sha256()
    for array in arrays:
        whole.update(np.ascontiguousarray(array, dtype=float).tobytes())
    return whole.hexdigest()[:16]

def record(run):
    return digest(*run.record.blocks)

fourbar, free, swing = load("norton_fourbar"), load("free_fourbar"), load("simple_pendulum")
hooked = load("norton_fourbar")
effort = "motor.effort"
hooked.add(Torque("brake", "crank", value=Function(lambda t: 1.0 + t * t)))
found = {
    "position": record(mbody.kinetostatics(fourbar)),
    "turn on lanes": record(mbody.kinetostatics(fourbar, turn=True, instants=361)),
    "instants": record(mbody.kinetostatics(load("watt_sixbar"), t=[0.0, 0.01])),
    "statics": record(mbody.statics(load("static_fourbar"))),
    "breakdown": digest(*mbody.kinetostatics(fourbar).breakdown("motor").values()),
    "a function of the user": record(mbody.kinetostatics(hooked, t=[0.0, 0.01])),
    "sweep": digest(sweep(fourbar, {"crank.inertia": [0.4, 0.5]}, measure=effort)[effort]),
    "dop853": record(mbody.simulate(free, 0.5)),
    "dopri5": record(mbody.simulate(free, 0.2, method="dopri5")),
    "radau5": record(mbody.simulate(swing, 0.5, method="radau5")),
    "rattle4": record(mbody.simulate(swing, 0.5, method="rattle4", step=0.01)),
    "generalized-alpha": record(
        mbody.simulate(swing, 0.5, method="generalized-alpha", step=0.01)
    ),
    "rest": digest(*[one.stiffness for one in mbody.equilibrium(swing)]),
}
print(json.dumps(found))
"""


#: Analyses that plain Python does in a second; prints their numbers.
NUMBERS = """
import json
import numpy as np
import mbody
from mbody.gallery import load

def record(run):
    return np.concatenate([block.ravel() for block in run.record.blocks]).tolist()

fourbar, swing = load("norton_fourbar"), load("simple_pendulum")
found = {
    "position": record(mbody.kinetostatics(fourbar)),
    "some instants": record(mbody.kinetostatics(fourbar, t=np.linspace(0.0, 0.1, 7))),
    "statics": record(mbody.statics(load("static_fourbar"))),
    "dop853": record(mbody.simulate(swing, 0.1)),
    "rattle4": record(mbody.simulate(swing, 0.1, method="rattle4", step=0.02)),
}
print(json.dumps(found))
"""


def python(code, **settings):
    variables = os.environ | {"PYTHONPATH": str(PACKAGE.parent)} | settings
    return subprocess.run(
        [sys.executable, "-c", code], env=variables, capture_output=True, text=True, timeout=570
    )


@pytest.mark.slow
def test_two_cores_give_the_same_bits():
    """Numba in the process against this one's core, over every kind of analysis."""
    here, there = python(DIGESTS), python(DIGESTS, MBODY_CORE="numba", MBODY_QUIET="1")
    assert here.returncode == there.returncode == 0, here.stderr + there.stderr
    assert json.loads(here.stdout) == json.loads(there.stdout)


@pytest.mark.slow
def test_plain_python_gives_the_same_to_rounding():
    """Without fused products and with sums in another order: last digits differ."""
    here, there = python(NUMBERS), python(NUMBERS, MBODY_CORE="plain")
    assert here.returncode == there.returncode == 0, here.stderr + there.stderr
    compiled, plain = json.loads(here.stdout), json.loads(there.stdout)
    for name, numbers in compiled.items():
        numbers = np.array(numbers)
        np.testing.assert_allclose(plain[name], numbers, rtol=0, atol=1e-12 * abs(numbers).max())


def test_every_compiled_function_has_a_symbol_of_its_own():
    """Those of the package, as numba names them: branches of one factory too."""
    code = """
import gc
import mbody.analysis.driven.batch
import mbody.analysis.dynamics.simulate
from mbody.compiler.linking import identity
from mbody.compiler.linking import Inner
functions = [one.py_func for one in gc.get_objects() if isinstance(one, Inner)]
print(len(functions), len({identity(one) for one in functions}))
"""
    count, different = python(code, MBODY_CORE="numba").stdout.split()
    assert int(count) > 200 and count == different


def test_an_unknown_core_is_one_sentence():
    for code in ("import mbody.kernels.continuation", "import mbody; mbody.kinetostatics"):
        done = python(code, MBODY_CORE="fast")
        assert "MBODY_CORE=fast is none of the cores native, numba, plain" in done.stderr
    done = subprocess.run(
        [sys.executable, "-m", "mbody", "kinetostatics", "norton_fourbar"],
        env=os.environ | {"MBODY_CORE": "fast"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "MBODY_CORE=fast" in done.stderr


@pytest.fixture
def choose(monkeypatch, tmp_path):
    """The choice anew, with settings of the environment, in a clone without libraries."""
    monkeypatch.setattr(selection, "PACKAGE", tmp_path)

    def anew(**settings):
        for name in ("MBODY_CORE", "MBODY_CORE_LEVEL", "NUMBA_DISABLE_JIT"):
            monkeypatch.delenv(name, raising=False)
        for name, value in settings.items():
            monkeypatch.setenv(name, value)
        return selection.chosen.__wrapped__()

    return anew


def test_without_a_linker_numba_is_next(choose, monkeypatch):
    monkeypatch.setattr(selection, "linker", lambda: None)
    found = choose()
    assert found.name == "numba"
    assert "no C compiler" in found.reason
    with pytest.raises(ModelError, match=r"MBODY_CORE=native, but that core cannot run here: .*cc"):
        choose(MBODY_CORE="native")


def test_without_numba_plain_python_runs_with_a_warning(choose, monkeypatch):
    monkeypatch.setattr(selection, "find_spec", lambda name: None)
    with pytest.warns(mbody.errors.ModelWarning, match=r"plain Python, some thousand times slower"):
        assert choose().name == "plain"
    with pytest.raises(ModelError, match="numba is not installed"):
        choose(MBODY_CORE="numba")


def test_without_a_folder_numba_is_next(choose, monkeypatch):
    monkeypatch.setattr(selection, "cache_folder", lambda stamp: None)
    found = choose()
    assert found.name == "numba" and "no folder to keep it" in found.reason


def test_levels_are_those_of_the_processor(monkeypatch):
    names = [level.name for level in best_levels()]
    assert names == sorted(names, reverse=True)
    monkeypatch.setenv("MBODY_CORE_LEVEL", "x86-64-v9")
    with pytest.raises(ModelError, match="MBODY_CORE_LEVEL=x86-64-v9 is none of the levels"):
        list(best_levels())
    monkeypatch.setenv("MBODY_CORE_LEVEL", "x86-64-v3")
    monkeypatch.setattr(library.sys, "platform", "linux")
    monkeypatch.setattr(library.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(library, "processor_features", lambda: frozenset({"SSE42"}))
    with pytest.raises(ModelError, match="this processor has no AVX2, FMA3: choose a lower level"):
        list(best_levels())


# -- libraries --------------------------------------------------------------------------------


@pytest.fixture
def made():
    """A kernel that was built on this machine."""
    if chosen().file is None or chosen().library is not None:
        pytest.skip("kernels are not made here")
    mbody.kinetostatics(gallery.load("norton_fourbar"))
    return chosen().file / "positions.so"


def test_a_library_of_other_sources_is_refused(made):
    assert open_library(made, source_hash()).entries()["kernels"]["follow"] == [
        ["L: Layout", "W: Work", "path: DrivenPath", "found: PathOutput"],
        ["int"],
    ]
    with pytest.raises(LibraryError, match="was made from other sources"):
        open_library(made, 64 * "0")


@pytest.mark.parametrize("damage", ["short", "text", "empty"])
def test_a_damaged_library_is_refused(made, tmp_path, damage):
    file = tmp_path / "positions.so"
    whole = made.read_bytes()
    file.write_bytes({"short": whole[: len(whole) // 2], "text": b"kernel", "empty": b""}[damage])
    with pytest.raises(LibraryError, match="is damaged"):
        open_library(file, source_hash())


def test_the_library_of_the_package_is_taken_if_it_fits(choose, made, tmp_path, monkeypatch):
    """Else the next best, and why is said; a library of an installed mbody is tried first."""
    level = next(iter(best_levels()))
    folder = tmp_path / "core_libraries"
    folder.mkdir()
    shutil.copy(made, folder / level.file)
    monkeypatch.setattr(selection, "PACKAGE", tmp_path)
    found = choose()
    assert found.reason == "the library of the package"
    assert found.file == folder / level.file and found.level == level.name
    (folder / level.file).unlink()  # it is open: its pages must not change
    (folder / level.file).write_bytes(b"no library")
    found = choose()
    assert found.name == "native" and found.library is None
    assert f"{level.file} is damaged" in found.reason
    monkeypatch.setattr(selection, "source_hash", lambda: 64 * "0")
    shutil.copy(made, folder / level.file)
    assert "was made from other sources" in choose().reason


@pytest.mark.slow
@built_here
def test_a_damaged_library_is_built_again(tmp_path):
    """In the folder of the cache, where a process may have been stopped by a full disk."""
    code = (
        "import mbody; from mbody.core.selection import chosen;"
        "from mbody.model.loads import Torque;"
        "from mbody.laws.kernels import thomas; import numpy as np;"
        "d = np.full(3, 2.0); r = np.ones((3, 1)); thomas(np.zeros(3), d, np.zeros(3), r);"
        "print(r.ravel().tolist(), chosen().file)"
    )
    settings = {"MBODY_CACHE_DIR": str(tmp_path), "MBODY_CORE": "native"}
    first = python(code, **settings)
    assert first.returncode == 0, first.stderr
    assert first.stdout.startswith("[0.5, 0.5, 0.5]")
    assert first.stderr == "mbody: building kernels of 'numbers' for this machine (once) ...\n"
    file = Path(first.stdout.split("] ")[1].strip()) / "numbers.so"
    assert python(code, **settings).stderr == ""
    file.write_bytes(b"half a file")
    again = python(code, **settings)
    assert again.stdout == first.stdout and "kernels of 'numbers'" in again.stderr


@built_here
def test_a_library_opened_by_others_takes_no_calls(tmp_path):
    """A second copy, whose names the whole process sees and whose door nobody has set: calls of
    users' functions went through it into nothing.
    """
    code = f"""
import ctypes, shutil
import numpy as np
import mbody
from mbody.core.selection import chosen
from mbody.gallery import load
from mbody.laws import Function
from mbody.laws.kernels import thomas
from mbody.model.loads import Torque

thomas(np.zeros(3), np.ones(3), np.zeros(3), np.ones((3, 1)))
copy = shutil.copy(chosen().file / "numbers.so", {str(tmp_path)!r})
other = ctypes.CDLL(copy, mode=ctypes.RTLD_GLOBAL)
swing = load("simple_pendulum")
swing.add(Torque("push", "pendulum", value=Function(lambda t: 1.0 + t * t)))
mbody.simulate(swing, 0.01)
print(ctypes.c_void_p.in_dll(other, "mbody_user_door").value)
"""
    done = python(code)
    assert (done.returncode, done.stdout.strip()) == (0, "None"), done.stderr


# -- calls ------------------------------------------------------------------------------------


@native
def test_a_kernel_refuses_arrays_of_another_kind():
    from mbody.laws.kernels import thomas

    good = [np.zeros(3), np.ones(3), np.zeros(3), np.ones((3, 1))]
    thomas(*good)
    for place, bad, what in (
        (0, np.zeros(3, dtype=np.float32), "float32 with 1 axes"),
        (1, np.ones(6)[::2], "not contiguous"),
        (3, np.ones(3), "float64 with 1 axes; it must be of float64 with 2 axes"),
    ):
        given = [*good]
        given[place] = bad
        with pytest.raises(TypeError, match=f"kernel thomas: .*{what}"):
            thomas(*given)
