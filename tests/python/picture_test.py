"""Stills: the same bits as the command's, files, pictures for the eye."""

import json
import os
import struct
import threading
import zlib

import numpy as np
import pytest
from conftest import BOX

import heliograph as hg
from heliograph import display

SIZE = (96, 64)


@pytest.fixture(scope="module")
def image(box):
    return box.render(size=SIZE, until=hg.Samples(16), seed=7, channels=hg.CHANNELS)


@pytest.fixture(scope="module")
def reference(heliograph, tmp_path_factory):
    """Files of `heliograph render` of the same picture."""
    folder = tmp_path_factory.mktemp("reference")
    told = json.loads(
        heliograph(
            "render",
            BOX,
            "--size",
            "96x64",
            "--samples",
            16,
            "--seed",
            7,
            "-o",
            folder / "box.exr",
            "--png",
            folder / "box.png",
            "--json",
            "--layers",
            "alpha,depth,normal,albedo,history,density,display",
        )
    )
    return folder, told


def read_png(data):
    """H x W x 3 bytes of a PNG without interlace, and its texts."""
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    at, packed, texts = 8, b"", {}
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack_from(">I", data, at + 8 + length)[0]
        if kind == b"IHDR":
            width, height, bits, color = struct.unpack_from(">IIBB", body)
            assert (bits, color) == (8, 2)
        elif kind == b"IDAT":
            packed += body
        elif kind == b"tEXt":
            key, value = body.split(b"\0", 1)
            texts[key.decode()] = value.decode("latin-1")
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 3 * width)
    out = np.zeros((height, width, 3), np.int32)
    for y in range(height):
        above = out[y - 1] if y else np.zeros((width, 3), np.int32)
        line = rows[y, 1:].reshape(width, 3).astype(np.int32)
        left = np.zeros(3, np.int32)
        upper_left = np.zeros(3, np.int32)
        for x in range(width):
            up = above[x]
            if rows[y, 0] == 4:
                p = left + up - upper_left
                a, b, c = abs(p - left), abs(p - up), abs(p - upper_left)
                guess = np.where((a <= b) & (a <= c), left, np.where(b <= c, up, upper_left))
            else:
                guess = [0, left, up, (left + up) // 2][rows[y, 0]]
            left = out[y, x] = (line[x] + guess) & 255
            upper_left = up
    return out.astype(np.uint8), texts


def test_has_the_bits_of_the_command(image, reference):
    expected = hg.Image.load(reference[0] / "box.exr")
    assert set(image) == set(expected) and len(image) == 23
    for name in expected:
        assert np.array_equal(image[name], expected[name]), name
    assert image.stats.samples == reference[1]["samples"] and image.stats.ended_by == "samples"
    assert image.stats.error == pytest.approx(reference[1]["estimated_rmse"], rel=1e-12)


def test_sigma_is_the_root_of_the_files_variance(image, reference):
    expected = hg.Image.load(reference[0] / "box.exr")
    for index, color in enumerate("RGB"):
        assert np.array_equal(image.sigma[..., index], np.sqrt(expected[f"variance.{color}"]))
    # The error of the picture is the root of the mean of its pixels' variances, apart from what has not been found yet.
    assert np.sqrt(image.variance.mean()) == pytest.approx(image.stats.error, rel=0.02)


def test_arrays_have_shapes_and_types(image):
    assert image.shape == (64, 96) and image.size == SIZE
    for array in (image.rgb, image.sigma, image.variance, image.display, image.normal, image.albedo):
        assert array.shape == (64, 96, 3) and array.dtype == np.float32
    for array in (image.samples, image.alpha, image.depth, image.display_error, image["history.age"]):
        assert array.shape == (64, 96) and array.dtype == np.float32
    assert np.shares_memory(image.rgb, image["R"])  # a view, not a copy
    assert (image.samples == 16).all() and image.seed == 7
    lengths = np.linalg.norm(image.normal[image.alpha == 1], axis=-1)
    assert (lengths <= 1 + 1e-4).all() and np.median(lengths) > 0.99
    assert np.array_equal(np.asarray(image), image.rgb)


def test_png_is_that_of_the_command(image, reference, tmp_path):
    """Both bytes and text."""
    expected, texts = read_png((reference[0] / "box.png").read_bytes())
    found, own_texts = read_png(image.save(tmp_path / "own.png").read_bytes())
    assert texts["Description"] == own_texts["Description"] == "Layer display"
    # 1.055 x^(1/2.4) in floats may differ in its last bit.
    assert np.abs(found.astype(int) - expected).max() <= 1 and (found != expected).mean() < 1e-3
    assert image._repr_png_().startswith(b"\x89PNG")
    raw = image.to_srgb(exposure=0, layer="radiance")
    assert not np.array_equal(raw, found) and raw[image.rgb.max(axis=-1) >= 1].max(axis=-1).min() == 255


def test_srgb_of_known_values():
    """IEC 61966-2-1: 12.92 x below 0.0031308; 0.5 becomes 0.7354, 188 of 255."""
    values = np.array([[[0, 0.0031308, 0.5], [1, 2, -1], [np.nan, np.inf, 0.18]]], np.float32)
    assert display.srgb_bytes(values, 1).tolist() == [[[0, 10, 188], [255, 255, 0], [0, 255, 118]]]
    # 1.055 x 0.0062616^(1/2.4) - 0.055 = 0.0724, 18.5 of 255
    assert display.srgb_bytes(values, 2).tolist()[0][0] == [0, 18, 255]


def test_auto_exposure_brings_the_geometric_mean_to_middle_grey():
    grey = np.full((4, 4, 3), 3.0)
    assert display.auto_exposure(grey) == pytest.approx(0.06)
    grey[:2] = 0  # black pixels do not count
    assert display.auto_exposure(grey) == pytest.approx(0.06)
    assert display.auto_exposure(np.zeros((2, 2, 3))) == 1


@pytest.mark.parametrize("compression", ["zip", "none"])
def test_exr_comes_back(image, tmp_path, compression):
    path = image.save(tmp_path / "a.exr", compression=compression)
    again = hg.Image.load(path)
    assert set(again) == set(image) and again.window == image.window and again.frame == image.frame
    for name in image:
        assert np.array_equal(again[name], image[name], equal_nan=True), name
    assert list(tmp_path.iterdir()) == [path]  # no temporary file is left
    assert again.seed == image.seed == 7 and again.unsampled == image.unsampled and again.notices == image.notices
    kept = (image.stats.samples, image.stats.error, image.stats.ended_by)
    assert (again.stats.samples, again.stats.error, again.stats.ended_by) == kept and kept[0] == 16


def test_large_pictures_are_worked_on_in_bands(tmp_path):
    """More than one band of everything, whose threads end."""
    random = np.random.default_rng(1)
    planes = {name: random.normal(0.3, 0.4, (240, 400)).astype(np.float32) for name in "RGB"}
    planes["Z"] = np.linspace(0, 9, 96000).reshape(240, 400).astype(np.float16)
    picture = hg.Image(planes, seed=2**64 - 1, notices=["one", "two \u00e9"])
    again = hg.Image.load(picture.save(tmp_path / "a.exr"))
    assert all(np.array_equal(again[name], picture[name]) for name in picture)
    assert again.seed == 2**64 - 1 and again.notices == ("one", "two \u00e9") and again.stats.error is None
    pixels, _ = read_png(picture.to_png(exposure=0.5))
    assert np.array_equal(pixels, picture.to_srgb(exposure=0.5))
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("heliograph-bands")]


