"""Undercut cams: where, and what avoids it, by closed forms and by what an assembly refuses."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import Mechanism, ModelError
from mbody.engineering import cam_undercut
from mbody.laws import Harmonic
from tests.model.test_cams import PROGRAM, tappet

#: Three lobes of height 2 a on a base circle: at their tops f″ = −9 a.
A = 0.01
LOBES = Harmonic(mean=A, amplitude=A, frequency=3.0, phase=math.pi / 2)


def test_a_flat_face_by_the_closed_form():
    """h + h″ = b + a − 8 a cos 3ψ is not positive within acos((b + a)/(8 a))/3 of each top."""
    b = 5.0 * A
    found = cam_undercut(tappet(LOBES, flat=True, base_radius=b))
    assert found.undercut and found.greatest_roller is None
    assert found.least.value == pytest.approx(b - 7.0 * A, abs=1e-15)
    assert found.least_base == pytest.approx(7.0 * A, rel=1e-12)
    half = math.acos((b + A) / (8.0 * A)) / 3.0
    tops = math.tau / 3.0 * np.array([1.0, 2.0, 3.0])
    # places every twentieth of a degree, within
    step = math.tau / 7200
    error = found.ranges - np.column_stack([tops - half, tops + half])
    assert found.ranges.shape == (3, 2)
    assert (np.abs(error) < step).all() and (error[:, 0] > 0.0).all() and (error[:, 1] < 0.0).all()


def test_a_roller_by_the_closed_form():
    """At the tops R²/(R + 9 a) = r with R = b + 2 a + r: r (7 a − b) = (b + 2 a)²."""
    b = 6.0 * A
    edge = (b + 2.0 * A) ** 2 / (7.0 * A - b)
    found = cam_undercut(tappet(LOBES, roller=1.25 * edge, base_radius=b))
    assert found.undercut and len(found.ranges) == 3
    assert found.greatest_roller == pytest.approx(edge, rel=1e-12)
    r = found.roller
    # r (7 a − b) = (b + 2 a)² solved for b
    c = 2.0 * A
    base = -c - 0.5 * r + math.sqrt(0.25 * r * r + r * (7.0 * A + c))
    assert found.least_base == pytest.approx(base, rel=1e-12)
    # a roller just inside is taken, and said to fit by as much
    inside = cam_undercut(tappet(LOBES, roller=0.999 * edge, base_radius=b))
    assert not inside.undercut and inside.greatest_roller == pytest.approx(edge, rel=1e-12)


@pytest.mark.parametrize("clockwise", [False, True])
def test_what_is_given_as_the_limit_is_what_an_assembly_takes(clockwise):
    """A thousandth beyond it is accepted, a thousandth short of it refused, which looks at 721
    places of its own.
    """
    how = {"roller": 0.04, "base_radius": 0.005, "clockwise": clockwise}
    described = tappet(PROGRAM, **how)
    found = cam_undercut(described)
    with pytest.raises(ModelError, match="undercuts"):
        mbody.assemble(described)
    for by, fits in ((1.001, True), (0.999, False)):
        grown = tappet(PROGRAM, **how | {"base_radius": by * found.least_base})
        smaller = tappet(PROGRAM, **how | {"roller": found.greatest_roller / by})
        for machine in (grown, smaller):
            assert cam_undercut(machine).undercut is not fits
            if fits:
                system = mbody.assemble(machine)
                assert cam_undercut(system).data() == cam_undercut(machine).data()
            else:
                with pytest.raises(ModelError, match="undercuts"):
                    mbody.assemble(machine)


def test_a_pitch_curve_that_is_given_with_its_roller():
    """Without a base radius the greatest roller is the least radius of the pitch curve itself."""
    curve = Harmonic(0.08, 0.01, 3.0, phase=math.pi / 2)
    found = cam_undercut(tappet(curve, roller=0.06))
    sharpest = 0.09**2 / (0.09 + 9.0 * 0.01)
    assert found.undercut and found.greatest_roller == pytest.approx(sharpest, rel=1e-12)
    edge = cam_undercut(tappet(curve))
    assert not edge.undercut and edge.greatest_roller is None and edge.least_base == 0.0


def test_one_of_several_cams_and_rough_ones():
    """Another cam that undercuts too, and one with friction on its pin, are not in the way."""
    machine = tappet(PROGRAM, roller=0.04, base_radius=0.005, friction=0.1, pin_radius=0.01)
    alone = cam_undercut(machine)
    machine.add(replace(machine["contact"], name="other", roller=0.05))
    with pytest.raises(ModelError, match="has 2 cams"):
        cam_undercut(machine)
    assert cam_undercut(machine, "contact").least_base == alone.least_base
    assert cam_undercut(machine, "other").least_base > alone.least_base
    with pytest.raises(ModelError, match="has no cam"):
        cam_undercut(Mechanism("none"))
