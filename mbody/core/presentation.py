"""The one door through which results are presented: as text, as data, as tables, in files.

An analysis and its result know nothing of summaries and files, which are built on them. A result
asks here for a form of itself by name; `mbody/__init__.py`, which may import every layer, registers
who makes it. What makes a form is loaded when it is first wanted.
"""

from __future__ import annotations

import importlib

# loaded by `import mbody` itself, which loads nothing that takes time
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


_MAKERS: dict[str, dict[str, str]] = {}


def register(form: str, **makers: str) -> None:
    """Name the functions that make one form of results.

    By class of result, such as ``Solution="mbody.summaries.instant:summary"``: the module and its
    """
    _MAKERS.setdefault(form, {}).update(makers)


def present(form: str, result: Any, *args: Any) -> Any:
    """A result in one of the registered forms.

    Examples
    --------
    >>> import mbody
    >>> present("summary", mbody.mobility(mbody.makers.four_bar(1, 3, 2, 3.5))).splitlines()[0]
    'four-bar'
    """
    makers = _MAKERS[form]
    known = [one.__name__ for one in type(result).__mro__ if one.__name__ in makers]
    if not known:
        raise KeyError(f"{form} of {type(result).__name__}")
    module, _, function = makers[known[0]].partition(":")
    return getattr(importlib.import_module(module), function)(result, *args)


class Presented:
    """Base of results: as text, as data and in notebooks as what is registered for their class.

    Classes may say: `declared`, what they are made of (`mbody/solution/declared_result.py`); else
    it is their fields.
    `angle_unit`: Of their data, unless another is asked for, or is chosen by the model.
    `analysis_name`: Of the heading of their data, if they have one.
    `about_text`: After the name of the model where they are printed, with "{0.name}" for a field.
    """

    def data(self, angle: str | None = None) -> Any:
        """Plain numbers, texts, lists and dicts, ready for JSON; angles in `angle`, ``"deg"`` or
        ``"rad"``.
        """
        return present("data", self, angle)

    def __str__(self) -> str:
        return str(present("summary", self))

    def _repr_html_(self) -> str:
        # what a notebook shows
        return str(present("notebook", self))
