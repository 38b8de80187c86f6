"""Forces of loads in complex numbers, each kind as its docstring has it."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.model.loads import (
    CentrifugalField,
    Damper,
    Force,
    Gravity,
    PistonPressure,
    ReciprocatingCylinder,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)
from tests.support.complex_reading import remainder
from tests.support.taylor import cos, exp, log, sin, sqrt

__all__ = ["applied"]


def applied(o: Any, q: Any, v: Any) -> Any:
    """Forces on all coordinates (3n,) of a `ComplexOracle`."""
    f = np.zeros(3 * o.n + 3, complex)
    for load in o.mechanism.loads:
        _KINDS[type(load)](o, load, q, v, f)
    return f[:-3]


def _push(o: Any, f: Any, q: Any, body: str, place: Any, force: Any) -> None:
    """A force at a world place."""
    k = 3 * o.index[body]
    x, y, _ = o.pose(q, body)
    f[k] += force[0]
    f[k + 1] += force[1]
    f[k + 2] += (place[0] - x) * force[1] - (place[1] - y) * force[0]


def _velocity(o: Any, q: Any, v: Any, body: str, place: Any) -> tuple[Any, Any]:
    (x, y, _), (vx, vy, w) = o.pose(q, body), o.pose(v, body)
    return vx - w * (place[1] - y), vy + w * (place[0] - x)


def _gravity(o: Any, load: Any, q: Any, v: Any, f: Any) -> None:
    gx, gy = o.p.law(load, "x", o.t), o.p.law(load, "y", o.t)
    for k, body in enumerate(o.mechanism.bodies):
        m, _ = o.p.mass(body)
        f[3 * k] += m * gx
        f[3 * k + 1] += m * gy


def _force(o: Any, load: Any, q: Any, v: Any, f: Any) -> None:
    angle = o.p[f"{load.name}.angle"]
    if load.follows:
        angle = angle + o.heading(q, load, "at")
    size = o.p.law(load, "value", o.t)
    place = o.place(q, load, "at")
    _push(o, f, q, load.at.body, place, (size * cos(angle), size * sin(angle)))


def _between(o: Any, load: Any, q: Any, v: Any, f: Any) -> None:
    i, j = o.place(q, load, "i"), o.place(q, load, "j")
    dx, dy = j[0] - i[0], j[1] - i[1]
    length = sqrt(dx * dx + dy * dy)
    ux, uy = dx / length, dy / length
    (ax, ay), (bx, by) = (
        _velocity(o, q, v, marker.body, at) for marker, at in ((load.i, i), (load.j, j))
    )
    rate = ux * (bx - ax) + uy * (by - ay)
    name = load.name
    if isinstance(load, Spring):
        x = length - o.p[f"{name}.free_length"]
        own = o.p[f"{name}.preload"] + o.p[f"{name}.stiffness"] * x if load.law is None else None
    else:
        x = rate
        own = o.p[f"{name}.coefficient"] * rate if load.law is None else None
    tension = o.p.law(load, "law", x) if own is None else own
    _push(o, f, q, load.i.body, i, (tension * ux, tension * uy))
    _push(o, f, q, load.j.body, j, (-tension * ux, -tension * uy))


def _turning(o: Any, load: Any, q: Any, v: Any, f: Any) -> None:
    name = load.name
    if isinstance(load, Torque):
        torque = o.p.law(load, "value", o.t)
    elif isinstance(load, TorsionSpring):
        x = o.pose(q, load.body)[2] - o.pose(q, load.by)[2] - o.p[f"{name}.free_angle"]
        torque = (
            -(o.p[f"{name}.preload"] + o.p[f"{name}.stiffness"] * x)
            if load.law is None
            else -o.p.law(load, "law", x)
        )
    else:
        x = o.pose(v, load.body)[2] - o.pose(v, load.by)[2]
        torque = -o.p[f"{name}.coefficient"] * x if load.law is None else -o.p.law(load, "law", x)
    f[3 * o.index[load.body] + 2] += torque
    f[3 * o.index[load.by] + 2] -= torque


def _thrust(o: Any, load: Any, q: Any, f: Any, size: Any) -> None:
    """Along the line of stroke on the piston, and the opposite on the cylinder on the same line."""
    axis, place = o.heading(q, load, "i"), o.place(q, load, "j")
    fx, fy = size * cos(axis), size * sin(axis)
    _push(o, f, q, load.j.body, place, (fx, fy))
    _push(o, f, q, load.i.body, place, (-fx, -fy))


def _pressure(o: Any, load: Any, q: Any, v: Any, f: Any) -> None:
    name = load.name
    angle = remainder(o.pose(q, load.cycle)[2] + o.p[f"{name}.phase"])
    head = o.p[f"{name}.head_area"] * o.p.law(load, "head", angle)
    rod = o.p[f"{name}.rod_area"] * o.p.law(load, "rod", angle)
    _thrust(o, load, q, f, head - rod)


def _cylinder(o: Any, load: Any, q: Any, v: Any, f: Any) -> None:
    i, j, axis = o.place(q, load, "i"), o.place(q, load, "j"), o.heading(q, load, "i")
    dx, dy, c, s = j[0] - i[0], j[1] - i[1], cos(axis), sin(axis)
    along = c * dx + s * dy
    (ax, ay), (bx, by) = (
        _velocity(o, q, v, marker.body, at) for marker, at in ((load.i, i), (load.j, j))
    )
    w = o.pose(v, load.i.body)[2]
    rate = c * (bx - ax) + s * (by - ay) + w * (c * dy - s * dx)
    near, far = o.p[f"{load.name}.near"], o.p[f"{load.name}.far"]
    size = o.p[f"{load.name}.area"] * _charge(o, load, near, far, along, rate)
    if load.opposite_area is not None:
        other = o.p[f"{load.name}.opposite_area"]
        size = size - other * _charge(o, load, far, near, along, rate)
    way = 1.0 if load.far > load.near else -1.0
    _thrust(o, load, q, f, size * way)


def _charge(o: Any, load: Any, near: Any, far: Any, x: Any, rate: Any) -> Any:
    """Pressure of the chamber that is least with the piston at `near`."""
    n = load.name
    grow = 1.0 if complex(far).real > complex(near).real else -1.0
    stroke, way, c = grow * (far - near), grow * (x - near), o.p[f"{n}.clearance"]
    suction, delivery = o.p[f"{n}.suction"], o.p[f"{n}.delivery"]
    if complex(way).real <= 0.0 or complex(way).real >= complex(stroke).real:
        return delivery if complex(way).real <= 0.0 else suction
    grows = complex(rate).real * grow > 0.0
    p, full = (delivery, c) if grows else (suction, c + stroke)
    ratio = full / (c + way)
    if load.exponent is None:
        p = p + o.p[f"{n}.bulk_modulus"] * log(ratio)
    else:
        ambient = o.p[f"{n}.ambient"]
        p = (p + ambient) * exp(o.p[f"{n}.exponent"] * log(ratio)) - ambient
    if grows:
        return p if complex(p).real > complex(suction).real else suction
    return p if complex(p).real < complex(delivery).real else delivery


def _spin(o: Any, load: Any, q: Any, v: Any, f: Any) -> None:
    """ω² x n dm on every mass element, by second moments of the bodies."""
    x0, y0 = o.place(q, load, "axis")
    angle = o.p[f"{load.name}.axis.angle"]
    nx, ny = -sin(angle), cos(angle)
    parts = []
    whole = o.p[f"{load.name}.inertia"]
    for k, body in enumerate(o.mechanism.bodies):
        m, inertia = o.p.mass(body)
        x, y, turn = o.pose(q, body.name)
        xx = yy = xy = 0.0
        if hasattr(body.spread, "angle"):
            c, s = cos(o.p[f"{body.name}.spread.angle"]), sin(o.p[f"{body.name}.spread.angle"])
            xx, yy, xy = inertia * c * c, inertia * s * s, inertia * c * s
        elif hasattr(body.spread, "xx"):
            xx, yy, xy = (o.p[f"{body.name}.spread.{key}"] for key in ("xx", "yy", "xy"))
        # n in link axes
        c, s = cos(turn), sin(turn)
        a, b = c * nx + s * ny, c * ny - s * nx
        off = nx * (x - x0) + ny * (y - y0)
        own = a * a * xx + 2.0 * a * b * xy + b * b * yy
        half = a * b * xx + (b * b - a * a) * xy - a * b * yy
        parts.append((k, m * off, half))
        whole = whole + m * off * off + own
    field = load.given
    omega = o.p.law(load, field, o.t)
    if field == "momentum":
        omega = omega / whole
    for k, pull, twist in parts:
        f[3 * k] += omega * omega * pull * nx
        f[3 * k + 1] += omega * omega * pull * ny
        f[3 * k + 2] += omega * omega * twist


_KINDS: dict[Any, Any] = {
    Gravity: _gravity,
    Force: _force,
    Spring: _between,
    Damper: _between,
    Torque: _turning,
    TorsionSpring: _turning,
    TorsionDamper: _turning,
    PistonPressure: _pressure,
    ReciprocatingCylinder: _cylinder,
    CentrifugalField: _spin,
}
KNOWN = frozenset(_KINDS)
