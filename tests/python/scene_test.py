"""Scenes: files that are found and sent, server paths, edits, what is refused."""

import json
import struct

import numpy as np
import pytest
from conftest import BOX, ROOT, references

import heliograph as hg
from heliograph.scene_files import collect, relative_name

SIZE = (32, 32)


def gltf(folder, buffer_uri="data.bin", name="scene.gltf", **extra):
    """A triangle that shines with radiance 2 before the camera, its vertices in a file of its own."""
    positions = struct.pack("<9f", -50, -50, -1, 50, -50, -1, 0, 80, -1)
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"name": "flag", "nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "name": "flag"}, {"camera": 0}],
        "cameras": [{"type": "perspective", "name": "front", "perspective": {"yfov": 0.8, "znear": 0.01}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [
            {
                "name": "glow",
                "emissiveFactor": [1, 1, 1],
                "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2}},
            }
        ],
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [-50, -50, -1],
                "max": [50, 80, -1],
            }
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"uri": buffer_uri, "byteLength": 36}],
        **extra,
    }
    (folder / name).write_text(json.dumps(document))
    return folder / name, positions


def test_gltf_with_its_files(client, tmp_path):
    """A name that is percent-encoded, in a folder below."""
    scene, positions = gltf(tmp_path, "some%20parts/data.bin")
    (tmp_path / "some parts").mkdir()
    (tmp_path / "some parts" / "data.bin").write_bytes(positions)
    loaded = client.load(scene)
    assert loaded.name == "flag" and loaded.info.triangles == 1 and list(loaded.cameras) == ["front"]
    image = loaded.render(size=SIZE, until=hg.Samples(4))
    assert image.rgb[16, 16] == pytest.approx([2, 2, 2])
    assert client.load(scene).id == loaded.id
    assert loaded.id in [other.id for other in client.scenes()]
    loaded.unload()
    assert loaded.id not in [other.id for other in client.scenes()]
    with pytest.raises(hg.NotFound, match=loaded.id):
        loaded.render(size=SIZE, until=hg.Samples(1))


def test_glb(client, tmp_path):
    scene, positions = gltf(tmp_path)
    document = json.loads(scene.read_text())
    del document["buffers"][0]["uri"]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    (tmp_path / "scene.glb").write_bytes(
        struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + 36, len(text), 0x4E4F534A)
        + text
        + struct.pack("<II", 36, 0x004E4942)
        + positions
    )
    assert client.render(tmp_path / "scene.glb", size=SIZE, until=hg.Samples(4)).rgb[16, 16] == pytest.approx([2, 2, 2])


MITSUBA = """<?xml version="1.0"?>
<scene version="3.0.0">
  <default name="part" value="parts"/>
  <include filename="camera.xml"/>
  <shape type="obj"><string name="filename" value="$part/flag.obj"/>
    <emitter type="area"><rgb name="radiance" value="3, 2, 1"/></emitter></shape>
</scene>"""


def test_mitsuba_with_its_files(client, tmp_path):
    (tmp_path / "scene.xml").write_text(MITSUBA)
    (tmp_path / "camera.xml").write_text(
        '<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="40"/><transform name="to_world">'
        '<lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform><film type="hdrfilm">'
        '<integer name="width" value="20"/><integer name="height" value="10"/></film></sensor></scene>'
    )
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "flag.obj").write_text("v -50 -50 0\nv 50 -50 0\nv 0 80 0\nf 1 2 3\n")
    assert [file.name for file in collect(tmp_path / "scene.xml", None).files] == [
        "scene.xml",
        "camera.xml",
        "parts/flag.obj",
    ]
    image = client.render(tmp_path / "scene.xml", until=hg.Samples(4))
    assert image.size == (20, 10)  # what the file asks for
    assert image.rgb[5, 10] == pytest.approx([3, 2, 1])


def test_only_files_below_the_scene_are_sent(tmp_path):
    (tmp_path / "secret").write_text("x")
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "a:b").write_text("x")
    for uri in (
        "../secret",
        str(tmp_path / "secret"),
        "%2e%2e/secret",
        "x/../../secret",
        "file:///etc/passwd",
        "a:b",
        "",
        "data:,x",
        "nothing.bin",
        ".",
    ):
        scene, _ = gltf(folder, uri)
        assert [file.name for file in collect(scene, None).files] == ["scene.gltf"], uri
    assert relative_name("a/./b%20c") == "a/b c" and relative_name("a/") is None and relative_name("/a") is None


