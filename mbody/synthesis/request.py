"""Dimensional synthesis: mechanisms for a path, a function, or poses of a body."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.quantities import Scope
from mbody.quantities.number import evaluated, number
from mbody.quantities.types import Number
from mbody.quantities.units import UnitSystem, unit_system
from mbody.synthesis.demands import counted, pairs_of, path_of, poses_of, timing_of
from mbody.synthesis.design import DesignList
from mbody.synthesis.judging import Judge
from mbody.synthesis.linkage_kinds import KINDS, Kind
from mbody.synthesis.linkages import Effort, for_function, for_path, for_poses

__all__ = ["synthesize"]

#: Designs that are tried where nobody says how many: with timing, and without.
TIMED, FREE = 3000, 1000


def synthesize(
    *,
    kind: str = "four_bar",
    path: Any = None,
    function: Any = None,
    poses: Any = None,
    timing: Any = None,
    by: Mapping[str, Any] | None = None,
    count: int = 5,
    units: str = "SI",
    ground: Number = 1.0,
    subject_to: str | Iterable[str] = (),
    full_turn: bool = False,
    defective: bool = False,
    tolerance: Number | None = None,
    search: int | None = None,
    starts: int = 40,
    seed: int = 0,
) -> DesignList:
    """Mechanisms that pass a path, generate a function, or guide a body through poses.

    Parameters
    ----------
    kind : str
        "four_bar" or "slider_crank".
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
    by : mapping, optional
        Bounds (low, high) of numbers by name; by default some sizes of the path.
    count : int
        How many designs are returned at most.
    units : str
        Name of the unit system. All numbers may be text with units.
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
    four-bars of five poses, a sample of those of three and four.

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
    whole = unit_system(units)
    sort = _kind(kind)
    given = {"path": path, "function": function, "poses": poses}
    demands = [name for name, value in given.items() if value is not None]
    if len(demands) != 1:
        raise ModelError(
            "synthesize: give one of path, function and poses"
            + (f", not {listed(demands)}" if demands else "")
        )
    count = counted("count", count)
    effort = Effort(
        counted("search", (FREE if timing is None else TIMED) if search is None else search),
        counted("starts", starts),
        counted("seed", seed, 0),
    )
    texts = (subject_to,) if isinstance(subject_to, str) else tuple(subject_to)
    if timing is not None and path is None:
        raise ModelError("synthesize: timing goes with path: leave it out")
    if by is not None and function is not None:
        raise ModelError(
            "synthesize: by goes with path and poses: the lengths of a function generator follow "
            "from its pairs, its size from ground"
        )

    angular = function is not None and sort.name == "four_bar"
    accepted = np.inf
    if tolerance is not None:
        accepted = _positive("tolerance", tolerance, "angle" if angular else "length", whole)

    def judge(size: float) -> Judge:
        unit = "rad" if angular else whole.of("length")
        return Judge(units, size, texts, bool(full_turn), bool(defective), accepted, unit)

    if path is not None:
        points, closed = path_of(path, whole)
        angles = timing_of(timing, len(points), whole)
        size = float(np.abs(points - points.mean()).max())
        return for_path(sort, points, closed, angles, by, effort, judge(size), count, whole)
    if function is not None:
        inputs, outputs = pairs_of(function, "angle" if angular else "length", whole)
        length = _positive("ground", ground, "length", whole)
        size = length if angular else max(float(np.ptp(outputs)), 1e-300)
        return for_function(sort, inputs, outputs, length, effort, judge(size), count)
    where, angle = poses_of(poses, whole)
    size = max(float(np.abs(where - where.mean()).max()), 1e-300)
    return for_poses(sort, where, angle, by, effort, judge(size), count, whole)


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
