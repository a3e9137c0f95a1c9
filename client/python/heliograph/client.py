"""The client over blocking gRPC."""

from __future__ import annotations

import contextlib
import os
import pathlib
import weakref
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Union, Unpack

import grpc

from . import operations
from .address import check_address, read_token
from .arguments import (
    CompareArguments,
    EditArguments,
    EnqueueArguments,
    RenderArguments,
    SessionArguments,
    SubmitArguments,
)
from .client_methods import ClientMethods, check_compare, listed
from .comparison import Comparison
from .comparison.request import Modes, Plan
from .comparison.run import ComparisonRun, keeping
from .connection import Connection, tell_ignored
from .daemon import Daemon
from .edits import Changes
from .errors import HeliographError, from_rpc, invalid
from .image import Image
from .job import Job
from .jobs import JobFeed, image_of
from .kept_job import KeptJob, watch
from .kept_jobs import JobEvent, States, WatchFeed, make_job_info, read_states
from .progress import CompareProgress, ComparisonReporter, Progress, Reporter
from .replay import Replay
from .scene import Details, SceneValues, ServerInfo, check_scene, make_server_info, warn_of
from .session import Session
from .session_core import SessionCore, SessionPlan
from .settings import read_timeout
from .stats import make_stats
from .tls import read_tls
from .v1 import durable_job_pb2 as kept
from .v1 import job_pb2 as jobs
from .v1 import render_service_pb2 as service


class Scene(SceneValues):
    """A scene that the client's daemon holds, and shortcuts to the client's methods."""

    def __init__(
        self,
        client: Client,
        info: service.SceneInfo,
        loaded: service.LoadSceneResponse | None = None,
        notices: tuple[str, ...] = (),
    ) -> None:
        super().__init__(info, loaded, notices)
        self._client = client

    def render(self, **arguments: Unpack[RenderArguments]) -> Image:
        """As Client.render."""
        return self._client.render(self, **arguments)

    def session(self, **arguments: Unpack[SessionArguments]) -> Session:
        """As Client.session."""
        return self._client.session(self, **arguments)

    def submit(self, **arguments: Unpack[SubmitArguments]) -> Job:
        """As Client.submit."""
        return self._client.submit(self, **arguments)

    def enqueue(self, **arguments: Unpack[EnqueueArguments]) -> KeptJob:
        """As Client.enqueue."""
        return self._client.enqueue(self, **arguments)

    def compare(self, modes: Modes, **arguments: Unpack[CompareArguments]) -> Comparison:
        """As Client.compare."""
        return self._client.compare(self, modes, **arguments)

    def edit(self, **changes: Unpack[EditArguments]) -> Scene:
        """As Client.edit."""
        return self._client.edit(self, **changes)

    def inspect(self) -> Details:
        """As Client.inspect."""
        return self._client.inspect(self)

    def unload(self) -> None:
        """As Client.unload."""
        self._client.unload(self)


#: What render, session, submit, enqueue and inspect take: a scene, or a file that is loaded first.
SceneLike = Union[Scene, str, "os.PathLike[str]"]


