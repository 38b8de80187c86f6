"""The page of the gallery: its pictures move where the models move."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import mbody
from mbody.errors import ModelError, SolveError

__all__ = ["make_films", "moving"]

DOCS = Path(__file__).parents[1]
FILMS = DOCS / "_build" / "films"
#: Small enough for a page with all of them.
SECONDS, RATE, WIDTH = 4.0, 12.0, 400


#: What the film of a model has of other parameters than its file, where nothing moves with these.
OTHERWISE = {"pile_of_discs": {"mu": 0.4}}
_PICTURE = re.compile(r"!\[(\w+)\]\(pictures/\1\.svg\)")
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


def moving(text: str) -> str:
    """The page with films in place of the pictures of models that have one."""
    return _PICTURE.sub(
        lambda found: (
            f'<img class="film" alt="{found[1]} in motion" src="_static/{found[1]}.svg">'
            if found[1] in MOVING
            else found[0]
        ),
        text,
    )
