"""Parallelogram with a third crank: Grübler's formula counts no freedom, and it moves."""

from __future__ import annotations

import numpy as np

import mbody
from mbody import AngleDriver, Body, Gravity, Mechanism, Revolute
from mbody.analysis.position.assembly_analysis import closed
from mbody.laws import ConstantSpeed
from mbody.quantities import deg
from mbody.system.rank import dense, rank_of
from validation.case import Row, Source
from validation.extrapolation import followed

__all__ = ["build", "rows"]

COUNT = Source("grubler_paradox", "rank of the loop equations, by hand")
LAGRANGE = Source("grubler_paradox", "reduced equation of the one freedom: 3 θ″ = T − 3.5 g cos θ")
FREE = Source("grubler_paradox", "the same equation, T = 0, by extrapolation")
PRINT = Source("grubler_paradox", "the same equation by another integrator (references)")
ENERGY = Source("grubler_paradox", "kinetic energy against the work of gravity, integrated beside")
NEWTON = Source("grubler_paradox", "Newton and Euler for the whole and for single links")

g = 9.81  # m/s²
M = 5.0  # kg: three cranks of 1 kg, the coupler 2 kg
theta = deg(60.0)
ALPHA = -3.5 * g / 3.0 * np.cos(theta)  # free fall from rest


def build() -> Mechanism:
    """Three cranks of 1 m at 0, 2 and 4 m, parallel, carry one coupler."""
    places = (0.0, 2.0, 4.0)
    machine = Mechanism("Grübler", ground={f"O{k}": (x, 0.0) for k, x in enumerate(places, 1)})
    for k in (1, 2, 3):
        machine.add(mbody.makers.bar(f"crank{k}", 1.0, mass=1.0, ends=("O", "A"), guess=theta))
    machine.add(
        Body(
            "coupler",
            mass=2.0,
            inertia=0.0,
            cg=(2.0, 0.0),
            points={f"A{k}": (x, 0.0) for k, x in enumerate(places, 1)},
        )
    )
    for k in (1, 2, 3):
        machine.add(
            Revolute(f"O{k}", f"ground.O{k}", f"crank{k}.O"),
            Revolute(f"A{k}", f"crank{k}.A", f"coupler.A{k}"),
        )
    machine.add(
        Gravity("gravity", y=-g),
        AngleDriver("motor", "crank1", ConstantSpeed(theta, 0.0)),
    )
    return machine


def rows() -> list[Row]:
    system = mbody.assemble(build())
    return [*counted(system), *driven(system), *moving()]


def counted(system: mbody.System) -> list[Row]:
    """Rank of the joints alone, then with the motor."""
    G = dense(system, closed(system, 0.0, {}).work)[1]
    joints, all_ = rank_of(G[:12]), rank_of(G)
    exact = "a count is exact"
    return [
        COUNT.absolute("coordinates", joints.coordinates, 12, 0.0, exact),
        COUNT.absolute("rows of the joints", joints.rows, 12, 0.0, exact),
        COUNT.absolute("rank of the joints", joints.rank, 11, 0.0, exact),
        COUNT.absolute("redundant rows", joints.redundant, 1, 0.0, exact),
        COUNT.absolute("degrees of freedom of the joints", joints.free, 1, 0.0, exact),
        COUNT.absolute("rank with the motor", all_.rank, 12, 0.0, exact),
        COUNT.absolute("degrees of freedom with the motor", all_.free, 0, 0.0, exact),
    ]


