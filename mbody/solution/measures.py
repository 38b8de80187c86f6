"""Measured quantities: formulas of the histories of a result."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import TINY
from mbody.errors import ModelError, brief
from mbody.laws import MeasuredFormula
from mbody.model.driver import DRIVEN
from mbody.model.element import Marker, Numbers, as_marker, listed, owned, unknown_name
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import Measure, reduce_history
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
from mbody.quantities.evaluate import by_numpy, postfix_value
from mbody.quantities.output_units import unit_text
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of
from mbody.solution.histories import (
    LoadHistory,
    PointHistory,
    Reaction,
    Result,
    auxiliary_history,
    column,
    ends,
    motion_rows,
    velocity,
)
from mbody.system.system import driver_states, locked, polar_points

if TYPE_CHECKING:
    from mbody.model.curves import NamedCurve
    from mbody.model.loads import Load
    from mbody.model.states import Quantity
    from mbody.system.formula_steps import StepList

# -- Motion of a place on a body ---------------------------------------------------------------


def point_history(solution: Result, place: Marker | str) -> PointHistory:
    """The history of a place on a body; see `Solution.point`."""
    marker = as_marker(place, "point", "place")
    body = solution[marker.body]
    x, y = _local(solution, marker)
    c, s = np.cos(body.angle), np.sin(body.angle)
    px, py = c * x - s * y, s * x + c * y
    w, alpha = body.omega, body.alpha
    return PointHistory(
        str(marker),
        body.x + px,
        body.y + py,
        body.vx - w * py,
        body.vy + w * px,
        body.ax - alpha * py - w * w * px,
        body.ay + alpha * px - w * w * py,
    )


def _local(solution: Result, marker: Marker) -> tuple[Any, Any]:
    """Place of a marker from the mass centre in link axes, a column a design in a batch."""
    system = solution.system
    at = system.numbers
    if isinstance(marker.point, str):
        name = f"{marker.body}.{marker.point}"
        if f"{name}.x" not in system.values and f"{name}.r" not in system.values:
            element: Any = solution.mechanism[marker.body]
            raise ModelError(
                f"body '{marker.body}' has no point '{marker.point}' (it has: "
                f"{listed(element.points)})",
                marker.body,
            )
        x, y = at.point(name)
    elif isinstance(marker.point, tuple):
        x, y = marker.point
    else:
        x, y = (
            marker.point.r * np.cos(marker.point.angle),
            marker.point.r * np.sin(marker.point.angle),
        )
    cx, cy = at.point(f"{marker.body}.cg")
    return column(x - cx), column(y - cy)


# -- Histories of loads: forces, lengths, angles and rates -------------------------------------

Array = np.ndarray


def load_history(solution: Result, name: str, on: str | None = None) -> LoadHistory:
    """The histories of a load; see `Solution.load`."""
    loads = {load.name: load for load in solution.mechanism.loads}
    if not isinstance(name, str) or name not in loads:
        raise unknown_name("load", name, loads)
    load = loads[name]
    sides = load.sides()
    if not sides:
        return _on_all(solution, load, on)
    default = list(sides)[-1]
    body = default if on is None else on
    if body not in sides or (body == "ground" and not load.acts_on_ground):
        acting = listed(side for side in sides if side != "ground")
        raise ModelError(f"load '{name}' has no history on {on!r} (it has on: {acting})", name)
    other = next((side for side in sides if side != body), "ground")
    # the ground has no coordinates: there the opposite of what acts on the other body
    moving = body if body != "ground" else other
    fx, fy, torque = _forces(solution, load, moving)
    if moving != body:
        fx, fy = -fx, -fy
        torque = _moved(solution, load, -torque, fx, fy, moving, sides[body])
    else:
        torque = _moved(solution, load, torque, fx, fy, moving, sides[moving])
    force, length, angle, rate = np.hypot(fx, fy), None, None, None
    if load.along_line:
        length, rate, (ux, uy) = stretched(solution, load)
        sign = 1.0 if sides[body] == "i" else -1.0
        force, torque = sign * (fx * ux + fy * uy), 0.0 * torque
    elif load.by_angle:
        angle, rate = relative_angle(solution, load)
    line = across_line(solution, load) if load.on_line else (None,) * 4
    return LoadHistory(name, body, other, fx, fy, torque, force, length, angle, rate, *line)


def argument(solution: Result, element: Any, field: str) -> Array | None:
    """Argument of a law of an element over the instants; None where it is not known."""
    kind = element.__dataclass_fields__[field].metadata["of"]
    if kind == "time":
        return solution.t
    found = _measured(solution, element)
    if found is None:
        return None
    if kind in ("length", "angle"):
        return found[0] - column(solution.system.values[f"{element.name}.{element.free}"])
    return found[1]


def argument_rate(solution: Result, element: Any, field: str) -> Array | None:
    """Rate of `argument`; None where that is not known."""
    kind = element.__dataclass_fields__[field].metadata["of"]
    found = _measured(solution, element) if kind in ("length", "angle") else None
    return None if found is None else found[1]


def _measured(solution: Result, element: Any) -> tuple[Array, Array] | None:
    """The length or angle that a load goes by, and its rate."""
    if element.role != "load":
        return None
    if element.along_line:
        return stretched(solution, element)[:2]
    return relative_angle(solution, element) if element.by_angle else None


def _on_all(solution: Result, load: Load, on: str | None) -> LoadHistory:
    bodies = [body.name for body in solution.mechanism.bodies]
    if on not in bodies:
        raise ModelError(
            f"'{load.name}' acts on every body: name one, as in load({load.name!r}, "
            f"on={bodies[0]!r})",
            load.name,
        )
    fx, fy, torque = _forces(solution, load, str(on))
    return LoadHistory(load.name, str(on), "ground", fx, fy, torque, np.hypot(fx, fy))


def _forces(solution: Result, load: Load, body: str) -> tuple[Array, Array, Array]:
    """Force and torque about the mass centre on a moving body, as the kernels have them."""
    from mbody.kernels.finished_instants import each_load

    system = solution.system
    cause = [each.name for each in system.mechanism.loads].index(load.name)
    column = 3 * system.bodies[body]
    kept = solution.record.load_on(cause, column)
    if kept is not None:
        return kept
    motion, batch = motion_rows(solution), solution.record.batch
    histories = motion if batch else motion[None]
    found = np.empty((len(histories), len(solution.t), 3))
    t = np.array(solution.t)
    for design, history in enumerate(histories):
        output = np.empty((len(solution.t), len(system.mechanism.loads), system.coordinates))
        work = system.work(designs=design if system.batch is not None else 0)
        each_load(system.runtime(), work, np.ascontiguousarray(history), t, output)
        found[design] = output[:, cause, column : column + 3]
    whole = np.moveaxis(found, 2, 0)
    fx, fy, torque = whole if batch else whole[:, 0]
    return fx, fy, torque


def _moved(
    solution: Result, load: Load, torque: Array, fx: Array, fy: Array, body: str, side: str | None
) -> Array:
    """A torque about the mass centre of a body, as one about a place of the load."""
    if side is None:
        return torque
    x, y, _, _ = _end(solution, load, side)
    centre = solution[body]
    return torque - ((x - centre.x) * fy - (y - centre.y) * fx)


def _end(solution: Result, load: Load, side: str) -> tuple[Array, Array, Array, Array]:
    """World place of an end, and its velocity."""
    body = solution[load.place(side).body]
    ax, ay = (column(part) for part in solution.system.numbers.arm(load, side))
    c, s = np.cos(body.angle), np.sin(body.angle)
    px, py = c * ax - s * ay, s * ax + c * ay
    return body.x + px, body.y + py, body.vx - body.omega * py, body.vy + body.omega * px


def stretched(solution: Result, load: Load) -> tuple[Array, Array, tuple[Array, Array]]:
    """Distance of both ends, its rate, and the direction from i to j."""
    (ix, iy, ivx, ivy), (jx, jy, jvx, jvy) = (_end(solution, load, side) for side in "ij")
    dx, dy = jx - ix, jy - iy
    length = np.hypot(dx, dy)
    safe = np.maximum(length, TINY)  # ends at one place have no direction
    ux, uy = dx / safe, dy / safe
    return length, ux * (jvx - ivx) + uy * (jvy - ivy), (ux, uy)


def across_line(solution: Result, load: Load) -> tuple[Array, Array, Array, Array]:
    """Of the place on j beside the line through i on the ground: its height, its velocity along
    and across the line, and the rate of its body.
    """
    (ix, iy, _, _), (jx, jy, vx, vy) = (_end(solution, load, side) for side in "ij")
    angle = column(solution.system.numbers.angle(load, "i"))
    ux, uy = np.cos(angle), np.sin(angle)
    height = ux * (jy - iy) - uy * (jx - ix)
    spin = solution[load.places()["j"].body].omega
    return height, ux * vx + uy * vy, ux * vy - uy * vx, spin


def relative_angle(solution: Result, load: Any) -> tuple[Array, Array]:
    """Angle of a body from the one that carries the opposite torque, and its rate."""
    body, by = solution[load.body], solution[load.by]
    return body.angle - by.angle, body.omega - by.omega


# -- Histories of drivers: values, rates and accelerations -------------------------------------


def driven(solution: Result, driver: str) -> tuple[Array, Array, Array]:
    """Value, rate and acceleration of what a driver drives; see `Solution.driven`."""
    from mbody.model.numbers import varied

    names = [d.name for d in solution.mechanism.drivers]
    if driver not in names:
        raise unknown_name("driver", driver, names)
    states = solution.drive_states
    if states is None:
        element = solution.mechanism.drivers[names.index(driver)]
        if _is_dependent(solution, element):
            found = _driven_by_motion(solution, element)
        elif solution.given is not None:
            found = solution.given[:, names.index(driver)].T[:, None]
        else:
            designs = range(solution.record.count if varied(solution.system.values, element) else 1)
            laws = [solution.system.law_of(element, design=n) for n in designs]
            found = np.array([law.derivatives(solution.t) for law in laws]).swapaxes(0, 1)
        whole = np.broadcast_to(found, (3, solution.record.count, len(solution.t)))
        value, rate, change = _since_release(solution, element, whole)
    else:
        value, rate, change = states[:, names.index(driver)].T
    return value, rate, change


def drive_states(solution: Result) -> Array | None:
    """Value, rate, acceleration (instants, drivers, 3), None where designs differ in them."""
    drivers = solution.mechanism.drivers
    if solution.record.batch and solution.given is None:
        return None
    following = [n for n, driver in enumerate(drivers) if _is_dependent(solution, driver)]
    if solution.given is not None and not following:
        return solution.given
    if solution.record.batch:
        return None
    states = np.zeros((len(solution), len(drivers), 3))
    for n, driver in enumerate(drivers):
        if n in following:
            states[:, n] = _driven_by_motion(solution, driver).T
        elif solution.given is not None:
            states[:, n] = solution.given[:, n]
        else:
            for k, part in enumerate(solution.system.law_of(driver).derivatives(solution.t)):
                states[:, n, k] = part
        states[:, n] = _since_release(solution, driver, states[:, n].T).T
    read: Array = locked(states)
    return read


def prescribed_rate(solution: Result, driver: str) -> Array:
    """The rate by which the power of a driver comes, of the shape of its effort: that of its
    coordinate, less what positions that it follows give.
    """
    from mbody.core.recorded_numbers import Untraceable

    element: Any = solution.mechanism[driver]
    if not _is_dependent(solution, element):
        rate: Array = solution.driven(driver)[1]
        return rate
    if not isinstance(solution.t, np.ndarray):
        raise Untraceable("the power of a driver that follows positions or states")
    from mbody.system.formula_steps import recorded_driver

    at = _columns(solution)
    found = recorded_driver(element, at.law(element, "law"), solution.mechanism, at)
    return _values(solution, found.steps, (found.rate,))[0]


def _is_dependent(solution: Result, driver: Any) -> bool:
    """Whether a driver follows positions or auxiliary states, so that only the motion says its
    value.
    """
    system = solution.system
    if driver not in system.independent_drivers:
        return True
    return bool(driver_states(driver, system.mechanism, system.numbers))


def _since_release(solution: Result, driver: Any, prescribed: Array) -> Array:
    """Value, rate and acceleration (3, …, instants): from its release on nothing follows the law,
    and they are those of the motion.
    """
    free = solution.t >= solution.released.get(driver.name, np.inf)
    if not free.any():
        return prescribed
    return np.where(free, _driven_by_motion(solution, driver), prescribed)


def _driven_by_motion(solution: Result, driver: Any) -> Array:
    """Value, rate and acceleration of the coordinate of a driver, by the motion (3, …)."""
    from mbody.system.formula_steps import Differentiated, StepList, along_motion, driven_coordinate

    steps = StepList()
    value = driven_coordinate(steps, driver, _columns(solution))
    along = Differentiated(steps, along_motion(lambda _: None, accelerated=True))
    rate = along.of(value)
    change = along.of(rate)
    assert rate is not None and change is not None, "coordinates move"
    return np.array(_values(solution, steps, (value.place, rate.place, change.place)))


def _own_argument(solution: Result, load: str) -> Array:
    """What the law of a load calls x: its stretch, its angle, or the rate of one."""
    from mbody.system.formula_steps import StepList, own_argument

    steps = StepList()
    found = own_argument(steps, solution.mechanism[load], _columns(solution))
    return _values(solution, steps, (found.place,))[0]


def _columns(solution: Result) -> Numbers:
    """The numbers of a system, those of designs as columns (designs, 1)."""
    system = solution.system
    values = {name: column(value) for name, value in system.values.items()}
    return Numbers(values, polar_points(system.mechanism), system.mechanism.bodies)


def _values(solution: Result, steps: StepList, goals: tuple[int, ...]) -> list[Array]:
    """Recorded numbers at the instants of a result."""
    from mbody.system.formula_steps import SIGNALS, step_values

    shape = solution.t.shape
    if solution.record.batch:
        shape = (solution.record.count, *shape)
    system = solution.system
    kinds = ("position", "velocity", "acceleration")

    def read(kind: str, *arguments: Any) -> Any:
        if kind == "time":
            return solution.t
        if kind == "own":
            return auxiliary_history(solution, arguments[0])
        if kind.startswith("signal"):
            return _signal(solution, arguments[0], SIGNALS.index(kind))
        if kind == "reaction":
            return reaction_part(solution, *arguments)
        body, axis = arguments
        if body == "ground":
            return 1.0 if kind == "turn" and axis == 0 else 0.0
        row = 3 * system.bodies[body]
        if kind == "turn":
            angle = solution.record.take(row + 2)
            return np.sin(angle) if axis else np.cos(angle)
        return solution.record.take(kinds.index(kind) * system.coordinates + row + axis)

    return step_values(steps, goals, read, shape)


def reaction_part(solution: Any, name: str, part: int) -> Any:
    """What a step reads of a joint's reaction, or the multiplier of a driver."""
    return solution.joint_wrench(name)[part - 2] if part else -solution.effort(name)


