"""The couple of shaking forces that act at different places along a shaft."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.model.numbers import number_in
from mbody.quantities.types import Number
from mbody.solution.checks import one_design
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution, as_solution
from mbody.system.read_only import lock

__all__ = ["RockingCouple", "rocking_couple"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class RockingCouple(Inherited):
    """A couple about axes in the plane: arrays (instants,), world axes.

    Attributes
    ----------
    x, y : arrays (instants,)
        About the x and the y axis [force·length].

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 2), speed=10.0, start=0.0)
    >>> couple = mbody.engineering.rocking_couple(mbody.kinetostatics(engine), {"slider": 0.5})
    >>> round(float(abs(couple.x[0])), 9)
    0.0
    """

    x: Array
    y: Array

    def __post_init__(self) -> None:
        lock(self)

    @property
    def magnitude(self) -> Array:
        """√(x² + y²)."""
        return np.hypot(self.x, self.y)


def rocking_couple(run: Solution, offsets: Mapping[str, Number]) -> RockingCouple:
    """Couple of the inertia forces of bodies in parallel planes, such as cylinders in line:
    pitching and yawing couple, rocking couple.

    M_x = −Σ z F_y,  M_y = Σ z F_x,  F = −m a_G of each body, z its distance along the shaft.

    Parameters
    ----------
    run : Solution
        Of kinetostatics, or of any analysis with accelerations, of one design.
    offsets : mapping
        By body, its place along the axis out of the plane [length], numbers or text with units;
        bodies that are not named are at 0.

    Returns
    -------
    RockingCouple

    Raises
    ------
    ModelError
        For a body that there is not, a value that is no length, or a batch.

    Notes
    -----
    Where the shaking force is not zero the couple depends on the plane of z = 0. Rods and other
    bodies of a cylinder are named as its piston is. A crankshaft is one body at one z: its own
    throws are taken as balanced.

    Source: R. L. Norton, *Design of Machinery*, section 14.2.

    Examples
    --------
    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 2), speed=10.0, start=0.0)
    >>> run = mbody.kinetostatics(engine)
    >>> round(float(rocking_couple(run, {"slider": 0.5}).y[0]), 9)
    125.0
    """
    run = as_solution(run)
    one_design(run, "a rocking couple is of one design")
    known = [body.name for body in run.mechanism.bodies]
    total = np.zeros((2, len(run)))
    for body, given in offsets.items():
        if body not in known:
            raise ModelError(f"there is no moving body {body!r} (there are: {listed(known)})", body)
        z = number_in(run.mechanism, given, "length", body, "offset")
        fx, fy, _ = run.inertia(body)
        total += z * np.array([-fy, fx])
    return RockingCouple(*total, **inherited(run))
