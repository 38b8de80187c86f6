"""Synthesis of any mechanism: the demand on it, and its designs followed through all points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.analysis.driven.kinetostatics import kinetostatics
from mbody.derivatives.named_numbers import checked_names
from mbody.errors import ModelError, SolveError, brief
from mbody.model.driver import AngleDriver
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named
from mbody.model.study import Instants, Measure
from mbody.quantities.units import NUMBER
from mbody.solution.measures import check_measure
from mbody.synthesis.demands import interval
from mbody.synthesis.design import DesignList
from mbody.synthesis.following import MOTION, Followed
from mbody.synthesis.judging import EXACT, Judge
from mbody.synthesis.linkages import Effort
from mbody.synthesis.model_numbers import NumberedModel
from mbody.synthesis.model_search import Demand, FoundDesign, searched
from mbody.system.assembler import assemble
from mbody.system.system import System

__all__ = ["StudiedModel", "for_model", "model_demand", "model_subject"]


@dataclass(frozen=True, eq=False)
class StudiedModel:
    """A mechanism with its driver and what is measured of it.

    Attributes
    ----------
    system : System
    driver, driven : str
        Its name, and whether it is an "angle" or a "length".
    quantities : tuple of str
        x and y of the point, or the output.
    output : str
        Whether an output is an "angle" or a "length".
    """

    system: System
    driver: str
    driven: str
    quantities: tuple[str, ...]
    output: str


def model_subject(mechanism: Mechanism, of: Any, path: bool) -> StudiedModel:
    """What a demand on a mechanism is about: the path of a point, or an output.

    Raises
    ------
    ModelError
        For a point or an output that the mechanism has not, and more than one driver.
    """
    if not isinstance(of, str) or not of:
        raise ModelError(
            'synthesize: of must name the point of the path, such as "coupler.P", or the output, '
            f'such as "rocker.angle", not {brief(of)}'
        )
    system = assemble(mechanism)
    if len(system.leaders) != 1:
        raise ModelError(
            f"synthesize: '{mechanism.name}' has {len(system.leaders)} drivers: one is needed"
        )
    quantities = (f"{of}.x", f"{of}.y") if path else (of,)
    unit, *_ = (check_measure(mechanism, Measure(one)) for one in quantities)
    kinds = {"rad": "angle", mechanism.units.of("length"): "length"}
    if unit not in kinds:
        raise ModelError(
            f"synthesize: '{of}' is in {unit or 'plain numbers'}: the output of a function is an "
            "angle or a length",
            of,
        )
    driver = system.leaders[0]
    driven = "angle" if isinstance(driver, AngleDriver) else "length"
    return StudiedModel(system, driver.name, driven, quantities, kinds[unit])


def model_demand(
    subject: StudiedModel,
    by: Mapping[str, Any] | None,
    span: Any,
    goals: np.ndarray,
    timing: np.ndarray | None,
    closed: bool,
) -> Demand:
    """A checked demand on a mechanism: goals (quantities, points) at values of the driver.

    Raises
    ------
    ModelError
        For a number that the mechanism has not, bounds in the wrong order, or a range of the
        driver that is missing.
    """
    system, path = subject.system, len(subject.quantities) == 2
    mechanism = system.mechanism
    if not isinstance(by, Mapping) or not by:
        raise ModelError(
            "synthesize: by must say which numbers of the model are sought, between which bounds: "
            'by={"crank.A.x": (low, high)}'
        )
    _refuse_made(system, by)
    names = checked_names(system, list(by), "synthesize")
    limits = {
        number: interval(
            name, by[name], dimension_named(mechanism, number) or NUMBER, mechanism.units
        )
        for name, number in names.items()
    }
    whole = subject.driven == "angle" and span is None
    if path and span is None and not whole:
        raise ModelError(
            f"synthesize: driver '{subject.driver}' makes no turns: give its range, "
            "span=(low, high)"
        )
    first = float(kinematics(system).measure(f"{subject.driver}.value")[0]) if whole else 0.0
    reach = (first, first + 2.0 * math.pi)
    if span is not None:
        reach = interval("span", span, subject.driven, mechanism.units)
    body = subject.quantities[0].partition(".")[0]
    point = tuple(one for one in subject.quantities if path and one in limits)
    return Demand(
        system=system,
        driver=subject.driver,
        quantities=subject.quantities,
        goals=goals,
        timing=timing,
        fixed=not path,
        closed=closed,
        angular=not path and subject.output == "angle",
        span=reach,
        whole=whole,
        by=limits,
        point=point if len(point) == 2 and body != "ground" else (),
        body=body,
    )


def _refuse_made(system: System, by: Mapping[str, Any]) -> None:
    """Refuse a number that a formula makes of others."""
    for name in by:
        formula = system.formulas.get(name)
        if formula is not None:
            used = listed(sorted(system.mechanism.parameters.used_by(formula)))
            raise ModelError(
                f"synthesize: '{name}' is made by the formula '{formula.text}': seek {used}, or "
                f"give '{name}' a number of its own in the model",
                name,
            )


def for_model(demand: Demand, effort: Effort, judge: Judge, count: int) -> DesignList:
    """Designs of a mechanism whose point passes the points, or whose output has the values."""
    numbered = NumberedModel(demand.system.mechanism, list(demand.by))
    found = searched(demand, effort.search, effort.starts, effort.seed)
    exact = demand.goals.shape[1] * (EXACT * judge.size) ** 2
    judge.take([_ModelCandidate(demand, numbered, one) for one in found], count, exact)
    judge.require("design of the mechanism passes all points without defects within the bounds")
    best = judge.best(count, exact)
    notes = [] if demand.angular else judge.far()
    return DesignList(best, effort.search, effort.seed, notes)


@dataclass(frozen=True, eq=False)
class _ModelCandidate:
    """A design of any mechanism, as `Candidate`."""

    demand: Demand
    numbered: NumberedModel
    found: FoundDesign
    zeros = None
    described = ""

    @property
    def row(self) -> np.ndarray:
        return np.array(list(self.found.values.values()))

    @property
    def misses(self) -> np.ndarray:
        return self.found.misses

    def turns(self) -> bool:
        """Whether the driver may turn round, which following it decides."""
        return self.demand.whole

    def follow(self, units: str, full_turn: bool) -> Followed:
        """The mechanism of the file that was made goes through the points, and round."""
        demand, theta = self.demand, self.found.theta
        at = {demand.driver: [float(one) for one in theta]}
        machine = self.numbered.mechanism_with(self.found.values, self.found.guess, Instants(at=at))
        system = assemble(machine)
        steps = np.diff(theta)
        order = bool((steps > 0.0).all() or (steps < 0.0).all())
        if demand.whole:
            order = order and abs(float(steps.sum())) < 2.0 * math.pi + 1e-9
        defects = () if order else ("order: the driver turns back between the points",)
        try:
            run = kinematics(system, drive={demand.driver: theta})
        except SolveError as error:
            stop = str(error).partition(";")[0]
            return Followed(system, theta, False, (f"branch: {stop}",), None, None)
        if doubts := [one.message for one in run.doubts if one.kind == "branch"]:
            defects = (f"branch: {doubts[0]}", *defects)
        motion, stop = self._motion(system, theta)
        if full_turn and stop:
            defects = (f"branch: {stop}", *defects)
        return Followed(system, theta, order, defects, run, motion)

    def _motion(self, system: System, theta: np.ndarray) -> tuple[Any, str]:
        """The whole turn at the rate of the law where the driver turns round, else from the first
        point to the last; and what stopped the turn.
        """
        stop = ""
        if self.demand.whole:
            try:
                first = float(theta[0])
                turn = first + np.linspace(0.0, 2.0 * math.pi, MOTION)
                name = self.demand.driver
                rate = float(kinematics(system).measure(f"{name}.rate")[0])
                return kinetostatics(system, drive={name: (turn, rate)}), ""
            except SolveError as error:
                stop = str(error).partition(";")[0]
        whole = np.linspace(0.0, len(theta) - 1.0, MOTION)
        way = np.interp(whole, np.arange(len(theta)), theta)
        return kinetostatics(system, drive={self.demand.driver: way}), stop

    def measured(self, run: Any) -> np.ndarray:
        off = np.stack([run.measure(q) for q in self.demand.quantities]) - self.demand.goals
        if self.demand.angular:
            off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi
        return np.asarray(np.sqrt(np.square(off).sum(axis=0)))

    def values(self, found: Followed) -> dict[str, float]:
        return dict(self.found.values)

    def transmission(self, found: Followed) -> float:
        return math.nan

    def cognate(self) -> None:
        return None
