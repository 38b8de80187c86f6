"""The oracle's friction of joints: dense equations of the forces at every place with friction.

The unknowns are the multipliers of all rows and the forces at the places of contact: the force of a
pin on its hole, those at both ends of a slider, the loss of teeth. They fulfil the balance of all
bodies with friction among the forces, and what each contact says of its forces: that friction is μ
times the normal force, square to it and against the sliding. Newton's method solves all of them at
once, from any start; nothing is eliminated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.model.joints import (
    BandBrake,
    Belt,
    CamFollower,
    Clutch,
    FrictionForce,
    Gear,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
)
from mbody.model.loads import Actuator, DCMotor, HydraulicCylinder, InductionMotor, Tyre

# -- The oracle's laws of motors, actuators, cylinders and tyres, as their books write them ----
#
# Numbers are those of the description; what an element states as formulas for the kernels is not
# read. Each function takes the load, the kinematics by the oracle, and the values of the load's
# states by their last names.

States = Mapping[str, float]
#: The value of one of a load's laws at the instant, by the name of its field.
Law = Callable[[str], float]

#: What turns by the rate between two bodies, and what pushes two places apart.
MOTORS, PUSHERS = (DCMotor, InductionMotor), (Actuator, HydraulicCylinder)


def motor_torque(load: Any, rate: float, t: float, own: States) -> float:
    """Torque on the body: of the current, or Kloss's by the slip, T/T_b = 2/(s/s_b + s_b/s)."""
    if isinstance(load, DCMotor):
        return float(load.ratio * load.constant * own["current"])
    slip = (load.synchronous - load.ratio * rate) / load.synchronous
    torque = 0.0
    if slip:
        part = slip / load.breakdown_slip
        torque = 2.0 * load.breakdown_torque / (part + 1.0 / part)
    in_star = (load.star_until is not None and t < load.star_until) or (
        load.star_below is not None and abs(load.ratio * rate) < load.star_below
    )
    torque *= load.ratio * math.copysign(1.0, load.synchronous)
    return float(torque / 3.0 if in_star else torque)


def motor_rates(load: Any, rate: float, law: Law, own: States) -> dict[str, float]:
    """Rates of the current and of the energies, by Kirchhoff's voltage law."""
    if not isinstance(load, DCMotor):
        return {}
    voltage, current = law("voltage"), own["current"]
    drop, back = load.resistance * current, load.constant * load.ratio * rate
    return {
        "current": (voltage - drop - back) / load.inductance,
        "supplied": voltage * current,
        "lost": drop * current,
    }


def push_apart(load: Any, law: Law, own: States) -> float:
    """Force that pushes the two places of a load apart."""
    if isinstance(load, Actuator):
        return own["applied"] if load.lag is not None else _commanded(load, law)
    head, annulus = _faces(load)
    return own["pressure_a"] * head - own["pressure_b"] * annulus


def pusher_rates(load: Any, length: float, rate: float, law: Law, own: States) -> dict[str, float]:
    """Rates of an actuator's force, or of a cylinder's pressures and of the energies of its oil."""
    if isinstance(load, Actuator):
        if load.lag is None:
            return {}
        change = (_commanded(load, law) - own["applied"]) / load.lag
        most = math.inf if load.slew is None else load.slew
        return {"applied": min(most, max(-most, change))}
    head, annulus = _faces(load)
    a, b = own["pressure_a"], own["pressure_b"]
    opening, stroke = min(1.0, max(-1.0, law("valve"))), length - load.closed
    # flows from a higher pressure through the edges that are open: supply to one, other to tank
    fed, drained = (a, b) if opening > 0.0 else (b, a)
    into = abs(opening) * _through(load, load.supply - fed)
    out = abs(opening) * _through(load, drained - load.tank)
    relieved_a, relieved_b = _relieved(load, a), _relieved(load, b)
    net_a = (into if opening > 0.0 else -out) - relieved_a - head * rate
    net_b = (-out if opening > 0.0 else into) - relieved_b + annulus * rate
    return {
        "pressure_a": load.bulk_modulus * net_a / (load.dead_volume + head * stroke),
        "pressure_b": load.bulk_modulus
        * net_b
        / (load.dead_volume + annulus * (load.stroke - stroke)),
        "supplied": load.supply * into - load.tank * (out + relieved_a + relieved_b),
        "lost": into * (load.supply - fed) + out * (drained - load.tank),
        "relieved": relieved_a * (a - load.tank) + relieved_b * (b - load.tank),
        "compressed": a * net_a + b * net_b,
    }


def tyre_forces(load: Tyre, height: float, sinking: float, own: States) -> tuple[float, float]:
    """Load of the wheel, and the force along the road by Pacejka's magic formula."""
    if height >= load.radius:
        return 0.0, 0.0
    pressed = max(0.0, load.stiffness * (load.radius - height) - load.damping * sinking)
    x = load.steepness * own["slip"]
    bent = (1.0 - load.curvature) * x + load.curvature * math.atan(x)
    return pressed, load.friction * pressed * math.sin(load.shape * math.atan(bent))


