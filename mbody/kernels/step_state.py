"""Where a motion is: the numbers that the steps of all methods carry on, by their places."""

from __future__ import annotations

__all__ = [
    *("TIME", "NEXT", "STEPS", "REJECTED", "CAREFUL", "SLOPES", "MET", "NEAR", "PIVOT"),
    *("STAGE_TRIES", "FREEST", "LONGEST", "END_TRIES", "STIFF", "CALM", "TANGENTS"),
    *("ERROR", "FRESH", "LAST_ONE", "LEAST", "LEAST_AT", "PASSING", "DOUBTED", "ASKING"),
    *("FREED", "LIGHTER", "MEETING", "PROGRESS", "UNLIMITED"),
    *("BRANCH", "DONE", "LAST", "LOST", "MORE", "PASSAGE", "SMALL", "STEEP", "WEAK"),
]

#: Time; length of the next step.
TIME, NEXT = 0, 1
#: Counts: steps done, refused, careful ones; slopes evaluated; instants met.
STEPS, REJECTED, CAREFUL, SLOPES, MET = 2, 3, 4, 5, 6
#: Near a singular position: whether it is now; the weakest pivot, and the greatest that it was;
#: tries so that no stage, and no end, lies at the position; the greatest careful step.
NEAR, PIVOT, STAGE_TRIES, FREEST, LONGEST, END_TRIES = 7, 8, 9, 10, 11, 12
#: Steps held short by stiffness, without and since a step that was not.
STIFF, CALM = 13, 14
#: Implicit methods: tangents formed, error of the last step, whether the tangents serve again.
TANGENTS, ERROR, FRESH = 15, 16, 17
#: Whether the last step, which ends where the motion is to end, may be made.
LAST_ONE = 18
#: The weakest pivot of all samples, and its time.
LEAST, LEAST_AT = 19, 20
#: Steps that begin until PASSING may meet a singular position, which is known; until DOUBTED they
#: are made shorter where they may, and only a step shorter than ASKING asks what is there.
PASSING, DOUBTED, ASKING = 21, 22, 23
#: The part of the kinetic energy that masses have which stand in for none, and above which part the
#: steps pause.
FREED, LIGHTER = 24, 25
#: When the singular position that is known is met.
MEETING = 26
#: How many there are; and those that are infinite where nothing limits them.
PROGRESS = 27
UNLIMITED = (LEAST, PASSING, DOUBTED, LIGHTER, MEETING)

#: What steps end with: all done; there is more to do; the step has vanished; a slope was no
#: number; explicit steps are held short by stiffness; the next step is the last one, if it may be;
#: the next step leads to a singular position, which is for explicit steps; a singular position is
#: near, and what is there decides how it is passed.
DONE, MORE, SMALL, LOST, STEEP, LAST, PASSAGE, BRANCH = range(8)

#: A step is careful where the weakest pivot falls below this part of what it was.
WEAK = 3e-3
