"""Small oscillations about rest: pendulums, a loaded string, damping, machines that turn."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Any

import numpy as np

import mbody
from mbody import gallery
from mbody.analysis.linear.modes import ModesAt
from mbody.engineering import close_loops
from validation import porter_governor
from validation.case import Row, Source

__all__ = ["build", "rows"]

CASE = "small_oscillations"
RAYLEIGH = Source(CASE, "Rayleigh, The Theory of Sound, closed forms")
RODS = Source(CASE, "two equal rods: det(K − ω² M) = 0 by hand")
ZIEGLER = Source(CASE, "Ziegler 1952: 2 s⁴ + (7 − 2 P l/k) s² + 1 = 0")
POTENTIAL = Source(CASE, "potential of the plane that turns, differentiated numerically")

g = 9.81  # m/s²

STIFF = 1e-11, "differences of fourth order with a step of 1e-3: 1e-12 of the forces, times a few"
#: Of the closed form: differences of its exact gradient.
SLOPE = 1e-10, "differences of the closed form: its rounding of 2.2e-16 over a step of 1e-5"


def build() -> mbody.Mechanism:
    """A slender rod of 1.2 m and 2 kg, hung from its end."""
    return hung(rod("rod"), mbody.Revolute("O", "ground", "rod"))


def rod(name: str, l: float = 1.2, m: float = 2.0, **own: Any) -> mbody.Body:
    points = {"B": (l, 0.0)}
    return mbody.Body(
        name, mass=m, inertia=m * l**2 / 12.0, cg=(0.5 * l, 0.0), points=points, **own
    )


def hung(*elements: Any) -> mbody.Mechanism:
    machine = mbody.Mechanism("small oscillations", ground={"W": (0.0, 0.0)})
    machine.add(*elements, mbody.Gravity("gravity", y=-g))
    return machine


def first(machine: mbody.Mechanism) -> ModesAt:
    """The modes at the first stable position."""
    return mbody.modes(machine, at=mbody.equilibrium(machine).stable[0])[0]


def rows() -> list[Row]:
    return [*pendulum(), *rods(), *loaded_string(), *damped(), *flutter(), *spinning()]


def pendulum() -> list[Row]:
    """Hanging and upright."""
    omega = math.sqrt(3.0 * g / (2.0 * 1.2))
    hanging, upright = mbody.modes(build())
    return [
        RAYLEIGH.relative("hanging rod, ω", hanging[0].frequency, omega, *STIFF, "rad/s"),
        RAYLEIGH.relative("upright rod, growth", -upright[0].decay_rate, omega, *STIFF, "1/s"),
    ]


def rods() -> list[Row]:
    """Two equal rods, one from the other."""
    machine = hung(
        rod("a", guess=-1.5),
        rod("b", guess=-1.6),
        mbody.Revolute("O", "ground", "a"),
        mbody.Revolute("B", "a.B", "b"),
    )
    squares = first(machine).frequencies ** 2
    exact = [(3.0 + sign * 6.0 / math.sqrt(7.0)) * g / 1.2 for sign in (-1.0, 1.0)]
    named = zip(("first", "second"), squares, exact, strict=True)
    return [RODS.relative(f"two rods, {n} ω²", a, b, *STIFF, "rad²/s²") for n, a, b in named]


def loaded_string() -> list[Row]:
    """Five masses between springs on a rail."""
    n, m, k = 5, 0.5, 200.0
    machine = mbody.Mechanism("string", ground={"W0": (0.0, 0.0), "W6": (6.0, 0.0)})
    for i in range(1, n + 1):
        machine.add(mbody.Body(f"b{i}", mass=m, guess=(float(i), 0.0, 0.0)))
        machine.add(mbody.Prismatic(f"rail{i}", "ground", f"b{i}"))
    places = ["ground.W0", *(f"b{i}" for i in range(1, n + 1)), "ground.W6"]
    for i in range(n + 1):
        ends = places[i], places[i + 1]
        machine.add(mbody.Spring(f"s{i}", *ends, stiffness=k, free_length=1.0))
    order = np.arange(1, n + 1)
    exact = 2.0 * math.sqrt(k / m) * np.sin(order * math.pi / (2 * n + 2))
    mine = first(machine).frequencies
    return [RAYLEIGH.relative("five masses between springs, all ω", mine, exact, *STIFF, "rad/s")]


def damped() -> list[Row]:
    """A block on a spring and a dashpot."""
    m, k, zeta = 2.0, 50.0, 0.3
    omega = math.sqrt(k / m)
    machine = mbody.Mechanism("damped", ground={"W": (-1.0, 0.0)})
    machine.add(
        mbody.Body("block", mass=m),
        mbody.Prismatic("rail", "ground", "block"),
        mbody.Spring("spring", "ground.W", "block", stiffness=k, free_length=1.0),
        mbody.Damper("damper", "ground.W", "block", coefficient=2.0 * zeta * m * omega),
    )
    mode = first(machine)[0]
    swing = omega * math.sqrt(1.0 - zeta**2)
    return [
        RAYLEIGH.relative("damped block, ζ", mode.damping_ratio, zeta, *STIFF),
        RAYLEIGH.relative("damped block, frequency", mode.frequency, swing, *STIFF, "rad/s"),
    ]


def flutter() -> list[Row]:
    """Ziegler's two rods without weight, masses 2m and m at their ends."""
    load = 2.5
    machine = mbody.Mechanism("column")
    machine.add(
        mbody.Body("a", mass=2.0, cg=(1.0, 0.0), points={"B": (1.0, 0.0)}),
        mbody.Body("b", mass=1.0, cg=(1.0, 0.0)),
        mbody.Revolute("O", "ground", "a"),
        mbody.Revolute("B", "a.B", "b"),
        mbody.TorsionSpring("k1", "ground", "a", 1.0),
        mbody.TorsionSpring("k2", "a", "b", 1.0),
        mbody.Force("P", "b", load, angle=math.pi, follows=True),
    )
    grows = mbody.modes(machine, at=close_loops(machine))[0][1].eigenvalue
    exact = cmath.sqrt((2.0 * load - 7.0 + 1j * math.sqrt(8.0 - (7.0 - 2.0 * load) ** 2)) / 4.0)
    return [
        ZIEGLER.relative("column at P l/k = 2.5, growth", grows.real, exact.real, *STIFF),
        ZIEGLER.relative("column at P l/k = 2.5, frequency", grows.imag, exact.imag, *STIFF),
    ]


