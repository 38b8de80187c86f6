"""Links as bars: their direction, their sections, what they carry inside."""

from mbody import Body, Mechanism, Prismatic, kinetostatics, simulate
from mbody.engineering import internal_loads
from mbody.model.body import RectangleSection, RoundSection, TubeSection
from tests.errors.command import said
from tests.errors.models import four_bar

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
    "internal loads of no link": lambda: inside("piston"),
    "internal loads along no points": lambda: inside("coupler", ("A", "C")),
    "internal loads along one place": lambda: internal_loads(flat(), "plate", ("A", "B")),
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

SENTENCES = r"""
internal loads of no link | ModelError | piston | there is no moving body 'piston' (there are: 'crank', 'coupler', 'rocker')
internal loads along no points | ModelError | coupler | 'coupler' is a bar along two of its points (there are: 'A', 'B'), not 'A', 'C'
internal loads along one place | ModelError | plate | 'A' and 'B' of 'plate' are one place: a bar goes along two
internal loads of what is no bar | ModelError | slide | the direction of the bar 'slide' is open: it has joints at no named point; say along which two points it goes, such as section = { rectangle = ["20 mm", "8 mm"], along = ["A", "B"] }
a stress without a section | ModelError | coupler | 'coupler' has no section for its stress: give it one, such as section = { rectangle = ["20 mm", "8 mm"] }
a bar along one point | UsageError | - | --along takes two points such as A,B, not 'A'
a section in words | ModelError | rod | 'rod': section must be RectangleSection(height, thickness), TubeSection(outer, inner) or RoundSection(diameter), not 'round'
a section of no height | ModelError | rod | 'rod': height of its section must be above 0, not 0
a tube inside out | ModelError | rod | 'rod': a tube of 1 outside cannot be 2 inside: give outer, inner
a bar along a point that is not there | ModelError | rod | 'rod': a bar goes along two of its points (there are: 'A', 'B'), not 'A', 'C'
"""
