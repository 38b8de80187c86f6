"""What the page gets of a document: shapes, points, joints, words, numbers, results. No state of a
document is an error here: empty, loose, free, driven, a structure, with mistakes.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.assemblies.assembly_modes import assembly_modes
from mbody.analysis.freedom.mobility import components
from mbody.edit.places import Pair
from mbody.errors import ModelError, SolveError, brief
from mbody.files.model.fields import BODY, TEXT, FileReading, NumberCodec
from mbody.files.model.problems import SECTIONS, kind_in, kind_of
from mbody.files.model.read import text_of
from mbody.files.model.schema import described, file_table
from mbody.model.body import Body
from mbody.model.numbers import number_in
from mbody.quantities.formula import Formula
from mbody.quantities.units import DIMENSIONS, Dimension, name_of
from mbody.solution.declared_result import ResultColumn, ResultTable
from mbody.solution.result_table import result_table
from mbody.solution.solution import Solution
from mbody.summaries.text_table import floor_of
from mbody.views.page_data import axis, force_arrows, numbers, position_data

if TYPE_CHECKING:
    from mbody.edit.document import Document, DrawingState
    from mbody.edit.places import Dragging
    from mbody.model.mechanism import Mechanism


# -- Views of the board, kept beside the model as NAME.board.toml: camera, and a picture below -

#: End of the file beside the model, and the greatest picture in bytes.
VIEWS, MOST = ".board.toml", 30_000_000
#: The keys of each view; lengths and places in units of the model, the angle in degrees.
KEYS = {"camera": ("x", "y", "unit"), "underlay": ("x", "y", "width", "angle", "opacity")}
#: Kinds of pictures by how their files begin; what can carry scripts is none of them.
PICTURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
#: Entities of a DXF that are drawn, how many, of how many bytes; the part of its size that a chord
#: may be off a curve.
DRAWN = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE")
LINES, LARGEST, OFF = 20_000, 6_000_000, 5e-4


def views_file(model: Path) -> Path:
    """The file of the views of a model.

    >>> views_file(Path("press.toml")).name
    'press.board.toml'
    """
    return model.with_name(model.stem + VIEWS)


def read_views(model: Path | None) -> dict[str, Any]:
    """The views of a model; a file that makes no sense counts as none."""
    with contextlib.suppress(OSError, ValueError, LookupError, TypeError, RecursionError):
        if model is not None:
            tree = tomllib.loads(text_of(views_file(model)))
            return {name: checked_view(name, tree[name]) for name in KEYS if name in tree}
    return {}


def checked_view(name: str, given: Any) -> dict[str, Any]:
    """A view with finite numbers.

    >>> checked_view("camera", {"x": 1, "y": 2, "unit": 0.5, "more": "no"})
    {'x': 1.0, 'y': 2.0, 'unit': 0.5}
    """
    found: dict[str, Any] = {"file": str(given["file"])} if name == "underlay" else {}
    for key in KEYS[name]:
        found[key] = float(given[key])
        if not math.isfinite(found[key]):
            raise ValueError(f"{key} is no finite number")
    return found


def picture_of(file: Path) -> tuple[bytes, str]:
    """A picture and its type, by what is in it and not by its name."""
    is_dxf, found = file.suffix.lower() == ".dxf", file.stat() if file.is_file() else None
    if found is not None and found.st_size <= (LARGEST if is_dxf else MOST):
        return _picture(file, found.st_mtime_ns, is_dxf)
    size = (LARGEST if is_dxf else MOST) / 1e6
    raise ModelError(f"{brief(file.name)} is no picture of at most {size:g} MB: make it smaller")


@functools.lru_cache(1)
def _picture(file: Path, changed: int, is_dxf: bool) -> tuple[bytes, str]:
    if is_dxf:
        return dxf_picture(file), "image/svg+xml"
    content = file.read_bytes()
    for head, kind in PICTURES.items():
        if content.startswith(head):
            return content, kind
    raise ModelError(f"{brief(file.name)} is no picture: give one in PNG or JPEG, or a DXF")


def dxf_picture(file: Path) -> bytes:
    """The lines of a DXF as an SVG of our own making, which has nothing but numbers."""
    import ezdxf.filemanagement
    import ezdxf.lldxf.const
    from ezdxf.path import make_path

    lines: list[list[tuple[float, float]]] = []
    with contextlib.suppress(OSError, ValueError, TypeError, ezdxf.lldxf.const.DXFError):
        every = (
            e for e in ezdxf.filemanagement.readfile(file).modelspace() if e.dxftype() in DRAWN
        )
        paths = [make_path(one) for one in itertools.islice(every, LINES)]
        corners = [v for path in paths for v in path.control_vertices()]
        size = max(np.ptp([(v.x, v.y) for v in corners], axis=0), default=0.0)
        for shape in paths if 0.0 < size < math.inf else ():
            lines.append([(v.x, 0.0 - v.y) for v in shape.flattening(OFF * size)])
    if not lines:
        raise ModelError(f"{brief(file.name)} has no lines that could be drawn: save it as DXF R12")
    return svg_of(lines)


def svg_of(lines: list[list[tuple[float, float]]]) -> bytes:
    """Lines as an SVG."""
    x, y = zip(*itertools.chain(*lines), strict=True)
    wide, tall = max(x) - min(x) or 1.0, max(y) - min(y) or 1.0
    path = "".join("M" + "L".join(f"{a:.6g} {b:.6g}" for a, b in line) for line in lines)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{min(x)} {min(y)} {wide} {tall}" '
        f'width="1000" height="{1000 * tall / wide}"><path d="{path}" fill="none" '
        f'stroke="#777" stroke-width="{wide / 500}"/></svg>'
    ).encode()


Data = dict[str, Any]

#: Instants of a diagram, free motions in words, boxes that are searched for assembly modes.
INSTANTS, MOTIONS, BOXES = 181, 6, 6000
#: Tables of the file without names, and parts of a path that say nothing of a number.
SINGLE = ("gravity", "ask", "simulate", "fit", "report")
PARTS = ("profile", "cam", "segments")
#: Roles of results that are shown of one position.
ROLES = ("joint", "contact", "coupling", "driver", "load", "measure")
#: Quantities whose units the page shows: of plain numbers of the file, and of results.
PLAIN = ("length", "mass", "time", "angle")
SHOWN = ("force", "torque", "velocity", "angular velocity")


def board_state(document: Document, unit: float, motions: bool = False) -> Data:
    r"""All that the page shows of a document; `unit`: length of a point of the screen; `motions`:
    with velocities and paths of points.

    >>> from mbody.edit.document import Document
    >>> board_state(Document("[ground]\npoints = { A = [0, 0] }"), 0.3)["ground"]
    {'A': [0.0, 0.0]}
    """
    state = document.state
    machine, run = state.mechanism, state.run
    home, turn = state.home, state.motion
    table = forces_table(home if home is not None else run)
    return {
        "name": machine.name,
        "text": document.text,
        "saved": document.saved,
        "undo": document.undo_words,
        "redo": document.redo_words,
        "fault": document.fault.data() if document.fault else None,
        "units": units_of(machine),
        "scene": scene_of(run, unit),
        "bodies": bodies_of(state),
        "ground": {name: list(state.place(f"ground.{name}")) for name in machine.ground.points},
        "pins": pins_of(document),
        "joints": {one.name: _joint(one) for one in machine.joints},
        "drivers": drivers_of(state),
        "loads": {one.name: {"kind": kind_of(one), "body": _body(one)} for one in machine.loads},
        "free": freedom_of(state),
        "messages": messages_of(document, home),
        "rows": list(rows_of(document)),
        "run": home.data() if home is not None else None,
        "results": results_of(run, table),
        "sites": sites_of(home if home is not None else run),
        "modes": None,
        **curves_of(turn),
        **(motions_of(run, turn) if motions else {}),
    }


def units_of(machine: Mechanism) -> dict[str, str]:
    """Units of plain numbers of the file, and those in which results are shown."""
    plain = {kind: machine.units.of(kind) for kind in PLAIN}
    return plain | {kind: machine.shown.of(kind) for kind in SHOWN} | {"system": machine.units.name}


def scene_of(run: Solution | None, unit: float) -> Data:
    """Shapes at one position; none where there is none."""
    if run is None:
        return {"bodies": ["ground"], "unit": unit, "half": 0.0, "carriers": [], "shapes": []}
    return position_data(run, unit)


def bodies_of(state: DrawingState) -> Data:
    """Pose, mass centre and points of each body."""
    points = points_of(state) if state.run is not None else {}
    return {
        name: {"pose": state.pose(name), "cg": state.own(f"{name}.cg"), "points": own}
        for name, own in points.items()
    }


def points_of(state: DrawingState) -> dict[str, dict[str, Pair]]:
    """Named points of each body from its mass centre, in its axes."""
    return {
        body.name: {point: state.arm(body.name, point) for point in body.points}
        for body in state.mechanism.bodies
    }


def pins_of(document: Document) -> list[Data]:
    """Points of the drawing, with all places that are one there."""
    joints: dict[str, dict[str, None]] = {}  # by place
    machine = document.state.mechanism
    for joint in machine.joints:
        for place in filter(None, map(_named, (joint.i, joint.j))):
            joints.setdefault(place, {})[joint.name] = None
    found = []
    known = {"ground": machine.ground.points} | {one.name: one.points for one in machine.bodies}
    for group in document.groups():
        named = [place for place in group if "." in place]  # without origins of bodies
        parts = [place.partition(".") for place in named]
        if not named or any(point not in known.get(body, ()) for body, _, point in parts):
            continue  # of a text with mistakes, which is not what is shown
        moving = next((place for place in named if not place.startswith("ground.")), named[0])
        handles = document.handles(group)
        found.append(
            {
                "xy": document.state.place(named[0]),
                "places": named,
                "name": moving.partition(".")[2],
                "joints": [*{name: None for place in group for name in joints.get(place, ())}],
                "ground": any(place.partition(".")[0] == "ground" for place in group),
                "handles": handles,
                "fixed": document.fixed(group),
            }
        )
    return found


def _named(marker: Any) -> str:
    return f"{marker.body}.{marker.point}" if isinstance(marker.point, str) else ""


def _joint(joint: Any) -> Data:
    return {
        "kind": kind_of(joint),
        "bodies": [joint.i.body, joint.j.body],
        "at": _named(joint.j) or _named(joint.i),
    }


def _body(element: Any) -> str | None:
    """The body on which an element acts first."""
    places = [*element.places().values()]
    return places[-1].body if places else getattr(element, "body", None)


def drivers_of(state: DrawingState) -> Data:
    """Where each driver stands in the file, and how far it can go; angles in degrees."""
    found: Data = {}
    for driver in state.mechanism.drivers:
        factor = math.degrees(1.0) if driver.angular else 1.0
        value, ends = None, state.ranges.get(driver.name)
        if state.run is not None:
            with contextlib.suppress(ModelError, SolveError):
                value = float(state.run.driven(driver.name)[0][-1]) * factor
        found[driver.name] = {
            "body": driver.bodies[1],
            "turns": driver.angular,
            "unit": "deg" if driver.angular else state.mechanism.units.length,
            "value": value,
            "range": ends and [end * factor for end in ends],
        }
    return found


# -- words -----------------------------------------------------------------------------------------


def freedom_of(state: DrawingState) -> Data:
    """What is free, held twice and not joined, in words."""
    found, machine = state.mobility, state.mechanism
    loose = [name for part in components(machine)[1:] for name in part] if machine.bodies else []
    empty = "Empty page: draw a link from one place to another (L), then pin it to the ground (G)."
    words: Data = {"count": 0, "driven": 0, "say": empty, "motions": [], "redundant": {}}
    words["loose"] = loose
    if found is None:
        return words | ({"say": "It does not close as it is drawn."} if machine.bodies else {})
    free, alone, count = found.freedom, found.of_joints.freedom, len(machine.drivers)
    if loose and free and not machine.contacts:
        say = f"Not joined to the ground: {', '.join(loose)}. Press G and click a point to pin it."
    elif free:
        need = "a motor" if free == 1 else "motors"
        say = f"{free} motion{'s' * (free > 1)} still free: drag it, or add {need} or pins."
    elif alone == 0:
        say = "Nothing can move: it is a structure."
    else:
        who = "the motor decides" if count == 1 else f"{count} motors decide"
        say = f"Driven: {who} every position."
    if found.redundant:
        say += f" Held twice: {', '.join(found.redundant)}."
    return words | {
        "count": free,
        "driven": alone,
        "say": say,
        "motions": [motion.words for motion in list(found.driven_motions)[:MOTIONS]],
        "redundant": {n: f"{rows} of its rows too many" for n, rows in found.redundant.items()},
    }


def messages_of(document: Document, home: Solution | None) -> list[Data]:
    """Sentences beside their elements: the fault, troubles, doubts and notes."""
    state, found = document.state, list[Data]()

    def add(text: str, kind: str, element: str = "", key: str = "") -> None:
        one = {"element": element, "key": key, "text": text, "kind": kind}
        if not any(known["text"] == text for known in found):
            found.append(one)

    if document.fault is not None:
        fault = document.fault.data()
        key = str(fault["path"][-1]) if fault["path"] else ""
        add(fault["sentence"], "fault", fault["element"], key)
    for element, sentence in state.troubles:
        add(sentence, "trouble", element)
    for run in (home, state.turn):
        for doubt in run.doubts if run is not None else ():
            add(doubt.message, "doubt", next(iter(doubt.elements), ""))
    for notes in (home, state.mobility, state):
        for note in notes.notes if notes is not None else ():
            add(note, "note")
    return found


# -- numbers of the file ---------------------------------------------------------------------------


def rows_of(document: Document) -> Iterator[Data]:
    """Every number and every word of choice of the file, as it is written there."""
    tree, machine = document.tree, document.state.mechanism
    angle = "rad" if tree.get("angle") == "rad" else "deg"
    parameters = machine.parameters.scope().names
    reading = FileReading(angle, document.folder)
    entries = reading.entries = {}
    file_table().read(tree, (), reading)
    owners = Counter(point for body in (machine.ground, *machine.bodies) for point in body.points)
    for path, (codec, value) in entries.items():
        if codec in (TEXT, BODY):
            continue
        raw = document.spans.raw(path)
        text = re.sub(r"""^("{3}|'{3}|"|')(.*)\1$""", r"\2", raw, flags=re.S)
        row: Data = {"path": list(path), "text": text, "label": label_of(path, owners)}
        row |= {"unit": "", "value": None, "formula": False, "field": field_words(tree, path)}
        if isinstance(codec, NumberCodec):
            dimension = codec.dimension
            if path[0] == "parameters" and path[1] in parameters:
                dimension = parameters[path[1]].dimension
            row |= _number(machine, dimension, value, angle)
        elif isinstance(value, bool):
            row["choices"] = ["true", "false"]
        elif isinstance(value, str):
            row["choices"] = list(getattr(codec, "words", ()))
        else:
            row["value"] = value
        yield row


def label_of(path: tuple[Any, ...], points: Mapping[str, int]) -> str:
    """Whose number it is, and which; `points`: how many bodies have a point of a name.

    >>> label_of(("drivers", "motor", "law", "constant_speed", "speed"), {})
    'motor: speed'
    >>> label_of(("bodies", "crank", "points", "B", 0), {"B": 1})
    'B: x'
    """
    owner, *keys = path if len(path) == 1 or path[0] in SINGLE else path[1:]
    if "points" in path[1:3]:
        body, keys = (owner, keys[1:]) if path[0] == "bodies" else ("ground", keys)
        owner, *keys = keys
        owner = owner if points[owner] == 1 else f"{body}.{owner}"
    elif "law" in keys[:1] and keys[1:]:
        keys = keys[2:]
    pair = "points" in path[1:3] or path[-2:-1] in (("cg",), ("point",))
    last = ["xy"[keys.pop()]] if pair and keys[-1:] in ([0], [1]) else []
    words = [key.replace("_", " ") for key in keys if isinstance(key, str) and key not in PARTS]
    numbers = [str(key + 1) for key in keys if isinstance(key, int)]
    return ": ".join(filter(None, [str(owner), " ".join([*words, *numbers, *last])]))


def _number(machine: Mechanism, dimension: Dimension | None, value: Any, angle: str) -> Data:
    """Unit, value in that unit, and whether it is a formula of others."""
    formula = isinstance(value, Formula)
    is_angle = dimension == DIMENSIONS["angle"]
    unit = angle if is_angle else machine.units.of(dimension) if dimension else ""
    found = None
    with contextlib.suppress(ModelError, ArithmeticError, TypeError):
        if dimension is None or (formula and value.variable):
            found = float(value) if isinstance(value, (int, float)) else None
        else:
            found = number_in(machine, value, dimension, "", "")
    if found is not None and not math.isfinite(found):
        found = None
    if found is not None and is_angle and angle == "deg":
        found = float(f"{math.degrees(found):.15g}")
    of_others = formula and bool(value.names or value.variable)
    return {"unit": unit, "value": found, "formula": of_others}


#: Descriptions of the fields of a class.
fields_of: Callable[[Any], dict[str, str]] = functools.cache(described)


def field_words(tree: Mapping[str, Any], path: tuple[Any, ...]) -> str:
    """What a field is, in the words of its description."""
    section, keys = path[0], path[2:]
    if section == "bodies" and keys:
        return fields_of(Body).get(str(keys[0]), "")
    if section in SECTIONS and keys:
        kind = kind_in(section, tree[section][path[1]])
        cls = SECTIONS[section].get(kind or "")
        if cls is not None:
            name = cls.main[0] if keys[0] == kind and len(cls.main) == 1 else str(keys[0])
            return fields_of(cls).get(name, "")
    entry = file_table().keys.get(str(section))
    return entry.about if entry else ""


def number_of(
    document: Document, rows: list[Data], path: list[Any], value: float
) -> tuple[str, float]:
    """The dotted name of a number that stands at a path of the file, and a value in the unit of its
    row as one in the units of the mechanism, angles in rad.
    """
    tree, section, keys = document.tree, path[0], [str(key) for key in path[1:]]
    if section in ("bodies", "ground"):
        keys = ["ground", *keys] if section == "ground" else keys
        keys = [{"0": "x", "1": "y"}.get(key, key) for key in keys if key != "points"]
    elif section in SECTIONS and len(keys) > 1:
        kind = kind_in(section, tree[section][keys[0]])
        if kind in SECTIONS[section] and keys[1] == kind:
            side = int(keys.pop(2)) if keys[2:] and keys[2].isdigit() else 0
            keys[1] = SECTIONS[section][kind].main[side]
    system = document.state.system
    # in a law its kind is no part of the name
    names = [".".join(keys), ".".join([*keys[:-2], *keys[-1:]])]
    name = next((one for one in names if system is not None and one in system.values), None)
    row = next((one for one in rows if one["path"] == list(path)), None)
    if name is None or row is None:
        raise ModelError(f"'{names[0]}' is no number that can be dragged: type another value")
    return name, math.radians(value) if row["unit"] == "deg" else value


# -- results ---------------------------------------------------------------------------------------


def sites_of(run: Solution | None) -> Data:
    """Where the arrow of each joint and load stands on its body, as on pages; of one that is no
    place of a body where it is in the world.
    """
    found: Data = {}
    if run is None:
        return found
    bodies = ["ground", *(body.name for body in run.mechanism.bodies)]
    for one in force_arrows(run, bodies):
        if "places" in one:
            x, y = one["places"]["x"], one["places"]["y"]
            found[one["of"]] = {"body": "ground", "arm": [x[0], y[0]]}
        else:
            body, u, v = one["at"]
            found[one["of"]] = {"body": bodies[body], "arm": [u, v]}
    return found


def forces_table(run: Solution | None) -> ResultTable:
    """Forces and measures, in the units that people read."""
    return ResultTable() if run is None else result_table(run, run.mechanism.shown, [], ROLES)


def arrows_of(table: ResultTable) -> Data:
    """Forces of joints and loads, with keys of the data of a result."""
    loads, joints = table.by_owner("load", "fx", "fy"), table.by_owner("joint", "fx", "fy")
    every = {"reactions": joints | table.by_owner("contact", "fx", "fy"), "loads": loads}
    return {
        key: {name: {k: [last_of(one)] for k, one in own.items()} for name, own in of.items()}
        for key, of in every.items()
    }


def results_of(run: Solution | None, table: ResultTable) -> list[list[Any]]:
    """Name, value and unit of forces and measures at the last instant."""
    found: list[list[Any]] = []
    if run is None:
        return found
    kinds, shown = [DIMENSIONS[kind] for kind in ("force", "torque")], run.mechanism.shown
    floors = {kind: floor_of(run, kind) / shown.size(kind) for kind in kinds}
    for column in table:
        floor = floors.get(column.dimension, 0.0 if column.role == "measure" else None)
        if floor is None or (column.role == "driver" and column.key != "effort"):
            continue
        if (value := last_of(column)) is not None:
            found.append([column.name, value if abs(value) > floor else 0.0, column.unit])
    return found


def last_of(column: ResultColumn) -> float | None:
    """The last value, to ten digits; None where there is none."""
    with contextlib.suppress(ModelError):  # a measure of what a first position does not have
        values = column.values.reshape(-1)
        if len(values) and math.isfinite(value := float(values[-1])):
            return float(f"{value:.10g}")
    return None


def curves_of(turn: Solution | None) -> Data:
    """Diagrams of efforts and measures over the motion, and the peaks of all forces."""
    plots: list[Data] = []
    peaks: list[list[Any]] = []
    if turn is None:
        return {"plots": plots, "peaks": peaks}
    across, machine = axis(turn), turn.mechanism
    x = np.asarray(turn.t if across["values"] is None else across["values"], dtype=float)
    step = math.ceil(len(x) / INSTANTS)
    unit = machine.shown.of("angle") if across["unit"] == "" else across["unit"]
    for column in forces_table(turn):
        shown = (column.role, column.key) == ("driver", "effort") or column.role == "measure"
        if not (shown or (column.role, column.key) == ("joint", "force")):
            continue
        values = np.where(np.isfinite(column.values), column.values, np.nan)
        if values.shape != x.shape or not np.isfinite(values).any():
            continue
        at = int(np.nanargmax(np.abs(values)))
        if name_of(column.dimension) in ("force", "torque"):
            floor = floor_of(turn, column.dimension) / machine.shown.size(column.dimension)
            values = values * float(abs(values[at]) > floor)
        peak = float(values[at])
        peaks.append([column.name, peak, column.unit, float(x[at])])
        if shown:
            ends = (len(x) - 1, int(np.nanargmin(values)), int(np.nanargmax(values)))
            kept = np.unique([*range(0, len(x), step), *ends])
            history = [None if v != v else float(v) for v in values[kept]]
            own = {"name": column.name, "unit": column.unit, "peak": peak}
            own |= {"x": x[kept].tolist(), "xname": across["label"], "xunit": unit}
            plots.append(numbers({**own, "y": history}))
    return {"plots": plots, "peaks": peaks}


def motions_of(run: Solution | None, turn: Solution | None) -> Data:
    """Velocities of the points of links at the last instant, and their paths over a motion."""
    found: Data = {}
    if run is not None:
        points = [f"{body.name}.{point}" for body in run.mechanism.bodies for point in body.points]
        units, rates = run.mechanism.shown, {place: run.point(place) for place in points}
        found["velocities"] = {
            n: [float(units.converted(v[-1], "velocity")) for v in (one.vx, one.vy)]
            for n, one in rates.items()
        }
        if turn is not None:
            step = math.ceil(len(turn) / INSTANTS)
            paths = {place: turn.point(place) for place in points}
            found["paths"] = {
                name: {"x": one.x[::step].tolist(), "y": one.y[::step].tolist()}
                for name, one in paths.items()
            }
    return dict(numbers(found))


def drag_state(drag: Dragging, unit: float, before: Data | None, motions: bool = False) -> Data:
    """What the page gets while something is dragged: poses, forces, and of the shapes those that
    differ from those `before`, where these are given; with `motions` as of `board_state`.
    """
    run, turn = drag.now.run, drag.turn
    assert run is not None  # else there is nothing to drag
    angular = {driver.name: driver.angular for driver in drag.drawn.mechanism.drivers}
    values = {name: value for name, value in drag.values.items() if name in angular}
    table = forces_table(None if drag.hands else run)
    found = {
        "poses": drag.now.poses,
        "drivers": {n: math.degrees(v) if angular[n] else v for n, v in values.items()},
        "run": arrows_of(table) if run.has_forces and not drag.hands else None,
        "results": results_of(run, table) if not drag.hands else None,
        "words": drag.words,
        "stopped": drag.stopped,
        "home": not drag.away,
    }
    if motions:
        found |= motions_of(None if drag.hands else run, turn)
    if drag.changed:
        found["points"] = points_of(drag.now)
        found |= curves_of(turn) if turn is not None else {}
    if drag.changed and before is not None:
        now = scene_of(run, unit)
        pairs = enumerate(zip(before["shapes"], now["shapes"], strict=False))
        same = len(before["shapes"]) == len(now["shapes"])
        shapes = {str(n): new for n, (old, new) in pairs if old != new}
        found |= {"shapes": shapes} if same else {"scene": now}
    return found


def modes_of(state: DrawingState) -> Data:
    """The assembly modes at the position of the file, as poses."""
    found: list[Data] = []
    if state.system is None or state.mobility is None or state.mobility.freedom:
        return {"modes": found, "complete": True}
    modes = assembly_modes(state.system, most=BOXES)
    for mode in modes.modes:
        pose = mode.pose.reshape(-1, 3)
        poses = {
            name: pose[n].tolist() for name, n in state.system.bodies.items() if name != "ground"
        }
        found.append({"name": mode.name, "current": mode.used, "poses": poses})
    return {"modes": found, "complete": modes.complete}