def _signal(solution: Result, name: str, order: int) -> Array:
    """An input, or a derivative of it; inputs that jump stay between."""
    if order == 0:
        return auxiliary_history(solution, name)
    one = next(each for each in solution.mechanism.inputs if each.name == name)
    law: Array = solution.system.law_of(one, "value").derivatives(solution.t)[order]
    return law


#: What joints have of forces.
REACTION = ("fx", "fy", "force", "torque", "loss", "contact")


def measured(solution: Result, measure: Measure | str) -> tuple[np.ndarray, Dimension, str]:
    """History of a quantity, its dimension and the unit that it is in. (instants,), of a batch
    (designs, instants); angles without a unit of their own in rad.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.slider_crank(1.0, 3.0, speed=2.0))
    >>> values, _, unit = measured(run, "rod.B.x - rod.A.x")
    >>> round(float(values[0]), 6), unit
    (2.872281, 'm')
    """
    wanted = measure if isinstance(measure, Measure) else Measure(measure)
    value, dimension, unit = evaluate_measure(solution, wanted.history)
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


def quantity_history(solution: Result, name: str) -> np.ndarray:
    """The history of a named quantity, (instants,), of a batch (designs, instants)."""
    return measured(solution, name)[0]


def shown_measure(solution: Result, measure: Measure | str) -> tuple[np.ndarray, Dimension, str]:
    """As `measured`, in the unit that people read: its own, or that of `Mechanism.shown`."""
    wanted = measure if isinstance(measure, Measure) else Measure(measure)
    values, dimension, unit = measured(solution, wanted)
    shown, symbol = as_shown(solution.mechanism, wanted, values, dimension, unit)
    return shown, dimension, symbol


