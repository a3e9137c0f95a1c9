"""heliograph.tev against a receiver of our own, written from the description of the packets."""
import contextlib
import gc
import logging
import os
import select
import socket
import struct
import subprocess
import sys
import threading
import time
import types

import numpy as np
import pytest
import heliograph
from heliograph import tev

FLOATS_OF = {4: 4, 5: 0, 6: 0, 18: 4}  # commands of vector graphics that are expected: how many floats follow


class Receiver:
    """Takes packets on a socket and puts images together; refuses what departs from the description."""

    def __init__(self, port=0, path=None, receive_buffer=None):
        self.listener = socket.socket(socket.AF_UNIX if path else socket.AF_INET)
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if receive_buffer:
            self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.listener.bind(path or ("127.0.0.1", port))
        self.listener.listen(8)
        self.port = 0 if path else self.listener.getsockname()[1]
        self.address = f"unix:{path}" if path else f"127.0.0.1:{self.port}"
        self.images, self.errors, self.grabbed = {}, [], []
        self.connections = 0
        self.reading, self.stopping = True, False
        self.open = {}
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        while not self.stopping:
            ready, _, _ = select.select([self.listener, *(self.open if self.reading else [])], [], [], 0.01)
            for sock in ready:
                if sock is self.listener:
                    self.open[sock.accept()[0]] = bytearray()
                    self.connections += 1
                    continue
                data = b""
                with contextlib.suppress(OSError):
                    data = sock.recv(1 << 20)
                if not data:
                    self.open.pop(sock)
                    sock.close()
                    continue
                self.open[sock] += data
                self.take_packets(self.open[sock])
        for sock in [self.listener, *self.open]:
            sock.close()

    def take_packets(self, pending):
        while len(pending) >= 4 and len(pending) >= (length := struct.unpack_from("<I", pending)[0]):
            packet = bytes(pending[:length])
            del pending[:length]
            try:
                self.take(packet)
            except Exception as problem:
                self.errors.append(f"{type(problem).__name__}: {problem}")

    def take(self, packet):
        at = 4

        def number(form):
            nonlocal at
            (value,) = struct.unpack_from("<" + form, packet, at)
            at += struct.calcsize("<" + form)
            return value

        def text():
            nonlocal at
            end = packet.index(0, at)
            value = packet[at:end].decode()
            at = end + 1
            return value

        kind = number("b")
        grab = number("b") if kind != 2 else 0
        assert grab in (0, 1)
        name = text()
        if kind == 4:
            width, height, count = number("i"), number("i"), number("i")
            channels = [text() for _ in range(count)]
            assert not any(channel[0].isdigit() for channel in channels), channels
            planes = {channel: np.full((height, width), np.nan, np.float32) for channel in channels}
            self.images[name] = {"planes": planes, "drawn": [], "updates": 0}
            if grab:
                self.grabbed.append(name)
        elif kind == 6:
            channels = [text() for _ in range(number("i"))]
            x, y, width, height = (number("i") for _ in range(4))
            offsets = [number("q") for _ in channels]
            strides = [number("q") for _ in channels]
            count = max(o + (width * height - 1) * s + 1 for o, s in zip(offsets, strides))
            assert len(packet) == at + 4 * count, (len(packet), at, count)
            data = np.frombuffer(packet, "<f4", count, at)
            at = len(packet)
            for channel, offset, stride in zip(channels, offsets, strides):
                plane = self.images[name]["planes"][channel]
                assert 0 <= x and x + width <= plane.shape[1] and 0 <= y and y + height <= plane.shape[0]
                pixels = data[offset + stride * np.arange(width * height)]
                plane[y:y + height, x:x + width] = pixels.reshape(height, width)
            self.images[name]["updates"] += 1
        elif kind == 8:
            assert number("b") == 0  # never appends
            drawn = []
            for _ in range(number("i")):
                command = number("b")
                drawn.append((command, [number("f") for _ in range(FLOATS_OF[command])]))
            self.images[name]["drawn"] = drawn
        else:
            raise AssertionError(f"type {kind}")
        assert at == len(packet), (at, len(packet))

    def stop(self):
        self.stopping = True
        self.thread.join()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        assert self.errors == []


