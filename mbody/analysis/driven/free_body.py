"""Free bodies: every force on one link, and what kind of member it is by them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral
from mbody.analysis.driven.driven import kinetostatics
from mbody.core.presentation import present
from mbody.core.tolerances import (
    FORCE_NONE,
    LAW_VALUES_SAME,
    LINES_PARALLEL,
    TINY,
    WORK_AGREES,
    WORK_NONE,
)
from mbody.errors import ModelError
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.model.contact import Contact, Rope
from mbody.model.driver import Constraint
from mbody.model.element import listed, unknown_name
from mbody.model.stop import Stop
from mbody.solution.checks import each_load_of, loaded
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.contact_points import contact_points_at
from mbody.solution.doubts import Several, inherited
from mbody.solution.friction_results import Efficiency
from mbody.solution.histories import check_forces, link_poses, one_design, whole_instant
from mbody.solution.known_forces import inherits
from mbody.solution.solution import Solution, as_solution
from mbody.system.formula_steps import recorded_driver, recorded_stop
from mbody.system.rank import jacobian
from mbody.system.system import System

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.quantities.output_units import OutputUnits


# -- Efficiency of a motion: work given, useful and lost ---------------------------------------

Array = np.ndarray

#: Nodes of Gauss's rule in each part of a motion, and parts at first.
NODES, PARTS = 8, 24
#: How often parts of the motion are halved, at most, until the work of a part and of its halves
#: agree.
HALVINGS = 36


def efficiency(found: Solution, output: str) -> Efficiency:
    """Work put in by the drivers, delivered at the output and lost to friction and damping; the
    body of `Solution.efficiency`.
    """
    machine = found.mechanism
    drivers = [driver.name for driver in machine.drivers]
    loads = [load.name for load in machine.loads]
    if not found.has_forces:
        raise ModelError(f"{found.analysis} finds no forces, and no work: use kinetostatics")
    one_design(found, "an efficiency is of one design")
    if output not in (*drivers, *loads):
        raise unknown_name(
            "load or driver",
            output,
            [*loads, *drivers],
            more=": name what the mechanism works against",
        )
    if len(found) < 2:
        raise ModelError(
            "an efficiency is of a motion, this is one instant: analyse a turn, or several times"
        )
    inputs = [name for name in drivers if name != output]
    given, useful, lost = _works(found, output, inputs)
    if not given > WORK_NONE * max(abs(given), abs(useful), lost):
        raise ModelError(
            f"the drivers of '{machine.name}' give no work over this motion: what gives it must be "
            "a driver, or take a part of the motion in which one drives"
        )
    said = inherited(found, of=[lambda one: _powers(one, output, inputs)])
    return Efficiency(useful / given, given, useful, lost, **said)


def _power(run: Solution, name: str) -> Array:
    """Power that a load or a driver gives to the mechanism."""
    element: Any = run.mechanism[name]
    if element.role == "driver":
        own: Array = run.measure(f"{name}.power")
        return own
    total = np.zeros(len(run))
    bodies = [body.name for body in run.mechanism.bodies]
    n = [load.name for load in run.mechanism.loads].index(name)
    for k in range(len(run)):
        for body, (fx, fy, torque) in zip(bodies, each_load_of(run, k)[n], strict=True):
            now = run[body]
            total[k] += fx * now.vx[k] + fy * now.vy[k] + torque * now.omega[k]
    return total


def _works(found: Solution, output: str, inputs: list[str]) -> tuple[float, float, float]:
    """Work given by the drivers, done on the output, lost in joints."""
    energy = found.energy
    if energy is not None and output in energy.by:  # where loads are very many only all are
        given = sum(float(energy.by[name][-1] - energy.by[name][0]) for name in inputs)
        useful = float(energy.by[output][0] - energy.by[output][-1])
        return given, useful, float(sum(part[-1] - part[0] for part in energy.lost.values()))
    if found.analysis == "kinetostatics" and _by_laws(found):
        given, useful, lost = _integrated(found, lambda run: _powers(run, output, inputs))
    else:
        powers, h = _powers(found, output, inputs), np.diff(found.t)
        given, useful, lost = (0.5 * (powers[1:] + powers[:-1]) * h[:, None]).sum(axis=0)
    return float(given), float(useful), float(lost)


def _powers(run: Solution, output: str, inputs: list[str]) -> Array:
    """Powers given, useful and lost: (instants, 3)."""
    found = np.zeros((len(run), 3))
    for name in inputs:
        found[:, 0] += _power(run, name)
    found[:, 1] = -_power(run, output)
    for power in run.losses.values():
        found[:, 2] += power
    return found


def _integrated(found: Solution, powers: Callable[[Solution], Array]) -> Array:
    """Integrals of powers over the motion by Gauss's rule.

    Powers bend and jump where a joint slides the other way, or a slider the end that
    presses: parts whose halves have another work are halved until they are so narrow that nothing
    of it is left.
    """
    poses = dict(link_poses(found.take([0])))
    posts = np.linspace(found.t[0], found.t[-1], PARTS + 1)
    x, weights = np.polynomial.legendre.leggauss(NODES)

    def works(low: Array, high: Array) -> tuple[Array, Array]:
        half = 0.5 * (high - low)[:, None]
        nodes = 0.5 * (high + low)[:, None] + half * x
        # posts keep the distance from node to node short
        t, places = np.unique(np.append(posts, nodes), return_inverse=True)
        run = kinetostatics(found.system, t, guess=poses)
        values = powers(run)[places[len(posts) :]].reshape(*nodes.shape, -1)
        both = (half[:, :, None] * one for one in (values, np.abs(values)))
        own, size = (np.einsum("n,pnc->pc", weights, one) for one in both)
        return own, size

    low, high = posts[:-1], posts[1:]
    coarse, size = works(low, high)
    total, accepted = np.zeros(coarse.shape[1]), WORK_AGREES * float(size.sum(axis=0).max())
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = np.append(low, middle), np.append(middle, high)
        halves = works(low, high)[0]
        both = halves.reshape(2, *coarse.shape).sum(axis=0)
        uneven = np.abs(both - coarse).max(axis=1) > accepted
        total += both[~uneven].sum(axis=0)
        kept = np.tile(uneven, 2)
        low, high, coarse = low[kept], high[kept], halves[kept]
        if not len(low):
            break
    return np.asarray(total + coarse.sum(axis=0))


def _by_laws(found: Solution) -> bool:
    """Whether the laws of the drivers, at the times of the instants, led the motion."""
    if found.given is None:
        return True
    for n, driver in enumerate(found.system.drivers):
        if driver not in found.system.independent_drivers:
            continue
        law = found.system.law_of(driver)
        own = np.array([law.derivatives(float(t)) for t in found.t])
        size = np.abs(own).max(axis=0)
        if (np.abs(found.given[:, n] - own) > LAW_VALUES_SAME * size + LAW_VALUES_SAME).any():
            return False
    return True


# -- Forces of constraints without a point: couplings, some drivers, stops, contacts of joints --


#: What is said of a link by the forces on it.
MEMBER_WORDS = {
    "unloaded": "carries nothing",
    "pulled": "is a two-force member, pulled with {size}: {forces} act along one line",
    "pressed": "is a two-force member, pressed with {size}: {forces} act along one line",
    "one place": "is a two-force member: {forces} act at one place",
    "meet": "is a three-force member: the lines of {forces} meet in M = ({x}, {y})",
    "parallel": "is a three-force member: the lines of {forces} are parallel",
    "couple": "carries two forces and a couple: {forces}",
    "general": "carries {forces}",
}


def acting_on_several(solution: Solution) -> list[tuple[Constraint, tuple[str, ...]]]:
    """The couplings, the drivers that follow positions and the stops that act, with all bodies that
    each acts on.
    """
    system = solution.system
    machine, at = system.mechanism, system.numbers
    found: list[tuple[Constraint, tuple[str, ...]]] = []
    found += [(coupling, coupling.bodies) for coupling in machine.couplings]
    for driver in system.drivers:
        if driver not in system.independent_drivers:
            measured = recorded_driver(driver, at.law(driver, "law"), machine, at).measured_bodies
            # positions are measured from the ground
            found.append((driver, (*dict.fromkeys(("ground", *driver.bodies, *measured)),)))
    for stop in machine.contacts:
        if isinstance(stop, Stop) and (solution.modes or stop.closed):
            found.append((stop, ("ground", *recorded_stop(stop, machine, at).measured_bodies)))
    return found


def coupled(solution: Solution, name: str, instant: int) -> Array:
    """Wrenches of a coupling, a position-following driver or a stop on the bodies, (bodies, 3):
    forces at the mass centres, and torques.
    """
    system = solution.system
    e = system.primitives_of[name][0]
    row = _row(system, loaded(solution, instant), e)
    # what rows do to coordinates is −Φ_qᵀ λ
    return np.asarray(-row.reshape(-1, 3) * solution.primitive_history(e, 0)[instant])


def _row(system: System, work: Work, e: int) -> Array:
    """Φ_q of the row of a primitive (coordinates,)."""
    always = np.flatnonzero(system.row_table[0] == e)
    if len(always):
        return np.asarray(jacobian(system, work)[1][always[0]])
    uni, place = Unilateral(system), int(np.flatnonzero(system.layout.active_set == e)[0])
    return np.asarray(uni.read(work).block[place] / uni.units[place])


def rows_on(solution: Solution, body: str) -> Iterator[tuple[str, Array, Array, Array]]:
    """Names, forces and torque about the mass centre of a body (instants,) of the contacts on it
    that joints bring, and of freewheels.
    """
    for contact in acting_contacts(solution):
        if body in contact.bodies and not isinstance(contact, Contact | Rope):
            own = solution.reaction(contact.name, on=body)
            yield contact.name, own.fx, own.fy, own.torque


@dataclass(frozen=True)
class Wrench:
    """A force with its torque, on one body.

    `cause`: Name of the joint, contact, coupling, driver or load; "inertia" of d'Alembert's.
    `kind`: "joint", "contact", "coupling", "driver", "load" or "inertia".
    `x`, `y`: The place at which it is given, world axes [length].
    `fx`, `fy`: The force, world axes [force].
    `torque`: About that place [force·length].
    """

    cause: str
    kind: str
    x: float
    y: float
    fx: float
    fy: float
    torque: float

    @property
    def force(self) -> float:
        """√(fx² + fy²) [force]."""
        return math.hypot(self.fx, self.fy)

    @property
    def line(self) -> tuple[float, float]:
        """A point of the line on which the force alone would have that torque [length]."""
        square = self.fx * self.fx + self.fy * self.fy
        return self.x + self.torque * self.fy / square, self.y - self.torque * self.fx / square


@dataclass(frozen=True)
class Member:
    """A link, named by the forces that act on it.

    `kind`: "unloaded", "two-force", "three-force", "two forces and a couple", or "general".
    `forces`: Those that are not zero.
    `meeting`: Of a three-force member: the point M in which the three lines meet [length]; None
      where they are parallel, and of other members.
    `tension`: Of a two-force member: the force that pulls its two places apart [force]; negative
      where it is pressed.
    `words`: The same as a sentence.
    """

    body: str
    kind: str
    forces: tuple[Wrench, ...]
    meeting: tuple[float, float] | None
    tension: float | None
    words: str


class FreeBody(Several[Wrench]):
    """The forces on one body at an instant: a tuple of `Wrench` that can be drawn.

    `solution`: Of which result.
    `instant`: Which of its instants, counted from 0.
    `status`, `doubts`, `notes`: As of the result.
    """

    solution: Solution
    body: str
    instant: int

    def draw(self) -> Figure:
        """The free-body diagram of the body alone, to scale, with its force polygon beside it.

        Raises
        ------
        ModelError
            Where matplotlib is not installed.
        """
        return present("drawing", self)  # a door for every form


@inherits
def free_body(solution: Solution, body: str, instant: int = 0) -> FreeBody:
    """Every force on one body at an instant: its free-body diagram; they are in equilibrium.

    Parameters
    ----------
    solution : Solution
        Of kinetostatics or statics, of one design.
    body : str
        A moving body.
    instant : int
        Which of its instants; negative ones count from the end.

    Returns
    -------
    FreeBody
        A tuple of `Wrench`, with `status`, `doubts` and `notes` of the solution, and `draw()`. Of
        the joints at their places, of contacts where they touch, of loads and drivers at the mass
        centre, then d'Alembert's inertia force and torque; those that are not there are zero.

    Raises
    ------
    ModelError
        For an analysis without forces, a batch, or a body or an instant that there is not.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1), speed=2.0))
    >>> forces = free_body(run, "coupler")
    >>> [force.cause for force in forces]
    ['A', 'B', 'inertia']
    >>> abs(sum(force.fx for force in forces)) < 1e-12
    True
    """
    k = _checked(solution, body, instant)
    found = FreeBody.of(solution, _forces(solution, body, k, each_load_of(solution, k)))
    found.solution, found.body, found.instant = solution, body, k
    return found


@inherits
def member_forces(solution: Solution, instant: int = 0) -> Several[Member]:
    """Every moving link with the kind of member that it is, such as a two-force member.

    Two forces alone on a body lie on one line; three meet in one point, or are parallel.

    Parameters
    ----------
    solution : Solution
        Of kinetostatics or statics, of one design.
    instant : int
        Which of its instants; negative ones count from the end.

    Returns
    -------
    tuple of Member, with `status`, `doubts` and `notes` of the solution
        One a moving body, in the order of the description.

    Raises
    ------
    ModelError
        For an analysis without forces, a batch, or an instant that there is not.

    Notes
    -----
    R. L. Norton, Design of Machinery; F. P. Beer and E. R. Johnston, Statics, chapter 4.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> machine.add(mbody.Torque("load", "rocker", value=10.0))
    >>> [member.kind for member in member_forces(mbody.statics(machine))]
    ['two forces and a couple', 'two-force', 'two forces and a couple']
    """
    k = _checked(solution, None, instant)
    loads = each_load_of(solution, k)
    found = {
        body.name: list(_forces(solution, body.name, k, loads))
        for body in solution.mechanism.bodies
    }
    greatest = max((force.force for row in found.values() for force in row), default=0.0)
    length = solution.system.length
    units, greatest = solution.mechanism.shown, max(greatest, TINY)
    members = (_member(name, row, greatest, length, units) for name, row in found.items())
    return Several.of(solution, members)


def _checked(solution: Solution, body: str | None, instant: Any) -> int:
    """The instant's place in the solution; refuses what has no free bodies."""
    solution = as_solution(solution)
    check_forces(solution, "free bodies")
    known = [one.name for one in solution.mechanism.bodies]
    if body is not None and body not in known:
        raise unknown_name("moving body", body, known)
    return whole_instant(solution, instant)


