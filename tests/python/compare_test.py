"""Comparisons of sampling modes: units, tables, resuming, interruptions, references, folders, both clients."""

import asyncio
import csv
import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from conftest import BOX, ROOT, eventually

import heliograph as hg
import heliograph.aio as ahg
from heliograph import operations
from heliograph.comparison.lock import locked
from heliograph.comparison.references import LoadedReference

SIZE = (32, 32)
SMALL = {"size": SIZE, "reference_samples": 64, "measures": ("mse", "relmse", "bias")}


@pytest.fixture(scope="module")
def result(box):
    """Two modes, five seeds, two budgets, with pictures."""
    return box.compare(["pt", "pt+bdpt"], samples=(2, 4), pictures=True, regions={"left": (0, 0, 16, 32)}, **SMALL)


@pytest.fixture(scope="module")
def picture(box):
    return box.render(size=SIZE, until=hg.Samples(16), seed=99)


def values_of(result):
    """Of every unit, by what it is."""
    return {(u.mode, u.seed_number, result.budgets[u.budget], u.view): (u.seed, u.values) for u in result.units}


@pytest.fixture(scope="module")
def views(box):
    return [box.camera(), box.camera().orbit(1)]


#: Previews that follow a gaze, as published and as Heliograph makes them; a size that is rendered in no time.
SEEN = {
    name: {"mode": "combined", "picture": "preview", "preview_rate": 20, "foveation": name} | more
    for name, more in (("paper", {"foveation_paper": {"disk": 0.3}}), ("density", {"viewing_distance": 1.5}))
}
SMALLEST = {"size": (24, 24), "samples": 1, "seeds": 1, "reference_samples": 16}


def test_errors_are_those_of_the_pictures(box, picture):
    """Against a reference without a noise of its own: the formulas of compare.proto."""
    told = []
    found = box.compare(
        ["adaptive", "pt"],
        samples=4,
        seeds=1,
        reference=picture.rgb,
        pictures=True,
        worst_pixels=2,
        progress=lambda progress: told.append(progress),
        measures=SMALL["measures"],
    )
    reference = picture.rgb.astype(np.float64)
    assert np.array_equal(found.reference, picture.rgb) and found.references[0].noise == "unspecified"
    for number, mode in enumerate(("adaptive", "pt")):
        difference = found.pictures[mode] - reference
        denominator = reference**2 + 0.01 * reference.mean() ** 2
        for measure, value in (
            ("mse", (difference**2).mean()),
            ("relmse", (difference**2 / denominator).mean()),
            ("bias", difference.mean() / reference.mean()),
        ):
            assert found.errors(measure)[number, 0, 0] == pytest.approx(value, rel=1e-4), (mode, measure)
    unit = found.units[1]
    again = box.render(size=SIZE, until=hg.Samples(4), seed=unit.seed)
    assert unit.mode == "pt" and np.array_equal(again.rgb, found.pictures["pt"])  # the unit's seed renders its picture
    worst = unit.worst[0]
    assert worst.picture == pytest.approx(found.pictures["pt"][worst.y, worst.x]) and worst.share >= unit.worst[1].share
    assert box._client.replay(worst.replay_token).pixel == (worst.x, worst.y)
    assert all(progress.units == 2 and str(progress) for progress in told)


def test_units_points_and_curves(result):
    assert result.complete and result.modes == ("pt", "pt+bdpt") and len(result.units) == result.unit_count == 20
    assert result.budgets.tolist() == [2, 4] and not result.budgets_are_seconds and result.views == 1
    errors = result.errors()
    assert errors.shape == (2, 5, 2) and np.isfinite(errors).all() and (result.seconds() > 0).all()
    assert result.samples().tolist() == [[[2, 4]] * 5] * 2
    curve = result.curve("pt+bdpt", "mse", region="dark half")
    assert np.allclose(curve.mean, result.errors("mse", region="dark half")[1].mean(axis=0))
    assert (curve.low <= curve.mean).all() and (curve.mean <= curve.high).all()
    assert np.allclose(curve.seconds, result.seconds()[1].mean(axis=0)) and curve.samples.tolist() == [2, 4]
    point = next(p for p in result.points if p.mode == "pt" and p.budget == 1)
    assert point.seeds == 5 and point.values["relmse"].known
    assert point.values["relmse"].mean == pytest.approx(errors[0, :, 1].mean())
    assert set(result.regions) == {"dark half", "left"} and result.measures == ("mse", "relmse", "bias")
    speed = [ratio for ratio in result.ratios if ratio.kind == "speed"]
    assert [(ratio.mode, ratio.baseline, ratio.at) for ratio in speed] == [("pt+bdpt", "pt", 2), ("pt+bdpt", "pt", 4)]
    assert result.sentences and result.references[0].noise == "halves" and result.references[0].samples == 64
    assert result.reference.shape == result.pictures["pt"].shape == (32, 32, 3) and len(result.pictures) == 2
    for call, field in (
        (lambda: result.errors("psnr"), "measure"),
        (lambda: result.errors("flicker"), "measure"),
        (lambda: result.errors(region="right"), "region"),
        (lambda: result.curve("pt", view=1), "view"),
        (lambda: result.curve("bdpt"), "mode"),
    ):
        with pytest.raises(hg.InvalidArgument) as told:
            call()
        assert told.value.field == field and told.value.allowed
    with pytest.raises(KeyError, match="no picture of the mode 'bdpt'; there are 'pt', 'pt[+]bdpt'"):
        result.pictures["bdpt"]


