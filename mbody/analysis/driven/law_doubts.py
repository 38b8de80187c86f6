"""Doubts about the laws of a result: tables and curves that it has gone beyond, laws beyond their
range, given derivatives that are none, forces of users' loads that do not balance.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import LOAD_BALANCE, STROKE_MARGIN, TABLE_RANGE_MARGIN
from mbody.laws import Expression, MeasuredFormula, Table, Table2
from mbody.laws.function import FunctionCalls
from mbody.model.element import Element
from mbody.model.joints.belt import Belt
from mbody.model.loads.custom import CustomLoad
from mbody.model.loads.hydraulic_cylinder import HydraulicCylinder
from mbody.model.loads.pressure import PistonPressure
from mbody.model.loads.reciprocating_cylinder import ReciprocatingCylinder
from mbody.model.loads.tyre import Tyre
from mbody.model.mechanism import Mechanism
from mbody.quantities.units import DIMENSIONS, Dimension, UnitSystem, dimension_of
from mbody.solution.histories import column
from mbody.solution.solution import Solution

if TYPE_CHECKING:
    from mbody.model.curves import NamedCurve
    from mbody.solution.doubts import Doubt
    from mbody.system.system import System

#: What holds beyond the points.
INSTEAD = {"hold": "the value at its end", "line": "the tangent at its end"}


def range_doubt(
    units: UnitSystem,
    what: tuple[str, str],
    points: Any,
    dimension: Dimension | None,
    outside: str,
    met: tuple[float, float, float],
) -> Doubt:
    """The doubt."""
    from mbody.solution.doubts import Doubt

    name, table = what
    low, high, since = met
    unit, size = (units.of(dimension), 1.0) if dimension is not None else ("", 1.0)
    if dimension == DIMENSIONS["angle"]:
        unit, size = "deg", float(np.degrees(1.0))
    has = f"{size * points[0]:.6g} to {size * points[-1]:.6g} {unit}".rstrip()
    went = f"{size * low:.6g} to {size * high:.6g} {unit}".rstrip()
    return Doubt(
        "extrapolation",
        f"'{name}': {table} covers {has}, this result goes from {went} and takes "
        f"{INSTEAD[outside]} beyond it, from t = {since:.6g} {units.time} on: add points to the "
        f"{'curve' if 'curve' in table else 'table'}",
        since,
        (name,),
    )


# -- Curves that formulas call beyond their points: by how far, and since when -----------------

Array = np.ndarray

#: What the numbers that a curve of two variables takes are called.
NTH = ("the first number of ", "the second number of ")


def open_curves(mechanism: Mechanism) -> Iterator[tuple[Any, str, MeasuredFormula]]:
    """Formulas of loads, states and quantities that call curves which go on beyond their points."""
    known = {name for name, curve in mechanism.curves.items() if _ranges(curve)}
    for element in (*mechanism.loads, *mechanism.states, *mechanism.quantities) if known else ():
        for field in dataclasses.fields(element):
            law = getattr(element, field.name)
            if isinstance(law, MeasuredFormula) and known.intersection(law.operations):
                yield element, field.name, law


def curve_doubts(solution: Solution) -> list[Doubt]:
    """A doubt for each curve that a formula of an element called beyond its points, at the kept
    instants.
    """
    units, found, shape = solution.mechanism.units, [], (1, len(solution.t))
    machine = solution.mechanism
    curves = solution.system.once("open curves", lambda: tuple(open_curves(machine)))
    for element, field, law in curves:
        for curve, arguments in _calls(solution, element, field, law):
            for place, (points, outside) in enumerate(_ranges(curve.curve)):
                x = np.broadcast_to(arguments[place], shape)
                margin = TABLE_RANGE_MARGIN * (points[-1] - points[0])
                beyond = ((x < points[0] - margin) | (x > points[-1] + margin)).any(axis=0)
                if not beyond.any():
                    continue
                met = float(np.nanmin(x)), float(np.nanmax(x)), float(solution.t[beyond].min())
                nth = NTH[place] if len(arguments) > 1 else ""
                what = element.name, f"{nth}the curve '{curve.name}'"
                found.append(
                    range_doubt(units, what, points, curve.curve.takes[place], outside, met)
                )
    return list({(one.message): one for one in found}.values())


def _ranges(curve: NamedCurve) -> list[tuple[Any, str]]:
    """Of each number that a curve takes the places of its points, and what holds beyond them;
    nothing where it has a value everywhere, or none there.
    """
    law = curve.law
    if isinstance(law, Table) and not law.periodic and law.outside != "error":
        return [(law.x, law.outside)]
    if isinstance(law, Table2) and law.outside != "error":
        return [(law.x, law.outside), (law.y, law.outside)]
    return []


@dataclasses.dataclass(frozen=True)
class _Recorder:
    """A curve as formulas call it, which keeps what it was called with."""

    name: str
    curve: NamedCurve
    calls: list[tuple[_Recorder, tuple[Any, ...]]]

    @property
    def takes(self) -> tuple[Any, ...]:
        """Arguments of the recorded curve."""
        return self.curve.takes

    def at(self, *arguments: Any) -> Any:
        """The value of the curve."""
        self.calls.append((self, arguments))
        return self.curve.at(*arguments)


def _calls(
    solution: Solution, element: Any, field: str, law: MeasuredFormula
) -> list[tuple[_Recorder, tuple[Any, ...]]]:
    """The curves that a formula calls over the instants, with what they are called with."""
    from mbody.solution.measures import argument, formula_value, measured

    calls: list[tuple[_Recorder, tuple[Any, ...]]] = []
    curves: Mapping[str, Any] = {
        name: _Recorder(name, curve, calls) for name, curve in solution.mechanism.curves.items()
    }
    values, name = solution.system.values, f"{element.name}.{field}"
    numbers = {key: column(values[f"{name}.{key}"]) for key in law.numbers()}

    def variable(one: str) -> Any:
        if one == "x":
            return argument(solution, element, field)
        return solution.t if one == "t" else measured(solution, one)[0]

    with np.errstate(all="ignore"):
        formula_value(law, numbers, variable, curves)
    return [(curve, arguments) for curve, arguments in calls if _ranges(curve.curve)]


# -- Tables, and curves of formulas, that a result has gone beyond: by how far, and since when -


def extrapolated(solution: Solution) -> list[Doubt]:
    """A doubt for each table or curve that was evaluated outside the range of its points.

    Laws of time, and of the stretch, twist or rate of springs and dampers, are examined at the
    kept instants; of a free motion the argument is followed between them too, by the cubic through
    its values and rates.
    """
    from mbody.solution.measures import argument, argument_rate

    found, system = [], solution.system
    tables = system.once("open tables", lambda: tuple(open_tables(solution.mechanism)))
    for element, field, table in tables:
        if solution.given is not None and any(d is element for d in solution.system.drivers):
            continue  # its motion was given instead of the law
        x = argument(solution, element, field)
        if x is None:
            continue
        x, t = np.atleast_2d(x), solution.t
        low, high = float(table.x[0]), float(table.x[-1])
        margin = TABLE_RANGE_MARGIN * (high - low)
        rate = argument_rate(solution, element, field) if solution.analysis == "simulate" else None
        if rate is not None and len(t) > 1:
            within = _between(t, x[0], np.asarray(rate))
            x, t = np.concatenate([x[0], within[1]])[None], np.concatenate([t, within[0]])
        beyond = ((x < low - margin) | (x > high + margin)).any(axis=0)
        if beyond.any():
            since = float(t[beyond].min())
            if solution.analysis == "simulate" and _of_time(element, field):
                since = float(t[0]) if t[0] < low - margin else max(float(t[0]), high)
            met = float(x.min()), float(x.max()), since
            dimension = dimension_of(element.__dataclass_fields__[field].metadata["of"])
            what, units = (element.name, f"the table of its {field}"), solution.mechanism.units
            found.append(range_doubt(units, what, table.x, dimension, table.outside, met))
    return [*found, *curve_doubts(solution)]


def open_tables(mechanism: Mechanism) -> Iterator[tuple[Element, str, Table]]:
    """Tables that give numbers outside the range of their points."""
    for element in (*mechanism.joints, *mechanism.drivers, *mechanism.loads):
        for field in dataclasses.fields(element):
            law = getattr(element, field.name)
            if isinstance(law, Table) and not law.periodic and law.outside != "error":
                yield element, field.name, law


def _of_time(element: Element, field: str) -> bool:
    return bool(element.__dataclass_fields__[field].metadata["of"] == "time")


def _between(t: Array, x: Array, rate: Array) -> tuple[Array, Array]:
    """Times within the intervals, and the cubic through values and rates of both ends there."""
    s = np.linspace(0.0, 1.0, 10)[1:-1, None]
    step = np.diff(t)
    a, b = x[:-1], x[1:]
    u, v = step * rate[:-1], step * rate[1:]
    cubic = a + s * (u + s * (3.0 * (b - a) - 2.0 * u - v + s * (2.0 * (a - b) + u + v)))
    return (t[:-1] + s * step).ravel(), cubic.ravel()


# -- Everything that may be doubted of laws ----------------------------------------------------


def law_doubts(solution: Solution, places: Sequence[float] = ()) -> list[Doubt]:
    """All doubts about the laws of a result; derivatives of laws of time are looked at at `places`
    too.
    """
    system = solution.system
    return [
        *derivative_doubts(system, places),
        *balance_doubts(solution),
        *extrapolated(solution),
        *validity_doubts(solution),
        *jump_doubts(solution),
    ]


# -- Given derivatives, compared with differences in the range in which the law was called -----


def derivative_doubts(system: System, places: Sequence[float] = ()) -> list[Doubt]:
    """A doubt for each law with a given derivative that is not one."""
    from mbody.solution.doubts import Doubt

    found, units = [], system.mechanism.units
    for name, calls in system.law_calls:
        fields = _fields(system, name, calls)
        of = fields[0].metadata["of"] if fields else ""
        wrong = calls.compare(places if of == "time" else ())
        if wrong is None:
            continue
        pairs = ("rate", "rate"), ("second derivative", "acceleration")
        what, key = pairs[wrong.order - 1]
        law, unit, x, at = "a curve in it", "", "x", ""
        if fields:
            law, per = f"its {fields[0].name}", dimension_of(of)
            unit = units.of(dimension_of(fields[0].metadata["law"]) / per**wrong.order)
            x, at = ("t" if of == "time" else "x"), units.of(per)
        message = (
            f"'{name}': the {what} that is given with the function of {law} is no derivative of "
            f"it: {wrong.given:.6g} {unit} at {x} = {wrong.x:.6g} {at}, by differences of the "
            f"function {wrong.wanted:.6g} {unit}: correct {key}, or leave it out"
        )
        message = " ".join(message.split()).replace(" :", ":").replace(" ,", ",")
        found.append(Doubt("derivative", message, wrong.x if of == "time" else None, (name,)))
    return found


def _fields(system: System, name: str, calls: FunctionCalls) -> list[dataclasses.Field[Any]]:
    """The field of an element that has this law; none where a formula calls it."""
    machine = system.mechanism
    elements: tuple[Any, ...] = (
        *machine.inputs,
        *machine.joints,
        *machine.drivers,
        *machine.loads,
        *machine.states,
    )
    owner = next(one for one in elements if one.name == name)
    return [f for f in dataclasses.fields(owner) if getattr(owner, f.name) is calls.law]


def gap_notes(system: System) -> list[str]:
    """A note of Python functions of time between whose places of evaluation a pulse may hide."""
    gaps = {}
    for name, calls in system.law_calls:
        fields = _fields(system, name, calls)
        if fields and fields[0].metadata["of"] == "time" and calls.law.corners is None:
            gaps[name] = calls.gap()
    widest = max(gaps.values(), default=0.0)
    if not widest > 0.0:
        return []
    name = max(gaps, key=lambda one: gaps[one])
    return [
        f"the function of time of '{name}' was evaluated where steps needed it, up to {widest:.3g} "
        f"{system.mechanism.units.time} apart: a pulse or a jump that is shorter may be missed; "
        "give their times, as Function(f, corners=[…]), an empty list where there are none"
    ]


# -- Forces of users' loads: those on both bodies balance --------------------------------------

#: Instants of a result at which they are looked at.
LOOKED = 16


def balance_doubts(solution: Solution) -> list[Doubt]:
    """A doubt for each load of the user's own whose forces on both bodies do not balance, though it
    does not say that it is external. Nothing on the ground is as good as the reaction there.
    """
    from mbody.solution.doubts import Doubt
    from mbody.solution.histories import motion_rows

    found, system, t = [], solution.system, solution.t
    own = [one for one in solution.mechanism.loads if isinstance(one, CustomLoad)]
    own = [one for one in own if not one.external]
    if not own or not len(t):
        return []
    L, joints, units = system.layout, len(system.layout.primitive_kind), system.mechanism.units
    rows, n = motion_rows(solution), system.coordinates
    looked = np.unique(np.linspace(0, len(t) - 1, LOOKED).astype(int))
    for load in own:
        numbers = [k for k, (name, _) in enumerate(system.functions[joints:]) if name == load.name]
        k = numbers[0]
        hook: Any = system.functions[joints + k][1]
        i, j, o = int(L.action_i[k]), int(L.action_j[k]), L.action_par[k]
        par = system.par[o : o + L.action_count[k], 0]
        for at in looked:
            q, v = (np.append(rows[at, part : part + n], [0.0] * 3) for part in (0, n))
            y = np.zeros(6)
            try:
                hook(np.concatenate([[t[at]], _side(q, v, i), _side(q, v, j), par]), y)
            except Exception:  # where it was needed it was said already
                continue
            if "ground" in load.bodies and not y[3 * load.bodies.index("ground") :][:3].any():
                continue
            force, size = y[:2] + y[3:5], np.abs(y[[0, 1, 3, 4]]).max()
            arm = q[3 * j : 3 * j + 2] - q[3 * i : 3 * i + 2]
            turned = arm[0] * y[4], -arm[1] * y[3]
            moment, levers = y[2] + y[5] + sum(turned), np.abs([y[2], y[5], *turned]).max()
            levers = max(levers, size * system.length)
            if np.abs(force).max() > LOAD_BALANCE * size:
                left = f"a force of ({force[0]:.6g}, {force[1]:.6g}) {units.of('force')} is left"
            elif abs(moment) > LOAD_BALANCE * levers:
                left = f"a moment of {moment:.6g} {units.of('torque')} is left"
            else:
                continue
            kind, (a, b) = type(load).__name__, load.bodies
            message = (
                f"'{load.name}': what it does to '{a}' and to '{b}' does not balance: {left} at "
                f"t = {t[at]:.6g} {units.time}; give the reaction on both bodies, with the moments "
                f"about their mass centres, or write external = True in {kind} where something "
                "outside the mechanism acts on them"
            )
            found.append(Doubt("residual", message, float(t[at]), (load.name,)))
            break
    return found


def _side(q: Array, v: Array, body: int) -> Array:
    """(x, y, θ, cos θ, sin θ, vx, vy, ω) of a body."""
    x, y, angle = q[3 * body : 3 * body + 3]
    return np.array([x, y, angle, np.cos(angle), np.sin(angle), *v[3 * body : 3 * body + 3]])


# -- Laws beyond the range in which they hold --------------------------------------------------


def validity_doubts(solution: Solution) -> list[Doubt]:
    """A doubt for each element whose law does not hold where the result goes, from then on."""
    from mbody.solution.doubts import Doubt

    found, unit = [], solution.mechanism.units.time
    for element in (*solution.mechanism.joints, *solution.mechanism.loads):
        limits = VALIDITY.get(type(element))
        if limits is None:
            continue
        for t, beyond, sentence, remedy in limits(solution, element):
            over = np.atleast_2d(beyond)
            most = float(np.nanmax(over, initial=0.0))
            if not most > 0.0:
                continue
            since = float(np.broadcast_to(t, over.shape[1:])[(over > 0.0).any(axis=0)].min())
            message = (
                f"'{element.name}': {sentence(most)}, from t = {since:.6g} {unit} on, where its "
                f"law does not hold: {remedy}"
            )
            found.append(Doubt("validity", message, since, (element.name,)))
    return found


def jump_doubts(solution: Solution) -> list[Doubt]:
    """A doubt for each driver in a motion whose formula jumps: it would move without a rate."""
    from mbody.laws.steep_places import steep_places
    from mbody.solution.doubts import Doubt

    if solution.analysis != "simulate" or not len(solution.t):
        return []
    found, units = [], solution.mechanism.units
    for driver in solution.mechanism.drivers:
        law = getattr(driver, "law", None)
        if not isinstance(law, Expression):
            continue
        own: Any = solution.system.law_of(driver)
        ends = (
            float(solution.t[0]),
            min(float(solution.t[-1]), solution.released.get(driver.name, np.inf)),
        )
        jumps = steep_places(own, *ends).jumps
        sizes = np.abs(own(jumps) - own(np.nextafter(jumps, -np.inf)))
        size, unit = (
            float(sizes.max(initial=0.0)),
            units.of(driver.__dataclass_fields__["law"].metadata["law"]),
        )
        if len(jumps):
            message = (
                f"'{driver.name}': its law jumps by {size:.3g} {unit} at t = {jumps[0]:.6g} "
                f"{units.time}, where no rate leads: what follows is no motion; give it time, as "
                "by clamp, a Table or a program"
            )
            found.append(Doubt("validity", message, float(jumps[0]), (driver.name,)))
    return found


#: Times, by how much a limit is exceeded then, the sentence of the most, and what to do.
Limit = tuple[Array, Array, Any, str]


def _tyre(solution: Solution, tyre: Any) -> Iterator[Limit]:
    """A wheel's centre below the road, where k (R − h) is no law of a wheel."""
    height, unit = _measured(solution, f"{tyre.name}.height"), solution.mechanism.units.length
    yield (
        solution.t,
        -height,
        lambda most: f"the wheel's centre is up to {most:.3g} {unit} below the road",
        "give it more stiffness",
    )


