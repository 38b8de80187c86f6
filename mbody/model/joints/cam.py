"""Cam and follower: a place, a roller or a flat face that stays on the profile of a cam."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.decorators import inline
from mbody.core.lanes import sincos
from mbody.core.tolerances import CAM_PROFILE_CLOSES
from mbody.errors import ModelError
from mbody.laws import Law
from mbody.model.element import LawLike, law_field, number_field
from mbody.model.joints._base import Flank, FrictionalJoint, StrikingJoint
from mbody.model.primitives import (
    ConstraintPrimitive,
    FrictionPrimitive,
    between,
    constraint_physics,
)
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers, Value


#: Places of one turn at which a profile is looked at, both ends included: every half degree.
PLACES = 721


@dataclass(frozen=True)
class CamFollower(FrictionalJoint, StrikingJoint):
    """Cam pair, disk cam with roller, knife-edge or flat-faced follower, translating, offset or
    swinging: the place on j, or a face through it, stays on the profile about the place on i.

    With d from the cam's centre on i to the place on j: a roller's centre or a knife edge keeps Φ =
    |d| − R(ψ) = 0, a flat face with the normal n keeps Φ = n · d − h(ψ) = 0: one row. R is the
    pitch curve, h the support function of the cam, which is R of a follower that translates along n
    through the centre. The reaction is the force of contact on the follower, reported at the point
    of contact, where it has no torque.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        The centre of the cam; the marker's x axis is the profile's line of 0.
    j : Marker or str
        The centre of the roller, the knife edge, or a place in the flat face; the marker's x axis
        lies in the face, and the cam on its right, away from its y axis, which is n.
    profile : Law, float or callable
        R or h [length] as a law of the angle ψ over one turn; with `base_radius` the lift beyond.
    base_radius : float, optional
        Radius of the base circle [length]: R = base_radius + roller + profile.
    roller : float
        Radius of the roller [length], 0 for a knife edge.
    flat : bool
        Whether the follower has a flat face.
    clockwise : bool
        Whether ψ is counted for a cam that turns clockwise.
    one_sided : bool
        Whether the follower may leave the cam in `simulate`, where it would have to pull; without
        friction.
    restitution : float, optional
        e of impacts of the follower on the cam, with `one_sided`.
    friction, static, stribeck : float, optional
        Coefficients of a knife edge or a flat face on the cam, or of a roller on its pin, while it
        rolls on the cam; see `RubbingJoint`.
    pin_radius : float, optional
        Of the roller's pin [length], with `friction`.

    Raises
    ------
    ModelError
        When a mechanism is assembled or gets other numbers: a profile that does not close, or a cam
        that undercuts its follower.

    Notes
    -----
    ψ is how far the cam has turned counter-clockwise since its line of 0 pointed at the follower
    (along d, or along n): a lift law reads in the order of turning, as textbooks draw it, and ψ is
    θ_i − θ_j and a constant for a flat face. With `clockwise` it is how far the cam has turned
    clockwise, and then also the polar angle of the profile in the cam's axes.

    Unless it is `one_sided` and simulated, the contact is kept whatever the sign of its force:
    where it is negative the follower would leave the cam, and the result has a note;
    ``run.contact(name)`` gives the force that presses.

    Norton, Design of Machinery, chapter 8; the radius of curvature of the cam is h + h″ for a flat
    face, and (R² + R′²)^(3/2) / (R² + 2R′² − R R″) of the pitch curve for a roller.

    Examples
    --------
    >>> from mbody.laws import Harmonic
    >>> lift = Harmonic(mean=0.01, amplitude=0.01, frequency=1.0)
    >>> CamFollower("cam", "shaft", "tappet", lift, base_radius=0.04, roller=0.01).rows
    'l'
    """

    profile: LawLike = law_field("length", of="angle")
    base_radius: OptionalNumberField = number_field("length", None, sign="positive")
    roller: NumberField = number_field("length", 0.0, sign="not negative")
    flat: bool = False
    clockwise: bool = False
    one_sided: bool = field(default=False, kw_only=True)
    pin_radius: OptionalNumberField = number_field("length", None, sign="positive")
    rows = "l"
    lifts = True

    def _check(self) -> None:
        super()._check()
        self._check_switches("flat", "clockwise", "one_sided")
        if self.one_sided:
            self._refuse_beside("one_sided", "friction")
        if self.flat and self.roller:
            raise ModelError(
                f"'{self.name}': a flat face has no roller: leave out roller = {self.roller:g}, or "
                "flat",
                self.name,
            )
        if self.friction is not None and self.roller and self.pin_radius is None:
            raise ModelError(
                f"'{self.name}': friction is {self.friction:g}, but a roller of {self.roller:g} "
                "rolls, and rubs on its pin: give pin_radius",
                self.name,
            )
        if self.pin_radius is not None and not self.pin_radius < self.roller:
            raise ModelError(
                f"'{self.name}': pin_radius is {self.pin_radius:g}, it must be less than the "
                f"roller = {self.roller:g} that turns on the pin: give less, or leave it out",
                self.name,
            )

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row; parameters are both arms, directions, the sign of ψ, and what R adds to f."""
        ix, iy, jx, jy = *at.arm(self, "i"), *at.arm(self, "j")
        beta_i, beta_n = at.angle(self, "i"), at.angle(self, "j") + 0.5 * math.pi
        sign, base, law = self._rotation_sign, self._base(at), at.law(self, "profile")
        bodies = self.i.body, self.j.body
        if self.flat:
            # the base counts to the arm: what is left of h is the law
            jx, jy = jx - base * np.cos(beta_n), jy - base * np.sin(beta_n)
            parameters = [ix, iy, jx, jy, beta_n, beta_i - beta_n, sign]
            return [ConstraintPrimitive("face", *bodies, "l", parameters, law=law)]
        return [
            ConstraintPrimitive(
                "roller", *bodies, "l", [ix, iy, jx, jy, beta_i, sign, base], law=law
            )
        ]

    @property
    def can_separate(self) -> bool:
        """Whether the follower may leave the cam."""
        return self.one_sided

    def flanks(self, at: Numbers) -> list[Flank]:
        """The profile, from outside."""
        (row,) = self.primitives(at)
        return [Flank(replace(row, active_set=True), 1.0)]

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """The follower, or the surface of its roller, along the cam."""
        if self.friction is None:
            return []
        ix, iy, jx, jy = *at.arm(self, "i"), *at.arm(self, "j")
        beta_i, beta_n = at.angle(self, "i"), at.angle(self, "j") + 0.5 * math.pi
        bodies, law = (self.i.body, self.j.body), at.law(self, "profile")
        kinetic, static, stribeck, viscous = self.coefficients(at)
        if self.flat:
            own = [ix, iy, jx, jy, beta_n, beta_i - beta_n, self._rotation_sign]
            row = ConstraintPrimitive("face_slip", *bodies, "l", own, law=law, active_set=True)
        else:
            wheel = at[f"{self.name}.roller"]
            own = [ix, iy, jx, jy, beta_i, self._rotation_sign, wheel]
            row = ConstraintPrimitive("roller_slip", *bodies, "l", own, law=law, active_set=True)
        part: Value = 0.0
        if self.pin_radius is not None:
            # the pin slides by so much less than the surface of the roller
            part = at[f"{self.name}.pin_radius"] / at[f"{self.name}.roller"]
            stribeck = stribeck / part
        parameters = [kinetic, static, stribeck, viscous, part, 0.0]
        return [FrictionPrimitive("follower", row, 0, parameters)]

    @property
    def _rotation_sign(self) -> float:
        return -1.0 if self.clockwise else 1.0

    def _base(self, at: Any) -> Value:
        """Radius apart from the law [length]."""
        if self.base_radius is None:
            return 0.0
        base: Value = at[f"{self.name}.base_radius"] + at[f"{self.name}.roller"]
        return base

    def radius(self, at: Any, psi: Any) -> tuple[Any, Any, Any]:
        """(R, R′, R″) or h with its derivatives [length] at ψ (…, n) within one turn [rad]; numbers
        of a batch, or ψ of one, give a first axis of designs.
        """
        law: Law = self.profile
        names = {key: f"{self.name}.profile.{key}" for key in law.numbers()}
        if set(names) == {"value"}:
            names = {"value": f"{self.name}.profile"}
        found = {key: np.ravel(at[name]) for key, name in names.items()}
        designs = max((len(values) for values in found.values()), default=1)
        parts = []
        for n in range(designs):
            own = {key: float(values[n % len(values)]) for key, values in found.items()}
            here = psi[n] if designs > 1 and np.ndim(psi) > 1 else psi
            parts.append(np.array(law.with_numbers(own).derivatives(here)))
        f, f1, f2 = parts[0] if designs == 1 else np.stack(parts, axis=1)
        base = np.asarray(self._base(at))
        return f + (base[:, None] if base.ndim == 1 else base), f1, f2

    def apart(self, at: Any) -> Any:
        """The radius of the profile on its line of 0: a rough start."""
        return float(np.ravel(self.radius(at, np.zeros(1))[0])[0])

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse a profile that does not close, is no radius, or undercuts the follower."""
        psi = np.linspace(0.0, 2.0 * math.pi, PLACES)
        try:
            found = np.broadcast_arrays(*self.radius(at, psi))
        except ModelError as error:
            raise ModelError(f"'{self.name}': profile: {error}", self.name) from None
        except Exception as error:
            raise ModelError(
                f"the function of '{self.name}' failed: {type(error).__name__}: {error}", self.name
            ) from error
        R, R1, R2 = (part.reshape(-1, PLACES) for part in found)
        wheels = np.broadcast_to(np.ravel(at[f"{self.name}.roller"]), len(R))
        for n, wheel in enumerate(wheels):
            self._refuse_open(R[n], R1[n], unit)
            self._refuse_undercut(R[n], R1[n], R2[n], float(wheel), unit)

    def _refuse_open(self, R: Any, R1: Any, unit: str) -> None:
        size = np.abs(R).max()
        for what, part, per in (("", R, unit), ("the slope of ", R1, f"{unit}/rad")):
            if not abs(part[-1] - part[0]) <= CAM_PROFILE_CLOSES * size:
                raise ModelError(
                    f"'{self.name}': {what}its profile does not close: {part[0]:.6g} {per} at 0 "
                    f"deg, {part[-1]:.6g} {per} at 360 deg: give a law that repeats after one turn",
                    self.name,
                )

    def _refuse_undercut(self, R: Any, R1: Any, R2: Any, wheel: float, unit: str) -> None:
        n = int(R.argmin())
        if not self.flat and R[n] <= 0.0:
            raise ModelError(
                f"'{self.name}': the radius of its profile is {R[n]:.4g} {unit} at {_angle(n)}, it "
                "must be positive: give a greater base_radius, or raise the profile",
                self.name,
            )
        rho = R + R2 if self.flat else pitch_radius(R, R1, R2)
        n = int(rho.argmin())
        if rho[n] > wheel or not (self.flat or wheel):
            return
        more = -rho[n] if self.flat else least_raise(R, R1, R2, wheel)
        what = "flat follower: the radius of curvature of the cam"
        if not self.flat:
            what = f"roller of {wheel:.4g} {unit}: the radius of curvature of the pitch curve"
        remedy = "base_radius" if self.base_radius is not None else "the profile"
        smaller = "" if self.flat else ", or take a smaller roller"
        raise ModelError(
            f"'{self.name}': the cam undercuts its {what} is {rho[n]:.4g} {unit} at {_angle(n)}: "
            f"raise {remedy} by more than {more:.4g} {unit}{smaller}",
            self.name,
        )

    def reaction_point(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> Any:
        """The point of contact, from the place on j."""
        (nx, ny), slope = self._normal(at, d, angle_i, angle_j)
        if not self.flat:
            wheel = at[f"{self.name}.roller"]
            return -wheel * nx, -wheel * ny
        # from the foot of the normal through the centre by dh/dψ, ψ turning against the face
        along = -self._rotation_sign * slope - (nx * d[1] - ny * d[0])
        return -along * ny, along * nx

    def normal(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> Any:
        """The common normal at the contact, from the cam into the follower."""
        return self._normal(at, d, angle_i, angle_j)[0]

    def _normal(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> Any:
        """Unit normal (nx, ny) and R′ or h′."""
        ray = angle_j + 0.5 * math.pi if self.flat else np.arctan2(d[1], d[0])
        psi = np.mod(self._rotation_sign * (angle_i - ray), 2.0 * math.pi)
        slope = self.radius(at, psi)[1]
        if not self.flat:
            ray = ray + np.arctan2(self._rotation_sign * slope, np.hypot(*d))
        return (np.cos(ray), np.sin(ray)), slope


def _angle(n: int) -> str:
    """Angle of a place of the profile."""
    return f"{360.0 * n / (PLACES - 1):.4g} deg"


def pitch_radius(R: Any, R1: Any, R2: Any) -> Any:
    """Radius of curvature of a pitch curve, inf where it is straight or hollow."""
    curvature_term = R * R + 2.0 * R1 * R1 - R * R2
    speed = (R * R + R1 * R1) ** 1.5
    return np.divide(speed, curvature_term, out=np.full(len(R), np.inf), where=curvature_term > 0.0)


def least_raise(R: Any, R1: Any, R2: Any, roller: float) -> float:
    """How much a pitch curve has to be raised, or may be lowered (negative), to be nowhere bent
    more sharply than the roller.
    """
    from mbody.core.bracket import last_place

    def keeps(by: float) -> bool:
        return bool(pitch_radius(R + by, R1, R2).min() > roller)

    down = roller - float(R.min())  # the contour shrinks to its centre
    if keeps(0.0):
        return down if keeps(down) else last_place(keeps, 0.0, down)
    up = roller
    while not keeps(up):
        up *= 2.0
    return last_place(keeps, up, 0.0)


@inline
def roller_ray(i, j, p):
    """(cos ψ, sin ψ) |d| of the angle on a roller's profile: ψ = ±(θ_i + β − ∠d)."""
    _, (dx, dy), _, _ = between(i, j, p[0], p[1], p[2], p[3])
    s, c = sincos(i[2] + p[4])
    return c * dx + s * dy, p[5] * (s * dx - c * dy)


