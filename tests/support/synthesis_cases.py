"""Problems of synthesis of the literature, and linkages by an independent position analysis."""

import numpy as np

#: Six points on a line, the crank's angles free; sources in docs/synthesis.md.
LINE = [(20.0, 20.0 + 5.0 * n) for n in range(6)]
#: A published design for them: r1 r2 r3 r4, the point in the axes of the coupler, the direction and
#: the place of the ground, the crank's angles from it.
PUBLISHED_SIDES = (39.35432733966176, 8.738597335076454, 27.91020567579063, 38.41653206619049)
PUBLISHED_POINT = (36.576759454887835, 18.058222622003274)
PUBLISHED_FRAME = (3.922197401424182, -9.015069651004032, 59.8594568458345)
PUBLISHED_ANGLES = (
    1.6275724377055465,
    2.42129538238649,
    2.93021895068062,
    3.4158306289051543,
    3.9401612344766854,
    5.428565504554411,
)
#: Eighteen points of a closed path, the crank turning by 20 deg from each to the next.
CLOSED = [
    (0.5, 1.1),
    (0.4, 1.1),
    (0.3, 1.1),
    (0.2, 1.0),
    (0.1, 0.9),
    (0.05, 0.75),
    (0.02, 0.6),
    (0.0, 0.5),
    (0.0, 0.4),
    (0.03, 0.3),
    (0.1, 0.25),
    (0.15, 0.2),
    (0.2, 0.3),
    (0.3, 0.4),
    (0.4, 0.5),
    (0.5, 0.7),
    (0.6, 0.9),
    (0.6, 1.0),
]
CLOSED_TIMING = np.arange(18) * np.pi / 9.0


def meet(a, ra, b, rb, side):
    """One intersection of two circles: the position analysis of a pair of links by circles, where
    the package has cosines and directions.
    """
    d = abs(b - a)
    along = (ra**2 - rb**2 + d**2) / (2.0 * d)
    height = np.sqrt(np.maximum(ra**2 - along**2, 0.0))
    return a + (along + 1j * side * height) * (b - a) / d


def four_bar(values, theta, side):
    """A, B and P of a four-bar with numbers by name, at crank angles, by circles."""
    number = values.__getitem__
    o2 = complex(number("ground.O2.x"), number("ground.O2.y"))
    o4 = complex(number("ground.O4.x"), number("ground.O4.y"))
    a = o2 + number("crank.A.x") * np.exp(1j * np.asarray(theta))
    b = np.array([meet(p, number("coupler.B.x"), o4, number("rocker.B.x"), side) for p in a])
    along = (b - a) / abs(b - a)
    return a, b, a + complex(number("coupler.P.x"), number("coupler.P.y")) * along


def random_four_bar(rng):
    """Numbers of a crank-rocker in any place, by rejection."""
    while True:
        sides = rng.uniform(0.2, 4.0, 4)  # ground, crank, coupler, rocker
        turns = sides.argmin() == 1 and 2.0 * (sides.min() + sides.max()) < 0.98 * sides.sum()
        if turns:
            break
    o2 = complex(*rng.normal(size=2))
    o4 = o2 + sides[0] * np.exp(1j * rng.uniform(-3.0, 3.0))
    names = ["ground.O2.x", "ground.O2.y", "ground.O4.x", "ground.O4.y", "crank.A.x"]
    names += ["coupler.B.x", "rocker.B.x", "coupler.P.x", "coupler.P.y"]
    point = rng.normal(size=2)
    return dict(zip(names, [o2.real, o2.imag, o4.real, o4.imag, *sides[1:], *point], strict=True))


def rows(points):
    """Complex points as pairs."""
    return [(one.real, one.imag) for one in points]
