"""Bad input to the analyses: the sentence, its numbers checked by geometry, what it carries."""

import math
import re

import numpy as np
import pytest

import mbody
from mbody.engineering import close_loops
from mbody.errors import ModelWarning
from mbody.laws import ConstantAcceleration, Function, Table
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
ANALYSES = [mbody.kinematics, mbody.kinetostatics, mbody.statics, close_loops]


def number_after(text, sentence):
    return float(re.search(re.escape(text) + r" ?(-?[0-9.]+)", sentence).group(1))


# -- requests -----------------------------------------------------------------------------------


def test_turns_of_a_driver_that_makes_none():
    # speed² / (2·40) = 0.3125 rad is gained until the law turns back at 5/40 s
    with says(mbody.ModelError, "'motor'", "turns back at t = 0.125", "0.3125", "change the law"):
        mbody.kinematics(by_law(ConstantAcceleration(0.0, 5.0, -40.0)), turn=True)
    machine = four_bar(motor=mbody.CoordinateDriver("jack", "ground.O4", "crank.A", -2.9))
    with says(mbody.ModelError, "'jack' drives no angle", "give times", element="jack"):
        mbody.kinematics(machine, turn=True)
    with says(mbody.ModelError, "'four-bar' has 0 (none): add one"):
        mbody.kinematics(four_bar(motor=False), turn=True)
    with says(mbody.ModelError, "has 2 ('motor', 'second'): name one of them"):
        mbody.kinematics(four_bar(mbody.AngleDriver("second", "rocker", 1.6)), turn=True)


def test_tables_are_asked_within_their_range():
    table = Table([0.0, 1.0, 2.0], [1.0, 2.0, 4.0])
    with says(
        mbody.ModelError,
        "'motor'",
        "0 to 2, but 2.25 was requested",
        'outside="hold"',
        element="motor",
    ):
        mbody.kinematics(by_law(table), t=np.linspace(0.0, 3.0, 5))
    load = mbody.Torque("brake", "rocker", value=table)
    with says(mbody.ModelError, "value of load 'brake'", "2.25 was requested", element="brake"):
        mbody.statics(four_bar(load), t=[0.0, 2.25])
    with says(mbody.ModelError, "'brake'", "0 to 2"):
        mbody.kinetostatics(four_bar(load), turn=True)  # of 2π s
    spring = mbody.Spring("spring", "ground.O2", "rocker.B", law=table)
    with says(mbody.SolveError, "'spring' has no value at t = 0 s", "extend it", element="spring"):
        mbody.kinetostatics(four_bar(spring))
    with says(mbody.SolveError, "'spring' has no value", element="spring"):
        mbody.kinetostatics(four_bar(spring), turn=True)
    assert len(mbody.kinetostatics(by_law(table), drive={"motor": 9.0})) == 1


# -- loops and freedoms -----------------------------------------------------------------------


@pytest.mark.parametrize("analysis", ANALYSES)
def test_loops_that_cannot_close(analysis):
    # the crank is at 60°, so coupler and rocker must span A–O4
    machine = four_bar(lengths=(1.0, 1.0, 1.0, 4.0))
    gap = math.dist((0.5, math.sqrt(0.75)), (4.0, 0.0)) - 2.0
    with says(mbody.SolveError, " m at 'A'", "'crank' and 'coupler'", "check lengths") as caught:
        analysis(machine)
    assert number_after("smallest gap is", str(caught.value)) == pytest.approx(gap, abs=5e-4)
    assert caught.value.element == "A" and "t = 0 s:" in str(caught.value)


@first_fast(("links", "reach"), [(3, 4.5), (10, 15.0), (100, 150.0)], 2)
def test_chains_that_are_too_short(links, reach):
    with says(mbody.SolveError, "do not close", "gap", " m at 'j", "check lengths") as caught:
        close_loops(chain(links, reach))
    if links <= 10:
        gap = number_after("smallest gap is", str(caught.value))
        assert gap == pytest.approx(reach - links, rel=5e-4)


@pytest.mark.parametrize(("links", "reach"), [(3, 2.0), (10, 7.0), (100, 70.0)])
def test_chains_that_begin_in_line_close(links, reach):
    assert close_loops(chain(links, reach)).checks.constraint < 1e-9


def test_a_driver_that_asks_too_much():
    asked = STRETCHED - 0.1
    with says(
        mbody.SolveError, "'motor' cannot bring 'rocker' to", "rad", "check lengths"
    ) as caught:
        mbody.kinematics(by_rocker(asked))
    assert number_after("'rocker' to", str(caught.value)) == pytest.approx(asked, abs=1e-5)
    assert number_after("comes within", str(caught.value)) == pytest.approx(0.1, abs=5e-4)


@pytest.mark.parametrize("analysis", ANALYSES[:3])
def test_a_driver_too_few(analysis):
    needs = f"{analysis.__name__} needs 0 free degrees of freedom"
    with says(mbody.SolveError, needs, "'four-bar' has 1 degree left", "add a driver", "'crank'"):
        analysis(four_bar(motor=False))
    free = mbody.Mechanism("free")
    free.add(mbody.Body("b", mass=1.0))
    with says(mbody.SolveError, needs, "'free' has 3 degrees left", "add a driver", "'b'"):
        analysis(free)


