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
    "a section that is not there": lambda: report(four_bar(), ["joint"]),
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

SENTENCES = r"""
a report of what nothing moves | ModelError | a pendulum | 'a pendulum' has no driver, and no table [simulate]: there is nothing to report: drive a body, or say until when it moves (--to TIME)
a report of a name | ModelError | - | a report is of a mechanism or of what an analysis found, not of 'mud_pump'
a report of an assembly of a result | ModelError | - | a result has its assembly mode already: give the mechanism, or leave assembly out
a report of an assembly that swings | ModelError | - | an assembly mode is of driven analyses, and this is a free motion: leave it out, or choose instants
a section that is not there | ModelError | - | a report has no section 'joint': did you mean 'joints'? there are summary, comparison, sketch, inputs, method, mobility, links, joints, loads, plots, polar, freebody, energy, friction, shaking, checks, opinions, references, repeat
a report of a quantity that is not there | ModelError | - | measure 'C.force': there is no body 'C' (there are: 'ground', 'crank', 'rod', 'slider')
a report to a place that is none | ModelError | - | a path must be text or path-like, not 3
a report in a folder that is not there | ModelError | - | cannot write '/nowhere/a.html' (No such file or directory): choose a folder that exists and may be written to
a report in a format that is not there | ModelError | - | cannot write 'a.docx': a report is a file that ends in .html, .md, .tex or .pdf
a report of a motion at a place | UsageError | - | --to follows the free motion, --at and --over are driven: give one
a report whose pictures have no folder | ModelError | - | cannot make the folder 'a_figures' for the pictures (File exists): choose another name for the report
a report in PDF without typst | ModelError | - | a PDF needs typst, which is not installed: pip install typst, or write .html and print
"""