@constraint_physics(argument=roller_ray)
@inline
def roller(i, j, p, f):
    """Φ = |d| − f(ψ) − p₆ with u = d/|d|, t = k×u, k = ±f′/|d|;  Φ_q = (u + k t)·∂d ∓ f′ ∂θ_i."""
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    length = np.sqrt(dx * dx + dy * dy)
    ux, uy = dx / length, dy / length
    slope = p[5] * f[1]
    k = slope / length
    nx, ny = ux - k * uy, uy + k * ux
    block_i = (-nx, -ny, nx * piy - ny * pix - slope, 0.0, 0.0, 0.0)
    block_j = (nx, ny, ny * pjx - nx * pjy, 0.0, 0.0, 0.0)
    # with w = t·ḋ/|d| the rate of ∠d: ψ̇ = ±(ω_i − w), and the rest of ∠d¨ is −2 (u·ḋ) w/|d|
    out, w = ux * dvx + uy * dvy, (ux * dvy - uy * dvx) / length
    rate = i[7] - w
    rest = length * w * w - f[2] * rate * rate - 2.0 * k * out * w
    gamma = -(nx * dax + ny * day + rest)
    return (length - f[0] - p[6], 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)


@inline
def face_ray(i, j, p):
    """(cos ψ, sin ψ) of the angle on a flat face's profile: ψ = ±(θ_i − θ_j + β)."""
    s, c = sincos(i[2] - j[2] + p[5])
    return c, p[6] * s


