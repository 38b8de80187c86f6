"""What a result says of friction: losses, modes, ranges, uniqueness, jams, efficiency."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.presentation import present
from mbody.errors import ModelError
from mbody.kernels.friction import CERTIFICATE, REACHED_PART
from mbody.kernels.output import PER_PRIMITIVE
from mbody.model.element import listed
from mbody.solution.contact_forces import contact_wrench
from mbody.solution.friction_ranges import Jam, jams_at
from mbody.solution.friction_ranges import forces_at_rest as at_rest
from mbody.solution.places import reaction_torque
from mbody.solution.rough_pairs import (
    losing_pairs,
    pair_rates,
    rates_at,
    resting_pairs,
    rough_pairs,
    tangent_forces,
)
from mbody.system.read_only import lock, locked

if TYPE_CHECKING:
    from mbody.solution.histories import Reaction

__all__ = ["Efficiency", "ForceRange", "FrictionReport", "FrictionResults"]

Array = np.ndarray


@dataclass(frozen=True)
class ForceRange:
    """Between what a force may lie, where joints rest that hold by friction.

    Attributes
    ----------
    low, high : arrays (instants,), or Reaction
        Of an effort or a reaction. Where nothing rests both are the force itself; infinite where no
        effort moves the mechanism in that sense; NaN where a reaction is not known then.
    """

    low: Any
    high: Any

    def __post_init__(self) -> None:
        lock(self)


@dataclass(frozen=True)
class FrictionReport:
    """Whether friction is unique, and where the mechanism jams.

    Attributes
    ----------
    certified : array (instants,) of bool, (designs, instants) of a batch
        Whether friction is certain to have one solution. The condition is sufficient only.
    jams : tuple of Jam
        Instants at which no effort moves the mechanism: time, joint, and the coefficient of
        friction from which on it jams.
    """

    certified: Array
    jams: tuple[Jam, ...]

    def __post_init__(self) -> None:
        lock(self)


@dataclass(frozen=True)
class Efficiency:
    """What a mechanism makes of the work that it gets.

    Attributes
    ----------
    value : float
        useful/given.
    given : float
        Work of the drivers over the motion.
    useful : float
        Work done on the output.
    lost : float
        Work that the joints took by friction.
    """

    value: float
    given: float
    useful: float
    lost: float


def _limits(plain: Array, choices: Array) -> tuple[Array, Array]:
    """Least and greatest of choices (choices, …); without any the plain number."""
    if not len(choices):
        return plain, plain
    ends = (np.fmin.reduce(choices), np.fmax.reduce(choices))
    low, high = (locked(np.where(np.isnan(one), plain, one)) for one in ends)
    return low, high


class FrictionResults:
    """What `Solution` has of friction."""

    @functools.cached_property
    def _pair_rates(self: Any) -> Array:
        return pair_rates(self)

    @functools.cached_property
    def _rest(self: Any) -> Array:
        return resting_pairs(self)

    @functools.cached_property
    def losses(self: Any) -> Mapping[str, Array]:
        """Power that friction takes in each rough joint, by its name: arrays (instants,), or
        (designs, instants) of a batch.

        Examples
        --------
        >>> import mbody
        >>> machine = mbody.Mechanism("wheel")
        >>> machine.add(
        ...     mbody.Body("wheel", mass=2.0, cg=(0.1, 0.0)),
        ...     mbody.Revolute("O", "ground", "wheel", friction=0.1, pin_radius=0.01),
        ...     mbody.AngleDriver("motor", "wheel", mbody.laws.ConstantSpeed(0.0, 10.0)),
        ... )
        >>> round(float(mbody.kinetostatics(machine).losses["O"][0]), 9)
        0.199007438
        """
        if not self.has_forces:
            return MappingProxyType({})
        found: dict[str, Any] = {}
        power = tangent_forces(self) * self._pair_rates[..., 0]
        for n, pair in losing_pairs(self):
            found[pair.joint] = found.get(pair.joint, 0.0) + power[..., n]
        rough = (*self.mechanism.joints, *self.mechanism.contacts)
        order = [one.name for one in rough if one.name in found]
        return MappingProxyType({name: locked(found[name]) for name in order})

    def mode(self: Any, name: str) -> list[Any]:
        """How a rough joint moves at each instant: ``"stick"``, or ``"slip+"`` and ``"slip-"`` by
        the sign of its rate; of a batch a list of each design. Of a contact or a rope in a motion
        of `simulate` ``"open"`` too, and ``"roll"`` of a wheel that sticks.

        Raises
        ------
        ModelError
            For what has no friction.
        """
        if name in self.modes:
            return list(self.modes[name])
        self._rough(name)
        n = next(n for n, one in losing_pairs(self) if one.joint == name)
        words = np.array(["slip-", "stick", "slip+"], dtype=object)
        found: list[Any] = words[(self._pair_rates[..., n, 2] + 1.0).astype(int)].tolist()
        return found

    def _rough(self: Any, name: str) -> None:
        """Refuse what has no friction."""
        known = list(dict.fromkeys(pair.joint for _, pair in losing_pairs(self)))
        if name not in known:
            raise ModelError(
                f"{name!r} is no joint with friction (there are: {listed(known)}): give it "
                "friction, as in friction=0.1",
                str(name),
            )

    @functools.cached_property
    def forces_at_rest(self: Any) -> Array:
        """(choices, …instants, PER_PRIMITIVE·primitives), see `forces_at_rest`."""
        if not self.record.batch:
            return at_rest(self, self._pair_rates, self._rest)
        own = zip(self._pair_rates, self._rest, strict=True)
        every = [at_rest(self, *one, n) for n, one in enumerate(own)]
        count = max(len(one) for one in every)
        found = np.full((count, len(every), *every[0].shape[1:]), np.nan)
        for n, one in enumerate(every):
            found[: len(one), n] = one
        return found

    def range(self: Any, name: str, on: str | None = None) -> ForceRange:
        """Least and greatest effort of a driver or a coupling, or reaction of a joint, where joints
        rest: their friction may be anything up to its limit there.

        At rest the limits are those at which the mechanism begins to move one way or the other,
        each driver alone; in a motion those just before and just after the rate of a joint changes
        its sign.

        Parameters
        ----------
        name : str
            Of a driver, a coupling or a joint.
        on : str, optional
            Of a joint the body on which the force acts, as of `reaction`.

        Raises
        ------
        ModelError
            For a name that there is not, and analyses without forces.
        """
        known = name in self.mechanism if isinstance(name, str) else False
        element: Any = self.mechanism[name] if known else None
        if element is None or element.role in ("joint", "contact"):
            return self._reaction_range(self.reaction(name, on), element)
        e = self.system.primitives_of[element.name][0]
        return ForceRange(*_limits(self.effort(name), -self.forces_at_rest[..., PER_PRIMITIVE * e]))

    def _reaction_range(self: Any, plain: Reaction, joint: Any) -> ForceRange:
        """Of each component by itself."""
        forces = self.forces_at_rest
        if joint.role == "contact":
            parts = contact_wrench(
                self, joint, plain.on, lambda e, n: forces[..., PER_PRIMITIVE * e + n]
            )
        else:
            rows = self.system.primitives_of[joint.name]
            sign = 1.0 if plain.on == joint.j.body else -1.0
            x, y, turning = (
                sum(sign * forces[..., PER_PRIMITIVE * e + n] for e in rows) for n in (2, 3, 4)
            )
            every = [reaction_torque(self, joint, *one) for one in zip(x, y, turning, strict=True)]
            parts = x, y, np.array(every).reshape(np.shape(turning))
        ends = [
            _limits(getattr(plain, key), part)
            for key, part in zip(("fx", "fy", "torque"), parts, strict=True)
        ]
        low, high = (
            replace(plain, **dict(zip(("fx", "fy", "torque"), one, strict=True)))
            for one in zip(*ends, strict=True)
        )
        return ForceRange(low, high)

    @functools.cached_property
    def friction(self: Any) -> FrictionReport | None:
        """Whether friction is unique, and where the mechanism jams; None without rough joints or
        forces.
        """
        rows = self.system.friction_rows
        if rows.start == rows.stop or not self.has_forces:
            return None
        radius, reached = (
            np.asarray(self.record.take(rows.start + n)) for n in (CERTIFICATE, REACHED_PART)
        )
        certified = (radius < 1.0) & (reached >= 1.0)
        every = reached if self.record.batch else reached[None]
        jams = [
            jam
            for n in np.flatnonzero((every < 1.0).any(axis=1)).tolist()
            for jam in jams_at(self, rates_at(self, n), every[n], n)
        ]
        return FrictionReport(certified, tuple(jams))

    @property
    def resting(self: Any) -> dict[str, Array]:
        """Rough joints that rest at some instant, with the instants: arrays of bool (instants,)."""
        rest = self._rest
        found: dict[str, Array] = {}
        for n, pair in enumerate(rough_pairs(self.system)):
            if rest[..., n].any():
                found[pair.joint] = rest[..., n]
        return found

    def efficiency(self: Any, output: str) -> Efficiency:
        """What the mechanism makes of the work of its drivers over the motion.

        Parameters
        ----------
        output : str
            A load that the mechanism works against, or a driver that takes power.

        Returns
        -------
        Efficiency
            Work given by the drivers, useful work done on the output, work lost in joints. What
            else takes or gives work, as other loads and changes of speed, is in none of them.

        Raises
        ------
        ModelError
            For what is neither a load nor a driver, and where nothing is given.

        Notes
        -----
        Of a motion of `simulate` these are the works of its account of energy. Of kinetostatics,
        where the laws of the drivers led the motion, they are integrated anew by Gauss's rule, in
        parts of the motion that are halved where a joint changes the sense of its sliding; else by
        the trapezoidal rule over the instants that there are.
        """
        found: Efficiency = present("efficiency", self, output)
        return found
