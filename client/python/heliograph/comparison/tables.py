"""Units, points and ratios as tables: for files (units.csv and so on, as the command `heliograph compare` writes them)
and for pandas."""

from __future__ import annotations

import csv
import io
from typing import Any, NamedTuple

from ..errors import MissingPackage
from ..v1 import compare_pb2 as messages
from .record import budgets_of
from .values import Interval, make_point, make_ratio, measure_name


class Table(NamedTuple):
    """Cells are strings, numbers and booleans; None: empty."""

    columns: list[str]
    rows: list[list[Any]]


def units_table(record: messages.CompareRecord) -> Table:
    """A row for each unit, with a column for each measure ("relmse") and measure of a region ("relmse dark half")."""
    measured = sorted({(value.measure, value.region) for unit in record.units for value in unit.values})
    column = {key: number for number, key in enumerate(measured)}
    columns = ["mode", "seed_number", "seed", _budget_name(record), "view", "seconds", "samples", "rays", "paths"]
    columns += ["invalid_samples", "reuse_share", "others_share", "disturbed"]
    columns += [measure_name(measure) + (f" {region}" if region else "") for measure, region in measured]
    budgets = budgets_of(record.request)
    rows = []
    for unit in record.units:
        values: list[float | None] = [None] * len(measured)
        for value in unit.values:
            values[column[value.measure, value.region]] = value.value
        row: list[Any] = [unit.mode, unit.seed_number, unit.seed, _budget(budgets, unit.budget), unit.view]
        row += [unit.seconds, unit.samples, unit.rays, unit.paths, unit.invalid_samples, unit.reuse_share]
        rows.append([*row, unit.others_share, unit.disturbed, *values])
    return Table(columns, rows)


def points_table(record: messages.CompareRecord) -> Table:
    """A row for each point and measure."""
    columns = ["mode", _budget_name(record), "view", "seeds", "seconds", "seconds_low", "seconds_high", "samples"]
    columns += ["measure", "region", "mean", "low", "high", "few_pixels_decide", "disturbed"]
    budgets = budgets_of(record.request)
    rows: list[list[Any]] = []
    for message in record.table.points:
        point = make_point(message)
        view: Any = "all" if point.view is None else point.view
        start: list[Any] = [point.mode, _budget(budgets, point.budget), view, point.seeds]
        start += [*_cells(point.seconds), point.samples]
        for value in message.values:
            name, region = measure_name(value.measure), value.region
            told = (point.regions[region] if region else point.values)[name]
            rows.append([*start, name, region, *_cells(told), told.few_pixels_decide, point.disturbed])
    return Table(columns, rows)


def ratios_table(record: messages.CompareRecord) -> Table:
    """A row for each ratio."""
    rows: list[list[Any]] = []
    for ratio in map(make_ratio, record.table.ratios):
        row = [ratio.kind, ratio.mode, ratio.baseline, ratio.measure, ratio.region, ratio.at]
        rows.append([*row, *_cells(ratio.ratio), ratio.verdict, ratio.few_pixels_decide, ratio.different_calls])
    columns = ["kind", "mode", "baseline", "measure", "region", "at", "ratio", "low", "high", "verdict"]
    return Table([*columns, "few_pixels_decide", "different_calls"], rows)


def to_csv(table: Table) -> str:
    """RFC 4180."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(table.columns)
    writer.writerows([_text(cell) for cell in row] for row in table.rows)
    return text.getvalue()


def to_frame(table: Table, method: str) -> Any:
    """A pandas.DataFrame. MissingPackage: pandas is not installed."""
    try:
        import pandas
    except ImportError:
        raise MissingPackage(
            f"{method}() needs the package pandas, which is not installed: pip install 'heliograph[pandas]', "
            "or pip install pandas",
            problems=(),
        ) from None
    return pandas.DataFrame(table.rows, columns=table.columns)


def _budget_name(record: messages.CompareRecord) -> str:
    return "budget_seconds" if record.request.times_s else "budget_samples"


def _budget(budgets: list[float], index: int) -> float | None:
    return budgets[index] if index < len(budgets) else None


def _cells(interval: Interval) -> list[float | None]:
    return [interval.mean, *([interval.low, interval.high] if interval.known else [None, None])]


def _text(cell: Any) -> str:
    """A number as the shortest text that reads back as the same."""
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "1" if cell else "0"
    return repr(cell).removesuffix(".0") if isinstance(cell, float) else str(cell)
