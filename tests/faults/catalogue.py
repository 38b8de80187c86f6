"""The faults: where, what, and on which mechanism they show."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FAULTS", "Fault"]


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
        One of `tests.faults.models.MODELS`.
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
