"""Many contacts: piles that collapse, discs poured between walls, a chain that falls on a floor.

No solution is known: beside the time of a step stand how deep shapes overlap at the end, what part
of the energy of the beginning is left, and how fast the fastest body still is. Peers have the same
shapes, masses, friction and step; pymunk 30 iterations, MuJoCo its elliptic cones and Newton's
method, with contacts as stiff as it has them by default. All run in turn, round by round.
"""

from __future__ import annotations

import math
import random
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mbody
from benchmarks.frame import OURS, Row, Scope, available, timed

__all__ = ["TITLE", "measure"]

TITLE = "Many contacts: seconds of a step of 2 ms; the error is the overlap at the end, in radii"
RADIUS, G, STEP, RTOL = 0.1, 9.81, 2e-3, 1e-5
#: Links of the chain: capsules for peers, segments with ends here.
LENGTH, MASS = 0.1, 0.1
#: Rounds in turn.
ROUNDS = 3

#: Seconds of a motion; and at its end overlap, energy, greatest speed, and what else is to be said.
Seen = tuple[float, float, float, float, str]


@dataclass(frozen=True)
class Heap:
    """Discs (x, y, radius, mass) on a floor, between walls where it has a width."""

    name: str
    discs: list[tuple[float, float, float, float]]
    friction: float
    width: float | None = None

    @property
    def energy(self) -> float:
        return sum(mass * G * y for _, y, _, mass in self.discs)


def measure(scope: Scope) -> list[Row]:
    """In the short form few of them."""
    layers, links, poured, until = (4, 10, 20, 0.1) if scope.short else (19, 100, 200, 1.0)
    rows = [row for mu in (0.3, 0.9) for row in heap(pile(layers, mu), until)]
    rows += heap(between_walls(poured), 4.0 * until)
    return [*rows, *chain(links, until)]


def pile(layers: int, friction: float) -> Heap:
    """A triangle of discs that touch, on the floor."""
    height = math.sqrt(3.0) * RADIUS
    discs = [
        (2.0 * RADIUS * (k + 0.5 * row), RADIUS + height * row, RADIUS, 1.0)
        for row in range(layers)
        for k in range(layers - row)
    ]
    return Heap(f"pile of {len(discs)} discs, friction {friction:g}", discs, friction)


