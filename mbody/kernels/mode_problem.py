"""How closed contacts and frictional joints go on, and what impulses they have at an impact.

`ContactDecision` holds one complementarity problem of all rows: normals of closed contacts, then
tangents. It is solved part by part of what is connected (`mbody.kernels.complementarity`), so that
no scale of one part reaches another. With velocities in place of accelerations and impulses in
place of forces the same problem is an impact, impulses of reactions limiting friction of joints.
Poisson: compression by the problem, then expansion with e Λ_N given, limits by all of it.
"""

from __future__ import annotations

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.tolerances import (
    COMPLEMENTARITY_SHIFT,
    CONTACT_ACCELERATION_NONE,
    CONTACT_ACCELERATION_ROUNDING,
    CONTACT_IMPULSES_DEPENDENT,
    MACHINE_EPSILON,
    ROWS_DEPENDENT,
    TINY,
)
from mbody.kernels.complementarity import (
    COMPLETE,
    CONE,
    MOST_SOLUTIONS,
    NORMALS,
    RESIDUAL,
    ROWS,
    ContactProblem,
    contact_solutions,
    eliminate,
    power_of_two,
)

#: Numbers in `ContactDecision.count`: rows, normals, parts, whether all sets of modes were tried.
ALL_ROWS, ALL_NORMALS, PARTS, TRIED = range(4)
#: Numbers in `ContactDecision.refinements`: of responses, and of states that are evaluated.
OF_RESPONSES, EVALUATED = range(2)
#: What `solve_decision` does: find modes; take one, or one with the kinetic friction of what begins
#: to slide; impulses of an impact, of one without collision, of one of its stages.
FIND, TAKE, BEGIN, IMPACT, WITHOUT_COLLISION, STAGE = range(6)
#: Sweeps of Jacobi's rotations, at most; it takes less than ten.
SWEEPS = 40


class ContactDecision(Bundle):
    """Memory of the problem of all rows at one instant, at most n of them.

    `delassus`, `c`, `f0`, `without`: Delassus's matrix; accelerations along the rows with forces
      f0, and without them.
    `noise`, `soft` (n,): Rounding of c; the diagonal without joints.
    `law`, `normal`, `mu`, `arm`, `at`, `by_force`, `sliding`, `given`: As of `ContactProblem`; `at`
      are multipliers with the forces f0.
    `kinetic` (n,), `kinetic_mu`, `kinetic_arm`: Whether a tangent has another friction once it
      slides, and this.
    `slip` (n,): Direction of what slides by its kinetic friction in the present trial, else zero.
    `kept_slip` (n,): Of an earlier trial; of impacts that of teeth, which press apart at rest.
    `part`, `parts_count` (n,): The part of each row; solutions of each part.
    `own_f`, `own_w`, `own_mode` (MOST_SOLUTIONS + 1, n): Those of every part, each part by itself,
      that of the trial last.
    `order` (MOST_SOLUTIONS,): In which they are taken.
    `outcomes` (n,): How many velocities after an impact solve the part of each row.
    `R`, `Y` (n, coordinates), `X` (n, 2 nodes): Rows, and how velocities and multipliers respond to
      them; `owner`, `pair` (n,): whose they are, −1 of teeth, and friction pairs of joints.
    `f`, `w`, `mode` (n,): The solution that is taken.
    `worst` (1,): The greatest residual of the parts.
    `regularization` (1,), `refinements` (2,): Of the factor of the joints, and of what it solves.
    """

    count: Ints
    law: Ints
    normal: Ints
    kinetic: Ints
    part: Ints
    parts_count: Ints
    outcomes: Ints
    members: Ints
    place: Ints
    order: Ints
    mode: Ints
    owner: Ints
    pair: Ints
    own_mode: Ints
    mu: Floats
    kinetic_mu: Floats
    arm: Rows
    kinetic_arm: Rows
    at: Rows
    by_force: Stacks
    sliding: Floats
    given: Floats
    slip: Floats
    kept_slip: Floats
    delassus: Rows
    c: Floats
    f0: Floats
    without: Floats
    noise: Floats
    soft: Floats
    own_f: Rows
    own_w: Rows
    f: Floats
    w: Floats
    terms: Floats
    dense: Rows
    vectors: Rows
    impulse: Floats
    more: Floats
    before: Floats
    shifted: Floats
    given_law: Floats
    restitution: Floats
    newton: Ints
    worst: Floats
    regularization: Floats
    refinements: Ints
    R: Rows
    Y: Rows
    X: Rows


