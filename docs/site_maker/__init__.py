"""What of the site is made from the code: references of elements, Python and commands, films.

A page has a line such as ``<!-- made: elements joints -->`` where its text goes, and below it one
in italics for readers of the repository, which the text replaces. Nothing is written among the
pages: the text is put in when Sphinx reads them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from site_maker import commands, elements, gallery, python
from site_maker.docstrings import dashes, plain

__all__ = ["MAKERS", "filled", "setup"]

#: A word, then what is to be made.
_PLACE = re.compile(r"^<!-- made: (\w+) ?(.*?) -->$(?:\n\*Made .*\*$)?", re.MULTILINE)

#: Pages outside of this folder that have a place in the site, and where.
OUTSIDE = {
    "../CHANGELOG.md": "project/changelog.md",
    "../CONTRIBUTING.md": "project/contributing.md",
    "../benchmarks/README.md": "project/benchmarks.md",
    "../README.md": "index.md",
}

MAKERS: dict[str, Callable[[str], str]] = {
    "elements": elements.text,
    "python": python.text,
    "commands": commands.text,
}


def filled(text: str, page: str = "index") -> str:
    """The text of a page with what is made from the code in its places."""
    up = "../" * page.count("/")
    for there, here in OUTSIDE.items():
        text = text.replace(f"]({up}{there}", f"]({up}{here}")
    if page == "gallery":
        text = gallery.moving(text)
    return _PLACE.sub(lambda found: MAKERS[found[1]](found[2]), text)


def setup(app: Any) -> dict[str, Any]:
    """What Sphinx calls at the start."""
    app.add_config_value("films", True, "env", bool)
    app.connect("builder-inited", gallery.make_films)
    app.connect("env-get-outdated", _made)
    app.connect("source-read", _read)
    app.connect("autodoc-process-docstring", plain, priority=100)  # before napoleon
    app.connect("doctree-read", dashes)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _made(app: Any, env: Any, *changes: set[str]) -> list[str]:
    """Pages that are read anew whenever the site is built: the code that they are made of is
    unknown to Sphinx.
    """
    paths = ((name, Path(env.doc2path(name))) for name in env.found_docs)
    return [
        name
        for name, path in paths
        if name == "gallery" or (path.suffix == ".md" and _PLACE.search(path.read_text("utf-8")))
    ]


def _read(app: Any, page: str, source: list[str]) -> None:
    source[0] = filled(source[0], page)
