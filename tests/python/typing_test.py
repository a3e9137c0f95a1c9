"""What a type checker says of programs that use the package; skipped where mypy is not installed."""

import os
import pathlib
import shutil
import subprocess
import sys
import typing

import pytest

import heliograph as hg
from heliograph import kept_jobs, settings
from heliograph.comparison import request
from heliograph.v1 import compare_pb2 as compare
from heliograph.v1 import durable_job_pb2 as durable
from heliograph.v1 import types_pb2 as types

PROGRAM = """
import heliograph as hg
import heliograph.aio as ahg

c = hg.connect("127.0.0.1:1")
hg.connect("127.0.0.1:1", tls=True, ca="ca.pem", certificate="a.pem", key="a.key", tls_name="a.example")
hg.connect("127.0.0.1:1", tls="ca.pem")  # error: Argument "tls" to "connect" has incompatible type "str"; expected
scene = c.load("box.gltf")
image = scene.render(until=hg.Samples(1), size=(64, 48), mode="adaptive", channels=("depth", "normal"))
reveal_type(image)  # note: Revealed type is "heliograph.image.Image"
reveal_type(c.render(scene, until=hg.Samples(1)))  # note: Revealed type is "heliograph.image.Image"
scene.render(sise=(1, 2), until=hg.Samples(1))  # error: Unexpected keyword argument "sise"
scene.render(size=(1, 2))  # error: Missing named argument "until"
c.render(scene, sise=(1, 2), until=hg.Samples(1))  # error: Unexpected keyword argument "sise"
c.render(scene, mode="fast", until=hg.Samples(1))  # error: Argument "mode" to "render" of "ClientMethods" has
scene.submit(until=hg.Samples(1), compression="lzw")  # error: Argument "compression" to "submit" of "Scene" has
reveal_type(scene.enqueue(until=hg.Samples(1), name="box"))  # note: Revealed type is "heliograph.kept_job.KeptJob"
scene.enqueue(until=hg.Samples(1), pritority=1)  # error: Unexpected keyword argument "pritority"
c.enqueue("box.gltf", until=hg.Samples(1), priority="high")  # error: Argument "priority" to "enqueue" of
c.jobs(states="cancelled")  # error: Argument "states" to "jobs" of "Client" has incompatible type
for job in c.jobs(["queued", "running"]):
    reveal_type(job.wait(5))  # note: Revealed type is "heliograph.kept_jobs.JobInfo"
scene.session(untill=3)  # error: Unexpected keyword argument "untill"
scene.session(size="64x48")  # error: Argument "size" to "session" of "Scene" has incompatible type
result = scene.compare(["pt", {"name": "fast", "mode": "combined", "picture": "display"}], samples=(1, 4))
reveal_type(result)  # note: Revealed type is "heliograph.comparison.result.Comparison"
scene.compare(["pt"], seed=1, semples=4)  # error: Unexpected keyword argument "semples"
scene.compare(["pt"], measures="psnr")  # error: Argument "measures" to "compare" of "Scene" has
scene.compare(["pt"], regions={"a": (0, 0, 8, 8), "b": hg.Disk(4, 4, 2, outside=True)}, gaze=(3, 4.5))
scene.compare(["pt"], regions={"a": hg.Disk(4, 4)})  # error: Missing positional argument "radius" in call to "Disk"
scene.compare(["pt"], gaze="3,4")  # error: Argument "gaze" to "compare" of "Scene" has incompatible type
scene.edit(material={})  # error: Unexpected keyword argument "material"
with scene.session(adaptive={"min_samples": 8}) as s:
    reveal_type(s.scene)  # note: Revealed type is "heliograph.client.Scene"
    name: str = s.view  # error: Incompatible types in assignment (expression has type "int"
    s.scene.foo  # error: "Scene" has no attribute "foo"
    s.set(integrator="pathh")  # error: Argument "integrator" to "set" of "SessionMethods" has incompatible type
    s.camera.with_lens(fow=3)  # error: Unexpected keyword argument "fow"
    reveal_type(s.show_in_tev())  # note: Revealed type is "heliograph.live_tev.LiveTev"
    where: str = s.gaze  # error: Incompatible types in assignment (expression has type
    s.gaze = (3, 4.5)
    s.gaze = None
    s.gaze = 3  # error: Incompatible types in assignment (expression has type "int"
scene.session(gaze=(3, 4.5), foveation="density")
scene.session(gaze="3,4")  # error: Argument "gaze" to "session" of "Scene" has incompatible type
scene.session(foveation="paper", foveation_paper={"disk": 0.2, "fixed_disk": True})
scene.session(foveation_paper={"disc": 0.2})  # error: Extra key "disc" for TypedDict "FoveationPaper"
c.session(scene, gaze=None, foveation="dense")  # error: Argument "foveation" to "session" of "ClientMethods" has

async def work() -> None:
    async with await ahg.connect("127.0.0.1:1", ca="ca.pem") as a:
        looking = await a.session("box.gltf", gaze=(3, 4.5))
        looking.gaze = 3  # error: Incompatible types in assignment (expression has type "int"
        picture = await (await a.load("box.gltf")).render(until=ahg.Seconds(1))
        reveal_type(picture)  # note: Revealed type is "heliograph.image.Image"
        job = await a.enqueue("box.gltf", until=ahg.Samples(1))
        async for event in job.watch():
            reveal_type(event)  # note: Revealed type is "heliograph.kept_jobs.JobEvent"
        result = await a.compare("box.gltf", ["pt"])
        reveal_type(result)  # note: Revealed type is "heliograph.comparison.result.Comparison"
"""


