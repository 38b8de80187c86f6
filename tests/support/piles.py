"""Mechanisms of many contacts: piles of discs, stacks of boxes, chains above a floor."""

import math

import numpy as np

import mbody

G, RADIUS = 9.81, 0.1


def floored(name, **more):
    """A mechanism with a level floor through the origin and gravity."""
    shapes = {"floor": {"line": {"point": "O"}}, **more.pop("shapes", {})}
    machine = mbody.Mechanism(
        name, ground={"O": (0.0, 0.0), **more.pop("points", {})}, ground_shapes=shapes, **more
    )
    machine.add(mbody.Gravity("gravity", y=-G))
    return machine


def disc(name, x, y, radius=RADIUS, mass=1.0):
    """A uniform disc."""
    return mbody.Body(
        name,
        mass=mass,
        inertia=0.5 * mass * radius**2,
        points={"C": (0.0, 0.0)},
        shapes={"rim": {"disc": "C", "radius": radius}},
        guess=(x, y, 0.0),
    )


def pile(layers, friction=0.9, floor=None, places=None):
    """A triangle of equal discs that touch, on the floor."""
    machine = floored(f"pile of {layers} layers")
    height = math.sqrt(3.0) * RADIUS
    if places is None:
        places = [
            (2.0 * RADIUS * (k + 0.5 * row), RADIUS + height * row)
            for row in range(layers)
            for k in range(layers - row)
        ]
    machine.add(*(disc(f"d{n}", x, y) for n, (x, y) in enumerate(places)))
    floor = friction if floor is None else floor
    machine.add(mbody.Between("floor", "ground.floor", "d*.rim", friction=floor))
    machine.add(mbody.Between("discs", "d*.rim", "d*.rim", friction=friction))
    return machine


def box(name, x, y, width=0.2, height=0.1):
    """A uniform box of 1 kg."""
    a, b = 0.5 * width, 0.5 * height
    return mbody.Body(
        name,
        mass=1.0,
        inertia=(width**2 + height**2) / 12.0,
        points={"A": (-a, -b), "B": (a, -b), "C": (a, b), "D": (-a, b)},
        shapes={"box": {"polygon": ["A", "B", "C", "D"]}},
        guess=(x, y, 0.0),
    )


def stack(count, shift=0.01):
    """Boxes on each other, every other one a little aside."""
    machine = floored(f"stack of {count}")
    machine.add(*(box(f"b{n}", shift * (n % 2), 0.05 + 0.1 * n) for n in range(count)))
    machine.add(mbody.Between("floor", "ground.floor", "b*.box", friction=0.5))
    machine.add(mbody.Between("boxes", "b*.box", "b*.box", friction=0.5))
    return machine


def chain(count, angle=0.3, height=0.5, length=0.1):
    """Links in a row above the floor, which their ends touch."""
    machine = floored(f"chain of {count} links")
    for n in range(count):
        machine.add(
            mbody.Body(
                f"l{n}",
                mass=0.1,
                inertia=0.1 * length**2 / 12.0,
                cg=(0.5 * length, 0.0),
                points={"A": (0.0, 0.0), "B": (length, 0.0)},
                guess=(n * length * math.cos(angle), height + n * length * math.sin(angle), angle),
            )
        )
    machine.add(*(mbody.Revolute(f"j{n}", f"l{n - 1}.B", f"l{n}.A") for n in range(1, count)))
    machine.add(mbody.Between("floor", "ground.floor", "l*.[AB]", friction=0.5))
    return machine


def far_apart(count):
    """Discs a metre apart in a square."""
    machine = mbody.Mechanism(f"{count} discs far apart")
    side = math.ceil(math.sqrt(count))
    machine.add(*(disc(f"d{n}", float(n % side), float(n // side)) for n in range(count)))
    machine.add(mbody.Gravity("gravity", y=-G))
    machine.add(mbody.Between("discs", "d*.rim", "d*.rim", friction=0.3))
    return machine


def poured(count, friction=0.5, wide=20, seed=3):
    """Discs of three sizes that fall between two walls, in rows that are shaken a little."""
    rng = np.random.default_rng(seed)
    walls = {"left": {"line": {"point": "L", "angle": -0.5 * math.pi}}}
    walls["right"] = {"line": {"point": "R", "angle": 0.5 * math.pi}}
    width = 2.2 * RADIUS * wide
    machine = floored(
        f"{count} discs between walls", shapes=walls, points={"L": (0.0, 0.0), "R": (width, 0.0)}
    )
    for n in range(count):
        radius = RADIUS * (0.7, 0.85, 1.0)[n % 3]
        x, y = 1.1 * RADIUS * (2 * (n % wide) + 1), 1.2 * RADIUS * (2 * (n // wide) + 1)
        shaken = 0.05 * RADIUS * rng.uniform(-1.0, 1.0, 2)
        machine.add(disc(f"d{n}", x + shaken[0], y + shaken[1], radius, (radius / RADIUS) ** 2))
    for name in ("floor", "left", "right"):
        machine.add(mbody.Between(name, f"ground.{name}", "d*.rim", friction=friction))
    machine.add(mbody.Between("discs", "d*.rim", "d*.rim", friction=friction))
    return machine
