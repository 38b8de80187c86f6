"""Methods of `simulate`: orders, stiffness, long times, restarts, drivers that are released."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

import mbody
from mbody import (
    AngleDriver,
    Body,
    Damper,
    Event,
    Gravity,
    Marker,
    Mechanism,
    Revolute,
    SimulationSettings,
    SolveError,
    Spring,
    Torque,
    gallery,
    simulate,
)
from mbody.analysis.dynamics.integration import Integration
from mbody.engineering import close_loops
from mbody.kernels.runge_kutta import order_5, order_8
from mbody.kernels.step_state import LAST_STEP_ALLOWED, NEXT, TIME, Outputs
from mbody.model.body import Guess
from mbody.model.simulation import EVEN as EVERY_EVEN
from mbody.model.simulation import METHODS as EVERY_METHOD
from mbody.solution.solution import IntegrationSettings
from tests.support.cases import first_fast

G, LENGTH, FIRST = 9.81, 1.0, 2.0
# that for many contacts, of order one, has tests of its own (`test_many_contacts`)
METHODS, EVEN = (tuple(m for m in every if m != "moreau") for every in (EVERY_METHOD, EVERY_EVEN))
STEPS = dict.fromkeys(EVEN, 2e-3)


def step_option(method):
    """The step that a method needs."""
    return {"step": STEPS[method]} if method in STEPS else {}


def pendulum(first=FIRST):
    """A point mass on a massless arm, released at an angle from hanging."""
    machine = Mechanism("pendulum")
    machine.add(
        Body("bob", mass=1.3, cg=(LENGTH, 0.0), guess=first - math.pi / 2),
        Revolute("O", "ground", "bob"),
        Gravity("gravity", y=-G),
    )
    return machine


def swung(t, first=FIRST):
    """θ(t) of the pendulum from hanging: sin(θ/2) = k sn(K − √(g/l) t), k = sin(θ₀/2)."""
    k = math.sin(first / 2)
    sine, *_ = ellipj(ellipk(k * k) - math.sqrt(G / LENGTH) * t, k * k)
    return 2.0 * math.asin(k * sine)


def even_steps(method, count, until, machine):
    """The last angles of a motion in so many steps of one length, whatever its tolerance."""
    system = mbody.assemble(machine)
    start = close_loops(system)
    h = until / count
    if method in EVEN:
        run = simulate(system, until, start=start, method=method, step=h, instants=2)
        return np.array([run[name].angle[-1] for name in run])
    integration = Integration(system, start, IntegrationSettings(method, 0.1, 0.1))
    integration.begin(0.0, *(start_of(system, start)), until)
    tolerances = integration.motion.tolerances.replaced(relative=1e6, absolute=1e6)
    integration.motion.tolerances = tolerances
    none, gained = np.empty(0), np.zeros((1, integration.causes))
    outputs = Outputs(times=none, pages=np.empty((0, integration.rows, 1)), work=gained)
    while integration.state[TIME] < until * (1 - 1e-12):
        integration.state[NEXT], integration.state[LAST_STEP_ALLOWED] = h, 1.0
        integration._advance(until, 1, outputs)
    return integration.y[2 : system.coordinates : 3].copy()


def start_of(system, start):
    parts = [(b.x, b.y, b.angle, b.vx, b.vy, b.omega) for b in (start[name] for name in start)]
    q = np.array([part[:3] for part in parts]).reshape(-1)
    return q, np.array([part[3:] for part in parts]).reshape(-1)


# -- orders -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "order", "counts"),
    [
        ("dop853", 8, (10, 24)),
        ("dopri5", 5, (40, 80)),
        ("generalized-alpha", 2, (400, 800)),
        ("rattle", 2, (400, 800)),
        ("rattle4", 4, (80, 160)),
    ],
)
@pytest.mark.parametrize("closed", [False, True])
def test_the_error_falls_with_the_order_of_the_method(method, order, counts, closed):
    """Half the step leaves 2⁻ᵒʳᵈᵉʳ of the error: on an open chain against elliptic functions, on a
    closed loop against a motion of steps so short that rounding is left. A third of an order and
    more is left for the terms of the next order, whose part at these steps is some tenths.
    """
    if closed:
        machine, until = gallery.load("free_fourbar"), 0.4
        right = last_angles(machine, until, "dop853", 1e-14)
    else:
        machine, until = pendulum(), 1.0
        right = np.array([swung(until) - math.pi / 2])
    errors = [np.abs(even_steps(method, n, until, machine) - right).max() for n in counts]
    assert errors[1] > 1e-13, "rounding: no order can be seen"
    found = math.log(errors[0] / errors[1]) / math.log(counts[1] / counts[0])
    assert found == pytest.approx(order, abs=0.34 + 0.05 * order)


def last_angles(machine, until, method, rtol=1e-13):
    run = simulate(machine, until, start=close_loops(machine), method=method, rtol=rtol, instants=2)
    return np.array([run[name].angle[-1] for name in run])


def test_the_error_of_radau_falls_with_its_order():
    """Its steps follow the tolerance: how the error falls with their number, over two decades."""
    machine, until = gallery.load("free_fourbar"), 0.4
    start, right = close_loops(machine), last_angles(machine, until, "dop853")
    errors, steps = [], []
    for rtol in (1e-6, 1e-9):
        run = simulate(machine, until, start=start, method="radau5", rtol=rtol, instants=2)
        found = np.array([run[name].angle[-1] for name in run])
        errors.append(np.abs(found - right).max())
        steps.append(run.stats["steps"])
    order = math.log(errors[0] / errors[1]) / math.log(steps[1] / steps[0])
    # steps are adapted along the way: they do not shrink alike
    assert order == pytest.approx(5, abs=0.6)


@pytest.mark.parametrize("method", [order_5(), order_8()])
def test_the_tables_meet_the_order_conditions_of_quadrature(method):
    """Σ bᵢ cᵢᵏ⁻¹ = 1/k up to the order: by exact fractions of the right-hand sides."""
    order = int(method.order)
    nodes = method.C[: len(method.B)]
    for k in range(1, order + 1):
        # coefficients have sixteen digits and sizes up to thirty
        assert method.B @ nodes ** (k - 1) == pytest.approx(1.0 / k, abs=3e-14)
    assert abs(method.B @ nodes**order - 1.0 / (order + 1)) > 1e-8  # and not beyond


@pytest.mark.parametrize("method", METHODS)
def test_instants_between_steps_are_as_good_as_the_steps(method):
    """Against elliptic functions at 101 instants: the polynomials lose at most what one order of
    the step is worth.
    """
    run = simulate(pendulum(), 1.0, method=method, instants=101, **step_option(method))
    right = np.array([swung(t) - math.pi / 2 for t in run.t])
    # steps of 1/500 of the time: (ωh)² of the methods of order 2 is 4e-5
    allowed = {"rattle": 4e-5, "generalized-alpha": 8e-5, "rattle4": 1e-8}.get(method, 1e-6)
    assert np.abs(run["bob"].angle - right).max() < allowed


# -- long times -------------------------------------------------------------------------------


@first_fast("method", ["rattle", "rattle4"], 1)
def test_energy_stays_bounded_over_a_million_steps(method):
    """The error of the energy in the last tenth is no greater than in the first: it does not grow;
    by a method that is not symplectic of the same order it would be 1e5 times the first step's.
    """
    steps = 1_000_000 if method == "rattle" else 200_000
    h = 0.02
    run = simulate(pendulum(2.9), steps * h, method=method, step=h, instants=2001)
    energy = run.energy.kinetic - 1.3 * 0.0 + 1.3 * G * run["bob"].y
    error = np.abs(energy - energy[0]) / (1.3 * G * LENGTH)
    first, last = error[:200].max(), error[-200:].max()
    assert 0.0 < first < 0.02
    assert last < 1.2 * first + 1e-9  # sampled at other phases; rounding of so many steps


@pytest.mark.parametrize("method", ["rattle", "rattle4"])
def test_a_motion_comes_back_when_it_is_reversed(method):
    """The steps are their own reverse: with the velocities turned round, 2000 steps lead back to
    rounding, which grows with their number and with how far paths diverge (a free four-bar).
    """
    machine = gallery.load("free_fourbar")
    there = simulate(machine, 1.0, method=method, step=5e-4, instants=2)
    system = there.system
    integration = Integration(system, there, IntegrationSettings(method, 1e-8, 1e-8, 5e-4))
    q, v = start_of(system, there.take([1]))
    back = integration.run(0.0, q.reshape(-1), -v.reshape(-1), np.array([0.0, 1.0]), None)
    for name in there:
        assert back[name].angle[-1] == pytest.approx(there[name].angle[0], abs=2e-10)


# -- stiffness --------------------------------------------------------------------------------


def bushed(stiffness, damping):
    """A pendulum whose pin is two springs with dampers at right angles."""
    machine = Mechanism("bushed pendulum")
    machine.add(
        Body("rod", mass=1.0, inertia=0.1, cg=(0.5, 0.0), guess=Guess(0.0, 0.0, 0.0)),
        Gravity("gravity", y=-G),
    )
    for n, place in enumerate(((-1.0, 0.0), (0.0, 1.0))):
        far, near = Marker("ground", place), Marker("rod", (0.0, 0.0))
        machine.add(Spring(f"spring {n}", far, near, stiffness, free_length=1.0))
        machine.add(Damper(f"damper {n}", far, near, damping))
    return machine


def test_radau_follows_what_is_stiff_and_explicit_steps_say_so():
    """A stiff bushing is nearly a pin: by the force of 25 N over the stiffness, 2.5e-9 m."""
    pin = Mechanism("pinned")
    pin.add(
        Body("rod", mass=1.0, inertia=0.1, cg=(0.5, 0.0), guess=0.0),
        Gravity("gravity", y=-G),
        Revolute("O", "ground", "rod"),
    )
    right = simulate(pin, 2.0, rtol=1e-11, instants=2)["rod"].angle[-1]
    machine = bushed(1e10, 1e6)
    run = simulate(machine, 2.0, method="radau5", rtol=1e-6, instants=2)
    # what dampers in series with the rod take in 2 s, and the tolerance
    assert run["rod"].angle[-1] == pytest.approx(right, abs=2e-5)
    assert run.stats["tangents"] > 0
    with pytest.raises(SolveError, match=r"too stiff for explicit steps.*radau5") as raised:
        simulate(machine, 2.0, rtol=1e-6, instants=2)
    assert raised.value.solution is not None


def test_radau_agrees_with_another_radau_on_a_damped_bushing():
    """scipy's Radau on hand-written equations of the same body."""

    def slopes(t, y, k=1e6, c=1e4):
        x, h, angle, vx, vy, w = y
        px, py = -0.5 * math.cos(angle), -0.5 * math.sin(angle)
        force = np.zeros(2)
        for ax, ay in ((-1.0, 0.0), (0.0, 1.0)):
            d = np.array([x + px - ax, h + py - ay])
            u = d / np.hypot(*d)
            rate = (vx - w * py) * u[0] + (vy + w * px) * u[1]
            force -= (k * (np.hypot(*d) - 1.0) + c * rate) * u
        turn = px * force[1] - py * force[0]
        return [vx, vy, w, force[0], force[1] - G, turn / 0.1]

    first = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]
    other = solve_ivp(slopes, (0.0, 1.0), first, method="Radau", rtol=1e-10, atol=1e-10)
    run = simulate(bushed(1e6, 1e4), 1.0, method="radau5", rtol=1e-9, instants=2)
    # both tolerances, over a swing of 3 rad
    assert run["rod"].angle[-1] == pytest.approx(other.y[2, -1], abs=1e-7)
    assert abs(run.energy.balance[-1]) < 1e-6 * run.energy.size


