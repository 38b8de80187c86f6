"""The readable summary, tables and files: names, numbers and sentences as a reader meets them."""

import csv
import math
import re

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, DistanceDriver, Mechanism, Revolute
from mbody.engineering import close_loops
from mbody.summaries.text_table import (
    WIDTH,
    Column,
    angles,
    force_names,
    number,
    numbers,
    polars,
    table,
)
from validation.norton_fourbar import PRINT, build


def rows(text: str, title: str) -> dict[str, list[str]]:
    """The cells of the table of that title, split at blanks, by their first word."""
    part = next(p for p in text.split("\n\n") if p.startswith(title))
    _, body = re.split(r"^─+$", part, flags=re.MULTILINE)
    return {line.split()[0]: line.split()[1:] for line in body.strip().splitlines()}


def seen(text: str) -> None:
    """What holds of every summary."""
    assert all(len(line) <= WIDTH for line in text.splitlines()), max(text.splitlines(), key=len)
    assert all(line == line.rstrip() for line in text.splitlines())
    assert not re.search(r"(?<![\d.])-0(\.0*)?(?![\d.e])", text), text
    assert "nan" not in text
    assert "\x1b" not in text


@pytest.fixture(scope="module")
def norton():
    return mbody.kinetostatics(build())


@pytest.fixture(scope="module")
def turn():
    return mbody.kinetostatics(build(), turn=True)


# -- numbers as text --------------------------------------------------------------------------


def test_columns_have_six_digits_and_points_in_line():
    assert numbers([-117.559592, 0.01, 3.0]) == ["-117.5596", "0.0100", "3.0000"]
    assert numbers([25.0, -40.0]) == ["25", "-40"]
    assert numbers([0.0, -0.0]) == ["0", "0"]
    assert numbers([-1e-13, 5.25], floor=1e-9) == ["0.00", "5.25"]
    assert numbers([1e-12, 3.0]) == ["1e-12", "3"]
    assert numbers([1.5e9, 2.0]) == ["1.5e+09", "2"]
    assert numbers([200.0, 1e6]) == ["200", "1000000"]
    assert number(-0.0) == "0"


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1.0, 123.456, 1e5, 1e12])
def test_columns_keep_what_they_show(scale):
    values = scale * np.array([1.0, -0.5, 0.123456789, 0.0])
    cells = [float(cell) for cell in numbers(values)]
    assert np.allclose(cells, values, rtol=0.0, atol=0.51e-5 * scale)
    # the smallest one keeps three digits
    assert math.isclose(cells[2], values[2], rel_tol=5e-3)


def test_angles_stay_below_a_turn():
    assert angles([-1e-9, 2.0 * math.pi, -math.pi / 2.0]) == ["0.000", "0.000", "270.000"]
    assert polars([0.0, -1.0], [0.0, -1e-15], 1e-12)[1].endswith("180.000°")
    assert "@" not in polars([0.0, -1.0], [0.0, 0.0])[0]


def test_tables_cut_text_and_nothing_else():
    long = "a very long name of a very ordinary connecting rod in a machine " * 3
    columns = [Column("LINKS", [long], text=True), Column("x", ["-1.23457e-05"], "mm")]
    lines = table([*columns, Column("joint", [long], text=True)])
    assert max(map(len, lines)) <= WIDTH
    assert "…" in lines[-1] and "-1.23457e-05" in lines[-1]


# -- one instant ------------------------------------------------------------------------------


