"""Random driven linkages of one freedom, with joints and loads of every kind."""

from __future__ import annotations

import functools
import itertools
import math
from typing import Any

import numpy as np

from mbody.engines.oracle import Reference
from mbody.laws import ConstantAcceleration, Harmonic, Polynomial
from mbody.model.body import Body, Guess
from mbody.model.driver import AngleDriver
from mbody.model.element import Marker, polar
from mbody.model.joints import Distance, Fixed, Prismatic, Revolute
from mbody.model.loads import (
    Damper,
    Force,
    Gravity,
    Load,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)
from mbody.model.mechanism import Mechanism

LEAST_TURN = 0.4  # rad


class _Link:
    """A link while it is being drawn: true axes (x, y, θ) and places, all in the world."""

    def __init__(self, name: str, axes: np.ndarray, spine: tuple[np.ndarray, np.ndarray]) -> None:
        self.name, self.axes, self.spine = name, axes, spine
        self.points: dict[str, Any] = {}

    def local(self, place: np.ndarray) -> np.ndarray:
        x, y, theta = self.axes
        c, s = math.cos(theta), math.sin(theta)
        return np.array([[c, s], [-s, c]]) @ (place - [x, y])


class _Draft:
    """A random linkage while it is being drawn; lengths are about 1, masses about 1."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        box = (np.array([-0.5, 0.0]), np.array([1.5, 0.0]))
        self.links = {"ground": _Link("ground", np.zeros(3), box)}
        self.joints: list[Any] = []
        self.bodies: list[Body] = []

    def link(self, name: str, p: np.ndarray, q: np.ndarray) -> _Link:
        """A link from p to q: axes as in a textbook, or anywhere."""
        angle = math.atan2(*(q - p)[::-1])
        axes = np.array([*p, angle])
        if self.rng.random() < 0.5:
            axes += [*self.rng.uniform(-0.3, 0.3, 2), self.rng.uniform(-3.0, 3.0)]
            axes[2] = math.remainder(axes[2], 2.0 * math.pi)
        self.links[name] = _Link(name, axes, (p, q))
        return self.links[name]

    def mark(self, link: _Link, place: np.ndarray, direction: float | None = None) -> Marker:
        """A marker at a world place: a named point, polar or not, or bare coordinates."""
        x, y = link.local(place).tolist()
        angle = 0.0 if direction is None else direction - link.axes[2]
        how = self.rng.integers(3)
        point: Any = (x, y) if how else polar(math.hypot(x, y), math.atan2(y, x))
        if how == 2:
            return Marker(link.name, point, angle)
        name = f"P{len(link.points)}"
        link.points[name] = point
        return Marker(link.name, name, angle)

    def join(self, kind: Any, a: _Link, b: _Link, *where: Any, **more: Any) -> None:
        """A joint at one place (or two, one on each link), its sides in random order."""
        places = (where[0], where[-1]) if len(where) < 3 else where[:2]
        direction = where[2] if len(where) == 3 else None
        markers = [self.mark(x, p, direction) for x, p in zip((a, b), places)]
        if self.rng.random() < 0.5:
            markers.reverse()
        self.joints.append(kind(f"J{len(self.joints)}", *markers, **more))

    def near(self, link: _Link) -> np.ndarray:
        """A random place on a link, off its line."""
        p, q = link.spine
        along, off = self.rng.uniform(-0.1, 1.1), self.rng.uniform(-0.5, 0.5)
        if link.name == "ground":
            off = self.rng.uniform(-1.3, 1.3)
        return p + along * (q - p) + off * np.array([-(q - p)[1], (q - p)[0]])

    def two(self) -> tuple[_Link, _Link, np.ndarray, np.ndarray]:
        """Places on two different links, neither close together nor far apart."""
        while True:
            names = self.rng.choice(len(self.links), 2, replace=False)
            a, b = (list(self.links.values())[k] for k in names)
            p, q = self.near(a), self.near(b)
            if 0.5 < math.dist(p, q) < 1.8:
                return a, b, p, q

    def four_bar(self) -> float:
        """A crank-rocker that turns fully; the motor's first angle comes back."""
        u = self.rng.uniform
        while True:
            crank, coupler, rocker = u(0.2, 0.4), u(0.7, 1.3), u(0.6, 1.2)
            reach = np.array([1.0 - crank, 1.0 + crank])
            cosine = (coupler**2 + rocker**2 - reach**2) / (2.0 * coupler * rocker)
            if np.abs(cosine).max() < math.cos(math.radians(35.0)):
                break
        theta, side = u(-math.pi, math.pi), self.rng.choice([-1.0, 1.0])
        o2, o4 = np.zeros(2), np.array([1.0, 0.0])
        a = crank * np.array([math.cos(theta), math.sin(theta)])
        d = math.dist(a, o4)
        t3 = math.atan2(*(o4 - a)[::-1]) + side * math.acos(
            (coupler**2 + d**2 - rocker**2) / (2.0 * coupler * d)
        )
        b = a + coupler * np.array([math.cos(t3), math.sin(t3)])
        ground = self.links["ground"]
        l2, l3, l4 = self.link("L1", o2, a), self.link("L2", a, b), self.link("L3", o4, b)
        for one, other, place in ((ground, l2, o2), (l2, l3, a), (l3, l4, b), (ground, l4, o4)):
            self.join(Revolute, one, other, place)
        return float(l2.axes[2])

    def dyad(self, kind: str) -> None:
        """Two more links between two that are there: "RRR", "RRP" or "RPR"."""
        u = self.rng.uniform
        a, b, p, q = self.two()
        k = len(self.links)
        names = f"L{k}", f"L{k + 1}"
        side = self.rng.choice([-1.0, 1.0])
        base, line = math.dist(p, q), math.atan2(*(q - p)[::-1])
        apex = math.radians(u(55.0, 125.0))
        at_p = (math.pi - apex) * u(0.3, 0.7)
        reach = base * math.sin(math.pi - apex - at_p) / math.sin(apex)
        c = p + reach * np.array([math.cos(line + side * at_p), math.sin(line + side * at_p)])
        first = self.link(names[0], p, c)
        second = self.link(names[1], c, q)
        self.join(Revolute, a, first, p)
        if kind == "RRR":
            self.join(Revolute, first, second, c)
            self.join(Revolute, b, second, q)
        elif kind == "RRP":  # the second link slides on b, about along the first one
            self.join(Revolute, first, second, c)
            self.slide(b, second, line + side * at_p + math.radians(u(-45.0, 45.0)), q)
        else:  # the second link slides on the first one, about along the line of the pins
            self.slide(first, second, line + math.radians(u(-45.0, 45.0)), c)
            self.join(Revolute, b, second, q)

    def slide(self, a: _Link, b: _Link, direction: float, place: np.ndarray) -> None:
        way = self.rng.uniform(-0.5, 0.5) * np.array([math.cos(direction), math.sin(direction)])
        self.join(Prismatic, a, b, place, place + way, direction)

    def extras(self) -> None:
        """A body welded on, and a link carried by a pin and a rod."""
        host = self.links[f"L{self.rng.integers(1, len(self.links))}"]
        place = self.near(host)
        k = len(self.links)
        weld = self.link(f"L{k}", place, place + self.rng.uniform(0.2, 0.5, 2))
        self.join(Fixed, host, weld, place, place, float(self.rng.uniform(-1.0, 1.0)))
        a, b, p, q = self.two()
        dx, dy = q - p
        apex = p + 0.6 * (q - p) + self.rng.choice([-0.6, 0.6]) * np.array([-dy, dx])
        held = self.link(f"L{k + 1}", p, apex)
        self.join(Revolute, a, held, p)
        self.join(Distance, held, b, apex, q, length=math.dist(apex, q))

    def mass(self, link: _Link, rough: float) -> Body:
        """The link's body: masses, mass centre off its line, a rough guess of its axes."""
        u = self.rng.uniform
        p, q = link.spine
        cg = link.local(0.5 * (p + q) + u(-0.3, 0.3, 2)).tolist()
        kind = self.rng.integers(5) if link.name != "L1" else 4
        mass: dict[str, Any] = {"mass": u(0.3, 4.0), "inertia": u(0.02, 0.5)}
        if kind == 0:
            mass = {"mass": 0.0}
        elif kind == 1:
            mass = {"weight": u(3.0, 40.0), "inertia": u(0.02, 0.5)}
        place: Any = polar(math.hypot(*cg), math.atan2(*cg[::-1])) if u() < 0.4 else tuple(cg)
        x, y, angle = (link.axes + rough * np.array([*u(-1, 1, 2), 2.0 * u(-1, 1)])).tolist()
        return Body(
            link.name, cg=place, points=link.points, guess=Guess(angle=angle, x=x, y=y), **mass
        )

    def loads(self) -> list[Load]:
        """One of every kind, each somewhere."""
        u, rng = self.rng.uniform, self.rng
        moving = [link for name, link in self.links.items() if name != "ground"]

        def some() -> _Link:
            return moving[rng.integers(len(moving))]

        def on(link: _Link) -> Marker:
            return self.mark(link, self.near(link), link.axes[2] + u(-2.0, 2.0))

        def ends() -> tuple[Marker, Marker]:
            a, b, p, q = self.two()
            return self.mark(a, p), self.mark(b, q)

        def pair() -> dict[str, str]:
            a, b = rng.choice(len(self.links), 2, replace=False)
            names = list(self.links)
            return {"body": names[a], "by": names[b]}

        return [
            Gravity("gravity", x=u(-2.0, 2.0), y=-9.81),
            Force("wind", on(some()), Harmonic(u(-5, 5), 10.0, u(1, 9), 0.3), angle=u(-3, 3)),
            Force("thrust", on(some()), u(-20.0, 20.0), angle=u(-3, 3), follows=True),
            Torque("torque", **pair(), value=Polynomial([u(-5, 5), u(-5, 5), 1.0])),
            Spring("spring", *ends(), stiffness=u(10, 50), free_length=u(0, 1), preload=u(-5, 5)),
            Spring("hard spring", *ends(), free_length=0.8, law=Polynomial([2.0, 20.0, 5.0, 30.0])),
            Damper("damper", *ends(), coefficient=u(1.0, 9.0)),
            Damper("hard damper", *ends(), law=Polynomial([0.0, 2.0, 0.3, 1.0])),
            TorsionSpring("twist", **pair(), stiffness=u(1, 9), free_angle=u(-1, 1), preload=1.0),
            TorsionSpring("hard twist", **pair(), law=Polynomial([1.0, 3.0, 0.5, 0.2])),
            TorsionDamper("drag", **pair(), coefficient=u(0.1, 2.0)),
            TorsionDamper("hard drag", **pair(), law=Polynomial([0.0, 0.5, 0.1, 0.05])),
        ]


