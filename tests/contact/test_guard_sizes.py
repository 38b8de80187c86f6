"""Sizes of guards: by the kernel, and from the record of the instant by arrays."""

import numpy as np
import pytest

import mbody
from mbody.analysis.dynamics import active_modes
from mbody.core import tolerances as tol
from mbody.kernels.layout import PER_PRIMITIVE


def force_sizes(motion):
    """The greatest force on that body of each owner on which it is less (owners,)."""
    system, n, L, uni = motion.system, motion.system.coordinates, motion.layout, motion.active.uni
    own = np.zeros(L.bodies + 1)
    arms = system.coordinate_units / np.repeat(system.lengths, 3)  # 1, of angles 1/length
    own[:-1] = np.abs(system.mass[:n, 0] * motion.K[0, n : 2 * n] * arms).reshape(-1, 3).max(axis=1)
    record = motion.record[3 * n : system.friction_rows.start, 0].reshape(-1, PER_PRIMITIVE)
    forces = np.abs(record[:, 2:] / [1.0, 1.0, system.length]).max(axis=1)
    for side in (L.primitive_i, L.primitive_j):
        np.maximum.at(own, side, forces)
    mass, whole, fastest = system.mass[:n:3, 0], np.zeros(L.bodies), np.zeros(L.bodies)
    np.maximum.at(whole, uni.parts, own[:-1])
    np.maximum.at(fastest, uni.parts, own[:-1] / np.maximum(mass, tol.TINY))
    passed = np.minimum(np.where(mass > 0.0, mass, np.inf) * fastest[uni.parts], whole[uni.parts])
    sizes = np.append(np.maximum(own[:-1], tol.FORCE_PASSED_ON * passed), np.inf)
    return np.asarray(sizes[uni.every_body].min(axis=1) * uni.arms)


@pytest.mark.parametrize(
    ("name", "until"), [("woodpecker", 0.05), ("braking_vehicle", 0.3), ("geneva_drive", 0.2)]
)
def test_sizes_are_those_of_the_record(monkeypatch, name, until):
    met, own = [], active_modes.ActiveModes.begun

    def begun(active):
        own(active)
        motion = active.motion
        forces, G = force_sizes(motion), motion.active.guard_table
        for (kind, number), size in zip(motion.active.guards, G.size, strict=False):
            if kind in ("close", "edge", "enter"):
                expected = motion.system.length
            elif kind == "lock":
                expected = motion.active.speeds[number]
            elif kind == "stop":  # of pins a rate of turning
                uni = motion.active.uni
                tangents = [one.tangent for one in (*uni.contact_points, *uni.friction_joints)]
                unit = uni.table.speed_unit[tangents[number]]
                expected = motion.active.speeds[number] / unit
            elif kind == "share":
                which = (G.open_normal | G.open_tangent) > 0
                expected = (forces / motion.active.uni.arms)[which].max()
            else:
                expected = 1.0 if kind == "paradox" else forces[number]
            assert size == pytest.approx(expected, rel=1e-14)
            met.append(kind)

    monkeypatch.setattr(active_modes.ActiveModes, "begun", begun)
    mbody.simulate(mbody.gallery.load(name), until)
    assert {"close", "open", "slip"} & set(met)
