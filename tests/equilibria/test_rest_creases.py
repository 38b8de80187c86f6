"""Rest positions beside curves in which the ends of springs meet, and many positions at once.

Two blocks on rails and a block on a turning arm have closed forms; positions one by one are the
second route of positions many at once.
"""

import numpy as np
import pytest

import mbody
from mbody import Body, Force, Gravity, Marker, Mechanism, Prismatic, Revolute, SolveError, Spring
from mbody.analysis.equilibria.search import jumping_loads, without_stiffness
from mbody.analysis.position.assembly_analysis import closed
from mbody.analysis.position.tangent_space import Manifold, ManyPositions, orthonormal
from tests.support.cases import first_fast
from tests.support.rest_linkages import FAMILIES

#: A rest position is found to 1e-10 of the greatest force, 1e2 N, over a stiffness of 50 N/m.
PLACE = 1e-9


def blocks(preload=0.0, free_length=1.0, force=0.0):
    """Two blocks on rails, x = 0 beside walls at x = −1; the first may be pushed along."""
    machine = Mechanism("blocks", ground={"W": (-1.0, 0.0), "V": (-1.0, 1.0), "Y": (0.0, 1.0)})
    machine.add(
        Body("a", mass=2.0, inertia=1.0),
        Body("b", mass=3.0, inertia=1.0, guess=(0.0, 1.0, 0.0)),
        Prismatic("one", "ground", "a"),
        Prismatic("two", "ground.Y", "b"),
        Spring("s", "ground.W", "a", stiffness=50.0, free_length=free_length, preload=preload),
        Spring("t", "ground.V", "b", stiffness=50.0, free_length=1.0),
    )
    if force:
        machine.add(Force("push", at="a", value=force))
    return machine


def places(found):
    return sorted((float(one["a"].x[0]), float(one["b"].x[0])) for one in found)


def test_springs_that_meet_along_rails():
    """Each spring has two lengths without force, one on either side of its wall."""
    found = mbody.equilibrium(blocks())
    assert found.status == "completed" and not found.doubts
    assert len(found) == 4 and all(one.stability == "stable" for one in found)
    expected = [(x, y) for x in (-2.0, 0.0) for y in (-2.0, 0.0)]
    np.testing.assert_allclose(places(found), expected, atol=PLACE)


@first_fast("force", [10.5, 40.0], 1)
def test_a_spring_that_pulls_at_no_length_is_overcome(force):
    """preload + k l = F, on the side that the force is for; the other side has none."""
    found = mbody.equilibrium(blocks(preload=10.0, free_length=0.0, force=force))
    assert not found.doubts
    x = -1.0 + (force - 10.0) / 50.0
    np.testing.assert_allclose(places(found), [(x, -2.0), (x, 0.0)], atol=PLACE)


@first_fast("force", [5.0, 9.5], 1)
def test_where_loads_drive_to_a_crease_no_forces_balance(force):
    """The pull on both sides outweighs the push: the block stays at the wall."""
    with pytest.raises(SolveError, match=r"drive it from both sides to .*, so that no forces"):
        mbody.equilibrium(blocks(preload=10.0, free_length=0.0, force=force))


def test_a_doubt_names_the_load_that_jumps():
    """A push as great as the pull at no length leaves a zero on the crease itself."""
    found = mbody.equilibrium(blocks(preload=10.0, free_length=0.0, force=10.0))
    assert found.doubts and len({doubt.message for doubt in found.doubts}) == len(found.doubts)
    for doubt in found.doubts:
        assert "is not certain, as the force of 's' jumps there" in doubt.message
        assert "s" in doubt.elements


@pytest.mark.slow
def test_a_crease_of_a_turning_line():
    """A block at r on an arm that turns by θ, r of either sign: V = k (|r| − l)²/2 + m g r sin θ.

    θ = 90°: r = l − m g/k or −(l + m g/k); −90° mirrors them.
    """
    k, length, mass, g = 50.0, 1.0, 2.0, 9.81
    machine = Mechanism("arm", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("arm", mass=1.0, inertia=0.5, guess=0.3),
        Body("block", mass=mass, inertia=0.1, guess=(0.955, 0.296, 0.3)),
        Revolute("pin", "ground.O", "arm"),
        Prismatic("rail", Marker("arm", (0.0, 0.0), 0.0), Marker("block", (0.0, 0.0), 0.0)),
        Spring("s", "ground.O", "block", stiffness=k, free_length=length),
        Gravity("gravity", y=-g),
    )
    found = mbody.equilibrium(machine)
    near, far = length - mass * g / k, length + mass * g / k
    y = sorted(float(one["block"].y[0]) for one in found)
    np.testing.assert_allclose(y, [-far, -far, near, near], atol=PLACE)
    assert max(abs(float(one["block"].x[0])) for one in found) < PLACE
    stable = [float(one["block"].y[0]) for one in found.stable]
    np.testing.assert_allclose(stable, [-far, -far], atol=PLACE)


def manifold_of(machine):
    system = mbody.assemble(machine)
    start = closed(system, 0.0, {}, None)
    manifold = Manifold(system, start.work, 0.0)
    return manifold, manifold.place(start.work.q[: system.coordinates, 0].copy())


