"""The frames of a film: places between instants, and every shape of them in pixels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from mbody.sheets.names import force_names
from mbody.solution.places import Place, moved
from mbody.solution.solution import Solution
from mbody.views.acting import notation
from mbody.views.carriers import Carrier
from mbody.views.frame import nice, rounded_number
from mbody.views.friction_symbols import (
    CONSTRUCTION,
    contact_arrows,
    line_of_action,
    sense_history,
)
from mbody.views.labels import symbolic
from mbody.views.load_symbols import forces_shown
from mbody.views.page_data import coupler_points
from mbody.views.pose import Pose
from mbody.views.record import KeptShape
from mbody.views.scene import Scene, scene
from mbody.views.style import FORCE, LOAD, SIZE

__all__ = ["CENTRES", "FilmArrow", "FilmSet", "Stretch", "lasting"]

Array = np.ndarray

#: Seconds that a film lasts where the motion itself would be too quick or too slow to follow.
SHORTEST, LONGEST, USUAL = 2.0, 20.0, 6.0
#: Height of the letters of a title [pixels], as it is and at least, and the width of one beside it.
TITLE, SMALLEST, LETTER = 17.0, 9.0, 0.54
#: Pixels: the margin, the title above and the scales below.
MARGIN, ABOVE, BELOW = 26, 46, 30
#: With more joints than this their forces have no names, which could not be read.
FORCES = 30
#: Names of the shapes of mass centres.
CENTRES = ("cg:", "centre:", "tie:")
#: Length of the longest arrow, in points of the paper.
ARROW = SIZE["arrow"]
VELOCITY, ACCELERATION = "#8a3ab9", "#a8650a"


class Stretch:
    """A motion at places between its instants: what the carriers of shapes read of a run.

    Parameters
    ----------
    run : Solution
    at : array
        3.25 is a quarter of the way from instant 3 to 4.
    """

    def __init__(self, run: Solution, at: Array) -> None:
        self.run, self.at = run, at
        self.k = np.clip(np.floor(at).astype(np.int64), 0, max(len(run) - 2, 0))
        self.f = at - self.k
        self.next = np.minimum(self.k + 1, len(run) - 1)
        self._bodies: dict[str, Any] = {}

    def __len__(self) -> int:
        return len(self.at)

    def __getitem__(self, body: str) -> Any:
        if body not in self._bodies:
            own = self.run[body]
            pairs = (("x", "vx"), ("y", "vy"), ("angle", "omega"))
            parts = {q: self._between(getattr(own, q), getattr(own, v)) for q, v in pairs}
            self._bodies[body] = SimpleNamespace(**parts)
        return self._bodies[body]

    def value(self, history: Array) -> Array:
        """A history at these places, straight between instants."""
        history = np.asarray(history, dtype=float)
        return np.asarray(history[self.k] + self.f * (history[self.next] - history[self.k]))

    def _between(self, q: Array, v: Array) -> Array:
        """Hermite's cubic between instants; a straight line where time stands still."""
        h = self.run.t[self.next] - self.run.t[self.k]
        f, g = self.f, 1.0 - self.f
        a, b, va, vb = q[self.k], q[self.next], v[self.k], v[self.next]
        cubic = g * g * (1 + 2 * f) * a + f * g * g * h * va
        cubic = cubic + f * f * (3 - 2 * f) * b - f * f * g * h * vb
        return np.asarray(np.where(h > 0.0, cubic, a + f * (b - a)))


def lasting(run: Solution, second: float) -> float:
    """Seconds of a film of a motion: its own time, if people can follow that."""
    own = float(run.t[-1] - run.t[0]) * second
    return own if SHORTEST <= own <= LONGEST else USUAL


def places(run: Solution, count: int) -> Array:
    """Where the frames lie between the instants, at equal times; the last frame of what closes on
    itself is left out, as it is the first of the next round.
    """
    whole = len(run) - 1
    turned = all(
        abs(np.exp(1j * run[b.name].angle[-1]) - np.exp(1j * run[b.name].angle[0])) < 1e-6
        and abs(run[b.name].x[-1] - run[b.name].x[0]) < 1e-6 * run.system.length
        and abs(run[b.name].y[-1] - run[b.name].y[0]) < 1e-6 * run.system.length
        for b in run.mechanism.bodies
    )
    parts = np.linspace(0.0, 1.0, count, endpoint=not turned)
    if float(run.t[-1] - run.t[0]) > 0.0 and bool(np.all(np.diff(run.t) >= 0.0)):
        t = run.t[0] + parts * (run.t[-1] - run.t[0])
        return np.asarray(np.interp(t, run.t, np.arange(float(len(run)))))
    return parts * whole


@dataclass
class FilmArrow:
    """Arrows of one quantity: where they begin (frames, 2), and their vectors (frames, 2)."""

    kind: str
    text: str
    color: str
    place: Array
    vector: Array


