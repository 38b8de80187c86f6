"""Studies of many designs: which mechanism, which of its numbers scatter, and what is measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mbody
from benchmarks import models
from benchmarks.peers import closed_form
from mbody.sweeps import Normal, Samples, Sweep, Uniform, latin_hypercube, monte_carlo
from validation.norton_fourbar import newton_euler as book

__all__ = [
    "EIGHT_BAR",
    "FOUR_BAR",
    "FREE",
    "POSITIONS",
    "SIX_BARS",
    "SLIDER_CRANK",
    "Study",
    "norton_numbers",
]

#: Of one turn.
POSITIONS = 360


@dataclass(frozen=True)
class Study:
    """A mechanism and what differs between its designs.

    `letters` are the names that the numbers have in the equations by hand.
    """

    name: str
    build: Callable[[], mbody.Mechanism]
    scatter: Callable[[mbody.System], Mapping[str, Any]]
    measure: Any
    draw: Callable[..., Samples] = latin_hypercube
    letters: Mapping[str, str] = field(default_factory=dict)

    def samples(self, system: mbody.System, count: int) -> Samples:
        """The same in every process."""
        return self.draw(self.scatter(system), count, seed=1)

    def sweep(self, system: mbody.System, count: int, threads: int) -> Sweep:
        """One turn of every design, as a user writes it."""
        return mbody.sweep(
            system,
            self.samples(system, count),
            measure=self.measure,
            turn="motor",
            instants=POSITIONS,
            threads=threads,
        )

    def numbers(self, found: Sweep) -> dict[str, np.ndarray]:
        """What differs, by the letters."""
        return {letter: found.parameter(name) for name, letter in self.letters.items()}


def parts(part: float, *names: str) -> Callable[[mbody.System], dict[str, Any]]:
    """Numbers that are anywhere within such a part of what the mechanism has."""
    return lambda system: {name: Uniform(part * abs(system.values[name])) for name in names}


def _norton(system: mbody.System) -> dict[str, Any]:
    lengths = {name: Uniform(0.15) for name in _LINKS}
    return lengths | parts(0.1, *_MASSES)(system)


_LINKS = {"crank.A.x": "a", "coupler.B.x": "b", "rocker.B.x": "c", "ground.O4.x": "d"}
_MASSES = {"coupler.weight": "m3", "rocker.weight": "m4"}
_MASSES |= {"coupler.inertia": "i3", "rocker.inertia": "i4"}

#: Norton's example 11-3: four lengths ± 0.15 in, weights and inertias of two links ± 10 %.
FOUR_BAR = Study(
    "four-bars",
    lambda: mbody.gallery.load("norton_fourbar"),
    _norton,
    "peak(A.force)",
    letters=_LINKS | _MASSES,
)


def norton_numbers(found: Sweep) -> dict[str, np.ndarray]:
    """All numbers of the four-bars that the equations by hand take; a weight is a mass by g."""
    varied = FOUR_BAR.numbers(found)
    masses = {name: varied[name] / book.G for name in ("m3", "m4")}
    return closed_form.book_numbers(**{**varied, **masses})


def _six_bar(name: str, label: str, *names: str) -> Study:
    return Study(label, lambda: mbody.gallery.load(name), parts(0.005, *names), "peak(B.force)")


_LOOP = ("crank.A.x", "coupler.B.x", "rocker.B.x", "link.D.x", "output.D.x")
#: Lengths ± 0.5 %: both come near a dead centre.
SIX_BARS = (
    _six_bar("stephenson_sixbar", "Stephenson's six-bars", *_LOOP, "ground.O6.x"),
    _six_bar("watt_sixbar", "Watt's six-bars", *_LOOP, "rocker.C.y"),
)
#: Lengths and masses ± 2 %.
EIGHT_BAR = Study(
    "eight-bars",
    models.eight_bar,
    parts(
        0.02,
        "crank.B.x",
        "coupler.B.x",
        "rocker.B.x",
        "link.B.x",
        "middle.B.x",
        "second.B.x",
        "output.B.x",
        "middle.mass",
        "output.mass",
    ),
    "peak(B.force)",
)


def _slider_crank() -> mbody.Mechanism:
    return mbody.makers.slider_crank(0.05, 0.16, offset=0.002, masses=(0.4, 0.6, 0.5), speed=300.0)


#: Letter, and tolerance [m, rad, kg, kg·m²], of three standard deviations.
_TOLERANCES = {
    "crank.A.x": ("r", 5e-5),
    "rod.B.x": ("l", 5e-5),
    "ground.guide.y": ("e", 1e-4),
    "guide.i.angle": ("beta", 2e-3),
    "rod.cg.x": ("gx", 3e-4),
    "rod.cg.y": ("gy", 1e-4),
    "rod.mass": ("m3", 1e-2),
    "rod.inertia": ("i3", 2e-5),
    "slider.mass": ("m4", 1e-2),
}
#: Crank 50 mm, rod 160 mm, 300 rad/s, with nine toleranced numbers.
SLIDER_CRANK = Study(
    "slider-cranks",
    _slider_crank,
    lambda system: {name: Normal(tolerance=width) for name, (_, width) in _TOLERANCES.items()},
    "peak(A.force)",
    monte_carlo,
    {name: letter for name, (letter, _) in _TOLERANCES.items()},
)

#: The same four-bars, released at 60°: angle and speed of the crank at the end.
FREE = Study(
    "free four-bars",
    lambda: mbody.gallery.load("free_fourbar"),
    _norton,
    {"angle": "last(crank.angle)", "omega": "last(crank.omega)"},
)
