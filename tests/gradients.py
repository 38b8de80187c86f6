"""Exact derivatives of driven analyses against a complex step through dense equations.

    python -m tests.gradients                 the gallery and 200 random linkages
    python -m tests.gradients machines        200 random mechanisms of elements of any kind
    python -m tests.gradients machines 6 55   those of these seeds
    python -m tests.gradients norton_fourbar  one model of the gallery
    python -m tests.gradients 17              the random linkage of that seed

An error is the difference beside the greatest derivative of its kind (positions, velocities,
accelerations, forces) by that number, or the greatest number of that kind by the size of the
number. At most 1e-12 of it is allowed, times the condition number of Φ_q where that exceeds 1e3.
The reactions of redundant rows are those of least norm by a proximal term of 1e-9, whose inverse
is their condition number; of machines those of joints with such rows are left out, as their least
norm is of other units there. Beside them motion and other forces may be off by 1e-10.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mbody
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.dual_solution import checked_names
from tests.support.complex_loads import KNOWN
from tests.support.complex_oracle import ComplexOracle, Unwritten, derivative

#: Error allowed, and the condition number from which on it grows.
ALLOWED, CONDITION = 1e-12, 1e3
#: A derivative whose effect is this part of the greatest effect of any number is judged by that.
SMALL = 1e-2
#: Error beside redundant rows, where their proximal iteration ends.
SOFT = 1e-10
ANALYSES = {
    "kinematics": mbody.kinematics,
    "kinetostatics": mbody.kinetostatics,
    "statics": mbody.statics,
}


@dataclass
class Compared:
    """What one mechanism gave.

    Attributes
    ----------
    worst : float
        Greatest error, beside what is allowed at its condition number.
    where : str
    condition : float
        The greatest condition number.
    numbers : int
        Derivatives by so many numbers, times instants.
    skipped : list of str
        Numbers with which alone loops do not close.
    """

    worst: float = 0.0
    where: str = ""
    condition: float = 0.0
    numbers: int = 0
    skipped: list[str] = field(default_factory=list)


def compared(
    system: Any,
    analysis: str,
    t: Any,
    names: Sequence[str] | None = None,
    step: int = 1,
    shared: bool = True,
    in_turn: bool = False,
) -> Compared:
    """All instants of one analysis by the named numbers, by default every `step`th of all; with
    the forces that redundant rows share, or without; `in_turn`: each number at one of the instants,
    the next number at the next instant.

    Raises
    ------
    Unwritten
        For an element that the dense equations do not have.
    """
    if any(type(load) not in KNOWN for load in system.mechanism.loads):
        raise Unwritten("a load")
    run = ANALYSES[analysis](system, t=np.asarray(t))
    names = list(checked_names(system, names))[::step]
    instants = DrivenInstants(run, names)
    whole = instants.at(np.arange(len(run.t)), False)
    ours, found = _histories(whole, analysis), Compared()
    own = slice(None) if shared else _own_forces(run)
    found.skipped = sorted(instants.unclosed)
    greatest: dict[str, float] = {}
    for kind, (slopes, _) in ours.items():
        sizes = np.array([_size(system, name) for name in names])
        greatest[kind] = float((np.abs(slopes).max(axis=(0, 1)) * sizes).max(initial=0.0))
    real: dict[int, Any] = {}
    for k, name in enumerate(names):
        if name in instants.unclosed:
            continue
        for instant, time in enumerate(run.t):
            if in_turn and instant != k % len(run.t):
                continue
            q = run.record.table(slice(0, system.coordinates))[instant]
            oracle = ComplexOracle(system, name, float(time))
            truth = oracle.solve(q, analysis == "statics", real.get(instant))
            real[instant] = truth["real"]
            condition = _condition(system, truth["g"])
            found.condition = max(found.condition, condition)
            soft = 1.0 / run.regularization if run.regularization else 0.0
            allowed = ALLOWED * max(1.0, condition / CONDITION)
            size = _size(system, name)
            for kind, rows in _told(truth, system, analysis).items():
                mine, value = ours[kind][0][instant, :, k], ours[kind][1][instant]
                most = max(np.abs(rows).max(), np.abs(value).max() / size)
                scale = max(most, SMALL * greatest[kind] / size, 1e-300)
                apart = np.abs(mine - rows)[own if kind == "forces" else slice(None)]
                error = float(apart.max(initial=0.0) / scale) / allowed * ALLOWED
                if soft and not shared:
                    error *= ALLOWED / SOFT
                elif kind == "forces" and soft:
                    error /= soft / CONDITION
                if not error <= found.worst:
                    found.worst, found.where = error, f"{kind} by {name} at t = {time:g}"
            found.numbers += 1
    return found


def _size(system: Any, name: str) -> float:
    value = abs(float(system.values[name]))
    lengths = name.endswith((".x", ".y"))
    return max(value, system.length) if lengths else value or 1.0


def _condition(system: Any, g: Any) -> float:
    """Of Φ_q, rows and columns without units."""
    units = system.coordinate_units
    scaled = g.real * units / np.abs(g.real * units).max(axis=1, keepdims=True)
    return float(np.linalg.cond(scaled))


def _histories(whole: Any, analysis: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Tangents (instants, rows, names) and values (instants, rows) by kind."""
    system, record = whole.system, whole.record
    n, units = system.coordinates, system.coordinate_units
    found = {}
    for k, kind in enumerate(("position", "velocity", "acceleration")):
        rows = slice(k * n, (k + 1) * n)
        values = record.values[:, rows] / units
        found[kind] = (record.tangents[:, rows] / units[:, None], values)
    if analysis != "kinematics":
        parts: list[Any] = []
        for joint in system.mechanism.joints:
            one = whole.reaction(joint.name)
            parts += [one.fx, one.fy, one.torque / system.length]
        for driver in system.mechanism.drivers:
            unit = system.length if driver.angular else 1.0
            parts.append(whole.effort(driver.name) / unit)
        count, width = record.tangents.shape[0], record.tangents.shape[2]
        values = np.array([np.broadcast_to(_value(x), count) for x in parts]).T
        slopes = [np.broadcast_to(getattr(x, "tangents", 0.0), (count, width)) for x in parts]
        found["forces"] = (np.array(slopes).transpose(1, 0, 2), values)
    return found


