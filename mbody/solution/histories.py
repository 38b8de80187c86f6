"""Histories: what a solution hands out, arrays over instants (with a first axis of designs)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.system.read_only import lock

__all__ = [
    "BodyHistory",
    "BranchDistance",
    "Checks",
    "LoadHistory",
    "PointHistory",
    "Reaction",
    "Record",
]

Array = np.ndarray


class Record:
    """Rows of numbers over instants, as the kernels left them; histories are taken out when read.

    Parameters
    ----------
    blocks : list of arrays (instants, rows, lanes)
        One after another along the lanes.
    count : int
        Instants of a single motion, or designs of a batch.
    batch : bool
        Whether a lane is a design; else a lane is a piece of one motion, which goes on in the
        next lane.
    """

    def __init__(self, blocks: list[Array], count: int, batch: bool) -> None:
        self.blocks, self.count, self.batch = blocks, count, batch

    def take(self, row: int) -> Array:
        """History of one row, read-only: (instants,), or (designs, instants) of a batch."""
        if self.batch:
            whole = np.concatenate([block[:, row, :].T for block in self.blocks])[: self.count]
        else:
            whole = self.blocks[0][:, row, :].T.reshape(-1)[: self.count]
        whole.flags.writeable = False  # a view of what is kept
        return whole

    def some(self, first: int, count: int) -> list[Array]:
        """Histories of rows that follow each other, as of `take`."""
        if self.batch:
            return [self.take(row) for row in range(first, first + count)]
        rows = self.blocks[0][:, first : first + count, :]
        rows.flags.writeable = False
        return [row[: self.count] for row in rows.transpose(1, 2, 0).reshape(count, -1)]

    def table(self, rows: slice) -> Array:
        """Histories of many rows at once: (instants, rows), or (designs, instants, rows)."""
        if self.batch:
            parts = [block[:, rows, :].transpose(2, 0, 1) for block in self.blocks]
            return np.ascontiguousarray(np.concatenate(parts)[: self.count])
        block = self.blocks[0][:, rows, :].transpose(2, 0, 1)
        lanes, instants, width = block.shape  # no rows where there are no joints
        return np.ascontiguousarray(block.reshape(lanes * instants, width)[: self.count])

    def at(self, rows: slice, instants: Array, design: int = 0) -> Array:
        """Many rows at some instants, by their numbers, of a motion or of one design of a batch:
        (instants, rows).
        """
        if self.batch:
            return np.ascontiguousarray(self.table(rows)[design, instants])
        block = self.blocks[0]
        if len(instants) == 1:  # of searches, which take one of each of many designs
            lane, place = divmod(int(instants[0]), len(block))
            return block[place : place + 1, rows, lane].copy()
        lanes, places = np.divmod(instants, len(block))
        return np.ascontiguousarray(block[places, rows, lanes])

    def load_on(self, cause: int, first: int) -> tuple[Array, Array, Array] | None:
        """Force and torque of a load at the coordinates of a body from `first` on, where they are
        kept; None where kernels compute them, as for all that analyses give.
        """
        return None


@dataclass(frozen=True)
class BodyHistory:
    """Motion of one body: its mass centre and its angle.

    Attributes
    ----------
    x, y, vx, vy, ax, ay : arrays (instants,)
        Mass centre, world axes.
    angle, omega, alpha : arrays (instants,)
        Of the link's x axis [rad], and its rates.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> run["crank"].angle.shape, round(float(run["crank"].omega[0]), 9)
    ((361,), 10.0)
    """

    name: str
    x: Array
    y: Array
    angle: Array
    vx: Array
    vy: Array
    omega: Array
    ax: Array
    ay: Array
    alpha: Array


@dataclass(frozen=True)
class PointHistory:
    """Motion of a point of a body, world axes: arrays (instants,)."""

    name: str
    x: Array
    y: Array
    vx: Array
    vy: Array
    ax: Array
    ay: Array

    def __post_init__(self) -> None:
        lock(self)


@dataclass(frozen=True)
class Reaction:
    """Force and torque on body `on` by body `by` at a joint, world axes: arrays (instants,).

    Attributes
    ----------
    unique : tuple of three bool, or None
        Whether each of fx, fy, torque is determined; redundant constraints may leave it open, and
        the one of least norm is given. None where it was not looked at.

    Examples
    --------
    >>> import mbody
    >>> rod = mbody.Mechanism("rod")
    >>> rod.add(mbody.Body("rod", mass=2.0, guess=0.0), mbody.Revolute("O", "ground", "rod"))
    >>> rod.add(mbody.AngleDriver("motor", "rod", 0.0), mbody.Gravity("gravity", y=-9.81))
    >>> pin = mbody.statics(rod).reaction("O")
    >>> round(float(pin.fy[0]), 9), pin.on, pin.unique
    (19.62, 'rod', (True, True, True))
    """

    joint: str
    on: str
    by: str
    fx: Array
    fy: Array
    torque: Array
    unique: tuple[bool, bool, bool] | None = (True, True, True)

    def __post_init__(self) -> None:
        lock(self)

    @property
    def magnitude(self) -> Array:
        """√(fx² + fy²)."""
        return np.sqrt(self.fx * self.fx + self.fy * self.fy)

    @property
    def direction(self) -> Array:
        """Angle of the force from the world's x axis, 0 … 2π [rad]."""
        return np.mod(np.arctan2(self.fy, self.fx), 2.0 * np.pi)


