#!/usr/bin/env python3
"""Renders the reference pictures of tests/references with Mitsuba 3, which shares no code with restir.

    pip install mitsuba numpy
    EXPORT_REFERENCES=FOLDER cargo test --test references -- --ignored
    python3 tests/references/make.py FOLDER tests/references

For each FOLDER/NAME.json two files are written: NAME.exr, the mean of independent renderings, linear RGB; and NAME-variance.exr,
for each pixel and channel the variance of that mean. The committed files were made with Mitsuba 3.9.1, scalar_rgb.
"""

import json
import pathlib
import sys

import mitsuba as mi
import numpy as np

RUNS = 16
SAMPLES = 256

mi.set_variant("scalar_rgb")


def write_ply(path, mesh):
    vertices = zip(mesh["positions"], mesh["normals"])
    faces = np.array(mesh["indices"]).reshape(-1, 3)
    with open(path, "w") as file:
        file.write(f"ply\nformat ascii 1.0\nelement vertex {len(mesh['positions'])}\n")
        for name in ("x", "y", "z", "nx", "ny", "nz"):
            file.write(f"property float {name}\n")
        file.write(f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
        for position, normal in vertices:
            file.write(" ".join(f"{c:.9g}" for c in position + normal) + "\n")
        for face in faces:
            file.write("3 " + " ".join(map(str, face)) + "\n")


def scene_of(description, folder):
    camera, size = description["camera"], description["size"]
    target = [p + f for p, f in zip(camera["position"], camera["forward"])]
    scene = {
        "type": "scene",
        # Mitsuba counts the segments of a path, restir its scattering events.
        "integrator": {"type": "path", "max_depth": description["depth"] + 1, "rr_depth": 1000},
        "sensor": {
            "type": "perspective",
            "fov": camera["fov"],
            "fov_axis": "y",
            "near_clip": 1e-3,
            "far_clip": 1e5,
            "to_world": mi.ScalarTransform4f().look_at(origin=camera["position"], target=target, up=camera["up"]),
            "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent", "sample_count": SAMPLES},
        },
    }
    rgb = lambda value: {"type": "rgb", "value": value}
    for i, mesh in enumerate(description["meshes"]):
        path = folder / f"{i}.ply"
        write_ply(path, mesh)
        shape = {"type": "ply", "filename": str(path),
                 "bsdf": {"type": "diffuse", "reflectance": rgb(mesh["color"])}}
        if any(mesh["emission"]):
            shape["emitter"] = {"type": "area", "radiance": rgb(mesh["emission"])}
        scene[f"mesh{i}"] = shape
    for i, point in enumerate(description["points"]):
        scene[f"point{i}"] = {"type": "point", "position": point["position"], "intensity": rgb(point["intensity"])}
    return mi.load_dict(scene)


def main(source, target):
    for path in sorted(source.glob("*.json")):
        folder = source / path.stem
        folder.mkdir(exist_ok=True)
        scene = scene_of(json.loads(path.read_text()), folder)
        runs = np.array([np.array(mi.render(scene, seed=seed)) for seed in range(RUNS)], dtype=np.float64)
        mean, variance = runs.mean(axis=0), runs.var(axis=0, ddof=1) / RUNS
        for name, picture in ((path.stem, mean), (f"{path.stem}-variance", variance)):
            mi.Bitmap(picture.astype(np.float32)).write(str(target / f"{name}.exr"))
        error = np.sqrt(variance.mean() / variance[..., 0].size) / mean.mean()
        print(f"{path.stem}: mean {mean.mean():.5f}, standard error about {100 * error:.3f} %")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
