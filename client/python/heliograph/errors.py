"""Exceptions: each tells field, value and allowed range where the daemon or a check in this package names them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import grpc

if TYPE_CHECKING:
    from .comparison import Comparison


class Problem(NamedTuple):
    """One offending field."""

    field: str  # the argument, setting or part of it, such as "size", "adaptive.min_samples", "materials['red']"
    value: str  # as it was found, without quotes; empty where the message has a sentence instead
    allowed: str  # range or choices; empty where the message gives none


class HeliographError(Exception):
    """Base of all exceptions of this package. str() is a sentence for a person.

    problems: every offending field. field, value, allowed: those of the first, empty where no field is to blame.
    retry_after_s: seconds after which the same request may succeed; None: waiting does not help.
    comparison: the units that compare() had received before the error, for resume=; None: none, or another call.
    """

    comparison: Comparison | None = None

    def __init__(
        self, message: str, *, problems: tuple[Problem, ...] | None = None, retry_after_s: float | None = None
    ) -> None:
        super().__init__(message)
        self.message = message
        found = parse_problems(message) if problems is None else problems
        self.problems = tuple(problem._replace(value=_unquoted(problem.value)) for problem in found)
        self.retry_after_s = retry_after_s

    def __str__(self) -> str:
        return self.message

    def again(self) -> HeliographError:
        """The same error to be raised once more: an exception that is raised again grows its traceback."""
        return type(self)(self.message, problems=self.problems, retry_after_s=self.retry_after_s)

    @property
    def field(self) -> str:
        """The argument, setting or path in the file that is to blame; empty: none."""
        return self.problems[0].field if self.problems else ""

    @property
    def value(self) -> str:
        """What it was, as text without quotes; empty where the message has a sentence instead."""
        return self.problems[0].value if self.problems else ""

    @property
    def allowed(self) -> str:
        """Range or choices; empty where the message gives none."""
        return self.problems[0].allowed if self.problems else ""


class InvalidArgument(HeliographError, ValueError):
    """An argument or a scene file is wrong; the message names every problem, its value and what is allowed."""


class NotFound(HeliographError, LookupError):
    """No such scene, session, job, file or program."""


class MissingChannel(NotFound, KeyError, AttributeError):
    """The picture has no such channel; the message says how to ask for it. hasattr(image, "depth") is False then."""


class FailedPrecondition(HeliographError):
    """The request is well formed, but the state forbids it: a scene in use, a session that another client took over,
    an object that is closed or was made in another process."""


class ResourceExhausted(HeliographError):
    """A limit of the daemon, named with its value; retry_after_s says whether waiting helps."""


class PermissionDenied(HeliographError):
    """A path outside the daemon's scene roots, a token that it does not know, or one whose role is too little."""


class Unimplemented(HeliographError, NotImplementedError):
    """The scene requires an extension, or the request a feature, that the daemon or this package does not have."""


class MissingPackage(HeliographError, ImportError):
    """A package of Python that this one needs for what was asked; the message says how to install it."""


class Cancelled(HeliographError):
    """The call, job or session was cancelled."""


class Unavailable(HeliographError, ConnectionError):
    """The daemon cannot be reached, drains or went away."""


class DeadlineExceeded(HeliographError, TimeoutError):
    """A timeout of this client, or of the daemon for a message that it waited for."""


class RenderFailed(HeliographError):
    """The daemon ended a picture as failed; the message says why."""


class Internal(HeliographError):
    """A fault of the daemon or of this package."""


class BrokenTile(Internal):
    """A tile that does not pass its checks: checksum, window, revision, format. It never reaches a picture."""


class HeliographWarning(UserWarning):
    """What a person should know although the call went on: ignored fields, doubtful scene files, a daemon that
    drains."""


_BY_STATUS: dict[str, type[HeliographError]] = {
    "INVALID_ARGUMENT": InvalidArgument,
    "OUT_OF_RANGE": InvalidArgument,
    "NOT_FOUND": NotFound,
    "FAILED_PRECONDITION": FailedPrecondition,
    "ALREADY_EXISTS": FailedPrecondition,
    "ABORTED": FailedPrecondition,
    "RESOURCE_EXHAUSTED": ResourceExhausted,
    "PERMISSION_DENIED": PermissionDenied,
    "UNAUTHENTICATED": PermissionDenied,
    "UNIMPLEMENTED": Unimplemented,
    "CANCELLED": Cancelled,
    "DEADLINE_EXCEEDED": DeadlineExceeded,
    "UNAVAILABLE": Unavailable,
}

# Fields of requests, and the arguments that they come from.
_ARGUMENTS = [
    (re.compile(pattern), argument)
    for pattern, argument in (
        (r"settings\.(?:width|height)", "size"),
        (r"(?:open\.)?format\.display_denoiser", "denoiser"),
        (r"(?:settings|(?:open\.)?format)\.", ""),
        (r"budget(?:\.\w+)?", "until"),
        (r"begin\.time_s", "time"),
        (r"begin\.main_file", "path"),
        (r"(?:begin|view)\.", ""),
        (r"grace_s", "grace"),
        (r"output\.path", "output"),
        (r"output\.", ""),
    )
]
# "a.b[2]: VALUE; allowed: RANGE; c: VALUE ..."
_NEXT_FIELD = re.compile(r"; (?!allowed\b)(?=[a-z_][\w.\[\]]*: )")
_ONE_FIELD = re.compile(r"([a-z_][\w.\[\]]*): (.*?)(?:; allowed[^:;]*: (.*))?", re.DOTALL)
_FIELD = re.compile(r"(^|; )(?!allowed\b)([a-z_][\w.\[\]]*): ")
# A value, perhaps with a remark; anything else is a sentence.
_LITERAL = re.compile(r"""('[^']*'|"[^"]*"|\([^()]*\)|\[[^\[\]]*\]|-?[\d.][^; ]*|[^\s;]+)(?:;.*)?""", re.DOTALL)
_RETRY_TEXT = re.compile(r"; try again in [\d.e+-]+ s$")