def decision_memory(n: int, coordinates: int = 0, nodes: int = 0) -> ContactDecision:
    """A problem of at most n rows; of a system with its coordinates and nodes."""
    kept = MOST_SOLUTIONS + 1
    shapes = {
        "arm": (n, 6),
        "kinetic_arm": (n, 6),
        "at": (n, 2),
        "by_force": (n, 2, n),
        "delassus": (n, n),
        "own_f": (kept, n),
        "own_w": (kept, n),
        "dense": (n, n + 1),
        "vectors": (n, n),
        "count": (4,),
        "worst": (1,),
        "regularization": (1,),
        "refinements": (2,),
        "R": (n, coordinates),
        "Y": (n, coordinates),
        "X": (n, 2 * nodes),
        "order": (MOST_SOLUTIONS,),
        "own_mode": (kept * n,),
    }
    arrays = {}
    for name, kind in ContactDecision.__annotations__.items():
        number = np.int64 if kind == "Ints" else np.float64
        arrays[name] = np.zeros(shapes.get(name, (n,)), dtype=number)
    return ContactDecision(**arrays)


# -- Parts -------------------------------------------------------------------------------------


@inline
def linked(D, r, c):
    """Whether row r tells of row c."""
    if D.delassus[r, c] != 0.0:
        return True
    if r < D.count[ALL_NORMALS]:
        return False
    if D.law[r] == CONE:
        return D.normal[r] == c
    return D.by_force[r, 0, c] != 0.0 or D.by_force[r, 1, c] != 0.0


@njit
def find_parts(D):
    """D.part ← the number of the connected part of each row, in the order of their first rows."""
    n, parts = D.count[ALL_ROWS], 0
    for r in range(n):
        D.part[r] = -1
    for first in range(n):
        if D.part[first] >= 0:
            continue
        D.part[first], reached, done = parts, 1, 0
        D.members[0] = first
        while done < reached:
            r = D.members[done]
            done += 1
            for c in range(n):
                if D.part[c] < 0 and (linked(D, r, c) or linked(D, c, r)):
                    D.part[c], D.members[reached] = parts, c
                    reached += 1
        parts += 1
    D.count[PARTS] = parts


@njit
def without_forces(D):
    """D.without ← accelerations without the forces f0."""
    n = D.count[ALL_ROWS]
    for r in range(n):
        total = 0.0
        for c in range(n):
            total += D.delassus[r, c] * D.f0[c]
        D.without[r] = D.c[r] - total


@inline
def slides_now(D, r):
    """The direction in which tangent r slides in the present trial, zero at rest."""
    return D.slip[r] if D.slip[r] != 0.0 else D.sliding[r]


@njit
def take_part(D, P, part):
    """P ← the problem of one part; returns the number of its rows, D.members."""
    n, m, k = D.count[ALL_ROWS], D.count[ALL_NORMALS], 0
    P.count[NORMALS] = 0
    for r in range(n):
        if D.part[r] == part:
            D.members[k], D.place[r] = r, k
            k += 1
            P.count[NORMALS] += 1 if r < m else 0
    P.count[ROWS] = k
    for i in range(k):
        r = D.members[i]
        P.c[i], P.noise[i], P.soft[i] = D.without[r], D.noise[r], D.soft[r]
        P.sliding[i] = P.given[i] = 0.0
        for j in range(k):
            P.D[i, j] = D.delassus[r, D.members[j]]
        if r < m:
            continue
        begun = D.slip[r] != 0.0 and D.kinetic[r] == 1
        P.sliding[i], P.law[i], P.normal[i] = slides_now(D, r), D.law[r], -1
        if D.law[r] == CONE:
            P.normal[i] = D.place[D.normal[r]]
            P.mu[i], P.given[i] = D.kinetic_mu[r] if begun else D.mu[r], D.given[r]
            continue
        for s in range(6):
            P.arm[i, s] = D.kinetic_arm[r, s] if begun else D.arm[r, s]
        for s in range(2):
            total = 0.0
            for c in range(n):
                total += D.by_force[r, s, c] * D.f0[c]
            P.pressing[i, s] = D.at[r, s] - total
            for j in range(k):
                P.by_force[i, s, j] = D.by_force[r, s, D.members[j]]
    return k


