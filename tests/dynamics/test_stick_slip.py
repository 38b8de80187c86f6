"""Frictional joints in motion: they stick and slide at located instants."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import mbody
from mbody import Body, Gravity, Mechanism, Prismatic, Revolute, SimulationSettings, Spring

G = 9.81


def pendulum() -> Mechanism:
    """With a friction circle of 30 mm: pin of 50 mm, tan of the angle of friction 0.75."""
    machine = Mechanism("pendulum in a pin with friction", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("bob", mass=2.0, inertia=0.5 - 2.0 * 0.4**2, cg=(0.0, -0.4), points={"O": (0, 0)}),
        Revolute("O", "ground.O", "bob.O", friction=0.75, pin_radius=0.05),
        Gravity("gravity", y=-G),
    )
    start = {"bob": {"angle": 1.2}}
    machine.simulation = SimulationSettings(until=6.5, rtol=1e-13, start=start)
    return machine


def swings() -> tuple[list[float], float]:
    """Turning points of J_O θ̈ = −m g L sin θ − ρ |R| sign θ̇, R from θ̈ itself, until it stays."""
    m, L, J, rho = 2.0, 0.4, 0.5, 0.03

    def rate(t, y, sign):
        angle, w = y
        a = 0.0
        for _ in range(100):  # a contraction: ρ m L/J is 0.05
            along = m * (G * math.cos(angle) + L * w * w)
            across = m * (L * a + G * math.sin(angle))
            new = -(m * G * L * math.sin(angle) + sign * rho * math.hypot(along, across)) / J
            if new == a:
                break
            a = new
        return [w, a]

    times, t, angle, sign = [], 0.0, 1.2, -1.0
    while abs(math.sin(angle)) > rho / L:

        def turns(t, y, sign):
            return y[1]

        turns.terminal, turns.direction = True, -sign
        found = solve_ivp(
            rate,
            (t, t + 5.0),
            [angle, 0.0],
            method="DOP853",
            rtol=1e-13,
            atol=1e-15,
            events=turns,
            args=(sign,),
            first_step=1e-3,
            max_step=0.02,
        )
        t, angle = float(found.t_events[0][-1]), float(found.y_events[0][-1][0])
        times.append(t)
        sign = -sign
    return times, angle


def test_a_pendulum_in_a_rough_pin_comes_to_rest():
    run = mbody.simulate(pendulum())
    times, angle = swings()
    assert [one.name for one in run.events] == ["slip"] * 6 + ["stick"]
    assert {one.contact for one in run.events} == {"O"}
    # SciPy's events are those of its polynomials
    assert [float(one.t) for one in run.events] == pytest.approx(times, abs=1e-10)
    assert float(run.events[0].t) == pytest.approx(0.8558068448772531, abs=1e-12)
    assert float(run.events[-1].t) == pytest.approx(5.693616393492477, abs=1e-12)
    assert float(run["bob"].angle[-1]) == pytest.approx(angle, abs=1e-10)
    assert float(run["bob"].angle[-1]) == pytest.approx(0.04721630603458668, abs=1e-12)
    assert run.mode("O")[-1] == "stick"
    lost = float(run.energy.lost["O"][-1])
    fell = 2.0 * G * 0.4 * (math.cos(angle) - math.cos(1.2))
    assert lost == pytest.approx(fell, rel=1e-9)
    assert run.energy.error < 1e-9


def test_a_rough_guide_is_a_coulomb_oscillator():
    """As of a block on a floor: μ m g on a straight guide."""
    m, k, mu, x0 = 1.5, 60.0, 0.25, 0.7
    machine = Mechanism("slide", ground={"O": (0.0, 0.0), "W": (-2.0, 0.0)})
    machine.add(
        Body("block", mass=m, inertia=1.0, points={"C": (0.0, 0.0)}),
        Prismatic("guide", "ground.O", "block.C", friction=mu),
        Spring("spring", "ground.W", "block.C", stiffness=k, free_length=2.0),
        Gravity("gravity", y=-G),
    )
    machine.simulation = SimulationSettings(until=5.0, rtol=1e-13, start={"block": {"x": x0}})
    run = mbody.simulate(machine)
    half, less = math.pi / math.sqrt(k / m), mu * m * G / k
    turns = math.ceil((x0 / less - 1.0) / 2.0)
    assert [float(one.t) for one in run.events] == pytest.approx(
        [n * half for n in range(1, turns + 1)], abs=1e-12
    )
    stay = (-1) ** turns * (x0 - 2.0 * turns * less)
    assert float(run["block"].x[-1]) == pytest.approx(stay, abs=1e-12)
    assert run.energy.error < 1e-9


def test_sticking_needs_more_than_sliding():
    """A belt by a driver: a spring pulls a block on it until the static friction is reached; period
    of stick and slip in closed form.
    """
    mu_s, mu, k, m, u = 0.4, 0.25, 20.0, 1.0, 0.1
    machine = Mechanism("belt", ground={"O": (0.0, 0.0), "W": (-2.0, 0.0)})
    machine.add(
        Body("belt", points={"O": (0.0, 0.0)}),
        Prismatic("track", "ground.O", "belt.O"),
        mbody.CoordinateDriver("motor", "ground.O", "belt.O", mbody.laws.ConstantSpeed(0.0, u)),
        Body("block", mass=m, inertia=1.0, points={"C": (0.0, 0.0)}),
        Prismatic("guide", "belt.O", "block.C", friction=mu, static=mu_s),
        Spring("spring", "ground.W", "block.C", stiffness=k, free_length=2.0),
        Gravity("gravity", y=-G),
    )
    start = {"block": {"x": 0.0, "vx": u}}
    machine.simulation = SimulationSettings(until=12.0, rtol=1e-13, start=start)
    run = mbody.simulate(machine)
    slips = np.array([float(one.t) for one in run.events if one.name == "slip"])
    w, d = math.sqrt(k / m), (mu_s - mu) * m * G / k
    period = 2.0 * d / u + 2.0 / w * (math.pi - math.atan(d * w / u))
    assert len(slips) >= 3
    assert np.diff(slips) == pytest.approx(period, abs=1e-11)


def chain(rng: np.random.Generator, count: int, mu: float) -> Mechanism:
    """Links on pins with friction, hanging anyhow."""
    machine = Mechanism("chain", ground={"P0": (0.0, 0.0)})
    before = "ground"
    for n in range(count):
        length = float(rng.uniform(0.2, 0.6))
        body = Body(
            f"l{n}",
            mass=float(rng.uniform(0.5, 2.0)),
            inertia=0.02,
            cg=(0.5 * length, 0.0),
            points={f"P{n}": (0.0, 0.0), f"P{n + 1}": (length, 0.0)},
            guess=float(rng.uniform(-math.pi, math.pi)),
        )
        place = f"{before}.P{n}"
        machine.add(body, Revolute(f"j{n}", place, f"l{n}.P{n}", friction=mu, pin_radius=0.1))
        before = f"l{n}"
    machine.add(Gravity("gravity", y=-G))
    return machine


@pytest.mark.parametrize("seed", range(4))
def test_a_chain_obeys_coulombs_law_at_every_instant(seed):
    """Friction torque at most ρ |R| at rest, ρ |R| against the rate else; the energy closes."""
    rng = np.random.default_rng(seed)
    mu = 0.3
    machine = chain(rng, 2, mu)
    machine.simulation = SimulationSettings(until=3.0, rtol=1e-11)
    run = mbody.simulate(machine)
    rho = mu * 0.1 / math.sqrt(1.0 + mu * mu)
    assert len(run.events) > 2
    for n in range(2):
        force, modes = run.reaction(f"j{n}"), np.array(run.mode(f"j{n}"))
        before = run[f"l{n - 1}"].omega if n else 0.0
        rate = run[f"l{n}"].omega - before
        most = rho * force.magnitude
        still = modes == "stick"
        assert np.abs(rate[still]).max(initial=0.0) < 1e-9
        assert (np.abs(force.torque) <= most * (1.0 + 1e-9) + 1e-9).all()
        # at the instant of an event either of both modes is right
        moving = ~still & (np.abs(rate) > 1e-6)
        against = -np.sign(rate[moving]) * most[moving]
        assert force.torque[moving] == pytest.approx(against, rel=1e-9)
        assert set(modes[moving & (rate > 0.0)]) <= {"slip+"}
        assert set(modes[moving & (rate < 0.0)]) <= {"slip-"}
    assert run.energy.error < 1e-9
    lost = sum(part[-1] for part in run.energy.lost.values())
    assert float(lost) == pytest.approx(float(run.energy.dissipated[-1]), rel=1e-12)


def shaken(law):
    """A block in a rough guide, at rest under its weight."""
    machine = Mechanism("held", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("block", mass=1.0, inertia=1.0, points={"C": (0.0, 0.0)}),
        Prismatic("guide", "ground.O", "block.C", friction=0.4),
        mbody.Force("shake", "block.C", law),
        Gravity("gravity", y=-G),
    )
    return machine


def test_cycles_of_a_load_within_the_cone_move_nothing():
    """10³ of them: steps know nothing of the load, the guards do."""
    run = mbody.simulate(shaken("3.9 N*sin(2*pi*t/(1 s))"), 1e3, rtol=1e-8)
    assert set(run.mode("guide")) == {"stick"}
    assert not run.events
    assert float(np.abs(run["block"].x).max()) < 1e-12


def test_it_starts_where_a_load_leaves_the_cone():
    """After many cycles, the first peak above μ m g, from where that is solved by itself."""
    rise = 0.002  # N/s
    run = mbody.simulate(shaken(f"({rise} N/s*t)*sin(2*pi*t/(1 s))"), 1970.0, rtol=1e-12)

    def left(t):
        return 0.4 * G - rise * t * abs(math.sin(2.0 * math.pi * t))

    # the first quarter of a cycle within which it is exceeded, either way
    peak = next(n / 2.0 + 0.25 for n in range(4000) if left(n / 2.0 + 0.25) < 0.0)
    start = brentq(left, peak - 0.25, peak, xtol=1e-14)
    assert float(run.events[0].t) == pytest.approx(start, abs=1e-9)


def test_a_box_within_the_cone_stays_on_its_incline():
    """Two corners, below the angle of friction, 10³ cycles of a force within the cone."""
    text = """
