"""Unknowns that meet conditions, against closed forms and against the analyses themselves."""

import json
import math
import tomllib

import numpy as np
import pytest

import mbody
from mbody import (
    AngleCoupling,
    AngleDriver,
    Body,
    CoordinateDriver,
    CouplingTerm,
    Force,
    Gravity,
    LengthCoupling,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    SolveError,
    Spring,
    Torque,
    cli,
    from_toml,
    gallery,
    makers,
    solve_for,
    to_toml,
)
from mbody.files.model import in_units
from mbody.laws import ConstantSpeed
from mbody.model.body import SecondMoments
from mbody.model.loads import CentrifugalField
from mbody.model.simulation import Question, Unknown
from mbody.quantities import convert
from tests.cli.test_json_heads import HEAD
from tests.support.cases import first_fast
from tests.support.linkages import held_bar

# -- straight in the unknowns -----------------------------------------------------------------


def four_bar(*more, **options):
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), **{"speed": 10.0, **options})
    machine.add(Torque("brake", "rocker", value=1.0), *more)
    return machine


def test_a_load_instead_of_the_motor():
    """Virtual work says it at once: the brake gives the power that the motor gave."""
    free = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    run = mbody.kinetostatics(free)
    power = run.effort("motor")[0] * 10.0
    answer = solve_for(four_bar(), "brake", "motor.effort = 0")
    assert answer.straight
    (found,) = answer.solutions
    assert found.unknowns["brake"] == pytest.approx(power / run["rocker"].omega[0], rel=1e-12)
    assert found.residual < 1e-14
    # put in as a load, it leaves the motor nothing to do
    again = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    again.add(Torque("brake", "rocker", value=found.unknowns["brake"]))
    assert abs(mbody.kinetostatics(again).effort("motor")[0]) < 1e-12 * abs(power)


@pytest.mark.parametrize("g", [9.81, 0.0])
def test_a_load_that_begins_at_zero(g):
    """Its size is one of the mechanism's own, with weights and without any."""
    found = []
    for value in (1.0, 0.0):
        machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
        machine.g = g
        machine.add(Torque("brake", "rocker", value=value))
        found.append(solve_for(machine, "brake", "motor.effort = 0")[0].unknowns["brake"])
    assert found[1] == pytest.approx(found[0], rel=1e-12)


def test_an_acceleration():
    """The angular acceleration of a rod that falls from 30 degrees: 3 g cos θ / 2 l."""
    rod = Mechanism("rod")
    rod.add(
        Body("rod", mass=2.0, inertia=2.0 * 1.5**2 / 12.0, cg=(0.75, 0.0)),
        Revolute("O", "ground", "rod"),
        AngleDriver("hold", "rod", math.radians(30.0)),
        Gravity("gravity", y=-9.81),
    )
    answer = solve_for(rod, "hold.acceleration", "hold.effort = 0")
    closed = -1.5 * 9.81 * math.cos(math.radians(30.0)) / 1.5
    assert answer[0].unknowns["hold.acceleration"] == pytest.approx(closed, rel=1e-13)
    assert answer[0].units["hold.acceleration"] == "rad/s²"
    assert answer[0].run["rod"].alpha[0] == pytest.approx(closed, rel=1e-13)


def test_two_unknowns_at_an_instant_of_the_law():
    """Two forces on a moving slider-crank; the pin carries nothing, the motor nothing."""
    machine = makers.slider_crank(0.1, 0.4, masses=(1.0, 2.0, 3.0), speed=50.0)
    machine.add(
        Force("push", "slider.B", 1.0, angle=math.pi),
        Force("lift", "rod.B", 1.0, angle=math.pi / 2.0),
    )
    at = {"motor": "130 deg"}
    answer = solve_for(machine, ["push", "lift"], ["motor.effort = 0", "guide.fy = 0"], at=at)
    run = answer[0].run
    assert np.degrees(run["crank"].angle[0]) % 360.0 == pytest.approx(130.0, abs=1e-10)
    assert run["crank"].omega[0] == pytest.approx(50.0, rel=1e-13)
    scale = max(abs(value) for value in answer[0].unknowns.values())
    assert abs(run.effort("motor")[0]) < 1e-12 * scale
    assert abs(run.reaction("guide").fy[0]) < 1e-12 * scale
    values = {f"{name}.value": value for name, value in answer[0].unknowns.items()}
    system = mbody.assemble(machine).with_values(values)
    time = (math.radians(130.0) - machine["motor"].law(0.0)) / 50.0
    again = mbody.kinetostatics(system, t=time)
    assert abs(again.effort("motor")[0]) < 1e-11 * scale


