"""Explicit Runge–Kutta integrator of one free motion, each step ended by a projection.

Every step ends with the projection of position and velocity onto Φ = 0 and Φ_q v = ν in the metric
of the masses (`mbody.kernels.loop_closure`), and the next begins with the derivative there.
Between, stages run off the manifold by as much as their error. That is harmless but near a singular
position, where the right-hand side has no smooth continuation off the manifold: there every stage
is projected too, a = f(P(y)), with the refinements that nearly dependent rows want, and the error
is taken of what a projection keeps. Neither the multipliers, which grow without bound there, nor
the noise across the manifold then decide the length of a step.

What a step of one motion and steps on lanes have in common is `mbody.kernels.dense_output`;
why the loops are two is explained in `mbody.kernels.runge_kutta_lanes`.

Hairer, Nørsett, Wanner: Solving Ordinary Differential Equations I, II.5 and II.6 (the methods), and
II, IV.2 (how stiffness shows); Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4
(projection).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import larger, ld, select_le, st
from mbody.core.tolerances import (
    ACCELERATION_ROUNDING,
    ACCELERATION_ROUNDING_NEAREST,
    CONDITIONING_CLOSE,
    CONDITIONING_NEAR_SINGULAR,
    CONDITIONING_NO_END,
    FINITE,
    PROJECTION_GREATEST,
    PROJECTION_SURE,
    SINGULAR_STEP_BACK,
    SINGULAR_STEP_BEFORE,
    SINGULAR_STEP_TWICE,
    SINGULAR_TIME_SHORTEST,
    STEP_ERROR_NONE,
    STEP_INTERPOLATION_DOUBTFUL,
    STEP_RATE_FADING,
    STEP_SAFETY,
    STEP_SAFETY_NEAR_SINGULAR,
    STEP_STIFF_LIMIT,
    STEP_STIFF_SMOOTH,
    TIME_END_ROUNDING,
    TIME_STEP_SHORTEST,
    TIME_STEP_SHORTEST_REJECTED,
    TINY,
)
from mbody.kernels.layout import Layout, Work, keep
from mbody.kernels.loop_closure import (
    least_conditioning,
    may_be_singular,
    record_accepted,
    sample_conditioning,
    tangential_part,
)
from mbody.kernels.state_derivative import state_derivative
from mbody.kernels.step_state import (
    ARTIFICIAL_ENERGY,
    ARTIFICIAL_LIMIT,
    BEST_CONDITIONING,
    BRANCH_UNCERTAIN,
    CONDITIONING,
    CROSSING_TIME,
    DECIDE_BELOW,
    DELIVERED,
    DONE,
    END_TRIES,
    EVALUATIONS,
    FASTEST,
    LAST_STEP,
    LAST_STEP_ALLOWED,
    LIMITED_INSTANTS,
    LONGEST_STEP,
    MORE,
    NEAR_SINGULAR,
    NEAR_SINGULAR_STEPS,
    NEXT,
    NOT_FINITE,
    REJECTED,
    SHORTENED_UNTIL,
    SMOOTH_COUNT,
    STAGE_TRIES,
    STEP_VANISHED,
    STEPS,
    STIFF,
    STIFF_COUNT,
    THROUGHPUT,
    TIME,
    TRIED,
    TRIED_CONDITIONING,
    TRIED_END,
    TRIED_GROWTH,
    TRIED_LEAST,
    TRIED_LEAST_AT,
    TRIED_LENGTH,
    Outputs,
    Stepping,
    Tolerances,
)

# -- Runge–Kutta methods as tables of coefficients: explicit ones, Radau IIA, and compositions -


class Explicit(Bundle):
    """An explicit method with an error estimate and a polynomial between its steps.

    Attributes
    ----------
    A (rows, rows), B (stages,), C (rows,) : arrays
        Coefficients, weights and nodes; row `stages` is the end of the step, what follows is for
        the polynomial alone.
    E : array (2, stages) or (2, stages + 1)
        Weights of an error of low order, which damps the second, and of the second; they may take
        the derivative at the end.
    D : array (polynomials, rows)
        Weights of the rows of the polynomial beyond the third.
    order : float
        The power of the step with which the error of one step falls.
    stable : float
        h |λ| at which stability limits steps.
    sample : array (stages + 1,)
        Which sample of the step (see `mbody.kernels.loop_closure`) each row is, the first
        being 0; of rows that are none 0.
    at : array (samples,)
        The nodes of the samples.
    """

    A: Rows
    B: Floats
    C: Floats
    E: Rows
    D: Rows
    order: float
    stable: float
    sample: Ints
    at: Floats


#: Rows of A by their entries that are not zero.
_A = {
    1: {0: 0.05260015195876773},
    2: {0: 0.0197250569845379, 1: 0.0591751709536137},
    3: {0: 0.02958758547680685, 2: 0.08876275643042054},
    4: {0: 0.2413651341592667, 2: -0.8845494793282861, 3: 0.924834003261792},
    5: {0: 0.037037037037037035, 3: 0.17082860872947386, 4: 0.12546768756682242},
    6: {0: 0.037109375, 3: 0.17025221101954405, 4: 0.06021653898045596, 5: -0.017578125},
    7: {
        0: 0.03709200011850479,
        3: 0.17038392571223998,
        4: 0.10726203044637328,
        5: -0.015319437748624402,
        6: 0.008273789163814023,
    },
    8: {
        0: 0.6241109587160757,
        3: -3.3608926294469414,
        4: -0.868219346841726,
        5: 27.59209969944671,
        6: 20.154067550477894,
        7: -43.48988418106996,
    },
    9: {
        0: 0.47766253643826434,
        3: -2.4881146199716677,
        4: -0.590290826836843,
        5: 21.230051448181193,
        6: 15.279233632882423,
        7: -33.28821096898486,
        8: -0.020331201708508627,
    },
    10: {
        0: -0.9371424300859873,
        3: 5.186372428844064,
        4: 1.0914373489967295,
        5: -8.149787010746927,
        6: -18.52006565999696,
        7: 22.739487099350505,
        8: 2.4936055526796523,
        9: -3.0467644718982196,
    },
    11: {
        0: 2.273310147516538,
        3: -10.53449546673725,
        4: -2.0008720582248625,
        5: -17.9589318631188,
        6: 27.94888452941996,
        7: -2.8589982771350235,
        8: -8.87285693353063,
        9: 12.360567175794303,
        10: 0.6433927460157636,
    },
    12: {
        0: 0.054293734116568765,
        5: 4.450312892752409,
        6: 1.8915178993145003,
        7: -5.801203960010585,
        8: 0.3111643669578199,
        9: -0.1521609496625161,
        10: 0.20136540080403034,
        11: 0.04471061572777259,
    },
    13: {
        0: 0.056167502283047954,
        6: 0.25350021021662483,
        7: -0.2462390374708025,
        8: -0.12419142326381637,
        9: 0.15329179827876568,
        10: 0.00820105229563469,
        11: 0.007567897660545699,
        12: -0.008298,
    },
    14: {
        0: 0.03183464816350214,
        5: 0.028300909672366776,
        6: 0.053541988307438566,
        7: -0.05492374857139099,
        10: -0.00010834732869724932,
        11: 0.0003825710908356584,
        12: -0.00034046500868740456,
        13: 0.1413124436746325,
    },
    15: {
        0: -0.42889630158379194,
        5: -4.697621415361164,
        6: 7.683421196062599,
        7: 4.06898981839711,
        8: 0.3567271874552811,
        12: -0.0013990241651590145,
        13: 2.9475147891527724,
        14: -9.15095847217987,
    },
}
_C = (
    0.0,
    0.05260015195876773,
    0.0789002279381516,
    0.1183503419072274,
    0.2816496580927726,
    0.3333333333333333,
    0.25,
    0.3076923076923077,
    0.6512820512820513,
    0.6,
    0.8571428571428571,
    1.0,
    1.0,
    0.1,
    0.2,
    0.7777777777777778,
)
_E3 = {
    0: -0.18980075407240762,
    5: 4.450312892752409,
    6: 1.8915178993145003,
    7: -5.801203960010585,
    8: -0.4226823213237919,
    9: -0.1521609496625161,
    10: 0.20136540080403034,
    11: 0.02265179219836082,
}
_E5 = {
    0: 0.01312004499419488,
    5: -1.2251564463762044,
    6: -0.4957589496572502,
    7: 1.6643771824549864,
    8: -0.35032884874997366,
    9: 0.3341791187130175,
    10: 0.08192320648511571,
    11: -0.022355307863886294,
}
_D = (
    {
        0: -8.428938276109013,
        5: 0.5667149535193777,
        6: -3.0689499459498917,
        7: 2.38466765651207,
        8: 2.117034582445028,
        9: -0.871391583777973,
        10: 2.2404374302607883,
        11: 0.6315787787694688,
        12: -0.08899033645133331,
        13: 18.148505520854727,
        14: -9.194632392478356,
        15: -4.436036387594894,
    },
    {
        0: 10.427508642579134,
        5: 242.28349177525817,
        6: 165.20045171727028,
        7: -374.5467547226902,
        8: -22.113666853125306,
        9: 7.733432668472264,
        10: -30.674084731089398,
        11: -9.332130526430229,
        12: 15.697238121770845,
        13: -31.139403219565178,
        14: -9.35292435884448,
        15: 35.81684148639408,
    },
    {
        0: 19.985053242002433,
        5: -387.0373087493518,
        6: -189.17813819516758,
        7: 527.8081592054236,
        8: -11.57390253995963,
        9: 6.8812326946963,
        10: -1.0006050966910838,
        11: 0.7777137798053443,
        12: -2.778205752353508,
        13: -60.19669523126412,
        14: 84.32040550667716,
        15: 11.99229113618279,
    },
    {
        0: -25.69393346270375,
        5: -154.18974869023643,
        6: -231.5293791760455,
        7: 357.6391179106141,
        8: 93.40532418362432,
        9: -37.45832313645163,
        10: 104.0996495089623,
        11: 29.8402934266605,
        12: -43.53345659001114,
        13: 96.32455395918828,
        14: -39.17726167561544,
        15: -149.72683625798564,
    },
)


@functools.cache
def order_8() -> Explicit:
    """The method of order 8 with errors of orders 5 and 3 of Dormand and Prince, its polynomial of
    order 7.

    E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, second edition,
    II.5 and II.6, the code DOP853.

    >>> method = order_8()
    >>> bool(np.allclose(method.A.sum(axis=1), method.C, atol=1e-13))
    True
    """
    A = np.zeros((16, 16))
    for row, entries in _A.items():
        A[row, list(entries)] = list(entries.values())
    E, D = _filled((_E3, _E5), 12), _filled(_D, 16)
    sample, at = _samples(_C, 12, (3, 5, 9, 10))
    return Explicit(
        A=A, B=A[12, :12], C=np.array(_C), E=E, D=D, order=8.0, stable=6.1, sample=sample, at=at
    )


@functools.cache
def order_5() -> Explicit:
    """The method of order 5 with an error of order 4 of Dormand and Prince, its polynomial of
    order 4.

    J. R. Dormand, P. J. Prince, A family of embedded Runge–Kutta formulae (1980); the polynomial of
    Hairer, Nørsett, Wanner, II.6, the code DOPRI5.

    >>> method = order_5()
    >>> bool(np.allclose(method.A.sum(axis=1), method.C, atol=1e-15))
    True
    """
    A = np.zeros((7, 7))
    A[1, :1] = 1 / 5
    A[2, :2] = 3 / 40, 9 / 40
    A[3, :3] = 44 / 45, -56 / 15, 32 / 9
    A[4, :4] = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
    A[5, :5] = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
    A[6, :6] = 35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
    E = np.zeros((2, 7))
    E[1] = 71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40
    D = np.zeros((1, 7))
    D[0, 0] = -12715105075 / 11282082432
    D[0, 2:4] = 87487479700 / 32700410799, -10690763975 / 1880347072
    D[0, 4:6] = 701980252875 / 199316789632, -1453857185 / 822651844
    D[0, 6] = 69997945 / 29380423
    C = A.sum(axis=1)
    sample, at = _samples(C, 6, (1, 2, 3))
    return Explicit(A=A, B=A[6, :6], C=C, E=E, D=D, order=5.0, stable=3.25, sample=sample, at=at)


def _samples(
    C: Sequence[float] | np.ndarray, end: int, rows: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Stages `rows`, whose nodes cover the step best, and its end."""
    sample, every = np.zeros(end + 1, dtype=np.int64), (*rows, end)
    sample[list(every)] = np.arange(1, len(every) + 1)
    return sample, np.array([0.0, *(float(C[row]) for row in every)])