def test_a_load_that_jumps_is_told_from_one_that_does_not():
    manifold, here = manifold_of(blocks())
    assert jumping_loads(manifold, here) == [] and not without_stiffness(manifold, here)
    at_wall = here.q.copy()
    at_wall[0] = -1.0
    assert jumping_loads(manifold, manifold.place(at_wall)) == ["s"]
    free = Mechanism("free")
    free.add(Body("a", mass=1.0, inertia=1.0), Prismatic("rail", "ground", "a"))
    free.add(Force("none", at="a", value=0.0))
    assert without_stiffness(*manifold_of(free))


@pytest.mark.parametrize("seed", range(3))
def test_many_positions_are_those_one_by_one(seed):
    """Closed over a tangent plane, loads, directions and stiffness: 1e-9 is the condition of the
    linkages, below 1e3, times what closing leaves, 1e-13; differences of stiffness leave 1e-9.
    """
    manifold, here = manifold_of(FAMILIES[2][seed](np.random.default_rng([2, seed])).machine)
    many, frame = ManyPositions(manifold), here.motions
    y = 0.2 * np.random.default_rng(seed).normal(size=(6, 2))
    start = here.q + manifold.scale * (y @ frame)
    found = many.closed(start, np.broadcast_to(frame, (6, *frame.shape)))
    assert found.good.all()
    motions = orthonormal(found.directions)[0]
    forces = many.forces(found.q)
    stiffness = many.stiffness(found.q, motions, found.rows, forces)
    for n, one in enumerate(start):
        place = manifold.place(manifold.closed(one, frame))
        np.testing.assert_allclose(found.q[n], place.q, atol=1e-9)
        np.testing.assert_allclose(forces[n], place.force, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.rows[n], place.rows, atol=1e-9)
        turn = place.motions @ motions[n].T
        np.testing.assert_allclose(turn @ turn.T, np.eye(2), atol=1e-9)
        K = turn.T @ manifold.stiffness(place) @ turn
        np.testing.assert_allclose(stiffness[n], K, rtol=1e-8, atol=1e-8 * np.abs(K).max())


def test_positions_that_do_not_close_are_no_numbers():
    """Beyond the reach of its links a linkage leads nowhere; the others are not touched by that."""
    manifold, here = manifold_of(FAMILIES[2][1](np.random.default_rng([2, 1])).machine)
    many, frame = ManyPositions(manifold), here.motions
    y = np.array([[0.0, 0.0], [60.0, -40.0]])
    start = here.q + manifold.scale * (y @ frame)
    found = many.closed(start, np.broadcast_to(frame, (2, *frame.shape)))
    assert found.good.tolist() == [True, False]
    assert np.isnan(found.q[1]).all() and np.isfinite(found.q[0]).all()


def on_a_rail(at=0.0, stiffness=100.0, **spring):
    """A block on a rail of the length 1 through the other end of its spring, x = 0, where it
    begins.
    """
    machine = Mechanism("rail", ground={"O": (0.0, 0.0), "end": (1.0, 0.0)})
    machine.add(
        Body("b", mass=1.0, inertia=1.0, guess=(at, 0.0, 0.0)),
        Prismatic("guide", "ground.end", "b"),
        Spring("s", "ground.O", "b", stiffness=stiffness, **spring),
    )
    return machine


def test_where_the_ends_of_a_spring_meet_no_forces_balance():
    """At zero length a spring has no direction, and none is taken: that the rest vanishes there is
    no position of rest, though the search meets it exactly.
    """
    found = mbody.equilibrium(on_a_rail(free_length=0.2))
    places = sorted(float(one.solution["b"].x[0]) for one in found)
    assert places == pytest.approx([-0.2, 0.2], abs=PLACE)
    assert any("the ends of 's' meet" in note for note in found.notes)
    with pytest.raises(SolveError, match="from both sides to"):
        mbody.equilibrium(on_a_rail(preload=5.0))
    (plain,) = mbody.equilibrium(on_a_rail())
    assert plain.stability == "stable" and abs(float(plain.solution["b"].x[0])) < PLACE


@pytest.mark.parametrize("at", [1e-3, 0.05, 0.3, 1.0, 7.0])
@pytest.mark.parametrize("free_length", [1e-4, 0.02, 0.2, 0.5])
def test_positions_on_both_sides_of_where_the_ends_meet_are_found(free_length, at):
    """A step of the search that has both of them within it does not take them for one."""
    found = mbody.equilibrium(on_a_rail(at, free_length=free_length))
    assert found.status == "completed"
    places = sorted(float(one.solution["b"].x[0]) for one in found)
    assert places == pytest.approx([-free_length, free_length], abs=PLACE)


def test_where_nothing_else_is_met_the_place_is_named():
    """A spring that pushes apart to 5 km, further than is searched."""
    machine = on_a_rail(stiffness=1e-3, preload=-5.0)
    with pytest.raises(SolveError, match=r"the ends of 's' meet.* begin beside it"):
        mbody.equilibrium(machine)
