"""What the tests of the Python package share: the programs under test, a daemon, and the Cornell box."""

import pathlib
import subprocess
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BOX = ROOT / "scenes" / "cornell-box" / "cornell-box.gltf"


def pytest_addoption(parser):
    parser.addoption("--daemon", required=True, help="heliographd")
    parser.addoption("--program", required=True, help="heliograph")
    parser.addoption("--wheel", required=True, help="the wheel that is tested")


@pytest.fixture(scope="session")
def program(request):
    """heliographd"""
    return request.config.getoption("--daemon")


@pytest.fixture(scope="session")
def heliograph(request):
    """The command: heliograph("render", ...) answers its stdout."""

    def run(*arguments):
        command = [request.config.getoption("--program"), *map(str, arguments)]
        return subprocess.run(command, check=True, capture_output=True, text=True, timeout=120).stdout

    return run


@pytest.fixture(scope="session")
def client(program):
    import heliograph

    with heliograph.serve(program, scene_roots=ROOT / "scenes") as client:
        yield client


@pytest.fixture(scope="session")
def box(client):
    return client.load(BOX)


def eventually(condition, seconds=20):
    """The first true value of condition()."""
    end = time.monotonic() + seconds
    while True:
        value = condition()
        if value or time.monotonic() > end:
            assert value, f"did not become true within {seconds} s"
            return value
        time.sleep(0.02)


def references(client, scene):
    """Sessions and jobs that use a scene, as the daemon counts them."""
    return next(other.info.references for other in client.scenes() if other.id == scene.id)