def _filled(rows: tuple[dict[int, float], ...], width: int) -> np.ndarray:
    found = np.zeros((len(rows), width))
    for row, entries in zip(found, rows, strict=True):
        row[list(entries)] = list(entries.values())
    return found


class Implicit(NamedTuple):
    """Radau IIA with three stages, in the eigenvectors of its inverse matrix.

    `B`, `C` (3,): Weights and nodes.
    `E` (3,): Weights of the error, of what the stages have gained.
    `T`, `inverse` (3, 3): Stages from the eigenvectors' coordinates, and back: the first belongs to
      the real eigenvalue, the others are real and imaginary part of that of the complex one.
    `eigenvalue`, `eigenvalue_re`, `eigenvalue_im`: The real eigenvalue of A⁻¹, and both parts of
      the complex one.
    `at` (samples,): The nodes of the samples of a step (see `mbody.kernels.loop_closure`).
    """

    B: np.ndarray
    C: np.ndarray
    E: np.ndarray
    T: np.ndarray
    inverse: np.ndarray
    eigenvalue: float
    eigenvalue_re: float
    eigenvalue_im: float
    at: np.ndarray


@functools.cache
def radau_5() -> Implicit:
    """Radau IIA of order 5 with the error of order 3 of the code RADAU5.

    E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, second edition, IV.5 and IV.8.

    >>> method = radau_5()
    >>> bool(np.isclose(method.C[2], 1.0)), round(method.eigenvalue, 6)
    (True, 3.637834)
    """
    r = math.sqrt(6.0)
    A = np.array(
        [
            [(88 - 7 * r) / 360, (296 - 169 * r) / 1800, (-2 + 3 * r) / 225],
            [(296 + 169 * r) / 1800, (88 + 7 * r) / 360, (-2 - 3 * r) / 225],
            [(16 - r) / 36, (16 + r) / 36, 1 / 9],
        ]
    )
    values, vectors = np.linalg.eig(np.linalg.inv(A))
    first, second = int(np.abs(values.imag).argmin()), int(values.imag.argmax())
    # A⁻¹ (p − i q) = (α + i β) (p − i q) is A⁻¹ [p q] = [p q] [[α, −β], [β, α]]
    T = np.column_stack([vectors[:, first].real, vectors[:, second].real, -vectors[:, second].imag])
    E = np.array([-13.0 - 7.0 * r, -13.0 + 7.0 * r, -1.0]) / 3.0
    pair = complex(values[second])
    C = A.sum(axis=1)
    at = np.array([0.0, C[0], C[1], 1.0])
    real, inverse = float(values[first].real), np.linalg.inv(T)
    return Implicit(A[2].copy(), C, E, T, inverse, real, pair.real, pair.imag, at)


