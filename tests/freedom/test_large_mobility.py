"""Mobility of large mechanisms: braced grids by the theorem of Bolker and Crapo, chains by hand,
and orthogonal elimination beside singular values.
"""

import pickle
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

import mbody
from mbody import (
    AngleCoupling,
    AngleDriver,
    Body,
    CouplingTerm,
    Mechanism,
    Prismatic,
    Revolute,
    makers,
    mobility,
)
from mbody.analysis.freedom import mobility as mobility_analysis
from mbody.analysis.position.assembly_analysis import closed
from mbody.core.tolerances import SINGULAR_VALUE_DEAD_CENTRE
from mbody.laws import Constant
from mbody.system.rank import dense, large_rank, rank_of, sparse_rows
from tests.support.cases import first_fast

RIGHT, UP, DIAGONAL = 0.0, np.pi / 2, np.pi / 4


def grid(columns, rows, braces=()):
    """Squares of pinned bars on a fixed base of one bar; braces are cells (column, row)."""
    machine = Mechanism("grid", ground={"G0": (0, 0), "G1": (1, 0)})
    first = {(0, 0): "ground.G0", (1, 0): "ground.G1"}

    def bar(name, start, end, angle):
        length = float(np.hypot(end[0] - start[0], end[1] - start[1]))
        machine.add(makers.bar(name, length, mass=1.0, guess=(*start, angle)))
        for point, node in (("A", start), ("B", end)):
            place = first.setdefault(node, f"{name}.{point}")
            if place != f"{name}.{point}":
                machine.add(Revolute(f"{name} {point}", place, f"{name}.{point}"))

    for j in range(rows + 1):
        for i in range(columns):
            if (i, j) != (0, 0):
                bar(f"h{i}_{j}", (i, j), (i + 1, j), RIGHT)
        for i in range(columns + 1):
            if j < rows:
                bar(f"v{i}_{j}", (i, j), (i, j + 1), UP)
    for i, j in braces:
        bar(f"d{i}_{j}", (i, j), (i + 1, j + 1), DIAGONAL)
    return machine


def parts(columns, rows, braces):
    """Components of the graph whose nodes are columns and rows and whose edges are braced cells."""
    at = np.array(list(braces), dtype=int).reshape(-1, 2)
    size = columns + rows
    graph = coo_matrix((np.ones(len(at)), (at[:, 0], columns + at[:, 1])), (size, size))
    return connected_components(graph, directed=False)[0]


@first_fast("size, seed", [((9, 12), 1), ((20, 15), 2), ((15, 20), 3)], 1)
def test_braced_grids(size, seed):
    """Bolker & Crapo 1979: a grid of squares shears as columns and rows that no brace joins."""
    cells = [(i, j) for i in range(size[0]) for j in range(size[1])]
    random = np.random.default_rng(seed)
    some = [cells[n] for n in random.permutation(len(cells))[: sum(size)]]
    report = mobility(grid(*size, some))
    together = parts(*size, some)
    assert report.of_joints.freedom == together - 1 == len(report.motions)
    assert report.of_joints.redundant == len(some) - (sum(size) - together) > 0
    # a brace can be spared where the others keep its column and its row together
    spared = {
        f"d{i}_{j}"
        for i, j in some
        if parts(*size, [cell for cell in some if cell != (i, j)]) == together
    }
    found = {name.split()[0] for name in report.redundant if name.startswith("d")}
    assert found == spared


@pytest.mark.slow
def test_a_grid_of_ten_thousand_bars():
    report = mobility(grid(71, 71))
    assert (report.bodies, report.loops) == (10223, 5041)
    assert report.of_joints.freedom == 141 and report.redundant == {}
    leaders = [motion.leader for motion in report.motions[:4]]
    assert leaders == ["h1_0", "v0_0", "h2_0", "v0_1"]
    shear = report.motions[1]
    # the lowest row of squares shears: its uprights turn, all above glides by the height of one
    assert shear.words.startswith("v0_0 turns about v0_0 A, v1_0, v2_0, v3_0, v4_0 and 67 more")
    assert len(shear.rates) == 72 + 71 * 71 + 72 * 70
    for name, (vx, vy, w) in shear.rates.items():
        upright = name.startswith("v") and name.endswith("_0")
        expected = (-0.5, 0.0, 1.0) if upright else (-1.0, 0.0, 0.0)
        # products of up to 71 rows of factors of order one
        assert_allclose((vx, vy, w), expected, rtol=0, atol=1e-12)


def chain(links):
    machine = Mechanism("chain")
    lengths, angles = 1.0 + 0.5 * np.cos(np.arange(links)), 1.2 + 0.3 * np.sin(np.arange(links))
    for k in range(links):
        bar = makers.bar(f"b{k}", float(lengths[k]), mass=1.0, guess=float(angles[k]))
        machine.add(bar, Revolute(f"j{k}", f"b{k - 1}.B" if k else "ground", f"b{k}.A"))
    return machine, lengths, angles


@pytest.mark.slow
def test_a_chain_of_ten_thousand_links():
    machine, lengths, angles = chain(10_000)
    report = mobility(machine)
    assert report.of_joints.freedom == len(report.motions) == 10_000
    assert "and 9988 more" in str(report)
    for n in (0, 7342, 9999):
        motion = report.motions[n]
        assert motion.leader == f"b{n}" and motion.words.startswith(f"b{n} turns about j{n} (1 ")
        assert len(motion.rates) == 10_000 - n
        arm = lengths[n] * np.array([-np.sin(angles[n]), np.cos(angles[n])])
        assert_allclose(motion.rates[f"b{n}"], (*arm / 2, 1.0), rtol=0, atol=1e-12)
        for later in (n + 1, 9999):
            if later > n and later < 10_000:
                assert_allclose(motion.rates[f"b{later}"], (*arm, 0.0), rtol=0, atol=1e-12)
    listed = report.data()
    assert len(listed["motions"]) == 50 and "list 50 of 10000 free motions" in listed["notes"][-1]


