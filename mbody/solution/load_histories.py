"""What loads do over the instants of a solution: their forces, and lengths, angles and rates."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.kernels.load_breakdown import each_load
from mbody.model.element import Element, listed
from mbody.model.loads import Load
from mbody.solution.histories import LoadHistory
from mbody.solution.own_histories import motion_rows
from mbody.solution.places import column
from mbody.solution.result import Result

__all__ = ["argument", "load_history", "stretched", "turned"]

Array = np.ndarray


def load_history(solution: Result, name: str, on: str | None = None) -> LoadHistory:
    """The histories of a load; see `Solution.load`."""
    loads = {load.name: load for load in solution.mechanism.loads}
    if not isinstance(name, str) or name not in loads:
        raise ModelError(f"there is no load {name!r} (there are: {listed(loads)})", str(name))
    load = loads[name]
    sides = load.sides()
    if not sides:
        return _on_all(solution, load, on)
    default = list(sides)[-1]
    body = default if on is None else on
    if body not in sides or (body == "ground" and not load.acts_on_ground):
        acting = listed(side for side in sides if side != "ground")
        raise ModelError(f"load '{name}' has no history on {on!r} (it has on: {acting})", name)
    other = next((side for side in sides if side != body), "ground")
    # the ground has no coordinates: there the opposite of what acts on the other body
    moving = body if body != "ground" else other
    fx, fy, torque = _forces(solution, load, moving)
    if moving != body:
        fx, fy = -fx, -fy
        torque = _moved(solution, load, -torque, fx, fy, moving, sides[body])
    else:
        torque = _moved(solution, load, torque, fx, fy, moving, sides[moving])
    force, length, angle, rate = np.hypot(fx, fy), None, None, None
    if load.along_line:
        length, rate, (ux, uy) = stretched(solution, load)
        sign = 1.0 if sides[body] == "i" else -1.0
        force, torque = sign * (fx * ux + fy * uy), 0.0 * torque
    elif load.by_angle:
        angle, rate = turned(solution, load)
    beside = beside_line(solution, load) if load.on_line else (None,) * 4
    return LoadHistory(name, body, other, fx, fy, torque, force, length, angle, rate, *beside)


def argument(solution: Result, element: Any, field: str) -> Array | None:
    """What a law of an element is evaluated at, over the instants; None where that is not known."""
    of = element.__dataclass_fields__[field].metadata["of"]
    if of == "time":
        return solution.t
    found = _measured(solution, element)
    if found is None:
        return None
    if of in ("length", "angle"):
        return found[0] - _own(solution, element, element.free)
    return found[1]


def argument_rate(solution: Result, element: Any, field: str) -> Array | None:
    """Rate of `argument`; None where that is not known."""
    of = element.__dataclass_fields__[field].metadata["of"]
    found = _measured(solution, element) if of in ("length", "angle") else None
    return None if found is None else found[1]


def _measured(solution: Result, element: Any) -> tuple[Array, Array] | None:
    """The length or angle that a load goes by, and its rate."""
    if element.role != "load":
        return None
    if element.along_line:
        return stretched(solution, element)[:2]
    return turned(solution, element) if element.by_angle else None


def _own(solution: Result, element: Element, key: str) -> Any:
    """A number of an element, a column of designs in a batch."""
    return column(solution.system.values[f"{element.name}.{key}"])


def _on_all(solution: Result, load: Load, on: str | None) -> LoadHistory:
    bodies = [body.name for body in solution.mechanism.bodies]
    if on not in bodies:
        raise ModelError(
            f"'{load.name}' acts on every body: name one, as in load({load.name!r}, "
            f"on={bodies[0]!r})",
            load.name,
        )
    fx, fy, torque = _forces(solution, load, str(on))
    return LoadHistory(load.name, str(on), "ground", fx, fy, torque, np.hypot(fx, fy))


def _forces(solution: Result, load: Load, body: str) -> tuple[Array, Array, Array]:
    """Force and torque about the mass centre on a moving body, as the kernels have them."""
    system = solution.system
    cause = [each.name for each in system.mechanism.loads].index(load.name)
    column = 3 * system.bodies[body]
    kept = solution.record.load_on(cause, column)
    if kept is not None:
        return kept
    motion, batch = motion_rows(solution), solution.record.batch
    pages = motion if batch else motion[None]
    found = np.empty((len(pages), len(solution.t), 3))
    t = np.array(solution.t)
    for design, page in enumerate(pages):
        output = np.empty((len(solution.t), len(system.mechanism.loads), system.coordinates))
        work = system.work(designs=design if system.batch is not None else 0)
        each_load(system.runtime(), work, np.ascontiguousarray(page), t, output)
        found[design] = output[:, cause, column : column + 3]
    whole = np.moveaxis(found, 2, 0)
    fx, fy, torque = whole if batch else whole[:, 0]
    return fx, fy, torque


def _moved(
    solution: Result, load: Load, torque: Array, fx: Array, fy: Array, body: str, side: str | None
) -> Array:
    """A torque about the mass centre of a body, as one about a place of the load."""
    if side is None:
        return torque
    x, y, _, _ = _end(solution, load, side)
    centre = solution[body]
    return torque - ((x - centre.x) * fy - (y - centre.y) * fx)


def _end(solution: Result, load: Load, side: str) -> tuple[Array, Array, Array, Array]:
    """World place of an end, and its velocity."""
    body = solution[load.place(side).body]
    ax, ay = (column(part) for part in solution.system.numbers.arm(load, side))
    c, s = np.cos(body.angle), np.sin(body.angle)
    px, py = c * ax - s * ay, s * ax + c * ay
    return body.x + px, body.y + py, body.vx - body.omega * py, body.vy + body.omega * px


def stretched(solution: Result, load: Load) -> tuple[Array, Array, tuple[Array, Array]]:
    """Distance of both ends, its rate, and the direction from i to j."""
    (ix, iy, ivx, ivy), (jx, jy, jvx, jvy) = (_end(solution, load, side) for side in "ij")
    dx, dy = jx - ix, jy - iy
    length = np.hypot(dx, dy)
    safe = np.maximum(length, 1e-300)  # ends at one place have no direction
    ux, uy = dx / safe, dy / safe
    return length, ux * (jvx - ivx) + uy * (jvy - ivy), (ux, uy)


def beside_line(solution: Result, load: Load) -> tuple[Array, Array, Array, Array]:
    """Of the place on j beside the line through i on the ground: its height, its velocity along
    and across the line, and the rate of its body.
    """
    (ix, iy, _, _), (jx, jy, vx, vy) = (_end(solution, load, side) for side in "ij")
    angle = column(solution.system.numbers.angle(load, "i"))
    ux, uy = np.cos(angle), np.sin(angle)
    height = ux * (jy - iy) - uy * (jx - ix)
    spin = solution[load.places()["j"].body].omega
    return height, ux * vx + uy * vy, ux * vy - uy * vx, spin


def turned(solution: Result, load: Any) -> tuple[Array, Array]:
    """Angle of a body from the one that carries the opposite torque, and its rate."""
    body, by = solution[load.body], solution[load.by]
    return body.angle - by.angle, body.omega - by.omega
