"""Cycles' side of helio_bench: reads one JSON request a line, answers one JSON object a line (Blender prints others).

usage: blender --background --factory-startup --python-exit-code 1 --python cycles_bench.py -- THREADS
       PYTHON cycles_bench.py THREADS    (a Python with the module bpy)
  {"do": "load", "file": GLTF}                              -> {"version"}; renders are 512x512
  {"do": "import", "file": GLB, "width": W, "height": H}    -> {"version"}; with the importer's own materials
  {"do": "render", "samples": N, "seed": S, "output": EXR}  -> {"seconds"}: one render of N samples a pixel

The bench pictures hold Lambert materials and one-sided lights only, so `load` rebuilds every material as a diffuse BSDF
plus emission on the front, from what the glTF file says. 10 path segments are 8 bounces here. Box filter; nothing
adaptive, clamped, denoised, blurred or left out; a black world. After `import` Cycles has no light tree, which makes its
samples cheaper. Each render synchronises the scene and builds its BVH again (kept data would miss that the sample count
has changed): callers take the difference of two sample counts.
"""
import json
import sys
import time

import bpy
import numpy

numpy.bool = bool  # the glTF importer of Debian 12's Blender uses this alias, which Debian 12's numpy has dropped


def rebuild(material, described):
    base = described.get("pbrMetallicRoughness", {}).get("baseColorFactor", [1, 1, 1, 1])
    strength = described.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
    emission = [strength * c for c in described.get("emissiveFactor", [0, 0, 0])]
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = base
    shader = diffuse.outputs[0]
    if any(emission):
        light, add, mix, geometry = (nodes.new("ShaderNode" + kind) for kind in
                                     ("Emission", "AddShader", "MixShader", "NewGeometry"))
        light.inputs["Color"].default_value = emission + [1]
        light.inputs["Strength"].default_value = 1
        links.new(diffuse.outputs[0], add.inputs[0])
        links.new(light.outputs[0], add.inputs[1])
        front = add.outputs[0]
        links.new(geometry.outputs["Backfacing"], mix.inputs[0])
        links.new(front, mix.inputs[1])
        if described.get("doubleSided"):
            links.new(front, mix.inputs[2])
        else:
            links.new(diffuse.outputs[0], mix.inputs[2])
        shader = mix.outputs[0]
    links.new(shader, output.inputs["Surface"])


def set_up(width, height):
    scene = bpy.context.scene
    scene.camera = next(o for o in scene.objects if o.type == "CAMERA")
    world = bpy.data.worlds.new("black")
    world.color = (0, 0, 0)
    if world.node_tree:  # Blender 5 always has one, of a grey that nobody asked for
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    scene.world = world
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = width, height
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", int(sys.argv[-1])
    render.film_transparent = False
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "NONE"
    scene.view_settings.view_transform = "Raw"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 8
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.light_sampling_threshold = 0
    return {"version": bpy.app.version_string}


def load(request):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=request["file"])
    with open(request["file"]) as file:
        described = {m["name"]: m for m in json.load(file)["materials"]}
    for material in bpy.data.materials:
        if material.name in described:
            rebuild(material, described[material.name])
    return set_up(512, 512)


def import_file(request):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=request["file"])
    answer = set_up(request["width"], request["height"])
    bpy.context.scene.cycles.use_light_tree = False
    return answer


def render(request):
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.seed = request["samples"], request["seed"]
    start = time.perf_counter()
    bpy.ops.render.render()
    seconds = time.perf_counter() - start
    if request.get("output"):
        bpy.data.images["Render Result"].save_render(filepath=request["output"])
    return {"seconds": seconds}


for line in sys.stdin:
    asked = json.loads(line)
    try:
        answer = {"load": load, "import": import_file, "render": render}[asked["do"]](asked)
    except Exception as error:  # told to the bench, which names the request
        answer = {"error": f"{type(error).__name__}: {error}"}
    print(json.dumps(answer), flush=True)
