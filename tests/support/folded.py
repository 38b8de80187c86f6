"""Linkages with all links in line, and their motion on each branch in closed form.

On a branch all angles follow the crank's, θ, by a formula that has no singular position: J(θ) θ̈ +
½ J′(θ) θ̇² = −V′(θ) then is an ordinary equation, integrated by scipy.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

from mbody import Body, Gravity, Mechanism, Revolute, SimulationSettings

G = 9.81
NAMES = ("crank", "coupler", "rocker")


def four_bar(lengths, masses=(1.0, 2.0, 1.0), centres=(0.5, 0.5, 0.5), gravity=G, guess=(0, 0, 0)):
    """Rods of lengths (crank, coupler, rocker, ground); mass centres as parts of the lengths."""
    machine = Mechanism("folded", ground={"O": (0.0, 0.0), "C": (lengths[3], 0.0)})
    for name, length, mass, part, angle in zip(
        NAMES, lengths, masses, centres, guess, strict=False
    ):
        machine.add(
            Body(
                name,
                mass=mass,
                inertia=mass * length**2 / 12.0,
                cg=(part * length, 0.0),
                points={"E": (length, 0.0)},
                guess=float(angle),
            )
        )
    machine.add(
        Revolute("O", "ground.O", "crank"),
        Revolute("A", "crank.E", "coupler"),
        Revolute("B", "coupler.E", "rocker.E"),
        Revolute("C", "ground.C", "rocker"),
    )
    if gravity:
        machine.add(Gravity("gravity", y=-gravity))
    return machine


def asked(machine, start, until=0.3, instants=31, rtol=1e-12, **more):
    """The machine with its initial state."""
    machine.simulation = SimulationSettings(until, start, instants=instants, rtol=rtol, **more)
    return machine


# -- angles of (coupler, rocker) and two derivatives, as functions of the crank's --------------


def parallel(lengths):
    """Parallelogram: the coupler keeps its direction."""
    return lambda theta: ((0.0, 0.0, 0.0), (theta, 1.0, 0.0))


def half_tangents(ratio):
    """φ with tan(φ/2) = ratio · tan(θ/2)."""

    def angle(theta):
        c, s = math.cos(0.5 * theta), math.sin(0.5 * theta)
        down = c * c + ratio**2 * s * s
        value = 2.0 * math.atan2(ratio * s, c)
        return value, ratio / down, -ratio * (ratio**2 - 1.0) * math.sin(theta) / (2.0 * down**2)

    return angle


def antiparallel(lengths):
    """Contra-parallelogram: tan(φ/2) = −(b + a)/(b − a) tan(θ/2), the coupler at θ + φ."""
    a, b = lengths[:2]
    rocker = half_tangents(-(b + a) / (b - a))

    def angles(theta):
        phi = rocker(theta)
        return (theta + phi[0], 1.0 + phi[1], phi[2]), phi

    return angles


def kite(lengths):
    """Crank as long as the ground, coupler as the rocker: both lean from the axis at θ/2."""
    a, b = lengths[:2]
    k = a / b

    def angles(theta):
        u = 0.5 * theta
        root = math.sqrt(1.0 - (k * math.sin(u)) ** 2)
        lean = math.asin(k * math.sin(u))
        first = 0.5 * k * math.cos(u) / root
        second = -0.25 * k * (1.0 - k * k) * math.sin(u) / root**3
        return (u - lean, 0.5 - first, -second), (u + lean, 0.5 + first, second)

    return angles


# -- motion ----------------------------------------------------------------------------------


def unit(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def arm(length, angle):
    """A vector of that length, and its derivatives by θ; angle (value, first, second)."""
    value, first, second = angle
    e, n = unit(value), unit(value + 0.5 * math.pi)
    return length * np.array([e, n * first, n * second - e * first**2])


class Bodies:
    """Rods of one freedom: a list of (mass, inertia, centre and derivatives, angle ...) of θ."""

    def __init__(self, parts, gravity=G):
        self.parts, self.gravity = parts, gravity

    def acceleration(self, theta, rate):
        inertia = change = drive = 0.0
        for mass, turning, centre, angle in self.parts(theta):
            inertia += mass * centre[1] @ centre[1] + turning * angle[1] ** 2
            change += 2.0 * (mass * centre[1] @ centre[2] + turning * angle[1] * angle[2])
            drive += mass * self.gravity * centre[1][1]
        return (-drive - 0.5 * change * rate**2) / inertia

    def motion(self, theta, rate, times):
        """θ, θ̇ and θ̈ at the times."""
        found = solve_ivp(
            lambda t, y: [y[1], self.acceleration(*y)],
            (0.0, times[-1]),
            [theta, rate],
            t_eval=times,
            rtol=1e-13,
            atol=1e-14,
            method="DOP853",
        )
        return (*found.y, np.array([self.acceleration(*y) for y in found.y.T]))


def linkage(angles, lengths, masses=(1.0, 2.0, 1.0), centres=(0.5, 0.5, 0.5), gravity=G):
    """The rods of `four_bar` on the branch that `angles` gives."""
    a, b, c, d = lengths

    def parts(theta):
        coupler, rocker = angles(theta)
        crank = (theta, 1.0, 0.0)
        base = np.array([[d, 0.0], [0.0, 0.0], [0.0, 0.0]])
        places = (
            arm(centres[0] * a, crank),
            arm(a, crank) + arm(centres[1] * b, coupler),
            base + arm(centres[2] * c, rocker),
        )
        each = zip(masses, (a, b, c), places, (crank, coupler, rocker), strict=True)
        return [(m, m * length**2 / 12.0, at, angle) for m, length, at, angle in each]

    return Bodies(parts, gravity)


# -- windows in a row --------------------------------------------------------------------------

POST, ROD = 1.0, 2.0


def windows(count):
    """Posts of different masses, joined by rods, all in line."""
    machine = Mechanism("windows", ground={f"P{k}": (ROD * k, 0.0) for k in range(count + 1)})
    for k in range(count + 1):
        machine.add(
            Body(
                f"c{k}",
                mass=1.0 + 0.3 * k,
                inertia=0.1,
                cg=(0.5 * POST, 0.0),
                points={"E": (POST, 0.0)},
                guess=0.0,
            ),
            Revolute(f"O{k}", f"ground.P{k}", f"c{k}"),
        )
    for k in range(count):
        machine.add(
            Body(
                f"r{k}",
                mass=2.0,
                inertia=0.4,
                cg=(0.5 * ROD, 0.0),
                points={"E": (ROD, 0.0)},
                guess=0.0,
            ),
            Revolute(f"A{k}", f"c{k}.E", f"r{k}"),
            Revolute(f"B{k}", f"r{k}.E", f"c{k + 1}.E"),
        )
    machine.add(Gravity("gravity", y=-G))
    return machine


def in_row(turned):
    """`windows` of which some, as `turned` says, are crossed."""
    count = len(turned)
    own = -(ROD + POST) / (ROD - POST)
    ratios = np.cumprod([1.0, *(own if one else 1.0 for one in turned)])
    posts = [half_tangents(ratio) for ratio in ratios]

    def parts(theta):
        angles, found = [post(theta) for post in posts], []
        for k, angle in enumerate(angles):
            base = np.array([[ROD * k, 0.0], [0.0, 0.0], [0.0, 0.0]])
            found.append((1.0 + 0.3 * k, 0.1, base + arm(0.5 * POST, angle), angle))
        for k in range(count):
            base = np.array([[ROD * k, 0.0], [0.0, 0.0], [0.0, 0.0]]) + arm(POST, angles[k])
            rod = (0.0, 0.0, 0.0)
            if turned[k]:
                rod = tuple(
                    one + other for one, other in zip(angles[k], angles[k + 1], strict=True)
                )
            found.append((2.0, 0.4, base + arm(0.5 * ROD, rod), rod))
        return found

    return Bodies(parts), ratios
