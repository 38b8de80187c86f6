"""The frame of the benchmarks: what is chosen and reported, and that the engines run one model.

No wall time is asserted; what is compared are choices among given times, and accelerations.
"""

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest

import mbody
from benchmarks import models, page, results, studies, targets
from benchmarks.frame import OURS, Engine, Row, Scope, Trial, in_turn, race, sufficient_trial
from benchmarks.peers import by_hand, closed_form, kinetostatic
from benchmarks.peers.dyads import dyad_order, dyad_positions
from benchmarks.planar import Pin, Planar, Rim, absolute, planar
from benchmarks.questions import QUESTIONS, andrews, bodies, contacts, sweeps
from tests.support.paths import ROOT

COMMAND = (sys.executable, "-m", "benchmarks")
KEYS = {"question", "workload", "engine", "error", "median_s", "runs", "ratio_to_mbody"}
#: Of accelerations by two routes: rounding by the condition of some ten bodies.
ROUNDING = 1e-10


# -- what counts as sufficient ----------------------------------------------------------------


def test_the_fastest_setting_within_the_error_is_chosen():
    tried = [Trial(1, 1.0, 1e-2), Trial(2, 3.0, 1e-5), Trial(3, 2.0, 1e-6), Trial(4, 4.0, 1e-7)]
    assert sufficient_trial(tried, 1e-4) is tried[2]
    assert sufficient_trial(tried, 1e-8) is None


def test_a_lucky_crossing_is_not_accuracy():
    tried = [Trial(1, 1.0, 1e-9), Trial(2, 2.0, 1e-3), Trial(3, 3.0, 1e-7), Trial(4, 4.0, 1e-8)]
    assert sufficient_trial(tried, 1e-6) is tried[2]
    assert sufficient_trial(tried, 1e-8) is tried[3]  # the last one has nothing behind it


def engine(name, errors):
    """An engine whose setting n is off by errors[n]."""

    def prepare(setting):
        return lambda: np.array([errors[setting]])

    return Engine(name, range(len(errors)), prepare, lambda found: (found, found))


def off(angle, rate):
    return float(angle[0])


def test_rows_of_a_race():
    engines = [engine(OURS, [1e-2, 1e-4, 1e-7, 1e-10]), engine("peer", [1e-1, 1e-5, 1e-5])]
    rows = race("q", "w", engines, off, Scope(runs=3), levels=(1e-3, 1e-6))
    by = {(row.workload, row.engine): row for row in rows}
    assert by["w, error 1e-03", OURS].ratio_to_mbody == 1.0
    assert by["w, error 1e-03", OURS].error <= 1e-3
    assert by["w, error 1e-03", "peer"].ratio_to_mbody > 0.0
    missed = by["w, error 1e-06", "peer"]
    assert (missed.median_s, missed.ratio_to_mbody, missed.runs) == (None, None, 0)
    assert missed.error == 1e-5
    best = "w, as exact as peer gets"
    assert by[best, "peer"].error == 1e-5
    assert by[best, OURS].error <= 1e-5
    assert by[best, "peer"].runs == 3


def test_a_setting_that_fails_is_passed_over():
    def prepare(setting):
        if setting:
            raise ArithmeticError("the step is too small")
        return lambda: np.array([1e-5])

    broken = Engine("peer", range(3), prepare, lambda found: (found, found))
    rows = race("q", "w", [engine(OURS, [1e-6, 1e-6]), broken], off, Scope(runs=1), (1e-4,))
    assert [row.error for row in rows] == [1e-6, 1e-5]


# -- one model for all ------------------------------------------------------------------------


def alpha(system):
    """Angular accelerations at the start, by mbody."""
    run = mbody.simulate(system, 1e-9, instants=2)
    return np.array([run[body.name].alpha[0] for body in system.mechanism.bodies])


@pytest.mark.parametrize("shape", models.SHAPES)
def test_sparse_equations_agree_with_mbody(shape):
    system = mbody.assemble(models.SHAPES[shape](10))
    ours, other = alpha(system), bodies.accelerations(planar(system))
    assert np.abs(ours - other).max() <= ROUNDING * np.abs(ours).max()


