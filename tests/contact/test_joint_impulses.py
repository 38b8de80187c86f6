"""Friction of joints at impacts, by the impulse of their reactions: closed forms."""

import math

import numpy as np
import pytest

import mbody

G = 9.81


def rotor(size, mass, friction=0.5, restitution=0.5, omega=40.0, law="poisson"):
    """A rotor in a rough pin on a carrier that lands."""
    machine = mbody.Mechanism(
        "rotor",
        ground={"O": (0.0, 0.0), "F": (0.0, -size)},
        ground_shapes={"floor": {"line": {"point": "F"}}},
    )
    at = {"P": (0.0, 0.0)}
    up = math.pi / 2.0
    machine.add(
        mbody.Body("carrier", mass=3.0 * mass, inertia=0.1 * mass * size**2, points=at),
        mbody.Body("rotor", mass=2.0 * mass, inertia=0.05 * mass * size**2, points=at),
        mbody.Prismatic(
            "guide", mbody.Marker("ground", (0.0, 0.0), up), mbody.Marker("carrier", (0.0, 0.0), up)
        ),
        mbody.Revolute("pin", "carrier.P", "rotor.P", friction=friction, pin_radius=0.04 * size),
        mbody.Contact("hit", "ground.floor", "carrier.P", restitution=restitution, law=law),
        mbody.Gravity("gravity", y=-G * size),
    )
    start = {"carrier": {"y": 0.0, "vy": 0.0}, "rotor": {"angle": 0.0, "omega": omega}}
    machine.simulation = mbody.SimulationSettings(0.46, start)
    return machine


