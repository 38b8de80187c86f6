"""Equations in symbols with numbers: against differences, the matrix of forces, and as printed."""

import functools
import math
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody.laws import ConstantAcceleration, Harmonic
from mbody.teaching import derivation
from mbody.teaching.vector_loops import conditions, edges, vector_loops
from tests.support.cases import first_fast

#: Of numbers of six digits, in a sum of terms that cancel.
DIGITS = 2e-5


@functools.cache
def driven(name):
    """A gallery model at its own instants, where it is driven; else its free motion."""
    machine = mbody.gallery.load(name)
    if machine.simulation is not None:
        return mbody.simulate(machine, 0.05, instants=3)
    return mbody.kinetostatics(machine)


def accelerated_wheels():
    """A planet on an arm that speeds up, its ring fixed."""
    machine = mbody.Mechanism("train")
    machine.add(
        mbody.Body("arm", mass=1.0, inertia=1.0, points={"P": (3.0, 0.0)}),
        mbody.Body("planet", mass=1.0, inertia=1.0),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Revolute("P", "arm.P", "planet"),
        mbody.Gear("ring", "ground", "planet", radius_i=4.0, radius_j=1.0, internal=True),
        mbody.AngleDriver("motor", "arm", ConstantAcceleration(0.3, 1.5, 2.0)),
    )
    return machine


def rolling_disc():
    """A wheel on an inclined road, pushed along."""
    machine = mbody.Mechanism("disc")
    machine.add(
        mbody.Body("wheel", mass=1.0, inertia=1.0, guess=(1.0, 2.0, 0.0)),
        mbody.Rolling("road", mbody.Marker("ground", (0.0, 0.0), angle=0.3), "wheel", radius=0.5),
        mbody.AngleDriver("motor", "wheel", ConstantAcceleration(0.0, 1.5, 2.0)),
    )
    return machine


def on_a_drum():
    """A roller that an arm carries round a drum that turns."""
    machine = mbody.Mechanism("drum")
    machine.add(
        mbody.Body("drum", mass=1.0, inertia=1.0),
        mbody.Body("roller", mass=1.0, inertia=1.0, guess=(3.0, 0.0, 0.0)),
        mbody.Revolute("O", "ground", "drum"),
        mbody.Rolling("contact", "drum", "roller", radius=1.0, on_radius=2.0),
        mbody.AngleDriver("motor", "drum", ConstantAcceleration(0.0, 1.5, 2.0)),
        mbody.AngleDriver("second", "roller", ConstantAcceleration(0.0, -2.0, 1.0)),
    )
    return machine


def rack():
    """A rack that a pinion moves, and a screw that the rack drives."""
    machine = mbody.Mechanism("rack", ground={"O": (0.0, 0.5), "S": (3.0, 0.0), "G": (0.0, 0.0)})
    machine.add(
        mbody.Body("pinion", mass=1.0, inertia=1.0),
        mbody.Body("bar", mass=1.0, inertia=1.0),
        mbody.Body("screw", mass=1.0, inertia=1.0),
        mbody.Revolute("O", "ground.O", "pinion"),
        mbody.Revolute("S", "ground.S", "screw"),
        mbody.Prismatic("guide", "ground.G", "bar"),
        mbody.RackPinion("mesh", "bar", "pinion", radius=0.5),
        mbody.LengthCoupling(
            "thread",
            [
                mbody.CouplingTerm(1.0, coordinate=("ground.G", "bar")),
                mbody.CouplingTerm(0.2, angle="screw"),
            ],
        ),
        mbody.AngleDriver("motor", "pinion", ConstantAcceleration(0.2, 1.5, 2.0)),
    )
    return machine


def lift():
    """A boom that a cylinder of changing length raises."""
    machine, law = mbody.Mechanism("lift"), Harmonic(mean=1.2, amplitude=0.1, frequency=3.0)
    machine.add(
        mbody.Body("boom", mass=2.0, inertia=1.0, points={"P": (1.0, 0.1)}, guess=(0.0, 0.0, 0.5)),
        mbody.Revolute("O", "ground", "boom"),
        mbody.DistanceDriver("cylinder", mbody.Marker("ground", (0.3, -0.8)), "boom.P", law),
    )
    return machine


OWN = {make.__name__: make for make in (accelerated_wheels, rolling_disc, on_a_drum, rack, lift)}
#: Units of length and time of a formula of t, so that one machine has a cylinder that moves.
GALLERY = [name for name in mbody.gallery.names() if name not in ("n_windows_40", "bouncing_ball")]