[ground]
points = { O = [0, 0] }
shapes = { slope = { line = { point = "O", angle = "0.3 rad" } } }
[bodies.box]
mass = 2
inertia = 1
points = { A = [-0.5, 0], B = [0.5, 0], C = [0.5, 1], D = [-0.5, 1] }
shapes = { box = { polygon = ["A", "B", "C", "D"] } }
[contacts]
under = { contact = ["ground.slope", "box.box"], friction = 0.4 }
[loads]
shake = { force = "1.5 N*sin(2*pi*t/(1 s))", at = "box.A", angle = "0.3 rad" }
[gravity]
y = -9.81
[simulate]
until = 1e3
rtol = 1e-8
start = { box = { x = 0, y = 0, angle = "0.3 rad" } }
"""
    run = mbody.simulate(mbody.from_toml('name = "box"\nangle = "rad"\n' + text))
    # 2 g (0.4 cos 0.3 − sin 0.3) = 1.70 N are left
    assert set(run.mode("under")) == {"stick"}
    assert not run.events
    moved = [np.ptp(getattr(run["box"], part)) for part in ("x", "y", "angle")]
    assert float(max(moved)) < 1e-13


@pytest.mark.parametrize("stops", [False, True])
def test_an_event_where_sliding_turns_round_is_met_once(stops):
    """A rate vanishes at the instant at which friction changes its sign: whichever of both is
    located first by rounding, the event is neither missed nor recorded twice.
    """
    for friction in np.linspace(0.1, 0.69, 20):
        machine = Mechanism("thrown against a pull", ground={"O": (0, 0)})
        machine.add(
            Body("block", mass=1.0, points={"C": (0, 0)}),
            Prismatic("guide", "ground.O", "block.C", friction=float(friction)),
            Gravity("gravity", y=-10.0),
            mbody.Force("pull", "block.C", -8.0, angle=0.0),
        )
        machine.simulation = SimulationSettings(
            until=0.5,
            start={"block": {"x": 0.0, "vx": 3.0}},
            events=[mbody.Event(name="turns", of="block.vx", stop=stops)],
        )
        run = mbody.simulate(machine)
        turns = [event.t for event in run.events if event.name == "turns"]
        assert turns == pytest.approx([3.0 / (8.0 + 10.0 * friction)], rel=1e-9)
        assert (run.t[-1] == turns[0]) == stops
