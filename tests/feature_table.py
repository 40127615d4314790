#!/usr/bin/env python3
"""Pictures of every feature of the shader language beside the raster original's.

    feature_table.py --q3rays target/release/q3rays --out docs/features

For each feature that `q3rays info MAP --views` knows, a map is chosen (of those that have it the one that has been chosen
least, by name), the view that it names is rendered, and the part of it around the surface is put beside the same part of the
original's picture. Writes one picture per feature and README.md with the table. Needs Pillow, and what original_view.sh needs.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image

SIZE = (640, 360)
CROP = (240, 180)
EYE_HEIGHT = 26
# Where `setviewpos` leaves the eye: see albedo_original.py.
LIFT = 1
THROWN = 36.089
ORIGINAL = pathlib.Path(__file__).parent / "original_view.sh"


def views(program, name):
    run = subprocess.run([program, "info", name, "--views"], capture_output=True, text=True, check=True)
    return json.loads(run.stdout)


def choose(program):
    listed = subprocess.run([program, "maps"], capture_output=True, text=True, check=True).stdout
    names = sorted(line.split()[0] for line in listed.splitlines() if line.strip())
    by_feature, uses = {}, {}
    for name in names:
        if name != "showcase":
            for view in views(program, name):
                by_feature.setdefault(view["feature"], []).append((name, view))
    chosen = []
    # Rare features first: they have the least choice.
    for feature, found in sorted(by_feature.items(), key=lambda f: (len(f[1]), f[0])):
        name, view = min(found, key=lambda f: (uses.get(f[0], 0), f[0]))
        uses[name] = uses.get(name, 0) + 1
        chosen.append((feature, len(found), name, view))
    return sorted(chosen)


def crop(path, at):
    image = Image.open(path).convert("RGB")
    x = SIZE[0] / 2 * (1 + at[0])
    y = SIZE[1] / 2 - SIZE[0] / 2 * at[1]
    left = min(max(0, round(x - CROP[0] / 2)), SIZE[0] - CROP[0])
    top = min(max(0, round(y - CROP[1] / 2)), SIZE[1] - CROP[1])
    return image.crop((left, top, left + CROP[0], top + CROP[1]))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--q3rays", required=True)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--spp", default="48")
    parser.add_argument("--only", nargs="*", help="features to make pictures of; the others keep theirs")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for feature, maps, name, view in choose(args.q3rays):
        x, y, z = view["eye"]
        yaw = math.radians(view["yaw"])
        origin = (x - THROWN * math.cos(yaw), y - THROWN * math.sin(yaw), z - EYE_HEIGHT - LIFT)
        stem = feature.lower().replace(" ", "_")
        rows.append(f"| {feature} | {maps} | {name} | `{view['material']}` | ![{feature}]({stem}.jpg) |")
        if args.only is not None and feature not in args.only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            ours, original = f"{folder}/ours.png", f"{folder}/original.png"
            size = f"{SIZE[0]}x{SIZE[1]}"
            subprocess.run([args.q3rays, "render", name, "--backend", "cpu", f"--camera={x},{y},{z},0,{view['yaw']}", "--size",
                            size, "--spp", args.spp, "--time", "1", "--player", "sarge", "+set", "cg_drawGun", "0",
                            "--out", ours], check=True, capture_output=True)
            subprocess.run(["bash", ORIGINAL, name, " ".join(map(str, [*origin, view["yaw"]])), original, "lit", size],
                           check=True, stdin=subprocess.DEVNULL, capture_output=True)
            pair = Image.new("RGB", (2 * CROP[0] + 4, CROP[1]), "white")
            pair.paste(crop(ours, view["at"]), (0, 0))
            pair.paste(crop(original, view["at"]), (CROP[0] + 4, 0))
            pair.save(args.out / f"{stem}.jpg", quality=80)
        print(feature, name, view["material"], file=sys.stderr, flush=True)
    head = ["# Features of the shader language, q3rays beside the raster original", "",
            "Made by `tests/feature_table.py`, which also chooses map and view. Left: q3rays, "
            f"{args.spp} samples a pixel, the scene's clock at 1 s; right: ioquake3, whose clock stands elsewhere.", "",
            "| feature | maps with a view of it | map | material | q3rays, original |", "|---|---|---|---|---|"]
    (args.out / "README.md").write_text("\n".join(head + rows) + "\n")


main()