def _forces(solution: Solution, body: str, instant: int, loads: np.ndarray) -> Any:
    """The wrenches on a body, zero ones too."""
    machine, at = solution.mechanism, solution[body]
    x, y = float(at.x[instant]), float(at.y[instant])
    for joint in machine.joints:
        if body in (joint.i.body, joint.j.body):
            reaction = solution.reaction(joint.name, on=body)
            place = solution.reaction_point(joint.name)
            parts = (*place, reaction.fx, reaction.fy, reaction.torque)
            yield Wrench(joint.name, "joint", *(float(part[instant]) for part in parts))
    yield from _touched(solution, body, instant)
    for name, *own in rows_on(solution, body):
        yield Wrench(name, "contact", x, y, *(float(part[instant]) for part in own))
    for element, bodies in acting_on_several(solution):
        if body in bodies:
            parts = coupled(solution, element.name, instant)[solution.system.bodies[body]].tolist()
            yield Wrench(element.name, element.role, x, y, *parts)
    for driver in solution.system.independent_drivers:
        if body in driver.bodies:
            yield _driven(solution, driver.name, body, instant)
    for n, load in enumerate(machine.loads):
        fx, fy, torque = loads[n, solution.system.bodies[body]].tolist()
        if fx or fy or torque:
            yield Wrench(load.name, "load", x, y, fx, fy, torque)
    fx, fy, torque = (float(part[instant]) for part in solution.inertia(body))
    if solution.analysis == "statics":
        fx = fy = torque = 0.0
    yield Wrench("inertia", "inertia", x, y, fx, fy, torque)


