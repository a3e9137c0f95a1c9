"""Landscapes of any number of triangles, for measuring how load, build and tracing scale; and a lump of as many."""

import array
import math

import gltf

COPYRIGHT = "CC0 1.0"
SIZE = 100.0  # side of the landscape


def height(x, z):
    """Hills of falling size; each octave turned, so that no ridge follows the grid."""
    total = 0.0
    for octave in range(5):
        scale = 2.0**octave
        turn = 0.7 * octave
        a = math.cos(turn) * x + math.sin(turn) * z
        b = math.cos(turn) * z - math.sin(turn) * x
        total += math.sin(0.11 * scale * a + octave) * math.sin(0.13 * scale * b + 2 * octave) / scale
    return 6 * total


def landscape(triangles):
    """Exactly `triangles` of them: full rows of a square grid, then as much of one more row as is left."""
    columns = max(1, math.isqrt(triangles // 2))
    rows = -(-triangles // (2 * columns))
    step = SIZE / columns
    positions, normals, indices = array.array("f"), array.array("f"), array.array("I")
    last_row = triangles - (rows - 1) * 2 * columns
    for row in range(rows + 1):
        # A vertex column more than there are quads; the cut row ends where its triangles do.
        count = columns + 1 if row < rows else (last_row + 1) // 2 + 1
        for column in range(count):
            x, z = column * step - SIZE / 2, row * step - SIZE / 2
            y = height(x, z)
            slope_x = (height(x + 0.01, z) - height(x - 0.01, z)) / 0.02
            slope_z = (height(x, z + 0.01) - height(x, z - 0.01)) / 0.02
            positions.extend((x, y, z))
            normals.extend(gltf.normalize((-slope_x, 1, -slope_z)))
    for number in range(triangles):
        row, rest = divmod(number, 2 * columns)
        column, second = divmod(rest, 2)
        near, far = row * (columns + 1) + column, (row + 1) * (columns + 1) + column
        indices.extend((near, far, near + 1) if not second else (near + 1, far, far + 1))
    return positions, indices, normals


def random_direction(chance):
    """Uniform over the sphere; `chance` is a random.Random."""
    z, turn = 2 * chance.random() - 1, 2 * math.pi * chance.random()
    ring = math.sqrt(max(0.0, 1 - z * z))
    return ring * math.cos(turn), ring * math.sin(turn), z


# Wave vectors, phases and amplitudes of the lump's surface: radius 1 + sum of a sin(w . d + p) in the direction d.
_WAVES = [((3.1, -1.7, 2.2), 0.3, 0.11), ((-2.4, 4.3, 1.1), 1.9, 0.08), ((5.9, 3.8, -6.4), 2.7, 0.035),
          ((-8.2, 7.5, 5.1), 4.4, 0.025), ((17.3, -13.9, 11.2), 0.8, 0.009), ((-21.6, -15.8, 24.7), 5.2, 0.006)]


def lump(rows, columns):
    """A bumpy ball of mean radius 1 with 2 columns (rows - 1) triangles: positions, indices, normals; closed."""
    positions, normals, indices = array.array("f"), array.array("f"), array.array("I")

    def add(d):
        radius, gradient = 1.0, [0.0, 0.0, 0.0]
        for w, phase, amplitude in _WAVES:
            angle = w[0] * d[0] + w[1] * d[1] + w[2] * d[2] + phase
            radius += amplitude * math.sin(angle)
            slope = amplitude * math.cos(angle)
            for axis in range(3):
                gradient[axis] += slope * w[axis]
        positions.extend(radius * c for c in d)
        # Gradient of |p| - radius(p / |p|): the direction less the radius's slope along the sphere.
        inward = sum(g * c for g, c in zip(gradient, d))
        normals.extend(gltf.normalize(tuple(c - (g - inward * c) / radius for c, g in zip(d, gradient))))

    add((0.0, 1.0, 0.0))
    for row in range(1, rows):
        polar = math.pi * row / rows
        for column in range(columns):
            turn = 2 * math.pi * column / columns
            add((math.sin(polar) * math.cos(turn), math.cos(polar), math.sin(polar) * math.sin(turn)))
    add((0.0, -1.0, 0.0))
    last = len(positions) // 3 - 1
    for column in range(columns):
        after = (column + 1) % columns
        indices.extend((0, 1 + after, 1 + column))
        for row in range(rows - 2):
            near, far = 1 + row * columns, 1 + (row + 1) * columns
            indices.extend((near + column, near + after, far + column, near + after, far + after, far + column))
        indices.extend((last - columns + column, last - columns + after, last))
    return positions, indices, normals


def mesh_scene(triangles):
    scene = gltf.Scene(f"landscape-{triangles}", COPYRIGHT)
    ground = scene.add_material("ground", (0.45, 0.4, 0.3), roughness=0.9)
    positions, indices, normals = landscape(triangles)
    scene.add_node("ground", mesh=scene.add_mesh("ground", positions, indices, ground, normals))
    scene.add_directional_light("sun", (-0.6, -0.5, -0.4), (1, 0.9, 0.75), 3)
    scene.set_environment(radiance=[0.35, 0.5, 0.8])
    scene.add_camera("camera", (0, 26, 48), (0, 2, 5), 0.7, 1.5)
    return scene
