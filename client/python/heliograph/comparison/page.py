"""A comparison as a small table for notebooks."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

from .values import Interval, Point, Ratio

if TYPE_CHECKING:
    from .result import Comparison

_HEADS = {"equal-time": "error, equal time", "equal-samples": "error, equal samples", "speed": "time, equal samples"}


def to_html(comparison: Comparison) -> str:
    """The last budget: samples, seconds and the first measure of every mode, and what they are of the first mode's."""
    measure = comparison.main_measure
    unit = "s" if comparison.budgets_are_seconds else "samples"
    heads = ["mode", "samples", "seconds", measure or "error"]
    kinds = [kind for kind in _HEADS if any(ratio.kind == kind for ratio in comparison.ratios)]
    heads += [f"{_HEADS[kind]} / {comparison.modes[0]}" for kind in kinds]
    lines = []
    for mode in comparison.modes:
        point = _last_point(comparison, mode)
        cells = [mode, *_cells_of(comparison, mode, measure, point)]
        cells += [_ratio_text(comparison, mode, kind, measure) for kind in kinds]
        lines.append("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>")
    budget = f"{comparison.budgets[-1]:g} {unit}" if len(comparison.budgets) else ""
    caption = f"{comparison.scene_name}, {budget}, {counted(comparison.seeds, 'seed')}, mean [95 % interval]"
    if not comparison.complete:
        caption += f"; incomplete: {len(comparison.record.units)} of {comparison.unit_count} units"
    head = "".join(f"<th>{html.escape(text)}</th>" for text in heads)
    sentences = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in comparison.sentences)
    return (
        f"<table><caption>{html.escape(caption)}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{''.join(lines)}</tbody></table>"
        + (f"<details><summary>In words</summary><ul>{sentences}</ul></details>" if sentences else "")
    )


def counted(number: int, what: str) -> str:
    """ "1 seed", "2 seeds"."""
    return f"{number} {what}" + ("" if number == 1 else "s")


def _last_point(comparison: Comparison, mode: str) -> Point | None:
    last = len(comparison.budgets) - 1
    points = [point for point in comparison.points if point.mode == mode and point.budget == last]
    return next((point for point in points if point.view is None), points[0] if len(points) == 1 else None)


def _cells_of(comparison: Comparison, mode: str, measure: str, point: Point | None) -> list[str]:
    if point is not None:
        value = point.values.get(measure)
        return [f"{point.samples:g}", str(point.seconds), str(value) if value is not None else ""]
    if not measure:
        return ["", "", ""]
    curve = comparison.curve(mode, measure)  # of the units that there are
    numbers = (f"{curve.samples[-1]:g}", f"{curve.seconds[-1]:.3g}", str(Interval(float(curve.mean[-1]))))
    return ["" if "nan" in text else text for text in numbers]


def _ratio_text(comparison: Comparison, mode: str, kind: str, measure: str) -> str:
    """The one after the most time or samples."""
    wanted: list[Ratio] = [
        ratio
        for ratio in comparison.ratios
        if ratio.mode == mode and ratio.kind == kind and not ratio.region and ratio.measure in ("", measure)
    ]
    if not wanted:
        return ""
    ratio = max(wanted, key=lambda found: found.at)
    return f"{ratio.ratio}" + ("" if ratio.verdict == "unspecified" else f", {ratio.verdict}")
