"""Arguments of compare() to the protocol's CompareRequest, with every problem told at once."""

from __future__ import annotations

import contextlib
import dataclasses
import operator
import os
import pathlib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, Union

from ..camera import Camera
from ..errors import HeliographError, NotFound, Problem, invalid_all
from ..scene import SceneValues
from ..settings import (
    Denoiser,
    Settings,
    Size,
    choices,
    make_settings,
    read_gaze,
    read_number,
    read_size,
    read_timeout,
)
from ..v1 import compare_pb2 as messages
from ..v1 import types_pb2 as types
from .record import make_plain
from .references import ReferenceFile, ReferencePicture, read_references
from .regions import Region, add_regions, check_regions
from .result import Comparison
from .values import MEASURES

Measure = Literal[
    "mse",
    "relmse",
    "bias",
    "distance-variance",
    "dssim",
    "flip",
    "flip-median",
    "hdr-flip",
    "hdr-flip-median",
    "flicker",
    "outlier-share",
    "told-rmse",
]
ComparedPicture = Literal["film", "display", "preview"]


class CompareMode(Settings, total=False):
    """A way to render that takes part in a comparison: settings, and

    name: unique; 1 to 64 of A-Z, a-z, 0-9, ".", "_", "+", "-", the first a letter or digit; without one mode and
    integrator.
    picture: "film" (default); "display": the layer display; "preview": previews along a path of cameras, with
    preview_rate above 0. denoiser: of the display.
    """

    name: str
    picture: ComparedPicture
    denoiser: Denoiser


#: The modes of a comparison, the first being what the others are compared with: words of modes and integrators or dicts
#: of settings; or a dict from names to these.
Modes = Union[Mapping[str, Union[str, CompareMode]], Iterable[Union[str, CompareMode]]]
Reference = Union[ReferencePicture, Iterable[ReferencePicture], Settings, None]

_DEFAULT_SAMPLES = (1, 2, 4, 8, 16, 32, 64)
_MODES = choices(types.Mode.DESCRIPTOR)
_INTEGRATORS = choices(types.Integrator.DESCRIPTOR)
_PICTURES = choices(messages.ComparedPicture.DESCRIPTOR)
_DENOISERS = choices(types.Denoiser.DESCRIPTOR)
#: Words that are no mode or integrator by themselves; the command `heliograph compare` has the same ones.
_WORDS: dict[str, dict[str, Any]] = {
    "paper-adaptive": {"mode": "adaptive", "variant": "paper"},
    "paper-reproject": {"mode": "reproject", "variant": "paper"},
    "paper-combined": {"mode": "combined", "variant": "paper"},
    "display": {"picture": "display"},
    "oidn": {"picture": "display", "denoiser": "oidn"},
    "preview": {"mode": "combined", "picture": "preview", "preview_rate": 20},
}
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,63}")
_MOST_SAMPLES = 2**30
_MOST_MODES = _MOST_BUDGETS = 64
_MOST_VIEWS = 1000
_LONGEST_SIDE = 65536


@dataclasses.dataclass(frozen=True)
class Plan:
    """What compare() was asked for. The request has neither loaded references nor units that are done."""

    request: messages.CompareRequest
    files: tuple[ReferenceFile, ...]  # the references of the views; none: they are rendered
    scene_name: str
    scene_file: str
    resume: Comparison | None
    output: pathlib.Path | None
    mix: bool
    timeout: float | None
    given_views: bool  # views= and not camera=

    def argument_of(self, field: str) -> str:
        """Of modes[1].settings.max_segments "modes['bdpt'].max_segments": what the caller wrote."""
        mode = re.match(r"modes\[(\d+)\](?:\.settings)?", field)
        if mode and int(mode[1]) < len(self.request.modes):
            rest = field[mode.end() :]
            if rest in (".width", ".height", ".width x height"):
                return "size"
            name = self.request.modes[int(mode[1])].name
            return f"modes[{mode[1]}].name" if rest == ".name" else f"modes[{name!r}]{rest}"
        if len(self.files) == 1 and field == "reference.loaded.reference_ids[0]":
            return "reference"
        for pattern, argument in _ARGUMENTS:
            match = pattern.match(field)
            if match:
                return argument + field[match.end() :]
        view = re.match(r"views\[0\]", field)
        return "camera" + field[view.end() :] if view and not self.given_views else field


