"""The account of energy of motions with impacts, contacts and frictional joints: what was lost is
the sum of what each took, and the balance closes to 1e-9 of the energy that was moved.
"""

import functools

import numpy as np

import mbody
from mbody.laws import Table
from tests.support.cases import first_fast

G = 9.81


def falling(seed):
    """A chain of one or two links on pins with friction, with a disc or corners at its end, that
    falls on a rough floor and swings towards a wall, with a spring at its first link.
    """
    rng = np.random.default_rng([seed, 31])
    u = rng.uniform
    machine = mbody.Mechanism(
        f"falling chain {seed}",
        ground={"O": (0.0, 0.0), "P": (0.0, float(u(0.35, 0.45))), "W": (float(u(1.3, 1.5)), 0.0)},
        ground_shapes={
            "floor": {"line": {"point": "O", "angle": float(u(-0.2, 0.2))}},
            "wall": {"line": {"point": "W", "angle": 0.5 * np.pi}},
        },
    )
    links = int(rng.integers(1, 3))
    mu = float(u(0.05, 0.4))
    here, before, turn = (0.0, machine.ground.points["P"][1]), "ground.P", float(u(0.3, 0.6))
    for n in range(links):
        turn += float(u(-0.3, 0.3))
        length = float(u(0.4, 0.6))
        corners = {"A": (0.0, 0.0), "B": (length, 0.0), "C": (length, 0.1), "D": (length, -0.1)}
        disc = {"disc": "B", "radius": 0.05}
        end = disc if rng.random() < 0.5 else {"polygon": ["A", "D", "C"]}
        machine.add(
            mbody.Body(
                f"b{n}",
                mass=float(u(0.5, 2.0)),
                inertia=float(u(0.01, 0.1)),
                cg=(0.5 * length, 0.0),
                points=corners,
                shapes={"end": end},
                guess=(*(float(part) for part in here), turn),
            )
        )
        radius = float(u(0.01, 0.05))
        machine.add(mbody.Revolute(f"j{n}", before, f"b{n}.A", friction=mu, pin_radius=radius))
        here = here[0] + length * np.cos(turn), here[1] + length * np.sin(turn)
        before = f"b{n}.B"
    law = {
        "friction": float(u(0.0, 0.6)),
        "restitution": float(rng.choice([0.0, 0.3, 0.7])),
        "law": str(rng.choice(["poisson", "newton"])),
    }
    last = f"b{links - 1}.end"
    machine.add(mbody.Contact("floor", "ground.floor", last, **law))
    machine.add(mbody.Contact("wall", "ground.wall", last, **law))
    machine.add(mbody.TorsionSpring("spring", "b0", stiffness=float(u(0.0, 3.0))))
    machine.add(mbody.Gravity("gravity", y=-G))
    machine.simulation = mbody.SimulationSettings(until=0.6, rtol=1e-12)
    return machine


@functools.cache
def moved(seed):
    """Its motion, made once."""
    return mbody.simulate(falling(seed))


def lost(run):
    """What was lost in all."""
    return sum(run.energy.lost.values())


@first_fast("seed", range(10), 3)
def test_lost_is_the_sum_of_all(seed):
    run = moved(seed)
    energy = run.energy
    assert run.status == "completed", run.status
    assert np.abs(energy.balance).max() <= 1e-9 * energy.size
    assert np.abs(lost(run) - energy.dissipated).max() <= 1e-9 * energy.size
    # what is left is what there was, less all losses: another sum than the account's
    whole = energy.kinetic + energy.potential
    assert np.abs(whole - whole[0] + lost(run)).max() <= 1e-9 * energy.size
    # at impacts what turns round may gain what others lose beside it
    struck = [one.t for one in run.events if one.name in ("impact", "rest")]
    between = np.diff(np.searchsorted(struck, run.t)) == 0
    assert (np.diff(lost(run)) >= -1e-12 * energy.size).all()
    for name, part in energy.lost.items():
        if name.startswith("j"):
            assert (np.diff(part)[between] >= -1e-12 * energy.size).all()


def test_the_motions_have_impacts_and_losses_everywhere():
    """What is compared is something: impacts in most of them, and joints and contacts that take."""
    runs = [moved(seed) for seed in range(10)]
    struck = [run for run in runs if any(event.name == "impact" for event in run.events)]
    assert len(struck) >= 6
    for part in ("j0", "floor"):
        assert sum(float(run.energy.lost[part][-1]) > 1e-3 * run.energy.size for run in runs) >= 4


def test_friction_of_joints_without_impulse_is_said():
    """Where the rate of a driver jumps joints and drivers alone decide what follows."""
    rate = Table([0.0, 0.5, 1.0], [0.0, 0.0, 0.5], interpolation="linear")
    machine = mbody.Mechanism("cart", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("cart", mass=1.0, inertia=0.1, points={"P": (0.0, 0.0)}),
        mbody.Body("arm", mass=1.0, inertia=0.05, cg=(0.0, -0.5), points={"A": (0.0, 0.0)}),
        mbody.Prismatic("guide", "ground.O", "cart.P"),
        mbody.Revolute("pin", "cart.P", "arm.A", friction=0.2, pin_radius=0.02),
        mbody.CoordinateDriver("drive", "ground.O", "cart.P", rate),
        mbody.Gravity("gravity", y=-G),
    )
    short, long = (mbody.simulate(machine, until) for until in (0.4, 0.7))
    sentence = "friction in 'pin' has no impulse of its own where rates of drivers jump"
    assert sentence not in short.notes
    assert sentence in long.notes
