"""Cost of one evaluation of the accelerations, by the number of bodies."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from typing import Any

import numpy as np

import mbody
from benchmarks.frame import OURS, Row, Scope, available, timed
from benchmarks.models import SHAPES
from benchmarks.peers import drake, mujoco, pinocchio, pymunk
from benchmarks.planar import GROUND, Planar, absolute, planar
from mbody.engineering import close_loops

__all__ = ["TITLE", "measure"]

TITLE = (
    "One evaluation of the accelerations by the number of bodies; error of the angular "
    "accelerations at the start, as a part"
)
SIZES = (10, 100, 1000, 10_000)
MODULES = {
    "Pinocchio": "pinocchio",
    "MuJoCo RK4": "mujoco",
    "Drake": "pydrake",
    "pymunk step": "pymunk",
}
#: Sizes beyond which a peer is not measured: memory or time would run out.
MOST = {
    "Pinocchio": {"chain": 100, "ladder": 100, "tree": 100, "hub": 100},
    "MuJoCo RK4": {"chain": 1000, "ladder": 1000, "tree": 1000, "hub": 1000},
    "Drake": {"chain": 1000, "ladder": 0, "tree": 1000, "hub": 1000},
    "pymunk step": {"chain": 1000, "ladder": 1000, "tree": 1000, "hub": 1000},
}


def measure(scope: Scope) -> list[Row]:
    """Every shape and size; the short form to 100 bodies."""
    found = []
    for shape, make in SHAPES.items():
        for count in SIZES[:2] if scope.short else SIZES:
            found += one(shape, count, make(count), scope)
    return found


def one(shape: str, count: int, model: mbody.Mechanism, scope: Scope) -> list[Row]:
    """All engines in turn at one size."""
    workload = f"{shape} of {count}, one evaluation"
    scope.progress(f"  {workload}")
    system = mbody.assemble(model)
    machine = planar(system)
    reference = accelerations(machine)
    size = np.abs(reference).max()
    tasks: dict[str, Callable[[], float]] = {}
    errors: dict[str, float] = {}
    makers = [(OURS, our_task), ("Pinocchio", pin_task), ("MuJoCo RK4", mujoco_task)]
    makers += [("Drake", drake.task), ("pymunk step", pymunk_task)]
    for name, maker in makers:
        if name != OURS and (count > MOST[name][shape] or not available(MODULES[name])):
            continue
        tasks[name], alpha = maker(system if name == OURS else machine)
        errors[name] = float(np.abs(alpha - reference).max() / size)
        tasks[name]()
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(scope.runs):
        for name, task in tasks.items():
            times[name].append(task())
    rows = []
    for name, values in times.items():
        ratio = statistics.median(a / b for a, b in zip(values, times[OURS]))
        median = statistics.median(values)
        scope.progress(f"    {name}: {1e6 * median:.2f} µs, error {errors[name]:.1e}")
        rows.append(Row("bodies", workload, name, errors[name], median, len(values), ratio))
    return rows


def accelerations(machine: Planar) -> np.ndarray:
    """Angular accelerations by one sparse LU of [M Φ_qᵀ; Φ_q 0] with scipy: a route of its own."""
    from scipy.sparse.linalg import splu

    matrix, right = equations(machine)
    factor = splu(matrix)
    found = factor.solve(right)
    found += factor.solve(right - matrix @ found)
    return found[2 : 3 * machine.bodies : 3]


def equations(machine: Planar) -> tuple[Any, np.ndarray]:
    """[M Φ_qᵀ; Φ_q 0] as a sparse matrix, and the right-hand side, at the start."""
    from scipy.sparse import coo_matrix

    n, rows = machine.bodies, 2 * len(machine.pins)
    at, to, values = [], [], []
    right = np.zeros(3 * n + rows)
    for k in range(n):
        for axis, weight in enumerate((machine.mass[k], machine.mass[k], machine.inertia[k])):
            at.append(3 * k + axis), to.append(3 * k + axis), values.append(weight)
        right[3 * k + 1] = machine.mass[k] * machine.gravity
    for k, (i, j, on_i, on_j) in enumerate(machine.pins):
        for body, (x, y), sign in ((i, on_i, 1.0), (j, on_j, -1.0)):
            if body == GROUND:
                continue
            c, s = np.cos(machine.pose[body, 2]), np.sin(machine.pose[body, 2])
            px, py, w = c * x - s * y, s * x + c * y, machine.rate[body, 2]
            for row, entries in enumerate((((0, 1.0), (2, -py)), ((1, 1.0), (2, px)))):
                for axis, value in entries:
                    r, column = 3 * n + 2 * k + row, 3 * body + axis
                    at.extend((r, column)), to.extend((column, r))
                    values.extend((sign * value, sign * value))
            right[3 * n + 2 * k : 3 * n + 2 * k + 2] += sign * w * w * np.array([px, py])
    return coo_matrix((values, (at, to)), shape=(right.size, right.size)).tocsc(), right


def our_task(system: mbody.System) -> tuple[Callable[[], float], np.ndarray]:
    """Seconds an evaluation in `simulate`, steps and projections included.

    Two lengths of motion are timed, so that what a call costs once falls out.
    """
    start = close_loops(system)
    first = mbody.simulate(system, 1e-9, start=start, instants=2)
    alpha = np.array([first[body.name].alpha[0] for body in system.mechanism.bodies])
    count = len(alpha)
    short, long = 0.02, 0.3
    turns = min(40, max(1, 400 // count))

    def least(until: float) -> tuple[float, int]:
        spent, found = timed(
            lambda: mbody.simulate(system, until, start=start, rtol=1e-8, instants=2), times=turns
        )
        return spent, found.stats["evaluations"]

    def task() -> float:
        (brief, few), (whole, many) = least(short), least(long)
        return (whole - brief) / (many - few)

    return task, alpha


def pin_task(machine: Planar) -> tuple[Callable[[], float], np.ndarray]:
    """Seconds of one call of `aba`, or of `constraintDynamics` where there are loops."""
    made = pinocchio.Pinocchio(machine)
    times = max(3, 2000 // machine.bodies)

    def task() -> float:
        return timed(lambda: [made.slope(0.0, made.start) for _ in range(times)])[0] / times

    return task, made.state(made.slope(0.0, made.start))[1]


def mujoco_task(machine: Planar) -> tuple[Callable[[], float], np.ndarray]:
    """A quarter of a step of RK4."""
    import mujoco as engine

    tree = machine.tree()
    model = mujoco.model_of(machine, tree, 1e-4)
    data = mujoco.start_of(machine, tree, model)
    engine.mj_forward(model, data)
    relative = np.array([data.qacc[model.joint(f"j{b}").dofadr[0]] for b in tree.order])
    times = max(1, 4000 // machine.bodies)

    def task() -> float:
        fresh = mujoco.start_of(machine, tree, model)
        return timed(lambda: engine.mj_step(model, fresh, nstep=times))[0] / (4 * times)

    return task, absolute(tree, relative)


def pymunk_task(machine: Planar) -> tuple[Callable[[], float], np.ndarray]:
    """One step of 30 iterations; its accelerations from the first velocities."""
    step = 1e-4
    space, bodies = pymunk.space_of(machine)
    space.step(step)
    alpha = (np.array([b.angular_velocity for b in bodies]) - machine.rate[:, 2]) / step
    times = max(3, 10_000 // machine.bodies)

    def steps(fresh: Any) -> None:
        for _ in range(times):
            fresh.step(step)

    def task() -> float:
        fresh, held = pymunk.space_of(machine)
        spent = timed(lambda: steps(fresh))[0] / times
        del held
        return spent

    return task, alpha
