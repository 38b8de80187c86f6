"""The gallery's models with contacts: events and forces against closed forms."""

import itertools
import math
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

import mbody
from mbody import gallery
from mbody.files.model import from_toml, to_toml

G = 9.81
#: Located events of steps at rtol 1e-12.
LOCATED = 1e-11


def simulated(name, parameters=None, **options):
    """The motion of a model; its account of energy closes."""
    run = mbody.simulate(gallery.load(name, parameters), **options)
    assert run.status == "completed", run.status
    assert run.energy.error < 1e-8
    return run


def times(run, name, contact=None):
    """When events of a name were, of one contact perhaps."""
    return [float(e.t) for e in run.events if e.name == name and contact in (None, e.contact)]


def test_a_ladder_leaves_its_wall_and_falls():
    """One equation of the angle while both ends slide, another one after; by SciPy."""
    run = simulated("sliding_ladder")
    mu, wall = 0.25, 0.15

    def both(angle, rate):
        c, s = math.cos(angle), math.sin(angle)
        rows = [[-s, mu, -1.0], [c, -1.0, -wall], [1.0 / 3.0, c - mu * s, -s - wall * c]]
        return np.linalg.solve(rows, [c * rate * rate, s * rate * rate - G, 0.0])

    def leaves(t, y):
        return both(*y)[2]

    leaves.terminal = True
    options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}
    first = solve_ivp(
        lambda t, y: [y[1], both(*y)[0]], (0.0, 2.0), [1.0, 0.0], events=leaves, **options
    )
    t, (angle, rate) = first.t_events[0][0], first.y_events[0][0]
    assert times(run, "open", "top") == pytest.approx([t], abs=LOCATED)
    assert t == pytest.approx(0.8704936493288725, abs=LOCATED)

    def alone(t, y):  # the foot slides on, to the right: y'' of the centre gives its force
        c, s = math.cos(y[0]), math.sin(y[0])
        pull = 3.0 * (c - mu * s)
        return [y[1], -pull * (G - s * y[1] ** 2) / (1.0 + pull * c)]

    def lies(t, y):
        return y[0]

    lies.terminal = True
    last = solve_ivp(alone, (t, t + 1.0), [angle, rate], events=lies, **options)
    assert times(run, "impact", "end") == pytest.approx(last.t_events[0], abs=LOCATED)
    assert abs(run["ladder"].y[-1]) < 1e-12


def test_a_block_on_a_belt_sticks_and_slips():
    """Stick: the spring is stretched by the belt's speed; slip: an arc of an ellipse about μ m g/k
    from μ_s m g/k to as much on its other side.
    """
    m, k, v, mu_s, mu = 1.0, 60.0, 0.15, 0.4, 0.25
    run = simulated("stick_slip")
    omega, over = math.sqrt(k / m), (mu_s - mu) * m * G / k
    slipping = 2.0 / omega * (math.pi - math.atan(over * omega / v))
    period = slipping + 2.0 * over / v
    first = mu_s * m * G / (k * v)
    assert times(run, "slip") == pytest.approx([first + n * period for n in range(4)], abs=LOCATED)
    caught = [first + slipping + n * period for n in range(4)]
    assert times(run, "stick") == pytest.approx(caught, abs=LOCATED)
    assert np.abs(run["block"].x).max() <= mu * m * G / k + math.hypot(over, v / omega) + 1e-12
    assert run.mode("rub")[0] == "stick"


def test_a_ball_with_backspin_comes_back():
    run = simulated("rolling_ball")
    r, mu, v, w = 0.06, 0.2, 2.0, 150.0
    assert times(run, "turns") == pytest.approx([v / (mu * G)], abs=LOCATED)
    rolls = 2.0 * (v + r * w) / (7.0 * mu * G)
    assert times(run, "stick") == pytest.approx([rolls], abs=LOCATED)
    end = (5.0 * v - 2.0 * r * w) / 7.0
    assert run["ball"].vx[-1] == pytest.approx(end, abs=1e-11)
    assert run.mode("floor")[-1] == "roll"
    before = 0.5 * 0.5 * (v * v + 0.4 * (r * w) ** 2)
    lost = before - 0.5 * 0.5 * 1.4 * end * end
    assert run.energy.lost["floor"][-1] == pytest.approx(lost, rel=1e-11)
    assert round(100.0 * lost / before) == 95  # the note


