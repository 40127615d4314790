#!/usr/bin/env python3
"""Albedo against the raster original's textures without light.

    albedo_original.py --q3rays target/release/q3rays --original SCRIPT MAP...

Renders the albedo of each map's first spawn point and compares it with the original's picture with `r_fullbright 1`, over the
pixels that show nothing but what is lit: no glow, sky, layer or reflection. SCRIPT is called as
`SCRIPT MAP "X Y Z YAW" OUT.png fullbright WxH`, with the place that `setviewpos` is given. Needs numpy, OpenEXR and Pillow.
"""

import argparse
import json
import math
import pathlib
import subprocess
import tempfile

import numpy as np
import OpenEXR
from PIL import Image

SIZE = "640x360"
# Where `setviewpos` leaves the eye: a unit higher and, thrown forward, this far on; found by looking for the best match.
LIFT = 1
THROWN = 26.4
EYE_HEIGHT = 26


def plane(path):
    channels = OpenEXR.File(str(path)).channels()
    return np.squeeze(next(iter(channels.values())).pixels)


def encode(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)


def run(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True,
                          stdin=subprocess.DEVNULL).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--q3rays", required=True)
    parser.add_argument("--original", required=True)
    parser.add_argument("--gamma", type=float, default=1.0, help="exponent on the original's picture")
    parser.add_argument("maps", nargs="+")
    args = parser.parse_args()
    print("| map | SSIM | mean, ours over the original's (encoded) | coverage |\n|---|---|---|---|")
    for name in args.maps:
        spawn = json.loads(run(args.q3rays, "info", name, "--json"))["spawns"][0]
        (x, y, z), yaw = spawn["origin"], spawn["angle"]
        with tempfile.TemporaryDirectory() as folder:
            f = pathlib.Path(folder)
            run("bash", args.original, name, f"{x} {y} {z} {yaw}", f / "original.png", "fullbright", SIZE)
            turn = math.radians(yaw)
            eye = [x + THROWN * math.cos(turn), y + THROWN * math.sin(turn), z + EYE_HEIGHT + LIFT, 0, yaw]
            run(args.q3rays, "render", name, "--backend", "cpu", "--camera=" + ",".join(map(str, eye)), "--size", SIZE,
                "--spp", 2, "--time", 1, "--aov", f, "--out", f / "image.exr")
            albedo = encode(plane(f / "albedo.exr"))
            dull = (plane(f / "emission.exr").sum(-1) == 0) & (plane(f / "transparent.exr").sum(-1) == 0)
            mask = dull & (plane(f / "material.exr") >= 0)
            original = np.power(np.asarray(Image.open(f / "original.png").convert("RGB")) / 255, args.gamma)
            for image, path in [(albedo, "ours.png"), (original, "original.png"), (mask[..., None] * np.ones(3), "mask.png")]:
                Image.fromarray((image * 255 + 0.5).astype("uint8")).save(f / path)
            found = json.loads(run(args.q3rays, "compare", f / "ours.png", f / "original.png", "--mask", f / "mask.png"))
            ratio = albedo[mask].mean() / original[mask].mean()
            print(f"| {name} | {found['ssim']:.3f} | {ratio:.3f} | {mask.mean():.3f} |", flush=True)


main()
