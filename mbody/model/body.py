"""Rigid bodies: mass, mass centre, inertia, named points in link axes, a rough first position."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import (
    Element,
    Marker,
    Point,
    PointLike,
    as_point,
    check_name,
    listed,
    number_field,
    point_numbers,
)
from mbody.quantities import Formula
from mbody.quantities.formula import (
    Converted,
    LeftOut,
    Number,
    NumberField,
    OptionalNumberField,
    default,
    default_made,
    number,
    required,
)

if TYPE_CHECKING:
    from mbody.model.touching_shapes import Shape, ShapeLike

#: What can be measured of a body, with its dimension; of a point all but the angles.
MOTION = {
    **dict.fromkeys(("x", "y"), "length"),
    **dict.fromkeys(("vx", "vy"), "velocity"),
    **dict.fromkeys(("ax", "ay"), "acceleration"),
}
ROTATION = {"angle": "angle", "omega": "angular velocity", "alpha": "angular acceleration"}
#: The origin of a link's axes, unless it has a point of that name.
ORIGIN = "origin"

# -- Cross-sections of links that are bars: rectangle, tube, round -----------------------------

#: The two named points between which a bar goes; none where its joints say so.
Along = Converted[tuple[str, ...], Sequence[str]]


@dataclass(frozen=True)
class CrossSection:
    """Base of all sections: sizes [length], and the line of the bar."""

    sizes: ClassVar[tuple[str, ...]] = ()
    #: Shear stress falls from the middle to the outer fibres as (1 − η²) to this power.
    shear_profile: ClassVar[float] = 1.0

    def properties(self, of: Mapping[str, Any]) -> tuple[Any, Any, Any, Any]:
        """Area [length²], second moment of area [length⁴], distance of the outer fibre [length],
        and the greatest shear stress by the mean one; `of`: sizes by name.
        """
        raise NotImplementedError


@dataclass(frozen=True)
class RectangleSection(CrossSection):
    """A rectangle: its height is in the plane of motion, across the bar.

    Parameters
    ----------
    height, thickness : float or str
        In the plane, and across it [length].
    along : pair of str, optional
        Named points between which the bar goes; by default the places of its two joints.

    >>> section = RectangleSection(0.02, 0.008)
    >>> [f"{float(v):.4g}" for v in section.properties(vars(section))]
    ['0.00016', '5.333e-09', '0.01', '1.5']
    """

    sizes: ClassVar[tuple[str, ...]] = ("height", "thickness")

    height: NumberField = required()
    thickness: NumberField = required()
    along: Along = default(())

    def properties(self, of: Mapping[str, Any]) -> tuple[Any, Any, Any, Any]:
        """b h, b h³/12, h/2, 3/2."""
        h, b = of["height"], of["thickness"]
        return b * h, b * h**3 / 12.0, h / 2.0, 1.5


@dataclass(frozen=True)
class RoundSection(CrossSection):
    """A full circle. `diameter` [length]."""

    sizes: ClassVar[tuple[str, ...]] = ("diameter",)

    diameter: NumberField = required()
    along: Along = default(())

    def properties(self, of: Mapping[str, Any]) -> tuple[Any, Any, Any, Any]:
        """π d²/4, π d⁴/64, d/2, 4/3."""
        d = of["diameter"]
        return np.pi * d**2 / 4.0, np.pi * d**4 / 64.0, d / 2.0, 4.0 / 3.0


@dataclass(frozen=True)
class TubeSection(CrossSection):
    """A hollow circle. `outer`, `inner`: diameters [length]."""

    sizes: ClassVar[tuple[str, ...]] = ("outer", "inner")
    shear_profile: ClassVar[float] = 0.5

    outer: NumberField = required()
    inner: NumberField = required()
    along: Along = default(())

    def properties(self, of: Mapping[str, Any]) -> tuple[Any, Any, Any, Any]:
        """π (D² − d²)/4, π (D⁴ − d⁴)/64, D/2, and 4/3 (D² + D d + d²)/(D² + d²) of V Q/(I t)."""
        outer, inner = of["outer"], of["inner"]
        squares = outer**2 + inner**2
        area = np.pi * (outer**2 - inner**2) / 4.0
        shear = 4.0 / 3.0 * (squares + outer * inner) / squares
        return area, area * squares / 16.0, outer / 2.0, shear


def as_section(value: Any, name: str, points: Iterable[str]) -> CrossSection | None:
    """A section of the link `name` with checked sizes; its line goes between two of the points."""
    if value is None:
        return None
    if not isinstance(value, CrossSection):
        raise ModelError(
            f"'{name}': section must be RectangleSection(height, thickness), TubeSection(outer, "
            f"inner) or RoundSection(diameter), not {value!r}",
            name,
        )
    sizes = {k: number(getattr(value, k), "length", name, f"section.{k}") for k in value.sizes}
    for key, size in sizes.items():
        if not isinstance(size, Formula) and not size > 0.0:
            raise ModelError(f"'{name}': {key} of its section must be above 0, not {size:g}", name)
    found: Any = value
    along = found.along
    line = (along,) if isinstance(along, str) else tuple(along or ())
    if line and (len(line) != 2 or line[0] == line[1] or not set(line) <= set(points)):
        raise ModelError(
            f"'{name}': a bar goes along two of its points (there are: {listed(points)}), not "
            f"{listed(line)}",
            name,
        )
    made: CrossSection = replace(found, **sizes, along=line)
    outer, inner = sizes.get("outer"), sizes.get("inner")
    if isinstance(outer, float) and isinstance(inner, float) and not inner < outer:
        raise ModelError(
            f"'{name}': a tube of {outer:g} outside cannot be {inner:g} inside: give outer, inner",
            name,
        )
    return made


@dataclass(frozen=True)
class SlenderRod:
    """Mass spread along a line at `angle` [rad] in link axes, as of a thin rod.

    Examples
    --------
    >>> import mbody
    >>> mbody.Body("arm", mass=1.0, inertia=0.1, spread=SlenderRod(0.5)).spread.angle
    0.5
    """

    angle: NumberField = default(0.0)


@dataclass(frozen=True)
class SecondMoments:
    """In-plane second moments of mass about the mass centre, link axes [mass·length²]:
    ``xx`` = ∫x² dm, ``yy`` = ∫y² dm, ``xy`` = ∫xy dm.
    """

    xx: NumberField = required()
    yy: NumberField = required()
    xy: NumberField = default(0.0)


@dataclass(frozen=True)
class Guess:
    """A rough first pose of the link axes; what is None is found from the neighbours.

    A place is taken only where x and y are both given; `Body` takes (x, y, angle) as well.

    `angle`: Rough angle of the link's x axis [rad].
    `x`, `y`: Rough place of the link's origin [length].
    """

    angle: OptionalNumberField = default(None)
    x: OptionalNumberField = default(None)
    y: OptionalNumberField = default(None)


#: What is taken for a guess: an angle, or (x, y, angle).
GuessLike: TypeAlias = "Guess | Number | Sequence[Number | None] | None"
#: Guesses of bodies by name.
Guesses: TypeAlias = "Mapping[str, GuessLike]"


def as_guess(value: GuessLike, name: str) -> Guess:
    """A guess from None, an angle [rad], (x, y, angle) or a `Guess`."""
    if value is None:
        return Guess()
    if isinstance(value, Guess):
        parts: tuple[Any, ...] = (value.angle, value.x, value.y)
    elif isinstance(value, (tuple, list)):
        if len(value) != 3:
            raise ModelError(
                f"'{name}': guess must be an angle or (x, y, angle), not {value!r}", name
            )
        parts = (value[2], value[0], value[1])
    else:
        parts = (value, None, None)
    names, dimensions = ("angle", "x", "y"), ("angle", "length", "length")
    return Guess(
        **{
            key: None if part is None else number(part, dimension, name, f"guess.{key}")
            for key, part, dimension in zip(names, parts, dimensions, strict=True)
        }
    )


def as_spread(value: Any, name: str) -> str | SlenderRod | SecondMoments | None:
    """How the mass of a body is spread, with checked numbers."""
    if value is None or (isinstance(value, str) and value == "point"):
        return value
    if isinstance(value, SlenderRod):
        return SlenderRod(number(value.angle, "angle", name, "spread.angle"))
    if isinstance(value, SecondMoments):
        keys = ("xx", "yy", "xy")
        moments = (number(getattr(value, k), "inertia", name, f"spread.{k}") for k in keys)
        return SecondMoments(*moments)
    raise ModelError(
        f"'{name}': spread must be \"point\", SlenderRod(angle) or SecondMoments(xx, yy, xy), not "
        f"{value!r}",
        name,
    )


@dataclass(frozen=True)
class Body(Element):
    """One rigid link.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    mass, weight : float, optional
        Either of them [mass] or [force]; a weight becomes a mass with the mechanism's g.
        With neither the body is massless, which is ordinary.
    inertia : float
        About the mass centre [mass·length²].
    cg : pair or Polar
        Mass centre in link axes [length].
    points : dict
        Named places in link axes [length], pairs (x, y) or `polar(r, angle)`.
    guess : float, tuple or Guess, optional
        Rough angle [rad], or (x, y, angle) of the link axes: it chooses the branch on which the
        loops are closed. Without one the link axes are parallel to those of the ground, where the
        loops are closed so; else they follow from the guesses of other bodies.
    spread : "point", SlenderRod, SecondMoments, optional
        How the mass is spread in the plane; only loads of a rotating plane need it.
    shapes : dict
        What contacts touch, by name: ``{"disc": "O", "radius": 0.3}``, a `ring` likewise, a
        ``{"segment": ("A", "B")}``, a ``{"polygon": ("A", "B", "C")}``, an endless
        ``{"line": {"point": "P", "angle": 0.1}}``; all by points of the body. A point alone needs
        no shape.

    section : RectangleSection, TubeSection, RoundSection, optional
        Cross-section of a link that is a bar, of `mbody.model.body`: for its stresses alone.

    Examples
    --------
    >>> crank = Body("crank", mass=2.0, cg=(0.1, 0.0), points={"A": (0.2, 0.0)})
    >>> crank.at("A")
    Marker(body='crank', point='A', angle=0.0)

    Where a drawing has dimensions, give the points of all bodies in its axes, as in one position of
    the mechanism; then no body needs a guess, and all angles count from the drawing:

    >>> coupler = Body("coupler", points={"A": (0.2, 0.0), "B": (0.5, 0.4)})
    >>> rocker = Body("rocker", points={"O4": (0.6, 0.0), "B": (0.5, 0.4)})
    """

    role: ClassVar[str] = "body"

    mass: OptionalNumberField = number_field("mass", None, sign="not negative")
    weight: OptionalNumberField = number_field("weight", None, sign="not negative")
    inertia: NumberField = number_field("inertia", LeftOut(0.0), sign="not negative")
    cg: Converted[Point, PointLike] = default((LeftOut(0.0), LeftOut(0.0)))
    points: Converted[dict[str, Point], Mapping[str, PointLike]] = default_made(dict)
    guess: Converted[Guess, GuessLike] = default(None)
    spread: Literal["point"] | SlenderRod | SecondMoments | None = None
    shapes: Converted[dict[str, Shape], Mapping[str, ShapeLike]] = default_made(dict)
    section: CrossSection | None = None

    def _enter(self) -> None:
        super()._enter()
        name = self.name
        if not isinstance(self.points, Mapping):
            raise ModelError(
                f"'{name}': points must be a dict such as {{\"A\": (x, y)}}, not {self.points!r}",
                name,
            )
        for point in self.points:
            if not isinstance(point, str) or not point or "." in point:
                raise ModelError(
                    f"'{name}': {point!r} is no name of a point: give text without a dot", name
                )
            check_name(point, "point")
            if point in ("cg", "mass", "weight", "inertia", "spread", "section"):
                raise ModelError(
                    f"'{name}': the name of a point may not be '{point}', which is a number of the "
                    "body: choose another",
                    name,
                )
        points = {key: as_point(value, name, key) for key, value in self.points.items()}
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "cg", as_point(self.cg, name, "cg"))
        object.__setattr__(self, "guess", as_guess(self.guess, name))
        object.__setattr__(self, "spread", as_spread(self.spread, name))
        if not isinstance(self.shapes, Mapping) or self.shapes:
            from mbody.model.touching_shapes import as_shapes

            object.__setattr__(self, "shapes", as_shapes(self.shapes, name, points))
        object.__setattr__(self, "section", as_section(self.section, name, points))

    def _check(self) -> None:
        if self.mass is not None and self.weight is not None:
            raise ModelError(f"'{self.name}': give mass or weight, not both", self.name)
        spread = self.spread
        if isinstance(spread, SecondMoments) and (
            min(spread.xx, spread.yy) < 0.0 or spread.xy**2 > spread.xx * spread.yy
        ):
            raise ModelError(
                f"'{self.name}': no mass can be spread like {spread}: xx and yy are not "
                "negative, and xy² is at most xx·yy",
                self.name,
            )

    def at(
        self, point: PointLike | Number, y: Number | None = None, *, angle: Number = 0.0
    ) -> Marker:
        """A marker on this body: ``at("A")``, ``at(x, y)``, ``at((x, y))`` or ``at(polar(...))``.

        Parameters
        ----------
        point : str, pair, Polar or float
            Named point, or coordinates [length] in link axes.
        angle : float
            Direction of the marker's x axis in link axes [rad].
        """
        if isinstance(point, str) and point not in self.points:
            raise ModelError(
                f"body '{self.name}' has no point '{point}' (it has: {listed(self.points)})",
                self.name,
            )
        place = point if y is None else (point, y)
        if not isinstance(place, str):
            place = as_point(place, self.name, "marker")
        return Marker(self.name, place, number(angle, "angle", self.name, "marker angle"))

    def numbers(self) -> dict[str, Any]:
        """Mass or weight, inertia, mass centre, named points and spread by dotted name."""
        result = super().numbers()
        if self.mass is None and self.weight is None:
            result[f"{self.name}.mass"] = 0.0
        result |= point_numbers(self.cg, f"{self.name}.cg")
        for key, point in self.points.items():
            result |= point_numbers(point, f"{self.name}.{key}")
        for key, shape in self.shapes.items():
            from mbody.model.touching_shapes import shape_numbers

            result |= shape_numbers(f"{self.name}.{key}", shape)
        if isinstance(self.spread, (SlenderRod, SecondMoments)):
            result |= {f"{self.name}.spread.{k}": v for k, v in vars(self.spread).items()}
        if self.section is not None:
            sizes = {key: getattr(self.section, key) for key in self.section.sizes}
            result |= {f"{self.name}.section.{key}": size for key, size in sizes.items()}
        return result

    @property
    def massless(self) -> bool:
        """Whether the body has neither mass nor inertia."""
        return not (self.mass or self.weight or self.inertia)
