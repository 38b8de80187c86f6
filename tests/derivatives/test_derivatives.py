"""Exact derivatives: against a complex step of dense equations, against differences of eight
places, and against each other.
"""

import numpy as np
import pytest

import mbody
from mbody.core.lanes import DualNumber
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.dual_solution import (
    checked_names,
    dual_values,
    number_tangents,
    tangents_by_elements,
)
from tests.support.cases import first_fast
from tests.support.differences import difference
from tests.support.frictional import slider_crank

#: Peak of the force at A of Norton's four-bar over 361 instants of a turn, and its derivatives: a
#: complex step of 1e-30 through dense equations in nine coordinates (numpy.linalg.solve), that
#: share no code with mbody; lbf per in, rad, lbf·in, lbf, lbf·in·s².
PEAK, PEAK_INSTANT = 169.53048579773343, 120
PEAK_BY = {
    "ground.O4.x": 170.14340503341842,
    "crank.A.x": 187.5088943047074,
    "coupler.B.x": -174.99061181996078,
    "rocker.B.x": -174.6955270419443,
    "coupler.cg.r": 0.44197114699116874,
    "coupler.cg.angle": -47.43735259262532,
    "T_4.value": 0.18246674421718817,
    "coupler.weight": 2.088329442174288,
    "rocker.weight": 3.9023355582249413,
    "coupler.inertia": 20.689587200095325,
    "rocker.inertia": 60.252061018993096,
    "F_P.value": 0.37105954917358364,
}
#: Differences of eight places have an error of some 1e-16/1e-3 of the greatest number, times what
#: the position does to it: figures of the models below are 1e-12 to 1e-9.
BY_DIFFERENCES = 1e-8
GALLERY = (
    *("norton_fourbar", "slider_crank", "quick_return", "watt_sixbar", "stephenson_sixbar"),
    *("hoekens", "mud_pump", "mud_pump_sixbar", "planetary_train", "cam_follower"),
    *("scissor_lift", "peaucellier"),
)


@pytest.fixture(scope="module")
def norton():
    return mbody.gallery.load("norton_fourbar")


def test_peak_of_a_pin_force_as_by_a_complex_step(norton):
    found = mbody.gradient(norton, {"pin": "peak(A.force)"}, list(PEAK_BY), turn="motor")
    assert found.value["pin"] == pytest.approx(PEAK, rel=1e-13)
    turn = mbody.kinetostatics(norton, turn="motor")
    assert found.at["pin"] == turn.t[PEAK_INSTANT]
    greatest = max(map(abs, PEAK_BY.values()))
    for name, exact in PEAK_BY.items():
        assert found["pin"][name] == pytest.approx(exact, rel=1e-12, abs=1e-15 * greatest), name
    assert not found.notes


@first_fast("model", GALLERY, 3)
def test_gallery_against_differences(model):
    """All numbers of the motion and of all reactions, by all numbers of the description."""
    system, t = mbody.assemble(mbody.gallery.load(model)), np.array([0.013, 0.0467])
    run = mbody.kinetostatics(system, t=t)
    names = [
        name
        for name in checked_names(system, None)
        if not (system.rule(name)[0] and system.values[name] == 0.0)
    ]
    check(system, run, mbody.kinetostatics, names)


