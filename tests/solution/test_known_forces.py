"""What is made of forces that are not unique says so; what is made of others does not."""

import warnings

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Contact, Gravity, Mechanism, Revolute, SimulationSettings
from mbody.engineering import (
    bearing_load,
    fluctuation,
    flywheel,
    harmonics,
    internal_loads,
    shaking_force,
    shaking_orders,
)
from mbody.model.body import RectangleSection
from mbody.solution.measures import formula_history
from mbody.views.plotting import internal_diagram

G = 9.81


def cranks(count, **pins):
    """So many parallel cranks of a bar; of two at a time one pin of the bar is needed."""
    made = Mechanism("cranks", ground={f"{n}0": (2 * k, 0) for k, n in enumerate("ABC"[:count])})
    points = {n: (2 * k, 0) for k, n in enumerate("ABC"[:count])}
    made.add(Body("bar", mass=5, inertia=7, cg=(2, 0), points=points), Gravity("g", y=-G))
    for n, name in zip("abc", "ABC"[:count], strict=False):
        ends = {"O": (0, 0), "P": (1, 0)}
        made.add(Body(n, mass=1, inertia=1 / 12, cg=(0.5, 0), points=ends, guess=1.0))
        made.add(Revolute(f"{name}0", f"ground.{name}0", f"{n}.O", **pins))
        made.add(Revolute(name, f"{n}.P", f"bar.{name}", **pins))
    made.add(AngleDriver("motor", "a", mbody.laws.ConstantSpeed(1.0, 5.0)))
    return made


def four_bar():
    made = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=5.0)
    made.add(Gravity("g", y=-G))
    return made


def shelf(pins):
    """A board on a pin at each end, or on one and a guide."""
    made = Mechanism("shelf", ground={"A": (0, 0), "B": (1, 0)})
    board = Body("board", mass=2.0, points={"A": (0, 0), "B": (1, 0)}, guess=0.0)
    made.add(board, Revolute("A", "ground.A", "board.A"), Gravity("g", y=-G))
    made.add(
        Revolute("B", "ground.B", "board.B")
        if pins == 2
        else mbody.PinSlot("B", "board.B", "ground.B")
    )
    return made