def suzuki_4() -> np.ndarray:
    """Parts of a step of which five symmetric steps of order 2 make one of order 4.

    M. Suzuki (1990); Hairer, Lubich, Wanner: Geometric Numerical Integration, II.4.

    >>> float(round(suzuki_4().sum(), 15)), float(abs(round((suzuki_4() ** 3).sum(), 15)))
    (1.0, 0.0)
    """
    part = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
    return np.array([part, part, 1.0 - 4.0 * part, part, part])


# -- Dense output: states and work within a step, by polynomials, and the instants that are kept
#
# A polynomial has rows F as
#
#     Δ(x) = x (F₀ + (1 − x) (F₁ + x (F₂ + (1 − x) (F₃ + …)))),   x the part of the step.
#
# All terms but the first vanish at both ends, so that Δ(1) = F₀ is the change over the step,
# exactly. Its rates there give the next two: Δ′(0) = F₀ + F₁ = h f₀ and Δ′(1) = F₀ − F₁ − F₂ = h
# f₁, hence
#
#     F₀ = y₁ − y₀,   F₁ = h f₀ − F₀,   F₂ = 2 F₀ − h (f₀ + f₁),
#
# which is Hermite's cubic; further rows come from further derivatives within the step.

# -- Runge–Kutta formulas shared by one motion and many lanes ----------------------------------
#
# A step of an explicit method with the coefficients A, b, c is
#
#     Y_s = y + h Σ_{r<s} A_{sr} K_r,   K_s = f(t + c_s h, Y_s),   y₁ = y + h Σ_r b_r K_r.
#
# Arrays are (2·coordinates,) for the witness 0.0 and (2·coordinates, lanes) for lanes.


