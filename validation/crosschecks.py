"""Which engines agree with mbody on what, for every model of the gallery: `docs/crosscheck.md`.

`python -m validation.crosschecks` runs all engines that are installed and writes the page anew.
"""

from collections import Counter
from pathlib import Path

from mbody import crosscheck, gallery

PAGE = Path(__file__).parents[1] / "docs" / "crosscheck.md"

HEAD = """\
# Cross-checks

What other engines say of every model of the gallery, as `mbody crosscheck NAME` asks them: the
instants or the free motion that the model itself requests. Written by
`python -m validation.crosschecks`; the tests hold it against fresh answers.

* **balance**: Newton and Euler of every body and the power of all, by sums of what is reported;
  contacts and ropes press, and friction stays within its cone or its limit.
* **oracle**: the same analysis once more, in dense matrices, from the description. Motions with
  contacts it follows by an integrator and a location of events of its own; at each event all
  combinations of open, stick and slip are tried, in impacts too, and forces are compared where they
  are unique. What it does not find, as forces of sticking that are not unique, drops these instants
  alone: it begins again behind them. In joints with friction it takes from the result which of
  them stick, and finds accelerations and forces. States are followed from one instant to the next.
  pymunk and MuJoCo follow contacts by steps of several lengths, which tell places within their
  order, and modes.
* **pinocchio**: a tree of joints with loop constraints. *motion*: poses, rates and accelerations by
  its kinematics, how far loops are open, and what drivers drive; *forces*: every effort and joint
  force by its recursive Newton–Euler algorithm; *accelerations*: those that its forward dynamics
  finds from loads and efforts; *over time*: the free motion by scipy's DOP853 from them. What it
  has no joint for is applied as the force that we found, and must leave the rest in balance.
* **pymunk**: its own bodies, pins, grooves and motors, stepped at several lengths and brought to
  steps of no length: forces at the instants, and of what is free the motion and its energy.
* **mujoco**: the same tree with soft constraints, made as stiff as its steps bear: forces by its
  inverse dynamics, motions by its own steps.

How far apart both may be is measured: rounding times the condition of the loops at the instant; of
motions over time the errors of both times the growth of errors along the motion; of pymunk and
MuJoCo what halving their steps changes. The command tells it beside every number.

## What agrees
`agrees` is true where every engine agrees in all that it compares and one of them, not the
balance, has compared the motion of each body, the unique forces of each joint, driver and contact,
the law of each load, and each state. An element whose force an engine takes from the result counts
as not compared there. Where nothing differs, but something was compared by none, `agrees` is null,
and `not_compared` names it.

## Whose formulas
Each law is written a second time for the engines that check, from the book and the description's
numbers.

| law | second formula |
|---|---|
| constants to polynomials, formulas of `t` or `x` | Taylor series by Python and pint; all engines |
| `Table` | SciPy's cubic spline and pchip, straight lines; all engines |
| `Rise`, `Cam` | Norton's polynomials and modified curves; all engines |
| formulas of measured quantities, `curves` | Python, pint, and the oracle's own geometry; oracle |
| `Function`, `CustomLoad`, `CustomJoint` | none: the user's own function is called |
| `Table2` | none: it is not read |
| forces, torques, springs, dampers, gravity | by each engine, and once more by the oracle |
| `CentrifugalField` | mass elements (oracle), a joint in space (Pinocchio) |
| `PistonPressure`, `ReciprocatingCylinder` | pressures by the cycle (oracle) |
| `InductionMotor` | Kloss, 2 T_b/(s/s_b + s_b/s) (oracle) |
| `DCMotor`, `Actuator`, `HydraulicCylinder`, `Tyre` | forces and rates of their states (oracle) |
| `Belt`, `BandBrake`, `Clutch`, `FrictionForce` | balance of lever and strands, e^(μβ) (oracle) |
| friction of pins, slides, slots, teeth, cams, rolling | forces at each place of contact (oracle) |
| contacts, groups, ropes, stops, limits, impacts | all modes (oracle); steps (pymunk, MuJoCo) |
| drivers, couplings, joints | Φ as in textbooks, derivatives by jets (oracle); trees (Pinocchio) |
| controllers, joints that separate, friction of joints beside contacts | none |

## Gallery

| model | engine | verdict | quantities | not expressible |
|---|---|---|---|---|
"""


def subject(quantity):
    """What a quantity is about."""
    if quantity.endswith("over time"):
        return "over time"
    if quantity.endswith("by the forces"):
        return "accelerations"
    last = quantity.rpartition(".")[2]
    if last in ("fx", "fy", "torque", "effort", "balance", "power") or ": sum of" in quantity:
        return "forces"
    return "motion"


def row(name, engine, opinion):
    """One line of the table."""
    count = Counter(subject(one.quantity) for one in opinion.rows)
    told = ", ".join(f"{what} {number}" for what, number in count.items()) or "none"
    missing = ", ".join(one.element for one in opinion.not_expressible)
    verdict = "agrees" if opinion.agrees else "differs"
    verdict = verdict if opinion.rows else "nothing to compare"
    return f"| `{name}` | {engine} | {verdict} | {told} | {missing} |".replace("|  |", "| |")


def page():
    """The whole page."""
    lines = [
        row(name, engine, opinion)
        for name in gallery.names()
        for engine, opinion in crosscheck(gallery.load(name)).opinions.items()
    ]
    return HEAD + "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
    print(f"wrote {PAGE.name}")
