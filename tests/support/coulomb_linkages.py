"""Random linkages with frictional joints and closed contacts at random states, with equations of
their own: nothing of the engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

import mbody

__all__ = ["Linkage", "curvature", "gradient", "linkage"]

G = 9.81
STEP = 1e-30


@dataclass
class Linkage:
    """A mechanism at one state, with its own equations.

    `rows`: constraints, functions of q; `normals`, `tangents`: of contacts; `rubs`: of joints the
    kind, its row of sliding, the numbers of the rows that press it, the arm and μ.
    """

    machine: mbody.Mechanism
    mass: np.ndarray
    load: np.ndarray
    q: np.ndarray
    v: np.ndarray
    rows: list = field(default_factory=list)
    normals: list = field(default_factory=list)
    tangents: list = field(default_factory=list)
    mu: list = field(default_factory=list)
    rubs: list = field(default_factory=list)


def place(q, body, point):
    """A point of a body; body −1 is the ground."""
    x, y = point
    if body < 0:
        return np.array([x, y], dtype=complex)
    a, b, t = q[3 * body : 3 * body + 3]
    return np.array([a + np.cos(t) * x - np.sin(t) * y, b + np.sin(t) * x + np.cos(t) * y])


def angle(q, body):
    return q[3 * body + 2] if body >= 0 else 0.0


def gradient(functions, q):
    found = np.zeros((len(functions), len(q)))
    for k in range(len(q)):
        z = q.astype(complex)
        z[k] += 1j * STEP
        found[:, k] = [np.imag(f(z)) / STEP for f in functions]
    return found


def curvature(functions, q, v):
    """−J̇ v of the functions, by differences of their directional derivatives of second order."""
    if not functions:
        return np.zeros(0)
    h = 1e-4

    def along(s):
        z = (q + s * v).astype(complex) + 1j * STEP * v
        return np.array([np.imag(f(z)) / STEP for f in functions])

    # of order 6
    parts = [(along(k * h) - along(-k * h)) * c for k, c in ((1, 45.0), (2, -9.0), (3, 1.0))]
    return -sum(parts) / (60.0 * h)


def linkage(rng: np.random.Generator, *, most_contacts=2, greatest=0.9) -> Linkage:
    """A chain of one to three links from the ground or free, pinned or sliding, with points that
    lie on the floor or on walls, at a random state in which some of it rests exactly.
    """
    count = int(rng.integers(1, 4))
    free = bool(rng.random() < 0.25)
    loop = not free and count > 1 and rng.random() < 0.4
    contacts = int(rng.integers(1 if free else 0, most_contacts + 1))
    q, points = np.zeros(3 * count), [dict() for _ in range(count)]
    ground, shapes, joints = {}, {}, []
    rows, rubs = [], []
    here, before = rng.uniform(-0.2, 0.2, 2), -1
    mass = np.repeat(rng.uniform(0.5, 2.0, count), 3)
    for b in range(count):
        t = rng.uniform(-math.pi, math.pi)
        length = rng.uniform(0.3, 1.0)
        mass[3 * b + 2] = mass[3 * b] * length**2 * rng.uniform(0.03, 0.3)
        c, s = math.cos(t), math.sin(t)
        at = np.array([-0.5 * length, rng.uniform(-0.1, 0.1)])
        q[3 * b : 3 * b + 2] = here - [c * at[0] - s * at[1], s * at[0] + c * at[1]]
        q[3 * b + 2] = t
        points[b]["A"], points[b]["B"] = tuple(at), (0.5 * length, 0.0)
        names = ("ground.P0" if before < 0 else f"b{before}.B", f"b{b}.A")
        mu = float(rng.uniform(0.0, greatest)) if rng.random() < 0.8 else None
        first = len(rows)
        last = tuple(here) if before < 0 else points[before]["B"]
        if before < 0:
            ground["P0"] = tuple(here)
        if before < 0 and free:
            pass
        elif rng.random() < 0.7:
            arm = float(rng.uniform(0.02, 0.2))
            more = {} if mu is None else {"friction": mu, "pin_radius": arm}
            joints.append(mbody.Revolute(f"j{b}", *names, **more))
            for k in range(2):
                rows.append(
                    lambda z, k=k, i=before, j=b, p=last, r=tuple(at): (
                        place(z, j, r)[k] - place(z, i, p)[k]
                    )
                )
            if mu:

                def turn(z, i=before, j=b):
                    return angle(z, j) - angle(z, i)

                rho = mu * arm / math.sqrt(1.0 + mu * mu)
                rubs.append(("pin", turn, (first, first + 1), rho, mu))
        else:
            span = None if rng.random() < 0.5 else float(rng.uniform(0.2, 1.0))
            more = {} if mu is None else {"friction": mu, "length": span}
            # the direction of the guide on the link before, at which the angle is what it is
            base = angle(q, before)
            joints.append(
                mbody.Prismatic(
                    f"j{b}",
                    mbody.Marker(names[0].split(".")[0], names[0].split(".")[1], float(t - base)),
                    mbody.Marker(f"b{b}", "A", 0.0),
                    **more,
                )
            )
            for k in range(2):

                def across(z, k=k, i=before, j=b, p=last, r=tuple(at), d=float(t - base)):
                    way = place(z, j, r) - place(z, i, p)
                    u = angle(z, i) + d
                    if k == 2:
                        return way[0] * np.cos(u) + way[1] * np.sin(u)
                    if k == 0:
                        return -way[0] * np.sin(u) + way[1] * np.cos(u)
                    return angle(z, j) - u

                rows.append(across)
            if mu:
                rubs.append(("guide", lambda z, f=across: f(z, k=2), (first, first + 1), span, mu))
        before, here = b, place(q, b, points[b]["B"]).real
    if loop:
        # the end of the chain in a slot of the ground
        u = float(rng.uniform(-math.pi, math.pi))
        ground["S"], mu = tuple(here), float(rng.uniform(0.05, greatest))
        slot = mbody.PinSlot("slot", mbody.Marker("ground", "S", u), f"b{count - 1}.B", friction=mu)
        joints.append(slot)

        def way(z, normal, j=count - 1, p=tuple(here), r=points[count - 1]["B"], u=u):
            d = place(z, j, r) - np.array(p)
            return (
                d[1] * np.cos(u) - d[0] * np.sin(u)
                if normal
                else d[0] * np.cos(u) + d[1] * np.sin(u)
            )

        rubs.append(("slot", lambda z: way(z, False), (len(rows), len(rows)), 0.0, mu))
        rows.append(lambda z: way(z, True))
    normals, tangents, mus, touching = [], [], [], []
    for k in range(contacts):
        b = int(rng.integers(0, count))
        at = tuple(rng.uniform(-0.5, 0.5, 2))
        points[b][f"C{k}"] = at
        spot = place(q, b, at).real
        # the floor, mostly below
        u = float(rng.normal(0.0, 0.5)) if rng.random() < 0.7 else float(rng.uniform(-3.0, 3.0))
        ground[f"F{k}"], shapes[f"f{k}"] = tuple(spot), {"line": {"point": f"F{k}", "angle": u}}
        mu = float(rng.uniform(0.0, greatest)) if rng.random() < 0.9 else 0.0
        touching.append(mbody.Contact(f"c{k}", f"ground.f{k}", f"b{b}.C{k}", friction=mu))
        mus.append(mu)

        def gap(z, across, b=b, at=at, spot=tuple(spot), u=u):
            d = place(z, b, at) - np.array(spot)
            return (
                d[1] * math.cos(u) - d[0] * math.sin(u)
                if across
                else d[0] * math.cos(u) + d[1] * math.sin(u)
            )

        normals.append(lambda z, f=gap: f(z, True))
        tangents.append(lambda z, f=gap: f(z, False))
    load = np.zeros(3 * count)
    load[1::3] = -mass[::3] * G
    push = rng.normal(0.0, 8.0, 2)
    load[-3:-1] += push
    # a random motion that keeps what is closed, and rests along some of it
    everything = [*tangents, *(one[1] for one in rubs)]
    resting = [f for f in everything if rng.random() < 0.6]
    holds = gradient([*rows, *normals, *resting], q)
    v = rng.normal(0.0, 1.0, 3 * count)
    for _ in range(2):
        v = v - np.linalg.pinv(holds, rcond=1e-9) @ (holds @ v) if len(holds) else v
    if np.abs(v).max() < 1e-10:
        v[:] = 0.0
    machine = mbody.Mechanism("linkage", ground=ground, ground_shapes=shapes)
    start = {}
    for b in range(count):
        x, y, t = (float(part) for part in q[3 * b : 3 * b + 3])
        name = f"b{b}"
        machine.add(
            mbody.Body(
                name,
                mass=float(mass[3 * b]),
                inertia=float(mass[3 * b + 2]),
                points={p: tuple(map(float, r)) for p, r in points[b].items()},
            )
        )
        vx, vy, w = (float(part) for part in v[3 * b : 3 * b + 3])
        start[name] = {"x": x, "y": y, "angle": t, "vx": vx, "vy": vy, "omega": w}
    machine.add(*joints, *touching, mbody.Gravity("gravity", y=-G))
    size, heading = math.hypot(*push), math.atan2(push[1], push[0])
    machine.add(mbody.Force("push", f"b{count - 1}", size, angle=heading))
    machine.simulation = mbody.SimulationSettings(until=1e-7, rtol=1e-9, start=start)
    return Linkage(machine, mass, load, q, v, rows, normals, tangents, mus, rubs)
