"""Linkages whose assembly modes are counted: random structures, platforms, and an exhaustive route.

The other route knows nothing of directions, groups or boxes: it is Newton's method on Φ of the
dense oracle's kind, written anew for pins, slots, rods and angles between bodies, from many starts.
"""

from __future__ import annotations

import math

import numpy as np

import mbody

#: Links (the ground is 0) and joints of Assur structures.
CHAINS = {
    "triad": (5, [(0, 1), (0, 2), (0, 3), (1, 4), (2, 4), (3, 4)]),
    "tetrad serial": (7, [(0, 1), (1, 2), (2, 3), (0, 4), (4, 3), (0, 5), (5, 2), (1, 6), (6, 3)]),
    "tetrad quaternary": (
        7,
        [(0, 1), (1, 5), (0, 2), (2, 5), (0, 3), (3, 6), (0, 4), (4, 6), (5, 6)],
    ),
}


def structure(links, joints, seed):
    """Rigid links that close in a random position, so that there is one mode at least."""
    rng = np.random.default_rng(seed)
    P = rng.uniform(-1, 1, (len(joints), 2))
    turn, origin = rng.uniform(-3, 3, links), rng.uniform(-1, 1, (links, 2))
    ground = {f"p{k}": tuple(P[k].tolist()) for k, j in enumerate(joints) if 0 in j}
    machine = mbody.Mechanism("structure", ground=ground)
    for link in range(1, links):
        c, s = math.cos(turn[link]), math.sin(turn[link])
        axes = np.array([[c, s], [-s, c]])
        points = {
            f"p{k}": tuple((axes @ (P[k] - origin[link])).tolist())
            for k, j in enumerate(joints)
            if link in j
        }
        machine.add(mbody.Body(f"b{link}", points=points, guess=float(turn[link])))
    names = ["ground", *(f"b{link}" for link in range(1, links))]
    for k, (a, b) in enumerate(joints):
        machine.add(mbody.Revolute(f"J{k}", f"{names[a]}.p{k}", f"{names[b]}.p{k}"))
    return machine


def platform(legs):
    """3-RPR of Innocenti and Parenti-Castelli (1992) with cylinders as legs."""
    A, d = ((0, 0), (15.91, 0), (0, 10)), (17.04, 16.54, 20.84)
    a = math.acos((d[0] ** 2 + d[2] ** 2 - d[1] ** 2) / (2 * d[0] * d[2]))
    corners = {"B1": (0, 0), "B2": (d[0], 0), "B3": (d[2] * math.cos(a), d[2] * math.sin(a))}
    machine = mbody.Mechanism("3-RPR", ground={f"A{k + 1}": A[k] for k in range(3)})
    machine.add(mbody.Body("platform", points=corners))
    for k in range(3):
        machine.add(
            mbody.DistanceDriver(f"leg{k + 1}", f"ground.A{k + 1}", f"platform.B{k + 1}", legs[k])
        )
    return machine


def slotted(seed):
    """A platform on two rods, with a slot that runs over a pin of the ground."""
    r = np.random.default_rng(seed).uniform
    ground = {"A1": (0, 0), "A2": (float(r(1, 3)), 0), "P": (float(r(0, 2)), float(r(1, 2)))}
    machine = mbody.Mechanism("slotted", ground=ground)
    machine.add(
        mbody.Body("platform", points={"B1": (0, 0), "B2": (float(r(0.5, 1.5)), 0)}),
        mbody.Distance("rod1", "ground.A1", "platform.B1", length=float(r(1, 2))),
        mbody.Distance("rod2", "ground.A2", "platform.B2", length=float(r(1, 2))),
        mbody.PinSlot(
            "slot",
            mbody.Marker("platform", (float(r(-1, 1)), float(r(-1, 1))), float(r(-3, 3))),
            "ground.P",
        ),
    )
    return machine