@njit
def least_pressing_first(D, P, count):
    """D.order ← the solutions of a part in the order of the sums of their contact forces."""
    for i in range(count):
        D.order[i] = j = i
        while j > 0 and pressing(P, D.order[j - 1]) > pressing(P, i):
            D.order[j] = D.order[j - 1]
            j -= 1
        D.order[j] = i


@inline
def pressing(P, i):
    """The sum of the contact forces of solution i."""
    total = 0.0
    for r in range(P.count[NORMALS]):
        total += P.f[i, r]
    return total


@njit
def keep_part(D, P, k, i, at):
    """Keep solution i of a part of k rows as number `at`. What would slide from rest by rounding
    of what cancels there, or by what is left of the laws, does not begin to.
    """
    m, n = D.count[ALL_NORMALS], D.own_f.shape[1]
    none = max(CONTACT_ACCELERATION_NONE, P.number[RESIDUAL])
    for j in range(k):
        r = D.members[j]
        D.own_f[at, r], D.own_w[at, r] = P.f[i, j], P.w[i, j]
        mode = P.mode[i * k + j]
        if r >= m and slides_now(D, r) == 0.0:
            total = 0.0
            for c in range(k):
                total += abs(D.delassus[r, D.members[c]]) * abs(P.f[i, c])
            if not abs(P.w[i, j]) > none * (abs(D.without[r]) + total):
                mode = 0
        D.own_mode[at * n + r] = mode


@njit
def solve_parts(D, P, every, trial):
    """D.own_f, D.own_w, D.own_mode ← solutions of all parts; of a `trial` one of each, as number
    MOST_SOLUTIONS. Returns how many solutions with different accelerations there are: another one
    differs in one of the parts.
    """
    whole, complete = 1, 1
    for part in range(D.count[PARTS]):
        k = take_part(D, P, part)
        count = contact_solutions(P, every)
        complete = min(complete, P.count[COMPLETE])
        if every or not trial:
            D.parts_count[part] = count
        if not trial:
            D.count[TRIED] = complete
        if count == 0:
            return 0
        least_pressing_first(D, P, count)
        whole += count - 1
        if trial:
            keep_part(D, P, k, D.order[0], MOST_SOLUTIONS)
            continue
        for i in range(count if every else 1):
            keep_part(D, P, k, D.order[i], i)
    return whole


@njit
def find_solutions(D, P, every):
    """How many solutions there are, to be taken one after the other; of `every` set of modes."""
    for r in range(D.count[ALL_ROWS]):
        D.slip[r] = 0.0
    D.count[TRIED] = 1
    find_parts(D)
    without_forces(D)
    return solve_parts(D, P, every, False)


@njit
def take_solution(D, number):
    """D.f, D.w, D.mode ← a solution of all: the first of each part, then, part by part, each of
    its others; MOST_SOLUTIONS of every part for number −1.
    """
    n, which, other, left = D.own_f.shape[1], -1, 0, number
    for part in range(D.count[PARTS] if number > 0 else 0):
        if which < 0 and left <= D.parts_count[part] - 1:
            which, other = part, left
        left -= D.parts_count[part] - 1
    for r in range(D.count[ALL_ROWS]):
        at = other if D.part[r] == which else 0
        if number < 0:
            at = MOST_SOLUTIONS
        D.f[r], D.w[r], D.mode[r] = D.own_f[at, r], D.own_w[at, r], D.own_mode[at * n + r]


# -- Kinetic friction of what begins to slide --------------------------------------------------


@njit
def begin_sliding(D, P):
    """D.f, D.w, D.mode ← the solution in them with the kinetic friction of what begins to slide, as
    it goes on; unchanged where none is found. A sequence of trials that comes back to one of them
    (Brent) finds none.
    """
    n, m, power, length = D.count[ALL_ROWS], D.count[ALL_NORMALS], 1, 0
    any_slips = False
    for r in range(n):
        D.slip[r] = float(D.mode[r]) if r >= m and D.kinetic[r] == 1 else 0.0
        D.kept_slip[r] = D.slip[r]
        any_slips = any_slips or D.slip[r] != 0.0
    found = False
    while any_slips and not found:
        if solve_parts(D, P, False, True) == 0:
            break
        found, any_slips, again = next_slips(D, n, m)
        if length == power and not again:
            power, length = 2 * power, 0
            for r in range(n):
                D.kept_slip[r] = D.slip[r]
            continue
        length += 1
        if again:
            break
    for r in range(n):
        D.slip[r] = 0.0
    if found:
        take_solution(D, -1)


