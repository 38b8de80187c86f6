"""Pieces of a sweep on the threads of this machine."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Generator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from mbody.sweeps.job import Job, Part, answered

__all__ = ["cores", "on_threads"]

#: Pieces that wait for each thread.
AHEAD = 2


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def on_threads(
    job: Job, values: np.ndarray, pieces: list[int], size: int, threads: int
) -> Generator[tuple[int, Part], None, None]:
    """First design and answers of every piece, in order."""
    if threads == 1:
        for low in pieces:
            yield low, answered(job, values[low : low + size])
        return
    pool = ThreadPoolExecutor(threads, thread_name_prefix="mbody")
    waiting: deque[tuple[int, Future[Part]]] = deque()
    try:
        for low in pieces:
            waiting.append((low, pool.submit(answered, job, values[low : low + size])))
            if len(waiting) > AHEAD * threads:
                first, future = waiting.popleft()
                yield first, future.result()
        while waiting:
            first, future = waiting.popleft()
            yield first, future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