def test_a_parameter_and_a_unit():
    """A preload that holds a lever: P a = F b, in pounds."""
    machine = Mechanism("lever", parameters={"pull": "1 N", "arm": "0.3 m"})
    machine.add(
        Body("lever", points={"A": (0.5, 0.0), "B": ("arm", 0.0)}),
        Revolute("O", "ground", "lever"),
        AngleDriver("hold", "lever", 0.0),
        Force("load", "lever.A", 40.0, angle=-math.pi / 2.0),
        Force("pull", "lever.B", "pull", angle=math.pi / 2.0),
    )
    question = Question(Unknown("pull", unit="lbf"), "hold.effort = 0", analysis="statics")
    found = solve_for(machine, question)[0]
    newtons = 40.0 * 0.5 / 0.3
    assert found.unknowns["pull"] == pytest.approx(newtons / 4.4482216152605, rel=1e-13)
    assert found.units["pull"] == "lbf"


# -- what is greatest -------------------------------------------------------------------------


def vehicle_closed_form(driven, brake, mu=0.8, weight=4000.0, b=40.0, c=50.0, h=25.0):
    """Greatest traction: μ times the load of the driven axles, which moves with the acceleration;
    not more than where an axle lifts.
    """
    sign = -1.0 if brake else 1.0
    wheelbase = b + c
    if driven == "all":
        force = mu * weight
    elif driven == "front":
        force = mu * weight * c / (wheelbase + sign * mu * h)
    else:
        force = mu * weight * b / (wheelbase - sign * mu * h)
    lifts = weight * (b if brake else c) / h
    return sign * min(force, lifts)


@pytest.mark.parametrize("height", [25.0, 80.0])
@pytest.mark.parametrize("brake", [False, True])
@pytest.mark.parametrize("driven", ["front", "rear", "all"])
def test_vehicle(driven, brake, height):
    machine = gallery.load("vehicle", {"height": f"{height} in"})
    question = machine.questions[f"{driven}_{'brake' if brake else 'drive'}"]
    found = solve_for(machine, question)[0]
    traction = float(found.run.measure("traction")[0])
    closed = vehicle_closed_form(driven, brake, h=height)
    assert traction == pytest.approx(closed, rel=1e-12)
    assert found.run.measure("acceleration")[0] == pytest.approx(closed / 4000.0, rel=1e-12)
    lifted = abs(closed) == pytest.approx(4000.0 * (40.0 if brake else 50.0) / height, rel=1e-9)
    lift = "rear_tyre.fy >= 0" if brake else "front_tyre.fy >= 0"
    assert (lift in found.binding) == lifted
    if not lifted:
        assert all(text.startswith("abs(") for text in found.binding)
    # no more can be had: with it given, another unknown torque breaks a side condition
    assert min(found.side_conditions.values()) > -1e-9 * 4000.0


def test_least_and_greatest_of_a_linear_programme():
    """Two forces on a bar with bounds: the corners of a polygon by hand."""
    bar = held_bar()
    # hold.effort = −(P + 2 Q), O.fy (on the bar) = −(P + Q)
    sides = ["O.fy >= -3 N", "hold.effort >= -5 N*m", "O.fy <= 1 N", "hold.effort <= 4 N*m"]
    corners = [(force, torque) for force in (-3.0, 1.0) for torque in (-5.0, 4.0)]
    for objective, value in (
        ("hold.effort - O.fy*(1 m)", lambda force, torque: torque - force),
        ("2*hold.effort + O.fy*(1 m)", lambda force, torque: 2.0 * torque + force),
    ):
        values = [value(*corner) for corner in corners]
        least = solve_for(bar, ["P", "Q"], side_conditions=sides, least=objective)[0]
        greatest = solve_for(bar, ["P", "Q"], side_conditions=sides, greatest=objective)[0]
        assert least.objective == pytest.approx(min(values), abs=1e-12)
        assert greatest.objective == pytest.approx(max(values), abs=1e-12)
        assert len(least.binding) == len(greatest.binding) == 2


