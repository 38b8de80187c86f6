"""The page of the gallery: every model with its picture, moving where it moves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mbody
from mbody.errors import ModelError, SolveError
from site_maker.elements import escaped

__all__ = ["make_films", "text"]

DOCS = Path(__file__).parents[1]
FILMS = DOCS / "_build" / "films"
#: Small enough for a page with all of them.
SECONDS, RATE, WIDTH = 4.0, 12.0, 400


#: What the film of a model has of other parameters than its file, where nothing moves with these.
OTHERWISE = {"pile_of_discs": {"mu": 0.4}}
#: Films of this site, by model; none where it is built without them.
MOVING: set[str] = set()


def make_films(app: Any) -> None:
    """A film of every model that moves, unless it is there and newer than its model."""
    if not app.config.films:
        return
    from sphinx.util.display import status_iterator

    FILMS.mkdir(parents=True, exist_ok=True)
    names = mbody.gallery.names()
    for name in status_iterator(names, "films of the gallery... ", "green", len(names)):
        film(name)
        if (FILMS / f"{name}.svg").stat().st_size:
            MOVING.add(name)
    app.config.html_static_path.append(str(FILMS))


def film(name: str) -> None:
    """The film of one model; a file without content where nothing moves."""
    source, made = mbody.gallery.path(name), FILMS / f"{name}.svg"
    if made.exists() and made.stat().st_mtime > source.stat().st_mtime:
        return
    model = mbody.gallery.load(name, OTHERWISE.get(name))
    try:
        mbody.animate(model, made, duration=SECONDS, rate=RATE, width=WIDTH, show=["paths"])
    except (ModelError, SolveError):
        made.write_text("")


def text(_: str) -> str:
    """Every model with its title, its picture and the command that shows it."""
    return "\n\n".join(map(_entry, mbody.gallery.names()))


def _entry(name: str) -> str:
    drawn = (DOCS / "pictures" / f"{name}.svg").exists()  # `make pictures` draws them
    still = f"![{name}](pictures/{name}.svg)" if drawn else ""
    moving = f'<img class="film" alt="{name} in motion" src="_static/{name}.svg">'
    shown = moving if name in MOVING else still
    model = mbody.gallery.load(name)
    words = [escaped(f"{text.rstrip('.')}.") for text in (model.name, model.note) if text]
    if model.source:
        words.append(f"*{escaped(model.source.rstrip('.'))}.*")
    other = "".join(f" --set {key}={value}" for key, value in OTHERWISE.get(name, {}).items())
    return f"## {name}\n\n{' '.join(words)}\n\n{shown}\n\n    mbody view {name}{other} --open"
