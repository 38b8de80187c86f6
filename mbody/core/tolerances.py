"""Numbers that decide: what counts as zero, as the same, as closed, as converged.

Pure numbers unless a comment says otherwise: parts of what is named beside them, or in units of the
model's own length, of a radian, of its rates. Each has one name that says of what and for what.
"""

from __future__ import annotations

# -- Numbers ---------------------------------------------------------------------------------------
#: Keeps a quotient finite whose divisor may be zero: smaller than any size that is met.
TINY = 1e-300
FINITE = 1e300  # Beyond this a number counts as not finite, or as no bound.
MACHINE_EPSILON = 2.0**-52  # Distance from 1 to the next float.
LAW_EPSILON = 2.3e-16  # The same for users' functions, a little more.
RADAU_EPSILON = 2.2e-16  # The same for Newton's iteration of Radau's steps, a little less.
COMPLEX_STEP = 1e-30  # Imaginary part of a complex step: its square vanishes.
ROOT_REAL = 1e-6  # Imaginary part below which a root counts as real; relative, or in a pure number.
ROOT_REAL_FINE = 1e-9  # The same where roots of polynomials of low degree are exact to rounding.
ROOT_REAL_FUNCTION_POINTS = 1e-7  # The same of the equations of function generation.
#: Angle [rad], or its sine, below which two directions are one and an edge goes straight on.
DIRECTION_SAME = 1e-9

# -- Positions and lengths, in model lengths and radians -------------------------------------------
POSITION_SAME = 1e-6  # Positions nearer to each other than this are one.
#: The same where a position is a double root, found to half the digits, or where a walk closes.
POSITION_SAME_LOOSE = 1e-5
#: The same of a walk that comes back to its beginning, and of zeros in cells of a chart.
POSITION_SAME_FINE = 1e-7
POSITION_SAME_WALK = 1e-4  # The same of a rest position that a walk meets beside one found already.
#: Points of one position nearer than this, in model lengths or of their size, are one; angles too.
POINT_SAME = 1e-9
#: A length so many times the next one below it is no length of the part, but a far point of it.
LENGTH_FAR = 1e4
LENGTH_NONE = 1e-12  # A length below this part of the model length is none, and printed as zero.
DISTANCE_TIE = 1e-12  # Distances that differ by less than this part are equally near.
#: Places are rounded by this part of 1 + the greatest coordinate: Newton's last step leaves it.
POSITION_ROUNDING = 1e-14
#: How far away a position beside another one lies, where loads or branches are compared.
POSITION_BESIDE = 0.02
#: How far beside a first position loads are measured as well, at which they may all vanish.
WEIGHTS_BESIDE = 0.1
#: A first position with gaps of more lengths is drawn together before anything turns.
GUESS_FAR = 10.0
GUESS_NEAR = 0.2  # A body that closing turns by less [rad] is where the guess meant it to be.
#: Bodies are as near to their guess in another position where they are off by less than so many
#: times as much.
GUESS_NEAR_TIMES = 3.0
GUESS_NEAR_OTHER = 0.3  # The same, in radians.
GUESS_WORTH_NOTE = 0.1  # A body without a guess that is elsewhere by more [rad] is worth a note.
#: A motion that fails where a distance is below this part of the model length fails because of it.
DISTANCE_SMALL = 1e-3
#: A motion that goes on where a distance is below this part has lost its way there.
DISTANCE_LOST = 1e-7
#: A distance that other joints hold may be wrong by so much, in model lengths.
DISTANCE_MISFIT = 1e-6
#: A spring this near to half a turn from its free angle is as much on either side [rad].
SPRING_HALF_TURN = 1e-6
#: Part of a turn within which a value is where its law begins, not a turn later.
LAW_TURN_ROUNDING = 1e-12

# -- Closing of loops, in model lengths and radians ------------------------------------------------
#: A violation of the constraints, or the correction that follows from it, below this is rounding.
LOOP_CLOSURE_RESIDUAL = 1e-13
LOOP_CLOSURE_RESIDUAL_STALLED = 1e-10  # The same where corrections no longer shrink.
#: A correction along a curve, of a position, towards a change point or on a bench that is rounding.
LOOP_CLOSURE_CORRECTION = 1e-12
#: Corrections of a first instant, a dead centre and a position beside another end with this.
LOOP_CLOSURE_FIRST_INSTANT = 1e-14
#: Accepted correction of a driven path, as a part of the greatest coordinate: what velocities and
#: forces are off by, times their condition.
LOOP_CLOSURE_PATH = 1e-14
LOOP_CLOSURE_PATH_STALLED = 1e-9  # The same where corrections no longer shrink.
LOOP_CLOSURE_LANES = 1e-13  # The same of a driven path on lanes.
#: A later Newton step of a stage of this size leaves what is of second order, so rounding.
LOOP_CLOSURE_STAGE_NEXT = 1e-7
LOOP_CLOSURE_STAGE_FIRST = 1e-9  # The same of the first one, whose size is the error of the stage.
#: A search for a closed position ends where a step gains less than this part; its least damping.
LOOP_CLOSURE_DESCENT = 1e-14
LOOP_CLOSURE_DAMPING_START = 1e-4  # The least damping with which such a search begins.
LOOP_CLOSURE_DAMPING_LOST = 1e12  # A damping, or a step, above this has lost its way.
#: A correction of a stage above this, in model lengths and radians, has lost its way.
LOOP_CLOSURE_STAGE_LOST = 1e6
#: Corrections below this part of the acceleration are rounding, in steps of one length.
LOOP_CLOSURE_ACCELERATION = 1e-14
LOOP_CLOSURE_ACCELERATION_STALLED = 1e-10  # The same where they no longer shrink.
LOOP_CLOSURE_ACCELERATION_STILL = 2e-16  # Corrections that move less than this are rounding.
LOOP_CLOSURE_RATTLE = 2e-16  # A correction of RATTLE below this is rounding.
LOOP_CLOSURE_RATTLE_STALLED = 1e-13  # The same where corrections no longer shrink.
LOOP_CLOSURE_ORACLE = 1e-15  # Newton's step with which the dense oracle ends.
LOOP_OPEN = 1e-8  # A row violated by more is open.
LOOP_OPEN_SEARCH = 1e-9  # The same of a position that a search of boxes finds.
#: Greatest violation of a constraint in a result, at a first instant and at a position beside
#: another, as a part of 1 + the greatest coordinate. Over the gallery and 250 near-singular
#: linkages 2e-15 is met, at interpolated change points 6e-13.
LOOP_OPEN_CHECK = 1e-10
#: Rows that nothing can move are closed within this; a loop that is open by more belongs to another
#: mechanism.
LOOP_OPEN_FIXED = 1e-6
#: The dense oracle's loops are open above this part of 1 + the greatest coordinate.
LOOP_OPEN_ORACLE = 1e-11
LOOP_GAP_ROUNDING = 1e-14  # A gap below this is rounding of joints that fit.
LOOP_GAP_SLIGHT = 1e-3  # A gap below this may be an error of lengths that should agree.
#: Changes of a start below this are rounding of numbers with all their digits.
START_CHANGE_ROUNDING = 1e-9
#: Changes of a start below this, and of rates as a part of the fastest, are not reported: six
#: digits.
START_CHANGE_REPORTED = 1e-5
#: Places of a start may be changed by so much: a start with four digits.
START_CHANGE_ALLOWED = 1e-3
START_MOTION_ROUNDING = 1e-12  # Rates that move less than this over the whole motion are rounding.
#: What is prescribed of the first instant is met to this part of its size.
START_CONDITION_MET = 1e-7
REDUNDANT_ROW_SOFTNESS = 1e-9  # Proximal term of redundant rows, in dimensionless units.
#: A stage that moves coordinates by more, or turns a body by more, may have gone to another branch.
BRANCH_LEAP = 0.5
#: A stage may miss where the last one led by this part of its way and of the last one's.
STAGE_BENT = 0.5
STAGE_STRAIGHT = 1e-3  # A way shorter than this is straight.
STAGE_LEAST = 2.0**-12  # The least stage, as a part of the way.
WAY_STEP_SMALLEST = 2.0**-10  # The least part of a way that is tried in one step.
WAY_STEP_SMALL = 2.0**-2  # The same where no smaller step came on, either.
#: Steps by which a position goes to a prescribed one, so that it stays on its branch.
POSITION_PRESCRIBED_STEP = 0.2
#: The dense oracle's closing ends below this where steps no longer shrink.
LOOP_CLOSURE_ORACLE_STALLED = 1e-12
LOOP_GAP_ENDS = 1e-12  # The same as LEAST_SQUARES_ENDS of the smallest gap of a loop.
LOOP_GAPS_TIE = 1e-6  # Joints whose gaps differ by less than this part are equally open.
#: Values of a driver, in model lengths and radians, as a part of 1 + the greatest, that differ from
#: its law by more are other positions.
LOOP_DRIVER_OTHER_POSITION = 1e-9