def eventually(condition, seconds=20):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        with contextlib.suppress(KeyError):
            if condition():
                return
        time.sleep(0.01)
    assert condition()


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


def warnings_of(caplog):
    return [record.getMessage() for record in caplog.records if record.name == "heliograph.tev"]


QUICK = {"interval": 0.03, "retry": 0.1, "connect": 1.0, "blocked": 0.3}
SHAPE = (24, 40)


def counted(seed=0):
    return np.random.default_rng(seed).random(SHAPE, dtype=np.float32)


def test_a_picture_arrives_bit_for_bit():
    rgb, sigma, display = (np.random.default_rng(i).random((*SHAPE, 3), dtype=np.float32) for i in range(3))
    rgb[0, 0] = np.nan, np.inf, -1
    picture = types.SimpleNamespace(rgb=rgb, sigma=sigma, samples=counted(7), display=display)
    with Receiver() as receiver:
        name = tev.show_in_tev(picture, "box", receiver.address)
        assert name == "box"
        eventually(lambda: receiver.images["box"]["updates"] == 1)
        planes = receiver.images["box"]["planes"]
        assert list(planes) == ["R", "G", "B", "display.R", "display.G", "display.B", "error", "samples"]
        for i, channel in enumerate("RGB"):
            np.testing.assert_array_equal(planes[channel], rgb[..., i])
            np.testing.assert_array_equal(planes["display." + channel], display[..., i])
        np.testing.assert_allclose(planes["error"], np.sqrt((sigma**2).mean(axis=-1)), rtol=1e-6)
        np.testing.assert_array_equal(planes["samples"], picture.samples)
        assert receiver.grabbed == ["box"]


def test_arrays_of_every_shape_and_pictures_of_several_packets(tmp_path):
    path = str(tmp_path / "tev")
    with Receiver(path=path) as receiver:
        grey, colour = np.float64([[1, 2], [3, 4]]), np.ones((3, 5, 4), np.float16)
        large = np.random.default_rng(1).random((1500, 1000, 3), dtype=np.float32)  # 18 MB
        names = [tev.show_in_tev(image, address=f"unix:{path}") for image in (grey, colour, large)]
        assert len(set(names)) == 3
        eventually(lambda: receiver.images[names[2]]["updates"] >= 3)
        np.testing.assert_array_equal(receiver.images[names[0]]["planes"]["Y"], [[1, 2], [3, 4]])
        assert list(receiver.images[names[1]]["planes"]) == ["R", "G", "B", "A"]
        eventually(lambda: not np.isnan(receiver.images[names[2]]["planes"]["B"]).any())
        for i, channel in enumerate("RGB"):
            np.testing.assert_array_equal(receiver.images[names[2]]["planes"][channel], large[..., i])


def test_a_picture_that_nobody_takes_is_an_error():
    address = f"127.0.0.1:{free_port()}"
    with pytest.raises(tev.TevUnreachable, match=f"tev at {address} does not take the picture: Connection refused"):
        tev.show_in_tev(counted(), address=address)
    with Receiver(receive_buffer=1 << 16) as receiver:
        receiver.reading = False
        begun = time.monotonic()
        with pytest.raises(tev.TevUnreachable, match="read nothing in time"):
            tev.show_in_tev(np.zeros((2000, 2000, 3), np.float32), address=receiver.address, timeout=0.5)
        assert time.monotonic() - begun < 3


@pytest.mark.parametrize("address", ["nowhere", "127.0.0.1", "127.0.0.1:0", "h:65536", "::1:5", "unix:", "h:\u0661",
                                     "unix:" + 108 * "a"])
def test_addresses_of_another_form_are_refused(address):
    for call in (tev.TevSender, lambda address: tev.show_in_tev(counted(), address=address)):
        with pytest.raises(ValueError, match="is not HOST:PORT with a port in"):
            call(address)
    with pytest.raises(ValueError, match="cannot be found"):
        tev.TevSender("no-such-host.invalid:14158")


