"""State of the steps of a motion: the slots that all integrators carry on, and their bundles.

A motion is y = (q, v, z), z a user's auxiliary states, with ẏ = (v, a, ż); K has a derivative of y
a row, P the powers that belong to it. `Stepping` is the memory of one motion, `Tolerances` says how
exact its steps are, `Outputs` what is kept of it.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Rows, Stacks

#: Time; length of the next step.
TIME, NEXT = 0, 1
#: Counts: steps accepted, steps rejected, steps near a singular position, evaluations of the state
#: derivative, output instants delivered.
STEPS, REJECTED, NEAR_SINGULAR_STEPS, EVALUATIONS, DELIVERED = 2, 3, 4, 5, 6
#: Near a singular position: whether the motion is; the conditioning of the constraints now, and the
#: best that it was; how often a step was tried again so that no stage, and no end, lies at the
#: position; the longest step there.
NEAR_SINGULAR, CONDITIONING, STAGE_TRIES, BEST_CONDITIONING, LONGEST_STEP, END_TRIES = range(7, 13)
#: Steps that stiffness limits, and steps in a row that it does not.
STIFF_COUNT, SMOOTH_COUNT = 13, 14
#: Implicit methods: Jacobians formed, error of the last step, whether the Jacobian is still valid.
JACOBIANS, LAST_ERROR, JACOBIAN_VALID = 15, 16, 17
#: Whether the last step, which ends where the motion is to end, may be made.
LAST_STEP_ALLOWED = 18
#: The least conditioning of all samples, and its time.
LEAST_CONDITIONING, LEAST_AT = 19, 20
#: Steps that begin before KNOWN_UNTIL may meet a singular position, which is known; those that
#: begin before SHORTENED_UNTIL are shortened where they may, and only a step shorter than
#: DECIDE_BELOW returns BRANCH_UNCERTAIN.
KNOWN_UNTIL, SHORTENED_UNTIL, DECIDE_BELOW = 21, 22, 23
#: Kinetic energy of the masses that replace missing ones, as a part of the whole; above which
#: part the integrator returns.
ARTIFICIAL_ENERGY, ARTIFICIAL_LIMIT = 24, 25
#: When the singular position that is known is met.
CROSSING_TIME = 26
#: Instants within steps that stability limits, which got steps of their own
#: (`mbody.kernels.runge_kutta`).
LIMITED_INSTANTS = 27
#: The fastest rate |λ| of the last steps.
FASTEST = 28
#: Work that loads, drivers and friction gave or took in all steps, without signs.
THROUGHPUT = 29
#: Of a step that was tried and is good, but not accepted yet: its length and end, by how much the
#: next one may be longer, the conditioning at its end, the least within it, and the time of that.
TRIED_LENGTH, TRIED_END, TRIED_GROWTH, TRIED_CONDITIONING, TRIED_LEAST, TRIED_LEAST_AT = range(
    30, 36
)
#: How many slots there are; and those that are infinite where nothing limits them.
PROGRESS = 36
UNLIMITED = (LEAST_CONDITIONING, KNOWN_UNTIL, SHORTENED_UNTIL, ARTIFICIAL_LIMIT, CROSSING_TIME)

#: What an integrator returns: the end is reached; there is more to do; the step has vanished; a
#: derivative is not finite; stiffness limits explicit steps; the next step is the last one, if it
#: may be; the next step leads to a singular position, which is for explicit steps; a singular
#: position is near, and what is there decides how it is passed. Within the kernel alone: a step was
#: tried and is good.
(
    DONE,
    MORE,
    STEP_VANISHED,
    NOT_FINITE,
    STIFF,
    LAST_STEP,
    SINGULAR_AHEAD,
    BRANCH_UNCERTAIN,
    TRIED,
) = range(9)
#: The next step meets a zero that is not located; a step ends at a zero; an event is met.
NOT_QUIET, ZERO, CROSSED = 9, 10, 30


class Stepping(Bundle):
    """Memory of the steps of one motion.

    `regularization`: Of redundant rows (see `mbody.kernels.schur_ldl`).
    `scale` (2·coordinates,): Size of each coordinate, to which absolute errors are relative.
    `y`, `last`, `stage`, `end` (2·coordinates,): The state; that before the step; that of a stage;
      that at the end of a step not yet accepted.
    `error` (2, 2·coordinates): Error estimates, and workspace.
    `K`, `P` (rows, 2·coordinates) (rows, causes): Derivatives of the state and powers; row 0
      belongs to y.
    `F`, `G` (terms, 2·coordinates) (terms, causes): Polynomials of state and work over a step (see
      `mbody.kernels.runge_kutta`).
    `state` (PROGRESS,): The slots above.
    """

    regularization: float
    scale: Floats
    y: Floats
    last: Floats
    stage: Floats
    end: Floats
    error: Rows
    K: Rows
    P: Rows
    F: Rows
    G: Rows
    state: Floats


class Tolerances(Bundle):
    """How exact steps are.

    `relative`, `absolute`: Error of a step, as a part of each coordinate and of its size.
    `refinements`, `full_refinements`: Corrections by the residual in ordinary steps, and near
      singular positions and at instants that are kept.
    `patience`: Steps that stiffness may cost.
    """

    relative: float
    absolute: float
    refinements: int
    full_refinements: int
    patience: int


class Outputs(Bundle):
    """Records kept of a motion.

    `times` (instants,): Output instants, ascending.
    `pages` (instants, rows, 1): What is kept of each (see `mbody.kernels.layout`).
    `work` (instants + 1, causes): Work done until each instant; the last row until now.
    """

    times: Floats
    pages: Stacks
    work: Rows
