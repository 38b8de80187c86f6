"""What type checkers refuse: one error on every line that is marked."""

import mbody
from mbody import AngleDriver, Body, Force, Mechanism, Revolute, Solution, Spring, System
from mbody.engineering import close_loops, equilibrium_curve
from mbody.sweeps import Normal, latin_hypercube


def analyses(machine: Mechanism, system: System) -> None:
    """Arguments of analyses."""
    mbody.kinematics(machine, t="1 s")  # wrong
    mbody.statics(machine, t=[0.0, "1 s"])  # wrong
    mbody.kinetostatics(machine, drive=[0.5])  # wrong
    mbody.kinetostatics(machine, drive={"motor": "30 deg"})  # wrong
    mbody.kinetostatics(machine, guess={"crank": {"angle": 0.5}})  # wrong
    mbody.kinetostatics(machine, guess=0.5)  # wrong
    mbody.driver_range(machine, t="1 s")  # wrong
    mbody.mobility(machine, guess=["crank"])  # wrong
    mbody.equilibrium(machine, starts={"crank": {"angle": 0.5}})  # wrong
    mbody.modes(machine, starts=[0.5])  # wrong
    mbody.simulate(machine, until=[2.0])  # wrong
    mbody.simulate(machine, 2.0, times=["1 s"])  # wrong
    mbody.simulate(machine, 2.0, release=["motor"])  # wrong
    close_loops(machine, drive={"motor": {"value": 0.5}})  # wrong
    equilibrium_curve(machine, "push.value", (0.0, 1.0), start=0.5)  # wrong
    mbody.solve_for(machine, 3.0, "motor.effort = 0")  # wrong
    mbody.solve_for(machine, "brake", conditions=0.0)  # wrong
    mbody.solve_for(machine, "brake", "motor.effort = 0", at=[0.5])  # wrong
    mbody.sweep(machine, {"crank.mass": None})  # wrong
    mbody.sweep(machine, {"crank.mass": [1.0]}, measure=3)  # wrong
    latin_hypercube({"crank.mass": 1.0}, 10)  # wrong
    Normal(tolerance=[0.1])  # wrong
    system.with_values({"crank.mass": "1 kg"})  # wrong
    mbody.load("four_bar.toml", parameters={"a": [1.0]})  # wrong
    mbody.save_run(mbody.load_run("run.mbody"), 3.0)  # wrong


mbody.makers.four_bar([1.0], 3, 2, 3.5)  # wrong
mbody.makers.slider_crank("5 cm", "20 cm", masses=(1, 2))  # wrong
mbody.makers.bar("a", "5 cm", guess={"angle": 0.5})  # wrong
Body("a", mass=[1.0])  # wrong
Body("a", points={"A": 3.0})  # wrong
Body("a", cg=1.0)  # wrong
AngleDriver("motor", "a", law=[0.0])  # wrong
Force("push", 3, 80.0)  # wrong
Spring("spring", "a", "b", stiffness=(1.0, "N"))  # wrong
Mechanism("m", g=[9.81])  # wrong
Mechanism("m").add("crank")  # wrong
mbody.kinetostatics("four_bar")  # wrong
print(mbody.Simulation)  # wrong
print(mbody.linkage)  # wrong
text: str = Body("a", inertia=1.0).inertia  # wrong
run: Solution = Revolute("A", "a", "b")  # wrong
