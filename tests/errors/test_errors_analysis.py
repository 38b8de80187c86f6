"""Bad input to the analyses: the sentence, its numbers checked by geometry, what it carries."""

import contextlib
import math
import re

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    Distance,
    DistanceDriver,
    Fixed,
    Mechanism,
    ModelError,
    Revolute,
    SolveError,
    Spring,
    Torque,
    assemble,
    kinematics,
    kinetostatics,
    makers,
    statics,
)
from mbody.engineering import close_loops
from mbody.errors import ModelWarning
from mbody.laws import ConstantAcceleration, ConstantSpeed, Function, Table
from tests.errors import solving
from tests.errors.catalogue import told
from tests.errors.models import (
    FOLDED,
    GROUND,
    ROCKER,
    STRETCHED,
    by_law,
    by_rocker,
    chain,
    four_bar,
    no_oil,
    with_own,
)
from tests.errors.own_code import KINDS
from tests.errors.test_errors import says
from tests.support.cases import first_fast

NAN = math.nan
ANALYSES = [kinematics, kinetostatics, statics, close_loops]


def same(name):
    """The block ends in the error that the catalogue has of that name."""
    found = told(solving.SCENARIOS[name])
    kind = {"ModelError": ModelError, "SolveError": SolveError}[found.kind]
    return says(kind, found.sentence, element=found.element)


def number_after(text, sentence):
    return float(re.search(re.escape(text) + r" ?(-?[0-9.]+)", sentence).group(1))


# -- requests -----------------------------------------------------------------------------------


@pytest.mark.parametrize("analysis", ANALYSES)
def test_models(analysis):
    with says(ModelError, "'m' has no bodies: add at least one Body"):
        analysis(Mechanism("m"))
    with says(ModelError, "takes a Mechanism or a System, not None"):
        analysis(None)
    with says(ModelError, "takes a Mechanism or a System"):
        analysis(Mechanism)


@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize("name", solving.TIMES)
def test_times(analysis, name):
    with same(name):
        analysis(four_bar(), solving.TIMES[name])


@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize("name", solving.DRIVE)
def test_drive(analysis, name):
    with same(name):
        analysis(four_bar(), drive=solving.DRIVE[name])


@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize("name", solving.GUESSES)
def test_guesses(analysis, name):
    with same(name):
        analysis(four_bar(), guess=solving.GUESSES[name])


@pytest.mark.parametrize("analysis", ANALYSES[:3])
@pytest.mark.parametrize("name", solving.TURNS)
def test_turns(analysis, name):
    with same(name):
        analysis(four_bar(), **solving.TURNS[name])


@pytest.mark.parametrize("instants", [0, 1, -3, 2.5, "9", True, NAN])
def test_instants_of_a_turn(instants):
    with says(ModelError, "instants must be a whole number from 2 on", repr(instants)):
        kinematics(four_bar(), turn=True, instants=instants)


def test_turns_of_a_driver_that_makes_none():
    # speed² / (2·40) = 0.3125 rad is gained until the law turns back at 5/40 s
    with says(ModelError, "'motor'", "turns back at t = 0.125", "0.3125", "change the law"):
        kinematics(by_law(ConstantAcceleration(0.0, 5.0, -40.0)), turn=True)
    machine = four_bar(motor=CoordinateDriver("jack", "ground.O4", "crank.A", -2.9))
    with says(ModelError, "'jack' drives no angle", "give times", element="jack"):
        kinematics(machine, turn=True)
    with says(ModelError, "'four-bar' has 0 (none): add one"):
        kinematics(four_bar(motor=False), turn=True)
    with says(ModelError, "has 2 ('motor', 'second'): name one of them"):
        kinematics(four_bar(AngleDriver("second", "rocker", 1.6)), turn=True)


def test_a_turn_may_be_counted_by_numpy():
    assert len(kinematics(four_bar(), turn=True, instants=np.int64(9))) == 9