def test_equation_of_the_four_bar_by_hand():
    system = mbody.assemble(mbody.gallery.load("free_fourbar"))
    found = by_hand.four_bar(0.0, np.array([math.pi / 3.0, 0.0]))
    assert found[1] == pytest.approx(alpha(system)[0], rel=ROUNDING)


def test_equations_of_andrews_by_hand():
    system = mbody.assemble(mbody.gallery.load("andrews_squeezer"))
    machine = planar(system)
    y = np.append(andrews.angles_of(machine.pose[:, 2]), np.zeros(7))
    ours = andrews.angles_of(alpha(system))
    assert np.abs(by_hand.andrews(0.0, y)[7:] - ours).max() <= ROUNDING * np.abs(ours).max()


def test_positions_dyad_by_dyad():
    from mbody.topologies.dataset import random_linkages

    arrays = random_linkages(2, 7, np.random.default_rng(3))
    found = mbody.linkages(arrays, instants=41)
    for n in range(0, len(found), 5):
        links, fixed = arrays["links"][n].tolist(), arrays["ground"][n].tolist()
        paths = dyad_positions(arrays["joints"][n], links, fixed, 41)
        # closed loops are off by rounding over the sine of the least angle, 0.1
        assert np.abs(paths.swapaxes(0, 1) - found.positions[n]).max() <= ROUNDING
    with pytest.raises(ValueError, match="not of dyads"):
        dyad_order([[0, 1], [1, 2]], [0], [0, 1])


def test_equations_of_a_chain_by_hand():
    system = mbody.assemble(models.chain(7))
    slope = by_hand.chain(7, models.LENGTH, models.MASS, models.G)
    ours = alpha(system)
    assert np.abs(slope(0.0, np.zeros(14))[7:] - ours).max() <= ROUNDING * np.abs(ours).max()


@pytest.mark.parametrize("shape", models.SHAPES)
def test_angles_of_a_tree_and_back(shape):
    machine = planar(mbody.assemble(models.SHAPES[shape](9)))
    tree = machine.tree()
    assert sorted(tree.order) == list(range(machine.bodies))
    assert len(tree.loops) == len(machine.pins) - machine.bodies
    assert absolute(tree, machine.relative(tree)[0]) == pytest.approx(machine.pose[:, 2], abs=1e-15)


#: A peer's own exactness: Pinocchio's loops by μ = 1e-10, MuJoCo's by springs.
PEERS = {
    "pinocchio": ("pin_task", {"chain": 1e-10, "ladder": 1e-8, "tree": 1e-10, "hub": 1e-10}),
    "mujoco": ("mujoco_task", {"chain": 1e-10, "ladder": 1e-2, "tree": 1e-10, "hub": 1e-10}),
}


@pytest.mark.parametrize("shape", models.SHAPES)
@pytest.mark.parametrize("peer", PEERS)
def test_accelerations_of_a_peer(peer, shape):
    pytest.importorskip(peer)
    maker, allowed = PEERS[peer]
    machine = planar(mbody.assemble(models.SHAPES[shape](9)))
    reference = bodies.accelerations(machine)
    found = getattr(bodies, maker)(machine)[1]
    assert np.abs(found - reference).max() <= allowed[shape] * np.abs(reference).max()


# -- contact ----------------------------------------------------------------------------------


def test_the_ball_in_closed_form_rises_to_the_square_of_what_it_keeps():
    first = math.sqrt(2.0 * (contacts.HIGH - contacts.RADIUS) / contacts.G)
    top = first * (1.0 + contacts.RETURNED)  # of the flight after the first impact
    high = contacts.RADIUS + contacts.RETURNED**2 * (contacts.HIGH - contacts.RADIUS)
    assert contacts.ball_at(top) == pytest.approx(high, rel=ROUNDING)