_ARGUMENTS = [
    (re.compile(pattern), argument)
    for pattern, argument in (
        (r"times_s", "times"),
        (r"done\b", "resume.units"),
        (r"reference\.rendered\.error", "reference_error"),
        (r"reference\.rendered\.max_samples", "reference_samples"),
        (r"reference\.rendered(?:\.settings)?", "reference"),
        (r"reference\.loaded\.reference_ids", "reference"),
        (r"first_seed", "seed"),
        (r"send_pictures", "pictures"),
    )
]


class _Problems(list[Problem]):
    def __init__(self) -> None:
        super().__init__()
        self._files: list[tuple[HeliographError, str]] = []

    @contextlib.contextmanager
    def within(self, place: str = "", *, file_of: str = "") -> Iterator[None]:
        """Collects what is raised, with `place` before its fields. file_of: the argument that names a file, which an
        error without fields is about."""
        try:
            yield
        except HeliographError as error:
            if not error.problems:
                if not file_of:
                    raise
                self._files.append((error, file_of))
            self.extend(problem._replace(field=place + problem.field) for problem in error.problems)

    def tell(self) -> None:
        """Raises all of it at once; what is wrong with a file as it is where that is all."""
        if not self and len(self._files) == 1:
            raise self._files[0][0]
        found = [
            Problem(argument, error.message.removeprefix(f"{argument}: "), "a file that can be read")
            for error, argument in self._files
        ]
        if found or self:
            raise invalid_all([*found, *self])

    def add(self, field: str, value: object, allowed: str) -> None:
        self.append(Problem(field, value if isinstance(value, str) else repr(value), allowed))


