"""Masses on springs: free, damped, forced, at resonance, and two that swap their energy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import mbody
from mbody import Body, Damper, Force, Mechanism, Prismatic, SimulationSettings, Spring
from mbody.laws import Harmonic
from validation.case import Row, Source

__all__ = ["build", "rows"]

CASE = "oscillators"
RAYLEIGH = Source(CASE, "Rayleigh, The Theory of Sound, chapters III and IV, closed forms")
ENERGY = Source(CASE, "½ k A², the energy of the start")

Array = np.ndarray

m, k = 2.0, 50.0  # kg, N/m: ω = 5 rad/s
OMEGA = math.sqrt(k / m)
PERIODS = 10
RTOL = 1e-12
REASON = "ten periods in some hundred steps of 1e-12, and between them a polynomial"
CLOSE = 1e-9


def build(*loads: Any, x: float = 0.1, v: float = 0.0) -> Mechanism:
    """A block on a rail between a wall and the loads that are given, its spring slack at x = 0."""
    machine = Mechanism("oscillator", ground={"W": (-1.0, 0.0)})
    machine.add(
        Body("block", mass=m, guess=(x, 0.0, 0.0)),
        Prismatic("rail", "ground", "block"),
        Spring("spring", "ground.W", "block", stiffness=k, free_length=1.0),
        *loads,
    )
    start = {"block": {"x": x, "vx": v}}
    machine.simulation = SimulationSettings(
        PERIODS * 2.0 * math.pi / OMEGA, start, rtol=RTOL, instants=101
    )
    return machine


def rows() -> list[Row]:
    return [*free(), *damped(), *forced(), *two()]


def compared(name: str, machine: Mechanism, exact: Any) -> list[Row]:
    """Displacement and rate of the block over ten periods against x(t), v(t)."""
    run = mbody.simulate(machine)
    x, v = exact(run.t)
    block = run["block"]
    return [
        RAYLEIGH.relative(f"{name}, x(t)", block.x, x, CLOSE, REASON, "m"),
        RAYLEIGH.relative(f"{name}, v(t)", block.vx, v, CLOSE, REASON, "m/s"),
    ]


def free() -> list[Row]:
    """x = A cos ω t + v₀/ω sin ω t."""

    def exact(t: Array) -> tuple[Array, Array]:
        c, s = np.cos(OMEGA * t), np.sin(OMEGA * t)
        return 0.1 * c + 0.3 / OMEGA * s, 0.3 * c - 0.1 * OMEGA * s

    run = mbody.simulate(build())
    energy = run.energy.kinetic + 0.5 * k * run["block"].x ** 2
    kept = ENERGY.relative("free, energy", energy, 0.5 * k * 0.1**2, CLOSE, REASON, "J")
    return [*compared("free", build(v=0.3), exact), kept]


def damped() -> list[Row]:
    """Below critical damping, at it, and above; of the last the ends of motions, where a step ends:
    stability, not accuracy, limits its steps, and between them is less than rtol promises.
    """
    found = []
    for zeta in (0.1, 1.0, 2.0):
        c = 2.0 * zeta * m * OMEGA

        def exact(t: Array, zeta: float = zeta) -> tuple[Array, Array]:
            # x = (x₀ C + (v₀ + ζ ω x₀) S) e^(−ζ ω t), at x₀ = 0.1 m from rest
            d, wide = zeta * OMEGA, OMEGA * math.sqrt(abs(1.0 - zeta**2))
            if zeta < 1.0:
                C, S = np.cos(wide * t), np.sin(wide * t) / wide
            elif zeta > 1.0:
                C, S = np.cosh(wide * t), np.sinh(wide * t) / wide
            else:
                C, S = np.ones(len(t)), t
            fade = 0.1 * np.exp(-d * t)
            return fade * (C + d * S), -fade * OMEGA**2 * S

        damper = Damper("damper", "ground.W", "block", coefficient=c)
        if zeta <= 1.0:
            found += compared(f"damped, ζ = {zeta:g}", build(damper), exact)
        else:
            ends = np.array([0.5, 1.0, 2.0, 5.0])
            runs = [mbody.simulate(build(damper), end, times=[end])["block"] for end in ends]
            ours = np.array([(run.x[0], run.vx[0]) for run in runs]).T
            told = f"damped, ζ = {zeta:g}, after 0.5 to 5 s"
            for name, mine, theirs in zip("xv", ours, exact(ends), strict=True):
                unit = "m" if name == "x" else "m/s"
                found.append(
                    RAYLEIGH.relative(f"{told}, {name}", mine, theirs, CLOSE, REASON, unit)
                )
    return found


def forced() -> list[Row]:
    """A harmonic force beside resonance and at it, from rest at x = 0."""
    F, near = 0.2, 0.8 * OMEGA  # so little that the spring is not turned over

    def beside(t: Array) -> tuple[Array, Array]:
        part = F / m / (OMEGA**2 - near**2)
        x = part * (np.sin(near * t) - near / OMEGA * np.sin(OMEGA * t))
        return x, part * near * (np.cos(near * t) - np.cos(OMEGA * t))

    def at_it(t: Array) -> tuple[Array, Array]:
        part, turn = 0.5 * F / (m * OMEGA), OMEGA * t
        return part * (np.sin(turn) / OMEGA - t * np.cos(turn)), part * turn * np.sin(turn)

    found = []
    for name, rate, exact in (("beside resonance", near, beside), ("resonance", OMEGA, at_it)):
        push = Force("push", "block", Harmonic(0.0, F, rate, 0.0), angle=0.0)
        found += compared(name, build(push, x=0.0), exact)
    return found


def two() -> list[Row]:
    """Two equal blocks between three springs: one begins, the other takes over, by two modes."""
    soft = 4.0
    machine = Mechanism("beats", ground={"W": (-1.0, 0.0), "E": (2.0, 0.0)})
    machine.add(
        Body("a", mass=m, guess=(0.1, 0.0, 0.0)),
        Body("b", mass=m, guess=(1.0, 0.0, 0.0)),
        Prismatic("rail_a", "ground", "a"),
        Prismatic("rail_b", "ground", "b"),
        Spring("left", "ground.W", "a", stiffness=k, free_length=1.0),
        Spring("between", "a", "b", stiffness=soft, free_length=1.0),
        Spring("right", "b", "ground.E", stiffness=k, free_length=1.0),
    )
    start = {"a": {"x": 0.1}, "b": {"x": 1.0}}
    machine.simulation = SimulationSettings(
        PERIODS * 2.0 * math.pi / OMEGA, start, rtol=RTOL, instants=101
    )
    run = mbody.simulate(machine)
    slow, fast = np.cos(OMEGA * run.t), np.cos(math.sqrt((k + 2.0 * soft) / m) * run.t)
    ours = np.array([run["a"].x, run["b"].x - 1.0])
    exact = 0.05 * np.array([slow + fast, slow - fast])
    return [
        RAYLEIGH.relative(f"two masses, x of the {name}", mine, theirs, CLOSE, REASON, "m")
        for name, mine, theirs in zip(("first", "second"), ours, exact, strict=True)
    ]
