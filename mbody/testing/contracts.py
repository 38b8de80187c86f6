"""The contracts of joints, drivers and loads, and the bench in other units."""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
import pickle
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, NamedTuple, NoReturn

import numpy as np

from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core.tolerances import (
    CONTRACT_TOLERANCE,
    SINGULAR_VALUE_ZERO,
    TINY,
    USER_POWER_NONE,
)
from mbody.errors import SolveError
from mbody.kernels.finished_instants import (
    NO_FRICTION,
    RESIDUALS,
    Finished,
    breakdown,
    residuals_of,
)
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.kernels.loop_closure import laws_of_time, violation
from mbody.laws import Cam, Function, Law, Table
from mbody.model.body import Body, SecondMoments
from mbody.model.driver import Driver
from mbody.model.element import Element, Marker, Point, Polar
from mbody.model.joints import Joint
from mbody.model.loads import Force, Load
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named
from mbody.quantities.units import DIMENSIONS, Dimension
from mbody.system.assembler import assemble
from mbody.system.rank import close_rows, dense
from mbody.system.system import System

# -- The bench: an element between free massive bodies, and what the kernels compute for it ----

# -- Reports of checks -------------------------------------------------------------------------

Array = np.ndarray

#: Steps of the differences, as parts of the bench's size and duration. The best of them counts: a
#: corner in a law's derivatives spoils the wide ones where it lies within them.
STEPS = (1e-3, 1e-5, 1e-7)


@dataclass(frozen=True)
class Check:
    """One line of a report.

    Attributes
    ----------
    name : str
        What was checked.
    error : float
        Greatest relative error of all states; NaN where it could not be checked.
    note : str
        Why it was not checked, or what was found.
    required : bool
        Whether a greater error than the tolerance would have failed the element.

    Examples
    --------
    >>> from mbody import Revolute
    >>> from mbody.testing import check_joint
    >>> check = check_joint(Revolute("A", "crank.A", "coupler.A"))["Φ_q"]
    >>> check.error < 1e-8, check.required
    (True, True)
    """

    name: str
    error: float
    note: str = ""
    required: bool = True

    def __str__(self) -> str:
        text = "skipped" if math.isnan(self.error) else f"{self.error:.1e}"
        return f"{self.name:<24}{text:<9}{self.note}".rstrip()


@dataclass(frozen=True)
class Report:
    """All checks that an element has passed.

    Attributes
    ----------
    element : str
        Type and name.
    states : int
        How many random states were tried.
    tolerance : float
        Greatest relative error that was allowed.
    checks : tuple of Check
        In the order of checking; ``report["Φ_q"]`` is one of them.

    Examples
    --------
    >>> from mbody import Revolute
    >>> from mbody.testing import check_joint
    >>> report = check_joint(Revolute("A", "crank.A", "coupler.A"))
    >>> report.worst < 1e-8, "Φ_q" in [check.name for check in report.checks]
    (True, True)
    """

    element: str
    states: int
    tolerance: float
    checks: tuple[Check, ...]

    def __getitem__(self, name: str) -> Check:
        return {check.name: check for check in self.checks}[name]

    @property
    def worst(self) -> float:
        """Greatest error of what is required."""
        errors = [check.error for check in self.checks if check.required]
        return float(np.nanmax([0.0, *errors]))

    def __str__(self) -> str:
        head = f"{self.element}: {self.states} states, tolerance {self.tolerance:.0e}"
        return "\n  ".join([head, *map(str, self.checks)])


class Ledger:
    """Collects errors; the first that is too great becomes an AssertionError.

    As a context it turns what the element itself raises into one, too.

    `where`: The state that is looked at, for the sentences.
    """

    def __init__(self, element: Element, states: int, tolerance: float) -> None:
        self.element, self.states, self.tolerance = element, states, tolerance
        self.name = f"{type(element).__name__} '{element.name}'"
        self.where = ""
        self._errors: dict[str, float] = {}
        self._notes: dict[str, str] = {}
        self._recorded: dict[str, tuple[str, str]] = {}

    def __enter__(self) -> Ledger:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        if isinstance(error, SolveError):
            raise AssertionError(f"{self.name}: {error}{self.where}") from error

    def fail(self, sentence: str) -> NoReturn:
        """Raise the sentence, with the element's name and the state."""
        raise AssertionError(f"{self.name}: {sentence}{self.where}")

    def require(self, name: str, errors: Array | float, sentence: str, note: str = "") -> None:
        """Record relative errors, a number or (rows,); where one is too great, the sentence is
        raised, with the number of its row for ``{row}``.
        """
        errors = np.atleast_1d(np.asarray(errors, dtype=float))
        k = int(np.argmax(np.where(np.isnan(errors), np.inf, errors)))
        error = float(errors[k])
        if not error <= self.tolerance:
            words = sentence.replace("{row}", str(k))
            self.fail(f"{name}: {words} (relative error {error:.2g})")
        self._errors[name] = max(self._errors.get(name, 0.0), error)
        self._notes.setdefault(name, note)

    def record(self, name: str, error: float, good: str, bad: str) -> None:
        """Record what is noted but not required."""
        self._errors[name] = max(self._errors.get(name, 0.0), error)
        self._notes.setdefault(name, "")
        self._recorded[name] = good, bad

    def skip(self, name: str, reason: str) -> None:
        """Record why something could not be checked."""
        self._notes.setdefault(name, reason)

    def finite(self, values: Array, name: str) -> None:
        """Every number must be finite."""
        bad = "" if np.isfinite(values).all() else f"{name} has a number that is not finite"
        if bad:
            self.fail(f"finite: {bad}; does a law reach over `times` and `length`?")
        self.require("finite", 0.0, "")

    def differ(
        self,
        name: str,
        what: str,
        found: Array,
        function: Callable[[float], Array],
        size: Array,
        unit: float,
    ) -> None:
        """Compare `found` (rows,) with the derivative of the function at 0; both are `unit` times
        what the sentence shows, and errors are parts of `size` (rows,).
        """
        least = np.full(len(found), np.inf)
        best = np.zeros(len(found))
        for step in STEPS:
            expected = derivative(function, step)
            error = np.abs(found - expected) / np.maximum(size, TINY)
            best = np.where(error < least, expected, best)
            least = np.fmin(least, error)
            if least.max() <= 1e-2 * self.tolerance:
                break
        k = int(np.argmax(least))
        sizes = f"{found[k] / unit:.6g}, but differences of Φ give {what} = {best[k] / unit:.6g}"
        self.require(name, least, f"row {{row}} has {sizes}")

    def report(self) -> Report:
        """The report of an element that passed."""
        checks = []
        for name, note in self._notes.items():
            error = self._errors.get(name, math.nan)
            if name in self._recorded:
                note = self._recorded[name][error > self.tolerance]
            checks.append(Check(name, error, note, name not in self._recorded))
        return Report(self.name, self.states, self.tolerance, tuple(checks))