def test_a_corner_of_very_many_side_conditions():
    """The corner of a polygon of 80 sides about a circle: 1/cos(π/80) from its middle."""
    step = math.radians(4.5)
    sides = [
        f"{math.cos(n * step)}*O.fy*(1 m) + {math.sin(n * step)}*hold.effort <= 1 N*m"
        for n in range(80)
    ]
    middle = 17.5 * step
    aim = f"{math.cos(middle)}*O.fy*(1 m) + {math.sin(middle)}*hold.effort"
    found = solve_for(held_bar(), ["P", "Q"], side_conditions=sides, greatest=aim)[0]
    assert found.objective == pytest.approx(1.0 / math.cos(math.pi / 80), rel=1e-12)
    assert found.binding == (sides[17], sides[18])


def test_a_whole_side_may_be_best():
    """O.fy is least along the side where it is bounded, as the answer says."""
    answer = solve_for(held_bar(), ["P", "Q"], side_conditions=["O.fy >= -3 N"], least="O.fy")
    assert answer[0].objective == pytest.approx(-3.0, abs=1e-12)
    told = "of 2 unknowns what binds settles 1: others may reach the same value"
    assert answer.notes == (told,)


# -- not straight -----------------------------------------------------------------------------


def test_two_speeds():
    """A mass on a link: F = m r ω², whichever way it turns."""
    machine = Mechanism("mass")
    machine.add(
        Body("arm", mass=2.0, cg=(0.5, 0.0)),
        Revolute("O", "ground", "arm"),
        AngleDriver("motor", "arm", 0.0),
    )
    answer = solve_for(machine, "motor.rate", "O.force = 100 N")
    assert not answer.straight
    speeds = sorted(found.unknowns["motor.rate"] for found in answer.solutions)
    assert speeds == pytest.approx([-10.0, 10.0], rel=1e-12)
    unknown = Unknown("motor.rate", low=0.0, unit="rpm")
    (found,) = solve_for(machine, unknown, "O.force = 100 N").solutions
    assert found.unknowns["motor.rate"] == pytest.approx(300.0 / math.pi, rel=1e-12)


def test_two_positions():
    """A slider-crank has two cranks for a place of the slider: the law of cosines."""
    crank, rod, x = 1.0, 3.0, 2.9
    machine = makers.slider_crank(crank, rod, speed=2.0)
    answer = solve_for(machine, "motor.value", "slider.B.x = 2.9 m")
    found = sorted(one.unknowns["motor.value"] for one in answer.solutions)
    angle = math.degrees(math.acos((crank**2 + x**2 - rod**2) / (2.0 * crank * x)))
    assert found == pytest.approx([-angle, angle], rel=1e-11)
    assert {one.units["motor.value"] for one in answer.solutions} == {"deg"}


@pytest.mark.slow
def test_both_elbows():
    """Two links reach a place with the elbow on either side."""
    machine = Mechanism("arm")
    machine.add(
        Body("one", mass=1.0, points={"A": (1.0, 0.0)}),
        Body("two", mass=1.0, points={"P": (0.8, 0.0)}),
        Revolute("O", "ground", "one"),
        Revolute("A", "one.A", "two"),
        AngleDriver("shoulder", "one", 0.3),
        AngleDriver("elbow", "two", 0.4, relative_to="one"),
    )
    answer = solve_for(
        machine, ["shoulder.value", "elbow.value"], ["two.P.x = 1.1 m", "two.P.y = 0.7 m"]
    )
    cosine = (1.1**2 + 0.7**2 - 1.0 - 0.8**2) / (2.0 * 0.8)
    elbows = sorted(one.unknowns["elbow.value"] for one in answer.solutions)
    bend = math.degrees(math.acos(cosine))
    assert elbows == pytest.approx([-bend, bend], rel=1e-10)
    for one in answer.solutions:
        assert one.run.point("two.P").x[0] == pytest.approx(1.1, rel=1e-12)


