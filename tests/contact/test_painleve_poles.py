"""Contact forces with a pole: a rod that slides on its end jams at det(I − φ′ B) = 0, or lifts off
before, beside an integration of its own with N in closed form.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import mbody

G = 9.81
#: Coefficients, half lengths, masses, angles, rates in parts of that of the singular point.
JAM = [
    (1.7, 0.8, 1.0, 0.6, 0.7185),
    (1.58, 2e-4, 3e-6, 0.3, 0.5),
    (2.2, 7e3, 4e5, 0.1, 0.7),
    (3.8, 0.05, 1e6, 0.2, 0.8),
    (2.6, 30.0, 2e-6, 0.15, 1.0057),
]
LIFT = [
    (1.7, 0.8, 1.0, 0.6, 0.95),
    (1.5668, 859.0, 6.5e-4, 0.188, 0.9695),
    (3.6, 1e-3, 5.0, 0.35, 0.999),
]


def singular(mu: float) -> float:
    """Angle at which 1 + 3 c² − 3 μ s c = 0: pressing the end on lifts it from there on."""
    return math.atan((3.0 * mu - math.sqrt(9.0 * mu * mu - 16.0)) / 2.0)


def motion(case):
    """(ω² l/g, t √(g/l)) over τ, θ* − θ = x = x₀ e^−τ, and N/(m g), which is
    (1 − ω² s l/g)/(1 + 3 c² − 3 μ s c) and turns the rod with 3 N (μ s − c)/(m l).
    """
    mu, *_, angle, part = case
    end, x0 = singular(mu), singular(mu) - angle

    def pressing(tau, y):
        x = x0 * math.exp(-tau)
        # 1 + 3 c² − 3 μ s c, which is zero at θ*, without cancellation
        whole = 3.0 * math.sin(x) * (math.sin(2.0 * end - x) + mu * math.cos(2.0 * end - x))
        return lifts(tau, y) / whole

    def rates(tau, y):
        x = x0 * math.exp(-tau)
        turns = 3.0 * pressing(tau, y) * (mu * math.sin(end - x) - math.cos(end - x))
        return [2.0 * turns * x, x / math.sqrt(max(y[0], 1e-9))]

    def lifts(tau, y):
        return 1.0 - y[0] * math.sin(end - x0 * math.exp(-tau))

    lifts.terminal = True
    start = [part**2 / math.sin(end), 0.0]
    how = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "events": lifts, "dense_output": True}
    return solve_ivp(rates, (0.0, 26.0), start, **how), pressing


def own(case) -> tuple[str, float]:
    """How the sliding ends, and when."""
    found, _ = motion(case)
    kind = "open" if found.t_events[0].size else "paradox"
    return kind, float(found.y[1, -1]) * math.sqrt(case[1] / G)


def rod(case, *more, name="rod", at=0.0, floor="ground.floor"):
    """Elements, and the start, of a rod that slides on its left end, fast to the left."""
    mu, length, mass, angle, part = case
    rate = part * math.sqrt(G / length / math.sin(singular(mu)))
    s, c = math.sin(angle), math.cos(angle)
    body = mbody.Body(name, mass=mass, inertia=mass * length**2 / 3.0, points={"E": (-length, 0.0)})
    start = {"x": at + length * c, "y": length * s, "angle": angle, "omega": rate}
    start |= {"vx": -length * rate * (60.0 + s), "vy": length * rate * c}
    return (body, mbody.Contact(f"{name}_end", floor, f"{name}.E", friction=mu)), {name: start}


def machine(elements, start, until):
    made = mbody.Mechanism(
        "rods", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    made.add(*sorted(elements, key=lambda one: one.role != "body"), mbody.Gravity("gravity", y=-G))
    made.simulation = mbody.SimulationSettings(until, start)
    return made


def first_event(case, **how):
    kind, t = own(case)
    run = mbody.simulate(machine(*rod(case), 1.4 * t), **how)
    return kind, t, run


@pytest.mark.parametrize("method", ["dop853", "radau5"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-11])
@pytest.mark.parametrize("case", JAM)
def test_a_rod_jams_at_its_pole_at_every_tolerance(case, rtol, method):
    kind, t, run = first_event(case, rtol=rtol, method=method)
    assert kind == "paradox"
    assert [(one.name, one.contact) for one in run.events] == [("paradox", "rod_end")]
    assert run.events[0].t == pytest.approx(t, rel=0.3 * rtol + 3e-9)
    assert run.status.startswith("ended: ") and not run.doubts
    assert run["rod"].angle[-1] == pytest.approx(singular(case[0]), abs=rtol + 1e-7)
    assert (run.contact("rod_end") > 0.0).all()


@pytest.mark.parametrize("method", ["dop853", "radau5"])
@pytest.mark.parametrize("rtol", [1e-5, 1e-8, 1e-11])
@pytest.mark.parametrize("case", LIFT)
def test_a_rod_that_lifts_off_before_opens(case, rtol, method):
    """Also where it does so a thousandth of its angle before the pole."""
    kind, t, run = first_event(case, rtol=rtol, method=method)
    assert kind == "open"
    assert (run.events[0].name, run.mode("rod_end")[-1]) == ("open", "open")
    assert run.events[0].t == pytest.approx(t, rel=3e-5 + 30.0 * rtol)
    assert run.status == "completed"


def test_of_two_rods_the_first_jams():
    """One determinant of both."""
    small, great = (1.7, 0.5, 1.0, 0.6, 0.72), (2.0, 2.0, 3.0, 0.2, 0.5)
    first, second = rod(small), rod(great, name="other", at=100.0)
    t = own(small)[1]
    assert t < 0.5 * own(great)[1]
    made = machine((*first[0], *second[0]), first[1] | second[1], 1.4 * t)
    run = mbody.simulate(made, rtol=1e-8)
    assert [one.name for one in run.events] == ["paradox"]
    assert run.events[0].t == pytest.approx(t, rel=1e-8)


@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-11])
def test_what_holds_the_floor_slips_on_the_way_to_the_pole(rtol):
    """The rod slides on a plate that sticks with 0.9 (N + M g) of friction, until 1.7 N is more."""
    case = JAM[0]
    found, pressing = motion(case)
    plate = 40.0
    most = 0.9 * plate / case[2] / (case[0] - 0.9)
    tau = brentq(lambda tau: pressing(tau, found.sol(tau)) - most, 0.0, 20.0, xtol=1e-14)
    t = found.sol(tau)[1] * math.sqrt(case[1] / G)
    elements, start = rod(case, floor="plate.top")
    start["rod"]["y"] += 0.1
    corners = {"A": (-9.0, 0.0), "B": (3.0, 0.0), "P": (-9.0, -0.1), "Q": (3.0, -0.1)}
    top = {"top": {"segment": ("A", "B")}, "foot": {"segment": ("Q", "P")}}
    support = mbody.Body("plate", mass=plate, inertia=1e3, points=corners, shapes=top)
    hold = mbody.Contact("hold", "ground.floor", "plate.foot", friction=0.9)
    made = machine((*elements, support, hold), start | {"plate": {"x": 0.0, "y": 0.1}}, 1.4 * t)
    run = mbody.simulate(made, rtol=rtol)
    assert (run.events[0].name, run.events[0].contact) == ("slip", "hold")
    assert run.events[0].t == pytest.approx(float(t), rel=1e-9 + 0.1 * rtol)


def guided(mu, block, angle):
    """Equations (3, 3) of a rod of 1 kg and 1 m on a block in a guide that slides to the left, in
    its acceleration, that of the angle and the pressing force: forces along and across, moment.
    """
    s, c = math.sin(angle), math.cos(angle)
    return np.array([[1.0 + block, -s, -mu], [0.0, c, -1.0], [-s, 4.0 / 3.0, 0.0]])


def jams(mu, block, angle, rate):
    """When det = 0 of a rod on a block in a guide, with (θ̇², t) over τ, x = θ* − θ = x₀ e^−τ."""
    end = brentq(lambda th: np.linalg.det(guided(mu, block, th)), angle, 1.0, xtol=1e-15)
    x0 = end - angle

    def rates(tau, y):
        x = x0 * math.exp(-tau)
        s, c = math.sin(end - x), math.cos(end - x)
        right = [y[0] * c, y[0] * s - (1.0 + block) * G, -G * c]
        _, turns, _ = np.linalg.solve(guided(mu, block, end - x), right)
        return [2.0 * turns * x, x / math.sqrt(y[0])]

    found = solve_ivp(rates, (0.0, 20.0), [rate**2, 0.0], "DOP853", rtol=1e-11, atol=1e-12)
    return float(found.y[1, -1])


@pytest.mark.parametrize("method", ["dop853", "radau5"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
@pytest.mark.parametrize("block", [1e-3, 0.02])
def test_a_guide_jams_at_its_pole_too(block, rtol, method):
    """What slides in a guide that holds both ways presses without bound at the same determinant."""
    mu, angle, rate, along = 1.7, 0.6, 2.8, -50.0
    t = jams(mu, block, angle, rate)
    made = mbody.Mechanism("guided", ground={"O": (0.0, 0.0)})
    made.add(
        mbody.Body("block", mass=block, inertia=1e-6, points={"C": (0.0, 0.0)}),
        mbody.Body("rod", mass=1.0, inertia=1.0 / 3.0, points={"E": (-1.0, 0.0)}),
        mbody.Prismatic("guide", "ground.O", "block.C", friction=mu),
        mbody.Revolute("pin", "block.C", "rod.E"),
        mbody.Gravity("gravity", y=-G),
    )
    s, c = math.sin(angle), math.cos(angle)
    start = {"x": c, "y": s, "angle": angle, "omega": rate, "vx": along - rate * s, "vy": rate * c}
    begin = {"block": {"x": 0.0, "y": 0.0, "vx": along, "vy": 0.0}, "rod": start}
    made.simulation = mbody.SimulationSettings(1.4 * t, begin)
    run = mbody.simulate(made, rtol=rtol, method=method)
    assert [(one.name, one.contact) for one in run.events] == [("paradox", "guide")]
    assert run.events[0].t == pytest.approx(t, rel=1e-8 + 0.3 * rtol)
    assert run.status.startswith("ended: ")