def test_tables_are_asked_within_their_range():
    table = Table([0.0, 1.0, 2.0], [1.0, 2.0, 4.0])
    with says(
        ModelError, "'motor'", "0 to 2, but 2.25 was requested", 'outside="hold"', element="motor"
    ):
        kinematics(by_law(table), t=np.linspace(0.0, 3.0, 5))
    load = Torque("brake", "rocker", value=table)
    with says(ModelError, "value of load 'brake'", "2.25 was requested", element="brake"):
        statics(four_bar(load), t=[0.0, 2.25])
    with says(ModelError, "'brake'", "0 to 2"):
        kinetostatics(four_bar(load), turn=True)  # of 2π s
    spring = Spring("spring", "ground.O2", "rocker.B", law=table)
    with says(SolveError, "'spring' has no value at t = 0 s", "extend it", element="spring"):
        kinetostatics(four_bar(spring))
    with says(SolveError, "'spring' has no value", element="spring"):
        kinetostatics(four_bar(spring), turn=True)
    assert len(kinetostatics(by_law(table), drive={"motor": 9.0})) == 1


# -- loops and freedoms -----------------------------------------------------------------------


@pytest.mark.parametrize("analysis", ANALYSES)
def test_loops_that_cannot_close(analysis):
    # the crank is at 60°, so coupler and rocker must span A–O4
    machine = four_bar(lengths=(1.0, 1.0, 1.0, 4.0))
    gap = math.dist((0.5, math.sqrt(0.75)), (4.0, 0.0)) - 2.0
    with says(SolveError, " m at 'A'", "'crank' and 'coupler'", "check lengths") as caught:
        analysis(machine)
    assert number_after("smallest gap is", str(caught.value)) == pytest.approx(gap, abs=5e-4)
    assert caught.value.element == "A" and "t = 0 s:" in str(caught.value)


@first_fast(("links", "reach"), [(3, 4.5), (10, 15.0), (100, 150.0)], 2)
def test_chains_that_are_too_short(links, reach):
    with says(SolveError, "do not close", "gap", " m at 'j", "check lengths") as caught:
        close_loops(chain(links, reach))
    if links <= 10:
        gap = number_after("smallest gap is", str(caught.value))
        assert gap == pytest.approx(reach - links, rel=5e-4)


@pytest.mark.parametrize(("links", "reach"), [(3, 2.0), (10, 7.0), (100, 70.0)])
def test_chains_that_begin_in_line_close(links, reach):
    assert close_loops(chain(links, reach)).checks.constraint < 1e-9


def test_a_driver_that_asks_too_much():
    asked = STRETCHED - 0.1
    with says(SolveError, "'motor' cannot bring 'rocker' to", "rad", "check lengths") as caught:
        kinematics(by_rocker(asked))
    assert number_after("'rocker' to", str(caught.value)) == pytest.approx(asked, abs=1e-5)
    assert number_after("comes within", str(caught.value)) == pytest.approx(0.1, abs=5e-4)


def test_two_ends_at_one_place_have_no_direction():
    machine = Mechanism("m", ground={"O": (0.0, 0.0)})
    machine.add(Body("b"), Distance("rod", "ground.O", "b", 2.0), AngleDriver("motor", "b", 0.0))
    with contextlib.suppress(SolveError):  # said, or found from another start
        assert close_loops(machine).checks.constraint < 1e-9
    cylinder = DistanceDriver("jack", "ground.O", "b", 2.0)
    machine = Mechanism("m", ground={"O": (0.0, 0.0)})
    machine.add(Body("b"), Revolute("O", "ground.O", "b"), cylinder)
    with says(SolveError, "'jack'"):
        kinematics(machine)


@pytest.mark.parametrize("analysis", ANALYSES)
def test_a_driver_too_many(analysis):
    second = AngleDriver("second", "rocker", 2.0)
    with says(SolveError, "2 drivers ('motor', 'second') for 1 degree of freedom", "remove 1"):
        analysis(four_bar(second))