# -- Rank: singular values, pivots, dependent rows; parts of the greatest, or of the diagonal ------
#: A singular value below this part of the greatest is zero, where positions are closed to rounding,
#: at a change point that is sought too.
SINGULAR_VALUE_ZERO = 1e-9
#: The same at a dead centre, a double root that closes to half the digits.
SINGULAR_VALUE_DEAD_CENTRE = 1e-7
SINGULAR_VALUE_NEAR_SINGULAR = 1e-6  # The same near a singular position, where branches meet.
#: Least singular value of the joints at the last place before a turning point.
SINGULAR_VALUE_REGULAR = 5e-4
#: Rows are dependent but for this part where lengths should agree and do not quite.
SINGULAR_VALUE_SLIGHT = 0.003
#: A singular value below this part of the greatest belongs to a singular position nearby.
SINGULAR_VALUE_NEARBY = 0.02
#: Rows with a singular value below this part depend on others at a first instant.
SINGULAR_VALUE_DEPENDS = 0.05
SINGULAR_VALUE_MAY_VANISH = 0.3  # Singular values of rows that may become dependent.
SINGULAR_VALUE_VANISHES = 1e-10  # What vanishes at a singular position, within rounding.
#: Rows below this part are called dependent in a diagnosis; steps vanish much nearer to that.
SINGULAR_VALUE_DIAGNOSIS = 1e-3
#: A singular value of a preconditioner of boxes that counts as none.
SINGULAR_VALUE_PRECONDITIONER = 1e-8
SINGULAR_VALUE_BOX_ROOT = 1e-10  # The same at a root that a search of boxes finds.
#: Singular values, and parts of a combination, of shared friction that are zero.
SINGULAR_VALUE_SHARED_FRICTION = 1e-8
SINGULAR_VALUE_PARALLEL = 1e-7  # Least singular value of directions that are not parallel.
#: A singular value below this part of the greatest is left out of a solution of least norm.
LEAST_SQUARES_RANK = 1e-10
LEAST_SQUARES_RANK_FINE = 1e-12  # The same of matrices that are known to rounding.
LEAST_SQUARES_RANK_ORACLE = 1e-13  # The same of the dense oracle's constraints.
#: The same of a search for rest, where a nearly neutral step is wanted.
LEAST_SQUARES_RANK_SEARCH = 1e-14
LEAST_SQUARES_RANK_COARSE = 1e-6  # The same beside places where the rank falls.
#: The same of joints that are closed again at a random position nearby.
LEAST_SQUARES_RANK_NEARBY = 1e-4
#: Part of the sum of squares that the last step of a search for the least one promises: rounding.
LEAST_SQUARES_ENDS = 1e-15
LEAST_SQUARES_DAMPING_FIRST = 1e-4  # Damping of its first step,
LEAST_SQUARES_DAMPING_LEAST = 1e-12  # and the least.
LEAST_SQUARES_BEND_STEP = 0.1  # Part of a step over which its second order is a difference.
LEAST_SQUARES_FALLS = 1e-4  # Part of what is foreseen by which a step must make the sum less.
ROWS_DEPENDENT = 1e-9  # Rows that depend on others by less than this part are dependent.
ROWS_SAME = 1e-9  # Rows that differ by less are the same.
#: A row or a body takes part in a dependency or a motion with this part of the greatest.
PARTICIPATION = 0.1
PARTICIPATION_CLOSED = 0.3  # The same of a dependency whose gap is measured.
PARTICIPATION_ELEMENT = 0.05  # The same of an element's share of what rows have in common.
#: A coordinate is independent in a free motion where it has at least this part of the fastest one.
PARTICIPATION_INDEPENDENT = 0.01
PARTICIPATION_NONE = 1e-6  # A part of a dependency below which a row has none in it.
PARTICIPATION_NONE_DIAGNOSIS = 1e-7  # The same in a diagnosis.
#: A pivot below this part of its diagonal is rounding of a row that depends on others.
PIVOT_VANISHED = 1e-15
#: A pivot of the matrix of algebraic loops below this part of what it was summed of is none.
ALGEBRAIC_LOOP_SINGULAR = 1e-12
PIVOT_SUSPICIOUS = 1e-10  # A pivot below this part of its diagonal calls for a look at the rank.
#: A pivot below this part of its diagonal is that of a singular position: few digits are left.
PIVOT_SINGULAR = 1e-6
#: The least pivot below which a place may be singular, or too near to one for rates to be exact.
PIVOT_SUSPECT = 1e-3
PIVOT_REGULAR = 1e-4  # The least pivot above which rows are far from depending on each other.
PIVOT_CLEAR = 100.0  # A least pivot below so many times what counts as zero is reported.
PIVOT_THRESHOLD = 0.1  # A pivot is preferred while it is at least this part of the greatest number.
PIVOT_NONE = 1e-12  # A number of a square matrix below this part of the greatest is none.
PIVOT_GROWTH_EVEN = 30.0  # Growth (sum of squares of L) below which one choice of pivots is enough.
#: Sum of squares of the multipliers above which the other choice of pivots is tried.
PIVOT_GROWTH_LARGE = 100.0
#: The same above which fixed pivots are no longer good: at 1e6 accelerations lost five digits
#: (1e-11 of the peak), at 1e4 they keep 1e-14.
PIVOT_GROWTH_LOST = 1e4
PIVOT_REDUNDANT = 1e4  # A pivot of a redundant row is its regularization, times less than this.
DETERMINANT_ZERO = 1e-9  # A determinant below this share of its terms counts as zero.
MATRIX_SYMMETRIC = 1e-9  # A matrix counts as symmetric, or as none, below this part of its size.
#: The same of a stiffness by differences; an eigenvalue of it counts as real.
STIFFNESS_SYMMETRIC = 1e-6
#: Inertia below this part of the greatest is rounding, as of a crank at its dead centre.
INERTIA_NONE = 1e-12
#: Part of what a body is joined to that replaces a missing mass or inertia in free motions;
#: solutions are refined where masses are smaller.
ARTIFICIAL_MASS = 1e-7
#: Part of both of what it joins below which a body's own mass is not told from none.
MASS_LOST = 1e-12
#: Where masses that replace missing ones have this part of the kinetic energy, the motion depends
#: on them.
ARTIFICIAL_MASS_ENERGY = 1e-3
#: A motion has no inertia where this part of it is of what replaces missing masses.
ARTIFICIAL_MASS_MOTION = 0.1
#: Inertia is looked at again where the energy of masses that replace missing ones has so grown.
ARTIFICIAL_MASS_GROWTH = 10.0
#: A path is near a singular position where the least singular value is below this part.
SINGULAR_VALUE_PATH = 1e-3
FACTOR_CANCELS = 1e-9  # Factors of a sum that cancel to this part of their sizes are none.