def derivative(function: Callable[[float], Array], step: float) -> Array:
    """df/ds at s = 0 by central differences of sixth order."""
    ahead = [function(n * step) for n in (1, 2, 3)]
    back = [function(-n * step) for n in (1, 2, 3)]
    d1, d2, d3 = (f - b for f, b in zip(ahead, back, strict=True))
    return np.asarray((45.0 * d1 - 9.0 * d2 + d3) / (60.0 * step))


#: New axes: (angle, x, y); a point p of the old ones is R(angle) p + (x, y) in them.
Frame = tuple[float, float, float]
Frames = Mapping[str, Frame]
Shifts = Mapping[str, Array]

STILL: Frame = (0.0, 0.0, 0.0)


class BenchState(NamedTuple):
    """An instant: its time, coordinates of the mass centres (3·bodies,), and their rates."""

    t: float
    q: Array
    v: Array


class ElementRows(NamedTuple):
    """The rows of the element: Φ (rows,), Φ_q (rows, 3·bodies), ν, γ; and the greatest number
    where it has no row.
    """

    phi: Array
    G: Array
    nu: Array
    gamma: Array
    padding: float


def make_bench(element: Element, rng: np.random.Generator, length: float, *, pushed: bool) -> Bench:
    """Bodies with the named points that the element refers to, and mass centres off their origins;
    `pushed` by forces that turn with them.
    """
    names = [name for name in mentioned(element) if name != "ground"] or ["one", "two"]
    points: dict[str, dict[str, Any]] = {name: {} for name in ("ground", *names)}
    for marker in element.places().values():
        if isinstance(marker.point, str):
            points[marker.body][marker.point] = _pair(rng, length)
    bodies, pushes = [], []
    for name in names:
        mass, inertia, angle = rng.uniform(1.0, 3.0, size=3)
        cg, end = _pair(rng, length), _pair(rng, length)
        moment = inertia * length**2
        spread = SecondMoments(0.3 * moment, 0.7 * moment, 0.2 * moment)
        own = {"inertia": moment, "cg": cg, "points": points[name], "spread": spread}
        bodies.append(Body(name, mass, **own))
        pushes.append(Force(f"push on {name}", Marker(name, end), 1.0, angle, follows=True))
    return Bench(element, tuple(bodies), points["ground"], tuple(pushes if pushed else ()), length)


