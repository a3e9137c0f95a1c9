#!/usr/bin/env python3
"""Measures the Python package: its import, tiles to numpy, and what a picture takes beside its render; run by
`helio_bench python`.

usage: python_bench.py CLIENT_PYTHON HELIOGRAPHD SCENE.gltf

CLIENT_PYTHON: the folder client/python, whose wheel is built and unpacked for this. One JSON object a figure on stdout:
{"name", "value"}, medians; {"note"}: why there is none.
"""

import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
import zipfile

IMPORT = "import sys, time; sys.path.insert(0, sys.argv[1]); t = time.perf_counter(); import heliograph; print(time.perf_counter() - t)"
RUNS = 15


def tell(name, values):
    print(json.dumps({"name": name, "value": statistics.median(values)}), flush=True)


def unpack(project, folder):
    """Puts what the wheel holds into a folder."""
    build = [sys.executable, "-B", "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder / "wheel")]
    subprocess.run(build, cwd=project, check=True, stdout=sys.stderr)
    (wheel,) = (folder / "wheel").glob("*.whl")
    zipfile.ZipFile(wheel).extractall(folder / "package")
    return folder / "package"


def import_times(package):
    for _ in range(RUNS):
        command = [sys.executable, "-c", IMPORT, str(package)]
        yield float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def tiles_to_numpy(hg, client, scene, compression, pixel_type):
    """Milliseconds of the checks of all tiles of a picture, and of their way into float32 arrays."""
    from heliograph.jobs import JobFeed, job_request

    request = job_request(
        scene,
        client.address,
        size=(1280, 720),
        until=hg.Samples(1),
        camera=None,
        views=None,
        channels=(),
        denoiser=None,
        pixel_type=pixel_type,
        compression=compression,
        settings={},
    )
    responses = list(client._connection.open("RunJob", request))
    checks, decoding = [], []
    for _ in range(RUNS):
        begun = time.perf_counter()
        feed, frame = JobFeed(), None
        for response in responses:
            frame = feed.add(response) or frame
        checked = time.perf_counter()
        assert frame.image.shape == (720, 1280)
        checks.append(1000 * (checked - begun))
        decoding.append(1000 * (time.perf_counter() - checked))
    return checks, decoding


def beside_render(hg, client, scene):
    for _ in range(RUNS):
        begun = time.perf_counter()
        image = client.render(scene, size=(640, 360), until=hg.Samples(4))
        yield 1000 * (time.perf_counter() - begun - image.stats.seconds)


def main():
    project, daemon, file = map(pathlib.Path, sys.argv[1:4])
    with tempfile.TemporaryDirectory(prefix="heliograph-bench-") as folder:
        try:
            package = unpack(project, pathlib.Path(folder))
        except subprocess.CalledProcessError as error:
            print(json.dumps({"note": f"no wheel: {error}"}))
            return
        tell("import_s", list(import_times(package)))
        sys.path.insert(0, str(package))
        import heliograph as hg

        with hg.serve(daemon) as client:
            scene = client.load(file)
            for name, compression, pixel_type in (("float", "none", "float"), ("half", "none", "half"), ("zip", "zip", "float")):
                checks, decoding = tiles_to_numpy(hg, client, scene, compression, pixel_type)
                tell(f"tiles.{name}_checks_ms", checks)
                tell(f"tiles.{name}_ms", decoding)
            tell("first_picture.beside_render_ms", list(beside_render(hg, client, scene)))


if __name__ == "__main__":
    main()
