"""An atlas of coupler curves, searched by the shape of a curve whatever its place, size,
orientation and direction of travel.

A closed curve is sampled at equal steps of its length, as a complex function of it; place, size,
direction and first point change only the phases and the common factor of its Fourier coefficients
(C. T. Zahn, R. Z. Roskies, IEEE Trans. Computers C-21 (1972) 269-281; for linkages J. M. McCarthy
and G. S. Soh, *Geometric Design of Linkages*, 2011). So their magnitudes, divided by their norm,
are the curve's place in the atlas; the opposite direction exchanges those of positive and negative
order.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.tolerances import TINY
from mbody.errors import ModelError, brief
from mbody.files.writing import writing
from mbody.model.element import listed
from mbody.synthesis.linkage_kinds import KINDS, Kind

#: Orders of Fourier coefficients on either side, and points of a curve.
ORDERS, POINTS = 8, 128
#: Positions of the crank at which a curve is computed.
INSTANTS = 180
#: Coupler points of one shape, and how far from A they are, in lengths of the carrier.
EACH, LARGEST_DISTANCE = 8, 1.5
#: Name and number of the form of the file.
FORM = "mbody atlas 1"


@dataclass(frozen=True, eq=False)
class Atlas:
    """Coupler curves of four-bars or slider-cranks whose crank turns round.

    Attributes
    ----------
    kind : str
    shapes : array (curves, ratios)
        Of four-bars crank, coupler and rocker in lengths of the ground; of slider-cranks crank and
        offset in lengths of the rod.
    senses : array (curves,)
        The sign with which the loop is closed, 1 or -1.
    points : array (curves,)
        P in the axes of the carrier, in its lengths, complex.
    descriptors : array (curves, 16)
        See the head of this file.

    Examples
    --------
    >>> found = Atlas.made("slider_crank", 40, seed=1)
    >>> found.shapes.shape, found.descriptors.shape
    ((40, 2), (40, 16))
    """

    kind: str
    shapes: np.ndarray
    senses: np.ndarray
    points: np.ndarray
    descriptors: np.ndarray

    def __len__(self) -> int:
        return len(self.senses)

    @classmethod
    def made(cls, kind: str = "four_bar", count: int = 4000, seed: int = 0) -> Atlas:
        """An atlas of `count` curves of random shapes, eight points on each.

        >>> len(Atlas.made(count=40, seed=1))
        40
        """
        if kind not in KINDS:
            raise ModelError(f"atlas: there is no kind {brief(kind)} (there are: {listed(KINDS)})")
        own, rng = KINDS[kind], np.random.default_rng(seed)
        each = -(-count // EACH)
        shapes = np.repeat(own.shapes(each, rng), EACH, axis=0)[:count]
        signs = rng.choice(np.array(own.signs), count)
        radius, angle = (
            LARGEST_DISTANCE * np.sqrt(rng.uniform(size=count)),
            rng.uniform(0.0, 2.0 * np.pi, count),
        )
        points = 0.5 + radius * np.exp(1j * angle)
        curves = np.array([_curve(own, *one) for one in zip(shapes, signs, points, strict=True)])
        descriptors = np.array([curve_descriptor(curve) for curve in curves])
        return cls(kind, shapes, signs, points, descriptors)

    def nearest(self, curve: Sequence[Any] | np.ndarray, count: int = 10) -> np.ndarray:
        """Numbers of the curves nearest to a closed one of points (x, y), the nearest first.

        >>> atlas = Atlas.made(count=40, seed=1)
        >>> circle = [(np.cos(a), np.sin(a)) for a in np.linspace(0.0, 6.0, 40)]
        >>> atlas.nearest(circle, 3).shape
        (3,)
        """
        table = np.asarray(curve, dtype=float)
        wanted = curve_descriptor(table[:, 0] + 1j * table[:, 1])
        both = np.stack([wanted, wanted[::-1]])
        away = np.linalg.norm(self.descriptors[:, None, :] - both, axis=2).min(axis=1)
        return np.argsort(away, kind="stable")[:count]

    def nearest_shapes(
        self, kind: Kind, points: np.ndarray, closed: bool, count: int
    ) -> list[tuple[float, np.ndarray]]:
        """The shapes of the nearest curves for each sign of closure.

        Raises
        ------
        ModelError
            For an atlas of another kind, and an open path.
        """
        if kind.name != self.kind:
            raise ModelError(f"synthesize: the atlas is of {self.kind}, not of {kind.name}")
        if not closed:
            raise ModelError(
                "synthesize: an atlas has closed curves: close the path by its first point, or "
                "search without an atlas"
            )
        nearest = self.nearest(np.column_stack([points.real, points.imag]), count)
        found = []
        for sign in kind.signs:
            own = nearest[self.senses[nearest] == sign]
            found.append((sign, np.unique(self.shapes[own], axis=0)))
        return found

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the atlas to a file of NumPy arrays."""
        with writing(path, binary=True) as file:
            np.savez_compressed(
                file,
                form=np.array(FORM),
                kind=np.array(self.kind),
                shapes=self.shapes,
                senses=self.senses,
                points=self.points,
                descriptors=self.descriptors,
            )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Atlas:
        """Read an atlas that `save` wrote.

        Raises
        ------
        ModelError
            For a file that cannot be read, or that is none.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                if str(file["form"]) == FORM and str(file["kind"]) in KINDS:
                    names = ("shapes", "senses", "points", "descriptors")
                    return cls(str(file["kind"]), *(file[name] for name in names))
        except OSError as error:
            raise ModelError(f"cannot read '{path}' ({error.strerror or 'no atlas'})") from None
        except (ValueError, KeyError, EOFError):
            pass
        raise ModelError(f"'{path}' is no atlas: make one by mbody atlas --to FILE")


def as_atlas(given: Any) -> Atlas:
    """An atlas from itself or from its file."""
    return given if isinstance(given, Atlas) else Atlas.load(given)


def curve_descriptor(curve: np.ndarray) -> np.ndarray:
    """Magnitudes of the Fourier coefficients of orders -8 to -1 and 1 to 8 of a closed curve of
    complex points, sampled at equal steps of its length, divided by their norm.
    """
    whole = np.append(curve, curve[0])
    length = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(whole)))])
    at = np.arange(POINTS) * (length[-1] / POINTS)
    even = np.interp(at, length, whole.real) + 1j * np.interp(at, length, whole.imag)
    sizes = np.abs(np.fft.fft(even))
    found = np.concatenate([sizes[-ORDERS:], sizes[1 : ORDERS + 1]])
    return found / max(float(np.linalg.norm(found)), TINY)


def _curve(kind: Kind, shape: np.ndarray, sign: float, point: complex) -> np.ndarray:
    """The path of P over a revolution."""
    s = np.arange(INSTANTS) * (2.0 * np.pi / INSTANTS)
    carrier = kind.curves(shape[None, :], sign, s)[0]
    length = shape[1] if kind.name == "four_bar" else 1.0
    return np.asarray(shape[0] * np.exp(1j * s) + length * point * carrier)
