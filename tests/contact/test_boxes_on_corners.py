"""Boxes that stand on several corners, pushed by a force that grows with time."""

import numpy as np
import pytest

import mbody
from tests.support.cases import first_fast

G = 9.81
#: A force begins at nothing and grows by so much [N/s].
RATE = 20.0
GROUNDS = {
    "line": '{ line = { point = "O", angle = 0 } }',
    "segment": '{ segment = ["L", "R"] }',
    "polygon": '{ polygon = ["P", "Q", "R", "L"] }',
}


def stack(widths, masses, frictions, *, ground="line", until=2.2, high=0.0):
    """One box upon the other, each 0.2 m high, the lowest pushed to the right `high` above its
    foot.
    """
    text = [
        'name = "boxes"\nangle = "rad"\n[ground]',
        "points = { O = [0, 0], L = [-20, 0], R = [20, 0], P = [-20, -1], Q = [20, -1] }",
        f"shapes = {{ floor = {GROUNDS[ground]} }}",
    ]
    contacts, start, below = ["[contacts]"], [], "ground.floor"
    for n, (w, m, mu) in enumerate(zip(widths, masses, frictions, strict=True)):
        corners = f"A = [{-w / 2}, 0], B = [{w / 2}, 0], C = [{w / 2}, 0.2], D = [{-w / 2}, 0.2]"
        text += [
            f"[bodies.b{n}]\nmass = {m}\ninertia = {m * (w * w + 0.04) / 12}\ncg = [0, 0.1]",
            f"points = {{ {corners}, H = [{-w / 2}, {high}] }}",
            'shapes = { box = { polygon = ["A", "B", "C", "D"] } }',
        ]
        contacts.append(f'c{n} = {{ contact = ["{below}", "b{n}.box"], friction = {mu} }}')
        start.append(f'b{n} = {{ x = 0, y = {0.2 * n}, angle = "0 rad" }}')
        below = f"b{n}.box"
    text += [
        *contacts,
        f'[loads]\npush = {{ force = "{RATE} N/s*t", at = "b0.H", angle = "0 rad" }}',
        f"[gravity]\ny = {-G}",
        f"[simulate]\nuntil = {until}\nrtol = 1e-10\nstart = {{ {', '.join(start)} }}",
    ]
    return mbody.from_toml("\n".join(text))


def events(run):
    return [(one.name, one.contact, float(one.t)) for one in run.events]


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("high", [0.0, 0.07, 0.2])
def test_a_box_slides_on_all_its_corners_where_the_force_exceeds_friction(ground, high):
    """At μ m g/rate; then x = rate (t − t₁)³/(6 m)."""
    run = mbody.simulate(stack([1.0], [5.0], [0.3], ground=ground, high=high))
    first = 0.3 * 5.0 * G / RATE
    assert run.status == "completed"
    assert events(run) == [("slip", "c0", pytest.approx(first, abs=1e-12))]
    since = np.maximum(run.t - first, 0.0)
    assert run["b0"].x == pytest.approx(RATE * since**3 / (6.0 * 5.0), abs=1e-11)
    assert run.reaction("c0").fy == pytest.approx(5.0 * G, rel=1e-11)
    assert run.energy.error < 1e-10


def test_a_box_tips_where_friction_holds():
    """Pushed at the top of its side: over its leading corner at m g w/(2 h rate), to which its
    weight and the push are in balance.
    """
    run = mbody.simulate(stack([0.1], [5.0], [0.9], high=0.2, until=0.75))
    first = 5.0 * G * 0.1 / (2.0 * 0.2 * RATE)
    still = run.t < first
    assert not run.events
    assert np.abs(run["b0"].angle[still]).max() < 1e-14
    assert (run["b0"].angle[run.t > first + 0.01] < 0.0).all()
    # J θ̈ = −(rate (t − t₁)) h about the corner, as long as the angle is small
    inertia = 5.0 * (0.01 + 0.04) / 12.0 + 5.0 * (0.05**2 + 0.1**2)
    soon = np.flatnonzero(run.t > first)[:3]
    expected = -RATE * 0.2 * (run.t[soon] - first) ** 3 / (6.0 * inertia)
    # the weight's arm grows with the angle: 5·9.81·0.1/J of it, times (Δt)²/20
    assert run["b0"].angle[soon] == pytest.approx(expected, rel=5e-3)
    # of 0.06 J, where heights are followed to 1e-11 m of a weight of 49 N
    assert run.energy.error < 1e-8


