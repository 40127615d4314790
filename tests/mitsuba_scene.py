"""Direct light on an exported map by Mitsuba's parts: what the eye sees, lamps, suns and domes."""

import sys

import mitsuba as mi
import numpy as np

import drjit as dr

from mitsuba_glb import Glb, Picture, to_mesh
from mitsuba_lamps import Lamps, learnt

WIDTH, HEIGHT, BLOCK = 320, 176, 16
FRONT, BACK, SKY, TESTED = 1, 2, 4, 8
MOST_LAYERS = 64
# Seeds from here on are the pilot samples'.
LEARNING = 1 << 30


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
        self.lamps = Lamps()
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
                self.add_lamp(glb, p, uv, extras["emission"], material)
        self.faces = Faces(groups)
        self.solid = Faces([g for g in groups if g[4] == 0])
        tested = [g for g in groups if g[4] > 0]
        self.tested = Faces(tested) if tested else None
        for sphere in self.about["spheres"]:
            if sphere["linear"]:
                sys.exit("lights of linear fall-off have no counterpart in Mitsuba")
            self.lamps.add_sphere(sphere)
        if self.lamps.makes:
            self.lamps.finish()

    def add_lamp(self, glb, p, uv, emission, material):
        if emission["textured"]:
            texels, clamps = glb.texture(material["emissiveTexture"]["index"])
            mean = float(texels[..., :3].mean())
            self.lamps.add_faces(p, uv, emission, Picture(texels[..., :3], clamps), mean)
        elif emission["sky_box"]:
            sides = material["extras"]["q3rays"]["sky_box"]
            sides = [Picture(glb.texture(s)[0][..., :3], True) for s in sides]
            self.lamps.add_faces(p, uv, emission, sky_box=sides)
        else:
            self.lamps.add_faces(p, uv, emission)

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
        # One kernel traces one scene (OptiX).
        dr.eval(out)
        return out | dr.isfinite(self.alpha_hit(ray, active & ~out))

    def leaves(self, si, direction, active):
        """Whether a ray's first hit is a sky face."""
        _, sky, end = self.first_hit(si, direction, active)
        return sky & dr.isfinite(end)

    def first_hit(self, si, direction, active):
        """A ray, whether it meets a sky face first, and how far it goes."""
        ray = si.spawn_ray(direction)
        pi = self.solid.scene.ray_intersect_preliminary(ray, False, active)
        met = active & pi.is_valid()
        sky = met & ((dr.gather(mi.UInt, self.solid.flags, pi.prim_index, met) & SKY) != 0)
        ray.maxt = dr.select(met, pi.t, dr.inf)
        dr.eval(sky, ray)
        alpha = self.alpha_hit(ray, active)
        return ray, sky & ~dr.isfinite(alpha), dr.minimum(ray.maxt, alpha)

    def learn(self, view, seed):
        """Chooses the lamps as one view needs them: two rounds of samples, none of which becomes part of the image."""
        if not self.lamps.makes:
            return
        powers = np.array(self.lamps.powers)
        # Nothing is known of where the lamps are: as many by power as alike.
        weights = 0.5 * powers / powers.sum() + 0.5 / len(powers)
        for turn in range(2):
            self.lamps.weigh(weights)
            squares = mi.Float(np.zeros(len(powers)))
            image, seen = self.pilot(view, seed + turn)
            means = blocks(image.reshape(HEIGHT, WIDTH, 1))[..., 0]
            scale = 1 / np.maximum(means, 0.1 * max(means.mean(), 1e-9))
            scale = np.repeat(np.repeat(scale, BLOCK, 0), BLOCK, 1).ravel()
            for pixel, value, which in seen:
                value *= dr.gather(mi.Float, mi.Float(scale), pixel)
                dr.scatter_reduce(dr.ReduceOp.Add, squares, dr.square(value), which, value > 0)
                dr.eval(squares)
            weights = learnt(powers, weights / weights.sum(), np.array(squares))
        self.lamps.weigh(weights)

    def pilot(self, view, seed, samples=64):
        """Lamps' light: the image, and each sample's pixel, value and lamp."""
        image, seen = np.zeros(WIDTH * HEIGHT), []
        for part in range(4):
            pixel, u, si, hit, face, normal = self.first(view, samples // 4, LEARNING + seed * 4 + part)
            value, which = self.to_lamps(si, hit, face, normal, mi.Point2f(u(), u()))
            value = dr.select(hit, dr.mean(value), 0)
            dr.eval(value, which, pixel)
            image += np.array(dr.block_sum(value, samples // 4)) / samples
            seen.append((pixel, value, which))
        return image, seen

    def first(self, view, samples, seed):
        """Surfaces that so many rays through each pixel meet."""
        count = WIDTH * HEIGHT
        # Not a constant of the kernels, which would be compiled anew for each part.
        states = mi.sample_tea_32(dr.opaque(mi.UInt, seed), dr.arange(mi.UInt, count * samples))
        rng = mi.PCG32(1, *states)
        u = lambda: rng.next_float32()  # noqa: E731
        pixel = dr.arange(mi.UInt, count * samples) // samples
        ray = view.rays(pixel, u(), u())
        si, hit = self.seen(ray)
        behind = dr.dot(si.n, ray.d) > 0
        face = dr.select(behind, -si.n, si.n)
        normal = si.sh_frame.n
        normal = dr.select(dr.dot(normal, si.n) < 0, si.n, normal)
        normal = dr.select(behind, -normal, normal)
        return pixel, u, si, hit, face, normal

    def direct(self, view, samples, seed):
        """Mean of so many samples of each pixel: irradiance/pi."""
        pixel, u, si, hit, face, normal = self.first(view, samples, seed)
        total = dr.zeros(mi.Color3f, dr.width(pixel))
        if self.lamps.makes:
            total += self.to_lamps(si, hit, face, normal, mi.Point2f(u(), u()))[0]
        if self.lamps.met:
            total += self.lamps_by_chance(si, hit, face, normal, mi.Point2f(u(), u()))
        for sun in self.about["suns"]:
            total += self.from_sun(sun, si, hit, face, normal, u(), u())
        if self.about["domes"]:
            total += self.from_domes(si, hit, face, normal, mi.Point2f(u(), u()))
        total = dr.select(hit, total, 0)
        return np.stack([np.array(dr.block_sum(c, samples), np.float64) for c in (total.x, total.y, total.z)], -1) / samples

    def to_lamps(self, si, hit, face, normal, u):
        """Light of points chosen on the lamps, and which lamps they are of."""
        ds, value, which = self.lamps.sample(si, hit, face, normal, u)
        lit = hit & (dr.max(value) > 0)
        ray = si.spawn_ray_to(ds.p)
        return dr.select(lit & ~self.blocked(ray, lit), value, 0), which

    def lamps_by_chance(self, si, hit, face, normal, u):
        """Light of lamps' faces that rays by the cosine meet: the other half of the power heuristic."""
        local = mi.warp.square_to_cosine_hemisphere(u)
        d = mi.Frame3f(normal).to_world(local)
        active = hit & (dr.dot(face, d) > 0)
        ray, _, end = self.first_hit(si, d, active)
        return self.lamps.chance(ray, local.z, end, active)

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


def blocks(image):
    """Means over blocks of BLOCK x BLOCK pixels."""
    h, w = image.shape[-3] // BLOCK, image.shape[-2] // BLOCK
    cut = image[..., : h * BLOCK, : w * BLOCK, :]
    return cut.reshape(*cut.shape[:-3], h, BLOCK, w, BLOCK, cut.shape[-1]).mean((-4, -2))
