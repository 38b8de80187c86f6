"""The verb `transmission`: how well a force comes through, from a driver to an output.

With the output load alone in balance with the driver, at rest and without weights, F is the force
in the joint that drives the output body and v the velocity of its place on that body. The
transmission angle is μ = arcsin |F·v|/(|F||v|), the pressure angle 90° − μ. Of a rocker that is the
angle between coupler and rocker, of a slider the angle between the rod and the normal of its guide,
of a cam follower the angle of the contact normal: the textbooks' angles, by one definition.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

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
from mbody.system.rank import dense
from mbody.system.read_only import lock

__all__ = ["LeastAngle", "Transmission", "transmission"]

Array = np.ndarray

#: Of the swiftest coordinate and of the greatest force, what is none.
NONE = 1e-10
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
        The joint is the one that drives the output body.
    t : array (instants,)
    driver_value : array
        [rad or length].
    angle, pressure_angle : arrays
        μ and 90° − μ [rad], 0 … π/2; NaN where the place stands still or no force goes through it.
    velocity_ratio : array
        ẏ/ẋ of the output and the driver, of a path its size; infinite at a dead centre of the
        driver.
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
        Of a driven mechanism, such as ``mbody.kinematics(machine, turn=True)``.
    driver : str, optional
        Name of the driver, or of its body; where there is one driver, that one.
    output : str
        The output body: its angle, loaded by a torque, where it turns, else the path of its mass
        centre; or one of its points, as ``"coupler.P"``, loaded along its path.
    joint : str, optional
        The joint that drives the output body, where several could.

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
    found = _Through(run, leader, output_body, point, joint)
    rows = np.array([found.at(k) for k in range(len(run))]).reshape(len(run), 5)
    x = np.asarray(run.driven(leader.name)[0], dtype=float)
    least = _least(run, leader, output, found.joint, rows[:, 0], x)
    notes = []
    if not np.isfinite(rows[:, 0]).any():
        notes.append(_undefined(found.joint, output_body))
    return Transmission(
        mechanism=run.mechanism,
        driver=leader.name,
        output=output,
        joint=found.joint,
        t=np.array(run.t),
        driver_value=x,
        angle=rows[:, 0],
        pressure_angle=0.5 * math.pi - rows[:, 0],
        velocity_ratio=rows[:, 1],
        mechanical_advantage=rows[:, 2],
        joint_force_index=rows[:, 3],
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


class _Through:
    """Forces and velocities of one output, instant by instant, without units."""

    def __init__(
        self, run: Solution, driver: Driver, body: str, point: str, joint: str | None
    ) -> None:
        self.run, self.system = run, run.system
        self.n, self.body = self.system.coordinates, body
        self.first = 3 * self.system.bodies[body]
        self.point = f"{body}.{point}" if point else ""
        names = [d.name for d in self.system.drivers]
        self.row = self.system.rows - len(names) + names.index(driver.name)
        self.others = np.arange(self.system.rows) != self.row
        self.unit = driver.unit(self.system.length)
        self.work = self.system.work()
        self.q = run.record.table(slice(None))[:, : self.n]
        self.rows_of = self._rows()
        self.turns = not point and not self._keeps_direction()
        self.joint = self._joint(joint)
        x, y = run.reaction_point(self.joint)
        self.place = np.stack([np.atleast_1d(x), np.atleast_1d(y)], axis=1)

    def _rows(self) -> dict[str, list[int]]:
        """Rows of every joint."""
        primitive = self.system.row_table[0]
        return {
            joint.name: [
                r for r, e in enumerate(primitive) if e in self.system.primitives_of[joint.name]
            ]
            for joint in self.system.mechanism.joints
        }

    def _keeps_direction(self) -> bool:
        """Whether slides keep the output body parallel to the ground."""
        kept, before = {"ground"}, 0
        while len(kept) > before:
            before = len(kept)
            for joint in self.system.mechanism.joints:
                if joint.parallel and kept & set(joint.bodies):
                    kept |= set(joint.bodies)
        return self.body in kept

    def _jacobian(self, k: int) -> Array:
        self.work.q[: self.n, 0] = self.q[k]
        self.work.time[:] = self.run.t[k]
        return dense(self.system, self.work)[1]

    def _motion(self, k: int) -> tuple[Array, Array]:
        """Φ_q, and the motion that the joints leave when the driver is released."""
        G = self._jacobian(k)
        return G, np.linalg.svd(G[self.others])[2][-1]

    def _joint(self, given: str | None) -> str:
        joints = [j for j in self.system.mechanism.joints if self.body in j.bodies]
        if given is not None:
            if given not in [j.name for j in joints]:
                known = listed(j.name for j in joints)
                raise ModelError(f"{brief(given)} is no joint of '{self.body}' ({known})", given)
            return given
        if not joints:
            raise ModelError(
                f"'{self.body}' has no joint: the transmission angle is of the force in one",
                self.body,
            )
        moving = [j.name for j in joints if "ground" not in j.bodies]
        loaded = [name for name in moving if self._carries(name)]
        if len(loaded) == 1:
            return loaded[0]
        if not loaded:
            raise ModelError(
                f"no joint with a moving link drives '{self.body}', so there is no transmission "
                "angle: for the ratios alone name one of its joints as the joint "
                f"({listed(j.name for j in joints)})",
                self.body,
            )
        raise ModelError(
            f"{listed(loaded)} drive '{self.body}': name the joint of which you want the "
            "transmission angle",
            self.body,
        )

    def _carries(self, name: str) -> bool:
        """Whether a force goes through a joint at any instant."""
        for k in range(0, len(self.run), max(1, len(self.run) // 8)):
            G, along = self._motion(k)
            forces, _ = self._forces(G, self._load(k, along))
            if np.hypot(*forces[name]) > NONE * max(np.hypot(*f) for f in forces.values()):
                return True
        return False

    def _arm(self, k: int, place: Array) -> Array:
        return np.asarray(place - self.q[k, self.first : self.first + 2])

    def _velocity(self, along: Array, arm: Array) -> Array:
        """Velocity of a place of the output body, by the model length."""
        x, y, turn = along[self.first : self.first + 3]
        a = arm / self.system.length
        return np.array([x - turn * a[1], y + turn * a[0]])

    def _output(self, k: int, along: Array) -> tuple[Array, float, Array]:
        """Arm of the loaded point, rate of the output and its direction."""
        arm = np.zeros(2)
        if self.point:
            px, py = self.system.numbers.point(self.point)
            cx, cy = self.system.numbers.point(f"{self.body}.cg")
            c, s = math.cos(self.q[k, self.first + 2]), math.sin(self.q[k, self.first + 2])
            px, py = float(px - cx), float(py - cy)
            arm = np.array([c * px - s * py, s * px + c * py])
        v = self._velocity(along, arm)
        speed = float(np.hypot(*v))
        return arm, speed, v / speed if speed > NONE else np.zeros(2)

    def _load(self, k: int, along: Array) -> Array:
        """A unit load on the output, as coordinates have it without units."""
        Q = np.zeros(self.n)
        if self.turns:
            Q[self.first + 2] = 1.0
            return Q
        arm, _, u = self._output(k, along)
        a = arm / self.system.length
        Q[self.first : self.first + 3] = u[0], u[1], a[0] * u[1] - a[1] * u[0]
        return Q

    def _forces(self, G: Array, Q: Array) -> tuple[dict[str, Array], float]:
        """Directions of the joint forces on the output's side, or on their body j, and how much
        load goes with them: (λ, w) with Gᵀ λ + w Q = 0.
        """
        if len(G) == self.n:
            both = np.concatenate([G.T, Q[:, None]], axis=1)
            null = np.linalg.svd(both)[2][-1]
            multipliers, load = null[:-1], float(null[-1])
        else:
            multipliers, load = np.linalg.lstsq(G.T, -Q, rcond=1e-10)[0], 1.0
        found = {}
        for joint in self.system.mechanism.joints:
            rows = self.rows_of[joint.name]
            side = self.body if self.body in joint.bodies else joint.bodies[1]
            side = joint.bodies[0] if side == "ground" else side
            first = 3 * self.system.bodies[side]
            found[joint.name] = multipliers[rows] @ G[rows, first : first + 2]
        return found, load

    def at(self, k: int) -> tuple[float, float, float, float, float]:
        """μ, ẏ/ẋ, ẋ/ẏ, joint force index, and |F·v|/(|F||v|)."""
        G, along = self._motion(k)
        forces, load = self._forces(G, self._load(k, along))
        F = forces[self.joint]
        most = max(float(np.hypot(*force)) for force in forces.values())
        v = self._velocity(along, self._arm(k, self.place[k]))
        sine = math.nan
        if np.hypot(*v) > NONE and np.hypot(*F) > NONE * most:
            sine = min(1.0, abs(float(F @ v)) / float(np.hypot(*F) * np.hypot(*v)))
        x = float(G[self.row] @ along) * self.unit
        y = float(along[self.first + 2])
        if not self.turns:  # along a path: of no sense
            x, y = abs(x), self._output(k, along)[1] * self.system.length
        y = y if abs(y) > NONE * self.system.length else 0.0
        ratio = y / x if abs(x) > NONE * self.unit else math.copysign(math.inf, x * y)
        advantage = x / y if y else math.copysign(math.inf, x * y)
        scale = self.system.length if self.turns else 1.0
        index = most / (abs(load) * scale) if abs(load) > NONE * most else math.inf
        if not y and not self.turns:  # the load has no direction
            index = math.nan
        return math.asin(sine), ratio, advantage, index, sine


def _least(
    run: Solution, driver: Driver, output: str, joint: str, angle: Array, x: Array
) -> LeastAngle | None:
    """The least μ of the instants, then between those on either side of it."""
    if not np.isfinite(angle).any():
        return None
    k = int(np.nanargmin(angle))
    best = LeastAngle(float(angle[k]), float(x[k]), float(run.t[k]))
    steps = np.diff(x)
    if len(run.system.leaders) != 1 or len(x) < 3 or not ((steps > 0).all() or (steps < 0).all()):
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
        finer = _Through(near, driver, point[0], point[2], joint)
        found = np.array([finer.at(n)[0] for n in range(GRID)])
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
    x, y = run.system.numbers.point(f"{name}.cg")
    angle = float(body.angle[k])
    c, s = math.cos(angle), math.sin(angle)
    return (
        float(body.x[k]) - c * float(x) + s * float(y),
        float(body.y[k]) - s * float(x) - c * float(y),
        angle,
    )


def _plain(values: Array) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]
