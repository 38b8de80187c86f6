"""Batches: one topology with many sets of numbers, and the same system in two threads."""

import math
import pickle
import threading
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import (
    AngleDriver,
    Body,
    Force,
    Gravity,
    Mechanism,
    ModelError,
    Revolute,
    SolveError,
    Spring,
    Torque,
    assemble,
    kinematics,
    kinetostatics,
    polar,
    statics,
)
from mbody.analysis.driven.runner import Runner
from mbody.compiler.lanes import LANES
from mbody.engineering import close_loops
from mbody.engines.oracle import Reference
from mbody.laws import ConstantAcceleration, Harmonic, Polynomial
from mbody.makers import makers
from mbody.model.loads import CustomLoad

DESIGNS = 2 * LANES + 9
# uneven, with an instant given twice
TIMES = np.concatenate([np.linspace(0.0, 0.1, 4), np.geomspace(0.11, 0.9, 9), [0.9, 0.93]])


def four_bar(**changes):
    """A four-bar with a point of every sort and a load of several."""
    number = {
        "A.x": 1.0, "A.y": 0.0, "mass": 2.0, "inertia": 0.2, "weight": 30.0, "cg.r": 1.4,
        "cg.angle": 0.3, "P.r": 2.0, "P.angle": 0.5, "value": 0.6, "speed": 5.0, "push": 20.0,
        "push.angle": 0.8, "c0": 1.0, "c1": 2.0, "stiffness": 40.0, "free_length": 0.5,
        "preload": 3.0, "mean": -9.81, "O4.x": 3.5, "frequency": 7.0,
    } | changes  # fmt: skip
    machine = Mechanism("four-bar", g=9.9, ground={"O2": (0.0, 0.0), "O4": (number["O4.x"], 0.0)})
    machine.add(
        Body(
            "crank",
            mass=number["mass"],
            inertia=number["inertia"],
            cg=(0.4, 0.1),
            points={"O": (0.0, 0.0), "A": (number["A.x"], number["A.y"])},
        ),
        Body(
            "coupler",
            weight=number["weight"],
            inertia=0.8,
            cg=polar(number["cg.r"], number["cg.angle"]),
            points={
                "A": (0.0, 0.0),
                "B": polar(3.0, 0.0),
                "P": polar(number["P.r"], number["P.angle"]),
            },
            guess=0.4,
        ),
        makers.bar("rocker", 2.0, mass=3.0, guess=1.6),
        Revolute("O2", "ground.O2", "crank.O"),
        Revolute("A", "crank.A", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.A"),
        AngleDriver("motor", "crank", ConstantAcceleration(number["value"], number["speed"], 4.0)),
        Gravity("gravity", y=Harmonic(number["mean"], 1.0, number["frequency"])),
        Force("push", "coupler.P", number["push"], angle=number["push.angle"], follows=True),
        Torque("load", "rocker", value=Polynomial([number["c0"], number["c1"]])),
        Spring(
            "spring",
            "ground.O4",
            "coupler.P",
            stiffness=number["stiffness"],
            free_length=number["free_length"],
            preload=number["preload"],
        ),
    )
    return machine


# dotted name of the system: name of the argument above, another value
NUMBERS = {
    "crank.A.x": ("A.x", 0.9),
    "crank.A.y": ("A.y", 0.15),
    "crank.mass": ("mass", 4.0),
    "crank.inertia": ("inertia", 0.5),
    "coupler.weight": ("weight", 55.0),
    "coupler.cg.r": ("cg.r", 1.9),
    "coupler.cg.angle": ("cg.angle", -0.2),
    "coupler.P.r": ("P.r", 1.1),
    "coupler.P.angle": ("P.angle", 1.2),
    "motor.law.value": ("value", 0.9),
    "motor.law.speed": ("speed", 3.5),
    "push.value": ("push", -35.0),
    "push.angle": ("push.angle", 2.0),
    "load.value.c0": ("c0", 7.0),
    "load.value.c1": ("c1", -3.0),
    "spring.stiffness": ("stiffness", 90.0),
    "spring.free_length": ("free_length", 0.9),
    "spring.preload": ("preload", -4.0),
    "gravity.y.mean": ("mean", -1.6),
    "gravity.y.frequency": ("frequency", 3.0),
    "ground.O4.x": ("O4.x", 3.4),
}


def same(one, other, *, exactly=False):
    """Two runs of one description say the same.

    To the last bit where the same kernel ran. Lanes and scalar path may end Newton differently, a
    last correction of up to 1e-12 apart; that is not carried into Φ_q, so that rates differ by ten
    times that, and forces, which come from accelerations, by a hundred times.
    """
    pairs = [(one.t, other.t)]
    for name in one:
        for field in ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha"):
            pairs.append((getattr(one[name], field), getattr(other[name], field)))
    for k, (a, b) in enumerate(pairs):
        part = 1e-12 if k == 0 or (k - 1) % 9 < 3 else 1e-11
        assert_allclose(a, b, rtol=0, atol=0.0 if exactly else part * max(1.0, np.abs(b).max()))
    if one.analysis == "kinematics":
        return
    forces = [
        (getattr(one.reaction(joint.name), field), getattr(other.reaction(joint.name), field))
        for joint in one.mechanism.joints
        for field in ("fx", "fy", "torque")
    ]
    forces += [(one.effort(d.name), other.effort(d.name)) for d in one.mechanism.drivers]
    top = max(np.abs(b).max() for _, b in forces)
    for a, b in forces:
        assert_allclose(a, b, rtol=0, atol=0.0 if exactly else 1e-10 * top)


# -- one set of numbers -----------------------------------------------------------------------


@pytest.mark.parametrize("name", NUMBERS)
def test_one_number_is_what_a_description_with_it_has(name):
    argument, value = NUMBERS[name]
    system = assemble(four_bar())
    changed = system.with_values({name: value})
    assert changed.batch is None and float(changed.values[name]) == value
    assert changed.layout is system.layout  # no new symbolic phase
    described = kinetostatics(four_bar(**{argument: value}), TIMES)
    same(kinetostatics(changed, TIMES), described)
    # and it is another mechanism, while the first one is what it was
    before = kinetostatics(system, TIMES).effort("motor")
    assert np.abs(before - described.effort("motor")).max() > 1e-3


def test_all_numbers_at_once_against_the_oracle():
    values = {name: value for name, (_, value) in NUMBERS.items()}
    described = four_bar(**{argument: value for argument, value in NUMBERS.values()})
    run = kinetostatics(assemble(four_bar()).with_values(values), TIMES)
    oracle = Reference(described)
    q = oracle.guess()
    for k, t in enumerate(map(float, TIMES)):
        start = oracle.guess() if k == 0 else q + oracle.velocities(q, t) * (t - TIMES[k - 1])
        q = oracle.close(start, t)
        v = oracle.velocities(q, t)
        wanted = oracle.kinetostatics(q, v, oracle.accelerations(q, v, t), t)
        top = max(np.abs(part).max() for part in wanted["reactions"].values())
        for name, part in wanted["reactions"].items():
            mine = run.reaction(name)
            found = [mine.fx[k], mine.fy[k], mine.torque[k]]
            assert_allclose(found, part, rtol=0, atol=1e-10 * top)


def test_values_by_keyword_and_one_after_the_other():
    system = assemble(four_bar())
    one = system.with_values({"crank.mass": 5.0}).with_values({"crank.inertia": 1.0})
    other = system.with_values({"crank.mass": 5.0, "crank.inertia": 1.0})
    assert one.values == other.values
    assert np.array_equal(one.par, other.par) and np.array_equal(one.mass, other.mass)
    back = other.with_values({"crank.mass": 2.0, "crank.inertia": 0.2})
    assert np.array_equal(back.mass, system.mass)
    # a name without a dot is none of a number, keyword or not
    with pytest.raises(ModelError, match="there is no number 'crank' to change"):
        system.with_values(crank=1.0)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (
            {"cranck.mass": 1.0},
            "'cranck.mass' to change (there are numbers of: 'ground', 'crank', ",
        ),
        ({"crank.weight": 1.0}, "there is no number 'crank.weight' to change (there are: 'crank.m"),
        ({"coupler.P.x": 1.0}, "'coupler.P.x' to change (there are: 'coupler.weight'"),
        ({"motor.law.jerk": 1.0}, "(there are: 'motor.law.value', 'motor.law.speed'"),
        ({"crank.mass": math.nan}, "'crank.mass' is nan, it must be finite"),
        ({"crank.mass": [1.0, math.inf]}, "'crank.mass'[1] is inf, it must be finite"),
        ({"crank.mass": -1.5}, "'crank.mass' is -1.5 kg, it must not be negative"),
        ({"coupler.weight": [1.0, -2.0]}, "'coupler.weight' is -2 N, it must not be negative"),
        ({"rocker.inertia": -1e-9}, "'rocker.inertia' is -1e-09 N·m·s², it must not be negative"),
        ({"crank.mass": "heavy"}, "'crank.mass' must be a number or an array, not 'heavy'"),
        ({"crank.mass": [[1.0]]}, "'crank.mass' must be a number or one row of them"),
        ({"crank.mass": []}, "'crank.mass' must be a number or one row of them"),
        (
            {"crank.mass": np.ones(3), "crank.A.x": np.ones(4)},
            "'crank.A.x' has 4 values, others have 3: give arrays of one length",
        ),
    ],
)
def test_sentences_about_values(values, sentence):
    with pytest.raises(ModelError) as caught:
        assemble(four_bar()).with_values(values)
    assert sentence in str(caught.value)
    assert caught.value.element in values