def test_a_type_checker_finds_what_is_wrong(tmp_path):
    mypy = shutil.which("mypy", path="/usr/bin") or shutil.which("mypy")
    if mypy is None:
        pytest.skip("mypy is not installed")
    package = pathlib.Path(hg.__file__).parent
    (tmp_path / "heliograph").symlink_to(package)
    (tmp_path / "program.py").write_text(PROGRAM)
    version = subprocess.run([mypy, "--version"], check=True, capture_output=True, text=True).stdout.split()[1]
    old = [int(part) for part in version.split(".")[:2]] < [1, 7]
    told = subprocess.run(
        [mypy, "--no-error-summary", "--ignore-missing-imports", "--follow-imports=silent", "--no-incremental"]
        + ["--no-site-packages", "--python-version", "3.11", "--hide-error-codes"]
        + (["--enable-incomplete-feature=Unpack"] if old else [])
        + ["program.py"],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(tmp_path), "PYTHONPATH": ""},
        capture_output=True,
        text=True,
        timeout=240,
    )
    found = {}
    for line in told.stdout.splitlines():
        file, number, kind, text = line.split(":", 3)
        if file != "program.py":  # the stubs of messages, to which pyproject.toml closes its eyes
            continue
        found.setdefault(int(number), []).append(f"{kind.strip()}: {text.strip()}")
    for number, line in enumerate(PROGRAM.splitlines(), 1):
        expected = line.partition("  # ")[2]
        answers = found.pop(number, [])
        assert any(answer.startswith(expected) for answer in answers) if expected else not answers, (line, answers)
    assert not found and not told.stderr


def test_words_are_those_of_the_protocol():
    fields = types.RenderSettings.DESCRIPTOR.fields_by_name
    formats = types.TileFormat.DESCRIPTOR.fields_by_name
    hints = typing.get_type_hints(hg.Settings)
    for name in ("mode", "integrator", "roulette", "filter", "variant", "foveation"):
        assert set(typing.get_args(hints[name])) == set(settings.choices(fields[name].enum_type)), name
    for words, field in (
        (settings.PixelType, "pixel_type"),
        (settings.Compression, "compression"),
        (settings.Denoiser, "display_denoiser"),
    ):
        assert set(typing.get_args(words)) == set(settings.choices(formats[field].enum_type)), field
    assert typing.get_args(settings.Channel) == hg.CHANNELS
    assert set(kept_jobs.STATES) == set(settings.choices(durable.JobState.DESCRIPTOR))
    measures = set(typing.get_args(request.Measure))
    assert measures == set(settings.choices(compare.CompareMeasure.DESCRIPTOR)) and len(measures) == 12
    assert set(typing.get_args(request.ComparedPicture)) == set(settings.choices(compare.ComparedPicture.DESCRIPTOR))
    for name in ("adaptive", "reprojection", "light_cache", "technique", "foveation_paper"):
        assert set(hints[name].__annotations__) == set(fields[name].message_type.fields_by_name), name


def test_arguments_are_those_of_the_clients_methods():
    import inspect

    from heliograph import arguments

    for name in ("render", "submit", "enqueue", "session", "compare", "edit"):
        shared = set(typing.get_type_hints(getattr(arguments, f"{name.capitalize()}Arguments")))
        of_client = inspect.signature(getattr(hg.Client, name)).parameters
        own = {p for p in of_client if p not in ("self", "scene", "modes", "settings")}
        assert shared - set(hg.Settings.__annotations__) == own | ({"camera"} & shared), name
    assert sys.version_info >= (3, 11)