# -- Branches and singular positions ---------------------------------------------------------------
#: Branches are equally good where their constraint differs by less than this part.
BRANCH_TIE = 1e-6
#: A step of this part of the whole motion that may still meet a branch is made in doubt.
BRANCH_STEP_HOPELESS = 1e-9
BRANCH_STEP_LONGER = 1e-9  # A step over a change point is longer by this part, for rounding.
#: A step over a change point may be so many times the one that was looked at.
BRANCH_STEP_FARTHER = 4.0
#: What lies ahead is first looked at when a step is this part of the one that was rejected.
BRANCH_LOOK_FIRST = 0.3
BRANCH_LOOK_AGAIN = 0.1  # It is looked at again when the step is this part of that.
#: Velocities are those of a branch where they differ by less than this part: a start with five
#: digits.
BRANCH_VELOCITIES_SAME = 1e-4
#: A rate along a branch below this part of the greatest is none; two that differ by less are one.
BRANCH_RATE_NONE = 1e-7
BRANCH_CERTIFICATE = 1e-10  # A quadric of the branches' directions is met to this part.
BRANCH_SAME = 1e-6  # Directions, and rates, of branches are one within this part of their size.
#: Further away than this from a singular position the rows determine the motion, though not all its
#: digits.
SINGULAR_DISTANCE_DETERMINED = 1e-4
SINGULAR_DISTANCE_PRECISE = 2e-3  # Further away than this rates by rows alone are as precise.
#: A singular position is sought within this: nearer to it the first accelerations lose more than
#: eight digits.
SINGULAR_DISTANCE_SOUGHT = 0.02
#: Within this of a singular position a closed position does not determine the branch.
SINGULAR_DISTANCE_UNDETERMINED = 1e-6
#: Nearer than this the first accelerations are those at the singular position.
SINGULAR_DISTANCE_AT = 1e-6
#: Corrections of a start with open rows end so far beside a singular position.
SINGULAR_DISTANCE_UNSURE = 1e-4
#: How far the first part of a motion from a singular position goes: its error falls with the ninth
#: power.
SINGULAR_START_SPAN = 0.4
#: Changes of its accelerations below this part are rounding where they no longer fall.
SINGULAR_START_ROUNDING = 1e-6
SINGULAR_START_TERM = 1e-9  # The last term of its polynomial may be this part of the accelerations.
#: A change of its accelerations, as a part of them, at which they have settled.
SINGULAR_START_SETTLED = 1e-13
#: Distance of the places from which positions near a singular one are interpolated: the error is
#: 2e-12 of the eighth derivative.
SINGULAR_BRANCH_STEP = 0.04
#: A motion meets a position that lies beside its path by less than this part of the way there.
SINGULARITY_BESIDE_PATH = 0.2
#: Rows stay independent where the least singular value is so many times what they change by.
INDEPENDENCE_CERTAIN = 1.5
#: Rate of a body beside that of the driver from which on it is a dead centre that is near.
DEAD_CENTRE_RATE = 1000.0
DEAD_CENTRE_MATCH = 1e-3  # How far a dead centre met on a walk may be from a certified one [rad].
PATH_DERIVATIVE_NONE = 1e-13  # x′ along a curve that is none: rounding of a unit vector times Φ_q.
PATH_STEP_FIRST = 1e-4  # First step along the curve to a dead centre.
PATH_STEP_LONGEST = 0.05  # The greatest one.
#: How far before a turning point places are taken where branches meet in it.
PATH_PLACE_BEFORE = 0.05
PATH_PLACE_SAME = 1e-6  # Places closer than this part of all that is followed are one.
PATH_SEAM = 1e-8  # Pieces of a motion that were found apart, as on lanes, must meet within this.
#: A path that is stuck this near to an instant, as a part of the range, is stuck at it.
PATH_STUCK_AT_INSTANT = 1e-3
#: Step of the driver for derivatives along a path: the interpolation's error is 0.3 · STEP⁸ of the
#: eighth derivative, 2e-12; rounding in forces is magnified by up to 1/STEP³.
PATH_DIFFERENCE_STEP = 0.04
CIRCUIT_STEP_FIRST = 0.02  # First step along a circuit.
CIRCUIT_STEP_LONGEST = 0.2  # The longest.
CIRCUIT_STEP_SHORTEST = 1e-9  # A step below which one has failed.
CIRCUIT_STEP_COSINE = 0.985  # Cosine between tangents that a step may have.
#: Distances to a singular position below this are rounding: pivots are squares of them.
MONITOR_NOISE = 1e-6
MONITOR_STEEPER = 3.0  # A rate may be so many times that of the neighbouring gaps.
#: The same in the bend of a branch that passes another one, which steps must resolve.
MONITOR_BEND = 10.0
MONITOR_SWEEP = 0.4  # Between two samples no body turns by more [rad] where distances vary.
#: They vary by more than this part of the greatest: they rise from zero to it, as a sine does, in
#: π/2 by which one body turns from another.
MONITOR_VARIED = 0.2
#: A motion is near a singular position where the conditioning falls below this part of its best.
CONDITIONING_NEAR_SINGULAR = 0.003
#: Below this part a step that fails may be one into a singular position.
CONDITIONING_INTO_SINGULAR = 0.01
#: Below this, as its root, a step near a singular position is worth a try with another length.
CONDITIONING_CLOSE = 0.005
CONDITIONING_NO_END = 1e-6  # A step does not end where the conditioning is this part of its best.
#: A projection is sure of its branch where it moves by less than this part of the distance to a
#: singular position, the root of the conditioning.
PROJECTION_SURE = 0.05
#: What a projection moves along the manifold may be so many times the error of a step.
PROJECTION_GREATEST = 10.0
#: Ways to a singular position shorter than this part of the time are no end of a step.
SINGULAR_TIME_SHORTEST = 1e-9
#: A step ends before a known singular position at this part of the way to it, or as far behind it.
SINGULAR_STEP_BEFORE = 0.5
SINGULAR_STEP_TWICE = 2.0  # It may be so many times the way where it goes over the position.
SINGULAR_STEP_BACK = 0.2  # One of these that is rejected is made this much shorter.
#: Accelerations are certain to this part, over the square of the distance from a singular position.
ACCELERATION_ROUNDING = 4e-16
#: The square that counts at least, for nearer ones are of no use.
ACCELERATION_ROUNDING_NEAREST = 1e-8
#: Greatest second difference of a part over a step, as a part of the smaller one at its ends. Four
#: would be a step across, 1 is one of half the width.
CHANGE_POINT_SHARP = 1.0
#: The same for h times what the rate of a part at the end of a step h differs from its mean over
#: the step; what SHARP lets pass has 1 on a parabola.
CHANGE_POINT_SHARP_END = 2.0
CHANGE_POINT_NEAR = 0.01  # The rate at the end is compared where a part is less than this.
#: A part below this belongs to a change point, if the parabola through three places has its least
#: value ahead and below CHANGE_POINT_EXACT of the last one.
CHANGE_POINT_PART = 1e-10
#: That part: branches are then less than 2e-6 apart (as sines), which is what rounding leaves of
#: positions there.
CHANGE_POINT_EXACT = 0.02
#: CHANGE_POINT_PART where rows are redundant: their regularization (1e-9) keeps all parts above
#: zero.
CHANGE_POINT_PART_SOFT = 1e-7
#: Part of a step across a change point at which that may be: places on both sides are about as far.
CHANGE_POINT_MIDDLE = 0.3
#: An instant is at a change point that is no farther from it than this part of the way to it.
CHANGE_POINT_AT = 1e-3
#: Steps that were cut short and hardly move lead nowhere where a part is less than this.
CHANGE_POINT_VANISHING = 1e-6
#: Lengths whose sums differ by less than this part of them are at a change point.
CHANGE_POINT_LENGTHS = 1e-9
PATH_BEFORE = 1e-6  # Way to a place before the first one.
#: A first correction larger than this part of the step requires a smaller step, in squares.
PATH_CORRECTION_SQUARE = 0.1**2
#: A derivative that is off by this part of itself requires a smaller step, in squares.
PATH_TURNED_SQUARE = 0.2**2
PATH_SLIGHT_SQUARE = 1e-9**2  # What is as small as this counts as zero in both tests, in squares.
#: Most by which a body turns from another one in a step [rad]. The branch monitor compares sines of
#: such angles: up to 0.75 it accepts none that has been zero, and no sine is zero twice.
PATH_SPREAD = 0.55
#: A step shorter than this part of the longest one is not made: stuck.
PATH_STEP_SHORTEST = 2.0**-40
#: A step that turns and is shorter than this part of the longest one may be at a nonsmooth point of
#: a law.
PATH_STEP_KINK = 2.0**-20
#: Successive steps shorter than this part of the longest one are a collapse of the step size:
#: rounding decides what the monitor sees. Bends of a margin of 1e-8 take some hundred.
PATH_STEP_COLLAPSE = 2.0**-16
PATH_STEP_ROUNDING = 1e-14  # What is left of the way, as a part of the places, that is rounding.
#: At a nonsmooth point the position is regular: Newton's first correction is below this,
PATH_KINK_CORRECTION = 1e-6
PATH_KINK_CONDITIONING = 1e-8  # and the conditioning above this.
PATH_DIVERGED = 1e3  # The correction from which on Newton's method diverges.
#: Square of what Φ_q v − ν, or f − M a − Φ_qᵀ λ, may be of its terms on lanes.
RESIDUAL_LANES_SQUARE = 1e-11**2
RESIDUAL_ROUNDING = 1e-14  # A residual of rates or forces below this part of its terms is rounding.
#: A Newton step towards a singular position or a branch, as a part of what it corrects, that is
#: rounding.
BRANCH_STEP_ROUNDING = 1e-15
#: A branch's equations are solved where what is left is below this part of their terms.
BRANCH_SOLVED = 1e-12
BRANCH_QUADRIC_SOLVED = 1e-13  # The same of a quadric in two unknowns.
BRANCH_FLAT = 1e-6  # Quadrics below this part of their size vanish on a space.
BRANCH_ROWS_MET = 1e-7  # Linear rows of a branch are met to this part of the greatest.
#: Two spaces are one where the least cosine between them differs from 1 by less.
BRANCH_SPACES_SAME = 1e-9
BRANCH_DRIVERS_FIT = 1e-9  # Driven rates fit dependent rows within this part of the greatest.
#: A direction that drivers move more slowly than this does not go on with time.
BRANCH_CLOCK_NONE = 1e-9

# -- Rates and velocities; parts of the greatest where nothing else is said ------------------------
#: Rates below this part of the natural rate, of the greatest speed or of a length are rest, and of
#: an angle along a walk or in a free motion.
RATE_NONE = 1e-9
#: A rate below this part of the greatest of a free motion is none; a root below this part of the
#: natural rate is that of a motion that nothing drives back.
RATE_NONE_MOTION = 1e-6
#: A coordinate slower than this part of the velocity scale does not move; a force likewise is none.
RATE_NONE_COORDINATE = 1e-10
#: The same of instant centres: rates follow from positions that are closed to 1e-13, and the worst
#: gallery model loses two digits on the way.
RATE_NONE_INSTANT_CENTRE = 1e-11
#: A mechanism slower than this part of the speed that its forces would give it is at rest: its
#: power is rounding.
RATE_NONE_MECHANISM = 1e-12
#: A rate of sliding, or its change, below this part of the greatest is rounding.
RATE_NONE_SLIDING = 1e-9
#: A rate of sliding below this part of the velocity scale is none: rounding decides its sign.
RATE_NONE_FRICTION = 1e-11
RATE_NONE_STOPPED = 1e-7  # Slower than this rests where what has stopped lets nothing else move.
#: A real or an imaginary part of an eigenvalue below this part of its size is rounding.
RATE_ROUNDING_EIGENVALUE = 1e-9
RATE_ROUNDING_EIGENVALUE_DOUBLE = 1e-7  # The same of a double root, found to half the digits.
RATE_CONSTANT = 1e-9  # A rate that changes by more than this part of its mean is no constant speed.
#: Rates of drivers below this part of their greatest do not tell how far a dead centre is.
RATE_SLOW_DRIVER = 1e-3
RATE_MET = 1e-9  # A prescribed rate is met to this part of the greatest.
#: Velocities that agree with what is prescribed to this part of the rates are as good as exact.
VELOCITIES_AGREE = 1e-9
#: Velocities that differ by this part of the fastest rate differ by rounding of four digits.
VELOCITY_ROUNDING = 1e-3
#: Rates of drivers that rows miss by more than this part of the fastest contradict each other.
RATES_CONTRADICT = 1e-6
#: What differs by less, as a part of one model length or radian, or of the fastest rate, is met.
SIMULATOR_STATE_MET = 1e-9
#: What is given leaves a driver free where its row has this part that is independent.
SIMULATOR_ROW_FREE = 1e-3
#: Accelerations of a state that is set and those of the mechanism agree to this part of the
#: greatest; those of another design do not.
ACCELERATIONS_AGREE = 1e-6
#: An acceleration below this part of what forces would give one by one is none: contacts that hold
#: a pile at rest are solved to some 1e-7 of its weight.
ACCELERATION_NONE = 1e-6
CURVATURE_NONE = 1e-10  # A curvature times the model length that is none.

# -- Forces, work, energy; parts of the greatest ---------------------------------------------------
FORCE_NONE = 1e-9  # A force, an effort or a reserve below this part of the greatest is rounding.
#: Part of the greatest acceleration that forces give alone to what is joined that may pass on to
#: another body by rounding, of which `GUARD_ZERO` is left.
FORCE_PASSED_ON = 1e-6
#: Masses of what is joined whose ratio is greater lose digits of the lighter one's acceleration,
MASSES_UNEVEN = 1e3
#: and beyond this what decides which contacts are closed: a residual of 1e-9 of what the heavy one
#: needs is a tenth of the light one's weight.
MASSES_LOST = 1e8
#: Part of the error of accelerations that a refinement leaves, for each of that ratio.
REFINEMENT_LEAVES = 1e3 * MACHINE_EPSILON
FORCE_NONE_BRANCH = 1e-8  # The same where branches are compared.
#: A tangential residual force along a walk below this part of its greatest is rounding.
FORCE_NONE_WALK = 1e-12
#: Efforts, momenta and shaking forces below this part are rounding: positions are closed to 1e-13
#: and rates follow with the condition of the loops.
FORCE_NONE_BALANCE = 1e-10
WORK_NONE = 1e-9  # Work below this part of the greatest that goes in or out is none.
#: The work of a part of the motion and of its halves agree to this part of all work.
WORK_AGREES = 1e-11
#: Work of a cycle that is rounding, beside the fluctuation of its energy.
WORK_CYCLE_ROUNDING = 1e-12
#: Rounding of an account, as a part of what its greatest force does along the model length.
ENERGY_ROUNDING = 2e-12
ENERGY_ROUNDING_STEP = 1e-13  # Rounding of an account, and of a step.
#: Energy that an impact may change otherwise than its impulses do, of what these exchange.
ENERGY_IMPACT = 1e-8
ENERGY_IMPACT_GAIN = 1e-9  # Energy that it may give by rounding, as a part of the same.
ENERGY_IMPACT_ARTIFICIAL = 1e-5  # Energy that artificial masses may take, as a part of its terms.
ENERGY_ERROR_FIXED_STEPS = 0.05  # The part of the energy that steps of one length may err by.
ENERGY_ERROR_DRIVEN = 0.15  # The part of it that motions with drivers may err by.
#: What a step may err by, in tolerances: in the gallery and in random mechanisms, by all methods at
#: 1e-3 … 1e-12, none errs by a fifth of that.
STEP_ERROR_TOLERANCES = 5.0
#: Greatest part of forces, and of power, that may be left over in a result: 1e-12 is met beside
#: what BALANCE_ROUNDING_SINGULAR explains.
BALANCE_LEFT = 1e-9
#: Rounding of single forces towards a singular position: of the square of the greatest one, as a
#: part of the loads; 6e-16 is met down to 1e-8 rad from a dead centre.
BALANCE_ROUNDING_SINGULAR = 1e-13
BALANCE_ROUNDING_FRICTION = 1e-14  # The same of sliding friction, by det(I − φ′ B).
#: Residual of Newton's method at its end: over the gallery at most 5e-13 of the greatest force.
BALANCE_EXPECTED = 5e-12
LOADS_UNBALANCED = 1e-7  # Unbalanced part of the loads above which there is no equilibrium.
#: A load that jumps with the rate by more than this part of the greatest is reported.
LOAD_JUMP_RATE = 1e-6
#: The change of a load over the lesser distance, as a part of that over the greater, from which on
#: it jumps: that of a smooth load is their ratio.
LOAD_JUMP = 0.5
LOAD_CHANGE_NONE = 1e-6  # A change below this part of the greatest load is none.
LAW_VALUES_SAME = 1e-9  # Values and rates of a driver that differ by less are those of its law.
LIMIT_EXCEEDED = 1e-12  # Part of a limit that rounding may exceed it by.