def _touched(solution: Solution, body: str, instant: int) -> Iterator[Wrench]:
    """The forces of contacts and ropes on a body, each where it acts."""
    for contact in (*solution.mechanism.contacts, *solution.mechanism.groups):
        for one in contact_points_at(solution, instant, contact.name):
            if body in (one.i, one.j) and one.mode[0] != "open":
                (x, y), (fx, fy) = one.place[0].tolist(), one.force[0].tolist()
                sign = 1.0 if body == one.j else -1.0
                yield Wrench(contact.name, "contact", x, y, sign * fx, sign * fy, 0.0)


def driven(solution: Solution, driver: str) -> np.ndarray:
    """Force and torque of a driver on its body j, at its place there (instants, 3)."""
    first = (
        3 * solution.system.coordinates + PER_PRIMITIVE * solution.system.primitives_of[driver][0]
    )
    return np.column_stack([solution.record.take(first + n) for n in (2, 3, 4)])


def _driven(solution: Solution, driver: str, body: str, instant: int) -> Wrench:
    """Wrench of a driver on one of its two bodies, at its point on body j."""
    element: Any = solution.mechanism[driver]
    fx, fy, torque = driven(solution, driver)[instant].tolist()
    sign = 1.0 if element.bodies[1] == body else -1.0
    if "j" in element.places():
        place = solution.reaction_point(driver)
    else:
        place = solution[element.bodies[1]].x, solution[element.bodies[1]].y
    x, y = (float(part[instant]) for part in place)
    return Wrench(driver, "driver", x, y, sign * fx, sign * fy, sign * torque)


