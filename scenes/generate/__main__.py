"""Writes the scenes of this directory, one for measuring, or a mesh of any number of triangles. Python 3.8 or later.

    python3 scenes/generate                                   write every scene next to this program
    python3 scenes/generate --check                           say whether the files are what would be written (exit 1: no)
    python3 scenes/generate --triangles 1000000 --output FILE.glb
    python3 scenes/generate --scene box-glass --output FILE.glb
"""

import argparse
import pathlib
import sys

import cornell
import furnace
import layers
import meshes
import study
import veach

SCENES = (cornell.cornell_box, cornell.cornell_glossy, cornell.cornell_spheres, cornell.cornell_covered,
          veach.veach_plates, furnace.furnace, layers.layers)
MAX_TRIANGLES = 50_000_000


def write_scenes(directory, check):
    different = []
    for make in SCENES:
        scene = make()
        path = directory / scene.name / (scene.name + ".gltf")
        content = scene.to_gltf()
        if check:
            if not path.is_file() or path.read_bytes() != content:
                different.append(path)
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        print(path)
    for path in different:
        print(f"{path}: differs from what would be written", file=sys.stderr)
    return 1 if different else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    parser.add_argument("--triangles", type=int, metavar="N", help=f"write a landscape of N triangles (1 to {MAX_TRIANGLES})")
    parser.add_argument("--scene", choices=sorted(study.SCENES), metavar="NAME",
                        help="write a scene for measuring: " + ", ".join(sorted(study.SCENES)))
    parser.add_argument("--output", type=pathlib.Path, metavar="FILE.glb", help="where to write that one scene")
    arguments = parser.parse_args()
    if arguments.triangles is None and arguments.scene is None:
        return write_scenes(pathlib.Path(__file__).resolve().parent.parent, arguments.check)
    if arguments.triangles is not None and arguments.scene is not None:
        parser.error("--triangles and --scene exclude each other")
    if arguments.output is None:
        parser.error("--triangles and --scene need --output")
    if arguments.scene is not None:
        arguments.output.write_bytes(study.SCENES[arguments.scene](arguments.scene).to_glb())
        return 0
    if not 1 <= arguments.triangles <= MAX_TRIANGLES:
        parser.error(f"--triangles is {arguments.triangles} (allowed: 1 to {MAX_TRIANGLES})")
    arguments.output.write_bytes(meshes.mesh_scene(arguments.triangles).to_glb())
    return 0


sys.exit(main())