def test_a_length():
    """How long the coupler is so that the rocker is at 100 degrees: from the places alone."""
    machine = Mechanism("four-bar", parameters={"c": "3 m"}, ground={"C": (3.5, 0.0)})
    machine.add(
        Body("crank", points={"A": (1.0, 0.0)}),
        Body("coupler", points={"B": ("c", 0.0)}, guess=0.3),
        Body("rocker", points={"B": (2.0, 0.0)}, guess=1.5),
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.A", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("C", "ground.C", "rocker"),
        AngleDriver("motor", "crank", 1.0),
    )
    answer = solve_for(machine, {"c": {"low": "0 m"}}, "rocker.angle = 100 deg")
    angle = math.radians(100.0)
    end = np.array([3.5 + 2.0 * math.cos(angle), 2.0 * math.sin(angle)])
    length = math.dist(end, (math.cos(1.0), math.sin(1.0)))
    assert [one.unknowns["c"] for one in answer.solutions] == pytest.approx([length], rel=1e-11)


def test_stiffness_and_speed_together():
    """A mass on a turning slide: k (r − l₀) = m ω² r, and its acceleration is given."""
    machine = Mechanism("slide", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("slide"),
        Body("mass", mass=2.0),
        Revolute("O", "ground.O", "slide"),
        Prismatic("guide", "slide", "mass"),
        Spring("spring", "ground.O", "mass", stiffness=100.0, free_length=0.5),
        AngleDriver("motor", "slide", ConstantSpeed(0.0, 3.0)),
        CoordinateDriver("reach", "slide", "mass", 0.8),
    )
    answer = solve_for(
        machine,
        {"spring.stiffness": {"low": 0.0}, "motor.rate": {"low": 0.0, "high": "10 rad/s"}},
        ["reach.effort = 0", "mass.ax = -10 m/s^2"],
    )
    (found,) = answer.solutions
    assert found.unknowns["motor.rate"] == pytest.approx(math.sqrt(10.0 / 0.8), rel=1e-11)
    assert found.unknowns["spring.stiffness"] == pytest.approx(2.0 * 10.0 / 0.3, rel=1e-11)


# -- files and the command --------------------------------------------------------------------

MODEL = """
units = "mm-N-s"
angle = "{angle}"
[parameters]
pull = "3 N"
[bodies.arm]
mass = "2 kg"
cg = [100, 0]
points = {{ A = [200, 0] }}
[joints]
O = {{ revolute = ["ground", "arm"] }}
[drivers]
motor = {{ angle = "arm", law = {{ constant_speed = {{ value = 0, speed = "4 rad/s" }} }} }}
[loads]
pull = {{ force = "pull", at = "arm.A", angle = "90 deg" }}
[solve.rest]
unknowns = ["pull"]
conditions = ["motor.effort = 0"]
analysis = "statics"
note = "what is asked"
[solve.place]
unknowns = {{ "motor.value" = {{ start = {start}, low = "-10 deg", high = {high}, unit = "rad" }} }}
conditions = ["arm.A.y = 100 mm"]
[solve.most]
unknowns = ["pull", "motor.acceleration"]
conditions = ["motor.effort = 0"]
side_conditions = ["abs(O.fy) <= 5 N"]
greatest = "O.fy"
at = {{ motor = {start} }}
"""