def between_walls(count: int, wide: int = 20) -> Heap:
    """Discs of three sizes, in rows that are shaken a little."""
    rng, discs = random.Random(3), []
    for n in range(count):
        part = (0.7, 0.85, 1.0)[n % 3]
        x = RADIUS * (1.1 * (2 * (n % wide) + 1) + rng.uniform(-0.05, 0.05))
        y = RADIUS * (1.2 * (2 * (n // wide) + 1) + rng.uniform(-0.05, 0.05))
        discs.append((x, y, part * RADIUS, part**2))
    return Heap(f"{count} discs poured between walls", discs, 0.5, 2.2 * RADIUS * wide)


def in_rounds(work: str, start: float, engines: dict[str, Callable[[], Seen]]) -> list[Row]:
    """Rows of the engines, the first one ours, each run once a round."""
    found: dict[str, list[Seen]] = {name: [] for name in engines}
    for _ in range(ROUNDS):
        for name, run in engines.items():
            found[name].append(run())
    rows = []
    for name, seen in found.items():
        ratios = [a[0] / b[0] for a, b in zip(seen, found[OURS], strict=True)]
        _, deep, energy, speed, said = seen[-1]
        left = f"{100 * energy / start:.3g} % of the energy left, fastest {speed:.1e} m/s"
        rows.append(
            Row(
                "piles",
                work,
                name,
                error=deep,
                median_s=statistics.median(one[0] for one in seen),
                runs=ROUNDS,
                ratio_to_mbody=statistics.median(ratios),
                setting=f"{said}; {left}",
            )
        )
    return rows


def heap(scene: Heap, until: float) -> list[Row]:
    """Rows of a heap of discs."""
    machine = _machine(scene)
    engines: dict[str, Callable[[], Seen]] = {OURS: lambda: ours(machine, until, RADIUS)}
    if available("pymunk"):
        engines["pymunk"] = lambda: _pymunk_heap(scene, until)
    if available("mujoco"):
        engines["mujoco"] = lambda: _mujoco_heap(scene, until)
    return in_rounds(scene.name, scene.energy, engines)


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
                guess=(n * LENGTH * math.sqrt(0.99), 0.3 + 0.01 * n, math.asin(0.1)),
            )
        )
    machine.add(*(mbody.Revolute(f"j{n}", f"l{n - 1}.B", f"l{n}.A") for n in range(1, links)))
    machine.add(mbody.Between("floor", "ground.floor", "l*.[AB]", friction=0.3))
    start = sum(MASS * G * (0.3 + 0.01 * (n + 0.5)) for n in range(links))
    engines: dict[str, Callable[[], Seen]] = {OURS: lambda: ours(machine, until, LENGTH)}
    if available("pymunk"):
        engines["pymunk"] = lambda: _pymunk_chain(links, until)
    return in_rounds(f"chain of {links} links on a floor", start, engines)


def _floored(name: str, **more: Any) -> mbody.Mechanism:
    shapes = {"floor": {"line": {"point": "O"}}, **more.pop("shapes", {})}
    points = {"O": (0.0, 0.0), **more.pop("points", {})}
    machine = mbody.Mechanism(name, ground=points, ground_shapes=shapes)
    machine.add(mbody.Gravity("gravity", y=-G))
    return machine


def _machine(scene: Heap) -> mbody.Mechanism:
    walls = ["floor"]
    if scene.width is None:
        machine = _floored("heap")
    else:
        walls += ["left", "right"]
        shapes = {
            "left": {"line": {"point": "L", "angle": -0.5 * math.pi}},
            "right": {"line": {"point": "R", "angle": 0.5 * math.pi}},
        }
        points = {"L": (0.0, 0.0), "R": (scene.width, 0.0)}
        machine = _floored("heap", shapes=shapes, points=points)
    for n, (x, y, radius, mass) in enumerate(scene.discs):
        machine.add(
            mbody.Body(
                f"d{n}",
                mass=mass,
                inertia=0.5 * mass * radius**2,
                points={"C": (0.0, 0.0)},
                shapes={"rim": {"disc": "C", "radius": radius}},
                guess=(x, y, 0.0),
            )
        )
    for name in walls:
        machine.add(mbody.Between(name, f"ground.{name}", "d*.rim", friction=scene.friction))
    machine.add(mbody.Between("discs", "d*.rim", "d*.rim", friction=scene.friction))
    return machine


def ours(machine: mbody.Mechanism, until: float, size: float) -> Seen:
    """Seconds of a step of mbody: a motion less one of a single step."""

    def run(until: float) -> Any:
        return mbody.simulate(machine, until, method="moreau", step=STEP, rtol=RTOL, instants=2)

    run(STEP)
    first, _ = timed(lambda: run(STEP))
    spent, found = timed(lambda: run(until))
    # what is deepest of all steps is in the note; here as the peers are measured, at the end
    places = found.stepped.touching(len(found) - 1)
    deep = max(0.0, float(-places.gap.min(initial=0.0))) / size
    energy = speed = 0.0
    for body in machine.bodies:
        one = found[body.name]
        vx, vy, omega = float(one.vx[-1]), float(one.vy[-1]), float(one.omega[-1])
        mass, inertia = body.mass or 0.0, body.inertia or 0.0
        energy += 0.5 * mass * (vx**2 + vy**2) + 0.5 * inertia * omega**2
        energy += mass * G * float(one.y[-1])
        speed = max(speed, math.hypot(vx, vy))
    stats = found.stats
    steps = stats["steps"]
    said = (
        f"up to {stats['contacts']} contacts, {stats['sweeps'] / steps:.0f} sweeps and "
        f"{stats['iterations'] / steps:.0f} iterations, impulses to {RTOL:g}, {found.status[:9]}, "
        f"energy {found.energy.error:.1e}"
    )
    return (spent - first) / max(1, steps - 1), deep, energy, speed, said


def _stepped(step: Callable[[], Any], until: float) -> float:
    """Seconds of a step."""
    count = round(until / STEP)

    def run() -> None:
        for _ in range(count):
            step()

    return timed(run)[0] / count


def _space(friction: float, width: float | None = None) -> Any:
    import pymunk

    space = pymunk.Space()
    space.gravity, space.iterations = (0.0, -G), 30
    walls = [((-100.0, -1.0), (100.0, -1.0))]
    if width is not None:
        walls += [((x, -100.0), (x, 100.0)) for x in (-1.0, width + 1.0)]
    for a, b in walls:
        wall = pymunk.Segment(space.static_body, a, b, 1.0)
        # Chipmunk multiplies both: with what discs have this is the friction on each other
        wall.friction = math.sqrt(friction)
        space.add(wall)
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


def _motion_of(space: Any) -> tuple[float, float]:
    """Energy and greatest speed."""
    energy = sum(body.kinetic_energy + body.mass * G * body.position.y for body in space.bodies)
    return float(energy), max(float(body.velocity.length) for body in space.bodies)


def _pymunk_heap(scene: Heap, until: float) -> Seen:
    import pymunk

    space = _space(scene.friction, scene.width)
    for x, y, radius, mass in scene.discs:
        body = pymunk.Body(mass, 0.5 * mass * radius**2)
        body.position = x, y
        disc = pymunk.Circle(body, radius)
        disc.friction = math.sqrt(scene.friction)
        space.add(body, disc)
    seconds = _stepped(lambda: space.step(STEP), until)
    return seconds, _deepest(space, RADIUS), *_motion_of(space), "30 iterations"


def _pymunk_chain(links: int, until: float) -> Seen:
    import pymunk

    space, before = _space(0.3), None
    for n in range(links):
        body = pymunk.Body(MASS, MASS * LENGTH**2 / 12.0)
        body.angle = math.asin(0.1)
        half = 0.5 * LENGTH
        body.position = (n * LENGTH + half) * math.cos(body.angle), 0.3 + 0.01 * n + 0.1 * half
        bar = pymunk.Segment(body, (-half, 0.0), (half, 0.0), 0.0)
        bar.friction, bar.filter = math.sqrt(0.3), pymunk.ShapeFilter(group=1)
        space.add(body, bar)
        if before is not None:
            pin = pymunk.PivotJoint(before, body, (half, 0.0), (-half, 0.0))
            pin.error_bias = 0.0
            space.add(pin)
        before = body
    seconds = _stepped(lambda: space.step(STEP), until)
    ends = ((body, s) for body in space.bodies for s in (-half, half))
    lowest = min(body.local_to_world((s, 0.0)).y for body, s in ends)
    return seconds, max(0.0, -lowest) / LENGTH, *_motion_of(space), "30 iterations"


def _mujoco_heap(scene: Heap, until: float) -> Seen:
    import mujoco

    joints = "".join(
        f'<joint type="{kind}" axis="{axis}"/>'
        for kind, axis in (("slide", "1 0 0"), ("slide", "0 0 1"), ("hinge", "0 1 0"))
    )
    rough = f'friction="{scene.friction} 0 0"'
    discs = "".join(
        f'<body pos="{x} 0 {y}">{joints}<inertial pos="0 0 0" mass="{mass}" diaginertia="'
        f'{" ".join([str(0.5 * mass * radius**2)] * 3)}"/>'
        f'<geom type="sphere" size="{radius}" condim="3" {rough}/></body>'
        for x, y, radius, mass in scene.discs
    )
    planes = [("0 0 0", "0 0 1")]
    if scene.width is not None:
        planes += [("0 0 0", "1 0 0"), (f"{scene.width} 0 0", "-1 0 0")]
    walls = "".join(
        f'<geom type="plane" pos="{at}" zaxis="{normal}" size="100 100 1" {rough}/>'
        for at, normal in planes
    )
    text = (
        f'<mujoco><option timestep="{STEP}" gravity="0 0 -{G}" cone="elliptic"><flag '
        f'energy="enable"/></option><worldbody>{walls}{discs}</worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    seconds = _stepped(lambda: mujoco.mj_step(model, data), until)
    deep = max([0.0, *(-float(data.contact.dist[k]) for k in range(data.ncon))])
    mujoco.mj_energyPos(model, data)
    mujoco.mj_energyVel(model, data)
    rates = data.qvel.reshape(-1, 3)
    fastest = float(max(math.hypot(vx, vy) for vx, vy, _ in rates))
    energy = float(sum(data.energy))
    return seconds, deep / RADIUS, energy, fastest, "Newton, elliptic"
