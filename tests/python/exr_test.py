"""The codec of tiles and files: views without copies, broken bytes, checks of an assembly."""

import struct
import zlib

import numpy as np
import pytest

import heliograph as hg
from heliograph import exr, tiles
from heliograph.v1 import types_pb2 as types

WINDOW = exr.Window(3, 5, 40, 38)
FRAME = (64, 48)


def planes(seed=1):
    random = np.random.default_rng(seed)
    shape = (WINDOW.height, WINDOW.width)
    return {
        "R": random.random(shape, np.float32),
        "G": np.zeros(shape, np.float32),
        "B": np.full(shape, np.inf, np.float32),
        "samples": random.integers(0, 2049, shape).astype(np.float16),
    }


def test_uncompressed_rows_are_views_of_the_bytes():
    data = exr.encode(planes(), WINDOW, FRAME, compression="none")
    header, found = exr.decode(data, 10**6)
    assert header.window == WINDOW and header.frame == FRAME
    everything = np.frombuffer(data, np.uint8)
    for name, plane in planes().items():
        assert np.array_equal(found[name], plane) and found[name].dtype == plane.dtype
        assert np.shares_memory(found[name], everything) and not found[name].flags.writeable


@pytest.mark.parametrize("comments", ["", "light that is missing\nthe second line: \u00e4"])
def test_zip_comes_back(comments):
    data = exr.encode(planes(), WINDOW, FRAME, comments=comments)
    header, found = exr.decode(data, 10**6)
    assert header.comments == comments and len(data) < len(exr.encode(planes(), WINDOW, FRAME, compression="none"))
    for name, plane in planes().items():
        assert np.array_equal(found[name], plane)


def test_predictor_of_known_bytes():
    """Bytes 1 2 3 4 5: evens 1 3 5, then odds 2 4; differences plus 128."""
    assert exr._predict(np.array([1, 2, 3, 4, 5], np.uint8)).tolist() == [1, 130, 130, 125, 130]
    out = np.empty(5, np.uint8)
    exr._unpredict(bytes([1, 130, 130, 125, 130]), out)
    assert out.tolist() == [1, 2, 3, 4, 5]


@pytest.mark.parametrize("compression", ["none", "zip"])
def test_no_cut_and_no_flipped_byte_does_more_than_refuse(compression):
    """Every prefix, and every byte of the header and of the first chunk's head, changed."""
    data = exr.encode(planes(), WINDOW, FRAME, compression=compression)
    head = exr.read_header(data).bytes + 8 * WINDOW.height + 40
    tried = 0
    for length in [*range(0, head, 3), len(data) - 1]:
        exr._last = None
        with pytest.raises(hg.InvalidArgument, match="^EXR: "):
            exr.decode(data[:length], 10**6)
        tried += 1
    for at in range(min(head, len(data))):
        for value in (0, 0xFF, data[at] ^ 0x80):
            changed = data[:at] + bytes([value]) + data[at + 1 :]
            exr._last = None
            try:
                exr.decode(changed, 10**6)
            except (hg.InvalidArgument, hg.Unimplemented):
                tried += 1
    assert tried > 500


@pytest.mark.parametrize(
    "flag, name", [(0x200, "tiled"), (0x800, "deep"), (0x1000, "several parts"), (0x10000, "flags")]
)
def test_other_kinds_of_files_are_named(flag, name):
    data = exr.encode(planes(), WINDOW, FRAME)
    exr._last = None
    with pytest.raises(hg.InvalidArgument, match=name):
        exr.decode(data[:4] + struct.pack("<I", 2 | flag) + data[8:], 10**6)


def test_size_is_checked_before_memory_is_taken():
    data = exr.encode(planes(), WINDOW, FRAME)
    with pytest.raises(hg.InvalidArgument, match="more than 100 pixels"):
        exr.decode(data, 100)
    at = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    huge = data[:at] + struct.pack("<iiii", 0, 0, 2**30, 2**30) + data[at + 16 :]
    with pytest.raises(hg.InvalidArgument, match="more than"):
        exr.decode(huge, 1 << 31)
    bomb = zlib.compress(bytes(10**7))
    start = struct.unpack_from("<Q", data, exr.read_header(data).bytes)[0]
    broken = data[:start] + struct.pack("<ii", WINDOW.y0, len(bomb)) + bomb + data[start + 8 + len(bomb) :]
    with pytest.raises(hg.InvalidArgument, match="bytes where|cannot be decompressed|cut off"):
        exr.decode(broken, 10**6)


def test_what_cannot_be_written():
    for wrong in ({}, {"": planes()["R"]}, {"R": np.zeros((2, 2))}):
        with pytest.raises(hg.InvalidArgument, match="^EXR: "):
            exr.encode(wrong, WINDOW, FRAME)
    with pytest.raises(hg.InvalidArgument, match="'none', 'zip'"):
        exr.encode(planes(), WINDOW, FRAME, compression="piz")


# ---- an assembly of tiles


def tile(x0, y0, x1, y1, number=0, value=1.0, frame=(32, 16), revision=1, names=("R", "G", "B"), **fields):
    window = exr.Window(x0, y0, x1, y1)
    data = exr.encode(
        {name: np.full((y1 - y0, x1 - x0), value, np.float32) for name in names}, window, frame, compression="none"
    )
    made = types.Tile(
        tag=types.FrameTag(revision=revision),
        window=types.Rect(x0=x0, y0=y0, x1=x1, y1=y1),
        exr=data,
        crc32=zlib.crc32(data),
        samples_per_pixel=number + 1,
    )
    setattr(made, "pass", number)
    for name, given in fields.items():
        setattr(made, name, given)
    return made


