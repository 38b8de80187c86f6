"""Joints of the user's own, written in plain Python."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mbody.model.element import WithOwnPhysics
from mbody.model.joints._base import Joint
from mbody.model.primitives import ConstraintPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class CustomJoint(WithOwnPhysics, Joint):
    """Base for joints of your own: derive a frozen dataclass, set its rows, write its physics.

    The physics has the form of the built-in ones, on numbers. It is called through one hook, so it
    costs microseconds instead of nanoseconds and keeps the analysis on the scalar path.
    `mbody.testing.check_joint` proves it, like the built-in ones; an analysis compares Φ_q, ν and γ
    with differences of Φ where it begins, and refuses what does not fit.

    Numbers of your own are fields made by `number_field`, as of a `CustomLoad`; `physics` must be
    pure, too: its result depends on its arguments and on the element's numbers alone.

    Examples
    --------
    A pin that slides on the x axis of i, a point on a line:

    >>> import mbody
    >>> class OnLine(CustomJoint):
    ...     rows = "l"
    ...     def physics(self, i, j, p, t):
    ...         d, _, _, c, s = j[1] - i[1], *i[2:5], 0.0
    ...         raise NotImplementedError("see the tests for a whole one")
    """

    rows = "l"
    counts_turns = True  # perhaps: what its rows measure is unknown, so its bodies keep their turns

    def physics(self, i: Any, j: Any, p: Any, t: float) -> Any:
        """The rows at one instant.

        Parameters
        ----------
        i, j : tuple
            (x, y, θ, cos θ, sin θ, vx, vy, ω) of each body's mass centre.
        p : array
            What `parameters` gave.
        t : float
            Time.

        Returns
        -------
        phi, blocks, nu, gamma : tuples
            Two, twelve, two and two numbers: Φ, then Φ_q by rows first for i, row by row, then
            for j, then ν and γ. A joint of one row pads with zeros.
        """
        raise NotImplementedError(f"{type(self).__name__} needs a method physics(i, j, p, t)")

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One pair of rows through the hook."""
        parameters, physics = self._hook(at)
        bodies = (self.i.body, self.j.body)
        return [ConstraintPrimitive("user", *bodies, self.rows, parameters, function=physics)]
