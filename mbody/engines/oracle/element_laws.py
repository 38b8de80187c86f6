"""The oracle's laws of motors, actuators, cylinders and tyres, as their books write them.

Numbers are those of the description; what an element states as formulas for the kernels is not
read. Each function takes the load, the kinematics by the oracle, and the values of the load's
states by their last names.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from mbody.model.loads import Actuator, DCMotor, HydraulicCylinder, InductionMotor, Tyre

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