def make_plan(
    scene: SceneValues | None,
    scene_file: str,
    modes: Modes,
    *,
    seeds: int,
    samples: Iterable[int] | int | None,
    times: Iterable[float] | float | None,
    camera: Camera | str | int | None,
    views: Iterable[Camera | str | int] | None,
    size: Size | None,
    reference: Reference,
    reference_error: float | None,
    reference_samples: int | None,
    regions: Mapping[str, Region] | None,
    gaze: tuple[float, float] | None,
    measures: Measure | Iterable[Measure] | None,
    common_seeds: bool,
    exclusive: bool,
    pictures: bool,
    worst_pixels: int,
    resume: Comparison | None,
    output: str | os.PathLike[str] | None,
    mix: bool,
    timeout: float | None,
    settings: Mapping[str, Any],
) -> Plan:
    """scene: None: not loaded yet; what is wrong whatever it is like is told, and the plan is of no use.

    InvalidArgument: everything that is wrong. NotFound: a file of the reference, where that is all."""
    problems = _Problems()
    request = messages.CompareRequest(scene_id=scene.id if scene is not None else "")
    cameras: list[Camera] = []
    if scene is None:
        if not os.path.isfile(scene_file):
            text = "is not a regular file" if os.path.exists(scene_file) else "no such file"
            with problems.within(file_of="scene"):
                raise NotFound(f"{scene_file}: {text}", problems=())
    else:
        with problems.within():
            cameras = _cameras(scene, camera, views, problems)
    view_count = _view_count(views, problems)
    request.views.extend(view.view for view in cameras)
    shared = dict(settings)
    request.first_seed = _whole(shared.pop("seed", None) or 0, "seed", 0, 2**64 - 1, problems)
    _add_modes(request, modes, shared, problems)
    files: tuple[ReferenceFile, ...] = ()
    if reference is None or isinstance(reference, Mapping):
        _add_rendered(request, reference, reference_error, reference_samples, problems)
    else:
        with problems.within(file_of="reference"):
            files = read_references(reference, view_count)
        for name, limit in (("reference_error", reference_error), ("reference_samples", reference_samples)):
            if limit is not None:
                problems.add(name, limit, "none: the reference is given, and not rendered")
    pixels: Sequence[int] | None = files[0].size if files else None
    if size is not None:
        with problems.within():
            pixels = read_size(size)
            for side in pixels:
                if not 1 <= side <= _LONGEST_SIDE:
                    problems.add("size", side, f"[1, {_LONGEST_SIDE}]")
    if cameras and scene is not None:
        _complete(request, scene, cameras[0], pixels)
    request.seeds = _whole(seeds, "seeds", 1, 1000, problems)
    _add_budgets(request, samples, times, problems)
    problems.extend(add_regions(request, regions))
    if request.modes and pixels is None and cameras:
        pixels = request.modes[0].settings.width, request.modes[0].settings.height
    problems.extend(check_regions(request, pixels))
    _add_gaze(request, gaze, pixels, problems)
    _add_measures(request, measures, view_count > 1, problems)
    for mode in request.modes:
        if mode.picture == messages.COMPARED_PICTURE_PREVIEW and view_count < 2:
            problems.add(f"modes[{mode.name!r}].picture", "preview", "with views=, a path of cameras")
    for name, flag in (("common_seeds", common_seeds), ("exclusive", exclusive), ("pictures", pictures), ("mix", mix)):
        if not isinstance(flag, bool):
            problems.add(name, flag, "True or False")
    request.common_seeds, request.exclusive = bool(common_seeds), bool(exclusive)
    request.send_pictures = bool(pictures)
    request.worst_pixels = _whole(worst_pixels, "worst_pixels", 0, 64, problems)
    with problems.within():
        timeout = None if timeout is None else read_timeout("timeout", timeout)
    if resume is not None and not isinstance(resume, Comparison):
        problems.add("resume", resume, "a Comparison, or None")
    kept = None
    if output is not None:
        kept, resume = _read_output(output, resume, problems)
        request.send_pictures = True
    problems.tell()
    name = scene.name if scene is not None else ""
    return Plan(request, files, name, scene_file, resume, kept, mix, timeout, views is not None)


def _read_output(
    output: Any, resume: Comparison | None, problems: _Problems
) -> tuple[pathlib.Path | None, Comparison | None]:
    """The folder, and what it has."""
    if not isinstance(output, (str, os.PathLike)) or not os.fspath(output):
        problems.add("output", output, "a folder, or the name of a new one")
        return None, resume
    path = pathlib.Path(output)
    if resume is not None:
        problems.add("resume", resume, "either resume or output")
    elif path.exists() and not path.is_dir():
        problems.add("output", str(path), "a folder, or the name of a new one")
    elif (path / "comparison.json").exists():
        with problems.within(file_of="output"):
            resume = Comparison.load(path)
    return path, resume


def _view_count(views: Any, problems: _Problems) -> int:
    if views is None or isinstance(views, (str, int, Camera)):
        return 1
    try:
        count = len(views)
    except TypeError:
        problems.add("views", views, "a list of cameras")
        return 1
    if count > _MOST_VIEWS:
        problems.add("views", f"{count} cameras", f"at most {_MOST_VIEWS}")
    return max(1, count)


def _cameras(
    scene: SceneValues,
    camera: Camera | str | int | None,
    views: Iterable[Camera | str | int] | None,
    problems: _Problems,
) -> list[Camera]:
    if views is None:
        return [scene.camera(camera)]
    if camera is not None:
        problems.add("camera", camera, "either camera or views")
    found = []
    for number, choice in enumerate([views] if isinstance(views, (str, int, Camera)) else views):
        with problems.within(f"views[{number}]."):
            found.append(scene.camera(choice))
    if not found and not problems:
        problems.add("views", [], "at least one camera")
    return found