def test_pictures_of_another_form_are_refused():
    for image in (np.zeros(3), np.zeros((2, 2, 2)), types.SimpleNamespace(),
                  types.SimpleNamespace(rgb=np.zeros((2, 2))),
                  types.SimpleNamespace(rgb=np.zeros((2, 2, 3)), samples=np.zeros((3, 2)))):
        with pytest.raises(ValueError, match="image"):
            tev.show_in_tev(image)
    with tev.TevSender(f"127.0.0.1:{free_port()}", **QUICK) as sender:
        with pytest.raises(ValueError, match="before begin"):
            sender.update(0, 0, {"R": counted()})
        for name, width, height, channels, problem in (
                ("", 1, 1, ["R"], "name"), ("a", 0, 1, ["R"], "width: 0"), ("a", 1, 1 << 21, ["R"], "height"),
                ("a", 1, 1, [], "channels: 0"), ("a", 1, 1, ["1st"], "begins with a digit"),
                ("a", 1, 1, ["R", "R"], "same")):
            with pytest.raises(ValueError, match=problem):
                sender.begin(name, width, height, channels)
        sender.begin("a", 40, 24, ["R", "G"])
        for x, planes, problem in ((1, {"R": counted()}, "does not lie"), (0, {"B": counted()}, "none of the channels"),
                                   (0, {"R": counted(), "G": counted()[1:]}, "one shape"), (0, {}, "planes")):
            with pytest.raises(ValueError, match=problem):
                sender.update(x, 0, planes)
    with pytest.raises(ValueError, match="interval: 0"):
        tev.TevSender(interval=0)


def test_the_newest_tiles_arrive_with_the_borders_of_the_last_update(caplog):
    with Receiver() as receiver, tev.TevSender(receiver.address, **QUICK) as sender:
        sender.begin("box", 40, 24, ["R", "samples"])
        pixels = counted(1)
        left = pixels[:, :20].copy()
        sender.update(0, 0, {"R": left, "samples": np.full((24, 20), 8)})
        left[:] = -1  # the sender has its own
        sender.update(20, 0, {"R": pixels[:, 20:]})
        eventually(lambda: np.array_equal(receiver.images["box"]["planes"]["R"], pixels))
        planes = receiver.images["box"]["planes"]
        assert (planes["samples"][:, :20] == 8).all() and np.isnan(planes["samples"][:, 20:]).all()
        sender.update(20, 0, {"R": pixels[:, 20:] + 1})
        eventually(lambda: receiver.images["box"]["drawn"][1:2] == [(18, [20, 0, 20, 24])]
                   and len(receiver.images["box"]["drawn"]) == 4)
        sender.finish()
        eventually(lambda: receiver.images["box"]["drawn"] == [])
        np.testing.assert_array_equal(planes["R"][:, 20:], pixels[:, 20:] + 1)
        assert sender.report.warning is None and sender.report.tiles == 3
        assert warnings_of(caplog) == []


def test_updates_are_as_many_as_allowed_and_older_states_are_skipped():
    with Receiver() as receiver, tev.TevSender(receiver.address, interval=0.1) as sender:
        sender.begin("box", 40, 24, ["R"])
        begun, value = time.monotonic(), 0
        while time.monotonic() < begun + 0.8:
            value += 1
            sender.update(0, 0, {"R": np.full(SHAPE, value)})
            time.sleep(0.002)
        spent = time.monotonic() - begun
        sender.finish()
        eventually(lambda: (receiver.images["box"]["planes"]["R"] == value).all())
        assert 3 <= sender.report.updates <= 2 + spent / 0.1 < value


def test_no_more_than_a_picture_is_kept():
    sender = tev.TevSender(f"127.0.0.1:{free_port()}", **QUICK)
    sender.begin("box", 64, 32, ["R"])
    for i in range(300):
        sender.update(i % 49, i % 25, {"R": np.zeros((8, 16))})
    assert sum(pixels.size for pixels, _ in sender._state.tiles.values()) <= 64 * 32
    sender.finish()