def test_a_batch_keeps_its_length():
    batch = assemble(four_bar()).with_values({"crank.mass": np.ones(3)})
    with pytest.raises(ModelError, match=r"'crank\.A\.x' has 2 values, others have 3"):
        batch.with_values({"crank.A.x": [1.0, 1.1]})
    assert batch.with_values({"crank.A.x": 0.9}).batch == 3


# -- many sets --------------------------------------------------------------------------------


def spread(count=DESIGNS, seed=0):
    """Every number of the four-bar somewhere about its first value."""
    rng = np.random.default_rng(seed)
    machine = assemble(four_bar())
    return {name: float(machine.values[name]) + rng.uniform(-0.08, 0.08, count) for name in NUMBERS}


@pytest.mark.parametrize("analysis", [kinetostatics, statics, kinematics])
def test_a_batch_is_each_design_alone(analysis):
    batch = assemble(four_bar()).with_values(spread())
    assert batch.batch == DESIGNS >= 40
    run = analysis(batch, TIMES)
    assert run["crank"].angle.shape == (DESIGNS, len(TIMES))
    assert len(run.record.blocks) == 3 and run.status == "completed"
    for n in range(DESIGNS):
        same(OneOf(run, n), analysis(batch.design(n), TIMES))
    if analysis is kinetostatics:
        assert run.checks.equilibrium < 1e-11 and run.checks.virtual_work < 1e-11
        fx, fy, torque = run.inertia("coupler")
        alone = kinetostatics(batch.design(-1), TIMES)
        for part, wanted in zip((fx, fy, torque), alone.inertia("coupler")):
            assert_allclose(part[-1], wanted, rtol=0, atol=1e-11 * np.abs(wanted).max())