def test_a_path_has_views(box):
    views = [box.camera(), box.camera().orbit(5)]
    found = box.compare("combined", views=views, samples=2, seeds=2, pictures=True, size=SIZE, reference_samples=64)
    assert found.errors("relmse").shape == (1, 2, 1, 2) and found.pictures["combined"].shape == (2, 32, 32, 3)
    flicker = found.errors("flicker")
    assert np.isnan(flicker[..., 0]).all() and np.isfinite(flicker[..., 1]).all()
    by_view = [found.curve("combined", view=view).mean[0] for view in (0, 1)]
    assert found.curve("combined").mean[0] == pytest.approx(np.mean(by_view))
    assert not np.array_equal(found.reference[0], found.reference[1])


def test_a_path_of_many_views(box):
    """Requests, units and tables of 600 views fit into messages; more units than a message holds are refused."""
    views = [box.camera().orbit(0.01 * step) for step in range(600)]
    tiny = {"size": (8, 8), "seeds": 1, "measures": "mse", "reference_samples": 2}
    found = box.compare("pt", views=views, samples=1, **tiny)
    assert found.complete and found.views == len(found.units) == 600
    assert found.errors("mse").shape == (1, 1, 1, 600) and np.isfinite(found.errors("mse")).all()
    again = box.compare("pt", views=views, samples=1, resume=found, **tiny)  # sends all units back
    assert again.units == found.units and again.record.calls[-1].units == 0
    many = {f"region {number}": (0, 0, 4, 4) for number in range(16)}
    allowed = "max_message_bytes: 6000 units take [0-9]+ bytes .*allowed: 3584000"
    with pytest.raises(hg.ResourceExhausted, match=allowed):
        box.compare("pt", views=views, samples=range(1, 11), regions=many, **tiny)


def test_modes_are_words_dicts_or_both(box):
    wanted = {
        "a": {"mode": "adaptive", "integrator": "bdpt"},
        "b": "pt",
        "c": {"picture": "display", "max_segments": 2},
    }
    found = box.compare(wanted, samples=1, seeds=1, max_segments=4, reference={"integrator": "bdpt"}, seed=5, **SMALL)
    settings = {mode.name: mode.settings for mode in found.record.request.modes}
    assert [s.max_segments for s in settings.values()] == [4, 4, 2]
    assert (settings["a"].mode, settings["a"].integrator) == (2, 3) and found.record.request.modes[2].picture == 2
    rendered = found.record.request.reference.rendered.settings
    assert (rendered.integrator, rendered.max_segments, found.record.request.first_seed) == (3, 4, 5)
    listed = box.compare(
        ["pt", {"mode": "adaptive", "integrator": "bdpt"}, {"name": "x"}], times=(0.001, 0.002), seeds=1, **SMALL
    )
    assert listed.modes == ("pt", "adaptive-bdpt", "x") and listed.budgets_are_seconds
    assert listed.curve("x").budgets.tolist() == [0.001, 0.002]


def test_resuming_renders_what_is_missing(box, result):
    more = box.compare(
        ["adaptive", "pt"], samples=(1, 4), seeds=6, regions={"left": (0, 0, 16, 32)}, resume=result, **SMALL
    )
    assert more.modes == ("adaptive", "pt", "pt+bdpt") and more.budgets.tolist() == [1, 2, 4] and more.complete
    assert len(more.units) == 3 * 6 * 3 and more.record.calls[-1].units == 54 - 20 and len(more.record.calls) == 2
    before, after = values_of(result), values_of(more)
    assert {key: after[key] for key in before} == before
    assert np.array_equal(more.pictures["pt"], result.pictures["pt"]) and len(result.units) == 20
    keys = [(u.mode, u.seed_number, u.budget) for u in more.units]
    assert keys == sorted(keys, key=lambda key: (more.modes.index(key[0]), *key[1:]))
    nothing = box.compare(
        more.modes, samples=(1, 2, 4), seeds=6, regions={"left": (0, 0, 16, 32)}, resume=more, **SMALL
    )
    assert nothing.record.calls[-1].units == 0 and nothing.points == more.points


def test_resuming_something_else_is_refused(box, result):
    arguments = {"samples": 4, "seeds": 1, "regions": {"left": (0, 0, 16, 32)}, "resume": result} | SMALL
    with pytest.raises(hg.InvalidArgument) as told:
        box.compare(["pt"], max_segments=3, common_seeds=True, **arguments)
    for text in ("mode pt settings.max_segments: 10 -> 3", "common seeds: no -> yes", "allowed: the same, or mix=True"):
        assert text in str(told.value)
    assert told.value.field == "resume" and told.value.comparison is result
    mixed = box.compare(["pt"], common_seeds=True, mix=True, **arguments)
    assert mixed.complete and mixed.notices == ("common seeds: no -> yes",)
    with pytest.raises(hg.InvalidArgument, match="picture size: 32x32 -> 48x48.*budgets in: samples -> seconds"):
        box.compare(["pt"], mix=True, **arguments | {"size": (48, 48), "samples": None, "times": 0.01})


