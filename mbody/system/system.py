"""The system: what the computer runs. Made by `mbody.system.assembler`, taken by every analysis."""

from __future__ import annotations

import dataclasses
import functools
import weakref
from collections.abc import Callable, Container, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, cast

import numpy as np

from mbody.core.callbacks import register, release
from mbody.core.presentation import present
from mbody.errors import ModelError
from mbody.kernels import constraints
from mbody.kernels.layout import (
    FRICTION_NUMBERS,
    PER_PRIMITIVE,
    Frame,
    Layout,
    Work,
    frame_of,
    integers,
    inverse_masses,
)
from mbody.kernels.loop_closure import violation
from mbody.laws import Expression, Law, MeasuredFormula, Table
from mbody.laws.function import FunctionCalls
from mbody.laws.kernels import OPERATIONS, FloatArray
from mbody.model.driver import Driver
from mbody.model.element import (
    Element,
    Numbers,
    Polar,
    is_plain_field,
    listed,
    place_name,
    plain_field,
)
from mbody.model.mechanism import Mechanism
from mbody.model.primitives import Signal
from mbody.quantities import Formula, FormulaError
from mbody.quantities.formula import PlainNumbers

if TYPE_CHECKING:
    from mbody.system.formula_steps import DriverFormula, StepList


# -- Steps of all formulas of measured quantities as one table for the kernels -----------------


def driver_states(driver: Element, machine: Mechanism, at: Numbers) -> tuple[str, ...]:
    """Auxiliary states that a driver follows."""
    own: Any = driver
    if not isinstance(own.law, MeasuredFormula):
        return ()
    from mbody.system.formula_steps import recorded_driver

    signal = at.law(driver, "law")
    return tuple(sorted(recorded_driver(driver, signal, machine, at).states))


# -- Formula of a driver as a law of time, by NumPy --------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class ComposedLaw(Law):
    """The formula of a driver with the laws of its inputs: a function of time."""

    kind: ClassVar[str] = "measured"

    text: str
    formula: DriverFormula
    inputs: Mapping[str, Law]

    def __repr__(self) -> str:
        return repr(self.text)

    def numbers(self) -> dict[str, float]:
        """None: they belong to the formula."""
        return {}

    def raw(self, xs: FloatArray) -> FloatArray:
        """f, f′, f″, (N, 3), at times (N,)."""
        from mbody.system.formula_steps import SIGNALS, step_values

        formula = self.formula
        signals = {name: law.raw(xs) for name, law in self.inputs.items()}

        def read(kind: str, *arguments: str) -> FloatArray:
            if kind == "time":
                return xs
            column: FloatArray = signals[arguments[0]][:, SIGNALS.index(kind)]
            return column

        goals = (formula.value, formula.rate, formula.acceleration)
        return np.stack(step_values(formula.steps, goals, read, xs.shape), axis=1)


def driven_law(driver: Element, mechanism: Mechanism, at: Numbers) -> Law:
    """The law of a driver that follows a formula of time and inputs."""
    signal = at.law(driver, "law")
    from mbody.system.formula_steps import recorded_driver

    formula = recorded_driver(driver, signal, mechanism, at)
    text = getattr(signal.law, "text", "")
    if formula.measured_bodies or formula.states:
        what = "positions" if formula.measured_bodies else "auxiliary states"
        raise ModelError(
            f"'{driver.name}' follows {what}, '{text}', which time alone does not give: give "
            "times, or values of the drivers that follow time",
            driver.name,
        )
    inputs = {}
    for one in mechanism.inputs:
        if one.name in formula.signals:
            own = one.value.numbers()
            name = f"{one.name}.value"
            plain = set(own) == {"value"}
            inputs[one.name] = one.value.with_numbers(
                {key: at[name if plain else f"{name}.{key}"] for key in own}
            )
    return ComposedLaw(text, formula, inputs)


CODES = {name: n for n, name in enumerate(OPERATIONS)}
#: Curves and their derivatives, in the order of the codes.
LAWS = ("law", "law rate", "law acceleration")


@dataclass(frozen=True)
class RecordedLaw:
    """A law with its parameters, and the steps of one that is a formula of measured quantities."""

    signal: Signal
    steps: StepList | None = None
    #: Whether its rate and its second derivative count: of rows, not of forces.
    derivatives: bool = False
    #: What a driver follows, if that is a formula of measured quantities.
    driven: DriverFormula | None = None

    @property
    def law(self) -> Law:
        """The law."""
        return self.signal.law

    @property
    def laws(self) -> list[Signal]:
        """The laws that its steps evaluate."""
        steps = self.steps if self.driven is None else self.driven.steps
        return [] if steps is None else steps.laws

    @property
    def parameters(self) -> list[Any]:
        """Its parameters, each a float or an array over a batch."""
        steps = self.steps if self.driven is None else self.driven.steps
        return self.signal.parameters if steps is None else steps.numbers

    @property
    def of_solution(self) -> bool:
        """Whether it measures accelerations or reactions."""
        if self.steps is None:
            return False
        from mbody.system.formula_steps import measures_solution

        return measures_solution(self.steps, self.steps.value)

    @property
    def timed(self) -> bool:
        """Whether it is a law of time, which the kernels evaluate as a function of one number."""
        return self.steps is None and self.driven is None