def _member(
    body: str, row: list[Wrench], greatest: float, length: float, units: OutputUnits
) -> Member:
    """The kind of member that a body is by the forces on it."""
    forces = [one for one in row if one.force > FORCE_NONE * greatest]
    couples = [
        one
        for one in row
        if one.force <= FORCE_NONE * greatest and abs(one.torque) > FORCE_NONE * greatest * length
    ]
    listing = listed(one.cause for one in (*forces, *couples))
    kind, said, meeting, tension = "general", "general", None, None
    numbers: dict[str, str] = {}
    if not forces and not couples:
        kind = said = "unloaded"
    elif len(forces) == 2 and not couples:
        kind = "two-force"
        tension = _tension(*forces)
        said = "pulled" if tension > 0.0 else "pressed" if tension else "one place"
        size = units.converted(forces[0].force, "force")
        numbers["size"] = f"{size:.6g} {units.of('force')}"
    elif len(forces) == 3 and not couples:
        kind, meeting = "three-force", _meeting(forces, length)
        said = "parallel"
        if meeting is not None:
            said = "meet"
            at = (f"{units.converted(one, 'length'):.6g} {units.of('length')}" for one in meeting)
            numbers.update(zip("xy", at, strict=True))
    elif len(forces) == 2:
        kind, said = "two forces and a couple", "couple"
    words = f"'{body}' {MEMBER_WORDS[said].format(forces=listing, **numbers)}"
    return Member(body, kind, tuple((*forces, *couples)), meeting, tension, words)


