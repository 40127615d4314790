#!/usr/bin/env python3
"""Holds q3rays' direct light against Mitsuba 3's on the scene that `q3rays export` writes.

    mitsuba_check.py --q3rays target/release/q3rays [--spp 4096] [--backend cpu ...] MAP[:SPAWN] ...

Needs numpy, pillow, openexr and mitsuba (its LLVM variant needs LLVM 19 or newer; DRJIT_LIBLLVM_PATH names the library where
it is not found). Surfaces are white in both (`r_lightmap 1`), ambient light is off. Geometry, cameras, lamps and alpha come from
the file; Mitsuba intersects, interpolates and samples the lamps, this script joins that to direct light by the rules that
docs/benchmark.md gives: sky faces stop rays to lamps, suns and domes shine through sky faces alone.

Bounds: the image's mean within 0.5%; of means over blocks of 16x16 pixels 99% within 2% of max(block, a tenth of the image's
mean) + 3 standard errors, these by 16 independent parts of the samples (Mitsuba's) and by the `variance` channel (ours).
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np
import OpenEXR
from PIL import Image

# The GPU's where there is one.
mi.set_variant("cuda_ad_rgb", "llvm_ad_rgb")
from mitsuba_glb import Glb  # noqa: E402
from mitsuba_scene import BLOCK, HEIGHT, WIDTH, Scene, View, blocks  # noqa: E402

PARTS = 16
MEAN_BOUND, BLOCK_BOUND, BLOCKS_WITHIN = 0.005, 0.02, 0.99
# Samples of each pixel in one launch.
LAUNCH = {"cuda_ad_rgb": 128, "llvm_ad_rgb": 32}


def theirs(scene, camera, spp, seed):
    """Images by so many independent parts of the samples."""
    view = View(camera)
    scene.learn(view, seed)
    per = spp // PARTS
    parts = []
    for part in range(PARTS):
        image, done = np.zeros((WIDTH * HEIGHT, 3)), 0
        while done < per:
            now = min(per - done, LAUNCH[mi.variant()])
            image += scene.direct(view, now, seed + (part << 20) + done) * now
            done += now
        parts.append(image / per)
    return np.array(parts).reshape(PARTS, HEIGHT, WIDTH, 3)


def planes(path):
    with OpenEXR.File(str(path)) as f:
        return {k: np.asarray(c.pixels, np.float64) for k, c in f.channels().items()}


def ours(args, name, spawn, folder, backend, spp):
    """Direct light and the variance of its mean."""
    out = pathlib.Path(folder)
    command = [args.q3rays, "render", name, "--spawn", str(spawn), "--size", f"{WIDTH}x{HEIGHT}", "--spp", str(spp)]
    command += ["--backend", backend, "--out", str(out / "image.exr"), "--aov", str(out), "--seed", "7"]
    subprocess.run(command + shared(args) + ["+set", "r_lightmap", "1"], check=True, stderr=subprocess.DEVNULL)
    direct, image = planes(out / "direct.exr"), planes(out / "image.exr")
    rgb = direct["RGB"] if "RGB" in direct else np.stack([direct[c] for c in "RGB"], -1)
    return rgb, image["variance"]


def shared(args):
    base = ["--basepath", args.basepath] if args.basepath else []
    game = ["--game", args.game] if args.game else []
    return base + game + ["+set", "rt_lights", args.lights, "+set", "rt_ambient", "off", "+set", "rt_emission", "game"]


def compare(a, variance, parts):
    """Figures of our image against the parts of theirs."""
    b = parts.mean(0)
    ratio = a.mean() / b.mean()
    part_blocks = blocks(parts).mean(-1)
    error_b = part_blocks.std(0, ddof=1) / np.sqrt(PARTS)
    error_a = np.sqrt(blocks(variance[..., None])[..., 0]) / BLOCK
    block_a, block_b = blocks(a).mean(-1), part_blocks.mean(0)
    # Rare bright samples: where the parts' median is far from their mean, it is the better middle.
    middle = np.median(part_blocks, 0)
    allowed = BLOCK_BOUND * np.maximum(block_b, 0.1 * b.mean()) + 3 * np.hypot(error_a, error_b)
    off = np.minimum(np.abs(block_a - block_b), np.abs(block_a - middle))
    spread = b.mean() and parts.mean((1, 2, 3)).std(ddof=1) / np.sqrt(PARTS) / b.mean()
    own = np.sqrt(variance.sum()) / variance.size / max(a.mean(), 1e-9)
    return {"ratio": ratio, "error_of_mean": spread, "own_error": own, "within": float((off <= allowed).mean()), "off": off, "allowed": allowed}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--q3rays", required=True)
    parser.add_argument("--basepath")
    parser.add_argument("--game")
    parser.add_argument("--lights", default="known", help="rt_lights")
    parser.add_argument("--spp", type=int, default=4096, help="of Mitsuba")
    parser.add_argument("--own-spp", type=int, default=1024)
    parser.add_argument("--backend", action="append", help="of q3rays; several may be named")
    parser.add_argument("--theirs", help="folder that keeps Mitsuba's images")
    parser.add_argument("--save", help="folder for pictures and arrays")
    parser.add_argument("--given", help="folder with our MAP_SPAWN/{direct,image}.exr made elsewhere")
    parser.add_argument("views", nargs="+", metavar="MAP[:SPAWN]")
    args = parser.parse_args()
    failed = 0
    loaded = (None, None)
    for text in args.views:
        name, _, spawn = text.partition(":")
        spawn = int(spawn or 0)
        with tempfile.TemporaryDirectory() as folder:
            glb = str(pathlib.Path(folder) / "map.glb")
            command = [args.q3rays, "export", name, glb, "--spawn", str(spawn)] + shared(args)
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            camera = Glb(glb).json["asset"]["extras"]["q3rays"]["camera"]
            kept = args.theirs and pathlib.Path(args.theirs) / f"{name}_{spawn}_{args.spp}.npz"
            if kept and kept.exists():
                parts = np.load(kept)["parts"].astype(np.float64)
            else:
                if loaded[0] != name:
                    loaded = (name, Scene(glb))
                parts = theirs(loaded[1], camera, args.spp, 1)
                if kept:
                    kept.parent.mkdir(parents=True, exist_ok=True)
                    np.savez_compressed(kept, parts=parts.astype(np.float32))
            images = {}
            for backend in args.backend or (["cpu", "bvh"] if not args.given else []):
                images[backend] = ours(args, name, spawn, folder, backend, args.own_spp)
            if args.given:
                there = pathlib.Path(args.given) / f"{name}_{spawn}"
                direct, image = planes(there / "direct.exr"), planes(there / "image.exr")
                rgb = direct["RGB"] if "RGB" in direct else np.stack([direct[c] for c in "RGB"], -1)
                images["given"] = (rgb, image["variance"])
        for backend, (a, variance) in images.items():
            result = compare(a, variance, parts)
            far = 3 * np.hypot(result["error_of_mean"], result["own_error"])
            good = abs(result["ratio"] - 1) <= MEAN_BOUND + far and result["within"] >= BLOCKS_WITHIN
            failed += not good
            print(
                f"{name} {spawn} {backend}: mean {result['ratio']:.4f} (theirs to {result['error_of_mean']:.4f}, ours to {result['own_error']:.4f}), "
                f"blocks within {result['within']:.4f} {'ok' if good else 'NOT MET'}",
                flush=True,
            )
            if args.save:
                to = pathlib.Path(args.save) / f"{name}_{spawn}"
                to.mkdir(parents=True, exist_ok=True)
                np.savez_compressed(to / f"{backend}.npz", ours=a, theirs=parts.mean(0), parts=blocks(parts), off=result["off"], allowed=result["allowed"])
                scale = 0.5 / max(parts.mean(), 1e-6)
                both = np.concatenate([a, parts.mean(0)], 1) * scale
                Image.fromarray((np.clip(both, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)).save(to / f"{backend}.png")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
