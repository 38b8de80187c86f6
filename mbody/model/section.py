"""Cross-sections of links that are bars: rectangle, tube, round."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.quantities import Formula
from mbody.quantities.number import number
from mbody.quantities.types import Converted, NumberField, default, required

__all__ = ["CrossSection", "RectangleSection", "RoundSection", "TubeSection", "as_section"]

#: The two named points between which a bar goes; none where its joints say so.
Along = Converted[tuple[str, ...], Sequence[str]]


@dataclass(frozen=True)
class CrossSection:
    """What all sections have: sizes [length], and the line of the bar."""

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
    """A full circle.

    Parameters
    ----------
    diameter : float or str
        [length]
    along : pair of str, optional
        As of `RectangleSection`.
    """

    sizes: ClassVar[tuple[str, ...]] = ("diameter",)

    diameter: NumberField = required()
    along: Along = default(())

    def properties(self, of: Mapping[str, Any]) -> tuple[Any, Any, Any, Any]:
        """π d²/4, π d⁴/64, d/2, 4/3."""
        d = of["diameter"]
        return np.pi * d**2 / 4.0, np.pi * d**4 / 64.0, d / 2.0, 4.0 / 3.0


@dataclass(frozen=True)
class TubeSection(CrossSection):
    """A hollow circle.

    Parameters
    ----------
    outer, inner : float or str
        Diameters [length].
    along : pair of str, optional
        As of `RectangleSection`.
    """

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
    """A section of the link `name` with checked sizes; its line goes between two of the points.

    Raises
    ------
    ModelError
        For what is no section, sizes that are none, or a line between points that are not there.
    """
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
