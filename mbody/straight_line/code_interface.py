"""What straight-line code and those who call it agree on."""

__all__ = ["COLUMNS", "ENTRY", "FACTORS", "NONE", "STEP", "STRUCTURAL", "WORDS"]

#: Name of the function, as `mbody.core.library.Library.function` looks it up.
ENTRY = "mbody_straight_line_np"
#: Numbers of a step, which all lanes share: path parameter, time; the step and the one before it,
#: whether there are such; the one before for predictions, the way to the third place, and whether
#: two places predict; rate and acceleration of the one driver; the square of the accepted
#: correction.
STEP = (
    "here",
    "time",
    "h",
    "back",
    "seen",
    "seen_twice",
    "back_safe",
    "longer",
    "quintic",
    "rate",
    "acceleration",
    "small",
)
#: The columns of the table of steps: these numbers, and whether three places may predict.
COLUMNS = (*STEP, "three")
#: Arguments of the function, words of eight bytes: numbers of designs and instants; addresses of
#: parameters, masses and first positions, each (rows, designs), of the table of steps (instants,
#: columns), of first numbers of rows, of the rows that are kept, and how many they are; of which
#: groups of outputs are needed, of the output (kept, designs, instants), of the failed designs.
WORDS = (
    "designs",
    "instants",
    "par",
    "mass",
    "q",
    "steps",
    "initial",
    "kept",
    "count",
    "groups",
    "output",
    "failed",
)
#: Workspaces of the two choices of pivots.
FACTORS = ("first factor", "second factor")
#: What first numbers of rows the code relies on, the structure of blocks; others are given to it.
STRUCTURAL = (0.0, 1.0, -1.0)
#: How the builder ends where there is no straight-line code.
NONE = 3