def as_shown(
    mechanism: Mechanism, measure: Measure, values: Any, dimension: Dimension, unit: str
) -> tuple[Any, str]:
    """What `measured` gives of a measure, in the unit that people read, and that unit."""
    if measure.unit:
        return values, unit
    units = mechanism.shown
    return units.converted(values, dimension), units.of(dimension)


def evaluate_measure(solution: Result, measure: Measure) -> tuple[Any, Dimension, str]:
    """Value, dimension and unit of a measure's formula: a number where it does not change, else of
    the kind of the result's histories.
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
    return _evaluate(measure, names)


def quantity(solution: Result, owner: str, key: str) -> tuple[Any, Dimension]:
    """The history of what a result has by name, such as x of a body or fx of a joint, and its
    dimension.
    """
    return _history(solution, owner, key), _dimension(solution.mechanism, owner, key)


def check_measure(mechanism: Mechanism, measure: Measure) -> str:
    """Refuse a history that names what the mechanism has not, or whose units do not fit; of others
    the unit that values are in.
    """
    return unit_measured(mechanism, measure)[1]


def unit_measured(mechanism: Mechanism, measure: Measure) -> tuple[Dimension, str]:
    """Dimension and unit of a measure of any result."""
    return _evaluate(measure, _Histories(mechanism, lambda *name: 1.0))[1:]


def in_output_unit(mechanism: Mechanism, measure: Measure) -> Measure:
    """The measure in the output unit of its quantity, where it has no unit of its own and the
    mechanism chooses one.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> machine.output_units = {"torque": "N*mm"}
    >>> in_output_unit(machine, Measure("motor.effort")).unit
    'N·mm'
    """
    if measure.unit or measure.by or not mechanism.output_units:
        return measure
    dimension, _ = unit_measured(mechanism, measure)
    return replace(measure, unit=mechanism.data_units.given(dimension))


def shown_values(mechanism: Mechanism, quantity: str, *values: float) -> tuple[list[float], str]:
    """Values of a quantity of the mechanism in the unit that people read, and that unit; as they
    are, without a unit, of what is no quantity of it.
    """
    try:
        dimension, _ = unit_measured(mechanism, Measure(quantity))
    except ModelError:
        return list(values), ""
    units = mechanism.shown
    return [float(units.converted(one, dimension)) for one in values], units.of(dimension)


def sides(solution: Result, left: str, right: str) -> tuple[np.ndarray, np.ndarray]:
    """Histories of both sides of a relation between quantities that `checked_sides` let pass."""
    return measured(solution, left)[0], measured(solution, right)[0]


def checked_sides(mechanism: Mechanism, text: str, left: str, right: str) -> Dimension:
    """Dimension of the two sides of a relation."""
    try:
        of_a, of_b = (unit_measured(mechanism, Measure(side))[0] for side in (left, right))
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


def _evaluate(measure: Measure, names: _Histories) -> tuple[Any, Dimension, str]:
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
        return found.value / one.value, dimension, unit_text(measure.unit)
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
        #: Inputs and auxiliary states with what they measure.
        self.own = {one.name: one.dimension for one in mechanism.inputs}
        self.own |= {one.name: one.dimension for one in mechanism.states}
        self.quantities = {one.name: one for one in mechanism.quantities}
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
                self[name] = Valued(self._load_value(owner, name), fixed)
                return self[name]
            if _is_law_of_time(self.mechanism, owner, key):
                field = type(self.mechanism[owner]).__dataclass_fields__[key]
                dimension = dimension_of(field.metadata["law"])
            else:
                dimension = _dimension(self.mechanism, owner, key)
            self[name] = Valued(self.history(owner, key), dimension)
        elif name in self.own and name not in self:
            self[name] = Valued(self.history("", name), self.own[name])
        elif name in self.quantities and name not in self:
            from mbody.model.states import quantities_named

            for one in quantities_named(self.mechanism, (name,)):
                if one.name not in self:
                    self[one.name] = Valued(self._of_quantity(one), one.dimension)
        return super().get(name, default)

    def _of_quantity(self, one: Quantity) -> Any:
        """A named quantity by its formula."""
        law: Any = one.formula
        numbers = {k.rpartition(".")[2]: self.number(k, v) for k, v in one.numbers().items()}
        with np.errstate(all="ignore"):
            return formula_value(
                law, numbers, lambda name: self.get(name).value, self.mechanism.curves
            )

    def _of_output(self, owner: str, text: str, output: str) -> Valued:
        """A quantity that a load makes of its numbers, its rate and its states."""
        tree = owned(parse(text), owner)
        system = self.mechanism.units
        known = {name: self._load_value(owner, name) for name in tree.names}
        found = evaluate(tree, Scope(system, {key: Valued(part) for key, part in known.items()}))
        return Valued(found.value, dimension_of(output))

    def _load_value(self, owner: str, name: str) -> Any:
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
    """Dimension of a number of a load, as its resistance; None of any other quantity."""
    if owner not in mechanism or mechanism[owner].role != "load":
        return None
    load: Any = mechanism[owner]
    if key in load.quantities() or getattr(load, key, None) is None:
        return None
    meta = load.__dataclass_fields__[key].metadata if key in load.__dataclass_fields__ else {}
    return dimension_of(meta["dimension"]) if "dimension" in meta else None


def _is_law_of_time(mechanism: Mechanism, owner: str, key: str) -> bool:
    """Whether a quantity is the value of a law of time of a load, as a motor's voltage."""
    if owner not in mechanism or mechanism[owner].role != "load":
        return False
    load: Any = mechanism[owner]
    field = load.__dataclass_fields__.get(key)
    named = field is not None and key not in load.quantities() and getattr(load, key) is not None
    return named and field.metadata.get("of") == "time"


