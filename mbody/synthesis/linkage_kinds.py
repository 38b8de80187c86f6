"""What a kind of mechanism is for its synthesis, and which kinds there are."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from mbody.model.mechanism import Mechanism
from mbody.synthesis.four_bars import FourBar
from mbody.synthesis.slider_cranks import SliderCrank

__all__ = ["KINDS", "Kind"]


class Kind(Protocol):
    """A loop of a crank, a link that carries the point P, and one link more.

    A design is a row of `numbers`, the crank's angles in space, and the sense in which the loop is
    closed; the methods are described where they are written, as of `FourBar`.
    """

    @property
    def name(self) -> str:
        """As it is requested."""
        ...

    @property
    def carrier(self) -> str:
        """Body that carries P."""
        ...

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of the numbers of a row; the first two are the crank's pivot."""
        ...

    @property
    def crank_number(self) -> int:
        """Which number is the crank's length."""
        ...

    @property
    def point_number(self) -> int:
        """Which number is the first of P."""
        ...

    @property
    def lengths(self) -> tuple[int, ...]:
        """Which numbers are lengths of links."""
        ...

    @property
    def senses(self) -> tuple[float, ...]:
        """Senses of closure that differ by more than where the frame is."""
        ...

    def shapes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Ratios of lengths of mechanisms whose crank turns round."""
        ...

    def curves(self, shapes: np.ndarray, sense: float, s: np.ndarray) -> np.ndarray:
        """e^{iφ} of the carrier, (shapes, instants)."""
        ...

    def placed(self, shapes: np.ndarray, s: np.ndarray, fit: tuple[Any, ...]) -> tuple[Any, Any]:
        """Rows of numbers and directions of the frame of linear fits."""
        ...

    def direction(self, x: np.ndarray, theta: np.ndarray, sense: float) -> tuple[Any, Any, Any]:
        """φ with its derivatives."""
        ...

    def poses(self, x: np.ndarray, theta: np.ndarray, sense: float) -> tuple[Any, Any]:
        """e^{iφ} and the output."""
        ...

    def sense(self, x: np.ndarray, theta: float, coupler: complex) -> float:
        """The sense of a position."""
        ...

    def mechanism(
        self,
        x: np.ndarray,
        theta: np.ndarray,
        sense: float,
        units: str,
        plane: float | None = None,
    ) -> Mechanism:
        """As a description."""
        ...

    def turns(self, x: np.ndarray) -> bool:
        """Whether the crank turns round."""
        ...

    def described(self, x: np.ndarray) -> str:
        """Which links turn round, in words."""
        ...

    def transmission(self, run: Any) -> np.ndarray:
        """Transmission angles of a result."""
        ...

    def circuit(self, x: np.ndarray, theta: np.ndarray, sense: np.ndarray) -> np.ndarray:
        """On which circuit positions are."""
        ...

    def cognate(self, x: np.ndarray, theta: np.ndarray, sense: float) -> tuple[Any, ...] | None:
        """The mechanism that traces the same path with the same turn of its crank."""
        ...


KINDS: dict[str, Kind] = {"four_bar": FourBar(), "slider_crank": SliderCrank()}
