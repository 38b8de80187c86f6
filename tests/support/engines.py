"""Engines for tests: cylinders in line or in banks on one crank, as mechanisms."""

import math

import numpy as np

from mbody import AngleDriver, Body, Marker, Mechanism, Prismatic, Revolute
from mbody.laws import ConstantSpeed


def engine(throws, *, banks=None, r=0.05, ratio=0.25, mass=0.5, speed=100.0, start=0.0, rod=0.0):
    """Cylinders with throws at angles of the crank, each along the direction of its bank [rad]; the
    crank is massless, and the rods unless they have a mass `rod` (uniform).
    """
    throws = np.asarray(throws, dtype=float)
    banks = np.zeros(len(throws)) if banks is None else np.asarray(banks, dtype=float)
    length = r / ratio
    machine = Mechanism("engine", ground={"O": (0.0, 0.0)})
    pins = {f"A{n}": (r * math.cos(a), r * math.sin(a)) for n, a in enumerate(throws, 1)}
    machine.add(
        Body("crank", points={"O": (0.0, 0.0), **pins}, guess=start),
        Revolute("O", "ground.O", "crank.O"),
        AngleDriver("motor", "crank", ConstantSpeed(start, speed)),
    )
    for n, (throw, bank) in enumerate(zip(throws, banks, strict=True), 1):
        pin = r * np.exp(1j * (start + throw - bank))
        lean = bank - math.asin(pin.imag / length)
        machine.add(
            Body(
                f"rod{n}",
                mass=rod,
                inertia=rod * length**2 / 12.0,
                cg=(length / 2.0, 0.0),
                points={"A": (0.0, 0.0), "B": (length, 0.0)},
                guess=lean,
            ),
            Body(f"piston{n}", mass=mass, guess=bank),
            Revolute(f"pin{n}", f"crank.A{n}", f"rod{n}.A"),
            Revolute(f"wrist{n}", f"rod{n}.B", f"piston{n}"),
            Prismatic(
                f"guide{n}", Marker("ground", "O", bank), Marker(f"piston{n}", (0.0, 0.0), 0.0)
            ),
        )
    return machine
