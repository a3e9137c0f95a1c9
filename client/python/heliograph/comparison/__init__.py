"""Comparisons of sampling modes: what compare() of a client answers, and the values that it holds."""

from .regions import Disk, Region
from .request import CompareMode, Measure, Modes
from .result import Comparison
from .values import (
    ComparisonProgress,
    Curve,
    Interval,
    Point,
    PointValue,
    Ratio,
    ReferenceInfo,
    Unit,
    WorstPixel,
)

__all__ = [
    "CompareMode",
    "Comparison",
    "ComparisonProgress",
    "Curve",
    "Disk",
    "Interval",
    "Measure",
    "Modes",
    "Point",
    "PointValue",
    "Ratio",
    "ReferenceInfo",
    "Region",
    "Unit",
    "WorstPixel",
]
