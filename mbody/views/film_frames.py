"""The frames of a film: places between instants, and every shape of them in pixels."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from types import SimpleNamespace
from typing import Any

import numpy as np

from mbody.core.tolerances import DRAWN_RETURNS, PRINTED_NONE
from mbody.quantities.evaluate import place_in_turn
from mbody.solution.doubts import inherited
from mbody.solution.histories import Place, moved
from mbody.solution.known_forces import every_force
from mbody.solution.solution import Solution
from mbody.summaries.text_table import force_names
from mbody.views.acting import (
    CONSTRUCTION,
    contact_arrows,
    drawn_forces,
    line_of_action,
    notation,
    sign_history,
)
from mbody.views.labels import (
    ARROW_WEIGHT,
    CLEAR,
    COVERED,
    FONTS,
    FORCE,
    INK,
    LOAD,
    MATHS,
    OUTLINE_WEIGHT,
    PAPER,
    SIZE,
    SOFT,
    FreePlaces,
    Spots,
    drawable,
    extent,
    places_alongside,
    places_around,
    places_by_arrow,
    places_within,
    styled,
    symbolic,
)
from mbody.views.page_data import coupler_points, text_runs
from mbody.views.scene import scene
from mbody.views.shapes import Carrier, Pose, heading
from mbody.views.sketch import KeptShape, key_size, rounded

Array = np.ndarray

#: Seconds that a film lasts where the motion itself would be too quick or too slow to follow.
SHORTEST, LONGEST, USUAL = 2.0, 20.0, 6.0
#: Height of the letters of a title [pixels], as it is and at least, and the width of one beside it.
TITLE, SMALLEST, LETTER = 17.0, 9.0, 0.54
#: Pixels: the margin, the title above and the scales below.
#: What a camera shows, as a part of the size of the mechanism at first; where mass centres stay, as
#: a part of half of that.
CAMERA_ROOM, CAMERA_INNER = 1.6, 0.35
MARGIN, ABOVE, BELOW = 26, 46, 30
#: With more joints than this their forces have no names, which could not be read.
FORCES = 30
#: Names of the shapes of mass centres.
CENTRES = ("cg:", "centre:", "tie:")
#: Length of the longest arrow, in points of the paper.
ARROW = SIZE["arrow"]
VELOCITY, ACCELERATION = "#8a3ab9", "#a8650a"


class Stretch:
    """A motion at places between its instants: what the carriers of shapes read of a run."""

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
    closes = all(
        abs(np.exp(1j * run[b.name].angle[-1]) - np.exp(1j * run[b.name].angle[0])) < DRAWN_RETURNS
        and abs(run[b.name].x[-1] - run[b.name].x[0]) < DRAWN_RETURNS * run.system.length
        and abs(run[b.name].y[-1] - run[b.name].y[0]) < DRAWN_RETURNS * run.system.length
        for b in run.mechanism.bodies
    )
    parts = np.linspace(0.0, 1.0, count, endpoint=not closes)
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
    """Data shared by all frames of a film: the scenes, the canvas, paths and arrows."""

    def __init__(
        self,
        runs: Mapping[str, Solution],
        count: int,
        width: int,
        show: Sequence[str],
        paths: Sequence[str] | None,
        *,
        moves: bool = True,
        span: float | None = None,
    ) -> None:
        self.scenes = [scene(run, moves=moves, span=span) for run in runs.values()]
        shown = [every_force] if "forces" in show else []
        known = [inherited(run, of=shown)["notes"] for run in runs.values()]
        self.notes = list(dict.fromkeys((*self.scenes[0].notes, *itertools.chain(*known))))
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
        self.low, self.high = low, high
        self.fit(low, high, width)
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
            self.fit(low, high, width)
            self.arrows, self.scales = self._arrows()

    def fit(self, low: Array, high: Array, width: int) -> None:
        """The scale by which a rectangle fits a canvas of that width."""
        wide, tall = np.maximum(high - low, PRINTED_NONE * self.main.run.system.length)
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
            if shape.sign_condition and not self.there(shape, n)[frame]:
                continue
            axes = self.carried[n][shape.carrier]
            yield shape, self.pixels(shape.carrier.in_world(shape.points, axes, frame))

    def left_out(self, shape: KeptShape) -> bool:
        """Whether a shape is of a kind that is not shown."""
        name, show = shape.look.name, self.show
        return ("centres" not in show and name.startswith(CENTRES)) or (
            "forces" not in show and name.startswith(CONSTRUCTION)
        )

    def there(self, shape: KeptShape, n: int) -> Array:
        """In which frames a shape is there that depends on the sign of a quantity."""
        quantity, sign = shape.sign_condition or ("t", 1.0)
        if (n, quantity) not in self._signs:
            history = sign_history(self.scenes[n].run, quantity, "forces" in self.show)
            self._signs[n, quantity] = self.stretches[n].value(history)
        return np.asarray(sign * self._signs[n, quantity] > 0.0)

    def labels(self, frame: int) -> Iterator[tuple[Any, Array, Array]]:
        """Names with the anchor in pixels, and the direction from there."""
        if "names" not in self.show:
            return
        for label in self.main.labels:
            axes = self.carried[0][label.carrier]
            place = label.carrier.in_world(label.anchor, axes, frame)[0]
            outward = label.direction
            if label.rotates:
                _, u, _ = (part[frame] for part in axes)
                outward = np.array(
                    [u[0] * outward[0] - u[1] * outward[1], u[1] * outward[0] + u[0] * outward[1]]
                )
            yield label, self.pixels(place), outward

    def instant(self, frame: int) -> str:
        """Drivers and time of a frame, in words."""
        run, stretch = self.main.run, self.stretches[0]
        parts = []
        for driver in run.mechanism.drivers[:2]:
            value = float(stretch.value(run.driven(driver.name)[0])[frame])
            if driver.angular:
                degrees = f"{place_in_turn(value):.0f}°".replace("-", "−")
                parts.append(f"{driver.bodies[1]} at {degrees}")
            else:
                parts.append(f"{driver.name} at {rounded(value, 'length', run.mechanism.shown)}")
        if np.ptp(run.t) > 0.0:
            units, own = run.mechanism.shown, stretch.value(run.t)[frame]
            t, span = (float(units.converted(one, "time")) for one in (own, np.ptp(run.t)))
            digits = max(0, 2 - int(np.floor(np.log10(span))))
            parts.append(f"t = {t:.{digits}f} {units.of('time')}")
        return ", ".join(parts)

    def _arrows(self) -> tuple[list[FilmArrow], list[tuple[float, str, str]]]:
        """Arrows that are shown, and for each kind the pixels of a unit, colour and unit."""
        run, stretch, units = self.main.run, self.stretches[0], self.main.run.mechanism.shown
        found: list[FilmArrow] = []
        scales = []
        if "forces" in self.show:
            found += self._forces(run, stretch)
            scales.append(("forces", FORCE if run.has_forces else LOAD, "force"))
        for kind, color, keys, dimension in (
            ("velocities", VELOCITY, ("vx", "vy"), "velocity"),
            ("accelerations", ACCELERATION, ("ax", "ay"), "acceleration"),
        ):
            if kind in self.show and (kind == "velocities" or run.analysis != "close_loops"):
                found += self._rates(kind, color, keys)
                scales.append((kind, color, dimension))
        kept, keys_of = [], []
        for kind, color, dimension in scales:
            own = [one for one in found if one.kind == kind]
            peak = max((float(np.nanmax(np.hypot(*one.vector.T))) for one in own), default=0.0)
            if peak > 0.0:
                by = ARROW * self.point / peak
                for one in own:
                    one.vector = one.vector * by
                kept += own
                value, text = key_size(0.6 * peak, dimension, units)
                keys_of.append((by * value, text, color))
        return kept, keys_of

    def _forces(self, run: Solution, stretch: Stretch) -> list[FilmArrow]:
        found = []
        pose = Pose(run, 0)
        for name, _, _, color, _ in drawn_forces(pose, run.has_forces):
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
                path = moved(stretch, site)
                middle = path[[0, len(path) // 3]]
                if any(
                    np.abs(middle - other).max() < DRAWN_RETURNS * run.system.length
                    for other in seen
                ):
                    continue
                seen.append(middle)
                parts = [stretch.value(getattr(history, key)) for key in keys]
                found.append(FilmArrow(kind, "", color, path, np.column_stack(parts)))
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
        length, text = key_size(70.0 / self.scale, "length", self.main.run.mechanism.shown)
        return length * self.scale, text


# -- Places of names in the frames of a film ---------------------------------------------------

#: Text beside a picture, in pixels a point of the paper.
TEXT = 1.35
#: Circles that no name should cover.
SIGNS = ("pin:", "cg:")


@dataclass
class FilmName:
    """A name in all frames.

    `size`: Of its letters, in parts of those of the paper.
    `at` (frames, 2): Its middle in pixels, y up; NaN in frames where there is no room for it.
    """

    text: str
    color: str
    italic: bool
    size: float
    at: Array
    half: Array
    spot: int = -1

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height in pixels."""
        return 2.0 * float(self.half[0]), 2.0 * float(self.half[1])


