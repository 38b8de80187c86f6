"""Driven motions keep their branch: near other branches, through change points, over many turns."""

import json
import math
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import assemble, gallery, kinematics, makers
from mbody.analysis.driven.path_following import Runner
from mbody.analysis.driven.time_grid import time_grid
from mbody.analysis.position.assembly_analysis import closed
from mbody.errors import ModelWarning
from mbody.system.rank import dense
from tests import near_grashof

# -- near other branches ----------------------------------------------------------------------


@pytest.mark.slow
def test_near_grashof_linkages_keep_their_branch():
    """Each topology three times, alone and in batches, at 5, 13, 37 and 361 instants; closed forms
    by dyads are the truth. `python -m tests.near_grashof` is the long form.
    """
    found = near_grashof.campaign(3 * len(near_grashof.TOPOLOGIES), seed=3)
    assert set(near_grashof.totals(found)) == {"followed"}, found
    assert found["six-bar alike, 361, together: followed"] > 0


def near_parallelogram(short, start=1.0, speed=10.0):
    return makers.four_bar(1.0 - short, 3.0, 1.0, 3.0, start=start, speed=speed)


def off_its_branch(short, run):
    """Greatest angle of the coupler from its closed form."""
    crank, at = 1.0 - short, run["crank"].angle
    x, y = crank * np.cos(at), crank * np.sin(at)
    apart = np.hypot(3.0 - x, y)
    opening = np.arccos(np.clip((8.0 + apart**2) / (6.0 * apart), -1.0, 1.0))
    wanted = np.arctan2(-y, 3.0 - x) + opening
    return np.abs(np.angle(np.exp(1j * (run["coupler"].angle - wanted)))).max()


@pytest.mark.parametrize("instants", [5, 13, 37, 361])
@pytest.mark.parametrize("short", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_near_parallelograms(short, instants):
    run = kinematics(near_parallelogram(short), turn=True, instants=instants)
    # the last correction of Newton's method, over the sine that is left of a pivot
    assert off_its_branch(short, run) < 1e-12 / math.sqrt(short)
    assert run.status == "completed" and not run.notes
    # the crank is in line with the ground where the others nearly are, and places there are no
    # farther apart than the way in which the branches bend, which goes as a root like a sine
    angle = 1.0 + 10.0 * run.branch.t
    assert abs(math.sin(angle)) < math.sqrt(short)
    assert 0.2 * math.sqrt(short) < run.branch.least < 2.0 * math.sqrt(short)
    assert run.checks.branch == run.branch
    told = json.loads(json.dumps(run.data()))["checks"]["branch"]
    assert told == {"least": run.branch.least, "t": run.branch.t}


def test_batches_beside_another_branch():
    """Designs of which only some come near another branch, all on lanes or beside them."""
    short = 10.0 ** np.linspace(-8.0, -2.0, 33)
    system = assemble(near_parallelogram(1e-3)).with_values({"crank.A.x": 1.0 - short})
    for instants in (2, 3, 37, 361):
        run = kinematics(system, np.linspace(0.0, 0.2 * math.pi, instants))
        for n, one in enumerate(short):
            alone = kinematics(system.design(n), run.t)
            off = np.abs(alone["coupler"].angle - run["coupler"].angle[n]).max()
            assert off < 1e-11 / math.sqrt(one), (instants, one)


def _nearly_stretched(*lengths):
    """An eight-bar whose first two dyads are nearly stretched at the start, of these lengths."""
    first, second = lengths
    points = (0.3644217052080484 + 0.2136868370678442j, 0.7322785841359714 + 0.36106313089160713j)
    third = near_grashof.Dyad(
        (1.1409389035993645, 0.7189782988756648),
        -1,
        (0.5038460945781245 + 0.40273521442795235j, 0.4676930138794112 + 1.2953474168985883j),
    )
    return near_grashof.Linkage(
        "eight-bar alike",
        start=4.432063881634877,
        margin=1.4847718778144457e-05,
        ground=[0.6993379170160092 + 2.3943836657960773j] * 2
        + [2.2053832787637884 + 2.35395884011103j],
        dyads=[near_grashof.Dyad(first, -1, points), near_grashof.Dyad(second, -1, points), third],
    )


def test_designs_close_on_the_branch_of_the_first_however_near_another_one():
    """The correction from a trial position took the constraint Jacobian of that position instead
    of the one that was factored. Near a singular position no damping was then small enough, and
    Levenberg–Marquardt closed the second dyad of the second design on its other side.
    """
    own = (1.7721529656888273, 1.722284993935257)
    one = _nearly_stretched(own, own)
    other = _nearly_stretched(
        (1.7728512714180757, 1.7229832996645054), (1.7721621053339627, 1.7222941335803923)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelWarning)
        for instants in near_grashof.INSTANTS:
            assert near_grashof.batch_of([one, other], instants) == ["followed"] * 2


def test_a_design_on_another_branch_than_the_first_is_reported():
    """Its straight way from the first position ends where its dyad is stretched."""
    pair = [
        near_grashof.Linkage(
            "four-bar", start, 1.0, [place], [near_grashof.Dyad(lengths, 1, (0.5, 0.5))]
        )
        for start, place, lengths in (
            (4.9, 0.13 + 0.65j, (0.75, 0.92)),
            (0.76, -2.05 - 2.14j, (1.43, 2.6)),
        )
    ]
    with pytest.warns(ModelWarning, match="1 design is closed on another branch than the first"):
        assert near_grashof.batch_of(pair, 5) == ["followed", "said"]


# -- change points ----------------------------------------------------------------------------


@pytest.mark.parametrize("instants", [5, 13, 37, 361])
@pytest.mark.parametrize("short", [0.0, 1e-15, 1e-13])
def test_what_is_no_nearer_than_rounding_is_passed_smoothly(short, instants):
    run = kinematics(near_parallelogram(short), turn=True, instants=instants)
    assert_allclose(run["rocker"].angle, run["crank"].angle, rtol=0, atol=1e-6)
    (note,) = run.notes
    assert note.startswith("the motion goes on smoothly through 2 change points")
    assert "180 deg, t = 0.214159 s, of 'crank'; 360 deg, t = 0.528319 s" in note
    assert "in 'O2', 'A', 'B', 'O4'" in note
    assert run.status == "completed" and run.branch.least == 0.0
    assert min(abs(run.branch.t - at) for at in (0.2141592654, 0.5283185307)) < 1e-9


def test_change_points_of_a_batch_are_told():
    system = assemble(near_parallelogram(0.0)).with_values({"crank.A.x": [0.9, 1.0, 0.95]})
    run = kinematics(system, np.linspace(0.0, 0.6, 41))
    (note,) = run.notes
    assert note.startswith("design 1: the motion goes on smoothly through 2 change points")
    assert note == f"design 1: {run.design(1).notes[0]}" and run.design(0).notes == ()


# -- many turns between two instants ----------------------------------------------------------


@pytest.mark.parametrize("turns", [5, 20])
def test_turns_between_two_instants(turns):
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, speed=2.0 * math.pi)
    run = kinematics(machine, t=[0.0, turns])
    assert_allclose(np.diff(run["crank"].angle), 2.0 * math.pi * turns, rtol=0, atol=1e-12)
    for name in ("coupler", "rocker"):
        assert abs(np.diff(run[name].angle)[0]) < 1e-13


