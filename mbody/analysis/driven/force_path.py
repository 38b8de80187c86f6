"""The force that goes through a mechanism from a driver to an output, instant by instant."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.contact.contact_phases import ContactPhase, contact_phases
from mbody.errors import ModelError, brief
from mbody.model.contact import Contact
from mbody.model.driver import Driver
from mbody.model.element import listed
from mbody.model.joints import CamFollower
from mbody.model.one_sided_constraint import joined
from mbody.solution.places import moved
from mbody.solution.solution import Solution
from mbody.system.rank import dense, rank_of

__all__ = ["ForcePath", "Transferred"]

Array = np.ndarray

#: Of the swiftest coordinate and of the greatest force, what is none.
NONE = 1e-10
#: Instants at which it is looked for what carries a force.
LOOKED = 8


@dataclass(frozen=True)
class Transferred:
    """What comes through at one instant.

    Attributes
    ----------
    by : str
        The joint or contact whose force it is; empty where none has any.
    angle : float
        μ [rad].
    ratio, advantage : float
        ẏ/ẋ and ẋ/ẏ.
    index : float
        Joint force index.
    """

    by: str
    angle: float
    ratio: float
    advantage: float
    index: float


#: Where nothing drives the output, or more than one motion is left.
NOTHING = Transferred("", math.nan, math.nan, math.nan, math.nan)


class ForcePath:
    """How a driver drives an output over a result.

    Parameters
    ----------
    run : Solution
        Of one design; of `simulate` with the contacts that are closed at each instant.
    driver : Driver
    body, point : str
        The output, and its point or "".
    joint : str or None
        The joint, contact or group of contacts that drives it; None to find it.

    Attributes
    ----------
    names : tuple of str
        Joints and contacts that may drive the output: one joint, or contacts of two bodies.
    """

    def __init__(
        self, run: Solution, driver: Driver, body: str, point: str, joint: str | None
    ) -> None:
        self.run, self.body = run, body
        self.phases = [_Phase(run, one, driver, body, point) for one in contact_phases(run)]
        self.of: dict[int, _Phase] = {
            int(k): phase for phase in self.phases for k in phase.instants
        }
        self.names = self._found() if joint is None else self._given(joint)

    def at(self, k: int) -> Transferred:
        """What comes through at an instant."""
        return self.of[k].at(k, self.names)

    @property
    def turns(self) -> bool:
        """Whether the output is an angle."""
        return self.phases[0].turns

    def _candidates(self) -> dict[str, tuple[str, ...]]:
        """The bodies of the joints of the output body, and of contacts that are ever closed."""
        found: dict[str, tuple[str, ...]] = {}
        for phase in self.phases:
            for one in joined(phase.system.mechanism):
                if self.body in one.bodies:
                    found[one.name] = tuple(one.bodies)
        return found

    def _given(self, name: str) -> tuple[str, ...]:
        machine, found = self.run.mechanism, self._candidates()
        contacts = [one for one in machine.contacts if self.body in one.bodies]
        own = [one.name for one in contacts if one.name == name]
        own += [one.name for one in machine.contacts_of(name) if self.body in one.bodies]
        if name in found:
            return (name,)
        if own:
            return tuple(own)
        known = listed([*found, *(one.name for one in contacts if one.name not in found)])
        raise ModelError(f"{brief(name)} is no joint of '{self.body}' ({known})", name)

    def _found(self) -> tuple[str, ...]:
        found = self._candidates()
        if not found:
            raise ModelError(
                f"'{self.body}' has no joint: the transmission angle is of the force in one",
                self.body,
            )
        moving = [name for name, bodies in found.items() if "ground" not in bodies]
        loaded = [name for name in moving if any(p.carries(name) for p in self.phases)]
        contacts = {one.name for one in self.run.mechanism.contacts}
        pairs = {frozenset(found[name]) for name in loaded}
        if len(loaded) == 1 or (loaded and len(pairs) == 1 and contacts.issuperset(loaded)):
            return tuple(loaded)
        if loaded:
            raise ModelError(
                f"{listed(loaded)} drive '{self.body}': name the joint of which you want the "
                "transmission angle",
                self.body,
            )
        raise ModelError(
            f"no joint with a moving link drives '{self.body}', so there is no transmission "
            "angle: for the ratios alone name one of its joints as the joint "
            f"({listed(found)}){self._contact_remedy()}",
            self.body,
        )

    def _contact_remedy(self) -> str:
        """What to do where contacts drive the output that no instant of the result has closed."""
        contacts = [one for one in self.run.mechanism.contacts if self.body in one.bodies]
        if not contacts:
            return ""
        return (
            f"; contacts drive it ({listed((one.name for one in contacts), 4)}): take a result of "
            "simulate, which closes and opens them"
        )


@dataclass(frozen=True, eq=False)
class _Carrier:
    """A joint, or one place of a contact: its rows and where its force acts on the output."""

    name: str
    rows: list[int]
    place: Array


class _Phase:
    """Forces and velocities of one output while the same contacts are closed, without units."""

    def __init__(
        self, run: Solution, phase: ContactPhase, driver: Driver, body: str, point: str
    ) -> None:
        self.run, self.system, self.instants = run, phase.system, phase.instants
        self.n, self.body = self.system.coordinates, body
        self.first = 3 * self.system.bodies[body]
        self.point = f"{body}.{point}" if point else ""
        machine = self.system.mechanism
        self.elements = [one for one in joined(machine) if one.name not in phase.open]
        apart = {e for name in phase.open for e in self.system.primitives_of[name]}
        primitive = self.system.row_table[0]
        #: Rows of the system that act, of which all numbers of rows are.
        self.kept = np.flatnonzero([e not in apart for e in primitive])
        self.primitive = primitive[self.kept]
        names = [d.name for d in self.system.drivers]
        row = self.system.rows - len(names) + names.index(driver.name)
        self.row = int(np.flatnonzero(self.kept == row)[0])
        self.others = np.arange(len(self.kept)) != self.row
        self.unit = driver.unit(self.system.length)
        self.work = self.system.work()
        self.q = run.record.table(slice(None))[:, : self.n]
        self.rows_of = {
            one.name: self._rows(self.system.primitives_of[one.name]) for one in self.elements
        }
        self.turns = not point and not self._keeps_direction()
        #: Whether contacts decide how many motions are left.
        self.decided = phase.system is not run.system or bool(phase.open)
        self._carriers: dict[str, list[_Carrier]] = {}

    def _rows(self, primitives: Any) -> list[int]:
        own = set(np.atleast_1d(np.asarray(primitives, dtype=int)).tolist())
        return [r for r, e in enumerate(self.primitive) if int(e) in own]

    def carriers(self, name: str) -> list[_Carrier]:
        """What may carry a force, of a joint or of the places of a contact; none where it is
        open.
        """
        if name not in self.rows_of:
            return []
        if name not in self._carriers:
            (one,) = (one for one in self.elements if one.name == name)
            self._carriers[name] = self._places(one)
        return self._carriers[name]

    def _places(self, one: Any) -> list[_Carrier]:
        if isinstance(one, Contact):
            own = self.system.primitives_of[one.name]
            spots = one.spots(self.system.numbers)
            return [
                _Carrier(one.name, self._rows(own[n]), self._centre(one, spot))
                for n, spot in enumerate(spots)
            ]
        if one.role == "contact":  # a rope, a limit
            return []
        if isinstance(one, CamFollower) and one.roller:
            centre = self.run.point(one.j)
            x, y = centre.x, centre.y
        else:
            x, y = self.run.reaction_point(one.name)
        place = np.stack([np.atleast_1d(x), np.atleast_1d(y)], axis=1)
        return [_Carrier(one.name, self.rows_of[one.name], place)]

    def _centre(self, contact: Contact, spot: Any) -> Array:
        """Of the circle or corner that touches an edge, of the smaller of two circles: the line of
        the force goes through it, as through the centre of a cam's roller.
        """
        first, second = contact.bodies[::-1] if spot.swapped else contact.bodies
        tip = (second, float(spot.arm[0]), float(spot.arm[1]))
        if spot.edge is None:
            ri, rj = (abs(float(x)) for x in spot.tangent.parameters[4:6])
            if ri < rj:
                x, y = (float(part) for part in spot.normal.parameters[:2])
                tip = (first, x, y)
        return moved(self.run, tip)

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
        return dense(self.system, self.work)[1][self.kept]

    def _motion(self, k: int) -> tuple[Array, Array | None]:
        """Φ_q, and the motion that the joints leave when the driver is released; None where
        contacts leave none, or more than one.
        """
        G = self._jacobian(k)
        if self.decided and rank_of(G[self.others]).free != 1:
            return G, None
        return G, np.linalg.svd(G[self.others])[2][-1]

    def carries(self, name: str) -> bool:
        """Whether a force goes through a joint or contact at any of some instants."""
        if name not in self.rows_of:
            return False
        some = self.instants[:: max(1, len(self.instants) // LOOKED)]
        for k in some.tolist():
            G, along = self._motion(k)
            if along is None:
                continue
            multipliers, _ = self._multipliers(G, self._load(k, along))
            force = self._force(G, multipliers, self.rows_of[name], self._side(name))
            if np.hypot(*force) > NONE * self._most(G, multipliers):
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

    def _multipliers(self, G: Array, Q: Array) -> tuple[Array, float]:
        """(λ, w) with Gᵀ λ + w Q = 0: multipliers and how much load goes with them."""
        if len(G) == self.n:
            both = np.concatenate([G.T, Q[:, None]], axis=1)
            null = np.linalg.svd(both)[2][-1]
            return null[:-1], float(null[-1])
        return np.linalg.lstsq(G.T, -Q, rcond=1e-10)[0], 1.0

    def _side(self, name: str) -> str:
        """The body on which the force of a joint or contact is taken: the output, or its j."""
        (one,) = (one for one in self.elements if one.name == name)
        side = self.body if self.body in one.bodies else one.bodies[1]
        return str(one.bodies[0] if side == "ground" else side)

    def _force(self, G: Array, multipliers: Array, rows: list[int], body: str) -> Array:
        first = 3 * self.system.bodies[body]
        return np.asarray(multipliers[rows] @ G[rows, first : first + 2])

    def _most(self, G: Array, multipliers: Array) -> float:
        """The greatest force in any joint or contact."""
        return max(
            float(np.hypot(*self._force(G, multipliers, rows, self._side(name))))
            for name, rows in self.rows_of.items()
        )

    def at(self, k: int, names: tuple[str, ...]) -> Transferred:
        """What comes through at an instant, by that of some joints or contacts that has most."""
        G, along = self._motion(k)
        if along is None:
            return NOTHING
        multipliers, load = self._multipliers(G, self._load(k, along))
        most = self._most(G, multipliers)
        angle, by, size = math.nan, "", NONE * most
        for one in (one for name in names for one in self.carriers(name)):
            F = self._force(G, multipliers, one.rows, self.body)
            if float(np.hypot(*F)) <= size:
                continue
            by, size = one.name, float(np.hypot(*F))
            v = self._velocity(along, self._arm(k, one.place[k]))
            angle = math.nan
            if np.hypot(*v) > NONE:
                angle = math.asin(min(1.0, abs(float(F @ v)) / (size * float(np.hypot(*v)))))
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
        return Transferred(by, angle, ratio, advantage, index)
