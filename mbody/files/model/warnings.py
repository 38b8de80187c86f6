"""What may be meant otherwise in a model file: plain numbers, and omitted entries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from mbody.model.mechanism import Mechanism
from mbody.model.remarks import of_each

__all__ = ["meant_otherwise"]


def meant_otherwise(data: Mapping[str, Any], mechanism: Mechanism) -> tuple[str, ...]:
    """Sentences about a file that was read, for the notes of its mechanism.

    Parameters
    ----------
    data : mapping
        The tables as they stood in the file.
    mechanism : Mechanism
        What was made of them.
    """
    degrees = data.get("angle", "deg") == "deg"
    return (
        *_laws(data, mechanism, degrees),
        *_without_law(data, mechanism),
        *_without_inertia(data, mechanism),
    )


def _tables(data: Mapping[str, Any], section: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    entries = data.get(section)
    if isinstance(entries, Mapping):
        yield from ((k, v) for k, v in entries.items() if isinstance(v, Mapping))


def _laws(data: Mapping[str, Any], mechanism: Mechanism, degrees: bool) -> Iterator[str]:
    """Polynomials of an angle whose coefficients are in degrees and in radians."""
    for name, entry in _tables(data, "drivers"):
        law = entry.get("law")
        given = law.get("polynomial") if isinstance(law, Mapping) else None
        if not (degrees and isinstance(given, list) and "angle" in entry):
            continue
        plain = [isinstance(c, (int, float)) and c != 0 for c in given]
        if len(plain) > 1 and plain[0] and any(plain[1:]):
            rate = next(c for c, own in zip(given[1:], plain[1:], strict=True) if own)
            yield (
                f"'{name}': of polynomial = {given} the first number is an angle, {given[0]:g} "
                f"deg, and the others are rates, as {rate:g} rad/{mechanism.units.time}: write "
                "them with their units"
            )


def _without_law(data: Mapping[str, Any], mechanism: Mechanism) -> Iterator[str]:
    """Drivers that do not move because they have no law."""
    instants = str(data.get("ask") or "")
    for name, entry in _tables(data, "drivers"):
        driver: Any = mechanism[name]
        if "law" in entry or driver.distances():
            continue
        if name in instants or driver.bodies[1] in instants:
            continue  # the file gives the positions at which it is analysed
        zero = "0 deg" if driver.angular else f"0 {mechanism.units.length}"
        yield (
            f"driver '{name}' has no law: it keeps '{driver.bodies[1]}' at {zero}; give "
            "a law, or the positions to analyse"
        )


def _without_inertia(data: Mapping[str, Any], mechanism: Mechanism) -> list[str]:
    """Bodies that turn, with a mass and no word about their inertia."""
    by_joints = {
        body
        for joint in mechanism.joints
        if joint.parallel and "ground" in (joint.i.body, joint.j.body)
        for body in (joint.i.body, joint.j.body)
    }
    found = {}
    for name, entry in _tables(data, "bodies"):
        if {"inertia", "spread"} & entry.keys() or name in by_joints:
            continue
        key = "weight" if "weight" in entry else "mass"
        if key in entry and entry[key] not in (0, "0"):
            found[name] = (
                f"body '{name}' has a {key} and no inertia: it is taken as a point mass at its "
                "mass centre, I = 0; give its inertia, or write inertia = 0"
            )
    return of_each(
        found,
        "have a mass or weight and no inertia: they are taken as point masses at their mass "
        "centres, I = 0; give their inertias, or write inertia = 0",
    )