def test_a_viewer_that_comes_late_and_goes_gets_all_of_it(caplog):
    port = free_port()
    with tev.TevSender(f"127.0.0.1:{port}", **QUICK) as sender:
        sender.begin("box", 40, 24, ["R"])
        pixels = counted(3)
        sender.update(0, 0, {"R": pixels})
        eventually(lambda: len(warnings_of(caplog)) == 1)
        assert f"tev at 127.0.0.1:{port} does not answer (Connection refused)" in warnings_of(caplog)[0]
        for _ in range(2):
            with Receiver(port) as receiver:
                eventually(lambda: np.array_equal(receiver.images["box"]["planes"]["R"], pixels))
    assert len(warnings_of(caplog)) == 1
    assert sender.report.warning == warnings_of(caplog)[0]


def test_a_viewer_that_reads_nothing_holds_nobody_back(caplog):
    with Receiver(receive_buffer=1 << 16) as receiver:
        receiver.reading = False
        sender = tev.TevSender(receiver.address, **QUICK)
        sender.begin("box", 2000, 1000, ["R", "G"])
        value = 0
        while not warnings_of(caplog):
            value += 1
            begun = time.monotonic()
            sender.update(0, 0, {"R": np.full((1000, 2000), value, np.float32)})
            assert time.monotonic() - begun < 1
            time.sleep(0.01)
        assert "has read nothing for 0.3 s" in warnings_of(caplog)[0]
        begun = time.monotonic()
        sender.finish(timeout=0.5)
        assert time.monotonic() - begun < 1.5
        assert not sender._state.thread.is_alive()
        # Another one, that reads in the end.
        sender = tev.TevSender(receiver.address, **QUICK)
        sender.begin("other", 2000, 1000, ["R", "G"])
        sender.update(0, 0, {"R": np.full((1000, 2000), 5, np.float32)})
        receiver.reading = True
        sender.finish(timeout=20)
        eventually(lambda: (receiver.images["other"]["planes"]["R"] == 5).all())
        assert receiver.images["box"]["updates"] < value


def tev_threads():
    return [thread for thread in threading.enumerate() if thread.name == "tev"]


def test_no_thread_is_left_by_objects_that_are_forgotten():
    eventually(lambda: not tev_threads())
    with Receiver() as receiver:
        sender = tev.TevSender(receiver.address, **QUICK)
        sender.begin("box", 40, 24, ["R"])
        sender.update(0, 0, {"R": counted()})
        assert tev_threads()
        del sender
        gc.collect()
        eventually(lambda: not tev_threads())
        eventually(lambda: np.array_equal(receiver.images["box"]["planes"]["R"], counted()))