@dataclass(frozen=True, eq=False)
class Bench:
    """The element between free bodies."""

    element: Element
    bodies: tuple[Body, ...]
    ground: dict[str, Any]
    pushes: tuple[Force, ...]
    length: float

    @functools.cached_property
    def system(self) -> System:
        """The assembled bench."""
        machine = Mechanism(f"bench of {self.element.name}", ground=self.ground)
        machine.add(*self.bodies, self.element, *self.pushes)
        return assemble(machine)

    @functools.cached_property
    def work(self) -> Any:
        """Workspace with inverse masses, so that reactions are those of free bodies."""
        return self.system.work(masses=True)

    @functools.cached_property
    def unit(self) -> Array:
        """Size of each coordinate: a length, a length, a radian."""
        return np.tile([self.length, self.length, 1.0], len(self.bodies))

    def state(self, rng: np.random.Generator, times: tuple[float, float]) -> BenchState:
        """Random positions and velocities, at a time well inside the interval."""
        span = times[1] - times[0]
        t = times[0] + span * rng.uniform(0.01, 0.99)
        q, v = rng.normal(size=(2, len(self.unit))) * self.unit
        q[2::3] = rng.uniform(-math.pi, math.pi, size=len(self.bodies))
        return BenchState(float(t), q, v / span)

    def words(self, number: int, seed: int, state: BenchState) -> str:
        """The state for a sentence."""
        q, v = state.q.reshape(-1, 3), state.v.reshape(-1, 3)
        words = [f"; at state {number} of seed {seed}: t = {state.t:.4g}"]
        for body, place, rate in zip(self.bodies, q, v, strict=True):
            here, going = (", ".join(f"{x:.4g}" for x in part) for part in (place, rate))
            words.append(f"mass centre of '{body.name}' at (x, y, θ) = ({here}) moving ({going})")
        return ", ".join(words)

    # -- results of the kernels ----------------------------------------------------------------

    def _set(self, state: BenchState) -> tuple[Any, Any]:
        L, W, size = self.system.runtime(), self.work, len(state.q)
        W.time[:] = state.t
        W.q[:size, 0], W.v[:size, 0] = state.q, state.v
        return L, W

    def rows(self, state: BenchState) -> ElementRows:
        """The element's rows."""
        L, W = self._set(state)
        laws_of_time(L, W)
        violation(L, W)
        raise_user_error(self.system)
        lines: list[Array] = []
        padding = 0.0
        for e, kinds in enumerate(self.system.row_kinds):
            if e in self.system.active_set_rows:
                continue  # friction is no constraint
            for row in range(2):
                k, o = 2 * L.primitive_node[e] + row, 12 * L.primitive_node[e] + 3 * row
                line = np.zeros(3 * L.bodies + 6)
                line[-3:] = W.phi[k, 0], W.nu[k, 0], W.gamma[k, 0]
                for b, first in ((L.primitive_i[e], o), (L.primitive_j[e], o + 6)):
                    line[3 * b : 3 * b + 3] += W.block[first : first + 3, 0]
                if row < len(kinds):
                    lines.append(line)
                else:
                    padding = max(padding, float(np.abs(line).max()))
        table = np.array(lines)
        return ElementRows(table[:, -3], table[:, :-6], table[:, -2], table[:, -1], padding)

    def reactions(self, state: BenchState) -> tuple[Array, Array, Array, Array]:
        """By primitive, under the pushes: λ (·, 2); force and torque on j at the place on j, as a
        solution reports them (·, 3); those on i at its mass centre (·, 3); the place on j (·, 2).
        """
        L, W = self._set(state)
        primitives, pushes = len(L.primitive_node), len(self.pushes)
        motion = np.concatenate([state.q, state.v, 0.0 * state.q])[None, :]
        output = np.zeros((1, pushes + 1, PER_PRIMITIVE * primitives, 1))
        breakdown(L, W, 0.0, motion, np.array([state.t]), pushes, NO_FRICTION, output)
        raise_user_error(self.system)
        parts = output[0, 1:, :, 0].sum(axis=0).reshape(primitives, PER_PRIMITIVE)
        blocks = W.block[:, 0].reshape(-1, 2, 2, 3)[L.primitive_node, 0]
        on_i = -np.einsum("erc,er->ec", blocks, parts[:, :2])
        position: tuple[Any, Any] = (0.0, 0.0)
        if "j" in self.element.places():
            position = self.system.numbers.arm(self.element, "j")
        pose = with_ground(state.q)[L.primitive_j]
        place = pose[:, :2] + np.array([rotation(angle) @ position for angle in pose[:, 2]])
        return parts[:, :2], parts[:, 2:], on_i, place

    def forces(self, state: BenchState) -> Array:
        """(Fx, Fy, T) of all loads on every body, then on the ground: (bodies + 1, 3)."""
        L, W = self._set(state)
        motion = np.concatenate([state.q, state.v, 0.0 * state.q])[None, :]
        one = Finished(
            motion=motion,
            t=np.array([state.t]),
            lam=np.zeros((1, 0)),
            driven=np.zeros(0, dtype=np.int64),
            given=np.zeros((1, 1, 3)),
            by_law=True,
            at_rest=False,
        )
        residuals_of(L, W, one, np.empty((1, RESIDUALS)))
        raise_user_error(self.system)
        return np.array(W.force[:, 0]).reshape(-1, 3)

    def closed(self, state: BenchState, rng: np.random.Generator) -> BenchState | None:
        """A state with Φ = 0, near this one or near another; None where none is found."""
        L, W = self._set(state)
        laws_of_time(L, W)
        units = self.system.coordinate_units
        x = state.q / units
        for _ in range(10):
            found = close_rows(functools.partial(dense, self.system, W), x)
            raise_user_error(self.system)
            if found.good:
                return BenchState(state.t, units * found.x, state.v)
            x = rng.normal(size=len(x)) * self.unit / units
        return None

    # -- another description: new link axes (those of the ground are the world's), mass centres

    def other_axes(self, rng: np.random.Generator) -> dict[str, Frame]:
        """New link axes; turned where the element knows the body by its places alone."""
        angles = _by_angle(self.element)
        return {b.name: _frame(rng, self.length, b.name not in angles) for b in self.bodies}

    def other_world(self, rng: np.random.Generator) -> dict[str, Frame]:
        """Another place of the whole world; turned if the element does not know its axes."""
        rotated = "ground" not in _by_angle(self.element)
        if self.element.role == "load" and len(mentioned(self.element)) < 2:
            rotated = bool(getattr(self.element, "follows", mentioned(self.element)))
        return {"ground": _frame(rng, self.length, rotated)}

    def other_centres(self, rng: np.random.Generator) -> dict[str, Array]:
        """Displacement of each mass centre, in the old link axes."""
        return {body.name: rng.normal(size=2) * self.length for body in self.bodies}

    def redrawn(self, axes: Frames, centres: Shifts | None = None) -> Bench:
        """A bench of equal physics in other axes, with other mass centres."""

        def points(frame: Frame, old: dict[str, Any]) -> dict[str, Any]:
            return {key: _in_axes(frame, point) for key, point in old.items()}

        bodies = []
        for body in self.bodies:
            frame = axes.get(body.name, STILL)
            centre = np.add(_pair_of(body.cg), (centres or {}).get(body.name, np.zeros(2)))
            cg, own = _in_axes(frame, (centre[0], centre[1])), points(frame, body.points)
            spread = _spread(frame[0], body.spread)
            bodies.append(dataclasses.replace(body, cg=cg, points=own, spread=spread))
        ground = points(axes.get("ground", STILL), self.ground)
        pushes = tuple(_replaced(push, axes) for push in self.pushes)
        return Bench(_replaced(self.element, axes), tuple(bodies), ground, pushes, self.length)

    def carried(self, state: BenchState, axes: Frames, centres: Shifts | None = None) -> BenchState:
        """The state in the coordinates of the redrawn bench."""
        world = axes.get("ground", STILL)
        matrix = rotation(world[0])
        q, v = state.q.reshape(-1, 3).copy(), state.v.reshape(-1, 3).copy()
        for n, body in enumerate(self.bodies):
            x, y = rotation(q[n, 2]) @ (centres or {}).get(body.name, np.zeros(2))
            q[n, :2] = matrix @ (q[n, :2] + (x, y)) + world[1:]
            v[n, :2] = matrix @ (v[n, :2] + v[n, 2] * np.array([-y, x]))
            q[n, 2] += world[0] - axes.get(body.name, STILL)[0]
        return BenchState(state.t, q.ravel(), v.ravel())


