"""Histories: what a solution hands out, arrays over instants, and the protocol of results."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np

from mbody.core.other_words import Attributes
from mbody.core.presentation import present
from mbody.errors import ModelError
from mbody.model.element import Element, Marker, Numbers, unknown_name
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.system.system import Locked, System

if TYPE_CHECKING:
    from mbody.model.simulation import Measure
    from mbody.solution.doubts import Doubt
    from mbody.solution.energy import Energy
    from mbody.solution.shared_forces import SharedResult
    from mbody.solution.stepped_contacts import SteppedContacts

Array = np.ndarray
#: Whether each of fx, fy and torque is determined; None where it is not known.
Unique: TypeAlias = tuple[bool | None, bool | None, bool | None] | None


class Record:
    """Rows of numbers over instants, as the kernels left them; histories are taken out when read.

    `blocks`: One after another along the lanes.
    `count`: Instants of a single motion, or designs of a batch.
    `batch`: Whether a lane is a design; else a lane is a piece of one motion, which goes on in the
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
        rows = self.blocks[0][:, first : first + count, :].transpose(1, 2, 0).reshape(count, -1)
        rows.flags.writeable = False  # views of what is kept
        return [row[: self.count] for row in rows]

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
            part, lane = divmod(design, self.blocks[0].shape[2])
            return np.ascontiguousarray(self.blocks[part][instants, rows, lane])
        block = self.blocks[0]
        if len(instants) == 1:  # of searches, which take one of each of many designs
            lane, place = divmod(int(instants[0]), len(block))
            return block[place : place + 1, rows, lane].copy()
        lanes, places = np.divmod(instants, len(block))
        return np.ascontiguousarray(block[places, rows, lanes])

    def design(self, n: int) -> Record:
        """The rows of one design of a batch, a view of what is kept."""
        part, lane = divmod(n, self.blocks[0].shape[2])
        block = self.blocks[part][:, :, lane : lane + 1]
        return Record([block], len(block), batch=False)

    def load_on(self, cause: int, first: int) -> tuple[Array, Array, Array] | None:
        """Force and torque of a load at the coordinates of a body from `first` on, where they are
        kept; None where kernels compute them, as for all that analyses give.
        """
        return None


@dataclass(frozen=True)
class BodyHistory(Attributes):
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
class PointHistory(Attributes, Locked):
    """Motion of a point of a body, world axes: arrays (instants,)."""

    name: str
    x: Array
    y: Array
    vx: Array
    vy: Array
    ax: Array
    ay: Array


@dataclass(frozen=True)
class Reaction(Attributes, Locked):
    """Force and torque on body `on` by body `by` at a joint, world axes: arrays (instants,).

    Attributes
    ----------
    unique : tuple of three bool, or None
        Whether each of fx, fy, torque is determined at all instants. Redundant joints may leave it
        open, of which the one of least norm is given, and contacts and friction that sticks, of
        which that one is given that keeps all limits best. None where it was not looked at, or is
        not known.

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
    unique: Unique = (True, True, True)

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

    `least`: Least scaled pivot of the constraints, without unit: 0 where branches meet.
    `t`: The instant of it.
    """

    least: float
    t: float


@dataclass(frozen=True)
class Checks:
    """Relative maxima over all instants of what must vanish, and the distance from other branches.

    `constraint`: Violation of the constraints, lengths by the model length.
    `equilibrium`: f − M a − Gᵀλ as a part of its greatest term at any instant.
    `virtual_work`: Power of loads, inertia and drivers as a part of the peak power.
    `energy`: Of a motion over time the balance of energy as a part of the greatest energy that took
      part.
    `branch`: How near a followed motion came to another branch; None where none was followed.
    """

    constraint: float
    equilibrium: float
    virtual_work: float
    energy: float | None = None
    branch: BranchDistance | None = None