# -- residuals ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", GALLERY)
def test_gallery_models_close_and_balance(name):
    run = driven(name)
    for k in sorted({0, len(run) // 3, len(run) - 1}):
        found = derivation(run, k)
        assert found.gap <= 1e-9 and found.residual <= 1e-9, k


@pytest.mark.parametrize("name", sorted(OWN))
def test_wheels_racks_and_cylinders_close_and_balance(name):
    run = mbody.kinetostatics(OWN[name](), [0.0, 0.3, 0.7])
    for k in range(3):
        found = derivation(run, k)
        assert found.gap <= 1e-9 and found.residual <= 1e-9
        rates = [row for one in found.conditions for row in one.equations]
        # no equation holds because all of its terms are zero
        assert all(row.size > 1e-3 for row in rates)
        assert found.loops or rates


@pytest.mark.parametrize("name", GALLERY)
def test_there_are_as_many_loops_as_chains_close(name):
    """Edges less bodies, and one for each part of the mechanism: Euler's number of a graph."""
    run = driven(name)
    part = {name: name for name in ["ground", *(body.name for body in run.mechanism.bodies)]}

    def root(body):
        return body if part[body] == body else root(part[body])

    joints = edges(run)
    for joint in joints:
        i, j = map(root, joint.bodies)
        part[i] = j
    parts = {root(body) for body in part}
    assert len(vector_loops(run)) == len(joints) - len(part) + len(parts)


# -- rates are derivatives ------------------------------------------------------------------------


def moving(name):
    if name in OWN:
        return OWN[name](), 0.4
    return mbody.gallery.load(name), 0.013


@pytest.mark.parametrize(
    "name", ["quick_return", "slider_crank", "watt_sixbar", "scissor_lift", *sorted(OWN)]
)
def test_rates_of_vectors_are_differences_of_vectors(name):
    machine, t = moving(name)
    h = 1e-4
    run = mbody.kinematics(machine, [t - h, t, t + h])
    loops = [vector_loops(run, k) for k in range(3)]
    for before, now, after in zip(*loops, strict=True):
        for n, (sign, vector) in enumerate(now.vectors):
            (sign_a, a), (sign_b, b) = before.vectors[n], after.vectors[n]
            assert sign == sign_a == sign_b and a.index == b.index == vector.index
            scale = max(1.0, abs(vector.rate), abs(vector.second))
            length = run.system.length
            for low, mid, high, rate, second, size in (
                (a.r, vector.r, b.r, vector.r_rate, vector.r_second, length * scale),
                (a.angle, vector.angle, b.angle, vector.rate, vector.second, scale),
            ):
                # errors of differences: h² times a third and a fourth derivative; rounding/h²
                assert_allclose((high - low) / (2 * h), rate, atol=1e-3 * size)
                assert_allclose((high - 2 * mid + low) / h**2, second, atol=1e-3 * size)


def test_rates_of_a_planet_by_willis():
    """Ring 4 fixed, planet 1: (0 − ω_arm)/(ω_planet − ω_arm) = 1/4, so ω_planet = −3 ω_arm."""
    run = mbody.kinetostatics(accelerated_wheels(), [0.5])
    (condition,) = conditions(run, 0, 0.0)
    values = {s.text: s.value for row in condition.equations for s in row.symbols}
    omega, alpha = 1.5 + 2.0 * 0.5, 2.0
    assert values["ω(ring)"] == pytest.approx(omega, rel=1e-12)
    assert values["ω3"] == pytest.approx(-3.0 * omega, rel=1e-12)
    assert values["α3"] == pytest.approx(-3.0 * alpha, rel=1e-12)
    assert (values["ρ(ring,1)"], values["ρ(ring,3)"]) == (4.0, -1.0)


# -- the same equations as a matrix ---------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["norton_fourbar", "watt_sixbar", "stephenson_sixbar", "peaucellier", "hoekens"]
)
def test_coefficients_are_those_of_the_matrix(name):
    """`Solution.equations` has them from the Jacobian; here they are signs and arms."""
    run = mbody.kinetostatics(mbody.gallery.load(name))
    system, found = (
        run.equations(1 if len(run) > 1 else 0),
        derivation(run, 1 if len(run) > 1 else 0),
    )
    rows = [row for link in found.links for row in link.equations]
    assert len(rows) == len(system.rows)
    compared = 0
    for n, row in enumerate(rows):
        for m, unknown in enumerate(system.unknowns):
            coefficient = sum(
                term.sign * math.prod(f.value for f in term.factors if f.symbol.text != unknown)
                for term in row.left
                if unknown in [f.symbol.text for f in term.factors]
            )
            assert coefficient == pytest.approx(
                system.matrix[n, m], rel=1e-9, abs=1e-11 * run.system.length
            )
            compared += coefficient != 0.0
    assert compared >= 2 * len(system.unknowns) - 2
    values = {s.text: s.value for row in rows for s in row.symbols}
    peak = np.abs(system.values).max()
    for name, value in zip(system.unknowns, system.values, strict=True):
        assert values[name] == pytest.approx(value, rel=1e-9, abs=1e-8 * peak)


# -- what is printed ------------------------------------------------------------------------------


def evaluated(side):
    """The number of one side of a printed equation of numbers, and that of its greatest term."""
    python = side.replace("·", "*").replace("²", "**2")
    python = re.sub(r"(sin|cos) \(?(-?[\d.]+)°\)?", r"math.\1(math.radians(\2))", python)
    terms = re.split(r" (?=[-+] )", python)
    values = [eval(term.replace("- ", "-").replace("+ ", ""), {"math": math}) for term in terms]
    return sum(values), max(map(abs, values))


def numeric_lines(text):
    lines = []
    for line in text.splitlines():
        if line.startswith("       ") and lines and lines[-1]:
            lines[-1] += " " + line.strip()
        elif re.match(r"   \S*: ", line):
            lines.append(line.partition(": ")[2].strip())
        else:
            lines.append("")
    return [
        line for line in lines if line and not re.search(r"[A-Zθωαρ]|[rsc]\(|[ra][0-9A-Z]", line)
    ]


@pytest.mark.parametrize(
    "name", ["norton_fourbar", "slider_crank", "quick_return", "scissor_lift", "planetary_train"]
)
def test_printed_numbers_satisfy_the_printed_equations(name):
    run = mbody.kinetostatics(mbody.gallery.load(name))
    lines = numeric_lines(run.derivation())
    found = derivation(run)
    wanted = 3 * len(found.links) + sum(len(one.equations) for one in found.conditions)
    assert len(lines) >= wanted + 2 * len(found.loops)
    for line in lines:
        left, right = (evaluated(side) for side in line.split("="))
        size = max(left[1], right[1])
        assert abs(left[0] - right[0]) <= max(DIGITS * size, 1e-9), line


def braces(text):
    depth = 0
    for sign in re.sub(r"\\[{}]", "", text):
        depth += {"{": 1, "}": -1}.get(sign, 0)
        assert depth >= 0
    return depth


@first_fast("name", ["norton_fourbar", "slider_crank", "vehicle", "cam_follower"], 1)
def test_equations_are_latex(name):
    """Every line is read by the reader of formulas of Matplotlib."""
    mathtext = pytest.importorskip("matplotlib.mathtext")
    parser = mathtext.MathTextParser("path")
    found = derivation(driven(name))
    rows = [row for one in found.loops for row in one.every]
    rows += [row for one in (*found.conditions, *found.links) for row in one.equations]
    assert rows
    for row in rows:
        for numbers in (False, True):
            for _, latex in row.line(numbers):
                parser.parse(f"${latex}$")
    whole = found.latex()
    assert braces(whole) == 0 and whole.count(r"\begin{align*}") == whole.count(r"\end{align*}") > 0
    # no command runs into the letters after it
    commands = set(
        re.findall(r"\\(quad|qquad|cdot|theta|omega|alpha|Sigma|varphi)(?=[A-Za-z])", whole)
    )
    assert not commands


def test_all_forms_have_all_equations():
    run = mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    found = derivation(run)
    text, markdown, latex = found.text(), found.markdown(), found.latex()
    assert "-F32x + F43x" in text and max(map(len, text.splitlines())) <= 100
    for form in (markdown, latex):
        assert "-F_{32x} + F_{43x}" in form
        assert r"r_{O2A}\,e^{\mathrm{i}\,\theta_{O2A}}" in form
    assert markdown.count("$$") % 2 == 0
    assert str(found) == text == run.derivation()
    assert run.derivation("latex") == latex


# -- the command ---------------------------------------------------------------------------------


def test_what_is_driven_has_its_word():
    """A slide has a displacement, a cylinder a distance, a motor on a link an angle from it."""
    machine = mbody.Mechanism("table", ground={"O": (0.0, 0.0), "C": (0.0, -3.0)})
    machine.add(
        mbody.Body("block", mass=1.0, points={"P": (0.0, 0.0)}),
        mbody.Body("arm", mass=1.0, inertia=1.0, guess=0.0),
        mbody.Body("jib", mass=1.0, inertia=1.0, points={"P": (4.0, 0.0)}, guess=0.0),
        mbody.Prismatic("guide", "ground.O", "block"),
        mbody.Revolute("pin", "block.P", "arm"),
        mbody.Revolute("O", "ground.O", "jib"),
        mbody.CoordinateDriver("screw", "ground.O", "block", "1 m + 0.5 m/s*t"),
        mbody.AngleDriver("motor", "arm", 0.5, relative_to="block"),
        mbody.DistanceDriver("cylinder", "ground.C", "jib.P", "5 m"),
    )
    text = str(derivation(mbody.kinetostatics(machine)))
    given = text[text.index("GIVEN MOTION") : text.index("LOOP 1")]
    assert "screw      displacement of block" in given
    assert "motor      angle of arm from block" in given
    assert "cylinder   distance of jib.P from ground.C" in given


def test_the_friction_of_a_pin_and_a_motor_between_the_same_links_are_told_apart():
    """Both are torques of the ground on the crank: each has a symbol and a value of its own."""
    run = mbody.kinetostatics(mbody.gallery.load("toggle_press"))
    found = derivation(run)
    crank = next(link for link in found.links if link.body == "upper")
    torques = {s.text: s.value for row in crank.equations for s in row.symbols if s.letter == "T"}
    assert torques["T12"] == pytest.approx(float(run.effort("knee")[0]), rel=1e-12)
    assert torques["T12O"] == pytest.approx(float(run.reaction("O").torque[0]), rel=1e-12)
    text = str(found)
    assert "on upper by O, torque" in text and "on upper by knee, torque" in text