@pytest.mark.parametrize("analysis", ANALYSES[:3])
def test_a_driver_that_repeats_another(analysis):
    second = AngleDriver("second", "crank", ConstantSpeed(math.pi / 3.0, 1.0))
    with says(SolveError, "'second' repeats", "rank 9 of 10", "remove it", element="second"):
        analysis(four_bar(second))
    welded = Mechanism("welded")
    welded.add(Body("b"), Fixed("weld", "ground", "b"), AngleDriver("motor", "b", 0.0))
    with says(SolveError, "'motor' repeats", "rank 3 of 4", element="motor"):
        analysis(welded)


@pytest.mark.parametrize("analysis", ANALYSES[:3])
def test_a_driver_too_few(analysis):
    needs = f"{analysis.__name__} needs 0 free degrees of freedom"
    with says(SolveError, needs, "'four-bar' has 1 degree left", "add a driver", "'crank'"):
        analysis(four_bar(motor=False))
    free = Mechanism("free")
    free.add(Body("b", mass=1.0))
    with says(SolveError, needs, "'free' has 3 degrees left", "add a driver", "'b'"):
        analysis(free)


# -- dead centres and branches ----------------------------------------------------------------


@pytest.mark.parametrize(("speed", "at"), [(1.0, FOLDED), (-1.0, STRETCHED)])
@pytest.mark.parametrize("instants", [50, 500])
def test_a_dead_centre_on_the_way(speed, at, instants):
    start = 1.68
    t = np.linspace(0.0, 2.0, instants)
    with says(SolveError, "dead centre at", "of 'rocker'", "'motor'", "drive 'crank'") as caught:
        kinematics(by_rocker(start, speed), t=t)
    error = caught.value
    when = (at - start) / speed
    # half a unit of the last printed digit
    assert number_after("dead centre at", str(error)) == pytest.approx(math.degrees(at), abs=0.05)
    assert number_after("t =", str(error)) == pytest.approx(when, abs=2e-5)
    assert error.element == "motor"
    before = t[t < when]
    assert np.array_equal(error.solution.t, before)
    assert error.solution["rocker"].angle == pytest.approx(start + speed * before, abs=1e-12)
    assert error.solution.status == f"stopped: after {len(before)} instants"


@pytest.mark.parametrize("analysis", ANALYSES[:3])
@pytest.mark.parametrize("at", [STRETCHED, FOLDED])
@pytest.mark.parametrize("guess", [None, "exact"])
@pytest.mark.filterwarnings("ignore::mbody.errors.ModelWarning")  # a rough guess is far from it
def test_a_start_at_a_dead_centre(analysis, at, guess):
    if guess:
        line = math.atan2(ROCKER * math.sin(at), GROUND + ROCKER * math.cos(at))
        crank = line if at == STRETCHED else line + math.pi
        guess = {"crank": crank, "coupler": line, "rocker": at}
    with says(SolveError, "dead centre at", "of 'rocker'", "drive 'crank'") as caught:
        analysis(by_rocker(at), guess=guess)
    where = number_after("dead centre at", str(caught.value))
    assert where == pytest.approx(math.degrees(at), abs=0.05)


def test_a_guess_on_another_branch_is_said():
    with pytest.warns(ModelWarning, match="another branch.* 'coupler' came out .* deg") as caught:
        run = kinematics(four_bar(), guess={"coupler": 1.5, "rocker": 1.0})
    assert run.notes == (str(caught[0].message),)
    assert "guess nearer" in run.notes[0]


@pytest.mark.filterwarnings("error")
def test_a_good_guess_chooses_the_branch():
    crossed = kinematics(four_bar(crossed=True))
    uncrossed = kinematics(four_bar())
    near = {
        "coupler": crossed["coupler"].angle[0] + 0.3,
        "rocker": crossed["rocker"].angle[0] - 0.2,
    }
    run = kinematics(four_bar(), guess=near)
    assert run.notes == ()
    assert run["rocker"].angle == pytest.approx(crossed["rocker"].angle, abs=1e-12)
    assert abs(run["rocker"].angle[0] - uncrossed["rocker"].angle[0]) > 1.0