def test_the_table_gives_the_levels_of_the_formula():
    """At and beside every number where a level begins, and for what no number is."""
    begins = display._levels()[1]
    begins = begins[np.isfinite(begins)]
    values = np.concatenate([begins, np.nextafter(begins, 0), np.nextafter(begins, 2), np.linspace(0, 1.5, 10001)])
    values = np.append(values, [-0.0, 5e-324, 3e38]).astype(np.float32)
    assert len(np.unique(begins)) == 255
    assert np.array_equal(display.srgb_bytes(values, 1), display._encode(np.clip(values, 0, 1)))
    odd = np.array([np.nan, np.inf, -np.inf, -1, -1e-30], np.float32)
    assert display.srgb_bytes(odd, 1).tolist() == [0, 255, 0, 0, 0]


def test_other_programs_read_our_exr(image, tmp_path):
    import shutil
    import subprocess

    if not shutil.which("exrheader"):
        assert not os.environ.get("CI"), "openexr is not installed"
        pytest.skip("openexr is not installed")
    told = subprocess.run(
        ["exrheader", image.save(tmp_path / "a.exr")], check=True, capture_output=True, text=True
    ).stdout
    assert "dataWindow (type box2i): (0 0) - (95 63)" in told and "zip" in told
    assert "variance.B, 32-bit floating-point" in told


def test_region_keeps_its_place(box, image, tmp_path):
    part = box.render(size=SIZE, until=hg.Samples(16), seed=7, region=(10, 20, 60, 50))
    assert part.window == (10, 20, 60, 50) and part.frame == SIZE and part.shape == (30, 50)
    assert np.array_equal(part.rgb, image.rgb[20:50, 10:60])
    again = hg.Image.load(part.save(tmp_path / "part.exr"))
    assert again.window == part.window and again.frame == SIZE and np.array_equal(again.rgb, part.rgb)