@inline
def turns_back(D, r, slip):
    """Whether tangent r moves against the sliding by the last trial."""
    terms = abs(D.without[r])
    for c in range(D.count[ALL_ROWS]):
        terms += abs(D.delassus[r, c]) * abs(D.own_f[MOST_SOLUTIONS, c])
    return slip * D.own_w[MOST_SOLUTIONS, r] < -CONTACT_ACCELERATION_NONE * terms


@njit
def next_slips(D, n, m):
    """D.slip ← directions of what slides by the last trial. Whether they are the same; whether
    anything slides; whether they are those kept.
    """
    same, some, again, at, width = True, False, True, MOST_SOLUTIONS, D.own_f.shape[1]
    for r in range(m, n):
        if D.kinetic[r] == 0:
            continue
        slip = D.slip[r]
        now = float(D.own_mode[at * width + r])
        if slip != 0.0:
            now = 0.0 if turns_back(D, r, slip) else slip
        same, some = same and now == slip, some or now != 0.0
        D.slip[r] = now
        again = again and now == D.kept_slip[r]
    return same, some, again and not same


# -- Impulses ----------------------------------------------------------------------------------


@inline
def diagonal_unit(D, n):
    """The power of two above the first number on the diagonal: unlike its root, dividing by it
    changes no digit.
    """
    for r in range(n):
        if D.delassus[r, r] > 0.0:
            return 2.0 * power_of_two(D.delassus[r, r])
    return 1.0


@njit
def solve_impulses(D, P, every, x):
    """x ← impulses from velocities D.shifted without them, with normal impulses D.given_law that
    count in the cones; whether there are any. D.outcomes where `every` set of modes is tried.
    """
    n, m, some = D.count[ALL_ROWS], D.count[ALL_NORMALS], False
    for r in range(n):
        D.c[r], D.f0[r], D.slip[r], D.sliding[r] = D.shifted[r], 0.0, 0.0, 0.0
    for r in range(m, n):
        cone = D.law[r] == CONE
        D.sliding[r] = own_sliding(D, r)
        for k in range(m):
            if D.sliding[r] == 0.0 and (not cone or D.normal[r] == k):
                D.sliding[r] = stops_at_once(D, r, k)
        some = some or D.sliding[r] != own_sliding(D, r)
        D.given[r] = D.given_law[D.normal[r]] if cone else 0.0
        for s in range(0 if cone else 2):
            D.at[r, s] = 0.0
            for c in range(m):
                D.at[r, s] += D.by_force[r, s, c] * D.given_law[c]
    without_forces(D)
    found = solve_parts(D, P, every, True) > 0
    while some:
        some = leave_sliding(D, not found)
        if some:
            found = solve_parts(D, P, every, True) > 0
    for r in range(n if found else 0):
        x[r] = D.own_f[MOST_SOLUTIONS, r]
        if every:
            D.outcomes[r] = max(D.outcomes[r], D.parts_count[D.part[r]])
    return found


@inline
def own_sliding(D, r):
    """The direction of sliding that tangent r has in any impact; zero but of teeth."""
    return 0.0 if D.law[r] == CONE else D.kept_slip[r]


@inline
def stops_at_once(D, r, k):
    """The direction of sliding of tangent r where it slides by the motion that approaches at normal
    k, as the end of a rod on a pin: both stop together, until when it slides; else zero.
    """
    N, T, C, fastest = D.delassus[k, k], D.delassus[r, r], D.delassus[k, r], 0.0
    one = N * T > 0.0 and N * T - C * C <= ROWS_DEPENDENT * N * T and D.shifted[k] < -D.noise[k]
    along, across = D.shifted[r] * N, D.shifted[k] * C
    if not one or abs(along - across) > ROWS_DEPENDENT * abs(across):
        return 0.0
    for c in range(D.count[ALL_ROWS]):
        if D.part[c] == D.part[k] and D.delassus[c, c] > 0.0:
            fastest = max(fastest, abs(D.shifted[c]) * np.sqrt(N / D.delassus[c, c]))
    # of what rests rounding approaches
    if -D.shifted[k] <= CONTACT_ACCELERATION_ROUNDING * fastest:
        return 0.0
    return 1.0 if along > 0.0 else -1.0 if along < 0.0 else 0.0


@njit
def leave_sliding(D, every):
    """What does not slide until it stops rests, or turns, as friction lets it: what the last trial
    turns back, or `every` one. Whether there is any.
    """
    some = False
    for r in range(D.count[ALL_NORMALS], D.count[ALL_ROWS]):
        own, slip = own_sliding(D, r), D.sliding[r]
        if slip != own and (every or turns_back(D, r, slip)):
            D.sliding[r], some = own, True
    return some