def recorded(
    signal: Signal, machine: Mechanism, at: Numbers, argument: Element | None = None
) -> RecordedLaw:
    """A law of a load or a state; `argument`: the load whose own law it is."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal)
    from mbody.system.formula_steps import record_formula

    return RecordedLaw(signal, record_formula(signal.law, signal.parameters, machine, at, argument))


def driver_law(signal: Signal, driver: Element, machine: Mechanism, at: Numbers) -> RecordedLaw:
    """Law that a driver follows, or the coordinate of a stop."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal, derivatives=True)
    from mbody.model.stop import Stop
    from mbody.system.formula_steps import recorded_driver, recorded_stop

    if isinstance(driver, Stop):
        return RecordedLaw(signal, driven=recorded_stop(driver, machine, at))
    return RecordedLaw(signal, driven=recorded_driver(driver, signal, machine, at))


def following(mechanism: Mechanism, at: Numbers) -> dict[str, tuple[str, ...]]:
    """Stops, and drivers that follow positions, with the moving bodies of their rows."""
    found: dict[str, tuple[str, ...]] = {}
    if mechanism.stops:
        from mbody.system.formula_steps import recorded_stop

        stops = {one.name: recorded_stop(one, mechanism, at) for one in mechanism.stops}
        found = {name: one.measured_bodies for name, one in stops.items()}
    for driver in mechanism.drivers:
        driven = driver_law(at.law(driver, "law"), driver, mechanism, at).driven
        if driven is not None and driven.measured_bodies:
            found[driver.name] = driven.measured_bodies
    return found


class FormulaRows:
    """The table of `mbody.kernels.constraints`, filled formula by formula; what two of them
    read or compute alike is there once.
    """

    def __init__(
        self,
        bodies: Mapping[str, int],
        inputs: Mapping[str, int],
        states: Sequence[str],
        primitives: Mapping[str, Sequence[int]],
    ) -> None:
        self.bodies, self.inputs, self.states = bodies, inputs, list(states)
        self.primitives = primitives
        self.rows: list[tuple[int, int, int, int]] = []
        self.count = 0
        self._known: dict[tuple[int, int, int], int] = {}

    def add(
        self,
        law: RecordedLaw,
        first: int,
        *,
        laws: int = 0,
        signal: int | None = None,
        rate: int | None = None,
    ) -> None:
        """Append a formula whose parameters begin at row `first`, and where its value goes; of any
        other law nothing. laws: number of the first of the laws that it evaluates.
        """
        steps = law.steps
        if steps is None:
            return
        if signal is not None:
            self._recorded(steps, first, laws, [(constraints.TO_SIGNAL, steps.value, signal)])
        if rate is not None:
            self._recorded(steps, first, laws, [(constraints.TO_RATE, steps.value, rate)])

    def add_signal(self, law: RecordedLaw, first: int, laws: int, signal: int) -> None:
        """Append what a driver follows of time, inputs and auxiliary states: its value, rate and
        acceleration.
        """
        if law.driven is None or law.driven.measured_bodies:
            return
        driven = law.driven
        numbers = (driven.value, driven.rate, driven.acceleration)
        goals = [(constraints.TO_SIGNAL, number, signal + n) for n, number in enumerate(numbers)]
        self._recorded(driven.steps, first, laws, goals)
        self._known.clear()  # inputs may be set before the loads are evaluated

    def add_rows(
        self,
        driven: DriverFormula,
        first: int,
        laws: int,
        signal: int,
        row: int,
        blocks: Mapping[str, int],
    ) -> tuple[int, int, int]:
        """Append the row of a driver that follows positions; where its steps begin, where those of
        γ do, and where they end. row: that of Φ; blocks: where those of its bodies begin.
        """
        begin = len(self.rows)
        goals = [
            (constraints.TO_SIGNAL, driven.value, signal),
            (constraints.TO_SIGNAL, driven.rate, signal + 1),
        ]
        goals += [(constraints.TO_PHI, driven.phi, row), (constraints.TO_NU, driven.rate, row)]
        goals += [
            (constraints.TO_BLOCK, number, blocks[body] + axis)
            for (body, axis), number in driven.gradient.items()
        ]
        self._recorded(driven.steps, first, laws, goals)
        self._known.clear()
        middle = len(self.rows)
        self._recorded(
            driven.steps, first, laws, [(constraints.TO_GAMMA, driven.acceleration, row)]
        )
        self._known.clear()
        return begin, middle, len(self.rows)

    def _recorded(
        self, steps: StepList, first: int, laws: int, goals: Sequence[tuple[int, int, int]]
    ) -> None:
        """Append the steps that some numbers need, then where these go: (code, place, row)."""
        needed = steps.needed([number for _, number, _ in goals])
        places: dict[int, int] = {}
        for place in needed:
            what = steps.steps[place]
            if what[0] == "reaction":
                places[place] = self._reaction(what[1], what[2])
                continue
            if what[0].startswith("law"):
                code, a, b = self._law(what, laws, places)
            else:
                code, a, b = self._read(what, int(first)) or self._operation(what, places)
            places[place] = self._row_of(code, a, b)
        for code, number, row in goals:
            self.rows.append((code, places[number], 0, row))

    def _reaction(self, name: str, part: int) -> int:
        """Place of a part of the reaction of a joint, the sum of those of its primitives; of a
        driver of the multiplier of its own.
        """
        first, *more = [PER_PRIMITIVE * e + part for e in self.primitives[name]]
        found = self._row_of(constraints.REACTION, first, 0)
        for row in more if part > 1 else ():
            other = self._row_of(constraints.REACTION, row, 0)
            found = self._row_of(CODES["+"], found, other)
        return found

    def table(self) -> np.ndarray:
        """(steps, 4)."""
        return np.array(self.rows, dtype=np.int64).reshape(-1, 4)

    def _row_of(self, code: int, a: int, b: int) -> int:
        """Place of a number, recorded if it was not yet."""
        if (code, a, b) not in self._known:
            self._known[code, a, b] = self.count
            self.rows.append((code, a, b, self.count))
            self.count += 1
        return self._known[code, a, b]

    def _read(self, what: tuple[Any, ...], first: int) -> tuple[int, int, int] | None:
        """Code and row of a number of the instant; None of an operation."""
        from mbody.system.formula_steps import SIGNALS

        kind, *arguments = what
        if kind == "position":
            return constraints.POSITION, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "velocity":
            return constraints.VELOCITY, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "acceleration":
            return constraints.ACCELERATION, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "turn":
            return constraints.TURN, 2 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "time":
            return constraints.TIME, 0, 0
        if kind == "parameter":
            return constraints.PARAMETER, first + arguments[0], 0
        if kind in SIGNALS:
            return constraints.SIGNAL, self.inputs[arguments[0]] + SIGNALS.index(kind), 0
        if kind == "own":
            return constraints.OWN, self.states.index(arguments[0]), 0
        return None

    def _law(
        self, what: tuple[Any, ...], laws: int, places: Mapping[int, int]
    ) -> tuple[int, int, int]:
        """A law at a number, or a derivative of it, or a table of two variables at two."""
        kind, n, *operands = what
        inputs = [places[one] for one in operands]
        if len(inputs) == 1:
            return constraints.LAW + LAWS.index(kind), inputs[0], laws + n
        return constraints.SURFACE + laws + n, inputs[0], inputs[1]

    def _operation(self, what: tuple[Any, ...], places: Mapping[int, int]) -> tuple[int, int, int]:
        """An operation on numbers whose places are known; one of one number takes it twice."""
        name, *operands = what
        inputs = [places[one] for one in operands]
        return CODES[name], inputs[0], inputs[-1]


