"""Films: a motion as GIF, WebP, animated PNG, SVG or MP4."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from mbody.analysis.dynamics.interruptions import counted
from mbody.errors import ModelError, brief
from mbody.files.tables import writing
from mbody.views.film_frames import FilmSet, film_svg, lasting
from mbody.views.labels import styled
from mbody.views.page import check_names, runs_of
from mbody.views.page_data import SECONDS

ENDINGS = ("gif", "webp", "apng", "png", "svg", "mp4")
#: Frames: at least two make a film; more than these would take minutes and fill the memory.
FEWEST, MOST = 2, 3000
#: Pixels of the width.
NARROWEST, WIDEST = 120, 3840
#: Colours of a GIF, which are those of all frames: our drawings have some ten and their shades.
COLORS = 96
#: What is as light as this is paper: pillow compares colours by their upper six bits.
NEARLY_WHITE = 248


def animate(
    model: Any,
    path: str | os.PathLike[str],
    *,
    duration: float | None = None,
    rate: float = 25.0,
    width: int = 640,
    show: Sequence[str] = ("names", "paths", "centres", "ghosts"),
    paths: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | bool | None = None,
) -> list[str]:
    """Write a film of a mechanism in motion; all frames have one scale and one canvas.

    Parameters
    ----------
    model : Solution, Mechanism, System, or several by name in a mapping
        As of `mbody.view`; several are shown with one another.
    path : str or path-like
        A file that ends in .gif, .webp, .apng, .svg (which browsers play, without scripts) or .mp4
        (which needs imageio-ffmpeg).
    duration : float, optional
        Seconds; by default those of the motion where people can follow it, else six.
    rate : float
        Frames a second.
    width : int
        Pixels.
    show : sequence of str
        As of `mbody.view`: "names", "forces", "velocities", "accelerations", "paths", "centres".
    paths : sequence of str, optional
        Points whose paths are shown; by default those at no joint.
    progress : function or bool, optional
        Takes the frames that are done, and all; True shows on standard error how far it is.

    Returns
    -------
    list of str
        Notes, as that instants were left out.

    Raises
    ------
    ModelError
        For another ending, numbers that make no film, a place where no file can be written, or
        where nothing moves or a package is not installed.
    SolveError
        As of the analysis.

    Examples
    --------
    >>> import mbody, pathlib, tempfile
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "turn.svg")
    ...     notes = animate(run, file, duration=2.0)
    ...     file.read_text().count("<animateTransform") > 4
    True
    """
    ending = _ending(path)
    runs = runs_of(model)
    check_names(show)
    first = next(iter(runs.values()))
    second = SECONDS.get(first.mechanism.units.of("time"), 1.0)
    lasts = lasting(first, second) if duration is None else _positive(duration, "duration", "s")
    rate = _positive(rate, "rate", "frames a second")
    if ending == "gif":
        # a GIF counts hundredths of a second
        rate = 100.0 / max(2, round(100.0 / rate))
    count = max(FEWEST, round(lasts * rate))
    if count > MOST:
        raise ModelError(
            f"a film of {lasts:g} s with {rate:g} frames a second has {count} frames, more than "
            f"{MOST}: give a shorter duration, or a lower rate"
        )
    wide = _positive(width, "width", "pixels")
    if not NARROWEST <= wide <= WIDEST:
        raise ModelError(
            f"a film is {NARROWEST} to {WIDEST} pixels wide, not {wide:g}: give another width"
        )
    with styled():
        film = FilmSet(runs, count, int(wide), show, paths)
        if ending == "svg":
            with writing(path) as file:
                file.write(film_svg(film, lasts))
        else:
            seen = counted("frames") if progress is True else progress or None
            frames = _frames(film, count, seen)
            WRITERS[ending](frames, path, lasts / count, film, count)
    return film.notes


def _ending(path: Any) -> str:
    try:
        ending = Path(path).suffix[1:].lower()
    except TypeError:
        raise ModelError(f"a path must be text or path-like, not {path!r}") from None
    if ending not in ENDINGS:
        raise ModelError(
            f"cannot write '{path}': a film is a file that ends in .gif, .webp, .apng, .svg or .mp4"
        )
    return ending


def _positive(value: Any, name: str, unit: str) -> float:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or value <= 0:
        raise ModelError(f"{name} of a film must be a positive number ({unit}), not {brief(value)}")
    return float(value)


def _frames(
    film: FilmSet, count: int, progress: Callable[[int, int], None] | None
) -> Iterator[np.ndarray[Any, Any]]:
    from mbody.views.film_frames import painted

    for frame in range(count):
        yield painted(film, frame)
        if progress is not None:
            progress(frame + 1, count)


def _image_library(ending: str) -> Any:
    """Pillow's images; a sentence where it is not installed."""
    try:
        from PIL import Image
    except ImportError:
        raise ModelError(
            f"a film in .{ending} needs pillow, which is not installed: pip install pillow"
        ) from None
    return Image