@functools.lru_cache(maxsize=1)
def film_names(film: FilmSet) -> list[FilmName]:
    """The names of a film: pins, elements and links first, then forces."""
    size, count = TEXT * min(film.point, 1.15), len(film.stretches[0])

    def named(text: str, color: str, italic: bool) -> FilmName:
        half = 0.5 * np.array(extent(text, round(SIZE["text"] * size, 3), italic)) + (2.0, 1.0)
        return FilmName(text, color, italic, size, np.full((count, 2), np.nan), half)

    labels = film.main.labels if "names" in film.show else []
    names = [named(one.text, one.color or INK, one.italic) for one in labels]
    arrows = [one for one in film.arrows if one.text]
    forces = [named(one.text, one.color, False) for one in arrows]
    for frame in range(count if names or forces else 0):
        placed_labels = list(film.labels(frame))
        places = _occupied(film, frame)
        for label, anchor, _ in placed_labels:
            if not label.rotates:
                places.stroke(np.array([anchor, anchor]), 1.5, ARROW_WEIGHT)
        for name, (label, anchor, outward) in zip(names, placed_labels, strict=True):
            gap = label.gap * film.scale + 1.5 * film.point
            if not outward.any():
                spots = places_within(anchor, name.extent)
            elif label.rotates:
                spots = places_alongside(anchor, name.extent, gap, outward)
            else:
                spots = places_around(anchor, name.extent, gap, heading(outward))
            _put(places, name, frame, spots)
        for name, one in zip(forces, arrows, strict=True):
            place, vector = film.pixels(one.place[frame]), one.vector[frame]
            if np.hypot(*vector) > 2.5 and np.isfinite(place + vector).all():
                spots = places_by_arrow(place, vector, name.extent)
                _put(places, name, frame, spots)
    return [*names, *forces]


