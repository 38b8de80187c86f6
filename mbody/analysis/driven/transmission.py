"""The verb `transmission`: how well a force comes through, from a driver to an output.

With the output load alone in balance with the driver, at rest and without weights, F is the force
in the joint that drives the output body and v the velocity of its place on that body. The
transmission angle is μ = arcsin |F·v|/(|F||v|), the pressure angle 90° − μ. Of a rocker that is the
angle between coupler and rocker, of a slider the angle between the rod and the normal of its guide,
of a cam follower the angle of the contact normal: the textbooks' angles, by one definition.

Contacts that are closed are joints, at every instant of a motion of `simulate` those that are
closed then; a place of contact is the centre of the pin or roller that touches, through which the
force goes. So a Geneva's wheel has the velocity ratio of its slot while the pin is in it, 0 while
the lock holds it, and none where it is loose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.force_path import ForcePath
from mbody.analysis.driven.grashof_class import four_bar_loops
from mbody.analysis.driven.kinematics import kinematics
from mbody.core.presentation import present
from mbody.errors import ModelError, SolveError, brief
from mbody.model.driver import Driver
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.solution.checks import one_design
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.heading import heading, unit_symbols
from mbody.solution.solution import Solution, as_solution
from mbody.system.read_only import lock

__all__ = ["LeastAngle", "Transmission", "transmission"]

Array = np.ndarray

#: The least angle is searched between instants on finer grids, each so many times as fine.
ZOOMS, GRID = 6, 21


@dataclass(frozen=True)
class LeastAngle:
    """The least transmission angle and where it is.

    Attributes
    ----------
    value : float
        [rad].
    driver : float
        Value of the driver there [rad or length].
    t : float or None
        Time of the nearest instant.
    """

    value: float
    driver: float
    t: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Transmission(Inherited):
    """From a driver to an output at every instant; ``print`` shows it.

    Attributes
    ----------
    mechanism : Mechanism
    driver, output, joint : str
        The joint is the one that drives the output body, or the contacts that do so one after the
        other, with commas.
    t : array (instants,)
    driver_value : array
        [rad or length].
    angle, pressure_angle : arrays
        μ and 90° − μ [rad], 0 … π/2; NaN where the place stands still or no force goes through it.
    velocity_ratio : array
        ẏ/ẋ of the output and the driver, of a path its size; infinite at a dead centre of the
        driver; NaN, as all else, where the contacts that are closed do not make the output follow.
    mechanical_advantage : array
        ẋ/ẏ: output load by effort without losses; infinite where the output stands still.
    joint_force_index : array
        Greatest force in any joint by the output load (Holte and Chase 1994); infinite at a dead
        centre of the driver, NaN where a path has no direction; of a torque in 1/length.
    least : LeastAngle or None
        Of all instants, and between them; None where μ is nowhere defined.
    loops : tuple of (str, str)
        Four-bar loops and Grashof's class of each.
    """

    mechanism: Mechanism = field(repr=False)
    driver: str
    output: str
    joint: str
    t: Array = field(repr=False)
    driver_value: Array = field(repr=False)
    angle: Array = field(repr=False)
    pressure_angle: Array = field(repr=False)
    velocity_ratio: Array = field(repr=False)
    mechanical_advantage: Array = field(repr=False)
    joint_force_index: Array = field(repr=False)
    least: LeastAngle | None
    loops: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        lock(self)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def angular(self) -> bool:
        """Whether the driver drives an angle."""
        return any(d.angular for d in self.mechanism.drivers if d.name == self.driver)

    def __str__(self) -> str:
        return str(present("sheet", self))

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """Everything as plain values, ready for JSON; what is infinite or undefined is null."""
        turn = np.degrees if angle == "deg" else np.asarray
        own = turn if self.angular else np.asarray
        head = heading(
            self.mechanism.name, "transmission", unit_symbols(self.mechanism.units, angle), self
        )
        least = self.least and {
            "value": float(turn(self.least.value)),
            "driver": float(own(self.least.driver)),
            "t": self.least.t,
        }
        return head | {
            "driver": self.driver,
            "output": self.output,
            "joint": self.joint,
            "t": self.t.tolist(),
            "driver_value": own(self.driver_value).tolist(),
            "transmission_angle": _plain(turn(self.angle)),
            "pressure_angle": _plain(turn(self.pressure_angle)),
            "velocity_ratio": _plain(self.velocity_ratio),
            "mechanical_advantage": _plain(self.mechanical_advantage),
            "joint_force_index": _plain(self.joint_force_index),
            "least": least,
            "grashof": [{"loop": loop, "class": words} for loop, words in self.loops],
        }


def transmission(
    run: Solution, driver: str | None = None, output: str = "", joint: str | None = None
) -> Transmission:
    """Transmission angle, pressure angle, mechanical advantage, velocity ratio and joint force
    index of any mechanism, at every instant of a result.

    Parameters
    ----------
    run : Solution
        Of a driven mechanism, such as ``mbody.kinematics(machine, turn=True)``; of `simulate` where
        contacts drive that open and close, as of a Geneva.
    driver : str, optional
        Name of the driver, or of its body; where there is one driver, that one.
    output : str
        The output body: its angle, loaded by a torque, where it turns, else the path of its mass
        centre; or one of its points, as ``"coupler.P"``, loaded along its path.
    joint : str, optional
        The joint, contact or group of contacts that drives the output body, where several could.

    Returns
    -------
    Transmission

    Raises
    ------
    ModelError
        For names that there are not, and where the joint must be named.

    Notes
    -----
    Forces follow from Φ_qᵀ λ = −Q with the output load Q alone; where joints are redundant they
    are those of least norm. Source: J. E. Holte, T. R. Chase, *A force transmission index for
    planar linkage mechanisms*, ASME DETC 1994.

    Examples
    --------
    The crank-rocker's least angle is where the crank lies on the ground line, here where it points
    away from the rocker, |cos μ| = |b² + c² − (d + a)²|/(2 b c):

    >>> import mbody
    >>> import numpy as np
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), turn=True, instants=37)
    >>> found = mbody.transmission(run, output="rocker")
    >>> found.joint, round(float(np.degrees(found.least.value)), 6)
    ('B', 52.8311)
    """
    run = as_solution(run)
    one_design(run, "transmission is of one design")
    leader = _driver(run, driver)
    output_body, _, point = output.partition(".")
    names = [body.name for body in run.mechanism.bodies]
    if output_body not in names:
        raise ModelError(
            f"there is no body {brief(output)} to be the output (there are: {listed(names)})",
            output,
        )
    if point and not run.system.numbers.has_point(output):
        raise ModelError(f"'{output_body}' has no point {brief(point)}", output)
    path = ForcePath(run, leader, output_body, point, joint)
    found = [path.at(k) for k in range(len(run))]
    angle = np.array([one.angle for one in found])
    ratio = np.array([one.ratio for one in found])
    carried = dict.fromkeys(one.by for one in found if math.isfinite(one.angle))
    through = ", ".join(carried or path.names)
    x = np.asarray(run.driven(leader.name)[0], dtype=float)
    least = _least(run, leader, output, joint, angle, x)
    notes = []
    if not np.isfinite(angle).any():
        notes.append(_undefined(through, output_body))
    loose = np.isnan(ratio)
    if loose.any():
        notes.append(
            f"at {int(loose.sum())} of {len(run)} instants no closed contact makes '{output_body}' "
            f"follow '{leader.name}': there is no ratio there"
        )
    return Transmission(
        mechanism=run.mechanism,
        driver=leader.name,
        output=output,
        joint=through,
        t=np.array(run.t),
        driver_value=x,
        angle=angle,
        pressure_angle=0.5 * math.pi - angle,
        velocity_ratio=ratio,
        mechanical_advantage=np.array([one.advantage for one in found]),
        joint_force_index=np.array([one.index for one in found]),
        least=least,
        loops=tuple(four_bar_loops(run.system)),
        **inherited(run, notes=notes),
    )


def _undefined(joint: str, body: str) -> str:
    return (
        f"the transmission angle is undefined: the place of '{joint}' on '{body}' "
        "stands still, or no force goes through it"
    )


def _driver(run: Solution, name: str | None) -> Driver:
    leaders = run.system.leaders
    known = listed(d.name for d in leaders) or "none"
    if name is None and len(leaders) == 1:
        return leaders[0]
    for one in leaders:
        if name in (one.name, getattr(one, "body", None)):
            return one
    if name is None:
        raise ModelError(
            f"'{run.mechanism.name}' has {len(leaders)} drivers ({known}): name the one from which "
            "the motion is transmitted"
        )
    raise ModelError(f"there is no driver {brief(name)} (there are: {known})", name)


def _least(
    run: Solution, driver: Driver, output: str, joint: str | None, angle: Array, x: Array
) -> LeastAngle | None:
    """The least μ of the instants, then between those on either side of it."""
    if not np.isfinite(angle).any():
        return None
    k = int(np.nanargmin(angle))
    best = LeastAngle(float(angle[k]), float(x[k]), float(run.t[k]))
    steps = np.diff(x)
    one_way = len(x) > 2 and ((steps > 0).all() or (steps < 0).all())
    if run.analysis == "simulate" or len(run.system.leaders) != 1 or not one_way:
        return best
    low, high = float(x[max(k - 1, 0)]), float(x[min(k + 1, len(x) - 1)])
    pose = {name: _link_axes(run, name, k) for name in (b.name for b in run.mechanism.bodies)}
    point = output.partition(".")
    for _ in range(ZOOMS):
        values = np.linspace(low, high, GRID)
        try:
            near = kinematics(run.system, drive={driver.name: values}, guess=pose)
        except SolveError:
            return best
        finer = ForcePath(near, driver, point[0], point[2], joint)
        found = np.array([finer.at(n).angle for n in range(GRID)])
        if not np.isfinite(found).any():
            return best
        n = int(np.nanargmin(found))
        if found[n] <= best.value:
            best = LeastAngle(float(found[n]), float(values[n]), best.t)
        low, high = float(values[max(n - 1, 0)]), float(values[min(n + 1, GRID - 1)])
        pose = {name: _link_axes(near, name, max(n - 1, 0)) for name in pose}
    return best


def _link_axes(run: Solution, name: str, k: int) -> tuple[float, float, float]:
    body = run[name]
    pose = (float(values[k]) for values in (body.x, body.y, body.angle))
    return run.system.numbers.link_axes(name, *pose)


def _plain(values: Array) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]