@pytest.mark.parametrize("pulls", [False, True])
@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.8])
def test_a_spring_and_damper_return_what_is_asked(restitution, pulls):
    ratio = contacts.damping_ratio(restitution, pulls=pulls)
    turn, step = math.sqrt(1.0 - ratio**2), 1e-4
    # at a rate of 1: x = exp(-ratio t) sin(turn t) / turn, until x or its acceleration is zero
    times = np.arange(step, math.pi / turn, step)
    gap = np.exp(-ratio * times) * np.sin(turn * times) / turn
    speed = np.exp(-ratio * times) * np.cos(turn * times) - ratio * gap
    pushes = gap + 2.0 * ratio * speed > 0.0
    last = len(times) - 1 if pulls else np.flatnonzero(pushes)[-1]
    assert -speed[last] == pytest.approx(restitution, abs=2.0 * step)


@pytest.mark.parametrize("standing", [False, True])
def test_the_leg_of_a_peer_falls_and_stands_as_ours(standing):
    pytest.importorskip("mujoco")
    skipped = 200 if standing else 0
    ours = contacts.our_leg(standing, skipped, 5, method="dop853")[1]
    theirs = contacts.mujoco_leg(standing, skipped, 5, 1, contacts.Soft(12, True))[1]
    # in flight two integrators, standing a spring in place of the floor
    assert np.abs(ours - theirs).max() <= (5e-3 if standing else ROUNDING)


def test_peers_get_the_numbers_of_the_woodpecker():
    scene = contacts.woodpecker()
    plain = scene.plain
    assert plain.mass == pytest.approx([0.3e-3, 4.5e-3]) and plain.held == [(0, 0)]
    assert plain.wall[0] == pytest.approx((2.5e-3, 0.0)) and plain.twists == [(0, 1, 5.6e-3)]
    assert plain.wall[1] == pytest.approx((1.0, 0.0), abs=ROUNDING)
    assert [(one.body, one.friction, one.restitution) for one in plain.rims] == [
        (1, 0.3, 0.5),
        (0, 0.3, 0.0),
        (0, 0.3, 0.0),
    ]


def test_what_a_push_has_to_move_by_hand():
    """Of a free body 1/(1/m + d²/I), of one in a pin its inertia about it by the squared arm."""
    pose, rest, rim = (
        np.array([[0.0, 0.0, 0.3]]),
        np.zeros((1, 3)),
        Rim(0, (0.2, 0.1), 0.0, 0.0, 0.0),
    )
    arm = 0.2 * math.cos(0.3) - 0.1 * math.sin(0.3)
    free = Planar(np.array([2.0]), np.array([0.05]), pose, rest, [])
    assert free.mass_at(rim) == pytest.approx(1.0 / (1.0 / 2.0 + arm**2 / 0.05), rel=ROUNDING)
    pin = Pin(-1, 0, (0.0, 0.0), (-0.1, 0.0))
    pinned = Planar(np.array([2.0]), np.array([0.05]), pose, rest, [pin])
    about = 0.05 + 2.0 * 0.1**2
    assert pinned.mass_at(rim) == pytest.approx(about / (arm + 0.1 * math.cos(0.3)) ** 2, rel=1e-12)


@pytest.mark.parametrize("peer", ["mujoco", "pymunk", "exudyn"])
def test_a_peer_falls_bounces_and_is_in_flight_again(peer):
    pytest.importorskip(peer)
    scene = contacts.ball()
    choice = contacts.Rigid(10, False) if peer == "pymunk" else contacts.Soft(12, False)
    end = getattr(contacts, f"{peer}_motion")(scene, choice, 20_000)()
    assert abs(end()[0, 1] - contacts.ball_at(scene.until)) < 5e-3


def test_what_a_peer_is_not_asked_stands_below_the_errors():
    rows = [
        made("contacts", "ball, error 1e-03", OURS, 0.01),
        contacts.unstated("vehicle", "peer", "one coefficient"),
    ]
    text = page.table(rows)
    assert "10 ms (1.0e-07)" in text and "peer: one coefficient" in text


