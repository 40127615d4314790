#!/usr/bin/env python3
"""Albedo against the raster original's textures without light.

    albedo_original.py --q3rays target/release/q3rays MAP...

Renders the albedo of each map's first spawn point and compares it with the original's picture with `r_fullbright 1`, over the
pixels that show nothing but what is lit: no glow, sky, layer or reflection. The similarity is to the original's picture; the
ratio of the means is of linear values, to the original's without texture filtering, because it filters encoded values, which
makes rough textures darker than they are. Exits with 1 where a map has a similarity under 0.9, a mean more than 5% off or
fewer than half of its pixels compared. Needs numpy, OpenEXR and Pillow, and what original_view.sh needs.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR
from PIL import Image

SIZE = "640x360"
ORIGINAL = pathlib.Path(__file__).parent / "original_view.sh"
# Where `setviewpos` leaves the eye: a unit higher and, thrown forward at 400 units/s and braked in steps of 8 ms, this far on.
LIFT = 1
THROWN = 36.089
EYE_HEIGHT = 26


def plane(path):
    channels = OpenEXR.File(str(path)).channels()
    return np.squeeze(next(iter(channels.values())).pixels)


def decode(x):
    return np.where(x <= 0.04045, x / 12.92, np.power((x + 0.055) / 1.055, 2.4))


def encode(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)


def run(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True,
                          stdin=subprocess.DEVNULL).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--q3rays", required=True)
    parser.add_argument("maps", nargs="+")
    args = parser.parse_args()
    missed = []
    print("| map | SSIM | linear mean, ours over the original's | coverage |\n|---|---|---|---|")
    for name in args.maps:
        spawn = json.loads(run(args.q3rays, "info", name, "--json"))["spawns"][0]
        (x, y, z), yaw = spawn["origin"], spawn["angle"]
        with tempfile.TemporaryDirectory() as folder:
            f = pathlib.Path(folder)
            for mode in ["fullbright", "texels"]:
                run("bash", ORIGINAL, name, f"{x} {y} {z} {yaw}", f / f"{mode}.png", mode, SIZE)
            turn = math.radians(yaw)
            eye = [x + THROWN * math.cos(turn), y + THROWN * math.sin(turn), z + EYE_HEIGHT + LIFT, 0, yaw]
            run(args.q3rays, "render", name, "--backend", "cpu", "--camera=" + ",".join(map(str, eye)), "--size", SIZE,
                "--spp", 1, "--time", 1, "--aov", f, "--out", f / "image.exr")
            albedo = plane(f / "albedo.exr")
            dull = (plane(f / "emission.exr").sum(-1) == 0) & (plane(f / "transparent.exr").sum(-1) == 0)
            mask = dull & (plane(f / "material.exr") >= 0)
            texels = decode(np.asarray(Image.open(f / "texels.png").convert("RGB")) / 255)
            for image, path in [(encode(albedo), "ours.png"), (mask[..., None] * np.ones(3), "mask.png")]:
                Image.fromarray((image * 255 + 0.5).astype("uint8")).save(f / path)
            found = json.loads(run(args.q3rays, "compare", f / "ours.png", f / "fullbright.png", "--mask", f / "mask.png"))
            ratio = albedo[mask].mean() / texels[mask].mean()
            if found["ssim"] < 0.9 or abs(ratio - 1) > 0.05 or mask.mean() < 0.5:
                missed.append(name)
            print(f"| {name} | {found['ssim']:.3f} | {ratio:.3f} | {mask.mean():.3f} |", flush=True)
    sys.exit(f"missed by {missed}" if missed else 0)


main()
