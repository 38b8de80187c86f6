"""What nothing joins to a part has no say in it: heavy, light, far, small and great ones beside it;
light bodies that are joined to heavy ones keep their own equations.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    Damper,
    Force,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Simulator,
    Simulators,
    Spring,
    assemble,
    equilibrium,
    kinetostatics,
    modes,
    simulate,
)
from mbody.kernels.layout import artificial_masses, inverse_masses

# mass, length and place of what stands beside
BESIDE = [(3e-12, 1.0, 3.0), (2e11, 1.0, 3.0), (1.0, 1.0, 7e5), (1.0, 4e-6, 0.0), (1.0, 3e5, 0.0)]


def pendulum(name, mass, length, place):
    """A pendulum on a spring, as (elements, points of the ground, start)."""
    weight, pace = 9.81 * mass, (9.81 / length) ** 0.5
    rod = Body(name, mass=mass, inertia=mass * length**2 / 9, cg=(0.6 * length, 0.1 * length))
    elements = [
        rod,
        Revolute(f"{name}O", f"ground.{name}G", name),
        Spring(f"{name}S", f"ground.{name}H", name, stiffness=weight / length),
        Damper(f"{name}D", f"ground.{name}H", name, coefficient=0.1 * weight / (pace * length)),
    ]
    points = {f"{name}G": (place, 0.0), f"{name}H": (place + length, -0.5 * length)}
    return elements, points, {name: {"angle": -0.4, "omega": 0.7 * pace}}


def machine(*parts):
    points, start, elements = {}, {}, [Gravity("gravity", y=-9.81)]
    for part in parts:
        own, ground, first = pendulum(*part)
        elements += own
        points |= ground
        start |= first
    made = Mechanism("parts", ground=points)
    made.add(*elements)
    made.simulation = SimulationSettings(until=0.9, start=start, instants=4)
    return made


@pytest.fixture(scope="module")
def alone():
    return machine(("a", 1.3, 1.0, 0.0))


@pytest.mark.parametrize("beside", BESIDE)
@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_motion_beside_others(alone, beside, method):
    expected = simulate(alone, method=method)
    run = simulate(machine(("a", 1.3, 1.0, 0.0), ("b", *beside)), method=method)
    assert run.status == "completed"
    assert_allclose(run["a"].angle, expected["a"].angle, rtol=1e-7)
    assert_allclose(run["a"].alpha, expected["a"].alpha, rtol=1e-6)
    assert_allclose(run.reaction("aO").fx, expected.reaction("aO").fx, rtol=1e-6)


@pytest.mark.parametrize("beside", BESIDE[:3])
def test_steppers_beside_others(alone, beside):
    both = machine(("a", 1.3, 1.0, 0.0), ("b", *beside))
    one, other = Simulator(alone), Simulator(both)
    one.until(0.5), other.until(0.5)
    assert_allclose(other["a"].angle, one["a"].angle, rtol=1e-7)
    lanes = Simulators(both, 3)
    lanes.step(0.5)
    assert_allclose(lanes["a"].angle, one["a"].angle, rtol=1e-4)


@pytest.mark.parametrize("beside", BESIDE)
def test_equilibria_and_modes_beside_others(alone, beside):
    def found(model):
        rest = equilibrium(model)
        turned = {round(float(one.solution["a"].angle[-1]) % (2 * np.pi), 7) for one in rest}
        stable = next(one for one in rest if one.stability == "stable")
        roots = [m.eigenvalue for m in modes(model, at=stable)[0] if m.leader == "a"]
        return sorted(turned), roots

    angles, roots = found(alone)
    others, same = found(machine(("a", 1.3, 1.0, 0.0), ("b", *beside)))
    assert_allclose(others, angles, atol=1e-6)
    assert_allclose(same, roots, rtol=1e-6)


@pytest.mark.parametrize("inertia", [7e-13, 40.0, 3e5, 2e13])
def test_a_block_beside_a_flywheel(inertia):
    made = Mechanism("block")
    made.add(
        Body("block", mass=2.0, inertia=0.03, points={"C": (0.02, 0.0)}),
        Body("wheel", mass=0.7, inertia=inertia),
        Prismatic("guide", "ground", "block.C"),
        Revolute("shaft", "ground", "wheel"),
        Force("push", "block", 5.0),
    )
    made.simulation = SimulationSettings(until=0.8, start={"block": {"x": 0.0}})
    run = simulate(made)
    # F t²/2m, whatever stands beside
    assert run.status == "completed"
    assert_allclose(run["block"].x[-1] - run["block"].x[0], 5.0 * 0.8**2 / 4.0, rtol=1e-12)


@pytest.mark.parametrize("mass", [2e-7, 3e-11, 4e-15, 1e-21])
def test_a_light_pendulum_on_a_heavy_one(mass):
    """Its limit without mass: the heavy one moves alone, and the light one as its hinge does."""

    def double(light):
        made = Mechanism("double")
        made.add(
            Body("heavy", mass=3.0, inertia=0.2, cg=(0.4, 0.0), points={"E": (0.9, 0.0)}),
            Body("light", mass=light, inertia=0.06 * light, cg=(0.3, 0.0)),
            Revolute("O", "ground", "heavy"),
            Revolute("A", "heavy.E", "light"),
            Gravity("gravity", y=-9.81),
        )
        start = {"heavy": {"angle": -0.3}, "light": {"angle": -0.9}}
        made.simulation = SimulationSettings(until=0.7, start=start, instants=3)
        return made

    run, limit = simulate(double(mass)), simulate(double(1e-9))
    assert run.status == "completed"
    assert_allclose(run["light"].angle, limit["light"].angle, atol=1e-6)
    assert_allclose(run.reaction("A").fy / mass, limit.reaction("A").fy / 1e-9, rtol=1e-4)


@pytest.mark.parametrize("mass", [3e-8, 2e-11, 5e-14, 1e-18])
def test_a_light_coupler_passes_what_heavy_links_exert(mass):
    def made(coupler):
        frame = Mechanism("four-bar", ground={"O": (0.0, 0.0), "C": (3.2, 0.0)})
        frame.add(
            Body("crank", mass=1.1, inertia=0.2, cg=(0.5, 0.0), points={"A": (1.0, 0.0)}),
            Body(
                "coupler",
                mass=coupler,
                inertia=0.8 * coupler,
                cg=(1.4, 0.2),
                points={"B": (2.9, 0.0)},
            ),
            Body("rocker", mass=2.3, inertia=0.6, cg=(1.0, 0.0), points={"B": (2.2, 0.0)}),
            Revolute("O", "ground.O", "crank"),
            Revolute("A", "crank.A", "coupler"),
            Revolute("B", "coupler.B", "rocker.B"),
            Revolute("C", "ground.C", "rocker"),
            Gravity("gravity", y=-9.81),
        )
        frame.simulation = SimulationSettings(until=0.6, start={"crank": {"angle": 0.4}})
        return frame

    run, without = simulate(made(mass)), simulate(made(0.0))
    assert run.status == "completed"
    assert_allclose(run["crank"].angle[-1], without["crank"].angle[-1], atol=1e-7)
    assert_allclose(run.reaction("A").fx[-1], without.reaction("A").fx[-1], rtol=1e-6)


def test_light_links_that_move_by_themselves_in_a_loop_are_said_to_be_lost():
    def five_bar(light):
        made = Mechanism("five-bar", ground={"O": (0.0, 0.0), "C": (2.0, 0.0)})
        sizes = {"a": (light, 1.0), "b": (light, 1.5), "c": (light, 1.6), "d": (1.0, 1.1)}
        made.add(
            *(
                Body(n, mass=m, inertia=m * l**2 / 12, cg=(l / 2, 0.0), points={"E": (l, 0.0)})
                for n, (m, l) in sizes.items()
            ),
            Revolute("O", "ground.O", "a"),
            Revolute("A", "a.E", "b"),
            Revolute("B", "b.E", "c.E"),
            Revolute("D", "c", "d.E"),
            Revolute("C", "ground.C", "d"),
            Gravity("gravity", y=-9.81),
        )
        start = {"a": {"angle": 1.2}, "d": {"angle": 1.5}}
        made.simulation = SimulationSettings(until=0.4, start=start, instants=3)
        return made

    limit = simulate(five_bar(1e-7))
    assert_allclose(simulate(five_bar(1e-10))["a"].angle, limit["a"].angle, atol=1e-6)
    lost = simulate(five_bar(1e-14))
    assert "whose mass is lost" in lost.status


def test_artificial_masses_are_of_what_a_body_is_joined_to():
    made = Mechanism("massless", ground={"C": (4.0, 0.0)})
    made.add(
        Body("rod", mass=2.0, inertia=0.5, cg=(0.5, 0.0), points={"A": (1.0, 0.0)}),
        Body("link", cg=(0.5, 0.0), points={"B": (1.0, 0.0)}),
        Body("bob", mass=1e-3, inertia=1e-4, cg=(0.5, 0.0)),
        Body("great", mass=1e9, inertia=1e9),
        Revolute("O", "ground", "rod"),
        Revolute("A", "rod.A", "link"),
        Revolute("B", "link.B", "bob"),
        Revolute("C", "ground.C", "great"),
    )
    system = assemble(made)
    weights = inverse_masses(system.layout, system.mass, system.sizes)[:, 0].reshape(-1, 3)
    # of rod and bob the lighter one; the great wheel is joined to neither
    assert_allclose(1.0 / weights[1], np.array([1.0, 1.0, 0.25]) * 1e-7 * 1e-3, rtol=1e-12)
    assert_allclose(1.0 / weights[[0, 2, 3], 0], [2.0, 1e-3, 1e9])
    assert artificial_masses(system.layout, system.mass, system.sizes).all()


def start_of(x, which):
    made = Mechanism("thrown", ground={"O": (0.0, 0.0)})
    made.add(
        Body("a", mass=1.0, inertia=0.1, cg=(0.4, 0.0), points={"P": (0.8, 0.0)}),
        Body("b", mass=2.0, inertia=0.2, cg=(0.3, 0.1)),
        Body("swing", mass=1.0, inertia=0.1, cg=(0.7, 0.0)),
        Revolute("J", "a.P", "b"),
        Revolute("O", "ground.O", "swing"),
        Gravity("gravity", y=-9.81),
    )
    start = {"a": {"angle": 0.3}, "b": {"angle": 1.0}, "swing": {"angle": 0.2}}
    start[which] |= {"x": x, "y": -0.5 * x}
    made.simulation = SimulationSettings(until=0.4, start=start, instants=2)
    return made


@pytest.mark.parametrize("which", ["a", "b"])
@pytest.mark.parametrize("x", [43.0, -8e5])
def test_what_nothing_joins_to_the_ground_begins_anywhere(x, which):
    run, near = simulate(start_of(x, which)), simulate(start_of(0.0, which))
    assert run.status == "completed" and not run.notes
    for name in ("a", "b", "swing"):
        assert_allclose(run[name].angle, near[name].angle, atol=1e-8)
    moved = run["b"].x - run["b"].x[0] - (near["b"].x - near["b"].x[0])
    assert_allclose(moved, 0.0, atol=1e-8)


def test_a_slider_begins_anywhere_on_its_guide():
    made = Mechanism("slider")
    made.add(
        Body("slider", mass=1.0, inertia=1.0, points={"P": (0.1, 0.0)}),
        Body("rod", mass=0.5, inertia=0.02, cg=(0.2, 0.0)),
        Prismatic("guide", "ground", "slider.P"),
        Revolute("hinge", "slider", "rod"),
        Gravity("gravity", x=2.0),
    )
    made.simulation = SimulationSettings(0.5, {"rod": {"x": 9e4, "angle": 0.0}}, instants=2)
    run = simulate(made)
    assert_allclose(run["slider"].x, 9e4 + np.array([0.0, 0.25]), rtol=1e-14)


@pytest.mark.parametrize("x", [3e-13, 1e-9, 2e-6])
def test_a_start_that_is_nearly_at_the_origin(x):
    made = Mechanism("ball")
    made.add(Body("ball", mass=1.5, inertia=0.01), Gravity("gravity", y=-9.81))
    made.simulation = SimulationSettings(0.5, {"ball": {"x": x, "y": 0.0, "angle": 0.0}})
    run = simulate(made)
    assert run.status == "completed"
    assert_allclose(run["ball"].y[-1], -9.81 / 8.0, rtol=1e-12)


@pytest.mark.parametrize("mass", [1e-11, 1e10])
def test_forces_of_a_driven_part_beside_others(mass):
    def driven(*masses):
        made = Mechanism("driven", ground={"O": (0.0, 0.0), "Q": (5.0, 0.0)})
        for n, own in enumerate(masses):
            made.add(Body(f"arm{n}", mass=own, inertia=0.1 * own, cg=(0.5, 0.0)))
            made.add(Revolute(f"pin{n}", f"ground.{'OQ'[n]}", f"arm{n}"))
            made.add(AngleDriver(f"motor{n}", f"arm{n}", "0.2 rad + 2 rad/s*t"))
        made.add(Gravity("gravity", y=-9.81))
        return made

    one, both = (kinetostatics(driven(*m), t=[0.0, 0.3]) for m in ((1.7,), (1.7, mass)))
    assert both.status == "completed"
    assert_allclose(both.effort("motor0"), one.effort("motor0"), rtol=1e-12)
