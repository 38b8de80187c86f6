"""`mbody.linkages`: many linkages of different topology as arrays, beside independent equations."""

from __future__ import annotations

import numpy as np
import pytest

import mbody
from mbody.laws import ConstantSpeed
from mbody.topologies.dataset import GROUPS, assur_bars, random_linkages
from tests.support.dense_linkages import forces_of, moved, random_dyads

GRAVITY, SPEED = (0.3, -9.81), 2.0
#: Of the greatest force of a linkage. Its joints keep sin² > 0.01, so that its equations lose two
#: digits or three of a position closed to 1e-13.
CLOSE = 1e-9


def against_dense_equations(arrays, found, every, speeds=(SPEED,)):
    """The greatest differences: of positions, of forces and torques as parts of the greatest."""
    worst = np.zeros(3)
    for n in range(len(found)):
        x = moved(arrays["joints"][n], arrays["links"][n].tolist(), found.angle[n])
        links = arrays["links"][n]
        length = np.hypot(*(arrays["joints"][n][links[:, 1]] - arrays["joints"][n][links[:, 0]]).T)
        forces, torques = zip(
            *(
                forces_of(
                    x[k],
                    links.tolist(),
                    arrays["ground"][n],
                    speeds,
                    np.array(GRAVITY),
                    length,
                    length**3 / 12,
                )
                for k in range(0, len(x), every)
            ),
            strict=True,
        )
        off = [np.abs(x - found.positions[n]).max()]
        for true, own in ((forces, found.forces[n, ::every]), (torques, found.torque[n, ::every])):
            true = np.array(true).reshape(own.shape)
            off.append(np.abs(true - own).max() / np.abs(true).max())
        worst = np.maximum(worst, off)
    return worst


@pytest.mark.parametrize(("nodes", "count"), [(4, 4), (8, 20), (20, 2)])
def test_motion_and_forces_are_those_of_dense_equations(nodes, count):
    arrays = random_dyads(count, nodes, 4, 0.01)
    found = mbody.linkages(arrays, gravity=GRAVITY, speed=SPEED, instants=61)
    assert found.failures == {}
    assert (against_dense_equations(arrays, found, 6) < CLOSE).all()


@pytest.mark.parametrize(
    ("turns", "nodes", "count"),
    [((2.0, -1.3), 6, 40), ((2 * np.pi, 0.6), 9, 20), ((1.1, 0.0, -0.7), 10, 20)],
)
def test_several_drivers_are_those_of_dense_equations(turns, nodes, count):
    arrays = random_dyads(count, nodes, 5, 0.01, turns)
    turn = np.tile(turns, (count, 1))
    found = mbody.linkages(arrays, gravity=GRAVITY, turn=turn, speed=SPEED, instants=61)
    assert found.failures == {}
    assert found.torque.shape == found.angle.shape == (count, 61, len(turns))
    speeds = SPEED * np.array(turns) / turns[0]
    assert (against_dense_equations(arrays, found, 6, speeds) < CLOSE).all()


def test_drivers_in_another_order_and_fewer_of_them():
    """The torques go with their drivers; a linkage may have fewer drivers than another."""
    arrays = random_dyads(6, 7, 3, 0.01, (1.5, -0.8))
    one = mbody.linkages(arrays, gravity=GRAVITY, turn=np.tile([1.5, -0.8], (6, 1)), instants=31)
    swapped = arrays | {"driver": arrays["driver"][:, ::-1]}
    turn = np.tile([-0.8, 1.5], (6, 1))
    other = mbody.linkages(swapped, gravity=GRAVITY, turn=turn, speed=-0.8 / 1.5, instants=31)
    assert one.failures == other.failures == {}
    size = np.abs(one.torque).max()
    assert np.abs(one.torque - other.torque[:, :, ::-1]).max() < CLOSE * size
    assert np.abs(one.positions - other.positions).max() < 1e-10
    mixed = {name: np.concatenate([part, part]) for name, part in FOUR_BAR.items()}
    mixed["driver"] = np.array([(0, -1), (0, 2)])
    found = mbody.linkages(mixed, gravity=GRAVITY, instants=31)
    alone = mbody.linkages(FOUR_BAR, gravity=GRAVITY, instants=31)
    assert np.allclose(found.torque[0, :, 0], alone.torque[0], 1e-9, 1e-9)
    assert np.isnan(found.torque[0, :, 1]).all() and np.isnan(found.angle[0, :, 1]).all()
    assert found.failures[1].startswith("its drivers and joints hold it once too often")


