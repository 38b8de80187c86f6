"""Exact derivatives of measured quantities of an analysis."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.driven.requested_instants import requested_instants, turned_driver
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.equilibria.equilibrium import Equilibrium, equilibrium
from mbody.analysis.position.assembly_analysis import as_system
from mbody.derivatives.difference_check import compared_with_differences, may_jump_unseen
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.gradient_result import EventGradient, Gradient, per
from mbody.derivatives.mode_gradient import mode_gradient
from mbody.derivatives.named_numbers import changed, checked_names, unit_of
from mbody.derivatives.reduced_measures import Derived, derived, instants_of
from mbody.derivatives.released_motion import MotionInstants, motion_instants
from mbody.derivatives.rest_instants import RestInstants
from mbody.derivatives.unfollowed_jumps import with_formulas_of_the_instant
from mbody.errors import ModelError, SolveError, brief
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.solution.doubts import inherited
from mbody.solution.solution import Solution
from mbody.sweeps.columns import MeasuredColumn, Measures, columns_of
from mbody.system.system import System

#: The analysis of motions over time.
MOTION = "simulate"
#: That of rest positions.
REST = "equilibrium"
#: That of small motions about them.
SMALL = "modes"

__all__ = ["gradient", "gradient_at", "gradient_of"]


def gradient(
    model: Mechanism | System,
    measure: Measures | None = None,
    by: Sequence[str] | str | None = None,
    analysis: str = "kinetostatics",
    **options: Any,
) -> Gradient:
    """Exact derivatives of measured quantities by numbers of the description.

    Parameters
    ----------
    model : Mechanism or System
        Of one design.
    measure : str, Measure, list or dict of them
        As of `sweep`: formulas of histories such as ``"A.force"``, or measures of the mechanism by
        name; in ``peak(…)``, ``max(…)``, ``min(…)``, ``rms(…)``, ``mean(…)``, ``integral(…)``,
        ``first(…)``, ``last(…)`` or ``at(…, instant)`` the instants become one number. By default
        the measures of the mechanism.
    by : list of str, optional
        Dotted names of numbers (``"crank.A.x"``, ``"coupler.mass"``, ``"motor.law.speed"``) and
        parameters; by default all that have no formula.
    analysis : str
        "kinetostatics", "kinematics", "statics", "simulate", "equilibrium" or "modes".
    **options
        The instants: ``t``, ``drive``, ``turn``, ``instants``, ``guess`` as of the analysis, or
        ``at``, ``over`` as of `Instants`; by default those of the mechanism itself. Of "simulate"
        its own: ``until``, ``start``, ``rtol``, ``instants``, ``times`` and others; of
        "equilibrium" ``position``, the number of the rest position, 0 by default, ``free``,
        ``starts`` and ``t``, as of "modes". Measures of "modes" are ``frequency(1)``,
        ``natural_frequency(1)``, ``hertz(1)``, ``damping_ratio(1)`` and ``decay_rate(1)`` of a mode
        of that position, slow ones first, ``ratio(1, rod.x, bar.angle)`` and ``phase(…)`` of two
        amplitudes of a mode, and ``stiffness(crank)`` or ``stiffness(crank, arm)`` of what leads
        free motions.

    Returns
    -------
    Gradient
        Values and derivatives by name, with units; notes where there is no derivative.

    Raises
    ------
    ModelError
        For a number that there is not, or that a formula makes of others; for measures of which
        some are histories and others are not; for a batch; for a motion whose
        beginning follows from guesses.
    SolveError
        As of the analysis; where redundant loops do not close with other numbers.

    Notes
    -----
    The equations of the analysis are solved once more in dual numbers, which carry derivatives
    through every operation: no differences are taken, so there is no step to choose. Only users'
    own functions, controllers that take plain floats only and the matrices of small motions are
    differenced, which a note says. A motion
    over time is integrated once more together with the variational equations, at the same rtol; its
    instants are held, and so is what ``start`` says. Where contacts, friction, events and jumps of
    formulas change it the saltation matrix is applied;
    NaN and a note where that has no derivative. A rest position moves by the implicit function
    theorem. Where the description prescribes the beginning,
    ``"start.crank.angle"`` and others are numbers too. The derivative of a greatest value is that
    at its instant (envelope theorem); where two instants share the greatest value a note says so.
    The model length, by which errors are made dimensionless, is held.

    Source: A. Griewank and A. Walther, *Evaluating Derivatives*, SIAM 2008, chapter 3 (forward
    mode), chapter 15 (implicit functions); R. Leine and H. Nijmeijer, *Dynamics and Bifurcations of
    Non-Smooth Mechanical Systems*, 2004, 7 (saltation).

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.gallery.load("norton_fourbar")
    >>> g = mbody.gradient(machine, {"pin": "peak(A.force)"}, ["crank.A.x"], turn="motor")
    >>> round(g.value["pin"], 4), round(g["pin"]["crank.A.x"], 4), g.units["pin"]["crank.A.x"]
    (169.5305, 187.5089, 'lbf/in')
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError("gradient takes one design: choose one of the batch with design(n)")
    if analysis == MOTION:
        return _of_motion(system, measure, by, options)
    if analysis == REST:
        return _of_rest(system, measure, by, options)
    if analysis == SMALL:
        return mode_gradient(_rest(system, options), measure, checked_names(system, by))
    wanted = requested_instants(system, analysis, options, "gradient", [MOTION, REST, SMALL])
    checked_names(system, by)
    columns_of(system.mechanism, measure, "gradient")
    return gradient_at(wanted.analysed(system), measure, by, wanted.turning)


