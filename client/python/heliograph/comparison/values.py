"""What a comparison consists of, as values: units, points, ratios, references, progress."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from ..camera import Vector
from ..settings import choices, enum_name
from ..v1 import compare_pb2 as messages

Array = npt.NDArray[np.float64]

#: Words of the measures, and the protocol's numbers.
MEASURES = choices(messages.CompareMeasure.DESCRIPTOR)


@dataclasses.dataclass(frozen=True)
class Interval:
    """A mean over seeds with its 95 % interval. low, high: NaN below five seeds and where nothing can be said."""

    mean: float
    low: float = math.nan
    high: float = math.nan

    @property
    def known(self) -> bool:
        """Whether there is an interval."""
        return not math.isnan(self.low)

    def __str__(self) -> str:
        return f"{self.mean:.3g}" + (f" [{self.low:.3g}, {self.high:.3g}]" if self.known else "")


@dataclasses.dataclass(frozen=True)
class WorstPixel:
    """A pixel with a large share of its picture's squared relative error."""

    x: int
    y: int
    picture: Vector  # radiance
    reference: Vector
    share: float  # [0, 1]
    replay_token: str  # of its brightest sample, for Client.replay; empty: not known


@dataclasses.dataclass(frozen=True)
class Unit:
    """The picture of one mode, seed, budget and view, compared with the reference of the view."""

    mode: str
    seed_number: int  # [1, seeds]
    budget: int  # index into Comparison.budgets
    view: int
    seed: int  # with which the picture can be rendered again
    seconds: float  # wall time in which it was rendered
    samples: float  # fresh ones per pixel, the mean
    rays: int
    paths: int
    invalid_samples: int
    reuse_share: float  # of the samples, carried over from earlier pictures, [0, 1)
    others_share: float  # of the processor time, taken by other programs meanwhile, [0, 1]
    disturbed: bool  # others_share is so large that the seconds are not those of an idle machine
    values: dict[str, float]  # of the whole picture, by measure
    regions: dict[str, dict[str, float]]  # by region, then by measure
    worst: tuple[WorstPixel, ...]


@dataclasses.dataclass(frozen=True)
class PointValue(Interval):
    """A measure's mean over seeds."""

    few_pixels_decide: bool = False  # rare, large errors: other seeds may come to quite another mean


@dataclasses.dataclass(frozen=True)
class Point:
    """All seeds of one mode, budget and view."""

    mode: str
    budget: int  # index into Comparison.budgets
    view: int | None  # None: the means over all views of a path
    seeds: int  # that there are
    seconds: Interval
    samples: float
    values: dict[str, PointValue]  # of the whole picture, by measure
    regions: dict[str, dict[str, PointValue]]  # by region, then by measure
    disturbed: int  # units


@dataclasses.dataclass(frozen=True)
class Ratio:
    """One mode against the first mode, in one measure.

    kind: "equal-error": the first mode's time over this mode's to the same error; above 1, this one is faster.
    "equal-time", "equal-samples": this mode's error over the first mode's after the same time or budget of samples;
    below 1, this one is better. "speed": this mode's time over the first mode's for the same budget of samples.
    """

    kind: str
    mode: str
    baseline: str
    measure: str  # empty: of "speed"
    region: str  # empty: the whole picture
    at: float  # error, seconds or samples
    ratio: Interval
    verdict: str  # "better", "worse", "undecided"
    few_pixels_decide: bool  # one of the two errors, or both: undecided
    different_calls: bool  # of a time, and the two modes were not rendered in turns: undecided


@dataclasses.dataclass(frozen=True)
class ReferenceInfo:
    """The picture that modes are compared with in one view."""

    view: int
    noise: str  # what tells its own noise: "halves", "variance", "unspecified"
    error: float | None  # root of its relative mean square error; None: not known
    samples: int | None  # per pixel; None: not known
    seconds: float  # that it took in the last call
    kept: bool  # the daemon had it
    rendered_again: bool  # the daemon had let it go to stay below its limit of memory
    id: str