def mentioned(element: Any) -> list[str]:
    """Names of the bodies that an element names, the ground included."""
    places = [marker.body for marker in element.places().values()]
    return list(dict.fromkeys([*places, *getattr(element, "bodies", ())]))


def _by_angle(element: Element) -> set[str]:
    """Names of the bodies that it knows otherwise than by a place: by the angle of their axes."""
    places = {marker.body for marker in element.places().values()}
    return (set(mentioned(element)) - places) | set(getattr(element, "angles_of", ()))


def rotation(angle: float) -> Array:
    """R(angle), (2, 2)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def with_ground(values: Array) -> Array:
    """(bodies + 1, 3): values of the bodies, zeros for the ground."""
    return np.append(values, np.zeros(3)).reshape(-1, 3)


def about_origin(forces: Array, places: Array) -> Array:
    """Forces and torques (·, 3) at places (·, ≥ 2), with moments about the world's origin."""
    moments = places[:, 0] * forces[:, 1] - places[:, 1] * forces[:, 0]
    return np.column_stack([forces[:, :2], forces[:, 2] + moments])


def _pair(rng: np.random.Generator, length: float) -> tuple[float, float]:
    x, y = rng.normal(size=2) * length
    return float(x), float(y)


def _frame(rng: np.random.Generator, length: float, rotated: bool) -> Frame:
    return (float(rng.uniform(1.0, 5.0)) if rotated else 0.0, *_pair(rng, length))


def _pair_of(point: Point) -> tuple[float, float]:
    if isinstance(point, Polar):
        return point.r * math.cos(point.angle), point.r * math.sin(point.angle)
    return point


def _in_axes(frame: Frame, point: Point) -> tuple[float, float]:
    x, y = rotation(frame[0]) @ _pair_of(point) + frame[1:]
    return float(x), float(y)


def _spread(angle: float, old: Any) -> SecondMoments:
    """Second moments of a body in axes from which it looks rotated by the angle."""
    matrix = rotation(angle)
    moments = matrix @ np.array([[old.xx, old.xy], [old.xy, old.yy]]) @ matrix.T
    return SecondMoments(float(moments[0, 0]), float(moments[1, 1]), float(moments[0, 1]))


def _replaced(element: Any, axes: Frames) -> Any:
    """The element with its places in other axes."""
    places = {}
    for field, marker in element.places().items():
        frame = axes.get(marker.body, STILL)
        named = isinstance(marker.point, str)
        point = marker.point if named else _in_axes(frame, marker.point)
        places[field] = Marker(marker.body, point, marker.angle + frame[0])
    return dataclasses.replace(element, **places)


# -- the element as a value ------------------------------------------------------------------------


