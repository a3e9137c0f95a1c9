"""A daemon of one's own: found, started on a free port with a token of its own, and ended."""

from __future__ import annotations

import collections
import contextlib
import json
import os
import pathlib
import secrets
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import weakref
from collections.abc import Iterable, Sequence

from .errors import DeadlineExceeded, NotFound, Unavailable, invalid
from .settings import read_timeout

_LINES = 200  # of its log that are kept
_TERM_S = 5.0  # beyond the drain grace, before it is killed
# It is reached on loopback, without TLS.
_OF_OTHER_DAEMONS = ("HELIOGRAPH_TLS_CERTIFICATE", "HELIOGRAPH_TLS_KEY", "HELIOGRAPH_TLS_CLIENT_CA")

# Ends the daemon when a line comes or when this process is gone, however it went: a notebook's kernel is often
# killed. Then it removes the folder with the token, its first argument. The daemon's exit code becomes the shell's.
_GUARD = """
folder=$1; shift
exec 3<&0
"$@" </dev/null 3<&- & daemon=$!
{ read _ <&3; kill -TERM $daemon 2>/dev/null; } >/dev/null 2>&1 & guard=$!
exec 3<&-
wait $daemon; code=$?
kill $guard 2>/dev/null
rm -rf -- "$folder"
exit $code
"""


def find_program(program: str | os.PathLike[str] | None = None) -> pathlib.Path:
    """heliographd: the argument, HELIOGRAPH_DAEMON, on PATH, beside this Python, or in a build folder of a checkout:
    the one that holds this package, that it was installed from, or that the working directory is in.

    NotFound says what to do.
    """
    if program is not None:
        found = shutil.which(os.fspath(program))
        if not found:
            raise NotFound(f"{os.fspath(program)} is no program that can be run", problems=())
        return pathlib.Path(found)
    beside = pathlib.Path(sys.executable).parent
    named = os.environ.get("HELIOGRAPH_DAEMON", "")
    for candidate in (named, "heliographd", str(beside / "heliographd"), *_built()):
        found = shutil.which(candidate) if candidate else None
        if found:
            return pathlib.Path(found)
    wrong = f" (HELIOGRAPH_DAEMON={named} is no program that can be run)" if named else ""
    raise NotFound(
        f"heliographd was not found{wrong}. Build it in a checkout (cmake --preset release && cmake --build --preset "
        "release), or install it so that it is on PATH, or let the variable HELIOGRAPH_DAEMON name it. Tried: "
        f"HELIOGRAPH_DAEMON, PATH, {beside}, and build/*/bin of {', '.join(map(str, _checkouts())) or 'no checkout'}",
        problems=(),
    )


def _checkouts() -> list[pathlib.Path]:
    """Of this project, nearest first, that belong to this user or to root: what lies in them is run."""
    recorded = []
    with contextlib.suppress(ImportError):
        from ._checkout import CHECKOUT  # type: ignore[import-not-found]

        recorded.append(pathlib.Path(CHECKOUT))
    found: dict[pathlib.Path, None] = {}
    try:
        here = pathlib.Path.cwd()
    except OSError:  # it was removed
        here = pathlib.Path("/")
    for folder in (*pathlib.Path(__file__).resolve().parents, *recorded, here, *here.parents):
        with contextlib.suppress(OSError):
            own = folder.stat().st_uid in (0, os.getuid())
            if own and (folder / "client" / "python" / "hatch_build.py").is_file():
                found[folder] = None
    return list(found)


def _built() -> list[str]:
    """Programs in build folders of checkouts; of one, release first, then the newest."""
    programs: list[str] = []
    for checkout in _checkouts():
        there = [path for path in checkout.glob("build/*/bin/heliographd") if path.is_file()]
        there.sort(key=lambda path: (path.parts[-3] != "release", -path.stat().st_mtime))
        programs += map(str, there)
    return programs


