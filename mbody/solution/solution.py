"""Results by name: histories of bodies, points, reactions, efforts; checks; tables."""

from __future__ import annotations

import functools
import itertools
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.other_words import Attributes
from mbody.core.presentation import Presented, present
from mbody.errors import ModelError
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.model.element import Marker, listed, unknown_name
from mbody.model.mechanism import Mechanism
from mbody.quantities.formula import PlainNumbers
from mbody.solution.histories import (
    BodyHistory,
    BranchDistance,
    Certified,
    Checks,
    DesignReport,
    EventRecord,
    LoadHistory,
    PointHistory,
    Reaction,
    Record,
    Unique,
    ends,
    one_design,
    reaction_point,
    reaction_torque,
    reported_certificate,
    with_fields,
)
from mbody.system.system import System, locked

if TYPE_CHECKING:
    from mbody.model.simulation import Measure
    from mbody.solution.checks import Equations, Momentum, PlaceLike
    from mbody.solution.declared_result import ResultTable
    from mbody.solution.doubts import Doubt
    from mbody.solution.energy import Energy
    from mbody.solution.friction_results import Efficiency, ForceRange, FrictionReport
    from mbody.solution.shared_forces import SharedResult
    from mbody.solution.stepped_contacts import SteppedContacts

# -- Initial state and settings, by which a motion can be followed again -----------------------


@dataclass(frozen=True, eq=False)
class InitialState:
    """How a motion of `simulate` began.

    `system`: With the histories of its inputs.
    `start`: The one instant that it began with, and what it goes on from.
    `request`: Of `mbody.analysis.dynamics.options`: its instants, method, events and releases.
    `first`: The time of its first instant.
    """

    system: System
    start: Any
    request: Any
    first: float


# -- Restart: state from which a motion continues as if not interrupted ------------------------

Array = np.ndarray


@dataclass(frozen=True)
class IntegrationSettings:
    """How a motion is integrated: the method, its tolerances, the step of methods that have one."""

    method: str
    rtol: float
    atol: float
    step: float = 0.0


@dataclass(frozen=True)
class ActiveSet:
    """Contact modes of an instant, in numbers and words that a file can have.

    `modes`, `pairs`: Of the contact points and of the frictional joints.
    `on`, `anchor`: Of the rows of the active set, whether they are and where sticking began.
    `phases`: Of the rows along contact points of two circles.
    """

    modes: tuple[str, ...]
    pairs: tuple[str, ...]
    on: tuple[float, ...]
    anchor: tuple[float, ...]
    phases: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class ModalState(ActiveSet):
    """Contact modes from which a motion continues.

    `groups`: Contact points that stick by the row of the first of them.
    `shared`: Contact points, and frictional joints after these, whose friction no equation decides;
      contact points whose normal force none does.
    `closed`, `beyond`: Contact points.
    `fresh` (str, int, float): Guards that begin at zero.
    `struck` (int, float): When contact points were struck last.
    `page`: What is kept of that instant, with which guards begin.
    `lost`: Energy that impacts took since the last instant of the result (before it: negative).
    `end`: The modes of the last instant of the result, at which the motion goes on.
    """

    groups: tuple[tuple[int, ...], ...]
    shared: tuple[tuple[int, ...], ...]
    closed: tuple[int, ...]
    beyond: tuple[int, ...]
    fresh: tuple[tuple[str, int, float], ...]
    struck: tuple[tuple[int, float], ...]
    page: tuple[float, ...]
    lost: tuple[float, ...]
    end: ActiveSet


@dataclass(frozen=True, eq=False)
class Restart:
    """The state of the steps before the last one, which was cut to end in time.

    `settings`: How the motion was integrated.
    `scale`, `y`, `slope` (2·coordinates + auxiliary states,): Sizes of the coordinates, the state,
      its derivative.
    `powers`, `gained` (causes,): Powers there, and the work done since the last instant of the
      result (before it: negative).
    `state`: See `mbody.kernels.step_state`.
    `own`: What the method itself carries on.
    `inputs`: Values of the inputs that are kept between set times.
    `sampled`: The controllers with their memories (`mbody.analysis.dynamics.interruptions`).
    `met`: Singular positions that were met (`mbody.analysis.singular.nearby_singularity`).
    `modal`: Of a motion with contacts or frictional joints.
    """

    settings: IntegrationSettings
    scale: Array
    y: Array
    slope: Array
    powers: Array
    gained: Array
    state: Array
    own: tuple[Array, ...]
    inputs: dict[str, float] = field(default_factory=dict)
    sampled: tuple[Any, ...] = ()
    met: Array = field(default_factory=lambda: np.zeros(0))
    modal: ModalState | None = None