def machines():
    """Mechanisms for both ways: with drivers, couplings, slides, loose and redundant parts."""
    random = np.random.default_rng(5)
    cells = [(i, j) for i in range(5) for j in range(6)]
    some = [cells[n] for n in random.permutation(30)[:14]]
    for braces in (some, some[:7]):
        braced = grid(5, 6, braces)
        braced.add(AngleDriver("motor", "v0_0", Constant(UP)))
        braced.add(AngleDriver("again", "v3_0", Constant(UP)))
        yield braced
    long_chain = chain(40)[0]
    long_chain.add(Body("loose", mass=1.0, inertia=1.0, guess=(3.0, 4.0, 0.2)))
    long_chain.add(Body("slide", mass=1.0, inertia=1.0, points={"A": (0, 0)}))
    long_chain.add(Prismatic("guide", "ground", "slide"))
    for n in range(0, 40, 3):
        turning = [(f"b{n}", 1.0), (f"b{(n + 1) % 40}", -1.5), ("b20", 0.5)][: 2 + n % 2]
        terms = [CouplingTerm(factor, angle=body) for body, factor in turning]
        long_chain.add(AngleCoupling(f"g{n}", terms))
    yield long_chain
    bars = Mechanism("bars", ground={f"O{n}": (3.0 * n, 0.0) for n in range(20)})
    for n in range(20):
        for name, dx, angle in (("a", 0.0, 1.0), ("b", 1.0, 1.0), ("c", 2.0, 1.0)):
            at = (3.0 * n + dx, 0.0)
            bars.add(makers.bar(f"{name}{n}", 1.0, mass=1.0, guess=(*at, angle)))
            bars.add(Revolute(f"{name}{n} O", mbody.Marker("ground", at), f"{name}{n}.A"))
        end = (3.0 * n + np.cos(1.0), np.sin(1.0))
        points = {"A": (0, 0), "B": (1, 0), "C": (2, 0)}
        bars.add(Body(f"top{n}", mass=1.0, inertia=1.0, points=points, guess=(*end, 0.0)))
        for name, point in zip("abc", "ABC", strict=True):
            bars.add(Revolute(f"{name}{n} T", f"{name}{n}.B", f"top{n}.{point}"))
    yield bars


@pytest.mark.parametrize("machine", list(machines()), ids=lambda machine: machine.name)
def test_elimination_beside_singular_values(machine, monkeypatch):
    system = mbody.assemble(machine)
    work = closed(system, 0.0, {}, None).work
    G = dense(system, work)[1]
    rank = rank_of(G, SINGULAR_VALUE_DEAD_CENTRE)
    own = large_rank(
        sparse_rows(system, work),
        system.rows,
        range(len(machine.bodies)),
        SINGULAR_VALUE_DEAD_CENTRE,
    )
    assert (own.rank, own.free, own.redundant) == (rank.rank, rank.free, rank.redundant)
    motions = own.motions()
    # factors below ten, in chains of up to forty; both span what Φ_q leaves open
    assert np.abs(G @ motions.T).max(initial=0.0) < 1e-12 * max(
        1.0, np.abs(motions).max(initial=0.0)
    )
    assert rank.free == 0 or np.linalg.matrix_rank(motions) == rank.free
    left = np.concatenate([np.empty((0, system.rows)), *own.dependencies()])
    assert np.abs(left @ G).max(initial=0.0) < 1e-12 and len(left) == rank.redundant
    few = mobility(machine)
    monkeypatch.setattr(mobility_analysis, "LOOKED", 0)
    many = mobility(machine)
    assert many.redundant == few.redundant
    assert [m.leader for m in many.motions] == [m.leader for m in few.motions]
    for mine, theirs in zip(many.motions, few.motions, strict=True):
        assert mine.words == theirs.words
    assert [m.words for m in many.driven_motions] == [m.words for m in few.driven_motions]


def test_motions_of_a_large_report_are_a_sequence():
    report = mobility(chain(200)[0])
    motions = report.motions
    words = [motion.words for motion in motions]
    assert len(words) == 200 and motions[-1].words == words[-1]
    assert [motion.words for motion in motions[3:9:2]] == words[3:9:2] and motions[5:5] == ()
    with pytest.raises(IndexError):
        motions[200]
    again = pickle.loads(pickle.dumps(report))
    assert again.motions[17].words == words[17] and str(again) == str(report)


def test_a_position_near_a_singular_one_is_reported():
    """Two bars almost in line, in a chain that is large: their pivot is their angle."""
    machine, _, _ = chain(160)
    far = Mechanism("flat", ground={"O": (10.0, 0.0), "P": (10.0 + 2.0 - 1e-12, 0.0)})
    for element in (*machine.bodies, *machine.joints):
        far.add(element)
    far.add(
        makers.bar("left", 1.0, mass=1.0, guess=1e-6),
        makers.bar("right", 1.0, mass=1.0, guess=-1e-6),
        Revolute("O", "ground.O", "left.A"),
        Revolute("M", "left.B", "right.A"),
        Revolute("P", "ground.P", "right.B"),
    )
    report = mobility(far)
    assert any(
        re.match("the position is nearly singular: the least pivot", n) for n in report.notes
    )