def check_value(ledger: Ledger, bench: Bench) -> None:
    """Frozen, equal to its copies, and the same after a pickle, by itself and in a system."""
    element, ledger.where = bench.element, ""
    try:
        copy.copy(element).name = "other"  # type: ignore[misc]  # must fail
        ledger.fail("frozen: it can be changed; derive it as @dataclass(frozen=True)")
    except dataclasses.FrozenInstanceError:
        pass
    for make in (copy.copy, copy.deepcopy, dataclasses.replace):
        if make(element) != element:
            ledger.fail(f"equality: it is not equal to its {make.__name__}, as dataclasses are")
    ledger.require("frozen, equal copies", 0.0, "")
    try:
        other = pickle.loads(pickle.dumps(element))
        system: System = pickle.loads(pickle.dumps(bench.system))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        home: Any = sys.modules.get(type(element).__module__)
        for part in type(element).__qualname__.split("."):
            home = getattr(home, part, None)
        fields = [getattr(element, field.name) for field in dataclasses.fields(element)]
        if home is type(element) and not any(isinstance(field, Function) for field in fields):
            ledger.fail(f"pickle: {error}")
        return ledger.skip("pickle", "its class, or a function of it, has no name in a module")
    if other != element or system.mechanism[element.name] != element:
        ledger.fail("pickle: it is not equal to itself after it was saved")
    ledger.require("pickle", 0.0, "")


#: Units of length, mass and time, as parts of the old ones, that no product of small powers undoes.
UNITS = (7.3, 0.31, 1.9)