class FilmSet:
    """What all frames of a film share: the scenes, the canvas, paths and arrows.

    Parameters
    ----------
    runs : mapping of Solution
        The first is shown in full, others faded.
    count : int
        Frames.
    width : int
        Pixels.
    show : sequence of str
        As of `mbody.view`.
    paths : sequence of str, optional
    """

    def __init__(
        self,
        runs: Mapping[str, Solution],
        count: int,
        width: int,
        show: Sequence[str],
        paths: Sequence[str] | None,
    ) -> None:
        self.scenes: list[Scene] = [scene(run) for run in runs.values()]
        self.notes = self.scenes[0].notes
        self.main = self.scenes[0]
        self.show, self.names = set(show), list(runs)
        self._signs: dict[tuple[int, str], Array] = {}
        self.at = [places(one.run, count) for one in self.scenes]
        self.stretches = [
            Stretch(one.run, at) for one, at in zip(self.scenes, self.at, strict=True)
        ]
        low = np.min([one.low for one in self.scenes], axis=0)
        high = np.max([one.high for one in self.scenes], axis=0)
        self.paths = {
            name: np.column_stack([history.x, history.y])
            for name in (coupler_points(self.main.run) if paths is None else paths)
            for history in [self.main.run.point(name)]
            if "paths" in self.show
        }
        for track in self.paths.values():
            low, high = np.fmin(low, track.min(axis=0)), np.fmax(high, track.max(axis=0))
        self.carried = [self._carried(n) for n in range(len(self.scenes))]
        self._fit(low, high, width)
        self.arrows, self.scales = self._arrows()
        if self.arrows:
            # once more, with room for the longest arrows and their names
            for one in self.arrows:
                tips = one.place + one.vector / self.scale
                name = 20.0 * self.point / self.scale
                low, high = (
                    np.fmin(low, np.nanmin(tips, axis=0) - name),
                    np.fmax(high, np.nanmax(tips, axis=0) + name),
                )
            self._fit(low, high, width)
            self.arrows, self.scales = self._arrows()

    def _fit(self, low: Array, high: Array, width: int) -> None:
        """The scale by which a rectangle fits a canvas of that width."""
        wide, tall = np.maximum(high - low, 1e-9 * self.main.run.system.length)
        room = width - 2 * MARGIN
        self.scale = float(min(room / wide, 0.9 * room / tall))
        self.width = width + width % 2
        self.height = int(np.ceil(self.scale * tall)) + 2 * MARGIN + ABOVE + BELOW
        self.height += self.height % 2
        self.middle = 0.5 * (low + high)
        #: Pixels a point of the paper.
        self.point = float(np.clip(self.scale * self.main.unit, 0.8, 2.2))

    def pixels(self, points: Array) -> Array:
        """World points (…, 2) in pixels, y up from the lower edge."""
        centre = (0.5 * self.width, BELOW + MARGIN + 0.5 * self._tall)
        return np.asarray((points - self.middle) * self.scale + centre)

    @property
    def _tall(self) -> float:
        return self.height - ABOVE - BELOW - 2 * MARGIN

    def _carried(self, n: int) -> dict[Carrier, tuple[Array, Array, Array]]:
        stretch = self.stretches[n]
        return {carrier: carrier.axes(stretch) for carrier in self.scenes[n].carriers}

    def shapes(self, frame: int, n: int = 0) -> Iterator[tuple[KeptShape, Array]]:
        """The shapes of a frame from the lowest to the highest, with their points in pixels."""
        for shape in self.scenes[n].shapes:
            if self.left_out(shape):
                continue
            if shape.sense and not self.there(shape, n)[frame]:
                continue
            axes = self.carried[n][shape.carrier]
            yield shape, self.pixels(shape.carrier.shown(shape.points, axes, frame))

    def left_out(self, shape: KeptShape) -> bool:
        """Whether a shape is of a kind that is not shown."""
        name, show = shape.look.name, self.show
        return ("centres" not in show and name.startswith(CENTRES)) or (
            "forces" not in show and name.startswith(CONSTRUCTION)
        )

    def there(self, shape: KeptShape, n: int) -> Array:
        """In which frames a shape is there that depends on the sign of a quantity."""
        quantity, sign = shape.sense or ("t", 1.0)
        if (n, quantity) not in self._signs:
            history = sense_history(self.scenes[n].run, quantity)
            self._signs[n, quantity] = self.stretches[n].value(history)
        return np.asarray(sign * self._signs[n, quantity] > 0.0)

    def labels(self, frame: int) -> Iterator[tuple[Any, Array, Array]]:
        """Names with the anchor in pixels, and the way from there."""
        if "names" not in self.show:
            return
        for label in self.main.labels:
            axes = self.carried[0][label.carrier]
            place = label.carrier.shown(label.anchor, axes, frame)[0]
            way = label.way
            if label.turns:
                _, u, _ = (part[frame] for part in axes)
                way = np.array([u[0] * way[0] - u[1] * way[1], u[1] * way[0] + u[0] * way[1]])
            yield label, self.pixels(place), way

    def instant(self, frame: int) -> str:
        """Where the motion is, in words."""
        run, stretch = self.main.run, self.stretches[0]
        parts = []
        for driver in run.mechanism.drivers[:2]:
            value = float(stretch.value(run.driven(driver.name)[0])[frame])
            if driver.angular:
                parts.append(f"{driver.bodies[1]} at {np.degrees(value):.0f}°".replace("-", "−"))
            else:
                unit = run.mechanism.units.of("length")
                parts.append(f"{driver.name} at {rounded_number(value)} {unit}")
        if np.ptp(run.t) > 0.0:
            t = float(stretch.value(run.t)[frame])
            digits = max(0, 2 - int(np.floor(np.log10(np.ptp(run.t)))))
            parts.append(f"t = {t:.{digits}f} {run.mechanism.units.of('time')}")
        return ", ".join(parts)

    def _arrows(self) -> tuple[list[FilmArrow], list[tuple[float, str, str]]]:
        """Arrows that are shown, and for each kind the pixels of a unit, colour and unit."""
        run, stretch, units = self.main.run, self.stretches[0], self.main.run.mechanism.units
        found: list[FilmArrow] = []
        scales = []
        if "forces" in self.show:
            found += self._forces(run, stretch)
            scales.append(("forces", FORCE if run.has_forces else LOAD, units.of("force")))
        for kind, color, keys, unit in (
            ("velocities", VELOCITY, ("vx", "vy"), units.of("velocity")),
            ("accelerations", ACCELERATION, ("ax", "ay"), units.of("acceleration")),
        ):
            if kind in self.show and (kind == "velocities" or run.analysis != "close_loops"):
                found += self._rates(kind, color, keys)
                scales.append((kind, color, unit))
        kept, keys_of = [], []
        for kind, color, unit in scales:
            own = [one for one in found if one.kind == kind]
            peak = max((float(np.nanmax(np.hypot(*one.vector.T))) for one in own), default=0.0)
            if peak > 0.0:
                by = ARROW * self.point / peak
                for one in own:
                    one.vector = one.vector * by
                kept += own
                value = nice(0.6 * peak)
                keys_of.append((by * value, f"{rounded_number(value)} {unit}", color))
        return kept, keys_of

    def _forces(self, run: Solution, stretch: Stretch) -> list[FilmArrow]:
        found = []
        pose = Pose(run, 0)
        for name, _, _, color, _ in forces_shown(pose, run.has_forces):
            if color == LOAD:
                load = run.load(name)
                site = pose.site(run.mechanism[name], "at")
                place = moved(stretch, site)
                vector = np.column_stack([stretch.value(load.fx), stretch.value(load.fy)])
                found.append(FilmArrow("forces", symbolic(name), color, place, vector))
        if run.has_forces:
            for joint in run.mechanism.joints:
                name, on = force_names(run.mechanism)[joint.name]
                own, at = run.reaction(joint.name, on), run.reaction_point(joint.name)
                aside = line_of_action(run, joint, self.main.enlarged).T
                pairs = zip(at, aside, strict=True)
                place = np.column_stack([stretch.value(part + more) for part, more in pairs])
                vector = np.column_stack([stretch.value(own.fx), stretch.value(own.fy)])
                text = notation(name) if len(run.mechanism.joints) <= FORCES else ""
                found.append(FilmArrow("forces", text, FORCE, place, vector))
        for name, where, force in contact_arrows(run):
            place = np.column_stack([stretch.value(part) for part in where.T])
            vector = np.column_stack([stretch.value(part) for part in force.T])
            found.append(FilmArrow("forces", symbolic(name), FORCE, place, vector))
        return found

    def _rates(self, kind: str, color: str, keys: tuple[str, str]) -> list[FilmArrow]:
        run, stretch, pose = self.main.run, self.stretches[0], Pose(self.main.run, 0)
        found: list[FilmArrow] = []
        seen: list[Array] = []
        for body in run.mechanism.bodies:
            places_on: list[tuple[Place, Any]] = [((body.name, 0.0, 0.0), run[body.name])]
            for point in body.points:
                history = run.point(f"{body.name}.{point}")
                at = np.array([history.x[0], history.y[0]])
                places_on.append((pose.fixed(body.name, at), history))
            for site, history in places_on:
                way = moved(stretch, site)
                middle = way[[0, len(way) // 3]]
                if any(np.abs(middle - other).max() < 1e-6 * run.system.length for other in seen):
                    continue
                seen.append(middle)
                parts = [stretch.value(getattr(history, key)) for key in keys]
                found.append(FilmArrow(kind, "", color, way, np.column_stack(parts)))
        return found

    def title_size(self) -> float:
        """Height of the letters of the title [pixels], so that it fits into the width."""
        room = self.width - 2 * MARGIN
        return float(min(TITLE, max(SMALLEST, room / (LETTER * max(1, len(self.title()))))))

    def title(self) -> str:
        """The name of the mechanism."""
        return self.main.run.mechanism.name

    def scale_bar(self) -> tuple[float, str]:
        """Length in pixels of a round length, and its text."""
        length = nice(70.0 / self.scale)
        unit = self.main.run.mechanism.units.of("length")
        return length * self.scale, f"{rounded_number(length)} {unit}"