@pytest.mark.parametrize(("angle", "start", "high"), [("deg", 20, 80), ("rad", 0.3, 1.4)])
def test_questions_of_a_file_come_back(angle, start, high):
    machine = from_toml(MODEL.format(angle=angle, start=start, high=high))
    assert list(machine.questions) == ["rest", "place", "most"]
    place = machine.questions["place"].unknowns[0]
    assert place.start == pytest.approx(math.radians(20.0) if angle == "deg" else 0.3)
    again = from_toml(to_toml(machine))
    assert again == machine
    assert again.questions.keys() == machine.questions.keys()
    other = in_units(machine, "in-lbf-s")
    for name, question in machine.questions.items():
        for one, two in zip(
            solve_for(machine, question).solutions,
            solve_for(other, other.questions[name]).solutions,
            strict=True,
        ):
            for key, value in one.unknowns.items():
                converted = convert(value, one.units[key] or "1", two.units[key] or "1")
                assert two.unknowns[key] == pytest.approx(converted, rel=1e-9, abs=1e-9)


def test_a_place_between_bounds():
    machine = from_toml(MODEL.format(angle="deg", start=20, high=80))
    (found,) = solve_for(machine, machine.questions["place"]).solutions
    assert found.unknowns["motor.value"] == pytest.approx(math.asin(0.5), rel=1e-12)
    assert found.units["motor.value"] == "rad"


def test_different_questions_are_different():
    one = from_toml(MODEL.format(angle="deg", start=20, high=80))
    two = from_toml(MODEL.format(angle="deg", start=20, high=81))
    assert one != two


def run(capsys, *words):
    status = cli.main([*words])
    return status, capsys.readouterr().out


def test_the_command(capsys):
    status, out = run(capsys, "solve", "vehicle", "--json")
    told = json.loads(out)
    assert status == 0
    assert (told["analysis"], set(told)) == ("solve", {*HEAD, "cases"})
    assert list(told["cases"]) == [
        f"{axle}_{what}" for what in ("drive", "brake") for axle in ("front", "rear", "all")
    ]
    for name, case in told["cases"].items():
        axle, _, what = name.partition("_")
        (solution,) = case["solutions"]
        closed = vehicle_closed_form(axle, what == "brake")
        assert solution["measures"]["traction"] == pytest.approx(closed, rel=1e-12)
        assert solution["units"]["motion.acceleration"] == "in/s²"
        forces = [solution["reactions"][f"{end}_tyre"]["fx"] for end in ("front", "rear")]
        assert sum(forces) == pytest.approx(closed, rel=1e-12)
        assert list(solution["conditions"]) == ["motion.effort = 0"]


def test_the_command_for_people(capsys):
    status, out = run(capsys, "solve", "vehicle", "all_brake", "--set", "height=80 in")
    assert status == 0
    assert "binds: rear_tyre.fy >= 0" in out
    assert max(map(len, out.splitlines())) <= 100


@pytest.mark.slow
def test_a_case_without_an_answer(capsys, tmp_path):
    """The others are answered all the same; the exit status says so."""
    text = MODEL.format(angle="deg", start=20, high=80).replace("100 mm", "900 mm")
    path = tmp_path / "model.toml"
    path.write_text(text)
    status, out = run(capsys, "solve", str(path), "--json")
    told = json.loads(out)["cases"]
    assert status == 1
    assert told["place"]["solutions"] == []
    assert "no value of 'motor.value' was found" in told["place"]["error"]["message"]
    assert len(told["rest"]["solutions"]) == 1
    status, out = run(capsys, "solve", str(path), "place")
    assert status == 1
    assert "no solution:\nno value of" in out


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (
            'unknowns = { bore = { start = "10 deg" } }',
            "'10 deg' is an angle (rad), where a length",
        ),
        ('unknowns = { bore = { high = "nothing" } }', "there is no parameter 'nothing'"),
        ('unknowns = { bore = { unit = "deg" } }', "'m' is a length (m), 'deg' is an angle (rad)"),
        ('unknowns = "bore"\nat = { motor = "3 N" }', "'3 N' is a force (N), where an angle"),
        ('unknowns = "bore"\nat = { t = "3 kg" }', "'3 kg' is a mass (kg), where a time (s)"),
    ],
)
def test_numbers_of_something_else_are_told_where_the_file_is_read(lines, words):
    """Before any analysis, with the line; and as a sentence when they are taken to units."""
    text = to_toml(gallery.load("slider_crank"))
    table = f'\n[solve.size]\n{lines}\nconditions = "motor.effort = 0"\n'
    with pytest.raises(ModelError) as caught:
        from_toml(text + table)
    assert "solve.size: " in str(caught.value) and words in str(caught.value)
    machine = gallery.load("slider_crank")
    question = tomllib.loads(table)["solve"]["size"]
    machine.questions["size"] = Question(**question)
    with pytest.raises(ModelError, match=r"solve\.size: "):
        in_units(machine, "mm-N-s")


