"""Every row of every case holds, and the command says so."""

from __future__ import annotations

import importlib
import json
import pathlib

import pytest

import mbody
import validation
from validation.__main__ import main, table
from validation.case import KEYS, Row, Source, cases
from validation.newton_euler_matrix import sheet
from validation.norton_fourbar.newton_euler import UNKNOWNS


@pytest.mark.parametrize("name", cases())
def test_every_row_of_a_case_holds(name, capsys, monkeypatch):
    """And the table that the command prints of them fits a terminal."""
    rows = cases()[name]()
    assert rows and all(row.reason and row.source for row in rows)
    missed = [
        f"{row.quantity}: {row.ours} {row.unit}, must be {row.reference} ({row})"
        for row in rows
        if not row.passed
    ]
    assert not missed, "\n".join(missed)
    monkeypatch.setattr("validation.__main__.cases", lambda: {name: lambda: rows})
    assert main([]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 120


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
    assert all(tuple(row) == KEYS for row in rows)
    miss = Row("x", "x", 1.0, 2.0, 1.0, 0.5, "none", "none")
    monkeypatch.setattr("validation.__main__.cases", lambda: {"x": lambda: [miss]})
    assert main([]) == 1
    assert "MISS" in capsys.readouterr().out


def test_a_wrong_print_shows_its_cause():
    book = Source("here", "a book")
    row = book.printed("x", 1.98, "2.00", "m", tolerance=0.05, reason="so much", cause="a misprint")
    right = book.absolute("y", [1.25, 10.0], [1.25, 10.0], 0.0, "exact", "m")
    assert row.record()["reason"] == "so much; a misprint"
    assert right.record()["reason"] == "exact"
    assert table([row, right, row]).splitlines() == [
        "quantity  ours  reference     error    tolerance",
        "──────────────────────────────────────────────────",
        "",
        "a book",
        "  x       1.98  2.00       m  2.0e-02  5.0e-02  ok",
        "  x       1.98  2.00       m  2.0e-02  5.0e-02  ok",
        "      tolerance: so much",
        "      cause: a misprint",
        "  y       1.25  1.25       m  0.0e+00  0.0e+00  ok",
        "      tolerance: exact",
    ]


def test_the_sheet_of_nine_equations():
    lines = sheet().splitlines()
    assert lines[2].split() == [*UNKNOWNS, "b"]
    torque = next(line for line in lines if line.startswith("T of link 2"))
    assert torque.split()[-2] == "1.0000"
    assert lines[-1].split()[-1] == "243.2376"