def random_linkage(
    seed: int, loops: int, *, sliders: bool = False, extras: bool = False, loads: bool = True
) -> tuple[Mechanism, float]:
    """A random driven linkage of one freedom, and the turn of its crank that is safe.

    Parameters
    ----------
    seed : int
        The same seed makes the same linkage.
    loops : int
        A crank-rocker and ``loops − 1`` dyads: 2 + 2·loops links with the ground.
    sliders : bool
        Whether some dyads have a prismatic joint (always the first one).
    extras : bool
        Whether there are also a welded body and a link carried by a Distance rod.
    loads : bool
        Whether a load of every kind acts.

    Returns
    -------
    mechanism : Mechanism
        Bodies L1 (the crank), L2, …; joints J0, J1, …; driver "motor" on L1 with a
        `ConstantAcceleration` law that begins at t = 0 and turns forwards, beyond the safe turn.
    turn : float
        The crank may go from its first angle that far [rad], at most 2π, and stays assembled and
        away from singular positions.
    """
    attempt, turn = _attempt(seed, loops, sliders, extras, loads)
    return _drawn(attempt, seed, loops, sliders, extras, loads), turn


@functools.lru_cache(maxsize=512)
def _attempt(seed: int, loops: int, sliders: bool, extras: bool, loads: bool) -> tuple[int, float]:
    """The first attempt whose crank turns far enough, and how far: what takes time."""
    for attempt in itertools.count():
        turn = safe_turn(_drawn(attempt, seed, loops, sliders, extras, loads))
        if turn >= LEAST_TURN:
            return attempt, turn
    raise AssertionError