def chassis(wheels):
    """A body that stands on so many wheels, as contacts."""
    made = Mechanism(
        "chassis", ground={"O": (0, 0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    places = {f"w{k}": (x, -1.0) for k, x in enumerate((-1.0, 1.0, 0.2)[:wheels])}
    made.add(
        Body("car", mass=10.0, inertia=2.0, points=places, guess=(0.0, 1.0, 0.0)),
        Gravity("g", y=-G),
        *(Contact(f"c{k}", "ground.floor", f"car.w{k}") for k in range(wheels)),
    )
    start = {"x": 0.0, "y": 1.0, "angle": 0.0, "vx": 0.5, "vy": 0.0, "omega": 0.0}
    made.simulation = SimulationSettings(until=0.1, start={"car": start})
    return made


def run_of(made):
    return mbody.kinetostatics(made, turn=True, instants=37)


TURN = {"turn": "motor", "instants": 37}
PEAK = "peak(B.force)"


def by_of(made):
    return "bar.mass" if "bar" in made else "coupler.mass"


MADE = {
    "bearing": lambda m: bearing_load(run_of(m), "B", "ball", rating=5000.0),
    "internal loads": lambda m: internal_loads(
        run_of(m), "bar" if "bar" in m else "coupler", ("A", "B")
    ),
    "harmonics": lambda m: harmonics(run_of(m), "B.fx"),
    "free body": lambda m: mbody.free_body(run_of(m), "bar" if "bar" in m else "coupler", 3),
    "members": lambda m: mbody.member_forces(run_of(m), 3),
    "sweep": lambda m: mbody.sweep(m, {by_of(m): [4.0, 5.0]}, measure=PEAK, **TURN),
    "tolerances": lambda m: mbody.tolerances(m, PEAK, {by_of(m): 0.1}, count=0, **TURN),
    "gradient": lambda m: mbody.gradient(m, PEAK, [by_of(m)], **TURN),
    "sensitivity": lambda m: run_of(m).sensitivity(PEAK, [by_of(m)]),
    "optimum": lambda m: mbody.optimize(m, minimize=PEAK, by={by_of(m): (4, 5)}, starts=1, **TURN),
    "limit": lambda m: mbody.optimize(
        m,
        minimize="peak(motor.effort)",
        subject_to="peak(B.force) <= 1000 N",
        by={by_of(m): (4, 5)},
        starts=1,
        **TURN,
    ),
    "front": lambda m: mbody.optimize(
        m, minimize=[PEAK, "peak(A.force)"], by={by_of(m): (4, 5)}, starts=1, points=3, **TURN
    ),
    "fit": lambda m: mbody.fit(
        m, {"t": [0.0, 0.1], "B.fx": run_at(m).reaction("B").fx}, by=[by_of(m)]
    ),
}


def run_at(made):
    return mbody.kinetostatics(made, t=[0.0, 0.1])


@pytest.mark.parametrize("kind", MADE)
def test_what_is_made_of_a_shared_pin_says_so(kind):
    made = MADE[kind](cranks(3))
    found = [one for one in made.notes if "not unique" in one]
    assert len(found) == 1 + (kind == "front")
    assert all(one.startswith("the forces of '") for one in found) and "'B'" in found[0]


@pytest.mark.parametrize("kind", MADE)
def test_what_is_made_of_a_pin_alone_does_not(kind):
    assert not any("unique" in one for one in MADE[kind](four_bar()).notes)


def test_what_no_share_changes_says_nothing():
    """Drivers, positions and sums over the frame are those of the motion."""
    run = run_of(cranks(3))
    for made in (shaking_force(run, "ground.B0"), shaking_orders(run), fluctuation(run)):
        assert made.notes == ()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        flywheel(run, 0.1)
    names = ("motor.effort", "bar.x", "A0.fx + B0.fx + C0.fx", "A.fy + B.fy + C.fy")
    assert [run.known_of(name) for name in names] == [()] * len(names)
    loads = internal_loads(run, "bar", ("A", "C"))
    assert loads.notes and loads.stress(RectangleSection(0.02, 0.008)).notes == loads.notes


def test_two_pins_of_a_board_share_what_lies_between_them():
    run = mbody.statics(shelf(2))
    assert run.reaction("A").unique == (False, True, True)
    assert run.known_of("A.fx") and run.known_of("B") and run.known_of("A.force")
    assert run.known_of("A.fy") == run.known_of("A.fx + B.fx") == run.known_of("board.x") == ()
    assert mbody.statics(shelf(1)).known_of("A") == ()


@pytest.mark.parametrize("wheels", [2, 3])
def test_a_chassis_on_wheels(wheels):
    run = mbody.simulate(chassis(wheels), instants=3)
    assert run.status == "completed"
    for quantity in ("c0.contact", "c1", "peak(c0.force)"):
        found = run.known_of(quantity)
        assert len(found) == (wheels == 3) and all("'c" in one for one in found)
    assert run.known_of("c0.fy + c1.fy" + " + c2.fy" * (wheels == 3)) == ()
    found = mbody.gradient(chassis(wheels), "last(c0.fy)", ["car.mass"], analysis="simulate")
    assert any("not unique" in one for one in found.notes) == (wheels == 3)
    if wheels == 3:
        assert np.isfinite(found.jacobian).all()


def test_an_efficiency_and_the_index_of_joint_forces():
    made = cranks(3, friction=0.1, pin_radius=0.02)
    made.add(mbody.Torque("work", "c", value=-50.0))
    found = mbody.kinetostatics(made, t=np.linspace(0.0, 0.1, 11)).efficiency("work")
    assert any("not unique" in one for one in found.notes)
    run = mbody.kinematics(cranks(3), turn=True, instants=9)
    assert "not unique" in mbody.transmission(run, output="bar", joint="A").notes[0]
    run = mbody.kinematics(four_bar(), turn=True, instants=9)
    assert mbody.transmission(run, output="rocker").notes == ()


@pytest.mark.parametrize("shared", [True, False])
def test_pictures_say_it_below(shared):
    run = run_of(cranks(3) if shared else four_bar())
    body = "bar" if shared else "coupler"
    loads = internal_loads(run, body, ("A", "B"))
    for figure in (
        mbody.draw(run, 3, forces=True),
        mbody.plot(run, "B.force [kN]", "motor.effort"),
        mbody.free_body(run, body, 3).draw(),
        internal_diagram(loads),
    ):
        texts = [one.get_text() for one in figure.texts if one.get_gid() == "notes"]
        assert len(texts) == shared and all("not unique" in " ".join(t.split()) for t in texts)
    for figure in (mbody.draw(run, 3), mbody.plot(run, "motor.effort")):
        assert not [one for one in figure.texts if one.get_gid() == "notes"]


@pytest.mark.parametrize(("force", "open_"), [("B.fx", True), ("A0.fx + B0.fx + C0.fx", False)])
def test_a_law_of_an_angle_that_follows_such_forces(force, open_):
    made = cranks(3)
    made.add(mbody.TorsionSpring("s", "c", free_angle=0.2, law=f"0.01 m*({force}) + 3 N*m/rad*x"))
    run = mbody.kinetostatics(made, t=[0.0, 0.1])
    assert [one.elements for one in run.doubts] == [("s",)] * open_
    found = formula_history(run, made["s"].law, "s.law")
    followed = sum(run.reaction(name.split(".")[0]).fx for name in force.split(" + "))
    np.testing.assert_allclose(found, 0.01 * followed + 3.0 * (run["c"].angle - 0.2), rtol=1e-12)


def test_a_file_knows_it_too(tmp_path):
    run = mbody.simulate(chassis(3), instants=3)
    path = tmp_path / "run.npz"
    mbody.save_run(run, path)
    again = mbody.load_run(path)
    assert again.known_of("c0.contact") and again.known_of("car.x") == ()


@pytest.mark.parametrize(("friction", "radius"), [(0.3, 0.05), (1.2, 0.4)])
def test_friction_that_may_have_several_solutions(friction, radius):
    made, rough = Mechanism("press", ground={"O": (0, 0)}), dict(friction=friction)
    pins = rough | dict(pin_radius=radius)
    made.add(
        Body("crank", mass=1, inertia=0.1, points={"O": (0, 0), "A": (1, 0)}, guess=0.5),
        Body("rod", mass=1, inertia=0.5, points={"A": (0, 0), "B": (2.2, 0)}, guess=0.0),
        Body("slider", mass=2, inertia=0.1, points={"B": (0, 0)}),
        Revolute("O", "ground.O", "crank.O", **pins),
        Revolute("A", "crank.A", "rod.A", **pins),
        Revolute("B", "rod.B", "slider.B", **pins),
        mbody.Prismatic("guide", "ground", "slider", **rough),
        AngleDriver("motor", "crank", mbody.laws.ConstantSpeed(0.5, 3.0)),
        mbody.Force("F", "slider", 30.0, angle=np.pi),
    )
    run = mbody.kinetostatics(made, t=np.linspace(0.0, 0.3, 7))
    uncertain = any("not certain to have one solution" in one for one in run.notes)
    assert uncertain == (radius == 0.4)
    assert run.known_of("slider.x") == ()
    for found in (bearing_load(run, "A").notes, run.known_of("motor.effort")):
        assert len(found) == uncertain and all("not certain" in one for one in found)


def test_designs_of_a_batch_and_motions_without_drivers():
    sums = "A0.fx + B0.fx + C0.fx"
    system = mbody.assemble(cranks(3)).with_values({"bar.mass": [4.0, 5.0, 6.0]})
    free = cranks(3).without("motor")
    free.simulation = SimulationSettings(until=0.1, start={"a": {"angle": 1.0, "omega": 2.0}})
    runs = mbody.kinetostatics(system, t=[0.0, 0.1]), mbody.simulate(free, instants=5)
    for run in runs:
        (note,) = run.known_of("B.force")
        assert "'B'" in note and run.known_of(sums) == run.known_of("bar.x") == ()
    many = mbody.assemble(four_bar()).with_values({"coupler.mass": [4.0, 5.0, 6.0]})
    assert mbody.kinetostatics(many, t=[0.0, 0.1]).known_of("B.force") == ()
    swept = mbody.sweep(free, {"bar.mass": [4.0, 5.0]}, "simulate", measure="last(B.force)")
    assert "not unique" in swept.notes[0] and "not unique" in str(swept)
