"""A user's program, annotated: type checkers accept it, and it runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pint

import mbody
from mbody.analysis.equilibria.equilibrium import Equilibria
from mbody.analysis.freedom.mobility import Mobility
from mbody.analysis.inverse.conditions import Answer
from mbody.analysis.linear.modes import Modes
from mbody.engineering import close_loops, equilibrium_curve, flywheel
from mbody.laws import Cam, ConstantSpeed, Dwell, Harmonic, Law, Polynomial, Rise, Table
from mbody.makers import bar, polar
from mbody.model.loads import CustomLoad
from mbody.model.simulation import Measure, Question, Unknown
from mbody.solution.energy import Energy
from mbody.solution.histories import BodyHistory
from mbody.sweeps import Normal, Steps, Sweep, monte_carlo

Array = npt.NDArray[np.float64]
UNITS: pint.UnitRegistry[float] = pint.UnitRegistry()


def four_bar(points: dict[str, tuple[float, float]]) -> mbody.Mechanism:
    """A four-bar with numbers, text and quantities."""
    machine = mbody.Mechanism(
        "four-bar",
        units="in-lbf-s",
        g="386 in/s^2",
        ground={"O2": (0, 0), "O4": ("19 in", 0.0)},
        parameters={"w": "240 rpm", "a": 5.0},
        measures={"torque": "motor.effort", "metric": Measure("motor.effort", "N m")},
    )
    crank = mbody.Body("crank", weight=1.5, inertia="0.4 lbf*in*s^2", cg=polar(3, "30 deg"))
    coupler = mbody.Body(
        "coupler", mass="8 lb", points={"A": (0, 0), "B": ("3*a", 0)}, guess="25 deg"
    )
    rocker = mbody.Body(
        "rocker", weight=UNITS.Quantity(5.8, "lbf"), points=points, guess=(19.0, 0.0, 1.9)
    )
    machine.add(crank, coupler, rocker)
    machine.add(
        mbody.Revolute("O2", "ground.O2", "crank"),
        mbody.Revolute("A", mbody.Marker("crank", ("a", 0.0), angle="10 deg"), "coupler.A"),
        mbody.Revolute("B", "coupler.B", rocker.at("B")),
        mbody.Revolute("O4", "ground.O4", "rocker"),
        mbody.AngleDriver("motor", crank, ConstantSpeed("60 deg", "w")),
        mbody.Force("push", "coupler.B", "80 lbf", angle="330 deg"),
        mbody.Torque("brake", "rocker", value=lambda t: 120.0),
    )
    return machine


def slider_crank() -> mbody.Mechanism:
    """Text for every number."""
    machine = mbody.Mechanism("slider-crank", units="mm-N-s", parameters={"r": "5 cm"})
    machine.add(
        mbody.Body("crank", mass="1 kg", points={"A": ("r", 0)}),
        mbody.Body("rod", mass="2 kg", points={"B": (np.float64(200.0), 0.0)}),
        mbody.Body("slider", mass="0.5 kg", guess=(250.0, 0.0, 0.0)),
        mbody.Revolute("O", "ground", "crank"),
        mbody.Revolute("A", "crank.A", "rod"),
        mbody.Revolute("B", "rod.B", "slider"),
        mbody.Prismatic("guide", "ground", "slider"),
        mbody.Spring("spring", "ground", "slider", stiffness="2 N/mm", free_length="150 mm"),
        mbody.Damper("damper", "ground", "slider", coefficient="1 N*s/m"),
        mbody.Gravity("gravity", y="-9.81 m/s^2"),
    )
    return machine


@dataclass(frozen=True)
class Drag(CustomLoad):
    """A load of the user's."""

    k: float = mbody.number_field("number", 1.0)


