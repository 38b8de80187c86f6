"""The viewer: a page that plays a motion, in one file that requests nothing."""

from __future__ import annotations

import hashlib
import html
import json
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, cached_property
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from mbody._version import __version__
from mbody.analysis.driven.free_body import (
    MEMBER_WORDS,
    acting_on_several,
    coupled,
    driven,
    rows_on,
)
from mbody.core.tolerances import (
    DRAWN_HISTORY_SAME,
    DRAWN_RETURNS,
    FORCE_NONE,
    LINES_PARALLEL,
    PRINTED_NONE,
)
from mbody.engineering.instant_centres import InstantCentre, InstantCentres, instant_centres
from mbody.errors import ModelError, SolveError
from mbody.files.model import to_toml
from mbody.files.results import in_units_of_the_model
from mbody.files.tables import writing
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism
from mbody.solution.checks import each_load_of
from mbody.solution.histories import Place, moved
from mbody.solution.measures import found_by
from mbody.solution.solution import Solution
from mbody.summaries.text_table import forces_on
from mbody.system.system import System
from mbody.views.acting import about_place, application_point, torque_pivot, wrench_names
from mbody.views.film_frames import FilmSet, film_svg
from mbody.views.free_bodies import CLOSING, PolygonContent, Side, polygon_contents
from mbody.views.page_data import numbers, scene_data, text_runs
from mbody.views.scene import Scene, scene
from mbody.views.shapes import Pose, motion

# -- The forces on every link over a motion, as a page has them: by reference to its histories -

Array = np.ndarray

#: With more moving bodies than this nobody looks for one in a list.
LINKS = 60


def free_bodies_data(
    run: Solution, data: Mapping[str, Any], scene: Mapping[str, Any]
) -> dict[str, Any] | None:
    """Data of the free-body diagram of every link, beside the histories of an HTML page."""
    if not run.has_forces or len(run.mechanism.bodies) > LINKS:
        return None
    return _FreeBodies(run, data, scene).data_of_links()