@njit
def combined(weights, count, K, total, w):
    """total ← Σ weights[r] K[r] over the first `count` rows."""
    first = weights[0]
    for n in range(total.shape[0]):
        st(total, n, first * ld(K[0], n, w), w)
    for r in range(1, count):
        weight, row = weights[r], K[r]
        if weight != 0.0:
            for n in range(total.shape[0]):
                st(total, n, ld(total, n, w) + weight * ld(row, n, w), w)


@njit
def stage_state(weights, count, K, y, h, target, w):
    """target ← y + h Σ weights[r] K[r]: the state of a stage, or of the end."""
    combined(weights, count, K, target, w)
    for n in range(target.shape[0]):
        st(target, n, ld(y, n, w) + h * ld(target, n, w), w)


@njit
def along(F, n, x, w):
    """Increment of number n of a polynomial at the part x of the step: x (F₀ + (1 − x) (F₁ + x (F₂
    + (1 − x) (F₃ + …)))), by Horner's rule.
    """
    total = 0.0 * x
    for m in range(F.shape[0]):
        row = F.shape[0] - 1 - m
        total = (total + ld(F[row], n, w)) * (x if row % 2 == 0 else 1.0 - x)
    return total


@njit
def along_rate(F, n, x, w):
    """Its derivative by x."""
    total, rate = 0.0 * x, 0.0 * x
    for m in range(F.shape[0]):
        row = F.shape[0] - 1 - m
        total = total + ld(F[row], n, w)
        if row % 2 == 0:
            total, rate = total * x, rate * x + total
        else:
            total, rate = total * (1.0 - x), rate * (1.0 - x) - total
    return rate


@inline
def hermite_cubic(F, n, change, first, both):
    """F₀, F₁ and F₂ of number n by what it gains over the step, h f₀, and h (f₀ + f₁); see
    `mbody.kernels.runge_kutta`. Of one motion: lanes sum up in another order.
    """
    F[0, n] = change
    F[1, n] = first - change
    F[2, n] = 2.0 * change - both


@njit
def higher_rows(D, h, K, F, w):
    """Rows of F from the third on: h Σ D K."""
    for m in range(D.shape[0]):
        row = F[3 + m]
        combined(D[m], D.shape[1], K, row, w)
        for n in range(row.shape[0]):
            st(row, n, h * ld(row, n, w), w)


@njit
def stiffness_estimate(h, y, z, Ky, Kz, scale, w):
    """h |λ| by two states y and z near the end of a step and their derivatives: |f(y) − f(z)| / |y
    − z| bounds |λ| from below, and is near it where errors grow in its direction.

    Hairer, Wanner: Solving Ordinary Differential Equations II, IV.2.
    """
    turned, apart = 0.0 * ld(y, 0, w), 0.0 * ld(y, 0, w)
    for n in range(y.shape[0]):
        per = 1.0 / ld(scale, n, w)
        k, d = (ld(Ky, n, w) - ld(Kz, n, w)) * per, (ld(y, n, w) - ld(z, n, w)) * per
        turned, apart = turned + k * k, apart + d * d
    # where both states are the same nothing is stiff
    zero = 0.0 * apart
    ratio = turned / larger(apart, zero + TINY)
    return h * np.sqrt(select_le(apart, zero, zero, ratio))


@inline
def next_length(h, e3, e5, count, order, safety):
    """Error of a step, in tolerances, and by how much the next one may be longer, at most 6 times.

    e3, e5: sums of squares of the errors of low and of high order, over `count` numbers. The error
    is  h e₅² / √(count (e₅² + e₃²/100))  (Hairer, Nørsett, Wanner, II.10), which is never much
    greater than e₅ and falls faster with h; it goes with h^order, so that the best length is
    h · error^(−1/order).
    """
    error = 0.0 if e5 == 0.0 else h * e5 / math.sqrt((e5 + 0.01 * e3) * count)
    growth = 6.0 if error < STEP_ERROR_NONE else min(6.0, safety * error ** (-1.0 / order))
    return error, growth


@inline
def stable_growth(state, h, stiffness, stable):
    """By how much the step after one of length h, of h |λ| = `stiffness`, may be longer and still
    be stable for the fastest rate |λ| of the last steps. What decays fast is too small to be seen
    in many of them, and would grow in longer steps until it is.
    """
    state[FASTEST] = max(stiffness / h, STEP_RATE_FADING * state[FASTEST])
    return stable / max(h * state[FASTEST], TINY)


@inline
def count_stiff(state, limited):
    """Count an accepted step in the slots of one motion; `limited`: stability limits it."""
    state[SMOOTH_COUNT] = 0.0 if limited else state[SMOOTH_COUNT] + 1.0
    if limited or state[SMOOTH_COUNT] >= STEP_STIFF_SMOOTH:
        state[STIFF_COUNT] = state[STIFF_COUNT] + 1.0 if limited else 0.0


#: Nodes of Lobatto's rule of order 6, between the ends.
FIRST, SECOND = 0.5 - math.sqrt(0.05), 0.5 + math.sqrt(0.05)


@njit
def has_instant(S, O, now):
    """Whether an output instant lies before the end of the step."""
    k = int(S.state[DELIVERED])
    return k < O.times.shape[0] and O.times[k] < now