def as_mechanism(arrays, n, speed):
    """One linkage described by elements."""
    x, links = arrays["joints"][n], arrays["links"][n]
    ground = {f"J{k}": tuple(x[k]) for k in range(len(x))}
    made = mbody.Mechanism("linkage", units="SI", ground=ground)
    at = {int(k): [f"ground.J{k}"] for k in arrays["ground"][n]}
    for b, own in enumerate(links):
        own = [int(k) for k in own if k >= 0]
        if not own:
            continue
        rows = zip(own, [*own[1:], own[0]], strict=True)
        bars = [(x[p], x[q]) for p, q in list(rows)[: len(own) if len(own) > 2 else 1]]
        sizes = np.array([np.hypot(*(q - p)) for p, q in bars])
        middles = np.array([(p + q) / 2 for p, q in bars])
        cg = sizes @ middles / sizes.sum()
        inertia = (sizes**3 / 12 + sizes * ((middles - cg) ** 2).sum(axis=1)).sum()
        points = {f"J{k}": tuple(x[k]) for k in range(len(x))}
        made.add(
            mbody.Body(
                f"L{b}",
                mass=sizes.sum(),
                inertia=inertia,
                cg=tuple(cg),
                points=points,
                guess=(*cg, 0),
            )
        )
        for k in own:
            at.setdefault(k, []).append(f"L{b}.J{k}")
    for k, places in at.items():
        for m, other in enumerate(places[1:]):
            made.add(mbody.Revolute(f"R{k}_{m}", places[0], other))
    for s, (k, on) in enumerate(arrays["slides"][n]):
        if k >= 0:
            body = made.ground if on < 0 else made[f"L{on}"]
            guide = body.at(tuple(x[k]), angle=float(arrays["directions"][n, s]))
            first = next(place for place in at[int(k)] if not place.startswith("ground"))
            made.add(mbody.PinSlot(f"S{s}", guide, first))
    made.add(mbody.AngleDriver("motor", "L0", ConstantSpeed(0.0, speed)))
    made.add(mbody.Gravity("g", x=GRAVITY[0], y=GRAVITY[1]))
    return made