def driven(system: mbody.System) -> list[Row]:
    """At 60°, some speeds and accelerations; the third one is free fall from rest."""
    omega, alpha = np.array([0.0, 3.0, 0.0, 5.0]), np.array([0.0, 0.0, ALPHA, 20.0])
    run = mbody.kinetostatics(system, drive={"motor": (np.full(4, theta), omega, alpha)})
    u, n = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
    reason = "weight 49 N × closing of the loops 1e-13 × condition of their equations, below 100"
    small = 100 * 1e-13 * M * g

    # the whole: ΣO = Σ m a + M g; mass centres of cranks at 1/2, of the coupler at 1
    O = [run.reaction(f"O{k}", on=f"crank{k}") for k in (1, 2, 3)]
    A = [run.reaction(f"A{k}", on=f"crank{k}") for k in (1, 2, 3)]
    # 3 · 1/2 + 2 · 1 = 3.5 kg·m
    a = 3.5 * (np.outer(n, alpha) - np.outer(u, omega**2))
    total = np.array([sum(pin.fx for pin in O), sum(pin.fy for pin in O)])
    T = run.effort("motor")
    found = [
        LAGRANGE.absolute(
            "torque of the motor", T, 3.0 * alpha + 3.5 * g * np.cos(theta), small, reason, "N·m"
        ),
        LAGRANGE.absolute("torque in free fall from rest", T[2], 0.0, small, reason, "N·m"),
        NEWTON.absolute("sum of the forces at O, x", total[0], a[0], small, reason, "N"),
        NEWTON.absolute("sum of the forces at O, y", total[1], a[1] + M * g, small, reason, "N"),
    ]
    # an idle crank, about its pivot: α/3 = −g/2 cos θ + n·F, the part of F across the crank
    across = alpha / 3.0 + 0.5 * g * np.cos(theta)
    for k in (2, 3):
        ours = n[0] * A[k - 1].fx + n[1] * A[k - 1].fy
        quantity = f"force at A{k} across crank {k}"
        found.append(NEWTON.absolute(quantity, ours, across, small, reason, "N"))
    # the parts along the cranks may carry any (1, −2, 1): x and y of all six pins stay open
    undetermined = sum(not part for pin in (*O, *A) for part in pin.unique or ())
    exact = "a count is exact"
    count = COUNT.absolute("components of pin forces left open", undetermined, 12, 0.0, exact)
    work = run.checks.virtual_work
    return [
        *found,
        count,
        NEWTON.absolute("virtual work", work, 0.0, 1e-11, "part of the peak; as the forces"),
    ]


def moving() -> list[Row]:
    """Without its motor, from rest: 11 of 12 rows hold it, fewer in the change points it passes."""
    machine = build().without("motor")
    found = []
    for time in (1.0, 5.0):
        machine.simulation = mbody.SimulationSettings(
            time, {"crank1": {"angle": theta}}, rtol=1e-12
        )
        run = mbody.simulate(machine, instants=101)
        crank, steps = run["crank1"], run.stats["steps"]
        exact = followed(
            lambda y: np.array([y[1], -3.5 * g / 3.0 * np.cos(y[0])]), np.array([theta, 0.0]), time
        )
        small, reason = steps * 1e-12, "steps × 1e-12, were the errors of all steps to add up"
        told = f"free, after {time:g} s"
        swift = small * float(np.abs(crank.omega).max())
        found += [
            FREE.absolute(f"{told}, θ", crank.angle[-1], exact[0], small, reason, "rad"),
            FREE.absolute(f"{told}, θ′", crank.omega[-1], exact[1], swift, reason, "rad/s"),
        ]
        if time == 1.0:
            found += [
                PRINT.printed(f"{told}, θ", crank.angle[-1], "-2.69002479", "rad"),
                PRINT.printed(f"{told}, θ′", crank.omega[-1], "-5.46003533", "rad/s"),
            ]
        # single pin forces along the cranks are not unique, their sum is: Σ m a + weight
        c, s = np.cos(crank.angle), np.sin(crank.angle)
        a = 3.5 * np.array([-s, c]) * crank.alpha - 3.5 * np.array([c, s]) * crank.omega**2
        pins = [run.reaction(f"O{k}", on=f"crank{k}") for k in (1, 2, 3)]
        total = np.array([sum(pin.fx for pin in pins), sum(pin.fy for pin in pins)])
        balance = np.abs(run.energy.balance).max() / run.energy.size
        a[1] += M * g
        told = f"free, {time:g} s"
        found += [
            NEWTON.relative(f"{told}, forces at O", total, a, small, reason, "N"),
            ENERGY.absolute(f"{told}, balance, relative", balance, 0.0, small, reason),
        ]
    return found
