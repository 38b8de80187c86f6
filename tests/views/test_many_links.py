"""Pictures of very many links: lines in their places; layers, however many links there are."""

import numpy as np
import pytest

from mbody import Gravity, simulate
from mbody.views import draw
from mbody.views.labels import Z
from tests.freedom.test_large_mobility import chain, grid


def test_very_many_short_links_are_lines():
    machine, lengths, angles = chain(400)
    axes = draw(machine).axes[0]
    (lines,) = (line for line in axes.lines if line.get_gid() == "links")
    x = np.asarray(lines.get_xydata())
    ends = np.cumsum(np.column_stack([lengths * np.cos(angles), lengths * np.sin(angles)]), axis=0)
    # each link from the end of the one before to its own, then a gap
    assert x.shape == (3 * 400, 2) and np.isnan(x[2::3]).all()
    assert np.abs(x[1::3] - ends).max() < 1e-9
    assert np.abs(x[3::3] - ends[:-1]).max() < 1e-9
    names = [artist.get_gid() or "" for artist in axes.patches]
    assert [name for name in names if name.startswith(("pin:", "link:"))] == ["pin:j0"]
    assert "support:j0" in names


@pytest.mark.slow
def test_fewer_links_have_symbols_in_their_layer():
    machine = grid(24, 24)
    assert len(machine.bodies) > 1100
    patches = draw(machine).axes[0].patches
    links = [one.get_zorder() for one in patches if (one.get_gid() or "").startswith("link:")]
    assert len(links) == len(machine.bodies)
    assert min(links) == Z["link"] and max(links) < Z["block"]
    assert len({*links}) == len(links)


def test_lines_of_other_instants_are_faded():
    machine = chain(210)[0]
    machine.add(Gravity("g", y=-9.81))
    run = simulate(machine, until=1e-3, instants=2)
    figure = draw(run, [0, 1])
    names = sorted(str(line.get_gid()) for line in figure.axes[0].lines)
    assert "links" in names and "at 1:links" in names
