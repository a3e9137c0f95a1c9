"""Pictures: numpy arrays by name, and files of them."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import display, exr
from .errors import InvalidArgument, MissingChannel, NotFound, Unavailable, invalid
from .exr import Window
from .files import write_atomically
from .settings import read_stops
from .stats import Stats
from .tiles import GROUPS, in_stack_order

Array = npt.NDArray[np.float32]

_MOST_PIXELS = 1 << 31
_KEPT = ("seed", "samples", "error", "endedBy", "notices")  # after "heliograph.": attributes of a file
_ASKED_BY = {
    "alpha": "A",
    "depth": "Z",
    "normal": "N.x",
    "albedo": "albedo.r",
    "history": "history.weight",
    "density": "samples.density",
    "display": "display.R",
}


class Image:
    """A picture of H x W pixels, row 0 at the top, as float32 arrays. What was not asked for is no attribute
    (MissingChannel).

    planes: channel name to array of H x W; names are those of the EXR files ("R", "variance.G", "samples", "Z", ...).
    window: the region of the film that the arrays cover; None: all of it. frame: (width, height) of the film.
    stats: how it came about. unsampled, notices: what the integrator leaves out, and how the picture differs from
    what the view asks for, a sentence each. seed: of its samples, None where it is not known. view: of a session, number
    of what it shows, as Session.view; of a camera path, from 1 on; None where it is not known.
    """

    def __init__(
        self,
        planes: Mapping[str, npt.ArrayLike],
        *,
        window: Window | None = None,
        frame: tuple[int, int] | None = None,
        stats: Stats | None = None,
        unsampled: Sequence[str] = (),
        notices: Sequence[str] = (),
        seed: int | None = None,
        view: int | None = None,
    ) -> None:
        self._planes = {name: np.asarray(plane, np.float32) for name, plane in planes.items()}
        shapes = {plane.shape for plane in self._planes.values()}
        if len(shapes) != 1 or len(next(iter(shapes))) != 2 or 0 in next(iter(shapes)):
            raise invalid("planes", f"shapes {sorted(shapes)}", "at least one plane, all of one shape H x W")
        height, width = next(iter(shapes))
        self.window = Window(0, 0, width, height) if window is None else window
        self.frame = (self.window.x1, self.window.y1) if frame is None else frame
        if (self.window.height, self.window.width) != (height, width):
            raise invalid("window", str(self.window), f"a window of {width}x{height} pixels")
        self.stats = Stats() if stats is None else stats
        self.unsampled = tuple(unsampled)
        self.notices = tuple(notices)
        self.seed = seed
        self.view = view

    # ---- channels

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.window.height, self.window.width

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self.window.width, self.window.height

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all channels."""
        return tuple(self._planes)

    def __contains__(self, name: object) -> bool:
        return name in self._planes

    def __iter__(self) -> Iterator[str]:
        return iter(self._planes)

    def __len__(self) -> int:
        return len(self._planes)

    def __getitem__(self, name: str) -> Array:
        """The channel of this name, H x W. MissingChannel: there is none."""
        plane = self._planes.get(name)
        if plane is None:
            ask = next(
                (
                    group
                    for group, first in _ASKED_BY.items()
                    if name == first or name in GROUPS.get(group, ()) or name.split(".")[0] == group
                ),
                None,
            )
            hint = f"; ask for it by channels='{ask}'" if ask else ""
            raise MissingChannel(
                f"this picture has no channel {name!r}{hint}; it has {', '.join(self._planes)}", problems=()
            )
        return plane

    def _group(self, group: str) -> Array:
        """H x W x 3; a view where the three lie together in memory."""
        planes = [self[name] for name in GROUPS[group]]
        first = planes[0]
        step = first.nbytes
        base = first.base
        if (
            isinstance(base, np.ndarray)
            and base.ndim == 3
            and base.dtype == np.float32
            and all(
                plane.base is base and plane.ctypes.data == first.ctypes.data + step * index
                for index, plane in enumerate(planes)
            )
            and first.flags.c_contiguous
        ):
            index = (first.ctypes.data - base.ctypes.data) // step
            return np.moveaxis(base[index : index + 3], 0, -1)
        return np.stack(planes, axis=-1)

    @property
    def rgb(self) -> Array:
        """Mean radiance, linear Rec.709, W / (sr m^2), H x W x 3."""
        return self._group("rgb")

    @property
    def variance(self) -> Array:
        """Variance of that mean, H x W x 3, >= 0. In modes that reuse pictures the bound on their bias is in it."""
        return self._group("variance")

    @property
    def sigma(self) -> Array:
        """Standard error of the mean radiance, H x W x 3, radiance units: the root of the variance."""
        return np.sqrt(self.variance)

    @property
    def samples(self) -> Array:
        """Valid samples of each pixel, carried ones included, H x W."""
        return self["samples"]

    @property
    def display(self) -> Array:
        """The picture for the eye, filtered along surfaces, linear, H x W x 3. Biased. Needs channels="display"."""
        return self._group("display")

    @property
    def display_error(self) -> Array:
        """Estimated root mean square error of `display`, H x W; infinite where nothing tells it."""
        return self["display.error"]

    @property
    def alpha(self) -> Array:
        """Share of the samples that hit something, H x W, [0, 1]. Needs channels="alpha"."""
        return self["A"]

    @property
    def depth(self) -> Array:
        """Distance to the first hit, H x W, scene's unit; infinite: none. Needs channels="depth"."""
        return self["Z"]

    @property
    def normal(self) -> Array:
        """Mean shading normal, world space, H x W x 3. Needs channels="normal"."""
        return self._group("normal")

    @property
    def albedo(self) -> Array:
        """Albedo of the first hit, H x W x 3. Needs channels="albedo"."""
        return self._group("albedo")

    def z(self, other: Image) -> Array:
        """(self - other) / standard error of the difference, H x W x 3: near a normal distribution of variance 1
        where both estimate the same radiance. 0 where both are equal without variance, infinite where they differ
        without any.

        InvalidArgument: another size or window. MissingChannel: one of them has no variance.
        """
        if not isinstance(other, Image) or other.window != self.window:
            shown = str(other.window) if isinstance(other, Image) else other
            raise invalid("other", shown, f"a picture of the window {self.window}")
        difference = self.rgb - other.rgb
        with np.errstate(divide="ignore", invalid="ignore"):
            z = difference / np.sqrt(self.variance + other.variance)
        z[difference == 0] = 0
        return z.astype(np.float32, copy=False)

    # ---- pictures for the eye

    def to_srgb(self, exposure: float | None = None, layer: str | None = None) -> npt.NDArray[np.uint8]:
        """8-bit sRGB, H x W x 3.

        exposure: stops, [-64, 64], 0: radiance 1 is white; None: automatic, by the log-average luminance.
        layer: "display" or "radiance"; None: display where it is there. InvalidArgument: anything else.
        """
        rgb = self._layer(layer)[1]
        factor = display.auto_exposure(rgb) if exposure is None else 2.0 ** read_stops(exposure, automatic=True)
        return display.srgb_bytes(rgb, factor)

    def _layer(self, layer: str | None) -> tuple[str, Array]:
        if layer not in (None, "display", "radiance"):
            raise invalid("layer", layer, "'display', 'radiance'")
        if layer == "display" or (layer is None and "display.R" in self):
            return "display", self.display
        return "radiance", self.rgb

    def to_png(self, exposure: float | None = None, layer: str | None = None) -> bytes:
        """to_srgb() as the bytes of a PNG file, whose description names the layer."""
        name = self._layer(layer)[0]
        return display.encode_png(self.to_srgb(exposure, layer), f"Layer {name}")

    def _repr_png_(self) -> bytes:
        return self.to_png()

    # ---- files

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        exposure: float | None = None,
        layer: str | None = None,
        compression: str = "zip",
    ) -> pathlib.Path:
        """Writes the file in one step (temporary file, then rename) and answers its path.

        .exr: all channels as floats, compression "zip" or "none", and seed, samples, error, what ended the picture,
        `unsampled` and `notices` as attributes, which load() reads. .png: as to_srgb(exposure, layer).
        InvalidArgument: another ending, or an option that does not go with it. OSError: it cannot be written.
        """
        target = pathlib.Path(path)
        ending = target.suffix.lower()
        if ending == ".exr":
            if exposure is not None or layer is not None:
                raise invalid("path", str(target), "a name that ends in .png: exposure and layer do not go with .exr")
            data = exr.encode(
                self._planes,
                self.window,
                self.frame,
                comments="\n".join(self.unsampled),
                texts=self._texts(),
                compression=compression,
            )
        elif ending == ".png":
            data = self.to_png(exposure, layer)
        else:
            raise invalid("path", str(target), "a name that ends in .exr or .png")
        write_atomically(target, data)
        return target

    def _texts(self) -> dict[str, str]:
        """What a file keeps besides its channels, by the names of its attributes."""
        stats = self.stats
        texts = {
            "heliograph.seed": str(self.seed) if self.seed is not None else "",
            "heliograph.samples": str(stats.samples) if stats.samples else "",
            "heliograph.error": repr(stats.error) if stats.error is not None else "",
            "heliograph.endedBy": stats.ended_by,
            "heliograph.notices": "\n".join(self.notices),
        }
        return {name: text for name, text in texts.items() if text}

    def show_in_tev(self, name: str | None = None, *, address: str = "127.0.0.1:14158", timeout: float = 10) -> str:
        """Shows radiance, display, standard error and samples in tev or HDRView, and answers the picture's name there.

        name: an image of that name is replaced; None: another name each time. address: "HOST:PORT", "[IPV6]:PORT" or
        "unix:PATH" of the viewer. timeout: seconds for all of it. InvalidArgument: the address. Unavailable: no viewer
        answers, or it did not read all of the picture in time.
        """
        from . import tev

        try:
            return tev.show_in_tev(self, name, address, timeout=timeout)
        except tev.TevUnreachable as problem:
            raise Unavailable(str(problem), problems=()) from None
        except ValueError as problem:
            raise InvalidArgument(str(problem), problems=()) from None

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Image:
        """Reads an EXR file of one flat part, uncompressed or by zip; other compressions need the extra `exr`. Of a
        file that save() wrote, `stats` has samples, error and ended_by, and seed, unsampled and notices are there.

        NotFound: no such file. InvalidArgument: broken, or another kind of file.
        """
        try:
            data = pathlib.Path(path).read_bytes()
        except FileNotFoundError:
            raise NotFound(f"{os.fspath(path)}: no such file", problems=()) from None
        return image_of_exr(data, os.fspath(path))

    def __array__(self, dtype: Any = None, copy: Any = None) -> npt.NDArray[Any]:
        return np.array(self.rgb, dtype=dtype) if copy else np.asarray(self.rgb, dtype=dtype)

    def __repr__(self) -> str:
        told = [f"{self.window.width}x{self.window.height}"]
        if self.stats.samples:
            told.append(f"{self.stats.samples} samples")
        if self.stats.error is not None:
            told.append(f"error {self.stats.error:.3g}")
        if self.stats.ended_by:
            told.append(f"ended by {self.stats.ended_by}")
        return f"<heliograph.Image {', '.join(told)}>"