def _dimension(mechanism: Mechanism, owner: str, key: str) -> Dimension:
    """Dimension of the history `key` of a body, a point, a joint, a load or a driver; FormulaError
    where there is none.
    """
    from mbody.model.body import MOTION, ORIGIN, ROTATION

    element, _, point = owner.partition(".")
    known_name = element == "ground" or element in mechanism
    if not known_name and not mechanism.contacts_of(element):
        raise FormulaError(f"there is no body '{element}' (there are: {_bodies(mechanism)})")
    owned: Any = mechanism.element_or_group(element)
    if owned.role == "body":
        known = MOTION if point else MOTION | ROTATION
        if point and point != ORIGIN and point not in owned.points:
            known_points = listed(owned.points)
            raise FormulaError(f"'{element}' has no point '{point}' (it has: {known_points})")
    elif point:
        raise FormulaError(f"there is no body '{element}' (there are: {_bodies(mechanism)})")
    else:
        known = owned.quantities()
        known |= {one.name.rpartition(".")[2]: one.measure for one in owned.auxiliary_states()}
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
    rotation = i.omega * (ux * dy - uy * dx)
    return ux * (vjx - vix) + uy * (vjy - viy) + rotation


def moving_history(run: Result, owner: str) -> Any:
    """The history of a body, or of a point by its dotted name."""
    from mbody.model.body import ORIGIN

    element, _, point = owner.partition(".")
    if not point:
        return run[element]
    body: Any = run.mechanism[element]
    at_origin = point == ORIGIN and point not in body.points
    return run.point(element if at_origin else owner)


