"""Pages of Python: every public name with its signature, docstring and example."""

from __future__ import annotations

import importlib
import inspect

import mbody
from site_maker.elements import escaped

__all__ = ["GROUPS", "names_of", "text"]

#: Pages of the names of `mbody` itself: by the folders in which a name is defined.
GROUPS = {
    "describing": ("mbody.model",),
    "analyses": (
        "mbody.analysis",
        "mbody.engines",
        "mbody.inverse",
        "mbody.sweeps",
        "mbody.stepping",
        "mbody.topologies",
    ),
    "design": ("mbody.derivatives", "mbody.optimization", "mbody.synthesis"),
    "results": ("mbody.solution", "mbody.system", "mbody.errors"),
    "files": ("mbody.files", "mbody.views", "mbody.reports"),
}


def names_of(page: str) -> list[tuple[str, str]]:
    """The names of a page with the module that they are taken from.

    A page is a group of `mbody`, or a folder as "mbody.laws", of which the names that `mbody` has
    itself are left out.
    """
    if page not in GROUPS:
        module = importlib.import_module(page)
        own = (name for name in module.__all__ if name not in mbody.__all__)
        return [(page, name) for name in sorted(own, key=str.lower)]
    names = sorted(mbody.__all__, key=str.lower)
    return [("mbody", name) for name in names if _module_of(name).startswith(GROUPS[page])]


def _module_of(name: str) -> str:
    return str(getattr(mbody, name).__module__)


def text(page: str) -> str:
    """All names of a page."""
    names = names_of(page)
    about = [] if page in GROUPS else [escaped(_first_paragraph(page))]
    return "\n\n".join([*about, *(_entry(*name) for name in names)])


def _first_paragraph(module: str) -> str:
    words = inspect.getdoc(importlib.import_module(module)) or ""
    return " ".join(words.split("\n\n")[0].split())


def _entry(module: str, name: str) -> str:
    thing = getattr(importlib.import_module(module), name)
    if inspect.isclass(thing):
        body = f"```{{eval-rst}}\n.. autoclass:: {module}.{name}\n   :members:\n```"
    elif callable(thing):
        body = f"```{{eval-rst}}\n.. autofunction:: {module}.{name}\n```"
    else:
        words = ", ".join(f"`{one}`" for one in thing)
        body = f"Constant: {words}."
    return f"## {name}\n\n{body}"
