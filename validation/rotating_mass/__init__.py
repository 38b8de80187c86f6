"""A mass on a link at constant speed, as Newton and as d'Alembert see it."""

from __future__ import annotations

import numpy as np

import mbody
from mbody.quantities import deg
from validation.case import EPS, Row, Source

__all__ = ["build", "rows"]

NEWTON = Source("rotating_mass", "Newton: F12 = m r ω² towards the centre (Ferdowsi lecture)")
DALEMBERT = Source("rotating_mass", "d'Alembert: statics with −m a applied (Ferdowsi lecture)")

m, r, omega = 2.0, 0.3, 20.0  # kg, m, rad/s: any numbers do


def build() -> mbody.Mechanism:
    """Link 2 is massless; its point mass sits at radius r."""
    machine = mbody.Mechanism("rotating mass", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("link", mass=m, cg=(r, 0.0), points={"O": (0.0, 0.0), "M": (r, 0.0)}),
        mbody.Revolute("O", "ground.O", "link.O"),
        mbody.AngleDriver("motor", "link", mbody.laws.ConstantSpeed(deg(40.0), omega)),
    )
    return machine


def rows() -> list[Row]:
    run = mbody.kinetostatics(build(), turn="motor", instants=37)
    F12 = run.reaction("O", on="link")
    size = m * r * omega**2
    rounding = "20 roundings of 2.2e-16 in cos, sin and their products"
    theta = deg(40.0) + np.linspace(0.0, 2.0 * np.pi, 37)
    centre = -np.array([np.cos(theta), np.sin(theta)])
    small = 20 * EPS

    # d'Alembert: the force to apply, from the same run, on the same link at rest
    fx, fy, torque = run.inertia("link")
    at_rest = build()
    at_rest.add(mbody.Force.components("-m a", "link.M", fx[0], fy[0]))
    still = mbody.statics(at_rest)
    S12 = still.reaction("O", on="link")
    return [
        NEWTON.relative("|F12|, whole turn", F12.magnitude, size, small, rounding, "N"),
        NEWTON.relative(
            "F12 (x, y), whole turn", [F12.fx, F12.fy], size * centre, small, rounding, "N"
        ),
        NEWTON.absolute(
            "T12, whole turn", run.effort("motor"), 0.0, small * size * r, rounding, "N·m"
        ),
        DALEMBERT.relative("−m a (x, y)", [fx, fy], -size * centre, small, rounding, "N"),
        DALEMBERT.absolute("−I α of a point mass", torque, 0.0, small * size * r, rounding, "N·m"),
        DALEMBERT.relative(
            "F12 (x, y) at rest under −m a",
            [S12.fx[0], S12.fy[0]],
            [F12.fx[0], F12.fy[0]],
            small,
            rounding,
            "N",
        ),
        DALEMBERT.absolute(
            "T12 at rest under −m a", still.effort("motor"), 0.0, small * size * r, rounding, "N·m"
        ),
    ]