def test_what_came_before_an_interruption_is_kept(box):
    def interrupt(progress):
        if progress.units_done:
            raise KeyboardInterrupt

    arguments = {"seeds": 1, **SMALL}
    with pytest.raises(KeyboardInterrupt) as told:
        box.compare(["pt", "adaptive"], samples=(1, 10**7), progress=interrupt, **arguments)
    part = told.value.comparison
    assert not part.complete and 1 <= len(part.units) < 4 and part.points == [] and part.sentences == ()
    first = part.units[0]
    assert part.errors()[0, 0, 0] == first.values["relmse"] == part.curve(first.mode).mean[0]
    assert np.isnan(part.errors()[0, 0, 1]) and "incomplete: " in part._repr_html_()
    with pytest.raises(hg.DeadlineExceeded, match="not done within 0.2 s") as late:
        box.compare("pt", samples=10**7, resume=part, timeout=0.2, **arguments)
    # Nothing is lost, whether the daemon took the call in that time or not.
    assert len(late.value.comparison.units) == len(part.units) and late.value.comparison.seeds == 1
    with pytest.raises(hg.InvalidArgument) as refused:
        box.compare("pt", seeds=1001, samples=1)
    assert refused.value.comparison is None


def test_references_are_files_arrays_and_images(box, picture, tmp_path):
    path = picture.save(tmp_path / "reference.exr")
    small = {"samples": 1, "seeds": 1, "measures": ("mse",)}
    for reference, noise in ((path, "variance"), (picture, "variance"), (picture.rgb, "unspecified")):
        found = box.compare("pt", reference=reference, **small)
        assert found.references[0].noise == noise and found.record.request.modes[0].settings.width == 32
        assert found.record.reference_files[0].path == (str(path) if reference is path else "")
    pair = box.compare("pt", views=[0, box.camera().orbit(3)], reference=[picture, path], **small)
    assert len(pair.references) == 2
    broken = picture.rgb.copy()
    broken[3, 4, 1] = np.nan
    for reference, text in (
        (broken, r"reference: nan in channel G of pixel \(4, 3\); allowed: finite numbers"),
        (picture.rgb[..., 0], "reference: 32 pictures; allowed: 1, one for each view"),
        ([picture, picture], "reference: 2 pictures; allowed: 1, one for each view"),
        (np.zeros((4, 4, 4)), r"reference: an array of shape \(4, 4, 4\)"),
        (7, "reference: 7; allowed: the path of an EXR file"),
    ):
        with pytest.raises(hg.InvalidArgument, match=text):
            box.compare("pt", reference=reference, **small)
    with pytest.raises(hg.InvalidArgument, match="^reference: 32 x 32 pixels; allowed: 16 x 16, those of the modes$"):
        box.compare("pt", reference=path, size=(16, 16), **small)
    with pytest.raises(hg.InvalidArgument, match="reference_error: 0.1; allowed: none: the reference is given"):
        box.compare("pt", reference=path, reference_error=0.1, **small)
    with pytest.raises(hg.NotFound, match="none.exr: No such file"):
        box.compare("pt", reference=tmp_path / "none.exr", **small)
    (tmp_path / "text.exr").write_text("no picture")
    with pytest.raises(hg.InvalidArgument, match="text.exr: "):
        box.compare("pt", reference=tmp_path / "text.exr", **small)


def test_a_reference_that_was_let_go_is_loaded_again(box, picture, monkeypatch):
    real, tries = operations.load_reference, []

    def load(file):
        tries.append(file)
        answer = yield from real(file)
        return LoadedReference("0" * 64, answer.path, answer.sha256) if len(tries) in lost else answer

    monkeypatch.setattr(operations, "load_reference", load)
    lost = (1, 2)
    found = box.compare("pt", samples=1, seeds=1, reference=picture)
    assert found.complete and len(tries) == 3 and found.references[0].id != "0" * 64
    lost, tries = range(100), []
    with pytest.raises(hg.NotFound, match="^reference: no reference '000.*load it again"):
        box.compare("pt", samples=1, seeds=1, reference=picture)
    assert len(tries) == 3