@dataclasses.dataclass(frozen=True)
class Curve:
    """One measure of one mode against its budgets: arrays of as many numbers as there are budgets, NaN: not there."""

    mode: str
    measure: str
    region: str
    budgets: Array  # samples per pixel, or seconds
    seconds: Array  # mean over seeds
    samples: Array  # per pixel, mean over seeds
    mean: Array
    low: Array  # 95 %
    high: Array


@dataclasses.dataclass(frozen=True)
class ComparisonProgress:
    """How far a comparison is; told about four times a second."""

    units_done: int
    units: int
    doing: str  # "reference", the name of a mode, or "waiting": for another comparison
    view: int
    seed_number: int  # of a mode
    budget: int  # of a mode
    samples: float  # per pixel, of the picture in hand
    error: float | None  # of a reference, root of its relative mean square error so far; None: not known
    seconds: float  # since the comparison began

    def __str__(self) -> str:
        done = f"{self.units_done} of {self.units} units, "
        if self.doing == "reference":
            known = "" if self.error is None else f", error {self.error:.3g}"
            return f"{done}reference: {self.samples:g} samples{known}"
        if self.doing == "waiting":
            return f"{done}waiting for another comparison"
        return f"{done}{self.doing}, seed {self.seed_number}: {self.samples:g} samples"


def make_interval(message: messages.CompareInterval) -> Interval:
    return Interval(message.mean, message.low, message.high) if message.known else Interval(message.mean)


def measure_name(number: int) -> str:
    """Empty: none."""
    return enum_name(messages.CompareMeasure.DESCRIPTOR, number) if number else ""


def make_unit(message: messages.CompareUnit) -> Unit:
    whole, regions = _by_region((value.region, measure_name(value.measure), value.value) for value in message.values)
    return Unit(
        message.mode,
        message.seed_number,
        message.budget,
        message.view,
        message.seed,
        message.seconds,
        message.samples,
        message.rays,
        message.paths,
        message.invalid_samples,
        message.reuse_share,
        message.others_share,
        message.disturbed,
        whole,
        regions,
        tuple(
            WorstPixel(item.x, item.y, _vector(item.picture), _vector(item.reference), item.share, item.replay_token)
            for item in message.worst
        ),
    )


def make_point(message: messages.ComparePoint) -> Point:
    whole, regions = _by_region(
        (
            value.region,
            measure_name(value.measure),
            _point_value(make_interval(value.value), value.few_pixels_decide),
        )
        for value in message.values
    )
    return Point(
        message.mode,
        message.budget,
        None if message.all_views else message.view,
        message.seeds,
        make_interval(message.seconds),
        message.samples,
        whole,
        regions,
        message.disturbed,
    )


def _point_value(interval: Interval, few_pixels_decide: bool) -> PointValue:
    return PointValue(interval.mean, interval.low, interval.high, few_pixels_decide)


def make_ratio(message: messages.CompareRatio) -> Ratio:
    return Ratio(
        enum_name(messages.CompareRatio.Kind.DESCRIPTOR, message.kind),
        message.mode,
        message.baseline,
        measure_name(message.measure),
        message.region,
        message.at,
        make_interval(message.ratio),
        enum_name(messages.CompareVerdict.DESCRIPTOR, message.verdict),
        message.few_pixels_decide,
        message.different_calls,
    )


def make_reference(message: messages.CompareResponse.Reference) -> ReferenceInfo:
    return ReferenceInfo(
        message.view,
        enum_name(messages.CompareResponse.Reference.Noise.DESCRIPTOR, message.noise),
        message.error or None,
        message.samples or None,
        message.seconds,
        message.kept,
        message.rendered_again,
        message.reference_id,
    )


def make_progress(message: messages.CompareResponse.Progress) -> ComparisonProgress:
    return ComparisonProgress(
        message.units_done,
        message.units,
        message.doing,
        message.view,
        message.seed_number,
        message.budget,
        message.samples,
        message.error or None,
        message.seconds,
    )


def _by_region(values: Iterable[tuple[str, str, Any]]) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    whole: dict[str, Any] = {}
    regions: dict[str, dict[str, Any]] = {}
    for region, measure, value in values:
        (regions.setdefault(region, {}) if region else whole)[measure] = value
    return whole, regions


def _vector(message: Any) -> Vector:
    return message.x, message.y, message.z
