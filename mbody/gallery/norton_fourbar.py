"""Four-bar, dynamic force analysis: R. L. Norton, *Design of Machinery*, example 11-3.

Given: links 2, 3, 4 of weight 1.5, 7.7, 5.8 lbf; the crank at 60° turns at 25 rad/s and slows down
by 40 rad/s². A force of 80 lbf at 330° acts at P on the coupler, a torque of 120 lbf·in on the
rocker. Find the pin forces and the driving torque.
"""

from __future__ import annotations

import math
from typing import Any

from mbody.bodies import Body, deg
from mbody.drivers import AngleDriver
from mbody.elements import polar
from mbody.errors import ModelError
from mbody.joints import Revolute
from mbody.laws import ConstantAcceleration
from mbody.loads import Force, Torque
from mbody.mechanism import Mechanism

__all__ = ["PRINTED", "build"]

#: The book's answers: components, then magnitude and direction [deg], of forces on a link [lbf];
#: the driving torque [lbf·in].
PRINTED = {
    "F12": (-117.65, -107.84, 159.60, 222.52),
    "F32": (118.13, 100.34, 154.99, 40.35),
    "F43": (-1.34, 87.43, 87.44, 90.88),
    "F14": (-20.23, 77.71, 80.30, 104.59),
    "T12": (243.23,),
}

#: Weights of crank, coupler, rocker [lbf], and the masses that the book makes of them [blob].
GIVEN: dict[str, Any] = {
    "exact": ("weight", 1.5, 7.7, 5.8),
    "printed": ("mass", 0.004, 0.020, 0.015),
}


def build(masses: str = "exact") -> Mechanism:
    """The four-bar of the example.

    Parameters
    ----------
    masses : str
        ``"exact"``: weights divided by g = 386 in/s²; ``"printed"``: the masses as the book rounds
        them, 0.004, 0.020 and 0.015 blob, with which its answers come out to the last digit.

    Returns
    -------
    Mechanism
        Bodies crank, coupler, rocker; joints O2, A, B, O4; driver motor; loads F_P, T_4.

    Raises
    ------
    ModelError
        For other masses.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(build("printed"))
    >>> print(f"{run.effort('motor')[0]:.2f}")
    243.23
    """
    if masses not in GIVEN:
        raise ModelError(f'masses must be "exact" or "printed", not {masses!r}')
    what, crank, coupler, rocker = GIVEN[masses]

    # P stands 3 in @ 100° from the coupler's mass centre, which is 9 in @ 45° from A
    px = 9.0 * math.cos(deg(45)) + 3.0 * math.cos(deg(100))
    py = 9.0 * math.sin(deg(45)) + 3.0 * math.sin(deg(100))

    machine = Mechanism(
        "Norton, Design of Machinery, example 11-3",
        units="in-lbf-s",
        g=386.0,
        ground={"O2": (0.0, 0.0), "O4": (19.0, 0.0)},
    )
    machine.add(
        Body(
            "crank",
            **{what: crank},
            inertia=0.4,
            cg=polar(3.0, deg(30)),
            points={"O2": (0.0, 0.0), "A": (5.0, 0.0)},
        ),
        Body(
            "coupler",
            **{what: coupler},
            inertia=1.5,
            cg=polar(9.0, deg(45)),
            points={"A": (0.0, 0.0), "B": (15.0, 0.0), "P": (px, py)},
            guess=deg(25),
        ),
        Body(
            "rocker",
            **{what: rocker},
            inertia=0.8,
            cg=(5.0, 0.0),
            points={"O4": (0.0, 0.0), "B": (10.0, 0.0)},
            guess=deg(110),
        ),
        Revolute("O2", "ground.O2", "crank.O2"),
        Revolute("A", "crank.A", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.O4"),
        AngleDriver("motor", "crank", ConstantAcceleration(deg(60), 25.0, -40.0)),
        Force("F_P", "coupler.P", 80.0, angle=deg(330)),
        Torque("T_4", "rocker", value=120.0),
    )
    return machine