def check(system, run, analysis, names):
    instants = DrivenInstants(run, names)
    found = instants.at(np.arange(len(run.t)), False).record.tangents[:, : system.record_rows]
    n = 3 * system.coordinates
    worst = {}
    for k, name in enumerate(names):
        if name in instants.unclosed:
            continue
        numeric = difference(system, name, analysis, run.t)
        table = run.record.table(slice(None))
        size = abs(float(system.values[name])) or system.length
        for part in (slice(0, n // 3), slice(n // 3, 2 * n // 3), slice(2 * n // 3, n)):
            worst[name, part.start] = off(found[:, part, k], numeric[:, part], table[:, part], size)
        forces = slice(n, system.record_rows)
        worst[name, n] = off(found[:, forces, k], numeric[:, forces], table[:, forces], size)
    bad = {key: value for key, value in worst.items() if not value < BY_DIFFERENCES}
    assert not bad


def off(exact, numeric, table, size):
    """The greatest difference, beside the greatest derivative and the greatest number by size."""
    scale = max(np.abs(numeric).max(initial=0.0), np.abs(table).max(initial=0.0) / size, 1e-300)
    return float(np.abs(exact - numeric).max(initial=0.0) / scale)


def test_friction_is_differentiated():
    system = mbody.assemble(slider_crank(0.1, masses=(1.0, 2.0, 3.0), length=0.1))
    t = np.array([0.02, 0.31])
    run = mbody.kinetostatics(system, t=t)
    names = ["crank.A.x", "rod.mass", "load.value", "A.friction", "A.pin_radius", "motor.law.speed"]
    check(system, run, mbody.kinetostatics, names)


@pytest.mark.parametrize("model", ["norton_fourbar", "mud_pump", "cam_follower", "hoekens"])
def test_recorded_numbers_are_those_of_the_elements(model):
    """The recorded operations and the elements' own Python give the same derivatives."""
    system = mbody.assemble(mbody.gallery.load(model))
    names = list(checked_names(system, None))
    recorded = number_tangents(system, names)
    plain = tangents_by_elements(system, dual_values(system, names), len(names))
    for a, b in zip(recorded, plain, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-14, atol=1e-300)
    other = system.with_values({names[-1]: 1.25 * float(system.values[names[-1]]) + 0.125})
    again = number_tangents(other, names)
    plain = tangents_by_elements(other, dual_values(other, names), len(names))
    for a, b in zip(again, plain, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-14, atol=1e-300)


def test_means_over_a_turn_by_the_speed_of_its_law(norton):
    """Instants at equal angles move in time with the numbers of the law."""
    measures = {"torque": "rms(motor.effort)", "power": "mean(motor.power)", "t": "last(t)"}
    names = ["motor.law.speed", "motor.law.acceleration", "crank.A.x"]
    found = mbody.gradient(norton, measures, names, turn="motor", instants=25)
    system = mbody.assemble(norton)
    for name in names:
        value, step = float(system.values[name]), 1e-3 * abs(float(system.values[name]))
        ends = []
        for way in (-2.0, -1.0, 1.0, 2.0):
            other = system.with_values({name: value + way * step})
            run = mbody.kinetostatics(other, turn="motor", instants=25)
            whole = run.t[-1] - run.t[0]
            torque = np.sqrt(np.trapezoid(np.square(run.effort("motor")), run.t) / whole)
            power = np.trapezoid(run.measure("motor.power"), run.t) / whole
            ends.append([torque, power, run.t[-1]])
        far, near, up, most = np.array(ends)
        numeric = (8.0 * (up - near) - (most - far)) / (12.0 * step)
        exact = [found[measure][name] for measure in measures]
        np.testing.assert_allclose(exact, numeric, rtol=1e-8, atol=1e-9)


def test_a_parameter_moves_all_that_is_made_of_it():
    machine = mbody.gallery.load("hoekens")
    system = mbody.assemble(machine)
    name = next(n for n in machine.parameters if n not in machine.fixed_parameters)
    body = machine.bodies[0].name
    found = mbody.gradient(system, f"{body}.x", name, t=[0.1])
    value = float(system.values[name])
    ends = [
        mbody.kinetostatics(system.with_values({name: value + way}), t=[0.1])[body].x[0]
        for way in (-1e-4 * value, 1e-4 * value)
    ]
    numeric = (ends[1] - ends[0]) / (2e-4 * value)
    assert found[f"{body}.x"][name] == pytest.approx(numeric, rel=1e-6, abs=1e-9)


def test_equal_peaks_are_said():
    machine = mbody.Mechanism("arm", ground={"O": (0, 0)})
    machine.add(
        mbody.Body("arm", mass=1.0, inertia=1.0, cg=(1.0, 0.0)),
        mbody.Revolute("O", "ground.O", "arm"),
        mbody.AngleDriver("motor", "arm", mbody.laws.ConstantSpeed(0.0, 1.0)),
        mbody.Gravity("gravity", y=-10.0),
    )
    # the torque is 10 cos θ: as great at θ = 0 as at π
    found = mbody.gradient(
        machine,
        "peak(motor.effort)",
        ["arm.cg.x", "gravity.x"],
        drive={"motor": ([0.0, np.pi], 1.0)},
    )
    assert found["peak(motor.effort)"]["arm.cg.x"] == pytest.approx(10.0)
    assert "is as great at" in " ".join(found.notes) or found.jacobian[0, 1] == 0.0


def test_dual_numbers_follow_the_chain_rule():
    """Against the complex step, function by function."""
    x, h = 0.37, 1e-30
    for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "arctan", "arcsin", "arccos"):
        function = getattr(np, name)
        exact = function(x + 1j * h).imag / h
        assert function(DualNumber(x, [1.0])).tangents[0] == pytest.approx(exact, rel=1e-14), name
    with pytest.raises(TypeError, match="lose its derivatives"):
        float(DualNumber(1.0, [1.0]))


def test_a_table_of_what_changes_a_force_most(norton):
    table = mbody.kinetostatics(norton).sensitivity(
        "A.force", ["crank.A.x", "coupler.weight", "F_P"]
    )
    weights = [abs(row["relative"]) for row in table.by.values()]
    assert len(weights) == 3 and weights == sorted(weights, reverse=True)
    row = table.by["crank.A.x"]
    assert row["unit"] == "lbf/in"
    assert row["relative"] == pytest.approx(row["derivative"] * 5.0 / table.value)
    assert "crank.A.x" in str(table)
