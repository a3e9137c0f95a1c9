"""Furnaces: surfaces that lose nothing, in light that is the same everywhere, cannot be seen."""

import gltf

COPYRIGHT = "CC0 1.0"


def furnace():
    scene = gltf.Scene("furnace", COPYRIGHT)
    white = scene.add_lambert("white", (1, 1, 1))
    mirror = scene.add_material("mirror", (1, 1, 1), metallic=1, roughness=0)
    glass = scene.add_material("glass", (1, 1, 1), roughness=0, ior=1.5, transmission=1, thickness=2)
    for x, name, material in ((-3, "white", white), (0, "mirror", mirror), (3, "glass", glass)):
        scene.add_sphere(name, (x, 0, 0), 1, material)
    scene.set_environment(radiance=[1, 1, 1])
    scene.add_camera("camera", (0, 0, 12), (0, 0, 0), 0.4, 2)
    return scene