def _occupied(film: FilmSet, frame: int) -> FreePlaces:
    """What names had better not cover: arrows, pins, mass centres and outlines of links."""
    places = FreePlaces(1.0, (film.width, film.height))
    for one in film.arrows:
        place, vector = film.pixels(one.place[frame]), one.vector[frame]
        if np.isfinite(place + vector).all():
            places.stroke(np.array([place, place + vector]), 1.5, ARROW_WEIGHT)
    for shape, outline in film.shapes(frame):
        if shape.kind == "circle" and shape.look.name.startswith(SIGNS):
            radius = shape.radius * film.scale
            places.stroke(np.vstack([outline, outline]), radius, ARROW_WEIGHT)
        if shape.kind == "polygon" and shape.look.name.startswith("link:"):
            places.stroke(np.vstack([outline, outline[:1]]), 0.5, OUTLINE_WEIGHT)
    return places


def _put(places: FreePlaces, name: FilmName, frame: int, spots: Spots) -> None:
    """Put a name at the place of least cost, or leave it out of the frame."""
    name.spot, _, covered = places.best(spots, *name.extent, name.spot)
    was = frame == 0 or np.isfinite(name.at[frame - 1, 0])
    if covered <= (COVERED if was else CLEAR):
        x, y, _ = spots[name.spot]
        name.at[frame] = x, y
        places.occupy(x, y, *name.extent)


# -- Frames of a film as pixels, painted by the renderer that paints our pictures --------------