def test_regions_are_disks_too(box, picture):
    """Errors inside and outside add up to those of the picture, by the pixels that each has."""
    centre = np.mgrid[0:32, 0:32] + 0.5
    near = np.hypot(centre[0] - 16.25, centre[1] - 8) < 6.5
    disks = {"near": hg.Disk(8, 16.25, 6.5), "far": hg.Disk(8, 16.25, 6.5, outside=True), "left": (0, 0, 16, 32)}
    small = {"samples": 4, "seeds": 1, "reference": picture.rgb}
    found = box.compare("pt", pictures=True, regions=disks, **small)
    error = (found.pictures["pt"] - picture.rgb.astype(np.float64)) ** 2
    for name, pixels in (("near", near), ("far", ~near), ("left", centre[1] < 16)):
        assert found.errors("mse", region=name)[0, 0, 0] == pytest.approx(error[pixels].mean(), rel=1e-4), name
    flip = {name: found.errors("flip", region=name)[0, 0, 0] for name in disks}
    share = near.mean()
    assert found.errors("flip")[0, 0, 0] == pytest.approx(share * flip["near"] + (1 - share) * flip["far"], rel=1e-4)
    with pytest.raises(hg.InvalidArgument) as told:
        box.compare("pt", resume=found, regions=disks | {"far": hg.Disk(8, 16.25, 6)}, mix=True, **small)
    shown = "near=disk:8,16.25,6.5 far={} left=0,0,16,32"
    was, now = shown.format("outside:8,16.25,6.5"), shown.format("disk:8,16.25,6")
    assert f"regions: {was} -> {now}; allowed: the same" in str(told.value)
    for region, field, allowed in (
        (hg.Disk("8", 0, 1), "['d'].x", "a number"),
        (hg.Disk(10**400, 0, 1), "['d'].x", "a number that a float can hold"),
        (hg.Disk(0, float("nan"), 1), "['d'].y", "[-1e6, 1e6]"),
        (hg.Disk(0, 1, 0), "['d'].radius", "(0, 1e6]"),
        (hg.Disk(0, 1, 2e6), "['d'].radius", "(0, 1e6]"),
        (hg.Disk(0, 1, 2, outside=1), "['d'].outside", "True or False"),
        (hg.Disk(-1, 16, 1.5), "['d']", "at least one pixel of 32 x 32"),
        (hg.Disk(16, 16, 22, outside=True), "['d']", "at least one pixel of 32 x 32"),
        ((8, 8, 3), "['d']", "a name, and four whole numbers of pixels: x0, y0, x1, y1, or a Disk"),
        ("disk:8,8,3", "['d']", "a name, and four whole numbers of pixels: x0, y0, x1, y1, or a Disk"),
    ):
        with pytest.raises(hg.InvalidArgument) as told:
            box.compare("pt", regions={"d": region}, **small)
        problem = told.value.problems[-1]
        assert (problem.field, problem.allowed) == (f"regions{field}", allowed)
    assert len(told.value.problems) == 1
    # The last centre that is in, or out.
    edge = {"in": hg.Disk(-1, 16.5, 1.51), "out": hg.Disk(16, 16, 21.9, outside=True)}
    assert set(box.compare("pt", regions=edge, measures="mse", **small).regions) == {"dark half", *edge}
    with pytest.raises(hg.InvalidArgument, match="regions: 3; allowed: a dict from names to .*, or to a Disk"):
        box.compare("pt", regions=3, **small)
    with pytest.raises(hg.InvalidArgument, match="a name, and four whole numbers"):
        box.compare("pt", regions={"\udcff": hg.Disk(1, 1, 1)}, **small)


def test_previews_follow_a_gaze(box, views):
    regions = {"fovea": hg.Disk(12, 12, 5), "periphery": hg.Disk(12, 12, 5, outside=True)}
    found = box.compare({"none": "preview"} | SEEN, views=views, regions=regions, **SMALLEST)
    request = found.record.request
    assert (request.gaze.x, request.gaze.y) == (12, 12), "the middle"
    assert request.modes[1].settings.foveation_paper.disk == 0.3 and request.modes[2].settings.viewing_distance == 1.5
    rendered = request.reference.rendered.settings
    assert rendered.foveation == 0 and not rendered.HasField("foveation_paper") and rendered.viewing_distance == 0
    for measure in ("flip", "flip-median", "hdr-flip", "hdr-flip-median", "flicker"):
        for region in regions:
            assert np.isfinite(found.errors(measure, region=region)[:, 0, 0, 1]).all(), (measure, region)
    asked = {"views": views, "regions": regions, "resume": found, **SMALLEST}
    same = box.compare({"paper": SEEN["paper"]}, gaze=(12, 12), **asked)
    assert same.record.calls[-1].units == 0
    with pytest.raises(hg.InvalidArgument) as told:
        box.compare({"paper": SEEN["paper"]}, gaze=[3, 4.5], **asked)
    assert "resume: gaze: 12,12 -> 3,4.5; allowed: the same, or mix=True" in str(told.value)
    mixed = box.compare({"paper": SEEN["paper"]}, gaze=iter((3, 4.5)), mix=True, **asked)
    assert mixed.notices == ("gaze: 12,12 -> 3,4.5",) and mixed.record.request.gaze.y == 4.5
    # Modes without foveation go with any gaze: that of the others stays.
    less = box.compare("preview", **asked)
    assert less.notices == () and less.record.request.gaze == request.gaze and len(less.units) == 8
    unseen = box.compare("preview", **asked | {"resume": None})
    more = box.compare({"paper": SEEN["paper"]}, gaze=(3, 4), **asked | {"resume": unseen})
    assert more.notices == () and more.record.request.gaze.x == 3 and len(more.units) == 4
    for bad in ("ab", (1,), (1, 2, 3), (1, float("nan")), (2e6, 0), (0, 10**400), (True, 1), 7):
        with pytest.raises(hg.InvalidArgument, match=r"^gaze: .*; allowed: \(x, y\) in pixels"):
            box.compare(SEEN, views=views, gaze=bad, **SMALLEST)
    with pytest.raises(hg.InvalidArgument, match=r"^gaze: \(1, 2\); allowed: none, or with a mode that has foveation$"):
        box.compare("preview", views=views, gaze=(1, 2), **SMALLEST)
    with pytest.raises(hg.InvalidArgument) as told:
        box.compare({"a": {"foveation": "papers"}, "b": {"foveation_paper": {"disk": "x"}}}, gaze=(1, 2), samples=1)
    assert [problem.field for problem in told.value.problems] == [
        "modes['a'].foveation",
        "modes['b'].foveation_paper.disk",
    ]