def slider_sixbar(seed):
    """A four-bar with a random coupler point that drives a slider on a random line."""
    r = np.random.default_rng(seed).uniform
    a, b, c, d = (float(x) for x in r(1, 4, 4))
    machine = mbody.Mechanism("slider six-bar", ground={"O2": (0, 0), "O4": (d, 0)})
    machine.add(
        mbody.Body("crank", points={"A": (a, 0)}),
        mbody.Body("coupler", points={"B": (b, 0), "P": (float(r(0, b)), float(r(-2, 2)))}),
        mbody.Body("rocker", points={"B": (c, 0)}),
        mbody.Body("rod", points={"C": (float(r(2, 6)), 0)}),
        mbody.Body("slider"),
        mbody.Revolute("O2", "ground.O2", "crank"),
        mbody.Revolute("A", "crank.A", "coupler"),
        mbody.Revolute("B", "coupler.B", "rocker.B"),
        mbody.Revolute("O4", "ground.O4", "rocker"),
        mbody.Revolute("P", "coupler.P", "rod"),
        mbody.Revolute("C", "rod.C", "slider"),
        mbody.Prismatic(
            "guide",
            mbody.Marker("ground", (float(r(-2, 2)), float(r(-2, 2))), float(r(-3, 3))),
            "slider",
        ),
        mbody.AngleDriver("motor", "crank", float(r(-3, 3))),
    )
    return machine


def redundant(seed):
    """A parallelogram coupler on three random equal cranks: one row too many."""
    r = np.random.default_rng(seed).uniform
    feet = [(0.0, 0.0), (float(r(2, 3)), float(r(-1, 1))), (float(r(4, 6)), float(r(-1, 1)))]
    length = float(r(0.5, 1.5))
    machine = mbody.Mechanism("redundant", ground={f"O{k}": foot for k, foot in enumerate(feet)})
    machine.add(mbody.Body("coupler", points={f"B{k}": foot for k, foot in enumerate(feet)}))
    for k in range(3):
        machine.add(mbody.Body(f"crank{k}", points={"B": (length, 0.0)}))
        machine.add(mbody.Revolute(f"O{k}", f"ground.O{k}", f"crank{k}"))
        machine.add(mbody.Revolute(f"B{k}", f"crank{k}.B", f"coupler.B{k}"))
    machine.add(mbody.AngleDriver("motor", "crank0", float(r(-3, 3))))
    return machine


def geared(seed):
    """A five-bar whose cranks are geared to each other, one to one or two to one."""
    r = np.random.default_rng(seed).uniform
    ratio = (1.0, 2.0)[seed % 2]
    d = float(r(2, 3))
    machine = mbody.Mechanism("geared five-bar", ground={"O1": (0, 0), "O2": (d, 0)})
    first = d * ratio / (1.0 + ratio)
    machine.add(
        mbody.Body("one", points={"A": (float(r(0.5, 1)), 0)}),
        mbody.Body("two", points={"B": (float(r(0.5, 1)), 0)}),
        mbody.Body("left", points={"C": (float(r(1, 3)), 0)}),
        mbody.Body("right", points={"C": (float(r(1, 3)), 0)}),
        mbody.Revolute("O1", "ground.O1", "one"),
        mbody.Revolute("O2", "ground.O2", "two"),
        mbody.Revolute("A", "one.A", "left"),
        mbody.Revolute("B", "two.B", "right"),
        mbody.Revolute("C", "left.C", "right.C"),
        mbody.Gear("mesh", "one", "two", radius_i=first, radius_j=d - first),
        mbody.AngleDriver("motor", "one", float(r(-3, 3))),
    )
    return machine


