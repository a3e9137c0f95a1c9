"""Writes a glTF binary as a Mitsuba 3 scene of diffuse materials, which both renderers can read: its twin.

usage: mitsuba_twin.py SCENE.glb FOLDER WIDTH HEIGHT [SKY_R,G,B]

FOLDER gets scene.xml, a PLY file for each primitive and the images as they lie in the glTF file. Every material becomes
a two-sided diffuse BSDF of its base colour or base colour texture, every emission an area light, and the sky, whose
radiance the caller gives, a constant environment. The first camera is used. Paths have at most 10 segments and roulette
from the fifth; the filter is a box. The exit code is 1, with the reason on stderr, where the file has something else
that would change the picture: alpha, textured emission, coloured textures, other wrapping, compressed or other meshes.
"""
import json
import math
import pathlib
import struct
import sys
from xml.sax.saxutils import quoteattr

import numpy as np

SUFFIXES = {"image/jpeg": ".jpg", "image/png": ".png"}
COMPONENTS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
READ_EXTENSIONS = {"KHR_materials_emissive_strength", "KHR_materials_ior"}
PLY_PROPERTIES = {"POSITION": "xyz", "NORMAL": ("nx", "ny", "nz"), "TEXCOORD_0": "uv"}


def require(condition, what):
    if not condition:
        raise ValueError(f"{what}: a diffuse twin would show another picture")


class Gltf:
    def __init__(self, file):
        raw = pathlib.Path(file).read_bytes()
        magic, version, _, length = struct.unpack_from("<4s3I", raw)
        if magic != b"glTF" or version != 2:
            raise ValueError("no glTF 2 binary")
        self.document = json.loads(raw[20 : 20 + length])
        self.binary = raw[28 + length :]
        unknown = set(self.document.get("extensionsUsed", [])) - READ_EXTENSIONS
        require(not unknown, f"extensions {sorted(unknown)}")

    def bytes_of(self, view_index):
        view = self.document["bufferViews"][view_index]
        start = view.get("byteOffset", 0)
        require(view["buffer"] == 0 and "byteStride" not in view, "interleaved or external buffers")
        return self.binary[start : start + view["byteLength"]]

    def array(self, accessor_index):
        accessor = self.document["accessors"][accessor_index]
        require("sparse" not in accessor and not accessor.get("normalized"), "sparse or normalized accessors")
        count, width = accessor["count"], WIDTHS[accessor["type"]]
        data, start = self.bytes_of(accessor["bufferView"]), accessor.get("byteOffset", 0)
        values = np.frombuffer(data, COMPONENTS[accessor["componentType"]], count * width, start)
        return values.reshape(count, width)

    def placed_nodes(self):
        """Every node of the scene with its matrix to the world."""
        document = self.document
        waiting = [(i, np.eye(4)) for i in document["scenes"][document.get("scene", 0)]["nodes"]]
        while waiting:
            index, parent = waiting.pop(0)
            node = document["nodes"][index]
            world = parent @ node_matrix(node)
            yield node, world
            waiting += [(child, world) for child in node.get("children", [])]


def node_matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    axis, w = np.array(node.get("rotation", [0, 0, 0, 1])[:3], float), node.get("rotation", [0, 0, 0, 1])[3]
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) + 2 * w * cross + 2 * cross @ cross) * np.array(node.get("scale", [1, 1, 1]))
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def numbers(values):
    return quoteattr(", ".join(f"{value:.9g}" for value in np.ravel(values)))


def camera_xml(camera, world, width, height):
    fov = math.degrees(camera["perspective"]["yfov"])
    position, forward, up = world[:3, 3], -world[:3, 2], world[:3, 1]
    return f"""<sensor type="perspective">
<string name="fov_axis" value="y"/><float name="fov" value="{fov:.9g}"/>
<transform name="to_world">
<lookat origin={numbers(position)} target={numbers(position + forward)} up={numbers(up)}/>
</transform>
<film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/>
<rfilter type="box"/></film>
<sampler type="independent"/>
</sensor>"""


