"""Andrews' squeezing mechanism: seven bodies, three loops, a stiff spring, thirty milliseconds."""

from __future__ import annotations

import numpy as np

import mbody
from mbody import gallery
from validation.case import Row, Source

__all__ = ["build", "rows"]

QUAD = Source("andrews", "quadruple precision, constraints to 1e-25 (references)")
BARI = Source("andrews", "Bari test set for IVP solvers, PSIDE, sixteen digits printed")

NAMES = ("β", "Θ", "γ", "Φ", "δ", "Ω", "ε")
#: The seven angles [rad] at times [s].
ANGLES = {
    0.01: (
        *(2.1601131315315265061, -1.8833642311070443193, 1.5851675800122669325e-01),
        *(-3.2864107517467030658e-01, 5.2515477479772946110e-01, 3.2864107517467030658e-01),
        1.0684272046324011487,
    ),
    0.02: (
        *(8.1849058896616755440, -7.8905053637304495096, 2.0953691338469755819e-01),
        *(-2.3832559659585124773e-01, 5.2253691715599637191e-01, 2.3832559659585124773e-01),
        1.0862751085998732415,
    ),
    0.03: (
        *(15.810771195153707097, -15.756371058411839469, 4.0822240119645804858e-02),
        *(-5.3473011634207959377e-01, 5.2440996587995406937e-01, 5.3473011634207959377e-01),
        1.0480807410419378730,
    ),
}
PUBLISHED = (
    *(0.1581077119629904e2, -0.1575637105984298e2, 0.4082224013073101e-1, -0.5347301163226948),
    *(0.5244099658805304, 0.5347301163226948, 0.1048080741042263e1),
)
REASON = "steps of 1e-10, of which some hundred are made"


def build() -> mbody.Mechanism:
    """The gallery's model."""
    return gallery.load("andrews_squeezer")


def angles(run: mbody.Solution, n: int) -> np.ndarray:
    """The test set's seven angles: of the links, some of them from another link."""
    of = {name: float(run[name].angle[n]) for name in run}
    found = [of["OF"], of["FE"] - of["OF"], of["BDE"], of["GE"] - of["AG"], of["AG"]]
    return np.array([*found, of["HE"] - of["AH"], of["AH"]])


def rows() -> list[Row]:
    run = mbody.simulate(build(), times=list(ANGLES))
    found = []
    for n, (t, reference) in enumerate(ANGLES.items()):
        ours = angles(run, n)
        size = np.maximum(1.0, np.abs(reference))
        for name, a, b, s in zip(NAMES, ours, reference, size, strict=True):
            found.append(QUAD.absolute(f"{name}({t:g} s)", a, b, 1e-9 * s, REASON, "rad"))
    tight = angles(mbody.simulate(build(), rtol=1e-12, times=[0.03]), 0)
    worst = (np.abs(tight - PUBLISHED) / np.maximum(1.0, np.abs(PUBLISHED))).max()
    return [
        *found,
        BARI.absolute(
            "greatest difference at 0.03 s, as a part, rtol 1e-12",
            worst,
            0.0,
            2e-10,
            "the print is good to ten digits: 9.1e-11 from quadruple precision",
        ),
        energy(run),
    ]


def energy(run: mbody.Solution) -> Row:
    """Work of the motor against the energies of links and spring."""
    source = Source("andrews", "torque times angle of the crank")
    work = 0.033 * (run["OF"].angle - run["OF"].angle[0])
    ours = run.energy.by["motor"] - run.energy.by["motor"][0]
    return source.relative("work of the motor", ours, work, 1e-9, REASON, "J")
