"""Slider-cranks in closed form: the direction of the rod with its derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.laws import ConstantSpeed
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.element import Marker
from mbody.model.joints import Prismatic, Revolute
from mbody.model.mechanism import Mechanism
from mbody.model.study import Instants
from mbody.synthesis.guided_links import carrier

__all__ = ["SliderCrank"]

#: Crank and offset in lengths of the rod that are tried; together they stay below this.
LEAST, MOST = 0.02, 0.97


@dataclass(frozen=True)
class SliderCrank:
    """Slider-cranks as rows of numbers: O, direction of the guide, its distance from O, crank, rod,
    P in the axes of the rod.

    The rod leans at most a right angle from the guide's direction; the other way of assembly is
    the same mechanism with the guide's direction reversed.
    """

    name = "slider_crank"
    carrier = "rod"
    crank_number, point_number = 4, 6
    senses = (1.0,)
    numbers = (
        "ground.O.x",
        "ground.O.y",
        "guide.i.angle",
        "offset",
        "crank.A.x",
        "rod.B.x",
        "rod.P.x",
        "rod.P.y",
    )
    lengths = (4, 5)

    def shapes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Crank and offset in lengths of the rod, of slider-cranks whose crank turns round."""
        crank = np.exp(rng.uniform(np.log(LEAST), np.log(MOST), count))
        return np.column_stack([crank, rng.uniform(-1.0, 1.0, count) * (MOST - crank)])

    def curves(self, shapes: np.ndarray, sense: float, s: np.ndarray) -> np.ndarray:
        """e^{iφ} of the rod at crank angles s from the guide, (shapes, instants)."""
        return _leaning(shapes[:, 1, None] - shapes[:, 0, None] * np.sin(s), sense)

    def placed(self, shapes: np.ndarray, s: np.ndarray, fit: tuple[Any, ...]) -> tuple[Any, Any]:
        """Rows of numbers and crank angles of the best fits C = c + α E + β G of shapes."""
        c, alpha, beta = fit
        frame = alpha / np.abs(alpha)
        rod, point = np.abs(alpha) / shapes[..., 0], beta / frame
        columns = [c.real, c.imag, np.angle(frame), rod * shapes[..., 1], np.abs(alpha), rod]
        return np.stack([*columns, point.real, point.imag], axis=-1), np.angle(frame)

    def direction(self, x: np.ndarray, theta: np.ndarray, sense: float) -> tuple[Any, Any, Any]:
        """Direction φ of the rod in space, its derivatives by the numbers and by θ."""
        guide, offset, r2, r3 = x[2:6]
        s = theta - guide
        lean = _leaning((offset - r2 * np.sin(s)) / r3, sense)
        below = r3 * lean.real
        by = np.zeros((len(theta), len(x)))
        by[:, 2] = 1.0 + r2 * np.cos(s) / below
        by[:, 3] = 1.0 / below
        by[:, 4], by[:, 5] = -np.sin(s) / below, -lean.imag / below
        return guide + np.angle(lean), by, -r2 * np.cos(s) / below

    def poses(self, x: np.ndarray, theta: np.ndarray, sense: float) -> tuple[Any, Any]:
        """Direction e^{iφ} of the rod, and travel of the slider along the guide from O."""
        s = theta - x[2]
        lean = _leaning((x[3] - x[4] * np.sin(s)) / x[5], sense)
        return np.exp(1j * x[2]) * lean, x[4] * np.cos(s) + x[5] * lean.real

    def sense(self, x: np.ndarray, theta: float, coupler: complex) -> float:
        """Which way the loop is closed, from the direction e^{iφ} of the rod."""
        return 1.0 if (coupler * np.exp(-1j * x[2])).real >= 0.0 else -1.0

    def mechanism(
        self,
        x: np.ndarray,
        theta: np.ndarray,
        sense: float,
        units: str,
        plane: float | None = None,
    ) -> Mechanism:
        """The slider-crank as a description, its crank at θ[0]; it asks for the angles θ; `plane`
        as of `carrier`.
        """
        g, travel = self.poses(x, theta[:1], sense)
        values = [float(one) for one in x]
        along = np.exp(1j * x[2])
        start = complex(values[0], values[1]) + along * 1j * values[3]
        slider = start + along * travel[0]
        machine = Mechanism(
            "slider-crank",
            units=units,
            ground={"O": (values[0], values[1]), "guide": (start.real, start.imag)},
            ask=Instants(at={"crank": [float(one) for one in theta]}),
        )
        point = complex(values[6], values[7])
        machine.add(
            Body("crank", points={"O": (0.0, 0.0), "A": (values[4], 0.0)}, guess=float(theta[0])),
            carrier("rod", values[5], point, float(np.angle(g[0])), plane),
            Body(
                "slider",
                points={"B": (0.0, 0.0)},
                guess=(float(slider.real), float(slider.imag), values[2]),
            ),
            Revolute("O", "ground.O", "crank.O"),
            Revolute("A", "crank.A", "rod.A"),
            Revolute("B", "rod.B", "slider.B"),
            Prismatic("guide", Marker("ground", "guide", values[2]), "slider.B"),
            AngleDriver("motor", "crank", ConstantSpeed(float(theta[0]), 0.0)),
        )
        return machine

    def turns(self, x: np.ndarray) -> bool:
        """Whether the crank turns round."""
        return bool(abs(x[4]) + abs(x[3]) < abs(x[5]))

    def described(self, x: np.ndarray) -> str:
        """Which link turns round."""
        crank, offset, rod = abs(x[4]), abs(x[3]), abs(x[5])
        if crank + offset < rod:
            return "slider-crank whose crank turns round"
        if rod + offset < crank:
            return "slider-crank whose rod turns round"
        return "slider-crank in which no link turns round"

    def transmission(self, run: Any) -> np.ndarray:
        """Angle between the rod and the normal of the guide, 0 to π/2, of all instants."""
        along = run.measure("rod.B.x - rod.A.x") + 1j * run.measure("rod.B.y - rod.A.y")
        cosine = (along * np.exp(-1j * run["slider"].angle)).real / np.abs(along)
        return np.asarray(np.arcsin(np.minimum(np.abs(cosine), 1.0)))

    def circuit(self, x: np.ndarray, theta: np.ndarray, sense: np.ndarray) -> np.ndarray:
        """On which circuit each position is, 1 or -1; where no link turns round there is one."""
        crank, offset, rod = abs(x[4]), abs(x[3]), abs(x[5])
        if crank + offset < rod:
            return np.asarray(sense, dtype=float)
        if rod + offset < crank:
            return np.asarray(np.sign(np.cos(theta - x[2])))
        return np.ones(len(theta))

    def cognate(self, x: np.ndarray, theta: np.ndarray, sense: float) -> None:
        """None: the other slider-crank of the same path has another crank."""
        return None


def _leaning(sine: Any, sense: float) -> Any:
    """e^{iφ} of the rod against the guide; NaN where it does not close."""
    with np.errstate(invalid="ignore"):
        return sense * np.sqrt(1.0 - sine * sine) + 1j * sine