@njit
def deliver(L, W, S, O, h, now, refinements):
    """Keep every output instant from the time of the motion to `now`, the end of a step of length
    h from S.last to S.y.

    S: a `Stepping`, whose F and G are the polynomials of state and work; of them G₀ alone must be
    there where no instant lies inside. Rows 1 of K and P are workspace. O: an `Outputs`.
    """
    while is_met(S, O, now):
        x = interpolate(S, O, h, now)
        at = O.times[int(S.state[DELIVERED])]
        state_derivative(L, W, S, at, S.stage, 1, refinements, True)
        S.state[EVALUATIONS] += 1
        keep_instant(L, W, S, O, x)
    keep_work(S, O)


@njit
def is_met(S, O, now):
    """Whether the next output instant lies within the step, or at its end."""
    k = int(S.state[DELIVERED])
    return k < O.times.shape[0] and O.times[k] <= now


@njit
def interpolate(S, O, h, now):
    """S.stage ← the state at the next output instant; returns its part of the step, 1 at the end,
    where the state is that of the step.
    """
    at = O.times[int(S.state[DELIVERED])]
    whole = at >= now
    x = 1.0 if whole else (at - S.state[TIME]) / h
    for n in range(S.y.shape[0]):
        S.stage[n] = S.y[n] if whole else S.last[n] + along(S.F, n, x, 0.0)
    return x


@njit
def keep_instant(L, W, S, O, x):
    """Keep the next output instant, at the part x of the step, which was evaluated."""
    k, count, G = int(S.state[DELIVERED]), O.times.shape[0], S.G
    keep(L, W, 0.0, O.pages[k])
    for c in range(G.shape[1]):
        O.work[k, c] = O.work[count, c]
        O.work[k, c] += G[0, c] if x == 1.0 else along(G, c, x, 0.0)
    S.state[DELIVERED] = k + 1


@njit
def keep_work(S, O):
    """The work done until now ← with that of the step."""
    for c in range(S.G.shape[1]):
        O.work[O.times.shape[0], c] += S.G[0, c]


@njit
def clear_rows(S, first):
    """No terms of polynomials from that row on, which those of explicit steps have."""
    for row in range(first, S.F.shape[0]):
        for n in range(S.F.shape[1]):
            S.F[row, n] = 0.0
        for c in range(S.G.shape[1]):
            S.G[row, c] = 0.0


@njit
def hermite_output(L, W, S, h, refinements):
    """S.F (5, states) and S.G (5, causes) of a step from S.last to S.end, by derivatives at both
    ends: rows 0 and 3 of K and P; rows 1 and 2 are workspace.

    The position has order 5: F₃ and F₄ follow from the accelerations of both ends, of which
    Δ″(0) = h² a₀ and Δ″(1) = h² a₁ are half of the values below. The velocity is the cubic and one
    term more, with which it has in the middle the rate of the position. Auxiliary states have the
    cubic. Work by Lobatto's rule of order 6, (p₀ + 5 p₁ + 5 p₂ + p₃)/12.

    Returns the least conditioning of its two inner nodes, which are samples 1 and 2 of the step,
    and the node.
    """
    least, least_at = 1.0, SECOND
    K, P, F, G, y, last, stage = S.K, S.P, S.F, S.G, S.end, S.last, S.stage
    n3 = 3 * L.bodies
    for n in range(n3):
        m = n3 + n
        change = y[n] - last[n]
        hermite_cubic(F, n, change, h * K[0, n], h * (K[0, n] + K[3, n]))
        # ½ Δ″(0) = −F₁ + F₂ + F₃,  ½ Δ″(1) = −F₁ − 2 F₂ + F₃ + F₄
        F[3, n] = 0.5 * h * h * K[0, m] + F[1, n] - F[2, n]
        F[4, n] = 0.5 * h * h * K[3, m] + F[1, n] + 2.0 * F[2, n] - F[3, n]
        change = y[m] - last[m]
        hermite_cubic(F, m, change, h * K[0, m], h * (K[0, m] + K[3, m]))
        # Δ′(½)/h of the position, and the cubic of the velocity there; F₃ has the factor 1/16
        middle = (F[0, n] + 0.25 * F[2, n] + 0.0625 * F[4, n]) / h
        cubic = last[m] + 0.5 * (F[0, m] + 0.5 * (F[1, m] + 0.5 * F[2, m]))
        F[3, m] = 16.0 * (middle - cubic)
        F[4, m] = 0.0
    for n in range(2 * n3, y.shape[0]):
        hermite_cubic(F, n, y[n] - last[n], h * K[0, n], h * (K[0, n] + K[3, n]))
        F[3, n] = F[4, n] = 0.0
    for row in range(1, 3):
        x = FIRST if row == 1 else SECOND
        for n in range(y.shape[0]):
            stage[n] = last[n] + along(F, n, x, 0.0)
        state_derivative(L, W, S, S.state[TIME] + x * h, stage, row, refinements, False)
        S.state[EVALUATIONS] += 1
        part = sample_conditioning(L, W, 0.0, row)
        if part < least:
            least, least_at = part, x
    x = FIRST
    for c in range(G.shape[1]):
        first, end = h * P[0, c], h * P[3, c]
        G[0, c] = (first + end + 5.0 * h * (P[1, c] + P[2, c])) / 12.0
        G[1, c] = first - G[0, c]
        G[2, c] = 2.0 * G[0, c] - first - end
        # rate of the cubic at the first inner node: what it lacks to the power there is that of F₃
        left = h * P[1, c] - G[0, c] - (1.0 - 2.0 * x) * G[1, c] - x * (2.0 - 3.0 * x) * G[2, c]
        G[3, c] = left / (2.0 * x * (1.0 - x) * (1.0 - 2.0 * x))
        G[4, c] = 0.0
    clear_rows(S, 5)
    return least, least_at