def leaning_stack(rng, count):
    """Boxes of random size that do not stand in the middle of each other, one of them pushed at a
    corner; without rebounds.
    """
    text = [
        'name = "boxes"\nangle = "rad"\n[ground]\npoints = { O = [0, 0] }',
        f"shapes = {{ floor = {GROUNDS['line']} }}",
    ]
    contacts, start, x, y, below = ["[contacts]"], [], 0.0, 0.0, "ground.floor"
    for n in range(count):
        w, h, m = rng.choice([0.3, 0.4, 0.5]), rng.choice([0.1, 0.2, 0.3]), rng.choice([1.0, 2.0])
        mu = rng.uniform(0.1, 0.7)
        corners = f"A = [{-w / 2}, 0], B = [{w / 2}, 0], C = [{w / 2}, {h}], D = [{-w / 2}, {h}]"
        text += [
            f"[bodies.b{n}]\nmass = {m}\ninertia = {m * (w * w + h * h) / 12}\ncg = [0, {h / 2}]",
            f"points = {{ {corners} }}",
            'shapes = { box = { polygon = ["A", "B", "C", "D"] } }',
        ]
        for k, one in enumerate(dict.fromkeys([below, "ground.floor"])):
            ends = f'contact = ["{one}", "b{n}.box"], friction = {mu}, restitution = 0'
            contacts.append(f"c{n}{k} = {{ {ends} }}")
        start.append(f'b{n} = {{ x = {x}, y = {y}, angle = "0 rad" }}')
        x, y, below = x + rng.choice([-0.1, -0.05, 0.0, 0.05, 0.1]), y + h, f"b{n}.box"
    force, corner = rng.choice([-1.0, 1.0]) * rng.uniform(10.0, 40.0), rng.choice(list("ABCD"))
    law = f"{force} N*sin(6 rad/s*t)"
    text += [
        *contacts,
        f'[loads]\npush = {{ force = "{law}", at = "b{rng.integers(count)}.{corner}", angle = 0 }}',
        f"[gravity]\ny = {-G}",
        f"[simulate]\nuntil = 0.5\nrtol = 1e-9\nstart = {{ {', '.join(start)} }}",
    ]
    return mbody.from_toml("\n".join(text))


@first_fast("seed", range(8), 2)
def test_random_stacks_move_as_steps_with_impulses_do(seed):
    """Two solvers that share no decision: located events, and steps of 0.1 ms without any, whose
    error is of the order of the step.
    """
    machine = leaning_stack(np.random.default_rng(seed), 1 + seed % 3)
    run = mbody.simulate(machine)
    steps = mbody.simulate(machine, method="moreau", step=1e-4)
    assert run.status == steps.status == "completed"
    assert run.energy.error < 1e-7
    for body in (one.name for one in machine.bodies):
        for part in ("x", "y", "angle"):
            own, other = (getattr(one[body], part) for one in (run, steps))
            assert np.interp(run.t, steps.t, other) == pytest.approx(own, abs=2e-3)


def test_derivatives_of_a_box_that_begins_to_slide():
    """By static friction, through t₁ alone, by sliding friction and by mass, against the closed
    form x(t₁, μ, m); the time of the slip itself is μ₀ m g/rate.
    """
    m, mu, most, until = 5.0, 0.25, 0.3, 2.2
    machine = stack([1.0], [m], [mu], ground="polygon", until=until)
    text = mbody.to_toml(machine).replace("friction = 0.25", "friction = 0.25, static = 0.3")
    by = ["c0.static", "c0.friction", "b0.mass"]
    found = mbody.gradient(mbody.from_toml(text), "last(b0.x)", by=by, analysis="simulate")
    first = most * m * G / RATE
    by_first = RATE / m * (first * first - first * until) + mu * G * (until - first)
    moved = until**3 - 3.0 * first**2 * until + 2.0 * first**3
    expected = [
        by_first * m * G / RATE,
        -0.5 * G * (until - first) ** 2,
        by_first * most * G / RATE - RATE * moved / (6.0 * m * m),
    ]
    assert found.jacobian[0] == pytest.approx(expected, rel=1e-9)
    (slip,) = found.events
    assert [slip.by[name] for name in by] == pytest.approx(
        [m * G / RATE, 0.0, most * G / RATE], rel=1e-9
    )
