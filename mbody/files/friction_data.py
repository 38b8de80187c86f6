"""What results say of friction as plain lists: losses, modes, ranges, uniqueness, jams."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.one_sided_constraint import joined

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["friction_columns", "friction_data"]


def friction_data(solution: Solution) -> dict[str, Any]:
    """``{"losses", "modes", "ranges", "friction"}`` of mechanisms with rough joints, else empty.

    A range of a reaction has (fx, fy, torque) of each instant; None stands for what is infinite.

    >>> import mbody
    >>> friction_data(mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)))
    {}
    """
    report = solution.friction
    if report is None:
        return {}
    certified = report.certified
    same = bool((certified == certified.flat[0]).all()) if certified.size else True
    found: dict[str, Any] = {
        "losses": {name: _list(power) for name, power in solution.losses.items()},
        "modes": {name: solution.mode(name) for name in solution.modes or solution.losses},
        "friction": {
            "certified": bool(certified.all()) if same else certified.tolist(),
            "jams": [jam._asdict() for jam in report.jams],
        },
    }
    if solution.analysis != "simulate":
        found["ranges"] = _ranges(solution)
    return found


def _ranges(solution: Solution) -> dict[str, Any]:
    """Of the efforts and reactions that joints at rest leave open."""
    efforts, reactions = {}, {}
    if not solution.resting:
        return {"efforts": {}, "reactions": {}}
    machine = solution.mechanism
    for one in (*machine.couplings, *machine.drivers):
        limits = solution.range(one.name)
        if not np.array_equal(limits.low, limits.high, equal_nan=True):
            efforts[one.name] = {"low": _list(limits.low), "high": _list(limits.high)}
    for joint in joined(machine):
        limits = solution.range(joint.name)
        low, high = (
            np.stack([one.fx, one.fy, one.torque], axis=-1) for one in (limits.low, limits.high)
        )
        if not np.array_equal(low, high, equal_nan=True):
            reactions[joint.name] = {"low": _list(low), "high": _list(high)}
    return {"efforts": efforts, "reactions": reactions}


def _list(values: Any) -> list[Any]:
    """Numbers, None where there is none."""
    array = np.asarray(values, dtype=float) + 0.0
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return list(plain.tolist())


def friction_columns(solution: Solution) -> dict[str, np.ndarray]:
    """Losses by joint, and the limits of efforts that joints at rest leave open."""
    unit = solution.mechanism.units.of
    table = {f"{name}.loss [{unit('power')}]": loss for name, loss in solution.losses.items()}
    if solution.analysis == "simulate" or not solution.losses or not solution.resting:
        return table
    for one in (*solution.mechanism.couplings, *solution.mechanism.drivers):
        limits, effort = solution.range(one.name), unit(one.effort_dimension)
        if not np.array_equal(limits.low, limits.high, equal_nan=True):
            table[f"{one.name}.effort_low [{effort}]"] = limits.low
            table[f"{one.name}.effort_high [{effort}]"] = limits.high
    return table