def test_exudyn_makes_the_same_four_bar():
    exudyn = pytest.importorskip("exudyn")
    assert exudyn is not None
    from benchmarks.peers import exudyn as peer

    system = mbody.assemble(mbody.gallery.load("free_fourbar"))
    engine = peer.engine(planar(system), 0.1, (200,))
    found = engine.state(engine.prepare(200)())[0]
    run = mbody.simulate(system, 0.1, rtol=1e-10, instants=2)
    exact = np.array([run[body.name].angle[-1] for body in system.mechanism.bodies])
    assert np.abs(found - exact).max() <= 1e-5  # of second order: h^2 is 2.5e-7


# -- many designs -----------------------------------------------------------------------------

#: Of forces by two routes: lanes accept a last correction of 1e-12, times the condition of the
#: loops, which is below 10.
TURN = 1e-11
DESIGNS = 3


def turns(study):
    """A sweep of a few designs, and each of them by itself."""
    system = mbody.assemble(study.build())
    found = study.sweep(system, DESIGNS, 1)
    runs = [
        mbody.kinetostatics(found.design(n), turn="motor", instants=studies.POSITIONS)
        for n in range(DESIGNS)
    ]
    return found, runs


def crank_of(run):
    return closed_form.Crank(*(getattr(run["crank"], n) for n in ("angle", "omega", "alpha")))


@pytest.mark.parametrize(
    "form", ["four_bars", "all_of_four_bars", "book_four_bars", "nine_equations"]
)
def test_four_bars_by_hand(form):
    found, runs = turns(studies.FOUR_BAR)
    numbers = {n: values[:, None] for n, values in studies.norton_numbers(found).items()}
    parts = getattr(closed_form, form)(numbers, crank_of(runs[0]))
    for n, run in enumerate(runs):
        force = run.reaction("A")
        size = force.magnitude.max()
        for ours, theirs in zip((force.fx, force.fy), parts):
            assert np.abs(ours - theirs[n]).max() <= TURN * size
        for joint, (x, y) in zip(("O2", "B", "O4"), zip(parts[2:8:2], parts[3:8:2])):
            ours = run.reaction(joint).magnitude
            assert np.abs(ours - np.hypot(x[n], y[n])).max() <= TURN * size
        for torque in parts[8:]:
            ours = run.effort("motor")
            assert np.abs(ours - torque[n]).max() <= TURN * np.abs(ours).max()


def test_slider_cranks_by_hand():
    found, runs = turns(studies.SLIDER_CRANK)
    numbers = {n: values[:, None] for n, values in studies.SLIDER_CRANK.numbers(found).items()}
    force = np.hypot(*closed_form.slider_cranks(numbers, crank_of(runs[0])))
    for n, run in enumerate(runs):
        ours = run.reaction("A").magnitude
        assert np.abs(ours - force[n]).max() <= TURN * ours.max()


def test_designs_of_a_chunk_and_of_a_thread_are_the_same():
    found, runs = turns(studies.SLIDER_CRANK)
    numbers = {
        n: np.resize(v, 2 * closed_form.CHUNK + 1)
        for n, v in studies.SLIDER_CRANK.numbers(found).items()
    }
    how = closed_form.slider_cranks, numbers, crank_of(runs[0])
    one, two = closed_form.peaks(*how), closed_form.on_threads(2, *how)
    assert np.array_equal(one, two)
    assert np.array_equal(one, np.resize(one[:DESIGNS], len(one)))
    assert one[:DESIGNS] == pytest.approx(found["peak(A.force)"], rel=TURN)


def test_the_eight_bar_turns_fully_and_far_from_its_dead_centres():
    machine = models.eight_bar()
    assert (len(machine.bodies), len(machine.joints)) == (7, 10)
    run = mbody.kinetostatics(machine, turn="motor")
    for coupler, rocker in (("coupler", "rocker"), ("link", "middle"), ("second", "output")):
        across = np.abs(np.sin(run[rocker].angle - run[coupler].angle))
        assert across.min() > math.sin(math.radians(46.0))