@dataclass(frozen=True)
class LoadHistory(Attributes, Locked):
    """Force and torque of a load on body `on`, world axes, and the quantities that it depends on;
    arrays (instants,), of a batch (designs, instants).

    `name`, `on`: The load, and the body on which it acts; on a body that it acts against (``by``;
      the ground where there is none) the opposite acts.
    `fx`, `fy`, `torque`: Force, and torque about the place at which it acts on that body; of what
      acts on all bodies about the mass centre.
    `force`: Of a spring or damper its tension, positive where it pulls its ends together; of all
      others the magnitude √(fx² + fy²).
    `length`: Distance of the ends of a spring or damper.
    `angle`: Angle of the body of a torsion spring or damper from the other one [rad].
    `rate`: Rate of that length or angle.
    `height`, `speed`, `sinking`, `spin`: Of a tyre: height of the wheel's centre above the road,
      its velocity along the road and across it, and the rate of the wheel.
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


# -- Protocol that `Solution` fulfils ----------------------------------------------------------


class Result(Protocol):
    """Histories by name over the instants of an analysis; see `mbody.Solution`."""

    @property
    def system(self) -> System:
        """The analysed system."""

    @property
    def mechanism(self) -> Mechanism:
        """The description of it."""

    @property
    def analysis(self) -> str:
        """Name of the analysis, such as ``"kinetostatics"``."""

    def contact(self, joint: str) -> Array:
        """Force with which the bodies of a contact press on each other."""

    @property
    def has_forces(self) -> bool:
        """Whether the analysis found reactions and efforts."""

    @property
    def t(self) -> Array:
        """Instants (instants,)."""

    @property
    def record(self) -> Record:
        """All numbers of all instants, by place."""

    @property
    def given(self) -> Array | None:
        """Value, rate and acceleration of the drivers (instants, drivers, 3), where given."""

    @property
    def regularization(self) -> float:
        """Regularisation of redundant constraints; 0 where there are none."""

    @property
    def drive_states(self) -> Array | None:
        """Value, rate and acceleration of the drivers (instants, drivers, 3)."""

    @property
    def reports(self) -> tuple[DesignReport | Result | Exception, ...]:
        """Of a batch what is said of each design, or its own result, or its error."""

    @property
    def failures(self) -> dict[int, str]:
        """The sentence of each design of a batch that failed."""

    @property
    def released(self) -> Mapping[str, float]:
        """Times at which drivers were released."""

    @property
    def energy(self) -> Energy | None:
        """Account of energy of a free motion."""

    @property
    def branch(self) -> BranchDistance | None:
        """How near the motion came to another branch."""

    @property
    def stepped(self) -> SteppedContacts | None:
        """Contacts of a motion by steps with impulses; None of other motions."""

    @property
    def shared(self) -> SharedResult | None:
        """Admissible forces that no equation decides."""

    @property
    def residuals(self) -> Array:
        """Residuals of every instant, (designs, instants, 5), see
        `mbody.kernels.finished_instants`.
        """

    @property
    def status(self) -> str:
        """How the analysis ended, or that it is doubtful."""

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the result."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Facts, and the messages of the doubts."""

    @property
    def losses(self) -> Mapping[str, Array]:
        """Power that friction takes in each frictional joint."""

    def design(self, index: int) -> Result:
        """One design of a batch."""

    def __len__(self) -> int: ...

    def __iter__(self) -> Iterator[str]: ...

    def __getitem__(self, body: str) -> BodyHistory: ...

    def point(self, place: Marker | str) -> PointHistory:
        """Motion of a place on a body."""

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force and torque of a joint on one of its bodies."""

    def effort(self, driver: str) -> Array:
        """Effort of a driver or a coupling."""

    def load(self, name: str, on: str | None = None) -> LoadHistory:
        """Force and torque of a load."""

    def driven(self, driver: str) -> tuple[Array, Array, Array]:
        """Value, rate and acceleration of what a driver drives."""

    def measure(self, of: str | Measure) -> Array:
        """History of a measured quantity."""


# -- Histories of inputs and of auxiliary states -----------------------------------------------


def reported_states(mechanism: Mechanism) -> list[Any]:
    """The auxiliary states that tables and summaries have: not those that only add up energies,
    which are in the account of energy.
    """
    return [one for one in mechanism.states if not getattr(one, "accounts", False)]


def motion_rows(solution: Result) -> Array:
    """q, v, a, auxiliary states and inputs: (instants, 9·bodies + …), or (designs, …) of
    a batch.
    """
    parts = [solution.record.table(rows) for rows in _kept_rows(solution)]
    return np.concatenate(parts, axis=-1) if len(parts) > 1 else parts[0]


def motion_at(solution: Result, instants: Array, design: int = 0) -> Array:
    """Stored motion of one design at some instants, by their numbers: (instants, 9·bodies + …)."""
    parts = [solution.record.at(rows, instants, design) for rows in _kept_rows(solution)]
    return np.concatenate(parts, axis=-1) if len(parts) > 1 else parts[0]


def _kept_rows(solution: Result) -> list[slice]:
    """Where q, v and a are kept, and auxiliary states and inputs, if there are any."""
    system = solution.system
    own = system.auxiliary_rows
    return [slice(0, 3 * system.coordinates), *([own] if own.start < own.stop else [])]


def auxiliary_history(solution: Result, name: str) -> Array:
    """An auxiliary state or an input, by its name: (instants,), or (designs, instants) of
    a batch.
    """
    system = solution.system
    machine = system.mechanism
    names = [one.name for one in (*machine.states, *machine.inputs)]
    return solution.record.take(system.auxiliary_rows.start + names.index(name))


# -- Positions of ends of elements, of link axes and of reactions ------------------------------
# Histories are arrays (instants,), of a batch (designs, instants); numbers of a batch are
# columns beside them.

#: A body, and a place on it from its mass centre, in the axes of the link.
Place = tuple[str, float, float]


class _DesignColumns:
    """Numbers by dotted name, a column a design in a batch."""

    def __init__(self, at: Numbers) -> None:
        self.at = at

    def __getitem__(self, name: str) -> Any:
        return column(self.at[name])


def column(value: Any) -> Any:
    """A number, or one a design as a column (designs, 1)."""
    return value[:, None] if np.ndim(value) else value


def place(solution: Result, element: Element, side: str) -> tuple[Array, Array]:
    """History of the world place of an end, ``"i"`` or ``"j"``."""
    body = solution[getattr(element, side).body]
    ax, ay = (column(part) for part in solution.system.numbers.arm(element, side))
    c, s = np.cos(body.angle), np.sin(body.angle)
    return body.x + c * ax - s * ay, body.y + s * ax + c * ay


def moved(run: Any, place: Place) -> Array:
    """World places (instants, 2) of a place on a body."""
    name, x, y = place
    body = run[name]
    c, s = np.cos(body.angle), np.sin(body.angle)
    return np.column_stack([body.x + c * x - s * y, body.y + s * x + c * y])


def velocity(solution: Result, element: Element, side: str) -> tuple[Array, Array]:
    """History of the velocity of an end, ``"i"`` or ``"j"``, in world axes."""
    body = solution[getattr(element, side).body]
    x, y = place(solution, element, side)
    return body.vx - body.omega * (y - body.y), body.vy + body.omega * (x - body.x)


def ends(solution: Result, element: Element) -> tuple[Any, Any, Any, Any]:
    """Numbers, the vector from the place on i to that on j, and the directions of both markers."""
    at = solution.system.numbers
    (ix, iy), (jx, jy) = place(solution, element, "i"), place(solution, element, "j")
    angles = (
        solution[getattr(element, side).body].angle + column(at.angle(element, side))
        for side in ("i", "j")
    )
    return _DesignColumns(at), (jx - ix, jy - iy), *angles


def reaction_point(solution: Result, element: Any) -> tuple[Array, Array]:
    """Point of action of the force of an element: its place on j, or the point of contact."""
    x, y = place(solution, element, "j")
    offset = _offset(solution, element) if element.role == "joint" else None
    return (x, y) if offset is None else (x + offset[0], y + offset[1])


def link_poses(solution: Result) -> dict[str, tuple[float, float, float]]:
    """(x, y, angle) of the link axes of every body at the last instant."""
    found = {}
    for body in solution.mechanism.bodies:
        origin = solution.point(Marker(body.name, (0.0, 0.0)))
        x, y, angle = (float(p[-1]) for p in (origin.x, origin.y, solution[body.name].angle))
        found[body.name] = (x, y, angle)
    return found


def reaction_torque(solution: Result, joint: Joint, fx: Array, fy: Array, torque: Array) -> Array:
    """Torque of a reaction about its reaction point, from that about the place on j."""
    offset = _offset(solution, joint)
    return torque if offset is None else torque - (offset[0] * fy - offset[1] * fx)


def _offset(solution: Result, joint: Joint) -> Any:
    """From a joint's place on j to its reaction point; None for that place itself."""
    if type(joint).reaction_point is Joint.reaction_point:
        return None
    return joint.reaction_point(*ends(solution, joint))