@pytest.mark.parametrize("size", [1e-3, 1.0])
@pytest.mark.parametrize("mass", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("law", ["poisson", "newton"])
def test_a_pin_takes_the_part_of_its_impulse(size, mass, law):
    """J Δω = −ρ m Δv with ρ = μ r/√(1 + μ²), Δv = (1 + e) √(2 g h); no impulse from the floor turns
    the rotor otherwise.
    """
    run = mbody.simulate(rotor(size, mass, law=law), rtol=1e-12)
    (event,) = (one for one in run.events if one.name == "impact")
    before, after = (state["rotor"].omega[0] for state in (event.state, event.after))
    rho = 0.5 * 0.04 * size / math.sqrt(1.25)
    change = 1.5 * math.sqrt(2.0 * G * size * size)
    assert before - after == pytest.approx(rho * 2.0 * change / (0.05 * size**2), rel=1e-10)
    assert run.status == "completed" and not run.doubts
    assert np.abs(run.energy.balance).max() <= 1e-9 * run.energy.size
    # what friction in the pin took at the impact is in its work
    taken = 0.025 * mass * size**2 * (before**2 - after**2)
    assert run.energy.lost["pin"][-1] == pytest.approx(taken, rel=1e-9)
    assert not any("impulse of its own" in note for note in run.notes)


def pendulum(friction, speed=2.0):
    """A pendulum at rest in a rough pin, that a ball strikes at a distance d from it."""
    machine = mbody.Mechanism("struck", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body(
            "rod",
            mass=1.5,
            inertia=0.2,
            cg=(0.0, -0.6),
            points={"P": (0.0, 0.0), "A": (0.0, 0.0), "B": (0.0, -2.0)},
            shapes={"face": {"segment": ["A", "B"]}},
        ),
        mbody.Body("ball", mass=0.7, inertia=0.01, points={"C": (0.0, 0.0)}),
        mbody.Revolute("pin", "ground.O", "rod.P", friction=friction, pin_radius=0.08),
        mbody.Contact("hit", "rod.face", "ball.C", restitution=0.0),
    )
    start = {
        "rod": {"angle": 0.0, "omega": 0.0},
        "ball": {"x": 0.3, "y": -1.1, "vx": -speed, "vy": 0.0},
    }
    machine.simulation = mbody.SimulationSettings(0.2, start)
    return machine


@pytest.mark.parametrize("friction", [0.0, 0.3, 2.0, 50.0])
def test_a_pendulum_that_is_struck_at_a_distance(friction):
    """Momentum of both bodies by hand: of both directions of the reaction one fits."""
    run = mbody.simulate(pendulum(friction), rtol=1e-12)
    event = next(one for one in run.events if one.name in ("impact", "rest"))
    m, J, c, d, M, u = 1.5, 0.2, 0.6, 1.1, 0.7, 2.0
    rho, found = 0.08 * friction / math.sqrt(1.0 + friction**2), []
    J += m * c * c
    for sign in (1.0, -1.0):  # of the reaction R = m c w - L; rod and ball go on together
        # J w = L d - rho sign R,  M (d w - u) = -L
        A = np.array([[J + rho * sign * m * c, -d - rho * sign], [M * d, 1.0]])
        w, L = np.linalg.solve(A, [0.0, M * u])
        if sign * (m * c * w - L) >= 0.0 and w >= 0.0 and L >= 0.0:
            found.append(w)
    (w,) = set(found)
    assert -event.after["rod"].omega[0] == pytest.approx(w, rel=1e-10, abs=1e-12)
    assert not run.doubts


@pytest.mark.parametrize("friction", [0.0, 0.4, 3.0])
@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_a_rod_that_strikes_turns_in_its_pin_until_it_stops(friction, restitution):
    """Friction opposes the turning through the compression, then through the expansion, each time
    by the reaction of that phase: Poisson's law of one freedom by hand.
    """
    machine = mbody.Mechanism(
        "rod", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    m, c, d, own = 1.5, 0.4, 1.3, 0.2
    points = {"P": (0.0, 0.0), "B": (d, 0.0)}
    machine.add(
        mbody.Body("rod", mass=m, inertia=own, cg=(c, 0.0), points=points),
        mbody.Revolute("pin", "ground.O", "rod.P", friction=friction, pin_radius=0.08),
        mbody.Contact("hit", "ground.floor", "rod.B", restitution=restitution),
    )
    start = {"rod": {"angle": 0.3, "omega": -3.0}}
    machine.simulation = mbody.SimulationSettings(0.3, start, rtol=1e-12)
    run = mbody.simulate(machine)
    event = next(one for one in run.events if one.name == "impact")
    before, after = -event.state["rod"].omega[0], event.after["rod"].omega[0]
    rho, J = 0.08 * friction / math.sqrt(1.0 + friction**2), own + m * c * c
    # J w = N d + rho R with R = m c w - N > 0, as the tip is beyond the centre of percussion
    N = (J - rho * m * c) * before / (d - rho)
    # J u = e N d - rho R with R = m c u - e N > 0
    up = restitution * N * (d + rho) / (J + rho * m * c)
    assert m * c * before > N and m * c * up >= restitution * N
    assert after == pytest.approx(up, rel=1e-9, abs=1e-12)
    assert not run.doubts
    assert 0.5 * J * (before**2 - after**2) >= -1e-12 * before**2


def pinned_at_the_end(turn):
    """A block that a force has pushed to the end of its guide when the rod pinned to it swings
    against the end of the pin; all of it turned.
    """
    machine = mbody.Mechanism("block and rod", ground={"O": (0.0, 0.0)})
    guide = mbody.Marker("ground", (0.0, 0.0), turn), mbody.Marker("block", (0.0, 0.0), 0.0)
    c, s = math.cos(turn), math.sin(turn)
    machine.add(
        mbody.Body("block", mass=1.0, inertia=0.1, points={"P": (0.0, 0.0)}),
        mbody.Body("rod", mass=0.5, inertia=0.02, cg=(0.4, 0.0), points={"P": (0.0, 0.0)}),
        mbody.Prismatic(
            "guide", *guide, friction=0.4, length=0.5, limits=(-1.0, 0.0), restitution=0.0
        ),
        mbody.Revolute(
            "pin", "block.P", "rod.P",
            friction=0.3, pin_radius=0.05, limits=(-2.0, -0.9), restitution=0.0,
        ),
        mbody.Force("push", "block", 2.0, angle=turn),
    )  # fmt: skip
    start = {"block": {"x": -0.05 * c, "y": -0.05 * s, "angle": turn}}
    start["rod"] = {"angle": turn - 2.0, "omega": 3.0}
    machine.simulation = mbody.SimulationSettings(0.45, start, rtol=1e-11)
    return machine


@pytest.mark.parametrize("turn", 0.3 + 0.7 * np.arange(4))
def test_friction_does_not_push_what_rests_at_an_end(turn):
    """The rod drives the block against its end: both stop. What rounding makes of the block's rate
    does not decide that its friction acts as of a block that arrives, which threw it off the end.
    """
    run = mbody.simulate(pinned_at_the_end(turn))
    events = [(one.name, one.contact) for one in run.events if one.name in ("impact", "open")]
    assert events == [("impact", "guide_high"), ("impact", "pin_high")]
    hit = next(one for one in run.events if one.contact == "pin_high")
    omega = hit.state["rod"].omega[0]
    assert max(abs(hit.after["block"].vx[0]), abs(hit.after["rod"].omega[0])) < 1e-12 * omega
    # (J + m c²) ω = P + ρ m c ω: the end of the pin and its friction, by the reaction of what stops
    rho, moment = 0.05 * 0.3 / math.hypot(1.0, 0.3), hit.impulse("pin_high")[0] * run.system.length
    assert moment == pytest.approx((0.1 - rho * 0.2) * omega, rel=1e-9)
    # the end of the guide or its friction: what stops the block may be either
    assert hit.shared == ("guide_high",)
    assert not [one for one in run.doubts if "outcomes" in one.message]