def test_broken_and_missing_files(client, tmp_path):
    with pytest.raises(hg.NotFound, match="no such file"):
        client.load(tmp_path / "none.gltf")
    with pytest.raises(hg.NotFound, match="is not a regular file"):
        client.load(tmp_path)
    (tmp_path / "empty.gltf").write_text("")
    with pytest.raises(hg.InvalidArgument, match="the file is empty"):
        client.load(tmp_path / "empty.gltf")
    (tmp_path / "broken.gltf").write_text('{"asset": {')
    with pytest.raises(hg.InvalidArgument, match="broken.gltf"):
        client.load(tmp_path / "broken.gltf")
    (tmp_path / "text.gltf").write_text("hello")
    with pytest.raises(hg.InvalidArgument, match="text.gltf"):
        client.load(tmp_path / "text.gltf")
    scene, _ = gltf(tmp_path)
    with pytest.raises(hg.HeliographError, match="data.bin"):
        client.load(scene)
    scene, positions = gltf(tmp_path, extensionsRequired=["KHR_none"], extensionsUsed=["KHR_none"])
    (tmp_path / "data.bin").write_bytes(positions)
    with pytest.raises(hg.Unimplemented, match="KHR_none"):
        client.load(scene)


def test_names_are_found_without_a_parser():
    from heliograph import scene_files

    pad = b'"pad": "' + b"x" * (scene_files._STEP - 30) + b'", '
    text = b'{%s"buffers": [{"uri" : "a%%20b\\u0020c.bin"}, {"uri":"data:x,y"}], "name": "\\"uri\\": \\"no\\"", ' % pad
    text += b'"image":\n"d\xc3\xa9.png", "uri": "cut'
    assert scene_files._gltf_uris(text) == ["a%20b c.bin", "d\u00e9.png"]


def test_wrong_types_are_told_as_arguments(client, box):
    for field, use in (
        ("time", lambda: client.load(BOX, time="x")),
        ("animation", lambda: client.load(BOX, animation=1.5)),
        ("strict", lambda: client.load(BOX, strict="no")),
        ("path", lambda: client.load(5)),
        ("grace", lambda: box.session(grace="x")),
        ("exposure", lambda: box.session(exposure="x")),
        ("exposure", lambda: box.session(exposure=100)),
        ("buffer", lambda: box.session(buffer="x")),
        ("buffer", lambda: box.session(buffer=2000)),
        ("camera", lambda: box.session(camera=1.5)),
    ):
        with pytest.raises(hg.InvalidArgument) as told:
            use()
        assert told.value.field == field
    assert references(client, box) == 0  # no session was made


def test_fields_of_an_edit_are_the_callers(box):
    with pytest.raises(hg.InvalidArgument) as told:
        box.edit(materials={"red": {"base_color": (0, 0, 9)}, "nope": {"roughness": 1}}, environment={"scale": -1})
    fields = {problem.field: problem.value for problem in told.value.problems}
    assert fields["materials['red'].base_color"] == "(0, 0, 9)" and fields["materials['nope']"] == ""
    assert fields["environment.scale"] == "-1" and "edits[" not in str(told.value)


def test_a_file_that_changes_while_it_is_sent(client, tmp_path, monkeypatch):
    """Found by its hash's length; the error is ours, not gRPC's about an iterator."""
    from heliograph import operations

    scene, positions = gltf(tmp_path)
    (tmp_path / "data.bin").write_bytes(positions)
    collected = collect(scene, None)
    (tmp_path / "data.bin").write_bytes(positions * 2)
    monkeypatch.setattr(operations, "collect", lambda *_: collected)
    with pytest.raises(hg.Internal, match="data.bin changed while it was uploaded"):
        client.load(scene)


def test_environments(client, tmp_path):
    scene, positions = gltf(tmp_path)
    (tmp_path / "data.bin").write_bytes(positions)
    by_text = client.load(scene, environment="0.5,0.25,0.125")
    by_numbers = client.load(scene, environment=(0.5, 0.25, 0.125))
    assert by_text.inspect().environment == by_numbers.inspect().environment == (0.5, 0.25, 0.125)
    corner = by_text.render(size=SIZE, until=hg.Samples(4), camera=hg.Camera((0, 0, 0), (0, 0, 1))).rgb
    assert corner[0, 0] == pytest.approx([0.5, 0.25, 0.125])
    sky = hg.Image({name: np.full((8, 16), value) for name, value in zip("RGB", (1, 2, 3))})
    sky.save(tmp_path / "sky.exr")
    lit = client.load(scene, environment=tmp_path / "sky.exr")
    assert lit.render(size=SIZE, until=hg.Samples(4), camera=hg.Camera((0, 0, 0), (0, 0, 1))).rgb[
        0, 0
    ] == pytest.approx([1, 2, 3])
    for bad in ("1,2", "1,2,-3", (1, 2), (1, 2, float("inf")), "nowhere.exr", 5):
        with pytest.raises(
            hg.InvalidArgument, match=r"environment: .*allowed: a file, or three numbers R,G,B in \[0, 3.4e38\]"
        ):
            client.load(scene, environment=bad)


