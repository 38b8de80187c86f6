"""Pendulums of 2, 3, 5 and 10 equal rods, released level, against Lagrange's equations."""

from __future__ import annotations

import numpy as np

import mbody
from mbody import Gravity, Mechanism, Revolute, SimulationSettings, makers
from validation.case import Row, Source
from validation.extrapolation import followed

__all__ = ["build", "rows"]

CASE = "chain_pendulums"
LAGRANGE = Source(CASE, "Lagrange's equations in the angles of the rods, by extrapolation")
ENERGY = Source(CASE, "kinetic energy against the work of gravity, integrated beside")

Array = np.ndarray

g = 9.81  # m/s²
#: Time [s] by the number of rods.
TIMES = {2: 2.0, 3: 2.0, 5: 1.5, 10: 1.0}
RTOL = 1e-12
REASON = "steps × 1e-12, were the errors of all steps to add up"


def build(count: int = 2) -> Mechanism:
    """SlenderRod rods of 1 m and 1 kg, one from the end of the other, all level and at rest."""
    machine, place = Mechanism(f"pendulum of {count} rods"), "ground"
    for n in range(count):
        machine.add(makers.bar(f"rod{n}", 1.0, mass=1.0, ends=("A", "B"), guess=0.0))
        machine.add(Revolute(f"pin{n}", place, f"rod{n}.A"))
        place = f"rod{n}.B"
    machine.add(Gravity("gravity", y=-g))
    machine.simulation = SimulationSettings(
        TIMES.get(count, 1.0), {f"rod{n}": {"angle": 0.0} for n in range(count)}, rtol=RTOL
    )
    return machine


def rows() -> list[Row]:
    found = []
    for count, time in TIMES.items():
        run = mbody.simulate(build(count), instants=2)
        names = [f"rod{n}" for n in range(count)]
        exact = lagrange(count, time)
        angles = np.array([run[name].angle[-1] for name in names])
        rates = np.array([run[name].omega[-1] for name in names])
        told = f"{count} rods, {time:g} s"
        balance = np.abs(run.energy.balance).max() / run.energy.size
        small = run.stats["steps"] * RTOL
        swift = small * float(np.abs(exact[1]).max())
        found += [
            LAGRANGE.absolute(f"{told}, angles", angles, exact[0], small, REASON, "rad"),
            LAGRANGE.absolute(f"{told}, rates", rates, exact[1], swift, REASON, "rad/s"),
            ENERGY.absolute(f"{told}, balance, relative", balance, 0.0, small, REASON),
        ]
    return found


def lagrange(count: int, time: float) -> tuple[Array, Array]:
    """Angles and rates [rad, rad/s] after a time: no joint, no constraint, no multiplier.

    Σ_j a_ij (cos(θ_i − θ_j) θ_j″ + sin(θ_i − θ_j) θ_j′²) + b_i g cos θ_i = 0, with what hangs on
    each rod: b_i = 1/2 + rods below i, a_ii = 1/3 + rods below i, a_ij = b of the lower one.
    """
    n = np.arange(count)
    b = 0.5 + (count - 1 - n)
    a = b[np.maximum(n[:, None], n)] - np.diag(np.full(count, 0.5 - 1.0 / 3.0))

    def slope(y: Array) -> Array:
        theta, omega = y
        apart = theta[:, None] - theta
        drive = -(a * np.sin(apart)) @ omega**2 - b * g * np.cos(theta)
        return np.array([omega, np.linalg.solve(a * np.cos(apart), drive)])

    theta, omega = followed(slope, np.zeros((2, count)), time)
    return theta, omega
