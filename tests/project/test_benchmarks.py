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

from benchmarks import page, results, targets
from benchmarks.frame import OURS, Engine, Row, Scope, Trial, race, sufficient_trial
from benchmarks.questions import QUESTIONS, contacts, sweeps
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


def test_what_a_peer_is_not_asked_stands_below_the_errors():
    rows = [
        made("contacts", "ball, error 1e-03", OURS, 0.01),
        contacts.unstated("vehicle", "peer", "one coefficient"),
    ]
    text = page.table(rows)
    assert "10 ms (1.0e-07)" in text and "peer: one coefficient" in text


# -- many designs -----------------------------------------------------------------------------

#: Of forces by two routes: lanes accept a last correction of 1e-12, times the condition of the
#: loops, which is below 10.
TURN = 1e-11
DESIGNS = 3


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


# -- results and the page ---------------------------------------------------------------------


def made(question, workload, engine, seconds, **more):
    return Row(question, workload, engine, 1e-7, seconds, 3, 1.0, **more)


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
