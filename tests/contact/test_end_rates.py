"""Rates of the ways along edges, arcs and curves, beside differences of these ways."""

import numpy as np
import pytest

from mbody import Body, Contact, Mechanism
from mbody.analysis.contact.unilateral import Unilateral
from mbody.kernels.contact_rows import find_end_rates
from mbody.laws import Table
from mbody.system.assembler import assemble

ARC = {"disc": "P", "radius": 0.7, "begin": 0.3, "end": 2.6}
HOLLOW = {"ring": "P", "radius": 2.0, "begin": -1.0, "end": 1.9}
PAIRS = {
    "a point on an edge": ({"segment": ("P", "Q")}, None),
    "a point on an arc": (ARC, None),
    "a disc on an arc": (ARC, {"disc": "C", "radius": 0.2}),
    "a disc within an arc": (HOLLOW, {"disc": "C", "radius": 0.2}),
    "an arc on an edge": (
        {"segment": ("P", "Q")},
        {"disc": "C", "radius": 0.4} | {"begin": 0.2, "end": 3.0},
    ),
    "an arc on an arc": (ARC, {"disc": "C", "radius": 0.4, "begin": -2.0, "end": 1.0}),
    "a point on a curve": ({"curve": "road", "point": "P"}, None),
    "a disc on a curve": ({"curve": "road", "point": "P"}, {"disc": "C", "radius": 0.1}),
}


def two_bodies(first, second):
    x = np.linspace(-2.0, 2.0, 33)
    road = Table(x, 0.3 * np.cos(2.0 * x), interpolation="spline")
    machine = Mechanism("two", ground={"O": (0.0, 0.0)}, curves={"road": road})
    points = {"P": (0.3, 0.1), "Q": (1.2, -0.4)}
    rim = {} if second is None else {"rim": second}
    machine.add(
        Body("a", mass=2.0, inertia=0.3, cg=(0.1, -0.2), points=points, shapes={"s": first}),
        Body("b", mass=1.0, inertia=0.1, cg=(0.05, 0.02), points={"C": (0.1, 0.0)}, shapes=rim),
        Contact("c", "a.s", "b.rim" if second else "b.C", friction=0.4),
    )
    return assemble(machine)


@pytest.mark.parametrize("pair", PAIRS)
def test_rates_of_ways_from_ends(pair):
    system = two_bodies(*PAIRS[pair])
    uni, work, h, known = Unilateral(system), system.work(), 1e-6, 0
    rng = np.random.default_rng(5)
    for _ in range(40):
        q, v = rng.uniform(-1.0, 1.0, 6), rng.uniform(-2.0, 2.0, 6)

        def ends(step, q=q, v=v):
            work.q[:6, 0], work.v[:6, 0] = q + step * v, v
            return uni.read(work).ends

        back, ahead, here = ends(-h), ends(h), ends(0.0)
        again, rates = np.empty((2, *here.shape))
        find_end_rates(uni.layout, work, uni.table, again, rates)
        finite = np.isfinite(here)
        back, ahead, here, rates = (one[finite] for one in (back, ahead, here, rates))
        np.testing.assert_allclose(again[finite], here, atol=1e-13)
        assert np.isfinite(rates).all() and np.isinf(again[~finite]).all()
        slopes = (ahead - back) / (2.0 * h)
        # not beside what a way jumps over: half a turn from the middle of an arc, two nearest feet
        smooth = np.isclose(ahead + back, 2.0 * here, atol=1e-6)
        np.testing.assert_allclose(rates[smooth], slopes[smooth], rtol=1e-5, atol=1e-6)
        known += smooth.sum()
    assert known >= 70
