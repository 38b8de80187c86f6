"""The faults: where, what, and on which mechanism they show."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FAULTS", "MOVING_FAULTS", "Fault"]


@dataclass(frozen=True)
class Fault:
    """One line changed.

    Attributes
    ----------
    name : str
    file : str
        Below ``mbody/``.
    right, wrong : str
        The text, which is in the file once, and what takes its place.
    model : str
        One of `tests.faults.models.MODELS`, or of `tests.faults.moving.MOVING`.
    """

    name: str
    file: str
    right: str
    wrong: str
    model: str


FAULTS = (
    Fault(
        "arm: place of the mass centre left out",
        "model/element.py",
        "            found = self._arms[element.name, field] = x - cx, y - cy",
        "            found = self._arms[element.name, field] = x, y - cy",
        "linkage",
    ),
    Fault(
        "polar points: sine for cosine",
        "model/element.py",
        "            return r * np.cos(angle), r * np.sin(angle)",
        "            return r * np.cos(angle), r * np.cos(angle)",
        "polar",
    ),
    Fault(
        "units: a pound force of 4.45 N",
        *("quantities/units.py", '("lbf", _LBF, 0', '("lbf", Fraction(445, 100), 0'),
        "units",
    ),
    Fault(
        "units: an inch of 25 mm",
        *(
            "quantities/units.py",
            '_IN, _FT = Fraction("0.0254")',
            '_IN, _FT = Fraction("0.025")',
        ),
        "units",
    ),
    Fault(
        "units: a degree of 1/181 of π",
        *(
            "quantities/units.py",
            '("deg degree degrees °", Fraction(1, 180)',
            '("deg degree degrees °", Fraction(1, 181)',
        ),
        "units",
    ),
    Fault(
        "weights: a mass as large as the weight",
        *(
            "system/assembler.py",
            "weight is None else weight / self.mechanism.g",
            "weight is None else weight",
        ),
        "weights",
    ),
    Fault(
        "masses: half the moment of inertia",
        *(
            "system/assembler.py",
            'numbers[f"{body.name}.inertia"]]',
            '0.5 * numbers[f"{body.name}.inertia"]]',
        ),
        "linkage",
    ),
    Fault(
        "revolute: centripetal acceleration the other way",
        *("model/joints/revolute.py", "(0.0, 0.0), (dax, day)", "(0.0, 0.0), (-dax, day)"),
        "linkage",
    ),
    Fault(
        "revolute: a lever arm of the Jacobian a hundredth too long",
        *(
            "model/joints/revolute.py",
            "blocks = (1.0, 0.0, -piy,",
            "blocks = (1.0, 0.0, -1.01 * piy,",
        ),
        "linkage",
    ),
    Fault(
        "prismatic: Coriolis acceleration halved",
        *("model/joints/prismatic.py", "- 2.0 * w * (nx * dvy", "- 1.0 * w * (nx * dvy"),
        "sliders",
    ),
    Fault(
        "distance: acceleration across the rod left out",
        *("model/joints/distance.py", "f[2] - across * across / length -", "f[2] -"),
        "extras",
    ),
    Fault(
        "pin in slot: Coriolis acceleration halved",
        *("model/joints/coordinate.py", "- 2.0 * w * (ux * dvy", "- 1.0 * w * (ux * dvy"),
        "slot",
    ),
    Fault(
        "gear: the ratio upside down",
        "model/joints/gear.py",
        '*at.arm(element, "j"), i, j, phase]',
        '*at.arm(element, "j"), j, i, phase]',
        "gears",
    ),
    Fault(
        "rack: a pitch radius a tenth too large",
        *("model/joints/rack.py", "w, r = i[7], p[6]", "w, r = i[7], 1.1 * p[6]"),
        "rack",
    ),
    Fault(
        "roller: second derivative of the profile left out",
        *(
            "model/joints/cam.py",
            "rest = length * w * w - f[2] * rate * rate -",
            "rest = length * w * w -",
        ),
        "cam",
    ),
    Fault(
        "fixed angle: of the markers the wrong way round",
        *(
            "model/joints/fixed.py",
            'at.angle(self, "j") - at.angle(self, "i")',
            'at.angle(self, "i") - at.angle(self, "j")',
        ),
        "extras",
    ),
    Fault(
        "coupling: acceleration of a term without its factor",
        "kernels/constraints.py",
        "return c * phi[0], by_i, by_j, c * gamma[0]",
        "return c * phi[0], by_i, by_j, gamma[0]",
        "coupling",
    ),
    Fault(
        "polynomial law: acceleration halved",
        *("kernels/forces.py", "f2 = f2 * t + 2.0 * f1", "f2 = f2 * t + f1"),
        "linkage",
    ),
    Fault(
        "harmonic law: rate without the frequency",
        *("laws/kernels.py", "frequency * c, -frequency", "c, -frequency"),
        "harmonic",
    ),
    Fault(
        "spring: stretch from twice the free length",
        *("model/loads/spring.py", "(length - p[4]) + rate", "(length - 2.0 * p[4]) + rate"),
        "spring",
    ),
    Fault(
        "spring: pull on j at the arm of i",
        *("model/loads/spring.py", "(-fx, -fy, pjy * fx - pjx", "(-fx, -fy, pjy * fx - pix"),
        "spring",
    ),
    Fault(
        "damper: rate across, not along",
        *("model/loads/spring.py", "rate * (ux * dvx + uy * dvy)", "rate * (ux * dvy + uy * dvx)"),
        "damper",
    ),
    Fault(
        "torsion spring: free angle the other way",
        *("model/loads/torsion.py", "(j[2] - i[2] - p[0])", "(j[2] - i[2] + p[0])"),
        "twist",
    ),
    Fault(
        "torque: nothing on the other body",
        *("model/loads/torque.py", "return (0.0, 0.0, -f), ", "return None, "),
        "torque",
    ),
    Fault(
        "force: its arm's sign",
        *("model/loads/force.py", "px * fy - py * fx", "px * fy + py * fx"),
        "force",
    ),
    Fault(
        "following force: turned backwards",
        *("model/loads/force.py", "(c * p[2] - s * p[3])", "(c * p[2] + s * p[3])"),
        "force",
    ),
    Fault(
        "gravity: weight in y a tenth too large",
        *("model/loads/gravity.py", "return m * gx, m * gy", "return m * gx, 1.1 * m * gy"),
        "linkage",
    ),
    Fault(
        "reactions: torque told about the wrong side of a wheel",
        *(
            "solution/histories.py",
            "torque - (offset[0] * fy - offset[1] * fx)",
            "torque + (offset[0] * fy - offset[1] * fx)",
        ),
        "rack",
    ),
    Fault(
        "efforts: the sign of the multiplier",
        *(
            "solution/solution.py",
            "locked(-self.primitive_history(self.system.primitives_of[driver][0], 0))",
            "locked(self.primitive_history(self.system.primitives_of[driver][0], 0))",
        ),
        "linkage",
    ),
)

#: Faults of laws, friction and contacts that a motion shows.
MOVING_FAULTS = (
    Fault(
        "Kloss's torque a tenth too small",
        "model/loads/induction_motor.py",
        'kloss = f"2*breakdown',
        'kloss = f"1.8*breakdown',
        "im",
    ),
    Fault(
        "motor: star at a half of the torque",
        "model/loads/induction_motor.py",
        'STAR = "(1/3)"',
        'STAR = "(1/2)"',
        "im_star",
    ),
    Fault(
        "motor: back-EMF without the ratio",
        "model/loads/dc_motor.py",
        "constant*ratio*rate)/inductance",
        "constant*rate)/inductance",
        "dc",
    ),
    Fault(
        "motor: current falls by half of the resistance",
        "model/loads/dc_motor.py",
        '"(voltage - resistance*current',
        '"(voltage - 0.5*resistance*current',
        "dc",
    ),
    Fault(
        "actuator: limit 5 % too great",
        "model/loads/actuator.py",
        'f"clamp({text}, -limit, limit)"',
        'f"clamp({text}, -1.05*limit, 1.05*limit)"',
        "actuator",
    ),
    Fault(
        "actuator: dead band of a part",
        "model/loads/actuator.py",
        '"deadband(push, dead_band)"',
        '"deadband(push, 0.9*dead_band)"',
        "actuator",
    ),
    Fault(
        "actuator: lag a tenth too short",
        "model/loads/actuator.py",
        '- applied)/lag"',
        '- applied)/(0.9*lag)"',
        "actuator_lag",
    ),
    Fault(
        "cylinder: stiffness without the stroke on the rod side",
        "model/loads/hydraulic_cylinder.py",
        "{AREA_B}*(stroke - {x})",
        "{AREA_B}*(stroke)",
        "hyd",
    ),
    Fault(
        "cylinder: the area of the rod added",
        "model/loads/hydraulic_cylinder.py",
        "bore*bore - rod*rod",
        "bore*bore + rod*rod",
        "hyd",
    ),
    Fault(
        "tyre: force along the road 5 % too small",
        "model/loads/tyre.py",
        'f"friction*{LOAD}*{MAGIC}", f"height',
        'f"0.95*friction*{LOAD}*{MAGIC}", f"height',
        "tyre",
    ),
    Fault(
        "tyre: damping the wrong way",
        "model/loads/tyre.py",
        "- damping*sinking",
        "+ damping*sinking",
        "tyre",
    ),
    Fault(
        "tyre: relaxation twice as long",
        "model/loads/tyre.py",
        "abs(speed)*slip)/relaxation",
        "abs(speed)*slip)/(2*relaxation)",
        "tyre",
    ),
    Fault(
        "belt: torque times 0.85",
        "model/joints/belt.py",
        "return 2.0 * np.tanh(",
        "return 1.7 * np.tanh(",
        "belt",
    ),
    Fault(
        "belt: strands pull straight",
        "model/joints/belt.py",
        "part = 2.0 * np.sqrt(1.0 - self.sine(at) ** 2)",
        "part = 2.0",
        "belt",
    ),
    Fault(
        "band brake: both directions exchanged",
        "model/joints/band_brake.py",
        "return 0.5 * (one + other), (arm + helping)",
        "return 0.5 * (one + other), -(arm + helping)",
        "brake",
    ),
    Fault(
        "clutch: Stribeck's curve without its square",
        "kernels/friction.py",
        "falls = np.exp(-(part * part))",
        "falls = np.exp(-abs(part))",
        "clutch",
    ),
    Fault(
        "pin: the radius of the pin for that of the friction circle",
        "kernels/friction.py",
        "first = mu * ld(W.par, o + 4, w) / np.sqrt(1.0 + mu * mu)",
        "first = mu * ld(W.par, o + 4, w)",
        "pin",
    ),
    Fault(
        "guide: one end of two",
        "kernels/friction.py",
        "2.0 * mu / long",
        "1.0 * mu / long",
        "rail_long",
    ),
    Fault(
        "rolling resistance 5 % too great",
        "model/joints/rolling.py",
        'arm = at[f"{self.name}.resistance"]',
        'arm = 1.05 * at[f"{self.name}.resistance"]',
        "roll",
    ),
    Fault(
        "teeth: efficiency of the wrong wheel",
        "model/joints/_teeth.py",
        "of_i = (1.0 - efficiency) / (sign * (bj + efficiency * bi))",
        "of_i = (1.0 - efficiency) / (sign * (bi + efficiency * bj))",
        "gear",
    ),
    Fault(
        "gear: radius a thousandth too great",
        "model/joints/gear.py",
        "return [without_slip(self, at, *self.radii(at))]",
        "return [without_slip(self, at, 1.001 * self.radii(at)[0], self.radii(at)[1])]",
        "gear_alpha",
    ),
    Fault(
        "damper: gives power",
        "model/loads/spring.py",
        '[0.0, at[f"{self.name}.coefficient"]]',
        '[0.0, -at[f"{self.name}.coefficient"]]',
        "dampers",
    ),
    Fault(
        "torsion damper 5 % too stiff",
        "model/loads/torsion.py",
        '[0.0, at[f"{self.name}.coefficient"]]',
        '[0.0, 1.05 * at[f"{self.name}.coefficient"]]',
        "dampers",
    ),
    Fault(
        "gas: exponent of a hundredth more",
        "model/loads/reciprocating_cylinder.py",
        "np.power(last / h, stiff)",
        "np.power(last / h, 1.01 * stiff)",
        "gas",
    ),
    Fault(
        "table: a knot's slope halved",
        "laws/table.py",
        "right[1:-1] = 3.0 * (h[1:]",
        "right[1:-1] = 1.5 * (h[1:]",
        "table",
    ),
    Fault(
        "impact: restitution 5 % too small",
        "kernels/contact_impacts.py",
        "0.0 if kind == STILL else I.restitution[k]",
        "0.0 if kind == STILL else 0.95 * I.restitution[k]",
        "bounce",
    ),
    Fault(
        "impact: impulse of expansion 5 % too small",
        "kernels/mode_problem.py",
        "else D.restitution[r] * D.impulse[r]",
        "else 0.95 * D.restitution[r] * D.impulse[r]",
        "bounce",
    ),
    Fault(
        "contact: friction of what slides a tenth too small",
        "model/contact.py",
        "return mu, mu if self.static",
        "return 0.9 * mu, mu if self.static",
        "slide",
    ),
    Fault(
        "contact: sticks beyond its cone",
        "kernels/contact_guards.py",
        "most += U.static[n] *",
        "most += 1.2 * U.static[n] *",
        "grip",
    ),
    Fault(
        "contact: opens late",
        "kernels/contact_guards.py",
        "value = pressing(L, W, U, k)",
        "value = pressing(L, W, U, k) + 3.0",
        "lift",
    ),
    Fault(
        "rope: a thousandth too long",
        "model/contact.py",
        'ContactCandidate.taut(self.bodies, positions, at[f"{self.name}.length"])',
        'ContactCandidate.taut(self.bodies, positions, 1.001 * at[f"{self.name}.length"])',
        "rope",
    ),
    Fault(
        "cam program: acceleration of the falling half a hundredth too great",
        "laws/kernels.py",
        "        s2 = -s2\n    return base + height * s",
        "        s2 = -1.01 * s2\n    return base + height * s",
        "program",
    ),
    Fault(
        "contact: restitution of a part",
        "model/contact.py",
        'return at[f"{self.name}.restitution"]  # type',
        'return 0.97 * at[f"{self.name}.restitution"]  # type',
        "bounce",
    ),
    Fault(
        "limit: a hundredth too far",
        "model/joint_limits.py",
        'at[f"{self.joint.name}.limits.{self.end}"]',
        '1.01 * at[f"{self.joint.name}.limits.{self.end}"]',
        "limit",
    ),
    Fault(
        "friction of a joint: ends to stick late",
        "kernels/contact_guards.py",
        "return min(ahead - own, back + own)",
        "return min(ahead - own, back + own) + 2.0",
        "overload",
    ),
    Fault(
        "friction of a joint: ends to stick early",
        "kernels/contact_guards.py",
        "return min(ahead - own, back + own)",
        "return min(ahead - own, back + own) - 0.5",
        "overload",
    ),
)