# -- Output instants within explicit steps, checked against the equations of motion ------------
#
# A polynomial Δ(x) between the ends of a step is as good as the step where the step is short for
# all that moves. Where stability limits steps it is not: what decays fast has h |λ| of five to
# thirty there, and is so small that the ends are right to the tolerance, but the polynomial is off
# by up to ten thousand of it; nor is it where loads jump within the step. As every instant that is
# kept is evaluated, what it lacks to the equations is known,
#
#     δ = h f(Δ(x)) − Δ′(x),
#
# and δ/8 is the error, for a polynomial of order 7 by its derivative, and for h |λ| ≈ 8 by the
# Jacobian; measured on motions of either kind it is right to a factor of two. An instant of which
# it is more than a few tolerances gets a step of its own from the beginning of the step.


@njit
def deliver_checked(L, W, method, S, T, O, h, now):
    """Delivery of the times within a step (`deliver`), each interpolation checked; rows of K and P
    but the first, and S.end, are workspace.
    """
    refinements, doubtful = T.full_refinements, False
    while is_met(S, O, now):
        x = interpolate(S, O, h, now)
        at = O.times[int(S.state[DELIVERED])]
        state_derivative(L, W, S, at, S.stage, 1, refinements, True)
        S.state[EVALUATIONS] += 1
        # it changes its sign within the step: what follows a doubtful one is doubtful too
        doubtful = doubtful or interpolation_error(S, T, h, x) > STEP_INTERPOLATION_DOUBTFUL
        if x < 1.0 and doubtful:
            if h * S.state[FASTEST] > 0.5 * method.stable:
                S.state[LIMITED_INSTANTS] += 1
            if not step_within(L, W, method, S, T, x * h):
                interpolate(S, O, h, now)
            state_derivative(L, W, S, at, S.stage, 1, refinements, True)
            S.state[EVALUATIONS] += 1
        keep_instant(L, W, S, O, x)
    keep_work(S, O)


@njit
def interpolation_error(S, T, h, x):
    """Mean square of what the polynomial lacks to the derivative in row 1 of K, in tolerances."""
    total, size = 0.0, S.y.shape[0]
    for n in range(size):
        unit = T.absolute * S.scale[n] + T.relative * max(abs(S.y[n]), abs(S.last[n]))
        total += ((h * S.K[1, n] - along_rate(S.F, n, x, 0.0)) / unit) ** 2
    return total / size


@njit
def step_within(L, W, method, S, T, h):
    """S.stage ← the state after a shorter step from S.last; whether its loops close."""
    A, B, C, K, last, stage = method.A, method.B, method.C, S.K, S.last, S.stage
    t, end_row, size = S.state[TIME], method.B.shape[0], S.y.shape[0]
    for n in range(size):
        S.end[n], stage[n] = K[0, n], last[n]
    # row 0 of P is that of the end
    _, _, good = state_derivative(L, W, S, t, stage, 1, T.refinements, False)
    for n in range(size):
        K[0, n] = K[1, n]
    for s in range(1, end_row):
        stage_state(A[s], s, K, last, h, stage, 0.0)
        _, _, closes = state_derivative(L, W, S, t + C[s] * h, stage, s, T.refinements, False)
        good = good and closes
    S.state[EVALUATIONS] += end_row
    stage_state(B, end_row, K, last, h, stage, 0.0)
    for n in range(size):
        K[0, n] = S.end[n]
    return good


#: Steps of one passage that are tried again so that no stage, or no end, lies at the position.
STAGES_AGAIN, ENDS_AGAIN = 3.0, 8.0


@njit
def length_to_target(h, until, state):
    """The length h of a step near a singular position, changed so that neither its end nor a stage
    lies at the one that is known: all nodes of the methods keep a tenth of the step from its
    middle. Returns whether there is one ahead, too, and whether the step goes over it.
    """
    t = state[TIME]
    way = state[CROSSING_TIME] - t
    if (
        not way > SINGULAR_TIME_SHORTEST * max(abs(t), abs(until))
        or t + SINGULAR_STEP_TWICE * way >= until
    ):
        return h, False, False
    if h >= way:
        return SINGULAR_STEP_TWICE * way, True, True
    return min(h, SINGULAR_STEP_BEFORE * way), True, False


@njit
def dense_output(L, W, method, S, h, refinements):
    """S.F and S.G of the polynomials of state and work over a step from S.last to S.end, by the
    further derivatives that the method takes for them.

    The first three rows are Hermite's cubic (`mbody.kernels.runge_kutta`), the others h Σ D K.
    """
    A, B, C, D = method.A, method.B, method.C, method.D
    y, last, K, P, F, G = S.end, S.last, S.K, S.P, S.F, S.G
    end = B.shape[0]
    for s in range(end + 1, A.shape[0]):
        stage_state(A[s], s, K, last, h, S.stage, 0.0)
        state_derivative(L, W, S, S.state[TIME] + C[s] * h, S.stage, s, refinements, False)
        S.state[EVALUATIONS] += 1
    for n in range(y.shape[0]):
        hermite_cubic(F, n, y[n] - last[n], h * K[0, n], h * (K[end, n] + K[0, n]))
    for c in range(P.shape[1]):
        hermite_cubic(G, c, h * mean_power(B, P, c), h * P[0, c], h * (P[end, c] + P[0, c]))
    higher_rows(D, h, K, F, 0.0)
    higher_rows(D, h, P, G, 0.0)


@njit
def mean_power(B, P, c):
    """Mean power of cause c over a step: Σ b_r P_r."""
    whole = 0.0
    for r in range(B.shape[0]):
        whole += B[r] * P[r, c]
    return whole