class OneOf:
    """One design of a batch's run, with the names of a run."""

    def __init__(self, run, n):
        self.run, self.n = run, n
        self.t, self.mechanism, self.analysis = run.t, run.mechanism, run.analysis

    def __iter__(self):
        return iter(self.run)

    def __getitem__(self, body):
        return self.part(self.run[body])

    def reaction(self, joint):
        return self.part(self.run.reaction(joint))

    def effort(self, driver):
        return self.run.effort(driver)[self.n]

    def part(self, history):
        return type("part", (), {k: v[self.n] if np.ndim(v) == 2 else v for k, v in
                                 vars(history).items()})()  # fmt: skip


@pytest.mark.parametrize("count", [1, LANES - 1, LANES, LANES + 1])
def test_batches_that_do_not_fill_the_lanes(count):
    batch = assemble(four_bar()).with_values(spread(count))
    run = kinetostatics(batch, TIMES)
    assert run.effort("motor").shape == (count, len(TIMES))
    for n in {0, count // 2, count - 1}:
        same(OneOf(run, n), kinetostatics(batch.design(n), TIMES))


def test_a_batch_with_values_of_the_driver():
    batch = assemble(four_bar()).with_values(spread())
    angle = np.linspace(0.6, 3.0, 11) ** 1.5
    drive = {"motor": (angle, np.linspace(1.0, 4.0, 11), -2.0)}
    run = kinetostatics(batch, drive=drive)
    for n in (0, 17, DESIGNS - 1):
        same(OneOf(run, n), kinetostatics(batch.design(n), drive=drive))


def test_points_of_a_batch():
    batch = assemble(four_bar()).with_values(spread())
    run = kinetostatics(batch, TIMES)
    for place in ("coupler.P", "crank.A", "rocker.B"):
        whole = run.point(place)
        assert whole.x.shape == (DESIGNS, len(TIMES))
        for n in (0, 20, DESIGNS - 1):
            alone = kinetostatics(batch.design(n), TIMES).point(place)
            for field in ("x", "y", "vx", "vy", "ax", "ay"):
                wanted = getattr(alone, field)
                atol = 1e-11 * max(1.0, np.abs(wanted).max())
                assert_allclose(getattr(whole, field)[n], wanted, rtol=0, atol=atol)


def lengths():
    """Designs of which some want steps smaller than those asked for."""
    # crank + base − coupler − rocker: with 0.003 left the rocker whips round
    reach = np.full(DESIGNS, 3.5)
    reach[[5, 2 * LANES + 3]] = 3.997
    return {"ground.O4.x": reach, "crank.mass": np.linspace(1.0, 2.0, DESIGNS)}


def test_designs_that_fall_to_the_scalar_path(monkeypatch):
    """One quick design in each of two groups of lanes: steps must be halved there alone."""
    made, whole = [], Runner.scalar

    def counted(runner, start, asked, **more):
        made.append(float(start.work.par[:, 0].sum()))
        return whole(runner, start, asked, **more)

    batch = assemble(four_bar()).with_values(lengths())
    times = np.linspace(0.0, 1.2, 31)
    monkeypatch.setattr(Runner, "scalar", counted)
    run = kinetostatics(batch, times)
    monkeypatch.undo()
    assert made == [float(batch.par[:, n].sum()) for n in (5, 2 * LANES + 3)]
    for n in (4, 5, 6, 2 * LANES + 3):
        alone = kinetostatics(batch.design(n), times)
        fine = kinetostatics(batch.design(n), np.linspace(0.0, 1.2, 601))
        same(OneOf(run, n), alone)
        # the branch is kept
        assert_allclose(alone["rocker"].angle, fine["rocker"].angle[::20], rtol=0, atol=1e-11)


# -- numbers that are nothing in one design and something in another --------------------------

# of a slider-crank on the x axis: arms, offsets and directions that are zero in its description
ZEROS = {
    "slider.B.x": 0.2,
    "slider.cg.y": 0.3,
    "slider.cg.x": -0.2,
    "guide.i.angle": 0.2,
    "guide.j.angle": 0.1,
    "ground.guide.y": 0.1,
    "ground.O.y": -0.1,
    "crank.A.y": 0.2,
    "crank.cg.y": 0.2,
    "rod.A.y": 0.1,
}


def slider_crank():
    machine = makers.slider_crank(1.0, 3.0, masses=(1.0, 2.0, 3.0), speed=5.0)
    machine.add(Gravity("gravity", y=-9.81), Force("push", "slider.B", -20.0, angle=0.2))
    return machine


@pytest.mark.parametrize("name", ZEROS)
def test_a_number_that_was_zero(name):
    """What a topology learned from its first numbers must hold for all others."""
    system, times = assemble(slider_crank()), np.linspace(0.0, 1.3, 10 * LANES + 1)
    assert float(system.values[name]) == 0.0
    kinetostatics(system, times)  # it learns
    changed = system.with_values({name: ZEROS[name]})
    run = kinetostatics(changed, times)
    assert run.checks.constraint < 1e-13 and run.checks.equilibrium < 1e-11
    few = kinetostatics(assemble(slider_crank()).with_values({name: ZEROS[name]}), times[::LANES])
    same(Sampled(run, LANES), few)
    batch = system.with_values({name: np.linspace(0.0, ZEROS[name], 5)})
    run = kinetostatics(batch, times[::LANES])
    assert run.checks.constraint < 1e-13 and run.checks.equilibrium < 1e-11
    for n in range(5):
        same(OneOf(run, n), kinetostatics(batch.design(n), times[::LANES]))


class Sampled(OneOf):
    """Some instants of a run of one design."""

    def __init__(self, run, every):
        super().__init__(run, slice(None, None, every))
        self.t = run.t[self.n]

    def part(self, history):
        parts = {k: v[self.n] if isinstance(v, np.ndarray) else v for k, v in vars(history).items()}
        return type("part", (), parts)()


def test_a_design_that_cannot_close_is_named():
    values = spread()
    values["ground.O4.x"][21] = 9.0
    with pytest.raises(SolveError, match=r"^design 21 of the batch: loops do not") as caught:
        kinetostatics(assemble(four_bar()).with_values(values), TIMES)
    assert caught.value.element in ("A", "B")


def test_a_design_that_meets_a_dead_centre_is_named():
    values = {"crank.A.x": np.linspace(1.0, 1.2, DESIGNS)}
    values["crank.A.x"][33] = 2.2  # stretched before a turn is made
    with pytest.raises(SolveError, match=r"^design 33 of the batch: dead centre at .*'motor'"):
        kinetostatics(assemble(four_bar()).with_values(values), np.linspace(0.0, 1.2, 25))


def test_what_a_batch_does_not_do():
    batch = assemble(four_bar()).with_values(spread(3))
    with pytest.raises(ModelError, match="a turn of a batch of designs"):
        kinetostatics(batch, turn=True)
    with pytest.raises(ModelError, match="close_loops takes one design"):
        close_loops(batch)
    with pytest.raises(ModelError, match="the breakdown of 'A' is for one design"):
        kinetostatics(batch, TIMES).breakdown("A")


# -- the user's own load, pickles, threads ----------------------------------------------------


@dataclass(frozen=True)
class Drag(CustomLoad):
    """A force against the velocity of j's mass centre."""

    def physics(self, i, j, p, t):
        fx, fy = -(0.5 + t) * j[5], -(0.5 + t) * j[6]
        return -fx, -fy, 0.0, fx, fy, 0.0


def dragging():
    machine = four_bar()
    machine.add(Drag("drag", "ground", "coupler"))
    return machine


def test_a_batch_with_a_load_in_python():
    batch = assemble(dragging()).with_values(spread(5))
    run = kinetostatics(batch, TIMES)
    for n in range(5):
        same(OneOf(run, n), kinetostatics(batch.design(n), TIMES))
    plain = kinetostatics(assemble(four_bar()).with_values(spread(5)), TIMES)
    assert np.abs(run.effort("motor") - plain.effort("motor")).max() > 1e-2


@pytest.mark.parametrize("make", [four_bar, dragging])
@pytest.mark.parametrize("batched", [False, True])
def test_systems_pickle(make, batched):
    system = assemble(make())
    if batched:
        system = system.with_values(spread(3))
    before = kinetostatics(system, TIMES)  # with the functions registered in this process
    copy = pickle.loads(pickle.dumps(system))
    assert copy.batch == system.batch and copy.mechanism.name == "four-bar"
    same(kinetostatics(copy, TIMES), before, exactly=True)
    again = copy.with_values({"crank.mass": 9.0})
    same(
        kinetostatics(again, TIMES),
        kinetostatics(system.with_values({"crank.mass": 9.0}), TIMES),
        exactly=True,
    )


@pytest.mark.parametrize("make", [four_bar, dragging])
def test_two_threads_on_one_system(make):
    system = assemble(make())
    times = [np.linspace(0.0, 1.2, 40 if make is dragging else 400), TIMES]
    wanted = [kinetostatics(system, t) for t in times]
    found = [[] for _ in times]
    together = threading.Barrier(2)

    def work(k):
        together.wait()
        for _ in range(8):
            found[k].append(kinetostatics(system, times[k]))

    threads = [threading.Thread(target=work, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k, runs in enumerate(found):
        assert len(runs) == 8
        for run in runs:
            same(run, wanted[k], exactly=True)


def test_a_system_keeps_what_was_described():
    """Adding to the mechanism afterwards changes no system, and a system's own takes nothing."""
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1))
    system = mbody.assemble(machine)
    machine.add(mbody.Gravity("gravity", y=-9.81))
    assert mbody.kinetostatics(system).effort("motor")[0] == 0.0
    assert mbody.kinetostatics(machine).effort("motor")[0] != 0.0
    with pytest.raises(mbody.ModelError, match="has been assembled"):
        system.mechanism.add(mbody.Gravity("late", y=-9.81))