@pytest.mark.parametrize("compression", ["none", "zip", "zips"])
@pytest.mark.parametrize("pixel_type", ["float", "half"])
def test_tiles_of_each_kind_give_the_same_picture(box, image, compression, pixel_type):
    """Half has 11 significant bits: a relative error of at most 2^-11."""
    other = box.render(size=SIZE, until=hg.Samples(16), seed=7, compression=compression, pixel_type=pixel_type)
    if pixel_type == "float":
        assert np.array_equal(other.rgb, image.rgb) and np.array_equal(other.variance, image.variance)
    else:
        assert not np.array_equal(other.rgb, image.rgb)
        assert (np.abs(other.rgb - image.rgb) <= 2.0**-11 * image.rgb + 6e-8).all()


def test_other_compressions_need_the_library(box, image):
    try:
        import OpenEXR

        assert OpenEXR.File
    except (ImportError, AttributeError):
        with pytest.raises(hg.BrokenTile, match=r"PIZ needs the package OpenEXR.*heliograph\[exr\]"):
            box.render(size=SIZE, until=hg.Samples(1), compression="piz")
        return
    assert np.array_equal(box.render(size=SIZE, until=hg.Samples(16), seed=7, compression="piz").rgb, image.rgb)


def test_z_of_two_seeds_is_normal(box):
    """(a - b) / sqrt(var a + var b) of independent pictures has mean 0 and, where the noise is near normal, variance
    1."""
    a, b = (box.render(size=(64, 64), until=hg.Samples(256), seed=seed) for seed in (1, 2))
    z = a.z(b)
    assert z.shape == (64, 64, 3) and abs(z.mean()) < 0.05 and 0.7 < z.std() < 1.3
    assert (a.z(a) == 0).all()
    with pytest.raises(hg.InvalidArgument, match="window"):
        a.z(box.render(size=(32, 64), until=hg.Samples(1)))


def test_budgets_end_pictures(box):
    by_error = box.render(size=SIZE, until=[hg.Error(0.05), hg.Samples(4096)])
    assert by_error.stats.ended_by == "error" and by_error.stats.error <= 0.05
    by_time = box.render(size=SIZE, until=(hg.Seconds(0.3), hg.Samples(10**6)))
    assert by_time.stats.ended_by == "time" and 0.25 < by_time.stats.seconds < 3


def test_size_defaults_to_what_the_command_takes(box):
    """The box's camera has aspect 1."""
    assert box.render(until=hg.Samples(1), region=(0, 0, 8, 8)).frame == (720, 720)
    assert box.render(until=hg.Samples(1), region=(0, 0, 8, 8), camera=box.camera().orbit(5)).frame == (720, 720)


def test_missing_channels_and_names_are_told(box, tmp_path):
    plain = box.render(size=(8, 8), until=hg.Samples(1))
    with pytest.raises(hg.NotFound, match="no channel 'Z'; ask for it by channels='depth'; it has R, G, B"):
        plain.depth
    with pytest.raises(hg.MissingChannel, match="channels='display'"):
        plain.display
    assert not hasattr(plain, "depth") and hasattr(plain, "sigma") and "Z" not in plain
    with pytest.raises(hg.InvalidArgument, match=r"a name that ends in \.exr or \.png"):
        plain.save(tmp_path / "a.jpg")
    with pytest.raises(hg.InvalidArgument, match="do not go with"):
        plain.save(tmp_path / "a.exr", exposure=1)
    with pytest.raises(hg.InvalidArgument, match="stops"):
        plain.to_srgb(exposure=65)
    with pytest.raises(hg.InvalidArgument, match="'display', 'radiance'"):
        plain.to_png(layer="depth")
    with pytest.raises(KeyError):
        plain["nope"]
    with pytest.raises(FileNotFoundError) as told:
        plain.save(tmp_path / "no" / "folder.exr")
    assert told.value.filename == str(tmp_path / "no" / "folder.exr")
    with pytest.raises(hg.NotFound, match="no such file"):
        hg.Image.load(tmp_path / "none.exr")
    assert repr(plain) == "<heliograph.Image 8x8, 1 samples, ended by samples>" or "error" in repr(plain)


def test_progress_tells_and_ends(box):
    told = []
    box.render(size=(256, 256), until=hg.Seconds(1.2), progress=told.append)
    assert told and all(0 <= stats.budget_used <= 1 for stats in told)
    assert [stats.samples for stats in told] == sorted(stats.samples for stats in told)
    box.render(size=(8, 8), until=hg.Samples(1), progress=True)  # with tqdm or without
    with pytest.raises(hg.InvalidArgument, match="progress"):
        box.render(size=(8, 8), until=hg.Samples(1), progress=3)
