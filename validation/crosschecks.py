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

* **balance**: Newton and Euler of every body and the power of all, by sums of what is reported.
* **oracle**: the same analysis once more, in dense matrices, from the description. Motions with
  contacts it follows by an integrator and a location of events of its own; at each event all
  combinations of open, stick and slip are tried, in impacts too. pymunk and MuJoCo follow contacts
  by steps of several lengths, which tell places within their order, and modes.
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
