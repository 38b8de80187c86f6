"""How large model files may be: what is written is read, and whoever knows a file raises them."""

import subprocess
import sys

import pytest

import mbody
from mbody import Body, Gravity, Mechanism, ModelError, Revolute
from mbody.files.model import Limits
from tests.support.cases import first_fast
from tests.support.paths import ROOT


def chain(count):
    """Links that hang from each other, each with numbers of its own."""
    machine, end = Mechanism("chain"), "ground"
    for n in range(count):
        own = {"mass": 0.1 + n / 1000, "inertia": 0.01, "cg": (0.5, 0.0), "guess": n / 1000}
        points = {"A": (0.0, 0.0), "B": (1.0, 0.0)}
        machine.add(Body(f"link{n}", **own, points=points))
        machine.add(Revolute(f"pin{n}", end, f"link{n}.A"))
        end = f"link{n}.B"
    machine.add(Gravity("gravity", y=-9.81))
    return machine


@first_fast(("count", "ending"), [(2500, "toml"), (2500, "json"), (10_000, "json")], 1)
def test_long_chains_come_back(tmp_path, count, ending):
    machine, path = chain(count), tmp_path / f"chain.{ending}"
    mbody.save(machine, path)
    assert mbody.load(path) == machine


@pytest.mark.parametrize("limits", [Limits(size=5e4), Limits(values=1e3)])
def test_what_is_not_read_is_not_written(tmp_path, limits):
    machine, path = chain(300), tmp_path / "chain.toml"
    with pytest.raises(ModelError, match=r"'chain.toml'.* has more than .*else the file could be"):
        mbody.save(machine, path, limits=limits)
    assert not path.exists()
    mbody.save(machine, path)
    with pytest.raises(ModelError, match=r"has more than .*limits=mbody.files.model.Limits"):
        mbody.load(path, limits=limits)
    assert mbody.load(path, limits=limits.times(100)) == machine


def test_the_remedy_of_the_sentence_works(tmp_path):
    """The limits that it names are enough."""
    machine, path = chain(300), tmp_path / "chain.toml"
    mbody.save(machine, path)
    for key, most in (("size", 1e4), ("values", 1e3)):
        with pytest.raises(ModelError) as caught:
            mbody.load(path, limits=Limits(**{key: most}))
        named = str(caught.value).partition("limits=mbody.files.model.Limits(")[2].partition(")")[0]
        assert named.startswith(f"{key}=")
        mbody.load(path, limits=Limits(**{key: float(named.partition("=")[2])}))


def test_the_environment_raises_the_limits(tmp_path, monkeypatch):
    path = tmp_path / "chain.toml"
    mbody.save(chain(300), path)
    monkeypatch.setenv("MBODY_LIMITS", "1e-3")
    with pytest.raises(ModelError, match=r"has more than 0\.006 MB"):
        mbody.load(path)
    monkeypatch.setenv("MBODY_LIMITS", "10")
    mbody.load(path)


def test_a_hostile_file_of_any_size_is_refused_soon(tmp_path):
    """By its size on the disk, before it is read."""
    path = tmp_path / "huge.toml"
    with path.open("wb") as file:
        file.truncate(10**12)
    code = "import sys, mbody\ntry: mbody.load(sys.argv[1])\nexcept mbody.ModelError as e: print(e)"
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert "has more than 6 MB" in done.stdout
