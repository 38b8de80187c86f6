"""Loads of the user's own, written in plain Python."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from mbody.model.element import WithOwnPhysics
from mbody.model.loads._base import BetweenPlaces
from mbody.model.primitives import ForcePrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers


@dataclass(frozen=True)
class CustomLoad(WithOwnPhysics, BetweenPlaces):
    """Base for loads of your own between two places: derive a frozen dataclass, write its physics.

    It is called through one hook, which costs microseconds, and keeps the analysis on the scalar
    path. `mbody.testing.check_load` proves it, like the built-in ones.

    Numbers of your own are fields made by `number_field`: they take text with units, can be changed
    by `with_values` and swept, and ``self.k`` in `physics` is the number in force.

    `physics` must be pure: its answer depends on its arguments and on the element's numbers alone.
    It is called several times an instant, at trial positions, and at times that go back as well as
    on; what it would remember of the call before has no meaning, and a load that remembers is
    refused. Memory (hysteresis, filters) belongs into bodies and joints of the mechanism.

    What acts on both bodies must balance, as action and reaction do; a result is doubted where it
    does not. What acts on the ground may be left out. A load by something outside the mechanism, on
    two bodies that move, says so: ``external = True`` in the class.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two places.

    Examples
    --------
    Air drag at the mass centre of a body; the ground is no body that the air acts on:

    >>> class Drag(CustomLoad):
    ...     def physics(self, i, j, p, t):
    ...         fx, fy = -0.1 * j[5], -0.1 * j[6]
    ...         return 0.0, 0.0, 0.0, fx, fy, 0.0
    >>> Drag("drag", "ground", "ball").bodies
    ('ground', 'ball')

    A coefficient with a unit of its own:

    >>> from dataclasses import dataclass
    >>> from mbody import number_field
    >>> @dataclass(frozen=True)
    ... class Drag(CustomLoad):
    ...     c: NumberField = number_field("damping", 0.1)
    ...     def physics(self, i, j, p, t):
    ...         return 0.0, 0.0, 0.0, -self.c * j[5], -self.c * j[6], 0.0
    >>> Drag("drag", "ground", "ball", c="20 N*s/m").numbers()["drag.i.x"]
    0.0
    """

    acts_on_ground: ClassVar[bool] = False
    #: Whether something outside the mechanism acts on both bodies.
    external: ClassVar[bool] = False

    def physics(self, i: Any, j: Any, p: Any, t: float) -> Any:
        """The load at one instant.

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
        tuple of six
            (Fx, Fy, T) on body i, then on body j, each about its mass centre.
        """
        raise NotImplementedError(f"{type(self).__name__} needs a method physics(i, j, p, t)")

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """One action through the hook."""
        parameters, physics = self._hook(at)
        return [ForcePrimitive("user", self.i.body, self.j.body, parameters, function=physics)]
