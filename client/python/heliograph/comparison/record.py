"""The record of a comparison (CompareRecord): its text, and what becomes of it when more is asked for. As the command
`heliograph compare` has it (client/comparison/comparison_record.cpp), so that both go on with each other's folders."""

from __future__ import annotations

import bisect
from collections.abc import Iterator, Sequence
from typing import Any

from ..errors import InvalidArgument
from ..settings import enum_name
from ..v1 import compare_pb2 as messages
from ..v1 import types_pb2 as types
from .regions import pixels, text_of

FORMAT = 1


def record_json(record: messages.CompareRecord) -> str:
    """Protobuf JSON."""
    from google.protobuf import json_format

    text: str = json_format.MessageToJson(record, indent=1)
    return text + "\n"


def parse_record(text: str, name: str) -> messages.CompareRecord:
    """Keys that this version does not know are left out. `name` stands in messages.

    InvalidArgument: it is no such JSON, of a newer format, or its units are not those of its request.
    """
    from google.protobuf import json_format

    record = messages.CompareRecord()
    try:
        json_format.Parse(text, record, ignore_unknown_fields=True)
    except json_format.ParseError as error:
        raise InvalidArgument(f"{name}: is no record of a comparison: {str(error)[:200]}", problems=()) from None
    if record.format > FORMAT:
        raise InvalidArgument(f"{name}: is of format {record.format}; this version reads up to {FORMAT}", problems=())
    if record.format == 0:
        raise InvalidArgument(f"{name}: is no record of a comparison: it names no format", problems=())
    for problem in _unfit_units(record):
        raise InvalidArgument(f"{name}: {problem}", problems=())
    return record


def _unfit_units(record: messages.CompareRecord) -> Iterator[str]:
    request = record.request
    modes, budgets = {mode.name for mode in request.modes}, len(budgets_of(request))
    seen = set()
    for number, unit in enumerate(record.units):
        place = f"units/{number}"
        if unit.mode not in modes:
            yield f"{place}/mode: '{unit.mode}' is no mode of the request"
        if not 1 <= unit.seed_number <= request.seeds:
            yield f"{place}/seedNumber: {unit.seed_number} is not in [1, {request.seeds}]"
        if unit.budget >= budgets:
            yield f"{place}/budget: {unit.budget} is not below {budgets}"
        if unit.view >= view_count(request):
            yield f"{place}/view: {unit.view} is not below {view_count(request)}"
        key = (unit.mode, unit.seed_number, unit.budget, unit.view)
        if key in seen:
            yield f"{place} is there twice"
        seen.add(key)


def budgets_of(request: messages.CompareRequest) -> list[float]:
    """Samples per pixel, or seconds."""
    return list(request.times_s) or [float(count) for count in request.samples]


def view_count(request: messages.CompareRequest) -> int:
    return max(1, len(request.views))


def unit_count(request: messages.CompareRequest) -> int:
    return len(request.modes) * request.seeds * len(budgets_of(request)) * view_count(request)


def sort_units(record: messages.CompareRecord) -> None:
    """By mode, seed, budget and view, in the request's order."""
    order = {mode.name: number for number, mode in enumerate(record.request.modes)}
    record.units.sort(key=lambda unit: (order.get(unit.mode, len(order)), unit.seed_number, unit.budget, unit.view))


def request_of(record: messages.CompareRecord) -> messages.CompareRequest:
    """The request that goes on with the record: all that was asked for, and the units that there are."""
    request = messages.CompareRequest()
    request.CopyFrom(record.request)
    for unit in record.units:
        done = request.done.add()
        done.CopyFrom(unit)
        done.ClearField("worst")  # is no part of the table
    return request


def extend(
    before: messages.CompareRecord, asked: messages.CompareRequest, scene_name: str, scene_file: str
) -> messages.CompareRecord:
    """A record of what `before` has and what is asked for now: the modes of now first, then those of `before` alone;
    the budgets of both; the larger number of seeds. Without units `before` counts for nothing. There is no table."""
    record = messages.CompareRecord()
    if before.units:
        record.CopyFrom(before)
    record.format = FORMAT
    record.scene_name, record.scene_file = scene_name, scene_file
    record.ClearField("table")
    old = messages.CompareRequest()
    old.CopyFrom(record.request)
    request = record.request
    request.CopyFrom(asked)
    if not _has_foveation(asked) and old.HasField("gaze"):
        request.gaze.CopyFrom(old.gaze)
    names = {mode.name for mode in asked.modes}
    request.modes.extend(mode for mode in old.modes if mode.name not in names)
    request.seeds = max(old.seeds, asked.seeds)
    old_budgets = budgets_of(old)
    budgets = sorted({*old_budgets, *budgets_of(asked)})
    if asked.times_s:
        request.times_s[:] = budgets
    else:
        request.samples[:] = [int(budget) for budget in budgets]
    place = [bisect.bisect_left(budgets, budget) for budget in old_budgets]
    for unit in record.units:
        unit.budget = place[unit.budget]
    for picture in record.pictures:
        if picture.budget < len(place):
            picture.budget = place[picture.budget]
    sort_units(record)
    return record