def _history(run: Result, owner: str, key: str) -> Any:
    return histories_of(run, owner)(key)


def histories_of(run: Result, owner: str) -> Callable[[str], Any]:
    """Gives histories of a body, a point, a joint, a load or a driver by key, what they share read
    once; those of an input or an auxiliary state, which has no owner, by name.
    """
    if not owner:
        return functools.partial(auxiliary_history, run)
    element, _, point = owner.partition(".")
    if point or element in run.system.bodies:
        return functools.partial(getattr, moving_history(run, owner))
    owned: Any = run.mechanism.element_or_group(element)
    if owned.role in ("joint", "contact"):
        return functools.partial(_of_joint, run, owned, [])
    if owned.role == "load":
        return functools.partial(_of_load, run, owned, [])
    return functools.partial(_of_driver, run, element)


def _of_joint(run: Result, joint: Any, kept: list[Reaction], key: str) -> Any:
    if joint.role == "joint" and key in joint.coordinates:
        return _coordinate(run, joint, key)
    if key == "loss":
        # what has no friction takes none
        return run.losses[joint.name] if joint.name in run.losses else 0.0 * run.t
    if joint.role == "contact" and key == "contact":
        return run.contact(joint.name)
    if not kept:
        kept.append(run.reaction(joint.name))
    return kept[0].magnitude if key == "force" else getattr(kept[0], key)