@njit
def impact(D, P):
    """D.impulse ← impulses of an impact with velocities D.before, D.restitution and whether they
    follow Newton's law, D.newton, by normals; whether there is a solution.

    Newton: γ_N⁺ = −e γ_N⁻ where a contact takes part; else Poisson's.
    """
    n, m, some = D.count[ALL_ROWS], D.count[ALL_NORMALS], False
    find_parts(D)
    for r in range(n):
        D.shifted[r] = D.before[r]
        if r < m:
            D.given_law[r] = 0.0
            if D.newton[r] == 1:
                D.shifted[r] += D.restitution[r] * min(D.before[r], 0.0)
    if not solve_impulses(D, P, True, D.impulse):
        return False
    for r in range(m):
        D.given_law[r] = 0.0 if D.newton[r] == 1 else D.restitution[r] * D.impulse[r]
        some = some or D.given_law[r] != 0.0
    if not some:
        return True
    # expansion: Λ_N = given + more, Λ_T within the cone of all of it
    # what follows Newton's law has its velocity already
    for r in range(n):
        total = 0.0
        for c in range(n):
            total += D.delassus[r, c] * (D.impulse[c] + (D.given_law[c] if c < m else 0.0))
        D.shifted[r] += total
    if not solve_impulses(D, P, True, D.more):
        return False
    for r in range(n):
        D.impulse[r] += D.more[r] + (D.given_law[r] if r < m else 0.0)
    return True


@njit
def impact_without_collision(D, P):
    """D.impulse ← impulses where nothing approaches and yet no accelerations are consistent: those
    of the modes that a little more approach has, without it; whether there are any.
    """
    n, m, fastest, largest = D.count[ALL_ROWS], D.count[ALL_NORMALS], 0.0, 0.0
    find_parts(D)
    for r in range(n):
        fastest = max(fastest, abs(D.before[r]))
        if r < m:
            D.given_law[r] = 0.0
            largest = max(largest, np.sqrt(max(D.delassus[r, r], TINY)))
    for r in range(n):
        D.c[r], D.f0[r], D.slip[r], D.sliding[r], D.given[r] = D.before[r], 0.0, 0.0, 0.0, 0.0
        if r < m:
            size = np.sqrt(max(D.delassus[r, r], TINY)) / largest
            D.c[r] -= COMPLEMENTARITY_SHIFT * fastest * size
    without_forces(D)
    if solve_parts(D, P, False, True) == 0:
        return False
    take_solution(D, -1)
    return impulses_of_modes(D, D.before, D.impulse)


@njit
def sticks(D, r):
    """Whether a tangential row of an impact is held: by a contact point that is closed, or one that
    has an impulse given.
    """
    normal = D.normal[r]
    presses = D.law[r] == CONE and (D.mode[normal] == 1 or D.given_law[normal] > 0.0)
    return presses and D.mode[r] == 0


@njit
def impulses_of_modes(D, rates, x):
    """x ← impulses from velocities by the linear equations of D.mode, without friction of joints;
    False where rows depend on each other.
    """
    n, m = D.count[ALL_ROWS], D.count[ALL_NORMALS]
    M, unit = D.dense, diagonal_unit(D, n)
    for r in range(n):
        D.terms[r] = 1.0 / np.sqrt(max(D.delassus[r, r] / unit, TINY))
    for r in range(n):
        cone = r >= m and D.law[r] == CONE
        holds = sticks(D, r) if r >= m else D.mode[r] == 1
        for c in range(n):
            M[r, c] = D.terms[r] * (D.delassus[r, c] / unit) * D.terms[c] if holds else 0.0
        M[r, n] = -D.terms[r] * rates[r] / unit if holds else 0.0
        if holds:
            continue
        M[r, r] = 1.0
        if cone and D.mode[r] != 0:
            k = D.normal[r]
            M[r, k] += float(D.mode[r]) * D.mu[r] * D.terms[k] / D.terms[r]
    if not eliminate(M, n):
        return False
    for r in range(n):
        x[r] = D.terms[r] * M[r, n]
    return True


# -- Impulses of least norm --------------------------------------------------------------------


