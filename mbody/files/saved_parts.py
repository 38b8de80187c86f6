"""The parts of a saved result, checked one by one: kinds, sizes, finite numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from mbody.analysis.driven.requests import ANALYSES
from mbody.files.arrays import Unreadable
from mbody.solution.doubts import KINDS
from mbody.solution.restart import ModalState
from mbody.system.system import System

#: Numbers that a float can have.
MOST = 1e300

__all__ = ["array", "check_header", "closed_places", "modal_state", "pages", "want"]


def want(sound: bool, what: str) -> None:
    """Refuse a part that is not as it must be."""
    if not sound:
        raise Unreadable(what)


def array(
    arrays: Mapping[str, np.ndarray],
    name: str,
    shape: tuple[int | None, ...],
    *,
    open: bool = False,
    finite: bool = True,
) -> np.ndarray:
    """An array of floats of that shape, None where any size will do; finite, but that `open` ones
    may lack numbers (NaN), as at an instant that has no answer. Where not `finite`, others judge.
    """
    want(name in arrays, f"'{name}' is missing")
    found = arrays[name]
    sizes = zip(found.shape, shape, strict=False)
    fits = found.ndim == len(shape) and all(size is None or own == size for own, size in sizes)
    want(fits and found.dtype == np.float64, f"'{name}' is of another size or kind")
    sound = ~np.isinf(found) if open else np.isfinite(found)
    want(not finite or bool(sound.all()), f"'{name}' holds what is no finite number")
    return found


def pages(
    arrays: Mapping[str, np.ndarray], name: str, system: System, count: int, analysis: str
) -> np.ndarray:
    """What was kept of so many instants: (instants, rows)."""
    rows = system.page_rows
    return array(arrays, name, (count, rows), open=analysis != "simulate")


def check_header(header: Mapping[str, Any], system: System) -> None:
    """Refuse words about a result that are of another kind, or name what the system has not."""
    want(header["analysis"] in (*ANALYSES, "close_loops", "simulate"), "its analysis is unknown")
    want(
        _number(header["regularization"]) and header["regularization"] >= 0.0,
        "'regularization' is no number",
    )
    want(_texts(header["notes"]), "'notes' are no texts")
    want(isinstance(header["status"], str), "'status' is no text")
    want(isinstance(header["ending"], str), "'ending' is no text")
    want(isinstance(header["doubts"], list), "'doubts' are no list")
    want(all(_doubt(one) for one in header["doubts"]), "'doubts' are of another kind")
    branch = header["branch"]
    pair = isinstance(branch, list) and len(branch) == 2 and all(map(_number, branch))
    want(branch is None or pair, "'branch' is no distance with its instant")
    gone = header["released_at"]
    want(isinstance(gone, dict) and all(map(_number, gone.values())), "'released_at' are no times")
    stats = header["stats"]
    counts = isinstance(stats, dict) and all(type(n) is int for n in stats.values())
    want(stats is None or counts, "'stats' are no counts")
    open_parts = header["dependencies"]
    if open_parts is not None:
        closed = {one.name for one in system.mechanism.contacts if one.closed}
        joints = {joint.name for joint in system.mechanism.joints} | closed
        want(
            isinstance(open_parts, dict) and joints <= {*open_parts}, "'dependencies' lack a joint"
        )
        # a reaction has three parts, an effort one
        sizes = {name: 3 if name in joints else 1 for name in open_parts}
        sound = all(_truths(part, sizes[name]) for name, part in open_parts.items())
        want(sound, "'dependencies' are no truths")
    events = header["events"]
    sound = isinstance(events, list) and all(_event(one) for one in events)
    want(sound, "'events' are no names, times and truths")
    for key in ("works", "lost"):
        want(key not in header or _texts(header[key]), f"'{key}' are no texts")
    if "modes" in header:
        modes, contacts = header["modes"], header.get("contacts", [])
        want(isinstance(modes, dict) and all(map(_texts, modes.values())), "'modes' are no texts")
        want(_texts(contacts) and len(contacts) == len(events), "'contacts' are not of the events")
    if "way" in header:
        way = header["way"]
        want(isinstance(way, list) and len(way) == 4 and isinstance(way[0], str), "'way' is none")
        want(all(_number(part) for part in way[1:]), "'way' holds what is no number")
        drivers = {driver.name for driver in system.drivers}
        want(drivers >= {*gone}, "'released_at' names what is no driver")


#: Of the parts of a `ModalState` what each has in a row: words, numbers, numbers of elements.
MODAL: dict[str, tuple[Any, ...]] = {
    "modes": (str,),
    "pairs": (str,),
    "on": (float,),
    "anchor": (float,),
    "phases": (float,),
    "closed": (int,),
    "beyond": (int,),
    "page": (float,),
    "lost": (float,),
    "fresh": (str, int, float),
    "struck": (int, float),
}


def closed_places(found: Any) -> dict[str, tuple[tuple[int, ...], tuple[float, ...]]]:
    """By contact the numbers of its places that are closed, and where it rolls from; refuses what
    is of another kind.
    """
    parts: dict[str, tuple[tuple[int, ...], tuple[float, ...]]] = {}
    rows: dict[str, Any] = found if isinstance(found, dict) else {"": None}
    for name, row in rows.items():
        pair = isinstance(row, list) and len(row) == 2 and all(isinstance(x, list) for x in row)
        sound = pair and len(row[1]) in (0, 6) and all(_number(part) for part in row[1])
        sound = sound and all(type(n) is int and n >= 0 for n in row[0])
        want(sound, "'closed' is of another kind")
        parts[name] = tuple(row[0]), tuple(row[1])
    return parts


def modal_state(found: Any) -> ModalState:
    """The modes that a motion goes on with; refuses what is of another kind."""
    names = {part.name for part in fields(ModalState)}
    want(isinstance(found, dict) and found.keys() == names, "'modal' has other parts")
    parts: dict[str, Any] = {}
    for name, kinds in MODAL.items():
        rows = found[name]
        if len(kinds) == 1 and isinstance(rows, list):
            rows = [[row] for row in rows]
        sound = isinstance(rows, list) and all(_row(row, kinds) for row in rows)
        want(sound, f"'modal.{name}' is of another kind")
        parts[name] = tuple(row[0] if len(kinds) == 1 else tuple(row) for row in rows)
    for name in ("groups", "shared"):
        rows = found[name]
        sound = isinstance(rows, list) and all(
            isinstance(row, list) and all(type(one) is int for one in row) for row in rows
        )
        want(sound and (name == "shared" or all(rows)), f"'modal.{name}' is of another kind")
        parts[name] = tuple(map(tuple, rows))
    return ModalState(**parts)


def _row(row: Any, kinds: tuple[Any, ...]) -> bool:
    return (
        isinstance(row, list)
        and len(row) == len(kinds)
        and all(type(one) is kind for one, kind in zip(row, kinds, strict=True))
    )


def _number(value: Any) -> bool:
    # a whole number may be too large for a float
    return type(value) in (int, float) and abs(value) < MOST


def _texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(part, str) for part in value)


def _truths(value: Any, count: int) -> bool:
    return isinstance(value, Sequence) and [type(part) for part in value] == [bool] * count


def _doubt(value: Any) -> bool:
    if not isinstance(value, dict) or value.keys() != {"kind", "t", "elements", "message"}:
        return False
    timed = value["t"] is None or _number(value["t"])
    words = value["kind"] in KINDS and isinstance(value["message"], str)
    return words and timed and _texts(value["elements"])


def _event(value: Any) -> bool:
    if not isinstance(value, list) or len(value) != 3:
        return False
    name, t, after = value
    return isinstance(name, str) and _number(t) and isinstance(after, bool)