@njit
def work_errors(L, W, method, S, T, h):
    """Sums of the squares of the errors of all works over a step, in tolerances, of low and of high
    order.

    Where drivers lead, the motion says nothing of how well the steps resolve the work of friction.
    A work may err by a part of all the work so far, and by what the loads do at rates that count
    as none.
    """
    E, P, n3 = method.E, S.P, 3 * L.bodies
    unit = S.state[THROUGHPUT]
    for c in range(P.shape[1]):
        unit += abs(h * mean_power(method.B, P, c))
    unit *= T.relative
    for n in range(n3):
        unit += T.absolute * abs(h * W.force[n, 0]) * S.scale[n3 + n]
    low, high = 0.0, 0.0
    if unit > 0.0:
        for c in range(P.shape[1]):
            e3, e5 = 0.0, 0.0
            for r in range(E.shape[1]):
                e3 += E[0, r] * P[r, c]
                e5 += E[1, r] * P[r, c]
            low += (e3 / unit) ** 2
            high += (e5 / unit) ** 2
    return low, high


@njit
def attempt(L, W, method, S, T, until):
    """One step towards `until` is tried from S.y: TRIED where it is good, its end in S.end and the
    last row of K; MORE where it is to be tried again with another length; else why there is none
    (DONE, LAST_STEP, STEP_VANISHED, NOT_FINITE, BRANCH_UNCERTAIN).
    """
    A, B, C, E, sample = method.A, method.B, method.C, method.E, method.sample
    y, K, state, scale = S.y, S.K, S.state, S.scale
    stage, end, last, low_error, error_row = S.stage, S.end, S.last, S.error[0], S.error[1]
    end_row = B.shape[0]
    # whether the error takes the derivative at the end
    early = E.shape[1] > end_row
    w, size, frictional = 0.0, y.shape[0], L.friction_kind.shape[0] > 0
    n3, velocity_scale = 3 * L.bodies, scale[6 * L.bodies - 1]
    rtol, atol, regular = T.relative, T.absolute, T.refinements
    t, h = state[TIME], state[NEXT]
    if t >= until:
        return DONE
    clipped = t + h >= until - TIME_END_ROUNDING * abs(until)
    if clipped and state[LAST_STEP_ALLOWED] < 0.5:
        return LAST_STEP
    near_singular, known, over = state[NEAR_SINGULAR] > 0.5, False, False
    if clipped:
        h = until - t
    elif near_singular:
        h, known, over = length_to_target(h, until, state)
    if h < TIME_STEP_SHORTEST * max(abs(t), abs(until)) and not clipped:
        return STEP_VANISHED
    refinements = T.full_refinements if near_singular else regular
    # ---- stages: Y_s = y + h Σ A_sr K_r, K_s = f(t + c_s h, Y_s)
    good, off_branch, least, least_at = True, False, state[CONDITIONING], t
    for s in range(1, end_row):
        stage_state(A[s], s, K, y, h, stage, w)
        far, fast, good = state_derivative(
            L, W, S, t + C[s] * h, stage, s, refinements, near_singular
        )
        state[EVALUATIONS] += 1
        if not good:
            break
        if sample[s] == 0:
            part = least_conditioning(L, W, w)
        else:
            part = sample_conditioning(L, W, w, sample[s])
        if part < least:
            least, least_at = part, t + C[s] * h
        if near_singular:
            # what projections move along the manifold is of second order in what they move
            # across it, by how far the singular position is
            apart = math.sqrt(part / state[BEST_CONDITIONING])
            moved = far * far / apart + h * (fast / apart) ** 2 / velocity_scale
            close = apart < CONDITIONING_CLOSE and moved > PROJECTION_GREATEST * rtol
            off_branch = off_branch or close or far > PROJECTION_SURE * apart
    if not good:
        state[REJECTED] += 1
        state[NEXT] = (SINGULAR_STEP_BACK if over else 0.5) * h
        return MORE
    if off_branch and not known and state[STAGE_TRIES] < STAGES_AGAIN:
        state[STAGE_TRIES] += 1.0
        state[NEXT] = 0.91 * h
        return MORE
    if least < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING] and not near_singular:
        # errors of stages fall with the fourth power of the step, and here their squares count
        state[NEAR_SINGULAR], state[LONGEST_STEP] = 1.0, 0.25 * h
        state[NEXT] = state[LONGEST_STEP]
        return MORE
    # ---- the end: y₁ = y + h Σ b_r K_r, projected
    stage_state(B, end_row, K, y, h, end, w)
    for n in range(size):
        last[n] = y[n]
    if near_singular or early:
        _, _, good = state_derivative(L, W, S, t + h, end, end_row, refinements, True)
        state[EVALUATIONS] += 1
    # ---- the error, in tolerances
    combined(E[0], E.shape[1], K, low_error, w)
    combined(E[1], E.shape[1], K, error_row, w)
    if near_singular:
        for row in range(2):
            for half in range(2):
                tangential_part(L, W, w, S.error[row, half * n3 : (half + 1) * n3])
    e3, e5, noise = 0.0, 0.0, 0.0
    if near_singular:
        noise = (
            ACCELERATION_ROUNDING
            * h
            * velocity_scale
            / max(least / state[BEST_CONDITIONING], ACCELERATION_ROUNDING_NEAREST)
        )
    # both norms in one loop: with one at a time, as in `radau`, the compiler fuses products in
    # another way, to other last digits
    for n in range(size):
        unit = (atol + noise) * scale[n] + rtol * max(abs(y[n]), abs(end[n]))
        e3 += (low_error[n] / unit) ** 2
        e5 += (error_row[n] / unit) ** 2
    if frictional:
        low, high = work_errors(L, W, method, S, T, h)
        e3, e5 = e3 + low, e5 + high
    if not (e5 < FINITE) or not good:
        state[NEXT] = (SINGULAR_STEP_BACK if over else 0.5 if near_singular else 0.25) * h
        state[REJECTED] += 1
        if h < TIME_STEP_SHORTEST_REJECTED * max(abs(t), abs(until)):
            return NOT_FINITE
        return MORE
    safety = STEP_SAFETY_NEAR_SINGULAR if near_singular else STEP_SAFETY
    error, growth = next_length(h, e3, e5, size, method.order, safety)
    if error > 1.0:
        state[REJECTED] += 1
        state[NEXT] = h * (SINGULAR_STEP_BACK if over else max(0.2, growth))
        return MORE
    if not (near_singular or early):
        _, _, good = state_derivative(L, W, S, t + h, end, end_row, regular, True)
        state[EVALUATIONS] += 1
        if not good:
            state[REJECTED] += 1
            state[NEXT] = 0.5 * h
            return MORE
    # ---- the branch: no singular position may lie within the step unseen
    part = sample_conditioning(L, W, w, sample[end_row])
    if may_be_singular(L, W, S, method.at, end, near_singular):
        state[REJECTED] += 1
        state[NEXT] = 0.5 * h
        if t > state[SHORTENED_UNTIL]:
            # an ordinary step is tried shorter first
            state[SHORTENED_UNTIL] = t + h
            state[DECIDE_BELOW] = (2.0 if near_singular else 0.3) * h
        if h < state[DECIDE_BELOW]:
            return BRANCH_UNCERTAIN
        return MORE
    ends_there = part < CONDITIONING_NO_END * state[BEST_CONDITIONING]
    if ends_there and state[END_TRIES] < ENDS_AGAIN and not (clipped or known):
        # a step begins badly at a singular position: end after it, or before
        state[END_TRIES] += 1
        state[NEXT] = h * (1.2 if state[END_TRIES] < 5.0 else 0.5)
        return MORE
    state[TRIED_LENGTH], state[TRIED_END] = h, until if clipped else t + h
    state[TRIED_GROWTH], state[TRIED_CONDITIONING] = growth, part
    state[TRIED_LEAST], state[TRIED_LEAST_AT] = least, least_at
    return TRIED


