"""Veach's plates and lights (thesis, 1997, section 9.2.3; parameters as in the Mitsuba scene modelled after it)."""

import math

import gltf

COPYRIGHT = "CC0 1.0; arrangement published by Eric Veach, Robust Monte Carlo Methods for Light Transport Simulation"

CAMERA, TARGET = (0, 2, 15), (0, -2, 2.5)
# y and z of each plate's centre; alpha of its Beckmann distribution.
PLATES = [((-2.39513, -0.135117), 0.005), ((-3.063405, 0.923128), 0.02), ((-3.58237, 2.22305), 0.05),
          ((-3.90842, 3.574455), 0.1)]
PLATE_HALF_WIDTH, PLATE_HALF_LENGTH = 4, 0.5
# Centre, radius and radiance of the spheres. The row of four has nearly the same power each.
LIGHTS = [("far light", (10, 10, 4), 0.5, 800), ("light 1", (-3.75, 0, 0), 0.03333, 901.803),
          ("light 2", (-1.25, 0, 0), 0.1, 100), ("light 3", (1.25, 0, 0), 0.3, 11.1111),
          ("light 4", (3.75, 0, 0), 0.9, 1.23457)]
FLOOR_Y, WALL_Z, EXTENT = -4.14615, -2, 10


def plate(center):
    """A strip whose normal halves the angle between the camera and the row of lights: its mirror image is the row."""
    y, z = center
    to_camera = gltf.normalize((0, CAMERA[1] - y, CAMERA[2] - z))
    to_lights = gltf.normalize((0, -y, -z))
    _, normal_y, normal_z = gltf.normalize(tuple(a + b for a, b in zip(to_camera, to_lights)))
    dy, dz = -normal_z * PLATE_HALF_LENGTH, normal_y * PLATE_HALF_LENGTH  # towards the camera along the plate
    w = PLATE_HALF_WIDTH
    return [(-w, y + dy, z + dz), (w, y + dy, z + dz), (w, y - dy, z - dz), (-w, y - dy, z - dz)]


def veach_plates():
    scene = gltf.Scene("veach-plates", COPYRIGHT)
    ground = scene.add_lambert("ground", (0.4, 0.4, 0.4))
    e = EXTENT
    floor = [(-e, FLOOR_Y, e), (e, FLOOR_Y, e), (e, FLOOR_Y, -e), (-e, FLOOR_Y, -e)]
    wall = [(-e, -e, WALL_Z), (e, -e, WALL_Z), (e, e, WALL_Z), (-e, e, WALL_Z)]
    scene.add_node("ground", mesh=scene.add_mesh("ground", *gltf.quads([floor, wall]), ground))
    for number, (center, alpha) in enumerate(PLATES, 1):
        name = f"plate {number}"
        plastic = scene.add_material(name, (0.07, 0.09, 0.13), roughness=round(math.sqrt(alpha), 6), ior=2,
                                     heliograph={"distribution": "beckmann", "alpha": alpha})
        scene.add_node(name, mesh=scene.add_mesh(name, *gltf.quads([plate(center)]), plastic))
    for name, center, radius, radiance in LIGHTS:
        scene.add_sphere(name, center, radius, scene.add_light_material(name, (radiance,) * 3))
    scene.add_camera("camera", CAMERA, TARGET, math.radians(28), 1.5)
    return scene