def test_a_forked_child_leaves_the_connection_alone():
    # In a program of its own: what other tests have open of gRPC may keep this process from forking.
    script = """
import os, sys, numpy
from heliograph import tev
def value(v):
    return {"R": numpy.full((24, 40), v)}
with tev.TevSender(sys.argv[1], interval=0.03) as sender:
    sender.begin("box", 40, 24, ["R"])
    sender.update(0, 0, value(1))
    input()  # until it has arrived
    child = os.fork()
    if child == 0:
        try:
            sender.begin("box", 40, 24, ["R"])
            sender.update(0, 0, value(2))  # has no effect
            os._exit(0)
        except BaseException:
            os._exit(1)
    assert os.waitpid(child, 0)[1] == 0
    sender.update(0, 0, value(3))
"""
    environment = os.environ | {"PYTHONPATH": os.path.dirname(os.path.dirname(tev.__file__))}
    with Receiver() as receiver:
        program = subprocess.Popen([sys.executable, "-c", script, receiver.address], env=environment, text=True,
                                   stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            eventually(lambda: "box" in receiver.images and (receiver.images["box"]["planes"]["R"] == 1).all())
            _, told = program.communicate("\n", timeout=60)
        finally:
            program.kill()
        assert program.returncode == 0 and told == ""
        eventually(lambda: (receiver.images["box"]["planes"]["R"] == 3).all())
        assert receiver.connections == 1


def test_the_end_of_the_program_sends_what_is_left():
    script = """
import sys, numpy
from heliograph import tev
sender = tev.TevSender(sys.argv[1])
sender.begin("last", 40, 24, ["R"])
sender.update(0, 0, {"R": numpy.full((24, 40), 9)})
"""
    folder = os.path.dirname(os.path.dirname(tev.__file__))
    environment = os.environ | {"PYTHONPATH": folder}
    with Receiver() as receiver:
        begun = time.monotonic()
        subprocess.run([sys.executable, "-c", script, receiver.address], env=environment, check=True, timeout=60)
        eventually(lambda: (receiver.images["last"]["planes"]["R"] == 9).all())
    told = subprocess.run([sys.executable, "-c", script, f"127.0.0.1:{free_port()}"], env=environment, check=True,
                          timeout=60, capture_output=True, text=True)
    assert told.stderr.count("\n") == 1 and "does not answer" in told.stderr
    assert time.monotonic() - begun < 30


def test_the_logger_is_the_documented_one():
    assert tev._log is logging.getLogger("heliograph.tev")


def live_threads():
    return [thread for thread in threading.enumerate() if thread.name in ("tev", "heliograph-tev")]


def test_a_session_shows_its_newest_state(box):
    eventually(lambda: not live_threads())
    with Receiver() as receiver:
        with box.session(size=(96, 64), until=heliograph.Samples(8), seed=2, channels="display") as session:
            first = session.wait()
            shown = session.show_in_tev(address=receiver.address)
            assert shown.name == f"heliograph session {session.id[:8]}"

            def is_there(image):
                planes = receiver.images[shown.name]["planes"]
                error = np.sqrt(np.mean(image.sigma**2, axis=-1))
                same = all(np.array_equal(planes[name], image.rgb[..., at]) for at, name in enumerate("RGB"))
                same = same and np.array_equal(planes["samples"], image.samples)
                return same and np.allclose(planes["error"], error, rtol=1e-5)

            eventually(lambda: is_there(first))
            planes = receiver.images[shown.name]["planes"]
            assert list(planes) == ["R", "G", "B", "display.R", "display.G", "display.B", "error", "samples"]
            session.camera.orbit(20)
            second = session.wait()
            eventually(lambda: is_there(second))
            assert len(receiver.images) == 1 and shown.report.warning is None
            shown.close()
            shown.close()
            eventually(lambda: not live_threads())
            session.camera.orbit(20)
            session.wait()
            assert is_there(second)
            session.show_in_tev("other", address=receiver.address)
            session.set(size=(40, 24))
            last = session.wait()
            eventually(lambda: np.array_equal(receiver.images["other"]["planes"]["G"], last.rgb[..., 1]))
            for bad in (dict(address="nowhere"), dict(name="")):
                with pytest.raises(heliograph.InvalidArgument):
                    session.show_in_tev(**bad)
        eventually(lambda: not live_threads())  # ended with the session
        with pytest.raises(heliograph.FailedPrecondition):
            session.show_in_tev()


def test_a_picture_of_the_package_shows_itself(box):
    image = box.render(size=(48, 32), until=heliograph.Samples(2), channels="display")
    with Receiver() as receiver:
        name = image.show_in_tev("box", address=receiver.address)
        assert name == "box"
        eventually(lambda: "box" in receiver.images)
        planes = receiver.images["box"]["planes"]
        eventually(lambda: np.array_equal(planes["samples"], image.samples))
        for index, channel in enumerate("RGB"):
            assert np.array_equal(planes[channel], image.rgb[..., index])
            assert np.array_equal(planes[f"display.{channel}"], image.display[..., index])
        assert np.allclose(planes["error"], np.sqrt(np.mean(image.sigma**2, axis=-1)), rtol=1e-6)
    with pytest.raises(heliograph.Unavailable, match="Connection refused"):
        image.show_in_tev(address=f"127.0.0.1:{free_port()}")
    with pytest.raises(heliograph.InvalidArgument):
        image.show_in_tev(address="nowhere")
