"""A small glTF 2.0 writer: meshes, materials, lights, cameras, spheres; as .gltf with an embedded buffer or as .glb."""

import array
import base64
import json
import math
import struct
import sys

FLOAT, UNSIGNED_SHORT, UNSIGNED_INT = 5126, 5123, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963


def _little_endian(values):
    if sys.byteorder == "big":
        values = values[:]
        values.byteswap()
    return values.tobytes()


class Scene:
    """Collects the parts of one scene; indices returned by the add_* methods are glTF's."""

    def __init__(self, name, copyright_note):
        self.name = name
        self.asset = {"version": "2.0", "generator": "Heliograph scenes/generate", "copyright": copyright_note}
        self.nodes, self.meshes, self.materials, self.cameras, self.lights = [], [], [], [], []
        self.accessors, self.views, self.data = [], [], bytearray()
        self.extensions = set()
        self.scene_extras = {}

    # ---- data -------------------------------------------------------------------------------------------------------

    def _add_accessor(self, payload, component, kind, count, target, low=None, high=None):
        while len(self.data) % 4:
            self.data.append(0)
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(payload), "target": target})
        self.data += payload
        accessor = {"bufferView": len(self.views) - 1, "componentType": component, "count": count, "type": kind}
        if low is not None:
            accessor["min"], accessor["max"] = low, high
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def add_mesh(self, name, positions, indices, material, normals=None):
        """positions, normals: array('f') of x, y, z; indices: array('I'), three a triangle."""
        columns = [positions[axis::3] for axis in range(3)]
        attributes = {
            "POSITION": self._add_accessor(_little_endian(positions), FLOAT, "VEC3", len(positions) // 3, ARRAY_BUFFER,
                                           [min(c) for c in columns], [max(c) for c in columns])
        }
        if normals is not None:
            attributes["NORMAL"] = self._add_accessor(_little_endian(normals), FLOAT, "VEC3", len(normals) // 3,
                                                      ARRAY_BUFFER)
        small = len(positions) // 3 < 65535
        index_data = array.array("H", indices) if small else indices
        index_type = UNSIGNED_SHORT if small else UNSIGNED_INT
        primitive = {
            "attributes": attributes,
            "indices": self._add_accessor(_little_endian(index_data), index_type, "SCALAR", len(indices),
                                          ELEMENT_ARRAY_BUFFER),
            "material": material,
        }
        self.meshes.append({"name": name, "primitives": [primitive]})
        return len(self.meshes) - 1

    # ---- materials --------------------------------------------------------------------------------------------------

    def add_material(self, name, base_color=(0, 0, 0), metallic=0, roughness=1, specular=None, ior=None,
                     transmission=None, thickness=None, emission=None, heliograph=None, layers=None,
                     double_sided=False):
        """emission: radiance per channel, W / (sr m^2). heliograph: the material's extras.heliograph.
        layers: further KHR_materials_ extensions by their name without that prefix."""
        material = {
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*base_color, 1],
                "metallicFactor": metallic,
                "roughnessFactor": roughness,
            },
        }
        if double_sided:
            material["doubleSided"] = True
        extensions = {}
        if specular is not None:
            extensions["KHR_materials_specular"] = {"specularFactor": specular}
        if ior is not None:
            extensions["KHR_materials_ior"] = {"ior": ior}
        if transmission is not None:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": transmission}
        if thickness is not None:
            extensions["KHR_materials_volume"] = {"thicknessFactor": thickness}
        for layer, values in (layers or {}).items():
            extensions["KHR_materials_" + layer] = values
        if emission is not None:
            strength = max(emission)
            material["emissiveFactor"] = [channel / strength for channel in emission]
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
        if extensions:
            material["extensions"] = extensions
            self.extensions.update(extensions)
        if heliograph is not None:
            material["extras"] = {"heliograph": heliograph}
        self.materials.append(material)
        return len(self.materials) - 1

    def add_lambert(self, name, color):
        """A purely diffuse surface: glTF's dielectric with its specular reflection switched off."""
        return self.add_material(name, color, specular=0)

    def add_light_material(self, name, radiance):
        """Emits and reflects nothing."""
        return self.add_material(name, emission=radiance, specular=0)

    # ---- nodes ------------------------------------------------------------------------------------------------------

    def add_node(self, name, **properties):
        self.nodes.append({"name": name, **properties})
        return len(self.nodes) - 1

    def add_sphere(self, name, center, radius, material):
        sphere = {"radius": radius, "center": list(center), "material": material}
        return self.add_node(name, extras={"heliograph": {"sphere": sphere}})

    def add_camera(self, name, position, target, vertical_fov, aspect):
        """Looks from position to target, +y up; the angle in radians."""
        self.cameras.append({
            "name": name,
            "type": "perspective",
            "perspective": {"yfov": vertical_fov, "aspectRatio": aspect, "znear": 0.01},
        })
        return self.add_node(name, camera=len(self.cameras) - 1, matrix=look_at(position, target))

    def add_directional_light(self, name, toward, color, irradiance):
        """toward: the way that light travels; irradiance in W / m^2 times the color."""
        self.extensions.add("KHR_lights_punctual")
        self.lights.append({"name": name, "type": "directional", "color": list(color), "intensity": irradiance})
        matrix = look_at((0, 0, 0), toward)
        return self.add_node(name, matrix=matrix,
                             extensions={"KHR_lights_punctual": {"light": len(self.lights) - 1}})

    def add_point_light(self, name, position, color, intensity):
        """Radiant intensity in W / sr times the color."""
        self.extensions.add("KHR_lights_punctual")
        self.lights.append({"name": name, "type": "point", "color": list(color), "intensity": intensity})
        return self.add_node(name, translation=list(position),
                             extensions={"KHR_lights_punctual": {"light": len(self.lights) - 1}})

    def set_environment(self, **environment):
        self.scene_extras = {"heliograph": {"environment": environment}}

    # ---- files ------------------------------------------------------------------------------------------------------

    def _document(self):
        document = {"asset": self.asset}
        if self.extensions:
            document["extensionsUsed"] = sorted(self.extensions)
        document["scene"] = 0
        scene = {"name": self.name, "nodes": list(range(len(self.nodes)))}
        if self.scene_extras:
            scene["extras"] = self.scene_extras
        document["scenes"] = [scene]
        document["nodes"] = self.nodes
        document["cameras"] = self.cameras
        document["materials"] = self.materials
        if self.lights:
            document["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        if self.meshes:
            document["meshes"] = self.meshes
            document["accessors"] = self.accessors
            document["bufferViews"] = self.views
            document["buffers"] = [{"byteLength": len(self.data)}]
        return document

    def to_gltf(self):
        document = self._document()
        if self.meshes:
            encoded = base64.b64encode(bytes(self.data)).decode("ascii")
            document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + encoded
        return (_format_json(document) + "\n").encode("utf-8")

    def to_glb(self):
        text = json.dumps(self._document(), separators=(",", ":")).encode("utf-8")
        text += b" " * (-len(text) % 4)
        data = bytes(self.data) + b"\0" * (-len(self.data) % 4)
        total = 12 + 8 + len(text) + 8 + len(data)
        return b"".join([struct.pack("<4sII", b"glTF", 2, total), struct.pack("<I4s", len(text), b"JSON"), text,
                         struct.pack("<I4s", len(data), b"BIN\0"), data])


def _format_json(value, indent=0):
    """Two-space JSON that keeps what fits on a line of 100 columns on one line."""
    flat = json.dumps(value)
    if len(flat) + indent <= 100 or not isinstance(value, (dict, list)):
        return flat
    inner = " " * (indent + 2)
    if isinstance(value, dict):
        items = [f"{json.dumps(key)}: {_format_json(item, indent + 2)}" for key, item in value.items()]
        opening, closing = "{", "}"
    else:
        items = [_format_json(item, indent + 2) for item in value]
        opening, closing = "[", "]"
    return opening + "\n" + ",\n".join(inner + item for item in items) + "\n" + " " * indent + closing


# ---- geometry -------------------------------------------------------------------------------------------------------


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def normalize(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)


def look_at(position, target):
    """Column-major matrix of a camera or light at position whose -z axis points at target; y up as far as possible."""
    back = normalize(subtract(position, target))
    up = (0, 1, 0) if abs(back[1]) < 0.999 else (0, 0, 1)
    right = normalize(cross(up, back))
    up = cross(back, right)
    matrix = [*right, 0, *up, 0, *back, 0, *position, 1]
    return [round(value, 9) + 0.0 for value in matrix]


def quads(corners):
    """Triangles of quads given as four corners each, counter-clockwise seen from the front."""
    positions, indices = array.array("f"), array.array("I")
    for quad in corners:
        first = len(positions) // 3
        for corner in quad:
            positions.extend(corner)
        indices.extend([first, first + 1, first + 2, first, first + 2, first + 3])
    return positions, indices