@njit
def accept(L, W, method, S, T, O, until, dense):
    """Accept the step that was tried, keeping every output instant that it meets: MORE to go on,
    or STIFF. `dense`: whether its polynomials are known.
    """
    y, K, P, state, end = S.y, S.K, S.P, S.state, S.end
    end_row, size, causes = method.B.shape[0], y.shape[0], P.shape[1]
    h, now, growth = state[TRIED_LENGTH], state[TRIED_END], state[TRIED_GROWTH]
    part, least, least_at = state[TRIED_CONDITIONING], state[TRIED_LEAST], state[TRIED_LEAST_AT]
    near_singular, clipped, regular = state[NEAR_SINGULAR] > 0.5, now == until, T.refinements
    for n in range(size):
        y[n] = end[n]
    state[CONDITIONING] = part
    state[BEST_CONDITIONING] = max(part, state[BEST_CONDITIONING])
    if part < least:
        least, least_at = part, now
    record_accepted(L, W, S, method.sample[end_row], least, least_at, regular > 0)
    state[STEPS] += 1
    state[LAST_STEP_ALLOWED] = 0.0
    state[NEAR_SINGULAR_STEPS] += 1.0 if near_singular else 0.0
    still_near = near_singular and least < CONDITIONING_NEAR_SINGULAR * state[BEST_CONDITIONING]
    state[NEAR_SINGULAR] = 1.0 if still_near else 0.0
    if not (near_singular or clipped):
        stiffness = stiffness_estimate(h, y, S.stage, K[end_row], K[end_row - 1], S.scale, 0.0)
        count_stiff(state, growth * stiffness > method.stable)
        growth = min(growth, stable_growth(state, h, stiffness, method.stable))
    for c in range(causes):
        S.G[0, c] = h * mean_power(method.B, P, c)
        state[THROUGHPUT] += abs(S.G[0, c])
    if not dense and has_instant(S, O, now):
        dense_output(L, W, method, S, h, regular)
    for n in range(size):
        K[0, n] = K[end_row, n]
    for c in range(causes):
        P[0, c] = P[end_row, c]
    if near_singular:
        deliver(L, W, S, O, h, now, T.full_refinements)
    else:
        deliver_checked(L, W, method, S, T, O, h, now)
    # ---- the length of the next step
    state[TIME] = now
    wanted = h * max(0.2, growth)
    state[NEXT] = max(wanted, state[NEXT]) if clipped else wanted
    if state[NEAR_SINGULAR] > 0.5:
        state[NEXT] = min(state[NEXT], state[LONGEST_STEP])
    else:
        state[END_TRIES] = state[STAGE_TRIES] = 0.0
    if state[STIFF_COUNT] >= STEP_STIFF_LIMIT and until - now > T.patience * state[NEXT]:
        return STIFF
    return MORE


@kernel
def runge_kutta(
    L: Layout,
    W: Work,
    method: Explicit,
    S: Stepping,
    T: Tolerances,
    O: Outputs,
    until: float,
    steps: int,
) -> int:
    """At most so many steps towards `until`; every output instant that is met is kept.

    method: an `Explicit`; S: a `Stepping` with K (len(A), ·), F and G (3 + len(D), ·); T: a
    `Tolerances`; O: an `Outputs`.
    Returns DONE, MORE, STEP_VANISHED, NOT_FINITE, STIFF, LAST_STEP or BRANCH_UNCERTAIN.
    """
    for _ in range(steps):
        code = attempt(L, W, method, S, T, until)
        if code == TRIED:
            code = accept(L, W, method, S, T, O, until, False)
            if S.state[ARTIFICIAL_ENERGY] > S.state[ARTIFICIAL_LIMIT]:
                return MORE
        if code != MORE:
            return code
    return MORE
