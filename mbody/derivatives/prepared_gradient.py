"""Measures and their derivatives for many sets of numbers, without assembling anew."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import requested_instants
from mbody.derivatives.driven_instants import DrivenInstants, misfitting
from mbody.derivatives.dual_solution import DualRecord, DualWorkspace, dual_solution
from mbody.derivatives.named_numbers import checked_names, dual_values, recorded_numbers
from mbody.derivatives.reduced_measures import (
    MeasureProgram,
    derived,
    instants_of,
    recorded_measure,
)
from mbody.errors import ModelError
from mbody.solution.solution import Solution
from mbody.sweeps.job import Measures, columns_of
from mbody.system.system import System


class PreparedGradient:
    """Measures of one system by some of its numbers, prepared for many sets of these.

    Parameters
    ----------
    system : System
        Of one design.
    measure, by, analysis
        As of `mbody.gradient`.
    **options
        The instants, as of `mbody.gradient`.

    Attributes
    ----------
    names : tuple of str
        Dotted names of the numbers, in the order of the arrays.
    measures : tuple of str
        Names of the measures.
    start : array (names,)
        The numbers that the system has.
    spaces : list of DualWorkspace
        Workspaces that are free.

    Examples
    --------
    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("norton_fourbar"))
    >>> prepared = PreparedGradient(system, "peak(A.force)", ["crank.A.x"], turn="motor")
    >>> design = prepared.at([5.25])
    >>> float(design.value[0].round(3)), float(design.jacobian[0, 0].round(3))
    (231.228, 325.526)
    """

    def __init__(
        self,
        system: System,
        measure: Measures | None,
        by: Sequence[str] | str | None,
        analysis: str = "kinetostatics",
        **options: Any,
    ) -> None:
        if system.batch is not None:
            raise ModelError("gradient takes one design: choose one of the batch with design(n)")
        self.system = system
        self.given = checked_names(system, by)
        self.names = tuple(self.given.values())
        self.columns = columns_of(system.mechanism, measure, "gradient")
        self.measures = tuple(column.name for column in self.columns)
        self.start = np.array([float(system.values[name]) for name in self.names])
        self.wanted = requested_instants(system, analysis, options, "gradient")
        machine, parameters = system.mechanism, system.mechanism.parameters
        self._recorded = recorded_numbers(system)
        self._signs = {name: system.rule(name)[0] for name in self.names}
        self._programs: list[MeasureProgram | None] | None = None
        self._misfits: set[str] | None = None
        self.spaces: list[DualWorkspace] = []
        # what formulas make of the numbers, and what joints and contacts refuse, is Python
        self._plain = (
            self._recorded is None
            or not self._recorded.has(self.names)
            or any(name in parameters for name in self.names)
            or bool(machine.contacts or machine.groups)
        )

    def at(self, numbers: Any) -> DesignPoint:
        """The design of other numbers, (names,): its measures, and their derivatives when read.

        Raises
        ------
        ModelError
            For numbers that are refused.
        SolveError
            As of the analysis, where the design does not close.
        """
        numbers = np.array(numbers, dtype=np.float64)
        if numbers.shape != self.start.shape:
            raise ModelError(
                f"gradient: {len(self.start)} numbers are needed, not an array of the shape "
                f"{numbers.shape}"
            )
        system, tangents = self._system_of(numbers)
        return DesignPoint(self, numbers, self.wanted.analysed(system), tangents)

    def programs(self, run: Solution, record: DualRecord) -> list[MeasureProgram | None]:
        """Of every measure its operations, recorded once."""
        if self._programs is None:
            self._programs = [
                recorded_measure(run, record, column.measure, self.names) for column in self.columns
            ]
        return self._programs

    def misfits(self, run: Solution, record: DualRecord) -> set[str]:
        """Numbers that alone would move wheels apart; which they are does not change."""
        if self._misfits is None:
            spaced = any(joint.spaced for joint in self.system.mechanism.joints)
            own = dual_values(run.system, self.names) if spaced else {}
            found = misfitting(dual_solution(run, own, record), self.names) if spaced else set()
            self._misfits = found
        return self._misfits

    def _system_of(self, numbers: np.ndarray) -> tuple[System, Any]:
        """The system with these numbers, and derivatives of the kernels' numbers where they came
        with them.
        """
        given = dict(zip(self.names, numbers.tolist(), strict=True))
        recorded = self._recorded
        allowed = all(map(self._allowed, given, given.values()))
        if recorded is None or self._plain or not allowed:
            return self.system.with_values(given), None
        values = {**self.system.values, **given}
        found, slopes = recorded.evaluated(values, self.names)
        rows = len(self.system.par)
        system = replace(
            self.system,
            values=values,
            formulas={n: f for n, f in self.system.formulas.items() if n not in given},
            par=found[:rows, None],
            mass=found[rows:, None],
        )
        return system, (slopes[:rows], slopes[rows:])

    def _allowed(self, name: str, number: float) -> bool:
        """Whether a number is what its field requires; the sentence is that of `with_values`."""
        sign = self._signs[name]
        least = 0.0 if sign else -math.inf
        return math.isfinite(number) and number >= least and not (sign == "positive" and not number)


class DesignPoint:
    """One design of a `PreparedGradient`.

    Attributes
    ----------
    numbers : array (names,)
    run : Solution
        The result of the analysis.
    value : array (measures,), or (measures, instants) of histories
    """

    def __init__(
        self, prepared: PreparedGradient, numbers: np.ndarray, run: Solution, tangents: Any
    ) -> None:
        self.prepared, self.numbers, self.run, self._tangents = prepared, numbers, run, tangents
        self._choices = [instants_of(run, column) for column in prepared.columns]
        self.value = np.array([choice.value for choice in self._choices])

    @functools.cached_property
    def jacobian(self) -> np.ndarray:
        """Derivatives of the measures by the numbers: (measures, names), or (measures, instants,
        names); NaN by numbers with which alone redundant loops do not close.

        Raises
        ------
        ModelError
            For a measure that has no derivatives.
        """
        prepared, choices = self.prepared, self._choices
        instants = DrivenInstants(
            self.run, prepared.names, prepared.wanted.turning, self._tangents, prepared.spaces
        )
        deciding = [one.needed[:1] if one.single else one.needed for one in choices]
        # those of one measure are in order
        needed = deciding[0] if len(deciding) == 1 else np.unique(np.concatenate(deciding))
        record = instants.rows_at(needed, any(one.loads for one in choices))
        programs = prepared.programs(self.run, record)
        rows, whole = [], None
        for column, choice, program in zip(prepared.columns, choices, programs, strict=True):
            if choice.single and program is not None:
                first = choice.needed[0]
                place = 0 if needed[0] == first else int(np.searchsorted(needed, first))
                values = self.run.system.values
                found, row = program.evaluated(record, place, values, prepared.names)
                rows.append(-row if column.by == "peak" and found < 0.0 else row)
                continue
            if whole is None:
                own = dual_values(self.run.system, prepared.names)
                whole = dual_solution(self.run, own, record)
            only = replace(choice, needed=choice.needed[:1]) if choice.single else choice
            rows.append(derived(whole, needed, column, only).row)
        jacobian = np.array(rows)
        gone = instants.unclosed | prepared.misfits(self.run, record)
        without = [n for n, name in enumerate(prepared.names) if name in gone] if gone else []
        if without:
            jacobian[..., without] = np.nan
        return jacobian