def test_a_condition_that_always_holds_determines_nothing():
    """A pin carries no torque at any speed: no list of speeds, a sentence."""
    engine = gallery.load("slider_crank")
    with pytest.raises(SolveError, match="holds for any 'speed': nothing determines it"):
        solve_for(engine, "speed", "B.torque = 0 N m")


@first_fast("units", ["SI", "in-lbf-s"], 1)
def test_ratios_radii_and_second_moments_have_their_units(units):
    """A chain of the ratio 2, a belt of the radius 0.2 m, and a field's moment −ω² I_xy."""
    machine = Mechanism("shafts")
    machine.add(
        *(Body(name, mass=1.0, inertia=0.5) for name in ("a", "b", "c")),
        *(Revolute(name.upper(), "ground", name) for name in ("a", "b", "c")),
        AngleCoupling("chain", [CouplingTerm(1.0, angle="a"), CouplingTerm(-1.0, angle="b")]),
        LengthCoupling("belt", [CouplingTerm(0.1, angle="a"), CouplingTerm(-0.3, angle="c")]),
        AngleDriver("motor", "a", ConstantSpeed(0.0, 6.0)),
    )
    machine = in_units(machine, units)
    ratio = solve_for(machine, "chain.1.factor", "b.omega = 3 rad/s")[0]
    assert ratio.unknowns == pytest.approx({"chain.1.factor": -2.0})
    assert ratio.units == {"chain.1.factor": ""}
    radius = solve_for(machine, {"belt.1.factor": {"unit": "mm"}}, "c.omega = 3 rad/s")[0]
    assert radius.unknowns == pytest.approx({"belt.1.factor": -200.0})
    spun = Mechanism("spun")
    spun.add(
        Body("arm", mass=1.0, inertia=0.5, spread=SecondMoments(0.3, 0.2, 0.0)),
        Revolute("O", "ground", "arm"),
        AngleDriver("hold", "arm", 0.0),
        CentrifugalField("field", "ground", speed=10.0),
    )
    spread = {"arm.spread.xy": {"unit": "kg m^2"}}
    found = solve_for(in_units(spun, units), spread, "hold.effort = 5 N m", analysis="statics")[0]
    assert abs(found.unknowns["arm.spread.xy"]) == pytest.approx(5.0 / 100.0)


def test_a_point_of_the_ground_is_a_number():
    """In Python and in the tables of a file; the frame that is found gives the torque again."""
    machine = mbody.gallery.load("norton_fourbar")
    moved = mbody.assemble(machine).with_values({"ground.O4.x": 18.7})
    wanted = float(mbody.kinetostatics(moved).effort("motor")[0])
    request = {"unknowns": ["ground.O4.x"], "conditions": f"motor.effort = {wanted!r} lbf*in"}
    found = mbody.solve_for(machine, **request)[0].unknowns
    assert found["ground.O4.x"] == pytest.approx(18.7, rel=1e-9)
    text = mbody.gallery.path("norton_fourbar").read_text(encoding="utf-8") + (
        f'\n[solve.frame]\nunknowns = ["ground.O4.x"]\nconditions = "{request["conditions"]}"\n'
        '[optimize.best]\nminimize = "peak(motor.effort)"\nby = { "ground.O4.x" = [18, 20] }\n'
        '[fit]\nby = ["ground.O4.x"]\n'
    )
    read = mbody.from_toml(text)
    assert [one.name for one in read.questions["frame"].unknowns] == ["ground.O4.x"]
    with pytest.raises(ModelError, match=r"no number .ground\.mass. to find"):
        mbody.solve_for(machine, unknowns=["ground.mass"], conditions="motor.effort = 1 lbf*in")