def test_the_summary_of_norton(norton):
    text = str(norton)
    seen(text)
    links = rows(text, "LINKS")
    assert links["1"] == ["ground"]
    assert links["3"][:4] == ["coupler", "0.0199482", "1.5", "20.917"]
    assert links["4"][6:] == ["1416.80", "@", "207.237°"]
    forces = rows(text, "FORCES")
    assert list(forces) == ["F12", "F32", "F43", "F14"]
    assert forces["F12"][:5] == ["-117.560", "-107.459", "159.272", "@", "222.430°"]
    assert forces["F32"][5:] == ["A", "coupler", "on", "crank"]
    assert rows(text, "DRIVERS") == {
        "T12": ["motor", "243.238", "6080.94", "60.000", "25", "238.732", "-40"]
    }
    inertia = rows(text, "INERTIA")
    assert float(inertia["4"][-1]) == pytest.approx(-0.8 * 276.289, abs=1e-3)
    loads = rows(text, "LOADS")
    assert " ".join(loads["F_P"]) == "Force 80 lbf @ 330.000° on coupler.P"
    assert " ".join(loads["T_4"]) == "Torque 120 lbf·in on rocker"
    assert text.splitlines()[-1].startswith("RESIDUALS   constraint ")


def test_the_summary_is_the_solution(norton):
    forces = rows(str(norton), "FORCES")
    for joint, (name, on) in force_names(norton.mechanism).items():
        if joint == "motor":
            continue
        reaction = norton.reaction(joint, on)
        shown = [float(forces[name][k]) for k in (0, 1, 2)]
        exact = [reaction.fx[0], reaction.fy[0], reaction.magnitude[0]]
        assert np.allclose(shown, exact, rtol=0.0, atol=5.1e-4)


def test_printed_masses_give_the_printed_answers():
    run = mbody.kinetostatics(build("printed"))
    forces = rows(str(run), "FORCES")
    for name in ("F12", "F32", "F43", "F14"):
        shown = [float(cell) for cell in forces[name][:3]]
        assert np.allclose(shown, np.array(PRINT[name][:3], dtype=float), rtol=0.0, atol=0.0051)
    assert float(rows(str(run), "DRIVERS")["T12"][1]) == pytest.approx(243.23, abs=0.005)


def test_summaries_without_forces_show_none():
    for run in (mbody.kinematics(build()), close_loops(build())):
        text = str(run)
        seen(text)
        assert "FORCES" not in text and "lbf " not in text.partition("LINKS")[2].split("DRIV")[1]
        assert "equilibrium" not in text
    assert "FORCES" not in str(mbody.kinematics(build(), turn=True))


def test_the_summary_of_statics_shows_no_motion():
    text = str(mbody.statics(build()))
    seen(text)
    assert "rad/s" not in text and "INERTIA" not in text and "power" not in text
    assert rows(text, "FORCES")["F12"][:2] == ["-44.0938", "-9.8115"]


def test_torques_redundancy_and_force_drivers():
    machine = Mechanism("a lift on two guides", ground={"A": (0.0, 0.0), "B": (1.0, 0.0)})
    lift = Body("lift", mass=2.0, cg=(0.5, 0.2), points={"A": (0.0, 0.0), "B": (1.0, 0.0)})
    up = math.pi / 2.0
    machine.add(
        lift,
        mbody.Prismatic("left", machine.ground.at("A", angle=up), lift.at("A", angle=up)),
        mbody.Prismatic("right", machine.ground.at("B", angle=up), lift.at("B", angle=up)),
        mbody.CoordinateDriver("winch", machine.ground.at("A", angle=up), lift.at("A"), 0.3),
        mbody.Gravity("gravity", y=-10.0),
    )
    text = str(mbody.kinetostatics(machine))
    seen(text)
    assert "torque" in text and "torques about" in text
    forces = rows(text, "FORCES")
    for joint in ("left", "right"):
        # the winch pulls at one side: 20 N by 0.5 m, and both guides share the couple
        assert forces[f"F12,{joint}"] == [
            "0",
            "0",
            "0",
            "5",
            *(joint, "ground", "on", "lift"),
            *("not", "unique:", "x,", "y,", "T"),
        ]
    name, effort = next(iter(rows(text, "DRIVERS").items()))
    assert (name, effort[:2]) == ("F12,winch", ["winch", "20"])
    assert " ".join(rows(text, "LOADS")["gravity"]) == "Gravity (0, -10) m/s² on every mass"


