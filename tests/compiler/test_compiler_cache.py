"""The disk cache of compiled code, and its folders.

The cache is tried in processes of their own, on a small package made of the modules below it.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import mbody
import mbody.core.selection as folder_of
from mbody.core.selection import STAMP_DIGITS

pytestmark = pytest.mark.numba

SOURCES = {
    "__init__": "from mbody.core import registered\n"
    'registered.compiler = "mbody.compiler.install"\n',
    "kernels/__init__": '"""Kernels."""\n',
    "kernels/helper": """\
        from mbody.core.decorators import inline
        FACTOR = 2.0
        @inline
        def scaled(x):
            return FACTOR * x
        """,
    "kernels/trial": """\
        from __future__ import annotations
        from mbody.core.decorators import kernel, njit
        from mbody.core.lanes import ld, sincos, st, wide
        from mbody.core.bundle import Bundle, Rows
        from mbody.core.callbacks import call_user
        from mbody.kernels.helper import scaled

        class Work(Bundle):
            rows: Rows
            more: Rows

        @kernel
        def turn(work, extra):
            w = wide()
            sine, cosine = sincos(scaled(ld(work.rows, 0, w)))
            st(work.rows, 1, sine, w)
            if extra is not None:
                st(work.rows, 1, cosine, extra)

        @njit
        def ask(handle, x, y):
            return call_user(handle, x, y)
        """,
}

#: Two functions of one factory; each process numbers those that it compiles from one on.
SOURCES["kernels/factory"] = """\
    from mbody.core.decorators import kernel, njit

    def multiplied(factor):
        @njit(cache=False)
        def made(x):
            return factor * x
        return made

    twice, thrice = multiplied(2.0), multiplied(3.0)

    @njit
    def first(x):
        return twice(x)

    @njit
    def second(x):
        return thrice(x)

    @kernel
    def one(x: float) -> float:
        return first(x)

    @kernel
    def two(x: float) -> float:
        return second(x)

    @kernel
    def both(x: float) -> float:
        return first(x) + second(x)
    """

RUN = """\
    import json
    import numpy as np
    from mbody.compiler import jit
    from mbody.compiler.cache import numba_folder
    from mbody.core.lanes import LANES, aligned
    from mbody.core.callbacks import failure, register
    from mbody.kernels.trial import Work, ask, turn

    work = Work(rows=aligned(2, LANES), more=aligned(2, LANES))
    work.rows[0] = 0.25
    turn(work, None)

    def good(x, y):
        y[:] = 2.0 * x
    def bad(x, y):
        y[:] = 7.0
        raise SystemExit(3)

    x, y = np.arange(3.0), np.zeros(3)
    good, bad = register(good), register(bad)
    statuses = [ask(good, x, y), ask(bad, x, y)]
    found = failure()
    folder = numba_folder()
    print(json.dumps({
        "sine": work.rows[1].tolist(), "y": y.tolist(), "statuses": statuses,
        "failure": [found[0] - bad, repr(found[1])], "left": repr(failure()),
        "folder": None if folder is None else str(folder), "compiled": jit.compilations(),
    }))
    """


def _dedent(text):
    lines = text.splitlines()
    margin = len(lines[0]) - len(lines[0].lstrip())
    return "\n".join(line[margin:] for line in lines) + "\n"


class Place:
    """A copy of the modules with a small kernel, and processes that run it."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.package = root / "site" / "mbody"
        (self.package / "kernels").mkdir(parents=True)
        compiler = shutil.ignore_patterns("__pycache__")
        whole = Path(mbody.__file__).parent
        for part in ("compiler", "core"):
            shutil.copytree(whole / part, self.package / part, ignore=compiler)
        shutil.copy(whole / "errors.py", self.package)
        for name, text in SOURCES.items():
            (self.package / f"{name}.py").write_text(_dedent(text))

    def process(self, code: str, **environment: str) -> subprocess.CompletedProcess[str]:
        variables = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("MBODY_", "NUMBA_", "XDG_"))
        }
        variables |= {
            "MBODY_CORE": "numba",
            "PYTHONPATH": str(self.package.parent),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        variables |= {"MBODY_CACHE_DIR": str(self.root / "cache")} | environment
        done = subprocess.run(
            [sys.executable, "-c", _dedent(code)],
            env=variables,
            cwd=self.root,
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.returncode == 0, done.stderr
        return done

    def run(self, **environment: str):
        done = self.process(RUN, **environment)
        result = json.loads(done.stdout)
        result["stderr"] = done.stderr
        np.testing.assert_allclose(result["y"], [0.0, 2.0, 4.0])
        assert result["statuses"] == [0, 1]
        assert result["failure"] == [0, "SystemExit(3)"]
        assert result["left"] == "None"
        return result


@pytest.fixture(scope="module")
def warm(tmp_path_factory):
    """A place where one process has compiled everything."""
    place = Place(tmp_path_factory.mktemp("warm"))
    result = place.run()
    assert result["compiled"] > 0
    assert result["stderr"].startswith("mbody: compiling kernels for this machine (once")
    assert result["stderr"].count("\n") == 1
    np.testing.assert_allclose(result["sine"], np.sin(0.5), rtol=1e-15)
    return place


def test_a_second_process_compiles_nothing(warm):
    result = warm.run()
    assert result["compiled"] == 0
    assert result["stderr"] == ""
    assert Path(result["folder"]).parent == warm.root / "cache"
    np.testing.assert_allclose(result["sine"], np.sin(0.5), rtol=1e-15)


def test_a_changed_interface_of_numba_costs_only_time(warm):
    code = """\
        import sys
        sys.modules["mbody.compiler.linking"] = None
        """
    done = warm.process(_dedent(code) + _dedent(RUN), MBODY_CACHE_DIR=str(warm.root / "plainly"))
    result = json.loads(done.stdout)
    assert result["compiled"] > 0
    np.testing.assert_allclose(result["sine"], np.sin(0.5), rtol=1e-15)


SYMBOLS = """\
    from mbody.kernels import factory
    value = factory.{0}(1.0)
    for one in (factory.first, factory.second):
        for found in one.overloads.values():
            print(*(named.name for named in found.library._get_module_for_linking().functions))
    print(value)
    """


def test_functions_of_one_factory_stay_apart_across_processes(warm, tmp_path):
    """Each compiled by a process of its own, kept on disk and linked by a third process.

    With one symbol for both the linker keeps either of them, now and then the right one.
    """
    folder = {"MBODY_CACHE_DIR": str(tmp_path / "cache")}
    names = ("one", "two", "both")
    found = [warm.process(SYMBOLS.format(name), **folder).stdout.split() for name in names]
    assert [symbols.pop() for symbols in found] == ["2.0", "3.0", "5.0"]
    first, second, both = map(set, found)
    assert len(first) == len(second) == 2 and not first & second
    assert both == first | second


def test_an_edit_in_another_file_is_seen(warm):
    helper = warm.package / "kernels" / "helper.py"
    before = helper.read_text()
    helper.write_text(before.replace("2.0", "4.0"))
    result = warm.run(MBODY_QUIET="1")
    np.testing.assert_allclose(result["sine"], np.sin(1.0), rtol=1e-15)
    assert result["compiled"] > 0
    assert result["stderr"] == ""
    helper.write_text(before)
    result = warm.run()
    np.testing.assert_allclose(result["sine"], np.sin(0.5), rtol=1e-15)
    assert result["compiled"] == 0


def test_damaged_files_are_compiled_anew(warm, tmp_path):
    shutil.copytree(warm.root / "cache", tmp_path / "cache")
    for path in (tmp_path / "cache").rglob("*.nb[ci]"):
        path.write_bytes(path.read_bytes()[:40])
    result = warm.run(MBODY_CACHE_DIR=str(tmp_path / "cache"))
    assert result["compiled"] > 0
    np.testing.assert_allclose(result["sine"], np.sin(0.5), rtol=1e-15)


def test_two_processes_may_compile_at_once(warm, tmp_path):
    folder = str(tmp_path / "cache")
    with ThreadPoolExecutor() as pool:
        runs = [pool.submit(warm.run, MBODY_CACHE_DIR=folder) for _ in range(2)]
    for run in runs:
        np.testing.assert_allclose(run.result()["sine"], np.sin(0.5), rtol=1e-15)
    result = warm.run(MBODY_CACHE_DIR=folder)
    assert result["compiled"] == 0
    np.testing.assert_allclose(result["sine"], np.sin(0.5), rtol=1e-15)


def test_without_any_folder_everything_still_works(warm):
    # A path below a file cannot be made by anybody; permissions would not stop root.
    file = warm.root / "file"
    file.write_text("")
    names = ("MBODY_CACHE_DIR", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "TMPDIR", "TEMP", "TMP")
    nowhere = dict.fromkeys(names, str(file / "below"))
    code = """\
        import tempfile
        tempfile.tempdir = "/dev/null/below"
        """
    done = warm.process(_dedent(code) + _dedent(RUN), HOME=os.devnull, **nowhere)
    result = json.loads(done.stdout)
    assert result["folder"] is None
    assert result["compiled"] > 0
    assert "no folder" in done.stderr
    np.testing.assert_allclose(result["sine"], np.sin(0.5), rtol=1e-15)


@pytest.mark.skipif(os.name == "nt", reason="needs interval timers")
def test_an_interrupt_at_the_door_is_kept(warm):
    # Python looks for signals before the first line of a function: there none can catch it.
    code = """\
        import signal
        import numpy as np
        from mbody.core.decorators import njit
        from mbody.core.callbacks import call_user, failure, register

        @njit(cache=False)
        def spin(n, handle, x, y):
            for i in range(n):
                x[0] = np.sqrt(x[0] + i)
            return call_user(handle, x, y)

        def stop(*_):
            raise KeyboardInterrupt

        calls = []
        handle, x, y = register(lambda x, y: calls.append(x)), np.zeros(1), np.zeros(1)
        spin(1, handle, x, y)
        signal.signal(signal.SIGALRM, stop)
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        print(spin(50_000_000, handle, x, y), len(calls), repr(failure(handle)[1]))
        """
    assert warm.process(code).stdout.strip() == "1 1 KeyboardInterrupt()"


@pytest.fixture
def folders(monkeypatch, tmp_path):
    """Environment without any of the variables, and a home and a temporary folder of its own."""
    for name in ("MBODY_CACHE_DIR", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    home, temporary = tmp_path / "home", tmp_path / "temporary"
    home.mkdir()
    temporary.mkdir()
    monkeypatch.setattr(Path, "home", lambda: home)
    monkeypatch.setattr(folder_of.tempfile, "gettempdir", lambda: str(temporary))
    return tmp_path


STAMP = STAMP_DIGITS * "a"


def _folder():
    return folder_of.cache_folder.__wrapped__(STAMP)


def test_order_of_folders(folders, monkeypatch):
    name = STAMP
    assert _folder() == folders / "home" / ".cache" / "mbody" / name
    monkeypatch.setenv("XDG_CACHE_HOME", str(folders / "xdg"))
    assert _folder() == folders / "xdg" / "mbody" / name
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folders / "numba"))
    assert _folder() == folders / "numba" / "mbody" / name
    monkeypatch.setenv("MBODY_CACHE_DIR", str(folders / "own"))
    assert _folder() == folders / "own" / name
    (folders / "file").write_text("")
    for variable in ("MBODY_CACHE_DIR", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.setenv(variable, str(folders / "file" / "below"))
    found = _folder()
    assert found.parent.parent == folders / "temporary"
    if os.name != "nt":
        assert found.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.skipif(os.name == "nt", reason="no such permissions")
def test_a_temporary_folder_prepared_by_others_is_not_used(folders, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", os.devnull)
    prepared = folders / "temporary" / f"mbody-{os.getuid()}"
    prepared.mkdir(mode=0o777)
    prepared.chmod(0o777)
    assert _folder() is None
    prepared.rmdir()
    (folders / "elsewhere").mkdir(mode=0o700)
    prepared.symlink_to(folders / "elsewhere")
    assert _folder() is None
    prepared.unlink()
    prepared.mkdir(mode=0o700)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert _folder() is None


def test_folders_of_versions_long_unused_are_removed(folders, monkeypatch):
    monkeypatch.setenv("MBODY_CACHE_DIR", str(folders / "own"))
    old, recent, other = (folders / "own" / name for name in ("0" * 32, "1" * 32, "notes"))
    for folder in (old, recent, other):
        folder.mkdir(parents=True)
        (folder / "file").write_text("")
        if folder is not recent:
            os.utime(folder, (time.time() - 40 * 86400,) * 2)
    _folder()
    assert not old.exists()
    assert recent.exists()
    assert other.exists()