def _of_motion(
    system: System,
    measure: Measures | None,
    by: Sequence[str] | str | None,
    options: Mapping[str, Any],
) -> Gradient:
    """The gradient of a motion over time."""
    given = options.get("start") is not None
    names = checked_names(system, by, starts=not given)
    columns = columns_of(system.mechanism, measure, "gradient")
    for name in ("guess", "rates"):
        if options.get(name) is not None:
            raise ModelError(
                f"gradient: derivatives of a motion with {name} are not there: prescribe the start "
                "in the simulation of the mechanism, or give start, a result"
            )
    system = with_formulas_of_the_instant(system)
    run = simulate(system, **options)
    instants = motion_instants(run, list(names.values()), given)
    found = gradient_of(run, columns, names, instants=instants)
    if not may_jump_unseen(system):
        return found
    return compared_with_differences(
        found,
        system,
        list(names.values()),
        columns,
        lambda other, rtol: simulate(other, **{**options, "rtol": rtol}),
        run.begun[0].request.way.rtol,
    )


def _of_rest(
    system: System,
    measure: Measures | None,
    by: Sequence[str] | str | None,
    options: Mapping[str, Any],
) -> Gradient:
    """The gradient of a rest position."""
    names = checked_names(system, by)
    columns = columns_of(system.mechanism, measure, "gradient")
    rest = _rest(system, options)
    return gradient_of(rest.solution, columns, names, instants=RestInstants(rest, names.values()))


def _rest(system: System, options: Mapping[str, Any]) -> Equilibrium:
    """One rest position, number `position` of them."""
    found = equilibrium(system, **{name: x for name, x in options.items() if name != "position"})
    which = options.get("position", 0)
    if not isinstance(which, int) or not -len(found) <= which < len(found):
        raise ModelError(
            f"gradient: there is no rest position {brief(which)} of '{system.mechanism.name}', "
            f"they are 0 to {len(found) - 1}"
        )
    if len(system.layout.friction_kind):
        raise ModelError(
            f"gradient: '{system.mechanism.name}' rests by friction, at any place of a band: there "
            "is no one position to be differentiated; leave out the friction"
        )
    return found[which]


def gradient_at(
    run: Solution, measure: Measures | None, by: Sequence[str] | str | None, turn: Any = ""
) -> Gradient:
    """The gradient of measures of a result; `turn` as of the analysis, or of `Instants.over`."""
    names = checked_names(run.system, by)
    columns = columns_of(run.mechanism, measure, "gradient")
    return gradient_of(run, columns, names, turned_driver(run.system, turn))


