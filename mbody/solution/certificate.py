"""The certificate of a result: its status, doubts and notes, from the report of its analysis and
from its residuals.

Residuals cost a third of the kinetostatics of a turn. They are computed when `status`, `doubts` or
`notes` is first read, so a user who reads numbers alone does not pay for them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from mbody.kernels.constraints import KINDS
from mbody.kernels.output import PER_PRIMITIVE
from mbody.solution.checks import rounded_places
from mbody.solution.doubts import Doubt, status_of
from mbody.solution.result import Result
from mbody.system.system import System

__all__ = ["Certificate", "Certified", "as_reported", "changed", "residual_doubts"]

Array = np.ndarray
T = TypeVar("T")
R = TypeVar("R", bound=Result)

#: Greatest violation of a constraint, as a part of 1 + the greatest coordinate in model lengths and
#: radians. Over the gallery, some 250 random and near-singular linkages and chains of 300 links at
#: most 2e-15 of it is met, at change points that are interpolated 6e-13.
OPEN = 1e-10
#: Greatest part of forces, and of power, that is left over: of the same at most 1e-12 beside
#: what `ROUNDED` explains.
LEFT = 1e-9
#: Towards a singular position single forces grow as its condition, and so does the rounding of
#: each: of the square of the greatest one, as a part of the loads, at most 6e-16 is met, down to
#: 1e-8 rad from a dead centre.
ROUNDED = 1e-13
#: A mechanism slower than this part of the speed that its forces would give it is at rest: its
#: power is rounding.
STILL = 1e-12


@dataclass(frozen=True)
class Certificate:
    """Status, doubts and notes of a result.

    Attributes
    ----------
    status : str
        "completed", "ended: …", "stopped: …", or "doubtful: …" where there is a doubt.
    doubts : tuple of Doubt
    notes : tuple of str
        Facts, and the messages of the doubts.
    """

    status: str = "completed"
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()


class Certified(Generic[T]):
    """A field of a `Solution` that is read from its certificate; what is assigned to it is the
    report of the analysis.
    """

    def __init__(self, default: T) -> None:
        self.default = default

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, solution: Any, owner: type) -> T:
        if solution is None:  # the default of the field
            return self.default
        fields = solution.__dict__
        if "certificate" not in fields:
            fields["certificate"] = _certificate(solution)
        value: T = getattr(fields["certificate"], self.name)
        return value

    def __set__(self, solution: Any, value: T) -> None:
        solution.__dict__.pop("certificate", None)
        if self.name == "status" and str(value).startswith("doubtful:"):
            return  # follows from the doubts; how it ended is what it was
        solution.__dict__[f"reported_{self.name}"] = value


def as_reported(solution: Result) -> Certificate:
    """What the analysis itself reported of a result, without computing its residuals."""
    fields = solution.__dict__
    status = fields.get("reported_status", "completed")
    return Certificate(status, fields["reported_doubts"], fields["reported_notes"])


def changed(solution: R, **parts: Any) -> R:
    """The solution with other fields, as `dataclasses.replace`, without computing residuals."""
    said = as_reported(solution)
    own = {"status": said.status, "doubts": said.doubts, "notes": said.notes}
    replaced: R = replace(solution, **(own | parts))  # type: ignore[type-var]  # a dataclass
    return replaced


def _certificate(solution: Result) -> Certificate:
    """The report of the analysis, and what the residuals add to it."""
    said = as_reported(solution)
    doubts = said.doubts
    if not any(doubt.kind == "residual" for doubt in doubts):
        doubts = (*doubts, *residual_doubts(solution))
    added = [doubt.message for doubt in doubts if doubt.message not in said.notes]
    return Certificate(status_of(said.status, doubts), doubts, (*said.notes, *added))


def residual_doubts(solution: Result) -> list[Doubt]:
    """A doubt for each sort of residual that rounding and condition do not explain, of a batch for
    each design; what is no number is in doubt.
    """
    parts = solution.residuals
    if not parts.size:
        return []
    doubts = []
    for design in range(len(parts)):
        which = f"design {design}: " if solution.record.batch else ""
        for what, size, limit in _limits(solution, parts[design], design):
            wrong = np.flatnonzero(~(size <= limit))
            if wrong.size:
                doubts.append(_doubt(solution, which, what, size, wrong))
    return doubts


def _limits(
    solution: Result, parts: Array, design: int
) -> Iterator[tuple[str, Array, Array | float]]:
    """Residuals (instants,) in words, and what rounding and condition explain of each."""
    system = solution.system
    constraint, left, term, power, flow = parts.T
    n = system.coordinates
    pages = solution.record.table(slice(None))
    pages = pages[design] if solution.record.batch else pages
    reach = 1.0 + system.extent(pages)
    known = np.isfinite(pages[:, : 3 * n]).all(axis=1)
    constraint = np.where(known, constraint, np.nan)
    yield "the constraints are violated by {} (model lengths, rad)", constraint, OPEN * reach
    if not solution.has_forces:
        return
    top, flowing = (float(np.nanmax(np.abs(whole), initial=0.0)) for whole in (term, flow))
    known &= np.isfinite(pages).all(axis=1)
    # forces that are reported as missing are in no balance
    reported = any(doubt.kind == "incomplete" for doubt in as_reported(solution).doubts)
    unknown = 0.0 if reported else np.nan
    part = np.where(known, left / (top or 1.0), unknown)
    carried = np.where(known, _carried(system, pages) / (top or 1.0), 0.0)
    limit = LEFT + ROUNDED * carried**2
    if (part > limit).any():
        # at rest on springs of their free lengths all forces are rounding of places
        limit = np.maximum(limit, rounded_places(solution, design) / (top or 1.0))
    yield "{} of the forces are out of balance", part, limit
    # a joint of the user that moves by itself gives power of which nothing is known
    own = (system.layout.primitive_kind == KINDS.index("user")).any()
    if not own and flowing > STILL * top * system.length * _pace(system, top):
        share = np.where(known, np.abs(power) / (flowing or 1.0), unknown)
        yield "{} of the power is out of balance", share, LEFT


def _pace(system: System, top: float) -> float:
    """How fast forces of that size would set the masses going [1/time]; none without masses."""
    whole = float(system.mass[: system.coordinates : 3].sum(axis=0).max(initial=0.0))
    return float(np.sqrt(top / (whole * system.length))) if whole else 0.0


def _carried(system: System, pages: Array) -> Any:
    """The greatest force of a joint or driver at every instant, torques by the model length."""
    primitives = pages[:, 3 * system.coordinates :][:, : PER_PRIMITIVE * len(system.owners)]
    forces = np.abs(primitives.reshape(len(pages), -1, PER_PRIMITIVE)[:, :, 2:])
    forces[:, :, 2] /= system.length
    return forces.reshape(len(pages), -1).max(axis=1, initial=0.0)


def _doubt(solution: Result, which: str, what: str, size: Array, wrong: Array) -> Doubt:
    """The doubt of one residual from its first instant on."""
    t, unit = float(solution.t[wrong[0]]), solution.mechanism.units.time
    bad = size[wrong]
    worst = f"{bad.max():.2g}" if np.isfinite(bad).all() else "an unknown part"
    many = f"at {len(wrong)} of {len(size)} instants, first " if len(size) > 1 else ""
    return Doubt(
        "residual",
        f"{which}{what.format(worst)} {many}at t = {t:.6g} {unit}, more than rounding explains: do "
        "not rely on the numbers there; check what is near a singular position, and the elements "
        "written in Python",
        t,
    )