@pytest.mark.parametrize(
    ("groups", "nodes"),
    [(("dyads", "sliders"), 8), (("sliders",), 6), (("triads",), 6), (("assur",), 7)],
)
def test_slides_and_triads_are_those_of_mechanisms_of_elements(groups, nodes):
    random = np.random.default_rng(8)
    arrays = random_linkages(8, nodes, random, groups)
    found = mbody.linkages(arrays, gravity=GRAVITY, speed=SPEED, instants=41)
    moving = [n for n in range(len(found)) if n not in found.failures]
    assert len(moving) >= 4
    if "assur" in groups:
        assert (arrays["links"][moving] >= 0).all()
    elif "triads" in groups:
        assert any((arrays["links"][n] >= 0).all(axis=1).any() for n in moving)
    else:
        assert any((arrays["slides"][n, :, 0] >= 0).any() for n in moving)
    for n in moving[:: max(1, len(moving) // 5)]:
        machine = as_mechanism(arrays, n, SPEED)
        run = mbody.kinetostatics(machine, t=found.angle[n] / SPEED)
        effort = run.effort("motor")
        assert np.abs(effort - found.torque[n]).max() < CLOSE * np.abs(effort).max()
        for b, own in enumerate(arrays["links"][n]):
            for p, k in enumerate(own):
                if k < 0:
                    continue
                point = run.point(f"L{b}.J{k}")
                place = np.stack([point.x, point.y], axis=1)
                assert np.abs(place - found.positions[n, :, k]).max() < 1e-10
                # all that acts on the link there
                names = [j.name for j in machine.joints if j.name.startswith(f"R{k}_")]
                force = np.zeros((len(place), 2))
                for name in names:
                    joint, reaction = machine[name], run.reaction(name)
                    sign = (joint.j.body == f"L{b}") * 1.0 - (joint.i.body == f"L{b}") * 1.0
                    force += sign * np.stack([reaction.fx, reaction.fy], axis=1)
                for joint in machine.joints:
                    own_slide = joint.name.startswith("S") and joint.j.body == f"L{b}"
                    if own_slide and joint.j.point == f"J{k}":
                        reaction = run.reaction(joint.name)
                        force += np.stack([reaction.fx, reaction.fy], axis=1)
                size = np.abs(found.forces[n][np.isfinite(found.forces[n])]).max()
                assert np.abs(force - found.forces[n, :, b, p]).max() < CLOSE * size


def test_numbering_changes_nothing():
    arrays = random_dyads(4, 7, 2, 0.05)
    random, renumbered = np.random.default_rng(1), {}
    joints = np.array([random.permutation(7) for _ in range(4)])
    links = np.array([random.permutation(9) for _ in range(4)])
    inverse = np.argsort(joints, axis=1)
    row = np.arange(4)[:, None]
    renumbered["joints"] = arrays["joints"][row, joints]
    own = arrays["links"][row, links]
    renumbered["links"] = inverse[np.arange(4)[:, None, None], own][:, :, ::-1]
    renumbered["ground"] = inverse[row, arrays["ground"]]
    renumbered["driver"] = np.argmin(links, axis=1)
    one = mbody.linkages(arrays, gravity=GRAVITY, instants=31)
    other = mbody.linkages(renumbered, gravity=GRAVITY, instants=31)
    both = mbody.linkages(
        {name: np.concatenate([arrays[name], renumbered[name]]) for name in arrays}, instants=31
    )
    assert (both.topology[:4] == both.topology[4:]).all()
    for n in range(4):
        assert np.allclose(other.positions[n], one.positions[n][:, joints[n]], 0.0, 1e-11)
        forces = one.forces[n][:, links[n]][:, :, ::-1]
        assert np.abs(other.forces[n] - forces).max() < CLOSE * np.abs(forces).max()
        assert np.abs(other.torque[n] - one.torque[n]).max() < CLOSE * np.abs(one.torque[n]).max()


FOUR_BAR = {
    "joints": [[(0, 0), (1, 0), (3, 2), (4, 0)]],
    "links": [[(0, 1), (1, 2), (2, 3)]],
    "ground": [(0, 3)],
    "driver": [0],
}


def several(**changes):
    """Four-bars that differ in some arrays from `FOUR_BAR`."""
    count = max(len(part) for part in changes.values())
    return {name: np.repeat(part, count, axis=0) for name, part in FOUR_BAR.items()} | {
        name: np.array(part) for name, part in changes.items()
    }


def test_many_go_as_one_alone():
    """Side by side on lanes, or a linkage on several lanes, or step by step."""
    arrays = random_dyads(3, 6, 9, 0.05)
    many = {name: np.concatenate([part] * 7) for name, part in arrays.items()}
    found = mbody.linkages(many, gravity=GRAVITY, instants=121)
    again = mbody.linkages(many, gravity=GRAVITY, instants=121, threads=2)
    assert np.array_equal(found.forces, again.forces)
    for n in range(3):
        own = {name: part[n : n + 1] for name, part in arrays.items()}
        alone = mbody.linkages(own, gravity=GRAVITY, instants=121)
        steps = mbody.linkages(own, gravity=GRAVITY, instants=2)
        size = np.abs(alone.forces).max()
        assert np.abs(found.forces[n::3] - alone.forces).max() < CLOSE * size
        assert np.abs(steps.forces[0] - alone.forces[0, [0, -1]]).max() < CLOSE * size
        assert abs(alone.margin[0] - found.margin[n]) < 1e-6


def test_failed_linkages_are_rows_with_reasons():
    nan, far = [(0, 0), (np.nan, 0), (3, 2), (4, 0)], [(0, 0), (1, 0), (1.5, 0.5), (1.8, 0)]
    good = FOUR_BAR["joints"][0]
    found = mbody.linkages(
        several(
            joints=[good, far, nan, good, good],
            driver=[0, 0, 0, 7, 0],
            ground=[(0, 3), (0, 3), (0, 3), (0, 3), (0, -1)],
        ),
        instants=51,
    )
    assert sorted(found.failures) == [1, 2, 3, 4]
    assert "dead centre" in found.failures[1] and "deg of its driver" in found.failures[1]
    assert "not a finite number" in found.failures[2]
    assert "names a link that there is not" in found.failures[3]
    assert "degrees of freedom" in found.failures[4]
    assert np.isfinite(found.forces[0]).all()
    assert np.isnan(found.forces[1:]).all() and np.isnan(found.margin[1:]).all()
    alone = mbody.linkages(FOUR_BAR, instants=51)
    assert np.allclose(found.forces[0], alone.forces[0], 1e-9, 1e-9)
    assert "1 moved, 4 failed" in str(found)


def test_dead_centre_is_where_the_crank_and_the_coupler_say():
    """Its coupler and rocker are in line there: a closed form."""
    far = [(0.0, 0.0), (1.0, 0.0), (1.5, 0.5), (1.8, 0.0)]
    found = mbody.linkages(several(joints=[far]), instants=201)
    angle = float(found.failures[0].split("(at ")[1].split()[0])
    x = np.array(far)
    reach = np.hypot(*(x[2] - x[1])) + np.hypot(*(x[3] - x[2]))
    true = np.degrees(np.arccos((1.0 + 1.8**2 - reach**2) / (2.0 * 1.8)))
    assert abs(angle - true) < 0.1


def test_a_part_that_moves_and_one_that_is_held_twice():
    """Freedoms are counted to none, but two bars hold a frame and a bar swings."""
    arrays = {
        "joints": [[(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (3, 3)]],
        "links": [[(0, 1), (2, 3), (2, 4), (3, 4), (2, 5)]],
        "ground": [(0, 2, 3, -1)],
        "driver": [0],
    }
    found = mbody.linkages(arrays)
    assert found.failures[0]


def test_assur_groups_contain_no_smaller_ones():
    """Without any one of its bars every new joint of a group can move (Servatius et al. 2010)."""
    random = np.random.default_rng(6)
    for size in (3, 4, 5, 5, 5, 5, 8):
        bars = assur_bars(4, size, random)
        x = random.random((4 + size, 2))
        matrix = np.zeros((len(bars), 2 * len(x)))
        for row, (i, j) in zip(matrix, bars, strict=True):
            row[2 * i : 2 * i + 2], row[2 * j : 2 * j + 2] = x[i] - x[j], x[j] - x[i]
        matrix = matrix[:, 8:]
        assert matrix.shape == (2 * size, 2 * size)
        # columns of the inverse are the motions without a bar; both to rounding of random numbers
        motions = np.linalg.inv(matrix).T.reshape(-1, size, 2)
        rates = np.hypot(motions[..., 0], motions[..., 1])
        assert (rates > 1e-9 * rates.max()).all()


def test_generator_gives_what_it_is_asked_for():
    random = np.random.default_rng(0)
    for groups in (("dyads",), ("sliders",), ("triads",), ("dyads", "triads"), GROUPS):
        arrays = random_linkages(4, 9, random, groups)
        links, slides = arrays["links"], arrays["slides"]
        used = (links >= 0).sum(axis=2)
        assert (slides[..., 0] >= 0).any() == ("sliders" in groups)
        assert (used == 3).any() == ("triads" in groups)
        rows = 2 * (used.sum(axis=1) - 9) + 2 * 2 + (slides[..., 0] >= 0).sum(axis=1) + 1
        assert (rows == 3 * (used > 0).sum(axis=1)).all()