def test_doubtful_files_warn_and_strict_refuses(client, tmp_path):
    scene, positions = gltf(tmp_path, images=[], unknown=3)
    (tmp_path / "data.bin").write_bytes(positions)
    with pytest.warns(hg.HeliographWarning, match="images"):
        loaded = client.load(scene)
    assert loaded.warnings and any("unknown" in key for key in loaded.unread)
    with pytest.raises(hg.InvalidArgument, match="images"):
        client.load(scene, strict=True)


def test_server_paths(client):
    scene = client.load("cornell-box/cornell-box.gltf", on_server=True)
    assert scene.name == "cornell-box" and any(path.name == "cornell-box" for path in client.files())
    inside = client.files("cornell-box")
    assert any(path.suffix == ".gltf" for path in inside)
    with pytest.raises(hg.NotFound):
        client.load("cornell-box/none.gltf", on_server=True)
    with pytest.raises(hg.PermissionDenied):
        client.load(ROOT / "LICENSE", on_server=True)


def test_inspect_and_edit(client, box):
    details = box.inspect()
    assert [material.name for material in details.materials] == ["white", "red", "green", "lamp"]
    assert details.materials[1].base_color == pytest.approx((0.472, 0.0469, 0.0489))
    assert details.materials[3].emission == pytest.approx((17.2, 11.5, 3.05))
    assert len(details.objects) == box.info.instances and details.environment is None
    edited = box.edit(materials={"red": {"base_color": (0, 0, 1), "roughness": 0.5}, 2: {"base_color": [1, 1, 1]}})
    assert edited.info.edited_from == box.id and edited.inspect().materials[1].base_color == (0, 0, 1)
    assert edited.inspect().materials[2].base_color == (1, 1, 1)
    assert box.inspect().materials[1].base_color == pytest.approx((0.472, 0.0469, 0.0489))
    assert (
        box.edit(materials={"red": {"base_color": (0, 0, 1), "roughness": 0.5}, 2: {"base_color": [1, 1, 1]}}).id
        == edited.id
    )
    moved = box.edit(objects={0: {"transform": [[1, 0, 0, 7], [0, 1, 0, 0], [0, 0, 1, 0]], "relative": True}})
    assert moved.inspect().objects[0].transform[3] == pytest.approx(details.objects[0].transform[3] + 7)


def test_edits_that_are_wrong_are_all_told(client, box):
    with pytest.raises(hg.InvalidArgument) as told:
        box.edit(
            materials={"red": {"colour": 1, "base_color": 3}, -1: {"roughness": 1}, "green": {}},
            objects={"x": {"transform": [1, 2]}},
            environment={"scale": "much"},
        )
    assert [problem.field for problem in told.value.problems] == [
        "materials['red'].colour",
        "materials['red'].base_color",
        "materials[-1]",
        "materials['green']",
        "objects['x'].transform",
        "environment.scale",
    ]
    with pytest.raises(hg.InvalidArgument, match="any of materials, lights, objects, environment"):
        box.edit()
    with pytest.raises(hg.InvalidArgument, match="redd.*red"):  # the daemon's, with names like it
        box.edit(materials={"redd": {"roughness": 0.5}})
    with pytest.raises(hg.InvalidArgument, match="0 0 0 1|12 numbers"):
        box.edit(objects={0: {"transform": np.ones((4, 4))}})


