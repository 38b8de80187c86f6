"""Primitives that elements hand to the kernels: pairs of constraint rows, and single loads.

An element may be any number of primitives: a `Fixed` joint is a pin and an equal angle. The kernels
know only primitives, each of one kind of physics: a function in the file of its element, entered
into the list of its kind by `constraint_physics` or `load_physics`. The number of a kind is its
place in that list, which `mbody.model.joints` and `mbody.model.loads` fill in the order in which
they name their files.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from mbody.core.decorators import inline
from mbody.laws import Law

# -- Geometry that the physics of joints and loads share; scalar functions, on floats or lanes -
#
# A body enters physics as its side (x, y, θ, cos θ, sin θ, vx, vy, ω) at the mass centre.


@inline
def turned(c, s, x, y):
    """Link axes to world axes: (c x − s y, s x + c y)."""
    return c * x - s * y, s * x + c * y


@inline
def between(i, j, aix, aiy, ajx, ajy):
    """From marker i to marker j: (d, ḋ, and d̈ without the angular and linear accelerations).

    d = r_j + A_j s_j − r_i − A_i s_i;  the rest of d̈ is −ω_j² A_j s_j + ω_i² A_i s_i.
    """
    xi, yi, _, ci, si, vxi, vyi, wi = i
    xj, yj, _, cj, sj, vxj, vyj, wj = j
    pix, piy = turned(ci, si, aix, aiy)
    pjx, pjy = turned(cj, sj, ajx, ajy)
    dx = xj + pjx - xi - pix
    dy = yj + pjy - yi - piy
    dvx = vxj - wj * pjy - vxi + wi * piy
    dvy = vyj + wj * pjx - vyi - wi * pix
    dax = wi * wi * pix - wj * wj * pjx
    day = wi * wi * piy - wj * wj * pjy
    return (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day)


F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True, eq=False)
class Physics:
    """One kind of physics.

    `function`: Compiled: of a constraint (i, j, p, f) → Φ, Φ_q, ν, γ, of a load (i, j, p, f) → the
      wrenches (Fx, Fy, T) on i and on j about the mass centres, None where there is none.
    `argument`: Compiled, (i, j, p): where the primitive's own law is evaluated. Of a constraint the
      vector (x, y) whose direction is the angle, or which is the place; of a load (x, known), and
      `known` goes to `function` as a fifth argument.
    `of_place`: Of constraints: whether the law is a contour, of a place.
    `form`: Of loads: how the kernels use the function, "wrench" as above, else one of the forms of
      `mbody.kernels.forces`.
    """

    function: Callable[..., Any]
    argument: Callable[..., Any] | None = None
    form: str = "wrench"
    of_place: bool = False


#: Physics of all constraint primitives by kind, in the order of their numbers.
CONSTRAINTS: dict[str, Physics] = {}
#: Physics of all loads by kind, in the order of their numbers.
LOADS: dict[str, Physics] = {}


def constraint_physics(
    *, argument: Callable[..., Any] | None = None, of_place: bool = False
) -> Callable[[F], F]:
    """Enter the decorated function into `CONSTRAINTS`; its name is the kind."""
    return _entered(CONSTRAINTS, "", argument, "wrench", of_place)


def load_physics(
    kind: str = "", *, argument: Callable[..., Any] | None = None, form: str = "wrench"
) -> Callable[[F], F]:
    """Enter the decorated function into `LOADS`; the kind is its name, if no other is given."""
    return _entered(LOADS, kind, argument, form)


def _entered(
    table: dict[str, Physics],
    kind: str,
    argument: Callable[..., Any] | None,
    form: str,
    of_place: bool = False,
) -> Callable[[F], F]:
    def enter(function: F) -> F:
        # compiled kernels are kept on disk under the sources of the package alone
        if not function.__module__.startswith("mbody.model."):
            raise TypeError(
                f"{function.__name__}: physics outside mbody is a CustomJoint or a CustomLoad"
            )
        name = kind or function.__name__
        if name in table:
            raise TypeError(f"there are two kinds of physics named {name!r}: choose another name")
        table[name] = Physics(function, argument, form, of_place)
        return function

    return enter


@dataclass(frozen=True)
class Signal:
    """A law as the kernels take it: which one, and its parameters (floats or arrays)."""

    law: Law
    parameters: list[Any]


@dataclass(frozen=True)
class Part:
    """One coordinate in the sum of a coupling: its physics, and the bodies that it lies between.

    Its seven parameters, the factor first, are among those of the primitive.
    """

    kind: str
    i: str
    j: str


@dataclass(frozen=True)
class ConstraintPrimitive:
    """Up to two constraint rows between bodies `i` and `j`.

    `kind`: The physics: one of `CONSTRAINTS`, "sum" of a coupling, "formula" of a driver that
      follows positions, or "user".
    `i`, `j`: Names of the two bodies.
    `rows`: What each row measures, a letter a row: ``"l"`` a length, ``"a"`` an angle.
    `parameters`: Numbers of the physics, floats or arrays over a batch.
    `signal`: The law f(t) of the first row, if it has one.
    `law`: A law of a direction that the position gives: an angle of one turn, 0 … 2π; or a contour.
    `function`: The user's own physics in plain Python, for kind ``"user"``.
    `parts`: What a ``"sum"`` adds up, over more bodies than two.
    `more`: Further bodies of a ``"formula"``.
    `active_set`: Whether its one row is of the active set, active or not, as of a contact or of a
      pair that sticks or slides; it begins off.
    """

    kind: str
    i: str
    j: str
    rows: str
    parameters: list[Any]
    signal: Signal | None = None
    law: Signal | None = None
    function: Callable[..., Any] | None = None
    parts: tuple[Part, ...] = ()
    more: tuple[str, ...] = ()
    active_set: bool = False

    @property
    def bodies(self) -> tuple[str, ...]:
        """All bodies that the rows are about: i and j, then what else a sum or a formula moves."""
        more = (body for part in self.parts for body in (part.i, part.j) if body != "ground")
        return tuple(dict.fromkeys((self.i, self.j, *more, *self.more)))


@dataclass(frozen=True)
class FrictionPrimitive:
    """A friction pair: what slides, and what presses it; see `mbody.kernels.friction`.

    `kind`: One of `FRICTION_KINDS` of the kernel: ``"pin"``, ``"guide"``, ``"pressed"``,
      ``"couple"`` of wheels, ``"follower"`` of a cam, ``"apart"``, the force that presses wheels
      apart, ``"torque"`` or ``"force"`` of a law.
    `tangent`: The row whose rate is the rate of sliding, of the active set: it is active while the
      pair sticks.
    `presses`: Which primitive of the element has the reaction that presses.
    `parameters`: Kinetic and static coefficient, speed of Stribeck's curve (0: none), viscous
      coefficient, then two of the kind: radius of a pin; length and height of a guide; of a
      follower the radius of its roller's pin as a part of the roller's, or 0; of a couple nothing
      and by how much it is more one way than the other; the direction of what presses apart. Floats
      or arrays over a batch.
    `capacity`: Of the kinds ``"torque"`` and ``"force"``: the law of what it has while it slides.
    """

    kind: str
    tangent: ConstraintPrimitive
    presses: int
    parameters: list[Any]
    capacity: Signal | None = None

    @property
    def bends(self) -> bool:
        """Whether its friction is not linear in velocities and forces: it is more than viscous."""
        counted = (0, 1, 5) if self.kind == "couple" else (0, 1)
        always = self.capacity is not None or self.kind in ("apart", "pull")
        return always or any(bool(np.any(self.parameters[n])) for n in counted)


@dataclass(frozen=True)
class ForcePrimitive:
    """One load between bodies `i` and `j` (or on every body, for gravity and fields).

    `kind`: The physics: one of `LOADS`, or "user".
    `i`, `j`: Names of the two bodies; the action on `j` is the positive one.
    `parameters`: Numbers of the physics, floats or arrays over a batch.
    `signals`: Laws of time, up to two.
    `law`: A law of the element's auxiliary state (stretch, rate).
    `function`: The user's own physics in plain Python, for kind ``"user"``.
    `by`: Name of a third body, whose position the action follows without acting on it.
    """

    kind: str
    i: str
    j: str
    parameters: list[Any]
    signals: tuple[Signal, ...] = ()
    law: Signal | None = None
    function: Callable[..., Any] | None = None
    by: str = "ground"
