"""The mechanism: what the user describes, element by element, through one door."""

from __future__ import annotations

import contextlib
import copy
import itertools
import reprlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar, cast

from mbody.core.former_names import refuses_former_arguments
from mbody.core.presentation import present
from mbody.errors import ModelError, brief
from mbody.laws import Law
from mbody.model.body import Body
from mbody.model.driver import Constraint, Driver
from mbody.model.element import (
    AuxiliaryState,
    Element,
    Marker,
    PointLike,
    check_name,
    listed,
    resolved,
)
from mbody.model.joints import Joint
from mbody.model.loads import Load
from mbody.quantities import Formula, FormulaError, Parameters
from mbody.quantities.formula import LeftOut, Number, evaluated, formulas_in, number
from mbody.quantities.units import DIMENSIONS, Dimension, UnitSystem, unit_system

if TYPE_CHECKING:
    from mbody.model.contact import Between, OneSided
    from mbody.model.coupling import Coupling
    from mbody.model.curves import NamedCurve
    from mbody.model.simulation import Instants, Measure, Question, SimulationSettings
    from mbody.model.states import Controller, Input, Quantity, State
    from mbody.model.stop import Stop
    from mbody.model.touching_shapes import ShapeLike
    from mbody.quantities.output_units import OutputUnits

# -- Equality of mechanisms: all that one describes --------------------------------------------


def _stated(machine: Any, value: Any) -> Any:
    """A number or formula; the unit of plain angles only where it is one."""
    if not isinstance(value, Formula):
        return value
    scope = machine.parameters.scope()
    angle = value.dimension == DIMENSIONS["angle"] and not value.has_units(scope)
    return value if angle else replace(value, angle="")


def _worth(machine: Any, value: Any, dimension: Dimension | None) -> Any:
    """A formula's value as a number where it depends on no parameters."""
    if not isinstance(value, Formula):
        return value
    own = replace(value, dimension=dimension)
    with contextlib.suppress(FormulaError):
        if not machine.parameters.used_by(own):
            return own.value(machine.parameters.scope())
    return _stated(machine, own)


def _simulated(machine: Any) -> Any:
    """The motion that `simulate` is set to."""
    settings = machine.simulation
    if settings is None:
        return None
    angle = DIMENSIONS["angle"]
    start = {
        body: {k: _worth(machine, v, angle if k == "angle" else None) for k, v in given.items()}
        for body, given in settings.start.items()
    }
    until = _worth(machine, settings.until, None)
    return settings.rtol, settings.instants, until, start, settings.events


def whole(machine: Any) -> tuple[Any, ...]:
    """All that a `Mechanism` describes: every number to the last digit, what follows parameters,
    the order.
    """
    following = {
        name: _stated(machine, formula)
        for name, formula in machine.formulas.items()
        if machine.parameters.used_by(formula)
    }
    angular = [d for d in machine.drivers if d.angular]
    angles = {name for d in angular for name in (d.name, getattr(d, "body", d.name))}
    given = [machine.ask.at if machine.ask else {}]
    given += [question.at for question in machine.questions.values()]
    positions = [
        {
            name: [_worth(machine, v, DIMENSIONS["angle"] if name in angles else None) for v in row]
            for name, row in at.items()
        }
        for at in given
    ]
    sought = {
        name: [
            (one.name, one.unit, [_worth(machine, p, None) for p in (one.start, one.low, one.high)])
            for one in question.unknowns
        ]
        for name, question in machine.questions.items()
    }
    title = machine.name, machine.units, machine.g, machine.ground, machine.source, machine.note
    elements = machine.bodies, machine.joints, machine.couplings, machine.drivers, machine.loads
    quantities = {one.name: one for one in machine.quantities}
    signals = machine.inputs, machine.described_states, quantities, machine.controllers
    parameters = {name: _stated(machine, value) for name, value in machine.parameters.items()}
    instants = machine.ask and replace(machine.ask, at={})
    questions = {n: replace(q, unknowns="x", at={}) for n, q in machine.questions.items()}
    studies = machine.measures, instants, positions, sought, _simulated(machine), questions
    contacts = machine.curves, machine.contacts, machine.groups
    shown = machine.output_units
    return (*title, *elements, *signals, *contacts, parameters, following, *studies, shown)