# -- Arrays and mappings that a result hands out: they can be read, and not changed by accident

#: What nobody can change.
_KEPT = frozenset({str, float, int, bool, type(None)})


class ReadOnly(dict[str, Any]):
    """A dict that cannot be changed; ``dict(it)`` is a copy that can.

    >>> ReadOnly({"crank.mass": 1.0})["crank.mass"] = 2.0
    Traceback (most recent call last):
    ...
    TypeError: it is read-only: make a copy by dict(...), or other numbers by with_values(...)
    """

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError(
            "it is read-only: make a copy by dict(...), or other numbers by with_values(...)"
        )

    __setitem__ = __delitem__ = __ior__ = _refuse
    update = setdefault = pop = popitem = clear = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return locked, (dict(self),)  # arrays forget in a file that they are locked


def locked(value: Any) -> Any:
    """A view of an array that cannot be written to, a tuple of such, a dict of such as `ReadOnly`;
    anything else unchanged.

    >>> a = np.zeros(3)
    >>> locked(a)[0] = 1.0
    Traceback (most recent call last):
    ...
    ValueError: assignment destination is read-only
    """
    if type(value) is float:  # most are
        return value
    if isinstance(value, np.ndarray):
        if not value.flags.writeable:
            return value
        view = value.view()
        view.flags.writeable = False
        return view
    if type(value) is tuple:
        for part in value:  # a loop, since most are a few strings or truth values
            if isinstance(part, np.ndarray):
                return tuple(locked(part) for part in value)
        return value
    if isinstance(value, Mapping) and not isinstance(value, ReadOnly):
        return ReadOnly({key: locked(part) for key, part in value.items()})
    return value


def lock(result: Any) -> None:
    """Lock every array and every dict among the fields of a frozen dataclass, in place."""
    for name in _names(cast(Any, type(result))):
        value = getattr(result, name)
        if type(value) in _KEPT or (type(value) is np.ndarray and not value.flags.writeable):
            continue
        safe = locked(value)
        if safe is not value:
            object.__setattr__(result, name, safe)


