"""The scenes of Schalk's study (2018, chapters 4.1 and 4.2.4) and what it lacks, to be written when they are needed.

Most are the Cornell box with one property changed, drawn out towards the viewer and closed there, so that the camera
stands inside and sees something after any turn; the rest are scenes of another kind. The published text gives triangle
counts, kinds of light and of material, but no numbers for either: those are ours.
"""

import functools
import math
import random

import cornell
import gltf
import meshes

COPYRIGHT = cornell.COPYRIGHT
ASPECT = 16 / 9
LAMP_COLOR = tuple(round(channel / cornell.LAMP[0], 6) for channel in cornell.LAMP)
# A point that sends out as much as the lamp: radiance x area x pi over 4 pi.
LAMP_AREA = (cornell.LAMP_X[1] - cornell.LAMP_X[0]) * (cornell.LAMP_Z[1] - cornell.LAMP_Z[0])
POINT_INTENSITY = cornell.LAMP[0] * LAMP_AREA / 4
SUN_DIRECTION, SUN_IRRADIANCE = (-0.35, -0.55, 0.76), 4

FRONT_Z = -420  # of the wall behind the camera
FRONT = [(0, 0, FRONT_Z), (552.8, 0, FRONT_Z), (556, cornell.HEIGHT, FRONT_Z), (0, cornell.HEIGHT, FRONT_Z)]


def drawn_out(face):
    """A wall of the box that ends at the new front wall instead of at the open side, z = 0."""
    return [(x, y, z or FRONT_Z) for x, y, z in face]


def glossy(scene, name, color, alpha, metallic=0.0, ior=None):
    return scene.add_material(name, color, metallic=metallic, roughness=round(math.sqrt(alpha), 6), ior=ior,
                              heliograph=cornell.beckmann(alpha))


def glass(scene, name):
    return scene.add_material(name, (1, 1, 1), roughness=0, ior=1.5, transmission=1, thickness=100)


def add_area_lamp(scene):
    lamp = scene.add_light_material("lamp", cornell.LAMP)
    cornell.add_faces(scene, "lamp", [cornell.ceiling_rectangle(*cornell.LAMP_X, *cornell.LAMP_Z, y=548)], lamp)


def add_point_lamp(scene):
    scene.add_point_light("lamp", (278, 500, 279.5), LAMP_COLOR, round(POINT_INTENSITY, 3))


def add_sun(scene):
    scene.add_directional_light("sun", SUN_DIRECTION, (1, 0.95, 0.85), SUN_IRRADIANCE)


def add_blocks(scene, material_of):
    for name, foot, height in (("short block", cornell.SHORT_FOOT, 165), ("tall block", cornell.TALL_FOOT, 330)):
        cornell.add_faces(scene, name, cornell.block(foot, height), material_of(scene, name))


def add_closed_blocks(scene, material_of):
    """With bottoms, a little above the floor: volumes that light can pass through."""
    for name, foot, height in (("short block", cornell.SHORT_FOOT, 165), ("tall block", cornell.TALL_FOOT, 330)):
        faces = cornell.block(foot, height) + [[(x, 0, z) for x, z in reversed(foot)]]
        lifted = [[(x, y + 1, z) for x, y, z in face] for face in faces]
        cornell.add_faces(scene, name, lifted, material_of(scene, name))


def soft(scene, name):
    return glossy(scene, name, (0.9, 0.9, 0.9), 0.2, metallic=0.5)


def add_soft_blocks(scene):
    add_blocks(scene, soft)


def add_model(rows, columns, scene):
    """A lump of 2 columns (rows - 1) triangles, in place of the paper's scanned models."""
    positions, indices, normals = meshes.lump(rows, columns)
    mesh = scene.add_mesh("lump", positions, indices, soft(scene, "lump"), normals)
    scene.add_node("lump", mesh=mesh, translation=[278, 190, 300], scale=[150, 150, 150])


def box(name, wall_alpha=0.3, light=add_area_lamp, contents=add_soft_blocks, closed=True):
    """Six walls (five where light is to come in), a lamp of two triangles, contents: 34 triangles with two blocks."""
    scene = gltf.Scene(name, COPYRIGHT)
    walls = (("floor", cornell.FLOOR, cornell.WHITE), ("back wall", cornell.BACK, cornell.WHITE),
             ("ceiling", cornell.ceiling_rectangle(0, 556, FRONT_Z, cornell.DEPTH), cornell.WHITE),
             ("right wall", cornell.RIGHT_WALL, cornell.GREEN), ("left wall", cornell.LEFT_WALL, cornell.RED))
    for part, face, color in walls + ((("front wall", FRONT, cornell.WHITE),) if closed else ()):
        cornell.add_faces(scene, part, [drawn_out(face)], glossy(scene, part, color, wall_alpha))
    light(scene)
    contents(scene)
    scene.add_camera("camera", (278, 290, -400), (278, 255, 0), math.radians(46), ASPECT)
    return scene


def low_roughness_blocks(scene):
    add_blocks(scene, lambda scene, name: glossy(scene, name, (0.9, 0.9, 0.9), 0.02, metallic=1))


def glossy_blocks(scene):
    add_blocks(scene, lambda scene, name: glossy(scene, name, (0.9, 0.8, 0.6), 0.1, metallic=1))


def glass_blocks(scene):
    add_closed_blocks(scene, glass)


