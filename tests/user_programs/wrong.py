"""What type checkers refuse: one error on every line that is marked."""

import mbody
from mbody import AngleDriver, Body, Force, Mechanism, Revolute, Solution, Spring

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