@constraint_physics(argument=face_ray)
@inline
def face(i, j, p, f):
    """Φ = n·d − f(ψ), n fixed in j, m = k×n;  Φ_q = n·∂d + m·d ∂θ_j ∓ f′ (∂θ_i − ∂θ_j)."""
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    ny, nx = sincos(j[2] + p[4])
    slope = p[6] * f[1]
    above, aside = nx * dx + ny * dy, nx * dy - ny * dx
    block_i = (-nx, -ny, nx * piy - ny * pix - slope, 0.0, 0.0, 0.0)
    block_j = (nx, ny, ny * pjx - nx * pjy + aside + slope, 0.0, 0.0, 0.0)
    # n̈·d = α m·d − ω² n·d, 2ṅ·ḋ = 2ω m·ḋ
    w, rate = j[7], i[7] - j[7]
    turning = 2.0 * w * (nx * dvy - ny * dvx) - w * w * above - f[2] * rate * rate
    gamma = -(nx * dax + ny * day + turning)
    return (above - f[0], 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)


@constraint_physics(argument=roller_ray)
@inline
def roller_slip(i, j, p, f):
    """The rate of a roller's surface, or of a knife edge, along the cam: t·ḋ − ω_i n·d + r (ω_i −
    ω_j), t = k×n; Φ is not counted.
    """
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    square = dx * dx + dy * dy
    slope = p[5] * f[1]
    # n is d turned by atan(f′/|d|)
    size = np.sqrt(square + slope * slope)
    length = np.sqrt(square)
    ux, uy = dx / length, dy / length
    nx, ny = (length * ux - slope * uy) / size, (length * uy + slope * ux) / size
    tx, ty, r = -ny, nx, p[6]
    above, aside = nx * dx + ny * dy, tx * dx + ty * dy
    block_i = (-tx, -ty, tx * piy - ty * pix - above + r, 0.0, 0.0, 0.0)
    block_j = (tx, ty, ty * pjx - tx * pjy - r, 0.0, 0.0, 0.0)
    out, w = ux * dvx + uy * dvy, (ux * dvy - uy * dvx) / length
    turn = w + (f[2] * (i[7] - w) * length - slope * out) / (size * size)
    up = nx * dvx + ny * dvy
    gamma = turn * up + i[7] * (turn * aside + up) - (tx * dax + ty * day)
    return (0.0, 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)


@constraint_physics(argument=face_ray)
@inline
def face_slip(i, j, p, f):
    """The rate of a flat face along the cam: m·ḋ − ω_i n·d, n fixed in j, m = k×n; Φ is not
    counted.
    """
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    ny, nx = sincos(j[2] + p[4])
    above, aside = nx * dx + ny * dy, nx * dy - ny * dx
    block_i = (ny, -nx, -ny * piy - nx * pix - above, 0.0, 0.0, 0.0)
    block_j = (-ny, nx, ny * pjy + nx * pjx, 0.0, 0.0, 0.0)
    up = nx * dvx + ny * dvy
    gamma = j[7] * up + i[7] * (j[7] * aside + up) - (nx * day - ny * dax)
    return (0.0, 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)