# -- Contact and friction; gaps in model lengths ---------------------------------------------------
CONTACT_GAP_CLOSED = 1e-10  # Nearer than this is closed, in a motion.
CONTACT_GAP_CLOSED_RESULT = 1e-8  # The same in results.
#: Shapes in contact at the beginning may be so far apart, or overlap so much.
CONTACT_GAP_BEGINNING = 1e-9
#: A gap or overlap, or a way past the end of an edge, that is none in a driven motion.
CONTACT_GAP_NONE = 1e-6
CONTACT_GAP_MEANT = 0.05  # A gap that is closed where nothing else determines the position.
CONTACT_GAP_FAR = 10.0  # A gap that is no contact that was meant.
#: Contacts whose gap is a larger part of their size than this are looked for where they come near.
CONTACT_GAP_CANDIDATE = 1e-6
#: Edges of which one is this near to the line of the other lie on one line.
CONTACT_EDGES_FLUSH = 1e-14
#: How far a corner may be behind a segment, in parts of it, before it is on its other side.
CONTACT_CORNER_BEHIND = 0.1
CONTACT_EDGE_PREFERRED = 1e-7  # The other's edge is taken that separates by such a part more.
#: Overlap, as a part of the smaller shape, that is refused at the beginning and leaves a doubt
#: later.
CONTACT_OVERLAP_DEEP = 0.05
CONTACT_OVERLAP_LEFT = 1e-6  # Overlap in parts of the size that corrections leave alone.
CONTACT_OVERLAP_CORRECTED = 0.2  # The part of the rest that one step takes away.
CONTACT_OVERLAP_ENOUGH = 1e-2  # Sweeps of corrections end at this part of the greatest impulse.
#: How far, in parts of its size, a contact may come nearer in a step because sweeps have not
#: followed its sliding.
CONTACT_SLIDING_SLACK = 1e-3
#: A force or an impulse of a contact below this part of the greatest is none.
CONTACT_FORCE_NONE = 1e-12
#: A change of forces or of a reserve, as a part of the greatest force, that is none.
CONTACT_FORCE_SETTLED = 1e-12
#: Forces of the same modes that differ by less than this part are the same.
CONTACT_FORCE_SAME = 1e-3
#: Part of the greatest force of a pair below which it may be one at rest.
CONTACT_FORCE_AT_REST = 1e-6
#: An acceleration of a contact below this part of the greatest is none.
CONTACT_ACCELERATION_NONE = 1e-11
#: Solutions whose accelerations differ by less than this part are one.
CONTACT_ACCELERATION_SAME = 1e-7
#: Accelerations without forces below this part of the greatest are zero.
CONTACT_ACCELERATION_ROUNDING = 1e-13
CONTACT_ACCELERATION_CANCELS = 1e-12  # Such a part of the terms of an acceleration is rounding.
#: What a solution of a complementarity problem may violate, without dimensions; 1e-12 is usual.
COMPLEMENTARITY_RESIDUAL = 1e-9
COMPLEMENTARITY_PIVOT = 1e-12  # A pivot below this part of its column is none.
COMPLEMENTARITY_TIE = 1e-12  # Ratios nearer to each other than this are equal.
COMPLEMENTARITY_CONVERGED = 1e-13  # Change of forces in parts of the greatest that is none.
#: By how much rows that depend on each other are made softer, a part of their own softness.
COMPLEMENTARITY_SOFTER = 1e-6
COMPLEMENTARITY_DETERMINED = (
    1e-12  # Pivots of scaled equations of modes below this determine nothing.
)
#: How far the approach is shifted, in parts of the greatest velocity, where an impact without
#: collision is sought.
COMPLEMENTARITY_SHIFT = 1e-9
LINEAR_PROGRAM_ZERO = 1e-13  # Entries of a tableau of small numbers that are rounding.
LINEAR_PROGRAM_RESIDUAL = 1e-10  # What a solution of it may violate; 1e-15 is usual.
LINEAR_PROGRAM_MULTIPLIER = 1e-7  # Multipliers of a linear program above this part are some.
#: A row that moves so little by its own force, as a part of what it would without joints, is led.
CONTACT_ROW_LED = 1e-13
#: Impulses of contacts that depend on others to this part are shared.
CONTACT_IMPULSES_DEPENDENT = 1e-12
#: A last change of impulses that is a greater part of the greatest leaves a doubt.
CONTACT_IMPULSES_UNCERTAIN = 1e-3
CONTACT_IMPULSES_RESCUED = 1e-4  # Above, impulses of few contacts are found elsewhere.
CONTACT_RATE_ROUNDING = 1e-14  # Changes below this part of rates without impulses are rounding.
CONTACT_RATES_LOOSER = 32.0  # By so much more rates may change than impulses, as parts.
CONTACT_GAIN_NONE = 1e-9  # Work of contacts below this part of the energies is no gain.
CONTACT_STEP_SHORTEST = 1e-9  # A last step that were as short a part of the others is no step.
CONTACT_STICKS_BEGINNING = 1e-6  # Slower, in parts of rates without impulses, a contact sticks.
#: What arrives slower than so often what the loads of one step give stays closed: steps do not
#: resolve its rebounds.
CONTACT_REBOUND = 2.0
CONTACT_ROW_FLEXIBLE = 1e-10  # Flexibility of a row of joints, as a part of what its bodies give.
INTERIOR_POINT_START = 1e-2  # Where the interior point method begins: part of the greatest impulse,
INTERIOR_POINT_VIOLATED = 0.1  # and of what the deepest violation asks for.
INTERIOR_POINT_STEP = 0.995  # Part of the way to the next bound that a step of it goes, at most.
#: An unknown of an impact below this part of the greatest is none, a complement too; where both are
#: none there is no derivative.
CONTACT_IMPACT_UNKNOWN_NONE = 1e-10
#: A flight shorter than this, in parts of the time in which what is pulled back goes a model
#: length, is none.
CONTACT_FLIGHT_SHORTEST = 2e-6
#: What pulls a contact back by less than this part of both bodies' accelerations is no pull.
CONTACT_PULL_NONE = 1e-6
#: A flight that is none for the oracle, in parts of the time of a fall by the model length.
CONTACT_FLIGHT_SHORTEST_ORACLE = 5e-7
FRICTION_AT_LIMIT = 1e-9  # Friction within this part of its limit slides.
FRICTION_STICKS = 1.0 - 1e-6  # Friction below this part of its limit sticks.
#: det(I − φ′ B) of sliding friction below this, where steps vanish, is zero.
FRICTION_SINGULAR = 1e-3
FRICTION_POLE = 0.01  # The same where steps go on, in parts of their tolerance.
#: Accepted change of the friction forces, as a part of the greatest: rounding.
FRICTION_CHANGE_ROUNDING = 1e-15
#: A change after which what is left is of the order of its square: lanes share the passes.
FRICTION_CHANGE_NEARLY = 1e-8
#: A change that is worth another solution with the friction as a load.
FRICTION_CHANGE_AGAIN = 1e-14
FRICTION_CHANGE_LANES = 1e-12  # A change that lanes may leave, which take the same passes for all.
#: The least level of friction, by which the place where the mechanism jams is known.
FRICTION_LEVEL_LEAST = 1e-11
FRICTION_SIZE_NEGATIVE = 1e-12  # What rounding may make of a size that is zero.
#: A bound of the spectral radius below which no closer one is sought.
FRICTION_RADIUS_CERTIFIED = 1.0 - 1e-9
FRICTION_RADIUS_POSITIVE = 1e-6  # What keeps the vector of the power method positive.
#: Spectral radius up to which friction is unique, with what rounding may take.
FRICTION_RADIUS_UNIQUE = 1.0 - 1e-12
#: A reserve below this part of the greatest is none, in bands of rest.
FRICTION_RESERVE_NONE = 1e-13
FRICTION_RESERVE_MOST = 10.0  # A reserve is at most so many times the greatest force.
#: Forces that no equation decides, and their margins, are sought up to so many times what must be
#: carried: what wedges itself could have any;
FORCES_ROOM_MOST = 100.0
FORCES_ROOM = 3.0  # there up to so many times.
#: A margin of such forces below this part of what they carry is none,
FORCES_ADMISSIBLE = 1e-9
FORCES_UNIQUE = 1e-8  # and a range of this part is one force.
#: Part of forces by which those differ that say what rounding does to a quantity made of them;
FORCES_ROUNDED = 1e-12
FORCES_CHANGE_COUNTS = 1e4  # changes by other forces count from so many times that on.
#: What forces leave of a load, as a part of it, where they balance it.
LOAD_BALANCED = 1e-7
#: A part of the greatest load that a force is at most, in the search of a reserve.
FRICTION_RESERVE_FORCE_MOST = 1000.0
#: A least reserve lies below the least sample by no more than neighbours lie above it (1.4 times as
#: much at a cusp, less at a corner): one this many times as much above zero stays positive.
FRICTION_RESERVE_DEEP = 10.0
#: An infinite reserve, as a part of the greatest finite one: where a mechanism jams.
FRICTION_RESERVE_JAMMED = 10.0
FRICTION_BAND_END = 1e-14  # An end of a band is located to this.
FRICTION_BAND_ENDS_SAME = 1e-9  # Ends nearer to each other bound no band.

