"""Measures and derivatives for many sets of numbers: as `gradient` of a system of each."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import mbody
from mbody.derivatives.fit_problem import PreparedGradient

MEASURES = {
    "pin": "peak(A.force)",
    "torque": "rms(motor.effort)",
    "least": "min(abs(sin(coupler.angle - rocker.angle)))",
    "load": "at(F_P.fx, 3)",
    "power": "last(motor.power)",
    "place": "max(coupler.P.y - 2*ground.O4.y)",
}
BY = ["crank.A.x", "coupler.B.x", "coupler.weight", "T_4", "F_P.angle", "motor.law.speed"]


@pytest.fixture(scope="module")
def norton():
    return mbody.assemble(mbody.gallery.load("norton_fourbar"))


def agrees(prepared, numbers, measures, by, system, **options):
    design = prepared.at(numbers)
    again = system.with_values(dict(zip(prepared.names, numbers, strict=True)))
    found = mbody.gradient(again, measures, by, **options)
    np.testing.assert_allclose(design.value, np.array(list(found.value.values())), rtol=1e-13)
    scale = np.abs(found.jacobian).max(initial=0.0)
    np.testing.assert_allclose(design.jacobian, found.jacobian, rtol=1e-12, atol=1e-13 * scale)
    return design


@pytest.mark.parametrize("factor", [1.0, 1.03, 0.98])
def test_every_reduction_as_by_gradient(norton, factor):
    prepared = PreparedGradient(norton, MEASURES, BY, turn="motor", instants=25)
    assert prepared.measures == tuple(MEASURES)
    agrees(prepared, factor * prepared.start, MEASURES, BY, norton, turn="motor", instants=25)


def test_many_designs_by_one_preparation_do_not_change_each_other(norton):
    prepared = PreparedGradient(norton, "peak(A.force)", BY, turn="motor", instants=25)
    first = prepared.at(prepared.start)
    value, jacobian = first.value.copy(), first.jacobian.copy()
    other = prepared.at(1.02 * prepared.start)
    assert other.value != value
    np.testing.assert_array_equal(prepared.at(prepared.start).value, value)
    np.testing.assert_array_equal(prepared.at(prepared.start).jacobian, jacobian)
    np.testing.assert_array_equal(first.run.measure("A.force").max(), value[0])
    assert float(norton.values["crank.A.x"]) == prepared.start[0]


def test_parameters_and_more_numbers_than_a_pass_has():
    system = mbody.assemble(mbody.gallery.load("hoekens"))
    fixed = system.mechanism.fixed_parameters
    by = [name for name in system.mechanism.parameters if name not in fixed]
    by = [name for name in by if name not in system.formulas]
    body = system.mechanism.bodies[0].name
    prepared = PreparedGradient(system, f"max({body}.x)", by, t=[0.0, 0.1])
    agrees(prepared, 1.01 * prepared.start, f"max({body}.x)", by, system, t=[0.0, 0.1])
    norton = mbody.assemble(mbody.gallery.load("norton_fourbar"))
    prepared = PreparedGradient(norton, "last(A.fx)", None)
    assert len(prepared.names) > 30
    agrees(prepared, prepared.start, "last(A.fx)", None, norton)


def test_threads_do_not_share_a_workspace(norton):
    prepared = PreparedGradient(norton, "peak(A.force)", BY, turn="motor", instants=25)
    numbers = [factor * prepared.start for factor in np.linspace(0.98, 1.02, 40)]
    wanted = [prepared.at(one).jacobian for one in numbers]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda one: prepared.at(one).jacobian, numbers))
    np.testing.assert_array_equal(found, wanted)


def test_numbers_that_a_measure_reads():
    """A parameter and a coordinate in a formula, of more numbers than a pass has."""
    system = mbody.assemble(mbody.gallery.load("norton_fourbar"))
    measure = "last(coupler.P.y + 2*F_P.fx*1 in/1 lbf)"
    prepared = PreparedGradient(system, [measure], None)
    agrees(prepared, prepared.start, [measure], None, system)