def highlight(name):
    """A glossy floor under a small light: the highlight goes where the camera goes."""
    scene = gltf.Scene(name, "CC0 1.0")
    floor = glossy(scene, "floor", (0.12, 0.1, 0.08), 0.08, ior=1.8)
    wall = scene.add_lambert("wall", (0.5, 0.5, 0.55))
    cornell.add_faces(scene, "floor", [[(-6, 0, 6), (6, 0, 6), (6, 0, -6), (-6, 0, -6)]], floor)
    cornell.add_faces(scene, "wall", [[(-6, 0, -6), (6, 0, -6), (6, 5, -6), (-6, 5, -6)]], wall)
    red = scene.add_lambert("block", (0.6, 0.25, 0.15))
    cornell.add_faces(scene, "block", cornell.block([(-2.6, -1.5), (-2.9, -2.7), (-1.7, -3.0), (-1.4, -1.8)], 1.1), red)
    scene.add_sphere("lamp", (0.6, 2.6, -3), 0.12, scene.add_light_material("lamp", (320, 300, 260)))
    scene.set_environment(radiance=[0.02, 0.025, 0.035])
    scene.add_camera("camera", (0, 1.7, 5), (0, 0.5, -1.5), math.radians(42), ASPECT)
    return scene


# ---- courtyard ------------------------------------------------------------------------------------------------------

YARD, WALL = 20.0, 7.0  # half of its side, height of its walls, metres
LEAVES, CROWNS, TREES = 3200, 13, 125


def crown(leaves):
    """Small quads at random places and angles in the unit ball, more of them outside."""
    chance = random.Random(2018)
    quads = []
    for _ in range(leaves):
        center = meshes.random_direction(chance)
        reach = chance.random()**0.4
        center = tuple(reach * c for c in center)
        along = meshes.random_direction(chance)
        across = gltf.normalize(gltf.cross(along, meshes.random_direction(chance)))
        length, width = 0.07 + 0.04 * chance.random(), 0.035
        quads.append([tuple(c + i * length * a + j * width * b for c, a, b in zip(center, along, across))
                      for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return gltf.quads(quads)


def trunk():
    return gltf.quads(cornell.block([(-0.12, -0.12), (-0.12, 0.12), (0.12, 0.12), (0.12, -0.12)], 2.4)[1:])


def courtyard(name):
    """10.4 million triangles, nearly all leaves of instanced crowns, under a sun alone: in place of San Miguel."""
    scene = gltf.Scene(name, "CC0 1.0")
    chance = random.Random(9980693)
    stone = scene.add_lambert("stone", (0.55, 0.5, 0.42))
    plaster = scene.add_lambert("plaster", (0.72, 0.62, 0.48))
    leaf = scene.add_material("leaf", (0.18, 0.32, 0.07), roughness=0.55, double_sided=True)
    bark = scene.add_lambert("bark", (0.25, 0.18, 0.12))
    y = YARD
    cornell.add_faces(scene, "ground", [[(-y, 0, y), (y, 0, y), (y, 0, -y), (-y, 0, -y)]], stone)
    corners = [(-y, y), (-y, -y), (y, -y), (y, y)]
    walls = [[(ax, 0, az), (bx, 0, bz), (bx, WALL, bz), (ax, WALL, az)]
             for (ax, az), (bx, bz) in zip(corners, corners[1:] + corners[:1])]
    cornell.add_faces(scene, "walls", walls, plaster)
    crown_mesh = scene.add_mesh("crown", *crown(LEAVES), leaf)
    trunk_mesh = scene.add_mesh("trunk", *trunk(), bark)
    places = [(3.2 * i, 3.2 * k) for i in range(-5, 6) for k in range(-6, 7) if math.hypot(i, k) > 1.6]
    chance.shuffle(places)
    for number, (px, pz) in enumerate(places[:TREES]):
        x, z = px + 0.9 * (chance.random() - 0.5), pz + 0.9 * (chance.random() - 0.5)
        scene.add_node(f"trunk {number}", mesh=trunk_mesh, translation=[round(x, 4), 0, round(z, 4)])
        for _ in range(CROWNS):
            direction, reach = meshes.random_direction(chance), 1.1 * chance.random()**0.5
            size = 0.55 + 0.35 * chance.random()
            turn = 2 * math.pi * chance.random()
            scene.add_node(f"crown {number}", mesh=crown_mesh, scale=[round(size, 4)] * 3,
                           rotation=[0, round(math.sin(turn / 2), 9), 0, round(math.cos(turn / 2), 9)],
                           translation=[round(x + reach * direction[0], 4), round(3.2 + 0.8 * reach * direction[1], 4),
                                        round(z + reach * direction[2], 4)])
    metal = glossy(scene, "metal", (0.9, 0.7, 0.4), 0.05, metallic=1)
    for k, (x, z) in enumerate([(-1.2, 0.4), (1.3, 0.2), (0.1, -1.5)]):
        scene.add_sphere(f"ball {k}", (x, 0.8, z), 0.8, metal if k else glass(scene, "glass"))
    scene.add_directional_light("sun", (0.45, -0.8, 0.35), (1, 0.95, 0.85), 5)
    scene.add_camera("camera", (1.6, 1.7, 8.6), (0.2, 1.4, 0), math.radians(50), ASPECT)
    return scene


SCENES = {
    "box-area": box,
    "box-point": functools.partial(box, light=add_point_lamp),
    "box-directional": functools.partial(box, light=add_sun, closed=False),
    "box-69k": functools.partial(box, contents=functools.partial(add_model, 133, 263)),
    "box-1m": functools.partial(box, contents=functools.partial(add_model, 522, 1044)),
    "box-low-roughness": functools.partial(box, wall_alpha=0.05, contents=low_roughness_blocks),
    "box-glass": functools.partial(box, contents=glass_blocks),
    "box-glossy": functools.partial(box, wall_alpha=0.1, contents=glossy_blocks),
    "highlight": highlight,
    "courtyard": courtyard,
}