def assembly(revision=1, **settings):
    return tiles.Assembly(types.RenderSettings(width=32, height=16, **settings), revision)


def test_rounds_are_told_once_each_and_whole():
    picture = assembly()
    assert not picture.add(tile(0, 0, 16, 16)) and not picture.complete
    assert picture.add(tile(16, 0, 32, 16)) and picture.complete and picture.samples == 1
    assert not picture.add(tile(0, 0, 16, 16, number=1, value=2))
    assert not picture.add(tile(0, 0, 16, 16, number=3, value=4, final=True))  # 2 was dropped on the way
    assert not picture.final
    assert picture.add(tile(16, 0, 32, 16, number=3, value=4, final=True))
    assert picture.final and picture.samples == 4
    assert not picture.add(tile(0, 0, 16, 16, number=2, value=9))  # an older pass is ignored
    found = picture.snapshot().planes()
    assert list(found) == ["R", "G", "B"] and (found["G"] == 4).all() and found["G"].shape == (16, 32)


def test_a_snapshot_stays_as_it_was():
    picture = assembly()
    picture.add(tile(0, 0, 16, 16, value=1))
    before = picture.snapshot()
    picture.add(tile(0, 0, 16, 16, number=1, value=2))
    assert before.planes()["R"][0, 0] == 1 and before.planes()["R"][0, 31] == 0  # not covered yet
    assert picture.snapshot().planes()["R"][0, 0] == 2


def test_bad_tiles_never_reach_the_picture():
    broken = tile(16, 0, 32, 16)
    broken.crc32 ^= 1
    for bad, text in [
        (broken, "checksum"),
        (tile(16, 0, 48, 16, frame=(64, 16)), "lies outside the region"),
        (tile(8, 0, 24, 16), "overlaps another"),
        (tile(16, 0, 32, 16, revision=2), "has not begun"),
        (tile(16, 0, 32, 16, preview=True), "preview"),
        (tile(16, 0, 32, 16, exr=b""), "no EXR"),
    ]:
        picture = assembly()
        picture.add(tile(0, 0, 16, 16))
        with pytest.raises(hg.BrokenTile, match=text):
            picture.add(bad)
        assert not picture.complete and picture.add(tile(16, 0, 32, 16))
    for bad, text in [
        (tile(16, 0, 32, 16, frame=(99, 16)), "99x16 film"),
        (tile(16, 0, 32, 16, names=("R",)), "other channels"),
        (tile(16, 0, 32, 16, exr=b"junk", crc32=zlib.crc32(b"junk")), "not an EXR file"),
    ]:
        picture = assembly()
        picture.add(tile(0, 0, 16, 16))
        picture.add(bad)
        with pytest.raises(hg.BrokenTile, match=text):
            picture.snapshot().planes()
    picture = assembly()
    assert not picture.add(tile(0, 0, 16, 16, revision=0)) and not picture.snapshot().files  # older: ignored


@pytest.mark.parametrize(
    "settings", [{"region": types.Rect(x0=0, y0=0, x1=33, y1=16)}, {"region": types.Rect(x0=5, y0=5, x1=5, y1=6)}]
)
def test_impossible_films_are_refused(settings):
    with pytest.raises(hg.BrokenTile, match="announced"):
        assembly(**settings)
    with pytest.raises(hg.BrokenTile, match="announced"):
        tiles.Assembly(types.RenderSettings(width=2**31 - 1, height=2**31 - 1))


# ---- answers as they come


def test_pixels_of_an_answer_are_not_copied():
    from heliograph import wire
    from heliograph.v1 import frame_stream_pb2 as stream
    from heliograph.v1 import job_pb2 as jobs

    made = tile(0, 0, 16, 16, number=3, final=True, invalid_samples=2**40)
    bare = types.Tile()
    bare.CopyFrom(made)
    bare.ClearField("exr")
    for message in (stream.StreamResponse, jobs.RunJobResponse):
        data = message(tile=made).SerializeToString()
        answer = wire.reader(message)(data)
        assert answer.WhichOneof("response") == "tile" and answer.HasField("tile") and not answer.HasField("progress")
        assert answer.tile == bare and wire.exr_of(answer) == made.exr and answer.exr.obj is data
        picture = assembly()
        picture.add(answer.tile, answer.exr)
        planes = picture.snapshot().planes()
        assert (planes["R"][:, :16] == 1).all()


def test_answers_of_other_forms_are_parsed_as_they_are():
    """Other messages, a tile without pixels or with fields that are not known, and bytes that are no message."""
    from google.protobuf.message import DecodeError

    from heliograph import wire
    from heliograph.v1 import frame_stream_pb2 as stream

    read = wire.reader(stream.StreamResponse)
    whole = stream.StreamResponse(tile=tile(0, 0, 16, 16))
    progress = stream.StreamResponse(progress=types.Progress(seconds=1))
    assert read(progress.SerializeToString()) == progress and read(b"") == stream.StreamResponse()
    assert read(stream.StreamResponse(tile=types.Tile()).SerializeToString()).tile == types.Tile()
    data = whole.SerializeToString()
    assert read(data + progress.SerializeToString()).WhichOneof("response") == "progress"  # the last counts
    unknown = b"\xf8\x3f\x05" + whole.tile.SerializeToString()  # field 1023
    size = len(unknown)
    framed = b"\x1a" + bytes([size & 0x7F | 0x80, size >> 7]) + unknown
    assert wire.exr_of(read(framed)) == whole.tile.exr
    for length in range(1, len(data), 7):
        with pytest.raises(DecodeError):
            read(data[:length])
