"""What results say of friction: losses, modes, ranges, uniqueness, jams, efficiency."""

import csv
import itertools
import json
import math

import numpy as np
import pytest

import mbody
from mbody import Body, Force, Prismatic, Revolute
from mbody.solution.contact_forces import pair_rates
from mbody.solution.measures import measured
from tests.friction.test_friction import MACHINES
from tests.support.cases import first_fast
from tests.support.frictional import (
    CRANK,
    FORCE,
    cam_drive,
    dense_at,
    drawer,
    gear_pair,
    slider_crank,
)

HEAVY = {"masses": (1.0, 2.0, 3.0), "length": 0.06}
AT_A_DEAD_CENTRE = {"motor": (np.array([0.0, 0.5, math.pi]), 10.0, 0.0)}


def by_dense(run, k, slip_signs, **how):
    """Driving torque for given directions."""
    dense = dense_at(run, k, slip_signs=slip_signs, **how)
    found = dense.solve()
    return -float(found.lam[dense.reference.rows["motor"]][0])


# -- losses -------------------------------------------------------------------------------------


def test_losses_everywhere(tmp_path):
    run = mbody.kinetostatics(slider_crank(**HEAVY), turn="motor", instants=25)
    assert list(run.losses) == ["O", "A", "B", "guide"]
    with pytest.raises(TypeError):
        run.losses["A"] = 0.0
    # by hand: ρ |R| |ω| of a pin
    rho = 0.1 * 0.01 / math.sqrt(1.01)
    own = rho * run.reaction("A").magnitude * np.abs(run["rod"].omega - run["crank"].omega)
    assert np.abs(run.losses["A"] - own).max() < 1e-12 * own.max()
    assert list(run.data()["losses"]["A"]) == run.losses["A"].tolist()
    values, _, unit = measured(run, "A.loss + guide.loss")
    assert np.array_equal(values, run.losses["A"] + run.losses["guide"]) and unit == "N·m/s"
    run.to_csv(tmp_path / "turn.csv")
    with open(tmp_path / "turn.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert float(rows[3]["A.loss [N·m/s]"]) == run.losses["A"][3]
    assert "FRICTION" in str(run) and "guide" in str(run)
    assert not mbody.kinematics(slider_crank()).losses


def test_damping_alone():
    machine = mbody.Mechanism("wheel", units="SI")
    machine.add(
        Body("wheel"),
        Revolute("O", "ground", "wheel", viscous=0.3),
        mbody.AngleDriver("motor", "wheel", mbody.laws.ConstantSpeed(0.0, 4.0)),
    )
    run = mbody.kinetostatics(machine, [0.0, 1.0])
    assert run.effort("motor") == pytest.approx([1.2, 1.2], rel=1e-14)
    assert run.losses["O"] == pytest.approx([4.8, 4.8], rel=1e-14)
    still = mbody.statics(machine)
    assert still.effort("motor")[0] == 0.0 and not still.notes


def test_modes_follow_the_rates():
    run = mbody.kinetostatics(slider_crank(**HEAVY), turn="motor", instants=25)
    words = {1.0: "slip+", -1.0: "slip-"}
    assert run.mode("guide") == [words[sign] for sign in np.sign(run["slider"].vx).tolist()]
    assert run.data()["modes"]["guide"] == run.mode("guide")


# -- where joints rest --------------------------------------------------------------------------


def test_a_dead_centre_has_limits_from_both_sides():
    run = mbody.kinetostatics(slider_crank(**HEAVY), drive=AT_A_DEAD_CENTRE)
    assert run.mode("guide") == ["stick", "slip-", "stick"]
    limits = run.range("motor")
    for k in (0, 2):
        ends = sorted(by_dense(run, k, {"guide": slip_sign}) for slip_sign in (1.0, -1.0))
        assert [limits.low[k], limits.high[k]] == pytest.approx(ends, rel=1e-12)
        assert limits.low[k] < run.effort("motor")[k] < limits.high[k]
    assert limits.low[1] == limits.high[1] == run.effort("motor")[1]
    guide = run.range("guide")
    assert (guide.low.fx[0] < 0.0 < guide.high.fx[0]) and guide.low.fx[1] == guide.high.fx[1]
    on_ground = run.range("guide", on="ground")
    assert np.allclose(on_ground.low.fx, -guide.high.fx, rtol=1e-15)
    data = json.loads(json.dumps(run.data()))
    assert data["ranges"]["efforts"]["motor"] == {
        "low": limits.low.tolist(),
        "high": limits.high.tolist(),
    }
    assert len(data["ranges"]["reactions"]["guide"]["low"][0]) == 3
    assert any("'guide' rests at 2 instants" in note for note in run.notes)
    assert run.status == "completed"


def test_limits_are_those_of_the_motion_around():
    """Just before and just after a dead centre friction is at its limits."""
    run = mbody.kinetostatics(slider_crank(**HEAVY), drive={"motor": (0.0, 10.0, 0.0)})
    limits = run.range("motor")
    off = np.array([-1e-7, 1e-7])
    near = mbody.kinetostatics(slider_crank(**HEAVY), drive={"motor": (off, 10.0, 0.0)})
    ends = np.sort(near.effort("motor"))
    assert [limits.low[0], limits.high[0]] == pytest.approx(list(ends), abs=1e-5 * FORCE * CRANK)


def test_a_band_of_holding_torques():
    """At rest the limits are those of the crank that is about to turn, either way."""
    machine = slider_crank()
    degrees = np.array([30.0, 120.0, 250.0])
    run = mbody.statics(machine, drive={"motor": np.radians(degrees)})
    limits = run.range("motor")
    forth = [-27.693926263616955, -34.943752389438444, 46.01093642493345]
    assert limits.high == pytest.approx(forth, abs=1e-12 * FORCE * CRANK)
    back = slider_crank(speed=-10.0)
    for k, angle in enumerate(np.radians(degrees)):
        one = mbody.kinetostatics(back, drive={"motor": (angle, -10.0, 0.0)})
        assert limits.low[k] == pytest.approx(one.effort("motor")[0], abs=1e-12 * FORCE * CRANK)
    assert set(run.mode("A")) == {"stick"}
    assert run.losses["A"].tolist() == [0.0] * 3
    assert "AT REST" in str(run)


def test_static_coefficients_hold_at_rest():
    plain, more = (
        mbody.statics(slider_crank(**how), drive={"motor": 1.0}).range("motor")
        for how in ({"mu": 0.15}, {"mu": 0.1, "static": 0.15})
    )
    assert [plain.low[0], plain.high[0]] == pytest.approx([more.low[0], more.high[0]], rel=1e-13)


def test_a_block_on_an_incline():
    """Band of a holding force along it: W (sin α ∓ μ cos α), of the references."""
    machine = mbody.Mechanism("block", units="SI", ground={"O": (0.0, 0.0)})
    slope = mbody.Marker("ground", "O", 0.5)
    machine.add(
        Body("block"),
        Prismatic("plane", slope, mbody.Marker("block", (0.0, 0.0), 0.5), friction=0.2),
        mbody.CoordinateDriver("hold", slope, "block", 0.0),
        Force("weight", "block", 50.0, angle=-np.pi / 2.0),
    )
    limits = mbody.statics(machine).range("hold")
    assert limits.low[0] == pytest.approx(15.195451311306424, rel=1e-13)
    assert limits.high[0] == pytest.approx(32.747102549113876, rel=1e-13)


def test_self_locking_is_named():
    """A slider that is pushed does not turn its crank near a dead centre, and does elsewhere."""
    run = mbody.statics(slider_crank(), drive={"motor": np.radians([1.0, 90.0])})
    assert any(note.startswith("self-locking: friction holds 'motor'") for note in run.notes)
    limits = run.range("motor")
    assert limits.low[0] < 0.0 < limits.high[0] and limits.high[1] < 0.0
    away = mbody.statics(slider_crank(), drive={"motor": np.radians([30.0, 90.0])})
    assert not any("self-locking" in note for note in away.notes)


def test_what_jams_one_way_has_one_limit():
    """Beyond its coefficient no pull at P moves a drawer; to let it back P = F/(1 + 2 μ a/ℓ)."""
    run = mbody.statics(drawer(0.6))
    limits = run.range("pull")
    assert limits.high[0] == math.inf
    assert limits.low[0] == pytest.approx(10.0 / 2.2, rel=1e-13)
    assert run.effort("pull")[0] == pytest.approx(10.0)
    ends = json.loads(json.dumps(run.data()))["ranges"]["efforts"]["pull"]
    assert ends == {"low": [float(limits.low[0])], "high": [None]}
    assert "∞" in str(run)


def test_gears_at_rest_with_a_pressure_angle():
    """Teeth press apart at rest too; the direction of sliding is that of each driver alone."""
    run = mbody.statics(gear_pair(efficiency=0.9, pressure_angle="20 deg"))
    limits, plain = run.range("motor"), run.effort("motor")
    assert limits.low[0] < plain[0] < limits.high[0]
    dense = dense_at(run, 0, slip_signs={"mesh": 0.0, "B": 0.0})
    assert plain[0] == pytest.approx(-dense.solve().lam[dense.reference.rows["motor"]][0])


# -- efficiency ---------------------------------------------------------------------------------


def stroke(mu, **more):
    """The stroke of the slider-crank against its load."""
    t = np.linspace((np.pi - 0.1) / 10.0, (2.0 * np.pi - 0.1) / 10.0, 91)
    return mbody.kinetostatics(slider_crank(mu, **more), t)


def test_efficiency_tends_to_one_linearly():
    """(1 − η)/μ tends to a limit; 1 − η of the references' prototype at 0.3 is 0.219."""
    lost = {mu: (1.0 - stroke(mu).efficiency("load").value) / mu for mu in (1e-4, 1e-3, 1e-2)}
    slopes = [(lost[a] - lost[b]) / (a - b) for a, b in ((1e-3, 1e-4), (1e-2, 1e-3))]
    limit = lost[1e-4] - 1e-4 * slopes[0]
    assert slopes[0] == pytest.approx(slopes[1], rel=0.02)
    assert limit == pytest.approx(0.89071937, rel=1e-6)
    assert stroke(0.0).efficiency("load").value == pytest.approx(1.0, abs=1e-13)


def test_an_account_of_work():
    """Of what is given, what is not useful is lost; by quadrature of SciPy, too."""
    from scipy.integrate import quad

    run = stroke(0.3)
    found = run.efficiency("load")
    assert found.given - found.useful - found.lost == pytest.approx(0.0, abs=1e-11 * found.given)
    assert found.useful == pytest.approx(2.0 * CRANK * FORCE, rel=1e-13)

    def power(t):
        one = mbody.kinetostatics(run.mechanism, float(t))
        return float(one.effort("motor")[0]) * 10.0

    ends = [(math.pi - 0.1) / 10.0, (1.5 * math.pi - 0.1) / 10.0, (2.0 * math.pi - 0.1) / 10.0]
    own = sum(quad(power, *pair, epsabs=1e-9)[0] for pair in itertools.pairwise(ends))
    assert found.given == pytest.approx(own, rel=1e-8)


# -- slip rows of cams --------------------------------------------------------------------------


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("swinging", [False, True])
@pytest.mark.parametrize("kind", ["knife", "roller", "flat"])
def test_the_rate_of_slipping_changes_as_it_is_said(kind, swinging, clockwise):
    """By differences in time: what a row of slipping gives as g a − γ."""
    how = {"friction": 0.2, "pin_radius": 0.004} if kind == "roller" else {"friction": 0.2}
    h = 1e-5
    t = (np.array([0.03, 0.11])[:, None] + h * np.array([-1.0, 0.0, 1.0])).ravel()
    run = mbody.kinetostatics(cam_drive(kind, swinging, clockwise, **how), t)
    rates = pair_rates(run).reshape(2, 3, -1, 3)
    change = (rates[:, 2, :, 0] - rates[:, 0, :, 0]) / (2.0 * h)
    top = np.abs(rates[:, 1, :, 1]).max(axis=0)
    assert (np.abs(change - rates[:, 1, :, 1]) <= 1e-6 * top + 1e-6).all()


# -- paper and command line ---------------------------------------------------------------------


def test_equations_have_friction_among_the_loads():
    system = mbody.kinetostatics(slider_crank(**HEAVY)).equations()
    assert np.allclose(np.linalg.solve(system.matrix, system.rhs), system.values)
    assert "friction of joints is among the loads" in str(system)


# -- beside other analyses ----------------------------------------------------------------------


@first_fast("name", MACHINES, 1)
def test_efficiency_is_that_of_a_motion_over_time(name):
    """The crank driven by the same law over a turn: the works of `simulate` belong to its steps,
    those of kinetostatics to parts of the turn.
    """
    machine = MACHINES[name]()
    output = next(load.name for load in machine.loads if load.name in ("load", "cylinder"))
    until = 2.0 * math.pi / abs(machine.drivers[0].law.derivatives(0.0)[1])
    motion = mbody.simulate(machine, until, rtol=1e-12)
    run = mbody.kinetostatics(machine, np.linspace(0.0, until, 7201))
    found, wanted = motion.efficiency(output), run.efficiency(output)
    assert found.given == pytest.approx(wanted.given, rel=1e-6)
    assert found.lost == pytest.approx(wanted.lost, rel=1e-6)
    assert found.useful == pytest.approx(wanted.useful, abs=1e-6 * wanted.given)
    # kinetic and potential energies are those of the beginning, as at the end of a turn
    assert found.given == pytest.approx(found.useful + found.lost, rel=1e-8)
    for joint, loss in run.losses.items():
        # the trapezoidal rule errs by half a jump of the power in one of 7200 parts
        own = np.trapezoid(loss, run.t)
        assert motion.energy.lost[joint][-1] == pytest.approx(own, abs=1e-4 * wanted.lost)


@first_fast("instants", [2, 9, 400], 1)
def test_efficiency_does_not_depend_on_the_instants(instants):
    """Changes of direction are found wherever they lie between the instants that there are."""
    machine = MACHINES["six-bar pump"]()
    until = 2.0 * math.pi / machine.drivers[0].law.derivatives(0.0)[1]
    found = mbody.kinetostatics(machine, np.linspace(0.0, until, instants)).efficiency("cylinder")
    # of given, useful and lost work each part of the turn may err by 1e-11 of all work
    assert found.given == pytest.approx(610897.4221313, rel=1e-10)
    assert found.given == pytest.approx(found.useful + found.lost, rel=1e-10)


def test_joints_that_a_driver_turns_back_do_not_stick():
    """The rocker of the pump turns back with all that hangs on it: five joints come to rest at one
    instant and slide on the other way; a row that keeps one of them would contradict the driver.
    """
    machine = MACHINES["six-bar pump"]()
    until = 2.0 * math.pi / machine.drivers[0].law.derivatives(0.0)[1]
    motion = mbody.simulate(machine, until, instants=200, rtol=1e-10)
    run = mbody.kinetostatics(machine, motion.t)
    for joint in run.losses:
        modes = zip(motion.mode(joint), run.mode(joint), run.losses[joint], strict=True)
        assert all(one == other for one, other, loss in modes if loss > 0.0), joint
