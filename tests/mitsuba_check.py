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
import io
import json
import pathlib
import struct
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np
import OpenEXR
from PIL import Image

mi.set_variant("llvm_ad_rgb")
import drjit as dr  # noqa: E402

WIDTH, HEIGHT, BLOCK, PARTS = 320, 176, 16, 16
MEAN_BOUND, BLOCK_BOUND, BLOCKS_WITHIN = 0.005, 0.02, 0.99
FRONT, BACK, SKY, TESTED = 1, 2, 4, 8
MOST_LAYERS = 64


class Glb:
    """A binary glTF file."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        length = struct.unpack("<I", data[12:16])[0]
        self.json = json.loads(data[20 : 20 + length])
        self.binary = data[28 + length :]

    def view(self, number):
        v = self.json["bufferViews"][number]
        return self.binary[v["byteOffset"] :][: v["byteLength"]]

    def accessor(self, number):
        a = self.json["accessors"][number]
        kind = {5125: "<u4", 5126: "<f4"}[a["componentType"]]
        values = np.frombuffer(self.view(a["bufferView"]), kind)
        return values.reshape(a["count"], -1) if a["type"] != "SCALAR" else values

    def texture(self, number):
        """RGBA, colour linear, and whether it clamps."""
        t = self.json["textures"][number]
        png = self.view(self.json["images"][t["source"]]["bufferView"])
        texels = np.asarray(Image.open(io.BytesIO(png)).convert("RGBA"), np.float32) / 255
        low = texels[..., :3] <= 0.04045
        texels = texels.copy()
        texels[..., :3] = np.where(low, texels[..., :3] / 12.92, ((texels[..., :3] + 0.055) / 1.055) ** 2.4)
        return texels, self.json["samplers"][t["sampler"]]["wrapS"] == 33071


class Picture:
    """A texture that Dr.Jit looks up with bilinear filtering."""

    def __init__(self, texels, clamps):
        mode = dr.WrapMode.Clamp if clamps else dr.WrapMode.Repeat
        self.texture = mi.Texture2f(mi.TensorXf(np.ascontiguousarray(texels)), wrap_mode=mode)

    def at(self, uv):
        return self.texture.eval(uv)


def to_mesh(name, positions, uvs, normals=None, props=None):
    count = len(positions)
    kind = dict(has_vertex_normals=normals is not None, has_vertex_texcoords=True)
    mesh = mi.Mesh(name, count, count // 3, **kind, props=props or mi.Properties())
    params = mi.traverse(mesh)
    params["vertex_positions"] = np.ravel(positions)
    params["vertex_texcoords"] = np.ravel(uvs)
    params["faces"] = np.arange(count, dtype=np.uint32)
    if normals is not None:
        params["vertex_normals"] = np.ravel(normals)
    params.update()
    return mesh


class Faces:
    """Triangles that rays meet, with what is known of each."""

    def __init__(self, groups):
        joined = [np.concatenate([g[k] for g in groups]) for k in range(3)]
        self.scene = mi.load_dict({"type": "scene", "faces": to_mesh("faces", joined[0], joined[2], joined[1])})
        each = lambda k: mi.UInt(np.concatenate([np.full(len(g[0]) // 3, g[k], np.uint32) for g in groups]))  # noqa: E731
        self.flags, self.alpha = each(3), each(4)
        p = joined[0]
        normals = np.cross(p[1::3] - p[0::3], p[2::3] - p[0::3])
        self.normals = [mi.Float(np.ascontiguousarray(normals[:, c])) for c in range(3)]


class Scene:
    def __init__(self, path):
        glb = Glb(path)
        self.about = glb.json["asset"]["extras"]["q3rays"]
        groups = []
        self.alpha = []
        self.boxes = []
        emitters = {"type": "scene"}
        self.emitter_pictures = []
        lamps = []
        for node in glb.json["nodes"]:
            extras = node.get("extras", {}).get("q3rays")
            if extras is None:
                continue
            primitive = glb.json["meshes"][node["mesh"]]["primitives"][0]
            attributes = {k: glb.accessor(v) for k, v in primitive["attributes"].items()}
            order = glb.accessor(primitive["indices"])
            p, n, uv = (attributes[k][order] for k in ("POSITION", "NORMAL", "TEXCOORD_0"))
            material = glb.json["materials"][primitive["material"]]
            if extras["occludes"]:
                flags = FRONT * extras["drawn_front"] | BACK * extras["drawn_back"]
                flags |= SKY * (extras["kind"] == "sky")
                alpha = 0
                if extras["kind"] == "alpha_tested":
                    texels, clamps = glb.texture(material["pbrMetallicRoughness"]["baseColorTexture"]["index"])
                    self.alpha.append(Picture(texels[..., 3:], clamps))
                    alpha = len(self.alpha)
                flags |= TESTED * (alpha > 0)
                groups.append((p, n, uv, flags, alpha))
            elif extras["filters_light"]:
                print(f"note: {node['name']} tints light in q3rays and not here", file=sys.stderr)
            if extras["emission"]:
                lamps.append((glb, p, uv, extras["emission"], material))
        self.faces = Faces(groups)
        self.solid = Faces([g for g in groups if g[4] == 0])
        tested = [g for g in groups if g[4] > 0]
        self.tested = Faces(tested) if tested else None
        for lamp in lamps:
            self.add_lamp(emitters, *lamp)
        for s in self.about["spheres"]:
            if s["linear"]:
                sys.exit("lights of linear fall-off have no counterpart in Mitsuba")
            weight = float(np.mean(s["radiance"]) * 4 * np.pi * s["radius"] ** 2)
            emitters[f"emitter{len(self.emitter_pictures)}"] = {
                "type": "sphere",
                "center": s["centre"],
                "radius": s["radius"],
                "emitter": area(s["radiance"], weight),
            }
            self.emitter_pictures.append(s)
        self.lamps = mi.load_dict(emitters) if self.emitter_pictures else None
        # Emitters in the order of the pictures.
        if self.lamps:
            shapes = {s.id(): s for s in self.lamps.shapes()}
            self.emitters = [shapes[f"emitter{i}"].emitter() for i in range(len(self.emitter_pictures))]

    def add_lamp(self, emitters, glb, p, uv, emission, material):
        if emission["two_sided"]:
            p = np.concatenate([p, p.reshape(-1, 3, 3)[:, ::-1].reshape(-1, 3)])
            uv = np.concatenate([uv, uv.reshape(-1, 3, 2)[:, ::-1].reshape(-1, 2)])
        cross = np.cross(p[1::3] - p[0::3], p[2::3] - p[0::3])
        power = float(np.linalg.norm(cross, axis=1).sum() * np.mean(emission["radiance"]))
        if power <= 0:
            return
        picture = None
        if emission["textured"]:
            texels, clamps = glb.texture(material["emissiveTexture"]["index"])
            picture = Picture(texels[..., :3], clamps)
            power *= float(texels[..., :3].mean())
        elif emission["sky_box"]:
            sides = material["extras"]["q3rays"]["sky_box"]
            picture = [Picture(glb.texture(s)[0][..., :3], True) for s in sides]
        props = mi.Properties()
        props["emitter"] = mi.load_dict(area(emission["radiance"], max(power, 1e-6)))
        name = f"emitter{len(self.emitter_pictures)}"
        props.set_id(name)
        emitters[name] = to_mesh(name, p, uv, props=props)
        self.emitter_pictures.append(picture)

    def alpha_passes(self, scene, pi, ray, active):
        """Alpha test of hits of the alpha-tested faces' scene."""
        si = pi.compute_surface_interaction(ray, mi.RayFlags.UV, active)
        which = dr.gather(mi.UInt, scene.alpha, pi.prim_index, active)
        out = mi.Bool(False)
        for i, picture in enumerate(self.alpha):
            out |= active & (which == i + 1) & (picture.at(si.uv)[0] > 0.5)
        return out

    def nearest(self, faces, ray, active, passes):
        """The first hit of a group of faces that `passes`; infinitely far away without one."""
        found = dr.zeros(mi.PreliminaryIntersection3f, dr.width(ray))
        found.t = dr.full(mi.Float, dr.inf, dr.width(ray))
        if faces is None:
            return found
        active, start = mi.Bool(active), mi.Float(0)
        origin, end = mi.Point3f(ray.o), mi.Float(ray.maxt)
        for _ in range(MOST_LAYERS):
            step = mi.Ray3f(origin + ray.d * start, ray.d)
            step.maxt = end - start
            pi = faces.scene.ray_intersect_preliminary(step, False, active)
            active &= pi.is_valid()
            meets = passes(pi, step, active)
            at = start + pi.t
            pi.t = at
            found = dr.select(meets, pi, found)
            active &= ~meets
            # Past the face, as far as single precision needs.
            start = dr.select(active, at + 1e-5 * (dr.max(dr.abs(origin)) + at), start)
            dr.eval(found, active, start)
            if not dr.any(active):
                return found
        raise SystemExit("a ray meets more faces that it goes through than this script allows for")

    def seen(self, ray):
        """What the eye sees: the surface, and whether there is one that is no sky."""
        faces = self.faces

        def drawn(pi, step, active):
            flags = dr.gather(mi.UInt, faces.flags, pi.prim_index, active)
            normal = mi.Vector3f(*(dr.gather(mi.Float, c, pi.prim_index, active) for c in faces.normals))
            side = dr.select(dr.dot(normal, ray.d) <= 0, FRONT, BACK)
            return active & ((flags & side) != 0) & (((flags & TESTED) == 0) | self.alpha_passes(faces, pi, step, active))

        found = self.nearest(faces, ray, mi.Bool(True), drawn)
        hit = dr.isfinite(found.t)
        si = found.compute_surface_interaction(ray, active=hit)
        return si, hit & ((dr.gather(mi.UInt, faces.flags, found.prim_index, hit) & SKY) == 0)

    def alpha_hit(self, ray, active):
        """Distance to the first alpha-tested face that is there."""
        passes = lambda pi, step, on: self.alpha_passes(self.tested, pi, step, on)  # noqa: E731
        return self.nearest(self.tested, ray, active, passes).t

    def blocked(self, ray, active):
        out = self.solid.scene.ray_test(ray, active)
        return out | dr.isfinite(self.alpha_hit(ray, active & ~out))

    def leaves(self, si, direction, active):
        """Whether a ray's first hit is a sky face."""
        ray = si.spawn_ray(direction)
        pi = self.solid.scene.ray_intersect_preliminary(ray, False, active)
        met = active & pi.is_valid()
        met &= (dr.gather(mi.UInt, self.solid.flags, pi.prim_index, met) & SKY) != 0
        ray.maxt = pi.t
        return met & ~dr.isfinite(self.alpha_hit(ray, met))

    def sky_box(self, sides, d):
        """Radiance of a sky box in a direction: id's six pictures, z up."""
        a = dr.abs(d)
        vertical = (a.z >= a.x) & (a.z >= a.y)
        along_x = ~vertical & (a.x >= a.y)
        cases = [
            (along_x & (d.x > 0), -d.y, -d.z, a.x),
            (along_x & (d.x <= 0), d.y, -d.z, a.x),
            (~vertical & ~along_x & (d.y > 0), d.x, -d.z, a.y),
            (~vertical & ~along_x & (d.y <= 0), -d.x, -d.z, a.y),
            (vertical & (d.z > 0), -d.y, d.x, a.z),
            (vertical & (d.z <= 0), -d.y, -d.x, a.z),
        ]
        out = mi.Color3f(0)
        for picture, (mine, s, t, m) in zip(sides, cases):
            uv = mi.Point2f(s / m * 0.5 + 0.5, t / m * 0.5 + 0.5)
            out = dr.select(mine, mi.Color3f(picture.at(uv)), out)
        return out

    def direct(self, view, samples, seed):
        """Mean of so many samples of each pixel: irradiance/pi."""
        count = WIDTH * HEIGHT
        # Not a constant of the kernels, which would be compiled anew for each part.
        rng = mi.PCG32(size=count * samples, initstate=dr.opaque(mi.UInt64, seed))
        u = lambda: rng.next_float32()  # noqa: E731
        pixel = dr.arange(mi.UInt, count * samples) // samples
        ray = view.rays(pixel, u(), u())
        si, hit = self.seen(ray)
        behind = dr.dot(si.n, ray.d) > 0
        face = dr.select(behind, -si.n, si.n)
        normal = si.sh_frame.n
        normal = dr.select(dr.dot(normal, si.n) < 0, si.n, normal)
        normal = dr.select(behind, -normal, normal)
        total = dr.zeros(mi.Color3f, dr.width(pixel))
        if self.lamps:
            total += self.from_lamps(si, hit, face, normal, mi.Point2f(u(), u()))
        for sun in self.about["suns"]:
            total += self.from_sun(sun, si, hit, face, normal, u(), u())
        if self.about["domes"]:
            total += self.from_domes(si, hit, face, normal, mi.Point2f(u(), u()))
        total = dr.select(hit, total, 0)
        return np.array(dr.block_sum(mi.TensorXf(dr.ravel(total)).array, 1)).reshape(count, samples, 3).mean(1)

    @staticmethod
    def spot(light, p):
        """What the map's compiler leaves of a spot at a point."""
        from_centre = p - mi.Point3f(light["centre"])
        axis = mi.Vector3f(light["spot"]["axis"])
        along = dr.dot(from_centre, axis)
        off = dr.norm(from_centre - axis * along)
        inside = (light["spot"]["cone_radius_at_1"] * along - off) / light["spot"]["edge"]
        return mi.Color3f(dr.select(along > 0, dr.clip(inside, 0, 1), 0))

    def from_lamps(self, si, hit, face, normal, u):
        ds, weight = self.lamps.sample_emitter_direction(si, u, False, hit)
        cosine = dr.select(dr.dot(face, ds.d) > 0, dr.maximum(dr.dot(normal, ds.d), 0), 0)
        for emitter, picture in zip(self.emitters, self.emitter_pictures):
            plain = isinstance(picture, dict) and not picture["spot"] and picture["receiver_cosine"]
            if picture is None or plain:
                continue
            mine = hit & (ds.emitter == mi.EmitterPtr(emitter))
            if isinstance(picture, dict):
                if not picture["receiver_cosine"]:
                    cosine = dr.select(mine & (cosine > 0), 1, cosine)
                factor = self.spot(picture, si.p) if picture["spot"] else mi.Color3f(1)
            elif isinstance(picture, list):
                factor = self.sky_box(picture, ds.d)
            else:
                factor = mi.Color3f(picture.at(ds.uv))
            weight = dr.select(mine, weight * factor, weight)
        lit = hit & (ds.pdf > 0) & (cosine > 0) & (dr.max(weight) > 0)
        ray = si.spawn_ray_to(ds.p)
        return dr.select(lit & ~self.blocked(ray, lit), weight * cosine / dr.pi, 0)

    def from_sun(self, sun, si, hit, face, normal, u, v):
        radius, angle = dr.sqrt(u), 2 * dr.pi * v
        azimuth = sun["azimuth"] + sun["angular_radius"] * radius * dr.cos(angle)
        elevation = sun["elevation"] + sun["angular_radius"] * radius * dr.sin(angle)
        level = dr.cos(elevation)
        d = mi.Vector3f(level * dr.cos(azimuth), level * dr.sin(azimuth), dr.sin(elevation))
        cosine = dr.select(dr.dot(face, d) > 0, dr.maximum(dr.dot(normal, d), 0), 0)
        lit = hit & (cosine > 0)
        return dr.select(self.leaves(si, d, lit), mi.Color3f(sun["irradiance_over_pi"]) * cosine, 0)

    def from_domes(self, si, hit, face, normal, u):
        d = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
        lit = hit & (dr.dot(face, d) > 0)
        leaves = self.leaves(si, d, lit)
        total = mi.Color3f(0)
        for dome in self.about["domes"]:
            radiance = mi.Color3f(dome["radiance"])
            if not dome["even"]:
                level = dr.sqrt(dr.maximum(1 - d.z * d.z, 1e-8))
                radiance = dr.select(d.z > 0, radiance / (dr.pi * level), 0)
            total += radiance
        return dr.select(leaves, total, 0)