def tyre_rates(
    load: Tyre, height: float, speed: float, spin: float, own: States
) -> dict[str, float]:
    """The slip follows −(v + h ω)/|v| over the relaxation length."""
    return {"slip": -(speed + height * spin + abs(speed) * own["slip"]) / load.relaxation}


def _commanded(load: Actuator, law: Law) -> float:
    """What is commanded, less the dead band, within the limit."""
    wanted = law("push")
    size = max(0.0, abs(wanted) - (load.dead_band or 0.0))
    return math.copysign(size if load.limit is None else min(size, load.limit), wanted)


def _faces(load: HydraulicCylinder) -> tuple[float, float]:
    """Areas of the piston on the side of the head and on that of the rod."""
    head = 0.25 * math.pi * load.bore**2
    return head, head - 0.25 * math.pi * load.rod**2


def _through(load: HydraulicCylinder, drop: float) -> float:
    """Flow of an open edge, √ of the drop, linear below a thousandth of the nominal one."""
    part, laminar = drop / load.drop, 1.0 / 1000.0
    return load.flow * part / (part**2 + laminar**2) ** 0.25


def _relieved(load: HydraulicCylinder, pressure: float) -> float:
    """Flow through a relief valve: nominal at a tenth above its pressure."""
    if load.relief is None:
        return 0.0
    return load.flow * max(0.0, pressure / load.relief - 1.0) / 0.1


# -- The oracle's belts: tensions of both ends of a band or of both strands, where these leave -


def band_torque(joint: BandBrake, force: float, slip_sign: float) -> float:
    """Torque on a drum that slips, by the balance of the lever and the ratio of tensions."""
    ratio = math.exp(joint.friction * joint.wrap * slip_sign)
    lever = [[1.0, -ratio], [-joint.helping_arm, joint.arm]]
    first, second = np.linalg.solve(lever, [0.0, force * joint.lever])
    return abs(float(first - second)) * joint.radius


def pull_of_strands(
    joint: Belt, centres: list[tuple[Any, Any]], mean: float, slip_sign: Any
) -> tuple[Any, Any, Any]:
    """(Fx, Fy, T) of both strands on pulley j about its centre; `slip_sign`: that of slipping,
    times the part of the greatest force on the rim.
    """
    (xi, yi), (xj, yj) = centres
    distance = math.hypot(xj - xi, yj - yi)
    ux, uy = (xj - xi) / distance, (yj - yi) / distance
    side = -1.0 if joint.crossed else 1.0
    lean = math.asin((joint.radius_i - side * joint.radius_j) / distance)
    wrap = math.pi + (2.0 * lean if joint.crossed else -2.0 * abs(lean))
    ratio = math.exp(joint.friction * wrap)
    half = slip_sign * mean * (ratio - 1.0) / (ratio + 1.0)
    total: list[Any] = [0.0, 0.0, 0.0]
    for n in (1.0, -1.0):
        # the normal of pulley i where the strand leaves it, and that of pulley j up to its sign
        mx = math.sin(lean) * ux - n * math.cos(lean) * uy
        my = math.sin(lean) * uy + n * math.cos(lean) * ux
        radius = side * joint.radius_j * mx, side * joint.radius_j * my
        tx, ty = (
            xi + joint.radius_i * mx - xj - radius[0],
            yi + joint.radius_i * my - yj - radius[1],
        )
        length = math.hypot(tx, ty)
        moment_arm = (radius[0] * ty - radius[1] * tx) / length
        # pulley j is driven on where the rim of i is faster
        pull = mean + half * math.copysign(1.0, moment_arm * side)
        for part, unit in enumerate((tx / length, ty / length, moment_arm)):
            total[part] += pull * unit
    return total[0], total[1], total[2]


#: Joints whose friction follows a law.
GIVEN = BandBrake | Belt | Clutch | FrictionForce


#: Newton's iterations.
ITERATIONS = 60

Array = np.ndarray


def has_friction(joint: Any) -> bool:
    """Whether a joint has friction, or teeth that press apart."""
    if isinstance(joint, GIVEN):
        return True
    fields = ("friction", "viscous", "efficiency", "pressure_angle", "resistance")
    return any(getattr(joint, field, None) is not None for field in fields)


def size(x: Any) -> Any:
    """|x|, with its derivative by a complex step."""
    return np.where(np.real(x) >= 0.0, x, -x)


@dataclass(frozen=True)
class DenseForces:
    """One solution.

    `lam` (m,): Multipliers of the rows.
    `own`: Forces at the places of contact.
    `wrench`: By joint (Fx, Fy, T) of friction, and of what presses teeth apart, on body j at the
      place that the joint's reaction is reported at.
    `losses`: By joint the power that it takes.
    """

    lam: Array
    own: Array
    wrench: dict[str, Array]
    losses: dict[str, float]


