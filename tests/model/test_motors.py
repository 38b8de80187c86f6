"""Motors and actuators against closed solutions, and against the same equations by SciPy."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbody
from mbody import gallery
from mbody.solution.measures import measured

pytestmark = pytest.mark.processor

R, L, K, U = 0.5, 2e-3, 0.1, 24.0  # ohm, H, N·m/A, V
J = 0.02  # kg·m²


def wheel(*loads, inertia=J, **how):
    machine = mbody.Mechanism("a wheel", **how)
    machine.add(
        mbody.Body("wheel", mass=1.0, inertia=inertia), mbody.Revolute("O", "ground", "wheel")
    )
    machine.add(*loads)
    return machine


def motor(voltage="24 V", **more):
    numbers = {"resistance": R, "inductance": L, "constant": K} | more
    return mbody.DCMotor("motor", "wheel", voltage=voltage, **numbers)


def history(run, text):
    return measured(run, text)[0]


# -- DC motor -------------------------------------------------------------------------------------


def exact(t, ratio=1.0, drag=0.0, start=0.0):
    """(i, ω) of a DC motor on a wheel, by the eigenvalues of its two equations."""
    matrix = np.array([[-R / L, -K * ratio / L], [K * ratio / J, -drag / J]])
    steady = -np.linalg.solve(matrix, [U / L, 0.0])
    roots, vectors = np.linalg.eig(matrix)
    part = np.linalg.solve(vectors, np.array([start, 0.0]) - steady)
    return steady[:, None] + (vectors @ (part[:, None] * np.exp(np.outer(roots, t)))).real


@pytest.mark.parametrize(
    ("ratio", "drag", "start"), [(1.0, 0.0, 0.0), (4.0, 0.03, 0.0), (-2.0, 0.01, 7.0)]
)
def test_a_dc_motor_runs_up_as_its_two_linear_equations(ratio, drag, start):
    loads = [motor(ratio=ratio, start=start)]
    if drag:
        loads.append(mbody.TorsionDamper("drag", "wheel", coefficient=drag))
    # three electric time constants: the tolerance decides the steps
    run = mbody.simulate(wheel(*loads), 0.012, rtol=1e-12)
    current, rate = exact(run.t[-1:], ratio, drag, start)
    assert history(run, "motor.current")[-1] == pytest.approx(current[-1], abs=1e-10)
    assert run["wheel"].omega[-1] == pytest.approx(rate[-1], abs=1e-11)
    # 175 of them: the electric time constant limits steps to the edge of stability, where what is
    # left of a rounding depends on the processor; SciPy's DOP853 ends up to 1.3e-9 A off here, ours
    # up to 1.2e-8 A in 72 trials with other tolerances and instructions. Between the ends of steps
    # the interpolation of order 7 is coarser.
    run = mbody.simulate(wheel(*loads), 0.7, rtol=1e-12, instants=15)
    current, rate = exact(run.t, ratio, drag, start)
    assert history(run, "motor.current")[-1] == pytest.approx(current[-1], abs=2e-7)
    assert run["wheel"].omega[-1] == pytest.approx(rate[-1], abs=1e-8)
    np.testing.assert_allclose(history(run, "motor.current"), current, atol=2e-5)
    np.testing.assert_allclose(run["wheel"].omega, rate, atol=1e-6)
    np.testing.assert_allclose(history(run, "motor.torque"), ratio * K * current, atol=1e-5)


def test_energy_of_a_dc_motor_is_accounted():
    """∫ u i dt, ∫ R i² dt and ½ L i² by the closed solution, each by a quadrature of its own."""
    run = mbody.simulate(wheel(motor()), 0.7, rtol=1e-10, instants=15)
    energy = run.energy
    assert energy.error < 1e-8
    t = np.linspace(0.0, 0.7, 200_001)
    current, rate = exact(t)
    supplied = U * np.trapezoid(current, t)
    lost = R * np.trapezoid(current**2, t)
    by = {name: part[-1] for name, part in energy.by.items()}
    # the trapezoidal rule errs by h² / 12 of the jumps of the slope, 1e-10 of them
    assert by["motor.supplied"] == pytest.approx(supplied, rel=1e-7)
    assert by["motor.lost"] == pytest.approx(-lost, rel=1e-7)
    assert by["motor.field"] == pytest.approx(-0.5 * L * current[-1] ** 2, rel=1e-7)
    assert by["motor"] == pytest.approx(0.5 * J * rate[-1] ** 2, rel=1e-8)
    assert energy.work[-1] == by["motor.supplied"]
    assert energy.dissipated[-1] == -by["motor.lost"]
    assert energy.potential[-1] == -by["motor.field"]


def test_a_current_controller_reads_its_own_motor():
    """u = k (i* − i): the electric equation alone, with R + k instead of R, on a wheel that is
    nearly fixed.
    """
    machine = mbody.Mechanism("fixed")
    machine.add(mbody.Input("target", "5 A"))
    machine.add(mbody.Body("wheel", mass=1.0, inertia=1e9), mbody.Revolute("O", "ground", "wheel"))
    machine.add(motor("2 ohm*(target - motor.current)"))
    run = mbody.simulate(machine, 0.01, rtol=1e-11, instants=11)
    steady = 2.0 * 5.0 / (R + 2.0)
    expected = steady * (1.0 - np.exp(-run.t * (R + 2.0) / L))
    np.testing.assert_allclose(history(run, "motor.current"), expected, atol=1e-7)


def test_numbers_of_a_motor_change_in_lanes():
    """Motions of five designs on lanes, against each by itself."""
    values = [0.4, 0.45, 0.5, 0.6, 0.7]
    measures = ["last(motor.current)", "last(wheel.omega)"]
    machine = wheel(motor("24 V - 0.01 V*s/rad*wheel.omega"))
    found = mbody.sweep(
        machine, {"motor.resistance": values}, analysis="simulate", until=0.2, measure=measures
    )
    for n, value in enumerate(values):
        one = mbody.assemble(machine).with_values({"motor.resistance": value})
        run = mbody.simulate(one, 0.2, instants=201)
        assert found["last(motor.current)"][n] == pytest.approx(history(run, "motor.current")[-1])
        assert found["last(wheel.omega)"][n] == pytest.approx(run["wheel"].omega[-1])


# -- induction motor ------------------------------------------------------------------------------

BREAKDOWN, SLIP, FIELD = 60.0, 0.2, 1500.0 * math.pi / 30.0


def fan(**more):
    numbers = {"breakdown_torque": BREAKDOWN, "breakdown_slip": SLIP, "synchronous": FIELD}
    return wheel(mbody.InductionMotor("motor", "wheel", **numbers | more), inertia=0.5)


def run_up_time(slip):
    """∫ J dω / T from standstill: J ω_s/(2 T_b s_b) · ((1 − s²)/2 − s_b² ln s)."""
    unit = 0.5 * FIELD / (2.0 * BREAKDOWN * SLIP)
    return unit * (0.5 * (1.0 - slip**2) - SLIP**2 * np.log(slip))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_induction_motor_runs_up_by_kloss(sign):
    run = mbody.simulate(fan(synchronous=sign * FIELD), 1.4, rtol=1e-10, instants=29)
    slip = 1.0 - sign * run["wheel"].omega / FIELD
    np.testing.assert_allclose(run_up_time(slip), run.t, atol=1e-8)
    np.testing.assert_allclose(history(run, "motor.slip"), slip, rtol=1e-12)
    first = 2.0 * BREAKDOWN * SLIP / (1.0 + SLIP**2)
    assert run.load("motor").torque[0] == pytest.approx(sign * first, rel=1e-14)
    assert run.energy.error < 1e-8


def test_star_delta_by_time_and_by_speed():
    """In star the same run-up takes three times as long."""
    run = mbody.simulate(fan(star_until="1 s"), 2.0, rtol=1e-11, instants=41)
    found = run_up_time(1.0 - run["wheel"].omega / FIELD)
    expected = np.where(run.t < 1.0, run.t / 3.0, run.t - 2.0 / 3.0)
    np.testing.assert_allclose(found, expected, atol=1e-7)
    change = 400.0 * math.pi / 30.0
    run = mbody.simulate(fan(star_below="400 rpm"), 3.0, rtol=1e-11, instants=41)
    found, until = run_up_time(1.0 - run["wheel"].omega / FIELD), run_up_time(1.0 - change / FIELD)
    expected = np.where(run.t < 3.0 * until, run.t / 3.0, run.t - 2.0 * until)
    np.testing.assert_allclose(found, expected, atol=1e-7)
    assert run["wheel"].omega[-1] > change


def test_the_starting_current_follows_the_same_circuit():
    """I = I_max/√(1 + (s_b/s)²), scaled at standstill; a third of it in star."""
    run = mbody.simulate(fan(starting_current="50 A", star_until="0.5 s"), 1.5, instants=16)
    slip = history(run, "motor.slip")
    whole = 50.0 * np.sqrt((1.0 + SLIP**2) / (1.0 + (SLIP / slip) ** 2))
    expected = np.where(run.t < 0.5, whole / 3.0, whole)
    np.testing.assert_allclose(history(run, "motor.current"), expected, rtol=1e-12)


# -- actuators ------------------------------------------------------------------------------------


def slide(actuator, *more, mass=2.0):
    machine = mbody.Mechanism("a slide", ground={"O": (-1.0, 0.0)})
    machine.add(
        *more, mbody.Body("slide", mass=mass), mbody.Prismatic("guide", "ground", "slide"), actuator
    )
    return machine


def test_saturation_and_dead_band_of_an_actuator():
    """Ramp of 10 N/s, dead band 1 N, limit 3 N: silent to 0.1 s, full from 0.4 s on."""
    drive = mbody.Actuator("drive", "ground.O", "slide", "10 N/s*t", dead_band=1.0, limit=3.0)
    run = mbody.simulate(slide(drive), 0.6, rtol=1e-10, instants=13)
    force = np.clip(10.0 * run.t - 1.0, 0.0, 3.0)
    np.testing.assert_allclose(-run.load("drive").force, force, atol=1e-9)
    np.testing.assert_allclose(run["slide"].ax, 0.5 * force, atol=1e-9)
    rate = np.where(
        run.t < 0.1,
        0.0,
        np.where(run.t < 0.4, 2.5 * (run.t - 0.1) ** 2, 0.225 + 1.5 * (run.t - 0.4)),
    )
    np.testing.assert_allclose(run["slide"].vx, rate, atol=1e-8)


def test_the_rate_limit_of_an_actuator():
    """A step of 3 N with slew 10 N/s and lag T = 0.02 s: 10 t until the rest is 10 T = 0.2 N, then
    it decays.
    """
    drive = mbody.Actuator("drive", "ground.O", "slide", 3.0, lag="20 ms", slew="10 N/s")
    run = mbody.simulate(slide(drive), 0.5, rtol=1e-11, instants=26)
    applied, change = history(run, "drive.applied"), 0.28
    expected = np.where(run.t < change, 10.0 * run.t, 3.0 - 0.2 * np.exp(-(run.t - change) / 0.02))
    np.testing.assert_allclose(applied, expected, atol=1e-7)
    np.testing.assert_allclose(-run.load("drive").force, applied, atol=1e-12)


OIL = {
    "bore": 0.05, "rod": 0.028, "closed": 0.4, "stroke": 0.5, "flow": 40e-3 / 60.0, "drop": 5e5,
    "supply": 160e5, "bulk_modulus": 1.4e9, "dead_volume": 50e-6, "relief": 150e5,
    "start_a": 20e5, "start_b": 30e5,
}  # fmt: skip


def test_a_hydraulic_cylinder_is_its_equations():
    """Flows through orifices, oil that gives, relief valves: the same equations by SciPy's Radau,
    written down here once more.
    """
    lift = mbody.HydraulicCylinder("lift", "ground.A", "slide", valve="0.5*sin(6 rad/s*t)", **OIL)
    machine = mbody.Mechanism("a press", ground={"A": (-0.5, 0.0)})
    machine.add(mbody.Body("slide", mass=200.0), mbody.Prismatic("guide", "ground", "slide"), lift)
    run = mbody.simulate(machine, 0.5, rtol=1e-9, instants=6)
    area_a, area_b = math.pi / 4.0 * 0.05**2, math.pi / 4.0 * (0.05**2 - 0.028**2)

    def orifice(first, second):
        part = (first - second) / 5e5
        return OIL["flow"] * part / (part**2 + 1e-6) ** 0.25

    def relieved(p):
        return OIL["flow"] * 10.0 * max(p - 150e5, 0.0) / 150e5

    def rates(t, y):
        x, v, a, b = y
        u = 0.5 * math.sin(6.0 * t)
        if u > 0.0:
            into_a, into_b = u * orifice(160e5, a), -u * orifice(b, 0.0)
        else:
            into_a, into_b = u * orifice(a, 0.0), -u * orifice(160e5, b)
        stroke = x + 0.1
        stiff_a = 1.4e9 / (50e-6 + area_a * stroke)
        stiff_b = 1.4e9 / (50e-6 + area_b * (0.5 - stroke))
        return (
            v,
            (a * area_a - b * area_b) / 200.0,
            stiff_a * (into_a - area_a * v - relieved(a)),
            stiff_b * (into_b + area_b * v - relieved(b)),
        )

    theirs = solve_ivp(
        rates, (0.0, 0.5), (0.0, 0.0, 20e5, 30e5), method="DOP853", rtol=1e-11,
        atol=(1e-12, 1e-12, 1e-3, 1e-3), t_eval=run.t,
    ).y  # fmt: skip
    np.testing.assert_allclose(run["slide"].x, theirs[0], atol=1e-8)
    np.testing.assert_allclose(run["slide"].vx, theirs[1], atol=1e-6)
    for row, chamber in ((2, "a"), (3, "b")):
        found = history(run, f"lift.pressure_{chamber}")
        np.testing.assert_allclose(found, theirs[row], atol=100.0)  # Pa, of 160e5


# -- the gallery ----------------------------------------------------------------------------------

INCH, POUND = 0.0254, 0.45359237


def pump_rates(t, y):
    """The mud pump as one equation for the angle of its crank, and one for the current:
    J φ̈ + ½ J′ φ̇² = Q, with the linkage written down by hand; J′ by a complex step.
    """
    phi, omega, current = y
    r, length, n = 6.0 * INCH, 18.0 * INCH, 17.0
    rod, ram = 330.0 * POUND, 260.0 * POUND

    def linkage(angle):
        """Place and slope by the angle of a ram and of a rod's mass centre, and the rod's turn."""
        s, c = np.sin(angle), np.cos(angle)
        cosine = np.sqrt(1.0 - (r * s / length) ** 2)
        turn = -r * c / (length * cosine)  # sin β = −r sin φ/l
        slide = -r * s - r * s * r * c / (length * cosine)
        centre = 2.0 / 3.0 * -r * s + slide / 3.0, 2.0 / 3.0 * r * c
        return slide, centre, turn

    def inertia(angle):
        whole = 100.0 + 45.0 * n**2
        for behind in (0.0, -0.5 * math.pi):
            slide, (gx, gy), turn = linkage(angle + behind)
            whole = whole + ram * slide**2 + rod * (gx**2 + gy**2) + 4.5 * turn**2
        return whole

    line = np.clip((t - 6.0) / 4.0, 0.0, 1.0) * 150e5
    mid = (math.pi / 4.0 * 6.5**2 - math.pi / 8.0 * 2.5**2) * INCH**2
    half = math.pi / 8.0 * 2.5**2 * INCH**2
    push = -500.0 * omega - n * 6.8 * current
    for behind in (0.0, -0.5 * math.pi):
        slide, (_, gy), _ = linkage(phi + behind)
        v = slide * omega
        push += -line * (half + mid * v / math.hypot(v, 0.02)) * slide - rod * 9.80665 * gy
    slope = inertia(phi + 1e-30j).imag / 1e-30
    volts = min(750.0 * t / 8.0, 750.0)
    rate = (volts - 0.035 * current + 6.8 * n * omega) / 1e-3
    return omega, (push - 0.5 * slope * omega**2) / inertia(phi).real, rate


def test_the_pump_runs_up_as_one_equation():
    """From standstill over the closing of the bypass, by SciPy on its two equations."""
    run = mbody.simulate(gallery.load("mud_pump_motor"), 12.0, rtol=1e-11, instants=7)
    y, theirs = np.array([0.5 * math.pi, 0.0, 0.0]), []
    for first, last in itertools.pairwise(run.t):  # corners of the voltage and the line
        corners = [first, *(t for t in (6.0, 8.0, 10.0) if first < t < last), last]
        for a, b in itertools.pairwise(corners):
            y = solve_ivp(pump_rates, (a, b), y, method="DOP853", rtol=1e-11, atol=1e-9).y[:, -1]
        theirs.append(y)
    angle, omega, current = np.transpose(theirs)
    np.testing.assert_allclose(run["crank"].angle[1:], angle, rtol=1e-7)
    np.testing.assert_allclose(run["crank"].omega[1:], omega, rtol=1e-6)
    np.testing.assert_allclose(history(run, "motor.current")[1:], current, rtol=1e-5)
    assert run.energy.error < 1e-8


def test_the_cart_holds_its_pole_as_in_the_paper():
    """Florian's equations without friction, angles from the vertical, positive to the right."""

    def rates(t, y):
        x, v, theta, w = y
        force = 2.44077 * x + 4.62939 * v + 41.5077 * theta + 10.46626 * w
        force = min(max(force, -10.0), 10.0)
        part = (-force - 0.1 * 0.5 * w**2 * math.sin(theta)) / 1.1
        bend = (9.81 * math.sin(theta) + math.cos(theta) * part) / (
            0.5 * (4.0 / 3.0 - 0.1 * math.cos(theta) ** 2 / 1.1)
        )
        return (
            v,
            (force + 0.05 * (w**2 * math.sin(theta) - bend * math.cos(theta))) / 1.1,
            w,
            bend,
        )

    run = mbody.simulate(gallery.load("cart_pole"), 4.0, rtol=1e-11, instants=9)
    start = (0.0, 0.0, -math.radians(12.0), 0.0)
    theirs = solve_ivp(
        rates, (0.0, 4.0), start, method="DOP853", rtol=1e-11, atol=1e-12, t_eval=run.t
    ).y
    np.testing.assert_allclose(run["cart"].x, theirs[0], atol=1e-7)
    np.testing.assert_allclose(-run["pole"].angle, theirs[2], atol=1e-7)
