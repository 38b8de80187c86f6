"""Pieces of a sweep on a Dask cluster that somebody else started."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from mbody.errors import ModelError, SolveError
from mbody.sweeps.job import Job, Part, answered

__all__ = ["connected", "on_cluster"]

#: Pieces that wait for each thread of the workers.
AHEAD = 3


def connected(scheduler: str) -> Any:
    """A client of that scheduler.

    Raises
    ------
    ModelError
        Where `distributed` is not installed.
    SolveError
        Where no scheduler answers.
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
            f"no scheduler answers at {scheduler!r} ({type(error).__name__}): start one with "
            "'dask scheduler', and workers that have mbody"
        ) from None


def on_cluster(
    job: Job, values: np.ndarray, pieces: list[int], size: int, client: Any
) -> Generator[tuple[int, Part], None, None]:
    """First design and answers of every piece, as they come."""
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
                future = client.submit(answered, task, values[low : low + size], pure=False)
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
