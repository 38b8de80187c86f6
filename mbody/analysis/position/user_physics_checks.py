"""Users' own physics, looked at where an analysis begins: purity, and derivatives of joints."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.system.system import System

Array = np.ndarray
#: What is wrong, in which row, what was given, what it should be, and by which rule.
Finding = tuple[str, int, float, float, str]
Hook = Callable[[Array, Array], None]

#: Steps of differences, in radians, model lengths and units of time: a right derivative agrees with
#: one of them, whatever its scale.
STEPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
#: Part of the greatest term by which a derivative may be off: users may find theirs by differences.
OFF = 1e-4
#: Positions that are tried; a derivative is wrong where it is at each of them.
PROBES = 3
#: Two answers to the same question may differ by this part: nothing, but for another summation.
SAME = 1e-12


def check_own(system: System, t: float, pose: Array) -> None:
    """Refuse functions that give another answer to the same question, and joints whose Φ_q, ν or γ
    are not those of their Φ; once for a topology.
    """
    if not system.has_user_code or "own physics" in system.plans:
        return
    rng = np.random.default_rng(0)
    with np.errstate(all="ignore"):
        for name, hook, questions, size in _functions(system, t, pose, rng):
            _check_pure(name, hook, questions, size)
        for e, (name, rows) in enumerate(system.functions[: len(system.owners)]):
            if rows is not None:
                _check_derivatives(_Joint(system, e, name, rows, t, pose), rng)
    system.plans["own physics"] = True


def _functions(
    system: System, t: float, pose: Array, rng: np.random.Generator
) -> Iterator[tuple[str, Hook, list[Array], int]]:
    """Every function with its name, some questions to it, and how many numbers it answers."""
    L, par = system.layout, system.par[:, 0]
    joints, loads = len(L.primitive_kind), len(L.action_kind)
    times = t, t + 1e-3, t + 0.37
    poses = pose, _near(system, pose, rng), _near(system, pose, rng)
    rates = [_rates(system, pose, rng) for _ in times]
    for n, (name, hook) in enumerate(system.functions):
        if hook is None:
            continue
        if n >= joints + loads:
            yield name, hook, [np.array([time]) for time in times], 3
            continue
        if n < joints:
            i, j, size = L.primitive_i[n], L.primitive_j[n], 18
            o, count = L.primitive_par[n], L.primitive_count[n]
        else:
            k = n - joints
            i, j, size = L.action_i[k], L.action_j[k], 6
            o, count = L.action_par[k], L.action_count[k]
        own = par[o : o + count]
        questions = [
            np.concatenate([[time], _side(q, v, i), _side(q, v, j), own])
            for time, q, v in zip(times, poses, rates, strict=True)
        ]
        yield name, hook, questions, size


def _near(system: System, pose: Array, rng: np.random.Generator) -> Array:
    """A pose not far away; the ground stays."""
    size = np.tile([system.length, system.length, 1.0], len(pose) // 3)
    size[-3:] = 0.0
    found: Array = pose + 0.1 * size * rng.normal(size=len(pose))
    return found


def _rates(system: System, pose: Array, rng: np.random.Generator) -> Array:
    """Rates of about a model length and a radian in the unit of time; the ground has none."""
    return _near(system, np.zeros_like(pose), rng) * 10.0


def _side(q: Array, v: Array, body: int) -> Array:
    """(x, y, θ, cos θ, sin θ, vx, vy, ω) of a body."""
    x, y, angle = q[3 * body : 3 * body + 3]
    return np.array([x, y, angle, np.cos(angle), np.sin(angle), *v[3 * body : 3 * body + 3]])


def _answer(hook: Hook, question: Array, size: int) -> Array | None:
    """What a function gives; None where it cannot be evaluated."""
    found = np.zeros(size)
    try:
        hook(question.copy(), found)
    except Exception:  # whatever it is, the analysis says it where it is met
        return None
    return found


def _check_pure(name: str, hook: Hook, questions: list[Array], size: int) -> None:
    first, second = ([_answer(hook, q, size) for q in questions] for _ in range(2))
    for question, a, b in zip(questions, first, second, strict=True):
        if a is None or b is None:
            continue
        far = ~(np.abs(a - b) <= SAME * np.abs(a).max()) & np.isfinite(a)
        if far.any():
            n = int(far.argmax())
            raise ModelError(
                f"the function of '{name}' keeps a memory: called twice with the same arguments at "
                f"t = {question[0]:g} it returned {a[n]:g} and then {b[n]:g}; it is called several "
                "times an instant, and at times that go back: its result must depend on its "
                "arguments alone; for a memory use a State, for a sampled controller a Controller",
                name,
            )


class _Joint:
    """A user's joint at states of its two bodies."""

    def __init__(
        self, system: System, e: int, name: str, hook: Hook, t: float, pose: Array
    ) -> None:
        L = system.layout
        self.system, self.name, self.hook, self.t, self.pose = system, name, hook, t, pose
        self.rows = len(system.row_kinds[e])
        self.bodies = int(L.primitive_i[e]), int(L.primitive_j[e])
        o = L.primitive_par[e]
        self.own = system.par[o : o + L.primitive_count[e], 0]
        self.moving = [b for b in self.bodies if b < L.bodies]

    def at(self, t: float, q: Array, v: Array) -> tuple[Array, Array, Array, Array] | None:
        """Φ (rows,), Φ_q (rows, 3 · moving bodies), ν and γ."""
        i, j = self.bodies
        question = np.concatenate([[t], _side(q, v, i), _side(q, v, j), self.own])
        y = _answer(self.hook, question, 18)
        if y is None:
            return None
        blocks = y[2:14].reshape(2, 2, 3)
        sides = [blocks[n, : self.rows] for n, b in enumerate(self.bodies) if b in self.moving]
        n = self.rows
        return y[:n], np.concatenate(sides, axis=1), y[14 : 14 + n], y[16 : 16 + n]

    @property
    def columns(self) -> Array:
        """Coordinates of the moving bodies."""
        return np.concatenate([np.arange(3 * b, 3 * b + 3) for b in self.moving])


