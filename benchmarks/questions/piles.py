"""Many contacts: a step of a pile of discs that collapses, and of a chain that falls on a floor.

No solution is known: what is beside the time is how deep shapes overlap and how much energy is
lost to the steps. Peers have the same shapes, masses, friction and step; pymunk 30 iterations,
MuJoCo its elliptic cones and Newton's method, with contacts as stiff as it has them by default.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mbody
from benchmarks.frame import OURS, Row, Scope, available, timed

__all__ = ["TITLE", "measure"]

TITLE = "Many contacts: seconds of a step of 2 ms; the error is the greatest overlap in radii"
RADIUS, FRICTION, G, STEP = 0.1, 0.3, 9.81, 2e-3
#: Links of the chain: capsules for peers, segments with ends here.
LENGTH, MASS = 0.1, 0.1


def measure(scope: Scope) -> list[Row]:
    """In the short form few of them."""
    layers, links, until = (4, 10, 0.1) if scope.short else (19, 100, 1.0)
    return [*pile(layers, until), *chain(links, until)]


def places(layers: int) -> list[tuple[float, float]]:
    """A triangle of discs that touch, on the floor."""
    height = math.sqrt(3.0) * RADIUS
    return [
        (2.0 * RADIUS * (k + 0.5 * row), RADIUS + height * row)
        for row in range(layers)
        for k in range(layers - row)
    ]


def pile(layers: int, until: float) -> list[Row]:
    """Rows of the pile."""
    where, work = places(layers), f"pile of {layers * (layers + 1) // 2} discs"
    machine = _floored("pile")
    for n, (x, y) in enumerate(where):
        machine.add(
            mbody.Body(
                f"d{n}",
                mass=1.0,
                inertia=0.5 * RADIUS**2,
                points={"C": (0.0, 0.0)},
                shapes={"rim": {"disc": "C", "radius": RADIUS}},
                guess=(x, y, 0.0),
            )
        )
    machine.add(mbody.Between("floor", "ground.floor", "d*.rim", friction=FRICTION))
    machine.add(mbody.Between("discs", "d*.rim", "d*.rim", friction=FRICTION))
    rows = [ours(machine, work, until, RADIUS)]
    if available("pymunk"):
        rows.append(_beside(rows[0], "pymunk", work, *_pymunk_pile(where, until)))
    if available("mujoco"):
        rows.append(_beside(rows[0], "mujoco", work, *_mujoco_pile(where, until)))
    return rows


def chain(links: int, until: float) -> list[Row]:
    """Rows of the chain, 0.3 m above the floor and level but for its first link."""
    machine = _floored("chain")
    for n in range(links):
        machine.add(
            mbody.Body(
                f"l{n}",
                mass=MASS,
                inertia=MASS * LENGTH**2 / 12.0,
                cg=(0.5 * LENGTH, 0.0),
                points={"A": (0.0, 0.0), "B": (LENGTH, 0.0)},
                guess=(n * LENGTH, 0.3 + 0.01 * n, math.asin(0.1)),
            )
        )
    machine.add(*(mbody.Revolute(f"j{n}", f"l{n - 1}.B", f"l{n}.A") for n in range(1, links)))
    machine.add(mbody.Between("floor", "ground.floor", "l*.[AB]", friction=FRICTION))
    rows = [ours(machine, f"chain of {links} links on a floor", until, LENGTH)]
    if available("pymunk"):
        found = _pymunk_chain(links, until)
        rows.append(_beside(rows[0], "pymunk", rows[0].workload, *found))
    return rows


def _floored(name: str) -> mbody.Mechanism:
    floor = {"floor": {"line": {"point": "O"}}}
    machine = mbody.Mechanism(name, ground={"O": (0.0, 0.0)}, ground_shapes=floor)
    machine.add(mbody.Gravity("gravity", y=-G))
    return machine


def ours(machine: mbody.Mechanism, work: str, until: float, size: float) -> Row:
    """Seconds of a step of mbody: a motion less one of a single step."""

    def run(until: float) -> Any:
        return mbody.simulate(machine, until, method="moreau", step=STEP, rtol=1e-5, instants=2)

    run(STEP)
    first, _ = timed(lambda: run(STEP))
    spent, found = timed(lambda: run(until))
    # what is deepest of all steps is in the note; here as the peers are measured, at the end
    places = found.stepped.touching(len(found) - 1)
    deep = max(0.0, float(-places.gap.min(initial=0.0)))
    stats = found.stats
    steps = stats["steps"]
    setting = f"{stats['contacts']} contacts, {stats['sweeps'] / steps:.0f} sweeps"
    return Row(
        "piles",
        work,
        OURS,
        error=deep / size,
        median_s=(spent - first) / max(1, steps - 1),
        runs=1,
        ratio_to_mbody=1.0,
        setting=f"{setting}, energy {found.energy.error:.1e}",
    )


def _beside(mine: Row, engine: str, work: str, seconds: float, deep: float, setting: str) -> Row:
    ratio = None if mine.median_s is None else seconds / mine.median_s
    return Row("piles", work, engine, deep, seconds, 1, ratio, setting=setting)


def _stepped(step: Callable[[], Any], until: float) -> float:
    """Seconds of a step."""
    count = round(until / STEP)

    def run() -> None:
        for _ in range(count):
            step()

    return timed(run)[0] / count


def _space() -> Any:
    import pymunk

    space = pymunk.Space()
    space.gravity, space.iterations = (0.0, -G), 30
    floor = pymunk.Segment(space.static_body, (-100.0, -1.0), (100.0, -1.0), 1.0)
    floor.friction = 1.0  # Chipmunk multiplies both
    space.add(floor)
    return space


def _deepest(space: Any, size: float) -> float:
    """The greatest overlap of shapes, as a part of a size."""
    found = [0.0]
    for body in space.bodies:
        for shape in body.shapes:
            for one in space.shape_query(shape):
                if one.shape is not None and one.shape.body is not body:
                    found += [-p.distance for p in one.contact_point_set.points]
    return max(found) / size


def _pymunk_pile(where: list[tuple[float, float]], until: float) -> tuple[float, float, str]:
    import pymunk

    space = _space()
    for x, y in where:
        body = pymunk.Body(1.0, 0.5 * RADIUS**2)
        body.position = x, y
        disc = pymunk.Circle(body, RADIUS)
        disc.friction = FRICTION
        space.add(body, disc)
    seconds = _stepped(lambda: space.step(STEP), until)
    return seconds, _deepest(space, RADIUS), "30 iterations"


def _pymunk_chain(links: int, until: float) -> tuple[float, float, str]:
    import pymunk

    space, before = _space(), None
    for n in range(links):
        body = pymunk.Body(MASS, MASS * LENGTH**2 / 12.0)
        body.angle = math.asin(0.1)
        half = 0.5 * LENGTH
        body.position = n * LENGTH + half * math.cos(body.angle), 0.3 + 0.01 * n + 0.1 * half
        bar = pymunk.Segment(body, (-half, 0.0), (half, 0.0), 0.0)
        bar.friction, bar.filter = FRICTION, pymunk.ShapeFilter(group=1)
        space.add(body, bar)
        if before is not None:
            pin = pymunk.PivotJoint(before, body, (half, 0.0), (-half, 0.0))
            pin.error_bias = 0.0
            space.add(pin)
        before = body
    seconds = _stepped(lambda: space.step(STEP), until)
    ends = ((body, s) for body in space.bodies for s in (-half, half))
    lowest = min(body.local_to_world((s, 0.0)).y for body, s in ends)
    return seconds, max(0.0, -lowest) / LENGTH, "30 iterations"


def _mujoco_pile(where: list[tuple[float, float]], until: float) -> tuple[float, float, str]:
    import mujoco

    turning = " ".join([str(0.5 * RADIUS**2)] * 3)
    joints = "".join(
        f'<joint type="{kind}" axis="{axis}"/>'
        for kind, axis in (("slide", "1 0 0"), ("slide", "0 0 1"), ("hinge", "0 1 0"))
    )
    rough = f'friction="{FRICTION} 0 0"'
    discs = "".join(
        f'<body pos="{x} 0 {y}">{joints}<inertial pos="0 0 0" mass="1" diaginertia="{turning}"/>'
        f'<geom type="sphere" size="{RADIUS}" condim="3" {rough}/></body>'
        for x, y in where
    )
    text = (
        f'<mujoco><option timestep="{STEP}" gravity="0 0 -{G}" cone="elliptic"/><worldbody>'
        f'<geom type="plane" size="100 100 1" {rough}/>{discs}</worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    seconds = _stepped(lambda: mujoco.mj_step(model, data), until)
    deep = max([0.0, *(-float(data.contact.dist[k]) for k in range(data.ncon))])
    return seconds, deep / RADIUS, "Newton, elliptic"