class OtherUnits:
    """A bench with every number in other units of length, mass and time.

    `missing`: Why it cannot be made: numbers that have no dimension. Empty where it can.
    """

    def __init__(self, bench: Bench) -> None:
        self.missing = _missing(bench.element)
        self.own = any(f.metadata.keys() & {"dimension", "law"} for f in _fields(bench.element))
        if self.missing:
            return
        machine = bench.system.mechanism
        dimensions = {name: dimension_named(machine, name) for name in bench.system.values}
        if None in dimensions.values():
            self.missing = "a law of it has numbers without a dimension"
            return
        values = {
            name: value / _size(dimensions[name] or Dimension())
            for name, value in bench.system.values.items()
        }
        self.bench = dataclasses.replace(bench)
        self.bench.__dict__["system"] = bench.system.with_values(values)

    def require(self, ledger: Ledger, name: str, error: float, what: str) -> None:
        """Require it of an element that declares what its numbers measure, note it of others."""
        text = f"in other units of length, mass and time {what}: what do its numbers measure?"
        if self.own:
            ledger.require(name, error, text)
        else:
            ledger.record(name, error, "it is right in any units", "it is right in one unit system")

    def state(self, state: BenchState) -> BenchState:
        """The state in the other units."""
        length, time = _size(DIMENSIONS["length"]), _size(DIMENSIONS["time"])
        unit = np.tile([length, length, 1.0], len(state.q) // 3)
        return BenchState(state.t / time, state.q / unit, state.v / unit * time)

    def forces(self, forces: Array) -> Array:
        """Forces (bodies, 3) in the other units."""
        force, torque = _size(DIMENSIONS["force"]), _size(DIMENSIONS["torque"])
        found: Array = forces / np.array([force, force, torque])
        return found

    def rows(self, phi: Array, kinds: str) -> Array:
        """Φ (rows,) in the other units."""
        sizes = [_size(DIMENSIONS["length"]) if kind == "l" else 1.0 for kind in kinds]
        found: Array = phi / np.array(sizes)
        return found


def _fields(element: Element) -> list[Any]:
    return list(dataclasses.fields(element))


def _size(dimension: Dimension) -> float:
    """The new unit of a dimension as a part of the old one."""
    powers = dimension.length, dimension.mass, dimension.time
    return float(np.prod([unit ** float(p) for unit, p in zip(UNITS, powers, strict=True)]))


def _missing(element: Element) -> str:
    for field in _fields(element):
        law = getattr(element, field.name)
        if isinstance(law, (Function, Table, Cam)):
            return f"a {type(law).__name__} cannot be taken to other units here"
        if "law" in field.metadata and isinstance(law, Law) and not law.numbers():
            return f"a {type(law).__name__} has no numbers"
    return ""


# -- The contract of joints and drivers --------------------------------------------------------


def check_joint(
    element: Joint | Driver,
    *,
    states: int = 20,
    seed: int = 0,
    tolerance: float = CONTRACT_TOLERANCE,
    length: float = 1.0,
    times: tuple[float, float] = (0.0, 1.0),
) -> Report:
    """Prove a joint or a driver: derivatives, reactions, rank, frames, copies.

    Φ_q = ∂Φ/∂q, ν = −∂Φ/∂t and γ = Φ_q a − d²Φ/dt² are compared with differences; the reactions
    that a solution would report sum to zero on both bodies and do no work on allowed velocities;
    nothing depends on the axes in which bodies are drawn, on their mass centres, or on the world's
    place, or on the units of its numbers; the rows are independent; the element is frozen, copies
    and pickles.

    Parameters
    ----------
    element : Joint or Driver
        Between any bodies: they are made for it, with the named points that it refers to.
    states : int
        How many random states to try.
    seed : int
        Of the random numbers.
    tolerance : float
        Greatest relative error.
    length : float
        Size of the bodies [length]: about that of the element's own lengths.
    times : pair of float
        Interval of the states' times: where the element's laws are defined.

    Returns
    -------
    Report
        Every check with its greatest error.

    Raises
    ------
    AssertionError
        Where the element fails: the sentence has what was found and expected, and at which state.

    Notes
    -----
    When a body is drawn in other axes, its angle changes, and so do the angles of the markers on
    it: physics that uses an angle of a body must count the marker's. About 0.1 s an element.

    Examples
    --------
    >>> from mbody import Revolute
    >>> check_joint(Revolute("A", "crank.A", "coupler.A")).worst < 1e-8
    True
    """
    if not isinstance(element, Joint | Driver):
        raise TypeError(f"check_joint takes a joint or a driver, not {element!r}")
    rng = np.random.default_rng(seed)
    ledger = Ledger(element, states, tolerance)
    bench = make_bench(element, rng, length, pushed=True)
    axes, centres, world = bench.other_axes(rng), bench.other_centres(rng), bench.other_world(rng)
    redrawn, moved = bench.redrawn(axes, centres), bench.redrawn(world)
    tried = [bench.state(rng, times) for _ in range(states)]
    units = OtherUnits(bench)
    with ledger:
        if units.missing:
            ledger.skip("units", units.missing)
        for n, state in enumerate(tried):
            ledger.where = bench.words(n, seed, state)
            _derivatives(ledger, bench, state, rng, times[1] - times[0])
        for n, state in enumerate(tried):
            ledger.where = bench.words(n, seed, state)
            _description(ledger, bench, state, redrawn, axes, centres)
            if not units.missing:
                _units(ledger, bench, state, units)
        for n, state in enumerate(tried):
            ledger.where = bench.words(n, seed, state)
            closed = bench.closed(state, rng)
            if closed is None:
                ledger.fail(f"closed: no place with Φ = 0 found; is length={length:g} apt?")
            ledger.where = bench.words(n, seed, closed)
            r = bench.rows(closed)
            _rank(ledger, bench, r)
            _reactions(ledger, bench, closed)
            _power(ledger, bench, closed, r, rng)
            _joint_in_moved_world(ledger, bench, closed, moved, world)
        check_value(ledger, bench)
    return ledger.report()


def _derivatives(
    ledger: Ledger, bench: Bench, state: BenchState, rng: np.random.Generator, span: float
) -> None:
    """Φ_q, ν and γ against differences of Φ and of dΦ/dt = Φ_q v − ν."""
    t, q, v = state
    r, unit = bench.rows(state), bench.unit
    for name, part in (("Φ", r.phi), ("Φ_q", r.G), ("ν", r.nu), ("γ", r.gamma)):
        ledger.finite(part, name)
    text = "beyond its own rows Φ, Φ_q, ν and γ must be zeros"
    ledger.require("padding", r.padding, text)
    stationary = bench.rows(BenchState(t, q, 0.0 * v))
    drift = np.abs(
        np.column_stack([r.phi - stationary.phi, r.nu - stationary.nu, r.G - stationary.G])
    ).max(axis=1)
    text = "Φ, Φ_q and ν of row {row} change with velocities; rows are of position"
    ledger.require("position only", drift, text)

    size = np.maximum(np.abs(r.G * unit).max(axis=1), np.abs(r.phi))
    for m in range(len(q)):
        move = np.zeros_like(q)
        move[m] = unit[m]

        def shifted(s: float, move: Array = move) -> Array:
            return bench.rows(BenchState(t, q + s * move, v)).phi

        what = f"∂Φ/∂{'xyθ'[m % 3]} of '{bench.bodies[m // 3].name}'"
        ledger.differ("Φ_q", what, r.G[:, m] * unit[m], shifted, size, unit[m])

    def later(s: float) -> Array:
        there: Array = bench.rows(BenchState(t + span * s, q, v)).phi
        return -there

    ledger.differ("ν", "−∂Φ/∂t", r.nu * span, later, size, span)

    a = rng.normal(size=len(q)) * unit / span**2

    def rate(s: float) -> Array:
        s = span * s
        there = bench.rows(BenchState(t + s, q + s * v + 0.5 * s * s * a, v + s * a))
        left: Array = span * (r.G @ a * s - there.G @ (v + s * a) + there.nu)
        return left

    terms = np.abs(r.G * a), np.abs(r.G * v) / span, np.abs(r.gamma)[:, None]
    size = span**2 * np.column_stack(terms).max(axis=1)
    ledger.differ("γ", "Φ_q a − d²Φ/dt²", r.gamma * span**2, rate, size, span**2)


def _description(
    ledger: Ledger, bench: Bench, state: BenchState, redrawn: Bench, axes: Frames, centres: Shifts
) -> None:
    """Other link axes and mass centres of the same bodies: Φ, ν and the forces of λ = 1 stay."""
    there = bench.carried(state, axes, centres)
    old, new = bench.rows(state), redrawn.rows(there)
    text = " of row {row} must not change when the bodies get other axes and mass centres"
    size = np.maximum(np.abs(old.G * bench.unit).max(axis=1), np.abs(old.phi))
    ledger.require("description", np.abs(old.phi - new.phi) / size, "Φ" + text)
    ledger.require("description", np.abs(old.nu - new.nu) / size, "ν" + text)
    # a row of Φ_q is a force (−λ) on each body; moments about one point compare
    before, after = (
        about_origin(r.G.reshape(-1, 3), np.tile(s.q.reshape(-1, 3), (len(r.G), 1)))
        for r, s in ((old, state), (new, there))
    )
    change, size = (np.abs(x).reshape(len(old.G), -1).max(axis=1) for x in (after - before, before))
    ledger.require("description", change / size, "the reaction" + text)


def _units(ledger: Ledger, bench: Bench, state: BenchState, units: OtherUnits) -> None:
    """Φ with all numbers in other units."""
    r, there = bench.rows(state), units.bench.rows(units.state(state))
    kinds = "".join(bench.system.row_kinds)
    size = np.maximum(np.abs(r.G * bench.unit).max(axis=1), np.abs(r.phi))
    error = np.abs(units.rows(r.phi, kinds) - there.phi) / units.rows(size, kinds)
    units.require(ledger, "units", float(error.max()), "Φ does not go along")


def _rank(ledger: Ledger, bench: Bench, r: ElementRows) -> None:
    """The dimensionless rows are independent."""
    kinds = "".join(bench.system.row_kinds)
    scale = np.array([1.0 / bench.length if kind == "l" else 1.0 for kind in kinds])
    sizes = np.linalg.svd(scale[:, None] * r.G * bench.unit, compute_uv=False)
    rank = int((sizes > SINGULAR_VALUE_ZERO * sizes[0]).sum())
    text = f"of its {len(r.G)} rows only {rank} are independent"
    ledger.require("full rank", float(len(r.G) - rank), text)


def _reactions(ledger: Ledger, bench: Bench, state: BenchState) -> None:
    """The reaction reported on j at its place, and that on i: together nothing."""
    _, on_j, on_i, place = bench.reactions(state)
    L = bench.system.layout
    if (L.primitive_i == L.bodies).all() and not on_i.any():
        return ledger.skip("action = reaction", "the ground's side is all zeros, nobody reads it")
    at_i = with_ground(state.q)[L.primitive_i]
    both = np.concatenate([about_origin(on_j, place), about_origin(on_i, at_i)])
    unbalanced(ledger, both, bench.length)


def unbalanced(ledger: Ledger, forces: Array, length: float) -> None:
    """Forces (·, 3) with moments about the world's origin must sum to zero."""
    total, size = forces.sum(axis=0), np.abs(forces).max(axis=0)
    force = max(size[0], size[1], size[2] / length)
    moment = max(size[2], length * force)
    text = "what it does to its bodies leaves a {} of {:.3g}; it must sum to zero"
    for what, left, whole in (
        ("force", math.hypot(total[0], total[1]), force),
        ("moment about the world's origin", abs(total[2]), moment),
    ):
        ledger.require("action = reaction", left / max(whole, TINY), text.format(what, left))


def _power(
    ledger: Ledger, bench: Bench, state: BenchState, r: ElementRows, rng: np.random.Generator
) -> None:
    """No work on velocities with Φ_q v = 0; that of a driver's effort where Φ_q v = ν."""
    lam, on_j, _, place = bench.reactions(state)
    L, q = bench.system.layout, with_ground(state.q)
    size = float(np.abs(on_j * [bench.length, bench.length, 1.0]).max())

    def power(u: Array) -> tuple[float, float]:
        w, parts = with_ground(u), []
        for e, (i, j) in enumerate(zip(L.primitive_i, L.primitive_j, strict=True)):
            for sign, b in ((1.0, j), (-1.0, i)):
                x, y = place[e] - q[b, :2]
                rates = w[b, 0] - w[b, 2] * y, w[b, 1] + w[b, 2] * x, w[b, 2]
                parts += list(sign * on_j[e] * rates)
        return sum(parts), max(TINY, size * float(np.abs(u / bench.unit).max()))

    inverse = bench.unit[:, None] * np.linalg.pinv(r.G * bench.unit)
    anything = rng.normal(size=len(q) * 3 - 3) * bench.unit
    allowed = anything - inverse @ (r.G @ anything)
    if np.abs(allowed / bench.unit).max() > USER_POWER_NONE:
        given, whole = power(allowed)
        text = f"its reactions give the power {given:.3g} at velocities that it allows"
        ledger.require("no work", abs(given) / whole, text)
    else:
        ledger.skip("no work", "it allows no velocity")
    if ledger.element.role == "driver":
        given, whole = power(anything - inverse @ (r.G @ anything - r.nu))
        effort = -float(lam[0, 0] * r.nu[0])
        text = f"it gives the power {given:.3g}, its effort times its rate is {effort:.3g}"
        ledger.require("power of effort", abs(given - effort) / whole, text)


def _joint_in_moved_world(
    ledger: Ledger, bench: Bench, state: BenchState, moved: Bench, world: Frames
) -> None:
    """The whole world elsewhere: still closed, and the reactions have gone along."""
    there, angle = bench.carried(state, world), world["ground"][0]
    note = "" if angle else "moved, not turned: it measures angles from the world's x axis"
    gap = np.abs(moved.rows(there).phi) / bench.length
    text = "with the whole world moved, row {row} of Φ is no longer zero"
    ledger.require("world", gap, text, note)
    old, new = bench.reactions(state)[1], moved.reactions(there)[1]
    off = new - np.column_stack([old[:, :2] @ rotation(angle).T, old[:, 2]])
    scale = np.array([bench.length, bench.length, 1.0])
    error = float(np.abs(off * scale).max() / max(TINY, np.abs(old * scale).max()))
    text = "with the whole world moved, its reaction does not go along"
    ledger.require("world", error, text, note)


# -- The contract of loads ---------------------------------------------------------------------


def check_load(
    element: Load,
    *,
    states: int = 20,
    seed: int = 0,
    tolerance: float = CONTRACT_TOLERANCE,
    length: float = 1.0,
    times: tuple[float, float] = (0.0, 1.0),
) -> Report:
    """Prove a load: action and reaction, frames, conservation, dissipation, copies.

    The forces on both bodies sum to zero; they do not depend on the axes in which bodies are drawn,
    and go along when the whole world is moved, and when its numbers are in other units: a load that
    has numbers by `number_field` must have declared what they measure. A load that is
    `conservative`, as springs and gravity, must have a symmetric stiffness, one that is
    `dissipative` must never give power; of other loads the report notes whether they do.

    Parameters
    ----------
    element : Load
        Between any bodies: they are made for it, with the named points that it refers to.
    states, seed, tolerance, length, times
        As of `check_joint`.

    Returns
    -------
    Report
        Every check with its greatest error.

    Raises
    ------
    AssertionError
        Where the element fails: the sentence has what was found and expected, and at which state.

    Notes
    -----
    A load by the ground must give the force and the torque on the ground too, as on any body: about
    its mass centre, which is the origin of the world.

    Examples
    --------
    >>> from mbody import Spring
    >>> report = check_load(Spring("spring", "ground.C", "arm.B", stiffness=20.0))
    >>> report["conservative"].error < 1e-8
    True
    """
    if not isinstance(element, Load):
        raise TypeError(f"check_load takes a load, not {element!r}")
    rng = np.random.default_rng(seed)
    ledger = Ledger(element, states, tolerance)
    bench = make_bench(element, rng, length, pushed=False)
    axes, world = bench.other_axes(rng), bench.other_world(rng)
    redrawn, moved, units = bench.redrawn(axes), bench.redrawn(world), OtherUnits(bench)
    with ledger:
        if units.missing:
            ledger.skip("units", units.missing)
        for n in range(states):
            state = bench.state(rng, times)
            ledger.where = bench.words(n, seed, state)
            forces = bench.forces(state)
            ledger.finite(forces, "the force")
            if len(mentioned(element)) < 2:
                ledger.skip("action = reaction", "it acts from outside the mechanism")
            else:
                unbalanced(ledger, about_origin(forces, with_ground(state.q)), length)
            there = redrawn.forces(bench.carried(state, axes))
            text = "its forces must not change when the bodies get other axes"
            ledger.require("description", _change(bench, forces, there), text)
            _load_in_moved_world(ledger, bench, state, forces, moved, world)
            _energy(ledger, bench, state, forces)
            if not units.missing:
                there = units.bench.forces(units.state(state))
                error = _change(bench, units.forces(forces), there)
                units.require(ledger, "units", error, "its forces do not go along")
        check_value(ledger, bench)
    return ledger.report()


def _change(bench: Bench, before: Array, after: Array) -> float:
    """Greatest change of the forces on moving bodies, as a part of the greatest force."""
    scale = np.array([bench.length, bench.length, 1.0])
    size = max(float(np.abs(before * scale).max()), TINY)
    return float(np.abs((after - before) * scale)[:-1].max()) / size


def _load_in_moved_world(
    ledger: Ledger, bench: Bench, state: BenchState, forces: Array, moved: Bench, world: Frames
) -> None:
    """The whole world elsewhere: the forces have gone along."""
    angle = world["ground"][0]
    note = "" if angle else "moved, not turned: it has to do with the world's axes"
    expected = np.column_stack([forces[:, :2] @ rotation(angle).T, forces[:, 2]])
    error = _change(bench, expected, moved.forces(bench.carried(state, world)))
    text = "with the whole world moved, its forces do not go along"
    ledger.require("world", error, text, note)


def _energy(ledger: Ledger, bench: Bench, state: BenchState, forces: Array) -> None:
    """Dependence on velocity, symmetric stiffness, power."""
    t, q, v = state
    unit = bench.unit
    element: Any = ledger.element
    moving = _change(bench, forces, bench.forces(BenchState(t, q, 0.0 * v)))
    good, bad = "its forces do not depend on velocities", "its forces depend on velocities"
    ledger.record("velocity", moving, good, bad)

    def work(step: float) -> Array:
        """Work [force·length] of unit motion m' for unit motion m: symmetric with a potential."""
        lines = []
        for m in range(len(q)):
            move = np.zeros_like(q)
            move[m] = unit[m]

            def shifted(s: float, move: Array = move) -> Array:
                there: Array = bench.forces(BenchState(t, q + s * move, v))[:-1].ravel() * unit
                return there

            lines.append(derivative(shifted, step))
        return np.array(lines)

    found = [work(step) for step in STEPS]
    size = max(TINY, *(float(np.abs(x).max()) for x in (found[0], forces[:-1].ravel() * unit)))
    curl = float(np.min([np.abs(k - k.T) for k in found], axis=0).max()) / size
    if element.conservative:
        text = "its stiffness is not symmetric, so that its work depends on the path"
        ledger.require("conservative", max(curl, moving), text)
    else:
        ledger.record(
            "conservative", max(curl, moving), "it has a potential", "it has no potential"
        )
    parts = forces[:-1].ravel() * v
    power = float(parts.sum())
    given = max(0.0, power) / max(float(np.abs(parts).max()), TINY)
    if element.dissipative:
        text = f"it gives the power {power:.3g} to its bodies; a damper only takes"
        ledger.require("dissipation", given, text)
    else:
        ledger.record("dissipation", given, "it never gives power", "it gives power at times")