# -- Times, events and steps of motions ------------------------------------------------------------
TIME_ROUNDING = 1e-15  # Rounding of times, as a part of them.
#: A step that ends within this part of the time before an instant ends at it.
TIME_END_ROUNDING = 1e-14
#: A step shorter than this part of the time is none, unless an instant ends it.
TIME_STEP_SHORTEST = 1e-13
TIME_STEP_SHORTEST_REJECTED = 1e-12  # The same of a step that follows a rejected one.
TIME_STEP_SHORTEST_DUALS = 1e-14  # The same on dual numbers.
#: Times nearer to each other than this part of them are one: no step is as short.
TIMES_SAME = 1e-13
#: The same of changes of modes, as a part of the motion; one that ends it so soon after ends at the
#: change itself.
TIMES_SAME_CHANGES = 1e-12
TIMES_SAME_MODES = 1e-12  # Changes of modes within this part of the motion happen at once.
TIMES_SAME_BEGINNING = 1e-9  # A change nearer to the beginning than this part of the time is at it.
#: Times nearer to each other than this part of a step, or of the sample time, are one.
TIMES_SAME_SAMPLE = 1e-9
TIMES_COUNT_ROUNDING = 1e-12  # What rounding may take from the number of samples.
TIMES_MOVE_ALIKE = 1e-9  # Times that move otherwise by less than this part move together.
RTOL_DEFAULT = 1e-8  # Relative error of a step, unless the caller says another.
RTOL_LEAST = 1e-14  # The least that a caller may say.
RTOL_FINE = 1e-10  # Of motions of which differences are taken, or which prove a result.
RTOL_COMPARISON = 1e-12  # Of motions that others are compared with.
RTOL_COMPARISON_ROUGH = 1e-9  # Of the second of them, for an estimate of the error.
#: From this on the method of order 5 reaches an accuracy sooner than that of order 8.
RTOL_LOOSE = 1e-6
RTOL_LINEARIZED = 1e-9  # Of motions to which a linearized system belongs.
#: A step is so much shorter than its error allows: of 0.7, 0.8 and 0.9 what costs the fewest
#: evaluations at one error, as fewer steps are rejected.
STEP_SAFETY = 0.8
#: The same near singular positions: the more steps, the nearer to the position some of them come.
STEP_SAFETY_NEAR_SINGULAR = 0.9
STEP_RATE_FADING = 0.7  # What is left of the fastest rate after a step that does not see it.
#: An error, in tolerances, below which the next step grows as much as it may.
STEP_ERROR_NONE = 1e-9
STEP_ERROR_NONE_RADAU = 1e-10  # The same of Radau's method.
STEP_STIFF_LIMIT = 15.0  # A motion is stiff after so many steps that stability limits;
STEP_STIFF_SMOOTH = 6.0  # so many in a row that it does not take one off.
#: Error of an interpolated instant, in tolerances times eight, squared, above which it gets a step
#: of its own. Ordinary motions stay below nine tolerances.
STEP_INTERPOLATION_DOUBTFUL = (8.0 * 10.0) ** 2
STEP_JACOBIAN_VALID = 1e-3  # Newton's rate below which Radau's Jacobian serves another step.
STEP_SHORT = 0.25  # A step is short if it is this part of the one that the tolerance allows.
STEP_COLLAPSE_SHRUNK = 0.1  # Steps whose mean falls below this part of the greatest
STEP_COLLAPSE_SLOW = 1e-4  # and this part of the time in which the motion changes collapse.
#: Sizes, in tolerances, below which a state, or its derivative in the time of the motion, says
#: nothing of the first step (Hairer, Nørsett, Wanner, II.4).
STEP_FIRST_SILENT = 1e-5
#: A state below this part of its size is at the origin, and says nothing of the first step either.
STEP_FIRST_ORIGIN = 1e-6
STEP_FIRST_LITTLE = 1e-6  # Part of the way that it takes then.
STEP_FIRST_MOST = 0.1  # Part of the way that it takes at most.
STEP_STEADY_START = 1e-12  # Part of the first rates at which a steady start is found.
STATE_SIZE_SMALL = 1e-3  # A state whose size nobody gave is said to be small below this part of it.
#: Part of its size by which a state may be apart from the one that it goes on from: it is projected
#: on the constraints again.
STATE_SAME = 1e-9
#: Part of a position's and a rate's size by which a motion that is repeated may differ from what
#: was kept: impacts are located to 1e-12 of a step.
STATE_REPEATED = 1e-6
#: Lengths of its next step that a state may lie before the last instant; it lies one before.
RESTART_STEPS_BEFORE = 10.0
#: Where explicit steps vanish another method is tried on this part of the motion.
STEPS_VANISHED_BEYOND = 1e-3
GUARD_ZERO = 1e-9  # A guard, or an argument of a jump, is zero below this part of its size.
GUARD_ROUNDING_GAP = 1e-14  # A gap begins at zero if it is less than this part of its size.
GUARD_ROUNDING_STOP = 1e-13  # The same of one that is a stop.
GUARD_ROUNDING_FORCE = 1e-12  # The same of one that is a force.
#: What begins below zero may be so many times as far below it until it counts as falling.
GUARD_FALLING = 1.5
GUARD_BEYOND_ZERO = 1e-5  # How far beyond zero it may be where another motion finds it zero.
GUARD_GRAZING = 1e-6  # A guard grazes zero with a rate below this part of its usual one.
GUARD_CUBIC_CLEAR = 0.2  # A cubic is clear of zero above this part of the lesser end;
GUARD_FORCE_VARIES = 0.7  # forces are if they vary by less than this part of the least.
GUARD_SMOOTH, GUARD_NEARLY_ZERO = 0.3, 0.02  # Parts of a guard: fourth difference, least between.
#: A cubic over two intervals between looks misses the look between by this part of the time times
#: what it misses of the rate, of what turns by 3 rad in all five looks: cubics between these are
#: wrong by 0.002 of its radius. Where more is missed looks do not show how it turns.
GUARD_TURNS = 0.015
GUARD_PART_LEAST = 4.0**-8  # The shortest part of a step that is looked at by itself.
EVENT_LOCATED = 1e-12  # A crossing is located to this part of its step.
#: Instants of what is zero together, as a rate and the sliding that it reverses, differ by no more
#: than this part.
EVENT_TOGETHER = 1e-11
#: Step of a rate along a motion, as a part of the time between samples: its error is 1e-11 of it.
EVENT_RATE_STEP = 6e-6
#: A change of the state, in its sizes, by a change of a number by its own size: what is less is
#: integrated with the errors of this one.
CHANGE_RESOLVED = 1e-3
#: Jumps of rates that differ by less than this part of the greatest are the same.
RATE_JUMP_SAME = 1e-12
#: By what part the tangents of a state may differ from what the modes that follow allow;
TANGENTS_DIFFER = 1e-5
TANGENTS_DIFFER_TOLERANCES = 1e3  # by so many tolerances besides.
TANGENTS_DIFFER_AT_REST = (
    1e-3  # The same where impacts come to rest, the last of which are not met.
)
#: What may be left of a tangent of Φ beside the greatest, where redundant rows close.
TANGENTS_LEFT = 1e-6
#: By what part of the greatest value an instant may differ when it is solved once more.
INSTANT_SAME_AGAIN = 1e-4

