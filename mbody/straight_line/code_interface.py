"""Interface between straight-line code and its callers."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from mbody.kernels.continuation_lanes import LanePath

#: Name of the function, as `mbody.core.library.Library.function` looks it up.
ENTRY = "mbody_straight_line_np"
#: Numbers of a step, which designs share, while each piece of a motion has its own: path parameter,
#: time; the step and the one before it, whether there are such; the one before for predictions, the
#: way to the third place, and whether two places predict; rate and acceleration of the one driver;
#: the square of the accepted correction.
STEP = (
    "here", "time", "h", "back", "seen", "seen_twice", "back_safe", "longer", "quintic", "rate",
    "acceleration", "small",
)  # fmt: skip
#: The columns of the table of steps: these numbers, and whether three places may predict.
COLUMNS = (*STEP, "three")
#: Arguments of the function of designs, words of eight bytes: numbers of designs and instants;
#: addresses of parameters, masses and first positions, each (rows, designs), of the table of steps
#: (instants, columns), of first numbers of rows, of the rows that are kept, and how many they are;
#: of which groups of outputs are needed, of the output (kept, designs, instants), of the failed
#: designs.
WORDS_OF_DESIGNS = (
    "designs", "instants", "par", "mass", "q", "steps", "initial", "kept", "count", "groups",
    "output", "failed",
)  # fmt: skip
#: Arguments of the function of one motion: numbers of lanes, a multiple of those of the code, and
#: of instants of a lane;
#: addresses of parameters, masses and first positions, each (rows, lanes), of path parameters and
#: times (instants, lanes), of rates and accelerations of the one driver (2·instants, lanes), of the
#: square of the accepted correction, of first numbers of rows; how many numbers of the output a
#: lane has; addresses of the output (rows, lanes, that many) of all instants but the last of each
#: lane, of those last ones (rows, lanes), and of what is found of each lane, as
#: `LanesOutput.found` has it.
WORDS_OF_MOTION = (
    "lanes", "instants", "par", "mass", "q", "s", "t", "given", "small", "initial", "stride",
    "output", "ends", "found",
)  # fmt: skip
#: Workspaces of the two choices of pivots.
FACTORS = ("first factor", "second factor")
#: What first numbers of rows the code relies on, the structure of blocks; others are given to it.
STRUCTURAL = (0.0, 1.0, -1.0)
#: How the builder ends where there is no straight-line code.
NONE = 3


# -- Instants and prescribed driver values of all lanes ----------------------------------------


@dataclass(frozen=True, eq=False)
class LaneInstants:
    """The fields of `LanePath`; kernels take that one, which takes time to make."""

    mode: int
    s: np.ndarray
    t: np.ndarray
    given: np.ndarray
    position_norm: float
    with_forces: bool
    at_rest: bool

    @functools.cached_property
    def path(self) -> LanePath:
        """Instants of the lanes as a bundle for kernels."""
        names = LanePath.fields
        return LanePath(**{name: getattr(self, name) for name in names})
