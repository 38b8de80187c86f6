"""The four-bar's nine equations in nine unknowns, with numbers: Norton eq. 11.9.

``python -m validation.newton_euler_matrix`` prints them.
"""

from __future__ import annotations

import numpy as np

import mbody
from mbody.analysis.position.assembly_analysis import closed
from mbody.system.rank import dense
from validation.case import EPS, Row, Source
from validation.norton_fourbar import build, forces
from validation.norton_fourbar.newton_euler import MASS, UNKNOWNS, equations, motion

__all__ = ["build", "rows", "sheet"]

BOOK = Source("newton_euler_matrix", "Norton, Design of Machinery, eq. 11.9, numbers of ex. 11-3")

EQUATIONS = [f"{sum_} of link {link}" for link in (2, 3, 4) for sum_ in ("Fx", "Fy", "T")]


def at_60_degrees(masses: str = "exact") -> tuple[np.ndarray, np.ndarray]:
    """A (9, 9) and b (9,) of A x = b."""
    A, b = equations(motion(np.radians(60.0), 25.0, -40.0), masses)
    return A[0], b[0]


def rows() -> list[Row]:
    found = []
    reason = "rounding of the motion and of nine sums: 200 × 2.2e-16 of the greatest term"
    for masses in MASS:
        A, b = at_60_degrees(masses)
        x = forces(mbody.kinetostatics(build(masses)))[:, 0]
        for k, name in enumerate(EQUATIONS):
            term = max(np.abs(A[k] * x).max(), abs(b[k]))
            quantity = f"A x - b, {name}, {masses} masses"
            found.append(BOOK.absolute(quantity, (A[k] @ x - b[k]) / term, 0.0, 200 * EPS, reason))
    return [*found, matrix()]


def matrix() -> Row:
    """A is the transpose of the engine's Φ_q: the columns are its rows, up to signs."""
    system = mbody.assemble(build())
    scaled = dense(system, closed(system, 0.0, {}).work)[1]
    # lengths by the model length → inches; the driver's row is an angle already
    size = np.where(np.arange(9) < 8, system.length, 1.0)[:, None]
    phi_q = size * scaled / np.tile([system.length, system.length, 1.0], 3)
    # Φ of a pin is body i − body j: at O2 and O4 the link is j
    signs = np.array([-1.0, -1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1.0])
    A, _ = at_60_degrees()
    return BOOK.absolute(
        "A, all 81 entries, and the engine's Φ_qᵀ",
        (signs[:, None] * phi_q).T,
        A,
        20 * 15.0 * EPS,
        "20 roundings of 2.2e-16 × 15 in, the greatest length",
        "in",
    )


def sheet(masses: str = "exact") -> str:
    """The equations as a table with numbers."""
    A, b = at_60_degrees(masses)
    x = np.linalg.solve(A, b)
    head = " " * 13 + "".join(f"{name:>10}" for name in UNKNOWNS) + f"{'b':>14}"
    lines = [
        f"{name:<13}" + "".join(f"{entry:10.4f}" for entry in row) + f"{right:14.6f}"
        for name, row, right in zip(EQUATIONS, np.round(A, 12) + 0.0, b)
    ]
    answer = f"{'x':<13}" + "".join(f"{value:10.4f}" for value in x)
    title = f"A x = b (Norton eq. 11.9), ex. 11-3 at 60°, {masses} masses, in-lbf-s"
    return "\n".join([title, "", head, *lines, "", answer])
