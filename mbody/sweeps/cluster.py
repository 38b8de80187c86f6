"""Pieces of work on an existing Dask cluster: of sweeps, and of data sets of linkages."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Sequence
from typing import Any

import numpy as np

from mbody.errors import ModelError, SolveError
from mbody.sweeps.job import Job, PieceResult, analyse_piece

__all__ = ["connected", "on_cluster", "results"]

#: Pieces in the queue of each thread of the workers.
AHEAD = 3


def connected(scheduler: str) -> Any:
    """A client of that scheduler.

    Raises
    ------
    ModelError
        Where `distributed` is not installed.
    SolveError
        Where the scheduler cannot be reached.
    """
    client: Any
    try:
        from distributed import Client as client
    except ImportError:
        raise ModelError(
            "work on a cluster needs Dask's distributed, which is not installed: "
            'pip install "mbody[cluster]"'
        ) from None
    try:
        return client(scheduler, timeout=10, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise SolveError(
            f"no scheduler can be reached at {scheduler!r} ({type(error).__name__}): start one "
            "with 'dask scheduler', and workers that have mbody"
        ) from None


def on_cluster(
    job: Job, values: np.ndarray, pieces: list[int], size: int, client: Any
) -> Generator[tuple[int, PieceResult], None, None]:
    """First design and result of every piece, in the order of completion."""
    with contextlib.closing(client):
        task = client.scatter(job, broadcast=True, hash=False)
        yield from results(
            client, pieces, lambda low: (analyse_piece, task, values[low : low + size])
        )


def results(
    client: Any, pieces: Sequence[int], call: Callable[[int], tuple[Any, ...]]
) -> Generator[tuple[int, Any], None, None]:
    """Every piece with its result, in the order of completion.

    `call` gives the function of a piece and its arguments. A few calls for each thread of the
    workers are in the queue, so that no worker waits and the memory does not grow.
    """
    import distributed

    ahead = AHEAD * max(1, sum(client.nthreads().values()))
    waiting = iter(pieces)
    begun: dict[Any, int] = {}
    arriving: Any = distributed.as_completed(loop=client.loop)

    def send() -> None:
        piece = next(waiting, None)
        if piece is not None:
            future = client.submit(*call(piece), pure=False)
            begun[future] = piece
            arriving.add(future)

    for _ in range(min(ahead, len(pieces))):
        send()
    while begun:
        future = next(arriving)
        piece = begun.pop(future)
        result = future.result()
        send()
        yield piece, result
