"""Answers of streams as they come from gRPC: the pixels of a tile stay where they are in the bytes that came.

A parsed message would hold a copy of the EXR file, and its field `exr` give another one: at 1280x720 pixels of floats twice
26 MB for each picture.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .v1 import frame_stream_pb2 as stream
from .v1 import job_pb2 as jobs
from .v1 import types_pb2 as types

_EXR = types.Tile.DESCRIPTOR.fields_by_name["exr"].number
_SERVICE = "/heliograph.v1.RenderService/"


class TileAnswer:
    """A StreamResponse or RunJobResponse with a tile: `tile` is without its `exr`, which is a view of what came."""

    __slots__ = ("exr", "tile")

    def __init__(self, tile: types.Tile, exr: memoryview) -> None:
        self.tile = tile
        self.exr = exr

    def WhichOneof(self, _group: str) -> str:
        return "tile"

    def HasField(self, name: str) -> bool:
        return name == "tile"


def exr_of(response: Any) -> memoryview | bytes:
    """The EXR file of an answer with a tile."""
    data: memoryview | bytes = response.exr if isinstance(response, TileAnswer) else response.tile.exr
    return data


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Value and place behind it. IndexError, ValueError: cut off, or longer than ten bytes."""
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
        if shift > 63:
            raise ValueError


def _split(data: bytes, key: int) -> TileAnswer | None:
    """None: it has no tile, or is written in another way than expected."""
    if not data or data[0] != key:
        return None
    length, start = _varint(data, 1)
    end = start + length
    if end != len(data):
        return None
    exr: tuple[int, int, int] | None = None  # where the field, its bytes and what is behind them begin
    at = start
    while at < end:
        field = at
        tag, at = _varint(data, at)
        if tag & 7 == 0:
            _, at = _varint(data, at)
        elif tag & 7 == 2:
            size, at = _varint(data, at)
            if tag >> 3 == _EXR:
                if exr is not None:
                    return None
                exr = (field, at, at + size)
            at += size
        elif tag & 7 in (1, 5):
            at += 8 if tag & 7 == 1 else 4
        else:
            return None
    if at != end or exr is None:
        return None
    return TileAnswer(
        types.Tile.FromString(data[start : exr[0]] + data[exr[2] : end]), memoryview(data)[exr[1] : exr[2]]
    )


def reader(message: Any) -> Callable[[bytes], Any]:
    """What gRPC calls with the bytes of each answer: a TileAnswer, or the message where it has no tile."""
    key = message.DESCRIPTOR.fields_by_name["tile"].number << 3 | 2

    def read(data: bytes) -> Any:
        try:
            answer = _split(data, key)
        except (IndexError, ValueError):
            answer = None
        return message.FromString(data) if answer is None else answer

    return read


def add_streams(stub: Any, channel: Any) -> None:
    """Has the stub's two calls with tiles answer by reader(). The channel is gRPC's, blocking or asynchronous."""
    stub.RunJob = channel.unary_stream(
        _SERVICE + "RunJob", jobs.RunJobRequest.SerializeToString, reader(jobs.RunJobResponse)
    )
    stub.StreamFrames = channel.stream_stream(
        _SERVICE + "StreamFrames", stream.StreamRequest.SerializeToString, reader(stream.StreamResponse)
    )
