"""Other values of a file's parameters: plain numbers keep what the parameter measures."""

import json
import math

import numpy as np
import pytest

import mbody
from mbody import cli
from mbody.model.model_notes import with_numbers
from mbody.quantities import convert

PARAMETERS = """
units = "{units}"
[parameters]
r   = "0.2 m"
phi = "30 deg"
k   = "20 N/m"
n   = 3
m   = "3 kg"
[bodies.arm]
mass   = "m"
points = {{ P = ["n*r", 0] }}
guess  = "phi"
[joints]
O = {{ revolute = ["ground", "arm"] }}
[loads]
s = {{ spring = ["ground", "arm.P"], stiffness = "2*k + 20 N/m" }}
"""


@pytest.mark.parametrize("units", ["SI", "mm-N-s", "in-lbf-s"])
@pytest.mark.parametrize("as_text", [False, True])
def test_a_plain_value_keeps_what_its_parameter_measures(units, as_text):
    """By hand: plain numbers are in the file's units, plain angles in degrees."""
    given = {"r": 0.25, "phi": 40, "k": 5, "n": 2, "m": 7.0}
    found = {key: str(value) for key, value in given.items()} if as_text else given
    machine = mbody.from_toml(PARAMETERS.format(units=units), parameters=found)
    stiff = convert(20.0, "N/m", machine.units.of("stiffness"))
    assert machine["arm"].points["P"][0] == 0.5
    assert machine["arm"].guess.angle == pytest.approx(math.radians(40.0), rel=1e-15)
    assert machine["arm"].mass == 7.0
    assert machine["s"].stiffness == pytest.approx(10.0 + stiff, rel=1e-14)
    assert mbody.from_toml(mbody.to_toml(machine)) == machine
    # with a unit it is what it says
    other = mbody.from_toml(PARAMETERS.format(units=units), parameters={"r": "1 ft"})
    foot = convert(1.0, "ft", machine.units.length)
    assert other["arm"].points["P"][0] == pytest.approx(3.0 * foot, rel=1e-14)


@pytest.mark.parametrize(
    "name", ["norton_fourbar", "hoekens", "cam_follower", "braking_vehicle", "free_fourbar"]
)
def test_a_mechanism_with_another_number_is_the_system_with_it(name):
    """Every number that a sweep may change, but those of compiled formulas; by `with_values`."""
    machine = mbody.gallery.load(name)
    system = mbody.assemble(machine)
    tried = refused = 0
    for number, old in system.values.items():
        if number in machine.parameters or number.startswith(
            ("ground.mass", "ground.inertia", "ground.cg")
        ):
            continue
        new = 1.01 * float(old) if old else 0.01
        try:
            wanted = system.with_values({number: new}).values
            found = mbody.assemble(with_numbers(machine, {number: new})).values
        except mbody.ModelError as error:
            assert "made of other numbers" in str(error) or "is used in" in str(error)
            refused += 1
            continue
        tried += 1
        # the same arithmetic but for the order of sums
        np.testing.assert_allclose([found[k] for k in wanted], list(wanted.values()), rtol=1e-14)
    assert tried > 2 * refused


def test_a_question_by_options_is_answered_by_the_number_that_set_takes(capsys):
    """The torque that balances the motor; set to it, the analysis finds no effort."""
    words = ["norton_fourbar", "--at", "crank=75", "--json"]
    asked = ["--unknowns", "T_4", "--conditions", "motor.effort = 0"]
    assert cli.main(["solve", *words, *asked]) == 0
    (case,) = json.loads(capsys.readouterr().out)["cases"].values()
    (answer,) = case["solutions"]
    torque = answer["unknowns"]["T_4"]
    efforts = []
    for value in (torque, 0.0):
        assert cli.main(["kinetostatics", *words, "--set", f"T_4={value!r}"]) == 0
        efforts.append(json.loads(capsys.readouterr().out)["efforts"]["motor"][0])
    # rounding of a solve whose condition is 70
    assert abs(efforts[0]) < 1e-12 * abs(efforts[1])


def test_set_takes_every_number_that_vary_takes(capsys):
    """A length, a law's number, a load by its own name: as a sweep of one design."""
    for name, value in {"crank.A.x": "4 in", "motor.law.speed": "120 rpm", "T_4": "50"}.items():
        words = ["norton_fourbar", "--at", "crank=60", "--json"]
        assert cli.main(["kinetostatics", *words, "--set", f"{name}={value}"]) == 0
        found = json.loads(capsys.readouterr().out)["measures"]["T12"]
        more = ["--vary", f"{name}={value}", "--measure", "first(motor.effort)"]
        assert cli.main(["sweep", *words, *more]) == 0
        columns = json.loads(capsys.readouterr().out)["columns"]
        # both close to the tolerance of positions
        assert columns["first(motor.effort)"] == pytest.approx(found, rel=1e-10)
