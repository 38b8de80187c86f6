"""Other values of a file's parameters: plain numbers keep what the parameter measures."""

import math

import pytest

import mbody
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
