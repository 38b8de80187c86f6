"""The system of force equations: Norton's eq. 11.9 by hand, and what it is for every joint."""

import math
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody.engines.oracle import Reference
from mbody.laws import ConstantSpeed, Harmonic
from mbody.model.joints import CustomJoint
from mbody.summaries.equations import equations, system_of_equations
from mbody.summaries.text_table import WIDTH
from tests.support.linkages import random_linkage
from validation.grubler_paradox import build as three_cranks
from validation.norton_fourbar import build

NORTON = ("F12x", "F12y", "F32x", "F32y", "F43x", "F43y", "F14x", "F14y", "T12")


def seen(text):
    """What holds of every summary."""
    assert all(len(line) <= WIDTH for line in text.splitlines()), max(text.splitlines(), key=len)
    assert all(line == line.rstrip() for line in text.splitlines())
    assert "nan" not in text and "\N{NO-BREAK SPACE}" not in text
    assert not re.search(r"(?<![\d.])-0(\.0*)?(?![\d.e])", text), text


def solved(system, run, k=0):
    """The values solve the equations, and are the reactions and efforts of the solution."""
    size = np.abs(system.values).max()
    assert np.abs(system.residual).max() < 1e-10 * size
    assert len(set(system.unknowns)) == len(system.unknowns)
    if system.matrix.shape[0] == system.matrix.shape[1] == system.rank:
        assert_allclose(
            np.linalg.solve(system.matrix, system.rhs), system.values, atol=1e-10 * size
        )
    found = dict(zip(system.unknowns, system.values, strict=True))
    for joint in run.mechanism.joints:
        name, on = mbody.summaries.text_table.force_names(run.mechanism)[joint.name]
        reaction = run.reaction(joint.name, on)
        if isinstance(joint, mbody.Revolute | mbody.Fixed) and "," not in name:
            pair = found[f"{name}x"], found[f"{name}y"]
            assert_allclose(pair, (reaction.fx[k], reaction.fy[k]), atol=1e-10 * size)
    return found


def columns_by_oracle(run, system, k=0):
    """Every column lies in the space that the oracle's −Φ_qᵀ of its element spans."""
    oracle = Reference(run.mechanism)
    n3 = run.system.coordinates
    q = run.record.table(slice(0, n3))[k]
    G = oracle.phi_q(q, float(run.t[k]))
    first = 0
    for element in oracle.elements:
        rows = G[oracle.rows[element.name]]
        own = system.matrix[:, first : first + len(rows)]
        mix = np.linalg.lstsq(rows.T, own, rcond=None)[0]
        assert_allclose(rows.T @ mix, own, atol=1e-10)
        assert abs(np.linalg.det(mix)) > 1e-9
        first += len(rows)
    assert first == len(system.unknowns)


# -- Norton, eq. 11.9 -------------------------------------------------------------------------


