"""ASMT, the assemblies of FreeCAD and Ondsel: recognised, and refused with what they hold.

The format has no published description beside its parser, and its bodies are spatial.
"""

from __future__ import annotations

import re
from typing import NoReturn

from mbody.errors import ModelError

__all__ = ["is_asmt", "refuse_asmt"]

_HEAD = re.compile(r"\s*(freeCAD|OndselSolver|Assembly)\b.*(\n|$)")
_PARTS = re.compile(r"^\s*(\w+(?:Joint|Motion|Force|Torque))\s*$", re.MULTILINE)


def is_asmt(text: str) -> bool:
    """Whether a text is an assembly."""
    return bool(_HEAD.match(text)) and "Assembly" in text[:2000]


def refuse_asmt(text: str) -> NoReturn:
    """Refuse an assembly, with the kinds of its joints and motions.

    Raises
    ------
    ModelError
        Always.
    """
    kinds = list(dict.fromkeys(_PARTS.findall(text)))
    what = f" ({', '.join(kinds[:8])})" if kinds else ""
    raise ModelError(
        f"it is an assembly of FreeCAD (ASMT){what}, whose spatial joints are not read: export it "
        "as URDF or MJCF, or describe its plane in a model file"
    )