def _check_derivatives(joint: _Joint, rng: np.random.Generator) -> None:
    """Refuse a joint that is wrong at every place where it was looked at."""
    found = []
    for _ in range(PROBES):
        q, v = _near(joint.system, joint.pose, rng), _rates(joint.system, joint.pose, rng)
        a = _rates(joint.system, joint.pose, rng)
        try:
            found.append(_wrong(joint, q, v, a))
        except _Unanswered:
            continue
    if len(found) < 2 or None in found:
        return
    what, row, given, wanted, by = found[0] or ("", 0, 0.0, 0.0, "")
    raise ModelError(
        f"the physics of '{joint.name}' gives {what} of row {row} as {given:.6g}, but {by} is "
        f"{wanted:.6g} by differences: correct it; mbody.testing.check_joint tries it further",
        joint.name,
    )


class _Unanswered(Exception):
    """The function could not be evaluated there."""


def _wrong(
    joint: _Joint, q: Array, v: Array, a: Array
) -> tuple[str, int, float, float, str] | None:
    """The first derivative at one state that is not that of Φ: what, row, given, wanted, by."""
    t, columns = joint.t, joint.columns
    unit = np.tile([joint.system.length, joint.system.length, 1.0], len(joint.moving))

    def evaluated(time: float, q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        answer = joint.at(time, q, v)
        if answer is None:
            raise _Unanswered
        return answer

    phi, G, nu, gamma = evaluated(t, q, v)
    size = np.maximum(np.abs(G * unit).max(axis=1), np.abs(phi))
    for m, column in enumerate(columns):
        move = np.zeros_like(q)
        move[column] = unit[m]

        def shifted(s: float, move: Array = move) -> Array:
            return evaluated(t, q + s * move, v)[0]

        slopes = _slopes(shifted)
        bad = _off(G[:, m] * unit[m], slopes, size)
        if bad is not None:
            row, wanted = bad
            name = joint.system.mechanism.bodies[int(column) // 3].name
            partial = f"∂Φ/∂{'xyθ'[m % 3]} of '{name}'"
            return "Φ_q", row, float(G[row, m]), wanted / float(unit[m]), partial
    bad = _off(nu, _slopes(lambda s: -evaluated(t + s, q, v)[0]), np.maximum(size, np.abs(nu)))
    if bad is not None:
        return "ν", bad[0], float(nu[bad[0]]), bad[1], "−∂Φ/∂t"

    def rate(s: float) -> Array:
        _, there, moved, _ = evaluated(t + s, q + s * v + 0.5 * s * s * a, v + s * a)
        left: Array = G @ a[columns] * s - there @ (v + s * a)[columns] + moved
        return left

    terms = np.abs(G * a[columns]), np.abs(G * v[columns]), np.abs(gamma)[:, None]
    bad = _off(gamma, _slopes(rate), np.column_stack(terms).max(axis=1))
    if bad is not None:
        return "γ", bad[0], float(gamma[bad[0]]), bad[1], "Φ_q a − d²Φ/dt²"
    return None


def _slopes(function: Callable[[float], Array]) -> list[Array]:
    """Central differences at 0, of every step."""
    return [(function(h) - function(-h)) / (2.0 * h) for h in STEPS]


def _off(given: Array, slopes: list[Array], size: Any) -> tuple[int, float] | None:
    """The row, and what it should be, of a derivative that no step agrees with."""
    error = np.min([np.abs(slope - given) for slope in slopes], axis=0)
    bad = np.flatnonzero(~(error <= OFF * np.maximum(size, 1e-300)))
    if not bad.size:
        return None
    row = int(bad[0])
    return row, float(slopes[2][row])