@pytest.mark.parametrize("method", METHODS)
def test_every_method_takes_loops_drivers_redundancy_and_massless_bodies(method):
    """A driven crank with massless coupler, doubled pin and a spring that lets the rest move: the
    same motion as by the default, to what the method's order gives.
    """
    machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 0.0, 2.0), speed=1.0)
    machine = machine.without("motor")
    machine.add(
        Gravity("gravity", y=-G),
        Body("arm", mass=0.5, cg=(0.4, 0.0), guess=0.3),
        Revolute("P", Marker("rocker", (1.0, 0.0)), "arm"),
        Revolute("P again", Marker("rocker", (1.0, 0.0)), "arm"),
        AngleDriver("motor", "arm", "0.3 + 2*t"),
    )
    right = simulate(machine, 0.5, rtol=1e-11, instants=3)
    run = simulate(machine, 0.5, method=method, rtol=1e-9, instants=3, **step_option(method))
    allowed = {"rattle": 1e-3, "generalized-alpha": 2e-3, "rattle4": 1e-7}.get(method, 1e-7)
    for name in run:
        assert np.abs(run[name].angle - right[name].angle).max() < allowed
    assert np.abs(run.effort("motor") - right.effort("motor")).max() < 1e3 * allowed


@pytest.mark.parametrize("method", METHODS)
def test_every_method_passes_singular_positions(method):
    """Two windows, ten passages in 10 s, against the equation of one angle in tight steps; errors
    of even steps as their orders leave them over the whole motion.
    """
    machine = gallery.load("n_windows_2")
    step = {"step": 2e-3} if method in EVEN else {}
    run = simulate(machine, method=method, instants=2, **step)
    right = simulate(machine, rtol=1e-12, instants=2)["c0"].angle[-1]
    allowed = {"rattle": 2e-4, "generalized-alpha": 2e-3, "rattle4": 1e-7}.get(method, 2e-7)
    assert run["c0"].angle[-1] == pytest.approx(right, abs=allowed)
    assert run.stats["careful"] > 0


