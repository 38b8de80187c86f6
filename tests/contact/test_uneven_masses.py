"""Bodies that touch and whose masses differ by many powers of ten: forces on the heavy cancel on
the light.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Gravity, Mechanism
from mbody.analysis.dynamics.integration import Integration
from tests.campaign.scenes import uneven_scene

G = 9.81


def box(name: str, mass: float, width: float, height: float) -> Body:
    half = {"P0": (-1, -1), "P1": (1, -1), "P2": (1, 1), "P3": (-1, 1)}
    points = {k: (0.5 * width * x, 0.5 * height * y) for k, (x, y) in half.items()}
    return Body(
        name,
        mass=mass,
        inertia=mass * (width**2 + height**2) / 12.0,
        points=points | {"C": (0.0, 0.0), "top": (0.0, 0.5 * height)},
        shapes={"box": {"polygon": list(half)}},
    )


def pile(*boxes: Body, heights: list[float], shifts: list[float], **more: object) -> Mechanism:
    machine = Mechanism(
        "pile",
        ground={"O": (0.0, 0.0)},
        ground_shapes={"floor": {"line": {"point": "O", "angle": 0.0}}},
    )
    machine.add(*boxes)
    names = [one.name for one in boxes]
    for below, above in zip(["ground.floor", *(f"{n}.box" for n in names)], names, strict=False):
        machine.add(Contact(f"under {above}", below, f"{above}.box", friction=0.6, **more))
    machine.add(Gravity("gravity", 0.0, -G))
    start, y = {}, 0.0
    for one, height, shift in zip(boxes, heights, shifts, strict=True):
        start[one.name] = {"x": shift, "y": y + 0.5 * height, "angle": 0.0}
        y += height
    machine.simulation = mbody.SimulationSettings(until=1.0, start=start)
    return machine


@pytest.mark.parametrize("light", [3e-2, 3e-5])
def test_a_light_body_under_a_heavy_one_rests_in_long_steps(
    light: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps, step = [], Integration._step

    def counted(motion: Integration) -> tuple[int, str]:
        steps.append(1)
        return step(motion)

    monkeypatch.setattr(Integration, "_step", counted)
    heavy = 7e5
    machine = pile(
        box("plate", light, 1.0, 0.2),
        box("block", heavy, 0.7, 0.5),
        heights=[0.2, 0.5],
        shifts=[0.0, 0.11],
    )
    run = mbody.simulate(machine, 1.0, rtol=1e-10, instants=5)
    assert (run.status, run.doubts) == ("completed", ())
    assert len(steps) < 40
    for name, weight in (("under plate", (heavy + light) * G), ("under block", heavy * G)):
        force = run.reaction(name)
        np.testing.assert_allclose(np.abs(force.fy), weight, rtol=1e-10)
        np.testing.assert_allclose(force.fx, 0.0, atol=1e-9 * weight)
    for body in ("plate", "block"):
        assert np.abs(run[body].ay).max() < 1e-9 * G
        assert np.abs(run[body].alpha).max() < 1e-9 * G


@pytest.mark.parametrize(
    ("seed", "told"),
    [
        (90111, "completed"),  # a ratio of 9e8: struck every 2e-10 s where modes were lost
        (90468, "no impact are consistent at 'floor a box', 'a b', 'b c', where masses differ by"),
        (90535, "the impulses at 'floor a box', 'a b' are lost in rounding"),
    ],
)
def test_what_uneven_masses_cost_is_said(seed: int, told: str) -> None:
    scene = uneven_scene(seed)
    run = mbody.simulate(scene.mechanism("stack"), scene.until, rtol=scene.rtol, instants=3)
    assert told in run.status


def test_a_massless_rim_of_a_heavy_disc_that_a_light_body_strikes_keeps_the_account() -> None:
    """The tangent has no inertia on one side: the impulse is along the line of centres alone."""
    m, M, v, r = 2e-2, 500.0, 3.0, 0.3
    machine = Mechanism("strike", ground={"O": (0.0, 0.0)})
    machine.add(
        Body(
            "ball",
            mass=m,
            inertia=0.1 * m * r * r,
            points={"C": (0, 0)},
            shapes={"rim": {"disc": "C", "radius": r}},
        ),
        Body(
            "wheel",
            mass=M,
            inertia=0.0,
            points={"C": (0, 0)},
            shapes={"rim": {"disc": "C", "radius": r}},
        ),
        Contact("hit", "ball.rim", "wheel.rim", friction=0.5, restitution=0.4),
    )
    start = {
        "ball": {"x": -1.0, "y": 0.3, "angle": 0.0, "vx": v, "omega": 5.0},
        "wheel": {"x": 0.0, "y": 0.0, "angle": 0.0, "omega": 20.0},
    }
    machine.simulation = mbody.SimulationSettings(until=1.0, start=start)
    run = mbody.simulate(machine, 0.5, rtol=1e-7, instants=3)
    assert (run.status, run.doubts) == ("completed", ())
    (hit,) = (one for one in run.events if one.name == "impact")
    normal, tangential = hit.impulses["hit"]
    approach = v * math.sqrt(1.0 - (0.3 / (2.0 * r)) ** 2)
    assert abs(normal) == pytest.approx(1.4 * approach * m * M / (m + M), rel=1e-6)
    assert abs(tangential) < 1e-5 * abs(normal)


@pytest.mark.parametrize(("light", "heavy"), [(1e-2, 1e2), (1e-5, 1e7)])
def test_what_is_squeezed_by_an_impact_rests(light: float, heavy: float) -> None:
    """Impulses of the floor and of a heavy disc cancel on a light one between them, to rounding
    that is a velocity of its own: there is one impact, after which neither comes nearer nor leaves.
    """
    machine = Mechanism(
        "squeezed", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    for name, mass, radius in (("light", light, 0.4), ("heavy", heavy, 0.2)):
        rim = {"rim": {"disc": "C", "radius": radius}}
        inertia = 0.4 * mass * radius**2
        machine.add(Body(name, mass=mass, inertia=inertia, points={"C": (0, 0)}, shapes=rim))
    machine.add(
        Contact("under", "ground.floor", "light.rim", friction=1.0),
        Contact("upon", "light.rim", "heavy.rim", friction=0.3),
        Gravity("g", y=-G),
    )
    lean, fall = 0.05, 1e-3
    x, y = 0.6 * math.sin(lean), 0.4 + 0.6 * math.cos(lean) + fall
    start = {"light": {"y": 0.4}, "heavy": {"x": x, "y": y, "vy": -1.0}}
    machine.simulation = mbody.SimulationSettings(until=1.2e-3, start=start)
    run = mbody.simulate(machine, 1.2e-3)
    assert (run.status, run.doubts) == ("completed", ())
    (event,) = run.events
    assert (event.name, event.contact) == ("impact", "upon")
    below, above = event.after["light"], event.after["heavy"]
    along = np.array([above.x[0] - below.x[0], above.y[0] - below.y[0]]) / 0.6
    apart = along @ [above.vx[0] - below.vx[0], above.vy[0] - below.vy[0]]
    assert abs(apart) < 1e-10 and abs(below.vy[0]) < 1e-10
