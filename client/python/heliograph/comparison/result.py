"""The result of a comparison: units, table, arrays, pictures, files."""

from __future__ import annotations

import functools
import os
import pathlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ..errors import invalid
from ..v1 import compare_pb2 as messages
from . import folder, page, tables
from .pictures import Array as PictureArray
from .pictures import PictureKey, Pictures, Stored
from .record import budgets_of, unit_count, view_count
from .values import (
    MEASURES,
    Array,
    Curve,
    Point,
    Ratio,
    ReferenceInfo,
    Unit,
    make_point,
    make_ratio,
    make_reference,
    make_unit,
    measure_name,
)


class Comparison:
    """Sampling modes compared on one scene: error against time and samples, over seeds.

    A value; compare() makes it, and Comparison.load reads one that was kept. `record` is the protocol's CompareRecord
    with all that was asked for and told. Of a comparison that was interrupted some units are missing: `complete` is
    False then, arrays have NaN in their places, and there are no points, ratios and sentences, or, of a folder that the
    command kept, those of the units that there are.
    """

    def __init__(self, record: messages.CompareRecord, pictures: Mapping[PictureKey, Stored] | None = None) -> None:
        self.record = record
        self.stored_pictures: Mapping[PictureKey, Stored] = {} if pictures is None else pictures

    # ---- what was compared

    @property
    def scene_name(self) -> str:
        """Name of the scene's file."""
        return self.record.scene_name

    @property
    def modes(self) -> tuple[str, ...]:
        """Names, the first being that of the mode that the others are compared with."""
        return tuple(mode.name for mode in self.record.request.modes)

    @property
    def seeds(self) -> int:
        """Of each mode."""
        return self.record.request.seeds

    @property
    def budgets(self) -> Array:
        """Rising: samples per pixel, or seconds of a view where budgets_are_seconds is True."""
        return np.array(budgets_of(self.record.request), np.float64)

    @property
    def budgets_are_seconds(self) -> bool:
        """Whether times= were asked for, rather than samples=."""
        return bool(self.record.request.times_s)

    @property
    def views(self) -> int:
        """Number of cameras."""
        return view_count(self.record.request)

    @property
    def measures(self) -> tuple[str, ...]:
        """Those that units have of the whole picture."""
        numbers = {value.measure for unit in self.record.units for value in unit.values if not value.region}
        return tuple(measure_name(number) for number in sorted(numbers))

    @property
    def regions(self) -> tuple[str, ...]:
        """Parts of the picture that units have measures of, "dark half" among them."""
        return tuple(dict.fromkeys(v.region for unit in self.record.units for v in unit.values if v.region))

    @property
    def main_measure(self) -> str:
        """ "relmse" where units have it, else the first measure that they have; empty: none."""
        there = self.measures
        return "relmse" if "relmse" in there else there[0] if there else ""

    # ---- what was found

    @functools.cached_property
    def units(self) -> list[Unit]:
        """By mode, seed, budget and view."""
        return [make_unit(unit) for unit in self.record.units]

    @functools.cached_property
    def points(self) -> list[Point]:
        """Means over seeds of each mode, budget and view; of a path also of all views."""
        return [make_point(point) for point in self.record.table.points]

    @functools.cached_property
    def ratios(self) -> list[Ratio]:
        """Of each mode against the first."""
        return [make_ratio(ratio) for ratio in self.record.table.ratios]

    @property
    def sentences(self) -> tuple[str, ...]:
        """What decides and what is not certain, for people to read."""
        return tuple(self.record.table.sentences)

    @property
    def references(self) -> list[ReferenceInfo]:
        """Of each view that has a reference so far."""
        return [make_reference(reference) for reference in self.record.references]

    @property
    def notices(self) -> tuple[str, ...]:
        """How pictures differ from what the views ask for, and calls from one another, a sentence each."""
        differences = (text for call in self.record.calls for text in call.differences)
        return tuple(dict.fromkeys([*self.record.notices, *differences]))

    @property
    def complete(self) -> bool:
        """Whether all units are there, and the table of them."""
        return bool(self.record.HasField("table")) and not self.record.table.partial

    @property
    def unit_count(self) -> int:
        """Of the whole comparison: modes x seeds x budgets x views."""
        return unit_count(self.record.request)

    @property
    def disturbed(self) -> bool:
        """Whether other programs took so much processor time from a unit that its seconds are not those of an idle
        machine."""
        return any(unit.disturbed for unit in self.record.units)

    # ---- arrays

    def errors(self, measure: str = "relmse", *, region: str = "") -> Array:
        """Of every unit: modes x seeds x budgets, and of a path x views. NaN: not there.

        region: empty: the whole picture; "dark half": the pixels whose reference is no brighter than half of them; or
        a name of `regions`. InvalidArgument: no such measure or region.
        """
        number = self._measure(measure, region)

        def value(unit: messages.CompareUnit) -> float | None:
            return next((v.value for v in unit.values if v.measure == number and v.region == region), None)

        return self._array(value)

    def seconds(self) -> Array:
        """Wall time in which each unit's picture was rendered: modes x seeds x budgets, and of a path x views."""
        return self._array(lambda unit: unit.seconds)

    def samples(self) -> Array:
        """Fresh samples per pixel of each unit: modes x seeds x budgets, and of a path x views."""
        return self._array(lambda unit: unit.samples)

    def curve(self, mode: str, measure: str = "relmse", *, region: str = "", view: int | None = None) -> Curve:
        """One measure of a mode against its budgets: means over seeds with their 95 % intervals.

        view: of a path; None: the means over its views. Of a comparison that is not complete the means are those of
        the units that there are, without intervals. InvalidArgument: no such mode, measure, region or view.
        """
        self._check_mode(mode)
        self._measure(measure, region)
        if view is not None and (isinstance(view, bool) or not isinstance(view, int) or not 0 <= view < self.views):
            raise invalid("view", view, f"[0, {self.views - 1}], or None: the means over all views")
        budgets = self.budgets
        seconds, samples, mean, low, high = np.full((5, len(budgets)), np.nan)
        if self.complete:
            wanted = None if view is None and self.views > 1 else view or 0
            for point in self.points:
                if point.mode != mode or point.view != wanted:
                    continue
                at = point.budget
                seconds[at], samples[at] = point.seconds.mean, point.samples
                value = (point.regions.get(region, {}) if region else point.values).get(measure)
                if value is not None:
                    mean[at], low[at], high[at] = value.mean, value.low, value.high
        else:
            number = self.modes.index(mode)
            for array, target in ((self.seconds(), seconds), (self.samples(), samples)):
                target[:] = self._means(array[number], view)
            mean[:] = self._means(self.errors(measure, region=region)[number], view)
        return Curve(mode, measure, region, budgets, seconds, samples, mean, low, high)

    def _means(self, array: Array, view: int | None) -> Array:
        """Over seeds and views, of numbers that are there."""
        by_budget = np.moveaxis(array, 1, 0)
        if view is not None and self.views > 1:
            by_budget = by_budget[..., view]
        rows = [row[~np.isnan(row)] for row in by_budget.reshape(len(by_budget), -1)]
        return np.array([row.mean() if row.size else np.nan for row in rows], np.float64)

    def _array(self, value: Callable[[messages.CompareUnit], float | None]) -> Array:
        shape = (len(self.modes), self.seeds, len(self.budgets), self.views)
        array = np.full(shape, np.nan)
        place = {mode: number for number, mode in enumerate(self.modes)}
        for unit in self.record.units:
            found = value(unit)
            if found is not None:
                array[place[unit.mode], unit.seed_number - 1, unit.budget, unit.view] = found
        return array[..., 0] if self.views == 1 else array

    def _measure(self, measure: str, region: str) -> int:
        there = self.measures if self.record.units else tuple(MEASURES)
        if region and self.record.units:
            if region not in self.regions:
                raise invalid("region", region, ", ".join(map(repr, self.regions)) or "none: units tell no regions")
            numbers = {v.measure for unit in self.record.units for v in unit.values if v.region == region}
            there = tuple(measure_name(number) for number in sorted(numbers))
        if measure not in there:
            raise invalid("measure", measure, ", ".join(map(repr, there)))
        return MEASURES.get(measure) or next(
            v.measure for unit in self.record.units for v in unit.values if measure_name(v.measure) == measure
        )

    def _check_mode(self, mode: str) -> None:
        if mode not in self.modes:
            raise invalid("mode", mode, ", ".join(map(repr, self.modes)))

    # ---- pictures

    @property
    def pictures(self) -> Pictures:
        """By mode, with pictures=True: of the first seed and the last budget, radiance, H x W x 3, float32. Of a path
        V x H x W x 3, NaN where a view is missing. NotFound (also a KeyError): there is none."""
        return Pictures(self.stored_pictures, self.modes, self.views)

    @property
    def reference(self) -> PictureArray | None:
        """The reference, with pictures=True: as `pictures`. None: there is none."""
        return self.pictures.of("")

    # ---- tables

    def units_frame(self) -> Any:
        """A pandas.DataFrame with a row for each unit and a column for each measure. MissingPackage: no pandas."""
        return tables.to_frame(tables.units_table(self.record), "units_frame")

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with a row for each point and measure: mean, low, high over seeds. MissingPackage: no
        pandas."""
        return tables.to_frame(tables.points_table(self.record), "to_pandas")

    def ratios_frame(self) -> Any:
        """A pandas.DataFrame with a row for each ratio. MissingPackage: no pandas."""
        return tables.to_frame(tables.ratios_table(self.record), "ratios_frame")

    # ---- files

    def save(self, path: str | os.PathLike[str]) -> pathlib.Path:
        """Keeps it in the folder `path`, which is made where it does not exist, and answers it: comparison.json, the
        pictures, and CSV files of units, points and ratios. The command `heliograph compare` goes on with such a
        folder, and load() reads those of the command.

        FailedPrecondition: the command, or another save(), is writing to the folder. OSError: it cannot be written.
        """
        target = pathlib.Path(path)
        folder.write_folder(target, self.record, self.stored_pictures)
        return target

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Comparison:
        """Reads a folder of save() or of the command `heliograph compare`, or the comparison.json in one. Pictures are
        read when they are asked for.

        NotFound: no such file. InvalidArgument: it is broken, or of a newer format.
        """
        return cls(*folder.read_folder(pathlib.Path(path)))

    # ---- for people

    def _repr_html_(self) -> str:
        return page.to_html(self)

    def __repr__(self) -> str:
        told: Iterable[str] = (
            f"'{self.scene_name}'",
            "modes " + ", ".join(self.modes),
            page.counted(self.seeds, "seed"),
            page.counted(len(self.budgets), "budget") + f" of {'time' if self.budgets_are_seconds else 'samples'}",
            *([f"{self.views} views"] if self.views > 1 else []),
            f"{len(self.record.units)} of {self.unit_count} units",
        )
        return f"<heliograph.Comparison {'; '.join(told)}>"
