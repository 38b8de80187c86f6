"""Data sets of random linkages: what is in a file, and how a run goes on."""

from __future__ import annotations

from unittest import mock

import numpy as np
import pytest

import mbody
from mbody.topologies.dataset import LinkageSet, shape_of, write_linkages

parquet = pytest.importorskip("pyarrow.parquet")

SMALL = LinkageSet(count=40, nodes=7, seed=3, instants=31)


def table_of(folder):
    """All files as one."""
    return parquet.read_table(sorted(folder.glob("*.parquet"))[0])


def column(table, name, *shape):
    flat = table[name].combine_chunks().flatten().to_numpy()
    return flat.reshape(len(table), *shape)


def test_a_file_has_what_linkages_finds(tmp_path):
    written = write_linkages(tmp_path, SMALL)
    assert (written.done, written.count, written.status) == (40, 40, "completed")
    table, (bars, places, slides) = table_of(tmp_path), shape_of(7, SMALL.groups)
    assert table["linkage"].to_pylist() == list(range(40))
    arrays = {
        "joints": column(table, "joints", 7, 2),
        "links": column(table, "links", bars, places),
        "ground": column(table, "ground", 2),
        "driver": table["driver"].combine_chunks().to_numpy(),
        "slides": column(table, "slides", slides, 2),
        "directions": column(table, "directions", slides),
    }
    found = mbody.linkages(arrays, instants=31, gravity=(0.0, -9.81))
    assert found.failures == {}
    # float32, and rounding by other companions on lanes
    kept = column(table, "positions", 31, 7, 2)
    assert np.allclose(kept, found.positions, 1e-6, 1e-6)
    kept = column(table, "forces", 31, bars, places, 2)
    size = np.nanmax(np.abs(found.forces), axis=(1, 2, 3, 4), keepdims=True)
    assert (np.isnan(kept) == np.isnan(found.forces)).all()
    assert np.nanmax(np.abs(kept - found.forces) / size) < 1e-6
    # on lanes by the instant with the least determinant; of the few that go alone, as the last
    # three here, by the nearest of all instants
    assert np.allclose(table["margin"].to_numpy(), found.margin, 0.02)
    names = np.array(table["topology"].to_pylist())
    same = names[:, None] == names[None, :]
    assert (same == (found.topology[:, None] == found.topology[None, :])).all()


def test_threads_and_a_new_beginning_give_the_same_bytes(tmp_path):
    what = LinkageSet(count=12, nodes=6, seed=1, instants=9, groups=("dyads",))
    with mock.patch("mbody.topologies.dataset.PIECE", 5):
        write_linkages(tmp_path / "one", what)
        write_linkages(tmp_path / "two", what, threads=2)
        files = sorted((tmp_path / "one").glob("*.parquet"))
        assert len(files) == 3
        for file in files:
            assert file.read_bytes() == (tmp_path / "two" / file.name).read_bytes()
        # a file cut short, and one that is gone
        content = files[1].read_bytes()
        files[1].write_bytes(content[:-7])
        files[2].unlink()
        calls: list[tuple[int, int]] = []
        again = write_linkages(
            tmp_path / "one", what, progress=lambda done, of: calls.append((done, of))
        )
        assert calls == [(5, 12), (10, 12), (12, 12)] and again.done == 12
        assert files[1].read_bytes() == content


def test_parts_make_the_whole(tmp_path):
    what = LinkageSet(count=12, nodes=6, seed=1, instants=9, groups=("dyads",))
    with mock.patch("mbody.topologies.dataset.PIECE", 5):
        first = write_linkages(tmp_path, what, part=(1, 2))
        assert (first.done, first.count) == (7, 7)
        second = write_linkages(tmp_path, what, part=(2, 2))
        assert (second.done, second.count) == (5, 5)
        calls: list[tuple[int, int]] = []
        write_linkages(tmp_path, what, progress=lambda done, of: calls.append((done, of)))
        assert calls == [(12, 12)]


def test_a_cluster_writes_the_same_bytes(tmp_path):
    distributed = pytest.importorskip("distributed")
    what = LinkageSet(count=12, nodes=6, seed=1, instants=9, groups=("dyads",))
    # workers within this process, which have the smaller pieces too
    with (
        mock.patch("mbody.topologies.dataset.PIECE", 5),
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
        ) as cluster,
    ):
        write_linkages(tmp_path / "here", what)
        calls: list[tuple[int, int]] = []
        there = write_linkages(
            tmp_path / "there",
            what,
            scheduler=cluster.scheduler_address,
            progress=lambda done, of: calls.append((done, of)),
        )
    assert (there.done, there.status, calls[-1]) == (12, "completed", (12, 12))
    files = sorted((tmp_path / "here").glob("*.parquet"))
    assert len(files) == 3
    for file in files:
        assert file.read_bytes() == (tmp_path / "there" / file.name).read_bytes()


def test_ctrl_c_keeps_what_was_done(tmp_path):
    what = LinkageSet(count=12, nodes=6, seed=1, instants=9, groups=("dyads",))

    def stop(done, of):
        if done >= 5:
            raise KeyboardInterrupt

    with mock.patch("mbody.topologies.dataset.PIECE", 5):
        stopped = write_linkages(tmp_path, what, progress=stop)
        assert stopped.status == "stopped: 5 of 12 linkages are written"
        assert len(list(tmp_path.glob("*.parquet"))) == 1
        assert write_linkages(tmp_path, what).status == "completed"