@pytest.mark.parametrize("study", [*studies.SIX_BARS, studies.EIGHT_BAR], ids=lambda s: s.name)
def test_forces_where_loops_are_cut(study):
    pytest.importorskip("pinocchio")
    _, runs = turns(study)
    found = sweeps.cuts([run.system for run in runs], "B")()
    assert found == pytest.approx([r.reaction("B").magnitude.max() for r in runs], rel=TURN)


@pytest.mark.parametrize("peer", ["pinocchio", "mujoco"])
def test_four_bars_of_a_peer(peer):
    pytest.importorskip(peer)
    found, runs = turns(studies.FOUR_BAR)
    loop = sweeps.each(getattr(kinetostatic, f"{peer}_loop"), found, DESIGNS)
    assert loop() == pytest.approx([r.reaction("A").magnitude.max() for r in runs], rel=TURN)


@pytest.mark.slow
def test_rows_of_sweeps(monkeypatch):
    few = {"driven": (64, 64), "tolerances": (640, 640), "free": (4, 4)}
    monkeypatch.setattr(sweeps, "DESIGNS", few)
    # loops in Python do two designs each, not ten, and free motions are short
    for name, less in (("FEW", 2), ("FREE_FEW", 2), ("UNTIL", 2.0)):
        monkeypatch.setattr(sweeps, name, less)
    rows = sweeps.measure(Scope(short=True, runs=1))
    for row in rows:
        assert row.median_s > 0.0 and row.ratio_to_mbody > 0.0 and set(row.short()) >= KEYS
        if row.bytes is None:
            assert row.error <= (sweeps.LEVEL if "free" in row.workload else TURN)
    kept = [row for row in rows if row.bytes is not None]
    assert [row.workload.split()[0] for row in kept] == ["640", "64"]
    driven = [row for row in rows if row.engine == OURS and "positions" in row.workload]
    assert len(driven) == 5
    assert all(page.each(row).endswith(" a position") for row in driven)


def test_times_are_divided_by_the_share_that_was_done():
    clock = iter(np.cumsum([0.0, *[1.0] * 100]))  # a call lasts a second
    rows = in_turn(
        *("q", "w", {OURS: int, "peer, of 2 designs": int}, {}, Scope(runs=1)),
        parts={"peer, of 2 designs": 0.01},
        clock=lambda: float(next(clock)),
    )
    assert [row.median_s for row in rows] == [1.0, pytest.approx(100.0)]
    assert rows[1].ratio_to_mbody == pytest.approx(100.0)


# -- results and the page ---------------------------------------------------------------------


def made(question, workload, engine, seconds, **more):
    return Row(question, workload, engine, 1e-7, seconds, 3, 1.0, **more)


def test_exponents_are_of_all_sizes():
    rows = [
        made("bodies", f"chain of {n}, one evaluation", OURS, 2e-7 * n**1.02) for n in (10, 100)
    ]
    assert targets.exponents(rows)["chain", OURS] == pytest.approx(1.02, rel=1e-12)


def test_a_goal_is_met_or_missed():
    four = "free_fourbar to 10 s, error 1e-06"
    rows = [made("fourbar", four, OURS, 0.002), made("fourbar", four, "Pinocchio + DOP853", 0.002)]
    lines = {line[0]: line[3] for line in targets.targets(rows)}
    assert lines["four-bar to 1e-6"] == "met"  # 2 ms of 3
    assert lines["four-bar to 1e-6: Pinocchio + DOP853 by mbody"] == "missed"  # once of 15 times


def test_goals_of_sweeps():
    turned = "10000 four-bars × 360 positions"
    hand = "NumPy by hand, all pins and the torque"
    rows = [
        made("sweeps", turned, OURS, 0.2),
        Row("sweeps", turned, hand, 1e-14, 0.3, 3, 1.5),
        Row("sweeps", turned, f"{hand}, two threads", 1e-14, 0.1, 3, 0.5),
        made("sweeps", "100000 slider-cranks, memory", OURS, 2.0, bytes=2.5e8),
    ]
    lines = {line[0]: line[2:] for line in targets.targets(rows)}
    assert lines["10⁴ four-bars × 360, two threads"] == ["0.2 s", "met"]
    assert lines["the same, the goal beyond"] == ["0.2 s", "missed"]
    one = "the same: all reactions by hand in NumPy, one thread, by mbody"
    assert lines[one] == ["1.5×", "met"]
    assert lines["the same: the fastest NumPy by hand by mbody"] == ["0.5×", "missed"]
    assert lines["their memory beyond the import"] == ["250 MB", "met"]