@pytest.mark.parametrize("method", EVEN)
def test_a_driven_mechanism_stands_still_by_every_even_method(method):
    """At rest its accelerations are rounding, which no corrections make smaller: forces are those
    of statics, to the digits of the positions.
    """
    machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)).without("motor")
    machine.add(Gravity("gravity", y=-G), AngleDriver("hold", "crank", 1.0))
    run = simulate(machine, 0.1, method=method, step=1e-3, instants=3)
    still = mbody.statics(machine)
    assert run.status == "completed"
    assert run.effort("hold") == pytest.approx(still.effort("hold")[0], rel=1e-9)
    assert np.ptp(run["rocker"].angle) < 1e-12


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_explicit_steps_do_not_crawl_where_loads_jump(method):
    """Released, the machine stops where its valves hold it: 1e7 steps would be left, and are not
    begun. The motion until there is kept.
    """
    machine = gallery.load("mud_pump")
    with pytest.raises(SolveError, match=r"loads jump to and fro at t = 0\.06") as raised:
        simulate(machine, 0.2, method=method, release={"motor": 0.05})
    reached = raised.value.solution
    assert reached.stats["steps"] < 50_000
    # both phases: with the driver and without
    assert reached.t[0] == 0.0 and reached.t[-1] == pytest.approx(0.061, abs=2e-3)
    assert reached.effort("motor")[0] != 0.0 == reached.effort("motor")[-1]


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1e4, 1e6, 1e9])
@pytest.mark.parametrize("method", ["dop853", "rattle"])
def test_a_motion_is_the_same_in_every_unit_of_length(method, unit):
    """Two rods, one with a massless link on it, where a metre is so many units: what stands in for
    mass and inertia is small beside masses, and inertias by the square of a length.
    """

    def swinging(k):
        machine = Mechanism("rods", ground={"C": (0.3 * k, -1.5 * k)})
        rod = {"inertia": 0.1 * k * k, "cg": (0.5 * k, 0.0), "points": {"E": (k, 0.0)}}
        machine.add(
            Body("a", mass=1.0, guess=-0.3, **rod),
            Body("b", mass=0.01, **rod | {"inertia": 0.0, "cg": (0.2 * k, 0.0)}, guess=-1.0),
            Body("link", points={"E": (k, 0.0)}, guess=1.9),
            Revolute("O", "ground", "a"),
            Revolute("E", "a.E", "b"),
            Revolute("C", "ground.C", "link"),
            Revolute("F", "b.E", "link.E"),
            Gravity("gravity", y=-G * k),
        )
        return simulate(machine, 0.5, method=method, instants=3, **step_option(method))

    right, found = swinging(1.0), swinging(unit)
    for name in right:
        # rounding of one, grown along the motion
        assert found[name].angle == pytest.approx(right[name].angle, abs=1e-9)
    share = found.energy.balance / found.energy.size - right.energy.balance / right.energy.size
    assert np.abs(share).max() < 1e-9


