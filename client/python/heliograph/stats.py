"""Figures of a picture, as the daemon tells them."""

from __future__ import annotations

import dataclasses

from .settings import enum_name
from .v1 import types_pb2 as types


@dataclasses.dataclass(frozen=True)
class Stats:
    """How a picture came about. Errors are in radiance units; times in seconds."""

    ended_by: str = ""  # "samples", "time", "error", "superseded", "cancelled", "failed"; empty: goes on
    samples: int = 0  # fresh ones per pixel; where counts differ, their mean
    seconds: float = 0  # wall time since the picture was begun
    error: float | None = None  # standard error of the whole picture; None: not known yet
    relmse: float | None = None  # mean of variance / (mean^2 + 0.01 (image mean)^2); None: not known yet
    worst_tile_error: float | None = None  # of the worst 32x32 pixels
    all_black: bool = False  # no sample returned light, where surfaces reflect: a zero variance proves nothing
    unproven: float = 0  # share of the pixels that saw no light in their neighbourhood, [0, 1]
    hidden_error: float = 0  # what these may add to the error (95 %)
    bias: float = 0  # of the mean luminance, by merging light paths (vcm, photon), by estimate
    bias_error: float = 0  # standard error of that
    reuse_share: float = 0  # of the samples, carried over from earlier pictures, [0, 1)
    budget_used: float = 0  # [0, 1]; 0 without an end
    rays: int = 0
    paths: int = 0
    samples_per_second: float = 0
    invalid_samples: int = 0  # NaN or infinite: left out
    replay_token: str = ""  # of the first of them, for Client.replay
    first_tile_seconds: float = 0  # from the view to its first tile
    dropped_tiles: int = 0  # states that newer ones replaced before they were sent
    pass_seconds: dict[str, float] = dataclasses.field(default_factory=dict)  # processor time of each pass


def make_stats(progress: types.Progress, end: types.FrameEnd | None = None) -> Stats:
    """Of a picture on its way, or with `end` of one that ended; `progress` is end.totals then."""
    error = progress.error
    stats = Stats(
        samples=progress.samples_per_pixel,
        seconds=progress.seconds,
        error=error.rmse if error.known else None,
        relmse=error.relmse if error.known else None,
        worst_tile_error=error.worst_tile_rmse if error.known else None,
        all_black=error.all_black,
        unproven=error.unproven,
        hidden_error=error.hidden_rmse,
        bias=error.bias,
        bias_error=error.bias_error,
        reuse_share=progress.reuse_share,
        budget_used=progress.budget_used,
        rays=progress.rays,
        paths=progress.paths,
        samples_per_second=progress.samples_per_second,
        invalid_samples=progress.invalid_samples,
    )
    if end is None:
        return stats
    return dataclasses.replace(
        stats,
        ended_by=enum_name(types.EndReason.DESCRIPTOR, end.reason),
        replay_token=end.replay_token,
        first_tile_seconds=end.first_tile_seconds,
        dropped_tiles=end.dropped_tiles,
        pass_seconds={item.pass_: item.seconds for item in map(_PassTime, end.passes)},
    )


class _PassTime:
    """`pass` is a word of Python's own."""

    def __init__(self, message: types.PassTime) -> None:
        self.pass_: str = getattr(message, "pass")
        self.seconds = message.seconds
