"""Runge–Kutta methods as tables of coefficients: explicit ones, Radau IIA, and compositions."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mbody.core.bundle import Bundle, Floats, Ints, Rows


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
        Which sample of the step (see `mbody.kernels.singularity_monitor`) each row is, the first
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
    `at` (samples,): The nodes of the samples of a step (see `mbody.kernels.singularity_monitor`).
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
