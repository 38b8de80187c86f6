"""A four-bar with every kind of number, batches of it, and the comparison of two runs."""

import numpy as np
from numpy.testing import assert_allclose

import mbody
from mbody import makers
from mbody.core.lanes import LANES
from mbody.laws import ConstantAcceleration, Harmonic, Polynomial
from mbody.makers import polar

DESIGNS = 2 * LANES + 9
# uneven, with an instant given twice
TIMES = np.concatenate([np.linspace(0.0, 0.1, 4), np.geomspace(0.11, 0.9, 9), [0.9, 0.93]])


def four_bar(**changes):
    """A four-bar with a point of every sort and a load of several."""
    number = {
        "A.x": 1.0, "A.y": 0.0, "mass": 2.0, "inertia": 0.2, "weight": 30.0, "cg.r": 1.4,
        "cg.angle": 0.3, "P.r": 2.0, "P.angle": 0.5, "value": 0.6, "speed": 5.0, "push": 20.0,
        "push.angle": 0.8, "c0": 1.0, "c1": 2.0, "stiffness": 40.0, "free_length": 0.5,
        "preload": 3.0, "mean": -9.81, "O4.x": 3.5, "frequency": 7.0,
    } | changes  # fmt: skip
    machine = mbody.Mechanism(
        "four-bar", g=9.9, ground={"O2": (0.0, 0.0), "O4": (number["O4.x"], 0.0)}
    )
    machine.add(
        mbody.Body(
            "crank",
            mass=number["mass"],
            inertia=number["inertia"],
            cg=(0.4, 0.1),
            points={"O": (0.0, 0.0), "A": (number["A.x"], number["A.y"])},
        ),
        mbody.Body(
            "coupler",
            weight=number["weight"],
            inertia=0.8,
            cg=polar(number["cg.r"], number["cg.angle"]),
            points={
                "A": (0.0, 0.0),
                "B": polar(3.0, 0.0),
                "P": polar(number["P.r"], number["P.angle"]),
            },
            guess=0.4,
        ),
        makers.bar("rocker", 2.0, mass=3.0, guess=1.6),
        mbody.Revolute("O2", "ground.O2", "crank.O"),
        mbody.Revolute("A", "crank.A", "coupler.A"),
        mbody.Revolute("B", "coupler.B", "rocker.B"),
        mbody.Revolute("O4", "ground.O4", "rocker.A"),
        mbody.AngleDriver(
            "motor", "crank", ConstantAcceleration(number["value"], number["speed"], 4.0)
        ),
        mbody.Gravity("gravity", y=Harmonic(number["mean"], 1.0, number["frequency"])),
        mbody.Force("push", "coupler.P", number["push"], angle=number["push.angle"], follows=True),
        mbody.Torque("load", "rocker", value=Polynomial([number["c0"], number["c1"]])),
        mbody.Spring(
            "spring",
            "ground.O4",
            "coupler.P",
            stiffness=number["stiffness"],
            free_length=number["free_length"],
            preload=number["preload"],
        ),
    )
    return machine


# dotted name of the system: name of the argument above, another value
NUMBERS = {
    "crank.A.x": ("A.x", 0.9),
    "crank.A.y": ("A.y", 0.15),
    "crank.mass": ("mass", 4.0),
    "crank.inertia": ("inertia", 0.5),
    "coupler.weight": ("weight", 55.0),
    "coupler.cg.r": ("cg.r", 1.9),
    "coupler.cg.angle": ("cg.angle", -0.2),
    "coupler.P.r": ("P.r", 1.1),
    "coupler.P.angle": ("P.angle", 1.2),
    "motor.law.value": ("value", 0.9),
    "motor.law.speed": ("speed", 3.5),
    "push.value": ("push", -35.0),
    "push.angle": ("push.angle", 2.0),
    "load.value.c0": ("c0", 7.0),
    "load.value.c1": ("c1", -3.0),
    "spring.stiffness": ("stiffness", 90.0),
    "spring.free_length": ("free_length", 0.9),
    "spring.preload": ("preload", -4.0),
    "gravity.y.mean": ("mean", -1.6),
    "gravity.y.frequency": ("frequency", 3.0),
    "ground.O4.x": ("O4.x", 3.4),
}


def same(one, other, *, exactly=False):
    """Two runs of one description say the same.

    To the last bit where the same kernel ran. Lanes and scalar path may end Newton differently, a
    last correction of up to 1e-12 apart; that is not carried into Φ_q, so that rates differ by ten
    times that, and forces, which come from accelerations, by a hundred times.
    """
    pairs = [(one.t, other.t)]
    for name in one:
        for field in ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha"):
            pairs.append((getattr(one[name], field), getattr(other[name], field)))
    for k, (a, b) in enumerate(pairs):
        part = 1e-12 if k == 0 or (k - 1) % 9 < 3 else 1e-11
        assert_allclose(a, b, rtol=0, atol=0.0 if exactly else part * max(1.0, np.abs(b).max()))
    if one.analysis == "kinematics":
        return
    forces = [
        (getattr(one.reaction(joint.name), field), getattr(other.reaction(joint.name), field))
        for joint in one.mechanism.joints
        for field in ("fx", "fy", "torque")
    ]
    forces += [(one.effort(d.name), other.effort(d.name)) for d in one.mechanism.drivers]
    top = max(np.abs(b).max() for _, b in forces)
    for a, b in forces:
        assert_allclose(a, b, rtol=0, atol=0.0 if exactly else 1e-10 * top)


def spread(count=DESIGNS, seed=0):
    """Every number of the four-bar somewhere about its first value."""
    rng = np.random.default_rng(seed)
    machine = mbody.assemble(four_bar())
    return {name: float(machine.values[name]) + rng.uniform(-0.08, 0.08, count) for name in NUMBERS}


class OneOf:
    """One design of a batch's run, with the names of a run."""

    def __init__(self, run, n):
        self.run, self.n = run, n
        self.t, self.mechanism, self.analysis = run.t, run.mechanism, run.analysis

    def __iter__(self):
        return iter(self.run)

    def __getitem__(self, body):
        return self.part(self.run[body])

    def reaction(self, joint):
        return self.part(self.run.reaction(joint))

    def effort(self, driver):
        return self.run.effort(driver)[self.n]

    def part(self, history):
        return type("part", (), {k: v[self.n] if np.ndim(v) == 2 else v for k, v in
                                 vars(history).items()})()  # fmt: skip