def test_a_reference_has_no_foveation(box):
    """That of a foveated first mode is the one of a mode without: it is not rendered again."""
    small = {"size": (24, 24), "samples": 1, "seeds": 1, "reference_samples": 32}
    box.compare("pt", **small)
    assert box.compare({"seen": {"foveation": "density"}}, gaze=(3, 3), **small).references[0].kept


def test_every_problem_is_told_at_once(client, box):
    with pytest.raises(hg.InvalidArgument) as told:
        box.compare(
            ["x", {"name": "a", "mode": "fast", "region": (0, 0, 1, 1)}, "pt", "pt"],
            samples=(4, 2.5, 2),
            size=(0, 1),
            regions={"left": (1, 2, 3)},
            measures="psnr",
            pictures=1,
            timeout=-1,
            resume=3,
            camera="none",
            reference_error="small",
            max_segmants=3,
        )
    fields = {problem.field for problem in told.value.problems}
    assert fields >= {"modes[0]", "modes['a'].mode", "modes['a'].region", "modes[3].name", "samples[1]", "size"}
    assert fields >= {"regions['left']", "measures", "pictures", "timeout", "resume", "camera", "reference_error"}
    assert "modes['pt'].max_segmants" in fields
    with pytest.raises(hg.InvalidArgument) as told:
        box.compare(["pt", "adaptive"], size=(10**6, 8), seeds=0, samples=1, worst_pixels=65, reference_error=2)
    fields = [problem.field for problem in told.value.problems]
    assert sorted(fields) == ["reference_error", "seeds", "size", "worst_pixels"]
    assert "size: 1000000; allowed: [1, 65536]" in str(told.value)
    with pytest.raises(hg.InvalidArgument) as told:  # the daemon's, by the names of the arguments, each once
        box.compare(["pt", "adaptive"], samples=1, max_segments=10**6)
    fields = [problem.field for problem in told.value.problems]
    assert sorted(set(fields)) == sorted(fields) and {f"modes['{m}'].max_segments" for m in ("pt", "adaptive")} <= set(
        fields
    )
    with pytest.raises(hg.InvalidArgument, match="either samples or times"):
        box.compare("pt", samples=1, times=1)
    with pytest.raises(hg.InvalidArgument, match=r"samples\[1\]: 1 after 2; allowed: rising budgets"):
        box.compare("pt", samples=(2, 1))
    with pytest.raises(hg.PermissionDenied, match="exclusive"):
        box.compare("pt", samples=1, exclusive=True)
    with pytest.raises(hg.InvalidArgument, match="ComparisonProgress"):
        box.compare("pt", samples=1, progress="bar")


def test_ranges_and_paths_are_told_with_the_rest(box):
    def fields_of(*arguments, **more):
        with pytest.raises(hg.InvalidArgument) as told:
            box.compare(*arguments, **more)
        return sorted(problem.field for problem in told.value.problems)

    outside = {"a": (0, 0, 100, 100), "b": (4, 4, 4, 8), "dark half": (0, 0, 1, 1)}
    assert fields_of(
        ["pt", "nosuch", "preview"], seeds=0, samples=(4, 2), measures=["flicker", "mse"], regions=outside, size=SIZE
    ) == [
        "measures",
        "modes['preview'].picture",
        "modes[1]",
        "regions",
        "regions['a']",
        "regions['b']",
        "samples[1]",
        "seeds",
    ]
    broken = np.full((*SIZE, 3), np.nan)
    assert fields_of("pt", seeds=1001, reference=broken, samples=0) == ["reference", "samples[0]", "seeds"]
    assert fields_of("pt", reference="none.exr", times=(0, 1)) == ["reference", "times[0]"]
    assert fields_of(
        [f"{mode}" for mode in ("pt", "adaptive")] * 33,
        samples=range(1, 66),
        views=[0] * 1001,
        reference_samples=3,
        reference_error=0,
    )[-4:] == ["reference_error", "reference_samples", "samples", "views"]
    assert fields_of({"a b": "pt"}, samples=2**31) == ["modes[0].name", "samples[0]"]


def test_words_are_those_of_the_command(box, heliograph, tmp_path):
    """Each word of the command is one here, and stands for the same settings."""
    words = ["pt", "adaptive", "reproject", "combined", "path", "bdpt", "pt+bdpt", "lvc", "vcm", "photon", "light"]
    words += ["paper-adaptive", "paper-reproject", "paper-combined", "display", "preview"]
    small = ["--size", "8x8", "--reference-samples", 2, "--seeds", 1, "--samples", 1]
    heliograph("compare", BOX, "--modes", ",".join(words), "--path", "jump", *small, "--output", tmp_path / "kept")
    theirs = {mode.name: mode for mode in hg.Comparison.load(tmp_path / "kept").record.request.modes}
    views = [box.camera(), box.camera().orbit(1)]
    ours = box.compare(words, views=views, samples=1, seeds=1, size=(8, 8), reference_samples=2).record.request
    assert [mode.name for mode in ours.modes] == words == list(theirs)
    for mode in ours.modes:
        assert mode.settings == theirs[mode.name].settings and mode.picture == theirs[mode.name].picture, mode.name
        assert mode.denoiser == theirs[mode.name].denoiser
    with pytest.raises(hg.InvalidArgument, match="denoiser: OIDN; this daemon was not given the library"):
        box.compare("oidn", samples=1, seeds=1)