# -- going on ---------------------------------------------------------------------------------


def rows(run):
    return run.record.table(slice(None))


@pytest.mark.parametrize("method", METHODS)
def test_a_motion_goes_on_bit_for_bit(method, tmp_path):
    """From memory and from a file: as if it had not ended."""
    machine = gallery.load("free_fourbar")
    options = {"method": method, **step_option(method)}
    times = np.linspace(0.0, 1.0, 11)
    whole = simulate(machine, 1.0, times=times, **options)
    first = simulate(machine, 0.5, times=times[:6], **options)
    mbody.save_run(first, tmp_path / "run.npz")
    again = mbody.load_run(tmp_path / "run.npz")
    assert np.array_equal(rows(again), rows(first))
    assert str(again) == str(first)
    for start in (first, again):
        rest = simulate(start.mechanism, 1.0, times=times[5:], start=start, **options)
        assert np.array_equal(rows(rest)[1:], rows(whole)[6:])
        # sums in another order
        kinetic = rest.energy.kinetic[-1] - rest.energy.kinetic[0]
        assert rest.energy.balance[-1] == pytest.approx(
            kinetic + rest.energy.potential[-1] - rest.energy.work[-1], abs=1e-12
        )


@first_fast("method", ["dop853", "radau5", "rattle"], 1)
@pytest.mark.parametrize("watching", [False, True])
def test_an_interrupted_motion_goes_on_bit_for_bit(method, watching):
    machine = gallery.load("free_fourbar")
    options = {"method": method, **step_option(method)}
    if watching:
        options["events"] = [Event("crank.omega", name="turns back")]

    def stop(t):
        if t > 0.3:
            raise KeyboardInterrupt

    last = 4.0 if watching else 25.0  # the kernel makes 500 steps at once without events
    cut = simulate(machine, last, progress=stop, **options)
    assert cut.status.endswith("by the user")
    assert cut.t[-1] < last
    whole = simulate(machine, last, **options)
    rest = simulate(machine, last, times=[last], start=cut, **options)
    assert np.array_equal(rows(rest)[-1], rows(whole)[-1])
    # located between other marks, to a part in 1e12 of a step
    found = [one.t for one in (*cut.events, *rest.events)]
    assert found == pytest.approx([one.t for one in whole.events], abs=1e-12)


