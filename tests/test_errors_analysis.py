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
    ConstantAcceleration,
    ConstantSpeed,
    CoordinateDriver,
    CustomJoint,
    CustomLoad,
    Distance,
    DistanceDriver,
    Fixed,
    Function,
    Marker,
    Mechanism,
    ModelError,
    ModelWarning,
    Revolute,
    SolveError,
    Spring,
    Table,
    Torque,
    assemble,
    close_loops,
    kinematics,
    kinetostatics,
    makers,
    statics,
)
from tests.test_errors import says

NAN = math.nan
CRANK, COUPLER, ROCKER, GROUND = 1.0, 3.0, 2.0, 3.5
ANALYSES = [kinematics, kinetostatics, statics, close_loops]
LENGTHS = (CRANK, COUPLER, ROCKER, GROUND)


def four_bar(*more, motor=None, lengths=LENGTHS, **options):
    """The four-bar of these tests, with another motor or none (False), and more elements."""
    made = makers.four_bar(*lengths, masses=(1.0, 3.0, 2.0), **{"speed": 1.0, **options})
    machine = Mechanism(made.name, ground=made.ground.points)
    machine.add(*(element for element in made if element.name != "motor"))
    if motor is not False:
        machine.add(motor or made["motor"])
    machine.add(*more)
    return machine


def by_rocker(start, speed=1.0):
    return four_bar(motor=AngleDriver("motor", "rocker", ConstantSpeed(start, speed)))


def by_law(law):
    return four_bar(motor=AngleDriver("motor", "crank", law))


def dead_centre(reach):
    """Angle of the rocker where crank and coupler are in line and span `reach`: law of cosines."""
    cosine = (GROUND**2 + ROCKER**2 - reach**2) / (2.0 * GROUND * ROCKER)
    return math.pi - math.acos(cosine)


STRETCHED, FOLDED = dead_centre(COUPLER + CRANK), dead_centre(COUPLER - CRANK)


def number_after(text, sentence):
    return float(re.search(re.escape(text) + r" ?(-?[0-9.]+)", sentence).group(1))


# -- what is asked for ------------------------------------------------------------------------


@pytest.mark.parametrize("analysis", ANALYSES)
def test_models(analysis):
    with says(ModelError, "'m' has no bodies: add at least one Body"):
        analysis(Mechanism("m"))
    with says(ModelError, "takes a Mechanism or a System, not None"):
        analysis(None)
    with says(ModelError, "takes a Mechanism or a System"):
        analysis(Mechanism)


@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize(
    ("t", "words"),
    [
        (NAN, ("t is nan", "finite")),
        (-math.inf, ("t is -inf", "finite")),
        ([0.0, NAN], ("t[1] is nan", "finite")),
        ([], ("t is empty", "at least one")),
        ([[0.0, 1.0], [2.0, 3.0]], ("t must be a number or one row", "(2, 2)")),
        ("1", ("t must be a number or an array", "'1'")),
        (["0", "1"], ("t must be a number or an array",)),
        ([0.0, None], ("t must be a number or an array",)),
        (True, ("t must be a number", "True")),
        (1j, ("t must be a number", "1j")),
        ({}, ("t must be a number", "{}")),
    ],
)
def test_times(analysis, t, words):
    with says(ModelError, *words):
        analysis(four_bar(), t)


@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize(
    ("drive", "words"),
    [
        ({"engine": 1.0}, ("no driver 'engine'", "there are: 'motor'")),
        ({"crank": 1.0}, ("no driver 'crank'", "there are: 'motor'")),
        ({3: 1.0}, ("no driver 3",)),
        ({"motor": NAN}, ("value of driver 'motor' is nan", "finite")),
        ({"motor": (1.0, NAN)}, ("rate of driver 'motor' is nan",)),
        ({"motor": (1.0, 0.0, "0")}, ("acceleration of driver 'motor'", "'0'")),
        ({"motor": None}, ("value of driver 'motor' must be a number", "None")),
        ({"motor": "60 deg"}, ("value of driver 'motor' must be a number", "'60 deg'")),
        ({"motor": ()}, ("driver 'motor' takes a value", "not 0 of them")),
        ({"motor": (1, 2, 3, 4)}, ("(value, rate, acceleration), not 4",)),
        ({"motor": []}, ("value of driver 'motor' is empty",)),
        ({"motor": ([1.0, 2.0], [1.0, 2.0, 3.0])}, ("different numbers", "[2, 3]", "as many")),
        ("motor", ('drive must be a dict such as {"motor": 0.5}', "'motor'")),
        (5, ("drive must be a dict", "5")),
    ],
)
def test_drive(analysis, drive, words):
    with says(ModelError, *words):
        analysis(four_bar(), drive=drive)


