"""The viewer: a page that plays a motion, in one file that requests nothing."""

from __future__ import annotations

import hashlib
import html
import json
import os
import re
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from mbody._version import __version__
from mbody.errors import ModelError
from mbody.files.model import to_toml
from mbody.files.writing import writing
from mbody.model.mechanism import Mechanism
from mbody.solution.measures import found_by
from mbody.solution.solution import Solution
from mbody.system.system import System
from mbody.views.film_frames import FilmSet
from mbody.views.film_svg import film_svg
from mbody.views.motions import motion
from mbody.views.page_data import numbers, scene_data
from mbody.views.page_free_bodies import free_bodies_data
from mbody.views.page_poles import poles_data
from mbody.views.scene import scene

__all__ = [
    "MODULE",
    "Viewer",
    "check_designs",
    "digest_of",
    "module_text",
    "runs_of",
    "shown_names",
    "view",
]

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
    "elements",
    "motion",
    "drawing",
    "names",
    "poles",
    "picture",
    "plot",
    "modes",
    "free_body",
    "viewer",
)
#: What a page shows in the beginning beside what it always shows.
SHOWN = ("names", "forces", "velocities", "accelerations", "paths", "centres", "ghosts")


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
    shown_names(show)
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


def shown_names(show: Sequence[str]) -> None:
    """Refuse what no view can show."""
    for name in show:
        if name not in SHOWN:
            raise ModelError(f"a view shows no '{name}' (it can show: {', '.join(SHOWN)})")


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
        if np.ptp(history.angle) > 1e-6:
            more.append(f"{body.name}.angle")
    found = [*names, *(name for name in more if name not in own)]
    return found[:PLOTS]


@cache
def module_text() -> str:
    """The web component as one module, with its style."""
    folder = resources.files(__package__) / "viewer"
    parts = [(folder / f"{name}.mjs").read_text("utf-8") for name in PARTS]
    module = "\n".join(re.sub(r"^import .*?;\n", "", part, flags=re.M) for part in parts)
    style = (folder / "viewer.css").read_text("utf-8")
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

    Attributes
    ----------
    runs : dict of Solution
        By design.
    notes : list of str
        What is not shown.
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
        self._whole = {**main, "others": behind, "made": made}
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
        shown = scene_data(found, plots or default_plots(found.run), paths, show)
        data = found.run.data()
        if free and (forces := free_bodies_data(found.run, data, shown)):
            shown["free"] = forces
        if free and (centres := poles_data(found)):
            shown["poles"] = centres
        return {"data": numbers(data), "scene": {**shown, "design": name}}, found.notes

    @property
    def document(self) -> dict[str, Any]:
        """What the web component reads: {"data", "scene", "others", "made"}."""
        return self._whole

    def add(self, key: str, part: dict[str, Any], module: str) -> None:
        """A further part of the document, and the module that reads it; before `html` is made."""
        self._whole[key] = part
        self._modules.append(module)

    @cached_property
    def html(self) -> str:
        """The page, as text."""
        whole = self._whole
        title = html.escape(str(whole["data"]["model"]))
        module = "\n".join([module_text(), *self._modules])
        rest = {key: value for key, value in whole.items() if key != "data"}
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
                f'<script type="application/json" id="mbody-scene">{_json(rest)}</script>',
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
            file.write(_json(self._whole) + "\n" if ending == ".json" else self.html)
        if ending == ".json":
            with writing(Path(path).with_name(MODULE)) as file:
                file.write("\n".join([module_text(), *self._modules]))

    def _repr_html_(self) -> str:
        """In a notebook: the page in a frame of its own."""
        content = html.escape(self.html, quote=True)
        return (
            f'<iframe srcdoc="{content}" style="width:100%;height:760px;border:0" '
            f'title="{html.escape(str(self._whole["data"]["model"]), quote=True)}"></iframe>'
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
