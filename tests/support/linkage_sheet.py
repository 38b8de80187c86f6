"""The sheet of random linkages on the page about them: one of each topology, with joints' paths."""

from pathlib import Path

import matplotlib

matplotlib.use("agg")

import numpy as np
from matplotlib.figure import Figure

import mbody
from mbody.topologies.dataset import random_linkages
from mbody.views import save
from mbody.views.labels import CURVES, DRIVER, GROUND, INK, PAPER, SOFT

#: Rows of the sheet: groups, joints, seed, whether the last group must be larger than a dyad.
ROWS = ((("dyads",), 8, 4), (("dyads", "sliders"), 8, 2), (("dyads", "triads", "assur"), 8, 9))
COLUMNS = 6
#: Of the margin, so that no picture is one of bars in line.
LEAST = 0.02


def linkage_sheet(folder: Path) -> str:
    """Write the picture; its name."""
    figure = Figure(figsize=(7.2, 4.1))
    figure.patch.set_facecolor(PAPER)
    axes = figure.subplots(len(ROWS), COLUMNS)
    for own, (groups, nodes, seed) in zip(axes, ROWS, strict=True):
        arrays = random_linkages(60, nodes, np.random.default_rng(seed), groups)
        found = mbody.linkages(arrays, instants=73)
        for axis, n in zip(own, chosen(arrays, found, groups), strict=True):
            one(axis, arrays, found, n)
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.99, 0.06, 0.06)
    save(figure, folder / "linkages.svg")
    return "linkages.svg"


def chosen(arrays, found, groups):
    """The linkage of each topology that keeps farthest from singular positions."""
    best = {}
    for n in np.argsort(-np.nan_to_num(found.margin)):
        special = "dyads" in groups and len(groups) == 1
        special |= (arrays["slides"][n] >= 0).any() if "sliders" in groups else False
        # a triangle of bars or a link of three joints
        special |= "assur" in groups and not of_dyads(arrays["links"][n])
        if special and found.margin[n] > LEAST and coupler(arrays, found, n) is not None:
            best.setdefault(int(found.topology[n]), int(n))
    return list(best.values())[:COLUMNS]


def coupler(arrays, found, n):
    """The joint with the longest path of those that do not turn about the ground; None where there
    is none that moves.
    """
    turning = {int(k) for link in arrays["links"][n] if {0, 2} & set(link.tolist()) for k in link}
    turning |= {int(k) for k, _ in arrays["slides"][n]}
    own = [k for k in range(3, arrays["joints"].shape[1]) if k not in turning]
    lengths = {k: np.hypot(*np.diff(found.positions[n, :, k], axis=0).T).sum() for k in own}
    return max(own, key=lengths.get) if own and max(lengths.values()) > 0.5 else None


def of_dyads(links):
    """Whether joints can be found one by one, each from two before it."""
    pairs = [tuple(k for k in link if k >= 0) for link in links]
    if any(len(pair) > 2 for pair in pairs):
        return False
    known, grown = {0, 1, 2}, True
    while grown:
        around = {k for pair in pairs for k in pair} - known
        new = {
            k for k in around if sum(k in p and (set(p) - {k}) <= known for p in pairs if p) >= 2
        }
        known |= new
        grown = bool(new)
    return not around


def one(axis, arrays, found, n):
    """One linkage at its start."""
    path, start = found.positions[n], arrays["joints"][n]
    links = [[k for k in link if k >= 0] for link in arrays["links"][n]]
    shown = coupler(arrays, found, n)
    for k in np.flatnonzero(np.ptp(path, axis=0).max(axis=1) > 0.0):
        look = {"color": CURVES[1][0], "lw": 1.4} if k == shown else {"color": SOFT, "lw": 0.5}
        # thin lines have fewer points, which keeps the file small
        axis.plot(*path[:: 1 if k == shown else 2, k].T, zorder=1, **look)
    crank, *others = links
    for link in others:
        if len(link) > 2:
            axis.fill(*start[link].T, fc="#dde5ec", ec=INK, lw=1.0, zorder=2)
    # all bars are one path of the file, with gaps between them
    bars = [[*start[link], (np.nan, np.nan)] for link in others if len(link) == 2]
    for color, line in ((DRIVER, start[crank]), (INK, np.reshape(bars, (-1, 2)))):
        axis.plot(*line.T, color=color, lw=1.6, zorder=3, solid_capstyle="round")
    reach = np.ptp(path.reshape(-1, 2), axis=0).max()
    for (k, on), angle in zip(arrays["slides"][n], arrays["directions"][n], strict=True):
        if k >= 0:
            u = 0.12 * reach * np.array([np.cos(angle), np.sin(angle)])
            color = GROUND if on < 0 else SOFT
            axis.plot(*np.array([start[k] - u, start[k] + u]).T, color=color, lw=3.0, zorder=2)
    used = sorted({k for link in links for k in link})
    axis.plot(*start[used].T, "o", ms=2.6, mfc=PAPER, mec=INK, mew=0.7, zorder=4, ls="none")
    axis.plot(*start[[0, 2]].T, "s", ms=4.0, mfc=GROUND, mec=INK, mew=0.5, zorder=5, ls="none")
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(0.06)
    axis.set_axis_off()