class Locked:
    """Base of frozen dataclasses whose arrays and dicts cannot be changed."""

    def __post_init__(self) -> None:
        lock(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        lock(self)  # arrays forget in a file that they are locked


@functools.cache
def _names(kind: Any) -> tuple[str, ...]:
    """Of the fields of a dataclass: to list them takes longer than to lock them."""
    return tuple(field.name for field in dataclasses.fields(kind))


# -- Dotted names of the numbers of a system that there are not --------------------------------


def no_such_number(name: str, machine: Mechanism, values: Mapping[str, Any]) -> str:
    """The sentence of a name that is none of the numbers of a system."""
    element, _, key = name.partition(".")
    if element in machine and is_plain_field(machine[element], key):
        return plain_field(machine[element], key)
    own = [known for known in values if known.partition(".")[0] == element]
    if own:
        return f"there is no number '{name}' to change (there are: {listed(own)})"
    owners = dict.fromkeys(known.partition(".")[0] for known in values)
    return f"there is no number '{name}' to change (there are numbers of: {listed(owners)})"


# -- Numbers of the nodes that no position changes ---------------------------------------------


def fixed_rows(
    layout: Layout, row_kinds: Sequence[str], active_set: Container[int], lengths: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Proximal terms, identity rows, and blocks of the welds of one body's slots, each (rows, 1):
    equal x and y, then equal angle.
    """
    L = layout
    weights, pad = np.zeros((2 * L.nodes, 1)), np.zeros((2 * L.nodes, 1))
    pairs = zip(row_kinds, L.primitive_node, strict=True)
    for e, (kinds, node) in enumerate(pairs):
        length = lengths[min(L.primitive_i[e], L.primitive_j[e])]
        for row in range(2):
            if row < len(kinds) and e not in active_set:
                weights[2 * node + row] = 1.0 if kinds[row] == "l" else 1.0 / (length * length)
            else:
                pad[2 * node + row] = 1.0
    return weights, pad, welds(L, pad)


def welds(layout: Layout, pad: np.ndarray) -> np.ndarray:
    """Blocks of the welds of one body's slots, (12 nodes, 1); sets their identity rows."""
    L, blocks, seen = layout, np.zeros((12 * layout.nodes, 1)), set[tuple[int, int]]()
    for node in np.setdiff1d(np.arange(L.nodes), L.primitive_node):
        o = 12 * node
        pair = (int(L.node_column[2 * node]), int(L.node_column[2 * node + 1]))
        if pair not in seen:
            seen.add(pair)
            blocks[[o, o + 4]], blocks[[o + 6, o + 10]] = 1.0, -1.0
        else:
            blocks[o + 2], blocks[o + 8] = 1.0, -1.0
            pad[2 * node + 1] = 1.0
    return blocks


# -- Points that the user gave by distance and angle -------------------------------------------


def polar_points(mechanism: Mechanism) -> frozenset[str]:
    """Dotted names of all points that the user gave by distance and angle."""
    found: set[str] = set()
    for body in (*mechanism.bodies, mechanism.ground):
        found.update(f"{body.name}.{key}" for key, p in body.points.items() if isinstance(p, Polar))
        if isinstance(body.cg, Polar):
            found.add(f"{body.name}.cg")
    for element in mechanism:
        for key, marker in element.places().items():
            if isinstance(marker.point, Polar):
                found.add(place_name(f"{element.name}.{key}", marker.point))
    return frozenset(found)


#: Elements whose laws hold within limits that `mbody.analysis.driven.law_doubts` knows.
LIMITED = ("Tyre", "HydraulicCylinder", "PistonPressure", "ReciprocatingCylinder", "Belt")


def numbered(owners: Iterable[tuple[Element, int]]) -> dict[str, list[int]]:
    """Numbers of the primitives of every element, in the order of its parts."""
    found: dict[str, list[tuple[int, int]]] = {}
    for e, (element, part) in enumerate(owners):
        found.setdefault(element.name, []).append((part, e))
    return {name: [e for _, e in sorted(parts)] for name, parts in found.items()}


@dataclass(frozen=True, eq=False, repr=False)
class System:
    """A mechanism as the kernels take it: arrays, names and indices of one topology, immutable.

    Attributes
    ----------
    mechanism : Mechanism
        The description that it was made from.
    layout : Layout
        Index lists of the kernels.
    values : dict
        All changeable numbers by dotted name, and parameters: floats or arrays (batch,), read-only.
    formulas : dict
        What numbers are made of parameters, by dotted name, until given values of their own.
    par, mass : arrays (parameters, batch), (3·bodies + 3, batch)
        Numbers of the kernels.
    batch : int or None
        Number of sets of numbers; None for one set.
    length : float
        Model length, by which sizes are made dimensionless.
    lengths, spans : arrays (bodies,)
        That of what each body is joined with, and the body's own.
    heaviest : float
        Greatest mass of a body, one where there is none.
    owners : tuple
        (element, index of its primitive) of every primitive, in the order of the kernels.
    machine_code : bool
        Whether driven analyses run machine code of this topology alone.

    >>> import mbody
    >>> mbody.assemble(mbody.makers.slider_crank(1.0, 3.0)).batch  # one set of numbers
    """

    mechanism: Mechanism
    layout: Layout
    values: dict[str, Any]
    formulas: dict[str, Formula]
    par: np.ndarray
    mass: np.ndarray
    batch: int | None
    length: float
    lengths: np.ndarray
    spans: np.ndarray
    heaviest: float
    owners: tuple[tuple[Element, int], ...]
    row_kinds: tuple[str, ...]
    signals: int
    plans: dict[Hashable, Any]
    functions: tuple[tuple[str, Callable[..., Any] | None], ...]
    _compile: Callable[[dict[str, Any]], tuple[np.ndarray, np.ndarray]]
    _columns: Callable[[dict[str, Any]], tuple[list[Any], list[Any]]]
    machine_code: bool = False

    def __post_init__(self) -> None:
        for name in ("values", "formulas"):
            object.__setattr__(self, name, locked(getattr(self, name)))

    def _repr_html_(self) -> str:
        # what a notebook shows
        return str(present("notebook", self))

    def __repr__(self) -> str:
        designs = "" if self.batch is None else f", {self.batch} designs"
        return (
            f"System({self.mechanism.name!r}: {self.coordinates} coordinates, {self.rows} rows of "
            f"constraints{designs})"
        )

    @functools.cached_property
    def bodies(self) -> dict[str, int]:
        """Index of every body by name; the ground is the last."""
        names = [body.name for body in self.mechanism.bodies]
        return {name: n for n, name in enumerate([*names, "ground"])}

    @functools.cached_property
    def numbers(self) -> Numbers:
        """The numbers as elements read them: points, body-fixed positions, laws."""
        return Numbers(self.values, polar_points(self.mechanism), self.mechanism.bodies)

    @functools.cached_property
    def rows(self) -> int:
        """Number of constraint rows, drivers included, without those of the active set."""
        every = sum(len(kinds) for kinds in self.row_kinds)
        return every - len(self.active_set_rows)

    @property
    def coordinates(self) -> int:
        """Number of coordinates, three a body."""
        return 3 * self.layout.bodies

    @functools.cached_property
    def coordinate_units(self) -> np.ndarray:
        """Its part's length for each coordinate that is a length, 1 for each angle."""
        return locked(
            np.column_stack([self.lengths, self.lengths, np.ones_like(self.lengths)]).ravel()
        )

    @functools.cached_property
    def row_units(self) -> np.ndarray:
        """By what each row of Φ, in the order of `row_table`, is multiplied to have no unit."""
        primitive, _, is_angle = self.row_table
        i, j = (side[primitive] for side in (self.layout.primitive_i, self.layout.primitive_j))
        length = np.append(self.lengths, self.length)[np.minimum(i, j)]
        return locked(np.where(is_angle, 1.0, 1.0 / length))

    @functools.cached_property
    def jacobian_units(self) -> np.ndarray:
        """What Φ_q without units is as a multiple of Φ_q: (rows, coordinates)."""
        return locked(self.row_units[:, None] * self.coordinate_units)

    @functools.cached_property
    def row_numbers(self) -> np.ndarray:
        """Of every row its place in the rows of a workspace (rows,)."""
        primitive, row, _ = self.row_table
        return locked(2 * self.layout.primitive_node[primitive] + row)

    @functools.cached_property
    def parts(self) -> tuple[int, ...]:
        """First bodies of the connected parts, in ascending order."""
        return tuple(np.unique(self.layout.body_part).tolist())

    @functools.cached_property
    def coordinate_part(self) -> np.ndarray:
        """First body of the connected part of each coordinate (coordinates,)."""
        return locked(np.repeat(self.layout.body_part, 3))

    @functools.cached_property
    def groups(self) -> np.ndarray:
        """First body of the group of each body (bodies,): of connected parts that loads and
        contacts may join as well. Formulas and functions of the user may join any.
        """
        L = self.layout
        if L.formula_numbers or L.owns or self.has_user_code:
            return locked(np.zeros(L.bodies, dtype=np.int64))
        label = np.append(L.body_part, L.bodies)
        ends = [(L.action_i, L.action_j), (L.action_i, L.action_by), (L.action_j, L.action_by)]
        ends += [(L.primitive_i, L.primitive_j)]
        joined = np.concatenate([np.column_stack(pair) for pair in ends])
        joined = joined[(joined < L.bodies).all(axis=1)]
        for i, j in joined[label[joined[:, 0]] != label[joined[:, 1]]].tolist():
            one, other = sorted((label[i], label[j]))
            label[label == other] = one
        return locked(label[:-1])

    @functools.cached_property
    def sizes(self) -> np.ndarray:
        """`Work.size`: the model length, then `lengths` and `spans`, (1 + 2·bodies, 1)."""
        return locked(np.concatenate([[self.length], self.lengths, self.spans])[:, None])

    def extent(self, poses: np.ndarray) -> Any:
        """Greatest coordinate of positions (…, coordinates or more), in model lengths and radians:
        (…). The same of their rates.
        """
        own = np.abs(poses[..., : self.coordinates] / self.coordinate_units)
        return own.max(axis=-1, initial=0.0)

    @functools.cached_property
    def primitives_of(self) -> dict[str, list[int]]:
        """Primitives of every joint, coupling, then driver, by name, in order of description."""
        found = numbered(self.owners)
        return {one.name: found[one.name] for one in self.mechanism.constraints}

    @property
    def input_rows(self) -> np.ndarray:
        """The signal row of every input; those of algebraic loops follow in the layout."""
        return self.layout.input_row[: len(self.mechanism.inputs)]

    @functools.cached_property
    def drivers(self) -> tuple[Driver, ...]:
        """The drivers, in the order of the description."""
        return self.mechanism.drivers

    @functools.cached_property
    def independent_drivers(self) -> tuple[Driver, ...]:
        """The drivers that do not follow positions, in the order of the description."""
        dependent = self.layout.driver_dependent.tolist()
        return tuple(d for d, one in zip(self.drivers, dependent, strict=True) if not one)

    @property
    def has_loops(self) -> bool:
        """Whether loads follow accelerations or forces that follow from them in turn."""
        return bool(len(self.layout.loop_row))

    def refuse_loops(self, what: str) -> None:
        """Refuse an analysis that does not solve algebraic loops, by a sentence that says what."""
        if self.has_loops:
            from mbody.model.states import measuring_forces

            names = measuring_forces(self.mechanism)
            raise ModelError(
                f"{what} no algebraic loops: the formulas of {listed(names)} measure accelerations "
                "or forces that follow from them in turn; take simulate with 'dop853', "
                "kinetostatics or statics, or lead what is measured through a State",
                names[0],
            )

    @property
    def measures_forces(self) -> bool:
        """Whether formulas of loads or auxiliary states measure accelerations or reactions."""
        return self.layout.force_steps < len(self.layout.formula_step)

    @functools.cached_property
    def has_user_code(self) -> bool:
        """Whether plain Python of the user takes part: the analysis keeps to the scalar path."""
        return any(function is not None for _, function in self.functions)

    @property
    def law_calls(self) -> list[tuple[str, FunctionCalls]]:
        """Python functions of laws with the names of their elements."""
        return [(name, one) for name, one in self.functions if isinstance(one, FunctionCalls)]

    @property
    def has_limited_laws(self) -> bool:
        """Whether a law has a range, holds within limits or is Python of the user, so that doubts
        about laws are to be looked for.
        """

        def limited() -> bool:
            machine = self.mechanism
            elements = (*machine.joints, *machine.drivers, *machine.loads)
            laws = [value for element in elements for value in vars(element).values()]
            return (
                bool(machine.curves)
                or self.has_user_code
                or any(isinstance(law, Table) for law in laws)
                or any(isinstance(getattr(d, "law", None), Expression) for d in machine.drivers)
                or any(type(element).__name__ in LIMITED for element in elements)
            )

        return self.once("law doubts", limited)

    def law_of(self, element: Element, field: str = "law", design: int | None = None) -> Law:
        """A law of a driver or a load with the numbers that this system has, or one of its designs.

        Raises
        ------
        ModelError
            When the numbers are a batch and no design is named; of a driver that follows positions
            or auxiliary states, which has no law of time.
        """
        law: Any = getattr(element, field)
        if isinstance(element, Driver) and isinstance(law, MeasuredFormula):
            whole = self if design is None else self.design(design)
            return driven_law(element, self.mechanism, whole.numbers)
        own = law.numbers()
        name = f"{element.name}.{field}"
        plain = set(own) == {"value"}
        current = {k: self.values[name if plain else f"{name}.{k}"] for k in own}
        if design is not None:
            current = {k: v[design] if np.ndim(v) else v for k, v in current.items()}
        result: Law = law.with_numbers(current)
        return result

    def with_values(
        self, values: Mapping[str, PlainNumbers] | None = None, /, **more: PlainNumbers
    ) -> System:
        """A system of equal topology with other numbers: one set, or a batch.

        Parameters
        ----------
        values : mapping
            Dotted names (``"crank.mass"``, ``"coupler.B.x"``, ``"motor.law.speed"``) and parameters
            to floats or to arrays (batch,), all of one length. Parameters may be given as keywords;
            what is made of them follows. The name of an input, or of a load of one number, means
            its value.

        Returns
        -------
        System
            Sharing the symbolic phase; with arrays it has a batch axis.

        Raises
        ------
        ModelError
            For a name that the mechanism does not have, a number that is not finite, a negative
            mass, or arrays of different lengths.
        """
        if values is not None and not isinstance(values, Mapping):
            raise ModelError(f'values must be a dict such as {{"crank.mass": 2.0}}, not {values!r}')
        given = {self.number_name(k): v for k, v in {**(values or {}), **more}.items()}
        merged = dict(self.values)
        batch = self.batch
        for name, value in given.items():
            merged[name] = array = self._checked(name, value)
            if array.ndim:
                if batch not in (None, len(array)):
                    raise ModelError(
                        f"'{name}' has {len(array)} values, others have {batch}: give arrays of "
                        "one length",
                        name,
                    )
                batch = len(array)
        formulas = {name: f for name, f in self.formulas.items() if name not in given}
        merged |= self._following(given, merged, formulas)
        par, mass = self._compile(merged)
        return replace(self, values=merged, formulas=formulas, par=par, mass=mass, batch=batch)

    def number_name(self, name: str) -> str:
        """The dotted name of a number; the name of an element of one value is that of the value."""
        value = f"{name}.value"
        return value if name not in self.values and value in self.values else name

    def _following(
        self, given: Mapping[str, Any], values: Mapping[str, Any], formulas: Mapping[str, Formula]
    ) -> dict[str, Any]:
        """Numbers that change with the parameters among those given."""
        parameters = self.mechanism.parameters
        varied = {name for name in given if name in parameters}
        if not varied:
            return {}
        fixed = sorted(varied & self.mechanism.fixed_parameters)
        if fixed:
            raise ModelError(
                f"parameter '{fixed[0]}' is used in a table, a program, a guess or g of "
                f"'{self.mechanism.name}', which a system cannot change: describe the mechanism "
                "again with another value",
                fixed[0],
            )
        # a parameter made of others follows them, unless it was given a value of its own
        own = {name for name in parameters if name in varied or name not in formulas}
        scope = parameters.scope({name: values[name] for name in own})
        found: dict[str, Any] = {}
        for name, formula in formulas.items():
            if name in parameters:
                found[name] = scope.names[name].value
            else:
                try:
                    found[name] = self._checked(name, formula.value(scope))
                except FormulaError as error:
                    raise ModelError(f"'{name}': {error}", name) from None
        return found

    def _checked(self, name: str, value: Any) -> np.ndarray:
        if name not in self.values:
            raise ModelError(no_such_number(str(name), self.mechanism, self.values), str(name))
        try:
            array = np.asarray(value)
            if array.dtype.kind not in "iuf":
                raise TypeError
            array = array.astype(np.float64)
        except (TypeError, ValueError):
            raise ModelError(
                f"'{name}' must be a number or an array, not {value!r}", name
            ) from None
        if array.ndim > 1 or array.size == 0:
            raise ModelError(
                f"'{name}' must be a number or one row of them, not of shape {array.shape}", name
            )
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            which = f"'{name}'[{bad[0]}]" if array.ndim else f"'{name}'"
            raise ModelError(f"{which} is {array.flat[bad[0]]}, it must be finite", name)
        sign, unit = self.rule(name) if array.min() <= 0.0 else ("", "")
        if (sign == "positive") or (sign and array.min() < 0.0):
            rule = "not be negative: give 0 or more"
            if sign == "positive":
                rule = "be positive: give more than 0"
            raise ModelError(f"'{name}' is {array.min():g} {unit}, it must {rule}", name)
        return array[()]  # a float where it is one number

    def rule(self, name: str) -> tuple[str, str]:
        """Requirement on a number, "positive", "not negative" or nothing, and its unit."""
        element, _, key = name.partition(".")
        unit = self.mechanism.units.of
        if not key:
            return "", ""
        for part in fields(self.mechanism[element]):
            data = part.metadata
            if part.name == key and data.get("sign", "any") != "any":
                return str(data["sign"]), unit(data.get("dimension") or data["law"])
        return "", ""

    @property
    def record_rows(self) -> int:
        """Count of the numbers that are kept of an instant (`mbody.kernels.layout`)."""
        L = self.layout
        return self.friction_rows.stop + L.owns + len(L.input_row)

    @property
    def friction_rows(self) -> slice:
        """Where what is known of all friction pairs is among them (`mbody.kernels.friction`): empty
        where there are none.
        """
        first = 3 * self.coordinates + PER_PRIMITIVE * len(self.owners)
        return slice(first, first + (FRICTION_NUMBERS if len(self.layout.friction_kind) else 0))

    @property
    def auxiliary_rows(self) -> slice:
        """Where auxiliary states, then inputs, are among the numbers that are kept of
        an instant.
        """
        last = self.record_rows
        return slice(last - self.layout.owns - len(self.layout.input_row), last)

    @property
    def state_count(self) -> int:
        """Coordinates, their rates and auxiliary states: the numbers that a free
        motion integrates.
        """
        return 2 * self.coordinates + self.layout.owns

    @functools.cached_property
    def first_states(self) -> np.ndarray:
        """Starts of the auxiliary states, (states, sets); zero of those that begin where they are
        steady, until that is found.
        """
        rows = [self.values.get(one.start_number, 0.0) for one in self.mechanism.states]
        found = np.zeros((len(rows), self.batch or 1))
        for row, value in zip(found, rows, strict=True):
            row[:] = value
        return found

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the description, which every result has."""
        from mbody.model.model_notes import model_notes

        found: tuple[str, ...] = self.once("notes", lambda: model_notes(self.mechanism))
        return found

    def once(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """Value that depends on the topology and the description alone, made when it is first
        needed.
        """
        if key not in self.plans:
            self.plans[key] = make()
        return self.plans[key]

    def kernel_numbers(self, values: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
        """The rows of `par` and `mass` that belong to numbers by dotted name, all of them, each of
        any kind that computes as floats do; what joints refuse is not looked for.
        """
        return self._columns(dict(values))

    def design(self, index: int) -> System:
        """One set of a batch as a system of its own; a system of one set is its own design 0."""
        count = self.batch or 1
        if not hasattr(index, "__index__") or not -count <= index < count:
            raise ModelError(f"there is no design {index!r}: give 0 to {count - 1}")
        pick = {k: (v[index] if np.ndim(v) else v) for k, v in self.values.items()}
        column = slice(index, index + 1) if index >= 0 else slice(index, index + 1 or None)
        return replace(
            self, values=pick, par=self.par[:, column], mass=self.mass[:, column], batch=None
        )

    def work(self, lanes: int = 1, designs: Any = 0, *, masses: bool = False) -> Work:
        """A workspace filled with the numbers of the designs, one a lane.

        `masses` chooses the masses as weights (free motion) instead of geometric ones.
        """
        L = self.layout
        frame, column = self.blank(lanes)
        work = Work(frame, frame.blank())
        work.memory[:] = column
        if self.batch is not None:
            work.par[:] = self.par[:, np.broadcast_to(designs, lanes)]
            work.mass[:] = self.mass[:, np.broadcast_to(designs, lanes)]
            if L.owns:
                work.own[:] = self.first_states[:, np.broadcast_to(designs, lanes)]
        if masses:
            work.weight[: 3 * L.slots] = inverse_masses(L, work.mass, self.sizes)
        return work

    @functools.cached_property
    def closed_positions(self) -> dict[Any, Any]:
        """First positions in which its loops were closed (`mbody.analysis.position`)."""
        return {}

    @functools.cached_property
    def derived(self) -> dict[Hashable, Any]:
        """What analyses have made of its description and numbers, and take again."""
        return {}

    @functools.cached_property
    def _blanks(self) -> dict[int, tuple[Frame, np.ndarray]]:
        """Fresh workspaces by number of lanes."""
        return {}

    def blank(self, lanes: int) -> tuple[Frame, np.ndarray]:
        """A workspace's frame, and what is the same at all positions, a column for every lane."""
        if lanes in self._blanks:
            return self._blanks[lanes]
        L = self.layout
        frame = frame_of(L, self.par.shape[0], self.signals, lanes)
        work = Work(frame, frame.blank())
        work.par[:], work.mass[:] = self.par[:, :1], self.mass[:, :1]
        if L.owns:
            work.own[:] = self.first_states[:, :1]
        work.size[:] = self.sizes
        work.turn[2 * L.bodies] = 1.0
        shares = np.bincount(L.slot_body, minlength=L.bodies)
        work.share[:] = 1.0 / shares[L.slot_body][:, None]
        columns = work.weight[: 3 * L.slots].reshape(L.slots, 3, lanes)
        columns[:, :2], columns[:, 2] = 1.0, (1.0 / self.lengths[L.slot_body] ** 2)[:, None]
        weights, pad, blocks = self.once(
            "fixed rows", lambda: fixed_rows(L, self.row_kinds, self.active_set_rows, self.lengths)
        )
        work.regularization_weight[: len(weights)] = weights
        work.pad[: len(pad)], work.block[: len(blocks)] = pad, blocks
        if lanes > 1:
            # kernels of many lanes store what varies; constants of the physics are stored here
            one = self.work()
            violation(self.runtime(), one)
            for name in ("block", "phi", "nu", "gamma"):
                getattr(work, name)[:] = getattr(one, name)
        self._blanks[lanes] = found = frame, work.memory[:, :1].copy()
        return found

    @functools.cached_property
    def active_set_rows(self) -> dict[int, int]:
        """Of the primitives of the active set their number among these."""
        return {int(e): n for n, e in enumerate(self.layout.active_set)}

    @functools.cached_property
    def row_table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of every row its primitive, its number in it, and whether it is an angle: joints in the
        order of the description, then drivers. Rows of the active set are not among them.
        """
        found = [
            (e, row, kind == "a")
            for primitives in self.primitives_of.values()
            for e in primitives
            for row, kind in enumerate(self.row_kinds[e])
            if e not in self.active_set_rows
        ]
        table = np.array(found, dtype=np.int64).reshape(-1, 3)
        return table[:, 0], table[:, 1], table[:, 2] == 1

    def runtime(self) -> Layout:
        """The layout with handles for the user's own functions, alive as long as the system."""
        return self._registered if self.has_user_code else self.layout

    @functools.cached_property
    def _registered(self) -> Layout:
        sizes = [len(self.layout.primitive_handle), len(self.layout.action_handle)]
        handles = [-1 if f is None else register(f) for _, f in self.functions]
        names = {h: name for h, (name, _) in zip(handles, self.functions, strict=True) if h >= 0}
        for handle in names:
            weakref.finalize(self, release, handle)
        object.__setattr__(self, "_user_names", names)
        a, b = sizes[0], sizes[0] + sizes[1]
        return self.layout.replaced(
            primitive_handle=integers(handles[:a]),
            action_handle=integers(handles[a:b]),
            law_handle=integers(handles[b:]),
        )

    def user_handles(self) -> list[int]:
        """Handles of the users' functions in this process."""
        return list(getattr(self, "_user_names", {}))

    def user_name(self, handle: int) -> str:
        """Name of the element whose function has that handle."""
        names: dict[int, str] = getattr(self, "_user_names", {})
        return names.get(handle, "?")

    def __getstate__(self) -> dict[str, Any]:
        # handles belong to this process: the callables travel, the handles do not
        own = ("_registered", "_user_names", "_blanks", "closed_positions", "derived")
        return {key: value for key, value in self.__dict__.items() if key not in own}


# -- Whether dense matrices of a system are made ----------------------------------------------

#: Rows, and pairs of coordinates, up to which dense matrices are made.
DENSE = 1500


def too_large(system: System) -> bool:
    """Whether dense matrices of a system would be out of proportion."""
    return max(system.rows, system.coordinates // 2) > DENSE


# -- A system with the numbers of another one --------------------------------------------------


def with_numbers_of(system: System, values: Mapping[str, Any]) -> System:
    """The system with other numbers, of those that it has; parameters first, so that what is made
    of them follows, and is not fixed by hand.
    """
    for own in (system.mechanism.parameters, system.values):
        differing = {
            name: values[name]
            for name in own
            if name in values and (np.ndim(values[name]) or system.values.get(name) != values[name])
        }
        system = system.with_values(differing) if differing else system
    return system