# -- Equilibria ------------------------------------------------------------------------------------
#: A residual force below this part of the greatest force is none: 1e-13 is left where there is
#: rest, 1e-9 may be beside a singular position.
EQUILIBRIUM_BALANCED = 1e-10
#: The same of a given rest position, which moves when it is closed again.
EQUILIBRIUM_BALANCED_GIVEN = 1e-7
EQUILIBRIUM_RESTING = 1e-4  # The same where it is nearly singular.
EQUILIBRIUM_STEP_ROUNDING = 1e-13  # A step of a search below this is rounding.
EQUILIBRIUM_STEP_STALLED = 1e-9  # The same where steps no longer gain.
#: The longest step of a search, and a step of a walk away from a start.
EQUILIBRIUM_STEP_LONGEST = 0.4
EQUILIBRIUM_STRIDE = 0.2  # Step of a walk of a search.
#: A walk of one coordinate ends where less than this part of the others can be fixed.
EQUILIBRIUM_INDEPENDENT = 1e-3
EQUILIBRIUM_LAST_STEP = 1e-12  # The last Newton step to a rest position beside, in model lengths.
EQUILIBRIA_ALIKE = 1e-4  # Forces and stiffnesses that agree to this part are alike.
STIFFNESS_ZERO = 1e-8  # A stiffness below this part of the greatest load is none.
#: A stiffness below this part of the greatest, or of how fast loads change, is none to first order:
#: as far beside a double zero as a finest cell is long it is about 1e-4.
STIFFNESS_SOFT = 1e-3
LOADS_COMPARED_FAR = 1e-2  # Distances to both sides at which loads are compared: this
LOADS_COMPARED_NEAR = 1e-3  # and this, further than a finest cell of a chart is long.
LOADS_BESIDE = 1e-8  # Distances to where what is left out where its ends meet is there: this
LOADS_BESIDE_FURTHER = 1e-5  # and this.
#: Step of a walk of the fastest coordinate: no whole part of a turn, so that places of symmetry are
#: not met exactly.
WALK_STEP = 0.1973
WALK_TURN_GREATEST = 0.35  # Greatest angle between neighbouring tangents [rad],
WALK_TURN_STRAIGHT = 0.01  # and the one below which steps grow.
#: A step below this part of a stride meets a corner, a branch point or an end.
WALK_STEP_SHORTEST = 1e-5
WALK_BEHIND_CORNER = 1e-6  # Distance behind a corner at which the walk goes on.
WALK_INTERVAL_SMALLEST = 1e-7  # An interval below this is not divided further.
WALK_CUBIC_SURE = 6.0  # The error of a cubic, as a multiple of what neighbours or the middle show.
#: A change of the tangential residual force so many times what derivatives and rounding explain is
#: a jump.
WALK_FORCE_JUMPS = 100.0
CURVE_STEP_FIRST = 0.02  # First step along a curve of rest positions,
CURVE_STEP_LONGEST = 0.1  # the longest
CURVE_STEP_SHORTEST = 1e-7  # and the shortest.
CURVE_COSINE = 0.98  # Cosine of the greatest angle between the directions of neighbours.
BRANCH_POINT_STEP_LONGEST = 0.2  # The longest correction to a branch point.
#: What is left of the residual force, as a part of its second derivatives, above which branches
#: pass without meeting: the square of how far they are apart; rounding leaves 1e-13.
BRANCH_POINT_GAP = 1e-10
#: A second derivative of the residual force along the position, as a part of the greatest, that is
#: none: a pitchfork.
BRANCH_POINT_CURVATURE_NONE = 1e-4
#: Distance from it, along the curve, at which it is looked whether branches meet.
BRANCH_POINT_LOOK = 1e-4
#: A step below which branches that do not cross are no longer distinguished.
BRANCH_POINT_STEP_LEAST = 1e-5
#: The error of an interpolation on a surface of positions, as a multiple of what neighbours show.
SURFACE_ERROR_SURE = 2.0
SURFACE_SPACING = 0.4  # Distance of neighbours, of the fastest coordinate,
SURFACE_SPACING_SAME = 0.7  # the part of it at which places are the same,
SURFACE_SPACING_LEAST = 0.05  # and the least.
#: Distance of the ends of charts at a point where they meet, in model lengths.
SURFACE_END_MET = 1e-11
#: Ends that move across their line by less than this part of what they move along it stay on it.
SURFACE_END_ON_LINE = 1e-6
#: Ends at this distance, in model lengths, are on both sides of a nonsmooth line.
SURFACE_ENDS_NONSMOOTH = 1e-9
#: Sine of the angle between two directions of ends that are on one line.
SURFACE_ENDS_ONE_LINE = 0.2
#: Places beside nonsmooth lines nearer to each other than this, by their names, are one.
SURFACE_NONSMOOTH_SAME = 0.05
SURFACE_FORCE_PROBE = 1e-6  # Distance from a point at which forces are compared.
#: Forces that differ by less than this part of the greatest do not jump.
SURFACE_FORCE_SMOOTH = 1e-4
CHART_TANGENT_COSINE = 0.8  # Least cosine between the tangent planes of neighbours.
#: How much longer than its part in the tangent plane the chord to a neighbour may be that bounds a
#: chart.
CHART_CHORD = 1.1
CHART_FURTHER = 1.5  # How far a point may be from the nearest place, in radii of it.
CHART_STEEP = 2.0  # How much longer than its part in the tangent plane a way on the surface may be.
CHART_BENT = 1.15  # The same of a chart that is to be level.
CHART_RADIUS = 0.12  # Greatest radius of a chart around a point,
CHART_RADIUS_PART = 0.45  # and the part of the distance to the next one.
CHART_RADIUS_INNERMOST = 1e-5  # The least radius of a polar chart, as a part of its greatest.
CHART_WIDTH_MOST = 0.2  # Half the width of charts that go on where others end, at most
CHART_WIDTH_LEAST = 1e-3  # and at least.
CELL_ONE_ZERO = 0.9  # Difference from the identity below which a cell holds one zero at most.
#: How far outside its cell, in parts of it, a zero of the interpolation is followed at least.
CELL_ZERO_FOLLOWED = 0.6
#: How far outside its cell, in parts of it, a zero that was found counts for it.
CELL_ZERO_WITHIN = 0.3
#: A stiffness with a singular value below this part of the greatest is singular.
CELL_STIFFNESS_SINGULAR = 1e-7
#: Length of a Newton step in a cell after which the search's own method ends it.
CELL_STEP_NEAR = 1e-6
#: Greatest angle between the residual forces of neighbours on a circle around a jump [rad].
JUMP_ANGLE = 1.0
AXIS_DIRECTION = 1e-4  # A direction is called x or y within this [deg].
EQUILIBRIUM_DAMPING_FIRST = 1e-3  # Damping of a search (Levenberg–Marquardt): the first,
EQUILIBRIUM_DAMPING_LEAST = 1e-15  # the least after a step that gained,
EQUILIBRIUM_DAMPING_FAILED = 1e-12  # the least after one that did not,
EQUILIBRIUM_DAMPING_LOST = 1e9  # and the one above which a search has lost its way.
#: Part of the greatest stiffness that a direction of a descent has at least.
EQUILIBRIUM_DESCENT_SOFT = 1e-3
EQUILIBRIUM_DESCENT_STEP = 1e-6  # A descent ends where a step is below this,
EQUILIBRIUM_DESCENT_LEAST = 1e-7  # or would have to be.
#: A derivative of the residual force at rest below this part of the greatest is none.
WALK_SLOPE_FLAT = 1e-6
#: A walk is closed where the residual forces of its ends differ by less than this part of the
#: greatest.
WALK_CLOSED_RESIDUAL = 1e-9
WALK_CORNER_NONE = 1e-12  # The square of a body's motion at a corner that is none.
#: A bracket of a zero of a cubic, in parts of its interval, that is rounding.
WALK_ZERO_BRACKET = 1e-15
WALK_ZERO_INSIDE = 1e-9  # How far inside its interval a zero is at least.
#: A function along a curve of rest positions is zero below this part of its ends,
CURVE_ZERO_VALUE = 1e-12
CURVE_ZERO_BRACKET = 1e-9  # or where they are nearer to each other, along the curve.
EQUILIBRIUM_GROWTH_NONE = 1e-12  # A greatest real eigenvalue of a load's growth below this is none.
SURFACE_DRIVEN_OUT = 1e-9  # Part of the greatest force above which loads drive a place further out.
#: Part of the greatest force by which loads may differ a whole turn later.
SURFACE_TURN_FORCE = 1e-6
#: A determinant of a Jacobian below this part of its rows' product is none.
CELL_DETERMINANT_NONE = 1e-12

# -- Differences: steps, and what they leave -------------------------------------------------------
#: Part of a state by which forward differences step: the root of rounding.
DIFFERENCE_STEP_FORWARD = 1.5e-8
#: Step of differences of fourth order: error and rounding are near 1e-12.
DIFFERENCE_STEP_FOURTH_ORDER = 1e-3
#: Part of the size of a number, or of the span of a curve of rest positions: truncation 1e-8 of a
#: derivative, the integrator's error (RTOL_FINE) 1e-6.
DIFFERENCE_STEP_NUMBERS = 1e-4
#: The same of sampled inputs, and towards a singular position nearby: errors of the order of its
#: square.
DIFFERENCE_STEP_INPUTS = 1e-5
DIFFERENCE_STEP_DAMPING = 1e-5  # For damping, as a part of the natural rate, at least.
DIFFERENCE_STEP_UNKNOWNS = 1e-6  # Of unknowns that are solved for.
#: Of a length, in parts of that of the model, and of an angle, for shapes that follow.
DIFFERENCE_STEP_SHAPES = 1e-6
DIFFERENCE_ROUNDING = 1e-8  # Part of the loads that differences of accelerations have as rounding.
DIFFERENCE_RATIOS_SAME = 1e-9  # Ratios of changes that differ by less are the same.
#: Changes of shapes are the same, in parts of the greatest: what is left out is of second order.
DIFFERENCE_SHAPES_SAME = 1e-3
USER_DERIVATIVE_WRONG = 1e-4  # Part of the greatest term by which a user's derivative may be off.
#: Two answers of a user's function to one question may differ by this part.
USER_ANSWER_SAME = 1e-12
#: Derivatives may differ from differences by this part of what all numbers do together,
DERIVATIVE_ALLOWED = 0.002
DERIVATIVE_BANDS = 3.0  # or by so many times what differences of two steps differ by;
DERIVATIVE_ERRORS = 100.0  # motions have errors of so many times their rtol.
#: Motions for differences are so much more exact than the motion itself,
DERIVATIVE_MOTION_FINER = 0.01
DERIVATIVE_MOTION_FINEST = 1e-12  # as far as they can be.
#: A root is simple where wᵀ (2 s M + C) u is more than this part of what it is made of.
DERIVATIVE_ROOT_SIMPLE = 1e-6
#: Values this close, as a part of the greatest, are equal: several may be the greatest.
DERIVATIVE_VALUES_EQUAL = 1e-9
DERIVATIVES_EQUAL = 1e-6  # Their derivatives this close are equal.
#: Part of the size that a quantity may have in a mechanism that is rounding.
QUANTITY_ROUNDING = 1e-12
TANGENT_WEIGHT_SAME = 1e-9  # A weight is the inverse of its mass within this part.
#: A motion that an element allows and that is greater than this is looked at for its power.
USER_POWER_NONE = 1e-6

# -- Certified search of boxes ---------------------------------------------------------------------
#: By what ranges are widened, as a part of the size of what is added up.
BOX_WIDENING_ROUNDING = 1e-12
BOX_WIDENING = 1e-9  # By how much bounds are widened, as a part,
BOX_WIDER = 1.0 + BOX_WIDENING  # and the factor that does it.
#: A coefficient that cuts no box, as a part of its row; a cosine that is not divided by.
BOX_COEFFICIENT_NONE = 1e-9
BOX_SPARE_ROWS_OPEN = 1e-9  # By how much rows to spare may be open, of the size of the rows.
BOX_SIZE_LEAST = 1e-2  # Least part of the size of the rows to which one is searched.
#: Width [rad, or a quarter of the range] of a box that is not halved any more.
BOX_WIDTH_SMALLEST = 1e-6
BOX_WIDTH_NARROW = 2e-2  # Many boxes as narrow as this are no isolated roots.
BOX_INFLATED = 1.05  # By how much a box is inflated to prove a root,
BOX_INFLATED_LEAST = 1e-9  # and what it gains at least.
BOX_ROOTS_SAME = 1e-7  # Roots nearer than this are one [rad, or cosines and sines].
BOX_VECTOR_ROUNDING = 1e-8  # Components of a unit vector beyond 1 by rounding.
BOX_MIDDLES_SAME = 1e-3  # Boxes whose middles are nearer than this are about one position [rad].
BOX_FAMILY_SPREAD = 0.1  # Angles of boxes that spread more than this are those of a family [rad].
BOX_FACTOR_NONE = 1e-12  # Of a factor or a constant in rows between angles: zero.
BOX_RATIO_SAME = 1e-12  # A ratio of angles is that of small whole numbers within this.

