"""The faults: where, what, and on which mechanism they show."""

from __future__ import annotations

import re
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


def read(text: str) -> tuple[Fault, ...]:
    """Name, model and file of each fault; below them the lines that go, and those that come."""
    return tuple(
        Fault(
            name,
            file,
            "\n".join(re.findall("(?m)^- (.*)", lines)),
            "\n".join(re.findall(r"(?m)^\+ (.*)", lines)),
            model,
        )
        for name, model, file, lines in re.findall(r"(.+) \| (.+) \| (.+)\n((?:[-+] .*\n)+)", text)
    )


FAULTS = read(r"""
arm: place of the mass centre left out | linkage | model/element.py
-             found = self._arms[element.name, field] = x - cx, y - cy
+             found = self._arms[element.name, field] = x, y - cy
polar points: sine for cosine | polar | model/element.py
-             return r * np.cos(angle), r * np.sin(angle)
+             return r * np.cos(angle), r * np.cos(angle)
units: a pound force of 4.45 N | units | quantities/units.py
- ("lbf", _LBF, 0
+ ("lbf", Fraction(445, 100), 0
units: an inch of 25 mm | units | quantities/units.py
- _IN, _FT = Fraction("0.0254")
+ _IN, _FT = Fraction("0.025")
units: a degree of 1/181 of π | units | quantities/units.py
- ("deg degree degrees °", Fraction(1, 180)
+ ("deg degree degrees °", Fraction(1, 181)
weights: a mass as large as the weight | weights | system/assembler.py
- weight is None else weight / self.mechanism.g
+ weight is None else weight
masses: half the moment of inertia | linkage | system/assembler.py
- numbers[f"{body.name}.inertia"]]
+ 0.5 * numbers[f"{body.name}.inertia"]]
revolute: centripetal acceleration the other way | linkage | model/joints/revolute.py
- (0.0, 0.0), (dax, day)
+ (0.0, 0.0), (-dax, day)
revolute: a lever arm of the Jacobian a hundredth too long | linkage | model/joints/revolute.py
- blocks = (1.0, 0.0, -piy,
+ blocks = (1.0, 0.0, -1.01 * piy,
prismatic: Coriolis acceleration halved | sliders | model/joints/prismatic.py
- - 2.0 * w * (nx * dvy
+ - 1.0 * w * (nx * dvy
distance: acceleration across the rod left out | extras | model/joints/distance.py
- f[2] - across * across / length -
+ f[2] -
pin in slot: Coriolis acceleration halved | slot | model/joints/coordinate.py
- - 2.0 * w * (ux * dvy
+ - 1.0 * w * (ux * dvy
gear: the ratio upside down | gears | model/joints/gear.py
- *at.arm(element, "j"), i, j, phase]
+ *at.arm(element, "j"), j, i, phase]
rack: a pitch radius a tenth too large | rack | model/joints/rack.py
- w, r = i[7], p[6]
+ w, r = i[7], 1.1 * p[6]
roller: second derivative of the profile left out | cam | model/joints/cam.py
- rest = length * w * w - f[2] * rate * rate -
+ rest = length * w * w -
fixed angle: of the markers the wrong way round | extras | model/joints/fixed.py
- at.angle(self, "j") - at.angle(self, "i")
+ at.angle(self, "i") - at.angle(self, "j")
coupling: acceleration of a term without its factor | coupling | kernels/constraints.py
- return c * phi[0], by_i, by_j, c * gamma[0]
+ return c * phi[0], by_i, by_j, gamma[0]
polynomial law: acceleration halved | linkage | kernels/forces.py
- f2 = f2 * t + 2.0 * f1
+ f2 = f2 * t + f1
harmonic law: rate without the frequency | harmonic | laws/kernels.py
- frequency * c, -frequency
+ c, -frequency
spring: stretch from twice the free length | spring | model/loads/spring.py
- (length - p[4]) + rate
+ (length - 2.0 * p[4]) + rate
spring: pull on j at the arm of i | spring | model/loads/spring.py
- (-fx, -fy, pjy * fx - pjx
+ (-fx, -fy, pjy * fx - pix
damper: rate across, not along | damper | model/loads/spring.py
- rate * (ux * dvx + uy * dvy)
+ rate * (ux * dvy + uy * dvx)
torsion spring: free angle the other way | twist | model/loads/torsion.py
- (j[2] - i[2] - p[0])
+ (j[2] - i[2] + p[0])
torque: nothing on the other body | torque | model/loads/torque.py
- return (0.0, 0.0, -f),
+ return None,
force: its arm's sign | force | model/loads/force.py
- px * fy - py * fx
+ px * fy + py * fx
following force: turned backwards | force | model/loads/force.py
- (c * p[2] - s * p[3])
+ (c * p[2] + s * p[3])
gravity: weight in y a tenth too large | linkage | model/loads/gravity.py
- return m * gx, m * gy
+ return m * gx, 1.1 * m * gy
reactions: torque told about the wrong side of a wheel | rack | solution/histories.py
- torque - (offset[0] * fy - offset[1] * fx)
+ torque + (offset[0] * fy - offset[1] * fx)
efforts: the sign of the multiplier | linkage | solution/solution.py
- locked(-self.primitive_history(self.system.primitives_of[driver][0], 0))
+ locked(self.primitive_history(self.system.primitives_of[driver][0], 0))
""")
MOVING_FAULTS = read(r"""
Kloss's torque a tenth too small | im | model/loads/induction_motor.py
- kloss = f"2*breakdown
+ kloss = f"1.8*breakdown
motor: star at a half of the torque | im_star | model/loads/induction_motor.py
- STAR = "(1/3)"
+ STAR = "(1/2)"
motor: back-EMF without the ratio | dc | model/loads/dc_motor.py
- constant*ratio*rate)/inductance
+ constant*rate)/inductance
motor: current falls by half of the resistance | dc | model/loads/dc_motor.py
- "(voltage - resistance*current
+ "(voltage - 0.5*resistance*current
actuator: limit 5 % too great | actuator | model/loads/actuator.py
- f"clamp({text}, -limit, limit)"
+ f"clamp({text}, -1.05*limit, 1.05*limit)"
actuator: dead band of a part | actuator | model/loads/actuator.py
- "deadband(push, dead_band)"
+ "deadband(push, 0.9*dead_band)"
actuator: lag a tenth too short | actuator_lag | model/loads/actuator.py
- - applied)/lag"
+ - applied)/(0.9*lag)"
cylinder: stiffness without the stroke on the rod side | hyd | model/loads/hydraulic_cylinder.py
- {AREA_B}*(stroke - {x})
+ {AREA_B}*(stroke)
cylinder: the area of the rod added | hyd | model/loads/hydraulic_cylinder.py
- bore*bore - rod*rod
+ bore*bore + rod*rod
tyre: force along the road 5 % too small | tyre | model/loads/tyre.py
- f"friction*{LOAD}*{MAGIC}", f"height
+ f"0.95*friction*{LOAD}*{MAGIC}", f"height
tyre: damping the wrong way | tyre | model/loads/tyre.py
- - damping*sinking
+ + damping*sinking
tyre: relaxation twice as long | tyre | model/loads/tyre.py
- abs(speed)*slip)/relaxation
+ abs(speed)*slip)/(2*relaxation)
belt: torque times 0.85 | belt | model/joints/belt.py
- return 2.0 * np.tanh(
+ return 1.7 * np.tanh(
belt: strands pull straight | belt | model/joints/belt.py
- part = 2.0 * np.sqrt(1.0 - self.sine(at) ** 2)
+ part = 2.0
band brake: both directions exchanged | brake | model/joints/band_brake.py
- return 0.5 * (one + other), (arm + helping)
+ return 0.5 * (one + other), -(arm + helping)
clutch: Stribeck's curve without its square | clutch | kernels/friction.py
- falls = np.exp(-(part * part))
+ falls = np.exp(-abs(part))
pin: the radius of the pin for that of the friction circle | pin | kernels/friction.py
- first = mu * ld(W.par, o + 4, w) / np.sqrt(1.0 + mu * mu)
+ first = mu * ld(W.par, o + 4, w)
guide: one end of two | rail_long | kernels/friction.py
- 2.0 * mu / long
+ 1.0 * mu / long
rolling resistance 5 % too great | roll | model/joints/rolling.py
- arm = at[f"{self.name}.resistance"]
+ arm = 1.05 * at[f"{self.name}.resistance"]
teeth: efficiency of the wrong wheel | gear | model/joints/_teeth.py
- of_i = (1.0 - efficiency) / (sign * (bj + efficiency * bi))
+ of_i = (1.0 - efficiency) / (sign * (bi + efficiency * bj))
gear: radius a thousandth too great | gear_alpha | model/joints/gear.py
- return [without_slip(self, at, *self.radii(at))]
+ return [without_slip(self, at, 1.001 * self.radii(at)[0], self.radii(at)[1])]
damper: gives power | dampers | model/loads/spring.py
- [0.0, at[f"{self.name}.coefficient"]]
+ [0.0, -at[f"{self.name}.coefficient"]]
torsion damper 5 % too stiff | dampers | model/loads/torsion.py
- [0.0, at[f"{self.name}.coefficient"]]
+ [0.0, 1.05 * at[f"{self.name}.coefficient"]]
gas: exponent of a hundredth more | gas | model/loads/reciprocating_cylinder.py
- np.power(last / h, stiff)
+ np.power(last / h, 1.01 * stiff)
table: a knot's slope halved | table | laws/table.py
- right[1:-1] = 3.0 * (h[1:]
+ right[1:-1] = 1.5 * (h[1:]
impact: restitution 5 % too small | bounce | kernels/contact_impacts.py
- 0.0 if kind == STILL else I.restitution[k]
+ 0.0 if kind == STILL else 0.95 * I.restitution[k]
impact: impulse of expansion 5 % too small | bounce | kernels/mode_problem.py
- else D.restitution[r] * D.impulse[r]
+ else 0.95 * D.restitution[r] * D.impulse[r]
contact: friction of what slides a tenth too small | slide | model/contact.py
- return mu, mu if self.static
+ return 0.9 * mu, mu if self.static
contact: sticks beyond its cone | grip | kernels/contact_guards.py
- most += U.static[n] *
+ most += 1.2 * U.static[n] *
contact: opens late | lift | kernels/contact_guards.py
- value = pressing(L, W, U, k)
+ value = pressing(L, W, U, k) + 3.0
rope: a thousandth too long | rope | model/contact.py
- ContactCandidate.taut(self.bodies, positions, at[f"{self.name}.length"])
+ ContactCandidate.taut(self.bodies, positions, 1.001 * at[f"{self.name}.length"])
cam program: acceleration of the falling half a hundredth too great | program | laws/kernels.py
-         s2 = -s2
-     return base + height * s
+         s2 = -1.01 * s2
+     return base + height * s
contact: restitution of a part | bounce | model/contact.py
- return at[f"{self.name}.restitution"]  # type
+ return 0.97 * at[f"{self.name}.restitution"]  # type
limit: a hundredth too far | limit | model/joint_limits.py
- at[f"{self.joint.name}.limits.{self.end}"]
+ 1.01 * at[f"{self.joint.name}.limits.{self.end}"]
friction of a joint: ends to stick late | overload | kernels/contact_guards.py
- return min(ahead - own, back + own)
+ return min(ahead - own, back + own) + 2.0
friction of a joint: ends to stick early | overload | kernels/contact_guards.py
- return min(ahead - own, back + own)
+ return min(ahead - own, back + own) - 0.5
""")
