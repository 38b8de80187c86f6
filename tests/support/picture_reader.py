"""The reader of a picture: its artists, its arrows, and how near a point is to an outline."""

import numpy as np


def artists(figure):
    """All named artists of a drawing, by name."""
    axes = figure.axes[0]
    found = [a for a in (*axes.patches, *axes.lines, *axes.texts) if a.get_gid()]
    return {artist.get_gid(): artist for artist in found}


def arrow(drawn, name):
    """Tail and tip of an arrow."""
    tail = drawn[name].get_xydata()[0]
    return tail, drawn[f"{name}.head"].get_xy()[0]


def inside(figure):
    """Whether everything named, and every text, lies within the figure."""
    canvas = figure.canvas
    canvas.draw()
    whole = figure.bbox
    for artist in (*artists(figure).values(), *figure.axes[0].texts):
        box = artist.get_window_extent(canvas.get_renderer())
        assert box.x0 > whole.x0 and box.x1 < whole.x1, artist
        assert box.y0 > whole.y0 and box.y1 < whole.y1, artist
    return True


def gap(point, outline):
    """How far a point is from a closed outline."""
    a = np.asarray(outline)
    way = np.roll(a, -1, axis=0) - a
    square = np.maximum((way**2).sum(axis=1), 1e-300)
    part = np.clip(((point - a) * way).sum(axis=1) / square, 0.0, 1.0)
    return float(np.hypot(*(a + part[:, None] * way - point).T).min())
