"""Contacts of steps with impulses in saved results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.files.saved_parts import array, want
from mbody.solution.stepped_contacts import SteppedContacts

__all__ = ["stepped_arrays", "stepped_contacts", "stepped_header"]

#: Width of each table.
WIDTHS = {"which": 3, "numbers": 7}


def stepped_header(stepped: SteppedContacts) -> dict[str, Any]:
    """Names, and the one number."""
    return {"laws": stepped.laws, "shapes": stepped.shapes, "nearer": stepped.nearer}


def stepped_arrays(stepped: SteppedContacts) -> dict[str, np.ndarray]:
    """Its tables, of floats all."""
    names = ("first", "which", "numbers", "residuals")
    return {f"stepped.{name}": getattr(stepped, name).astype(float) for name in names}


def stepped_contacts(header: Any, arrays: Mapping[str, np.ndarray], n: int) -> SteppedContacts:
    """What was written of n instants, checked."""
    names = ("laws", "shapes")
    sound = isinstance(header, dict) and all(
        isinstance(header.get(key), list) and all(isinstance(one, str) for one in header[key])
        for key in names
    )
    want(sound and isinstance(header.get("nearer"), float), "'stepped' is of another kind")
    first = array(arrays, "stepped.first", (n + 1,))
    count = int(first[-1])
    tables = {key: array(arrays, f"stepped.{key}", (count, w)) for key, w in WIDTHS.items()}
    which = tables["which"]
    steps = np.diff(first, prepend=0.0)
    whole = [(part == np.round(part)).all() for part in (first, which)]
    want(all(whole) and bool((steps >= 0.0).all()), "'stepped.first' holds no numbers of places")
    laws, shapes = len(header["laws"]), len(header["shapes"])
    known = (which[:, 0] >= 0) & (which[:, 0] < laws) & (which[:, 1:] < shapes).all(axis=1)
    want(bool(known.all()), "'stepped.which' names what there is not")
    return SteppedContacts(
        laws=tuple(header["laws"]),
        shapes=tuple(header["shapes"]),
        first=first.astype(np.int64),
        which=which.astype(np.int64),
        numbers=tables["numbers"],
        residuals=array(arrays, "stepped.residuals", (1, n, None)),
        nearer=header["nearer"],
    )