@njit
def rotate_to_diagonal(A, V, n):
    """A ← V⁻¹ A V diagonal of a symmetric matrix, V its orthonormal vectors in columns, by Jacobi's
    rotations.
    """
    for r in range(n):
        for c in range(n):
            V[r, c] = 1.0 if r == c else 0.0
    for _ in range(SWEEPS):
        rotated = False
        for p in range(n):
            for q in range(p + 1, n):
                off = A[p, q]
                least = MACHINE_EPSILON * np.sqrt(abs(A[p, p] * A[q, q]))
                if abs(off) <= max(least, TINY):
                    continue
                rotated = True
                theta = 0.5 * (A[q, q] - A[p, p]) / off
                t = 1.0 / (abs(theta) + np.sqrt(1.0 + theta * theta))
                t = -t if theta < 0.0 else t
                c = 1.0 / np.sqrt(1.0 + t * t)
                s = t * c
                for k in range(n):
                    x, y = A[k, p], A[k, q]
                    A[k, p], A[k, q] = c * x - s * y, s * x + c * y
                for k in range(n):
                    x, y = A[p, k], A[q, k]
                    A[p, k], A[q, k] = c * x - s * y, s * x + c * y
                    x, y = V[k, p], V[k, q]
                    V[k, p], V[k, q] = c * x - s * y, s * x + c * y
        if not rotated:
            return


@inline
def arrest_unit(D, first, n):
    """The power of two above the first number on the diagonal of these rows."""
    unit = 1.0
    for r in range(first + n - 1, first - 1, -1):
        if D.delassus[r, r] > 0.0:
            unit = 2.0 * power_of_two(D.delassus[r, r])
    return unit


@njit
def prepare_arrest(D, first, n):
    """D.dense, D.vectors ← eigenvalues and eigenvectors of n rows of Delassus's matrix, of which
    D.terms are the scales.
    """
    unit = arrest_unit(D, first, n)
    for r in range(n):
        own = D.delassus[first + r, first + r]
        D.terms[r] = 1.0 / np.sqrt(own / unit) if own > 0.0 else 0.0
    for r in range(n):
        for c in range(n):
            part = D.delassus[first + r, first + c] / unit
            D.dense[r, c] = D.terms[r] * part * D.terms[c]
    rotate_to_diagonal(D.dense, D.vectors, n)


@njit
def arrested(D, first, n, rates, x):
    """x ← impulses −D⁺ rates that stop n rows after `prepare_arrest`; of least scaled norm where
    rows depend on each other.
    """
    A, V, unit, greatest = D.dense, D.vectors, arrest_unit(D, first, n), 0.0
    for k in range(n):
        x[k], greatest = 0.0, max(greatest, abs(A[k, k]))
    for k in range(n):
        if abs(A[k, k]) <= CONTACT_IMPULSES_DEPENDENT * greatest:
            continue
        part = 0.0
        for r in range(n):
            part -= V[r, k] * D.terms[r] * rates[r] / unit
        part /= A[k, k]
        for r in range(n):
            x[r] += D.terms[r] * V[r, k] * part


@njit
def arresting_impulses(D, first, n, rates, x):
    """x ← impulses that stop n rows from the first on; see `arrested`."""
    prepare_arrest(D, first, n)
    arrested(D, first, n, rates, x)


# -- As Python calls them ----------------------------------------------------------------------


@kernel
def solve_decision(D: ContactDecision, P: ContactProblem, task: int, number: int) -> int:
    """FIND: how many solutions there are, of every set of modes unless `number` is zero.
    TAKE, BEGIN: D.f, D.w, D.mode ← solution `number`.
    IMPACT, WITHOUT_COLLISION, STAGE: D.impulse ← impulses, of a stage from velocities D.shifted
    with normal impulses D.given_law beside, whose modes are taken; whether there are any.
    """
    if task == FIND:
        return find_solutions(D, P, number != 0)
    found = True
    if task <= BEGIN:
        take_solution(D, number)
        if task == BEGIN:
            begin_sliding(D, P)
    elif task == IMPACT:
        found = impact(D, P)
    elif task == WITHOUT_COLLISION:
        found = impact_without_collision(D, P)
    else:
        find_parts(D)
        found = solve_impulses(D, P, True, D.impulse)
        if found:
            take_solution(D, -1)
    return 1 if found else 0


@kernel
def find_arrest(D: ContactDecision, rates: Floats, x: Floats) -> None:
    """x ← impulses of least norm that stop all rows."""
    arresting_impulses(D, 0, D.count[ALL_ROWS], rates, x)