def _of_load(run: Result, load: Any, kept: list[LoadHistory], key: str) -> Any:
    name = f"{load.name}.{key}"
    if any(one.name == name for one in load.auxiliary_states()):
        return auxiliary_history(run, name)
    if _is_law_of_time(run.mechanism, load.name, key):
        return _law_history(run, load, key)
    if not kept:
        kept.append(run.load(load.name))
    return getattr(kept[0], key)


def _law_history(run: Result, load: Any, key: str) -> Any:
    """The value of a law of time of a load, or of its formula."""
    from mbody.core.recorded_numbers import Untraceable

    if not isinstance(run.t, np.ndarray):
        raise Untraceable("the value of a law of time of a load")
    if isinstance(law := getattr(load, key), MeasuredFormula):
        return formula_history(run, law, f"{load.name}.{key}")
    designs = range(run.record.count) if run.record.batch else (None,)
    found = np.array([run.system.law_of(load, key, design=n)(run.t) for n in designs])
    return found if run.record.batch else found[0]


def _of_driver(run: Result, name: str, key: str) -> Any:
    still = run.analysis == "statics"  # drivers hold, whatever their laws say of rates
    if key in DRIVEN:
        found = run.driven(name)[DRIVEN.index(key)]
        return 0.0 * found + 0.0 if still and key != "value" else found
    effort = run.effort(name)
    return effort if key == "effort" else effort * (0.0 if still else prescribed_rate(run, name))