def test_a_vehicle_brakes_by_its_locked_wheels():
    """Without control the front wheels lock: their load follows from the moments of all parts, the
    rear wheels give T/r + J a/r².
    """
    run = simulated("braking_vehicle", {"fall": 0})
    base, rear, height, radius, mu, weight, g = 90.0, 50.0, 25.0, 14.5, 0.8, 4000.0, 386.4
    spin = 20.0 / radius
    (locks,) = times(run, "stick", "front_brake")
    k = int(np.searchsorted(run.t, locks)) + 2
    share = (rear + 0.95 * height) / base
    torque = (1.0 - math.exp(-8.0 * run.t[k])) * weight * radius * (1.0 - share)
    # a (m + J/r²) = μ N + T/r,  N b = W c + (m h + J/r) a
    own = weight / g + spin / radius - mu * (weight / g * height + spin) / base
    slows = (mu * weight * rear / base + torque / radius) / own
    assert run["chassis"].ax[k] == pytest.approx(-slows, rel=1e-7)
    assert run.mode("front_tyre")[k].startswith("slip") and run.mode("rear_tyre")[k] == "roll"
    # it stands at last, held by its brakes
    assert abs(run["chassis"].vx[-1]) < 1e-9 and run.mode("front_brake")[-1] == "stick"


def test_anti_lock_control_stops_sooner():
    led, plain = (simulated("braking_vehicle", {"fall": fall}) for fall in ("60/(1 s)", 0))
    shorter = plain["chassis"].x[-1] - led["chassis"].x[-1]
    assert 2.5 < shorter / 12.0 < 3.1  # the note: 2.8 ft
    rolling = led["chassis"].vx > 24.0
    assert (led["front_wheel"].omega[rolling] < -0.4 * led["chassis"].vx[rolling] / 14.5).all()
    # no friction is above that of what rolls
    assert -led["chassis"].ax.min() < 0.95 * 386.4 * (1.0 + 1e-9)


def places(rows):
    """Centres of a pile of discs of radius 1, and its contacts: (i, j), −1 the floor."""
    centres = [
        (2 * n + row, 1 + row * math.sqrt(3.0)) for row in range(rows) for n in range(3 - row)
    ]
    pairs = [(-1, n) for n, (_, y) in enumerate(centres) if y < 1.5]
    every = itertools.combinations(range(len(centres)), 2)
    pairs += [(i, j) for i, j in every if math.dist(centres[i], centres[j]) < 2.001]
    return np.array(centres), pairs


def holds(mu):
    """Whether there are any forces within the cones that hold the pile: a linear program."""
    centres, pairs = places(3)
    balance = np.zeros((3 * len(centres), 2 * len(pairs)))
    for k, (i, j) in enumerate(pairs):
        normal = np.array([0.0, 1.0]) if i < 0 else (centres[j] - centres[i]) / 2.0
        for part, way in enumerate((normal, np.array([normal[1], -normal[0]]))):
            for body, sign in ((i, -1.0), (j, 1.0)):
                if body >= 0:
                    arm = -sign * normal
                    turning = arm[0] * way[1] - arm[1] * way[0]
                    balance[3 * body : 3 * body + 3, 2 * k + part] = [*(sign * way), sign * turning]
    weights = np.tile([0.0, 1.0, 0.0], len(centres))
    cones = np.kron(np.eye(len(pairs)), [[-mu, 1.0], [-mu, -1.0]])
    bounds = [(0.0, None), (None, None)] * len(pairs)
    zero = np.zeros(len(cones))
    found = linprog(
        np.zeros(2 * len(pairs)), cones, zero, balance, weights, bounds=bounds, method="highs"
    )
    return found.status == 0


def test_a_pile_of_discs_stands_by_friction():
    """The limit of its source is that of a linear program of all forces."""
    assert holds(0.4341) and not holds(0.4339)
    stands, falls = (mbody.simulate(gallery.load("pile_of_discs", {"mu": mu})) for mu in (0.6, 0.4))
    weight = 6 * 2.0 * G
    # impulses are found to 1e-8 of the greatest
    np.testing.assert_allclose(stands.contact("floor"), weight, rtol=1e-6)
    assert stands["c1"].y[0] - stands["c1"].y[-1] < 1e-9
    assert falls["c1"].y[0] - falls["c1"].y[-1] > 0.05


@pytest.mark.parametrize(("part", "stands"), [(1.01, True), (0.99, False)])
def test_three_of_the_discs_stand_from_the_tangent_of_fifteen_degrees_on(part, stands):
    text = to_toml(gallery.load("pile_of_discs", {"mu": part * math.tan(math.radians(15.0))}))
    text = text[: text.index("[measures]")] + text[text.index("[simulate]") :]
    for gone in ("a3", "b2", "c1"):
        text = re.sub(rf"\n\[bodies\.{gone}\].*?(?=\n\[)", "\n", text, flags=re.DOTALL)
    run = mbody.simulate(from_toml(text), 0.2)
    fallen = run["b1"].y[0] - run["b1"].y[-1]
    assert fallen < 1e-9 if stands else fallen > 1e-5


def test_the_first_instant_alone_of_steps_with_impulses():
    """As with a second instant: the forces are those of the first step."""
    machine = gallery.load("pile_of_discs")
    alone, more = (mbody.simulate(machine, times=times) for times in ([0.0], [0.0, 0.002]))
    assert len(alone) == 1
    np.testing.assert_array_equal(alone.contact("floor"), more.contact("floor")[:1])
    np.testing.assert_array_equal(alone["c1"].y, more["c1"].y[:1])