class Client(ClientMethods[Scene, Image, Job, KeptJob, Session, Comparison]):
    """Asks one daemon. Made by heliograph.connect and heliograph.serve; a context manager. Thread safe.

    All methods raise HeliographError: Unavailable where the daemon cannot be reached or went away, PermissionDenied
    without its token, FailedPrecondition after close() and in a forked process, and what their own lines name.
    """

    def __init__(self, connection: Connection, info: ServerInfo, daemon: Daemon | None = None) -> None:
        self._connection = connection
        self._open: weakref.WeakSet[Session | Job] = weakref.WeakSet()
        self.daemon = daemon  # of heliograph.serve; None: it is someone else's
        self._first_info = info

    @property
    def address(self) -> str:
        """Of the daemon: "HOST:PORT" or "unix:PATH"."""
        return self._connection.peer

    # ---- scenes

    def info(self) -> ServerInfo:
        """Version, limits, modes and integrators of the daemon."""
        return self._connection.run(operations.server_info())

    def load(
        self,
        path: str | os.PathLike[str],
        *,
        environment: str | os.PathLike[str] | Sequence[float] | None = None,
        on_server: bool = False,
        time: float = 0,
        animation: str = "",
        strict: bool = False,
    ) -> Scene:
        """Loads a scene: .gltf or .glb (glTF 2.0) or .xml (Mitsuba), with the files that it names below its folder.

        environment: light from everywhere, a latitude-longitude map or three numbers R, G, B in [0, 3.4e38], W / (sr
        m^2); replaces the scene's own. on_server: `path`, and a map, lie under the daemon's scene roots. time:
        seconds, at which the animation is evaluated. animation: name or number of the clip; empty: the first that
        moves anything. strict:
        refuse files that break a rule of their format although their meaning is beyond doubt; else HeliographWarning.
        A scene that the daemon holds already costs nothing.

        NotFound: no such file. InvalidArgument: the file is broken, with file and place. Unimplemented: it requires an
        extension. ResourceExhausted: a limit.
        """
        info, loaded = self._connection.run(operations.load(path, environment, on_server, time, animation, strict))
        scene = Scene(self, info, loaded)
        warn_of(scene, 3)
        return scene

    def scenes(self) -> list[Scene]:
        """All scenes that the daemon holds."""
        return [Scene(self, info) for info in self._connection.run(operations.scenes())]

    def files(self, folder: str | os.PathLike[str] = "") -> list[pathlib.PurePosixPath]:
        """Scenes, maps and folders under the daemon's scene roots, for load(..., on_server=True)."""
        return self._connection.run(operations.files(folder))

    def inspect(self, scene: SceneLike) -> Details:
        """Materials, lights and objects with their present values: what edit() may name."""
        return self._connection.run(operations.describe(self._scene(scene)))

    def edit(
        self,
        scene: Scene,
        *,
        materials: Changes | None = None,
        lights: Changes | None = None,
        objects: Changes | None = None,
        environment: dict[str, Any] | None = None,
    ) -> Scene:
        """Another scene that shares memory with this one, which stays. Keys are names or numbers.

        materials: base_color ([0, 1] each), emission (W / (sr m^2)), roughness ([0, 1]). lights: intensity (W / sr,
        directional W / m^2) or scale. objects: transform (3x4 or 4x4, object to world), relative=True: applied after
        the present one. environment: radiance or scale. InvalidArgument names every wrong key and value.
        """
        check_scene(scene, Scene)
        info, notices = self._connection.run(operations.edit(scene, materials, lights, objects, environment))
        return Scene(self, info, notices=notices)

    def unload(self, scene: Scene) -> None:
        """Frees it on the daemon. FailedPrecondition: a session or job uses it."""
        self._connection.run(operations.unload(check_scene(scene, Scene)))

    def _scene(self, scene: SceneLike) -> Scene:
        if isinstance(scene, (str, os.PathLike)):
            return self.load(scene)
        found: Scene = check_scene(scene, Scene)
        return found

    # ---- pictures

    def _render(
        self, scene: SceneLike, make_request: Callable[[Scene], jobs.RunJobRequest], progress: Progress
    ) -> Image:
        request = make_request(self._scene(scene))
        feed, frame = JobFeed(), None
        with Reporter(progress) as reporter:
            call = self._connection.open("RunJob", request)
            try:
                for response in call:
                    frame = feed.add(response) or frame
                    if feed.progress is not None and response.HasField("progress"):
                        reporter.update(make_stats(feed.progress))
            except grpc.RpcError as error:
                raise from_rpc(error, self.address) from None
            except BaseException:
                call.cancel()
                raise
        return image_of(frame)

    def _submit(self, scene: SceneLike, make_request: Callable[[Scene], jobs.RunJobRequest]) -> Job:
        request = make_request(self._scene(scene))
        job = Job(self._connection, request, len(request.views) or 1)
        self._open.add(job)
        return job

    def _enqueue(self, scene: SceneLike, make_request: Callable[[Scene], kept.SubmitJobRequest]) -> KeptJob:
        answer = self._connection.run(operations.submit_job(make_request(self._scene(scene))))
        return KeptJob(self._connection, make_job_info(answer.job), answer)

    def _session(self, scene: SceneLike, make_plan: Callable[[Scene], SessionPlan]) -> Session:
        loaded = self._scene(scene)
        plan = make_plan(loaded)
        created = self._connection.run(operations.create_session(plan.request))
        try:
            session = Session(self, self._connection, SessionCore(created.session_id, loaded, plan))
        except BaseException:
            with contextlib.suppress(HeliographError):
                self._connection.run(operations.close_session(created.session_id))
            raise
        self._open.add(session)
        return session

    def _compare(
        self, scene: SceneLike, make_plan: Callable[[Scene | None], Plan], progress: CompareProgress
    ) -> Comparison:
        if isinstance(scene, (str, os.PathLike)):
            make_plan(None)
        run = ComparisonRun(make_plan(self._scene(scene)))
        with keeping(run), ComparisonReporter(progress) as reporter:
            while True:
                references = [self._connection.run(operations.load_reference(file)) for file in run.files]
                call = self._connection.open("Compare", run.request(references), run.seconds_left())
                try:
                    for response in call:
                        told = run.add(response)
                        if told is not None:
                            reporter.update(told)
                    tell_ignored(call.trailing_metadata(), self.address)
                    return run.result()
                except grpc.RpcError as error:
                    failure = run.failed(from_rpc(error, self.address))
                    if failure is not None:
                        raise failure from None
                except BaseException:
                    call.cancel()
                    raise

    def replay(self, token: str) -> Replay:
        """Traces a sample again that came out NaN or infinite, vertex by vertex. token: Image.stats.replay_token.

        InvalidArgument: a damaged token. NotFound: the daemon does not hold its scene.
        """
        return Replay(self._connection.run(operations.replay(token)))

    # ---- jobs that the daemon keeps

    def job(self, job_id: str) -> KeptJob:
        """The job of this id, of whoever enqueued it. NotFound: the daemon keeps none of this id."""
        return KeptJob(self._connection, self._connection.run(operations.job_info(job_id)))

    def jobs(self, states: States = None) -> Iterator[KeptJob]:
        """The jobs that the daemon keeps, newest first, asked for page by page as they are taken. states: "queued",
        "running", "paused", "succeeded", "failed", "canceled", or several of them; None: all."""
        return self._jobs(read_states(states))

    def _jobs(self, states: list[int]) -> Iterator[KeptJob]:
        token = ""
        while True:
            page, token = self._connection.run(operations.job_page(states, token))
            for info in page:
                yield KeptJob(self._connection, info)
            if not token:
                return

    def watch_jobs(
        self, *, from_seq: int = 0, progress: bool = False, timeout: float | None = None, patience: float = 60
    ) -> Iterator[JobEvent]:
        """As KeptJob.watch, of all jobs and without an end: every change of any job's state, and with `progress` how far
        the running ones are. from_seq: 0: from now on."""
        feed = WatchFeed(from_seq=from_seq, progress=progress, timeout=timeout, patience=patience)
        return watch(self._connection, feed)

    # ---- the end

    def close(self) -> None:
        """Ends its sessions, jobs, connection and, of heliograph.serve, the daemon. May be called again."""
        if not self._connection.is_own:
            return
        try:
            for opened in list(self._open):
                opened.close()
        finally:
            self._connection.close()
            if self.daemon is not None:
                self.daemon.stop()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<heliograph.Client {self.address}, heliographd {self._first_info.version}>"