def _whole(value: Any, name: str, least: int, most: int, problems: _Problems, *, even: bool = False) -> int:
    """0 where it is no whole number in [least, most], or is to be even and is not."""
    try:
        if isinstance(value, bool):
            raise TypeError
        number = operator.index(value)
        if least <= number <= most and not (even and number % 2):
            return number
    except TypeError:
        pass
    end = most if most < _MOST_SAMPLES else f"2^{most.bit_length() - 1}" if most == _MOST_SAMPLES else "2^64 - 1"
    problems.add(name, value, f"{'even' if even else 'whole'} numbers in [{least}, {end}]")
    return 0


def _ranged(name: str, value: Any, least: float, most: float, problems: _Problems) -> float | None:
    """None where it is no number in [least, most]."""
    with problems.within():
        number = read_number(name, value)
        if least <= number <= most:
            return number
        problems.add(name, value, f"[{least:g}, {most:g}]")
    return None


def _listed(modes: Modes, problems: _Problems) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """Number, name and values of each mode that can be read; a name is empty where it is to be made up."""
    words = ", ".join(repr(word) for word in dict.fromkeys([*_MODES, *_INTEGRATORS, *_WORDS]))
    allowed = f"{words}, or a dict of settings"
    named: Iterable[tuple[str, Any]] = ()
    try:
        if isinstance(modes, Mapping):
            named = list(modes.items())
        else:
            named = [("", modes)] if isinstance(modes, str) else [("", mode) for mode in modes]
    except TypeError:
        problems.add("modes", modes, f"a list of modes, or a dict of them by name; a mode is one of {allowed}")
    for number, (name, mode) in enumerate(named):
        place = f"modes[{name!r}]" if name else f"modes[{number}]"
        if not isinstance(name, str):
            problems.add(place, name, "a dict from names, which are strings")
        elif isinstance(mode, str) and mode in _MODES:
            yield number, name or mode, {"mode": mode}
        elif isinstance(mode, str) and mode in _INTEGRATORS:
            yield number, name or mode, {"integrator": mode}
        elif isinstance(mode, str) and mode in _WORDS:
            yield number, name or mode, dict(_WORDS[mode])
        elif isinstance(mode, Mapping):
            values = dict(mode)
            own = values.pop("name", None)
            if own is not None and (name or not isinstance(own, str)):
                problems.add(f"{place}.name", own, "a string, and in a dict of modes none")
            yield number, name or str(own or ""), values
        else:
            problems.add(place, mode, allowed)


def _add_modes(request: messages.CompareRequest, modes: Modes, shared: dict[str, Any], problems: _Problems) -> None:
    names: set[str] = set()
    for number, given, own in _listed(modes, problems):
        picture = {key: own.pop(key, None) for key in ("picture", "denoiser")}
        values = {**shared, **own}
        words = [
            str(values[key])
            for key, usual in (("mode", "pt"), ("integrator", "path"))
            if values.get(key, usual) != usual
        ]
        name = given or "-".join(words) or "pt"
        if name in names:
            problems.add(f"modes[{number}].name", name, "another name: this one is there twice")
        if not _NAME.fullmatch(name):
            allowed = "1 to 64 of A-Z, a-z, 0-9, '.', '_', '+', '-', the first a letter or digit"
            problems.add(f"modes[{number}].name", name, allowed)
        names.add(name)
        place = f"modes[{name!r}]."
        mode = request.modes.add(name=name)
        for key, choices_of in (("picture", _PICTURES), ("denoiser", _DENOISERS)):
            word = picture[key]
            if isinstance(word, str) and word in choices_of:
                setattr(mode, key, choices_of[word])
            elif word is not None:
                problems.add(place + key, word, ", ".join(repr(choice) for choice in choices_of))
        for key, why in (
            ("seed", "seed= of the comparison gives every mode its seeds"),
            ("region", "whole pictures are compared"),
        ):
            word = values.pop(key, None)
            if word is not None:
                problems.add(place + key, word, f"none: {why}")
        with problems.within(place):
            mode.settings.CopyFrom(make_settings(None, values))
    if len(request.modes) > _MOST_MODES:
        problems.add("modes", f"{len(request.modes)} modes", f"at most {_MOST_MODES}")
    if not request.modes and not any(problem.field.startswith("modes") for problem in problems):
        problems.add("modes", modes, "at least one mode")


