"""Progress of a render for a person: a bar of tqdm where that is installed, or a function of the caller's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Union

from .errors import invalid
from .jobs import describe_progress
from .stats import Stats

#: True: a bar, where tqdm is installed. False: none. Or a function that takes Stats, called about four times a second.
Progress = Union[bool, Callable[[Stats], object]]


class Reporter:
    """Use it as a context manager around the render."""

    def __init__(self, progress: Progress) -> None:
        self._call: Callable[[Stats], object] | None = None
        self._bar: Any = None
        if callable(progress):
            self._call = progress
        elif progress is True:
            try:
                from tqdm.auto import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=100, unit="%", leave=False, bar_format="{l_bar}{bar}| {elapsed}{postfix}")
        elif progress is not False:
            raise invalid("progress", progress, "True, False, or a function that takes Stats")

    def update(self, stats: Stats) -> None:
        if self._call is not None:
            self._call(stats)
        if self._bar is not None:
            self._bar.set_postfix_str(describe_progress(stats), refresh=False)
            self._bar.n = round(100 * stats.budget_used, 1)
            self._bar.refresh()

    def __enter__(self) -> Reporter:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
