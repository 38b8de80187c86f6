"""Limiting traction and braking of a vehicle, with load transfer.

The lecture, step by step. A chassis on two wheels that roll without slip; of its three equations
of motion one gives the acceleration, one the sum of the axle loads, and the moment about the mass
centre their difference: the load moves to the rear axle when it speeds up. At the limit the wheels
that drive (or brake) use the whole friction, T = μ N. Nothing of this is typed here as a formula
for mbody: the model is a chassis and wheels, and `solve_for` finds the greatest acceleration
that no wheel answers with slip or lift.
"""

from __future__ import annotations

import numpy as np

import mbody
from mbody import gallery
from validation.case import EPS, Row, Source

__all__ = ["build", "rows"]

BOOK = Source("vehicle", "Waldron and Kinzel, limiting traction, closed form (references)")
MOMENTS = Source("vehicle", "moments about the wheels' contacts, closed form (this file)")
SWEEP = Source("vehicle", "closed form, over friction and over the height of the mass centre")

W, b, c, h, r, mu, g = 4000.0, 40.0, 50.0, 25.0, 14.5, 0.8, 386.4  # lbf, in, in/s²

#: Force [lbf], acceleration [g], axle loads [lbf], torque of all driven axles [lbf·in].
REFERENCE = {
    "front_drive": (
        1454.5454545454545,
        0.36363636363636365,
        1818.1818181818182,
        2181.818181818182,
        21090.909090909092,
    ),
    "rear_drive": (
        1828.5714285714287,
        0.4571428571428572,
        1714.2857142857142,
        2285.714285714286,
        26514.285714285717,
    ),
    "all_drive": (3200.0, 0.8, 1333.3333333333333, 2666.666666666667, 46400.0),
    "front_brake": (
        -2285.714285714286,
        -0.5714285714285714,
        2857.1428571428573,
        1142.8571428571427,
        -33142.857142857145,
    ),
    "rear_brake": (
        -1163.6363636363637,
        -0.29090909090909095,
        2545.4545454545455,
        1454.5454545454545,
        -16872.727272727276,
    ),
    "all_brake": (-3200.0, -0.8, 3111.1111111111113, 888.8888888888887, -46400.0),
}
#: The forces as problems.md prints them, without sign.
PRINT = {
    "front_drive": ("1454.545", "0.3636"),
    "rear_drive": ("1828.571", "0.4571"),
    "all_drive": ("3200", "0.8"),
    "front_brake": ("2285.714", "0.5714"),
    "rear_brake": ("1163.636", "0.2909"),
    "all_brake": ("3200", "0.8"),
}
NAMES = ("traction", "acceleration", "front_load", "rear_load", "axle_torque")
UNITS = ("lbf", "g", "lbf", "lbf", "lbf·in")

ROUNDING = "1000 roundings of 2.2e-16, of forces as large as the weight"
SMALL = 1000 * EPS


def build(**parameters: str) -> mbody.Mechanism:
    """The model of the gallery, with other values of its parameters."""
    return gallery.load("vehicle", parameters)


def limit(axle: str, brake: bool, mu: float = mu, h: float = h) -> float:
    """The limiting force by hand: μ times the load of the driven axles, where the load itself moves
    by F h/(b + c); at most what lifts the other axle.
    """
    sign = -1.0 if brake else 1.0
    if axle == "all":
        force = mu * W
    elif axle == "front":
        force = mu * W * c / (b + c + sign * mu * h)
    else:
        rest = b + c - sign * mu * h
        force = mu * W * b / rest if rest > 0.0 else np.inf
    return sign * min(force, W * (b if brake else c) / h)


def answer(case: str, **parameters: str) -> mbody.Solution:
    """The run at the limit that `solve_for` finds."""
    machine = build(**parameters)
    return mbody.solve_for(machine, machine.questions[case])[0].run


def rows() -> list[Row]:
    found = []
    for case, reference in REFERENCE.items():
        run = answer(case)
        ours = [float(run.measure(name)[0]) for name in NAMES]
        for name, unit, own, value in zip(NAMES, UNITS, ours, reference, strict=True):
            found.append(BOOK.relative(f"{case}: {name}", own, value, SMALL, ROUNDING, unit))
        force, part = PRINT[case]
        told = abs(ours[0]), abs(ours[1])
        found += [
            BOOK.printed(f"{case}: |force|", told[0], force, "lbf"),
            BOOK.printed(f"{case}: |acceleration|", told[1], part, "g"),
        ]
        found.append(equilibrium(case, run))
    return [*found, *over_friction(), *over_height()]


def equilibrium(case: str, run: mbody.Solution) -> Row:
    """Moments about the front contact: N_r (b + c) = W b + m a h."""
    N_r, a = run.reaction("rear_tyre").fy[0], run["chassis"].ax[0]
    wanted = (W * b + W / g * a * h) / (b + c)
    return MOMENTS.relative(f"{case}: rear axle", N_r, wanted, SMALL, ROUNDING, "lbf")


def over_friction() -> list[Row]:
    """All six limits at five coefficients of friction."""
    values = (0.1, 0.4, 0.8, 1.2, 1.6)
    found = []
    for case in REFERENCE:
        axle, _, what = case.partition("_")
        ours = [answer(case, mu=str(value)).measure("traction")[0] for value in values]
        wanted = [limit(axle, what == "brake", mu=value) for value in values]
        quantity = f"{case}: force, μ = 0.1 … 1.6"
        found.append(SWEEP.relative(quantity, ours, wanted, SMALL, ROUNDING, "lbf"))
    return found


def over_height() -> list[Row]:
    """A mass centre from the road to 80 in: the tall vehicle tips before it slips, and the side
    condition that binds says so.
    """
    heights = (0.5, 12.0, 25.0, 40.0, 60.0, 80.0)
    found, tipped, expected = [], 0, 0
    for case in REFERENCE:
        axle, _, what = case.partition("_")
        brake = what == "brake"
        ours = []
        for height in heights:
            machine = build(height=f"{height} in")
            solution = mbody.solve_for(machine, machine.questions[case])[0]
            ours.append(solution.run.measure("traction")[0])
            lifts = "rear_tyre.fy >= 0" if brake else "front_tyre.fy >= 0"
            tipped += lifts in solution.binding
            lifting = W * (b if brake else c) / height
            expected += abs(limit(axle, brake, h=height)) >= lifting * (1.0 - 1e-12)
        wanted = [limit(axle, brake, h=height) for height in heights]
        quantity = f"{case}: force, height 0.5 … 80 in"
        found.append(SWEEP.relative(quantity, ours, wanted, SMALL, ROUNDING, "lbf"))
    found.append(
        SWEEP.absolute(
            "vehicles that tip before they slip, of 36", tipped, expected, 0.0, "a count is exact"
        )
    )
    return found