# -- dead centres and branches ----------------------------------------------------------------


@pytest.mark.parametrize(("speed", "at"), [(1.0, FOLDED), (-1.0, STRETCHED)])
@pytest.mark.parametrize("instants", [50, 500])
def test_a_dead_centre_on_the_way(speed, at, instants):
    start = 1.68
    t = np.linspace(0.0, 2.0, instants)
    with says(
        mbody.SolveError, "dead centre at", "of 'rocker'", "'motor'", "drive 'crank'"
    ) as caught:
        mbody.kinematics(by_rocker(start, speed), t=t)
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
    with says(mbody.SolveError, "dead centre at", "of 'rocker'", "drive 'crank'") as caught:
        analysis(by_rocker(at), guess=guess)
    where = number_after("dead centre at", str(caught.value))
    assert where == pytest.approx(math.degrees(at), abs=0.05)


def test_a_guess_on_another_branch_is_said():
    with pytest.warns(ModelWarning, match="another branch.* 'coupler' came out .* deg") as caught:
        run = mbody.kinematics(four_bar(), guess={"coupler": 1.5, "rocker": 1.0})
    assert run.notes == (str(caught[0].message),)
    assert "guess nearer" in run.notes[0]


@pytest.mark.filterwarnings("error")
def test_a_good_guess_chooses_the_branch():
    crossed = mbody.kinematics(four_bar(crossed=True))
    uncrossed = mbody.kinematics(four_bar())
    near = {
        "coupler": crossed["coupler"].angle[0] + 0.3,
        "rocker": crossed["rocker"].angle[0] - 0.2,
    }
    run = mbody.kinematics(four_bar(), guess=near)
    assert run.notes == ()
    assert run["rocker"].angle == pytest.approx(crossed["rocker"].angle, abs=1e-12)
    assert abs(run["rocker"].angle[0] - uncrossed["rocker"].angle[0]) > 1.0


# -- the user's own functions -----------------------------------------------------------------


@pytest.mark.parametrize("asked", [{}, {"t": [0.0, 0.1]}, {"turn": True}])
@pytest.mark.parametrize("kind", KINDS)
def test_an_exception_in_a_users_function(kind, asked):
    name = "motor" if kind == "driver" else "own"
    with says(mbody.SolveError, f"function of '{name}' failed: ValueError: no oil") as caught:
        mbody.kinetostatics(with_own(kind, no_oil), **asked)
    assert caught.value.element == name
    assert isinstance(caught.value.__cause__, ValueError)
    assert caught.value.__cause__.__traceback__ is not None


@pytest.mark.parametrize("value", [NAN, None, "much", [1.0, 2.0]])
@pytest.mark.parametrize("kind", KINDS)
def test_a_users_function_that_gives_no_number(kind, value):
    given = {"custom load": (value,) * 6, "custom joint": ((value, 0), (0,) * 12, (0, 0), (0, 0))}
    name = "motor" if kind == "driver" else "own"
    with says(mbody.SolveError, f"function of '{name}' failed", element=name) as caught:
        mbody.kinetostatics(with_own(kind, lambda *_: given.get(kind, value)))
    if kind not in given:
        assert f"returned {value!r} at x = " in str(caught.value)


def test_a_function_that_fails_late():
    def late(t):
        return 1.0 + t if t < 0.5 else no_oil()

    law = Function(late, lambda t: 1.0, lambda t: 0.0)
    t = np.linspace(0.0, 1.0, 11)
    with says(mbody.SolveError, "'motor' failed: ValueError: no oil", element="motor"):
        mbody.kinematics(by_law(law), t=t)
    with says(mbody.SolveError, "'brake' failed: ValueError: no oil", element="brake"):
        mbody.kinetostatics(four_bar(mbody.Torque("brake", "rocker", value=law)), t=t)


# -- the solution and batches -----------------------------------------------------------------


def test_batches():
    system = mbody.assemble(four_bar()).with_values({"coupler.B.x": [3.0, 3.1, 9.0, 3.2]})
    with says(mbody.SolveError, "loops do not close", " m at ", "lengths"):
        mbody.kinetostatics(system, t=[0.0, 0.1]).design(2)
    with says(mbody.ModelError, "a turn of a batch", "give times"):
        mbody.kinetostatics(system, turn=True)
    short = mbody.assemble(four_bar()).with_values({"coupler.B.x": [3.0, 2.2, 3.1]})
    with says(mbody.SolveError, "dead centre at", "'crank'"):
        mbody.kinetostatics(short, t=np.linspace(0.0, 6.0, 50)).design(1)
    good = mbody.kinetostatics(mbody.assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]}))
    with says(mbody.ModelError, "batch", "one design"):
        good.breakdown("A")
    with says(mbody.ModelError, "batch of 2 designs", "design(n)"):
        good.columns()
    assert mbody.__version__
