"""Moves of a camera against the command's, and against geometry."""

import math

import numpy as np
import pytest
from conftest import BOX

import heliograph as hg


def close(a, b):
    return np.allclose(a, b, atol=1e-9)


@pytest.mark.parametrize(
    "option, move",
    [
        (("--orbit", "30"), lambda camera: camera.orbit(30)),
        (("--turn", "-12"), lambda camera: camera.turn(-12)),
        (("--move", "10,20,30"), lambda camera: camera.move(10, 20, 30)),
    ],
)
def test_moves_are_those_of_the_command(heliograph, box, tmp_path, option, move):
    heliograph(
        "move",
        BOX,
        "--size",
        "48x48",
        *option,
        "--steps",
        1,
        "--samples",
        4,
        "--seed",
        5,
        "--mode",
        "pt",
        "-o",
        tmp_path / "x.####.exr",
    )
    expected = hg.Image.load(tmp_path / "x.0001.exr")
    image = box.render(size=(48, 48), until=hg.Samples(4), seed=5, camera=move(box.camera()))
    assert np.array_equal(image.rgb, expected.rgb)


def test_orbit():
    """A quarter turn counter-clockwise seen from above brings +z to +x; the pivot stays in the middle."""
    camera = hg.Camera((0, 0, 5), (0, 0, 0), fov=40)
    assert close(camera.orbit(90).position, (5, 0, 0)) and close(camera.orbit(90).forward, (-1, 0, 0))
    raised = camera.orbit(0, 30)
    assert close(raised.position, (0, 2.5, 5 * math.cos(math.radians(30)))) and close(
        raised.up, (0, math.cos(math.pi / 6), -0.5)
    )
    assert close(camera.orbit(360).position, camera.position)
    assert close(camera.orbit(90, pivot=(0, 0, 3)).position, (2, 0, 3))
    top = camera.orbit(10, 500)
    assert 1.5 < math.asin(-top.forward[1]) < math.pi / 2  # ends short of the vertical
    assert camera.position == (0, 0, 5) and camera.fov == pytest.approx(40)  # a value: it stays


def test_turn_move_pan_dolly_look_at():
    camera = hg.Camera((1, 2, 3), (1, 2, 0))
    assert close(camera.right, (1, 0, 0)) and camera.fov == pytest.approx(math.degrees(0.8))
    assert close(camera.turn(90).forward, (-1, 0, 0)) and close(
        camera.turn(0, 90 - 5).forward[1], math.sin(math.radians(85))
    )
    assert close(camera.move(1, 2, 3).position, (2, 4, 0)) and close(camera.pan(1, 2).position, (2, 4, 3))
    assert close(camera.dolly(2).position, (1, 2, 1))
    looked = camera.look_at((4, 2, 3))
    assert close(looked.forward, (1, 0, 0)) and looked.pivot == (4, 2, 3) and looked.position == camera.position
    assert close(camera.look_at((0, 0, 0), position=(0, 5, 0), up=(0, 0, 1)).forward, (0, -1, 0))
    tall = camera.with_lens(half_height=2)
    assert tall.fov is None and tall.with_lens(fov=30).fov == pytest.approx(30)


def test_lens_shows(box):
    """An orthographic view of the whole box: the picture of its back wall has no perspective."""
    camera = box.camera()
    wide = box.render(size=(32, 32), until=hg.Samples(16), camera=camera.with_lens(fov=100)).rgb
    narrow = box.render(size=(32, 32), until=hg.Samples(16), camera=camera).rgb
    assert (wide[0] == 0).all() and (narrow[16] > 0).any()


def test_a_view_by_quaternion():
    """A glTF camera: a rotation of 90 degrees about y looks along -x."""
    from heliograph.v1 import types_pb2 as types

    half = math.sqrt(0.5)
    view = types.CameraView(position=types.Vec3(x=1), rotation=types.CameraView.Quaternion(y=half, w=half))
    camera = hg.Camera.from_view(view, (0, 0, 0))
    assert close(camera.forward, (-1, 0, 0)) and close(camera.up, (0, 1, 0))
    assert camera.view == view and camera.dolly(1).view.WhichOneof("orientation") == "look_at"


@pytest.mark.parametrize(
    "arguments, field",
    [
        (((0, 0), (0, 0, 1)), "position"),
        (((0, 0, 2e12), (0, 0, 1)), "position"),
        (((0, 0, 0), (0, 0, float("nan"))), "target"),
        (((0, 0, 0), (0, 0, 0)), "target"),
        (((0, 0, 0), (0, 1, 0)), "up"),
        (((0, 0, 0), (0, 0, 1), "up"), "up"),
    ],
)
def test_bad_cameras(arguments, field):
    with pytest.raises(hg.InvalidArgument) as told:
        hg.Camera(*arguments)
    assert told.value.field == field


def test_bad_lenses_and_moves():
    with pytest.raises(hg.InvalidArgument) as told:
        hg.Camera((0, 0, 0), (0, 0, 1), fov=180, lens_radius=-1, focus_distance=0, aspect=-2)
    assert [problem.field for problem in told.value.problems] == ["fov", "lens_radius", "focus_distance", "aspect"]
    with pytest.raises(hg.InvalidArgument, match="not together with fov"):
        hg.Camera((0, 0, 0), (0, 0, 1), fov=30, half_height=2)
    camera = hg.Camera((0, 0, 0), (0, 0, 1))
    for move in (
        lambda: camera.orbit("x"),
        lambda: camera.dolly(float("inf")),
        lambda: camera.pan(1e13),
        lambda: camera.look_at(3),
        lambda: camera.turn(None),
    ):
        with pytest.raises(hg.InvalidArgument):
            move()
    assert repr(camera) == "Camera((0, 0, 0), (0, 0, 1), up=(0, 1, 0), fov=45.84)"
