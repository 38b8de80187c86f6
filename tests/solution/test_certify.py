"""What a result certifies of itself: residuals, status and doubts, in every form that it has."""

import contextlib
import copy
import csv
import io
import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

import mbody
import mbody.engineering
from mbody import cli, gallery
from mbody.analysis.driven.driven import analyse_system_at
from mbody.analysis.driven.free_body import member_forces
from mbody.engines.oracle import Reference
from mbody.errors import ModelWarning
from mbody.model.simulation import Instants
from mbody.solution.checks import residual_doubts
from mbody.solution.doubts import Doubt, doubted, inherited, succeeded
from mbody.solution.histories import Record
from mbody.system.assembler import assemble
from tests.support.cases import first_fast
from tests.support.linkages import random_linkage, times_within
from tests.support.oracle_runs import motion_of

DOUBT = Doubt("branch", "it may have leapt at t = 0.3 s", 0.3, ("rod",))


def engine(**more):
    return mbody.makers.slider_crank(1, 4, masses=(1, 2, 3), speed=10.0, **more)


def bent(run, row, by, at=5):
    """The same result with a number changed at one instant: what no analysis gives."""
    pages = run.record.table(slice(None)).copy()
    pages[at, row] += by
    record = Record([np.ascontiguousarray(pages[:, :, None])], len(pages), batch=False)
    changed = pickle.loads(pickle.dumps(run))
    changed.__dict__.pop("certificate", None)
    changed.__dict__.pop("residuals", None)
    object.__setattr__(changed, "record", record)
    return changed


# -- residuals --------------------------------------------------------------------------------


@first_fast("name", gallery.names(), 2)
def test_models_of_the_gallery_are_certain(name):
    """Residuals of right results are thousands of times smaller than what is in doubt."""
    machine = gallery.load(name)
    if machine.simulation:
        run = mbody.simulate(machine)
    else:
        run = analyse_system_at(assemble(machine), "kinetostatics", machine.ask or Instants())
    assert residual_doubts(run) == [] and succeeded(run.ending)


@pytest.mark.parametrize("seed", range(6))
def test_random_linkages_are_certain(seed):
    machine, turn = random_linkage(seed, 1 + seed % 4, extras=bool(seed % 2))
    for verb in (mbody.kinematics, mbody.kinetostatics, mbody.statics):
        run = verb(machine, t=times_within(machine, turn, 7))
        assert run.status == "completed" and run.doubts == () and run.notes == ()


@pytest.mark.parametrize("near", [1e-2, 1e-5, 1e-7])
def test_what_a_dead_centre_makes_of_rounding_is_no_doubt(near):
    """Forces grow as 1/distance there; what is left of them grows with them."""
    lengths = (6, 18, 12, 8)
    end = mbody.driver_range(mbody.makers.four_bar(*lengths, start=math.pi / 2)).low
    machine = mbody.makers.four_bar(*lengths, masses=(1, 2, 3), start=math.pi / 2)
    still = np.zeros(2)
    run = mbody.kinetostatics(
        machine, drive={"motor": (np.array([math.pi / 2, end + near]), still + 1.0, still)}
    )
    assert run.status == "completed"


@pytest.mark.parametrize("free", [7e-3, 0.3, 0.46, 1.0, 2.0])
def test_at_rest_without_loads_rounding_is_no_doubt(free):
    """On a spring of its free length all forces are what rounding of the place makes of them."""
    machine = mbody.Mechanism("block on a spring", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("block", mass=1.7, points={"P": (0.0, 0.0)}, guess=(free, 0.0, 0.0)),
        mbody.Prismatic("rail", "ground", "block"),
        mbody.Spring("spring", "ground.O", "block.P", stiffness=100.0, free_length=free),
    )
    found = mbody.equilibrium(machine)
    assert len(found) == 2 and found.status == "completed"
    for place in found:
        assert place.solution.status == mbody.modes(machine, at=place).status == "completed"
        # a place that is wrong by more than rounding: the force is out of balance as a whole
        off = bent(place.solution, 0, 1e-11 * free, at=0)
        assert "1 of the forces are out of balance" in off.status