def _drawn(
    attempt: int, seed: int, loops: int, sliders: bool, extras: bool, loads: bool
) -> Mechanism:
    """A mechanism of its own at each call, which the caller may change."""
    rng = np.random.default_rng([seed, loops, sliders, extras, attempt])
    draft = _Draft(rng)
    start = draft.four_bar()
    for k in range(loops - 1):
        slides = sliders and (k == 0 or rng.random() < 0.4)
        draft.dyad(str(rng.choice(["RRP", "RPR"])) if slides else "RRR")
    if extras:
        draft.extras()
    acting = draft.loads()
    ground = draft.links.pop("ground")
    mechanism = Mechanism(f"{loops} loops", ground=ground.points, g=float(rng.uniform(9.0, 11.0)))
    rng.shuffle(draft.joints)  # type: ignore[arg-type]
    speed = rng.uniform(1.0, 8.0)
    law = ConstantAcceleration(start, speed, rng.uniform(-0.3, 0.3) * speed**2 / (2.0 * math.pi))
    bodies = [draft.mass(link, 0.04) for link in draft.links.values()]
    mechanism.add(*bodies, *draft.joints, AngleDriver("motor", "L1", law))
    if loads:
        mechanism.add(*acting)
    return mechanism


def safe_turn(mechanism: Mechanism, step: float = math.radians(2.0)) -> float:
    """How far the motor may turn forwards [rad], by marching in small steps on one branch.

    It ends where the smallest singular value of Φ_q falls to 40 % of its first value, a step jumps,
    or the ends of a spring meet; four fifths of that are given, 2π where nothing ends it.
    """
    oracle = Reference(mechanism)
    start = mechanism["motor"].law(0.0)  # type: ignore[attr-defined]
    try:
        q = oracle.close(oracle.guess(), 0.0)
    except ArithmeticError:
        return 0.0
    if np.abs(q - oracle.guess()).max() > 0.4:
        return 0.0  # closed far from the guess: perhaps another branch
    springs = [load for load in mechanism.loads if isinstance(load, Spring | Damper)]
    drive, first = oracle.rows["motor"], None
    steps = round(2.0 * math.pi / step)
    for k in range(steps + 1):
        g = oracle.phi_q(q, 0.0)
        least = float(np.linalg.svd(g, compute_uv=False)[-1])
        first = least if first is None else first
        short = min(
            (math.dist(oracle.point(q, s.i), oracle.point(q, s.j)) for s in springs), default=1
        )
        if first < 0.03 or least < max(0.4 * first, 0.03) or short < 0.15:
            return 0.8 * max(k - 1, 0) * step
        unit = np.zeros(oracle.m)
        unit[drive] = 1.0
        guess = q + step * np.linalg.solve(g, unit)
        try:
            q = oracle.close(guess, 0.0, {"motor": start + (k + 1) * step}, 1e-7)
        except ArithmeticError:
            return 0.8 * max(k - 1, 0) * step
        if np.abs(q - guess).max() > 0.03:
            return 0.8 * max(k - 1, 0) * step
    return 2.0 * math.pi


def times_within(mechanism: Mechanism, turn: float, count: int) -> np.ndarray:
    """Times (count,) from 0 at which the motor has turned evenly through `turn` [rad]."""
    law: Any = mechanism["motor"].law  # type: ignore[attr-defined]
    way = np.linspace(0.0, turn, count)
    v, a = law.speed, law.acceleration
    return 2.0 * way / (v + np.sqrt(v * v + 2.0 * a * way))


def held_bar() -> Mechanism:
    """P at 1 m and Q at 2 m of a bar that a driver holds: O.fy = −(P + Q), effort −(P + 2 Q)."""
    machine = Mechanism("bar")
    machine.add(
        Body("bar", points={"A": (1.0, 0.0), "B": (2.0, 0.0)}),
        Revolute("O", "ground", "bar"),
        AngleDriver("hold", "bar", 0.0),
        Force("P", "bar.A", 0.0, angle=math.pi / 2.0),
        Force("Q", "bar.B", 0.0, angle=math.pi / 2.0),
    )
    return machine