def spinning() -> list[Row]:
    """Porter's machine of the gallery and of its case, and Watt's, at 126.5 rpm."""
    speed = porter_governor.REFERENCE[0.2] * math.pi / 30.0
    loaded = gallery.load("porter_governor")
    gallery_speed = 120.0 * math.pi / 30.0
    found = [at_speed("Porter, gallery", loaded, porter_governor.M, gallery_speed)]
    for name, sleeve in (("Porter", porter_governor.M), ("Watt", 0.0)):
        machine = porter_governor.build(sleeve=sleeve)
        machine = mbody.assemble(machine).with_values({"field.speed": speed})
        found.append(at_speed(f"{name}, 126.5 rpm", machine, sleeve, speed))
    return found


def at_speed(
    name: str, machine: mbody.Mechanism | mbody.System, sleeve: float, omega: float
) -> Row:
    """One machine at one speed."""
    m, l = porter_governor.m, porter_governor.l
    rest = math.acos((m + sleeve) * g / (m * omega**2 * l))

    def potential(theta: complex) -> complex:
        weights = -2.0 * (m + sleeve) * g * l * cmath.cos(theta)
        return weights - m * (omega * l * cmath.sin(theta)) ** 2

    inertia = 2.0 * l**2 * (m + 2.0 * sleeve * math.sin(rest) ** 2)
    exact = math.sqrt(curvature(potential, rest) / inertia)
    stable = mbody.equilibrium(machine, free="theta").stable[0]
    mode = mbody.modes(machine, at=stable, free="theta")[0][0]
    return POTENTIAL.relative(f"{name}, ω", mode.frequency, exact, *SLOPE, "rad/s")


def curvature(potential: Callable[[complex], complex], x: float, h: float = 1e-5) -> float:
    """Second derivative: differences of the gradient, which a complex step gives exactly."""
    after, before = (potential(x + sign * h + 1e-30j).imag / 1e-30 for sign in (1.0, -1.0))
    return (after - before) / (2.0 * h)