# -- Solving for numbers, optimisation, fits, synthesis --------------------------------------------
ROW_REST_ROUNDING = 1e-13  # Part of its terms below which what is left of a row is rounding.
ROW_HOLDS = 1e-9  # Part of its terms below which a row holds.
UNKNOWN_OPEN = 1e-11  # A singular value below this part of the greatest leaves an unknown open.
UNKNOWNS_SAME = 1e-6  # Two solutions nearer than this, in steps of the unknowns, are one.
BOUND_SLACK = 1e-6  # Part of a step by which a bound may be passed.
#: A value this near to its bound, as a part, is at it; a start this far within its bounds is
#: inside.
BOUND_AT = 1e-9
#: Values nearer to each other than this part, or this part of the greatest value, are equal.
EXTREMUM_VALUES_EQUAL = 1e-10
#: Values that differ by less than this part of their size are one; a row binds below it.
EXTREMUM_VALUES_SAME = 1e-6
EXTREMUM_BINDS_NEAR = 1e-3  # What binds is met to rounding within this part of the unknowns.
EXTREMUM_BRACKET = 4e-16  # A bracket this narrow, as a part of its ends, is rounding.
#: A cubic through neighbours that is off by more of their spread asks for more samples,
EXTREMUM_CUBIC_ROUGH = 0.03
EXTREMUM_SPACING_FINEST = 1.0 / 300.0  # down to this part of the first spacing.
#: Parts of a spacing by which values near an edge are compared, from far to near.
EXTREMUM_EDGE_NEAR = (1e-2, 1e-4, 1e-6)
LIMIT_HOLDS = 1e-6  # What is broken by less, as a part of the size of a limit, holds.
#: What is nearer to its limit than this part of its size may bind: the least with which derivatives
#: balance counts.
LIMIT_BINDS = (1e-7, 1e-6, 1e-5, 1e-4)
LIMIT_BALANCED = 1e-3  # Up to this part they balance.
OPTIMUM_BOX_FIRST = 0.02  # The first box of a program's step, as parts of the ranges.
OPTIMUM_GAIN_LAST = 1e-9  # A step or a round that gains less than this part is the last.
#: A round without new rows that gains more than this part is followed by another.
OPTIMUM_GAIN_SLIGHT = 1e-3
#: A multiplier below this part of the greatest effect does not count.
OPTIMUM_MULTIPLIER_COUNTS = 1e-6
#: Where no derivative is greater, as the part by which the objective would change over a range, the
#: place is a smooth optimum.
OPTIMUM_FLAT = 0.1
OPTIMUM_FLATTEST = 1e-6  # An objective changes over the ranges by this part of its size at least.
#: Derivatives that are not balanced by what binds, as a part of the greatest, are said.
OPTIMUM_OPEN = 0.01
#: Ends of several starts whose values differ by less than this part agree.
OPTIMUM_VALUES_AGREE = 1e-4
OPTIMUM_MARGIN_NONE = 1e-9  # A margin of a limit that is shown as zero.
FILE_NUMBERS_SAME = 1e-9  # Numbers that a file gives agree with those of a design to this part.
FIT_SINGULAR_VALUE = {True: 1e-9, False: 1e-5}  # Part that is zero: of exact ones, of differences.
FIT_DEVIATIONS_SETTLED = 1e-3  # Changes of deviations of columns at which their passes end.
FIT_DEVIATION_LEAST = 1e-12  # A deviation is at least this part of the greatest datum of a column.
FIT_DIRECTION_NONE = 1e-6  # A part of a direction that is rounding.
FIT_RESIDUAL_ROUNDING = 1e-9  # Residuals below this part of the greatest datum are rounding.
FIT_CORRELATION_CHANCE = 4.0  # Standard errors of a correlation of residuals that are no chance.
FIT_ENDS = 1e-12  # The same as LEAST_SQUARES_ENDS of a fit.
FIT_BOUND_NEAR = 1e-6  # An unknown this near to a bound, as a part of its size, is at it.
FIT_BOUND_CHANCE = 4.0  # Deviations beyond a bound to which data lead that are no chance.
FIT_IMPROVES = 1e-6  # Part by which the sum of squares falls where another start is better,
FIT_AGREES = 1e-2  # or is greater where one agrees.
#: Of numbers that fit equally well, with exact derivatives and with differences: part of the data
#: and of a constant sum that may change, and the first step by the sizes of the unknowns.
FIT_FAMILY_DATA = {True: 1e-9, False: 1e-5}
FIT_FAMILY_HOLDS = {True: 1e-6, False: 1e-2}
FIT_FAMILY_STEP = {True: 2.0**-8, False: 2.0**-4}
TOLERANCE_FIRST_ORDER = 0.1  # Part of a half band by which a tolerance of first order may leave it.
TOLERANCE_WIDEST = 100.0  # Tolerances of a number without a size that are tried.
SYNTHESIS_PINS_SAME = 1e-6  # Relative distance of pivots or pins that are one.
#: Share of the size of a motion or a link by which a point is met, a path is closed and a point of
#: the coupler lies at one of its pins.
SYNTHESIS_POINT_MET = 1e-9
SYNTHESIS_TURN_ROUNDING = 1e-9  # Rounding of a whole turn [rad].
#: Angle of the carrier by which a position is the one that was meant [rad].
SYNTHESIS_ANGLE_SAME = 1e-6
SYNTHESIS_DESIGNS_SAME = 1e-4  # Share of the size of a motion by which designs are one.
SYNTHESIS_DESIGN_OFF = 0.1  # What part of the size of a path a design may be off before it is said.
#: Least share of what C, E and G have in common by which α and β are told apart.
SYNTHESIS_ANGLES_DISTINCT = 1e-10
UNKNOWN_STEP_ROUNDING = 1e-16  # A step of unknowns that is rounding.
UNKNOWN_STEP_GAIN = 1e-4  # Part that a step of unknowns gains at least.
UNKNOWN_BRACKET = 1e-9  # A bracket of one unknown this narrow, as a part of its ends, is its zero.
UNKNOWN_LOOSE = 1e-3  # Part of the greatest weight with which an unknown is left open.
EXTREMUM_SPACING_WIDE = 1e-7  # Samples nearer than this part of the spacing show no cubic.
EXTREMUM_UNKNOWN_NONE = 1e-15  # An unknown below this part of 1 + its start is zero.
EXTREMUM_BRACKET_PART = 1e-14  # The same as EXTREMUM_BRACKET in parts of the interval.
OPTIMUM_ENDS = 1e-10  # Relative change of the objective at which SLSQP ends.
#: A coefficient, as a part of the others, that is none: a link or a point without end.
SYNTHESIS_COEFFICIENT_NONE = 1e-12
SYNTHESIS_SLIDER_NONE = 1e-14  # A crank of a slider-crank that is none.
SYNTHESIS_ENDS = 1e-14  # The same as LEAST_SQUARES_ENDS of generators of functions.
SYNTHESIS_SOLUTIONS_SAME = 1e-5  # Solutions whose numbers differ by less than this part are one.
SYNTHESIS_LED = 1e-8  # By what part of its size a condition is met that a search leads to.
SYNTHESIS_LED_STEP = 1e-6  # Difference of a number by which a condition is derived, in its range.
SYNTHESIS_VALLEY = 0.1  # Share of the size up to which designs may lie in one flat valley.
SYNTHESIS_ERROR_SAME = 1e-3  # Relative rise of a sum of squares between them that is no ridge.
SYNTHESIS_TURN_ROUNDING_FINE = 1e-12  # Rounding of a whole turn of a table of angles [rad].
SYNTHESIS_ANGLE_STEP_LEAST = 1e-9  # Least change of the carrier's angle between two poses [rad].

# -- Engineering -----------------------------------------------------------------------------------
CAM_JUMP_BESIDE = 1e-9  # Beside a place where a profile's second derivative jumps [rad].
#: Of its greatest radius, a base circle or a size that is none; by so much the centre may move.
CAM_CIRCLE_NONE = 1e-9
CAM_CIRCLE_ENDLESS = 1e6  # Of the greatest radius, a size without end.
#: A profile closes where its ends differ by less than this part of its size: a period in a file, as
#: 6.283185 for a turn, has seven digits.
CAM_PROFILE_CLOSES = 1e-6
CYCLE_WHOLE_TURNS = 1e-9  # Tolerance of whole turns, relative.
CYCLE_PERIODIC = 1e-6  # Tolerance of the periodicity of a quantity, relative to its size.
HARMONICS_STEPS_EQUAL = 1e-6  # Tolerance of equal steps of the angle, as a part of a step.
#: A change by this part of the greatest amplitude when every second instant is left out is noted.
HARMONICS_FOLDED = 1e-6
HARMONICS_ORDER_SAME = 1e-9  # Orders that differ by less are one.
DIRECTION_ROUNDING = 1e-12  # Directions that are +π/2 but for rounding [rad].
LINES_PARALLEL = 1e-6  # Lines that meet at an angle of less [rad], or its sine, are parallel.
#: A density that is below zero by less than this part of its mean is rounding.
DENSITY_NEGATIVE_ROUNDING = 1e-9
#: A crank that is beside its dead centre by more than this part of a turn does not fit.
CRANK_BESIDE_DEAD_CENTRE = 1e-6
SPRING_PUSHED = 0.99  # A spring that would leave less than this part if it could push is said to.
#: Second moments may miss the body's inertia by this part of it: digits that were typed.
INERTIA_DIGITS_TYPED = 1e-6