def painted(film: FilmSet, frame: int) -> Array:
    """One frame as an array (height, width, 3) of bytes."""
    canvas = _Canvas(film.width, film.height)
    for track in film.paths.values():
        canvas.line(film.pixels(track), SOFT, 1.1 * film.point, (5.0, 3.5))
    for n in range(len(film.scenes) - 1, -1, -1):
        for shape, points in film.shapes(frame, n):
            look, faded = shape.look, 0.3 if n else 1.0
            width = look.width * film.point
            dashes = () if look.dashes == "-" else tuple(d * width for d in look.dashes[1])
            if shape.kind == "circle":
                points = _circle(points[0], shape.radius * film.scale)
            if look.halo:
                canvas.line(points, PAPER, width + 2.4 * film.point, (), faded)
            edge = "none" if not look.width else look.edge
            closed = shape.kind != "line"
            canvas.shape(
                points, look.fill if closed else "none", edge, width, dashes, closed, faded
            )
    for one in film.arrows:
        place, vector = film.pixels(one.place[frame]), one.vector[frame]
        if np.hypot(*vector) > 2.5 and np.isfinite(vector).all():
            canvas.shape(arrow_corners(place, vector, film.point), one.color, PAPER, 0.8, (), True)
    for name in film_names(film):
        if np.isfinite(name.at[frame, 0]):
            canvas.text(name.text, name.at[frame], name.color, name.size, italic=name.italic)
    top = film.height - MARGIN
    canvas.text(
        drawable_title(film.title()), (MARGIN, top), INK, 0.1 * film.title_size(), left=True
    )
    canvas.text(film.instant(frame), (MARGIN, top - 0.5 * ABOVE), SOFT, 1.4, left=True)
    _scales(canvas, film)
    return canvas.pixels()


class Camera:
    """Pictures of a motion, instant by instant as it is computed, all of one size and scale: what
    leaves the canvas is followed.
    """

    def __init__(self, width: int = 480) -> None:
        self.width = width
        self.span: float | None = None
        self.middle = np.zeros(2)

    def picture(self, run: Solution) -> Array:
        """The last instant of a motion as an array (height, width, 3) of bytes."""
        with styled():
            if self.span is None:
                first = self._film(run)
                self.span = CAMERA_ROOM * float((first.high - first.low).max())
                self.middle = 0.5 * (first.low + first.high)
            bodies = [run[one.name] for one in run.mechanism.bodies]
            centres = np.array([[one.x[-1], one.y[-1]] for one in bodies]) - self.middle
            room = CAMERA_INNER * self.span
            self.middle = self.middle + np.maximum(centres.max(axis=0) - room, 0.0)
            self.middle = self.middle + np.minimum(centres.min(axis=0) + room, 0.0)
            film = self._film(run)
            film.fit(self.middle - 0.5 * self.span, self.middle + 0.5 * self.span, self.width)
            return painted(film, 0)

    def _film(self, run: Solution) -> FilmSet:
        return FilmSet({"": run}, 1, self.width, ("names",), (), span=self.span, moves=False)


def drawable_title(text: str) -> str:
    """A title without mathematics."""
    return text.replace("$", r"\$")


def _scales(canvas: _Canvas, film: FilmSet) -> None:
    """Scales of lengths and arrows in the lower left corner."""
    x, y = float(MARGIN), 20.0
    length, text = film.scale_bar()
    bar = [
        (x, y + 4),
        (x, y - 4),
        (x, y),
        (x + length, y),
        (x + length, y + 4),
        (x + length, y - 4),
    ]
    canvas.line(np.array(bar), SOFT, 1.3)
    x = canvas.text(text, (x + length + 7.0, y), SOFT, 1.3, left=True) + 18.0
    for long, text, color in film.scales:
        corners = arrow_corners(np.array([x, y]), np.array([long, 0.0]), film.point)
        canvas.shape(corners, color, color, 0.3, (), True)
        x = canvas.text(text, (x + long + 7.0, y), color, 1.3, left=True) + 18.0


def arrow_corners(place: Array, vector: Array, point: float) -> Array:
    """The outline of an arrow from a place, in pixels."""
    length = float(np.hypot(*vector))
    u = vector / length
    n = np.array([-u[1], u[0]])
    head, half = min(8.0 * point, 0.6 * length), 0.85 * point
    neck = length - head
    parts = [(0, half), (neck, half), (neck, 0.4 * head), (length, 0.0)]
    parts += [(a, -b) for a, b in reversed(parts[:3])]
    return np.array([place + a * u + b * n for a, b in parts])