class _FreeBodies:
    """Collects the forces of all links."""

    def __init__(self, run: Solution, data: Mapping[str, Any], scene: Mapping[str, Any]) -> None:
        self.run, self.data, self.scene = run, data, scene
        self.pose = Pose(run, 0)
        self.machine, self.system = run.mechanism, run.system
        self.histories: dict[str, Any] = {}
        self.pool: dict[str, Array] = {}
        self.loads = np.array([each_load_of(run, k) for k in range(len(run))])
        self.still = run.analysis == "statics"

    def data_of_links(self) -> dict[str, Any]:
        """All links."""
        bodies = {body.name: list(self._on(body.name)) for body in self.machine.bodies}
        masses = {}
        for name, b in self.system.bodies.items():
            mass = self.system.mass[3 * b : 3 * b + 3, 0]
            masses[name] = [float(mass[0]), float(mass[2])]
        words = {"member": MEMBER_WORDS, "closing": CLOSING, "length": self.system.length}
        words |= {"none": {"force": FORCE_NONE, "sine": LINES_PARALLEL, "moment": PRINTED_NONE}}
        return {"masses": masses, "histories": self.histories, "bodies": bodies, **words}

    # -- wrenches on a body --------------------------------------------------------------------

    def _on(self, body: str) -> Iterator[dict[str, Any]]:
        """Everything that acts on a body at some instant."""
        run, machine = self.run, self.machine
        names, number = forces_on(machine, body), 2 + list(self.system.bodies).index(body)
        centre = self._anchored_site((body, 0.0, 0.0))

        def entry(cause: str, kind: str, place: Any, parts: Any) -> dict[str, Any]:
            (gid, text), (_, twist) = wrench_names(kind, cause, names, number, self.pose)
            where = application_point(kind, cause, self.pose)
            said = [self._said(cause, body, *one) for one in zip("xym", parts, strict=True)]
            return {
                **{"n": gid, "t": plain_runs(text), "T": plain_runs(twist), "k": kind},
                **{"c": cause, "w": where, **place},
                **{"fx": said[0], "fy": said[1], "m": said[2]},
            }

        drawn = [(one["of"], one.get("load")) for one in self.scene["forces"]]
        for joint in machine.joints:
            if body in (joint.i.body, joint.j.body):
                own = run.reaction(joint.name, on=body)
                place = {"f": drawn.index((joint.name, None))}
                parts = np.array([own.fx, own.fy, own.torque])
                yield entry(joint.name, "joint", place, parts)
        for name, place, force in self._touches(body):
            yield entry(name, "contact", place, np.vstack([force, 0.0 * force[:1]]))
        for name, *row in rows_on(run, body):
            yield entry(name, "contact", centre, np.array(row))
        for one, bodies in acting_on_several(run):
            if body in bodies:
                each = [coupled(run, one.name, k) for k in range(len(run))]
                parts = np.array(each)[:, self.system.bodies[body]].T
                yield entry(one.name, one.role, centre, parts)
        for driver in self.system.independent_drivers:
            if body in driver.bodies:
                sign = 1.0 if driver.bodies[1] == body else -1.0
                parts = sign * driven(run, driver.name).T
                site: Place = (driver.bodies[1], 0.0, 0.0)
                anchor = ""
                if "j" in driver.places():
                    site, anchor = self.pose.site(driver, "j"), f"{driver.name}.j"
                place = self._anchored_site(site, anchor) | self._pivot(driver, body, parts)
                yield entry(driver.name, "driver", place, parts)
        for n, load in enumerate(machine.loads):
            parts = self.loads[:, n, self.system.bodies[body]].T
            if np.any(parts):
                yield entry(load.name, "load", *self._load(load, body, parts))
        if any(self.system.mass[3 * self.system.bodies[body] :][:3, 0]) and not self.still:
            found = entry("inertia", "inertia", centre, np.ones((3, 1)))
            found |= {
                "fx": {"by": -1, "mass": body, "of": f"{body}.ax"},
                "fy": {"by": -1, "mass": body, "of": f"{body}.ay"},
                "m": {"by": -1, "inertia": body, "of": f"{body}.alpha"},
            }
            yield found

    def _touches(self, body: str) -> Iterator[tuple[str, dict[str, Any], Array]]:
        """Forces of contacts and ropes on a body, at the places of their arrows: (2, instants)."""
        for n, one in enumerate(self.scene["forces"]):
            if "own" in one:
                ends = self.machine[one["of"]].bodies  # type: ignore[attr-defined]  # a contact
                if body in ends:
                    sign = 1.0 if body == ends[1] else -1.0
                    force = sign * np.array([one["own"]["x"], one["own"]["y"]], dtype=float)
                    yield one["of"], {"f": n}, force

    def _load(self, load: Any, body: str, parts: Array) -> tuple[dict[str, Any], Any]:
        """A load at its place on the body, where it has one; the torque is about that place."""
        field = load.sides().get(body)
        if field is None:
            return self._anchored_site((body, 0.0, 0.0)) | self._pivot(load, body, parts), parts
        site, own = self.pose.site(load, field), self.run[body]
        at = self._anchored_site(site, f"{load.name}.{field}") | self._pivot(load, body, parts)
        return at, about_place(moved(self.run, site).T, (own.x, own.y), parts)

    def _anchored_site(self, site: Place, anchor: str = "") -> dict[str, Any]:
        name, x, y = site
        found: dict[str, Any] = {"at": [self.scene["bodies"].index(name), x, y]}
        return found | ({"p": anchor} if anchor else {})

    def _pivot(self, element: Any, body: str, parts: Array) -> dict[str, Any]:
        """Place of the symbol of a pure torque: about the pin on which the body turns."""
        if np.any(parts[:2]):
            return {}
        place = torque_pivot(element, body, self.pose)
        return {"o": self._anchored_site(self.pose.fixed(body, place))["at"]}

    # -- histories by reference -------------------------------------------------------------------

    def _said(self, cause: str, body: str, key: str, values: Array) -> Any:
        """A history as a number, by those that the page has, or as a further one."""
        peak = float(np.nanmax(np.abs(values), initial=0.0))
        if not peak:
            return 0
        mass = float(self.system.mass[3 * self.system.bodies[body], 0])
        weight = cause != "inertia" and isinstance(self.machine[cause], Gravity)
        if weight and np.ptp(values) <= DRAWN_HISTORY_SAME * peak:
            return {"by": float(values[0]) / mass, "mass": body}
        known = {name: ("of", one) for name, one in self._known(cause)}
        known |= {n: ("own", one) for n, one in self.pool.items() if n.startswith(f"{cause}.")}
        for name, (how, history) in known.items():
            k = int(np.nanargmax(np.abs(values)))
            if len(history) != len(values) or not abs(history[k]) > 0.0:
                continue
            factor = float(values[k] / history[k])
            factor = round(factor) if abs(factor - round(factor)) < DRAWN_HISTORY_SAME else factor
            if factor and not np.any(np.abs(values - factor * history) > DRAWN_HISTORY_SAME * peak):
                return {"by": factor, how: name}
        if np.ptp(values) <= DRAWN_HISTORY_SAME * peak:
            return float(values[0])
        name = f"{cause}.{body}.{key}"
        self.pool[name] = values
        self.histories[name] = numbers([v if v == v else None for v in values.tolist()])
        return {"own": name}

    def _known(self, cause: str) -> Iterator[tuple[str, Array]]:
        """The histories of a cause that the page has."""
        if cause in self.data["efforts"]:
            yield f"{cause}.effort", np.array(self.data["efforts"][cause], dtype=float)
        for table in (self.data["reactions"], self.data["loads"]):
            for key, values in table.get(cause, {}).items():
                if key in ("fx", "fy", "force", "torque") and isinstance(values, list):
                    yield f"{cause}.{key}", np.array(values, dtype=float)