class Exhaustive:
    """Newton's method from many random poses, on equations of its own."""

    def __init__(self, machine):
        self.machine = machine
        self.system = mbody.assemble(machine)
        self.names = [body.name for body in machine.bodies]
        self.index = {name: 3 * n for n, name in enumerate(self.names)}
        self.rows = list(self._rows())

    def _place(self, element, side):
        x, y = self.system.numbers.place(element, side)
        return float(x), float(y)

    def _rows(self):
        at = self.system.numbers
        for joint in (*self.machine.joints, *self.machine.drivers):
            kind = type(joint).__name__
            if kind == "AngleDriver":
                yield "angle", joint.body, float(joint.law(0.0))
            elif kind == "Gear":
                ri, rj = joint.radii(at)
                yield "gear", joint, float(ri), float(rj)
            else:
                length = 0.0
                if kind == "Distance":
                    length = float(self.system.values[f"{joint.name}.length"])
                elif kind == "DistanceDriver":
                    length = float(joint.law(0.0))
                ends = self._place(joint, "i"), self._place(joint, "j")
                sides = joint.i.body, joint.j.body
                tilt = ()
                if kind in ("PinSlot", "Prismatic"):
                    tilt = float(at.angle(joint, "i")), float(at.angle(joint, "j"))
                yield kind, sides, ends, length, tilt

    def _world(self, q, body, place):
        if body == "ground":
            return np.full(len(q), place[0]), np.full(len(q), place[1]), np.zeros(len(q))
        n = self.index[body]
        c, s = np.cos(q[:, n + 2]), np.sin(q[:, n + 2])
        x = q[:, n] + c * place[0] - s * place[1]
        return x, q[:, n + 1] + s * place[0] + c * place[1], q[:, n + 2]

    def residual(self, q):
        """Φ (starts, rows)."""
        found = []
        for kind, *more in self.rows:
            if kind == "angle":
                found.append(2.0 * np.sin(0.5 * (q[:, self.index[more[0]] + 2] - more[1])))
                continue
            if kind == "gear":
                joint, ri, rj = more
                turned = [
                    np.zeros(len(q)) if b == "ground" else q[:, self.index[b] + 2]
                    for b in joint.bodies
                ]
                # the centres lie on the x axis of the ground
                found.append((ri * turned[0] + rj * turned[1]) / (ri + rj))
                continue
            sides, ends, length, tilt = more
            (ax, ay, at), (bx, by, bt) = (
                self._world(q, body, place) for body, place in zip(sides, ends, strict=True)
            )
            dx, dy = bx - ax, by - ay
            if kind == "Revolute":
                found += [dx, dy]
            elif kind in ("Distance", "DistanceDriver"):
                found.append((dx * dx + dy * dy - length * length) / (2.0 * length))
            else:
                line = at + tilt[0]
                found.append(np.cos(line) * dy - np.sin(line) * dx)
                if kind == "Prismatic":
                    found.append(2.0 * np.sin(0.5 * (bt + tilt[1] - line)))
        return np.stack(found, axis=1)

    def jacobian(self, q):
        """By complex steps."""
        size = q.shape[1]
        J = np.empty((len(q), len(self.residual(q[:1])[0]), size))
        for k in range(size):
            moved = q.astype(complex)
            moved[:, k] += 1e-30j
            J[:, :, k] = self.residual(moved).imag / 1e-30
        return J

    def count(self, starts, seed=0):
        """Number of different closed poses that are found."""
        rng = np.random.default_rng(seed)
        q = rng.uniform(-1, 1, (starts, 3 * len(self.names))) * 3.0 * self.system.length
        q[:, 2::3] = rng.uniform(-np.pi, np.pi, (starts, len(self.names)))
        going = np.arange(starts)
        for _ in range(60):
            step = _newton(self.jacobian(q[going]), self.residual(q[going]))
            most = np.abs(step).max(1, keepdims=True) / self.system.length
            q[going] -= step * np.minimum(1.0, 1.0 / np.maximum(most, 1e-12))
            # after a step of 1e-10 the next would be 1e-20
            going = going[most[:, 0] > 1e-10]
            if not going.size:
                break
        good = np.abs(self.residual(q)).max(1) < 1e-10
        keys = np.concatenate(
            [q[:, 0::3], q[:, 1::3], np.cos(q[:, 2::3]), np.sin(q[:, 2::3])], axis=1
        )[good]
        found = []
        for key in keys:
            if not any(np.abs(key - other).max() < 1e-5 for other in found):
                found.append(key)
        return len(found)


def _newton(J, phi):
    """Steps J⁺ Φ; as many rows as coordinates need no singular values, forty times the work."""
    if J.shape[1] == J.shape[2]:
        try:
            return np.linalg.solve(J, phi[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:
            pass
    return np.einsum("bij,bj->bi", np.linalg.pinv(J, rcond=1e-9), phi)