def _circle(centre: Array, radius: float) -> Array:
    angles = np.linspace(0.0, math.tau, max(24, min(180, int(radius))), endpoint=False)
    return np.asarray(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


@functools.lru_cache(maxsize=512)
def _text(text: str, size: float, italic: bool = False) -> tuple[Any, tuple[float, float], Any]:
    """The outline of a text, its width and height in pixels, and its corners."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    look: dict[str, Any] = {"style": "italic" if italic else "normal"}
    font = FontProperties(family=FONTS, math_fontfamily=MATHS, **look)
    path = TextPath((0, 0), drawable(text), size=SIZE["text"] * size, prop=font)
    box = path.get_extents()
    extent = (float(box.width), max(float(box.height), 0.7 * SIZE["text"] * size))
    return path, extent, (float(box.x0), float(box.x1), float(box.y0), float(box.y1))


class _Canvas:
    """Paths on an array of bytes, y up."""

    def __init__(self, width: int, height: int) -> None:
        from matplotlib.backends.backend_agg import RendererAgg

        made: Any = RendererAgg
        self.renderer: Any = made(width, height, 72.0)
        self.size = (width, height)
        corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=float)
        self.shape(corners, PAPER, "none", 0.0, (), True)

    def shape(
        self,
        points: Array,
        fill: str,
        edge: str,
        width: float,
        dashes: tuple[float, ...] = (),
        closed: bool = False,
        faded: float = 1.0,
    ) -> None:
        """An outline, filled or not."""
        from matplotlib.path import Path

        codes = None
        points = np.asarray(points, dtype=float)
        if closed:
            points = np.vstack([points, points[:1]])
            codes = [Path.MOVETO, *[Path.LINETO] * (len(points) - 2), Path.CLOSEPOLY]
        self._draw(Path(points, codes), fill, edge, width, dashes, faded)

    def line(
        self,
        points: Array,
        color: str,
        width: float,
        dashes: tuple[float, ...] = (),
        faded: float = 1.0,
    ) -> None:
        """A line; NaN interrupts it."""
        self.shape(points, "none", color, width, dashes, False, faded)

    def text(
        self,
        text: str,
        at: Any,
        color: str,
        size: float,
        *,
        italic: bool = False,
        left: bool = False,
    ) -> float:
        """A text about a place, or from it; returns its right end."""
        from matplotlib.transforms import Affine2D

        if not text.strip():
            return float(at[0])
        path, (wide, _), (x0, x1, y0, y1) = _text(text, round(size, 3), italic)
        x = float(at[0]) - (x0 if left else 0.5 * (x0 + x1))
        base = 0.5 * (y0 + y1) if not left else 0.32 * SIZE["text"] * size
        y = float(at[1]) - base
        move = Affine2D().translate(x, y)
        self._draw(path, PAPER, PAPER, 3.0, (), 1.0, move)
        self._draw(path, color, "none", 0.0, (), 1.0, move)
        return float(at[0]) + (wide if left else 0.5 * wide)

    def _draw(
        self,
        path: Any,
        fill: str,
        edge: str,
        width: float,
        dashes: tuple[float, ...],
        faded: float,
        move: Any = None,
    ) -> None:
        from matplotlib.colors import to_rgb
        from matplotlib.transforms import IdentityTransform

        gc = self.renderer.new_gc()
        gc.set_linewidth(width if edge != "none" else 0.0)
        if edge != "none":
            gc.set_foreground(edge)
        gc.set_alpha(faded)
        gc.set_joinstyle("round")
        gc.set_capstyle("round" if not dashes else "butt")
        if dashes:
            gc.set_dashes(0, list(dashes))
        gc.set_antialiased(True)
        face = None if fill == "none" else to_rgb(fill)
        self.renderer.draw_path(gc, path, move or IdentityTransform(), face)
        gc.restore()

    def pixels(self) -> Array:
        """The array (height, width, 3)."""
        return np.asarray(self.renderer.buffer_rgba())[:, :, :3].copy()


# -- A film as SVG, which browsers play without scripts (SMIL) ---------------------------------

SERIF = "STIX Two Text, Cambria, Georgia, Times New Roman, serif"
SANS = "system-ui, Segoe UI, Roboto, Arial, sans-serif"


def film_svg(film: FilmSet, seconds: float) -> str:
    """The text of the file."""
    wide, tall = film.width, film.height
    title = escape(film.title())
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {tall}" width="{wide}" '
        f'height="{tall}" role="img" aria-label="{title}">',
        f"<title>{title}</title>",
        f'<rect width="{wide}" height="{tall}" fill="{PAPER}"/>',
        _svg_text(film.title(), MARGIN, MARGIN + 6, INK, film.title_size(), "start", SANS),
    ]
    still = film.stretches[0]
    count = len(still)
    timing = f'dur="{seconds:.3f}s" repeatCount="indefinite"'
    closed = not np.isclose(film.at[0][-1], len(film.main.run) - 1)
    # the last frame of what closes on itself leads to the first
    order = [*range(count), 0] if closed else list(range(count))
    for track in film.paths.values():
        line = _path(_down(film, film.pixels(track)), False)
        look = f'stroke="{SOFT}" stroke-width="{1.1 * film.point:.2f}" stroke-dasharray="6 4"'
        parts.append(f'<path d="{line}" fill="none" {look}/>')
    for n in range(len(film.scenes) - 1, -1, -1):
        parts.append(f'<g opacity="{0.3 if n else 1}" stroke-linejoin="round">')
        parts += _shapes(film, n, order, timing)
        parts.append("</g>")
    for one in film.arrows:
        parts += _arrow(film, one, order, timing)
    for name in film_names(film):
        parts.append(_name(film, name, order, timing))
    parts += _svg_scales(film)
    parts.append("</svg>\n")
    return "\n".join(parts)


def _down(film: FilmSet, pixels: Array) -> Array:
    """Pixels with y down."""
    return np.column_stack([pixels[..., 0], film.height - pixels[..., 1]])


def _path(points: Array, closed: bool) -> str:
    text, pen = "", False
    for x, y in points.tolist():
        if x != x:
            pen = False
            continue
        text += f"{'L' if pen else 'M'}{x:.1f} {y:.1f}"
        pen = True
    return text + ("Z" if closed else "")


def _look(film: FilmSet, shape: Any) -> str:
    look = shape.look
    width = look.width * film.point
    fill = "none" if shape.kind == "line" else look.fill
    found = f'fill="{fill}" stroke="{look.edge if look.width else "none"}"'
    found += f' stroke-width="{width:.2f}" stroke-linecap="round"'
    if look.dashes != "-":
        found += f' stroke-dasharray="{" ".join(f"{d * width:.1f}" for d in look.dashes[1])}"'
    return found


def _shapes(film: FilmSet, n: int, order: list[int], timing: str) -> list[str]:
    """Shapes in groups that follow their carriers; what stretches has an outline for each frame."""
    scene, found = film.scenes[n], []
    last: Any = None
    for shape in scene.shapes:
        if film.left_out(shape):
            continue
        carrier = shape.carrier
        axes = film.carried[n][carrier]
        if carrier.stretches:
            if last is not None:
                found.append("</g></g>")
                last = None
            lines = [
                _path(
                    _down(film, film.pixels(carrier.in_world(shape.points, axes, k))),
                    shape.kind == "polygon",
                )
                for k in order
            ]
            values = ";".join(lines)
            found.append(
                f'<path {_look(film, shape)}><animate attributeName="d" values="{values}" '
                f"{timing}/></path>"
            )
            continue
        if carrier != last:
            if last is not None:
                found.append("</g></g>")
            found.append(_carried(film, axes, order, timing))
            last = carrier
        visibility = ""
        if shape.sign_condition:
            states = ";".join("visible" if film.there(shape, n)[k] else "hidden" for k in order)
            visibility = f'<animate attributeName="visibility" values="{states}" {timing}/>'
        # in the axes of the carrier, y down
        own = shape.points * (film.scale, -film.scale)
        if shape.kind == "circle":
            (x, y), r = own[0], shape.radius * film.scale
            at = f'cx="{x:.2f}" cy="{y:.2f}" r="{r:.2f}"'
            found.append(f"<circle {at} {_look(film, shape)}>{visibility}</circle>")
        else:
            line = _path(own, shape.kind == "polygon")
            found.append(f'<path d="{line}" {_look(film, shape)}>{visibility}</path>')
    if last is not None:
        found.append("</g></g>")
    return found


def _carried(film: FilmSet, axes: tuple[Array, Array, Array], order: list[int], timing: str) -> str:
    """The opening of a group that moves with a carrier."""
    origin = _down(film, film.pixels(axes[0]))[order]
    # angles go on without jumps, so that nothing turns back between two frames
    angles = -np.degrees(np.unwrap(np.arctan2(axes[1][order, 1], axes[1][order, 0])))
    if np.ptp(origin, axis=0).max() < DRAWN_RETURNS and np.ptp(angles) < DRAWN_RETURNS:
        (x, y), rotation = origin[0], angles[0]
        return f'<g transform="translate({x:.2f} {y:.2f})"><g transform="rotate({rotation:.3f})">'
    moves = ";".join(f"{x:.2f} {y:.2f}" for x, y in origin.tolist())
    rotations = ";".join(f"{a:.3f}" for a in angles.tolist())
    transform = '<animateTransform attributeName="transform"'
    return (
        f'<g>{transform} type="translate" values="{moves}" {timing}/>'
        f'<g>{transform} type="rotate" values="{rotations}" {timing}/>'
    )


def _arrow(film: FilmSet, one: Any, order: list[int], timing: str) -> list[str]:
    lines = []
    for k in order:
        place, vector = film.pixels(one.place[k]), one.vector[k]
        long = float(np.hypot(*vector))
        # an outline of as many corners in every frame, which a browser can move
        vector = vector if np.isfinite(long) and long > 1e-3 else np.array([1e-3, 0.0])
        corners = arrow_corners(place, vector, film.point)
        lines.append(_path(_down(film, corners), True))
    found = [
        f'<path fill="{one.color}"><animate attributeName="d" values="{";".join(lines)}" '
        f"{timing}/></path>"
    ]
    return found


def _moving_text(
    text: str, moves: str, color: str, size: int, italic: bool, timing: str, visibility: str
) -> str:
    style = "italic" if italic else "normal"
    return (
        f'<g><animateTransform attributeName="transform" type="translate" values="{moves}" '
        f'{timing}/>{visibility}<text font-family="{SERIF}" font-size="{size}" '
        f'font-style="{style}" fill="{color}" text-anchor="middle" stroke="{PAPER}" '
        f'stroke-width="3" paint-order="stroke">{_runs(text)}</text></g>'
    )


def _runs(text: str) -> str:
    return "".join(
        f'<tspan font-size="10" dy="3">{escape(part)}</tspan><tspan dy="-3">\u200b</tspan>'
        if how == "sub"
        else f"<tspan>{escape(part)}</tspan>"
        for part, how in text_runs(text)
    )


def _name(film: FilmSet, name: FilmName, order: list[int], timing: str) -> str:
    """A name that moves; in frames without room for it, it is hidden where it was."""
    there = np.isfinite(name.at[:, 0])
    if not there.any():
        return ""
    placed = np.flatnonzero(there)
    at = name.at[placed[np.clip(np.searchsorted(placed, order, "right") - 1, 0, None)]]
    moves = ";".join(f"{x:.1f} {film.height - y + 4.5:.1f}" for x, y in at.tolist())
    italic = name.italic or name.text.startswith("$")
    visibility = ""
    if not there.all():
        states = ";".join("visible" if there[k] else "hidden" for k in order)
        visibility = f'<animate attributeName="visibility" values="{states}" {timing}/>'
    return _moving_text(name.text, moves, name.color, 14, italic, timing, visibility)


def _svg_text(
    text: str, x: float, y: float, color: str, size: float, anchor: str, family: str
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" font-size="{size:.3g}" '
        f'text-anchor="{anchor}" font-family="{family}">{escape(text)}</text>'
    )


def _svg_scales(film: FilmSet) -> list[str]:
    x, y = float(MARGIN), film.height - 20.0
    length, text = film.scale_bar()
    bar = f"M{x} {y - 4}V{y + 4}M{x} {y}H{x + length:.1f}M{x + length:.1f} {y - 4}V{y + 4}"
    found = [f'<path d="{bar}" fill="none" stroke="{SOFT}" stroke-width="1.3"/>']
    found.append(_svg_text(text, x + length + 7, y + 4, SOFT, 13, "start", SANS))
    x += length + 7 + 8.0 * len(text) + 16
    for long, words, color in film.scales:
        corners = arrow_corners(np.array([x, 20.0]), np.array([long, 0.0]), film.point)
        found.append(f'<path d="{_path(_down(film, corners), True)}" fill="{color}"/>')
        found.append(_svg_text(words, x + long + 7, y + 4, color, 13, "start", SANS))
        x += long + 7 + 8.0 * len(words) + 16
    return found
