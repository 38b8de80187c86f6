"""Straight-line linkages: Peaucellier's exact one, Hoekens' and Chebyshev's near ones."""

from __future__ import annotations

import math

import numpy as np

import mbody
from mbody import AngleDriver, Body, Mechanism, Revolute
from mbody.laws import ConstantSpeed
from mbody.quantities import deg
from validation.case import EPS, Row, Source

__all__ = ["build", "chebyshev", "hoekens", "peaucellier", "rows"]

INVERSION = Source("straight_lines", "Peaucellier: inversion of a circle through O, closed form")
LINKAGE = Source("straight_lines", "closed form of the tracer, derived in SOURCE.md")

ARM, RHOMBUS, CRANK = 5.0, 3.0, 1.5
# Hoekens' tracer with c = cos θ₂:
# y² = 4 (5 + c)(2 − c)²/(5 − 4c), (x − 2)² = 4 (5 + c)(1 − c²)/(5 − 4c)
HIGHEST = 7.0 * math.sqrt(21.0) / 8.0  # at c = −5/8; Chebyshev's is the cognate, with the same line
TOP = 2.0 * math.sqrt(6.0)  # y at c = 1
C_WIDEST = float(min(np.roots([8.0, 5.0, -50.0, 25.0]), key=abs))
WIDEST = 2.0 * math.sqrt((5.0 + C_WIDEST) * (1.0 - C_WIDEST**2) / (5.0 - 4.0 * C_WIDEST))


def peaucellier() -> Mechanism:
    """Arms O–A and O–B, rhombus A–P–B–Q; the crank C–P leads P on a circle through O."""
    machine = Mechanism("Peaucellier", ground={"O": (0.0, 0.0), "C": (CRANK, 0.0)})
    machine.add(
        Body("crank", points={"C": (0.0, 0.0), "P": (CRANK, 0.0)}),
        mbody.makers.bar("OA", ARM, ends=("O", "A"), guess=deg(34)),
        mbody.makers.bar("OB", ARM, ends=("O", "B"), guess=deg(-34)),
        mbody.makers.bar("PA", RHOMBUS, ends=("P", "A"), guess=deg(67)),
        mbody.makers.bar("PB", RHOMBUS, ends=("P", "B"), guess=deg(-67)),
        mbody.makers.bar("QA", RHOMBUS, ends=("Q", "A"), guess=deg(113)),
        mbody.makers.bar("QB", RHOMBUS, ends=("Q", "B"), guess=deg(-113)),
        Revolute("C", "ground.C", "crank.C"),
        Revolute("Oa", "ground.O", "OA.O"),
        Revolute("Ob", "ground.O", "OB.O"),
        Revolute("A", "OA.A", "PA.A"),
        Revolute("A'", "OA.A", "QA.A"),
        Revolute("B", "OB.B", "PB.B"),
        Revolute("B'", "OB.B", "QB.B"),
        Revolute("P", "crank.P", "PA.P"),
        Revolute("P'", "crank.P", "PB.P"),
        Revolute("Q", "QA.Q", "QB.Q"),
        AngleDriver("motor", "crank", ConstantSpeed(0.0, 1.0)),
    )
    return machine