def _cylinder(solution: Solution, ram: Any) -> Iterator[Limit]:
    """Oil that would pull, and strokes that the cylinder does not have."""
    units, t = solution.mechanism.units, solution.t
    for chamber in "ab":
        pressure = _measured(solution, f"{ram.name}.pressure_{chamber}")
        yield _vacuum(solution, pressure, f"the oil in chamber {chamber}", "it boils before")
    closed, stroke = (_number(solution, ram, key) for key in ("closed", "stroke"))
    x = _measured(solution, f"{ram.name}.length") - closed
    rate = _measured(solution, f"{ram.name}.rate")
    if len(t) > 1 and solution.analysis == "simulate":
        within, between = _between(t, np.ravel(x), np.ravel(rate))
        x, t = np.concatenate([np.ravel(x), between])[None], np.concatenate([t, within])
    margin = STROKE_MARGIN * stroke
    for over, end in ((-x, "shorter than closed"), (x - stroke, "longer than its stroke allows")):
        yield (
            t,
            over - margin,
            lambda most, end=end: f"it is up to {most:.3g} {units.length} {end}",
            "the ends of the stroke are no stops, so give limits to the motion",
        )


def _vacuum(solution: Solution, pressure: Array, what: str, why: str) -> Limit:
    """A gauge pressure below that of nothing."""
    from mbody.quantities import Scope, read

    units = solution.mechanism.units
    none = -read("1.01325 bar", DIMENSIONS["pressure"]).value(Scope(units))
    unit = units.of("pressure")
    return (
        solution.t,
        none - pressure,
        lambda most: (
            f"{what} has a pressure of down to {none - most:.4g} {unit}, below "
            f"vacuum ({none:.4g} {unit})"
        ),
        f"{why}, so give another pressure, a larger piston or a valve that lets oil in",
    )


