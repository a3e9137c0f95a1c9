"""The methods of a client that take many arguments, each spelt out once for heliograph and for heliograph.aio."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Generic, TypeVar, Unpack

from .budget import Until
from .camera import Camera
from .comparison import Comparison
from .comparison.regions import Region
from .comparison.request import Measure, Modes, Plan, Reference, make_plan
from .jobs import job_request
from .kept_jobs import submit_request
from .progress import CompareProgress, Progress
from .scene import SceneValues
from .session_core import SessionPlan, plan_session
from .settings import Channel, Compression, Denoiser, PixelType, Settings, Size
from .v1 import durable_job_pb2 as kept
from .v1 import job_pb2 as jobs

SceneT = TypeVar("SceneT", bound=SceneValues)
ImageT = TypeVar("ImageT")  # Image, in asyncio a coroutine of it; so the others
JobT = TypeVar("JobT")
KeptJobT = TypeVar("KeptJobT")
SessionT = TypeVar("SessionT")
ComparisonT = TypeVar("ComparisonT")


class ClientMethods(Generic[SceneT, ImageT, JobT, KeptJobT, SessionT, ComparisonT]):
    """Turns arguments into a function from the loaded scene to the protocol's request, for the client to send."""

    @property
    def address(self) -> str:
        """Of the daemon: "HOST:PORT" or "unix:PATH"."""
        raise NotImplementedError

    def _render(
        self,
        scene: SceneT | str | os.PathLike[str],
        make_request: Callable[[SceneT], jobs.RunJobRequest],
        progress: Progress,
    ) -> ImageT:
        raise NotImplementedError

    def _submit(
        self, scene: SceneT | str | os.PathLike[str], make_request: Callable[[SceneT], jobs.RunJobRequest]
    ) -> JobT:
        raise NotImplementedError

    def _enqueue(
        self, scene: SceneT | str | os.PathLike[str], make_request: Callable[[SceneT], kept.SubmitJobRequest]
    ) -> KeptJobT:
        raise NotImplementedError

    def _session(self, scene: SceneT | str | os.PathLike[str], make_plan: Callable[[SceneT], SessionPlan]) -> SessionT:
        raise NotImplementedError

    def _compare(
        self,
        scene: SceneT | str | os.PathLike[str],
        make_plan: Callable[[SceneT | None], Plan],
        progress: CompareProgress,
    ) -> ComparisonT:
        """make_plan: of None: checks what can be checked before the scene is loaded."""
        raise NotImplementedError

    def render(
        self,
        scene: SceneT | str | os.PathLike[str],
        *,
        until: Until,
        size: Size | None = None,
        camera: Camera | str | int | None = None,
        progress: Progress = False,
        channels: Channel | Iterable[Channel] = (),
        denoiser: Denoiser | None = None,
        pixel_type: PixelType = "float",
        compression: Compression | None = None,
        **settings: Unpack[Settings],
    ) -> ImageT:
        """Renders a still and answers it. Ctrl-C, and in asyncio the cancelling of the task, cancels it on the daemon,
        too.

        until: Error(...), Samples(...), Seconds(...), or a list of them, of which the first to be reached ends the
        render.
        size: (width, height) in pixels; None: what the camera's file asks for, or 720 rows of its aspect.
        camera: a Camera, or one of the scene by name or number; None: its first.
        progress: True: a bar by tqdm, where that is installed; or a function that takes Stats.
        channels: besides radiance, variance and samples any of "alpha", "depth", "normal", "albedo", "history",
        "density", "display". denoiser: "oidn" has Open Image Denoise make `display`, where the daemon was given it.
        pixel_type: "float" or "half" on the wire; arrays are always float32. compression: "none", "zip", "zips", "rle",
        "piz", "dwaa"; None: none on this machine, else zip. settings: mode, integrator, seed and others (Settings).

        InvalidArgument names every wrong name and value. ResourceExhausted: a limit. RenderFailed.
        """
        return self._render(
            scene,
            lambda loaded: job_request(
                loaded,
                self.address,
                size=size,
                until=until,
                camera=camera,
                views=None,
                channels=channels,
                denoiser=denoiser,
                pixel_type=pixel_type,
                compression=compression,
                settings=settings,
            ),
            progress,
        )

    def submit(
        self,
        scene: SceneT | str | os.PathLike[str],
        *,
        until: Until,
        size: Size | None = None,
        camera: Camera | str | int | None = None,
        views: Iterable[Camera | str | int] | None = None,
        channels: Channel | Iterable[Channel] = (),
        denoiser: Denoiser | None = None,
        pixel_type: PixelType = "float",
        compression: Compression | None = None,
        **settings: Unpack[Settings],
    ) -> JobT:
        """Starts a job and answers at once; arguments as of render(). views: a camera path, each of whose views gets
        the budget; the job's images() has the pictures. The job ends with this client, and when it is closed or
        collected; enqueue() is for jobs that outlive it.
        """
        return self._submit(
            scene,
            lambda loaded: job_request(
                loaded,
                self.address,
                size=size,
                until=until,
                camera=camera,
                views=views,
                channels=channels,
                denoiser=denoiser,
                pixel_type=pixel_type,
                compression=compression,
                settings=settings,
            ),
        )

    def enqueue(
        self,
        scene: SceneT | str | os.PathLike[str],
        *,
        until: Until,
        name: str = "",
        priority: int = 0,
        client_token: str = "",
        output: str | os.PathLike[str] | None = None,
        overwrite: bool = False,
        require_same_bits: bool = False,
        size: Size | None = None,
        camera: Camera | str | int | None = None,
        views: Iterable[Camera | str | int] | None = None,
        channels: Channel | Iterable[Channel] = (),
        denoiser: Denoiser | None = None,
        pixel_type: PixelType = "float",
        compression: Compression | None = None,
        **settings: Unpack[Settings],
    ) -> KeptJobT:
        """Gives the daemon a job that it keeps: the job outlives this program and, with the same state folder, the
        daemon. Answers as soon as the job has reached the daemon's disk; other arguments as of submit(), and

        until: Seconds count what the job was rendered, pauses and restarts left out.
        name: for people, at most 256 bytes. priority: [-100, 100], higher first, then the oldest.
        client_token: at most 128 bytes; a second call with the same one answers the job of the first, so that a call
        may be repeated whose answer was lost; InvalidArgument where it asks for something else.
        output: EXR file on the daemon's machine, absolute inside one of its output roots or relative to the first; with
        several views its name holds {view}, which becomes the index. None: the daemon keeps the pictures for fetch().
        overwrite: replace a file that is there; else such a job is refused, or pauses when it comes to write it.
        require_same_bits: after a restart with another build, with which the picture would not have the bits of an
        uninterrupted run, the job pauses; else it goes on, and same_bits is False.
        channels, pixel_type, compression: of the EXR files; compression None: zip.

        InvalidArgument names every wrong name and value. FailedPrecondition: the daemon has no state folder, or the
        output is there already. PermissionDenied: the output is outside its roots. ResourceExhausted: a limit.
        Unimplemented: the daemon is older than such jobs. Unavailable: its state folder cannot be written.
        """
        return self._enqueue(
            scene,
            lambda loaded: submit_request(
                job_request(
                    loaded,
                    self.address,
                    size=size,
                    until=until,
                    camera=camera,
                    views=views,
                    channels=channels,
                    denoiser=denoiser,
                    pixel_type=pixel_type,
                    compression=compression or "zip",  # a file, wherever the daemon is
                    settings=settings,
                ),
                name=name,
                priority=priority,
                client_token=client_token,
                output=output,
                overwrite=overwrite,
                require_same_bits=require_same_bits,
            ),
        )

    def session(
        self,
        scene: SceneT | str | os.PathLike[str],
        *,
        until: Until | None = None,
        size: Size | None = None,
        camera: Camera | str | int | None = None,
        exposure: float = 0,
        gaze: tuple[float, float] | None = None,
        buffer: int = 0,
        grace: float = 0,
        patience: float = 60,
        channels: Channel | Iterable[Channel] = (),
        denoiser: Denoiser | None = None,
        pixel_type: PixelType = "float",
        compression: Compression | None = None,
        **settings: Unpack[Settings],
    ) -> SessionT:
        """Opens a session, which begins to render; use it as a context manager. Arguments as of render(), and

        until: None: it renders until it is closed, or until wait() says otherwise. exposure: stops, of JPEG previews.
        gaze: where somebody looks at first, as Session.gaze. buffer: of frames(). grace: seconds that the daemon keeps
        the session when the connection breaks, 0: its default. patience: seconds, [0, 86400], in which a daemon that
        restarts (with a state folder) is asked for the session, which then goes on with its samples.
        settings: with preview_rate > 0 whole pictures come while the camera moves.
        """
        return self._session(
            scene,
            lambda loaded: plan_session(
                loaded,
                self.address,
                size=size,
                until=until,
                camera=camera,
                exposure=exposure,
                gaze=gaze,
                buffer=buffer,
                grace=grace,
                patience=patience,
                channels=channels,
                denoiser=denoiser,
                pixel_type=pixel_type,
                compression=compression,
                settings=settings,
            ),
        )

    def compare(
        self,
        scene: SceneT | str | os.PathLike[str],
        modes: Modes,
        *,
        seeds: int = 5,
        samples: Iterable[int] | int | None = None,
        times: Iterable[float] | float | None = None,
        size: Size | None = None,
        camera: Camera | str | int | None = None,
        views: Iterable[Camera | str | int] | None = None,
        reference: Reference = None,
        reference_error: float | None = None,
        reference_samples: int | None = None,
        regions: Mapping[str, Region] | None = None,
        gaze: tuple[float, float] | None = None,
        measures: Measure | Iterable[Measure] | None = None,
        common_seeds: bool = False,
        exclusive: bool = False,
        pictures: bool = False,
        worst_pixels: int = 0,
        resume: Comparison | None = None,
        output: str | os.PathLike[str] | None = None,
        mix: bool = False,
        progress: CompareProgress = False,
        timeout: float | None = None,
        **settings: Unpack[Settings],
    ) -> ComparisonT:
        """Compares sampling modes: error against time and samples, over seeds, and answers all of it. Ctrl-C, and in
        asyncio the cancelling of the task, ends it on the daemon, too.

        modes: the first is what the others are compared with. A list of words, as of the command `heliograph compare`
        ("pt", "combined", "pt+bdpt", "path", "paper-adaptive", "display", "oidn", "preview"), and dicts of settings
        ({"name": "fast", "mode": "combined", "picture": "display"}), or a dict from names to these
        (heliograph.comparison.CompareMode). **settings: those of every mode that does not have its own; seed: other
        numbers for all.
        seeds: of each mode, [1, 1000]; below five there are no intervals. common_seeds: modes have the same ones, so
        that two that draw the same numbers have the same noise.
        samples: rising budgets, per pixel, [1, 2^30]; None: 1, 2, 4 to 64. times: instead of these seconds of wall time
        of a view, [0.001, 86400]. Of a still one picture grows from each budget to the next; a path is played anew.
        size: None: the reference's, or as of render(). camera: as of render(); views: a path of cameras.
        reference: None: rendered by path tracing, to reference_error (root of its relative mean square error,
        [1e-4, 1]; None: 0.01) or reference_samples (even; None: 65536), whichever comes first, and kept by the daemon
        for later calls; a dict of settings: rendered with these instead of the first mode's; or the path of an EXR
        file, an array H x W x 3 of radiance or an Image, for several views a sequence of them.
        regions: names to (x0, y0, x1, y1) in pixels or to a Disk(x, y, radius), whose errors are told apart.
        gaze: (x, y) in pixels from the upper left corner, where somebody looks, of modes with foveation, such as
        {"name": "seen", "mode": "combined", "picture": "preview", "preview_rate": 20, "foveation": "paper"}; None: the
        picture's centre. measures: None: all that apply.
        exclusive: the daemon renders nothing else meanwhile, where it was configured to allow that. pictures: the
        result has pictures. worst_pixels: to be told of each unit of the last budget, [0, 64].
        resume: an earlier result, whole or in part: the units that it has are not rendered again, and the answer has
        the modes, seeds and budgets of both. output: a folder, as of Comparison.save and of the command: what it has is
        resumed, and all of it is kept there, with pictures, at the end, also of a call that fails or is interrupted;
        nobody else writes there meanwhile (FailedPrecondition). mix: also where these were rendered with other
        settings, or by another daemon.
        progress: True: a bar by tqdm, where that is installed; or a function that takes
        heliograph.comparison.ComparisonProgress. timeout: seconds for all of it.

        InvalidArgument names every wrong name and value, and what differs from `resume`. PermissionDenied: exclusive.
        ResourceExhausted: a limit. DeadlineExceeded. Every exception, KeyboardInterrupt and CancelledError included,
        has in `comparison` what had come before, or None.
        """
        scene_file = os.fspath(scene) if isinstance(scene, (str, os.PathLike)) else ""
        modes, samples, times, views, gaze, measures, reference = (
            listed(given) for given in (modes, samples, times, views, gaze, measures, reference)
        )
        return self._compare(
            scene,
            lambda loaded: make_plan(
                loaded,
                scene_file,
                modes,
                seeds=seeds,
                samples=samples,
                times=times,
                camera=camera,
                views=views,
                size=size,
                reference=reference,
                reference_error=reference_error,
                reference_samples=reference_samples,
                regions=regions,
                gaze=gaze,
                measures=measures,
                common_seeds=common_seeds,
                exclusive=exclusive,
                pictures=pictures,
                worst_pixels=worst_pixels,
                resume=resume,
                output=output,
                mix=mix,
                timeout=timeout,
                settings=settings,
            ),
            progress,
        )


def listed(given: Any) -> Any:
    """An iterator as a list, which can be read twice; anything else as it is."""
    return list(given) if isinstance(given, Iterator) else given


class _CompareCheck(ClientMethods[Any, Any, Any, Any, Any, None]):
    def _compare(self, scene: Any, make_plan: Callable[[Any], Plan], progress: CompareProgress) -> None:
        make_plan(None)


def check_compare(scene: str | os.PathLike[str], modes: Modes, arguments: Mapping[str, Any]) -> None:
    """Before there is a daemon. None of the values is an iterator. InvalidArgument, NotFound: what is wrong with a
    comparison of a file."""
    _CompareCheck().compare(scene, modes, **arguments)