@pytest.mark.parametrize(
    ("row", "by", "words"),
    [
        (0, 1e-7, "the constraints are violated by"),
        (13, 1e-3, "of the power is out of balance"),
        (22, 1e-3, "of the forces are out of balance"),
        (4, np.nan, "an unknown part"),
    ],
)
def test_a_number_that_is_wrong_is_in_doubt(row, by, words):
    run = bent(mbody.kinetostatics(engine(), turn=True), row, by)
    assert run.status.startswith("doubtful: ") and run.ending == "completed"
    assert {doubt.kind for doubt in run.doubts} == {"residual"}
    told = " ".join(doubt.message for doubt in run.doubts)
    assert words in told and f"at t = {run.t[5]:.6g} s" in told
    assert all(doubt.t == run.t[5] and doubt.message in run.notes for doubt in run.doubts)
    # the instants before it are certain
    assert run.take(range(5)).status == "completed" and run.take([5]).doubts


def test_of_a_batch_the_design_is_named():
    system = assemble(engine()).with_values({"crank.mass": [1.0, 2.0, 3.0]})
    run = mbody.kinetostatics(system, t=[0.0, 0.1])
    assert run.status == "completed"
    blocks = [block.copy() for block in run.record.blocks]
    blocks[0][1, 0, 2] += 1e-6
    run = replace(run, record=Record(blocks, 3, batch=True))
    assert len(run.doubts) == 1 and run.doubts[0].message.startswith("design 2: ")


def test_residuals_are_looked_at_when_they_are_first_asked_for():
    """They cost a third of the kinetostatics of a turn."""
    run = mbody.kinetostatics(engine(), turn=True)
    run["rod"], run.reaction("A"), run.effort("motor"), run.take([3])
    assert "residuals" not in run.__dict__
    assert run.status == "completed" and "residuals" in run.__dict__


def test_a_driver_that_has_let_go_constrains_nothing():
    machine = gallery.load("norton_fourbar")
    for release in (0.0, 0.1):
        run = mbody.simulate(machine, 0.3, release={"motor": release})
        assert run.released == {"motor": release}
        assert run.checks.constraint < 1e-12 and run.status == "completed"
    on = mbody.simulate(machine, 0.4, start=run)
    assert on.released == {"motor": 0.1} and on.checks.constraint < 1e-12


def test_the_balance_of_energy_is_a_check():
    run = mbody.simulate(gallery.load("free_fourbar"), 0.5)
    worst = np.abs(run.energy.balance).max() / run.energy.size
    assert run.checks.energy == worst == run.data()["checks"]["energy"]
    assert mbody.kinetostatics(engine()).checks.energy is None


# -- doubts in every form ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def doubtful():
    return doubted(mbody.kinetostatics(engine(), turn=True), [DOUBT])


def test_words():
    endings = ["completed", "ended: at t = 1 s, 'x' is zero", "stopped: by the user", "doubtful: x"]
    assert [succeeded(status) for status in endings] == [True, True, False, False]


def test_a_doubt_decides_and_how_it_ended_is_kept(doubtful):
    assert doubtful.status == f"doubtful: {DOUBT.message}" and doubtful.doubts == (DOUBT,)
    assert doubtful.notes == (DOUBT.message,) and doubtful.ending == "completed"
    assert doubted(doubtful, [DOUBT]).doubts == (DOUBT,)
    early = doubtful.take(np.flatnonzero(doubtful.t < 0.3))
    assert (early.status, early.doubts, early.notes) == ("completed", (), ())
    assert doubtful.take([-1]).doubts == (DOUBT,)
    assert pickle.loads(pickle.dumps(doubtful)).doubts == (DOUBT,)


def test_files_hold_doubts(doubtful, tmp_path):
    told = [DOUBT.data()]
    data = json.loads(json.dumps(doubtful.data()))
    assert data["status"] == doubtful.status and data["doubts"] == told
    mbody.save_run(doubtful, tmp_path / "run.npz")
    again = mbody.load_run(tmp_path / "run.npz")
    assert again.status == doubtful.status and again.doubts == (DOUBT,)
    assert again.ending == "completed" and again.notes == doubtful.notes
    doubtful.to_npz(tmp_path / "columns.npz")
    with np.load(tmp_path / "columns.npz") as file:
        assert json.loads(str(file["certificate"]))["doubts"] == told
    assert "STATUS   doubtful: it may have leapt" in str(doubtful)
    assert "NOTE" not in str(doubtful)
    two = doubted(doubtful, [Doubt("energy", "the energy grows")])
    assert "DOUBT   the energy grows" in str(two)