def connect(
    address: str,
    *,
    token: str | None = None,
    token_file: str | os.PathLike[str] | None = None,
    tls: bool | None = None,
    ca: str | os.PathLike[str] | None = None,
    certificate: str | os.PathLike[str] | None = None,
    key: str | os.PathLike[str] | None = None,
    tls_name: str | None = None,
    wait: float = 0,
    timeout: float = 30,
) -> Client:
    """A client of the daemon at "HOST:PORT" or "unix:PATH".

    token: the daemon's, or the first line of token_file that is neither empty nor begins with "#"; without either the
    file that HELIOGRAPH_TOKEN_FILE names. tls: True encrypts the connection, and so does each of the next four; False
    does not, whatever the variables HELIOGRAPH_TLS, HELIOGRAPH_TLS_CA, HELIOGRAPH_CLIENT_CERTIFICATE,
    HELIOGRAPH_CLIENT_KEY and HELIOGRAPH_TLS_NAME say. ca: PEM file of the authorities that the daemon's certificate may
    come from; None: the system's. certificate, key: PEM files, for a daemon that asks for a certificate. tls_name: that
    the daemon's certificate has; None: the host of the address. wait: seconds to keep trying while no daemon answers,
    [0, 86400]. timeout: seconds for each of the quick calls (not loads, edits, renders).

    InvalidArgument: the address, the token, a file. Unavailable: no daemon answers, or it and the client do not trust
    each other, with what to give. PermissionDenied: not its token.
    """
    check_address(address)
    secret = read_token(token, token_file)
    encryption = read_tls(tls, ca, certificate, key, tls_name)
    connection = Connection(address, secret, read_timeout("timeout", timeout), encryption)
    try:
        info = make_server_info(connection.greet(read_timeout("wait", wait, zero=True)))
    except BaseException:
        connection.close()
        raise
    return Client(connection, info)


