"""A four-bar at rest: two- and three-force members, the force polygon, superposition, d'Alembert.

The lecture, step by step. AB carries no load between its pins, so F34 and F32 lie along AB: a
two-force member. On link 4 act P, F34 and F14, and three forces in equilibrium meet in one point M,
which gives the direction of F14 and, by the force polygon, the size of F34. Link 2 carries F32 over
to O2 with the arm d: T2 = F32 d.
"""

from __future__ import annotations

import math

import numpy as np

import mbody
from mbody import gallery
from validation.case import EPS, Row, Source

__all__ = ["build", "rows"]

LECTURE = Source("static_fourbar", "Youssefi, lecture on static force analysis, print")
POLYGON = Source("static_fourbar", "force polygon and lever arms, closed form (this file)")
STATICS = Source("static_fourbar", "three forces in equilibrium meet in one point")
LINEAR = Source("static_fourbar", "statics is linear in the loads: superposition")
DALEMBERT = Source("static_fourbar", "d'Alembert: F_I = −m a_G, T_I = −I α; statics with them")

O2A, AB, O4B, O4C, O2O4 = 3.0, 6.0, 6.0, 4.5, 2.4  # in
P = 120.0  # lbf, square to O4B at C
theta2 = math.radians(-158.04)  # from the line O2→O4: recovered, see SOURCE.md

ROUNDING = "1000 roundings of 2.2e-16: the polygon takes differences of nearly equal angles"
SMALL = 1000 * EPS


def build(**parameters: str) -> mbody.Mechanism:
    """The model of the gallery, with other values of P and Q."""
    return gallery.load("static_fourbar", parameters)


def closed(theta: float = theta2, crossed: bool = False) -> dict[str, float]:
    """The lecture's construction: positions by the triangle O4–A–B, then polygon and arms."""
    A = O2A * np.exp(1j * theta)
    O4 = O2O4 + 0j
    s, line = abs(A - O4), np.angle(A - O4)
    corner = math.acos((s * s + O4B * O4B - AB * AB) / (2.0 * s * O4B))
    theta4 = line + (corner if crossed else -corner)
    B = O4 + O4B * np.exp(1j * theta4)
    theta3 = np.angle(B - A)
    # link 4, moments about O4: P turns it clockwise with the arm O4C, F34 back with that of AB
    F34 = P * O4C / (O4B * math.sin(theta4 - theta3))
    # the crank feels the coupler's pull along AB: its arm about O2
    d = (A * np.exp(-1j * theta3)).imag
    return {
        "theta3": math.degrees(theta3) % 360.0,
        "theta4": math.degrees(theta4) % 360.0,
        "F34": abs(F34),
        "d": abs(d),
        "T2": F34 * d,
    }


def rows() -> list[Row]:
    run = mbody.statics(build())
    F34, F32 = run.reaction("B", on="rocker"), run.reaction("A", on="crank")
    F12, F14 = run.reaction("O2", on="crank"), run.reaction("O4", on="rocker")
    T2 = run.effort("hold")[0]
    d = abs(T2) / F32.magnitude[0]
    exact = closed()
    lbf, lbf_in = "lbf", "lbf·in"
    found = [
        LECTURE.printed("F34, coupler on rocker", F34.magnitude[0], "113.52", lbf),
        LECTURE.printed("F32, coupler on crank", F32.magnitude[0], "113.52", lbf),
        LECTURE.printed("F12, ground on crank", F12.magnitude[0], "113.52", lbf),
        LECTURE.printed("arm d of F32 about O2", d, "2.428", "in"),
        LECTURE.printed("T2, counter-clockwise", T2, "275.6", lbf_in),
        POLYGON.relative("F34", F34.magnitude[0], exact["F34"], SMALL, ROUNDING, lbf),
        POLYGON.relative("arm d", d, exact["d"], SMALL, ROUNDING, "in"),
        POLYGON.relative("T2", T2, exact["T2"], SMALL, ROUNDING, lbf_in),
    ]
    for name, link in (("theta3", "coupler"), ("theta4", "rocker")):
        ours = math.degrees(run[link].angle[0]) % 360.0
        found.append(POLYGON.relative(name, ours, exact[name], SMALL, ROUNDING, "deg"))
    return [
        *found,
        *members(run),
        *other_positions(),
        *superposition(),
        *at_speed(),
        POLYGON.relative(
            "F14, the third side of the polygon",
            [F14.fx[0], F14.fy[0]],
            polygon(run),
            SMALL,
            ROUNDING,
            lbf,
        ),
    ]


def polygon(run: mbody.Solution) -> list[float]:
    """F14 = −P − F34, with F34 along AB as the closed form has it."""
    exact = closed()
    theta3, theta4 = math.radians(exact["theta3"]), math.radians(exact["theta4"])
    # P turns the rocker clockwise, AB holds it back
    side = -P * np.exp(1j * (theta4 - math.pi / 2.0)) + exact["F34"] * np.exp(1j * theta3)
    return [side.real, side.imag]


