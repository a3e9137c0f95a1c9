"""The Cornell box, from the measured data of the Cornell Program of Computer Graphics, and three relatives of it."""

import math

import gltf

COPYRIGHT = "CC0 1.0; geometry and spectra measured by the Cornell University Program of Computer Graphics"

# Measured spectra (400 to 700 nm in steps of 4) integrated with the CIE 1931 observer (fit of Wyman, Sloan and Shirley
# 2013), turned into linear sRGB and divided, channel by channel, by what a spectrum of 1 gives: a reflectance of 1 is
# white, and the lamp keeps the scale of its emission spectrum (400: 0, 500: 8, 600: 15.6, 700: 18.4, linear between).
WHITE = (0.738, 0.736, 0.737)
GREEN = (0.0874, 0.399, 0.0842)
RED = (0.472, 0.0469, 0.0489)
LAMP = (17.2, 11.5, 3.05)

HEIGHT, DEPTH = 548.8, 559.2
LAMP_X, LAMP_Z = (213.0, 343.0), (227.0, 332.0)

FLOOR = [(552.8, 0, 0), (0, 0, 0), (0, 0, DEPTH), (549.6, 0, DEPTH)]
BACK = [(549.6, 0, DEPTH), (0, 0, DEPTH), (0, HEIGHT, DEPTH), (556, HEIGHT, DEPTH)]
RIGHT_WALL = [(0, 0, DEPTH), (0, 0, 0), (0, HEIGHT, 0), (0, HEIGHT, DEPTH)]
LEFT_WALL = [(552.8, 0, 0), (549.6, 0, DEPTH), (556, HEIGHT, DEPTH), (556, HEIGHT, 0)]
SHORT_FOOT = [(130, 65), (82, 225), (240, 272), (290, 114)]
TALL_FOOT = [(423, 247), (265, 296), (314, 456), (472, 406)]


def ceiling_rectangle(x0, x1, z0, z1, y=HEIGHT):
    """Faces down."""
    return [(x1, y, z0), (x1, y, z1), (x0, y, z1), (x0, y, z0)]


def ceiling_with_opening():
    """The ceiling around the lamp's opening, so that nothing lies behind or beside the lamp."""
    (x0, x1), (z0, z1) = LAMP_X, LAMP_Z
    return [ceiling_rectangle(0, 556, 0, z0), ceiling_rectangle(0, 556, z1, DEPTH),
            ceiling_rectangle(0, x0, z0, z1), ceiling_rectangle(x1, 556, z0, z1)]


def block(foot, height):
    """Top and sides of an upright box over a quadrilateral foot; its bottom stands on the floor and is left out."""
    sides = [[(a[0], 0, a[1]), (b[0], 0, b[1]), (b[0], height, b[1]), (a[0], height, a[1])]
             for a, b in zip(foot, foot[1:] + foot[:1])]
    return [[(x, height, z) for x, z in foot]] + sides


def room(name, ceiling, walls):
    """The five walls and the published camera; `walls` maps white, red and green to materials made for the scene."""
    scene = gltf.Scene(name, COPYRIGHT)
    white, red, green = (walls(scene, *entry) for entry in (("white", WHITE), ("red", RED), ("green", GREEN)))
    for part, faces, material in (("floor", [FLOOR], white), ("ceiling", ceiling, white), ("back wall", [BACK], white),
                                  ("right wall", [RIGHT_WALL], green), ("left wall", [LEFT_WALL], red)):
        add_faces(scene, part, faces, material)
    # Focal length 0.035 behind a film of 0.025 x 0.025.
    scene.add_camera("camera", (278, 273, -800), (278, 273, 0), 2 * math.atan(0.0125 / 0.035), 1)
    return scene, white


def add_faces(scene, name, faces, material):
    scene.add_node(name, mesh=scene.add_mesh(name, *gltf.quads(faces), material))


def add_lamp(scene):
    lamp = scene.add_light_material("lamp", LAMP)
    add_faces(scene, "lamp", [ceiling_rectangle(*LAMP_X, *LAMP_Z)], lamp)


def lambert(scene, name, color):
    return scene.add_lambert(name, color)


def cornell_box():
    scene, white = room("cornell-box", ceiling_with_opening(), lambert)
    add_lamp(scene)
    add_faces(scene, "short block", block(SHORT_FOOT, 165), white)
    add_faces(scene, "tall block", block(TALL_FOOT, 330), white)
    return scene


def beckmann(alpha):
    return {"distribution": "beckmann", "alpha": alpha}


def cornell_glossy():
    def glossy_wall(scene, name, color):
        return scene.add_material(name, color, roughness=round(math.sqrt(0.3), 6), heliograph=beckmann(0.3))

    scene, _ = room("cornell-glossy", ceiling_with_opening(), glossy_wall)
    add_lamp(scene)
    for name, foot, height, alpha in (("short block", SHORT_FOOT, 165, 0.2), ("tall block", TALL_FOOT, 330, 0.05)):
        # Half metal: the blocks face the open side, where a whole one would mirror nothing but black.
        glossy = scene.add_material(name, (0.9, 0.9, 0.9), metallic=0.5, roughness=round(math.sqrt(alpha), 6),
                                    heliograph=beckmann(alpha))
        add_faces(scene, name, block(foot, height), glossy)
    return scene


def cornell_spheres():
    scene, _ = room("cornell-spheres", ceiling_with_opening(), lambert)
    add_lamp(scene)
    mirror = scene.add_material("mirror", (0.98, 0.98, 0.98), metallic=1, roughness=0)
    glass = scene.add_material("glass", (1, 1, 1), roughness=0, ior=1.5, transmission=1, thickness=180)
    scene.add_sphere("mirror sphere", (388, 110, 360), 110, mirror)
    scene.add_sphere("glass sphere", (185, 90, 169), 90, glass)
    return scene


def cornell_covered():
    """The lamp hangs under a whole ceiling and shines up at it, with a plate below it: the room sees no lamp at all."""
    scene, white = room("cornell-covered", [ceiling_rectangle(0, 556, 0, DEPTH)], lambert)
    lamp = scene.add_light_material("lamp", LAMP)
    add_faces(scene, "lamp", [ceiling_rectangle(*LAMP_X, *LAMP_Z, y=500)[::-1]], lamp)
    (x0, x1), (z0, z1) = LAMP_X, LAMP_Z
    plate = ceiling_rectangle(x0 - 30, x1 + 30, z0 - 30, z1 + 30, y=490)
    add_faces(scene, "plate", [plate], white)
    add_faces(scene, "short block", block(SHORT_FOOT, 165), white)
    add_faces(scene, "tall block", block(TALL_FOOT, 330), white)
    return scene
