"""What a client can ask of a daemon with calls that have one answer: generators of calls (heliograph.calls)."""

from __future__ import annotations

import hashlib
import os
import pathlib
from collections.abc import Iterator, Sequence
from typing import Any

from .calls import Call, Operation, Upload
from .comparison.references import LoadedReference, ReferenceFile
from .edits import Changes, argument_of, make_edits
from .errors import (
    HeliographError,
    Internal,
    InvalidArgument,
    NotFound,
    ResourceExhausted,
    Unimplemented,
    invalid,
    with_fields_renamed,
)
from .kept_jobs import JobInfo, check_job_id, make_job_info, read_priority
from .scene import Details, Light, Material, Object, SceneValues, ServerInfo, make_server_info, vector_of
from .scene_files import LocalScene, SceneFile, collect, environment_text, names_map
from .settings import read_number
from .v1 import compare_pb2 as comparisons
from .v1 import durable_job_pb2 as kept
from .v1 import job_pb2 as jobs
from .v1 import render_service_pb2 as service
from .v1 import replay_pb2 as replay_messages

_CHUNK = 1 << 20  # the protocol's largest


def server_info() -> Operation[ServerInfo]:
    return make_server_info((yield Call("GetServerInfo", service.GetServerInfoRequest())))


def load(
    path: str | os.PathLike[str],
    environment: str | os.PathLike[str] | Sequence[float] | None,
    on_server: bool,
    time: float,
    animation: str,
    strict: bool,
) -> Operation[tuple[service.SceneInfo, service.LoadSceneResponse]]:
    if not isinstance(path, (str, os.PathLike)):
        raise invalid("path", path, "a file's path")
    if isinstance(animation, bool) or not isinstance(animation, (str, int)):
        raise invalid("animation", animation, "name or number of a clip, or empty")
    for name, flag in (("strict", strict), ("on_server", on_server)):
        if not isinstance(flag, (bool, int)):
            raise invalid(name, flag, "True or False")
    begin = service.LoadSceneRequest.Begin(
        time_s=read_number("time", time), animation=str(animation), strict=bool(strict)
    )
    if on_server:
        begin.path = os.fspath(path)
        begin.environment = environment_text(environment)
        if begin.environment:
            names_map(begin.environment)
        messages: Iterator[Any] = iter([service.LoadSceneRequest(begin=begin)])
    else:
        local = collect(path, environment)
        if local.total_bytes == 0:
            raise InvalidArgument(f"{local.main_file}: the file is empty", problems=())
        begin.main_file, begin.environment, begin.total_bytes = local.main_file, local.environment, local.total_bytes
        messages = _upload(local, begin)
    loaded = yield Call("LoadScene", Upload(messages), quick=False)
    info = yield from _with_all_cameras(loaded.scene)
    return info, loaded


def _upload(local: LocalScene, begin: service.LoadSceneRequest.Begin) -> Iterator[service.LoadSceneRequest]:
    yield service.LoadSceneRequest(begin=begin)
    for file in local.files:
        yield service.LoadSceneRequest(
            begin_file=service.LoadSceneRequest.BeginFile(name=file.name, bytes=file.bytes, sha256=_hash(file))
        )
        with open(file.path, "rb") as source:
            left = file.bytes
            while left > 0:
                chunk = source.read(min(left, _CHUNK))
                if not chunk:
                    raise Internal(f"{file.path} changed while it was uploaded", problems=())
                left -= len(chunk)
                yield service.LoadSceneRequest(data=chunk)


def _hash(file: SceneFile) -> bytes:
    digest, size = hashlib.sha256(), 0
    with open(file.path, "rb") as source:
        while chunk := source.read(_CHUNK):
            digest.update(chunk)
            size += len(chunk)
    if size != file.bytes:
        raise Internal(f"{file.path} changed while it was uploaded", problems=())
    return digest.digest()


def _with_all_cameras(info: service.SceneInfo) -> Operation[service.SceneInfo]:
    """An answer has the first cameras alone."""
    while len(info.cameras) < info.camera_total:
        page = yield Call(
            "ListScenes", service.ListScenesRequest(scene_id=info.scene_id, first_camera=len(info.cameras))
        )
        if len(page.scenes) != 1 or not page.scenes[0].cameras:
            raise Internal("the daemon does not tell all cameras of the scene", problems=())
        info.cameras.extend(page.scenes[0].cameras)
    return info


def edit(
    scene: SceneValues,
    materials: Changes | None,
    lights: Changes | None,
    objects: Changes | None,
    environment: dict[str, Any] | None,
) -> Operation[tuple[service.SceneInfo, tuple[str, ...]]]:
    request = service.EditSceneRequest(scene_id=scene.id, edits=make_edits(materials, lights, objects, environment))
    made = list(request.edits)
    try:
        answer = yield Call("EditScene", request, quick=False)
    except HeliographError as error:
        raise with_fields_renamed(error, lambda field: argument_of(made, field)) from None
    info = yield from _with_all_cameras(answer.scene)
    return info, tuple(answer.notices)


def describe(scene: SceneValues) -> Operation[Details]:
    objects: list[Object] = []
    materials: list[Material] = []
    lights: list[Light] = []
    while True:
        page = yield Call(
            "DescribeScene",
            service.DescribeSceneRequest(
                scene_id=scene.id, first_object=len(objects), first_material=len(materials), first_light=len(lights)
            ),
        )
        objects += [Object(item.name, tuple(item.transform), item.triangles, item.material) for item in page.objects]
        materials += [
            Material(
                item.name,
                item.model,
                vector_of(item, "base_color"),
                vector_of(item, "emission"),
                item.roughness if item.HasField("roughness") else None,
            )
            for item in page.materials
        ]
        lights += [
            Light(item.name, item.kind, (item.intensity.x, item.intensity.y, item.intensity.z)) for item in page.lights
        ]
        complete = (
            len(objects) >= page.object_total
            and len(materials) >= page.material_total
            and len(lights) >= page.light_total
        )
        if complete or not (page.objects or page.materials or page.lights):
            return Details(tuple(materials), tuple(lights), tuple(objects), vector_of(page, "environment"))


