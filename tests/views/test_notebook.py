"""What notebooks show: summaries and small pictures of mechanisms and results."""

import xml.etree.ElementTree as ElementTree

import pytest

import mbody


def machine():
    made = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    made.add(mbody.Gravity("gravity", y=-9.81))
    return made


def hanging():
    made = mbody.Mechanism("pendulum")
    made.add(mbody.Body("rod", mass=2.0, cg=(0.5, 0.0)), mbody.Revolute("O", "ground", "rod"))
    made.add(mbody.Gravity("gravity", y=-9.81))
    return made


@pytest.mark.parametrize(
    ("made", "words", "drawn"),
    [
        (machine, "[bodies.crank]", True),
        (lambda: mbody.assemble(machine()), "[bodies.crank]", True),
        (lambda: mbody.kinetostatics(machine()), "crank", True),
        (lambda: mbody.kinetostatics(machine(), turn=True), "crank", True),
        (lambda: mbody.equilibrium(hanging()), "rod", False),
        (lambda: mbody.modes(hanging()), "rod", False),
        (
            lambda: mbody.sweep(
                machine(), {"crank.mass": [1.0, 2.0]}, measure="peak(motor.effort)", turn=True
            ),
            "peak",
            False,
        ),
    ],
)
def test_a_notebook_shows_the_summary(made, words, drawn):
    page = made()._repr_html_()
    whole = ElementTree.fromstring(page)
    assert words in "".join(whole.find("pre").itertext())
    assert ("<svg" in page) == drawn
    assert "script" not in page


def test_what_has_no_summary_is_one_line():
    batch = mbody.kinetostatics(mbody.assemble(machine()).with_values({"crank.mass": [1.0, 2.0]}))
    page = batch._repr_html_()
    assert "2 designs" in page and "<svg" not in page