@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize(
    ("guess", "words"),
    [
        ({"rod": 1.0}, ("no element 'rod'", "'coupler'")),
        ({"motor": 1.0}, ("a guess is for bodies, 'motor' is none",)),
        ({"ground": 1.0}, ("the ground does not move",)),
        ({"coupler": NAN}, ("'coupler': guess.angle is nan",)),
        ({"coupler": (0.0, NAN, 0.0)}, ("'coupler': guess.y is nan",)),
        ({"coupler": "30 kg"}, ("'coupler': guess.angle: '30 kg' is a mass",)),
        ({"coupler": (1.0, 2.0)}, ("'coupler': guess must be an angle or (x, y, angle)",)),
        (["coupler"], ("guess must be a dict",)),
        ("coupler", ("guess must be a dict",)),
    ],
)
def test_guesses(analysis, guess, words):
    with says(ModelError, *words):
        analysis(four_bar(), guess=guess)


@pytest.mark.parametrize("analysis", ANALYSES[:3])
@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"turn": "engine"}, ("no driver 'engine' to turn", "'motor'")),
        ({"turn": 3}, ("no driver 3 to turn",)),
        ({"turn": True, "t": 0.0}, ("turn goes alone: leave out t",)),
        ({"turn": True, "drive": {"motor": 1.0}}, ("turn goes alone: leave out drive",)),
        ({"instants": 5}, ("instants goes with turn",)),
        ({"turn": False, "instants": 5}, ("instants goes with turn",)),
        *(
            ({"turn": True, "instants": n}, ("at least 2 instants", "whole number", repr(n)))
            for n in (0, 1, -3, 2.5, "9", True, NAN)
        ),
    ],
)
def test_turns(analysis, asked, words):
    with says(ModelError, *words):
        analysis(four_bar(), **asked)


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
    with says(ModelError, "'motor'", "0 to 2, asked for 2.25", 'outside="hold"', element="motor"):
        kinematics(by_law(table), t=np.linspace(0.0, 3.0, 5))
    load = Torque("brake", "rocker", value=table)
    with says(ModelError, "value of load 'brake'", "asked for 2.25", element="brake"):
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
    # the crank stands at 60°, so coupler and rocker must span A–O4
    machine = four_bar(lengths=(1.0, 1.0, 1.0, 4.0))
    gap = math.dist((0.5, math.sqrt(0.75)), (4.0, 0.0)) - 2.0
    with says(SolveError, " m at 'A'", "'crank' and 'coupler'", "check lengths") as caught:
        analysis(machine)
    assert number_after("smallest gap is", str(caught.value)) == pytest.approx(gap, abs=5e-4)
    assert caught.value.element == "A" and "t = 0:" in str(caught.value)


def chain(links, reach):
    """Bars of length 1 in a row, all guessed in one line, between two pins."""
    machine = Mechanism("chain", ground={"A": (0.0, 0.0), "Z": (reach, 0.0)})
    here = "ground.A"
    for n in range(links):
        machine.add(makers.bar(f"b{n}", 1.0, guess=0.0), Revolute(f"j{n}", here, f"b{n}.A"))
        here = f"b{n}.B"
    machine.add(Revolute("end", here, "ground.Z"))
    return machine


@pytest.mark.parametrize(("links", "reach"), [(3, 4.5), (10, 15.0), (100, 150.0)])
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
    assert error.solution.status == f"stopped after {len(before)} instants"


@pytest.mark.parametrize("analysis", ANALYSES[:3])
@pytest.mark.parametrize("at", [STRETCHED, FOLDED])
@pytest.mark.parametrize("guess", [None, "exact"])
@pytest.mark.filterwarnings("ignore::mbody.ModelWarning")  # a rough guess is far from it
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
        run = kinematics(four_bar(), guess={"coupler": -1.0, "rocker": 2.0})
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


