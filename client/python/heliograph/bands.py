"""Work on bands of a picture, in as many threads as there are cores: zlib and numpy let others run meanwhile."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")

_MOST_THREADS = 8


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def each(work: Callable[[A], B], bands: Iterable[A], parallel: bool) -> list[B]:
    """The answers in the order of the bands. The threads have ended when it returns or raises."""
    listed = list(bands)
    threads = min(_cores(), _MOST_THREADS, len(listed))
    if parallel and threads > 1:
        try:
            pool = ThreadPoolExecutor(threads, "heliograph-bands")
            with pool:
                return list(pool.map(work, listed))
        except RuntimeError:  # Python is ending, and starts no thread any more
            pass
    return [work(band) for band in listed]
