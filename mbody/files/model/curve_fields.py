"""Curves of a model file: tables of one or two variables that formulas call by name."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, Field, StrictBool, create_model

from mbody.errors import ModelError
from mbody.files.model.beside import columns
from mbody.files.model.fields import Strict, entered_in, number
from mbody.laws import Table, Table2
from mbody.laws.table import End, Interpolation, Outside

__all__ = ["curve"]


_FIELDS: dict[str, Any] = {
    "x": (list[number(None)], Field(None, description="places")),
    "y": (
        list[number(None)],
        Field(None, description="values; of two variables the other places"),
    ),
    "z": (list[list[number(None)]], Field(None, description="values, a row for each x")),
    "file": (str, Field(None, description="CSV file beside this one with the columns x and y")),
    "interpolation": (Literal[get_args(Interpolation)], None),
    "outside": (Literal[get_args(Outside)], None),
    "end": (Literal[get_args(End)], None),
    "periodic": (StrictBool, None),
}
CurveIn = create_model(
    "CurveIn",
    __base__=Strict,
    __doc__="A table of one variable, x and y or a file, or of two, x, y and rows z.",
    **_FIELDS,
)


def _made(given: Any, info: Any) -> Table | Table2:
    fields = {name: value for name, value in given if name in given.model_fields_set}
    path = fields.pop("file", None)
    if path is not None:
        if {"x", "y", "z"} & fields.keys():
            raise ModelError("give x and y, or the file that has them, not both")
        read = zip(("x", "y"), columns(path, info.context.folder), strict=True)
        fields |= {key: [entered_in(v, None, info) for v in row] for key, row in read}
    if "x" not in fields or "y" not in fields:
        raise ModelError("needs both x and y, or the file that has them")
    if "z" not in fields:
        return Table(**fields)
    for key in ("end", "periodic"):
        if key in fields:
            raise ModelError(f"has z, of two variables, and {key}, which only one has: leave out")
    return Table2(**fields)


#: A curve of a file.
curve = Annotated[CurveIn, AfterValidator(_made)]
