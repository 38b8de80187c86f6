"""Tables of shapes that may touch, of the contacts of one step, and of the steps themselves.

A shape is a circle, an endless line, a segment or a convex polygon of one body, all numbers from
the mass centre in link axes. Corners of polygons go round counter-clockwise, so that outside is on
the right of each edge; a segment is a polygon of two corners, its first edge faces what touches it.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Tables

__all__ = [
    "CIRCLE",
    "LINE",
    "POLYGON",
    "SEGMENT",
    "ContactShapes",
    "ContactWork",
    "ImpulseSteps",
    "InteriorWork",
]

#: Kinds of shapes.
CIRCLE, LINE, SEGMENT, POLYGON = range(4)


class ContactShapes(Bundle):
    """What may touch what.

    Attributes
    ----------
    kind, body : arrays (shapes,)
        Kind and body of each shape.
    corner_start : array (shapes + 1,)
        Where the corners of each are.
    corner : array (corners, 2)
        Corners from the mass centre.
    centre : array (shapes, 2)
        Of the bounding circle: of a circle itself; of a line its point.
    reach : array (shapes,)
        Radius of the bounding circle, infinite of lines.
    radius : array (shapes,)
        Of circles: zero of points, negative of rings.
    along : array (shapes, 2)
        Direction of lines; what touches is on their left.
    large : array (shapes,)
        Whether it is looked at beside all others instead of in the grid.
    usual : array (1,)
        The radius that is usual among the others.
    group : array (shapes,)
        The sets of groups that it is in, by number; −1 in none.
    group_law : array (sets, sets)
        The law between shapes of two such sets, the first as i; −1 where none is.
    pair : array (pairs, 3)
        Shapes i and j of the contacts that are named one by one, and their laws.
    rope : array (ropes, 3)
        Bodies i and j of ropes, and their laws.
    rope_number : array (ropes, 5)
        Arms of both ends, and the length.
    law : array (laws, 3)
        Kinetic and static friction, restitution.
    tied_start, tied : arrays (bodies + 2,), (ties,)
        Bodies that joints tie to each: no group makes contacts between these.
    """

    kind: Ints
    body: Ints
    corner_start: Ints
    corner: Rows
    centre: Rows
    reach: Floats
    radius: Floats
    along: Rows
    large: Ints
    usual: Floats
    group: Ints
    group_law: Tables
    pair: Tables
    rope: Tables
    rope_number: Rows
    law: Rows
    tied_start: Ints
    tied: Ints


class ContactWork(Bundle):
    """Contacts of a step, at most as many as there is memory for.

    Attributes
    ----------
    who : array (most, 6)
        Bodies i and j, law, shapes i and j, feature (which corner on which edge).
    geometry : array (most, 8)
        Normal from i to j, arms of the contact on i and on j, gap, size of the smaller shape.
    effect : array (most, 7)
        D_NN, D_NT, D_TT of the contact itself; coefficient of friction; what γ_N⁺ must be at
        least, negative, of velocities and of the correction of positions; s of its cone.
    impulse, kept, ahead : arrays (most, 2)
        (P_N, P_T), those before a sweep, and the direction in which the solver goes on.
    rate : array (most, 2)
        (γ_N, γ_T) at the beginning of the step.
    shift : array (most,)
        Impulses of the correction of positions.
    column : array (most,)
        Which pair of `response` it has, −1 where joints tie neither body.
    response : array (columns, coupled coordinates)
        Velocities by unit impulses.
    coupled : array (coupled coordinates,)
        Which coordinates of bodies these are.
    is_coupled : array (bodies + 1,)
        Whether joints or drivers act on a body.
    inverse : array (coordinates + 3,)
        Inverse masses, zero of the ground.
    velocity, free, start, moved : arrays (coordinates + 3,)
        As impulses change it; without contacts; at the beginning of a step; what a correction of
        positions moves.
    row_rate, row_impulse : arrays (2·nodes,)
        Rates of the rows of joints at the beginning, and their impulses.
    old, old_impulse : arrays (most, 3), (most, 2)
        Shapes and feature of the contacts of the step before, and their impulses.
    old_slot : array (places,)
        Where they are found by hashing.
    place : array (shapes, 2)
        Centres of bounding circles.
    margin : array (shapes,)
        How far a shape may come in a step.
    turning : array (shapes,)
        How far it may turn.
    cell : array (shapes, 2)
        Its cell of the grid.
    following : array (shapes,)
        The next shape in the same bucket.
    bucket : array (buckets,)
        The first shape of each.
    progress : array (2,)
        The last change of impulses as a part of the greatest, and the greatest.
    counts : array (3,)
        See `mbody.kernels.contact_geometry`.
    """

    who: Tables
    geometry: Rows
    effect: Rows
    impulse: Rows
    kept: Rows
    ahead: Rows
    rate: Rows
    shift: Floats
    column: Ints
    response: Rows
    coupled: Ints
    is_coupled: Ints
    inverse: Floats
    velocity: Floats
    free: Floats
    start: Floats
    moved: Floats
    row_rate: Floats
    row_impulse: Floats
    old: Tables
    old_impulse: Rows
    old_slot: Ints
    place: Rows
    margin: Floats
    turning: Floats
    cell: Tables
    following: Ints
    bucket: Ints
    progress: Floats
    counts: Ints


class InteriorWork(Bundle):
    """Memory of the interior-point method.

    Attributes
    ----------
    matrix : array
        Row blocks of bodies, see `mbody.kernels.body_blocks`.
    place, order : arrays (bodies,)
        Number of each body in the matrix, and the body of each number, backward.
    first, offset : arrays (bodies,), (bodies + 1,)
        The first body of each row block, and where it begins.
    start, neighbour : arrays (bodies + 1,), (2·(most + ties),)
        Bodies that each touches or is tied to.
    tied : array (ties, 2)
        Pairs of bodies that rows of joints tie.
    row_start, row_body, row_block : arrays (2·nodes + 1,), (parts,), (parts,)
        Rows of joints: bodies, and where the three numbers of each are in `Work.block`.
    stiffness, pull, old_pull, rate : arrays (2·nodes,)
        Of each row: stiffness, impulse beside that without contacts, the same of the step before,
        and how far its rate is off.
    dual, slack, dual_step, slack_step, target, lack : arrays (most, 2)
        Multipliers of both sides of a cone, slacks, their steps; what the change of a product is to
        be, and what is left of the equation of a slack.
    rest, step : arrays (coordinates + 3,)
        What is left of the equation of motion; forces, then the step of velocities.
    sorted : array (coordinates,)
        Numbers in the order of the matrix.
    count : array (2,)
        See `mbody.kernels.contact_interior`.
    """

    matrix: Floats
    place: Ints
    order: Ints
    first: Ints
    offset: Ints
    start: Ints
    neighbour: Ints
    tied: Tables
    row_start: Ints
    row_body: Ints
    row_block: Ints
    stiffness: Floats
    pull: Floats
    old_pull: Floats
    rate: Floats
    dual: Rows
    slack: Rows
    dual_step: Rows
    slack_step: Rows
    target: Rows
    lack: Rows
    rest: Floats
    step: Floats
    sorted: Floats
    count: Ints


class ImpulseSteps(Bundle):
    """Steps of one motion by impulses.

    Attributes
    ----------
    length : float
        Of a step.
    tolerance : float
        Change of impulses, as a part of the greatest one, at which sweeps end.
    sweeps : int
        At most, of one step of few contacts.
    few : int
        Contacts up to which sweeps follow the sliding; a step in which these do not converge is
        solved elsewhere.
    regularization : float
        Of redundant rows.
    refinements : int
        Corrections by the residual of the rows of joints.
    y, last : arrays (2·coordinates + own states,)
        State, and that before the step.
    change : array (coordinates,)
        (v⁺ − v)/h of the step, before velocities are projected.
    loads : array (causes, coordinates)
        Forces of each load, and their sum in the last row.
    work : array (causes,)
        Work since the beginning: of loads, drivers, laws of contact.
    work_before : array (causes,)
        The same before the step.
    residual : array (4,)
        Of the equation of a step: greatest part left, greatest term, power left, sum of all power.
    state : array
        See `mbody.kernels.moreau`.
    """

    length: float
    tolerance: float
    sweeps: int
    few: int
    regularization: float
    refinements: int
    y: Floats
    last: Floats
    change: Floats
    loads: Rows
    work: Floats
    work_before: Floats
    residual: Floats
    state: Floats