def by_hand(masses):
    """The nine equations with numbers, from the given geometry; R12 is the place of the joint of
    links 1 and 2 from the mass centre of link 2. Angles of coupler and rocker close the loop.
    """
    a, b, c, d = 5.0, 15.0, 10.0, 19.0
    t2, w2, p2 = math.radians(60.0), 25.0, -40.0
    turn = lambda r, t: np.array([r * math.cos(t), r * math.sin(t)])  # noqa: E731
    A, O4 = turn(a, t2), np.array([d, 0.0])
    toward = O4 - A
    far = math.hypot(*toward)
    lift = math.acos((b * b + far * far - c * c) / (2.0 * b * far))
    t3 = math.atan2(toward[1], toward[0]) + lift
    B = A + turn(b, t3)
    t4 = math.atan2(*(B - O4)[::-1])
    # rates: ω × r of crank and coupler is that of the rocker at B
    k = lambda r: np.array([-r[1], r[0]])  # noqa: E731
    M = np.column_stack([k(B - A), -k(B - O4)])
    w3, w4 = np.linalg.solve(M, -w2 * k(A))
    p3, p4 = np.linalg.solve(M, -p2 * k(A) + w2**2 * A + w3**2 * (B - A) - w4**2 * (B - O4))
    G2, G4 = turn(3.0, t2 + math.radians(30.0)), O4 + turn(5.0, t4)
    G3 = A + turn(9.0, t3 + math.radians(45.0))
    a2 = p2 * k(G2) - w2**2 * G2
    a3 = p2 * k(A) - w2**2 * A + p3 * k(G3 - A) - w3**2 * (G3 - A)
    a4 = p4 * k(G4 - O4) - w4**2 * (G4 - O4)
    R12, R32, R23, R43, R34, R14 = -G2, A - G2, A - G3, B - G3, B - G4, O4 - G4
    RP, FP, T4 = turn(3.0, t3 + math.radians(100.0)), turn(80.0, math.radians(330.0)), 120.0
    m2, m3, m4 = masses
    I2, I3, I4 = 0.4, 1.5, 0.8
    matrix = [
        [1, 0, 1, 0, 0, 0, 0, 0, 0],
        [0, 1, 0, 1, 0, 0, 0, 0, 0],
        [-R12[1], R12[0], -R32[1], R32[0], 0, 0, 0, 0, 1],
        [0, 0, -1, 0, 1, 0, 0, 0, 0],
        [0, 0, 0, -1, 0, 1, 0, 0, 0],
        [0, 0, R23[1], -R23[0], -R43[1], R43[0], 0, 0, 0],
        [0, 0, 0, 0, -1, 0, 1, 0, 0],
        [0, 0, 0, 0, 0, -1, 0, 1, 0],
        [0, 0, 0, 0, R34[1], -R34[0], -R14[1], R14[0], 0],
    ]
    rhs = [
        *(m2 * a2),
        I2 * p2,
        *(m3 * a3 - FP),
        I3 * p3 - RP[0] * FP[1] + RP[1] * FP[0],
        *(m4 * a4),
        I4 * p4 - T4,
    ]
    return np.array(matrix), np.array(rhs)


@pytest.mark.parametrize(
    ("masses", "numbers"),
    [("printed", (0.004, 0.020, 0.015)), ("exact", (1.5 / 386, 7.7 / 386, 5.8 / 386))],
)
def test_nortons_nine_equations(masses, numbers):
    run = mbody.kinetostatics(build(masses))
    system = run.equations()
    matrix, rhs = by_hand(numbers)
    assert system.unknowns == NORTON
    assert system.rows[:4] == ("ΣFx 2 crank", "ΣFy 2 crank", "ΣM 2 crank", "ΣFx 3 coupler")
    assert system.row_units[:3] == ("lbf", "lbf", "lbf·in")
    assert system.units == ("lbf",) * 8 + ("lbf·in",)
    # arms are up to 10 in, forces up to 300 lbf: closed to 1e-13 of them
    assert_allclose(system.matrix, matrix, rtol=0, atol=1e-11)
    assert_allclose(system.rhs, rhs, rtol=0, atol=1e-9)
    assert system.rank == 9
    exact = (matrix == 0.0) | (np.abs(matrix) == 1.0)
    assert (system.matrix[exact] == matrix[exact]).all()
    found = solved(system, run)
    assert found["T12"] == pytest.approx(run.effort("motor")[0], rel=1e-12)


def test_nortons_summary_prints_the_matrix():
    run = mbody.kinetostatics(build("printed"))
    text = equations(run)
    seen(text)
    lines = text.splitlines()
    assert lines[1].startswith("kinetostatics equations at t = 0 s; units in-lbf-s")
    assert lines[3].split() == ["EQUATIONS", *NORTON, "m", "a", "-", "loads"]
    matrix, rhs = by_hand((0.004, 0.020, 0.015))
    for line, row, right in zip(lines[5:14], matrix, rhs, strict=True):
        *cells, equal, last = line.split()[3:]
        shown = [0.0 if cell == "·" else float(cell) for cell in cells]
        assert equal == "="
        assert_allclose(shown, row, rtol=0, atol=5.1e-5)
        assert float(last) == pytest.approx(right, abs=5.1e-4)
    assert "F12x       -117.650   lbf      on crank by ground at O2, along x" in lines
    assert "T12         243.227   lbf·in   on crank by ground, torque of motor" in lines
    assert lines[-1].startswith("RESIDUAL") and "lbf·in at most" in lines[-1]
    assert str(run.equations()) == text