def write_image(gltf, texture_index, folder):
    """The name of the file in the folder."""
    document = gltf.document
    texture = document["textures"][texture_index]
    sampler = document["samplers"][texture["sampler"]] if "sampler" in texture else {}
    require({sampler.get("wrapS", 10497), sampler.get("wrapT", 10497)} == {10497}, "textures that do not repeat")
    image = document["images"][texture["source"]]
    file = folder / f"image{texture['source']}{SUFFIXES[image['mimeType']]}"
    file.write_bytes(gltf.bytes_of(image["bufferView"]))
    return file.name


def material_xml(gltf, material, folder):
    """The BSDF, and the emitter where there is one."""
    require(material.get("alphaMode", "OPAQUE") == "OPAQUE", "alpha")
    require("emissiveTexture" not in material, "textured emission")
    base = material.get("pbrMetallicRoughness", {})
    colour = base.get("baseColorFactor", [1, 1, 1, 1])[:3]
    if "baseColorTexture" in base:
        require(colour == [1, 1, 1] and not base["baseColorTexture"].get("texCoord"), "coloured or second textures")
        file = write_image(gltf, base["baseColorTexture"]["index"], folder)
        reflectance = f'<texture type="bitmap" name="reflectance"><string name="filename" value="{file}"/></texture>'
    else:
        reflectance = f'<rgb name="reflectance" value={numbers(colour)}/>'
    lines = [f'<bsdf type="twosided"><bsdf type="diffuse">{reflectance}</bsdf></bsdf>']
    strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
    emission = strength * np.array(material.get("emissiveFactor", [0, 0, 0]), float)
    if emission.any():
        lines.append(f'<emitter type="area"><rgb name="radiance" value={numbers(emission)}/></emitter>')
    return "\n".join(lines)


def write_ply(gltf, primitive, file):
    require(primitive.get("mode", 4) == 4 and "indices" in primitive, "meshes that are no indexed triangles")
    attributes = primitive["attributes"]
    require(set(attributes) <= set(PLY_PROPERTIES), f"vertex attributes {sorted(attributes)}")
    kept = [name for name in PLY_PROPERTIES if name in attributes]
    vertices = np.hstack([gltf.array(attributes[name]) for name in kept]).astype("<f4")
    triangles = gltf.array(primitive["indices"]).reshape(-1, 3)
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("indices", "<i4", 3)])
    faces["count"], faces["indices"] = 3, triangles
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {axis}" for name in kept for axis in PLY_PROPERTIES[name]]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    file.write_bytes(("\n".join(header) + "\n").encode() + vertices.tobytes() + faces.tobytes())


def shapes_xml(gltf, node, world, folder):
    for number, primitive in enumerate(gltf.document["meshes"][node["mesh"]]["primitives"]):
        file = folder / f"mesh{node['mesh']}-{number}.ply"
        write_ply(gltf, primitive, file)
        material = gltf.document["materials"][primitive["material"]] if "material" in primitive else {}
        yield f"""<shape type="ply"><string name="filename" value="{file.name}"/>
<transform name="to_world"><matrix value={numbers(world)}/></transform>
{material_xml(gltf, material, folder)}
</shape>"""


def main(scene, folder, width, height, sky=None):
    gltf, folder = Gltf(scene), pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['<scene version="3.0.0">', '<integrator type="path"><integer name="max_depth" value="10"/>'
             '<integer name="rr_depth" value="5"/></integrator>']
    if sky:
        lines.append(f'<emitter type="constant"><rgb name="radiance" value={quoteattr(sky)}/></emitter>')
    camera = None
    for node, world in gltf.placed_nodes():
        if "camera" in node and camera is None:
            camera = camera_xml(gltf.document["cameras"][node["camera"]], world, width, height)
            lines.append(camera)
        if "mesh" in node:
            lines += shapes_xml(gltf, node, world, folder)
    require(camera, "no camera")
    (folder / "scene.xml").write_text("\n".join(lines + ["</scene>", ""]))


if __name__ == "__main__":
    if len(sys.argv) not in (5, 6):
        sys.exit(__doc__)
    try:
        main(*sys.argv[1:])
    except (OSError, KeyError, ValueError, struct.error) as error:
        sys.exit(f"mitsuba_twin: {sys.argv[1]}: {error}")