@dataclass(frozen=True)
class BranchDistance:
    """How near a motion came to a singular position, at which branches meet.

    Attributes
    ----------
    least : float
        Least scaled pivot of the constraints, without unit: 0 where branches meet.
    t : float
        The instant of it.
    """

    least: float
    t: float


@dataclass(frozen=True)
class Checks:
    """Relative maxima over all instants of what must vanish, and the distance from other branches.

    Attributes
    ----------
    constraint : float
        Violation of the constraints, lengths by the model length.
    equilibrium : float
        f − M a − Gᵀλ as a part of its greatest term at any instant.
    virtual_work : float
        Power of loads, inertia and drivers as a part of the peak power.
    energy : float or None
        Of a motion over time the balance of energy as a part of the greatest energy that took part.
    branch : BranchDistance or None
        How near a followed motion came to another branch; None where none was followed.
    """

    constraint: float
    equilibrium: float
    virtual_work: float
    energy: float | None = None
    branch: BranchDistance | None = None


@dataclass(frozen=True)
class LoadHistory:
    """What a load does: its force and torque on body `on`, world axes, and what it goes by; arrays
    (instants,), of a batch (designs, instants).

    Attributes
    ----------
    name, on : str
        The load, and the body on which it acts; on a body that it acts against (``by``; the ground
        where there is none) the opposite acts.
    fx, fy, torque : arrays
        Force, and torque about the place at which it acts on that body; of what acts on all bodies
        about the mass centre.
    force : array
        Of a spring or damper its tension, positive where it pulls its ends together; of all others
        the magnitude √(fx² + fy²).
    length : array or None
        Distance of the ends of a spring or damper.
    angle : array or None
        Angle of the body of a torsion spring or damper from the other one [rad].
    rate : array or None
        Rate of that length or angle.
    height, speed, sinking, spin : array or None
        Of a tyre: height of the wheel's centre above the road, its velocity along the road and
        across it, and the rate of the wheel.
    """

    name: str
    on: str
    by: str
    fx: Array
    fy: Array
    torque: Array
    force: Array
    length: Array | None = None
    angle: Array | None = None
    rate: Array | None = None
    height: Array | None = None
    speed: Array | None = None
    sinking: Array | None = None
    spin: Array | None = None

    def __post_init__(self) -> None:
        lock(self)