def plain_runs(text: str) -> list[list[str]]:
    r"""A name in the notation of books as parts (text, "" or "sub").

    >>> plain_runs("$-m_{2}\\,a_{G2}$"), plain_runs("$T_{12,\\mathrm{motor\\_2}}$")
    ([['−m', ''], ['2', 'sub'], [' a', ''], ['G2', 'sub']], [['T', ''], ['12,motor_2', 'sub']])
    """
    text = re.sub(r"\\mathrm\{([^}]*)\}", r"\1", text)
    for sign, plain in (("\\,", " "), ("\\ ", " "), ("\\alpha", "α"), ("$-", "$−")):
        text = text.replace(sign, plain)
    return [[re.sub(r"\\([_$%#&{}])", r"\1", part), how] for part, how in text_runs(text)]


# -- Instant centres, centrodes and polygons of a page, as histories ---------------------------

#: With more bodies than this, or more numbers, a page has no centres and no polygons.
BODIES, NUMBERS = 12, 200_000
#: Further from the middle of the motion than so many times its size a centre is left out.
CENTRE_RANGE = 6.0
#: Digits of the greatest velocity of a polygon: a tenth of a pixel has four.
DIGITS = 5


def poles_data(scene: Scene) -> dict[str, Any] | None:
    """The instant centres of all pairs of bodies, with the centrodes of those that wander, and the
    velocity and acceleration polygons; None of statics, of one instant and of many bodies.

    >>> import mbody
    >>> from mbody.views.scene import scene
    >>> made = scene(mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5), turn=True))
    >>> len(poles_data(made)["centres"])
    6
    """
    run = scene.run
    count = len(run.mechanism.bodies)
    pairs = count * (count + 1) // 2
    if run.analysis in ("statics", "close_loops") or len(run) < 2 or count > BODIES:
        return None
    if 2 * pairs * len(run) > NUMBERS:
        return None
    try:
        found = instant_centres(run)
        polygons = polygon_contents(run)
    except SolveError:
        return None
    places = max(0, 3 - math.floor(math.log10(scene.unit)))
    low, high = np.asarray(scene.low, dtype=float), np.asarray(scene.high, dtype=float)
    middle, range_limit = 0.5 * (low + high), CENTRE_RANGE * float(np.hypot(*(high - low)))
    centres = [_centre(run, found, one, middle, range_limit, places) for one in found.pairs]
    return {
        "centres": [one for one in centres if one is not None],
        "polygons": {one.quantity: _polygon(one) for one in polygons},
    }


