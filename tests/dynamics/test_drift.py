"""Free motions of many designs side by side: what `simulate` of each has, in any company."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import mbody
from mbody import (
    AngleDriver,
    Body,
    Damper,
    Gravity,
    Mechanism,
    Revolute,
    SimulationSettings,
    SolveError,
    Spring,
    Torque,
    TorsionDamper,
    makers,
)
from mbody.core.lanes import LANES
from mbody.laws import Harmonic
from mbody.sweeps import Uniform, monte_carlo, together
from tests.support.cases import first_fast

COUNT, INSTANTS = 40, 9


def pendulum():
    """A rod that is released, as fast as a parameter says."""
    machine = Mechanism("pendulum", parameters={"l": 1.0, "w": 1.5})
    machine.add(
        Body("rod", mass=2.0, inertia=0.1, cg=("l/2", 0.0), points={"O": (0.0, 0.0)}, guess=0.1),
        Revolute("O", "ground", "rod.O"),
        Gravity("gravity", y=-9.81),
        Torque("brake", "rod", value=-0.2),
    )
    machine.simulation = SimulationSettings(
        1.5, start={"rod": {"angle": 0.3, "omega": "w*(1 rad/s)"}}
    )
    return machine


def four_bar():
    """Released from where its guesses close, without any word of a start."""
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)).without("motor").copied()
    machine.add(Gravity("gravity", y=-9.81))
    return machine


def slider_crank():
    """Against a spring and a damper."""
    machine = makers.slider_crank(1.0, 3.0, masses=(1.0, 2.0, 3.0)).without("motor").copied()
    machine.add(
        Spring("spring", "ground.O", "slider", stiffness=60.0, free_length=3.0),
        Damper("damper", "ground.O", "slider", coefficient=2.0),
    )
    machine.simulation = SimulationSettings(1.0, start={"crank": {"angle": 1.0, "omega": 3.0}})
    return machine


def chain(count, until=1.0):
    """Rods hung one on the other; the first angles are given."""
    machine, before = Mechanism("chain"), "ground"
    for n in range(count):
        machine.add(
            Body(f"rod{n}", mass=1.0, inertia=1 / 12, cg=(0.5, 0.0), points={"B": (1.0, 0.0)}),
            Revolute(f"J{n}", before, f"rod{n}"),
        )
        before = f"rod{n}.B"
    machine.add(Gravity("gravity", y=-9.81))
    start = {f"rod{n}": {"angle": 0.3 * n} for n in range(count)}
    machine.simulation = SimulationSettings(until, start=start)
    return machine


def stirred():
    """A pendulum on a crank that follows a law, and turns against a damper."""
    machine = Mechanism("stirred")
    machine.add(
        Body("crank", mass=1.0, inertia=0.1, points={"A": (0.4, 0.0)}),
        Body("bob", mass=2.0, inertia=0.2, cg=(0.7, 0.0), guess=-1.0),
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.A", "bob"),
        AngleDriver("motor", "crank", Harmonic(0.0, 0.5, 4.0)),
        TorsionDamper("bearing", "crank", "bob", coefficient=0.3),
        Gravity("gravity", y=-9.81),
    )
    return machine


def light():
    """A four-bar whose coupler has no mass."""
    machine = Mechanism("light")
    machine.add(
        Body("crank", mass=1.0, inertia=0.2, cg=(0.5, 0.0), points={"A": (1.0, 0.0)}, guess=1.0),
        Body("coupler", points={"B": (3.0, 0.0)}, guess=0.3),
        Body("rocker", mass=2.0, inertia=0.9, cg=(1.0, 0.1), points={"B": (2.0, 0.0)}, guess=1.6),
        Revolute("O2", "ground", "crank"),
        Revolute("A", "crank.A", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", mbody.Marker("ground", (3.5, 0.0)), "rocker"),
        Gravity("gravity", y=-9.81),
    )
    return machine


MACHINES = {
    "pendulum": (pendulum, {"l": 0.2, "w": 0.4, "brake": 0.1}, ["rod.angle", "O.fx"], {}),
    "four_bar": (
        four_bar,
        {"crank.A.x": 0.1, "coupler.mass": 1.0},
        ["crank.angle", "rocker.omega", "B.force"],
        {"until": 2.0},
    ),
    "slider_crank": (
        slider_crank,
        {"rod.B.x": 0.2, "spring.stiffness": 20.0, "damper.coefficient": 1.0},
        ["slider.x", "crank.omega", "A.force"],
        {},
    ),
    "double pendulum": (lambda: chain(2), {"rod0.B.x": 0.2, "rod1.mass": 0.5}, ["rod1.angle"], {}),
    "chain of 5": (lambda: chain(5), {"rod2.mass": 0.5, "rod3.B.x": 0.1}, ["J0.force"], {}),
    "stirred": (
        stirred,
        {"crank.A.x": 0.1, "motor.law.frequency": 1.0, "bearing.coefficient": 0.1},
        ["bob.angle", "motor.effort", "motor.power"],
        {"until": 1.5},
    ),
    "light": (
        light,
        {"crank.A.x": 0.1, "rocker.mass": 0.5},
        ["crank.angle", "B.force"],
        {"until": 1.0},
    ),
    "guessed": (
        four_bar,
        {"crank.A.x": 0.1},
        ["crank.angle"],
        {"until": 1.0, "guess": {"crank": 1.2}},
    ),
    "with rates": (
        four_bar,
        {"crank.A.x": 0.1},
        ["crank.angle"],
        {"until": 1.0, "rates": {"crank": 4.0}},
    ),
}


def swept(machine, samples, of, **how):
    """Histories (names, designs, instants) of a sweep, instant by instant; and the sweep."""
    count = len(how["times"]) if "times" in how else how.setdefault("instants", INSTANTS)
    measure = [f"at({name}, {k})" for name in of for k in range(count)]
    found = mbody.sweep(machine, samples, "simulate", measure, **how)
    return np.array([found[m] for m in measure]).reshape(len(of), count, -1).swapaxes(1, 2), found


def scattered(spread, count=COUNT, seed=7):
    return monte_carlo({name: Uniform(width) for name, width in spread.items()}, count, seed=seed)


def all_on_lanes(monkeypatch):
    monkeypatch.setattr("mbody.sweeps.job._alone", lambda job, values: pytest.fail("went alone"))


# -- the numbers ------------------------------------------------------------------------------


@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
@first_fast("name", MACHINES, 4)
def test_designs_move_as_simulate_moves_each(name, rtol, monkeypatch):
    """Lanes make the same steps, so what is apart is rounding: much less than the error of a step,
    of which `rtol` is the measure.
    """
    all_on_lanes(monkeypatch)
    make, spread, of, how = MACHINES[name]
    found, sweep = swept(make(), scattered(spread), of, rtol=rtol, **how)
    for design in range(COUNT):
        run = mbody.simulate(sweep.design(design), rtol=rtol, instants=INSTANTS, **how)
        for history, measure in zip(found, of, strict=True):
            alone = run.measure(measure)
            size = np.abs(alone).max()
            assert_allclose(history[design], alone, rtol=0, atol=1e-3 * rtol * size)


@pytest.mark.parametrize(
    "how",
    [
        {"method": "dopri5", "rtol": 1e-5},
        {"rtol": 1e-9, "atol": 1e-5},
        {"rtol": 1e-5, "atol": 1e-9},
        {"rtol": 1e-6, "times": [0.0, 0.01, 0.0101, 0.7, 0.93]},
        {"rtol": 1e-6, "times": [0.4]},
    ],
    ids=["dopri5", "rates are small", "places are small", "times", "one time"],
)
def test_other_methods_tolerances_and_instants(how, monkeypatch):
    all_on_lanes(monkeypatch)
    make, spread, of, _ = MACHINES["slider_crank"]
    found, sweep = swept(make(), scattered(spread), of, **how)
    for design in range(COUNT):
        instants = None if "times" in how else INSTANTS
        run = mbody.simulate(sweep.design(design), instants=instants, **how)
        for history, measure in zip(found, of, strict=True):
            alone = run.measure(measure)
            atol = 1e-3 * max(how["rtol"], how.get("atol", 0.0)) * np.abs(alone).max()
            assert_allclose(history[design], alone, rtol=0, atol=atol)


def test_the_steps_are_those_of_simulate():
    """At a loose tolerance the error of the motion is that of its steps: lanes have it too."""
    machine, of = chain(2, until=3.0), ["rod1.angle"]
    found, sweep = swept(machine, scattered({"rod1.mass": 0.5}), of, rtol=1e-3)
    for design in range(COUNT):
        loose, tight = (
            mbody.simulate(sweep.design(design), rtol=rtol, instants=INSTANTS)["rod1"].angle
            for rtol in (1e-3, 1e-11)
        )
        error = np.abs(loose - tight).max()
        assert np.abs(found[0, design] - loose).max() < 1e-3 * error


def test_the_energy_of_what_loses_none_stays():
    """½ J ω² + m g y of a rod that is released, by no equation of motion."""
    machine = Mechanism("rod")
    machine.add(
        Body("rod", mass=2.0, inertia=0.1, cg=(0.5, 0.0), guess=0.3),
        Revolute("O", "ground", "rod"),
        Gravity("gravity", y=-9.81),
    )
    samples = scattered({"rod.mass": 1.0, "rod.inertia": 0.05})
    of = ["rod.omega", "rod.angle"]
    (omega, angle), sweep = swept(machine, samples, of, until=5.0, rtol=1e-10)
    m, own = sweep.parameter("rod.mass")[:, None], sweep.parameter("rod.inertia")[:, None]
    energy = 0.5 * (own + 0.25 * m) * omega**2 + m * 9.81 * 0.5 * np.sin(angle)
    # some hundred steps of an error of 1e-10 each
    assert_allclose(energy, energy[:, :1] * np.ones(INSTANTS), rtol=0, atol=1e-7 * m.max())


# -- company ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["pendulum", "four_bar", "slider_crank", "chain of 5", "stirred"])
def test_numbers_do_not_depend_on_company(name):
    """Alone, among sixteen others, and among all: the same bits."""
    make, spread, of, how = MACHINES[name]
    whole, sweep = swept(make(), scattered(spread), of, rtol=1e-6, **how)
    values = {n: sweep.parameter(n) for n in spread}
    for chosen in ([0], [COUNT - 1], list(range(5, 5 + LANES + 1))[::-1]):
        part, _ = swept(
            make(), together({n: v[chosen] for n, v in values.items()}), of, rtol=1e-6, **how
        )
        assert_array_equal(part, whole[:, chosen])


def test_threads_and_folders_change_no_bit(tmp_path):
    make, spread, of, how = MACHINES["slider_crank"]
    found = [swept(make(), scattered(spread, 300), of, threads=n, **how)[0] for n in (1, 3)]
    assert_array_equal(*found)
    pytest.importorskip("pyarrow")
    stored, _ = swept(make(), scattered(spread, 300), of, to=tmp_path / "sweep", **how)
    assert_array_equal(stored, found[0])


def test_a_job_travels(monkeypatch):
    """As a cluster gets it: pickled, the lanes with it."""
    import pickle

    from mbody.sweeps import job as jobs
    from mbody.sweeps.job import columns_of

    all_on_lanes(monkeypatch)
    machine = slider_crank()
    columns = columns_of(machine, "last(slider.x)")
    job = jobs.prepared(mbody.assemble(machine), ("rod.mass",), columns, "simulate", {})
    values = np.linspace(1.0, 3.0, 20)[:, None]
    here, there = (
        jobs.analyse_piece(one, values) for one in (job, pickle.loads(pickle.dumps(job)))
    )
    assert_array_equal(here.columns[0], there.columns[0])


# -- what is out of the ordinary --------------------------------------------------------------


def gone_alone(monkeypatch):
    from mbody.sweeps import job as jobs

    gone, alone = [], jobs._alone

    def noted(job, values):
        gone.append(values.tolist())
        return alone(job, values)

    monkeypatch.setattr(jobs, "_alone", noted)
    return gone


def test_singular_positions_are_passed_alone(monkeypatch):
    """A crank and a coupler as long as rocker and ground together fold flat on the way."""
    gone = gone_alone(monkeypatch)
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)).without("motor").copied()
    machine.simulation = SimulationSettings(
        3.0, start={"crank": {"angle": 1.0, "omega": 6.0}}, rtol=1e-8
    )
    lengths = np.linspace(0.6, 1.3, COUNT)
    of, how = ["crank.angle", "rocker.angle"], {"until": 3.0}
    without, _ = swept(machine, {"crank.A.x": lengths}, of, **how)
    before = len(gone)
    lengths[11] = 1.5  # 1.5 + 2 = 3.5, and nothing: 1.5 + 3.5 = 3 + 2
    found, sweep = swept(machine, {"crank.A.x": lengths}, of, **how)
    assert [1.5] in gone[before:]
    others = np.delete(np.arange(COUNT), 11)
    assert_array_equal(found[:, others], without[:, others])
    run = mbody.simulate(sweep.design(11), instants=INSTANTS, **how)
    assert run.stats["careful"]
    assert_array_equal(found[:, 11], [run["crank"].angle, run["rocker"].angle])


def test_what_is_stiff_or_cannot_move_is_a_row(monkeypatch):
    gone = gone_alone(monkeypatch)
    machine, of = pendulum(), ["rod.angle"]
    machine.add(TorsionDamper("bearing", "ground", "rod", coefficient=0.1))
    values = {
        "bearing.coefficient": np.full(COUNT, 0.1),
        "rod.mass": np.linspace(1.0, 3.0, COUNT),
        "rod.inertia": np.full(COUNT, 0.1),
        "w": np.linspace(0.5, 2.0, COUNT),
    }
    plain, _ = swept(machine, together(values), of)
    assert not gone
    values["bearing.coefficient"][3] = 1e9
    values["rod.mass"][30] = values["rod.inertia"][30] = 0.0
    found, sweep = swept(machine, together(values), of)
    assert sorted(sweep.failures) == [3, 30]
    for design, words in ((3, "too stiff"), (30, "no inertia")):
        with pytest.raises(SolveError, match=words) as error:
            mbody.simulate(sweep.design(design), instants=INSTANTS)
        assert sweep.failures[design] == str(error.value)
    others = np.delete(np.arange(COUNT), [3, 30])
    assert_array_equal(found[:, others], plain[:, others])
    assert np.isnan(found[:, [3, 30]]).all()


def test_a_load_that_ends_is_told():
    """No number on the way: each design says when, as by itself."""
    machine = pendulum()
    machine.add(Torque("wind", "rod", value="sqrt(0.5 - t/(1 s))*(1 N*m)"))
    found = mbody.sweep(machine, {"rod.mass": [1.0, 2.0]}, "simulate", "last(rod.angle)")
    for design in (0, 1):
        with pytest.raises(SolveError) as error:
            mbody.simulate(found.design(design))
        assert found.failures[design] == str(error.value)
    short = mbody.sweep(machine, {"rod.mass": [1.0]}, "simulate", "last(rod.angle)", until=0.4)
    assert not short.failures


def test_wheels_that_do_not_fit_are_rows(monkeypatch):
    machine = Mechanism("wheels")
    machine.add(
        Body("small", mass=1.0, inertia=0.1, guess=0.0),
        Body("large", mass=2.0, inertia=0.5, guess=0.0),
        Revolute("A", "ground", "small"),
        Revolute("B", mbody.Marker("ground", (3.0, 0.0)), "large"),
        mbody.Gear("mesh", "small", "large", radius_i=1.0, radius_j=2.0),
        Torque("motor", "small", value=1.0),
    )
    values = {"mesh.radius_i": [1.0, 1.2, 1.5], "mesh.radius_j": [2.0, 2.0, 1.5]}
    gone = gone_alone(monkeypatch)
    found, sweep = swept(machine, together(values), ["large.angle"], until=1.0)
    assert gone == [[1.2, 2.0]]
    assert list(sweep.failures) == [1]
    assert "does not fit" in sweep.failures[1]
    # ½ α t² with α = T r_j/(J_i r_j² + J_j r_i²) · r_i, against the turn of the small one
    for design, (i, j) in ((0, (1.0, 2.0)), (2, (1.5, 1.5))):
        alpha = -i * j / (0.1 * j * j + 0.5 * i * i)
        assert_allclose(found[0, design, -1], 0.5 * alpha, rtol=1e-12)


def test_rest_is_a_motion(monkeypatch):
    """Nothing moves where nothing pulls."""
    all_on_lanes(monkeypatch)
    machine = Mechanism("still")
    machine.add(
        Body("rod", mass=1.0, inertia=0.1, cg=(0.5, 0.0), guess=0.3), Revolute("O", "ground", "rod")
    )
    found, _ = swept(machine, {"rod.mass": [1.0, 2.0]}, ["rod.angle", "rod.omega"], until=1.0)
    assert_array_equal(found[0], np.full((2, INSTANTS), 0.3))
    assert_array_equal(found[1], np.zeros((2, INSTANTS)))


def test_a_design_that_does_not_close_is_a_row():
    lengths = np.linspace(0.9, 1.1, 20)
    lengths[4] = 30.0
    found, sweep = swept(four_bar(), {"crank.A.x": lengths}, ["crank.angle"], until=0.5)
    assert list(sweep.failures) == [4]
    assert "do not close" in sweep.failures[4]
    assert np.isfinite(np.delete(found, 4, axis=1)).all()


def test_a_start_without_a_value_is_a_row():
    machine = pendulum()
    machine.simulation = SimulationSettings(0.5, start={"rod": {"angle": "acos(l)"}})
    found = mbody.sweep(machine, {"l": [0.5, 2.0]}, "simulate", "first(rod.angle)")
    assert_allclose(found["first(rod.angle)"][0], math.acos(0.5), rtol=1e-14)
    assert "acos" in found.failures[1]


@pytest.mark.parametrize(
    "how",
    [
        {"method": "radau5"},
        {"method": "rattle", "step": 0.01},
        {"events": [mbody.Event("rod.angle + 1 rad")]},
    ],
    ids=["implicit", "even", "events"],
)
def test_what_lanes_have_not_goes_alone(how, monkeypatch):
    gone = gone_alone(monkeypatch)
    found = mbody.sweep(pendulum(), {"rod.mass": [1.0, 2.0]}, "simulate", "last(rod.angle)", **how)
    assert len(gone) == 2
    run = mbody.simulate(found.design(1), **how)
    assert found["last(rod.angle)"][1] == run["rod"].angle[-1]


def test_an_instant_that_there_is_not_is_told():
    with pytest.raises(mbody.ModelError, match="no such instant, they are 0 to 200"):
        mbody.sweep(pendulum(), {"l": [1.0]}, "simulate", "at(rod.angle, 300)")
    found = mbody.sweep(pendulum(), {"l": [1.0]}, "simulate", "at(rod.angle, 300)", method="radau5")
    assert "no such instant" in found.failures[0]
