"""A channel to one daemon, and blocking calls over it."""

from __future__ import annotations

import contextlib
import os
import time
import warnings
import weakref
from typing import Any

import grpc

from .calls import IGNORED_FIELDS, Call, Operation, T, Upload
from .errors import FailedPrecondition, HeliographError, HeliographWarning, Unavailable, from_rpc
from .tls import Tls, explain
from .v1 import render_service_pb2 as service
from .v1 import render_service_pb2_grpc as api
from .wire import add_streams

_LARGEST_MESSAGE = 64 << 20


def channel_options(timeout: float) -> list[tuple[str, Any]]:
    """As the C++ client has them."""
    return [
        ("grpc.initial_reconnect_backoff_ms", 100),
        ("grpc.max_reconnect_backoff_ms", 1000),
        # Despite its name this is how long one attempt may take.
        ("grpc.min_reconnect_backoff_ms", int(min(max(timeout, 0.1), 3600) * 1000)),
        # A proxy for the web must not swallow calls to a daemon on this machine or at the end of a tunnel.
        ("grpc.enable_http_proxy", 0),
        # Two clients never share a connection: one that stops reading must not hold the other back.
        ("grpc.use_local_subchannel_pool", 1),
        ("grpc.max_receive_message_length", _LARGEST_MESSAGE),
    ]


def tell_ignored(metadata: Any, peer: str) -> None:
    for key, value in metadata or ():
        if key == IGNORED_FIELDS:
            warnings.warn(
                f"the daemon at {peer} is older than this package and ignored {value}", HeliographWarning, stacklevel=5
            )


# Channels and calls that were open when the process was forked. The child must neither use nor free them: their
# connections and locks are the parent's.
_live: weakref.WeakSet[Any] = weakref.WeakSet()


def keep_from_children(thing: Any) -> None:
    _live.add(thing)


def _after_fork() -> None:
    left = list(_live)
    if left:
        import ctypes

        for thing in left:
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))  # not even the end of the child frees it


os.register_at_fork(after_in_child=_after_fork)
_first_process: int | None = None  # that opened a channel: gRPC's threads are its


def check_process() -> None:
    """FailedPrecondition in a child of a process that has used gRPC, where calls would hang."""
    global _first_process
    if _first_process is None:
        _first_process = os.getpid()
    elif _first_process != os.getpid():
        raise FailedPrecondition(
            "gRPC does not survive fork(): this process is a child of one that was connected already. "
            "Start workers by 'spawn' or 'forkserver' (multiprocessing.set_start_method), or connect "
            "in the children alone",
            problems=(),
        )


class Connection:
    """Thread safe. Its channel is closed by close(), or when nothing refers to it any more."""

    def __init__(self, address: str, token: str, timeout: float, tls: Tls | None = None) -> None:
        check_process()
        self.peer = address
        self.tls = tls
        self.timeout = timeout
        self.metadata = (("authorization", f"Bearer {token}"),) if token else ()
        options = channel_options(timeout)
        self.channel = (
            grpc.insecure_channel(address, options)
            if tls is None
            else grpc.secure_channel(address, tls.credentials(), options + tls.options())
        )
        self.stub: Any = api.RenderServiceStub(self.channel)  # type: ignore[no-untyped-call]
        add_streams(self.stub, self.channel)
        self._process = os.getpid()
        self._finalizer = weakref.finalize(self, _close_channel, self.channel, self._process)
        keep_from_children(self)

    @property
    def is_own(self) -> bool:
        """Made by this process, and not by the one that it was forked from."""
        return os.getpid() == self._process

    def check_process(self) -> None:
        """FailedPrecondition: made by the process that this one was forked from."""
        if not self.is_own:
            raise FailedPrecondition(
                "this client was made in the parent process, and gRPC does not survive fork(); connect "
                "in a process that was started by 'spawn'",
                problems=(),
            )

    def check(self) -> None:
        """As above, and closed."""
        self.check_process()
        if not self._finalizer.alive:
            raise FailedPrecondition("this client is closed", problems=())

    def close(self) -> None:
        self._finalizer()

    def call(self, call: Call, timeout: float | None = None, wait: bool = False) -> Any:
        """The answer. Ctrl-C cancels the call."""
        self.check()
        if timeout is None and call.quick:
            timeout = self.timeout
        future = getattr(self.stub, call.method).future(
            iter(call.request) if isinstance(call.request, Upload) else call.request,
            timeout=timeout,
            metadata=self.metadata,
            wait_for_ready=wait,
        )
        keep_from_children(future)
        try:
            answer = future.result()
        except grpc.RpcError as error:
            raise _cause(call, error, self.peer) from None
        except grpc.FutureCancelledError:
            raise Unavailable(f"the connection to {self.peer} was closed", problems=()) from None
        except BaseException:
            future.cancel()
            raise
        tell_ignored(future.trailing_metadata(), self.peer)
        return answer

    def run(self, operation: Operation[T]) -> T:
        try:
            call = next(operation)
            while True:
                try:
                    answer = self.call(call)
                except HeliographError as error:
                    call = operation.throw(error)
                else:
                    call = operation.send(answer)
        except StopIteration as done:
            result: T = done.value
            return result

    def open(self, method: str, request: Any, timeout: float | None = None) -> Any:
        """A call with a stream of answers. timeout: seconds for all of them."""
        self.check()
        call = getattr(self.stub, method)(request, timeout=timeout, metadata=self.metadata)
        keep_from_children(call)
        return call

    def reach(self, seconds: float) -> None:
        """Waits until the daemon answers again, or so long; the next call tells which.

        Calls that fail at once let gRPC get no further with a new connection: without a call that waits, nobody polls
        it but a timer of 5 s.
        """
        if seconds > 0:
            with contextlib.suppress(HeliographError):
                self.call(Call("GetServerInfo", service.GetServerInfoRequest()), seconds, True)

    def greet(self, wait: float) -> service.GetServerInfoResponse:
        """The first call: whether a daemon answers at all, and takes the token. wait: seconds to keep trying."""
        call = Call("GetServerInfo", service.GetServerInfoRequest())
        end = time.monotonic() + wait
        while True:
            try:
                info: service.GetServerInfoResponse = self.call(
                    call, max(wait, 0.1) if wait else self.timeout, wait > 0
                )
                return info
            except HeliographError as error:
                if isinstance(error, Unavailable) and time.monotonic() < end:
                    time.sleep(0.05)  # it is starting, and refused once more
                    continue
                raise explain(unreachable(error, self.peer), self.peer, self.tls) from None


def unreachable(error: HeliographError, peer: str) -> HeliographError:
    """Of the first call to a daemon."""
    if isinstance(error, (Unavailable, TimeoutError)):
        return Unavailable(f"no daemon answers at {peer} ({error})", problems=())
    return error


def _cause(call: Call, error: grpc.RpcError, peer: str) -> BaseException:
    if isinstance(call.request, Upload) and call.request.error is not None:
        return call.request.error
    return from_rpc(error, peer)


def _close_channel(channel: grpc.Channel, process: int) -> None:
    if os.getpid() == process:
        channel.close()