# -- the user's own functions -----------------------------------------------------------------


def stop(*_):
    raise KeyboardInterrupt


@pytest.mark.parametrize("asked", [{}, {"t": [0.0, 0.1]}, {"turn": True}])
@pytest.mark.parametrize("kind", KINDS)
def test_an_exception_in_a_users_function(kind, asked):
    name = "motor" if kind == "driver" else "own"
    with says(SolveError, f"function of '{name}' failed: ValueError: no oil") as caught:
        kinetostatics(with_own(kind, no_oil), **asked)
    assert caught.value.element == name
    assert isinstance(caught.value.__cause__, ValueError)
    assert caught.value.__cause__.__traceback__ is not None


@pytest.mark.parametrize("kind", KINDS)
def test_an_interrupt_in_a_users_function(kind):
    with pytest.raises(KeyboardInterrupt):
        kinetostatics(with_own(kind, stop), t=[0.0, 0.1])


@pytest.mark.parametrize("value", [NAN, None, "much", [1.0, 2.0]])
@pytest.mark.parametrize("kind", KINDS)
def test_a_users_function_that_gives_no_number(kind, value):
    given = {"custom load": (value,) * 6, "custom joint": ((value, 0), (0,) * 12, (0, 0), (0, 0))}
    name = "motor" if kind == "driver" else "own"
    with says(SolveError, f"function of '{name}' failed", element=name) as caught:
        kinetostatics(with_own(kind, lambda *_: given.get(kind, value)))
    if kind not in given:
        assert f"returned {value!r} at x = " in str(caught.value)


def test_a_function_that_fails_late():
    def late(t):
        return 1.0 + t if t < 0.5 else no_oil()

    law = Function(late, lambda t: 1.0, lambda t: 0.0)
    t = np.linspace(0.0, 1.0, 11)
    with says(SolveError, "'motor' failed: ValueError: no oil", element="motor"):
        kinematics(by_law(law), t=t)
    with says(SolveError, "'brake' failed: ValueError: no oil", element="brake"):
        kinetostatics(four_bar(Torque("brake", "rocker", value=law)), t=t)


# -- the solution and batches -----------------------------------------------------------------


def test_batches():
    system = assemble(four_bar()).with_values({"coupler.B.x": [3.0, 3.1, 9.0, 3.2]})
    with says(SolveError, "design 2 of the batch: loops do not close", " m at ", "lengths"):
        kinetostatics(system, t=[0.0, 0.1])
    with says(ModelError, "a turn of a batch", "give times"):
        kinetostatics(system, turn=True)
    short = assemble(four_bar()).with_values({"coupler.B.x": [3.0, 2.2, 3.1]})
    with says(SolveError, "design 1 of the batch: dead centre at", "'crank'"):
        kinetostatics(short, t=np.linspace(0.0, 6.0, 50))
    good = kinetostatics(assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]}))
    with says(ModelError, "batch", "one design"):
        good.breakdown("A")
    with says(ModelError, "batch of 2 designs", "design(n)"):
        good.columns()
    assert mbody.__version__


def test_a_crank_that_ends_on_the_other_pivot():
    assert makers.four_bar(1.0, 1.0, 1.0, 1.0, start=0.0)


def test_velocities_at_a_dead_centre():
    """A ram that moves a slider at the end of its stroke: no crank speed agrees with it."""
    driven = mbody.makers.slider_crank(1.0, 3.0, start=0.0)
    machine = mbody.Mechanism("press", ground={"O": (0.0, 0.0), "guide": (0.0, 0.0)})
    ram = mbody.CoordinateDriver("ram", "ground.O", "slider.B", mbody.laws.ConstantSpeed(4.0, -0.5))
    machine.add(*driven.bodies, *driven.joints, ram)
    with pytest.raises(mbody.SolveError, match=r"'ram'.*dead centre"):
        close_loops(machine)
