"""The system of a linkage from its graph, beside the one that is assembled of elements, and the
lists of elimination beside the rule written out.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from mbody.system.assembler import assemble
from mbody.topologies.dataset import random_linkages
from mbody.topologies.plan import canonical_order, graph_of, linkage_arrays, linkage_system
from tests.support.dense_linkages import random_dyads
from tests.support.linkage_elements import linkage_of_elements


def graphs_of(arrays):
    """The different graphs of linkages as arrays."""
    made = linkage_arrays(arrays)
    shape = (made.joints.shape[1], *made.links.shape[1:], made.driver.shape[1])
    table = np.unique(canonical_order(made).table, axis=0)
    return [graph_of(row.tobytes(), (*shape, made.slides.shape[1])) for row in table]


def hub():
    """A frame of twelve joints on the crank, a chain of dyads along it: a body of many slots."""
    rim = [(np.cos(a), np.sin(a)) for a in np.linspace(0.0, 6.0, 12)]
    tips = [(2.0 * x, 2.0 * y) for x, y in rim[1:]]
    links = [(0, *range(1, 12))] + [(k, 11 + k) for k in range(1, 12)]
    links += [(11 + k, 12 + k) for k in range(1, 11)] + [(12, 23)]
    wide = max(map(len, links))
    return {
        "joints": [[*rim, *tips, (3.0, 1.0)]],
        "links": [[(*own, *[-1] * (wide - len(own))) for own in links]],
        "ground": [[0, 23]],
        "driver": [0],
    }


@pytest.mark.parametrize(
    "arrays",
    [
        random_linkages(3, 8, np.random.default_rng(3), ("dyads",)),
        random_linkages(4, 7, np.random.default_rng(4), ("dyads", "sliders")),
        random_linkages(4, 9, np.random.default_rng(5)),
        random_dyads(3, 20, 3),
        random_dyads(3, 10, 5, 0.01, (1.1, 0.0, -0.7)),
        hub(),
    ],
    ids=["dyads", "sliders", "all groups", "twenty joints", "three drivers", "hub"],
)
def test_the_system_is_that_of_elements(arrays):
    graphs = graphs_of(arrays)
    assert graphs
    for graph in graphs:
        assert graph.surplus == 0
        made, expected = linkage_system(graph), assemble(linkage_of_elements(graph))
        system, L = made.system, expected.layout
        for field in L.fields:
            assert_array_equal(getattr(system.layout, field), getattr(L, field), field, strict=True)
        assert system.par.shape == expected.par.shape
        assert_array_equal(system.mass, expected.mass)
        assert system.row_kinds == expected.row_kinds
        assert (system.signals, system.record_rows) == (expected.signals, expected.record_rows)
        number = {element.name: e for e, (element, _) in enumerate(expected.owners)}
        slots = [(n, across) for n in range(len(made.closing) // 2) for across in (0, 1)]
        assert made.pins[:, 0].tolist() == [number[f"R{n}"] for n in range(len(made.pins))]
        assert made.closing[:, 0].tolist() == [number[f"C{n}_{a}"] for n, a in slots]
        assert made.slides[:, 0].tolist() == [number[f"S{n}"] for n in range(len(made.slides))]
        assert made.drivers.tolist() == [number[f"D{n}"] for n in range(len(made.drivers))]
