"""Progress for a person: a bar of tqdm where that is installed, or a function of the caller's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar, Union

from .comparison.values import ComparisonProgress
from .errors import invalid
from .jobs import describe_progress
from .stats import Stats

T = TypeVar("T")

#: True: a bar, where tqdm is installed. False: none. Or a function that takes Stats, called about four times a second.
Progress = Union[bool, Callable[[Stats], object]]
#: The same for a comparison, of heliograph.comparison.ComparisonProgress.
CompareProgress = Union[bool, Callable[[ComparisonProgress], object]]


class _Reporter(Generic[T]):
    """Use it as a context manager around the call."""

    takes = ""  # what a function is called with

    def __init__(self, progress: bool | Callable[[T], object]) -> None:
        self._call: Callable[[T], object] | None = None
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
            raise invalid("progress", progress, f"True, False, or a function that takes {self.takes}")

    def update(self, value: T) -> None:
        if self._call is not None:
            self._call(value)
        if self._bar is not None:
            text, share = self.told(value)
            self._bar.set_postfix_str(text, refresh=False)
            self._bar.n = round(100 * share, 1)
            self._bar.refresh()

    def told(self, value: T) -> tuple[str, float]:
        """For the bar: a line, and how much is done, [0, 1]."""
        raise NotImplementedError

    def __enter__(self) -> _Reporter[T]:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()


class Reporter(_Reporter[Stats]):
    """Of a render."""

    takes = "Stats"

    def told(self, value: Stats) -> tuple[str, float]:
        return describe_progress(value), value.budget_used


class ComparisonReporter(_Reporter[ComparisonProgress]):
    """Of a comparison."""

    takes = "ComparisonProgress"

    def told(self, value: ComparisonProgress) -> tuple[str, float]:
        return str(value), value.units_done / max(value.units, 1)
