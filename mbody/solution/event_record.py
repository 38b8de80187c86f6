"""Events of a motion: what happened, and when."""

from __future__ import annotations

from dataclasses import dataclass, field

from mbody.solution.result import Result

__all__ = ["EventRecord"]


@dataclass(frozen=True, eq=False)
class EventRecord:
    """What has happened along a motion, and when.

    Attributes
    ----------
    name : str
        Of the event or stop; of what happens to a contact the kind.
    t : float
        When.
    state : Solution
        The one instant, of an impact just before it.
    after : Solution or None
        Of an impact, the same instant just after it.
    contact : str
        The contact or rough joint that it happens to: `name` is "impact", "open", "stick", "slip"
        or "rest" then, or what Painlevé's paradox is called: "inconsistent", "indeterminate" and
        "paradox".

    Examples
    --------
    >>> import mbody
    >>> ball = mbody.Mechanism("ball")
    >>> ball.add(mbody.Body("ball", mass=1.0, inertia=0.1, guess=(0.0, 4.905, 0.0)))
    >>> ball.add(mbody.Gravity("gravity", y=-9.81))
    >>> (record,) = mbody.simulate(ball, 2.0, events=[mbody.Event("ball.y", name="down")]).events
    >>> record.name, round(record.t, 9)
    ('down', 1.0)
    """

    name: str
    t: float
    state: Result = field(repr=False)
    after: Result | None = field(default=None, repr=False)
    contact: str = ""