def as_solution(given: Any) -> Solution:
    """The given result of an analysis; anything else is refused."""
    if isinstance(given, Solution):
        return given
    raise ModelError(
        "this reads the result of an analysis, as kinetostatics gives it, not an object of the "
        f"type {type(given).__name__}: analyse first"
    )


#: Where a result keeps the table of its sheets, which is not packed with it.
SHOWN_TABLE = "_shown_table"


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Attributes, Presented):
    """Result of an analysis: histories by name, in the units of the mechanism.

    Histories have one entry an instant; those of a batch have a first axis of designs. `status`,
    `doubts` and `notes` say what the result certifies of itself; its residuals are looked at when
    one of them is first read.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> round(float(run["crank"].omega[0]), 9)
    10.0
    """

    system: System
    analysis: str
    t: Array
    record: Record
    given: Array | None
    regularization: float = 0.0
    dependencies: dict[str, list[bool]] | None = None
    notes: Certified[tuple[str, ...]] = Certified(())
    status: Certified[str] = Certified("completed")
    doubts: Certified[tuple[Doubt, ...]] = Certified(())
    stats: dict[str, int] | None = None
    energy: Energy | None = None
    events: tuple[EventRecord, ...] = ()
    restart: Restart | None = None
    released: Mapping[str, float] = field(default_factory=dict)
    branch: BranchDistance | None = None
    #: How a motion began, one of each part of a motion of several.
    initial_states: tuple[InitialState, ...] = ()
    #: What every contact and frictional joint does, a word an instant: see `mode`.
    modes: Mapping[str, Sequence[str]] = field(default_factory=dict)
    #: What touches at every instant, of a motion by ``method="moreau"``.
    stepped: SteppedContacts | None = None
    #: Admissible forces that no equation decides.
    shared: SharedResult | None = None
    #: Of a batch what is said of each design; its own result where each was found alone; its error.
    reports: tuple[DesignReport | Solution | Exception, ...] = field(default=(), repr=False)

    def __getstate__(self) -> dict[str, Any]:
        # without what is made anew on demand: tables and read-only views cannot be packed
        made = functools.cached_property
        kept = (k for k in vars(self) if not isinstance(getattr(type(self), k, None), made))
        return {name: vars(self)[name] for name in kept if name != SHOWN_TABLE}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__post_init__()  # arrays forget in a file that they are locked

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", locked(self.t))
        object.__setattr__(self, "given", locked(self.given))

    def take(self, instants: Sequence[int] | np.ndarray[Any, Any]) -> Solution:
        """Some of the instants, by number, in that order, without later doubts and events."""
        one_design(self, "instants are of one design")
        index = np.asarray(instants, dtype=np.int64)
        rows, report = self.record.table(slice(None))[index], reported_certificate(self)
        last = float(self.t[index].max(initial=-np.inf))
        gone = [one for one in report.doubts if one.t is not None and one.t > last]
        sentences = {one.message for one in gone}
        return with_fields(
            self,
            doubts=tuple(one for one in report.doubts if one not in gone),
            notes=tuple(note for note in report.notes if note not in sentences),
            t=self.t[index],
            record=Record([np.ascontiguousarray(rows[:, :, None])], len(index), batch=False),
            given=None if self.given is None else self.given[index],
            energy=None if self.energy is None else self.energy.take(index),
            modes={name: [row[k] for k in index] for name, row in self.modes.items()},
            stepped=None if self.stepped is None else self.stepped.take(index),
            shared=None if self.shared is None else self.shared.take(index),
            events=tuple(one for one in self.events if one.t <= last),
            restart=None,
        )

    def design(self, index: int) -> Solution:
        """One design of a batch with its doubts and notes; of one design the result itself.

        Raises
        ------
        ModelError, SolveError
            Where it failed: the error of the analysis of that design alone.

        Examples
        --------
        >>> import mbody
        >>> system = mbody.assemble(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
        >>> run = mbody.kinetostatics(system.with_values({"crank.mass": [1.0, 2.0]}), t=[0.0, 0.1])
        >>> run.effort("motor").shape, run.design(1).effort("motor").shape
        ((2, 2), (2,))
        """
        system = self.system.design(index)
        if not self.record.batch:
            return self
        n = range(self.record.count)[index]
        found = self.reports[n] if self.reports else DesignReport()
        if isinstance(found, Exception):
            raise found.with_traceback(None)
        if isinstance(found, Solution):
            return found
        own = found._asdict()
        if hasattr(own.get("branch"), "distance"):
            own["branch"] = own["branch"].distance(system)
        return Solution(system, self.analysis, self.t, self.record.design(n), self.given, **own)

    def at(self, t: PlainNumbers) -> Solution:
        """The motion at other instants than those that were kept: followed again from its
        beginning by the same steps, so that it is what `simulate` would have kept there, bit for
        bit (where stops are struck, to the accuracy with which impacts are located).

        Parameters
        ----------
        t : float or array
            Times within the motion, in any order.

        Raises
        ------
        ModelError
            For what is no motion of `simulate`, or was read from a file, and for other times.

        Notes
        -----
        It takes as long as the motion did up to the last of the times, and controllers are called
        again.

        Examples
        --------
        >>> import mbody
        >>> run = mbody.simulate(mbody.gallery.load("simple_pendulum"), 1.0, instants=2)
        >>> round(float(run.at(0.5)["pendulum"].omega[0]), 6)
        4.24943
        """
        found: Solution = present("at", self, t)
        return found

    def then(self, *later: Solution) -> Solution:
        """The motion with those that go on from it, as one result.

        Parameters
        ----------
        *later : Solution
            Motions of `simulate` of the same mechanism, each begun with ``start=`` the one before;
            their inputs may follow other histories.

        Raises
        ------
        ModelError
            For other mechanisms, and a motion that does not begin where the one before ended.

        Examples
        --------
        >>> import mbody
        >>> machine = mbody.gallery.load("simple_pendulum")
        >>> first = mbody.simulate(machine, 1.0)
        >>> whole = first.then(mbody.simulate(machine, 2.0, start=first))
        >>> len(whole), float(whole.t[-1])
        (401, 2.0)
        """
        found: Solution = present("then", self, *later)
        return found

    @property
    def failures(self) -> dict[int, str]:
        """The sentence of each design of a batch that failed, by its number."""
        return {n: str(one) for n, one in enumerate(self.reports) if isinstance(one, Exception)}

    @property
    def mechanism(self) -> Mechanism:
        """The description that was analysed."""
        return self.system.mechanism

    @property
    def ending(self) -> str:
        """How the analysis ended, whatever is in doubt: "completed", "ended: …" or "stopped: …"."""
        return reported_certificate(self).status

    @property
    def has_forces(self) -> bool:
        """Whether the analysis found reactions and efforts."""
        return self.analysis in ("kinetostatics", "statics", "simulate")

    def __len__(self) -> int:
        return len(self.t)

    def read_by(self, name: str) -> str:
        """How the result of an element of that name is read; "" where there is none."""
        role = self.mechanism[name].role if name in self.mechanism else ""
        calls = {"body": "run['{}']", "joint": "run.reaction('{}')", "load": "run.load('{}')"}
        calls |= dict.fromkeys(("driver", "coupling"), "run.effort('{}')")
        return calls.get(
            role, "run.measure('{}')" if name in self.mechanism.measures else ""
        ).format(name)

    def __getitem__(self, body: str) -> BodyHistory:
        if not isinstance(body, str) or body not in self.system.bodies:
            known = listed(self.system.bodies)
            place = isinstance(body, str) and body.partition(".")[0] in self.system.bodies
            hint = f"; motions of points are run.point({body!r})" if place else ""
            raise ModelError(f"there is no body {body!r} (there are: {known}){hint}", str(body))
        n3, b = self.system.coordinates, self.system.bodies[body]
        if body == "ground":
            zero = locked(np.zeros(np.shape(self.record.take(0))))
            return BodyHistory(body, *([zero] * 9))
        parts = (self.record.some(k * n3 + 3 * b, 3) for k in range(3))
        return BodyHistory(body, *itertools.chain.from_iterable(parts))

    def point(self, place: Marker | str) -> PointHistory:
        """Motion of a place on a body, such as ``"coupler.P"`` or ``coupler.at(1.0, 2.0)``."""
        from mbody.solution.measures import point_history

        return point_history(self, place)

    def primitive_history(self, e: int, n: int) -> Array:
        """History of number n of a primitive (see `mbody.kernels.layout`)."""
        return self.record.take(3 * self.system.coordinates + PER_PRIMITIVE * e + n)

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force and torque of a joint on body `on` (by default body j) at the joint's place on j;
        of a contact or rope on that body, at its mass centre.

        Raises
        ------
        ModelError
            For a joint that does not exist, a body that it does not join, or an analysis without
            forces.
        """
        from mbody.solution.contact_forces import contact_reaction, with_reaction

        element = with_reaction(self, joint)
        if element.role == "contact":
            return contact_reaction(self, element, on, self._unique(joint, on))
        i, j = element.i.body, element.j.body
        if on not in (None, i, j):
            raise ModelError(f"joint '{joint}' joins '{i}' and '{j}', not {on!r}", joint)
        fx, fy, torque = self.joint_wrench(joint)
        torque = reaction_torque(self, element, fx, fy, torque)
        unique = self._unique(joint)
        if on == i:
            return Reaction(joint, i, j, -fx, -fy, -torque, unique)
        return Reaction(joint, j, i, fx, fy, torque, unique)

    def joint_wrench(self, joint: str) -> list[Array]:
        """fx, fy and torque of a joint about its place on j, world axes."""
        from mbody.solution.contact_forces import with_reaction

        if not self.has_forces:
            with_reaction(self, joint)  # refuses it
        first, *more = self.system.primitives_of[joint]
        start = 3 * self.system.coordinates + 2
        found = self.record.some(start + PER_PRIMITIVE * first, 3)
        for e in more:
            parts = self.record.some(start + PER_PRIMITIVE * e, 3)
            found = [one + part for one, part in zip(found, parts, strict=True)]
        return found

    def reaction_point(self, joint: str) -> tuple[Array, Array]:
        """Where the reaction of a joint, or the force of a driver of a length, acts: its place
        on j, or the point of contact; world axes, arrays (instants,).

        Raises
        ------
        ModelError
            For what has no place on j, as a driver of an angle.
        """
        element = self.mechanism[joint]
        if not isinstance(getattr(element, "j", None), Marker):
            raise ModelError(
                f"'{joint}', of the type {type(element).__name__}, acts at no place on a body j: "
                "ask for that of a joint, or of a driver of a length",
                joint,
            )
        return reaction_point(self, element)

    def contact(self, joint: str) -> Array:
        """Force with which the bodies of a contact, a cam or a rolling contact press on each other,
        of the last two negative where one would have to pull; the pull of a rope.

        Raises
        ------
        ModelError
            For a joint that is no contact, and as `reaction`.
        """
        from mbody.solution.contact_forces import pressing_force, with_reaction

        element = with_reaction(self, joint)
        if element.role == "contact":
            return pressing_force(self, element)
        found = self.reaction(joint)
        normal = element.normal(*ends(self, element))
        if normal is None:
            raise ModelError(
                f"'{joint}' is a {type(element).__name__}, no contact that presses: ask for its "
                "reaction",
                joint,
            )
        press: Array = locked(found.fx * normal[0] + found.fy * normal[1])
        return press

    def _unique(self, joint: str, on: str | None = None) -> Unique:
        plain: Unique = (True, True, True)
        if self._not_examined:
            return None
        element = self.mechanism.element_or_group(joint)
        # of closed contacts all that is open is among the admissible forces, by their limits too
        limited = element.role == "contact" and self.open_forces is not None
        if self.dependencies is not None and not limited:
            open_parts = self.dependencies.get(joint, [False] * 3)
            plain = (not open_parts[0], not open_parts[1], not open_parts[2])
            if self.mechanism.contacts_of(joint):
                return None  # it is not looked at whether the sum is determined
        if self.open_forces is None:
            return plain
        from mbody.solution.friction_results import unique_reaction

        return unique_reaction(self, element, on, plain)

    def known_of(self, quantity: Any, plain: Any = None) -> tuple[str, ...]:
        """Sentences about the forces that a quantity is made of, where they are not unique, or
        where that was not examined: none where the quantity does not depend on what is open.

        Parameters
        ----------
        quantity : str, Measure or callable
            A formula of histories as of `measure`, the name of a joint, contact, driver or
            coupling, or a function of a result that gives numbers. The function is called once
            more on the same motion with other forces that no equation excludes.
        plain : optional
            What such a function gave of this result.

        Examples
        --------
        >>> import mbody
        >>> shelf = mbody.Mechanism("shelf", ground={"A": (0, 0), "B": (1, 0)})
        >>> shelf.add(mbody.Body("board", mass=2.0, points={"A": (0, 0), "B": (1, 0)}, guess=0.0))
        >>> shelf.add(mbody.Revolute("A", "ground.A", "board.A"))
        >>> shelf.add(mbody.Revolute("B", "ground.B", "board.B"), mbody.Gravity("g", y=-9.81))
        >>> run = mbody.statics(shelf)
        >>> len(run.known_of("A.fx")), run.known_of("A.fy"), run.known_of("A.fx + B.fx")
        (1, (), ())
        """
        found: tuple[str, ...] = present("known_of", self, quantity, plain)
        return found

    @property
    def _not_examined(self) -> bool:
        """Whether nothing is known of what is unique: of large systems, and where something
        touches in steps with impulses.
        """
        touches = self.stepped is not None and len(self.stepped.which) > 0
        return touches or bool(self.regularization and self.dependencies is None)

    def unique_effort(self, name: str) -> bool | None:
        """Whether the effort of a driver or a coupling is determined; redundant rows may leave it
        open, and the one of least norm is given. None where it was not looked at.

        Raises
        ------
        ModelError
            As `effort`.
        """
        self._efforts(name)
        if self._not_examined:
            return None
        if self.dependencies is not None and any(self.dependencies.get(name, ())):
            return False
        if self.open_forces is None:
            return True
        from mbody.solution.friction_results import unique_effort

        return unique_effort(self, name)

    def effort(self, driver: str) -> Array:
        """Effort of a driver, a torque [force·length] or a force: its product with the driven rate
        is the power given to the mechanism. Of a coupling the same of its value, which has no rate.
        """
        self._efforts(driver)
        effort: Array = locked(-self.primitive_history(self.system.primitives_of[driver][0], 0))
        return effort

    def _efforts(self, driver: str) -> None:
        """Refuse what has no effort."""
        machine = self.mechanism
        drivers = [element.name for element in (*machine.drivers, *machine.couplings)]
        if driver not in drivers:
            raise unknown_name("driver", driver, drivers)
        if not self.has_forces:
            raise ModelError(
                f"{self.analysis} finds no forces, as of '{driver}': use kinetostatics", driver
            )

    def load(self, name: str, on: str | None = None) -> LoadHistory:
        """Force and torque of a load on a body, and the length, angle and rate that a spring or
        damper depends on; see `LoadHistory`.

        Parameters
        ----------
        name : str
            Of a load; for what acts on every body, as gravity, `on` is needed.
        on : str, optional
            The body on which it acts; by default body j, or the body that the load names.

        Raises
        ------
        ModelError
            For a load or a body that there is not.

        Examples
        --------
        >>> import mbody
        >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)
        >>> machine.add(mbody.Spring("spring", "ground", "rocker.B", stiffness=20.0))
        >>> found = mbody.kinetostatics(machine).load("spring")
        >>> bool(abs(found.force[0] - 20.0 * found.length[0]) < 1e-12)
        True
        """
        from mbody.solution.measures import load_history

        return load_history(self, name, on)

    def driven(self, driver: str) -> tuple[Array, Array, Array]:
        """Value, rate and acceleration of what a driver drives, angles in rad: arrays (instants,),
        or (designs, instants) of a batch whose designs may differ in its law. From its release on
        they are those of the motion, which no longer follows the law.

        Raises
        ------
        ModelError
            For a driver that does not exist.
        """
        from mbody.solution.measures import driven

        return driven(self, driver)

    @functools.cached_property
    def drive_states(self) -> Array | None:
        """Value, rate, acceleration (instants, drivers, 3), None where designs differ in them."""
        from mbody.solution.measures import drive_states

        return drive_states(self)

    def measure(self, of: str | Measure) -> Array:
        """History (instants,) of a measured quantity: one of the mechanism's measures by name, a
        `Measure`, or a formula of histories such as ``"coupler.P.y - rocker.y"``; angles in rad
        where no unit is given.
        """
        from mbody.model.simulation import measure_named
        from mbody.solution.measures import measured

        return measured(self, measure_named(self.mechanism.measures, of))[0]

    def sensitivity(self, measure: str | Measure, by: Sequence[str] | None = None) -> Any:
        """Which number changes a measured quantity most, in per cent per per cent: a table of the
        derivatives by all numbers, or by some; see `mbody.gradient`. The instants are held.
        """
        return present("sensitivity", self, measure, by)

    def inertia(self, body: str) -> tuple[Array, Array, Array]:
        """D'Alembert's inertia force and torque of a body: (−m ax, −m ay, −I α)."""
        history, b = self[body], self.system.bodies[body]
        mass = self.system.mass[3 * b : 3 * b + 3]
        m, _, inertia = mass[:, :, None] if self.system.batch is not None else mass[:, 0]
        return -m * history.ax, -m * history.ay, -inertia * history.alpha

    def momentum(self, about: PlaceLike = (0.0, 0.0)) -> Momentum:
        """Momentum, and angular momentum about a place; see `mbody.engineering.momentum`."""
        from mbody.solution.checks import momentum

        return momentum(self, about)

    @functools.cached_property
    def residuals(self) -> Array:
        """Residuals on which `checks` and doubts rest: (designs, instants, 5), see
        `mbody.kernels.finished_instants`.
        """
        from mbody.solution.checks import residuals

        return residuals(self)

    @functools.cached_property
    def checks(self) -> Checks:
        """Residuals by routes that the analysis did not take."""
        from mbody.solution.checks import checks

        return checks(self)

    def breakdown(self, name: str, on: str | None = None) -> dict[str, Any]:
        """A joint's reaction or a driver's effort split into the parts of inertia and of each load.

        Returns
        -------
        dict
            By cause ("inertia", the names of the loads, and "friction" of frictional joints): a
            `Reaction`, or the effort's array. They sum to the whole.
        """
        from mbody.solution.checks import breakdown

        if not isinstance(name, str):
            raise ModelError(f"a breakdown is of a joint or a driver by name, not of {name!r}")
        return breakdown(self, name, on)

    def equations(self, instant: int = 0) -> Equations:
        """The system of force equations of one instant, as arrays; ``print`` shows its numbers."""
        found: Equations = present("equations", self, instant)
        return found

    def derivation(self, form: str = "text", instant: int = 0) -> str:
        """Equations in symbols and with numbers, as "text", "markdown" or "latex"."""
        return str(present("derivation", self, form, instant))

    # -- Friction: `mbody.solution.friction_results`, loaded where there is some

    @functools.cached_property
    def rates_of_pairs(self) -> Array:
        """Of every pair with friction, see `pair_rates`."""
        from mbody.solution.contact_forces import pair_rates

        return pair_rates(self)

    @functools.cached_property
    def pairs_at_rest(self) -> Array:
        """Which pairs with friction stick, see `sticking_pairs`."""
        from mbody.solution.contact_forces import sticking_pairs

        return sticking_pairs(self)

    @functools.cached_property
    def losses(self) -> Mapping[str, Array]:
        """Power that friction takes in each frictional joint, by its name: arrays (instants,), or
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
        from mbody.solution.friction_results import losses_of

        return losses_of(self)

    def mode(self, name: str) -> list[Any]:
        """How a frictional joint moves at each instant: ``"stick"``, or ``"slip+"`` and ``"slip-"``
        by the sign of its rate; of a batch a list of each design. Of a contact or a rope in a
        motion of `simulate` ``"open"`` too, and ``"roll"`` of a wheel that sticks.

        Raises
        ------
        ModelError
            For what has no friction.
        """
        if name in self.modes:
            return list(self.modes[name])
        from mbody.solution.friction_results import mode_of

        return mode_of(self, name)

    @functools.cached_property
    def forces_at_rest(self) -> Array:
        """(choices, …instants, PER_PRIMITIVE·primitives), see `forces_at_rest`."""
        from mbody.solution.friction_results import every_force_at_rest

        return every_force_at_rest(self)

    def range(self, name: str, on: str | None = None) -> ForceRange:
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
        from mbody.solution.friction_results import range_of

        return range_of(self, name, on)

    @functools.cached_property
    def friction(self) -> FrictionReport | None:
        """Whether friction is unique, and where the mechanism jams; None without frictional joints
        or forces.
        """
        from mbody.solution.friction_results import friction_report

        return friction_report(self)

    @functools.cached_property
    def open_forces(self) -> SharedResult | None:
        """Admissible forces that no equation decides; None where all are determined."""
        rests = self.analysis in ("kinetostatics", "statics")
        if self.shared is not None or not rests or not len(self.system.layout.friction_kind):
            return self.shared
        found: SharedResult | None = present("open_forces", self)
        return found

    @property
    def resting(self) -> dict[str, Array]:
        """Frictional joints that rest at some instant, with the instants: arrays of bool
        (instants,).
        """
        from mbody.solution.friction_results import sticking_joints

        return sticking_joints(self)

    def efficiency(self, output: str) -> Efficiency:
        """Efficiency over the motion: useful work by the work of the drivers.

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
        parts of the motion that are halved where a joint slides the other way; else by
        the trapezoidal rule over the instants that there are.
        """
        found: Efficiency = present("efficiency", self, output)
        return found

    def table(self, units: Mapping[str, str] | None = None) -> ResultTable:
        """Every history as a column with ``.name``, ``.unit``, ``.role``, ``.values``, ``.unique``
        and ``.doubts``: the one table that files, data and pages are made of.

        Parameters
        ----------
        units : dict, optional
            Units of quantities where they are not those of the model, such as
            ``{"angle": "deg", "speed": "rpm"}``.

        Raises
        ------
        ModelError
            For a batch of designs, a quantity that there is not, and a unit that does not measure
            it.

        Examples
        --------
        >>> import mbody
        >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
        >>> found = run.table({"speed": "rpm"})["crank.omega"]
        >>> found.heading, round(float(found.values[0]), 6)
        ('crank.omega [rpm]', 95.492966)
        """
        found: ResultTable = present("table", self, units)
        return found

    def columns(self) -> dict[str, Array]:
        """All histories by column name, such as ``"crank.omega [rad/s]"``, for tables and files.

        Names say the unit; the first column is time. Only of one design, not of a batch.
        """
        found: dict[str, Array] = present("columns", self)
        return found

    def to_dataframe(self) -> Any:
        """The columns as a pandas DataFrame; pandas is needed only here."""
        return present("dataframe", self)

    def to_xarray(self) -> Any:
        """The columns as a Dataset of xarray over the coordinate ``t``, with units as attributes;
        xarray is needed only here.
        """
        return present("xarray", self)

    def to_csv(
        self, path: str | os.PathLike[str], angle: str | None = None, excel: bool = False
    ) -> None:
        """Write the columns as comma-separated values, numbers in full precision, angles in
        ``"rad"`` or ``"deg"``, by default in rad or as output units say; `excel`: with the mark
        of UTF-8, by which spreadsheets know it.
        """
        present("csv", self, path, angle, excel)

    def to_xlsx(self, path: str | os.PathLike[str]) -> None:
        """Write a spreadsheet: a sheet of instants, one of peaks, one of the model, in the units
        that people read; openpyxl is needed only here.
        """
        present("xlsx", self, path)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write `data` to a file."""
        present("json", self, path)

    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Write the columns as a table of Parquet; pyarrow is needed only here."""
        present("parquet", self, path)

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Write the columns as arrays of NumPy's own format; ``np.load`` reads them by name."""
        present("npz", self, path)

    def __iter__(self) -> Iterator[str]:
        return iter(body.name for body in self.mechanism.bodies)

    def __repr__(self) -> str:
        designs = f"{self.record.count} designs, " if self.record.batch else ""
        instants = "1 instant" if len(self) == 1 else f"{len(self)} instants"
        name = self.mechanism.name
        return f"Solution({name!r}: {self.analysis}, {designs}{instants}, {self.status})"
