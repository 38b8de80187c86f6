"""Axial force, shear force and bending moment along a link, and the stress that they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.engineering.forces_on_bars import Bar, bar_of, forces_on
from mbody.engineering.link_mass import LinkMass, link_mass
from mbody.errors import ModelError
from mbody.model.section import CrossSection, as_section
from mbody.sheets.text_table import Column, number, paragraph, table
from mbody.solution.checks import check_forces
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution, as_solution
from mbody.system.read_only import lock

__all__ = ["InternalLoads", "Stress", "internal_loads"]

Array = np.ndarray

#: Places along a bar, unless the caller says how many.
PLACES = 101
#: Most of them.
MOST = 100_001
#: A place that moves along a bar by less than this part of its length stands still.
STILL = 1e-9
#: Places across a section at which stresses are combined, with the outer fibres and the middle.
ACROSS = 41
#: Below this part of the greatest force a value is printed as zero.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Stress(Inherited):
    """Stresses along a bar by beam theory: arrays (instants, places) [force/area].

    Attributes
    ----------
    upper, lower : arrays
        Normal stress in the outer fibres on the left and the right of the bar's direction; tension
        is positive.
    shear : array
        The greatest shear stress, at the neutral axis.
    equivalent : array
        The greatest by von Mises across the section.

    >>> import mbody
    >>> machine = mbody.Mechanism("a rod that turns")
    >>> rod = mbody.makers.bar("rod", 2.0, mass=3.0, ends=("O", "P"))
    >>> machine.add(rod, mbody.Revolute("O", "ground", "rod.O"))
    >>> machine.add(mbody.AngleDriver("motor", "rod", mbody.laws.ConstantSpeed(0.0, 10.0)))
    >>> found = internal_loads(mbody.kinetostatics(machine), "rod", ("O", "P"))
    >>> stress = found.stress(mbody.model.section.RectangleSection(0.02, 0.01))
    >>> round(float(stress.upper[0, 0]), 3) == round(float(found.axial[0, 0]) / 2e-4, 3)
    True
    """

    upper: Array
    lower: Array
    shear: Array
    equivalent: Array

    def __post_init__(self) -> None:
        lock(self)


@dataclass(frozen=True, eq=False, repr=False)
class InternalLoads(Inherited):
    """What a link carries inside, at cuts along its bar.

    Attributes
    ----------
    body : str
    along : tuple of 2 str
        The points between which the bar goes.
    length : float
        Between them [length].
    place : array (places,)
        From the first point on [length]; twice where forces act: just before and just after.
    axial, shear, bending : arrays (instants, places)
        Tension positive [force]; shear positive where the part before the cut is pushed to the
        left of the bar's direction [force]; bending positive where it stretches the fibres on the
        right [force·length]: dM/ds = V.
    closure : float
        What is left behind the last place, of force and moment, as a part of the greatest: the
        error of the link's equilibrium.
    lumped : bool
        Whether the mass is a lump at its mass centre.
    section : CrossSection or None
    run : Solution

    >>> import mbody
    >>> machine = mbody.Mechanism("a rod that turns")
    >>> rod = mbody.makers.bar("rod", 2.0, mass=3.0, ends=("O", "P"))
    >>> machine.add(rod, mbody.Revolute("O", "ground", "rod.O"))
    >>> machine.add(mbody.AngleDriver("motor", "rod", mbody.laws.ConstantSpeed(0.0, 10.0)))
    >>> found = internal_loads(mbody.kinetostatics(machine), "rod", ("O", "P"))
    >>> found.closure < 1e-12, abs(float(found.axial[0, -1])) < 1e-9
    (True, True)
    """

    body: str
    along: tuple[str, str]
    length: float
    place: Array
    axial: Array
    shear: Array
    bending: Array
    closure: float
    lumped: bool
    section: CrossSection | None
    run: Any

    def __post_init__(self) -> None:
        lock(self)

    def stress(self, section: CrossSection | None = None) -> Stress:
        """Stress of the link's own section, or of another.

        σ = N/A ± M c/I,  τ = k V/A,  equivalent √(σ² + 3τ²) where both act.

        Raises
        ------
        ModelError
            Where there is no section.

        Notes
        -----
        Of straight beams, whose sections stay plane: not at pins, fillets and holes, where stresses
        concentrate, and not for short links. With η from −1 to 1 across the section σ is linear; τ
        falls to both sides as 1 − η² in rectangles and circles, as √(1 − η²) in thin tubes.
        """
        if section is not None:
            of: Any = as_section(section, self.body, self.run.mechanism[self.body].points)
            sizes = {key: getattr(of, key) for key in of.sizes}
        elif self.section is None:
            raise ModelError(
                f"'{self.body}' has no section for its stress: give it one, such as section = "
                '{ rectangle = ["20 mm", "8 mm"] }',
                self.body,
            )
        else:
            of = self.section
            values = self.run.system.values
            sizes = {key: float(values[f"{self.body}.section.{key}"]) for key in of.sizes}
        area, second, fibre, factor = of.properties(sizes)
        mean, bent = self.axial / area, self.bending * fibre / second
        shear = factor * self.shear / area
        squares = np.zeros(mean.shape)
        for eta in np.linspace(-1.0, 1.0, ACROSS):
            part = shear * (1.0 - eta * eta) ** of.shear_profile
            squares = np.maximum(squares, (mean + eta * bent) ** 2 + 3.0 * part**2)
        equivalent = np.sqrt(squares)
        return Stress(mean - bent, mean + bent, shear, equivalent, **inherited(self.run))

    def greatest(self) -> dict[str, tuple[float, float, int]]:
        """Of axial, shear, bending and, where there is a section, of the equivalent stress: the
        value of greatest size, its place, and its instant.
        """
        rows = {"axial": self.axial, "shear": self.shear, "bending": self.bending}
        if self.section is not None:
            rows["stress"] = self.stress().equivalent
        found = {}
        for key, values in rows.items():
            k, n = np.unravel_index(int(np.abs(values).argmax()), values.shape)
            found[key] = (float(values[k, n]), float(self.place[n]), int(k))
        return found

    def data(self) -> dict[str, Any]:
        """As plain values, ready for JSON."""
        whole = {
            "body": self.body,
            "along": list(self.along),
            "length": self.length,
            "lumped": self.lumped,
            "closure": self.closure,
            "t": self.run.t.tolist(),
            "place": self.place.tolist(),
            **{key: getattr(self, key).tolist() for key in ("axial", "shear", "bending")},
        }
        if self.section is not None:
            stress = self.stress()
            whole["stress"] = {
                key: getattr(stress, key).tolist()
                for key in ("upper", "lower", "shear", "equivalent")
            }
        whole["greatest"] = {
            key: {"value": value, "place": place, "t": float(self.run.t[k])}
            for key, (value, place, k) in self.greatest().items()
        }
        return whole

    def __str__(self) -> str:
        unit = self.run.mechanism.units
        units = {
            "axial": unit.force,
            "shear": unit.force,
            "bending": unit.of("torque"),
            "stress": unit.of("pressure"),
        }
        words = {
            "axial": "axial force",
            "shear": "shear force",
            "bending": "bending moment",
            "stress": "equivalent stress",
        }
        found = self.greatest()
        size = max(abs(found["axial"][0]), abs(found["shear"][0]))
        floor = {"axial": size, "shear": size, "bending": size * self.length}
        value = {
            key: one[0] if abs(one[0]) > ROUNDING * floor.get(key, 0.0) else 0.0
            for key, one in found.items()
        }
        lines = table(
            [
                Column("GREATEST", [words[key] for key in found], text=True),
                Column("", [number(value[key]) for key in found]),
                Column("unit", [units[key] for key in found], text=True),
                Column("at s", [number(one[1]) for one in found.values()], unit.length),
                Column("t", [number(self.run.t[one[2]]) for one in found.values()], unit.time),
            ]
        )
        head = (
            f"{self.run.mechanism.name}: '{self.body}' along {self.along[0]}–{self.along[1]}, "
            f"{number(self.length)} {unit.length}"
        )
        notes = [line for note in self.notes for line in paragraph(f"note: {note}")]
        return "\n".join(
            [head, "", *lines, "", f"equilibrium {self.closure:.1e} (relative)", *notes]
        )

    def __repr__(self) -> str:
        return f"InternalLoads('{self.body}' along {self.along[0]}–{self.along[1]})"


def internal_loads(
    run: Solution,
    body: str,
    along: Sequence[str] | str | None = None,
    *,
    places: int = PLACES,
    lumped: bool = False,
) -> InternalLoads:
    """Internal loads of a link: axial force, shear force and bending moment along its bar.

    N(s) = −Σ F_x,  V(s) = Σ F_y,  M(s) = Σ F_y (s − s_k) − Σ T_k  over all that acts before the cut

    Parameters
    ----------
    run : Solution
        Of kinetostatics, statics or simulate, of one design.
    body : str
        A link.
    along : pair of str, optional
        Two of its points; by default those of its section, else the places of its two joints.
    places : int
        At how many equal places it is cut, and just before and after every force besides.
    lumped : bool
        Whether its mass is taken as a lump at its mass centre.

    Returns
    -------
    InternalLoads

    Raises
    ------
    ModelError
        For an analysis without forces, a batch, a body that there is not, or a link whose direction
        is open.

    Notes
    -----
    The mass lies along the bar with a density of second degree that has the link's mass, mass
    centre and inertia: of a uniform rod it is constant. Where no such density is positive all
    along, as of a link with heavy ends, it is a lump, and a note says so. Every element takes its
    own weight and inertia force. A mass centre beside the bar is a mass parallel to it on rigid
    arms.

    Forces act at their places; those beside the bar by a rigid arm across it. Couples of motors and
    torques act at the pin that joins their two bodies, else at the mass centre; so do couplings.

    Source: F. P. Beer, E. R. Johnston, *Mechanics of Materials*, chapter 5; dynamic loads: R. L.
    Norton, *Design of Machinery*, chapter 11.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.Mechanism("a rod that turns")
    >>> rod = mbody.makers.bar("rod", 2.0, mass=3.0, ends=("O", "P"))
    >>> machine.add(rod, mbody.Revolute("O", "ground", "rod.O"))
    >>> machine.add(mbody.AngleDriver("motor", "rod", mbody.laws.ConstantSpeed(0.0, 10.0)))
    >>> found = internal_loads(mbody.kinetostatics(machine), "rod", ("O", "P"))
    >>> round(float(found.axial[0, 0]), 9)  # ½ m ω² l at the pin
    300.0
    """
    run = as_solution(run)
    check_forces(run, "internal loads")
    if isinstance(places, bool) or not isinstance(places, int) or not 2 <= places <= MOST:
        raise ModelError(f"places must be a whole number from 2 to {MOST}, not {places!r}")
    bar = bar_of(run, body, along)
    mass = _mass(run, body, bar, lumped)
    forces = forces_on(run, body, bar)
    place = _snapped(forces.place, bar.length)
    cuts, after = _cuts(bar, mass, place, places)
    # all of the mass and every force before a cut
    before = np.where(after, place[..., None] <= cuts, place[..., None] < cuts)
    n = -np.einsum("tk,tks->ts", forces.axial, before)
    v = np.einsum("tk,tks->ts", forces.across, before)
    arms = (cuts - place[..., None]) * before
    m = np.einsum("tk,tks->ts", forces.across, arms) - np.einsum(
        "tk,tks->ts", forces.couple, before
    )
    x, y, bent = _own(run, body, bar, mass, forces.weight, cuts, after)
    n, v, m = n - x, v + y, m + bent
    size = max(float(np.abs(n).max()), float(np.abs(v).max()))
    reach = max(float(np.abs(m).max()), size * bar.length)
    ends = (n[:, -1], size), (v[:, -1], size), (m[:, -1], reach)
    closure = max((float(np.abs(end).max()) / by for end, by in ends if by), default=0.0)
    link: Any = run.mechanism[body]
    more = inherited(run)
    more["notes"] = (*more.get("notes", ()), *_notes(body, mass, lumped))
    inner = slice(1, -1)  # between just after the first force and just before the last
    return InternalLoads(
        body,
        bar.along,
        bar.length,
        cuts[inner],
        n[:, inner],
        v[:, inner],
        m[:, inner],
        closure,
        mass.density is None and mass.mass > 0.0,
        link.section,
        run,
        **more,
    )


def _mass(run: Solution, body: str, bar: Bar, lumped: bool) -> LinkMass:
    first = 3 * run.system.bodies[body]
    mass, _, inertia = (float(part) for part in run.system.mass[first : first + 3, 0])
    place, across = bar.coordinates(*map(float, run.system.numbers.point(f"{body}.cg")))
    return link_mass(mass, inertia, place, across, bar.length, lumped)


def _notes(body: str, mass: LinkMass, lumped: bool) -> tuple[str, ...]:
    if lumped or mass.density is not None or not mass.mass:
        return ()
    return (
        f"the mass of '{body}' is a lump at its mass centre: no mass along the bar alone has its "
        "inertia and its mass centre",
    )


def _snapped(place: Array, length: float) -> Array:
    """Places of forces; those that stand still are at one place, and at an end where they are near.

    Rounding of positions would make two places of one.
    """
    found = place.copy()
    for row in found.T:
        if np.ptp(row) <= STILL * length:
            row[:] = row.mean()
            for end in (0.0, length):
                if abs(row[0] - end) <= STILL * length:
                    row[:] = end
    return found


def _cuts(bar: Bar, mass: LinkMass, place: Array, places: int) -> tuple[Array, Array]:
    """Places of the cuts in ascending order, and whether each is just after what acts there."""
    lump = [mass.place] if mass.density is None and mass.mass > 0.0 else []
    low = min(0.0, float(place.min(initial=0.0)), *lump)
    high = max(bar.length, float(place.max(initial=bar.length)), *lump)
    fixed = [float(row[0]) for row in place.T if np.ptp(row) <= STILL * bar.length]
    sharp = np.unique([low, high, *fixed, *lump])
    plain = np.setdiff1d(np.linspace(low, high, places), sharp)
    cuts = np.concatenate([sharp, sharp, plain])
    after = np.concatenate(
        [np.zeros(sharp.size, bool), np.ones(sharp.size, bool), np.ones(plain.size, bool)]
    )
    order = np.lexsort((after, cuts))
    return cuts[order], after[order]


def _own(
    run: Solution, body: str, bar: Bar, mass: LinkMass, weight: Array, cuts: Array, after: Array
) -> tuple[Array, Array, Array]:
    """Force along and across the bar by inertia and weight of what is before the cuts, and the
    bending moment by them.
    """
    history = run[body]
    whole, first, second = mass.moments(cuts, after)
    still = run.analysis == "statics"
    zero = np.zeros(len(run))
    ax, ay = (zero, zero) if still else bar.components(history.angle, history.ax, history.ay)
    omega, alpha = (zero, zero) if still else (history.omega, history.alpha)
    gx, gy = (weight / mass.mass if mass.mass else 0.0 * weight).T
    x = np.outer(gx - ax, whole) + np.outer(omega**2, first)
    y = np.outer(gy - ay, whole) - np.outer(alpha, first)
    about = np.outer(gy - ay, first) - np.outer(alpha, second)
    return x, y, (cuts - mass.place) * y - about + mass.across * x
