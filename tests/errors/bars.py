"""Links as bars: their direction, their sections, what they carry inside."""

from mbody import Body, Mechanism, Prismatic, kinematics, kinetostatics, simulate
from mbody.engineering import internal_loads
from mbody.model.body import RectangleSection, RoundSection, TubeSection
from tests.errors.command import said
from tests.errors.models import four_bar
from tests.errors.results import batch

POINTS = {"A": (0.0, 0.0), "B": (1.0, 0.0)}


def inside(*arguments, **more):
    return internal_loads(kinetostatics(four_bar()), *arguments, **more)


def slide():
    machine = Mechanism("slide")
    machine.add(Body("slide", mass=1.0), Prismatic("guide", "ground", "slide"))
    return simulate(machine, 0.1, instants=2)


def flat():
    """A link with two points at one place."""
    machine = Mechanism("plate")
    machine.add(Body("plate", mass=1.0, points={"A": (0.0, 0.0), "B": (0.0, 0.0)}))
    machine.add(Prismatic("guide", "ground", "plate"))
    return simulate(machine, 0.1, instants=2)


def section(given, points=POINTS):
    return Body("rod", points=points, section=given)


SCENARIOS = {
    "internal loads of kinematics": lambda: internal_loads(kinematics(four_bar()), "coupler"),
    "internal loads of a batch": lambda: internal_loads(batch(), "coupler"),
    "internal loads of no link": lambda: inside("piston"),
    "internal loads along no points": lambda: inside("coupler", ("A", "C")),
    "internal loads along one place": lambda: internal_loads(flat(), "plate", ("A", "B")),
    "internal loads at one place": lambda: inside("coupler", places=1),
    "internal loads of what is no bar": lambda: internal_loads(slide(), "slide"),
    "a stress without a section": lambda: inside("coupler").stress(),
    "a bar along one point": said(
        ["internal", "norton_fourbar", "--body", "rocker", "--along", "A"]
    ),
    "a section in words": lambda: section("round"),
    "a section of no height": lambda: section(RectangleSection(0.0, 1.0)),
    "a tube inside out": lambda: section(TubeSection(1.0, 2.0)),
    "a bar along a point that is not there": lambda: section(RoundSection(1.0, ("A", "C"))),
}