def test_what_is_made_of_a_result_inherits_its_doubts(doubtful):
    for made in (
        mbody.free_body(doubtful, "rod"),
        member_forces(doubtful),
        mbody.engineering.fluctuation(doubtful),
        mbody.engineering.shaking_force(doubtful),
        mbody.crosscheck(engine(), "pinocchio", ours=doubtful),
    ):
        assert made.doubts[0] == DOUBT and made.status == doubtful.status
        assert DOUBT.message in made.notes
    with pytest.warns(
        ModelWarning,
        match="flywheel: the motion for its size is doubtful: it may have leapt",
    ):
        mbody.engineering.flywheel(doubtful, 0.02)
    swing = gallery.load("simple_pendulum")
    rest = mbody.equilibrium(swing)[0]
    held = doubted(rest.solution, [Doubt("singular", "it is singular there")])
    linear = mbody.engineering.linearize(swing, at=held)
    assert linear.status == "doubtful: it is singular there" == linear.data()["status"]
    found = mbody.modes(swing, at=held)
    assert found.status == found[0].status == linear.status
    assert found.data()["doubts"] == [doubt.data() for doubt in held.doubts]
    assert "STATUS   doubtful" in str(found)
    assert mbody.modes(swing).status == "completed"
    assert mbody.driver_range(mbody.makers.four_bar(6, 18, 12, 8, start=1.6)).status == "completed"
    assert inherited(rest.solution)["status"] == "completed"


def run_command(*arguments):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = cli.main(list(arguments))
    return status, out.getvalue(), err.getvalue()


def test_the_command_ends_with_1_on_doubt(doubtful, monkeypatch):
    monkeypatch.setattr("mbody.analysis.driven.driven.analyse_at", lambda *given: doubtful)
    status, out, _ = run_command("kinetostatics", "slider_crank", "--json")
    assert status == 1 and json.loads(out)["doubts"] == [DOUBT.data()]
    status, out, err = run_command("kinetostatics", "slider_crank", "--csv", "-")
    assert status == 1 and err == f"mbody: doubtful: {DOUBT.message}\n"
    assert len(list(csv.reader(io.StringIO(out)))) == len(doubtful) + 1
    status, out, err = run_command("kinetostatics", "slider_crank")
    assert status == 1 and "STATUS   doubtful: it may have leapt" in out and not err


def test_designs_in_doubt_are_told_of_a_sweep(monkeypatch, tmp_path):
    from mbody.sweeps import job

    real = job.simulate

    def some(system, **how):
        run = real(system, **how)
        return doubted(run, [DOUBT]) if float(system.values["pendulum.mass"]) > 2.5 else run

    monkeypatch.setattr(job, "simulate", some)
    swing = gallery.load("simple_pendulum")
    watched = {"events": [mbody.Event("pendulum.omega")], "until": 0.3}
    masses = {"pendulum.mass": [1.0, 2.0, 3.0]}
    ask = (swing, masses, "simulate", "last(pendulum.angle)")
    found = mbody.sweep(*ask, **watched)
    assert found.status == f"doubtful: 1 of 3 designs, as design 2: {DOUBT.message}"
    assert [doubt.message for doubt in found.doubts] == [f"design 2: {DOUBT.message}"]
    assert found.columns()["doubt"] == ["", "", DOUBT.message] and not found.failures
    assert f"  design 2: {DOUBT.message}" in str(found)
    assert mbody.sweep(swing, {"pendulum.mass": [1.0]}, *ask[2:], **watched).status == "completed"
    pytest.importorskip("pyarrow")
    stored = mbody.sweep(*ask, to=tmp_path / "sweep", **watched)
    assert stored.doubts == found.doubts and stored.status == found.status


# -- what redundant rows leave open -----------------------------------------------------------