def _piston(solution: Solution, cylinder: Any) -> Iterator[Limit]:
    """A piston beyond its dead centres."""
    units = solution.mechanism.units
    near, far = (_number(solution, cylinder, key) for key in ("near", "far"))
    i, j = (solution.point(place) for place in (cylinder.i, cylinder.j))
    line = solution[cylinder.i.body].angle + _number(solution, cylinder, "i.angle")
    x = np.cos(line) * (j.x - i.x) + np.sin(line) * (j.y - i.y)
    beyond = np.abs(x - 0.5 * (near + far)) - (0.5 + STROKE_MARGIN) * np.abs(far - near)
    yield (
        solution.t,
        beyond,
        lambda most: f"the piston is up to {most:.3g} {units.length} beyond its dead centres",
        "near and far must be those of the mechanism",
    )


def _pressures(solution: Solution, piston: Any) -> Iterator[Limit]:
    """Gauge pressures of less than nothing."""
    if solution.analysis == "kinematics":
        return
    angle = solution[piston.cycle].angle + _number(solution, piston, "phase")
    for face in ("head", "rod"):
        values = _values(solution, piston, face, np.mod(angle, 2.0 * np.pi))
        yield _vacuum(solution, values, f"its {face} law", "pressures are gauge pressures")


def _belt(solution: Solution, belt: Any) -> Iterator[Limit]:
    """A belt that would push."""
    values, unit = _values(solution, belt, "tension"), solution.mechanism.units.of("force")
    yield (
        solution.t,
        -values,
        lambda most: f"its tension goes down to {-most:.4g} {unit}, a belt cannot push",
        "give it more tension",
    )


def _values(solution: Solution, element: Any, field: str, x: Any = None) -> Array:
    """Values of a law, of time or of x, or of a formula."""
    from mbody.solution.measures import formula_value, measured

    law: Any = solution.system.law_of(element, field)
    x = solution.t if x is None else x
    if not isinstance(law, MeasuredFormula):
        return np.asarray(law(x))
    curves = solution.mechanism.curves

    def variable(one: str) -> Any:
        return solution.t if one == "t" else x if one == "x" else measured(solution, one)[0]

    numbers = {key: float(value) for key, value in law.numbers().items()}
    return np.asarray(formula_value(law, numbers, variable, curves)) + 0.0 * solution.t


def _measured(solution: Solution, name: str) -> Array:
    from mbody.solution.measures import measured

    return np.asarray(measured(solution, name)[0])


def _number(solution: Solution, element: Any, key: str) -> Any:
    return column(solution.system.values[f"{element.name}.{key}"])


#: What limits the laws of elements.
VALIDITY: dict[type, Any] = {
    Tyre: _tyre,
    HydraulicCylinder: _cylinder,
    PistonPressure: _pressures,
    ReciprocatingCylinder: _piston,
    Belt: _belt,
}
