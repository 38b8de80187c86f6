"""What is built says which step of how many is under way; the builder is a small program here."""

import sys
from types import SimpleNamespace

import pytest

import mbody
from mbody.core.libraries import by_library
from mbody.image import arena, fmu

NAMES = list(by_library(arena.IMAGE_KERNELS))
#: A builder that names each library of kernels and each file, as `mbody.compiler.builder` does.
BUILDER = """
import sys
folder, status, names, files = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4]
for name in names.split(","):
    print(name, flush=True)
for name in files.split(","):
    print(name, flush=True)
    open(f"{folder}/{name}", "wb").write(b"made")
print("warning: it is a small one", file=sys.stderr)
sys.exit(status)
"""


def builder(files, status=0):
    """The command that `builder_command` gives, of a builder that makes these files."""

    def command(names, target, folder, *options):
        words = [str(folder), str(status), ",".join(NAMES), ",".join(files)]
        return [sys.executable, "-c", BUILDER, *words], {}

    return command


@pytest.fixture(autouse=True)
def loud(monkeypatch, tmp_path):
    monkeypatch.setenv("MBODY_QUIET", "0")
    for module in (fmu, arena):
        monkeypatch.setattr(module, "find_spec", lambda name: SimpleNamespace(name=name))


def lines(names):
    return [f"building {name}, {n} of {len(names)}" for n, name in enumerate(names, 1)]


def test_the_core_for_browsers(monkeypatch, tmp_path, capfd):
    monkeypatch.setattr(arena, "builder_command", builder([arena.FILE]))
    monkeypatch.setattr(arena, "ready_core", lambda: None)
    monkeypatch.setattr(arena, "_core_folder", lambda: tmp_path)
    assert arena.browser_core().read_bytes() == b"made"
    said = ["building the core for browsers (once) ...", *lines([*NAMES, arena.FILE])]
    assert capfd.readouterr() == ("", "".join(f"mbody: {line}\n" for line in said))


def test_the_binaries_of_co_simulation_units(monkeypatch, tmp_path, capfd):
    files = [one.file for one in fmu.PLATFORMS]
    monkeypatch.setattr(fmu, "builder_command", builder(files))
    fmu._build(tmp_path)
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(files)
    what = "building the binaries of co-simulation units (once) ..."
    said = [what, *lines([*NAMES, *files])]
    assert capfd.readouterr() == ("", "".join(f"mbody: {line}\n" for line in said))


@pytest.mark.parametrize("module", [fmu, arena])
def test_what_the_builder_says_is_told_where_it_fails(monkeypatch, tmp_path, module):
    monkeypatch.setattr(module, "builder_command", builder(["half"], status=3))
    build = fmu._build if module is fmu else arena.build_browser_core
    with pytest.raises(mbody.ModelError, match=r"could not be built; .*\nwarning: it is a small"):
        build(tmp_path)
