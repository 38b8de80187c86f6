"""Chapters of what a report is of: the sketch, the inputs, assumptions and method, the mobility."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from mbody.errors import ModelError
from mbody.files.model.write import as_data
from mbody.quantities.units import NUMBER
from mbody.reports.blocks import Block, Grid, Items, Notice, Picture, Text, first_rows
from mbody.summaries.analyses import constituents, counts, many
from mbody.summaries.text_table import Column, number, quantities
from mbody.views.drawing import draw
from mbody.views.free_bodies import when

if TYPE_CHECKING:
    from mbody.reports.subject import Subject


#: Free motions and parts of the input that are listed.
MOST_LISTED = 40
#: Instants beside the first that a sketch of a whole revolution shows, faded.
FADED = 3
#: Fields of a body that the table of links has.
OWN = ("mass", "weight", "inertia", "cg", "points", "guess")

METHODS = {
    "dop853": "the explicit Runge–Kutta method of order 8 of Dormand and Prince, with its error "
    "estimate and step control",
    "dopri5": "the explicit Runge–Kutta method of order 5 of Dormand and Prince",
    "radau5": "the implicit Runge–Kutta method Radau IIA of order 5, for stiff motions",
    "generalized-alpha": "the generalized-α method",
    "rattle": "the symplectic method RATTLE",
    "rattle4": "the symplectic method RATTLE, composed to order 4",
    "moreau": "time stepping with impulses, Moreau's midpoint rule, of order one",
}


def sketch(subject: Subject) -> list[Block]:
    """The drawing of the mechanism, at the instant of the diagrams."""
    run, k = subject.run, subject.marked[0] if subject.marked else 0
    instants = [k]
    if subject.many:
        step = max(1, (len(run) - 1) // (FADED + 1))
        instants += [(k + n * step) % len(run) for n in range(1, FADED + 1)]
    figure = draw(run, list(dict.fromkeys(instants)))
    more = f"; faded: other positions of the {subject.course}" if len(instants) > 1 else ""
    caption = f"{subject.mechanism.name}: {when(run, k)}{more}"
    return [Picture("sketch", figure, caption)]


# -- inputs ------------------------------------------------------------------------------------


def inputs(subject: Subject) -> list[Block]:
    """Everything that was given, with units."""
    machine = subject.mechanism
    symbols = ", ".join(machine.units.of(key) for key in ("length", "force", "time", "mass"))
    blocks: list[Block] = [
        Text(
            f"Units: {machine.units.name} ({symbols}). Numbers without a unit are in these, and "
            "angles in degrees; results are in the units that their tables name."
        )
    ]
    try:
        data = as_data(machine)
    except ModelError as error:
        return [*blocks, Notice("note", f"The inputs are Python code in part: {error}.")]
    if data.get("parameters"):
        blocks.append(_parameters(subject, data["parameters"]))
    if data.get("inputs"):
        blocks.append(_signals(subject, data["inputs"]))
    blocks += first_rows(_bodies(subject, data))
    if shapes := _shapes(data):
        blocks += first_rows(shapes)
    for section, title in (
        ("joints", "Joints"),
        ("contacts", "Contacts"),
        ("couplings", "Couplings"),
        ("drivers", "Drivers"),
        ("states", "States"),
        ("quantities", "Quantities"),
        ("loads", "Loads"),
    ):
        if data.get(section) and section == "states":
            blocks.append(_states(data[section]))
        elif data.get(section) and section == "quantities":
            formulas = [_flat(text) for text in data[section].values()]
            columns = [Column("quantity", list(data[section]), text=True)]
            blocks.append(Grid(title, [*columns, Column("formula", formulas, text=True)]))
        elif data.get(section):
            blocks += first_rows(_elements(title, data[section]))
    if data.get("gravity"):
        blocks.append(Text(f"Gravity: {_flat(data['gravity'])}."))
    return blocks


def _parameters(subject: Subject, given: dict[str, Any]) -> Grid:
    """Parameters with their value in the units that are shown."""
    scope = subject.mechanism.parameters.scope()
    values, units = [], []
    for name in given:
        known = scope.names[name]
        kind = known.dimension or NUMBER
        values.append(number(float(subject.units.converted(float(known.value), kind))))
        units.append(subject.units.of(kind))
    columns = [
        Column("parameter", list(given), text=True),
        Column("given as", [str(value) for value in given.values()], text=True),
        Column("value", values),
        Column("unit", units, text=True),
    ]
    return Grid("Parameters", columns)


def _signals(subject: Subject, given: dict[str, Any]) -> Grid:
    """Inputs with their values where nobody gives others, and their units."""
    units = [
        "" if one.dimension is None else subject.mechanism.units.of(one.dimension)
        for one in subject.mechanism.inputs
    ]
    columns = [
        Column("input", list(given), text=True),
        Column("given as", [_flat(value) for value in given.values()], text=True),
        Column("unit", units, text=True),
    ]
    return Grid("Inputs", columns)


def _states(given: dict[str, Any]) -> Grid:
    """Auxiliary states with their rates and starts."""
    columns = [
        Column("state", list(given), text=True),
        Column("rate", [_flat(table["rate"]) for table in given.values()], text=True),
        Column("start", [_flat(table.get("start", 0)) for table in given.values()], text=True),
    ]
    return Grid("States", columns)


def _bodies(subject: Subject, data: dict[str, Any]) -> Grid:
    """Mass, moment of inertia, mass centre and points of every link."""
    machine, system = subject.mechanism, subject.run.system
    mass = system.mass[:-3, 0].reshape(-1, 3)
    names = ["1 ground", *(f"{n} {body.name}" for n, body in enumerate(machine.bodies, 2))]
    centres, points = [""], [_points(data.get("ground", {}).get("points", {}))]
    for body in machine.bodies:
        own = data["bodies"].get(body.name, {})
        centres.append(_place_text(own["cg"]) if "cg" in own else "")
        points.append(_points(own.get("points", {})))
    columns = [
        Column("link", names, text=True),
        quantities("mass", mass[:, 0], "mass", subject.units, before=[""]),
        quantities("I_{G}", mass[:, 2], "inertia", subject.units, before=[""]),
        Column("mass centre", centres, text=True),
        Column("points in link axes", points, text=True),
    ]
    return Grid("Links", columns)


def _shapes(data: dict[str, Any]) -> Grid | None:
    """Shapes of the ground and of links that may touch."""
    owners = {"ground": data.get("ground", {}), **data["bodies"]}
    rows = [
        (f"{body}.{name}", _flat(table))
        for body, own in owners.items()
        for name, table in own.get("shapes", {}).items()
    ]
    if not rows:
        return None
    names, words = zip(*rows, strict=True)
    columns = [Column("shape", list(names), text=True), Column("of", list(words), text=True)]
    return Grid("Shapes", columns)


def _points(given: Any) -> str:
    return "; ".join(f"{name} {_place_text(place)}" for name, place in given.items())


def _place_text(given: Any) -> str:
    """A place in link axes, as it was given."""
    if isinstance(given, dict):
        return f"{given.get('r')} @ {given.get('angle')}"
    return f"({', '.join(map(str, given))})"


def _elements(title: str, given: dict[str, Any]) -> Grid:
    """Elements with their kind, what they join, and their numbers."""
    kinds, joined, others_given = [], [], []
    for table in given.values():
        kind, *others = table
        kinds.append(kind.replace("_", " "))
        first = table[kind]
        joined.append(", ".join(map(_end, first)) if isinstance(first, list) else _flat(first))
        others_given.append("; ".join(f"{name} = {_flat(table[name])}" for name in others))
    return Grid(
        title,
        [
            Column(title.lower().removesuffix("s"), list(given), text=True),
            Column("kind", kinds, text=True),
            Column("of", joined, text=True),
            Column("with", others_given, text=True),
        ],
    )


def _end(value: Any) -> str:
    """A place as words.

    >>> _end("crank.A"), _end({"body": "ground", "point": [0, 2], "angle": 90})
    ('crank.A', 'ground (0, 2) at 90')
    """
    if not isinstance(value, dict):
        return str(value)
    point = value.get("point")
    words = str(value.get("body", ""))
    if point is not None:
        words += f".{point}" if isinstance(point, str) else f" {_place_text(point)}"
    return words + (f" at {value['angle']}" if "angle" in value else "")


def _flat(value: Any) -> str:
    """A table in a table as words."""
    if isinstance(value, dict):
        return ", ".join(
            f"{name.replace('_', ' ')}: {_flat(part)}"
            if isinstance(part, dict)
            else f"{name} = {_flat(part)}"
            for name, part in value.items()
        )
    if isinstance(value, list):
        parts = ", ".join(_flat(part) for part in value[:MOST_LISTED])
        return f"({parts}{', …' if len(value) > MOST_LISTED else ''})"
    return re.sub(r"\s+", " ", str(value))


# -- assumptions and method --------------------------------------------------------------------


def method(subject: Subject) -> list[Block]:
    """Chapter on assumptions and numerical methods."""
    run = subject.run
    assumed = ["All links are rigid, and the motion is plane.", *_with_friction(subject)]
    if not any(type(load).__name__ == "Gravity" for load in subject.mechanism.loads):
        assumed.append("Weights do not act: the model has no gravity.")
    weightless = [
        body.name
        for n, body in enumerate(subject.mechanism.bodies)
        if not float(run.system.mass[3 * n, 0])
    ]
    if weightless:
        names = ", ".join(weightless[:12]) + (", …" if len(weightless) > 12 else "")
        assumed.append(f"These links have no mass: {names}.")
    return [
        Text("**Assumptions**"),
        Items(assumed),
        Text("**Method**"),
        Items(list(_steps(subject))),
    ]


def _with_friction(subject: Subject) -> Iterator[str]:
    """Sentences on the assumptions about clearance, friction and contact."""
    run, machine = subject.run, subject.mechanism
    frictional = [name for name in run.losses if name not in {one.name for one in machine.contacts}]
    if frictional:
        names = ", ".join(frictional[:12]) + (", …" if len(frictional) > 12 else "")
        yield (
            f"Joints have no clearance. Coulomb friction acts in {names}, from the whole reaction, "
            "other joints have none."
        )
    elif machine.joints:
        yield "Joints have no clearance and no friction, other than the loads above describe."
    closed = [one.name for one in machine.contacts if one.closed]
    if closed:
        yield f"Contacts are kept closed: {', '.join(closed)}; what slides has Coulomb friction."
    elif machine.contacts or machine.groups:
        yield (
            "Contacts press and do not pull; what sticks is a constraint, what slides has Coulomb "
            "friction; impacts take no time."
            if run.modes or run.stepped is not None
            else "Contacts are left out of this analysis."
        )


def _steps(subject: Subject) -> Iterator[str]:
    run = subject.run
    yield (
        "Every link has three coordinates (x, y of its mass centre, and its angle); joints and "
        "drivers are equations Φ(q, t) = 0 between them (Nikravesh; Haug)."
    )
    if run.analysis == "simulate":
        settings = subject.mechanism.simulation
        name = settings.method if settings is not None else "dop853"
        yield (
            f"The motion is integrated from its beginning by {METHODS.get(name, name)}; "
            "positions and velocities are projected onto the constraints."
        )
        yield "At every instant M·a + Φ_{q}ᵀ·λ = F is solved; λ are the forces of the joints."
    else:
        yield (
            "Positions solve Φ = 0 by Newton's method, and are followed from the first instant, so "
            "that they stay on one branch; velocities and accelerations follow from the "
            "derivatives of Φ."
        )
        inertia = "" if run.analysis == "statics" else " − M·a"
        yield (
            f"Forces solve Φ_{{q}}ᵀ·λ = F{inertia}: inverse dynamics. λ are the forces of the "
            "joints and the efforts of the drivers; no equation is left out."
        )
    yield (
        "F_{ij} is the force of link i on link j, at the joint; the ground is link 1. Torques are "
        "positive counter-clockwise, directions are from the x axis."
    )
    if run.regularization:
        yield (
            "Some joints hold the mechanism twice: their forces are not unique, those of least "
            "norm are given."
        )


# -- mobility ----------------------------------------------------------------------------------


def mobility(subject: Subject) -> list[Block]:
    """Grübler's count, the rank, redundant joints, and what that says of the forces."""
    found = subject.mobility
    titles, found_counts = counts(found)
    titles = [title.replace(" - ", " − ") for title in titles]
    columns = [Column("count", titles, text=True)]
    columns += [Column(title, cells) for title, cells in found_counts.items()]
    blocks: list[Block] = [Text(f"{constituents(found)}."), Grid("Mobility", columns)]
    redundant = found.driven.redundant if found.drivers else found.of_joints.redundant
    if redundant:
        names = ", ".join(found.redundant) if found.redundant else "some joints"
        blocks.append(
            Notice(
                "note",
                f"{many(redundant, 'redundant row')} ({names}): the forces that these share are "
                "not unique. Tables mark those that are not.",
            )
        )
    elif redundant == 0:
        blocks.append(Notice("good", "No row is redundant: every joint force is unique."))
    motions = found.motions[:12]
    if motions:
        blocks.append(
            Text("Free motions without the drivers:" if found.drivers else "Free motions:")
        )
        blocks.append(Items([motion.words for motion in motions]))
    known = {doubt.message for doubt in subject.run.doubts}
    blocks += [Notice("note", note) for note in found.notes if note not in known]
    return blocks
