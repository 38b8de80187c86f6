"""Curves: tables and other laws that a mechanism has by name, which formulas call as functions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.laws import Law, MeasuredFormula, Table, Table2
from mbody.laws.smooth_contour import Contour, contour_of
from mbody.model.element import listed
from mbody.quantities import FUNCTIONS, VARIABLES, FormulaError, Scope, Valued, evaluate
from mbody.quantities.evaluate import Curve
from mbody.quantities.formula import formulas_in, substituted
from mbody.quantities.units import NUMBER, Dimension

# -- Contours by the names of curves of a mechanism --------------------------------------------


def contour_named(names: Any, curves: Mapping[str, Any], place: str) -> Contour:
    """The contour by the named curves of a mechanism; `place`: the dotted name of its shape.

    Raises ModelError for curves that are not there, or make none.
    """
    body, _, key = place.partition(".")
    named = (names,) if isinstance(names, str) else names
    known = isinstance(named, tuple) and all(isinstance(name, str) for name in named)
    if not known or len(named) != (1 if isinstance(names, str) else 2):
        raise ModelError(
            f"'{body}': {key}.curve is {brief(names)}: name one curve of the mechanism, y of x, or "
            "two, x and y of one number",
            body,
        )
    for name in named:
        if name not in curves:
            raise ModelError(
                f"'{body}': {key} names the curve {brief(name)}, which is not there (there "
                f"are: {listed(curves)}): add it to the curves of the mechanism",
                body,
            )
    return contour_of(named, tuple(curves[name].law for name in named))


@dataclass(frozen=True)
class NamedCurve:
    """One curve.

    `given`: As it was described.
    `law`: With floats for its numbers.
    `takes`: What each number that it takes measures; None where that is not known.
    `gives`: What it gives.
    """

    given: Law
    law: Law
    takes: tuple[Dimension | None, ...]
    gives: Dimension | None

    @cached_property
    def parameters(self) -> list[Any]:
        """Its numbers, as the kernels take them."""
        return list(self.law.parameters(self.law.numbers()))

    def as_value(self) -> Valued:
        """The curve as formulas call it."""
        return Valued(Curve(self.at, self.takes), self.gives)

    def at(self, *at: Any) -> Any:
        """Its values at numbers or arrays; NaN where it has none."""
        found = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in at))
        rows = [np.ascontiguousarray(one).reshape(-1) for one in found]
        law: Any = self.law
        values = law.raw(*rows)[:, 0].reshape(found[0].shape)
        return values if values.shape else float(values)


def as_curves(given: Any, scope: Scope) -> dict[str, NamedCurve]:
    """The curves of a mechanism, checked."""
    if not isinstance(given, Mapping):
        raise ModelError(f'curves must be a dict such as {{"torque": Table(…)}}, not {given!r}')
    return {name: _curve(name, law, scope) for name, law in given.items()}


def _curve(name: Any, law: Any, scope: Scope) -> NamedCurve:
    if not isinstance(name, str) or not name.isidentifier():
        raise ModelError(
            f"{name!r} cannot name a curve: formulas call it, so it has letters, digits and _ "
            "only, and begins with a letter"
        )
    if name in (*FUNCTIONS, *VARIABLES, "pi") or name in scope.names:
        raise ModelError(
            f"'{name}' means something else in formulas: choose another name for the curve", name
        )
    if not isinstance(law, Law) or isinstance(law, MeasuredFormula):
        raise ModelError(
            f"the curve '{name}' must be a Table, a Table2 or another law, not {law!r}", name
        )
    keys = {Table: "xy", Table2: "xyz"}.get(type(law), "")
    rows = [getattr(law, key) for key in keys]
    try:
        measures = [_measured(row, scope) for row in rows] or [None, None]
        made: Any = law
        if isinstance(law, Table):
            made = law.dimensioned(measures[1] or NUMBER, measures[0] or NUMBER)
        if isinstance(law, Table2):
            x, y, z = (dimension or NUMBER for dimension in measures)
            made = law.of_dimensions(z, x, y)
        whole: Law = substituted(made, lambda formula: formula.value(scope))
    except FormulaError as error:
        raise ModelError(f"curve '{name}': {error}", name) from None
    except ModelError as error:
        raise ModelError(f"curve '{name}': {error}", name) from None
    return NamedCurve(law, whole, tuple(measures[:-1]), measures[-1])


def _measured(row: Any, scope: Scope) -> Dimension | None:
    """Dimension of the numbers of a row, by the first of them that has a unit."""
    for _, formula in formulas_in(row):
        found = evaluate(formula.tree, scope).dimension
        if found is not None:
            return found
    return None