def test_folders_keep_a_comparison(result, tmp_path):
    folder = result.save(tmp_path / "kept")
    assert sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.*")) == [
        "comparison.json",
        "pictures/pt+bdpt.view0.exr",
        "pictures/pt.view0.exr",
        "pictures/reference.view0.exr",
        "points.csv",
        "ratios.csv",
        "units.csv",
    ]
    record = json.loads((folder / "comparison.json").read_text())
    assert record["format"] == 1 and len(record["units"]) == 20 and record["units"][0]["seedNumber"] == 1
    for path in (folder, folder / "comparison.json"):
        again = hg.Comparison.load(path)
        assert again.units == result.units and again.points == result.points and again.ratios == result.ratios
        assert np.array_equal(again.pictures["pt"], result.pictures["pt"])
        assert np.array_equal(again.reference, result.reference)
    again.save(folder)  # where it came from
    again.save(tmp_path / "copied")
    assert np.array_equal(hg.Comparison.load(tmp_path / "copied").reference, result.reference)
    with open(folder / "units.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["relmse left"]) for row in rows] == [unit.regions["left"]["relmse"] for unit in result.units]
    assert rows[1]["budget_samples"] == "4" and rows[1]["disturbed"] in "01" and rows[1]["view"] == "0"
    with open(folder / "points.csv", newline="") as file:
        assert len(list(csv.reader(file))) == 1 + 2 * 2 * 9  # modes, budgets, measures of the whole and of two regions


def test_output_is_resumed_and_kept(box, tmp_path):
    folder = tmp_path / "kept"
    asked = {"seeds": 1, "output": folder} | SMALL

    def interrupt(progress):
        if progress.units_done:
            with pytest.raises(hg.FailedPrecondition, match="is in use"):
                other.save(folder)
            raise KeyboardInterrupt

    other = box.compare("pt", samples=1, **SMALL | {"seeds": 1})
    with pytest.raises(KeyboardInterrupt):
        box.compare(["pt", "adaptive"], samples=(1, 10**7), progress=interrupt, **asked)
    before = hg.Comparison.load(folder)
    assert 0 < len(before.units) < 4 and not before.complete and not (folder / "comparison.lock").exists()
    more = box.compare(["pt", "adaptive"], samples=(1, 2), **asked | {"output": tmp_path / "other"})
    assert sorted(path.name for path in (tmp_path / "other" / "pictures").iterdir()) == [
        "adaptive.view0.exr",
        "pt.view0.exr",
        "reference.view0.exr",
    ]
    again = box.compare("pt", samples=(1, 2), **asked | {"output": tmp_path / "other"})
    assert (
        again.record.calls[-1].units == 0 and again.modes == ("pt", "adaptive") and values_of(again) == values_of(more)
    )
    with pytest.raises(hg.InvalidArgument, match="output|resume: .*max_segments"):
        box.compare("pt", samples=(1, 2), max_segments=3, **asked | {"output": tmp_path / "other"})
    with pytest.raises(hg.InvalidArgument) as told:
        box.compare("pt", samples=1, resume=more, **asked | {"seeds": 0, "output": BOX})
    assert sorted(problem.field for problem in told.value.problems) == ["resume", "seeds"]
    with pytest.raises(hg.InvalidArgument, match="output: .*cornell-box.gltf; allowed: a folder"):
        box.compare("pt", samples=1, **asked | {"output": BOX})


def test_missing_pictures_alone_are_rendered_again(box, result, tmp_path):
    folder = result.save(tmp_path / "kept")
    (folder / "pictures" / "pt.view0.exr").unlink()
    loaded = hg.Comparison.load(folder)
    again = {"samples": (2, 4), "pictures": True, "regions": {"left": (0, 0, 16, 32)}, **SMALL}
    more = box.compare(["pt", "pt+bdpt"], resume=loaded, **again)
    assert more.record.calls[-1].units == 0 and values_of(more) == values_of(result)
    assert np.array_equal(more.pictures["pt"], result.pictures["pt"])
    sent = {key.mode for key, stored in more.stored_pictures.items() if isinstance(stored, np.ndarray)}
    assert sent == {"pt"}  # those that were there are still files
    assert len(more.record.request.pictures_done) == 0
    # A picture whose unit is missing is not counted as there: both are to be of the same rendering.
    for number in reversed(range(len(loaded.record.units))):
        unit = loaded.record.units[number]
        if unit.mode == "pt+bdpt" and unit.seed_number == 1:
            del loaded.record.units[number]
    more = box.compare(["pt", "pt+bdpt"], resume=loaded, **again)
    assert more.record.calls[-1].units == 2 and values_of(more) == values_of(result)
    sent = {key.mode for key, stored in more.stored_pictures.items() if isinstance(stored, np.ndarray)}
    assert sent == {"pt", "pt+bdpt"}


def test_the_command_shares_folders(client, box, heliograph, tmp_path):
    """Each goes on where the other ended, renders nothing twice, and writes the same tables."""
    (tmp_path / "token").write_text(client.daemon.token)
    folder = tmp_path / "shared"

    def command(*arguments):
        options = ["--size", "32x32", "--reference-samples", 64, "--measures", "mse,relmse,bias", "--seeds", 2]
        server = ["--server", client.address, "--token-file", tmp_path / "token", "--output", folder]
        return json.loads(heliograph("compare", BOX, *options, *server, "--json", *arguments))

    assert command("--modes", "pt,combined", "--samples", "1,2")["units_rendered"] == 8
    first = hg.Comparison.load(folder)
    first.save(tmp_path / "again")
    for name in ("units.csv", "points.csv", "ratios.csv"):
        assert (folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes(), name
    more = box.compare(["pt", "adaptive"], samples=(1, 4), seeds=2, pictures=True, resume=first, **SMALL)
    assert more.notices == () and len(more.units) == 3 * 2 * 3 and more.record.calls[-1].units == 10
    more.save(folder)
    told = command("--modes", "pt,adaptive,combined", "--samples", "1,2,4")
    assert told["units_rendered"] == 0 and told["units"] == 18 and told["differences"] == []
    assert values_of(hg.Comparison.load(folder)) == values_of(more)


def test_the_command_shares_gazes_and_disks(client, box, heliograph, tmp_path):
    """What one has rendered the other goes on with; what differs is told in the same words."""
    (tmp_path / "token").write_text(client.daemon.token)
    folder = tmp_path / "shared"

    def command(*arguments):
        options = ["--size", "24x24", "--reference-samples", 16, "--seeds", 1, "--samples", 1, "--json"]
        options += ["--region", "fovea=disk:8,8.5,5", "--region", "periphery=outside:8,8.5,5"]
        options += ["--server", client.address, "--token-file", tmp_path / "token", "--output", folder]
        return json.loads(heliograph("compare", BOX, *options, *arguments))

    seen = ["--mode", "seen=pt:foveation=density:viewing-distance=1.5"]
    assert command(*seen, "--gaze", "8,8.5")["units_rendered"] == 1
    ours = {"seen": {"foveation": "density", "viewing_distance": 1.5}}
    asked = SMALLEST | {"pictures": True, "resume": hg.Comparison.load(folder)}
    asked["regions"] = {"fovea": hg.Disk(8, 8.5, 5), "periphery": hg.Disk(8, 8.5, 5, outside=True)}
    same = box.compare(ours, gaze=(8, 8.5), **asked)
    assert same.record.calls[-1].units == 0 and same.notices == ()
    more = box.compare("adaptive", **asked)
    assert more.record.calls[-1].units == 1 and more.record.request.gaze.y == 8.5
    more.save(folder)
    assert command("--modes", "adaptive", *seen, "--gaze", "8,8.5")["units_rendered"] == 0
    assert command("--modes", "pt")["units_rendered"] == 1
    assert hg.Comparison.load(folder).record.request.gaze.y == 8.5
    with pytest.raises(subprocess.CalledProcessError) as refused:
        command(*seen)
    assert "gaze: 8,8.5 -> 12,12" in refused.value.stderr
    with pytest.raises(hg.InvalidArgument, match="gaze: 8,8.5 -> 12,12"):
        box.compare(ours, **asked)


def test_a_folder_in_use_is_refused(result, heliograph, tmp_path):
    """In both directions: of another save(), and of the command."""
    folder = tmp_path / "used"
    with locked(folder):
        holder = (folder / "comparison.lock").read_text()
        assert holder.startswith(f"process {os.getpid()} on ")
        with pytest.raises(hg.FailedPrecondition) as told:
            result.save(folder)
        assert f"'{folder}' is in use: {holder} is writing a comparison into it; allowed: another" in str(told.value)
        with pytest.raises(subprocess.CalledProcessError) as refused:
            heliograph("compare", BOX, "--modes", "pt", "--samples", 1, "--output", folder)
        assert refused.value.returncode == 2 and f"is in use: {holder} is writing" in refused.value.stderr
        assert [path.name for path in folder.iterdir()] == ["comparison.lock"]
    assert not folder.exists()  # nothing was written
    folder.mkdir()
    (folder / "comparison.lock").write_text("process 7 on a machine that went down")  # which nobody locks any more
    result.save(folder)
    assert len(hg.Comparison.load(folder).units) == 20 and not (folder / "comparison.lock").exists()


def test_the_command_keeps_its_folder_from_others(result, request, tmp_path):
    folder = tmp_path / "busy"
    program, size = request.config.getoption("--program"), ["--size", "32x32", "--reference-samples", "64"]
    command = [program, "compare", str(BOX), "--modes", "pt", "--samples", str(2**30), *size, "--output", str(folder)]
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        eventually(lambda: (folder / "comparison.json").exists())
        with pytest.raises(hg.FailedPrecondition, match=f"in use: process {running.pid} on .* is writing"):
            result.save(folder)
    finally:
        running.send_signal(signal.SIGINT)
        running.communicate(timeout=60)
    before = hg.Comparison.load(folder)
    assert before.modes == ("pt",)
    result.save(folder)
    assert hg.Comparison.load(folder).modes == result.modes


@pytest.mark.parametrize(
    "text, told",
    [
        ("{", "is no record of a comparison"),
        ("{}", "it names no format"),
        ('{"format": 2}', "is of format 2; this version reads up to 1"),
        ('{"format": 1, "units": [{"mode": "pt"}]}', "units/0/mode: 'pt' is no mode of the request"),
        ('{"format": 1, "pictures": [{"file": "../a.exr"}]}', "allowed: a path within the folder"),
        ("\udcff", "is no record of a comparison"),
    ],
)
def test_broken_records_are_refused(tmp_path, text, told):
    (tmp_path / "comparison.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(hg.InvalidArgument, match="comparison.json: .*" + told):
        hg.Comparison.load(tmp_path)


def test_missing_files_are_told(result, tmp_path):
    with pytest.raises(hg.NotFound, match="comparison.json: No such file"):
        hg.Comparison.load(tmp_path)
    loaded = hg.Comparison.load(result.save(tmp_path))
    (tmp_path / "pictures" / "pt.view0.exr").unlink()
    with pytest.raises(hg.NotFound, match="pt.view0.exr: No such file"):
        loaded.pictures["pt"]
    # Keys of a later version are passed over.
    record = json.loads((tmp_path / "comparison.json").read_text())
    (tmp_path / "comparison.json").write_text(json.dumps(record | {"later": 1}))
    assert hg.Comparison.load(tmp_path).units == result.units


def test_notebooks_show_a_table(result):
    page = result._repr_html_()
    assert page.count("<tr>") == 3 and "<td>pt+bdpt</td>" in page and "time, equal samples / pt" in page
    value = next(p for p in result.points if p.mode == "pt" and p.budget == 1).values["relmse"]
    assert f"<td>{value.mean:.3g} [{value.low:.3g}, {value.high:.3g}]</td>" in page
    assert "20 of 20 units" in repr(result)
    record = type(result.record)()
    record.CopyFrom(result.record)
    record.scene_name = "<b>"
    assert "<caption>&lt;b&gt;" in hg.Comparison(record)._repr_html_()


def test_frames_need_pandas(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    for method in (result.units_frame, result.to_pandas, result.ratios_frame):
        with pytest.raises(hg.MissingPackage, match="needs the package pandas, which is not installed"):
            method()


def test_frames_of_pandas(result):
    pytest.importorskip("pandas")
    units = result.units_frame()
    assert units["relmse"].tolist() == [unit.values["relmse"] for unit in result.units]
    points = result.to_pandas()
    means = points[(points["measure"] == "relmse") & (points["region"] == "") & (points["mode"] == "pt")]["mean"]
    assert np.allclose(means, result.curve("pt").mean)
    assert set(result.ratios_frame()["verdict"]) <= {"better", "worse", "undecided"}


def test_without_a_client(client, box, program, monkeypatch):
    arguments = {"samples": 1, "seeds": 1} | SMALL
    found = hg.compare(BOX, "pt", address=client.address, token=client.daemon.token, **arguments)
    assert found.record.scene_file == str(BOX) and found.record.request.scene_id == box.id
    assert values_of(hg.compare(box, "pt", **arguments)) == values_of(found)
    with pytest.raises(hg.InvalidArgument, match="none beside a Scene"):
        hg.compare(box, "pt", address=client.address)
    monkeypatch.setenv("HELIOGRAPH_DAEMON", "/no/such/daemon")
    for call in (hg.compare, lambda *words, **more: asyncio.run(ahg.compare(*words, **more))):
        with pytest.raises(hg.InvalidArgument) as told:  # before a daemon is started
            call("none.gltf", iter(["pt", "zz"]), seeds=0, reference="none.exr", samples=iter((4, 2)))
        fields = [problem.field for problem in told.value.problems]
        assert sorted(fields) == ["modes[1]", "reference", "samples[1]", "scene", "seeds"]
        with pytest.raises(hg.NotFound, match="^none.gltf: no such file"):
            call("none.gltf", ["pt"])
    monkeypatch.setenv("HELIOGRAPH_DAEMON", program)
    alone = hg.compare(ROOT / "scenes" / "cornell-box" / "cornell-box.gltf", "pt", exclusive=True, **arguments)
    assert values_of(alone) == values_of(found)


def test_asyncio_has_it_too(client, box):
    arguments = {"samples": (1, 2), "seeds": 2} | SMALL

    async def main():
        async with await ahg.connect(client.address, token=client.daemon.token) as other:
            scene = await other.load(BOX)
            found = await scene.compare(["pt", "adaptive"], **arguments)
            with pytest.raises(ahg.InvalidArgument, match="seeds: 0"):
                await scene.compare("pt", seeds=0)
            begun = asyncio.Event()
            task = asyncio.create_task(
                scene.compare("pt", samples=10**7, seeds=1, size=SIZE, progress=lambda progress: begun.set())
            )
            await asyncio.wait_for(begun.wait(), 60)
            task.cancel()
            with pytest.raises(asyncio.CancelledError) as cancelled:
                await task
            assert cancelled.value.comparison.modes == ("pt",) and not cancelled.value.comparison.complete
            one = await ahg.compare(BOX, "pt", address=client.address, token=client.daemon.token, **arguments)
            return found, one

    found, one = asyncio.run(main())
    expected = values_of(box.compare(["pt", "adaptive"], **arguments))
    assert values_of(found) == expected
    assert values_of(one) == {key: value for key, value in expected.items() if key[0] == "pt"}