def _centre(
    run: Solution,
    found: InstantCentres,
    one: InstantCentre,
    middle: Array,
    range_limit: float,
    places: int,
) -> dict[str, Any] | None:
    """A centre that is somewhere near; None of one that never is."""
    x, y = np.array(one.x), np.array(one.y)
    with np.errstate(invalid="ignore"):
        away = ~(np.hypot(x - middle[0], y - middle[1]) <= range_limit)
    if away.all():
        return None
    x[away] = y[away] = np.nan
    bodies = [found.bodies.index(name) for name in one.bodies]
    name = found.symbol(one)
    data: dict[str, Any] = {
        "t": text_runs(f"$I_{{{name[1:]}}}$"),
        "kind": one.permanence,
        "of": list(one.bodies),
        "x": _rounded(x, places),
        "y": _rounded(y, places),
    }
    if one.permanence == "instantaneous" and "ground" in one.bodies:
        moving = next(name for name in one.bodies if name != "ground")
        body = run[moving]
        own = ((x - body.x) + 1j * (y - body.y)) * np.exp(-1j * body.angle)
        data |= {
            "on": max(bodies),
            "u": _rounded(own.real, places),
            "v": _rounded(own.imag, places),
        }
    return data


def _polygon(found: PolygonContent) -> dict[str, Any]:
    """Images with their names, those of links, sides in parts, and what slides."""
    peak = found.greatest
    places = DIGITS - 1 - math.floor(math.log10(peak)) if peak > 0.0 else 0

    def place(at: Array) -> dict[str, Any]:
        return {"x": _rounded(at[:, 0], places), "y": _rounded(at[:, 1], places)}

    def side(one: Side) -> dict[str, Any]:
        corner = {} if one.corner is None else {"t": one.texts, **place(one.corner)}
        return {"of": list(one.ends), **corner}

    return {
        "points": [
            {"t": plain_runs(one.text), "n": one.names, **place(one.at)} for one in found.images
        ],
        "links": found.links,
        "parts": [side(one) for one in found.parts.values()],
        "slides": [side(one) for one in found.slides.values()],
    }


def _rounded(values: Array, places: int) -> list[float | None]:
    rounded = np.round(np.asarray(values, dtype=float), min(places, 300)) + 0.0
    return [None if v != v else v for v in rounded.tolist()]


#: Diagrams of a page.
PLOTS = 3
#: Designs that can be told apart on one picture.
DESIGNS = 6
#: Frames of the film that stands for a page where scripts are stripped.
STILL = 48
#: The file of the web component that is written beside a document in JSON.
MODULE = "mbody-viewer.mjs"
#: The files of the web component, each after those that it imports.
PARTS = (
    "elements", "motion", "drawing", "names", "sheet", "poles", "picture", "plot", "modes",
    "free_body", "viewer",
)  # fmt: skip
#: What a page shows in the beginning beside what it always shows.
VISIBLE_NAMES = ("names", "forces", "velocities", "accelerations", "paths", "centres", "ghosts")


def view(
    model: Any,
    *,
    plots: Sequence[str] = (),
    paths: Sequence[str] | None = None,
    show: Sequence[str] = ("names", "paths", "centres", "ghosts"),
    command: str = "",
) -> Viewer:
    """A page on which a mechanism moves: played, scrubbed, zoomed, with its forces and diagrams.

    Parameters
    ----------
    model : Solution, Mechanism, System, or several by name in a mapping
        The result of any analysis, free motion too; of a model without one, a turn or the motion
        that it asks for. Several are runs or designs that are shown with one another: the first in
        full, the others behind it.
    plots : sequence of str
        Quantities of the diagrams, such as ``"B.force"``; by default the measures of the model, or
        its efforts.
    paths : sequence of str, optional
        Points whose paths are shown; by default those at no joint.
    show : sequence of str
        What is shown in the beginning: "names", "forces", "velocities", "accelerations", "paths",
        "centres", "ghosts".
    command : str
        How the page was made, for its reader.

    Returns
    -------
    Viewer
        Shows itself in a notebook; ``save`` writes it.

    Raises
    ------
    ModelError
        For a batch, a quantity that there is not, or where nothing moves.
    SolveError
        As of the analysis.

    Examples
    --------
    >>> import mbody
    >>> page = mbody.view(mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5), turn=True))
    >>> "<mbody-viewer" in page.html
    True
    """
    runs = runs_of(model)
    check_names(show)
    return Viewer(runs, tuple(plots), None if paths is None else tuple(paths), tuple(show), command)


