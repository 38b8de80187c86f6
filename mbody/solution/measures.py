"""Measured quantities: formulas of the histories of a result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.driver import DRIVEN
from mbody.model.element import listed
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.model.own_equations import owned
from mbody.model.reductions import reduce_history
from mbody.model.state_quantities import MOTION, ORIGIN, TURNING
from mbody.model.study import Measure
from mbody.quantities import (
    VARIABLES,
    FormulaError,
    Scope,
    Valued,
    dimension_text,
    evaluate,
    parse,
    parse_unit,
)
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of
from mbody.solution.drive_histories import prescribed_rate
from mbody.solution.own_histories import own_history
from mbody.solution.places import column, ends, velocity
from mbody.solution.result import Result

__all__ = [
    "ORIGIN",
    "check_measure",
    "checked_sides",
    "found_by",
    "measured",
    "quantity",
    "sides",
    "valued",
]

#: What joints have of forces.
REACTION = ("fx", "fy", "force", "torque", "loss", "contact")


def measured(solution: Result, measure: Measure | str) -> tuple[np.ndarray, Dimension, str]:
    """History of a quantity, its dimension and the unit that it is in.

    Parameters
    ----------
    solution : Result
        Of any analysis; forces only of one that finds them.
    measure : Measure or str
        Such as ``"coupler.P.y - ground.O2.y"``: of bodies x, y, angle, their rates vx, vy, omega
        and ax, ay, alpha; of points x to ay, ``coupler.origin`` being that of the link's axes; of
        joints fx, fy, torque (on body j) and force, the magnitude, and the loss of rough ones; of
        loads the same, of springs
        and dampers their tension and length or their torque and angle, and the rate; of drivers
        effort, power, value, rate and acceleration; ``t``; the parameters. What is one number of
        all instants, as ``"peak(A.force)"``, is the same at each.

    Returns
    -------
    values : ndarray (instants,)
        Angles without a unit of their own in rad; (designs, instants) of a batch.
    dimension : Dimension
    unit : str

    Raises
    ------
    ModelError
        For a name that the mechanism does not have, or units that do not fit.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.slider_crank(1.0, 3.0, speed=2.0))
    >>> values, _, unit = measured(run, "rod.B.x - rod.A.x")
    >>> round(float(values[0]), 6), unit
    (2.872281, 'm')
    """
    wanted = measure if isinstance(measure, Measure) else Measure(measure)
    value, dimension, unit = valued(solution, wanted.history)
    shape = solution.t.shape
    if solution.record.batch:
        shape = (solution.record.count, *shape)
    values = np.broadcast_to(np.asarray(value, dtype=float), shape)
    if wanted.by:
        count = shape[-1]
        if wanted.by == "at" and not -count <= wanted.instant < count:
            raise ModelError(
                f"measure {wanted.of!r}: there is no such instant, they are 0 to {count - 1}"
            )
        t = np.asarray(solution.t) / solution.mechanism.units.second
        one = reduce_history(wanted.by, wanted.instant, values, t)
        values = np.broadcast_to(one[..., None], shape)
    return values, dimension, unit


def valued(solution: Result, measure: Measure) -> tuple[Any, Dimension, str]:
    """What a measure is, as its formula gives it: a number where it does not change, and of any
    kind that the histories of the result are of.
    """
    names = _Histories(
        solution.mechanism,
        lambda *name: _history(solution, *name),
        lambda name, _: column(solution.system.values[name]),
    )
    names["t"] = Valued(solution.t, DIMENSIONS["time"])
    for name in solution.mechanism.parameters:
        # as the system has it, a column where it differs between designs
        own = column(solution.system.values[name])
        names[name] = replace(names[name], value=own)
    return _valued(measure, names)


def quantity(solution: Result, owner: str, key: str) -> tuple[Any, Dimension]:
    """The history of what a result has by name, such as x of a body or fx of a joint, and its
    dimension.
    """
    return _history(solution, owner, key), _dimension(solution.mechanism, owner, key)


def check_measure(mechanism: Mechanism, measure: Measure) -> str:
    """Refuse a history that names what the mechanism has not, or whose units do not fit; of others
    the unit that values are in.

    Raises
    ------
    ModelError
        Such as `measured` raises later, or for what is one number of all instants.
    """
    return _valued(measure, _Histories(mechanism, lambda *name: 1.0))[2]


def sides(solution: Result, left: str, right: str) -> tuple[np.ndarray, np.ndarray]:
    """Histories of both sides of a relation between quantities that `checked_sides` let pass."""
    return measured(solution, left)[0], measured(solution, right)[0]


def checked_sides(mechanism: Mechanism, text: str, left: str, right: str) -> Dimension:
    """What the sides of a relation measure.

    Raises
    ------
    ModelError
        Such as `sides` raises later.
    """
    try:
        names = _Histories(mechanism, lambda *name: 1.0)
        (_, of_a, _), (_, of_b, _) = (_valued(Measure(side), names) for side in (left, right))
        _alike(left, of_a, right, of_b)
    except ModelError as error:
        raise ModelError(f"{brief(text, 100)}: {error}") from None
    return of_b if _is_zero(left) else of_a


def _alike(left: str, of_left: Dimension, right: str, of_right: Dimension) -> None:
    """Refuse two sides that do not measure the same; a plain zero may stand beside anything."""
    both = {of_left, of_right}
    alike = of_left.mechanical == of_right.mechanical and (len(both) == 1 or NUMBER not in both)
    if alike or _is_zero(left) or _is_zero(right):
        return
    raise ModelError(
        f"'{left}' is {dimension_text(of_left)}, '{right}' is {dimension_text(of_right)}: give "
        "every number its unit"
    )


def _is_zero(text: str) -> bool:
    try:
        return float(text) == 0.0
    except ValueError:
        return False


def found_by(solution: Result, measure: Measure) -> bool:
    """Whether the analysis found what a measure is made of; kinematics finds no forces."""
    if solution.has_forces:
        return True
    machine = solution.mechanism
    joints = {joint.name for joint in (*machine.joints, *machine.contacts)}
    drivers = {element.name for element in (*machine.drivers, *machine.couplings)}
    for name in measure.names:
        owner, _, key = name.rpartition(".")
        presses = owner in joints or bool(machine.contacts_of(owner))
        if (presses and key in REACTION) or (owner in drivers and key in ("effort", "power")):
            return False
    return True


def _valued(measure: Measure, names: _Histories) -> tuple[Any, Dimension, str]:
    """Value of a measure, its dimension and its unit."""
    if measure.by:
        raise ModelError(
            f"measure {measure.of!r} is one number of all instants: give what changes from instant "
            f"to instant, {measure.history.of!r}"
        )
    scope = Scope(names.mechanism.units, names)
    try:
        tree = parse(measure.of, curves=True)
        for name in sorted(tree.names):
            if name in names.mechanism and names.get(name) is None and scope.unit(name) is None:
                raise FormulaError(f"'{name}' has many histories: name one, as in '{name}.x'")
            if _unknown(name, names, scope):
                known = names.mechanism.parameters
                there = f"there are: {listed(known, 12)}" if known else "there are none"
                raise FormulaError(
                    f"there is no parameter '{name[:60]}' ({there}), and a history is named by its "
                    f"element, as {_example(names.mechanism)}"
                )
        found = evaluate(tree, scope, with_units=True)
        dimension = found.dimension or NUMBER
        if not measure.unit:
            return found.value, dimension, scope.system.of(dimension)
        one = evaluate(parse_unit(measure.unit), scope)
        if not 0.0 < one.value < np.inf:
            raise FormulaError(f"'{measure.unit}' is no unit")
        if one.dimension is None or one.dimension.mechanical != dimension.mechanical:
            raise FormulaError(
                f"it is {dimension_text(dimension)}, which '{measure.unit}' does not measure"
            )
        return found.value / one.value, dimension, measure.unit
    except FormulaError as error:
        raise ModelError(f"measure {measure.of!r}: {error}") from None


def _unknown(name: str, names: _Histories, scope: Scope) -> bool:
    """Whether a name is none of a history, a number, or a unit."""
    plain = "." not in name and name not in ("pi", *VARIABLES)
    return plain and names.get(name) is None and scope.unit(name) is None


def _example(mechanism: Mechanism) -> str:
    """A history that the mechanism has, in quotes."""
    for elements, key in ((mechanism.drivers, "effort"), (mechanism.joints, "force")):
        for element in elements:
            return f"'{element.name}.{key}'"
    return next((f"'{body.name}.angle'" for body in mechanism.bodies), "'body.angle'")


class _Histories(dict[str, Valued]):
    """Names in a measure: parameters, time, and histories by name."""

    def __init__(
        self,
        mechanism: Mechanism,
        history: Callable[[str, str], Any],
        number: Callable[[str, Any], Any] = lambda name, value: value,
    ) -> None:
        super().__init__(mechanism.parameters.scope().names)
        self.number = number
        self.mechanism, self.history = mechanism, history
        #: Inputs and own states with what they measure.
        self.own = {one.name: one.dimension for one in mechanism.inputs}
        self.own |= {one.name: one.dimension for one in mechanism.states}
        self["t"] = Valued(1.0, DIMENSIONS["time"])

    def get(self, name: str, default: Any = None) -> Any:
        """The history of that name; `default` where it is none, a unit perhaps."""
        if name not in self and "." in name and name not in self.own:
            owner, _, key = name.rpartition(".")
            whole, fixed = _output(self.mechanism, owner, key), _fixed(self.mechanism, owner, key)
            if whole is not None:
                self[name] = self._of_output(owner, *whole)
                return self[name]
            if fixed is not None:
                self[name] = Valued(self._part(owner, name), fixed)
                return self[name]
            dimension = _dimension(self.mechanism, owner, key)
            self[name] = Valued(self.history(owner, key), dimension)
        elif name in self.own and name not in self:
            self[name] = Valued(self.history("", name), self.own[name])
        return super().get(name, default)

    def _of_output(self, owner: str, text: str, of: str) -> Valued:
        """A quantity that a load makes of its numbers, its rate and its states."""
        tree = owned(parse(text), owner)
        system = self.mechanism.units
        known = {name: self._part(owner, name) for name in tree.names}
        found = evaluate(tree, Scope(system, {key: Valued(part) for key, part in known.items()}))
        return Valued(found.value, dimension_of(of))

    def _part(self, owner: str, name: str) -> Any:
        """A number of a load, or one of its histories, by dotted name."""
        numbers = self.mechanism[owner].numbers()
        key = name.removeprefix(f"{owner}.")
        if name == "t":
            return self["t"].value
        if name in numbers:
            return self.number(name, numbers[name])
        return self.history(owner, key) if name not in self.own else self.history("", name)


def _output(mechanism: Mechanism, owner: str, key: str) -> tuple[str, str] | None:
    """The formula of a quantity that a load makes, and what it measures; None of any other."""
    if owner not in mechanism or mechanism[owner].role != "load":
        return None
    load: Any = mechanism[owner]
    found: tuple[str, str] | None = load.outputs().get(key)
    return found


def _fixed(mechanism: Mechanism, owner: str, key: str) -> Dimension | None:
    """What a number of a load measures, as its resistance; None of any other quantity."""
    if owner not in mechanism or mechanism[owner].role != "load":
        return None
    load: Any = mechanism[owner]
    if key in load.quantities() or getattr(load, key, None) is None:
        return None
    meta = load.__dataclass_fields__[key].metadata if key in load.__dataclass_fields__ else {}
    return dimension_of(meta["dimension"]) if "dimension" in meta else None


def _dimension(mechanism: Mechanism, owner: str, key: str) -> Dimension:
    """What the history `key` of a body, a point, a joint, a load or a driver measures;
    FormulaError where there is none.
    """
    element, _, point = owner.partition(".")
    known_name = element == "ground" or element in mechanism
    if not known_name and not mechanism.contacts_of(element):
        raise FormulaError(f"there is no body '{element}' (there are: {_bodies(mechanism)})")
    owned: Any = mechanism.element_or_group(element)
    if owned.role == "body":
        known = MOTION if point else MOTION | TURNING
        if point and point != ORIGIN and point not in owned.points:
            known_points = listed(owned.points)
            raise FormulaError(f"'{element}' has no point '{point}' (it has: {known_points})")
    elif point:
        raise FormulaError(f"there is no body '{element}' (there are: {_bodies(mechanism)})")
    else:
        known = owned.quantities()
        known |= {one.name.rpartition(".")[2]: one.measure for one in owned.own_states()}
        if not known:
            raise FormulaError(
                f"'{element}' acts on every body, it has no history of its own: measure what "
                "it does to a body from Python, run.load(name, on=body)"
            )
    if key not in known:
        raise FormulaError(f"'{owner}' has no '{key}' (it has: {', '.join(known)})")
    return dimension_of(known[key])


def _bodies(mechanism: Mechanism) -> str:
    return listed(["ground", *(body.name for body in mechanism.bodies)])


def _coordinate(run: Result, joint: Joint, key: str) -> Any:
    """The history of what measures the freedom of a joint."""
    i, j = (run[body] for body in joint.bodies)
    _, (dx, dy), angle_i, angle_j = ends(run, joint)
    if "angle" in joint.coordinates:
        return angle_j - angle_i if key == "angle" else j.omega - i.omega
    ux, uy = np.cos(angle_i), np.sin(angle_i)
    if key == "travel":
        return ux * dx + uy * dy
    (vix, viy), (vjx, vjy) = (velocity(run, joint, side) for side in ("i", "j"))
    turning = i.omega * (ux * dy - uy * dx)
    return ux * (vjx - vix) + uy * (vjy - viy) + turning


def _history(run: Result, owner: str, key: str) -> Any:
    """The history of a body, a point, a joint, a load or a driver; of an input or an own state,
    which has no owner.
    """
    if not owner:
        return own_history(run, key)
    element, _, point = owner.partition(".")
    if point:
        body: Any = run.mechanism[element]
        at_origin = point == ORIGIN and point not in body.points
        return getattr(run.point(element if at_origin else owner), key)
    if element in run.system.bodies:
        return getattr(run[element], key)
    owned: Any = run.mechanism.element_or_group(element)
    if owned.role == "joint" and key in owned.coordinates:
        return _coordinate(run, owned, key)
    if owned.role == "joint" and key == "loss":
        return run.losses[element]
    if owned.role == "contact" and key == "contact":
        return run.contact(element)
    if owned.role in ("joint", "contact"):
        reaction = run.reaction(element)
        return reaction.magnitude if key == "force" else getattr(reaction, key)
    if owned.role == "load" and any(one.name == f"{element}.{key}" for one in owned.own_states()):
        return own_history(run, f"{element}.{key}")
    if owned.role == "load":
        return getattr(run.load(element), key)
    still = run.analysis == "statics"  # drivers hold, whatever their laws say of rates
    if key in DRIVEN:
        found = run.driven(element)[DRIVEN.index(key)]
        return 0.0 * found + 0.0 if still and key != "value" else found
    effort = run.effort(element)
    if key == "effort":
        return effort
    return effort * (0.0 if still else prescribed_rate(run, element))