def differences_of_shape(record: messages.CompareRecord, asked: messages.CompareRequest) -> list[str]:
    """With which units of both would not fit into one table."""
    before = record.request
    return _changes(
        ("picture size", _size(before), _size(asked)),
        ("budgets in", _kind(before), _kind(asked)),
        ("number of views", view_count(before), view_count(asked)),
        ("measures", _measures(before), _measures(asked)),
        ("regions", _regions(before), _regions(asked)),
    )


def differences_of_values(
    before: messages.CompareRecord, now: messages.CompareRecord, call: messages.CompareRecord.Call
) -> list[str]:
    """With which units of both are of different things, or were rendered otherwise. `now` is complete."""
    old, new = before.request, now.request
    found = []
    if old.scene_id != new.scene_id:
        found += _changes(
            ("scene", f"{before.scene_file} ({old.scene_id})".lstrip(), f"{now.scene_file} ({new.scene_id})".lstrip())
        )
    known = {mode.name: mode for mode in old.modes}
    for mode in new.modes:
        if mode.name in known:
            found += [f"mode {mode.name} {text}" for text in differing_fields(known[mode.name], mode)]
    for number, (view, other) in enumerate(zip(old.views, new.views)):
        found += [f"view {number} {text}" for text in differing_fields(view, other)]
    if _has_foveation(old):  # where now has none, it has the gaze of before
        found += _changes(("gaze", _gaze(old), _gaze(new)))
    found += _changes(
        ("first seed", old.first_seed, new.first_seed),
        ("common seeds", _yes(old.common_seeds), _yes(new.common_seeds)),
        ("exclusive", _yes(old.exclusive), _yes(new.exclusive)),
    )
    was, files = before.reference_files, now.reference_files
    found += _changes(("reference", "files" if was else "rendered", "files" if files else "rendered"))
    if was and files:
        for number, (file, given) in enumerate(zip(was, files)):
            if file.sha256 != given.sha256:
                found.append(f"reference of view {number}: {file.path} -> {given.path} (other contents)")
    elif not was and not files:
        changes = differing_fields(old.reference.rendered, new.reference.rendered)
        found += [f"reference {text}" for text in changes]
    if before.calls:
        first = before.calls[0]
        found += _changes(
            ("version", first.version, call.version),
            ("build", first.build, call.build),
            ("instruction set", first.isa, call.isa),
            ("threads", first.threads, call.threads),
        )
    return found


def complete_reference(request: messages.CompareRequest) -> None:
    """Writes the defaults of a rendered reference into it, once the settings of the modes are complete."""
    if request.reference.HasField("loaded"):
        return
    rendered = request.reference.rendered
    rendered.error = rendered.error or 0.01
    rendered.max_samples = rendered.max_samples or 65536
    if rendered.HasField("settings"):
        return
    rendered.settings.CopyFrom(request.modes[0].settings)
    make_plain(rendered.settings)
    rendered.settings.mode, rendered.settings.integrator = types.MODE_PT, types.INTEGRATOR_PATH


def make_plain(settings: types.RenderSettings) -> None:
    """Leaves what is common to all modes and integrators, so that they are those of path tracing."""
    for field in ("mode", "integrator", "variant", "adaptive", "reprojection", "light_cache", "technique"):
        settings.ClearField(field)
    for field in ("preview_rate", "preview_budget_ms", "preview_upscaling"):
        settings.ClearField(field)
    for field in ("foveation", "foveation_paper", "viewing_distance"):
        settings.ClearField(field)


def differing_fields(before: Any, now: Any, place: str = "") -> list[str]:
    """A line for each field of two messages that differs; one that is not set is equal to its default."""
    found: list[str] = []
    for field in before.DESCRIPTOR.fields:
        old, new = getattr(before, field.name), getattr(now, field.name)
        path = place + field.name
        if hasattr(old, "extend"):  # a repeated field
            if list(old) != list(new):
                found.append(f"{path}: {_shown(old)} -> {_shown(new)}")
        elif field.message_type is not None:
            found += differing_fields(old, new, path + ".")
        elif old != new:
            enum = field.enum_type
            texts = [enum_name(enum, value) if enum else str(value) for value in (old, new)]
            found.append(f"{path}: {texts[0]} -> {texts[1]}")
    return found


def _shown(values: Sequence[Any]) -> str:
    return f"{len(values)} values" if len(values) > 8 else str(list(values)).replace("\n", " ")


def _changes(*values: tuple[str, object, object]) -> list[str]:
    return [f"{what}: {before} -> {now}" for what, before, now in values if before != now]


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _size(request: messages.CompareRequest) -> str:
    first = request.modes[0].settings if request.modes else types.RenderSettings()
    return f"{first.width}x{first.height}"


def _kind(request: messages.CompareRequest) -> str:
    return "seconds" if request.times_s else "samples"


def _measures(request: messages.CompareRequest) -> str:
    return ",".join(enum_name(messages.CompareMeasure.DESCRIPTOR, number) for number in request.measures) or "all"


def _regions(request: messages.CompareRequest) -> str:
    return " ".join(text_of(region) for region in request.regions) or "none"


def _has_foveation(request: messages.CompareRequest) -> bool:
    return any(mode.settings.foveation > types.FOVEATION_NONE for mode in request.modes)


def _gaze(request: messages.CompareRequest) -> str:
    return pixels((request.gaze.x, request.gaze.y)) if request.HasField("gaze") else "none"
