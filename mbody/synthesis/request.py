"""Dimensional synthesis: mechanisms for a path, a function, or poses of a body."""

from __future__ import annotations

import csv
import os
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mbody.core.tolerances import TINY
from mbody.errors import ModelError, ModelWarning, brief
from mbody.model.element import listed, whole_number
from mbody.model.mechanism import Mechanism
from mbody.quantities import Formula, FormulaError, Scope, read
from mbody.quantities.formula import Number, evaluated, number
from mbody.quantities.units import UnitSystem, unit_system
from mbody.synthesis import judging
from mbody.synthesis.guidance import motion_size
from mbody.synthesis.linkage_kinds import KINDS, Kind
from mbody.synthesis.linkages import Atlas, Effort, as_atlas, for_function, for_path, for_poses
from mbody.synthesis.models import for_model, model_demand, model_subject

# -- Files of requirements: paths, poses and functions -----------------------------------------

#: Columns of a table, what it is then, and which of them are angles.
TABLE_KINDS = {
    ("x", "y"): "path",
    ("x", "y", "timing"): "path",
    ("x", "y", "angle"): "poses",
    ("input", "output"): "function",
}
ANGLES = ("timing", "angle", "input", "output")
#: A heading with its unit, and a number without one.
HEADING = re.compile(r"\s*(.*?)\s*(?:\[([^\]]*)\])?\s*")
PLAIN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def read_demand(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The arguments of `synthesize` from a table: ``path`` and maybe ``timing``, ``poses``, or
    ``function``.

    The first row names the columns: x and y, maybe timing; x, y and angle; or input and output. A
    table of two columns of numbers is a path. A heading may have the unit of its column, as
    ``x [mm]``, and a cell its own; plain angles are in degrees.
    """
    try:
        text = Path(path).read_text("utf-8-sig")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise ModelError(f"cannot read '{path}' ({reason})") from None
    rows = [[cell.strip() for cell in row] for row in csv.reader(text.splitlines())]
    rows = [row for row in rows if any(row) and not row[0].startswith("#")]
    if not rows:
        raise ModelError(f"'{path}' is empty: give a row for each point")
    heads = [HEADING.fullmatch(cell) for cell in rows[0]]
    names = tuple(head[1].lower() if head else "" for head in heads)
    units = [head[2] or "" if head else "" for head in heads]
    first = 1
    if names in TABLE_KINDS:
        rows, first = rows[1:], 2
    elif len(names) == 2 and _is_number(rows[0][0]):
        names, units = ("x", "y"), ["", ""]
    else:
        raise ModelError(
            f"'{path}': the first row is {brief(', '.join(rows[0]))}: it must name the columns: "
            "x, y; x, y, timing; x, y, angle; or input, output, each maybe with a unit, as x [mm]"
        )
    table = []
    for n, row in enumerate(rows, first):
        if len(row) != len(names):
            raise ModelError(
                f"'{path}': row {n} has {len(row)} cells, the columns are {', '.join(names)}"
            )
        cells = zip(row, names, units, strict=True)
        table.append([_cell(cell, name, unit, n, path) for cell, name, unit in cells])
    what = TABLE_KINDS[names]
    if "timing" in names:
        return {what: [row[:2] for row in table], "timing": [row[2] for row in table]}
    return {what: table}


def _is_number(text: str) -> bool:
    try:
        read(text, None)
    except FormulaError:
        return False
    return any(letter.isdigit() for letter in text)


def _cell(text: str, name: str, unit: str, n: int, path: Any) -> Formula | float:
    if unit and PLAIN.fullmatch(text):
        text = f"{text} {unit}"
    try:
        cell = read(text, None, "deg" if name in ANGLES else "rad")
    except FormulaError as error:
        raise ModelError(f"'{path}': row {n}, {name}: {error}") from None
    if isinstance(cell, Formula) and cell.names:
        raise ModelError(f"'{path}': row {n}, {name}: {brief(text)} is no number")
    return cell


#: Designs that are tried where nobody says how many: with timing, and without; of a model.
TIMED, FREE, SWEPT = 3000, 1000, 1000
#: How many are refined, of a kind and of a model.
STARTS, SWEPT_STARTS = 40, 12


def synthesize(
    model: Mechanism | None = None,
    *,
    kind: str | None = None,
    path: Any = None,
    function: Any = None,
    poses: Any = None,
    timing: Any = None,
    of: str | None = None,
    span: Any = None,
    by: Mapping[str, Any] | None = None,
    count: int = 5,
    units: str | None = None,
    ground: Number | None = None,
    subject_to: str | Iterable[str] = (),
    full_turn: bool = False,
    defective: bool = False,
    tolerance: Number | None = None,
    atlas: Atlas | str | os.PathLike[str] | None = None,
    search: int | None = None,
    starts: int | None = None,
    seed: int = 0,
) -> judging.DesignList:
    """Mechanisms that pass a path, generate a function, or guide a body through poses.

    Parameters
    ----------
    model : Mechanism, optional
        Any mechanism with one driver, of which the numbers in `by` are sought, for a path or a
        function.
    kind : str, optional
        Without a model: "four_bar" (the default) or "slider_crank".
    path : sequence of (x, y)
        Points [length] that P on the coupler, or on the rod, passes one after the other; a path
        whose last point is the first one is closed.
    function : sequence of (input, output)
        Angles of the crank [rad], and the angles of the rocker [rad] or the travel of the slider
        [length]. Three pairs count from the line of the pivots, or the guide; with four the zero of
        the output is found, with five and more both zeros.
    poses : sequence of (x, y, angle)
        Three to five of the coupler's axes [length, length, rad].
    timing : sequence of float, optional
        Angles of the crank at the points of a path, of which the differences count [rad]; without
        it they are found.
    of : str, optional
        Of a model the point of the path, such as ``"coupler.P"``, or the output of the function,
        such as ``"rocker.angle"``.
    span : (low, high), optional
        Of a model the range of its driver that is searched, by default a turn.
    by : mapping, optional
        Bounds (low, high) of numbers by name, equal ones hold a number; of a kind by default some
        sizes of the path.
    count : int
        How many designs are returned at most.
    units : str, optional
        Name of the unit system, by default SI; of a model its own. All numbers may be text with
        units.
    ground : float or str
        Length of the ground of a four-bar that generates a function [length].
    subject_to : str or list of str
        Conditions on the motion, such as ``"min(coupler.P.y) >= 20 mm"``.
    full_turn : bool
        Whether the crank must turn round.
    defective : bool
        Whether designs with defects are kept too.
    tolerance : float or str, optional
        Greatest miss of a point that is accepted, as of `Design.misses`.
    atlas : Atlas or path, optional
        Of a closed path: the shapes that are tried are those of the nearest curves of this atlas.
    search, starts : int
        How many designs are tried for a path, and how many of the best are refined.
    seed : int
        Of the random designs.

    Returns
    -------
    DesignList
        A list of `Design`, the least error first, of equal ones the greatest transmission angle;
        distinct, a cognate is in the `cognates` of the other. All are without defects of order,
        branch and circuit unless `defective`: each was assembled and followed through all points.

    Raises
    ------
    ModelError
        For a demand that is incomplete or contradicts itself, numbers of another dimension, bounds
        of numbers that there are not or in the wrong order.
    SolveError
        Where no design is without defects, within the bounds and conditions; the sentence names
        the nearest one.

    Notes
    -----
    A path: shapes are tried side by side, each with the place, the size, the point and the timing
    that suit it best, which is a linear problem; the best ones are refined by least squares with
    exact derivatives. A function: Freudenstein's equation in closed form, all real solutions, with
    more than five pairs by least squares. Poses: circle and centre points after Burmester, all
    four-bars of five poses, a sample of those of three and four. A model: designs of a Latin
    hypercube by `sweep`, the best of them refined with the derivatives of `gradient`.

    Sources: F. Freudenstein, Trans. ASME 77 (1955) 853-861; J. M. McCarthy and G. S. Soh,
    *Geometric Design of Linkages*, 2011; R. L. Norton, *Design of Machinery*, chapters 3 and 5.

    Examples
    --------
    >>> import mbody
    >>> pairs = [("40 deg", "70 deg"), ("60 deg", "78 deg"), ("90 deg", "95 deg")]
    >>> found = mbody.synthesize(function=pairs, defective=True)
    >>> len(found), found[0].error < 1e-20
    (1, True)
    """
    given = {"path": path, "function": function, "poses": poses}
    demands = [name for name, value in given.items() if value is not None]
    if len(demands) != 1:
        raise ModelError(
            "synthesize: give one of path, function and poses"
            + (f", not {listed(demands)}" if demands else "")
        )
    if timing is not None and path is None:
        raise ModelError("synthesize: timing goes with path: leave it out")
    known = STARTS if model is None else SWEPT_STARTS
    tried = SWEPT if model is not None else FREE if timing is None else TIMED
    request = _Request(
        units=_units(model, units),
        count=whole_number("synthesize: count", count),
        effort=Effort(
            whole_number("synthesize: search", tried if search is None else search),
            whole_number("synthesize: starts", known if starts is None else starts),
            whole_number("synthesize: seed", seed, 0),
        ),
        texts=(subject_to,) if isinstance(subject_to, str) else tuple(subject_to),
        full_turn=bool(full_turn),
        defective=bool(defective),
        tolerance=tolerance,
    )
    with warnings.catch_warnings():
        # of designs that are tried nobody can act on
        warnings.simplefilter("ignore", ModelWarning)
        if model is not None:
            unwanted = {
                "kind": kind,
                "units": units,
                "ground": ground,
                "poses": poses,
                "atlas": atlas,
            }
            if wrong := [name for name, value in unwanted.items() if value is not None]:
                raise ModelError(
                    f"synthesize: {listed(wrong)} does not go with a model: leave it out"
                )
            return _of_model(request, _mechanism(model), of, span, by, path, timing, function)
        if of is not None or span is not None:
            raise ModelError("synthesize: of and span go with a model: leave them out, or give it")
        sort = _kind("four_bar" if kind is None else kind)
        if path is not None:
            points, closed = judging.path_of(path, request.units)
            angles = judging.timing_of(timing, len(points), "angle", request.units)
            judge = request.judge(float(np.abs(points - points.mean()).max()), "length")
            effort, most = request.effort, request.count
            curves = None if atlas is None else as_atlas(atlas)
            return for_path(
                sort, points, closed, angles, by, effort, judge, most, request.units, curves
            )
        if atlas is not None:
            raise ModelError("synthesize: atlas goes with path: leave it out")
        if function is not None:
            if by is not None:
                raise ModelError(
                    "synthesize: by goes with path and poses: the lengths of a function generator "
                    "follow from its pairs, its size from ground"
                )
            return _of_function(request, sort, function, 1.0 if ground is None else ground)
        where, angle = judging.poses_of(poses, request.units)
        judge = request.judge(motion_size(where, angle), "length")
        return for_poses(
            sort, where, angle, by, request.effort, judge, request.count, request.units
        )


@dataclass(frozen=True)
class _Request:
    """Base of all requests."""

    units: UnitSystem
    count: int
    effort: Effort
    texts: tuple[str, ...]
    full_turn: bool
    defective: bool
    tolerance: Any

    def judge(self, size: float, dimension: str) -> judging.Judge:
        """A judge of designs of a motion of that size, whose misses are lengths or angles."""
        accepted = np.inf
        if self.tolerance is not None:
            accepted = _positive("tolerance", self.tolerance, dimension, self.units)
        unit = "rad" if dimension == "angle" else self.units.of("length")
        name = self.units.name
        return judging.Judge(name, size, self.texts, self.full_turn, self.defective, accepted, unit)


def _of_function(
    request: _Request, kind: Kind, function: Any, ground: Number
) -> judging.DesignList:
    output = "angle" if kind.name == "four_bar" else "length"
    inputs, outputs = judging.pairs_of(function, ("angle", output), request.units)
    length = _positive("ground", ground, "length", request.units)
    size = length if output == "angle" else max(float(np.ptp(outputs)), TINY)
    judge = request.judge(size, output)
    return for_function(kind, inputs, outputs, length, request.effort, judge, request.count)


def _of_model(
    request: _Request,
    model: Mechanism,
    of: Any,
    span: Any,
    by: Mapping[str, Any] | None,
    path: Any,
    timing: Any,
    function: Any,
) -> judging.DesignList:
    subject = model_subject(model, of, path is not None)
    if path is not None:
        points, closed = judging.path_of(path, request.units)
        angles = judging.timing_of(timing, len(points), subject.driven, request.units)
        goals = np.stack([points.real, points.imag])
        size, output = float(np.abs(points - points.mean()).max()), "length"
    else:
        output = subject.output
        angles, outputs = judging.pairs_of(function, (subject.driven, output), request.units)
        goals, closed = outputs[None, :], False
        size = 1.0 if output == "angle" else max(float(np.ptp(outputs)), TINY)
    demand = model_demand(subject, by, span, goals, angles, closed)
    return for_model(demand, request.effort, request.judge(size, output), request.count)


def _units(model: Any, units: str | None) -> UnitSystem:
    return _mechanism(model).units if model is not None else unit_system(units or "SI")


def _mechanism(model: Any) -> Mechanism:
    """The model, which must be a mechanism."""
    if not isinstance(model, Mechanism):
        raise ModelError(
            f"synthesize: model must be a Mechanism, not {brief(model)}; load one by mbody.load"
        )
    return model


def _positive(name: str, given: Any, dimension: str, units: UnitSystem) -> float:
    """A positive number of the request."""
    value = number(given, dimension, "synthesize", name)
    found = float(evaluated(value, Scope(units), "synthesize", name))
    if not found > 0.0:
        raise ModelError(f"synthesize: {name} is {found:g}, it must be positive")
    return found


def _kind(name: Any) -> Kind:
    if name not in KINDS:
        raise ModelError(f"synthesize: there is no kind {brief(name)} (there are: {listed(KINDS)})")
    return KINDS[name]