def scenes() -> Operation[list[service.SceneInfo]]:
    infos = []
    for info in (yield Call("ListScenes", service.ListScenesRequest())).scenes:
        infos.append((yield from _with_all_cameras(info)))
    return infos


def unload(scene: SceneValues) -> Operation[None]:
    yield Call("UnloadScene", service.UnloadSceneRequest(scene_id=scene.id))


def files(folder: str | os.PathLike[str]) -> Operation[list[pathlib.PurePosixPath]]:
    """Scenes and environment maps under the daemon's roots, folder by folder."""
    answer = yield Call("ListFiles", service.ListFilesRequest(folder=os.fspath(folder)))
    return [pathlib.PurePosixPath(entry.path) for entry in answer.entries]


def load_reference(file: ReferenceFile) -> Operation[LoadedReference]:
    """NotFound: the file cannot be read. InvalidArgument, ResourceExhausted: as the daemon says, with the file."""
    try:
        with file.open() as source:
            digest, size = hashlib.sha256(), 0
            while chunk := source.read(_CHUNK):
                digest.update(chunk)
                size += len(chunk)
    except OSError as error:
        raise NotFound(f"{file.name}: cannot be read ({error.strerror})", problems=()) from None
    if size == 0:
        raise InvalidArgument(f"{file.name}: the file is empty", problems=())
    begin = comparisons.LoadReferenceRequest.Begin(bytes=size, sha256=digest.digest())
    try:
        answer = yield Call("LoadReference", Upload(_reference_chunks(file, begin)), quick=False)
    except (InvalidArgument, ResourceExhausted) as error:
        raise type(error)(f"{file.name}: {error}", problems=(), retry_after_s=error.retry_after_s) from None
    return LoadedReference(answer.reference_id, file.path, digest.digest())


def _reference_chunks(
    file: ReferenceFile, begin: comparisons.LoadReferenceRequest.Begin
) -> Iterator[comparisons.LoadReferenceRequest]:
    yield comparisons.LoadReferenceRequest(begin=begin)
    left = begin.bytes
    with file.open() as source:
        while left > 0:
            chunk = source.read(min(left, _CHUNK))
            if not chunk:
                raise Internal(f"{file.name} changed while it was uploaded", problems=())
            left -= len(chunk)
            yield comparisons.LoadReferenceRequest(data=chunk)


def replay(token: str) -> Operation[replay_messages.ReplaySampleResponse]:
    answer: replay_messages.ReplaySampleResponse = yield Call(
        "ReplaySample", replay_messages.ReplaySampleRequest(token=token), quick=False
    )
    return answer


def create_session(request: service.CreateSessionRequest) -> Operation[service.CreateSessionResponse]:
    answer: service.CreateSessionResponse = yield Call("CreateSession", request)
    return answer


def close_session(session_id: str) -> Operation[None]:
    yield Call("CloseSession", service.CloseSessionRequest(session_id=session_id))


def cancel_job(job_id: str) -> Operation[None]:
    yield Call("CancelJob", jobs.CancelJobRequest(job_id=job_id))


# ---- jobs that the daemon keeps


def of_kept_jobs(error: HeliographError) -> HeliographError:
    """What a call about them failed by. The calls are younger than the first daemons."""
    if isinstance(error, Unimplemented):
        return Unimplemented(
            f"{error}: it is older than jobs that a daemon keeps; render() and submit() work with it", problems=()
        )
    return error


def _of_job(method: str, request: Any) -> Operation[Any]:
    try:
        return (yield Call(method, request))
    except HeliographError as error:
        raise of_kept_jobs(error) from None


def submit_job(request: kept.SubmitJobRequest) -> Operation[kept.SubmitJobResponse]:
    answer: kept.SubmitJobResponse = yield from _of_job("SubmitJob", request)
    return answer


def job_info(job_id: str) -> Operation[JobInfo]:
    return make_job_info((yield from _of_job("GetJob", kept.GetJobRequest(job_id=check_job_id(job_id)))))


def job_page(states: Sequence[Any], token: str) -> Operation[tuple[list[JobInfo], str]]:
    """The jobs of a page, newest submission first, and the token of the next one; empty: there is none."""
    page = yield from _of_job("ListJobs", kept.ListJobsRequest(page_token=token, states=states))
    return [make_job_info(job) for job in page.jobs], page.next_page_token


def pause_job(job_id: str) -> Operation[JobInfo]:
    return make_job_info((yield from _of_job("PauseJob", kept.PauseJobRequest(job_id=job_id))))


def resume_job(job_id: str) -> Operation[JobInfo]:
    return make_job_info((yield from _of_job("ResumeJob", kept.ResumeJobRequest(job_id=job_id))))


def set_job_priority(job_id: str, priority: int) -> Operation[JobInfo]:
    request = kept.SetJobPriorityRequest(job_id=job_id, priority=read_priority(priority))
    return make_job_info((yield from _of_job("SetJobPriority", request)))


def cancel_kept_job(job_id: str) -> Operation[JobInfo]:
    """The job as it is then: the call itself does not tell."""
    yield from _of_job("CancelJob", jobs.CancelJobRequest(job_id=job_id))
    return (yield from job_info(job_id))
