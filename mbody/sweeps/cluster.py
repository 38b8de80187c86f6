"""Pieces of a sweep on an existing Dask cluster."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from mbody.errors import ModelError, SolveError
from mbody.sweeps.job import Job, PieceResult, analyse_piece

__all__ = ["connected", "on_cluster"]

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
            "a sweep on a cluster needs Dask's distributed, which is not installed: "
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
    import distributed

    try:
        task = client.scatter(job, broadcast=True, hash=False)
        ahead = AHEAD * max(1, sum(client.nthreads().values()))
        waiting = iter(pieces)
        begun: dict[Any, int] = {}
        arriving: Any = distributed.as_completed(loop=client.loop)

        def send() -> None:
            low = next(waiting, None)
            if low is not None:
                future = client.submit(analyse_piece, task, values[low : low + size], pure=False)
                begun[future] = low
                arriving.add(future)

        for _ in range(min(ahead, len(pieces))):
            send()
        while begun:
            future = next(arriving)
            low = begun.pop(future)
            part = future.result()
            send()
            yield low, part
    finally:
        client.close()
