"""Two rows of spheres, one glTF material layer each, and a leaf-like sheet lit from behind."""

import gltf

COPYRIGHT = "CC0 1.0"

RADIUS, STEP = 0.9, 2.1


def layers():
    scene = gltf.Scene("layers", COPYRIGHT)
    ground = scene.add_lambert("ground", (0.35, 0.35, 0.35))
    e = 12
    floor = [(-e, -RADIUS, e), (e, -RADIUS, e), (e, -RADIUS, -e), (-e, -RADIUS, -e)]
    scene.add_node("ground", mesh=scene.add_mesh("ground", *gltf.quads([floor]), ground))

    red, blue, steel = (0.6, 0.05, 0.04), (0.05, 0.08, 0.4), (0.75, 0.75, 0.78)
    materials = [
        scene.add_material("clearcoat", red, roughness=0.6, layers={"clearcoat": {"clearcoatFactor": 1}}),
        scene.add_material("rough clearcoat", red, roughness=0.6, layers={
            "clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.3}}),
        scene.add_material("sheen", blue, roughness=1, layers={
            "sheen": {"sheenColorFactor": [0.8, 0.8, 0.9], "sheenRoughnessFactor": 0.5}}),
        scene.add_material("tight sheen", blue, roughness=1, layers={
            "sheen": {"sheenColorFactor": [0.8, 0.8, 0.9], "sheenRoughnessFactor": 0.25}}),
        scene.add_material("brushed", steel, metallic=1, roughness=0.3, layers={
            "anisotropy": {"anisotropyStrength": 0.8}}),
        scene.add_material("brushed across", steel, metallic=1, roughness=0.3, layers={
            "anisotropy": {"anisotropyStrength": 0.8, "anisotropyRotation": 1.5707963}}),
        scene.add_material("film on metal", steel, metallic=1, roughness=0.1, layers={
            "iridescence": {"iridescenceFactor": 1, "iridescenceIor": 1.6, "iridescenceThicknessMaximum": 420}}),
        scene.add_material("film on plastic", (0.02, 0.02, 0.02), roughness=0.1, layers={
            "iridescence": {"iridescenceFactor": 1, "iridescenceIor": 1.8, "iridescenceThicknessMaximum": 500}}),
        scene.add_material("film on glass", (1, 1, 1), roughness=0, transmission=1, layers={
            "iridescence": {"iridescenceFactor": 1, "iridescenceIor": 1.4, "iridescenceThicknessMaximum": 350}}),
    ]
    for number, material in enumerate(materials):
        row, column = divmod(number, 5)
        x = (column - 2) * STEP
        scene.add_sphere(scene.materials[material]["name"], (x, 0, -1.6 * row + (0 if row else 0.8)), RADIUS, material)
    leaf = scene.add_material("leaf", (0.1, 0.3, 0.05), roughness=0.5, layers={
        "diffuse_transmission": {"diffuseTransmissionFactor": 0.6, "diffuseTransmissionColorFactor": [0.4, 0.8, 0.1]}})
    sheet = [(3.4, -RADIUS, -2.2), (5.2, -RADIUS, -1.4), (5.2, 1.3, -1.4), (3.4, 1.3, -2.2)]
    scene.add_node("leaf", mesh=scene.add_mesh("leaf", *gltf.quads([sheet]), leaf))

    for name, center, radius, radiance in (("key", (-5, 6, 6), 1.2, 14), ("back", (5, 3, -7), 1.2, 18)):
        scene.add_sphere(name, center, radius, scene.add_light_material(name, (radiance,) * 3))
    scene.set_environment(radiance=[0.35, 0.4, 0.5])
    scene.add_camera("camera", (0, 3.6, 11.5), (0, 0, -0.5), 0.52, 2)
    return scene
