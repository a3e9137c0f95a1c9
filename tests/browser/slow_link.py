"""A TCP relay that lets so many bytes a second through toward the browser, as a tunnel over a slow line does."""
import contextlib
import socket
import threading
import time


class SlowLink:
    """Listens on a free port of loopback and passes connections on to `target` ("HOST:PORT").

    bytes_per_second: of all connections together, from the target; the other way is not paced. 10 ms of it may come at
    once. What waits is bounded by the sockets' own buffers, which are kept small, so that the target feels the pace.
    """

    def __init__(self, target, bytes_per_second):
        host, port = target.rsplit(":", 1)
        self.target = host, int(port)
        self.rate = bytes_per_second
        self.passed = 0
        self.free = 0.0
        self.lock = threading.Lock()
        self.sockets = []
        self.server = socket.create_server(("127.0.0.1", 0))
        self.host = f"127.0.0.1:{self.server.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def stop(self):
        with self.lock:
            ended = [self.server, *self.sockets]
            self.sockets = None
        for each in ended:
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def _accept(self):
        with contextlib.suppress(OSError):  # stop() closes the socket
            while True:
                page, _ = self.server.accept()
                daemon = socket.socket()
                daemon.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 32768)
                page.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 32768)
                with self.lock:
                    if self.sockets is None:
                        return
                    self.sockets += [page, daemon]
                daemon.connect(self.target)
                threading.Thread(target=self._pass, args=(page, daemon, False), daemon=True).start()
                threading.Thread(target=self._pass, args=(daemon, page, True), daemon=True).start()

    def _pass(self, source, sink, paced):
        with contextlib.suppress(OSError):
            while piece := source.recv(8192):
                if paced:
                    time.sleep(self._wait(len(piece)))
                sink.sendall(piece)
        with contextlib.suppress(OSError):
            sink.shutdown(socket.SHUT_WR)

    def _wait(self, size):
        with self.lock:
            now = time.monotonic()
            self.free = max(self.free, now - 0.01) + size / self.rate
            self.passed += size
            return max(0.0, self.free - now)
