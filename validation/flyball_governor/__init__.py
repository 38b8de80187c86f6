"""Flyball governor with a valve: Waldron and Kinzel, as a Ferdowsi lecture prints it."""

from __future__ import annotations

import math

import numpy as np

import mbody
from mbody.engineering import equilibrium_curve
from mbody.model.body import SlenderRod
from mbody.model.loads import CentrifugalField
from mbody.quantities import deg
from validation.case import Row, Source
from validation.spinning import AXIS, SOLVED, balanced, rpm, superposed

__all__ = ["build", "rows"]

CASE = "flyball_governor"
LECTURE = Source(CASE, "Ferdowsi lecture after Waldron and Kinzel, print")
EXACT = Source(CASE, "statics of one arm in closed form, ten digits and more")
CURVE = Source(CASE, "closed form ω²(θ) = k x CB tan θ / (m r CG), computed here")
MOMENTS = Source(CASE, "moments about C, with the lecture's arms")

W, g = 0.25, 386.4  # lbf, in/s²
CB, CG = 1.5, 2.438  # in, along the arm from its hinge C; the links A-B are as long as C-B
R = 0.625  # in, of the hinges A and C from the spindle
k = 20.0  # lbf/in
m = W / g
FREE, CLOSED = deg(5.0), deg(75.0)

#: Compression [in], spring force [lbf], ω [rad/s], rpm by the spring's free angle.
REFERENCE = {
    5.0: (2.2121269589676746, 44.24253917935349, 229.54524703172538, 2191.9956437009587),
    8.0: (2.194347070917149, 43.886941418342985, 228.62090525668356, 2183.168829944704),
}


def build(free: float = FREE, *, slender: bool = False, held: bool = True) -> mbody.Mechanism:
    """Arms C-B-G on a fixed collar, links A-B on a sliding one, a spring between both collars.

    θ leans an arm outwards from the spindle. The mass of an arm is a point at G, or (`slender`)
    spread evenly along a rod of twice that length. A driver may hold θ where the valve is closed.
    """
    spread = SlenderRod(math.pi / 2) if slender else "point"
    inertia = m * (2.0 * CG) ** 2 / 12.0 if slender else 0.0
    machine = mbody.Mechanism(
        "flyball governor", units="in-lbf-s", g=g, ground={"C_l": (-R, 0.0), "C_r": (R, 0.0)}
    )
    machine.add(mbody.Body("collar", points={"A_l": (-R, 0.0), "A_r": (R, 0.0)}))
    for side, sense in (("l", 1.0), ("r", -1.0)):
        arm, link = f"arm_{side}", f"link_{side}"
        machine.add(
            mbody.Body(
                arm,
                weight=W,
                inertia=inertia,
                spread=spread,
                cg=(0.0, CG),
                points={"C": (0.0, 0.0), "B": (0.0, CB), "G": (0.0, CG)},
                guess=sense * CLOSED,
            ),
            mbody.Body(link, points={"B": (0.0, 0.0), "A": (0.0, CB)}, guess=-sense * CLOSED),
            mbody.Revolute(f"C_{side}", f"ground.C_{side}", f"{arm}.C"),
            mbody.Revolute(f"B_{side}", f"{arm}.B", f"{link}.B"),
            mbody.Revolute(f"A_{side}", f"{link}.A", f"collar.A_{side}"),
        )
    upright = mbody.Marker("collar", (0.0, 0.0), math.pi / 2)
    machine.add(
        mbody.Prismatic("guide", AXIS, upright),
        mbody.Spring(
            "spring", "ground", "collar", stiffness=k, free_length=2.0 * CB * math.cos(free)
        ),
        CentrifugalField("field", AXIS, speed=REFERENCE[5.0][2]),
    )
    if held:
        machine.add(mbody.AngleDriver("theta", "arm_l", CLOSED))
    return machine


def rows() -> list[Row]:
    return [*exact(), *printed(), *moments(), *curve()]


def exact() -> list[Row]:
    """The closing speed, and what the lecture leaves out."""
    found = []
    for free, (x, force, omega, turns) in sorted(REFERENCE.items(), reverse=True):
        machine = build(deg(free))
        speed = balanced(machine)
        run = mbody.statics(mbody.assemble(machine).with_values({"field.speed": speed}))
        told = f"spring free at {free:g}°"
        pressed = 2.0 * CB * math.cos(deg(free)) - float(run["collar"].y[0])
        found += [
            EXACT.relative(f"compression, {told}", pressed, x, *SOLVED, "in"),
            EXACT.relative(f"spring force, {told}", k * pressed, force, *SOLVED, "lbf"),
            EXACT.relative(f"closing speed, {told}", speed, omega, *SOLVED, "rad/s"),
            EXACT.relative(f"closing speed, {told}", rpm(speed), turns, *SOLVED, "rpm"),
        ]
    told = "closing speed of the gallery's model"
    model = mbody.gallery.load("flyball_governor")
    asked = mbody.solve_for(model, model.questions["closing_speed"])[0].unknowns["omega"]
    found += [
        EXACT.relative(told, asked, REFERENCE[5.0][3], *SOLVED, "rpm"),
        CURVE.relative("closing speed by superposition", superposed(build()), speed, *SOLVED),
    ]
    rod = balanced(build(slender=True))
    x, r = REFERENCE[5.0][0], R + CG * math.sin(CLOSED)
    square = k * x * CB * math.tan(CLOSED) / (m * (r * CG + CG**2 / 3.0 * math.sin(CLOSED)))
    return [
        *found,
        EXACT.relative("closing speed, slender arms", rod, math.sqrt(square), *SOLVED, "rad/s"),
        EXACT.printed(
            "closing speed, slender arms",
            rpm(rod),
            "1950.139",
            "rpm",
            cause="no point mass: the moment −ω² I_xy about G helps to open the arms",
        ),
    ]


