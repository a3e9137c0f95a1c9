"""Budgets: when a picture is done."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Iterable
from typing import ClassVar, Union

from .errors import invalid
from .v1 import types_pb2 as types

_MOST_SAMPLES = 2**30


@dataclasses.dataclass(frozen=True)
class Error:
    """Until the standard error of the picture is at most `value`, radiance units, > 0.

    It counts noise, and bounds light that no sample has found yet.
    """

    value: float
    field: ClassVar[str] = "error"

    def __post_init__(self) -> None:
        _check_positive("Error", self.value)


@dataclasses.dataclass(frozen=True)
class Samples:
    """Until each pixel has `value` samples, [1, 2^30]; in modes with adaptive counts, their mean."""

    value: int
    field: ClassVar[str] = "samples"

    def __post_init__(self) -> None:
        if isinstance(self.value, bool) or not isinstance(self.value, numbers.Integral):
            raise invalid("Samples", self.value, "whole numbers in [1, 2^30]")
        if not 1 <= self.value <= _MOST_SAMPLES:
            raise invalid("Samples", self.value, "whole numbers in [1, 2^30]")


@dataclasses.dataclass(frozen=True)
class Seconds:
    """Until `value` seconds of wall time have passed since the picture was begun, > 0."""

    value: float
    field: ClassVar[str] = "time_s"

    def __post_init__(self) -> None:
        _check_positive("Seconds", self.value)


Limit = Union[Error, Samples, Seconds]
#: One limit, or several of different kinds, of which the first to be reached counts.
Until = Union[Limit, Iterable[Limit]]


def _check_positive(name: str, value: float) -> None:
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or not math.isfinite(value) or value <= 0:
        raise invalid(name, value, "finite numbers above 0")


def make_budget(until: Until | None, field: str = "until") -> types.Budget:
    """The protocol's message; None: without an end. InvalidArgument: no limit, or two of one kind."""
    budget = types.Budget()
    if until is None:
        return budget
    limits = [until] if isinstance(until, (Error, Samples, Seconds)) else until
    kinds = "Error(...), Samples(...), Seconds(...), or a list with one of each at most"
    try:
        limits = list(limits)
    except TypeError:
        raise invalid(field, until, kinds) from None
    seen = set()
    for limit in limits:
        if not isinstance(limit, (Error, Samples, Seconds)) or limit.field in seen:
            raise invalid(field, limit, kinds)
        seen.add(limit.field)
        setattr(budget, limit.field, int(limit.value) if isinstance(limit, Samples) else float(limit.value))
    if not seen:
        raise invalid(field, until, kinds)
    return budget


def limits_of(*, error: float | None, samples: int | None, seconds: float | None) -> list[Limit]:
    """The limits that are not None."""
    limits: list[Limit] = []
    if error is not None:
        limits.append(Error(error))
    if samples is not None:
        limits.append(Samples(samples))
    if seconds is not None:
        limits.append(Seconds(seconds))
    return limits