def no_oil(*_):
    raise ValueError("no oil")


def stop(*_):
    raise KeyboardInterrupt


class OwnLoad(CustomLoad):
    def physics(self, i, j, p, t):
        return ANSWER(i, j, p, t)


class OwnJoint(CustomJoint):
    rows = "l"

    def physics(self, i, j, p, t):
        return ANSWER(i, j, p, t)


ANSWER = no_oil


def with_own(kind, function):
    """A four-bar with a user's function: as a law or inside an element."""
    global ANSWER
    ANSWER = function
    if kind == "driver":
        return by_law(function)
    if kind == "load":
        return four_bar(Torque("own", "rocker", value=function))
    if kind == "spring":
        return four_bar(Spring("own", "ground.O2", "rocker.B", law=function))
    if kind == "custom load":
        return four_bar(OwnLoad("own", "ground.O2", "rocker.B"))
    machine = four_bar(Body("pin", mass=1.0))
    machine.add(OwnJoint("own", "rocker.B", "pin"))
    return machine


KINDS = ["driver", "load", "spring", "custom load", "custom joint"]


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


def test_a_physics_that_is_missing_or_of_another_size():
    with says(SolveError, "'own'", "CustomLoad needs a method physics(i, j, p, t)"):
        kinetostatics(four_bar(CustomLoad("own", "ground.O2", "rocker.B")))
    machine = four_bar(Body("pin"))
    machine.add(CustomJoint("own", "rocker.B", "pin"))
    with says(SolveError, "'own'", "CustomJoint needs a method physics(i, j, p, t)"):
        kinetostatics(machine)
    with says(SolveError, "'own'", "2 numbers, 6 are wanted"):
        kinetostatics(with_own("custom load", lambda *_: (1.0, 2.0)))
    with says(SolveError, "'own'", "2 numbers, 18 are wanted"):
        kinetostatics(with_own("custom joint", lambda *_: (1.0, 2.0)))


def test_a_function_without_an_argument():
    with says(SolveError, "'motor'", "takes 0 positional arguments"):
        kinematics(by_law(lambda: 1.0))


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


@pytest.fixture(scope="module")
def run():
    return kinetostatics(four_bar())


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda run: run["rod"], ("no body 'rod'", "'crank', 'coupler', 'rocker', 'ground'")),
        (lambda run: run[["crank"]], ("no body ['crank']",)),
        (lambda run: run.reaction("C"), ("no joint 'C'", "'O2', 'A', 'B', 'O4'")),
        (lambda run: run.reaction("motor"), ("no joint 'motor'", "'O2'")),
        (lambda run: run.reaction("A", on="rocker"), ("'A' joins 'crank' and 'coupler'",)),
        (lambda run: run.reaction("A", on=2), ("'A' joins 'crank' and 'coupler', not 2",)),
        (lambda run: run.effort("engine"), ("no driver 'engine'", "'motor'")),
        (lambda run: run.effort(["motor"]), ("no driver ['motor']",)),
        (lambda run: run.point("coupler.P"), ("'coupler' has no point 'P'", "'A', 'B'")),
        (lambda run: run.point("rod.P"), ("no body 'rod'",)),
        (lambda run: run.point(Marker("coupler", (NAN, 0.0))), ("place.x is nan",)),
        (lambda run: run.inertia("rod"), ("no body 'rod'",)),
        (lambda run: run.breakdown("crank"), ("'crank' is neither a joint nor a driver",)),
        (lambda run: run.breakdown(["A"]), ("by name, not of ['A']",)),
    ],
)
def test_questions_to_a_solution(run, ask, words):
    with says(ModelError, *words):
        ask(run)


