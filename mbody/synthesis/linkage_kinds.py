"""Kinds of mechanisms for synthesis: unknowns, generated quantities, defects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from mbody.analysis.driven.transmission import inversion
from mbody.laws import ConstantSpeed
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.element import Marker
from mbody.model.joints import Prismatic, Revolute
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import Instants

# -- The link that carries the point of a path, or the plane that takes poses ------------------


def carrier(
    name: str, length: float, point: complex, direction: float, plane: float | None
) -> Body:
    """The link from A to B with its point P, at a rough direction.

    Its axes are at A, with x to B; or, where `plane` is a number, those of the plane that is
    guided: at P, rotated from them by that angle [rad].

    >>> carrier("coupler", 2.0, 1.0 + 1.0j, 0.0, None).points["P"]
    (1.0, 1.0)
    >>> carrier("coupler", 2.0, 1.0 + 1.0j, 0.0, 0.0).points["A"]
    (-1.0, -1.0)
    """
    places = {"A": 0.0 + 0.0j, "B": complex(length), "P": complex(point)}
    if plane is not None:
        back = np.exp(-1j * plane)
        places = {key: (place - point) * back for key, place in places.items()}
        direction += plane
    points = {key: (float(place.real), float(place.imag)) for key, place in places.items()}
    return Body(name, points=points, guess=float(direction))


# -- Four-bars in closed form: coupler direction, derivatives, circuits, cognates --------------

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
    signs = (1.0, -1.0)
    numbers = (
        "ground.O2.x", "ground.O2.y", "ground.O4.x", "ground.O4.y", "crank.A.x", "coupler.B.x",
        "rocker.B.x", "coupler.P.x", "coupler.P.y",
    )  # fmt: skip
    lengths = (4, 5, 6)

    def shapes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Ratios crank, coupler, rocker to ground of four-bars whose crank turns round."""
        found = np.empty((0, 3))
        while len(found) < count:
            r = np.exp(rng.uniform(np.log(LOW), np.log(HIGH), (4 * count, 3)))
            sides = np.sort(np.column_stack([np.ones(len(r)), r]), axis=1)
            grashof = sides[:, 1] + sides[:, 2] - sides[:, 0] - sides[:, 3] > MARGIN
            found = np.vstack(
                [found, r[grashof & (r[:, 0] < np.minimum(1.0, r[:, 1:].min(axis=1)))]]
            )
        found = found[:count]
        drag = found[::DRAG_LINKS].copy()  # ground and crank change places
        found[::DRAG_LINKS] = np.column_stack([np.ones(len(drag)), drag[:, 1:]]) / drag[:, :1]
        return found

    def curves(self, shapes: np.ndarray, sign: float, s: np.ndarray) -> np.ndarray:
        """e^{iφ} of the coupler at crank angles s from the ground line, (shapes, instants)."""
        crank, coupler, rocker = (shapes[:, k, None] for k in range(3))
        q = 1.0 - crank * np.exp(1j * s)
        return _direction(q, coupler, rocker, sign)

    def placed(self, shapes: np.ndarray, s: np.ndarray, fit: tuple[Any, ...]) -> tuple[Any, Any]:
        """Rows of numbers and crank angles of the best fits C = c + α E + β G of shapes."""
        c, alpha, beta = fit
        frame = alpha / np.abs(alpha)
        scale = np.abs(alpha) / shapes[..., 0]
        end, point = c + scale * frame, beta / frame
        columns = [c.real, c.imag, end.real, end.imag]
        columns += [scale * shapes[..., k] for k in range(3)]
        return np.stack([*columns, point.real, point.imag], axis=-1), np.angle(frame)

    def direction(self, x: np.ndarray, theta: np.ndarray, sign: float) -> tuple[Any, Any, Any]:
        """Direction φ of the coupler in space, its derivatives by the numbers and by θ."""
        r2, r3, r4 = x[4:7]
        e = np.exp(1j * theta)
        q = complex(x[2] - x[0], x[3] - x[1]) - r2 * e
        g = _direction(q, r3, r4, sign)
        back = np.conj(r3 * g - q) / r4  # of the rocker
        below = r3 * (g * back).imag
        by = np.zeros((len(theta), len(x)))
        by[:, 0], by[:, 1] = back.real, -back.imag
        by[:, 2], by[:, 3] = -back.real, back.imag
        by[:, 4] = (e * back).real
        by[:, 5], by[:, 6] = (g * back).real, -1.0
        return np.angle(g), by / below[:, None], (1j * r2 * e * back).real / below

    def poses(self, x: np.ndarray, theta: np.ndarray, sign: float) -> tuple[Any, Any]:
        """Directions of coupler and rocker, e^{iφ} and e^{iψ}."""
        q = complex(x[2] - x[0], x[3] - x[1]) - x[4] * np.exp(1j * theta)
        g = _direction(q, x[5], x[6], sign)
        return g, (x[5] * g - q) / x[6]

    def closure_sign(self, x: np.ndarray, theta: float, coupler: complex) -> float:
        """Which way the loop is closed, from the direction e^{iφ} of the coupler."""
        q = complex(x[2] - x[0], x[3] - x[1]) - x[4] * np.exp(1j * theta)
        return 1.0 if (coupler * np.conj(q)).imag >= 0.0 else -1.0

    def mechanism(
        self, x: np.ndarray, theta: np.ndarray, sign: float, units: str, plane: float | None = None
    ) -> Mechanism:
        """The four-bar as a description, its crank at θ[0]; it asks for the angles θ; `plane` as of
        `carrier`.
        """
        g, h = self.poses(x, theta[:1], sign)
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

    def revolves(self, x: np.ndarray) -> bool:
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

    def circuit(self, x: np.ndarray, theta: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """On which circuit each position is, 1 or -1: the sign of the sine at a joint that does not
        turn round, opposite the shortest link. Where no link turns round there is one circuit.
        """
        sides = _sides(x)
        if 2.0 * (sides.min() + sides.max()) >= sides.sum():
            return np.ones(len(theta))
        if sides.argmin() < 2:  # ground or crank: the joint B
            return np.asarray(sign, dtype=float)
        base = complex(x[2] - x[0], x[3] - x[1])
        return np.asarray(np.sign((np.exp(1j * theta) * np.conj(base)).imag))

    def cognate(self, x: np.ndarray, theta: np.ndarray, sign: float) -> tuple[Any, Any, float]:
        """Roberts' cognate whose crank turns as that of x: its numbers, crank angles and sign of
        closure.

        With λ = (P − A)/(B − A) the third pivot is O = O2 + λ (O4 − O2); the crank from O is
        (1 − λ) times that of x, the rocker about O4 turns as the coupler of x, the coupler as the
        rocker (Norton, section 3.8).
        """
        o2, o4 = complex(x[0], x[1]), complex(x[2], x[3])
        ratio = complex(x[7], x[8]) / x[5]
        other, complement = o2 + ratio * (o4 - o2), 1.0 - ratio
        r2, r3, r4 = abs(complement) * x[4], abs(complement) * x[6], abs(complement) * x[5]
        point = -ratio * x[6] * abs(complement) / complement
        found = np.array(
            [other.real, other.imag, o4.real, o4.imag, r2, r3, r4, point.real, point.imag]
        )
        angles = theta + np.angle(complement)
        h = self.poses(x, theta[:1], sign)[1][0]
        return found, angles, self.closure_sign(found, angles[0], -h * complement / abs(complement))


def _sides(x: np.ndarray) -> np.ndarray:
    """Lengths of ground, crank, coupler, rocker."""
    ground = np.hypot(x[2] - x[0], x[3] - x[1])
    return np.abs(np.array([ground, x[4], x[5], x[6]]))


def _direction(q: Any, coupler: Any, rocker: Any, sign: float) -> Any:
    """e^{iφ} of the coupler from A, where q leads from A to O4; NaN where it does not close."""
    square = (q * np.conj(q)).real
    length = np.sqrt(square)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = (square + coupler**2 - rocker**2) / (2.0 * coupler * length)
        sine = np.sqrt(1.0 - cosine * cosine)
        return q / length * (cosine + 1j * sign * sine)


# -- Slider-cranks in closed form: the direction of the rod with its derivatives ---------------

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
    signs = (1.0,)
    numbers = (
        "ground.O.x", "ground.O.y", "guide.i.angle", "offset", "crank.A.x", "rod.B.x", "rod.P.x",
        "rod.P.y",
    )  # fmt: skip
    lengths = (4, 5)

    def shapes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Crank and offset in lengths of the rod, of slider-cranks whose crank turns round."""
        crank = np.exp(rng.uniform(np.log(LEAST), np.log(MOST), count))
        return np.column_stack([crank, rng.uniform(-1.0, 1.0, count) * (MOST - crank)])

    def curves(self, shapes: np.ndarray, sign: float, s: np.ndarray) -> np.ndarray:
        """e^{iφ} of the rod at crank angles s from the guide, (shapes, instants)."""
        return _leaning(shapes[:, 1, None] - shapes[:, 0, None] * np.sin(s), sign)

    def placed(self, shapes: np.ndarray, s: np.ndarray, fit: tuple[Any, ...]) -> tuple[Any, Any]:
        """Rows of numbers and crank angles of the best fits C = c + α E + β G of shapes."""
        c, alpha, beta = fit
        frame = alpha / np.abs(alpha)
        rod, point = np.abs(alpha) / shapes[..., 0], beta / frame
        columns = [c.real, c.imag, np.angle(frame), rod * shapes[..., 1], np.abs(alpha), rod]
        return np.stack([*columns, point.real, point.imag], axis=-1), np.angle(frame)

    def direction(self, x: np.ndarray, theta: np.ndarray, sign: float) -> tuple[Any, Any, Any]:
        """Direction φ of the rod in space, its derivatives by the numbers and by θ."""
        guide, offset, r2, r3 = x[2:6]
        s = theta - guide
        lean = _leaning((offset - r2 * np.sin(s)) / r3, sign)
        below = r3 * lean.real
        by = np.zeros((len(theta), len(x)))
        by[:, 2] = 1.0 + r2 * np.cos(s) / below
        by[:, 3] = 1.0 / below
        by[:, 4], by[:, 5] = -np.sin(s) / below, -lean.imag / below
        return guide + np.angle(lean), by, -r2 * np.cos(s) / below

    def poses(self, x: np.ndarray, theta: np.ndarray, sign: float) -> tuple[Any, Any]:
        """Direction e^{iφ} of the rod, and travel of the slider along the guide from O."""
        s = theta - x[2]
        lean = _leaning((x[3] - x[4] * np.sin(s)) / x[5], sign)
        return np.exp(1j * x[2]) * lean, x[4] * np.cos(s) + x[5] * lean.real

    def closure_sign(self, x: np.ndarray, theta: float, coupler: complex) -> float:
        """Which way the loop is closed, from the direction e^{iφ} of the rod."""
        return 1.0 if (coupler * np.exp(-1j * x[2])).real >= 0.0 else -1.0

    def mechanism(
        self, x: np.ndarray, theta: np.ndarray, sign: float, units: str, plane: float | None = None
    ) -> Mechanism:
        """The slider-crank as a description, its crank at θ[0]; it asks for the angles θ; `plane`
        as of `carrier`.
        """
        g, travel = self.poses(x, theta[:1], sign)
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

    def revolves(self, x: np.ndarray) -> bool:
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

    def circuit(self, x: np.ndarray, theta: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """On which circuit each position is, 1 or -1; where no link turns round there is one."""
        crank, offset, rod = abs(x[4]), abs(x[3]), abs(x[5])
        if crank + offset < rod:
            return np.asarray(sign, dtype=float)
        if rod + offset < crank:
            return np.asarray(np.sign(np.cos(theta - x[2])))
        return np.ones(len(theta))

    def cognate(self, x: np.ndarray, theta: np.ndarray, sign: float) -> None:
        """None: the other slider-crank of the same path has another crank."""
        return None


def _leaning(sine: Any, sign: float) -> Any:
    """e^{iφ} of the rod against the guide; NaN where it does not close."""
    with np.errstate(invalid="ignore"):
        return sign * np.sqrt(1.0 - sine * sine) + 1j * sine


class Kind(Protocol):
    """A loop of a crank, a link that carries the point P, and one link more.

    A design is a row of `numbers`, the crank's angles in space, and the direction in which the loop
    is closed; the methods are described where they are written, as of `FourBar`.
    """

    @property
    def name(self) -> str:
        """Name by which the kind is requested."""
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
    def signs(self) -> tuple[float, ...]:
        """Signs of closure that differ by more than where the frame is."""
        ...

    def shapes(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Ratios of lengths of mechanisms whose crank turns round."""
        ...

    def curves(self, shapes: np.ndarray, sign: float, s: np.ndarray) -> np.ndarray:
        """e^{iφ} of the carrier, (shapes, instants)."""
        ...

    def placed(self, shapes: np.ndarray, s: np.ndarray, fit: tuple[Any, ...]) -> tuple[Any, Any]:
        """Rows of numbers and directions of the frame of linear fits."""
        ...

    def direction(self, x: np.ndarray, theta: np.ndarray, sign: float) -> tuple[Any, Any, Any]:
        """φ with its derivatives."""
        ...

    def poses(self, x: np.ndarray, theta: np.ndarray, sign: float) -> tuple[Any, Any]:
        """e^{iφ} and the output."""
        ...

    def closure_sign(self, x: np.ndarray, theta: float, coupler: complex) -> float:
        """The sign of closure of a position."""
        ...

    def mechanism(
        self, x: np.ndarray, theta: np.ndarray, sign: float, units: str, plane: float | None = None
    ) -> Mechanism:
        """Description of the mechanism with these unknowns."""
        ...

    def revolves(self, x: np.ndarray) -> bool:
        """Whether the crank turns round."""
        ...

    def described(self, x: np.ndarray) -> str:
        """Which links turn round, in words."""
        ...

    def transmission(self, run: Any) -> np.ndarray:
        """Transmission angles of a result."""
        ...

    def circuit(self, x: np.ndarray, theta: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """On which circuit positions are."""
        ...

    def cognate(self, x: np.ndarray, theta: np.ndarray, sign: float) -> tuple[Any, ...] | None:
        """The mechanism that traces the same path with the same rotation of its crank."""
        ...


KINDS: dict[str, Kind] = {"four_bar": FourBar(), "slider_crank": SliderCrank()}