class DenseFriction:
    """The equations of one instant. `q`, `v`, `a` (3n,)."""

    def __init__(
        self,
        reference: Any,
        q: Any,
        v: Any,
        a: Any,
        t: float,
        *,
        slip_signs: Mapping[str, float] | None = None,
        part: float = 1.0,
        impending: bool = False,
    ) -> None:
        self.reference, self.part, self.impending = reference, part, impending
        self.q, self.v = (np.append(np.asarray(one, float), np.zeros(3)) for one in (q, v))
        self.t = t
        self.g = reference.phi_q_all(q, t)
        self.right = reference.applied(q, v, t) - reference.mass_matrix() @ np.asarray(a, float)
        self._places: dict[str, tuple[Any, Any]] = {}
        self._moment_arms: dict[str, float] = {}
        self.joints = [joint for joint in reference.mechanism.joints if has_friction(joint)]
        self.rates = {joint.name: float(self._rate(joint, self.q, self.v)) for joint in self.joints}
        velocity_scale = float(np.abs(self.v).max(initial=0.0))
        self.slip_signs = {
            name: 0.0
            if abs(rate) <= tol.RATE_NONE_FRICTION * velocity_scale
            else math.copysign(1.0, rate)
            for name, rate in self.rates.items()
        }
        self.slip_signs |= {name: float(one) for name, one in (slip_signs or {}).items()}
        self.count = {joint.name: self._unknowns(joint) for joint in self.joints}

    # -- kinds of joints -----------------------------------------------------------------------

    def _unknowns(self, joint: Any) -> int:
        if isinstance(joint, Revolute):
            return 2
        if isinstance(joint, Prismatic):
            return 2 if joint.length else 0
        if isinstance(joint, CamFollower):
            return 1
        return 1 if getattr(joint, "efficiency", None) is not None else 0

    def _mu(self, joint: Any) -> float:
        """The coefficient at the speed of the surfaces on each other."""
        kinetic = joint.friction or 0.0
        static = kinetic if getattr(joint, "static", None) is None else joint.static
        speed = abs(self.rates[joint.name])
        if isinstance(joint, Revolute):
            speed *= joint.pin_radius or 0.0
        if isinstance(joint, CamFollower) and joint.pin_radius is not None:
            speed *= joint.pin_radius / joint.roller
        found = kinetic
        if self.impending:
            found = static
        elif getattr(joint, "stribeck", None):
            found += (static - kinetic) * math.exp(-((speed / joint.stribeck) ** 2))
        return float(found * self.part)

    def _given_friction(self, joint: Any, law: Any) -> float:
        """Friction by a law: none where that is negative."""
        self.reference.now = self.q, self.v, self.t
        given = max(0.0, self.reference.value(law, self.t)) * self.part
        if self.impending:
            return float(given * joint.static)
        if joint.stribeck is None:
            return float(given)
        speed = self.rates[joint.name] / joint.stribeck
        return float(given * (1.0 + (joint.static - 1.0) * math.exp(-(speed**2))))

    def _reaction_point(self, joint: Any) -> tuple[Any, Any]:
        if joint.name not in self._places:
            self._places[joint.name] = self.reference.reaction_point(self.q, joint)
        return self._places[joint.name]

    def _velocity(self, body: str, place: tuple[float, float]) -> tuple[float, float]:
        """Velocity of the point of a body that is at a place of the world."""
        k = 3 * self.reference.index[body]
        x, y = place[0] - self.q[k], place[1] - self.q[k + 1]
        vx, vy, w = self.v[k : k + 3]
        return vx - w * y, vy + w * x

    def _along(self, joint: Any) -> tuple[float, float]:
        """The direction in which body j slides on body i."""
        if isinstance(joint, CamFollower):
            fx, fy = self._normal(joint)
            return -fy, fx
        angle = self.q[3 * self.reference.index[joint.i.body] + 2] + joint.i.angle
        return math.cos(angle), math.sin(angle)

    def _normal(self, joint: Any) -> tuple[float, float]:
        """The direction in which the first row of a joint pushes body j, λ being −1."""
        k = 3 * self.reference.index[joint.j.body]
        gx, gy = self.g[self.reference.rows[joint.name].start, k : k + 2]
        whole = math.hypot(gx, gy)
        return gx / whole, gy / whole

    def _rate(self, joint: Any, q: Any, v: Any) -> Any:
        """Speed at which the surfaces slide, or turn, on each other; linear in v (3n + 3, …)."""
        index = self.reference.index
        i, j = (v[3 * index[body] + 2] for body in joint.bodies)
        if isinstance(joint, Revolute | BandBrake | Clutch | Gear | RackPinion | Rolling):
            return j - i
        if isinstance(joint, Belt):
            return joint.radius_i * i - (-1.0 if joint.crossed else 1.0) * joint.radius_j * j
        if isinstance(joint, CamFollower):
            place, (ux, uy) = self._reaction_point(joint), self._along(joint)
        else:
            place = self.reference.place(q, joint.j)
            angle = q[3 * index[joint.i.body] + 2] + joint.i.angle
            ux, uy = np.cos(angle), np.sin(angle)
        ends = []
        for body in joint.bodies:
            k = 3 * index[body]
            x, y = place[0] - q[k], place[1] - q[k + 1]
            ends.append((v[k] - v[k + 2] * y, v[k + 1] + v[k + 2] * x))
        (ax, ay), (bx, by) = ends
        return (bx - ax) * ux + (by - ay) * uy

    # -- the equations ---------------------------------------------------------------------------

    def residual(self, z: Any) -> Any:
        """Residuals of the balance of all bodies (3n) and of the contacts, for unknowns (unknowns,)
        or columns of them.
        """
        r = self.reference
        lam = z[: r.m]
        balance = (self.right - (self.g[:, : 3 * r.n].T @ lam).T).T
        force = np.zeros((3 * r.n + 3, *z.shape[1:]), dtype=z.dtype)
        said: list[Any] = []
        for joint, (wrench, equations) in self._contacts(z):
            said += equations
            self._act(force, joint, *wrench)
        own_equations = np.array(said, dtype=z.dtype).reshape(len(said), *z.shape[1:])
        return np.concatenate([balance + force[: 3 * r.n], own_equations])

    def _contacts(self, z: Any) -> Iterator[tuple[Any, tuple[Any, list[Any]]]]:
        """Every joint with its wrench of friction and the equations of its own unknowns."""
        remaining = list(z[self.reference.m :])
        for joint in self.joints:
            own = [remaining.pop(0) for _ in range(self.count[joint.name])]
            yield joint, self._contact(joint, z[: self.reference.m], own)

    def _act(self, force: Any, joint: Any, fx: Any, fy: Any, torque: Any) -> None:
        """A wrench on body j at the joint's place, and the opposite one on body i."""
        px, py = self._reaction_point(joint)
        for body, sign in ((joint.j.body, 1.0), (joint.i.body, -1.0)):
            k = 3 * self.reference.index[body]
            x, y = px - self.q[k], py - self.q[k + 1]
            force[k] += sign * fx
            force[k + 1] += sign * fy
            force[k + 2] += sign * (torque + x * fy - y * fx)

    def _pushed(self, joint: Any, lam: Any, row: int | None = None) -> tuple[Any, Any, Any]:
        """(Fx, Fy, T) of a joint's rows, or of one of them, on body j at the joint's place."""
        rows = self.reference.rows[joint.name]
        if row is not None:
            rows = slice(rows.start + row, rows.start + row + 1)
        k = 3 * self.reference.index[joint.j.body]
        fx, fy, torque = -self.g[rows, k : k + 3].T @ lam[rows]
        px, py = self._reaction_point(joint)
        return fx, fy, torque - (px - self.q[k]) * fy + (py - self.q[k + 1]) * fx

    def _contact(self, joint: Any, lam: Any, own: Any) -> tuple[tuple[Any, Any, Any], list[Any]]:
        """The wrench of friction on body j, and the equations of the joint's own unknowns."""
        slip_sign, rate = self.slip_signs[joint.name], self.rates[joint.name]
        viscous = -(getattr(joint, "viscous", None) or 0.0) * rate
        if isinstance(joint, Clutch):
            return (0.0, 0.0, -slip_sign * self._given_friction(joint, joint.torque)), []
        if isinstance(joint, FrictionForce):
            ux, uy = self._along(joint)
            force = -slip_sign * self._given_friction(joint, joint.force)
            return (force * ux, force * uy, 0.0), []
        if isinstance(joint, BandBrake):
            torque = band_torque(joint, self._given_friction(joint, joint.force), slip_sign)
            return (0.0, 0.0, -slip_sign * torque), []
        if isinstance(joint, Belt):
            value = self.reference.value(joint.tension, self.t)
            holds = self._given_friction(joint, joint.tension) / max(value, tol.TINY)
            ends = [self.reference.place(self.q, marker) for marker in (joint.i, joint.j)]
            return pull_of_strands(joint, ends, max(0.0, value), slip_sign * holds), []
        if isinstance(joint, Gear | RackPinion):
            return self._teeth(joint, lam, own, slip_sign)
        if isinstance(joint, Rolling):
            nx, ny, _ = self._pushed(joint, lam, 0)
            px, py = self._normal(joint)
            press = nx * px + ny * py
            return (0.0, 0.0, -slip_sign * self.part * (joint.resistance or 0.0) * size(press)), []
        mu = self._mu(joint)
        fx, fy, torque = self._pushed(joint, lam)
        if isinstance(joint, Revolute):
            nx, ny = own
            pressed = np.sqrt(nx * nx + ny * ny)
            said = [nx + slip_sign * mu * ny - fx, ny - slip_sign * mu * nx - fy]
            return (0.0, 0.0, viscous - slip_sign * mu * (joint.pin_radius or 0.0) * pressed), said
        ux, uy = self._along(joint)
        press = uy * -fx + ux * fy
        said = []
        if isinstance(joint, Prismatic) and joint.length:
            one, two = own
            # on the lower rail a contact pushes up, on the upper one down: friction at half the
            # height turns the slider as far as it pushes
            half, sides = 0.5 * joint.length, 0.5 * (joint.height or 0.0)
            moment = sum(sides * mu * -slip_sign * force for force in own)
            said = [one + two - press, half * (one - two) + moment - torque]
            friction = -slip_sign * mu * (size(one) + size(two))
        elif isinstance(joint, CamFollower):
            (friction,) = own
            said = [friction + slip_sign * mu * size(press)]
            if joint.pin_radius is not None:
                radius = joint.pin_radius * mu / math.sqrt(1.0 + mu * mu)
                whole = np.sqrt(press * press + friction * friction)
                said = [friction * joint.roller + slip_sign * radius * whole]
        else:
            friction = -slip_sign * mu * size(press)
        return ((friction + viscous) * ux, (friction + viscous) * uy, 0.0), said

    def _teeth(
        self, joint: Any, lam: Any, own: Any, slip_sign: float
    ) -> tuple[tuple[Any, Any, Any], list[Any]]:
        """Torque of loss, and the force that presses the wheels apart."""
        # the direction of the line of centres, from i to j, and the tooth force square to it
        nx, ny = self._normal(joint)
        fx, fy, _ = self._pushed(joint, lam)
        force = fx * nx + fy * ny
        (px, py), (cx, cy) = self._reaction_point(joint), self.reference.place(self.q, joint.j)
        ex, ey = cx - px, cy - py
        rj = math.hypot(ex, ey)
        ex, ey = ex / rj, ey / rj  # from the pitch point to the centre on j
        said: list[Any] = []
        torque: Any = 0.0
        if joint.efficiency is not None:
            (whole,) = own
            torque = self.part * whole
            if slip_sign:
                said = [self._power(joint, force, whole, (px, py), (nx, ny))]
            else:
                said = [whole]
        elif joint.friction is not None:
            moment_arm = self._mean_moment_arm(joint)
            mu = joint.friction * self.part
            torque = -slip_sign * mu * size(force) / math.cos(joint.pressure_angle) * moment_arm
        separating: Any = 0.0
        if joint.pressure_angle is not None:
            separating = math.tan(joint.pressure_angle) * size(force)
        return (separating * ex, separating * ey, torque), said

    def _power(self, joint: Any, force: Any, torque: Any, pitch: Any, normal: Any) -> Any:
        """Power residual of a gear mesh by the sliding rate: power on the driven side less the
        efficiency times that on the driving side; rates relative to the carrier.
        """
        wi, wj = (self.v[3 * self.reference.index[body] + 2] for body in joint.bodies)
        (cx, cy), (ix, iy) = (self.reference.place(self.q, m) for m in (joint.j, joint.i))
        lever = self._lever(pitch, (cx, cy), normal)
        if isinstance(joint, RackPinion):
            # the centre is carried along the rack, which gives power by its force alone
            to_j = (torque + force * lever) * (wj - wi)
            to_i = -force * lever * (wj - wi)
        else:
            ri, rj = self.reference.signed_radii(joint)
            carrier = (ri * wi + rj * wj) / (ri + rj)
            to_j = (torque + force * lever) * (wj - carrier)
            to_i = (-torque - force * self._lever(pitch, (ix, iy), normal)) * (wi - carrier)
        first = np.real(to_i) < np.real(to_j)
        driven, driving = np.where(first, to_j, to_i), np.where(first, to_i, to_j)
        return (driven + joint.efficiency * driving) / abs(wj - wi)

    @staticmethod
    def _lever(place: Any, about: Any, direction: Any) -> float:
        """Moment of a unit force about a point."""
        x, y = place[0] - about[0], place[1] - about[1]
        return float(x * direction[1] - y * direction[0])

    def _mean_moment_arm(self, joint: Any) -> float:
        """Mean moment arm of a joint's friction, computed once."""
        if joint.name not in self._moment_arms:
            self._moment_arms[joint.name] = self._mean_of(joint)
        return self._moment_arms[joint.name]

    @staticmethod
    def _mean_of(joint: Any) -> float:
        """Mean distance of the contact from the pitch point, along the path on which the tip
        circles leave it: by a sum over the path.
        """
        angle = joint.pressure_angle
        if isinstance(joint, RackPinion):
            radii, small = [(math.inf, 1.0), (joint.radius, 1.0)], joint.radius
        else:
            small, great = sorted((joint.radius_i, joint.radius_j))
            radii = [(great, -1.0 if joint.internal else 1.0), (small, 1.0)]
        module = joint.module if joint.module is not None else small * math.sin(angle) ** 2

        def ends(radius: float, outside: float) -> float:
            # where the line of action crosses the tip circle: |r sin α ± s| of its foot
            if math.isinf(radius):
                return float(module / math.sin(angle))
            foot, base = radius * math.sin(angle), radius * math.cos(angle)
            tip = radius + outside * module
            tangent = math.sqrt(max(tip * tip - base * base, 0.0))
            return float(outside * (tangent - foot))

        (one, kind), (two, _) = radii
        first, second = ends(one, kind), ends(two, 1.0)
        first = min(first, two * math.sin(angle))
        if kind > 0.0 and not math.isinf(one):
            second = min(second, one * math.sin(angle))
        s = np.linspace(-first, second, 200_001)
        s = 0.5 * (s[1:] + s[:-1])
        return float(np.abs(s).mean())

    # -- solutions -------------------------------------------------------------------------------

    def solve(self, start: Any = None, most: int = ITERATIONS) -> DenseForces | None:
        """The solution that Newton's method finds from a start, by default without friction, in so
        many iterations; None where it finds none.
        """
        z = self.start() if start is None else np.array(start, float)
        scale, last = float(np.abs(self.right).max(initial=0.0)) or 1.0, np.inf
        for _ in range(most):
            f, jacobian = self.jacobian(z)
            try:
                step = np.linalg.solve(jacobian, f)
            except np.linalg.LinAlgError:
                return None
            z = z - step
            if not np.isfinite(z).all():
                return None
            size = np.abs(step).max(initial=0.0)
            terms = np.abs(jacobian) @ np.abs(z)
            if size <= tol.ORACLE_NEWTON_LEFT * max(scale, float(np.abs(z).max(initial=0.0))):
                return self._forces(z)
            if (
                size >= 0.5 * last
                and (np.abs(f) <= tol.ORACLE_EQUATION_ROUNDING * (terms + scale)).all()
            ):
                return self._forces(z)
            last = size
        return None

    def start(self) -> Array:
        """Multipliers without friction, and small forces at the places of contact."""
        r = self.reference
        lam = np.linalg.lstsq(
            self.g[:, : 3 * r.n].T, self.right, rcond=tol.LEAST_SQUARES_RANK_FINE
        )[0]
        return np.concatenate([lam, 1e-3 + np.zeros(sum(self.count.values()))])

    def jacobian(self, z: Array) -> tuple[Array, Array]:
        """The residual and its derivative, by complex steps."""
        found = self.residual(z[:, None] + 1j * tol.COMPLEX_STEP * np.eye(len(z), len(z) + 1))
        return found[:, -1].real, found[:, :-1].imag / tol.COMPLEX_STEP

    def _forces(self, z: Array) -> DenseForces:
        r = self.reference
        wrench, losses = {}, {}
        for joint, (force, _) in self._contacts(z):
            fx, fy, torque = (float(np.real(x)) for x in force)
            wrench[joint.name] = np.array([fx, fy, torque])
            place = self._reaction_point(joint)
            (ax, ay), (bx, by) = (self._velocity(body, place) for body in joint.bodies)
            i, j = (self.v[3 * r.index[body] + 2] for body in joint.bodies)
            losses[joint.name] = -float(fx * (bx - ax) + fy * (by - ay) + torque * (j - i))
        return DenseForces(z[: r.m], z[r.m :], wrench, losses)

    def solutions(self, rng: np.random.Generator, starts: int = 20) -> list[DenseForces]:
        """All different solutions from random starts."""
        first = self.start()
        scale = max(
            float(np.abs(first).max()), float(np.abs(self.right).max(initial=0.0)), tol.TINY
        )
        tries = np.vstack([first, scale * rng.standard_normal((starts, len(first))) * 3.0])
        found: list[DenseForces] = []
        for z in self._ends(tries):
            whole = max(scale, float(np.abs(z[: self.reference.m]).max(initial=0.0)))
            differences = (
                np.abs(z[: self.reference.m] - other.lam).max(initial=0.0) for other in found
            )
            if all(difference > tol.ORACLE_SOLUTIONS_SAME * whole for difference in differences):
                found.append(self._forces(z))
        return found

    def _ends(self, tries: Array) -> list[Array]:
        """Where Newton's method ends from several starts (starts, unknowns), all in one; those that
        end nowhere are left out.
        """
        z, count = tries.T.copy(), tries.shape[1]
        scale = float(np.abs(self.right).max(initial=0.0)) or 1.0
        running = np.arange(len(tries))
        ended: dict[int, Array] = {}
        for _ in range(ITERATIONS):
            here = z[:, running].astype(complex)
            stepped = here[:, :, None] + 1j * tol.COMPLEX_STEP * np.eye(count)[:, None, :]
            both = np.concatenate([here, stepped.reshape(count, -1)], axis=1)
            values = self.residual(both)
            f = values[:, : len(running)].real.T
            jacobians = (
                values[:, len(running) :].imag.reshape(count, len(running), count)
                / tol.COMPLEX_STEP
            )
            jacobians = jacobians.transpose(1, 0, 2)
            good = np.isfinite(jacobians).all(axis=(1, 2))
            good[good] = np.linalg.slogdet(jacobians[good])[0] != 0.0
            running, f, jacobians = running[good], f[good], jacobians[good]
            if not len(running):
                break
            steps = np.linalg.solve(jacobians, f[:, :, None])[:, :, 0].T
            z[:, running] -= steps
            sizes = np.maximum(scale, np.abs(z[:, running]).max(axis=0))
            done = np.abs(steps).max(axis=0) <= tol.ORACLE_NEWTON_LEFT * sizes
            ended |= {int(n): z[:, n].copy() for n in running[done]}
            running = running[~done & np.isfinite(z[:, running]).all(axis=0)]
            if not len(running):
                break
        return [ended[n] for n in sorted(ended)]