def test_kinematics_has_no_forces():
    run = kinematics(four_bar())
    for ask in (run.reaction, run.breakdown):
        with says(ModelError, "kinematics finds no forces: use kinetostatics"):
            ask("A")
    with says(ModelError, "use kinetostatics", element="motor"):
        run.effort("motor")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"crank.mas": 1.0}, ("no number 'crank.mas'", "'crank.mass'")),
        ({"crank.mass": -1.0}, ("'crank.mass' is -1", "not be negative")),
        ({"crank.mass": [1.0, NAN]}, ("'crank.mass'", "not finite")),
        ({"crank.mass": "1 kg"}, ("'crank.mass' must be a number", "'1 kg'")),
        ({"crank.mass": [[1.0]]}, ("'crank.mass' must be a number or one row",)),
        ({"crank.mass": [1.0, 2.0], "rocker.mass": [1.0]}, ("'rocker.mass' has 1", "have 2")),
    ],
)
def test_numbers_of_a_batch(run, values, words):
    with says(ModelError, *words):
        run.system.with_values(values)


def test_batches():
    system = assemble(four_bar()).with_values({"coupler.B.x": [3.0, 3.1, 9.0, 3.2]})
    with says(SolveError, "design 2 of the batch: loops do not close", " m at ", "lengths"):
        kinetostatics(system, t=[0.0, 0.1])
    with says(ModelError, "a turn of a batch", "give times"):
        kinetostatics(system, turn=True)
    with says(ModelError, "one design", "design(n)"):
        close_loops(system)
    short = assemble(four_bar()).with_values({"coupler.B.x": [3.0, 2.2, 3.1]})
    with says(SolveError, "design 1 of the batch: dead centre at", "'crank'"):
        kinetostatics(short, t=np.linspace(0.0, 6.0, 50))
    good = kinetostatics(assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]}))
    with says(ModelError, "batch", "one design"):
        good.breakdown("A")
    with says(ModelError, "batch of 2 designs", "design(n)"):
        good.columns()
    assert mbody.__version__


@pytest.mark.parametrize(
    ("make_it", "words"),
    [
        (lambda: close_loops(four_bar(), rates={"rod": 1.0}), ("no moving body 'rod'",)),
        (lambda: close_loops(four_bar(), rates={"crank": NAN}), ("'crank': rate is nan", "finite")),
        (
            lambda: close_loops(four_bar(), rates={"crank": "2 m"}),
            ("'crank': rate: '2 m' is a length",),
        ),
        (lambda: close_loops(four_bar(), rates=5), ("rates must be a dict",)),
        (lambda: makers.four_bar("1", 3, 2, 3.5), ("'four-bar': crank must be a plain number",)),
        (lambda: makers.four_bar(1, 0, 2, 3.5), ("'four-bar': coupler is 0", "positive")),
        (lambda: makers.four_bar(1, 3, 2, 3.5, masses=(1, 2)), ("masses must be three numbers",)),
        (lambda: makers.slider_crank(1, 0), ("'slider-crank': rod is 0", "positive")),
        (lambda: makers.slider_crank(1, 3, speed=NAN), ("'slider-crank': speed is nan",)),
        (lambda: makers.bar("b", -1.0), ("'b': length is -1", "positive")),
        (lambda: assemble(four_bar()).with_values(5), ("values must be a dict",)),
        (lambda: assemble(four_bar()).with_values({3: 1.0}), ("no number '3'",)),
        (
            lambda: assemble(four_bar()).with_values({"crank.mass": "1"}),
            ("must be a number", "'1'"),
        ),
        (lambda: assemble(four_bar()).design(1), ("no design 1: give 0 to 0",)),
        (lambda: assemble(four_bar()).design("x"), ("no design 'x'",)),
    ],
)
def test_makers_rates_and_designs(make_it, words):
    with says(ModelError, *words):
        make_it()


def test_a_crank_that_ends_on_the_other_pivot():
    assert makers.four_bar(1.0, 1.0, 1.0, 1.0, start=0.0)


def test_velocities_at_a_dead_centre():
    """A ram that moves a slider at the end of its stroke: no crank speed agrees with it."""
    driven = mbody.makers.slider_crank(1.0, 3.0, start=0.0)
    machine = mbody.Mechanism("press", ground={"O": (0.0, 0.0), "guide": (0.0, 0.0)})
    ram = mbody.CoordinateDriver("ram", "ground.O", "slider.B", mbody.ConstantSpeed(4.0, -0.5))
    machine.add(*driven.bodies, *driven.joints, ram)
    with pytest.raises(mbody.SolveError, match=r"'ram'.*dead centre"):
        mbody.close_loops(machine)
