"""The bench: an element between free massive bodies, and what the kernels compute for it."""

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
from mbody.core.tolerances import LOOP_CLOSURE_CORRECTION, TINY
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
from mbody.laws import Function
from mbody.model.body import Body, SecondMoments
from mbody.model.element import Element, Marker, Point, Polar
from mbody.model.loads import Force
from mbody.model.mechanism import Mechanism
from mbody.system.assembler import assemble
from mbody.system.system import System

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
        q = state.q
        for _ in range(10):
            for _ in range(100):
                r = self.rows(BenchState(state.t, q, state.v))
                if not (np.isfinite(r.phi).all() and np.isfinite(r.G).all()):
                    break
                step = np.linalg.lstsq(r.G * self.unit, -r.phi, rcond=None)[0]
                size = float(np.abs(step).max())
                q = q + self.unit * step * min(1.0, 0.5 / max(size, TINY))
                if size <= LOOP_CLOSURE_CORRECTION * max(1.0, float(np.abs(q / self.unit).max())):
                    return BenchState(state.t, q, state.v)
            q = rng.normal(size=len(q)) * self.unit
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