def coupled(*names):
    """Two shafts tied to each other by equal chains, a motor on one and a load on the other."""
    machine = mbody.Mechanism("chains", ground={"A": (0.0, 0.0), "B": (2.0, 0.0)})
    machine.add(
        mbody.Body("a", mass=1.0, inertia=0.2),
        mbody.Body("b", mass=1.0, inertia=0.3),
        mbody.Revolute("A", "ground.A", "a"),
        mbody.Revolute("B", "ground.B", "b"),
        *(
            mbody.AngleCoupling(
                name, [mbody.CouplingTerm(1, angle="a"), mbody.CouplingTerm(-1, angle="b")]
            )
            for name in names
        ),
        mbody.AngleDriver("motor", "a", mbody.laws.ConstantAcceleration(0.0, 1.0, 2.0)),
        mbody.Torque("load", "b", value=-5.0),
    )
    return machine


def test_efforts_that_redundancy_leaves_open():
    """Of two equal chains each carries any part of the whole, which is one torque."""
    one = mbody.kinetostatics(coupled("chain"))
    assert one.unique_effort("chain") is True and one.unique_effort("motor") is True
    two = mbody.kinetostatics(coupled("first", "second"))
    # by the balance of shaft b, on which the chains have the factor -1: 5 N·m and 0.3 · 2
    assert one.effort("chain") == pytest.approx(-5.6, rel=1e-12)
    assert two.effort("first") + two.effort("second") == pytest.approx(one.effort("chain"))
    assert two.unique_effort("first") is False and two.unique_effort("motor") is True
    told = two.data()
    assert told["unique_efforts"] == {"first": False, "second": False, "motor": True}
    assert told["reactions"]["A"]["unique"] == [True, True, True]
    assert two.notes == (
        "rows are redundant: the efforts of 'first', 'second' are not unique, those of least norm "
        "are given; take off what repeats, or give it play",
    )
    assert two.status == "completed"
    with pytest.raises(mbody.ModelError, match="there is no driver 'A'"):
        two.unique_effort("A")
    followed = mbody.simulate(coupled("first", "second"), 0.1)
    assert followed.unique_effort("first") is False and followed.unique_effort("motor") is True


@pytest.mark.parametrize("verb", ["kinetostatics", "statics"])
@pytest.mark.parametrize(
    "make", [lambda: gallery.load("parallel_cranks"), lambda: coupled("x", "y")]
)
def test_the_null_space_says_what_is_not_unique(verb, make):
    """The dense oracle: multipliers that Φ_qᵀ takes to nothing, and the rows that they reach."""
    machine = make()
    run = getattr(mbody, verb)(machine)
    oracle = Reference(machine)
    q = motion_of(run)[0][0]
    rows = oracle.phi_q(q, 0.0)
    _, sizes, ways = np.linalg.svd(rows.T)
    free = ways[(sizes > 1e-10 * sizes[0]).sum() :]
    assert len(free)
    unique = oracle.kinetostatics(*(part[0] for part in motion_of(run)), 0.0)["unique"]
    columns, told = run.columns(), run.data()
    for joint in machine.joints:
        assert told["reactions"][joint.name]["unique"] == list(unique[joint.name])
        assert (columns[f"{joint.name}.unique"] == float(all(unique[joint.name]))).all()
    for element in (*machine.couplings, *machine.drivers):
        alone = bool(np.abs(free[:, oracle.rows[element.name]]).max() < 1e-9)
        assert run.unique_effort(element.name) is alone is told["unique_efforts"][element.name]
        assert (columns[f"{element.name}.unique"] == float(alone)).all()
    names = [joint.name for joint in machine.joints if not all(unique[joint.name])]
    assert len(run.notes) == 1 and all(f"'{name}'" in run.notes[0] for name in names)
    assert mbody.kinematics(machine).notes == ()


def test_an_attribute_that_is_not_there_names_what_is_meant():
    """Elements by how they are read, other words by ours; copies and pickles are as before."""
    run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    meant = {
        "run['crank']": lambda: run.crank,
        r"run.reaction\('A'\)": lambda: run.A,
        r"run.effort\('motor'\)": lambda: run.motor,
        "mean 'angle'": lambda: run["crank"].theta,
        "mean 'fx'": lambda: run.reaction("A").x,
        "it has: name, x, y": lambda: run["crank"].speed,
    }
    for words, read in meant.items():
        with pytest.raises(AttributeError, match=words.replace("[", r"\[")):
            read()
    assert not hasattr(run, "nothing") and pickle.loads(pickle.dumps(run)).t[0] == run.t[0]
    assert copy.deepcopy(run["crank"]).x[0] == run["crank"].x[0]
