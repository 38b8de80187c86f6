"""The mechanism of elements whose layout `mbody.topologies.plan` makes from a graph."""

from __future__ import annotations

from mbody.laws import ConstantSpeed
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.element import Marker
from mbody.model.joints import PinSlot, Revolute
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism
from mbody.topologies.plan import GROUND, Graph


def linkage_of_elements(graph: Graph) -> Mechanism:
    """A mechanism of this topology, with any numbers: pins R of the tree, two rows C for each that
    closes a loop, slides S, drivers D, each with its number.
    """
    ground = {f"J{k}": (float(k), 1.0) for k in range(graph.joints)}
    made = Mechanism("linkage", units="SI", ground=ground)
    names = {GROUND: "ground"} | {n: f"L{n}" for n in range(len(graph.links))}
    for n, own in enumerate(graph.links):
        points = {f"J{k}": (float(k), 1.0) for k in own}
        made.add(Body(names[n], mass=1.0, inertia=1.0, points=points, guess=(0.0, 0.0, 0.0)))
    tree, closing = graph.edges
    for n, (k, i, j) in enumerate(tree):
        made.add(Revolute(f"R{n}", f"{names[i]}.J{k}", f"{names[j]}.J{k}"))
    slots = [(f"C{n}_{a}", i, k, j) for n, (k, i, j, _) in enumerate(closing) for a in (0, 1)]
    slots += [(f"S{n}", on, k, graph.first(k)) for n, (k, on) in enumerate(graph.slides)]
    for name, i, k, j in slots:
        made.add(PinSlot(name, Marker(names[i], (1.0, 0.0)), f"{names[j]}.J{k}"))
    for n, link in enumerate(graph.drivers):
        made.add(AngleDriver(f"D{n}", names[link], ConstantSpeed(0.0, 1.0)))
    made.add(Gravity("gravity", x=0.0, y=-1.0))
    return made