# -- Accelerations of a motion with friction in joints: those that slip and those that stick -----


@dataclass(frozen=True)
class FrictionMotion:
    """Accelerations and forces of one instant.

    `a` (3n,), `lam` (m,): Accelerations, multipliers.
    `wrench`: As of `DenseForces`, what holds where a joint sticks included.
    `unique`: By joint whether each of (Fx, Fy, T) of its whole reaction is.
    `rates`, `held`: Of what sticks its rate, and its force as a part of its limit.
    """

    a: Array
    lam: Array
    wrench: dict[str, Array]
    unique: dict[str, Array]
    rates: dict[str, float]
    held: dict[str, float]


class FrictionDynamics(DenseFriction):
    """Accelerations beside the forces: what sticks is held by an unknown force, and stays.

    The unknowns are those of `DenseFriction`, then accelerations (3n,), then a force or torque of
    each joint that sticks. `modes`: "stick", "slip+" or "slip-" of joints by name. Rows that are
    not `active` have no multiplier.
    """

    def __init__(
        self, reference: Any, q: Any, v: Any, t: float, active: Array, modes: Mapping[str, str]
    ) -> None:
        super().__init__(reference, q, v, np.zeros(len(q)), t)
        signs = {"slip+": 1.0, "slip-": -1.0, "stick": 0.0}
        for name, mode in modes.items():
            # by its rate, unless that is none: then it begins or ends to slip
            if mode == "stick" or self.slip_signs.get(name) == 0.0:
                self.slip_signs[name] = signs[mode]
        self.mass, self.active = reference.mass_matrix(), active
        self.gamma = reference.gamma(q, v, t)
        self.holds = [joint for joint in self.joints if modes.get(joint.name) == "stick"]
        if any(isinstance(joint, CamFollower) for joint in self.holds):
            raise NotImplementedError("it has no cam that sticks in motions over time")
        self.first = reference.m + sum(self.count.values())
        self.idle = np.setdiff1d(np.arange(reference.m), active)

    def residual(self, z: Any) -> Any:
        """Residuals: balance, contacts, rows with their accelerations, what sticks."""
        size = 3 * self.reference.n
        a = z[self.first : self.first + size]
        found = super().residual(z)
        found[:size] -= self.mass @ a
        rows = (self.g[:, :size] @ a).T - self.gamma
        rows = np.array(rows.T)
        rows[self.idle] = z[self.idle]
        moved = np.concatenate([a, np.zeros((3, *a.shape[1:]))])
        stay = [self._change(joint, moved) for joint in self.holds]
        stay_rows = np.array(stay, dtype=z.dtype).reshape(len(stay), *z.shape[1:])
        return np.concatenate([found, rows, stay_rows])

    def _change(self, joint: Any, a: Any) -> Any:
        """The derivative of the rate of a joint by time."""
        h = tol.COMPLEX_STEP
        drift = self._rate(joint, self.q + 1j * h * self.v, self.v.astype(complex)).imag / h
        return self._rate(joint, self.q, a) + drift

    def _contacts(self, z: Any) -> Iterator[tuple[Any, tuple[Any, list[Any]]]]:
        """With what holds where a joint sticks."""
        holds = {
            joint.name: z[self.first + 3 * self.reference.n + n]
            for n, joint in enumerate(self.holds)
        }
        for joint, (wrench, said) in super()._contacts(z[: self.first]):
            if joint.name in holds:
                wrench = self._held(joint, holds[joint.name], wrench)
            yield joint, (wrench, said)

    def _held(self, joint: Any, hold: Any, wrench: Any) -> Any:
        fx, fy, torque = wrench
        if isinstance(joint, Belt):
            mean = max(0.0, self.reference.value(joint.tension, self.t))
            ends = [self.reference.place(self.q, marker) for marker in (joint.i, joint.j)]
            return pull_of_strands(joint, ends, mean, hold)
        if isinstance(joint, Revolute | BandBrake | Clutch | Gear | RackPinion | Rolling):
            return fx, fy, torque + hold
        ux, uy = self._along(joint)
        return fx + hold * ux, fy + hold * uy, torque

    def start(self) -> Array:
        """At rest, without forces but small ones at the places of contact."""
        z = np.zeros(self.first + 3 * self.reference.n + len(self.holds))
        z[self.reference.m : self.first] = 1e-3
        return z

    def motion(self) -> FrictionMotion:
        """The solution; NotImplementedError where there is none or accelerations are not unique."""
        z = self.start()
        scale, last = float(np.abs(self.right).max(initial=0.0)) or 1.0, math.inf
        for _ in range(ITERATIONS):
            f, jacobian = self.jacobian(z)
            step = np.linalg.lstsq(jacobian, f, rcond=tol.LEAST_SQUARES_RANK_FINE)[0]
            z = z - step
            size = float(np.abs(step).max(initial=0.0))
            top = max(scale, float(np.abs(z).max(initial=0.0)))
            if size <= tol.ORACLE_NEWTON_LEFT * top or (
                size <= tol.ORACLE_EQUATIONS_LEFT * top and size >= 0.5 * last
            ):
                break
            last = size
        else:
            raise NotImplementedError(f"it finds no forces of friction at t = {self.t:.6g}")
        f, jacobian = self.jacobian(z)
        terms = np.abs(jacobian) @ np.abs(z) + scale
        if (np.abs(f) > tol.ORACLE_EQUATIONS_LEFT * terms).any():
            raise NotImplementedError(f"no accelerations at t = {self.t:.6g} fulfil its friction")
        _, sizes, vt = np.linalg.svd(jacobian)
        free = vt[int((sizes > tol.LEAST_SQUARES_RANK * sizes[0]).sum()) :].T
        a = slice(self.first, self.first + 3 * self.reference.n)
        if np.abs(free[a]).max(initial=0.0) > tol.ORACLE_FORCE_UNIQUE:
            raise NotImplementedError(f"accelerations at t = {self.t:.6g} are not unique")
        wrench = {
            joint.name: np.array([float(np.real(x)) for x in w])
            for joint, (w, _) in self._contacts(z)
        }
        holds = z[self.first + 3 * self.reference.n :].tolist()
        alone = np.abs(free[self.first + 3 * self.reference.n :]).max(axis=1, initial=0.0)
        held = {}
        for joint, hold, change in zip(self.holds, holds, alone, strict=True):
            limit = self._limit(joint, hold, z)
            if limit is not None and change < tol.ORACLE_FORCE_UNIQUE:
                held[joint.name] = abs(hold) / max(limit, tol.TINY)
        rates = {joint.name: self.rates[joint.name] for joint in self.holds}
        unique = self._unique(z, free)
        return FrictionMotion(z[a], z[: self.reference.m], wrench, unique, rates, held)

    def _limit(self, joint: Any, hold: float, z: Array) -> float | None:
        """What a clutch, brake, packing, belt (relative to what slips at its tension) or pin holds;
        None of others.
        """
        one: Any = joint
        static = one.friction if getattr(one, "static", None) is None else one.static
        if isinstance(joint, Revolute):
            mu, radius = float(static or 0.0), float(one.pin_radius or 0.0)
            fx, fy, _ = self._pushed(joint, z[: self.reference.m])
            return radius * mu / math.hypot(1.0, mu) * math.hypot(fx, fy)
        if not isinstance(joint, GIVEN):
            return None
        if isinstance(joint, Belt):
            return float(static)
        self.reference.now = self.q, self.v, self.t
        law = getattr(joint, joint.law or joint.size)
        value = max(0.0, float(self.reference.value(law, self.t))) * float(static)
        if isinstance(joint, BandBrake):
            return band_torque(joint, value, -math.copysign(1.0, hold))
        return value

    def _unique(self, z: Array, free: Array) -> dict[str, Array]:
        """Which parts of the joints' whole reactions no null vector changes."""
        r, h = self.reference, tol.COMPLEX_STEP
        stepped = z[:, None] + 1j * h * free
        change = {
            name: matrix @ free[: r.m]
            for name, matrix in r.reaction_matrices(self.q[:-3], self.t).items()
        }
        for joint, (wrench, _) in self._contacts(stepped):
            own = [np.imag(x) / h + np.zeros(free.shape[1]) for x in wrench]
            change[joint.name] = change[joint.name] + np.array(own)
        return {
            name: np.abs(one).max(axis=1, initial=0.0) < tol.ORACLE_FORCE_UNIQUE
            for name, one in change.items()
        }