def runs_of(model: Any) -> dict[str, Solution]:
    """The motions of a view, by name."""
    several = model if isinstance(model, Mapping) else {"": model}
    if not several:
        raise ModelError("a view needs a motion, the mapping has none: give it one")
    check_designs(len(several))
    found = {}
    for name, one in several.items():
        if isinstance(one, System):
            one = one.mechanism
        if isinstance(one, Mechanism):
            one = motion(one)
        if not isinstance(one, Solution):
            raise ModelError(
                "a view is of a mechanism or of what an analysis found, not of an object of the "
                f"type {type(one).__name__}"
            )
        found[str(name)] = one
    return found


def check_designs(count: int) -> None:
    """Refuse more designs than can be told apart."""
    if count > DESIGNS:
        raise ModelError(
            f"a view shows {DESIGNS} designs at most, so that they can be told apart, not "
            f"{count}: choose some of them"
        )


def check_names(show: Sequence[str]) -> None:
    """Refuse what no view can show."""
    for name in show:
        if name not in VISIBLE_NAMES:
            raise ModelError(f"a view shows no '{name}' (it can show: {', '.join(VISIBLE_NAMES)})")


def default_plots(run: Solution) -> list[str]:
    """The diagrams of a page where none are chosen."""
    machine = run.mechanism
    names = [name for name, one in machine.measures.items() if found_by(run, one)]
    own = {machine.measures[name].of for name in names}
    more = []
    if run.has_forces:
        more += [f"{driver.name}.effort" for driver in machine.drivers]
        more += [f"{joint.name}.force" for joint in machine.joints]
    for body in machine.bodies:
        history = run[body.name]
        if np.ptp(history.angle) > DRAWN_RETURNS:
            more.append(f"{body.name}.angle")
    found = [*names, *(name for name in more if name not in own)]
    return found[:PLOTS]


@cache
def module_text() -> str:
    """The web component as one module, with its style."""
    folder = resources.files(__package__) / "viewer"
    parts = [(folder / f"{name}.mjs").read_text("utf-8") for name in PARTS]
    module = "\n".join(re.sub(r"^import .*?;\n", "", part, flags=re.M) for part in parts)
    style = "".join((folder / f"{name}.css").read_text("utf-8") for name in ("palette", "viewer"))
    return module.replace('/*css*/""', json.dumps(style, ensure_ascii=False), 1)


def digest_of(mechanism: Mechanism) -> tuple[str, str, str]:
    """Text and SHA-256 of the model file of a mechanism, or "", "" and why it has none."""
    try:
        text = to_toml(mechanism)
    except ModelError as error:
        return "", "", str(error)
    return text, hashlib.sha256(text.encode()).hexdigest(), ""


