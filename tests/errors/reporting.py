"""Reports: what they contain, and where they are written to."""

import contextlib
import sys
import tempfile
from pathlib import Path
from unittest import mock

from mbody import Body, Mechanism, Revolute, gallery, report
from tests.errors.command import said
from tests.errors.engines import turn
from tests.errors.models import four_bar
from tests.errors.results import batch, motion


def without_typst():
    with mock.patch.dict(sys.modules, typst=None):
        made().save("pump.pdf")


def made():
    return report(four_bar(), ["joints"])


def loose():
    machine = Mechanism("a pendulum")
    machine.add(Body("bob", mass=1.0), Revolute("O", "ground", "bob"))
    return machine


def into_a_file():
    """A file where the folder of pictures is to be."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("a_figures").write_text("a file")
        report(four_bar(), ["sketch"]).save("a.md")


SCENARIOS = {
    "a report of what nothing moves": lambda: report(loose()),
    "a report of a name": lambda: report("mud_pump"),  # type: ignore[arg-type]
    "a report of an assembly of a result": lambda: report(turn(), assembly="open"),
    "a report of an assembly that swings": said(
        ["report", "double_pendulum", "--assembly", "1", "-o", "none.html"]
    ),
    "a report of kinematics": lambda: report(motion()),
    "a report of a batch": lambda: report(batch()),
    "a section that is not there": lambda: report(four_bar(), ["joint"]),
    "a section like no other": lambda: report(four_bar(), ["weather"]),
    "a report of a quantity that is not there": lambda: report(
        gallery.load("slider_crank"), plots=["C.force"]
    ),
    "a report to a place that is none": lambda: made().save(3),  # type: ignore[arg-type]
    "a report in a folder that is not there": lambda: made().save("/nowhere/a.html"),
    "a report in a format that is not there": said(["report", "hoekens", "-o", "a.docx"]),
    "a report of a motion at a place": said(["report", "hoekens", "--to", "1", "--at", "crank=3"]),
    "a report whose pictures have no folder": into_a_file,
    "a report in PDF without typst": without_typst,
}