def _own_forces(run: Any) -> np.ndarray:
    """Places, as of `_histories`, of the forces of joints and drivers without redundant rows."""
    machine, shared = run.mechanism, run.dependencies or {}
    flags: list[bool] = []
    for joint in machine.joints:
        flags += 3 * [any(shared.get(joint.name, [False]))]
    flags += [any(shared.get(driver.name, [False])) for driver in machine.drivers]
    return np.flatnonzero(~np.array(flags, dtype=bool))


def _value(x: Any) -> Any:
    return getattr(x, "value", x)


def _told(truth: dict[str, Any], system: Any, analysis: str) -> dict[str, np.ndarray]:
    """Derivatives (rows,) by kind, as the dense equations have them."""
    units = system.coordinate_units
    kinds = {"position": "q", "velocity": "v", "acceleration": "a"}
    found = {kind: derivative(truth[key]) / units for kind, key in kinds.items()}
    if analysis != "kinematics":
        parts: list[Any] = []
        for joint in system.mechanism.joints:
            fx, fy, torque = truth["reactions"][joint.name]
            parts += [fx, fy, torque / system.length]
        for driver in system.mechanism.drivers:
            unit = system.length if driver.angular else 1.0
            parts.append(truth["efforts"][driver.name] / unit)
        found["forces"] = derivative(np.array(parts))
    return found


def gallery() -> Iterator[tuple[str, Any]]:
    """The driven models of the gallery."""
    for name in mbody.gallery.names():
        machine = mbody.gallery.load(name)
        if machine.drivers:
            yield name, mbody.assemble(machine)


def linkage(seed: int) -> tuple[str, Any, np.ndarray]:
    """A random linkage with loads of every kind, and two instants of its motion."""
    from tests.support.linkages import random_linkage

    loops, sliders = 2 + seed % 2, seed % 3 > 0
    machine, turn = random_linkage(seed, loops, sliders=sliders, extras=seed % 5 == 0)
    law = machine["motor"].law  # type: ignore[attr-defined]
    t = 0.5 * min(turn, 3.0) / abs(law.speed)
    return f"linkage {seed}", mbody.assemble(machine), np.array([0.3 * t, t])


def machine(seed: int) -> tuple[str, Any, np.ndarray]:
    """A random mechanism of elements of any kind, and an instant of its motion."""
    from tests.campaign.drawing import random_linkage
    from tests.campaign.loads import random_loads

    drawn = random_linkage(seed)
    acting = random_loads(drawn)
    described = drawn.mechanism("machine")
    described.add(*acting.elements)
    return f"machine {seed}", mbody.assemble(described), drawn.span * np.array([0.37])


#: Every so many numbers of a machine.
OF_MACHINES = 9


def main(arguments: Sequence[str]) -> int:
    warnings.simplefilter("ignore")
    worst = 0.0
    for name, system, t in _cases(arguments):
        for analysis in ANALYSES:
            try:
                drawn = name.startswith("machine ")
                step = OF_MACHINES if drawn else 1
                found = compared(system, analysis, t, step=step, shared=not drawn)
            except (Unwritten, mbody.SolveError) as why:
                print(f"{name:28} {analysis:14} left out: {str(why)[:60]}", flush=True)
                continue
            worst = max(worst, found.worst) if found.worst == found.worst else np.inf
            print(
                f"{name:28} {analysis:14} {found.worst:8.1e}  condition {found.condition:8.1e}  "
                f"{found.numbers:5} derivatives  {found.where}",
                flush=True,
            )
    print(f"worst {worst:.1e} of at most {ALLOWED:.0e}")
    return int(not worst <= ALLOWED)


def _cases(arguments: Sequence[str]) -> Iterator[tuple[str, Any, np.ndarray]]:
    if arguments[:1] == ["machines"]:
        for seed in map(int, arguments[1:] or range(200)):
            yield machine(seed)
        return
    named = [one for one in arguments if not one.isdigit()]
    seeds = [int(one) for one in arguments if one.isdigit()]
    for name, system in gallery():
        if not arguments or name in named:
            yield name, system, np.array([0.013, 0.047])
    for seed in seeds or ([] if arguments else range(200)):
        yield linkage(seed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