class Viewer:
    """A page that plays a motion; made by `view`.

    `runs`: By design.
    `notes`: What is not shown.
    """

    def __init__(
        self,
        runs: dict[str, Solution],
        plots: tuple[str, ...],
        paths: tuple[str, ...] | None,
        show: tuple[str, ...],
        command: str,
    ) -> None:
        self.runs, self._show, self._paths = runs, show, paths
        first, *others = runs.items()
        main, self.notes = self._document(first[1], first[0], plots, paths, show, free=True)
        text, digest, why = digest_of(first[1].mechanism)
        main["data"]["digest"] = digest
        made = {"command": command, "name": f"{_slug(first[1].mechanism.name)}.toml"}
        made |= {"file": text} if text else {"why": why}
        behind = [self._document(run, name, plots, paths, show)[0] for name, run in others]
        self._contents = {**main, "others": behind, "made": made}
        self._modules: list[str] = []

    @staticmethod
    def _document(
        run: Solution,
        name: str,
        plots: tuple[str, ...],
        paths: tuple[str, ...] | None,
        show: tuple[str, ...],
        *,
        free: bool = False,
    ) -> tuple[dict[str, Any], list[str]]:
        found = scene(run)
        scene_values = scene_data(found, plots or default_plots(found.run), paths, show)
        data = in_units_of_the_model(found.run)
        if free and (forces := free_bodies_data(found.run, data, scene_values)):
            scene_values["free"] = forces
        if free and (centres := poles_data(found)):
            scene_values["poles"] = centres
        return {"data": numbers(data), "scene": {**scene_values, "design": name}}, found.notes

    @property
    def document(self) -> dict[str, Any]:
        """Data for the web component: {"data", "scene", "others", "made"}."""
        return self._contents

    def add(self, key: str, part: dict[str, Any], module: str) -> None:
        """A further part of the document, and the module that reads it; before `html` is made."""
        self._contents[key] = part
        self._modules.append(module)

    @cached_property
    def html(self) -> str:
        """The page, as text."""
        whole = self._contents
        title = html.escape(str(whole["data"]["model"]))
        module = "\n".join([module_text(), *self._modules])
        others = {key: value for key, value in whole.items() if key != "data"}
        return "\n".join(
            [
                "<!doctype html>",
                '<html lang="en">',
                "<head>",
                '<meta charset="utf-8">',
                '<meta name="viewport" content="width=device-width, initial-scale=1">',
                f'<meta name="generator" content="mbody {__version__}">',
                "<title>" + title + "</title>",
                # no icon: a browser would ask for one
                '<link rel="icon" href="data:,">',
                "<style>html{background:#fff}@media (prefers-color-scheme:dark)"
                "{html{background:#151b21}}@media print{html{background:#fff!important}}"
                "body{margin:0}</style>",
                "</head>",
                "<body>",
                "<main>",
                '<mbody-viewer whole data="mbody-data" scene="mbody-scene"></mbody-viewer>',
                "</main>",
                f"<noscript>{title}: this page needs scripts, which it brings with it.</noscript>",
                f'<script type="application/json" id="mbody-data">{_json(whole["data"])}</script>',
                f'<script type="application/json" id="mbody-scene">{_json(others)}</script>',
                f'<script type="module">\n{module}</script>',
                "</body>",
                "</html>",
                "",
            ]
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page; or with the ending .json what the web component reads, and its module
        beside it.

        Raises
        ------
        ModelError
            For another ending, or a place where no file can be written.
        """
        try:
            ending = Path(path).suffix.lower()
        except TypeError:
            raise ModelError(f"a path must be text or path-like, not {path!r}") from None
        if ending not in (".html", ".htm", ".json"):
            raise ModelError(
                f"cannot write '{path}': a view is a file that ends in .html, or in .json for the "
                "web component"
            )
        with writing(path) as file:
            file.write(_json(self._contents) + "\n" if ending == ".json" else self.html)
        if ending == ".json":
            with writing(Path(path).with_name(MODULE)) as file:
                file.write("\n".join([module_text(), *self._modules]))

    def _repr_html_(self) -> str:
        """In a notebook: the page in a frame of its own."""
        content = html.escape(self.html, quote=True)
        return (
            f'<iframe srcdoc="{content}" style="width:100%;height:760px;border:0" '
            f'title="{html.escape(str(self._contents["data"]["model"]), quote=True)}"></iframe>'
        )

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        """For a notebook: the page in a frame, and where scripts are stripped a film in SVG."""
        film = FilmSet(self.runs, STILL, 640, self._show, self._paths)
        return {"text/html": self._repr_html_(), "image/svg+xml": film_svg(film, 4.0)}

    def __repr__(self) -> str:
        run = next(iter(self.runs.values()))
        designs = f", {len(self.runs)} designs" if len(self.runs) > 1 else ""
        return f"Viewer({run.mechanism.name!r}: {run.analysis}, {len(run)} instants{designs})"


def _json(tree: Any) -> str:
    """JSON that a page may contain: no end of a script lies in it."""
    text = json.dumps(tree, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _slug(name: str) -> str:
    """A name for a file.

    >>> _slug("Four-bar: dynamic force analysis")
    'four-bar-dynamic-force-analysis'
    """
    words = "".join(sign.lower() if sign.isalnum() else " " for sign in name).split()
    return "-".join(words)[:60] or "model"