def _pictures(frames: Iterator[Any], ending: str, film: FilmSet) -> list[Any]:
    Image = _image_library(ending)
    if ending != "gif":
        return [Image.fromarray(frame) for frame in frames]
    found: list[Any] = []
    palette: Any = None
    for frame in frames:
        picture = Image.fromarray(frame)
        if palette is None:
            samples = Image.fromarray(np.vstack([frame, _ramps(film)]))
            palette = samples.quantize(COLORS, method=Image.Quantize.MEDIANCUT)
            shades = np.array(palette.getpalette(), dtype=np.int64).reshape(-1, 3)
            shades[shades.min(axis=1) >= NEARLY_WHITE] = 255
            palette.putpalette(shades.reshape(-1).tolist())
        # one palette for all frames, without dots: nothing flickers, and files are short
        found.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
    return found


def _ramps(film: FilmSet) -> np.ndarray[Any, Any]:
    """Bands (rows, width, 3) of every colour of a film with its shades: the first frame, from which
    the colours of all are chosen, need not have an arrow that appears later.
    """
    from matplotlib.colors import to_rgb

    shapes = [shape.look for one in film.scenes for shape in one.shapes]
    names = {*(one.color for one in film.arrows), *(look.edge for look in shapes)}
    names |= {look.fill for look in shapes}
    colors = np.array([to_rgb(name) for name in sorted(names - {"none", ""})])
    shade = np.linspace(1.0, 0.0, 8)[:, None]
    bands = [shade * color + (1.0 - shade) for color in colors]
    row = np.repeat(np.concatenate(bands), -(-film.width // 8), axis=0)
    rows = -(-len(row) // film.width)
    whole = np.ones((rows * film.width, 3))
    whole[: len(row)] = row
    tall = np.repeat(whole.reshape(rows, film.width, 3), 4, axis=0)
    return np.asarray(np.round(255.0 * tall), dtype=np.uint8)


def _pillow(ending: str, **options: Any) -> Callable[..., None]:
    def write(frames: Iterator[Any], path: Any, seconds: float, film: FilmSet, count: int) -> None:
        _image_library(ending)
        # the file first: where none can be written, nothing is painted
        with writing(path, binary=True) as file:
            first, *others = _pictures(frames, ending, film)
            first.save(
                file,
                format={"apng": "PNG", "png": "PNG"}.get(ending, ending.upper()),
                save_all=True,
                append_images=others,
                duration=round(1000.0 * seconds) if ending == "gif" else 1000.0 * seconds,
                loop=0,
                **options,
            )

    return write


def _mp4(frames: Iterator[Any], path: Any, seconds: float, film: FilmSet, count: int) -> None:
    try:
        imageio_ffmpeg = import_module("imageio_ffmpeg")
    except ImportError:
        raise ModelError(
            "a film in .mp4 needs imageio-ffmpeg, which is not installed: pip install "
            "imageio-ffmpeg; .webp and .gif need nothing more"
        ) from None
    with writing(path, binary=True):
        pass  # the sentence of a folder that cannot be written
    size = (film.width, film.height)
    sink = imageio_ffmpeg.write_frames(
        str(path), size, fps=1.0 / seconds, codec="libx264", quality=8, macro_block_size=2
    )
    sink.send(None)
    for frame in frames:
        sink.send(np.ascontiguousarray(frame))
    sink.close()


WRITERS: Mapping[str, Callable[..., None]] = {
    "gif": _pillow("gif", optimize=False, disposal=1),
    "webp": _pillow("webp", quality=82, method=3),
    "apng": _pillow("apng", optimize=False),
    "png": _pillow("png", optimize=False),
    "mp4": _mp4,
}