def members(run: mbody.Solution) -> list[Row]:
    """Which links are two- and three-force members, and the point M."""
    crank, coupler, rocker = mbody.member_forces(run)
    kinds = [one.kind for one in (crank, coupler, rocker)]
    wanted = ["two forces and a couple", "two-force", "three-force"]
    # the lines of P and of AB, from the places alone
    A, B, C = (complex(run.point(p).x[0], run.point(p).y[0]) for p in PLACES)
    across, along = (C - A) / (B - A), (B - A) / abs(B - A)
    square = (B - complex(O2O4)) / abs(B - complex(O2O4)) * -1j
    s = -((C - A) * along.conjugate()).imag / (square * along.conjugate()).imag
    M = C + s * square
    F14 = run.reaction("O4", on="rocker")
    aside = (complex(F14.fx[0], F14.fy[0]).conjugate() * (M - complex(O2O4))).imag
    same = sum(a == b for a, b in zip(kinds, wanted, strict=True))
    return [
        STATICS.absolute("links named rightly, of 3", same, 3.0, 0.0, "a count is exact"),
        STATICS.relative("M (x, y)", rocker.meeting, [M.real, M.imag], SMALL, ROUNDING, "in"),
        STATICS.absolute(
            "moment of F14 about M",
            aside / F14.magnitude[0],
            0.0,
            SMALL * abs(across) * AB,
            "roundings by the size of the figure",
            "in",
        ),
        STATICS.relative(
            "pull in the coupler", coupler.tension, closed()["F34"], SMALL, ROUNDING, "lbf"
        ),
    ]


PLACES = ("coupler.A", "coupler.B", "rocker.C")


def other_positions() -> list[Row]:
    """The mirror image turns every sense round; the other closure has the same F34 and another d,
    so it is not the figure.
    """
    found = []
    mirror = mbody.Mechanism("mirror", units="in-lbf-s", ground={"O2": (0, 0), "O4": (O2O4, 0)})
    machine = build()
    mirror.add(
        *(machine[name] for name in ("crank",)),
        *(
            mbody.Body(name, points=machine[name].points, guess=-machine[name].guess.angle)
            for name in ("coupler", "rocker")
        ),
        *machine.joints,
        mbody.AngleDriver("hold", "crank", -theta2),
        mbody.Force("P", "rocker.C", P, angle=math.pi / 2.0, follows=True),
    )
    run = mbody.statics(mirror)
    found.append(
        POLYGON.relative(
            "T2 of the mirror image", run.effort("hold")[0], -closed()["T2"], SMALL, ROUNDING
        )
    )
    exact = closed(crossed=True)
    guess = {k: math.radians(exact[a]) for k, a in (("coupler", "theta3"), ("rocker", "theta4"))}
    other = mbody.statics(build(), guess=guess)
    F34 = other.reaction("B").magnitude[0]
    d = abs(other.effort("hold")[0]) / F34
    found += [
        POLYGON.relative("F34 of the other closure", F34, exact["F34"], SMALL, ROUNDING, "lbf"),
        POLYGON.printed("d of the other closure: not the figure's", d, "2.877", "in"),
    ]
    return found


def superposition() -> list[Row]:
    """A second force Q at D on the coupler: T2(P and Q) = T2(P) + T2(Q), and so does every part
    of the engine's breakdown by cause.
    """
    both = mbody.statics(build(Q="50 lbf"))
    causes = both.breakdown("hold")
    alone = {
        "P": mbody.statics(build()).effort("hold")[0],
        "Q": mbody.statics(build(P="0 lbf", Q="50 lbf")).effort("hold")[0],
    }
    whole = both.effort("hold")[0]
    found = [
        LINEAR.relative("T2(P and Q) = T2(P) + T2(Q)", whole, sum(alone.values()), SMALL, ROUNDING)
    ]
    for name, value in alone.items():
        part = causes[name][0]
        found.append(
            LINEAR.relative(f"T2 by {name}, of the breakdown", part, value, SMALL, ROUNDING)
        )
    return found


def at_speed() -> list[Row]:
    """The same linkage with masses and at speed: with inertia forces F_I = −m a_G and torques
    T_I = −I α put on as loads, statics gives the forces at O2, A, B, O4 and the input torque.
    """
    machine = build()
    moving = mbody.Mechanism("at speed", units="in-lbf-s", ground=machine.ground.points)
    masses = {"crank": (0.004, 1.5), "coupler": (0.012, 3.0), "rocker": (0.010, 3.0)}
    for body in machine.bodies:
        mass, reach = masses[body.name]
        moving.add(
            mbody.Body(
                body.name,
                mass=mass,
                inertia=mass * 4.0 * reach**2 / 12.0,
                cg=(reach, 0.0),
                points={**body.points, "G": (reach, 0.0)},
                guess=body.guess,
            )
        )
    drive = mbody.AngleDriver("hold", "crank", mbody.laws.ConstantSpeed(theta2, 40.0))
    moving.add(*machine.joints, drive, machine["P"])
    run = mbody.kinetostatics(moving)
    still = mbody.Mechanism("with inertia forces", units="in-lbf-s", ground=machine.ground.points)
    still.add(*moving.bodies, *machine.joints, mbody.AngleDriver("hold", "crank", theta2))
    still.add(machine["P"])
    for body in moving.bodies:
        fx, fy, torque = (float(part[0]) for part in run.inertia(body.name))
        still.add(
            mbody.Force.components(f"F_I {body.name}", f"{body.name}.G", fx, fy),
            mbody.Torque(f"T_I {body.name}", body.name, value=torque),
        )
    again = mbody.statics(still)
    found = []
    for joint in ("O2", "A", "B", "O4"):
        one, two = run.reaction(joint), again.reaction(joint)
        pair = ([two.fx[0], two.fy[0]], [one.fx[0], one.fy[0]])
        found.append(
            DALEMBERT.relative(f"force at {joint}, at speed", *pair, SMALL, ROUNDING, "lbf")
        )
    efforts = again.effort("hold")[0], run.effort("hold")[0]
    found.append(DALEMBERT.relative("T2 at speed", *efforts, SMALL, ROUNDING, "lbf·in"))
    return found