def parse_problems(message: str) -> tuple[Problem, ...]:
    """The fields that a message of the daemon names; empty where it names none."""
    found = []
    for part in _NEXT_FIELD.split(_RETRY_TEXT.sub("", message)):
        match = _ONE_FIELD.fullmatch(part)
        if match:
            literal = _LITERAL.fullmatch(match[2])
            found.append(Problem(match[1], literal[1] if literal else "", match[3] or ""))
    return tuple(found)


def _unquoted(value: str) -> str:
    quoted = len(value) >= 2 and value[0] == value[-1] and value[0] in "'\"" and value[0] not in value[1:-1]
    return value[1:-1] if quoted else value


def renamed(message: str, name: Callable[[str], str]) -> str:
    """A message of the daemon, each of whose fields got the name that name() answers."""

    def replace(match: re.Match[str]) -> str:
        return match[1] + name(match[2]) + ": "

    return _FIELD.sub(replace, message)


def with_fields_renamed(error: HeliographError, name: Callable[[str], str]) -> HeliographError:
    """The error with each of its fields under the name that name() answers. What then is there twice is told once."""
    parts = dict.fromkeys(renamed(part, name) for part in _NEXT_FIELD.split(error.message))
    problems = dict.fromkeys(problem._replace(field=name(problem.field)) for problem in error.problems)
    return type(error)("; ".join(parts), problems=tuple(problems), retry_after_s=error.retry_after_s)


def argument_of(field: str) -> str:
    """Of settings.width "size": the argument of this package that became a field of a request."""
    field = field.removeprefix("job.")  # of SubmitJob, which holds a request of RunJob
    for pattern, argument in _ARGUMENTS:
        match = pattern.match(field)
        if match:
            return argument + field[match.end() :]
    return field


def invalid(field: str, value: object, allowed: str) -> InvalidArgument:
    """InvalidArgument about one argument."""
    shown = value if isinstance(value, str) and not value.isspace() and value else repr(value)
    return invalid_all([Problem(field, str(shown), allowed)])


def invalid_all(problems: list[Problem]) -> InvalidArgument:
    """InvalidArgument about several arguments at once."""
    return InvalidArgument(
        "; ".join(f"{p.field}: {p.value}; allowed: {p.allowed}" for p in problems), problems=tuple(problems)
    )


def _fields(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Numbers and bytes of the length-delimited fields of a protobuf message; ValueError where it is broken."""
    at = 0

    def varint() -> int:
        nonlocal at
        value = shift = 0
        while True:
            if at >= len(data) or shift > 63:
                raise ValueError("cut off")
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    while at < len(data):
        key = varint()
        if key & 7 == 0:
            varint()
        elif key & 7 == 2:
            length = varint()
            if at + length > len(data):
                raise ValueError("cut off")
            yield key >> 3, data[at : at + length]
            at += length
        else:
            raise ValueError("unexpected wire type")


def _retry_after(details: bytes) -> float | None:
    """Seconds of the google.rpc.RetryInfo in a google.rpc.Status. No dependency brings the classes of these two."""
    from google.protobuf import any_pb2, duration_pb2
    from google.protobuf.message import DecodeError

    try:
        for number, value in _fields(details):
            if number != 3:
                continue
            detail = any_pb2.Any.FromString(value)
            if detail.type_url.endswith("/google.rpc.RetryInfo"):
                for inner, delay in _fields(detail.value):
                    if inner == 1:
                        duration = duration_pb2.Duration.FromString(delay)
                        return float(duration.seconds + duration.nanos * 1e-9)
    except (ValueError, DecodeError):
        pass  # the message has it in words
    return None


def from_rpc(error: grpc.RpcError, peer: str) -> HeliographError:
    """What a failed call means. `peer` is the daemon's address."""
    status = error.code().name
    text = renamed(error.details() or "", argument_of)
    kind = _BY_STATUS.get(status, Internal)
    retry_after_s = None
    for key, value in _metadata(error):
        if key == "grpc-status-details-bin":
            retry_after_s = _retry_after(value)
    if status == "RESOURCE_EXHAUSTED" and "RST_STREAM with error code 11" in text:
        # gRPC's server resets a stream with ENHANCE_YOUR_CALM (RFC 9113, section 7) when its memory quota is reached.
        text = f"the daemon at {peer} has no memory left for the messages of this call (its --max-rpc-memory)"
    elif status == "UNIMPLEMENTED" and not text:
        text = f"the daemon at {peer} does not know this call"
    elif status == "CANCELLED":
        text = text or "cancelled"
    elif status == "DEADLINE_EXCEEDED" and text in ("", "Deadline Exceeded"):  # gRPC's own words
        text = f"the daemon at {peer} did not answer in time"
    elif status == "UNAVAILABLE":
        text = f"the daemon at {peer} is not available: {text}"
    elif status == "UNAUTHENTICATED":
        text = f"the daemon at {peer} wants a token (token=, token_file=): {text}"
    return kind(text or f"the call failed ({status}) without a reason", retry_after_s=retry_after_s)


def _metadata(error: grpc.RpcError) -> list[tuple[str, Any]]:
    try:
        pairs: Any = error.trailing_metadata()
        return [(key, value) for key, value in pairs or ()]
    except Exception:  # an error that was made without any
        return []
