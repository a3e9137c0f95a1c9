"""Mitsuba's side of helio_bench: reads one JSON request a line, answers one JSON object a line.

usage: mitsuba_bench.py THREADS
  {"do": "load", "scene": NAME, "file": XML}             -> {"version", "variant"}
  {"do": "time", "scene": NAME, "samples": N, "seed": S}  -> {"seconds"}: one mi.render of N samples a pixel
  {"do": "resize", "scene": NAME, "width": W, "height": H} -> {}: the film of the scene's sensor, all of it
  {"do": "picture", "scene": NAME, "samples": N, "seed": S, "file": EXR} -> {"seconds"}: the picture as float EXR, in passes
         of at most 16 samples with a seed each, to bound memory; writing is not part of the seconds
  {"do": "curve", "scene": NAME, "step": N, "seed": S, "target": E, "limit": M, "reference": EXR}
      -> {"points": [[samples, seconds, relmse], ...]}: passes of N samples with a seed each, averaged, until relMSE =
         mean((x - r)^2 / (r^2 + 0.01)) has reached E or M samples are in; comparing is not part of the seconds
  {"do": "rays", "scene": NAME, "samples": N, "seed": S, "max_depth": D, "rr_depth": R}
      -> {"segments", "shadow_rays", "useful_shadow_rays", "difference"}: means a path of a render by counting_path.py,
         and how far its picture is from that of the scene's own integrator at this seed: mean(|x - y|) / mean(y)

Variant llvm_ad_rgb without gradients; the path integrator's own roulette depth, 5. A render counts as done when its
pixels are in memory (dr.eval and dr.sync_thread). The seconds are wall time.
"""
import json
import sys
import time

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
dr.set_thread_count(int(sys.argv[1]))
import counting_path  # noqa: E402, F401: registers an integrator of the variant
scenes = {}


def render(scene, samples, seed):
    with dr.suspend_grad():
        image = mi.render(scene, spp=samples, seed=seed)
        dr.eval(image)
        dr.sync_thread()
    return image


def load(request):
    scenes[request["scene"]] = mi.load_file(request["file"])
    return {"version": mi.__version__, "variant": mi.variant()}


def timed(request):
    start = time.perf_counter()
    render(scenes[request["scene"]], request["samples"], request["seed"])
    return {"seconds": time.perf_counter() - start}


def resize(request):
    parameters = mi.traverse(scenes[request["scene"]])
    sizes = [key for key in parameters.keys() if key.endswith("film.size")]
    if len(sizes) != 1:
        raise ValueError(f"{len(sizes)} films instead of one")
    whole = [request["width"], request["height"]]
    parameters[sizes[0]] = whole
    for key, value in (("crop_size", whole), ("crop_offset", [0, 0])):
        crop = sizes[0].removesuffix("size") + key
        if crop in parameters:
            parameters[crop] = value
    parameters.update()
    return {}


def picture(request):
    left, total, passes = request["samples"], None, 0
    start = time.perf_counter()
    while left > 0:
        samples = min(left, 16)
        image = render(scenes[request["scene"]], samples, request["seed"] * 65536 + passes) * samples
        total = image if total is None else total + image
        left -= samples
        passes += 1
    mean = total / request["samples"]
    dr.eval(mean)
    dr.sync_thread()
    seconds = time.perf_counter() - start
    bitmap = mi.Bitmap(mean).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    bitmap.write(request["file"])
    return {"seconds": seconds}


def curve(request):
    reference = np.array(mi.Bitmap(request["reference"]).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    reference = reference.astype(np.float64)
    points, total, seconds, passes = [], 0, 0.0, 0
    while passes * request["step"] < request["limit"]:
        start = time.perf_counter()
        image = render(scenes[request["scene"]], request["step"], request["seed"] * 65536 + passes)
        total = image if passes == 0 else total + image
        dr.eval(total)
        dr.sync_thread()
        seconds += time.perf_counter() - start
        passes += 1
        mean = np.array(total, dtype=np.float64).reshape(reference.shape) / passes
        relmse = float(np.mean((mean - reference) ** 2 / (reference**2 + 0.01)))
        points.append([passes * request["step"], seconds, relmse])
        if relmse <= request["target"]:
            break
    return {"points": points}


def rays(request):
    scene, samples, seed = scenes[request["scene"]], request["samples"], request["seed"]
    depths = {key: request[key] for key in ("max_depth", "rr_depth")}
    expected = np.array(render(scene, samples, seed), dtype=np.float64)[..., :3]
    with dr.suspend_grad():
        counted = mi.render(scene, integrator=mi.load_dict({"type": "counting_path", **depths}), spp=samples, seed=seed)
    counted = np.array(counted, dtype=np.float64)
    difference = np.abs(counted[..., :3] - expected).mean() / expected.mean()
    names = ("segments", "shadow_rays", "useful_shadow_rays")
    return {"difference": difference, **dict(zip(names, counted[..., -3:].mean((0, 1)).tolist()))}


ANSWERS = {"load": load, "time": timed, "resize": resize, "picture": picture, "curve": curve, "rays": rays}

for line in sys.stdin:
    request = json.loads(line)
    try:
        answer = ANSWERS[request["do"]](request)
    except Exception as error:  # told to the bench, which names the request
        answer = {"error": f"{type(error).__name__}: {error}"}
    print(json.dumps(answer), flush=True)