class Daemon:
    """heliographd on a free loopback port, with a random token. Use it as a context manager, or call stop().

    One that is forgotten is ended when it is collected, when Python exits, and when this process is killed.

    program: see find_program. scene_roots: folders that scene paths are served from. threads: that render; None: one
    per core. drain_grace: seconds that jobs get to finish at stop(). state: folder of the jobs that it keeps, and that
    the next daemon with the same folder goes on with; None: it keeps none; "auto": that of the person who runs it.
    arguments: further options of heliographd, as words.
    timeout: seconds that it gets to start. NotFound: no program. Unavailable: it ended; the message has the end of
    its log.
    DeadlineExceeded: it did not start in time.
    """

    def __init__(
        self,
        program: str | os.PathLike[str] | None = None,
        *,
        scene_roots: str | os.PathLike[str] | Iterable[str | os.PathLike[str]] = (),
        threads: int | None = None,
        drain_grace: float = 1.0,
        state: str | os.PathLike[str] | None = None,
        arguments: Sequence[str] = (),
        timeout: float = 30.0,
    ) -> None:
        path = find_program(program)
        if threads is not None and (
            isinstance(threads, bool) or not isinstance(threads, int) or not 1 <= threads <= 1024
        ):
            raise invalid("threads", threads, "[1, 1024], or None")
        if state is not None and (not isinstance(state, (str, os.PathLike)) or not os.fspath(state)):
            raise invalid("state", state, "a folder's path, 'auto', or None")
        drain_grace = read_timeout("drain_grace", drain_grace, zero=True)
        timeout = read_timeout("timeout", timeout)
        roots = [scene_roots] if isinstance(scene_roots, (str, os.PathLike)) else list(scene_roots)
        self.token = secrets.token_hex(16)
        command = [
            str(path),
            "--json",
            "--listen",
            "127.0.0.1:0",
            "--log-level",
            "warn",
            "--drain-grace",
            f"{drain_grace:g}",
            "--state",
            "none" if state is None else os.fspath(state),
        ]
        for root in roots:
            command += ["--scene-root", os.fspath(root)]
        if threads is not None:
            command += ["--render-threads", str(threads)]
        folder = tempfile.TemporaryDirectory(prefix="heliograph-")  # readable by this user alone
        file = pathlib.Path(folder.name) / "token"
        file.write_text(self.token + "\n")
        command += ["--token-file", str(file), *map(str, arguments)]
        # A session of its own keeps Ctrl-C in the terminal from it.
        self._process = subprocess.Popen(
            ["/bin/sh", "-c", _GUARD, "sh", folder.name, *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            env={name: value for name, value in os.environ.items() if name not in _OF_OTHER_DAEMONS},
        )
        self._log: collections.deque[str] = collections.deque(maxlen=_LINES)
        self._reader = threading.Thread(
            target=_keep_log, args=(self._process.stderr, self._log), name="heliograph-log", daemon=True
        )
        self._reader.start()
        self._finalizer = weakref.finalize(
            self, _end, self._process, self._reader, folder, os.getpid(), drain_grace + _TERM_S
        )
        try:
            self.address = self._await_address(timeout)
        except BaseException:
            self.stop()
            raise

    def _await_address(self, timeout: float) -> str:
        out = self._process.stdout
        assert out is not None
        end = time.monotonic() + timeout
        line = b""
        while not line.endswith(b"\n"):
            ready, _, _ = select.select([out], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                raise DeadlineExceeded(
                    f"heliographd did not start within {timeout:g} s; its log: {self.log}", problems=()
                )
            data = os.read(out.fileno(), 4096)
            if not data:
                code = self._process.wait()
                self._reader.join(5)
                raise Unavailable(f"heliographd ended with code {code}; its log: {self.log or 'empty'}", problems=())
            line += data
        address: str = json.loads(line)["listening"]
        return address

    @property
    def log(self) -> str:
        """The end of what it wrote to its log."""
        return "\n".join(list(self._log))

    @property
    def running(self) -> bool:
        """It was started and has not ended."""
        return self._finalizer.alive and self._process.poll() is None

    def stop(self) -> int | None:
        """Ends it: jobs get the drain grace. Answers its exit code, None in another process. May be called again."""
        self._finalizer()
        return self._process.returncode

    def __enter__(self) -> Daemon:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"<heliograph.Daemon {self.address}, {'running' if self.running else 'ended'}>"


def _keep_log(stream: object, log: collections.deque[str]) -> None:
    for line in stream:  # type: ignore[attr-defined]
        log.append(line.decode("utf-8", "replace").rstrip())


def _end(
    process: subprocess.Popen[bytes],
    reader: threading.Thread,
    folder: tempfile.TemporaryDirectory[str],
    owner: int,
    patience: float,
) -> None:
    if os.getpid() != owner:
        folder._finalizer.detach()  # type: ignore[attr-defined]
        return
    if process.poll() is None:
        assert process.stdin is not None
        try:
            process.stdin.write(b"\n")
            process.stdin.flush()
        except BrokenPipeError:
            pass
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()
    reader.join(1)
    for stream in (process.stdin, process.stdout, process.stderr):
        if stream is not None:
            try:
                stream.close()
            except OSError:
                pass
    folder.cleanup()
