"""Cross-sections in model files: { rectangle = [h, b] }, { tube = [D, d] }, { round = d }."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Discriminator, Tag

from mbody.files.model import fields as of
from mbody.model.body import Body
from mbody.model.section import RectangleSection, RoundSection, TubeSection
from mbody.quantities.units import DIMENSIONS

__all__ = ["cross_section", "section_table"]

Length = of.number(DIMENSIONS["length"])


class _BarIn(of.Strict):
    """A section; the bar goes along two points, without them from joint to joint."""

    along: tuple[str, str] | None = None


class RectangleSectionIn(_BarIn):
    """Height in the plane, thickness across it."""

    rectangle: tuple[Length, Length]


class TubeSectionIn(_BarIn):
    """Outer and inner diameter."""

    tube: tuple[Length, Length]


class RoundSectionIn(_BarIn):
    """Diameter."""

    round: Length


cross_section = Annotated[
    Annotated[
        RectangleSectionIn,
        AfterValidator(lambda s: RectangleSection(*s.rectangle, along=s.along or ())),
        Tag("<rectangle>"),
    ]
    | Annotated[
        TubeSectionIn,
        AfterValidator(lambda s: TubeSection(*s.tube, along=s.along or ())),
        Tag("<tube>"),
    ]
    | Annotated[
        RoundSectionIn,
        AfterValidator(lambda s: RoundSection(s.round, along=s.along or ())),
        Tag("<round>"),
    ],
    Discriminator(
        lambda value: next(
            (
                f"<{k}>"
                for k in ("rectangle", "tube", "round")
                if isinstance(value, dict) and k in value
            ),
            None,
        ),
        custom_error_type="form",
        custom_error_message="must be { rectangle = [height, thickness] }, "
        "{ tube = [outer, inner] } or { round = diameter }",
    ),
]


def section_table(writer: Any, body: Body) -> dict[str, Any]:
    """The section of a body as a file has it; `writer` writes numbers."""
    found: Any = body.section
    name = f"{body.name}.section"
    sizes = [
        writer.number(f"{name}.{k}", getattr(found, k), DIMENSIONS["length"]) for k in found.sizes
    ]
    word = {RectangleSection: "rectangle", TubeSection: "tube"}.get(type(found), "round")
    table: dict[str, Any] = {word: sizes[0] if word == "round" else sizes}
    if found.along:
        table["along"] = list(found.along)
    return table
