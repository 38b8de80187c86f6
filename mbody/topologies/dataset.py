"""A data set of random linkages in a folder: Parquet files of so many linkages each.

Each file follows from the seed and its number alone, so that threads and machines change nothing,
and a run that was stopped goes on with what is missing. Files are written under another name and
renamed when they are whole; each has a seal.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mbody.analysis.driven.time_grid import memory
from mbody.errors import ModelError
from mbody.files.saved import OPEN_SEAL, seal, sealed
from mbody.files.tables import write_whole
from mbody.model.element import listed, whole_number
from mbody.sweeps.job import remove_abandoned
from mbody.sweeps.run import connected, results
from mbody.topologies.many_linkages import linkages
from mbody.topologies.plan import canonical_order, linkage_arrays

# -- Random linkages: a crank, then one Assur group after another on joints that there are -----
# Groups leave a linkage its one degree of freedom (Assur 1914). Dyads are two bars and a new joint;
# sliders one bar to a new joint on a line of the ground or of a link; triads a link with three new
# joints, a bar at each. Dyads and sliders are drawn until they close over the whole turn, by their
# triangles; whether a triad or a larger group ("assur", `mbody.topologies.assur_graphs`) does is
# for the analysis to say.

# -- Random Assur groups of bars: graphs that no smaller group is part of ----------------------
# Joints of a group are new, or pins: joints that there are. The least without a dyad is a triangle
# of three new joints with a bar from each to a pin. A bar is split: a new joint on it, held by a
# third bar to another joint (Henneberg 1911). Each new joint has two bars that hold it, and such
# bars lead from each new joint to all others, so that no part of the group is a group of its own
# (Servatius, Shai & Whiteley, "Combinatorial characterization of the Assur graphs from
# engineering", European Journal of Combinatorics 31, 2010).

#: New joints of the groups.
LEAST_GROUP, LARGEST_GROUP = 3, 5


def assur_bars(first: int, size: int, random: np.random.Generator) -> list[tuple[int, int]]:
    """The bars (joint, joint), 2·size of them, of a random group of the joints from `first` on, on
    joints before: three or more new joints, and three or more before.

    >>> bars = assur_bars(3, 4, np.random.default_rng(0))
    >>> len(bars), sorted({joint for bar in bars for joint in bar if joint >= 3})
    (8, [3, 4, 5, 6])
    """
    pins = random.choice(first, 3, replace=False).tolist()
    a, b, c = range(first, first + 3)
    bars = [(a, b), (b, c), (c, a), *zip((a, b, c), pins, strict=True)]
    for new in range(first + 3, first + size):
        n = int(random.integers(len(bars)))
        # u is new; where v is a pin, the third bar must lead to a new joint
        u, v = max(bars[n]), min(bars[n])
        others = [k for k in range(0 if v >= first else first, new) if k not in (u, v)]
        third = int(random.choice(others))
        bars[n] = (u, new)
        bars += [(new, v), (new, third)]
    return bars


GROUPS = ("dyads", "sliders", "triads", "assur")
#: Those whose closing is known here, so that others may stand on them.
CLOSED = ("dyads", "sliders")
#: Joints of the crank and the ground before any group.
FIRST = 3
#: Angles of the crank at which a group must close, and the least sin² of a dyad's angle there, and
#: of the angle between the bar of a slider and the normal of its line the least cos².
ANGLES, LEAST = 73, 0.01
#: Places that are tried for a new joint.
TRIES = 12
#: Every how many of these angles are looked at first.
FEW = 8
#: Linkages of each topology, which fill the lanes, and for each joint after the first how many more
#: are drawn because some never close.
ALIKE, SPARE = 16, 5
#: Bytes of the paths of linkages that are drawn at once.
MOST = 64e6
#: How often a group is a slider, and a linkage ends with a triad or a larger group.
SLIDERS, OPEN = 0.25, 0.5

#: Positions (linkages, angles, 2) of a new joint, and whether it closes (linkages,).
Placed = tuple[np.ndarray, np.ndarray]


def check_groups(groups: tuple[str, ...], nodes: int) -> None:
    """Refuse groups that are not known, or of which no linkage of so many joints can be made."""
    for name in groups:
        if name not in GROUPS:
            raise ModelError(f"there are no groups {name!r} (there are: {listed(GROUPS)})")
    if not groups:
        raise ModelError(f"name one or more groups: {listed(GROUPS)}")
    least = FIRST + (1 if set(groups) & set(CLOSED) else LEAST_GROUP)
    if nodes < least:
        raise ModelError(
            f"linkages of {listed(groups)} have {least} joints or more, not {nodes}: the crank and "
            f"the ground have {FIRST}"
        )
    if groups == ("triads",) and nodes % 3:
        raise ModelError(f"triads alone make linkages of 6, 9, 12 … joints, not of {nodes}")


def shape_of(nodes: int, groups: tuple[str, ...]) -> tuple[int, int, int]:
    """Most links, places of a link and slides of linkages of so many joints."""
    added = nodes - FIRST
    twice = "dyads" in groups or "assur" in groups
    bars = 1 + (2 * added if twice else added + added // 3)
    return bars, 3 if "triads" in groups else 2, added if "sliders" in groups else 0


def random_linkages(
    topologies: int,
    nodes: int,
    random: np.random.Generator,
    groups: tuple[str, ...] = ("dyads",),
    turn: float = 2.0 * np.pi,
) -> dict[str, np.ndarray]:
    """Arrays for `mbody.linkages`: so many random topologies, up to 16 linkages of each.

    `topologies`, `nodes`: How many; joints of each.
    `groups`: "dyads", "sliders", "triads", "assur" (any groups of bars with three to five joints):
      which are drawn.
    `turn`: The turn of the crank [rad] over which dyads and sliders must close.
    Returns joints within a box of about one length, some of them outside after the first three.
    Joints 0 and 2 are on the ground, link 0 is the crank.
    """
    check_groups(groups, nodes)
    drawn = ALIKE + SPARE * (nodes - FIRST)
    at_once = max(1, int(MOST / (16 * drawn * nodes * ANGLES)))
    parts = [
        _drawn(min(at_once, topologies - n), drawn, nodes, random, groups, turn)
        for n in range(0, topologies, at_once)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _drawn(
    topologies: int,
    drawn: int,
    nodes: int,
    random: np.random.Generator,
    groups: tuple[str, ...],
    turn: float,
) -> dict[str, np.ndarray]:
    """Linkages drawn all at once, `drawn` of each topology: arrays by name."""
    grown = _Growth(topologies, drawn, nodes, random, groups, turn)
    kinds = _kinds(topologies, nodes, random, groups)
    for k, own in enumerate(kinds.T):
        for kind, add in (("dyads", grown.dyads), ("sliders", grown.sliders)):
            of_kind = np.flatnonzero(own == GROUPS.index(kind))
            if of_kind.size:
                add(k, of_kind)
        grown.triads(k, np.flatnonzero(own == GROUPS.index("triads")))
        grown.assur(k, np.flatnonzero(own == GROUPS.index("assur")), kinds)
    return grown.arrays()


def _kinds(
    topologies: int, nodes: int, random: np.random.Generator, groups: tuple[str, ...]
) -> np.ndarray:
    """Of every topology the group, a number of `GROUPS`, that begins with each joint; −1 for none:
    (topologies, nodes). Triads and larger groups are last.
    """
    closed = tuple(name in groups for name in CLOSED)
    slid = random.random((topologies, nodes)) < SLIDERS if closed[0] else True
    kinds = np.where(np.logical_and(slid, closed[1]), 1, 0) * np.ones((topologies, nodes), int)
    kinds[:, :FIRST] = -1
    last = [name for name in GROUPS if name in groups and name not in CLOSED]
    if not last or nodes < FIRST + LEAST_GROUP:
        return kinds
    for own in kinds:
        if not any(closed):
            _fill(own, FIRST, last, random)
        elif random.random() < OPEN:
            kind = str(random.choice(last))
            most = min(LARGEST_GROUP if kind == "assur" else LEAST_GROUP, nodes - FIRST)
            first = nodes - int(random.integers(LEAST_GROUP, most + 1))
            own[first:] = -1
            own[first] = GROUPS.index(kind)
    return kinds


def _fill(own: np.ndarray, k: int, kinds: list[str], random: np.random.Generator) -> None:
    """The groups of one linkage that has no others, from joint k on."""
    own[k:] = -1
    while k < len(own):
        left = len(own) - k
        # what is left must be enough for a group, or nothing
        sizes = [n for n in range(LEAST_GROUP, LARGEST_GROUP + 1) if left - n not in (1, 2)]
        sizes = [n for n in sizes if n <= left]
        fit = [name for name in kinds if name == "assur" or left % LEAST_GROUP == 0]
        kind = str(random.choice(fit or kinds))
        own[k] = GROUPS.index(kind)
        k += LEAST_GROUP if kind == "triads" else int(random.choice(sizes))


class _Growth:
    """Linkages that grow, joint by joint; those of a topology are next to each other."""

    def __init__(
        self,
        topologies: int,
        drawn: int,
        nodes: int,
        random: np.random.Generator,
        groups: tuple[str, ...],
        turn: float,
    ) -> None:
        self.random, self.drawn, count = random, drawn, topologies * drawn
        bars, places, slides = shape_of(nodes, groups)
        self.links = np.full((topologies, bars, places), -1)
        self.slides = np.full((topologies, slides, 2), -1)
        self.many = np.ones((topologies, 2), dtype=int) * [1, 0]  # links and slides
        self.joints = np.zeros((count, nodes, 2))
        self.path = np.zeros((count, nodes, ANGLES, 2))
        self.directions = np.zeros((count, slides))
        self.alive = np.ones(count, dtype=bool)
        self.topology = np.repeat(np.arange(topologies), drawn)
        self.joints[:, :FIRST] = random.random((count, FIRST, 2))
        self.path[:, 0], self.path[:, 2] = self.joints[:, 0, None], self.joints[:, 2, None]
        crank = self.joints[:, 1] - self.joints[:, 0]
        angles = np.linspace(0.0, turn, ANGLES)
        self.path[:, 1] = self.joints[:, 0, None] + _rotated(crank[:, None], angles)
        self.links[:, 0, :2] = 0, 1

    def arrays(self) -> dict[str, np.ndarray]:
        """The first linkages of each topology that closed."""
        number = np.cumsum(self.alive.reshape(-1, self.drawn), axis=1).reshape(-1)
        kept = np.flatnonzero(self.alive & (number <= ALIKE))
        topology_numbers = self.topology[kept]
        return {
            "joints": self.joints[kept],
            "links": self.links[topology_numbers],
            "slides": self.slides[topology_numbers],
            "directions": self.directions[kept],
            "ground": np.tile([0, 2], (len(kept), 1)),
            "driver": np.zeros(len(kept), dtype=int),
        }

    def dyads(self, k: int, which: np.ndarray) -> None:
        """Joint k of these topologies on bars to two joints before it."""
        ends = self._joints_before(k, 2, which)
        i, j = ends[:, self.topology]

        def placed(remaining: np.ndarray, x: np.ndarray, every: int) -> Placed:
            start, end = (
                self.path[remaining, i[remaining], ::every],
                self.path[remaining, j[remaining], ::every],
            )
            d = end - start
            square = np.maximum(d[..., 0] ** 2 + d[..., 1] ** 2, 1e-12)
            begun, last = self.joints[remaining, i[remaining]], self.joints[remaining, j[remaining]]
            own, other, first = x - begun, x - last, last - begun
            a, b = (own * own).sum(axis=1)[:, None], (other * other).sum(axis=1)[:, None]
            along = (square + a - b) / (2.0 * square)
            across = a / square - along**2
            side = np.sign(first[:, 0] * own[:, 1] - first[:, 1] * own[:, 0])[:, None]
            height = side * np.sqrt(np.maximum(across, 0.0))
            path = np.empty_like(d)
            path[..., 0] = start[..., 0] + along * d[..., 0] - height * d[..., 1]
            path[..., 1] = start[..., 1] + along * d[..., 1] + height * d[..., 0]
            # sin² of the angle between the bars
            return path, (across * square * square > LEAST * a * b).all(axis=1)

        self._draw_joint(k, which, placed)
        for end in ends:
            self._link(which, np.column_stack([end[which], np.full(len(which), k)]))

    def sliders(self, k: int, which: np.ndarray) -> None:
        """Joint k on a bar to a joint before it, on a line of the ground or of a bar."""
        random, topologies = self.random, len(self.links)
        (end,) = self._joints_before(k, 1, which)
        on = np.full(topologies, -1)
        # a line of the ground is one through its two joints
        line = np.tile([0, 2], (topologies, 1))
        for n in which.tolist():
            own = self.links[n, : self.many[n, 0]]
            bars = np.flatnonzero((own != end[n]).all(axis=1))
            if bars.size and random.random() < 0.5:
                on[n] = random.choice(bars)
                line[n] = own[on[n], :2]
        i, (p, q) = end[self.topology], line[self.topology].T
        directions = random.uniform(0.0, np.pi, len(self.joints))

        def placed(remaining: np.ndarray, x: np.ndarray, every: int) -> Placed:
            start, foot = (
                self.path[remaining, i[remaining], ::every],
                self.path[remaining, p[remaining], ::every],
            )
            along = self.path[remaining, q[remaining], ::every] - foot
            rotation = np.arctan2(along[..., 1], along[..., 0])
            rotation = rotation - rotation[:, :1]
            angle = directions[remaining, None] + rotation
            through = foot + _rotated((x - self.joints[remaining, p[remaining]])[:, None], rotation)
            u = np.stack([np.cos(angle), np.sin(angle)], axis=2)
            d = through - start
            length = ((x - self.joints[remaining, i[remaining]]) ** 2).sum(axis=1)[:, None]
            offset = d[..., 0] * u[..., 1] - d[..., 1] * u[..., 0]
            left = length - offset**2
            middle = (d * u).sum(axis=2)
            sign = np.sign(middle[:, :1])
            travel = sign * np.sqrt(np.maximum(left, 0.0)) - middle
            path = through + travel[..., None] * u
            return path, (left > LEAST * length).all(axis=1) & (sign[:, 0] != 0.0)

        self._draw_joint(k, which, placed)
        self._link(which, np.column_stack([end[which], np.full(len(which), k)]))
        at = self.many[which, 1]
        self.slides[which, at] = np.column_stack([np.full(len(which), k), on[which]])
        rows = np.flatnonzero(np.isin(self.topology, which))
        self.directions[rows, self.many[self.topology[rows], 1]] = directions[rows]
        self.many[which, 1] += 1

    def triads(self, k: int, which: np.ndarray) -> None:
        """Joints k to k + 2 on one link, each on a bar to a joint before it."""
        if not which.size:
            return
        ends = self._joints_before(k, 3, which)
        rows = np.flatnonzero(np.isin(self.topology, which))
        self.joints[rows, k : k + 3] = self.random.random((len(rows), 3, 2))
        # the paths are not known here: further groups may not stand on a triad
        self._link(which, np.tile(np.arange(k, k + 3), (len(which), 1)))
        for n, end in enumerate(ends):
            self._link(which, np.column_stack([end[which], np.full(len(which), k + n)]))

    def assur(self, k: int, which: np.ndarray, kinds: np.ndarray) -> None:
        """Joints from k to the next group, each on bars to others of them or before."""
        for n in which.tolist():
            after = np.flatnonzero(kinds[n, k + 1 :] >= 0)
            size = int(after[0]) + 1 if after.size else kinds.shape[1] - k
            rows = slice(n * self.drawn, (n + 1) * self.drawn)
            self.joints[rows, k : k + size] = self.random.random((self.drawn, size, 2))
            for bar in assur_bars(k, size, self.random):
                self._link(np.array([n]), np.array([bar]))

    def _joints_before(self, k: int, many: int, which: np.ndarray) -> np.ndarray:
        """So many different joints before k, (many, topologies); zeros for other topologies."""
        found = np.zeros((len(self.links), many), dtype=int)
        found[which] = self.random.random((len(which), k)).argsort(axis=1)[:, :many]
        return found.T

    def _link(self, which: np.ndarray, joints: np.ndarray) -> None:
        """A further link of these topologies."""
        self.links[which, self.many[which, 0], : joints.shape[1]] = joints
        self.many[which, 0] += 1

    def _draw_joint(
        self, k: int, which: np.ndarray, placed: Callable[[np.ndarray, np.ndarray, int], Placed]
    ) -> None:
        """Draw joint k of every linkage of these topologies until it closes; linkages for which it
        never does are left out. placed: its path at some of the angles, of linkages and its first
        positions.
        """
        remaining = np.flatnonzero(self.alive & np.isin(self.topology, which))
        for _ in range(TRIES):
            if not remaining.size:
                break
            x = self.random.random((len(remaining), 2))
            # most are refused by a few angles already
            likely = np.flatnonzero(placed(remaining, x, FEW)[1])
            path, closes = placed(remaining[likely], x[likely], 1)
            good = likely[closes]
            self.joints[remaining[good], k] = x[good]
            self.path[remaining[good], k] = path[closes]
            remaining = np.delete(remaining, good)
        self.alive[remaining] = False


def _rotated(v: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Vectors (…, 2) turned by angles."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1]], axis=-1)


#: Readers of Parquet folders leave out what begins so.
MANIFEST = "_linkages.json"
#: Linkages of a file; topologies that are drawn at once, and how many more than would be enough.
PIECE, DRAWN, SPARE_TOPOLOGIES = 1024, 68, 4
#: Numbers that no instant repeats are stored byte by byte, which takes a third of the time of
#: the default and fewer bytes.
STORED: dict[str, Any] = {
    "compression": "zstd",
    "compression_level": -3,
    "use_dictionary": ["topology"],
    "write_statistics": False,
    "use_byte_stream_split": [f"{name}.list.element" for name in ("positions", "forces", "torque")],
}
#: Topologies without a linkage that moves after which there are said to be none.
FRUITLESS = 3200
#: Longest sentence of a manifest.
MANIFEST_LENGTH = 100_000


@dataclass(frozen=True)
class LinkageSet:
    """Specification of a data set: all that its numbers follow from.

    `count`, `nodes`, `seed`: Linkages; joints of each; of the random numbers.
    `groups`: Of "dyads", "sliders", "triads", "assur".
    `turn`: Of the crank [rad].
    `speed`: Of the crank [rad/s].
    `gravity`: (x, y) [m/s²].
    """

    count: int
    nodes: int = 8
    seed: int = 0
    groups: tuple[str, ...] = GROUPS
    instants: int = 200
    turn: float = 2.0 * np.pi
    speed: float = 1.0
    gravity: tuple[float, float] = (0.0, -9.81)

    def check(self) -> None:
        """Refuse what cannot be made.

        Raises ModelError.
        """
        for name, least in (("count", 1), ("nodes", 4), ("seed", 0), ("instants", 2)):
            object.__setattr__(self, name, whole_number(name, getattr(self, name), least))
        for name in ("turn", "speed"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) != 0.0):
                raise ModelError(
                    f"{name} must be a number that is not 0, not {getattr(self, name)}"
                )
        check_groups(self.groups, self.nodes)
        bars, places, _ = shape_of(self.nodes, self.groups)
        wanted = 8.0 * DRAWN * ALIKE * self.instants * 2 * (self.nodes + bars * places)
        if wanted > memory():
            raise ModelError(
                f"linkages of {self.nodes} joints at {self.instants} instants take "
                f"{wanted / 1e9:.3g} GB for {DRAWN * ALIKE} at a time, this machine has "
                f"{memory() / 1e9:.3g} GB of memory: ask for fewer joints or instants"
            )

    @property
    def digest(self) -> str:
        """Hash of all of it."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Written:
    """Progress of `write_linkages`: folder, pieces done, status.

    `done`, `count`: Linkages of the part that are in the folder, and that are wanted.
    `status`: "completed", or "stopped: …" after Ctrl-C.
    """

    folder: Path
    done: int
    count: int
    status: str