def _add_rendered(
    request: messages.CompareRequest,
    own: Mapping[str, Any] | None,
    error: float | None,
    samples: int | None,
    problems: _Problems,
) -> None:
    """own: settings in place of the first mode's, None: none."""
    rendered = request.reference.rendered
    if own is not None and request.modes:
        rendered.settings.CopyFrom(request.modes[0].settings)
        make_plain(rendered.settings)
        with problems.within("reference."):
            rendered.settings.MergeFrom(make_settings(None, own))
    if error is not None:
        rendered.error = _ranged("reference_error", error, 1e-4, 1, problems) or 0
    if samples is not None:
        rendered.max_samples = _whole(samples, "reference_samples", 2, _MOST_SAMPLES, problems, even=True)


def _complete(request: messages.CompareRequest, scene: SceneValues, camera: Camera, size: Sequence[int] | None) -> None:
    """Fills in what the file and its camera ask for, but for a crop: whole pictures are compared."""
    every = [mode.settings for mode in request.modes]
    if request.reference.rendered.HasField("settings"):
        every.append(request.reference.rendered.settings)
    for settings in every:
        if size is not None:
            settings.width, settings.height = size
        scene.complete(settings, camera)
        settings.ClearField("region")


def _add_budgets(
    request: messages.CompareRequest,
    samples: Iterable[int] | int | None,
    times: Iterable[float] | float | None,
    problems: _Problems,
) -> None:
    if samples is not None and times is not None:
        problems.add("times", times, "either samples or times")
        return
    name, given = ("samples", _DEFAULT_SAMPLES if samples is None else samples) if times is None else ("times", times)
    try:
        listed: list[Any] = list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    except TypeError:
        listed = [given]
    if not listed:
        problems.add(name, given, "at least one budget")
    if len(listed) > _MOST_BUDGETS:
        problems.add(name, f"{len(listed)} budgets", f"at most {_MOST_BUDGETS}")
    before: Any = 0
    for number, budget in enumerate(listed):
        place = f"{name}[{number}]"
        read: Any
        if name == "samples":
            read = _whole(budget, place, 1, _MOST_SAMPLES, problems)
        else:
            read = _ranged(place, budget, 1e-3, 86400, problems)
        if not read:
            continue
        if not read > before:
            problems.add(place, f"{budget!r} after {before!r}", "rising budgets")
        before = read
        if name == "samples":
            request.samples.append(read)
        else:
            request.times_s.append(read)


def _add_gaze(request: messages.CompareRequest, gaze: Any, size: Sequence[int] | None, problems: _Problems) -> None:
    """size: None: not known yet."""
    with problems.within():
        point = read_gaze(gaze)
        foveated = any(mode.settings.foveation > types.FOVEATION_NONE for mode in request.modes)
        if foveated and size is not None:
            x, y = point or (size[0] / 2, size[1] / 2)
            request.gaze.x, request.gaze.y = x, y
        elif point is not None and not foveated and not any(told.field.startswith("modes") for told in problems):
            problems.add("gaze", gaze, "none, or with a mode that has foveation")


def _add_measures(
    request: messages.CompareRequest, measures: Measure | Iterable[Measure] | None, path: bool, problems: _Problems
) -> None:
    try:
        listed = [measures] if isinstance(measures, str) else list(measures or ())
    except TypeError:
        listed = [measures]  # type: ignore[list-item]
    for measure in listed:
        if isinstance(measure, str) and measure in MEASURES:
            request.measures.append(MEASURES[measure])  # type: ignore[arg-type]
            if measure == "flicker" and not path:
                problems.add("measures", measure, "with views=, a path of cameras")
        else:
            problems.add("measures", measure, ", ".join(repr(word) for word in MEASURES))
