"""What exceptions say, from messages and statuses of the daemon."""

import grpc
import pytest

import heliograph as hg
from heliograph import errors


def test_problems_of_a_message():
    text = (
        "view.camera.position: (10000000000000, 0, 0); allowed: finite numbers in [-1e12, 1e12]; view.exposure: 99; "
        "allowed: [-64, 64] stops"
    )
    assert errors.parse_problems(text) == (
        ("view.camera.position", "(10000000000000, 0, 0)", "finite numbers in [-1e12, 1e12]"),
        ("view.exposure", "99", "[-64, 64] stops"),
    )
    assert errors.parse_problems("settings.max_segments: 300; allowed there: [1, 256]; try again in 2 s") == (
        ("settings.max_segments", "300", "[1, 256]"),
    )
    assert errors.parse_problems("settings.light_cache.shrinking: 0.9; allowed: 0.75, or 0 (no longer a choice)")[
        0
    ].allowed == ("0.75, or 0 (no longer a choice)")
    assert errors.parse_problems("the daemon is at war") == ()
    for text, value in (
        ("field: there is no material 'nope'; allowed: 'red'", ""),
        ("box.gltf: the file is empty", ""),
        ("lights[3]: 3; the scene has no lights", "3"),
        ("mode: 'very fast'; allowed: 'pt'", "'very fast'"),
    ):
        assert errors.parse_problems(text)[0].value == value, text


class Failure(grpc.RpcError):
    def __init__(self, status, text="", metadata=()):
        self.status, self.text, self.metadata = status, text, metadata

    def code(self):
        return self.status

    def details(self):
        return self.text

    def trailing_metadata(self):
        return self.metadata


@pytest.mark.parametrize(
    "status, kind, builtin",
    [
        ("INVALID_ARGUMENT", hg.InvalidArgument, ValueError),
        ("NOT_FOUND", hg.NotFound, LookupError),
        ("FAILED_PRECONDITION", hg.FailedPrecondition, Exception),
        ("ABORTED", hg.FailedPrecondition, Exception),
        ("RESOURCE_EXHAUSTED", hg.ResourceExhausted, Exception),
        ("PERMISSION_DENIED", hg.PermissionDenied, Exception),
        ("UNAUTHENTICATED", hg.PermissionDenied, Exception),
        ("UNIMPLEMENTED", hg.Unimplemented, NotImplementedError),
        ("CANCELLED", hg.Cancelled, Exception),
        ("DEADLINE_EXCEEDED", hg.DeadlineExceeded, TimeoutError),
        ("UNAVAILABLE", hg.Unavailable, ConnectionError),
        ("INTERNAL", hg.Internal, Exception),
        ("UNKNOWN", hg.Internal, Exception),
    ],
)
def test_every_status_has_a_type(status, kind, builtin):
    error = errors.from_rpc(Failure(grpc.StatusCode[status], "settings.width: 0; allowed: [1, 9]"), "host:1")
    assert type(error) is kind and isinstance(error, builtin) and isinstance(error, hg.HeliographError)
    assert "size: 0; allowed: [1, 9]" in str(error) and error.retry_after_s is None
    assert str(errors.from_rpc(Failure(grpc.StatusCode[status]), "host:1"))  # never an empty sentence


def test_field_value_and_range():
    error = errors.from_rpc(Failure(grpc.StatusCode.INVALID_ARGUMENT, "settings.width: 0; allowed: [1, 9]"), "host:1")
    assert (error.field, error.value, error.allowed) == ("size", "0", "[1, 9]")
    none = hg.Internal("no field")
    assert (none.field, none.value, none.allowed, none.problems) == ("", "", "", ())


@pytest.mark.parametrize(
    "told, argument",
    [
        ("settings.height", "size"),
        ("settings.adaptive.min_samples", "adaptive.min_samples"),
        ("view.camera.position", "camera.position"),
        ("budget.error", "until"),
        ("begin.time_s", "time"),
        ("begin.environment", "environment"),
        ("format.display_denoiser", "denoiser"),
        ("grace_s", "grace"),
        ("materials[0].name", "materials[0].name"),
    ],
)
def test_fields_are_the_callers_arguments(told, argument):
    failure = Failure(grpc.StatusCode.INVALID_ARGUMENT, f"x: 1; allowed: 2; {told}: 'a b'; allowed: [1, 9]")
    error = errors.from_rpc(failure, "host:1")
    assert error.problems[1] == (argument, "a b", "[1, 9]")
    assert str(error) == f"x: 1; allowed: 2; {argument}: 'a b'; allowed: [1, 9]"


def test_retry_info():
    """google.rpc.Status{code, message, Any{RetryInfo{Duration{2 s, 500000000 ns}}}}, written by hand."""
    duration = b"\x08\x02\x10\x80\xca\xb5\xee\x01"
    info = b"\x0a" + bytes([len(duration)]) + duration
    url = b"type.googleapis.com/google.rpc.RetryInfo"
    detail = b"\x0a" + bytes([len(url)]) + url + b"\x12" + bytes([len(info)]) + info
    status = b"\x08\x08\x12\x04busy\x1a" + bytes([len(detail)]) + detail
    failure = Failure(grpc.StatusCode.RESOURCE_EXHAUSTED, "busy", (("x", "y"), ("grpc-status-details-bin", status)))
    assert errors.from_rpc(failure, "host:1").retry_after_s == 2.5
    for cut in range(len(status)):
        broken = Failure(grpc.StatusCode.RESOURCE_EXHAUSTED, "busy", (("grpc-status-details-bin", status[:cut]),))
        assert errors.from_rpc(broken, "host:1").retry_after_s in (None, 2.0)  # whatever was cut off: no exception