def test_every_load_says_what_it_is():
    machine = mbody.makers.slider_crank(0.1, 0.3, masses=(1, 2, 3), speed=100.0)
    ends = ("ground.guide", "slider.B")
    machine.add(
        mbody.Spring("spring", *ends, stiffness=2000.0, free_length=0.1),
        mbody.Damper("dashpot", *ends, law=lambda rate: 3.0 * rate),
        mbody.TorsionSpring("hinge", "rod", by="crank", stiffness=3.0),
        mbody.Force("push", "slider.B", lambda t: 5.0 + t, angle=-0.0, follows=True),
    )
    text = str(mbody.kinetostatics(machine))
    seen(text)
    loads = {name: " ".join(cells) for name, cells in rows(text, "LOADS").items()}
    assert loads == {
        "spring": "Spring stiffness 2000 N/m, free length 0.1 m on slider",
        "dashpot": "Damper by a law on slider",
        "hinge": "TorsionSpring stiffness 3 N·m/rad of crank on rod",
        "push": "Force 5 N @ 0.000° from the axes of slider on slider.B",
    }


# -- names of forces --------------------------------------------------------------------------


def chain(*pairs: tuple[str, str], bodies: int) -> Mechanism:
    machine = Mechanism("a chain")
    machine.add(*(Body(f"b{n}", points={"P": (0.0, 0.0)}) for n in range(2, bodies + 2)))
    machine.add(*(Revolute(f"J{n}", i, j) for n, (i, j) in enumerate(pairs)))
    return machine


def test_names_in_a_six_bar():
    pairs = [("ground", "b2"), ("b2", "b3"), ("b4", "b3"), ("b4", "ground")]
    pairs += [("b5", "b4"), ("b5", "b6"), ("b6", "ground")]
    machine = chain(*pairs, bodies=5)
    machine.add(AngleDriver("motor", "b2"), AngleDriver("wrist", "b5", relative_to="b6"))
    machine.add(DistanceDriver("ram", "b6.P", "b3.P", law=1.0))
    assert force_names(machine) == {
        "J0": ("F12", "b2"),
        "J1": ("F32", "b2"),
        "J2": ("F43", "b3"),
        "J3": ("F14", "b4"),
        "J4": ("F54", "b4"),
        "J5": ("F65", "b5"),
        "J6": ("F16", "b6"),
        "motor": ("T12", "b2"),
        "wrist": ("T65", "b5"),
        "ram": ("F63,ram", "b3"),
    }


def test_names_stay_unambiguous():
    machine = chain(("ground", "b2"), ("b2", "b3"), ("b3", "b2"), bodies=2)
    assert [name for name, _ in force_names(machine).values()] == ["F12", "F32,J1", "F32,J2"]
    pairs = [("ground", "b2"), ("b3", "b12"), ("b10", "b11")]
    names = force_names(chain(*pairs, bodies=11))
    assert [name for name, _ in names.values()] == ["F(1,2)", "F(12,3)", "F(11,10)"]
    assert names["J1"][1] == "b3"
    # eight moving links and the ground still have one digit each
    assert force_names(chain(("b8", "b9"), bodies=8))["J0"] == ("F98", "b8")


# -- many instants and designs ----------------------------------------------------------------