def turning():
    """Models of the gallery whose driver makes a whole turn, with the time of one."""
    for name in gallery.names():
        machine = gallery.load(name)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                time = kinematics(machine, turn=True, instants=2).t[-1]
        except (mbody.ModelError, mbody.SolveError):
            continue
        if time > 0.0:
            yield name, machine, time


@pytest.mark.slow
def test_ten_turns_of_the_gallery():
    seen = 0
    for name, machine, time in turning():
        run = kinematics(machine, t=[0.0, 10.0 * time])
        close = kinematics(machine, t=np.linspace(0.0, 10.0 * time, 721))
        for body in run:
            off = abs(run[body].angle[-1] - close[body].angle[-1])
            assert off < 1e-11, (name, body)
        seen += 1
    assert seen >= 10


# -- groups on lanes --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["norton_fourbar", "stephenson_sixbar", "watt_sixbar", "mud_pump"])
def test_pivots_of_a_group_make_its_determinant(name):
    """By both choices of pivots, with its sign: against the determinants of dense blocks."""
    machine = gallery.load(name)
    system = assemble(machine)
    run = kinematics(system, turn=True, instants=361)
    runner = Runner(system, "kinematics")
    start = closed(system, 0.0, {})
    plans = runner.pivots_along(start, time_grid(system, None, None, True, 361))
    n = system.coordinates
    signs = []
    for k in range(0, 361, 30):
        work = system.work()
        work.q[:n, 0] = run.record.table(slice(0, n))[k]
        G = dense(system, work)[1]
        _, whole = np.linalg.slogdet(G)
        for square in plans:
            numbers = {}
            for place, target in zip(square.source, square.target, strict=True):
                numbers[int(target)] = float(work.block[place, 0])
            found = eliminated(square, numbers)
            logs = [
                math.log(abs(square.scale[g]))
                + sum(math.log(abs(found[int(m)])) for m in pivots_of(square, g))
                for g in range(len(square.scale))
            ]
            signs.append(
                [
                    np.sign(square.scale[g])
                    * np.prod([np.sign(found[int(m)]) for m in pivots_of(square, g)])
                    for g in range(len(square.scale))
                ]
            )
            # constants apart the groups make the whole determinant: their product differs from it
            # by the same factor everywhere
            signs[-1].append(sum(logs) + whole)
    table = np.array(signs, dtype=float)
    assert (np.abs(np.diff(table[:, :-1], axis=0)) == 0.0).all()  # this motion keeps its branch
    assert_allclose(table[:, -1], table[0, -1], rtol=0, atol=1e-9)


def pivots_of(square, g):
    return square.group[square.group_start[g] : square.group_start[g + 1]]


def eliminated(square, numbers):
    """The numbers of the LU, pivots inverted, as `factor_square` leaves them; in plain Python."""
    F = {int(n): 0.0 for n in square.fill} | numbers
    for k, pivot in enumerate(square.pivot):
        F[int(pivot)] = 1.0 / F[int(pivot)]
        for a in range(square.low_start[k], square.low_start[k + 1]):
            low = F[int(square.low[a])] * F[int(pivot)]
            for b in range(square.change_start[a], square.change_start[a + 1]):
                F[int(square.change[b])] -= low * F[int(square.change_by[b])]
    return F
