"""Layouts without rows that are off, against the layout of all rows and against plain algebra."""

import numpy as np
import pytest

import mbody
from mbody import Between, Body, Contact, Gravity, Mechanism, Revolute, SimulationSettings, assemble
from mbody.analysis.contact.contact_tables import layout_of_rows, work_of_rows
from mbody.analysis.contact.unilateral import unilateral_of
from mbody.analysis.dynamics.active_modes import ActiveModes
from mbody.kernels.accelerations import free_motion

G = 9.81


def two_boxes():
    """Two boxes above a floor, the second on a pin: each is split for the rows of its corners."""
    floor = {"floor": {"line": {"point": "O"}}}
    machine = Mechanism("boxes", ground={"O": (0.0, 0.0), "P": (0.5, 0.2)}, ground_shapes=floor)
    corners = {"a": (-0.1, -0.1), "b": (0.1, -0.1), "c": (0.1, 0.1), "d": (-0.1, 0.1)}
    for name in ("one", "two"):
        shapes = {"s": {"polygon": list("abcd")}}
        machine.add(Body(name, mass=2.0, inertia=0.02, points=corners, shapes=shapes))
    machine.add(
        Revolute("P", "ground.P", "two.c"),
        Contact("floor", "ground.floor", "one.s", friction=0.4),
        Between("boxes", "*.s", "*.s", friction=0.3),
        Gravity("g", y=-G),
    )
    return machine


@pytest.mark.parametrize("slides", [False, True])
def test_forces_are_those_of_all_rows(slides):
    """The first box on two corners that stick, or slide."""
    system = assemble(two_boxes())
    uni, whole, L = unilateral_of(system), system.work(masses=True), system.layout
    assert L.slots > L.bodies
    feet = [
        point
        for point in uni.contact_points
        if point.name == "floor" and point.candidate.position[1] < 0.0
    ]
    on, slip = np.zeros(len(uni)), np.zeros(len(L.friction_kind))
    on[[point.normal for point in feet]] = 1.0
    if slides:
        slip[[point.pair for point in feet]] = 1.0
    else:
        on[feet[0].tangent] = 1.0
    uni.set_rows(whole, on, slip)
    whole.q[:6, 0] = 0.0, 0.1, 0.0, 0.4, 0.1, 0.0
    whole.v[:6, 0] = (0.7 if slides else 0.0), 0.0, 0.0, 0.05, -0.05, 0.5
    off = np.zeros(len(L.primitive_node), dtype=bool)
    off[L.active_set] = on == 0.0
    off[L.active_set[L.friction_tangent[slip != 0.0]]] = False
    own = layout_of_rows(L, off)
    work = work_of_rows(system, own, whole, off)
    assert own.slots == own.bodies and own.nodes == np.sum(~off) + 1
    free_motion(L, whole, 0.0, 0)
    a, force = whole.a.copy(), whole.lam[2 * L.primitive_node, 0]
    whole.a[:] = 0.0
    free_motion(own, work, 0.0, 0)
    assert work.a.base is whole.a.base
    assert np.abs(work.a - a).max() <= 1e-13 * np.abs(a).max()
    # what is off has no force, what is on that of all rows
    found = work.lam[2 * own.primitive_node, 0]
    assert np.abs(np.where(off, 0.0, found - force)).max() <= 1e-12 * np.abs(force).max()
    assert not found[off].any()
    assert np.isclose(a[0, 0], -0.4 * G if slides else 0.0, rtol=1e-13, atol=1e-13)
    normals = [abs(found[L.active_set[point.normal]]) for point in feet]
    assert np.isclose(sum(normals), 2.0 * G, rtol=1e-13)


def test_a_fall_onto_a_floor_past_others(monkeypatch):
    """The same events and motion as without layouts of their own."""
    machine = two_boxes()
    start = {"one": {"x": 0.0, "y": 0.3, "angle": 0.2, "vx": 0.3}, "two": {"angle": 0.0}}
    machine.simulation = SimulationSettings(until=0.5, start=start)
    system = assemble(machine)
    assert system.layout.slots > system.layout.bodies
    runs = [mbody.simulate(system, 0.5, rtol=1e-9, instants=5)]
    monkeypatch.setattr(ActiveModes, "_without_rows", lambda self, on, sliding: None)
    runs.append(mbody.simulate(system, 0.5, rtol=1e-9, instants=5))
    events = [[(one.name, one.contact) for one in run.events] for run in runs]
    assert events[0] == events[1] and len(events[0]) > 2
    times = np.array([[one.t for one in run.events] for run in runs])
    assert np.abs(times[0] - times[1]).max() <= 1e-7
