"""Addresses, tokens, sockets, a daemon of one's own, fork."""

import os
import pathlib
import socket
import subprocess
import sys
import threading
import time
import types

import pytest
from conftest import BOX, eventually

import heliograph as hg
from heliograph import daemon as daemons
from heliograph.address import check_address, is_near, read_token


@pytest.mark.parametrize(
    "address",
    ["", "host", "host:", "host:0", "host:65536", "a b:1", "unix:", "[::1:5", "http://a:1/", "https://a:1", 7, None],
)
def test_bad_addresses(address):
    with pytest.raises(hg.InvalidArgument, match="HOST:PORT") as told:
        hg.connect(address)
    assert told.value.field == "address"


def test_addresses():
    for address in ("127.0.0.1:1", "[::1]:65535", "render-7.example:50051", "unix:/tmp/x"):
        assert check_address(address) == address
    assert [is_near(a) for a in ("127.0.0.9:1", "localhost:1", "[::1]:1", "unix:x", "10.0.0.1:1", "example.org:1")] == [
        True,
        True,
        True,
        True,
        False,
        False,
    ]


def test_nobody_answers():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    begun = time.monotonic()
    with pytest.raises(hg.Unavailable, match=f"no daemon answers at {address}"):
        hg.connect(address)
    assert time.monotonic() - begun < 5
    with pytest.raises(ConnectionError):  # what programs that know nothing of this package catch
        hg.connect(address, wait=0.3)


def test_waits_for_a_daemon_that_starts(program):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    processes = []
    timer = threading.Timer(
        0.5,
        lambda: processes.append(
            subprocess.Popen(
                [program, "--listen", address, "--log-level", "warn", "--state", "none"], stdout=subprocess.DEVNULL
            )
        ),
    )
    timer.start()
    try:
        with hg.connect(address, wait=30) as client:
            assert client.info().threads >= 1
    finally:
        timer.join()
        processes[0].terminate()
        processes[0].wait(20)


def test_tokens(client, tmp_path, monkeypatch):
    monkeypatch.delenv("HELIOGRAPH_TOKEN_FILE", raising=False)
    with pytest.raises(hg.PermissionDenied, match="wants a token"):
        hg.connect(client.address)
    with pytest.raises(hg.PermissionDenied):
        hg.connect(client.address, token="x" * 32)
    file = tmp_path / "token"
    file.write_text(f"# ours\n\n{client.daemon.token}  \nanother-token-of-theirs\n")
    with hg.connect(client.address, token_file=file) as other:
        assert other.info().version == hg.__version__
    monkeypatch.setenv("HELIOGRAPH_TOKEN_FILE", str(file))
    with hg.connect(client.address) as other:
        assert other.load(BOX).name == "cornell-box"  # streams carry it, too
    file.write_text("# none\n")
    with pytest.raises(hg.InvalidArgument, match="holds no token"):
        read_token(None, file)
    with pytest.raises(hg.NotFound, match="token file"):
        read_token(None, tmp_path / "nowhere")
    with pytest.raises(hg.InvalidArgument, match="either token or token_file"):
        read_token("x", file)
    with pytest.raises(hg.InvalidArgument) as told:
        read_token("with a space\n", None)
    assert "with a space" not in str(told.value)  # a secret


class SocketProxy:
    """Passes what comes over a Unix socket on to a daemon."""

    def __init__(self, path, target):
        self.target = target
        self.server = socket.socket(socket.AF_UNIX)
        self.server.bind(str(path))
        self.server.listen()
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                near, _ = self.server.accept()
            except OSError:
                return
            host, port = self.target.rsplit(":", 1)
            far = socket.create_connection((host, int(port)))
            for a, b in ((near, far), (far, near)):
                threading.Thread(target=self.copy, args=(a, b), daemon=True).start()

    @staticmethod
    def copy(source, to):
        try:
            while data := source.recv(1 << 16):
                to.sendall(data)
        except OSError:
            pass
        for end in (source, to):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def close(self):
        self.server.shutdown(socket.SHUT_RDWR)
        self.server.close()


def test_unix_socket(client, tmp_path):
    proxy = SocketProxy(tmp_path / "daemon.sock", client.address)
    try:
        with hg.connect(f"unix:{tmp_path}/daemon.sock", token=client.daemon.token) as other:
            image = other.render(BOX, size=(32, 32), until=hg.Samples(2))
            assert image.shape == (32, 32)
    finally:
        proxy.close()


def test_serve_starts_and_ends_a_daemon(program):
    with hg.serve(program, threads=1) as client:
        assert client.daemon.running and client.info().threads == 1
        pid = client.daemon._process.pid
    assert not client.daemon.running and client.daemon._process.returncode == 0
    assert client.daemon.stop() == 0
    with pytest.raises(ProcessLookupError):
        os.killpg(pid, 0)  # neither the daemon nor its guard is left
    eventually(
        lambda: sum(thread.name == "heliograph-log" for thread in threading.enumerate()) <= 1
    )  # the other client's


def test_serve_tells_why_a_daemon_ended(program, tmp_path):
    with pytest.raises(hg.Unavailable, match="(?s)ended with code 2; its log: .*--max-scenes"):
        hg.serve(program, arguments=["--max-scenes", "0"])
    with pytest.raises(hg.NotFound, match="no program that can be run"):
        hg.serve(tmp_path / "heliographd")
    with pytest.raises(hg.InvalidArgument, match=r"threads: 0; allowed: \[1, 1024\]"):
        hg.serve(program, threads=0)
    sleeper = tmp_path / "sleeper"
    sleeper.write_text("#!/bin/sh\necho slow >&2\nexec sleep 100\n")
    sleeper.chmod(0o755)
    with pytest.raises(hg.DeadlineExceeded, match="did not start within 0.5 s; its log: slow"):
        hg.serve(sleeper, timeout=0.5)


