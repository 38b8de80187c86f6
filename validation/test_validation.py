"""Every row of every case is a test."""

from __future__ import annotations

import importlib
import json
import pathlib

import pytest

import mbody
import validation
from validation.__main__ import main
from validation.case import Row, Source, cases


def collected() -> list:
    """All rows; a case that fails to run is one failing test."""
    found = []
    for name, rows in cases().items():
        try:
            found += [pytest.param(row, id=f"{name}: {row.quantity}") for row in rows()]
        except Exception as error:
            found.append(pytest.param(error, id=name))
    return found


@pytest.mark.parametrize("row", collected())
def test_row(row):
    if isinstance(row, Exception):
        raise row
    assert row.reason and row.source
    assert row.passed, f"{row.quantity}: {row.ours} {row.unit}, must be {row.reference} ({row})"


@pytest.mark.parametrize("name", cases())
def test_case_has_its_model_and_its_source(name):
    text = (pathlib.Path(validation.__path__[0]) / name / "SOURCE.md").read_text("utf-8")
    module = importlib.import_module(f"validation.{name}")
    assert isinstance(module.build(), mbody.Mechanism)
    for word in ("Printed", "Recomputed", "Assumed"):
        assert f"**{word}**" in text


def test_a_miss_is_a_miss():
    book = Source("here", "a book")
    assert book.printed("x", 1.994, "2.00").passed and not book.printed("x", 1.98, "2.00").passed
    assert book.printed("x", 2191.9, "2191").tolerance == 1.0
    assert not book.absolute("x", float("nan"), 1.0, 1.0, "none").passed
    assert not book.relative("x", [1.0, 3.0], [1.0, 2.0], 0.49, "none").passed


def test_command(capsys, monkeypatch):
    assert main(["rotating_mass", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert rows and all(row["passed"] for row in rows)
    miss = Row("x", "x", 1.0, 2.0, 1.0, 0.5, "none", "none")
    monkeypatch.setattr("validation.__main__.cases", lambda: {"x": lambda: [miss]})
    assert main([]) == 1
    assert "MISS" in capsys.readouterr().out