# -- Comparison with other engines and with the oracle ---------------------------------------------
#: Differences of motions in steps below this part are rounding and our own tolerance.
COMPARISON_FLOOR = 1e-6
COMPARISON_FLOOR_PYMUNK = 1e-8  # The same of Pymunk's extrapolated motions.
COMPARISON_OURS_PYMUNK = 1e-7  # The same of our own tolerance, by default 1e-8 per step.
#: Where results of two step lengths differ by more than this part, nothing is compared.
COMPARISON_BLIND = 0.02
#: If halved steps, or an extrapolation, change a result by more than this part, agreement proves
#: little.
COMPARISON_COARSE = 0.01
#: Differences of accelerations and positions below this part are rounding.
COMPARISON_ROUNDING = 1e-10
#: Position error of our closed loops over a turn; the condition of the equations amplifies it.
COMPARISON_CLOSURE = 2e-12
#: A number read independently that differs by less than this is rounding.
COMPARISON_READING = 1e-13
#: Expected difference, in ε times the condition; the residual was at most 2300 times ε in
#: measurements.
COMPARISON_OPERATIONS = 2e4
#: Worse conditions of the loops are singular positions: forces have no correct digits.
COMPARISON_CONDITION_SINGULAR = 1e8
#: Ratio of the condition of the loops to the least one that counts as a singular position.
COMPARISON_CONDITION_WORSE = 8.0
COMPARISON_AMPLIFICATION = 1e4  # Greatest amplification of errors at which motions are compared.
COMPARISON_FORCES_INCREASE = 1e-6  # Relative increase of the forces in a second motion.
#: Eigenvalues of the scaled M and singular values of the scaled saddle-point matrix below this part
#: are zero.
COMPARISON_EIGENVALUE_NONE = 1e-11
COMPARISON_STEPS_PINOCCHIO = 1e-11  # Of a motion over time: least error of many steps,
COMPARISON_LOCAL_PINOCCHIO = 1e-9  # least error at once,
#: and the factor from the product of error and growth to the expected difference.
COMPARISON_MARGIN_PINOCCHIO = 30.0
#: Factor from the change by the last extrapolation to the expected difference.
COMPARISON_MARGIN_PYMUNK = 3.0
#: Times by which the error of a motion of our tolerance may exceed that of the oracle's by it.
COMPARISON_MARGIN_ORACLE = 20.0
#: The least difference that is expected: of where events are located, in parts of the motion.
COMPARISON_LEAST_ORACLE = 1e-9
#: A force is unique if its components of the null space vectors are below this.
COMPARISON_FORCE_UNIQUE = 1e-6
#: Torques below this part of the forces times the model length are rounding; likewise forces.
COMPARISON_TORQUE_NONE = 1e-10
COMPARISON_VALUE_NONE = 1e-9  # Values below this part of related values are rounding.
#: Inertias below this part of the greatest, and lengths below this part of the model length, are
#: none.
COMPARISON_INERTIA_NONE = 1e-9
#: Motions whose impacts follow two laws are the same up to this part.
COMPARISON_IMPACTS_SAME = 1e-6
#: Part of the greatest mass of a body without mass, which MuJoCo cannot move.
MUJOCO_ARTIFICIAL_MASS = 1e-9
#: The same of the inertia of a point mass, which moves with its place in any case.
MUJOCO_ARTIFICIAL_INERTIA = 1e-13
MUJOCO_IMPEDANCE = 0.9999  # Greatest impedance that MuJoCo allows for a constraint.
MUJOCO_STICKS = 0.99  # Friction below this part of its limit sticks in MuJoCo's steps.
#: Longest step, as a part of the characteristic time of the motion; the next are halved.
PYMUNK_STEP_LONGEST = 0.002
PYMUNK_ARTIFICIAL_MASS = 0.005  # An artificial mass in a free motion, as a part of the others.
PYMUNK_SETTLED = 1e-10  # Change by more iterations that is accepted, relative to the greatest.
#: Accepted change of the forces of a motion, and of its positions by more iterations.
PYMUNK_SETTLED_MOTION = 1e-8
#: Sliding slower than this part of the velocities of the motion is rest: the static coefficient.
PYMUNK_SLIDING_REST = 1e-6
#: At the limit of friction, but slower than this part of it, nothing is certain.
PYMUNK_SLIDING_SLOW = 1e-3
#: Enlargement of a rolling wheel so that it touches, as a part of its radius.
PYMUNK_WHEEL_PRESSED = 1e-7
PYMUNK_WHEEL_CENTRED = 1e-12  # Greatest eccentricity of a wheel's mass centre, in model lengths.
#: What is left over, as a part of the loads, where Newton's iteration converged.
ORACLE_NEWTON_LEFT = 1e-13
#: What rounding leaves over in each equation, as a part of its greatest terms.
ORACLE_EQUATION_ROUNDING = 4.0 * MACHINE_EPSILON
ORACLE_SOLUTIONS_SAME = 1e-7  # Two solutions that are nearer, as a part of the loads, are one.
#: Distance before and after an instant for finding a jump, in the time scale of the motion,
ORACLE_JUMP_AROUND = 1e-7
ORACLE_JUMP = 1e-4  # and the relative change of accelerations that counts as one.
#: What begins within this part of the size of its terms begins at zero;
ORACLE_BEGINS_AT_ZERO = 1e-10
ORACLE_BEGINS_ABOVE = 1e-13  # it is this part above it.
#: Relative to the greatest gap, acceleration or force, what rounding leaves of zero;
ORACLE_NONE = 1e-9
ORACLE_VELOCITY_NONE = 1e-8  # of the greatest velocity.
ORACLE_GAP_PARTED = 1e-15  # The gap of what has just parted, in parts of the length.
#: What a user's element may be off by, relative, before its contract is broken.
CONTRACT_TOLERANCE = 1e-8
COMPARISON_ROW_NONE = 1e-12  # A row below this part of the greatest is none.
#: An instant that lies beyond the end of a comparison by less than this part of it belongs to it.
COMPARISON_TIME_END = 1e-12
MUJOCO_SOLVER = 1e-14  # Tolerance of MuJoCo's solver in steps with contacts,
MUJOCO_SOLVER_FINE = 1e-15  # and in motions without.
#: A force of the oracle is unique if its components of the null space vectors are below this.
ORACLE_FORCE_UNIQUE = 1e-8
#: What is left of the oracle's equations, as a part of the greatest, where they have a solution.
ORACLE_EQUATIONS_LEFT = 1e-9
#: Forces nearer to an event than this part of the motion are those of one side of it.
ORACLE_EVENT_NEAR = 1e-6
#: Solutions of the oracle's modes whose accelerations differ by less than this part are one.
ORACLE_ACCELERATIONS_SAME = 1e-6

# -- Files, laws and tables ------------------------------------------------------------------------
#: Parts of a length by which places of one drawing may differ: files have rounded numbers.
FILE_PLACES_SAME = 1e-6
#: Sine of the angle by which axes in a file may lean: files have rounded directions.
FILE_AXES_PARALLEL = 1e-6
#: Part of a size by which a Linkage document's points may miss their line or circle.
FILE_RADII_SAME = 1e-3
#: Part of a table's range by which it may be left: what rounding may put beyond its ends.
TABLE_RANGE_MARGIN = 1e-9
#: A spline is reported to leave the range of its points if it does so by more than this part of the
#: range.
TABLE_SPLINE_BEYOND = 1e-9
#: Ends of a table or a profile that differ by less than this part of its size are one.
TABLE_CLOSES = 1e-9
TABLE_PERIOD_ROUNDING = 1e-9  # Part of a period by which a cam's segments may pass it.
#: Of the values' size: rounding may exceed a turning point of a law by this.
TABLE_TURNING_POINT = 1e-12
#: Part of the time below which a stretch in which a law is inverted is none.
TABLE_TIMES_SHORTEST = 1e-12
#: Part of f′ nearby by which its interpolation may differ where a law is inverted.
TABLE_RATE_AGREES = 0.05
#: The scale of a user's function, as a part of its argument, is at least this,
FUNCTION_SCALE_LEAST = 1e-6
FUNCTION_SLOPES_AGREE = 1e-6  # and two derivatives of it agree to this part of the steepest.
FORMULA_SAME = 1e-9  # Values of a formula beside a corner that differ by this part are one.
# A given derivative is wrong where it is off by this part of itself,
DERIVATIVE_WRONG = 3e-3
DERIVATIVE_SLIGHT = 1e-4  # and by this part of the greatest one met;
DERIVATIVE_CERTAIN = 2e-3  # differences that are not certain to this part of it do not count,
DERIVATIVE_ROUNDING = 1e-12  # nor what rounding of the values over the range makes.
#: Forces of a user's load on two bodies balance to this part of their size.
LOAD_BALANCE = 1e-6
STROKE_MARGIN = 1e-6  # Part of its stroke by which a cylinder may leave it.
PARAMETERS_EQUAL = 1e-12  # Values of parameters that differ by less than this part are one.
FILE_GRAVITY_IN_PLANE = 1e-9  # Part of gravity that may point out of the plane of a file.

# -- Printed and drawn; parts of the greatest of its kind ------------------------------------------
PRINTED_NONE = 1e-9  # What is smaller than this part is rounding: shown as 0, or not drawn.
#: The same where forces are those of least norm, found among many by a softened solve.
PRINTED_NONE_REDUNDANT = 1e-7
#: The same of moments, internal loads and losses, and of coefficients of equations.
PRINTED_NONE_FINE = 1e-12
DRAWN_DIRECTION_LEAST = 1e-9  # Least part of a direction along an axis that is divided by.
#: What differs by no more than this part of the peak is the same history.
DRAWN_HISTORY_SAME = 1e-12
DRAWN_CONSTANT = 1e-8  # Part of its size by which a constant may differ.
DRAWN_OUTLINE = 1e-3  # Part of its size within which corners of an outline are left out.
#: In model lengths and radians, a motion that ends so near to its beginning returns; places are
#: one.
DRAWN_RETURNS = 1e-6
DOCTOR_ROUNDING = 1e-12  # How far a processor may round the torque of the self-test, relative.
DRAWN_SERIES_SAME = 1e-9  # Series that differ by no more are drawn as one.
ROUND_NUMBER_SLACK = 1e-9  # What rounding may take from a round number of a scale, in its steps.
REPORT_SIZES_ALIKE = 1e-3  # Histories whose sizes differ by less than this part are told once.