def hoekens() -> Mechanism:
    """Crank 1, ground 2, coupler and rocker 2.5; the tracer 5 from A on the line A–B."""
    machine = Mechanism("Hoekens", ground={"O2": (0.0, 0.0), "O4": (2.0, 0.0)})
    tracer = {"P": (5.0, 0.0)}
    machine.add(
        mbody.makers.bar("crank", 1.0, ends=("O2", "A")),
        mbody.makers.bar("coupler", 2.5, ends=("A", "B"), points=tracer, guess=deg(53)),
        mbody.makers.bar("rocker", 2.5, ends=("O4", "B"), guess=deg(127)),
        Revolute("O2", "ground.O2", "crank.O2"),
        Revolute("A", "crank.A", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.O4"),
        AngleDriver("motor", "crank", ConstantSpeed(math.pi, 1.0)),
    )
    return machine


def chebyshev() -> Mechanism:
    """Ground 4, crossed arms 5, coupler 2 with the tracer in its middle; the coupler is turned,
    for it goes through all of the line: where it is upright the arms have their dead centres.
    """
    machine = Mechanism("Chebyshev", ground={"O2": (0.0, 0.0), "O4": (4.0, 0.0)})
    machine.add(
        mbody.makers.bar("arm 2", 5.0, ends=("O2", "A"), guess=deg(53)),
        mbody.makers.bar("coupler", 2.0, ends=("A", "B"), points={"P": (1.0, 0.0)}),
        mbody.makers.bar("arm 4", 5.0, ends=("O4", "B"), guess=deg(127)),
        Revolute("O2", "ground.O2", "arm 2.O2"),
        Revolute("A", "arm 2.A", "coupler.A"),
        Revolute("B", "coupler.B", "arm 4.B"),
        Revolute("O4", "ground.O4", "arm 4.O4"),
        AngleDriver("motor", "coupler", ConstantSpeed(math.pi, 1.0)),
    )
    return machine


build = peaucellier


def tracer(system: mbody.System, theta: np.ndarray | float) -> mbody.solution.solution.PointHistory:
    """Motion of the point P of a four-bar at unit speed, on the branch that has P above at 180°."""
    path = np.append(math.pi, theta)
    P = mbody.kinematics(system, drive={"motor": (path, 1.0, 0.0)}).point("coupler.P")
    return type(P)(P.name, P.x[1:], P.y[1:], P.vx[1:], P.vy[1:], P.ax[1:], P.ay[1:])


def extreme(system: mbody.System, axis: str, near: float) -> float:
    """Where the speed along an axis vanishes, by Newton's method: θ ← θ − v/a."""
    theta = near
    for _ in range(6):
        P = tracer(system, theta)
        theta -= float(getattr(P, f"v{axis}")[0] / getattr(P, f"a{axis}")[0])
    return float(getattr(tracer(system, theta), axis)[0])


def rows() -> list[Row]:
    return [*peaucellier_rows(), *hoekens_rows(), *chebyshev_rows()]


def peaucellier_rows() -> list[Row]:
    # the rhombus lies flat at OP = 5 − 3, which is crank ±96.379°
    crank = np.radians(np.r_[0:96:385j, 96:-96:769j])
    run = mbody.kinematics(peaucellier(), drive={"motor": (crank, 1.0, 0.0)})
    Q = run.point("QA.Q")
    line = (ARM**2 - RHOMBUS**2) / (2.0 * CRANK)  # 16/3
    # between OP and the arm at 96°: the law of cosines loses 1/ψ, and ψ′ ~ 1/ψ, ψ″ ~ 1/ψ³
    OP = 2.0 * CRANK * math.cos(0.5 * crank.max())
    psi = math.acos((ARM**2 + OP**2 - RHOMBUS**2) / (2.0 * ARM * OP))
    size = 20 * EPS * ARM
    reason = "20 roundings of the size 5, by ψ{}, ψ = 0.066 rad from flat at 96°"
    track = line * np.tan(0.5 * crank)
    along_x, peak = Q.vx / np.hypot(Q.vx, Q.vy), np.hypot(Q.ax, Q.ay).max()
    near, faster, fastest = reason.format(""), reason.format("³"), reason.format("⁵")
    return [
        INVERSION.absolute("Peaucellier, x of Q, −96° … 96°", Q.x, line, size / psi, near),
        INVERSION.absolute("Peaucellier, y of Q", Q.y, track, size / psi, near),
        INVERSION.absolute("Peaucellier, vx by |v|", along_x, 0.0, size / psi**3, faster),
        INVERSION.absolute(
            "Peaucellier, ax by the peak of |a|", Q.ax / peak, 0.0, size / psi**5, fastest
        ),
    ]


def hoekens_rows() -> list[Row]:
    system = mbody.assemble(hoekens())
    line = tracer(system, np.radians(np.linspace(90.0, 270.0, 721)))
    peak = math.radians(90.0 + 0.25 * float(line.y.argmax()))
    left, top, right = -math.acos(C_WIDEST), 0.0, math.acos(C_WIDEST)
    reason = "loops closed to 1e-13 of the size, 5"

    def row(quantity: str, ours: float, reference: float) -> Row:
        return LINKAGE.absolute(f"Hoekens, {quantity}", ours, reference, 5e-13, reason)

    return [
        row("lowest y, crank 90° … 270°", line.y.min(), 4.0),
        row("highest y, crank 90° … 270°", extreme(system, "y", peak), HIGHEST),
        row("x at 90° less x at 270°", line.x[0] - line.x[-1], 4.0),
        row("least x of the whole turn", extreme(system, "x", left + 0.02), 2.0 - WIDEST),
        row("greatest x of the whole turn", extreme(system, "x", right - 0.02), 2.0 + WIDEST),
        row("greatest y of the whole turn", tracer(system, top).y[0], TOP),
    ]


def chebyshev_rows() -> list[Row]:
    system = mbody.assemble(chebyshev())
    P = tracer(system, np.radians(np.linspace(90.0, 270.0, 721)))
    near = math.radians(90.0 + 0.25 * float(P.y.argmax()))
    rounding = "loops closed to 1e-13 of the size, 5"
    span = abs(P.x[-1] - P.x[0])
    return [
        LINKAGE.absolute("Chebyshev, lowest y", P.y.min(), 4.0, 5e-13, rounding),
        LINKAGE.absolute(
            "Chebyshev, highest y", extreme(system, "y", near), HIGHEST, 5e-13, rounding
        ),
        LINKAGE.absolute("Chebyshev, x between upright couplers", span, 4.0, 5e-13, rounding),
    ]