def elements() -> Sequence[object]:
    """What a user may give to other constructors."""
    rise: Law = Rise("cycloidal", height="10 mm", start=0, duration="90 deg")
    back = Rise("3-4-5", "-10 mm", 0.0, "90 deg")
    program: Law = Cam([Rise("cycloidal", 1.0, 0.0, 1.0), Dwell("30 deg"), back], period="1 rev")
    table = Table(np.linspace(0.0, 1.0, 3), ["0 N", "1 N", "4 N"], interpolation="pchip")
    return (
        bar("rod", "60 mm", mass=UNITS.Quantity(2.0, "kg"), guess="30 deg"),
        mbody.makers.four_bar(40, "12 cm", 80.0, 100, masses=("1 kg", 0, 0), units="mm-N-s"),
        *(
            rise,
            program,
            table,
            Polynomial([1.0, "2 m/s"]),
            Harmonic(0.0, "2 mm", "3 Hz", "90 deg"),
        ),
        mbody.CoordinateDriver("ram", "ground", "block", "0.1 m * sin(t)"),
        mbody.Distance("rod", "a.P", "b.Q", length=UNITS.Quantity(2.0, "m")),
        mbody.Fixed("weld", "a.P", "b.Q"),
        mbody.Gear("mesh", "a", "b", radius_i="2 cm", radius_j=0.1),
        mbody.LengthCoupling(
            "belt",
            [mbody.CouplingTerm("2 cm", angle="a"), mbody.CouplingTerm(-1, angle="b")],
            "1 m",
        ),
        Drag("drag", "ground", "a.P", k=2.0),
        mbody.SimulationSettings(
            "2 s", {"crank": {"angle": "30 deg"}}, events=[mbody.Event("crank.omega")]
        ),
        Question({"brake.value": {"low": 0.0}}, "wheel.alpha = 0", at={"t": "1 s"}),
        Unknown("brake", start="2 N", low=0, high=1e3),
        mbody.Stop("floor", "ball.y - 20 mm", restitution="0.8"),
        mbody.Revolute("hinge", "a.P", "b.Q", limits=("-30 deg", None), restitution=0.2),
    )


def results() -> None:
    """Results by the types that they are annotated with."""
    machine = four_bar({"O4": (0.0, 0.0), "B": (10.0, 0.0)})
    mass: float | None = machine.bodies[1].mass
    assert mass is not None and mass > 0.0
    inertia: float = mbody.Body("crank", inertia="3 kg*m^2").inertia
    assert inertia is not None
    run: mbody.Solution = mbody.kinetostatics(machine, turn="motor", instants=13)
    torque: Array = run.effort("motor")
    pin: mbody.Reaction = run.reaction("A", on="crank")
    crank: BodyHistory = run["crank"]
    doubts: tuple[mbody.Doubt, ...] = run.doubts
    assert not doubts and torque.shape == pin.fx.shape == crank.omega.shape
    system: mbody.System = mbody.assemble(machine).with_values({"crank.inertia": [0.4, 0.5]})
    designs: mbody.Solution = mbody.kinematics(system, t=[0.0, 0.01])
    assert len(designs) == 2 and flywheel(run, 0.02) > 0.0
    angles = np.radians([60.0, 90.0])
    guesses = {"coupler": "25 deg", "rocker": (UNITS.Quantity(19.0, "inch"), 0.0, 1.9)}
    given = mbody.statics(machine, drive={"motor": (angles, 0.0)}, guess=guesses)
    assert len(given) == len(mbody.kinematics(machine, range(2), drive={"motor": angles})) == 2
    assert run.measure(Measure("motor.effort")).shape == run.momentum("crank").x.shape
    answer: Answer = mbody.solve_for(machine, {"push.value": 80.0}, "motor.effort = 0")
    found: float = answer[0].unknowns["push.value"]
    unknowns: dict[str, dict[str, str | float]] = {"push.value": {"start": "80 lbf", "low": 0}}
    same = mbody.solve_for(machine, unknowns, ["motor.effort = 0"], at={"t": "0 s"})
    assert abs(same[0].unknowns["push.value"] - found) < 1e-6 * abs(found)
    report: Mobility = mbody.mobility(machine)
    assert report.freedom == 0 and found == found
    samples = monte_carlo({"crank.inertia": Normal(0.4, 0.01)}, 3, seed=1)
    study: Sweep = mbody.sweep(machine, samples, measure={"peak": "peak(motor.effort)"})
    assert len(study) == 3
    inertias = Steps("0.4 lbf*in*s^2", 0.5, 3)
    peaks = mbody.sweep(
        machine,
        {"w": ["240 rpm", 25.0], "crank.inertia": inertias},
        measure=[("motor.effort", "peak")],
        t=[0.0],
    )
    assert len(peaks) == 6
    mbody.from_toml(mbody.to_toml(slider_crank()))


def motions() -> None:
    """Motion over time, and rest."""
    machine = slider_crank()
    settings = mbody.SimulationSettings("0.05 s", rtol=1e-9)
    machine.simulation = settings
    run: mbody.Solution = mbody.simulate(
        machine, "0.02 s", events=[mbody.Event("crank.omega", name="turn")]
    )
    ends = mbody.simulate(machine, np.float64(0.02), times=[0.01, 0.02], release={})
    assert len(ends) == 2
    energy: Energy | None = run.energy
    assert energy is not None
    rest: Equilibria = mbody.equilibrium(machine)
    shapes: Modes = mbody.modes(machine)
    lowest: float = float(shapes[0].modes[0].frequency)
    assert len(rest) and lowest >= 0.0
    closed: mbody.Solution = close_loops(machine, rates={"crank": "10 rpm"})
    assert len(closed) == 1 and equilibrium_curve is not None


if __name__ == "__main__":
    assert elements()
    results()
    motions()