@dataclass(frozen=True, eq=False)
class EventRecord:
    """An event of a motion: its name, its time, and the states before and after.

    Attributes
    ----------
    name : str
        Of the event or stop; of what happens to a contact the kind.
    t : float
        When.
    state : Solution
        The one instant, of an impact just before it.
    after : Solution or None
        Of an impact, the same instant just after it.
    contact : str
        The contact or frictional joint that it happens to: `name` is "impact", "open", "stick",
        "slip" or "rest" then, or what Painlevé's paradox is called: "inconsistent", "indeterminate"
        and "paradox".
    impulses : dict
        Of an impact what every contact that took part in it gave, `impulse` by name.
    design : int or None
        Of a batch which design it happened to.
    shared : tuple of str
        Contacts whose impulses are one choice of many, with the same velocities after it.

    Examples
    --------
    >>> import mbody
    >>> ball = mbody.Mechanism("ball")
    >>> ball.add(mbody.Body("ball", mass=1.0, inertia=0.1, guess=(0.0, 4.905, 0.0)))
    >>> ball.add(mbody.Gravity("gravity", y=-9.81))
    >>> (record,) = mbody.simulate(ball, 2.0, events=[mbody.Event("ball.y", name="down")]).events
    >>> record.name, round(record.t, 9)
    ('down', 1.0)
    """

    name: str
    t: float
    state: Result = field(repr=False)
    after: Result | None = field(default=None, repr=False)
    contact: str = ""
    impulses: dict[str, tuple[float, float]] = field(default_factory=dict, repr=False)
    design: int | None = None
    shared: tuple[str, ...] = field(default=(), repr=False)

    def impulse(self, contact: str) -> tuple[float, float]:
        """Normal and tangential impulse of a contact in this impact, summed over its points; zeros
        where it took no part. The normal one presses, the tangential one acts on body j in the
        direction of "slip+".

        Raises
        ------
        ModelError
            For a name that is no contact, stop or rope.
        """
        if contact not in (names := [one.name for one in self.state.system.mechanism.contacts]):
            raise unknown_name("contact", contact, names)
        return self.impulses.get(contact, (0.0, 0.0))


