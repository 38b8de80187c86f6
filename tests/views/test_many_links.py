"""Pictures of very many links: lines in their places; layers, however many links there are."""

import numpy as np

from mbody.views import draw
from tests.freedom.test_large_mobility import chain


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
