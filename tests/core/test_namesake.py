"""Another distribution of the same import name is told of, by `mbody doctor` and by a warning."""

import sys

import pytest

from mbody.core import selection
from mbody.engines.mujoco import faulty_release
from mbody.errors import ModelWarning


def test_a_distribution_named_mbody_is_told_of(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    assert selection.namesake() is None
    (tmp_path / "mbody_planar-0.3.0.dist-info").mkdir()
    assert selection.namesake() is None
    (tmp_path / "mbody-0.1.0.dist-info").mkdir()
    assert "'mbody' 0.1.0 is installed in " in selection.namesake()
    with pytest.warns(ModelWarning, match="pip uninstall mbody"):
        selection.chosen.__wrapped__()


def test_releases_of_mujoco_with_a_known_fault():
    assert "4.0.0: its factorisation" in faulty_release("4.0.0") and faulty_release("4.0.1") == ""
