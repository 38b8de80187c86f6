"""Four-bars in closed form: the direction of the coupler with its derivatives, circuits and
cognates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.grashof_class import inversion
from mbody.laws import ConstantSpeed
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.joints import Revolute
from mbody.model.mechanism import Mechanism
from mbody.model.study import Instants
from mbody.synthesis.guided_links import carrier

__all__ = ["FourBar"]

#: Share of drag links among the shapes that are tried; in the others the crank is the shortest.
DRAG_LINKS = 4
#: Ratios to the ground of crank, coupler and rocker that are tried.
LOW, HIGH = (0.02, 0.1, 0.1), (1.0, 6.0, 6.0)
#: By how much of the ground the sum of shortest and longest stays below that of the others.
MARGIN = 0.02


@dataclass(frozen=True)
class FourBar:
    """Four-bars as rows of numbers: O2, O4, crank, coupler, rocker, P in the axes of the coupler.

    Source: R. L. Norton, *Design of Machinery*, chapters 2 to 4.
    """

    name = "four_bar"
    carrier = "coupler"
    crank_number, point_number = 4, 7
    senses = (1.0, -1.0)
    numbers = (
        "ground.O2.x",
        "ground.O2.y",
        "ground.O4.x",
        "ground.O4.y",
        "crank.A.x",
        "coupler.B.x",
        "rocker.B.x",
        "coupler.P.x",
        "coupler.P.y",
    )
    lengths = (4, 5, 6)

    def shapes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Ratios crank, coupler, rocker to ground of four-bars whose crank turns round."""
        found = np.empty((0, 3))
        while len(found) < count:
            r = np.exp(rng.uniform(np.log(LOW), np.log(HIGH), (4 * count, 3)))
            sides = np.sort(np.column_stack([np.ones(len(r)), r]), axis=1)
            turns = sides[:, 1] + sides[:, 2] - sides[:, 0] - sides[:, 3] > MARGIN
            found = np.vstack([found, r[turns & (r[:, 0] < np.minimum(1.0, r[:, 1:].min(axis=1)))]])
        found = found[:count]
        drag = found[::DRAG_LINKS].copy()  # ground and crank change places
        found[::DRAG_LINKS] = np.column_stack([np.ones(len(drag)), drag[:, 1:]]) / drag[:, :1]
        return found

    def curves(self, shapes: np.ndarray, sense: float, s: np.ndarray) -> np.ndarray:
        """e^{iφ} of the coupler at crank angles s from the ground line, (shapes, instants)."""
        crank, coupler, rocker = (shapes[:, k, None] for k in range(3))
        q = 1.0 - crank * np.exp(1j * s)
        return _direction(q, coupler, rocker, sense)

    def placed(self, shapes: np.ndarray, s: np.ndarray, fit: tuple[Any, ...]) -> tuple[Any, Any]:
        """Rows of numbers and crank angles of the best fits C = c + α E + β G of shapes."""
        c, alpha, beta = fit
        frame = alpha / np.abs(alpha)
        scale = np.abs(alpha) / shapes[..., 0]
        end, point = c + scale * frame, beta / frame
        columns = [c.real, c.imag, end.real, end.imag]
        columns += [scale * shapes[..., k] for k in range(3)]
        return np.stack([*columns, point.real, point.imag], axis=-1), np.angle(frame)

    def direction(self, x: np.ndarray, theta: np.ndarray, sense: float) -> tuple[Any, Any, Any]:
        """Direction φ of the coupler in space, its derivatives by the numbers and by θ."""
        r2, r3, r4 = x[4:7]
        e = np.exp(1j * theta)
        q = complex(x[2] - x[0], x[3] - x[1]) - r2 * e
        g = _direction(q, r3, r4, sense)
        back = np.conj(r3 * g - q) / r4  # of the rocker
        below = r3 * (g * back).imag
        by = np.zeros((len(theta), len(x)))
        by[:, 0], by[:, 1] = back.real, -back.imag
        by[:, 2], by[:, 3] = -back.real, back.imag
        by[:, 4] = (e * back).real
        by[:, 5], by[:, 6] = (g * back).real, -1.0
        return np.angle(g), by / below[:, None], (1j * r2 * e * back).real / below

    def poses(self, x: np.ndarray, theta: np.ndarray, sense: float) -> tuple[Any, Any]:
        """Directions of coupler and rocker, e^{iφ} and e^{iψ}."""
        q = complex(x[2] - x[0], x[3] - x[1]) - x[4] * np.exp(1j * theta)
        g = _direction(q, x[5], x[6], sense)
        return g, (x[5] * g - q) / x[6]

    def sense(self, x: np.ndarray, theta: float, coupler: complex) -> float:
        """Which way the loop is closed, from the direction e^{iφ} of the coupler."""
        q = complex(x[2] - x[0], x[3] - x[1]) - x[4] * np.exp(1j * theta)
        return 1.0 if (coupler * np.conj(q)).imag >= 0.0 else -1.0

    def mechanism(
        self,
        x: np.ndarray,
        theta: np.ndarray,
        sense: float,
        units: str,
        plane: float | None = None,
    ) -> Mechanism:
        """The four-bar as a description, its crank at θ[0]; it asks for the angles θ; `plane` as of
        `carrier`.
        """
        g, h = self.poses(x, theta[:1], sense)
        values = [float(one) for one in x]
        machine = Mechanism(
            "four-bar",
            units=units,
            ground={"O2": (values[0], values[1]), "O4": (values[2], values[3])},
            ask=Instants(at={"crank": [float(one) for one in theta]}),
        )
        point = complex(values[7], values[8])
        machine.add(
            Body("crank", points={"O2": (0.0, 0.0), "A": (values[4], 0.0)}, guess=float(theta[0])),
            carrier("coupler", values[5], point, float(np.angle(g[0])), plane),
            Body(
                "rocker",
                points={"O4": (0.0, 0.0), "B": (values[6], 0.0)},
                guess=float(np.angle(h[0])),
            ),
            Revolute("O2", "ground.O2", "crank.O2"),
            Revolute("A", "crank.A", "coupler.A"),
            Revolute("B", "coupler.B", "rocker.B"),
            Revolute("O4", "ground.O4", "rocker.O4"),
            AngleDriver("motor", "crank", ConstantSpeed(float(theta[0]), 0.0)),
        )
        return machine

    def turns(self, x: np.ndarray) -> bool:
        """Whether the crank turns round."""
        return inversion(*_sides(x)) in ("crank-rocker", "double crank")

    def described(self, x: np.ndarray) -> str:
        """Grashof's class in words."""
        return inversion(*_sides(x))

    def transmission(self, run: Any) -> np.ndarray:
        """Angle between coupler and rocker, 0 to π/2, of all instants."""
        along = run.measure("coupler.B.x - coupler.A.x") + 1j * run.measure(
            "coupler.B.y - coupler.A.y"
        )
        sine = (along * np.exp(-1j * run["rocker"].angle)).imag / np.abs(along)
        return np.asarray(np.arcsin(np.minimum(np.abs(sine), 1.0)))

    def circuit(self, x: np.ndarray, theta: np.ndarray, sense: np.ndarray) -> np.ndarray:
        """On which circuit each position is, 1 or -1: the sign of the sine at a joint that does not
        turn round, opposite the shortest link. Where no link turns round there is one circuit.
        """
        sides = _sides(x)
        if 2.0 * (sides.min() + sides.max()) >= sides.sum():
            return np.ones(len(theta))
        if sides.argmin() < 2:  # ground or crank: the joint B
            return np.asarray(sense, dtype=float)
        base = complex(x[2] - x[0], x[3] - x[1])
        return np.asarray(np.sign((np.exp(1j * theta) * np.conj(base)).imag))

    def cognate(self, x: np.ndarray, theta: np.ndarray, sense: float) -> tuple[Any, Any, float]:
        """Roberts' cognate whose crank turns as that of x: its numbers, crank angles and sense.

        With λ = (P − A)/(B − A) the third pivot is O = O2 + λ (O4 − O2); the crank from O is
        (1 − λ) times that of x, the rocker about O4 turns as the coupler of x, the coupler as the
        rocker (Norton, section 3.8).
        """
        o2, o4 = complex(x[0], x[1]), complex(x[2], x[3])
        ratio = complex(x[7], x[8]) / x[5]
        other, rest = o2 + ratio * (o4 - o2), 1.0 - ratio
        r2, r3, r4 = abs(rest) * x[4], abs(rest) * x[6], abs(rest) * x[5]
        point = -ratio * x[6] * abs(rest) / rest
        found = np.array(
            [other.real, other.imag, o4.real, o4.imag, r2, r3, r4, point.real, point.imag]
        )
        angles = theta + np.angle(rest)
        h = self.poses(x, theta[:1], sense)[1][0]
        return found, angles, self.sense(found, angles[0], -h * rest / abs(rest))


def _sides(x: np.ndarray) -> np.ndarray:
    """Lengths of ground, crank, coupler, rocker."""
    ground = np.hypot(x[2] - x[0], x[3] - x[1])
    return np.abs(np.array([ground, x[4], x[5], x[6]]))


def _direction(q: Any, coupler: Any, rocker: Any, sense: float) -> Any:
    """e^{iφ} of the coupler from A, where q leads from A to O4; NaN where it does not close."""
    square = (q * np.conj(q)).real
    length = np.sqrt(square)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = (square + coupler**2 - rocker**2) / (2.0 * coupler * length)
        sine = np.sqrt(1.0 - cosine * cosine)
        return q / length * (cosine + 1j * sense * sine)
