"""Motions with contacts against closed forms and integrals of one angle: events to 1e-12 s."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import mbody
from mbody import SimulationSettings
from tests.support import contact_models as models

G = 9.81


def simulated(text: str, start: dict[str, float] | None = None, until: float = 1.0):
    """The motion of a model file, from another start perhaps."""
    machine = mbody.from_toml(text)
    if start is not None:
        (body,) = (one.name for one in machine.bodies)
        machine.simulation = SimulationSettings(until=until, rtol=1e-13, start={body: start})
    return mbody.simulate(machine)


def told(run, name: str) -> list[float]:
    return [float(one.t) for one in run.events if one.name == name]


def check_account(run) -> None:
    """The account closes, and what was lost is the sum of what contacts took."""
    energy = run.energy
    assert run.status == "completed", run.status
    assert energy.error < 1e-9
    taken = sum(energy.lost.values())
    assert np.abs(taken - energy.dissipated).max() <= 1e-12 * energy.size
    assert all((np.diff(part) > -1e-9 * energy.size).all() for part in energy.lost.values())


def test_a_ball_bounces_to_rest():
    """t₀ (1 + e)/(1 − e), t₀ = √(2 y₀/g); tenth impact t₀ (1 + 2 Σ eᵏ, k < 10)."""
    machine = mbody.from_toml(models.BALL)
    run = mbody.simulate(machine, 6.0, rtol=1e-13)
    first, e = math.sqrt(2.0 / G), 0.8
    (rest,) = told(run, "rest")
    assert rest == pytest.approx(first * (1.0 + e) / (1.0 - e), abs=1e-12)
    tenth = first * (1.0 + 2.0 * sum(e**k for k in range(1, 10)))
    assert told(run, "impact")[9] == pytest.approx(tenth, abs=1e-12)
    assert {one.contact for one in run.events} == {"hit"}
    assert float(run.energy.lost["hit"][-1]) == pytest.approx(G, rel=1e-12)  # all that it had
    assert float(abs(run["ball"].y[-1])) < 1e-15
    check_account(run)


def test_a_block_slides_up_an_incline_and_stays():
    """v₀/(g (sin α + μ cos α)) and half of that times v₀; it stays, for tan α < μ."""
    run = simulated(models.INCLINE)
    slows = G * (math.sin(0.3) + 0.4 * math.cos(0.3))
    (stop,) = told(run, "stick")
    assert stop == pytest.approx(3.0 / slows, abs=1e-12)
    way = float(np.hypot(run["block"].x[-1], run["block"].y[-1]))
    assert way == pytest.approx(4.5 / slows, abs=1e-12)
    after = run.t > stop
    assert (np.array(run.mode("under"))[after] == "stick").all()
    assert float(np.ptp(run["block"].x[after])) < 1e-14
    force = run.reaction("under")
    held = np.hypot(force.fx, force.fy)[after]
    assert held == pytest.approx(2.0 * G, abs=1e-11)  # the weight
    check_account(run)


def test_a_disc_begins_to_roll():
    """v₀/(3 μ g), then 2 v₀/3."""
    run = simulated(models.DISC)
    (rolls,) = told(run, "stick")
    assert rolls == pytest.approx(2.0 / (3.0 * 0.15 * G), abs=1e-12)
    assert float(run["wheel"].vx[-1]) == pytest.approx(4.0 / 3.0, abs=1e-12)
    assert run.mode("road")[-1] == "roll"
    # the force of the wheel on the road, which is body j
    assert float(run.reaction("road").fy[-1]) == pytest.approx(-3.0 * G, abs=1e-11)
    assert float(run.contact("road")[-1]) == pytest.approx(3.0 * G, abs=1e-11)
    check_account(run)


def test_a_disc_is_thrown():
    """Λ_N = (1 + e) m v_n, Λ_T = min(μ Λ_N, m u/3)."""
    run = simulated(models.THROWN)
    (hit,) = (one for one in run.events if one.name == "impact")
    wheel = hit.after["wheel"]
    normal, along = 1.6 * 1.3 * 3.0, 1.3 * 2.0 / 3.0
    along = min(0.2 * normal, along)
    assert float(wheel.vx[0]) == pytest.approx(2.0 - along / 1.3, abs=1e-13)
    assert float(wheel.vy[0]) == pytest.approx(1.8, abs=1e-13)
    assert float(wheel.omega[0]) == pytest.approx(-along * 0.1 / (1.3 * 0.01 / 2.0), abs=1e-12)
    check_account(run)


def held_ladder(slip_sign: float, until: float):
    """A ladder of 200 N at rest, whose foot a force holds that falls or grows by 40 N/s from 60."""
    text = models.LADDER[: models.LADDER.index("[simulate]")]
    text = text.replace("mass = 1", f"mass = {200.0 / G!r}")
    machine = mbody.from_toml(text.replace('"1/3"', repr(200.0 / G / 3.0)))
    force = f"60 N {'+' if slip_sign > 0.0 else '-'} 40 N/s*t"
    machine.add(mbody.Force("hold", "ladder.A", force, angle=math.pi))
    start = {"x": math.cos(1.0), "y": math.sin(1.0), "angle": math.pi - 1.0}
    machine.simulation = SimulationSettings(until=until, rtol=1e-13, start={"ladder": start})
    return mbody.simulate(machine)


@pytest.mark.parametrize(
    ("slip_sign", "end"), [(-1.0, 10.764630791962567), (1.0, 123.71708864639038)]
)
def test_a_ladder_at_rest_begins_to_slide_at_the_ends_of_its_band(slip_sign, end):
    """It sticks at both ends by one row too many, so that no equation decides their forces; it
    slides where both are at their limits, as the band of `statics` has it.
    """
    run = held_ladder(slip_sign, 2.0)
    first = [event for event in run.events if event.name == "slip"][:2]
    assert {event.contact for event in first} == {"foot", "top"}
    for event in first:
        assert event.t == pytest.approx(slip_sign * (end - 60.0) / 40.0, abs=1e-12)
    before = run.t < first[0].t
    assert float(np.abs(run["ladder"].omega[before]).max()) < 1e-12


def rod(angle: float, rate: float, along: float) -> dict[str, float]:
    """State of a rod whose lower end moves along the floor."""
    c, s = math.cos(angle), math.sin(angle)
    rates = {"vx": along - s * rate, "vy": c * rate, "omega": rate}
    return {"x": c, "y": s, "angle": angle, **rates}


def test_painleve_has_an_impact_without_collision():
    """Between the angles tan θ = (3 μ ∓ √(9 μ² − 16))/2 no acceleration is consistent; the impulse
    Λ = −D⁻¹ (0, u) stops the end.
    """
    angle, along = 1.0, -3.0
    run = simulated(models.ROD, rod(angle, 0.0, along), until=0.02)
    assert [one.name for one in run.events][:2] == ["inconsistent", "impact"]
    assert "Painlevé" in run.notes[0]
    c, s = math.cos(angle), math.sin(angle)
    D = np.array([[1.0 + 3.0 * c * c, -3.0 * s * c], [-3.0 * s * c, 1.0 + 3.0 * s * s]])
    normal, tangential = np.linalg.solve(D, [0.0, -along])
    after = run.events[1].after["rod"]
    assert float(after.vy[0]) == pytest.approx(normal, abs=1e-13)
    assert float(after.vx[0]) == pytest.approx(along + tangential, abs=1e-13)
    turning = 3.0 * (-c * normal + s * tangential)
    assert float(after.omega[0]) == pytest.approx(turning, abs=1e-12)
    check_account(run)


def test_a_rod_of_painleve_may_do_two_things():
    """Turning fast enough it may lift or be thrown: both are consistent, the lift is taken."""
    run = simulated(models.ROD, rod(1.0, 5.0, -3.0), until=1e-3)
    assert run.events[0].name == "indeterminate"
    assert "several accelerations" in run.notes[0]
    assert run.mode("end")[-1] == "open"


@pytest.mark.parametrize(("before", "slower"), [(0.1, 1.0), (0.05, 0.5), (0.2, 1.8)])
def test_a_rod_ends_in_the_point_of_genot_and_brogliato(before, slower):
    """Above μ = 8/(3 √3) what slides towards the paradox meets it where the end would lift, too:
    A(θ) = 0 and ω² sin θ = g. The approach is singular: the rate is known to far fewer digits than
    the angle.
    """
    mu = 1.7
    angle = math.atan((3.0 * mu - math.sqrt(9.0 * mu * mu - 16.0)) / 2.0)
    rate = math.sqrt(G / math.sin(angle))
    text = models.ROD.replace("friction = 1.4", f"friction = {mu}")
    run = simulated(text, rod(angle - before, rate - slower, -8.0), until=0.3)
    assert [one.name for one in run.events] == ["paradox"]
    assert run.status.startswith("ended: ")
    assert "grow without bound" in run.status
    assert float(run["rod"].angle[-1]) == pytest.approx(angle, abs=1e-9)
    assert float(run["rod"].omega[-1]) == pytest.approx(rate, abs=1e-4)


def test_a_rod_comes_near_that_point_by_a_power_of_the_angle():
    """With x = θ − θ*, y = ω − ω* the force is (b_θ x + b_ω y)/(A′ x), so that y goes as |x|^κ, κ =
    2 s (μ s − c)/(2 s c − μ (s² − c²)): what an angle is short of the point, a rate is by the power
    0.612 of it.
    """
    mu = 1.7
    angle = math.atan((3.0 * mu - math.sqrt(9.0 * mu * mu - 16.0)) / 2.0)
    rate, s, c = math.sqrt(G / math.sin(angle)), math.sin(angle), math.cos(angle)
    machine = mbody.from_toml(models.ROD.replace("friction = 1.4", f"friction = {mu}"))
    start = {"rod": rod(angle - 0.05, rate - 0.5, -8.0)}
    machine.simulation = SimulationSettings(until=0.3, rtol=1e-13, start=start)
    end = float(mbody.simulate(machine).t[-1])
    run = mbody.simulate(machine, times=[end - 1e-6, end - 1e-8])
    short = [np.abs(part) for part in (run["rod"].angle - angle, run["rod"].omega - rate)]
    power = math.log(short[1][0] / short[1][1]) / math.log(short[0][0] / short[0][1])
    kappa = 2.0 * s * (mu * s - c) / (2.0 * s * c - mu * (s * s - c * c))
    # a part of x itself is left, (1e-7)^(1 − κ) = 2e-3
    assert power == pytest.approx(kappa, abs=5e-3)


def rocking(count: int) -> tuple[list[float], list[float]]:
    """Times of the impacts of a block that rocks, and rates after them: quarter periods by
    quadrature, Housner's ratio 1 − 3/2 sin²α.
    """
    R, alpha = math.hypot(0.1, 0.4), math.atan2(0.1, 0.4)
    p2, ratio = 3.0 * G / (4.0 * R), 1.0 - 1.5 * math.sin(alpha) ** 2
    times, rates, t, top = [], [], 0.0, 0.5 * alpha
    nodes, weights = np.polynomial.legendre.leggauss(80)
    for n in range(count):
        tilt = alpha - top

        x = 0.5 * math.sqrt(top) * (1.0 + nodes)
        half = np.sin(tilt + x * x / 2.0) * np.sin(x * x / 2.0) / (x * x)
        quarter = float(0.5 * math.sqrt(top) * weights @ (1.0 / np.sqrt(p2 * half)))
        t += quarter if n == 0 else 2.0 * quarter
        w = ratio * math.sqrt(2.0 * p2 * (math.cos(tilt) - math.cos(alpha)))
        times.append(t)
        rates.append(w)
        top = alpha - math.acos(math.cos(alpha) + w * w / (2.0 * p2))
    return times, rates


def test_a_block_rocks():
    """The ratio of Housner comes out of the impact."""
    tilt = -0.5 * math.atan2(0.1, 0.4)
    c, s = math.cos(tilt), math.sin(tilt)
    start = {"x": -(0.1 * c + 0.4 * s), "y": 0.4 * c - 0.1 * s, "angle": tilt}
    run = simulated(models.BLOCK, start, until=1.6)
    times, rates = rocking(3)
    hits = [one for one in run.events if one.name == "impact"]
    assert [float(one.t) for one in hits[:3]] == pytest.approx(times, abs=1e-12)
    turned = [abs(float(one.after["block"].omega[0])) for one in hits[:3]]
    assert turned == pytest.approx(rates, abs=1e-11)
    check_account(run)


def test_a_box_on_an_incline_does_not_creep():
    """Below the angle of friction, 10⁶ s: the constraint holds it."""
    text = models.INCLINE.replace("until = 2.0", "until = 1e6").replace("rtol = 1e-13", "rtol=1e-8")
    text = text[: text.index("start = ")] + "start = { block = { x = 0, y = 0, angle = 0 } }\n"
    run = mbody.simulate(mbody.from_toml(text))
    assert set(run.mode("under")) == {"stick"}
    assert max(float(np.abs(getattr(run["block"], k)).max()) for k in ("x", "y", "angle")) < 1e-12


def box_under_a_load(formula: str, until: float, instants: int) -> mbody.Solution:
    """A box of two corners on the incline of 0.3 rad, pushed along it."""
    text = models.INCLINE.replace("points = { C = [0, 0] }", BOX).replace(
        'under = { contact = ["ground.slope", "block.C"], friction = 0.4 }', CORNERS
    )
    machine = mbody.from_toml(text)
    machine.add(mbody.Force("push", "block.A", formula, angle=0.3))
    machine.simulation = SimulationSettings(
        until=until, rtol=1e-8, instants=instants, start={"block": {"x": 0, "y": 0, "angle": 0.3}}
    )
    return mbody.simulate(machine)


BOX = "points = { A = [-0.1, 0], B = [0.1, 0] }\ncg = [0, 0.1]"
CORNERS = "\n".join(
    f'{name} = {{ contact = ["ground.slope", "block.{corner}"], friction = 0.4 }}'
    for name, corner in (("lower", "A"), ("upper", "B"))
)


def test_a_load_that_swings_within_the_cone_moves_nothing_until_it_leaves_it():
    """It holds forces from m g (sin α − μ cos α) to m g (sin α + μ cos α)."""
    middle, half = 2.0 * G * math.sin(0.3), 2.0 * G * 0.4 * math.cos(0.3)
    run = box_under_a_load(f"{middle!r} + {0.98 * half!r}*sin(2*pi*t)", 400.0, 801)
    assert not run.events
    for part in ("x", "y", "angle"):
        way = np.asarray(getattr(run["block"], part))
        assert float(np.abs(way - way[0]).max()) < 1e-15
    # the amplitude grows over each cycle: the first top that is beyond the cone begins the motion
    grows = f"{middle!r} + {half!r}*(0.5 + t/100)*sin(2*pi*t)"
    run = box_under_a_load(grows, 50.3, 11)

    def beyond(t: float) -> float:
        return (0.5 + t / 100.0) * abs(math.sin(2.0 * math.pi * t)) - 1.0

    # 0.5 + t/100 = 1.0025 at the first quarter of a cycle after 50 s, 0.9975 at the last one before
    starts = brentq(beyond, 50.1, 50.25, xtol=1e-14)
    assert run.events[0].name == "slip"
    # the load is flat there: a rounding ε of the force is worth √ε of a cycle, here 1e-14/0.05
    assert float(run.events[0].t) == pytest.approx(starts, abs=1e-11)