# -- other joints -----------------------------------------------------------------------------


def test_a_slider_crank():
    run = mbody.kinetostatics(mbody.makers.slider_crank(0.1, 0.3, masses=(1, 2, 3), speed=100.0))
    system = run.equations()
    assert system.unknowns == (*NORTON[:6], "N14", "T14", "T12")
    found = solved(system, run)
    columns_by_oracle(run, system)
    # the guide carries across x, on the slider at its mass centre
    wanted = np.zeros((9, 2))
    wanted[7, 0] = wanted[8, 1] = 1.0
    assert_allclose(system.matrix[:, 6:8], wanted, atol=1e-12)
    assert "normal to the guide, along 90.000°" in str(system)
    reaction = run.reaction("guide", on="slider")
    assert found["N14"] == pytest.approx(reaction.fy[0])
    assert found["T14"] == pytest.approx(reaction.torque[0], abs=1e-9)
    seen(str(system))


@pytest.mark.parametrize(("seed", "loops"), [(3, 2), (11, 3)])
def test_random_linkages_with_all_joints(seed, loops):
    machine, _ = random_linkage(seed, loops, sliders=True, extras=True)
    run = mbody.kinetostatics(machine, t=np.array([0.0, 0.01]))
    system = run.equations(1)
    solved(system, run, 1)
    columns_by_oracle(run, system, 1)
    text = str(system)
    seen(text)
    # too wide for a matrix: every equation is a sentence that ends with its right-hand side
    lines = text.split("EQUATIONS\n")[1].split("\nmoments")[0]
    joined = re.sub(r"\n +", " ", lines).splitlines()[1:]
    assert len(joined) == len(system.rows)
    for line, label, row, right in zip(joined, system.rows, system.matrix, system.rhs, strict=True):
        assert line.startswith(label)
        left, last = line[len(label) :].split(" = ")
        left = left.replace("- ", "-").replace("+ ", "+")
        terms = re.findall(r"([+-]?)([0-9.]+(?:e[+-]\d+)?)? ?([FNT]\S*)", left)
        assert sum(1 for x in row if x) == len(terms)
        for sign, size, name in terms:
            value = (-1.0 if sign == "-" else 1.0) * float(size or 1.0)
            n = system.unknowns.index(name)
            assert value == pytest.approx(row[n], rel=5.1e-6), (line, name)
        assert float(last) == pytest.approx(right, rel=1e-3, abs=5e-3)


def rods():
    """A plate on two rods, and a ram between it and the ground; a tool welded on."""
    machine = mbody.Mechanism("plate", ground={"A": (0.0, 0.0), "B": (2.0, 0.0), "C": (0.0, 3.0)})
    plate = mbody.Body(
        "plate", mass=3.0, inertia=1.0, cg=(1.0, 0.2), points={"P": (0, 0), "Q": (2, 0)}
    )
    machine.add(
        plate,
        mbody.Body("tool", mass=1.0, inertia=0.2, points={"tip": (0.5, 0.0)}),
        mbody.Distance("left", "ground.A", "plate.P", length=1.0),
        mbody.Distance("right", "plate.Q", "ground.B", length=1.2),
        mbody.Fixed("weld", plate.at("Q", angle=0.3), "tool.tip"),
        mbody.DistanceDriver("ram", "ground.C", "plate.P", law=Harmonic(2.2, 0.1, 3.0)),
        mbody.Gravity("gravity", y=-10.0),
        mbody.Torque("twist", "tool", value=4.0),
    )
    return machine