E = TypeVar("E", bound=Element)

#: Roles of what is neither a body nor a constraint nor a load.
DESCRIBED = ("input", "state", "quantity", "controller")


class Mechanism:
    """A planar mechanism: bodies, joints, drivers and loads, added one by one.

    Parameters
    ----------
    name : str
        Title of the mechanism.
    units : str
        Name of the consistent unit system of all numbers: ``"SI"``, ``"mm-N-s"``, ``"in-lbf-s"``
        (masses in blob) or ``"ft-lbf-s"`` (slug). Angles are radians.
    g : float, optional
        Turns weights into masses [length/time²], by default standard gravity. No gravity acts
        unless a `Gravity` load is added.
    ground : dict
        Named points of the fixed link, pairs (x, y) [length].
    parameters : dict
        Named numbers that text in elements may use, as in ``Body("crank", points={"A": ("2*a",
        0)})``; each a number, or text such as ``"15 in"`` or a formula of the others.
    measures : dict
        Quantities to be measured on every result, by name: text such as ``"coupler.P.y"``, or a
        `Measure`.
    questions : dict, optional
        Questions by name, which `solve_for` answers: a `Question` each.
    ask : Instants, optional
        The instants that the command analyses where nobody says otherwise.
    simulation : SimulationSettings, optional
        The motion that `simulate` follows where nobody says otherwise.
    source, note : str
        Where it comes from, and what to look at.
    curves : dict, optional
        Tables and other laws that formulas call by name: ``{"torque": Table(…)}`` as
        ``"torque(crank.omega)"``, a `Table2` with two numbers.
    ground_shapes : dict, optional
        Shapes of the fixed link, which contacts touch; as of a `Body`.
    output_units : dict, optional
        Units of results by quantity, where they are not to be those of the system: ``{"mass": "kg",
        "speed": "rpm", "torque": "N*m"}``. Without it what people read has kilograms, watts and
        degrees, and numbers for programs are in the units of the system.

    Examples
    --------
    >>> from mbody import AngleDriver, Body, Mechanism, Revolute
    >>> crank = Body("crank", mass=2.0, inertia=0.1)
    >>> machine = Mechanism("a crank")
    >>> machine.add(crank, Revolute("O", "ground", "crank"), AngleDriver("motor", "crank", 0.5))
    >>> len(machine.joints)
    1
    """

    @refuses_former_arguments("Mechanism")
    def __init__(
        self,
        name: str = "mechanism",
        *,
        units: str | UnitSystem = "SI",
        g: Number | None = None,
        ground: Mapping[str, PointLike] | None = None,
        parameters: Mapping[str, Number] | None = None,
        measures: Mapping[str, Measure | str] | None = None,
        questions: Mapping[str, Question] | None = None,
        ask: Instants | None = None,
        simulation: SimulationSettings | None = None,
        source: str = "",
        note: str = "",
        curves: Mapping[str, Law] | None = None,
        ground_shapes: Mapping[str, ShapeLike] | None = None,
        output_units: Mapping[str, str] | None = None,
    ) -> None:
        for key, text in (("title", name), ("source", source), ("note", note)):
            if not isinstance(text, str):
                raise ModelError(f"the {key} of a mechanism must be text, not {text!r}")
        self.name = name
        self.units = unit_system(units)
        self.output_units = output_units or {}
        self.parameters = Parameters({} if parameters is None else parameters, self.units)
        self.source, self.note, self.ask, self.simulation = source, note, ask, simulation
        self.measures = {key: _measure(key, value) for key, value in (measures or {}).items()}
        self.questions = dict(questions or {})
        #: What numbers were made of that were given as text, by dotted name.
        self.formulas: dict[str, Formula] = {}
        #: Parameters used where a system cannot change them, as in a table or a guess.
        self.fixed_parameters: set[str] = set()
        #: Curves that formulas call, by name.
        self.curves: dict[str, NamedCurve] = {}
        if curves:
            self._take_curves(curves)
        #: What was perhaps meant otherwise in the file it was read from, for the notes of results.
        self.file_notes: tuple[str, ...] = ()
        self.g = LeftOut(self.units.g) if g is None else self._gravity(g)
        if self.g <= 0.0:
            raise ModelError(
                f"'{self.name}': g is {self.g:g} {self.units.of('acceleration')}, it must be "
                "positive: it only turns weights into masses, a Gravity load has the direction",
                self.name,
            )
        points = {} if ground is None else ground
        shapes = {} if ground_shapes is None else ground_shapes
        self.ground = self._resolved(Body("ground", points=points, shapes=shapes))
        self._elements: dict[str, Element] = {}
        self._sorted: dict[type | str, tuple[Any, ...]] | None = None
        self._groups: dict[str, Between] = {}  # as they were given
        #: States that elements bring, kept when the mechanism is closed.
        self._brought: tuple[AuxiliaryState, ...] | None = None

    @property
    def output_units(self) -> dict[str, str]:
        """Units of results by quantity, as they were chosen."""
        return dict(self._output_units)

    @output_units.setter
    def output_units(self, given: Mapping[str, str]) -> None:
        if not isinstance(given, Mapping):
            raise ModelError(
                f"'{self.name}': output_units names units by quantity, such as "
                f"{{'mass': 'kg'}}, not {given!r:.60}"
            )
        if given:
            from mbody.quantities.output_units import OutputUnits

            OutputUnits(self.units).having(given)  # refuses what is no unit
        self._output_units = dict(given)

    @property
    def data_units(self) -> OutputUnits:
        """Units of numbers for programs: those of the system, and what is chosen."""
        from mbody.quantities.output_units import OutputUnits

        return OutputUnits(self.units).having(self._output_units)

    @property
    def shown(self) -> OutputUnits:
        """Units of what people read: sheets, reports, pages and pictures."""
        from mbody.quantities.output_units import read_by_people

        return read_by_people(self.units).having(self._output_units)

    def _take_curves(self, curves: Any) -> None:
        from mbody.model.curves import as_curves

        self.curves = as_curves(curves, self.parameters.scope())
        self.parameters.with_curves({key: one.as_value() for key, one in self.curves.items()})
        for one in self.curves.values():
            for _, formula in formulas_in(one.given):
                self.fixed_parameters |= self.parameters.used_by(formula)

    def _gravity(self, g: Any) -> float:
        """The number that turns weights into masses; its parameters cannot be changed later."""
        given = number(g, "acceleration", self.name, "g")
        if isinstance(given, Formula):
            self.fixed_parameters |= self.parameters.used_by(given)
        return float(evaluated(given, self.parameters.scope(), self.name, "g"))

    def copied(self) -> Mechanism:
        """A mechanism of the same elements that takes more of them."""
        made = copy.copy(self)
        made._sorted = None
        return made

    def __copy__(self) -> Mechanism:
        made = object.__new__(type(self))
        made.__dict__ |= self.__dict__
        made._elements, made.formulas = dict(self._elements), dict(self.formulas)
        made.fixed_parameters, made.measures = set(self.fixed_parameters), dict(self.measures)
        made.questions = dict(self.questions)
        made._brought = None
        return made

    def add(self, *elements: Element) -> None:
        """Add elements; a body comes before what refers to it.

        Parameters
        ----------
        *elements : Body, Joint, Coupling, Driver or Load
            Any number of them. All are added, or none where one is refused.

        Raises
        ------
        ModelError
            When a name is taken, or a body or point that an element refers to does not exist.
        """
        if self._sorted is not None:
            raise ModelError(
                f"'{self.name}' has been assembled: add to the mechanism that you described, and "
                "assemble it again"
            )
        if len(elements) == 1:  # added as a whole, or not at all
            return self._add(elements[0])
        fixed, added = set(self.fixed_parameters), set()
        try:
            for element in elements:
                self._add(element)
                added.add(element.name)
        except ModelError:
            own = {k: v for k, v in self.formulas.items() if k.partition(".")[0] not in added}
            self.formulas, self.fixed_parameters = own, fixed
            for name in added:
                del self._elements[name]
            raise

    @property
    def is_closed(self) -> bool:
        """Whether it belongs to a system, so that nothing can be added."""
        return self._sorted is not None

    def closed_with(
        self, elements: Iterable[Element], formulas: Mapping[str, Formula] | None = None
    ) -> Mechanism:
        """A copy of these elements alone, closed to additions; by default all numbers follow what
        they followed.
        """
        made = copy.copy(self)
        made._elements = {element.name: element for element in elements}
        made.formulas = dict(self.formulas if formulas is None else formulas)
        made._sorted = {}
        return made

    def described_group(self, name: str) -> Between:
        """A group of contacts with the text that its numbers were made of."""
        return self._groups[name]

    def contacts_of(self, group: str) -> tuple[OneSided, ...]:
        """The contacts that stand in the place of a group of contacts in a system; none where it is
        not there, or is an element itself.
        """
        if group not in self._groups or group in self._elements:
            return ()
        known = {one.name: one for one in self.contacts}
        own = (f"{group}_{n}" for n in itertools.count(1))
        return tuple(known[name] for name in itertools.takewhile(known.__contains__, own))

    def element_or_group(self, name: str) -> Any:
        """The element of that name, or the group of contacts in whose place single ones are."""
        return self._groups[name] if self.contacts_of(name) else self[name]

    def without(self, *drivers: str) -> Mechanism:
        """A copy without some of its drivers, whose coordinates are then free; measures, questions
        and instants that name them are left out.

        Raises
        ------
        ModelError
            For a driver that is not there, or that the formula of a load or a state measures.
        """
        from mbody.model.simulation import measures_without

        known = [driver.name for driver in self.drivers]
        for name in drivers:
            if name not in known:
                other = f": it is a {self[name].role}" if name in self else ""
                raise ModelError(
                    f"there is no driver {brief(name)} to release{other} (drivers are: "
                    f"{listed(known) or 'none'})",
                    str(name),
                )
        others = [driver for driver in self.drivers if driver.name not in drivers]
        from mbody.model.states import check_unmeasured

        measuring = (*self.loads, *self.described_states, *self.quantities, *others)
        check_unmeasured(measuring, self.formulas, set(drivers))
        made = copy.copy(self)
        made._sorted, gone = None, set(drivers)
        driven = gone.union(*(driver.bodies for driver in self.drivers if driver.name in gone))
        for name in gone:
            del made._elements[name]
        made.formulas = {k: v for k, v in self.formulas.items() if k.partition(".")[0] not in gone}
        made.measures = measures_without(self.measures, gone)
        gone |= self.measures.keys() - made.measures.keys()
        made.questions = {
            key: question
            for key, question in self.questions.items()
            if gone.isdisjoint(question.names) and driven.isdisjoint(question.at)
        }
        if self.simulation is not None:
            made.simulation = self.simulation.without(gone)
        if self.ask is not None and (self.ask.over or not self.ask.at.keys() <= {"t"}):
            made.ask = None  # it asks for the drivers that there were
        return made

    def _add(self, element: Element) -> None:
        described = isinstance(element, Element) and element.role in DESCRIBED
        if not (described or isinstance(element, (Body, Constraint, Load))):
            remedy = ""
            if isinstance(element, (list, tuple)):
                remedy = ": give them one by one, add(*elements)"
            elif isinstance(element, type):
                remedy = f": make one, {element.__name__}(...)"
            raise ModelError(
                "a mechanism takes bodies, joints, couplings, drivers, loads, inputs, states, "
                f"quantities and controllers, not {reprlib.repr(element)}{remedy}"
            )
        group = _groups_in((element,))
        for one in group:
            one.refuse_empty((*self.bodies, self.ground))
        name = element.name
        if name in self._elements or name == "ground":
            what = type(self._elements[name]).__name__ if name in self._elements else "fixed link"
            raise ModelError(
                f"the name '{name}' is taken by a {what}: names are unique, choose another", name
            )
        if element.role in ("input", "state", "quantity"):
            from mbody.model.states import check_formula_name

            check_formula_name(element, self.parameters)
        if element.role == "controller":
            from mbody.model.states import check_sets

            check_sets(cast(Any, element), self.inputs, self.controllers)
        if element.role != "body":
            for marker in element.places().values():
                self._find(marker, name)
            for body in getattr(element, "bodies", ()):
                self._find(Marker(body, (0.0, 0.0)), name)
        self._elements[name] = element  # its own formulas may measure it
        try:
            self._elements[name] = self._resolved(element)
        except ModelError:
            del self._elements[name]
            raise
        if group:
            self._groups = {**self._groups, name: group[0]}

    def _resolved(self, element: E) -> E:
        """The element with floats for its text; what they were made of is kept."""
        scope = self.parameters.scope()
        whole: Any = element
        if element.role == "state":
            whole, formulas = whole.entered(scope)
            self.formulas |= formulas
            return cast(E, whole)
        if element.role == "quantity":
            whole, formulas = whole.compiled(self, scope)
            self.formulas |= formulas
            return cast(E, whole)
        if element.role == "input":
            whole = whole.measured(scope)
        if element.role == "contact" and hasattr(element, "with_shapes"):
            whole = whole.with_shapes({name: self[name] for name in whole.bodies}, self.curves)
        made: E
        made, formulas, fixed = resolved(whole, scope, self._measured)
        self.formulas |= formulas
        self.fixed_parameters |= fixed & self.parameters.keys()
        return made

    def _measured(self, names: frozenset[str]) -> dict[str, Dimension | None]:
        """Those of the names in a formula that are measured in a motion."""
        if not names:
            return {}
        from mbody.model.states import measured_names

        return measured_names(self, names)

    def _find(self, marker: Marker, element: str) -> None:
        body = self.ground if marker.body == "ground" else self._elements.get(marker.body)
        if not isinstance(body, Body):
            known = listed(["ground", *(b.name for b in self.bodies)])
            raise ModelError(
                f"'{element}' refers to body {brief(marker.body)}, which is not there (there are: "
                f"{known}): add bodies first",
                element,
            )
        if isinstance(marker.point, str) and marker.point not in body.points:
            raise ModelError(
                f"'{element}' refers to point {brief(marker.point)} of '{marker.body}', which is "
                f"not there (it has: {listed(body.points)}): name one of these, or add it to the "
                "body",
                element,
            )

    def _elements_of(self, kind: type[E]) -> tuple[E, ...]:
        if self._sorted is None:
            return tuple(e for e in self._elements.values() if isinstance(e, kind))
        if kind not in self._sorted:
            found = tuple(e for e in self._elements.values() if isinstance(e, kind))
            self._sorted[kind] = found
        return self._sorted[kind]

    def _of_role(self, role: str) -> tuple[Any, ...]:
        """Those of a role whose class most mechanisms do without, so that it need not be loaded."""
        if self._sorted is None:
            return tuple(e for e in self._elements.values() if e.role == role)
        if role not in self._sorted:
            self._sorted[role] = tuple(e for e in self._elements.values() if e.role == role)
        return self._sorted[role]

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The moving bodies, in the order of the description."""
        return self._elements_of(Body)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints, in the order of the description."""
        return self._elements_of(Joint)

    @property
    def couplings(self) -> tuple[Coupling, ...]:
        """The couplings, in the order of the description."""
        return self._of_role("coupling")

    @property
    def drivers(self) -> tuple[Driver, ...]:
        """The drivers, in the order of the description."""
        return self._elements_of(Driver)

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """Joints, couplings, contacts and ropes that are closed for good, drivers, and all other
        contacts and ropes, in this order.
        """
        contacts = self.contacts
        closed = [one for one in contacts if one.closed]
        others = [one for one in contacts if not one.closed]
        return (*self.joints, *self.couplings, *closed, *self.drivers, *others)

    @property
    def contacts(self) -> tuple[OneSided, ...]:
        """The contacts and ropes, in the order of the description."""
        found = self._of_role("contact")
        if not found:
            return ()
        from mbody.model.contact import Between

        return tuple(one for one in found if not isinstance(one, Between))

    @property
    def groups(self) -> tuple[Between, ...]:
        """The groups of contacts, in the order of the description."""
        return _groups_in(self._of_role("contact"))

    @property
    def stops(self) -> tuple[Stop, ...]:
        """The stops, which are contacts too, in the order of the description."""
        found = self._of_role("contact")
        if not found:
            return ()
        from mbody.model.stop import Stop

        return tuple(one for one in found if isinstance(one, Stop))

    @property
    def loads(self) -> tuple[Load, ...]:
        """The loads, in the order of the description."""
        return self._elements_of(Load)

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The inputs, in the order of the description."""
        return self._of_role("input")

    @property
    def controllers(self) -> tuple[Controller, ...]:
        """The sampled controllers, in the order of the description."""
        return self._of_role("controller")

    @property
    def described_states(self) -> tuple[State, ...]:
        """The states of the user's own, in the order of the description."""
        return self._of_role("state")

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The named quantities, in the order of the description."""
        return self._of_role("quantity")

    @property
    def states(self) -> tuple[State | AuxiliaryState, ...]:
        """The states that are integrated with the motion: those that the user described, then
        those that elements bring, in the order of the description.
        """
        if self._brought is None or self._sorted is None:
            found = (element.auxiliary_states() for element in self._elements.values())
            self._brought = tuple(itertools.chain.from_iterable(found))
        return (*self._of_role("state"), *self._brought)

    def __getitem__(self, name: str) -> Element:
        if isinstance(name, str) and name in self._elements:
            return self._elements[name]
        if isinstance(name, str) and name == "ground":
            return self.ground
        raise ModelError(
            f"'{self.name}' has no element {name!r} (it has: {listed(self._elements)})", str(name)
        )

    def __contains__(self, name: object) -> bool:
        return name in self._elements

    def __iter__(self) -> Iterator[Element]:
        return iter(self._elements.values())

    def _repr_html_(self) -> str:
        # what a notebook shows
        return str(present("notebook", self))

    def __repr__(self) -> str:
        parts = (
            (len(self.bodies), "body", "bodies"),
            (len(self.joints), "joint", "joints"),
            (len(self.drivers), "driver", "drivers"),
            (len(self.loads), "load", "loads"),
            (len(self.contacts), "contact", "contacts"),
            (len(self.groups), "group of contacts", "groups of contacts"),
            (len(self.inputs), "input", "inputs"),
            (len(self.described_states), "state", "states"),
            (len(self.quantities), "quantity", "quantities"),
        )
        counts = ", ".join(
            f"{n} {one if n == 1 else more}"
            for k, (n, one, more) in enumerate(parts)
            if n or k < 4  # most mechanisms have no inputs and no states of their own
        )
        return f"Mechanism({self.name!r}: {counts}, {self.units.name})"

    def __eq__(self, other: object) -> bool:
        """Whether both describe the same: every number to the last digit, what follows parameters,
        and the order.
        """
        if not isinstance(other, Mechanism):
            return NotImplemented
        return whole(self) == whole(other)


def _groups_in(elements: tuple[Any, ...]) -> tuple[Between, ...]:
    """The groups of contacts among elements."""
    if not any(one.role == "contact" for one in elements):
        return ()
    from mbody.model.contact import Between

    return tuple(one for one in elements if isinstance(one, Between))


def _measure(name: Any, value: Any) -> Measure:
    from mbody.model.simulation import Measure

    check_name(name, "measure")
    return value if isinstance(value, Measure) else Measure(value)