# -- The certificate of a result: its status, doubts and notes, see `mbody.solution.checks` ----
# Residuals cost a third of the kinetostatics of a revolution. They are computed when `status`,
# `doubts` or `notes` is first read, so a user who reads numbers alone does not pay for them.

T = TypeVar("T")
R = TypeVar("R", bound=Result)


@dataclass(frozen=True)
class Certificate:
    """Status, doubts and notes of a result.

    `status`: "completed", "ended: …", "stopped: …", or "doubtful: …" where there is a doubt.
    `notes`: Facts, and the messages of the doubts.
    """

    status: str = "completed"
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()


class DesignReport(NamedTuple):
    """What an analysis of many designs says of one of them: fields of its `Solution`."""

    status: str = "completed"
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()
    regularization: float = 0.0
    dependencies: dict[str, list[bool]] | None = None
    branch: Any = None  # a BranchDistance, or a `BranchPlace`, where one is found when it is asked
    modes: Mapping[str, Any] = MappingProxyType({})
    shared: SharedResult | None = None


def failed_designs(reports: Sequence[Any]) -> list[int]:
    """Numbers of the designs of a batch that failed: of which there are errors for reports."""
    return [n for n, one in enumerate(reports) if isinstance(one, Exception)]


class Certified(Generic[T]):
    """A field of a `Solution` that is read from its certificate; what is assigned to it is the
    report of the analysis.
    """

    def __init__(self, default: T) -> None:
        self.default = default

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, solution: Any, owner: type) -> T:
        if solution is None:  # the default of the field
            return self.default
        fields = solution.__dict__
        if "certificate" not in fields:
            fields["certificate"] = present("certificate", solution)
        value: T = getattr(fields["certificate"], self.name)
        return value

    def __set__(self, solution: Any, value: T) -> None:
        solution.__dict__.pop("certificate", None)
        if self.name == "status" and str(value).startswith("doubtful:"):
            return  # follows from the doubts; how it ended is what it was
        solution.__dict__[f"reported_{self.name}"] = value


def reported_certificate(solution: Result) -> Certificate:
    """Status, doubts and notes that the analysis itself reported, without computing residuals."""
    fields = solution.__dict__
    status = fields.get("reported_status", "completed")
    return Certificate(status, fields["reported_doubts"], fields["reported_notes"])


def with_fields(solution: R, **parts: Any) -> R:
    """The solution with other fields, as `dataclasses.replace`, without computing residuals."""
    said = reported_certificate(solution)
    own = {"status": said.status, "doubts": said.doubts, "notes": said.notes}
    replaced: R = replace(solution, **(own | parts))  # type: ignore[type-var]  # a dataclass
    return replaced


# -- Refusals that many readers of a result share ----------------------------------------------


def check_forces(solution: Result, what: str) -> None:
    """Refuse a result without forces, or a batch; `what` (plural) is wanted of one design."""
    if not solution.has_forces:
        raise ModelError(f"{solution.analysis} finds no forces: use kinetostatics or statics")
    one_design(solution, f"{what} are of one design")


def one_design(solution: Result, what: str, element: str | None = None) -> None:
    """Refuse a batch of designs, in a sentence that begins with `what` there is of one design."""
    if solution.record.batch:
        raise ModelError(
            f"{what}, this is a batch of {solution.record.count} designs: take one of them, "
            "run.design(n)",
            element,
        )


def whole_instant(solution: Result, instant: Any) -> int:
    """The place of an instant in a result; negative numbers count from its end."""
    count = len(solution)
    whole = hasattr(instant, "__index__") and not isinstance(instant, bool)
    if not whole or not -count <= instant < count:
        raise ModelError(f"there is no instant {instant!r}: give a whole number, 0 to {count - 1}")
    return operator.index(instant) % count