def test_rods_a_weld_and_a_ram():
    run = mbody.kinetostatics(rods(), guess={"plate": (0.2, 1.0, 0.1)})
    system = run.equations()
    assert system.unknowns == ("F12,left", "F12,right", "F32x", "F32y", "T32", "F12,ram")
    found = solved(system, run)
    columns_by_oracle(run, system)
    # unit pulls, by hand: on the plate from P towards A, from Q towards B; the ram pushes off C
    places = {name: np.array([run.point(f"plate.{name}").x[0], run.point(f"plate.{name}").y[0]])
              for name in "PQ"}  # fmt: skip
    centre = np.array([run["plate"].x[0], run["plate"].y[0]])
    pulls = {"left": ("P", (0, 0), 1), "right": ("Q", (2, 0), 1), "ram": ("P", (0, 3), -1)}
    for name, (end, anchor, sign) in pulls.items():
        line = np.array(anchor) - places[end]
        u = sign * line / np.hypot(*line)
        arm = places[end] - centre
        wanted = [*u, arm[0] * u[1] - arm[1] * u[0]]
        column = system.matrix[:3, system.unknowns.index(f"F12,{name}")]
        assert_allclose(column, wanted, atol=1e-12)
    for name in ("left", "right"):
        reaction = run.reaction(name)
        assert abs(found[f"F12,{name}"]) == pytest.approx(reaction.magnitude[0])
    assert found["F12,ram"] == pytest.approx(run.effort("ram")[0])
    torque = run.reaction("weld", on="plate").torque[0]
    assert found["T32"] == pytest.approx(torque)
    text = str(system)
    seen(text)
    assert "tension, along" in text and "force of ram, along" in text
    assert "torques about the joint's place on its body j" in text


class OnAxis(CustomJoint):
    """The place on j stays on the x axis of the world, i being the ground."""

    rows = "l"

    def physics(self, i, j, p, t):
        """Φ = y of the place; Φ_q = (0, 1, x from the mass centre)."""
        x, y = j[3] * p[2] - j[4] * p[3], j[4] * p[2] + j[3] * p[3]
        blocks = (0, 0, 0, 0, 0, 0, 0, 1, x, 0, 0, 0)
        return (j[1] + y, 0), blocks, (0, 0), (j[7] ** 2 * y, 0)


def test_a_joint_of_the_users_own_has_multipliers():
    machine = mbody.Mechanism("own", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.makers.bar("crank", 1.0, mass=1.0, guess=0.5),
        mbody.makers.bar("rod", 2.0, mass=2.0, guess=-0.2),
        mbody.Revolute("O", "ground.O", "crank.A"),
        mbody.Revolute("A", "crank.B", "rod.A"),
        OnAxis("slot", "ground", "rod.B"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(0.5, 3.0)),
    )
    run = mbody.kinetostatics(machine)
    system = run.equations()
    assert system.unknowns == (*NORTON[:4], "λ1,slot", "T12")
    assert system.units[4] == "N"
    found = solved(system, run)
    columns_by_oracle(run, system)
    assert found["λ1,slot"] == pytest.approx(-run.reaction("slot", on="rod").fy[0])
    assert "multiplier of row 1 of slot, between ground and rod" in str(system)


def test_redundant_joints_make_more_unknowns_than_equations():
    run = mbody.kinetostatics(three_cranks())
    system = system_of_equations(run)
    assert system.matrix.shape == (12, 13) and system.rank == 12
    solved(system, run)
    text = str(system)
    seen(text)
    note = "12 equations for 13 unknowns, of rank 12: 1 combination of unknowns is left open"
    assert note in text.replace("\n       ", " ") and "least norm" in text


# -- bad input --------------------------------------------------------------------------------


def test_a_change_point_is_said():
    """A parallelogram on the line: forces are limits, and the square matrix is singular there."""
    machine = mbody.makers.four_bar(1, 3, 1, 3, masses=(1, 3, 1.5), start=0.0, speed=2.0)
    run = mbody.kinetostatics(machine, turn=True, instants=9)
    system = run.equations(4)
    assert system.rank == 8 and system.matrix.shape == (9, 9)
    # limits are interpolated to 1e-9 of the forces
    assert np.abs(system.residual).max() < 1e-7 * np.abs(system.values).max()
    assert "singular position; the values are limits" in str(system).replace("\n       ", " ")
    assert "NOTE" not in str(run.equations(1))
