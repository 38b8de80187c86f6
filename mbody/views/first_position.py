"""The position at which a picture shows a model that has not been analysed."""

from __future__ import annotations

from mbody.analysis.driven.kinematics import kinematics
from mbody.analysis.driven.kinetostatics import kinetostatics
from mbody.analysis.driven.requests import analyse_at
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.initial.close_loops import close_loops
from mbody.errors import ModelError, SolveError
from mbody.model.mechanism import Mechanism
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["first_position"]


def first_position(model: Mechanism | System, forces: bool = False) -> Solution:
    """One instant of a model: the first that it asks for, else where its simulation begins, else of
    its drivers at t = 0; without these at its guess.

    Parameters
    ----------
    model : Mechanism or System
    forces : bool
        Whether forces are needed.

    Raises
    ------
    ModelError, SolveError
        As of the analysis.

    Examples
    --------
    >>> import mbody
    >>> ball = mbody.gallery.load("bouncing_ball")
    >>> float(first_position(ball)["ball"].y[0])
    1.03
    """
    mechanism = model.mechanism if isinstance(model, System) else model
    if not isinstance(mechanism, Mechanism):
        raise ModelError(
            f"a picture is of a mechanism or of what an analysis found, not of {model!r}"
        )
    if mechanism.ask is None and mechanism.simulation is not None:
        return simulate(model, times=[0.0])
    if not forces and not mechanism.drivers:
        return close_loops(model)
    verb = "kinetostatics" if forces else "kinematics"
    try:
        if isinstance(model, System):
            return (kinetostatics if forces else kinematics)(model)
        return analyse_at(mechanism, verb)
    except SolveError:
        if forces or mechanism.ask is not None:
            raise
        return close_loops(model)