def test_wrong_settings_are_all_told(box):
    with pytest.raises(hg.InvalidArgument) as told:
        box.render(
            size=(0, 3),
            until=hg.Samples(1),
            mode="fast",
            sedd=1,
            seed=-1,
            region=(1, 2),
            adaptive=4,
            technique={"s": 1},
            max_segments="many",
        )
    fields = [problem.field for problem in told.value.problems]
    assert fields == ["size", "mode", "sedd", "seed", "region", "adaptive", "technique.s", "max_segments"]
    allowed = {problem.field: problem.allowed for problem in told.value.problems}
    assert allowed["mode"] == "'pt', 'adaptive', 'reproject', 'combined'"
    assert "max_segments" in allowed["sedd"] and "width" not in allowed["sedd"]
    assert allowed["seed"] == "[0, 2^64)" and allowed["adaptive"].startswith("a dict with any of min_samples")
    huge = {"viewing_distance": 10**400, "foveation_paper": {"disk": -(10**400), "fixed_disk": 1}}
    with pytest.raises(hg.InvalidArgument) as told:
        box.session(foveation="papers", **huge)
    assert [(problem.field, problem.allowed) for problem in told.value.problems] == [
        ("foveation", "'none', 'density', 'paper'"),
        ("viewing_distance", "a number that a float can hold"),
        ("foveation_paper.disk", "a number that a float can hold"),
        ("foveation_paper.fixed_disk", "True or False"),
    ]
    with pytest.raises(hg.InvalidArgument, match="channels: 'colour'; allowed: 'alpha', 'depth'"):
        box.render(until=hg.Samples(1), channels=["colour"])
    with pytest.raises(hg.InvalidArgument, match="pixel_type: 'double'; allowed: 'half', 'float'; compression: 'lzw'"):
        box.render(until=hg.Samples(1), pixel_type="double", compression="lzw")
    with pytest.raises(hg.InvalidArgument, match="denoiser: 'x'; allowed: 'oidn'"):
        box.render(until=hg.Samples(1), denoiser="x")
    for until in (None, 5, [], [hg.Samples(1), hg.Samples(2)], "x"):
        with pytest.raises(hg.InvalidArgument, match="until"):
            box.render(until=until)
    with pytest.raises(
        hg.InvalidArgument, match=r"camera: 'side'; allowed: a Camera, one of 'camera', or a number in \[0, 0\]"
    ):
        box.render(until=hg.Samples(1), camera="side")
    with pytest.raises(hg.InvalidArgument, match="scene: 5; allowed"):
        box._client.render(5, until=hg.Samples(1))
    with pytest.raises(hg.InvalidArgument) as told:  # the daemon's own checks
        box.render(until=hg.Samples(1), mode="combined", integrator="photon")
    assert told.value.field in ("mode", "integrator")


def test_numbers_of_numpy_are_numbers(box):
    image = box.render(
        size=np.array([16, 8]),
        until=[hg.Samples(np.int64(4)), hg.Seconds(np.float32(30))],
        camera=np.int32(0),
        seed=np.uint64(2**64 - 1),
        region=np.array([0, 0, 8, 8]),
        filter="gaussian",
        filter_scale=np.float32(0.5),
    )
    assert image.window == (0, 0, 8, 8) and image.stats.samples == 4 and image.seed == 2**64 - 1
    with pytest.raises(hg.InvalidArgument, match=r"region: \(0, 0, 1.5, 2\); allowed: four whole numbers"):
        box.render(until=hg.Samples(1), region=(0, 0, 1.5, 2))
    with pytest.raises(hg.InvalidArgument, match="max_segments: 2.5; allowed: a whole number"):
        box.render(until=hg.Samples(1), max_segments=2.5)


def test_modes_and_integrators(box):
    """Each renders; where light paths make the picture its mean agrees with the path tracer's within the noise."""
    plain = box.render(size=SIZE, until=hg.Samples(64))
    for settings in (
        {"mode": "adaptive", "adaptive": {"min_samples": 8, "measure": "rmse"}},
        {"integrator": "bdpt"},
        {"integrator": "pt+bdpt"},
        {"mode": "combined"},
        {"filter": "gaussian", "filter_scale": 0.6},
    ):
        image = box.render(size=SIZE, until=hg.Samples(64), **settings)
        assert image.rgb.mean() == pytest.approx(plain.rgb.mean(), rel=0.05), settings


def test_replay_of_an_invalid_sample(client, tmp_path):
    """A light so bright that its radiance overflows: invalid samples come with a token, which is traced again."""
    scene, positions = gltf(tmp_path, name="bright.gltf")
    (tmp_path / "data.bin").write_bytes(positions)
    document = json.loads(scene.read_text())
    document["materials"][0]["pbrMetallicRoughness"] = {"metallicFactor": 1, "roughnessFactor": 0.2236}
    document["extensionsUsed"].append("KHR_lights_punctual")
    document["extensions"] = {
        "KHR_lights_punctual": {
            "lights": [{"type": "spot", "intensity": 1.2e37, "spot": {"innerConeAngle": 0.08, "outerConeAngle": 0.1}}]
        }
    }
    document["nodes"].append({"translation": [0, 0, -0.8], "extensions": {"KHR_lights_punctual": {"light": 0}}})
    document["scenes"][0]["nodes"].append(2)
    scene.write_text(json.dumps(document))
    image = client.render(scene, size=(64, 64), until=hg.Samples(32))
    assert image.stats.invalid_samples > 0 and image.stats.replay_token.startswith("hg1-")
    replay = client.replay(image.stats.replay_token)
    assert not replay.finite and replay.vertices and "vertex" in replay.first_not_finite
    assert str(replay).startswith(f"pixel {replay.pixel[0]},{replay.pixel[1]}, half ")
    with pytest.raises(hg.InvalidArgument):
        client.replay("hg1-" + "x" * 20)
