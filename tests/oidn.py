#!/usr/bin/env python3
"""Holds the denoiser against Intel Open Image Denoise on the same input: a tool for developers, not a test.

    pip install numpy openexr mitsuba mitsuba-oidn
    q3rays render MAP --size 480x270 --spp 1 --aov DIR/aov_MAP --out DIR/MAP_raw1.exr
    q3rays render MAP --size 480x270 --spp 64 --out DIR/MAP_raw64.exr
    q3rays render MAP --size 480x270 --frames N --out DIR/MAP_denN.exr            (N = 1, 8, 64)
    q3rays render MAP --size 480x270 --spp 4096 --out DIR/MAP_truth.exr +set rt_numRandomDL 4 +set rt_lightCandidates 4 +set rt_seed 77
    tests/oidn.py path/to/q3rays DIR MAP...

Prints FLIP, rel_mse and time of each as a table.
"""
import json
import pathlib
import subprocess
import sys
import time

import numpy
import OpenEXR
from mitsuba_oidn import denoise


def read(path, names):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return numpy.ascontiguousarray(numpy.stack([channels[n].pixels for n in names], axis=-1), dtype=numpy.float32)


def write(path, pixels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    channels = {n: numpy.ascontiguousarray(pixels[..., i]) for i, n in enumerate("RGB")}
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))


def main():
    program, folder, maps = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3:]
    print("| map | image | FLIP | rel_mse | trimmed | mean | ms, CPU |\n|---|---|---|---|---|---|---|")
    for name in maps:
        albedo = numpy.clip(read(folder / f"aov_{name}/albedo.exr", "RGB"), 0, 1)
        normal = read(folder / f"aov_{name}/normal.exr", "XYZ")
        images = {f"q3rays, {n} frames": (folder / f"{name}_den{n}.exr", "") for n in (1, 8, 64)}
        for n in (1, 64):
            raw = folder / f"{name}_raw{n}.exr"
            images[f"raw, {n}"] = (raw, "")
            colour = read(raw, "RGB")
            denoise(colour, albedo, normal, hdr=True)
            start = time.perf_counter()
            result = denoise(colour, albedo, normal, hdr=True)
            took = (time.perf_counter() - start) * 1e3
            out = folder / f"{name}_oidn{n}.exr"
            write(out, result)
            images[f"OIDN, {n}"] = (out, f"{took:.0f}")
        for label, (path, took) in images.items():
            command = [program, "compare", str(path), str(folder / f"{name}_truth.exr")]
            figures = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
            f = [figures[k] for k in ("flip", "rel_mse", "rel_mse_trimmed", "mean_ratio")]
            print(f"| {name} | {label} | {f[0]:.4f} | {f[1]:.2e} | {f[2]:.2e} | {f[3]:.3f} | {took} |")


if __name__ == "__main__":
    main()