def image_of_exr(
    data: bytes,
    name: str,
    *,
    stats: Stats | None = None,
    seed: int | None = None,
    view: int | None = None,
    notices: Sequence[str] | None = None,
) -> Image:
    """The picture in the bytes of an EXR file. stats, seed, notices: None: what the file's attributes tell.

    InvalidArgument: broken, or another kind of file; the message begins with `name`.
    """
    try:
        header, planes = exr.decode(data, _MOST_PIXELS)
    except InvalidArgument as error:
        raise InvalidArgument(f"{name}: {error}", problems=()) from None
    names = in_stack_order(list(planes))
    block = np.empty((len(names), header.window.height, header.window.width), np.float32)
    for index, channel in enumerate(names):
        block[index] = planes[channel]
    texts = {key: header.texts.get(f"heliograph.{key}", "") for key in _KEPT}
    if stats is None:
        stats = Stats(
            samples=int(texts["samples"]) if texts["samples"].isdecimal() else 0,
            error=_number_in(texts["error"]),
            ended_by=texts["endedBy"],
        )
    if seed is None and texts["seed"].isdecimal() and len(texts["seed"]) <= 20:
        seed = int(texts["seed"])
    return Image(
        {channel: block[index] for index, channel in enumerate(names)},
        window=header.window,
        frame=header.frame,
        unsampled=header.comments.splitlines() if header.comments else (),
        notices=texts["notices"].splitlines() if notices is None else notices,
        stats=stats,
        seed=seed,
        view=view,
    )


def _number_in(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