def printed() -> list[Row]:
    """The lecture's numbers, which it cuts off after the digits that it prints."""
    speed = balanced(build())
    run = mbody.statics(mbody.assemble(build()).with_values({"field.speed": speed}))
    x = 2.0 * CB * math.cos(FREE) - float(run["collar"].y[0])
    radius = float(run.point("arm_r.G").x[0])
    ball = m * speed**2 * radius
    cut = "the print is cut off, not rounded: {}"
    return [
        LECTURE.printed("compression x", x, "2.212", "in"),
        LECTURE.printed("spring force", k * x, "44.24", "lbf"),
        LECTURE.printed("spring force of a side", 0.5 * k * x, "22.12", "lbf"),
        LECTURE.printed("F_AB", run.reaction("A_r").magnitude, "85.47", "lbf"),
        LECTURE.printed(
            "centrifugal force at G", ball, "101.58", "lbf", cause=cut.format("101.5886")
        ),
        LECTURE.printed("radius of G", radius, "2.979", "in", cause=cut.format("2.97993")),
        LECTURE.printed("closing speed", rpm(speed), "2191", "rpm", cause=cut.format("2191.9956")),
    ]


def moments() -> list[Row]:
    """About the hinge C: the link's force with arm 1.5 sin 30°, the ball's with 2.438 sin 15°."""
    speed = balanced(build())
    run = mbody.statics(mbody.assemble(build()).with_values({"field.speed": speed}))
    link = float(run.reaction("A_r").magnitude[0]) * CB * math.sin(deg(30.0))
    ball = m * speed**2 * (R + CG * math.sin(CLOSED)) * CG * math.sin(deg(15.0))
    # the driver on one arm would carry the moments of both sides
    parts = run.breakdown("theta")
    return [
        MOMENTS.relative("F_AB · 1.5 sin 30°", link, ball, *SOLVED, "lbf·in"),
        MOMENTS.relative(
            "effort by the balls, a side", -0.5 * parts["field"][0], ball, *SOLVED, "lbf·in"
        ),
        MOMENTS.relative(
            "effort by the spring, a side", 0.5 * parts["spring"][0], link, *SOLVED, "lbf·in"
        ),
        MOMENTS.absolute(
            "effort at the closing speed", run.effort("theta"), 0.0, *of_rounding(ball), "lbf·in"
        ),
    ]


def of_rounding(size: float) -> tuple[float, str]:
    """A difference of two such moments."""
    return 2e-13 * size, "rounding of two moments that cancel, 2e-13 of each"


def squares(theta: np.ndarray) -> np.ndarray:
    """ω² at which the arms rest at θ, from the moments about C."""
    x = 2.0 * CB * (math.cos(FREE) - np.cos(theta))
    return k * x * CB * np.tan(theta) / (m * (R + CG * np.sin(theta)) * CG)


def curve() -> list[Row]:
    """Where the arms rest at any speed: outwards from 5° on, and inwards from 0 to −5°."""
    outwards = equilibrium_curve(build(held=False), "field.speed", (REFERENCE[5.0][2], 1.0))
    lean = 0.9 * FREE
    inwards = {"arm_l": -lean, "arm_r": lean, "link_l": lean, "link_r": -lean}
    fold = equilibrium_curve(build(held=False), "field.speed", (1.0, 50.0), start=inwards)
    theta = fold["arm_l"].angle
    grid = np.linspace(-FREE, 0.0, 200_001)
    top = grid[np.argmax(squares(grid))]
    # the parabola through the greatest of a fine grid and its neighbours
    near = top + (grid[1] - grid[0]) * np.array([-1.0, 0.0, 1.0])
    a, b, c = np.polyfit(near - top, squares(near), 2)
    greatest = math.sqrt(c - b * b / (4.0 * a))
    n = fold.folds[0]
    small = 1e-9, "corrections of the curve end at 1e-12 of a radian; ω² rises 300-fold in θ"
    whole = outwards["arm_l"].angle
    return [
        CURVE.relative(
            "ω² along θ from 75° to 5°", outwards.values**2, squares(whole), *small, "rad²/s²"
        ),
        CURVE.absolute(
            "points of it that are not stable",
            (~outwards.stable).sum(),
            0,
            0.0,
            "stable where ω² rises with θ, as it does all the way, 0 or 1 a point",
        ),
        CURVE.relative("ω² along θ from −5° to 0", fold.values**2, squares(theta), *small),
        CURVE.relative(
            "its turning point",
            fold.values[n],
            greatest,
            1e-9,
            "the parabola of the closed form, its grid 4e-7 rad",
            "rad/s",
        ),
        CURVE.absolute(
            "stable before it, unstable beyond",
            (~fold.stable[:n]).sum() + fold.stable[n + 1 :].sum(),
            0,
            0.0,
            "stable while ω² rises on the way from the free spring, 0 or 1 a point",
        ),
        CURVE.absolute(
            "θ at the exact closing speed",
            math.degrees(float(whole[0])),
            75.0,
            1e-10,
            "Newton ends at 1e-12 of a radian",
            "deg",
        ),
    ]