def test_the_summary_of_a_turn(turn):
    text = str(turn)
    seen(text)
    assert "kinetostatics at 361 instants, t = 0 … 0.348476 s" in text
    forces = rows(text, "PEAK FORCES")
    reaction = turn.reaction("O4", on="rocker")
    k = int(np.argmax(reaction.magnitude))
    size, _, direction, t, angle = forces["F14"][:5]
    assert float(size) == pytest.approx(reaction.magnitude[k], abs=5e-4)
    assert float(direction[:-1]) == pytest.approx(math.degrees(reaction.direction[k]), abs=6e-4)
    assert float(t) == pytest.approx(turn.t[k], rel=1e-5)
    assert float(angle) == pytest.approx((60.0 + k) % 360.0, abs=1e-3)
    least, greatest, mean, rms = (float(cell) for cell in rows(text, "TORQUES")["T12"][1:5])
    effort = turn.effort("motor")
    assert (least, greatest) == pytest.approx((effort.min(), effort.max()), abs=1e-3)
    span = np.ptp(turn.t)
    assert mean == pytest.approx(np.trapezoid(effort, turn.t) / span, rel=1e-4)
    assert rms == pytest.approx(math.sqrt(np.trapezoid(effort**2, turn.t) / span), rel=1e-5)
    assert "mean and rms over time" in text
    assert text.splitlines()[-1].startswith("RESIDUALS")


def test_the_summary_of_a_batch_says_how_many():
    system = mbody.assemble(build()).with_values({"crank.inertia": np.linspace(0.1, 1.0, 7)})
    text = str(mbody.kinetostatics(system, t=np.linspace(0.0, 0.1, 5)))
    seen(text)
    assert "kinetostatics of 7 designs at 5 instants" in text
    assert "design" in text.split("PEAK FORCES")[1]
    one = str(mbody.kinetostatics(system))
    assert "of 7 designs at one instant" in one
    # torque grows with the inertia of a crank that slows down: 0.1 … 1.0 lbf·in·s² by -40 rad/s²
    least, greatest = (float(cell) for cell in rows(one, "TORQUES")["T12"][1:3])
    assert greatest - least == pytest.approx(40.0 * 0.9, abs=1e-2)


# -- tables and files -------------------------------------------------------------------------


def test_columns_have_names_and_units(norton):
    table = norton.columns()
    names = list(table)
    assert names[:5] == [
        "t [s]",
        "crank.x [in]",
        "crank.y [in]",
        "crank.angle [rad]",
        "crank.vx [in/s]",
    ]
    assert names[9] == "crank.alpha [rad/s²]"
    assert names[28] == "crank.A.x [in]"
    pin = ["fx [lbf]", "fy [lbf]", "force [lbf]", "torque [lbf·in]", "angle [rad]", "rate [rad/s]"]
    assert names[46:52] == [f"O2.{one}" for one in pin]
    motor = ["effort [lbf·in]", "power [lbf·in/s]", "value [rad]", "rate [rad/s]"]
    assert names[70:75] == [f"motor.{one}" for one in (*motor, "acceleration [rad/s²]")]
    assert names[75:80] == [f"F_P.{one}" for one in pin[:4]] + ["T_4.torque [lbf·in]"]
    assert names[80:] == ["F12 [lbf]", "T12 [lbf·in]"]
    assert np.array_equal(table["motor.rate [rad/s]"], table["crank.omega [rad/s]"])
    assert table["A.fx [lbf]"][0] == norton.reaction("A").fx[0]
    # time, bodies, points, coordinates of pins, the driver, loads; without forces of joints
    assert len(mbody.kinematics(build()).columns()) == 1 + 27 + 3 * 6 + 4 * 2 + 3 + 5


def test_a_file_brings_back_every_bit(turn, tmp_path):
    path = tmp_path / "turn.csv"
    turn.to_csv(path)
    with path.open(encoding="utf-8", newline="") as file:
        header, *lines = csv.reader(file)
    wanted = turn.columns()
    assert header == list(wanted)
    found = np.array([[float(cell) for cell in line] for line in lines])
    assert np.array_equal(found, np.column_stack(list(wanted.values())))


def test_a_frame(turn):
    pandas = pytest.importorskip("pandas")
    frame = turn.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert frame.shape == (361, 82)
    assert np.array_equal(frame["motor.effort [lbf·in]"], turn.effort("motor"))
