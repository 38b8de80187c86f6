"""The laws of a model file: a number, a formula, or a table with one kind of law."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    StrictBool,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    create_model,
)

from mbody.errors import ModelError
from mbody.files.model.beside import columns
from mbody.files.model.fields import Strict, entered_in, number, shape
from mbody.files.model.kinds import LAWS
from mbody.laws import SHAPES, Cam, Dwell, Law, Polynomial, Rise, Table
from mbody.laws.base import dimension_by
from mbody.laws.table import End, Interpolation, Outside
from mbody.quantities.units import Dimension, name_of

__all__ = ["law"]


@functools.cache
def law(dimension: Dimension | None, of: Dimension, words: tuple[str, ...] = tuple(LAWS)) -> Any:
    """A law of that dimension, None for any: a number, a formula, or a table with one of these
    kinds of law.
    """
    if not words:
        return number(dimension, of)
    value = Annotated[number(dimension, of), Tag("<value>")]
    table = Annotated[_law_table(dimension, of, words), AfterValidator(_picked), Tag("<table>")]
    return Annotated[
        value | table,
        shape(
            {"<value>": (int, float, str), "<table>": dict},
            "must be a number, a formula or a table with one of " + ", ".join(LAWS),
        ),
    ]


def _picked(given: BaseModel) -> Law:
    """The one law that a table names."""
    found = {name: value for name, value in given if value is not None}
    if len(found) != 1:
        has = f"it has {' and '.join(found)}" if found else "it has none"
        raise ModelError(f"must be one law of {', '.join(LAWS)}; {has}")
    made: Law = next(iter(found.values()))
    return made


@functools.cache
def _law_table(
    dimension: Dimension | None, of: Dimension, words: tuple[str, ...]
) -> type[BaseModel]:
    kinds = {
        word: (
            _law_of_kind(LAWS[word], dimension, of) | None,
            Field(None, description=_first(LAWS[word])),
        )
        for word in words
    }
    title = f"law: {_called(dimension)} of {name_of(of)}"
    made: Any = create_model(
        title, __base__=Strict, __doc__="A table with one kind of law.", **kinds
    )
    made.model_config["json_schema_extra"] = {"minProperties": 1, "maxProperties": 1}
    return made


def _called(dimension: Dimension | None) -> str:
    """The name of a dimension in the title of a table."""
    return "any quantity" if dimension is None else name_of(dimension)


def _by(powers: tuple[int, int, int], value: Dimension | None, of: Dimension) -> Dimension | None:
    """The dimension of a number of a law, None where any is taken."""
    if value is None:
        return None if powers[0] else dimension_by(powers, of, of)
    return dimension_by(powers, value, of)


def _first(cls: type) -> str:
    return (cls.__doc__ or "").split("\n\n")[0].replace("\n    ", " ")


def _law_of_kind(cls: type[Law], dimension: Dimension | None, of: Dimension) -> Any:
    if cls is Polynomial:
        coefficient = _Coefficients(dimension, of)
        return Annotated[
            list[Any],
            AfterValidator(coefficient),
            WithJsonSchema({"type": "array", "items": {"type": ["number", "string"]}}),
        ]
    if cls is Cam:
        return _cam(dimension, of)
    model = _numbers_of(cls, dimension, of)
    if cls is Table:
        return Annotated[model, AfterValidator(_Points(dimension, of))]
    return Annotated[model, AfterValidator(functools.partial(_made, cls))]


def _made(cls: type[Law], given: BaseModel) -> Law:
    return cls(**{name: value for name, value in given if name in given.model_fields_set})


@dataclass(frozen=True)
class _Coefficients:
    """Coefficients in ascending powers, each with a dimension of its own."""

    dimension: Dimension | None
    of: Dimension

    def __call__(self, values: list[Any], info: ValidationInfo) -> Polynomial:
        return Polynomial(
            [
                entered_in(v, self.dimension and self.dimension / self.of**n, info)
                for n, v in enumerate(values)
            ]
        )


CHOICES = {("Rise", "shape"): SHAPES, ("Table", "end"): get_args(End)}
CHOICES[("Table", "outside")] = get_args(Outside)
CHOICES[("Table", "interpolation")] = get_args(Interpolation)


def _numbers_of(cls: type[Law], dimension: Dimension | None, of: Dimension) -> type[BaseModel]:
    """The table of one kind of law, from the fields of its class."""
    found: dict[str, Any] = {}
    for field in dataclasses.fields(cls):
        powers = field.metadata.get("powers")
        default = ... if field.default is dataclasses.MISSING else field.default
        if powers:
            kind = number(_by(powers, dimension, of))
            if cls is Table:
                kind, default = list[kind], []
        elif (cls.__name__, field.name) in CHOICES:
            kind = Literal[tuple(CHOICES[cls.__name__, field.name])]
        else:
            kind = StrictBool
        found[field.name] = (kind, default)
    if cls is Table:
        found["file"] = (str, None)
    title = f"{cls.__name__}: {_called(dimension)} of {name_of(of)}"
    return create_model(title, __base__=Strict, __doc__=_first(cls), **found)


def _cam(dimension: Dimension | None, of: Dimension) -> Any:
    rise = Annotated[
        _numbers_of(Rise, dimension, of), AfterValidator(functools.partial(_made, Rise))
    ]
    segment = create_model(
        f"segment: {_called(dimension)} of {name_of(of)}",
        __base__=Strict,
        __doc__="A part of a cam's program: a rise or a dwell.",
        rise=(rise | None, None),
        dwell=(number(of) | None, None),
    )
    cam = create_model(
        f"Cam: {_called(dimension)} of {name_of(of)}",
        __base__=Strict,
        __doc__=_first(Cam),
        segments=(list[Annotated[segment, AfterValidator(_segment)]], ...),
        period=(number(of), ...),
    )
    return Annotated[cam, AfterValidator(functools.partial(_made, Cam))]


def _segment(given: Any) -> Rise | Dwell:
    if (given.rise is None) == (given.dwell is None):
        raise ModelError("a segment is either { rise = { … } } or { dwell = duration }")
    return Dwell(given.dwell) if given.rise is None else given.rise


@dataclass(frozen=True)
class _Points:
    """A table of points, from the model file or, in the same units, from a file beside it."""

    dimension: Dimension | None
    of: Dimension

    def __call__(self, given: Any, info: ValidationInfo) -> Table:
        fields = {name: value for name, value in given if name in given.model_fields_set}
        path = fields.pop("file", None)
        if path is not None:
            if "x" in fields or "y" in fields:
                raise ModelError("give x and y, or the file that has them, not both")
            read = zip(("x", "y"), columns(path, info.context.folder), strict=True)
            dimensions = {"x": self.of, "y": self.dimension}
            fields |= {k: [entered_in(v, dimensions[k], info) for v in row] for k, row in read}
        if "x" not in fields or "y" not in fields:
            raise ModelError("needs both x and y, or the file that has them")
        return Table(**fields)