def area(radiance, weight):
    radiance = {"type": "rgb", "value": [float(x) for x in radiance]}
    return {"type": "area", "radiance": radiance, "sampling_weight": weight}


class View:
    def __init__(self, camera):
        pitch, yaw = np.radians(camera["pitch"]), np.radians(camera["yaw"])
        assert camera["roll"] == 0
        self.eye = camera["eye"]
        self.forward = [float(x) for x in (np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch))]
        self.right = [float(np.sin(yaw)), float(-np.cos(yaw)), 0.0]
        self.up = [float(x) for x in (np.sin(pitch) * np.cos(yaw), np.sin(pitch) * np.sin(yaw), np.cos(pitch))]
        self.half = float(np.tan(np.radians(camera["fov"] / 2)))

    def rays(self, pixel, u, v):
        # Not constants of the kernels, which would be compiled anew for each view.
        half, eye, forward, right, up = (
            dr.opaque(kind, value)
            for kind, value in (
                (mi.Float, self.half),
                (mi.Point3f, self.eye),
                (mi.Vector3f, self.forward),
                (mi.Vector3f, self.right),
                (mi.Vector3f, self.up),
            )
        )
        x = (2 * (pixel % WIDTH + u) / WIDTH - 1) * half
        y = (1 - 2 * (pixel // WIDTH + v) / HEIGHT) * half * HEIGHT / WIDTH
        return mi.Ray3f(eye, dr.normalize(forward + right * x + up * y))


def theirs(scene, camera, spp, seed):
    """Images by so many independent parts of the samples."""
    view = View(camera)
    per = spp // PARTS
    parts = []
    for part in range(PARTS):
        image, done = np.zeros((WIDTH * HEIGHT, 3)), 0
        while done < per:
            now = min(per - done, 32)
            image += scene.direct(view, now, seed + part * 1000 + done) * now
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


def blocks(image):
    h, w = image.shape[-3] // BLOCK, image.shape[-2] // BLOCK
    cut = image[..., : h * BLOCK, : w * BLOCK, :]
    return cut.reshape(*cut.shape[:-3], h, BLOCK, w, BLOCK, cut.shape[-1]).mean((-4, -2))


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
    return {"ratio": ratio, "error_of_mean": spread, "within": float((off <= allowed).mean()), "off": off, "allowed": allowed}


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
            far = 3 * result["error_of_mean"]
            good = abs(result["ratio"] - 1) <= MEAN_BOUND + far and result["within"] >= BLOCKS_WITHIN
            failed += not good
            print(
                f"{name} {spawn} {backend}: mean {result['ratio']:.4f} (theirs to {result['error_of_mean']:.4f}), "
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