def test_questions_of_one_commit_share_a_file(tmp_path):
    first, again = made("a", "w", OURS, 1.0), made("a", "w", OURS, 2.0)
    other = made("b", "w", OURS, 3.0)
    path = results.keep([first], short=False, folder=tmp_path)
    assert results.keep([other], short=False, folder=tmp_path) == path
    results.keep([again], short=False, folder=tmp_path)
    (kept,) = results.kept(tmp_path)
    assert sorted(row["median_s"] for row in kept["rows"]) == [2.0, 3.0]
    assert set(kept["versions"]) >= {"numpy", "numba"}


def test_the_page_is_made_of_the_files(tmp_path):
    four = "free_fourbar to 10 s, error 1e-06"
    rows = [
        made("fourbar", four, OURS, 0.002),
        Row("fourbar", four, "peer", 1e-7, 0.001, 3, 0.5),
        Row("fourbar", four, "slow", 2e-3, None, 0, None),
        made("bodies", "chain of 10, one evaluation", OURS, 1e-6),
        made("memory", "chain of 10, bytes a body", OURS, 1.0, bytes=2048.0),
    ]
    results.keep(rows, short=False, folder=tmp_path)
    written = tmp_path / "README.md"
    written.write_text(f"head\n{page.BEGIN}\nold\n{page.END}\ntail\n", "utf-8")
    page.write(written, tmp_path)
    text = written.read_text("utf-8")
    assert text.startswith("head\n") and text.endswith("tail\n") and "old" not in text
    assert "1 ms, 0.5× (1.0e-07)" in text
    assert "not reached (2.0e-03)" in text
    assert "* free_fourbar to 10 s, error 1e-06: peer takes 0.50 of our time" in text
    assert "2 KiB" in text


def test_the_page_shows_the_newest_of_a_machine(tmp_path, monkeypatch):
    rows = [made("positions", "w", OURS, 1.0)]
    for time, commit, own in (
        (3, "new", rows),
        (2, "other", [*rows, made("windows", "w", OURS, 2.0)]),
        (1, "old", rows),
    ):
        about = {**results.about(short=False), "at": time, "commit": commit}
        monkeypatch.setattr(results, "about", lambda *, short, about=about: about)
        results.keep(own, short=False, folder=tmp_path)
    written = tmp_path / "README.md"
    written.write_text(f"{page.BEGIN}\n{page.END}\n", "utf-8")
    page.write(written, tmp_path)
    text = written.read_text("utf-8")
    first, second = text.split("## Earlier results")
    new, other = first.split("commit other")
    assert "commit new" in new and new.count("### ") == other.count("### ") == 1
    assert "commit old" in second and "commit new" not in second


def test_every_question_has_its_file():
    files = {path.stem for path in (ROOT / "benchmarks" / "questions").glob("[a-z]*.py")}
    assert files == set(QUESTIONS)


@pytest.mark.slow
def test_json_of_the_command():
    run = subprocess.run(
        [*COMMAND, "long_chain", "positions", "--short", "--json", "--runs", "1"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    rows = json.loads(run.stdout)
    assert {row["question"] for row in rows} == {"long_chain", "positions"}
    assert all(set(row) == KEYS for row in rows)
    # energy of the chain at rtol 1e-8: some hundred steps of that error
    assert rows[0]["error"] < 1e-6
    # the torque beside nine equations written by hand: rounding near the toggles
    assert all(row["error"] < 1e-10 for row in rows if row["question"] == "positions")


def test_a_question_that_there_is_not():
    run = subprocess.run(
        [*COMMAND, "fivebar"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 2
    assert "no question fivebar: there are fourbar," in run.stderr
