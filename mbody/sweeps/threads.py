"""Pieces of a sweep on the threads of this machine."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Generator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from mbody.sweeps.job import Job, PieceResult, analyse_piece

__all__ = ["cores", "on_threads"]

#: Pieces in the queue of each thread.
AHEAD = 2


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def on_threads(
    job: Job, values: np.ndarray, pieces: list[int], size: int, threads: int
) -> Generator[tuple[int, PieceResult], None, None]:
    """First design and result of every piece, in order."""
    if threads == 1:
        for low in pieces:
            yield low, analyse_piece(job, values[low : low + size])
        return
    pool = ThreadPoolExecutor(threads, thread_name_prefix="mbody")
    queue: deque[tuple[int, Future[PieceResult]]] = deque()
    try:
        for low in pieces:
            queue.append((low, pool.submit(analyse_piece, job, values[low : low + size])))
            if len(queue) > AHEAD * threads:
                first, future = queue.popleft()
                yield first, future.result()
        while queue:
            first, future = queue.popleft()
            yield first, future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