def gradient_of(
    run: Solution,
    columns: Iterable[MeasuredColumn],
    by: Mapping[str, str],
    turning: str = "",
    instants: DrivenInstants | MotionInstants | RestInstants | None = None,
) -> Gradient:
    """Derivatives of the measures `columns` of a result by numbers, as `checked_names` has them;
    `instants`: by default those of a driven motion.
    """
    columns, names = tuple(columns), list(by.values())
    histories = [one.name for one in columns if not one.by and len(run.t) > 1]
    if histories and len(histories) < len(columns):
        reduced = next(one.name for one in columns if one.by)
        raise ModelError(
            f"gradient: '{histories[0]}' is a history of {len(run.t)} instants, '{reduced}' one "
            "number: give each a reduction such as peak(…) or mean(…), or none"
        )
    if instants is None:
        instants = DrivenInstants(run, names, turning)
    choices = [instants_of(run, one) for one in columns]
    needed = np.unique(np.concatenate([choice.needed for choice in choices]))
    whole = instants.at(needed, any(choice.loads for choice in choices))
    found = {
        column.name: derived(whole, needed, column, choice)
        for column, choice in zip(columns, choices, strict=True)
    }
    record: Any = whole.record
    lost = needed[instants.without_derivative(needed, record)]
    found |= {
        column.name: _where_there_is_one(run, column, found[column.name], choice.needed, lost)
        for column, choice in zip(columns, choices, strict=True)
    }
    notes = [note for one in found.values() for note in one.notes]
    notes += _without_rounding(run.system, names, found)
    notes += _differenced(run.system)
    notes += _without(run, by, instants.unclosed, found)
    notes += instants.notes
    units = {name: unit_of(run.mechanism, number) for name, number in by.items()}
    return Gradient(
        value={name: one.value for name, one in found.items()},
        by=tuple(by),
        jacobian=np.array([one.row for one in found.values()]),
        units={
            name: {number: per(one.unit, unit) for number, unit in units.items()}
            for name, one in found.items()
        },
        at={name: one.at for name, one in found.items()},
        measured={name: one.unit for name, one in found.items()},
        events=tuple(
            EventGradient(
                one.name, one.contact, one.t, dict(zip(by, one.row.tolist(), strict=True))
            )
            for one in instants.events
        ),
        **inherited(run, notes=notes),
    )


def _without_rounding(system: System, names: Sequence[str], found: dict[str, Derived]) -> list[str]:
    """Make the row of a measure that none of the numbers changes zero; a note of each."""
    still = [
        name
        for name, one in found.items()
        if not np.isnan(one.row).any()
        and not changed(system, names, np.asarray(one.value), one.row).any()
    ]
    for name in still:
        found[name] = replace(found[name], row=0.0 * found[name].row)
    return [f"none of the numbers changes '{name}': its row is zero" for name in still]


def _differenced(system: System) -> list[str]:
    """A note where users' own functions are differenced."""
    own = dict.fromkeys(name for name, function in system.functions if function is not None)
    if not own:
        return []
    return [
        f"functions of your own, of {listed(own)}, are differenced: derivatives through them have "
        "some 9 figures"
    ]


def _where_there_is_one(
    run: Solution, column: MeasuredColumn, one: Derived, needed: np.ndarray, lost: np.ndarray
) -> Derived:
    """A measure, its derivatives NaN where an instant that it is taken from has none."""
    single = one.at is not None
    gone = np.isin(needed[:1] if single else needed, lost)
    if not gone.any():
        return one
    k = int(needed[int(gone.argmax())])
    history = one.row.ndim == 2
    row = np.where(gone[:, None] if history else gone.any(), np.nan, one.row)
    when = f"{float(run.t[k]):.6g} {run.mechanism.units.time}"
    said = f"'{column.name}' has no derivative at t = {when}: the result has no "
    said += "forces there, or a limit, as at a change point; take other instants"
    return replace(one, row=row, notes=(said,) if single else (*one.notes, said))


def _without(
    run: Solution, by: Mapping[str, str], unclosed: set[str], found: dict[str, Derived]
) -> list[str]:
    """Leave numbers out with which redundant loops do not close; refuse to where all are such."""
    gone = [name for name, number in by.items() if number in unclosed]
    if not gone:
        return []
    sentence = (
        f"'{run.mechanism.name}' closes redundant loops, or has wheels that fit, only with the "
        f"numbers that it has of {listed(gone)}: there is no derivative by one of them alone; vary "
        "those that fit together by a parameter"
    )
    if len(gone) == len(by):
        raise SolveError(sentence, gone[0])
    places = [n for n, name in enumerate(by) if name in gone]
    for name, one in found.items():
        row = one.row.copy()
        row[..., places] = np.nan
        found[name] = replace(one, row=row)
    return [sentence]
