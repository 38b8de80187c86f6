"""Derivatives of forces that no equation decides: of those that the analysis prints."""

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Gravity, Mechanism, SimulationSettings
from tests.contact.test_shared_forces import G, four_bar, on_feet, on_two_lines


def differences(machine, by, measured, part=1e-4):
    """Central differences of what is printed."""
    system, rows = mbody.assemble(machine), []
    for name in by:
        own = system.values[name]
        h = part * (abs(own) or 1.0)
        ends = [measured(system.with_values({name: own + s * h})) for s in (1, -1)]
        rows.append((np.array(ends[0]) - ends[1]) / (2.0 * h))
    return np.array(rows).T


@pytest.mark.parametrize("analysis", ["statics", "kinetostatics"])
@pytest.mark.parametrize(("cg", "force"), [(0.1, 50.0), (0.03, 12.0)])
def test_feet_of_a_table_by_hand(analysis, cg, force):
    """N of the feet at −1, 0, 1 m, two of them the least: 3 N₀ = m g (1 − c) − F."""
    made = on_feet((-1.0, 0.0, 1.0), 0.3, force, cg)
    by = ["top.mass", "top.cg.x", "F.value"]
    found = mbody.gradient(made, ["p0.fy", "p1.fy", "p2.fy"], by, analysis=analysis, t=[0.0])
    weight = 10.0 * G
    first = [G * (1 - cg) / 3, -weight / 3, -1 / 3]
    last = [G - 2 * first[0], 2 * weight / 3, 2 / 3]
    assert found.jacobian == pytest.approx(np.array([first, first, last]), rel=1e-7)


def test_a_table_whose_feet_share_alike_has_no_derivative_by_its_centre():
    made = on_feet((-1.0, 0.0, 1.0), 0.3, 0.0)
    found = mbody.gradient(made, "p0.fy", ["top.cg.x", "top.mass"], analysis="statics", t=[0.0])
    assert np.isnan(found.jacobian[0, 0]) and found.jacobian[0, 1] == pytest.approx(G / 3)
    assert any("have no derivative at t = 0 s" in note for note in found.notes)


def test_a_body_that_sticks_twice_in_a_motion():
    by, read = ["d.mass", "p.friction", "q.friction"], ["p.fx", "p.fy", "q.fx", "q.fy"]
    for seed in (0, 7):
        made, _ = on_two_lines(seed)
        options = {"until": 0.01, "instants": 2}
        found = mbody.gradient(
            made, [f"last({one})" for one in read], by, analysis="simulate", **options
        )

        def printed(system, options=options):
            run = mbody.simulate(system, **options)
            return [float(run.measure(one)[-1]) for one in read]

        whole = np.array(list(found.value.values()))
        assert whole == pytest.approx(printed(mbody.assemble(made)), rel=1e-9)
        assert found.jacobian == pytest.approx(differences(made, by, printed), rel=1e-5, abs=1e-6)


def test_pins_that_stick_in_a_motion():
    made, _ = four_bar(15)
    start, by = mbody.simulate(made, 1.5, instants=2), ["coupler.mass", "O.friction"]
    assert start.mode("O")[-1] == "stick"
    options = {"until": 1.6, "instants": 2, "start": start}
    read = ["O.torque", "A.fx", "C.torque"]
    found = mbody.gradient(
        made, [f"last({one})" for one in read], by, analysis="simulate", **options
    )

    def printed(system):
        run = mbody.simulate(system, **options)
        assert all(run.mode(name)[-1] == "stick" for name in "OABC")
        return [float(run.measure(one)[-1]) for one in read]

    assert list(found.value.values()) == pytest.approx(printed(mbody.assemble(made)), rel=1e-9)
    assert found.jacobian == pytest.approx(differences(made, by, printed), rel=1e-5)
    assert math.isfinite(found.jacobian.sum())


def test_a_number_at_its_bound():
    """Static friction as great as that of sliding: the motion, and others, have derivatives."""
    machine = Mechanism(
        "rests", ground={"O": (0, 0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    points = {"a": (-0.3, -0.2), "b": (0.3, -0.2), "c": (0.3, 0.2), "d": (-0.3, 0.2)}
    machine.add(
        Body("b", mass=2.0, inertia=0.1, points=points, shapes={"s": {"polygon": list("abcd")}}),
        Contact("k", "ground.floor", "b.s", friction=0.3, static=0.3),
        Gravity("g", x=1.0, y=-9.81),
    )
    machine.simulation = SimulationSettings(0.1, {"b": {"y": 0.2}}, instants=2)
    names = ["k.friction", "g.x"]
    found = mbody.gradient(machine, ["last(k.force)", "last(b.x)"], names, analysis="simulate")
    assert any("by 'k.friction', at its bound: 'k': friction is" in note for note in found.notes)
    assert np.isfinite(found.jacobian[:, 1]).all() and not found.jacobian[1].any()
