"""Lamps of an exported map as Mitsuba's emitters, and how often each is chosen."""

import mitsuba as mi
import numpy as np

import drjit as dr

from mitsuba_glb import to_mesh

# Lamps of one material that lie in one cube of so many units are one emitter: a choice that knows where they are.
CELL = 128.0
MOST_LAMPS = 64


class MetFaces:
    """Faces of lamps that rays meet one after another, of one half of all directions that they may face: the two sides of a
    sheet of water or lava are two lamps in the same place, of which a ray through one scene would meet one.
    """

    def __init__(self, met, half):
        kept = []
        for emitter, p, uv, both in met:
            corners = p.reshape(-1, 3, 3)
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            mine = np.repeat((normal @ [0.1234, 0.3456, 1.0] < 0) == half, 3)
            kept.append((emitter, p[mine], uv[mine], both))
        each = lambda k: mi.UInt(np.concatenate([np.full(len(m[1]) // 3, m[k], np.uint32) for m in kept]))  # noqa: E731
        self.count = sum(len(m[1]) for m in kept) // 3
        if self.count:
            p, uv = (np.concatenate([m[k] for m in kept]) for k in (1, 2))
            self.scene = mi.load_dict({"type": "scene", "faces": to_mesh("faces", p, uv)})
            self.emitter, self.both = each(0), each(3)


class Lamps:
    """Area lights (meshes of one radiance, a picture or a sky box over it) and spheres."""

    def __init__(self):
        self.pictures, self.boxes = [], []
        # Of each emitter: how to make it, its power, picture, sky box and sphere (one more than their index; 0 without).
        self.makes, self.powers, self.kinds = [], [], []
        # Of each emitter of faces that rays may meet by chance: its number, triangles, and whether both sides shine.
        self.met = []
        self.spheres = []

    def add_faces(self, p, uv, emission, picture=None, mean=1.0, sky_box=None):
        """Triangles (`p`: three corners each) that emit `emission`, with the picture's mean or a sky box's six pictures."""
        p, uv = p.reshape(-1, 3, 3), uv.reshape(-1, 3, 2)
        areas = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2
        p, uv, areas = p[areas > 0], uv[areas > 0], areas[areas > 0]
        if not len(p) or max(emission["radiance"]) <= 0:
            return
        if picture:
            self.pictures.append(picture)
        if sky_box:
            self.boxes.append(sky_box)
        kind = (len(self.pictures) if picture else 0, len(self.boxes) if sky_box else 0, 0)
        cells = np.floor(p.mean(1) / CELL)
        for cell in np.unique(cells, axis=0):
            mine = (cells == cell).all(1)
            corners, places, both = p[mine], uv[mine], bool(emission["two_sided"])
            if not sky_box:
                self.met.append((len(self.makes), corners.reshape(-1, 3), places.reshape(-1, 2), both))
            if both:
                corners = np.concatenate([corners, corners[:, ::-1]])
                places = np.concatenate([places, places[:, ::-1]])
            area = areas[mine].sum() * (1 + both)
            self.makes.append((emission["radiance"], corners.reshape(-1, 3), places.reshape(-1, 2), float(area)))
            self.powers.append(max(float(np.pi * area * np.mean(emission["radiance"]) * mean), 1e-6))
            self.kinds.append(kind)

    def add_sphere(self, sphere):
        self.spheres.append(sphere)
        self.makes.append(sphere)
        self.powers.append(float(np.mean(sphere["radiance"]) * 4 * np.pi**2 * sphere["radius"] ** 2))
        self.kinds.append((0, 0, len(self.spheres)))

    def finish(self):
        """Arrays of what `weigh` and `sample` look up."""
        self.count = len(self.makes)
        self.kinds = [mi.UInt(np.array(k, np.uint32)) for k in zip(*self.kinds)]
        if self.met:
            self.met_groups = [MetFaces(self.met, half) for half in (False, True)]
            faces = [make if isinstance(make, tuple) else ((0, 0, 0), 0, 0, 1) for make in self.makes]
            self.radiance = [mi.Float([float(f[0][c]) for f in faces]) for c in range(3)]
            self.areas = [f[3] for f in faces]
            self.by_chance = mi.Bool([isinstance(make, tuple) and bool(k == 0) for make, k in zip(self.makes, np.array(self.kinds[1]))])
        spots = [s["spot"] for s in self.spheres]
        each = lambda f: mi.Float([float(f(s)) for s in spots])  # noqa: E731
        if self.spheres:
            self.cosine = mi.Bool([bool(s["receiver_cosine"]) for s in self.spheres])
            self.is_spot = mi.Bool([bool(s) for s in spots])
            self.centre = [mi.Float([float(s["centre"][c]) for s in self.spheres]) for c in range(3)]
            self.axis = [each(lambda s, c=c: s["axis"][c] if s else 0) for c in range(3)]
            self.cone = each(lambda s: s["cone_radius_at_1"] if s else 0)
            self.edge = each(lambda s: s["edge"] if s else 1)

    def weigh(self, weights):
        """Mitsuba's emitters, chosen in proportion to `weights`."""
        made = {"type": "scene"}
        for i, make in enumerate(self.makes):
            name = f"emitter{i}"
            if isinstance(make, dict):
                emitter = area(make["radiance"], weights[i])
                made[name] = {"type": "sphere", "center": make["centre"], "radius": make["radius"], "emitter": emitter}
            else:
                radiance, p, uv, _ = make
                props = mi.Properties()
                props["emitter"] = mi.load_dict(area(radiance, weights[i]))
                props.set_id(name)
                made[name] = to_mesh(name, p, uv, props=props)
        self.scene = mi.load_dict(made)
        shapes = {s.id(): s for s in self.scene.shapes()}
        # Mitsuba names an emitter by its place in the registry.
        places = [dr.reinterpret_array(mi.UInt, mi.EmitterPtr(shapes[f"emitter{i}"].emitter()))[0] for i in range(self.count)]
        table = np.zeros(max(places) + 1, np.uint32)
        table[places] = np.arange(self.count)
        self.table = mi.UInt(table)
        if self.met:
            weights = np.array(weights)
            self.area_pdf = mi.Float(weights / weights.sum() / np.array(self.areas))

    def sample(self, si, hit, face, normal, u):
        """Points on lamps: their sample, its contribution/pi without visibility, and which lamps they are of.

        Faces that rays from the surface may meet by chance as well (`chance`) have that share of the power heuristic.
        """
        ds, weight = self.scene.sample_emitter_direction(si, u, False, hit)
        chosen = hit & (ds.pdf > 0)
        which = dr.gather(mi.UInt, self.table, dr.reinterpret_array(mi.UInt, ds.emitter), chosen)
        picture, box, sphere = (dr.gather(mi.UInt, k, which, chosen) for k in self.kinds)
        cosine = dr.select(dr.dot(face, ds.d) > 0, dr.maximum(dr.dot(normal, ds.d), 0), 0)
        for i, texture in enumerate(self.pictures):
            mine = chosen & (picture == i + 1)
            weight = dr.select(mine, weight * mi.Color3f(texture.at(ds.uv)), weight)
        for i, sides in enumerate(self.boxes):
            mine = chosen & (box == i + 1)
            weight = dr.select(mine, weight * sky_box(sides, ds.d), weight)
        if self.spheres:
            mine, index = chosen & (sphere > 0), sphere - 1
            flat = mine & ~dr.gather(mi.Bool, self.cosine, index, mine)
            cosine = dr.select(flat & (cosine > 0), 1, cosine)
            spot = mine & dr.gather(mi.Bool, self.is_spot, index, mine)
            weight = dr.select(spot, weight * self.spot(si.p, index, spot), weight)
        if self.met:
            both = chosen & dr.gather(mi.Bool, self.by_chance, which, chosen)
            weight = dr.select(both, weight * heuristic(ds.pdf, cosine / dr.pi), weight)
        return ds, dr.select(chosen, weight * cosine / dr.pi, 0), which

    def chance(self, ray, cosine, end, active):
        """Light of the faces of lamps along a ray drawn in proportion to the cosine, up to its end: contribution/pi."""
        return sum((self.chance_of(g, ray, cosine, end, active) for g in self.met_groups if g.count), mi.Color3f(0))

    def chance_of(self, met, ray, cosine, end, active):
        """The same of one group of faces."""
        total, start = mi.Color3f(0), mi.Float(0)
        active = mi.Bool(active)
        origin = mi.Point3f(ray.o)
        for _ in range(MOST_LAMPS):
            step = mi.Ray3f(origin + ray.d * start, ray.d)
            pi = met.scene.ray_intersect_preliminary(step, False, active)
            # The lamp's own face ends the ray as often as not: as much too short as Mitsuba's rays to points are.
            active &= pi.is_valid() & ((start + pi.t) * (1 - 1e-3) < end)
            which = dr.gather(mi.UInt, met.emitter, pi.prim_index, active)
            si = pi.compute_surface_interaction(step, mi.RayFlags.UV, active)
            facing = -dr.dot(si.n, ray.d)
            shines = active & ((facing > 0) | (dr.gather(mi.UInt, met.both, pi.prim_index, active) != 0))
            value = mi.Color3f(*(dr.gather(mi.Float, c, which, shines) for c in self.radiance))
            picture = dr.gather(mi.UInt, self.kinds[0], which, shines)
            for i, texture in enumerate(self.pictures):
                value = dr.select(picture == i + 1, value * mi.Color3f(texture.at(si.uv)), value)
            at = start + pi.t
            pdf = dr.gather(mi.Float, self.area_pdf, which, shines) * at * at / dr.maximum(dr.abs(facing), 1e-9)
            total += dr.select(shines, value * heuristic(cosine / dr.pi, pdf), 0)
            start = dr.select(active, at + 1e-5 * (dr.max(dr.abs(origin)) + at), start)
            dr.eval(total, active, start)
            if not dr.any(active):
                return total
        raise SystemExit("a ray meets more lamps than this script allows for")

    def spot(self, p, index, active):
        """What the map's compiler leaves of a spot at a point."""
        centre, axis = ([dr.gather(mi.Float, c, index, active) for c in v] for v in (self.centre, self.axis))
        from_centre, axis = p - mi.Point3f(*centre), mi.Vector3f(*axis)
        along = dr.dot(from_centre, axis)
        off = dr.norm(from_centre - axis * along)
        cone, edge = (dr.gather(mi.Float, v, index, active) for v in (self.cone, self.edge))
        return dr.select(along > 0, dr.clip((cone * along - off) / edge, 0, 1), 0)


def learnt(powers, probabilities, squares):
    """Weights of lamps for the least variance of one view: in proportion to the root of each one's mean squared contribution.

    `squares`: sums over samples of the squared contribution, already divided by the probability of the choice. A third of the
    choices stays with the powers and with all alike, so that a lamp that was not met is found.
    """
    root = np.sqrt(probabilities * squares)
    share = lambda w: w / max(w.sum(), 1e-30)  # noqa: E731
    return 0.7 * share(root) + 0.2 * share(powers) + 0.1 / len(powers)


def heuristic(a, b):
    """Share of a technique of density `a` beside another's `b`: the power heuristic (Veach 1997, 9.2)."""
    return a * a / dr.maximum(a * a + b * b, 1e-30)


def area(radiance, weight):
    radiance = {"type": "rgb", "value": [float(x) for x in radiance]}
    return {"type": "area", "radiance": radiance, "sampling_weight": float(weight)}


def sky_box(sides, d):
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