# -- letting go -------------------------------------------------------------------------------


def driven():
    machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=4.0)
    machine.add(Gravity("gravity", y=-G), Torque("brake", "crank", value=-2.0))
    return machine


def test_a_driver_lets_go():
    """As two motions: driven until then, and without the driver from its last instant on."""
    machine = driven()
    run = simulate(machine, 1.0, release={"motor": 0.4}, instants=11, rtol=1e-10)
    first = simulate(machine, 0.4, instants=5, rtol=1e-10)
    second = simulate(machine.without("motor"), 1.0, start=first, instants=7, rtol=1e-10)
    assert np.abs(run["crank"].omega[:4] - 4.0).max() < 1e-12
    # by other steps
    assert run["rocker"].angle[4:] == pytest.approx(second["rocker"].angle, abs=1e-8)
    assert run.effort("motor")[:4] == pytest.approx(first.effort("motor")[:4], rel=1e-9)
    assert not run.effort("motor")[4:].any()
    assert abs(run.energy.balance).max() < 1e-8 * run.energy.size
    assert run.energy.by["motor"][-1] == pytest.approx(first.energy.by["motor"][-1], rel=1e-9)


def test_a_released_motion_goes_on_and_is_asked_in_files(tmp_path):
    machine = driven()
    machine.simulation = SimulationSettings(1.0, release={"motor": "400 ms"}, method="dopri5")
    mbody.save(machine, tmp_path / "released.toml")
    read = mbody.load(tmp_path / "released.toml")
    assert read.simulation.method == "dopri5"
    whole = simulate(read)
    half = simulate(read, 0.5)
    rest = simulate(read, 1.0, start=half, times=[1.0])
    assert np.array_equal(rows(rest)[-1], rows(whole)[-1])
    # what is released stays so, without a note
    read.simulation = None
    rest = simulate(read, 1.0, start=half, times=[1.0], method="dopri5")
    assert np.array_equal(rows(rest)[-1], rows(whole)[-1])