# -- Values of formulas of measured quantities over a result, by NumPy -------------------------


def formula_value(
    law: MeasuredFormula,
    numbers: Mapping[str, Any],
    variables: Any,
    curves: Mapping[str, NamedCurve] | None = None,
) -> Any:
    """The value of a formula.

    >>> from mbody.laws import compile_measured
    >>> from mbody.quantities import Scope, read
    >>> law, _ = compile_measured(read("2*u - 1", None), Scope(), {"u": None}, None)
    >>> float(formula_value(law, law.numbers(), {"u": 3.0}.get))
    5.0
    """
    curves = curves or {}

    def applied(name: str, *arguments: Any) -> Any:
        return curves[name].at(*arguments) if name in curves else by_numpy(name, *arguments)

    taken = map(variables, law.variables)
    return postfix_value(law.operations, law.parameters(numbers), taken, applied, curves)


def formula_history(solution: Result, law: MeasuredFormula, name: str) -> Array:
    """The values of an element's formula, (instants,), or (designs, instants) of a batch."""
    values = solution.system.values
    numbers = {key: column(values[f"{name}.{key}"]) for key in law.numbers()}

    def variable(one: str) -> Any:
        if one == "x":
            return _own_argument(solution, name.partition(".")[0])
        return solution.t if one == "t" else measured(solution, one)[0]

    shape = solution.t.shape
    if solution.record.batch:
        shape = (solution.record.count, *shape)
    with np.errstate(all="ignore"):
        found = formula_value(law, numbers, variable, solution.mechanism.curves)
    return np.broadcast_to(np.asarray(found, dtype=float), shape)