def serve(
    program: str | os.PathLike[str] | None = None,
    *,
    scene_roots: str | os.PathLike[str] | Iterable[str | os.PathLike[str]] = (),
    threads: int | None = None,
    drain_grace: float = 1.0,
    state: str | os.PathLike[str] | None = None,
    arguments: Sequence[str] = (),
    timeout: float = 30,
) -> Client:
    """Starts a daemon on this machine and answers a client of it; close() ends both. Arguments as of Daemon."""
    daemon = Daemon(
        program,
        scene_roots=scene_roots,
        threads=threads,
        drain_grace=drain_grace,
        state=state,
        arguments=arguments,
        timeout=timeout,
    )
    try:
        client = connect(daemon.address, token=daemon.token, tls=False, wait=timeout)
    except BaseException:
        daemon.stop()
        raise
    client.daemon = daemon
    return client


def compare(
    scene: SceneLike,
    modes: Modes,
    *,
    address: str | None = None,
    token: str | None = None,
    token_file: str | os.PathLike[str] | None = None,
    tls: bool | None = None,
    ca: str | os.PathLike[str] | None = None,
    certificate: str | os.PathLike[str] | None = None,
    key: str | os.PathLike[str] | None = None,
    tls_name: str | None = None,
    **arguments: Unpack[CompareArguments],
) -> Comparison:
    """As Client.compare, of the daemon that holds `scene`; of a file, of the daemon at `address`, or without an address
    of one that is started for it alone. token to tls_name: as of connect()."""
    if isinstance(scene, Scene):
        if address is not None:
            raise invalid("address", address, "none beside a Scene, whose daemon is asked")
        return scene.compare(modes, **arguments)
    modes = listed(modes)
    for name, value in arguments.items():
        arguments[name] = listed(value)  # type: ignore[literal-required]
    if isinstance(scene, (str, os.PathLike)):
        check_compare(scene, modes, arguments)
    if address is not None:
        with connect(
            address,
            token=token,
            token_file=token_file,
            tls=tls,
            ca=ca,
            certificate=certificate,
            key=key,
            tls_name=tls_name,
        ) as client:
            return client.compare(scene, modes, **arguments)
    exclusive = ["--allow-exclusive", "on"] if arguments.get("exclusive") else []
    with serve(arguments=exclusive) as client:
        return client.compare(scene, modes, **arguments)