def _tension(a: Wrench, b: Wrench) -> float:
    """The force that pulls the places of two opposite forces apart."""
    (ax, ay), (bx, by) = a.line, b.line
    if a.kind == b.kind == "joint":
        (ax, ay), (bx, by) = (a.x, a.y), (b.x, b.y)
    along = b.fx * (bx - ax) + b.fy * (by - ay)
    distance = math.hypot(bx - ax, by - ay)
    return along / distance if distance > 0.0 else 0.0


def _meeting(forces: list[Wrench], length: float) -> tuple[float, float] | None:
    """Point at which the lines of three forces in equilibrium meet: the steepest two."""
    pairs = [(forces[m], forces[n]) for m in range(3) for n in range(m)]
    a, b = max(pairs, key=lambda pair: abs(_sine(*pair)))
    if abs(_sine(a, b)) < LINES_PARALLEL:
        return None
    (ax, ay), (bx, by) = a.line, b.line
    s = ((bx - ax) * b.fy - (by - ay) * b.fx) / (a.fx * b.fy - a.fy * b.fx)
    return ax + s * a.fx, ay + s * a.fy


def _sine(a: Wrench, b: Wrench) -> float:
    """Sine of the angle between two forces."""
    return (a.fx * b.fy - a.fy * b.fx) / (a.force * b.force)