def test_serve_finds_the_program(program, tmp_path, monkeypatch):
    monkeypatch.delenv("HELIOGRAPH_DAEMON", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(daemons, "__file__", str(tmp_path / "a" / "b" / "c" / "d" / "daemon.py"))
    monkeypatch.setitem(sys.modules, "heliograph._checkout", None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(hg.NotFound, match="cmake --build .*PATH, or let the variable HELIOGRAPH_DAEMON name it"):
        daemons.find_program()
    monkeypatch.setenv("HELIOGRAPH_DAEMON", "/nowhere/heliographd")
    with pytest.raises(hg.NotFound, match="HELIOGRAPH_DAEMON=/nowhere/heliographd is no program"):
        daemons.find_program()
    monkeypatch.delenv("HELIOGRAPH_DAEMON")
    checkout = tmp_path / "checkout"
    for name in ("build/debug/bin/heliographd", "build/release/bin/heliographd", "client/python/hatch_build.py"):
        (checkout / name).parent.mkdir(parents=True)
        (checkout / name).write_text("#!/bin/sh\n")
        (checkout / name).chmod(0o755)
    monkeypatch.chdir(checkout / "client" / "python")
    assert daemons.find_program() == checkout / "build" / "release" / "bin" / "heliographd"
    (checkout / "build" / "release" / "bin" / "heliographd").unlink()
    assert daemons.find_program() == checkout / "build" / "debug" / "bin" / "heliographd"
    monkeypatch.chdir("/")
    with pytest.raises(hg.NotFound):
        daemons.find_program()
    note = types.SimpleNamespace(CHECKOUT=str(checkout))  # of a wheel that was built there
    monkeypatch.setitem(sys.modules, "heliograph._checkout", note)
    assert daemons.find_program() == checkout / "build" / "debug" / "bin" / "heliographd"
    monkeypatch.setenv("PATH", str(pathlib.Path(program).parent))
    assert daemons.find_program() == pathlib.Path(program)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("HELIOGRAPH_DAEMON", program)
    assert daemons.find_program() == pathlib.Path(program)


KILLED = """
import sys, time, heliograph as hg
client = hg.serve(sys.argv[1])
print(client.daemon._process.pid, flush=True)
time.sleep(100)
"""


def test_nothing_outlives_a_process_that_was_killed(program, tmp_path):
    """Neither the daemon nor the folder with its token."""
    process = subprocess.Popen(
        [sys.executable, "-B", "-c", KILLED, program],
        stdout=subprocess.PIPE,
        text=True,
        env=dict(os.environ, TMPDIR=str(tmp_path)),
    )
    group = int(process.stdout.readline())
    assert [path.name for path in tmp_path.glob("heliograph-*/*")] == ["token"]
    os.killpg(group, 0)
    process.kill()
    process.stdout.close()
    process.wait()

    def gone():
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        return False

    eventually(gone)
    assert not list(tmp_path.glob("heliograph-*"))


EXITED = """
import sys, heliograph as hg
client = hg.serve(sys.argv[1])
session = client.session(sys.argv[2], size=(32, 32))
session.wait(samples=1)
print(client.daemon._process.pid, flush=True)
"""


def test_a_program_that_just_ends_leaves_nothing(program):
    done = subprocess.run(
        [sys.executable, "-B", "-c", EXITED, program, str(BOX)], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0 and done.stderr == ""
    with pytest.raises(ProcessLookupError):
        os.killpg(int(done.stdout), 0)


FORKED = """
import gc, os, sys, threading, heliograph as hg
client = hg.serve(sys.argv[1])
session = client.session(sys.argv[2], size=(32, 32), until=hg.Samples(1))
session.wait(samples=1)
child = os.fork()
if child == 0:
    told = []
    for use in (client.info, lambda: session.wait(samples=2), lambda: next(session.frames()),
                lambda: client.render(sys.argv[2], until=hg.Samples(1)), session.image,
                lambda: session.camera.orbit(1), lambda: session.set(seed=2),
                lambda: hg.connect(client.address, token=client.daemon.token)):
        try:
            use()
        except hg.FailedPrecondition as error:
            told.append("fork()" in str(error))
    session.close()
    client.close()
    del session, client
    gc.collect()
    sys.exit(0 if told == [True] * 8 else 9)
status = os.waitpid(child, 0)[1]
assert status == 0, status
assert session.wait(samples=4).stats.samples == 4 and client.daemon.running
client.close()
print("well")
"""


def test_fork_is_refused_in_the_child_and_harmless_in_the_parent(program):
    done = subprocess.run(
        [sys.executable, "-B", "-W", "ignore", "-c", FORKED, program, str(BOX)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout == "well\n", done.stderr


def test_a_forgotten_client_ends_its_daemon(program):
    import gc

    client = hg.serve(program)
    group = client.daemon._process.pid
    session = client.session(BOX, size=(16, 16))
    del client, session
    gc.collect()
    with pytest.raises(ProcessLookupError):
        for _ in range(200):
            os.killpg(group, 0)
            time.sleep(0.05)


def test_info(client):
    info = client.info()
    assert info.version == hg.__version__ and "pt+bdpt" in info.integrators and info.modes[0] == "pt"
    assert set(info.scene_formats) == {"gltf", "glb", "xml"} and info.limits["max_film_side"] == 65536
    assert not info.draining and repr(client).startswith("<heliograph.Client 127.0.0.1:")