def write_linkages(
    folder: str | os.PathLike[str],
    what: LinkageSet,
    *,
    threads: int = 1,
    scheduler: str | None = None,
    part: tuple[int, int] = (1, 1),
    progress: Callable[[int, int], None] | None = None,
) -> Written:
    """Write a data set, or what is missing of it.

    `scheduler`: Address of a Dask scheduler whose workers make the files' contents.
    `part`: Which of how many parts of the files to write, (3, 16): a process each, into one folder.
    `progress`: Called with the number of linkages that are written, and of all.
    Raises ModelError where pyarrow is missing, the folder cannot be written to or contains another
    data set.
    """
    what.check()
    threads = whole_number("threads", threads)
    own, parts = part
    if not 1 <= own <= parts:
        raise ModelError(f"there is no part {own} of {parts}: give 1/{parts} to {parts}/{parts}")
    kept = _Folder(folder, what)
    pieces = range(own - 1, -(-what.count // PIECE), parts)
    missing = [n for n in pieces if not kept.sound(n)]
    count = sum(_size(what, n) for n in pieces)
    done = count - sum(_size(what, n) for n in missing)
    status = "completed"
    source = (
        _on_threads(what, missing, threads)
        if scheduler is None
        else _on_cluster(what, missing, scheduler)
    )
    try:
        if progress is not None:
            progress(done, count)
        for n, content in source:
            kept.keep(n, content)
            done += _size(what, n)
            if progress is not None:
                progress(done, count)
    except KeyboardInterrupt:
        status = f"stopped: {done} of {count} linkages are written"
    finally:
        source.close()
    return Written(kept.folder, done, count, status)


def _size(what: LinkageSet, piece: int) -> int:
    return min(PIECE, what.count - PIECE * piece)


def _on_threads(what: LinkageSet, pieces: list[int], threads: int) -> Any:
    """Contents of all files, as they are finished."""
    if threads == 1:
        for n in pieces:
            yield n, content_of(what, n)
        return
    pool = ThreadPoolExecutor(threads, thread_name_prefix="mbody")
    try:
        waiting: dict[Any, int] = {}
        left = list(reversed(pieces))
        while left or waiting:
            while left and len(waiting) < 2 * threads:
                n = left.pop()
                waiting[pool.submit(content_of, what, n)] = n
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                yield waiting.pop(future), future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _on_cluster(what: LinkageSet, pieces: list[int], scheduler: str) -> Any:
    """Results of the pieces from the workers of a cluster."""
    with contextlib.closing(connected(scheduler)) as client:
        yield from results(client, pieces, lambda n: (content_of, what, n))


def content_of(what: LinkageSet, piece: int) -> bytes:
    """One file of a data set, with its seal: the first linkages of those drawn that move."""
    import pyarrow as arrow
    import pyarrow.parquet as parquet

    wanted, tables, fruitless = _size(what, piece), list[Any](), 0
    first = PIECE * piece
    random = np.random.default_rng([what.seed, what.nodes, piece])
    while wanted:
        # a few topologies more, since some do not close sixteen times
        topologies = min(DRAWN, -(-wanted // ALIKE) + SPARE_TOPOLOGIES)
        arrays = random_linkages(topologies, what.nodes, random, what.groups, what.turn)
        table = _moving(what, arrays, first, wanted) if len(arrays["joints"]) else None
        if table is not None:
            tables.append(table)
            first, wanted, fruitless = first + len(table), wanted - len(table), 0
            continue
        fruitless += topologies
        if fruitless > FRUITLESS:
            raise ModelError(
                f"of {fruitless} random topologies of {what.nodes} joints none has a "
                "linkage that turns so far: ask for a smaller turn, or fewer joints"
            )
    made, sink = arrow.concat_tables(tables), arrow.BufferOutputStream()
    with parquet.ParquetWriter(sink, made.schema, **STORED) as writer:
        writer.write_table(made)
        writer.add_key_value_metadata({"mbody.linkages": what.digest, "mbody.seal": OPEN_SEAL})
    return seal(sink.getvalue().to_pybytes(), _owner(what, piece))


def _owner(what: LinkageSet, piece: int) -> str:
    return f"{what.digest} {piece}"


def _moving(what: LinkageSet, arrays: dict[str, np.ndarray], first: int, most: int) -> Any:
    """A table of those linkages that move, at most so many; None where there is none."""
    import pyarrow as arrow

    found = linkages(
        arrays, instants=what.instants, turn=what.turn, speed=what.speed, gravity=what.gravity
    )
    good = np.setdiff1d(np.arange(len(found)), np.fromiter(found.failures, int))[:most]
    if not good.size:
        return None
    named: dict[int, str] = {}
    order = canonical_order(linkage_arrays(arrays))
    names = [
        named.get(number) or named.setdefault(number, hashlib.sha256(row).hexdigest()[:16])
        for number, row in zip(found.topology[good].tolist(), order.table[good], strict=True)
    ]
    columns: dict[str, Any] = {
        "linkage": arrow.array(np.arange(first, first + len(good))),
        "topology": arrow.array(names),
        "margin": arrow.array(found.margin[good]),
    }
    for name in ("joints", "links", "ground", "driver", "slides", "directions"):
        part = arrays[name][good]
        kind = np.float64 if part.dtype.kind == "f" else np.int16
        columns |= _lists(arrow, name, part.astype(kind))
    for name, part in (
        ("positions", found.positions),
        ("forces", found.forces),
        ("torque", found.torque),
    ):
        columns |= _lists(arrow, name, part.astype(np.float32)[good])
    return arrow.table(columns)


def _lists(arrow: Any, name: str, rows: np.ndarray) -> dict[str, Any]:
    """A column of lists of one length, an array of each row; none of empty rows."""
    width = int(np.prod(rows.shape[1:]))
    if not width:
        return {}
    flat = arrow.array(np.ascontiguousarray(rows).reshape(-1))
    if rows.ndim == 1:
        return {name: flat}
    return {name: arrow.FixedSizeListArray.from_arrays(flat, width)}


class _Folder:
    """The folder of a data set, new or to be continued."""

    def __init__(self, folder: Any, what: LinkageSet) -> None:
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError:
            raise ModelError(
                'a data set needs pyarrow, which is not installed: pip install "mbody-planar[data]"'
            ) from None
        self.what = what
        try:
            self.folder = Path(folder)
            self.folder.mkdir(parents=True, exist_ok=True)
            remove_abandoned(self.folder)
            self._begin()
        except (OSError, TypeError) as error:
            raise self._unwritten(error, folder) from None

    @staticmethod
    def _unwritten(error: Exception, folder: Any) -> ModelError:
        why = getattr(error, "strerror", None) or error
        return ModelError(
            f"cannot write a data set to '{folder}' ({why}): choose a writable folder"
        )

    def _begin(self) -> None:
        """Write what the data set is, or check that it is the one that is there."""
        path, own = self.folder / MANIFEST, json.loads(json.dumps(asdict(self.what)))
        if not path.exists():
            write_whole(path, json.dumps(own, indent=1).encode())
        try:
            there = json.loads(path.read_text("utf-8")[:MANIFEST_LENGTH])
            other = [name for name in own if there[name] != own[name]]
        except (ValueError, TypeError, KeyError):
            raise ModelError(
                f"'{path}' is damaged: delete it, and write the same data set again; files that "
                "belong to it are kept"
            ) from None
        if other:
            raise ModelError(
                f"'{self.folder}' contains another data set, with another {other[0]}: choose "
                "another folder, or delete this one"
            )

    def _file(self, piece: int) -> Path:
        return self.folder / f"linkages-{PIECE * piece:011d}.parquet"

    def sound(self, piece: int) -> bool:
        """Whether a file is there, whole, and of this data set."""
        try:
            return sealed(self._file(piece).read_bytes(), _owner(self.what, piece))
        except OSError:
            return False

    def keep(self, piece: int, content: bytes) -> None:
        """Write a file."""
        try:
            write_whole(self._file(piece), content)
        except OSError as error:
            raise self._unwritten(error, self.folder) from None
